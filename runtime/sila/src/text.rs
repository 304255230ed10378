//! What goes over the wire as people and drivers write it: `SetTargetTemperature(Target: 60)`, `FinalTemperature: 59.8`.

use std::fmt::Write;
use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use matterix_sila::feature::{Basic, DataType, Feature};
use sha2::{Digest, Sha256};

use crate::binary::LONGEST;
use crate::moment::{self, Which};
use crate::value::{Value, fits};

/// A command or a question, taken apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// `CancelController`, `CancelAll`.
    pub path: Vec<String>,
    /// By the names of parameters, as written.
    pub arguments: Vec<(String, String)>,
}

/// A text taken apart; why it cannot be.
pub fn call(text: &str) -> Result<Call, String> {
    let text = text.trim();
    let (head, inner) = match text.split_once('(') {
        Some((head, rest)) => {
            let inner = rest.trim_end().strip_suffix(')').ok_or_else(|| format!("`{text}` has no `)` at its end"))?;
            (head.trim(), inner)
        }
        None => (text, ""),
    };
    let path: Vec<String> = head.split('.').map(|p| p.trim().to_owned()).collect();
    let is_identifier = |p: &String| !p.is_empty() && p.chars().all(|c| c.is_ascii_alphanumeric());
    if path.len() > 2 || !path.iter().all(is_identifier) {
        return Err(format!("`{head}` is not a command or property: write `Command(Parameter: value)`"));
    }
    let named = |part: &str| {
        let (name, value) =
            part.split_once(':').ok_or_else(|| format!("`{}` has no name: write `Parameter: value`", part.trim()))?;
        Ok::<_, String>((name.trim().to_owned(), value.trim().to_owned()))
    };
    let arguments = parts(inner)?.into_iter().map(named).collect::<Result<_, _>>()?;
    Ok(Call { path, arguments })
}

/// What stands between commas that are in no brackets and no quotes.
fn parts(text: &str) -> Result<Vec<&str>, String> {
    let (mut out, mut depth, mut quoted, mut from, mut escaped) = (Vec::new(), 0usize, false, 0, false);
    for (at, c) in text.char_indices() {
        match c {
            _ if std::mem::take(&mut escaped) => {}
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '{' => depth += 1,
            ']' | '}' => {
                depth = depth
                    .checked_sub(1)
                    .ok_or_else(|| format!("`{text}` has a closing bracket without an opening one"))?
            }
            ',' if depth == 0 => {
                out.push(&text[from..at]);
                from = at + 1;
            }
            _ => {}
        }
    }
    if quoted || depth > 0 {
        return Err(format!("`{text}` is not closed"));
    }
    if !text[from..].trim().is_empty() || !out.is_empty() {
        out.push(&text[from..]);
    }
    Ok(out)
}

/// A value of a type as it is written.
pub fn value(feature: &Feature, ty: &DataType, text: &str) -> Result<Value, String> {
    within(feature, ty, text.trim(), 0)
}

fn within(feature: &Feature, ty: &DataType, text: &str, depth: usize) -> Result<Value, String> {
    if depth > 32 {
        return Err("it is nested too deeply".to_owned());
    }
    Ok(match ty {
        DataType::Constrained(inner, constraints) => {
            let value = within(feature, inner, text, depth + 1)?;
            fits(&value, constraints)?;
            value
        }
        DataType::Identifier(name) => {
            let of = feature.resolved(ty).ok_or_else(|| format!("unknown type `{name}`"))?;
            within(feature, of, text, depth + 1)?
        }
        DataType::Basic(Basic::String) => Value::Text(unquoted(text)?),
        DataType::Basic(Basic::Real) => {
            let number = text.parse::<f64>().ok().filter(|n| n.is_finite());
            Value::Real(number.ok_or_else(|| format!("`{text}` is not a number"))?)
        }
        DataType::Basic(Basic::Integer) => {
            let whole = text.parse::<i64>().ok().or_else(|| {
                let number = text.parse::<f64>().ok()?;
                (number.fract() == 0.0 && number.abs() < 9e15).then_some(number as i64)
            });
            Value::Integer(whole.ok_or_else(|| format!("`{text}` is not a whole number"))?)
        }
        DataType::Basic(Basic::Boolean) => match text {
            "true" | "1" => Value::Boolean(true),
            "false" | "0" => Value::Boolean(false),
            _ => return Err(format!("`{text}` is neither `true` nor `false`")),
        },
        DataType::Basic(Basic::Binary) => Value::Bytes(bytes(text)?),
        DataType::Basic(Basic::Date) => Value::Moment(moment::written(Which::Date, &unquoted(text)?)?),
        DataType::Basic(Basic::Time) => Value::Moment(moment::written(Which::Time, &unquoted(text)?)?),
        DataType::Basic(Basic::Timestamp) => Value::Moment(moment::written(Which::Stamp, &unquoted(text)?)?),
        DataType::Basic(Basic::Any) => return Err("a value of type Any cannot be written here".to_owned()),
        DataType::List(of) => {
            let inner = text.strip_prefix('[').and_then(|t| t.strip_suffix(']'));
            let inner = inner.ok_or_else(|| format!("`{text}` is not a list: write `[1, 2]`"))?;
            let values = parts(inner)?.into_iter().map(|p| within(feature, of, p.trim(), depth + 1));
            Value::List(values.collect::<Result<_, _>>()?)
        }
        DataType::Structure(elements) => {
            let inner = text.strip_prefix('{').and_then(|t| t.strip_suffix('}'));
            let inner = inner.ok_or_else(|| format!("`{text}` is not a structure: write `{{Part: value}}`"))?;
            let named = |p: &'_ str| {
                let (name, value) = p.split_once(':')?;
                Some((name.trim().to_owned(), value.trim().to_owned()))
            };
            let mut given: Vec<(String, String)> = Vec::new();
            for part in parts(inner)? {
                let (name, value) =
                    named(part).ok_or_else(|| format!("`{}` has no name: write `Part: value`", part.trim()))?;
                if !elements.iter().any(|e| e.identifier == name) {
                    let known: Vec<String> = elements.iter().map(|e| format!("`{}`", e.identifier)).collect();
                    return Err(format!("unknown part `{name}`; use {}", known.join(", ")));
                }
                if given.iter().any(|(other, _)| *other == name) {
                    return Err(format!("`{name}` is given twice"));
                }
                given.push((name, value));
            }
            let part = |element: &matterix_sila::feature::Element| {
                let found = given.iter().find(|(name, _)| *name == element.identifier);
                let (_, text) = found.ok_or_else(|| format!("`{}` is missing", element.identifier))?;
                Ok::<_, String>((element.identifier.clone(), within(feature, &element.ty, text, depth + 1)?))
            };
            Value::Structure(elements.iter().map(part).collect::<Result<_, _>>()?)
        }
    })
}

/// Bytes in Base64, or those of a file: `file "methods/warm.bin"`.
fn bytes(text: &str) -> Result<Vec<u8>, String> {
    let Some(path) = text.strip_prefix("file ") else {
        return STANDARD.decode(unquoted(text)?).map_err(|e| format!("`{text}` is not Base64: {e}"));
    };
    let path = unquoted(path.trim())?;
    let failed = |e: std::io::Error| format!("`{path}` cannot be read: {e}");
    let mut file = std::fs::File::open(&path).map_err(failed)?.take(LONGEST + 1);
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    match bytes.len() as u64 {
        size if size > LONGEST => Err(format!("`{path}` is longer than {} MiB", LONGEST >> 20)),
        _ => Ok(bytes),
    }
}

/// A text without its quotes, in which `\"` is a quote and `\\` a backslash; one without quotes is as it stands.
fn unquoted(text: &str) -> Result<String, String> {
    let Some(rest) = text.strip_prefix('"') else { return Ok(text.to_owned()) };
    let mut out = String::new();
    let mut chars = rest.chars();
    loop {
        match chars.next() {
            Some('"') if chars.as_str().is_empty() => return Ok(out),
            Some('"') => return Err(format!("`{text}` has text after its closing quote")),
            Some('\\') => match chars.next() {
                Some(c @ ('"' | '\\')) => out.push(c),
                _ => return Err(format!("in `{text}` a `\\` must come before `\"` or `\\`")),
            },
            Some(c) => out.push(c),
            None => return Err(format!("`{text}` is not closed")),
        }
    }
}

/// A value as text: numbers as they are, truth as 1 and 0, bytes by their number and SHA-256.
pub fn shown(value: &Value) -> String {
    let list = |values: &[Value]| values.iter().map(shown).collect::<Vec<_>>().join(", ");
    match value {
        Value::Text(text) => text.clone(),
        Value::Integer(n) => n.to_string(),
        Value::Real(n) => n.to_string(),
        Value::Boolean(b) => u8::from(*b).to_string(),
        Value::List(values) => format!("[{}]", list(values)),
        Value::Structure(parts) => format!("{{{}}}", named(parts)),
        // Whole, they would fill journals; by these two they are known again.
        Value::Bytes(bytes) => format!("({} bytes, SHA-256 {})", bytes.len(), hexadecimal(&Sha256::digest(bytes))),
        Value::Kept(uuid) => format!("(bytes {uuid})"),
        Value::Moment(moment) => moment.to_string(),
        Value::Other(basic) => format!("({})", basic.name()),
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut out, byte| {
        // Writing to a text cannot fail.
        let _ = write!(out, "{byte:02x}");
        out
    })
}

/// Values with their names as text.
pub fn named(parts: &[(String, Value)]) -> String {
    parts.iter().map(|(name, value)| format!("{name}: {}", shown(value))).collect::<Vec<_>>().join(", ")
}
