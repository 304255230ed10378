//! Laws far faster than the time that is looked at, and late in the life of a lab, against their solutions.

use matterix_ir::{BinaryOp, NodeId};
use matterix_runtime::process::Watch;

use crate::engine_model::{Build, close, engine, run, until_true};

const ACCURACY: f64 = 1e-6;

/// x' = -k x, y' = k x.
fn decay(k: f64) -> Build {
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    b.state("y", 0.0);
    let rate = b.scale(k, x);
    let loss = b.scale(-1.0, rate);
    b.rate(0, loss);
    b.rate(1, rate);
    b
}

#[test]
fn decay_at_any_rate() {
    for k in [1e3, 1e6, 1e9, 1e12, 1e14] {
        let b = decay(k);
        close(run(&b.model, 1.0 / k).0.states()[0], (-1.0f64).exp(), ACCURACY);
        let (engine, trace) = run(&b.model, 10.0);
        assert!(engine.states()[0].abs() < 1e-8, "{}", engine.states()[0]);
        close(engine.states()[1], 1.0, ACCURACY);
        assert!(trace.samples.len() < 1000, "{} steps", trace.samples.len());
    }
}

#[test]
fn a_fast_law_that_begins_late_takes_its_time() {
    for k in [1e6, 1e9, 1e12, 1e14] {
        let mut b = Build::default();
        let (x, time) = (b.state("x", 1.0), b.time());
        b.state("integral", 0.0);
        let begun = b.at_least(time, 1e6);
        let rate = b.scale(-k, x);
        let rate = b.only_if(begun, rate);
        b.rate(0, rate);
        // The integral of x from then on is 1/k: what is lost of each step would be missing in it.
        let weighted = b.scale(k, x);
        let weighted = b.only_if(begun, weighted);
        b.rate(1, weighted);
        let (engine, _) = run(&b.model, 1e6 + 5.0);
        assert!(engine.states()[0].abs() < 1e-8);
        close(engine.states()[1], 1.0, ACCURACY);
    }
}

#[test]
fn a_crossing_within_a_fast_law_is_located_on_its_own_clock() {
    let mut b = Build::default();
    let (x, time) = (b.state("x", 1.0), b.time());
    let begun = b.at_least(time, 1e5);
    let rate = b.scale(-1e11, x);
    let rate = b.only_if(begun, rate);
    b.rate(0, rate);
    let half = b.at_most(x, 0.5);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    let time = until_true(&mut engine, half, 1e6);
    assert!((time - 1e5).abs() < 1e-9);
    close(engine.states()[0], 0.5, ACCURACY);
    engine.advance(1e5 + 1.0, &[] as &[Watch], &mut ()).expect("advance");
    assert!(engine.states()[0].abs() < 1e-8);
}

/// x + y -> z, rate k x y.
fn combine(k: f64, a: f64, c: f64) -> Build {
    let mut b = Build::default();
    let (x, y) = (b.state("x", a), b.state("y", c));
    b.state("z", 0.0);
    let zero = b.num(0.0);
    let (x, y) = (b.op(BinaryOp::Max, x, zero), b.op(BinaryOp::Max, y, zero));
    let product = b.mul(x, y);
    let rate = b.scale(k, product);
    let loss = b.scale(-1.0, rate);
    b.rate(0, loss);
    b.rate(1, loss);
    b.rate(2, rate);
    b
}

#[test]
fn second_order_at_the_rate_of_neutralisation() {
    let k = 1.4e11;
    for (a, c) in [(0.5, 0.5), (0.5, 0.3), (0.1, 2.0), (1e-7, 1.0), (1.0, 1e-7)] {
        let mut b = combine(k, a, c);
        b.model.states.iter_mut().for_each(|s| s.scale = Some(f64::min(a, c)));
        for turns in [0.1, 1.0, 10.0] {
            let t = turns / (k * f64::max(a, c));
            let z = run(&b.model, t).0.states()[2];
            let wanted = if a == c {
                a * a * k * t / (1.0 + a * k * t)
            } else {
                let e = ((a - c) * k * t).exp();
                a * c * (e - 1.0) / (a * e - c)
            };
            assert!((z - wanted).abs() <= ACCURACY * wanted + 1e-13, "{z} is not {wanted}");
        }
        let z = run(&b.model, 100.0).0.states()[2];
        assert!((z - f64::min(a, c)).abs() <= 1e-6 * f64::min(a, c).max(1e-5), "{z} of {a} and {c}");
    }
}

#[test]
fn a_fast_way_there_and_back_comes_to_equilibrium() {
    for (forward, back) in [(1e13, 1e11), (1e4, 1e12), (7.9e5, 4.5e10)] {
        let mut b = Build::default();
        let (x, y) = (b.state("x", 1.0), b.state("y", 0.0));
        let there = b.scale(forward, x);
        let here = b.scale(back, y);
        let net = b.sub(here, there);
        let gain = b.sub(there, here);
        b.rate(0, net);
        b.rate(1, gain);
        let (engine, _) = run(&b.model, 1e5);
        close(engine.states()[1] / engine.states()[0], forward / back, ACCURACY);
        close(engine.states()[0] + engine.states()[1], 1.0, 1e-9);
    }
}

/// H2O <-> H+ + OH-: both reach the root of the ion product, from nothing, from acid and from base.
#[test]
fn water_ionises() {
    for (h, oh) in [(0.0, 0.0), (1e-3, 0.0), (0.0, 1e-2), (1.0, 1.0)] {
        let mut b = combine(1.4e11, h, oh);
        b.model.states.iter_mut().for_each(|s| s.scale = Some(1e-6));
        let made = b.num(1.4e11 * 1e-14);
        let rates: Vec<NodeId> = b.model.derivatives.iter().map(|d| d.rate).collect();
        for (i, rate) in rates.into_iter().take(2).enumerate() {
            b.model.derivatives[i].rate = b.op(BinaryOp::Add, rate, made);
        }
        let (engine, _) = run(&b.model, 1e3);
        let (x, y) = (engine.states()[0], engine.states()[1]);
        let root = |d: f64| 0.5 * (d.abs() + (d * d + 4e-14).sqrt());
        let (more, less) = if h >= oh { (x, y) } else { (y, x) };
        close(more, root(h - oh), 1e-5);
        assert!((less - 1e-14 / root(h - oh)).abs() < 1e-11, "{less}");
    }
}

#[test]
fn states_of_any_scale_are_followed() {
    for scale in [1e-18, 1e-12, 1e-6, 1.0, 1e6] {
        let mut b = decay(50.0);
        b.model.states[1].scale = Some(scale);
        let (engine, _) = run(&b.model, 0.1);
        close(engine.states()[1], 1.0 - (-5.0f64).exp(), ACCURACY * f64::max(scale, 1.0));
    }
}

/// What is used up at a full rate until nothing is left, as the library writes it: `available`.
fn available(b: &mut Build, x: NodeId) -> NodeId {
    const LEFT: f64 = 1e-8;
    let (one, there) = (b.num(1.0), b.at_least(x, LEFT));
    let share = b.scale(1.0 / LEFT, x);
    b.model.graph.select(there, one, share)
}

#[test]
fn what_runs_out_stops_there() {
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    b.state("y", 0.0);
    let there = available(&mut b, x);
    let rate = b.scale(0.1, there);
    let loss = b.scale(-1.0, rate);
    b.rate(0, loss);
    b.rate(1, rate);
    close(run(&b.model, 5.0).0.states()[0], 0.5, 1e-9);
    let (engine, trace) = run(&b.model, 1000.0);
    assert!((engine.states()[1] - 1.0).abs() < 1e-9, "{:?}", engine.states());
    assert!(trace.samples.iter().all(|(_, s)| s[0] > -1e-10), "it goes below nothing");
}

#[test]
fn what_is_fed_is_used_up_as_it_comes() {
    let mut b = Build::default();
    let x = b.state("x", 0.5);
    b.state("y", 0.0);
    let there = available(&mut b, x);
    let rate = b.scale(0.1, there);
    let feed = b.num(0.03);
    let net = b.sub(feed, rate);
    b.rate(0, net);
    b.rate(1, rate);
    let (engine, trace) = run(&b.model, 1000.0);
    // 0.5 lasts 0.5 / 0.07 s, from then on the rate is that of the feed.
    close(engine.states()[1], 0.5 + 0.03 * 1000.0, 1e-8);
    assert!(engine.states()[0] < 1e-8);
    assert!(trace.samples.len() < 500, "{} steps", trace.samples.len());
}

/// x' = -k / x comes to its end with an infinite slope: x = sqrt(1 - 2 k t).
#[test]
fn a_law_that_grows_without_bound_ends_where_nothing_is_left() {
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    let there = available(&mut b, x);
    let least = b.num(1e-8);
    let enough = b.at_least(x, 1e-8);
    let size = b.model.graph.select(enough, x, least);
    let inverse = b.div(there, size);
    let rate = b.scale(-0.1, inverse);
    b.rate(0, rate);
    close(run(&b.model, 4.0).0.states()[0], 0.2f64.sqrt(), ACCURACY);
    let (engine, trace) = run(&b.model, 100.0);
    assert!(engine.states()[0].abs() < 1e-8);
    let gone = trace.samples.iter().find(|(_, s)| s[0] < 1e-4).expect("it ends").0;
    close(gone, 5.0, ACCURACY);
}

#[test]
fn a_law_without_a_solution_is_given_up() {
    // x' = x^2 has none beyond t = 1.
    let mut b = Build::default();
    let x = b.state("x", 1.0);
    let square = b.mul(x, x);
    b.rate(0, square);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    let fault = engine.advance(2.0, &[] as &[Watch], &mut ()).expect_err("nothing to follow");
    assert!((fault.time - 1.0).abs() < 1e-6, "{fault}");
}
