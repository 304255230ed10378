//! The chain of a journal: each line carries the digest of the one before, and the first says which journal it is
//! and how many there are.

use std::fs::File;
use std::io::Read;

use sha2::{Digest, Sha256};

/// Bytes of a digest that are kept: 96 bits tell lines apart that differ by accident or by hand.
const KEPT: usize = 12;

/// The first 96 bits of a SHA-256, as hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().take(KEPT).map(|byte| format!("{byte:02x}")).collect()
}

/// A whole SHA-256, as hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// How far a chain goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chain {
    /// What tells its journal from all others, as hexadecimal digits.
    pub id: String,
    /// Lines after the head.
    pub lines: u64,
    /// Digest of the last of them.
    pub last: String,
    /// Devices were made safe without a line that says so: nobody goes on from here.
    pub is_shut: bool,
}

/// Digits of what tells one journal from others.
const ID: usize = 16;

impl Default for Chain {
    /// That of a journal without lines, and without a name.
    fn default() -> Self {
        Chain::named("0".repeat(ID))
    }
}

impl Chain {
    /// That of a journal without lines; the first of them follows its name.
    fn named(id: String) -> Self {
        Chain { lines: 0, last: digest(id.as_bytes()), is_shut: false, id }
    }

    /// That of a new journal, which is none that there was before.
    pub fn fresh() -> std::io::Result<Self> {
        let mut bytes = [0; ID / 2];
        File::open("/dev/urandom")?.read_exact(&mut bytes)?;
        Ok(Chain::named(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Where it began.
    pub fn begun(&self) -> Self {
        Chain::named(self.id.clone())
    }

    /// With one more line, given without its end.
    pub fn grow(&mut self, line: &[u8]) {
        self.lines += 1;
        self.last = digest(line);
    }

    /// The head: always as long, so that it can be written over.
    pub fn head(&self) -> String {
        let state = if self.is_shut { "shut" } else { "open" };
        let Chain { id, lines, last, .. } = self;
        format!(
            "{{\"journal\":\"matterixc\",\"id\":\"{id}\",\"lines\":\"{lines:012}\",\"last\":\"{last}\",\"state\":\"{state}\"}}\n"
        )
    }

    /// What a head says.
    pub fn of_head(line: &[u8]) -> Option<Chain> {
        let text = std::str::from_utf8(line).ok()?;
        let rest = text.strip_prefix("{\"journal\":\"matterixc\",\"id\":\"")?;
        let (id, rest) = rest.split_once("\",\"lines\":\"")?;
        if id.len() != ID || !id.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b)) {
            return None;
        }
        let (lines, rest) = rest.split_once("\",\"last\":\"")?;
        let (last, state) = rest.strip_suffix("\"}\n")?.split_once("\",\"state\":\"")?;
        let (id, last) = (id.to_owned(), last.to_owned());
        let chain = Chain { id, lines: lines.parse().ok()?, last, is_shut: state == "shut" };
        (chain.head() == text).then_some(chain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_says_how_far_the_chain_goes() {
        let mut chain = Chain::default();
        chain.grow(b"a");
        chain.grow(b"b");
        assert_eq!(Chain::of_head(chain.head().as_bytes()), Some(chain.clone()));
        let shut = Chain { is_shut: true, ..chain.clone() };
        assert_eq!(Chain::of_head(shut.head().as_bytes()), Some(shut));
        assert_eq!(chain.head().len(), Chain::default().head().len());
        let (one, other) = (Chain::fresh().expect("random"), Chain::fresh().expect("random"));
        assert!(one.id != other.id && one.last != other.last && one.head().len() == other.head().len());
        assert_eq!(Chain::of_head(&chain.head().as_bytes()[1..]), None);
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
