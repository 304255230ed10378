//! What client and server can do.

use lsp_types::{
    CallHierarchyServerCapability, CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionOptions,
    DidChangeWatchedFilesRegistrationOptions, FileSystemWatcher, FoldingRangeProviderCapability, GlobPattern,
    HoverProviderCapability, InitializeParams, OneOf, Registration, RegistrationParams, RenameOptions, SaveOptions,
    SemanticTokensFullOptions, SemanticTokensLegend, SemanticTokensOptions, ServerCapabilities, SignatureHelpOptions,
    TextDocumentSyncCapability, TextDocumentSyncKind, TextDocumentSyncOptions, TextDocumentSyncSaveOptions,
    TypeDefinitionProviderCapability, WorkDoneProgressOptions,
};
use serde_json::{Value, json};

use super::answers::tokens;
use super::lines::Encoding;
use crate::uri::SCHEME;

/// What a client can do, as far as answers depend on it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Client {
    /// What columns count.
    pub encoding: Encoding,
    /// It asks for hints anew when told to.
    pub refreshes_hints: bool,
    /// It tells of files on the disk that change, if asked to.
    pub watches_files: bool,
    /// It understands code actions, not only commands.
    pub takes_actions: bool,
    /// It shows Markdown where text is shown.
    pub shows_markdown: bool,
    /// It lets places of what was completed be filled.
    pub fills_places: bool,
    /// It shows symbols inside of symbols.
    pub nests_symbols: bool,
}

impl Client {
    /// What it says of itself.
    pub fn of(params: &InitializeParams) -> Client {
        let can = &params.capabilities;
        let text = can.text_document.as_ref();
        let space = can.workspace.as_ref();
        let offered = can.general.as_ref().and_then(|g| g.position_encodings.as_deref()).unwrap_or_default();
        let formats = text.and_then(|t| t.hover.as_ref()).and_then(|h| h.content_format.as_deref()).unwrap_or_default();
        let items = text.and_then(|t| t.completion.as_ref()).and_then(|c| c.completion_item.as_ref());
        let symbols = text.and_then(|t| t.document_symbol.as_ref());
        Client {
            encoding: Encoding::agreed(offered),
            refreshes_hints: space.and_then(|w| w.inlay_hint.as_ref()).is_some_and(|h| h.refresh_support == Some(true)),
            watches_files: space
                .and_then(|w| w.did_change_watched_files.as_ref())
                .is_some_and(|w| w.dynamic_registration == Some(true)),
            takes_actions: text
                .and_then(|t| t.code_action.as_ref())
                .is_some_and(|a| a.code_action_literal_support.is_some()),
            shows_markdown: formats.contains(&lsp_types::MarkupKind::Markdown),
            fills_places: items.is_some_and(|i| i.snippet_support == Some(true)),
            nests_symbols: symbols.is_some_and(|s| s.hierarchical_document_symbol_support == Some(true)),
        }
    }
}

/// What the server says of itself.
pub fn offered(client: &Client) -> Value {
    let actions = CodeActionOptions {
        code_action_kinds: Some(vec![CodeActionKind::QUICKFIX, CodeActionKind::SOURCE_FIX_ALL]),
        ..CodeActionOptions::default()
    };
    let tokens = SemanticTokensOptions {
        legend: SemanticTokensLegend { token_types: tokens::types(), token_modifiers: tokens::modifiers() },
        range: Some(true),
        full: Some(SemanticTokensFullOptions::Delta { delta: Some(true) }),
        ..SemanticTokensOptions::default()
    };
    let capabilities = ServerCapabilities {
        position_encoding: Some(client.encoding.kind()),
        text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
            open_close: Some(true),
            change: Some(TextDocumentSyncKind::INCREMENTAL),
            save: Some(TextDocumentSyncSaveOptions::SaveOptions(SaveOptions { include_text: Some(false) })),
            ..TextDocumentSyncOptions::default()
        })),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        type_definition_provider: Some(TypeDefinitionProviderCapability::Simple(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: WorkDoneProgressOptions::default(),
        })),
        workspace_symbol_provider: Some(OneOf::Left(true)),
        call_hierarchy_provider: Some(CallHierarchyServerCapability::Simple(true)),
        completion_provider: Some(CompletionOptions {
            resolve_provider: Some(true),
            trigger_characters: Some([".", ":", "[", "("].map(String::from).to_vec()),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: Some([" ", "(", ",", "{"].map(String::from).to_vec()),
            ..SignatureHelpOptions::default()
        }),
        document_symbol_provider: Some(OneOf::Left(true)),
        folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        document_range_formatting_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(CodeActionProviderCapability::Options(actions)),
        semantic_tokens_provider: Some(tokens.into()),
        inlay_hint_provider: Some(OneOf::Left(true)),
        ..ServerCapabilities::default()
    };
    let mut capabilities = json!(capabilities);
    // Texts under the server's own scheme; the types do not know it yet.
    capabilities["workspace"]["textDocumentContent"] = json!({ "schemes": [SCHEME] });
    json!({
        "capabilities": capabilities,
        "serverInfo": { "name": "matterixc", "version": env!("CARGO_PKG_VERSION") },
    })
}

/// What the client is asked to tell besides.
pub fn registrations(client: &Client) -> Option<RegistrationParams> {
    // Modules, and what assets and studies name.
    let globs = ["**/*.mtx", "**/*.{json,urdf,xml,csv,stl,obj,glb,gltf,usd,usda,usdc,usdz}"];
    let watchers =
        globs.map(|glob| FileSystemWatcher { glob_pattern: GlobPattern::String(glob.to_string()), kind: None });
    client.watches_files.then(|| RegistrationParams {
        registrations: vec![Registration {
            id: "files".to_string(),
            method: "workspace/didChangeWatchedFiles".to_string(),
            register_options: serde_json::to_value(DidChangeWatchedFilesRegistrationOptions {
                watchers: watchers.to_vec(),
            })
            .ok(),
        }],
    })
}
