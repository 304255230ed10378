//! Calls of gRPC, answered.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hyper::body::Incoming;
use matterix_sila::feature::{Element, Feature};
use tokio::sync::{mpsc as news, oneshot, watch};
use tonic::body::Body;
use tonic::{Response, Status};
use tonic_prost::ProstCodec;
use tower::service_fn;

use super::cancel;
use super::executions::{Executions, Known, State};
use super::streams::{LIFETIME, Streamed, follow, infos, subscribed};
use super::{About, Call, News, Read, Request};
use crate::call::{Failure, refused, status};
use crate::framework::{self, Confirmation, Execution, Fully, Info, Kind, Refusal};
use crate::raw::Raw;
use crate::service::UNIMPLEMENTED;
use crate::value::{Value, decode, encode};

/// Longest request, bytes.
const LONGEST: usize = 1 << 20;

/// Longest time until the lab answers; it looks at what is asked many times a second.
const PATIENCE: Duration = Duration::from_secs(60);

/// Index of the feature that every server has.
const SERVICE: usize = 0;

/// What is offered, and whoever carries it out.
pub struct Answers {
    features: Vec<Feature>,
    about: Mutex<About>,
    lab: Mutex<mpsc::Sender<Request>>,
    executions: Executions,
}

/// What a call of gRPC means.
enum Meant {
    Command(usize, usize),
    Info(usize, usize),
    Intermediate(usize, usize),
    Result(usize, usize),
    Get(usize, usize),
    Subscribe(usize, usize),
}

impl Answers {
    /// Features, the standard's own first.
    pub fn new(features: Vec<Feature>, about: Mutex<About>, lab: mpsc::Sender<Request>) -> Self {
        Answers { features, about, lab: Mutex::new(lab), executions: Executions::default() }
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

    /// Answers one call.
    pub async fn answer(self: std::sync::Arc<Self>, request: http::Request<Incoming>) -> http::Response<Body> {
        let (this, path) = (self, request.uri().path().to_owned());
        let beside = request.headers().keys().find(|k| k.as_str().starts_with("sila-")).is_some();
        macro_rules! unary {
            ($of:ty => $to:ty, |$message:ident| $answer:expr) => {
                tonic::server::Grpc::new(ProstCodec::<$to, $of>::default())
                    .max_decoding_message_size(LONGEST)
                    .unary(
                        service_fn(move |request: tonic::Request<$of>| {
                            let this = std::sync::Arc::clone(&this);
                            async move {
                                if beside {
                                    return Err(refused(Refusal::NoMetadata, "nothing goes beside calls here"));
                                }
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
                            let this = std::sync::Arc::clone(&this);
                            async move {
                                if beside {
                                    return Err(refused(Refusal::NoMetadata, "nothing goes beside calls here"));
                                }
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
        type This = std::sync::Arc<Answers>;
        match this.meant(&path) {
            None => Status::unimplemented("there is no such call").into_http(),
            Some(Meant::Command(f, c)) if this.features[f].commands[c].observable => {
                unary!(Raw => Confirmation, |raw| async |this: This| this.begin(f, c, raw).await)
            }
            Some(Meant::Command(SERVICE, c)) => {
                unary!(Raw => Raw, |raw| async |this: This| this.own_command(c, &raw))
            }
            Some(Meant::Command(f, c)) if this.features[f].identifier == cancel::IDENTIFIER => {
                unary!(Raw => Raw, |raw| async |this: This| this.cancel(f, c, &raw))
            }
            Some(Meant::Command(f, c)) => unary!(Raw => Raw, |raw| async |this: This| this.whole(f, c, raw).await),
            Some(Meant::Get(SERVICE, p)) => unary!(Raw => Raw, |_raw| async |this: This| this.own_property(p)),
            Some(Meant::Get(f, p)) => unary!(Raw => Raw, |_raw| async |this: This| this.read(f, p).await),
            Some(Meant::Result(f, c)) => {
                unary!(Execution => Raw, |which| async |this: This| this.result(f, c, &which))
            }
            Some(Meant::Info(f, c)) => {
                streamed!(Execution => Info, |which| async |this: This| this.known(f, c, &which).map(infos))
            }
            Some(Meant::Intermediate(f, c)) => {
                // No command of a lab tells anything while it lasts.
                streamed!(Execution => Raw, |which| async |this: This| {
                    this.known(f, c, &which).map(|_| Box::pin(tokio_stream::empty()) as Streamed<Raw>)
                })
            }
            Some(Meant::Subscribe(f, p)) => {
                streamed!(Raw => Raw, |_raw| async |this: This| Ok(subscribed(this, f, p)))
            }
        }
    }

    fn send(&self, request: Request) -> Result<(), Status> {
        let lab = self.lab.lock().unwrap_or_else(PoisonError::into_inner);
        lab.send(request).map_err(|_| gone())
    }

    /// The arguments of a call.
    fn arguments(&self, f: usize, elements: &[Element], path: &str, raw: &Raw) -> Result<Vec<Value>, Status> {
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
    ) -> Result<(news::UnboundedReceiver<News>, Arc<AtomicBool>), Status> {
        let command = &self.features[f].commands[c];
        let path = format!("Command/{}", command.identifier);
        let arguments = self.arguments(f, &command.parameters, &path, raw)?;
        let (news, heard) = news::unbounded_channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        self.send(Request::Call(Call {
            feature: f - 1,
            command: c,
            arguments,
            news,
            cancelled: Arc::clone(&cancelled),
        }))?;
        Ok((heard, cancelled))
    }

    /// Breaks off a command that goes on, or all.
    fn cancel(&self, f: usize, c: usize, raw: &Raw) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let command = &feature.commands[c];
        let path = format!("Command/{}", command.identifier);
        let arguments = self.arguments(f, &command.parameters, &path, raw)?;
        let named = arguments.first().map(crate::text::shown);
        if !self.executions.cancel(named.as_deref())
            && let Some(name) = named
        {
            let message = format!("no command with the execution `{name}` goes on");
            return Err(Failure::Refused { name: cancel::UNKNOWN.to_owned(), message }.status(&feature.id()));
        }
        Ok(Raw::default())
    }

    /// A command that does not last.
    async fn whole(&self, f: usize, c: usize, raw: Raw) -> Result<Raw, Status> {
        let (mut heard, _) = self.call(f, c, &raw).await?;
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
    async fn begin(&self, f: usize, c: usize, raw: Raw) -> Result<Confirmation, Status> {
        let (mut heard, cancelled) = self.call(f, c, &raw).await?;
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
        let value = value.ok_or_else(|| refused(Refusal::NotAccepted, "too many commands go on"))?;
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
        self.send(Request::Read(Read { feature: f - 1, property: p, answer }))?;
        let value = match tokio::time::timeout(PATIENCE, value).await {
            Ok(Ok(value)) => value.map_err(|failure| failure.status(&feature.id()))?,
            _ => return Err(gone()),
        };
        told(feature, p, value)
    }

    /// What a server says of itself.
    fn own_property(&self, p: usize) -> Result<Raw, Status> {
        let feature = &self.features[SERVICE];
        let about = self.about.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let text = match feature.properties[p].identifier.as_str() {
            "ServerName" => about.name,
            "ServerType" => "Matterixc".to_owned(),
            "ServerUUID" => about.uuid,
            "ServerDescription" => about.description,
            "ServerVersion" => about.version,
            "ServerVendorURL" => "https://matterixc.invalid".to_owned(),
            _ => {
                let all = self.features.iter().map(|f| Value::Text(f.id())).collect();
                return told(feature, p, Value::List(all));
            }
        };
        told(feature, p, Value::Text(text))
    }

    fn own_command(&self, c: usize, raw: &Raw) -> Result<Raw, Status> {
        let feature = &self.features[SERVICE];
        let command = &feature.commands[c];
        let path = format!("Command/{}", command.identifier);
        let arguments = self.arguments(SERVICE, &command.parameters, &path, raw)?;
        let text = arguments.first().map(crate::text::shown).unwrap_or_default();
        if command.responses.is_empty() {
            if text.chars().count() > 255 {
                let identifier = format!("{}/{path}/Parameter/ServerName", feature.id());
                let message = "a name has at most 255 characters".to_owned();
                return Err(status(Kind::Validation(Fully { identifier, message })));
            }
            self.about.lock().unwrap_or_else(PoisonError::into_inner).name = text;
            return Ok(Raw::default());
        }
        let Some(asked) = self.features.iter().find(|f| f.id() == text) else {
            let message = format!("`{text}` is not offered here");
            let failure = Failure::Refused { name: UNIMPLEMENTED.to_owned(), message };
            return Err(failure.status(&feature.id()));
        };
        let values = [Value::Text(matterix_sila::write(asked))];
        encode(feature, &command.responses, &values).map_err(Status::internal)
    }
}

fn gone() -> Status {
    Failure::Lost("the lab does not answer".to_owned()).status("")
}

/// The value of a property as an answer.
fn told(feature: &Feature, p: usize, value: Value) -> Result<Raw, Status> {
    let property = &feature.properties[p];
    let element = Element {
        identifier: property.identifier.clone(),
        display: String::new(),
        description: String::new(),
        ty: property.ty.clone(),
    };
    encode(feature, &[element], &[value]).map_err(Status::internal)
}
