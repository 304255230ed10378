//! Parts of a model that have nothing to do with each other are followed apart, and come to what they come to alone.

use matterix_ir::NodeId;
use matterix_runtime::process::{Advance, Options, Watch};

use crate::engine_model::{Build, Trace, assign, close, engine, run};

/// A body that is heated by an event below one temperature and cools again above another; its number of states is 2.
fn thermostat(b: &mut Build, name: &str, start: f64, (low, high): (f64, f64)) -> u32 {
    let t = b.state(name, start);
    let at = b.model.states.len() as u32 - 1;
    let on = b.state(&format!("{name}.on"), 0.0);
    let ambient = b.num(20.0);
    let gap = b.sub(ambient, t);
    let loss = b.scale(0.01, gap);
    let heat = b.scale(2.0, on);
    let rate = b.add(loss, heat);
    b.rate(at, rate);
    let (one, zero) = (b.num(1.0), b.num(0.0));
    let (cold, hot) = (b.at_most(t, low), b.at_least(t, high));
    b.event(&format!("{name} is cold"), cold, vec![assign(at + 1, one)]);
    b.event(&format!("{name} is hot"), hot, vec![assign(at + 1, zero)]);
    at
}

/// So many thermostats, no two of which do the same.
fn many(count: usize) -> Build {
    let mut b = Build::default();
    for i in 0..count {
        let band = 40.0 + i as f64;
        thermostat(&mut b, &format!("t{i}"), 20.0, (band, band + 3.0));
    }
    b
}

#[test]
fn parts_come_to_what_they_come_to_alone() {
    let b = many(7);
    let (all, trace) = run(&b.model, 500.0);
    for i in 0..7 {
        let mut b = Build::default();
        let band = 40.0 + i as f64;
        thermostat(&mut b, "t", 20.0, (band, band + 3.0));
        let (alone, of) = run(&b.model, 500.0);
        close(all.states()[2 * i], alone.states()[0], 1e-9);
        for (mine, event) in [(2 * i, 0), (2 * i + 1, 1)] {
            let (together, apart) = (trace.times_of(mine), of.times_of(event));
            assert_eq!(together.len(), apart.len(), "thermostat {i}");
            together.iter().zip(&apart).for_each(|(a, b)| close(*a, *b, 1e-9));
        }
    }
}

#[test]
fn steps_grow_with_the_parts_and_not_with_their_product() {
    let steps = |count: usize| run(&many(count).model, 300.0).1.samples.len();
    let (few, more) = (steps(4), steps(16));
    assert!(more < 5 * few, "{few} samples of 4 parts, {more} of 16");
}

#[test]
fn what_happens_in_one_part_begins_no_other_anew() {
    let mut b = Build::default();
    thermostat(&mut b, "busy", 41.0, (40.0, 40.2));
    let calm = b.state("calm", 1.0);
    let decay = b.scale(-1e-3, calm);
    b.rate(2, decay);
    let (engine, trace) = run(&b.model, 1000.0);
    assert!(trace.events.len() > 100, "{} events", trace.events.len());
    close(engine.states()[2], (-1.0f64).exp(), 1e-7);
    let alone = {
        let mut b = Build::default();
        let calm = b.state("calm", 1.0);
        let decay = b.scale(-1e-3, calm);
        b.rate(0, decay);
        run(&b.model, 1000.0).0.states()[0]
    };
    assert_eq!(engine.states()[2].to_bits(), alone.to_bits(), "not one step of it was cut");
}

#[test]
fn parts_are_joined_while_they_touch() {
    // Two bodies exchange heat between 10 s and 30 s.
    let mut b = Build::default();
    let (hot, cold, time) = (b.state("hot", 80.0), b.state("cold", 20.0), b.time());
    let (begun, over) = (b.at_least(time, 10.0), b.at_least(time, 30.0));
    let gap = b.sub(hot, cold);
    let flow = b.scale(0.05, gap);
    let zero = b.num(0.0);
    let flow = b.model.graph.select(over, zero, flow);
    let flow = b.only_if(begun, flow);
    let lost = b.scale(-1.0, flow);
    let room = b.num(20.0);
    let (away, warm) = (b.sub(room, hot), b.sub(room, cold));
    let (away, warm) = (b.scale(0.01, away), b.scale(0.02, warm));
    let (first, second) = (b.add(lost, away), b.add(flow, warm));
    b.rates(&[first, second]);
    let (engine, _) = run(&b.model, 60.0);
    // Heat above the room: alone, by the matrix [[-0.06, 0.05], [0.05, -0.07]], alone.
    let (a, c) = (60.0 * (-0.1f64).exp(), 0.0);
    let (mean, half) = (-0.065, (0.005f64 * 0.005 + 0.05 * 0.05).sqrt());
    let (fast, slow) = (mean - half, mean + half);
    let (f, s) = ((20.0 * fast).exp(), (20.0 * slow).exp());
    // exp(A t) = (f (A - slow) - s (A - fast)) / (fast - slow)
    let entry = |value: f64, same: f64| (f * (value - slow * same) - s * (value - fast * same)) / (fast - slow);
    let (hot, cold) = (entry(-0.06, 1.0) * a + entry(0.05, 0.0) * c, entry(0.05, 0.0) * a + entry(-0.07, 1.0) * c);
    close(engine.states()[0], 20.0 + hot * (-0.3f64).exp(), 1e-8);
    close(engine.states()[1], 20.0 + cold * (-0.6f64).exp(), 1e-8);
}

#[test]
fn a_comparison_of_two_parts_is_located() {
    // 3 exp(-t) meets 1 - exp(-t / 2) where u = exp(-t / 2) solves 3 u^2 + u - 1 = 0.
    let mut b = Build::default();
    let (x, y) = (b.state("x", 3.0), b.state("y", 0.0));
    let fall = b.scale(-1.0, x);
    let one = b.num(1.0);
    let rest = b.sub(one, y);
    let rise = b.scale(0.5, rest);
    b.rates(&[fall, rise]);
    let below = b.lt(x, y);
    b.event("met", below, Vec::new());
    let meets = -2.0 * ((13.0f64.sqrt() - 1.0) / 6.0).ln();
    let (_, trace) = run(&b.model, 10.0);
    assert_eq!(trace.events.len(), 1);
    close(trace.events[0].0, meets, 1e-7);
    // And where only the caller looks.
    let mut watched = Build { model: b.model.clone() };
    watched.model.events.clear();
    let mut engine = engine(&watched.model);
    engine.start(&mut ()).expect("start");
    let end = engine.advance(10.0, &[Watch { node: below, value: true }], &mut ()).expect("advance");
    assert_eq!(end, Advance::Watch(vec![0]));
    close(engine.time(), meets, 1e-7);
}

#[test]
fn two_thousand_parts_that_switch_at_one_instant_are_no_cascade() {
    let mut b = Build::default();
    for i in 0..2000 {
        let (x, done) = (b.state(&format!("x{i}"), 0.0), b.state(&format!("done{i}"), 0.0));
        let one = b.num(1.0);
        b.rate(2 * i, one);
        let full = b.at_least(x, 5.0);
        b.event(&format!("full{i}"), full, vec![assign(2 * i + 1, one)]);
        let _: NodeId = done;
    }
    let mut engine = engine(&b.model);
    let mut trace = Quiet::default();
    engine.start(&mut trace).expect("start");
    engine.advance(6.0, &[], &mut trace).expect("advance");
    assert_eq!(trace.0, 2000);
    assert!(engine.states().iter().skip(1).step_by(2).all(|done| *done == 1.0));
}

/// Counts events.
#[derive(Default)]
struct Quiet(usize);

impl matterix_runtime::process::Observer for Quiet {
    fn sample(&mut self, _: f64, _: &matterix_runtime::process::Engine<'_>, _: &[u32]) {}

    fn event(&mut self, _: f64, _: usize) {
        self.0 += 1;
    }

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

#[test]
fn what_is_written_from_outside_begins_its_part_anew() {
    let mut b = Build::default();
    let (x, y) = (b.state("x", 1.0), b.state("y", 1.0));
    let (fall, slow) = (b.scale(-0.1, x), b.scale(-0.01, y));
    b.rates(&[fall, slow]);
    let two = b.num(2.0);
    let (mut engine, mut trace) = (engine(&b.model), Trace::default());
    engine.start(&mut trace).expect("start");
    engine.advance(10.0, &[], &mut trace).expect("advance");
    engine.apply(&[assign(0, two)], &mut trace).expect("apply");
    engine.advance(20.0, &[], &mut trace).expect("advance");
    close(engine.states()[0], 2.0 * (-1.0f64).exp(), 1e-7);
    close(engine.states()[1], (-0.2f64).exp(), 1e-7);
}

/// Keeps which states each sample may have changed.
#[derive(Default)]
struct Changes(Vec<(f64, Vec<u32>)>);

impl matterix_runtime::process::Observer for Changes {
    fn sample(&mut self, time: f64, _: &matterix_runtime::process::Engine<'_>, changed: &[u32]) {
        self.0.push((time, changed.to_vec()));
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

#[test]
fn a_step_of_one_part_shows_nothing_else() {
    let b = many(20);
    let (mut engine, mut changes) = (engine(&b.model), Changes::default());
    engine.start(&mut changes).expect("start");
    engine.advance(300.0, &[], &mut changes).expect("advance");
    let (all, _): (Vec<_>, Vec<_>) = changes.0.iter().partition(|(_, changed)| changed.len() > 2);
    assert!(all.iter().all(|(time, _)| *time == 0.0), "only the beginning concerns several");
    assert!(changes.0.len() > 100, "{} samples", changes.0.len());
}

#[test]
fn how_often_anybody_looks_changes_no_bit() {
    let b = many(5);
    let once = |pieces: usize| {
        let (mut engine, mut trace) = (engine(&b.model), Trace::default());
        engine.start(&mut trace).expect("start");
        for piece in 1..=pieces {
            engine.advance(400.0 * piece as f64 / pieces as f64, &[], &mut trace).expect("advance");
            let seen: f64 = engine.states().iter().sum();
            assert!(seen.is_finite());
        }
        let states: Vec<u64> = engine.states().iter().map(|s| s.to_bits()).collect();
        (states, trace.events)
    };
    let whole = once(1);
    for pieces in [2, 7, 1000] {
        assert_eq!(whole, once(pieces), "{pieces} pieces");
    }
}

#[test]
fn a_state_is_read_between_the_steps_of_its_part() {
    // One part has all the steps, the other one few long ones.
    let mut b = Build::default();
    thermostat(&mut b, "busy", 41.0, (40.0, 40.2));
    let calm = b.state("calm", 1.0);
    let decay = b.scale(-1e-3, calm);
    b.rate(2, decay);
    struct Reads(f64);
    impl matterix_runtime::process::Observer for Reads {
        fn sample(&mut self, time: f64, engine: &matterix_runtime::process::Engine<'_>, _: &[u32]) {
            self.0 = self.0.max((engine.state(2) - (-1e-3 * time).exp()).abs());
        }

        fn event(&mut self, _: f64, _: usize) {}

        fn process(&mut self, _: f64, _: usize, _: bool) {}
    }
    let (mut engine, mut reads) = (engine(&b.model), Reads(0.0));
    engine.start(&mut reads).expect("start");
    engine.advance(1000.0, &[], &mut reads).expect("advance");
    assert!(reads.0 < 1e-8, "{}", reads.0);
}

#[test]
fn what_a_closed_gate_hid_is_seen_when_it_opens() {
    // A level is passed while nobody looks; who looks later sees that it has been, and what comes after.
    let mut b = Build::default();
    let (x, armed, time) = (b.state("x", 0.0), b.state("armed", 0.0), b.time());
    let one = b.num(1.0);
    b.rate(0, one);
    let (late, high, higher) = (b.at_least(time, 5.0), b.at_least(x, 3.0), b.at_least(x, 7.0));
    let both = |b: &mut Build, level: NodeId| b.op(matterix_ir::BinaryOp::And, armed, level);
    let (seen, next) = (both(&mut b, high), both(&mut b, higher));
    b.event("arms", late, vec![assign(1, one)]);
    b.event("has passed", seen, Vec::new());
    b.event("passes", next, Vec::new());
    let (_, trace) = run(&b.model, 10.0);
    close(trace.times_of(1)[0], 5.0, 1e-9);
    close(trace.times_of(2)[0], 7.0, 1e-9);
    assert_eq!(trace.events.len(), 3);
}

#[test]
fn what_comes_to_rest_moves_again() {
    // A valve opens and shuts by time; between, nothing moves and nothing is integrated.
    let mut b = Build::default();
    let (level, time) = (b.state("level", 0.0), b.time());
    let open = |b: &mut Build, from: f64, to: f64| {
        let (begun, over) = (b.at_least(time, from), b.at_least(time, to));
        let zero = b.num(0.0);
        let one = b.num(1.0);
        let flow = b.model.graph.select(over, zero, one);
        b.only_if(begun, flow)
    };
    let (first, second) = (open(&mut b, 10.0, 20.0), open(&mut b, 1000.0, 1005.0));
    let rate = b.add(first, second);
    b.rate(0, rate);
    let full = b.at_least(level, 12.0);
    b.event("full", full, Vec::new());
    let (engine, trace) = run(&b.model, 2000.0);
    close(engine.states()[0], 15.0, 1e-9);
    close(trace.times_of(0)[0], 1002.0, 1e-9);
}

#[test]
fn a_snapshot_goes_on_to_the_last_bit() {
    let b = many(6);
    let bits = |engine: &matterix_runtime::process::Engine<'_>| -> Vec<u64> {
        engine.states().iter().map(|s| s.to_bits()).collect()
    };
    let (mut engine, mut trace) = (engine(&b.model), Trace::default());
    engine.start(&mut trace).expect("start");
    engine.advance(77.7, &[], &mut trace).expect("advance");
    let (mut saved, before) = (engine.clone(), trace.clone());
    engine.advance(400.0, &[], &mut trace).expect("advance");
    // What becomes of the one does not touch the other.
    let (hot, mut other) = (b.model.states[0].initial, saved.clone());
    other.apply(&[assign(0, hot)], &mut ()).expect("apply");
    other.advance(300.0, &[], &mut ()).expect("advance");
    let mut after = before;
    saved.advance(400.0, &[], &mut after).expect("advance");
    assert_eq!(bits(&engine), bits(&saved));
    assert_eq!(trace, after);
}

#[test]
fn threads_change_no_bit() {
    let b = many(40);
    let followed = |is_shared: bool| {
        let options = Options { is_shared, ..Options::default() };
        let params = b.model.params.iter().map(|p| p.value).collect();
        let mut engine = matterix_runtime::process::Engine::new(&b.model, params, 0, options).expect("an engine");
        let mut trace = Trace::default();
        engine.start(&mut trace).expect("start");
        for until in [10.0, 77.7, 400.0] {
            engine.advance(until, &[], &mut trace).expect("advance");
        }
        let bits: Vec<u64> = engine.states().iter().map(|s| s.to_bits()).collect();
        (bits, trace)
    };
    assert_eq!(followed(true), followed(false));
}
