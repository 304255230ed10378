//! A secret that tells who was given the address of a page from any other program or page of this machine.

use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read};

use super::Request;

/// Bytes of chance in a token.
const LENGTH: usize = 16;

/// A secret of one process.
#[derive(Clone, Debug)]
pub struct Token(String);

impl Token {
    /// A new one, from the system's source of chance.
    pub fn new() -> io::Result<Self> {
        let mut bytes = [0; LENGTH];
        File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        Ok(Token(bytes.iter().fold(String::new(), |mut text, byte| {
            // Writing to a text cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })))
    }

    /// Its digits, for the address that is given out: `/?token=...`.
    pub fn digits(&self) -> &str {
        &self.0
    }

    /// Whether a request knows it: as `Authorization: Bearer ...`, or as `token=...` in its query, as browsers ask for pages and
    /// events.
    pub fn is_known_to(&self, request: &Request) -> bool {
        let said = request.header("Authorization").and_then(|v| v.strip_prefix("Bearer "));
        let query = request.target().split_once('?').map(|(_, query)| query).unwrap_or_default();
        let asked = query.split(['&', '#']).find_map(|field| field.strip_prefix("token="));
        said.is_some_and(|t| self.is(t)) || asked.is_some_and(|t| self.is(t))
    }

    /// Compares all of it, so that the time this takes tells nothing of where a guess is wrong.
    fn is(&self, other: &str) -> bool {
        let differences = self.0.bytes().zip(other.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
        self.0.len() == other.len() && differences == 0
    }
}

#[cfg(test)]
mod tests {
    use super::super::head;
    use super::*;

    #[test]
    fn a_request_knows_a_token_by_header_or_query() {
        let token = Token::new().expect("a source of chance");
        let asks = |target: &str, header: &str| {
            let head = head(format!("GET {target} HTTP/1.1\r\nHost: x\r\n{header}\r\n").as_bytes()).expect("a head");
            token.is_known_to(&Request { head, body: Vec::new() })
        };
        assert!(asks("/", &format!("Authorization: Bearer {}\r\n", token.digits())));
        assert!(asks(&format!("/events?a=b&token={}", token.digits()), ""));
        assert!(!asks("/", ""));
        assert!(!asks("/?token=", ""));
        assert!(!asks(&format!("/?token={}", &token.digits()[1..]), ""));
        assert!(!asks(&format!("/?token={}0", token.digits()), ""));
        assert!(!asks("/", &format!("Authorization: Bearer {}\r\n", Token::new().expect("another").digits())));
    }
}
