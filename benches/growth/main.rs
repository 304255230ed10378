//! How the cost of a run grows with the lab: `cargo bench --bench growth -- [KIND [SIZE...]]`; `generate KIND SIZE` prints a program.
//!
//! Each lab is run at several sizes; what the command takes for the smallest lab there is counts as start-up and is taken off. The
//! exponent is the slope of the logarithms from one size to the next: 1 is in proportion.

mod labs;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use labs::{KINDS, Kind};

/// Runs of which the fastest counts.
const RUNS: usize = 3;

/// What is measured of one command.
#[derive(Clone, Copy)]
struct Cost {
    /// s.
    time: f64,
    /// The most memory it held, MB; 0 where the system does not tell.
    memory: f64,
}

fn main() {
    // Cargo adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let named = |word: &String| KINDS.iter().find(|kind| kind.name == word);
    if let [first, kind, size] = words.as_slice()
        && first == "generate"
    {
        let kind = named(kind).expect("a kind of lab");
        print!("{}", (kind.program)(size.parse().expect("a number")));
        return;
    }
    let sizes: Vec<usize> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("growth");
    fs::create_dir_all(&dir).expect("a folder");
    for kind in KINDS.iter().filter(|kind| {
        words.iter().all(|w| w.parse::<usize>().is_ok() || named(w).is_some_and(|n| n.name == kind.name))
    }) {
        measure(kind, if sizes.is_empty() { kind.sizes } else { &sizes }, &dir);
    }
}

fn measure(kind: &Kind, sizes: &[usize], dir: &Path) {
    println!("\n{}", kind.text);
    let start = cost("run", &(kind.program)(if kind.name == "species" { 2 } else { 1 }), dir);
    let mut before: Option<(usize, Cost)> = None;
    for &size in sizes {
        let text = (kind.program)(size);
        let (run, check) = (cost("run", &text, dir), cost("check", &text, dir));
        let left = Cost { time: (run.time - start.time).max(1e-3), memory: (run.memory - start.memory).max(1e-1) };
        let slope = |of: fn(&Cost) -> f64| {
            before.as_ref().map_or(String::from("    "), |(smaller, cost)| {
                let ratio = (of(&left) / of(cost)).ln() / (size as f64 / *smaller as f64).ln();
                format!("{ratio:4.2}")
            })
        };
        println!(
            "{size:>6}  run {:>8.3} s  exponent {}   check {:>8.3} s   {:>7.1} MB  exponent {}",
            run.time,
            slope(|cost| cost.time),
            check.time,
            run.memory,
            slope(|cost| cost.memory),
        );
        before = Some((size, left));
    }
}

/// What the command takes for a program.
fn cost(verb: &str, text: &str, dir: &Path) -> Cost {
    let file = dir.join("lab.mtx");
    fs::write(&file, text).expect("a file");
    let costs = (0..RUNS).map(|_| once(verb, &file, dir));
    costs.min_by(|a, b| a.time.total_cmp(&b.time)).expect("some runs")
}

#[expect(clippy::disallowed_methods, reason = "to measure is what a benchmark is for")]
fn once(verb: &str, file: &Path, dir: &Path) -> Cost {
    let mut command = Command::new(env!("CARGO_BIN_EXE_matterixc"));
    command.env("XDG_CACHE_HOME", dir.join("cache")).arg(verb).arg(file).stdout(Stdio::null()).stderr(Stdio::null());
    let began = Instant::now();
    let mut child = command.spawn().expect("the command");
    let mut memory = 0.0;
    let status = loop {
        memory = f64::max(memory, held(child.id()));
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        std::thread::sleep(Duration::from_micros(500));
    };
    let time = began.elapsed().as_secs_f64();
    assert!(status.success(), "matterixc {verb} {}: {status}", file.display());
    Cost { time, memory }
}

/// The most memory that a process has held so far, MB.
fn held(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}
