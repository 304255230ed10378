//! A server: features offered to others. What is called goes as a [`Request`] to whoever carries it out.

mod answer;
mod cancel;
mod executions;
mod streams;

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use hyper::server::conn::http2;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use matterix_sila::feature::Feature;
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{mpsc as news, oneshot};

use crate::call::Failure;
use crate::service;
use crate::value::Value;
use answer::Answers;

/// What others ask for.
#[derive(Debug)]
pub enum Request {
    /// A command.
    Call(Call),
    /// A property.
    Read(Read),
}

/// A command that is called.
#[derive(Debug)]
pub struct Call {
    /// Index of the feature.
    pub feature: usize,
    /// Index of the command in it.
    pub command: usize,
    /// In the order of its parameters.
    pub arguments: Vec<Value>,
    /// Told how it stands; nobody listens any more where this is closed.
    pub news: news::UnboundedSender<News>,
    /// Set when whoever called it wants it no more.
    pub cancelled: Arc<AtomicBool>,
}

impl Call {
    /// Whether it is to be broken off.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// How a command that was called stands.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// It has begun.
    Begun,
    /// How much of it is done, from 0 to 1, and how long it will still take, s.
    Goes(f64, Option<f64>),
    /// It has ended; what it answers, in the order of its responses.
    Done(Vec<Value>),
    /// It came to nothing.
    Failed(Failure),
    /// It is not done now.
    NotNow(String),
}

/// A property that is asked for.
#[derive(Debug)]
pub struct Read {
    /// Index of the feature.
    pub feature: usize,
    /// Index of the property in it.
    pub property: usize,
    /// Where its value goes.
    pub answer: oneshot::Sender<Result<Value, Failure>>,
}

/// What a server says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The version of its program.
    pub version: String,
    /// Its identifier.
    pub uuid: String,
}

/// A server that answers until it is dropped.
pub struct Server {
    runtime: Option<Runtime>,
    /// Where it answers.
    pub address: SocketAddr,
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(Duration::from_millis(500));
        }
    }
}

/// An identifier that no other server has.
pub fn new_uuid() -> String {
    uuid::Uuid::new_v4().to_string()
}

/// An identifier as it is written; nothing where it is none.
pub fn uuid(text: &str) -> Option<String> {
    uuid::Uuid::parse_str(text).ok().map(|uuid| uuid.to_string())
}

/// Longest time in which connections that are open may end.
const IDLE: Duration = Duration::from_secs(20);

/// Offers features at an address; what is called comes out of the channel.
pub fn serve(
    address: SocketAddr,
    name: &str,
    description: &str,
    version: &str,
    uuid: &str,
    features: Vec<Feature>,
) -> Result<(Server, mpsc::Receiver<Request>), String> {
    let failed = |e: std::io::Error| format!("cannot answer at `{address}`: {e}");
    let runtime = Builder::new_multi_thread().worker_threads(2).enable_all().build().map_err(failed)?;
    let listener = runtime.block_on(TcpListener::bind(address)).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let (sender, requests) = mpsc::channel();
    let about = About {
        name: name.to_owned(),
        description: description.to_owned(),
        version: version.to_owned(),
        uuid: uuid.to_owned(),
    };
    let mut all = vec![service::feature()];
    all.extend(features);
    all.push(cancel::feature());
    let answers = Arc::new(Answers::new(all, Mutex::new(about), sender));
    runtime.spawn(async move {
        loop {
            let Ok((stream, _)) = listener.accept().await else {
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            };
            let _ = stream.set_nodelay(true);
            let answers = Arc::clone(&answers);
            tokio::spawn(async move {
                let service = hyper::service::service_fn(move |request| {
                    let answers = Arc::clone(&answers);
                    async move { Ok::<_, std::convert::Infallible>(answers.answer(request).await) }
                });
                // What is no HTTP/2 ends the connection, and nothing else.
                let _ = http2::Builder::new(TokioExecutor::new())
                    .timer(TokioTimer::new())
                    .keep_alive_interval(Some(IDLE))
                    .serve_connection(TokioIo::new(stream), service)
                    .await;
            });
        }
    });
    Ok((Server { runtime: Some(runtime), address }, requests))
}
