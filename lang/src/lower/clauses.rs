//! Clauses of commands as they came out before. A clause depends on the device and on those arguments that it reads, so
//! that what a pipette needs of a well is evaluated once, however often and with whatever volume it goes there.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use matterix_ir::Span;
use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Motion, Takes};
use matterix_ir::scene::InstanceId;
use rustc_hash::{FxHashMap, FxHasher};

use super::Planner;
use crate::ast::Clause;
use crate::eval::{Scope, Value};

/// What comes of a clause.
#[derive(Clone)]
pub(super) enum Outcome {
    Condition(Arc<Condition>),
    Takes(Takes),
    Effect(Vec<Action>),
    Motion(Motion),
}

/// Outcomes for different arguments that read the same ones of them; a hash of their values leads to the candidates.
type Outcomes = FxHashMap<u64, Vec<(Vec<Value>, Outcome)>>;

/// A clause and the device whose command it belongs to.
type Key = (Span, Option<InstanceId>);

/// Outcomes by clause and device, then by which arguments were read.
#[derive(Default)]
pub(super) struct Clauses {
    known: FxHashMap<Key, Vec<(u64, Outcomes)>>,
}

impl Clauses {
    fn find(&self, key: Key, scope: &Scope) -> Option<&Outcome> {
        self.known.get(&key)?.iter().find_map(|(reads, outcomes)| {
            let candidates = outcomes.get(&hash(arguments(scope, *reads)))?;
            candidates.iter().find(|(values, _)| arguments(scope, *reads).eq(values)).map(|(_, outcome)| outcome)
        })
    }

    fn keep(&mut self, key: Key, scope: &Scope, reads: u64, outcome: Outcome) {
        let all = self.known.entry(key).or_default();
        let index = all.iter().position(|(r, _)| *r == reads).unwrap_or_else(|| {
            all.push((reads, Outcomes::default()));
            all.len() - 1
        });
        let values: Vec<Value> = arguments(scope, reads).cloned().collect();
        all[index].1.entry(hash(values.iter())).or_default().push((values, outcome));
    }
}

/// The arguments that were read.
fn arguments(scope: &Scope, reads: u64) -> impl Iterator<Item = &Value> {
    scope.vars.iter().enumerate().filter(move |(i, _)| reads & Scope::read_bit(*i) != 0).map(|(_, (_, value))| value)
}

/// A hash that tells apart most of what differs.
fn hash<'v>(values: impl Iterator<Item = &'v Value>) -> u64 {
    let mut hasher = FxHasher::default();
    values.for_each(|value| hash_into(value, &mut hasher));
    hasher.finish()
}

fn hash_into(value: &Value, hasher: &mut FxHasher) {
    match value {
        Value::Num(n) => n.node.hash(hasher),
        Value::Bool(n) | Value::Enum(n, _) | Value::InstanceNode(n) => n.hash(hasher),
        Value::Range(from, to) => (from.node, to.node).hash(hasher),
        Value::Instance(i) | Value::Qualified(i, _) | Value::Grid(i, _) => i.hash(hasher),
        Value::Species(s) | Value::Concentration(_, s) => s.hash(hasher),
        Value::Row(_, row) => row.hash(hasher),
        Value::Place(place) => place.text.hash(hasher),
        Value::Text(text) | Value::Included(text) | Value::Frame(_, text) => text.hash(hasher),
        Value::Tuple(values) | Value::List(values) => values.iter().for_each(|v| hash_into(v, hasher)),
        _ => {}
    }
}

impl<'a> Planner<'a, '_> {
    /// What comes of a clause whose arguments are bound in `scope`: as `make` gives it, or as it did before. What gives
    /// rise to a finding is made anew each time, as the finding may say where.
    pub(super) fn outcome(
        &mut self,
        clause: &'a Clause,
        scope: &mut Scope,
        make: impl FnOnce(&mut Self, &mut Scope) -> Option<Outcome>,
    ) -> Option<Outcome> {
        let key = (clause.span, scope.this);
        if let Some(known) = self.clauses.find(key, scope) {
            return Some(known.clone());
        }
        let reported = self.lab.reported;
        scope.reads.set(0);
        let outcome = make(self, scope)?;
        if self.lab.reported == reported {
            self.clauses.keep(key, scope, scope.reads.get(), outcome.clone());
        }
        Some(outcome)
    }
}
