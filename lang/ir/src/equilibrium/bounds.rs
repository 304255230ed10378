//! What solutions lie between where arguments do.

use super::{Part, System};
use crate::interval::{ALL, Interval};

/// Beyond these times what the slopes say, nothing within narrow bounds is taken to lie.
const MARGIN: f64 = 2.0;

impl System {
    /// Bounds of a part for all arguments within bounds. Amounts are bounded by what totals hold; of the rest nothing is known where
    /// the arguments are not.
    pub fn bounds(&self, part: Part, args: &[Interval]) -> Interval {
        if args.iter().all(|(low, high)| low == high) {
            let args: Vec<f64> = args.iter().map(|a| a.0).collect();
            let value = self.value(part, &args);
            return if value.is_nan() { ALL } else { (value, value) };
        }
        let Part::Amount(member) = part else { return ALL };
        let given = |i: usize| args[self.layout().amount(i)];
        if (0..self.members().len()).any(|i| given(i).0 < 0.0) {
            return ALL;
        }
        (0.0, self.basis.upper_bound(member as usize, |i| given(i).1) * (1.0 + 1e-9))
    }

    /// The same for narrow bounds, by the slopes in their middle and at their ends. Something that turns between these may lie outside.
    pub fn bounds_nearby(&self, part: Part, args: &[Interval]) -> Interval {
        let wide = || (0..args.len()).filter(|i| args[*i].0 != args[*i].1);
        let by: Vec<usize> = wide().collect();
        if by.is_empty() || by.iter().any(|i| !(args[*i].1 - args[*i].0).is_finite()) {
            return self.bounds(part, args);
        }
        let at = |share: f64| -> Vec<f64> {
            args.iter().map(|(low, high)| if low == high { *low } else { low + share * (high - low) }).collect()
        };
        let (mut radius, mut slopes) = (0.0_f64, Vec::new());
        for share in [0.0, 0.5, 1.0] {
            self.slopes(part, &at(share), &by, &mut slopes);
            let reach = |(i, slope): (&usize, &f64)| slope.abs() * (args[*i].1 - args[*i].0);
            radius = radius.max(0.5 * MARGIN * by.iter().zip(&slopes).map(reach).sum::<f64>());
        }
        let middle = self.value(part, &at(0.5));
        let reach = radius + 4.0 * f64::EPSILON * middle.abs();
        if reach.is_finite() && middle.is_finite() { (middle - reach, middle + reach) } else { ALL }
    }
}
