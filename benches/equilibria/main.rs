//! What equilibria cost, and how exactly they are met.
//!
//! `cargo bench -p matterix-ir --bench equilibria` solves 100,000 random mixtures of 1e-9 to 1e3 mol and says by how much the worst one is
//! off; then the time of a solution by the number of species, with its exponent, and that of a titration of 100 steps. It ends with an
//! error where a mixture has no solution, or one that is off. `-- --mixtures 1000` takes fewer.

#![allow(clippy::disallowed_methods, reason = "a bench measures time")]

mod chemistry;
mod judge;
#[path = "../../lang/ir/src/equilibrium/sketch.rs"]
mod sketch;

use std::time::Instant;

use chemistry::{Draw, ready};
use matterix_ir::equilibrium::{Equation, Member, Part, Phase, System, Unsettled, Written};
use sketch::Sketch;

/// How many of a hundred may have no solution, and bounds of what is off: of equations, and of atoms and charge.
struct Bounds {
    failed: u64,
    equations: f64,
    kept: f64,
    /// Below this share of the solvent an amount is none.
    trace: f64,
}

const ACIDS: Bounds = Bounds { failed: 0, equations: 1e-10, kept: 1e-12, trace: 1e-27 };

/// Where half-cells leave the potential open, beyond what rounding tells, there may be no solution; it is never another one.
const HALF_CELLS: Bounds = Bounds { failed: 2, equations: 1e-6, kept: 1e-9, trace: 1e-12 };

fn main() -> Result<(), String> {
    let args: Vec<String> = std::env::args().collect();
    let given = args.iter().position(|a| a == "--mixtures").and_then(|i| args.get(i + 1));
    let count = given.map_or(Ok(100_000), |n| n.parse::<u64>().map_err(|e| format!("--mixtures {n}: {e}")))?;
    let fine = [
        random("acids, ammonia, silver and lime", count, chemistry::bench(), &ACIDS)?,
        random("half-cells", count / 10, Sketch::half_cells(), &HALF_CELLS)?,
    ];
    sizes()?;
    titration()?;
    if fine == [true; 2] { Ok(()) } else { Err("a mixture has no solution, or one that is off".into()) }
}

/// One of every second mixture has something of each kind; sizes and shares go over many orders.
fn mixture(seed: u64, (system, blank): &(System, Vec<f64>)) -> Vec<f64> {
    let (mut draw, layout, mut args) = (Draw::new(seed), system.layout(), blank.clone());
    let size = 10f64.powf(draw.between(-9.0, 3.0));
    let share = draw.between(0.2, 0.9);
    for i in 1..system.members().len() {
        if system.members()[i].phase != Phase::Formal && draw.share() < share {
            args[layout.amount(i)] = size * 10f64.powf(draw.between(-9.0, -0.5));
        }
    }
    args[layout.amount(0)] = size * draw.between(1.0, 51.0);
    if seed.is_multiple_of(3) {
        args[layout.capacity()] = 75.3 * args[layout.amount(0)];
        args[layout.heat()] = args[layout.capacity()] * draw.between(-10.0, 30.0);
    }
    args
}

/// Solves random mixtures; whether all are met.
fn random(of: &str, count: u64, sketch: Sketch, bounds: &Bounds) -> Result<bool, String> {
    let made = ready(sketch)?;
    let elements = judge::elements(&made.0);
    let mut worst = [(0.0, 0); 3];
    let mut failed = Vec::new();
    for seed in 0..count {
        let args = mixture(seed, &made);
        let Some(found) = judge::gaps(&made.0, &args, &elements, bounds.trace) else {
            failed.push(seed);
            continue;
        };
        for (worst, gap) in worst.iter_mut().zip([found.equations, found.atoms, found.charge]) {
            if gap > worst.0 {
                *worst = (gap, seed);
            }
        }
    }
    println!("{count} random mixtures of {} species, 1e-9 to 1e3 mol: {of}", made.0.members().len());
    println!("  without a solution        {}", failed.len());
    if let Some(first) = failed.first() {
        println!("  the first of them         {first}");
    }
    for (name, (gap, seed)) in ["equations, worst", "atoms, worst", "charge, worst"].iter().zip(worst) {
        println!("  {name:25} {gap:.1e} (mixture {seed})");
    }
    let few = 100 * failed.len() as u64 <= bounds.failed * count;
    Ok(few && worst[0].0 <= bounds.equations && worst[1].0 <= bounds.kept && worst[2].0 <= bounds.kept)
}

/// How long it takes on average, s.
fn time(count: usize, mut work: impl FnMut(usize)) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        (0..count).for_each(&mut work);
        best = best.min(start.elapsed().as_secs_f64() / count as f64);
    }
    best
}

fn sizes() -> Result<(), String> {
    println!("\nsolution by number of species, each mixture new");
    let mut points = Vec::new();
    for size in [12, 25, 50, 100, 200] {
        let (system, blank) = ready(chemistry::of_size(size))?;
        let layout = system.layout();
        let count = 400;
        let mixtures: Vec<Vec<f64>> = (0..5 * count)
            .map(|seed| {
                let (mut draw, mut args) = (Draw::new(seed as u64), blank.clone());
                for i in 1..system.members().len() {
                    args[layout.amount(i)] = 10f64.powf(draw.between(-5.0, -1.5));
                }
                args
            })
            .collect();
        let mut next = 0;
        let took = time(count, |_| {
            std::hint::black_box(system.value(Part::Activity(1), &mixtures[next % mixtures.len()]));
            next += 1;
        });
        println!("  {:4} species {:8.1} us", system.members().len(), took * 1e6);
        points.push(((system.members().len() as f64).ln(), took.ln()));
    }
    println!("  exponent     {:8.2}", slope(&points));
    Ok(())
}

/// Sodium carbonate with acid in 100 steps.
fn titration() -> Result<(), String> {
    let (system, blank) = ready(chemistry::carbonate())?;
    let find = |name: &str| system.members().iter().position(|m| m.name == name).ok_or(format!("no {name}"));
    let (soda, acid) = (system.layout().amount(find("CO3--")?), system.layout().amount(find("H+")?));
    let mut round = 0;
    let took = time(20, |_| {
        round += 1;
        for step in 0..100 {
            let mut args = blank.clone();
            args[soda] = 0.1 + f64::from(round) * 1e-6;
            args[acid] = 0.0025 * f64::from(step);
            std::hint::black_box(system.value(Part::Activity(1), &args));
        }
    });
    println!("\ncarbonate titration of 100 steps {:.3} ms", took * 1e3);
    Ok(())
}

/// Slope of a line through points.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let (xy, xx) = (mean(&|p| (p.0 - x) * (p.1 - y)), mean(&|p| (p.0 - x) * (p.0 - x)));
    xy / xx
}
