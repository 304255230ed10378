//! Robots that move through space: in runs, in recordings, and beforehand.

use crate::harness::{folder, matterixc, matterixc_in, root, write};

/// A Panda, a plate and a beaker at this place, mm.
fn bench(beaker: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::OpticalTable\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n\
         use std::robots::{{FrankaHand, FrankaPanda}}\n\nlab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
         plate = IkaRetControl on table at (450, 200) mm\n    beaker = Beaker250mL on table at {beaker} mm\n}}\n\n\
         workflow carry in bench {{\n    place beaker on plate by panda\n    expect beaker.support == plate\n}}\n"
    )
}

#[test]
fn examples_with_arms_are_within_reach_and_free_of_collisions() {
    for name in ["centrifuge", "heat_network", "redox", "sn1", "titration", "two_plates"] {
        let file = format!("examples/{name}.mtx");
        let ended = matterixc(&["check", &file, "--format", "concise"]);
        assert_eq!(ended.code, 0, "{name}: {}", ended.out);
        assert!(!ended.out.contains("error"), "{name}: {}", ended.out);
    }
}

#[test]
fn examples_end_as_expected_when_their_arms_take_the_time_they_need() {
    for name in ["heat_network", "sn1", "sn1_earlier", "sn1_mild", "titration"] {
        let ended = matterixc(&["run", &format!("examples/{name}.mtx"), "--fidelity", "motion"]);
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
    }
}

#[test]
fn redox_reaches_the_same_ends_with_an_arm_that_moves() {
    let dir = folder("motion_redox");
    let args = ["run", "examples/redox.mtx", "--fidelity", "motion", "--out"];
    let mut recordings = Vec::new();
    for turn in ["first", "second"] {
        let out = dir.join(turn);
        let mut args = args.to_vec();
        args.push(out.to_str().expect("text"));
        let ended = matterixc_in(root(), &args);
        assert_eq!(ended.code, 0, "{}", ended.err);
        recordings.push(std::fs::read(out.join("recording.mcap")).expect("a recording"));
    }
    assert!(recordings[0] == recordings[1], "the same run gives the same bytes");
    let report = std::fs::read_to_string(dir.join("first/report.json")).expect("a report");
    assert!(report.contains("\"fidelity\": \"motion\""), "{report}");
}

#[test]
fn a_thing_is_carried_in_the_time_that_the_joints_need() {
    let dir = folder("motion_carry");
    write(&dir, "near.mtx", bench("(450, -250)"));
    let lasts = |args: &[&str]| -> f64 {
        let ended = matterixc_in(&dir, args);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        let (_, after) = ended.out.split_once("passed after ").expect("a passed run");
        after.split(' ').next().and_then(|s| s.parse().ok()).expect("a time")
    };
    let declared = lasts(&["run", "near.mtx"]);
    let moved = lasts(&["run", "near.mtx", "--fidelity", "motion"]);
    assert_eq!(declared, 6.0);
    assert!((2.0..6.0).contains(&moved), "{moved} s");
}

#[test]
fn what_is_out_of_reach_fails_in_a_run_and_is_found_before_it() {
    let dir = folder("motion_far");
    write(&dir, "far.mtx", bench("(840, -250)"));
    let found = matterixc_in(&dir, &["check", "far.mtx", "--format", "concise"]);
    assert_eq!(found.code, 1);
    assert!(found.out.contains("far.mtx:17:5: error[out-of-reach]"), "{}", found.out);
    assert_eq!(found.out.matches("error[").count(), 1, "{}", found.out);
    let ran = matterixc_in(&dir, &["run", "far.mtx", "--fidelity", "motion"]);
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("cannot reach `beaker`"), "{}{}", ran.out, ran.err);
}

#[test]
fn mistakes_in_geometry_are_reported_where_they_are() {
    let dir = folder("motion_geometry");
    let text = "mtx 1\nasset Hood: Body {\n    mass: 10 kg\n    shape: box(1 m, 1 m)\n    solid sphere(0 mm)\n    \
                solid pyramid(1 m)\n    frame a at (0, 0, 1) mm from b\n    frame b at (0, 0, 1) mm from a\n    \
                frame c at (0, 0, 1) mm from nowhere\n    frame d at (0, 0, 1) mm with rpy(0 deg, 90 deg)\n    \
                frame e at top with rpy(0 deg, 0 deg, 90 deg)\n}\n\
                asset Cut: Body from urdf \"panda.urdf\" { mass: 1 kg, tip: \"panda_link9\" }\n\
                asset Folded: Body from urdf \"panda.urdf\" { mass: 1 kg }\n\
                asset Short: Body from urdf \"ur3e.urdf\" { mass: 1 kg, home: (0, 1) deg }\n";
    write(&dir, "hood.mtx", text);
    let ended = matterixc_in(&dir, &["check", "hood.mtx", "--format", "concise"]);
    let found: Vec<&str> = ended.out.lines().filter_map(|l| l.split_once("hood.mtx:")).map(|(_, l)| l).collect();
    let expected = [
        "4:12: error[wrong-arguments]",
        "5:18: error[out-of-range]",
        "6:11: error[type-mismatch]",
        "7:34: error[circular]",
        "8:34: error[circular]",
        "9:34: error[unknown-name]",
        "10:34: error[type-mismatch]",
        "13:59: error[unknown-name]",
        "14:30: error[missing-field]",
        "15:61: error[wrong-arguments]",
    ];
    assert_eq!(found.len(), expected.len(), "{}", ended.out);
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} is not {expected}");
    }
}
