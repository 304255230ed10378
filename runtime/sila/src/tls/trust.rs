//! Which servers a client trusts: those with a certificate that it knows, or that was signed by one that it knows.

use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::client::WebPkiServerVerifier;
use tokio_rustls::rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use tokio_rustls::rustls::crypto::{CryptoProvider, verify_tls12_signature, verify_tls13_signature};
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use tokio_rustls::rustls::{
    CertificateError, ClientConfig, DigitallySignedStruct, Error, RootCertStore, SignatureScheme,
};

/// Whom a client speaks to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Trust {
    /// Whoever answers, without encryption.
    #[default]
    Plain,
    /// A server that shows one of these certificates, or one for its host that one of these has signed; in PEM.
    Certificates(String),
    /// The server whose certificate has this SHA-256.
    Fingerprint([u8; 32]),
}

/// The fingerprint of the certificate that a server has shown, and why it is not trusted.
pub(crate) type Seen = Arc<Mutex<Option<String>>>;

/// What makes connections that keep to a trust; without one nobody is trusted, and only seen. Why it cannot be made.
pub(crate) fn connector(trust: &Trust, seen: &Seen) -> Result<TlsConnector, String> {
    let provider = super::provider();
    let mut judge = Judge { known: Vec::new(), digest: None, signed: None, provider, seen: Arc::clone(seen) };
    match trust {
        Trust::Plain => {}
        Trust::Fingerprint(digest) => judge.digest = Some(*digest),
        Trust::Certificates(pem) => {
            judge.known = super::certificate::chain(pem)?;
            let mut roots = RootCertStore::empty();
            // One that is no authority signs nothing, and is trusted as it is.
            roots.add_parsable_certificates(judge.known.iter().cloned());
            if !roots.is_empty() {
                let built = WebPkiServerVerifier::builder_with_provider(Arc::new(roots), super::provider()).build();
                judge.signed = Some(built.map_err(|e| e.to_string())?);
            }
        }
    }
    let config = ClientConfig::builder_with_provider(super::provider()).with_safe_default_protocol_versions();
    let config = config.map_err(|e| e.to_string())?.dangerous().with_custom_certificate_verifier(Arc::new(judge));
    let mut config = config.with_no_client_auth();
    config.alpn_protocols = vec![super::HTTP2.to_vec()];
    Ok(TlsConnector::from(Arc::new(config)))
}

/// The SHA-256 of a certificate: `AB:01:...`.
pub(crate) fn fingerprint(certificate: &CertificateDer<'_>) -> String {
    let mut out = String::new();
    for byte in Sha256::digest(certificate) {
        // Writing to a text cannot fail.
        let _ = write!(out, "{}{byte:02X}", if out.is_empty() { "" } else { ":" });
    }
    out
}

#[derive(Debug)]
struct Judge {
    known: Vec<CertificateDer<'static>>,
    digest: Option<[u8; 32]>,
    signed: Option<Arc<WebPkiServerVerifier>>,
    provider: Arc<CryptoProvider>,
    seen: Seen,
}

impl ServerCertVerifier for Judge {
    fn verify_server_cert(
        &self,
        shown: &CertificateDer<'_>,
        between: &[CertificateDer<'_>],
        host: &ServerName<'_>,
        ocsp: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let is_known = self.known.iter().any(|known| known == shown)
            || self.digest.is_some_and(|digest| Sha256::digest(shown).as_slice() == digest);
        if is_known {
            return Ok(ServerCertVerified::assertion());
        }
        let why = match &self.signed {
            Some(signed) => match signed.verify_server_cert(shown, between, host, ocsp, now) {
                Ok(verified) => return Ok(verified),
                Err(Error::InvalidCertificate(why)) => format!("{why:?}"),
                Err(other) => other.to_string(),
            },
            None => "it is another certificate".to_owned(),
        };
        *self.seen.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{} ({why})", fingerprint(shown)));
        Err(Error::InvalidCertificate(CertificateError::ApplicationVerificationFailure))
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls12_signature(message, certificate, signed, &self.provider.signature_verification_algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls13_signature(message, certificate, signed, &self.provider.signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider.signature_verification_algorithms.supported_schemes()
    }
}
