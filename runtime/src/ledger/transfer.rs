//! The transfer of a fraction of one mixture into another.

use matterix_ir::NodeId;
use matterix_ir::model::{Kept, Mixture};

/// Why a transfer cannot be made; nothing has moved.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The fraction is not within 0 to 1.
    Fraction(f64),
    /// The destination has no place for this key, of which the source holds some; with the source's state.
    NoPlace(String, u32),
    /// The share of this state that is to stay behind is not within 0 to 1.
    Kept(u32, f64),
}

/// A fraction that differs from 1 by no more than this is all there is: what a thousand doses leave is known to their rounding only.
const ROUNDING: f64 = 1e-9;

/// How much of a state stays behind in a transfer, by the state: nothing of those that are not here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held(Vec<(u32, f64)>);

impl Held {
    /// What stays, where `now` tells what states are and `value` what nodes are worth.
    pub fn new(but: &[Kept], now: impl Fn(u32) -> f64, value: impl Fn(NodeId) -> f64) -> Result<Self, Refusal> {
        let amount = |kept: &Kept| {
            let value = value(kept.stays.source());
            kept.amount(now(kept.state), value).map(|a| (kept.state, a)).ok_or(Refusal::Kept(kept.state, value))
        };
        but.iter().map(amount).collect::<Result<_, _>>().map(Held)
    }

    /// How much of a state stays.
    pub fn of(&self, state: u32) -> f64 {
        self.0.iter().find(|(s, _)| *s == state).map_or(0.0, |(_, amount)| *amount)
    }

    /// Whether all may leave.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// What states become when `fraction` (0 to 1) of every extensive quantity of `from`, but of what is held there, moves into `to`, matched by
/// key; `now` tells what they are.
///
/// What is taken is what arrives, to the rounding of one subtraction; a fraction of 1 empties the source exactly.
pub fn transfer(
    now: impl Fn(u32) -> f64,
    fraction: f64,
    held: &Held,
    from: &Mixture,
    to: &Mixture,
) -> Result<Vec<(u32, f64)>, Refusal> {
    if !(0.0..=1.0 + ROUNDING).contains(&fraction) {
        return Err(Refusal::Fraction(fraction));
    }
    let fraction = if (fraction - 1.0).abs() <= ROUNDING { 1.0 } else { fraction };
    let place = |key: &String| to.extensive.binary_search_by(|(k, _)| k.cmp(key)).ok().map(|i| to.extensive[i].1);
    for (key, source) in &from.extensive {
        if place(key).is_none() && fraction * (now(*source) - held.of(*source)) != 0.0 {
            return Err(Refusal::NoPlace(key.clone(), *source));
        }
    }
    let mut after = Vec::with_capacity(2 * from.extensive.len());
    for (key, source) in &from.extensive {
        let Some(destination) = place(key).filter(|destination| destination != source) else { continue };
        let moved = fraction * (now(*source) - held.of(*source));
        after.extend([(*source, now(*source) - moved), (destination, now(destination) + moved)]);
    }
    Ok(after)
}
