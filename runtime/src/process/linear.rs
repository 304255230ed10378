//! The linear systems of the integrator, solved in the units of the tolerances.
//!
//! A row of the matrix is divided by the error that its state may have before a pivot is chosen. Without that the row with the
//! largest numbers wins, whatever its unit: the heat of a reaction (J) is a large number beside the last femtomoles of what
//! reacts (mol), and the rounding of the one would become an error of the other that no shorter step makes smaller. A solution is
//! refined once by what it leaves over: else the rounding of pivots chosen so adds up to a loss of what rows have in common, as heat.

use std::cell::RefCell;

use diffsol::{LaLinearOp, Matrix, NalgebraContext, NalgebraLU, NalgebraMat, NalgebraVec, Vector};
use diffsol_la::{LaError, LinearSolver};

/// Factorises with rows in units of their tolerances.
#[derive(Default)]
pub(super) struct WeighedLu {
    /// What each row is multiplied by: powers of 2, which round nothing.
    weights: Vec<f64>,
    lu: NalgebraLU<f64>,
    /// The matrix that was factorised.
    matrix: RefCell<Option<NalgebraMat<f64>>>,
}

impl WeighedLu {
    /// For states that may be off by `allowed`.
    pub(super) fn new(allowed: impl Iterator<Item = f64>) -> Self {
        WeighedLu { weights: allowed.map(weight).collect(), ..WeighedLu::default() }
    }

    fn weigh<'v>(&self, values: impl Iterator<Item = &'v mut f64>) {
        values.zip(&self.weights).for_each(|(value, weight)| *value *= weight);
    }
}

/// The power of 2 next below `1 / allowed`.
fn weight(allowed: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let inverse = 1.0 / allowed;
    if inverse.is_normal() { f64::from_bits(inverse.to_bits() & EXPONENT) } else { 1.0 }
}

/// An operator whose rows are weighed.
struct Weighed<'o, C> {
    op: &'o C,
    weights: &'o [f64],
    /// Takes the matrix as it is made.
    kept: &'o RefCell<Option<NalgebraMat<f64>>>,
}

impl<C> LaLinearOp for Weighed<'_, C>
where
    C: LaLinearOp<T = f64, V = NalgebraVec<f64>, M = NalgebraMat<f64>, C = NalgebraContext>,
{
    type T = f64;
    type V = NalgebraVec<f64>;
    type M = NalgebraMat<f64>;
    type C = NalgebraContext;

    fn nrows(&self) -> usize {
        self.op.nrows()
    }

    fn ncols(&self) -> usize {
        self.op.ncols()
    }

    fn context(&self) -> &NalgebraContext {
        self.op.context()
    }

    fn matrix_inplace(&self, matrix: &mut NalgebraMat<f64>) {
        self.op.matrix_inplace(matrix);
        for mut column in matrix.inner_mut().column_iter_mut() {
            column.iter_mut().zip(self.weights).for_each(|(value, weight)| *value *= weight);
        }
        match &mut *self.kept.borrow_mut() {
            Some(kept) => kept.copy_from(matrix),
            none => *none = Some(matrix.clone()),
        }
    }
}

impl LinearSolver<NalgebraMat<f64>> for WeighedLu {
    fn set_linearisation<C>(&mut self, op: &C)
    where
        C: LaLinearOp<T = f64, V = NalgebraVec<f64>, M = NalgebraMat<f64>, C = NalgebraContext>,
    {
        self.lu.set_linearisation(&Weighed { op, weights: &self.weights, kept: &self.matrix });
    }

    fn set_sparsity<C>(&mut self, op: &C)
    where
        C: LaLinearOp<T = f64, V = NalgebraVec<f64>, M = NalgebraMat<f64>, C = NalgebraContext>,
    {
        self.lu.set_sparsity(&Weighed { op, weights: &self.weights, kept: &self.matrix });
    }

    fn solve_in_place(&self, values: &mut NalgebraVec<f64>) -> Result<(), LaError> {
        self.weigh(values.inner_mut().iter_mut());
        let mut left_over = values.clone();
        self.lu.solve_in_place(values)?;
        if let Some(matrix) = &*self.matrix.borrow() {
            matrix.gemv(-1.0, values, 1.0, &mut left_over);
            self.lu.solve_in_place(&mut left_over)?;
            *values += &left_over;
        }
        Ok(())
    }

    fn solve_transpose_in_place(&self, values: &mut NalgebraVec<f64>) -> Result<(), LaError> {
        self.lu.solve_transpose_in_place(values)?;
        self.weigh(values.inner_mut().iter_mut());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_is_a_power_of_two() {
        assert_eq!(weight(0.25), 4.0);
        assert_eq!(weight(0.3), 2.0);
        assert_eq!(weight(2e-37).to_bits() & ((1 << 52) - 1), 0);
        assert_eq!(weight(0.0), 1.0);
    }
}
