//! The Jacobian of a tape: which result depends on which state, and a program that computes only those slopes.
//!
//! Each register has the slopes that it can have, found once; a step then is a few multiply-adds over those of its operands. A number
//! that rests on many states and that much else rests on, as the volume of a solution, would fill the matrix. In large
//! tapes it becomes an unknown of its own, a **hub**, with a row that says what it is made of: the matrix grows by one and stays
//! sparse. The rows of hubs follow those of the states.

use matterix_ir::BinaryOp;

use super::tangent::{binary, unary};
use super::tape::{Step, Tape};

/// A hub rests on more states than this.
const WIDE: usize = 8;

/// A hub saves this many times the slopes that it costs.
const WORTH: usize = 4;

/// The place of a slope that is always 0.
const NONE: u32 = 0;

/// Where entries of a sparse matrix stand, row by row. Every diagonal entry is among them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pattern {
    /// How many of the unknowns are states.
    pub(super) states: usize,
    /// By row the first entry, and the end of the last one.
    pub(super) starts: Vec<u32>,
    /// By entry, ascending in each row.
    pub(super) columns: Vec<u32>,
}

impl Pattern {
    /// Rows and columns.
    pub(super) fn size(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The entries of a row.
    pub(super) fn row(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }
}

/// The slopes of a step by those of its operands.
#[derive(Clone, Copy, Debug)]
enum Code {
    /// Multiples of the slopes of one or two operands: from this pair on, so many.
    Pairs(u32, u32),
    /// Multiples of many: from this addition on, so many; all slopes are 0 before.
    Sum(u32, u32),
    /// Those of a solution by its arguments, as the additions number them: from this addition on, so many.
    Solved(u32, u32),
}

#[derive(Clone, Copy, Debug)]
struct Addition {
    to: u32,
    from: u32,
    factor: f64,
}

/// A program that computes a Jacobian.
#[derive(Clone, Debug)]
pub(super) struct Slopes {
    pub(super) pattern: Pattern,
    /// By entry of the pattern, which slope it is.
    places: Vec<u32>,
    /// Step, first slope, what computes it and those after it.
    code: Vec<(u32, u32, Code)>,
    pairs: Vec<[u32; 2]>,
    additions: Vec<Addition>,
    /// Slopes that are always the same: 0, and 1 for what is a state or a hub itself.
    fixed: Vec<f64>,
}

impl Slopes {
    /// For `tape`, with hubs or without.
    pub(super) fn new(tape: &Tape, with_hubs: bool) -> Self {
        Compiler::new(tape, with_hubs).compile(tape)
    }

    /// Memory for [`Slopes::evaluate`].
    pub(super) fn memory(&self) -> Vec<f64> {
        self.fixed.clone()
    }

    /// Computes the entries of the pattern after a run of `tape` that left `registers`. What is not finite (a root at zero)
    /// is left out: it would only spoil the factorisation.
    pub(super) fn evaluate(&self, tape: &Tape, registers: &[f64], memory: &mut [f64], entries: &mut [f64]) {
        let first = tape.first_result();
        for &(step, to, code) in &self.code {
            let to = to as usize;
            match code {
                Code::Pairs(start, count) => {
                    let (a, b) = partials(tape.steps[step as usize], registers, first + step as usize);
                    for (k, &[x, y]) in self.pairs[start as usize..(start + count) as usize].iter().enumerate() {
                        memory[to + k] = times(a, memory[x as usize]) + times(b, memory[y as usize]);
                    }
                }
                Code::Solved(start, count) => {
                    let additions = &self.additions[start as usize..(start + count) as usize];
                    solved(tape, step, additions, registers, memory);
                }
                Code::Sum(start, count) => {
                    let additions = &self.additions[start as usize..(start + count) as usize];
                    additions.iter().for_each(|a| memory[a.to as usize] = 0.0);
                    for addition in additions {
                        memory[addition.to as usize] += times(addition.factor, memory[addition.from as usize]);
                    }
                }
            }
        }
        for (entry, &place) in entries.iter_mut().zip(&self.places) {
            let slope = memory[place as usize];
            *entry = if slope.is_finite() { slope } else { 0.0 };
        }
    }
}

/// The slopes of a solution: of its arguments, each times how much the solution grows with it.
fn solved(tape: &Tape, step: u32, additions: &[Addition], registers: &[f64], memory: &mut [f64]) {
    let Step::Solved(call) = tape.steps[step as usize] else { return };
    additions.iter().for_each(|a| memory[a.to as usize] = 0.0);
    let mut by: Vec<usize> = additions.iter().map(|a| a.factor as usize).collect();
    by.sort_unstable();
    by.dedup();
    let mut slopes = Vec::new();
    tape.calls[call as usize].slopes(registers, &by, &mut slopes);
    for addition in additions {
        let slope = by.binary_search(&(addition.factor as usize)).map_or(0.0, |place| slopes[place]);
        memory[addition.to as usize] += times(slope, memory[addition.from as usize]);
    }
}

/// A product in which nothing times anything is nothing.
fn times(factor: f64, slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { factor * slope }
}

/// The slopes of a step's result by its one or two operands.
fn partials(step: Step, registers: &[f64], result: usize) -> (f64, f64) {
    let value = registers[result];
    match step {
        Step::Unary(op, a) => (unary(op, registers[a as usize], value), 0.0),
        Step::Binary(BinaryOp::Mul, a, b) => (registers[b as usize], registers[a as usize]),
        Step::Binary(op, a, b) => {
            let values = (registers[a as usize], registers[b as usize]);
            (binary(op, values, value, (1.0, 0.0)), binary(op, values, value, (0.0, 1.0)))
        }
        Step::Select(c, ..) if registers[c as usize] != 0.0 => (1.0, 0.0),
        Step::Select(..) => (0.0, 1.0),
        Step::Sum(..) | Step::Solved(_) => (0.0, 0.0),
    }
}

/// Finds the slopes that registers can have.
struct Compiler {
    /// By slope, the unknown that it is by.
    columns: Vec<u32>,
    /// By register, its slopes: from this one on, so many.
    slopes: Vec<(u32, u32)>,
    /// By register, how often it is an operand.
    uses: Vec<u32>,
    /// What hubs are made of.
    hubs: Vec<(u32, u32)>,
    with_hubs: bool,
    code: Vec<(u32, u32, Code)>,
    pairs: Vec<[u32; 2]>,
    additions: Vec<Addition>,
    ones: Vec<u32>,
}

impl Compiler {
    fn new(tape: &Tape, with_hubs: bool) -> Self {
        let inputs = tape.inputs as u32;
        let mut columns = vec![u32::MAX];
        columns.extend(0..inputs);
        let mut slopes = vec![(NONE, 0); tape.time() + 1];
        slopes.extend((1..=inputs).map(|place| (place, 1)));
        let mut uses = vec![0; tape.first_result() + tape.steps.len()];
        for step in tape.steps.iter().filter(|_| with_hubs) {
            tape.operands(step, &mut |register| uses[register as usize] += 1);
        }
        let (hubs, code, pairs, additions) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let ones = (1..=inputs).collect();
        Compiler { columns, slopes, uses, hubs, with_hubs, code, pairs, additions, ones }
    }

    fn compile(mut self, tape: &Tape) -> Slopes {
        for (i, step) in tape.steps.iter().enumerate() {
            let start = self.columns.len() as u32;
            let code = match *step {
                Step::Unary(_, a) => self.pair(a, None),
                Step::Binary(BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq | BinaryOp::And | BinaryOp::Or, ..) => None,
                Step::Binary(_, a, b) | Step::Select(_, a, b) => self.pair(a, Some(b)),
                Step::Sum(first, count) => {
                    let terms = tape.summed(first, count).map(|term| (term.register, term.factor));
                    self.sum(terms).map(|(start, count)| Code::Sum(start, count))
                }
                Step::Solved(call) => {
                    let args = tape.calls[call as usize].args.iter().enumerate();
                    self.sum(args.map(|(i, a)| (*a, i as f64))).map(|(start, count)| Code::Solved(start, count))
                }
            };
            self.code.extend(code.map(|code| (i as u32, start, code)));
            let own = (start, self.columns.len() as u32 - start);
            let seen = self.seen(tape, own);
            self.slopes.push(seen);
        }
        self.finish(tape)
    }

    /// What others see of the slopes of the register that comes next.
    fn seen(&mut self, tape: &Tape, own: (u32, u32)) -> (u32, u32) {
        let (wide, uses) = (own.1 as usize, self.uses[self.slopes.len()] as usize);
        if !self.with_hubs || wide <= WIDE || wide * uses <= WORTH * (wide + uses) {
            return own;
        }
        let place = self.columns.len() as u32;
        self.columns.push((tape.inputs + self.hubs.len()) as u32);
        self.ones.push(place);
        self.hubs.push(own);
        (place, 1)
    }

    /// The slopes of a step of one or two operands, merged by their unknowns.
    fn pair(&mut self, a: u32, b: Option<u32>) -> Option<Code> {
        let (mut a, mut b) = (self.slopes[a as usize], b.map_or((NONE, 0), |b| self.slopes[b as usize]));
        let start = self.pairs.len() as u32;
        while a.1 + b.1 > 0 {
            let column = |of: (u32, u32)| if of.1 > 0 { self.columns[of.0 as usize] } else { u32::MAX };
            let least = column(a).min(column(b));
            let take = |of: &mut (u32, u32), column: u32| {
                if column != least {
                    return NONE;
                }
                *of = (of.0 + 1, of.1 - 1);
                of.0 - 1
            };
            let (x, y) = (column(a), column(b));
            let pair = [take(&mut a, x), take(&mut b, y)];
            self.columns.push(least);
            self.pairs.push(pair);
        }
        let count = self.pairs.len() as u32 - start;
        (count > 0).then_some(Code::Pairs(start, count))
    }

    /// The slopes of what rests on many registers, each with a number of its own.
    fn sum(&mut self, terms: impl Iterator<Item = (u32, f64)>) -> Option<(u32, u32)> {
        let (start, base) = (self.additions.len(), self.columns.len());
        let mut found: Vec<(u32, u32, f64)> = Vec::new();
        for (register, factor) in terms {
            let (place, count) = self.slopes[register as usize];
            found.extend((place..place + count).map(|place| (self.columns[place as usize], place, factor)));
        }
        // Stable: each slope is added up in the order of the terms.
        found.sort_by_key(|f| f.0);
        for (column, from, factor) in found {
            if self.columns.len() == base || self.columns.last() != Some(&column) {
                self.columns.push(column);
            }
            self.additions.push(Addition { to: self.columns.len() as u32 - 1, from, factor });
        }
        let count = self.additions.len() - start;
        (count > 0).then_some((start as u32, count as u32))
    }

    fn finish(self, tape: &Tape) -> Slopes {
        let mut pattern = Pattern { states: tape.inputs, starts: vec![0], columns: Vec::new() };
        let mut places = Vec::new();
        let outputs = tape.outputs.iter().map(|output| self.slopes[*output as usize]);
        for (row, (first, count)) in outputs.chain(self.hubs.iter().copied()).enumerate() {
            let mut entries: Vec<(u32, u32)> =
                (first..first + count).map(|place| (self.columns[place as usize], place)).collect();
            let diagonal = entries.partition_point(|e| e.0 < row as u32);
            if entries.get(diagonal).is_none_or(|e| e.0 != row as u32) {
                entries.insert(diagonal, (row as u32, NONE));
            }
            pattern.columns.extend(entries.iter().map(|e| e.0));
            places.extend(entries.iter().map(|e| e.1));
            pattern.starts.push(pattern.columns.len() as u32);
        }
        let mut fixed = vec![0.0; self.columns.len()];
        self.ones.iter().for_each(|one| fixed[*one as usize] = 1.0);
        Slopes { pattern, places, code: self.code, pairs: self.pairs, additions: self.additions, fixed }
    }
}

#[cfg(test)]
mod tests {
    use matterix_ir::UnaryOp;
    use proptest::prelude::*;

    use super::super::tangent;
    use super::super::tape::Term;
    use super::*;

    const INPUTS: usize = 12;

    /// A tape of `picks`, each an operation and what it is applied to.
    fn tape(picks: &[(u8, u16, u16, u16)]) -> Tape {
        let constants = vec![0.5, 2.0, -1.5];
        let mut tape = Tape { constants, inputs: INPUTS, ..Tape::default() };
        for (i, &(op, a, b, c)) in picks.iter().enumerate() {
            let of = |pick: u16| u32::from(pick) % (tape.first_result() + i) as u32;
            let (a, b, c) = (of(a), of(b), of(c));
            let step = match op % 9 {
                0 => Step::Binary(BinaryOp::Add, a, b),
                1 => Step::Binary(BinaryOp::Mul, a, b),
                2 => Step::Binary(BinaryOp::Div, a, b),
                3 => Step::Binary(BinaryOp::Min, a, b),
                4 => Step::Binary(BinaryOp::Lt, a, b),
                5 => Step::Unary(UnaryOp::Sin, a),
                6 => Step::Unary(UnaryOp::Neg, a),
                7 => Step::Select(a, b, c),
                _ => {
                    let first = tape.terms.len() as u32;
                    // The sum of many registers, so that there are hubs.
                    let all = (4..16).chain([a, b, c]);
                    tape.terms.extend(all.map(|register| Term { factor: 0.25, register }));
                    Step::Sum(first, tape.terms.len() as u32 - first)
                }
            };
            tape.steps.push(step);
        }
        let last = tape.first_result() + picks.len();
        tape.outputs = (0..INPUTS).map(|i| (last - 1 - i) as u32).collect();
        tape
    }

    /// The Jacobian by columns, hubs put in.
    fn filled(slopes: &Slopes, entries: &[f64]) -> Vec<Vec<f64>> {
        let pattern = &slopes.pattern;
        let mut rows = vec![vec![0.0; INPUTS]; pattern.size()];
        // A hub rests on states and on hubs before it.
        for row in (INPUTS..pattern.size()).chain(0..INPUTS) {
            for entry in pattern.row(row) {
                let column = pattern.columns[entry] as usize;
                let share = if column < INPUTS {
                    (0..INPUTS).map(|i| if i == column { 1.0 } else { 0.0 }).collect()
                } else {
                    rows[column].clone()
                };
                rows[row].iter_mut().zip(share).for_each(|(sum, share)| *sum += entries[entry] * share);
            }
        }
        (0..INPUTS).map(|column| (0..INPUTS).map(|row| rows[row][column]).collect()).collect()
    }

    proptest! {
        #[test]
        fn sparse_slopes_are_those_of_each_direction(
            picks in prop::collection::vec(any::<(u8, u16, u16, u16)>(), 20..60),
            values in prop::collection::vec(0.1..2.0, INPUTS),
        ) {
            let tape = tape(&picks);
            let mut registers = tape.registers();
            tape.run(3.0, &values, &mut registers);
            let scale = registers.iter().fold(1.0_f64, |most, r| most.max(r.abs()));
            prop_assume!(scale < 1e6);
            let mut tangents = tape.registers();
            for with_hubs in [false, true] {
                let slopes = Slopes::new(&tape, with_hubs);
                let mut entries = vec![0.0; slopes.pattern.columns.len()];
                slopes.evaluate(&tape, &registers, &mut slopes.memory(), &mut entries);
                for (column, found) in filled(&slopes, &entries).iter().enumerate() {
                    let direction: Vec<f64> = (0..INPUTS).map(|i| if i == column { 1.0 } else { 0.0 }).collect();
                    tangent::push(&tape, &registers, &direction, &mut tangents);
                    let mut expected = vec![0.0; INPUTS];
                    tape.results(&tangents, &mut expected);
                    let most = tangents.iter().fold(1.0_f64, |most, t| most.max(t.abs()));
                    prop_assume!(most < 1e6 && tangents.iter().all(|t| t.is_finite()));
                    for (a, b) in found.iter().zip(&expected) {
                        prop_assert!((a - b).abs() <= 1e-9 * (scale + most).powi(2), "{a} is not {b}");
                    }
                }
            }
        }
    }

    /// c_i = n_i / (n_1 + ... + n_12), each rate 2 c_i c_(i + 1).
    #[test]
    fn what_all_share_does_not_fill_the_matrix() {
        let inputs = 60_u32;
        let mut tape = Tape { constants: vec![2.0], inputs: inputs as usize, ..Tape::default() };
        tape.terms = (0..inputs).map(|i| Term { factor: 1.0, register: 2 + i }).collect();
        tape.steps.push(Step::Sum(0, inputs));
        let volume = tape.first_result() as u32;
        tape.steps.extend((0..inputs).map(|i| Step::Binary(BinaryOp::Div, 2 + i, volume)));
        let part = |i| volume + 1 + i % inputs;
        tape.steps.extend((0..inputs).map(|i| Step::Binary(BinaryOp::Mul, part(i), part(i + 1))));
        tape.outputs = (0..inputs).map(|i| volume + 1 + inputs + i).collect();
        let (with, without) = (Slopes::new(&tape, true), Slopes::new(&tape, false));
        assert_eq!(with.pattern.size(), 61);
        assert_eq!(with.pattern.columns.len(), 60 * 3 + 61);
        assert_eq!(without.pattern.columns.len(), 60 * 60);
    }
}
