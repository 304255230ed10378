//! Random plans: no run hangs or panics, and what is entered is left properly.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Program, Unit};
use matterix_runtime::backend::Prepared;
use matterix_runtime::exec::{Execution, ExpectationResult, FailureTrace, Limits, Listener, OperationState, StepState};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::record::{Recording, Sampler};
use matterix_runtime::run::{Fidelity, Outcome, RunOptions, Underway, run};
use proptest::prelude::*;

use crate::exec_build::{Lab, unit};

#[derive(Clone, Debug)]
enum Tree {
    Wait(u8),
    WaitUntil(u8, Option<u8>),
    Busy(u8, u8),
    Pump(u8),
    Fail(u8),
    Retry(u8),
    Await(u8),
    Hold(u8, u8),
    Bad,
    Sequence(Vec<Tree>),
    Parallel(Vec<Tree>),
    Try(Vec<Tree>),
    Guarded(Box<Tree>, Vec<(u8, Tree)>, Option<Box<Tree>>),
    Keep(u8, Box<Tree>),
    Skill(u8, u8, Box<Tree>),
    Repeat(u8, Box<Tree>),
    While(u8, Box<Tree>),
    If(u8, Box<Tree>, Box<Tree>),
    Claim(u8, Box<Tree>),
    Start(u8, Box<Tree>),
    Named(Box<Tree>),
    Within(u8, Box<Tree>),
    Invariant(u8, Box<Tree>),
    Record(u8),
    Expect(u8),
}

fn tree() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        4 => (0u8..6).prop_map(Tree::Wait),
        3 => (any::<u8>(), proptest::option::of(0u8..9)).prop_map(|(c, t)| Tree::WaitUntil(c, t)),
        4 => (0u8..8, 0u8..4).prop_map(|(c, t)| Tree::Busy(c, t)),
        1 => any::<u8>().prop_map(Tree::Pump),
        2 => (0u8..3).prop_map(Tree::Fail),
        2 => (0u8..3).prop_map(Tree::Retry),
        1 => (0u8..3).prop_map(Tree::Await),
        1 => (any::<u8>(), 0u8..5).prop_map(|(c, d)| Tree::Hold(c, d)),
        1 => (1u8..9).prop_map(Tree::Record),
        1 => any::<u8>().prop_map(Tree::Expect),
        1 => Just(Tree::Bad),
    ];
    leaf.prop_recursive(6, 60, 4, |inner| {
        let boxed = || inner.clone().prop_map(Box::new);
        let list = || prop::collection::vec(inner.clone(), 0..4);
        prop_oneof![
            3 => list().prop_map(Tree::Sequence),
            3 => list().prop_map(Tree::Parallel),
            1 => list().prop_map(Tree::Try),
            4 => (boxed(), prop::collection::vec((0u8..4, inner.clone()), 0..3), proptest::option::of(boxed()))
                .prop_map(|(b, h, f)| Tree::Guarded(b, h, f)),
            1 => (any::<u8>(), boxed()).prop_map(|(c, b)| Tree::Keep(c, b)),
            1 => (any::<u8>(), any::<u8>(), boxed()).prop_map(|(n, p, b)| Tree::Skill(n, p, b)),
            1 => (0u8..4, boxed()).prop_map(|(n, b)| Tree::Repeat(n, b)),
            1 => (any::<u8>(), boxed()).prop_map(|(c, b)| Tree::While(c, b)),
            1 => (any::<u8>(), boxed(), boxed()).prop_map(|(c, a, b)| Tree::If(c, a, b)),
            2 => (0u8..8, boxed()).prop_map(|(c, b)| Tree::Claim(c, b)),
            1 => (0u8..3, boxed()).prop_map(|(j, b)| Tree::Start(j, b)),
            1 => boxed().prop_map(Tree::Named),
            1 => (0u8..9, boxed()).prop_map(|(l, b)| Tree::Within(l, b)),
            1 => (any::<u8>(), boxed()).prop_map(|(c, b)| Tree::Invariant(c, b)),
        ]
    })
}

/// Builds the plan of a tree in a lab with a ramp, two readings and three instances.
struct Builder {
    lab: Lab,
    on: u32,
    x: u32,
}

impl Builder {
    fn new() -> Self {
        let mut lab = Lab::new();
        for name in ["a", "b", "c"] {
            lab.instance(name);
        }
        let on = lab.state("on", 1.0);
        let x = lab.ramp("x", on);
        let value = lab.get(x);
        lab.reading("slow", value, Some(0.5), Some(0.7));
        lab.reading("fast", value, Some(0.5), None);
        Builder { lab, on, x }
    }

    fn instances(set: u8) -> Vec<InstanceId> {
        (0..3).filter(|i| set & (1 << i) != 0).map(InstanceId).collect()
    }

    fn condition(&mut self, code: u8) -> matterix_ir::plan::Condition {
        let limit = f64::from(code / 16);
        let graph = &mut self.lab.program.model.graph;
        let node = match code % 4 {
            0 => graph.add(matterix_ir::Op::State(self.x)),
            1 => graph.add(matterix_ir::Op::Time),
            n => graph.add(matterix_ir::Op::Reading(u32::from(n) - 2)),
        };
        match code / 4 % 4 {
            0 => self.lab.constant(code >= 128),
            1 => self.lab.below(node, limit),
            _ => self.lab.at_least(node, limit),
        }
    }

    fn list(&mut self, list: &[Tree]) -> Vec<StepId> {
        list.iter().map(|t| self.build(t)).collect()
    }

    fn build(&mut self, tree: &Tree) -> StepId {
        let step = match tree {
            Tree::Wait(t) => return self.lab.wait(f64::from(*t)),
            Tree::Bad => return self.lab.wait(-1.0),
            Tree::WaitUntil(c, t) => {
                let condition = self.condition(*c);
                return self.lab.wait_until(condition, t.map(f64::from));
            }
            Tree::Hold(c, d) => {
                let condition = self.condition(*c);
                return self.lab.hold(condition, f64::from(*d), Some(6.0));
            }
            Tree::Busy(set, t) => return self.lab.busy("work", &Self::instances(*set), f64::from(*t)),
            Tree::Pump(c) => {
                let until = Some(self.condition(*c));
                let at_start = vec![self.lab.assign(self.x, 0.0)];
                let at_end = vec![self.lab.assign(self.on, 1.0)];
                let operation = self.lab.operation("pump");
                return self.lab.op(Operation { until, at_start, at_end, ..operation });
            }
            Tree::Fail(n) => return self.lab.fail(&format!("f{n}")),
            Tree::Retry(n) => return self.lab.retry(f64::from(*n)),
            Tree::Await(n) => Step::Await { job: format!("j{n}") },
            Tree::Sequence(list) => Step::Sequence(self.list(list)),
            Tree::Parallel(list) => Step::Parallel(self.list(list)),
            Tree::Try(list) => Step::Try(self.list(list)),
            Tree::Guarded(body, handlers, finally) => {
                let body = self.build(body);
                let names = ["f0", "f1", "timeout", "any"];
                let handlers: Vec<_> = handlers.iter().map(|(n, t)| (names[*n as usize], self.build(t))).collect();
                let finally = finally.as_ref().map(|t| self.build(t));
                return self.lab.guarded(body, &handlers, finally);
            }
            Tree::Keep(c, body) => Step::Keep { condition: self.condition(*c), body: self.build(body) },
            Tree::Skill(n, p, body) => {
                let (needs, promises) = (self.condition(*n), self.condition(*p));
                let body = self.build(body);
                return self.lab.skill(&[needs], &[promises], body);
            }
            Tree::Repeat(n, body) => {
                let body = self.build(body);
                return self.lab.repeat(f64::from(*n), body);
            }
            Tree::While(c, body) => {
                let (condition, max) = (self.condition(*c), self.lab.number(3.0));
                Step::RepeatWhile { condition, max, body: self.build(body) }
            }
            Tree::If(c, then, otherwise) => Step::If {
                condition: self.condition(*c),
                then: self.build(then),
                otherwise: Some(self.build(otherwise)),
            },
            Tree::Claim(set, body) => Step::Claim { claims: Self::instances(*set), body: self.build(body) },
            Tree::Start(n, body) => Step::Start { job: format!("j{n}"), body: self.build(body) },
            Tree::Within(limit, body) => {
                let (limit, since) = (self.lab.number(f64::from(*limit)), self.lab.number(0.0));
                Step::Within { limit, since, body: self.build(body) }
            }
            Tree::Invariant(c, body) => Step::Skill {
                verb: "watch".into(),
                needs: Vec::new(),
                invariants: vec![self.condition(*c), self.condition(c.wrapping_add(97))],
                promises: Vec::new(),
                takes: None,
                body: self.build(body),
            },
            Tree::Record(every) => {
                let (value, every) = (self.lab.get(self.x), self.lab.number(f64::from(*every) / 3.0));
                Step::Record { name: "x".into(), value: vec![value], unit: unit(), every }
            }
            Tree::Expect(c) => Step::Expect(vec![self.condition(*c)]),
            Tree::Named(body) => {
                let (start, end) = (self.lab.local("s"), self.lab.local("e"));
                Step::Named { name: "n".into(), start, end, body: self.build(body) }
            }
        };
        self.lab.step(step)
    }
}

/// Cancels at a given change of a step's state.
struct CancelAt<'c> {
    cancel: &'c AtomicBool,
    left: AtomicUsize,
    trace: Vec<(u64, u32, StepState)>,
    /// Instances that running operations use.
    used: Vec<InstanceId>,
    /// Whether two operations used one instance at a time.
    overlap: bool,
}

impl Observer for CancelAt<'_> {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for CancelAt<'_> {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.trace.push((time.to_bits(), step.0, state));
        if self.left.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.cancel.store(true, Ordering::Relaxed);
        }
    }

    fn operation(&mut self, _: f64, _: StepId, operation: &Operation, state: OperationState) {
        for instance in &operation.claims {
            let at = self.used.iter().position(|i| i == instance);
            match (state, at) {
                (OperationState::Started, None) => self.used.push(*instance),
                (OperationState::Started, Some(_)) | (_, None) => self.overlap = true,
                (_, Some(at)) => drop(self.used.remove(at)),
            }
        }
    }
}

fn go(lab: &Lab, fidelity: Fidelity, cancel_at: usize) -> (Outcome, CancelAt<'static>) {
    let cancel: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
    let limits = Limits { horizon: 500.0, steps_per_instant: 5_000, cancel: Some(cancel), ..Limits::default() };
    let options = RunOptions { seed: 3, fidelity, limits, ..RunOptions::default() };
    let mut listener =
        CancelAt { cancel, left: AtomicUsize::new(cancel_at), trace: Vec::new(), used: Vec::new(), overlap: false };
    let outcome = run(&lab.program, &options, &mut listener);
    (outcome, listener)
}

/// Everything that is said in a run, and what of it is recorded.
#[derive(Clone)]
struct Diary {
    said: Vec<String>,
    sampler: Sampler,
    recording: Recording,
}

impl Diary {
    fn of(program: &Program) -> Self {
        Diary { said: Vec::new(), sampler: Sampler::new(&program.model), recording: Recording::new(program) }
    }

    fn says(&mut self, time: f64, what: impl std::fmt::Debug) {
        self.said.push(format!("{:x} {what:?}", time.to_bits()));
    }
}

impl Observer for Diary {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.sampler.sample(&mut self.recording, time, engine, changed);
    }
    fn begun(&mut self, time: f64, engine: &Engine<'_>) {
        self.sampler.begin(&mut self.recording, time, engine);
    }
    fn event(&mut self, time: f64, event: usize) {
        self.says(time, event);
    }
    fn process(&mut self, time: f64, process: usize, running: bool) {
        self.says(time, (process, running));
    }
}

impl Listener for Diary {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.says(time, (step, state));
    }
    fn operation(&mut self, time: f64, step: StepId, _: &Operation, state: OperationState) {
        self.says(time, (step, state));
    }
    fn reading(&mut self, time: f64, reading: usize, value: f64) {
        self.says(time, (reading, value.to_bits()));
    }
    fn record(&mut self, time: f64, step: StepId, _: &str, values: &[f64], _: &Unit) {
        self.says(time, (step, values));
    }
    fn expectation(&mut self, result: &ExpectationResult) {
        self.says(result.time, result);
    }
    fn failure(&mut self, failure: &FailureTrace) {
        self.says(failure.time, failure);
    }
}

/// What a run has come to and said: with the states to the last bit.
fn told(outcome: &Outcome, diary: &Diary) -> (String, Vec<Option<u64>>) {
    let bits = outcome.states.iter().map(|state| state.map(f64::to_bits)).collect();
    let Execution { status, failure, suppressed, steps, end_time, .. } = &outcome.execution;
    (format!("{status:?} {failure:?} {suppressed:?} {steps:?} {end_time:?} {:?}", diary.said), bits)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// A run that pauses anywhere, and one that goes on from a snapshot of it while the first goes another way, are as one that
    /// does neither; the recordings are the same up to the samples that a pause adds.
    #[test]
    fn a_snapshot_of_a_run_goes_on_to_the_last_bit(
        tree in tree(),
        pauses in prop::collection::vec(0.0..30.0_f64, 1..5),
        saved in 0usize..5,
    ) {
        let mut builder = Builder::new();
        builder.lab.program.plan.root = builder.build(&tree);
        let program = &builder.lab.program;
        let limits = Limits { horizon: 500.0, steps_per_instant: 5_000, ..Limits::default() };
        let options = RunOptions { seed: 3, limits, ..RunOptions::default() };
        let mut whole = Diary::of(program);
        let expected = run(program, &options, &mut whole);
        let expected = told(&expected, &whole);

        let prepared = Prepared::new(program);
        let mut diary = Diary::of(program);
        let params = program.model.params.iter().map(|p| p.value).collect();
        let Ok(mut underway) = Underway::begin(program, &prepared, params, &options, &mut diary) else {
            return Err(TestCaseError::fail("it cannot begin"));
        };
        let mut snapshot = (underway.clone(), diary.clone());
        let mut pauses = pauses;
        pauses.sort_by(f64::total_cmp);
        for (number, pause) in pauses.iter().enumerate() {
            underway.go_on(*pause, &mut diary);
            if number == saved % pauses.len() {
                snapshot = (underway.clone(), diary.clone());
            }
        }
        underway.go_on(f64::INFINITY, &mut diary);
        let paused = underway.finish(&mut diary);
        prop_assert_eq!(&told(&paused, &diary), &expected);

        let (mut again, mut from_there) = snapshot;
        again.go_on(f64::INFINITY, &mut from_there);
        let resumed = again.finish(&mut from_there);
        prop_assert_eq!(&told(&resumed, &from_there), &expected);
        // The rest of the same recording; `pauses` after the snapshot only add samples.
        prop_assert_eq!(&from_there.recording.events, &whole.recording.events);
        if saved % pauses.len() + 1 == pauses.len() {
            prop_assert_eq!(&from_there.recording, &diary.recording);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_plans_end_and_leave_properly(tree in tree(), cancel_at in 1usize..60, dry in any::<bool>()) {
        let mut builder = Builder::new();
        builder.lab.program.plan.root = builder.build(&tree);
        let lab = builder.lab;
        let fidelity = if dry { Fidelity::Dry } else { Fidelity::Process };
        let (outcome, told) = go(&lab, fidelity, cancel_at);
        for (step, record) in lab.program.plan.steps.iter().zip(&outcome.steps) {
            prop_assert!(!matches!(record.state, StepState::Pending | StepState::Running), "{step:?}");
            if let Step::Guarded { finally: Some(finally), .. } = &step.step {
                prop_assert_eq!(record.runs, outcome.steps[finally.0 as usize].runs);
            }
        }
        let (again, same) = go(&lab, fidelity, cancel_at);
        prop_assert_eq!(outcome.status, again.status);
        prop_assert_eq!(told.trace, same.trace);
        prop_assert!(!told.overlap && told.used.is_empty());
    }
}
