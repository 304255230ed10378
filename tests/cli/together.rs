//! Two arms at once: kept apart in a run, found beforehand, and from hand to hand.

use std::collections::BTreeMap;

use matterix_ir::scene::InstanceId;
use matterix_ir::{Program, Sources};
use matterix_lang::{LibraryOnly, Options};
use matterix_runtime::exec::{Listener, RunStatus};
use matterix_runtime::motion::{Moment, Stage};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::run::{Fidelity, RunOptions};

use crate::harness::{folder, matterixc, matterixc_in, root, write};

/// Two Pandas that face each other over a table, with points to go to and these steps from line 16 on.
fn lab(steps: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::{{OpticalTable, Waypoint}}\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\n\
         lab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    \
         left = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (-500, 0) mm\n    \
         right = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (500, 0) mm with rpy(0 deg, 0 deg, 180 deg)\n    \
         middle = Waypoint at (0, 0, 0.4) m\n    west = Waypoint at (-0.3, 0.4, 0.4) m\n    \
         east = Waypoint at (0.3, -0.4, 0.4) m\n}}\nworkflow meet in bench {{\n{steps}\n}}\n"
    )
}

/// Severity and line of what is found of robots that meet; nothing else may be wrong.
fn found(name: &str, steps: &str) -> Vec<(String, u64)> {
    let dir = folder(&format!("together_{name}"));
    write(&dir, "lab.mtx", lab(steps));
    let lines = matterixc_in(&dir, &["check", "lab.mtx", "--format", "json"]).out_lines();
    let one = |l: &serde_json::Value| {
        assert_eq!(l["code"], "robots-meet", "{name}: {l}");
        (
            l["severity"].as_str().unwrap_or_default().to_string(),
            l["span"]["start"]["line"].as_u64().unwrap_or_default(),
        )
    };
    lines.iter().map(one).collect()
}

const BAD: &[(&str, &str, &str, u64)] = &[
    ("one_place", "    parallel {\n        move left to middle\n        move right to middle\n    }", "error", 18),
    (
        "one_place_at_last",
        "    parallel {\n        step a { move left to west; move left to middle }\n        step b { move right to middle }\n    }",
        "error",
        18,
    ),
    (
        "through_one_place",
        "    parallel {\n        step a { move left to middle; move left to west }\n        step b { move right to middle; move right to east }\n    }",
        "warning",
        18,
    ),
    (
        "in_a_job",
        "    start job = { move left to middle; move left to west }\n    move right to middle\n    move right to east\n    await job",
        "warning",
        17,
    ),
    (
        "behind_a_wait",
        "    parallel {\n        step a { move left to middle; move left to west }\n        step b { wait 1 s; move right to middle; move right to east }\n    }",
        "warning",
        18,
    ),
    (
        "one_claims",
        "    parallel {\n        claim middle { move left to middle; move left to west }\n        step b { move right to middle; move right to east }\n    }",
        "warning",
        18,
    ),
];

const TWINS: &[(&str, &str)] = &[
    ("apart", "    parallel {\n        move left to west\n        move right to east\n    }"),
    ("in_a_row", "    move left to middle\n    move left to west\n    move right to middle"),
    (
        "by_turns",
        "    parallel {\n        claim middle { move left to middle; move left to west }\n        claim middle { move right to middle; move right to east }\n    }",
    ),
    (
        "awaited",
        "    start job = { move left to middle; move left to west }\n    await job\n    move right to middle\n    move right to east",
    ),
    (
        "long_waited",
        "    parallel {\n        step a { move left to middle; move left to west }\n        step b { wait 5 min; move right to middle; move right to east }\n    }",
    ),
    (
        "one_alone",
        "    parallel {\n        step a { move left to middle; move left to west }\n        wait 10 s\n    }",
    ),
];

#[test]
fn arms_that_meet_are_found_where_they_do() {
    for (name, steps, severity, line) in BAD {
        assert_eq!(found(name, steps), [(severity.to_string(), *line)], "{name}");
    }
}

#[test]
fn arms_that_do_not_meet_are_left_alone() {
    for (name, steps) in TWINS {
        assert_eq!(found(name, steps), [], "{name}");
    }
}

fn program(text: &str) -> Program {
    let mut sources = Sources::default();
    let file = sources.add("lab.mtx", text);
    let (program, found) = matterix_lang::compile(&mut sources, file, &LibraryOnly, &Options::default());
    program.unwrap_or_else(|| panic!("{found:?}"))
}

/// Where robots were, as it was recorded.
#[derive(Default)]
struct Seen(BTreeMap<InstanceId, Vec<(f64, Vec<f64>)>>);

impl Observer for Seen {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Seen {
    fn travels(&mut self, moments: &[Moment]) {
        for moment in moments {
            self.0.entry(moment.robot).or_default().push((moment.time, moment.joints.clone()));
        }
    }
}

impl Seen {
    /// The joints of a robot at a time, s, on straight lines between what was recorded.
    fn at(&self, robot: InstanceId, time: f64) -> Vec<f64> {
        let all = &self.0[&robot];
        let next = all.partition_point(|(t, _)| *t <= time);
        let (Some(before), Some(after)) = (all.get(next.wrapping_sub(1)), all.get(next)) else {
            return all[next.min(all.len() - 1)].1.clone();
        };
        let share = (time - before.0) / (after.0 - before.0);
        before.1.iter().zip(&after.1).map(|(a, b)| a + share * (b - a)).collect()
    }
}

/// Distance of the moments of a run that are judged, s.
const PACE: f64 = 2e-3;

/// The least distance between balls of two robots at any moment of a run, m, and how long the run took, s.
fn nearest(text: &str) -> (f64, f64) {
    let program = program(text);
    let mut seen = Seen::default();
    let options = RunOptions { fidelity: Fidelity::Motion, ..RunOptions::default() };
    let outcome = matterix_runtime::run::run(&program, &options, &mut seen);
    assert_eq!(outcome.status, RunStatus::Passed, "{:?}", outcome.failure);
    let mut stage = Stage::new(&program).expect("robots that move");
    let robots: Vec<InstanceId> = seen.0.keys().copied().collect();
    assert_eq!(robots.len(), 2);
    let mut least = f64::INFINITY;
    let last = seen.0.values().flatten().map(|(time, _)| *time).fold(0.0, f64::max);
    for step in 0..=(last / PACE) as u32 {
        let time = f64::from(step) * PACE;
        let balls: Vec<Vec<([f64; 3], f64)>> = robots
            .iter()
            .map(|robot| {
                stage.actors.get_mut(robot).expect("a robot").joints = seen.at(*robot, time);
                let links = stage.moment(*robot, time).expect("a robot").links;
                let own = &stage.actors[robot].assembly.robot.balls;
                own.iter().map(|b| (links[b.link as usize].point(b.center), b.radius)).collect()
            })
            .collect();
        for (p, r) in &balls[0] {
            for (q, s) in &balls[1] {
                let apart = (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>().sqrt();
                least = least.min(apart - r - s);
            }
        }
    }
    (least, outcome.end_time)
}

#[test]
fn arms_that_cross_keep_apart_and_need_less_time_than_one_after_the_other() {
    let both =
        "step a { move left to middle; move left to west }\n    step b { move right to middle; move right to east }";
    let (apart, at_once) = nearest(&lab(&format!("    parallel {{\n    {both}\n    }}")));
    assert!(apart > 0.0, "{apart} m");
    let (_, in_a_row) = nearest(&lab(&format!("    {both}")));
    assert!(at_once < in_a_row, "{at_once} s, {in_a_row} s");
}

#[test]
fn a_robot_that_stays_in_the_way_is_named() {
    let program =
        program(&lab("    move left to middle\n    parallel {\n        wait 1 s\n        move right to middle\n    }"));
    let options = RunOptions { fidelity: Fidelity::Motion, ..RunOptions::default() };
    let outcome = matterix_runtime::run::run(&program, &options, &mut Seen::default());
    let said = format!("{:?}", outcome.failure);
    assert!(said.contains("` of `right` collides with `") && said.contains("` of `left` at ("), "{said}");
    assert!(said.contains("which did not move away within 30 s"), "{said}");
}

#[test]
fn a_tube_goes_from_hand_to_hand() {
    let process = matterixc(&["run", "examples/handover.mtx"]);
    assert_eq!(process.code, 0, "{}{}", process.out, process.err);
    let file = root().join("examples/handover.mtx");
    let text = std::fs::read_to_string(file).expect("the example is there");
    let (apart, _) = nearest(&text);
    assert!(apart > 0.0, "{apart} m");
}

#[test]
fn arms_that_are_in_each_other_at_the_start_are_one_error() {
    let dir = folder("together_start");
    let text = lab("    parallel {\n        move left to west\n        move right to east\n    }");
    write(&dir, "lab.mtx", text.replace("table at (500, 0) mm", "table at (400, 0) mm"));
    let near = matterixc_in(&dir, &["check", "lab.mtx", "--format", "concise"]).out;
    assert!(!near.contains("before it moves"), "{near}");
    write(&dir, "lab.mtx", text.replace("table at (500, 0) mm", "table at (0, 0) mm"));
    let found = matterixc_in(&dir, &["check", "lab.mtx", "--format", "concise"]).out;
    assert!(found.contains("error[overlap]: `right` and `left` overlap"), "{found}");
    assert_eq!(found.lines().count(), 2, "{found}");
}
