//! A compact program for the numbers that change within one segment.

use matterix_ir::graph::{binary, unary};
use matterix_ir::{BinaryOp, UnaryOp};

/// One operation on registers; its result goes to the next free register.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    Unary(UnaryOp, u32),
    Binary(BinaryOp, u32, u32),
    Select(u32, u32, u32),
}

/// Operations over a register file laid out as constants, time, moving states, results.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    pub(super) constants: Vec<f64>,
    /// How many moving states it reads.
    pub(super) inputs: usize,
    pub(super) steps: Vec<Step>,
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
            };
        }
    }

    /// Copies the results after [`Tape::run`].
    pub(super) fn results(&self, registers: &[f64], out: &mut [f64]) {
        for (out, &register) in out.iter_mut().zip(&self.outputs) {
            *out = registers[register as usize];
        }
    }
}
