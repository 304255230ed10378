//! The heat network of the published SN1 experiment: plate, beaker, solution, the published instants.

use matterix_ir::NodeId;
use matterix_runtime::process::Engine;

use crate::engine_model::{Build, assign, engine, until_true};

const AMBIENT: f64 = 298.15;
const CAPACITY: [f64; 3] = [1058.3, 43.03, 41.75];
const CONTACT: [f64; 2] = [12.77, 21.08];
const LOSS: [f64; 3] = [0.573, 1.505, 2.396];
const GAIN: f64 = 70.09;

/// States 0 to 2: heat of plate, beaker, solution above ambient; 3: heater on; 4: beaker on plate; 5, 6: heat from the
/// heater and to the air.
struct Bench {
    build: Build,
    temperatures: [NodeId; 3],
}

fn bench(target: f64) -> Bench {
    let mut b = Build::default();
    let heat = [b.state("plate.heat", 0.0), b.state("beaker.heat", 0.0), b.state("solution.heat", 0.0)];
    let (on, touching) = (b.state("plate.active", 0.0), b.state("beaker.on", 0.0));
    b.state("heated", 0.0);
    b.state("to air", 0.0);
    for state in &mut b.model.states {
        state.scale = Some(1000.0);
    }
    let rise = std::array::from_fn::<_, 3, _>(|i| b.scale(1.0 / CAPACITY[i], heat[i]));
    let rise_target = b.num(target - AMBIENT);
    let gap = b.sub(rise_target, rise[0]);
    let full = b.scale(GAIN, gap);
    let heating = b.only_if(on, full);
    let d1 = b.sub(rise[0], rise[1]);
    let q1 = b.scale(CONTACT[0], d1);
    let conduction = b.only_if(touching, q1);
    let d2 = b.sub(rise[1], rise[2]);
    let mixing = b.scale(CONTACT[1], d2);
    let air = std::array::from_fn::<_, 3, _>(|i| b.scale(LOSS[i], rise[i]));
    let terms = [(heating, conduction), (conduction, mixing)];
    for (i, (gain, passed)) in terms.into_iter().enumerate() {
        let net = b.sub(gain, passed);
        let rate = b.sub(net, air[i]);
        b.rate(i as u32, rate);
    }
    let rate = b.sub(mixing, air[2]);
    b.rate(2, rate);
    b.rate(5, heating);
    let sum = b.add(air[0], air[1]);
    let out = b.add(sum, air[2]);
    let out = b.scale(-1.0, out);
    b.rate(6, out);
    let sum = b.add(heat[0], heat[1]);
    let total = b.add(sum, heat[2]);
    b.balance("energy", total, vec![5, 6]);
    let ambient = b.num(AMBIENT);
    let temperatures = rise.map(|r| b.add(r, ambient));
    Bench { build: b, temperatures }
}

/// Waits 2 s, heats, puts the beaker on the plate, runs to `off`, s.
fn until_off<'m>(bench: &'m mut Bench, contact: f64, window: (f64, f64), off: f64) -> (Engine<'m>, [NodeId; 2], f64) {
    let one = bench.build.num(1.0);
    let reacts = bench.build.at_least(bench.temperatures[2], window.0 + 273.15);
    let ceases = bench.build.at_most(bench.temperatures[2], window.0 + 273.15);
    let mut engine = engine(&bench.build.model);
    engine.start(&mut ()).expect("start");
    engine.advance(2.0, &[], &mut ()).expect("wait");
    engine.apply(&[assign(3, one)], &mut ()).expect("heat");
    engine.advance(contact, &[], &mut ()).expect("place");
    engine.apply(&[assign(4, one)], &mut ()).expect("touch");
    let start = until_true(&mut engine, reacts, off);
    engine.advance(off, &[], &mut ()).expect("react");
    (engine, [reacts, ceases], start)
}

fn celsius(engine: &Engine<'_>, node: NodeId) -> f64 {
    engine.eval(node) - 273.15
}

fn case(target: f64, contact: f64, floor: f64, off: f64, expected: (f64, f64, f64), bars: (f64, f64, f64)) {
    let mut bench = bench(target + 273.15);
    let zero = bench.build.num(0.0);
    let nodes = bench.temperatures;
    let (mut engine, [_, ceases], start) = until_off(&mut bench, contact, (floor, 70.0), off);
    engine.apply(&[assign(3, zero)], &mut ()).expect("stop heating");
    let end = until_true(&mut engine, ceases, 2000.0);
    engine.advance(2000.0, &[], &mut ()).expect("cool");
    engine.finish(&mut ()).expect("energy closes");
    let last = celsius(&engine, nodes[2]);
    assert!((start - expected.0).abs() <= bars.0, "starts at {start}");
    assert!((end - expected.1).abs() <= bars.1, "stops at {end}");
    assert!((last - expected.2).abs() <= bars.2, "ends at {last}");
    assert!(engine.balances()[0].relative < 1e-9);
}

#[test]
fn accepted_version() {
    case(76.33, 8.0, 30.0, 1010.6, (11.40, 1638.9, 26.64), (0.005, 0.05, 0.005));
}

#[test]
fn earlier_version() {
    case(76.33, 7.0, 40.0, 1009.4, (17.80, 1282.09, 26.632), (0.005, 0.01, 0.001));
}

#[test]
fn temperatures_at_heater_off() {
    let mut bench = bench(76.33 + 273.15);
    let nodes = bench.temperatures;
    let (engine, _, _) = until_off(&mut bench, 8.0, (30.0, 70.0), 1010.6);
    for (node, expected) in nodes.into_iter().zip([73.94, 63.05, 59.17]) {
        assert!((celsius(&engine, node) - expected).abs() < 0.005, "{}", celsius(&engine, node));
    }
}

#[test]
fn forty_degrees() {
    let mut bench = bench(40.0 + 273.15);
    let nodes = bench.temperatures;
    let (engine, _, _) = until_off(&mut bench, 8.0, (30.0, 70.0), 1010.6);
    assert!((celsius(&engine, nodes[2]) - 34.98).abs() < 0.005);
}
