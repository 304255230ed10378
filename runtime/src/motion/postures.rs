//! Other postures of a robot at a goal: for where the nearest one runs into something.

use std::f64::consts::TAU;

use matterix_ir::pose::Pose;
use matterix_ir::robot::JointKind;
use matterix_ir::scene::InstanceId;
use matterix_motion::inverse::Request;
use matterix_motion::pose::pose;
use matterix_motion::{Chain, Variable};

use super::stage::Stage;
use crate::backend::noise::{key, uniform};

/// How many starts are drawn for each pose of the goal.
const STARTS: u64 = 12;
/// Configurations nearer than this to one another count as one, rad or m.
const ALIKE: f64 = 0.05;

/// Configurations that bring the tip of a robot to any of some poses in the lab, from starts spread over all it can do, the
/// nearest to where it is first. The same question has the same answer.
pub fn postures(stage: &Stage<'_>, robot: InstanceId, to: &[Pose]) -> Vec<Vec<f64>> {
    let Some(actor) = stage.actors.get(&robot) else { return Vec::new() };
    let base = stage.foot(robot).inverse();
    let now = actor.configuration();
    let mut solver = actor.solver();
    let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
    for (index, target) in to.iter().enumerate() {
        let target = pose(&base.then(*target));
        for draw in 0..STARTS {
            let start: Vec<f64> = (0u64..)
                .zip(actor.chain.variables())
                .zip(&now)
                .map(|((k, variable), now)| {
                    let share = uniform(key(draw, index, k));
                    let (low, high) = (variable.limits.lower, variable.limits.upper);
                    if variable.is_bounded() { low + share * (high - low) } else { now + (share - 0.5) * TAU }
                })
                .collect();
            let Ok(solution) = solver.solve(&Request { attempts: 4, ..Request::new(target, &start) }) else { continue };
            let q = unwound(&actor.chain, solution.q, &now);
            let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if found.iter().any(|(_, known)| apart(known, &q) < ALIKE) {
                continue;
            }
            let far = q.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum();
            found.push((far, q));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, q)| q).collect()
}

/// The same posture with each joint that turns as few turns as its limits allow from where it is: a robot that comes from
/// elsewhere need not wind up.
fn unwound(chain: &Chain, q: Vec<f64>, now: &[f64]) -> Vec<f64> {
    let nearer = |((at, variable), now): ((f64, &Variable), &f64)| {
        if variable.kind == JointKind::Prismatic {
            return at;
        }
        let turns = ((now - at) / TAU).round();
        let (low, high) = (variable.limits.lower, variable.limits.upper);
        let least = ((low - at) / TAU).ceil();
        let most = ((high - at) / TAU).floor();
        if least > most { at } else { at + TAU * turns.clamp(least, most) }
    };
    q.into_iter().zip(chain.variables()).zip(now).map(nearer).collect()
}
