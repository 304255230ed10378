//! What is shown beside the pointer.

use lsp_types::{Hover, HoverContents, HoverParams, MarkupContent, MarkupKind};

use super::Seen;
use crate::lsp::server::Server;
use crate::report::points;

/// What is known after the statement under a position, in each workflow it belongs to.
pub fn hover(server: &mut Server, params: HoverParams) -> Option<Hover> {
    let place = params.text_document_position_params;
    let seen = Seen::of(server, &place.text_document.uri)?;
    let offset = seen.offset(place.position);
    let known = matterix_editor::statement(&seen.analysis, seen.file, offset);
    let (points, index) = known.first()?;
    let span = points.points.get(*index)?.span;
    let said: Vec<String> =
        known.iter().map(|(points, index)| points::brief(points, *index, &seen.analysis.sources)).collect();
    let markdown = server.client.shows_markdown;
    let value = match markdown {
        true => format!("```text\n{}\n```", said.join("\n").trim_end()),
        false => said.join("\n"),
    };
    let kind = if markdown { MarkupKind::Markdown } else { MarkupKind::PlainText };
    let (start, end) = (seen.drift.forward(span.start as usize), seen.drift.forward(span.end as usize));
    Some(Hover {
        contents: HoverContents::Markup(MarkupContent { kind, value }),
        range: Some(seen.document.lines.range(&seen.document.text, start, end)),
    })
}
