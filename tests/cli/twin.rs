//! What the twin says is what a law says: fast laws, laws that run out, values that steps are given, strokes of what reacts.

use std::collections::BTreeMap;

use crate::harness::{folder, matterixc, pass_cases, root, run_case};

#[test]
fn fast_chemistry_comes_to_its_end() {
    pass_cases("fast.mtx", &["fades", "dissociates"]);
    pass_cases("neutralisation.mtx", &["neutralises", "keeps_the_excess"]);
}

#[test]
fn what_runs_out_runs_out_at_its_time() {
    let all = [
        "zero_order",
        "used_up_as_it_comes",
        "shares",
        "half_order",
        "negative_order",
        "with_a_catalyst",
        "there_and_back",
    ];
    pass_cases("runs_out.mtx", &all);
}

#[test]
fn what_flows_through_a_vessel_loses_no_heat() {
    pass_cases("feed_and_drain.mtx", &["feeds_and_drains"]);
}

#[test]
fn what_recurs_what_is_slow_and_what_cools_down_is_followed() {
    pass_cases("slow.mtx", &["counts", "drips", "reacts_at_nanomolar", "cools_down_to_its_set_point"]);
}

#[test]
fn a_reading_is_that_of_the_moment_when_the_step_is_called() {
    let all = [
        "of_a_command",
        "in_a_loop",
        "in_an_effect",
        "of_an_option_and_a_duration",
        "as_it_was_when_called",
        "in_a_skill_and_a_job",
    ];
    pass_cases("arguments.mtx", &all);
}

/// By name, the times at which a value was recorded.
fn recorded(workflow: &str) -> BTreeMap<String, Vec<f64>> {
    let dir = folder(&format!("columns_{workflow}"));
    let file = root().join("tests/cases/columns.mtx");
    let out = dir.to_str().expect("text");
    let ran = matterixc(&["run", file.to_str().expect("text"), "--workflow", workflow, "--csv", "--out", out]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let text = std::fs::read_to_string(dir.join("records.csv")).expect("records");
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let (time, rest) = line.split_once(',').expect("a time");
        let name = rest.split(',').next().expect("a name");
        columns.entry(name.to_owned()).or_default().push(time.parse().expect("a number"));
    }
    columns
}

#[test]
fn every_column_has_a_name_of_its_own() {
    let columns = recorded("columns");
    let names: Vec<&str> = columns.keys().map(String::as_str).collect();
    let wanted = [
        "1 * clock.x",
        "2 * clock.x",
        "a.contents.amount[EtOH]",
        "a.contents.amount[water]",
        "a.contents.temperature",
        "a.contents.volume",
        "b.contents.temperature",
        "b.contents.volume",
        "clock.x",
        "clock.x (2)",
        "clock.x / 2",
    ];
    assert_eq!(names, wanted);
    let seconds: Vec<f64> = (0..=4).map(f64::from).collect();
    for (name, times) in &columns {
        let expected = if name == "clock.x (2)" { vec![0.0, 2.0, 4.0] } else { seconds.clone() };
        assert_eq!(*times, expected, "{name}");
    }
}

#[test]
fn every_sample_that_is_due_is_taken() {
    let times = &recorded("samples")["clock.x"];
    assert_eq!(times.len(), 51);
    assert!((times[50] - 3.5).abs() < 1e-12);
    let late = &recorded("samples_late")["clock.x"];
    assert_eq!(late.len(), 36);
}

#[test]
fn a_stroke_gives_off_what_it_took() {
    let all = [
        "gives_off_what_is_there",
        "mixes_full_tips",
        "gives_off_in_parts",
        "brings_over_in_strokes",
        "pushes_what_was_drawn",
    ];
    pass_cases("strokes.mtx", &all);
    let (code, text) = run_case("strokes.mtx", "asks_for_more_than_was_taken", &[]);
    assert_eq!(code, 1);
    assert!(text.contains("volume_underflow") || text.contains("volume-underflow"), "{text}");
}

#[test]
fn what_rounding_parts_is_one() {
    pass_cases("rounding.mtx", &["cools", "empties"]);
}

#[test]
fn a_limit_that_a_flow_breaks_is_a_failure_at_its_moment() {
    pass_cases("limits.mtx", &["goes_on", "runs_dry", "overloads", "overloads_in_a_job"]);
}

#[test]
fn a_vessel_that_runs_dry_ends_the_run_at_that_moment() {
    let (code, text) = run_case("runs_dry.mtx", "circulate", &[]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("error[transfer-fraction]: `leave(loop)` removes more than `"), "{text}");
    assert!(text.contains("at 11.2702 s"), "{text}");
}

#[test]
fn an_equality_that_is_missed_shows_what_is_there() {
    let (code, text) = run_case("equality.mtx", "w", &[]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("50 degC, off by 5.68434e-14: allow a difference, as in `== 50 degC +- ...`"), "{text}");
    assert!(text.contains("is 50 degC, 5.684e-14 above"), "{text}");
}

#[test]
fn an_argument_known_only_in_the_run_is_shown_as_the_skill_writes_it() {
    let (code, text) = run_case("shown_arguments.mtx", "w", &[]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("turn carousel c to c.full + 1"), "{text}");
    assert!(!text.contains("to n"), "{text}");
}
