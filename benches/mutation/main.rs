//! Which mistakes are caught: `cargo bench --bench mutation`. Makes one mistake at a time in the examples, by fixed
//! operators, and counts what `check` and the run find; docs/mutation.md says what is meant by each column.
//!
//! `-- FILE|DIR...` takes other files, `--limit N` so many mutants of each, evenly spread, `--json` writes all of them.

mod behaviour;
mod judge;
mod mutants;
mod report;
mod tree;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use judge::{Original, Verdict};
use report::Judged;

/// Bytes of a thread's stack; only what is used of it is ever taken.
const STACK: usize = 512 << 20;

/// What was asked for.
#[derive(Default)]
struct Arguments {
    paths: Vec<PathBuf>,
    limit: Option<usize>,
    json: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked = arguments()?;
    let mut judged = Vec::new();
    for path in files(&asked.paths)? {
        match file(&path, asked.limit) {
            Ok(found) => judged.extend(found),
            Err(why) => eprintln!("{} is left out: {why}", path.display()),
        }
    }
    match asked.json {
        true => println!("{}", serde_json::to_string_pretty(&report::machine(&judged))?),
        false => print!("{}", report::human(&judged)),
    }
    Ok(())
}

fn arguments() -> Result<Arguments, Box<dyn Error>> {
    let mut asked = Arguments::default();
    let mut rest = std::env::args().skip(1);
    while let Some(word) = rest.next() {
        match word.as_str() {
            // Cargo adds it.
            "--bench" => {}
            "--json" => asked.json = true,
            "--limit" => asked.limit = Some(rest.next().ok_or("--limit needs a number")?.parse()?),
            path => asked.paths.push(PathBuf::from(path)),
        }
    }
    if asked.paths.is_empty() {
        asked.paths.push(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"));
    }
    Ok(asked)
}

/// The files named, and those in the folders named.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut out = Vec::new();
    for path in paths {
        if !path.is_dir() {
            out.push(path.clone());
            continue;
        }
        let mut inside: Vec<PathBuf> =
            std::fs::read_dir(path)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
        inside.retain(|p| p.extension().is_some_and(|e| e == "mtx"));
        inside.sort();
        out.extend(inside);
    }
    Ok(out)
}

/// Every mutant of a file with what became of it, or why the file has none.
fn file(path: &Path, limit: Option<usize>) -> Result<Vec<Judged>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
    let tree = mutants::tree_of(&text);
    let original = on_deep_stack(|| Original::new(path, &text, &tree::workflows(&tree)))??;
    let mut all = mutants::all(&text, &tree);
    if let Some(limit) = limit {
        let every = all.len().div_ceil(limit.max(1)).max(1);
        let mut n = 0;
        all.retain(|_| {
            n += 1;
            (n - 1) % every == 0
        });
    }
    let verdicts = on_deep_stack(|| judge(&original, &all))??;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let judged = all.into_iter().zip(verdicts);
    Ok(judged.map(|(mutant, verdict)| Judged { file: name.clone(), mutant, verdict }).collect())
}

/// What becomes of mutants, in their order; all processors share them.
fn judge(original: &Original, all: &[mutants::Mutant]) -> Result<Vec<Verdict>, String> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let work = || {
        while let Some((i, mutant)) = {
            let i = next.fetch_add(1, Ordering::Relaxed);
            all.get(i).map(|m| (i, m))
        } {
            let verdict = original.judge(&mutant.text);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((i, verdict));
        }
    };
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        for _ in 1..threads {
            let started = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work);
            started.map_err(|e| e.to_string())?;
        }
        work();
        Ok::<(), String>(())
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|d| d.0);
    Ok(done.into_iter().map(|d| d.1).collect())
}

fn on_deep_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work);
        let thread = thread.map_err(|e| e.to_string())?;
        thread.join().map_err(|_| "the compiler or the runtime has a fault".to_string())
    })
}
