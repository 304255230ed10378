//! Values of the standard and numbers of the model.

use matterix_ir::offer::Kind;
use matterix_ir::scene::Scene;
use matterix_sila_wire::Value;

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
