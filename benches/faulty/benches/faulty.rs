//! Deployments on seeded faults: `cargo bench -p matterix-faulty`. docs/deploy.md says what is judged.
//!
//! `-- --trials N` makes so many, `--from SEED` begins with another seed, `--threads T` uses so many threads, `--show SEED` shows one.

use std::collections::BTreeMap;
use std::error::Error;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use matterix_faulty::trial::{End, trial};

const TRIALS: u64 = 10_000;

fn main() -> Result<(), Box<dyn Error>> {
    let (mut trials, mut from, mut threads, mut show) = (TRIALS, 0, 0, None);
    let mut args = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(arg) = args.next() {
        let mut number = || args.next().and_then(|n| n.parse::<u64>().ok()).ok_or(format!("{arg} takes a number"));
        match arg.as_str() {
            "--trials" => trials = number()?,
            "--from" => from = number()?,
            "--threads" => threads = number()? as usize,
            "--show" => show = Some(number()?),
            other => return Err(format!("unknown: {other}").into()),
        }
    }
    if let Some(seed) = show {
        let verdict = trial(seed);
        println!(
            "{}\n{}: {:?} after {} processes",
            verdict.log.join("\n"),
            verdict.lab,
            verdict.end,
            verdict.processes
        );
        verdict.wrong.iter().for_each(|w| println!("wrong: {w}"));
        return Ok(());
    }
    if threads == 0 {
        threads = std::thread::available_parallelism().map_or(1, usize::from);
    }
    let (next, tally) = (AtomicU64::new(from), Mutex::new((BTreeMap::<(&str, End), u64>::new(), Vec::new())));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= from + trials {
                        return;
                    }
                    let verdict = trial(seed);
                    let mut tally = tally.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    *tally.0.entry((verdict.lab, verdict.end)).or_default() += 1;
                    if !verdict.wrong.is_empty() {
                        println!("seed {seed}, {}: {}", verdict.lab, verdict.wrong.join("; "));
                        tally.1.push(seed);
                    }
                }
            });
        }
    });
    let (counts, wrong) = tally.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    for ((lab, end), n) in counts {
        println!("{lab}: {n} {end:?}");
    }
    println!("{} of {trials} trials are wrong", wrong.len());
    if wrong.is_empty() { Ok(()) } else { Err("see above".into()) }
}
