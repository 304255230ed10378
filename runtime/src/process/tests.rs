//! The tape against the graph's own evaluator, and its tangent against differences.

use std::collections::BTreeSet;

use matterix_ir::graph::Env;
use matterix_ir::{BinaryOp, Graph, NodeId, Op, UnaryOp};
use proptest::prelude::*;

use super::analysis::Facts;
use super::dense::Dense;
use super::index::users;
use super::memo::{Leaf, Memo};
use super::mode::{PartsBelow, Together, Walk, groups};
use super::tangent;

const STATES: usize = 4;

/// Operations that only refer to earlier ones; indices are taken modulo what is there.
fn graph(smooth: bool) -> impl Strategy<Value = (Graph, Vec<NodeId>)> {
    let step = (0..if smooth { 12u8 } else { 24 }, any::<(u32, u32, u32)>(), -3.0..3.0f64);
    prop::collection::vec(step, 1..60).prop_map(|steps| {
        let mut graph = Graph::default();
        let mut nodes: Vec<NodeId> = (0..STATES as u32).map(|s| graph.add(Op::State(s))).collect();
        nodes.push(graph.add(Op::Time));
        nodes.push(graph.add(Op::Param(0)));
        nodes.push(graph.add(Op::Local(0)));
        nodes.push(graph.add(Op::Reading(0)));
        for (kind, (a, b, c), value) in steps {
            let at = |i: u32| nodes[i as usize % nodes.len()];
            let op = operation(kind, (at(a), at(b), at(c)), value);
            nodes.push(graph.add(op));
        }
        (graph, nodes)
    })
}

fn operation(kind: u8, (a, b, c): (NodeId, NodeId, NodeId), value: f64) -> Op {
    use BinaryOp::*;
    use UnaryOp::*;
    match kind {
        0 => Op::Const(value),
        1 => Op::Const(value.round()),
        2..=3 => Op::Binary(Add, a, b),
        4..=5 => Op::Binary(Sub, a, b),
        6..=7 => Op::Binary(Mul, a, b),
        8 => Op::Unary(Sin, a),
        9 => Op::Unary(Neg, a),
        10 => Op::Unary(Cos, a),
        11 => Op::Binary(Div, a, b),
        12 => Op::Binary(Pow, a, b),
        13 => Op::Binary(Min, a, b),
        14 => Op::Binary(Max, a, b),
        15 => Op::Binary(Lt, a, b),
        16 => Op::Binary(Le, a, b),
        17 => Op::Binary(Eq, a, b),
        18 => Op::Binary(And, a, b),
        19 => Op::Binary(Or, a, b),
        20 => Op::Unary(Not, a),
        21 => Op::Unary(Abs, a),
        22 => Op::Unary(Exp, a),
        23 => Op::Unary(Atan, a),
        _ => Op::Select(a, b, c),
    }
}

fn states() -> impl Strategy<Value = [f64; STATES]> {
    prop::array::uniform4(prop_oneof![Just(0.0), Just(1.0), -4.0..4.0f64])
}

fn env<'a>(time: f64, states: &'a [f64], others: &'a [f64; 1]) -> Env<'a> {
    Env { time, states, params: others, locals: others, readings: others }
}

proptest! {
    /// At the instant of the analysis, whichever states are said to move.
    #[test]
    fn a_tape_computes_what_the_graph_means(
        (graph, nodes) in graph(false),
        states in states(),
        marked in prop::array::uniform4(any::<bool>()),
        time in 0.0..10.0f64,
    ) {
        let env = env(time, &states, &[0.7]);
        let mut facts = Facts::new(&graph);
        facts.begin();
        facts.look(&graph, nodes.iter().copied(), |op| env.leaf(op), &marked);
        let analysis = facts.of(&graph);
        let moving: Vec<u32> = (0..STATES as u32).filter(|&s| marked[s as usize]).collect();
        let values: Vec<f64> = moving.iter().map(|&s| states[s as usize]).collect();
        let tape = analysis.tape(&nodes, &moving);
        let mut registers = tape.registers();
        tape.run(time, &values, &mut registers);
        let mut memo = Memo::new(&graph);
        let mut all = Vec::new();
        graph.eval_all(env, &mut all);
        // an infinite number times one that is 0 throughout is 0 on the tape
        prop_assume!(all.iter().all(|v| v.is_finite()));
        for (i, &node) in nodes.iter().enumerate() {
            let expected = graph.eval(node, env);
            prop_assert_eq!(registers[tape.outputs[i] as usize], expected);
            prop_assert_eq!(memo.eval(&graph, node, |op| Leaf { value: env.leaf(op), flows: false }), expected);
            prop_assert_eq!(analysis.now(node), expected);
        }
    }

    /// What a walk that comes by each operation once finds together is what all states below each rate are.
    #[test]
    fn a_walk_finds_what_moves_together(
        (graph, nodes) in graph(false),
        states in states(),
        marked in prop::array::uniform4(any::<bool>()),
        picks in prop::collection::vec(any::<prop::sample::Index>(), STATES),
        part_of in prop::array::uniform4(0..2u32),
    ) {
        let env = env(1.5, &states, &[0.7]);
        let mut facts = Facts::new(&graph);
        facts.begin();
        facts.look(&graph, nodes.iter().copied(), |op| env.leaf(op), &marked);
        let analysis = facts.of(&graph);
        let rates: Vec<NodeId> = picks.iter().map(|pick| *pick.get(&nodes)).collect();
        let (mut walk, mut short, mut long) = (Walk::default(), Together::default(), Together::default());
        for (state, &rate) in (0..).zip(&rates) {
            for (together, others) in
                [(&mut short, walk.from(analysis, rate)), (&mut long, analysis.states_below(&[rate]))]
            {
                together.add(state);
                for other in others {
                    together.add(other);
                    together.join(state, other);
                }
            }
        }
        prop_assert_eq!(short.into_lists(), long.into_lists());
        let mut below = PartsBelow::default();
        for (parts, compared) in groups(analysis, &nodes, &part_of, &mut below) {
            for node in compared {
                let sides: Vec<NodeId> = graph.op(node).operands().collect();
                let states = analysis.states_below(&sides);
                let plain: BTreeSet<u32> = states.iter().map(|s| part_of[*s as usize]).collect();
                prop_assert_eq!(&parts, &plain.into_iter().collect::<Vec<u32>>());
            }
        }
    }

    #[test]
    fn a_tangent_is_the_slope(
        (graph, nodes) in graph(true),
        states in prop::array::uniform4(0.5..2.0f64),
        direction in prop::array::uniform4(-1.0..1.0f64),
    ) {
        let env = env(1.5, &states, &[0.7]);
        let mut facts = Facts::new(&graph);
        facts.begin();
        facts.look(&graph, nodes.iter().copied(), |op| env.leaf(op), &[true; STATES]);
        let tape = facts.of(&graph).tape(&nodes, &[0, 1, 2, 3]);
        let run = |shift: f64| {
            let at: Vec<f64> = states.iter().zip(direction).map(|(s, d)| s + shift * d).collect();
            let mut registers = tape.registers();
            tape.run(1.5, &at, &mut registers);
            registers
        };
        let registers = run(0.0);
        let mut tangents = registers.clone();
        tangent::push(&tape, &registers, &direction, &mut tangents);
        let h = 1e-4;
        let far = [run(-2.0 * h), run(-h), run(h), run(2.0 * h)];
        prop_assume!(far.iter().flatten().all(|v| v.abs() < 1e3));
        for &output in &tape.outputs {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| far[i][output as usize]);
            let (fine, coarse) = ((c - b) / (2.0 * h), (d - a) / (4.0 * h));
            let slope = tangents[output as usize];
            // where the two differences disagree the function is too curved to judge by them
            prop_assume!((fine - coarse).abs() < 1e-4 * (1.0 + fine.abs()));
            prop_assert!((slope - fine).abs() < 1e-3 * (1.0 + fine.abs()), "{} is not {}", slope, fine);
        }
    }

    /// Whichever leaves change, one after the other.
    #[test]
    fn a_memo_forgets_what_rests_on_a_change(
        (graph, nodes) in graph(false),
        first in states(),
        changes in prop::collection::vec((0..STATES, -4.0..4.0f64), 1..6),
    ) {
        let mut states = first;
        let users = users(&graph);
        let mut memo = Memo::new(&graph);
        for (state, value) in changes {
            for &node in &nodes {
                let found = memo.eval(&graph, node, |op| Leaf { value: env(1.0, &states, &[0.7]).leaf(op), flows: false });
                prop_assert_eq!(found.to_bits(), graph.eval(node, env(1.0, &states, &[0.7])).to_bits());
            }
            states[state] = value;
            let is_it = |n: &&NodeId| graph.op(**n) == Op::State(state as u32);
            nodes.iter().filter(is_it).for_each(|leaf| memo.change(&users, *leaf));
        }
    }

    /// What is looked at in part, where something has changed, is the same as all of it looked at from the beginning.
    #[test]
    fn facts_of_what_changed_are_facts_of_all(
        (graph, nodes) in graph(false),
        first in states(),
        changes in prop::collection::vec((0..STATES, -4.0..4.0f64, any::<bool>()), 1..6),
    ) {
        let users = users(&graph);
        let above = |seed: NodeId| {
            let (mut todo, mut found) = (vec![seed], std::collections::BTreeSet::new());
            while let Some(node) = todo.pop() {
                if found.insert(node) {
                    todo.extend(users.at(node.0 as usize));
                }
            }
            found
        };
        let (mut states, mut moving, mut facts) = (first, [true, false, true, false], Facts::new(&graph));
        facts.begin();
        facts.look(&graph, nodes.iter().copied(), |op| env(1.0, &states, &[0.7]).leaf(op), &moving);
        for (state, value, moves) in changes {
            states[state] = value;
            moving[state] = moves;
            facts.begin();
            let leaf = graph.schedule(nodes.iter().copied()).into_iter().find(|n| graph.op(*n) == Op::State(state as u32));
            let concerned: Vec<NodeId> = leaf.map(above).into_iter().flatten().filter(|n| nodes.contains(n)).collect();
            facts.look(&graph, concerned.into_iter(), |op| env(1.0, &states, &[0.7]).leaf(op), &moving);
            let mut anew = Facts::new(&graph);
            anew.begin();
            anew.look(&graph, nodes.iter().copied(), |op| env(1.0, &states, &[0.7]).leaf(op), &moving);
            let (part, all) = (facts.of(&graph), anew.of(&graph));
            for &node in &nodes {
                prop_assert_eq!(part.varies(node), all.varies(node));
                if !all.varies(node) {
                    prop_assert_eq!(part.now(node).to_bits(), all.now(node).to_bits());
                }
            }
        }
    }

    /// A polynomial of the fifth degree is reproduced.
    #[test]
    fn dense_output_is_a_polynomial(coefficients in prop::array::uniform6(-1.0..1.0f64), place in 0.0..=1.0f64) {
        let f = |t: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * (t - 10.0) + c);
        let mut dense = Dense::still(9.5, &[f(9.5)]);
        let done: Result<(), ()> = dense.extend(1.5, |time, out| {
            out[0] = f(9.5 + time);
            Ok(())
        });
        prop_assert_eq!(done, Ok(()));
        let (time, mut out) = (1.5 * place, [0.0]);
        dense.at(time, &mut out);
        prop_assert!((out[0] - f(9.5 + time)).abs() < 1e-12);
        dense.restart();
        dense.at(0.0, &mut out);
        prop_assert_eq!(dense.clock.lab(0.0), 11.0);
        prop_assert!((out[0] - f(11.0)).abs() < 1e-12);
    }
}

fn slope_of(op: impl Fn(&mut Graph, NodeId, NodeId) -> NodeId, x: f64, y: f64) -> (f64, f64) {
    let mut graph = Graph::default();
    let (a, b) = (graph.add(Op::State(0)), graph.add(Op::State(1)));
    let node = op(&mut graph, a, b);
    let states = [x, y];
    let mut facts = Facts::new(&graph);
    facts.begin();
    facts.look(&graph, std::iter::once(node), |op| env(0.0, &states, &[0.0]).leaf(op), &[true, true]);
    let tape = facts.of(&graph).tape(&[node], &[0, 1]);
    let mut registers = tape.registers();
    tape.run(0.0, &states, &mut registers);
    let mut tangents = registers.clone();
    let mut slope = |direction: [f64; 2]| {
        tangent::push(&tape, &registers, &direction, &mut tangents);
        tangents[tape.outputs[0] as usize]
    };
    (slope([1.0, 0.0]), slope([0.0, 1.0]))
}

#[test]
fn slopes_of_the_other_operations() {
    let near = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12;
    let unary = |op| slope_of(move |g, a, _| g.unary(op, a), 2.0, 0.0);
    assert!(near(unary(UnaryOp::Exp), (2f64.exp(), 0.0)));
    assert!(near(unary(UnaryOp::Ln), (0.5, 0.0)));
    assert!(near(unary(UnaryOp::Sqrt), (0.5 / 2f64.sqrt(), 0.0)));
    assert!(near(unary(UnaryOp::Abs), (1.0, 0.0)));
    assert!(near(unary(UnaryOp::Floor), (0.0, 0.0)));
    let binary = |op, x, y| slope_of(move |g, a, b| g.binary(op, a, b), x, y);
    assert!(near(binary(BinaryOp::Pow, 2.0, 3.5), (3.5 * 2f64.powf(2.5), 2f64.powf(3.5) * 2f64.ln())));
    assert!(near(binary(BinaryOp::Min, 2.0, 3.0), (1.0, 0.0)));
    assert!(near(binary(BinaryOp::Max, 2.0, 3.0), (0.0, 1.0)));
    let square = slope_of(
        |g, a, _| {
            let two = g.number(2.0);
            g.binary(BinaryOp::Pow, a, two)
        },
        -3.0,
        0.0,
    );
    assert!(near(square, (-6.0, 0.0)));
}
