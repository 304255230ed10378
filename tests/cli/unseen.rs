//! `run --unseen`: things that really stand a little away from where robots take them to be.

use std::path::{Path, PathBuf};

use matterix_ir::Program;
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_runtime::motion::{Perturbation, Stage, Stray, Unseen};

use crate::gripping::{compiled, motions};
use crate::harness::{Ended, flat, folder, matterixc, matterixc_in, root, write};

/// A vial of 17 mm on a table, and a block with a hole of this width.
fn bench(bore: &str, lines: &str) -> String {
    format!(
        "mtx 1\n\nuse std::robots::{{FrankaHand, FrankaPanda}}\nuse std::vials::Vial8mL\n\n\
         asset Place: Hole {{\n    mass: 1 g\n    room: cylinder(bore, depth)\n    frame place at (0, 0, 0) mm\n}}\n\n\
         asset Block: Labware {{\n    mass: 1 kg\n    shape: box(100 mm, 100 mm, 38 mm)\n    \
         places[A1 .. A2] = Place {{ bore: {bore}, depth: 33 mm }} at (0, 0, 5) mm pitch (30, 30) mm\n}}\n\n\
         lab bench {{\n    ambient: 22 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
         vial = Vial8mL on table at (450, 100) mm\n    block = Block on table at (450, -150) mm\n}}\n\n\
         workflow run in bench {{\n    {lines}\n}}\n"
    )
}

/// Writes such a lab; the folder of it.
fn lab(name: &str, bore: &str, lines: &str) -> PathBuf {
    let dir = folder(name);
    write(&dir, "bench.mtx", bench(bore, lines));
    dir
}

fn run(dir: &Path, more: &[&str]) -> Ended {
    let mut all = vec!["run", "bench.mtx", "--fidelity", "motion"];
    all.extend(more);
    matterixc_in(dir, &all)
}

/// How far a pose is from another one as a hand sees it, m.
fn seen(hand: &Pose, a: &Pose, b: &Pose) -> [f64; 3] {
    let (a, b) = (hand.inverse().point(a.position), hand.inverse().point(b.position));
    [0, 1, 2].map(|k| b[k] - a[k])
}

/// How far a thing in hand is off as the hand sees it, m, and how much it is turned, rad.
type Held = ([f64; 3], f64);

/// How far the only thing was off that is picked, as the hand saw it before the fingers closed, and how far and how much turned, m
/// and rad, after; or what ended that.
fn picked(program: &Program, name: &str, by: f64, seed: u64) -> ([f64; 3], Result<Held, Stray>) {
    let mut stage = Stage::new(program).expect("a stage");
    let by = Perturbation { shift: by, turn: 0.02 };
    let mut unseen = Unseen::drawn(program, by, seed).expect("it has room");
    let [panda, thing] = ["panda", name].map(|name| program.scene.find(name).expect("it is there"));
    let all = motions(program);
    let grip = all.iter().position(|(motion, _)| matches!(motion, Motion::Grip { .. })).expect("a grip");
    let mut there = Vec::new();
    for (motion, values) in &all[..=grip] {
        let before = stage.clone();
        let performed = stage.perform(motion, values).expect("a way");
        there.push((before, stage.clone(), motion.clone(), performed));
    }
    let (at_grip, ..) = &there[grip];
    let real = unseen.in_stage(at_grip).pose(thing);
    let off = seen(&stage.tip(panda), &at_grip.pose(thing), &real);
    for (before, after, motion, performed) in &there {
        if let Err(stray) = unseen.follow([before, after], motion, performed.as_ref()) {
            return (off, Err(stray));
        }
    }
    let (believed, real) = (stage.pose(thing), unseen.in_stage(&stage).pose(thing));
    let ahead = believed.inverse().then(real);
    let (from, to) = (ahead.position, ahead.point([1.0, 0.0, 0.0]));
    (off, Ok((seen(&stage.tip(panda), &believed, &real), (to[1] - from[1]).atan2(to[0] - from[0]))))
}

#[test]
fn fingers_centre_what_they_close_on_and_hit_what_is_further_off_than_they_are_open() {
    let program = compiled(bench("20 mm", "pick vial by panda"));
    let (mut within, mut beyond) = (0, 0);
    for seed in 0..40 {
        let (off, after) = picked(&program, "vial", 0.015, seed);
        // The fingers are some 20 mm wide.
        if off[0].abs() > 8e-3 {
            continue;
        }
        // They open 10 mm further than the vial is wide on either side.
        if off[1].abs() > 10e-3 {
            let stray = after.expect_err("a finger hits it");
            assert_eq!(stray.failure, "missed", "{seed}: {stray:?}");
            beyond += 1;
        } else {
            let (after, turned) = after.unwrap_or_else(|stray| panic!("{seed}, {off:?}: {stray:?}"));
            assert!(after[1].abs() < 1e-9, "{seed}: {after:?}");
            assert!((after[0] - off[0]).abs() < 1e-9 && (after[2] - off[2]).abs() < 1e-9, "{seed}: {off:?} {after:?}");
            assert!(turned != 0.0, "what is round stays turned");
            within += 1;
        }
    }
    assert!(within > 5 && beyond > 3, "{within} {beyond}");
}

#[test]
fn flat_sides_turn_to_lie_against_the_fingers() {
    let text = bench("20 mm", "pick rack by panda")
        .replace("use std::vials::Vial8mL", "use std::vials::{Vial8mL, VialRack15}");
    let text = text.replace("block = Block on", "rack = VialRack15 on");
    let program = compiled(text);
    for seed in 0..4 {
        let (off, after) = picked(&program, "rack", 0.002, seed);
        let (after, turned) = after.unwrap_or_else(|stray| panic!("{seed}, {off:?}: {stray:?}"));
        assert!(after[1].abs() < 1e-9 && turned.abs() < 1e-9, "{seed}: {after:?} {turned}");
        assert!(off[1].abs() > 1e-6 && (after[0] - off[0]).abs() < 1e-4, "{seed}: {off:?} {after:?}");
    }
}

#[test]
fn a_vial_within_the_room_of_the_fingers_is_picked_and_one_beyond_is_missed() {
    let dir = lab("unseen_pick", "20 mm", "pick vial by panda\n    put back vial by panda");
    let ended = run(&dir, &["--unseen", "2mm,1deg", "--out", "near"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert!(
        ended.out.contains("`vial` really stands (") && ended.out.contains("from its assumed place"),
        "{}",
        ended.out
    );
    let judged = matterixc_in(&dir, &["verify", "near"]);
    assert!(judged.out.contains("nothing wrong") && judged.out.contains("1 grips, off by "), "{}", judged.out);
    assert!(!judged.out.contains("off by 0.00 mm"), "the recording has the true pose: {}", judged.out);

    let ended = run(&dir, &["--unseen", "20mm", "--seed", "1"]);
    let said = flat(&ended.err);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(said.contains("failed with `missed`"), "{said}");
    assert!(said.contains("into `vial` at (") && said.contains("`vial` is 21.5 mm from its assumed place"), "{said}");
}

#[test]
fn a_hole_centres_what_its_clearance_takes_and_refuses_the_rest() {
    // 17 mm into 20 mm.
    let dir = lab("unseen_hole", "20 mm", "insert vial into block[A1] by panda");
    for seed in ["1", "2", "3"] {
        let ended = run(&dir, &["--unseen", "0.5mm,1deg", "--seed", seed, "--out", "in"]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        let judged = matterixc_in(&dir, &["verify", "in"]);
        assert!(judged.out.contains("nothing wrong"), "{}", judged.out);
    }
    let ended = run(&dir, &["--unseen", "2mm,1deg", "--out", "beside"]);
    let said = flat(&ended.err);
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(said.contains("failed with `collision`: `vial` hits the rim of `block[A1]`: it is "), "{said}");
    assert!(said.contains("off the middle of the hole, which leaves 1.5 mm on either side"), "{said}");
    // It stops at the rim, before its motion would have ended.
    assert!(ended.out.contains("failed after 3.2"), "{}", ended.out);
}

#[test]
fn the_same_seed_has_things_in_the_same_places_and_nothing_off_changes_nothing() {
    let dir = lab("unseen_same", "20 mm", "insert vial into block[A1] by panda");
    let bytes = |out: &str, more: &[&str]| {
        let mut all = vec!["--out", out];
        all.extend(more);
        let ended = run(&dir, &all);
        let files = ["recording.mcap", "report.json", "states.parquet", "plot.svg"];
        let read = |file: &str| std::fs::read(dir.join(out).join(file)).expect("it is written");
        (ended.out, files.map(read))
    };
    let plain = bytes("plain", &[]);
    assert!(plain == bytes("zero", &["--unseen", "0mm,0deg"]), "nothing is off");
    let off = bytes("off", &["--unseen", "1mm,1deg", "--seed", "3"]);
    assert!(off == bytes("again", &["--unseen", "1 mm, 1 deg", "--seed", "3"]), "the same seed, the same lab");
    assert!(off.0 != bytes("other", &["--unseen", "1mm,1deg", "--seed", "4"]).0);
    // What is seen and what is not are drawn apart.
    let both = bytes("both", &["--unseen", "0.5mm", "--perturb", "0.5mm"]);
    let places: Vec<&str> = both.0.lines().filter(|l| l.contains("`vial` ") && l.contains("stands (")).collect();
    assert_eq!(places.len(), 2, "{}", both.0);
    let at = |line: &str| line.split_once('(').map(|l| l.1.split(')').next().unwrap_or_default().to_string());
    assert_ne!(at(places[0]), at(places[1]), "{places:?}");
}

#[test]
fn what_is_really_in_the_way_ends_a_motion() {
    // A funnel goes into the neck of a flask, with little room.
    let run = |seed: u32| {
        let seed = seed.to_string();
        let file = "examples/environments/funnel.mtx";
        matterixc(&["run", file, "--fidelity", "motion", "--unseen", "2mm,1deg", "--seed", &seed])
    };
    let met = (1..=6).map(run).map(|ended| flat(&ended.err)).find(|said| said.contains("failed with `collision`"));
    let said = met.expect("one of them is too far off");
    let parts = [
        "`funnel` of `panda` goes ",
        " mm into `there` at (",
        "`there` is ",
        "`funnel` is ",
        " mm from its assumed place",
    ];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
}

/// Two hands, the first of which presses with so much, and what becomes of a tube that goes from one to the other from this seed.
fn handed(dir: &Path, friction: &str, force: &str, seed: u32) -> Ended {
    let text = std::fs::read_to_string(root().join("examples/handover.mtx")).expect("the example");
    let grasp = "    frame grasp at (0, 0, 95) mm";
    let text = text.replace(grasp, &format!("{friction}\n{grasp}"));
    let text = text.replace("FrankaHand {}", &format!("FrankaHand {{ force: {force} }}"));
    write(dir, "handover.mtx", text);
    let seed = seed.to_string();
    matterixc_in(dir, &["run", "handover.mtx", "--fidelity", "motion", "--unseen", "2mm,1deg", "--seed", &seed])
}

#[test]
fn a_second_hand_centres_what_slides_in_the_first_one_and_only_that() {
    let dir = folder("unseen_handover");
    // From here the tube is 1 mm off across the fingers of the second hand.
    let held = handed(&dir, "    friction: 0.4", "70 N", 1);
    let said = flat(&held.err);
    assert_eq!(held.code, 1, "{said}");
    assert!(said.contains("failed with `missed`: only one finger of `ur5e` presses on `tube`"), "{said}");
    assert!(said.contains("N push it along the fingers of `panda`, whose friction holds 56 N"), "{said}");
    let slides = handed(&dir, "    friction: 0.4", "10 N", 1);
    assert_eq!(slides.code, 0, "{}", slides.err);
    let unknown = handed(&dir, "", "70 N", 1);
    let said = flat(&unknown.err);
    assert!(said.contains("failed with `unmovable`") && said.contains("`--unseen` does not model"), "{said}");
    // From there it is not off across them.
    assert_eq!(handed(&dir, "", "70 N", 4).code, 0);
}

#[test]
fn a_face_holds_what_all_of_it_meets_where_it_is() {
    let dir = folder("unseen_face");
    let urdf = "<robot name=\"cup\"><link name=\"body\"><collision><origin xyz=\"0 0 0.03\"/><geometry>\
                <cylinder radius=\"0.012\" length=\"0.06\"/></geometry></collision></link><link name=\"face\"/>\
                <joint name=\"end\" type=\"fixed\"><origin xyz=\"0 0 0.06\"/><parent link=\"body\"/>\
                <child link=\"face\"/></joint></robot>";
    write(&dir, "cup.urdf", urdf);
    let text = "mtx 1\n\nuse std::robots::UR5e\n\nasset Cup: Gripper from urdf \"cup.urdf\" {\n    mass: 100 g\n    opening: 1 m\n    \
                tip: \"face\"\n}\n\nasset Plate: Labware, Graspable {\n    mass: 50 g\n    shape: box(60 mm, 40 mm, 10 mm)\n    \
                frame grasp at (0, 0, 10) mm\n}\n\nlab bench {\n    ambient: 22 degC\n    table = OpticalTable\n    \
                arm = UR5e { gripper: Cup {} } on table at (0, 0) mm\n    plate = Plate on table at (450, 100) mm\n}\n\n\
                workflow run in bench {\n    pick plate by arm\n    put back plate by arm\n}\n";
    write(&dir, "bench.mtx", text);
    // 20 mm from its middle to its nearer edge, and the face is 24 mm wide.
    let near = run(&dir, &["--unseen", "5mm,2deg", "--seed", "2", "--out", "near"]);
    assert_eq!(near.code, 0, "{}", near.err);
    let judged = matterixc_in(&dir, &["verify", "near"]);
    assert!(judged.out.contains("1 grips, off by ") && !judged.out.contains("off by 0.00 mm"), "{}", judged.out);
    let edge = flat(&run(&dir, &["--unseen", "12mm", "--seed", "2"]).err);
    assert!(edge.contains("`missed`: the face of `arm`, 24.0 mm wide, is partly beside `plate`"), "{edge}");
    let beside = flat(&run(&dir, &["--unseen", "30mm", "--seed", "2"]).err);
    assert!(beside.contains("`missed`: the face of `arm` does not touch `plate`"), "{beside}");
}

#[test]
fn tests_of_a_file_run_with_things_elsewhere_too() {
    let dir = lab("unseen_tests", "20 mm", "pick vial by panda\n    put back vial by panda");
    let text = std::fs::read_to_string(dir.join("bench.mtx")).expect("it is written");
    write(&dir, "bench.mtx", format!("{text}\ntest it_ends {{\n    run run\n}}\n"));
    let test = |more: &[&str]| {
        let mut all = vec!["test", "bench.mtx"];
        all.extend(more);
        matterixc_in(&dir, &all)
    };
    assert_eq!(test(&[]).code, 0);
    let near = test(&["--fidelity", "motion", "--unseen", "2mm,1deg"]);
    assert!(near.code == 0 && near.out.contains("1 passed, 0 failed"), "{}{}", near.out, near.err);
    let far = test(&["--fidelity", "motion", "--unseen", "20mm", "--seed", "1"]);
    assert!(far.code == 1 && flat(&far.out).contains("failed with `missed`"), "{}{}", far.out, far.err);
    let unmoved = test(&["--unseen", "20mm"]);
    assert!(unmoved.code == 2 && unmoved.err.contains("needs `--fidelity motion`"), "{}", unmoved.err);
}

#[test]
fn what_cannot_be_read_is_refused() {
    for wrong in ["20", "20mm,30mm", "5 s", "", "mm", "20mm,10deg,1", "-2mm"] {
        let ended = matterixc(&["run", "examples/handover.mtx", "--fidelity", "motion", &format!("--unseen={wrong}")]);
        assert_eq!(ended.code, 2, "{wrong}");
    }
    for other in [&["--fidelity", "process"][..], &["--fidelity", "motion", "--dry"], &[]] {
        let mut all = vec!["run", "examples/handover.mtx", "--unseen", "2mm"];
        all.extend(other);
        let ended = matterixc(&all);
        assert_eq!(ended.code, 2);
        assert!(ended.err.contains("needs `--fidelity motion`"), "{}", ended.err);
    }
}
