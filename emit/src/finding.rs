//! What a target cannot say, as findings.

use matterix_ir::{Diagnostic, Span, codes};

/// Something that has no counterpart in the target.
pub fn not_expressible(span: Span, headline: impl Into<String>, label: impl Into<String>) -> Diagnostic {
    Diagnostic::error(codes::NOT_EXPRESSIBLE, span, headline, label)
}

/// A driver says something that its wire does not know.
pub fn wrong_message(span: Span, headline: impl Into<String>, label: impl Into<String>) -> Diagnostic {
    Diagnostic::error(codes::WRONG_MESSAGE, span, headline, label)
}

/// The warnings where there are no errors, in the order of the text.
pub fn settle(found: Vec<Diagnostic>) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let found = in_order(found);
    if found.iter().any(Diagnostic::is_error) { Err(found) } else { Ok(found) }
}

/// Each once, in the order of the text.
pub fn in_order(mut found: Vec<Diagnostic>) -> Vec<Diagnostic> {
    found.sort_by_key(Diagnostic::span);
    found.dedup_by(|a, b| a.code == b.code && a.span() == b.span() && a.headline == b.headline);
    found
}
