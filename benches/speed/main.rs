//! How long things take: `cargo bench --bench speed`. A table of medians; docs/notes/performance.md says what is meant by each line.
//!
//! The comparison with scipy needs a Python that has it, `python3` or the one `MATTERIX_PYTHON` names.

#![allow(clippy::unwrap_used)]

mod generate;
mod models;
mod plate;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use matterix_ir::model::Model;
use matterix_ir::{Program, Sources};
use matterix_lang::LibraryOnly;
use matterix_runtime::process::{Engine, Options};
use matterix_runtime::run::RunOptions;

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [flag, what] = arguments.as_slice()
        && flag == "generate"
    {
        let text = match what.as_str() {
            "plate" => plate::program(),
            "rows" => plate::rows(),
            lines => generate::program(lines.parse().unwrap()),
        };
        print!("{text}");
        return;
    }
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed");
    fs::create_dir_all(&dir).unwrap();
    println!("median of the times of several runs; the fastest in brackets\n");
    check(&dir);
    robots();
    run(&dir);
    robertson();
    match lsoda() {
        Ok(()) => {}
        Err(why) => println!("\ncomparison with scipy skipped: {why}"),
    }
}

/// Times of a piece of work.
struct Times {
    median: Duration,
    fastest: Duration,
}

fn time(repeats: usize, mut work: impl FnMut()) -> Times {
    work();
    let mut times: Vec<Duration> = (0..repeats)
        .map(|_| {
            #[expect(clippy::disallowed_methods, reason = "to measure is what a benchmark is for")]
            let began = Instant::now();
            work();
            began.elapsed()
        })
        .collect();
    times.sort();
    Times { median: times[repeats / 2], fastest: times[0] }
}

fn show(what: &str, times: &Times) {
    let ms = |d: Duration| d.as_secs_f64() * 1e3;
    println!("{what:<64} {:>9.2} ms  [{:.2}]", ms(times.median), ms(times.fastest));
}

/// The command, which must succeed.
fn command(args: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_matterixc"));
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed/cache"));
    let status = command.args(args).stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    assert!(status.success(), "matterixc {args:?}: {status}");
}

fn check(dir: &Path) {
    for (lines, repeats) in [(200, 31), (20_000, 5)] {
        let file = dir.join(format!("generated_{lines}.mtx"));
        edited_and_not(&file, &generate::program(lines), "generated lines", repeats);
    }
    edited_and_not(&dir.join("plate.mtx"), &plate::program(), "lines on a plate of 96 wells", 31);
    replanned(&dir.join("waits.mtx"), &plate::program(), "with 1,388 operations");
    replanned(&dir.join("rows.mtx"), &plate::rows(), "with 600 operations, most of them in loops");
}

/// A file with another `wait` before each check: what was found in the whole plan before says nothing of it, the motions are the
/// same. Then for the first time.
fn replanned(file: &Path, text: &str, what: &str) {
    let path = file.to_str().unwrap();
    for (options, how) in [(&[][..], ""), (&["--fidelity", "process"][..], " at --fidelity process")] {
        let name = format!("matterixc check{how}, {} lines {what}", text.lines().count());
        let wait = |edit| text.replacen("wait 2 s\n", &format!("wait {} s\n", 10 + edit), 1);
        show(&format!("{name}, another wait each time"), &edited(file, 31, options, wait));
        let first = time(7, || command(&[&["check", path, "--no-cache"], options].concat()));
        show(&format!("{name}, for the first time"), &first);
    }
}

/// Checks of a file that is written anew before each of them; `text` is told how often.
fn edited(file: &Path, repeats: usize, options: &[&str], text: impl Fn(usize) -> String) -> Times {
    let mut edits = 0;
    time(repeats, || {
        edits += 1;
        fs::write(file, text(edits)).unwrap();
        command(&[&["check", file.to_str().unwrap()], options].concat());
    })
}

/// A file that is changed before each check, in a comment, and one that is not.
fn edited_and_not(file: &Path, text: &str, lines: &str, repeats: usize) {
    let what = format!("matterixc check, {} {lines}", text.lines().count());
    let commented = edited(file, repeats, &[], |edit| format!("{text}// edited {edit} times\n"));
    show(&format!("{what}, edited"), &commented);
    show(&format!("{what}, unchanged"), &time(repeats, || command(&["check", file.to_str().unwrap()])));
}

/// Three arms on three benches: all motions planned, and all remembered.
fn robots() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/speed/robots.mtx");
    let file = file.to_str().unwrap();
    show(
        "matterixc check, 12 transfers by three arms, all planned",
        &time(7, || command(&["check", file, "--no-cache"])),
    );
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed/robots.mtx");
    edited_and_not(&copy, &fs::read_to_string(file).unwrap(), "lines, the same with motions remembered", 31);
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

fn run(dir: &Path) {
    let file = example("sn1.mtx");
    let file = file.to_str().unwrap();
    let out = dir.join("out");
    show("matterixc run sn1.mtx, report only", &time(31, || command(&["run", file])));
    let all = time(31, || command(&["run", file, "--out", out.to_str().unwrap()]));
    show("matterixc run sn1.mtx --out, with recording, tables and plot", &all);
    let program = compile(file);
    let recording = models::Recorded::new(&program);
    show("  of which the plot", &time(31, || recording.plot(&program)));
    show("  of which recording and tables", &time(31, || recording.tables(&program)));
    show("SN1, execution and integration alone", &time(31, || assert!(made(&program, Options::default().rtol) > 0.0)));
}

fn compile(file: &str) -> Program {
    let mut sources = Sources::default();
    let file = sources.add("sn1.mtx", fs::read_to_string(file).unwrap());
    let (program, found) = matterix_lang::compile(&mut sources, file, &LibraryOnly, &matterix_lang::Options::default());
    program.unwrap_or_else(|| panic!("{found:?}"))
}

/// The product of SN1 at the end, mmol.
fn made(program: &Program, rtol: f64) -> f64 {
    let process = Options { rtol, ..Options::default() };
    let options = RunOptions { process, ..RunOptions::default() };
    let outcome = matterix_runtime::run::run(program, &options, &mut ());
    let state = program.model.states.iter().position(|s| s.name == "beaker.contents.amount[EtI]").unwrap();
    1e3 * outcome.states[state].unwrap()
}

fn robertson() {
    let model: Model = models::robertson();
    let integrate = || {
        let mut engine = Engine::new(&model, Vec::new(), 0, Options::default()).unwrap();
        engine.start(&mut ()).unwrap();
        engine.advance(1e11, &[], &mut ()).unwrap();
        assert!((engine.states()[0] / 0.208_334_014_970_125_5e-7 - 1.0).abs() < 1e-6);
    };
    show("Robertson's reactions to 1e11 s, to 1e-6", &time(31, integrate));
}

/// One tolerance of one integrator.
struct Point {
    rtol: f64,
    error: f64,
    seconds: f64,
}

/// SN1 by this engine and by LSODA, each against its own tight solution.
fn lsoda() -> Result<(), String> {
    let program = compile(example("sn1.mtx").to_str().unwrap());
    let molar = |name: &str| program.model.species.iter().find(|s| s.name == name).unwrap().molar_mass;
    let mass = 0.010 + 0.012 * (molar("EtOH") + molar("HI"));
    let python = std::env::var("MATTERIX_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/speed/lsoda.py");
    let output = Command::new(&python).arg(script).arg(mass.to_string()).output();
    let output = output.map_err(|e| format!("`{python}` does not start: {e}"))?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_string();
        return Err(format!("`{python}`: {why}"));
    }
    let lines: Vec<serde_json::Value> =
        String::from_utf8_lossy(&output.stdout).lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let number = |v: &serde_json::Value, key: &str| v[key].as_f64().unwrap();
    let theirs: Vec<Point> = lines[1..]
        .iter()
        .map(|v| Point { rtol: number(v, "rtol"), error: number(v, "error"), seconds: number(v, "seconds") })
        .collect();
    let reference = made(&program, 1e-12);
    let apart = (reference / number(&lines[0], "reference") - 1.0).abs();
    println!("\nSN1 against scipy's LSODA; the tight solutions of both differ by {apart:.0e}");
    println!(
        "{:>9} {:>9} {:>10}   {:>10} {:>9} {:>10}   {:>6}",
        "rtol", "error", "ms", "LSODA rtol", "error", "ms", "ratio"
    );
    for power in 4..=8 {
        let rtol = 10f64.powi(-power);
        let error = (made(&program, rtol) / reference - 1.0).abs();
        let seconds = time(15, || assert!(made(&program, rtol) > 0.0)).median.as_secs_f64();
        // The cheapest that is at least as accurate.
        let equal = theirs.iter().filter(|p| p.error <= error).min_by(|a, b| a.seconds.total_cmp(&b.seconds));
        print!("{rtol:>9.0e} {error:>9.0e} {:>10.3}   ", seconds * 1e3);
        match equal {
            Some(p) => {
                let ratio = p.seconds / seconds;
                println!("{:>10.0e} {:>9.0e} {:>10.3}   {ratio:>6.1}", p.rtol, p.error, p.seconds * 1e3);
            }
            None => println!("none is as accurate"),
        }
    }
    Ok(())
}
