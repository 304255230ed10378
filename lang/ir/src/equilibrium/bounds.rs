//! What solutions lie between where arguments do.
//!
//! What is soluble in closed form is bounded exactly: amounts by the totals that hold them. The rest moves smoothly, and is bounded by slopes
//! at several points with a margin, where that is known to suffice: along the temperature alone, and for what all of a mixture makes up.
//! Single activities turn by powers of ten within a drop where amounts do; nothing is claimed of them then.

use super::{Part, Phase, System};
use crate::interval::{ALL, Interval};

/// Beyond these times what the slopes say, nothing within narrow bounds is taken to lie.
const MARGIN: f64 = 2.0;

/// Into so many stretches of temperature bounds are cut at most, none of them narrower than this, K: within a degree no constant changes so
/// much that slopes at three points would not show it.
const STRETCHES: usize = 8;
const STRETCH: f64 = 1.0;

impl System {
    /// Bounds of a part for all arguments within bounds.
    pub fn bounds(&self, part: Part, args: &[Interval]) -> Interval {
        let is_wide = |i: &usize| args[*i].0 != args[*i].1;
        let wide: Vec<usize> = (0..args.len()).filter(is_wide).collect();
        if wide.is_empty() {
            let args: Vec<f64> = args.iter().map(|a| a.0).collect();
            let value = self.value(part, &args);
            return if value.is_nan() { ALL } else { (value, value) };
        }
        if wide.iter().any(|i| !(args[*i].1 - args[*i].0).is_finite()) {
            return self.by_totals(part, args);
        }
        if wide.iter().all(|i| *i >= self.layout().heat()) {
            let along = self.along_temperature(part, args, &wide);
            return if along == ALL { self.by_totals(part, args) } else { along };
        }
        let is_bulk = match part {
            Part::Amount(member) => self.members()[member as usize].phase == Phase::Solvent,
            Part::Activity(_) => false,
            Part::Temperature | Part::Strength | Part::Heat | Part::Capacity => true,
        };
        let near = if is_bulk { self.bounds_nearby(part, args) } else { ALL };
        if near == ALL { self.by_totals(part, args) } else { near }
    }

    /// Amounts are bounded by what totals hold; nothing is known of the rest.
    fn by_totals(&self, part: Part, args: &[Interval]) -> Interval {
        let Part::Amount(member) = part else { return ALL };
        let given = |i: usize| args[self.layout().amount(i)];
        if (0..self.members().len()).any(|i| given(i).0 < 0.0) {
            return ALL;
        }
        (0.0, self.basis.upper_bound(member as usize, |i| given(i).1) * (1.0 + 1e-9))
    }

    /// Bounds where the heat alone is not known: the temperature grows with the heat and with the temperature of reference, and moves one
    /// way with the capacity, so that it lies between those of the corners; all else follows from it.
    fn along_temperature(&self, part: Part, args: &[Interval], wide: &[usize]) -> Interval {
        let layout = self.layout();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in 0..1_u32 << wide.len() {
            let mut at: Vec<f64> = args.iter().map(|a| a.0).collect();
            for (k, i) in wide.iter().enumerate() {
                at[*i] = if corner >> k & 1 == 0 { args[*i].0 } else { args[*i].1 };
            }
            let temperature = self.value(Part::Temperature, &at);
            if temperature.is_nan() {
                return ALL;
            }
            (low, high) = (low.min(temperature), high.max(temperature));
        }
        let slack = 1e-9 * high;
        (low, high) = (low - slack, high + slack);
        if part == Part::Temperature {
            return (low, high);
        }
        let mut args = args.to_vec();
        (args[layout.heat()], args[layout.capacity()]) = ((0.0, 0.0), (f64::INFINITY, f64::INFINITY));
        let stretches = (((high - low) / STRETCH).ceil() as usize).clamp(1, STRETCHES);
        let step = (high - low) / stretches as f64;
        let mut hull = (f64::INFINITY, f64::NEG_INFINITY);
        for stretch in 0..stretches {
            let from = low + step * stretch as f64;
            args[layout.reference()] = (from, from + step);
            let (least, most) = self.bounds_nearby(part, &args);
            hull = (hull.0.min(least), hull.1.max(most));
        }
        match part {
            // None is below nothing.
            Part::Amount(_) => (hull.0.max(0.0), hull.1),
            _ => hull,
        }
    }

    /// Bounds for narrow bounds, by the slopes in their middle and at their ends. Something that turns between these may lie outside.
    pub fn bounds_nearby(&self, part: Part, args: &[Interval]) -> Interval {
        let by: Vec<usize> = (0..args.len()).filter(|i| args[*i].0 != args[*i].1).collect();
        if by.is_empty() || by.iter().any(|i| !(args[*i].1 - args[*i].0).is_finite()) {
            return self.bounds(part, args);
        }
        let at = |share: f64| -> Vec<f64> {
            args.iter().map(|(low, high)| if low == high { *low } else { low + share * (high - low) }).collect()
        };
        let (mut radius, mut slopes) = (0.0_f64, Vec::new());
        for share in [0.0, 0.5, 1.0] {
            self.slopes(part, &at(share), &by, &mut slopes);
            if slopes.iter().any(|slope| slope.is_nan()) {
                return ALL;
            }
            let reach = |(i, slope): (&usize, &f64)| slope.abs() * (args[*i].1 - args[*i].0);
            radius = radius.max(0.5 * MARGIN * by.iter().zip(&slopes).map(reach).sum::<f64>());
        }
        let middle = self.value(part, &at(0.5));
        let reach = radius + 4.0 * f64::EPSILON * middle.abs();
        if reach.is_finite() && middle.is_finite() { (middle - reach, middle + reach) } else { ALL }
    }
}
