//! Time passes until the next line goes on: at a moment that is written, or when what it waits for comes about by the laws.

use matterix_ir::plan::Condition;
use matterix_ir::{Diagnostic, NodeId, codes};

use super::super::Interpreter;
use super::super::course::Course;
use super::super::even::Even;
use super::super::state::AbstractState;
use super::super::value::AbstractValue;
use super::{Frame, Line, Lines, ROUNDING, State, same, takes};

/// Moments in a row at which no line goes on, before the rest is left to the run.
const MOST_IDLE: usize = 1000;

impl<'l> Interpreter<'l, '_> {
    /// Time passes until the next line goes on.
    pub(super) fn until_next(&mut self, lines: &mut Lines<'l>) {
        lines.idle += 1;
        lines.over |= lines.idle > MOST_IDLE;
        let now = lines.now();
        for at in 0..lines.all.len() {
            let State::Wait(wait) = &lines.all[at].state else { continue };
            let condition = wait.condition;
            match wait.since {
                Some(since) if since + wait.lasts <= now || same(since + wait.lasts, now) => {
                    lines.all[at].state = State::Ready;
                    return;
                }
                _ if wait.deadline <= now || same(wait.deadline, now) => return self.timed_out(lines, at),
                _ if self.moves_by_itself(condition, &lines.facts) && !self.is_followed(condition, &lines.facts) => {
                    self.leave_line(lines, at);
                }
                _ => {}
            }
        }
        let due = lines.all.iter().filter_map(|line| match &line.state {
            State::Until(time) => Some(*time),
            State::Wait(wait) => Some(wait.since.map_or(f64::INFINITY, |s| s + wait.lasts).min(wait.deadline)),
            _ => None,
        });
        let next = due.fold(f64::INFINITY, f64::min);
        if now.is_nan() || next <= now {
            lines.over |= now.is_nan();
            return wake_due(lines, now);
        }
        lines.uses.clear();
        lines.all.iter_mut().for_each(|line| line.behind.clear());
        match self.pass_until(next, lines) {
            Some(end) => wake_due(lines, end),
            None => {
                lines.over = true;
                self.waits_for_ever(lines);
            }
        }
    }

    /// Reports a wait without a limit that no other line ends, as they have all come to their ends.
    fn waits_for_ever(&mut self, lines: &Lines<'l>) {
        let ends = |line: &Line<'l>| matches!(line.state, State::Done | State::Lines(_) | State::Wait(_));
        if lines.loose || !lines.all.iter().all(ends) {
            return;
        }
        let waits = lines.all.iter().find_map(|line| match &line.state {
            State::Wait(wait) if wait.since.is_none() => Some((line, wait)),
            _ => None,
        });
        let Some((line, wait)) = waits else { return };
        if self.eval(wait.condition.node, &lines.facts).truth() != Some(false) {
            return;
        }
        let place = line.sites.last().map(|s| s.span).unwrap_or_default();
        let headline = format!("`{}` never becomes true", wait.condition.text);
        let d = Diagnostic::error(codes::WAITS_FOR_EVER, place, headline, "this step waits for it")
            .help("wait for a condition that the other branches and jobs cause, and give a `timeout`");
        self.found(d, wait.condition.span);
    }

    /// Time passes up to `next`, s, or to what a line waits for, if that comes before; when that is. None where it never comes.
    fn pass_until(&mut self, next: f64, lines: &mut Lines<'l>) -> Option<f64> {
        let now = lines.now();
        let waits = lines.all.iter().filter_map(|line| match &line.state {
            State::Wait(wait) => Some((wait.condition.node, wait.since.is_none())),
            _ => None,
        });
        let mut watched: Vec<(NodeId, bool)> = waits.collect();
        if watched.is_empty() && !next.is_finite() {
            return None;
        }
        let kept = lines.all.iter().flat_map(|line| &line.kept).copied().collect::<Vec<&Condition>>();
        let lasts = |c: &&Condition| self.eval(c.node, &lines.facts).truth() == Some(true);
        watched.extend(kept.into_iter().filter(lasts).map(|c| (c.node, false)));
        let before = lines.facts.clone();
        self.quiet += 1;
        let course = self.course(next - now, &watched, &mut lines.facts);
        let mut reached = Vec::new();
        let end = match course {
            Course::Reached(nodes) => {
                reached = nodes;
                lines.facts.time.exact()
            }
            Course::Passed => Some(next),
            Course::Left(left) if left.is_finite() => {
                self.drift(&AbstractValue::Point(left), &mut lines.facts);
                Some(next)
            }
            Course::Left(_) => None,
        };
        if let Some(end) = end.filter(|_| !watched.is_empty()) {
            reached.extend(self.about_to_come(end, &watched, &lines.facts));
        }
        self.quiet -= 1;
        let end = end?;
        lines.over |= std::mem::take(&mut self.stopped);
        self.limits_broken(next - now, &before, lines);
        lines.facts.time = AbstractValue::Point(end);
        self.judge_limits(&lines.facts);
        self.keeps_broken(&reached, lines);
        self.forget_lost(lines);
        self.look_after(&reached, end, lines);
        Some(end)
    }

    /// What comes about at this moment, give or take rounding. What moves stays where it is now: who asks whether it equals what is
    /// waited for finds that open.
    fn about_to_come(&mut self, now: f64, watched: &[(NodeId, bool)], facts: &AbstractState) -> Vec<NodeId> {
        match self.course(ROUNDING * now.max(1.0), watched, &mut facts.clone()) {
            Course::Reached(nodes) => nodes,
            _ => Vec::new(),
        }
    }

    /// Reports the limits that flows have passed, at the step of a line in hand that has set them going, or else where that line waits.
    fn limits_broken(&mut self, longest: f64, before: &AbstractState, lines: &mut Lines<'l>) {
        let tracks = self.tracks();
        let moved = tracks.list.iter().map(|t| t.state);
        let moved = moved.filter(|s| before.states[*s as usize] != lines.facts.states[*s as usize]);
        let moved: Vec<u32> = moved.collect();
        let mut due = self.limits_that_ask_for(&moved);
        due.sort_unstable();
        due.dedup();
        let plan = self.plan;
        for limit in due {
            let node = plan.limits[limit as usize].condition.node;
            let (then, now) = (self.eval(node, before).truth(), self.eval(node, &lines.facts).truth());
            if then != Some(true) || now == Some(true) {
                continue;
            }
            let states = self.parts(node).states.clone();
            let Some(at) = self.set_going(&states, lines) else { continue };
            std::mem::swap(&mut self.sites, &mut lines.all[at].sites);
            std::mem::swap(&mut self.caught, &mut lines.all[at].caught);
            let found = self.findings.len();
            self.pass(&AbstractValue::Point(longest), &mut before.clone());
            lines.over |= std::mem::take(&mut self.stopped) || self.findings.len() > found;
            std::mem::swap(&mut self.sites, &mut lines.all[at].sites);
            std::mem::swap(&mut self.caught, &mut lines.all[at].caught);
            return;
        }
    }

    /// Flows break what a line keeps: reported at the step of another line that has set them going.
    fn keeps_broken(&mut self, reached: &[NodeId], lines: &mut Lines<'l>) {
        let broken = |line: &Line<'l>| line.kept.iter().copied().find(|c| reached.contains(&c.node));
        let found = (0..lines.all.len()).find_map(|at| Some((at, broken(&lines.all[at])?)));
        let Some((keeps, condition)) = found else { return };
        lines.over = true;
        let states = self.parts(condition.node).states.clone();
        let by = self.set_going(&states, lines).filter(|by| *by != keeps);
        let Some(site) = by.and_then(|by| lines.all[by].sites.last().cloned()) else { return };
        if !takes(&lines.all[keeps].caught, "broken") {
            self.doubt = usize::from(lines.loose);
            self.breaks(condition, site.span, &site.label);
        }
    }

    /// The line that has set one of these states going.
    fn set_going(&mut self, states: &[u32], lines: &Lines<'l>) -> Option<usize> {
        self.set_going_by(states, lines).or_else(|| self.set_going_before(states, lines))
    }

    /// The last line within an operation that sets one of these states going.
    fn set_going_by(&mut self, states: &[u32], lines: &Lines<'l>) -> Option<usize> {
        (0..lines.all.len()).rev().find(|at| {
            let operation = lines.all[*at].frames.iter().rev().find_map(|f| match f {
                Frame::End(operation, _) => Some(*operation),
                _ => None,
            });
            operation.is_some_and(|operation| {
                let set = self.sets_going(self.changed_by(&operation.at_start));
                states.iter().any(|s| set.contains(s))
            })
        })
    }

    /// The last line that waits and has steps which set one of these states going.
    fn set_going_before(&mut self, states: &[u32], lines: &Lines<'l>) -> Option<usize> {
        (0..lines.all.len()).rev().find(|at| {
            let line = &lines.all[*at];
            matches!(line.state, State::Until(_) | State::Wait(_)) && {
                let set = self.sets_going(self.writes(line.root));
                states.iter().any(|s| set.contains(s))
            }
        })
    }

    /// What laws have changed meanwhile came about at a time that is not known here, but for what has just been `reached`.
    fn look_after(&mut self, reached: &[NodeId], now: f64, lines: &mut Lines<'l>) {
        for at in 0..lines.all.len() {
            let State::Wait(wait) = &mut lines.all[at].state else { continue };
            let (condition, held) = (wait.condition, wait.since.is_some());
            if reached.contains(&condition.node) {
                wait.since = if held { None } else { Some(now) };
                if !held && wait.lasts <= 0.0 {
                    lines.all[at].state = State::Ready;
                }
            } else if self.eval(condition.node, &lines.facts).truth() != Some(held) {
                self.leave_line(lines, at);
            }
        }
    }

    /// Whether laws may change how a condition comes out while nothing is done.
    fn moves_by_itself(&mut self, condition: &Condition, facts: &AbstractState) -> bool {
        let parts = self.parts(condition.node);
        if parts.timed || !self.timed.is_empty() {
            return true;
        }
        let moving: Vec<usize> =
            (0..self.derivatives.len()).filter(|i| parts.states.contains(&self.derivatives[*i].state)).collect();
        moving.into_iter().any(|i| self.eval(self.derivatives[i].rate, facts).exact() != Some(0.0))
    }

    /// Whether what a condition rests on is known at every moment from now on, as long as nothing is done.
    fn is_followed(&mut self, condition: &Condition, facts: &AbstractState) -> bool {
        let parts = self.parts(condition.node);
        if parts.states.iter().any(|s| facts.states[*s as usize].exact().is_none()) {
            return false;
        }
        let even = self.even(facts, &Even::default());
        !parts.states.iter().any(|s| even.open.contains(s))
    }
}

/// The lines go on whose time has come.
fn wake_due(lines: &mut Lines<'_>, now: f64) {
    for line in &mut lines.all {
        if matches!(line.state, State::Until(time) if time <= now || same(time, now)) {
            line.state = State::Ready;
        }
    }
}
