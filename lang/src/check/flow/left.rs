//! What is left on, or in hand, at the end of some way that the text writes: a branch that is not taken, a handler, a `fail` or a
//! written timeout that nothing takes.
//!
//! Where ways meet, it is known only that one of them left a thing so. Such a way is followed alone to the end, and where it meets
//! others again, that of those on which the thing stays so: what is told has a way of its own. Conditions that were decided on it stay
//! decided, so that `if hot { heat }` and `if hot { stop }` go together.

use std::collections::BTreeMap;

use matterix_ir::plan::{Limit, StepId};
use matterix_ir::{Diagnostic, Span};

use super::Flow;
use super::facts::Facts;

/// So many meetings of one way are followed before it is taken for one that can be gone.
const DEEPEST: usize = 12;

/// So many steps are followed again in all for ways that leave something on.
const MOST_STEPS: usize = 400_000;

/// Meetings of ways that differ in what should hold at the end.
#[derive(Clone, Debug, Default)]
pub(super) struct Forks {
    /// How many there were by now.
    met: usize,
    /// Which way is followed alone, by the number of the meeting.
    chosen: BTreeMap<usize, usize>,
    /// Ways on which something is not in order, and those on which that is not known.
    off: Vec<Fork>,
    /// What is not known at the end to be in order, by index into the plan's `ends`.
    open: Vec<usize>,
    /// What is known at the end not to be in order, with its finding.
    left: BTreeMap<usize, Diagnostic>,
}

/// One of several ways that met.
#[derive(Clone, Copy, Debug)]
struct Fork {
    end: usize,
    number: usize,
    way: usize,
    span: Span,
    /// Whether the thing is known to be left so.
    sure: bool,
}

impl Flow<'_, '_> {
    /// The way that is followed alone of those that meet here, if they differ in what should hold at the end.
    pub(super) fn fork(&mut self, id: StepId, ways: &[Facts]) -> Option<usize> {
        let plan = self.plan;
        let mut off = Vec::new();
        for (end, limit) in plan.ends.iter().enumerate() {
            let states = self.parts(limit.condition.node).states.clone();
            let same = |two: &[Facts]| states.iter().all(|s| two[0].states[*s as usize] == two[1].states[*s as usize]);
            if ways.windows(2).all(same) {
                continue;
            }
            let holds: Vec<Option<bool>> =
                ways.iter().map(|facts| self.eval(limit.condition.node, facts).truth()).collect();
            if holds.windows(2).all(|two| two[0] == two[1]) {
                continue;
            }
            let (number, span) = (self.forks.met, plan.get(id).span);
            let not_in_order = holds.iter().enumerate().filter(|(_, holds)| **holds != Some(true));
            off.extend(not_in_order.map(|(way, holds)| Fork { end, number, way, span, sure: holds.is_some() }));
        }
        if off.is_empty() {
            return None;
        }
        self.forks.off.extend(off);
        self.forks.met += 1;
        self.forks.chosen.get(&(self.forks.met - 1)).copied().filter(|way| *way < ways.len())
    }

    /// Looks at what should hold at the end and held at the start.
    pub(super) fn ends(&mut self, begun: &Facts, ended: &Facts) {
        let plan = self.plan;
        for (index, end) in plan.ends.iter().enumerate() {
            if !self.began_right(end, begun) {
                continue;
            }
            match self.eval(end.condition.node, ended).truth() {
                Some(true) => {}
                None => self.forks.open.push(index),
                Some(false) => {
                    if let Some(d) = self.unfinished(end, ended, "ends") {
                        self.forks.left.insert(index, d.clone());
                        self.found(d, end.condition.span);
                    }
                }
            }
        }
    }

    /// Looks at the same where a `fail` or a written timeout that nothing takes ends the workflow.
    pub(super) fn ends_failed(&mut self, begun: &Facts, raised: &[super::Raised]) {
        let plan = self.plan;
        for (name, facts) in raised {
            let Some(span) = facts.written else { continue };
            for (index, end) in plan.ends.iter().enumerate() {
                let known = self.forks.left.contains_key(&index) || !self.began_right(end, begun);
                if known || self.eval(end.condition.node, facts).truth() != Some(false) {
                    continue;
                }
                let Some(d) = self.unfinished(end, facts, &format!("can end with `{name}`")) else { continue };
                let d = d.because(span, format!("`{name}` ends the workflow here, and nothing handles it"));
                self.forks.left.insert(index, d.clone());
                self.found(d, end.condition.span);
            }
        }
    }

    fn began_right(&mut self, end: &Limit, begun: &Facts) -> bool {
        self.eval(end.condition.node, begun).truth() == Some(true)
    }
}

/// Finds the ways that leave something as it should not be; `begin` gives a flow that was not followed yet.
pub(super) fn on_some_way<'l, 'a>(flow: &mut Flow<'l, 'a>, begin: &impl Fn() -> Flow<'l, 'a>) {
    let mut left = MOST_STEPS;
    for end in std::mem::take(&mut flow.forks.open) {
        let about = flow.plan.ends[end].condition.span;
        let Some((mut d, way)) = way_to(flow, begin, end, &mut left) else { continue };
        d.headline = d.headline.replacen(" ends, and", " can end, and", 1);
        for span in way.into_iter().filter(|span| !flow.in_library(*span)) {
            if !d.labels.iter().any(|l| l.span == span) {
                d = d.because(span, "one of the ways through this leads there");
            }
        }
        flow.forks.left.insert(end, d.clone());
        flow.found(d, about);
    }
}

/// A way on which something is left so, with the statements at which it parts from others.
fn way_to<'l, 'a>(
    flow: &Flow<'l, 'a>,
    begin: &impl Fn() -> Flow<'l, 'a>,
    end: usize,
    left: &mut usize,
) -> Option<(Diagnostic, Vec<Span>)> {
    let chosen = &flow.forks.chosen;
    let after = chosen.keys().next_back().map_or(0, |last| last + 1);
    let mut ways: Vec<Fork> = flow.forks.off.iter().filter(|f| f.end == end && f.number >= after).copied().collect();
    // The latest meeting decides what is known at the end, and a way that is known to leave it so is the shortest proof.
    ways.sort_by_key(|f| (!f.sure, std::cmp::Reverse(f.number), f.way));
    for fork in ways {
        if chosen.len() >= DEEPEST || *left < flow.steps {
            return None;
        }
        *left -= flow.steps;
        let mut one = begin();
        one.notes = None;
        one.late = flow.late;
        one.ways = flow.ways.clone().again();
        one.forks.chosen.clone_from(chosen);
        one.forks.chosen.insert(fork.number, fork.way);
        one.follow();
        let found = match one.forks.left.remove(&end) {
            Some(d) => Some((d, Vec::new())),
            None if one.forks.open.contains(&end) => way_to(&one, begin, end, left),
            None => None,
        };
        if let Some((d, mut spans)) = found {
            spans.insert(0, fork.span);
            return Some((d, spans));
        }
    }
    None
}
