//! How often workflows end as expected where things stand a little away from their places, and whether what robots then did
//! stands up to the judge.
//!
//! `cargo bench --bench environments` runs the ten environments from 100 labs each, with their things moved by up to 20 mm and
//! turned by up to 10 degrees, at motion fidelity, on all cores, and judges every recording. It prints how many of them
//! completed, how many recordings the judge found nothing wrong in, and by what faults the others ended.
//!
//! `-- --contact` runs them at contact fidelity: things also really stand up to 2 mm and 1 degree from where robots take them to be, and
//! grips hold by force and friction. It says of each failure why it came about; environments of which a part is not modelled fail with
//! `no-contact-model`. `peg` is among them: a vial of 12.0 mm for a hole of 12.5 mm, each up to 1 mm and 2 degrees off.
//!
//! `-- --seeds 10` takes another number of labs, `-- funnel pour` the environments whose names hold one of these. What is built
//! needs no Cargo: `MATTERIX_BIN` names the command to run, `MATTERIX_EXAMPLES` the folder of the examples, where they are
//! not where they were when it was built.

mod trial;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{available_parallelism, scope};

use trial::{CONTACT, How, MOTION, PEG, Trial, trial};

/// Environments beside those in the folder `environments`.
const BESIDE: [&str; 2] = ["fume_hood.mtx", "kuka_transport.mtx"];
/// The environment beside this file.
const PEG_FILE: &str = "peg.mtx";

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds `--bench`.
    let mut args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let mut seeds = 100;
    if let Some(at) = args.iter().position(|a| a == "--seeds") {
        seeds = args.get(at + 1).ok_or("--seeds takes a number")?.parse()?;
        args.drain(at..=at + 1);
    }
    let contact = args.iter().position(|a| a == "--contact").map(|at| args.remove(at)).is_some();
    let mut files = environments(&args)?;
    let mut hows: Vec<&How> = vec![if contact { CONTACT } else { MOTION }; files.len()];
    if contact && (args.is_empty() || args.iter().any(|w| PEG_FILE.contains(w.as_str()))) {
        files.push(Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/environments").join(PEG_FILE));
        hows.push(PEG);
    }
    let tasks: Vec<(usize, u32)> =
        (0..files.len()).flat_map(|file| (1..=seeds).map(move |seed| (file, seed))).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(vec![Vec::new(); files.len()]));
    let lanes = available_parallelism().map_or(1, |n| n.get());
    scope(|threads| {
        for _ in 0..lanes {
            threads.spawn(|| {
                while let Some(&(file, seed)) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let ended = trial(&files[file], hows[file], seed);
                    if let Ok(mut done) = done.lock() {
                        done[file].push(ended);
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().map_err(|_| "a run was lost")?;
    done.iter_mut().for_each(|trials| trials.sort_by_key(|t| t.seed));
    table(&files, &done);
    Ok(())
}

/// The environments whose name holds one of these words; all where there are none.
fn environments(words: &[String]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let examples = std::env::var_os("MATTERIX_EXAMPLES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), PathBuf::from);
    let folder = std::fs::read_dir(examples.join("environments")).map_err(|why| {
        format!("no examples in `{}`: {why}; MATTERIX_EXAMPLES says where they are", examples.display())
    })?;
    let mut files: Vec<PathBuf> = folder.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|f| f.extension().is_some_and(|e| e == "mtx"));
    files.extend(BESIDE.map(|name| examples.join(name)));
    files.retain(|f| words.is_empty() || words.iter().any(|w| name(f).contains(w)));
    files.sort();
    Ok(files)
}

fn name(file: &Path) -> String {
    file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// One line for each environment, one for all, then what the judge found.
fn table(files: &[PathBuf], done: &[Vec<Trial>]) {
    println!("| environment | completed | judged clean | a run, s | faults by code, with seeds |");
    println!("| --- | --- | --- | --- | --- |");
    for (file, trials) in files.iter().zip(done) {
        println!("| {} |{}", name(file), row(trials));
    }
    println!("| all |{}", row(&done.concat()));
    for (file, trials) in files.iter().zip(done) {
        let mut known: Vec<&str> = Vec::new();
        for trial in trials {
            if let Some(why) = trial.why.as_deref().filter(|why| !known.contains(why)) {
                println!("{} from {}: {why}", name(file), trial.seed);
                known.push(why);
            }
            trial.wrong.iter().for_each(|wrong| println!("{} from {}: {wrong}", name(file), trial.seed));
        }
    }
}

fn row(trials: &[Trial]) -> String {
    let of = trials.len();
    let completed = trials.iter().filter(|t| t.fault.is_none()).count();
    let judged = trials.iter().filter(|t| t.judged).count();
    let clean = trials.iter().filter(|t| t.judged && t.wrong.is_empty()).count();
    let seconds = trials.iter().map(|t| t.seconds).sum::<f64>() / of.max(1) as f64;
    let mut codes: Vec<&str> = trials.iter().filter_map(|t| t.fault.as_deref()).collect();
    codes.sort_unstable();
    codes.dedup();
    let each = codes.into_iter().map(|code| {
        let seeds: Vec<String> =
            trials.iter().filter(|t| t.fault.as_deref() == Some(code)).map(|t| t.seed.to_string()).collect();
        format!("{} `{code}` ({})", seeds.len(), seeds.join(", "))
    });
    let faults: Vec<String> = each.collect();
    format!(" {completed} of {of} | {clean} of {judged} | {seconds:.2} | {} |", faults.join("; "))
}
