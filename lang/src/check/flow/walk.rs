//! The steps of the plan, one construct at a time. Each gives what is known after it, or nothing where it never ends
//! by itself.

use std::collections::BTreeSet;

use matterix_ir::plan::{Condition, Step, StepId};
use matterix_ir::{BinaryOp, NodeId, Op, Severity};

use super::actions::Asked;
use super::clashing::CLAIMED;
use super::course::Course;
use super::interference::Rival;
use super::jobs::in_both;
use super::program_points::at_least;
use super::report::Finding;
use super::state::AbstractState;
use super::stopped::Lines;
use super::swallowed::Net;
use super::trace_partitioning::MOST_WAYS;
use super::turns::{Moment, after_turns, later};
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, MOST_STEPS, Site};
use crate::elaborate::mixtures::written;

/// Turns of a loop followed one by one.
const MOST_TURNS: usize = 2000;

/// Depth of `parallel` to which every branch is followed both before and after its siblings.
const MOST_PARALLEL: usize = 3;

impl<'l> Interpreter<'l, '_> {
    /// Follows a step.
    pub fn walk(&mut self, id: StepId, facts: AbstractState) -> Option<AbstractState> {
        self.steps += 1;
        if self.steps > MOST_STEPS {
            let headline = format!(
                "`check` followed `{}` only up to here: it has more than {MOST_STEPS} steps",
                self.plan.workflow
            );
            self.not_analysed(Severity::Warning, headline, "later steps are not checked");
            return None;
        }
        let node = self.plan.get(id);
        // An operation that is refused uses nothing.
        if !matches!(node.step, Step::Operation(_)) {
            self.come_to(id);
        }
        let block = matches!(node.step, Step::Sequence(_) | Step::Guarded { .. } | Step::Parallel(_) | Step::Try(_));
        let own = !block && !node.span.is_empty() && !self.in_library(node.span);
        if own {
            let calls = matches!(node.step, Step::Operation(_) | Step::Skill { .. });
            self.sites.push(Site { span: node.span, label: node.label.clone(), calls });
        }
        let noted = self.begin(id, node, &facts);
        let (began, _) = facts.time.bounds();
        let waits = node.step.waits_for_jobs();
        self.blocks += usize::from(waits);
        let row = self.lab.rows.get(&id).copied();
        self.rows.extend(row);
        let mut after = self.step(id, facts);
        if row.is_some() {
            self.rows.pop();
        }
        self.blocks -= usize::from(waits);
        if std::mem::take(&mut self.stopped) {
            after = None;
        }
        if waits && !self.jobs.is_empty() {
            after = self.end_block(after);
        }
        if let Some(after) = after.as_ref().filter(|_| own) {
            self.outlasts(began, after);
            self.came_to_end(node.span);
        }
        if let Some(begun) = noted {
            self.end(node, begun, after.as_ref());
        }
        if own {
            self.sites.pop();
        }
        after
    }

    /// Walks a body all through which conditions must hold.
    fn walk_during(
        &mut self,
        invariants: &'l [Condition],
        body: StepId,
        facts: AbstractState,
    ) -> Option<AbstractState> {
        let around = (self.during.len(), self.unbroken.len());
        self.during.extend(invariants);
        let guards = self.guards.len();
        self.unbroken.extend(invariants.iter().map(|condition| (condition, guards)));
        let after = self.walk(body, facts);
        self.during.truncate(around.0);
        self.unbroken.truncate(around.1);
        after
    }

    fn step(&mut self, id: StepId, mut facts: AbstractState) -> Option<AbstractState> {
        let plan = self.plan;
        let node = plan.get(id);
        match &node.step {
            Step::Sequence(steps) => {
                for step in steps {
                    facts = self.walk(*step, facts)?;
                }
                Some(facts)
            }
            Step::Parallel(branches) => self.parallel(branches, facts),
            Step::Operation(operation) => {
                self.note_duration(id, operation, &facts);
                self.may_report(operation, &facts);
                self.operation(id, &node.label, operation, facts)
            }
            Step::Guarded { body, handlers, finally } => self.guarded(id, *body, handlers, *finally, facts),
            Step::Retry { times } => {
                self.begins_again(*times, facts);
                None
            }
            Step::Try(alternatives) => self.alternatives(id, alternatives, facts),
            Step::Skill { needs, invariants, promises, body, .. } => {
                let met = match self.needs(&node.label, needs, &mut facts) {
                    Asked::Handled => return None,
                    asked => asked == Asked::Met,
                };
                if !met {
                    return Some(self.refused(*body, facts));
                }
                match self.begins_under(&node.label, invariants, &mut facts) {
                    Asked::Met => {}
                    Asked::Unmet => return Some(self.refused(*body, facts)),
                    Asked::Handled => return None,
                }
                let mut after = self.walk_during(invariants, *body, facts);
                if let Some(after) = after.as_mut() {
                    self.promised(&node.label, promises, after);
                }
                after
            }
            Step::Named { start, end, body, .. } => {
                facts.keep(*start, facts.time.clone());
                let mut after = self.walk(*body, facts)?;
                after.keep(*end, after.time.clone());
                Some(after)
            }
            Step::Let { local, value } => {
                let raced = self.is_raced(*value);
                let known = if raced { AbstractValue::top() } else { self.eval(*value, &facts) };
                if !raced && !known.exact().is_some_and(f64::is_finite) {
                    self.without_value(*value, node.span, &facts);
                }
                facts.keep(*local, known);
                Some(facts)
            }
            Step::Wait { duration } => {
                let time = self.duration(*duration, &facts);
                self.pass(&time, &mut facts);
                self.still_goes_on(&node.label, &mut facts);
                self.still_kept(&node.label, &facts);
                Some(facts)
            }
            Step::WaitUntil { condition, timeout } => {
                let after = self.wait_until(id, condition, *timeout, facts)?;
                if timeout.is_none() || !self.is_taken("timeout") {
                    self.waits_against_keep(&node.label, condition, &after);
                }
                Some(after)
            }
            Step::Hold { condition, duration, timeout } => {
                // It cannot hold so long in the time given: only the way of the handler goes on.
                if let Some(limit) = timeout.filter(|_| self.is_taken("timeout")) {
                    let (lasts, limit) = (self.duration(*duration, &facts), self.duration(limit, &facts));
                    if lasts.bounds().0 > limit.bounds().1 {
                        self.pass(&limit, &mut facts);
                        self.raise_written("timeout", node.span, facts);
                        return None;
                    }
                }
                let began = facts.time.clone();
                let mut facts = self.wait_until(id, condition, *timeout, facts)?;
                if timeout.is_none() || !self.is_taken("timeout") {
                    self.waits_against_keep(&node.label, condition, &facts);
                }
                let time = self.duration(*duration, &facts);
                let longest = timeout.map_or(f64::INFINITY, |node| self.duration(node, &facts).bounds().1);
                let holds = self.goes_on_holding(condition.node, &time, &facts);
                if let Some(lasts) = time.exact().filter(|_| !holds)
                    && let Some(after) =
                        self.breaks_off(condition.node, lasts, longest - waited(&began, &facts), &facts)
                {
                    let limited = timeout.is_some();
                    self.unless_timeout_taken(limited, |flow| flow.never_held(condition, (lasts, after), limited));
                    // Only the way of the handler goes on.
                    if limited && self.is_taken("timeout") {
                        self.pass(&AbstractValue::point(longest - waited(&began, &facts)), &mut facts);
                        self.raise_written("timeout", node.span, facts);
                        return None;
                    }
                }
                let time = if holds { time } else { at_most(&time, longest) };
                self.pass(&time, &mut facts);
                self.assume(condition.node, true, &mut facts);
                Some(facts)
            }
            Step::Keep { condition, body } => {
                let fails = self.eval(condition.node, &facts).truth() == Some(false) && !self.is_shared(condition.node);
                if fails {
                    self.unless_taken("broken", |flow| flow.unexpected(condition, &facts));
                }
                if fails && self.is_taken("broken") {
                    // The body does not begin.
                    self.raise("broken", facts);
                    return None;
                }
                let mut broken = facts.clone();
                self.widen(*body, &mut broken);
                self.pass(&AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown), &mut broken);
                self.raise("broken", broken);
                if fails {
                    // As if it held: what goes wrong in the body all the same is a mistake of its own.
                    let states = self.parts(condition.node).states.clone();
                    self.forget(&states, &mut facts);
                }
                self.kept.push(condition);
                self.unbroken.push((condition, self.guards.len()));
                let after = match self.is_taken("broken") && !plan.ends.is_empty() {
                    true => self.may_break(condition, *body, facts),
                    false => self.walk(*body, facts),
                };
                self.kept.pop();
                self.unbroken.pop();
                after
            }
            Step::During { body, invariants } => {
                // It breaks after any time, with any part of the body done.
                let mut broken = facts.clone();
                self.widen(*body, &mut broken);
                self.pass(&AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown), &mut broken);
                self.raise("broken", broken);
                self.walk_during(invariants, *body, facts)
            }
            Step::Within { limit, since, body } => {
                self.raise("late", facts.clone());
                // Only the way of the handler goes on.
                if self.is_taken("late") && self.is_too_late(*since, *limit, &facts) {
                    return None;
                }
                self.walk(*body, facts)
            }
            Step::If { condition, then, otherwise } => self.choice(id, condition, *then, *otherwise, facts),
            Step::Repeat { times, body } => {
                let times = self.turns(*times, &facts);
                self.repeat(id, &times, *body, facts)
            }
            Step::RepeatWhile { condition, max, body } => {
                let max = self.turns(*max, &facts);
                self.repeat_while(id, condition, &max, *body, facts)
            }
            Step::Claim { body, claims } => {
                // Others may have what is claimed for any time.
                if !self.shared.is_empty() {
                    facts.time = at_least(&facts.time);
                }
                let before = self.claimed.len();
                self.claimed.extend(claims);
                let after = self.walk(*body, facts);
                self.claimed.truncate(before);
                after
            }
            Step::Start { job, body } => self.start_job(job, *body, facts),
            Step::Await { job } => self.await_job(job, facts),
            Step::Fail { name, .. } => {
                self.comes_to_fail(id, name, &facts);
                self.raise_written(name, node.span, facts);
                None
            }
            Step::Expect(conditions) => {
                // What holds on some ways only is the run's to judge.
                for c in conditions {
                    if self.without_value(c.node, c.span, &facts) {
                        continue;
                    }
                    if self.eval(c.node, &facts).truth() == Some(false) && !self.is_shared(c.node) {
                        self.unexpected(c, &facts);
                    }
                }
                Some(facts)
            }
            Step::Record { .. } | Step::Note(_) | Step::Ask(_) => Some(facts),
        }
    }

    /// Whether a block that must begin within a time of a moment begins later on every way.
    fn is_too_late(&mut self, since: NodeId, limit: NodeId, facts: &AbstractState) -> bool {
        let due = AbstractValue::binary(BinaryOp::Add, &self.eval(since, facts), &self.eval(limit, facts));
        let late = AbstractValue::binary(BinaryOp::Lt, &due, &facts.time);
        late.truth() == Some(true)
    }

    /// Follows the body of a skill that is refused, which was said: of what it would have done nothing is known, and whether it would have
    /// come to an end does not matter.
    fn refused(&mut self, body: StepId, facts: AbstractState) -> AbstractState {
        let before = facts.clone();
        self.quiet += 1;
        let after = self.walk(body, facts).filter(|after| after.time.bounds().0.is_finite());
        self.quiet -= 1;
        let mut after = after.unwrap_or_else(|| AbstractState { time: at_least(&before.time), ..before });
        self.widen(body, &mut after);
        after
    }

    fn wait_until(
        &mut self,
        id: StepId,
        condition: &Condition,
        timeout: Option<NodeId>,
        mut facts: AbstractState,
    ) -> Option<AbstractState> {
        let value = self.eval(condition.node, &facts);
        if value.truth() == Some(true) {
            return Some(facts);
        }
        let parts = self.parts(condition.node);
        let shared = self.is_set_beside(condition.node);
        let longest = match timeout {
            Some(node) => self.duration(node, &facts).bounds().1,
            None => f64::INFINITY,
        };
        if let Some(wait) = self.until(condition.node, &facts).filter(|wait| *wait <= longest) {
            self.pass(&AbstractValue::Point(wait), &mut facts);
            return Some(facts);
        }
        if !(timeout.is_some() && self.is_taken("timeout")) {
            self.stopped_meanwhile(condition, longest, &facts);
        }
        let before = facts.clone();
        let mut watched = if self.is_taken("broken") { self.may_break_here(&facts) } else { Vec::new() };
        watched.push((condition.node, true));
        let course = if shared { Course::Left(longest) } else { self.course(longest, &watched, &mut facts) };
        match course {
            Course::Reached(nodes) if nodes.contains(&condition.node) => return Some(facts),
            Course::Reached(nodes) => {
                self.ends_broken(&nodes, &mut facts);
                return None;
            }
            Course::Passed => {}
            Course::Left(left) => self.pass(&AbstractValue::Range(0.0, left, Imprecision::Unknown), &mut facts),
        }
        if value.truth() == Some(false) && self.eval(condition.node, &facts).truth().is_none() {
            self.by_totals(longest, &before, &mut facts);
        }
        if timeout.is_some() {
            let mut late = facts.clone();
            late.time = AbstractValue::binary(BinaryOp::Add, &before.time, &AbstractValue::point(longest));
            self.raise_written("timeout", self.plan.get(id).span, late);
        }
        if value.truth() == Some(false) && !parts.timed && !shared {
            let never = self.eval(condition.node, &facts).truth() == Some(false);
            if never {
                let limited = timeout.is_some();
                self.unless_timeout_taken(limited, |flow| flow.never_comes(condition, limited, &before, &facts));
                // Only the way of the handler goes on.
                if limited && self.is_taken("timeout") {
                    return None;
                }
                let states = parts.states.clone();
                self.forget(&states, &mut facts);
                return Some(facts);
            }
        }
        if value.truth() == Some(false) && !shared && !(timeout.is_some() && self.is_taken("timeout")) {
            self.leaves_open(condition.node, (self.site(), condition.span));
        }
        // Another branch may do what is waited for.
        if value.truth() == Some(false) && shared {
            self.needs_jobs |= self.late && !self.jobs.is_empty();
            let states: Vec<u32> = self.shared.iter().chain(self.of_jobs()).flatten().copied().collect();
            self.forget(&states, &mut facts);
        }
        self.assume(condition.node, true, &mut facts);
        Some(facts)
    }

    /// Whether a condition that holds goes on doing so for a time, whatever others do.
    fn goes_on_holding(&mut self, condition: NodeId, time: &AbstractValue, facts: &AbstractState) -> bool {
        if self.is_shared(condition) {
            return false;
        }
        let holds = self.unheard(|flow| {
            let mut along = facts.clone();
            match time.exact().map(|time| flow.course(time, &[(condition, false)], &mut along)) {
                Some(Course::Passed) => true,
                Some(Course::Reached(_)) => false,
                Some(Course::Left(_)) | None => {
                    let mut within = facts.clone();
                    flow.drift(&AbstractValue::Range(0.0, time.bounds().1, Imprecision::Unknown), &mut within);
                    flow.eval(condition, &within).truth() == Some(true)
                }
            }
        });
        self.stopped = false;
        holds
    }

    /// How long it is until a point in time that a condition waits for, s.
    fn until(&mut self, condition: NodeId, facts: &AbstractState) -> Option<f64> {
        let graph = &self.lab.graph;
        let Op::Binary(BinaryOp::Le, due, time) = graph.op(condition) else { return None };
        let clock = graph.op(time) == Op::Time;
        let due = self.eval(due, facts).exact().filter(|_| clock)?;
        Some(due - facts.time.exact()?).filter(|wait| *wait >= 0.0)
    }

    fn choice(
        &mut self,
        id: StepId,
        condition: &Condition,
        then: StepId,
        otherwise: Option<StepId>,
        facts: AbstractState,
    ) -> Option<AbstractState> {
        let truth = self.truth(condition.node, &facts);
        self.note_branch(condition, otherwise.is_some());
        self.open += usize::from(truth.is_none());
        let mut branch = |holds: bool, facts: &AbstractState| {
            let mut facts = facts.clone();
            self.decide(condition.node, holds, &mut facts);
            match (holds, otherwise) {
                (true, _) => self.walk(then, facts),
                (false, Some(step)) => self.walk(step, facts),
                (false, None) => Some(facts),
            }
        };
        match truth {
            Some(holds) => branch(holds, &facts),
            None => {
                let (yes, no) = (branch(true, &facts), branch(false, &facts));
                self.open -= 1;
                self.meet(id, &facts, yes.into_iter().chain(no))
            }
        }
    }

    fn repeat(
        &mut self,
        id: StepId,
        times: &AbstractValue,
        body: StepId,
        mut facts: AbstractState,
    ) -> Option<AbstractState> {
        let (low, high) = times.bounds();
        let begun = Moment::of(&facts);
        for turn in 0..MOST_TURNS {
            let done = turn as f64;
            if done >= high {
                return Some(facts);
            }
            let before = facts.clone();
            let after = self.turn(body, facts);
            facts = match done >= low {
                true => {
                    self.turning += 1;
                    let either = self.meet(id, &before, after.into_iter().chain([before.clone()]));
                    self.turning -= 1;
                    either?
                }
                false => after?,
            };
            if self.rests(body, &mut facts, &before) {
                self.more_turns(body, true, &facts);
                let left = (low == high).then_some(high - done - 1.0);
                return Some(after_turns(left, facts, &Moment::of(&before)));
            }
        }
        self.more_turns(body, false, &facts);
        self.turns_not_followed(body);
        self.widen(body, &mut facts);
        Some(later(facts, &begun))
    }

    fn repeat_while(
        &mut self,
        id: StepId,
        condition: &Condition,
        max: &AbstractValue,
        body: StepId,
        mut facts: AbstractState,
    ) -> Option<AbstractState> {
        let start = facts.clone();
        let mut ends: Vec<AbstractState> = Vec::new();
        let (_, most) = max.bounds();
        for turn in 0..MOST_TURNS {
            let holds = self.eval(condition.node, &facts).truth();
            if holds != Some(true) {
                let mut out = facts.clone();
                self.assume(condition.node, false, &mut out);
                // The last ends are told apart, and what many others before them come to.
                if ends.len() == MOST_WAYS {
                    let early = ends.remove(0);
                    ends[0] = start.join(early, &ends[0], self.plan.get(id).span, Imprecision::Paths);
                }
                ends.push(out);
            }
            if holds == Some(false) {
                return self.meet(id, &start, ends);
            }
            if turn as f64 >= most {
                if holds == Some(true) && ends.is_empty() {
                    self.runs_out(condition, most, &facts);
                }
                self.raise_written("max", self.plan.get(id).span, facts);
                return self.meet(id, &start, ends);
            }
            let before = facts.clone();
            self.assume(condition.node, true, &mut facts);
            let open = turn > 0 && !ends.is_empty();
            self.doubt += usize::from(open);
            self.open += usize::from(holds.is_none());
            let after = self.turn(body, facts);
            self.open -= usize::from(holds.is_none());
            self.doubt -= usize::from(open);
            let Some(after) = after else { return self.meet(id, &start, ends) };
            facts = after;
            if self.rests(body, &mut facts, &before) {
                self.more_turns(body, true, &facts);
                self.raise_written("max", self.plan.get(id).span, facts.clone());
                let further = later(facts.clone(), &Moment::of(&before));
                if ends.is_empty() && self.eval(condition.node, &further).truth() == Some(true) {
                    let timeless = facts.time.exact().is_some() && facts.time == before.time;
                    self.turns_alike(condition, most, timeless, &facts);
                    if !self.is_shared(condition.node) {
                        return None;
                    }
                }
                // A loop that changes nothing it looks at ends by what only a run can tell.
                ends.push(further);
                return self.meet(id, &start, ends);
            }
        }
        if ends.is_empty() && self.stays_so(condition, body, &facts) {
            self.runs_out(condition, most, &facts);
        }
        self.more_turns(body, false, &facts);
        self.turns_not_followed(body);
        self.widen(body, &mut facts);
        self.raise_written("max", self.plan.get(id).span, facts.clone());
        ends.push(facts);
        self.meet(id, &start, ends)
    }

    /// Says that more turns of a loop are not followed one by one.
    fn turns_not_followed(&mut self, body: StepId) {
        self.durations_unknown(body);
        let headline = format!("`check` followed only the first {MOST_TURNS} turns of this loop one by one");
        self.not_analysed(Severity::Advice, headline, "values that later turns change are unknown after it");
    }

    /// A turn of a loop.
    fn turn(&mut self, body: StepId, facts: AbstractState) -> Option<AbstractState> {
        self.turning += 1;
        let after = self.walk(body, facts);
        self.turning -= 1;
        after
    }

    /// Forgets what a body changes.
    pub(super) fn widen(&mut self, body: StepId, facts: &mut AbstractState) {
        let states: Vec<u32> = self.sets_going(self.writes(body)).into_iter().collect();
        self.forget(&states, facts);
    }

    /// The states that the operations below a step change.
    pub fn writes(&self, id: StepId) -> BTreeSet<u32> {
        let mut out = BTreeSet::new();
        let mut todo = vec![id];
        while let Some(id) = todo.pop() {
            let step = &self.plan.get(id).step;
            if let Step::Operation(o) = step {
                out.extend(written(o, &self.mixtures));
            }
            todo.extend(step.children());
        }
        out
    }

    /// Branches side by side: followed one after the other, in the order of the text and the other way round. What goes
    /// wrong in one order only may be right in the order of the run.
    fn parallel(&mut self, branches: &[StepId], facts: AbstractState) -> Option<AbstractState> {
        let writes: Vec<BTreeSet<u32>> = branches.iter().map(|b| self.sets_going(self.writes(*b))).collect();
        let raced = self.raced_in_branches(branches);
        let forward: Vec<usize> = (0..branches.len()).collect();
        let backward: Vec<usize> = forward.iter().rev().copied().collect();
        let mark = self.findings.len();
        let from = self.guards.last().map_or(0, Vec::len);
        let mut lines = (branches.len() > 1 && self.is_stopped_by(branches)).then(Lines::default);
        let first = self.in_order(branches, &forward, (&writes, &raced), facts.clone(), lines.as_mut());
        if branches.len() < 2 || self.shared.len() >= MOST_PARALLEL {
            lines.iter().for_each(|lines| self.stop_branches(&facts, lines));
            self.cut_short(from);
            return first.map(|mut facts| {
                let open: Vec<u32> = raced.iter().flatten().copied().collect();
                self.forget(&open, &mut facts);
                facts
            });
        }
        let one: Vec<Finding> = self.findings.split_off(mark);
        self.once_more(true);
        let second = self.in_order(branches, &backward, (&writes, &raced), facts.clone(), lines.as_mut());
        self.once_more(false);
        lines.iter().for_each(|lines| self.stop_branches(&facts, lines));
        self.cut_short(from);
        let other: Vec<Finding> = self.findings.split_off(mark);
        self.findings.extend(in_both(one, &other, Some(self.open)));
        match (first, second) {
            (Some(a), Some(mut b)) => {
                // What flows at once comes to something between, or to neither.
                let tracks = self.tracks();
                let mut open: BTreeSet<u32> = tracks.list.iter().map(|t| t.state).collect();
                open.extend(raced.iter().flatten());
                open.retain(|s| {
                    let (one, other) = (&a.states[*s as usize], &b.states[*s as usize]);
                    let close = one.is_close(other);
                    if close && one != other {
                        b.states[*s as usize] = one.clone();
                    }
                    !close
                });
                let open: Vec<u32> = open.into_iter().collect();
                let mut both = facts.join(a, &b, self.site(), Imprecision::Unknown);
                // A run may have one value of one order and another of the other.
                both.cases = None;
                self.forget(&open, &mut both);
                Some(both)
            }
            (a, b) => a.or(b),
        }
    }

    fn in_order(
        &mut self,
        branches: &[StepId],
        order: &[usize],
        (writes, raced): (&[BTreeSet<u32>], &[BTreeSet<u32>]),
        mut facts: AbstractState,
        mut lines: Option<&mut Lines>,
    ) -> Option<AbstractState> {
        let start = facts.time.clone();
        let mut longest = start.clone();
        let all: BTreeSet<u32> = writes.iter().flatten().copied().collect();
        let meantime = if branches.len() > 1 { self.meantime(&all, &facts) } else { None };
        let mut ends = Vec::new();
        for i in order {
            let others = writes.iter().enumerate().filter(|(o, _)| o != i);
            let mut others: BTreeSet<u32> = others.flat_map(|(_, w)| w.iter().copied()).collect();
            others.extend(&raced[*i]);
            self.begin_branch(&others);
            self.meets.push(others.clone());
            facts.time = start.clone();
            if longest != start {
                self.begin_again(meantime.as_ref(), &mut facts);
            }
            self.contested.push(others.intersection(&writes[*i]).copied().collect());
            self.shared.push(others);
            let rival = |o: usize| Rival { steps: vec![branches[o]], start: start.clone(), later: o > *i };
            self.rivals.push((0..branches.len()).filter(|o| o != i).map(rival).collect());
            let raised = self.guards.last().map_or(0, Vec::len);
            let after = match &mut lines {
                Some(lines) => self.follow_line(*i, facts, branches[*i], lines),
                None => self.walk(branches[*i], facts),
            };
            self.blur(raised);
            self.rivals.pop();
            self.shared.pop();
            self.meets.pop();
            self.contested.pop();
            self.end_branch();
            facts = after?;
            longest = AbstractValue::binary(BinaryOp::Max, &longest, &facts.time);
            if meantime.is_some() {
                ends.push(facts.clone());
            }
        }
        facts.time = longest;
        self.go_on_from(meantime.as_ref(), &ends, &mut facts);
        Some(facts)
    }

    /// Whether steps may fail by what goes on beside them.
    fn meets_others(&self, id: StepId) -> bool {
        let beside = !self.shared.is_empty() || !self.jobs.is_empty();
        let begins = |step: &Step| matches!(step, Step::Start { .. } | Step::Await { .. } | Step::Parallel(_));
        beside || self.below(id).into_iter().any(|id| begins(&self.plan.get(id).step))
    }

    /// Whether a device may report a failure of steps, or not do what they promise.
    fn may_be_reported(&self, id: StepId) -> bool {
        self.below(id).into_iter().any(|id| match &self.plan.get(id).step {
            Step::Operation(operation) => !operation.fails.is_empty(),
            Step::Skill { promises, takes, .. } => !promises.is_empty() || takes.is_some(),
            _ => false,
        })
    }

    /// Follows the alternatives behind the first one, to which only a device's failure leads: how far those before got is not known,
    /// and nothing of it is known afterwards.
    fn beside_the_way(&mut self, alternatives: &[StepId], mut entry: AbstractState) {
        entry.unsure = true;
        self.doubt += 1;
        self.cleaning += 1;
        let written: Vec<u32> = alternatives.iter().flat_map(|step| self.writes(*step)).collect();
        self.forget(&written, &mut entry);
        for step in alternatives.iter().skip(1) {
            self.walk(*step, entry.clone());
        }
        self.cleaning -= 1;
        self.doubt -= 1;
    }

    fn alternatives(&mut self, id: StepId, alternatives: &[StepId], facts: AbstractState) -> Option<AbstractState> {
        let mut ends = Vec::new();
        let mut entry = facts.clone();
        for (i, step) in alternatives.iter().enumerate() {
            let last = i + 1 == alternatives.len();
            let next = alternatives.get(i + 1).copied();
            self.caught.push(Net {
                names: next.map(|_| None).into_iter().collect(),
                any: next,
                sites: self.sites.len(),
            });
            self.rescued.extend(next);
            self.guards.push(Vec::new());
            self.open += usize::from(i > 0);
            let after = self.walk(*step, entry.clone());
            self.open -= usize::from(i > 0);
            // A job does not outlast the alternative that began it.
            let after = self.end_body(after);
            let mut raised = self.guards.pop().unwrap_or_default();
            self.caught.pop();
            ends.extend(after);
            if last {
                if let Some(outer) = self.guards.last_mut() {
                    outer.extend(raised);
                }
                break;
            }
            if !raised.is_empty() {
                raised.extend(self.clashed(*step, &entry).map(|facts| (CLAIMED.to_owned(), facts)));
            }
            match self.entry(id, &facts, raised) {
                Some(next) => entry = AbstractState { written: None, ..next },
                None if self.meets_others(*step) => {
                    let states: Vec<u32> = self.writes(*step).into_iter().collect();
                    self.forget(&states, &mut entry);
                    entry.unsure = true;
                }
                None => {
                    if self.may_be_reported(*step) {
                        self.beside_the_way(&alternatives[i..], entry);
                    }
                    break;
                }
            }
        }
        self.meet(id, &facts, ends)
    }
}

/// A time that may be longer than it is meant to be, as what it waits for begins anew.
fn at_most(time: &AbstractValue, longest: f64) -> AbstractValue {
    let (low, high) = time.bounds();
    AbstractValue::Range(low, high.max(longest), Imprecision::Unknown)
}

/// How long something has taken at least, s.
fn waited(began: &AbstractValue, facts: &AbstractState) -> f64 {
    (facts.time.bounds().0 - began.bounds().1).max(0.0)
}
