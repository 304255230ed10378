//! Listens to a run and notes what a bill needs.

use matterix_ir::Program;
use matterix_ir::plan::{Operation, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::stock::Count;

use super::origins::{Origins, mass_of};
use crate::exec::{Listener, OperationState};
use crate::process::{Engine, Observer};

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
    /// States at the last sample.
    pub(super) states: Vec<f64>,
    /// The latest time heard of, s.
    pub(super) end: f64,
    last: Option<f64>,
}

impl<'p> Follower<'p> {
    /// Before the run.
    pub fn new(program: &'p Program) -> Self {
        let tallies = program.stock.tallies.len();
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
            end: 0.0,
            last: None,
        }
    }

    fn reach(&mut self, time: f64) {
        self.end = self.end.max(time);
    }

    fn begin(&mut self, engine: &Engine<'_>) {
        let stock = &self.program.stock;
        self.held = stock.holdings.iter().map(|h| (engine.eval(h.mass), engine.eval(h.amount))).collect();
        let masses: Vec<f64> = self.held.iter().map(|h| h.0).collect();
        self.origins = Origins::new(stock, engine.model().mixtures.len(), &masses);
        for (slot, tally) in self.tallies.iter_mut().zip(&stock.tallies) {
            let value = engine.eval(tally.value);
            *slot = (value, value);
        }
    }

    fn end_use(&mut self, time: f64, step: StepId) {
        while let Some(at) = self.open.iter().position(|o| o.0 == step) {
            let (_, instances, since) = self.open.remove(at);
            self.uses.extend(instances.into_iter().map(|i| (i, since, time)));
        }
    }
}

impl Observer for Follower<'_> {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, _: &[u32]) {
        self.reach(time);
        let Some(last) = self.last.replace(time) else {
            self.begin(engine);
            self.states = engine.states();
            return;
        };
        let program = self.program;
        for (i, tally) in program.stock.tallies.iter().enumerate() {
            // Between two samples the value is that of the earlier one.
            if tally.count == Count::Running && self.tallies[i].1 != 0.0 && time > last {
                match self.running[i].last_mut() {
                    Some(open) if open.1 == last => open.1 = time,
                    _ => self.running[i].push((last, time)),
                }
            }
            self.tallies[i].1 = engine.eval(tally.value);
        }
        if !program.stock.streams.is_empty() && time > last {
            let (model, states) = (engine.model(), engine.states());
            let now: Vec<f64> = model.mixtures.iter().map(|m| mass_of(model, m, &states)).collect();
            self.origins.stream(&program.stock.streams, &now);
        }
        self.states = engine.states();
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
