//! Studies and fits: a workflow compiled once and run many times.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use matterix_ir::study::{Fit, Study};
use matterix_ir::{Diagnostic, Program, Sources, codes};
use matterix_lang::{Compiled, Many, Options};
use matterix_runtime::fit::{self, Unsolved};
use matterix_runtime::record::Folder;
use matterix_runtime::study::{self, Design, Summary};

use super::Input;

/// A study or a fit of a file as its program, with findings; none where there is an error.
pub fn many(input: &Input, options: &Options, fits: bool) -> (Sources, Option<Compiled>, Vec<Diagnostic>) {
    let (mut sources, file) = input.source();
    let (compiled, found) = match file {
        Ok(file) => matterix_lang::many_runs(&mut sources, file, &input.neighbours(), options, fits),
        Err(found) => (None, vec![found]),
    };
    (sources, compiled, found)
}

/// How many runs are made, and how.
pub struct Asked<'c> {
    /// How many runs, in place of what the study says.
    pub runs: Option<u64>,
    /// Where all randomness starts.
    pub seed: u64,
    /// On how many threads.
    pub jobs: usize,
    /// Set to end early.
    pub cancel: &'c AtomicBool,
}

/// What came of it, to show and to write.
pub struct Done {
    /// To read.
    pub page: String,
    /// As JSON.
    pub json: String,
    /// Names and contents of files.
    files: Vec<(&'static str, String)>,
    /// Whether nothing is left to be said.
    pub is_whole: bool,
}

impl Done {
    /// Writes tables and figures into a folder.
    pub fn write(&self, dir: &Path) -> Result<(), String> {
        let put = |mut folder: Folder| {
            self.files.iter().try_for_each(|(name, text)| folder.put(name, text.as_bytes()))?;
            folder.finish()
        };
        Folder::begin(dir, &[]).and_then(put).map(drop).map_err(|e| e.to_string())
    }
}

/// Makes the runs of a study. `done` is told how many of how many have ended; `Err` says what is wrong with the usage.
pub fn study(
    program: &Program,
    study: &Study,
    asked: &Asked<'_>,
    done: &mut dyn FnMut(u64, u64),
) -> Result<Done, String> {
    let points = Design::grid(study);
    let runs = asked.runs.or(study.runs).or(points).unwrap_or(1);
    if let Some(points) = points.filter(|points| !runs.is_multiple_of(*points)) {
        return Err(format!(
            "the grids of `{}` have {points} points: the number of runs must be a multiple of this",
            study.name
        ));
    }
    let options = study::Options { runs, seed: asked.seed, jobs: asked.jobs, cancel: asked.cancel };
    let rows = study::runs(program, study, &options, &mut |n| done(n, runs));
    let about = (program.plan.workflow.as_str(), program.scene.lab.as_str());
    let summary = Summary::new(study, about, &rows, asked.seed, runs);
    let json = summary.json()?;
    let files = vec![("study.csv", study::csv(study, &rows)?), ("study.json", json.clone())];
    Ok(Done { page: study::human(&summary), json, files, is_whole: rows.len() as u64 == runs })
}

/// Estimates the parameters of a fit, or says why nothing came of it; none where it was given up from outside.
pub fn fit(
    program: &Program,
    fit: &Fit,
    asked: &Asked<'_>,
    done: &mut dyn FnMut(u64),
) -> Result<Result<Option<Done>, Box<Diagnostic>>, String> {
    let outcome = match fit::estimate(program, fit, asked.seed, asked.jobs, asked.cancel, done) {
        Ok(outcome) => outcome,
        Err(Unsolved::Cancelled) => return Ok(Ok(None)),
        Err(Unsolved::Failed(why)) => {
            let headline = format!("the fit failed everywhere in its ranges: {why}");
            return Ok(Err(Box::new(Diagnostic::error(codes::RUN_FAILED, fit.span, headline, "this fit"))));
        }
    };
    let json = outcome.json()?;
    let files = vec![("fit.json", json.clone()), ("residuals.csv", fit::csv(fit, &outcome)?)];
    Ok(Ok(Some(Done { page: fit::human(&outcome), json, files, is_whole: outcome.undetermined.is_empty() })))
}

/// The study of a compilation.
pub fn as_study(compiled: &Compiled) -> Option<&Study> {
    match &compiled.many {
        Many::Study(study) => Some(study),
        Many::Fit(_) => None,
    }
}

/// The fit of a compilation.
pub fn as_fit(compiled: &Compiled) -> Option<&Fit> {
    match &compiled.many {
        Many::Fit(fit) => Some(fit),
        Many::Study(_) => None,
    }
}
