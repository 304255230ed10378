//! Where searches begin: first where the chain is, then spread evenly over what the limits allow.

use matterix_ir::math;
use matterix_ir::robot::JointKind;

use super::Request;
use crate::chain::Chain;
use crate::variables::Variable;

/// Of so many starts the one whose tip is nearest to the target is taken: a step costs more than a look.
const LOOKS: u32 = 4;

/// Starts of a search, one after the other.
pub(crate) struct Starts<'a> {
    request: &'a Request<'a>,
    /// From where to where each variable is drawn.
    ranges: Vec<(f64, f64)>,
    /// What is added to each coordinate from one draw to the next, modulo 1.
    rates: Vec<f64>,
    at: Vec<f64>,
    first: bool,
}

impl<'a> Starts<'a> {
    pub fn new(variables: &[Variable], request: &'a Request<'a>) -> Self {
        let ranges = variables.iter().zip(request.start).enumerate();
        let ranges = ranges.map(|(i, (v, &start))| range(v, start, request.weight(i))).collect();
        // The additive recurrence whose rates are powers of the root of x^(d+1) = x + 1 (Roberts 2018) spreads evenly in
        // any number of dimensions d, and needs no table.
        let dimensions = variables.len() as f64;
        let mut root = 2.0;
        for _ in 0..30 {
            root = math::pow(1.0 + root, 1.0 / (dimensions + 1.0));
        }
        let rates = (1..=variables.len()).map(|i| math::pow(root, -(i as f64))).collect();
        let at = (0..variables.len()).map(|i| unit(request.seed, i as u64)).collect();
        Self { request, ranges, rates, at, first: true }
    }

    pub fn next(&mut self, chain: &Chain) -> Vec<f64> {
        if std::mem::take(&mut self.first) {
            let clamp = |(v, &q): (&Variable, &f64)| q.clamp(v.limits.lower, v.limits.upper);
            return chain.variables().iter().zip(self.request.start).map(clamp).collect();
        }
        let cost = |q: &Vec<f64>| self.request.residual(&chain.tip(q)).norm_squared();
        let mut best = self.draw();
        let mut least = cost(&best);
        for _ in 1..LOOKS {
            let other = self.draw();
            let its = cost(&other);
            if its < least {
                (best, least) = (other, its);
            }
        }
        best
    }

    fn draw(&mut self) -> Vec<f64> {
        for (at, rate) in self.at.iter_mut().zip(&self.rates) {
            *at = (*at + rate).fract();
        }
        self.ranges.iter().zip(&self.at).map(|(&(low, high), &at)| low + at * (high - low)).collect()
    }
}

/// From where to where a variable is drawn: all of its range if it moves freely, less about the start if less gladly.
fn range(variable: &Variable, start: f64, weight: f64) -> (f64, f64) {
    let limits = &variable.limits;
    let start = start.clamp(limits.lower, limits.upper);
    // What has no ends is drawn within a turn, or within two metres.
    let reach = if variable.kind == JointKind::Prismatic { 2.0 } else { 2.0 * std::f64::consts::PI };
    let low = if limits.lower > f64::MIN { limits.lower } else { start - 0.5 * reach };
    let high = if limits.upper < f64::MAX { limits.upper } else { start + 0.5 * reach };
    // More than a turn about an axis brings nothing new.
    let spare = if variable.kind == JointKind::Prismatic { 0.0 } else { (0.5 * (high - low - reach)).max(0.0) };
    let (low, high) = (low + spare, high - spare);
    let half = 0.5 * weight.clamp(0.0, 1.0) * (high - low);
    if weight >= 1.0 { (low, high) } else { ((start - half).max(limits.lower), (start + half).min(limits.upper)) }
}

/// A number between 0 and 1 for a seed and an index: SplitMix64's output function (Steele, Lea, Flood 2014).
pub(crate) fn unit(seed: u64, index: u64) -> f64 {
    let mut z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 53) as f64
}
