//! Plans by lot, and where the checker, the twin and an independent interpreter disagree about them:
//! `cargo bench -p matterix-soundness`. docs/soundness.md says what is compared.
//!
//! `-- --plans N` draws so many, `--from SEED` begins with another seed, `--threads T` uses so many threads, `--out FILE` writes the
//! tables and all disagreements into a file, `--shrink N` shows the smallest plan of the first N disagreements of each kind,
//! `--show SEED` one plan with all that is said of it.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write;
use std::sync::{Mutex, PoisonError};

use matterix_soundness::generate::generate;
use matterix_soundness::judge::{Verdict, judge};
use matterix_soundness::plan::Plan;
use matterix_soundness::print::print as text;
use matterix_soundness::report::Tally;
use matterix_soundness::survey::{Judged, smallest, survey};

/// Plans of a whole survey.
const PLANS: u64 = 100_000;

/// What was asked for.
struct Arguments {
    plans: u64,
    from: u64,
    threads: usize,
    out: Option<String>,
    shrink: usize,
    show: Option<u64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked = arguments()?;
    if let Some(seed) = asked.show {
        let plan = generate(seed);
        let verdict = judge(std::slice::from_ref(&plan), seed, 1_000, &mut matterix_lang::Session::default()).remove(0);
        show(&plan, &verdict);
        return Ok(());
    }
    let tally = Mutex::new(Tally::default());
    let shown = Mutex::new(BTreeMap::new());
    let lines = Mutex::new(BTreeSet::new());
    let done = survey(asked.from, asked.plans, asked.threads, &|judged: Judged| {
        tally.lock().unwrap_or_else(PoisonError::into_inner).add(&judged);
        for d in &judged.verdict.disagreements {
            let line = format!("{} -- {}", d.signature(), d.what);
            match asked.out {
                Some(_) => drop(lines.lock().unwrap_or_else(PoisonError::into_inner).insert((judged.seed, line))),
                None => println!("{}: {line}", judged.seed),
            }
            let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
            let n: &mut usize = shown.entry((d.sort, d.code.clone())).or_default();
            *n += 1;
            if *n <= asked.shrink {
                drop(shown);
                let (plan, verdict) = smallest(&judged.plan, d);
                show(&plan, &verdict);
            }
        }
    });
    let mut report = tally.into_inner().unwrap_or_else(PoisonError::into_inner).tables();
    match asked.out {
        None => println!("\n{report}"),
        Some(path) => {
            for (seed, line) in lines.into_inner().unwrap_or_else(PoisonError::into_inner) {
                writeln!(report, "{seed}: {line}")?;
            }
            if let Err(broken) = &done {
                writeln!(report, "{broken}")?;
            }
            std::fs::write(path, report)?;
        }
    }
    Ok(done?)
}

fn arguments() -> Result<Arguments, Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut asked = Arguments { plans: PLANS, from: 0, threads, out: None, shrink: 0, show: None };
    let mut rest = std::env::args().skip(1);
    while let Some(word) = rest.next() {
        let mut number = || rest.next().ok_or_else(|| format!("{word} needs a value"));
        match word.as_str() {
            // Cargo adds it.
            "--bench" => {}
            "--plans" => asked.plans = number()?.parse()?,
            "--threads" => asked.threads = number()?.parse()?,
            "--out" => asked.out = Some(number()?),
            "--from" => asked.from = number()?.parse()?,
            "--shrink" => asked.shrink = number()?.parse()?,
            "--show" => asked.show = Some(number()?.parse()?),
            other => return Err(format!("what is {other}?").into()),
        }
    }
    Ok(asked)
}

/// A plan, and what is said of it.
fn show(plan: &Plan, verdict: &Verdict) {
    println!("{}", text(std::slice::from_ref(plan)).text);
    for d in &verdict.disagreements {
        println!("// {}: {}", d.signature(), d.what);
    }
    for f in &verdict.findings {
        println!("// {:?} {}: {} {:?}", f.severity, f.code, f.headline, f.stmts);
    }
    println!("// violations: {:?}\n", verdict.summary.violations);
}
