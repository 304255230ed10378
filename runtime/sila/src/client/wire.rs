//! Single calls of gRPC, none of which lasts longer than the client's patience.

use std::future::Future;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use http::uri::PathAndQuery;
use prost::Message;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;
use tonic::client::Grpc;
use tonic::transport::Channel;
use tonic::{Request, Response, Status, Streaming};
use tonic_prost::ProstCodec;

use super::Client;
use crate::call::Failure;
use crate::raw::Raw;

impl Client {
    pub(super) fn silent(&self, what: &str) -> Failure {
        Failure::Lost(format!("it did not reply to `{what}` within {} s", self.timeout.as_secs_f64()))
    }

    /// A call of a method of a feature, and what goes beside it.
    fn request<A>(&mut self, index: usize, method: &str, message: A) -> Result<(PathAndQuery, Request<A>), Failure> {
        let feature = &self.features[index];
        let path = format!("/{}/{method}", feature.service());
        let path = PathAndQuery::try_from(path).map_err(|e| Failure::Garbled(e.to_string()))?;
        let property = method.strip_prefix("Get_").or_else(|| method.strip_prefix("Subscribe_"));
        let called = match property {
            Some(property) => format!("{}/Property/{property}", feature.id()),
            None => format!("{}/Command/{method}", feature.id()),
        };
        let mut request = Request::new(message);
        // What follows the beginning of a command names its execution, and needs nothing else.
        if property.is_some() || feature.command(method).is_some() {
            let mut is_heard = false;
            self.beside.iter().for_each(|b| is_heard |= b.add(&called, request.metadata_mut()));
            if is_heard {
                self.has_lock()?;
                self.heard = super::now();
            }
        }
        Ok((path, request))
    }

    /// Fails where the server may have let go of the lock, so that others may have used it since.
    fn has_lock(&self) -> Result<(), Failure> {
        match self.lapse.filter(|lapse| self.heard.elapsed() >= *lapse) {
            Some(lapse) => Err(Failure::Lost(format!(
                "its lock ended because it received nothing for more than {} s: other clients may have used it",
                lapse.as_secs()
            ))),
            None => Ok(()),
        }
    }

    pub(super) fn unary<A, B>(&mut self, index: usize, method: &str, message: A) -> Result<B, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        let (path, request) = self.request(index, method, message)?;
        self.asked(path, request, Failure::of)
    }

    pub(super) fn stream<A, B>(&mut self, index: usize, method: &str, message: A) -> Result<Streaming<B>, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        let (path, request) = self.request(index, method, message)?;
        self.patiently(path, Failure::of, async |grpc, path| {
            grpc.server_streaming(request, path, ProstCodec::<A, B>::default()).await.map(Response::into_inner)
        })
    }

    /// What a server tells by and by: when it says the first of it is its own business.
    pub(super) fn follow<A>(&mut self, index: usize, method: &str, message: A) -> Result<Latest, Failure>
    where
        A: Message + Send + Sync + 'static,
    {
        let (path, request) = self.request(index, method, message)?;
        let mut grpc = self.grpc.clone();
        let newest = Arc::new(Mutex::new(None));
        let told = Arc::clone(&newest);
        let listens = self.runtime.spawn(async move {
            grpc.ready().await.ok()?;
            let answer = grpc.server_streaming(request, path, ProstCodec::<A, Raw>::default()).await.ok()?;
            let mut all = answer.into_inner();
            while let Some(raw) = all.message().await.ok()? {
                *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(raw);
            }
            Some(())
        });
        Ok(Latest { newest, listens })
    }

    /// A call with one answer.
    pub(super) fn asked<A, B>(
        &mut self,
        path: PathAndQuery,
        request: Request<A>,
        failed: fn(&Status) -> Failure,
    ) -> Result<B, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        self.patiently(path, failed, async |grpc, path| {
            grpc.unary(request, path, ProstCodec::<A, B>::default()).await.map(Response::into_inner)
        })
    }

    /// Messages, and all that is answered to them.
    pub(super) fn exchanged<A, B>(&mut self, path: &'static str, all: Vec<A>) -> Result<Vec<B>, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        self.patiently(PathAndQuery::from_static(path), crate::binary::failure, async |grpc, path| {
            let sent = tokio_stream::iter(all);
            let heard = grpc.streaming(Request::new(sent), path, ProstCodec::<A, B>::default()).await?;
            let (mut heard, mut out) = (heard.into_inner(), Vec::new());
            while let Some(message) = heard.message().await? {
                out.push(message);
            }
            Ok(out)
        })
    }

    /// What a call answers, unless it takes longer than the client waits.
    fn patiently<T>(
        &mut self,
        path: PathAndQuery,
        failed: fn(&Status) -> Failure,
        call: impl AsyncFnOnce(&mut Grpc<Channel>, PathAndQuery) -> Result<T, Status>,
    ) -> Result<T, Failure> {
        let silent = self.silent(path.path().rsplit('/').next().unwrap_or_default());
        let grpc = &mut self.grpc;
        let answer = async {
            grpc.ready().await.map_err(|e| Failure::Lost(format!("the connection was lost: {}", source(&e))))?;
            call(grpc, path).await.map_err(|s| failed(&s))
        };
        within(&self.runtime, self.timeout, answer).unwrap_or(Err(silent))
    }
}

/// The newest of what a server tells by and by.
pub(super) struct Latest {
    newest: Arc<Mutex<Option<Raw>>>,
    listens: JoinHandle<Option<()>>,
}

impl Latest {
    /// What has come since the last time.
    pub fn take(&self) -> Option<Raw> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Waits until all has come, or for so long.
    pub fn ended(&mut self, runtime: &Runtime, time: Duration) {
        let _ = within(runtime, time, &mut self.listens);
    }
}

impl Drop for Latest {
    fn drop(&mut self) {
        self.listens.abort();
    }
}

/// What comes of something, unless it takes longer than that.
pub(super) fn within<F: Future>(runtime: &Runtime, time: Duration, future: F) -> Option<F::Output> {
    runtime.block_on(async { tokio::time::timeout(time, future).await.ok() })
}

/// The innermost reason of an error.
pub(super) fn source(error: &dyn std::error::Error) -> String {
    let mut inner = error;
    while let Some(next) = inner.source() {
        inner = next;
    }
    inner.to_string()
}
