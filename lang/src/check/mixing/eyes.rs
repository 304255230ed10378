//! Values of the lab's expressions at a point of the plan, as far as they are known before the run.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::graph::apply;
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op};

use super::world::World;
use crate::elaborate::{Elaborator, SpeciesId};

/// Evaluates nodes of the lab at states of the world.
pub struct Eyes<'l, 'a> {
    /// The lab.
    pub lab: &'l Elaborator<'a>,
    params: Vec<f64>,
    /// Operations below nodes, operands first, as far as they were asked for.
    cones: RefCell<Vec<Option<Rc<[NodeId]>>>>,
    /// Values of the operations of the node evaluated last, and whether they are known.
    values: RefCell<(Vec<f64>, Vec<bool>)>,
    /// By state: whether time changes it.
    moving: Vec<bool>,
    /// The mixtures in the order in which actions number them.
    pub order: Vec<InstanceId>,
    /// The amount states of each mixture.
    pub amounts: BTreeMap<InstanceId, Vec<(SpeciesId, u32)>>,
    /// Every extensive state of each mixture by what it is.
    pub extensive: BTreeMap<InstanceId, BTreeMap<(String, Option<SpeciesId>), u32>>,
    /// Whose lineage a state is.
    pub lineage: BTreeMap<u32, InstanceId>,
    /// The states that are amounts.
    pub counted: BTreeSet<u32>,
}

impl<'l, 'a> Eyes<'l, 'a> {
    /// Looks at a lab whose states are all declared.
    pub fn new(lab: &'l Elaborator<'a>) -> Self {
        let mixture = |i: &InstanceId| lab.per_species(*i).is_some();
        let order: Vec<InstanceId> = (0..lab.instances.len() as u32).map(InstanceId).filter(mixture).collect();
        let mut amounts: BTreeMap<InstanceId, Vec<(SpeciesId, u32)>> = BTreeMap::new();
        let mut extensive: BTreeMap<InstanceId, BTreeMap<(String, Option<SpeciesId>), u32>> = BTreeMap::new();
        for (key, state) in &lab.extensive {
            if let Some(s) = key.species {
                amounts.entry(key.instance).or_default().push((s, *state));
            }
            extensive.entry(key.instance).or_default().insert((key.member.clone(), key.species), *state);
        }
        Eyes {
            lab,
            params: lab.params.iter().map(|p| p.value).collect(),
            cones: RefCell::new(vec![None; lab.graph.ops().len()]),
            values: RefCell::new((vec![0.0; lab.graph.ops().len()], vec![false; lab.graph.ops().len()])),
            moving: (0..lab.states.len() as u32).map(|state| lab.rates.contains_key(&state)).collect(),
            order,
            counted: amounts.values().flatten().map(|a| a.1).collect(),
            lineage: lab.lineage.iter().map(|((m, _), state)| (*state, *m)).collect(),
            amounts,
            extensive,
        }
    }

    /// A value at a point of the plan; not a number where it depends on what only a run knows.
    pub fn value(&self, node: NodeId, world: &World) -> f64 {
        self.look(node, world, |_| false).0
    }

    /// Whether a condition holds at a point of the plan, if that is known there.
    pub fn truth(&self, node: NodeId, world: &World) -> Option<bool> {
        let (value, known) = self.look(node, world, |state| self.moving(state));
        known.then_some(value != 0.0)
    }

    /// The same, with the amounts that transfers have left, whatever has reacted since.
    pub fn nominal_truth(&self, node: NodeId, world: &World) -> Option<bool> {
        let (value, known) = self.look(node, world, |state| self.moving(state) && !self.counted.contains(&state));
        known.then_some(value != 0.0)
    }

    /// A value, and whether it is known: a comparison with what is not known is false, which says nothing.
    fn look(&self, node: NodeId, world: &World, moving: impl Fn(u32) -> bool) -> (f64, bool) {
        let leaf = |op: Op| match op {
            Op::Const(v) => v,
            Op::State(i) => world.states[i as usize],
            Op::Param(i) => self.params[i as usize],
            Op::Local(i) => world.locals.get(i as usize).copied().unwrap_or(f64::NAN),
            _ => f64::NAN,
        };
        let graph = &self.lab.graph;
        let (values, known) = &mut *self.values.borrow_mut();
        for n in self.cone(node).iter() {
            let op = graph.op(*n);
            let value = apply(op, leaf, |o| values[o.0 as usize]);
            let is_known = match op {
                Op::Const(_) => true,
                Op::State(i) => !value.is_nan() && !moving(i),
                Op::Time | Op::Reading(_) | Op::Local(_) | Op::Param(_) => !value.is_nan(),
                _ => op.operands().all(|o| known[o.0 as usize]),
            };
            (values[n.0 as usize], known[n.0 as usize]) = (value, is_known);
        }
        (values[node.0 as usize], known[node.0 as usize])
    }

    /// What a node depends on; found once.
    fn cone(&self, node: NodeId) -> Rc<[NodeId]> {
        let find = || self.lab.graph.schedule([node]).into();
        self.cones.borrow_mut()[node.0 as usize].get_or_insert_with(find).clone()
    }

    /// Whether time changes a state.
    fn moving(&self, state: u32) -> bool {
        self.moving.get(state as usize).copied().unwrap_or_default()
    }

    /// Sum of the masses in a mixture, kg.
    pub fn mass(&self, mixture: InstanceId, world: &World) -> f64 {
        let species = &self.lab.tables.species;
        let list = self.amounts.get(&mixture).map_or(&[][..], Vec::as_slice);
        list.iter().map(|(s, state)| world.states[*state as usize] * species.get(*s).molar_mass).sum()
    }
}
