//! Bodies with handlers and `finally`, and bodies that a handler begins again.

use matterix_ir::plan::{Caught, PlanStep, Step, StepId};
use matterix_ir::{NodeId, Span};

use super::clashing::CLAIMED;
use super::state::AbstractState;
use super::swallowed::Net;
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, Raised};

/// So many times a body that is begun again is followed; what further turns change is not known.
const MOST_RETRIES: u32 = 3;

/// A body with handlers.
struct Guard<'g> {
    id: StepId,
    base: &'g AbstractState,
    body: StepId,
    handlers: &'g [(Caught, StepId)],
    /// The handlers stand in the library: they are for devices that fail, not for mistakes in the plan.
    library: bool,
}

/// What comes of a body with handlers that was followed once.
#[derive(Default)]
struct Attempt {
    after: Option<AbstractState>,
    raised: Vec<Raised>,
    again: Vec<Again>,
}

/// A handler that begins its body again.
struct Again {
    /// The failures that it has taken.
    names: Vec<String>,
    /// How often it does so.
    times: AbstractValue,
    facts: AbstractState,
    /// The `fail` that it has taken, where there was one, with its name.
    fail: Option<(String, Span)>,
}

impl Interpreter<'_, '_> {
    pub(super) fn guarded(
        &mut self,
        id: StepId,
        body: StepId,
        handlers: &[(Caught, StepId)],
        finally: Option<StepId>,
        facts: AbstractState,
    ) -> Option<AbstractState> {
        let library = self.in_library(self.plan.get(id).span);
        let guard = Guard { id, base: &facts, body, handlers, library };
        self.reported.push(Vec::new());
        self.finally.extend(finally);
        let first = self.attempt(&guard, facts.clone(), false);
        let reported = self.reported.pop().unwrap_or_default();
        let Attempt { mut after, mut raised, .. } = self.retried(&guard, first);
        if let Some(finally) = finally {
            self.finally.pop();
            (after, raised) = self.leaving(id, finally, &facts, after, raised);
        }
        self.after_report(&facts, reported, handlers, finally);
        raised = self.stop_jobs(raised, self.guards.len());
        if !self.jobs.is_empty() {
            raised.iter_mut().for_each(|(_, facts)| self.stop_short(self.guards.len(), facts));
        }
        if let Some(outer) = self.guards.last_mut() {
            outer.extend(raised);
        }
        after
    }

    /// Follows a body, then the handlers of what it raises. In its last turn a handler that begins it again takes nothing.
    fn attempt(&mut self, guard: &Guard<'_>, facts: AbstractState, last: bool) -> Attempt {
        let takes = |(_, handler): &&(Caught, StepId)| !(last && self.retries(*handler));
        let name = |(caught, _): &(Caught, StepId)| match caught {
            Caught::Named(name) => Some(name.clone()),
            Caught::Any => None,
        };
        let taking = || guard.handlers.iter().filter(takes).filter(|_| !guard.library);
        let any = taking().find(|(caught, _)| *caught == Caught::Any).map(|(_, handler)| *handler);
        let names = taking().map(name).collect();
        self.caught.push(Net { names, any, sites: self.sites.len() });
        self.guards.push(Vec::new());
        let takes_clashes = guard.handlers.iter().any(|(caught, _)| match caught {
            Caught::Named(name) => name == CLAIMED,
            Caught::Any => !guard.library,
        });
        let mut after = self.walk(guard.body, facts);
        after = self.end_body(after);
        let mut raised = self.guards.pop().unwrap_or_default();
        if takes_clashes {
            raised.extend(self.clashed(guard.body, guard.base).map(|facts| (CLAIMED.to_owned(), facts)));
        }
        self.caught.pop();
        let mut again = Vec::new();
        // What handlers raise leaves as well.
        self.guards.push(Vec::new());
        for (caught, handler) in guard.handlers {
            let (taken, rest): (Vec<_>, Vec<_>) = raised.into_iter().partition(|(name, _)| match caught {
                Caught::Named(n) => n == name,
                Caught::Any => true,
            });
            raised = rest;
            let mut names: Vec<String> = taken.iter().map(|(name, _)| name.clone()).collect();
            names.sort_unstable();
            names.dedup();
            let fail = taken.iter().find_map(|(name, facts)| Some((name.clone(), self.fail_at(facts.written?)?)));
            if let Some(mut entry) = self.entry(guard.id, guard.base, taken) {
                entry.written = None;
                let unsure = entry.unsure;
                self.cleaning += 1;
                self.doubt += usize::from(unsure);
                self.open += 1;
                self.again.push(Vec::new());
                let end = self.walk(*handler, entry);
                let begun = self.again.pop().unwrap_or_default();
                let raised = self.guards.last().into_iter().flatten();
                if end.is_some() || !begun.is_empty() || raised.into_iter().any(|(name, _)| self.is_taken(name)) {
                    self.rescued.insert(*handler);
                }
                self.open -= 1;
                self.doubt -= usize::from(unsure);
                self.cleaning -= 1;
                let once_more = |(times, facts)| Again { names: names.clone(), times, facts, fail: fail.clone() };
                again.extend(begun.into_iter().map(once_more));
                after = self.meet(guard.id, guard.base, after.into_iter().chain(end));
            }
        }
        raised.extend(self.guards.pop().unwrap_or_default());
        Attempt { after, raised, again }
    }

    /// Follows a body again as often as its handlers begin it; then their failures go on outwards.
    fn retried(&mut self, guard: &Guard<'_>, first: Attempt) -> Attempt {
        let Attempt { mut after, mut raised, mut again } = first;
        let fail =
            again.iter().find_map(|a| a.fail.clone()).filter(|(name, _)| after.is_none() && !self.is_taken(name));
        for turn in 1..=MOST_RETRIES {
            let (more, over): (Vec<_>, Vec<_>) = again.into_iter().partition(|a| a.times.bounds().1 >= f64::from(turn));
            raised.extend(over.into_iter().flat_map(Again::given_up));
            let most = more.iter().map(|a| a.times.bounds().1).fold(0.0, f64::max);
            let Some(mut entry) = self.entry(guard.id, guard.base, more.iter().flat_map(Again::raised).collect())
            else {
                again = Vec::new();
                break;
            };
            let last = most <= f64::from(turn);
            if turn == MOST_RETRIES && !last {
                self.widen(guard.body, &mut entry);
                self.pass(&AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown), &mut entry);
            }
            let (doubt, quiet) = (usize::from(after.is_some()), usize::from(entry.unsure));
            entry.unsure |= turn == MOST_RETRIES && !last;
            self.cleaning += 1;
            self.doubt += doubt;
            self.quiet += quiet;
            self.once_more(true);
            let next = self.attempt(guard, entry, last);
            self.once_more(false);
            self.quiet -= quiet;
            self.doubt -= doubt;
            self.cleaning -= 1;
            after = self.meet(guard.id, guard.base, after.into_iter().chain(next.after));
            raised.extend(next.raised);
            again = next.again;
        }
        raised.extend(again.into_iter().flat_map(Again::given_up));
        if let Some((name, place)) = fail.filter(|_| after.is_none()) {
            self.retried_in_vain(&name, place);
        }
        Attempt { after, raised, again: Vec::new() }
    }

    /// The place, if a `fail` stands there.
    fn fail_at(&self, place: Span) -> Option<Span> {
        let fails = |s: &PlanStep| s.span == place && matches!(s.step, Step::Fail { .. });
        self.plan.steps.iter().any(fails).then_some(place)
    }

    /// A handler begins its body again.
    pub(super) fn begins_again(&mut self, times: NodeId, facts: AbstractState) {
        let times = self.eval(times, &facts);
        if let Some(again) = self.again.last_mut() {
            again.push((times, facts));
        }
    }

    /// What is known where failures lead to one place.
    pub(super) fn entry(&mut self, id: StepId, base: &AbstractState, raised: Vec<Raised>) -> Option<AbstractState> {
        let mut ways: Vec<AbstractState> = raised.into_iter().map(|(_, facts)| facts).collect();
        if let Some(way) = self.fork(id, &ways) {
            return Some(ways.swap_remove(way));
        }
        let site = self.site();
        ways.into_iter().reduce(|a, b| base.join(a, &b, site, Imprecision::Paths))
    }

    /// What is known behind a `finally`: on the way that goes on, and where failures go on outwards. What goes wrong in it is
    /// said once.
    fn leaving(
        &mut self,
        id: StepId,
        finally: StepId,
        base: &AbstractState,
        after: Option<AbstractState>,
        raised: Vec<Raised>,
    ) -> (Option<AbstractState>, Vec<Raised>) {
        self.cleaning += 1;
        let mut said = after.is_some();
        let after = after.and_then(|facts| self.walk(finally, facts));
        let mut names: Vec<&str> = Vec::new();
        raised.iter().for_each(|(name, _)| {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        });
        let mut left = Vec::new();
        for name in names {
            let alike: Vec<Raised> = raised.iter().filter(|(other, _)| other == name).cloned().collect();
            let Some(entry) = self.entry(id, base, alike) else { continue };
            let end = match std::mem::replace(&mut said, true) {
                false => self.walk(finally, entry),
                true => {
                    self.quiet += 1;
                    self.once_more(true);
                    let end = self.walk(finally, entry);
                    self.once_more(false);
                    self.quiet -= 1;
                    end
                }
            };
            left.extend(end.map(|end| (name.to_owned(), end)));
        }
        self.cleaning -= 1;
        (after, left)
    }
}

impl Again {
    /// Its failures with what is known.
    fn raised(&self) -> impl Iterator<Item = Raised> {
        self.names.iter().map(|name| (name.clone(), self.facts.clone()))
    }

    /// Its failures go on outwards.
    fn given_up(self) -> impl Iterator<Item = Raised> {
        let Again { names, facts, .. } = self;
        names.into_iter().map(move |name| (name, facts.clone()))
    }
}
