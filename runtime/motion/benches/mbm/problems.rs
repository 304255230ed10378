//! Reads the planning problems and robots kept in `benches/data` (see the notice there).

use std::io::Read;

use matterix_ir::robot::Robot;
use matterix_motion::world::{Body, Shape, World};
use nalgebra::{IsometryMatrix3, Quaternion, Translation3, UnitQuaternion};

/// A question to a planner.
pub struct Problem {
    /// Which family it is of.
    pub scene: String,
    /// Its number in the family.
    pub number: u32,
    /// What stands around.
    pub world: World,
    /// rad
    pub start: Vec<f64>,
    /// rad
    pub goal: Vec<f64>,
}

/// A robot of the benchmark by name.
pub fn robot(name: &str) -> Robot {
    let path = format!("{}/benches/data/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).expect("the robot's file")).expect("a robot")
}

/// The problems for a robot. As in VAMP, cylinders are taken as capsules around them, and as boxes in family `box`.
pub fn problems(name: &str) -> Vec<Problem> {
    let path = format!("{}/benches/data/{name}.problems.gz", env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    let file = std::fs::File::open(path).expect("the problems' file");
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("gzip");
    let mut problems: Vec<Problem> = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next().unwrap_or_default();
        if kind == "problem" {
            let scene = words.next().expect("a scene").to_string();
            let number = words.next().and_then(|w| w.parse().ok()).expect("a number");
            problems.push(Problem { scene, number, world: World::default(), start: Vec::new(), goal: Vec::new() });
            continue;
        }
        let problem = problems.last_mut().expect("a problem first");
        let label = if matches!(kind, "start" | "goal") { "" } else { words.next().unwrap_or_default() };
        let n: Vec<f64> = words.map(|w| w.parse().expect("a number")).collect();
        match kind {
            "start" => problem.start = n,
            "goal" => problem.goal = n,
            _ => {
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(n[6], n[3], n[4], n[5]));
                let pose =
                    IsometryMatrix3::from_parts(Translation3::new(n[0], n[1], n[2]), rotation.to_rotation_matrix());
                let shape = match (kind, problem.scene.as_str()) {
                    ("box", _) => Shape::Cuboid([n[7] / 2.0, n[8] / 2.0, n[9] / 2.0]),
                    ("cylinder", "box") => Shape::Cuboid([n[7], n[7], n[8] / 2.0]),
                    ("cylinder", _) => Shape::Capsule(n[7], n[8] / 2.0),
                    other => panic!("what is {other:?}?"),
                };
                problem.world.bodies.push(Body { name: label.to_string(), pose, shape });
            }
        }
    }
    problems
}
