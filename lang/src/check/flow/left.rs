//! What is left on, or in hand, at the end of some way that the text writes: a branch that is not taken, a handler, a `fail` or a
//! written timeout that nothing takes.
//!
//! Where ways meet, it is known only that one of them left a thing so. Such a way is followed alone to the end, and where it meets
//! others again, that of those on which the thing stays so: what is told has a way of its own. Conditions that were decided on it stay
//! decided, so that `if hot { heat }` and `if hot { stop }` go together.

use std::collections::BTreeMap;

use matterix_ir::plan::{Limit, StepId};
use matterix_ir::{Diagnostic, Span, codes};

use super::Interpreter;
use super::state::AbstractState;

/// So many meetings of one way are followed before it is left open.
const DEEPEST: usize = 12;

/// So many steps are followed again in all for ways that leave something on.
const MOST_STEPS: usize = 400_000;

/// So many things are named in one finding.
const MOST_NAMED: usize = 8;

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

impl Interpreter<'_, '_> {
    /// The way that is followed alone of those that meet here, if they differ in what should hold at the end.
    pub(super) fn fork(&mut self, id: StepId, ways: &[AbstractState]) -> Option<usize> {
        let plan = self.plan;
        let mut off = Vec::new();
        for (end, limit) in plan.ends.iter().enumerate() {
            let states = self.parts(limit.condition.node).states.clone();
            let same =
                |two: &[AbstractState]| states.iter().all(|s| two[0].states[*s as usize] == two[1].states[*s as usize]);
            if ways.windows(2).all(same) {
                continue;
            }
            let holds: Vec<Option<bool>> =
                ways.iter().map(|facts| self.eval(limit.condition.node, facts).truth()).collect();
            if holds.windows(2).all(|two| two[0] == two[1]) {
                continue;
            }
            let (number, span) = (self.forks.met, plan.get(id).span);
            // What a device may report, or what goes on beside may bring about, is no way that the text writes.
            let written = |(way, _): &(usize, &Option<bool>)| !ways[*way].unsure;
            let not_in_order = holds.iter().enumerate().filter(|(_, holds)| **holds != Some(true)).filter(written);
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
    pub(super) fn ends(&mut self, begun: &AbstractState, ended: &AbstractState) {
        let plan = self.plan;
        for (index, end) in plan.ends.iter().enumerate() {
            if !self.began_right(end, begun) {
                continue;
            }
            match self.eval(end.condition.node, ended).truth() {
                Some(true) => {}
                None => self.forks.open.push(index),
                Some(false) => {
                    if let Some(d) = self.unfinished(end, ended, &format!("when `{}` ends", self.plan.workflow)) {
                        self.forks.left.insert(index, d.clone());
                        self.found(d, end.condition.span);
                    }
                }
            }
        }
    }

    /// Looks at the same where a `fail` or a written timeout that nothing takes ends the workflow.
    pub(super) fn ends_failed(&mut self, begun: &AbstractState, raised: &[super::Raised]) {
        let plan = self.plan;
        for (name, facts) in raised {
            let Some(span) = facts.written else { continue };
            for (index, end) in plan.ends.iter().enumerate() {
                let known = self.forks.left.contains_key(&index) || !self.began_right(end, begun);
                if known || self.eval(end.condition.node, facts).truth() != Some(false) {
                    continue;
                }
                let Some(d) = self.unfinished(end, facts, &format!("if `{}` fails with `{name}`", plan.workflow))
                else {
                    continue;
                };
                let d = d.because(span, format!("`{name}` ends the workflow here: no handler takes it"));
                self.forks.left.insert(index, d.clone());
                self.found_by_failure(d, end.condition.span);
            }
        }
    }

    fn began_right(&mut self, end: &Limit, begun: &AbstractState) -> bool {
        self.eval(end.condition.node, begun).truth() == Some(true)
    }
}

/// Finds the ways that leave something as it should not be; `begin` gives a flow that was not followed yet.
pub(super) fn on_some_way<'l, 'a>(flow: &mut Interpreter<'l, 'a>, begin: &impl Fn() -> Interpreter<'l, 'a>) {
    let mut search = Search { left: MOST_STEPS, cut: false };
    let mut unsearched: Vec<usize> = Vec::new();
    let mut open = std::mem::take(&mut flow.forks.open);
    // One way may leave several things so.
    while open.len() > 1 {
        // Branches are followed in two orders: a way through one of them is a choice in each.
        let mut found = way_to_all(flow, begin, &open, Choices::Latest, &mut search);
        if found.is_empty() {
            found = way_to_all(flow, begin, &open, Choices::All, &mut search);
        }
        if found.is_empty() {
            break;
        }
        open.retain(|end| !found.iter().any(|(other, ..)| other == end));
        found.into_iter().for_each(|(end, d, way)| tell(flow, end, d, way));
    }
    for end in open {
        search.cut = false;
        match way_to(flow, begin, end, &mut search) {
            Some((d, way)) => tell(flow, end, d, way),
            None => unsearched.extend(search.cut.then_some(end)),
        }
    }
    if !unsearched.is_empty() {
        not_searched(flow, &unsearched);
    }
}

/// Reports a thing that is left so, with the statements at which the way there parts from others.
fn tell(flow: &mut Interpreter<'_, '_>, end: usize, mut d: Diagnostic, way: Vec<Span>) {
    let about = flow.plan.ends[end].condition.span;
    d.headline = d.headline.replacen("` is ", "` may be ", 1);
    for span in way.into_iter().filter(|span| !flow.in_library(*span)) {
        if !d.labels.iter().any(|l| l.span == span) {
            d = d.because(span, "one of the paths through this step leads there");
        }
    }
    flow.forks.left.insert(end, d.clone());
    flow.found(d, about);
}

/// At which meetings a way is chosen for each thing.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Choices {
    /// At the latest one.
    Latest,
    /// At all of them.
    All,
}

/// What is left so on the way that takes, at each meeting, a way on which one of these things is left so.
fn way_to_all<'l, 'a>(
    flow: &Interpreter<'l, 'a>,
    begin: &impl Fn() -> Interpreter<'l, 'a>,
    ends: &[usize],
    choices: Choices,
    search: &mut Search,
) -> Vec<(usize, Diagnostic, Vec<Span>)> {
    if search.left < flow.steps {
        return Vec::new();
    }
    search.left -= flow.steps;
    let mut chosen: BTreeMap<usize, usize> = BTreeMap::new();
    let mut spans: BTreeMap<usize, Span> = BTreeMap::new();
    for end in ends {
        let mut ways: Vec<Fork> = flow.forks.off.iter().filter(|f| f.end == *end && f.sure).copied().collect();
        ways.sort_by_key(|f| (std::cmp::Reverse(f.number), f.way));
        let fits = |f: &Fork, chosen: &BTreeMap<usize, usize>| chosen.get(&f.number).is_none_or(|way| *way == f.way);
        for fork in ways {
            if fits(&fork, &chosen) {
                chosen.insert(fork.number, fork.way);
                spans.entry(*end).or_insert(fork.span);
                if choices == Choices::Latest {
                    break;
                }
            }
        }
    }
    let mut one = follow_chosen(flow, begin, chosen);
    let left = ends.iter().filter_map(|end| Some((*end, one.forks.left.remove(end)?)));
    left.map(|(end, d)| (end, d, spans.get(&end).copied().into_iter().collect())).collect()
}

/// A flow that has followed these ways alone.
fn follow_chosen<'l, 'a>(
    flow: &Interpreter<'l, 'a>,
    begin: &impl Fn() -> Interpreter<'l, 'a>,
    chosen: BTreeMap<usize, usize>,
) -> Interpreter<'l, 'a> {
    let mut one = begin();
    one.notes = None;
    one.late = flow.late;
    one.ways = flow.ways.clone().again();
    one.forks.chosen = chosen;
    one.follow();
    one
}

/// What a search may still do.
struct Search {
    /// Steps that are left.
    left: usize,
    /// Whether a way was not followed for want of them.
    cut: bool,
}

/// Says which things may be left so on ways that were not followed.
fn not_searched(flow: &mut Interpreter<'_, '_>, unsearched: &[usize]) {
    let ends = flow.plan.ends.iter().enumerate().filter(|(index, _)| unsearched.contains(index));
    let mut names: Vec<String> = ends.map(|(_, end)| format!("`{}`", flow.lab.spoken_name(end.instance))).collect();
    names.sort();
    names.dedup();
    let more = names.len().saturating_sub(MOST_NAMED);
    names.truncate(MOST_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let headline = format!("`check` did not follow every path to the end of `{}`", flow.plan.workflow);
    let said = format!("on one of them {}{more} may be left on, open or unfinished", names.join(", "));
    let span = flow.plan.get(flow.plan.root).span;
    let d = Diagnostic::warning(codes::NOT_ANALYSED, span, headline, said)
        .help("switch it off in a `finally` of the workflow: every path runs it");
    flow.found(d, span);
}

/// A way on which something is left so, with the statements at which it parts from others.
fn way_to<'l, 'a>(
    flow: &Interpreter<'l, 'a>,
    begin: &impl Fn() -> Interpreter<'l, 'a>,
    end: usize,
    search: &mut Search,
) -> Option<(Diagnostic, Vec<Span>)> {
    let chosen = &flow.forks.chosen;
    let after = chosen.keys().next_back().map_or(0, |last| last + 1);
    let mut ways: Vec<Fork> = flow.forks.off.iter().filter(|f| f.end == end && f.number >= after).copied().collect();
    // The latest meeting decides what is known at the end, and a way that is known to leave it so is the shortest proof.
    ways.sort_by_key(|f| (!f.sure, std::cmp::Reverse(f.number), f.way));
    for fork in ways {
        if chosen.len() >= DEEPEST || search.left < flow.steps {
            search.cut = true;
            return None;
        }
        search.left -= flow.steps;
        let mut chosen = chosen.clone();
        chosen.insert(fork.number, fork.way);
        let mut one = follow_chosen(flow, begin, chosen);
        let found = match one.forks.left.remove(&end) {
            Some(d) => Some((d, Vec::new())),
            None if one.forks.open.contains(&end) => way_to(&one, begin, end, search),
            None => None,
        };
        if let Some((d, mut spans)) = found {
            spans.insert(0, fork.span);
            return Some((d, spans));
        }
    }
    None
}
