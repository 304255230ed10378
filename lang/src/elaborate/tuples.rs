//! Combinations of instances, species and reactions that fit the parameters of a law, one after the other.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;

use super::{Elaborator, SpeciesId};
use crate::ast::{Name, Param};
use crate::eval::{Scope, Value};

/// The combinations that are still to come, the last parameter varying fastest.
pub(super) struct Tuples<'a> {
    params: &'a [Param],
    module: usize,
    name: &'a Name,
    /// What each parameter may stand for.
    sets: Vec<Vec<Value>>,
    /// The next combination, by positions in `sets`; none after the last one.
    at: Option<Vec<usize>>,
    /// Each pair comes once, in the order of its instances.
    unordered: bool,
    /// Of a pair: its first by position, and the species that can get into it.
    held: Option<(usize, BTreeSet<SpeciesId>)>,
}

impl<'a> Tuples<'a> {
    pub(super) fn new(
        params: &'a [Param],
        module: usize,
        name: &'a Name,
        sets: Vec<Vec<Value>>,
        unordered: bool,
    ) -> Self {
        let at = sets.iter().all(|set| !set.is_empty()).then(|| vec![0; sets.len()]);
        Tuples { params, module, name, sets, at, unordered, held: None }
    }

    /// The next one as a scope, and the law with it in words; none after the last one, or where the task is given up.
    pub(super) fn next(&mut self, lab: &mut Elaborator<'a>) -> Option<(Scope, String)> {
        loop {
            let at = self.at.clone()?;
            self.advance();
            if !lab.spend_on(self.name.span) {
                self.at = None;
                return None;
            }
            if !self.fits(&at, lab) {
                continue;
            }
            let mut scope = Scope::module(self.module);
            let mut shown = Vec::with_capacity(at.len());
            for ((param, set), position) in self.params.iter().zip(&self.sets).zip(at) {
                shown.push(lab.show(&set[position]));
                scope.bind(param.name.text.clone(), set[position].clone());
            }
            return Some((scope, format!("{}({})", self.name.text, shown.join(", "))));
        }
    }

    fn advance(&mut self) {
        let Some(at) = &mut self.at else { return };
        for (position, set) in at.iter_mut().zip(&self.sets).rev() {
            *position += 1;
            if *position < set.len() {
                return;
            }
            *position = 0;
        }
        self.at = None;
    }

    /// Whether the second of a pair goes with its first: another instance, or what can be in it. There are many more species and reactions
    /// than any one mixture meets.
    fn fits(&mut self, at: &[usize], lab: &Elaborator<'_>) -> bool {
        let [first, second] = at else { return true };
        let Value::Instance(a) = self.sets[0][*first] else { return true };
        match self.sets[1][*second] {
            Value::Instance(b) if self.unordered && self.has(1, a) && self.has(0, b) => lab.goes_first(a, b),
            Value::Instance(b) => a != b,
            Value::Reaction(r) => {
                let held = self.held(*first, lab);
                lab.tables.reactions[r.0 as usize].reactants.iter().all(|(s, _)| held.contains(s))
            }
            Value::Species(s) => self.held(*first, lab).contains(&s),
            _ => true,
        }
    }

    /// Whether a parameter may stand for an instance; those of a set are in their order.
    fn has(&self, parameter: usize, id: InstanceId) -> bool {
        let instance = |v: &Value| if let Value::Instance(i) = v { Some(*i) } else { None };
        self.sets[parameter].binary_search_by_key(&Some(id), instance).is_ok()
    }

    fn held(&mut self, first: usize, lab: &Elaborator<'_>) -> &BTreeSet<SpeciesId> {
        let known = self.held.take().filter(|(of, _)| *of == first);
        let species = || match self.sets[0][first] {
            Value::Instance(a) => lab.reach.set(&lab.instances[a.0 as usize].name).cloned().unwrap_or_default(),
            _ => BTreeSet::new(),
        };
        &self.held.insert(known.unwrap_or_else(|| (first, species()))).1
    }
}
