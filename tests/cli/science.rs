//! Published and closed cases, from text to report.

use serde_json::Value;

use crate::harness::{matterixc, root};

fn path(relative: &str) -> String {
    root().join(relative).to_str().expect("the path is text").to_string()
}

/// The report of a run that passes.
fn report(file: &str, more: &[&str]) -> Value {
    let file = path(file);
    let args = [&["run", &file, "--format", "json"], more].concat();
    let ran = matterixc(&args);
    assert_eq!(ran.code, 0, "{file} {more:?}: {}{}", ran.out, ran.err);
    serde_json::from_str(&ran.out).expect("a report")
}

/// When a process began and ended for the first time.
fn interval(report: &Value, process: &str) -> (f64, f64) {
    let all = report["processes"].as_array().expect("processes");
    let found = all.iter().find(|p| p["name"] == process).unwrap_or_else(|| panic!("no {process}"));
    let at = |i: usize| found["intervals"][0][i].as_f64().expect("a time");
    (at(0), at(1))
}

/// The value an expectation measured.
fn measured(report: &Value, text: &str) -> f64 {
    let all = report["expectations"].as_array().expect("expectations");
    let found = all.iter().find(|e| e["text"].as_str().is_some_and(|t| t.starts_with(text)));
    found.and_then(|e| e["measured"][0]["value"].as_f64()).unwrap_or_else(|| panic!("no {text}"))
}

fn close(value: f64, wanted: f64, bar: f64) {
    assert!((value - wanted).abs() <= bar, "{value} is not within {bar} of {wanted}");
}

const REACTION: &str = "mass_action(beaker.contents, ethyl_iodide)";

#[test]
fn sn1_gives_the_published_times_temperature_and_yield() {
    let report = report("examples/sn1.mtx", &[]);
    let (began, ended) = interval(&report, REACTION);
    close(began, 11.4, 0.1);
    close(ended, 1639.9, 1.5);
    close(measured(&report, "beaker.contents.temperature"), 26.65, 0.03);
    close(measured(&report, "beaker.contents[EtI]"), 0.91, 0.01);
    close(interval(&report, "conduction(hotplate, beaker)").0, 8.0, 1e-9);
    close(interval(&report, "heating(hotplate)").1, 1010.6, 1e-9);
}

#[test]
fn sn1_of_the_earlier_version_gives_its_times_and_yield() {
    let report = report("examples/sn1_earlier.mtx", &[]);
    let (began, ended) = interval(&report, REACTION);
    close(began, 17.8, 0.1);
    close(ended, 1281.6, 1.5);
    close(measured(&report, "beaker.contents.temperature"), 26.6, 0.05);
    close(measured(&report, "beaker.contents[EtI]"), 1.08, 0.01);
}

#[test]
fn sn1_at_40_degc_stays_near_35_degc_and_yields_less() {
    let report = report("examples/sn1_mild.mtx", &[]);
    close(measured(&report, "beaker.contents.temperature"), 35.0, 0.3);
    assert!(measured(&report, "beaker.contents[EtI]") < 0.7);
}

#[test]
fn a_parameter_given_on_the_command_line_is_used_in_its_own_unit() {
    let file = path("examples/sn1.mtx");
    let ran = matterixc(&["run", &file, "--format", "json", "--set", "target=104 degF"]);
    assert_eq!(ran.code, 1, "the yield is lower: {}", ran.err);
    let report: Value = serde_json::from_str(&ran.out).expect("a report");
    assert!(measured(&report, "beaker.contents[EtI]") < 0.7);
}

#[test]
fn every_case_with_a_closed_solution_agrees() {
    let cases: &[(&str, &[&str])] = &[
        ("kinetics", &["first_order", "second_order_unequal", "second_order_equal", "third_order"]),
        ("heat", &["newton_cooling", "steady_state", "equilibration", "quiet_wait", "fast_node"]),
        ("redox_ends", &["darkens", "fades"]),
    ];
    for (file, workflows) in cases {
        for workflow in *workflows {
            let report = report(&format!("tests/cases/{file}.mtx"), &["--workflow", workflow]);
            for balance in report["ledger"].as_array().expect("a ledger") {
                let error = balance["relative_error"].as_f64().expect("an error");
                assert!(error <= 1e-9, "{file} {workflow}: {balance}");
            }
        }
    }
}

#[test]
fn the_readmes_picture_is_that_of_its_example() {
    let dir = crate::harness::folder("picture");
    let ran = crate::harness::matterixc_in(root(), &["run", "examples/sn1.mtx", "--out", dir.to_str().expect("text")]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let drawn = std::fs::read_to_string(dir.join("plot.svg")).expect("a picture");
    let shown = std::fs::read_to_string(path("docs/sn1.svg")).expect("the picture");
    assert!(
        drawn == shown,
        "draw it again: `matterixc run examples/sn1.mtx --out out`, then out/plot.svg to docs/sn1.svg"
    );
}

#[test]
fn the_papers_redox_text_yields_its_two_slips_and_nothing_else() {
    let checked = matterixc(&["check", &path("tests/cases/redox_literal.mtx"), "--format", "concise"]);
    assert_eq!(checked.code, 1);
    let lines: Vec<&str> = checked.out.lines().collect();
    assert_eq!(lines.len(), 3, "{}", checked.out);
    assert!(lines[0].contains(":11:") && lines[0].contains("error[label-mismatch]"), "{}", lines[0]);
    assert!(lines[0].contains("990.58 times too low"), "{}", lines[0]);
    assert!(lines[1].contains(":13:") && lines[1].contains("error[reaction-never-starts]"), "{}", lines[1]);
    assert!(lines[1].contains("no `H+` anywhere"), "{}", lines[1]);
}
