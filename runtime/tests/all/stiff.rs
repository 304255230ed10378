//! The stiff problems of the test set for initial value problems (Mazzia and Magherini, release 2.4) that have a reference solution,
//! at the default tolerance. Robertson's is among the analytic cases. `cargo test -p matterix-runtime stiff -- --nocapture` prints the errors.

use matterix_ir::NodeId;

use crate::engine_model::{Build, run};

/// The largest error a state may have, relative to its reference.
const ACCURACY: f64 = 2e-6;

/// A rate constant, what is used up and what comes of it.
type Reaction<'a> = (f64, &'a [usize], &'a [usize]);

/// Reactions whose rates are products of what they use up.
fn mass_action(start: &[f64], scales: &[f64], reactions: &[Reaction<'_>]) -> Build {
    let mut b = Build::default();
    let states = states(&mut b, start, scales);
    let zero = b.num(0.0);
    let mut rates = vec![zero; start.len()];
    for (k, used, made) in reactions {
        let mut rate = b.num(*k);
        for i in *used {
            rate = b.mul(rate, states[*i]);
        }
        for i in *used {
            rates[*i] = b.sub(rates[*i], rate);
        }
        for i in *made {
            rates[*i] = b.add(rates[*i], rate);
        }
    }
    b.rates(&rates);
    b
}

fn states(b: &mut Build, start: &[f64], scales: &[f64]) -> Vec<NodeId> {
    let states = start.iter().map(|value| b.state("y", *value)).collect();
    b.model.states.iter_mut().zip(scales).for_each(|(state, scale)| state.scale = Some(*scale));
    states
}

#[track_caller]
fn judge(name: &str, build: &Build, time: f64, reference: &[f64]) {
    let (engine, _) = run(&build.model, time);
    let errors = engine.states().into_iter().zip(reference).map(|(found, expected)| (found / expected - 1.0).abs());
    let worst = errors.fold(0.0, f64::max);
    println!("{name}: {worst:.1e}");
    assert!(worst < ACCURACY, "{name}: {worst:.1e}");
}

/// High irradiance responses of photomorphogenesis (Schaefer 1975).
#[test]
fn hires() {
    let start = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057];
    let reference = [
        7.371_312_573_325_668e-4,
        1.442_485_726_316_185e-4,
        5.888_729_740_967_575e-5,
        1.175_651_343_283_149e-3,
        2.386_356_198_831_33e-3,
        6.238_968_252_742_796e-3,
        2.849_998_395_185_769e-3,
        2.850_001_604_814_231e-3,
    ];
    let reactions: [Reaction<'_>; 15] = [
        (0.0007, &[], &[0]),
        (1.71, &[0], &[1]),
        (0.43, &[1], &[0]),
        (8.32, &[1], &[3]),
        (8.32, &[2], &[0]),
        (1.71, &[2], &[3]),
        (0.43, &[3], &[2]),
        (0.69, &[3], &[5]),
        (0.035, &[4], &[2]),
        (1.71, &[4], &[5]),
        (0.43, &[5], &[4]),
        (280.0, &[5, 7], &[6]),
        (0.43, &[6], &[4, 7]),
        (0.69, &[6], &[5, 7]),
        (0.69, &[6], &[7]),
    ];
    judge("HIRES", &mass_action(&start, &[1e-3; 8], &reactions), 321.8122, &reference);
}

/// The Oregonator (Field and Noyes 1974).
#[test]
fn orego() {
    let mut b = Build::default();
    let y = states(&mut b, &[1.0, 2.0, 3.0], &[1.0, 1.0, 1.0]);
    let one = b.num(1.0);
    let small = b.scale(8.375e-6, y[0]);
    let left = b.sub(one, small);
    let left = b.sub(left, y[1]);
    let product = b.mul(y[0], left);
    let sum = b.add(y[1], product);
    let first = b.scale(77.27, sum);
    let more = b.add(one, y[0]);
    let product = b.mul(more, y[1]);
    let gap = b.sub(y[2], product);
    let second = b.scale(1.0 / 77.27, gap);
    let gap = b.sub(y[0], y[2]);
    let third = b.scale(0.161, gap);
    b.rates(&[first, second, third]);
    judge("OREGO", &b, 360.0, &[1.000_814_870_318_523, 1_228.178_521_549_917, 132.055_494_284_670_6]);
}

/// Van der Pol's oscillator with a stiffness of 1e6.
#[test]
fn van_der_pol() {
    let mut b = Build::default();
    let y = states(&mut b, &[2.0, 0.0], &[1.0, 1.0]);
    let square = b.mul(y[0], y[0]);
    let one = b.num(1.0);
    let damping = b.sub(one, square);
    let force = b.mul(damping, y[1]);
    let sum = b.sub(force, y[0]);
    let second = b.scale(1e6, sum);
    b.rates(&[y[1], second]);
    judge("Van der Pol, 1e6", &b, 2.0, &[1.706_167_732_170_483, -0.892_809_701_024_797_5]);
}

/// Air pollution (Verwer 1994).
#[test]
fn pollu() {
    let mut start = [0.0; 20];
    for (i, amount) in [(1, 0.2), (3, 0.04), (6, 0.1), (7, 0.3), (8, 0.01), (16, 0.007)] {
        start[i] = amount;
    }
    let reactions: [Reaction<'_>; 25] = [
        (0.35, &[0], &[1, 2]),
        (26.6, &[1, 3], &[0]),
        (1.23e4, &[4, 1], &[5, 0]),
        (8.6e-4, &[6], &[4, 4, 7]),
        (8.2e-4, &[6], &[7]),
        (1.5e4, &[6, 5], &[7, 4]),
        (1.3e-4, &[8], &[4, 7, 9]),
        (2.4e4, &[8, 5], &[10]),
        (1.65e4, &[10, 1], &[9, 0, 11]),
        (9e3, &[10, 0], &[12]),
        (0.022, &[12], &[10, 0]),
        (1.2e4, &[9, 1], &[13, 0]),
        (1.88, &[13], &[4, 6]),
        (1.63e4, &[0, 5], &[14]),
        (4.8e6, &[2], &[3]),
        (3.5e-4, &[3], &[15]),
        (0.0175, &[3], &[2]),
        (1e8, &[15], &[5, 5]),
        (4.44e11, &[15], &[2]),
        (1.24e3, &[16, 5], &[17, 4]),
        (2.1, &[18], &[1]),
        (5.78, &[18], &[0, 2]),
        (0.0474, &[0, 3], &[18]),
        (1.78e3, &[18, 0], &[19]),
        (3.12, &[19], &[18, 0]),
    ];
    let reference = [
        5.646_255_480_022_769e-2,
        1.342_484_130_422_339e-1,
        4.139_734_331_099_427e-9,
        5.523_140_207_484_359e-3,
        2.018_977_262_302_196e-7,
        1.464_541_863_493_966e-7,
        7.784_249_118_997_987e-2,
        3.245_075_353_396_018e-1,
        7.494_013_383_880_406e-3,
        1.622_293_157_301_561e-8,
        1.135_863_833_257_075e-8,
        2.230_505_975_721_359e-3,
        2.087_162_882_798_63e-4,
        1.396_921_016_840_158e-5,
        8.964_884_856_898_295e-3,
        4.352_846_369_330_103e-18,
        6.899_219_696_263_405e-3,
        1.007_803_037_365_946e-4,
        1.772_146_513_969_984e-6,
        5.682_943_292_316_392e-5,
    ];
    judge("POLLU", &mass_action(&start, &[1e-6; 20], &reactions), 60.0, &reference);
}
