//! What the checker and the twin say of plans, and where the interpreter disagrees.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use matterix_ir::plan::StepId;
use matterix_ir::points::{Points, Value};
use matterix_ir::{FileId, NodeId, Program, Severity, Sources, Span};
use matterix_lang::{LibraryOnly, Session};
use matterix_runtime::exec::{Listener, RunStatus};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::run::{RunOptions, run};

use crate::explore::{Summary, explore, same};
use crate::interpret::Violation;
use crate::plan::{Condition, Id, Kind, LIQUIDS, Plan, Stmt, Theme};
use crate::print::{Text, print, well};
use crate::world::{DROP, World};

/// Relative difference between two values of one quantity that comes of rounding and of the steps of solvers.
const SAME: f64 = 1e-5;

/// uL and mg below which a difference does not matter.
const SMALL: f64 = 1e-3;

/// kg/mol of the species of the reaction.
const MOLAR_MASS: f64 = 0.046_069;

/// A finding of `check` about a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its code.
    pub code: &'static str,
    /// Its family, `V1`.
    pub family: &'static str,
    /// How grave it is.
    pub severity: Severity,
    /// The statement it is about, where that is known.
    pub at: Option<Id>,
    /// The statements it points at, that of the cause first.
    pub stmts: Vec<Id>,
    /// What it says.
    pub headline: String,
}

/// How two views of a plan differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    /// An error about a statement that some execution does without that fault.
    FalseError,
    /// `check --strict` is content with a plan of which some execution goes wrong.
    Missed,
    /// A value in an execution or a run outside of what `check --contents` says.
    Outside,
    /// The run ends as no execution does.
    Run,
}

/// A disagreement.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// What sort.
    pub sort: Sort,
    /// The code that it is about, or the quantity.
    pub code: String,
    /// Where, by the constructs around: `parallel > if > device on, off`.
    pub place: String,
    /// In words.
    pub what: String,
}

impl Disagreement {
    /// Short enough to compare with.
    pub fn signature(&self) -> String {
        format!("{:?} {} at {}", self.sort, self.code, self.place)
    }
}

/// All that is said of a plan.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// What `check` finds.
    pub findings: Vec<Finding>,
    /// What the interpreter saw.
    pub summary: Summary,
    /// Where they differ.
    pub disagreements: Vec<Disagreement>,
    /// Whether the twin ran it.
    pub ran: bool,
}

impl Verdict {
    /// Whether `check --strict` ends without an error once findings of some families are left out.
    pub fn clean_without(&self, families: &str) -> bool {
        // What is not used goes wrong in no execution.
        let counts = |f: &&Finding| {
            f.severity != Severity::Advice && f.code != "unused" && !families.contains(initial(f.family))
        };
        !self.findings.iter().any(|f| counts(&f))
    }
}

/// The letter of a family: `V` of `V1`.
pub fn initial(family: &str) -> char {
    family.chars().next().unwrap_or(' ')
}

/// Judges plans that go into one file; `budget` executions of each are followed.
pub fn judge(plans: &[Plan], seed: u64, budget: usize, session: &mut Session) -> Vec<Verdict> {
    let text = print(plans);
    let programs = Mutex::new(BTreeMap::new());
    let keep = |program: &Program| {
        let mut programs = programs.lock().unwrap_or_else(PoisonError::into_inner);
        programs.insert(program.plan.workflow.clone(), program.clone());
        Vec::new()
    };
    let name = format!("plans{seed}.mtx");
    let mut sources = Sources::default();
    let file = sources.add(&name, &text.text);
    let found = matterix_lang::check_and(&mut sources, file, &LibraryOnly, &keep, session);
    let programs = programs.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut sources = Sources::default();
    let file = sources.add(&name, &text.text);
    let (_, points) = matterix_lang::contents(&mut sources, file, &LibraryOnly);
    let at = Lines::new(file, &text);
    let mut out = Vec::new();
    for (number, plan) in plans.iter().enumerate() {
        let findings = found.iter().filter_map(|d| at.finding(plan, number, d)).collect();
        let summary = explore(plan, budget, seed);
        let mut verdict = Verdict { findings, summary, disagreements: Vec::new(), ran: false };
        let flow = format!("flow{number}");
        let places = Places::new(plan);
        verdict.false_errors(&places);
        verdict.missed(&places, "");
        if let Some(known) = points.iter().find(|p| p.workflow == flow) {
            verdict.enclosures(plan, known, &at, &places);
        }
        if let Some(program) = programs.get(&flow) {
            let known = points.iter().find(|p| p.workflow == flow);
            verdict.run(plan, program, known, &at, &places);
        }
        out.push(verdict);
    }
    out
}

/// Lines of a file and what stands on them.
struct Lines<'t> {
    file: FileId,
    text: &'t Text,
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    fn new(file: FileId, text: &'t Text) -> Self {
        let ends = text.text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1);
        Lines { file, text, starts: std::iter::once(0).chain(ends).collect() }
    }

    fn line(&self, span: Span) -> Option<usize> {
        (span.file == self.file).then(|| self.starts.partition_point(|s| *s <= span.start as usize) - 1)
    }

    fn stmt(&self, number: usize, span: Span) -> Option<Id> {
        let line = self.line(span)?;
        self.text.lines.get(line).copied().flatten().filter(|(plan, _)| *plan == number).map(|(_, id)| id)
    }

    /// A finding, if it is about this plan.
    fn finding(&self, plan: &Plan, number: usize, d: &matterix_ir::Diagnostic) -> Option<Finding> {
        let (from, to) = self.text.spans[number];
        let about = |l: &&matterix_ir::diagnostic::Label| self.line(l.span).is_some_and(|n| n >= from && n < to);
        d.labels.iter().find(about)?;
        let spans = std::iter::once(d.span()).chain(d.labels.iter().map(|l| l.span));
        let stmts: Vec<Id> = spans.filter_map(|span| self.stmt(number, span)).collect();
        // What stands in a skill is about the one call that is named.
        let mut calls: Vec<Id> = stmts.iter().copied().filter(|id| plan.calls_a_skill(*id)).collect();
        calls.dedup();
        let at = self.stmt(number, d.span()).or(match calls[..] {
            [one] => Some(one),
            _ => None,
        });
        let (code, family) = (d.code.name, d.code.family);
        Some(Finding { code, family, severity: d.severity, at, stmts, headline: d.headline.clone() })
    }
}

/// Where statements stand.
struct Places<'p> {
    names: BTreeMap<Id, String>,
    /// The statement before each in its block.
    before: BTreeMap<Id, Id>,
    plan: &'p Plan,
}

impl<'p> Places<'p> {
    fn new(plan: &'p Plan) -> Self {
        let mut places = Places { names: BTreeMap::new(), before: BTreeMap::new(), plan };
        places.walk(&plan.body, "");
        places.walk(&plan.finally, "finally > ");
        places
    }

    fn walk(&mut self, block: &[Stmt], around: &str) {
        for pair in block.windows(2) {
            self.before.insert(pair[1].id, pair[0].id);
        }
        for stmt in block {
            let construct = stmt.kind.construct();
            self.names.insert(stmt.id, format!("{around}{construct}"));
            for inner in stmt.kind.blocks() {
                self.walk(inner, &format!("{around}{construct} > "));
            }
        }
    }

    fn of(&self, id: Id) -> String {
        self.names.get(&id).cloned().unwrap_or_default()
    }

    fn thing(&self, cup: usize) -> String {
        if self.plan.theme == Theme::Tips {
            format!("plate[{}].contents", well(cup))
        } else {
            format!("c{cup}.contents")
        }
    }
}

impl Verdict {
    fn differ(&mut self, sort: Sort, code: impl Into<String>, place: String, what: String) {
        let disagreement = Disagreement { sort, code: code.into(), place, what };
        if !self.disagreements.iter().any(|d| d.signature() == disagreement.signature()) {
            self.disagreements.push(disagreement);
        }
    }

    /// Errors about what some execution does without that fault.
    fn false_errors(&mut self, places: &Places<'_>) {
        let jobs = places.names.values().any(|name| name.contains("start"));
        for finding in self.findings.clone() {
            // What was thrown away may be used on no way, so that some ways are enough.
            if finding.severity != Severity::Error {
                continue;
            }
            // Who of two that meet is in fault is a matter of words.
            let between = ["claimed-twice", "deadlock", "stopped-meanwhile"].contains(&finding.code);
            let first = finding.at.as_ref().filter(|_| !between);
            // It stands in a skill: which call it is about is not known.
            if first.is_none() && !between {
                continue;
            }
            // Some ways are enough.
            let alone = self.findings.iter().filter(|f| f.severity == Severity::Error).count() == 1;
            if finding.family == "T2" && (!alone || self.goes_wrong(finding.code)) {
                continue;
            }
            // Where it goes wrong in the same way in every order, the place is a matter of which order is told of. Behind another
            // error nothing is certain.
            // Where no order ends well, what is told of those beside each other is what comes first in one of them; so it is where none of
            // those ends well that come to the statement.
            let beside = jobs || finding.at.is_some_and(|id| places.of(id).contains("parallel"));
            if beside && !self.summary.well && self.summary.complete {
                continue;
            }
            let nowhere = self.summary.certain && !self.goes_wrong(finding.code) && alone && !beside;
            let clean = match first.and_then(|id| self.summary.fates.get(id)) {
                None => first.is_none() && self.summary.clean,
                // Where an execution leaves a loop early, the finding may be about a turn that it did not come to.
                Some(fate) if !fate.always_in_a_turn(finding.code) => fate
                    .clean_of(finding.code)
                    .any(|b| b.whole && (b.well || nowhere) || nowhere && b.well && self.summary.complete),
                Some(_) => false,
            };
            if clean {
                let place = finding.at.or(finding.stmts.first().copied()).map(|id| places.of(id)).unwrap_or_default();
                self.differ(Sort::FalseError, finding.code, place, finding.headline.clone());
            }
        }
    }

    /// Whether some execution fails with a code.
    fn goes_wrong(&self, code: &str) -> bool {
        self.summary.fates.values().any(|f| f.failed.keys().any(|c| same(c, code)))
    }

    /// What `check --strict` is content with although it goes wrong in some execution, if it is.
    fn missed(&mut self, places: &Places<'_>, families: &str) {
        if !self.clean_without(families) {
            return;
        }
        for Violation { code, stmt } in self.summary.violations.clone() {
            self.differ(Sort::Missed, code, places.of(stmt), format!("{code} at statement {stmt}"));
        }
    }

    /// Executions against what is known at every statement.
    fn enclosures(&mut self, plan: &Plan, known: &Points, at: &Lines<'_>, places: &Places<'_>) {
        // After a finding what it is about counts as not known, and what was missed is told of as that.
        if !self.clean_without("") || !self.summary.violations.is_empty() {
            return;
        }
        let number = known.workflow.trim_start_matches("flow").parse().unwrap_or(usize::MAX);
        for point in &known.points {
            let Some(id) = at.stmt(number, point.span) else { continue };
            let Some(fate) = self.summary.fates.get(&id) else { continue };
            let worlds = fate.after.clone();
            match &point.after {
                None if !worlds.is_empty() && self.findings.is_empty() => {
                    self.differ(
                        Sort::Outside,
                        "unreached",
                        places.of(id),
                        format!("nothing goes on behind `{}`", point.label),
                    );
                }
                None => {}
                Some(after) => {
                    for world in &worlds {
                        self.enclosed(plan, world, &after.things, places, &point.label, places.of(id));
                    }
                }
            }
        }
    }

    fn enclosed(
        &mut self,
        plan: &Plan,
        world: &World,
        things: &[matterix_ir::points::Thing],
        places: &Places<'_>,
        label: &str,
        place: String,
    ) {
        for (cup, vessel) in world.cups.iter().enumerate() {
            let name = places.thing(cup);
            let Some(thing) = things.iter().find(|t| t.name == name) else { continue };
            for fact in thing.facts.iter().chain(&thing.species) {
                let Some(value) = quantity(plan, vessel, &fact.name) else { continue };
                if !encloses(&fact.value, value, slack(&fact.name)) {
                    let what = format!("{name}.{} is {value} behind `{label}`, not in {:?}", fact.name, fact.value);
                    self.differ(Sort::Outside, fact.name.clone(), place.clone(), what);
                }
            }
        }
    }

    /// The twin against the executions, and against what is known at every statement.
    fn run(&mut self, plan: &Plan, program: &Program, known: Option<&Points>, at: &Lines<'_>, places: &Places<'_>) {
        // What a wrong equation makes of matter is a breach of the balances, as it should be.
        if plan.declared.is_some_and(|declared| declared.wrong().is_some()) {
            return;
        }
        let mut watch = Watch::new(plan, program, places);
        let outcome = run(program, &RunOptions::default(), &mut watch);
        self.ran = true;
        let number = program.plan.workflow.trim_start_matches("flow").parse().unwrap_or(usize::MAX);
        let followed = self.clean_without("") && self.summary.violations.is_empty();
        for (span, values) in std::mem::take(&mut watch.begun) {
            let Some(id) = at.stmt(number, span) else { continue };
            let Some(point) = places
                .before
                .get(&id)
                .and_then(|before| known?.points.iter().find(|p| at.stmt(number, p.span) == Some(*before)))
            else {
                continue;
            };
            let Some(after) = &point.after else { continue };
            for ((thing, fact), value) in watch.names.clone().iter().zip(&values) {
                let fact = after
                    .things
                    .iter()
                    .find(|t| t.name == *thing)
                    .and_then(|t| t.facts.iter().chain(&t.species).find(|f| f.name == *fact));
                if let (Some(fact), Some(value), true) = (fact, value, followed)
                    && !encloses(&fact.value, *value, slack(&fact.name))
                {
                    let what = format!(
                        "run: {thing}.{} is {value} behind `{}`, not in {:?}",
                        fact.name, point.label, fact.value
                    );
                    self.differ(Sort::Outside, fact.name.clone(), places.of(id), what);
                }
            }
        }
        if !self.summary.complete || !self.summary.certain || !self.summary.alone || has_open_moments(plan) {
            return;
        }
        let passed = outcome.status == RunStatus::Passed || outcome.failure.is_none() && !outcome.unfinished.is_empty();
        match passed {
            false if !self.summary.fails => {
                let why = outcome.failure.as_ref().map_or(String::new(), |f| f.name.clone());
                self.differ(Sort::Run, "failure", why.clone(), format!("the run fails: {why}"));
            }
            true => self.ends(plan, &watch),
            false => {}
        }
    }

    /// Whether a run that passed ends as some execution does.
    fn ends(&mut self, plan: &Plan, watch: &Watch<'_>) {
        let worlds = &self.summary.ends;
        if worlds.is_empty() {
            self.differ(Sort::Run, "passes", String::new(), "the run passes, and no execution does".to_string());
            return;
        }
        if worlds.len() >= 64 {
            return;
        }
        let alike = |world: &World| {
            watch.names.iter().zip(&watch.last).all(|((thing, fact), value)| {
                let cup = world.cups.iter().enumerate().find(|(i, _)| watch.places.thing(*i) == *thing);
                let expected = cup.and_then(|(_, vessel)| quantity(plan, vessel, fact));
                expected.is_none_or(|e| (e - value).abs() <= SAME * e.abs().max(value.abs()) + slack(fact))
            })
        };
        if !worlds.iter().any(alike) {
            let what = format!("{:?} are {:?}; expected {:?}", watch.names, watch.last, worlds.first());
            self.differ(Sort::Run, "end", format!("{:?}", plan.theme), what);
        }
    }
}

/// Whether what laws move depends on when noise ends a wait: the executions have some of the moments only.
fn has_open_moments(plan: &Plan) -> bool {
    let mut open = false;
    plan.each(&mut |stmt| open |= matches!(stmt.kind, Kind::Until(Condition::Dial(_), ..)));
    open && matches!(plan.theme, Theme::Heat | Theme::Reaction)
}

/// A quantity of a vessel's contents in SI, by its name in `--contents`.
fn quantity(plan: &Plan, vessel: &crate::world::Vessel, name: &str) -> Option<f64> {
    let contents = &vessel.contents;
    match name {
        "volume" => Some(contents.volume() * 1e-9),
        "mass" => Some(contents.mass.iter().sum::<f64>() * 1e-6),
        // The interpreter keeps no heat where a reaction turns one capacity into another.
        "temperature" if plan.theme == Theme::Reaction => None,
        // What rounding has left has any temperature.
        "temperature" if contents.capacity() <= DROP => None,
        "temperature" => Some(contents.temperature() + 273.15),
        species => {
            let index = LIQUIDS.iter().position(|l| l.name == species)?;
            let mass = contents.mass[index] * 1e-6;
            Some(if plan.theme == Theme::Reaction && index < 2 { mass / MOLAR_MASS } else { mass })
        }
    }
}

/// A difference that does not matter, SI.
fn slack(name: &str) -> f64 {
    match name {
        "volume" => SMALL * 1e-9,
        "temperature" => 2e-2,
        _ => SMALL * 1e-6,
    }
}

/// Whether a value is one of those that may be.
fn encloses(known: &Value, value: f64, slack: f64) -> bool {
    let slack = slack + SAME * value.abs();
    let near = |x: &f64| (x - value).abs() <= slack;
    match known {
        Value::Exact(x, _) => near(x),
        Value::OneOf(all, _) => all.iter().any(near),
        Value::Between(low, high, _) => {
            low.is_none_or(|low| value >= low - slack) && high.is_none_or(|high| value <= high + slack)
        }
        Value::Words(_) | Value::Unknown => true,
    }
}

/// Follows a run: what mixtures are like whenever a step begins, and in the end.
struct Watch<'p> {
    program: &'p Program,
    places: &'p Places<'p>,
    /// Thing and quantity.
    names: Vec<(String, String)>,
    nodes: Vec<NodeId>,
    begun: Vec<(Span, Vec<Option<f64>>)>,
    last: Vec<f64>,
}

impl<'p> Watch<'p> {
    fn new(plan: &Plan, program: &'p Program, places: &'p Places<'p>) -> Self {
        let (mut names, mut nodes) = (Vec::new(), Vec::new());
        for observable in &program.model.observables {
            for cup in 0..plan.lab.cups.len() {
                let thing = places.thing(cup);
                let Some(member) = observable.name.strip_prefix(&thing).and_then(|m| m.strip_prefix('.')) else {
                    continue;
                };
                let member = member.strip_prefix("amount[").and_then(|m| m.strip_suffix(']')).unwrap_or(member);
                if let [node] = observable.value[..] {
                    names.push((thing, member.to_string()));
                    nodes.push(node);
                }
            }
        }
        Watch { program, places, names, nodes, begun: Vec::new(), last: Vec::new() }
    }
}

impl Observer for Watch<'_> {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Watch<'_> {
    fn wanted(&self, _: StepId) -> Vec<NodeId> {
        self.nodes.clone()
    }

    fn begins(&mut self, _: f64, step: StepId, values: &[Option<f64>]) {
        self.begun.push((self.program.plan.get(step).span, values.to_vec()));
    }

    fn ended(&mut self, engine: &Engine<'_>) {
        self.last = self.nodes.iter().map(|n| engine.eval(*n)).collect();
    }
}
