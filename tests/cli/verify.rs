//! Recordings of robots judged apart from their planner.

use crate::harness::{folder, matterixc, matterixc_in, root, write};

/// Runs a file at motion fidelity and judges the recording; the verdict.
fn verdict(file: &str, name: &str) -> (i32, String) {
    let dir = folder(&format!("verify_{name}"));
    let out = dir.to_str().expect("text");
    // Whether its expectations hold is not asked here.
    matterixc_in(root(), &["run", file, "--fidelity", "motion", "--out", out]);
    let judged = matterixc(&["verify", out]);
    (judged.code, judged.out)
}

#[test]
fn examples_with_arms_run_into_nothing_and_keep_all_limits() {
    for name in ["heat_network", "redox", "sn1", "titration"] {
        let (code, out) = verdict(&format!("examples/{name}.mtx"), name);
        assert_eq!(code, 0, "{name}: {out}");
        assert!(out.contains("nothing wrong") && out.contains("panda: moved"), "{name}: {out}");
    }
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
