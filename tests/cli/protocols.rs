//! Protocols of Opentrons that are imported, checked and written again.

use serde_json::{Map, Value, json};

use crate::harness::{flat, folder, matterixc_in, write};

/// A definition: rows and columns of round wells 9 mm apart, so deep and wide, mm, of so many uL.
fn definition(category: &str, rows: usize, columns: usize, [depth, diameter, volume]: [f64; 3]) -> Value {
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
    json!({ "metadata": { "displayCategory": category }, "parameters": { "isTiprack": category == "tipRack" }, "wells": wells, "ordering": ordering })
}

fn load(id: &str, (load_name, version): (&str, u32), slot: &str, definition: Value) -> Value {
    json!({
        "commandType": "loadLabware",
        "params": { "location": { "slotName": slot }, "loadName": load_name, "namespace": "opentrons", "version": version, "displayName": id },
        "result": { "labwareId": id, "definition": definition },
    })
}

fn command(name: &str, params: Value) -> Value {
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
    steps.insert(
        3,
        command("moveToCoordinates", json!({ "pipetteId": "p", "coordinates": { "x": 1, "y": 2, "z": 3 } })),
    );
    write(&dir, "a.json", analysis(steps).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    assert!(imported.err.contains("moveToCoordinates (command 9)"), "{}", imported.err);
    assert!(imported.out.contains("// not imported: moveToCoordinates, as "), "{}", imported.out);
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

#[test]
fn what_is_no_protocol_of_an_ot2_is_refused() {
    let dir = folder("refused");
    let mut flex = analysis(Vec::new());
    flex["robotType"] = "OT-3 Standard".into();
    let mut wrong = analysis(Vec::new());
    wrong["errors"] = json!([{ "detail": "KeyError: 'x'" }]);
    let legacy = analysis(vec![command("custom", json!({ "legacyCommandText": "Touching tip" }))]);
    let cases = [
        ("{".to_owned(), "neither an analysis nor a JSON protocol"),
        ("[]".to_owned(), "neither an analysis nor a JSON protocol"),
        (flex.to_string(), "only protocols of the OT-2"),
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
    // 100 uL stand 2.7 mm high in a flat well of 6.86 mm; the rim is 10.67 mm above the bottom, whatever the workflow calls top.
    let cases = [
        ("aspirate 20 uL from plate[A1] by ot2.left at surface - 1 mm", "no findings"),
        ("aspirate 20 uL from plate[A1] by ot2.left at bottom + 2.6 mm", "no findings"),
        ("aspirate 20 uL from plate[A1] by ot2.left at bottom + 2.8 mm", "above-liquid"),
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
