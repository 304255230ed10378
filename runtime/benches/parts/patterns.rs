//! Parts whose states rest on each other in different ways.

use matterix_ir::model::{Action, Derivative, Domain, Event, Model, State};
use matterix_ir::{BinaryOp, NodeId, Op, Span, Unit};

/// What is followed: its name, the model of so many states, and until when, s.
pub type Case = (&'static str, fn(usize) -> Model, f64);

/// All of them.
pub const ALL: [Case; 7] = [
    ("chain", |n| conduction(n, &line(n), BEND), 1000.0),
    ("star", |n| conduction(n, &star(n), BEND), 1000.0),
    ("random", |n| conduction(n, &scattered(n), BEND), 1000.0),
    ("straight-chain", |n| conduction(n, &line(n), 0.0), 1000.0),
    ("straight-star", |n| conduction(n, &star(n), 0.0), 1000.0),
    ("network", network, 1000.0),
    ("holds", holds, 1000.0),
];

/// How much better what is warm conducts, per K.
const BEND: f64 = 1e-3;

/// Numbers between 0 and 1 that are the same in every run (Marsaglia 2003).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.roll() * n as f64) as usize
    }
}

fn state(model: &mut Model, initial: f64, scale: f64) -> NodeId {
    let initial = model.graph.number(initial);
    let index = model.states.len() as u32;
    let domain = Domain::Quantity(Unit::one());
    let span = Span { start: index + 1, end: index + 2, ..Span::default() };
    model.states.push(State { name: format!("x{index}"), domain, initial, scale: Some(scale), span });
    model.graph.add(Op::State(index))
}

fn times(model: &mut Model, factor: f64, a: NodeId) -> NodeId {
    let factor = model.graph.number(factor);
    model.graph.binary(BinaryOp::Mul, factor, a)
}

fn op(model: &mut Model, op: BinaryOp, a: NodeId, b: NodeId) -> NodeId {
    model.graph.binary(op, a, b)
}

fn sum(model: &mut Model, terms: &[NodeId]) -> NodeId {
    let zero = model.graph.number(0.0);
    terms.iter().fold(zero, |sum, term| model.graph.binary(BinaryOp::Add, sum, *term))
}

fn line(n: usize) -> Vec<(usize, usize)> {
    (1..n).map(|i| (i - 1, i)).collect()
}

fn star(n: usize) -> Vec<(usize, usize)> {
    (1..n).map(|i| (0, i)).collect()
}

/// Four neighbours each, two of them chosen by lot.
fn scattered(n: usize) -> Vec<(usize, usize)> {
    let mut dice = Dice(88_172_645_463_325_252);
    let mut pairs = line(n);
    pairs.extend((0..n).map(|i| (i, dice.below(n))).filter(|(a, b)| a != b));
    pairs
}

/// Temperatures (K) of bodies of which some touch, which conduct better the warmer they are by `bend`, per K.
fn conduction(n: usize, pairs: &[(usize, usize)], bend: f64) -> Model {
    let mut model = Model::default();
    let mut dice = Dice(7);
    let bodies: Vec<NodeId> = (0..n).map(|_| state(&mut model, 300.0 + 50.0 * dice.roll(), 1.0)).collect();
    let mut flows = vec![Vec::new(); n];
    for &(a, b) in pairs {
        let difference = op(&mut model, BinaryOp::Sub, bodies[a], bodies[b]);
        let mut flow = times(&mut model, 0.05 * (0.5 + dice.roll()), difference);
        if bend > 0.0 {
            let warmth = times(&mut model, bend, bodies[a]);
            flow = op(&mut model, BinaryOp::Mul, flow, warmth);
        }
        let back = times(&mut model, -1.0, flow);
        flows[a].push(back);
        flows[b].push(flow);
    }
    for (i, flows) in flows.into_iter().enumerate() {
        let rate = sum(&mut model, &flows);
        let rate = times(&mut model, if i == 0 { 0.5 } else { 1.0 }, rate);
        model.derivatives.push(Derivative::new(i as u32, rate));
    }
    model
}

/// As many species as asked for in one solution, and twice as many reactions of two of them to two others.
fn network(n: usize) -> Model {
    let mut model = Model::default();
    let mut dice = Dice(99);
    let amounts: Vec<NodeId> = (0..n).map(|_| state(&mut model, 1e-3 * dice.roll(), 1e-3)).collect();
    let volumes: Vec<NodeId> = amounts.iter().map(|a| times(&mut model, 1e-4 * (0.5 + dice.roll()), *a)).collect();
    let solvent = model.graph.number(1e-3);
    let solutes = sum(&mut model, &volumes);
    let volume = op(&mut model, BinaryOp::Add, solvent, solutes);
    let parts: Vec<NodeId> = amounts.iter().map(|a| op(&mut model, BinaryOp::Div, *a, volume)).collect();
    let mut rates = vec![Vec::new(); n];
    for _ in 0..2 * n {
        let [a, b, c, d] = std::array::from_fn(|_| dice.below(n));
        let product = op(&mut model, BinaryOp::Mul, parts[a], parts[b]);
        let speed = times(&mut model, 10f64.powf(4.0 * dice.roll() - 5.0), product);
        let rate = op(&mut model, BinaryOp::Mul, speed, volume);
        let back = times(&mut model, -1.0, rate);
        [(a, back), (b, back), (c, rate), (d, rate)].into_iter().for_each(|(i, rate)| rates[i].push(rate));
    }
    for (i, rates) in rates.into_iter().enumerate() {
        let rate = sum(&mut model, &rates);
        model.derivatives.push(Derivative::new(i as u32, rate));
    }
    model
}

/// Vessels on one block that is held at another temperature every 10 s.
fn holds(n: usize) -> Model {
    let mut model = conduction(n, &star(n), BEND);
    let set = state(&mut model, 300.0, 1.0);
    let next = state(&mut model, 10.0, 1.0);
    let block = model.graph.add(Op::State(0));
    let difference = op(&mut model, BinaryOp::Sub, set, block);
    let power = times(&mut model, 0.3, difference);
    let passive = model.derivatives[0].rate;
    let heated = op(&mut model, BinaryOp::Add, passive, power);
    model.derivatives[0].rate = heated;
    let time = model.graph.add(Op::Time);
    let due = op(&mut model, BinaryOp::Le, next, time);
    let (ten, half) = (model.graph.number(10.0), model.graph.number(0.5));
    let (later, warmer) = (op(&mut model, BinaryOp::Add, next, ten), op(&mut model, BinaryOp::Add, set, half));
    let assign = |state, value| Action::Assign { state, value, span: Span::default() };
    let actions = vec![assign(n as u32, warmer), assign(n as u32 + 1, later)];
    model.events.push(Event { name: "hold".into(), when: due, actions, span: Span::default() });
    model
}
