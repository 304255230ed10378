//! Events: where, how often, in what order.

use matterix_ir::BinaryOp;
use matterix_runtime::process::{Advance, Watch};

use crate::engine_model::{Build, Trace, assign, engine, run, until_true};

/// A heater that switches on below 38 and off above 42, relaxing to 50 or 20 with a time constant of 100 s.
#[test]
fn thermostat_switches_at_the_analytic_times() {
    let mut b = Build::default();
    let (t, on) = (b.state("T", 20.0), b.state("on", 1.0));
    let (hot, cold) = (b.num(50.0), b.num(20.0));
    let goal = b.model.graph.select(on, hot, cold);
    let gap = b.sub(goal, t);
    let rate = b.scale(0.01, gap);
    b.rate(0, rate);
    let (one, zero) = (b.num(1.0), b.num(0.0));
    let (high, low) = (b.at_least(t, 42.0), b.at_most(t, 38.0));
    b.event("off", high, vec![assign(1, zero)]);
    b.event("on", low, vec![assign(1, one)]);
    b.process("heating", Some(on));
    let (_, trace) = run(&b.model, 600.0);

    let first = 100.0 * (30.0f64 / 8.0).ln();
    let (down, up) = (100.0 * (22.0f64 / 18.0).ln(), 100.0 * (12.0f64 / 8.0).ln());
    let off = trace.times_of(0);
    assert!(off.len() >= 6);
    for (i, time) in off.iter().enumerate() {
        assert!((time - (first + i as f64 * (down + up))).abs() < 1e-5, "off at {time}");
    }
    // true at the start counts as becoming true
    let on = trace.times_of(1);
    assert_eq!(on[0], 0.0);
    for (i, time) in on[1..].iter().enumerate() {
        assert!((time - (first + down + i as f64 * (down + up))).abs() < 1e-5, "on at {time}");
    }
    assert!((off[0] - first).abs() < 1e-6);
    assert_eq!(trace.processes[0], (0.0, 0, true));
    assert_eq!(trace.processes[1], (off[0], 0, false));
}

/// A ball thrown up at 5 m/s that comes back with half its speed.
#[test]
fn bouncing_ball() {
    let mut b = Build::default();
    let (y, v) = (b.state("y", 0.0), b.state("v", 5.0));
    let g = b.num(-10.0);
    b.rate(0, v);
    b.rate(1, g);
    let zero = b.num(0.0);
    let below = b.lt(y, zero);
    let falling = b.lt(v, zero);
    let hit = b.op(BinaryOp::And, below, falling);
    let back = b.scale(-0.5, v);
    b.event("bounce", hit, vec![assign(1, back), assign(0, zero)]);
    let (_, trace) = run(&b.model, 1.9);
    let expected = [1.0, 1.5, 1.75, 1.875];
    assert_eq!(trace.events.len(), expected.len());
    for ((time, _), expected) in trace.events.iter().zip(expected) {
        assert!((time - expected).abs() < 1e-6, "bounces at {time}, not {expected}");
    }
}

#[test]
fn at_the_very_start_once() {
    let mut b = Build::default();
    let (x, count) = (b.state("x", 1.0), b.state("count", 0.0));
    let one = b.num(1.0);
    b.rate(0, one);
    let more = b.add(count, one);
    let reached = b.at_least(x, 1.0);
    b.event("reached", reached, vec![assign(1, more)]);
    let (engine, trace) = run(&b.model, 5.0);
    assert_eq!(trace.events, [(0.0, 0)]);
    assert_eq!(engine.states()[1], 1.0);
}

/// On the threshold, but not beyond: the strict comparison becomes true at once, and once.
#[test]
fn just_after_the_start_once() {
    for speed in [1.0, 1e-6, 1e3] {
        let mut b = Build::default();
        let x = b.state("x", 1.0);
        let (speed, one) = (b.num(speed), b.num(1.0));
        b.rate(0, speed);
        let above = b.lt(one, x);
        b.event("above", above, vec![]);
        let (_, trace) = run(&b.model, 5.0);
        assert_eq!(trace.events.len(), 1, "{:?}", trace.events);
        assert!(trace.events[0].0 < 1e-6, "{:?}", trace.events);
    }
}

/// Starts on the threshold and moves away: nothing becomes true.
#[test]
fn leaving_a_threshold_fires_nothing() {
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    let (down, one) = (b.num(-1.0), b.num(1.0));
    b.rate(0, down);
    let above = b.lt(one, x);
    b.event("above", above, vec![]);
    assert!(run(&b.model, 5.0).1.events.is_empty());
}

#[test]
fn together_in_source_order() {
    let mut b = Build::default();
    let (x, y, log) = (b.state("x", 0.0), b.state("y", 0.0), b.state("log", 0.0));
    let (one, three) = (b.num(1.0), b.num(3.0));
    b.rate(0, one);
    b.rate(1, three);
    let write = |b: &mut Build, digit: f64| {
        let shifted = b.scale(10.0, log);
        let digit = b.num(digit);
        let next = b.add(shifted, digit);
        assign(2, next)
    };
    let (second, first) = (b.at_least(y, 3.0), b.at_least(x, 1.0));
    let (a, c) = (write(&mut b, 1.0), write(&mut b, 2.0));
    b.event("first", first, vec![a]);
    b.event("second", second, vec![c]);
    let (engine, trace) = run(&b.model, 2.0);
    assert_eq!(engine.states()[2], 12.0);
    assert_eq!(trace.events[0].0, trace.events[1].0);
}

/// The first event takes away the condition of the second.
#[test]
fn conditions_are_looked_at_again() {
    let mut b = Build::default();
    let (x, lamp) = (b.state("x", 0.0), b.state("lamp", 1.0));
    let (one, zero) = (b.num(1.0), b.num(0.0));
    b.rate(0, one);
    let reached = b.at_least(x, 1.0);
    let lit = b.op(BinaryOp::And, reached, lamp);
    b.event("out", reached, vec![assign(1, zero)]);
    b.event("seen", lit, vec![]);
    assert_eq!(run(&b.model, 2.0).1.events.len(), 1);
}

#[test]
fn instants_of_time_are_exact() {
    let mut b = Build::default();
    let x = b.state("x", 0.0);
    let one = b.num(1.0);
    let toward = b.sub(one, x);
    b.rate(0, toward);
    let time = b.time();
    let late = b.at_least(time, 1010.6);
    b.event("late", late, vec![]);
    let start = b.local(0);
    let since = b.sub(time, start);
    let ten = b.at_least(since, 10.1);
    let (_, trace) = run(&b.model, 2000.0);
    assert_eq!(trace.events, [(1010.6, 0)]);

    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    engine.set_local(0, 0.3);
    let when = until_true(&mut engine, ten, 100.0);
    assert!((when - 10.4).abs() < 1e-14);
    assert!(engine.truth(ten));
}

#[test]
fn equality_is_true_for_an_instant() {
    let mut b = Build::default();
    let x = b.state("x", 0.0);
    let time = b.time();
    let rate = b.model.graph.unary(matterix_ir::UnaryOp::Cos, time);
    b.rate(0, rate);
    let half = b.num(0.5);
    let equal = b.op(BinaryOp::Eq, x, half);
    b.event("half", equal, vec![]);
    b.process("at half", Some(equal));
    let (_, trace) = run(&b.model, 3.0);
    let states: Vec<bool> = trace.processes.iter().map(|p| p.2).collect();
    assert_eq!(states, [true, false, true, false]);
    let times = trace.times_of(0);
    assert_eq!(times.len(), 2, "{times:?}");
    assert!((times[0] - 0.5f64.asin()).abs() < 1e-6);
    assert!((times[1] - (std::f64::consts::PI - 0.5f64.asin())).abs() < 1e-6);
}

#[test]
fn watches_stop_where_they_become_true() {
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    let rate = b.scale(-1.0, x);
    b.rate(0, rate);
    let (half, tenth) = (b.at_most(x, 0.5), b.at_most(x, 0.1));
    let watches = [Watch { node: tenth, value: true }, Watch { node: half, value: true }];
    let mut engine = engine(&b.model);
    let mut trace = Trace::default();
    engine.start(&mut trace).expect("start");
    assert_eq!(engine.advance(10.0, &watches, &mut trace).expect("advance"), Advance::Watch(vec![1]));
    assert!((engine.time() - 2f64.ln()).abs() < 1e-6);
    assert!(engine.truth(half));
    // what holds already holds at once
    assert_eq!(engine.advance(10.0, &watches, &mut trace).expect("advance"), Advance::Watch(vec![1]));
    assert_eq!(engine.advance(10.0, &watches[..1], &mut trace).expect("advance"), Advance::Watch(vec![0]));
    assert!((engine.time() - 10f64.ln()).abs() < 1e-6);
    let still = [Watch { node: tenth, value: false }];
    assert_eq!(engine.advance(10.0, &still, &mut trace).expect("advance"), Advance::Reached);
    assert_eq!(engine.time(), 10.0);
}

#[test]
fn a_watch_on_what_an_event_does() {
    let mut b = Build::default();
    let (x, lid) = (b.state("x", 0.0), b.state("lid", 0.0));
    let one = b.num(1.0);
    b.rate(0, one);
    let reached = b.at_least(x, 2.5);
    b.event("opens", reached, vec![assign(1, one)]);
    let open = b.op(BinaryOp::Eq, lid, one);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    let when = until_true(&mut engine, open, 10.0);
    assert!((when - 2.5).abs() < 1e-9);
}
