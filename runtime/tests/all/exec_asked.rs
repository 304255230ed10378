//! What is asked for from outside is done beside the plan, whatever becomes of it.

use matterix_ir::plan::{Operation, StepId};
use matterix_ir::{NodeId, Op};
use matterix_runtime::backend::{Backend, Prepared, Sim};
use matterix_runtime::exec::{Asked, FailureTrace, Limits, Listener, RunStatus, StepState, execute};
use matterix_runtime::process::{Engine, Observer, Options};

use crate::exec_build::Lab;

/// Asks for steps as soon as their time has come, and keeps what becomes of them.
struct Asking {
    open: Vec<(f64, Asked)>,
    ends: Vec<(f64, StepId, StepState)>,
    failures: Vec<String>,
}

impl Observer for Asking {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Asking {
    fn asked(&mut self, time: f64) -> Vec<Asked> {
        let (now, later) = std::mem::take(&mut self.open).into_iter().partition(|(at, _)| *at <= time);
        self.open = later;
        now.into_iter().map(|(_, asked)| asked).collect()
    }

    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        if matches!(state, StepState::Done | StepState::Failed) {
            self.ends.push((time, step, state));
        }
    }

    fn failure(&mut self, failure: &FailureTrace) {
        self.failures.push(failure.name.clone());
    }
}

#[test]
fn steps_that_are_asked_for_run_beside_the_plan_and_end_nothing_but_themselves() {
    let mut lab = Lab::new();
    let level = lab.state("level", 0.0);
    let local = lab.local("given");
    let value: NodeId = lab.program.model.graph.add(Op::Local(local));
    let set = lab.operation("set");
    let action = matterix_ir::model::Action::Assign { state: level, value, span: matterix_ir::Span::default() };
    let set = lab.op(Operation { at_start: vec![action], ..set });
    let (fail, slow) = (lab.fail("slip"), lab.wait(5.0));
    let (first, second) = (lab.wait(1.0), lab.wait(9.0));
    let root = lab.seq(&[first, second]);
    lab.program.plan.root = root;
    let asked = |step, locals| Asked { step, locals };
    let unknown = StepId(999);
    let mut asking = Asking {
        open: vec![
            (0.0, asked(slow, Vec::new())),
            (1.0, asked(set, vec![(local, 7.0)])),
            (1.0, asked(fail, Vec::new())),
            (1.0, asked(unknown, Vec::new())),
        ],
        ends: Vec::new(),
        failures: Vec::new(),
    };
    let program = &lab.program;
    let prepared = Prepared::new(program);
    let mut engine = Engine::new(&prepared.model, Vec::new(), 1, Options::default()).expect("it is sound");
    engine.start(&mut ()).expect("it starts");
    let mut sim = Sim::new(engine, &prepared, 0);
    let limits = Limits::default();
    let ended = execute(&program.plan, &program.scene, &mut sim, limits, &mut asking);
    assert_eq!((ended.status, ended.end_time, sim.now()), (RunStatus::Passed, 10.0, 10.0));
    assert_eq!(sim.engine().states()[level as usize], 7.0);
    assert_eq!(asking.failures, ["slip"]);
    let of = |step| asking.ends.iter().find(|(_, s, _)| *s == step).map(|(t, _, state)| (*t, *state));
    assert_eq!(of(slow), Some((5.0, StepState::Done)));
    assert_eq!(of(set), Some((1.0, StepState::Done)));
    assert_eq!(of(fail), Some((1.0, StepState::Failed)));
}
