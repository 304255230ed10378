//! Parts of a law that follow the clock alone: a pulse, a wave, a schedule.
//!
//! An integrator sees the law at the ends of its steps only. Where nothing changes its steps grow, and what happens within one
//! is stepped over. What follows the clock is known beforehand, so it is bounded over the step to come.

use matterix_ir::interval::Interval;
use matterix_ir::{BinaryOp, UnaryOp};

use super::tape::{Step, Tape};

/// What the integrator sees of a step, as parts of it: its ends, and where it came from.
const SEEN: [f64; 3] = [-1.0, 0.0, 1.0];

/// Pieces of one step that are bounded before it is given up.
const MOST_PIECES: usize = 20_000;

/// A piece is divided no further below this part of the step.
const FINEST: f64 = 1e-9;

/// A change by this share of what is there is rounding.
const SLIGHT: f64 = 1e-9;

/// Rounding of a sum, as a share of the largest number in it.
const ROUNDED: f64 = 16.0 * f64::EPSILON;

/// A value below this is nothing.
const NOTHING: f64 = 1e-40;

/// A step that begins where something happens is this part of the time until then.
const CLOSER: f64 = 1.0 / 16.0;

/// What bounds are worked out in, from piece to piece.
struct Room {
    moving: Vec<f64>,
    /// Registers at both ends of a piece.
    ends: [Vec<f64>; 2],
    sizes: Vec<f64>,
    bounds: Vec<Interval>,
}

impl Room {
    fn new(tape: &Tape, states: usize) -> Room {
        let ends = [tape.registers(), tape.registers()];
        Room { moving: vec![0.0; states], ends, sizes: Vec::new(), bounds: tape.intervals() }
    }
}

/// The clock changes something more often than can be followed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Busy;

/// What of a tape follows the clock alone.
#[derive(Clone, Debug)]
pub(super) struct Timed {
    /// Computes it from the time and from states that grow evenly.
    tape: Tape,
    /// The pace of the states that grow evenly; absent for others.
    paces: Vec<Option<f64>>,
    /// By register of the tape, whether it follows the clock in a straight line.
    straight: Vec<bool>,
}

impl Timed {
    /// The parts of `tape` that follow the clock in more than a straight line; none where there are no such.
    pub(super) fn of(tape: &Tape) -> Option<Self> {
        let first = tape.first_result();
        let constant = |register: u32| tape.constants.get(register as usize).copied();
        let paces: Vec<Option<f64>> = tape.outputs.iter().map(|o| constant(*o)).collect();
        // What each register follows: 0 nothing, 1 the clock in a straight line, 2 the clock in a curve, 3 more than the clock.
        let of_state = |i: usize| if paces[i].is_some() { 1 } else { 3 };
        let kinds = kinds(tape, 1, of_state);
        let mut outputs: Vec<u32> = Vec::new();
        let mut ask = |register: u32| {
            if kinds[register as usize] == 2 {
                outputs.push(register);
            }
        };
        for (i, step) in tape.steps.iter().enumerate() {
            if kinds[first + i] == 3 {
                tape.operands(step, &mut ask);
            }
        }
        tape.outputs.iter().copied().for_each(&mut ask);
        if outputs.is_empty() {
            return None;
        }
        outputs.sort_unstable();
        outputs.dedup();
        let tape = tape.only(outputs);
        let straight = self::kinds(&tape, 1, of_state).into_iter().map(|kind| kind == 1).collect();
        Some(Timed { tape, paces, straight })
    }

    /// How far a step from `time`, s, of `length` s may go so that nothing that follows the clock happens unseen within it; none
    /// where nothing does. `values` are the moving states at its beginning.
    pub(super) fn limit(&self, time: f64, length: f64, values: &[f64]) -> Result<Option<f64>, Busy> {
        let mut registers = self.tape.registers();
        let mut hulls: Vec<Interval> = vec![(f64::INFINITY, f64::NEG_INFINITY); self.tape.outputs.len()];
        let mut moving = values.to_vec();
        for probe in SEEN {
            self.point(time, probe * length, values, &mut moving, &mut registers);
            for (hull, output) in hulls.iter_mut().zip(&self.tape.outputs) {
                let value = registers[*output as usize];
                if value.is_nan() {
                    // What has no value any more is found out by the step itself, which knows whose law that is.
                    return Ok(None);
                }
                *hull = (hull.0.min(value), hull.1.max(value));
            }
        }
        let mut room = Room::new(&self.tape, values.len());
        self.tape.sizes(&registers, &mut room.sizes);
        for ((low, high), output) in hulls.iter_mut().zip(&self.tape.outputs) {
            let rounded = ROUNDED * room.sizes[*output as usize];
            let slack = (*high - *low) + SLIGHT * low.abs().max(high.abs()) + 4.0 * rounded + NOTHING;
            (*low, *high) = (*low - slack, *high + slack);
        }
        let mut todo = vec![(0.0, length)];
        let mut quiet = 0.0;
        let mut pieces = 0;
        while let Some((from, to)) = todo.pop() {
            pieces += 1;
            if pieces > MOST_PIECES {
                return Err(Busy);
            }
            self.bound(time, (from, to), values, &mut room);
            let within = |(output, hull): (&u32, &Interval)| {
                let (low, high) = room.bounds[*output as usize];
                low >= hull.0 && high <= hull.1
            };
            if self.tape.outputs.iter().zip(&hulls).all(within) || to - from < FINEST * length {
                quiet = to;
                continue;
            }
            let middle = 0.5 * (from + to);
            self.point(time, middle, values, &mut moving, &mut registers);
            let leaves = |(output, hull): (&u32, &Interval)| {
                let value = registers[*output as usize];
                value < hull.0 || value > hull.1
            };
            if self.tape.outputs.iter().zip(&hulls).any(leaves) && middle - quiet <= CLOSER * length {
                return Ok(Some(if quiet > CLOSER * middle { quiet } else { CLOSER * middle }));
            }
            if middle <= from || middle >= to {
                quiet = to;
                continue;
            }
            todo.extend([(middle, to), (from, middle)]);
        }
        Ok(None)
    }

    fn point(&self, time: f64, after: f64, values: &[f64], moving: &mut [f64], registers: &mut [f64]) {
        for ((moved, value), pace) in moving.iter_mut().zip(values).zip(&self.paces) {
            *moved = value + pace.unwrap_or(0.0) * after;
        }
        self.tape.run(time + after, moving, registers);
    }

    /// Bounds over a piece of a step. What follows the clock in a straight line lies between its ends, however it is written.
    fn bound(&self, time: f64, (from, to): Interval, values: &[f64], room: &mut Room) {
        let Room { moving, ends, sizes, bounds } = room;
        for (after, registers) in [from, to].into_iter().zip(ends.iter_mut()) {
            self.point(time, after, values, moving, registers);
        }
        self.tape.sizes(&ends[1], sizes);
        let known = |register: usize| {
            let (a, b) = (ends[0][register], ends[1][register]);
            let rounded = ROUNDED * sizes[register];
            self.straight[register].then_some((a.min(b) - rounded, a.max(b) + rounded))
        };
        let states = values.iter().zip(&self.paces).map(|(value, pace)| {
            let (a, b) = (value + pace.unwrap_or(0.0) * from, value + pace.unwrap_or(0.0) * to);
            (a.min(b), a.max(b))
        });
        self.tape.enclose_knowing((time + from, time + to), states, known, bounds);
    }
}

/// By register, what it follows: 0 nothing, 1 straight lines, more than that otherwise; of the time and of each state it is said.
pub(super) fn kinds(tape: &Tape, time: u8, state: impl Fn(usize) -> u8) -> Vec<u8> {
    let mut kinds = vec![0; tape.first_result()];
    kinds[tape.time()] = time;
    kinds[tape.time() + 1..].iter_mut().enumerate().for_each(|(i, kind)| *kind = state(i));
    for step in &tape.steps {
        let of = |register: u32| kinds[register as usize];
        let mut most = 0;
        tape.operands(step, &mut |register| most = most.max(of(register)));
        let is_straight = match *step {
            Step::Unary(UnaryOp::Neg, _) | Step::Binary(BinaryOp::Add | BinaryOp::Sub, ..) | Step::Sum(..) => true,
            Step::Binary(BinaryOp::Mul, a, b) => of(a).min(of(b)) == 0,
            Step::Binary(BinaryOp::Div, _, b) => of(b) == 0,
            Step::Select(c, ..) => of(c) == 0,
            _ => false,
        };
        kinds.push(if most == 1 && !is_straight { 2 } else { most });
    }
    kinds
}

#[cfg(test)]
mod tests {
    use super::*;

    /// exp(-((t - 10000) / 60)^2) of the time, or of a state that grows by 1 a second; the other state follows it.
    fn pulse(of: u32) -> Tape {
        let steps = vec![
            Step::Binary(BinaryOp::Sub, of, 0),
            Step::Binary(BinaryOp::Div, 6, 1),
            Step::Binary(BinaryOp::Mul, 7, 7),
            Step::Unary(UnaryOp::Neg, 8),
            Step::Unary(UnaryOp::Exp, 9),
        ];
        Tape {
            constants: vec![1e4, 60.0, 1.0],
            inputs: 2,
            steps,
            terms: Vec::new(),
            calls: Vec::new(),
            outputs: vec![2, 10],
        }
    }

    #[test]
    fn a_step_ends_before_a_pulse() {
        for register in [3, 4] {
            let timed = Timed::of(&pulse(register)).expect("it follows the clock");
            let limit = timed.limit(0.0, 21_600.0, &[0.0, 0.0]).expect("few pieces").expect("a pulse");
            assert!((8000.0..9990.0).contains(&limit), "{limit}");
            assert!(timed.limit(0.0, 5000.0, &[0.0, 0.0]).expect("few pieces").is_none());
            assert!(timed.limit(9700.0, 0.1, &[9700.0, 0.0]).expect("few pieces").is_none());
        }
        assert!(Timed::of(&pulse(5)).is_none(), "a state that does not grow evenly");
    }
}
