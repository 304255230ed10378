//! What operations need and do.

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

use matterix_ir::model::{Action, Kept, SHARE_ROUNDING, Stays};
use matterix_ir::plan::{Condition, Operation, Presumption, StepId};
use matterix_ir::{BinaryOp, NodeId, Op, Severity};

use super::Interpreter;
use super::bonds::{Bonds, Form};
use super::cases;
use super::course::Course;
use super::held_back::Staying;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use crate::elaborate::mixtures::written;

/// Events that set each other off at one instant before the rest is left to the run.
const MOST_EVENTS: usize = 200;

/// Events that a run fires at one instant, and no more.
const MOST_AT_ONCE: usize = 1000;

/// Two mixtures are the same where the shares of their species differ by less than this, relative to the larger.
const SAME: f64 = 1e-9;

/// A transfer takes more than there is where its share is above 1 by more than this; closer to 1 it takes all.
const TOO_MUCH: f64 = 1e-9;

/// A share of which rounding alone parts it from all there is, as all.
fn whole(share: f64) -> f64 {
    if (share - 1.0).abs() <= TOO_MUCH { 1.0 } else { share }
}

/// How what a step asks for comes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// It holds, or may hold.
    Met,
    /// It fails for certain, which was reported.
    Unmet,
    /// It fails for certain, and a handler takes the failure: no way goes on here.
    Handled,
}

impl Interpreter<'_, '_> {
    /// Looks at needs. What a failed need that no handler takes looks at counts as unknown from here on, so that one mistake is
    /// one message.
    pub fn needs(&mut self, label: &str, needs: &[Arc<Condition>], facts: &mut AbstractState) -> Asked {
        for need in needs {
            let value = self.eval(need.node, facts);
            let truth = value.truth();
            self.judge(need.span, truth);
            if truth == Some(true) {
                continue;
            }
            let taken = self.is_taken(need.failure());
            match truth {
                // The step fails here: what it needs beyond does not matter any more.
                Some(_) => {
                    self.unless_taken(need.failure(), |flow| flow.unmet(label, need, facts, false));
                    return self.failed(need, facts, taken);
                }
                None => {
                    let paths = self.fails_on_a_way(need.node, facts);
                    let shared = self.is_shared(need.node);
                    if paths && self.is_cleared(need.span) {
                        self.assume(need.node, true, facts);
                    } else {
                        self.may_fail(need, paths && !shared, facts);
                        if paths && !shared && !taken {
                            self.unmet(label, need, facts, true);
                            self.go_on_after(need, facts);
                        } else if taken && !shared {
                            self.assume(need.node, true, facts);
                        } else if !taken && !shared {
                            self.leaves_open(need.node, (self.site(), need.span));
                        }
                    }
                }
            }
        }
        Asked::Met
    }

    /// A condition fails for certain: its failure goes to the handlers. What another branch changes may still make it hold.
    fn failed(&mut self, condition: &Condition, facts: &mut AbstractState, taken: bool) -> Asked {
        let shared = self.is_shared(condition.node);
        let mut failed = self.meanwhile_in(facts);
        failed.unsure |= shared;
        self.raise(condition.failure(), failed);
        if taken && !shared {
            return Asked::Handled;
        }
        let states = self.parts(condition.node).states.clone();
        self.forget(&states, facts);
        Asked::Unmet
    }

    /// Behind a finding on some ways those on which the condition holds go on, where ways are told apart; else what it looks at is unknown.
    fn go_on_after(&mut self, condition: &Condition, facts: &mut AbstractState) {
        if !self.choose_ways(condition.node, true, facts) {
            let states = self.parts(condition.node).states.clone();
            self.forget(&states, facts);
        }
    }

    /// What is known at some moment of the time that passes now.
    fn meanwhile_in(&self, facts: &AbstractState) -> AbstractState {
        let mut facts = facts.clone();
        if let Some(span) = &self.meanwhile {
            facts.time = span.clone();
        }
        facts
    }

    /// A condition fails on some ways, or perhaps: where something takes the failure, or what holds there is asked for, it goes there
    /// beside the way on which the condition holds.
    fn may_fail(&mut self, condition: &Condition, on_some: bool, facts: &AbstractState) {
        let name = condition.failure();
        if !self.is_taken(name) && self.notes.is_none() {
            return;
        }
        let mut facts = self.meanwhile_in(facts);
        if !self.is_shared(condition.node) {
            self.assume(condition.node, false, &mut facts);
        }
        facts.unsure |= !on_some;
        self.raise(name, facts);
    }

    /// Whether a condition that may hold is false on some way that leads here. Of an `and` one part decides, whatever is
    /// known of the others.
    fn fails_on_a_way(&mut self, node: NodeId, facts: &AbstractState) -> bool {
        let value = self.eval(node, facts);
        match self.lab.graph.op(node) {
            _ if value.truth().is_some() => false,
            Op::Binary(BinaryOp::And, a, b) => self.fails_on_a_way(a, facts) || self.fails_on_a_way(b, facts),
            _ => value.why() == Some(Imprecision::Paths),
        }
    }

    /// Looks at what a command presumes. Steps that clean up may do so in vain.
    fn presumptions(&mut self, label: &str, presumes: &[Presumption], facts: &mut AbstractState) {
        if self.cleaning > 0 {
            return;
        }
        for Presumption { condition, ever, warns } in presumes {
            let node = condition.node;
            let fails = self.eval(node, facts).truth() == Some(false) && !(*ever && facts.held.contains(&node));
            if fails && !self.is_shared(node) {
                self.in_vain(label, condition, facts, *warns);
                facts.held.insert(node);
            }
        }
    }

    /// Notes which presumed conditions hold, or may hold, after these states have changed.
    fn note_held(&mut self, states: &[u32], facts: &mut AbstractState) {
        let due: BTreeSet<NodeId> = states.iter().filter_map(|s| self.presumed_of.get(s)).flatten().copied().collect();
        for node in due {
            if self.eval(node, facts).truth() != Some(false) {
                facts.held.insert(node);
            }
        }
    }

    /// Whether a handler of the user's takes a failure by name.
    pub fn is_taken(&self, name: &str) -> bool {
        self.caught.iter().any(|net| net.takes(name))
    }

    /// Forgets states, and what depends on them.
    pub fn forget(&mut self, states: &[u32], facts: &mut AbstractState) {
        facts.forget(states);
        for s in states {
            self.touch(*s, facts);
        }
        self.note_held(states, facts);
    }

    /// Notes that a state has changed.
    pub(super) fn touch(&self, state: u32, facts: &mut AbstractState) {
        facts.reopen(|s| s == state);
        if let Some(rates) = self.rates_of.get(&state) {
            facts.unsettled.extend(rates);
        }
    }

    /// Changes states by the statement that is followed now.
    pub fn write(&mut self, changes: Vec<(u32, AbstractValue)>, facts: &mut AbstractState) -> Vec<u32> {
        let changed: Vec<u32> =
            changes.iter().filter(|(s, v)| facts.states[*s as usize] != *v).map(|(s, _)| *s).collect();
        for s in &changed {
            self.touch(*s, facts);
        }
        let written: Vec<u32> = changes.iter().map(|(state, _)| *state).collect();
        facts.rebind(|bonds, _| bonds.release(&written));
        facts.write(self.site(), changes);
        self.note_held(&changed, facts);
        changed
    }

    /// Performs actions in order, and the events they set off; how the limits of things come out then.
    pub fn perform(&mut self, actions: &[Action], facts: &mut AbstractState) -> Asked {
        let mut changed = Vec::new();
        for action in actions {
            changed.extend(self.act(action, facts));
        }
        let due = self.events_on(&changed);
        self.fire(due, facts);
        let limits = self.limits_that_ask_for(&changed);
        limits.iter().for_each(|limit| _ = facts.unkept.remove(limit));
        self.limits(limits, facts)
    }

    /// The limits that depend on these states.
    pub(super) fn limits_that_ask_for(&self, states: &[u32]) -> Vec<u32> {
        states.iter().filter_map(|s| self.limits_of.get(s)).flatten().copied().collect()
    }

    /// The limits that are passed already, behind a handler that took that: time that goes by does not break them once more.
    pub(super) fn passed_before(&mut self, facts: &AbstractState) -> BTreeSet<u32> {
        let limits = if self.limit_taken { 0..self.plan.limits.len() as u32 } else { 0..0 };
        let broken = |i: &u32| self.eval(self.plan.limits[*i as usize].condition.node, facts).truth() == Some(false);
        limits.filter(broken).collect()
    }

    /// Looks at limits after what they depend on has changed.
    pub fn limits(&mut self, mut due: Vec<u32>, facts: &mut AbstractState) -> Asked {
        let mut out = Asked::Met;
        due.sort_unstable();
        due.dedup();
        for i in due {
            let limit = &self.plan.limits[i as usize];
            let value = self.eval(limit.condition.node, facts);
            let condition = &limit.condition;
            let truth = value.truth();
            self.judge(condition.span, truth);
            if truth == Some(true) {
                continue;
            }
            let taken = self.is_taken(condition.failure());
            self.limit_taken |= taken;
            match truth {
                Some(_) => {
                    self.unless_taken(condition.failure(), |flow| flow.passed(limit, facts, false));
                    out = self.failed(condition, facts, taken);
                    if out == Asked::Handled {
                        return out;
                    }
                }
                None if self.is_cleared(condition.span) => {}
                None => {
                    let on_some = self.fails_on_a_way(condition.node, facts) && !self.is_shared(condition.node);
                    self.may_fail(condition, on_some, facts);
                    if on_some && !taken {
                        self.passed(limit, facts, true);
                        self.go_on_after(condition, facts);
                    } else if on_some {
                        self.assume(condition.node, true, facts);
                    } else if !taken && !self.is_shared(condition.node) {
                        self.leaves_open(condition.node, (self.site(), condition.span));
                    }
                }
            }
        }
        out
    }

    fn act(&mut self, action: &Action, facts: &mut AbstractState) -> Vec<u32> {
        match action {
            Action::Assign { state, value, .. } => {
                let told = self.by_case(*value, facts);
                let known = match &told {
                    Some((_, known)) => known.clone(),
                    None => self.eval(*value, facts),
                };
                let bonds =
                    facts.bonds.as_deref().cloned().zip(self.form_in(*value, facts)).map(|(mut bonds, form)| {
                        bonds.assigned(*state, &form, facts);
                        bonds
                    });
                let changed = self.write(vec![(*state, known)], facts);
                if let Some((values, _)) = told {
                    facts.tell(*state, values);
                }
                self.bind(bonds, facts);
                changed
            }
            Action::Move { fraction, but, from, to, .. } => {
                let kept = self.staying(but, facts);
                let share = self.eval(*fraction, facts);
                if share.bounds().1 > 1.0 + TOO_MUCH && share.bounds().0 <= 1.0 && !self.is_beside(*from) {
                    self.leaves_open(*fraction, (self.site(), self.site()));
                }
                let ends = if share.exact().is_none() { self.shares(*fraction, *from, facts) } else { None };
                let told = self.share_by_case(*fraction, &share, facts);
                self.transfer(&share, (ends, told, &kept), *from, *to, facts)
            }
        }
    }

    /// The shares that a transfer takes of the least and of the most that its source may hold, where the source holds one
    /// mixture of which only the whole amount is not known. Of each species it then takes what lies between the two: a volume
    /// that is drawn is that volume, however much there is.
    fn shares(&mut self, fraction: NodeId, from: u32, facts: &AbstractState) -> Option<[f64; 2]> {
        let held: Vec<(u32, [f64; 2])> = self.mixtures[from as usize]
            .iter()
            .filter(|(_, state)| self.amounts.contains(state))
            .map(|(_, state)| (*state, <[f64; 2]>::from(facts.states[*state as usize].bounds())))
            .filter(|(_, [_, most])| *most != 0.0)
            .collect();
        let (_, [least, most]) = *held.first()?;
        let alike = |[a, b]: [f64; 2]| a > 0.0 && b.is_finite() && (a * most - b * least).abs() <= SAME * b * most;
        if !held.iter().all(|(_, ends)| alike(*ends)) {
            return None;
        }
        let mut share = |end: usize| {
            let mut facts = facts.clone();
            held.iter().for_each(|(state, ends)| facts.states[*state as usize] = AbstractValue::Point(ends[end]));
            self.eval(fraction, &facts).exact().map(whole).filter(|share| (0.0..=1.0).contains(share))
        };
        Some([share(0)?, share(1)?])
    }

    fn transfer(
        &mut self,
        fraction: &AbstractValue,
        (ends, told, kept): (Option<[f64; 2]>, Option<Vec<f64>>, &[Staying]),
        from: u32,
        to: u32,
        facts: &mut AbstractState,
    ) -> Vec<u32> {
        let (low, high) = fraction.bounds();
        if low > 1.0 + TOO_MUCH || high < 0.0 {
            self.too_much(from as usize, low, false);
        } else if high > 1.0 + TOO_MUCH && fraction.why() == Some(Imprecision::Paths) && !self.is_beside(from) {
            self.too_much(from as usize, high, true);
        }
        let fraction = match fraction.exact() {
            Some(f) => AbstractValue::Point(whole(f.clamp(0.0, 1.0))),
            None => match fraction {
                AbstractValue::Few(all, why) if low >= 0.0 && high <= 1.0 + TOO_MUCH => {
                    AbstractValue::of(all.iter().map(|f| whole(*f)).collect(), *why)
                }
                _ => AbstractValue::Range(
                    low.clamp(0.0, 1.0),
                    high.clamp(0.0, 1.0),
                    fraction.why().unwrap_or(Imprecision::Unknown),
                ),
            },
        };
        let told: Option<Vec<f64>> = told.map(|all| all.into_iter().map(|f| whole(f.clamp(0.0, 1.0))).collect());
        let mut changes = Vec::new();
        let mut by_case = Vec::new();
        for (source, target) in self.passages.between(from, to, &self.mixtures).iter() {
            let stays = kept.iter().find(|kept| kept.state == *source);
            let of_all = stays.map_or(Some(1.0), Staying::leaving);
            let Some(target) = *target else {
                if of_all == Some(0.0) {
                    continue;
                }
                self.no_place(*source, from, to, &fraction, facts);
                continue;
            };
            if target == *source {
                continue;
            }
            // What stays, on each way the same share, leaves so much less of the share that is taken.
            let apart = told.as_ref().zip(of_all).and_then(|(shares, leaving)| {
                let shares: Vec<f64> = shares.iter().map(|share| share * leaving).collect();
                cases::moved(&shares, *source, target, facts)
            });
            if let Some([rest, more]) = apart {
                let ends = [*source, target].map(|state| facts.states[state as usize].why());
                let why = ends.into_iter().chain([fraction.why()]).flatten().max().unwrap_or(Imprecision::Paths);
                for (state, values) in [(*source, rest), (target, more)] {
                    changes.push((state, AbstractValue::of(values.clone(), why)));
                    by_case.push((state, values));
                }
                continue;
            }
            let held = &facts.states[*source as usize];
            let by_ends = ends.filter(|_| self.amounts.contains(source)).zip(of_all);
            let (moved, rest) = match by_ends {
                Some(([of_least, of_most], leaving)) => {
                    let (of_least, of_most) = (of_least * leaving, of_most * leaving);
                    let (least, most) = held.bounds();
                    let rest = held.with_ends((1.0 - of_least) * least, (1.0 - of_most) * most);
                    (held.with_ends(of_least * least, of_most * most), rest)
                }
                None if stays.is_some() => {
                    stays.map_or((AbstractValue::Point(0.0), held.clone()), |s| s.part(&fraction, held))
                }
                None => {
                    // A share of what is there leaves the rest: exact where the share is.
                    let kept = match fraction.exact() {
                        Some(f) => AbstractValue::Point(1.0 - f),
                        None => AbstractValue::binary(BinaryOp::Sub, &AbstractValue::Point(1.0), &fraction),
                    };
                    (
                        AbstractValue::binary(BinaryOp::Mul, &fraction, held),
                        AbstractValue::binary(BinaryOp::Mul, &kept, held),
                    )
                }
            };
            let more = AbstractValue::binary(BinaryOp::Add, &facts.states[target as usize], &moved);
            changes.extend([(*source, rest), (target, more)]);
        }
        // What is held back breaks the proportion by which bonds follow a transfer: what hung together there is known by itself only.
        let bonds = facts.bonds.as_deref().cloned().filter(|_| kept.is_empty()).map(|mut bonds| {
            let ways = self.passages.between(from, to, &self.mixtures);
            bonds.transferred(&fraction, &ways, facts);
            bonds
        });
        let changed = self.write(changes, facts);
        by_case.into_iter().for_each(|(state, values)| facts.tell(state, values));
        self.bind(bonds, facts);
        changed
    }

    /// What a transfer leaves behind, as far as that is known; a share out of range is reported.
    fn staying(&mut self, but: &[Kept], facts: &AbstractState) -> Vec<Staying> {
        let mut out = Vec::with_capacity(but.len());
        for kept in but {
            let value = self.eval(kept.stays.source(), facts);
            let share = matches!(kept.stays, Stays::Share(_));
            let (low, high) = value.bounds();
            if share && (low > 1.0 + SHARE_ROUNDING || high < -SHARE_ROUNDING) {
                self.no_share_to_keep(kept.state, if high < 0.0 { high } else { low });
            } else if share && (low < -SHARE_ROUNDING || high > 1.0 + SHARE_ROUNDING) {
                self.leaves_open(kept.stays.source(), (self.site(), self.site()));
            }
            out.push(Staying { state: kept.state, share, value });
        }
        out
    }

    /// Whether what goes on beside changes what a mixture holds.
    fn is_beside(&self, mixture: u32) -> bool {
        let changes = |set: &BTreeSet<u32>| self.mixtures[mixture as usize].iter().any(|(_, s)| set.contains(s));
        self.shared.iter().chain(self.of_jobs()).any(changes)
    }

    /// A node as a sum of states, where some states hang together.
    fn form_in(&mut self, node: NodeId, facts: &AbstractState) -> Option<Rc<Form>> {
        facts.bonds.as_ref()?;
        self.form(node)
    }

    /// States hang together so from now on.
    fn bind(&self, bonds: Option<Bonds>, facts: &mut AbstractState) {
        if let Some(mut bonds) = bonds {
            bonds.stamp(facts);
            facts.bonds = Some(Rc::new(bonds)).filter(|bonds| !bonds.is_empty());
        }
    }

    /// Fires those of the events that became true, and what they set off, until none does.
    pub fn fire(&mut self, mut due: Vec<u32>, facts: &mut AbstractState) {
        let (mut sure, mut last) = (true, None);
        for round in 0..MOST_AT_ONCE {
            if round >= MOST_EVENTS && !sure {
                break;
            }
            due.sort_unstable();
            due.dedup();
            let mut next = Vec::new();
            for i in std::mem::take(&mut due) {
                let event = &self.events[i as usize];
                let now = self.eval(event.when, facts).truth();
                let before = std::mem::replace(&mut facts.fired[i as usize], now);
                if now == Some(false) || (now == Some(true) && before == Some(true)) {
                    continue;
                }
                sure &= (now, before) == (Some(true), Some(false));
                last = Some(i);
                let untouched = facts.clone();
                let changed = self.happen(i, facts);
                if (now, before) != (Some(true), Some(false)) {
                    let happened = facts.clone();
                    *facts = untouched.join(happened, &untouched, self.site(), Imprecision::Unknown);
                }
                facts.fired[i as usize] = self.eval(event.when, facts).truth();
                next.extend(self.events_on(&changed));
                // What may happen over and over is not followed further.
                if now.is_none() {
                    next.retain(|n| *n != i);
                }
            }
            if next.is_empty() {
                return;
            }
            due = next;
        }
        match last.filter(|_| sure) {
            Some(event) => self.cascades(event),
            None => self.cascades_perhaps(),
        }
        let changed: BTreeSet<u32> =
            due.iter().flat_map(|i| self.changed_by(&self.events[*i as usize].actions)).collect();
        self.forget(&changed.into_iter().collect::<Vec<_>>(), facts);
    }

    fn cascades_perhaps(&mut self) {
        let headline = format!("events trigger each other more than {MOST_EVENTS} times");
        self.not_analysed(Severity::Advice, headline, "the values that they change are unknown from here on");
    }

    /// Does what an event does; the states that are no longer what they were.
    pub fn happen(&mut self, event: u32, facts: &mut AbstractState) -> Vec<u32> {
        let events = self.events;
        let after = self.meanwhile.clone().map(|span| std::mem::replace(&mut facts.time, span));
        let changed: Vec<u32> =
            events[event as usize].actions.iter().flat_map(|action| self.act(action, facts)).collect();
        if let Some(after) = after {
            facts.time = after;
        }
        facts.unkept.extend(self.limits_that_ask_for(&changed));
        changed
    }

    /// The events that look at any of these states.
    pub fn events_on(&self, states: &[u32]) -> Vec<u32> {
        states.iter().filter_map(|s| self.events_of.get(s)).flatten().copied().collect()
    }

    /// Follows a command or a primitive skill; nothing where it fails for certain and a handler takes that.
    pub fn operation(
        &mut self,
        id: StepId,
        label: &str,
        operation: &Operation,
        mut facts: AbstractState,
    ) -> Option<AbstractState> {
        self.presumptions(label, &operation.presumes, &mut facts);
        let met = match self.needs(label, &operation.needs, &mut facts) {
            Asked::Handled => return None,
            asked => asked == Asked::Met,
        };
        self.come_to(id);
        let began = facts.time.clone();
        if !met {
            // Said already: what it would have done is not known.
            let written: Vec<u32> = written(operation, &self.mixtures).collect();
            self.forget(&written, &mut facts);
        }
        // How long it takes follows from what it finds, not from what it does.
        let lasts = match (&operation.takes, &operation.until) {
            (Some(takes), None) => Some(self.duration(takes.nominal, &facts)),
            _ => None,
        };
        let lasts = lasts.filter(|time| met || time.bounds().0.is_finite());
        self.quiet += usize::from(!met);
        if met && self.perform(&operation.at_start, &mut facts) == Asked::Handled {
            return None;
        }
        let others = self.claimed.len();
        self.claimed.extend(&operation.claims);
        match (lasts, &operation.until) {
            (_, Some(until)) => {
                let node = until.node;
                let value = self.eval(node, &facts);
                if value.truth() != Some(true) {
                    self.stopped_meanwhile(until, f64::INFINITY, &facts);
                    let begun = facts.time.bounds().0;
                    if matches!(self.course(f64::INFINITY, &[(node, true)], &mut facts), Course::Reached(_)) {
                        // Others that run meanwhile may end it earlier or later.
                        if self.flows_beside() {
                            facts.time = AbstractValue::Range(begun, f64::INFINITY, Imprecision::Unknown);
                        }
                    } else {
                        self.pass(&AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown), &mut facts);
                        self.assume(node, true, &mut facts);
                    }
                    self.waits_against_keep(label, until, &facts);
                }
            }
            (Some(time), None) => self.pass(&time, &mut facts),
            (None, None) => {}
        }
        self.still_goes_on(label, &mut facts);
        self.claimed.truncate(others);
        self.quiet -= usize::from(!met);
        if met {
            if self.perform(&operation.at_end, &mut facts) == Asked::Handled {
                return None;
            }
            self.note_change(operation, &began, &facts);
            self.still_kept(label, &facts);
        }
        Some(facts)
    }
}
