//! Field lists: keys that are not known are reported with the nearest known ones.

use matterix_ir::{Diagnostic, codes};

use crate::ast::Field;
use crate::names::near;

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
