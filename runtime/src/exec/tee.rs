//! Two listeners as one.

use matterix_ir::plan::{Condition, Operation, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{NodeId, Unit};

use super::failure::FailureTrace;
use super::listener::{Alarm, Asked, ExpectationResult, Listener, OperationState, StepState};
use crate::contact::Sighting;
use crate::motion::{Burden, Moment};
use crate::process::{Engine, Observer};

/// Tells both, the first one first.
pub struct Tee<'a>(pub &'a mut dyn Listener, pub &'a mut dyn Listener);

macro_rules! both {
    ($($name:ident($($arg:ident: $ty:ty),*);)*) => {
        $(fn $name(&mut self, $($arg: $ty),*) {
            self.0.$name($($arg),*);
            self.1.$name($($arg),*);
        })*
    };
}

impl Observer for Tee<'_> {
    both! {
        sample(time: f64, engine: &Engine<'_>, changed: &[u32]);
        curve(time: f64, engine: &Engine<'_>, changed: &[u32]);
        leaves(time: f64, engine: &Engine<'_>, states: &[u32]);
        begun(time: f64, engine: &Engine<'_>);
        event(time: f64, event: usize);
        process(time: f64, process: usize, running: bool);
        moved(time: f64, from: u32, to: u32, fraction: f64);
    }

    fn stops(&self) -> bool {
        self.0.stops() || self.1.stops()
    }
}

impl Listener for Tee<'_> {
    fn wanted(&self, step: StepId) -> Vec<NodeId> {
        let mut wanted = self.0.wanted(step);
        wanted.extend(self.1.wanted(step));
        wanted
    }

    fn asked(&mut self, time: f64) -> Vec<Asked> {
        let mut asked = self.0.asked(time);
        asked.extend(self.1.asked(time));
        asked
    }

    fn given_up(&mut self) -> Vec<StepId> {
        let mut given_up = self.0.given_up();
        given_up.extend(self.1.given_up());
        given_up
    }

    fn foreseen(&mut self, engine: &Engine<'_>, step: StepId, operation: &Operation) -> Option<Alarm> {
        self.0.foreseen(engine, step, operation).or_else(|| self.1.foreseen(engine, step, operation))
    }

    fn alarm(&mut self) -> Option<Alarm> {
        self.0.alarm().or_else(|| self.1.alarm())
    }

    fn begins(&mut self, time: f64, step: StepId, values: &[Option<f64>]) {
        let (first, second) = values.split_at(self.0.wanted(step).len().min(values.len()));
        self.0.begins(time, step, first);
        self.1.begins(time, step, second);
    }

    both! {
        step(time: f64, step: StepId, state: StepState);
        travels(moments: &[Moment]);
        sightings(sightings: &[Sighting]);
        burdened(time: f64, item: InstanceId, burden: Burden);
        operation(time: f64, step: StepId, operation: &Operation, state: OperationState);
        expectation(result: &ExpectationResult);
        failure(failure: &FailureTrace);
        assumed(time: f64, step: StepId, condition: &Condition);
        record(time: f64, step: StepId, name: &str, values: &[f64], unit: &Unit);
        reading(time: f64, reading: usize, value: f64);
        looked(number: usize, values: &[f64]);
        ended(engine: &Engine<'_>);
        note(time: f64, step: StepId, text: &str);
        ask(time: f64, step: StepId, text: &str);
    }
}
