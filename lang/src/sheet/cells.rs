//! What a cell says, as an expression that stands in the table's file: it is evaluated and judged like any other text.

use matterix_ir::Span;

use crate::syntax::relocate::{Relocate, shifted};

use crate::ast::{Column, Expr, ExprKind, Name, UnitText};

/// Why a cell cannot be read, and how to mend it.
pub(super) type Wrong = (String, String);

/// A cell of a column, whose bare numbers are in `unit`.
pub(super) fn expression(text: &str, column: &Column, unit: Option<&str>, span: Span) -> Result<Expr, Wrong> {
    let whole = |kind| Ok(Expr { kind: Box::new(kind), span });
    if !column.ty.words.is_empty() {
        return whole(ExprKind::Name(Name { text: text.to_owned(), span }));
    }
    let ty = column.ty.paths.first().and_then(|path| path.segments.last()).map_or("", |name| name.text.as_str());
    match ty {
        "Text" => return whole(ExprKind::Text(text.to_owned())),
        "Place" => return whole(ExprKind::Text(place(text))),
        "Bool" => return truth(text, span),
        "Species" => return whole(ExprKind::Name(Name { text: text.to_owned(), span })),
        _ => {}
    }
    if text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | ',')) {
        return number(text, unit, span);
    }
    let expected =
        format!("`{}` expects {}", column.name.text, if unit.is_some() { "a number" } else { "a number, or a name" });
    thing(text, span).filter(|_| unit.is_none()).ok_or_else(|| not_a_number(text, &expected))
}

/// `A01` is `A1`, as many programs write it.
fn place(text: &str) -> String {
    let letters = text.len() - text.trim_start_matches(|c: char| c.is_ascii_alphabetic()).len();
    let (row, column) = text.split_at(letters);
    let digits = !column.is_empty() && column.bytes().all(|b| b.is_ascii_digit());
    if digits { format!("{row}{}", column.trim_start_matches('0')) } else { text.to_owned() }
}

fn truth(text: &str, span: Span) -> Result<Expr, Wrong> {
    let word = text.to_ascii_lowercase();
    if !["true", "false"].contains(&word.as_str()) {
        return Err((format!("`{text}` is no truth value"), "write `true` or `false`".to_owned()));
    }
    Ok(Expr { kind: Box::new(ExprKind::Name(Name { text: word, span })), span })
}

fn not_a_number(text: &str, expected: &str) -> Wrong {
    let lower = text.to_ascii_lowercase();
    if ["nan", "inf", "infinity", "n/a", "na", "#n/a", "-inf", "null", "none", "-"].contains(&lower.as_str())
        || text.starts_with('#')
    {
        let help =
            "give every row a number; a column whose cells may be empty has a default: `volume: Volume as uL = 0 uL`";
        return (format!("`{text}` is not a number"), help.to_owned());
    }
    (
        format!("`{text}` is not a number: {expected}"),
        "use a decimal point and no thousands separator: `12.5`".to_owned(),
    )
}

/// `20`, `20 uL`, `-1.5e3`.
fn number(text: &str, unit: Option<&str>, span: Span) -> Result<Expr, Wrong> {
    let end = number_end(text);
    let (digits, rest) = (&text[..end], text[end..].trim());
    if rest.starts_with([',', '\'', '\u{2019}']) || digits.is_empty() || digits.starts_with(',') {
        let meant = text.replace(',', ".");
        let help = match digits.is_empty() {
            true => "use a decimal point and no thousands separator: `12.5`".to_owned(),
            false => format!("use a decimal point and no thousands separator: `{meant}` if that is meant"),
        };
        return Err((format!("`{text}` is not a number: it has a comma"), help));
    }
    let value: Option<f64> = digits.trim_start_matches('+').parse().ok().filter(|v: &f64| v.is_finite());
    let Some(value) = value else {
        return Err((format!("`{text}` is not a number"), "use a decimal point: `12.5`".to_owned()));
    };
    let kind = match (rest, unit) {
        ("", None) => ExprKind::Number(value),
        ("", Some(unit)) => ExprKind::Quantity(value, UnitText { text: unit.to_owned(), span }),
        (own, Some(unit)) if own != unit => {
            let help = format!(
                "write the number in `{unit}`; a column whose cells have units of their own has none in its header and no `as`"
            );
            return Err((format!("this cell is in `{own}`, and its column in `{unit}`"), help));
        }
        (own, _) => {
            let start = span.end - own.len() as u32;
            ExprKind::Quantity(
                value,
                UnitText { text: own.to_owned(), span: Span { start: start.max(span.start), ..span } },
            )
        }
    };
    Ok(Expr { kind: Box::new(kind), span })
}

/// Where the number at the beginning of a text ends.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let run = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut at = usize::from(matches!(bytes.first(), Some(b'-' | b'+')));
    let whole = run(at);
    at += whole;
    if bytes.get(at) == Some(&b'.') && run(at + 1) > 0 {
        at += 1 + run(at + 1);
    } else if whole == 0 {
        return 0;
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'-' | b'+')));
        let digits = run((at + 1 + sign).min(bytes.len()));
        if digits > 0 {
            at += 1 + sign + digits;
        }
    }
    at
}

/// `beaker`, `plate[A1]`, `left.plate[A1 .. H1]`: what names things, and nothing that computes.
fn thing(text: &str, span: Span) -> Option<Expr> {
    fn names(e: &Expr) -> bool {
        match &*e.kind {
            ExprKind::Name(_) | ExprKind::Scoped(_) => true,
            ExprKind::Member(base, _) | ExprKind::IndexWord(base, _) | ExprKind::IndexRange(base, ..) => names(base),
            ExprKind::Index(base, at) => names(base) && matches!(&*at.kind, ExprKind::Number(_)),
            _ => false,
        }
    }
    let (mut value, found) = crate::syntax::parse_value(span.file, text, 0);
    value.moved(&shifted(span.file, i64::from(span.start)));
    value.span = span;
    (found.is_empty() && names(&value)).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::number_end;

    #[test]
    fn a_number_ends_where_its_unit_begins() {
        for (text, number) in [
            ("20", "20"),
            ("20 uL", "20"),
            ("-1.5e-3mL", "-1.5e-3"),
            ("1e", "1"),
            ("2.", "2"),
            (".5", ".5"),
            ("-.5 mL", "-.5"),
            ("20,5", "20"),
            ("1 000", "1"),
            ("+3", "+3"),
            ("e5", ""),
            ("-", ""),
            ("5e+", "5"),
            ("1.2.3", "1.2"),
        ] {
            assert_eq!(&text[..number_end(text)], number, "{text}");
        }
    }
}
