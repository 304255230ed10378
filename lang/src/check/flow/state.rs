//! What is known at one point of the plan, and how it came to be.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::pages::Pages;
use matterix_ir::{NodeId, Span};

use super::bonds::Bonds;
use super::cases::Cases;
use super::evolve::InvariantBox;
use super::value::{AbstractValue, Imprecision};

/// One change on the way to a point of the plan.
#[derive(Debug)]
pub struct Event {
    /// The statement that made it.
    pub span: Span,
    /// The states it changed, with what they were before.
    pub before: Vec<(u32, AbstractValue)>,
    /// What happened earlier.
    pub earlier: History,
}

/// The way to a point of the plan, the latest change first.
pub type History = Option<Rc<Event>>;

/// A condition that only a run can tell, as it came out.
#[derive(Clone, Debug, PartialEq)]
pub struct Decided {
    /// The condition.
    pub node: NodeId,
    /// Whether it held.
    pub holds: bool,
    /// The states it depends on, by index.
    pub states: Rc<[u32]>,
    /// The kept values it depends on, by index.
    pub locals: Rc<[u32]>,
}

/// What is known at one point of the plan.
#[derive(Clone, Debug)]
pub struct AbstractState {
    /// By state index, SI.
    pub states: Pages<AbstractValue>,
    /// By local index, SI.
    pub locals: Vec<AbstractValue>,
    /// Seconds since the run began.
    pub time: AbstractValue,
    /// How it came to be.
    pub history: History,
    /// Derivatives that may have changed since time last passed, by index.
    pub unsettled: BTreeSet<u32>,
    /// Limits on what events have changed since time last passed, by index: they are judged as it passes.
    pub unkept: BTreeSet<u32>,
    /// Derivatives that are not known to be zero, by index.
    pub moving: BTreeSet<u32>,
    /// Bounds of what moves for all time to come, while nothing else changes.
    pub barrier: Option<Rc<InvariantBox>>,
    /// How states hang together that laws change.
    pub bonds: Option<Rc<Bonds>>,
    /// Which values states have together, where few ways lead here.
    pub cases: Option<Rc<Cases>>,
    /// By event index: whether its condition held when it was last looked at.
    pub fired: Vec<Option<bool>>,
    /// Presumed conditions that have held at some moment, or may have.
    pub held: BTreeSet<NodeId>,
    /// Conditions that only a run can tell, as they came out on this way.
    pub decided: Vec<Decided>,
    /// Where the text writes the failure that was raised on this way.
    pub written: Option<Span>,
    /// Whether only a run can tell that this way is taken.
    pub unsure: bool,
    /// States that other branches may have changed partway when a failure stopped them.
    pub blurred: Option<Rc<BTreeSet<u32>>>,
    /// Jobs that have begun by now, and whether they have on every way.
    pub begun: BTreeMap<String, bool>,
}

impl AbstractState {
    /// These values at this time, s, and nothing else that is known.
    pub fn new(states: Pages<AbstractValue>, locals: Vec<AbstractValue>, time: AbstractValue) -> Self {
        AbstractState {
            states,
            locals,
            time,
            history: None,
            unsettled: BTreeSet::new(),
            unkept: BTreeSet::new(),
            moving: BTreeSet::new(),
            barrier: None,
            bonds: None,
            cases: None,
            fired: Vec::new(),
            held: BTreeSet::new(),
            decided: Vec::new(),
            written: None,
            unsure: false,
            blurred: None,
            begun: BTreeMap::new(),
        }
    }

    /// Sets states, noting what they were.
    pub fn write(&mut self, span: Span, changes: Vec<(u32, AbstractValue)>) {
        self.untell(changes.iter().map(|(state, _)| *state));
        let mut before = Vec::with_capacity(changes.len());
        for (state, value) in changes {
            let place = &mut self.states[state as usize];
            if *place != value {
                before.push((state, std::mem::replace(place, value)));
            }
        }
        if before.is_empty() {
            return;
        }
        // The changes of one statement are one event.
        if let Some(last) = &mut self.history
            && last.span == span
            && let Some(last) = Rc::get_mut(last)
        {
            for (state, value) in before {
                if !last.before.iter().any(|(s, _)| *s == state) {
                    last.before.push((state, value));
                }
            }
            return;
        }
        let earlier = self.history.take();
        self.history = Some(Rc::new(Event { span, before, earlier }));
    }

    /// Conditions that depend on these states are open again.
    pub fn reopen(&mut self, changed: impl Fn(u32) -> bool) {
        self.decided.retain(|d| !d.states.iter().any(|s| changed(*s)));
    }

    /// Keeps a value; conditions that depend on the one before are open again.
    pub fn keep(&mut self, local: u32, value: AbstractValue) {
        self.locals[local as usize] = value;
        self.decided.retain(|d| !d.locals.contains(&local));
    }

    /// Changes how states hang together; nothing is done where none do.
    pub fn rebind(&mut self, how: impl FnOnce(&mut Bonds, &AbstractState)) {
        let Some(mut bonds) = self.bonds.take() else { return };
        how(Rc::make_mut(&mut bonds), self);
        self.bonds = Some(bonds).filter(|bonds| !bonds.is_empty());
    }

    /// Whether a state hangs together with others.
    pub fn hangs(&self, state: u32) -> bool {
        self.bonds.as_ref().is_some_and(|bonds| bonds.states.contains_key(&state))
    }

    /// Sets what is known of a state where how it hangs together with others stays.
    pub fn set(&mut self, state: u32, known: AbstractValue) {
        if self.hangs(state) {
            let now = known.clone();
            self.rebind(|bonds, _| {
                if let Some(bond) = bonds.states.get_mut(&state) {
                    bond.known = now;
                }
            });
        }
        self.states[state as usize] = known;
    }

    /// More is known of a state, which has not changed.
    pub fn narrow(&mut self, state: u32, known: AbstractValue) {
        let before = std::mem::replace(&mut self.states[state as usize], known.clone());
        let hangs = |bonds: &Rc<Bonds>| bonds.states.get(&state).is_some_and(|bond| bond.known.is(&before));
        if self.bonds.as_ref().is_some_and(hangs) {
            self.set(state, known);
        }
    }

    /// Forgets states that only a run can tell.
    pub fn forget(&mut self, states: &[u32]) {
        self.rebind(|bonds, _| bonds.release(states));
        for state in states {
            self.states[*state as usize] = AbstractValue::top();
        }
    }

    /// Whether a job has begun on every way.
    fn has_begun(&self, job: &str) -> bool {
        self.begun.get(job) == Some(&true)
    }

    /// What is known whichever of two ways was taken from `self`; `span` is the statement that parts them.
    pub fn join(&self, a: AbstractState, b: &AbstractState, span: Span, why: Imprecision) -> AbstractState {
        let mut out = self.clone();
        let why = if a.unsure || b.unsure { Imprecision::Unknown } else { why };
        out.unsure = a.unsure && b.unsure;
        out.blurred = match (&a.blurred, &b.blurred) {
            (Some(one), Some(other)) if !Rc::ptr_eq(one, other) => Some(Rc::new(one.union(other).copied().collect())),
            (one, other) => one.clone().or_else(|| other.clone()),
        };
        let mut changes: Vec<(Span, Vec<(u32, AbstractValue)>)> = Vec::new();
        let mut open: Vec<u32> = Vec::new();
        for (i, (x, y)) in a.states.iter().zip(b.states.iter()).enumerate() {
            let both = x.join(y, why);
            if both.exact().is_none() {
                open.push(i as u32);
            }
            if both == self.states[i] {
                continue;
            }
            let state = i as u32;
            let maker = changed_by(&a.history, &self.history, state).or(changed_by(&b.history, &self.history, state));
            let maker = maker.unwrap_or(span);
            match changes.iter_mut().find(|(s, _)| *s == maker) {
                Some((_, list)) => list.push((state, both)),
                None => changes.push((maker, vec![(state, both)])),
            }
        }
        changes.sort_by_key(|(s, _)| *s);
        for (maker, list) in changes {
            out.write(maker, list);
        }
        out.cases = Cases::join(&a, b, &open, &mut out, why);
        out.locals = a.locals.iter().zip(&b.locals).map(|(x, y)| x.join(y, why)).collect();
        out.time = a.time.join(&b.time, Imprecision::Unknown);
        out.unsettled.extend(a.unsettled.iter().chain(&b.unsettled));
        out.unkept.extend(a.unkept.iter().chain(&b.unkept));
        out.moving.extend(a.moving.iter().chain(&b.moving));
        out.barrier = None;
        out.bonds = match (&a.bonds, &b.bonds) {
            (None, None) => None,
            (Some(one), Some(other)) if Rc::ptr_eq(one, other) && one.all_hold(&out) => Some(one.clone()),
            _ => Bonds::join(&a, b, &out, why),
        };
        out.held.extend(a.held.iter().chain(&b.held));
        out.written = a.written.or(b.written);
        out.begun = a
            .begun
            .keys()
            .chain(b.begun.keys())
            .map(|job| (job.clone(), a.has_begun(job) && b.has_begun(job)))
            .collect();
        out.decided = a.decided.into_iter().filter(|d| b.decided.contains(d)).collect();
        out
    }
}

/// Whether nothing was written between two histories.
pub fn same_history(one: &History, other: &History) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => Rc::ptr_eq(one, other),
        _ => false,
    }
}

/// The latest statement since `base` that changed a state.
pub(super) fn changed_by(history: &History, base: &History, state: u32) -> Option<Span> {
    let mut at = history.as_ref();
    while let Some(event) = at {
        if base.as_ref().is_some_and(|b| Rc::ptr_eq(b, event)) {
            return None;
        }
        if event.before.iter().any(|(s, _)| *s == state) {
            return Some(event.span);
        }
        at = event.earlier.as_ref();
    }
    None
}
