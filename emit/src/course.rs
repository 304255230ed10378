//! Whether the course of a workflow is decided before it begins: by its text, not by what is measured on the way.
//!
//! A value is *open* where it depends on a reading, on time, or on a state that laws or events change, or that an operation
//! sets to something open. The rest follows from the plan alone, such as which tip is the next or how many strokes a volume
//! takes.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Model};
use matterix_ir::plan::{Condition, Plan, Step};
use matterix_ir::script::Wiring;
use matterix_ir::{Diagnostic, NodeId, Op, Program, Sources, Span, codes};

use crate::finding::{in_order, not_expressible};
use crate::performance::{Act, Deed};
use crate::place;

/// What a target can say beside one thing after another.
#[derive(Clone, Copy, Debug, Default)]
pub struct Means {
    /// Things that are done at the same time.
    pub beside: bool,
    /// Waits for conditions.
    pub conditions: bool,
    /// What becomes of a failure.
    pub handlers: bool,
}

/// What is open.
struct Course<'p> {
    model: &'p Model,
    states: BTreeSet<u32>,
    locals: BTreeSet<u32>,
}

impl<'p> Course<'p> {
    fn of(program: &'p Program) -> Self {
        let (model, plan) = (&program.model, &program.plan);
        let mut states: BTreeSet<u32> = model.derivatives.iter().map(|d| d.state).collect();
        states.extend(model.events.iter().flat_map(|e| &e.actions).flat_map(|a| written(model, a)));
        let locals = plan.steps.iter().flat_map(|s| match &s.step {
            Step::Named { start, end, .. } => vec![*start, *end],
            _ => Vec::new(),
        });
        let mut course = Course { model, states, locals: locals.collect() };
        while course.spread(plan) {}
        course
    }

    fn is_open(&self, node: NodeId) -> bool {
        self.model.graph.depends(node, |op| match op {
            Op::Reading(_) | Op::Time => true,
            Op::State(s) => self.states.contains(s),
            Op::Local(l) => self.locals.contains(l),
            _ => false,
        })
    }

    /// Opens what depends on something open; whether there was anything.
    fn spread(&mut self, plan: &Plan) -> bool {
        let before = (self.states.len(), self.locals.len());
        for step in &plan.steps {
            match &step.step {
                Step::Let { local, value } if !self.locals.contains(local) && self.is_open(*value) => {
                    self.locals.insert(*local);
                }
                Step::Operation(operation) => {
                    for action in operation.at_start.iter().chain(&operation.at_end) {
                        self.follow(action);
                    }
                }
                _ => {}
            }
        }
        before != (self.states.len(), self.locals.len())
    }

    fn follow(&mut self, action: &Action) {
        match action {
            Action::Assign { state, value, .. } => {
                if !self.states.contains(state) && self.is_open(*value) {
                    self.states.insert(*state);
                }
            }
            Action::Move { .. } if action.sources().any(|node| self.is_open(node)) => {
                self.states.extend(written(self.model, action))
            }
            Action::Move { from, to, .. } => {
                let extensive =
                    |i: &u32| self.model.mixtures.get(*i as usize).map(|m| m.extensive.as_slice()).unwrap_or_default();
                let source: BTreeMap<&str, u32> = extensive(from).iter().map(|(k, s)| (k.as_str(), *s)).collect();
                let open = extensive(to)
                    .iter()
                    .filter(|(k, _)| source.get(k.as_str()).is_some_and(|s| self.states.contains(s)));
                let open: Vec<u32> = open.map(|(_, s)| *s).collect();
                self.states.extend(open);
            }
        }
    }
}

/// States that an action writes.
fn written(model: &Model, action: &Action) -> Vec<u32> {
    match action {
        Action::Assign { state, .. } => vec![*state],
        Action::Move { from, to, .. } => {
            let mixtures = [from, to].into_iter().filter_map(|i| model.mixtures.get(*i as usize));
            mixtures.flat_map(|m| m.extensive.iter().map(|(_, s)| *s)).collect()
        }
    }
}

/// What of a performed workflow a target cannot say, by what decides its course; `what` is the target in words.
pub fn open(
    program: &Program,
    wiring: &Wiring,
    sources: &Sources,
    acts: &[Act],
    means: Means,
    what: &str,
) -> Vec<Diagnostic> {
    let course = Course::of(program);
    let plan = &program.plan;
    let origins = place::origins(plan, sources);
    let library = |span: Span| sources.get(span.file).is_none_or(|f| f.name.contains("::"));
    let mut found = Vec::new();
    let mut say = |span: Span, headline: String, label: &str, help: &str| {
        found.push(not_expressible(span, headline, label).help(help));
    };
    let mut handled: Vec<(Span, Span)> = Vec::new();
    let decided = |c: &Condition| !course.is_open(c.node);
    for (index, step) in plan.steps.iter().enumerate() {
        let at = origins.get(index).copied().unwrap_or(step.span);
        let own = |span: Span| if library(span) { at } else { span };
        match &step.step {
            Step::If { condition, .. } | Step::RepeatWhile { condition, .. } if !decided(condition) => say(
                own(condition.span),
                format!("{what} cannot branch on `{}`", condition.text),
                "known only during the run",
                "branch on a value known from the text, or write one workflow for each case",
            ),
            Step::Repeat { times, .. } if course.is_open(*times) => say(
                at,
                format!("{what} needs a fixed number of turns"),
                "known only during the run",
                "write the number of turns",
            ),
            Step::Wait { duration } if course.is_open(*duration) => {
                say(at, format!("{what} needs a fixed duration"), "known only during the run", "write the duration")
            }
            Step::WaitUntil { condition, .. } | Step::Hold { condition, .. } if !means.conditions => say(
                own(condition.span),
                format!("{what} cannot wait for `{}`", condition.text),
                "known only during the run",
                "wait for a fixed, sufficient time: `wait 10 min`",
            ),
            Step::Keep { condition, .. } if !decided(condition) => say(
                own(condition.span),
                format!("{what} cannot monitor `{}`", condition.text),
                "known only during the run",
                "remove `keep`, and judge a run with `matterixc run`",
            ),
            Step::Within { .. } if !means.beside => say(
                at,
                format!("{what} has no clock for this time window"),
                "a window of time",
                "remove the window; `matterixc check` tells if it can be kept",
            ),
            Step::Guarded { handlers, .. } if !means.handlers => {
                handled.extend(handlers.iter().map(|(_, handler)| (at, plan.get(*handler).span)));
            }
            Step::Try(list) if list.len() > 1 && !means.handlers => say(
                at,
                format!("{what} ends with the first failure: it would never try the alternative"),
                "alternatives",
                "write one of the alternatives",
            ),
            Step::Parallel(list) if list.len() > 1 && !means.beside => say(
                at,
                format!("{what} does one step after the other"),
                "steps at the same time",
                "write `sequence`, in the intended order",
            ),
            Step::Start { .. } if !means.beside => say(
                at,
                format!("{what} does one step after the other"),
                "runs beside the next steps",
                "put its steps where they should run",
            ),
            _ => {}
        }
    }
    for (step, condition) in &wiring.awaited {
        if acts.iter().any(|act| act.step == *step && act.deed == Deed::Awaited { holds: false }) {
            let at = origins.get(step.0 as usize).copied().unwrap_or_default();
            say(
                if library(condition.span) { at } else { condition.span },
                format!("{what} would go on before `{}` holds", condition.text),
                "the device waits by itself until it is at its set point, to its tolerance, and this does not hold there",
                "wait for what holds there, or for a fixed, sufficient time",
            );
        }
    }
    for act in acts.iter().filter(|a| matches!(a.deed, Deed::Operation(Some(_)))) {
        let messages = wiring.steps.get(&act.step).into_iter().flatten();
        if messages.flat_map(crate::performance::nodes_of).any(|n| course.is_open(n)) {
            let at = origins.get(act.step.0 as usize).copied().unwrap_or_default();
            let label = format!("`{}` depends on it", plan.get(act.step).label);
            say(
                at,
                format!("{what} needs every value before the run"),
                &label,
                "write a fixed value instead of a measured one",
            );
        }
    }
    for (at, handler) in handled {
        let headline = format!("{what} ends with the first failure: a handler would never run");
        found.push(if library(handler) {
            let label = "a skill of the library handles a failure here";
            Diagnostic::warning(codes::NOT_EXPRESSIBLE, at, headline, label)
        } else {
            let help = "remove the handler: a person must look after a run that fails";
            not_expressible(handler, headline, "a failure handler").help(help)
        });
    }
    in_order(found)
}
