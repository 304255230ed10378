//! One run of an environment from one lab, and what the judge says of its recording.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer is ended, s.
const LONGEST: u64 = 300;
/// How often a run is looked at, ms.
const PAUSE: u64 = 20;

/// How environments are run, beside their seed.
pub type How = [&'static str];

/// Motions among things that stand a little away from their places.
pub const MOTION: &How = &["--fidelity", "motion", "--perturb", "20mm,10deg"];
/// The same with what grips bear, and things that are not quite where they are taken to be.
pub const CONTACT: &How = &["--fidelity", "contact", "--perturb", "20mm,10deg", "--unseen", "2mm,1deg"];
/// What goes into a hole that is not quite where it is taken to be.
pub const PEG: &How = &["--fidelity", "contact", "--unseen", "1mm,2deg"];

/// What became of a run.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What the lab was moved by.
    pub seed: u32,
    /// How long it took, s.
    pub seconds: f64,
    /// The code of its first error, if it ended in one; a failure of the run by its own name.
    pub fault: Option<String>,
    /// What that error says.
    pub why: Option<String>,
    /// Whether there was a recording to judge: one that never began has none.
    pub judged: bool,
    /// What the judge found wrong.
    pub wrong: Vec<String>,
}

/// Runs a file from one lab and judges what was recorded.
#[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
pub fn trial(file: &Path, how: &How, seed: u32) -> Trial {
    let start = Instant::now();
    let out = folder(file, seed);
    let said = run(file, how, seed, &out, start);
    let (fault, why) = said.map(|said| (code(&said), said)).unzip();
    let seconds = start.elapsed().as_secs_f64();
    let recording = std::fs::read(out.join("recording.mcap")).ok();
    let wrong = match recording.as_deref().map(matterix_judge::judge) {
        Some(Ok(verdict)) => verdict.wrong.iter().map(|w| format!("{:.2} s {}", w.time(), w.text())).collect(),
        Some(Err(why)) => vec![why.to_string()],
        None => Vec::new(),
    };
    // What is left behind is only in the way.
    let _ = std::fs::remove_dir_all(&out);
    Trial { seed, seconds, fault, why, judged: recording.is_some(), wrong }
}

/// A folder of its own for every run.
fn folder(file: &Path, seed: u32) -> PathBuf {
    let stem = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    std::env::temp_dir().join(format!("matterix-environments-{}", std::process::id())).join(format!("{stem}-{seed}"))
}

/// Why a run failed, if it did: the headline of its first error.
fn run(file: &Path, how: &How, seed: u32, out: &Path, start: Instant) -> Option<String> {
    let binary = std::env::var_os("MATTERIX_BIN").unwrap_or_else(|| env!("CARGO_BIN_EXE_matterixc").into());
    if let Err(why) = std::fs::create_dir_all(out) {
        return Some(why.to_string());
    }
    let errors = out.join("errors.txt");
    let stderr = match std::fs::File::create(&errors) {
        Ok(file) => file,
        Err(why) => return Some(why.to_string()),
    };
    let mut command = Command::new(&binary);
    command.arg("run").arg(file).args(how);
    command.args(["--seed", &seed.to_string(), "--no-cache", "--out"]).arg(out);
    let spawned = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr).spawn();
    let mut child = match spawned {
        Ok(child) => child,
        Err(why) => return Some(format!("{}: {why}", binary.to_string_lossy())),
    };
    loop {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return None,
            Ok(Some(_)) => break,
            Ok(None) if start.elapsed() > Duration::from_secs(LONGEST) => {
                let _ = child.kill();
                let _ = child.wait();
                return Some("over-long".to_string());
            }
            Ok(None) => std::thread::sleep(Duration::from_millis(PAUSE)),
            Err(why) => return Some(why.to_string()),
        }
    }
    let text = std::fs::read_to_string(&errors).unwrap_or_default();
    let lines = text.lines().skip_while(|l| !l.starts_with("error"));
    let headline: Vec<&str> =
        lines.map(str::trim).take_while(|l| !l.is_empty() && !l.starts_with(['╭', '['])).collect();
    Some(if headline.is_empty() { "ended without an error".to_string() } else { headline.join(" ") })
}

/// The failure of a run, or else the code of an error, or else all of its line.
fn code(line: &str) -> String {
    let between = |from: &str, to: char| Some(line.split_once(from)?.1.split_once(to)?.0.to_string());
    between("failed with `", '`').or_else(|| between("error[", ']')).unwrap_or_else(|| line.to_string())
}
