//! What goes beside calls, as both sides see it (part B, "SiLA Client Metadata").

use matterix_sila::feature::{Basic, DataType, Element};
use prost::Message;

use crate::framework::Text;
use crate::raw::Raw;

/// Who defines the features below.
pub(crate) const STANDARD: &str = "org.silastandard";
/// The standard's feature by which a client takes a server for itself.
pub(crate) const LOCK: &str = "LockController";
/// The one by which people log in.
pub(crate) const LOGIN: &str = "AuthenticationService";
/// The one by which calls say who makes them.
pub(crate) const ACCESS: &str = "AuthorizationService";

/// How keys of metadata begin.
pub(crate) const PREFIX: &str = "sila-";

/// The header of a metadata of a feature: `sila-org.silastandard-core-lockcontroller-v1-metadata-lockidentifier-bin`.
pub(crate) fn key(feature: &str, name: &str) -> String {
    format!("{PREFIX}{feature}/metadata/{name}-bin").to_lowercase().replace('/', "-")
}

/// A text as it goes in such a header.
pub(crate) fn message(text: &str) -> Vec<u8> {
    let field = Text { value: text.to_owned() }.encode_to_vec();
    Raw { fields: vec![(1, field)] }.encode_to_vec()
}

/// The text of such a header; nothing where it is none.
pub(crate) fn text(message: &[u8]) -> Option<String> {
    let raw = Raw::decode(message).ok()?;
    let mut all = raw.all(1);
    let (field, None) = (all.next()?, all.next()) else { return None };
    Text::decode(field).ok().map(|text| text.value)
}

/// What a server answers when it is asked what calls a metadata belongs to.
pub(crate) fn affected() -> Element {
    Element {
        identifier: "AffectedCalls".to_owned(),
        display: String::new(),
        description: String::new(),
        ty: DataType::List(Box::new(DataType::Basic(Basic::String))),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn metadata_go_in_headers_of_the_standards_form() {
        let key = super::key("org.silastandard/core/LockController/v1", "LockIdentifier");
        assert_eq!(key, "sila-org.silastandard-core-lockcontroller-v1-metadata-lockidentifier-bin");
        assert_eq!(super::text(&super::message("ana")), Some("ana".to_owned()));
        assert_eq!(super::text(b"\xff"), None);
        assert_eq!(super::text(b""), None);
    }
}
