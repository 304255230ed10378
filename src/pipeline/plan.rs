//! Schedules of a program.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use matterix_ir::{Diagnostic, Program};
use matterix_runtime::exec::{Limits, Turn};
use matterix_runtime::run::RunOptions;
use matterix_runtime::schedule::{self, Options, Schedule};

/// Decisions of a search whose result must be the same everywhere.
const DECISIONS: u64 = 1_000_000;

/// When the search for a shorter schedule ends.
#[derive(Clone, Copy, Debug)]
pub enum Search {
    /// By the clock.
    Clock {
        /// At the latest after this.
        time: Duration,
        /// Where all randomness starts.
        seed: u64,
    },
    /// After a fixed number of decisions, so that every machine finds the same.
    Fixed {
        /// Where all randomness starts.
        seed: u64,
    },
}

/// Makes the schedule of a program, or says why there is none.
pub fn schedule(program: &Program, search: Search, cancel: &AtomicBool) -> Result<Schedule, Box<Diagnostic>> {
    let (time, decisions, seed) = match search {
        Search::Clock { time, seed } => (Some(time), None, seed),
        Search::Fixed { seed } => (None, Some(DECISIONS), seed),
    };
    let limits = Limits { cancel: Some(cancel), ..Limits::default() };
    let trial = RunOptions { seed, limits, ..RunOptions::default() };
    let over = AtomicBool::new(false);
    let (done, is_done) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        if let Some(time) = time {
            let over = &over;
            scope.spawn(move || {
                if is_done.recv_timeout(time) == Err(RecvTimeoutError::Timeout) {
                    over.store(true, Ordering::Relaxed);
                }
            });
        }
        let made = schedule::schedule(program, &Options { stop: &[cancel, &over], decisions, seed, trial });
        drop(done);
        made
    })
}

/// The schedule as a chart of so many columns.
pub fn chart(schedule: &Schedule, width: usize) -> String {
    schedule::chart(schedule, width)
}

/// The schedule as an SVG picture.
pub fn picture(schedule: &Schedule) -> Result<String, String> {
    schedule::picture(schedule).map_err(|e| format!("cannot draw the schedule: {e}"))
}

/// The schedule as JSON.
pub fn schedule_json(schedule: &Schedule) -> Result<String, String> {
    let text = serde_json::to_string_pretty(schedule).map_err(|e| format!("cannot write the schedule: {e}"))?;
    Ok(text + "\n")
}

/// The turns that a schedule in a file gives to the claims of a program.
pub fn turns(path: &Path, text: &str, program: &Program) -> Result<Vec<Turn>, String> {
    let name = path.display();
    let schedule: Schedule = serde_json::from_str(text).map_err(|e| format!("`{name}` is not a schedule: {e}"))?;
    schedule.turns(program).map_err(|e| format!("`{name}` cannot be scheduled: {e}"))
}
