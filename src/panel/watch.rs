//! Puts on the board what the executor does.

use std::sync::Arc;

use matterix_ir::plan::{Operation, Plan, StepId};
use matterix_runtime::exec::{ExpectationResult, FailureTrace, Listener, OperationState, StepState, Verdict};
use matterix_runtime::process::{Engine, Observer};

use super::board::{Board, Kind};
use crate::progress::is_shown;

/// A listener that writes on a board.
pub struct Watcher<'p> {
    board: Arc<Board>,
    plan: &'p Plan,
}

impl<'p> Watcher<'p> {
    /// Of the steps of a plan.
    pub fn new(board: Arc<Board>, plan: &'p Plan) -> Self {
        Watcher { board, plan }
    }
}

impl Observer for Watcher<'_> {
    fn sample(&mut self, time: f64, _: &Engine<'_>, _: &[u32]) {
        self.board.reached(time);
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Watcher<'_> {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        let entry = self.plan.get(step);
        if !is_shown(&entry.step) {
            return;
        }
        match state {
            StepState::Running => self.board.begun(step.0, time, &entry.label),
            _ => self.board.over(step.0),
        }
    }

    fn operation(&mut self, _: f64, _: StepId, _: &Operation, _: OperationState) {}

    fn expectation(&mut self, result: &ExpectationResult) {
        let (kind, verdict) = match result.verdict {
            Verdict::Passed => (Kind::Plain, "met"),
            Verdict::Failed => (Kind::Wrong, "not met"),
            Verdict::NotObserved => (Kind::Plain, "not observed"),
        };
        self.board.log(result.time, kind, format!("expect {}: {verdict}", result.text));
    }

    fn failure(&mut self, failure: &FailureTrace) {
        self.board.log(failure.time, Kind::Wrong, failure.text.clone());
    }

    fn note(&mut self, time: f64, _: StepId, text: &str) {
        self.board.log(time, Kind::Plain, text.to_owned());
    }
}
