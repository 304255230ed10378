//! What is shown beside statements.

use lsp_types::{InlayHint, InlayHintLabel, InlayHintParams};
use matterix_editor::Told;

use super::Seen;
use crate::lsp::server::Server;
use crate::report::points;

/// Characters of a hint; what is more the pointer shows.
const LONGEST: usize = 60;

/// The hints in a range. While a text is being checked those of the last check stay where nothing was typed.
pub fn hints(server: &mut Server, params: InlayHintParams) -> Option<Vec<InlayHint>> {
    let seen = Seen::of(server, &params.text_document.uri)?;
    let (text, lines) = (&seen.document.text, &seen.document.lines);
    let (start, end) = lines.bytes(text, params.range);
    let mut out = Vec::new();
    for hint in matterix_editor::hints(&seen.analysis, seen.file) {
        let Some((at, _)) = seen.drift.range(hint.offset, hint.offset).filter(|(at, _)| (start..=end).contains(at))
        else {
            continue;
        };
        let said = match &hint.told {
            Told::BeginsAtOnce => "at 0 s".to_string(),
            Told::Begins(time) => format!("at {}", points::time(time)),
            Told::Holds(held) => points::amounts(held),
        };
        out.push(InlayHint {
            position: lines.position(text, at),
            label: InlayHintLabel::String(match said.char_indices().nth(LONGEST) {
                Some((cut, _)) => format!("{}…", &said[..cut]),
                None => said,
            }),
            kind: None,
            text_edits: None,
            tooltip: None,
            padding_left: Some(true),
            padding_right: None,
            data: None,
        });
    }
    Some(out)
}
