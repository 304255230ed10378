//! What a text declares, and what of it folds.

use lsp_types::{
    DocumentSymbol, DocumentSymbolParams, DocumentSymbolResponse, FoldingRange, FoldingRangeKind, FoldingRangeParams,
    Location, SymbolInformation,
};
use matterix_editor::{FoldKind, Symbol, SymbolKind, folds as stretches};

use super::tree;
use crate::lsp::documents::Document;
use crate::lsp::server::Server;

/// The symbols of a text; one inside of another where the client shows that.
pub fn symbols(server: &mut Server, params: DocumentSymbolParams) -> Option<DocumentSymbolResponse> {
    let document = server.documents.get(&params.text_document.uri)?;
    let found = matterix_editor::outline(&tree(document));
    if server.client.nests_symbols {
        return Some(DocumentSymbolResponse::Nested(found.iter().map(|s| nested(s, document)).collect()));
    }
    let mut flat = Vec::new();
    found.iter().for_each(|symbol| flatten(symbol, None, document, &mut flat));
    Some(DocumentSymbolResponse::Flat(flat))
}

#[expect(deprecated, reason = "the protocol's type has a field that is not to be used any more")]
fn nested(symbol: &Symbol, document: &Document) -> DocumentSymbol {
    let range = |span: matterix_ir::Span| document.lines.range(&document.text, span.start as usize, span.end as usize);
    DocumentSymbol {
        name: symbol.name.clone(),
        detail: Some(symbol.detail.to_string()),
        kind: kind(symbol.kind),
        tags: None,
        deprecated: None,
        range: range(symbol.span.to(symbol.name_span)),
        selection_range: range(symbol.name_span),
        children: Some(symbol.children.iter().map(|child| nested(child, document)).collect()),
    }
}

#[expect(deprecated, reason = "the protocol's type has a field that is not to be used any more")]
fn flatten(symbol: &Symbol, within: Option<&str>, document: &Document, out: &mut Vec<SymbolInformation>) {
    let range = document.lines.range(&document.text, symbol.span.start as usize, symbol.span.end as usize);
    out.push(SymbolInformation {
        name: symbol.name.clone(),
        kind: kind(symbol.kind),
        tags: None,
        deprecated: None,
        location: Location { uri: document.uri.clone(), range },
        container_name: within.map(str::to_string),
    });
    symbol.children.iter().for_each(|child| flatten(child, Some(&symbol.name), document, out));
}

/// The protocol's word for a kind of symbol.
fn kind(kind: SymbolKind) -> lsp_types::SymbolKind {
    use lsp_types::SymbolKind as Kind;
    match kind {
        SymbolKind::Capability => Kind::INTERFACE,
        SymbolKind::Asset => Kind::CLASS,
        SymbolKind::Lab => Kind::NAMESPACE,
        SymbolKind::Instance => Kind::OBJECT,
        SymbolKind::Workflow | SymbolKind::Study => Kind::METHOD,
        SymbolKind::Skill | SymbolKind::Function => Kind::FUNCTION,
        SymbolKind::Law | SymbolKind::Reaction => Kind::EVENT,
        SymbolKind::Substance => Kind::STRUCT,
        SymbolKind::Constant => Kind::CONSTANT,
        SymbolKind::Unit => Kind::NUMBER,
        SymbolKind::Member => Kind::PROPERTY,
        SymbolKind::Frame => Kind::FIELD,
        SymbolKind::Step => Kind::VARIABLE,
        SymbolKind::Driver => Kind::MODULE,
    }
}

/// What can be folded away; of what stands in brackets the line of the closing one stays.
pub fn folds(server: &mut Server, params: FoldingRangeParams) -> Option<Vec<FoldingRange>> {
    let document = server.documents.get(&params.text_document.uri)?;
    let fold = |fold: matterix_editor::Fold| {
        let range = document.lines.range(&document.text, fold.range.start, fold.range.end);
        let (kind, last) = match fold.kind {
            FoldKind::Body => (None, range.end.line.saturating_sub(1)),
            FoldKind::Comment => (Some(FoldingRangeKind::Comment), range.end.line),
            FoldKind::Imports => (Some(FoldingRangeKind::Imports), range.end.line),
        };
        let first = range.start.line;
        (last > first).then(|| FoldingRange { start_line: first, end_line: last, kind, ..FoldingRange::default() })
    };
    Some(stretches(&document.text).into_iter().filter_map(fold).collect())
}
