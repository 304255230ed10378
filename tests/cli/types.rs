//! Types beyond quantities: words, roles, texts with values.

use crate::harness::{folder, matterixc_in, root, write};
use crate::slips::{self, findings};

/// The headline of the only finding, after its code.
fn only(name: &str, text: &str) -> String {
    let found = findings(name, text);
    let [one] = found.as_slice() else { panic!("{name}: {found:?}\n{text}") };
    one.clone()
}

const BOX: &str = "
capability Lidded: Body {
    state lid: open | closed = closed
    state flap: up | down = up
    command swing to(position: open | closed)
        option speed: slow | fast = slow
        effect lid = position
}
asset Crate: Lidded { mass: 1 kg }
lab bench { ambient: 22 degC, crate = Crate { lid: open } at (0, 0, 0) m }
workflow w(end: open | closed = closed) in bench {
    swing crate to end { speed: fast }
    expect crate.lid == closed
}
";

#[test]
fn a_word_that_is_none_of_the_state_is_reported() {
    assert_eq!(findings("fine", BOX), [] as [&str; 0]);
    let slips = [
        ("default", "= closed\n    state", "= closde\n    state", "`closde` is not one of `open`, `closed`"),
        ("field", "{ lid: open }", "{ lid: opne }", "`opne` is not one of `open`, `closed`"),
        (
            "parameter",
            "(end: open | closed = closed)",
            "(end: open | closed = up)",
            "`up` is not one of `open`, `closed`",
        ),
        ("argument", "crate to end", "crate to shut", "`shut` is not one of `open`, `closed`"),
        ("option", "speed: fast", "speed: fsat", "`fsat` is not one of `slow`, `fast`"),
        ("compared", "lid == closed", "lid == down", "`down` is not one of `open`, `closed`"),
        ("member", "crate.lid == closed", "crate.lid in [open, up]", "`up` is not one of `open`, `closed`"),
        ("is", "crate.lid == closed", "crate is clsoed", "`crate` has no state `clsoed`"),
    ];
    slips::each(
        "box",
        BOX,
        &slips,
        |found, wanted| matches!(found, [one] if one.strip_prefix("unknown-name: ") == Some(wanted)),
    );
}

#[test]
fn words_of_different_types_are_not_compared() {
    let wrong = BOX.replace("crate.lid == closed", "crate.lid == crate.flap");
    assert!(only("kinds", &wrong).starts_with("type-mismatch: one of `open`, `closed` cannot be compared"));
    let wrong = BOX.replace("crate.lid == closed", "crate.lid == 3");
    assert!(only("number", &wrong).starts_with("type-mismatch"));
    let wrong = BOX.replace("effect lid = position", "effect flap = position");
    assert!(only("effect", &wrong).starts_with("type-mismatch: `value` expects one of `up`, `down`"));
    let wrong = BOX.replace("up | down = up", "open | down = open").replace("crate.lid == closed", "crate is open");
    assert!(only("two", &wrong).starts_with("ambiguous-name"));
    assert!(only("twice", &BOX.replace("up | down", "up | down | up")).starts_with("duplicate-name"));
}

#[test]
fn recordings_show_the_word() {
    let dir = folder("types_recorded");
    write(&dir, "bench.mtx", format!("mtx 1\n{BOX}"));
    let ended = matterixc_in(&dir, &["run", "bench.mtx", "--set", "end=closed", "--csv", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(ended.out.contains("end = closed"), "{}", ended.out);
    let table = std::fs::read_to_string(dir.join("out/states.csv"));
    let table = table.expect("there is a table");
    assert!(table.contains("open") && table.contains("closed"), "{table}");
    let ended = matterixc_in(&dir, &["run", "bench.mtx", "--set", "end=ajar"]);
    assert!(ended.err.contains("`ajar` is not one of `open`, `closed`"), "{}", ended.err);
}

const NOTES: &str = "
use std::glassware::Beaker50mL
use std::heating::IkaRetControl
skill tell(v: Container) on(p: Heater)
    option mode: short | long = short
    fails hot
{
    note \"{v} on {v.support}: {v.contents.temperature as degC :.1}, {mode}, {p is active}, {p.limits}, {{x}}\"
    if mode == long { fail hot \"{v} is too hot for {elapsed as min :.1}\" }
}
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker50mL on plate holding 20 g of water
}
workflow w in bench {
    tell cup on plate
    wait 1 min
    tell cup on plate { mode: long }
}
";

#[test]
fn texts_show_the_values_of_the_moment() {
    let dir = folder("types_texts");
    write(&dir, "bench.mtx", format!("mtx 1\n{NOTES}"));
    let ended = matterixc_in(&dir, &["run", "bench.mtx"]);
    let note = "cup on plate: 22.0 degC, short, false, 0 degC .. 340 degC, {x}";
    assert!(ended.out.contains(note), "{}", ended.out);
    assert!(ended.out.contains("hot: cup is too hot for 1.0 min"), "{}", ended.out);
    let dry = matterixc_in(&dir, &["run", "bench.mtx", "--dry"]);
    assert!(dry.out.contains("cup on plate"), "{}", dry.out);
}

#[test]
fn a_value_in_a_text_is_checked_where_it_stands() {
    let slips = [
        ("member", "{v.support}", "{v.suport}", "unknown-member: `v` (Container) has no `suport`"),
        ("unit", "elapsed as min", "elapsed as mL", "unit-mismatch: Duration (s) cannot be compared with Volume (m^3)"),
        ("empty", "{mode}", "{}", "syntax: expected a value, found `}`"),
        ("two", "{mode}", "{mode v}", "syntax: expected `as`, found `v`"),
        ("open", "{mode}", "{mode", "syntax: expected `(` or `as`, found `,`"),
        ("close", "{mode}", "mode}", "syntax: `}` in a text starts or ends a value"),
        (
            "digits",
            "{mode}",
            "{mode :.1}",
            "type-mismatch: expected a quantity, of which digits can be shown, found a word",
        ),
    ];
    slips::each("text", NOTES, &slips, |found, wanted| found.iter().any(|f| f == wanted));
}

const ROLES: &str = "
use std::glassware::Beaker50mL
use std::heating::IkaRetControl
lab small { ambient: 22 degC, weak = IkaRetControl { limits: 0 degC .. 70 degC } at (0, 0, 0) m }
lab big {
    ambient: 22 degC
    hp1 = IkaRetControl at (0, 0, 0) m
    hp2 = IkaRetControl { limits: 0 degC .. 70 degC } at (1, 0, 0) m
}
workflow cook(plate: Heater & Surface where plate.limits.max >= 80 degC) in any lab {
    heat plate to 60 degC
    stop heating plate
}
";

#[test]
fn the_only_instance_that_fits_takes_a_role() {
    assert_eq!(findings("roles", ROLES), [] as [&str; 0]);
    let dir = folder("types_roles");
    write(&dir, "bench.mtx", format!("mtx 1\n{ROLES}"));
    let run = |args: &[&str]| matterixc_in(&dir, &[&["run", "bench.mtx"], args].concat());
    let ended = run(&[]);
    assert!(
        ended.out.contains("cook in big: passed") && ended.out.contains("plate = hp1"),
        "{}{}",
        ended.out,
        ended.err
    );
    assert!(run(&["--set", "plate=hp2"]).err.contains("`hp2` cannot be `plate`"));
    assert!(run(&["--set", "plate=hp3"]).err.contains("no lab of this file can run `cook`"));
    assert!(run(&["--lab", "small"]).err.contains("no thing in `small` can be `plate`"));
    assert!(run(&["--lab", "bgi"]).err.contains("did you mean `big`?"));
    let both = ROLES.replace(" where plate.limits.max >= 80 degC", "");
    assert_eq!(findings("both", &both), [] as [&str; 0]);
    write(&dir, "bench.mtx", format!("mtx 1\n{both}"));
    let ended = run(&[]);
    assert!(ended.err.contains("`cook` can run in `small` or `big`: choose one"), "{}", ended.err);
    let ended = run(&["--lab", "big"]);
    assert!(ended.err.contains("`plate` could be `hp1` or `hp2`: choose one"), "{}", ended.err);
    assert_eq!(run(&["--lab", "big", "--set", "plate=hp2"]).code, 0);
    let nowhere = ROLES.replace(">= 80 degC", ">= 800 degC");
    assert_eq!(only("nowhere", &nowhere), "unbound-role: no lab of this file can run `cook`");
    let state = ROLES.replace("plate.limits.max >= 80 degC", "plate is active").replace("in any lab", "in big");
    assert!(
        findings("state", &state)
            .iter()
            .any(|f| f.ends_with(": `where` is decided before the run and cannot depend on it"))
    );
    let elsewhere = "fn f(p: Heater where p.gain > 3 W/K) -> Power = p.power\n";
    assert!(only("where", elsewhere).starts_with("misplaced: `where` is only for parameters"));
}

#[test]
fn where_of_a_skill_is_a_need() {
    let text = "
use std::heating::IkaRetControl
lab bench { ambient: 22 degC, hp = IkaRetControl { limits: 0 degC .. 70 degC } at (0, 0, 0) m }
skill bake on(p: Heater where p.limits.max >= 80 degC) { heat p to 60 degC; stop heating p }
workflow w in bench { bake on hp }
";
    let wanted = "need-unmet: `bake on hp` needs `p.limits.max >= 80 degC`, which is false here";
    assert_eq!(only("skill_where", text), wanted);
}

#[test]
fn tests_are_run_and_counted() {
    let dir = folder("types_tests");
    let tests = "
test warm in big { heat hp1 to 40 degC; wait 1 s; expect hp1 is active } finally { stop heating hp1 }
test cold { run cook { plate: hp1 }; expect plate.temperature > 50 degC }
";
    write(&dir, "a.mtx", format!("mtx 1\n{ROLES}{tests}"));
    write(&dir, "b.mtx", format!("mtx 1\n{ROLES}"));
    let ended = matterixc_in(&dir, &["test"]);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(
        ended.out.starts_with("ok      a.mtx:16: warm (1.00 s)\nfailed  a.mtx:17: cold (not run)\n"),
        "{}",
        ended.out
    );
    assert!(ended.out.contains("`plate.temperature > 50 degC` is false"), "{}", ended.out);
    assert!(ended.out.ends_with("1 passed, 1 failed in 1 file\n"), "{}", ended.out);
    let ended = matterixc_in(&dir, &["test", "a.mtx", "--only", "warm", "--format", "json"]);
    let lines = ended.out_lines();
    assert_eq!((ended.code, lines.len()), (0, 2));
    assert_eq!((lines[0]["test"].as_str(), lines[0]["passed"].as_bool()), (Some("warm"), Some(true)));
    assert_eq!(lines[1], serde_json::json!({ "passed": 1, "failed": 0, "files": 1 }));
    let ended = matterixc_in(&dir, &["test", "b.mtx"]);
    assert_eq!((ended.code, ended.out.as_str()), (0, "no tests in 1 file\n"));
    assert_eq!(matterixc_in(&dir, &["test", "c.mtx"]).code, 2);
    write(&dir, "b.mtx", "mtx 1\ntest broken in nowhere { expect }\n");
    let ended = matterixc_in(&dir, &["test", "b.mtx"]);
    assert!(ended.code == 1 && ended.out.contains("0 passed, 1 failed"), "{}", ended.out);
}

#[test]
fn a_test_is_checked_with_its_file() {
    for (name, test, wanted) in [
        ("nothing", "test t { }", "misplaced: the test `t` has no steps"),
        ("steps", "test t { wait 1 s }", "misplaced: a test must start with the workflow that it runs"),
        ("after", "test t { run cook; wait 1 s }", "misplaced: after the run of its workflow a test can only `expect`"),
        ("workflow", "test t { run cok }", "unknown-name: unknown workflow `cok`"),
        ("parameter", "test t { run cook { plaet: hp1 } }", "unknown-parameter: `cook` has no parameter `plaet`"),
        ("lab", "test t in bgi { wait 1 s }", "unknown-name: unknown lab `bgi`"),
        ("run", "test t in big { run cook }", "misplaced: `run` must be the first statement of a test"),
        (
            "expect",
            "test t { run cook; expect plate is activ }",
            "unknown-member: `hp1` (IkaRetControl) has no `activ`",
        ),
    ] {
        assert_eq!(only(&format!("test_{name}"), &format!("{ROLES}{test}\n")), wanted, "{name}");
    }
}

const LABS: &str = "
use std::glassware::Beaker50mL
lab station(offset: Length = 0 mm) {
    ambient: 22 degC
    table = OpticalTable at (offset, 0 m, 0 m)
    cup = Beaker50mL on table holding 10 g of water
    between table and cup { sliding: 0.4 }
}
lab pair { include station as near; include station as far at (0, 2, 0) m { offset: 5 mm } }
lab full { include pair as left at (1, 0, 0) m; include station as right; spare = Beaker50mL on left.far.table }
workflow w in full { wait 1 s; expect left.far.cup.contents.mass > 9 g }
";

#[test]
fn labs_hold_other_labs() {
    assert_eq!(findings("labs", LABS), [] as [&str; 0]);
    let dir = folder("types_labs");
    write(&dir, "bench.mtx", format!("mtx 1\n{LABS}"));
    let ended = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(ended.out.contains("left.far.cup.contents: mass 10 g"), "{}", ended.out);
    let slips = [
        ("unit", "{ offset: 5 mm }", "{ offset: 5 g }", "unit-mismatch: `offset` expects Length (m), found Mass (kg)"),
        (
            "option",
            "{ offset: 5 mm }",
            "{ ofset: 5 mm }",
            "unknown-parameter: the included lab has no parameter `ofset`",
        ),
        ("member", "left.far.table", "left.far.tabel", "unknown-member: `left.far` has no `tabel`"),
        ("lab", "include pair", "include piar", "unknown-name: unknown lab `piar`"),
        ("twice", "station as right", "station as left", "duplicate-name: `left` is declared twice"),
        ("ring", "station as near", "full as near", "circular: `full` includes itself"),
        ("default", " = 0 mm", "", "missing-field: `offset` has no value"),
    ];
    slips::each("labs", LABS, &slips, slips::all);
}

#[test]
fn settings_of_included_labs_agree_or_are_decided() {
    let other = "lab warm { ambient: 30 degC, table = OpticalTable at (0, 0, 0) m }\n";
    let both = LABS.replace("lab full { ", "lab full { include warm as hot; ") + other;
    let wanted = "ambiguous-name: `ambient` is 30 degC in one included lab and 22 degC in another";
    assert_eq!(only("settings", &both), wanted);
    assert_eq!(findings("decided", &both.replace("lab full { ", "lab full { ambient: 25 degC; ")), [] as [&str; 0]);
}

#[test]
fn the_reference_protocols_pass_their_tests() {
    let dir = folder("types_protocols");
    let spec = |name: &str| std::fs::read_to_string(root().join("tests/spec").join(name)).expect("it can be read");
    write(&dir, "two_arms.mtx", spec("two_arms.mtx"));
    write(&dir, "study_fit.mtx", spec("study_fit.mtx"));
    write(&dir, "sn1.mtx", std::fs::read_to_string(root().join("examples/sn1.mtx")).expect("it can be read"));
    let ended = matterixc_in(&dir, &["check", "two_arms.mtx"]);
    // Behind `lost` nobody knows what the robot's hand still holds.
    assert!(ended.code == 0 && ended.out.ends_with("1 warning\n"), "{}", ended.out);
    assert!(
        ended.out.starts_with("warning[unfinished]: `kmr` may be left holding when `two_samples` ends"),
        "{}",
        ended.out
    );
    let ended = matterixc_in(&dir, &["test"]);
    assert!(ended.code == 0 && ended.out.ends_with("2 passed, 0 failed in 2 files\n"), "{}", ended.out);
}
