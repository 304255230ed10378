//! What is shown beside the pointer.

use lsp_types::{Hover, HoverContents, HoverParams, MarkupContent, MarkupKind, Range, TextDocumentPositionParams};

use super::Seen;
use super::places::Named;
use crate::lsp::server::Server;
use crate::report::points;

/// What is said of the name under a position, and what is known after the statement, in each workflow it belongs to.
pub fn hover(server: &mut Server, params: HoverParams) -> Option<Hover> {
    let place = params.text_document_position_params;
    let (name, range) = match Named::of(server, &place.text_document.uri) {
        Some(named) => {
            let said = named.index.about(named.file, named.offset(place.position));
            (said.as_ref().map(|s| s.text.clone()), said.map(|s| named.range(s.span)))
        }
        None => (None, None),
    };
    let statement = statement(server, &place);
    let range = range.or(statement.as_ref().map(|s| s.1));
    let parts: Vec<String> = name.into_iter().chain(statement.map(|s| s.0)).collect();
    let kind = if server.client.shows_markdown { MarkupKind::Markdown } else { MarkupKind::PlainText };
    let value = parts.join(if server.client.shows_markdown { "\n\n---\n\n" } else { "\n\n" });
    (!value.is_empty()).then_some(Hover { contents: HoverContents::Markup(MarkupContent { kind, value }), range })
}

/// What is known after the statement under a position, and where that stands.
fn statement(server: &Server, place: &TextDocumentPositionParams) -> Option<(String, Range)> {
    let seen = Seen::of(server, &place.text_document.uri)?;
    let offset = seen.offset(place.position);
    let known = matterix_editor::statement(&seen.analysis, seen.file, offset);
    let (points, index) = known.first()?;
    let span = points.points.get(*index)?.span;
    let said: Vec<String> =
        known.iter().map(|(points, index)| points::brief(points, *index, &seen.analysis.sources)).collect();
    let value = match server.client.shows_markdown {
        true => format!("```text\n{}\n```", said.join("\n").trim_end()),
        false => said.join("\n"),
    };
    let (start, end) = (seen.drift.forward(span.start as usize), seen.drift.forward(span.end as usize));
    Some((value, seen.document.lines.range(&seen.document.text, start, end)))
}
