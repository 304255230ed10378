//! Values of the lab's expressions at a point of the plan, as far as they are known before the run.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::equilibrium::{Call, Part};
use matterix_ir::graph::{binary, unary};
use matterix_ir::scene::InstanceId;
use matterix_ir::values::{Formulas, Rules};
use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use super::state::MixtureState;
use crate::declare::SpeciesId;
use crate::elaborate::hazards::SHARE;
use crate::elaborate::mixtures::{Passage, Passages};
use crate::eval::lab::{Elaborator, ExtensiveKey};

/// Evaluates nodes of the lab at states of the world.
pub struct NodeEvaluator<'l, 'a> {
    /// The lab.
    pub lab: &'l Elaborator<'a>,
    params: Vec<f64>,
    /// What nodes are made of, as far as they were asked for, and room for values and whether they are known.
    formulas: RefCell<(Formulas, Vec<(f64, bool)>)>,
    /// By state: whether time changes it.
    moving: Vec<bool>,
    /// The amount states of each mixture.
    pub amounts: BTreeMap<InstanceId, Vec<(SpeciesId, u32)>>,
    /// The extensive states of each mixture.
    extensive: Vec<Vec<(ExtensiveKey, u32)>>,
    passages: RefCell<Passages>,
    /// Whose lineage a state is.
    pub lineage: BTreeMap<u32, InstanceId>,
    /// The states that are amounts.
    pub counted: BTreeSet<u32>,
    /// What each of them is an amount of.
    pub amount_of: BTreeMap<u32, (InstanceId, SpeciesId)>,
}

impl<'l, 'a> NodeEvaluator<'l, 'a> {
    /// Looks at a lab whose states are all declared.
    pub fn new(lab: &'l Elaborator<'a>) -> Self {
        let mut amounts: BTreeMap<InstanceId, Vec<(SpeciesId, u32)>> = BTreeMap::new();
        for (key, state) in &lab.extensive {
            if let Some(s) = key.matter() {
                amounts.entry(key.instance).or_default().push((s, *state));
            }
        }
        NodeEvaluator {
            lab,
            params: lab.params.iter().map(|p| p.value).collect(),
            formulas: RefCell::default(),
            moving: (0..lab.states.len() as u32).map(|state| lab.rates.contains_key(&state)).collect(),
            counted: amounts.values().flatten().map(|a| a.1).collect(),
            amount_of: amounts.iter().flat_map(|(m, of)| of.iter().map(|(s, state)| (*state, (*m, *s)))).collect(),
            lineage: lab.lineage.iter().flat_map(|(m, of)| of.values().map(|state| (*state, *m))).collect(),
            amounts,
            extensive: lab.extensive_by_mixture(),
            passages: RefCell::default(),
        }
    }

    /// The states that a transfer between two mixtures changes.
    pub fn passage(&self, from: InstanceId, to: InstanceId) -> Passage {
        let (from, to) = (self.lab.mixture_index(from), self.lab.mixture_index(to));
        self.passages.borrow_mut().between(from, to, &self.extensive)
    }

    /// A value at a point of the plan; not a number where it depends on what only a run knows.
    pub fn value(&self, node: NodeId, world: &MixtureState) -> f64 {
        self.look(node, world, |_| false).0
    }

    /// Whether a condition holds at a point of the plan, if that is known there.
    pub fn truth(&self, node: NodeId, world: &MixtureState) -> Option<bool> {
        let (value, known) = self.look(node, world, |state| self.moving(state));
        known.then_some(value != 0.0)
    }

    /// The same, with the amounts that transfers have left, whatever has reacted since.
    pub fn nominal_truth(&self, node: NodeId, world: &MixtureState) -> Option<bool> {
        let (value, known) = self.look(node, world, |state| self.moving(state) && !self.counted.contains(&state));
        known.then_some(value != 0.0)
    }

    /// A value, and whether it is known: a comparison with what is not known is false, which says nothing.
    fn look(&self, node: NodeId, world: &MixtureState, moving: impl Fn(u32) -> bool) -> (f64, bool) {
        let look = Look { params: &self.params, world, moving };
        let (formulas, room) = &mut *self.formulas.borrow_mut();
        formulas.of(&self.lab.graph, node).value(&look, room).unwrap_or((f64::NAN, false))
    }

    /// Whether time changes a state.
    fn moving(&self, state: u32) -> bool {
        self.moving.get(state as usize).copied().unwrap_or_default()
    }

    /// Sum of the masses in a mixture, kg.
    pub fn mass(&self, mixture: InstanceId, world: &MixtureState) -> f64 {
        let species = &self.lab.tables.species;
        let list = self.amounts(mixture);
        list.iter().map(|(s, state)| world.states[*state as usize] * species.get(*s).molar_mass).sum()
    }

    /// The species of a mixture with the states that are their amounts.
    pub fn amounts(&self, mixture: InstanceId) -> &[(SpeciesId, u32)] {
        self.amounts.get(&mixture).map_or(&[][..], Vec::as_slice)
    }
}

/// A look at one point of the plan: values, and whether they are known.
struct Look<'w, M> {
    params: &'w [f64],
    world: &'w MixtureState,
    /// Whether a state has no value that can be known.
    moving: M,
}

impl<M: Fn(u32) -> bool> Rules for Look<'_, M> {
    type Value = (f64, bool);

    #[inline]
    fn leaf(&self, op: Op) -> Option<(f64, bool)> {
        let value = match op {
            Op::Const(v) => return Some((v, true)),
            Op::State(i) => self.world.states[i as usize],
            Op::Param(i) => self.params[i as usize],
            Op::Local(SHARE) => self.world.share,
            Op::Local(i) => self.world.locals.get(i as usize).copied().unwrap_or(f64::NAN),
            _ => f64::NAN,
        };
        let moves = matches!(op, Op::State(i) if (self.moving)(i));
        Some((value, !value.is_nan() && !moves))
    }

    fn unary(&self, op: UnaryOp, a: (f64, bool)) -> Option<(f64, bool)> {
        Some((unary(op, a.0), a.1))
    }

    fn binary(&self, op: BinaryOp, a: (f64, bool), b: (f64, bool)) -> Option<(f64, bool)> {
        Some((binary(op, a.0, b.0), a.1 && b.1))
    }

    fn truth(&self, (value, known): (f64, bool)) -> Option<bool> {
        known.then_some(value != 0.0)
    }

    fn solved(&self, call: &Call, args: &[(f64, bool)]) -> Option<(f64, bool)> {
        let numbers: Vec<f64> = args.iter().map(|a| a.0).collect();
        let value = call.system.value(call.part, &numbers);
        // How warm it is moves with time; what is dissolved follows it little, and stands as in what steps leave.
        let heat = call.system.layout().heat();
        let counts = |i: usize| i != heat || call.part == Part::Temperature;
        let is_known = args.iter().enumerate().all(|(i, arg)| arg.1 || !counts(i));
        Some((value, is_known && !value.is_nan()))
    }

    fn either(&self, condition: (f64, bool), a: (f64, bool), b: (f64, bool)) -> Option<(f64, bool)> {
        Some((if condition.0 != 0.0 { a.0 } else { b.0 }, false))
    }
}
