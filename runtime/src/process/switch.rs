//! Comparisons whose truth may change: watched while a segment is integrated, and located when they do.

use matterix_ir::graph::binary;
use matterix_ir::{BinaryOp, NodeId, Op};

use super::analysis::Analysis;
use super::clock::Clock;
use super::tape::Tape;

/// A difference smaller than this many units of rounding is no evidence that a comparison has changed.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// Times below this one are located as closely as this one, s.
const LEAST: f64 = 1e-30;

/// A comparison and the truth it has within the segment.
#[derive(Clone, Debug)]
struct Switch {
    node: NodeId,
    op: BinaryOp,
    truth: bool,
    /// Sign of left minus right at the start: an equality is crossed where it changes.
    side: f64,
}

impl Switch {
    fn changed(&self, left: f64, right: f64) -> bool {
        match self.op {
            BinaryOp::Eq if !self.truth => (left - right) * self.side <= 0.0,
            op => (binary(op, left, right) != 0.0) != self.truth,
        }
    }

    fn clearly_changed(&self, left: f64, right: f64) -> bool {
        self.changed(left, right) && (left - right).abs() > NOISE * left.abs().max(right.abs())
    }
}

/// The comparisons to be watched during one segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Switches {
    tape: Tape,
    list: Vec<Switch>,
    registers: Vec<f64>,
    /// Which time the path counts.
    clock: Clock,
    /// The first instant at which a comparison of time itself changes, s; infinite if none does.
    pub(super) stop: f64,
    /// Whether a watched comparison depends on time in a way that cannot be solved for it.
    pub(super) follows_time: bool,
}

/// A comparison that has just changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// When, s on the clock that was given: the first instant at which it has its new truth.
    pub(super) time: f64,
    pub(super) node: NodeId,
    /// Whether it is an equality, true at this instant only.
    pub(super) touch: bool,
}

impl Switches {
    /// No comparison at all.
    pub(super) fn none() -> Self {
        Switches { stop: f64::INFINITY, ..Switches::default() }
    }

    /// The comparisons that `roots` depend on, from the instant `time`, s, of the analysis on.
    pub(super) fn new(
        analysis: &Analysis<'_>,
        ops: &[Op],
        roots: impl IntoIterator<Item = NodeId>,
        moving: &[u32],
        time: f64,
    ) -> Self {
        let mut switches = Switches::none();
        let mut sides = Vec::new();
        for node in analysis.switches(roots) {
            let Op::Binary(op, a, b) = ops[node.0 as usize] else { continue };
            let (left, right) = (analysis.now(a), analysis.now(b));
            let side = if left == right { 0.0 } else { (left - right).signum() };
            let switch = Switch { node, op, truth: binary(op, left, right) != 0.0, side };
            if !(analysis.feels_state(a) || analysis.feels_state(b)) {
                if let Some(stop) = stop(analysis, (a, b), &switch, time) {
                    switches.stop = switches.stop.min(stop.unwrap_or(f64::INFINITY));
                    continue;
                }
                switches.follows_time = true;
            }
            switches.list.push(switch);
            sides.extend([a, b]);
        }
        switches.tape = analysis.tape(&sides, moving);
        switches.registers = switches.tape.registers();
        switches
    }

    fn run(&mut self, time: f64, moving: &[f64]) {
        self.tape.run(self.clock.lab(time), moving, &mut self.registers);
    }

    /// Left and right of switch `i` after [`Switches::run`].
    fn sides(&self, i: usize) -> (f64, f64) {
        let at = |k: usize| self.registers[self.tape.outputs[k] as usize];
        (at(2 * i), at(2 * i + 1))
    }

    /// The earliest change of any comparison between `from` and the last of `times` (ascending, s on `clock`), located to a
    /// few units of rounding of that time. `path` gives the moving states.
    pub(super) fn first_crossing(
        &mut self,
        clock: Clock,
        from: f64,
        times: impl Iterator<Item = f64>,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> Option<Crossing> {
        if self.list.is_empty() {
            return None;
        }
        self.clock = clock;
        let mut low = from;
        for high in times {
            path(high, moving);
            self.run(high, moving);
            let changed: Vec<usize> =
                (0..self.list.len()).filter(|&i| self.is_changed(i, Switch::clearly_changed)).collect();
            let located = changed.into_iter().map(|i| (self.locate(i, low, high, moving, path), i));
            if let Some((time, i)) = located.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let Switch { node, op, truth, .. } = self.list[i];
                let time = self.settled(i, time, high, moving, path);
                return Some(Crossing { time, node, touch: op == BinaryOp::Eq && !truth });
            }
            low = high;
        }
        None
    }

    fn is_changed(&self, i: usize, test: fn(&Switch, f64, f64) -> bool) -> bool {
        let (left, right) = self.sides(i);
        test(&self.list[i], left, right)
    }

    /// Bisects to the first instant after `low` at which switch `i` has changed, as it has at `high`.
    fn locate(
        &mut self,
        i: usize,
        mut low: f64,
        mut high: f64,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> f64 {
        while high - low > 4.0 * rounding(high) {
            let middle = low + 0.5 * (high - low);
            path(middle, moving);
            self.run(middle, moving);
            if self.is_changed(i, Switch::changed) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// A few units of rounding later if the change lasts, so that comparisons that change together do so at one instant.
    fn settled(
        &mut self,
        i: usize,
        time: f64,
        limit: f64,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> f64 {
        let later = (time + 8.0 * rounding(time)).min(limit);
        path(later, moving);
        self.run(later, moving);
        if self.is_changed(i, Switch::changed) { later } else { time }
    }
}

/// The unit of rounding at a time, s.
fn rounding(time: f64) -> f64 {
    f64::EPSILON * time.abs().max(LEAST)
}

/// When a comparison of two clocks changes: not a pair of clocks, never, or at that instant exactly.
fn stop(analysis: &Analysis<'_>, (a, b): (NodeId, NodeId), switch: &Switch, now: f64) -> Option<Option<f64>> {
    let (a, b) = (analysis.clock(a)?, analysis.clock(b)?);
    let rate = a.rate - b.rate;
    if rate == 0.0 {
        return Some(None);
    }
    let changed = |t: f64| switch.changed(a.rate * t + a.offset, b.rate * t + b.offset);
    let mut time = ((b.offset - a.offset) / rate).max(now);
    for _ in 0..8 {
        if time.next_down() > now && changed(time.next_down()) {
            time = time.next_down();
        } else if time <= now || !changed(time) {
            time = time.next_up();
        } else {
            return Some(Some(time));
        }
    }
    Some((time > now && changed(time)).then_some(time))
}
