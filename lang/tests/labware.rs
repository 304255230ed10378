//! The labware definitions of the library: what assets that come from them have, against their JSON.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use matterix_ir::scene::{Scene, Shape};
use matterix_ir::{Diagnostic, FileId, Program, Sources};
use matterix_lang::labware::library::{self, Entry};
use matterix_lang::labware::summary;
use matterix_lang::{LibraryOnly, Loader, Options, compile};
use serde_json::Value;

/// How far a well may be from its place in the definition, m: a grid of evenly spaced wells is one line.
const EVEN: f64 = 2e-5;

/// The place of a deck, mm (ANSI SLAS 1-2004).
const PLACE: [f64; 2] = [127.76, 85.48];

/// Definitions compiled at once: a lab has at most 20,000 parts.
const AT_ONCE: usize = 16;

fn json(entry: &Entry) -> Value {
    let text = entry.text().expect(entry.name);
    serde_json::from_str(&text).expect(entry.name)
}

/// The wells that hold something, by name.
fn wells(definition: &Value) -> BTreeMap<&str, &Value> {
    let all = definition["wells"].as_object().expect("wells").iter();
    all.filter(|(_, well)| number(well, "totalLiquidVolume") > 0.0).map(|(name, well)| (name.as_str(), well)).collect()
}

fn number(value: &Value, member: &str) -> f64 {
    value[member].as_f64().unwrap_or_else(|| panic!("{member} of {value}"))
}

#[test]
fn the_library_has_the_definitions_of_its_package() {
    let all: Vec<Entry> = library::entries().collect();
    assert_eq!((library::newest().len(), all.len()), (163, 293));
    assert!(all.windows(2).all(|two| (two[0].name, two[0].version) < (two[1].name, two[1].version)));
    for entry in &all {
        let definition = json(entry);
        assert_eq!(definition["parameters"]["loadName"], entry.name);
        assert_eq!(definition["version"], entry.version);
        assert_eq!(definition["namespace"], "opentrons");
    }
}

#[test]
fn places_and_volumes_are_those_of_the_definition() {
    for entry in library::entries() {
        let definition = json(&entry);
        let short = summary(&definition.to_string()).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        assert_eq!(short.title, definition["metadata"]["displayName"].as_str().unwrap_or_default());
        let mut volumes: BTreeMap<u64, usize> = BTreeMap::new();
        for well in wells(&definition).values() {
            *volumes.entry(number(well, "totalLiquidVolume").to_bits()).or_default() += 1;
        }
        let counted: BTreeMap<u64, usize> = short.places.iter().map(|(count, v)| (v.to_bits(), *count)).collect();
        assert_eq!(counted, volumes, "{}/{}", entry.name, entry.version);
    }
}

#[test]
fn kinds_follow_from_categories_and_roles() {
    for (name, kind) in [
        ("corning_96_wellplate_360ul_flat", "WellPlate"),
        ("nest_12_reservoir_15ml", "Reservoir"),
        ("opentrons_15_tuberack_falcon_15ml_conical", "TubeRack"),
        ("opentrons_96_filtertiprack_200ul", "TipRack"),
        ("opentrons_1_trash_3200ml_fixed", "Trash"),
        ("opentrons_24_aluminumblock_nest_1.5ml_snapcap", "AluminumBlock"),
        // A block and an adapter for plates; the same with a plate is a plate.
        ("opentrons_96_well_aluminum_block", "Adapter"),
        ("opentrons_96_pcr_adapter", "Adapter"),
        ("opentrons_96_pcr_adapter_nest_wellplate_100ul_pcr_full_skirt", "WellPlate"),
        ("opentrons_tough_pcr_auto_sealing_lid", "Lid"),
        ("opentrons_calibrationblock_short_side_left", "Labware"),
        ("opentrons_calibration_adapter_temperature_module", "Labware"),
        ("protocol_engine_lid_stack_object", "Labware"),
    ] {
        let entry = library::find(name).expect(name);
        assert_eq!(summary(&entry.text().expect(name)).expect(name).capability, kind, "{name}");
    }
}

#[test]
fn a_name_may_have_a_version_and_a_name_space() {
    let version = |name: &str| library::find(name).map(|e| e.version);
    assert_eq!(version("corning_96_wellplate_360ul_flat"), Ok(5));
    assert_eq!(version("corning_96_wellplate_360ul_flat/2"), Ok(2));
    assert_eq!(version("opentrons/corning_96_wellplate_360ul_flat/2"), Ok(2));
    assert_eq!(version("corning_96_wellplate_360ul_flat/6"), Err(library::Missing::Version(vec![1, 2, 3, 4, 5])));
    let Err(library::Missing::Name(near)) = version("corning_96_welplate_360ul_flat") else { panic!("it is misspelt") };
    assert_eq!(near.first().map(String::as_str), Some("corning_96_wellplate_360ul_flat"));
    for (text, is_name) in [
        ("corning_6_wellplate_16.8ml_flat", true),
        ("opentrons/corning_6_wellplate_16.8ml_flat/3", true),
        ("plate.json", false),
        ("plates/mine", false),
        ("../secret", false),
        ("", false),
    ] {
        assert_eq!(library::is_name(text), is_name, "{text}");
    }
}

/// A lab with each of these definitions, `it0`, `it1` and so on.
fn lab(names: &[String], loader: &dyn Loader) -> (Option<Program>, Vec<Diagnostic>) {
    let mut text = "mtx 1\n".to_owned();
    for (k, name) in names.iter().enumerate() {
        text += &format!("asset It{k} from labware \"{name}\"\n");
    }
    text += "lab bench {\n    ambient: 20 degC\n";
    for k in 0..names.len() {
        text += &format!("    it{k} = It{k} at ({k}, 0, 0) m\n");
    }
    text += "}\nworkflow look in bench { wait 1 s }\n";
    let mut sources = Sources::default();
    let file = sources.add("bench.mtx", text);
    compile(&mut sources, file, loader, &Options::default())
}

/// The volume within an outline of radius and height, µL.
fn turned(outline: &[[f64; 2]]) -> f64 {
    let slice = |[[a, low], [b, high]]: [[f64; 2]; 2]| PI / 3.0 * (high - low) * (a * a + a * b + b * b) * 1e9;
    outline.windows(2).map(|two| slice([two[0], two[1]])).sum()
}

fn agrees(scene: &Scene, thing: &str, definition: &Value) {
    let known = wells(definition);
    let parts = scene.instances.iter().filter(|i| i.name.starts_with(&format!("{thing}[")) && i.name.ends_with(']'));
    assert_eq!(parts.count(), known.len(), "{thing}");
    let (size, is_schema_3) = match definition["dimensions"].as_object() {
        Some(_) => (["xDimension", "yDimension"].map(|m| number(&definition["dimensions"], m)), false),
        None => {
            let total = &definition["extents"]["total"];
            let across = |m: &str| (number(&total["frontRightTop"], m) - number(&total["backLeftBottom"], m)).abs();
            ([across("x"), across("y")], true)
        }
    };
    // What is wider than its place begins at the front left corner of it.
    let over = [size[0] - PLACE[0], size[1] - PLACE[1]];
    let is_wide = !is_schema_3 && over.iter().any(|o| *o > 5.0) && definition["metadata"]["displayCategory"] != "trash";
    let aside = if is_wide { over.map(|o| o / 2.0) } else { [0.0; 2] };
    for (name, well) in known {
        let part = scene.get(scene.find(&format!("{thing}[{name}]")).expect(name));
        let [x, y, z] = part.pose.position;
        // Places of schema 3 are seen from the back.
        let back = number(well, "y") + if is_schema_3 { size[1] / 2.0 } else { -size[1] / 2.0 };
        let across = number(well, "x") - size[0] / 2.0 + aside[0];
        let off = [x * 1e3 - across, y * 1e3 - back - aside[1], z * 1e3 - number(well, "z")];
        assert!(off.iter().all(|o| o.abs() < EVEN * 1e3), "{thing}[{name}] of {}: {off:?}", definition["metadata"]);
        if let (Some(room), false) = (&part.room, definition["parameters"]["isTiprack"] == true) {
            assert!((room.size()[2] * 1e3 - number(well, "depth")).abs() < 1e-9, "{thing}[{name}]");
            let volume = number(well, "totalLiquidVolume");
            match room {
                Shape::Turned { outside, inside } => {
                    assert_eq!(outside, inside, "a hole has no wall");
                    assert!(turned(inside) * 1.01 >= volume, "{thing}[{name}]: {} of {volume}", turned(inside));
                }
                other => assert!(matches!(other, Shape::Cylinder(_) | Shape::Box(_)), "{other:?}"),
            }
        }
    }
}

#[test]
fn every_definition_becomes_an_asset() {
    let newest = library::newest();
    for group in newest.chunks(AT_ONCE) {
        let names: Vec<String> = group.iter().map(|e| e.name.to_owned()).collect();
        let (program, found) = lab(&names, &LibraryOnly);
        let program = program.unwrap_or_else(|| panic!("{names:?}: {found:?}"));
        assert!(found.iter().all(|d| d.code.name == "unused"), "{names:?}: {found:?}");
        for (k, entry) in group.iter().enumerate() {
            agrees(&program.scene, &format!("it{k}"), &json(entry));
        }
    }
}

/// A folder of files, for what they are called.
struct Folder(&'static [(&'static str, &'static str)]);

impl Loader for Folder {
    fn load(&self, _: FileId, _: &str) -> Option<(String, String)> {
        None
    }

    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String> {
        self.file(from, path).map(String::into_bytes)
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        let found = self.0.iter().find(|(name, _)| *name == path);
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| "there is no such file".to_owned())
    }
}

const RESOURCES: Folder = Folder(&[
    ("plate.json", include_str!("../../tests/cases/pylabrobot/plate.json")),
    ("tips.json", include_str!("../../tests/cases/pylabrobot/tips.json")),
    ("trough.json", include_str!("../../tests/cases/pylabrobot/trough.json")),
    ("rack.json", include_str!("../../tests/cases/pylabrobot/rack.json")),
]);

/// Position, mm, and capability of a part.
fn place(scene: &Scene, name: &str) -> [f64; 3] {
    scene.get(scene.find(name).expect(name)).pose.position.map(|v| (v * 1e6).round() / 1e3)
}

#[test]
fn resources_of_pylabrobot_become_assets() {
    let names = ["plate.json", "tips.json", "trough.json", "rack.json"].map(str::to_owned);
    let (program, found) = lab(&names, &RESOURCES);
    let scene = program.unwrap_or_else(|| panic!("{found:?}")).scene;
    let kinds = ["it0", "it1", "it2", "it3"].map(|name| scene.get(scene.find(name).expect(name)).capabilities.clone());
    for (kinds, kind) in kinds.iter().zip(["WellPlate", "TipRack", "Reservoir", "TubeRack"]) {
        assert!(kinds.iter().any(|k| k == kind), "{kinds:?} has no {kind}");
    }
    // The corner of A1 is at (8.88, 44.74, 1) mm of 127.76 x 85.48 mm; it is 34 x 32 mm, and its floor 1 mm.
    assert_eq!(place(&scene, "it0[A1]"), [-38.0, 18.0, 2.0]);
    assert_eq!(place(&scene, "it0[B3]"), [38.0, -18.0, 2.0]);
    let room = |name: &str| scene.get(scene.find(name).expect(name)).room.clone();
    assert_eq!(room("it0[A1]"), Some(Shape::Box([0.034, 0.032, 0.017])));
    assert_eq!(place(&scene, "it1[A1]"), [-49.0, -9.0, 5.0]);
    assert_eq!(room("it2[A1]"), Some(Shape::Box([0.12, 0.08, 0.038])));
    // A tube in its holder: 20 + 14 mm from the left, 45 + 14 mm from the front.
    assert_eq!(place(&scene, "it3[A1]"), [-29.88, 16.26, 4.5]);
    assert_eq!(room("it3[A1]"), Some(Shape::Cylinder([0.028, 0.1085])));
}

#[test]
fn a_file_that_is_no_labware_says_why() {
    let carrier = r#"{"name":"c","type":"PlateCarrier","size_x":1,"size_y":1,"size_z":1,"category":"plate_carrier"}"#;
    let rack = r#"{"name":"c","type":"ContainerRack","size_x":1,"size_y":1,"size_z":1,"category":"container_rack"}"#;
    let endless =
        r#"{"name":"c","type":"Trough","size_x":1,"size_y":1,"size_z":1,"category":"trough","max_volume":"Infinity"}"#;
    for (text, wanted) in [
        (carrier, "`PlateCarrier` of PyLabRobot is not a plate, rack, trough, adapter or lid"),
        (rack, "it has no tubes: assign tubes to its places"),
        (endless, "the `max_volume` of `c` is not a number"),
        ("[1, 2]", "it has no `schemaVersion`"),
        ("", "it is not JSON"),
    ] {
        let said = summary(text).expect_err(text);
        assert!(said.contains(wanted), "{said}");
    }
}
