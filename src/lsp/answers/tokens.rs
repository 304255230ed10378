//! What words of a text are, for colours.

use lsp_types::{
    SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokens, SemanticTokensDelta,
    SemanticTokensDeltaParams, SemanticTokensEdit, SemanticTokensFullDeltaResult, SemanticTokensParams,
    SemanticTokensRangeParams, SemanticTokensRangeResult, SemanticTokensResult, Uri,
};
use matterix_editor::Kind;

use crate::lsp::documents::Document;
use crate::lsp::server::Server;

/// Kinds of words with their types in the protocol, in the order of their numbers.
const TYPES: &[(Kind, SemanticTokenType)] = &[
    (Kind::Keyword, SemanticTokenType::KEYWORD),
    (Kind::Label, SemanticTokenType::MODIFIER),
    (Kind::Number, SemanticTokenType::NUMBER),
    (Kind::Unit, SemanticTokenType::ENUM_MEMBER),
    (Kind::Text, SemanticTokenType::STRING),
    (Kind::Comment, SemanticTokenType::COMMENT),
    (Kind::Skill, SemanticTokenType::METHOD),
    (Kind::Function, SemanticTokenType::FUNCTION),
    (Kind::Type, SemanticTokenType::TYPE),
    (Kind::Species, SemanticTokenType::STRUCT),
    (Kind::Parameter, SemanticTokenType::PARAMETER),
    (Kind::Member, SemanticTokenType::PROPERTY),
    (Kind::Name, SemanticTokenType::VARIABLE),
];

/// The types that tokens have, by their numbers.
pub fn types() -> Vec<SemanticTokenType> {
    TYPES.iter().map(|(_, name)| name.clone()).collect()
}

/// The modifiers, by their bits.
pub fn modifiers() -> Vec<SemanticTokenModifier> {
    vec![SemanticTokenModifier::DECLARATION]
}

/// All tokens of a text.
pub fn full(server: &mut Server, params: SemanticTokensParams) -> Option<SemanticTokensResult> {
    let (id, data) = anew(server, &params.text_document.uri)?;
    Some(SemanticTokensResult::Tokens(SemanticTokens { result_id: Some(id), data }))
}

/// What is different from the tokens told before; all of them where those are not known any more.
pub fn delta(server: &mut Server, params: SemanticTokensDeltaParams) -> Option<SemanticTokensFullDeltaResult> {
    let uri = params.text_document.uri;
    let before = server.tokens.remove(uri.as_str()).filter(|(id, _)| *id == params.previous_result_id);
    let (id, data) = anew(server, &uri)?;
    let Some((_, before)) = before else {
        return Some(SemanticTokensFullDeltaResult::Tokens(SemanticTokens { result_id: Some(id), data }));
    };
    let head = before.iter().zip(&data).take_while(|(a, b)| a == b).count();
    let tail = before[head..].iter().rev().zip(data[head..].iter().rev()).take_while(|(a, b)| a == b).count();
    let (gone, new) = (before.len() - head - tail, &data[head..data.len() - tail]);
    // A token is five numbers, and places are counted in those.
    let edit = SemanticTokensEdit { start: 5 * head as u32, delete_count: 5 * gone as u32, data: Some(new.to_vec()) };
    let edits = if gone == 0 && new.is_empty() { Vec::new() } else { vec![edit] };
    Some(SemanticTokensFullDeltaResult::TokensDelta(SemanticTokensDelta { result_id: Some(id), edits }))
}

/// The tokens in a range.
pub fn range(server: &mut Server, params: SemanticTokensRangeParams) -> Option<SemanticTokensRangeResult> {
    let document = server.documents.get(&params.text_document.uri)?;
    let (start, end) = document.lines.bytes(&document.text, params.range);
    let data = encoded(document, |word| word.start < end && word.end > start);
    Some(SemanticTokensRangeResult::Tokens(SemanticTokens { result_id: None, data }))
}

/// All tokens of a text, kept under a new number.
fn anew(server: &mut Server, uri: &Uri) -> Option<(String, Vec<SemanticToken>)> {
    let document = server.documents.get(uri)?;
    let data = encoded(document, |_| true);
    let id = format!("{}", document.version);
    server.tokens.insert(uri.as_str().to_string(), (id.clone(), data.clone()));
    Some((id, data))
}

/// Tokens as the protocol writes them: each from the place of the one before.
fn encoded(document: &Document, wanted: impl Fn(&std::ops::Range<usize>) -> bool) -> Vec<SemanticToken> {
    let modules = document.last().map_or(&[][..], |analysis| &analysis.modules);
    let (text, lines) = (&*document.text, &document.lines);
    let mut out = Vec::new();
    let (mut line, mut column) = (0, 0);
    for word in matterix_editor::words(text, modules).into_iter().filter(|word| wanted(&word.range)) {
        let place = lines.position(text, word.range.start);
        let length = lines.encoding().length(text.get(word.range.clone()).unwrap_or_default()) as u32;
        let from = if place.line == line { column } else { 0 };
        let number = TYPES.iter().position(|(kind, _)| *kind == word.kind).unwrap_or_default();
        out.push(SemanticToken {
            delta_line: place.line - line,
            delta_start: place.character - from,
            length,
            token_type: number as u32,
            token_modifiers_bitset: u32::from(word.declared),
        });
        (line, column) = (place.line, place.character);
    }
    out
}
