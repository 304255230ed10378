//! Takes from the engine what a sample may have changed.

use matterix_ir::model::Model;

use super::recording::Recording;
use crate::process::Engine;
use crate::touched::{Below, Touched};

/// Knows which observables rest on which states.
#[derive(Clone, Debug)]
pub struct Sampler {
    observables: Touched,
    has_begun: bool,
}

impl Sampler {
    /// Of a model.
    pub fn new(model: &Model) -> Self {
        let below = model.observables.iter().map(|o| Below::new(model, &o.value));
        Sampler { observables: Touched::new(model.states.len(), below), has_begun: false }
    }

    /// Takes the first sample, of what is there once all that happens at once at the start has happened.
    pub fn begin(&mut self, recording: &mut Recording, time: f64, engine: &Engine<'_>) {
        self.has_begun = true;
        self.sample(recording, time, engine, &[]);
    }

    /// Takes a sample: of the first one all, later only `changed` states and what rests on them. A recording of both ends of
    /// each curve takes what lies between only where all states are shown, as they are at the end. Before it begins it takes none.
    pub fn sample(&self, recording: &mut Recording, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        if !self.has_begun {
            return;
        }
        let model = engine.model();
        if recording.keeps_ends() && recording.sampled.is_some() && changed.len() < model.states.len() {
            return recording.sampled(time);
        }
        let (states, touched): (Vec<u32>, _) = match recording.sampled {
            None => ((0..model.states.len() as u32).collect(), self.observables.all()),
            Some(_) => (changed.to_vec(), self.observables.by(changed)),
        };
        recording.sampled(time);
        for state in states {
            recording.state(time, state, engine.state(state));
        }
        for index in touched {
            let nodes = model.observables[index as usize].value.iter();
            recording.observable(time, index, nodes.map(|node| engine.eval(*node)));
        }
    }
}
