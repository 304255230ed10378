//! Grippers that open and close, and what is carried upright and tilted.

use matterix_ir::plan::{Motion, Step};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op, Program, Sources};
use matterix_lang::{LibraryOnly, Options, compile};
use matterix_runtime::motion::{Refused, Stage};

use crate::harness::{folder, matterixc_in, write};

/// A lab with a gripper of this kind and a workflow of these lines.
fn program(gripper: &str, things: &str, lines: &str) -> Program {
    let text = format!(
        "mtx 1\nuse std::glassware::{{Beaker50mL, Beaker250mL}}\nuse std::heating::IkaRetControl\n\
         use std::robots::{{FrankaHand, FrankaPanda, Robotiq2F85}}\nlab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: {gripper} {{}} }} on table at (0, 0) mm\n    {things}\n}}\n\
         workflow run in bench {{\n    {lines}\n}}\n"
    );
    compiled(text)
}

/// The program of a text.
pub fn compiled(text: String) -> Program {
    let mut sources = Sources::default();
    let file = sources.add("bench.mtx", text);
    let (program, found) = compile(&mut sources, file, &LibraryOnly, &Options::default());
    program.unwrap_or_else(|| panic!("{found:?}"))
}

/// The value of an expression as the run begins.
fn at_first(program: &Program, node: NodeId) -> f64 {
    program.model.graph.eval_on(node, |leaf| match leaf {
        Op::Const(value) => value,
        Op::Param(index) => program.model.params[index as usize].value,
        Op::State(index) => at_first(program, program.model.states[index as usize].initial),
        _ => f64::NAN,
    })
}

/// The motions of a program in the order of the plan, with the values they depend on, as they are at first.
pub fn motions(program: &Program) -> Vec<(Motion, Vec<f64>)> {
    let value = |node| at_first(program, node);
    let mut out = Vec::new();
    let mut todo = vec![program.plan.root];
    while let Some(id) = todo.pop() {
        let step = &program.plan.get(id).step;
        if let Step::Operation(operation) = step
            && let Some(motion) = &operation.motion
        {
            out.push((motion.clone(), motion.values().into_iter().map(value).collect()));
        }
        todo.extend(step.children().into_iter().rev());
    }
    out
}

/// How far fingers are apart, m.
fn gap(stage: &Stage<'_>, robot: InstanceId) -> f64 {
    let actor = &stage.actors[&robot];
    let fingers = actor.fingers.as_ref().expect("fingers");
    fingers.gap(&actor.tree, &actor.joints).expect("pads")
}

/// Carries out the motions of a workflow; how far the fingers are apart after each.
fn gaps(program: &Program) -> Vec<f64> {
    let mut stage = Stage::new(program).expect("a stage");
    let panda = program.scene.find("panda").expect("it is there");
    let perform = |(motion, values): (Motion, Vec<f64>)| {
        let done = stage.perform(&motion, &values).unwrap_or_else(|why| panic!("{motion:?}: {why:?}"));
        if let Motion::Grip { .. } | Motion::Free { .. } = motion {
            assert!(done.expect("fingers move").duration() > 0.05);
        }
        gap(&stage, panda)
    };
    motions(program).into_iter().map(perform).collect()
}

#[test]
fn fingers_open_for_a_thing_and_close_onto_it() {
    for gripper in ["FrankaHand", "Robotiq2F85"] {
        let cup = "cup = Beaker50mL on table at (450, 100) mm";
        let program = program(gripper, cup, "pick cup by panda; put back cup by panda");
        // move, slide, grasp, slide; move, slide, set down.
        let wanted = [62.0, 62.0, 42.0, 42.0, 42.0, 42.0, 62.0].map(|mm| mm * 1e-3);
        for (gap, wanted) in gaps(&program).into_iter().zip(wanted) {
            assert!((gap - wanted).abs() < 1e-4, "{gripper}: {gap} m instead of {wanted} m");
        }
    }
}

#[test]
fn a_gripper_closes_and_opens_as_far_as_it_goes() {
    let program = program("FrankaHand", "", "close gripper panda; open gripper panda");
    let found = gaps(&program);
    assert!(found[0] < 1e-4 && (found[1] - 0.080).abs() < 1e-4, "{found:?}");
}

#[test]
fn joints_go_to_positions_and_home() {
    let lines = "turn joints panda to [10 deg, -30 deg, 0 deg, -120 deg, 0 deg, 90 deg, 45 deg]; home panda";
    let program = program("FrankaHand", "", lines);
    let mut stage = Stage::new(&program).expect("a stage");
    let panda = program.scene.find("panda").expect("it is there");
    let home = stage.actors[&panda].configuration();
    let moves = motions(&program);
    stage.perform(&moves[0].0, &moves[0].1).expect("it gets there");
    let there = stage.actors[&panda].configuration();
    assert!((there[0] - 10f64.to_radians()).abs() < 1e-9 && (there[3] + 120f64.to_radians()).abs() < 1e-9, "{there:?}");
    stage.perform(&moves[1].0, &moves[1].1).expect("it gets back");
    assert_eq!(stage.actors[&panda].configuration(), home);
    let short = stage.perform(&moves[0].0, &moves[0].1[..3]).expect_err("too few");
    assert_eq!(short, Refused::Joints(3, 7));
}

/// How far something's z axis is from up, rad.
fn tilt(stage: &Stage<'_>, id: InstanceId) -> f64 {
    let (from, to) = (stage.pose(id).position, stage.pose(id).point([0.0, 0.0, 1.0]));
    (to[2] - from[2]).clamp(-1.0, 1.0).acos()
}

#[test]
fn what_is_carried_stays_upright_and_is_tilted_over_its_target() {
    let things = "scale = IkaRetControl on table at (550, 0) mm\n    full = Beaker250mL on table at (450, -250) mm holding 100 g of water\n    \
                  cup = Beaker250mL on scale holding 20 g of water";
    let program = program("FrankaHand", things, "pour 30 g from full into cup by panda using scale { tolerance: 5 g }");
    let mut stage = Stage::new(&program).expect("a stage");
    let find = |name| program.scene.find(name).expect("it is there");
    let (full, cup) = (find("full"), find("cup"));
    let mut most: f64 = 0.0;
    for (motion, values) in motions(&program) {
        let done = stage.perform(&motion, &values).unwrap_or_else(|why| panic!("{motion:?}: {why:?}"));
        let tilts = done.iter().flat_map(|done| stage.moments(done, 0.0, 0.02)).filter_map(|m| m.held);
        let tilts = tilts.map(|(_, at)| (at.point([0.0, 0.0, 1.0])[2] - at.position[2]).clamp(-1.0, 1.0).acos());
        let greatest = tilts.fold(0.0, f64::max);
        match motion {
            Motion::Tilted { .. } if values[0] > 0.0 => {
                // Of a round vessel any point of the rim may be the lip.
                let mut spout = stage.frame(cup, "spout").expect("a spout").position;
                // The lip is held back from there, against the way it sinks.
                let leans = [0, 1].map(|k| stage.pose(full).point([0.0, 0.0, 1.0])[k] - stage.pose(full).position[k]);
                let along = leans[0].hypot(leans[1]);
                (0..2).for_each(|k| spout[k] += values[1] * leans[k] / along);
                spout[2] += values[3];
                let [x, y, z] = stage.pose(full).inverse().point(spout);
                assert!((x.hypot(y) - 0.035).abs() < 1e-4 && (z - 0.095).abs() < 1e-4, "({x}, {y}, {z}) m");
                assert!((tilt(&stage, full) - values[0]).abs() < 1e-3);
            }
            Motion::Tilted { .. } => assert!(tilt(&stage, full) < 1e-3),
            _ => most = most.max(greatest),
        }
    }
    assert!(most < 20f64.to_radians(), "{most} rad");
}

#[test]
fn a_vial_is_weighed_and_inserted_and_a_button_pressed() {
    let dir = folder("gripping_skills");
    let text = "mtx 1\nuse std::heating::IkaRetControl\nuse std::robots::{FrankaHand, FrankaPanda}\n\
                use std::vials::{Vial20mL, VialRack8}\nasset Switch: Buttoned {\n    mass: 300 g\n    \
                shape: box(60 mm, 60 mm, 40 mm)\n    frame button at (0, 0, 45) mm\n}\nlab bench {\n    ambient: 25 degC\n    \
                table = OpticalTable\n    panda = FrankaPanda { gripper: FrankaHand {} } on table at (0, 0) mm\n    \
                scale = IkaRetControl on table at (500, 200) mm\n    rack = VialRack8 on table at (450, -250) mm\n    \
                vial = Vial20mL in rack[A2] holding 10 g of water\n    switch = Switch on table at (350, 350) mm\n}\n\
                workflow fill in bench {\n    let m <- weigh vial on scale by panda\n    expect m in 26 g .. 28 g\n    \
                insert vial into rack[B3] by panda\n    expect vial.support == rack[B3]\n    press switch by panda\n    \
                expect switch.presses == 1\n    lift panda by 50 mm\n    shift panda by (20 mm, 0 mm, 30 mm)\n    home panda\n}\n";
    write(&dir, "fill.mtx", text);
    for args in [["check", "fill.mtx", "--fidelity", "motion"], ["run", "fill.mtx", "--fidelity", "motion"]] {
        let ended = matterixc_in(&dir, &args);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    }
}

#[test]
fn what_a_gripper_cannot_do_is_said_once_with_its_motion_too() {
    let dir = folder("gripping_wide");
    let text = "mtx 1\nuse std::glassware::Beaker500mL\nuse std::robots::{FrankaHand, FrankaPanda}\nlab bench {\n    \
                ambient: 25 degC\n    table = OpticalTable\n    \
                panda = FrankaPanda { gripper: FrankaHand { OPENING } } on table at (0, 0) mm\n    \
                cup = Beaker500mL on table at (450, 0) mm\n}\nworkflow take in bench {\n    pick cup by panda\n    put back cup by panda\n}\n";
    // Said to open wider than its fingers do: only its shape tells.
    for (opening, line) in [("", 11), ("opening: 90 mm", 11)] {
        write(&dir, "wide.mtx", text.replace("OPENING", opening));
        let ended = matterixc_in(&dir, &["check", "wide.mtx", "--fidelity", "motion", "--format", "concise"]);
        assert!(ended.out.starts_with(&format!("wide.mtx:{line}:5: error[too-wide]")), "{}", ended.out);
        assert_eq!(ended.out.matches("error[").count(), 1, "{}", ended.out);
    }
}
