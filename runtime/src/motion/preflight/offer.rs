//! Where something would have to stand for a statement to be done: tried before it is said.

use matterix_ir::plan::{Motion, Plan, Step, StepId};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand};
use matterix_motion::inverse::{Request, Solver};
use matterix_motion::pose::pose;

use crate::motion::carried::Carried;
use crate::motion::outline::Outline;
use crate::motion::perturb::{LEVEL, others, pieces, with_load};
use crate::motion::stage::Stage;

/// A goal that an arm does not reach.
#[derive(Clone, Debug)]
pub struct Missed {
    /// The robot.
    pub robot: InstanceId,
    /// Whose frame it was to go to.
    pub goal: InstanceId,
    /// Any of these poses of its tip would have done, in the lab.
    pub targets: Vec<Pose>,
}

/// Somewhere else for a thing to stand.
pub struct Place {
    /// The thing.
    pub thing: InstanceId,
    /// Where.
    pub stand: Carried,
    /// How far that is from where it stands, x and y in the lab, m.
    shift: [f64; 2],
    /// In words.
    pub words: String,
}

impl Place {
    /// Whether it is not close to another one.
    pub fn is_apart(&self, other: &Place) -> bool {
        (self.shift[0] - other.shift[0]).hypot(self.shift[1] - other.shift[1]) > CLOSE
    }
}

/// Places nearer to each other than this count as one, m.
const CLOSE: f64 = 0.08;
/// How far nearer to the arm, or farther from it, places are looked for, and how far they are apart, m.
const FARTHEST: f64 = 0.6;
const STEP: f64 = 0.05;
/// By how much they are to the side, as seen from the arm, rad.
const ASIDE: [f64; 5] = [0.0, 0.3, -0.3, 0.7, -0.7];
/// Places are given to this, m.
const ROUND: f64 = 0.01;

/// Places for what a goal is part of from which an arm seems to reach it, the nearest first. Of what another robot holds,
/// places for where that was brought. `stage` is the lab before the statement `id`.
pub fn places(stage: &Stage<'_>, plan: &Plan, id: StepId, missed: &Missed) -> Vec<Place> {
    let Missed { robot, goal, targets } = missed;
    let thing = match brought(plan, id, stage, *goal, *robot) {
        Some(meeting) => stage.whole(meeting),
        None => stage.whole(*goal),
    };
    let (Some(actor), Some(Carried::Stands(stand))) = (stage.actors.get(robot), stage.carried.get(thing.0 as usize))
    else {
        return Vec::new();
    };
    if stage.actors.contains_key(&thing) || stage.is_unknown(thing) || stage.stands_on(*robot, thing) {
        return Vec::new();
    }
    let (foot, at) = (stage.foot(*robot), stage.pose(thing).position);
    let [x, y] = [at[0] - foot.position[0], at[1] - foot.position[1]];
    let (far, angle) = (x.hypot(y), matterix_ir::math::atan2(y, x));
    let steps = (FARTHEST / STEP) as i32;
    let mut shifts: Vec<[f64; 2]> = Vec::new();
    for (step, aside) in (-steps..=steps).flat_map(|step| ASIDE.map(move |aside| (step, aside))) {
        let reach = far + f64::from(step) * STEP;
        if reach > STEP && (step, aside) != (0, 0.0) {
            let (s, c) = matterix_ir::math::sin_cos(angle + aside);
            shifts.push([reach * c - x, reach * s - y]);
        }
    }
    shifts.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    let (mut solver, now) = (actor.solver(), actor.configuration());
    let back = foot.inverse();
    let mut out = Vec::new();
    for shift in shifts {
        let moved = moved(stage, *stand, shift);
        let mut there = stage.clone();
        there.carried.set(thing, Carried::Stands(moved));
        let by = there.pose(thing).position;
        let by = [by[0] - at[0], by[1] - at[1]];
        if reaches(&mut solver, &back, targets, by, &now) && has_room(stage, &there, thing) {
            let words = words(stage, thing, moved, by);
            out.push(Place { thing, stand: Carried::Stands(moved), shift: by, words });
        }
    }
    out
}

/// What was gone to last in a statement by the robot that holds a goal of another one.
fn brought(plan: &Plan, id: StepId, stage: &Stage<'_>, goal: InstanceId, robot: InstanceId) -> Option<InstanceId> {
    let mut motions = Vec::new();
    let mut open = vec![id];
    while let Some(id) = open.pop() {
        let step = &plan.get(id).step;
        open.extend(step.children().into_iter().rev());
        if let Step::Operation(operation) = step {
            motions.extend(&operation.motion);
        }
    }
    let first = motions
        .iter()
        .position(|m| stage.actor_of(m.mover()) == Some(robot) && m.goal().is_some_and(|(g, _)| g == goal))?;
    // Somebody else took it before that: where that one went with it.
    let taken = motions[..first].iter().rposition(|m| matches!(m, Motion::Grip { item, .. } if *item == goal))?;
    let holder = motions[taken].mover();
    let went = |m: &&&Motion| m.mover() == holder && m.goal().is_some_and(|(g, _)| g != goal);
    let went = motions[taken..first].iter().rev().find(went)?;
    went.goal().map(|(goal, _)| goal).filter(|_| stage.actor_of(holder) != Some(robot))
}

/// A stand so far away, m in the lab, at round figures.
fn moved(stage: &Stage<'_>, stand: Stand, [dx, dy]: [f64; 2]) -> Stand {
    let round = |v: f64| (v / ROUND).round() * ROUND;
    let shifted = |at: Pose, [dx, dy]: [f64; 2]| {
        let [x, y, z] = at.position;
        Pose { position: [round(x + dx), round(y + dy), z], ..at }
    };
    match stand {
        Stand::On(on, at) => {
            let turned = Pose { position: [0.0; 3], ..stage.surface(on) }.inverse();
            let [dx, dy, _] = turned.point([dx, dy, 0.0]);
            Stand::On(on, shifted(at, [dx, dy]))
        }
        Stand::Lab(at) => Stand::Lab(shifted(at, [dx, dy])),
        part => part,
    }
}

/// Whether an arm seems to get to one of its targets if they are so far away.
fn reaches(solver: &mut Solver, back: &Pose, targets: &[Pose], [dx, dy]: [f64; 2], now: &[f64]) -> bool {
    targets.iter().any(|target| {
        let [x, y, z] = target.position;
        let at = Pose { position: [x + dx, y + dy, z], ..*target };
        let request = Request { attempts: 10, ..Request::new(pose(&back.then(at)), now) };
        solver.solve(&request).is_ok()
    })
}

/// Whether a thing, with what is on it, has room where it stands now, and stands on what bore it before.
fn has_room(before: &Stage<'_>, there: &Stage<'_>, thing: InstanceId) -> bool {
    let mine = |stage: &Stage<'_>| -> Vec<Outline> {
        with_load(stage, thing).into_iter().flat_map(|id| pieces(stage, id)).collect()
    };
    let (own, was, around) = (mine(there), mine(before), others(there, thing));
    let free = around
        .iter()
        .all(|other| !own.iter().any(|piece| piece.meets(other)) || was.iter().any(|piece| piece.meets(other)));
    let Some(Carried::Stands(Stand::On(on, _))) = there.carried.get(thing.0 as usize) else { return free };
    let level = there.surface(*on).position[2];
    let tops: Vec<Outline> =
        pieces(there, *on).into_iter().filter(|top| (top.height[1] - level).abs() <= LEVEL).collect();
    let covered = |stage: &Stage<'_>| pieces(stage, thing).iter().all(|piece| tops.iter().any(|top| top.covers(piece)));
    let [x, y, _] = there.pose(thing).position;
    // What stood out over an edge may do so, if not fall off.
    let borne = tops.is_empty() || covered(there) || !covered(before) && tops.iter().any(|top| top.holds([x, y]));
    free && borne
}

/// A place in words: as its line says it, or from where the thing is.
fn words(stage: &Stage<'_>, thing: InstanceId, stand: Stand, [dx, dy]: [f64; 2]) -> String {
    let name = &stage.scene.get(thing).name;
    let mm = |v: f64| format!("{:.0}", v * 1e3 + 0.0);
    match stand {
        Stand::On(on, at) if stage.is_where_it_was(thing) => {
            let [x, y, _] = at.position;
            format!("`{name}` would be within reach at ({}, {}) mm on `{}`", mm(x), mm(y), stage.scene.get(on).name)
        }
        Stand::Lab(at) if stage.is_where_it_was(thing) => {
            let [x, y, z] = at.position;
            format!("`{name}` would be within reach at ({}, {}, {}) mm", mm(x), mm(y), mm(z))
        }
        _ => format!("`{name}` would be within reach if moved by ({}, {}) mm", mm(dx), mm(dy)),
    }
}
