//! The matrix that the integrator solves with, `1 - c J`, as what it is made of.
//!
//! The library adds and scales matrices; what it makes of them only the linear solver ever looks into. So a matrix is here the slopes
//! of the law, by entry of their [`super::slopes::Pattern`], and two factors: adding up costs nothing, whatever the pattern.

use std::ops::Mul;

use diffsol::{Matrix, MatrixCommon, NalgebraContext, NalgebraVec, Scale, Vector};
use diffsol_la::{Dense, DenseRef, LaError, VectorIndex};

type Index = <NalgebraVec<f64> as Vector>::Index;

/// `ones` times the unit matrix and `factor` times the slopes.
#[derive(Clone, Debug)]
pub(super) struct Shifted {
    size: usize,
    pub(super) ones: f64,
    pub(super) factor: f64,
    /// None where they are all 0.
    pub(super) slopes: Vec<f64>,
    context: NalgebraContext,
}

impl Shifted {
    /// Makes it the slopes alone.
    pub(super) fn set(&mut self, entries: usize, fill: impl FnOnce(&mut [f64])) {
        (self.ones, self.factor) = (0.0, 1.0);
        self.slopes.resize(entries, 0.0);
        fill(&mut self.slopes);
    }
}

impl MatrixCommon for Shifted {
    type V = NalgebraVec<f64>;
    type T = f64;
    type C = NalgebraContext;
    type Inner = Vec<f64>;

    fn nrows(&self) -> usize {
        self.size
    }

    fn ncols(&self) -> usize {
        self.size
    }

    fn inner(&self) -> &Vec<f64> {
        &self.slopes
    }
}

impl Mul<Scale<f64>> for Shifted {
    type Output = Shifted;

    fn mul(mut self, Scale(by): Scale<f64>) -> Shifted {
        (self.ones, self.factor) = (by * self.ones, by * self.factor);
        self
    }
}

impl Mul<Scale<f64>> for &Shifted {
    type Output = Shifted;

    fn mul(self, by: Scale<f64>) -> Shifted {
        self.clone() * by
    }
}

/// What the library does with matrices of other equations than those of [`super::equations`].
macro_rules! foreign {
    () => {
        unreachable!("the integrator only adds and scales")
    };
}

impl Matrix for Shifted {
    type Sparsity = Dense<Shifted>;
    type SparsityRef<'a> = DenseRef<'a, Shifted>;

    fn sparsity(&self) -> Option<DenseRef<'_, Shifted>> {
        None
    }

    fn context(&self) -> &NalgebraContext {
        &self.context
    }

    fn inner_mut(&mut self) -> &mut Vec<f64> {
        &mut self.slopes
    }

    fn partition_indices_by_zero_diagonal(&self) -> (Index, Index) {
        let none = Index::zeros(0, self.context);
        (none, Index::from_vec((0..self.size).collect(), self.context))
    }

    fn zeros(size: usize, _: usize, context: NalgebraContext) -> Self {
        Shifted { size, ones: 0.0, factor: 0.0, slopes: Vec::new(), context }
    }

    fn new_from_sparsity(rows: usize, columns: usize, _: Option<Dense<Shifted>>, context: NalgebraContext) -> Self {
        Self::zeros(rows, columns, context)
    }

    /// The unit matrix: the only diagonal one that is asked for.
    fn from_diagonal(diagonal: &NalgebraVec<f64>) -> Self {
        Shifted { ones: 1.0, ..Self::zeros(diagonal.len(), diagonal.len(), NalgebraContext::default()) }
    }

    fn copy_from(&mut self, other: &Self) {
        (self.ones, self.factor) = (other.ones, other.factor);
        self.slopes.clone_from(&other.slopes);
    }

    fn scale_add_and_assign(&mut self, unit: &Self, by: f64, slopes: &Self) {
        self.ones = unit.ones + by * slopes.ones;
        self.factor = by * slopes.factor;
        self.slopes.clone_from(&slopes.slopes);
    }

    fn gemv(&self, _: f64, _: &NalgebraVec<f64>, _: f64, _: &mut NalgebraVec<f64>) {
        foreign!()
    }

    fn set_column(&mut self, _: usize, _: &NalgebraVec<f64>) {
        foreign!()
    }

    fn add_column_to_vector(&self, _: usize, _: &mut NalgebraVec<f64>) {
        foreign!()
    }

    fn add_columns_to_batched_vector(&self, _: &mut NalgebraVec<f64>) {
        foreign!()
    }

    fn set_data_with_indices(&mut self, _: &Index, _: &Index, _: &NalgebraVec<f64>) {
        foreign!()
    }

    fn gather(&mut self, _: &Self, _: &Index) {
        foreign!()
    }

    fn triplet_iter(&self) -> (impl Iterator<Item = (usize, usize)> + '_, impl Iterator<Item = f64> + '_) {
        (std::iter::empty(), std::iter::empty())
    }

    fn try_from_triplets(
        rows: usize,
        columns: usize,
        _: Vec<(usize, usize)>,
        _: Vec<f64>,
        context: NalgebraContext,
    ) -> Result<Self, LaError> {
        Ok(Self::zeros(rows, columns, context))
    }
}
