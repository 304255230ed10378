//! What a run watches its mixtures and devices for: species that should not meet, hazards and cautions, on actual contents and
//! temperatures. A warning is kept as a finding, an error raises an alarm: before an operation that would bring it about at one
//! stroke, or as soon as it is there.

mod condition;

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::convert::Infallible;

use matterix_ir::model::{Action, Danger, Incompatible};
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::values::Formulas;
use matterix_ir::{Diagnostic, NodeId, Program, Severity, Span, codes};
use serde::Serialize;

use crate::exec::{Alarm, Listener, OperationState, StepState};
use crate::ledger::{Held, transfer};
use crate::process::{Engine, Observer};
use crate::touched::{Below, Touched};
use condition::Condition;

/// Less of a species, mol per kg of mixture, is what equilibria and rounding leave, and counts as none.
const TRACE: f64 = 1e-6;

/// Recipes are rounded: what is at a limit within their digits counts.
const ROUNDED: f64 = 1.0 - 1e-6;

/// What handlers know it by that substances meet that must not.
const MIX: &str = "incompatible_mix";

/// A finding of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// When it was made, s.
    pub time: f64,
    /// What was found.
    pub diagnostic: Diagnostic,
}

/// A species in one mixture, by the states of its amount and of its ions.
#[derive(Clone)]
struct Side {
    amount: Option<usize>,
    ions: Vec<(usize, f64)>,
}

impl Side {
    fn new(amounts: &BTreeMap<u32, usize>, species: u32, ions: &[(u32, f64)]) -> Option<Side> {
        let amount = amounts.get(&species).copied();
        let found: Vec<(usize, f64)> = ions.iter().filter_map(|(ion, n)| Some((*amounts.get(ion)?, *n))).collect();
        let ions = if found.len() == ions.len() { found } else { Vec::new() };
        (amount.is_some() || !ions.is_empty()).then_some(Side { amount, ions })
    }

    /// How much there is of it, dissolved or not, mol.
    fn amount(&self, now: impl Fn(usize) -> f64) -> f64 {
        let ions = self.ions.iter().map(|(state, n)| now(*state) / n).reduce(f64::min);
        self.amount.map_or(0.0, &now) + ions.unwrap_or(0.0)
    }
}

/// A pair of species in one mixture.
#[derive(Clone)]
struct Pair<'p> {
    incompatible: &'p Incompatible,
    sides: (Side, Side),
}

/// Looks at every moment of a run that is shown.
#[derive(Clone)]
pub struct Screen<'p> {
    program: &'p Program,
    /// Pairs by mixture, the gravest first.
    pairs: Vec<(usize, Vec<Pair<'p>>)>,
    /// Which of them have met, by mixture and consequence.
    met: BTreeSet<(usize, &'p str)>,
    /// The conditions of dangers.
    conditions: Vec<Condition>,
    /// Which of them held when last looked at.
    there: Vec<bool>,
    /// The pairs of each mixture, and the dangers, by what they rest on.
    watched: (Touched, Touched),
    /// Whether anything has been looked at yet.
    has_looked: bool,
    /// Whether an equality was true at the last instant only.
    is_touching: bool,
    /// Whether anything it watches for is an error.
    is_grave: bool,
    /// The states that each danger depends on.
    read: OnceCell<Vec<BTreeSet<u32>>>,
    /// Room for values.
    room: Vec<f64>,
    /// Steps around each step.
    above: BTreeMap<StepId, StepId>,
    /// Operations that go on, the latest last.
    going: Vec<StepId>,
    /// The operation that began or ended last.
    last: Option<StepId>,
    /// Dangers that were warned of.
    warned: BTreeSet<usize>,
    /// Errors that nobody has asked for yet, with the time.
    alarms: VecDeque<(f64, Alarm)>,
    found: Vec<Finding>,
}

impl<'p> Screen<'p> {
    /// A screen of a program that has not begun.
    pub fn new(program: &'p Program) -> Self {
        let model = &program.model;
        let mut pairs = Vec::new();
        for (index, mixture) in model.mixtures.iter().enumerate() {
            let amounts: BTreeMap<u32, usize> =
                mixture.contents.iter().map(|c| (c.species, c.state as usize)).collect();
            let of = |i: &'p Incompatible| {
                let a = Side::new(&amounts, i.species.0, &i.ions.0)?;
                let b = Side::new(&amounts, i.species.1, &i.ions.1)?;
                Some(Pair { incompatible: i, sides: (a, b) })
            };
            let mut found: Vec<Pair<'p>> = model.incompatible.iter().filter_map(of).collect();
            found.sort_by_key(|p| p.incompatible.severity);
            if !found.is_empty() {
                pairs.push((index, found));
            }
        }
        let mut severities = pairs.iter().flat_map(|(_, p)| p).map(|p| p.incompatible.severity);
        let is_grave = severities.any(|s| s == Severity::Error)
            || model.dangers.iter().any(|danger| danger.severity == Severity::Error);
        let mixtures =
            pairs.iter().map(|(mixture, _)| Below::states(model.mixtures[*mixture].contents.iter().map(|c| c.state)));
        let dangers = model.dangers.iter().map(|d| Below::new(model, &[d.when]));
        let states = model.states.len();
        let watched = (Touched::new(states, mixtures), Touched::new(states, dangers));
        let mut formulas = Formulas::default();
        let condition = |danger: &Danger| Condition::new(&model.graph, &mut formulas, danger.when);
        let conditions = model.dangers.iter().map(condition).collect();
        let mut above = BTreeMap::new();
        for (id, step) in program.plan.steps.iter().enumerate() {
            above.extend(step.step.children().into_iter().map(|child| (child, StepId(id as u32))));
        }
        Screen {
            program,
            pairs,
            met: BTreeSet::new(),
            conditions,
            there: vec![false; model.dangers.len()],
            watched,
            has_looked: false,
            is_touching: false,
            is_grave,
            read: OnceCell::new(),
            room: Vec::new(),
            above,
            going: Vec::new(),
            last: None,
            warned: BTreeSet::new(),
            alarms: VecDeque::new(),
            found: Vec::new(),
        }
    }

    /// Whether there is nothing to watch for.
    pub fn is_idle(&self) -> bool {
        self.pairs.is_empty() && self.there.is_empty()
    }

    /// The conditions of hazards and cautions.
    pub fn conditions(&self) -> impl Iterator<Item = NodeId> + use<'p> {
        self.program.model.dangers.iter().map(|danger| danger.when)
    }

    /// The warnings, and the errors that came about when nothing went on any more, in order.
    pub fn into_found(self) -> Vec<Finding> {
        let mut found = self.found;
        found.extend(self.alarms.into_iter().map(|(time, alarm)| Finding { time, diagnostic: alarm.found }));
        found.sort_by(|a, b| a.time.total_cmp(&b.time));
        found
    }

    /// The operation that has to do with a mixture now, or with anything.
    fn operation_at(&self, mixture: Option<usize>) -> Option<StepId> {
        let concerns = |id: &&StepId| {
            let Step::Operation(o) = &self.program.plan.get(**id).step else { return false };
            let mut actions = o.at_start.iter().chain(&o.at_end);
            actions.any(|a| matches!(a, Action::Move { to, .. } if Some(*to as usize) == mixture))
        };
        self.going.iter().rev().find(concerns).or(self.going.last()).or(self.last.as_ref()).copied()
    }

    /// A step and those around it, innermost first.
    fn around(&self, step: Option<StepId>) -> impl Iterator<Item = StepId> {
        std::iter::successors(step, |id| self.above.get(id).copied())
    }

    /// The statement of the user's that a step belongs to.
    fn place(&self, step: Option<StepId>) -> Option<Span> {
        let plan = &self.program.plan;
        let own = plan.get(plan.root).span.file;
        self.around(step).map(|id| plan.get(id).span).find(|span| span.file == own && !span.is_empty())
    }

    /// Keeps a warning, raises the alarm for an error.
    fn tell(&mut self, time: f64, name: &str, step: Option<StepId>, found: Diagnostic) {
        if found.severity == Severity::Error {
            let alarm = Alarm { name: name.to_string(), found, around: self.around(step).collect() };
            self.alarms.push_back((time, alarm));
        } else if !self.found.iter().any(|f| f.diagnostic.headline == found.headline) {
            self.found.push(Finding { time, diagnostic: found });
        }
    }

    /// The gravest of the pairs of a mixture that meet: the others are mended with it.
    fn meeting<'s>(
        &self,
        mixture: usize,
        pairs: &'s [Pair<'p>],
        now: impl Fn(usize) -> f64 + Copy,
    ) -> Option<&'s Pair<'p>> {
        let some = |p: &Pair<'_>| p.sides.0.amount(now) > 0.0 && p.sides.1.amount(now) > 0.0;
        if !pairs.iter().any(some) {
            return None;
        }
        let masses = self.program.model.mixtures[mixture].contents.iter().map(|c| {
            let molar_mass = self.program.model.species.get(c.species as usize).map_or(0.0, |s| s.molar_mass);
            now(c.state as usize) * molar_mass
        });
        let mass: f64 = masses.sum();
        pairs.iter().find(|p| {
            let (least_a, least_b) = p.incompatible.least;
            let enough = |side: &Side, least: f64| side.amount(now) >= least.max(TRACE) * mass * ROUNDED;
            some(p) && enough(&p.sides.0, least_a) && enough(&p.sides.1, least_b)
        })
    }

    /// What a sample may have changed: positions in its list of pairs, and dangers.
    fn touched(&mut self, engine: &Engine<'_>, changed: &[u32]) -> (Vec<u32>, Vec<u32>) {
        // An equality that is true at this instant only is so again in none of those after it.
        let was_touching = std::mem::replace(&mut self.is_touching, engine.is_touching());
        let is_first = !std::mem::replace(&mut self.has_looked, true);
        let pairs = if is_first { self.watched.0.all() } else { self.watched.0.by(changed) };
        let is_all = is_first || was_touching || self.is_touching;
        (pairs, if is_all { self.watched.1.all() } else { self.watched.1.by(changed) })
    }

    fn look(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        let (met, dangers) = self.touched(engine, changed);
        let pairs = std::mem::take(&mut self.pairs);
        for (mixture, pairs) in met.iter().filter_map(|i| pairs.get(*i as usize)) {
            let Some(pair) = self.meeting(*mixture, pairs, |state| engine.state(state as u32)) else {
                self.met.retain(|(met, _)| met != mixture);
                continue;
            };
            if !self.met.insert((*mixture, pair.incompatible.words.as_str())) {
                continue;
            }
            let step = self.operation_at(Some(*mixture));
            let found = self.incompatible(*mixture, pair.incompatible, step);
            self.tell(time, MIX, step, found);
        }
        self.pairs = pairs;
        let program = self.program;
        for index in dangers.into_iter().map(|i| i as usize) {
            let danger = &program.model.dangers[index];
            let now = self.conditions[index].holds(engine, &mut self.room);
            if !std::mem::replace(&mut self.there[index], now) && now {
                let step = self.operation_at(None);
                // Of one danger a warning is enough, whatever its numbers are later.
                if danger.severity == Severity::Error || self.warned.insert(index) {
                    let found = self.danger(danger, step, |node| engine.eval(node));
                    self.tell(time, &danger.name, step, found);
                }
            }
        }
    }

    /// The states that an operation leaves if nothing else happens, and those that it changes; none where it cannot be carried out.
    fn after(engine: &Engine<'_>, operation: &Operation) -> Option<(Vec<f64>, BTreeSet<u32>)> {
        let mut states = engine.states();
        let mut changed = BTreeSet::new();
        for action in operation.at_start.iter().chain(&operation.at_end) {
            match *action {
                Action::Assign { state, value, .. } => {
                    let value = engine.eval_with(value, &states);
                    *states.get_mut(state as usize)? = value;
                    changed.insert(state);
                }
                Action::Move { fraction, ref but, from, to, .. } => {
                    let held = Held::new(but, |s| states[s as usize], |node| engine.eval_with(node, &states)).ok()?;
                    let fraction = engine.eval_with(fraction, &states);
                    let mixtures = &engine.model().mixtures;
                    let (from, to) = (mixtures.get(from as usize)?, mixtures.get(to as usize)?);
                    let after = transfer(|s| states[s as usize], fraction, &held, from, to).ok()?;
                    after.into_iter().for_each(|(state, value)| states[state as usize] = value);
                    changed.extend(from.extensive.iter().chain(&to.extensive).map(|(_, state)| *state));
                }
            }
        }
        Some((states, changed))
    }

    /// The first error that an operation would bring about.
    fn would(&self, engine: &Engine<'_>, step: StepId, operation: &Operation) -> Option<Alarm> {
        if !self.is_grave {
            return None;
        }
        let (states, changed) = Self::after(engine, operation)?;
        let model = &self.program.model;
        let label = &self.program.plan.get(step).label;
        let alarm = |name: &str, mut found: Diagnostic| {
            found.headline = format!("`{label}` was not carried out: {}", found.headline);
            Alarm { name: name.to_string(), found, around: self.around(Some(step)).collect() }
        };
        for (mixture, pairs) in &self.pairs {
            if !model.mixtures[*mixture].contents.iter().any(|c| changed.contains(&c.state)) {
                continue;
            }
            let Some(pair) = self.meeting(*mixture, pairs, |state| states[state]) else { continue };
            let Incompatible { severity, words, .. } = pair.incompatible;
            if *severity == Severity::Error && !self.met.contains(&(*mixture, words.as_str())) {
                return Some(alarm(MIX, self.incompatible(*mixture, pair.incompatible, Some(step))));
            }
        }
        let read =
            self.read.get_or_init(|| model.dangers.iter().map(|d| Below::new(model, &[d.when]).states).collect());
        let mut dangers = model.dangers.iter().zip(&self.there).zip(read);
        let (danger, _) = dangers.find(|((danger, there), read)| {
            let new = danger.severity == Severity::Error && !**there && !read.is_disjoint(&changed);
            new && matches!(engine.eval_with(danger.when, &states), v if v != 0.0 && !v.is_nan())
        })?;
        Some(alarm(&danger.0.name, self.danger(danger.0, Some(step), |node| engine.eval_with(node, &states))))
    }

    /// What a danger is, in its own words where it has some; `value` gives that of a node.
    fn danger(&self, danger: &Danger, step: Option<StepId>, value: impl Fn(NodeId) -> f64) -> Diagnostic {
        let instances = &self.program.scene.instances;
        let name = |at: f64| instances.get(at as usize).map_or("nothing", |i| i.name.as_str()).to_owned();
        let said = danger.said.iter().find(|said| value(said.node) == 1.0);
        let words = said.and_then(|said| {
            let known = |node| Ok::<_, Infallible>(Some(value(node)).filter(|v| v.is_finite()));
            said.text.show(known, name).ok()
        });
        let scene = &self.program.scene;
        let stands = danger.about.map(|id| scene.get(scene.whole(id)).span).filter(|span| !span.is_empty());
        let (span, label) = match (self.place(step), stands) {
            (Some(span), _) => (span, "it happened here"),
            (None, Some(span)) => (span, "true from the start"),
            (None, None) => (danger.span, "declared here"),
        };
        let mut found = Diagnostic::error(danger.code, span, words.unwrap_or_else(|| danger.headline.clone()), label);
        found.severity = danger.severity;
        found.help.clone_from(&danger.help);
        found
    }

    fn incompatible(&self, mixture: usize, pair: &Incompatible, step: Option<StepId>) -> Diagnostic {
        let (model, scene) = (&self.program.model, &self.program.scene);
        let species = |index: u32| model.species.get(index as usize).map_or("?", |s| s.name.as_str());
        let (a, b) = (species(pair.species.0), species(pair.species.1));
        let instance = model.mixtures[mixture].instance;
        let own = scene.instances.get(instance.0 as usize);
        let vessel = own.and_then(|i| i.owner).and_then(|o| scene.instances.get(o.0 as usize)).or(own);
        let (name, span) = vessel.map_or(("?", self.program.plan.span()), |v| (v.name.as_str(), v.span));
        let headline = format!("`{a}` and `{b}` come together in `{name}`: {}", pair.words);
        let place = self.place(step).unwrap_or(span);
        let mut d = Diagnostic::error(codes::INCOMPATIBLE_MIX, place, headline, "while this step ran");
        d.severity = pair.severity;
        d.help.extend(pair.help.iter().cloned());
        d.help(format!("if this is intended, write `allow incompatible {a} with {b} \"why\"`"))
    }
}

impl Observer for Screen<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.look(time, engine, changed);
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}

    fn stops(&self) -> bool {
        !self.alarms.is_empty()
    }
}

impl Listener for Screen<'_> {
    fn step(&mut self, _: f64, step: StepId, state: StepState) {
        if !matches!(self.program.plan.get(step).step, Step::Operation(_)) {
            return;
        }
        self.going.retain(|id| *id != step);
        self.last = Some(step);
        if state == StepState::Running {
            self.going.push(step);
        }
    }

    fn operation(&mut self, _: f64, step: StepId, _: &Operation, _: OperationState) {
        self.last = Some(step);
    }

    fn foreseen(&mut self, engine: &Engine<'_>, step: StepId, operation: &Operation) -> Option<Alarm> {
        self.would(engine, step, operation)
    }

    fn alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop_front().map(|(_, alarm)| alarm)
    }
}
