//! A server: features offered to others. What is called goes as a [`Request`] to whoever carries it out.

mod answer;
mod cancel;
mod executions;
mod guard;
mod own;
mod streams;

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use hyper::server::conn::http2;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use matterix_sila::feature::Feature;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Semaphore, mpsc as news, oneshot};

use crate::call::Failure;
use crate::tls::{self, Identity};
use crate::value::Value;
use answer::Answers;
use guard::Guard;
pub use guard::Users;

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
    /// Who calls, where people log in.
    pub user: Option<String>,
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

/// Whom a server answers, and how.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Door {
    /// The certificate that it shows; connections are not encrypted without one.
    pub identity: Option<Identity>,
    /// Who must log in; everybody may call where there are none.
    pub users: Option<Users>,
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

/// Longest time in which a connection is agreed on.
const GREETING: Duration = Duration::from_secs(10);

/// The most connections at once: whoever comes later waits until one ends.
const MOST: usize = 256;

/// Offers features at an address; what is called comes out of the channel.
pub fn serve(
    address: SocketAddr,
    about: About,
    door: Door,
    features: Vec<Feature>,
) -> Result<(Server, mpsc::Receiver<Request>), String> {
    let failed = |e: std::io::Error| format!("cannot listen on `{address}`: {e}");
    let tls = door.identity.as_ref().map(tls::acceptor).transpose()?;
    let runtime = Builder::new_multi_thread().worker_threads(2).enable_all().build().map_err(failed)?;
    let listener = runtime.block_on(TcpListener::bind(address)).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let (sender, requests) = mpsc::channel();
    let answers = Arc::new(Answers::new(features, about, Guard::new(door.users), sender));
    let places = Arc::new(Semaphore::new(MOST));
    runtime.spawn(async move {
        loop {
            let Ok(place) = Arc::clone(&places).acquire_owned().await else { return };
            let Ok((stream, _)) = listener.accept().await else {
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            };
            let _ = stream.set_nodelay(true);
            let (answers, tls) = (Arc::clone(&answers), tls.clone());
            tokio::spawn(async move {
                let _place = place;
                match tls {
                    None => converse(stream, answers).await,
                    Some(tls) => {
                        // What is no TLS ends the connection, and nothing else.
                        if let Ok(Ok(stream)) = tokio::time::timeout(GREETING, tls.accept(stream)).await {
                            converse(stream, answers).await;
                        }
                    }
                }
            });
        }
    });
    Ok((Server { runtime: Some(runtime), address }, requests))
}

/// Answers what comes over a connection until it ends.
async fn converse(stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static, answers: Arc<Answers>) {
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
}
