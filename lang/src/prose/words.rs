//! Words: units, names, lists and sentences.

use matterix_ir::quantity::show_number;

/// A name as a title: `warm_up` is `Warm up`.
pub(super) fn title(name: &str) -> String {
    capital(&plain(name))
}

/// A name of several words with blanks between them.
pub(super) fn plain(name: &str) -> String {
    name.replace('_', " ")
}

/// With a capital letter at its start.
pub(super) fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// A sentence: capital letter and full stop.
pub(super) fn sentence(text: &str) -> String {
    let text = capital(text.trim());
    if text.ends_with(['.', ':', '!', '?']) { text } else { format!("{text}.") }
}

/// Lines of a documentation comment as paragraphs.
pub(super) fn paragraphs(lines: &[String]) -> String {
    let mut out: Vec<String> = vec![String::new()];
    for line in lines {
        match (line.trim(), out.last_mut()) {
            ("", _) => out.push(String::new()),
            (text, Some(last)) => {
                if !last.is_empty() {
                    last.push('\n');
                }
                last.push_str(text);
            }
            _ => {}
        }
    }
    out.retain(|p| !p.is_empty());
    out.join("\n\n")
}

/// A unit in print: `degC` is °C, `uL` is µL, `mol/kg` stays.
pub(super) fn unit(text: &str) -> String {
    let part = |p: &str| match p {
        "degC" => "°C".to_string(),
        "degF" => "°F".to_string(),
        "deg" => "°".to_string(),
        // A word of two letters or more that begins with the ASCII spelling of micro.
        p if p.len() > 1 && p.starts_with('u') && p[1..].starts_with(|c: char| c.is_ascii_alphabetic()) => {
            format!("µ{}", &p[1..])
        }
        p => p.to_string(),
    };
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain(['\0']) {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        out.push_str(&part(&word));
        word.clear();
        match c {
            '\0' => {}
            '*' => out.push('·'),
            c => out.push(c),
        }
    }
    out
}

/// A quantity as it is shown elsewhere (`60 degC`), in print.
pub(super) fn quantity(text: &str) -> String {
    match text.split_once(' ') {
        Some((number, symbol)) if number.parse::<f64>().is_ok() => format!("{number} {}", unit(symbol)),
        _ => text.to_string(),
    }
}

/// Four significant digits of a number in the first of some units that is not too large for it.
pub(super) fn scaled(value: f64, units: &[(f64, &str)]) -> String {
    let rounded = |v: f64| format!("{v:.3e}").parse::<f64>().unwrap_or(v);
    let smallest = units.last().copied().unwrap_or((1.0, ""));
    let (size, symbol) = units.iter().copied().find(|(f, _)| rounded(value).abs() >= *f).unwrap_or(smallest);
    format!("{} {symbol}", show_number(rounded(value / size)))
}

/// A mass, kg.
pub(super) fn mass(kg: f64) -> String {
    scaled(kg, &[(1.0, "kg"), (1e-3, "g"), (1e-6, "mg"), (1e-9, "µg")])
}

/// A volume, m^3.
pub(super) fn volume(m3: f64) -> String {
    scaled(m3, &[(1e-3, "L"), (1e-6, "mL"), (1e-9, "µL")])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_printed_as_they_are_read() {
        for (text, wanted) in [("degC", "°C"), ("uL/s", "µL/s"), ("kg/(mol*s)", "kg/(mol·s)"), ("%w/w", "%w/w")] {
            assert_eq!(unit(text), wanted);
        }
        assert_eq!(quantity("76.33 degC"), "76.33 °C");
        assert_eq!(quantity("a b"), "a b");
    }

    #[test]
    fn sizes_are_rounded_before_their_unit_is_chosen() {
        assert_eq!(mass(0.9999999e-3), "1 g");
        assert_eq!(mass(552.83e-6), "552.8 mg");
        assert_eq!(volume(0.0), "0 µL");
    }
}
