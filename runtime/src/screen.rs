//! What a run watches its mixtures and devices for: species that should not meet, hazards and cautions, on actual contents and
//! temperatures. A screen looks on; it changes nothing of the run.

mod condition;

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::{Action, Danger, Incompatible};
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::values::Formulas;
use matterix_ir::{Diagnostic, Program, Severity, Span, codes};
use serde::Serialize;

use crate::exec::{Listener, OperationState, StepState};
use crate::process::{Engine, Observer};
use condition::Condition;

/// Less of a species, mol per kg of mixture, is what equilibria and rounding leave, and counts as none.
const TRACE: f64 = 1e-6;

/// Recipes are rounded: what is at a limit within their digits counts.
const ROUNDED: f64 = 1.0 - 1e-6;

/// A finding of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// When it was made, s.
    pub time: f64,
    /// What was found.
    pub diagnostic: Diagnostic,
}

/// A species in one mixture, by the states of its amount and of its ions.
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
    fn amount(&self, states: &[f64]) -> f64 {
        let ions = self.ions.iter().map(|(state, n)| states[*state] / n).reduce(f64::min);
        self.amount.map_or(0.0, |state| states[state]) + ions.unwrap_or(0.0)
    }
}

/// A pair of species in one mixture.
struct Pair<'p> {
    incompatible: &'p Incompatible,
    sides: (Side, Side),
}

/// Looks at every moment of a run that is shown.
pub(crate) struct Screen<'p> {
    program: &'p Program,
    /// Pairs by mixture, the gravest first.
    pairs: Vec<(usize, Vec<Pair<'p>>)>,
    /// What is told already, by mixture and consequence.
    told: BTreeSet<(usize, &'p str)>,
    /// The conditions of dangers, and whether each held when last looked at.
    dangers: Vec<(Condition, bool)>,
    /// Room for values.
    room: Vec<f64>,
    /// Steps around each step.
    above: BTreeMap<StepId, StepId>,
    /// Operations that go on, the latest last.
    going: Vec<StepId>,
    /// The operation that began or ended last.
    last: Option<StepId>,
    pub(crate) found: Vec<Finding>,
}

impl<'p> Screen<'p> {
    pub(crate) fn new(program: &'p Program) -> Self {
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
        let mut formulas = Formulas::default();
        let condition = |danger: &Danger| (Condition::new(&model.graph, &mut formulas, danger.when), false);
        let dangers = model.dangers.iter().map(condition).collect();
        let mut above = BTreeMap::new();
        for (id, step) in program.plan.steps.iter().enumerate() {
            above.extend(step.step.children().into_iter().map(|child| (child, StepId(id as u32))));
        }
        Screen {
            program,
            pairs,
            told: BTreeSet::new(),
            dangers,
            room: Vec::new(),
            above,
            going: Vec::new(),
            last: None,
            found: Vec::new(),
        }
    }

    /// Whether there is nothing to watch for.
    pub(crate) fn is_idle(&self) -> bool {
        self.pairs.is_empty() && self.dangers.is_empty()
    }

    /// The statement of the user's that has to do with a mixture now, or with anything.
    fn place(&self, mixture: Option<usize>) -> Option<Span> {
        let plan = &self.program.plan;
        let concerns = |id: &&StepId| {
            let Step::Operation(o) = &plan.get(**id).step else { return false };
            let mut actions = o.at_start.iter().chain(&o.at_end);
            actions.any(|a| matches!(a, Action::Move { to, .. } if Some(*to as usize) == mixture))
        };
        let latest = self.going.iter().rev().find(concerns).or(self.going.last()).or(self.last.as_ref()).copied();
        let own = plan.get(plan.root).span.file;
        let around = std::iter::successors(latest, |id| self.above.get(id).copied());
        around.map(|id| plan.get(id).span).find(|span| span.file == own && !span.is_empty())
    }

    fn look(&mut self, time: f64, engine: &Engine<'_>) {
        let states = engine.states();
        for (mixture, pairs) in &self.pairs {
            let some = |p: &Pair<'_>| p.sides.0.amount(states) > 0.0 && p.sides.1.amount(states) > 0.0;
            if !pairs.iter().any(some) {
                continue;
            }
            let of = &self.program.model.mixtures[*mixture];
            let masses = of.contents.iter().map(|c| {
                let molar_mass = self.program.model.species.get(c.species as usize).map_or(0.0, |s| s.molar_mass);
                states[c.state as usize] * molar_mass
            });
            let mass: f64 = masses.sum();
            let meets = |p: &&Pair<'_>| {
                let (least_a, least_b) = p.incompatible.least;
                let enough = |side: &Side, least: f64| side.amount(states) >= least.max(TRACE) * mass * ROUNDED;
                some(p) && enough(&p.sides.0, least_a) && enough(&p.sides.1, least_b)
            };
            // The gravest of what meets at one moment: the others are mended with it.
            let Some(pair) = pairs.iter().find(meets) else { continue };
            if !self.told.insert((*mixture, pair.incompatible.words.as_str())) {
                continue;
            }
            let place = self.place(Some(*mixture));
            let diagnostic = self.incompatible(*mixture, pair.incompatible, place);
            self.found.push(Finding { time, diagnostic });
        }
        for (index, danger) in self.program.model.dangers.iter().enumerate() {
            let (condition, there) = &mut self.dangers[index];
            let now = condition.holds(engine, &mut self.room);
            let before = std::mem::replace(there, now);
            let known = || self.found.iter().any(|f| f.diagnostic.headline == danger.headline);
            if !now || before || known() {
                continue;
            }
            let span = self.place(None).unwrap_or(danger.span);
            let mut diagnostic = Diagnostic::error(danger.code, span, danger.headline.clone(), "it came about here");
            diagnostic.severity = danger.severity;
            diagnostic.help.clone_from(&danger.help);
            self.found.push(Finding { time, diagnostic });
        }
    }

    fn incompatible(&self, mixture: usize, pair: &Incompatible, place: Option<Span>) -> Diagnostic {
        let (model, scene) = (&self.program.model, &self.program.scene);
        let species = |index: u32| model.species.get(index as usize).map_or("?", |s| s.name.as_str());
        let (a, b) = (species(pair.species.0), species(pair.species.1));
        let instance = model.mixtures[mixture].instance;
        let own = scene.instances.get(instance.0 as usize);
        let vessel = own.and_then(|i| i.owner).and_then(|o| scene.instances.get(o.0 as usize)).or(own);
        let (name, span) = vessel.map_or(("?", Span::default()), |v| (v.name.as_str(), v.span));
        let headline = format!("`{a}` and `{b}` have come together in `{name}`: {}", pair.words);
        let mut d = Diagnostic::error(codes::INCOMPATIBLE_MIX, place.unwrap_or(span), headline, "while this went on");
        d.severity = pair.severity;
        d.help.extend(pair.help.iter().cloned());
        d.help(format!("if this is meant, say so: `allow incompatible {a} with {b} \"why\"`"))
    }

    /// Whether one of the findings is an error.
    pub(crate) fn is_grave(&self) -> bool {
        self.found.iter().any(|f| f.diagnostic.severity == Severity::Error)
    }
}

impl Observer for Screen<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>) {
        self.look(time, engine);
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
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
}
