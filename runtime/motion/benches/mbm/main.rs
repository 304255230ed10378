//! Plans the MotionBenchMaker problems that VAMP ships and prints what VAMP's own script prints.
//!
//! `cargo bench -p matterix-motion --bench mbm [-- REPEATS [FILE]]`: times are the least of so many repeats of each
//! problem; FILE gets a line for every problem.

#![allow(clippy::disallowed_methods, reason = "a benchmark measures")]

mod problems;

use std::fmt::Write as _;
use std::time::Instant;

use matterix_motion::Tree;
use matterix_motion::plan::{Failure, Settings, search};
use matterix_motion::spheres::{Checker, Figure};
use matterix_motion::time::{Limits, follow};
use nalgebra::IsometryMatrix3;
use problems::{problems, robot};

/// Configurations checked for every unit of length, as in VAMP.
const RESOLUTION: f64 = 32.0;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let repeats = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(1);
    let file = arguments.next();
    let mut lines = String::new();
    for (name, range) in [("panda", 1.0), ("ur5", 1.5)] {
        measure(name, range, repeats, &mut lines);
    }
    if let Some(file) = file {
        std::fs::write(file, lines).expect("the file can be written");
    }
}

/// What the robots' makers state: Franka's interface limits (rad/s, rad/s2, rad/s3); for the UR5 its data sheet's
/// speed and, as it names no others, ten and a hundred times that for acceleration and jerk.
fn limits(name: &str) -> Limits {
    match name {
        "panda" => Limits {
            velocity: vec![2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
            acceleration: vec![15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
            jerk: vec![7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
        },
        _ => {
            let turn = std::f64::consts::PI;
            Limits { velocity: vec![turn; 6], acceleration: vec![10.0 * turn; 6], jerk: vec![100.0 * turn; 6] }
        }
    }
}

#[derive(Default)]
struct Times {
    world: Vec<f64>,
    plan: Vec<f64>,
    simplify: Vec<f64>,
    total: Vec<f64>,
    follow: Vec<f64>,
    end_to_end: Vec<f64>,
    duration: Vec<f64>,
    blocks: Vec<f64>,
    samples: Vec<f64>,
    draft: Vec<f64>,
    cost: Vec<f64>,
}

fn measure(name: &str, range: f64, repeats: usize, lines: &mut String) {
    let robot = robot(name);
    let moved: Vec<usize> = (0..Tree::new(&robot).expect("a tree").variables().len()).collect();
    let rest = vec![0.0; moved.len()];
    let figure = Figure::new(&robot, &IsometryMatrix3::identity(), &moved, &rest, &[]).expect("a figure");
    let settings = Settings { range, ..Settings::default() };
    let limits = limits(name);
    let all = problems(name);
    let (mut valid, mut solved) = (0, 0);
    let mut times = Times::default();
    for problem in &all {
        let mut least = [f64::INFINITY; 4];
        let mut last = None;
        for _ in 0..repeats {
            let begin = Instant::now();
            let mut checker = Checker::new(&figure, &problem.world, RESOLUTION);
            let built = begin.elapsed();
            let found = search(&mut checker, &problem.start, &problem.goal, &settings);
            let planned = begin.elapsed();
            let found = found.map(|draft| (draft.cost(), checker.checks(), draft.simplified(&mut checker, &settings)));
            let simplified = begin.elapsed();
            let timed = found.as_ref().ok().map(|(.., route)| {
                follow(&route.points, &limits, Some(&mut checker)).expect("a path can be followed").duration()
            });
            let followed = begin.elapsed();
            let took = [built, planned - built, simplified - planned, followed - simplified];
            for (least, took) in least.iter_mut().zip(took) {
                *least = least.min(took.as_secs_f64() * 1e6);
            }
            last = Some((found, timed.unwrap_or_default()));
        }
        let tag = format!("{name} {} {}", problem.scene, problem.number);
        let _ = match last {
            Some((Ok((draft, blocks, route)), duration)) => {
                valid += 1;
                solved += 1;
                times.world.push(least[0]);
                times.plan.push(least[1]);
                times.simplify.push(least[2]);
                times.total.push(least[1] + least[2]);
                times.follow.push(least[3]);
                times.end_to_end.push(least.iter().sum());
                times.duration.push(duration);
                times.blocks.push(blocks as f64);
                times.samples.push(route.iterations as f64);
                times.draft.push(draft);
                times.cost.push(route.cost);
                let [_, plan, simplify, follow] = least;
                writeln!(
                    lines,
                    "{tag} {plan:.3} {simplify:.3} {follow:.3} {:.5} {} {blocks} {duration:.3}",
                    route.cost, route.iterations
                )
            }
            Some((Err(Failure::Unreached(samples)), _)) => {
                valid += 1;
                writeln!(lines, "{tag} unsolved {samples}")
            }
            Some((Err(failure), _)) => writeln!(lines, "{tag} invalid {failure:?}"),
            None => Ok(()),
        };
    }
    println!("{name} solved {solved} / valid {valid} / {} (best of {repeats})", all.len());
    print("world us", times.world);
    print("plan us", times.plan);
    print("simplify us", times.simplify);
    print("plan+simp us", times.total);
    print("follow us", times.follow);
    print("all us", times.end_to_end);
    print("duration s", times.duration);
    print("samples", times.samples);
    print("blocks", times.blocks);
    print("draft rad", times.draft);
    print("cost rad", times.cost);
}

fn print(what: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let k = share * (values.len() - 1) as f64;
        let i = k as usize;
        values[i] + (k - i as f64) * (values[(i + 1).min(values.len() - 1)] - values[i])
    };
    if let Some(most) = values.last() {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        println!("  {what:12} mean {mean:9.3} median {:9.3} 95 % {:9.3} max {most:9.3}", at(0.5), at(0.95));
    }
}
