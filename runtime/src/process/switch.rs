//! Comparisons whose truth may change, and numbers whose whole part may: watched while a segment is integrated, and located when they do.

use matterix_ir::graph::binary;
use matterix_ir::interval::Interval;
use matterix_ir::{BinaryOp, NodeId, Op};

use nalgebra::Vector6;

use super::analysis::Analysis;
use super::bernstein::{control, halved, hull};
use super::clock::Clock;
use super::dense::POINTS;
use super::tape::{Step, Tape};
use super::timed::kinds;

/// Sides whose bounds are this share of them apart do not meet, whatever rounding makes of them.
const CLEAR: f64 = 1e-9;

/// A difference smaller than this many units of rounding is no evidence that a comparison has changed: of what its sides are made of by sums,
/// as 5 K between two temperatures is rounded as they are.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// A time at which two clocks have changed places if they ever do, s.
const FAR: f64 = 1e200;

/// Times below this one are located as closely as this one, s.
const LEAST: f64 = 1e-30;

/// Changes that last no longer than this are not looked for between two points where nothing has changed, s.
const NARROW: f64 = 1e-6;

/// The same as a share of what is looked at, where that is short.
const NARROWEST: f64 = 1e-3;

/// So many pieces of the way between two points are looked at before it is given up where a side is a wave.
const MOST_PIECES: usize = 20_000;

/// The same where a side only may turn round, as a product: sides that go together are never told apart piece by piece.
const FEW_PIECES: usize = 1000;

/// Pieces of a polynomial that are looked at.
const MOST_HALVES: usize = 200;

/// A polynomial is halved no further than to this share of its piece.
const FINEST: f64 = 1e-12;

/// A comparison that may change unseen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unseen(pub(super) NodeId);

/// What goes in jumps, and what it is within the segment.
#[derive(Clone, Debug, PartialEq)]
struct Switch {
    node: NodeId,
    is: Is,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Is {
    /// A comparison. Of an equality `side` is the sign of left minus right at the start: it is crossed where that changes.
    Compared { op: BinaryOp, truth: bool, side: f64 },
    /// The largest whole number not above left.
    Whole(f64),
}

impl Switch {
    /// Of an operation of these sides; none where it is no such, or has no value now.
    fn new(analysis: Analysis<'_>, node: NodeId, now: &dyn Fn(NodeId) -> f64) -> Option<(Switch, (NodeId, NodeId))> {
        let (is, sides) = match analysis.op(node) {
            Op::Binary(op, a, b) => {
                let side = if op == BinaryOp::Eq { side(now(a), now(b)) } else { 0.0 };
                (Is::Compared { op, truth: analysis.now(node) != 0.0, side }, (a, b))
            }
            Op::Unary(op, a) if op.is_stepwise() => (Is::Whole(analysis.now(node)), (a, a)),
            _ => return None,
        };
        // Where it has no value something else decides, or the run would have ended; and what that is will be seen to change.
        let has_value = !now(sides.0).is_nan() && !now(sides.1).is_nan();
        has_value.then_some((Switch { node, is }, sides))
    }

    /// Whether it is true for one instant, at which it changes.
    fn touches(&self) -> bool {
        matches!(self.is, Is::Compared { op: BinaryOp::Eq, truth: false, .. })
    }

    /// Whether it has another truth than it had, or none any more.
    fn changed(&self, left: f64, right: f64) -> bool {
        match self.is {
            _ if left.is_nan() || right.is_nan() => true,
            Is::Compared { op: BinaryOp::Eq, truth: false, side } => (left - right) * side <= 0.0,
            Is::Compared { op, truth, .. } => (binary(op, left, right) != 0.0) != truth,
            Is::Whole(number) => left.floor() != number,
        }
    }

    /// Whether it has its new truth where both sides are equal; `left` is beyond that.
    fn meets(&self, left: f64) -> bool {
        match self.is {
            Is::Compared { op: BinaryOp::Le, truth, .. } => !truth,
            Is::Compared { op: BinaryOp::Lt, truth, .. } => truth,
            Is::Compared { .. } => true,
            Is::Whole(number) => left >= number,
        }
    }

    /// The sign that left minus right has while the comparison keeps its truth; none where it is true at one instant only.
    fn keeps(&self) -> Option<f64> {
        match self.is {
            Is::Compared { op: BinaryOp::Lt | BinaryOp::Le, truth, .. } => Some(if truth { -1.0 } else { 1.0 }),
            Is::Compared { truth: false, side, .. } if side != 0.0 => Some(side),
            Is::Compared { .. } | Is::Whole(_) => None,
        }
    }

    /// Whether it stays as it is while its sides are within these bounds.
    fn stays(&self, (a, b): Interval, (c, d): Interval) -> bool {
        match self.is {
            Is::Compared { op: BinaryOp::Lt, truth, .. } => {
                if truth {
                    b < c
                } else {
                    a >= d
                }
            }
            Is::Compared { op: BinaryOp::Le, truth, .. } => {
                if truth {
                    b <= c
                } else {
                    a > d
                }
            }
            // An equality that does not hold is crossed where the sides change places.
            Is::Compared { .. } => b < c || a > d,
            Is::Whole(number) => number <= a && b < number + 1.0,
        }
    }

    /// The same by more than `noise`.
    fn clearly_changed(&self, left: f64, right: f64, noise: f64) -> bool {
        let apart = match self.is {
            Is::Compared { .. } => left - right,
            Is::Whole(number) if left < number => left - number,
            Is::Whole(number) => left - (number + 1.0),
        };
        let is_noise = apart.abs() <= noise;
        self.changed(left, right) && !is_noise
    }
}

/// Left minus right of a comparison at the points of a piece, or left minus what it is of a whole number.
#[derive(Clone, Copy, Debug, Default)]
struct Apart {
    by: Vector6<f64>,
    /// Differences below this are rounding.
    noise: f64,
    /// Whether the comparison has clearly changed there.
    changed: [bool; POINTS.len()],
}

/// The comparisons to be watched during one segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Switches {
    tape: Tape,
    list: Vec<Switch>,
    registers: Vec<f64>,
    /// How large what each register is made of is.
    sizes: Vec<f64>,
    /// Whether the sides of each comparison follow states and time in straight lines.
    straight: Vec<bool>,
    /// How far the sides of each are apart in the piece that was sampled last.
    apart: Vec<Apart>,
    /// Values of the moving states at the points of a piece.
    ends: [Vec<f64>; POINTS.len()],
    /// Bounds of all registers in a piece.
    bounds: Vec<Interval>,
    /// Which time the path counts.
    clock: Clock,
    /// The first instant at which a comparison of time itself changes, s; infinite if none does.
    pub(super) stop: f64,
    /// The comparisons whose sides may turn round between two points, with what bounds them.
    folded: Folded,
}

/// The comparisons that may change and change back between two points: one side is a wave, a product, a magnitude.
#[derive(Clone, Debug, Default)]
struct Folded {
    /// By their place among the comparisons.
    list: Vec<usize>,
    /// Whether a side is a wave, in the same order.
    waves: Vec<bool>,
    /// Their sides, in the same order.
    tape: Tape,
    bounds: Vec<Interval>,
}

/// A comparison that has just changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// When, s on the clock that was given: the first instant at which it has its new truth.
    pub(super) time: f64,
    pub(super) node: NodeId,
    /// Whether it is an equality, true at this instant only.
    pub(super) touch: bool,
    /// Whether it has its new truth where both sides are equal, and not only beyond: `x >= 5` comes true there, `x <= 5` ends after it.
    pub(super) meets: bool,
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
            let Some((switch, (a, b))) = Switch::new(analysis, node, now) else { continue };
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
        switches.bounds = switches.tape.intervals();
        switches.ends = std::array::from_fn(|_| vec![0.0; moving.len()]);
        let curved = curved(&switches.tape);
        switches.straight = (0..switches.list.len()).map(|i| !curved[2 * i] && !curved[2 * i + 1]).collect();
        if switches.straight.contains(&false) {
            switches.fold();
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
    fn fold(&mut self) {
        let wavy = self.tape.rests_on(is_wave);
        let list: Vec<usize> = (0..self.list.len()).filter(|i| !self.straight[*i]).collect();
        let waves = list.iter().map(|i| wavy[2 * i] || wavy[2 * i + 1]).collect();
        let tape = self.tape.only(list.iter().flat_map(|i| [2 * i, 2 * i + 1]).map(|k| self.tape.outputs[k]).collect());
        self.folded = Folded { bounds: tape.intervals(), list, waves, tape };
    }

    fn run(&mut self, time: f64, moving: &[f64]) {
        self.tape.run(self.clock.lab(time), moving, &mut self.registers);
    }

    /// Left and right of switch `i` after [`Switches::run`].
    fn sides(&self, i: usize) -> (f64, f64) {
        sides(&self.tape, &self.registers, i)
    }

    /// The earliest change of any comparison in `piece`, s on `clock`, in which `path`, the moving states, is a polynomial; located to
    /// a few units of rounding of the time.
    pub(super) fn first_crossing(
        &mut self,
        clock: Clock,
        piece: Interval,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> Result<Option<Crossing>, Unseen> {
        let (from, to) = piece;
        if self.list.is_empty() || from >= to {
            return Ok(None);
        }
        self.clock = clock;
        self.look_over(piece, path);
        if (0..self.list.len()).all(|i| self.is_clear(i)) {
            return Ok(None);
        }
        self.sample(piece);
        let mut located: Vec<(f64, usize)> = Vec::new();
        for i in 0..self.list.len() {
            for (before, after) in self.sampled_changes(i).into_iter().flatten() {
                let [before, after] = [before, after].map(|share| instant(piece, share));
                // The polynomial through the points is not a curved side itself, nor a state that has died out.
                path(after, moving);
                self.run(after, moving);
                if !(if self.straight[i] { self.is_changed(i) } else { self.is_clearly_changed(i) }) {
                    continue;
                }
                located.push((self.locate(i, before, after, moving, path), i));
                break;
            }
        }
        for place in self.open() {
            let end = located.iter().fold(to, |end, (time, _)| end.min(*time));
            if let Some((before, after)) = self.hidden(place, from, end, moving, path)? {
                let i = self.folded.list[place];
                located.push((self.locate(i, before, after, moving, path), i));
            }
        }
        let first = located.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        Ok(first.map(|(time, i)| {
            let time = self.settled(i, time, to, moving, path);
            let switch = &self.list[i];
            Crossing { time, node: switch.node, touch: switch.touches(), meets: switch.meets(self.sides(i).0) }
        }))
    }

    /// Bounds the sides of all comparisons over a piece.
    fn look_over(&mut self, piece: Interval, path: &mut dyn FnMut(f64, &mut [f64])) {
        draw(&mut self.ends, piece, path);
        self.tape.enclose(self.clock.span(piece), hulls(&self.ends), &mut self.bounds);
    }

    /// Whether the sides of a comparison are clearly apart throughout the piece that was looked over, as its truth has it.
    fn is_clear(&self, i: usize) -> bool {
        let ((a, b), (c, d)) = sides(&self.tape, &self.bounds, i);
        let sizes = [a, b, c, d].into_iter().map(f64::abs).filter(|size| size.is_finite());
        let gap = CLEAR * sizes.fold(0.0, f64::max);
        self.list[i].stays((a - gap, b + gap), (c, d))
    }

    /// Notes how far the sides of all comparisons are apart at the points of the piece that was looked over.
    fn sample(&mut self, piece: Interval) {
        let mut apart = std::mem::take(&mut self.apart);
        apart.clear();
        apart.resize(self.list.len(), Apart::default());
        for (k, share) in POINTS.into_iter().enumerate() {
            self.tape.run(self.clock.lab(instant(piece, share)), &self.ends[k], &mut self.registers);
            self.tape.sizes(&self.registers, &mut self.sizes);
            for (i, apart) in apart.iter_mut().enumerate() {
                let (left, right) = self.sides(i);
                apart.by[k] = match self.list[i].is {
                    Is::Compared { .. } => left - right,
                    Is::Whole(number) => left - number,
                };
                let noise = self.noise(i);
                apart.noise = apart.noise.max(noise);
                // What is so at the start has been seen before.
                apart.changed[k] = k > 0 && self.list[i].clearly_changed(left, right, noise);
            }
        }
        self.apart = apart;
    }

    /// Where a comparison changes first within the piece that was sampled last, between two shares of it: by the polynomial through the points,
    /// which is exact for sides that follow the states in straight lines; and as the points themselves show it.
    fn sampled_changes(&self, i: usize) -> [Option<(f64, f64)>; 2] {
        let Apart { by, noise, changed } = self.apart[i];
        let is_finite = by.iter().all(|v| v.is_finite());
        let below = |apart| if is_finite { first_below(apart, noise) } else { None };
        let drawn = match self.list[i].is {
            Is::Compared { .. } => self.list[i].keeps().and_then(|sign| below(sign * by)),
            Is::Whole(_) => {
                let ends = [below(by), below(by.map(|left| 1.0 - left))];
                ends.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
            }
        };
        let seen = changed.iter().position(|changed| *changed).map(|k| (POINTS[k - 1], POINTS[k]));
        [drawn, seen]
    }

    /// The places of comparisons that may turn round somewhere in the piece that was looked over.
    fn open(&self) -> Vec<usize> {
        (0..self.folded.list.len()).filter(|place| !self.is_clear(self.folded.list[*place])).collect()
    }

    /// Two instants between `low` and `high`: a comparison that may turn round has changed at the second, and not before the first.
    /// None where its sides stay apart, as far as the pieces that are looked at show it: all those of one length before any shorter
    /// one, so that what is missed for want of pieces is short wherever it is.
    fn hidden(
        &mut self,
        place: usize,
        low: f64,
        high: f64,
        moving: &mut [f64],
        path: &mut dyn FnMut(f64, &mut [f64]),
    ) -> Result<Option<Interval>, Unseen> {
        let i = self.folded.list[place];
        let narrow = NARROW.min(NARROWEST * (high - low)).max(64.0 * rounding(high));
        let (mut level, mut seen) = (vec![(low, high)], None);
        let mut pieces = 0;
        while !level.is_empty() {
            let mut next = Vec::new();
            for (from, to) in level {
                pieces += 1;
                match self.folded.waves[place] {
                    true if pieces > MOST_PIECES => return Err(Unseen(self.list[i].node)),
                    false if pieces > FEW_PIECES => return Ok(seen),
                    _ => {}
                }
                if seen.is_some_and(|(_, instant)| instant == to) {
                    seen = Some((from, to));
                }
                self.enclose((from, to), path);
                if self.stays(place) || to - from <= narrow {
                    continue;
                }
                let middle = from + 0.5 * (to - from);
                path(middle, moving);
                self.run(middle, moving);
                next.push((from, middle));
                if self.is_clearly_changed(i) {
                    // What comes later does not matter any more.
                    seen = Some((from, middle));
                    break;
                }
                next.push((middle, to));
            }
            level = next;
        }
        Ok(seen)
    }

    /// Bounds the sides of all comparisons that may turn round over a piece.
    fn enclose(&mut self, piece: Interval, path: &mut dyn FnMut(f64, &mut [f64])) {
        draw(&mut self.ends, piece, path);
        self.folded.tape.enclose(self.clock.span(piece), hulls(&self.ends), &mut self.folded.bounds);
    }

    /// Whether a comparison has the same truth throughout the piece that was enclosed last.
    fn stays(&self, place: usize) -> bool {
        let Folded { list, tape, bounds, .. } = &self.folded;
        let (left, right) = sides(tape, bounds, place);
        self.list[list[place]].stays(left, right)
    }

    /// Whether switch `i` has changed, after [`Switches::run`].
    fn is_changed(&self, i: usize) -> bool {
        let (left, right) = self.sides(i);
        self.list[i].changed(left, right)
    }

    /// The same by more than rounding makes of its sides.
    fn is_clearly_changed(&mut self, i: usize) -> bool {
        if !self.is_changed(i) {
            return false;
        }
        self.tape.sizes(&self.registers, &mut self.sizes);
        let (left, right) = self.sides(i);
        self.list[i].clearly_changed(left, right, self.noise(i))
    }

    /// What the sides of switch `i` are off by through rounding, by the sizes of what they are made of.
    fn noise(&self, i: usize) -> f64 {
        let (left, right) = sides(&self.tape, &self.sizes, i);
        NOISE * left.max(right)
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
            if self.is_changed(i) {
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
        if self.is_changed(i) { later } else { time }
    }
}

/// Left and right of a comparison, by what the registers of a tape that computes both sides of each hold.
fn sides<T: Copy>(tape: &Tape, registers: &[T], i: usize) -> (T, T) {
    let at = |k: usize| registers[tape.outputs[k] as usize];
    (at(2 * i), at(2 * i + 1))
}

/// The moving states, if there are any, at the points of a piece.
fn draw(ends: &mut [Vec<f64>; POINTS.len()], piece: Interval, path: &mut dyn FnMut(f64, &mut [f64])) {
    let ends = ends.iter_mut().zip(POINTS).filter(|(values, _)| !values.is_empty());
    ends.for_each(|(values, share)| path(instant(piece, share), values));
}

/// Bounds of states that are polynomials through their values at [`POINTS`].
fn hulls(ends: &[Vec<f64>; POINTS.len()]) -> impl Iterator<Item = Interval> {
    (0..ends[0].len()).map(|state| hull(Vector6::from_fn(|k, _| ends[k][state])))
}

/// The sign of left minus right.
fn side(left: f64, right: f64) -> f64 {
    if left == right { 0.0 } else { (left - right).signum() }
}

/// The unit of rounding at a time, s.
fn rounding(time: f64) -> f64 {
    f64::EPSILON * time.abs().max(LEAST)
}

/// When a comparison of two clocks changes, or the whole number of one: not a pair of clocks, never, or at that instant exactly.
fn stop(analysis: &Analysis<'_>, (a, b): (NodeId, NodeId), switch: &Switch, now: f64) -> Option<Option<f64>> {
    let (a, mut b) = (analysis.clock(a)?, analysis.clock(b)?);
    if let Is::Whole(number) = switch.is {
        b = super::analysis::Clock::standing(if a.rate > 0.0 { number + 1.0 } else { number });
    }
    let rate = a.rate - b.rate;
    if rate == 0.0 {
        return Some(None);
    }
    let changed = |t: f64| switch.changed(a.at(t), b.at(t));
    if !changed(FAR) {
        return Some(None);
    }
    // Both clocks are rounded on the way, by far more than the time where their offsets are larger than it: the instant is looked for
    // from where it would be without.
    let guess = ((b.offset - a.offset) / rate).max(now);
    let (mut low, mut high) = (now, guess.next_up());
    let mut step = rounding(guess);
    while !changed(high) {
        (low, high) = (high, high + step);
        step *= 2.0;
    }
    step = rounding(guess);
    while low < high - step && changed(high - step) {
        high -= step;
        step *= 2.0;
    }
    low = low.max(high - step);
    if changed(low) {
        low = now;
    }
    while low.next_up() < high {
        let middle = low + 0.5 * (high - low);
        if changed(middle) { high = middle } else { low = middle }
    }
    Some(Some(high))
}

/// Whether a step is a wave.
fn is_wave(step: &Step) -> bool {
    matches!(step, Step::Unary(op, _) if op.is_wave())
}

/// Whether the outputs of a tape follow states and time in more than straight lines.
fn curved(tape: &Tape) -> Vec<bool> {
    let kinds = kinds(tape, 1, |_| 1);
    tape.outputs.iter().map(|output| kinds[*output as usize] > 1).collect()
}

/// A place of a piece of time, as a share of it.
fn instant((from, to): Interval, share: f64) -> f64 {
    if share == 1.0 { to } else { from + share * (to - from) }
}

/// Where a polynomial that is given at [`POINTS`] first falls below `-noise`, between two shares of the piece: it does not before the first,
/// and has at the second. By its control points: it lies between the least and the greatest of them (Bernstein form).
fn first_below(sampled: Vector6<f64>, noise: f64) -> Option<(f64, f64)> {
    let mut todo = vec![(control(sampled), 0.0, 1.0)];
    let (mut cleared, mut seen, mut halves) = (0.0, None, 0);
    while let Some((points, from, to)) = todo.pop() {
        halves += 1;
        if points.iter().all(|v| *v >= -noise) {
            cleared = to;
            continue;
        }
        let is_below = points[5] < -noise;
        let turns = points.as_slice().windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
        // One change of sign among the control points is one of the polynomial (Descartes).
        if is_below && (turns == 1 || to - from < FINEST) {
            return Some((from, to));
        }
        if to - from < FINEST || halves > MOST_HALVES {
            continue;
        }
        let (left, right) = halved(points);
        let middle = from + 0.5 * (to - from);
        if right[0] < -noise {
            (todo, seen) = (Vec::new(), Some(middle));
        } else {
            todo.push((right, middle, to));
        }
        todo.push((left, from, middle));
    }
    seen.map(|seen| (cleared, seen))
}
