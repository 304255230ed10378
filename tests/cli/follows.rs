//! One mistake, one message: all findings of a file, not only its first.

use crate::harness::matterixc;

/// Code and line of each finding of a file.
fn findings(file: &str) -> Vec<(String, u64)> {
    let lines = matterixc(&["check", "--format", "json", file]).out_lines();
    let one = |line: &serde_json::Value| {
        let code = line["code"].as_str().unwrap_or_default().to_owned();
        (code, line["span"]["start"]["line"].as_u64().unwrap_or_default())
    };
    lines.iter().map(one).collect()
}

#[test]
fn what_a_refused_step_would_have_changed_is_unknown() {
    assert_eq!(findings("tests/faults/650_refused_transfer.mtx"), [("no-mix-volume".to_owned(), 11)]);
    let own = findings("tests/faults/651_refused_skill.mtx");
    let wanted = [("need-unmet", 32), ("need-unmet", 39), ("expectation-failed", 42)];
    assert_eq!(own, wanted.map(|(code, line)| (code.to_owned(), line)));
    let kept = findings("tests/faults/655_keep_that_does_not_hold.mtx");
    assert_eq!(kept, [("expectation-failed".to_owned(), 14), ("need-unmet".to_owned(), 16)]);
    // What would divide by zero, never end or fail does not begin.
    let endless = findings("tests/faults/657_refused_without_end.mtx");
    let wanted = [("need-unmet", 24), ("need-unmet", 25), ("need-unmet", 26), ("expectation-failed", 28)];
    assert_eq!(endless, wanted.map(|(code, line)| (code.to_owned(), line)));
}

#[test]
fn what_ways_have_together_is_not_taken_apart() {
    for name in [
        "257_syringe_refilled_when_empty",
        "258_own_counter_by_weight",
        "259_own_counter_by_count",
        "260_syringe_of_two_branches",
    ] {
        assert!(findings(&format!("tests/faults/clean/{name}.mtx")).is_empty(), "{name}");
    }
    // The condition asks for two where three are given.
    assert_eq!(findings("tests/faults/654_own_counter_runs_out.mtx"), [("need-unmet".to_owned(), 27)]);
    // Only the ways that a step does not refuse go on behind it.
    assert_eq!(findings("tests/faults/658_rack_runs_out_on_some_ways.mtx"), [("need-unmet".to_owned(), 25)]);
}

#[test]
fn a_deadlock_names_the_calls_that_hand_on_devices() {
    for (name, lines) in [("652_calls_in_a_circle", vec![16, 17, 18]), ("653_skills_in_a_circle", vec![21, 22])] {
        let told = matterixc(&["check", &format!("tests/faults/{name}.mtx")]);
        assert!(told.code == 1 && told.out.contains("error[deadlock]"), "{}", told.out);
        // Each call says what it holds and what it waits for.
        let said: Vec<&str> =
            told.out.lines().filter(|l| l.contains("── holds `") && l.contains("and waits for")).collect();
        assert_eq!(said.len(), lines.len(), "{}", told.out);
        for line in lines {
            assert!(told.out.lines().any(|l| l.trim_start().starts_with(&format!("{line} │"))), "{}", told.out);
        }
    }
}
