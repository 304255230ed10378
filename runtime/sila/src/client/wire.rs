//! Single calls of gRPC, none of which lasts longer than the client's patience.

use std::future::Future;
use std::time::Duration;

use http::uri::PathAndQuery;
use prost::Message;
use tokio::runtime::Runtime;
use tonic::client::Grpc;
use tonic::transport::Channel;
use tonic::{Request, Response, Status, Streaming};
use tonic_prost::ProstCodec;

use super::Client;
use crate::call::Failure;

impl Client {
    pub(super) fn silent(&self, what: &str) -> Failure {
        Failure::Lost(format!("it did not answer `{what}` within {} s", self.timeout.as_secs_f64()))
    }

    /// A call of a method of a feature, and what goes beside it.
    fn request<A>(&self, index: usize, method: &str, message: A) -> Result<(PathAndQuery, Request<A>), Failure> {
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
            self.beside.iter().for_each(|b| b.add(&called, request.metadata_mut()));
        }
        Ok((path, request))
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
            grpc.ready().await.map_err(|e| Failure::Lost(format!("the connection broke off: {}", source(&e))))?;
            call(grpc, path).await.map_err(|s| failed(&s))
        };
        within(&self.runtime, self.timeout, answer).unwrap_or(Err(silent))
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
