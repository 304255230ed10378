//! Values as messages, by the types of a feature.

use matterix_sila::feature::{Basic, Constraints, DataType, Element, Feature};
use prost::Message;

use crate::binary::{Binary, Held};
use crate::framework;
use crate::moment::{self, Moment, Which};
use crate::raw::Raw;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A text.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// A truth value.
    Boolean(bool),
    /// Several.
    List(Vec<Value>),
    /// By the names of its parts.
    Structure(Vec<(String, Value)>),
    /// Bytes.
    Bytes(Vec<u8>),
    /// Bytes that the server keeps, by the identifier that it gave them.
    Kept(String),
    /// A day, a time of day, or both.
    Moment(Moment),
    /// A value of a type that is only passed on.
    Other(Basic),
}

impl Value {
    /// Whether there are bytes in it.
    pub(crate) fn holds_bytes(&self) -> bool {
        match self {
            Value::Bytes(_) => true,
            Value::List(all) => all.iter().any(Value::holds_bytes),
            Value::Structure(parts) => parts.iter().any(|(_, value)| value.holds_bytes()),
            _ => false,
        }
    }
}

/// The fields of a message: one for each of these, from 1.
pub fn encode(feature: &Feature, elements: &[Element], values: &[Value]) -> Result<Raw, String> {
    let mut raw = Raw::default();
    for ((element, value), number) in elements.iter().zip(values).zip(1..) {
        put(feature, &element.ty, value, number, &mut raw).map_err(|why| format!("`{}`: {why}", element.identifier))?;
    }
    Ok(raw)
}

fn put(feature: &Feature, ty: &DataType, value: &Value, number: u32, raw: &mut Raw) -> Result<(), String> {
    match (ty.plain(), value) {
        (DataType::List(of), Value::List(values)) => values.iter().try_for_each(|v| put(feature, of, v, number, raw)),
        (of, value) => {
            raw.fields.push((number, message(feature, of, value)?));
            Ok(())
        }
    }
}

fn message(feature: &Feature, ty: &DataType, value: &Value) -> Result<Vec<u8>, String> {
    Ok(match (ty, value) {
        (DataType::Basic(Basic::String), Value::Text(text)) => framework::Text { value: text.clone() }.encode_to_vec(),
        (DataType::Basic(Basic::Integer), Value::Integer(n)) => framework::Integer { value: *n }.encode_to_vec(),
        (DataType::Basic(Basic::Real), Value::Real(n)) => framework::Real { value: *n }.encode_to_vec(),
        (DataType::Basic(Basic::Boolean), Value::Boolean(b)) => framework::Boolean { value: *b }.encode_to_vec(),
        (DataType::Basic(Basic::Binary), Value::Bytes(bytes)) => {
            Binary { held: Some(Held::Here(bytes.clone())) }.encode_to_vec()
        }
        (DataType::Basic(Basic::Binary), Value::Kept(uuid)) => {
            Binary { held: Some(Held::Kept(uuid.clone())) }.encode_to_vec()
        }
        (DataType::Basic(Basic::Date), Value::Moment(moment @ Moment::Date(..)))
        | (DataType::Basic(Basic::Time), Value::Moment(moment @ Moment::Time(..)))
        | (DataType::Basic(Basic::Timestamp), Value::Moment(moment @ Moment::Stamp(_))) => moment::encoded(moment),
        (DataType::Structure(parts), Value::Structure(given)) => {
            let mut raw = Raw::default();
            for (part, number) in parts.iter().zip(1..) {
                let found = given.iter().find(|(name, _)| *name == part.identifier);
                let (_, value) = found.ok_or_else(|| format!("it has no `{}`", part.identifier))?;
                put(feature, &part.ty, value, number, &mut raw)?;
            }
            raw.encode_to_vec()
        }
        (DataType::Identifier(name), value) => {
            let of = feature.resolved(ty).ok_or_else(|| format!("unknown type `{name}`"))?;
            let mut raw = Raw::default();
            put(feature, of, value, 1, &mut raw)?;
            raw.encode_to_vec()
        }
        (DataType::Constrained(inner, _), value) => return message(feature, inner, value),
        (DataType::Basic(basic), _) => return Err(format!("it is not of the type {}", basic.name())),
        (DataType::Structure(_), _) => return Err("it is not a structure".to_owned()),
        (DataType::List(_), _) => return Err("it is not a list".to_owned()),
    })
}

/// The values of a message, one for each of these.
pub fn decode(feature: &Feature, elements: &[Element], raw: &Raw) -> Result<Vec<Value>, String> {
    let value = |(element, number): (&Element, u32)| {
        take(feature, &element.ty, number, raw).map_err(|why| format!("`{}`: {why}", element.identifier))
    };
    elements.iter().zip(1..).map(value).collect()
}

fn take(feature: &Feature, ty: &DataType, number: u32, raw: &Raw) -> Result<Value, String> {
    let mut all = raw.all(number);
    if let DataType::List(of) = ty.plain() {
        let list = all.map(|bytes| understood(feature, of, bytes)).collect::<Result<_, _>>().map(Value::List)?;
        let mut outer = ty;
        while let DataType::Constrained(inner, constraints) = outer {
            fits(&list, constraints)?;
            outer = inner;
        }
        return Ok(list);
    }
    match (all.next(), all.next()) {
        (Some(bytes), None) => understood(feature, ty, bytes),
        (None, _) => Err("it is missing".to_owned()),
        (_, Some(_)) => Err("it is given twice".to_owned()),
    }
}

fn understood(feature: &Feature, ty: &DataType, bytes: &[u8]) -> Result<Value, String> {
    fn read<M: Message + Default>(bytes: &[u8]) -> Result<M, String> {
        M::decode(bytes).map_err(|e| e.to_string())
    }
    Ok(match ty {
        DataType::Basic(Basic::String) => Value::Text(read::<framework::Text>(bytes)?.value),
        DataType::Basic(Basic::Integer) => Value::Integer(read::<framework::Integer>(bytes)?.value),
        DataType::Basic(Basic::Real) => Value::Real(read::<framework::Real>(bytes)?.value),
        DataType::Basic(Basic::Boolean) => Value::Boolean(read::<framework::Boolean>(bytes)?.value),
        DataType::Basic(Basic::Binary) => match read::<Binary>(bytes)?.held {
            Some(Held::Here(bytes)) => Value::Bytes(bytes),
            Some(Held::Kept(uuid)) => Value::Kept(uuid),
            None => return Err("it contains no bytes".to_owned()),
        },
        DataType::Basic(Basic::Date) => Value::Moment(moment::decoded(Which::Date, bytes)?),
        DataType::Basic(Basic::Time) => Value::Moment(moment::decoded(Which::Time, bytes)?),
        DataType::Basic(Basic::Timestamp) => Value::Moment(moment::decoded(Which::Stamp, bytes)?),
        DataType::Basic(Basic::Any) => Value::Other(Basic::Any),
        DataType::Structure(parts) => {
            let raw = read::<Raw>(bytes)?;
            let part = |(part, number): (&Element, u32)| {
                let value =
                    take(feature, &part.ty, number, &raw).map_err(|why| format!("`{}`: {why}", part.identifier));
                Ok::<_, String>((part.identifier.clone(), value?))
            };
            Value::Structure(parts.iter().zip(1..).map(part).collect::<Result<_, _>>()?)
        }
        DataType::Identifier(name) => {
            let of = feature.resolved(ty).ok_or_else(|| format!("unknown type `{name}`"))?;
            take(feature, of, 1, &read::<Raw>(bytes)?)?
        }
        DataType::Constrained(inner, constraints) => {
            let value = understood(feature, inner, bytes)?;
            fits(&value, constraints)?;
            value
        }
        DataType::List(_) => return Err("a list cannot contain lists".to_owned()),
    })
}

/// A number beyond a bound by no more than this share of it is the bound: units are converted on the way to either.
pub const ROUNDING: f64 = 1e-12;

/// Whether a value is one of those that are allowed; why it is not.
pub fn fits(value: &Value, constraints: &Constraints) -> Result<(), String> {
    let number = match value {
        Value::Real(n) => Some(*n),
        Value::Integer(n) => Some(*n as f64),
        _ => None,
    };
    let shown = crate::text::shown(value);
    if let Some(number) = number {
        let rounding = |bound: f64| ROUNDING * bound.abs();
        if let Some((least, out)) = constraints.least
            && (number < least - rounding(least) || out && number <= least)
        {
            return Err(format!("{shown} is below {least}"));
        }
        if let Some((greatest, out)) = constraints.greatest
            && (number > greatest + rounding(greatest) || out && number >= greatest)
        {
            return Err(format!("{shown} is above {greatest}"));
        }
    }
    let is_it = |allowed: &String| match value {
        Value::Text(text) => text == allowed,
        _ => number.is_none() || allowed.parse::<f64>().ok() == number,
    };
    if !constraints.set.is_empty() && !constraints.set.iter().any(is_it) {
        return Err(format!("`{shown}` is not one of {}", constraints.set.join(", ")));
    }
    if number.is_some_and(|n| !n.is_finite()) {
        return Err(format!("{shown} is not a finite number"));
    }
    match value {
        Value::Text(text) => {
            within(text.chars().count(), constraints.length, "characters")?;
            constraints.pattern.as_ref().map_or(Ok(()), |pattern| matches(text, pattern))
        }
        Value::List(values) => within(values.len(), constraints.count, "elements"),
        Value::Bytes(bytes) => within(bytes.len(), constraints.length, "bytes"),
        _ => Ok(()),
    }
}

/// Whether there are neither too few nor too many; why not.
fn within(size: usize, (least, most): (Option<u64>, Option<u64>), of: &str) -> Result<(), String> {
    match size as u64 {
        n if least.is_some_and(|least| n < least) => Err(format!("it has {n} {of}, fewer than {}", least.unwrap_or(0))),
        n if most.is_some_and(|most| n > most) => Err(format!("it has {n} {of}, more than {}", most.unwrap_or(0))),
        _ => Ok(()),
    }
}

/// Whether a pattern matches the whole of a text; why not.
fn matches(text: &str, pattern: &str) -> Result<(), String> {
    let whole = regex_lite::Regex::new(&format!("^(?:{pattern})$"));
    let whole = whole.map_err(|_| format!("its pattern `{pattern}` is not supported, so it cannot be checked"))?;
    if whole.is_match(text) { Ok(()) } else { Err(format!("`{text}` does not match `{pattern}`")) }
}
