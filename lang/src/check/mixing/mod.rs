//! H1 and M1: which species meet on the way of the plan, and what the vessels are made of.
//!
//! The plan is followed in the order of the text. Branches join; loops are followed turn by turn and then until further turns bring
//! nothing new. Where steps that run beside each other bring something into one vessel and take it out again, the plan is followed
//! in every order besides (`orders.rs`). Residues count: what was emptied is still wet.
//!
//! - `state`, `evaluator`: what every mixture holds at a point of the plan, and the values of nodes there.
//! - `lines`, `orders`: the plan as lines of steps beside each other, and the orders in which they may happen.
//! - `feeds`, `doses`: what brings something in and takes it out.
//! - `reactions`, `hazards`, `uses`, `report`: what comes of what meets, which values that concerns, and the findings.

mod doses;
mod evaluator;
mod feeds;
mod hazards;
mod lines;
mod orders;
mod reactions;
mod report;
mod settled;
mod state;
mod uses;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::model::{Action, Event};
use matterix_ir::plan::{Caught, Plan, PlanStep, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, FileId, NodeId, Severity, Sources, Span};

use super::Subject;
use super::time::Times;
use crate::declare::SpeciesId;
use crate::declare::compatibility::Consequence;
use crate::elaborate::hazards::Hazard;
use crate::eval::lab::Elaborator;
use crate::names::DeclId;
use doses::Dose;
use evaluator::NodeEvaluator;
use hazards::Hazards;
use state::{Before, MixtureState};
use uses::Uses;

/// Steps after which turns of loops are no longer followed one by one, so that nested loops stay cheap.
const PATIENCE: usize = 20_000;

/// Turns of a loop that are followed one by one.
const TURNS: f64 = 100.0;

/// Judges what the vessels of a lab hold, for a lab without a workflow.
pub fn contents(lab: &mut Elaborator<'_>) {
    let nothing = PlanStep { label: String::new(), span: lab.lab_name, step: Step::Sequence(Vec::new()) };
    let plan = Plan {
        workflow: String::new(),
        arguments: Vec::new(),
        steps: vec![nothing],
        root: StepId(0),
        locals: Vec::new(),
        limits: Vec::new(),
        ends: Vec::new(),
    };
    if let Some(ready) = ready(lab) {
        let sources = Sources::default();
        let found = mixing(Subject { lab, sources: &sources, plan: &plan, derivatives: &[], events: &[] }, ready);
        found.into_iter().for_each(|d| lab.report(d));
    }
}

/// Two species that come together, by the mixture.
type Pair = (InstanceId, SpeciesId, SpeciesId);

/// Two species that come together in one of the orders in which steps can run.
struct Coming {
    pair: Pair,
    place: Span,
    diagnostic: Diagnostic,
    /// On every way to this step.
    certain: bool,
    /// How bad it is where it happens in every order.
    grave: Severity,
}

/// What one event brings together: what it is ranked by, the finding, and what and where it is.
struct Pending {
    consequences: Vec<Consequence>,
    diagnostic: Diagnostic,
    pair: Pair,
    place: Span,
}

/// What is looked up in a lab before a plan is followed.
pub struct Ready {
    materials: BTreeMap<InstanceId, DeclId>,
    hazards: Hazards,
}

impl Ready {
    /// The hazards of the lab.
    pub fn hazards(&self) -> Arc<[Hazard]> {
        self.hazards.all.clone()
    }
}

/// Makes a lab ready; none where contents and transfers are not right, as one cannot tell then what meets.
pub fn ready(lab: &mut Elaborator<'_>) -> Option<Ready> {
    let right = !lab.diagnostics.iter().any(Diagnostic::is_error);
    right.then(|| Ready { materials: materials(lab), hazards: Hazards::new(lab.hazards()) })
}

/// Judges what a plan brings together.
pub fn mixing(subject: Subject<'_, '_>, ready: Ready) -> Vec<Diagnostic> {
    let Subject { lab, plan, events, .. } = subject;
    let eyes = NodeEvaluator::new(lab);
    let library: BTreeSet<FileId> =
        lab.tables.names.modules.iter().filter(|m| m.is_library()).map(|m| m.file).collect();
    let uses = Uses::new(lab, plan, events, &ready.hazards.all, &library);
    let mut walk = Walk {
        uses,
        by_event: moves_of_events(&eyes, plan),
        feeds: feeds::feeds(&eyes, events),
        beside: 0,
        events,
        eyes: &eyes,
        materials: ready.materials,
        hazards: ready.hazards,
        plan,
        library,
        places: vec![plan.get(plan.root).span],
        seen: BTreeSet::new(),
        walls: BTreeSet::new(),
        at_walls: BTreeSet::new(),
        pending: Vec::new(),
        certain: Vec::new(),
        pairs: BTreeMap::new(),
        told: Vec::new(),
        orders: None,
        raised: Vec::new(),
        found: Vec::new(),
        steps: 0,
    };
    walk.hazards.settle(&eyes, events, &walk.library);
    let mut world = MixtureState::initial(&eyes, plan.locals.len());
    walk.begin(&mut world);
    walk.fed(&mut world);
    walk.endangered(&world);
    walk.measured_out(&world);
    walk.given(&world);
    walk.endanger(&mut world);
    let begun = world.clone();
    walk.step(plan.root, world);
    orders::orders(&mut walk, &begun, || Times::of(subject));
    walk.tell_of_others();
    walk.found
}

/// The transfers between mixtures that operations make themselves.
fn moves_of_plan(plan: &Plan, order: &[InstanceId]) -> BTreeSet<(InstanceId, InstanceId)> {
    let mut out = BTreeSet::new();
    for step in &plan.steps {
        let Step::Operation(o) = &step.step else { continue };
        for action in o.at_start.iter().chain(&o.at_end) {
            if let Action::Move { from, to, .. } = action
                && let (Some(a), Some(b)) = (order.get(*from as usize), order.get(*to as usize))
            {
                out.insert((*a, *b));
            }
        }
    }
    out
}

/// The transfers that events make between mixtures.
fn moves_of_events(eyes: &NodeEvaluator<'_, '_>, plan: &Plan) -> BTreeSet<(InstanceId, InstanceId)> {
    let by_plan = moves_of_plan(plan, &eyes.lab.mixtures);
    let by_process: BTreeSet<_> = eyes.lab.streams.keys().map(|(_, from, to)| (*from, *to)).collect();
    eyes.lab.moves.iter().filter(|m| !by_process.contains(m) && !by_plan.contains(m)).copied().collect()
}

/// What the walls around mixtures are made of.
fn materials(lab: &mut Elaborator<'_>) -> BTreeMap<InstanceId, DeclId> {
    let mut out = BTreeMap::new();
    for m in (0..lab.instances.len() as u32).map(InstanceId).filter(|m| lab.is_mixture(*m)).collect::<Vec<_>>() {
        let material = lab.wall_of(m);
        out.extend(material.map(|material| (m, material)));
    }
    out
}

/// What the vessels may hold where failures are raised: of a wait that is timed out, and of any step.
#[derive(Clone, Default)]
struct Raised {
    timeout: Option<MixtureState>,
    any: Option<MixtureState>,
}

impl Raised {
    /// What the vessels may hold where a handler begins.
    fn entry(&self, caught: &Caught, before: &MixtureState, after: &MixtureState) -> MixtureState {
        let around = || before.clone().join(after.clone());
        match (caught, &self.timeout, &self.any) {
            (Caught::Named(name), Some(world), _) if name == "timeout" => world.clone(),
            (Caught::Any, Some(timeout), Some(any)) => around().join(timeout.clone()).join(any.clone()),
            (_, _, Some(any)) => around().join(any.clone()),
            (Caught::Any, Some(timeout), None) => around().join(timeout.clone()),
            _ => around(),
        }
    }

    fn note(place: &mut Option<MixtureState>, world: &MixtureState) {
        *place = Some(match place.take() {
            Some(known) => known.join(world.clone()),
            None => world.clone(),
        });
    }
}

struct Walk<'w, 'a> {
    eyes: &'w NodeEvaluator<'w, 'a>,
    /// What the wall around each mixture is made of, where that is said.
    materials: BTreeMap<InstanceId, DeclId>,
    hazards: Hazards,
    uses: Uses,
    plan: &'w Plan,
    /// Transfers that events make: those that neither operations nor processes do.
    by_event: BTreeSet<(InstanceId, InstanceId)>,
    library: BTreeSet<FileId>,
    /// Amounts that laws write.
    feeds: Vec<feeds::Feed>,
    /// Branches and jobs beside which the current step runs, and whose time passes with its own.
    beside: usize,
    events: &'w [Event],
    /// Places in the user's text around the current step, innermost last.
    places: Vec<Span>,
    /// Pairs found, with the place and the mixture.
    seen: BTreeSet<(Span, SpeciesId, SpeciesId)>,
    /// Walls looked at, by what touches them.
    walls: BTreeSet<(InstanceId, SpeciesId)>,
    at_walls: BTreeSet<(Span, DeclId, SpeciesId)>,
    /// Findings of the current event.
    pending: Vec<Pending>,
    /// What the current event brings together for certain.
    certain: Vec<Pair>,
    /// What is told, and how bad it is.
    pairs: BTreeMap<Pair, Severity>,
    /// Where it is told, with its place among the findings.
    told: Vec<(Pair, Span, usize)>,
    /// What comes together in other orders, while these are followed.
    orders: Option<orders::Found>,
    /// What the vessels may hold where failures are raised in the bodies with handlers around, innermost last.
    raised: Vec<Raised>,
    found: Vec<Diagnostic>,
    steps: usize,
}

impl Walk<'_, '_> {
    /// What the vessels hold when the plan begins.
    fn begin(&mut self, world: &mut MixtureState) {
        for &m in &self.eyes.lab.mixtures {
            let all: Vec<SpeciesId> = world.present(m).map(|p| p.0.0).collect();
            for (i, s) in all.iter().enumerate() {
                self.meet(world, m, *s, &all[..i], None);
                self.touch(world, m, *s, None);
            }
            self.settle();
            self.note_certain(world);
            world.react(self.eyes.lab, m, self.eyes.lab.instances[m.0 as usize].span);
        }
    }

    fn place(&self) -> Span {
        self.places.last().copied().unwrap_or_default()
    }

    fn each(&mut self, steps: &[StepId], world: MixtureState) -> MixtureState {
        steps.iter().fold(world, |world, s| self.step(*s, world))
    }

    fn step(&mut self, id: StepId, world: MixtureState) -> MixtureState {
        self.steps += 1;
        let step = self.plan.get(id);
        let own = !self.library.contains(&step.span.file) && step.span != Span::default();
        if own {
            self.places.push(step.span);
        }
        self.used(id, &world);
        let world = self.inside(&step.step, world);
        if matches!(step.step, Step::RepeatWhile { .. }) {
            self.used(id, &world);
        }
        if own {
            self.places.pop();
        }
        world
    }

    fn inside(&mut self, step: &Step, mut world: MixtureState) -> MixtureState {
        match step {
            Step::Sequence(list) => self.each(list, world),
            Step::Parallel(list) => {
                self.beside += 1;
                let world = self.each(list, world);
                self.beside -= 1;
                world
            }
            Step::Wait { duration } => {
                self.flow_on(Some(*duration), &mut world);
                world
            }
            Step::WaitUntil { timeout: None, .. } | Step::Hold { timeout: None, .. } | Step::Await { .. } => {
                self.flow_on(None, &mut world);
                world
            }
            Step::Operation(o) => {
                // What cannot begin does nothing; that is another finding.
                if o.needs.iter().any(|need| self.eyes.truth(need.node, &world) == Some(false)) {
                    return world;
                }
                // What flows already flows in the time of others too.
                let apart = self.beside == 0 || !self.is_flowing(&world);
                for action in &o.at_start {
                    self.action(action, &mut world);
                }
                let dose = self.dose(o, &world).filter(|_| apart);
                dose.iter().for_each(|dose| self.pours(dose, &mut world));
                // What begins may be over when the operation is.
                if !o.at_start.is_empty() && !o.at_end.is_empty() {
                    self.streams(dose.as_ref(), &mut world);
                }
                for action in &o.at_end {
                    self.action(action, &mut world);
                }
                // What is over at once leaves the amounts as they are, whatever begins to flow.
                let at_once = o.takes.is_none() && o.until.is_none() && self.by_event.is_empty();
                let at_once = at_once.then(|| world.states.clone());
                self.streams(dose.as_ref(), &mut world);
                world.states = at_once.unwrap_or(world.states);
                dose.iter().for_each(|dose| self.given_off(dose, &mut world));
                self.fed(&mut world);
                self.endanger(&mut world);
                if let Some(raised) = self.raised.last_mut() {
                    Raised::note(&mut raised.any, &world);
                }
                world
            }
            Step::WaitUntil { timeout: Some(_), .. } | Step::Hold { timeout: Some(_), .. } => {
                self.flow_on(None, &mut world);
                if let Some(raised) = self.raised.last_mut() {
                    Raised::note(&mut raised.timeout, &world);
                }
                world
            }
            Step::Guarded { body, handlers, finally } => {
                let before = world.clone();
                let handled = !handlers.is_empty();
                self.raised.extend(handled.then(Raised::default));
                let mut after = self.step(*body, world);
                let raised = handled.then(|| self.raised.pop()).flatten().unwrap_or_default();
                self.pass_on(&raised);
                for (caught, handler) in handlers {
                    let entry = raised.entry(caught, &before, &after);
                    let handled = self.step(*handler, entry);
                    if !self.leaves(*handler) {
                        after = after.join(handled);
                    }
                }
                match finally {
                    Some(finally) => self.step(*finally, after),
                    None => after,
                }
            }
            Step::Try(list) => {
                let mut before = world.clone();
                let mut after: Option<MixtureState> = None;
                for s in list {
                    let done = self.step(*s, before.clone());
                    before = before.join(done.clone());
                    after = Some(match after {
                        Some(a) => a.join(done),
                        None => done,
                    });
                }
                after.unwrap_or(world)
            }
            Step::If { condition, then, otherwise } => match (self.eyes.truth(condition.node, &world), otherwise) {
                (Some(true), _) => self.step(*then, world),
                (Some(false), Some(otherwise)) => self.step(*otherwise, world),
                (Some(false), None) => world,
                (None, otherwise) => {
                    let taken = self.step(*then, world.clone());
                    let not = match otherwise {
                        Some(otherwise) => self.step(*otherwise, world),
                        None => world,
                    };
                    match (self.leaves(*then), otherwise.is_some_and(|o| self.leaves(o))) {
                        (true, false) => not,
                        (false, true) => taken,
                        _ => taken.join(not),
                    }
                }
            },
            Step::Repeat { times, body } => {
                let times = self.eyes.value(*times, &world);
                self.turns(times, *body, world)
            }
            Step::RepeatWhile { condition, max, body } => {
                if self.eyes.truth(condition.node, &world) == Some(false) {
                    return world;
                }
                if self.eyes.value(*max, &world) <= 1.0 {
                    let once = self.step(*body, world.clone());
                    return world.join(once);
                }
                if self.steps > PATIENCE {
                    return self.more_turns(*body, world);
                }
                let once = self.step(*body, world.clone());
                let twice = self.step(*body, once.clone());
                self.more_turns(*body, world.join(once).join(twice))
            }
            Step::Let { local, value } => {
                let value = self.eyes.value(*value, &world);
                world.keep(*local, value);
                world
            }
            // Its body does not begin.
            Step::Keep { condition, .. } if self.eyes.truth(condition.node, &world) == Some(false) => world,
            Step::Skill { body, .. }
            | Step::Named { body, .. }
            | Step::Keep { body, .. }
            | Step::During { body, .. }
            | Step::Within { body, .. }
            | Step::Claim { body, .. } => self.step(*body, world),
            Step::Start { body, .. } => {
                // Its time passes beside that of all that follows.
                self.beside += 1;
                self.step(*body, world)
            }
            _ => world,
        }
    }

    /// So many turns, or an unknown number of them.
    fn turns(&mut self, times: f64, body: StepId, mut world: MixtureState) -> MixtureState {
        let followed = if times.is_nan() { 1.0 } else { times.min(TURNS) };
        let mut done = 0.0;
        while done < followed {
            if self.steps > PATIENCE {
                return self.more_turns(body, world);
            }
            world = self.step(body, world);
            done += 1.0;
        }
        if done >= times { world } else { self.more_turns(body, world) }
    }

    /// Any number of turns: until one more brings nothing that was not there, and changes nothing that is known.
    fn more_turns(&mut self, body: StepId, mut world: MixtureState) -> MixtureState {
        loop {
            let after = self.step(body, world.clone());
            let joined = world.clone().join(after);
            if joined.is_like(&world) {
                return joined;
            }
            world = joined;
        }
    }

    /// Whether nothing after a step is reached from it: it fails, or begins the body around it again.
    fn leaves(&self, id: StepId) -> bool {
        match &self.plan.get(id).step {
            Step::Fail { .. } | Step::Retry { .. } => true,
            Step::Sequence(list) => list.iter().any(|s| self.leaves(*s)),
            _ => false,
        }
    }

    fn action(&mut self, action: &Action, world: &mut MixtureState) {
        let before = match action {
            Action::Move { fraction, from, to, .. } => {
                let mixtures = &self.eyes.lab.mixtures;
                let ends = mixtures.get(*from as usize).zip(mixtures.get(*to as usize)).map(|(a, b)| (*a, *b));
                if let Some((a, b)) = ends.filter(|(a, b)| a != b) {
                    let share = self.eyes.value(*fraction, world);
                    self.transfers(a, b, share, world);
                }
                ends.map(|(a, b)| (b, world.before(a, b)))
            }
            Action::Assign { .. } => None,
        };
        let effected = self.effected(action, world);
        world.act(self.eyes, action, self.place());
        if let Some((mixture, species)) = effected {
            self.bring(mixture, species, self.place(), world);
        }
        if let Some((to, before)) = before {
            self.arrived(&before, world, to);
        }
    }

    /// Transfers that processes and events make from now on. How much of its source each of them takes is not known, but for those of a dose.
    fn streams(&mut self, dose: Option<&Dose>, world: &mut MixtureState) {
        let lab = self.eyes.lab;
        let mut active = self.by_event.clone();
        for (process, from, to) in lab.streams.keys() {
            if self.runs(*process, world) != Some(false) {
                active.insert((*from, *to));
                self.flows((*process, *from, *to), world);
            }
        }
        for (from, to) in &active {
            if !dose.is_some_and(|dose| dose.takes(*from, *to)) {
                self.transfers(*from, *to, f64::NAN, world);
            }
        }
        // One stream may feed the next.
        for _ in 0..active.len() {
            let mut changed = false;
            for (from, to) in &active {
                let fresh = |w: &MixtureState| w.present(*to).filter(|(_, e)| !e.residue).count();
                let (before, count) = (world.before(*from, *to), fresh(world));
                world.transfer(self.eyes, (f64::NAN, &[]), *from, *to, self.place(), true);
                if fresh(world) != count {
                    changed = true;
                    self.arrived(&before, world, *to);
                }
            }
            if !changed {
                break;
            }
        }
    }

    /// What streams carry while a time passes, if that is known.
    fn flow_on(&mut self, time: Option<NodeId>, world: &mut MixtureState) {
        if !self.may_flow(world) {
            return;
        }
        let time = time.filter(|_| self.beside == 0).map(|time| self.eyes.value(time, world));
        let dose = time.and_then(|time| self.waited(time, world));
        dose.iter().for_each(|dose| self.pours(dose, world));
        self.streams(dose.as_ref(), world);
        dose.iter().for_each(|dose| self.given_off(dose, world));
        self.fed(world);
        self.endanger(world);
    }

    /// What one body does not handle may be handled around it.
    fn pass_on(&mut self, raised: &Raised) {
        if let Some(outer) = self.raised.last_mut() {
            raised.timeout.iter().for_each(|world| Raised::note(&mut outer.timeout, world));
            raised.any.iter().for_each(|world| Raised::note(&mut outer.any, world));
        }
    }

    /// Notes in a world what has met in it for certain.
    fn note_certain(&mut self, world: &mut MixtureState) {
        world.met.extend(self.certain.drain(..));
    }

    /// Judges what a transfer brought.
    fn arrived(&mut self, before: &Before, world: &mut MixtureState, to: InstanceId) {
        let brought: Vec<SpeciesId> = before.source.iter().filter(|(_, e)| !e.residue).map(|p| *p.0).collect();
        let there: Vec<SpeciesId> = before.target.keys().copied().collect();
        for s in &brought {
            let others: Vec<SpeciesId> = there.iter().filter(|o| !brought.contains(o)).copied().collect();
            if !there.contains(s) {
                self.meet(world, to, *s, &others, Some(before));
            }
            self.touch(world, to, *s, Some(before));
        }
        let place = self.place();
        let made = world.react(self.eyes.lab, to, place);
        for s in made {
            let all: Vec<SpeciesId> = world.present(to).map(|p| p.0.0).filter(|o| *o != s).collect();
            self.meet(world, to, s, &all, None);
        }
        self.settle();
        self.note_certain(world);
    }
}

#[cfg(test)]
mod tests {
    use crate::check::tests::found;

    fn met(holding: &str, steps: &str) -> Vec<String> {
        let text = format!(
            "use std::glassware::Beaker250mL
            lab bench {{
                ambient: 25 degC
                a = Beaker250mL at (0, 0, 0) m holding 50 mL of water + {holding}
                b = Beaker250mL at (1, 0, 0) m holding 50 mL of water + 1 mmol of NaCl
            }}
            workflow w in bench {{\n{steps}\n}}\n"
        );
        found(&text, |bench| {
            let ready = super::ready(bench.lab).expect("contents are right");
            super::mixing(bench.subject(), ready)
        })
    }

    #[test]
    fn what_may_meet_meets() {
        assert_eq!(met("1 mmol of KCl", "wait 1 s"), [""; 0]);
    }

    #[test]
    fn what_must_not_meet_is_found_where_it_stands() {
        let found = "incompatible-mix: `NaOCl` and `HCl` come together in `a`: toxic gas";
        assert_eq!(met("1 mmol of NaOCl + 1 mmol of HCl", "wait 1 s"), [found]);
    }
}
