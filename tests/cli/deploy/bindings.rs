//! Bindings and plans that are refused before anything is sent.

use super::{HEAT, bench};
use crate::harness::{flat, matterixc_in, write};

/// Codes and text of the findings of a dry run with these bindings.
fn found(name: &str, text: &str, bindings: &str) -> String {
    let dir = bench(name, text, "plate", "");
    write(&dir, "lab.toml", bindings);
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    assert!(ended.out.is_empty(), "nothing is sent: {}", ended.out);
    ended.err
}

#[test]
fn refused_bindings_leave_no_journal_behind() {
    let dir = bench("no_journal", HEAT, "plate", "");
    write(&dir, "lab.toml", "[plat]\nport = \"x\"");
    let args = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--journal", "j.jsonl", "--yes"];
    assert_eq!(matterixc_in(&dir, &args).code, 1);
    assert!(!dir.join("j.jsonl").exists());
    write(&dir, "j.jsonl", "something else\n");
    let ended = matterixc_in(&dir, &args);
    assert_eq!(ended.code, 2, "{}", ended.err);
    assert!(ended.err.contains("choose another name for the journal"), "{}", ended.err);
}

#[test]
fn what_is_wrong_with_bindings_is_said_where_it_stands() {
    let cases = [
        ("[plat]\nport = \"x\"", "has no `plat`"),
        ("plate = 3", "`plate` needs a table"),
        ("[plate]\nprot = \"x\"", "unknown key `prot` in a binding"),
        ("[plate]\n", "has no place"),
        ("[plate]\nport = 3", "must be a text"),
        ("[plate]\nport = \"x\"\naddress = \"y\"", "two lines"),
        ("[plate]\nport = \"x\"\nhttp = \"y\"", "two lines"),
        ("[plate]\nhttp = \"127.0.0.1:1\"", "needs a serial line"),
        ("[plate]\nport = \"x\"\ndriver = \"Cavro\"", "no driver `Cavro`"),
        ("[plate]\nby = \"feet\"", "the only value of `by` is `hand`"),
        ("[plate]\nport = \"x\"\ntolerance = { temperature = \"5 g\" }", "must be a number in K"),
        ("[plate]\nport = \"x\"\ntolerance = { colour = \"5 g\" }", "does not report `colour`"),
        ("[beaker]\nport = \"x\"", "`beaker` has no driver"),
        ("[plate", "not valid TOML"),
        ("[plate]\naddress = \"nonsense\"", "the port of `nonsense` is missing"),
        ("[plate]\naddress = \"127.0.0.1:70000\"", "`70000` is not a port"),
        ("[plate]\naddress = \"127.0.0.1:0\"", "`0` is not a port"),
        ("[plate]\naddress = \"tcp://127.0.0.1:1\"", "`tcp://` is not supported here"),
        ("[plate]\nport = \"\"", "a serial port needs a path"),
        ("[plate]\nport = \"tcp://127.0.0.1:1\"", "is not one"),
        ("[plate]\nport = \"x\"\ncalibration = 3", "a calibration must be a table"),
        ("[plate]\nport = \"x\"\ncalibration = { gain = 3 }", "a text with its unit"),
        ("[ghost]\ncalibration = { gain = \"3 W/K\" }", "declares `ghost`"),
    ];
    let mut missed = Vec::new();
    for (index, (bindings, wanted)) in cases.iter().enumerate() {
        let err = found(&format!("binding_{index}"), HEAT, bindings);
        if !(err.contains("error[binding]") && err.contains(wanted)) {
            missed.push(format!("{bindings}: {wanted}: {err}"));
        }
        assert!(err.contains("lab.toml:"), "{bindings}: {err}");
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn a_step_that_nobody_is_told_of_is_found_first() {
    let err = found("undriven", HEAT, "");
    assert_eq!(err.matches("error[undriven]").count(), 1, "one device, one finding: {err}");
    assert!(err.contains("lab.mtx:10") && err.contains("the same at 3 other places"), "{err}");
    assert!(err.contains("[plate]\n") && err.contains("port = \"/dev/ttyUSB0\""), "{err}");
}

#[test]
fn the_device_that_would_be_told_is_the_one_to_bind() {
    let dir = bench("undriven_pump", include_str!("../../deploy/dose.mtx"), "pump", "");
    write(&dir, "lab.toml", "");
    let ended = matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"]);
    assert_eq!(ended.err.matches("error[undriven]").count(), 1, "{}", ended.err);
    for said in ["`pump`", "[pump]\n", "driver = \"CavroDt\"", "driver = \"CavroOem\""] {
        assert!(ended.err.contains(said), "{said}: {}", ended.err);
    }
}

#[test]
fn what_is_said_of_some_devices_only_is_known_before() {
    let driver = |condition: &str| {
        let line = "serial(baud: 9600, frame: \"7E1\", framing: namur, timeout: 1 s)";
        format!("driver Own for IkaRetControl over {line} {{\n    open while {condition} sends \"OWN\"\n}}\nworkflow")
    };
    let dry = |name: &str, condition: &str| {
        let dir = bench(name, &HEAT.replace("workflow", &driver(condition)), "plate", "");
        write(&dir, "lab.toml", "[plate]\nport = \"x\"\ndriver = \"Own\"");
        matterixc_in(&dir, &["deploy", "lab.mtx", "--bind", "lab.toml"])
    };
    let later = dry("open_while_later", "temperature > 30 degC");
    assert!(later.err.contains("error[driver-line]") && later.err.contains("lab.mtx:10:16"), "{}", later.err);
    for (name, condition) in [("open_while_so", "mass > 1 kg"), ("open_while_not", "mass > 100 kg")] {
        let ended = dry(name, condition);
        assert!(!ended.err.contains("driver-line") && ended.err.contains("undriven"), "{}", ended.err);
    }
}

#[test]
fn what_was_measured_is_judged_where_it_stands() {
    for (name, given, code) in [
        ("measured_unit", "{ gain = \"3 s\" }", "error[unit-mismatch]"),
        ("measured_field", "{ gian = \"3 W/K\" }", "error[unknown-field]"),
        ("measured_range", "{ gain = \"-3 W/K\" }", "error[out-of-range]"),
    ] {
        let err = found(name, HEAT, &format!("[plate]\nport = \"x\"\ncalibration = {given}"));
        assert!(err.contains(code) && err.contains("lab.toml:3:"), "{name}: {err}");
    }
}

#[test]
fn a_shadow_needs_something_to_go_by() {
    let dir = bench("shadow_of_nothing", HEAT, "plate", "");
    write(&dir, "lab.toml", "[plate]\nport = \"x\"");
    let args = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "shadow", "--journal", "j.jsonl"];
    let ended = matterixc_in(&dir, &args);
    assert!(ended.code == 1 && ended.err.contains("no device is compared with the twin"), "{}", ended.err);
    assert!(ended.err.contains("lab.toml:2:8") && !dir.join("j.jsonl").exists(), "{}", ended.err);
}

#[test]
fn a_decision_on_a_device_that_is_not_bound_says_how_to_bind_it() {
    let text = HEAT
        .replace("use std::heating", "use std::balances::PrecisionBalance\nuse std::heating")
        .replace("    plate =", "    scale = PrecisionBalance at (2, 0, 0) m\n    plate =")
        .replace("    wait until", "    let load = scale.weight\n    if load > 1 kg { wait 1 s }\n    wait until");
    let err = found("unasked", &text, "[plate]\nport = \"x\"");
    let flat = flat(&err);
    assert!(err.contains("error[unobserved]") && flat.contains("`scale` has no binding"), "{err}");
    assert!(err.contains("[scale]\n") && !err.contains("undriven"), "{err}");
}

#[test]
fn a_decision_on_what_no_device_tells_is_found_first() {
    let hidden = HEAT.replace("plate.temperature >= 30 degC timeout", "beaker.contents.temperature >= 30 degC timeout");
    let err = found("unobserved", &hidden, "[plate]\nport = \"x\"");
    assert!(err.contains("error[unobserved]") && err.contains("lab.mtx:12"), "{err}");
}

#[test]
fn hands_do_what_has_no_line_if_someone_confirms() {
    let dir = bench("hands", HEAT, "plate", "");
    write(&dir, "lab.toml", "[plate]\nby = \"hand\"");
    let text = HEAT
        .replace("wait until plate.temperature >= 30 degC timeout 1 h", "wait 2 s")
        .replace("expect plate.temperature >= 29 degC", "note \"done\"");
    write(&dir, "lab.mtx", text);
    let given = ["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "real", "--speed", "40", "--journal"];
    let nobody = matterixc_in(&dir, &[&given[..], &["one"]].concat());
    assert!(nobody.code == 1 && nobody.err.contains("nobody can confirm it"), "{}", nobody.err);
    let yes = matterixc_in(&dir, &[&given[..], &["two", "--yes"]].concat());
    assert_eq!(yes.code, 0, "{}", yes.err);
    assert!(yes.err.contains("please do this, then confirm: heat plate to 50 degC"), "{}", yes.err);
}
