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
    Bdf, BdfState, DiffsolError, NalgebraMat, NalgebraVec, OdeBuilder, OdeSolverMethod, OdeSolverState, Vector,
    VectorView,
};

use super::clock::Clock;
use super::dense::Dense;
use super::linear::WeighedLu;
use super::tangent;
use super::tape::Tape;
use super::timed::{Busy, Timed};
use super::tolerance::Tolerance;

/// Attempts to find a step are given up below this length, s: far below what any law of nature needs, and far above the
/// least double.
const SHORTEST_STEP: f64 = 1e-60;

/// A solver is left after so many steps, so that they are counted.
const MOST_STEPS: usize = 1000;

/// A step this short as a part of the time counted is one after which counting begins anew.
const FINE: f64 = 1e-8;

/// So many steps in a row that lab time cannot resolve lead nowhere.
const STANDSTILL: usize = 100_000;

/// So many steps in a row within [`CRAWL_TIME`] lead nowhere.
const CRAWL: usize = 20_000;

/// What happens in a lab takes longer than this, s, or is over after far fewer steps than [`CRAWL`].
const CRAWL_TIME: f64 = 1e-6;

/// How often the error of one step is found too large, each time halving it at least: enough to get from 1 s to
/// [`SHORTEST_STEP`].
const REFUSALS: usize = 400;

/// The error allowed in one step as a part of the tolerance asked for. The errors of many steps add up: on the analytic
/// cases of the tests to 80 times that of one.
pub(super) const STEP_SHARE: f64 = 0.02;

/// How many steps are taken at least when the solver is set up. It lengthens its steps only after several of one length,
/// so that a caller who looks often would otherwise keep them short for ever.
const RUN: usize = 12;

/// The right-hand side and its directional derivative, with their scratch memory.
struct Field {
    rates: Tape,
    /// What of them follows the clock alone.
    timed: Option<Timed>,
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
        let timed = Timed::of(&rates);
        Field { work, rates, timed, clock }
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

    /// How fast an error of a state dies out by itself, per s.
    fn damping(&self, moving: &[f64], time: f64, state: usize) -> f64 {
        let mut direction = vec![0.0; moving.len()];
        direction[state] = 1.0;
        let mut slopes = vec![0.0; moving.len()];
        self.slope(moving, time, &direction, &mut slopes);
        (-slopes[state]).max(0.0)
    }

    /// The length, s, that a step of `length` from `time` has to keep to, if it has to.
    fn limit(&self, time: f64, length: f64, moving: &[f64]) -> Result<Option<f64>, Busy> {
        self.timed.as_ref().map_or(Ok(None), |timed| timed.limit(self.clock.lab(time), length, moving))
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
    /// How accurately.
    pub(super) tolerance: Tolerance,
    /// The longest first step, s, if something that follows the clock is near.
    first: Option<f64>,
    /// Steps since the lab time `since`, s.
    crawled: usize,
    since: f64,
}

impl Integrator {
    /// Prepares to integrate `rates` of the states `moving` from `time`, s, and `values` on.
    pub(super) fn new(rates: Tape, moving: Vec<u32>, time: f64, values: &[f64], tolerance: Tolerance) -> Self {
        let dense = Dense::still(time, values);
        let (ahead, field) = (VecDeque::new(), Field::new(rates, dense.clock));
        Integrator { moving, dense, ahead, field, state: None, tolerance, first: None, crawled: 0, since: time }
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
        loop {
            if self.state.as_ref().is_none_or(|state| state.as_ref().h < FINE * self.dense.end) {
                self.restart();
            }
            let setting = Setting { field: &self.field, tolerance: &self.tolerance, first: self.first.take() };
            let driven = drive(setting, self.state.take(), &mut self.dense, &mut self.ahead, visit)?;
            self.state = driven.state;
            let length = match driven.left {
                Left::Visited => return Ok(()),
                Left::Short => {
                    let (end, values) = (self.dense.end, self.dense.last());
                    self.tolerance.listen(&self.field.rates, self.dense.clock.lab(end), values);
                    let length = self.state.as_ref().map(|state| state.as_ref().h);
                    length.filter(|length| self.tolerance.is_outgrown(values, *length))
                }
                Left::Before(limit) => {
                    self.first = Some(limit);
                    None
                }
                Left::Outgrown(length) => Some(length),
            };
            if let Some(length) = length {
                let (field, end, values) = (&self.field, self.dense.end, self.dense.last());
                self.tolerance.renew(values, length, &mut |state| field.damping(values, end, state));
            }
            self.count(driven.steps)?;
        }
    }

    /// Counts steps; too many within a time in which nothing happens lead nowhere.
    fn count(&mut self, steps: usize) -> Result<(), Stuck> {
        let now = self.dense.clock.lab(self.dense.end);
        if now - self.since > CRAWL_TIME {
            (self.since, self.crawled) = (now, 0);
        }
        self.crawled += steps.max(1);
        let moved = now > self.since;
        if self.crawled > if moved { CRAWL } else { STANDSTILL } { Err(Stuck::Short) } else { Ok(()) }
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

/// Why an integration cannot go on.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stuck {
    /// No step is short enough.
    Short,
    /// The clock changes its law too often to be followed.
    Busy,
}

impl From<DiffsolError> for Stuck {
    fn from(_: DiffsolError) -> Self {
        Stuck::Short
    }
}

impl From<Busy> for Stuck {
    fn from(_: Busy) -> Self {
        Stuck::Busy
    }
}

/// What is integrated, and how accurately.
struct Setting<'f> {
    field: &'f Field,
    tolerance: &'f Tolerance,
    /// The longest first step of a new solver, s.
    first: Option<f64>,
}

/// How far a solver went.
struct Driven {
    /// Where it stands.
    state: Option<State>,
    /// Steps it took.
    steps: usize,
    left: Left,
}

/// Why a solver was left.
enum Left {
    /// The visitor said so.
    Visited,
    /// Its steps became too short for the time counted, or many.
    Short,
    /// Something that follows the clock happens within its next step, which must be no longer than this, s.
    Before(f64),
    /// States have grown beyond their tolerances in a step of this length, s.
    Outgrown(f64),
}

/// Steps on from `dense`. After a pause some more steps are taken ahead; one that fails is left to the next call, which
/// starts anew from the last good one.
fn drive(
    setting: Setting<'_>,
    state: Option<State>,
    dense: &mut Dense,
    ahead: &mut VecDeque<Dense>,
    visit: &mut dyn FnMut(&mut Dense) -> Next,
) -> Result<Driven, Stuck> {
    let Setting { field, tolerance, first } = setting;
    let (rtol, atol) = (tolerance.rtol, &tolerance.atol);
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
        None => {
            let mut state = BdfState::new(&problem, 1)?;
            let length = state.as_mut().h;
            *length = first.map_or(*length, |first| length.min(first));
            state
        }
    };
    let allowed = initial.iter().zip(atol).map(|(value, least)| least + rtol * value.abs());
    let mut solver = Bdf::new(&problem, state, WeighedLu::new(allowed))?;
    let mut sampled = NalgebraVec::zeros(initial.len(), *problem.context());
    let mut step = |dense: &mut Dense, solver: &mut Bdf<'_, _, WeighedLu>| {
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
        if let Some(limit) = field.limit(dense.end, solver.state().h, dense.last())? {
            return Ok(Driven { state: None, steps, left: Left::Before(limit) });
        }
        step(dense, &mut solver)?;
        steps += 1;
        match visit(dense) {
            Next::Step if solver.state().h < FINE * dense.end || steps > MOST_STEPS => {
                return Ok(Driven { state: Some(solver.into_state()), steps, left: Left::Short });
            }
            Next::Step if tolerance.is_outgrown(dense.last(), solver.state().h) => {
                let left = Left::Outgrown(solver.state().h);
                return Ok(Driven { state: Some(solver.into_state()), steps, left });
            }
            Next::Step => {}
            Next::Stop => break,
            Next::Pause => {
                for _ in steps..RUN {
                    let mut next = ahead.back().unwrap_or(dense).clone();
                    let seen = matches!(field.limit(next.end, solver.state().h, next.last()), Ok(None));
                    if !seen || step(&mut next, &mut solver).is_err() {
                        return Ok(Driven { state: None, steps, left: Left::Visited });
                    }
                    ahead.push_back(next);
                }
                break;
            }
        }
    }
    Ok(Driven { state: Some(solver.into_state()), steps, left: Left::Visited })
}
