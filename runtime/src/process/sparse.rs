//! Sparse LU factorisation: column by column from the left (Gilbert and Peierls 1988), in an order that keeps it sparse (approximate
//! minimum degree; Amestoy, Davis and Duff 1996).
//!
//! A pivot is the entry on the diagonal wherever that is not much smaller than another: rows of which some are nearly full, as those of
//! a block that all vessels stand on, would else fill the factors. A factorisation of other numbers goes through the same
//! operations again for as long as its pivots are good.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::slopes::Pattern;

/// The diagonal entry is the pivot unless another one of its column is larger by the inverse of this.
const DIAGONAL: f64 = 0.1;

/// Old pivots are kept for as long as none is smaller than this part of the largest of its column.
const KEPT: f64 = 0.01;

/// So many nested columns are subtracted at a time.
const PANEL: usize = 4;

/// A row that is no pivot yet.
const OPEN: u32 = u32::MAX;

/// Columns of a triangular matrix.
#[derive(Clone, Debug, Default)]
struct Triangle {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Triangle {
    fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.rows.clear();
        self.values.clear();
    }

    fn column(&self, k: usize) -> std::ops::Range<usize> {
        self.starts[k] as usize..self.starts[k + 1] as usize
    }

    fn push(&mut self, row: u32, value: f64) {
        self.rows.push(row);
        self.values.push(value);
    }

    fn close(&mut self) {
        self.starts.push(self.rows.len() as u32);
    }

    /// Numbers rows anew and sorts them.
    fn renumber(&mut self, number: impl Fn(u32) -> u32) {
        for k in 0..self.starts.len() - 1 {
            let range = self.column(k);
            let entries = self.rows[range.clone()].iter().zip(&self.values[range.clone()]);
            let mut entries: Vec<(u32, f64)> = entries.map(|(row, value)| (number(*row), *value)).collect();
            entries.sort_unstable_by_key(|e| e.0);
            for (place, (row, value)) in range.zip(entries) {
                (self.rows[place], self.values[place]) = (row, value);
            }
        }
    }

    /// By column, the last of those that are nested in each other from it on: each has the next as its first row, and its rows.
    fn nests(&self) -> Vec<u32> {
        let size = self.starts.len() - 1;
        let mut ends: Vec<u32> = (0..size as u32).collect();
        for k in (0..size.saturating_sub(1)).rev() {
            let (own, next) = (&self.rows[self.column(k)], &self.rows[self.column(k + 1)]);
            if own.first() == Some(&(k as u32 + 1)) && own[1..] == *next {
                ends[k] = ends[k + 1];
            }
        }
        ends
    }

    /// Subtracts multiples of nested columns from `first` on, by what stands in `work` in their rows, which goes to `factors`.
    fn subtract(&self, first: usize, work: &mut [f64], factors: &mut [f64]) {
        for (panel, factors) in factors.chunks_mut(PANEL).enumerate() {
            let begin = first + panel * PANEL;
            let rows = &self.rows[self.column(begin + factors.len() - 1)];
            let mut columns: [&[f64]; PANEL] = [&[]; PANEL];
            for (k, factor) in factors.iter_mut().enumerate() {
                *factor = std::mem::take(&mut work[begin + k]);
                let column = &self.values[self.column(begin + k)];
                let (above, below) = column.split_at(column.len() - rows.len());
                work[begin + k + 1..].iter_mut().zip(above).for_each(|(value, part)| *value -= part * *factor);
                columns[k] = below;
            }
            if factors.iter().all(|factor| *factor == 0.0) {
                continue;
            }
            match (factors, rows) {
                (&mut [a, b, c, d], &[low, .., high]) if (high - low) as usize + 1 == rows.len() => {
                    let [x, y, z, w] = columns;
                    let sums =
                        x.iter().zip(y).zip(z.iter().zip(w)).map(|((x, y), (z, w))| (a * x + b * y) + (c * z + d * w));
                    work[low as usize..].iter_mut().zip(sums).for_each(|(value, sum)| *value -= sum);
                }
                (factors, rows) => {
                    for (factor, column) in factors.iter().zip(columns) {
                        rows.iter().zip(column).for_each(|(row, part)| work[*row as usize] -= part * factor);
                    }
                }
            }
        }
    }
}

/// A matrix is singular.
#[derive(Clone, Copy, Debug)]
pub(super) struct Singular;

/// The factors of matrices of one pattern.
#[derive(Clone, Debug)]
pub(super) struct SparseLu {
    /// By column, rows and entries of the pattern.
    starts: Vec<u32>,
    rows: Vec<u32>,
    entries: Vec<u32>,
    /// By place of `rows`, the step whose pivot that row has.
    targets: Vec<u32>,
    /// The columns in the order in which they are taken.
    order: Vec<u32>,
    /// By step, the row of its pivot; empty before the first factorisation.
    pivots: Vec<u32>,
    /// By row, the step whose pivot it has.
    steps: Vec<u32>,
    diagonal: Vec<f64>,
    /// Below the diagonal, by steps.
    lower: Triangle,
    /// Above it.
    upper: Triangle,
    /// Which columns of the lower one are nested.
    nests: Vec<u32>,
    work: Vec<f64>,
}

impl SparseLu {
    pub(super) fn new(pattern: &Pattern) -> Self {
        let size = pattern.size();
        let mut starts = vec![0_u32; size + 1];
        pattern.columns.iter().for_each(|column| starts[*column as usize + 1] += 1);
        (0..size).for_each(|k| starts[k + 1] += starts[k]);
        let mut next = starts.clone();
        let (mut rows, mut entries) = (vec![0; pattern.columns.len()], vec![0; pattern.columns.len()]);
        for row in 0..size {
            for entry in pattern.row(row) {
                let place = &mut next[pattern.columns[entry] as usize];
                (rows[*place as usize], entries[*place as usize]) = (row as u32, entry as u32);
                *place += 1;
            }
        }
        let order = order(&starts, &rows);
        let (pivots, steps) = (Vec::new(), vec![OPEN; size]);
        let (diagonal, work) = (vec![0.0; size], vec![0.0; size]);
        let (lower, upper) = (Triangle::default(), Triangle::default());
        let (targets, nests) = (Vec::new(), Vec::new());
        SparseLu { starts, rows, entries, targets, order, pivots, steps, diagonal, lower, upper, nests, work }
    }

    /// Entries of both factors.
    #[cfg(test)]
    pub(super) fn filled(&self) -> usize {
        self.diagonal.len() + self.lower.rows.len() + self.upper.rows.len()
    }

    /// Factorises the matrix of `values`, by entry of the pattern.
    pub(super) fn factor(&mut self, values: &[f64]) -> Result<(), Singular> {
        if self.pivots.len() == self.order.len() && self.repeat(values) {
            return Ok(());
        }
        match self.begin(values) {
            Ok(()) => self.settle(),
            Err(singular) => {
                self.pivots.clear();
                return Err(singular);
            }
        }
        Ok(())
    }

    /// Numbers rows by their steps, once all have one.
    fn settle(&mut self) {
        let steps = &self.steps;
        self.lower.renumber(|row| steps[row as usize]);
        self.upper.renumber(|step| step);
        self.targets = self.rows.iter().map(|row| steps[*row as usize]).collect();
        self.nests = self.lower.nests();
    }

    fn scatter(&mut self, column: usize, values: &[f64]) {
        for k in self.starts[column] as usize..self.starts[column + 1] as usize {
            self.work[self.rows[k] as usize] = values[self.entries[k] as usize];
        }
    }

    /// Subtracts the multiple `factor` of column `step` of the lower factor.
    fn reduce(&mut self, step: usize, factor: f64) {
        for k in self.lower.column(step) {
            self.work[self.lower.rows[k] as usize] -= self.lower.values[k] * factor;
        }
    }

    /// The same operations as before; whether the pivots are still good.
    fn repeat(&mut self, values: &[f64]) -> bool {
        let SparseLu { lower, upper, work, .. } = self;
        for k in 0..self.order.len() {
            let column = self.order[k] as usize;
            for place in self.starts[column] as usize..self.starts[column + 1] as usize {
                work[self.targets[place] as usize] = values[self.entries[place] as usize];
            }
            let mut range = upper.column(k);
            while let Some(&first) = upper.rows[range.clone()].first() {
                let nested = upper.rows[range.clone()].iter().zip(first..=self.nests[first as usize]);
                let count = nested.take_while(|(step, nested)| *step == nested).count();
                lower.subtract(first as usize, work, &mut upper.values[range.start..range.start + count]);
                range.start += count;
            }
            let pivot = std::mem::take(&mut work[k]);
            let mut most = 0.0_f64;
            for e in lower.column(k) {
                let value = std::mem::take(&mut work[lower.rows[e] as usize]);
                most = most.max(value.abs());
                lower.values[e] = value / pivot;
            }
            self.diagonal[k] = pivot;
            if !(pivot.is_normal() && pivot.abs() >= KEPT * most) {
                return false;
            }
        }
        true
    }

    /// Chooses pivots.
    fn begin(&mut self, values: &[f64]) -> Result<(), Singular> {
        self.pivots.clear();
        self.steps.fill(OPEN);
        self.work.fill(0.0);
        self.lower.clear();
        self.upper.clear();
        let mut search = Search::new(self.order.len());
        for k in 0..self.order.len() {
            let column = self.order[k] as usize;
            let entries = self.starts[column] as usize..self.starts[column + 1] as usize;
            search.reach(&self.rows[entries], &self.steps, &self.lower);
            self.scatter(column, values);
            for &row in search.found.iter().rev() {
                let step = self.steps[row as usize];
                if step != OPEN {
                    let factor = std::mem::take(&mut self.work[row as usize]);
                    self.upper.push(step, factor);
                    self.reduce(step as usize, factor);
                }
            }
            self.upper.close();
            self.pivot(k, column, &search.found)?;
        }
        Ok(())
    }

    /// Chooses the pivot of step `k` among the rows `found` that are open.
    fn pivot(&mut self, k: usize, column: usize, found: &[u32]) -> Result<(), Singular> {
        let open = |row: &&u32| self.steps[**row as usize] == OPEN;
        let mut best = (OPEN, 0.0_f64);
        for &row in found.iter().rev().filter(open) {
            let size = self.work[row as usize].abs();
            if size > best.1 {
                best = (row, size);
            }
        }
        let straight = self.steps[column] == OPEN && self.work[column].abs() >= DIAGONAL * best.1;
        let row = if straight { column as u32 } else { best.0 };
        if row == OPEN || !self.work[row as usize].is_normal() {
            return Err(Singular);
        }
        let pivot = std::mem::take(&mut self.work[row as usize]);
        for &other in found.iter().rev().filter(|other| **other != row) {
            if self.steps[other as usize] == OPEN {
                let value = std::mem::take(&mut self.work[other as usize]);
                self.lower.push(other, value / pivot);
            }
        }
        self.lower.close();
        self.diagonal[k] = pivot;
        self.pivots.push(row);
        self.steps[row as usize] = k as u32;
        Ok(())
    }

    /// Solves for `values`, which become the solution; `work` is as long.
    pub(super) fn solve(&self, values: &mut [f64], work: &mut [f64]) {
        work.iter_mut().zip(&self.pivots).for_each(|(value, row)| *value = values[*row as usize]);
        for k in 0..self.pivots.len() {
            let factor = work[k];
            if factor != 0.0 {
                for e in self.lower.column(k) {
                    work[self.lower.rows[e] as usize] -= self.lower.values[e] * factor;
                }
            }
        }
        for k in (0..self.pivots.len()).rev() {
            let value = work[k] / self.diagonal[k];
            values[self.order[k] as usize] = value;
            for e in self.upper.column(k) {
                work[self.upper.rows[e] as usize] -= self.upper.values[e] * value;
            }
        }
    }
}

/// Finds which rows of a column come to be other than 0.
struct Search {
    seen: Vec<bool>,
    /// Each after those that it changes.
    found: Vec<u32>,
    /// Rows on the way, and how far their columns have been gone through.
    way: Vec<(u32, u32)>,
}

impl Search {
    fn new(size: usize) -> Self {
        Search { seen: vec![false; size], found: Vec::new(), way: Vec::new() }
    }

    fn reach(&mut self, rows: &[u32], steps: &[u32], lower: &Triangle) {
        self.found.iter().for_each(|row| self.seen[*row as usize] = false);
        self.found.clear();
        for &row in rows {
            self.enter(row);
            while let Some(&(row, next)) = self.way.last() {
                let step = steps[row as usize];
                let below = if step == OPEN { &[][..] } else { &lower.rows[lower.column(step as usize)] };
                match below.get(next as usize) {
                    Some(&further) => {
                        self.way.last_mut().expect("it is there").1 += 1;
                        self.enter(further);
                    }
                    None => {
                        self.found.push(row);
                        self.way.pop();
                    }
                }
            }
        }
    }

    fn enter(&mut self, row: u32) {
        if !std::mem::replace(&mut self.seen[row as usize], true) {
            self.way.push((row, 0));
        }
    }
}

/// An order of columns that keeps the factors sparse; their own where none is found.
fn order(starts: &[u32], rows: &[u32]) -> Vec<u32> {
    let size = starts.len() - 1;
    let own = || (0..size as u32).collect();
    let matrix = SymbolicSparseColMatRef::new_checked(size, size, starts, None, rows);
    let (mut order, mut inverse) = (vec![0_u32; size], vec![0_u32; size]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(size, rows.len()));
    let control = amd::Control::default();
    match amd::order(&mut order, &mut inverse, matrix, control, MemStack::new(&mut memory)) {
        Ok(_) => order,
        Err(_) => own(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A pattern of the entries given, and the diagonal.
    fn pattern(size: usize, entries: &[(usize, usize)]) -> Pattern {
        let mut all: Vec<(usize, usize)> = entries.iter().map(|(i, j)| (i % size, j % size)).collect();
        all.extend((0..size).map(|i| (i, i)));
        all.sort_unstable();
        all.dedup();
        let starts = (0..=size).map(|row| all.partition_point(|e| e.0 < row) as u32).collect();
        Pattern { states: size, starts, columns: all.iter().map(|e| e.1 as u32).collect() }
    }

    fn times(pattern: &Pattern, values: &[f64], x: &[f64]) -> Vec<f64> {
        let dot = |row| pattern.row(row).map(|e| values[e] * x[pattern.columns[e] as usize]).sum();
        (0..pattern.size()).map(dot).collect()
    }

    fn solved(lu: &SparseLu, pattern: &Pattern, values: &[f64]) -> f64 {
        let x: Vec<f64> = (0..pattern.size()).map(|i| 1.0 + i as f64).collect();
        let mut y = times(pattern, values, &x);
        lu.solve(&mut y, &mut vec![0.0; x.len()]);
        x.iter().zip(&y).fold(0.0, |most, (x, y)| (x - y).abs().max(most))
    }

    proptest! {
        #[test]
        fn random_systems_are_solved(
            size in 1_usize..40,
            entries in prop::collection::vec(any::<(usize, usize)>(), 0..120),
            numbers in prop::collection::vec(-1.0..1.0_f64, 400),
        ) {
            let pattern = pattern(size, &entries);
            let mut lu = SparseLu::new(&pattern);
            // The second matrix is factorised by the pivots of the first one, or anew.
            for shift in [0, 200] {
                let heavy = |row: usize, e: usize| if pattern.columns[e] as usize == row { 6.0 } else { 0.0 };
                let values: Vec<f64> = (0..size)
                    .flat_map(|row| pattern.row(row).map(move |e| (row, e)))
                    .map(|(row, e)| heavy(row, e) + numbers[(shift + e) % 400])
                    .collect();
                prop_assert!(lu.factor(&values).is_ok());
                prop_assert!(solved(&lu, &pattern, &values) < 1e-7);
            }
        }
    }

    #[test]
    fn a_diagonal_of_nothing_needs_other_pivots() {
        let pattern = pattern(3, &[(0, 1), (1, 2), (2, 0)]);
        let mut lu = SparseLu::new(&pattern);
        // Row by row: 0, 2 | 0, 3 | 4, 0.
        let values = [0.0, 2.0, 0.0, 3.0, 4.0, 0.0];
        assert!(lu.factor(&values).is_ok());
        assert_eq!(solved(&lu, &pattern, &values), 0.0);
        assert!(lu.factor(&[1.0, 0.0, 1.0, 0.0, 0.0, 1.0]).is_ok(), "other pivots");
        assert!(lu.factor(&[0.0; 6]).is_err());
        assert!(lu.factor(&values).is_ok(), "after a singular one");
    }

    #[test]
    fn a_star_does_not_fill_in() {
        let size = 400;
        let arms: Vec<(usize, usize)> = (1..size).flat_map(|i| [(0, i), (i, 0)]).collect();
        let pattern = pattern(size, &arms);
        let values: Vec<f64> = (0..size)
            .flat_map(|row| pattern.row(row).map(move |e| (row, e)))
            .map(|(row, e)| if pattern.columns[e] as usize == row { 3.0 } else { -1.0 })
            .collect();
        let mut lu = SparseLu::new(&pattern);
        assert!(lu.factor(&values).is_ok());
        assert_eq!(lu.filled(), 3 * size - 2);
    }
}
