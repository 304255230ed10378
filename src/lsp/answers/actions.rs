//! Corrections that can be applied.

use std::collections::HashMap;

use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionResponse, TextEdit, Uri, WorkspaceEdit,
};
use matterix_editor::{all_fixes, fixes_at};
use matterix_ir::{Diagnostic, Edit};

use crate::lsp::findings;
use crate::lsp::publish::Places;
use crate::lsp::server::Server;

/// What the findings in a range offer, and all that a text offers at once. Of a text that is being checked nothing is known yet.
pub fn actions(server: &mut Server, params: CodeActionParams) -> Option<CodeActionResponse> {
    let document = server.documents.get(&params.text_document.uri)?;
    let analysis = document.current().filter(|_| server.client.takes_actions)?.clone();
    let places = Places::new(&analysis, &server.documents, &server.shelf, server.client.encoding);
    let wanted = |kind: &CodeActionKind| {
        let only = params.context.only.as_ref();
        only.is_none_or(|only| {
            only.iter().any(|o| kind.as_str() == o.as_str() || kind.as_str().starts_with(&format!("{}.", o.as_str())))
        })
    };
    let (start, end) = document.lines.bytes(&document.text, params.range);
    let mut out = Vec::new();
    if wanted(&CodeActionKind::QUICKFIX) {
        let offered = fixes_at(&analysis, analysis.root, start, end);
        for (finding, fix) in &offered {
            let Some(edit) = edit(&places, fix.edits.iter()) else { continue };
            // What an editor does at one key is what nobody doubts.
            let alone = finding.fixes.len() == 1 && fix.sure;
            out.push(action(fix.title.clone(), CodeActionKind::QUICKFIX, edit, Some((finding, &places)), alone));
        }
    }
    if wanted(&CodeActionKind::SOURCE_FIX_ALL) {
        let all = all_fixes(&analysis, analysis.root);
        if let Some(edit) = edit(&places, all.iter().copied()).filter(|_| !all.is_empty()) {
            out.push(action("apply all safe fixes".to_string(), CodeActionKind::SOURCE_FIX_ALL, edit, None, false));
        }
    }
    Some(out)
}

fn action(
    title: String,
    kind: CodeActionKind,
    edit: WorkspaceEdit,
    of: Option<(&Diagnostic, &Places<'_>)>,
    preferred: bool,
) -> CodeActionOrCommand {
    let finding = of.map(|(finding, places)| {
        vec![findings::diagnostic(finding, &|span| places.of(span), &|code| places.shelf.page(code))]
    });
    CodeActionOrCommand::CodeAction(CodeAction {
        title,
        kind: Some(kind),
        diagnostics: finding,
        edit: Some(edit),
        is_preferred: preferred.then_some(true),
        ..CodeAction::default()
    })
}

/// Edits as one change of texts; none where one of them stands nowhere.
#[expect(clippy::mutable_key_type, reason = "the protocol's type has addresses as keys, which do not change")]
fn edit<'e>(places: &Places<'_>, edits: impl Iterator<Item = &'e Edit>) -> Option<WorkspaceEdit> {
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for edit in edits {
        let (uri, range) = places.of(edit.span)?;
        changes.entry(uri).or_default().push(TextEdit { range, new_text: edit.text.clone() });
    }
    Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() })
}
