//! Small programs by hand, and a listener that keeps what it is told.

use std::sync::Arc;

use matterix_ir::model::{Action, Derivative, Domain, Reading, State};
use matterix_ir::plan::{Caught, Comparison, Condition, Local, Operation, Plan, PlanStep, Step, StepId, Takes};
use matterix_ir::program::PROGRAM_VERSION;
use matterix_ir::scene::{Instance, InstanceId, Pose, Scene};
use matterix_ir::{BinaryOp, FileId, NodeId, Op, Program, Span, Unit};
use matterix_runtime::exec::{FailureTrace, Listener, OperationState, RunStatus, StepState};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::run::{Fidelity, Outcome, RunOptions, run};

/// A program under construction.
pub struct Lab {
    pub program: Program,
}

pub fn unit() -> Unit {
    Unit::one()
}

impl Lab {
    pub fn new() -> Self {
        let plan = Plan {
            workflow: "test".into(),
            arguments: Vec::new(),
            steps: Vec::new(),
            root: StepId(0),
            locals: Vec::new(),
            limits: Vec::new(),
            ends: Vec::new(),
        };
        let program = Program {
            version: PROGRAM_VERSION,
            files: vec!["test.mtx".into()],
            scene: Scene::default(),
            model: Default::default(),
            plan,
            inventory: Default::default(),
            drivers: Vec::new(),
            offers: Default::default(),
        };
        Lab { program }
    }

    pub fn instance(&mut self, name: &str) -> InstanceId {
        self.program.scene.instances.push(Instance {
            name: name.into(),
            kind: "Thing".into(),
            capabilities: Vec::new(),
            owner: None,
            link: None,
            support: None,
            pose: Pose::default(),
            placed: true,
            at: None,
            frames: Vec::new(),
            shape: None,
            solids: Vec::new(),
            collision: Vec::new(),
            visual: None,
            inertial: None,
            friction: None,
            force: None,
            stopover: false,
            room: None,
            articulation: None,
            span: Span::default(),
        });
        InstanceId(self.program.scene.instances.len() as u32 - 1)
    }

    pub fn number(&mut self, value: f64) -> NodeId {
        self.program.model.graph.number(value)
    }

    /// A state that changes by actions only.
    pub fn state(&mut self, name: &str, initial: f64) -> u32 {
        let initial = self.number(initial);
        let domain = Domain::Quantity(unit());
        self.program.model.states.push(State {
            name: name.into(),
            domain,
            initial,
            scale: Some(1.0),
            span: Span::default(),
        });
        self.program.model.states.len() as u32 - 1
    }

    /// A state that grows at 1/s while `on` is not 0.
    pub fn ramp(&mut self, name: &str, on: u32) -> u32 {
        let state = self.state(name, 0.0);
        let on = self.get(on);
        let (one, zero) = (self.number(1.0), self.number(0.0));
        let rate = self.program.model.graph.select(on, one, zero);
        self.program.model.derivatives.push(Derivative::new(state, rate));
        state
    }

    pub fn get(&mut self, state: u32) -> NodeId {
        self.program.model.graph.add(Op::State(state))
    }

    pub fn time(&mut self) -> NodeId {
        self.program.model.graph.add(Op::Time)
    }

    pub fn local(&mut self, name: &str) -> u32 {
        self.program.plan.locals.push(Local { name: name.into(), unit: unit() });
        self.program.plan.locals.len() as u32 - 1
    }

    pub fn reading(&mut self, name: &str, value: NodeId, noise: Option<f64>, period: Option<f64>) -> NodeId {
        self.program.model.readings.push(Reading {
            name: name.into(),
            instance: InstanceId(0),
            value,
            resolution: None,
            noise,
            period,
            unit: unit(),
            span: Span::default(),
        });
        let index = self.program.model.readings.len() as u32 - 1;
        self.program.model.graph.add(Op::Reading(index))
    }

    pub fn at_least(&mut self, a: NodeId, limit: f64) -> Condition {
        let limit = self.number(limit);
        let node = self.program.model.graph.binary(BinaryOp::Le, limit, a);
        self.condition(node, "a >= limit", Some((a, limit)))
    }

    pub fn below(&mut self, a: NodeId, limit: f64) -> Condition {
        let limit = self.number(limit);
        let node = self.program.model.graph.binary(BinaryOp::Lt, a, limit);
        self.condition(node, "a < limit", Some((a, limit)))
    }

    pub fn constant(&mut self, holds: bool) -> Condition {
        let node = self.number(f64::from(u8::from(holds)));
        self.condition(node, if holds { "true" } else { "false" }, None)
    }

    pub fn condition(&mut self, node: NodeId, text: &str, compared: Option<(NodeId, NodeId)>) -> Condition {
        let comparison = |(value, low)| Comparison {
            text: "a".into(),
            value,
            low: Some(low),
            high: None,
            strict: true,
            unit: unit(),
        };
        let compared = compared.into_iter().map(comparison).collect();
        Condition {
            node,
            text: text.into(),
            span: Span::new(FileId(0), 9000, 9005),
            compared,
            terms: Vec::new(),
            refusal: None,
            each: Vec::new(),
        }
    }

    pub fn step(&mut self, step: Step) -> StepId {
        let index = self.program.plan.steps.len();
        let label = match &step {
            Step::Operation(operation) => operation.verb.clone(),
            Step::Note(text) => text.show(|_| Ok::<_, ()>(None), |_| String::new()).unwrap_or_default(),
            Step::Claim { .. } => format!("claim {index}"),
            other => format!("{other:?}").chars().take_while(|c| c.is_alphabetic()).collect(),
        };
        let span = Span::new(FileId(0), index * 10, index * 10 + 5);
        self.program.plan.steps.push(PlanStep { label, span, step });
        StepId(index as u32)
    }

    pub fn note(&mut self, text: &str) -> StepId {
        self.step(Step::Note(text.into()))
    }

    pub fn fail(&mut self, name: &str) -> StepId {
        self.step(Step::Fail { name: name.into(), text: "on purpose".into() })
    }

    pub fn seq(&mut self, list: &[StepId]) -> StepId {
        self.step(Step::Sequence(list.to_vec()))
    }

    pub fn par(&mut self, list: &[StepId]) -> StepId {
        self.step(Step::Parallel(list.to_vec()))
    }

    pub fn wait(&mut self, duration: f64) -> StepId {
        let duration = self.number(duration);
        self.step(Step::Wait { duration })
    }

    pub fn wait_until(&mut self, condition: Condition, timeout: Option<f64>) -> StepId {
        let timeout = timeout.map(|t| self.number(t));
        self.step(Step::WaitUntil { condition, timeout })
    }

    pub fn guarded(&mut self, body: StepId, handlers: &[(&str, StepId)], finally: Option<StepId>) -> StepId {
        let caught = |name: &str| if name == "any" { Caught::Any } else { Caught::Named(name.into()) };
        let handlers = handlers.iter().map(|(name, step)| (caught(name), *step)).collect();
        self.step(Step::Guarded { body, handlers, finally })
    }

    pub fn retry(&mut self, times: f64) -> StepId {
        let times = self.number(times);
        self.step(Step::Retry { times })
    }

    pub fn repeat(&mut self, times: f64, body: StepId) -> StepId {
        let times = self.number(times);
        self.step(Step::Repeat { times, body })
    }

    pub fn skill(&mut self, needs: &[Condition], promises: &[Condition], body: StepId) -> StepId {
        let (needs, promises) = (needs.iter().cloned().map(Arc::new).collect(), promises.to_vec());
        self.step(Step::Skill { verb: "do".into(), needs, invariants: Vec::new(), promises, takes: None, body })
    }

    pub fn claim(&mut self, claims: &[InstanceId], body: StepId) -> StepId {
        self.step(Step::Claim { claims: claims.to_vec(), body })
    }

    pub fn start(&mut self, job: &str, body: StepId) -> StepId {
        self.step(Step::Start { job: job.into(), body })
    }

    pub fn await_job(&mut self, job: &str) -> StepId {
        self.step(Step::Await { job: job.into() })
    }

    pub fn keep(&mut self, condition: Condition, body: StepId) -> StepId {
        self.step(Step::Keep { condition, body })
    }

    pub fn hold(&mut self, condition: Condition, duration: f64, timeout: Option<f64>) -> StepId {
        let duration = self.number(duration);
        let timeout = timeout.map(|t| self.number(t));
        self.step(Step::Hold { condition, duration, timeout })
    }

    pub fn operation(&mut self, verb: &str) -> Operation {
        Operation { verb: verb.into(), ..Operation::default() }
    }

    pub fn op(&mut self, operation: Operation) -> StepId {
        self.step(Step::Operation(Box::new(operation)))
    }

    /// An operation that writes `claims` for `takes` seconds.
    pub fn busy(&mut self, verb: &str, claims: &[InstanceId], takes: f64) -> StepId {
        let nominal = self.number(takes);
        let operation = self.operation(verb);
        let takes = Some(Takes { nominal, bounds: None });
        self.op(Operation { claims: claims.to_vec(), takes, ..operation })
    }

    pub fn assign(&mut self, state: u32, value: f64) -> Action {
        let value = self.number(value);
        Action::Assign { state, value, span: Span::default() }
    }

    /// A command that sets a state at once.
    pub fn set(&mut self, state: u32, value: f64) -> StepId {
        let at_start = vec![self.assign(state, value)];
        let name = self.program.model.states[state as usize].name.clone();
        let operation = self.operation(&format!("set {name} {value}"));
        self.op(Operation { at_start, ..operation })
    }

    /// Runs the plan from `root`.
    pub fn run(&mut self, root: StepId) -> Run {
        self.run_with(root, &RunOptions::default())
    }

    pub fn dry(&mut self, root: StepId) -> Run {
        self.run_with(root, &RunOptions { fidelity: Fidelity::Dry, ..RunOptions::default() })
    }

    pub fn run_with(&mut self, root: StepId, options: &RunOptions<'_>) -> Run {
        self.program.plan.root = root;
        let mut log = Log::default();
        let outcome = run(&self.program, options, &mut log);
        Run { outcome, log }
    }
}

/// What came of a run and what it told.
pub struct Run {
    pub outcome: Outcome,
    pub log: Log,
}

impl Run {
    pub fn passed(self) -> Self {
        assert_eq!(self.outcome.status, RunStatus::Passed, "{:#?}", self.outcome.failure);
        self
    }

    /// What ended the run.
    pub fn failure(&self) -> &FailureTrace {
        self.outcome.failure.as_ref().expect("the run failed")
    }

    /// The name of the failure that ended the run.
    pub fn failed(&self) -> &str {
        assert_eq!(self.outcome.status, RunStatus::Failed);
        &self.failure().name
    }

    pub fn fault(&self) -> &FailureTrace {
        assert_eq!(self.outcome.status, RunStatus::Fault);
        self.failure()
    }

    /// `note@time` of every note, in order.
    pub fn notes(&self) -> String {
        let notes = self.log.notes.iter().map(|(t, n)| format!("{n}@{}", (t * 1e3).round() / 1e3));
        notes.collect::<Vec<_>>().join(" ")
    }

    pub fn state(&self, state: u32) -> f64 {
        self.outcome.states[state as usize].unwrap_or(f64::NAN)
    }

    pub fn step(&self, step: StepId) -> StepState {
        self.outcome.steps[step.0 as usize].state
    }
}

/// Keeps what it is told.
#[derive(Default)]
pub struct Log {
    pub notes: Vec<(f64, String)>,
    pub steps: Vec<(f64, StepId, StepState)>,
    pub operations: Vec<(f64, String, OperationState)>,
    pub records: Vec<(f64, String, Vec<f64>)>,
    pub failures: Vec<FailureTrace>,
    pub readings: Vec<(f64, usize, f64)>,
    pub samples: usize,
}

impl Observer for Log {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {
        self.samples += 1;
    }
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Log {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.steps.push((time, step, state));
    }
    fn operation(&mut self, time: f64, _: StepId, operation: &Operation, state: OperationState) {
        self.operations.push((time, operation.verb.clone(), state));
    }
    fn failure(&mut self, failure: &FailureTrace) {
        self.failures.push(failure.clone());
    }
    fn record(&mut self, time: f64, _: StepId, name: &str, values: &[f64], _: &Unit) {
        self.records.push((time, name.into(), values.to_vec()));
    }
    fn reading(&mut self, time: f64, reading: usize, value: f64) {
        self.readings.push((time, reading, value));
    }
    fn note(&mut self, time: f64, _: StepId, text: &str) {
        self.notes.push((time, text.into()));
    }
}
