//! Requests about a text that was just opened: what they ask for is known once the text was checked for the first time.

#![allow(clippy::disallowed_methods, reason = "how long an answer waits is a matter of the clock")]

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use lsp_server::{Request, RequestId};
use lsp_types::Uri;
use lsp_types::request::{self as asked, Request as _};
use serde_json::Value;

/// The longest that an answer waits for the first check.
const PATIENCE: Duration = Duration::from_secs(20);

/// What is answered from a check. Outlines, folds and style come from the text alone; for colours it must be known which verbs there are.
const WAIT: &[&str] = &[
    asked::HoverRequest::METHOD,
    asked::CodeActionRequest::METHOD,
    asked::InlayHintRequest::METHOD,
    asked::GotoDefinition::METHOD,
    asked::GotoTypeDefinition::METHOD,
    asked::References::METHOD,
    asked::DocumentHighlightRequest::METHOD,
    asked::PrepareRenameRequest::METHOD,
    asked::Rename::METHOD,
    asked::Completion::METHOD,
    asked::SignatureHelpRequest::METHOD,
    asked::CallHierarchyPrepare::METHOD,
    asked::SemanticTokensFullRequest::METHOD,
    asked::SemanticTokensFullDeltaRequest::METHOD,
    asked::SemanticTokensRangeRequest::METHOD,
];

/// Requests that wait.
#[derive(Debug, Default)]
pub struct Held {
    all: Vec<Waiting>,
}

#[derive(Debug)]
struct Waiting {
    uri: Uri,
    until: Instant,
    request: Request,
}

impl Held {
    /// The text that a request is about, where its answer comes from a check.
    pub fn about(request: &Request) -> Option<Uri> {
        if !WAIT.contains(&request.method.as_str()) {
            return None;
        }
        request.params.get("textDocument")?.get("uri").and_then(Value::as_str)?.parse().ok()
    }

    /// Lets a request wait.
    pub fn keep(&mut self, uri: Uri, request: Request) {
        self.all.push(Waiting { uri, until: Instant::now() + PATIENCE, request });
    }

    /// When the first of them has waited long enough.
    pub fn until(&self) -> Option<Instant> {
        self.all.iter().map(|waiting| waiting.until).min()
    }

    /// Takes out those about texts that need not be waited for, and those that have waited long enough, in the order they came.
    pub fn ready(&mut self, is_ready: impl Fn(&Uri) -> bool) -> Vec<Request> {
        let now = Instant::now();
        let ready = |waiting: &mut Waiting| waiting.until <= now || is_ready(&waiting.uri);
        self.all.extract_if(.., ready).map(|waiting| waiting.request).collect()
    }

    /// Takes out those about a text.
    pub fn of(&mut self, uri: &Uri) -> Vec<RequestId> {
        self.all.extract_if(.., |waiting| waiting.uri == *uri).map(|waiting| waiting.request.id).collect()
    }

    /// Takes out those with these numbers, each as JSON writes it.
    pub fn cancel(&mut self, ids: &BTreeSet<String>) -> Vec<RequestId> {
        let cancelled = |waiting: &mut Waiting| ids.contains(&serde_json::json!(waiting.request.id).to_string());
        self.all.extract_if(.., cancelled).map(|waiting| waiting.request.id).collect()
    }
}
