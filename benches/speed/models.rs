//! What is run: a recording of a program, and Robertson's problem.

use std::fs;
use std::path::Path;

use matterix_ir::model::{Derivative, Domain, Model, State};
use matterix_ir::plan::StepId;
use matterix_ir::{BinaryOp, NodeId, Op, Program, Sources, Span, Unit};
use matterix_runtime::exec::{Listener, StepState};
use matterix_runtime::process::{Engine, Observer};
use matterix_runtime::record::{self, Outputs, Recording, Report, Run, RunInfo, Sampler};
use matterix_runtime::run::RunOptions;

/// A run with all its samples.
pub struct Recorded {
    recording: Recording,
    info: RunInfo,
    sources: Sources,
}

impl Recorded {
    /// Runs a program.
    pub fn new(program: &Program) -> Self {
        let mut follower = Follower(Recording::new(program), Sampler::new(&program.model));
        let outcome = matterix_runtime::run::run(program, &RunOptions::default(), &mut follower);
        follower.0.reach(outcome.end_time);
        Recorded { recording: follower.0, info: RunInfo::default(), sources: Sources::default() }
    }

    /// Writes the plot.
    pub fn plot(&self, program: &Program) {
        self.write(program, Outputs { recording: false, tables: false, csv: false, plot: true });
    }

    /// Writes all but the plot.
    pub fn tables(&self, program: &Program) {
        self.write(program, Outputs { recording: true, tables: true, csv: false, plot: false });
    }

    fn write(&self, program: &Program, outputs: Outputs) {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed/parts");
        fs::create_dir_all(&dir).unwrap();
        let run = Run { program, recording: &self.recording, sources: &self.sources, info: &self.info };
        record::write_all(&dir, &run, &Report::new(&run), outputs).unwrap();
    }
}

/// Keeps what the command keeps of a run without failures.
struct Follower(Recording, Sampler);

impl Observer for Follower {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]) {
        self.1.sample(&mut self.0, time, engine, changed);
    }

    fn begun(&mut self, time: f64, engine: &Engine<'_>) {
        self.1.begin(&mut self.0, time, engine);
    }

    fn event(&mut self, time: f64, event: usize) {
        self.0.event(time, event);
    }

    fn process(&mut self, time: f64, process: usize, running: bool) {
        self.0.process(time, process, running);
    }
}

impl Listener for Follower {
    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        self.0.step(time, step, state);
    }
}

/// Three reactions whose rates differ by nine orders of magnitude (Robertson 1966; test set of Hairer and Wanner).
pub fn robertson() -> Model {
    let mut model = Model::default();
    for (name, initial, scale) in [("y1", 1.0, 1e-6), ("y2", 0.0, 1e-10), ("y3", 0.0, 1.0)] {
        let initial = model.graph.number(initial);
        let domain = Domain::Quantity(Unit::one());
        model.states.push(State { name: name.into(), domain, initial, scale: Some(scale), span: Span::default() });
    }
    let graph = &mut model.graph;
    let [x, y, z]: [NodeId; 3] = std::array::from_fn(|i| graph.add(Op::State(i as u32)));
    let mut times = |factor: f64, a: NodeId| {
        let factor = graph.number(factor);
        graph.binary(BinaryOp::Mul, factor, a)
    };
    let slow = times(0.04, x);
    let back = times(1e4, y);
    let fast = times(3e7, y);
    let back = graph.binary(BinaryOp::Mul, back, z);
    let fast = graph.binary(BinaryOp::Mul, fast, y);
    let first = graph.binary(BinaryOp::Sub, back, slow);
    let gain = graph.binary(BinaryOp::Sub, slow, back);
    let second = graph.binary(BinaryOp::Sub, gain, fast);
    for (state, rate) in [(0, first), (1, second), (2, fast)] {
        model.derivatives.push(Derivative::new(state, rate));
    }
    model
}
