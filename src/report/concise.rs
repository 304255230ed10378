//! One line per finding, in the form that editors and `grep` know.

use matterix_ir::Diagnostic;

use super::text::{Texts, harmless_line};
use super::word;

/// Appends `file:line:column: error[code]: headline`.
pub(super) fn render(diagnostic: &Diagnostic, texts: &mut Texts<'_>, out: &mut String) {
    if let Some(label) = diagnostic.labels.iter().find(|l| l.primary)
        && let Some(text) = texts.get(label.span.file)
    {
        let (line, column) = text.position(label.span.start as usize);
        out.push_str(&format!("{}:{line}:{column}: ", text.name()));
    }
    let headline = harmless_line(&diagnostic.headline);
    out.push_str(&format!("{}[{}]: {headline}\n", word(diagnostic.severity), diagnostic.code.name));
}
