//! One way that things may have gone up to a step of a plan.

use std::collections::BTreeSet;
use std::hash::Hasher;

use matterix_ir::model::{Action, Load, Model};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand};
use matterix_ir::{Diagnostic, Program, Span};
use siphasher::sip128::{Hasher128, SipHasher13};

use super::offer::Missed;
use super::values::Values;
use crate::motion::carried::Carried;
use crate::motion::stage::Stage;
use crate::motion::supported;

/// Moments that differ by less than this, m and rad, mostly count as the same.
const COARSE: f64 = 1e-3;

/// A refusal that ends a statement before its time.
#[derive(Clone, Debug)]
pub struct Refusal {
    /// What a handler knows it by.
    pub failure: &'static str,
    /// What is said of it.
    pub finding: Diagnostic,
    /// What it is about, by which the same cause is known again.
    pub cause: Cause,
    /// The goal, if it is out of reach of an arm that stands for good.
    pub missed: Option<Missed>,
}

/// What a refusal comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cause {
    /// Things that it depends on: where it was to go, what is in the way.
    pub things: Vec<InstanceId>,
    /// The robot, where its goal is, to the millimetre, and what is said first; nothing where no two are the same.
    pub key: Option<(InstanceId, [i64; 3], String)>,
}

/// One way that things may have gone.
#[derive(Clone, Debug)]
pub struct Course<'p> {
    /// Where everything is.
    pub stage: Stage<'p>,
    /// What is known of the states.
    pub values: Values,
    /// What was decided on the way here and might have been otherwise: where, and whether the condition held.
    pub choices: Vec<(Span, bool)>,
    /// Things that stand where no statement was able to bring them: their states only say so.
    pub assumed: BTreeSet<InstanceId>,
    /// The statement being followed cannot be done: its other motions are passed over.
    pub lost: Option<Box<Refusal>>,
}

impl Course<'_> {
    /// The states change as an operation says, and things stand where they say.
    pub fn act(&mut self, program: &Program, actions: &[Action]) {
        for action in actions {
            let (state, value) = match action {
                Action::Assign { state, value, .. } => (state, value),
                Action::Move { fraction, but, from, to, .. } => {
                    self.values.transfer(&program.model, *fraction, but, *from, *to);
                    continue;
                }
            };
            let value = self.values.assign(&program.model, *state, *value);
            value.into_iter().for_each(|value| self.stage.follow_load(*state, value));
            let Some(state) = program.model.states.get(*state as usize) else { continue };
            let Some(id) = supported(&program.scene, &state.name, &state.domain) else { continue };
            match value {
                Some(value) => self.follow(id, (value >= 0.0).then_some(InstanceId(value as u32))),
                None => {
                    self.stage.unknown.places.insert(id);
                }
            }
        }
    }

    /// Parts that move stand where the states say, as far as those are known. Gives what moved, and how it stood.
    pub fn follow_joints(&mut self, model: &Model) -> Vec<(InstanceId, Vec<f64>)> {
        if self.stage.fixtures.is_empty() {
            return Vec::new();
        }
        let values = &self.values;
        self.stage.follow_joints(|node| values.value(model, node))
    }

    /// The first vessel in a hand in which there is more than it keeps as it is tilted, and how much more, m3; of those of which that is known.
    pub fn runs_over(&self, model: &Model) -> Option<(InstanceId, f64)> {
        let known = |id: InstanceId| {
            let robot = self.stage.held_by(id).filter(|robot| !self.stage.unknown.postures.contains(robot));
            robot.is_some() && !self.stage.unknown.places.contains(&id)
        };
        let loads = model.loads.iter().filter(|load| load.loose.is_some() && known(load.instance));
        let over = |load: &Load| {
            let volume = self.values.value(model, load.loose?)?;
            let over = self.stage.runs_over(load.instance, volume, f64::INFINITY);
            (over > 0.0).then_some((load.instance, over))
        };
        loads.into_iter().find_map(over)
    }

    /// A thing is carried by something else from now on, nobody says how: where it is then is known only where there is
    /// nothing else.
    pub fn follow(&mut self, id: InstanceId, by: Option<InstanceId>) {
        let before = self.stage.below(id);
        self.stage.follow(id, by);
        let after = self.stage.below(id);
        if before == after {
            return;
        }
        match after.filter(|on| self.stage.hand_of(*on).is_none()) {
            Some(on) => self.stands(id, on),
            None => {
                self.stage.unknown.places.insert(id);
            }
        }
    }

    /// A thing stands somewhere on a surface.
    pub fn stands(&mut self, id: InstanceId, on: InstanceId) {
        let another = |(index, carried): (usize, &Carried)| {
            index != id.0 as usize && matches!(carried, Carried::Stands(Stand::On(below, _)) if *below == on)
        };
        let shared = self.stage.carried.iter().enumerate().any(another);
        self.stage.put(id, on, Pose::IDENTITY);
        match shared {
            true => self.stage.unknown.places.insert(id),
            false => self.stage.unknown.places.remove(&id),
        };
    }

    /// How a robot stands cannot be told from here on.
    pub fn drifts(&mut self, robot: InstanceId) {
        self.stage.leave(robot);
        self.stage.unknown.postures.insert(robot);
    }

    /// What tells it from other courses.
    pub fn digest(&self) -> u128 {
        let mut hash = SipHasher13::new();
        self.stage.digest(Some(COARSE), &mut hash);
        hash.write_u128(self.values.digest());
        self.assumed.iter().for_each(|id| hash.write_u32(id.0));
        hash.write_u8(u8::from(self.lost.is_some()));
        hash.finish128().as_u128()
    }
}
