//! Round numbers on axes.

use super::PlotError;
use super::canvas::{Anchor, BOUNDARY, Canvas, GRID, INK, MUTED};

/// The time axis all panels share.
pub(crate) struct TimeAxis {
    end: f64,
    left: f64,
    right: f64,
    symbol: &'static str,
    factor: f64,
}

impl TimeAxis {
    /// From 0 to `end` s between two edges, px; in the unit that suits the length.
    pub(crate) fn new(end: f64, left: f64, right: f64) -> Self {
        let end = if end.is_finite() && end > 0.0 { end } else { 1.0 };
        let (symbol, factor) = match end {
            e if e <= 3600.0 => ("s", 1.0),
            e if e <= 4.0 * 3600.0 => ("min", 60.0),
            e if e <= 7.0 * 86400.0 => ("h", 3600.0),
            _ => ("d", 86400.0),
        };
        TimeAxis { end, left, right, symbol, factor }
    }

    /// Where a time, s, stands, px.
    pub(crate) fn x(&self, time: f64) -> f64 {
        self.left + (self.right - self.left) * (time / self.end).clamp(0.0, 1.0)
    }

    /// Left and right edge, px.
    pub(crate) fn edges(&self) -> (f64, f64) {
        (self.left, self.right)
    }

    /// Lines at round times and where something happened, and the axis below.
    pub(crate) fn draw(&self, canvas: &Canvas<'_>, top: f64, bottom: f64, boundaries: &[f64]) -> Result<(), PlotError> {
        let ticks = ticks(0.0, self.end / self.factor, 10);
        for &tick in &ticks.at {
            let x = self.x(tick * self.factor);
            canvas.line(&[(x, top), (x, bottom)], GRID, 1.0, false)?;
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], INK, 1.0, false)?;
            canvas.text((x, bottom + 15.0), 11.0, Anchor::Middle, INK, &ticks.label(tick))?;
        }
        for &time in boundaries {
            let x = self.x(time);
            canvas.line(&[(x, top), (x, bottom)], BOUNDARY, 0.6, false)?;
        }
        canvas.line(&[(self.left, bottom), (self.right, bottom)], INK, 1.0, false)?;
        let middle = (self.left + self.right) / 2.0;
        canvas.text((middle, bottom + 34.0), 12.0, Anchor::Middle, MUTED, &format!("time [{}]", self.symbol))
    }
}

/// Round numbers in a range.
pub(crate) struct Ticks {
    /// Ascending.
    pub(crate) at: Vec<f64>,
    decimals: usize,
}

impl Ticks {
    /// With as many decimals as tell neighbours apart.
    pub(crate) fn label(&self, tick: f64) -> String {
        // Adding 0 turns -0 into 0.
        format!("{:.*}", self.decimals, tick + 0.0)
    }
}

/// About `count` multiples of 1, 2 or 5 times a power of ten in a range; none in an empty one.
pub(crate) fn ticks(low: f64, high: f64, count: usize) -> Ticks {
    let rough = (high - low) / count.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return Ticks { at: Vec::new(), decimals: 0 };
    }
    let power = exponent(rough);
    let unit = power_of_ten(power);
    let (step, power) = match rough / unit {
        r if r <= 1.0 => (unit, power),
        r if r <= 2.0 => (2.0 * unit, power),
        r if r <= 5.0 => (5.0 * unit, power),
        _ => (10.0 * unit, power + 1),
    };
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    let at = (0..=(last - first).max(0.0) as usize).map(|i| (first + i as f64) * step).collect();
    Ticks { at, decimals: usize::try_from(-power).unwrap_or(0) }
}

/// Power of ten of the first digit.
pub(crate) fn exponent(value: f64) -> i32 {
    format!("{value:e}").rsplit('e').next().and_then(|e| e.parse().ok()).unwrap_or(0)
}

/// Correctly rounded.
pub(crate) fn power_of_ten(power: i32) -> f64 {
    format!("1e{power}").parse().unwrap_or(1.0)
}
