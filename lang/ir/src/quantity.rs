//! Units as they are shown to people. Inside a program every number is SI.

use serde::{Deserialize, Serialize};

/// A unit for display: `si = value * factor + offset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// As the user writes it: `mL`, `degC`, `mol/kg`; empty for a plain number.
    pub symbol: String,
    /// SI value of one unit.
    pub factor: f64,
    /// SI value of the unit's zero (273.15 for `degC`).
    pub offset: f64,
}

impl Unit {
    /// A plain number.
    pub fn one() -> Self {
        Unit { symbol: String::new(), factor: 1.0, offset: 0.0 }
    }

    /// A unit without offset.
    pub fn scaled(symbol: impl Into<String>, factor: f64) -> Self {
        Unit { symbol: symbol.into(), factor, offset: 0.0 }
    }

    /// This unit, or one a thousandth of it where people would take that for so little: uL for 0.15 mL.
    pub fn fit_for(&self, si: f64) -> Unit {
        const FINER: [(&str, &str); 5] = [("L", "mL"), ("mL", "uL"), ("kg", "g"), ("g", "mg"), ("mg", "ug")];
        let finer = FINER.iter().find(|(coarse, _)| *coarse == self.symbol);
        match finer {
            Some((_, fine)) if si != 0.0 && self.of_si(si).abs() < 1.0 => {
                Unit::scaled(*fine, self.factor / 1e3).fit_for(si)
            }
            _ => self.clone(),
        }
    }

    /// A value in this unit from its SI value.
    pub fn of_si(&self, si: f64) -> f64 {
        (si - self.offset) / self.factor
    }

    /// The SI value of a value in this unit.
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// The value with six significant digits at most and its symbol: `76.33 degC`.
    pub fn show(&self, si: f64) -> String {
        if let Some(endless) = show_endless(si) {
            return endless.to_owned();
        }
        let number = show_number(self.of_si(si));
        if self.symbol.is_empty() { number } else { format!("{number} {}", self.symbol) }
    }
}

/// Differences of times below this do not matter, s: what adding times up leaves.
pub const ROUNDING: f64 = 1e-6;

/// A duration given in s, in days, hours, minutes and seconds: `1 h 30 min`; days alone from a thousand on.
pub fn show_duration(seconds: f64) -> String {
    if seconds < 0.0 {
        return format!("-{}", show_duration(-seconds));
    }
    if !seconds.is_finite() || seconds < 1.0 {
        return format!("{} s", show_number(seconds));
    }
    let mut left = seconds;
    let mut parts = Vec::new();
    for (unit, size) in [("day", 86_400.0), ("h", 3600.0), ("min", 60.0)] {
        let whole = ((left + ROUNDING) / size).floor();
        if whole >= 1.0 {
            parts.push(format!("{} {unit}", show_number(whole)));
            left -= whole * size;
        }
        if whole >= 1000.0 {
            left = 0.0;
        }
    }
    if left > ROUNDING {
        parts.push(format!("{} s", show_number(left)));
    }
    parts.join(" ")
}

/// What has no end, in the word of the language: no unit goes with it.
pub fn show_endless(value: f64) -> Option<&'static str> {
    match value {
        f64::INFINITY => Some("unlimited"),
        f64::NEG_INFINITY => Some("-unlimited"),
        _ => None,
    }
}

/// Six significant digits at most, without trailing zeros; powers of ten outside 1e-4 .. 1e7.
pub fn show_number(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_end_is_shown_as_it_is_written() {
        let ml = Unit::scaled("mL", 1e-6);
        assert_eq!(ml.show(f64::INFINITY), "unlimited");
        assert_eq!(ml.show(5e-6), "5 mL");
        assert_eq!(
            Unit { symbol: "degC".to_owned(), factor: 1.0, offset: 273.15 }.show(f64::NEG_INFINITY),
            "-unlimited"
        );
    }
}
