//! Steps of a large linear law, by the series of what its rates become: `f s + A f s^2 / 2 + A^2 f s^3 / 6 ...`.
//!
//! A term costs one look at the entries of the matrix, of which most large laws have few in a row; a product of matrices would cost the
//! third power of the number of states.

use super::exact::{Entry, PLACES, States};

/// Terms end where two in a row are below this share of what the states may be off by.
const LEFT_OUT: f64 = 1e-5;

/// By then every series has ended: a step has a norm of [`FAR`](super::exact::FAR) at most, and `4^100 / 100!` is 1e-98.
const TERMS: usize = 100;

/// A law as the entries of its matrix.
#[derive(Clone)]
pub(super) struct Series {
    pub(super) entries: Vec<Entry>,
}

impl Series {
    /// By how much the states move in a step of `2^length` s that begins with these rates; they may be off by `allowed`.
    pub(super) fn moved(&self, length: i32, rates: &[f64], allowed: &[f64]) -> States {
        let span = 2f64.powi(length);
        let mut states: States = std::array::from_fn(|_| vec![0.0; rates.len()]);
        let mut term = rates.to_vec();
        let mut small = 0;
        for k in 1..=TERMS {
            states.iter_mut().zip(PLACES).for_each(|(states, place)| add(states, factor(place * span, k), &term));
            let share = factor(span, k);
            let is_small = |(term, allowed): (&f64, &f64)| (share * term).abs() <= LEFT_OUT * allowed;
            small = if term.iter().zip(allowed).all(is_small) { small + 1 } else { 0 };
            if small == 2 {
                break;
            }
            term = self.times(&term);
        }
        states
    }

    fn times(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; vector.len()];
        self.entries.iter().for_each(|e| product[e.row as usize] += e.value * vector[e.column as usize]);
        product
    }
}

/// `span^power / power!`
fn factor(span: f64, power: usize) -> f64 {
    (1..=power).map(|i| span / i as f64).product()
}

fn add(sum: &mut [f64], factor: f64, other: &[f64]) {
    sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += factor * other);
}
