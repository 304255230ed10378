//! The chain of a journal: each line carries the digest of the one before, and the first says how many there are.

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
    /// Lines after the head.
    pub lines: u64,
    /// Digest of the last of them.
    pub last: String,
    /// Devices were made safe without a line that says so: nobody goes on from here.
    pub is_shut: bool,
}

impl Default for Chain {
    /// That of a journal without lines.
    fn default() -> Self {
        Chain { lines: 0, last: digest(b""), is_shut: false }
    }
}

impl Chain {
    /// With one more line, given without its end.
    pub fn grow(&mut self, line: &[u8]) {
        self.lines += 1;
        self.last = digest(line);
    }

    /// The head: always as long, so that it can be written over.
    pub fn head(&self) -> String {
        let state = if self.is_shut { "shut" } else { "open" };
        let Chain { lines, last, .. } = self;
        format!("{{\"journal\":\"matterixc\",\"lines\":\"{lines:012}\",\"last\":\"{last}\",\"state\":\"{state}\"}}\n")
    }

    /// What a head says.
    pub fn of_head(line: &[u8]) -> Option<Chain> {
        let text = std::str::from_utf8(line).ok()?;
        let rest = text.strip_prefix("{\"journal\":\"matterixc\",\"lines\":\"")?;
        let (lines, rest) = rest.split_once("\",\"last\":\"")?;
        let (last, state) = rest.strip_suffix("\"}\n")?.split_once("\",\"state\":\"")?;
        let chain = Chain { lines: lines.parse().ok()?, last: last.to_owned(), is_shut: state == "shut" };
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
        assert_eq!(Chain::of_head(&chain.head().as_bytes()[1..]), None);
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
