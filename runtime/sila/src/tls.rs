//! Encryption of connections (part B, "Secure communication"): TLS 1.2 and 1.3, with HTTP/2 inside.

mod certificate;
mod trust;

pub use certificate::{Identity, hosts, own};
pub use trust::Trust;
pub(crate) use trust::{Seen, connector, fingerprint};

use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::CryptoProvider;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::{Error, ServerConfig};

/// The protocol inside, as it is agreed on (RFC 7301).
const HTTP2: &[u8] = b"h2";

/// The algorithms: those of `ring`.
pub(crate) fn provider() -> Arc<CryptoProvider> {
    Arc::new(default_provider())
}

/// What answers clients with a certificate; why it cannot.
pub(crate) fn acceptor(identity: &Identity) -> Result<TlsAcceptor, String> {
    let (chain, key) = identity.read()?;
    let config = ServerConfig::builder_with_provider(provider()).with_safe_default_protocol_versions();
    let config = config.map_err(|e| e.to_string())?.with_no_client_auth().with_single_cert(chain, key);
    let mut config = config.map_err(|e| match e {
        Error::InconsistentKeys(_) => "the certificate and the key do not belong together".to_owned(),
        other => format!("the certificate and the key cannot be used: {other}"),
    })?;
    config.alpn_protocols = vec![HTTP2.to_vec()];
    Ok(TlsAcceptor::from(Arc::new(config)))
}

/// The fingerprint of the first certificate of a text in PEM; nothing where there is none.
pub(crate) fn fingerprint_of(pem: &str) -> Option<String> {
    certificate::chain(pem).ok()?.first().map(|first| fingerprint(first))
}
