//! One JSON object per line, for editors and scripts; the shape is promised in `docs/diagnostics-json.md`.

use matterix_ir::{Diagnostic, Span};
use serde_json::{Value, json};

use super::text::{Text, Texts};
use super::word;

/// What is promised in `docs/diagnostics-json.md`; members may be added to it.
pub(super) const VERSION: u32 = 1;

/// Appends the object and a line end.
pub(super) fn render(diagnostic: &Diagnostic, texts: &mut Texts<'_>, out: &mut String) {
    out.push_str(&format!("{}\n", object(diagnostic, texts)));
}

/// The object.
pub(super) fn object(diagnostic: &Diagnostic, texts: &mut Texts<'_>) -> Value {
    let labels: Vec<Value> = diagnostic
        .labels
        .iter()
        .map(|l| json!({ "span": span(l.span, texts), "text": l.text, "primary": l.primary }))
        .collect();
    let fixes: Vec<Value> = diagnostic
        .fixes
        .iter()
        .map(|f| {
            let edits: Vec<Value> =
                f.edits.iter().map(|e| json!({ "span": span(e.span, texts), "text": e.text })).collect();
            json!({ "title": f.title, "edits": edits, "sure": f.sure, "asks": f.asks })
        })
        .collect();
    let primary = diagnostic.labels.iter().find(|l| l.primary).map(|l| span(l.span, texts));
    json!({
        "version": VERSION,
        "code": diagnostic.code.name,
        "family": diagnostic.code.family,
        "severity": word(diagnostic.severity),
        "headline": diagnostic.headline,
        "span": primary,
        "labels": labels,
        "help": diagnostic.help,
        "fixes": fixes,
    })
}

/// A span; null in no known file.
pub(super) fn span(span: Span, texts: &mut Texts<'_>) -> Value {
    let Some(text) = texts.get(span.file) else { return Value::Null };
    json!({ "file": text.name(), "start": position(span.start, text), "end": position(span.end, text) })
}

fn position(byte: u32, text: &Text) -> Value {
    let (line, column) = text.position(byte as usize);
    let (_, utf16) = text.position_utf16(byte as usize);
    json!({ "line": line, "column": column, "utf16": utf16, "byte": byte })
}
