//! Addresses of texts, as editors and collectors of findings read them.

/// The scheme of texts that lie nowhere: modules of the library and pages of codes.
pub const SCHEME: &str = "mtx-std";

/// A path with `/` as it stands in an address: what is not unreserved (RFC 3986, section 2.3) as `%` and two digits.
pub fn escape(path: &str) -> String {
    let mut out = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => out.push(char::from(byte)),
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}
