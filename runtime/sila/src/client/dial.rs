//! Connections to a server, encrypted or not.

use std::future::Future;
use std::io::{self, Error};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::runtime::Runtime;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::Error as TlsError;
use tokio_rustls::rustls::pki_types::ServerName;
use tonic::transport::Uri;

use super::wire::within;
use crate::call::Failure;
use crate::tls::{Seen, Trust, connector};

/// Longest wait for a server that is only looked at.
const GLANCE: Duration = Duration::from_secs(2);

/// A connection.
pub(super) trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Stream for T {}

/// Connects once. A connection that is gone is not made again in silence: nobody knows what became of the device meanwhile.
#[derive(Clone)]
pub(super) struct Dial {
    place: String,
    tls: Option<(TlsConnector, ServerName<'static>)>,
    once: Arc<AtomicBool>,
    /// What was shown by a server that is not trusted.
    pub seen: Seen,
}

impl Dial {
    /// To `HOST:PORT`; why nobody there can be trusted.
    pub fn new(place: &str, trust: &Trust) -> Result<Dial, String> {
        let seen = Seen::default();
        let tls = match trust {
            Trust::Plain => None,
            trust => Some((connector(trust, &seen)?, host(place)?)),
        };
        Ok(Dial { place: place.to_owned(), tls, once: Arc::default(), seen })
    }

    /// Where calls go: the scheme says whether they are encrypted.
    pub fn uri(&self) -> String {
        format!("http{}://{}", if self.tls.is_some() { "s" } else { "" }, self.place)
    }

    /// The certificate of a server that is not trusted, with why.
    pub fn distrusted(&self) -> Option<String> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    async fn open(self) -> io::Result<TokioIo<Box<dyn Stream>>> {
        if self.once.swap(true, Ordering::SeqCst) {
            return Err(Error::other("it was closed"));
        }
        let stream = TcpStream::connect(&self.place).await?;
        stream.set_nodelay(true)?;
        let stream: Box<dyn Stream> = match self.tls {
            None => Box::new(stream),
            Some((tls, host)) => Box::new(tls.connect(host, stream).await?),
        };
        Ok(TokioIo::new(stream))
    }
}

impl tower::Service<Uri> for Dial {
    type Response = TokioIo<Box<dyn Stream>>;
    type Error = Error;
    type Future = Pin<Box<dyn Future<Output = io::Result<Self::Response>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, _: Uri) -> Self::Future {
        Box::pin(self.clone().open())
    }
}

/// The name or the number in `HOST:PORT` that a certificate must be for.
fn host(place: &str) -> Result<ServerName<'static>, String> {
    let host = place.rsplit_once(':').map_or(place, |(host, _)| host);
    let host = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(host);
    ServerName::try_from(host.to_owned()).map_err(|_| format!("`{host}` is not a host name"))
}

/// What to say of a server that did not answer without encryption, where it would answer with it.
pub(super) fn encrypted(runtime: &Runtime, place: &str, timeout: Duration) -> Option<Failure> {
    let seen = Seen::default();
    let (tls, host) = (connector(&Trust::Plain, &seen).ok()?, host(place).ok()?);
    let ended = within(runtime, timeout.min(GLANCE), async {
        let stream = TcpStream::connect(place).await?;
        tls.connect(host, stream).await.map(|_| ())
    });
    let shown = seen.lock().unwrap_or_else(PoisonError::into_inner).take();
    let error = ended?.err()?;
    let kind = error.get_ref().and_then(|inner| inner.downcast_ref::<TlsError>());
    let is_tls = |e: &TlsError| matches!(e, TlsError::AlertReceived(_) | TlsError::PeerIncompatible(_));
    let how = match (shown, kind) {
        (Some(shown), _) => {
            let fingerprint = shown.split(' ').next().unwrap_or_default();
            format!(
                "but its certificate is not trusted. It has the fingerprint {fingerprint}: compare it with that of the server, and trust it with `fingerprint = \"{fingerprint}\"`"
            )
        }
        (None, Some(error)) if is_tls(error) => "but supports neither TLS 1.2 nor 1.3".to_owned(),
        _ => return None,
    };
    Some(Failure::Garbled(format!("the server at `{place}` is encrypted (TLS), {how}")))
}

/// Whether a connection could not be encrypted because the other side does not speak TLS.
pub(super) fn is_plain(error: &(dyn std::error::Error + 'static)) -> bool {
    let mut inner = Some(error);
    while let Some(error) = inner {
        if let Some(io) = error.downcast_ref::<Error>() {
            let tls = io.get_ref().and_then(|e| e.downcast_ref::<TlsError>());
            let hung_up = matches!(io.kind(), io::ErrorKind::UnexpectedEof | io::ErrorKind::ConnectionReset);
            return hung_up || matches!(tls, Some(TlsError::InvalidMessage(_)));
        }
        inner = error.source();
    }
    false
}
