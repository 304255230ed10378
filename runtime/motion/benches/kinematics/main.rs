//! `cargo bench -p matterix-motion --bench kinematics`: forward and inverse kinematics of the robots in `assets/robots`.
//!
//! For each robot 10,000 configurations drawn evenly within the limits; the poses of their tips are asked for, from the
//! middle of the limits. A pose is reached when the solution is within all limits and the tip within 1 mm and 0.1 deg.
//! With `-- poses FOLDER` the configurations are written there, for `peers.py` beside this file.

#![allow(clippy::disallowed_methods, reason = "a benchmark measures")]

#[path = "../../tests/robots/mod.rs"]
mod robots;

use std::fmt::Write as _;
use std::time::Instant;

use matterix_motion::inverse::{Request, Solver};
use matterix_motion::{Chain, Variable, pose, variables};
use robots::{TIPS, chain};

const POSES: usize = 10_000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [word, folder] = &arguments[..] {
        assert_eq!(word, "poses");
        for (name, tip) in TIPS {
            let mut text = format!("# {tip}\n");
            for q in drawn(&chain(name, tip)) {
                let words: Vec<String> = q.iter().map(f64::to_string).collect();
                let _ = writeln!(text, "{}", words.join("\t"));
            }
            std::fs::write(format!("{folder}/{name}.tsv"), text).expect("written");
        }
        return;
    }
    println!("| robot | way | reached | median | 95 % | 99 % | starts, mean | tip | Jacobian |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (name, tip) in TIPS {
        let chain = chain(name, tip);
        let configurations = drawn(&chain);
        let forward = each(&configurations, |q| chain.tip(q).translation.vector.x);
        let mut columns = Vec::new();
        let jacobian = each(&configurations, |q| chain.jacobian(q, &mut columns).translation.vector.x);
        let mut solver = Solver::new(chain);
        let closed = solver.closed_form().is_some();
        for way in if closed { &["closed form", "search"][..] } else { &["search"] } {
            let row = inverse(&mut solver, &configurations, *way == "search");
            println!("| {name} | {way} | {row} | {forward:.0} ns | {jacobian:.0} ns |");
        }
    }
}

/// How one way of inverse kinematics does: the middle columns of the table.
fn inverse(solver: &mut Solver, configurations: &[Vec<f64>], search: bool) -> String {
    let middle = variables::middle(solver.chain().variables());
    let (mut times, mut reached, mut starts) = (Vec::new(), 0, 0);
    for q in configurations {
        let request = Request::new(solver.chain().tip(q), &middle);
        let began = Instant::now();
        let answer = if search { solver.search(&request) } else { solver.solve(&request) };
        times.push(began.elapsed());
        let Ok(solution) = answer else { continue };
        let within = |(q, v): (&f64, &Variable)| v.limits.lower <= *q && *q <= v.limits.upper;
        let (linear, angular) = pose::distance(&solver.chain().tip(&solution.q), &request.target);
        let all = solution.q.iter().zip(solver.chain().variables()).all(within);
        reached += usize::from(all && linear < 1e-3 && angular < 0.1f64.to_radians());
        starts += solution.attempts;
    }
    times.sort();
    let at = |percent: usize| times[times.len() * percent / 100].as_secs_f64() * 1e6;
    let share = 100.0 * reached as f64 / configurations.len() as f64;
    let starts = f64::from(starts) / configurations.len() as f64;
    format!("{reached} ({share:.2} %) | {:.1} us | {:.1} us | {:.1} us | {starts:.2}", at(50), at(95), at(99))
}

/// Nanoseconds of one call.
fn each(configurations: &[Vec<f64>], mut call: impl FnMut(&[f64]) -> f64) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let began = Instant::now();
        let sum: f64 = configurations.iter().map(|q| call(q)).sum();
        std::hint::black_box(sum);
        best = best.min(began.elapsed().as_secs_f64() * 1e9 / configurations.len() as f64);
    }
    best
}

/// Configurations drawn evenly within the limits.
fn drawn(chain: &Chain) -> Vec<Vec<f64>> {
    let mut state = 1u64;
    let mut unit = || {
        // Knuth's MMIX generator; its upper bits are good enough to spread poses.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let ranges: Vec<(f64, f64)> = chain.variables().iter().map(ends).collect();
    (0..POSES).map(|_| ranges.iter().map(|(low, high)| low + (high - low) * unit()).collect()).collect()
}

/// The limits of a variable; a turn where it has none.
fn ends(variable: &Variable) -> (f64, f64) {
    if variable.is_bounded() {
        (variable.limits.lower, variable.limits.upper)
    } else {
        (-std::f64::consts::PI, std::f64::consts::PI)
    }
}
