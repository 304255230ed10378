//! Whose fault it is: the law, its line and the operation in it that leave a number without a value, or outrun every step.
//!
//! A rate is a sum of lines of laws, and a flow that a law reads is such a sum again: the cause is looked for through flows until
//! a law is found that has it from no other.

use matterix_ir::model::{Balance, Contribution, Derivative, Doubt, Flow};
use matterix_ir::undefined::{self, undefined};
use matterix_ir::{NodeId, Span, codes};

use super::Engine;
use super::integrator::Stuck;
use crate::fault::Fault;
use crate::ledger::BalanceReport;

/// So many lines of a law that makes or loses something are shown.
const MOST_LINES: usize = 4;

/// How far ahead a law is looked at that no step can follow, as shares of the time since the run began.
const AHEAD: [f64; 3] = [1e-13, 1e-11, 1e-9];

impl<'m> Engine<'m> {
    /// The fault of a state whose rate is not finite: at the line of the innermost law that has no value.
    pub(super) fn no_rate(&self, state: u32) -> Fault {
        let declared = &self.model.states[state as usize];
        let Some(derivative) = self.model.derivatives.iter().find(|d| d.state == state) else {
            return self.no_value(state, f64::NAN);
        };
        let headline = format!("the rate of `{}` has no finite value", declared.name);
        let endless = |nodes: &[Contribution]| nodes.iter().find(|t| !self.gives(t).is_finite()).copied();
        match self.innermost(&derivative.terms, endless) {
            Some((term, flow)) => {
                let law = self.law_of(&term);
                let fault = self.without_value(headline, term.node, Some(&law), term.span);
                match flow {
                    Some(flow) => fault.help(format!("it is part of `{}`", flow.name)),
                    None => fault,
                }
            }
            None => self.with_running(self.without_value(headline, derivative.rate, None, declared.span)),
        }
    }

    /// The fault of a state that is, or would be, no finite number.
    pub(super) fn no_value(&self, state: u32, value: f64) -> Fault {
        let declared = &self.model.states[state as usize];
        let message = format!("`{}` has no finite value: it is {value}", declared.name);
        self.with_running(Fault::new(codes::NOT_A_NUMBER, self.time, message).at(declared.span))
    }

    /// The fault of a state that has no finite value when the run begins.
    pub(super) fn no_beginning(&self, state: u32) -> Fault {
        let declared = &self.model.states[state as usize];
        let headline = format!("`{}` has no finite value at the start", declared.name);
        self.without_value(headline, declared.initial, None, declared.span)
    }

    /// The fault of an assignment to a state that is no finite number; `who` makes it.
    pub(super) fn no_effect(&self, state: u32, value: NodeId, who: Option<&str>, span: Span) -> Fault {
        let headline = format!("`{}` would have no finite value", self.model.states[state as usize].name);
        self.without_value(headline, value, who, span)
    }

    /// The fault of a transfer of a share that is no finite number.
    pub(super) fn no_share(&self, fraction: NodeId, stays: bool, who: Option<&str>, span: Span) -> Fault {
        let what = if stays { "share that is to stay behind" } else { "transferred fraction" };
        let headline = format!("the {what} has no finite value");
        let fault = self.without_value(headline, fraction, who, span);
        Fault { code: codes::TRANSFER_FRACTION, ..fault }.help("is the source empty?")
    }

    /// Fails where a value of the plan is none now; the fault has no place but that of the operation.
    pub(crate) fn defined(&self, node: NodeId) -> Result<(), Fault> {
        let graph = &self.model.graph;
        let Some(operation) = undefined(graph, node, &mut |n| Some(self.eval(n))) else { return Ok(()) };
        let why = undefined::why(graph, operation);
        let message = format!("this has no value: {why}{}", self.values_below(operation));
        Err(Fault::new(codes::NOT_A_NUMBER, self.time, message))
    }

    /// A fault at `span` whose cause is the operation below `root` that leaves it without a value, which `law` says.
    pub(super) fn without_value(&self, headline: String, root: NodeId, law: Option<&str>, span: Span) -> Fault {
        let within = law.map_or(String::new(), |law| format!(" in `{law}`"));
        let Some(operation) = self.failing(root) else {
            let message = if within.is_empty() { headline } else { format!("{headline}{within}") };
            return Fault::new(codes::NOT_A_NUMBER, self.time, message).at(span);
        };
        let (why, values) = (self.why(operation), self.values_below(operation));
        let message = format!("{headline}: {why}{within}{values}");
        let fault = Fault::new(codes::NOT_A_NUMBER, self.time, message).at(span);
        let places = &self.model.places;
        let place = places.binary_search_by_key(&operation, |place| place.node).ok().map(|i| places[i].span);
        match place.filter(|at| !(at.file == span.file && span.start <= at.start && at.end <= span.end)) {
            Some(at) => fault.because(at, why),
            None => fault,
        }
    }

    /// The first operation below `root` that turns finite numbers into something else, or else the first value that is none.
    fn failing(&self, root: NodeId) -> Option<NodeId> {
        let graph = &self.model.graph;
        undefined(graph, root, &mut |n| Some(self.eval(n)))
            .or_else(|| graph.schedule([root]).into_iter().find(|&n| !self.eval(n).is_finite()))
    }

    /// The contribution that `pick` takes of a sum, followed through the flows that it uses to the law that has its value from no
    /// other; and the last of these flows.
    fn innermost(
        &self,
        terms: &'m [Contribution],
        pick: impl Fn(&[Contribution]) -> Option<Contribution>,
    ) -> Option<(Contribution, Option<&'m Flow>)> {
        let (mut found, mut through) = (pick(terms)?, None);
        let mut left: Vec<&'m Flow> = self.model.flows.iter().collect();
        loop {
            let below = self.model.graph.schedule([found.node]);
            let uses = |flow: &&Flow| below.binary_search(&flow.node).is_ok();
            let next = left.iter().position(|flow| uses(flow) && pick(&flow.terms).is_some());
            let Some((flow, term)) = next.and_then(|i| {
                let flow = left.swap_remove(i);
                Some((flow, pick(&flow.terms)?))
            }) else {
                return Some((found, through));
            };
            (found, through) = (term, Some(flow));
        }
    }

    /// What a contribution adds now, SI per second; 0 while its process rests.
    fn gives(&self, term: &Contribution) -> f64 {
        let guard = self.model.processes.get(term.process as usize).and_then(|p| p.guard);
        if guard.is_none_or(|guard| self.truth(guard)) { self.eval(term.node) } else { 0.0 }
    }

    fn law_of(&self, term: &Contribution) -> String {
        self.model.processes.get(term.process as usize).map_or_else(String::new, |p| p.name.clone())
    }

    /// The fault of an integration that finds no step: at the line that changes fastest what changes fastest.
    pub(super) fn stuck(&self, stuck: Stuck, part: u32) -> Fault {
        let moving = self.course.parts.get(part).map_or(&[][..], |part| part.moving());
        if let Stuck::Busy = stuck {
            return self.restless(None);
        }
        if let Some(fault) = self.run_dry() {
            return fault;
        }
        if let Some(fault) = self.lost_ahead(moving) {
            return fault;
        }
        let rates = self.model.derivatives.iter().filter(|d| moving.contains(&d.state));
        let pace = |d: &Derivative| {
            let (state, value) = (&self.model.states[d.state as usize], self.state(d.state));
            self.eval(d.rate).abs() / (value.abs() + state.scale.unwrap_or(self.sizes[d.state as usize]).abs())
        };
        let Some(fastest) = rates.max_by(|a, b| pace(a).total_cmp(&pace(b))) else {
            return Fault::new(codes::INTEGRATION_FAILED, self.time, "the integrator finds no step short enough");
        };
        if !self.eval(fastest.rate).is_finite() {
            return self.no_rate(fastest.state);
        }
        let state = &self.model.states[fastest.state as usize];
        let message = format!("`{}` changes too fast for the integrator", state.name);
        let most = |terms: &[Contribution]| {
            let size = |t: &&Contribution| self.gives(t).abs();
            terms.iter().max_by(|a, b| size(a).total_cmp(&size(b))).filter(|t| size(t) > 0.0).copied()
        };
        let fault = |message| Fault::new(codes::INTEGRATION_FAILED, self.time, message);
        match self.innermost(&fastest.terms, most) {
            Some((term, _)) => {
                let message = format!("{message}, mostly because of `{}`", self.law_of(&term));
                self.with_running(fault(message).at(term.span))
            }
            None => self.with_running(fault(message).at(state.span)),
        }
    }

    /// The fault of a law that has no value any more a moment further on, if what moves goes on as it does: the root of an amount that
    /// falls below zero.
    fn lost_ahead(&self, moving: &[u32]) -> Option<Fault> {
        let rates: Vec<&Derivative> = self.model.derivatives.iter().filter(|d| moving.contains(&d.state)).collect();
        let slopes: Vec<(u32, f64)> = rates.iter().map(|d| (d.state, self.eval(d.rate))).collect();
        if slopes.iter().any(|(_, slope)| !slope.is_finite()) {
            return None;
        }
        AHEAD.into_iter().find_map(|share| {
            let passed = share * self.time;
            let mut states = self.states();
            slopes.iter().for_each(|(state, slope)| states[*state as usize] += slope * passed);
            let ahead = self.supposed(self.time + passed, states);
            let lost = rates.iter().find(|d| !ahead.eval(d.rate).is_finite())?;
            Some(Fault { time: self.time, ..ahead.no_rate(lost.state) })
        })
    }

    /// The fault of a law or condition that follows the clock too fast.
    pub(super) fn restless(&self, node: Option<NodeId>) -> Fault {
        let place = node.and_then(|node| self.user_of(node));
        let name = place.map_or("a law".to_owned(), |(name, _)| format!("`{name}`"));
        let message = format!("{name} changes with time more often than a run can follow");
        let fault = Fault::new(codes::INTEGRATION_FAILED, self.time, message)
            .help("give it a longer period, or use its mean over time");
        match place {
            Some((_, span)) => fault.at(span),
            None => fault,
        }
    }

    /// The event, process or state whose condition or rate uses a comparison, and where it stands: a line, where a law does.
    pub(super) fn user_of(&self, node: NodeId) -> Option<(&'m str, Span)> {
        let model = self.model;
        let uses = |root: NodeId| root.0 >= node.0 && model.graph.schedule([root]).contains(&node);
        if let Some(event) = model.events.iter().find(|e| uses(e.when)) {
            return Some((&event.name, event.span));
        }
        if let Some(process) = model.processes.iter().find(|p| p.guard.is_some_and(uses)) {
            return Some((&process.name, process.span));
        }
        // A flow stands before what uses it.
        let flows = model.flows.iter().flat_map(|flow| &flow.terms);
        let rates = model.derivatives.iter().flat_map(|d| &d.terms);
        if let Some(term) = flows.chain(rates).find(|term| uses(term.node)) {
            return Some((&model.processes.get(term.process as usize)?.name, term.span));
        }
        let rate = model.derivatives.iter().find(|d| uses(d.rate))?;
        let state = &model.states[rate.state as usize];
        Some((&state.name, state.span))
    }

    /// The fault with the processes that run, where it is not known which is at fault.
    fn with_running(&self, fault: Fault) -> Fault {
        let processes = self.model.processes.iter().zip(&self.running).filter(|(_, running)| **running);
        let names: Vec<String> = processes.map(|(p, _)| format!("`{}`", p.name)).take(5).collect();
        if names.is_empty() { fault } else { fault.help(format!("running now: {}", names.join(", "))) }
    }

    /// The fault of a sum that does not close: at the law that breaks it and its lines, else at `cause`.
    pub(super) fn breach(&self, report: &BalanceReport, balance: &Balance, cause: Option<Span>) -> Fault {
        let (unit, accounted) = (&balance.unit, report.initial + report.exchanged);
        let did = |d: &&Doubt| self.state(d.state).abs();
        let culprit = balance.doubts.iter().max_by(|a, b| did(a).total_cmp(&did(b))).filter(|d| did(d) > 0.0);
        let process = culprit.and_then(|d| Some((d.process, self.model.processes.get(d.process as usize)?, did(&d))));
        let sums = format!("the lab holds {}, but {} is accounted for", unit.show(report.now), unit.show(accounted));
        let (message, span) = match process {
            Some((_, process, by)) => {
                let verb = if report.error > 0.0 { "made" } else { "lost" };
                let text = format!("`{}` {verb} {} of {}: {sums}", process.name, unit.show(by), report.name);
                (text, Some(process.span))
            }
            None => (format!("the balance of {} does not close: {sums}", report.name), cause),
        };
        let mut fault = Fault::new(codes::BALANCE_BREACH, self.time, message);
        fault.span = span;
        for (at, by) in process.map_or_else(Vec::new, |(index, ..)| self.lines_of(index, balance)) {
            let verb = if by > 0.0 { "adds" } else { "removes" };
            fault = fault.because(at, format!("{verb} {} per s now", unit.show(by.abs())));
        }
        fault.help(format!("the difference is {}", unit.show(report.error)))
    }

    /// The lines of a process that add to a sum or take from it, with how much they do now, SI per second.
    fn lines_of(&self, process: u32, balance: &Balance) -> Vec<(Span, f64)> {
        let mut lines: Vec<(Span, f64)> = Vec::new();
        for derivative in &self.model.derivatives {
            let Some((_, factor)) = balance.terms.iter().find(|(state, _)| *state == derivative.state) else {
                continue;
            };
            for term in derivative.terms.iter().filter(|term| term.process == process) {
                let by = factor * self.gives(term);
                match lines.iter_mut().find(|(span, _)| *span == term.span) {
                    Some((_, sum)) => *sum += by,
                    None => lines.push((term.span, by)),
                }
            }
        }
        lines.retain(|(_, by)| by.is_finite() && *by != 0.0);
        lines.truncate(MOST_LINES);
        lines
    }
}
