//! Cancellation, faults and endless waits: what runs still runs to its end safely.

use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::{Op, Unit};
use matterix_runtime::exec::{Limits, Listener, OperationState, RunStatus, StepState};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::run::{RunOptions, run};

use crate::exec_build::Lab;

/// A heater that is on until a `finally` turns it off; `body` is what happens in between.
fn heating(lab: &mut Lab, body: StepId) -> (u32, StepId) {
    let heater = lab.state("heater", 0.0);
    let (on, off) = (lab.set(heater, 1.0), lab.set(heater, 0.0));
    let body = lab.seq(&[on, body]);
    (heater, lab.guarded(body, &[], Some(off)))
}

#[test]
fn the_heater_is_off_after_a_failure_and_after_a_timeout() {
    let mut lab = Lab::new();
    let fail = lab.fail("slip");
    let (heater, root) = heating(&mut lab, fail);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.state(heater)), ("slip", 0.0));
    let never = lab.constant(false);
    let wait = lab.wait_until(never, Some(60.0));
    let (heater, root) = heating(&mut lab, wait);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.state(heater)), ("timeout", 0.0));
}

/// Cancels when a note is made.
struct Canceller<'c> {
    cancel: &'c AtomicBool,
    operations: Vec<(f64, OperationState)>,
}

impl Observer for Canceller<'_> {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Canceller<'_> {
    fn note(&mut self, _: f64, _: StepId, _: &str) {
        self.cancel.store(true, Ordering::Relaxed);
    }
    fn operation(&mut self, time: f64, _: StepId, _: &Operation, state: OperationState) {
        self.operations.push((time, state));
    }
}

#[test]
fn cancelling_halts_operations_and_runs_every_finally() {
    let mut lab = Lab::new();
    let (pause, note) = (lab.wait(3.0), lab.note("cancel"));
    let (long, endless) = (lab.busy("ramp", &[], 100.0), lab.wait(1000.0));
    let canceller = lab.seq(&[pause, note, endless]);
    let body = lab.par(&[long, canceller]);
    let (heater, inner) = heating(&mut lab, body);
    let (caught, cool) = (lab.wait(1.0), lab.wait(7.0));
    let inner = lab.guarded(inner, &[("any", caught)], None);
    let root = lab.guarded(inner, &[], Some(cool));
    lab.program.plan.root = root;
    let cancel = AtomicBool::new(false);
    let limits = Limits { cancel: Some(&cancel), ..Limits::default() };
    let mut listener = Canceller { cancel: &cancel, operations: Vec::new() };
    let outcome = run(&lab.program, &RunOptions { limits, ..RunOptions::default() }, &mut listener);
    assert_eq!(outcome.status, RunStatus::Cancelled);
    assert_eq!(outcome.states[heater as usize], Some(0.0));
    assert_eq!(outcome.end_time, 10.0);
    assert!(listener.operations.contains(&(3.0, OperationState::Halted)));
    assert_eq!(outcome.steps[caught.0 as usize].state, StepState::Skipped);
    assert_eq!(outcome.steps[cool.0 as usize].state, StepState::Done);
}

#[test]
fn cancelling_before_the_start_runs_nothing_beyond_the_first_instant() {
    let mut lab = Lab::new();
    let long = lab.wait(1000.0);
    let (heater, root) = heating(&mut lab, long);
    let cancel = AtomicBool::new(true);
    let limits = Limits { cancel: Some(&cancel), ..Limits::default() };
    let run = lab.run_with(root, &RunOptions { limits, ..RunOptions::default() });
    assert_eq!((run.outcome.status, run.outcome.end_time), (RunStatus::Cancelled, 0.0));
    assert_eq!(run.state(heater), 0.0);
}

#[test]
fn a_fault_of_the_engine_still_turns_the_heater_off() {
    let mut lab = Lab::new();
    // x' = x^2 from 1 is infinite at 1 s.
    let x = lab.state("x", 1.0);
    let value = lab.get(x);
    let rate = lab.program.model.graph.binary(matterix_ir::BinaryOp::Mul, value, value);
    lab.program.model.derivatives.push(matterix_ir::model::Derivative::new(x, rate));
    let long = lab.wait(10.0);
    let (heater, inner) = heating(&mut lab, long);
    let (caught, cool, last) = (lab.note("caught"), lab.wait(5.0), lab.note("last"));
    let inner = lab.guarded(inner, &[("any", caught)], Some(cool));
    let root = lab.guarded(inner, &[], Some(last));
    let run = lab.run(root);
    run.fault();
    assert_eq!(run.state(heater), 0.0);
    assert_eq!(run.log.notes.len(), 1);
    assert_eq!(run.log.notes[0].1, "last");
    // The `finally` that needs time cannot have it.
    assert_eq!(run.step(cool), StepState::Skipped);
    assert!(!run.outcome.suppressed.is_empty());
}

#[test]
fn an_unusable_number_is_a_fault_at_its_step() {
    let mut lab = Lab::new();
    let bad = lab.wait(-1.0);
    let (heater, root) = heating(&mut lab, bad);
    let run = lab.run(root);
    assert_eq!(run.fault().code.name, "unusable-number");
    assert_eq!(run.fault().span, lab.program.plan.get(bad).span);
    assert_eq!(run.state(heater), 0.0);
}

#[test]
fn waiting_for_ever_is_a_fault_at_the_condition() {
    let mut lab = Lab::new();
    let x = lab.state("x", 0.0);
    let value = lab.get(x);
    let never = lab.at_least(value, 1.0);
    let wait = lab.wait_until(never.clone(), None);
    // Its `finally` waits for ever, too; the outer one must not suffer from that.
    let again = lab.wait_until(never, None);
    let stuck = lab.guarded(wait, &[], Some(again));
    let (heater, root) = heating(&mut lab, stuck);
    let run = lab.run(root);
    let fault = run.fault();
    assert_eq!(fault.code.name, "waits-for-ever");
    assert_eq!(fault.text, "the run still waits for `a >= limit` after 30 days of lab time");
    assert_eq!(fault.span.start, 9000);
    assert_eq!(run.state(heater), 0.0);
    assert_eq!(run.outcome.suppressed[0].code.name, "waits-for-ever");
}

#[test]
fn steps_without_time_are_bounded() {
    let mut lab = Lab::new();
    let yes = lab.constant(true);
    let max = lab.number(1e15);
    let body = lab.note("n");
    let endless = lab.step(Step::RepeatWhile { condition: yes, max, body });
    let (heater, root) = heating(&mut lab, endless);
    let limits = Limits { steps_per_instant: 1000, ..Limits::default() };
    let run = lab.run_with(root, &RunOptions { limits, ..RunOptions::default() });
    assert_eq!(run.fault().code.name, "endless-instant");
    assert_eq!(run.state(heater), 0.0);
}

#[test]
fn a_fault_in_a_finally_leaves_the_outer_one_alone() {
    let mut lab = Lab::new();
    let (fail, bad) = (lab.fail("slip"), lab.wait(f64::NAN));
    let inner = lab.guarded(fail, &[], Some(bad));
    let (heater, root) = heating(&mut lab, inner);
    let run = lab.run(root);
    assert_eq!(run.fault().code.name, "unusable-number");
    assert_eq!(run.state(heater), 0.0);
}

#[test]
fn unknown_parameters_are_refused() {
    let mut lab = Lab::new();
    let root = lab.note("n");
    let options = RunOptions { params: vec![("target".into(), 300.0)], ..RunOptions::default() };
    assert_eq!(lab.run_with(root, &options).fault().code.name, "unknown-parameter");
    lab.program.model.params.push(matterix_ir::model::Param {
        name: "target".into(),
        value: 1.0,
        unit: Unit::one(),
        span: Default::default(),
    });
    let duration = lab.program.model.graph.add(Op::Param(0));
    let root = lab.step(Step::Wait { duration });
    assert_eq!(lab.run_with(root, &options).passed().outcome.end_time, 300.0);
}
