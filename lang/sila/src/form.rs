//! What a feature takes and tells, in a form by which two definitions of one feature are compared: what people read, and the names
//! of units and types, are left out.

use std::fmt::Write;

use crate::feature::{BASES, Constraints, DataType, Element, Feature, SiUnit};

/// Types nested deeper than this are not told apart.
const DEEPEST: usize = 32;

/// Each parameter, answer and property of a feature with its type, in words: `SetTarget(T)` and `Real in Kelvin + 273.15`.
pub fn form(feature: &Feature) -> Vec<(String, String)> {
    let typed = |ty: &DataType| of_type(feature, ty, 0);
    let mut all = Vec::new();
    for command in &feature.commands {
        let id = &command.identifier;
        let how = if command.observable { "observable" } else { "not observable" };
        all.push((id.clone(), how.to_owned()));
        all.extend(command.parameters.iter().map(|p| (format!("{id}({})", p.identifier), typed(&p.ty))));
        let answers = command.responses.iter().chain(&command.intermediate);
        all.extend(answers.map(|a| (format!("{id}.{}", a.identifier), typed(&a.ty))));
    }
    all.extend(feature.properties.iter().map(|p| (p.identifier.clone(), typed(&p.ty))));
    all
}

fn of_type(feature: &Feature, ty: &DataType, depth: usize) -> String {
    if depth > DEEPEST {
        return "...".to_owned();
    }
    let inner = |ty: &DataType| of_type(feature, ty, depth + 1);
    match ty {
        DataType::Basic(basic) => basic.name().to_owned(),
        DataType::List(of) => format!("List of {}", inner(of)),
        DataType::Structure(parts) => {
            let part = |e: &Element| format!("{}: {}", e.identifier, inner(&e.ty));
            format!("{{{}}}", parts.iter().map(part).collect::<Vec<_>>().join(", "))
        }
        DataType::Constrained(of, constraints) => format!("{}{}", inner(of), constrained(constraints)),
        DataType::Identifier(name) => feature.resolved(ty).map_or_else(|| name.clone(), inner),
    }
}

fn constrained(constraints: &Constraints) -> String {
    let Constraints { unit, set, least, greatest, length, pattern, count } = constraints;
    let mut out = unit.as_ref().map(of_unit).unwrap_or_default();
    if !set.is_empty() {
        let _ = write!(out, " among {}", set.join(", "));
    }
    let mut bound = |bound: &Option<(f64, bool)>, words: [&str; 2]| {
        if let Some((number, is_open)) = bound {
            let _ = write!(out, " {} {number}", words[usize::from(*is_open)]);
        }
    };
    bound(least, ["from", "above"]);
    bound(greatest, ["to", "below"]);
    for ((least, most), what) in [(length, "long"), (count, "elements")] {
        let end = |n: &Option<u64>| n.map_or_else(String::new, |n| n.to_string());
        if least.is_some() || most.is_some() {
            let _ = write!(out, " {}..{} {what}", end(least), end(most));
        }
    }
    if let Some(pattern) = pattern {
        let _ = write!(out, " like {pattern}");
    }
    out
}

/// ` in Kelvin`, ` in 0.001 Kilogram`, ` in Kelvin + 273.15`.
fn of_unit(unit: &SiUnit) -> String {
    let power = |(base, exponent): &(usize, i32)| match (BASES.get(*base).copied().unwrap_or_default(), exponent) {
        (name, 1) => name.to_owned(),
        (name, n) => format!("{name}^{n}"),
    };
    let mut components = unit.components.clone();
    components.sort_unstable();
    let bases = components.iter().map(power).collect::<Vec<_>>().join(" ");
    let factor = if unit.factor == 1.0 { String::new() } else { format!("{} ", unit.factor) };
    let offset = if unit.offset == 0.0 { String::new() } else { format!(" + {}", unit.offset) };
    format!(" in {factor}{bases}{offset}")
}

/// A form in one text of letters, digits and `%=;.`.
pub fn packed(form: &[(String, String)]) -> String {
    form.iter().map(|(name, ty)| format!("{}={};", escaped(name), escaped(ty))).collect()
}

/// The form in a text as [`packed`] writes it; none where it is no such text.
pub fn unpacked(text: &str) -> Option<Vec<(String, String)>> {
    let entry = |entry: &str| {
        let (name, ty) = entry.split_once('=')?;
        Some((plain(name)?, plain(ty)?))
    };
    text.split_terminator(';').map(entry).collect()
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for byte in text.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'.' => out.push(char::from(byte)),
            // Writing to a text cannot fail.
            other => _ = write!(out, "%{other:02x}"),
        }
    }
    out
}

fn plain(text: &str) -> Option<String> {
    let mut parts = text.split('%');
    let mut bytes = parts.next()?.as_bytes().to_vec();
    for part in parts {
        let (digits, rest) = part.split_at_checked(2)?;
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        bytes.extend(rest.as_bytes());
    }
    String::from_utf8(bytes).ok()
}

/// How what a server offers differs from what a definition promised, in words: the first difference.
pub fn difference(promised: &[(String, String)], offered: &[(String, String)]) -> Option<String> {
    promised.iter().find_map(|(name, ty)| match offered.iter().find(|(other, _)| other == name) {
        Some((_, other)) if other == ty => None,
        Some((_, other)) => Some(format!("`{name}` is `{other}` on the server, but `{ty}` in the imported definition")),
        None => Some(format!("the server has no `{name}`, but the imported definition does")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_is_the_same_after_it_was_packed() {
        let form = vec![("Set(T)".to_owned(), "Real in Kelvin + 273.15 among ä;=%\"".to_owned())];
        let text = packed(&form);
        assert!(text.bytes().all(|b| b.is_ascii_alphanumeric() || b"%=;.".contains(&b)), "{text}");
        assert_eq!(unpacked(&text), Some(form));
        assert_eq!(unpacked("a=%4;"), None);
        assert_eq!(unpacked(""), Some(Vec::new()));
    }

    #[test]
    fn another_unit_is_a_difference() {
        let of = |ty: &str| vec![("Set(T)".to_owned(), ty.to_owned())];
        assert_eq!(difference(&of("Real"), &of("Real")), None);
        let told = difference(&of("Real in Kelvin + 273.15"), &of("Real in Kelvin")).expect("it differs");
        assert!(told.starts_with("`Set(T)` is `Real in Kelvin` on the server"), "{told}");
        assert!(difference(&of("Real"), &[]).is_some());
    }
}
