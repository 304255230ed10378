//! What was measured of things of a lab, in place of what its text gives for them: fields from another file.

use std::ops::Range;
use std::sync::Arc;

use matterix_ir::{Diagnostic, Sources, Span, codes};

use crate::ast::{Field, FieldValue, ItemKind, LabLineKind, Name};
use crate::names::Module;

/// Fields for instances of the file's labs, with the text they stand in.
#[derive(Clone, Debug, Default)]
pub struct Calibration {
    /// The file, as shown in findings.
    pub name: String,
    /// Its text.
    pub text: String,
    /// What it gives.
    pub given: Vec<Gauged>,
}

/// A field of an instance.
#[derive(Clone, Debug)]
pub struct Gauged {
    /// The instance, and where it is named.
    pub thing: (String, Range<usize>),
    /// The field, and where it is named.
    pub field: (String, Range<usize>),
    /// Where the text has its value, written in the language.
    pub value: Range<usize>,
}

/// Puts the fields where a module's labs declare the instances, in place of theirs of the same names.
pub(crate) fn put(measured: &Calibration, module: &mut Arc<Module>, sources: &mut Sources) -> Vec<Diagnostic> {
    if measured.given.is_empty() {
        return Vec::new();
    }
    let file = sources.add(&measured.name, measured.text.clone());
    let span = |range: &Range<usize>| Span::new(file, range.start, range.end);
    let mut found = Vec::new();
    let tree = &mut Arc::make_mut(module).tree;
    for Gauged { thing, field, value } in &measured.given {
        let text = measured.text.get(..value.end).unwrap_or_default();
        let (expr, wrong) = crate::syntax::parse_value(file, text, value.start);
        found.extend(wrong);
        let key = Name { text: field.0.clone(), span: span(&field.1) };
        let new = Field { key, value: FieldValue::Expr(expr), span: span(&(field.1.start..value.end)) };
        let labs = tree.items.iter_mut().filter_map(|item| match &mut item.kind {
            ItemKind::Lab { lines, .. } => Some(lines),
            _ => None,
        });
        let mut is_there = false;
        for line in labs.flatten() {
            let LabLineKind::Instance { name, literal, .. } = &mut line.kind else { continue };
            if name.text == thing.0 {
                is_there = true;
                literal.fields.retain(|f| f.key.text != field.0);
                literal.fields.push(new.clone());
            }
        }
        if !is_there {
            let headline = format!("no lab of this file declares `{}` itself", thing.0);
            let d =
                Diagnostic::error(codes::BINDING, span(&thing.1), headline, "its measured values have no place here");
            found.push(d.help("give measured values only for things that the file's own lab declares"));
        }
    }
    found
}
