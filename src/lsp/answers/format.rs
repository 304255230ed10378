//! A text in the one style. One with mistakes stays as it is.

use lsp_types::{DocumentFormattingParams, DocumentRangeFormattingParams, Range, TextEdit};
use matterix_ir::FileId;

use crate::lsp::documents::Document;
use crate::lsp::server::Server;

/// What is to be changed in the whole text.
pub fn whole(server: &mut Server, params: DocumentFormattingParams) -> Option<Vec<TextEdit>> {
    edits(server.documents.get(&params.text_document.uri)?)
}

/// What is to be changed in some lines.
pub fn range(server: &mut Server, params: DocumentRangeFormattingParams) -> Option<Vec<TextEdit>> {
    let mut edits = edits(server.documents.get(&params.text_document.uri)?)?;
    edits.retain(|edit| meets(edit.range, params.range));
    Some(edits)
}

fn edits(document: &Document) -> Option<Vec<TextEdit>> {
    let formatted = matterix_lang::fmt::format(FileId(0), &document.text).ok()?;
    let all = matterix_editor::replacements(&document.text, &formatted).into_iter();
    let edit = |r: matterix_editor::Replacement| TextEdit {
        range: document.lines.range(&document.text, r.range.start, r.range.end),
        new_text: r.text,
    };
    Some(all.map(edit).collect())
}

/// Whether two ranges have a place in common; one that ends at the start of a line does not have that line.
fn meets(a: Range, b: Range) -> bool {
    let last = |r: Range| if r.end.character == 0 && r.end.line > r.start.line { r.end.line - 1 } else { r.end.line };
    a.start.line <= last(b) && b.start.line <= last(a)
}
