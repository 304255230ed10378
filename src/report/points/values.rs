//! Quantities and words as people read them.

use matterix_ir::Unit;
use matterix_ir::listing::joined;
use matterix_ir::model::OUTSIDE;
use matterix_ir::points::{Fact, Value};
use matterix_ir::quantity::show_number;

/// Digits of a bound that are shown; it is rounded outwards.
const DIGITS: i32 = 4;

/// So many single values are listed; of more the first and the last are told.
const MOST: usize = 3;

/// What is known, with its unit.
pub(super) fn value(value: &Value) -> String {
    match value {
        Value::Exact(v, unit) => with_unit(short(unit.of_si(*v)), unit),
        Value::OneOf(all, unit) => {
            let mut all: Vec<String> = all.iter().map(|v| short(unit.of_si(*v))).collect();
            all.dedup();
            match all.as_slice() {
                [first, .., last] if all.len() > MOST => with_unit(format!("{first} .. {last}"), unit),
                _ => with_unit(joined(&all, "or"), unit),
            }
        }
        Value::Between(Some(low), Some(high), unit) => {
            let (low, high) = (bound(unit.of_si(*low), false), bound(unit.of_si(*high), true));
            if low == high { with_unit(low, unit) } else { with_unit(format!("{low} .. {high}"), unit) }
        }
        Value::Between(Some(low), None, unit) => {
            with_unit(format!("at least {}", bound(unit.of_si(*low), false)), unit)
        }
        Value::Between(None, Some(high), unit) => {
            with_unit(format!("at most {}", bound(unit.of_si(*high), true)), unit)
        }
        Value::Between(None, None, _) | Value::Unknown => "not known".to_string(),
        Value::Words(words) => match words.as_slice() {
            [first, .., last] if words.len() > MOST => format!("one of {} from {first} to {last}", words.len()),
            _ => joined(words, "or"),
        },
    }
}

/// Whether anything is known of a value.
fn is_known(value: &Value) -> bool {
    !matches!(value, Value::Unknown | Value::Between(None, None, _))
}

/// A name and what is known of it.
pub(super) fn fact(fact: &Fact) -> String {
    let outside = if fact.outside && is_known(&fact.value) { OUTSIDE } else { "" };
    format!("{} {}{outside}", fact.name, value(&fact.value))
}

/// Seconds as people read them.
pub(super) fn time(known: &Value) -> String {
    let scale = |seconds: f64| match seconds.abs() {
        s if s >= 7200.0 => Unit::scaled("h", 3600.0),
        s if s >= 300.0 => Unit::scaled("min", 60.0),
        _ => Unit::scaled("s", 1.0),
    };
    match known {
        Value::Exact(v, _) => value(&Value::Exact(*v, scale(*v))),
        Value::OneOf(all, _) => value(&Value::OneOf(all.clone(), scale(all.last().copied().unwrap_or_default()))),
        Value::Between(Some(low), Some(high), _) => {
            let (from, to) = (scale(*low), scale(*high));
            let first = bound(from.of_si(*low), false);
            let first = if from == to { first } else { with_unit(first, &from) };
            with_unit(format!("{first} .. {}", bound(to.of_si(*high), true)), &to)
        }
        Value::Between(low, high, _) => value(&Value::Between(*low, *high, scale(high.or(*low).unwrap_or_default()))),
        other => value(other),
    }
}

/// A number with five significant digits.
fn short(value: f64) -> String {
    show_number(format!("{value:.4e}").parse().unwrap_or(value))
}

fn with_unit(number: String, unit: &Unit) -> String {
    if unit.symbol.is_empty() { number } else { format!("{number} {}", unit.symbol) }
}

/// A bound with few digits, never inside of what it bounds.
fn bound(value: f64, up: bool) -> String {
    if value == 0.0 || !value.is_finite() {
        return show_number(value);
    }
    let size = 10f64.powi(DIGITS - 1 - value.abs().log10().floor() as i32);
    let scaled = value * size;
    // What is whole but for rounding stays as it is.
    let near = scaled.round();
    let outwards = match (scaled - near).abs() <= 1e-6 * near.abs() {
        true => near,
        false if up => scaled.ceil(),
        false => scaled.floor(),
    };
    show_number(outwards / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_rounded_outwards() {
        assert_eq!((bound(99.987, false), bound(99.981, true)), ("99.98".to_string(), "99.99".to_string()));
        assert_eq!((bound(-0.123456, false), bound(-0.123456, true)), ("-0.1235".to_string(), "-0.1234".to_string()));
        assert_eq!(bound(25.0 + 1e-12, true), "25");
    }

    #[test]
    fn what_is_known_reads_as_people_say_it() {
        let g = Unit::scaled("g", 1e-3);
        assert_eq!(value(&Value::OneOf(vec![0.1, 0.2, 0.3], g.clone())), "100, 200 or 300 g");
        assert_eq!(value(&Value::Between(Some(0.1), None, g)), "at least 100 g");
        assert_eq!(value(&Value::Words(vec!["beaker".into(), "nothing".into()])), "beaker or nothing");
        let s = Unit::scaled("s", 1.0);
        assert_eq!(time(&Value::Between(Some(60.0), Some(600.0), s)), "60 s .. 10 min");
    }
}
