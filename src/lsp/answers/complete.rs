//! What can be written at a place, and the form of the call there.

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionList, CompletionParams, CompletionResponse, CompletionTextEdit,
    Documentation, InsertTextFormat, MarkupContent, MarkupKind, ParameterInformation, ParameterLabel, SignatureHelp,
    SignatureHelpParams, SignatureInformation, TextEdit,
};
use matterix_editor::complete::{Completion, Offer, complete, signature};
use matterix_editor::index::Kind;
use matterix_editor::references::Key;
use serde_json::{Value, json};

use super::places::{Named, open};
use crate::lsp::server::Server;

/// What can be written at a position.
pub fn offers(server: &mut Server, params: CompletionParams) -> Option<CompletionResponse> {
    let at = params.text_document_position;
    let named = Named::of(server, &at.text_document.uri)?;
    let (text, lines) = (&*named.document.text, &named.document.lines);
    let cursor = lines.offset(text, at.position);
    let found = complete(&named.index, named.file, text, cursor);
    let range = lines.range(text, found.from, cursor);
    let fills = server.client.fills_places;
    let item = |offer: Completion| {
        let places = fills && offer.text.contains('$');
        let key = offer.def.map(|d| named.index.key(d));
        CompletionItem {
            sort_text: Some(format!("{:03} {}", offer.rank, offer.label)),
            filter_text: Some(offer.label.clone()),
            kind: Some(kind(offer.kind)),
            detail: Some(offer.detail).filter(|d| !d.is_empty()),
            insert_text_format: Some(if places { InsertTextFormat::SNIPPET } else { InsertTextFormat::PLAIN_TEXT }),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit {
                range,
                new_text: if places { offer.text } else { plain(&offer.text) },
            })),
            data: key.map(|k| json!([k.file, k.start, k.end])),
            label: offer.label,
            ..CompletionItem::default()
        }
    };
    let items = found.all.into_iter().map(item).collect();
    Some(CompletionResponse::List(CompletionList { is_incomplete: false, items }))
}

/// What more there is to say of an offer.
pub fn resolve(server: &mut Server, item: CompletionItem) -> CompletionItem {
    let text = item
        .data
        .as_ref()
        .and_then(key)
        .and_then(|key| open(server).iter().find_map(|index| Some(index.about_def(index.find(&key)?, None))));
    let kind = if server.client.shows_markdown { MarkupKind::Markdown } else { MarkupKind::PlainText };
    let documentation = text.map(|value| Documentation::MarkupContent(MarkupContent { kind, value }));
    CompletionItem { documentation, ..item }
}

/// A declaration as it was sent along with an offer.
pub fn key(data: &Value) -> Option<Key> {
    let number = |i: usize| data.get(i).and_then(Value::as_u64).and_then(|n| u32::try_from(n).ok());
    Some(Key { file: data.get(0)?.as_str()?.to_string(), start: number(1)?, end: number(2)? })
}

/// A form with its places to fill left as they are called.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        match rest.strip_prefix('{').and_then(|r| r.split_once('}')) {
            Some((inside, after)) => {
                out.push_str(inside.split_once(':').map_or("", |(_, name)| name));
                rest = after;
            }
            None => rest = rest.trim_start_matches(|c: char| c.is_ascii_digit()),
        }
    }
    out.push_str(rest);
    out
}

fn kind(offer: Offer) -> CompletionItemKind {
    match offer {
        Offer::Keyword => CompletionItemKind::KEYWORD,
        Offer::Member => CompletionItemKind::PROPERTY,
        Offer::Unit => CompletionItemKind::UNIT,
        Offer::Place => CompletionItemKind::VALUE,
        Offer::Module => CompletionItemKind::MODULE,
        Offer::Form => CompletionItemKind::SNIPPET,
        Offer::Def(kind) => match kind {
            Kind::Capability => CompletionItemKind::INTERFACE,
            Kind::Asset => CompletionItemKind::CLASS,
            Kind::Skill | Kind::Function | Kind::Relation | Kind::Workflow => CompletionItemKind::FUNCTION,
            Kind::Command => CompletionItemKind::METHOD,
            Kind::Constant | Kind::Table | Kind::Species => CompletionItemKind::CONSTANT,
            Kind::Thing | Kind::Variable | Kind::Parameter | Kind::Step => CompletionItemKind::VARIABLE,
            Kind::Word => CompletionItemKind::ENUM_MEMBER,
            Kind::Unit => CompletionItemKind::UNIT,
            Kind::Frame | Kind::Part | Kind::Grid | Kind::Joint => CompletionItemKind::FIELD,
            Kind::Member | Kind::Option | Kind::Setting | Kind::Column => CompletionItemKind::PROPERTY,
            Kind::Lab | Kind::Included => CompletionItemKind::STRUCT,
            _ => CompletionItemKind::REFERENCE,
        },
    }
}

/// The form of the call at a position.
pub fn form(server: &mut Server, params: SignatureHelpParams) -> Option<SignatureHelp> {
    let at = params.text_document_position_params;
    let named = Named::of(server, &at.text_document.uri)?;
    let (text, lines) = (&*named.document.text, &named.document.lines);
    let found = signature(&named.index, named.file, text, lines.offset(text, at.position))?;
    let said = |value: String| Documentation::MarkupContent(MarkupContent { kind: MarkupKind::Markdown, value });
    let docs = named.index.def(found.def).docs.join("\n");
    let units = |bytes: usize| found.label[..bytes].encode_utf16().count() as u32;
    let parts = found.parts.iter().map(|(range, text)| ParameterInformation {
        label: ParameterLabel::LabelOffsets([units(range.start), units(range.end)]),
        documentation: Some(said(text.clone())),
    });
    let active = found.active.map(|a| a as u32);
    let signature = SignatureInformation {
        parameters: Some(parts.collect()),
        label: found.label.clone(),
        documentation: Some(docs).filter(|d| !d.is_empty()).map(said),
        active_parameter: active,
    };
    Some(SignatureHelp { signatures: vec![signature], active_signature: Some(0), active_parameter: active })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_without_places_read_well() {
        assert_eq!(plain("wait ${1:10 s}"), "wait 10 s");
        assert_eq!(plain("expect $0"), "expect ");
        assert_eq!(plain("heat ${1:plate} to ${2:t}$0"), "heat plate to t");
    }
}
