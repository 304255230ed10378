//! Field lists: keys that are not known are reported with the nearest known ones.

use matterix_ir::{Diagnostic, codes};

use crate::ast::{ExprKind, Field, FieldValue, NamedExpr};
use crate::near;

/// Reports keys given twice.
pub fn repeated(fields: &[Field], diagnostics: &mut Vec<Diagnostic>) {
    for (i, f) in fields.iter().enumerate() {
        if let Some(first) = fields[..i].iter().find(|o| o.key.text == f.key.text) {
            diagnostics.push(
                Diagnostic::error(
                    codes::DUPLICATE_NAME,
                    f.key.span,
                    format!("`{}` is given twice", f.key.text),
                    "given again here",
                )
                .because(first.key.span, "first given here"),
            );
        }
    }
}

/// Reports fields of another form than they have: those of `nested` hold lines in braces, those of `texts` a text,
/// all others one value.
pub fn forms(fields: &[Field], nested: &[&str], texts: &[&str], diagnostics: &mut Vec<Diagnostic>) {
    for f in fields {
        let key = f.key.text.as_str();
        let (fits, form) = match &f.value {
            FieldValue::Fields(_) => (nested.contains(&key), "one value"),
            FieldValue::Expr(e) if matches!(&*e.kind, ExprKind::Error) => (true, ""),
            FieldValue::Expr(_) if nested.contains(&key) => (false, "lines in braces, `{ A: 1, B: 2 }`"),
            FieldValue::Expr(e) if texts.contains(&key) => (matches!(&*e.kind, ExprKind::Text(_)), "a text in quotes"),
            FieldValue::Expr(_) => (true, ""),
            FieldValue::Literal(_) | FieldValue::Species(_) => (false, "one value"),
        };
        if !fits {
            let headline = format!("`{key}` must be {form}");
            diagnostics.push(Diagnostic::error(codes::TYPE_MISMATCH, f.span, headline, "something else"));
        }
    }
}

/// Reports keys outside `known`, and keys given twice.
pub fn unknown_fields(fields: &[Field], known: &[&str], owner: &str, diagnostics: &mut Vec<Diagnostic>) {
    repeated(fields, diagnostics);
    for f in fields {
        if !known.contains(&f.key.text.as_str()) {
            let near = near::nearest(&f.key.text, known);
            let mut d = Diagnostic::error(
                codes::UNKNOWN_FIELD,
                f.key.span,
                format!("{owner} has no field `{}`", f.key.text),
                "not a field",
            );
            d = near::proposed(d, &near, f.key.span);
            diagnostics.push(d);
        }
    }
}

/// The value of an option that is a name.
pub fn word<'o>(options: &'o [NamedExpr], key: &str) -> Option<&'o str> {
    match &*options.iter().find(|o| o.name.text == key)?.value.kind {
        ExprKind::Name(name) => Some(&name.text),
        _ => None,
    }
}
