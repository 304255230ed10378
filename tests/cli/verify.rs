//! Recordings of robots judged apart from their planner.

use crate::harness::{folder, matterixc, matterixc_in, root, write};

/// Longest time for running and judging one example, s: what takes longer is no use as a check.
const LONGEST: f64 = 180.0;

/// Examples whose expectations are of times that the process alone takes; with motions the recording is judged all the same.
const OTHER_TIMES: [&str; 4] = ["sn1", "sn1_earlier", "sn1_mild", "titration"];

/// Runs examples and judges what their robots did.
#[expect(clippy::disallowed_methods, reason = "how long it takes is part of what is asked")]
fn run_into_nothing(names: &[&str]) {
    for name in names {
        let start = std::time::Instant::now();
        let stem = name.rsplit('/').next().unwrap_or(name);
        let dir = folder(&format!("verify_{stem}"));
        let out = dir.to_str().expect("text");
        let file = format!("examples/{name}.mtx");
        let ended = matterixc_in(root(), &["run", &file, "--fidelity", "motion", "--out", out]);
        let expected = if OTHER_TIMES.contains(name) { ended.err.contains("elapsed") } else { ended.code == 0 };
        assert!(expected && !ended.err.contains("error[run-failed]"), "{name}: {}", ended.err);
        let judged = matterixc(&["verify", out]);
        assert!(judged.code == 0 && judged.out.contains("nothing wrong"), "{name}: {}", judged.out);
        assert!(judged.out.contains(": moved "), "{name}: {}", judged.out);
        let took = start.elapsed().as_secs_f64();
        assert!(took < LONGEST, "{name} took {took:.0} s");
    }
}

#[test]
fn every_example_with_a_robot_is_judged() {
    let here = |folder: &str| -> Vec<String> {
        let names = crate::harness::names(&root().join(folder));
        let text = |n: &String| std::fs::read_to_string(root().join(folder).join(n)).expect("text");
        let robot =
            |n: &String| n.ends_with(".mtx") && ["std::robots", "OT2", "use sn1"].iter().any(|w| text(n).contains(w));
        names.into_iter().filter(robot).map(|n| n.trim_end_matches(".mtx").to_string()).collect()
    };
    let mut all = here("examples");
    all.extend(here("examples/environments").into_iter().map(|n| format!("environments/{n}")));
    let judged = [&WITH_ARMS[..], &WITH_GANTRIES[..], &ENVIRONMENTS[..]].concat();
    all.sort();
    let mut known: Vec<String> = judged.into_iter().map(str::to_string).collect();
    known.sort();
    assert_eq!(all, known, "examples with robots that are not judged, or are none");
}

const WITH_ARMS: [&str; 13] = [
    "faucet",
    "fume_hood",
    "glove_box",
    "handover",
    "heat_network",
    "kuka_transport",
    "redox",
    "sn1",
    "sn1_earlier",
    "sn1_mild",
    "study_fit",
    "titration",
    "two_plates",
];
const WITH_GANTRIES: [&str; 4] = ["centrifuge", "dilution", "distribution", "full_lab"];
const ENVIRONMENTS: [&str; 8] = [
    "environments/beaker_into_ot2",
    "environments/beaker_on_scale",
    "environments/funnel",
    "environments/liquid_dispensing",
    "environments/plate_into_ot2",
    "environments/pour",
    "environments/vial_insertion",
    "environments/vial_rack",
];

#[test]
fn examples_with_arms_run_into_nothing_and_keep_all_limits() {
    run_into_nothing(&WITH_ARMS);
}

#[test]
fn examples_with_gantries_run_into_nothing_and_keep_all_limits() {
    run_into_nothing(&WITH_GANTRIES);
}

#[test]
fn environments_run_into_nothing_and_keep_all_limits() {
    run_into_nothing(&ENVIRONMENTS);
}

#[test]
fn a_verdict_is_also_json() {
    let dir = folder("verify_json");
    let out = dir.to_str().expect("text");
    matterixc_in(root(), &["run", "examples/heat_network.mtx", "--fidelity", "motion", "--out", out]);
    let judged = matterixc(&["verify", out, "--format", "json"]);
    let verdict: serde_json::Value = serde_json::from_str(&judged.out).expect("JSON");
    assert_eq!(verdict["wrong"], serde_json::json!([]));
    assert!(verdict["looked"][0]["configurations"].as_u64().expect("a number") > 500, "{}", judged.out);
}

#[test]
fn what_is_no_recording_is_said() {
    let dir = folder("verify_none");
    write(&dir, "recording.mcap", "hello");
    let judged = matterixc_in(&dir, &["verify", "."]);
    assert_eq!(judged.code, 2);
    assert!(judged.err.contains("this is not an MCAP file"), "{}", judged.err);
}
