//! Segments: what is integrated, how often it starts anew, what is sampled.

// A test may look at the clock; a run may not.
#![allow(clippy::disallowed_methods)]

use std::time::Instant;

use crate::engine_model::{Build, Trace, assign, engine, run, until_true};

fn cooling() -> Build {
    let mut b = Build::default();
    let (t, on) = (b.state("T", 360.0), b.state("on", 0.0));
    let ambient = b.num(298.15);
    let gap = b.sub(ambient, t);
    let loss = b.scale(0.004, gap);
    let one = b.num(1.0);
    let heating = b.only_if(on, one);
    let rate = b.add(loss, heating);
    b.rate(0, rate);
    b
}

#[test]
fn looking_often_changes_nothing() {
    let b = cooling();
    let (whole, whole_trace) = run(&b.model, 100.0);
    let (mut engine, mut trace) = (engine(&b.model), Trace::default());
    engine.start(&mut trace).expect("start");
    for tick in 1..=10_000 {
        engine.advance(f64::from(tick) * 0.01, &[], &mut trace).expect("advance");
    }
    engine.finish(&mut trace).expect("finish");
    assert!((engine.states()[0] - whole.states()[0]).abs() < 1e-6 * 360.0);
    assert!(trace.samples.len() <= whole_trace.samples.len() + 30, "{} samples", trace.samples.len());
}

#[test]
fn nothing_moves() {
    let mut b = Build::default();
    let (x, on) = (b.state("x", 1.0), b.state("on", 0.0));
    let decay = b.scale(-1.0, x);
    let rate = b.only_if(on, decay);
    b.rate(0, rate);
    b.process("decay", Some(on));
    let time = b.time();
    let late = b.at_least(time, 5e8);
    let one = b.num(1.0);
    b.event("on", late, vec![assign(1, one)]);
    let begin = Instant::now();
    let (engine, trace) = run(&b.model, 5e8 + 1.0);
    assert!(begin.elapsed().as_millis() < 1000);
    assert!((engine.states()[0] - (-1f64).exp()).abs() < 1e-7);
    assert_eq!(trace.events, [(5e8, 0)]);
    assert_eq!(trace.processes, [(5e8, 0, true)]);
}

#[test]
fn an_assignment_starts_anew_and_is_sampled_on_both_sides() {
    let mut b = cooling();
    let one = b.num(1.0);
    let (mut engine, mut trace) = (engine(&b.model), Trace::default());
    engine.start(&mut trace).expect("start");
    engine.advance(10.0, &[], &mut trace).expect("advance");
    engine.apply(&[assign(1, one)], &mut trace).expect("apply");
    let at: Vec<f64> = trace.samples.iter().filter(|s| s.0 == 10.0).map(|s| s.1[1]).collect();
    assert_eq!(at, [0.0, 1.0]);
    engine.advance(5000.0, &[], &mut trace).expect("advance");
    assert!((engine.states()[0] - (298.15 + 250.0)).abs() < 1e-5);
    assert!(trace.samples.windows(2).all(|w| w[0].0 <= w[1].0), "samples are in order");
}

#[test]
fn an_event_without_effect_does_not_disturb() {
    let mut b = cooling();
    let t = b.model.graph.add(matterix_ir::Op::State(0));
    let quiet = run(&b.model, 1000.0).1.samples.len();
    for limit in [350.0, 340.0, 330.0, 320.0, 310.0] {
        let below = b.at_most(t, limit);
        b.event("below", below, vec![]);
    }
    let (_, trace) = run(&b.model, 1000.0);
    assert_eq!(trace.events.len(), 5);
    assert!(trace.samples.len() <= quiet + 12, "{} samples instead of {quiet}", trace.samples.len());
}

/// A law with a kink at a threshold: the segment ends exactly there, so that the result stays accurate.
#[test]
fn a_law_that_changes_at_a_threshold() {
    let mut b = Build::default();
    let x = b.state("x", 2.0);
    let one = b.num(1.0);
    let above = b.lt(one, x);
    let (fast, slow) = (b.scale(-1.0, x), b.scale(-0.1, x));
    let rate = b.model.graph.select(above, fast, slow);
    b.rate(0, rate);
    b.process("fast", Some(above));
    let (engine, trace) = run(&b.model, 3.0);
    let expected = (-0.1 * (3.0 - 2f64.ln())).exp();
    assert!((engine.states()[0] - expected).abs() < 1e-7);
    assert_eq!(trace.processes.len(), 2);
    assert!((trace.processes[1].0 - 2f64.ln()).abs() < 1e-7);
}

#[test]
fn two_runs_are_equal_to_the_bit() {
    let b = cooling();
    let (a, first) = run(&b.model, 2000.0);
    let (c, second) = run(&b.model, 2000.0);
    assert_eq!(first, second);
    assert_eq!(a.states()[0].to_bits(), c.states()[0].to_bits());
}

#[test]
fn a_condition_on_time_alone_is_found_while_nothing_moves() {
    let mut b = Build::default();
    let time = b.time();
    let wave = b.scale(0.01, time);
    let wave = b.model.graph.unary(matterix_ir::UnaryOp::Sin, wave);
    let high = b.at_least(wave, 0.5);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    let when = until_true(&mut engine, high, 1000.0);
    assert!((when - 100.0 * 0.5f64.asin()).abs() < 1e-9);
}
