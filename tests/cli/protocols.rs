//! Protocols of Opentrons that are imported, checked and written again.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::harness::{flat, folder, matterixc_in, write};

/// A definition: rows and columns of round wells 9 mm apart, so deep and wide, mm, of so many uL.
pub fn definition(category: &str, rows: usize, columns: usize, [depth, diameter, volume]: [f64; 3]) -> Value {
    let name = |row: usize, column: usize| format!("{}{}", char::from(b'A' + row as u8), column + 1);
    let mut wells = Map::new();
    for row in 0..rows {
        for column in 0..columns {
            let (x, y) = (14.38 + 9.0 * column as f64, 74.24 - 9.0 * row as f64);
            let well = json!({ "depth": depth, "diameter": diameter, "totalLiquidVolume": volume, "shape": "circular", "x": x, "y": y, "z": 1.0 });
            wells.insert(name(row, column), well);
        }
    }
    let ordering: Vec<Vec<String>> = (0..columns).map(|c| (0..rows).map(|r| name(r, c)).collect()).collect();
    json!({
        "schemaVersion": 2, "namespace": "opentrons", "metadata": { "displayCategory": category }, "wells": wells, "ordering": ordering,
        "parameters": { "isTiprack": category == "tipRack", "tipLength": depth },
        "dimensions": { "xDimension": 127.76, "yDimension": 85.48, "zDimension": 1.0 + depth },
    })
}

pub fn load(id: &str, (load_name, version): (&str, u32), slot: &str, mut definition: Value) -> Value {
    definition["version"] = version.into();
    definition["parameters"]["loadName"] = load_name.into();
    json!({
        "commandType": "loadLabware",
        "params": { "location": { "slotName": slot }, "loadName": load_name, "namespace": "opentrons", "version": version, "displayName": id },
        "result": { "labwareId": id, "definition": definition },
    })
}

pub fn command(name: &str, params: Value) -> Value {
    json!({ "commandType": name, "params": params })
}

fn at(name: &str, labware: &str, well: &str, z: f64, more: Value) -> Value {
    let mut params = json!({ "pipetteId": "p", "labwareId": labware, "wellName": well, "wellLocation": { "origin": "top", "offset": { "x": 0.0, "y": 0.0, "z": z } } });
    if let (Some(params), Value::Object(more)) = (params.as_object_mut(), more) {
        params.extend(more);
    }
    command(name, params)
}

/// The depths of the plate and of the tubes, mm.
const DEPTHS: [f64; 2] = [10.67, 37.8];

fn analysis(steps: Vec<Value>) -> Value {
    let mut commands = vec![
        command("home", json!({})),
        load("tips", ("opentrons_96_tiprack_300ul", 1), "1", definition("tipRack", 8, 12, [59.3, 5.2, 300.0])),
        load(
            "plate",
            ("corning_96_wellplate_360ul_flat", 2),
            "2",
            definition("wellPlate", 8, 12, [DEPTHS[0], 6.86, 360.0]),
        ),
        load(
            "stock",
            ("opentrons_24_tuberack_eppendorf_1.5ml_safelock_snapcap", 1),
            "3",
            definition("tubeRack", 4, 6, [DEPTHS[1], 8.7, 1500.0]),
        ),
        json!({ "commandType": "loadPipette", "params": { "pipetteName": "p300_single_gen2", "mount": "left" }, "result": { "pipetteId": "p" } }),
        json!({ "commandType": "loadPipette", "params": { "pipetteName": "p300_multi_gen2", "mount": "right" }, "result": { "pipetteId": "m" } }),
    ];
    commands.extend(steps);
    json!({ "robotType": "OT-2 Standard", "metadata": { "protocolName": "Fill a column" }, "errors": [], "commands": commands })
}

/// A fresh tip, 50 uL and air into each well of the first column.
fn fill() -> Vec<Value> {
    let mut steps = Vec::new();
    for row in "ABCDEFGH".chars() {
        let well = format!("{row}1");
        steps.push(at("pickUpTip", "tips", &well, 0.0, json!({})));
        steps.push(at("aspirate", "stock", "A1", 2.0 - DEPTHS[1], json!({ "volume": 50.0, "flowRate": 92.86 })));
        steps.push(at("moveToWell", "stock", "A1", 5.0, json!({ "forceDirect": false })));
        steps.push(at("aspirate", "stock", "A1", 5.0, json!({ "volume": 10.0, "flowRate": 92.86 })));
        steps.push(at("dispense", "plate", &well, 1.5 - DEPTHS[0], json!({ "volume": 60.0, "flowRate": 92.86 })));
        steps.push(at("blowout", "plate", &well, -2.0, json!({ "flowRate": 92.86 })));
        steps.push(at("touchTip", "plate", &well, -1.0, json!({ "radius": 1.0, "speed": 60.0 })));
        steps.push(at("dropTip", "fixedTrash", "A1", 0.0, json!({})));
    }
    steps
}

#[test]
fn a_protocol_comes_back_with_its_heights() {
    let dir = folder("imported");
    write(&dir, "a.json", analysis(fill()).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
    assert_eq!((imported.code, imported.err.as_str()), (0, ""), "{}", imported.out);
    let text = std::fs::read_to_string(dir.join("a.mtx")).expect("it is written");
    for line in [
        "for well in plate[A1 .. H1] {",
        "pick up tip from tips by ot2.left",
        "aspirate 50 uL from stock[A1] by ot2.left at bottom + 2 mm",
        "move ot2.left to stock[A1] at top + 5 mm",
        "air gap 10 uL by ot2.left",
        "dispense 60 uL into well by ot2.left at bottom + 1.5 mm",
        "blow out into well by ot2.left at top - 2 mm",
        "touch tip to well by ot2.left",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    assert!(!text.contains("plate[B1]"), "{text}");
    let checked = matterixc_in(&dir, &["check", "--strict", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-json"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    let emitted: Value = serde_json::from_str(&emitted.out).expect("it is JSON");
    // Heights above the bottom, from either end.
    let done: Vec<(String, f64, f64)> = emitted["commands"]
        .as_array()
        .expect("commands")
        .iter()
        .filter(|c| ["aspirate", "dispense", "blowout"].contains(&c["commandType"].as_str().unwrap_or("")))
        .map(|c| {
            let location = &c["params"]["wellLocation"];
            let z = location["offset"]["z"].as_f64().expect("a height");
            let depth = if c["commandType"] == "aspirate" { DEPTHS[1] } else { DEPTHS[0] };
            let above = if location["origin"] == "bottom" { z } else { z + depth };
            let name = c["commandType"].as_str().unwrap_or("").to_owned();
            (name, c["params"]["volume"].as_f64().unwrap_or(0.0), (above * 1e6).round() / 1e6)
        })
        .collect();
    let expected = [("aspirate", 50.0, 2.0), ("dispense", 60.0, 1.5), ("blowout", 0.0, 8.67)];
    let expected: Vec<_> = expected.iter().map(|(name, v, z)| ((*name).to_owned(), *v, *z)).collect();
    assert_eq!(done.len(), 24);
    assert!(done.chunks(3).all(|turn| turn == expected), "{done:?}");
}

#[test]
fn what_cannot_be_said_is_listed_and_stands_in_the_text() {
    let dir = folder("left_out");
    let mut steps = fill();
    steps.insert(3, command("liquidProbe", json!({ "pipetteId": "p" })));
    write(&dir, "a.json", analysis(steps).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    assert!(imported.err.contains("liquidProbe (command 10)"), "{}", imported.err);
    assert!(imported.out.contains("// not imported: liquidProbe, as "), "{}", imported.out);
}

#[test]
fn more_than_a_well_holds_is_air_for_the_rest() {
    let dir = folder("partial");
    let mut steps = fill();
    steps.push(at("pickUpTip", "tips", "A2", 0.0, json!({})));
    steps.push(at("aspirate", "plate", "A1", 0.2 - DEPTHS[0], json!({ "volume": 80.0, "flowRate": 92.86 })));
    steps.push(at("dropTip", "fixedTrash", "A1", 0.0, json!({})));
    write(&dir, "a.json", analysis(steps).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    let text = std::fs::read_to_string(dir.join("a.mtx")).expect("it is written");
    assert!(text.contains("aspirate 80 uL from plate[A1] by ot2.left at bottom + 0.2 mm { partial: true }"), "{text}");
    let checked = matterixc_in(&dir, &["check", "--strict", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
}

/// The text that these steps are imported as, which must be without a finding, and what `emit` makes of it.
fn imported(name: &str, steps: Vec<Value>) -> (String, Value) {
    let (text, emitted) = there_and_back(name, &analysis(steps), "opentrons-json");
    (text, serde_json::from_str(&emitted).expect("it is JSON"))
}

/// The text that an analysis is imported as, which must be without a finding, and what `emit` makes of it for a target.
pub fn there_and_back(name: &str, analysis: &Value, target: &str) -> (String, String) {
    let dir = folder(name);
    write(&dir, "a.json", analysis.to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
    assert_eq!((imported.code, imported.err.as_str()), (0, ""), "{}", imported.out);
    let text = std::fs::read_to_string(dir.join("a.mtx")).expect("it is written");
    let checked = matterixc_in(&dir, &["check", "--strict", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}\n{text}", checked.out);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", target]);
    assert_eq!(emitted.code, 0, "{}\n{text}", emitted.err);
    (text, emitted.out)
}

/// Commands of a protocol by name, with the wells that they are about.
fn wells(protocol: &Value, names: &[&str]) -> Vec<(String, String)> {
    let text = |value: &Value| value.as_str().unwrap_or("").to_owned();
    let all = protocol["commands"].as_array().expect("commands").iter();
    all.map(|c| (text(&c["commandType"]), text(&c["params"]["wellName"])))
        .filter(|(name, _)| names.contains(&name.as_str()))
        .collect()
}

#[test]
fn one_tip_on_a_pipette_with_eight_channels_works_in_single_wells() {
    let m = |more: Value| {
        let mut all = json!({ "pipetteId": "m", "flowRate": 94.0 });
        if let (Some(all), Value::Object(more)) = (all.as_object_mut(), more) {
            all.extend(more);
        }
        all
    };
    let mut steps = Vec::new();
    for (tip, well) in [("H1", "C3"), ("G1", "E7")] {
        steps.push(at("pickUpTip", "tips", tip, 0.0, m(json!({}))));
        steps.push(at("aspirate", "stock", "A1", 1.0 - DEPTHS[1], m(json!({ "volume": 50.0 }))));
        steps.push(at("dispense", "plate", well, 0.0, m(json!({ "volume": 50.0 }))));
        steps.push(at("dropTip", "fixedTrash", "A1", 0.0, m(json!({}))));
    }
    // Three tips are left over in a column: all of them are taken.
    for well in ["A2", "B2", "C2", "D2", "E2"] {
        steps.push(at("pickUpTip", "tips", well, 0.0, json!({})));
        steps.push(at("dropTip", "fixedTrash", "A1", 0.0, json!({})));
    }
    steps.push(at("pickUpTip", "tips", "F2", 0.0, m(json!({}))));
    steps.push(at("aspirate", "plate", "A12", 1.0 - DEPTHS[0], m(json!({ "volume": 40.0 }))));
    steps.push(at("dispense", "plate", "D11", 0.0, m(json!({ "volume": 40.0 }))));
    steps.push(at("dropTip", "fixedTrash", "A1", 0.0, m(json!({}))));
    let (text, protocol) = imported("single_tip", steps);
    for line in [
        "pick up tip tips[H1] by ot2.right",
        "aspirate 50 uL from stock[A1] by ot2.right",
        "dispense 50 uL into plate[C3] by ot2.right",
        "stock = TubeRack24 on ot2.slot[3] holding { A1: 100 uL of water }",
        "plate = Corning96 on ot2.slot[2] holding { A12 .. C12: 40 uL of water }",
        "pick up tip [tips[F2], tips[G2], tips[H2]] by ot2.right",
        "aspirate 40 uL from [plate[A12], plate[B12], plate[C12]] by ot2.right",
        "dispense 40 uL into [plate[D11], plate[E11], plate[F11]] by ot2.right",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let done = wells(&protocol, &["aspirate", "dispense"]);
    let expected = ["A1", "C3", "A1", "E7", "A12", "D11"];
    assert_eq!(done.iter().map(|(_, well)| well.as_str()).collect::<Vec<_>>(), expected);
}

#[test]
fn columns_of_a_plate_are_said_as_such() {
    let m = |volume: f64| json!({ "pipetteId": "m", "flowRate": 94.0, "volume": volume });
    let mut steps = vec![at("pickUpTip", "tips", "A1", 0.0, m(0.0))];
    for column in 1..=12 {
        let well = format!("A{column}");
        steps.push(at("aspirate", "plate", &well, 1.0 - DEPTHS[0], m(50.0)));
        steps.push(at("dispense", "plate", &well, 0.0, m(50.0)));
    }
    steps.push(at("dropTip", "fixedTrash", "A1", 0.0, m(0.0)));
    let (text, _) = imported("columns", steps);
    assert!(text.contains("for column in plate.columns {"), "{text}");
}

#[test]
fn what_is_aspirated_at_the_rim_is_air() {
    let mut steps = fill();
    steps.insert(2, at("aspirate", "stock", "A1", 0.0, json!({ "volume": 5.0, "flowRate": 92.86 })));
    let (text, _) = imported("at_the_rim", steps);
    assert!(text.contains("air gap 5 uL by ot2.left"), "{text}");
    assert!(text.contains("holding { A1: 405 uL of water }"), "{text}");
}

#[test]
fn what_is_aspirated_above_the_bin_is_air() {
    let flow = json!({ "volume": 20.0, "flowRate": 92.86 });
    let steps = vec![
        at("pickUpTip", "tips", "A1", 0.0, json!({})),
        at("aspirate", "fixedTrash", "A1", 0.0, flow.clone()),
        at("dispense", "plate", "A1", 0.0, flow),
        at("dropTip", "fixedTrash", "A1", 0.0, json!({})),
    ];
    let (err, text) = listed("above_the_bin", steps);
    assert!(
        err.is_empty() && text.contains("move ot2.left to ot2.trash[A1]\n    air gap 20 uL by ot2.left"),
        "{err}{text}"
    );
    // In Python the bin is no place for it.
    let dir = folder("above_the_bin_emitted");
    write(&dir, "a.mtx", text);
    assert_eq!(matterixc_in(&dir, &["check", "--strict", "a.mtx"]).code, 0);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert!(emitted.code == 1 && flat(&emitted.err).contains("no call for `aspirateInPlace`"), "{}", emitted.err);
}

#[test]
fn a_tip_may_go_back_with_its_liquid() {
    let steps = vec![
        at("pickUpTip", "tips", "A1", 0.0, json!({})),
        at("aspirate", "stock", "A1", 1.0 - DEPTHS[1], json!({ "volume": 50.0, "flowRate": 92.86 })),
        at("dispense", "plate", "A1", 0.0, json!({ "volume": 40.0, "flowRate": 92.86 })),
        at("dropTip", "tips", "A1", 0.0, json!({})),
    ];
    let (text, protocol) = imported("wet_tip", steps);
    assert!(text.contains("return tip to tips[A1] by ot2.left { with_liquid: true }"), "{text}");
    assert_eq!(wells(&protocol, &["dropTip"]), [("dropTip".to_owned(), "A1".to_owned())]);
}

#[test]
fn a_wait_for_the_temperature_that_was_set_is_imported() {
    let module = json!({
        "commandType": "loadModule",
        "params": { "model": "temperatureModuleV2", "location": { "slotName": "4" } },
        "result": { "moduleId": "t", "model": "temperatureModuleV2" },
    });
    let set = |celsius: f64| {
        command("temperatureModule/setTargetTemperature", json!({ "moduleId": "t", "celsius": celsius }))
    };
    let wait =
        |celsius: f64| command("temperatureModule/waitForTemperature", json!({ "moduleId": "t", "celsius": celsius }));
    let stop = command("temperatureModule/deactivate", json!({ "moduleId": "t" }));
    let (text, _) = imported("waiting", vec![module.clone(), set(37.0), wait(37.0), stop.clone()]);
    assert!(text.contains("heat cooler to 37 degC\n    settle cooler\n"), "{text}");
    let dir = folder("waiting_for_another");
    write(&dir, "a.json", analysis(vec![module, set(37.0), wait(30.0), stop]).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json"]);
    assert!(imported.err.contains("it waits for another temperature"), "{}", imported.err);
}

#[test]
fn channels_share_what_is_left_in_a_trough() {
    let dir = folder("shared_trough");
    let text = |held: &str, options: &str, each: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Multi, Reservoir12, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Multi }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    trough = Reservoir12 on ot2.slot[2]{held}
    plate = Corning96 on ot2.slot[3]
}}
workflow go in deck {{
    pick up tip from tips by ot2.left
    aspirate 140 uL from trough[A1] by ot2.left{options}
    dispense 140 uL into plate.column(1) by ot2.left
    expect all(w in plate.column(1): w.contents.volume in {each})
    drop tip by ot2.left
}}\n"
        )
    };
    let cases = [
        (" holding { A1: 1120 uL of water }", "", "139.9 uL .. 140.1 uL"),
        (" holding { A1: 560 uL of water }", " { partial: true }", "69.9 uL .. 70.1 uL"),
        // Of nothing each takes nothing.
        ("", " { partial: true }", "0 uL .. 0.1 uL"),
    ];
    for (held, options, each) in cases {
        write(&dir, "a.mtx", text(held, options, each));
        let checked = matterixc_in(&dir, &["check", "a.mtx"]);
        assert_eq!(checked.code, 0, "{held}: {}", checked.out);
        let run = matterixc_in(&dir, &["run", "a.mtx"]);
        assert_eq!(run.code, 0, "{held}: {}{}", run.out, run.err);
    }
}

#[test]
fn some_tips_of_a_pipette_reach_as_many_wells() {
    let dir = folder("some_tips");
    let text = |lines: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Multi, Reservoir12, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Multi }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    trough = Reservoir12 on ot2.slot[2] holding {{ A1: 1 mL of water }}
    plate = Corning96 on ot2.slot[3]
}}
workflow go in deck {{
    {lines}
    drop tip by ot2.left
}}\n"
        )
    };
    let take = "aspirate 100 uL from trough[A1] by ot2.left";
    let cases = [
        // From the trough only those with a tip take any.
        (
            format!(
                "pick up tip tips[H1] by ot2.left\n{take}\nexpect trough[A1].contents.volume in 899 uL .. 901 uL\ndispense 100 uL into plate[D4] by ot2.left\nexpect plate[D4].contents.volume in 99 uL .. 101 uL"
            ),
            "no findings",
        ),
        (
            format!(
                "pick up tip [tips[G1], tips[H1]] by ot2.left\n{take}\ndispense 100 uL into [plate[A1], plate[B1]] by ot2.left"
            ),
            "no findings",
        ),
        // As many wells as tips.
        (
            format!("pick up tip [tips[G1], tips[H1]] by ot2.left\n{take}\ndispense 100 uL into plate[A1] by ot2.left"),
            "error[wrong-column]",
        ),
        (
            format!("pick up tip from tips by ot2.left\n{take}\ndispense 100 uL into plate[A1] by ot2.left"),
            "error[wrong-column]",
        ),
        // The other channels would take tips as well.
        ("pick up tip tips[A1] by ot2.left".to_owned(), "other channels of `ot2.left` would take tips too"),
    ];
    for (lines, why) in cases {
        write(&dir, "a.mtx", text(&lines));
        let checked = matterixc_in(&dir, &["check", "a.mtx"]);
        assert!(flat(&checked.out).contains(why), "{lines}: {}", checked.out);
    }
}

#[test]
fn what_is_no_protocol_of_a_known_robot_is_refused() {
    let dir = folder("refused");
    let mut other = analysis(Vec::new());
    other["robotType"] = "OT-9".into();
    let mut wrong = analysis(Vec::new());
    wrong["errors"] = json!([{ "detail": "KeyError: 'x'" }]);
    let legacy = analysis(vec![command("custom", json!({ "legacyCommandText": "Touching tip" }))]);
    let cases = [
        ("{".to_owned(), "neither an analysis nor a JSON protocol"),
        ("[]".to_owned(), "neither an analysis nor a JSON protocol"),
        (other.to_string(), "only protocols of the OT-2 and of the Flex"),
        (wrong.to_string(), "fails in its analysis: KeyError"),
        (legacy.to_string(), "lacks heights"),
    ];
    for (text, why) in cases {
        write(&dir, "a.json", text);
        let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
        assert!(imported.code == 1 && flat(&imported.err).contains(why), "{why}: {}", imported.err);
        assert!(!dir.join("a.mtx").exists());
    }
}

#[test]
fn options_in_another_order_are_those_of_their_own_call() {
    // What was worked out for the first call held for the second one, whose options stand elsewhere.
    let dir = folder("order_of_options");
    let text = |last: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Single, Reservoir12, TipRack300}}
lab deck {{
    ambient: 25 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    stock = Reservoir12 on ot2.slot[2] holding {{ A1: 10 mL of water }}
    plate = Corning96 on ot2.slot[3] holding {{ A2: 40 uL of EtOH }}
}}
workflow go in deck {{
    pick up tip from tips by ot2.left
    aspirate 50 uL from stock[A1] by ot2.left {{ rate: 30 uL/s }}
    dispense 50 uL into plate[A2] by ot2.left at bottom + 1 mm
    aspirate 20 uL from stock[A1] by ot2.left{last}
    drop tip by ot2.left
}}\n"
        )
    };
    write(&dir, "a.mtx", text(" { carryover: true }"));
    assert_eq!(matterixc_in(&dir, &["check", "a.mtx"]).code, 0);
    write(&dir, "a.mtx", text(""));
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    assert!(checked.code == 1 && checked.out.contains("error[contamination]"), "{}", checked.out);
}

#[test]
fn heights_are_those_of_the_well_named() {
    let dir = folder("heights");
    let text = |line: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Single, TipRack300}}
lab deck {{
    ambient: 25 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[3] holding {{ A1 .. B1: 100 uL of water }}
}}
workflow go in deck {{
    let top = 3 mm
    pick up tip from tips by ot2.left
    {line}
    blow out into plate[C1] by ot2.left
    drop tip by ot2.left
}}\n"
        )
    };
    // 100 uL stand 3.1 mm high in this well; the rim is 10.67 mm above the bottom, whatever the workflow calls top.
    let cases = [
        ("aspirate 20 uL from plate[A1] by ot2.left at surface - 1 mm", "no findings"),
        ("aspirate 20 uL from plate[A1] by ot2.left at bottom + 2.6 mm", "no findings"),
        ("aspirate 20 uL from plate[A1] by ot2.left at bottom + 3.3 mm", "above-liquid"),
        ("aspirate 20 uL from plate[A1] by ot2.left at top - 1 mm", "9.67 mm above the bottom"),
        ("aspirate 20 uL from plate[A1] by ot2.left at top + 1 mm", "outside-well"),
        ("aspirate 20 uL at bottom - 1 mm from plate[A1] by ot2.left", "outside-well"),
        ("aspirate 20 uL from plate[A1] by ot2.left at rim - 1 mm", "rim"),
        ("aspirate 5 uL from plate[A1] by ot2.left", "warning[below-minimum]"),
    ];
    for (line, why) in cases {
        write(&dir, "a.mtx", text(line));
        let checked = matterixc_in(&dir, &["check", "a.mtx"]);
        assert!(flat(&checked.out).contains(why), "{line}: {}", checked.out);
    }
}

#[test]
fn what_a_tip_does_not_reach_stays_in_the_well() {
    let dir = folder("reach");
    let text = |wells: &str, line: &str, expected: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Multi, P300Single, Reservoir1, TipRack300}}
lab deck {{
    ambient: 25 degC
    ot2 = OT2 {{ left: P300Single, right: P300Multi }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[3] holding {{ {wells} }}
    trough = Reservoir1 on ot2.slot[4] holding {{ A1: 40 mL of water }}
}}
workflow go in deck {{
    {line}
    expect {expected}
}}\n"
        )
    };
    // A well is 6.35 mm wide at the bottom and 6.86 mm at the rim, 10.67 mm above it: so much is in its lowest 1.6 mm.
    let wide = |height: f64| 3.175 + 0.255 * height / 10.67;
    let below = std::f64::consts::PI / 3.0 * 1.6 * (wide(0.0).powi(2) + wide(0.0) * wide(1.6) + wide(1.6).powi(2));
    let single = |step: &str| {
        let (step, options) =
            step.split_once(" { ").map_or((step, String::new()), |(step, rest)| (step, format!(" {{ {rest}")));
        format!(
            "pick up tip from tips by ot2.left\n{step} by ot2.left{options}\ndispense 60 uL into plate[B1] by ot2.left\ndrop tip by ot2.left"
        )
    };
    let column = |step: &str| {
        format!(
            "pick up tip tips.column(2) by ot2.right\n{step} by ot2.right\ndispense 60 uL into plate.column(2) by ot2.right\ndrop tip by ot2.right"
        )
    };
    let near = |well: &str, volume: f64| format!("abs(plate[{well}].contents.volume - {volume} uL) <= 1 uL");
    let cases = [
        (single("aspirate 60 uL from plate[A1] at bottom + 1 mm"), near("B1", 60.0), false),
        (single("aspirate 60 uL from plate[A1] at bottom + 2 mm"), near("B1", 60.0), false),
        // All but the lowest 1.6 mm.
        (single("aspirate 60 uL from plate[A1] at bottom + 2.6 mm"), near("B1", 100.0 - below), true),
        (single("aspirate 60 uL from plate[A1] at bottom + 5 mm"), near("B1", 0.0), true),
        // Of the 60 uL that come out first 60 are air.
        (single("aspirate 108 uL from plate[A1] at bottom + 2.6 mm { partial: true }"), near("B1", 0.0), true),
        (single("aspirate 120 uL from plate[A1] at bottom + 5 mm { partial: true }"), near("A1", 100.0), true),
        (column("aspirate 60 uL from trough[A1] at bottom + 2 mm"), near("H2", 60.0), false),
        // A trough of 106.8 mm x 71.2 mm: they share what lies in its uppermost 0.05 mm.
        (column("aspirate 60 uL from trough[A1] at surface + 0.95 mm"), near("A2", 47.5), true),
        (column("aspirate 60 uL from trough[A1] at surface + 0.95 mm"), near("H2", 47.5), true),
        (column("aspirate 60 uL from trough[A1] at surface + 1.1 mm"), near("A2", 0.0), true),
    ];
    for (steps, expected, warned) in cases {
        write(&dir, "a.mtx", text("A1: 100 uL of water", &steps, &expected));
        let said = checked_and_run(&dir, &format!("{steps} {expected}"));
        assert_eq!(said.contains("above-liquid"), warned, "{steps}: {said}");
    }
}

#[test]
fn each_channel_gives_off_its_own_air_first() {
    let dir = folder("air_of_channels");
    let text = "mtx 1
use std::opentrons::{Corning96, OT2, P300Multi, TipRack300}
lab deck {
    ambient: 25 degC
    ot2 = OT2 { left: P300Multi } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[3] holding { A1: 60 uL of water, B1 .. H1: 200 uL of water }
}
workflow go in deck {
    pick up tip from tips by ot2.left
    aspirate 100 uL from plate.column(1) by ot2.left { partial: true }
    dispense 50 uL into plate.column(2) by ot2.left
    expect abs(plate[A2].contents.volume - 10 uL) < 0.1 uL
    expect abs(plate[B2].contents.volume - 50 uL) < 0.1 uL
    move ot2.left to plate.column(3) at top + 5 mm
    air gap 20 uL by ot2.left
    dispense 30 uL into plate.column(3) by ot2.left
    expect abs(plate[A3].contents.volume - 10 uL) < 0.1 uL
    expect abs(plate[H3].contents.volume - 10 uL) < 0.1 uL
    dispense 40 uL into plate.column(4) by ot2.left
    expect abs(plate[A4].contents.volume - 40 uL) < 0.1 uL
    expect abs(plate[H4].contents.volume - 40 uL) < 0.1 uL
    drop tip by ot2.left
}\n";
    write(&dir, "a.mtx", text);
    checked_and_run(&dir, "channels");
}

/// What `import` says of steps, and the text.
fn listed(name: &str, steps: Vec<Value>) -> (String, String) {
    let dir = folder(name);
    write(&dir, "a.json", analysis(steps).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    (imported.err, std::fs::read_to_string(dir.join("a.mtx")).expect("it is written"))
}

fn module(id: &str, model: &str, slot: &str) -> Value {
    json!({
        "commandType": "loadModule",
        "params": { "model": model, "location": { "slotName": slot } },
        "result": { "moduleId": id, "model": model },
    })
}

#[test]
fn what_hangs_below_a_pipette_is_its_tip() {
    let dir = folder("hanging");
    let text = |height: u32, from: &str| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P1000Single, TipRack1000, TrashBin}}
use std::labware::Labware
asset Falcons from labware \"opentrons_15_tuberack_falcon_15ml_conical/1\"
asset Tower: Labware {{ shape: box(100 mm, 60 mm, {height} mm) }}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P1000Single }} at (0, 0, 0) m
    tips = TipRack1000 on ot2.slot[4]
    tower = Tower on ot2.slot[5]
    tubes = Falcons on ot2.slot[6] holding {{ A1: 14 mL of water }}
}}
workflow go in deck {{
    pick up tip from tips by ot2.left
    aspirate 500 uL from tubes[A1] by ot2.left at {from}
    dispense 500 uL into tubes[A2] by ot2.left at top - 20 mm
    drop tip by ot2.left
}}\n"
        )
    };
    // Retracted nozzles are 250 mm above the deck, a tip of 1000 uL hangs 80 mm below them, wherever it goes.
    let cases = [
        (150, "bottom + 75 mm", "no findings"),
        (150, "bottom + 1 mm", "no findings"),
        (178, "top - 60 mm", "error[collision]"),
    ];
    for (height, from, why) in cases {
        write(&dir, "a.mtx", text(height, from));
        let checked = matterixc_in(&dir, &["check", "a.mtx"]);
        assert!(flat(&checked.out).contains(why), "{height} mm, {from}: {}", checked.out);
    }
}

#[test]
fn labware_of_several_places_begins_at_its_own() {
    let dir = folder("wide_labware");
    // 260 mm wide: in the places 10 and 11, and not half beside the deck.
    let well = |x: f64| json!({ "depth": 99.0, "diameter": 15.99, "totalLiquidVolume": 15000, "shape": "circular", "x": x, "y": 72.76, "z": 3.55 });
    let definition = json!({
        "schemaVersion": 2, "version": 1, "namespace": "custom_beta",
        "metadata": { "displayCategory": "tubeRack", "displayName": "Wide" },
        "parameters": { "isTiprack": false, "loadName": "wide", "format": "irregular", "isMagneticModuleCompatible": false },
        "dimensions": { "xDimension": 260.0, "yDimension": 85.5, "zDimension": 110.7 },
        "wells": { "A1": well(24.87), "A8": well(235.12) },
        "ordering": [["A1"], ["A8"]],
    });
    write(&dir, "wide.json", definition.to_string());
    let text = "mtx 1
use std::opentrons::{OT2, P300Single, TipRack300}
asset Wide from labware \"wide.json\"
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[9]
    rack = Wide on ot2.slot[10] holding { A1: 1 mL of water }
}
workflow go in deck {
    pick up tip from tips by ot2.left
    aspirate 200 uL from rack[A1] by ot2.left
    dispense 200 uL into rack[A8] by ot2.left
    drop tip by ot2.left
}
";
    write(&dir, "a.mtx", text);
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    // Where the body is, nothing else may stand.
    write(&dir, "a.mtx", text.replace("    rack =", "    more = TipRack300 on ot2.slot[11]\n    rack ="));
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    assert_eq!(checked.code, 1, "{}", checked.out);
}

#[test]
fn channels_reach_the_wells_that_they_are_over() {
    // Rows that are a little further apart than channels, and rows twice as far apart.
    let spread = |pitch: f64| {
        let mut plate = definition("wellPlate", 8, 1, [10.67, 6.86, 360.0]);
        for (row, name) in ["A1", "B1", "C1", "D1", "E1", "F1", "G1", "H1"].iter().enumerate() {
            plate["wells"][name]["y"] = json!(74.24 - pitch * row as f64);
        }
        let mut steps = vec![load("odd", ("corning_96_wellplate_360ul_flat", 2), "5", plate)];
        let m = json!({ "pipetteId": "m", "volume": 20.0, "flowRate": 94.0 });
        steps.push(at("pickUpTip", "tips", "A1", 0.0, m.clone()));
        steps.push(at("aspirate", "odd", "A1", -9.0, m.clone()));
        steps.push(at("dropTip", "fixedTrash", "A1", 0.0, m));
        steps
    };
    let (err, text) = listed("near_rows", spread(9.12));
    assert!(err.is_empty() && text.contains("aspirate 20 uL from odd.column(1) by ot2.right"), "{err}{text}");
    let (err, _) = listed("far_rows", spread(18.0));
    assert!(err.contains("some of its channels reach no well: aspirate (command "), "{err}");
}

#[test]
fn a_rack_is_refilled_where_a_pause_asks_for_tips() {
    let turn = |message: &str| {
        let tip = [at("pickUpTip", "tips", "A1", 0.0, json!({})), at("dropTip", "fixedTrash", "A1", 0.0, json!({}))];
        let pause = command("waitForResume", json!({ "message": message }));
        tip.clone().into_iter().chain([pause]).chain(tip).collect::<Vec<_>>()
    };
    let (err, text) = listed("refilled", turn("Please refill the tip racks"));
    assert!(err.is_empty() && text.contains("ask \"Please refill the tip racks\"\n    refill tips\n"), "{text}");
    let dir = folder("refilled_checked");
    write(&dir, "a.mtx", text);
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    // Nobody says so: the tip is not there.
    let (err, text) = listed("not_refilled", turn("Please cover the plate"));
    assert!(err.is_empty() && !text.contains("refill tips"), "{err}{text}");
    let dir = folder("not_refilled_checked");
    write(&dir, "a.mtx", text);
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    assert!(checked.out.contains("error[tip-used]"), "{}", checked.out);
}

#[test]
fn parked_tips_are_taken_by_name() {
    let tip = |rack: &str, name: &str| at(name, rack, "A1", 0.0, json!({}));
    let parking =
        load("parking", ("opentrons_96_tiprack_300ul", 1), "4", definition("tipRack", 8, 12, [59.3, 5.2, 300.0]));
    let steps = vec![
        parking,
        tip("tips", "pickUpTip"),
        tip("parking", "dropTip"),
        tip("parking", "pickUpTip"),
        tip("fixedTrash", "dropTip"),
    ];
    let (text, _) = imported("parked", steps);
    assert!(text.contains("pick up tip parking[A1] by ot2.left"), "{text}");
}

#[test]
fn profiles_are_temperatures_that_are_held() {
    let block = |name: &str, more: Value| {
        let mut params = json!({ "moduleId": "c" });
        if let (Some(params), Value::Object(more)) = (params.as_object_mut(), more) {
            params.extend(more);
        }
        command(&format!("thermocycler/{name}"), params)
    };
    let turn = [json!({ "celsius": 95.0, "holdSeconds": 10.0 }), json!({ "celsius": 60.0, "holdSeconds": 30.0 })];
    let profile: Vec<Value> = turn.iter().cycle().take(8).cloned().collect();
    let steps = vec![
        module("c", "thermocyclerModuleV1", "7"),
        block("openLid", json!({})),
        block(
            "setTargetBlockTemperature",
            json!({ "celsius": 98.0, "blockMaxVolumeUl": 25.0, "holdTimeSeconds": 120.0 }),
        ),
        block("waitForBlockTemperature", json!({})),
        block("runProfile", json!({ "profile": profile, "blockMaxVolumeUl": 25.0 })),
        block("deactivateBlock", json!({})),
        block("deactivateLid", json!({})),
    ];
    let (err, text) = listed("profile", steps);
    assert_eq!(err, "");
    for lines in [
        "heat cycler to 98 degC { volume: 25 uL }\n    settle cycler\n    wait 2 min\n",
        "repeat 4 times {",
        "heat cycler to 60 degC { volume: 25 uL }\n        settle cycler\n        wait 30 s\n",
        "stop heating cycler\n",
    ] {
        assert!(text.contains(lines), "{lines}: {text}");
    }
    let dir = folder("profile_emitted");
    write(&dir, "a.mtx", text);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    assert!(emitted.out.contains("cycler.set_block_temperature(95, block_max_volume=25)"), "{}", emitted.out);
}

#[test]
fn a_module_may_be_switched_off_as_a_precaution() {
    let stop = command("temperatureModule/deactivate", json!({ "moduleId": "t" }));
    let (text, _) = imported("precaution", vec![module("t", "temperatureModuleV2", "4"), stop]);
    assert!(text.contains("stop heating cooler { anyway: true }"), "{text}");
}

#[test]
fn a_temperature_may_be_waited_for_later() {
    let set = command("temperatureModule/setTargetTemperature", json!({ "moduleId": "t", "celsius": 37.0 }));
    let wait = command("temperatureModule/waitForTemperature", json!({ "moduleId": "t", "celsius": 37.0 }));
    let stop = command("temperatureModule/deactivate", json!({ "moduleId": "t" }));
    let note = command("comment", json!({ "message": "Warming up" }));
    let (_, text) = listed("later", vec![module("t", "temperatureModuleV2", "4"), set, note, wait, stop]);
    let dir = folder("later_emitted");
    write(&dir, "a.mtx", text);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    for line in ["cooler.start_set_temperature(37)", "cooler.await_temperature(37)"] {
        assert!(emitted.out.contains(line), "{line}: {}", emitted.out);
    }
}

#[test]
fn pipettes_go_above_racks_and_the_deck() {
    let place = json!({ "pipetteId": "p", "coordinates": { "x": 20.0, "y": 90.5, "z": 150.0 }, "forceDirect": false });
    let steps = vec![at("moveToWell", "tips", "B2", 30.0, json!({})), command("moveToCoordinates", place)];
    let (text, protocol) = imported("above", steps);
    for line in ["hover ot2.left at tips[B2] { z: 30 mm }", "steer ot2.left at 150 mm { x: 20 mm, y: 90.5 mm }"] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let all = protocol["commands"].as_array().expect("commands");
    let find = |name: &str| &all.iter().find(|c| c["commandType"] == name).expect("it is there")["params"];
    assert_eq!(find("moveToWell")["wellLocation"]["offset"]["z"], 30.0);
    assert_eq!(find("moveToCoordinates")["coordinates"], json!({ "x": 20.0, "y": 90.5, "z": 150.0 }));
}

#[test]
fn air_in_a_tip_fills_no_well() {
    let dir = folder("air_fills_nothing");
    let text = |held: u32| {
        format!(
            "mtx 1\nuse std::opentrons::{{Corning96, OT2, P300Single, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[2] holding {{ A1: 100 uL of water, B1: {held} uL of water }}
}}
workflow go in deck {{
    pick up tip from tips by ot2.left
    aspirate 250 uL from plate[A1] by ot2.left {{ partial: true }}
    air gap 20 uL by ot2.left
    dispense 270 uL into plate[B1] by ot2.left
    drop tip by ot2.left
}}\n"
        )
    };
    for (held, code) in [(250, 0), (270, 1)] {
        write(&dir, "a.mtx", text(held));
        let checked = matterixc_in(&dir, &["check", "a.mtx"]);
        assert_eq!(checked.code, code, "{held}: {}", checked.out);
        assert!(code == 0 || checked.out.contains("and this adds"), "{}", checked.out);
    }
}

/// A pipette over a flat plate and a trough, and a workflow of these steps.
fn bench_of(steps: &str) -> String {
    format!(
        "mtx 1
use std::opentrons::{{Corning96, OT2, P300Single, Reservoir12, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[5]
    plate = Corning96 on ot2.slot[1] holding {{ H1: 100 uL of water }}
    stock = Reservoir12 on ot2.slot[2] holding {{ A1: 10 mL of water }}
}}
workflow go in deck {{
    pick up tip from tips by ot2.left
{steps}    drop tip by ot2.left
}}
"
    )
}

#[test]
fn air_is_taken_above_a_liquid_and_comes_out_in_its_place() {
    let dir = folder("air_in_its_place");
    let above = "    move ot2.left to stock[A1] at top + 5 mm\n";
    let aspirate = "    aspirate 100 uL from stock[A1] by ot2.left\n";
    let gap = "    air gap 20 uL by ot2.left\n";
    // In a liquid, or at its rack, a pipette takes up no air.
    for steps in [format!("{aspirate}{gap}"), gap.to_owned()] {
        write(&dir, "a.mtx", bench_of(&steps));
        let checked = matterixc_in(&dir, &["check", "a.mtx", "--no-cache"]);
        assert!(checked.code == 1 && checked.out.contains("air gap 20 uL"), "{steps}: {}", checked.out);
    }
    // Air behind the liquid comes last, air at the end of the tip first; between two portions it counts as behind both.
    let dispense = |volume: u32| format!("    dispense {volume} uL into plate[A1] by ot2.left\n");
    for (steps, given) in [
        (format!("{above}{gap}{aspirate}{}", dispense(60)), 60),
        (format!("{aspirate}{above}{gap}{}", dispense(60)), 40),
        (format!("{aspirate}{above}{gap}{aspirate}{}", dispense(100)), 100),
        (format!("{above}{gap}{aspirate}{}{}", dispense(60), dispense(60)), 100),
    ] {
        let expect = format!("    expect plate[A1].contents.volume in {given} uL - 0.1 uL .. {given} uL + 0.1 uL\n");
        write(&dir, "a.mtx", bench_of(&format!("{steps}{expect}")));
        checked_and_run(&dir, &steps);
    }
}

/// What `check` says of a file that it finds right, and that runs to its end: expectations hold in both.
fn checked_and_run(dir: &Path, what: &str) -> String {
    let checked = matterixc_in(dir, &["check", "a.mtx", "--no-cache"]);
    assert_eq!(checked.code, 0, "{what}: {}", checked.out);
    let ran = matterixc_in(dir, &["run", "a.mtx"]);
    assert_eq!(ran.code, 0, "{what}: {}{}", ran.out, ran.err);
    checked.out
}

#[test]
fn a_tip_that_the_liquid_leaves_behind_is_told() {
    let dir = folder("left_behind");
    let said = |volume: u32, at: &str, options: &str| {
        let steps = format!(
            "    aspirate {volume} uL from plate[H1] at bottom + {at} by ot2.left {options}\n    dispense {volume} uL into plate[A1] by ot2.left\n"
        );
        write(&dir, "a.mtx", bench_of(&steps));
        flat(&matterixc_in(&dir, &["check", "a.mtx", "--no-cache"]).out)
    };
    let falls = said(80, "2 mm", "");
    assert!(
        falls.contains(
            "2 mm above the bottom of `plate[H1]` takes 68.1 uL of its 100 uL, and air for the rest of 80 uL"
        ),
        "{falls}"
    );
    assert!(said(50, "1 mm", "").contains("no findings"));
    for options in ["", "{ partial: true }"] {
        assert!(said(80, "5 mm", options).contains("takes 0 uL of its 100 uL"), "{options}");
    }
    let beside = said(20, "3.3 mm", "");
    assert!(beside.contains("stand only 3.1 mm high: it may aspirate air"), "{beside}");
}

#[test]
fn transfers_have_heights_rates_air_and_touches() {
    let dir = folder("transfer_options");
    let options = "{ tips: held, mix_before: 1, mix_volume: 50 uL, take_at: 2 mm, give_at: 3 mm, rate: 20 uL/s, rate_out: 30 uL/s, air_gap: 10 uL, touch_tip: true }";
    write(&dir, "a.mtx", bench_of(&format!("    transfer 60 uL from stock[A1] to plate[A1] by ot2.left {options}\n")));
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    for line in [
        "aspirate(50, stock[\"A1\"].bottom(2))",
        "aspirate(60, stock[\"A1\"].bottom(2))",
        "aspirate(10)",
        "dispense(70, plate[\"A1\"].top(-7.67))",
        "flow_rate.aspirate = 20",
        "flow_rate.dispense = 30",
        "touch_tip(",
    ] {
        assert!(emitted.out.contains(line), "{line}: {}", emitted.out);
    }
    // With `split` the air takes its place in the tip.
    let steps =
        "    transfer 300 uL from stock[A1] to plate[A1] by ot2.left { tips: held, split: true, air_gap: 10 uL }\n";
    write(&dir, "b.mtx", bench_of(steps));
    let emitted = matterixc_in(&dir, &["emit", "b.mtx", "--target", "opentrons-python"]);
    assert_eq!(emitted.out.matches("aspirate(150, stock").count(), 2, "{}{}", emitted.out, emitted.err);
}

#[test]
fn labware_that_is_moved_or_brought_is_imported() {
    let moved = |id: &str, to: Value| {
        command("moveLabware", json!({ "labwareId": id, "newLocation": to, "strategy": "manualMoveWithPause" }))
    };
    let plate = || definition("wellPlate", 8, 12, [DEPTHS[0], 6.86, 360.0]);
    let steps = vec![
        moved("plate", json!("offDeck")),
        load("second", ("corning_96_wellplate_360ul_flat", 2), "2", plate()),
        at("pickUpTip", "tips", "A1", 0.0, json!({})),
        at("aspirate", "stock", "A1", 2.0 - DEPTHS[1], json!({ "volume": 50.0, "flowRate": 92.86 })),
        at("dispense", "second", "B2", 0.0, json!({ "volume": 50.0, "flowRate": 92.86 })),
        at("dropTip", "fixedTrash", "A1", 0.0, json!({})),
        moved("second", json!({ "slotName": "4" })),
    ];
    let (text, protocol) = imported("moved", steps);
    for line in [
        "use std::furniture::LabBench\n",
        "    aside = LabBench at (0, -1.5, 0) m\n",
        "    second = Corning96 on aside\n",
        "    relocate plate to aside\n    moved second to ot2.slot[2]\n",
        "    relocate second to ot2.slot[4]\n",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let commands = protocol["commands"].as_array().expect("commands").iter();
    let places: Vec<(&str, &Value)> = commands
        .filter_map(|c| {
            let name = c["commandType"].as_str()?;
            let place = &c["params"][if name == "moveLabware" { "newLocation" } else { "location" }];
            (name == "moveLabware" || c["params"]["labwareId"] == "second").then_some((name, place))
        })
        .filter(|(_, place)| !place.is_null())
        .collect();
    let [second, fourth] = ["2", "4"].map(|slot| json!({ "slotName": slot }));
    let off = json!("offDeck");
    assert_eq!(places, [("moveLabware", &off), ("loadLabware", &second), ("moveLabware", &fourth)]);
}

#[test]
fn tips_come_from_the_next_rack_where_one_is_empty() {
    let bench = |racks: &str, uses: &str| {
        let dir = folder("protocols_racks");
        let text = format!(
            r#"mtx 1
use std::opentrons::{{Corning96, OT2, P300Multi, P300Single, Reservoir12, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single, right: P300Multi }} at (0, 0, 0) m
{racks}
    stock = Reservoir12 on ot2.slot[3] holding {{ A1: 5 mL of water }}
    plate = Corning96 on ot2.slot[6]
}}
workflow w in deck {{
{uses}
}}
"#
        );
        write(&dir, "lab.mtx", text);
        let checked = matterixc_in(&dir, &["check", "--strict", "lab.mtx"]);
        let python = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python"]).out;
        let taken = python.lines().filter_map(|l| l.trim().split_once(".pick_up_tip(").map(|(_, tip)| tip.to_owned()));
        (checked, taken.collect::<Vec<_>>())
    };
    let racks = "    one = TipRack300 { emptied: 94 } on ot2.slot[5]\n    two = TipRack300 on ot2.slot[4]";
    let each = "    transfer 50 uL from stock[A1] to plate[A1 .. D1] by ot2.left using [one, two] { tips: each }";
    let (checked, taken) = bench(racks, each);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert_eq!(taken, ["one[\"G12\"])", "one[\"H12\"])", "two[\"A1\"])", "two[\"B1\"])"]);
    // An incomplete column does not serve eight channels.
    let columns = "    transfer 50 uL from stock[A1] to plate[A1 .. H2] by ot2.right using [one, two] { tips: each }";
    let (checked, taken) = bench(racks, columns);
    assert_eq!(checked.code, 0, "{}", checked.out);
    assert_eq!(taken, ["two[\"A1\"])", "two[\"A2\"])"]);
    let (checked, _) = bench(&racks.replace("two = TipRack300", "two = TipRack300 { emptied: 95 }"), each);
    assert!(checked.code == 1 && checked.out.contains("error[out-of-tips]"), "{}", checked.out);
    let (checked, taken) = bench(
        racks,
        "    distribute 20 uL from stock[A1] to plate[A1 .. D1] by ot2.left using [two, one] { tips: once }",
    );
    assert_eq!((checked.code, taken.len()), (0, 1), "{}", checked.out);
}

#[test]
fn tips_are_continued_from_a_file() {
    let dir = folder("protocols_tips");
    let text = r#"mtx 1
use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[5]
    more = TipRack300 on ot2.slot[4]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 5 mL of water }
    plate = Corning96 on ot2.slot[6]
}
workflow w in deck {
    transfer 50 uL from stock[A1] to plate[A1 .. H5] by ot2.left using [tips, more] { tips: each }
}
"#;
    write(&dir, "lab.mtx", text);
    let kept = || std::fs::read_to_string(dir.join("tips.csv")).expect("a table");
    let emit = || matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python", "--tips", "tips.csv"]);
    let ended = emit();
    assert!(ended.code == 0 && ended.out.contains("pick_up_tip(tips[\"A1\"])"), "{}{}", ended.out, ended.err);
    assert_eq!(kept(), "rack,taken\ntips,40\nmore,0\n");
    assert!(emit().out.contains("pick_up_tip(tips[\"A6\"])"));
    let ended = matterixc_in(&dir, &["run", "lab.mtx", "--tips", "tips.csv"]);
    assert_eq!((ended.code, kept().as_str()), (0, "rack,taken\ntips,96\nmore,24\n"), "{}", ended.err);
    // Where not enough are left nothing is written.
    emit();
    let before = kept();
    let ended = emit();
    assert!(ended.code == 1 && ended.err.contains("error[out-of-tips]"), "{}", ended.err);
    assert_eq!(kept(), before);
    // Tips before one that was taken by name count as taken.
    std::fs::remove_file(dir.join("tips.csv")).expect("a table");
    write(
        &dir,
        "lab.mtx",
        text.replace("    transfer", "    pick up tip more[C2] by ot2.left\n    drop tip by ot2.left\n    transfer"),
    );
    emit();
    assert_eq!(kept(), "rack,taken\ntips,40\nmore,11\n");
    for (table, said) in [
        ("tips,40\n", "first line must be `rack,taken`"),
        ("", "first line must be `rack,taken`"),
        ("rack,taken\ntips,5\ntips,3\n", "line 3: `tips` stands there twice"),
        ("rack,taken\ntips,many\n", "line 2: `many`"),
    ] {
        write(&dir, "tips.csv", table);
        let ended = emit();
        assert!(ended.code == 2 && ended.err.contains(said), "{}", ended.err);
    }
    write(&dir, "tips.csv", "rack,taken\nother,4\n");
    let ended = emit();
    assert!(ended.code == 1 && ended.err.contains("no lab of this file declares `other` itself"), "{}", ended.err);
}
