//! The one place that knows the integrator: backward differentiation formulas of `diffsol`.
//!
//! The solver counts time from the last discontinuity on ([`Clock`]): a step of 1e-15 s after a week of lab time is as
//! good as one at its beginning. Steps run freely past the time asked for; what lies between two steps is read from a [`Dense`] polynomial. That keeps
//! the number of steps, and every bit of the result, independent of how often the caller looks. Events are located on the
//! same polynomial by [`super::switch`], because the library reports one root at a time and without its direction.
//!
//! The matrices are nalgebra's, factorised on one thread. The library's other backend, faer, pivots fully; on a chain of
//! heat conduction a step took, in microseconds, nalgebra against faer: 4 states 1 : 2, 32 states 3 : 25, 100 states 20 : 470,
//! 300 states 370 : 11000.

use std::cell::RefCell;
use std::collections::VecDeque;

use diffsol::{
    Bdf, BdfState, DiffsolError, NalgebraLU, NalgebraMat, NalgebraVec, OdeBuilder, OdeSolverMethod, OdeSolverState,
    Vector, VectorView,
};

use super::clock::Clock;
use super::dense::Dense;
use super::tangent;
use super::tape::Tape;

/// Attempts to find a step are given up below this length, s: far below what any law of nature needs, and far above the
/// least double.
const SHORTEST_STEP: f64 = 1e-60;

/// A step this short as a part of the time counted is one after which counting begins anew.
const FINE: f64 = 1e-8;

/// So many steps in a row that lab time cannot resolve lead nowhere.
const STANDSTILL: usize = 100_000;

/// How often the error of one step is found too large, each time halving it at least: enough to get from 1 s to
/// [`SHORTEST_STEP`].
const REFUSALS: usize = 400;

/// The error allowed in one step as a part of the tolerance asked for. The errors of many steps add up: on the analytic
/// cases of the tests to 80 times that of one.
const STEP_SHARE: f64 = 0.02;

/// How many steps are taken at least when the solver is set up. It lengthens its steps only after several of one length,
/// so that a caller who looks often would otherwise keep them short for ever.
const RUN: usize = 12;

/// The right-hand side and its directional derivative, with their scratch memory.
struct Field {
    rates: Tape,
    clock: Clock,
    work: RefCell<Work>,
}

struct Work {
    registers: Vec<f64>,
    tangents: Vec<f64>,
    /// Where the registers were last computed.
    time: f64,
    moving: Vec<f64>,
}

impl Field {
    fn new(rates: Tape, clock: Clock) -> Self {
        let registers = rates.registers();
        let moving = vec![0.0; rates.inputs];
        let work = RefCell::new(Work { tangents: registers.clone(), registers, time: f64::NAN, moving });
        Field { work, rates, clock }
    }

    /// Counts time by `clock`.
    fn restart(&mut self, clock: Clock) {
        self.clock = clock;
        self.work.get_mut().time = f64::NAN;
    }

    fn rate(&self, moving: &[f64], time: f64, out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        self.compute(work, moving, time);
        self.rates.results(&work.registers, out);
    }

    /// Jacobian times `direction`. An infinite slope (a root at zero) is left out: it would only spoil the factorisation.
    fn slope(&self, moving: &[f64], time: f64, direction: &[f64], out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        self.compute(work, moving, time);
        tangent::push(&self.rates, &work.registers, direction, &mut work.tangents);
        self.rates.results(&work.tangents, out);
        for slope in out.iter_mut().filter(|s| !s.is_finite()) {
            *slope = 0.0;
        }
    }

    fn compute(&self, work: &mut Work, moving: &[f64], time: f64) {
        if work.time != time || work.moving != moving {
            self.rates.run(self.clock.lab(time), moving, &mut work.registers);
            work.moving.copy_from_slice(moving);
            work.time = time;
        }
    }
}

type State = BdfState<NalgebraVec<f64>>;

/// One integration, from a discontinuity to the next.
pub(super) struct Integrator {
    /// The states it moves.
    pub(super) moving: Vec<u32>,
    /// The step being looked at.
    pub(super) dense: Dense,
    /// Steps taken beyond it.
    ahead: VecDeque<Dense>,
    field: Field,
    /// Where the solver stands; absent before its first step.
    state: Option<State>,
    rtol: f64,
    atol: Vec<f64>,
}

impl Integrator {
    /// Prepares to integrate `rates` of the states `moving` from `time`, s, and `values` on.
    pub(super) fn new(rates: Tape, moving: Vec<u32>, time: f64, values: &[f64], rtol: f64, atol: Vec<f64>) -> Self {
        let (rtol, atol) = (STEP_SHARE * rtol, atol.into_iter().map(|a| STEP_SHARE * a).collect());
        let dense = Dense::still(time, values);
        let (ahead, field) = (VecDeque::new(), Field::new(rates, dense.clock));
        Integrator { moving, dense, ahead, field, state: None, rtol, atol }
    }

    /// The law it integrates.
    pub(super) fn rates(&self) -> &Tape {
        &self.field.rates
    }

    /// Shows step after step to `visit`, until that says to stop. Fails where no step can be found.
    pub(super) fn drive(&mut self, visit: &mut dyn FnMut(&mut Dense) -> Next) -> Result<(), Stuck> {
        while let Some(dense) = self.ahead.pop_front() {
            self.dense = dense;
            if visit(&mut self.dense) != Next::Step {
                return Ok(());
            }
        }
        let mut idle = 0;
        loop {
            if self.state.as_ref().is_none_or(|state| state.as_ref().h < FINE * self.dense.end) {
                self.restart();
            }
            let setting = Setting { field: &self.field, rtol: self.rtol, atol: &self.atol };
            let begin = self.dense.clock.lab(self.dense.end);
            let driven = drive(setting, self.state.take(), &mut self.dense, &mut self.ahead, visit)?;
            self.state = driven.state;
            if !driven.fine {
                return Ok(());
            }
            idle = if self.dense.clock.lab(self.dense.end) > begin { 0 } else { idle + driven.steps };
            if idle > STANDSTILL {
                return Err(Stuck);
            }
        }
    }

    /// Counts time from the end of the last step on.
    fn restart(&mut self) {
        self.dense.restart();
        self.field.restart(self.dense.clock);
        if let Some(state) = &mut self.state {
            *state.as_mut().t = 0.0;
        }
    }
}

/// What to do after a step was looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    /// Take another.
    Step,
    /// Come back to it: the solution goes on the same way.
    Pause,
    /// A discontinuity: what lies beyond is of no use.
    Stop,
}

/// No step is short enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stuck;

impl From<DiffsolError> for Stuck {
    fn from(_: DiffsolError) -> Self {
        Stuck
    }
}

/// What is integrated, and how accurately.
struct Setting<'f> {
    field: &'f Field,
    rtol: f64,
    atol: &'f [f64],
}

/// How far a solver went.
struct Driven {
    /// Where it stands.
    state: Option<State>,
    /// Steps it took.
    steps: usize,
    /// Whether it was left because its steps became too short for the time counted.
    fine: bool,
}

/// Steps on from `dense`. After a pause some more steps are taken ahead; one that fails is left to the next call, which
/// starts anew from the last good one.
fn drive(
    setting: Setting<'_>,
    state: Option<State>,
    dense: &mut Dense,
    ahead: &mut VecDeque<Dense>,
    visit: &mut dyn FnMut(&mut Dense) -> Next,
) -> Result<Driven, DiffsolError> {
    let Setting { field, rtol, atol } = setting;
    let start = dense.end;
    let mut initial = vec![0.0; atol.len()];
    dense.at(start, &mut initial);
    let mut problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .t0(start)
        .rtol(rtol)
        .atol(atol.iter().copied())
        .rhs_implicit(
            |x: &[f64], _: &[f64], t: f64, out: &mut [f64]| field.rate(x, t, out),
            |x: &[f64], _: &[f64], t: f64, v: &[f64], out: &mut [f64]| field.slope(x, t, v, out),
        )
        .init(|_: &[f64], _: f64, out: &mut [f64]| out.copy_from_slice(&initial), initial.len())
        .build()?;
    problem.ode_options.min_timestep = SHORTEST_STEP;
    // The library counts these over the life of the solver, not per step: the shortest step is the limit that matters.
    problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
    problem.ode_options.max_error_test_failures = REFUSALS;
    let state = match state {
        Some(state) => state,
        None => BdfState::new(&problem, 1)?,
    };
    let mut solver = problem.bdf_solver::<NalgebraLU<f64>>(state)?;
    let mut sampled = NalgebraVec::zeros(initial.len(), *problem.context());
    let mut step = |dense: &mut Dense, solver: &mut Bdf<'_, _, NalgebraLU<f64>>| {
        solver.step()?;
        dense.extend(solver.state().t, |time, out| {
            solver.interpolate_inplace(time, &mut sampled)?;
            let sampled = sampled.get_batch(0);
            for (i, out) in out.iter_mut().enumerate() {
                *out = sampled.get_index(i);
            }
            Ok::<(), DiffsolError>(())
        })
    };
    let mut steps = 0;
    loop {
        step(dense, &mut solver)?;
        steps += 1;
        match visit(dense) {
            Next::Step if solver.state().h < FINE * dense.end || steps > STANDSTILL => {
                return Ok(Driven { state: Some(solver.into_state()), steps, fine: true });
            }
            Next::Step => {}
            Next::Stop => break,
            Next::Pause => {
                for _ in steps..RUN {
                    let mut next = ahead.back().unwrap_or(dense).clone();
                    if step(&mut next, &mut solver).is_err() {
                        return Ok(Driven { state: None, steps, fine: false });
                    }
                    ahead.push_back(next);
                }
                break;
            }
        }
    }
    Ok(Driven { state: Some(solver.into_state()), steps, fine: false })
}
