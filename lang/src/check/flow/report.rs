//! Findings with their history.

use std::collections::BTreeSet;

use matterix_ir::model::{Action, Domain};
use matterix_ir::plan::{Condition, Limit, Step};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Code, Diagnostic, NodeId, Severity, Span, codes};

use super::state::AbstractState;
use super::trace_partitioning::Place;
use super::value::{AbstractValue, Imprecision};
use super::{Interpreter, forbidden_on_any_way, only_advice};

/// A finding, and how often it was made.
#[derive(Clone)]
pub struct Finding {
    diagnostic: Diagnostic,
    /// The condition or construct it is about.
    about: Span,
    count: usize,
    /// How many ways had met before it, where it was made on some of them.
    some: Option<usize>,
    /// It was made in a turn of a loop, and other branches or jobs may undo what it comes of.
    turn: bool,
    /// So many choices and handlers are around of which a run may take another way.
    open: usize,
    /// It comes up in one order of branches or jobs, and something else does in the other.
    one_order: bool,
    /// It is what a written failure leaves that ends the workflow.
    by_failure: bool,
}

/// The failure of a need that names none.
const UNNAMED: &str = "need";

impl Finding {
    /// Whether another one says the same of the same place.
    pub fn is_like(&self, other: &Finding) -> bool {
        self.diagnostic.code == other.diagnostic.code
            && self.diagnostic.span() == other.diagnostic.span()
            && self.about == other.about
    }

    /// Counts it once more, on ways of which so many had met before, where so many choices and handlers are open.
    fn count_again(&mut self, some: Option<usize>, open: usize) {
        self.count += 1;
        self.open = self.open.min(open);
        self.some = self.some.zip(some).map(|(old, new)| old.min(new));
    }

    /// Says that it holds only where a device reports one of these failures.
    pub fn only_where_reported(&mut self, names: &[String]) {
        let names: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
        self.diagnostic.severity = Severity::Warning;
        self.diagnostic.help.push(format!("this happens if a device reports {}", names.join(" or ")));
    }

    /// The statement it is at, and what it is about.
    pub(super) fn place(&self) -> Place {
        (self.diagnostic.span(), self.about)
    }

    /// Where it was made, if that was on some ways only, and how many had met before.
    pub(super) fn open_at(&self) -> Option<(Place, usize)> {
        Some((self.place(), self.some?))
    }

    /// Whether every run comes to it that comes to where so many choices and handlers are open, whatever order branches and jobs are done in.
    pub(super) fn is_come_to(&self, open: usize) -> bool {
        !self.turn && self.open <= open
    }

    /// The same as a warning.
    pub(super) fn softened(mut self) -> Finding {
        self.diagnostic.severity = Severity::Warning;
        self
    }

    /// Notes that it comes up in one order of branches or jobs, and something else does in the other.
    pub(super) fn of_one_order(mut self) -> Finding {
        self.one_order = true;
        self
    }

    /// Whether it comes up in one order of branches or jobs, and something else does in the other.
    pub(super) fn is_of_one_order(&self) -> bool {
        self.one_order
    }

    /// Whether it is what a written failure leaves that ends the workflow.
    pub(super) fn is_by_failure(&self) -> bool {
        self.by_failure
    }

    /// The same where a handler for all failures takes `failure` each time, or another alternative follows it each time.
    pub(super) fn taken_by(mut self, handler: Span, failure: Option<&str>) -> Finding {
        let (label, help) = match failure {
            Some(name) => (
                "`on failure` takes this failure each time: the step never succeeds",
                format!("correct the step; if you expect this failure, name it: `on {name} {{ }}`"),
            ),
            None => (
                "this alternative always runs instead: the step never succeeds",
                "correct the step, or remove the alternative that always fails".to_owned(),
            ),
        };
        self.diagnostic = self.diagnostic.because(handler, label).help(help);
        self
    }

    /// The same on some of the ways that lead there.
    pub(super) fn on_some_ways(mut self) -> Finding {
        self.diagnostic.severity = Severity::Warning;
        self.diagnostic.headline.push_str(", on some paths through the workflow");
        self
    }

    /// Whether it is of a kind.
    pub(super) fn is(&self, code: Code) -> bool {
        self.diagnostic.code == code
    }

    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.diagnostic.is_error()
    }
}

/// So many things are named of which the same is asked in vain.
const THINGS_SHOWN: usize = 8;

/// So many steps of the history are shown for one quantity.
pub(super) const STEPS_SHOWN: usize = 3;

impl Interpreter<'_, '_> {
    /// All findings; one that was made several times says so.
    pub fn diagnostics(self) -> Vec<Diagnostic> {
        let said = |f: Finding| match f.count {
            1 => f.diagnostic,
            n => f.diagnostic.help(format!("the same happens {n} times in this run")),
        };
        self.findings.into_iter().map(said).collect()
    }

    /// Adds a finding, or counts it if it was made before.
    pub fn found(&mut self, diagnostic: Diagnostic, about: Span) {
        let turn = self.turning > 0;
        self.found_on(diagnostic, about, None, turn);
    }

    /// Adds what a written failure leaves that ends the workflow.
    pub(super) fn found_by_failure(&mut self, diagnostic: Diagnostic, about: Span) {
        let place = (diagnostic.span(), about);
        let known = self.findings.len();
        self.found(diagnostic, about);
        self.findings.iter_mut().skip(known).filter(|f| f.place() == place).for_each(|f| f.by_failure = true);
    }

    /// Adds a finding that is made on some ways, of which so many had met before.
    fn found_on(&mut self, diagnostic: Diagnostic, about: Span, some: Option<usize>, turn: bool) {
        let severity = diagnostic.severity;
        if self.quiet > 0 || self.is_counted(diagnostic.code, (diagnostic.span(), about), severity, some) {
            return;
        }
        let new =
            Finding { diagnostic, about, count: 1, some, turn, open: self.open, one_order: false, by_failure: false };
        match self.findings.iter_mut().find(|f| f.is_like(&new)) {
            Some(old) => {
                old.count_again(some, new.open);
                old.diagnostic = new.diagnostic;
            }
            None => self.findings.push(new),
        }
    }

    /// Counts a finding that was made before at this place, and was as bad then; whether it was.
    fn is_counted(&mut self, code: Code, place: Place, severity: Severity, some: Option<usize>) -> bool {
        let open = self.open;
        let mut old = self.findings.iter_mut().filter(|f| f.diagnostic.code == code && f.place() == place);
        match old.next().filter(|f| f.is_error() || severity != Severity::Error) {
            Some(old) => {
                old.count_again(some, open);
                true
            }
            None => false,
        }
    }

    /// A need that does not hold: on every way, or on some.
    pub fn unmet(&mut self, label: &str, need: &Condition, facts: &AbstractState, some: bool) {
        // The library's own steps are not what the reader wrote.
        let label = self.sites.last().filter(|s| s.calls).map_or(label.to_string(), |s| s.label.clone());
        let what = match &need.refusal {
            // The name that every need without one of its own has says nothing.
            Some(r) if r.failure == UNNAMED => format!("`{label}` needs `{}`, which is false here", need.text),
            Some(r) => format!("`{label}` fails: {}", r.failure.replace('_', " ")),
            None => format!("`{label}` needs `{}`, which is false here", need.text),
        };
        self.demand(what, "this step fails", need, facts, (some, None));
    }

    /// Something presumed that holds on no way.
    pub fn in_vain(&mut self, label: &str, presumed: &Condition, facts: &AbstractState, warns: bool) {
        let label = self.sites.last().filter(|s| s.calls).map_or(label.to_string(), |s| s.label.clone());
        let what = match &presumed.refusal {
            Some(r) if warns => format!("`{label}` goes wrong: {}", r.failure.replace('_', " ")),
            Some(r) => format!("`{label}` has no effect: {}", r.failure.replace('_', " ")),
            None => format!("`{label}` has no effect: it presumes `{}`, which was never true", presumed.text),
        };
        let severity = warns.then_some(Severity::Warning);
        let so = if warns { "this step goes wrong" } else { "this step is unnecessary" };
        self.demand(what, so, presumed, facts, (false, severity));
    }

    /// A demand that does not hold: in its own words where it has them, which a label at the step then says the consequence of.
    fn demand(
        &mut self,
        what: String,
        so: &str,
        need: &Condition,
        facts: &AbstractState,
        (some, severity): (bool, Option<Severity>),
    ) {
        if self.quiet > 0 {
            return;
        }
        let code = need.code();
        let open = some.then(|| self.ways.meetings());
        let some = some || self.doubt > 0;
        let severity = severity.unwrap_or_else(|| self::severity(code, some));
        let site = self.site();
        // The first that is missing ends a call; what its later steps lack follows from that.
        if self.findings.iter().any(|f| f.is_error() && f.diagnostic.span() == site && f.about != need.span) {
            return;
        }
        // The words of a finding cost as much as the plan is long; those of a known one would not be read.
        if self.is_counted(code, (site, need.span), severity, open) {
            return;
        }
        let failing = self.failing(need, facts);
        let asked = failing.first().copied().unwrap_or(need);
        let words = self.worded(need, facts);
        let what = if words.is_empty() { what } else { words.join(", ") };
        let headline = if some { format!("{what}, on some paths through the workflow") } else { what };
        let measured = if words.is_empty() { self.measured(asked, facts) } else { vec![so.to_owned()] };
        let named = !failing.is_empty() && failing.len() < need.each.len();
        let said = match (named, measured.is_empty()) {
            (true, true) => format!("fails for {}", listed(&failing)),
            (true, false) => format!("fails for {}: {}", listed(&failing), measured.join(", ")),
            (false, true) => "this step fails".to_string(),
            (false, false) => measured.join(", "),
        };
        let mut d = self.at_site(code, headline, said, some);
        d.severity = severity;
        // Words say it without the library's formula.
        if d.span() != need.span && (words.is_empty() || !self.in_library(need.span)) {
            d = d.because(need.span, format!("needed here: `{}`", need.text));
        }
        d = self.history_of(d, asked, facts, !words.is_empty());
        d.help.extend(need.advice());
        let turn = self.turning > 0 && !self.goes_one_way(need);
        self.found_on(d, need.span, open, turn);
    }

    /// Whether a condition is about what vessels hold that the whole plan only fills, or only empties: what is too much or too
    /// little there in one order of the steps is so in every order.
    fn goes_one_way(&mut self, condition: &Condition) -> bool {
        let states = self.parts(condition.node).states.clone();
        let amounts: Vec<u32> = states.into_iter().filter(|s| self.amounts.contains(s)).collect();
        let held = |m: &usize| self.mixtures[*m].iter().any(|(_, s)| amounts.contains(s));
        let mut held: Vec<usize> = (0..self.mixtures.len()).filter(held).collect();
        let (mut gives, mut gains) = (BTreeSet::new(), BTreeSet::new());
        let index = |id: InstanceId| self.lab.mixtures.binary_search(&id).ok();
        for (_, from, to) in self.lab.streams.keys() {
            gives.extend(index(*from));
            gains.extend(index(*to));
        }
        for step in &self.plan.steps {
            let Step::Operation(operation) = &step.step else { continue };
            for action in operation.at_start.iter().chain(&operation.at_end) {
                match action {
                    Action::Move { from, to, .. } => {
                        gives.insert(*from as usize);
                        gains.insert(*to as usize);
                    }
                    Action::Assign { state, .. } if amounts.contains(state) => return false,
                    Action::Assign { .. } => {}
                }
            }
        }
        held.retain(|m| gives.contains(m) || gains.contains(m));
        !held.is_empty() && held.iter().all(|m| gives.contains(m) != gains.contains(m))
    }

    /// Of several things of which the same is asked, those for which it does not hold, or may not.
    fn failing<'c>(&mut self, need: &'c Condition, facts: &AbstractState) -> Vec<&'c Condition> {
        need.each.iter().filter(|asked| self.eval(asked.node, facts).truth() != Some(true)).collect()
    }

    /// A limit of a thing that is passed by what is done, or from the start.
    pub fn passed(&mut self, limit: &Limit, facts: &AbstractState, some: bool) {
        let condition = &limit.condition;
        if let Some(label) = self.sites.last().map(|s| s.label.clone()) {
            return self.unmet(&label, condition, facts, some);
        }
        let code = condition.code();
        // Where too many things stand somewhere, the last of them is what is wrong.
        let owner = self.too_many(condition, facts).map(|s| self.lab.state_owner[s as usize]);
        let about = owner.unwrap_or(limit.instance);
        let (name, span) = (self.lab.spoken_name(about), self.declared_at(about));
        let what = condition.refusal.as_ref().map_or(condition.text.clone(), |r| r.failure.replace('_', " "));
        let words = self.worded(condition, facts);
        let (headline, said) = match words.is_empty() {
            true => (format!("`{name}` is invalid at the start: {what}"), self.measured(condition, facts).join(", ")),
            false => (words.join(", "), "true from the start".to_owned()),
        };
        let mut d = Diagnostic::error(code, span, headline, said);
        if span != condition.span && (words.is_empty() || !self.in_library(condition.span)) {
            d = d.because(condition.span, format!("needed here: `{}`", condition.text));
        }
        d.help.extend(condition.advice());
        self.found(d, condition.span);
    }

    /// Where things stand at the wrong place from the start: the place of the last one without which a limit would hold.
    fn too_many(&mut self, limit: &Condition, facts: &AbstractState) -> Option<u32> {
        let states = self.parts(limit.node).states.clone();
        let mut facts = facts.clone();
        states.into_iter().rev().find(|s| {
            let s = *s as usize;
            if self.lab.states[s].domain != Domain::Instance {
                return false;
            }
            let there = std::mem::replace(&mut facts.states[s], AbstractValue::Point(-1.0));
            let holds = self.eval(limit.node, &facts).truth() == Some(true);
            facts.states[s] = there;
            holds
        })
    }

    /// An expectation that cannot hold.
    pub fn unexpected(&mut self, condition: &Condition, facts: &AbstractState) {
        let some = self.doubt > 0;
        let ways = if some { ", on some paths through the workflow" } else { "" };
        let headline = format!("`{}` is false{ways}", condition.text);
        let measured = self.measured(condition, facts);
        let said = if measured.is_empty() { "expected here".to_string() } else { measured.join(", ") };
        let (code, headline) = match self.not_made(condition, facts) {
            Some(absent) => (codes::NEVER_MADE, format!("{headline}: {absent}")),
            None => (codes::EXPECTATION_FAILED, headline),
        };
        let d = Diagnostic::error(code, condition.span, headline, said);
        let d = Diagnostic { severity: severity(code, some), ..d };
        let d = self.with_history(d, condition, facts);
        let d = match code == codes::NEVER_MADE {
            true => self.with_makers(d, condition),
            false => self.with_ions(d, condition, facts),
        };
        self.found(d, condition.span);
    }

    /// Something that is not in order at an end of the workflow, with the step that left it so.
    pub(super) fn unfinished(&mut self, end: &Limit, ended: &AbstractState, ends: &str) -> Option<Diagnostic> {
        let condition = &end.condition;
        let changed: Vec<(Span, String)> = condition.terms.iter().flat_map(|t| self.history(t, ended)).collect();
        let (span, said) = changed.into_iter().next()?;
        let name = self.lab.spoken_name(end.instance);
        let how = condition.refusal.as_ref().map_or("unfinished".to_string(), |r| r.failure.replace('_', " "));
        let words = self.worded(condition, ended);
        let headline = match words.is_empty() {
            true => format!("`{name}` is {how} {ends}"),
            false => format!("{} {ends}", words.join(", ")),
        };
        let mut d = Diagnostic::warning(codes::UNFINISHED, span, headline, said);
        if !self.in_library(condition.span) {
            d = d.because(condition.span, format!("required here at the end: `{}`", condition.text));
        }
        d.help.extend(condition.advice());
        Some(d)
    }

    /// A body fails for certain with a failure that the text writes, however often a handler begins it again.
    pub(super) fn retried_in_vain(&mut self, name: &str, place: Span) {
        let headline = format!("`retry` cannot help: its steps fail with `{name}` every time");
        let mut d = Diagnostic::error(codes::RUN_FAILED, place, headline, format!("fails with `{name}` on every try"));
        if self.doubt > 0 {
            d.severity = Severity::Warning;
        }
        let d = d.help("remove the cause of the failure in the handler, or raise it only under a condition");
        self.found(d, place);
    }

    /// A wait for something that cannot come: at all, or in the time given.
    pub fn never_comes(&mut self, condition: &Condition, limited: bool, before: &AbstractState, after: &AbstractState) {
        // What is within bounds only is on its way.
        let still = self.eval(condition.node, before) == self.eval(condition.node, after)
            && condition.compared.iter().all(|c| {
                let then = self.eval(c.value, before);
                then.exact().is_some() && then == self.eval(c.value, after)
            });
        let mut ever = before.clone();
        self.pass(&AbstractValue::Range(0.0, f64::INFINITY, Imprecision::Unknown), &mut ever);
        let in_time = limited && self.eval(condition.node, &ever).truth() != Some(false);
        let absent = self.not_made(condition, after);
        let text = &condition.text;
        let (code, headline) = match (&absent, still, in_time) {
            (Some(absent), ..) => (codes::NEVER_MADE, format!("`{text}` never becomes true: {absent}")),
            (None, true, _) => (codes::WAITS_FOR_EVER, format!("`{text}` never becomes true: nothing changes it")),
            (None, false, true) => (codes::NOT_REACHED, format!("`{text}` cannot become true before the timeout")),
            (None, false, false) => (codes::NOT_REACHED, format!("`{text}` is never reached")),
        };
        let measured = self.measured(condition, after);
        let said = if measured.is_empty() { "this step waits for it".to_string() } else { measured.join(", ") };
        let d = self.at_site(code, headline, said, self.doubt > 0);
        let d = self.with_history(d, condition, before);
        let d = match absent.is_some() {
            true => self.with_makers(d, condition),
            false => self.with_ions(d, condition, before),
        };
        self.found(d, condition.span);
    }

    /// A job that is waited for and has not begun, on every way or on some.
    pub(super) fn never_began(&mut self, job: &str, some: bool) {
        let open = some.then(|| self.ways.meetings());
        if some && self.is_cleared(self.site()) {
            return;
        }
        let some = some || self.doubt > 0;
        let ways = if some { ", on some paths through the workflow" } else { "" };
        let headline = format!("job `{job}` has not started at this point{ways}");
        let d = self.at_site(codes::JOB_NOT_BEGUN, headline, "no job to wait for: fails with `job`".to_string(), some);
        let about = d.span();
        let d = d.help(format!("start `{job}` on every path to this point, or `await` it where it was started"));
        let turn = self.turning > 0;
        self.found_on(d, about, open, turn);
    }

    /// Which species a condition wants more of than none, where nothing brings or makes any.
    fn not_made(&mut self, condition: &Condition, facts: &AbstractState) -> Option<String> {
        let (mixture, s) = *self.lab.absent_in.get(&condition.span)?.first()?;
        let none = condition.compared.iter().any(|c| {
            let some = c.low.is_some_and(|n| condition.compared.len() == 1 || self.eval(n, facts).bounds().0 > 0.0);
            some && self.eval(c.value, facts).bounds() == (0.0, 0.0)
        });
        let name = &self.lab.tables.species.get(s).name;
        none.then(|| {
            format!("no step adds `{name}` to `{}`, and no reaction makes it there", self.lab.spoken_name(mixture))
        })
    }

    /// Says where to look for a salt of which nothing is left as it has dissolved.
    fn with_ions(&mut self, d: Diagnostic, condition: &Condition, facts: &AbstractState) -> Diagnostic {
        // A value that is not zero rests on the salt in another way, as a concentration on the volume of all.
        let mut zero: Vec<NodeId> = condition.compared.iter().map(|c| c.value).collect();
        zero.retain(|value| self.eval(*value, facts).exact() == Some(0.0));
        let asked: BTreeSet<u32> = zero.into_iter().flat_map(|value| self.parts(value).states.to_vec()).collect();
        let gone = |state: &u32| facts.states[*state as usize].exact() == Some(0.0);
        let amounts = self.lab.extensive.iter().filter(|(_, state)| asked.contains(state) && gone(state));
        let species = &self.lab.tables.species;
        let salt =
            amounts.filter_map(|(key, _)| key.matter()).map(|s| species.get(s)).find(|s| !s.dissolves.is_empty());
        let Some(salt) = salt else { return d };
        let ions: Vec<String> = salt.dissolves.iter().map(|(ion, _)| format!("`{}`", species.get(*ion).name)).collect();
        d.help(format!("once dissolved, `{}` counts as its ions: use {}", salt.name, ions.join(" or ")))
    }

    /// Adds the reactions that would make what is missing.
    fn with_makers(&self, mut d: Diagnostic, condition: &Condition) -> Diagnostic {
        let Some((_, s)) = self.lab.absent_in.get(&condition.span).and_then(|all| all.first()) else { return d };
        let name = &self.lab.tables.species.get(*s).name;
        let all = self.lab.tables.reactions.iter().filter(|r| r.products.iter().any(|(p, _)| p == s));
        let makers: Vec<_> = all.take(STEPS_SHOWN).collect();
        for r in &makers {
            d = d.because(r.span, format!("`{}` makes it, but its reactants never meet there", r.name));
        }
        match makers.is_empty() {
            true => d.help(format!("no reaction makes `{name}`: declare one, or use a species that is made")),
            false => d.help(format!("mix the reactants of `{name}`, or use a species that is made")),
        }
    }

    /// Branches that constants alone decide, whatever the run does.
    pub fn dead_branches(&mut self) {
        for (span, (text, seen, otherwise)) in std::mem::take(&mut self.branches) {
            let dead = match (seen.contains(&true), seen.contains(&false)) {
                (false, true) => "this branch never runs",
                (true, false) if otherwise => "the `else` branch never runs",
                _ => continue,
            };
            let comes = if seen.contains(&true) { "always true" } else { "always false" };
            let headline = format!("`{text}` is {comes}: it depends on constants only");
            let d = Diagnostic::warning(codes::DEAD_BRANCH, span, headline, dead);
            self.found(d.help("remove the branch, or make the deciding value a parameter of the workflow"), span);
        }
    }

    /// A transfer of more than there is, on every way or on some.
    pub fn too_much(&mut self, from: usize, fraction: f64, some: bool) {
        let name = self.mixtures[from].first().map_or_else(String::new, |(k, _)| self.lab.spoken_name(k.instance));
        let label = self.sites.last().map(|s| s.label.clone()).unwrap_or_default();
        let about = self.site();
        if some && self.is_cleared(about) {
            return;
        }
        let open = some.then(|| self.ways.meetings());
        let ways = if some { ", on some paths through the workflow" } else { "" };
        let headline = format!("`{label}` removes more from `{name}` than it holds{ways}");
        let said = match fraction.is_finite() {
            true => format!("{} times the available amount", matterix_ir::quantity::show_number(fraction)),
            false => "it is empty".to_owned(),
        };
        let d = self.at_site(codes::TRANSFER_FRACTION, headline, said, some || self.doubt > 0);
        let turn = self.turning > 0;
        self.found_on(d, about, open, turn);
    }

    /// The share of a species that is to stay behind in a transfer is none.
    pub fn no_share_to_keep(&mut self, state: u32, share: f64) {
        let name = self.lab.states[state as usize].name.clone();
        let shown = matterix_ir::quantity::show_number(share);
        let headline = format!("the share of `{name}` that is to stay behind is {shown}: it must be 0 to 1");
        let d = self.at_site(codes::TRANSFER_FRACTION, headline, "moves this".to_owned(), self.doubt > 0);
        let about = d.span();
        self.found(d, about);
    }

    /// Events set each other off for certain, more often at one moment than a run follows; this is one of them.
    pub(super) fn cascades(&mut self, event: u32) {
        let event = &self.events[event as usize];
        let headline = format!("`{}` and other events trigger each other endlessly at one moment", event.name);
        let at = if self.in_library(event.span) { self.site() } else { event.span };
        let mut d = Diagnostic::error(codes::EVENT_CASCADE, at, headline, "triggers again and again");
        d.severity = severity(codes::EVENT_CASCADE, self.doubt > 0);
        if at != self.site() {
            d = d.because(self.site(), "happens in this step");
        }
        let d = d.help("give one of them a condition that stays false after the other one");
        self.found(d, event.span);
    }

    /// A law takes more of an amount than there is, within the step that is followed now.
    pub(super) fn used_up(&mut self, amount: u32, facts: &AbstractState) {
        let name = &self.lab.states[amount as usize].name;
        let label = self.sites.last().map(|s| s.label.clone()).unwrap_or_default();
        let headline = format!("`{name}` runs out during `{label}`, but a law keeps removing it");
        let said = match facts.time.exact() {
            Some(time) => format!("empty after {}", matterix_ir::quantity::show_duration(time)),
            None => "empty before the step ends".to_string(),
        };
        let d = self.at_site(codes::TRANSFER_FRACTION, headline, said, self.doubt > 0);
        let d = d.help("stop it earlier, use a larger vessel, or give the law a `while` that ends it");
        let about = d.span();
        self.found(d, about);
    }

    /// A law takes from a mixture in which nothing is, within the step that is followed now.
    pub(super) fn takes_from_nothing(&mut self, state: u32) {
        let of = self.mixtures.iter().find_map(|all| all.iter().find(|(_, s)| *s == state));
        let name = of.map_or_else(String::new, |(key, _)| self.lab.spoken_name(key.instance));
        let label = self.sites.last().map(|s| s.label.clone()).unwrap_or_default();
        let headline = format!("a law removes liquid from `{name}` during `{label}`, but it is empty");
        let d = self.at_site(codes::TRANSFER_FRACTION, headline, "the source is empty".to_string(), self.doubt > 0);
        let d = d.help("fill it first, or give the law a `while` that waits for it");
        let about = d.span();
        self.found(d, about);
    }

    /// A transfer takes something along that the mixture where it ends has no place for. Where there may be none of it, that is
    /// left to the run.
    pub fn no_place(&mut self, state: u32, from: u32, to: u32, share: &AbstractValue, facts: &AbstractState) {
        let there = |k: &AbstractValue| {
            let (low, high) = k.bounds();
            low > 0.0 || high < 0.0
        };
        if !there(share) || !there(&facts.states[state as usize]) {
            return;
        }
        let Some((key, _)) = self.mixtures[from as usize].iter().find(|(_, s)| *s == state) else { return };
        let Some(id) = self.lab.mixtures.get(to as usize) else { return };
        let (member, to) = (key.member.clone(), self.lab.spoken_name(*id));
        let from = self.lab.spoken_name(key.instance);
        let headline = format!("`{to}` has no `{member}`: the `{member}` of the contents of `{from}` would be lost");
        let d = self.at_site(codes::BALANCE_BREACH, headline, "would be lost".to_string(), self.doubt > 0);
        let d = d.help(format!("give `{to}` contents that have `{member}` as well"));
        let about = d.span();
        self.found(d, about);
    }

    pub(super) fn at_site(&self, code: Code, headline: String, said: String, some: bool) -> Diagnostic {
        let mut d = Diagnostic::error(code, self.site(), headline, said);
        d.severity = severity(code, some);
        for site in self.sites.iter().rev().skip(1).filter(|s| s.calls).take(2) {
            d = d.because(site.span, format!("in `{}`", site.label));
        }
        match self.rows.last() {
            Some(row) => d.because(*row, "in the turn of this row"),
            None => d,
        }
    }

    /// What a condition compares, in numbers: `` `a + b` is 600 uL, at most 360 uL``.
    pub(super) fn measured(&mut self, condition: &Condition, facts: &AbstractState) -> Vec<String> {
        let mut out = Vec::new();
        for c in &condition.compared {
            let value = self.eval(c.value, facts);
            let low = c.low.map(|n| self.eval(n, facts));
            let high = c.high.map(|n| self.eval(n, facts));
            let show = |k: &AbstractValue| shown(k, |v| c.unit.show(v));
            let limits = match (low, high) {
                (Some(l), Some(_)) if c.low == c.high => format!("must be {}", show(&l)),
                (Some(l), Some(h)) => format!("the allowed range is {} .. {}", show(&l), show(&h)),
                (Some(l), None) => format!("{} {}", if c.strict { "must be more than" } else { "at least" }, show(&l)),
                (None, Some(h)) => format!("{} {}", if c.strict { "must be less than" } else { "at most" }, show(&h)),
                (None, None) => continue,
            };
            out.push(format!("`{}` is {}, {limits}", c.text, show(&value)));
        }
        out
    }

    /// Where the user declared an instance, or what it is a part of.
    pub(super) fn declared_at(&self, id: InstanceId) -> Span {
        let mut inst = &self.lab.instances[id.0 as usize];
        while let Some(owner) = inst.owner
            && self.in_library(inst.span)
        {
            inst = &self.lab.instances[owner.0 as usize];
        }
        inst.span
    }

    pub(super) fn show(&self, value: &AbstractValue, domain: &Domain) -> String {
        shown(value, |v| match domain {
            Domain::Quantity(unit) => unit.show(v),
            Domain::Bool => (if v == 0.0 { "false" } else { "true" }).to_string(),
            Domain::Enum(words) => words.get(v as usize).map_or("?".to_string(), |word| format!("`{word}`")),
            Domain::Instance if v < 0.0 => "nothing".to_string(),
            Domain::Instance => match self.lab.instances.get(v as usize) {
                Some(i) => format!("`{}`", i.name),
                None => "?".to_string(),
            },
        })
    }
}

/// Things by name, the first few of many.
fn listed(things: &[&Condition]) -> String {
    let names: Vec<String> = things.iter().take(THINGS_SHOWN).map(|t| format!("`{}`", t.text)).collect();
    match things.len() - names.len() {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

/// How bad a finding is that is made on every way, or on some.
fn severity(code: Code, some: bool) -> Severity {
    let mild = only_advice(code) || (some && !forbidden_on_any_way(code));
    if mild { Severity::Warning } else { Severity::Error }
}

/// What is known, in words.
pub(super) fn shown(value: &AbstractValue, show: impl Fn(f64) -> String) -> String {
    // What is left of a subtraction is not worth telling beside what it was taken from.
    let (low, high) = value.bounds();
    let largest = if high.is_finite() { low.abs().max(high.abs()) } else { low.abs() };
    let show = |v: f64| show(if v.abs() < 1e-9 * largest { 0.0 } else { v });
    match value {
        AbstractValue::Point(v) => show(*v),
        AbstractValue::Few(all, _) => all.iter().map(|v| show(*v)).collect::<Vec<_>>().join(" or "),
        AbstractValue::Range(low, high, _) if low.is_finite() && high.is_finite() => {
            format!("between {} and {}", show(*low), show(*high))
        }
        AbstractValue::Range(low, _, _) if low.is_finite() => format!("{} or more", show(*low)),
        AbstractValue::Range(_, high, _) if high.is_finite() => format!("{} or less", show(*high)),
        AbstractValue::Range(..) => "unknown".to_string(),
    }
}
