//! What was measured of the things of a lab, as its bindings say: `calibration = { offset_x = "0.1 mm" }`.

use std::ops::Range;

use matterix_ir::{Diagnostic, FileId, Span, codes};
use toml::de::{DeTable, DeValue};

/// Its key in a binding.
pub const CALIBRATION: &str = "calibration";

/// A number that was measured of a thing, with where the bindings have what.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated {
    /// The thing.
    pub thing: (String, Range<usize>),
    /// What of it.
    pub field: (String, Range<usize>),
    /// The value, a number with its unit, without quotes.
    pub value: Range<usize>,
}

/// All that bindings say was measured, in the order of the text. What is not written as it should be is left out here and
/// reported by [`crate::binding::read`].
pub fn read(text: &str) -> Vec<Calibrated> {
    let mut out = Vec::new();
    let Ok(table) = DeTable::parse(text) else { return out };
    for (thing, value) in table.get_ref() {
        let DeValue::Table(keys) = value.get_ref() else { continue };
        let Some((_, value)) = keys.iter().find(|(k, _)| k.get_ref() == CALIBRATION) else { continue };
        let DeValue::Table(all) = value.get_ref() else { continue };
        for (field, value) in all.iter() {
            let DeValue::String(said) = value.get_ref() else { continue };
            // A text with escapes is not what stands in the file: it is shown as it stands there.
            let span = value.span();
            let raw = text.get(span.clone()).unwrap_or_default();
            let start = raw.find(said.as_ref()).map_or(span.start, |at| span.start + at);
            let value = start..(start + said.len()).min(span.end);
            let named = |k: &toml::Spanned<std::borrow::Cow<'_, str>>| (k.get_ref().to_string(), k.span());
            out.push(Calibrated { thing: named(thing), field: named(field), value });
        }
    }
    out.sort_by_key(|c| c.value.start);
    out
}

/// What is said where nobody is asked whether it is still so.
pub fn unconfirmed(file: FileId, text: &str) -> Vec<Diagnostic> {
    let wrong = |c: Calibrated| {
        let span = Span::new(file, c.field.1.start, c.value.end);
        let headline = "this command does not ask anyone to confirm the calibration";
        Diagnostic::error(codes::BINDING, span, headline, "not confirmed").help("`matterixc deploy` asks")
    };
    read(text).into_iter().map(wrong).collect()
}
