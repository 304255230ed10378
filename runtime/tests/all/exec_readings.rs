//! Readings: noise from the seed, looks at reports, watches without imperfection.

use matterix_ir::plan::Step;
use matterix_runtime::exec::Tee;
use matterix_runtime::run::{Outcome, RunOptions, run};

use crate::exec_build::{Lab, Log, Run, unit};

/// Records two noisy readings of a ramp each second, in the order given.
fn recorded(seed: u64, second_first: bool) -> Vec<(f64, String, Vec<f64>)> {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let (a, b) = (lab.reading("a", value, Some(0.1), Some(0.5)), lab.reading("b", value, Some(0.1), None));
    let every = lab.number(1.0);
    let record = |lab: &mut Lab, name: &str, node| {
        lab.step(Step::Record { name: name.into(), value: vec![node], unit: unit(), every })
    };
    let mut steps = vec![record(&mut lab, "a", a), record(&mut lab, "b", b)];
    if second_first {
        steps.reverse();
    }
    steps.push(lab.wait(5.0));
    let root = lab.seq(&steps);
    let Run { log, .. } = lab.run_with(root, &RunOptions { seed, ..RunOptions::default() }).passed();
    let mut records = log.records;
    records.sort_by(|x, y| x.1.cmp(&y.1).then(x.0.total_cmp(&y.0)));
    records
}

#[test]
fn noise_follows_the_seed_and_not_the_order() {
    let one = recorded(7, false);
    assert_eq!(one.len(), 12);
    assert_eq!(one, recorded(7, false));
    assert_eq!(one, recorded(7, true));
    assert_ne!(one, recorded(8, false));
    let off: Vec<f64> = one.iter().map(|(t, _, v)| v[0] - t).collect();
    assert!(off.iter().all(|d| d.abs() < 0.6) && off.iter().any(|d| d.abs() > 1e-3), "{off:?}");
}

fn waits(noise: Option<f64>, period: Option<f64>, limit: f64) -> Outcome {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let reading = lab.reading("mass", value, noise, period);
    let condition = lab.at_least(reading, limit);
    let root = lab.wait_until(condition, Some(100.0));
    lab.run(root).passed().outcome
}

#[test]
fn a_condition_on_a_reading_is_looked_at_when_it_reports() {
    assert_eq!(waits(None, Some(0.5), 3.3).end_time, 3.5);
    let noisy = waits(Some(0.2), Some(0.5), 3.3).end_time;
    assert_eq!((noisy / 0.5).fract(), 0.0);
    assert!((2.0..5.0).contains(&noisy));
}

#[test]
fn a_reading_without_a_period_is_watched_without_noise() {
    assert!((waits(Some(5.0), None, 3.3).end_time - 3.3).abs() < 1e-3);
}

#[test]
fn keep_and_hold_look_at_reports() {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let reading = lab.reading("probe", value, None, Some(2.0));
    let cool = lab.below(reading, 7.1);
    let long = lab.wait(100.0);
    let root = lab.keep(cool, long);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.outcome.end_time), ("broken", 8.0));
    let warm = lab.at_least(reading, 3.0);
    let root = lab.hold(warm, 5.0, None);
    assert_eq!(lab.run(root).passed().outcome.end_time, 9.0);
}

#[test]
fn looks_at_readings_are_told_to_every_listener() {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let reading = lab.reading("mass", value, None, Some(0.5));
    let condition = lab.at_least(reading, 1.2);
    lab.program.plan.root = lab.wait_until(condition, None);
    let (mut first, mut second) = (Log::default(), Log::default());
    run(&lab.program, &RunOptions::default(), &mut Tee(&mut first, &mut second));
    let seen: Vec<f64> = first.readings.iter().map(|(t, _, v)| (t + v) / 2.0).collect();
    assert!(seen.iter().zip([0.0, 0.5, 1.0, 1.5]).all(|(a, b)| (a - b).abs() < 1e-6) && seen.len() == 4, "{seen:?}");
    assert_eq!(first.readings, second.readings);
    assert!(first.samples > 0 && first.samples == second.samples);
}
