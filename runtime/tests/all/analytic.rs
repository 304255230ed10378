//! Cases with a known solution.

use matterix_ir::BinaryOp;

use crate::engine_model::{Build, Trace, close, engine, run, until_true};

const ACCURACY: f64 = 1e-6;

#[test]
fn first_order_decay() {
    let mut b = Build::default();
    let a = b.state("a", 2.0);
    let rate = b.scale(-0.3, a);
    b.rate(0, rate);
    b.model.states[0].scale = Some(1e-3);
    for t in [0.1, 1.0, 10.0, 30.0] {
        close(run(&b.model, t).0.states()[0], 2.0 * (-0.3 * t).exp(), ACCURACY);
    }
}

#[test]
fn second_order_with_equal_amounts() {
    let mut b = Build::default();
    let a = b.state("a", 0.5);
    let square = b.mul(a, a);
    let rate = b.scale(-0.2, square);
    b.rate(0, rate);
    close(run(&b.model, 100.0).0.states()[0], 0.5 / (1.0 + 0.2 * 0.5 * 100.0), ACCURACY);
}

#[test]
fn second_order_with_unequal_amounts() {
    let (k, a0, b0, t) = (0.2, 0.5, 0.3, 20.0);
    let mut b = Build::default();
    let (x, y) = (b.state("a", a0), b.state("b", b0));
    let product = b.mul(x, y);
    let rate = b.scale(-k, product);
    b.rate(0, rate);
    b.rate(1, rate);
    let (engine, _) = run(&b.model, t);
    let e = (k * (a0 - b0) * t).exp();
    let left = (a0 - b0) * a0 * e / (a0 * e - b0);
    close(engine.states()[0], left, ACCURACY);
    close(engine.states()[1], left - (a0 - b0), ACCURACY);
}

/// A + 2 B -> AB2 with rate k a b^2, for b = 2 a at all times: 1/a^2 = 1/a0^2 + 8 k t.
#[test]
fn third_order_in_the_ratio_of_the_equation() {
    let (k, a0, t) = (0.05, 0.8, 200.0);
    let mut b = Build::default();
    let (x, y, z) = (b.state("A", a0), b.state("B", 2.0 * a0), b.state("AB2", 0.0));
    let two = b.num(2.0);
    let square = b.op(BinaryOp::Pow, y, two);
    let product = b.mul(x, square);
    let forward = b.scale(k, product);
    let once = b.scale(-1.0, forward);
    let twice = b.scale(-2.0, forward);
    b.rate(0, once);
    b.rate(1, twice);
    b.rate(2, forward);
    let total = b.add(x, z);
    b.balance("A", total, vec![]);
    let (engine, _) = run(&b.model, t);
    let left = (1.0 / (a0 * a0) + 8.0 * k * t).powf(-0.5);
    close(engine.states()[0], left, ACCURACY);
    close(engine.states()[1], 2.0 * left, ACCURACY);
    close(engine.states()[2], a0 - left, ACCURACY);
}

/// The same with an excess of B: the extent follows from an implicit equation.
#[test]
fn third_order_with_an_excess() {
    let (k, a0, b0, t) = (0.05, 0.4, 1.5, 60.0);
    let mut b = Build::default();
    let (x, y) = (b.state("A", a0), b.state("B", b0));
    let square = b.mul(y, y);
    let product = b.mul(x, square);
    let once = b.scale(-k, product);
    let twice = b.scale(-2.0 * k, product);
    b.rate(0, once);
    b.rate(1, twice);
    let (engine, _) = run(&b.model, t);
    let (a, y) = (engine.states()[0], engine.states()[1]);
    let d = b0 - 2.0 * a0;
    // integral of da / (a (d + 2 a)^2) between a and a0
    let part = |a: f64| (a / (d + 2.0 * a)).ln() / (d * d) + 1.0 / (d * (d + 2.0 * a));
    close(part(a0) - part(a), k * t, ACCURACY);
    close(y, d + 2.0 * a, ACCURACY);
}

#[test]
fn two_bodies_come_to_one_temperature() {
    let (c1, c2, g) = (1058.3, 43.03, 12.77);
    let mut b = Build::default();
    let (h1, h2) = (b.state("plate.heat", c1 * 350.0), b.state("beaker.heat", c2 * 298.15));
    let (t1, t2) = (b.scale(1.0 / c1, h1), b.scale(1.0 / c2, h2));
    let difference = b.sub(t1, t2);
    let q = b.scale(g, difference);
    let loss = b.scale(-1.0, q);
    b.rate(0, loss);
    b.rate(1, q);
    let total = b.add(h1, h2);
    b.balance("energy", total, vec![]);
    for t in [1.0, 10.0, 100.0, 1e5] {
        let (engine, _) = run(&b.model, t);
        let (h1, h2) = (engine.states()[0], engine.states()[1]);
        close(h1 + h2, c1 * 350.0 + c2 * 298.15, 1e-9);
        let mean = (c1 * 350.0 + c2 * 298.15) / (c1 + c2);
        let decay = (-g * (1.0 / c1 + 1.0 / c2) * t).exp();
        close(h1 / c1 - mean + 100.0, (350.0 - mean) * decay + 100.0, ACCURACY);
        assert!(engine.balances()[0].relative < 1e-12);
    }
}

/// Vessels that are all alike warm as one.
#[test]
fn many_vessels_on_one_block() {
    let (c1, c2, g, vessels) = (1058.3, 4.303, 1.277, 40);
    let mut b = Build::default();
    let block = b.state("block.heat", c1 * 350.0);
    let t1 = b.scale(1.0 / c1, block);
    let (mut total, mut loss) = (block, b.num(0.0));
    let mut flows = Vec::new();
    for i in 0..vessels {
        let heat = b.state(&format!("vessel{i}.heat"), c2 * 298.15);
        let t2 = b.scale(1.0 / c2, heat);
        let difference = b.sub(t1, t2);
        let flow = b.scale(g, difference);
        flows.push(flow);
        loss = b.sub(loss, flow);
        total = b.add(total, heat);
    }
    b.rate(0, loss);
    (1..).zip(flows).for_each(|(state, flow)| b.rate(state, flow));
    b.balance("energy", total, vec![]);
    let all = c2 * f64::from(vessels);
    let mean = (c1 * 350.0 + all * 298.15) / (c1 + all);
    for t in [1.0, 10.0, 1e5] {
        let (engine, _) = run(&b.model, t);
        let decay = (-g * (f64::from(vessels) / c1 + 1.0 / c2) * t).exp();
        close(engine.states()[0] / c1, mean + (350.0 - mean) * decay, 1e-8);
        close(engine.states()[7] / c2, mean + (298.15 - mean) * decay, 1e-8);
        assert!(engine.balances()[0].relative < 1e-12);
    }
}

/// A_i -> B_i with rate k_i [A_i] V, where all share the volume, which the reactions change: each amount falls off by itself.
#[test]
fn many_reactions_in_one_volume() {
    let pairs = 20;
    let mut b = Build::default();
    let amounts: Vec<_> =
        (0..2 * pairs).map(|i| b.state(&format!("n{i}"), if i < pairs { 1e-3 } else { 0.0 })).collect();
    let mut volume = b.num(1e-6);
    for (i, amount) in amounts.iter().enumerate() {
        let part = b.scale(if i < pairs { 1e-4 } else { 3e-5 }, *amount);
        volume = b.add(volume, part);
    }
    let speed = |i: usize| 1e-3 * 1.6f64.powi(i as i32);
    for (i, amount) in amounts.into_iter().take(pairs).enumerate() {
        let concentration = b.div(amount, volume);
        let slow = b.scale(speed(i), concentration);
        let rate = b.mul(slow, volume);
        let loss = b.scale(-1.0, rate);
        b.rate(i as u32, loss);
        b.rate((pairs + i) as u32, rate);
        b.model.states[i].scale = Some(1e-3);
        b.model.states[pairs + i].scale = Some(1e-3);
    }
    for t in [0.5, 20.0, 500.0] {
        let (engine, _) = run(&b.model, t);
        for i in 0..pairs {
            let left = 1e-3 * (-speed(i) * t).exp();
            assert!((engine.states()[i] - left).abs() < 1e-11, "{i} at {t} s: {} is not {left}", engine.states()[i]);
            assert!((engine.states()[i] + engine.states()[pairs + i] - 1e-3).abs() < 1e-15);
        }
    }
}

#[test]
fn lumped_cooling() {
    let (tau, ambient) = (250.0, 298.15);
    let mut b = Build::default();
    let t = b.state("T", 360.0);
    let ambient_node = b.num(ambient);
    let difference = b.sub(ambient_node, t);
    let rate = b.scale(1.0 / tau, difference);
    b.rate(0, rate);
    for time in [10.0, 250.0, 2500.0] {
        let excess = (360.0 - ambient) * (-time / tau).exp();
        close(run(&b.model, time).0.states()[0], ambient + excess, ACCURACY);
    }
    let (engine, trace) = run(&b.model, 1e6);
    close(engine.states()[0], ambient, 1e-9);
    assert!(trace.samples.len() < 2000, "{} steps", trace.samples.len());
}

#[test]
fn heater_steady_state() {
    let (k, g, target, ambient) = (70.09, 4.474, 349.48, 298.15);
    let mut b = Build::default();
    let t = b.state("T", ambient);
    let (target_node, ambient_node) = (b.num(target), b.num(ambient));
    let (up, down) = (b.sub(target_node, t), b.sub(t, ambient_node));
    let (heat, loss) = (b.scale(k, up), b.scale(g, down));
    let net = b.sub(heat, loss);
    let rate = b.scale(1.0 / 1058.3, net);
    b.rate(0, rate);
    close(run(&b.model, 5000.0).0.states()[0], (k * target + g * ambient) / (k + g), 1e-9);
}

#[test]
fn robertson() {
    let mut b = Build::default();
    let (x, y, z) = (b.state("y1", 1.0), b.state("y2", 0.0), b.state("y3", 0.0));
    for (state, scale) in b.model.states.iter_mut().zip([1e-6, 1e-10, 1.0]) {
        state.scale = Some(scale);
    }
    let slow = b.scale(0.04, x);
    let product = b.mul(y, z);
    let back = b.scale(1e4, product);
    let square = b.mul(y, y);
    let fast = b.scale(3e7, square);
    let first = b.sub(back, slow);
    let gain = b.sub(slow, back);
    let second = b.sub(gain, fast);
    b.rate(0, first);
    b.rate(1, second);
    b.rate(2, fast);
    let sum = b.add(x, y);
    let total = b.add(sum, z);
    b.balance("mass", total, vec![]);
    let (engine, _) = run(&b.model, 1e11);
    let reference = [0.208_334_014_970_125_5e-7, 0.833_336_077_033_471_3e-13, 0.999_999_979_166_505];
    for (value, expected) in engine.states().iter().zip(reference) {
        close(*value, expected, ACCURACY);
    }
}

#[test]
fn fast_decay_seen_rarely() {
    let mut b = Build::default();
    let a = b.state("a", 1.0);
    let one = b.num(1.0);
    let gap = b.sub(one, a);
    b.model.states[0].initial = b.num(3.0);
    let rate = b.scale(13.0, gap);
    b.rate(0, rate);
    let mut engine = engine(&b.model);
    engine.start(&mut ()).expect("start");
    for step in 1..=20 {
        let time = f64::from(step) * 0.1;
        engine.advance(time, &[], &mut ()).expect("advance");
        close(engine.states()[0], 1.0 + 2.0 * (-13.0 * time).exp(), ACCURACY);
    }
}

/// A law that depends on time itself: x' = cos t.
#[test]
fn forced() {
    let mut b = Build::default();
    b.state("x", 1.0);
    let time = b.time();
    let rate = b.model.graph.unary(matterix_ir::UnaryOp::Cos, time);
    b.rate(0, rate);
    let (engine, _) = run(&b.model, 10.0);
    close(engine.states()[0], 1.0 + 10f64.sin(), ACCURACY);
}

/// Many independent decays.
#[test]
fn many_states() {
    let mut b = Build::default();
    for i in 0..230 {
        let x = b.state(&format!("x{i}"), 1.0);
        let rate = b.scale(-0.01 * f64::from(i + 1), x);
        b.rate(i as u32, rate);
    }
    let (engine, _) = run(&b.model, 1.0);
    for (i, x) in engine.states().iter().enumerate() {
        close(*x, (-0.01 * (i as f64 + 1.0)).exp(), ACCURACY);
    }
}

#[test]
fn event_in_robertson() {
    let mut b = Build::default();
    let (x, y, z) = (b.state("y1", 1.0), b.state("y2", 0.0), b.state("y3", 0.0));
    b.model.states[1].scale = Some(1e-6);
    let slow = b.scale(0.04, x);
    let product = b.mul(y, z);
    let back = b.scale(1e4, product);
    let square = b.mul(y, y);
    let fast = b.scale(3e7, square);
    let first = b.sub(back, slow);
    let gain = b.sub(slow, back);
    let second = b.sub(gain, fast);
    b.rate(0, first);
    b.rate(1, second);
    b.rate(2, fast);
    let reached = b.at_least(z, 0.01);
    let mut engine = engine(&b.model);
    engine.start(&mut Trace::default()).expect("start");
    close(until_true(&mut engine, reached, 10.0), 0.264_019_08, ACCURACY);
}

/// Predators and prey: d x - c ln x + b y - a ln y stays what it was, over six cycles.
#[test]
fn oscillation_keeps_its_invariant() {
    let mut b = Build::default();
    let (x, y) = (b.state("prey", 1.0), b.state("predators", 0.2));
    let product = b.mul(x, y);
    let (grow, eat) = (b.scale(1.1, x), b.scale(0.4, product));
    let (breed, die) = (b.scale(0.1, product), b.scale(0.4, y));
    let (dx, dy) = (b.sub(grow, eat), b.sub(breed, die));
    b.rate(0, dx);
    b.rate(1, dy);
    let many = b.at_least(x, 10.0);
    b.event("many", many, vec![]);
    let invariant = |x: f64, y: f64| 0.1 * x - 0.4 * x.ln() + 0.4 * y - 1.1 * y.ln();
    let (_, trace) = run(&b.model, 70.0);
    assert!(trace.events.len() > 4);
    for (_, states) in &trace.samples {
        close(invariant(states[0], states[1]), invariant(1.0, 0.2), ACCURACY);
    }
}

/// A vessel runs empty in finite time, at an infinite slope, and stays empty.
#[test]
fn running_empty() {
    let mut b = Build::default();
    let x = b.state("level", 1.0);
    let zero = b.num(0.0);
    let bounded = b.op(BinaryOp::Max, x, zero);
    let root = b.model.graph.unary(matterix_ir::UnaryOp::Sqrt, bounded);
    let rate = b.scale(-1.0, root);
    b.rate(0, rate);
    close(run(&b.model, 1.0).0.states()[0], 0.25, ACCURACY);
    let (engine, trace) = run(&b.model, 50.0);
    assert!(engine.states()[0].abs() < 1e-8, "{:?}", engine.states());
    assert!(trace.samples.len() < 3000);
}
