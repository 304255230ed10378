//! How often workflows end as expected where things stand a little away from their places.
//!
//! `cargo bench --bench environments` runs every file of `examples/environments` from 100 labs, each with its things moved
//! by up to 20 mm and turned by up to 10 degrees, at motion fidelity, and prints the share that passed, what the others
//! failed with and at which seeds. `-- funnel` takes the files whose name holds this, `-- --seeds 10` other numbers of labs.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::{available_parallelism, scope};
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds `--bench`.
    let mut args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let mut seeds = 100;
    if let Some(at) = args.iter().position(|a| a == "--seeds") {
        seeds = args.get(at + 1).ok_or("--seeds takes a number")?.parse()?;
        args.drain(at..=at + 1);
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/environments");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|f| f.extension().is_some_and(|e| e == "mtx"));
    files.retain(|f| args.is_empty() || args.iter().any(|a| name(f).contains(a)));
    files.sort();
    println!("| environment | passed | of | a run, s | failures |");
    println!("| --- | --- | --- | --- | --- |");
    let (mut passed, mut ran) = (0, 0);
    for file in &files {
        #[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
        let start = Instant::now();
        let ended = all(file, seeds);
        let each = start.elapsed().as_secs_f64() * lanes() as f64 / f64::from(seeds.max(1));
        let failures: Vec<String> =
            ended.iter().filter_map(|(seed, why)| Some(format!("{seed}: {}", why.as_ref()?))).collect();
        let good = ended.len() - failures.len();
        println!("| {} | {good} | {} | {each:.2} | {} |", name(file), ended.len(), failures.join("; "));
        passed += good;
        ran += ended.len();
    }
    println!("| all | {passed} | {ran} | | {:.2} % |", 100.0 * passed as f64 / ran.max(1) as f64);
    Ok(())
}

fn name(file: &Path) -> String {
    file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

fn lanes() -> usize {
    available_parallelism().map_or(1, |n| n.get())
}

/// Each seed with why its run failed, if it did.
fn all(file: &Path, seeds: u32) -> Vec<(u32, Option<String>)> {
    let lanes = lanes() as u32;
    let share =
        |lane: u32| (1..=seeds).filter(move |s| s % lanes == lane).map(|s| (s, one(file, s))).collect::<Vec<_>>();
    let mut out: Vec<_> = scope(|threads| {
        let running: Vec<_> = (0..lanes).map(|lane| threads.spawn(move || share(lane))).collect();
        running.into_iter().flat_map(|r| r.join().unwrap_or_default()).collect()
    });
    out.sort();
    out
}

/// Why a run failed: the first error it reports.
fn one(file: &Path, seed: u32) -> Option<String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_matterixc"));
    command.arg("run").arg(file).args(["--fidelity", "motion", "--perturb", "20mm,10deg"]);
    let ended = match command.args(["--seed", &seed.to_string()]).output() {
        Ok(ended) if ended.status.success() => return None,
        Ok(ended) => ended,
        Err(why) => return Some(why.to_string()),
    };
    let text = String::from_utf8_lossy(&ended.stderr).into_owned();
    Some(text.lines().find(|l| l.starts_with("error")).unwrap_or("ended without an error").to_string())
}
