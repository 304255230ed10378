//! Listens to a run and notes what a bill needs.

use matterix_ir::Program;
use matterix_ir::inventory::Count;
use matterix_ir::model::Mixture;
use matterix_ir::plan::{Operation, StepId};
use matterix_ir::scene::InstanceId;

use super::origins::{Origins, mass_of};
use crate::exec::{Listener, OperationState};
use crate::process::{Engine, Observer};
use crate::touched::{Below, Touched};

/// A mixture at the end, as its equilibria have it.
#[derive(Clone, Debug, Default)]
pub(super) struct Settled {
    /// By content, mol; none of what takes part in no equilibrium.
    pub(super) amounts: Vec<Option<f64>>,
    /// By property of one number, SI.
    pub(super) properties: Vec<(u32, f64)>,
    /// Those of them that are outside the range of their model.
    pub(super) outside: Vec<u32>,
}

impl Settled {
    fn of(engine: &Engine<'_>, mixture: &Mixture) -> Settled {
        let value = |index: u32| match engine.model().observables.get(index as usize)?.value.as_slice() {
            [node] => Some(engine.eval(*node)),
            _ => None,
        };
        let properties = mixture.properties.iter().filter_map(|i| Some((*i, value(*i)?)));
        let valid = |i: &u32| engine.model().observables.get(*i as usize).and_then(|o| o.valid);
        let outside = mixture.properties.iter().filter(|i| valid(i).and_then(value).is_some_and(|holds| holds != 1.0));
        Settled {
            amounts: mixture.contents.iter().map(|c| value(c.settled?)).collect(),
            properties: properties.collect(),
            outside: outside.copied().collect(),
        }
    }
}

/// What was noted of a run.
pub struct Follower<'p> {
    pub(super) program: &'p Program,
    pub(super) origins: Origins,
    /// By holding, kg and SI of the unit it was written in.
    pub(super) held: Vec<(f64, f64)>,
    /// By tally: its value when the run began and now.
    pub(super) tallies: Vec<(f64, f64)>,
    /// By tally: how long it was true, s, as intervals.
    pub(super) running: Vec<Vec<(f64, f64)>>,
    /// Intervals in which steps used an instance, s.
    pub(super) uses: Vec<(InstanceId, f64, f64)>,
    /// Uses that go on: step, instances, since.
    open: Vec<(StepId, Vec<InstanceId>, f64)>,
    /// How many operations used each instance.
    pub(super) steps: Vec<usize>,
    /// Questions to a person.
    pub(super) asked: Vec<(f64, String)>,
    /// States as they were last shown.
    pub(super) states: Vec<f64>,
    /// By state, what it was when the run began, with what happened at that moment: salts have dissolved.
    pub(super) first: Vec<f64>,
    /// By mixture, what equilibria make of it at the end; empty before.
    pub(super) settled: Vec<Settled>,
    /// Tallies by what they rest on, and mixtures that streams run between.
    watched: (Touched, Touched),
    /// By tally, since when it has been true, s.
    since: Vec<Option<f64>>,
    /// The latest time heard of, s.
    pub(super) end: f64,
    /// When the first sample was taken, s.
    begun: f64,
    /// Whether a sample was taken.
    is_begun: bool,
}

impl<'p> Follower<'p> {
    /// Before the run.
    pub fn new(program: &'p Program) -> Self {
        let tallies = program.inventory.tallies.len();
        Follower {
            program,
            origins: Origins::default(),
            held: Vec::new(),
            tallies: vec![(0.0, 0.0); tallies],
            running: vec![Vec::new(); tallies],
            uses: Vec::new(),
            open: Vec::new(),
            steps: vec![0; program.scene.instances.len()],
            asked: Vec::new(),
            states: Vec::new(),
            first: Vec::new(),
            settled: Vec::new(),
            watched: Default::default(),
            since: vec![None; tallies],
            end: 0.0,
            begun: 0.0,
            is_begun: false,
        }
    }

    fn reach(&mut self, time: f64) {
        self.end = self.end.max(time);
    }

    fn begin(&mut self, engine: &Engine<'_>) {
        let stock = &self.program.inventory;
        self.held = stock.holdings.iter().map(|h| (engine.eval(h.mass), engine.eval(h.amount))).collect();
        let masses: Vec<f64> = self.held.iter().map(|h| h.0).collect();
        self.origins = Origins::new(stock, engine.model().mixtures.len(), &masses);
        let model = engine.model();
        let tallies = stock.tallies.iter().map(|t| Below::new(model, &[t.value]));
        let streamed = |i: &usize| stock.streams.iter().any(|(a, b)| *a as usize == *i || *b as usize == *i);
        let mixtures = (0..model.mixtures.len()).map(|i| match streamed(&i) {
            true => Below::states(model.mixtures[i].contents.iter().map(|c| c.state)),
            false => Below::default(),
        });
        let count = model.states.len();
        self.watched = (Touched::new(count, tallies), Touched::new(count, mixtures));
        self.states = engine.states();
        (self.first, self.begun) = (self.states.clone(), engine.time());
        for (index, tally) in stock.tallies.iter().enumerate() {
            self.tallies[index].0 = engine.eval(tally.value);
            self.counted(index, self.tallies[index].0, engine.time());
        }
    }

    /// A tally has this value from now on.
    fn counted(&mut self, index: usize, value: f64, time: f64) {
        self.tallies[index].1 = value;
        let is_on = self.program.inventory.tallies[index].count == Count::Running && value != 0.0;
        match (self.since[index], is_on) {
            (None, true) => self.since[index] = Some(time),
            (Some(since), false) => {
                self.ran(index, since, time);
                self.since[index] = None;
            }
            _ => {}
        }
    }

    /// A tally was true for a while.
    fn ran(&mut self, index: usize, since: f64, until: f64) {
        match self.running[index].last_mut() {
            Some(before) if before.1 == since => before.1 = until,
            _ if until > since => self.running[index].push((since, until)),
            _ => {}
        }
    }

    /// Follows the streams: all ends of theirs as they are now, also of those that are not shown.
    fn stream(&mut self, engine: &Engine<'_>) {
        let (model, streams) = (engine.model(), &self.program.inventory.streams);
        let mut now = vec![0.0; model.mixtures.len()];
        for mixture in streams.iter().flat_map(|(a, b)| [*a as usize, *b as usize]) {
            if let Some(m) = model.mixtures.get(mixture) {
                now[mixture] = mass_of(model, m, |state| engine.state(state));
            }
        }
        self.origins.stream(streams, &now);
    }

    fn end_use(&mut self, time: f64, step: StepId) {
        while let Some(at) = self.open.iter().position(|o| o.0 == step) {
            let (_, instances, since) = self.open.remove(at);
            self.uses.extend(instances.into_iter().map(|i| (i, since, time)));
        }
    }
}

impl Observer for Follower<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.reach(time);
        if !std::mem::replace(&mut self.is_begun, true) {
            return self.begin(engine);
        }
        let program = self.program;
        for index in self.watched.0.by(changed) {
            let value = engine.eval(program.inventory.tallies[index as usize].value);
            self.counted(index as usize, value, time);
        }
        // Also of one instant: what moves each of two ends may be shown one after the other.
        if !self.watched.1.by(changed).is_empty() {
            self.stream(engine);
        }
        if time <= self.begun {
            self.first = engine.states();
        }
        for &state in changed {
            if let Some(slot) = self.states.get_mut(state as usize) {
                *slot = engine.state(state);
            }
        }
    }

    fn event(&mut self, time: f64, _: usize) {
        self.reach(time);
    }

    fn process(&mut self, time: f64, _: usize, _: bool) {
        self.reach(time);
    }

    fn moved(&mut self, time: f64, from: u32, to: u32, fraction: f64) {
        self.reach(time);
        self.origins.carry(from as usize, to as usize, fraction);
    }
}

impl Listener for Follower<'_> {
    fn ended(&mut self, engine: &Engine<'_>) {
        let time = engine.time();
        self.settled = engine.model().mixtures.iter().map(|m| Settled::of(engine, m)).collect();
        for index in 0..self.since.len() {
            if let Some(since) = self.since[index].take() {
                self.ran(index, since, time);
            }
        }
    }

    fn operation(&mut self, time: f64, step: StepId, operation: &Operation, state: OperationState) {
        self.reach(time);
        if state != OperationState::Started {
            return self.end_use(time, step);
        }
        let mut used: Vec<InstanceId> = operation.claims.iter().copied().chain(operation.device).collect();
        used.sort();
        used.dedup();
        for instance in &used {
            if let Some(count) = self.steps.get_mut(instance.0 as usize) {
                *count += 1;
            }
        }
        self.open.push((step, used, time));
    }

    fn ask(&mut self, time: f64, _: StepId, text: &str) {
        self.reach(time);
        self.asked.push((time, text.to_owned()));
    }
}
