//! A program from its initial state to its outcome.

use matterix_ir::plan::{Plan, Step};
use matterix_ir::{Program, Severity, codes};
use serde::Serialize;

use crate::backend::{Backend, Dry, Moves, Prepared, Sim};
use crate::contact::{Matter, Really};
use crate::exec::Tee;
use crate::exec::{self, Around, Execution, FailureTrace, Limits, Listener, RunStatus, StepRecord};
use crate::fault::Fault;
use crate::motion::{Stage, Unseen};
use crate::process::{BalanceReport, Engine, Options};
pub use crate::screen::{Finding, Screen};

/// How closely the world is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Fidelity {
    /// Motions take their declared time.
    #[default]
    Process,
    /// Robots move through space on ways without collision, in the time their joints need.
    Motion,
    /// The same, and things are held by force and friction, touch and fall.
    Contact,
    /// Nothing moves: the plan is walked with nominal durations.
    Dry,
}

impl Fidelity {
    /// As files have it.
    pub fn name(self) -> &'static str {
        match self {
            Fidelity::Process => "process",
            Fidelity::Motion => "motion",
            Fidelity::Contact => "contact",
            Fidelity::Dry => "dry",
        }
    }
}

/// How to run a program.
#[derive(Clone, Debug, Default)]
pub struct RunOptions<'c> {
    /// Noise of readings follows from it.
    pub seed: u64,
    /// Which backend.
    pub fidelity: Fidelity,
    /// Parameters that differ from the program's, by name, SI.
    pub params: Vec<(String, f64)>,
    /// Longest run, steps per instant, cancellation.
    pub limits: Limits<'c>,
    /// Accuracy of the process engine.
    pub process: Options,
    /// How far things are from where robots take them to be, at fidelity `motion` and `contact`.
    pub unseen: Unseen,
    /// How strong and how rough things really are, at fidelity `contact`.
    pub really: Really,
}

/// What came of a run: of its plan, and of the lab.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Of its plan.
    #[serde(flatten)]
    pub execution: Execution,
    /// Warnings of the screen, in order: species that have met and should not, and hazards that came about. An error is a failure.
    pub findings: Vec<Finding>,
    /// Parameters as used, by index, SI.
    pub params: Vec<f64>,
    /// States at the end, by index, SI; absent where a dry run cannot know them.
    pub states: Vec<Option<f64>>,
    /// How the sums over the lab closed; none in a dry run.
    #[serde(skip)]
    pub balances: Vec<BalanceReport>,
}

impl std::ops::Deref for Outcome {
    type Target = Execution;

    fn deref(&self) -> &Execution {
        &self.execution
    }
}

/// Runs `program` to its end and tells `out` what happens. A run never panics and always ends within its limits.
pub fn run(program: &Program, options: &RunOptions<'_>, out: &mut dyn Listener) -> Outcome {
    let params = match params(program, &options.params) {
        Ok(params) => params,
        Err(fault) => return refused(program, fault),
    };
    match options.fidelity {
        Fidelity::Process | Fidelity::Motion | Fidelity::Contact => {
            run_ready(program, &Prepared::new(program), params, options, out)
        }
        Fidelity::Dry => {
            let mut dry = Dry::new(&program.model, &program.plan, params.clone());
            let execution = exec::execute(&program.plan, &program.scene, &mut dry, options.limits, out);
            outcome(execution, params, dry.states().to_vec())
        }
    }
}

/// Runs a program that was made ready before, for one run of many: `params` are all of its parameters by index, SI. The
/// fidelity is `process`, or `motion` where the options say so.
pub fn run_ready(
    program: &Program,
    prepared: &Prepared,
    params: Vec<f64>,
    options: &RunOptions<'_>,
    out: &mut dyn Listener,
) -> Outcome {
    match Underway::begin(program, prepared, params, options, out) {
        Ok(mut underway) => {
            underway.go_on(f64::INFINITY, out);
            underway.finish(out)
        }
        Err(outcome) => *outcome,
    }
}

/// A run of a program on the twin that can be left at any time. A clone is a snapshot: it goes on as the run does, to the last bit,
/// wherever either of them pauses. What listens goes along as a clone of itself, such as of a [`Recording`](crate::record::Recording).
#[derive(Clone)]
pub struct Underway<'p> {
    program: &'p Program,
    params: Vec<f64>,
    sim: Sim<'p>,
    progress: exec::Progress<'p>,
    limits: Limits<'p>,
    /// Who looks for what should not come about, if there is such a thing.
    screen: Option<Screen<'p>>,
}

impl<'p> Underway<'p> {
    /// Starts the engine on a program that was made ready: `params` are all of its parameters by index, SI. Where it cannot begin
    /// there is an outcome already.
    pub fn begin(
        program: &'p Program,
        prepared: &'p Prepared,
        params: Vec<f64>,
        options: &RunOptions<'p>,
        out: &mut dyn Listener,
    ) -> Result<Self, Box<Outcome>> {
        let mut screen = Some(Screen::new(program)).filter(|screen| !screen.is_idle());
        let mut sim = beside(&mut screen, out, |out| twin(program, prepared, &params, options, out))?;
        if let Some(screen) = &screen {
            sim.engine().attend(screen.conditions());
        }
        let progress = exec::Progress::new(&program.plan, sim.now(), options.limits);
        Ok(Underway { program, params, sim, progress, limits: options.limits, screen })
    }

    /// Goes on to `until`, s of lab time, or to the end of the plan; whether that has come.
    pub fn go_on(&mut self, until: f64, out: &mut dyn Listener) -> bool {
        let Underway { program, sim, progress, limits, screen, .. } = self;
        let Program { plan, scene, .. } = program;
        beside(screen, out, |out| progress.go_on(Around { plan, scene, backend: sim, limits: *limits, out }, until))
    }

    /// What has come of it.
    pub fn finish(mut self, out: &mut dyn Listener) -> Outcome {
        let Some(mut screen) = self.screen.take() else { return self.end(out) };
        let mut outcome = self.end(&mut Tee(&mut screen, out));
        outcome.findings = screen.into_found();
        let is_grave = outcome.findings.iter().any(|f| f.diagnostic.severity == Severity::Error);
        if is_grave && outcome.status == RunStatus::Passed {
            outcome.execution.status = RunStatus::ExpectationFailed;
        }
        outcome
    }

    fn end(mut self, out: &mut dyn Listener) -> Outcome {
        let execution = self.progress.into_execution(out);
        let engine = self.sim.engine();
        let finished = engine.finish(out);
        out.ended(engine);
        let mut outcome = outcome(execution, self.params, engine.states().into_iter().map(Some).collect());
        outcome.balances = engine.balances();
        if let (Err(fault), true) = (finished, outcome.status != RunStatus::Fault) {
            let trace = FailureTrace::of_fault(&self.program.plan, fault);
            out.failure(&trace);
            let Execution { status, suppressed, failure, .. } = &mut outcome.execution;
            *status = RunStatus::Fault;
            suppressed.extend(failure.replace(trace));
        }
        outcome
    }
}

/// Does what `out` listens to, and a screen as well if there is one.
fn beside<R>(screen: &mut Option<Screen<'_>>, out: &mut dyn Listener, work: impl FnOnce(&mut dyn Listener) -> R) -> R {
    match screen {
        Some(screen) => work(&mut Tee(screen, out)),
        None => work(out),
    }
}

/// The twin as it stands when the plan begins. Where it cannot begin there is an outcome already.
fn twin<'p>(
    program: &'p Program,
    prepared: &'p Prepared,
    params: &[f64],
    options: &RunOptions<'p>,
    out: &mut dyn Listener,
) -> Result<Sim<'p>, Box<Outcome>> {
    let engine = Engine::new(&prepared.model, params.to_vec(), program.plan.locals.len(), options.process);
    let started = engine.and_then(|mut engine| engine.start(out).map(|()| engine));
    let mut engine = started.map_err(|fault| Box::new(refused(program, fault)))?;
    engine.heed(options.limits.cancel);
    let sim = Sim::new(engine, prepared, options.seed).with_unseen(&options.unseen);
    let moves = matches!(options.fidelity, Fidelity::Motion | Fidelity::Contact);
    match Stage::new(program) {
        Ok(stage) if options.fidelity == Fidelity::Contact => {
            let matter = Matter::new(&options.unseen.in_stage(&stage), options.really);
            let matter =
                matter.map_err(|why| Box::new(refused(program, Fault::new(codes::NO_CONTACT_MODEL, 0.0, why))))?;
            let moves = Moves { robots: true, beside: runs_beside(&program.plan) };
            Ok(sim.with_stage(stage, moves, out).with_matter(matter))
        }
        Ok(stage) if moves || !stage.fixtures.is_empty() => {
            Ok(sim.with_stage(stage, Moves { robots: moves, beside: runs_beside(&program.plan) }, out))
        }
        Err(message) if moves => Err(Box::new(refused(program, Fault::new(codes::URDF_FILE, 0.0, message)))),
        _ => Ok(sim),
    }
}

/// Whether some steps of a plan run beside others.
fn runs_beside(plan: &Plan) -> bool {
    plan.steps.iter().any(|s| matches!(s.step, Step::Parallel(_) | Step::Start { .. }))
}

/// The program's parameters with those that differ.
fn params(program: &Program, changed: &[(String, f64)]) -> Result<Vec<f64>, Fault> {
    let mut values: Vec<f64> = program.model.params.iter().map(|p| p.value).collect();
    for (name, value) in changed {
        let mut found = false;
        for (_, slot) in program.model.params.iter().zip(&mut values).filter(|(p, _)| p.name == *name) {
            (*slot, found) = (*value, true);
        }
        if !found {
            let message = format!("the program has no parameter `{name}`");
            return Err(Fault::new(codes::UNKNOWN_PARAMETER, 0.0, message));
        }
    }
    Ok(values)
}

/// A run that could not begin.
fn refused(program: &Program, fault: Fault) -> Outcome {
    let execution = Execution {
        status: RunStatus::Fault,
        failure: Some(FailureTrace::of_fault(&program.plan, fault)),
        suppressed: Vec::new(),
        unfinished: Vec::new(),
        expectations: Vec::new(),
        assumptions: Vec::new(),
        steps: vec![StepRecord::default(); program.plan.steps.len()],
        end_time: 0.0,
    };
    outcome(execution, Vec::new(), Vec::new())
}

fn outcome(execution: Execution, params: Vec<f64>, states: Vec<Option<f64>>) -> Outcome {
    Outcome { execution, findings: Vec::new(), params, states, balances: Vec::new() }
}
