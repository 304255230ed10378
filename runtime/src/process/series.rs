//! Steps of a large linear law, by the series of what its rates become: `f s + A f s^2 / 2 + A^2 f s^3 / 6 ...`.
//!
//! A term costs one look at the entries of the matrix, of which most large laws have few in a row; a product of matrices would cost the
//! third power of the number of states.

use super::exact::{Entry, PLACES, States, exponent};

/// Longer steps are taken in pieces in which the norm is no more: beyond it, terms that cancel would cost digits.
const NEAR: f64 = 4.0;

/// Terms end where two in a row are below this share of what the states may be off by.
const LEFT_OUT: f64 = 1e-5;

/// By then every series has ended: `4^100 / 100!` is 1e-98.
const TERMS: usize = 100;

/// A law as the entries of its matrix.
#[derive(Clone)]
pub(super) struct Series {
    entries: Vec<Entry>,
    /// The exponent of the longest piece.
    longest: i32,
}

impl Series {
    /// Of a matrix of this norm.
    pub(super) fn new(entries: Vec<Entry>, norm: f64) -> Self {
        let longest = if norm > 0.0 { exponent(NEAR / norm) } else { i32::MAX };
        Series { entries, longest }
    }

    /// By how much the states move in a step of `2^length` s that begins with these rates; they may be off by `allowed`.
    pub(super) fn moved(&self, length: i32, rates: &[f64], allowed: &[f64]) -> States {
        let piece = length.min(self.longest);
        let (span, pieces) = (2f64.powi(piece), 2f64.powi(length - piece));
        let mut states: States = std::array::from_fn(|_| Vec::new());
        let (mut moved, mut rates) = (vec![0.0; rates.len()], rates.to_vec());
        let mut begin = 0.0;
        while begin < pieces {
            // The places within this piece, and how far into it they are, s.
            let within = |place: f64| place * pieces > begin && place * pieces <= begin + 1.0;
            let places = PLACES.into_iter().enumerate().filter(|(_, place)| within(*place));
            let shown: Vec<(usize, f64)> = places.map(|(k, place)| (k, (place * pieces - begin) * span)).collect();
            shown.iter().for_each(|(k, _)| states[*k].clone_from(&moved));
            let mut term = rates.clone();
            let mut small = 0;
            for k in 0..TERMS {
                if k > 0 {
                    add(&mut rates, factor(span, k), &term);
                }
                let share = factor(span, k + 1);
                add(&mut moved, share, &term);
                shown.iter().for_each(|(place, span)| add(&mut states[*place], factor(*span, k + 1), &term));
                let is_small =
                    term.iter().zip(allowed).all(|(term, allowed)| (share * term).abs() <= LEFT_OUT * allowed);
                small = if is_small { small + 1 } else { 0 };
                if small == 2 {
                    break;
                }
                term = self.times(&term);
            }
            begin += 1.0;
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
