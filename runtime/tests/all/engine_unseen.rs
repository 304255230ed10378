//! What lasts a short time is not stepped over: pulses, and conditions that hold for a moment only.

use std::f64::consts::TAU;

use matterix_ir::{BinaryOp, NodeId, UnaryOp};

use crate::engine_model::{Build, assign, close, run};

fn sine(b: &mut Build, of: NodeId, period: f64) -> NodeId {
    let turns = b.scale(TAU / period, of);
    b.model.graph.unary(UnaryOp::Sin, turns)
}

/// `exp(-((x - at) / width)^2)`
fn pulse(b: &mut Build, x: NodeId, at: f64, width: f64) -> NodeId {
    let at = b.num(at);
    let from = b.sub(x, at);
    let place = b.scale(1.0 / width, from);
    let two = b.num(2.0);
    let square = b.op(BinaryOp::Pow, place, two);
    let less = b.scale(-1.0, square);
    b.model.graph.unary(UnaryOp::Exp, less)
}

/// A state that counts how often an event comes about, and the event.
fn count(b: &mut Build, when: NodeId) {
    let n = b.state("n", 0.0);
    let index = b.model.states.len() as u32 - 1;
    let one = b.num(1.0);
    let more = b.add(n, one);
    b.event("counted", when, vec![assign(index, more)]);
}

#[test]
fn an_event_that_a_wave_makes_true_for_a_moment() {
    for clock in [true, false] {
        let mut b = Build::default();
        let x = b.state("x", 0.0);
        let one = b.num(1.0);
        b.rate(0, one);
        let of = if clock { b.time() } else { x };
        let wave = sine(&mut b, of, 10.0);
        let when = b.at_least(wave, 0.9999);
        count(&mut b, when);
        assert_eq!(run(&b.model, 1000.0).0.states()[1], 100.0, "{clock}");
    }
}

#[test]
fn an_event_of_the_clock_where_nothing_moves() {
    let mut b = Build::default();
    let time = b.time();
    let wave = sine(&mut b, time, 60.0);
    let when = b.at_least(wave, 0.999_999);
    count(&mut b, when);
    assert_eq!(run(&b.model, 6000.0).0.states()[0], 100.0);
}

#[test]
fn a_square_that_is_small_for_a_moment() {
    let mut b = Build::default();
    let x = b.state("x", -5.0);
    let rate = b.num(1e-3);
    b.rate(0, rate);
    let square = b.mul(x, x);
    let when = b.at_most(square, 1e-10);
    count(&mut b, when);
    assert_eq!(run(&b.model, 10_000.0).0.states()[1], 1.0);
}

#[test]
fn a_law_that_a_wave_lets_act_for_moments() {
    let mut b = Build::default();
    b.state("y", 0.0);
    let time = b.time();
    let wave = b.model.graph.unary(UnaryOp::Sin, time);
    let level = b.num(0.999);
    let high = b.lt(level, wave);
    let one = b.num(1.0);
    let rate = b.only_if(high, one);
    b.rate(0, rate);
    // 159 crests in 1000 s, each 2 arccos(0.999) long.
    let expected = 159.0 * 2.0 * 0.999_f64.acos();
    close(run(&b.model, 1000.0).0.states()[0], expected, 1e-6);
}

#[test]
fn a_pulse_long_after_the_start() {
    for (clock, width) in [(true, 60.0), (false, 60.0), (true, 0.01), (false, 1e-3)] {
        let mut b = Build::default();
        let x = b.state("x", 0.0);
        b.state("y", 0.0);
        let one = b.num(1.0);
        b.rate(0, one);
        let of = if clock { b.time() } else { x };
        let rate = pulse(&mut b, of, 10_000.0, width);
        b.rate(1, rate);
        let (engine, trace) = run(&b.model, 21_600.0);
        close(engine.states()[1], width * std::f64::consts::PI.sqrt(), 1e-5);
        assert!(trace.samples.len() < 2000, "{}", trace.samples.len());
    }
}

#[test]
fn pulses_of_a_wave() {
    // (1 + sin t)^200 over its mean: a pulse in every turn.
    let mut b = Build::default();
    b.state("y", 0.0);
    let time = b.time();
    let wave = sine(&mut b, time, 100.0);
    let (one, half, power) = (b.num(1.0), b.num(0.5), b.num(200.0));
    let sum = b.add(one, wave);
    let share = b.mul(half, sum);
    let rate = b.op(BinaryOp::Pow, share, power);
    b.rate(0, rate);
    // The mean of ((1 + sin t) / 2)^n is (2n)! / (4^n n!^2).
    let mean: f64 = (1..=200).map(|k| (2.0 * f64::from(k) - 1.0) / (2.0 * f64::from(k))).product();
    close(run(&b.model, 5000.0).0.states()[0], 5000.0 * mean, 1e-6);
}
