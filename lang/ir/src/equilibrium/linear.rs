//! Small dense linear systems.

/// Rows one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Matrix {
    size: usize,
    entries: Vec<f64>,
}

impl Matrix {
    /// All 0.
    pub(super) fn of_size(size: usize) -> Matrix {
        let mut matrix = Matrix::default();
        matrix.clear(size);
        matrix
    }

    /// Makes all 0, in the memory that it has.
    pub(super) fn clear(&mut self, size: usize) {
        self.size = size;
        self.entries.clear();
        self.entries.resize(size * size, 0.0);
    }

    pub(super) fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }

    pub(super) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.entries[row * self.size..(row + 1) * self.size]
    }

    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.size..(row + 1) * self.size]
    }
}

/// A matrix as the product of two triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct Factors {
    /// What is to be factored; the triangles, once it is.
    pub(super) matrix: Matrix,
    /// The rows and columns that are eliminated first, in their order; the others follow as they are.
    first: Vec<usize>,
    /// Room for the matrix in that order.
    ordered: Matrix,
    /// The column of the matrix of each column of the triangles, and the row of each row.
    columns: Vec<usize>,
    rows: Vec<usize>,
}

impl Factors {
    /// Those of a matrix that is still to be filled in.
    pub(super) fn in_order(first: &[usize]) -> Factors {
        Factors { first: first.to_vec(), ..Factors::default() }
    }

    /// Those of a matrix; none where it has no inverse.
    pub(super) fn of(matrix: Matrix) -> Option<Factors> {
        let mut factors = Factors { matrix, ..Factors::default() };
        factors.factor().then_some(factors)
    }

    /// Factors the matrix in its place, with the largest entry of each column as pivot; whether it has an inverse.
    pub(super) fn factor(&mut self) -> bool {
        let n = self.matrix.size;
        self.columns.clear();
        self.columns.extend((0..n).map(|k| self.first.get(k).copied().unwrap_or(k)));
        self.rows.clone_from(&self.columns);
        if !self.first.is_empty() {
            self.bring_in_order();
        }
        let entries = &mut self.matrix.entries;
        for k in 0..n {
            let (mut pivot, mut largest) = (k, entries[k * n + k].abs());
            for row in k + 1..n {
                let of = entries[row * n + k].abs();
                if of > largest || of.is_nan() {
                    (pivot, largest) = (row, of);
                }
            }
            if largest == 0.0 || !largest.is_finite() {
                return false;
            }
            let (above, below) = entries.split_at_mut((k + 1) * n);
            let from = &mut above[k * n..];
            if pivot != k {
                self.rows.swap(pivot, k);
                from.swap_with_slice(&mut below[(pivot - k - 1) * n..][..n]);
            }
            let by = 1.0 / from[k];
            for to in below.chunks_exact_mut(n) {
                if to[k] != 0.0 {
                    let factor = to[k] * by;
                    to[k] = factor;
                    to[k + 1..].iter_mut().zip(&from[k + 1..]).for_each(|(to, from)| *to -= factor * from);
                }
            }
        }
        true
    }

    /// Brings rows and columns into the order in which they are eliminated.
    fn bring_in_order(&mut self) {
        self.ordered.clear(self.matrix.size);
        for (k, row) in self.rows.iter().enumerate() {
            let from = self.matrix.row(*row);
            self.ordered.row_mut(k).iter_mut().zip(&self.columns).for_each(|(to, column)| *to = from[*column]);
        }
        std::mem::swap(&mut self.matrix, &mut self.ordered);
    }

    /// What the matrix takes to `right`.
    pub(super) fn solve(&self, right: Vec<f64>) -> Vec<f64> {
        let mut x = Vec::with_capacity(right.len());
        self.solve_into(&right, &mut x);
        x
    }

    /// The same, into memory that is there.
    pub(super) fn solve_into(&self, right: &[f64], x: &mut Vec<f64>) {
        let n = self.matrix.size;
        let mut solved: Vec<f64> = self.rows.iter().map(|row| right[*row]).collect();
        let dot = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
        for k in 0..n {
            solved[k] -= dot(&self.matrix.row(k)[..k], &solved[..k]);
        }
        for k in (0..n).rev() {
            let row = self.matrix.row(k);
            solved[k] = (solved[k] - dot(&row[k + 1..], &solved[k + 1..])) / row[k];
        }
        x.clear();
        x.resize(n, 0.0);
        solved.into_iter().zip(&self.columns).for_each(|(value, column)| x[*column] = value);
    }
}
