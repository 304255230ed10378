//! `matterixc emit`: files that other programs run. That Opentrons' own software takes the protocols is judged by
//! `.ci/peers`.

use std::fs;

use serde_json::Value;

use crate::harness::{Ended, flat, folder, matterixc, matterixc_in, root, write};

fn emit(file: &str, target: &str) -> Ended {
    matterixc(&["emit", file, "--target", target])
}

/// What is written agrees with a file that somebody has read; `MATTERIX_UPDATE=1` writes it anew.
fn agrees(file: &str, target: &str, golden: &str) {
    let ended = emit(file, target);
    assert_eq!(ended.code, 0, "{file} as {target}: {}", ended.err);
    let path = root().join("tests/emit").join(golden);
    if std::env::var_os("MATTERIX_UPDATE").is_some() {
        fs::write(&path, &ended.out).expect("the file can be written");
    }
    let known = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        known == ended.out,
        "tests/emit/{golden} differs: MATTERIX_UPDATE=1 cargo test --test cli emit, and read it"
    );
}

#[test]
fn protocols_and_lists_are_as_they_were_read() {
    let blend = "tests/emit/blend.mtx";
    agrees(blend, "opentrons-json", "blend.json");
    agrees(blend, "opentrons-python", "blend.py");
    agrees(blend, "commands", "blend.txt");
    agrees(blend, "commands-json", "blend.jsonl");
}

#[test]
fn the_motions_of_an_arm_are_as_they_were_read() {
    agrees("tests/emit/arm.mtx", "urscript", "arm.script");
}

#[test]
fn trajectories_follow_one_another_and_do_not_jump() {
    let ended = emit("tests/emit/arm.mtx", "joint-trajectory-json");
    assert_eq!(ended.code, 0, "{}", ended.err);
    let document: Value = serde_json::from_str(&ended.out).expect("a JSON document");
    let list = document["trajectories"].as_array().expect("a list");
    let arm: Vec<&Value> = list.iter().filter(|t| t["topic"] == "/ur5e/joint_trajectory").collect();
    assert!(arm.len() >= 8, "{} motions", arm.len());
    assert!(list.iter().any(|t| t["topic"] == "/ur5e/gripper/joint_trajectory"));
    let time = |t: &Value| t["sec"].as_f64().expect("s") + t["nanosec"].as_f64().expect("ns") * 1e-9;
    let positions = |p: &Value| -> Vec<f64> {
        p["positions"].as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let mut before: Option<(f64, Vec<f64>)> = None;
    for t in arm {
        assert_eq!(t["joint_names"].as_array().map(Vec::len), Some(6));
        let points = t["points"].as_array().expect("a list");
        let begins = time(&t["header"]["stamp"]);
        if let Some((ended, stood)) = &before {
            assert!(begins >= ended - 1e-6, "begins at {begins} s, before {ended} s");
            let first = positions(&points[0]);
            assert!(first.iter().zip(stood).all(|(a, b)| (a - b).abs() < 1e-6), "{first:?} after {stood:?}");
        }
        for pair in points.windows(2) {
            assert!(time(&pair[1]["time_from_start"]) > time(&pair[0]["time_from_start"]));
        }
        let last = &points[points.len() - 1];
        before = Some((begins + time(&last["time_from_start"]), positions(last)));
    }
}

#[test]
fn trajectories_in_mcap_are_messages_of_ros() {
    let dir = folder("emit_mcap");
    let out = dir.join("arm.mcap");
    let ended =
        matterixc(&["emit", "tests/emit/arm.mtx", "--target", "joint-trajectory", "-o", out.to_str().expect("text")]);
    assert_eq!((ended.code, ended.out.as_str()), (0, ""), "{}", ended.err);
    let bytes = fs::read(&out).expect("it is written");
    assert!(bytes.starts_with(b"\x89MCAP"));
    let has = |text: &str| bytes.windows(text.len()).any(|w| w == text.as_bytes());
    for text in ["trajectory_msgs/msg/JointTrajectory", "ros2msg", "cdr", "/ur5e/joint_trajectory", "wrist_3_joint"] {
        assert!(has(text), "no {text}");
    }
}

#[test]
fn the_same_workflow_gives_the_same_bytes() {
    for target in ["opentrons-json", "opentrons-python", "commands-json"] {
        assert_eq!(emit("tests/emit/blend.mtx", target).out, emit("tests/emit/blend.mtx", target).out);
    }
}

/// Codes and headlines of what keeps a workflow from being written.
fn refused(name: &str, text: &str, target: &str) -> String {
    let dir = folder(&format!("emit_{name}"));
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["emit", "a.mtx", "--target", target, "-o", "out"]);
    assert_eq!(ended.code, 1, "{name}: {}", ended.err);
    assert!(!dir.join("out").exists(), "{name}: something is written");
    assert!(ended.out.is_empty());
    flat(&ended.err)
}

/// A deck with a hotplate beside it.
fn workflow(lines: &str) -> String {
    format!(
        "mtx 1
use std::heating::IkaRetControl
use std::opentrons::{{Corning96, OT2, P300Single, Reservoir12, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    other = OT2 {{ left: P300Single }} at (2, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    more = TipRack300 on other.slot[1]
    plate = Corning96 on ot2.slot[2]
    stock = Reservoir12 on ot2.slot[3] holding {{ A1: 10 mL of water }}
    hotplate = IkaRetControl at (1, 1, 0) m
    aside = Corning96 on hotplate
}}
workflow work in deck {{
{lines}
}}"
    )
}

#[test]
fn what_a_protocol_cannot_say_is_said_at_its_line() {
    let tip = "pick up tip from tips by ot2.left";
    let cases: [(&str, String, &[&str]); 8] = [
        (
            "device",
            "heat hotplate to 60 degC\nstop heating hotplate".into(),
            &["cannot control `hotplate`", "a.mtx:16"],
        ),
        (
            "branch",
            "let m <- read hotplate\nif m > 1 g { note \"heavy\" }".into(),
            &["cannot branch on `m > 1 g`", "a.mtx:17"],
        ),
        ("condition", "wait until hotplate.temperature < 30 degC".into(), &["cannot wait for", "a.mtx:16"]),
        (
            "value",
            format!(
                "let m <- read hotplate\n{tip}\naspirate m / (1 kg/mL) + 50 uL from stock[A1] by ot2.left\ndrop tip by ot2.left"
            ),
            &["needs every value before the run", "a.mtx:18"],
        ),
        ("beside", format!("parallel {{ {tip}; wait 1 s }}\ndrop tip by ot2.left"), &["one step after the other"]),
        ("handler", format!("sequence {{ {tip} }} on failure {{ wait 1 s }}\ndrop tip by ot2.left"), &["a handler"]),
        (
            "robots",
            format!("{tip}\npick up tip from more by other.left\ndrop tip by ot2.left\ndrop tip by other.left"),
            &["is for one robot", "a.mtx:17"],
        ),
        (
            "elsewhere",
            format!(
                "{tip}\naspirate 50 uL from stock[A1] by ot2.left\ndispense 50 uL into aside[A1] by ot2.left\ndrop tip by ot2.left"
            ),
            &["`ot2.left` cannot reach `aside[A1]`", "a.mtx:18"],
        ),
    ];
    for (name, lines, expected) in cases {
        let said = refused(name, &workflow(&lines), "opentrons-json");
        for text in expected {
            assert!(said.contains(text), "{name}: no `{text}` in\n{said}");
        }
        assert!(said.ends_with("1 error"), "{name}: one mistake is one message\n{said}");
    }
}

#[test]
fn errors_of_check_and_failures_of_the_performance_keep_it_from_being_written() {
    let underflow =
        workflow("pick up tip from tips by ot2.left\naspirate 50 uL from stock[A2] by ot2.left\ndrop tip by ot2.left");
    assert!(refused("check", &underflow, "opentrons-json").contains("error[never-filled]"));
    let missed = workflow("expect elapsed > 1 h");
    assert!(refused("missed", &missed, "commands").contains("error[expectation-failed]"));
    let none =
        "mtx 1\nuse std::heating::IkaRetControl\nlab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }
workflow rest in bench { heat plate to 60 degC; stop heating plate }\n";
    assert!(refused("no_robot", none, "opentrons-json").contains("needs an Opentrons robot"));
    assert!(refused("no_arm", none, "urscript").contains("no arm moves"));
    assert!(refused("no_joints", none, "joint-trajectory").contains("no robot with joints moves"));
}

#[test]
fn what_the_text_decides_is_no_branch() {
    let text = workflow(
        "for i in [1, 2] {
        if i == 2 { pick up tip from tips by ot2.left; wait 1 s; drop tip by ot2.left } else { note \"first\" }
    }",
    );
    let dir = folder("emit_decided");
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert_eq!(ended.out.matches("pick_up_tip").count(), 1);
    assert_eq!(ended.out.matches("protocol.comment").count(), 1);
}

/// A plate whose definition does not come with Opentrons' software.
pub fn own_plate() -> String {
    let printed = matterixc(&["labware", "corning_96_wellplate_360ul_flat/2", "--format", "definition"]);
    let mut definition: Value = serde_json::from_str(&printed.out).expect("JSON");
    definition["namespace"] = "house".into();
    definition["parameters"]["loadName"] = "flat_96".into();
    definition["version"] = 7.into();
    definition.to_string()
}

#[test]
fn a_line_of_ones_own_takes_the_place_of_one_of_the_library() {
    let page = fs::read_to_string(root().join("docs/emit.md")).expect("the page can be read");
    let driver = page.split_once("```mtx\n").and_then(|(_, rest)| rest.split_once("```")).expect("an example").0;
    let dir = folder("emit_careful");
    write(&dir, "driver.mtx", driver);
    let checked = matterixc_in(&dir, &["check", "--strict", "driver.mtx"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let steps = "pick up tip from tips by ot2.left\naspirate 50 uL from stock[A1] by ot2.left\ndrop tip by ot2.left";
    let own = driver.trim_start_matches("mtx 1\n");
    write(&dir, "a.mtx", format!("{}\n{own}", workflow(steps)));
    let ended = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert!(ended.out.contains("ot2_left.flow_rate.aspirate = 46.43\n"), "{}{}", ended.out, ended.err);
    assert!(ended.out.contains("ot2_left.aspirate(50, stock[\"A1\"].bottom(2))"), "{}", ended.out);
    assert!(ended.out.contains("ot2_left.drop_tip("), "{}", ended.out);
}

#[test]
fn names_that_python_has_itself_are_not_taken() {
    let dir = folder("emit_names");
    let text = workflow("pick up tip from run by ot2.left\ndrop tip by ot2.left").replace("tips = ", "run = ");
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert!(ended.out.contains("ot2_left.pick_up_tip(run_2[\"A1\"])"), "{}{}", ended.out, ended.err);
}

#[test]
fn programs_for_pylabrobot_say_each_stroke_by_channel() {
    let dir = folder("pylabrobot");
    let text = |step: &str| {
        format!(
            "mtx 1
use std::opentrons::{{Corning96, OT2, P300Multi, P20Single, Reservoir12, TemperatureModule, TipRack20, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P20Single, right: P300Multi }} at (0, 0, 0) m
    deck = Corning96 on ot2.slot[1]
    trough = Reservoir12 on ot2.slot[2] holding {{ A1: 10 mL of water }}
    large = TipRack300 on ot2.slot[3]
    small = TipRack20 on ot2.slot[4]
    cold = TemperatureModule on ot2.slot[6]
}}
workflow go in deck {{
    {step}
}}\n"
        )
    };
    let steps = "pick up tip large.column(2) by ot2.right
    aspirate 100 uL from trough[A1] by ot2.right
    dispense 60 uL into deck.column(3) by ot2.right at bottom + 2 mm { rate: 30 uL/s }
    touch tip to deck.column(3) by ot2.right
    blow out into deck.column(4) by ot2.right
    return tip to large.column(2) by ot2.right
    pick up tip from small by ot2.left
    aspirate 5 uL from trough[A1] by ot2.left
    move ot2.left to trough[A2]
    air gap 2 uL by ot2.left
    dispense 7 uL into deck[B5] by ot2.left
    wait 3 s
    drop tip by ot2.left";
    write(&dir, "a.mtx", text(steps));
    let emitted = matterixc_in(&dir, &["emit", "a.mtx", "--target", "pylabrobot"]);
    assert_eq!(emitted.code, 0, "{}", emitted.err);
    let eight = |column: u32| "ABCDEFGH".chars().map(|row| format!("\"{row}{column}\"")).collect::<Vec<_>>().join(", ");
    let channels = "[1, 2, 3, 4, 5, 6, 7, 8]";
    for line in [
        "CHANNELS = 9".to_owned(),
        // The deck of PyLabRobot is called so.
        "deck_2 = make_plate(\"deck_2\", (127.76, 85.47, 14.22), [".to_owned(),
        "deck.assign_child_at_slot(deck_2, 1)".to_owned(),
        format!("await lh.pick_up_tips(at(large, {}), use_channels={channels})", eight(2)),
        format!("await aspirate(lh, at(trough, {}), {channels}, 100, height=1, rate=94)", ["\"A1\""; 8].join(", ")),
        format!("await dispense(lh, at(deck_2, {}), {channels}, 60, height=2, rate=30)", eight(3)),
        "await touch(lh, 1, at(deck_2, \"A3\")[0], height=9.67, radius=1)".to_owned(),
        format!(
            "await dispense(lh, at(deck_2, {}), {channels}, 40, height=10.67, rate=94, blow_out=BLOW_OUT)",
            eight(4)
        ),
        format!("await lh.drop_tips(at(large, {}), use_channels={channels}, allow_nonzero_volume=True)", eight(2)),
        "await aspirate(lh, at(trough, \"A2\"), [0], 2, height=26.85, rate=7.56)".to_owned(),
        "await dispense(lh, at(deck_2, \"B5\"), [0], 7, height=10.67, rate=7.56)".to_owned(),
        "await wait(lh, 3)".to_owned(),
        "await lh.discard_tips(use_channels=[0], allow_nonzero_volume=True)".to_owned(),
    ] {
        assert!(emitted.out.contains(&line), "{line}: {}", emitted.out);
    }
    write(&dir, "a.mtx", text("heat cold to 10 degC { stays: true }"));
    let refused = matterixc_in(&dir, &["emit", "a.mtx", "--target", "pylabrobot", "-o", "a.py"]);
    assert_eq!((refused.code, dir.join("a.py").exists()), (1, false), "{}", refused.err);
    let said = flat(&format!("{}{}", refused.out, refused.err));
    assert!(said.contains("PyLabRobot has no call for `temperatureModule/setTargetTemperature`"), "{said}");
}

#[test]
fn labware_of_ones_own_goes_along() {
    let dir = folder("emit_own");
    write(&dir, "plate.json", own_plate());
    let text = workflow("pick up tip from tips by ot2.left\naspirate 50 uL from stock[A1] by ot2.left\ndispense 50 uL into own[B2] by ot2.left\ndrop tip by ot2.left")
        .replace("lab deck {", "asset Own from labware \"plate.json\"\nlab deck {\n    own = Own on ot2.slot[5]");
    write(&dir, "a.mtx", text);
    let json = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-json"]);
    assert_eq!(json.code, 0, "{}", json.err);
    let document: Value = serde_json::from_str(&json.out).expect("JSON");
    assert_eq!(document["labwareDefinitions"]["house/flat_96/7"]["version"], 7);
    let python = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-python"]);
    assert!(
        python.out.contains("load_labware_from_definition(DEFINITIONS[\"house/flat_96/7\"], \"5\", label=\"own\")")
    );
}

#[test]
fn a_driver_that_says_something_unknown_is_named() {
    let dir = folder("emit_driver");
    let text = workflow("blink lamp").replace(
        "lab deck {",
        "capability Lamp: Body { command blink }\nasset Led: Lamp { mass: 1 g }
driver LedCommands for Led over opentrons { open sends \"loadModule model=led location={support}\"; blink sends \"blink times=3\" }
lab deck {\n    lamp = Led on ot2.slot[9]",
    );
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["emit", "a.mtx", "--target", "opentrons-json"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("error[wrong-message]: unknown Opentrons command `blink`"), "{}", ended.err);
}

#[test]
fn drivers_over_opentrons_are_checked_where_they_are_declared() {
    let check = |wires: &str| {
        let dir = folder("emit_declared");
        let text = format!(
            "mtx 1\nuse std::opentrons::OpentronsPipette\ndriver Mine for OpentronsPipette over opentrons {{ {wires} }}\n"
        );
        write(&dir, "a.mtx", text);
        matterixc_in(&dir, &["check", "a.mtx", "--format", "json"])
    };
    assert_eq!(check("drop tip sends \"dropTipInPlace\"").code, 0);
    for (wires, code) in [
        ("drop tip onto(x) sends \"dropTipInPlace\"", "unknown-verb"),
        ("drop tip sends \"dropTipInPlace {volum}\"", "unknown-name"),
        ("reply \"#\" fails blocked", "misplaced"),
    ] {
        let found: Vec<Value> = check(wires).out_lines();
        assert_eq!(found.iter().map(|l| l["code"].as_str().unwrap_or("")).collect::<Vec<_>>(), [code], "{wires}");
    }
}

/// A deck with a temperature module, a heater-shaker and a thermocycler.
fn modules(lines: &str) -> String {
    format!(
        r#"mtx 1
use std::opentrons::{{Corning96, HeaterShaker, OT2, P300Single, TemperatureModule, ThermocyclerGen2, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single }} at (0, 0, 0) m
    shaker = HeaterShaker {{ latch: closed }} on ot2.slot[1]
    cold = TemperatureModule on ot2.slot[3]
    plate = Corning96 on cold holding {{ A1: 100 uL of water }}
    cycler = ThermocyclerGen2 on ot2.slot[7]
}}
workflow w in deck {{
    heat cold to 37 degC
    heat shaker to 45 degC
{lines}
}} finally {{
    stop heating cold
    stop heating shaker
}}
"#
    )
}

#[test]
fn a_wait_for_a_module_is_its_own_wait() {
    let dir = folder("emit_own_waits");
    write(&dir, "lab.mtx", modules("    wait until cold.temperature >= 36 degC and shaker.temperature > 44 degC"));
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let waits = "    shaker.wait_for_temperature()\n    cold.await_temperature(37)\n";
    assert!(ended.out.contains(waits), "{}", ended.out);
    // The module goes on at its set point, where this does not hold.
    let passing = "    wait until cold.temperature in 25 degC .. 30 degC";
    let said = flat(&refused("emit_passing", &modules(passing), "opentrons-json"));
    assert!(said.contains("would go on before `cold.temperature in 25 degC .. 30 degC` holds"), "{said}");
    // What is in the wells no module waits for.
    let wells = "    wait until plate[A1].contents.temperature > 30 degC";
    let said = flat(&refused("emit_wells", &modules(wells), "opentrons-json"));
    assert!(said.contains("cannot wait for `plate[A1].contents.temperature > 30 degC`"), "{said}");
}

#[test]
fn modules_begin_as_the_lab_has_them() {
    let dir = folder("emit_begins");
    write(&dir, "lab.mtx", modules("    settle cold"));
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(
        ended.out.contains("    cycler.open_lid()\n") && ended.out.contains("    shaker.close_labware_latch()\n"),
        "{}",
        ended.out
    );
    write(
        &dir,
        "lab.mtx",
        modules("    settle cold").replace("ThermocyclerGen2 on", "ThermocyclerGen2 { lid: closed } on"),
    );
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python"]);
    assert!(ended.code == 0 && !ended.out.contains("open_lid"), "{}{}", ended.out, ended.err);
}

#[test]
fn json_brings_the_definitions_of_its_labware() {
    let dir = folder("emit_definitions");
    write(&dir, "lab.mtx", modules("    settle cold"));
    let ended = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-json"]);
    let document: Value = serde_json::from_str(&ended.out).expect("a JSON document");
    let definition = &document["labwareDefinitions"]["opentrons/corning_96_wellplate_360ul_flat/2"];
    assert_eq!(definition["wells"].as_object().map(|wells| wells.len()), Some(96));
}

#[test]
fn labware_that_a_person_moves_is_moved_in_the_protocol() {
    let dir = folder("emit_moves");
    let text = r#"mtx 1
use std::furniture::LabBench
use std::opentrons::{Corning96, HeaterShaker, OT2, P300Single, Reservoir12, TipRack300}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    table = LabBench at (0, -1.5, 0) m
    tips = TipRack300 on ot2.slot[5]
    shaker = HeaterShaker on ot2.slot[1]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 5 mL of water }
    plate = Corning96 on ot2.slot[6]
    second = Corning96 on table
}
workflow w in deck {
    relocate plate to shaker
    close latch shaker
    transfer 50 uL from stock[A1] to plate[B1] by ot2.left using tips { tips: once }
    relocate second to ot2.slot[6]
    transfer 50 uL from stock[A1] to second[B1] by ot2.left using tips { tips: once }
    open latch shaker
    relocate plate to table
    expect plate[B1].contents.volume in 49.9 uL .. 50.1 uL
}
"#;
    write(&dir, "lab.mtx", text);
    let checked = matterixc_in(&dir, &["check", "--strict", "lab.mtx"]);
    assert_eq!(checked.code, 0, "{}", checked.out);
    let python = matterixc_in(&dir, &["emit", "lab.mtx", "--target", "opentrons-python"]).out;
    let lines = ["(plate, shaker)", "(second, \"6\")", "(plate, protocol_api.OFF_DECK)"];
    let at: Vec<_> = lines.iter().map(|l| python.find(&format!("    protocol.move_labware{l}\n"))).collect();
    assert!(at.iter().all(Option::is_some) && at.is_sorted() && !python.contains("protocol.pause"), "{python}");
    assert!(
        python.contains("second = protocol.load_labware(\"corning_96_wellplate_360ul_flat\", protocol_api.OFF_DECK"),
        "{python}"
    );
    // What stands off the deck no pipette reaches.
    let there = "    relocate plate to table\n    transfer 50 uL from stock[A1] to plate[C1] by ot2.left using tips { tips: once }\n";
    let said = flat(&refused("emit_off", &text.replace("    relocate plate to table\n", there), "opentrons-json"));
    assert!(said.contains("cannot reach `plate[C1]`"), "{said}");
    // The latch holds it.
    write(&dir, "lab.mtx", text.replace("    open latch shaker\n", ""));
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(ended.code == 1 && ended.out.contains("error[latch-closed]"), "{}", ended.out);
    // Its place is taken.
    write(&dir, "lab.mtx", text.replace("    relocate plate to shaker\n    close", "    close"));
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(ended.code == 1 && ended.out.contains("error[occupied]"), "{}", ended.out);
}
