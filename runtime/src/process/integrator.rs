//! The one place that knows the integrator: backward differentiation formulas of `diffsol`.
//!
//! The solver counts time from the last discontinuity on ([`Clock`]): a step of 1e-15 s after a week of lab time is as
//! good as one at its beginning. Steps run freely past the time asked for, several at one go; what lies between two steps is read
//! from a [`Dense`] polynomial. That keeps the number of steps, and every bit of the result, independent of how often the caller
//! looks. Events are located on the same polynomial by [`super::switch`], because the library reports one root at a time and
//! without its direction.
//!
//! What is linear with constant coefficients but for bends is not integrated at all ([`Bent`]), until its rates are too far apart.

use std::cell::RefCell;

use diffsol::{
    Bdf, BdfState, DiffsolError, NalgebraContext, NalgebraVec, OdeBuilder, OdeSolverMethod, OdeSolverState, Vector,
    VectorView,
};

use super::bends::Bent;
use super::clock::Clock;
use super::dense::Dense;
use super::equations::Equations;
use super::linear::{DENSE, Factors, WeighedLu};
use super::shifted::Shifted;
use super::slopes::Slopes;
use super::tangent;
use super::tape::Tape;
use super::timed::{Busy, Timed};
use super::tolerance::Tolerance;

/// Attempts to find a step are given up below this length, s: far below what any law of nature needs, and far above the
/// least double.
const SHORTEST_STEP: f64 = 1e-60;

/// After so many steps the rounding of the law is weighed anew.
const MOST_STEPS: usize = 1000;

/// A step this short as a part of the time counted is one after which counting begins anew.
const FINE: f64 = 1e-8;

/// So many steps in a row that lab time cannot resolve lead nowhere.
const STANDSTILL: usize = 100_000;

/// So many steps in a row within [`CRAWL_TIME`] lead nowhere.
const CRAWL: usize = 20_000;

/// What happens in a lab takes longer than this, s, or is over after far fewer steps than [`CRAWL`].
const CRAWL_TIME: f64 = 1e-6;

/// A step that is not found costs as much as so many: all lengths down to [`SHORTEST_STEP`] were tried.
const NOT_FOUND: usize = 200;

/// How often the error of one step is found too large, each time halving it at least: enough to get from 1 s to
/// [`SHORTEST_STEP`].
const REFUSALS: usize = 400;

/// How often the equations of a step are not solved at most, on the mean of those taken at one go.
const FAILURES: usize = 20;

/// The error allowed in one step as a part of the tolerance asked for. The errors of many steps add up: on the analytic
/// cases of the tests to 80 times that of one.
pub(super) const STEP_SHARE: f64 = 0.02;

/// Steps that are taken at one go: first so many, then twice as many, up to [`LONGEST_RUN`]. A solver that is set up anew looks at
/// its Jacobian anew; what lies beyond the end of a law is of no use. The number depends on nothing else, so that a result is the same to
/// the last bit however often the caller looks.
const RUN: usize = 12;

/// Steps that are taken at one go at most.
const LONGEST_RUN: usize = 96;

/// The right-hand side and its derivative, with their scratch memory.
#[derive(Clone)]
pub(super) struct Field {
    rates: Tape,
    /// What of them follows the clock alone.
    timed: Option<Timed>,
    slopes: Slopes,
    factors: RefCell<Factors>,
    clock: Clock,
    work: RefCell<Work>,
}

#[derive(Clone)]
struct Work {
    registers: Vec<f64>,
    tangents: Vec<f64>,
    slopes: Vec<f64>,
    /// Where the registers were last computed.
    time: f64,
    moving: Vec<f64>,
}

impl Field {
    fn new(rates: Tape, clock: Clock) -> Self {
        let registers = rates.registers();
        let moving = vec![0.0; rates.inputs];
        let slopes = Slopes::new(&rates, rates.inputs > DENSE);
        let (tangents, memory) = (registers.clone(), slopes.memory());
        let work = RefCell::new(Work { tangents, registers, slopes: memory, time: f64::NAN, moving });
        let timed = Timed::of(&rates);
        let factors = RefCell::new(Factors::new(&slopes.pattern));
        Field { work, rates, timed, slopes, factors, clock }
    }

    /// Counts time by `clock`.
    fn restart(&mut self, clock: Clock) {
        self.clock = clock;
        self.work.get_mut().time = f64::NAN;
    }

    pub(super) fn rate(&self, moving: &[f64], time: f64, out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        self.compute(work, moving, time);
        self.rates.results(&work.registers, out);
    }

    /// Jacobian times `direction`. An infinite slope (a root at zero) is left out: it would only spoil the factorisation.
    pub(super) fn slope(&self, moving: &[f64], time: f64, direction: &[f64], out: &mut [f64]) {
        let work = &mut *self.work.borrow_mut();
        self.compute(work, moving, time);
        tangent::push(&self.rates, &work.registers, direction, &mut work.tangents);
        self.rates.results(&work.tangents, out);
        for slope in out.iter_mut().filter(|s| !s.is_finite()) {
            *slope = 0.0;
        }
    }

    /// The whole Jacobian.
    pub(super) fn slopes(&self, moving: &[f64], time: f64, matrix: &mut Shifted) {
        let work = &mut *self.work.borrow_mut();
        self.compute(work, moving, time);
        let (slopes, rates) = (&self.slopes, &self.rates);
        let entries = slopes.pattern.columns.len();
        matrix.set(entries, |out| slopes.evaluate(rates, &work.registers, &mut work.slopes, out));
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
#[derive(Clone)]
pub(super) struct Integrator {
    /// The states it moves, ascending.
    pub(super) moving: Vec<u32>,
    /// The last step taken.
    dense: Dense,
    field: Field,
    /// Its law, if that needs no integration.
    pub(super) exact: Option<Bent>,
    /// Where the solver stands; absent before its first step.
    state: Option<State>,
    /// How accurately.
    pub(super) tolerance: Tolerance,
    /// The longest first step, s, if something that follows the clock is near.
    first: Option<f64>,
    /// Steps of the next run.
    run: usize,
    /// Steps since rounding was weighed.
    unheard: usize,
    /// Steps since the lab time `since`, s.
    crawled: usize,
    since: f64,
}

impl Integrator {
    /// Prepares to integrate `rates` of the states `moving` from `time`, s, and `values` on.
    pub(super) fn new(rates: Tape, moving: Vec<u32>, time: f64, values: &[f64], tolerance: Tolerance) -> Self {
        let dense = Dense::still(time, values);
        let field = Field::new(rates, dense.clock);
        let exact = Bent::of(&field.rates, values);
        let (state, first) = (None, None);
        let (run, unheard, crawled, since) = (RUN, 0, 0, time);
        Integrator { moving, dense, field, exact, state, tolerance, first, run, unheard, crawled, since }
    }

    /// The law it integrates.
    pub(super) fn rates(&self) -> &Tape {
        &self.field.rates
    }

    /// Where it begins: an empty interval.
    pub(super) fn begin(&self) -> Dense {
        self.dense.clone()
    }

    /// Takes the next steps and shows each to `visit`, until that sees the law end. One that fails is left to the next run, which
    /// starts anew from the last good one. Fails where not even one can be found.
    pub(super) fn run(&mut self, visit: &mut dyn FnMut(&Dense) -> Next) -> Result<(), Stuck> {
        let steps = self.run;
        self.run = (2 * steps).min(LONGEST_RUN);
        let mut taken = self.propagate(steps, visit);
        self.count(taken)?;
        while taken < steps && self.exact.is_none() {
            if self.state.as_ref().is_none_or(|state| state.as_ref().h < FINE * self.dense.end) {
                self.restart();
            }
            let is_fresh = self.state.is_none();
            let setting = Setting { field: &self.field, tolerance: &self.tolerance, first: self.first.take() };
            let driven = drive(setting, self.state.take(), &mut self.dense, steps - taken, visit)?;
            self.state = driven.state;
            taken += driven.steps;
            self.unheard += driven.steps;
            let tried = if let Left::Failed(_) = driven.left { NOT_FOUND } else { 0 };
            self.count(driven.steps + tried)?;
            let length = match driven.left {
                Left::Visited => break,
                Left::Failed(stuck) if taken == 0 && is_fresh => return Err(stuck),
                Left::Failed(_) if taken > 0 => return Ok(()),
                Left::Failed(_) => None,
                Left::Short => self.listen(),
                Left::Before(limit) => {
                    self.first = Some(limit);
                    None
                }
                Left::Outgrown(length) => Some(length),
            };
            self.renew(length);
        }
        if self.unheard >= MOST_STEPS {
            let length = self.listen();
            self.renew(length);
        }
        Ok(())
    }

    /// Takes up to so many steps of a law that needs no integration; how many. It is integrated from where there are no more.
    fn propagate(&mut self, steps: usize, visit: &mut dyn FnMut(&Dense) -> Next) -> usize {
        let mut slopes = vec![0.0; self.moving.len()];
        for taken in 0..steps {
            let Some(exact) = &mut self.exact else { return taken };
            let (end, values) = (self.dense.end, self.dense.last());
            self.field.rate(values, end, &mut slopes);
            let Some(stride) = exact.stride(&self.field.rates, values, &slopes, &self.tolerance.allowed(values)) else {
                self.exact = None;
                return taken;
            };
            if stride.length < FINE * end {
                self.restart();
            }
            self.dense.follow(stride.length, &stride.states);
            if self.tolerance.is_outgrown(self.dense.last(), stride.length) {
                self.renew(Some(stride.length));
            }
            if visit(&self.dense) == Next::Stop {
                return taken + 1;
            }
        }
        steps
    }

    /// Weighs rounding anew; the length of the last step, s, where tolerances do not fit any more.
    fn listen(&mut self) -> Option<f64> {
        self.unheard = 0;
        let (end, values) = (self.dense.end, self.dense.last());
        self.tolerance.listen(&self.field.rates, self.dense.clock.lab(end), values);
        let length = self.state.as_ref().map(|state| state.as_ref().h);
        length.filter(|length| self.tolerance.is_outgrown(values, *length))
    }

    /// Sets tolerances anew after a step of `length`, s, if there is one: for the rounding of the law as it is now, which may be far less than
    /// where it began.
    fn renew(&mut self, length: Option<f64>) {
        if let Some(length) = length {
            let (field, end, values) = (&self.field, self.dense.end, self.dense.last());
            self.tolerance.listen(&field.rates, self.dense.clock.lab(end), values);
            self.tolerance.renew(values, length, &mut |state| field.damping(values, end, state));
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
    /// The law ends here: what lies beyond is of no use.
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
    /// The visitor said so, or all steps were taken.
    Visited,
    /// No further step was found.
    Failed(Stuck),
    /// Its steps became too short for the time counted.
    Short,
    /// Something that follows the clock happens within its next step, which must be no longer than this, s.
    Before(f64),
    /// States have grown beyond their tolerances in a step of this length, s.
    Outgrown(f64),
}

/// Takes up to `most` steps on from `dense`, each of which takes its place.
fn drive(
    setting: Setting<'_>,
    state: Option<State>,
    dense: &mut Dense,
    most: usize,
    visit: &mut dyn FnMut(&Dense) -> Next,
) -> Result<Driven, Stuck> {
    let Setting { field, tolerance, first } = setting;
    let (rtol, atol) = (tolerance.rtol, &tolerance.atol);
    let start = dense.end;
    let mut initial = vec![0.0; atol.len()];
    dense.at(start, &mut initial);
    let context = NalgebraContext::default();
    let equations = Equations { field, initial: &initial, context };
    let mut problem =
        OdeBuilder::<Shifted>::new().t0(start).rtol(rtol).atol(atol.iter().copied()).build_from_eqn(equations)?;
    problem.ode_options.min_timestep = SHORTEST_STEP;
    // The library counts these over the life of the solver, not per step. A step of no length that is a number never ends otherwise.
    problem.ode_options.max_nonlinear_solver_failures = REFUSALS + FAILURES * most;
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
    field.factors.borrow_mut().allow(&tolerance.allowed(&initial));
    let mut solver = Bdf::new(&problem, state, WeighedLu::new(&field.factors))?;
    let mut sampled = NalgebraVec::zeros(initial.len(), *problem.context());
    let mut step = |dense: &Dense, solver: &mut Bdf<'_, _, WeighedLu<'_>>| {
        let mut next = dense.clone();
        solver.step()?;
        next.extend(solver.state().t, |time, out| {
            solver.interpolate_inplace(time, &mut sampled)?;
            let sampled = sampled.get_batch(0);
            for (i, out) in out.iter_mut().enumerate() {
                *out = sampled.get_index(i);
            }
            Ok::<(), DiffsolError>(())
        })?;
        Ok::<Dense, DiffsolError>(next)
    };
    for steps in 0..most {
        let left = |left| Ok(Driven { state: None, steps, left });
        match field.limit(dense.end, solver.state().h, dense.last()) {
            Ok(None) => {}
            Ok(Some(limit)) => return left(Left::Before(limit)),
            Err(busy) => return left(Left::Failed(busy.into())),
        }
        match step(dense, &mut solver) {
            Ok(next) if next.last().iter().all(|value| value.is_finite()) => *dense = next,
            Ok(_) => return left(Left::Failed(Stuck::Short)),
            Err(error) => return left(Left::Failed(error.into())),
        }
        let left = match visit(dense) {
            Next::Stop => Left::Visited,
            Next::Step if solver.state().h < FINE * dense.end => Left::Short,
            Next::Step if tolerance.is_outgrown(dense.last(), solver.state().h) => Left::Outgrown(solver.state().h),
            Next::Step => continue,
        };
        return Ok(Driven { state: Some(solver.into_state()), steps: steps + 1, left });
    }
    Ok(Driven { state: Some(solver.into_state()), steps: most, left: Left::Visited })
}
