//! Steps of a small linear law, by matrices: those of a length are made from those of half of it,
//! `P(2 s) = 2 P(s) + P(s) A P(s)`, and serve for all steps of that length.

use std::collections::BTreeMap;

use super::exact::{Entry, PLACES, States};

/// Terms of the series, enough where the norm is at most [`NEAR`].
const TERMS: usize = 13;

/// The norm up to which the series is used.
const NEAR: f64 = 0.5;

/// A square matrix, row by row.
#[derive(Clone, Debug)]
struct Square {
    size: usize,
    entries: Vec<f64>,
}

impl Square {
    fn zeros(size: usize) -> Self {
        Square { size, entries: vec![0.0; size * size] }
    }

    fn times(&self, other: &Square) -> Square {
        let mut product = Square::zeros(self.size);
        for (row, out) in self.rows().zip(product.entries.chunks_mut(self.size)) {
            for (factor, other) in row.iter().zip(other.rows()).filter(|(factor, _)| **factor != 0.0) {
                out.iter_mut().zip(other).for_each(|(out, other)| *out += factor * other);
            }
        }
        product
    }

    fn add(&mut self, factor: f64, other: &Square) {
        self.entries.iter_mut().zip(&other.entries).for_each(|(a, b)| *a += factor * b);
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.entries.chunks(self.size)
    }
}

/// A law as its matrix.
#[derive(Clone)]
pub(super) struct Doubled {
    /// The first powers of the matrix, the unit matrix before them.
    powers: Vec<Square>,
    norm: f64,
    /// By the exponent of the length, [`PLACES`] of a step.
    known: BTreeMap<i32, Vec<Square>>,
}

impl Doubled {
    /// Of a matrix of this size and norm.
    pub(super) fn new(size: usize, entries: &[Entry], norm: f64) -> Self {
        let (mut one, mut matrix) = (Square::zeros(size), Square::zeros(size));
        (0..size).for_each(|i| one.entries[i * size + i] = 1.0);
        entries.iter().for_each(|e| matrix.entries[e.row as usize * size + e.column as usize] = e.value);
        Doubled { powers: vec![one, matrix], norm, known: BTreeMap::new() }
    }

    /// By how much the states move in a step of `2^length` s that begins with these rates.
    pub(super) fn moved(&mut self, length: i32, rates: &[f64]) -> States {
        self.prepare(length);
        let matrices = &self.known[&length];
        let product = |row: &[f64]| row.iter().zip(rates).map(|(a, b)| a * b).sum();
        std::array::from_fn(|k| matrices[k].rows().map(product).collect())
    }

    /// Makes the matrices of steps of one length.
    fn prepare(&mut self, length: i32) {
        let mut begin = length;
        while !self.known.contains_key(&begin) && self.norm * 2f64.powi(begin) > NEAR {
            begin -= 1;
        }
        if !self.known.contains_key(&begin) {
            let made = PLACES.iter().map(|place| self.series(place * 2f64.powi(begin))).collect();
            self.known.insert(begin, made);
        }
        for length in begin..length {
            let twice = |half: &Square| {
                let mut twice = half.times(&self.powers[1].times(half));
                twice.add(2.0, half);
                twice
            };
            let made = self.known[&length].iter().map(twice).collect();
            self.known.insert(length + 1, made);
        }
    }

    /// `P(span)` by its series.
    fn series(&mut self, span: f64) -> Square {
        while self.powers.len() <= TERMS {
            let next = self.powers[1].times(&self.powers[self.powers.len() - 1]);
            self.powers.push(next);
        }
        let mut sum = Square::zeros(self.powers[0].size);
        // The smallest first.
        for (k, power) in self.powers.iter().enumerate().rev() {
            let factor = (0..=k).map(|i| span / (i + 1) as f64).product();
            sum.add(factor, power);
        }
        sum
    }
}
