//! A compact program for the numbers that change within one segment.

use std::sync::Arc;

use matterix_ir::equilibrium::{Part, System};
use matterix_ir::graph::{binary, unary};
use matterix_ir::interval::{self, Interval};
use matterix_ir::{BinaryOp, UnaryOp};

/// One operation on registers; its result goes to the next free register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    Unary(UnaryOp, u32),
    Binary(BinaryOp, u32, u32),
    Select(u32, u32, u32),
    /// So many of the tape's terms from this one on, added up as if exactly.
    Sum(u32, u32),
    /// What one of the tape's calls gives.
    Solved(u32),
}

/// A number of a solution, its arguments by their registers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Call {
    pub(super) system: Arc<System>,
    pub(super) part: Part,
    pub(super) args: Vec<u32>,
}

impl Call {
    /// What its arguments are.
    fn args<V: Copy>(&self, registers: &[V]) -> Vec<V> {
        self.args.iter().map(|a| registers[*a as usize]).collect()
    }

    fn value(&self, registers: &[f64]) -> f64 {
        self.system.value(self.part, &self.args(registers))
    }

    /// Its slopes by those arguments that pass a test, as they are numbered.
    pub(super) fn slopes(&self, registers: &[f64], by: &[usize], out: &mut Vec<f64>) {
        self.system.slopes(self.part, &self.args(registers), by, out);
    }

    /// What some numbers of its arguments come to, each times its slope; those that are 0 cost nothing.
    pub(super) fn carried(&self, registers: &[f64], of: &[f64], take: fn(f64) -> f64) -> f64 {
        let by: Vec<usize> = (0..self.args.len()).filter(|i| of[self.args[*i] as usize] != 0.0).collect();
        if by.is_empty() {
            return 0.0;
        }
        let mut slopes = Vec::new();
        self.slopes(registers, &by, &mut slopes);
        by.iter().zip(&slopes).map(|(i, slope)| take(slope * of[self.args[*i] as usize])).sum()
    }
}

/// A multiple of a register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Term {
    pub(super) factor: f64,
    pub(super) register: u32,
}

/// Operations over a register file laid out as constants, time, moving states, results.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    pub(super) constants: Vec<f64>,
    /// How many moving states it reads.
    pub(super) inputs: usize,
    pub(super) steps: Vec<Step>,
    /// What sums are of.
    pub(super) terms: Vec<Term>,
    /// Solutions that are asked for.
    pub(super) calls: Vec<Call>,
    /// Registers of the results that are asked for.
    pub(super) outputs: Vec<u32>,
}

impl PartialEq for Tape {
    /// Equal tapes compute the same bits: constants are compared by their bits.
    fn eq(&self, other: &Self) -> bool {
        let bits = |t: &Tape| t.constants.iter().map(|c| c.to_bits()).collect::<Vec<_>>();
        self.inputs == other.inputs
            && self.outputs == other.outputs
            && self.steps == other.steps
            && self.terms == other.terms
            && self.calls == other.calls
            && bits(self) == bits(other)
    }
}

impl Tape {
    /// The register of time; the moving states follow it.
    pub(super) fn time(&self) -> usize {
        self.constants.len()
    }

    /// The register of the first result.
    pub(super) fn first_result(&self) -> usize {
        self.time() + 1 + self.inputs
    }

    /// A register file for [`Tape::run`], constants filled in.
    pub(super) fn registers(&self) -> Vec<f64> {
        let mut registers = vec![0.0; self.first_result() + self.steps.len()];
        registers[..self.constants.len()].copy_from_slice(&self.constants);
        registers
    }

    /// Runs all steps at `time` (s) with the moving states at `moving`.
    pub(super) fn run(&self, time: f64, moving: &[f64], registers: &mut [f64]) {
        let first = self.first_result();
        registers[self.time()] = time;
        registers[self.time() + 1..first].copy_from_slice(moving);
        for (i, step) in self.steps.iter().enumerate() {
            registers[first + i] = match *step {
                Step::Unary(op, a) => unary(op, registers[a as usize]),
                Step::Binary(op, a, b) => binary(op, registers[a as usize], registers[b as usize]),
                Step::Select(c, a, b) => registers[if registers[c as usize] != 0.0 { a } else { b } as usize],
                Step::Sum(first, count) => {
                    exact_sum(self.summed(first, count).map(|t| (t.factor, registers[t.register as usize])))
                }
                Step::Solved(call) => self.calls[call as usize].value(registers),
            };
        }
    }

    /// Shows the registers that a step reads.
    pub(super) fn operands(&self, step: &Step, visit: &mut dyn FnMut(u32)) {
        match *step {
            Step::Unary(_, a) => visit(a),
            Step::Binary(_, a, b) => [a, b].into_iter().for_each(visit),
            Step::Select(c, a, b) => [c, a, b].into_iter().for_each(visit),
            Step::Sum(first, count) => self.summed(first, count).for_each(|t| visit(t.register)),
            Step::Solved(call) => self.calls[call as usize].args.iter().for_each(|a| visit(*a)),
        }
    }

    /// The same with other outputs, and without the steps that they do not rest on.
    pub(super) fn only(&self, outputs: Vec<u32>) -> Tape {
        let first = self.first_result();
        let mut places: Vec<Option<u32>> = (0..first as u32).map(Some).collect();
        places.resize(first + self.steps.len(), None);
        let mut is_needed = vec![false; places.len()];
        outputs.iter().for_each(|output| is_needed[*output as usize] = true);
        for (i, step) in self.steps.iter().enumerate().rev() {
            if is_needed[first + i] {
                self.operands(step, &mut |register| is_needed[register as usize] = true);
            }
        }
        let mut tape = Tape { constants: self.constants.clone(), inputs: self.inputs, ..Tape::default() };
        for (i, step) in self.steps.iter().enumerate().filter(|(i, _)| is_needed[first + i]) {
            // Whatever a step rests on stands before it.
            let at = |register: u32| places[register as usize].unwrap_or_default();
            let step = match *step {
                Step::Unary(op, a) => Step::Unary(op, at(a)),
                Step::Binary(op, a, b) => Step::Binary(op, at(a), at(b)),
                Step::Select(c, a, b) => Step::Select(at(c), at(a), at(b)),
                Step::Sum(from, count) => {
                    let place = tape.terms.len() as u32;
                    tape.terms.extend(self.summed(from, count).map(|t| Term { register: at(t.register), ..t }));
                    Step::Sum(place, count)
                }
                Step::Solved(call) => {
                    let call = &self.calls[call as usize];
                    tape.calls.push(Call { args: call.args.iter().map(|a| at(*a)).collect(), ..call.clone() });
                    Step::Solved(tape.calls.len() as u32 - 1)
                }
            };
            tape.steps.push(step);
            places[first + i] = Some((first + tape.steps.len() - 1) as u32);
        }
        tape.outputs = outputs.iter().map(|output| places[*output as usize].unwrap_or_default()).collect();
        tape
    }

    /// By output: whether a step that it rests on passes a test.
    pub(super) fn rests_on(&self, test: fn(&Step) -> bool) -> Vec<bool> {
        let mut rests = vec![false; self.first_result()];
        for step in &self.steps {
            let on = |register: u32| rests[register as usize];
            let below = match *step {
                Step::Unary(_, a) => on(a),
                Step::Binary(_, a, b) => on(a) || on(b),
                Step::Select(c, a, b) => on(c) || on(a) || on(b),
                Step::Sum(first, count) => self.summed(first, count).any(|t| on(t.register)),
                Step::Solved(call) => self.calls[call as usize].args.iter().any(|a| on(*a)),
            };
            rests.push(below || test(step));
        }
        self.outputs.iter().map(|output| rests[*output as usize]).collect()
    }

    /// Bounds of all registers for [`Tape::enclose`], constants filled in.
    pub(super) fn intervals(&self) -> Vec<Interval> {
        self.registers().into_iter().map(|v| (v, v)).collect()
    }

    /// Bounds of all results over a span of time, s, and of the moving states.
    pub(super) fn enclose(&self, time: Interval, moving: impl Iterator<Item = Interval>, bounds: &mut [Interval]) {
        self.enclose_knowing(time, moving, |_| None, bounds);
    }

    /// The same where bounds of some registers are known besides.
    pub(super) fn enclose_knowing(
        &self,
        time: Interval,
        moving: impl Iterator<Item = Interval>,
        known: impl Fn(usize) -> Option<Interval>,
        bounds: &mut [Interval],
    ) {
        let first = self.first_result();
        bounds[self.time()] = time;
        bounds[self.time() + 1..first].iter_mut().zip(moving).for_each(|(place, state)| *place = state);
        for (i, step) in self.steps.iter().enumerate() {
            if let Some(known) = known(first + i) {
                bounds[first + i] = known;
                continue;
            }
            bounds[first + i] = match *step {
                Step::Unary(op, a) => interval::of_unary(op, bounds[a as usize]),
                // A number times itself is a square.
                Step::Binary(BinaryOp::Mul, a, b) if a == b => {
                    interval::of_binary(BinaryOp::Pow, bounds[a as usize], (2.0, 2.0))
                }
                Step::Binary(op, a, b) => interval::of_binary(op, bounds[a as usize], bounds[b as usize]),
                Step::Select(c, a, b) => {
                    interval::of_select(bounds[c as usize], bounds[a as usize], bounds[b as usize])
                }
                Step::Sum(first, count) => self.summed(first, count).fold((0.0, 0.0), |sum, term| {
                    let part = (term.factor, term.factor);
                    let part = interval::of_binary(BinaryOp::Mul, part, bounds[term.register as usize]);
                    interval::of_binary(BinaryOp::Add, sum, part)
                }),
                Step::Solved(call) => {
                    let Call { system, part, .. } = &self.calls[call as usize];
                    system.bounds_nearby(*part, &self.calls[call as usize].args(bounds))
                }
            };
        }
    }

    /// How large what each register is made of by sums is at most: what it is rounded by is a share of that.
    pub(super) fn sizes(&self, registers: &[f64], sizes: &mut Vec<f64>) {
        sizes.clear();
        sizes.extend(registers.iter().map(|value| value.abs()));
        let first = self.first_result();
        for (i, step) in self.steps.iter().enumerate() {
            let of = |register: u32| sizes[register as usize];
            let size = match *step {
                Step::Unary(UnaryOp::Neg | UnaryOp::Abs, a) => of(a),
                Step::Binary(BinaryOp::Add | BinaryOp::Sub | BinaryOp::Min | BinaryOp::Max, a, b) => of(a).max(of(b)),
                Step::Binary(BinaryOp::Mul, a, b) => of(a) * of(b),
                Step::Binary(BinaryOp::Div, a, b) => of(a) / registers[b as usize].abs(),
                Step::Select(_, a, b) => of(a).max(of(b)),
                Step::Sum(first, count) => self.summed(first, count).map(|t| t.factor.abs() * of(t.register)).sum(),
                _ => continue,
            };
            if size.is_finite() {
                sizes[first + i] = sizes[first + i].max(size);
            }
        }
    }

    /// The terms of a sum.
    pub(super) fn summed(&self, first: u32, count: u32) -> impl Iterator<Item = Term> {
        self.terms[first as usize..(first + count) as usize].iter().copied()
    }

    /// Copies the results after [`Tape::run`].
    pub(super) fn results(&self, registers: &[f64], out: &mut [f64]) {
        for (out, &register) in out.iter_mut().zip(&self.outputs) {
            *out = registers[register as usize];
        }
    }
}

/// The sum of products, rounded once: near an equilibrium fast terms cancel, and what rounding left of them
/// would make or destroy matter (Ogita, Rump and Oishi 2005: dot product in twice the precision).
fn exact_sum(terms: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut sum, mut error) = (0.0, 0.0);
    for (factor, value) in terms {
        let (product, lost) = two_product(factor, value);
        let total = sum + product;
        let part = total - sum;
        error += (sum - (total - part)) + (product - part) + lost;
        sum = total;
    }
    let all = sum + error;
    if all.is_finite() { all } else { sum }
}

/// The rounded product, and what rounding took from it (Dekker 1971).
fn two_product(factor: f64, value: f64) -> (f64, f64) {
    let product = factor * value;
    if factor.abs() == 1.0 {
        return (product, 0.0);
    }
    let ((a, b), (c, d)) = (split(factor), split(value));
    (product, ((a * c - product) + a * d + b * c) + b * d)
}

/// A number as the sum of two of half its digits (Veltkamp 1968).
fn split(value: f64) -> (f64, f64) {
    const SPLIT: f64 = 134_217_729.0;
    let high = SPLIT * value;
    let high = high - (high - value);
    (high, value - high)
}

#[cfg(test)]
mod tests {
    use super::exact_sum;

    #[test]
    fn what_cancels_leaves_nothing() {
        let (q, r) = (7893.123456789, 7893.123456788);
        assert_eq!(exact_sum([(1.0, 1e-12), (3.0, q), (-3.0, q)].into_iter()), 1e-12);
        let net = exact_sum([(3.0, q), (1.0, 1e-4), (-3.0, r), (-1.0, 1e-4)].into_iter());
        assert_eq!(net, exact_sum([(3.0, q), (-3.0, r)].into_iter()));
        let heat = exact_sum([(-20_000.1, 7.5e9), (20_000.1, 7.5e9)].into_iter());
        assert_eq!(heat, 0.0);
        let heat = exact_sum([(-20_000.1, 7.5e9), (1e-3, 1.0), (20_000.1, 7.5e9)].into_iter());
        assert!((heat - 1e-3).abs() < 1e-15);
        assert_eq!(exact_sum([(1.0, f64::INFINITY), (1.0, 1.0)].into_iter()), f64::INFINITY);
    }
}
