//! Comparisons whose truth may change: watched while a segment is integrated, and located when they do.

use matterix_ir::graph::binary;
use matterix_ir::interval::Interval;
use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use super::analysis::Analysis;
use super::clock::Clock;
use super::tape::{Step, Tape};

/// A difference smaller than this many units of rounding is no evidence that a comparison has changed.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// Times below this one are located as closely as this one, s.
const LEAST: f64 = 1e-30;

/// Changes that last no longer than this are not looked for between two points where nothing has changed, s.
const NARROW: f64 = 1e-6;

/// So many pieces of the way between two points are looked at before it is given up where a side is a wave.
const MOST_PIECES: usize = 20_000;

/// The same where a side only may turn round, as a magnitude: sides that go together are never told apart piece by piece.
const FEW_PIECES: usize = 500;

/// A state may go beyond its values at the ends and in the middle of a piece by this share of their distance.
const BULGE: f64 = 0.5;

/// A comparison that may change unseen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unseen(pub(super) NodeId);

/// A comparison and the truth it has within the segment.
#[derive(Clone, Debug, PartialEq)]
struct Switch {
    node: NodeId,
    op: BinaryOp,
    truth: bool,
    /// Of an equality, the sign of left minus right at the start: it is crossed where that changes.
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
    /// The comparisons whose sides may turn round between two points, with what bounds them.
    folded: Folded,
}

/// The comparisons that may change and change back between two points: one side is a wave, a square, a magnitude.
#[derive(Clone, Debug, Default)]
struct Folded {
    /// By their place among the comparisons.
    list: Vec<usize>,
    /// Whether a side is a wave, in the same order.
    waves: Vec<bool>,
    /// Their sides, in the same order.
    tape: Tape,
    bounds: Vec<Interval>,
    /// Values of the moving states at the ends and in the middle of a piece.
    ends: [Vec<f64>; 3],
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

    /// These comparisons, from the instant `time`, s, on; `moving` are the states that they rest on, ascending, and `now` tells
    /// what operations are worth at that instant.
    pub(super) fn new(
        analysis: Analysis<'_>,
        nodes: &[NodeId],
        moving: &[u32],
        time: f64,
        now: &dyn Fn(NodeId) -> f64,
    ) -> Self {
        let mut switches = Switches::none();
        let mut sides = Vec::new();
        for &node in nodes {
            let Op::Binary(op, a, b) = analysis.op(node) else { continue };
            let side = if op == BinaryOp::Eq { side(now(a), now(b)) } else { 0.0 };
            let switch = Switch { node, op, truth: analysis.now(node) != 0.0, side };
            if moving.is_empty()
                && let Some(stop) = stop(&analysis, (a, b), &switch, time)
            {
                switches.stop = switches.stop.min(stop.unwrap_or(f64::INFINITY));
                continue;
            }
            switches.list.push(switch);
            sides.extend([a, b]);
        }
        switches.tape = analysis.tape(&sides, moving);
        switches.registers = switches.tape.registers();
        if switches.tape.steps.iter().any(folds) {
            switches.fold(&analysis, &sides, moving);
        }
        switches
    }

    /// Whether the other ones find the same.
    pub(super) fn find_the_same(&self, other: &Switches) -> bool {
        self.list == other.list && self.tape == other.tape
    }

    /// Whether there is no comparison to look at as time passes.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Finds the comparisons that may turn round.
    fn fold(&mut self, analysis: &Analysis<'_>, sides: &[NodeId], moving: &[u32]) {
        let (turns, wavy) = (self.tape.rests_on(folds), self.tape.rests_on(is_wave));
        let list: Vec<usize> = (0..self.list.len()).filter(|i| turns[2 * i] || turns[2 * i + 1]).collect();
        let waves = list.iter().map(|i| wavy[2 * i] || wavy[2 * i + 1]).collect();
        let sides: Vec<NodeId> = list.iter().flat_map(|i| [sides[2 * i], sides[2 * i + 1]]).collect();
        let tape = analysis.tape(&sides, moving);
        let ends = std::array::from_fn(|_| vec![0.0; moving.len()]);
        self.folded = Folded { bounds: tape.intervals(), list, waves, tape, ends };
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
    ) -> Result<Option<Crossing>, Unseen> {
        if self.list.is_empty() {
            return Ok(None);
        }
        self.clock = clock;
        let mut low = from;
        for high in times {
            path(high, moving);
            self.run(high, moving);
            let changed: Vec<usize> =
                (0..self.list.len()).filter(|&i| self.is_changed(i, Switch::clearly_changed)).collect();
            let mut located: Vec<(f64, usize)> = Vec::new();
            for i in changed {
                located.push((self.locate(i, low, high, moving, path), i));
            }
            for place in self.open(low, high, path) {
                let end = located.iter().fold(high, |end, (time, _)| end.min(*time));
                if let Some(seen) = self.hidden(place, low, end, moving, path)? {
                    let i = self.folded.list[place];
                    located.push((self.locate(i, low, seen, moving, path), i));
                }
            }
            if let Some((time, i)) = located.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                let Switch { node, op, truth, .. } = self.list[i];
                let time = self.settled(i, time, high, moving, path);
                return Ok(Some(Crossing { time, node, touch: op == BinaryOp::Eq && !truth }));
            }
            low = high;
        }
        Ok(None)
    }

    /// The places of comparisons that may turn round somewhere in a piece.
    fn open(&mut self, from: f64, to: f64, path: &mut dyn FnMut(f64, &mut [f64])) -> Vec<usize> {
        if self.folded.list.is_empty() {
            return Vec::new();
        }
        self.enclose((from, to), path);
        (0..self.folded.list.len()).filter(|place| !self.stays(*place)).collect()
    }

    /// An instant between `low` and `high` at which a comparison that may turn round has changed, the first that is found from
    /// `low` on; none where its sides stay apart.
    fn hidden(
        &mut self,
        place: usize,
        low: f64,
        high: f64,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> Result<Option<f64>, Unseen> {
        let i = self.folded.list[place];
        let mut todo = vec![(low, high)];
        let mut pieces = 0;
        while let Some((from, to)) = todo.pop() {
            pieces += 1;
            match self.folded.waves[place] {
                true if pieces > MOST_PIECES => return Err(Unseen(self.list[i].node)),
                false if pieces > FEW_PIECES => return Ok(None),
                _ => {}
            }
            self.enclose((from, to), path);
            if self.stays(place) {
                continue;
            }
            let middle = from + 0.5 * (to - from);
            path(middle, moving);
            self.run(middle, moving);
            if self.is_changed(i, Switch::clearly_changed) {
                return Ok(Some(middle));
            }
            if to - from > NARROW.max(64.0 * rounding(to)) {
                todo.extend([(middle, to), (from, middle)]);
            }
        }
        Ok(None)
    }

    /// Bounds the sides of all comparisons that may turn round over a piece.
    fn enclose(&mut self, (from, to): Interval, path: &mut dyn FnMut(f64, &mut [f64])) {
        let Folded { tape, bounds, ends, .. } = &mut self.folded;
        if tape.inputs > 0 {
            let times = [from, from + 0.5 * (to - from), to];
            ends.iter_mut().zip(times).for_each(|(values, time)| path(time, values));
        }
        let [first, middle, last] = &*ends;
        let states = first.iter().zip(middle).zip(last).map(|((a, b), c)| {
            let (low, high) = (a.min(*b).min(*c), a.max(*b).max(*c));
            let more = BULGE * (high - low);
            (low - more, high + more)
        });
        tape.enclose((self.clock.lab(from), self.clock.lab(to)), states, bounds);
    }

    /// Whether a comparison has the same truth throughout the piece that was bounded last.
    fn stays(&self, place: usize) -> bool {
        let Folded { list, tape, bounds, .. } = &self.folded;
        let side = |k: usize| bounds[tape.outputs[k] as usize];
        let ((a, b), (c, d)) = (side(2 * place), side(2 * place + 1));
        let switch = &self.list[list[place]];
        match switch.op {
            BinaryOp::Lt if switch.truth => b < c,
            BinaryOp::Lt => a >= d,
            BinaryOp::Le if switch.truth => b <= c,
            BinaryOp::Le => a > d,
            // An equality that does not hold is crossed where the sides change places.
            _ => b < c || a > d,
        }
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

/// The sign of left minus right.
fn side(left: f64, right: f64) -> f64 {
    if left == right { 0.0 } else { (left - right).signum() }
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

/// Whether a step is a wave.
fn is_wave(step: &Step) -> bool {
    matches!(step, Step::Unary(UnaryOp::Sin | UnaryOp::Cos | UnaryOp::Floor, _))
}

/// Whether a step may turn round: give the same value before and after it gave others.
fn folds(step: &Step) -> bool {
    match *step {
        Step::Unary(op, _) => matches!(op, UnaryOp::Sin | UnaryOp::Cos | UnaryOp::Abs | UnaryOp::Floor),
        Step::Binary(BinaryOp::Mul, a, b) => a == b,
        Step::Binary(op, ..) => op == BinaryOp::Pow,
        _ => false,
    }
}
