//! What is known of a lab's states while a plan is followed without being run.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hasher;
use std::rc::Rc;

use matterix_ir::graph::{BinaryOp, UnaryOp, binary, unary};
use matterix_ir::interval;
use matterix_ir::model::{Action, Domain, Kept, Model};
use matterix_ir::pages::Pages;
use matterix_ir::plan::{Motion, Operation, Step};
use matterix_ir::values::{Bounds, Formulas, Rules};
use matterix_ir::{NodeId, Op, Program};
use siphasher::sip128::{Hasher128, SipHasher13};

use crate::motion::stage::Stage;

/// Values of states that are words, truths or instances, as far as they are known; quantities only where motions depend on
/// them and nothing but operations changes them.
#[derive(Clone, Debug)]
pub struct Values {
    by_state: Pages<Option<f64>>,
    /// The sum of a hash of each that is known: what tells all of them from others.
    sum: u128,
    /// The quantities among them.
    followed: Rc<BTreeSet<u32>>,
    /// What expressions are made of, as far as they were asked for, and room for values in between.
    formulas: Rc<RefCell<(Formulas, Vec<Option<f64>>)>>,
}

impl Values {
    /// When the run begins. What an event changes is not known, as nobody says when.
    pub fn at_start(program: &Program) -> Self {
        let model = &program.model;
        let changes = model.events.iter().flat_map(|e| &e.actions).filter_map(Action::assigned);
        let changes: BTreeSet<u32> = changes.collect();
        let mut out = Values {
            by_state: model.states.iter().map(|_| None).collect(),
            sum: 0,
            followed: Rc::new(followed(program, &changes)),
            formulas: Rc::default(),
        };
        for (index, state) in model.states.iter().enumerate() {
            let index = index as u32;
            if !out.follows(model, index) || changes.contains(&index) {
                continue;
            }
            let value = out.value(model, state.initial);
            out.set(index, value);
        }
        out
    }

    /// Whether what becomes of a state is followed.
    fn follows(&self, model: &Model, state: u32) -> bool {
        let quantity = model.states.get(state as usize).is_none_or(|s| matches!(s.domain, Domain::Quantity(_)));
        !quantity || self.followed.contains(&state)
    }

    /// An assignment: the new value, if it is known.
    pub fn assign(&mut self, model: &Model, state: u32, value: NodeId) -> Option<f64> {
        let value = self.value(model, value);
        if self.follows(model, state) {
            self.set(state, value);
        }
        value
    }

    fn set(&mut self, state: u32, value: Option<f64>) {
        if self.by_state.get(state as usize).is_none_or(|known| *known == value) {
            return;
        }
        let known = self.by_state.get_mut(state as usize).and_then(|known| std::mem::replace(known, value));
        let of = |value: Option<f64>| value.map_or(0, |value| hash(state, value));
        self.sum = self.sum.wrapping_sub(of(known)).wrapping_add(of(value));
    }

    /// What is known when actions have been carried out, the quantities that they set included.
    fn after<'a>(&self, model: &Model, actions: impl Iterator<Item = &'a Action>) -> Values {
        let mut out = self.clone();
        for action in actions {
            match action {
                Action::Assign { state, value, .. } => {
                    let value = out.value(model, *value);
                    out.set(*state, value);
                }
                Action::Move { fraction, but, from, to, .. } => out.transfer(model, *fraction, but, *from, *to),
            }
        }
        out
    }

    /// Part of one mixture goes into another one: of the amounts that are followed, where the part is known.
    pub fn transfer(&mut self, model: &Model, fraction: NodeId, but: &[Kept], from: u32, to: u32) {
        let share = self.value(model, fraction);
        let kept: Vec<(Kept, Option<f64>)> = but.iter().map(|k| (*k, self.value(model, k.stays.source()))).collect();
        let mixture = |index: u32| model.mixtures.get(index as usize).map_or(&[][..], |m| m.extensive.as_slice());
        for (name, state) in mixture(from) {
            let into = mixture(to).iter().find(|(other, _)| other == name).map(|(_, into)| *into);
            let known = |state: u32| self.by_state.get(state as usize).copied().flatten();
            let stays = |there: f64| match kept.iter().find(|(kept, _)| kept.state == *state) {
                Some((kept, value)) => value.and_then(|value| kept.amount(there, value)),
                None => Some(0.0),
            };
            let moved = known(*state).zip(share).and_then(|(there, share)| Some((there - stays(there)?) * share));
            let left = known(*state).zip(moved).map(|(there, moved)| there - moved);
            let got = into.and_then(known).zip(moved).map(|(there, moved)| there + moved);
            if self.follows(model, *state) {
                self.set(*state, left);
            }
            if let Some(into) = into.filter(|into| self.follows(model, *into)) {
                self.set(into, got);
            }
        }
    }

    /// The values of the motion of an operation, as [`Stage::perform`] takes them; nothing where only a run can tell them.
    pub fn of_motion(
        &self,
        model: &Model,
        stage: &Stage<'_>,
        motion: &Motion,
        operation: &Operation,
    ) -> Option<Vec<f64>> {
        if let Some(led) = stage.led_by(motion) {
            let after = self.after(model, operation.at_start.iter().chain(&operation.at_end));
            return after.value(model, led).map(|to| vec![to]);
        }
        // What may tilt so far at most is looked at with that where only a run can tell how far it may.
        let value = |node| match (self.value(model, node), motion) {
            (None, Motion::Upright { .. }) => self.most(model, node),
            (known, _) => known,
        };
        motion.values().into_iter().map(value).collect()
    }

    /// The most that an expression can be, whatever is not known; nothing where there is no limit.
    fn most(&self, model: &Model, node: NodeId) -> Option<f64> {
        let leaf = |op| match op {
            Op::Const(v) => (v, v),
            Op::State(s) => self.by_state.get(s as usize).copied().flatten().map_or(interval::ALL, |v| (v, v)),
            Op::Param(p) => model.params.get(p as usize).map_or(interval::ALL, |p| (p.value, p.value)),
            _ => interval::ALL,
        };
        let (formulas, _) = &mut *self.formulas.borrow_mut();
        let (_, most) = formulas.of(&model.graph, node).value(&Bounds(leaf), &mut Vec::new())?;
        Some(most).filter(|most| most.is_finite())
    }

    /// The value of an expression, if what is known settles it.
    pub fn value(&self, model: &Model, node: NodeId) -> Option<f64> {
        let (formulas, room) = &mut *self.formulas.borrow_mut();
        formulas.of(&model.graph, node).value(&Settled { model, by_state: &self.by_state }, room).flatten()
    }

    /// What tells them from others of the same lab.
    pub fn digest(&self) -> u128 {
        self.sum
    }
}

/// A hash of one value of a state.
fn hash(state: u32, value: f64) -> u128 {
    let mut hash = SipHasher13::new();
    hash.write_u32(state);
    hash.write_u64(value.to_bits());
    hash.finish128().as_u128()
}

/// What is known settles a value, or does not.
struct Settled<'v> {
    model: &'v Model,
    by_state: &'v Pages<Option<f64>>,
}

impl Rules for Settled<'_> {
    type Value = Option<f64>;

    fn leaf(&self, op: Op) -> Option<Option<f64>> {
        let value = match op {
            Op::Const(v) => Some(v),
            Op::State(s) => self.by_state.get(s as usize).copied().flatten(),
            Op::Param(p) => self.model.params.get(p as usize).map(|p| p.value),
            _ => None,
        };
        Some(number(value))
    }

    fn unary(&self, op: UnaryOp, a: Option<f64>) -> Option<Option<f64>> {
        Some(number(a.map(|a| unary(op, a))))
    }

    fn binary(&self, op: BinaryOp, a: Option<f64>, b: Option<f64>) -> Option<Option<f64>> {
        let either = |settles: fn(f64) -> bool| [a, b].into_iter().flatten().any(settles);
        Some(match op {
            // One side may settle it.
            BinaryOp::And if either(|v| v == 0.0) => Some(0.0),
            BinaryOp::Or if either(|v| v != 0.0) => Some(1.0),
            _ => number(a.zip(b).map(|(a, b)| binary(op, a, b))),
        })
    }

    fn truth(&self, condition: Option<f64>) -> Option<bool> {
        condition.map(|condition| condition != 0.0)
    }

    fn either(&self, _condition: Option<f64>, a: Option<f64>, b: Option<f64>) -> Option<Option<f64>> {
        Some(a.filter(|v| b == Some(*v)))
    }
}

/// What is not a number is not known.
fn number(value: Option<f64>) -> Option<f64> {
    value.filter(|v| !v.is_nan())
}

/// Whether a motion may tilt what a robot holds by more than it is told: on straight ways that stays as it is.
fn may_tilt(motion: &Motion) -> bool {
    match motion {
        Motion::Tilted { .. } | Motion::Joints { .. } | Motion::Home { .. } => true,
        Motion::To { straight, within, .. } => !straight && within.is_none(),
        Motion::By { straight, .. } => !straight,
        _ => false,
    }
}

/// Quantities that motions depend on, such as how far a tip hangs below its nozzle, as far as no law and no event changes them.
/// To follow the others would be to tell courses apart that are the same in space.
fn followed(program: &Program, by_events: &BTreeSet<u32>) -> BTreeSet<u32> {
    let model = &program.model;
    let operations = || {
        program.plan.steps.iter().filter_map(|step| match &step.step {
            Step::Operation(operation) => Some(operation),
            _ => None,
        })
    };
    let mut assigned: BTreeMap<u32, Vec<NodeId>> = BTreeMap::new();
    let mut open: Vec<NodeId> = Vec::new();
    // How far a vessel may be tilted goes by what is in it.
    let mut tilts = false;
    for operation in operations() {
        for action in operation.at_start.iter().chain(&operation.at_end) {
            if let Action::Assign { state, value, .. } = action {
                assigned.entry(*state).or_default().push(*value);
            }
        }
        if let Some(motion) = &operation.motion {
            tilts |= may_tilt(motion);
            if !matches!(motion, Motion::Upright { .. }) {
                open.extend(motion.values());
            }
            open.extend(motion.choice());
        }
    }
    if tilts {
        open.extend(model.loads.iter().flat_map(|load| [load.loose, load.taxed]).flatten());
    }
    let by_laws = model.derivatives.iter().map(|d| d.state);
    let mixed = model.mixtures.iter().filter(|_| !tilts);
    let in_mixtures = mixed.flat_map(|m| m.extensive.iter().map(|(_, state)| *state));
    let moving: BTreeSet<u32> = by_laws.chain(in_mixtures).chain(by_events.iter().copied()).collect();
    let (mut seen, mut found) = (BTreeSet::new(), BTreeSet::new());
    while let Some(node) = open.pop() {
        if !seen.insert(node) {
            continue;
        }
        for node in model.graph.schedule([node]) {
            let Op::State(state) = model.graph.op(node) else { continue };
            if !moving.contains(&state) && found.insert(state) {
                open.extend(assigned.get(&state).into_iter().flatten());
            }
        }
    }
    found
}
