//! What a run is doing, on standard error: one live line on a terminal, plain lines elsewhere.

use std::time::{Duration, Instant};

use matterix_ir::hidden::visible;
use matterix_ir::plan::{Plan, Step, StepId};

use crate::terminal::{self, Stream, paint, print};

/// How often the live line is drawn anew.
const FRAME: Duration = Duration::from_millis(50);

/// In what form progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One line that changes.
    Live,
    /// A line for every step as it starts.
    Lines,
    /// Nothing.
    Quiet,
}

/// Follows a run by its steps.
pub struct Progress<'a> {
    plan: &'a Plan,
    kind: Kind,
    width: usize,
    running: Vec<StepId>,
    drawn: Option<Instant>,
}

impl<'a> Progress<'a> {
    /// Progress of a run of `plan` that has not started.
    pub fn new(plan: &'a Plan, kind: Kind) -> Self {
        Progress { plan, kind, width: terminal::width(Stream::Err), running: Vec::new(), drawn: None }
    }

    /// A step starts at a simulated time, s.
    pub fn started(&mut self, step: StepId, time: f64) {
        if !is_shown(&self.plan.get(step).step) {
            return;
        }
        if self.kind == Kind::Lines {
            let depth = self.running.len();
            print(Stream::Err, &line(time, depth, &self.plan.get(step).label));
        }
        self.running.push(step);
        self.moved(time);
    }

    /// A step ends at a simulated time, s.
    pub fn ended(&mut self, step: StepId, time: f64) {
        if let Some(at) = self.running.iter().rposition(|s| *s == step) {
            self.running.remove(at);
        }
        self.moved(time);
    }

    /// The simulated time, s, has moved on.
    #[allow(clippy::disallowed_methods, reason = "the live line follows the wall clock; nothing recorded does")]
    pub fn moved(&mut self, time: f64) {
        if self.kind != Kind::Live || self.drawn.is_some_and(|d| d.elapsed() < FRAME) {
            return;
        }
        self.drawn = Some(Instant::now());
        let labels: Vec<&str> = self.running.iter().map(|s| self.plan.get(*s).label.as_str()).collect();
        paint(Stream::Err, &format!("\r\x1b[2K{}", visible(&live(time, &labels, self.width))));
    }

    /// Takes the live line away.
    pub fn finish(&mut self) {
        if self.drawn.take().is_some() {
            paint(Stream::Err, "\r\x1b[2K");
        }
    }
}

/// How many runs have ended, as one live line on a terminal.
pub struct Count {
    is_live: bool,
    drawn: Option<Instant>,
}

impl Count {
    /// Of runs that have not begun; nothing is shown where nobody is to read it.
    pub fn new(wanted: bool) -> Self {
        Count { is_live: wanted && terminal::is_terminal(Stream::Err), drawn: None }
    }

    /// So many have ended, of so many where that is known.
    #[allow(clippy::disallowed_methods, reason = "the live line follows the wall clock; nothing recorded does")]
    pub fn reached(&mut self, ended: u64, all: Option<u64>) {
        if !self.is_live || self.drawn.is_some_and(|d| d.elapsed() < FRAME) {
            return;
        }
        self.drawn = Some(Instant::now());
        let of = all.map_or_else(String::new, |all| format!(" of {all}"));
        paint(Stream::Err, &format!("\r\x1b[2K{ended}{of} runs"));
    }

    /// Takes the live line away.
    pub fn finish(&mut self) {
        if self.drawn.take().is_some() {
            paint(Stream::Err, "\r\x1b[2K");
        }
    }
}

/// Whether a step is more than a grouping of others.
pub fn is_shown(step: &Step) -> bool {
    !matches!(step, Step::Sequence(_) | Step::Guarded { .. } | Step::Let { .. })
}

/// `[  11.4 s] heat hotplate to 60 degC`, indented by the depth in the tree.
fn line(time: f64, depth: usize, label: &str) -> String {
    format!("[{time:>8.1} s] {:indent$}{label}\n", "", indent = 2 * depth)
}

/// `1010.6 s  step grow › wait 10 s`, shortened at the left: the innermost step says most.
fn live(time: f64, labels: &[&str], width: usize) -> String {
    let time = format!("{time:>8.1} s  ");
    let branch = labels.join(" › ");
    let room = width.saturating_sub(time.len() + 1);
    let length = branch.chars().count();
    if length <= room {
        return format!("{time}{branch}");
    }
    let tail: String = branch.chars().skip(length + 1 - room.max(1)).collect();
    format!("{time}…{tail}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_time_and_depth() {
        assert_eq!(line(11.4, 0, "heat hotplate to 60 degC"), "[    11.4 s] heat hotplate to 60 degC\n");
        assert_eq!(line(1010.6, 2, "wait 1 s"), "[  1010.6 s]     wait 1 s\n");
    }

    #[test]
    fn the_live_line_fits_and_keeps_the_innermost_step() {
        assert_eq!(live(2.0, &["step grow", "wait 10 s"], 60), "     2.0 s  step grow › wait 10 s");
        let narrow = live(2.0, &["step grow", "repeat 3 times", "wait until b[I2] >= 13 mmol/kg"], 40);
        assert_eq!(narrow.chars().count(), 39);
        assert!(narrow.ends_with("b[I2] >= 13 mmol/kg"), "{narrow}");
        assert!(narrow.contains('…'));
    }
}
