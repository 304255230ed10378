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

/// What states become when `fraction` (0 to 1) of every extensive quantity of `from` moves into `to`, matched by key; `now` tells
/// what they are.
///
/// What is taken is what arrives, to the rounding of one subtraction; a fraction of 1 empties the source exactly.
pub fn transfer(
    now: impl Fn(u32) -> f64,
    fraction: f64,
    from: &Mixture,
    to: &Mixture,
) -> Result<Vec<(u32, f64)>, Refusal> {
    if !(0.0..=1.0 + ROUNDING).contains(&fraction) {
        return Err(Refusal::Fraction(fraction));
    }
    let fraction = if (fraction - 1.0).abs() <= ROUNDING { 1.0 } else { fraction };
    let place = |key: &String| to.extensive.binary_search_by(|(k, _)| k.cmp(key)).ok().map(|i| to.extensive[i].1);
    for (key, source) in &from.extensive {
        if place(key).is_none() && fraction * now(*source) != 0.0 {
            return Err(Refusal::NoPlace(key.clone(), *source));
        }
    }
    let mut after = Vec::with_capacity(2 * from.extensive.len());
    for (key, source) in &from.extensive {
        let Some(destination) = place(key).filter(|destination| destination != source) else { continue };
        let moved = fraction * now(*source);
        after.extend([(*source, now(*source) - moved), (destination, now(destination) + moved)]);
    }
    Ok(after)
}
