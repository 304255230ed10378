//! The certificate that a server shows: its own, or one that it was given.

use std::net::IpAddr;

use rcgen::{
    CertificateParams, CustomExtension, DistinguishedName, DnType, ExtendedKeyUsagePurpose, KeyPair, date_time_ymd,
};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};

/// The common name of certificates that nobody has signed (part B, "Untrusted certificates").
const NAME: &str = "SiLA2";

/// The extension of certificates that holds the server's UUID as ASCII: the number of the SiLA consortium.
const UUID: [u64; 7] = [1, 3, 6, 1, 4, 1, 58583];

/// A certificate and its key, in PEM.
#[derive(Clone, PartialEq, Eq)]
pub struct Identity {
    /// The certificate, then those that signed it.
    pub chain: String,
    /// The private key.
    pub key: String,
}

impl std::fmt::Debug for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Identity").field("chain", &self.chain).finish_non_exhaustive()
    }
}

impl Identity {
    pub(super) fn read(&self) -> Result<(Vec<CertificateDer<'static>>, PrivateKeyDer<'static>), String> {
        let chain = chain(&self.chain)?;
        let key = PrivateKeyDer::from_pem_slice(self.key.as_bytes());
        Ok((chain, key.map_err(|e| format!("the private key cannot be read: {e}"))?))
    }

    /// The SHA-256 of the certificate, as `openssl x509 -fingerprint -sha256` writes it: `AB:01:...`.
    pub fn fingerprint(&self) -> Result<String, String> {
        super::fingerprint_of(&self.chain).ok_or_else(|| "it has no certificate".to_owned())
    }

    /// Whether clients can be answered with it; why not.
    pub fn is_sound(&self) -> Result<(), String> {
        super::acceptor(self).map(|_| ())
    }
}

/// The certificates of a text in PEM, at least one.
pub(super) fn chain(pem: &str) -> Result<Vec<CertificateDer<'static>>, String> {
    let all: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(pem.as_bytes()).collect();
    let all = all.map_err(|e| format!("the certificate cannot be read: {e}"))?;
    if all.is_empty() {
        return Err("it contains no certificate in PEM (`-----BEGIN CERTIFICATE-----`)".to_owned());
    }
    Ok(all)
}

/// A new certificate that the server signs itself, for these names and addresses of hosts.
pub fn own(uuid: &str, hosts: &[String]) -> Result<Identity, String> {
    let failed = |e: rcgen::Error| format!("cannot make a certificate: {e}");
    let mut params = CertificateParams::new(hosts.to_vec()).map_err(failed)?;
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, NAME);
    // The last year that is written with two digits (RFC 5280, 4.1.2.5): whoever trusts it knows its fingerprint.
    (params.not_before, params.not_after) = (date_time_ymd(2020, 1, 1), date_time_ymd(2049, 12, 31));
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    params.custom_extensions = vec![CustomExtension::from_oid_content(&UUID, uuid.as_bytes().to_vec())];
    let key = KeyPair::generate().map_err(failed)?;
    let certificate = params.self_signed(&key).map_err(failed)?;
    Ok(Identity { chain: certificate.pem(), key: key.serialize_pem() })
}

/// The names and addresses by which clients may call a server that answers at `host`: its own, and all of the machine where it
/// answers at all of them.
pub fn hosts(host: &str, address: IpAddr) -> Vec<String> {
    let mut all = vec!["localhost".to_owned(), "127.0.0.1".to_owned(), "::1".to_owned()];
    if address.is_unspecified() {
        // Without a network the machine is reached by its own addresses only.
        let own = if_addrs::get_if_addrs().unwrap_or_default();
        all.extend(own.iter().map(|interface| interface.ip().to_string()));
    } else {
        all.extend([host.to_owned(), address.to_string()]);
    }
    let mut known = std::collections::BTreeSet::new();
    all.retain(|name| known.insert(name.clone()));
    all
}

#[cfg(test)]
mod tests {
    use super::own;

    #[test]
    fn an_own_certificate_is_sound_and_has_a_fingerprint() {
        let hosts = ["localhost".to_owned(), "127.0.0.1".to_owned()];
        let identity = own("7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11", &hosts).expect("it is made");
        identity.is_sound().expect("clients can be answered");
        let written = identity.fingerprint().expect("it has one");
        assert_eq!(written.len(), 95);
        let other = own("7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11", &hosts).expect("it is made");
        let mixed = super::Identity { chain: identity.chain, key: other.key };
        assert!(mixed.is_sound().is_err_and(|why| why.contains("do not belong together")));
    }
}
