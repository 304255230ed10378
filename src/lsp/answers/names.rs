//! Names: where they are declared and where else they stand, and other names for them.

use lsp_types::{
    DocumentChanges, DocumentHighlight, DocumentHighlightParams, GotoDefinitionParams, GotoDefinitionResponse,
    Location, OneOf, OptionalVersionedTextDocumentIdentifier, PrepareRenameResponse, ReferenceParams, RenameParams,
    SymbolInformation, SymbolKind, TextDocumentEdit, TextDocumentPositionParams, TextEdit, WorkspaceEdit,
    WorkspaceSymbolParams, WorkspaceSymbolResponse,
};
use matterix_editor::Index;
use matterix_editor::index::Kind;
use matterix_editor::references::references as places_of;
use matterix_editor::rename;

use super::places::{Named, around, locate, locations, open};
use crate::lsp::server::Server;

/// Where what stands under a position is declared.
pub fn definition(server: &mut Server, params: GotoDefinitionParams) -> Option<GotoDefinitionResponse> {
    places(server, &params.text_document_position_params, Index::definition)
}

/// Where the kinds of the thing under a position are declared.
pub fn type_definition(server: &mut Server, params: GotoDefinitionParams) -> Option<GotoDefinitionResponse> {
    places(server, &params.text_document_position_params, Index::type_definition)
}

fn places(
    server: &Server,
    at: &TextDocumentPositionParams,
    find: impl Fn(&Index, matterix_ir::FileId, usize) -> Vec<matterix_ir::Span>,
) -> Option<GotoDefinitionResponse> {
    let named = Named::of(server, &at.text_document.uri)?;
    let spans = find(&named.index, named.file, named.offset(at.position));
    let found: Vec<Location> = spans.into_iter().filter_map(|s| locate(server, &named.index, s)).collect();
    Some(GotoDefinitionResponse::Array(found))
}

/// All places where what stands under a position is named.
pub fn references(server: &mut Server, params: ReferenceParams) -> Option<Vec<Location>> {
    let at = params.text_document_position;
    let named = Named::of(server, &at.text_document.uri)?;
    let offset = named.offset(at.position);
    let def = named.index.def_at(named.file, offset)?;
    let others = around(server, &named.index.key(def), &named.index.def(def).name);
    let all: Vec<&Index> = others.iter().map(|i| &**i).collect();
    let found = places_of(&all, &named.index, named.file, offset, params.context.include_declaration);
    let known: Vec<&Index> = std::iter::once(&*named.index).chain(all.iter().copied()).collect();
    Some(locations(server, &known, &found))
}

/// The places of the text where the same is named.
pub fn highlights(server: &mut Server, params: DocumentHighlightParams) -> Option<Vec<DocumentHighlight>> {
    let at = params.text_document_position_params;
    let named = Named::of(server, &at.text_document.uri)?;
    let spans = named.index.highlights(named.file, named.offset(at.position));
    Some(spans.into_iter().map(|s| DocumentHighlight { range: named.range(s), kind: None }).collect())
}

/// The name under a position, if it can be changed; why not otherwise.
pub fn prepare(server: &mut Server, at: TextDocumentPositionParams) -> Result<Option<PrepareRenameResponse>, String> {
    let Some(named) = Named::now(server, &at.text_document.uri) else { return Ok(None) };
    let (span, def) = rename::prepare(&named.index, named.file, named.offset(at.position))?;
    let placeholder = named.index.def(def).name.clone();
    Ok(Some(PrepareRenameResponse::RangeWithPlaceholder { range: named.range(span), placeholder }))
}

/// The changes that give what stands under a position another name; why that cannot be done otherwise.
pub fn renamed(server: &mut Server, params: RenameParams) -> Result<Option<WorkspaceEdit>, String> {
    let at = params.text_document_position;
    let Some(named) = Named::now(server, &at.text_document.uri) else { return Ok(None) };
    let offset = named.offset(at.position);
    let (_, def) = rename::prepare(&named.index, named.file, offset)?;
    let others = around(server, &named.index.key(def), &named.index.def(def).name);
    let all: Vec<&Index> = others.iter().map(|i| &**i).collect();
    let changes = rename::rename(&all, &named.index, named.file, offset, &params.new_name)?;
    let known: Vec<&Index> = std::iter::once(&*named.index).chain(all.iter().copied()).collect();
    let mut edits = Vec::new();
    for places in changes.values() {
        let found = locations(server, &known, places);
        let Some(uri) = found.first().map(|l| l.uri.clone()).filter(|_| found.len() == places.len()) else {
            return Err("some files that use this name may be missing".to_string());
        };
        let version = server.documents.get(&uri).map(|d| d.version);
        let edit = |l: Location| OneOf::Left(TextEdit { range: l.range, new_text: params.new_name.clone() });
        edits.push(TextDocumentEdit {
            text_document: OptionalVersionedTextDocumentIdentifier { uri, version },
            edits: found.into_iter().map(edit).collect(),
        });
    }
    Ok(Some(WorkspaceEdit { document_changes: Some(DocumentChanges::Edits(edits)), ..WorkspaceEdit::default() }))
}

/// What is declared in the open texts and what they import, by letters of its name.
#[expect(deprecated, reason = "the protocol's type asks for a field that it has given up")]
pub fn symbols(server: &mut Server, params: WorkspaceSymbolParams) -> Option<WorkspaceSymbolResponse> {
    let mut out: Vec<SymbolInformation> = Vec::new();
    for index in open(server) {
        for symbol in index.symbols(&params.query) {
            let Some(location) = super::places::location(server, &index, &symbol.place) else { continue };
            if out.iter().any(|o| o.location == location) {
                continue;
            }
            out.push(SymbolInformation {
                name: symbol.name,
                kind: symbol_kind(symbol.kind),
                tags: None,
                deprecated: None,
                location,
                container_name: Some(symbol.within).filter(|w| !w.is_empty()),
            });
        }
    }
    Some(WorkspaceSymbolResponse::Flat(out))
}

/// The protocol's kind for what is declared.
pub fn symbol_kind(kind: Kind) -> SymbolKind {
    match kind {
        Kind::Capability => SymbolKind::INTERFACE,
        Kind::Asset => SymbolKind::CLASS,
        Kind::Lab | Kind::Included => SymbolKind::NAMESPACE,
        Kind::Skill | Kind::Workflow | Kind::Test | Kind::Study | Kind::Fit | Kind::Function | Kind::Relation => {
            SymbolKind::FUNCTION
        }
        Kind::Command => SymbolKind::METHOD,
        Kind::Process | Kind::Event | Kind::Hazard | Kind::Step | Kind::Job | Kind::Failure => SymbolKind::EVENT,
        Kind::Constant | Kind::Table | Kind::Dimension | Kind::Unit => SymbolKind::CONSTANT,
        Kind::Species | Kind::Solution | Kind::Group | Kind::Material => SymbolKind::STRUCT,
        Kind::Reaction | Kind::Equilibrium | Kind::Interaction => SymbolKind::STRUCT,
        Kind::Thing | Kind::Variable | Kind::Parameter => SymbolKind::VARIABLE,
        Kind::Member | Kind::Option | Kind::Setting | Kind::Report | Kind::Column => SymbolKind::PROPERTY,
        Kind::Frame | Kind::Part | Kind::Grid | Kind::Joint => SymbolKind::FIELD,
        Kind::Driver | Kind::Framing => SymbolKind::MODULE,
        Kind::Word => SymbolKind::ENUM_MEMBER,
    }
}
