//! What more can be told of a motion that is refused: what is between, which gap is too narrow, where it was to go.

use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::inverse::Request;
use matterix_motion::pose::pose;
use serde::{Deserialize, Serialize};

use crate::motion::exact::Exact;
use crate::motion::goal::targets;
use crate::motion::passage::Passage;
use crate::motion::refused::{Meeting, Refused};
use crate::motion::stage::Stage;
use crate::motion::surroundings::Surroundings;

/// Configurations that are looked at between the ends of a way.
const STEPS: u32 = 100;

/// What more is known of a refusal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct More {
    /// For want of a way: the last that is met where the joints go straight to where it ends.
    pub between: Option<Meeting>,
    /// For want of a way of a robot that drives: what it does not get past.
    pub passage: Option<Passage>,
    /// Out of reach: any of these poses of the tip in the lab would have done.
    pub targets: Vec<Pose>,
}

impl More {
    /// Looks into a refusal.
    pub fn of(stage: &Stage<'_>, motion: &Motion, values: &[f64], why: &Refused) -> Self {
        let mut more = More::default();
        let Some(robot) = stage.actor_of(motion.mover()) else { return more };
        match (why, motion.goal()) {
            (Refused::NoWay, _) => more.between = between(stage, robot, motion, values),
            (Refused::OutOfReach(..), Some((goal, frame))) => {
                let to = targets(stage, robot, goal, frame);
                more.passage = stage.passage(robot, &to);
                let stands = stage.actors.get(&robot).is_some_and(|actor| actor.drive.is_empty());
                more.targets = if stands { to } else { Vec::new() };
            }
            _ => {}
        }
        more
    }
}

/// The last thing met where the joints of an arm go straight to where a motion ends.
fn between(stage: &Stage<'_>, robot: InstanceId, motion: &Motion, values: &[f64]) -> Option<Meeting> {
    let actor = stage.actors.get(&robot)?;
    let now = actor.configuration();
    let end = match motion {
        Motion::Home { .. } => actor.arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect(),
        Motion::Joints { .. } => values.to_vec(),
        _ => {
            let (goal, frame) = motion.goal()?;
            let base = stage.foot(robot).inverse();
            let mut solver = actor.solver();
            let solved = targets(stage, robot, goal, frame).into_iter().filter_map(|target| {
                let request = Request { choices: 4, attempts: 60, ..Request::new(pose(&base.then(target)), &now) };
                solver.solve(&request).ok().map(|solution| solution.q)
            });
            let far = |q: &Vec<f64>| q.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            solved.min_by(|a, b| far(a).total_cmp(&far(b)))?
        }
    };
    if end.len() != now.len() {
        return None;
    }
    let around = Surroundings::of(stage, robot);
    let figure = stage.figure(robot, actor, &actor.arm).ok()?;
    let exact = Exact::of(stage, robot, &figure, &around);
    let mut checker = stage.checker(&figure, &around, &exact);
    (1..STEPS).rev().find_map(|step| {
        let share = f64::from(step) / f64::from(STEPS);
        let q: Vec<f64> = now.iter().zip(&end).map(|(a, b)| a + share * (b - a)).collect();
        checker.ask(false);
        if checker.contacts(&q).is_empty() {
            return None;
        }
        checker.ask(true);
        let met = checker.contacts(&q);
        match (met.is_empty(), stage.meeting(&figure, &around, &met, false)) {
            (false, Refused::Collides(meeting)) => Some(meeting),
            _ => None,
        }
    })
}
