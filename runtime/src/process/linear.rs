//! The linear systems of the integrator, solved in the units of the tolerances.
//!
//! A row of the matrix is divided by the error that its state may have before a pivot is chosen. Without that the row with the
//! largest numbers wins, whatever its unit: the heat of a reaction (J) is a large number beside the last femtomoles of what
//! reacts (mol), and the rounding of the one would become an error of the other that no shorter step makes smaller. A solution is
//! refined once by what it leaves over: else the rounding of pivots chosen so adds up to a loss of what rows have in common, as heat.

use std::cell::RefCell;

use diffsol::{LaLinearOp, Matrix, NalgebraContext, NalgebraVec, Vector};
use diffsol_la::{LaError, LinearSolver};
use nalgebra::{DMatrix, DVectorViewMut, Dyn, LU};

use super::shifted::Shifted;
use super::slopes::Pattern;
use super::sparse::SparseLu;

/// Up to so many states the matrix is filled up. The whole integration with full and with sparse factors took, in ms, on a chain of
/// heat conduction 0.7 : 1.1 with 10 states, 1.1 : 1.0 with 14, 3.3 : 2.3 with 50, 120 : 19 with 200; on a star 0.7 : 0.6, 1.1 : 0.8,
/// 3.3 : 2.1, 130 : 14; on a reaction network 1.4 : 1.5, 2.1 : 1.7, 25 : 11, 490 : 180.
pub(super) const DENSE: usize = 12;

/// The matrix of a law and its factors. What depends on its pattern alone is kept from one solver to the next.
#[derive(Clone)]
pub(super) struct Factors {
    pattern: Pattern,
    /// What each row is multiplied by: powers of 2, which round nothing.
    weights: Vec<f64>,
    allowed: Vec<f64>,
    /// The entries of the matrix, rows weighed.
    entries: Vec<f64>,
    lu: Lu,
    is_singular: bool,
    matrix: Option<Shifted>,
    /// Right-hand side, what a solution leaves over, scratch.
    work: [Vec<f64>; 3],
}

#[derive(Clone)]
enum Lu {
    Sparse(Box<SparseLu>),
    Dense(Option<LU<f64, Dyn, Dyn>>),
}

impl Factors {
    pub(super) fn new(pattern: &Pattern) -> Self {
        let is_sparse = pattern.states > DENSE;
        Self::with(pattern, if is_sparse { Lu::Sparse(Box::new(SparseLu::new(pattern))) } else { Lu::Dense(None) })
    }

    fn with(pattern: &Pattern, lu: Lu) -> Self {
        let size = pattern.size();
        let entries = vec![0.0; pattern.columns.len()];
        let work = std::array::from_fn(|_| vec![0.0; size]);
        let (weights, allowed) = (vec![1.0; size], vec![0.0; size]);
        Factors { pattern: pattern.clone(), weights, allowed, entries, lu, is_singular: true, matrix: None, work }
    }

    /// For states that may be off by `allowed`.
    pub(super) fn allow(&mut self, allowed: &[f64]) {
        for (place, allowed) in allowed.iter().enumerate() {
            (self.allowed[place], self.weights[place]) = (*allowed, weight(*allowed));
        }
    }

    fn factor(&mut self, fill: impl FnOnce(&mut Shifted)) {
        let mut matrix = match self.matrix.take() {
            Some(matrix) => matrix,
            None => Shifted::zeros(self.pattern.states, self.pattern.states, NalgebraContext::default()),
        };
        fill(&mut matrix);
        self.weigh(&matrix);
        self.matrix = Some(matrix);
        self.is_singular = match &mut self.lu {
            Lu::Sparse(lu) => lu.factor(&self.entries).is_err(),
            Lu::Dense(lu) => {
                let size = self.pattern.size();
                let mut matrix = DMatrix::zeros(size, size);
                for row in 0..size {
                    for entry in self.pattern.row(row) {
                        matrix[(row, self.pattern.columns[entry] as usize)] = self.entries[entry];
                    }
                }
                let made = lu.insert(matrix.lu());
                !made.is_invertible()
            }
        };
    }

    /// Sets the entries: `1 - c J` in the rows of states, what a hub is less what it is made of in the rows of hubs.
    fn weigh(&mut self, matrix: &Shifted) {
        for row in 0..self.pattern.size() {
            let range = self.pattern.row(row);
            let is_hub = row >= self.pattern.states;
            let slope = |entry: usize| matrix.slopes.get(entry).copied().unwrap_or(0.0);
            let column = |entry: usize| self.pattern.columns[entry] as usize;
            if is_hub {
                let allowed = range.clone().map(|e| slope(e).abs() * self.allowed[column(e)]).sum();
                (self.allowed[row], self.weights[row]) = (allowed, weight(allowed));
            }
            let (ones, factor) = if is_hub { (1.0, -1.0) } else { (matrix.ones, matrix.factor) };
            for entry in range {
                let one = if column(entry) == row { ones } else { 0.0 };
                self.entries[entry] = self.weights[row] * (one + factor * slope(entry));
            }
        }
    }

    fn solve(&mut self, values: &mut [f64]) -> Result<(), LaError> {
        if self.is_singular {
            return Err(LaError::Other("the matrix is singular".into()));
        }
        let Factors { pattern, weights, entries, lu, work: [right, rest, scratch], .. } = self;
        right.fill(0.0);
        right.iter_mut().zip(values.iter()).zip(weights.iter()).for_each(|((r, v), w)| *r = v * w);
        rest.copy_from_slice(right);
        lu.solve(right, scratch);
        for (row, rest) in rest.iter_mut().enumerate() {
            for entry in pattern.row(row) {
                *rest -= entries[entry] * right[pattern.columns[entry] as usize];
            }
        }
        lu.solve(rest, scratch);
        values.iter_mut().zip(right.iter().zip(rest.iter())).for_each(|(value, (a, b))| *value = a + b);
        Ok(())
    }
}

impl Lu {
    fn solve(&self, values: &mut [f64], scratch: &mut [f64]) {
        match self {
            Lu::Sparse(lu) => lu.solve(values, scratch),
            Lu::Dense(lu) => {
                let size = values.len();
                let mut values = DVectorViewMut::from_slice(values, size);
                if let Some(lu) = lu {
                    lu.solve_mut(&mut values);
                }
            }
        }
    }
}

/// Factorises with rows in units of their tolerances.
#[derive(Default)]
pub(super) struct WeighedLu<'f> {
    factors: Option<&'f RefCell<Factors>>,
}

impl<'f> WeighedLu<'f> {
    pub(super) fn new(factors: &'f RefCell<Factors>) -> Self {
        WeighedLu { factors: Some(factors) }
    }
}

/// The power of 2 next below `1 / allowed`.
fn weight(allowed: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let inverse = 1.0 / allowed;
    if inverse.is_normal() { f64::from_bits(inverse.to_bits() & EXPONENT) } else { 1.0 }
}

impl LinearSolver<Shifted> for WeighedLu<'_> {
    fn set_linearisation<C>(&mut self, op: &C)
    where
        C: LaLinearOp<T = f64, V = NalgebraVec<f64>, M = Shifted, C = NalgebraContext>,
    {
        if let Some(factors) = self.factors {
            factors.borrow_mut().factor(|matrix| op.matrix_inplace(matrix));
        }
    }

    fn set_sparsity<C>(&mut self, _: &C)
    where
        C: LaLinearOp<T = f64, V = NalgebraVec<f64>, M = Shifted, C = NalgebraContext>,
    {
    }

    fn solve_in_place(&self, values: &mut NalgebraVec<f64>) -> Result<(), LaError> {
        let factors = self.factors.ok_or(LaError::Other("no matrix".into()))?;
        factors.borrow_mut().solve(values.inner_mut().as_mut_slice())
    }

    /// Only adjoint equations ask for it.
    fn solve_transpose_in_place(&self, _: &mut NalgebraVec<f64>) -> Result<(), LaError> {
        Err(LaError::Other("the transposed system is not solved".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block on which vessels stand, the last of which is a hub of all: as full and as sparse systems they have one solution.
    #[test]
    fn full_and_sparse_factors_agree() {
        let size = 30_u32;
        let states = size as usize - 1;
        let mut pattern = Pattern { states, starts: vec![0], columns: Vec::new() };
        for row in 0..size {
            let is_full = row == 0 || row == size - 1;
            pattern.columns.extend((0..size).filter(|column| is_full || [0, row, size - 1].contains(column)));
            pattern.starts.push(pattern.columns.len() as u32);
        }
        let slopes: Vec<f64> = (0..pattern.columns.len()).map(|k| f64::sin(1.0 + k as f64)).collect();
        let right: Vec<f64> = (0..states).map(|i| f64::cos(i as f64)).collect();
        let solve = |lu: Lu, factor: f64| {
            let mut factors = Factors::with(&pattern, lu);
            let allowed: Vec<f64> = (0..states).map(|i| 10f64.powi(-(i as i32 % 13))).collect();
            factors.allow(&allowed);
            factors.factor(|matrix| {
                matrix.set(slopes.len(), |out| out.copy_from_slice(&slopes));
                (matrix.ones, matrix.factor) = (1.0, factor);
            });
            let mut values = right.clone();
            factors.solve(&mut values).expect("it is regular");
            values
        };
        for factor in [-1e-3, -0.1, -10.0] {
            let full = solve(Lu::Dense(None), factor);
            let sparse = solve(Lu::Sparse(Box::new(SparseLu::new(&pattern))), factor);
            let most = full.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            assert!(full.iter().zip(&sparse).all(|(a, b)| (a - b).abs() < 1e-10 * most), "{full:?} {sparse:?}");
        }
    }

    #[test]
    fn a_weight_is_a_power_of_two() {
        assert_eq!(weight(0.25), 4.0);
        assert_eq!(weight(0.3), 2.0);
        assert_eq!(weight(2e-37).to_bits() & ((1 << 52) - 1), 0);
        assert_eq!(weight(0.0), 1.0);
    }
}
