//! Derivatives of a tape: how its results change when the moving states change in one direction.

use matterix_ir::{BinaryOp, UnaryOp, math};

use super::tape::{Step, Tape};

/// Pushes `direction` (of the moving states, at constant time) forward through `tape`, whose `registers` hold the values
/// of a run; `tangents` is another register file. At a kink the derivative is that of the side taken.
pub(super) fn push(tape: &Tape, registers: &[f64], direction: &[f64], tangents: &mut [f64]) {
    let first = tape.first_result();
    tangents[..=tape.time()].fill(0.0);
    tangents[tape.time() + 1..first].copy_from_slice(direction);
    for (i, step) in tape.steps.iter().enumerate() {
        let value = registers[first + i];
        tangents[first + i] = match *step {
            Step::Unary(op, a) => match tangents[a as usize] {
                0.0 => 0.0,
                slope => unary(op, registers[a as usize], value) * slope,
            },
            Step::Binary(op, a, b) => {
                let (a, b) = (a as usize, b as usize);
                match (tangents[a], tangents[b]) {
                    (0.0, 0.0) => 0.0,
                    slopes => binary(op, (registers[a], registers[b]), value, slopes),
                }
            }
            Step::Select(c, a, b) => tangents[if registers[c as usize] != 0.0 { a } else { b } as usize],
            Step::Sum(first, count) => {
                tape.summed(first, count).map(|t| t.factor * tangents[t.register as usize]).sum()
            }
            Step::Solved(call) => tape.calls[call as usize].carried(registers, tangents, |part| part),
        };
    }
}

/// Bounds of what rounding does to each result of a run of `tape` whose values `registers` hold (running error analysis:
/// Wilkinson 1963). States and time are taken as rounded once.
pub(super) fn noise(tape: &Tape, registers: &[f64]) -> Vec<f64> {
    let first = tape.first_result();
    let mut noise = vec![0.0; registers.len()];
    for i in tape.time()..first {
        noise[i] = f64::EPSILON * registers[i].abs();
    }
    for (i, step) in tape.steps.iter().enumerate() {
        let value = registers[first + i];
        let carried = match *step {
            Step::Unary(op, a) => match noise[a as usize] {
                0.0 => 0.0,
                noise => (unary(op, registers[a as usize], value) * noise).abs(),
            },
            // Where rounding decides which of two it is, it is either.
            Step::Binary(BinaryOp::Min | BinaryOp::Max, a, b) if is_tie(registers, &noise, a as usize, b as usize) => {
                noise[a as usize].max(noise[b as usize])
            }
            Step::Binary(op, a, b) => {
                let (a, b) = (a as usize, b as usize);
                let of = |slopes| binary(op, (registers[a], registers[b]), value, slopes).abs();
                let one = |noise: f64, slopes| if noise == 0.0 { 0.0 } else { of(slopes) };
                one(noise[a], (noise[a], 0.0)) + one(noise[b], (0.0, noise[b]))
            }
            Step::Select(c, a, b) => noise[if registers[c as usize] != 0.0 { a } else { b } as usize],
            Step::Sum(first, count) => {
                tape.summed(first, count).map(|t| (t.factor * noise[t.register as usize]).abs()).sum()
            }
            Step::Solved(call) => tape.calls[call as usize].carried(registers, &noise, f64::abs),
        };
        let all = carried + f64::EPSILON * value.abs();
        noise[first + i] = if all.is_finite() { all } else { 0.0 };
    }
    noise
}

/// Whether rounding alone parts two values.
fn is_tie(registers: &[f64], noise: &[f64], a: usize, b: usize) -> bool {
    (registers[a] - registers[b]).abs() <= noise[a] + noise[b]
}

/// `d value / d a`.
pub(super) fn unary(op: UnaryOp, a: f64, value: f64) -> f64 {
    match op {
        UnaryOp::Neg => -1.0,
        UnaryOp::Exp => value,
        UnaryOp::Ln => 1.0 / a,
        UnaryOp::Sqrt => 0.5 / value,
        UnaryOp::Abs => 1f64.copysign(a),
        UnaryOp::Sin => math::cos(a),
        UnaryOp::Cos => -math::sin(a),
        UnaryOp::Atan => 1.0 / (1.0 + a * a),
        UnaryOp::Not | UnaryOp::Floor => 0.0,
    }
}

/// `d value`, for `da` and `db`.
pub(super) fn binary(op: BinaryOp, (a, b): (f64, f64), value: f64, (da, db): (f64, f64)) -> f64 {
    match op {
        BinaryOp::Add => da + db,
        BinaryOp::Sub => da - db,
        BinaryOp::Mul => da * b + a * db,
        BinaryOp::Div => (da - value * db) / b,
        BinaryOp::Pow => {
            let base = if da == 0.0 { 0.0 } else { b * math::pow(a, b - 1.0) * da };
            let exponent = if db == 0.0 { 0.0 } else { value * math::ln(a) * db };
            base + exponent
        }
        BinaryOp::Min => {
            if a <= b {
                da
            } else {
                db
            }
        }
        BinaryOp::Max => {
            if a >= b {
                da
            } else {
                db
            }
        }
        BinaryOp::Lt | BinaryOp::Le | BinaryOp::Eq | BinaryOp::And | BinaryOp::Or => 0.0,
    }
}
