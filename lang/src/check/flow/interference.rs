//! What one branch or job does to another while both go on: a step that keeps from coming what the other waits for. It is
//! reported only where the times of both are known, so that every run comes to it.

use std::collections::BTreeSet;

use matterix_ir::model::Action;
use matterix_ir::plan::{Condition, Operation, Step, StepId};
use matterix_ir::quantity::show_duration;
use matterix_ir::{Diagnostic, NodeId, Severity, Span, codes};

use super::Interpreter;
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use crate::elaborate::mixtures::changed;

/// Steps that go on beside others.
#[derive(Clone, Debug)]
pub(super) struct Rival {
    /// What is done, in order.
    pub steps: Vec<StepId>,
    /// When the first of them begins, s.
    pub start: AbstractValue,
    /// Whether they begin after those beside them where both begin at one time; none where that is not known.
    pub later: bool,
}

/// Effects of a step beside, and when they happen, s.
struct Effect<'p> {
    at: (f64, f64),
    actions: &'p [Action],
    span: Span,
    /// The steps they are among begin after those beside them.
    later: bool,
}

impl<'p> Interpreter<'p, '_> {
    /// Looks whether something beside keeps from coming what is waited for, for at most `longest` s.
    pub(super) fn stopped_meanwhile(&mut self, condition: &Condition, longest: f64, facts: &AbstractState) {
        let rivals = self.rivals_now();
        let Some(now) = facts.time.exact().filter(|_| !rivals.is_empty() && self.quiet == 0) else { return };
        let parts = self.parts(condition.node);
        if parts.timed || self.eval(condition.node, facts).truth() != Some(false) {
            return;
        }
        let mut effects = Vec::new();
        for rival in &rivals {
            let mut time = rival.start.bounds();
            for step in &rival.steps {
                let place = (Span::default(), rival.later);
                self.effects(*step, place, &mut time, facts, &mut effects);
            }
        }
        let ahead = self.ahead_of(&parts.states.iter().copied().collect());
        effects.retain(|effect| self.changed_by(effect.actions).iter().any(|s| ahead.contains(s)));
        effects.sort_by(|a, b| a.at.0.total_cmp(&b.at.0));
        if effects.iter().any(|e| e.at.0 != e.at.1 || e.at.0 < now) {
            return;
        }
        let Some(last) = effects.last().filter(|last| last.at.0 > now || last.later) else { return };
        let (span, at) = (last.span, last.at.0);
        if at - now < longest && self.never_after(condition, &effects, now, longest, facts) {
            self.keeps_from(condition, span, at - now);
        }
    }

    /// What goes on beside what is followed now.
    fn rivals_now(&self) -> Vec<Rival> {
        let jobs =
            self.jobs.values().map(|job| Rival { steps: vec![job.body()], start: job.start().clone(), later: false });
        self.rivals.iter().flatten().cloned().chain(jobs).collect()
    }

    /// Whether a condition cannot come true any more when these effects have happened, and not before.
    fn never_after(
        &mut self,
        condition: &Condition,
        effects: &[Effect<'p>],
        now: f64,
        longest: f64,
        facts: &AbstractState,
    ) -> bool {
        let mut facts = facts.clone();
        // What the others set is followed here, one by one.
        let contested = std::mem::take(&mut self.contested);
        let never = self.unheard(|flow| {
            let mut at = now;
            let mut open = true;
            for effect in effects {
                flow.pass_closely(effect.at.0 - at, &mut facts);
                open &= flow.eval(condition.node, &facts).truth() == Some(false);
                at = effect.at.0;
                facts.time = AbstractValue::Point(at);
                flow.perform(effect.actions, &mut facts);
            }
            flow.pass_by_totals(&AbstractValue::Range(0.0, longest - (at - now), Imprecision::Unknown), &mut facts);
            open && flow.eval(condition.node, &facts).truth() == Some(false)
        });
        self.contested = contested;
        never
    }

    fn pass_by_totals(&mut self, duration: &AbstractValue, facts: &mut AbstractState) {
        let before = facts.clone();
        self.pass(duration, facts);
        self.by_totals(duration.bounds().1, &before, facts);
    }

    fn keeps_from(&mut self, condition: &Condition, span: Span, after: f64) {
        let wait = self.site();
        let label = self.label_at(span);
        let headline = format!("`{label}` prevents `{}`, which another branch or job waits for", condition.text);
        let said = match after > 0.0 {
            true => format!("{} after the wait begins, before it can end", show_duration(after)),
            false => "as the wait begins".to_string(),
        };
        let mut d = Diagnostic::error(codes::STOPPED_MEANWHILE, span, headline, said);
        if after == 0.0 || self.doubt > 0 {
            d.severity = Severity::Warning;
        }
        let d = d.because(wait, format!("another branch or job waits here for `{}`", condition.text));
        let d = d.help("let it wait for the other branch or job, or put both into one `sequence`");
        self.found(d, condition.span);
    }

    /// The text of the step at a place.
    pub(super) fn label_at(&self, span: Span) -> String {
        self.plan.steps.iter().find(|s| s.span == span).map_or_else(String::new, |s| s.label.clone())
    }

    /// The states that actions change.
    pub(super) fn changed_by(&self, actions: &[Action]) -> BTreeSet<u32> {
        changed(actions, &self.mixtures).collect()
    }

    /// What a step and those in it do, and when; `time` is when it begins, and then when it ends, and `place` the statement of the
    /// user's around it, with whether it begins after what goes on beside it.
    fn effects(
        &mut self,
        id: StepId,
        place: (Span, bool),
        time: &mut (f64, f64),
        facts: &AbstractState,
        out: &mut Vec<Effect<'p>>,
    ) {
        let plan = self.plan;
        let node = plan.get(id);
        let own = !node.span.is_empty() && !self.in_library(node.span);
        let place = if own { (node.span, place.1) } else { place };
        let open = |time: &mut (f64, f64)| time.1 = f64::INFINITY;
        match &node.step {
            Step::Operation(operation) => self.effects_of(operation, place, time, facts, out),
            Step::Wait { duration } => {
                let (low, high) = self.lasts_beside(*duration, facts);
                *time = (time.0 + low, time.1 + high);
            }
            Step::Sequence(_)
            | Step::Skill { .. }
            | Step::Named { .. }
            | Step::Keep { .. }
            | Step::During { .. }
            | Step::Within { .. } => {
                for child in node.step.children() {
                    self.effects(child, place, time, facts, out);
                }
            }
            Step::Guarded { body, handlers, finally } => {
                self.effects(*body, place, time, facts, out);
                for (_, handler) in handlers {
                    self.effects(*handler, place, &mut (time.0, f64::INFINITY), facts, out);
                }
                if let Some(finally) = finally {
                    self.effects(*finally, place, time, facts, out);
                }
            }
            Step::Let { .. } | Step::Expect(_) | Step::Record { .. } | Step::Note(_) | Step::Ask(_) => {}
            step => {
                let decided = match step {
                    Step::If { condition, then, otherwise } => {
                        let holds = self.decided_by_now(condition, facts, out);
                        holds.map(|holds| if holds { Some(*then) } else { *otherwise })
                    }
                    _ => None,
                };
                if let Some(taken) = decided {
                    taken.into_iter().for_each(|step| self.effects(step, place, time, facts, out));
                    return;
                }
                open(time);
                for child in step.children() {
                    self.effects(child, place, time, facts, out);
                    open(time);
                }
            }
        }
    }

    /// How a condition comes out after these effects, where it is known before them and they do not change it.
    fn decided_by_now(&mut self, condition: &Condition, facts: &AbstractState, effects: &[Effect<'p>]) -> Option<bool> {
        let holds = self.eval(condition.node, facts).truth()?;
        let parts = self.parts(condition.node);
        let actions = effects.iter().flat_map(|effect| effect.actions).cloned().collect::<Vec<Action>>();
        let changed = self.behind(&self.changed_by(&actions));
        (!parts.timed && parts.states.iter().all(|s| !changed.contains(s))).then_some(holds)
    }

    fn effects_of(
        &mut self,
        operation: &'p Operation,
        (span, later): (Span, bool),
        time: &mut (f64, f64),
        facts: &AbstractState,
        out: &mut Vec<Effect<'p>>,
    ) {
        out.push(Effect { at: *time, actions: &operation.at_start, span, later });
        if operation.until.is_some() {
            time.1 = f64::INFINITY;
        } else if let Some(takes) = &operation.takes {
            let (low, high) = self.lasts_beside(takes.nominal, facts);
            *time = (time.0 + low, time.1 + high);
        }
        out.push(Effect { at: *time, actions: &operation.at_end, span, later });
    }

    /// How long a step of another branch or job lasts at least and at most, s: open where a step of the plan changes what that follows from.
    fn lasts_beside(&mut self, duration: NodeId, facts: &AbstractState) -> (f64, f64) {
        let parts = self.parts(duration);
        let changes = |flow: &Self| {
            let changed = flow.behind_plan();
            parts.states.iter().any(|s| changed.contains(s))
        };
        if !parts.states.is_empty() && changes(self) {
            return (0.0, f64::INFINITY);
        }
        let (low, high) = self.eval(duration, facts).bounds();
        (low.max(0.0), high.max(0.0))
    }

    /// The steps that follow one in the block it stands in, up to where it is waited for.
    pub(super) fn after_start(&self, body: StepId) -> Vec<StepId> {
        let plan = self.plan;
        let starts = |id: &StepId| matches!(plan.get(*id).step, Step::Start { body: b, .. } if b == body);
        let name = plan.steps.iter().find_map(|s| match &s.step {
            Step::Start { job, body: b } if *b == body => Some(job),
            _ => None,
        });
        let awaits = |id: &&StepId| matches!(&plan.get(**id).step, Step::Await { job } if Some(job) == name);
        let blocks = plan.steps.iter().filter_map(|s| match &s.step {
            Step::Sequence(steps) => Some(steps),
            _ => None,
        });
        let found = blocks.into_iter().find_map(|steps| Some((steps, steps.iter().position(&starts)?)));
        let rest =
            |(steps, at): (&Vec<StepId>, usize)| steps[at + 1..].iter().take_while(|id| !awaits(id)).copied().collect();
        found.map(rest).unwrap_or_default()
    }
}
