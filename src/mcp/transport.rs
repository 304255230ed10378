//! Standard input and output with a bound on what waits to be read by the client. Lines are bounded by rmcp, at 16 MiB.

use std::sync::Arc;

use rmcp::RoleServer;
use rmcp::service::{RxJsonRpcMessage, TxJsonRpcMessage};
use rmcp::transport::{IntoTransport, Transport, stdio};
use tokio::sync::Semaphore;

/// Answers that are on their way at once. While a client has left so many unread, no more is read of it.
const UNREAD: usize = 16;

/// A transport whose reading waits for its writing.
pub struct Bounded<T> {
    inner: T,
    turns: Arc<Semaphore>,
}

/// Standard input and output.
pub fn bounded() -> impl Transport<RoleServer, Error = std::io::Error> {
    Bounded { inner: stdio().into_transport(), turns: Arc::new(Semaphore::new(UNREAD)) }
}

impl<T: Transport<RoleServer>> Transport<RoleServer> for Bounded<T> {
    type Error = T::Error;

    fn send(
        &mut self,
        message: TxJsonRpcMessage<RoleServer>,
    ) -> impl Future<Output = Result<(), T::Error>> + Send + 'static {
        let (sending, turns) = (self.inner.send(message), Arc::clone(&self.turns));
        async move {
            let _turn = turns.acquire_owned().await;
            sending.await
        }
    }

    async fn receive(&mut self) -> Option<RxJsonRpcMessage<RoleServer>> {
        // Turns are given in the order in which they are asked for: those that wait to be sent come first.
        drop(self.turns.acquire().await);
        self.inner.receive().await
    }

    async fn close(&mut self) -> Result<(), T::Error> {
        self.inner.close().await
    }
}
