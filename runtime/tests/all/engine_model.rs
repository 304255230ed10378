//! A small builder of models, and an observer that keeps everything.

use matterix_ir::model::{Action, Balance, Content, Derivative, Domain, Event, Mixture, Model, Process, State};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, FileId, NodeId, Op, Span, Unit};
use matterix_runtime::process::{Advance, Engine, Observer, Options, Watch};

/// Where each event, process and action stands: a state stands before them.
pub const EVENT: Span = Span { file: FileId(0), start: 1000, end: 1001 };
pub const PROCESS: Span = Span { file: FileId(0), start: 2000, end: 2001 };
pub const ACTION: Span = Span { file: FileId(0), start: 3000, end: 3001 };

/// A model under construction: short names for what tests write often.
#[derive(Default)]
pub struct Build {
    pub model: Model,
}

impl Build {
    pub fn num(&mut self, value: f64) -> NodeId {
        self.model.graph.number(value)
    }

    pub fn time(&mut self) -> NodeId {
        self.model.graph.add(Op::Time)
    }

    pub fn local(&mut self, index: u32) -> NodeId {
        self.model.graph.add(Op::Local(index))
    }

    /// A state with an initial value and a scale of 1; its index equals the number of states before it.
    pub fn state(&mut self, name: &str, initial: f64) -> NodeId {
        let initial = self.num(initial);
        let index = self.model.states.len() as u32;
        let domain = Domain::Quantity(Unit::one());
        let span = Span { start: index + 1, end: index + 2, ..Span::default() };
        self.model.states.push(State { name: name.into(), domain, initial, scale: Some(1.0), span });
        self.model.graph.add(Op::State(index))
    }

    pub fn op(&mut self, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
        self.model.graph.binary(op, a, b)
    }

    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Add, a, b)
    }

    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Sub, a, b)
    }

    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Mul, a, b)
    }

    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Div, a, b)
    }

    pub fn scale(&mut self, factor: f64, a: NodeId) -> NodeId {
        let factor = self.num(factor);
        self.mul(factor, a)
    }

    /// `a <= b`
    pub fn le(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Le, a, b)
    }

    /// `a < b`
    pub fn lt(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.op(BinaryOp::Lt, a, b)
    }

    /// `a >= value`
    pub fn at_least(&mut self, a: NodeId, value: f64) -> NodeId {
        let value = self.num(value);
        self.le(value, a)
    }

    /// `a <= value`
    pub fn at_most(&mut self, a: NodeId, value: f64) -> NodeId {
        let value = self.num(value);
        self.le(a, value)
    }

    /// `if condition { a } else { 0 }`
    pub fn only_if(&mut self, condition: NodeId, a: NodeId) -> NodeId {
        let zero = self.num(0.0);
        self.model.graph.select(condition, a, zero)
    }

    pub fn rate(&mut self, state: u32, rate: NodeId) {
        self.model.derivatives.push(Derivative::new(state, rate));
    }

    /// The rates of the first states, in their order.
    pub fn rates(&mut self, rates: &[NodeId]) {
        (0..).zip(rates).for_each(|(state, rate)| self.rate(state, *rate));
    }

    pub fn event(&mut self, name: &str, when: NodeId, actions: Vec<Action>) {
        self.model.events.push(Event { name: name.into(), when, actions, span: EVENT });
    }

    pub fn process(&mut self, name: &str, guard: Option<NodeId>) {
        self.model.processes.push(Process { name: name.into(), guard, span: PROCESS });
    }

    /// A mixture of amounts; `keys` are sorted pairs of key and state.
    pub fn mixture(&mut self, keys: &[(&str, u32)]) -> u32 {
        let contents = keys.iter().map(|k| Content { species: 0, state: k.1, settled: None }).collect();
        self.model.mixtures.push(Mixture {
            instance: InstanceId(0),
            extensive: keys.iter().map(|(k, s)| ((*k).to_string(), *s)).collect(),
            contents,
            properties: Vec::new(),
            concentrations: Vec::new(),
        });
        self.model.mixtures.len() as u32 - 1
    }

    /// A balance of `total`, judged against itself.
    pub fn balance(&mut self, name: &str, total: NodeId, exchanges: Vec<u32>) {
        let magnitude = self.model.graph.unary(matterix_ir::UnaryOp::Abs, total);
        self.model.balances.push(Balance {
            name: name.into(),
            total,
            exchanges,
            unit: Unit::one(),
            magnitude,
            terms: Vec::new(),
            doubts: Vec::new(),
        });
    }
}

/// `state = value`
pub fn assign(state: u32, value: NodeId) -> Action {
    Action::Assign { state, value, span: ACTION }
}

/// Everything that was observed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    pub samples: Vec<(f64, Vec<f64>)>,
    pub events: Vec<(f64, usize)>,
    pub processes: Vec<(f64, usize, bool)>,
}

impl Observer for Trace {
    fn sample(&mut self, time: f64, engine: &Engine<'_>, _: &[u32]) {
        assert_eq!(time, engine.time());
        self.samples.push((time, engine.states().to_vec()));
    }

    fn event(&mut self, time: f64, event: usize) {
        self.events.push((time, event));
    }

    fn process(&mut self, time: f64, process: usize, running: bool) {
        self.processes.push((time, process, running));
    }
}

impl Trace {
    /// When event `index` fired, s.
    pub fn times_of(&self, index: usize) -> Vec<f64> {
        self.events.iter().filter(|e| e.1 == index).map(|e| e.0).collect()
    }
}

/// An engine at time 0 with the parameters' own values.
pub fn engine(model: &Model) -> Engine<'_> {
    let params = model.params.iter().map(|p| p.value).collect();
    Engine::new(model, params, 4, Options::default()).expect("initial states are finite")
}

/// Runs from the start to `until`, s.
pub fn run(model: &Model, until: f64) -> (Engine<'_>, Trace) {
    let (mut engine, mut trace) = (engine(model), Trace::default());
    engine.start(&mut trace).expect("start");
    assert_eq!(engine.advance(until, &[], &mut trace).expect("advance"), Advance::Reached);
    engine.finish(&mut trace).expect("finish");
    (engine, trace)
}

/// Advances until `node` is true; the time when it became so, s.
pub fn until_true(engine: &mut Engine<'_>, node: NodeId, limit: f64) -> f64 {
    let watch = [Watch { node, value: true }];
    let end = engine.advance(limit, &watch, &mut ()).expect("advance");
    assert_eq!(end, Advance::Watch(vec![0]), "not reached by {limit} s");
    engine.time()
}

#[track_caller]
pub fn close(value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs(), "{value} is not {expected} to {relative}");
}
