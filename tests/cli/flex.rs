//! The Flex of Opentrons: its protocols imported and written, its gripper, magnets, heads of 96 channels, liquid classes and reader.

use serde_json::{Value, json};

use crate::harness::{flat, folder, matterixc_in, write};
use crate::protocols::{self, command, there_and_back};

/// What protocols are written as here.
const PYTHON: &str = "opentrons-python";

/// Labware with so many rows and columns of wells, so deep, mm, of so many uL, somewhere on the deck.
fn load(id: &str, name: &str, location: Value, (rows, columns): (usize, usize), [depth, volume]: [f64; 2]) -> Value {
    let category = if name.contains("tiprack_") && !name.ends_with("adapter") { "tipRack" } else { "wellPlate" };
    let definition = protocols::definition(category, rows, columns, [depth, 6.0, volume]);
    let mut loaded = protocols::load(id, (name, 1), "", definition);
    loaded["params"]["location"] = location;
    loaded
}

fn module(id: &str, model: &str, slot: &str) -> Value {
    json!({ "commandType": "loadModule", "params": { "model": model, "location": { "slotName": slot } }, "result": { "moduleId": id, "model": model } })
}

fn well(name: &str, labware: &str, place: &str, more: Value) -> Value {
    let mut params = json!({ "pipetteId": "p", "labwareId": labware, "wellName": place, "wellLocation": { "origin": "bottom", "offset": { "x": 0.0, "y": 0.0, "z": 2.0 } } });
    if let (Some(params), Value::Object(more)) = (params.as_object_mut(), more) {
        params.extend(more);
    }
    command(name, params)
}

/// An analysis of a protocol for the Flex with one pipette.
fn analysis(pipette: &str, steps: Vec<Value>) -> Value {
    let first = json!({ "commandType": "loadPipette", "params": { "pipetteName": pipette, "mount": "left" }, "result": { "pipetteId": "p" } });
    let commands: Vec<Value> = std::iter::once(first).chain(steps).collect();
    json!({ "robotType": "OT-3 Standard", "metadata": { "protocolName": "Flex" }, "errors": [], "commands": commands })
}

/// A file that is checked: its exit status and what it prints.
fn checked(name: &str, text: &str) -> (i32, String) {
    let dir = folder(name);
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["check", "--strict", "a.mtx"]);
    (ended.code, flat(&ended.out))
}

fn slot(name: &str) -> Value {
    json!({ "slotName": name })
}

#[test]
fn a_protocol_with_gripper_bins_and_modules_comes_back() {
    let tips = "opentrons_flex_96_tiprack_200ul";
    let plate = "nest_96_wellplate_200ul_flat";
    let to = |place: Value| {
        command("moveLabware", json!({ "labwareId": "plate", "newLocation": place, "strategy": "usingGripper" }))
    };
    let mut lifted = to(slot("C3"));
    lifted["params"]["pickUpOffset"] = json!({ "x": 0.0, "y": 0.0, "z": 2.5 });
    let steps = vec![
        module("block", "magneticBlockV1", "C1"),
        module("shaker", "heaterShakerModuleV1", "D1"),
        load("tips", tips, slot("C2"), (8, 12), [97.0, 200.0]),
        load("plate", plate, json!({ "addressableAreaName": "D4" }), (8, 12), [10.8, 200.0]),
        to(slot("D2")),
        well("pickUpTip", "tips", "A1", json!({})),
        well("aspirate", "plate", "A1", json!({ "volume": 20.0, "flowRate": 716.0 })),
        well("dispense", "plate", "A2", json!({ "volume": 20.0, "flowRate": 478.0, "pushOut": 0.0 })),
        command("moveToAddressableArea", json!({ "pipetteId": "p", "addressableAreaName": "8ChannelWasteChute" })),
        command("dropTipInPlace", json!({ "pipetteId": "p" })),
        well("pickUpTip", "tips", "A2", json!({})),
        command(
            "moveToAddressableAreaForDropTip",
            json!({ "pipetteId": "p", "addressableAreaName": "movableTrashA3", "alternateDropLocation": true }),
        ),
        command("dropTipInPlace", json!({ "pipetteId": "p" })),
        to(json!({ "moduleId": "block" })),
        lifted,
        command("heaterShaker/openLabwareLatch", json!({ "moduleId": "shaker" })),
        to(json!({ "addressableAreaName": "gripperWasteChute" })),
    ];
    let (text, python) = there_and_back("flex_back", &analysis("p1000_multi_flex", steps), PYTHON);
    for line in [
        "flex = Flex { left: FlexP1000Multi, gripper: FlexGripper, trash: chute } at (0, 0, 0) m",
        "chute = WasteChute on flex.slot[D3]",
        "bin = FlexTrash on flex.slot[A3]",
        "magnet = MagneticBlock on flex.slot[C1]",
        "shaker = FlexHeaterShaker on flex.slot[D1]",
        "plate = Nest96Wellplate200ulFlat on flex.slot[D4]",
        "relocate plate to flex.slot[D2] by flex.gripper",
        "aspirate 20 uL from plate.column(1) by flex.left at bottom + 2 mm",
        "dispense 20 uL into plate.column(2) by flex.left at bottom + 2 mm { push_out: 0 uL, rate: 478 uL/s }",
        "drop tip by flex.left",
        "drop tip into bin by flex.left",
        "relocate plate to magnet by flex.gripper",
        "relocate plate to flex.slot[C3] by flex.gripper { pick_z: 2.5 mm }",
        "dispose plate into chute by flex.gripper",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    for line in [
        "requirements = {\"robotType\": \"Flex\", \"apiLevel\": \"2.21\"}",
        "flex_left = protocol.load_instrument(\"flex_8channel_1000\", \"left\")",
        "chute = protocol.load_waste_chute()",
        "bin = protocol.load_trash_bin(\"A3\")",
        "magnet = protocol.load_module(\"magneticBlockV1\", \"C1\")",
        "flex_left.dispense(20, plate[\"A2\"].top(-8.8), push_out=0)",
        "flex_left.drop_tip(chute)",
        "flex_left.drop_tip(bin)",
        "protocol.move_labware(plate, magnet, use_gripper=True)",
        "protocol.move_labware(plate, \"C3\", use_gripper=True, pick_up_offset={\"x\": 0, \"y\": 0, \"z\": 2.5})",
        "protocol.move_labware(plate, chute, use_gripper=True)",
    ] {
        assert!(python.contains(line), "{line}\n{python}");
    }
}

#[test]
fn ninety_six_channels_take_a_rack_and_fill_a_plate() {
    let steps = vec![
        load("holder", "opentrons_flex_96_tiprack_adapter", slot("A1"), (0, 0), [131.0, 0.0]),
        load("tips", "opentrons_flex_96_tiprack_200ul", json!({ "labwareId": "holder" }), (8, 12), [97.0, 200.0]),
        load("plate", "nest_96_wellplate_200ul_flat", slot("C3"), (8, 12), [10.8, 200.0]),
        load("copy", "nest_96_wellplate_200ul_flat", slot("C2"), (8, 12), [10.8, 200.0]),
        well("pickUpTip", "tips", "A1", json!({})),
        well("aspirate", "plate", "A1", json!({ "volume": 30.0, "flowRate": 80.0 })),
        well("dispense", "copy", "A1", json!({ "volume": 30.0, "flowRate": 80.0 })),
        command(
            "moveToAddressableAreaForDropTip",
            json!({ "pipetteId": "p", "addressableAreaName": "movableTrashA3" }),
        ),
        command("dropTipInPlace", json!({ "pipetteId": "p" })),
    ];
    let (text, python) = there_and_back("flex_96", &analysis("p1000_96", steps), PYTHON);
    for line in [
        "tips = FlexTips200 on holder",
        "pick up tip from tips by flex.left",
        "aspirate 30 uL from plate.wells by flex.left at bottom + 2 mm\n",
        "dispense 30 uL into copy.wells by flex.left at bottom + 2 mm\n",
        "plate = Nest96Wellplate200ulFlat on flex.slot[C3] holding { A1 .. H12: ",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert!(
        python.contains("holder = protocol.load_adapter(\"opentrons_flex_96_tiprack_adapter\", \"A1\""),
        "{python}"
    );
    assert!(python.contains("flex_left.aspirate(30, plate[\"A1\"].bottom(2))"), "{python}");
}

#[test]
fn layouts_of_some_nozzles_come_back() {
    let layout = |style: &str, corner: &str| {
        command(
            "configureNozzleLayout",
            json!({ "pipetteId": "p", "configurationParams": { "style": style, "primaryNozzle": corner } }),
        )
    };
    let mut part = layout("QUADRANT", "H1");
    part["params"]["configurationParams"]["frontRightNozzle"] = "H1".into();
    part["params"]["configurationParams"]["backLeftNozzle"] = "F1".into();
    let away = |steps: &mut Vec<Value>| {
        steps.push(command(
            "moveToAddressableAreaForDropTip",
            json!({ "pipetteId": "p", "addressableAreaName": "movableTrashA3" }),
        ));
        steps.push(command("dropTipInPlace", json!({ "pipetteId": "p" })));
    };
    let mut steps = vec![
        load("tips", "opentrons_flex_96_tiprack_200ul", slot("C2"), (8, 12), [97.0, 200.0]),
        load("plate", "nest_96_wellplate_200ul_flat", slot("B3"), (8, 12), [10.8, 200.0]),
        command("configureNozzleLayout", json!({ "pipetteId": "p", "configurationParams": { "style": "ALL" } })),
        layout("SINGLE", "H1"),
        well("pickUpTip", "tips", "A1", json!({})),
        well("aspirate", "plate", "C4", json!({ "volume": 20.0, "flowRate": 716.0 })),
        well("dispense", "plate", "D4", json!({ "volume": 20.0, "flowRate": 716.0 })),
    ];
    away(&mut steps);
    // The place named is that of the front one of three.
    steps.extend([
        part,
        well("pickUpTip", "tips", "D1", json!({})),
        well("aspirate", "plate", "C5", json!({ "volume": 20.0, "flowRate": 716.0 })),
        well("dispense", "plate", "H5", json!({ "volume": 20.0, "flowRate": 716.0 })),
    ]);
    away(&mut steps);
    steps
        .push(command("configureNozzleLayout", json!({ "pipetteId": "p", "configurationParams": { "style": "ALL" } })));
    steps.push(well("pickUpTip", "tips", "A2", json!({})));
    away(&mut steps);
    let (text, python) = there_and_back("flex_layouts", &analysis("p1000_multi_flex", steps), PYTHON);
    for line in [
        "lay out flex.left from H1\n    pick up tip tips[A1] by flex.left\n    aspirate 20 uL from plate[C4] by flex.left",
        "pick up tip [tips[B1], tips[C1], tips[D1]] by flex.left\n    aspirate 20 uL from [plate[A5], plate[B5], plate[C5]] by flex.left",
        "dispense 20 uL into [plate[F5], plate[G5], plate[H5]] by flex.left",
        "lay out flex.left from all\n    pick up tip tips.column(2) by flex.left",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    for line in [
        "configure_nozzle_layout(style=SINGLE, start=\"H1\")",
        "configure_nozzle_layout(style=PARTIAL_COLUMN, start=\"H1\", end=\"F1\")",
        "pick_up_tip(tips[\"D1\"])",
        "aspirate(20, plate[\"C5\"].bottom(2))",
        "configure_nozzle_layout(style=ALL)",
    ] {
        assert!(python.contains(line), "{line}\n{python}");
    }
}

#[test]
fn a_layout_that_the_language_does_not_have_is_listed_and_what_follows_is_left_out() {
    let dir = folder("flex_layout");
    let quadrant =
        json!({ "style": "QUADRANT", "primaryNozzle": "A1", "backLeftNozzle": "A1", "frontRightNozzle": "D6" });
    let steps = vec![
        load("tips", "opentrons_flex_96_tiprack_200ul", slot("C2"), (8, 12), [97.0, 200.0]),
        command("configureNozzleLayout", json!({ "pipetteId": "p", "configurationParams": quadrant })),
        well("pickUpTip", "tips", "A1", json!({})),
    ];
    write(&dir, "a.json", analysis("p1000_96", steps).to_string());
    let imported = matterixc_in(&dir, &["import", "opentrons", "a.json", "--out", "a.mtx"]);
    let said = flat(&imported.err);
    assert!(said.contains("configureNozzleLayout (command 3)") && said.contains("pickUpTip (command 4)"), "{said}");
}

#[test]
fn rows_and_columns_of_a_head_work_where_their_tips_are() {
    let things = "tips = FlexTips200 on flex.slot[C2]\nmore = FlexTips200 on flex.slot[D1]\nplate = Corning96 on flex.slot[D3] holding { A1 .. H12: 100 uL of water }\n\
                  bath = Reservoir12 on flex.slot[B2] holding { A1 .. A12: 10 mL of water }";
    let text = |steps: &str| lab("FlexP1000x96, FlexTips200", "left: FlexP1000x96, ", things, steps);
    let good = text(
        "lay out flex.left from A12\npick up tip tips.column(1) by flex.left\naspirate 20 uL from plate.column(3) by flex.left\n\
         dispense 20 uL into bath[A5] by flex.left\ndrop tip by flex.left\nlay out flex.left from H1\npick up tip more.row(1) by flex.left\n\
         aspirate 20 uL from plate.row(2) by flex.left\ndispense 20 uL into bath.wells by flex.left\ndrop tip by flex.left\n\
         expect bath[A5].contents.volume in 10.1799 mL .. 10.1801 mL\nexpect bath[A12].contents.volume in 10.0199 mL .. 10.0201 mL\n\
         expect plate[B3].contents.volume in 59.99 uL .. 60.01 uL",
    );
    assert_eq!(checked("flex_rows", &good), (0, "no findings".to_owned()));
    let cases = [
        // The other channels would take tips, too.
        ("way", "lay out flex.left from A1\npick up tip tips.column(1) by flex.left\ndrop tip by flex.left"),
        ("order", "lay out flex.left from A12\npick up tip from tips by flex.left\ndrop tip by flex.left"),
        (
            "column",
            "lay out flex.left from H1\npick up tip more.row(1) by flex.left\naspirate 20 uL from plate.column(1) by flex.left\ndrop tip by flex.left",
        ),
        (
            "row",
            "lay out flex.left from A12\npick up tip tips.column(1) by flex.left\naspirate 20 uL from plate[A1 .. A8] by flex.left\ndrop tip by flex.left",
        ),
        (
            "narrow",
            "lay out flex.left from A12\npick up tip tips.column(1) by flex.left\naspirate 20 uL from plate[A1] by flex.left\ndrop tip by flex.left",
        ),
    ];
    for (name, steps) in cases {
        let (code, said) = checked(&format!("flex_rows_{name}"), &text(steps));
        assert!(code == 1 && said.contains("wrong-column"), "{name}: {said}");
    }
}

/// A lab with a Flex, by what its pipette and its things are.
fn lab(uses: &str, pipette: &str, things: &str, steps: &str) -> String {
    format!(
        "mtx 1\nuse std::beads::magnetic_beads\nuse std::flex::{{Flex, FlexGripper, FlexTrash, {uses}}}\n\
         use std::opentrons::{{Corning96, PcrPlate96, Reservoir1, Reservoir12}}\nuse std::liquid_classes::{{Viscous, Volatile}}\n\
         lab deck {{\n    ambient: 22 degC\n    flex = Flex {{ {pipette}gripper: FlexGripper, trash: bin }} at (0, 0, 0) m\n\
         bin = FlexTrash on flex.slot[A3]\n{things}\n}}\nworkflow w in deck {{\n{steps}\n}}\n"
    )
}

#[test]
fn beads_gather_from_when_their_plate_comes_to_the_block() {
    let things = "magnets = MagneticBlock on flex.slot[C1]\ntips = FlexTips200 on flex.slot[C2]\n\
                  plate = PcrPlate96 on flex.slot[C3] holding { A1 .. H1: 50 uL of suspension }";
    let text = |time: &str| {
        let steps = format!(
            "wait 10 min\nrelocate plate to magnets by flex.gripper\nwait {time}\npick up tip from tips by flex.left\n\
             aspirate 40 uL from plate.column(1) by flex.left\ndispense 40 uL into plate.column(2) by flex.left\ndrop tip by flex.left"
        );
        let text = lab("FlexP1000Multi, FlexTips200, MagneticBlock", "left: FlexP1000Multi, ", things, &steps);
        text.replace("lab deck", "solution suspension { magnetic_beads: 1 %w/w, water: rest }\nlab deck")
    };
    let (code, said) = checked("flex_beads_soon", &text("5 s"));
    assert!(code == 1 && said.contains("beads-not-gathered"), "{said}");
    assert_eq!(checked("flex_beads", &text("2 min")).0, 0);
}

#[test]
fn several_rows_of_channels_share_vessels() {
    let things = "holder = TipRackAdapter on flex.slot[C2]\ntips = FlexTips200 on holder\nplate = Corning96 on flex.slot[C3]\n\
                  bath = Reservoir1 on flex.slot[B3] holding { A1: 100 mL of water }\nstocks = Reservoir12 on flex.slot[D2] holding { A1 .. A12: 5 mL of water }";
    let text = |steps: &str| {
        let steps = format!("pick up tip from tips by flex.left\n{steps}\ndrop tip by flex.left");
        lab("FlexP1000x96, FlexTips200, TipRackAdapter", "left: FlexP1000x96, ", things, &steps)
    };
    let good = text(
        "aspirate 60 uL from bath[A1] by flex.left\ndispense 20 uL into stocks.wells by flex.left\ndispense 40 uL into plate.wells by flex.left\n\
         expect all(v in stocks.wells: v.contents.volume in 5.1599 mL .. 5.1601 mL)\nexpect all(v in plate.wells: v.contents.volume in 39.999 uL .. 40.001 uL)\n\
         expect bath[A1].contents.volume in 94.239 mL .. 94.241 mL",
    );
    assert_eq!(checked("flex_shared", &good), (0, "no findings".to_owned()));
    let ran = matterixc_in(&folder("flex_shared_run"), &["run", &write(&folder("flex_shared_run"), "a.mtx", &good)]);
    assert_eq!(ran.code, 0, "{}", ran.out);
    for (name, places) in [("column", "plate.column(1)"), ("some", "stocks[A1 .. A6]"), ("one", "stocks[A1]")] {
        let (code, said) =
            checked(&format!("flex_{name}"), &text(&format!("aspirate 20 uL from {places} by flex.left")));
        assert!(code == 1 && said.contains("wrong-column"), "{name}: {said}");
    }
    // Each trough gives eight channels their volume, and no more than it has.
    let (code, said) = checked(
        "flex_dry",
        &text("aspirate 200 uL from stocks.wells by flex.left").replace("A12: 5 mL", "A12: 1.5 mL"),
    );
    assert!(code == 1 && said.contains("volume-underflow") && said.contains("this aspirates 1600 uL"), "{said}");
}

#[test]
fn liquids_are_delivered_by_the_rules_of_their_class() {
    let things = "tips = FlexTips200 on flex.slot[C2]\nplate = Corning96 on flex.slot[D2]\n\
                  bath = Reservoir12 on flex.slot[B2] holding { A1: 10 mL of water }\nvolatile = Volatile\nthick = Viscous";
    let steps = "pick up tip from tips by flex.left\ndeliver 125 uL from bath[A1] to plate[A1] by flex.left using volatile\n\
                 deliver 2 uL from bath[A1] to plate[A2] by flex.left using thick { carryover: true }\ndrop tip by flex.left\n\
                 expect plate[A1].contents.volume in 124.999 uL .. 125.001 uL";
    let text = lab("FlexP1000Single, FlexTips200", "left: FlexP1000Single, ", things, steps);
    let dir = folder("flex_class");
    write(&dir, "a.mtx", &text);
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    // Halfway between 50 uL, 50 uL/s and -2.2 uL, and 200 uL, 200 uL/s and -8.9 uL; below the first point as there.
    for line in [
        "flow_rate.aspirate = 125\n",
        "aspirate(119.45, ",
        "delay(seconds=0.2)",
        "aspirate(10)",
        "aspirate(1.92, ",
        "speed=4)",
    ] {
        assert!(emitted.out.contains(line), "{line}\n{}", emitted.out);
    }
    let ran = matterixc_in(&dir, &["run", "a.mtx"]);
    assert_eq!(ran.code, 0, "{}", ran.out);
}

#[test]
fn a_reader_gives_the_absorbance_over_the_height_of_the_liquid() {
    let things = "reader = AbsorbanceReader on flex.slot[D3]\nplate = Corning96 on flex.slot[D2] holding { A1: 200 uL of blue, A2: 100 uL of blue }";
    let text = |steps: &str| {
        lab("AbsorbanceReader, reading_of", "", things, steps).replace(
            "lab deck",
            "species dye { formula: \"C16H18ClN3S\", phase: \"solid\", density: 1.4 g/mL, specific_heat: 1 J/(g*K),\n\
             spectrum: [(400 nm, 1000 L/(mol*cm)), (500 nm, 3000 L/(mol*cm))] }\nsolution blue { dye: 100 umol/L, water: rest }\nlab deck",
        )
    };
    let around = |inner: &str| {
        format!("initialize reader at 450 nm\nopen lid reader\nrelocate plate to reader by flex.gripper\n{inner}")
    };
    // 2000 L/(mol cm) and 100 umol/L; 200 uL stand 6.03 mm high in a well that widens from 6.35 to 6.86 mm, 100 uL 3.09 mm.
    let good = around(
        "close lid reader\nscan reader\nexpect reading_of(reader, plate[A1]) in 0.1200 .. 0.1210\n\
         expect reading_of(reader, plate[A2]) in 0.0613 .. 0.0623\nexpect reading_of(reader, plate[A3]) == 0",
    );
    assert_eq!(checked("flex_reads", &text(&good)), (0, "no findings".to_owned()));
    let run = folder("flex_reads_run");
    write(&run, "a.mtx", text(&good));
    let ran = matterixc_in(&run, &["run", "a.mtx"]);
    assert_eq!(ran.code, 0, "{}", ran.out);
    let cases = [
        ("open", around("scan reader"), "lid-open"),
        ("dark", "initialize reader at 500 nm".to_owned(), "out-of-range"),
        ("never", "scan reader".to_owned(), "never-started"),
        ("loaded", around("close lid reader\ninitialize reader at 600 nm"), "occupied"),
        ("shut", "initialize reader at 450 nm\nrelocate plate to reader by flex.gripper".to_owned(), "lid-closed"),
    ];
    for (name, steps, code) in cases {
        let (status, said) = checked(&format!("flex_reader_{name}"), &text(&steps));
        assert!(status == 1 && said.contains(code), "{name}: {said}");
    }
}

#[test]
fn places_of_modules_are_those_that_the_robot_takes() {
    let cases = [
        ("FlexTemperatureModule", "m = FlexTemperatureModule on flex.slot[C2]", "module in the middle"),
        ("FlexThermocycler", "m = FlexThermocycler on flex.slot[C1]", "flex cycler elsewhere"),
        ("AbsorbanceReader", "m = AbsorbanceReader on flex.slot[C1]", "reader elsewhere"),
        (
            "FlexHeaterShaker",
            "m = FlexHeaterShaker on flex.slot[D3]\nplate = Corning96 on flex.slot[D4]",
            "staging beside module",
        ),
        ("FlexThermocycler", "m = FlexThermocycler on flex.slot[B1]\nplate = Corning96 on flex.slot[A1]", "overlap"),
    ];
    for (index, (uses, things, finding)) in cases.into_iter().enumerate() {
        let (code, said) = checked(&format!("flex_place_{index}"), &lab(uses, "", things, "wait 1 s"));
        assert!(code == 1 && said.contains(finding), "{finding}: {said}");
    }
    let things = "m = MagneticBlock on flex.slot[C2]\nn = FlexHeaterShaker on flex.slot[D1]\nk = FlexThermocycler on flex.slot[B1]\nplate = Corning96 on flex.slot[D4]";
    let (_, said) =
        checked("flex_places", &lab("MagneticBlock, FlexHeaterShaker, FlexThermocycler", "", things, "wait 1 s"));
    assert!(!said.contains("refuses") && !said.contains("takes this module") && !said.contains("overlap"), "{said}");
}

#[test]
fn pipettes_do_not_reach_the_staging_places() {
    let things =
        "tips = FlexTips200 on flex.slot[C2]\nplate = Corning96 on flex.slot[C4] holding { A1: 100 uL of water }";
    let steps = "pick up tip from tips by flex.left\naspirate 50 uL from plate[A1] by flex.left\ndispense 50 uL into plate[A2] by flex.left\ndrop tip by flex.left";
    let (code, said) =
        checked("flex_staging", &lab("FlexP1000Single, FlexTips200", "left: FlexP1000Single, ", things, steps));
    assert!(code == 1 && said.contains("plate[A1]"), "{said}");
}

#[test]
fn strokes_at_the_place_of_the_tip_keep_what_their_class_corrects() {
    let here = |name: &str, more: Value| {
        let mut params = json!({ "pipetteId": "p" });
        if let (Some(params), Value::Object(more)) = (params.as_object_mut(), more) {
            params.extend(more);
        }
        command(name, params)
    };
    let to = |labware: &str, place: &str, above: f64| {
        let mut there = well("moveToWell", labware, place, json!({}));
        there["params"]["wellLocation"] = json!({ "origin": "top", "offset": { "x": 0.0, "y": 0.0, "z": above } });
        there
    };
    let steps = vec![
        module("cycler", "thermocyclerModuleV2", "B1"),
        load("tips", "opentrons_flex_96_tiprack_200ul", slot("C2"), (8, 12), [97.0, 200.0]),
        load("plate", "nest_96_wellplate_200ul_flat", slot("C3"), (8, 12), [10.8, 200.0]),
        well("pickUpTip", "tips", "A1", json!({})),
        here("configureForVolume", json!({ "volume": 100.0 })),
        to("plate", "A1", -8.8),
        here("aspirateInPlace", json!({ "volume": 100.0, "flowRate": 100.0, "correctionVolume": -1.75 })),
        to("plate", "A1", 2.0),
        here("airGapInPlace", json!({ "volume": 10.0, "flowRate": 12.0, "correctionVolume": -2.0 })),
        to("plate", "A2", 2.0),
        here(
            "dispenseInPlace",
            json!({ "volume": 10.0, "flowRate": 100.0, "pushOut": 0.0, "correctionVolume": -1.75 }),
        ),
        to("plate", "A2", -8.8),
        here("dispenseInPlace", json!({ "volume": 100.0, "flowRate": 100.0, "pushOut": 3.0 })),
        here("moveToAddressableAreaForDropTip", json!({ "addressableAreaName": "movableTrashA3" })),
        here("dropTipInPlace", json!({})),
        command(
            "thermocycler/runExtendedProfile",
            json!({ "moduleId": "cycler", "blockMaxVolumeUl": 30.0, "profileElements": [
            { "celsius": 95.0, "holdSeconds": 60.0 },
            { "steps": [{ "celsius": 95.0, "holdSeconds": 10.0 }, { "celsius": 55.0, "holdSeconds": 5.0 }], "repetitions": 30 },
        ] }),
        ),
        command("thermocycler/deactivateBlock", json!({ "moduleId": "cycler" })),
    ];
    let (text, _) = there_and_back("flex_corrected", &analysis("p1000_single_flex", steps), PYTHON);
    for line in [
        "aspirate 98.25 uL from plate[A1] by flex.left at bottom + 2 mm { fix: -1.75 uL, rate: 100 uL/s }",
        "air gap 10 uL by flex.left { rate: 12 uL/s }",
        "dispense 10 uL into plate[A2] by flex.left at top + 2 mm { push_out: 0 uL, rate: 100 uL/s }",
        "dispense 98.25 uL into plate[A2] by flex.left at bottom + 2 mm { push_out: 3 uL, rate: 100 uL/s }",
        "    repeat 30 times {\n        heat cycler to 95 degC { volume: 30 uL }\n        settle cycler\n        wait 10 s",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

#[test]
fn rules_and_strokes_that_cannot_be_are_refused() {
    let things = "tips = FlexTips200 on flex.slot[C2]\nplate = Corning96 on flex.slot[D2]\n\
                  bath = Reservoir12 on flex.slot[B2] holding { A1: 10 mL of water }\nodd = Odd";
    let rule = |tip: &str, fix: &str| {
        format!(
            "Rule {{ model: \"p1000_single_flex\", tip: {tip}, rates_in: [(1 uL, 40 uL/s), (200 uL, 40 uL/s)], \
             rates_out: [(1 uL, 40 uL/s), (200 uL, 40 uL/s)], fixes: [(1 uL, {fix}), (200 uL, {fix})] }}"
        )
    };
    let text = |rules: &str, step: &str| {
        let steps = format!("pick up tip from tips by flex.left\n{step}\ndrop tip by flex.left");
        let text = lab("FlexP1000Single, FlexTips200", "left: FlexP1000Single, ", things, &steps);
        text.replace("lab deck", &format!("asset Odd: LiquidClass {{\n{rules}\n}}\nlab deck"))
    };
    let one = format!("rules[1] = {}", rule("200 uL", "-2 uL"));
    let deliver = "deliver 100 uL from bath[A1] to plate[A1] by flex.left using odd";
    assert_eq!(checked("flex_rule", &text(&one, deliver)), (0, "no findings".to_owned()));
    let cases = [
        ("two", format!("{one}\nrules[2] = {}", rule("200 uL", "1 uL")), deliver, "has 2 rules"),
        ("other", format!("rules[1] = {}", rule("50 uL", "1 uL")), deliver, "has no rule"),
        (
            "full",
            format!("rules[1] = {}", rule("200 uL", "-30 uL")),
            "deliver 210 uL from bath[A1] to plate[A1] by flex.left using odd",
            "tip-overflow",
        ),
        ("wild", one.clone(), "aspirate 50 uL from bath[A1] by flex.left { fix: -60 uL }", "cannot be corrected"),
        (
            "rest",
            one.clone(),
            "aspirate 50 uL from bath[A1] by flex.left\ndispense 20 uL into plate[A1] by flex.left { push_out: 5 uL }",
            "tip-not-empty",
        ),
        (
            "one",
            one.clone(),
            "drop tip by flex.left\nlay out flex.left from H1\npick up tip from tips by flex.left",
            "has one channel",
        ),
    ];
    for (name, rules, step, said) in cases {
        let (code, found) = checked(&format!("flex_rule_{name}"), &text(&rules, step));
        assert!(code == 1 && found.contains(said), "{name}: {found}");
    }
}

#[test]
fn a_head_with_other_channels_than_its_model_is_not_emitted() {
    let dir = folder("flex_head");
    let text = "mtx 1\nuse std::opentrons::{Corning96, OT2, OpentronsPipette, TipRack300}\n\
                asset Four: OpentronsPipette {\n    model: \"MODEL\"\n    channels[1 .. 4] = Nozzle {} at (0, 0, 0) mm pitch (9, 9) mm by 1\n\
                volumes: 20 uL .. 300 uL\n    fits: 200 uL .. 300 uL\n    flow: 90 uL/s\n}\n\
                lab deck {\n    ambient: 22 degC\n    ot2 = OT2 { left: Four } at (0, 0, 0) m\n    tips = TipRack300 on ot2.slot[1]\n\
                plate = Corning96 on ot2.slot[2] holding { A1 .. H1: 200 uL of water }\n}\n\
                workflow w in deck {\n    pick up tip from tips by ot2.left\n    aspirate 50 uL from plate[A1 .. D1] by ot2.left\n\
                dispense 50 uL into plate[A2 .. D2] by ot2.left\n    drop tip by ot2.left\n}\n";
    for (model, said) in [
        ("p300_multi_gen2", "other channels than a `p300_multi_gen2`"),
        ("four", "not called after a pipette of Opentrons"),
    ] {
        write(&dir, "a.mtx", text.replace("MODEL", model));
        let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
        assert!(emitted.code == 1 && flat(&emitted.err).contains(said), "{model}: {}{}", emitted.out, emitted.err);
    }
}
