//! Combinations of instances, species and reactions that fit the parameters of a law, one after the other.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;

use crate::ast::{Expr, Name, Param};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::{Scope, Value};

/// The combinations that are still to come, the last parameter varying fastest.
pub(super) struct Tuples<'a> {
    params: &'a [Param],
    module: usize,
    name: &'a Name,
    /// What must hold of a combination.
    guard: Option<&'a Expr>,
    /// What each parameter may stand for; instances in their order.
    sets: Vec<Vec<Value>>,
    /// For each parameter up to one, what it may stand for after those before it, and how many of that were taken.
    open: Vec<(Vec<Value>, usize)>,
    /// Two parameters of which each pair of instances comes once.
    unordered: Option<(usize, usize)>,
    /// The mixtures of the last combination, and the species that can get into one of them.
    held: Option<(Vec<InstanceId>, BTreeSet<SpeciesId>)>,
    /// Whether a law without parameters is still to come.
    first: bool,
}

impl<'a> Tuples<'a> {
    pub(super) fn new(
        params: &'a [Param],
        (module, name): (usize, &'a Name),
        guard: Option<&'a Expr>,
        sets: Vec<Vec<Value>>,
        unordered: Option<(usize, usize)>,
    ) -> Self {
        Tuples { params, module, name, guard, sets, open: Vec::new(), unordered, held: None, first: true }
    }

    /// The next one as a scope, and the law with it in words; none after the last one, or where the task is given up.
    pub(super) fn next(&mut self, lab: &mut Elaborator<'a>) -> Option<(Scope, String)> {
        loop {
            let combination = self.advance(lab)?;
            if !lab.spend_on(self.name.span) {
                self.sets.clear();
                self.open.clear();
                return None;
            }
            if !self.fits(&combination, lab) {
                continue;
            }
            let mut scope = Scope::module(self.module);
            let mut shown = Vec::with_capacity(combination.len());
            for (param, value) in self.params.iter().zip(combination) {
                shown.push(lab.show(&value));
                scope.bind(param.name.text.clone(), value);
            }
            return Some((scope, format!("{}({})", self.name.text, shown.join(", "))));
        }
    }

    fn advance(&mut self, lab: &mut Elaborator<'a>) -> Option<Vec<Value>> {
        if std::mem::take(&mut self.first) {
            if self.sets.is_empty() {
                return Some(Vec::new());
            }
            self.open.push((self.narrowed(0, lab), 0));
        }
        loop {
            let (set, taken) = self.open.last_mut()?;
            if *taken == set.len() {
                self.open.pop();
                continue;
            }
            *taken += 1;
            if self.open.len() == self.sets.len() {
                return Some(self.taken().cloned().collect());
            }
            let set = self.narrowed(self.open.len(), lab);
            self.open.push((set, 0));
        }
    }

    /// What the parameters up to the last open one stand for.
    fn taken(&self) -> impl Iterator<Item = &Value> {
        self.open.iter().filter_map(|(set, taken)| set.get(taken.checked_sub(1)?))
    }

    /// What a parameter may stand for after those before it, as far as the form of the guard tells.
    fn narrowed(&self, parameter: usize, lab: &mut Elaborator<'a>) -> Vec<Value> {
        let set = &self.sets[parameter];
        let (Some(guard), Some(Value::Instance(_))) = (self.guard, set.first()) else { return set.clone() };
        let mut scope = Scope::module(self.module);
        for (param, value) in self.params.iter().zip(self.taken()) {
            scope.bind(param.name.text.clone(), value.clone());
        }
        // What is not bound yet hides what its name means elsewhere.
        for param in &self.params[parameter + 1..] {
            scope.bind(param.name.text.clone(), Value::Error);
        }
        match lab.candidates(guard, &self.params[parameter].name.text, &scope) {
            Some(those) => those.into_iter().filter(|i| self.has(parameter, *i)).map(Value::Instance).collect(),
            None => set.clone(),
        }
    }

    /// Whether what a law is about goes together: different instances, each pair of a symmetric relation once, and species and reactions
    /// that can get into one of the mixtures. There are many more species and reactions than any one mixture meets.
    fn fits(&mut self, combination: &[Value], lab: &Elaborator<'_>) -> bool {
        let instances: Vec<InstanceId> = combination.iter().filter_map(Value::instance).collect();
        if instances.iter().enumerate().any(|(i, id)| instances[..i].contains(id)) {
            return false;
        }
        if let Some((i, j)) = self.unordered
            && let (Some(a), Some(b)) = (combination[i].instance(), combination[j].instance())
            && self.has(j, a)
            && self.has(i, b)
            && !lab.goes_first(a, b)
        {
            return false;
        }
        if combination.len() == instances.len() {
            return true;
        }
        let mixtures: Vec<InstanceId> = instances.into_iter().filter(|id| lab.per_species(*id)).collect();
        if mixtures.is_empty() {
            return true;
        }
        let held = self.held(mixtures, lab);
        combination.iter().all(|value| match value {
            Value::Reaction(r) => lab.tables.reactions[r.0 as usize].reactants.iter().all(|(s, _)| held.contains(s)),
            Value::Species(s) => held.contains(s),
            _ => true,
        })
    }

    /// Whether a parameter may stand for an instance; those of a set are in their order.
    fn has(&self, parameter: usize, id: InstanceId) -> bool {
        has(&self.sets[parameter], id)
    }

    fn held(&mut self, mixtures: Vec<InstanceId>, lab: &Elaborator<'_>) -> &BTreeSet<SpeciesId> {
        if self.held.as_ref().is_none_or(|(of, _)| *of != mixtures) {
            let sets = mixtures.iter().filter_map(|id| lab.reach.set(&lab.instances[id.0 as usize].name));
            let all = sets.flatten().copied().collect();
            self.held = Some((mixtures, all));
        }
        &self.held.get_or_insert_default().1
    }
}

/// Whether a set of instances, which are in their order, has one.
pub(super) fn has(set: &[Value], id: InstanceId) -> bool {
    set.binary_search_by_key(&Some(id), Value::instance).is_ok()
}
