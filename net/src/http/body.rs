//! A body as it comes in, in any pieces.

use super::{Framing, Refusal};

/// Longest line before a chunk, bytes: its size, and extensions that are passed over.
const LONGEST_SIZE: usize = 256;
/// Longest headers after the last chunk, bytes; they are passed over.
const LONGEST_TRAILER: usize = 8 << 10;

/// A body, as much of it as is here.
#[derive(Clone, Debug)]
pub struct Body {
    content: Vec<u8>,
    limit: usize,
    at: At,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    /// This many bytes are still to come.
    Length(usize),
    /// Before the size of a chunk.
    Size,
    /// This many bytes of a chunk are still to come.
    Chunk(usize),
    /// Before the line end after a chunk.
    ChunkEnd,
    /// In the headers after the last chunk, of which so many bytes have come.
    Trailer(usize),
    /// After it all.
    End,
}

impl Body {
    /// The body that a head announces, of at most `limit` bytes. Room is made for bytes that come, not for those announced.
    pub fn new(framing: Framing, limit: usize) -> Result<Self, Refusal> {
        let at = match framing {
            Framing::Length(0) => At::End,
            Framing::Length(n) if n > limit => return Err(too_long()),
            Framing::Length(n) => At::Length(n),
            Framing::Chunked => At::Size,
        };
        Ok(Body { content: Vec::new(), limit, at })
    }

    /// Takes what belongs to the body off the front of these bytes and says how many those are.
    pub fn take(&mut self, bytes: &[u8]) -> Result<usize, Refusal> {
        let mut used = 0;
        while self.at != At::End {
            match self.step(&bytes[used..])? {
                Some(n) => used += n,
                None => break,
            }
        }
        Ok(used)
    }

    /// Whether nothing is missing.
    pub fn is_whole(&self) -> bool {
        self.at == At::End
    }

    /// Bytes that are here.
    pub fn len(&self) -> usize {
        self.content.len()
    }

    /// Whether no byte is here.
    pub fn is_empty(&self) -> bool {
        self.content.is_empty()
    }

    /// The bytes that are here.
    pub fn into_content(self) -> Vec<u8> {
        self.content
    }

    /// One step; nothing where more bytes are needed for it.
    fn step(&mut self, bytes: &[u8]) -> Result<Option<usize>, Refusal> {
        match self.at {
            At::Length(left) => Ok(self.copy(bytes, left, |left| if left == 0 { At::End } else { At::Length(left) })),
            At::Chunk(left) => {
                Ok(self.copy(bytes, left, |left| if left == 0 { At::ChunkEnd } else { At::Chunk(left) }))
            }
            At::Size => self.size(bytes),
            At::ChunkEnd => match bytes {
                [b'\r', b'\n', ..] => Ok(self.go(At::Size, 2)),
                [] | [b'\r'] => Ok(None),
                _ => Err(malformed()),
            },
            At::Trailer(before) => self.trailer(bytes, before),
            At::End => Ok(None),
        }
    }

    fn go(&mut self, at: At, used: usize) -> Option<usize> {
        self.at = at;
        Some(used)
    }

    fn copy(&mut self, bytes: &[u8], left: usize, then: impl Fn(usize) -> At) -> Option<usize> {
        let n = left.min(bytes.len());
        if n == 0 {
            return None;
        }
        self.content.extend_from_slice(&bytes[..n]);
        self.go(then(left - n), n)
    }

    fn size(&mut self, bytes: &[u8]) -> Result<Option<usize>, Refusal> {
        let line = &bytes[..bytes.len().min(LONGEST_SIZE)];
        let size = match httparse::parse_chunk_size(line) {
            Ok(httparse::Status::Complete(size)) => size,
            Ok(httparse::Status::Partial) if line.len() < LONGEST_SIZE => return Ok(None),
            Ok(httparse::Status::Partial) | Err(_) => return Err(malformed()),
        };
        match size {
            (used, 0) => Ok(self.go(At::Trailer(0), used)),
            (used, n) => {
                let n = usize::try_from(n).unwrap_or(usize::MAX);
                if n > self.limit - self.content.len() {
                    return Err(too_long());
                }
                Ok(self.go(At::Chunk(n), used))
            }
        }
    }

    fn trailer(&mut self, bytes: &[u8], before: usize) -> Result<Option<usize>, Refusal> {
        match bytes.iter().position(|b| *b == b'\n') {
            Some(0) => Ok(self.go(At::End, 1)),
            Some(1) if bytes[0] == b'\r' => Ok(self.go(At::End, 2)),
            Some(end) if before + end < LONGEST_TRAILER => Ok(self.go(At::Trailer(before + end + 1), end + 1)),
            None if before + bytes.len() < LONGEST_TRAILER => Ok(None),
            _ => Err(Refusal::new(431, "the headers after the body are too long")),
        }
    }
}

fn too_long() -> Refusal {
    Refusal::new(413, "the body is too long")
}

fn malformed() -> Refusal {
    Refusal::new(400, "the chunks of the body are malformed")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The body and the bytes after it.
    type Whole = (Vec<u8>, Vec<u8>);

    /// A whole body that comes in pieces of some size.
    fn read(framing: Framing, limit: usize, bytes: &[u8], size: usize) -> Result<Option<Whole>, Refusal> {
        let mut body = Body::new(framing, limit)?;
        let mut input = Vec::new();
        for piece in bytes.chunks(size.max(1)) {
            input.extend_from_slice(piece);
            let used = body.take(&input)?;
            input.drain(..used);
        }
        Ok(body.is_whole().then(|| (body.into_content(), input)))
    }

    #[test]
    fn chunks_are_put_together_and_the_next_request_is_left() {
        let bytes = b"4;note=x\r\nWiki\r\n05\r\npedia\r\n0\r\nTrailer: x\r\n\r\nGET";
        for size in 1..bytes.len() {
            let (body, rest) = read(Framing::Chunked, 100, bytes, size).expect("well formed").expect("whole");
            assert_eq!((body.as_slice(), rest.as_slice()), (&b"Wikipedia"[..], &b"GET"[..]), "{size}");
        }
    }

    #[test]
    fn a_body_over_the_limit_is_refused_before_it_comes() {
        let status = |framing, bytes: &[u8]| read(framing, 8, bytes, 1).expect_err("a refusal").status;
        assert_eq!(status(Framing::Length(9), b""), 413);
        assert_eq!(status(Framing::Length(usize::MAX), b""), 413);
        assert_eq!(status(Framing::Chunked, b"9\r\n"), 413);
        assert_eq!(status(Framing::Chunked, b"ffffffffffffffff\r\n"), 413);
        assert_eq!(status(Framing::Chunked, b"8\r\n12345678\r\n1\r\n"), 413);
    }

    #[test]
    fn endless_sizes_and_trailers_are_refused() {
        let status = |bytes: &[u8]| read(Framing::Chunked, 8, bytes, 7).expect_err("a refusal").status;
        assert_eq!(status(format!("1;{}", "x".repeat(LONGEST_SIZE)).as_bytes()), 400);
        assert_eq!(status(format!("0\r\n{}", "x".repeat(LONGEST_TRAILER + 7)).as_bytes()), 431);
        assert_eq!(status(format!("0\r\n{}", "a: b\r\n".repeat(LONGEST_TRAILER / 4)).as_bytes()), 431);
        assert_eq!(status(b"1\r\nab\r\n"), 400);
        assert_eq!(status(b"g\r\n"), 400);
    }

    #[test]
    fn a_body_that_breaks_off_is_not_whole() {
        assert_eq!(read(Framing::Length(5), 8, b"1234", 1), Ok(None));
        assert_eq!(read(Framing::Chunked, 8, b"4\r\n1234\r\n", 1), Ok(None));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_the_same_in_any_pieces(bytes in proptest::collection::vec("[0-3af;\r\nx]{0,9}", 0..20), size in 1_usize..9) {
            let bytes = bytes.concat().into_bytes();
            let whole = read(Framing::Chunked, 16, &bytes, bytes.len());
            prop_assert_eq!(read(Framing::Chunked, 16, &bytes, size), whole);
        }
    }
}
