//! Failures that come for certain and that a handler for all failures takes, so that a step never succeeds and the run goes on all the
//! same. `on volume_overflow { }` says that its writer expects this failure; `on failure { }` and `try` take whatever comes, mistakes
//! too.

use matterix_ir::Span;
use matterix_ir::plan::{PlanStep, Step, StepId};

use super::Interpreter;
use super::report::Finding;

/// What takes failures around the steps that are followed.
#[derive(Clone, Debug, Default)]
pub(super) struct Net {
    /// The names of the failures that it takes, the first that fits; none for every one.
    pub(super) names: Vec<Option<String>>,
    /// What runs after any failure.
    pub(super) any: Option<StepId>,
    /// How many of the user's statements are around it.
    pub(super) sites: usize,
}

impl Net {
    /// One of which only the names matter.
    pub(super) fn of(names: Vec<Option<String>>) -> Net {
        Net { names, ..Net::default() }
    }

    /// Whether it takes a failure.
    pub(super) fn takes(&self, failure: &str) -> bool {
        self.name(failure).is_some()
    }

    /// By which of its names it takes a failure.
    fn name(&self, failure: &str) -> Option<&Option<String>> {
        self.names.iter().find(|name| name.as_deref().is_none_or(|name| name == failure))
    }
}

/// A failure for certain that a handler for all failures took.
#[derive(Clone)]
pub(super) struct Swallowed {
    finding: Finding,
    /// What it fails with.
    failure: String,
    /// The statements that it ends, the innermost last.
    sites: Vec<Span>,
    /// What runs instead.
    handler: StepId,
}

impl Interpreter<'_, '_> {
    /// Reports a failure that comes for certain, unless a handler takes it. If that is one for all failures, it is reported at the end of the
    /// plan: the same step may succeed in another turn, or in another call.
    pub(super) fn unless_taken(&mut self, failure: &str, tell: impl FnOnce(&mut Self)) {
        let Some(net) = self.caught.iter().rev().find(|net| net.takes(failure)) else { return tell(self) };
        let (Some(None), Some(handler)) = (net.name(failure), net.any) else { return };
        if self.quiet > 0 {
            return;
        }
        let sites: Vec<Span> = self.sites.iter().skip(net.sites).map(|site| site.span).collect();
        let known = std::mem::take(&mut self.findings);
        tell(self);
        let new = std::mem::replace(&mut self.findings, known);
        for finding in new {
            if !self.swallowed.iter().any(|s| s.handler == handler && s.finding.is_like(&finding)) {
                self.swallowed.push(Swallowed { finding, failure: failure.to_owned(), sites: sites.clone(), handler });
            }
        }
    }

    /// The same of a wait, which fails with `timeout`. One without a limit raises nothing that a handler could take.
    pub(super) fn unless_timeout_taken(&mut self, limited: bool, tell: impl FnOnce(&mut Self)) {
        if limited { self.unless_taken("timeout", tell) } else { tell(self) }
    }

    /// Notes that a statement came to its end.
    pub(super) fn came_to_end(&mut self, site: Span) {
        if self.caught.iter().any(|net| net.any.is_some()) {
            self.succeeded.insert(site);
        }
    }

    /// Reports the failures that handlers for all failures took of statements that never came to their end. If the handler fails in turn,
    /// nothing was handled, and the finding is as grave as without it.
    pub(super) fn tell_swallowed(&mut self) {
        for Swallowed { finding, failure, sites, handler } in std::mem::take(&mut self.swallowed) {
            if sites.is_empty() || sites.iter().all(|site| self.succeeded.contains(site)) {
                continue;
            }
            let said = |f: &Finding| f.is_error() && f.place().0 == finding.place().0 || f.is_like(&finding);
            if self.findings.iter().any(said) {
                continue;
            }
            let failure = self.is_handler(handler).then_some(failure.as_str());
            let finding = finding.taken_by(self.plan.get(handler).span, failure);
            let rescued = self.rescued.contains(&handler);
            self.findings.push(if rescued { finding.softened() } else { finding });
        }
    }

    /// Whether a step is the body of a handler, not an alternative of `try`.
    fn is_handler(&self, id: StepId) -> bool {
        let handles = |step: &PlanStep| match &step.step {
            Step::Guarded { handlers, .. } => handlers.iter().any(|(_, handler)| *handler == id),
            _ => false,
        };
        self.plan.steps.iter().any(handles)
    }
}
