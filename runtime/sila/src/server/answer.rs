//! Calls of gRPC, answered.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hyper::body::Incoming;
use matterix_sila::feature::{Element, Feature};
use tokio::sync::{mpsc as news, oneshot, watch};
use tonic::body::Body;
use tonic::metadata::MetadataMap;
use tonic::{Response, Status};
use tonic_prost::ProstCodec;
use tower::service_fn;

use super::executions::{Executions, Known, State};
use super::guard::{self, Guard};
use super::streams::{LIFETIME, Streamed, follow, infos, subscribed};
use super::{About, Call, News, Read, Request, cancel};
use crate::call::{Failure, refused, status};
use crate::framework::{self, Confirmation, Execution, Fully, Info, Kind, Refusal};
use crate::raw::Raw;
use crate::service;
use crate::value::{Value, decode, encode};

/// Longest request, bytes.
const LONGEST: usize = 1 << 20;

/// Longest time until the lab answers; it looks at what is asked many times a second.
const PATIENCE: Duration = Duration::from_secs(60);

/// What is offered, and whoever carries it out.
pub struct Answers {
    pub(super) features: Vec<Feature>,
    /// Those of the lab; the others are the standard's own.
    of_lab: Range<usize>,
    pub(super) about: Mutex<About>,
    lab: Mutex<mpsc::Sender<Request>>,
    pub(super) executions: Executions,
    pub(super) guard: Guard,
}

/// What a call of gRPC means.
#[derive(Clone, Copy)]
pub(super) enum Meant {
    Command(usize, usize),
    Info(usize, usize),
    Intermediate(usize, usize),
    Result(usize, usize),
    Get(usize, usize),
    Subscribe(usize, usize),
    /// What calls a metadata belongs to.
    Affected(usize),
}

impl Meant {
    /// The place of its feature.
    fn feature(&self) -> usize {
        match self {
            Meant::Command(f, _)
            | Meant::Info(f, _)
            | Meant::Intermediate(f, _)
            | Meant::Result(f, _)
            | Meant::Get(f, _)
            | Meant::Subscribe(f, _)
            | Meant::Affected(f) => *f,
        }
    }
}

impl Answers {
    /// The features of a lab, beside the standard's own.
    pub fn new(lab: Vec<Feature>, about: About, guard: Guard, sender: mpsc::Sender<Request>) -> Self {
        let of_lab = 1..1 + lab.len();
        let mut features = vec![service::feature()];
        features.extend(lab);
        features.push(cancel::feature());
        features.extend(guard::features(guard.has_users()));
        let (about, lab, executions) = (Mutex::new(about), Mutex::new(sender), Executions::default());
        Answers { features, of_lab, about, lab, executions, guard }
    }

    fn meant(&self, path: &str) -> Option<Meant> {
        let (service, method) = path.strip_prefix('/')?.split_once('/')?;
        let f = self.features.iter().position(|f| f.service() == service)?;
        let feature = &self.features[f];
        let command = |name: &str| feature.commands.iter().position(|c| c.identifier == name);
        let lasting = |name: &str| command(name).filter(|c| feature.commands[*c].observable);
        let property = |name: &str| feature.properties.iter().position(|p| p.identifier == name);
        if let Some(c) = command(method) {
            return Some(Meant::Command(f, c));
        }
        if let Some(name) = method.strip_prefix("Get_FCPAffectedByMetadata_") {
            return feature.metadata.iter().any(|m| m.element.identifier == name).then_some(Meant::Affected(f));
        }
        if let Some(p) = method.strip_prefix("Get_").and_then(property) {
            return Some(Meant::Get(f, p)).filter(|_| !feature.properties[p].observable);
        }
        if let Some(p) = method.strip_prefix("Subscribe_").and_then(property) {
            return Some(Meant::Subscribe(f, p)).filter(|_| feature.properties[p].observable);
        }
        let (name, what) = method.rsplit_once('_')?;
        let c = lasting(name)?;
        match what {
            "Info" => Some(Meant::Info(f, c)),
            "Intermediate" => Some(Meant::Intermediate(f, c)),
            "Result" => Some(Meant::Result(f, c)),
            _ => None,
        }
    }

    /// Whether a call may be made; who makes it, if that is known.
    fn admits(&self, meant: &Meant, beside: &MetadataMap) -> Result<Option<String>, Status> {
        // What follows the beginning of a command names its execution, which only those know who began it.
        let (Meant::Command(f, _) | Meant::Get(f, _) | Meant::Subscribe(f, _)) = meant else { return Ok(None) };
        let feature = &self.features[*f];
        match self.of_lab.contains(f) || self.is_guarded(feature, meant) {
            true => self.guard.admits(feature, beside),
            false => Ok(None),
        }
    }

    /// Answers one call.
    pub async fn answer(self: Arc<Self>, request: http::Request<Incoming>) -> http::Response<Body> {
        let (this, path) = (self, request.uri().path().to_owned());
        let Some(meant) = this.meant(&path) else {
            return Status::unimplemented("unknown call").into_http();
        };
        // The first feature is that by which a server tells of itself.
        let known = this.guard.knows(meant.feature() == 0, request.headers());
        macro_rules! unary {
            ($of:ty => $to:ty, |$message:ident, $user:ident| $answer:expr) => {
                tonic::server::Grpc::new(ProstCodec::<$to, $of>::default())
                    .max_decoding_message_size(LONGEST)
                    .unary(
                        service_fn(move |request: tonic::Request<$of>| {
                            let (this, known) = (Arc::clone(&this), known.clone());
                            async move {
                                known?;
                                let $user = this.admits(&meant, request.metadata())?;
                                let $message = request.into_inner();
                                $answer(this).await.map(Response::new)
                            }
                        }),
                        request,
                    )
                    .await
            };
        }
        macro_rules! streamed {
            ($of:ty => $to:ty, |$message:ident| $answer:expr) => {
                tonic::server::Grpc::new(ProstCodec::<$to, $of>::default())
                    .max_decoding_message_size(LONGEST)
                    .server_streaming(
                        service_fn(move |request: tonic::Request<$of>| {
                            let (this, known) = (Arc::clone(&this), known.clone());
                            async move {
                                known?;
                                this.admits(&meant, request.metadata())?;
                                let $message = request.into_inner();
                                let all: Result<Streamed<$to>, Status> = $answer(this).await;
                                all.map(Response::new)
                            }
                        }),
                        request,
                    )
                    .await
            };
        }
        type This = Arc<Answers>;
        match meant {
            Meant::Command(f, c) if !this.of_lab.contains(&f) => {
                unary!(Raw => Raw, |raw, _user| async |this: This| this.own_command(f, c, raw).await)
            }
            Meant::Command(f, c) if this.features[f].commands[c].observable => {
                unary!(Raw => Confirmation, |raw, user| async |this: This| this.begin(f, c, raw, user).await)
            }
            Meant::Command(f, c) => {
                unary!(Raw => Raw, |raw, user| async |this: This| this.whole(f, c, raw, user).await)
            }
            Meant::Get(f, p) if !this.of_lab.contains(&f) => {
                unary!(Raw => Raw, |_raw, _user| async |this: This| this.own_property(f, p))
            }
            Meant::Get(f, p) => unary!(Raw => Raw, |_raw, _user| async |this: This| this.read(f, p).await),
            Meant::Affected(f) => unary!(Raw => Raw, |_raw, _user| async |this: This| this.affected(f)),
            Meant::Result(f, c) => {
                unary!(Execution => Raw, |which, _user| async |this: This| this.result(f, c, &which))
            }
            Meant::Info(f, c) => {
                streamed!(Execution => Info, |which| async |this: This| this.known(f, c, &which).map(infos))
            }
            Meant::Intermediate(f, c) => {
                // No command of a lab tells anything while it lasts.
                streamed!(Execution => Raw, |which| async |this: This| {
                    this.known(f, c, &which).map(|_| Box::pin(tokio_stream::empty()) as Streamed<Raw>)
                })
            }
            Meant::Subscribe(f, p) => {
                streamed!(Raw => Raw, |_raw| async |this: This| Ok(subscribed(this, f, p)))
            }
        }
    }

    fn send(&self, request: Request) -> Result<(), Status> {
        let lab = self.lab.lock().unwrap_or_else(PoisonError::into_inner);
        lab.send(request).map_err(|_| gone())
    }

    /// The arguments of a call.
    pub(super) fn arguments(
        &self,
        f: usize,
        elements: &[Element],
        path: &str,
        raw: &Raw,
    ) -> Result<Vec<Value>, Status> {
        let feature = &self.features[f];
        let mut values = Vec::new();
        for (at, element) in elements.iter().enumerate() {
            // One by one, so that the error names the parameter.
            let own = Raw { fields: raw.all(at as u32 + 1).map(|bytes| (1, bytes.to_vec())).collect() };
            let read = decode(feature, std::slice::from_ref(element), &own);
            values.extend(read.map_err(|message| {
                let identifier = format!("{}/{path}/Parameter/{}", feature.id(), element.identifier);
                status(Kind::Validation(Fully { identifier, message }))
            })?);
        }
        Ok(values)
    }

    async fn call(
        &self,
        f: usize,
        c: usize,
        raw: &Raw,
        user: Option<String>,
    ) -> Result<(news::UnboundedReceiver<News>, Arc<AtomicBool>), Status> {
        let command = &self.features[f].commands[c];
        let path = format!("Command/{}", command.identifier);
        let arguments = self.arguments(f, &command.parameters, &path, raw)?;
        let (news, heard) = news::unbounded_channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        self.send(Request::Call(Call {
            feature: f - self.of_lab.start,
            command: c,
            arguments,
            user,
            news,
            cancelled: Arc::clone(&cancelled),
        }))?;
        Ok((heard, cancelled))
    }

    /// A command that does not last.
    async fn whole(&self, f: usize, c: usize, raw: Raw, user: Option<String>) -> Result<Raw, Status> {
        let (mut heard, _) = self.call(f, c, &raw, user).await?;
        let feature = &self.features[f];
        loop {
            match tokio::time::timeout(PATIENCE, heard.recv()).await {
                Ok(Some(News::Begun | News::Goes(..))) => {}
                Ok(Some(News::Done(values))) => {
                    return encode(feature, &feature.commands[c].responses, &values).map_err(Status::internal);
                }
                Ok(Some(News::Failed(failure))) => return Err(failure.status(&feature.id())),
                Ok(Some(News::NotNow(why))) => return Err(refused(Refusal::NotAccepted, why)),
                Ok(None) | Err(_) => return Err(gone()),
            }
        }
    }

    /// A command that lasts: its execution is named as soon as it has begun.
    async fn begin(&self, f: usize, c: usize, raw: Raw, user: Option<String>) -> Result<Confirmation, Status> {
        let (mut heard, cancelled) = self.call(f, c, &raw, user).await?;
        let (state, watched) = watch::channel(State::default());
        let first = tokio::time::timeout(PATIENCE, heard.recv()).await;
        match first {
            Ok(Some(News::NotNow(why))) => return Err(refused(Refusal::NotAccepted, why)),
            Ok(Some(news)) => {
                state.send_modify(|s| follow(s, news));
            }
            Ok(None) | Err(_) => return Err(gone()),
        }
        let value = self.executions.add((f, c), cancelled, watched);
        let value = value.ok_or_else(|| refused(Refusal::NotAccepted, "too many commands are running"))?;
        tokio::spawn(async move {
            while state.borrow().end.is_none() {
                match heard.recv().await {
                    Some(news) => state.send_modify(|s| follow(s, news)),
                    None => {
                        let end = Failure::Lost("the lab is no longer served".to_owned());
                        state.send_modify(|s| s.end = Some(Err(end)));
                    }
                }
            }
        });
        let lifetime = Some(framework::Duration::of(LIFETIME));
        Ok(Confirmation { execution: Some(Execution { value }), lifetime })
    }

    fn known(&self, f: usize, c: usize, which: &Execution) -> Result<Known, Status> {
        let found = self.executions.find(&which.value, (f, c));
        found.ok_or_else(|| refused(Refusal::NoExecution, "this command has no such execution"))
    }

    fn result(&self, f: usize, c: usize, which: &Execution) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let end = self.known(f, c, which)?.state.borrow().end.clone();
        match end {
            None => Err(refused(Refusal::NotFinished, "it has not ended")),
            Some(Ok(values)) => encode(feature, &feature.commands[c].responses, &values).map_err(Status::internal),
            Some(Err(failure)) => Err(failure.status(&feature.id())),
        }
    }

    pub(super) async fn read(&self, f: usize, p: usize) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let (answer, value) = oneshot::channel();
        self.send(Request::Read(Read { feature: f - self.of_lab.start, property: p, answer }))?;
        let value = match tokio::time::timeout(PATIENCE, value).await {
            Ok(Ok(value)) => value.map_err(|failure| failure.status(&feature.id()))?,
            _ => return Err(gone()),
        };
        told(feature, p, value)
    }
}

fn gone() -> Status {
    Failure::Lost("the lab does not answer".to_owned()).status("")
}

/// The value of a property as an answer.
pub(super) fn told(feature: &Feature, p: usize, value: Value) -> Result<Raw, Status> {
    let property = &feature.properties[p];
    let element = Element {
        identifier: property.identifier.clone(),
        display: String::new(),
        description: String::new(),
        ty: property.ty.clone(),
    };
    encode(feature, &[element], &[value]).map_err(Status::internal)
}
