//! A trial run on the digital twin: how long things take of which only the model can tell.

use matterix_ir::Program;
use matterix_ir::plan::{Step, StepId};

use crate::exec::{FailureTrace, Listener, RunStatus, StepState};
use crate::process::{Engine, Observer};
use crate::run::{RunOptions, run};

/// One time a step was done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Occurrence {
    /// Place in the order of all beginnings and ends.
    pub began: u64,
    pub ended: u64,
    since: f64,
    /// s.
    pub lasted: f64,
}

/// What was done in a trial run.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    steps: Vec<Vec<Occurrence>>,
    count: u64,
}

impl Trace {
    /// The times a step was done, in order.
    pub fn occurrences(&self, step: StepId) -> &[Occurrence] {
        self.steps.get(step.0 as usize).map_or(&[], Vec::as_slice)
    }
}

impl Observer for Trace {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Trace {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.count += 1;
        let Some(all) = self.steps.get_mut(step.0 as usize) else { return };
        match state {
            StepState::Running => {
                all.push(Occurrence { began: self.count, ended: u64::MAX, since: time, lasted: 0.0 });
            }
            _ => {
                if let Some(last) = all.last_mut().filter(|o| o.ended == u64::MAX) {
                    last.ended = self.count;
                    last.lasted = time - last.since;
                }
            }
        }
    }
}

/// Runs a program without its windows: it takes turns as they come, and may miss what a schedule will keep.
pub(super) fn trial(program: &Program, options: &RunOptions<'_>) -> Result<Trace, Option<Box<FailureTrace>>> {
    let mut free = program.clone();
    for node in &mut free.plan.steps {
        if let Step::Within { body, .. } = &node.step {
            node.step = Step::Sequence(vec![*body]);
        }
    }
    let mut trace = Trace { steps: vec![Vec::new(); program.plan.steps.len()], count: 0 };
    let outcome = run(&free, options, &mut trace);
    match outcome.status {
        RunStatus::Passed | RunStatus::ExpectationFailed => Ok(trace),
        _ => Err(outcome.execution.failure.map(Box::new)),
    }
}
