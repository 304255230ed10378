//! Values of the standard and numbers of the model.

use matterix_ir::offer::{Bounds, Kind};
use matterix_ir::scene::Scene;
use matterix_sila_wire::{ROUNDING, Value};

/// A value that was given, SI; a thing by its number in the scene.
pub(super) fn number(scene: &Scene, kind: &Kind, value: &Value) -> Option<f64> {
    match (kind, value) {
        (Kind::Quantity { unit, .. }, Value::Real(n)) => Some(unit.to_si(*n)).filter(|n| n.is_finite()),
        (Kind::Whole, Value::Integer(n)) => Some(*n as f64),
        (Kind::Truth, Value::Boolean(b)) => Some(f64::from(u8::from(*b))),
        (Kind::Words(words), Value::Text(text)) => words.iter().position(|w| w == text).map(|i| i as f64),
        (Kind::Things(things), Value::Text(text)) => {
            things.iter().find(|t| scene.get(**t).name == *text).map(|t| f64::from(t.0))
        }
        _ => None,
    }
}

/// The bound that a number is, where it is beyond it by the rounding of units only.
pub(super) fn on_bound(bounds: Bounds, number: f64) -> f64 {
    let ends = [(bounds.least, -1.0), (bounds.greatest, 1.0)];
    let closed = ends.into_iter().filter_map(|(bound, side)| Some((bound.filter(|b| !b.is_open)?.number, side)));
    let mut is_it = closed.filter(|(bound, side)| {
        let beyond = (number - bound) * side;
        // The conversion of a point, as of a temperature, rounds to its offset.
        beyond > 0.0 && beyond <= ROUNDING * bound.abs()
    });
    is_it.next().map_or(number, |(bound, _)| bound)
}

/// A number of the model as a value.
pub(super) fn value(scene: &Scene, kind: &Kind, number: f64) -> Option<Value> {
    if !number.is_finite() {
        return None;
    }
    match kind {
        Kind::Quantity { unit, .. } => Some(Value::Real(unit.of_si(number))),
        Kind::Whole => Some(Value::Integer(number.round() as i64)),
        Kind::Truth => Some(Value::Boolean(number != 0.0)),
        Kind::Words(words) => words.get(number as usize).cloned().map(Value::Text),
        Kind::Things(_) => {
            let found = scene.instances.get(number as usize).filter(|_| number >= 0.0);
            Some(Value::Text(found.map_or("nothing".to_owned(), |i| i.name.clone())))
        }
    }
}
