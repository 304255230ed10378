//! The process engine: advances a model through time, from discontinuity to discontinuity.
//!
//! Time is cut into *segments*. Within one the truth of every comparison is frozen, so that the law is smooth and a
//! high-order implicit integrator can follow it with long steps. A segment ends where a comparison changes that the model
//! or the caller cares about; there events fire, the law is looked at anew, and the next segment begins.
//!
//! - `tape`, `tangent`: the law of a segment as a short program, and its derivative.
//! - `index`: who rests on what.
//! - `analysis`, `mode`, `prepare`: what the law is between two discontinuities, and how it is taken apart, where one concerns it.
//! - `part`, `lookout`: states that move together; what no single part decides.
//! - `course`: both of these in the order of time.
//! - `switch`: the comparisons, and where they change.
//! - `integrator`, `dense`, `clock`: steps, the solution between them, and the time that they count.
//! - `exact`, `doubled`, `series`, `bends`: steps of parts that need no integration.
//! - `bernstein`: polynomials by their control points.
//! - `equations`, `slopes`, `shifted`, `linear`, `sparse`: the linear systems of steps.
//! - `limits`: what things keep at all times.
//! - `tolerance`, `timed`: how accurate steps are, and what they must not step over.
//! - `suspicion`: what laws and effects may do to sums and temperatures that must not be.
//! - `blame`, `words`: which law is at fault where a run cannot go on, in words.
//! - `advance`, `instant`: the loop over what happens, and what happens at one instant.
//! - `undecided`: conditions that are neither true nor false.
//! - `memo`: values at one instant.

mod advance;
mod analysis;
mod bends;
mod bernstein;
mod blame;
mod clock;
mod course;
mod dense;
mod doubled;
mod equations;
mod exact;
mod index;
mod instant;
mod integrator;
mod limits;
mod linear;
mod lookout;
mod memo;
mod mode;
mod part;
mod prepare;
mod series;
mod shifted;
mod slopes;
mod sparse;
mod suspicion;
mod switch;
mod tangent;
mod tape;
#[cfg(test)]
mod tests;
mod timed;
mod tolerance;
mod undecided;
mod words;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::graph::Env;
use matterix_ir::interval::Interval;
use matterix_ir::model::{Action, Model};
use matterix_ir::{NodeId, Op};

use crate::fault::Fault;
pub use crate::ledger::BalanceReport;
use crate::ledger::Balances;

pub use limits::Keeps;

use analysis::Facts;
use course::Course;
use index::{Index, Root};
use limits::Limits;
use memo::{Leaf, Memo};
use prepare::Due;
use suspicion::Suspicion;

/// How accurately to integrate, and when to give up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Relative error of a step; the absolute one is this times the scale of the state, declared or by the values that occur.
    pub rtol: f64,
    /// More events than this at one instant are a fault.
    pub max_events_per_instant: usize,
    /// Whether parts that have nothing to do with each other are followed on several threads, where there are many. It changes no bit.
    pub is_shared: bool,
    /// Whether [`Observer::curve`] is called; it changes no bit of a result either.
    pub curves: bool,
}

impl Options {
    /// For one of many runs that have threads of their own.
    pub fn of_one_of_many() -> Self {
        Options { is_shared: false, ..Options::default() }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options { rtol: 1e-8, max_events_per_instant: 1000, is_shared: true, curves: false }
    }
}

/// Is told what happens, in the order in which it happens.
pub trait Observer {
    /// After each step of a part and before and after each discontinuity: two samples at one time are possible. `changed` are the
    /// states, ascending, that may differ from when they were last shown; all others follow the way they were on.
    fn sample(&mut self, time: f64, engine: &Engine<'_>, changed: &[u32]);
    /// Within a step of a part, where [`Options::curves`] asks for it: states, ascending, that are on a curve there. Straight lines between
    /// all that is shown of a state lie close to it.
    fn curve(&mut self, _time: f64, _engine: &Engine<'_>, _changed: &[u32]) {}
    /// What these states, ascending, have followed since they were last shown is forgotten after this: only now can it be asked for.
    fn leaves(&mut self, _time: f64, _engine: &Engine<'_>, _states: &[u32]) {}
    /// What happens at once at the start has happened: salts are dissolved. Samples before this show how things were put in.
    fn begun(&mut self, _time: f64, _engine: &Engine<'_>) {}
    /// An event has fired, by its index in the model.
    fn event(&mut self, time: f64, event: usize);
    /// A process has begun or ceased to run, by its index in the model.
    fn process(&mut self, time: f64, process: usize, running: bool);
    /// A fraction of one mixture, by its index in the model, has moved into another within an instant.
    fn moved(&mut self, _time: f64, _from: u32, _to: u32, _fraction: f64) {}
    /// Whether time is to stop after the present step, as something has come about that is to be answered first.
    fn stops(&self) -> bool {
        false
    }
}

/// Observes nothing.
impl Observer for () {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

/// A condition to stop at: as soon as the truth of `node` is `value`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watch {
    /// The condition.
    pub node: NodeId,
    /// Whether to stop when it is true or when it is false.
    pub value: bool,
}

/// Why an advance ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Advance {
    /// The time asked for is reached.
    Reached,
    /// These watches hold now, by their index.
    Watch(Vec<usize>),
    /// These limits hold no longer, by their index.
    Broken(Vec<u32>),
}

/// A model on its way through time. A clone is a snapshot: it goes on from where it was taken as the original would have, to the last bit.
#[derive(Clone)]
pub struct Engine<'m> {
    model: &'m Model,
    options: Options,
    params: Vec<f64>,
    locals: Vec<f64>,
    readings: Vec<f64>,
    time: f64,
    /// Those that move, as of where their part has been followed to.
    states: Vec<f64>,
    index: Index,
    facts: Facts,
    /// By state, whether it moves.
    moving: Vec<bool>,
    /// What moves.
    course: Course,
    /// What has changed since the law was last looked at.
    due: Due,
    /// The roots of what the caller looks out for.
    watching: BTreeSet<u32>,
    /// Comparisons that may have changed at the present instant.
    suspects: Vec<NodeId>,
    /// By state, the largest magnitude since it was last set, as far as a law moved it.
    sizes: Vec<f64>,
    /// Set from outside to leave off early, once.
    cancel: Option<&'m AtomicBool>,
    /// Truth of each event's condition when last looked at.
    armed: Vec<bool>,
    /// Which processes run.
    running: Vec<bool>,
    /// Equalities that are true at this instant only.
    touches: Vec<NodeId>,
    /// By comparison, the times of its last changes.
    crossings: BTreeMap<NodeId, VecDeque<f64>>,
    /// States that the observer has not seen as they are now.
    unshown: Vec<u32>,
    balances: Balances,
    /// States that have changed since all sums were last looked at.
    unbalanced: usize,
    suspicion: Suspicion,
    limits: Limits<'m>,
    memo: RefCell<Memo>,
}

impl<'m> Engine<'m> {
    /// The model at time 0, its initial states evaluated. `params` are by parameter index, SI; `locals` is how many values
    /// the plan keeps. Fails where an initial state is not finite.
    pub fn new(model: &'m Model, params: Vec<f64>, locals: usize, options: Options) -> Result<Self, Fault> {
        let mut engine = Engine {
            model,
            options,
            params,
            locals: vec![f64::NAN; locals],
            readings: vec![f64::NAN; model.readings.len()],
            time: 0.0,
            states: vec![0.0; model.states.len()],
            index: Index::new(model, []),
            facts: Facts::new(&model.graph),
            moving: vec![false; model.states.len()],
            course: Course::new(model.states.len(), options.is_shared, options.curves),
            due: Due::default(),
            watching: BTreeSet::new(),
            suspects: Vec::new(),
            sizes: vec![0.0; model.states.len()],
            cancel: None,
            armed: vec![false; model.events.len()],
            running: vec![false; model.processes.len()],
            touches: Vec::new(),
            crossings: BTreeMap::new(),
            unshown: (0..model.states.len() as u32).collect(),
            balances: Balances::default(),
            unbalanced: 0,
            suspicion: Suspicion::new(model),
            limits: Limits::default(),
            memo: RefCell::new(Memo::new(&model.graph)),
        };
        for derivative in &model.derivatives {
            engine.moving[derivative.state as usize] = true;
        }
        engine.states = model.states.iter().map(|s| engine.eval(s.initial)).collect();
        engine.memo = RefCell::new(Memo::new(&model.graph));
        if let Some(state) = engine.states.iter().position(|s| !s.is_finite()) {
            return Err(engine.no_beginning(state as u32));
        }
        engine.readings = model.readings.iter().map(|r| engine.eval(r.value)).collect();
        engine.memo = RefCell::new(Memo::new(&model.graph));
        engine.balances = Balances::open(model, &engine.states, |n| engine.eval(n));
        engine.due.events.extend(0..model.events.len() as u32);
        engine.due.processes.extend(0..model.processes.len() as u32);
        engine.concern_all();
        Ok(engine)
    }

    /// All of the law has to be looked at.
    fn concern_all(&mut self) {
        self.due.law.roots.extend(0..self.index.len());
    }

    /// From here on `cancel`, once set, ends the advance under way at an instant of its own, as if a watch without index had
    /// fired; those that follow go on.
    pub fn heed(&mut self, cancel: Option<&'m AtomicBool>) {
        self.cancel = cancel;
    }

    /// Shows the instants at which these conditions come true or cease to be from now on: an observer that looks at them sees each.
    pub fn attend(&mut self, conditions: impl IntoIterator<Item = NodeId>) {
        for condition in conditions {
            let root = self.index.ask(&self.model.graph, Root::Attended, condition);
            self.due.law.roots.insert(root);
            self.due.law.sights.insert(root);
        }
    }

    /// Reports the processes that run, fires the events that are true and takes the first sample.
    pub fn start(&mut self, observer: &mut dyn Observer) -> Result<(), Fault> {
        self.settle(None, observer)?;
        self.show(observer);
        observer.begun(self.time, self);
        Ok(())
    }

    /// Seconds since the run began.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// What all states are now, by index, SI.
    pub fn states(&self) -> Vec<f64> {
        (0..self.states.len() as u32).map(|state| self.state(state)).collect()
    }

    /// What a state is now, SI; not a number where there is no such.
    pub fn state(&self, index: u32) -> f64 {
        let flowed = self.course.mover(index).and_then(|part| part.value(index, self.time));
        flowed.or_else(|| self.states.get(index as usize).copied()).unwrap_or(f64::NAN)
    }

    /// What is advanced.
    pub fn model(&self) -> &'m Model {
        self.model
    }

    /// Values of the plan, SI; not a number until set.
    pub fn locals(&self) -> &[f64] {
        &self.locals
    }

    /// Sets a value of the plan; an index the plan does not have is ignored.
    pub fn set_local(&mut self, index: u32, value: f64) {
        if let Some(local) = self.locals.get_mut(index as usize) {
            *local = value;
            self.heard(Op::Local(index));
        }
    }

    /// What the devices report, by reading index, SI. At the start the exact values.
    pub fn readings(&self) -> &[f64] {
        &self.readings
    }

    /// A device reports; an index the model does not have is ignored.
    pub fn set_reading(&mut self, index: u32, value: f64) {
        if let Some(reading) = self.readings.get_mut(index as usize) {
            *reading = value;
            self.heard(Op::Reading(index));
        }
    }

    fn heard(&mut self, leaf: Op) {
        let leaves = self.index.heard(leaf);
        self.memo.get_mut().change_all(&self.index.users, &leaves);
        self.due.seeds.extend(leaves);
    }

    /// The value of `node` now; each operation is computed once between two changes.
    pub fn eval(&self, node: NodeId) -> f64 {
        let leaf = |op| {
            let flows = match op {
                Op::Time => true,
                Op::State(state) => self.course.mover(state).is_some(),
                _ => false,
            };
            Leaf { value: self.leaf(op), flows }
        };
        self.memo.borrow_mut().eval(&self.model.graph, node, leaf)
    }

    /// The value of `node` now if the states were these.
    pub fn eval_with(&self, node: NodeId, states: &[f64]) -> f64 {
        let Engine { time, params, locals, readings, .. } = self;
        self.model.graph.eval(node, Env { time: *time, states, params, locals, readings })
    }

    /// The model as it would be at another time in other states, where nothing moves.
    fn supposed(&self, time: f64, states: Vec<f64>) -> Self {
        let course = Course::new(states.len(), false, false);
        let memo = RefCell::new(Memo::new(&self.model.graph));
        Engine { time, states, course, memo, ..self.clone() }
    }

    /// The value of `node` now if the values of the plan were these.
    pub fn eval_kept(&self, node: NodeId, locals: &[f64]) -> f64 {
        self.model.graph.eval_on(node, |op| match op {
            Op::Local(i) => locals.get(i as usize).copied().unwrap_or(f64::NAN),
            other => self.leaf(other),
        })
    }

    /// The value of an operation without operands now.
    pub(crate) fn leaf(&self, op: Op) -> f64 {
        match op {
            Op::State(state) => self.state(state),
            other => {
                let Engine { time, params, locals, readings, .. } = self;
                Env { time: *time, states: &[], params, locals, readings }.leaf(other)
            }
        }
    }

    /// The value of an operation without operands at a time, s, since the states below it were last shown.
    pub(crate) fn leaf_at(&self, op: Op, time: f64) -> f64 {
        match op {
            Op::Time => time,
            Op::State(state) => {
                let passed = self.course.followed(state).map(|part| part.value_at(state, time));
                passed.unwrap_or_else(|| self.leaf(op))
            }
            other => self.leaf(other),
        }
    }

    /// Its bounds over a piece of that time.
    pub(crate) fn leaf_over(&self, op: Op, piece: Interval) -> Interval {
        match op {
            Op::Time => piece,
            Op::State(state) => {
                let passed = self.course.followed(state).map(|part| part.value_over(state, piece));
                passed.unwrap_or_else(|| (self.leaf(op), self.leaf(op)))
            }
            other => (self.leaf(other), self.leaf(other)),
        }
    }

    /// Whether an equality is true now that is true at this instant only.
    pub(crate) fn is_touching(&self) -> bool {
        !self.touches.is_empty()
    }

    /// Whether `node` is not 0 now.
    pub fn truth(&self, node: NodeId) -> bool {
        self.eval(node) != 0.0
    }

    /// Performs `actions` in order, then fires the events that became true. Fails on a transfer that cannot be made, a
    /// number that is not finite, a cascade without end or a balance that does not close.
    pub fn apply(&mut self, actions: &[Action], observer: &mut dyn Observer) -> Result<(), Fault> {
        self.release(observer)?;
        self.expose(actions, observer);
        for action in actions {
            self.perform(action, None, observer)?;
        }
        self.judge_instant(
            "this step",
            actions.first().map(|a| match a {
                Action::Assign { span, .. } | Action::Move { span, .. } => *span,
            }),
        )?;
        let last = actions.last().map(|a| match a {
            Action::Assign { span, .. } | Action::Move { span, .. } => *span,
        });
        self.settle(last, observer)
    }

    /// Some states are otherwise from now on, by what has come about outside the model; then the events fire that became true.
    pub fn put(&mut self, states: &[(u32, f64)], observer: &mut dyn Observer) -> Result<(), Fault> {
        self.release(observer)?;
        self.unshown.extend(states.iter().map(|(state, _)| *state));
        self.show(observer);
        states.iter().for_each(|(state, value)| self.write(*state, *value));
        self.settle(None, observer)
    }

    /// Takes the last sample, of all states, and checks that the balances close.
    pub fn finish(&mut self, observer: &mut dyn Observer) -> Result<(), Fault> {
        for part in self.course.parts.ids() {
            self.reach_now(part);
        }
        self.unshown.extend(0..self.states.len() as u32);
        self.show(observer);
        self.check_temperatures()?;
        self.check_balances(None)
    }

    /// How every balance stands.
    pub fn balances(&self) -> Vec<BalanceReport> {
        self.balances.report(self.model, &self.states(), |n| self.eval(n))
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// Shows the observer what it has not seen.
    fn show(&mut self, observer: &mut dyn Observer) {
        if self.unshown.is_empty() {
            return;
        }
        let mut changed = std::mem::take(&mut self.unshown);
        changed.sort_unstable();
        changed.dedup();
        self.unbalanced += changed.len();
        observer.sample(self.time, self, &changed);
    }

    /// Fails where one of these states is not finite.
    fn check_states(&self, states: &[u32]) -> Result<(), Fault> {
        let broken = states.iter().find(|state| !self.states[**state as usize].is_finite());
        broken.map_or(Ok(()), |&state| Err(self.no_value(state, self.states[state as usize])))
    }

    /// Fails where a sum does not close: at the law that breaks it, else at `cause`.
    fn check_balances(&self, cause: Option<matterix_ir::Span>) -> Result<(), Fault> {
        for (report, balance) in self.balances().iter().zip(&self.model.balances) {
            if !report.closes() {
                return Err(self.breach(report, balance, cause));
            }
        }
        Ok(())
    }
}
