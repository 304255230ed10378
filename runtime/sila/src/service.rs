//! The feature that every server has: `org.silastandard/core/SiLAService/v1` (part A, appendix).

use matterix_sila::feature::{Basic, Command, DataType, Element, Feature, Named, Property};

/// Its identifier.
pub const IDENTIFIER: &str = "SiLAService";

/// The error where a feature is asked for that the server does not have.
pub const UNIMPLEMENTED: &str = "UnimplementedFeature";

/// The definition.
pub fn feature() -> Feature {
    let text = || DataType::Basic(Basic::String);
    let element = |identifier: &str, description: &str| Element {
        identifier: identifier.to_owned(),
        display: spaced(identifier),
        description: description.to_owned(),
        ty: text(),
    };
    let property = |identifier: &str, description: &str, ty: DataType| Property {
        identifier: identifier.to_owned(),
        display: spaced(identifier),
        description: description.to_owned(),
        observable: false,
        ty,
        errors: Vec::new(),
    };
    let command = |identifier: &str, description: &str| Command {
        identifier: identifier.to_owned(),
        display: spaced(identifier),
        description: description.to_owned(),
        ..Command::default()
    };
    let features = DataType::List(Box::new(text()));
    Feature {
        identifier: IDENTIFIER.to_owned(),
        display: "SiLA Service".to_owned(),
        description: "Information about the server and its features.".to_owned(),
        originator: "org.silastandard".to_owned(),
        category: "core".to_owned(),
        version: (1, 0),
        commands: vec![
            Command {
                parameters: vec![element("FeatureIdentifier", "The full identifier of a feature.")],
                responses: vec![element("FeatureDefinition", "The definition as XML.")],
                errors: vec![UNIMPLEMENTED.to_owned()],
                ..command("GetFeatureDefinition", "Returns the definition of a feature.")
            },
            Command {
                parameters: vec![element("ServerName", "The new name.")],
                ..command("SetServerName", "Names the server.")
            },
        ],
        properties: vec![
            property("ServerName", "Its name.", text()),
            property("ServerType", "The type of the server.", text()),
            property("ServerUUID", "Its identifier.", text()),
            property("ServerDescription", "The purpose of the server.", text()),
            property("ServerVersion", "The version of its program.", text()),
            property("ServerVendorURL", "The website of the vendor of its program.", text()),
            property("ImplementedFeatures", "The full identifiers of its features.", features),
        ],
        metadata: Vec::new(),
        errors: vec![Named {
            identifier: UNIMPLEMENTED.to_owned(),
            display: spaced(UNIMPLEMENTED),
            description: "The server does not have this feature.".to_owned(),
        }],
        types: Vec::new(),
    }
}

/// An identifier for people: `Get Feature Definition`, `Turn For A While`, `Server UUID`.
pub fn spaced(identifier: &str) -> String {
    let mut out = String::new();
    let mut before = None;
    let mut rest = identifier.chars();
    while let Some(c) = rest.next() {
        let is_small = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
        let begins = rest.as_str().starts_with(is_small);
        if c.is_ascii_uppercase() && before.is_some_and(|b: char| is_small(b) || begins) {
            out.push(' ');
        }
        out.push(c);
        before = Some(c);
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn identifiers_are_spaced_into_words() {
        for (identifier, words) in [
            ("GetFeatureDefinition", "Get Feature Definition"),
            ("TurnForAWhile", "Turn For A While"),
            ("ServerUUID", "Server UUID"),
            ("ServerVendorURL", "Server Vendor URL"),
            ("T", "T"),
        ] {
            assert_eq!(super::spaced(identifier), words);
        }
    }
}
