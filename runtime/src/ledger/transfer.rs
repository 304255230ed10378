//! The transfer of a fraction of one mixture into another.

use matterix_ir::model::Mixture;

/// Why a transfer cannot be made; nothing has moved.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The fraction is not within 0 to 1.
    Fraction(f64),
    /// The destination has no place for this key, of which the source holds some; with the source's state.
    NoPlace(String, u32),
}

/// A fraction that differs from 1 by no more than this is all there is: what a thousand doses leave is known to their rounding only.
const ROUNDING: f64 = 1e-9;

/// Moves `fraction` (0 to 1) of every extensive quantity of `from` into `to`, matched by key.
///
/// What is taken is what arrives, to the rounding of one subtraction; a fraction of 1 empties the source exactly.
pub fn transfer(states: &mut [f64], fraction: f64, from: &Mixture, to: &Mixture) -> Result<(), Refusal> {
    if !(0.0..=1.0 + ROUNDING).contains(&fraction) {
        return Err(Refusal::Fraction(fraction));
    }
    let fraction = if (fraction - 1.0).abs() <= ROUNDING { 1.0 } else { fraction };
    let place = |key: &String| to.extensive.binary_search_by(|(k, _)| k.cmp(key)).ok().map(|i| to.extensive[i].1);
    for (key, source) in &from.extensive {
        if place(key).is_none() && fraction * states[*source as usize] != 0.0 {
            return Err(Refusal::NoPlace(key.clone(), *source));
        }
    }
    for (key, source) in &from.extensive {
        let (source, Some(destination)) = (*source as usize, place(key)) else { continue };
        let destination = destination as usize;
        if source == destination {
            continue;
        }
        let moved = fraction * states[source];
        states[source] -= moved;
        states[destination] += moved;
    }
    Ok(())
}
