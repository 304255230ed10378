//! The head of a request: request line and headers (RFC 9112).

use super::{MOST_HEADERS, Refusal};

/// How the end of a body is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framing {
    /// By its length, bytes; 0 where there is none.
    Length(usize),
    /// By a chunk of no bytes.
    Chunked,
}

/// Request line and headers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// The method, as it was written.
    pub method: String,
    /// The target, with its query.
    pub target: String,
    /// Names and values, in their order.
    pub headers: Vec<(String, String)>,
    /// How the end of the body is found.
    pub framing: Framing,
    /// Whether another request may follow over the same connection.
    pub keeps: bool,
    /// Whether the client waits for a go-ahead before it sends the body.
    pub waits: bool,
}

impl Head {
    /// The first header of this name, in any case.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, v)| v.as_str())
    }

    fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a str> {
        self.headers.iter().filter(move |(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, v)| v.as_str())
    }

    /// Whether a header that is a list of words has this one.
    fn has(&self, name: &str, word: &str) -> bool {
        self.all(name).flat_map(|v| v.split(',')).any(|w| w.trim().eq_ignore_ascii_case(word))
    }
}

/// Reads a whole head, up to its empty line.
pub fn head(bytes: &[u8]) -> Result<Head, Refusal> {
    let mut fields = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut fields);
    match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => {}
        Err(httparse::Error::TooManyHeaders) => return Err(Refusal::new(431, "too many headers")),
        Err(httparse::Error::Version) => return Err(Refusal::new(505, "only HTTP/1.0 and 1.1 are spoken here")),
        Ok(httparse::Status::Partial) | Err(_) => {
            return Err(Refusal::new(400, "the head of the request is malformed"));
        }
    }
    let text = |h: &httparse::Header<'_>| Some((h.name.to_owned(), std::str::from_utf8(h.value).ok()?.to_owned()));
    let headers: Option<Vec<_>> = parsed.headers.iter().map(text).collect();
    let mut head = Head {
        method: parsed.method.unwrap_or_default().to_owned(),
        target: parsed.path.unwrap_or_default().to_owned(),
        headers: headers.ok_or(Refusal::new(400, "a header is not text"))?,
        framing: Framing::Length(0),
        keeps: false,
        waits: false,
    };
    let is_newer = parsed.version == Some(1);
    if head.all("Host").count() != 1 && (is_newer || head.header("Host").is_some()) {
        return Err(Refusal::new(400, "a request names its host once"));
    }
    head.framing = framing(&head)?;
    head.keeps = !head.has("Connection", "close") && (is_newer || head.has("Connection", "keep-alive"));
    head.waits = is_newer && head.has("Expect", "100-continue");
    Ok(head)
}

/// Two answers to where a body ends would let one request be read as two.
fn framing(head: &Head) -> Result<Framing, Refusal> {
    let lengths: Vec<&str> = head.all("Content-Length").collect();
    let codings: Vec<&str> = head.all("Transfer-Encoding").collect();
    match (lengths.as_slice(), codings.as_slice()) {
        ([], []) => Ok(Framing::Length(0)),
        ([length], []) if !length.is_empty() && length.bytes().all(|b| b.is_ascii_digit()) => {
            // Longer than can be counted is longer than any limit.
            Ok(Framing::Length(length.parse().unwrap_or(usize::MAX)))
        }
        (_, []) => Err(Refusal::new(400, "`Content-Length` is one whole number")),
        ([], [coding]) if coding.eq_ignore_ascii_case("chunked") => Ok(Framing::Chunked),
        ([], _) => Err(Refusal::new(501, "only chunked bodies are read here")),
        (_, _) => Err(Refusal::new(400, "a body has either a length or chunks")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(lines: &str) -> u16 {
        head(format!("{lines}\r\n\r\n").as_bytes()).expect_err("a refusal").status
    }

    #[test]
    fn a_head_is_read_with_how_its_body_ends() {
        let one = head(b"POST /a?b HTTP/1.1\r\nHost: x\r\ncontent-length: 12\r\nExpect: 100-continue\r\n\r\n")
            .expect("a head");
        assert_eq!((one.method.as_str(), one.target.as_str(), one.framing), ("POST", "/a?b", Framing::Length(12)));
        assert!(one.keeps && one.waits);
        let two = head(b"PUT / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: Chunked\r\nConnection: Close\r\n\r\n")
            .expect("a head");
        assert_eq!((two.framing, two.keeps), (Framing::Chunked, false));
        let old = head(b"GET / HTTP/1.0\r\n\r\n").expect("a head");
        assert!(!old.keeps);
    }

    #[test]
    fn what_could_be_read_in_two_ways_is_refused() {
        assert_eq!(status("GET / HTTP/1.1"), 400);
        assert_eq!(status("GET / HTTP/1.1\r\nHost: a\r\nHost: b"), 400);
        assert_eq!(status("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2"), 400);
        assert_eq!(status("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nTransfer-Encoding: chunked"), 400);
        for length in ["+1", "-1", "1 2", "0x10", ""] {
            assert_eq!(status(&format!("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: {length}")), 400, "{length}");
        }
        assert_eq!(status("POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked"), 501);
        assert_eq!(status("GET / HTTP/2.0\r\nHost: a"), 505);
        assert_eq!(status("nonsense"), 400);
        let many = "X: y\r\n".repeat(MOST_HEADERS);
        assert_eq!(status(&format!("GET / HTTP/1.1\r\nHost: a\r\n{many}X: y")), 431);
    }

    #[test]
    fn a_length_that_cannot_be_counted_is_the_longest() {
        let head =
            head(b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999999999999999999999\r\n\r\n").expect("a head");
        assert_eq!(head.framing, Framing::Length(usize::MAX));
    }
}
