//! Whether a server is encrypted, for a message that says so.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Types of TLS records: an alert, a handshake (RFC 8446, 5.1).
const RECORDS: [u8; 2] = [21, 22];

/// Longest wait for a server that says nothing.
const PATIENCE: Duration = Duration::from_secs(2);

/// Whether a server answers a greeting of TLS 1.2 with a record of TLS: its own greeting, or an alert.
pub(super) fn is_encrypted(address: &str, timeout: Duration) -> bool {
    answer(address, timeout.min(PATIENCE)).is_ok_and(|[kind, major]| RECORDS.contains(&kind) && major == 3)
}

fn answer(address: &str, timeout: Duration) -> std::io::Result<[u8; 2]> {
    let place = address.to_socket_addrs()?.next().ok_or(std::io::ErrorKind::NotFound)?;
    let mut stream = TcpStream::connect_timeout(&place, timeout)?;
    stream.set_read_timeout(Some(timeout))?;
    stream.set_write_timeout(Some(timeout))?;
    stream.write_all(&greeting())?;
    let mut first = [0; 2];
    stream.read_exact(&mut first)?;
    Ok(first)
}

/// A client's greeting: version 1.2, no session, ECDHE with AES-GCM, no compression; the curves x25519 and secp256r1, common
/// signatures, and HTTP/2 (RFC 5246, 7.4.1; RFC 7301).
fn greeting() -> Vec<u8> {
    const EXTENSIONS: [u8; 33] = [
        0, 10, 0, 6, 0, 4, 0, 0x1d, 0, 0x17, // supported_groups
        0, 13, 0, 10, 0, 8, 4, 3, 4, 1, 8, 4, 5, 1, // signature_algorithms
        0, 16, 0, 5, 0, 3, 2, b'h', b'2', // application_layer_protocol_negotiation
    ];
    let mut hello = vec![3, 3];
    hello.extend([7; 32]);
    hello.extend([0, 0, 4, 0xc0, 0x2f, 0xc0, 0x2b, 1, 0, 0, EXTENSIONS.len() as u8]);
    hello.extend(EXTENSIONS);
    let mut out = vec![22, 3, 1, 0, hello.len() as u8 + 4, 1, 0, 0, hello.len() as u8];
    out.extend(hello);
    out
}
