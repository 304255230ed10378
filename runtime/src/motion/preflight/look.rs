//! Looks at one motion of one course.

use std::collections::BTreeSet;

use matterix_ir::plan::{Motion, Operation};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, NodeId, Program, Span};

use super::beside::Moved;
use super::course::{Cause, Course, Refusal};
use super::diagnostics;
use super::memory::{Memory, Outcome};
use super::more::More;
use super::offer::Missed;
use crate::motion::refused::Refused;
use crate::motion::stage::Stage;
use crate::motion::{Burden, tempi};

/// Looks at motions, each from the same moment only once.
pub struct Looker<'p, 's> {
    program: &'p Program,
    memory: Memory<'s>,
    /// Robots whose tool is described: only of them it is known what gets where.
    equipped: BTreeSet<InstanceId>,
    /// How much may still be looked at, in motions that can be carried out.
    left: usize,
}

/// How many motions are looked at before a plan counts as too long to be looked at whole.
const MOST: usize = 2000;
/// As how many of them one counts that cannot be carried out: it takes longer to find that out.
const REFUSED: usize = 40;

impl<'p, 's> Looker<'p, 's> {
    pub fn new(program: &'p Program, stage: &Stage<'p>, memory: Memory<'s>) -> Self {
        let equipped = stage.actors.iter().filter(|(_, actor)| actor.has_tool()).map(|(id, _)| *id).collect();
        Looker { program, memory, equipped, left: MOST }
    }

    /// Whether nothing more is looked at.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Keeps what was found for another time.
    pub fn keep(self) {
        self.memory.keep();
    }

    /// Carries out a motion in a course; what cannot be done makes it lost, what cannot be told makes things unknown.
    /// `site` is the statement to blame, `beside` what moves at the same time.
    pub fn motion(&mut self, course: &mut Course<'p>, operation: &Operation, site: Span, beside: &Moved) {
        let Some(motion) = &operation.motion else { return };
        let Some(robot) = course.stage.actor_of(motion.mover()) else { return };
        let model = &self.program.model;
        // What only a run can tell is left to the run.
        let Some(motion) = motion.chosen(|node| course.values.value(model, node)) else { return course.drifts(robot) };
        let carried = model.loads.iter().filter(|load| course.stage.held_by(load.instance) == Some(robot));
        let value = |node: Option<NodeId>| node.and_then(|node| course.values.value(model, node));
        let burdens = carried.map(|load| (load.instance, Burden::of(load, value)));
        let burdens: Vec<_> = burdens.filter(|(_, burden)| *burden != Burden::default()).collect();
        course.stage.burden(burdens);
        let tempi = tempi(&model.paces, |node| course.values.value(model, node));
        course.stage.keep_time(tempi);
        match &motion {
            Motion::Grip { item, .. } => self.grip(course, &motion, robot, *item, site, beside),
            Motion::Free { item, on, .. } => self.free(course, &motion, robot, (*item, *on), site, beside),
            _ => {
                let values = course.values.of_motion(model, &course.stage, &motion, operation);
                self.go(course, (&motion, values), robot, site, beside);
            }
        }
    }

    fn go(
        &mut self,
        course: &mut Course<'p>,
        (motion, values): (&Motion, Option<Vec<f64>>),
        robot: InstanceId,
        site: Span,
        beside: &Moved,
    ) {
        let stage = &course.stage;
        let adrift = stage.unknown.postures.contains(&robot);
        let held = stage.held(robot).is_some_and(|h| stage.unknown.places.contains(&h));
        let somewhere = motion.goal().is_some_and(|(goal, frame)| {
            // Where a thing stood is gone to with the thing; with anything else it is another motion.
            stage.is_frame_unknown(goal, frame) || stage.is_stand(goal, frame) && stage.held(robot) != Some(goal)
        });
        let goes_on = match motion {
            Motion::To { straight, .. } => *straight,
            Motion::By { .. } | Motion::Tilted { .. } | Motion::Fingers { .. } | Motion::Lead { .. } => true,
            _ => false,
        };
        let unsure = held || somewhere || adrift && goes_on;
        let blind = unsure || !self.equipped.contains(&robot) || stage.is_unknown(robot);
        let (Some(values), false) = (values, blind) else { return course.drifts(robot) };
        // From nowhere in particular, only where it ends can be judged.
        course.stage.unknown.postures.remove(&robot);
        match self.outcome(course, motion, &values) {
            Outcome::Done(_) => {}
            Outcome::Refused { why, more } => {
                let sure = match &why {
                    Refused::OutOfReach(..) => true,
                    Refused::Collides(m) | Refused::Swings(_, m) => {
                        !adrift && m.with.is_none_or(|w| !beside.robots.contains(&w) && !beside.items.contains(&w))
                    }
                    _ => !adrift && beside.is_empty(),
                };
                let finding = diagnostics::finding(&course.stage, motion, &values, &why, &more, site).filter(|_| sure);
                let cause = cause(&course.stage, motion, &why);
                course.drifts(robot);
                let goal = motion.goal().filter(|_| !more.targets.is_empty()).map(|(goal, _)| goal);
                let missed = goal.map(|goal| Missed { robot, goal, targets: more.targets });
                let failure = why.failure();
                course.lost = finding.map(|finding| Box::new(Refusal { failure, finding, cause, missed }));
            }
        }
    }

    fn grip(
        &mut self,
        course: &mut Course<'p>,
        motion: &Motion,
        robot: InstanceId,
        item: InstanceId,
        site: Span,
        beside: &Moved,
    ) {
        let stage = &mut course.stage;
        let blind = !self.equipped.contains(&robot)
            || stage.unknown.postures.contains(&robot)
            || stage.is_unknown(robot)
            || stage.is_unknown(item);
        let stuck = stage.stands_on(robot, item);
        if blind && !stuck {
            stage.carry(item, Some(robot));
            stage.unknown.places.insert(item);
            return;
        }
        let gripped = stage.perform(motion, &[]);
        if gripped.is_ok() {
            course.assumed.remove(&item);
        }
        let stage = &mut course.stage;
        if let Err(why) = gripped {
            stage.carry(item, Some(robot));
            stage.unknown.places.insert(item);
            self.refuse(course, motion, &why, site, beside.items.contains(&item));
        }
    }

    fn free(
        &mut self,
        course: &mut Course<'p>,
        motion: &Motion,
        robot: InstanceId,
        (item, on): (InstanceId, Option<InstanceId>),
        site: Span,
        beside: &Moved,
    ) {
        let stage = &mut course.stage;
        if stage.held(robot) != Some(item) {
            return;
        }
        let below = on.or_else(|| stage.stood_on(item));
        let blind = stage.unknown.postures.contains(&robot)
            || stage.is_unknown(robot)
            || stage.unknown.places.contains(&item)
            || on.is_some_and(|on| stage.is_unknown(on));
        if blind {
            match below.filter(|on| stage.hand_of(*on).is_none()) {
                Some(on) => course.stands(item, on),
                None => stage.carry(item, None),
            }
            return;
        }
        if let Err(why) = stage.perform(motion, &[]) {
            match below.filter(|on| stage.hand_of(*on).is_none()) {
                Some(on) => course.stands(item, on),
                None => stage.carry(item, below),
            }
            self.refuse(course, motion, &why, site, beside.items.contains(&item));
        } else if on.is_some_and(|on| beside.surfaces.contains(&on)) {
            // The others may have put something there before.
            stage.unknown.places.insert(item);
        }
    }

    /// A motion that is refused before it is looked at.
    pub fn cannot(&self, course: &mut Course<'p>, operation: &Operation, why: &Refused, site: Span) {
        let Some(motion) = &operation.motion else { return };
        self.refuse(course, motion, why, site, false);
        if let Some(robot) = course.stage.actor_of(motion.mover()) {
            course.drifts(robot);
        }
    }

    fn refuse(&self, course: &mut Course<'p>, motion: &Motion, why: &Refused, site: Span, unsure: bool) {
        let finding = diagnostics::finding(&course.stage, motion, &[], why, &More::default(), site).filter(|_| !unsure);
        let (failure, cause) = (why.failure(), cause(&course.stage, motion, why));
        course.lost = finding.map(|finding| Box::new(Refusal { failure, finding, cause, missed: None }));
    }

    /// What becomes of a motion; the course is where it ends.
    fn outcome(&mut self, course: &mut Course<'p>, motion: &Motion, values: &[f64]) -> Outcome {
        let outcome = self.planned(course, motion, values);
        // What is remembered counts as well, so that the findings do not depend on it.
        let cost = if matches!(outcome, Outcome::Done(_)) { 1 } else { REFUSED };
        self.left = self.left.saturating_sub(cost);
        outcome
    }

    fn planned(&mut self, course: &mut Course<'p>, motion: &Motion, values: &[f64]) -> Outcome {
        let key = self.memory.key(&course.stage, motion, values);
        if let Some(known) = self.memory.recall(&key) {
            match &known {
                Outcome::Done(change) if course.stage.change(change).is_none() => {}
                _ => return known,
            }
        }
        let before = course.stage.clone();
        let outcome = match course.stage.perform(motion, values) {
            Ok(_) => Outcome::Done(course.stage.since(&before)),
            Err(why) => {
                course.stage = before;
                let more = More::of(&course.stage, motion, values, &why);
                Outcome::Refused { why, more }
            }
        };
        self.memory.learn(key, outcome.clone());
        outcome
    }
}

/// What a refusal comes from.
fn cause(stage: &Stage<'_>, motion: &Motion, why: &Refused) -> Cause {
    let with = match why {
        Refused::Collides(meeting) => meeting.with,
        _ => None,
    };
    let goal = motion.goal().map(|(goal, _)| goal);
    let things = with.into_iter().chain(goal).map(|id| stage.whole(id)).collect();
    let key = stage.actor_of(motion.mover()).zip(goal).map(|(robot, goal)| {
        let at = stage.pose(goal).position.map(|v| (v * 1e3).round() as i64);
        (robot, at, format!("{} {goal:?} {with:?}", why.failure()))
    });
    Cause { things, key }
}

/// The finding of a refusal, with the step of the library it was found on.
pub fn on_step(finding: Diagnostic, step: Span) -> Diagnostic {
    if finding.span() == step { finding } else { finding.because(step, "during this step of the call") }
}
