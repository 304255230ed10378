//! The conversation: one thread takes messages in the order they come, checks go on beside it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, BufReader, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crossbeam_channel::{Receiver, Sender};
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{self as told, Notification as _};
use lsp_types::request::{self as asked, Request as _};
use lsp_types::{InitializeParams, MessageType, Uri};
use matterix_editor::Analysis;
use matterix_lang::{LibraryOnly, Session};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::capabilities::{self, Client};
use super::documents::Documents;
use super::frames::{self, Frame};
use super::held::Held;
use super::judge::{Judge, Round, Said, Verdict, Wish};
use super::publish::Published;
use super::shelf::Shelf;
use super::{answers, publish, uris};
use crate::{Exit, cache};

/// Where a conversation stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Nothing was agreed yet.
    Strange,
    /// It is on.
    Open,
    /// The client has asked to end it.
    Ending,
}

/// Answers on standard input and output until the client says good-bye. `Err` says why it cannot begin.
pub fn serve() -> Result<Exit, String> {
    let (came, coming) = crossbeam_channel::bounded(64);
    let reader = move || {
        let mut stream = BufReader::new(io::stdin().lock());
        while let Some(frame) = frames::read(&mut stream) {
            let last = matches!(&frame, Frame::Message(Message::Notification(n)) if n.method == told::Exit::METHOD);
            if came.send(frame).is_err() || last {
                break;
            }
        }
    };
    let thread = |name: &str| thread::Builder::new().name(name.to_string());
    // It may wait for input for ever, so it is not waited for.
    thread("reader").spawn(reader).map_err(|why| format!("cannot start a thread: {why}"))?;
    let (out, writer) = writer()?;
    let (found, verdicts) = crossbeam_channel::unbounded();
    let judge = Judge::start(&found)?;
    let mut server = Server::new(out, judge);
    let exit = server.converse(&coming, &verdicts);
    drop(server);
    let _ = writer.join();
    Ok(exit)
}

/// A thread that writes messages; it ends when nobody sends any more.
fn writer() -> Result<(Sender<Message>, JoinHandle<()>), String> {
    let (out, going) = crossbeam_channel::unbounded::<Message>();
    let write = move || {
        let mut stream = io::stdout().lock();
        // A client that has gone away reads no more; that it has gone the other stream tells.
        while let Ok(message) = going.recv() {
            if message.write(&mut stream).and_then(|()| stream.flush()).is_err() {
                break;
            }
        }
    };
    let writer = thread::Builder::new().name("writer".to_string()).spawn(write);
    Ok((out, writer.map_err(|why| format!("cannot start a thread: {why}"))?))
}

/// All that the server knows.
pub struct Server {
    out: Sender<Message>,
    judge: Judge,
    stage: Stage,
    /// What the client can do.
    pub client: Client,
    /// The open texts.
    pub documents: Documents,
    /// The texts that come with the command.
    pub shelf: Shelf,
    /// What was said of texts.
    published: Published,
    /// What was told of semantic tokens, for differences.
    pub tokens: BTreeMap<String, (String, Vec<lsp_types::SemanticToken>)>,
    /// Numbers requests to the client.
    asked: i32,
    /// The document that was changed last: it is checked first.
    urgent: Option<String>,
    /// Requests about texts that were not checked yet.
    held: Held,
}

impl Server {
    fn new(out: Sender<Message>, judge: Judge) -> Server {
        Server {
            out,
            judge,
            stage: Stage::Strange,
            client: Client::default(),
            documents: Documents::default(),
            shelf: Shelf::new(cache::folder()),
            published: Published::default(),
            tokens: BTreeMap::new(),
            asked: 0,
            urgent: None,
            held: Held::default(),
        }
    }

    /// What is known of names of the library where no text is open.
    pub fn library(&self) -> Arc<matterix_editor::Index> {
        Analysis::of("", "mtx 1\n", &LibraryOnly, &mut Session::default()).index()
    }

    /// Takes messages and verdicts until the end. Without a request to end before it, an end is a failure.
    fn converse(&mut self, coming: &Receiver<Frame>, verdicts: &Receiver<Verdict>) -> Exit {
        let mut waiting: VecDeque<Frame> = VecDeque::new();
        loop {
            if waiting.is_empty() {
                let late = self.held.until().map_or_else(crossbeam_channel::never, crossbeam_channel::at);
                crossbeam_channel::select_biased! {
                    recv(coming) -> frame => match frame {
                        Ok(frame) => waiting.push_back(frame),
                        Err(_) => return Exit::Findings,
                    },
                    recv(verdicts) -> verdict => {
                        verdict.into_iter().for_each(|verdict| self.hear(verdict));
                        self.answer_held();
                        continue;
                    }
                    recv(late) -> _ => {
                        self.answer_held();
                        continue;
                    }
                }
            }
            // What has come meanwhile may take back what was asked before.
            waiting.extend(coming.try_iter());
            self.cancel(&mut waiting);
            let changes = self.documents.changes();
            while let Some(frame) = waiting.pop_front() {
                if let Some(exit) = self.take(frame) {
                    return exit;
                }
            }
            if self.documents.changes() != changes {
                self.have_checked();
            }
        }
    }

    /// Takes requests out that the client does not want answered any more, and says so.
    fn cancel(&mut self, waiting: &mut VecDeque<Frame>) {
        let cancelled: BTreeSet<String> = waiting
            .iter()
            .filter_map(|frame| match frame {
                Frame::Message(Message::Notification(n)) if n.method == told::Cancel::METHOD => {
                    n.params.get("id").map(Value::to_string)
                }
                _ => None,
            })
            .collect();
        if cancelled.is_empty() {
            return;
        }
        for id in self.held.cancel(&cancelled) {
            self.refuse(id, ErrorCode::RequestCanceled, "cancelled");
        }
        let mut kept = VecDeque::new();
        for frame in waiting.drain(..) {
            match frame {
                Frame::Message(Message::Request(r)) if cancelled.contains(&json!(r.id).to_string()) => {
                    self.refuse(r.id, ErrorCode::RequestCanceled, "cancelled");
                }
                frame => kept.push_back(frame),
            }
        }
        *waiting = kept;
    }

    /// Takes one message; the end of the conversation, where it is one.
    fn take(&mut self, frame: Frame) -> Option<Exit> {
        match frame {
            Frame::Broken(why) => self.log(MessageType::WARNING, &why),
            Frame::Message(Message::Request(request)) => self.answer(request),
            Frame::Message(Message::Notification(n)) if n.method == told::Exit::METHOD => {
                return Some(if self.stage == Stage::Ending { Exit::Fine } else { Exit::Findings });
            }
            Frame::Message(Message::Notification(n)) if self.stage == Stage::Open => self.note(n),
            // Nothing the server asks for needs an answer; and before the beginning notes say nothing.
            Frame::Message(_) => {}
        }
        None
    }

    fn answer(&mut self, request: Request) {
        match (self.stage, request.method.as_str()) {
            (Stage::Strange, asked::Initialize::METHOD) => self.begin(request),
            (Stage::Strange, _) => {
                self.refuse(request.id, ErrorCode::ServerNotInitialized, "the session is not initialised yet")
            }
            (Stage::Open, asked::Shutdown::METHOD) => {
                self.stage = Stage::Ending;
                self.held.ready(|_| true).into_iter().for_each(|held| self.give(held));
                self.send(Response::new_ok(request.id, ()));
            }
            (Stage::Open, asked::Initialize::METHOD) | (Stage::Ending, _) => {
                self.refuse(request.id, ErrorCode::InvalidRequest, "not allowed at this time");
            }
            (Stage::Open, _) => match Held::about(&request).filter(|uri| self.is_unchecked(uri)) {
                Some(uri) => self.held.keep(uri, request),
                None => self.give(request),
            },
        }
    }

    /// Answers a request from what is known now.
    fn give(&mut self, request: Request) {
        let id = request.id.clone();
        match answers::answer(self, request) {
            Ok(result) => self.send(Response { id, response_result: Ok(result) }),
            Err((code, why)) => self.refuse(id, code, &why),
        }
    }

    /// Whether a text is open whose first check is still to come.
    fn is_unchecked(&self, uri: &Uri) -> bool {
        self.documents.get(uri).is_some_and(|d| d.last().is_none()) && self.shelf.module_at(uri).is_none()
    }

    /// Answers what need not wait any more.
    fn answer_held(&mut self) {
        let mut held = std::mem::take(&mut self.held);
        let ready = held.ready(|uri| !self.is_unchecked(uri));
        self.held = held;
        ready.into_iter().for_each(|request| self.give(request));
    }

    fn begin(&mut self, request: Request) {
        let params: InitializeParams = match serde_json::from_value(request.params) {
            Ok(params) => params,
            Err(why) => return self.refuse(request.id, ErrorCode::InvalidParams, &why.to_string()),
        };
        self.client = Client::of(&params);
        self.documents = Documents::new(self.client.encoding);
        self.stage = Stage::Open;
        self.send(Response::new_ok(request.id, capabilities::offered(&self.client)));
    }

    fn note(&mut self, note: Notification) {
        match note.method.as_str() {
            told::Initialized::METHOD => {
                if let Some(registration) = capabilities::registrations(&self.client) {
                    self.ask::<asked::RegisterCapability>(registration);
                }
            }
            told::DidOpenTextDocument::METHOD => {
                if let Some(params) = self.params::<told::DidOpenTextDocument>(note) {
                    let document = params.text_document;
                    self.urgent = Some(document.uri.as_str().to_string());
                    self.documents.open(document.uri, document.version, &document.text);
                }
            }
            told::DidChangeTextDocument::METHOD => {
                if let Some(params) = self.params::<told::DidChangeTextDocument>(note) {
                    let document = params.text_document;
                    self.urgent = Some(document.uri.as_str().to_string());
                    // Places that were asked about are those of the text before.
                    for id in self.held.of(&document.uri) {
                        self.refuse(id, ErrorCode::ContentModified, "the document has changed since");
                    }
                    self.documents.edit(&document.uri, document.version, params.content_changes);
                }
            }
            told::DidCloseTextDocument::METHOD => {
                if let Some(params) = self.params::<told::DidCloseTextDocument>(note) {
                    let uri = params.text_document.uri;
                    self.documents.close(&uri);
                    self.answer_held();
                    self.tokens.remove(uri.as_str());
                    self.published.forget(uri.as_str());
                    self.publish();
                }
            }
            told::DidSaveTextDocument::METHOD => {
                if let Some(params) = self.params::<told::DidSaveTextDocument>(note) {
                    // Not every client tells of files that change on the disk: now is a time to look.
                    self.documents.changed(Some(params.text_document.uri.as_str()), None);
                }
            }
            told::DidChangeWatchedFiles::METHOD => {
                if let Some(params) = self.params::<told::DidChangeWatchedFiles>(note) {
                    for path in params.changes.iter().filter_map(|change| uris::path(&change.uri)) {
                        // Of a text that is open the disk says nothing.
                        if self.documents.at(&path).is_none() {
                            self.documents.changed(None, Some(&path));
                        }
                    }
                }
            }
            _ => {}
        }
    }

    /// What a notification says; what cannot be read is said and passed over.
    fn params<N: told::Notification>(&mut self, note: Notification) -> Option<N::Params>
    where
        N::Params: DeserializeOwned,
    {
        match serde_json::from_value(note.params) {
            Ok(params) => Some(params),
            Err(why) => {
                self.log(MessageType::WARNING, &format!("cannot read `{}`: {why}", N::METHOD));
                None
            }
        }
    }

    /// Has everything checked whose findings are of another text; what is being typed first.
    fn have_checked(&mut self) {
        let stale = self.documents.iter().filter(|d| d.current().is_none() && self.shelf.module_at(&d.uri).is_none());
        let mut wishes: Vec<Wish> = stale.map(wish).collect();
        wishes.sort_by_key(|wish| Some(&wish.uri) != self.urgent.as_ref());
        self.judge.check(Round { wishes, open: Arc::new(self.documents.texts()) });
    }

    /// Takes what was found. Of a text that has changed since nothing is told, but answers may still come from its check.
    fn hear(&mut self, verdict: Verdict) {
        let Some(document) = self.documents.get_mut(&verdict.uri) else { return };
        let current = document.stamp == verdict.stamp;
        match verdict.said {
            Said::Read(found) if current && !found.is_empty() => {
                let params = publish::read(document, &found, &self.shelf);
                self.published.told(&params);
                self.tell::<told::PublishDiagnostics>(params);
            }
            Said::Checked(analysis, asked) => {
                let hints = document.judged.as_ref().is_none_or(|(_, last)| !last.knows_the_same(&analysis));
                document.judged = Some((verdict.stamp, Arc::new(*analysis)));
                document.asked = asked;
                if !current {
                    return;
                }
                let round = Round { wishes: vec![wish(document)], open: Arc::new(self.documents.texts()) };
                self.published.checked(&verdict.uri, verdict.stamp);
                self.publish();
                self.judge.look_at_motions(round);
                if hints && self.client.refreshes_hints {
                    self.ask::<asked::InlayHintRefreshRequest>(());
                }
            }
            Said::Moved(found) if current => {
                self.published.moved(&verdict.uri, verdict.stamp, found);
                self.publish();
            }
            Said::Read(_) | Said::Moved(_) => {}
        }
    }

    /// Tells the client what has become different.
    fn publish(&mut self) {
        for params in self.published.news(&self.documents, &self.shelf, &self.client) {
            self.tell::<told::PublishDiagnostics>(params);
        }
    }

    fn send(&self, message: impl Into<Message>) {
        // The writer ends with the client; what it would have been told is of no use then.
        let _ = self.out.send(message.into());
    }

    fn tell<N: told::Notification>(&self, params: N::Params) {
        self.send(Notification::new(N::METHOD.to_string(), params));
    }

    /// Asks the client for something whose answer says nothing.
    fn ask<R: asked::Request>(&mut self, params: R::Params) {
        self.asked += 1;
        let id = RequestId::from(format!("matterixc-{}", self.asked));
        self.send(Request::new(id, R::METHOD.to_string(), params));
    }

    fn refuse(&self, id: RequestId, code: ErrorCode, why: &str) {
        self.send(Response::new_err(id, code as i32, why.to_string()));
    }

    fn log(&self, typ: MessageType, message: &str) {
        self.tell::<told::LogMessage>(lsp_types::LogMessageParams { typ, message: message.to_string() });
    }
}

fn wish(document: &super::documents::Document) -> Wish {
    Wish {
        uri: document.uri.as_str().to_string(),
        stamp: document.stamp,
        name: document.name(),
        text: document.text.clone(),
        folder: document.folder().map(PathBuf::from),
    }
}
