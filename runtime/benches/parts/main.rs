//! How long large parts take: `cargo bench -p matterix-runtime --bench parts -- [PATTERN] [SIZE...]`.

mod patterns;

use std::time::Instant;

use matterix_ir::model::Model;
use matterix_runtime::process::{Engine, Observer, Options};

/// Runs are repeated for so long, s.
const SPAN: f64 = 1.0;

/// Counts samples: the steps of all parts.
#[derive(Default)]
struct Steps(usize);

impl Observer for Steps {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {
        self.0 += 1;
    }

    fn event(&mut self, _: f64, _: usize) {}

    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

/// Follows a model to `until`, s; steps, and the sum of its states.
fn follow(model: &Model, until: f64) -> (usize, f64) {
    let mut engine = Engine::new(model, Vec::new(), 4, Options::default()).expect("initial states are finite");
    let mut steps = Steps::default();
    engine.start(&mut steps).expect("starts");
    engine.advance(until, &[], &mut steps).expect("is followed");
    engine.finish(&mut steps).expect("ends");
    (steps.0, engine.states().iter().sum())
}

/// The least time of several runs, s, and what they come to.
#[expect(clippy::disallowed_methods, reason = "to measure is what a benchmark is for")]
fn least(model: &Model, until: f64) -> (f64, usize, f64) {
    let begin = Instant::now();
    let mut least = f64::INFINITY;
    loop {
        let start = Instant::now();
        let (steps, sum) = follow(model, until);
        least = least.min(start.elapsed().as_secs_f64());
        if begin.elapsed().as_secs_f64() > SPAN {
            return (least, steps, sum);
        }
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let sizes: Vec<usize> = words.iter().filter_map(|w| w.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![10, 30, 100, 300, 1000] } else { sizes };
    let wanted = |name: &str| words.iter().all(|w| w.parse::<usize>().is_ok() || w == name);
    for (name, build, until) in patterns::ALL.into_iter().filter(|p| wanted(p.0)) {
        for &size in &sizes {
            let model = build(size);
            let (time, steps, sum) = least(&model, until);
            println!("{name} {size}: {time:.4} s, {steps} samples, sum {sum:.9e}");
        }
    }
}
