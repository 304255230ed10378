//! Features are read, written and read again; what is no feature is refused in words.

use matterix_sila::feature::{
    Basic, Command, Constraints, DataType, Element, Feature, Metadata, Named, Property, SiUnit,
};
use matterix_sila::words::{identifier, name, words};
use matterix_sila::{read, write};
use proptest::prelude::*;

const PLATE: &str = include_str!("../../../tests/deploy/hotplate.sila.xml");

#[test]
fn a_feature_is_read_whole() {
    let feature = read(PLATE).expect("the feature is sound");
    assert_eq!(feature.id(), "org.example/heating/HotPlate/v1");
    assert_eq!(feature.service(), "sila2.org.example.heating.hotplate.v1.HotPlate");
    assert_eq!(feature.commands.len(), 4);
    let hold = feature.command("HoldTemperature").expect("it is there");
    assert!(hold.observable && hold.errors == ["SensorFailed"]);
    let unit = hold.parameters[0].ty.constraints().and_then(|c| c.unit.clone()).expect("a unit");
    assert_eq!((unit.factor, unit.offset, unit.components), (60.0, 0.0, vec![(3, 1)]));
    assert_eq!(read(&write(&feature)).as_ref(), Ok(&feature));
}

/// Metadata that names an error that the feature does not define.
const METADATA: &str = "<Metadata><Identifier>Token</Identifier><DisplayName/><Description/><DataType><Basic>String</Basic>\
    </DataType><DefinedExecutionErrors><Identifier>Unknown</Identifier></DefinedExecutionErrors></Metadata></Feature>";

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let cases = [
        ("<Feature", "<Features", "not `Feature`"),
        ("<Observable>No</Observable>", "<Observable>no</Observable>", "not `no`"),
        ("<Basic>Boolean</Basic>", "<Basic>Bool</Basic>", "unknown basic type `Bool`"),
        ("<SIUnit>Kelvin</SIUnit>", "<SIUnit>Celsius</SIUnit>", "unknown base unit `Celsius`"),
        ("<Identifier>Quiet</Identifier>", "<Identifier>Mode</Identifier>", "`Mode` is defined twice"),
        ("<Identifier>Stop</Identifier>", "<Identifier>stop it</Identifier>", "not an identifier"),
        ("<DataTypeIdentifier>PlateTemperature", "<DataTypeIdentifier>Plate", "`Plate` is not defined"),
        ("<Factor>60</Factor>", "<Factor>0</Factor>", "must not be 0"),
        ("FeatureVersion=\"1.0\"", "FeatureVersion=\"one\"", "as in `1.0`"),
        ("<Set>", "<Sets>", "unknown constraint `Sets`"),
        ("</Feature>", METADATA, "the error `Unknown` is not defined"),
        ("</Feature>", "", "line"),
    ];
    for (from, to, wanted) in cases {
        let text = PLATE.replacen(from, to, 1);
        let text = match to {
            "<Features" => text.replace("</Feature>", "</Features>"),
            "<Sets>" => text.replacen("</Set>", "</Sets>", 1),
            _ => text,
        };
        let problem = read(&text).expect_err(from).to_string();
        assert!(problem.contains(wanted) && problem.starts_with("line "), "{from}: {problem}");
    }
}

#[test]
fn a_type_that_holds_itself_is_refused() {
    let ty = "<Constrained>\n          <DataType><Basic>Real</Basic></DataType>\n          <Constraints>\n          <MaximalInclusive>340";
    assert!(!PLATE.contains(ty), "the test says what it replaces");
    let at = PLATE.find("<DataTypeDefinition>").expect("it is there");
    let (head, tail) = PLATE.split_at(at);
    let (before, rest) = tail.split_once("<DataType>").expect("it is there");
    let (_, after) = rest.split_once("</DataTypeDefinition>").expect("it is there");
    let own = "<DataType><Structure><Element><Identifier>A</Identifier><DisplayName/><Description/><DataType>\
               <DataTypeIdentifier>PlateTemperature</DataTypeIdentifier></DataType></Element></Structure></DataType>";
    let problem = read(&format!("{head}{before}{own}</DataTypeDefinition>{after}")).expect_err("endless");
    assert!(problem.message.contains("contains itself"), "{problem}");
}

#[test]
fn words_and_identifiers_go_both_ways() {
    assert_eq!(words("SetTargetTemperature"), ["set", "target", "temperature"]);
    assert_eq!(words("ReadPH"), ["read", "ph"]);
    assert_eq!(words("PHValue"), ["ph", "value"]);
    assert_eq!(name("Oven2Temperature"), "oven2_temperature");
    assert_eq!(identifier("stop heating"), "StopHeating");
    assert_eq!(identifier("ot2.left"), "Ot2Left");
    assert_eq!(identifier("µ"), "X");
}

fn text() -> impl Strategy<Value = String> {
    "[ -~äµ°]{0,12}".prop_map(|t| t.trim().to_owned())
}

fn named() -> impl Strategy<Value = (String, String, String)> {
    ("[A-Z][a-zA-Z0-9]{0,8}", text(), text())
}

fn data_type() -> impl Strategy<Value = DataType> {
    let basic = (0..Basic::ALL.len()).prop_map(|i| DataType::Basic(Basic::ALL[i].1));
    let unit = (text(), -1e3..1e3f64, proptest::collection::vec((1..8usize, 1..4i32), 0..3));
    let number =
        (unit, proptest::option::of((-1e6..0.0f64, any::<bool>()))).prop_map(|((label, factor, parts), least)| {
            let unit = SiUnit { label, factor: factor.abs() + 0.5, offset: factor, components: parts };
            let constraints =
                Constraints { unit: Some(unit), least, greatest: Some((1.5, false)), ..Default::default() };
            DataType::Constrained(Box::new(DataType::Basic(Basic::Real)), Box::new(constraints))
        });
    let words = proptest::collection::vec("[a-z]{1,5}", 1..4).prop_map(|set| {
        let constraints = Constraints { set, ..Default::default() };
        DataType::Constrained(Box::new(DataType::Basic(Basic::String)), Box::new(constraints))
    });
    // A least size of 0 is none.
    let sizes = || (proptest::option::of(1..4u64), proptest::option::of(4..9u64));
    let long = (sizes(), proptest::option::of("[a-z]{1,5}")).prop_map(|(length, pattern)| {
        let constraints = Constraints { length, pattern, ..Default::default() };
        DataType::Constrained(Box::new(DataType::Basic(Basic::String)), Box::new(constraints))
    });
    let list = sizes().prop_map(|count| {
        let constraints = Constraints { count, ..Default::default() };
        let list = DataType::List(Box::new(DataType::Basic(Basic::Real)));
        DataType::Constrained(Box::new(list), Box::new(constraints))
    });
    let leaf = prop_oneof![basic, number, words, long, list];
    leaf.prop_recursive(2, 8, 3, |inner| {
        let part = (named(), inner.clone()).prop_map(|((identifier, display, description), ty)| Element {
            identifier,
            display,
            description,
            ty,
        });
        prop_oneof![
            inner
                .prop_filter("lists hold no lists", |t| !matches!(t.plain(), DataType::List(_)))
                .prop_map(|t| DataType::List(Box::new(t))),
            proptest::collection::vec(part, 1..3).prop_map(DataType::Structure),
        ]
    })
}

/// Identifier, and what people read.
type Head = (String, String, String);

/// A command: given and answered.
type Told = (Head, bool, DataType, DataType);

fn feature() -> impl Strategy<Value = Feature> {
    let commands = proptest::collection::vec((named(), any::<bool>(), data_type(), data_type()), 0..3);
    let properties = proptest::collection::vec((named(), any::<bool>(), data_type()), 0..3);
    (named(), commands, properties, data_type(), named()).prop_map(|(head, commands, properties, beside, error)| {
        let numbered = |name: &str, i: usize| format!("{name}N{i}");
        let element = |ty| Element { identifier: "A".into(), display: "a".into(), description: String::new(), ty };
        let command = |(i, (head, observable, given, answered)): (usize, Told)| Command {
            identifier: numbered(&head.0, i),
            display: head.1,
            description: head.2,
            observable,
            parameters: vec![element(given)],
            responses: vec![element(answered)],
            intermediate: Vec::new(),
            errors: vec![error.0.clone()],
        };
        let property = |(i, (head, observable, ty)): (usize, (Head, bool, DataType))| Property {
            identifier: numbered(&head.0, i),
            display: head.1,
            description: head.2,
            observable,
            ty,
            errors: Vec::new(),
        };
        Feature {
            identifier: head.0,
            display: head.1,
            description: head.2,
            originator: "org.example".into(),
            category: "tests".into(),
            version: (1, 2),
            commands: commands.into_iter().enumerate().map(command).collect(),
            properties: properties.into_iter().enumerate().map(property).collect(),
            metadata: vec![Metadata { element: element(beside), errors: vec![error.0.clone()] }],
            errors: vec![Named { identifier: error.0.clone(), display: error.1.clone(), description: error.2.clone() }],
            types: Vec::new(),
        }
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(feature in feature()) {
        prop_assert_eq!(read(&write(&feature)), Ok(feature));
    }

    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
        let _ = read(&text);
    }

    /// Features with bytes of other features in them.
    #[test]
    fn damaged_features_are_read_or_refused(from in 0..PLATE.len(), to in 0..PLATE.len(), length in 0..40usize) {
        let mut bytes = PLATE.as_bytes().to_vec();
        let piece = bytes[from..(from + length).min(PLATE.len())].to_vec();
        bytes.splice(to..(to + length / 2).min(PLATE.len()), piece);
        if let Ok(feature) = read(&String::from_utf8_lossy(&bytes)) {
            prop_assert_eq!(read(&write(&feature)), Ok(feature));
        }
    }
}
