//! Grids, labware definitions and pipetting: what is found before a run, what fails in one, under which name.

use crate::harness::{folder, matterixc_in, write};

const DECK: &str = "mtx 1
use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300, TrashBin}
species dye { by: mass, density: 1 g/mL, specific_heat: 4 J/(g*K) }
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[2]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 12 mL of water, A2: 5 mL of dye }
    bin = TrashBin on ot2.slot[11]
}
";

/// Codes and headlines of `check` on a text.
fn findings(name: &str, text: &str) -> Vec<(String, String)> {
    let dir = folder(&format!("grids_{name}"));
    write(&dir, "deck.mtx", text);
    let lines = matterixc_in(&dir, &["check", "deck.mtx", "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    lines.iter().map(|l| (text(&l["code"]), text(&l["headline"]))).collect()
}

fn only(name: &str, text: &str) -> String {
    let found = findings(name, text);
    let [(code, headline)] = found.as_slice() else { panic!("{name}: {found:?}\n{text}") };
    format!("{code}: {headline}")
}

#[test]
fn wells_that_are_not_there_are_reported_with_what_is() {
    let step = |step: &str| format!("{DECK}workflow w in deck {{\n{step}\n}}\n");
    for (name, text, wanted) in [
        (
            "beyond",
            "note \"a\"\nexpect plate[A13].room > 0 mL",
            "unknown-member: `plate` has no `A13`: it has A1 .. H12",
        ),
        ("trough", "expect stock[B1].room > 0 mL", "unknown-member: `stock` has no `B1`: it has A1 .. A12"),
        ("slot", "expect plate.support == ot2.slot[12]", "unknown-member: `ot2.slot` has no `12`: it has 1 .. 11"),
        ("row", "for w in plate.row(9) { note \"x\" }", "unknown-member: `plate` has 8 rows"),
        ("back", "for w in plate[C1 .. A1] { note \"x\" }", "empty-range: the range `C1 .. A1` is empty"),
        ("corners", "for w in plate[A1 .. 3] { note \"x\" }", "unknown-member: `plate` has no `3`: it has A1 .. H12"),
        ("list", "for w in ot2 { note \"x\" }", "type-mismatch: cannot loop over an instance"),
        (
            "kind",
            "aspirate 50 uL from tips[A1] by ot2.left",
            "type-mismatch: `source` expects Vessel, but `tips[A1]` is Tip",
        ),
        (
            "whole",
            "aspirate 50 uL from plate by ot2.left",
            "type-mismatch: `source` expects Vessel, but `plate` is Corning96",
        ),
        (
            "counts",
            "transfer 50 uL from stock[A1 .. A2] to plate[A1 .. C1] by ot2.left using tips { tips: each }",
            "wrong-arguments: 2 sources cannot go to 3 targets one by one",
        ),
        (
            "tips",
            "transfer 50 uL from stock[A1] to plate[A1] by ot2.left using tips",
            "wrong-arguments: `transfer` needs the option `tips`",
        ),
        (
            "empty",
            "let none = [1, 2].pairs.last.second\nlet x = [1].pairs.first",
            "empty-range: the list is empty: it has no `first`",
        ),
    ] {
        assert_eq!(only(name, &step(text)), wanted, "{text}");
    }
}

#[test]
fn slips_in_grids_and_their_contents_are_reported() {
    let lab = |asset: &str, line: &str| format!("mtx 1\n{asset}\nlab l {{\nambient: 22 degC\n{line}\n}}\n");
    let plate = "asset P: WellPlate { wells[A1 .. B2] = Well { max_volume: 1 mL } pitch (9, 9) mm }";
    for (name, text, wanted) in [
        (
            "twice",
            lab(plate, "p = P at (0, 0, 0) m holding { A1 .. B1: 1 uL of water, B1: 2 uL of water }"),
            "duplicate-name: `p[B1]` is filled twice",
        ),
        (
            "which",
            lab(plate, "p = P at (0, 0, 0) m holding 1 uL of water"),
            "type-mismatch: `p` (P) cannot hold anything",
        ),
        (
            "none",
            lab("", "t = OpticalTable at (0, 0, 0) m holding { A1: 1 uL of water }"),
            "type-mismatch: `t` (OpticalTable) has no separate places to fill",
        ),
        (
            "place",
            lab("asset P: WellPlate { wells[A1 .. b2] = Well { max_volume: 1 mL } }", ""),
            "type-mismatch: `b2` is not a place of a grid",
        ),
        (
            "many",
            lab("asset P: WellPlate { wells[A1 .. ZZ9999] = Well { max_volume: 1 mL } }", ""),
            "out-of-range: a grid has at most 2000 places",
        ),
        ("itself", lab("asset P: WellPlate { wells[A1 .. B2] = P }", ""), "circular: `P` contains itself"),
        ("part", lab("asset P { inner = P }", ""), "circular: `P` contains itself"),
        (
            "wrong",
            lab("asset P: TipRack { tips[A1 .. B2] = Well { max_volume: 1 mL } }", ""),
            "type-mismatch: `tips` expects Tip, but `Well` is not one",
        ),
        ("lacking", lab("asset P: WellPlate { mass: 1 g }", ""), "missing-field: `P` has no `wells`"),
    ] {
        let text = if text.contains("= P at") || name == "none" {
            text
        } else {
            text.replace("22 degC\n", "22 degC\np = P at (0, 0, 0) m\n")
        };
        assert_eq!(only(name, &text), wanted, "{text}");
    }
}

#[test]
fn what_goes_wrong_with_tips_and_volumes_has_a_name() {
    let pick = "pick up tip from tips by ot2.left\n";
    let dye = format!("{pick}aspirate 60 uL from stock[A2] by ot2.left\ndispense 30 uL into plate[A1] by ot2.left\n");
    for (failure, steps) in [
        ("no_tip", "aspirate 50 uL from stock[A1] by ot2.left".to_string()),
        ("no_tip", "drop tip by ot2.left".to_string()),
        ("tip_on_tip", format!("{pick}pick up tip tips[H12] by ot2.left")),
        ("tip_used", format!("{pick}drop tip into bin by ot2.left\npick up tip tips[A1] by ot2.left")),
        ("tip_used", "pick up tip tips[C3] by ot2.left\nreturn tip to tips[C3] by ot2.left\npick up tip tips[C3] by ot2.left\ndrop tip by ot2.left\npick up tip tips[C3] by ot2.left".to_string()),
        ("out_of_tips", format!("for t in tips.tips {{ {pick}\ndrop tip by ot2.left }}\n{pick}")),
        ("tip_overflow", format!("{pick}repeat 4 times {{ aspirate 80 uL from stock[A1] by ot2.left }}")),
        ("never_filled", format!("{pick}aspirate 50 uL from stock[A3] by ot2.left")),
        ("volume_underflow", format!("{dye}aspirate 31 uL from plate[A1] by ot2.left")),
        ("volume_underflow", format!("{dye}dispense 31 uL into plate[A1] by ot2.left")),
        ("volume_overflow", "transfer 90 uL from stock[A1] to [plate[A1], plate[A1], plate[A1], plate[A1], plate[A1]] by ot2.left using tips { tips: each }".to_string()),
        ("contamination", format!("{dye}aspirate 30 uL from stock[A1] by ot2.left")),
        ("contamination", format!("{pick}aspirate 60 uL from stock[A2] by ot2.left\nblow out into plate[A1] by ot2.left\nreturn tip to tips[A1] by ot2.left\npick up tip tips[A1] by ot2.left\naspirate 30 uL from stock[A1] by ot2.left")),
        ("wrong_column", format!("{pick}aspirate 60 uL from stock[A1 .. A2] by ot2.left")),
        ("wrong_spot", format!("{pick}return tip to tips[B1] by ot2.left")),
        ("tip_not_empty", format!("{dye}return tip to tips[A1] by ot2.left")),
    ] {
        let dir = folder(&format!("grids_fails_{failure}"));
        let text = format!("{DECK}workflow w in deck {{ sequence {{\n{steps}\n}} on {failure} {{ note \"taken as {failure}\" }} }}\n");
        write(&dir, "deck.mtx", &text);
        let ended = matterixc_in(&dir, &["run", "deck.mtx"]);
        let known = ended.err.contains("can never be done");
        assert!(known || ended.out.contains(&format!("taken as {failure}")), "{failure}: {}{}\n{text}", ended.out, ended.err);
    }
}

#[test]
fn tips_are_taken_in_order_around_those_taken_by_name() {
    let steps = "pick up tip tips[A1] by ot2.left
        drop tip by ot2.left
        pick up tip from tips by ot2.left
        expect ot2.left.tip == tips[B1] and ot2.left.capacity == 300 uL
        aspirate 100 uL from stock[A2] by ot2.left
        dispense 60 uL into plate[A1] by ot2.left
        blow out into plate[A1] by ot2.left
        aspirate 50 uL from stock[A1] by ot2.left { carryover: true }
        drop tip into bin by ot2.left
        expect ot2.left.tip == nothing and bin[A1].contents.volume in 49.9 uL .. 50.1 uL
        expect plate[A1].contents.volume in 99.9 uL .. 100.1 uL and tips.next == 3";
    let dir = folder("grids_order");
    write(&dir, "deck.mtx", format!("{DECK}workflow w in deck {{\n{steps}\n}}\n"));
    let ended = matterixc_in(&dir, &["run", "deck.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

/// A definition of schema 3 with two kinds of places, one of them uneven.
const RACK: &str = r#"{
    "schemaVersion": 3, "metadata": { "displayCategory": "tubeRack" }, "parameters": { "isTiprack": false },
    "extents": { "total": { "backLeftBottom": { "x": 0, "y": 0, "z": 0 }, "frontRightTop": { "x": 120, "y": -80, "z": 60 } } },
    "wells": {
        "A1": { "depth": 50, "shape": "circular", "diameter": 10, "totalLiquidVolume": 1500, "x": 20, "y": -20, "z": 5 },
        "B1": { "depth": 50, "shape": "circular", "diameter": 10, "totalLiquidVolume": 1500, "x": 20, "y": -40, "z": 5 },
        "A2": { "depth": 50, "shape": "circular", "diameter": 10, "totalLiquidVolume": 1500, "x": 47, "y": -20, "z": 5 },
        "B2": { "depth": 40, "shape": "rectangular", "xDimension": 20, "yDimension": 20, "totalLiquidVolume": 9000, "x": 90, "y": -40, "z": 5 }
    }
}"#;

#[test]
fn definitions_of_labware_become_assets() {
    let dir = folder("grids_labware");
    std::fs::create_dir(dir.join("plates")).expect("a folder can be created");
    write(&dir, "plates/rack.json", RACK);
    let text = "mtx 1
asset Rack from labware \"plates/rack.json\"
asset Other: Reservoir from labware \"nest_12_reservoir_15ml\" { mass: 60 g }
lab l { ambient: 22 degC, r = Rack at (0, 0, 0) m holding { A1 .. B2: 1 mL of water }, o = Other at (1, 0, 0) m }
workflow w in l {
    expect r.wells.count == 4 and r[B2].max_volume == 9 mL and r[A2].max_volume == 1.5 mL
    expect r.gross in 53.9 g .. 54.1 g and o.mass == 60 g and o.columns.count == 12
}
";
    write(&dir, "bench.mtx", text);
    let ended = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    for (name, json, wanted) in [
        ("none", "{", "is not JSON"),
        ("schema", r#"{ "schemaVersion": 1 }"#, "its schema is 1, but only 2 and 3 are supported"),
        ("other", r#"{ "ordering": [] }"#, "it has no `schemaVersion`"),
        ("bare", r#"{ "schemaVersion": 2 }"#, "missing field"),
        ("empty", &RACK.replace("1500", "0"), "the size of `A1` must be above 0"),
        ("label", &RACK.replace("\"A1\"", "\"1A\""), "`1A` is not the name of a well such as `A1`"),
        ("shape", &RACK.replace("circular", "round"), "unknown variant `round`"),
    ] {
        write(&dir, "plates/rack.json", json);
        let ended = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]);
        let lines = ended.out_lines();
        assert_eq!(lines.len(), 1, "{name}: {}", ended.out);
        assert_eq!(lines[0]["code"], "labware-file", "{name}");
        let headline = lines[0]["headline"].as_str().unwrap_or_default();
        assert!(headline.contains(wanted), "{name}: {headline}");
    }
}
