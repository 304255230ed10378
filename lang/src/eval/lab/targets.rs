//! What states that hold an instance may point at: what they begin with, and what effects and events assign to them.
//!
//! A round of elaboration notes what is assigned. The next one begins with what was noted before: there a comparison with an instance
//! that a state never points at is false. One with the only instance that it ever points at stays a comparison, so that who reads a
//! condition still finds what it rests on. Rounds go on until what is noted is what was begun with.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::model::Domain;
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Op};
use rustc_hash::FxHashMap;

use super::Mode;
use super::{Elaborator, MemberKey};
use crate::ast::{MemberKind, Role};
use crate::declare::tables::MemberRef;
use crate::eval::Value;

/// Instances by their numbers; -1 is `nothing`.
pub type Numbers = BTreeSet<i64>;

/// What states that hold an instance may point at.
#[derive(Debug, Default)]
pub struct Targets {
    /// What was noted in this round, copied states included once they are closed.
    noted: BTreeMap<u32, Numbers>,
    /// Copies between such states: to, from.
    copies: BTreeSet<(u32, u32)>,
    /// Values that the plan keeps, with what they are taken from.
    kept: FxHashMap<NodeId, NodeId>,
    /// Those that may point at anything.
    anything: BTreeSet<u32>,
    /// What earlier rounds noted; a state that is not here may point at anything.
    known: FxHashMap<u32, Arc<Numbers>>,
    /// Who points at what by members of a name, as far as that was asked for.
    pointing: FxHashMap<Box<str>, Arc<Pointing>>,
}

/// The instances that may point at others by a member.
#[derive(Debug, Default)]
pub struct Pointing {
    /// By what they point at.
    pub at: FxHashMap<i64, Vec<InstanceId>>,
    /// Those of which it is not known.
    pub anywhere: Vec<InstanceId>,
}

impl Targets {
    /// Carries what states may point at along copies between them, until nothing changes.
    pub fn close(&mut self) {
        let mut to_of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (to, from) in &self.copies {
            to_of.entry(*from).or_default().push(*to);
        }
        let mut todo: Vec<u32> = to_of.keys().copied().collect();
        while let Some(from) = todo.pop() {
            let is_open = self.anything.contains(&from);
            let more = self.noted.get(&from).cloned().unwrap_or_default();
            for to in to_of.get(&from).into_iter().flatten() {
                let set = self.noted.entry(*to).or_default();
                let before = set.len();
                set.extend(&more);
                let changed = set.len() != before;
                if (is_open && self.anything.insert(*to)) || changed {
                    todo.push(*to);
                }
            }
        }
    }

    /// Notes that the plan keeps a value that holds an instance.
    pub fn keep(&mut self, kept: NodeId, from: NodeId) {
        self.kept.insert(kept, from);
    }

    /// What a state may point at, as far as this round found; nothing where that may be anything.
    pub fn noted(&self, state: u32) -> Option<&Numbers> {
        self.noted.get(&state).filter(|_| !self.anything.contains(&state))
    }

    /// What a state may point at, as earlier rounds found; nothing where that may be anything.
    pub fn known(&self, state: u32) -> Option<&Numbers> {
        self.known.get(&state).map(|known| &**known)
    }

    /// Takes what this round noted so far for what is known: the plan is lowered, and laws assign nothing.
    pub fn settle(&mut self) {
        self.known = self
            .noted
            .iter()
            .filter(|(s, _)| !self.anything.contains(s))
            .map(|(s, n)| (*s, Arc::new(n.clone())))
            .collect();
        self.pointing.clear();
    }
}

impl<'a> Elaborator<'a> {
    /// Notes what a state that holds an instance may come to point at.
    pub fn note_target(&mut self, state: u32, value: NodeId) {
        if self.states[state as usize].domain != Domain::Instance {
            return;
        }
        match self.graph.op(value) {
            Op::Const(v) => {
                self.targets.noted.entry(state).or_default().insert(v as i64);
            }
            Op::State(from) => {
                self.targets.copies.insert((state, from));
            }
            _ if self.picks.contains_key(&value) => {
                let picked = self.picks.get(&value).into_iter().flatten().map(|i| i64::from(i.0));
                // Beyond the ends of a list there is nothing.
                self.targets.noted.entry(state).or_default().extend(picked.chain([-1]));
            }
            Op::Select(_, a, b) => {
                self.note_target(state, a);
                self.note_target(state, b);
            }
            _ => match self.targets.kept.get(&value).copied() {
                Some(from) => self.note_target(state, from),
                None => drop(self.targets.anything.insert(state)),
            },
        }
    }

    /// Notes what states that hold an instance begin with, once all states are declared.
    pub(crate) fn note_first_targets(&mut self) {
        self.in_mode(Mode { at_start: true, ..self.mode() }, Self::note_first_values);
    }

    fn note_first_values(&mut self) {
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.all_members(id).iter().copied() {
                let MemberKind::Value { role: Role::State, name, .. } = &m.member.kind else { continue };
                let Some(state) = self.reference(id, m) else { continue };
                let value = self.member_value(id, m, name.span);
                match self.value_node(&value) {
                    Some(node) => self.note_target(state, node),
                    None => drop(self.targets.anything.insert(state)),
                }
            }
        }
    }

    /// The state of a member that holds an instance.
    fn reference(&self, id: InstanceId, m: MemberRef<'a>) -> Option<u32> {
        match self.instances[id.0 as usize].values.get(&MemberKey::of(m, Mode::default()))? {
            Value::InstanceNode(node) => match self.graph.op(*node) {
                Op::State(state) => Some(state),
                _ => None,
            },
            _ => None,
        }
    }

    /// Begins with what earlier rounds noted, by the names of states.
    pub(crate) fn foresee_targets(&mut self) {
        let reach = Arc::clone(&self.reach);
        let known = self.states.iter().enumerate().filter(|(_, s)| s.domain == Domain::Instance);
        self.targets.known =
            known.filter_map(|(i, s)| Some((i as u32, Arc::clone(reach.targets.get(&s.name)?)))).collect();
        self.targets.pointing.clear();
    }

    /// What was noted, by the names of states.
    pub(super) fn noted_targets(&self) -> BTreeMap<String, Arc<Numbers>> {
        let name = |state: u32| self.states[state as usize].name.clone();
        let known = self.targets.noted.keys().filter_map(|s| Some((*s, self.targets.noted(*s)?)));
        known.map(|(s, numbers)| (name(s), Arc::new(numbers.clone()))).collect()
    }

    /// Whether two nodes that hold instances never hold the same one, as far as is known of what states point at.
    pub(crate) fn never_the_same(&self, a: NodeId, b: NodeId) -> bool {
        if self.mode().at_start {
            return false;
        }
        let known = |node| match self.graph.op(node) {
            Op::State(state) => self.targets.known(state),
            _ => None,
        };
        match (known(a), known(b)) {
            (Some(a), Some(b)) => a.is_disjoint(b),
            (Some(all), None) => self.graph.constant(b).is_some_and(|v| !all.contains(&(v as i64))),
            (None, Some(all)) => self.graph.constant(a).is_some_and(|v| !all.contains(&(v as i64))),
            (None, None) => false,
        }
    }

    /// Who may point at what by members of a name.
    pub fn pointing(&mut self, member: &str) -> Arc<Pointing> {
        if let Some(known) = self.targets.pointing.get(member) {
            return Arc::clone(known);
        }
        let mut out = Pointing::default();
        for i in 0..self.instances.len() as u32 {
            let id = InstanceId(i);
            for m in self.members_of(id, member).iter().copied() {
                match self.points_at(id, m) {
                    Some(numbers) => numbers.iter().for_each(|n| out.at.entry(*n).or_default().push(id)),
                    None => out.anywhere.push(id),
                }
            }
        }
        let out = Arc::new(out);
        self.targets.pointing.insert(member.into(), Arc::clone(&out));
        out
    }

    /// What a member of an instance may point at, where that is known.
    pub fn points_at(&mut self, id: InstanceId, m: MemberRef<'a>) -> Option<Numbers> {
        let MemberKind::Value { role, .. } = &m.member.kind else { return None };
        match role {
            Role::State => self.targets.known(self.reference(id, m)?).cloned(),
            Role::Param => match self.instances[id.0 as usize].values.get(&MemberKey::of(m, Mode::default()))? {
                Value::Instance(i) => Some([i64::from(i.0)].into()),
                Value::Nothing => Some([-1].into()),
                _ => None,
            },
            _ => None,
        }
    }
}
