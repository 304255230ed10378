//! The same laws at every size, without a declared scale: from traces to heaps.

use matterix_ir::{NodeId, UnaryOp};

use crate::engine_model::{Build, close, run};

const ACCURACY: f64 = 1e-6;

/// Units in which a state of the size of 1 is counted.
const UNITS: [f64; 9] = [1e-20, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6];

/// A model whose states declare no scale.
fn undeclared(mut build: Build) -> Build {
    build.model.states.iter_mut().for_each(|state| state.scale = None);
    build
}

/// Three states, of which the first holds all; the first two.
fn three(b: &mut Build, unit: f64) -> (NodeId, NodeId) {
    let two = (b.state("a", unit), b.state("b", 0.0));
    b.state("c", 0.0);
    two
}

#[test]
fn a_chain_of_decays() {
    for unit in UNITS {
        let mut b = Build::default();
        let (x, y) = three(&mut b, unit);
        let (first, second) = (b.scale(0.01, x), b.scale(0.02, y));
        let (lost, between) = (b.scale(-1.0, first), b.sub(first, second));
        b.rates(&[lost, between, second]);
        let b = undeclared(b);
        for t in [1e-3, 1.0, 300.0, 1500.0] {
            let (engine, _) = run(&b.model, t);
            let states = engine.states();
            let (a, middle) = ((-0.01 * t).exp(), (-0.01 * t).exp() - (-0.02 * t).exp());
            close(states[0], a * unit, ACCURACY);
            close(states[1], middle * unit, ACCURACY);
            let last = -(-0.01 * t).exp_m1() - middle;
            let early = if t < 0.1 { 1e-3 } else { ACCURACY };
            close(states[2], last * unit, early.max(1e-15 / last));
        }
    }
}

#[test]
fn an_oscillation() {
    for unit in UNITS {
        let mut b = Build::default();
        let (x, v) = (b.state("x", unit), b.state("v", 0.0));
        let back = b.scale(-1.0, x);
        b.rates(&[v, back]);
        let b = undeclared(b);
        let (engine, _) = run(&b.model, 60.0);
        assert!((engine.states()[0] / unit - 60.0_f64.cos()).abs() < 1e-5, "{unit}: {:?}", engine.states());
        assert!((engine.states()[1] / unit + 60.0_f64.sin()).abs() < 1e-5, "{unit}: {:?}", engine.states());
    }
}

#[test]
fn growth_from_a_trace() {
    for unit in [1e-20, -1e-20, 1e-10, 1.0] {
        let mut b = Build::default();
        let x = b.state("x", unit);
        b.rates(&[x]);
        let b = undeclared(b);
        let (engine, _) = run(&b.model, 60.0);
        close(engine.states()[0], unit * 60.0_f64.exp(), 1e-5);
    }
}

#[test]
fn a_tiny_feed_into_nothing() {
    for unit in UNITS {
        // x' = unit (1 + sin t), y' = x: both begin at nothing.
        let mut b = Build::default();
        let x = b.state("x", 0.0);
        b.state("y", 0.0);
        let time = b.time();
        let wave = b.model.graph.unary(UnaryOp::Sin, time);
        let one = b.num(1.0);
        let sum = b.add(one, wave);
        let rate = b.scale(unit, sum);
        b.rates(&[rate, x]);
        let b = undeclared(b);
        let (engine, _) = run(&b.model, 20.0);
        close(engine.states()[0], unit * (21.0 - 20.0_f64.cos()), ACCURACY);
        close(engine.states()[1], unit * (20.0 + 200.0 - 20.0_f64.sin()), ACCURACY);
    }
}

#[test]
fn two_sizes_in_one_system() {
    // A trace that grows beside a heap that decays, and feeds on it.
    let mut b = Build::default();
    let (heap, trace) = (b.state("heap", 1e3), b.state("trace", 1e-15));
    let lost = b.scale(-0.1, heap);
    let product = b.mul(heap, trace);
    let grown = b.scale(1e-3, product);
    b.rates(&[lost, grown]);
    let b = undeclared(b);
    let (engine, _) = run(&b.model, 50.0);
    close(engine.states()[0], 1e3 * (-5.0_f64).exp(), ACCURACY);
    close(engine.states()[1], 1e-15 * (10.0 * (1.0 - (-5.0_f64).exp())).exp(), ACCURACY);
}

#[test]
fn a_fast_equilibrium_of_traces() {
    // a <-> b at 1e9 and 3e9 per s, and b -> c at 0.05 per s.
    for unit in [1e-18, 1e-9, 1.0] {
        let mut b = Build::default();
        let (x, y) = three(&mut b, unit);
        let (there, back, on) = (b.scale(1e9, x), b.scale(3e9, y), b.scale(0.05, y));
        let (first, last) = (b.sub(back, there), b.sub(there, back));
        let middle = b.sub(last, on);
        b.rates(&[first, middle, on]);
        let b = undeclared(b);
        let (engine, _) = run(&b.model, 100.0);
        let left = (-0.0125 * 100.0_f64).exp();
        close(engine.states()[0], 0.75 * left * unit, ACCURACY);
        close(engine.states()[2], (1.0 - left) * unit, ACCURACY);
    }
}

#[test]
fn rounding_of_large_numbers_does_not_hold_up_a_small_state() {
    // The integral of a difference that is nothing but rounding: a controller at its set point.
    let mut b = Build::default();
    let (warm, slow) = (b.state("integral", 0.0), b.state("warmth", 0.0));
    let (base, tenth) = (b.num(298.15), b.scale(1e-3, slow));
    let there = b.add(base, tenth);
    let error = b.sub(there, base);
    let drift = b.scale(-1e-3, slow);
    let (feed, pull) = (b.num(1e-9), b.scale(-1e-6, warm));
    let rate = b.add(error, pull);
    let warming = b.add(drift, feed);
    b.rates(&[rate, warming]);
    let b = undeclared(b);
    let (engine, trace) = run(&b.model, 3600.0);
    assert!(engine.states()[0].abs() < 1e-5);
    assert!(trace.samples.len() < 2000, "{}", trace.samples.len());
}
