//! Small dense linear systems.

/// Rows one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Matrix {
    pub(super) size: usize,
    pub(super) entries: Vec<f64>,
}

impl Matrix {
    /// All 0.
    pub(super) fn new(size: usize) -> Matrix {
        Matrix { size, entries: vec![0.0; size * size] }
    }

    pub(super) fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.size..(row + 1) * self.size]
    }

    /// Its factors, with the largest entry of each column as pivot; none where it has no inverse.
    pub(super) fn factor(mut self) -> Option<Factors> {
        let n = self.size;
        let mut order: Vec<usize> = (0..n).collect();
        for k in 0..n {
            let pivot = (k..n).max_by(|a, b| {
                let of = |row: &usize| self.entries[row * n + k].abs();
                of(a).total_cmp(&of(b))
            })?;
            let largest = self.entries[pivot * n + k];
            if largest == 0.0 || !largest.is_finite() {
                return None;
            }
            if pivot != k {
                order.swap(pivot, k);
                (0..n).for_each(|j| self.entries.swap(pivot * n + j, k * n + j));
            }
            for row in k + 1..n {
                let factor = self.entries[row * n + k] / largest;
                self.entries[row * n + k] = factor;
                if factor != 0.0 {
                    let (above, below) = self.entries.split_at_mut(row * n);
                    let (from, to) = (&above[k * n + k + 1..k * n + n], &mut below[k + 1..n]);
                    to.iter_mut().zip(from).for_each(|(to, from)| *to -= factor * from);
                }
            }
        }
        Some(Factors { matrix: self, order })
    }
}

/// A matrix as the product of two triangles.
#[derive(Clone, Debug)]
pub(super) struct Factors {
    matrix: Matrix,
    order: Vec<usize>,
}

impl Factors {
    /// What the matrix takes to `right`.
    pub(super) fn solve(&self, right: &[f64]) -> Vec<f64> {
        let n = self.matrix.size;
        let mut x: Vec<f64> = self.order.iter().map(|row| right[*row]).collect();
        let dot = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
        for k in 0..n {
            x[k] -= dot(&self.matrix.row(k)[..k], &x[..k]);
        }
        for k in (0..n).rev() {
            let row = self.matrix.row(k);
            x[k] = (x[k] - dot(&row[k + 1..], &x[k + 1..])) / row[k];
        }
        x
    }
}
