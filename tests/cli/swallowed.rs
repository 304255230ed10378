//! Steps that fail for certain below a handler for all failures: the run goes on, and `check` says that the step never succeeds.

use serde_json::Value;

use crate::harness::{folder, matterixc, write};

const LAB: &str = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker250mL on plate holding 100 g of water
}
";

/// Findings of steps in that lab: severity and code, their labels and help.
fn found(name: &str, items: &str, steps: &str) -> Vec<(String, String)> {
    let text = format!(
        "{LAB}{items}workflow w in bench {{\n{steps}\n}} finally {{ stop heating plate; stop stirring plate }}\n"
    );
    let file = write(&folder(&format!("swallowed_{name}")), "w.mtx", text);
    let said = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    let all = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let each = |d: Value| {
        let labels = all(&d["labels"]).iter().map(|l| said(&l["text"])).collect::<Vec<_>>().join("; ");
        let help = all(&d["help"]).iter().map(said).collect::<Vec<_>>().join("; ");
        (format!("{} {}", said(&d["severity"]), said(&d["code"])), format!("{labels}; {help}"))
    };
    matterixc(&["check", "--format", "json", &file]).out_lines().into_iter().map(each).collect()
}

#[track_caller]
fn is(name: &str, items: &str, steps: &str, wanted: &[&str]) {
    let found = found(name, items, steps);
    let kinds: Vec<&str> = found.iter().map(|f| f.0.as_str()).collect();
    assert_eq!(kinds, wanted, "{name}: {found:#?}");
}

#[test]
fn a_step_that_never_succeeds_is_found_below_a_handler_for_all_failures() {
    let steps = "sequence { heat plate to 500 degC } on failure { note \"never mind\" }";
    let found = found("need", "", steps);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].0, "warning out-of-range");
    for part in ["`on failure` takes this failure each time: the step never succeeds", "name it: `on out_of_range { }`"]
    {
        assert!(found[0].1.contains(part), "{part}: {found:#?}");
    }
    // Waits, loops and what only the first of several steps lacks.
    let wait =
        "heat plate to 40 degC\nwait until plate.temperature >= 60 degC timeout 1 h on failure { note \"cold\" }";
    is("wait", "", wait, &["warning not-reached"]);
    let hold = "sequence { repeat while plate.temperature < 600 degC max 3 { wait 1 s } } on failure { note \"cold\" }";
    is("loop", "", hold, &["warning not-reached"]);
    let second = "sequence { heat plate to 40 degC; stir plate at 9000 rpm; wait 1 s } on failure { note \"slow\" }";
    is("second", "", second, &["warning out-of-range"]);
    let tried = "try { heat plate to 500 degC } else { heat plate to 60 degC }";
    is("try", "", tried, &["warning out-of-range"]);
}

#[test]
fn a_handler_that_fails_in_turn_handles_nothing() {
    let steps = "sequence { heat plate to 500 degC } on failure { fail broken_plan \"call somebody\" }";
    is("rethrown", "", steps, &["error out-of-range"]);
    let outer = format!("sequence {{ {steps} }} on broken_plan {{ note \"so be it\" }}");
    is("rethrown_taken", "", &outer, &["warning out-of-range"]);
}

#[test]
fn a_failure_that_is_named_is_meant() {
    is("named", "", "sequence { heat plate to 500 degC } on out_of_range { note \"as expected\" }", &[]);
    let first =
        "sequence { heat plate to 500 degC } on out_of_range { note \"as expected\" } on failure { note \"?\" }";
    is("named_first", "", first, &[]);
    let inner =
        "sequence { sequence { heat plate to 500 degC } on out_of_range { note \"x\" } } on failure { note \"y\" }";
    is("named_inside", "", inner, &[]);
}

#[test]
fn a_step_that_succeeds_in_another_turn_is_no_mistake() {
    let turns = "for t in [40 degC, 500 degC] { sequence { heat plate to t } on failure { note \"too hot\" } }";
    is("turns", "", turns, &[]);
    let skill = "skill warm(t: Temperature) on(p: IkaRetControl) {\n    sequence { heat p to t } on failure { note \"too hot\" }\n}\n";
    is("called_twice", skill, "warm 40 degC on plate\nwarm 500 degC on plate", &[]);
    is("called_once", skill, "warm 500 degC on plate", &["warning out-of-range"]);
    let again = "sequence { wait until plate.temperature >= 59 degC timeout 10 s } on failure { heat plate to 60 degC; retry 30 }";
    is("again", "", again, &[]);
    is("fine", "", "sequence { heat plate to 40 degC; wait 1 s } on failure { note \"?\" }", &[]);
}

#[test]
fn a_wait_without_a_limit_raises_nothing_for_a_handler() {
    let steps =
        "heat plate to 40 degC\nsequence { wait until plate.temperature >= 60 degC } on failure { note \"cold\" }";
    is("endless", "", steps, &["error not-reached"]);
}
