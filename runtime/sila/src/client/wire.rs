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
    pub(super) fn path(&self, index: usize, method: &str) -> Result<PathAndQuery, Failure> {
        let path = format!("/{}/{method}", self.features[index].service());
        PathAndQuery::try_from(path).map_err(|e| Failure::Garbled(e.to_string()))
    }

    pub(super) fn silent(&self, what: &str) -> Failure {
        Failure::Lost(format!("it did not answer `{what}` within {} s", self.timeout.as_secs_f64()))
    }

    pub(super) fn unary<A, B>(&mut self, path: PathAndQuery, message: A) -> Result<B, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        self.patiently(path, async |grpc, path| {
            grpc.unary(Request::new(message), path, ProstCodec::<A, B>::default()).await
        })
    }

    pub(super) fn stream<A, B>(&mut self, path: PathAndQuery, message: A) -> Result<Streaming<B>, Failure>
    where
        A: Message + Send + Sync + 'static,
        B: Message + Default + Send + Sync + 'static,
    {
        self.patiently(path, async |grpc, path| {
            grpc.server_streaming(Request::new(message), path, ProstCodec::<A, B>::default()).await
        })
    }

    /// What a call answers, unless it takes longer than the client waits.
    fn patiently<T>(
        &mut self,
        path: PathAndQuery,
        call: impl AsyncFnOnce(&mut Grpc<Channel>, PathAndQuery) -> Result<Response<T>, Status>,
    ) -> Result<T, Failure> {
        let silent = self.silent(path.path().rsplit('/').next().unwrap_or_default());
        let grpc = &mut self.grpc;
        let answer = async {
            grpc.ready().await.map_err(|e| Failure::Lost(format!("the connection broke off: {}", source(&e))))?;
            call(grpc, path).await.map(Response::into_inner).map_err(|s| Failure::of(&s))
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
