//! Parts of things that move with their states, arms that move them, and robots that drive.

use crate::harness::{folder, matterixc, matterixc_in, root, write};

#[test]
fn examples_of_handles_and_of_driving_pass_at_both_fidelities() {
    for name in ["faucet", "fume_hood", "glove_box", "kuka_transport"] {
        let file = format!("examples/{name}.mtx");
        for fidelity in ["process", "motion"] {
            let dir = folder(&format!("joints_{name}_{fidelity}"));
            let out = dir.to_str().expect("text");
            let ended = matterixc(&["run", &file, "--fidelity", fidelity, "--out", out]);
            assert_eq!(ended.code, 0, "{name}: {}{}", ended.out, ended.err);
        }
    }
}

#[test]
fn what_is_moved_by_hand_and_where_a_base_drives_is_looked_at_beforehand() {
    for name in ["faucet", "fume_hood", "glove_box", "kuka_transport"] {
        let ended = matterixc(&["check", &format!("examples/{name}.mtx"), "--fidelity", "motion"]);
        assert!(ended.code == 0 && ended.out.contains("no findings"), "{name}: {}", ended.out);
    }
}

#[test]
fn a_sash_too_far_away_is_out_of_reach_before_the_run() {
    let dir = folder("joints_far");
    let text = std::fs::read_to_string("examples/fume_hood.mtx").expect("the example");
    write(&dir, "far.mtx", text.replace("(0, 460) mm", "(0, 700) mm"));
    let found = matterixc_in(&dir, &["check", "far.mtx", "--fidelity", "motion", "--format", "concise"]);
    assert_eq!(found.code, 1);
    assert!(found.out.contains("far.mtx:17:5: error[out-of-reach]"), "{}", found.out);
}

#[test]
fn a_part_that_a_process_turns_stops_the_run_where_it_runs_into_something() {
    let dir = folder("joints_turning");
    let text = "mtx 1\nuse std::furniture::OpticalTable\nuse std::robots::{FrankaHand, FrankaPanda}\n\
                asset Post: Body { mass: 5 kg, shape: box(40 mm, 40 mm, 200 mm) }\n\
                capability Turning: Body {\n    state angle: Angle = 0 deg { unit: \"deg\" }\n    \
                process turning while angle < 170 deg { angle' += 20 deg/s }\n}\n\
                asset Disc: Turning {\n    mass: 2 kg\n    joint plate turns (0, 0, 1) at (0, 0, 60) mm by angle\n    \
                solid box(300 mm, 40 mm, 20 mm) at (150, 0, 0) mm from plate\n}\n\
                lab l {\n    ambient: 22 degC\n    table = OpticalTable at (0, 0, 0) m\n    \
                arm = FrankaPanda { gripper: FrankaHand {} } on table at (-500, 0) mm\n    \
                disc = Disc on table at (200, 0) mm\n    post = Post on table at (200, 200) mm\n}\n\
                workflow w in l {\n    wait 20 s\n}\n";
    write(&dir, "disc.mtx", text);
    let ended = matterixc_in(&dir, &["run", "disc.mtx", "--fidelity", "motion"]);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("`plate` of `disc` collides with `post`"), "{}", ended.err);
    write(&dir, "disc.mtx", text.replace("(200, 200) mm", "(200, 400) mm"));
    let ended = matterixc_in(&dir, &["run", "disc.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    // It is recorded as it turns, at its speed.
    let turned = joint(&dir.join("out/recording.mcap"), "disc.plate");
    let speed = 20_f64.to_radians();
    let during = turned.iter().filter(|(time, ..)| (0.5..8.0).contains(time)).collect::<Vec<_>>();
    assert!(during.len() > 50, "{}", during.len());
    assert!(
        during.iter().all(|(time, at, v)| (at - speed * time).abs() < 1e-3 && (v - speed).abs() < 1e-3),
        "{during:?}"
    );
    let verdict = matterixc_in(&dir, &["verify", "out"]);
    assert!(verdict.code == 0, "{}", verdict.out);
}

/// Time, position and speed of a joint as recorded.
fn joint(file: &std::path::Path, name: &str) -> Vec<(f64, f64, f64)> {
    let recording = matterix_recording::read(&std::fs::read(file).expect("a recording")).expect("it can be read");
    let topic = recording.topics.iter().find(|topic| topic.name == "/joints").expect("joints");
    let states = topic.messages.iter().flat_map(|(time, message)| {
        let all = matterix_recording::list(message, "joints").iter();
        all.filter(|j| matterix_recording::text(j, "name") == name)
            .map(|j| (*time, matterix_recording::number(j, "position"), matterix_recording::number(j, "velocity")))
    });
    states.collect()
}

#[test]
fn a_part_that_a_hand_leads_or_a_command_moves_is_recorded_as_fast_as_it_goes() {
    for (name, part) in [("faucet", "tap."), ("glove_box", "box."), ("fume_hood", "hood.")] {
        let dir = folder("joints_speeds");
        let file = root().join(format!("examples/{name}.mtx")).display().to_string();
        let run = matterixc_in(&dir, &["run", &file, "--fidelity", "motion", "--out", name]);
        assert_eq!(run.code, 0, "{}{}", run.out, run.err);
        let recording = dir.join(name).join("recording.mcap");
        let names = std::fs::read(&recording).expect("a recording");
        let recorded = matterix_recording::read(&names).expect("it can be read");
        let topic = recorded.topics.iter().find(|topic| topic.name == "/joints").expect("joints");
        let own = topic.messages.iter().flat_map(|(_, message)| matterix_recording::list(message, "joints"));
        let mut parts: Vec<&str> =
            own.map(|j| matterix_recording::text(j, "name")).filter(|n| n.starts_with(part)).collect();
        parts.sort_unstable();
        parts.dedup();
        let mut moved = 0;
        for part in parts {
            for pair in joint(&recording, part).windows(2) {
                let ((t, a, v), (u, b, w)) = (pair[0], pair[1]);
                // Between two samples of a motion the mean of both speeds leads nearly there.
                if u - t > 1e-6 && u - t < 0.05 && (b - a).abs() > 1e-3 {
                    moved += 1;
                    assert!(
                        (b - a - 0.5 * (v + w) * (u - t)).abs() < 0.1 * (b - a).abs() + 1e-3,
                        "{part} at {t}: {pair:?}"
                    );
                }
            }
        }
        assert!(moved > 5, "{name}: {moved}");
        let verdict = matterixc_in(&dir, &["verify", name]);
        assert!(verdict.code == 0, "{}", verdict.out);
    }
}

#[test]
fn mistakes_in_joints_are_reported_where_they_are() {
    let dir = folder("joints_mistakes");
    let text = "mtx 1\nasset Box: HandledLid {\n    mass: 1 kg\n    \
                joint lid turns (0, 0, 0) by choose(lid == open, 90 deg, 0 deg)\n    \
                frame handle at (0, 0, 10) mm\n}\n\
                asset Other: HandledLid {\n    mass: 1 kg\n    \
                joint lid turns (1, 0, 0) by 3 mm\n    joint lid slides (1, 0, 0) by 3 mm\n    \
                joint cover turns (0, 1, 0) at (0, 0, 1) mm from top_lid by 0 deg\n    frame handle at (0, 0, 10) mm from lid\n}\n\
                asset Arm6: Body from urdf \"ur3e.urdf\" { mass: 1 kg, joint elbow by 10 deg }\n\
                lab l {\n    ambient: 22 degC\n    box = Plain at (0, 0, 0) m\n    arm = UR3e at (1, 0, 0) m\n}\n\
                asset Plain: HandledLid { mass: 1 kg, frame handle at (0, 0, 10) mm }\nuse std::robots::UR3e\n\
                workflow w in l { open box by arm }\n";
    write(&dir, "box.mtx", text);
    let ended = matterixc_in(&dir, &["check", "box.mtx", "--format", "concise"]);
    let found: Vec<&str> = ended.out.lines().filter_map(|l| l.split_once("box.mtx:")).map(|(_, l)| l).collect();
    let expected = [
        "4:21: error[out-of-range]",
        "10:11: error[duplicate-name]",
        "11:54: error[unknown-name]",
        "14:60: error[unknown-name]",
        "22:19: error[type-mismatch]",
    ];
    assert_eq!(found.len(), expected.len(), "{}", ended.out);
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} is not {expected}");
    }
}

#[test]
fn a_pipette_takes_the_time_its_gantry_needs() {
    let dir = folder("joints_gantry");
    let text = "mtx 1\nuse std::opentrons::{Corning96, OT2, P300Single, TipRack300}\n\
                lab deck {\n    ambient: 22 degC\n    ot2 = OT2 { left: P300Single } at (0, 0, 0) m\n    \
                tips = TipRack300 on ot2.slot[1]\n    plate = Corning96 on ot2.slot[SLOT] holding { A1: 200 uL of water }\n}\n\
                workflow take in deck {\n    pick up tip from tips by ot2.left\n    \
                aspirate 92.86 uL from plate[A1] by ot2.left\n    dispense 92.86 uL into plate[A2] by ot2.left\n    \
                return tip to tips[A1] by ot2.left\n}\n";
    let lasts = |slot: &str, fidelity: &str| -> f64 {
        let name = format!("slot{slot}.mtx");
        write(&dir, &name, text.replace("SLOT", slot));
        let ended = matterixc_in(&dir, &["run", &name, "--fidelity", fidelity]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        let (_, after) = ended.out.split_once("passed after ").expect("a passed run");
        after.split(' ').next().and_then(|s| s.parse().ok()).expect("a time")
    };
    assert_eq!(lasts("2", "process"), lasts("11", "process"));
    let (near, far) = (lasts("2", "motion"), lasts("11", "motion"));
    // Three slots further along y, twice there and back: at 400 mm/s some 0.65 s each way.
    assert!(far - near > 0.5 && far - near < 4.0, "{near} s, {far} s");
}
