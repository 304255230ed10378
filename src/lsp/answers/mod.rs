//! What is answered to requests about texts, a file for each kind.

mod actions;
mod calls;
mod complete;
mod format;
mod hints;
mod hover;
mod names;
mod outline;
mod places;
pub mod tokens;

use std::borrow::Cow;
use std::sync::Arc;

use lsp_server::{ErrorCode, Request};
use lsp_types::request::{self as asked, Request as _};
use lsp_types::{Position, Uri};
use matterix_editor::{Analysis, Drift};
use matterix_ir::FileId;
use matterix_syntax::ast;
use serde_json::{Value, json};

use super::documents::Document;
use super::server::Server;

/// An answer, or why there is none.
pub type Answer = Result<Value, (ErrorCode, String)>;

/// Answers a request.
pub fn answer(server: &mut Server, request: Request) -> Answer {
    match request.method.as_str() {
        asked::HoverRequest::METHOD => with::<asked::HoverRequest>(server, request, hover::hover),
        asked::DocumentSymbolRequest::METHOD => with::<asked::DocumentSymbolRequest>(server, request, outline::symbols),
        asked::FoldingRangeRequest::METHOD => with::<asked::FoldingRangeRequest>(server, request, outline::folds),
        asked::Formatting::METHOD => with::<asked::Formatting>(server, request, format::whole),
        asked::RangeFormatting::METHOD => with::<asked::RangeFormatting>(server, request, format::range),
        asked::CodeActionRequest::METHOD => with::<asked::CodeActionRequest>(server, request, actions::actions),
        asked::InlayHintRequest::METHOD => with::<asked::InlayHintRequest>(server, request, hints::hints),
        asked::GotoDefinition::METHOD => with::<asked::GotoDefinition>(server, request, names::definition),
        asked::GotoTypeDefinition::METHOD => with::<asked::GotoTypeDefinition>(server, request, names::type_definition),
        asked::References::METHOD => with::<asked::References>(server, request, names::references),
        asked::DocumentHighlightRequest::METHOD => {
            with::<asked::DocumentHighlightRequest>(server, request, names::highlights)
        }
        asked::PrepareRenameRequest::METHOD => refusing::<asked::PrepareRenameRequest>(server, request, names::prepare),
        asked::Rename::METHOD => refusing::<asked::Rename>(server, request, names::renamed),
        asked::WorkspaceSymbolRequest::METHOD => with::<asked::WorkspaceSymbolRequest>(server, request, names::symbols),
        asked::Completion::METHOD => with::<asked::Completion>(server, request, complete::offers),
        asked::ResolveCompletionItem::METHOD => {
            with::<asked::ResolveCompletionItem>(server, request, complete::resolve)
        }
        asked::SignatureHelpRequest::METHOD => with::<asked::SignatureHelpRequest>(server, request, complete::form),
        asked::CallHierarchyPrepare::METHOD => with::<asked::CallHierarchyPrepare>(server, request, calls::prepare),
        asked::CallHierarchyIncomingCalls::METHOD => {
            with::<asked::CallHierarchyIncomingCalls>(server, request, calls::incoming)
        }
        asked::CallHierarchyOutgoingCalls::METHOD => {
            with::<asked::CallHierarchyOutgoingCalls>(server, request, calls::outgoing)
        }
        asked::SemanticTokensFullRequest::METHOD => {
            with::<asked::SemanticTokensFullRequest>(server, request, tokens::full)
        }
        asked::SemanticTokensFullDeltaRequest::METHOD => {
            with::<asked::SemanticTokensFullDeltaRequest>(server, request, tokens::delta)
        }
        asked::SemanticTokensRangeRequest::METHOD => {
            with::<asked::SemanticTokensRangeRequest>(server, request, tokens::range)
        }
        "workspace/textDocumentContent" => content(server, &request.params),
        method => Err((ErrorCode::MethodNotFound, format!("unknown method `{method}`"))),
    }
}

/// Answers a request whose parameters can be read.
fn with<R: asked::Request>(
    server: &mut Server,
    request: Request,
    answer: impl FnOnce(&mut Server, R::Params) -> R::Result,
) -> Answer {
    let params = serde_json::from_value(request.params).map_err(|why| (ErrorCode::InvalidParams, why.to_string()))?;
    serde_json::to_value(answer(server, params)).map_err(|why| (ErrorCode::InternalError, why.to_string()))
}

/// The same for what may be refused, with the reason.
fn refusing<R: asked::Request>(
    server: &mut Server,
    request: Request,
    answer: impl FnOnce(&mut Server, R::Params) -> Result<R::Result, String>,
) -> Answer {
    let params = serde_json::from_value(request.params).map_err(|why| (ErrorCode::InvalidParams, why.to_string()))?;
    let answer = answer(server, params).map_err(|why| (ErrorCode::RequestFailed, why))?;
    serde_json::to_value(answer).map_err(|why| (ErrorCode::InternalError, why.to_string()))
}

/// The text under an address of the server's scheme.
fn content(server: &Server, params: &Value) -> Answer {
    let uri = params.get("uri").and_then(Value::as_str).and_then(|uri| uri.parse().ok());
    let text = uri.as_ref().and_then(|uri: &Uri| server.shelf.text(uri));
    let why = || (ErrorCode::InvalidParams, "unknown document".to_string());
    text.map(|text| json!({ "text": text })).ok_or_else(why)
}

/// A text with the last check of it, or of an earlier state of it.
pub struct Seen<'s> {
    /// The text.
    pub document: &'s Document,
    /// The check.
    pub analysis: Arc<Analysis>,
    /// The text in the check.
    pub file: FileId,
    /// How the text has changed since.
    pub drift: Drift,
}

impl<'s> Seen<'s> {
    /// What is known of the text under an address; nothing where it is not open, or was never checked.
    pub fn of(server: &'s Server, uri: &Uri) -> Option<Seen<'s>> {
        let document = server.documents.get(uri)?;
        let analysis = document.last()?.clone();
        let file = analysis.root;
        let drift = Drift::between(analysis.text(file), &document.text);
        Some(Seen { document, analysis, file, drift })
    }

    /// The place of a position in the check.
    pub fn offset(&self, position: Position) -> usize {
        self.drift.back(self.document.lines.offset(&self.document.text, position))
    }
}

/// The tree of a text as it is.
pub fn tree(document: &Document) -> Cow<'_, ast::File> {
    let known = document.current().and_then(|analysis| analysis.tree(analysis.root));
    known.map_or_else(|| Cow::Owned(matterix_syntax::parse(FileId(0), &document.text).0), Cow::Borrowed)
}
