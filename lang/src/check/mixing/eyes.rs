//! Values of the lab's expressions at a point of the plan, as far as they are known before the run.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::scene::InstanceId;
use matterix_ir::{Env, NodeId, Op, graph};

use super::world::World;
use crate::elaborate::{Elaborator, SpeciesId};

/// Evaluates nodes of the lab at states of the world.
pub struct Eyes<'l, 'a> {
    /// The lab.
    pub lab: &'l Elaborator<'a>,
    params: Vec<f64>,
    readings: Vec<f64>,
    values: RefCell<Vec<f64>>,
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
            readings: vec![f64::NAN; lab.readings.len()],
            values: RefCell::new(vec![0.0; lab.graph.ops().len()]),
            order,
            counted: amounts.values().flatten().map(|a| a.1).collect(),
            lineage: lab.lineage.iter().map(|((m, _), state)| (*state, *m)).collect(),
            amounts,
            extensive,
        }
    }

    /// A value at a point of the plan; not a number where it depends on what only a run knows.
    pub fn value(&self, node: NodeId, world: &World) -> f64 {
        let env = Env {
            time: f64::NAN,
            states: &world.states,
            params: &self.params,
            locals: &world.locals,
            readings: &self.readings,
        };
        let mut values = self.values.borrow_mut();
        for n in self.lab.graph.schedule([node]) {
            values[n.0 as usize] = graph::eval_op(self.lab.graph.op(n), env, &values);
        }
        values[node.0 as usize]
    }

    /// Whether a condition holds at a point of the plan, if that is known there.
    pub fn truth(&self, node: NodeId, world: &World) -> Option<bool> {
        self.truth_where(node, world, |state| self.moving(state))
    }

    /// The same, with the amounts that transfers have left, whatever has reacted since.
    pub fn nominal_truth(&self, node: NodeId, world: &World) -> Option<bool> {
        self.truth_where(node, world, |state| self.moving(state) && !self.counted.contains(&state))
    }

    fn truth_where(&self, node: NodeId, world: &World, moving: impl Fn(u32) -> bool) -> Option<bool> {
        // A comparison with what is not known is false, which says nothing.
        let unknown = |op: &Op| match op {
            Op::Time | Op::Reading(_) => true,
            Op::State(i) => world.states[*i as usize].is_nan() || moving(*i),
            Op::Local(i) => world.locals.get(*i as usize).is_none_or(|v| v.is_nan()),
            Op::Param(i) => self.params[*i as usize].is_nan(),
            _ => false,
        };
        (!self.lab.graph.depends(node, unknown)).then(|| self.value(node, world) != 0.0)
    }

    /// Whether time changes a state.
    fn moving(&self, state: u32) -> bool {
        self.lab.rates.contains_key(&state)
    }

    /// Sum of the masses in a mixture, kg.
    pub fn mass(&self, mixture: InstanceId, world: &World) -> f64 {
        let species = &self.lab.tables.species;
        let list = self.amounts.get(&mixture).map_or(&[][..], Vec::as_slice);
        list.iter().map(|(s, state)| world.states[*state as usize] * species.get(*s).molar_mass).sum()
    }
}
