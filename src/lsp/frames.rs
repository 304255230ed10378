//! Messages of the protocol on a stream. What is no message is passed over and said; only the end of the stream ends it.

use std::io::{self, BufRead, Read};

use lsp_server::Message;

/// Bytes of the longest message that is read; a text of the language has at most two million.
const LONGEST: u64 = 64 << 20;

/// Bytes of the longest line of a header.
const LONGEST_LINE: u64 = 4096;

/// What came in.
#[derive(Debug)]
pub enum Frame {
    /// A message.
    Message(Message),
    /// In words what is wrong with what came instead.
    Broken(String),
}

/// The next message, or nothing where the stream has ended.
pub fn read(stream: &mut impl BufRead) -> Option<Frame> {
    let length = match header(stream)? {
        Ok(length) => length,
        Err(why) => return Some(Frame::Broken(why)),
    };
    if length > LONGEST {
        io::copy(&mut stream.take(length), &mut io::sink()).ok()?;
        return Some(Frame::Broken(format!("a message of {length} bytes is too long: the limit is {LONGEST}")));
    }
    let mut bytes = Vec::new();
    stream.take(length).read_to_end(&mut bytes).ok().filter(|read| *read as u64 == length)?;
    Some(match serde_json::from_slice(&bytes) {
        Ok(message) => Frame::Message(message),
        Err(why) => Frame::Broken(format!("invalid message: {why}")),
    })
}

/// The length that a header tells; nothing at the end of the stream.
fn header(stream: &mut impl BufRead) -> Option<Result<u64, String>> {
    let mut length = None;
    let mut lines = 0;
    loop {
        let mut line = Vec::new();
        let read = stream.take(LONGEST_LINE).read_until(b'\n', &mut line).ok()?;
        if !line.ends_with(b"\n") && (read as u64) < LONGEST_LINE {
            return None;
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim();
        match (line.is_empty(), length) {
            (true, Some(length)) => return Some(Ok(length)),
            // Blank lines between messages say nothing.
            (true, None) if lines == 0 => continue,
            (true, None) => return Some(Err("a header without `Content-Length`".to_string())),
            (false, _) => {}
        }
        lines += 1;
        match line.split_once(':') {
            Some((name, value)) if name.trim().eq_ignore_ascii_case("content-length") => {
                match value.trim().parse() {
                    Ok(bytes) => length = Some(bytes),
                    Err(_) => return Some(Err(format!("`{}` is not a length", value.trim()))),
                };
            }
            Some(_) => {}
            None => return Some(Err("a line that is not a header of a message".to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<String> {
        let mut stream = bytes;
        std::iter::from_fn(|| read(&mut stream))
            .map(|frame| match frame {
                Frame::Message(Message::Notification(n)) => n.method,
                Frame::Message(_) => "other".to_string(),
                Frame::Broken(_) => "broken".to_string(),
            })
            .collect()
    }

    #[test]
    fn what_follows_a_broken_message_is_read() {
        let good = "{\"jsonrpc\":\"2.0\",\"method\":\"exit\"}";
        let good = format!("Content-Length: {}\r\n\r\n{good}", good.len());
        let text = format!("Content-Length: 5\r\n\r\n{{\"a\":{good}nonsense\r\n{good}Content-Length: no\r\n{good}");
        assert_eq!(all(text.as_bytes()), ["broken", "exit", "broken", "exit", "broken", "exit"]);
        assert_eq!(all(&text.as_bytes()[..30]), ["broken"]);
        assert_eq!(all(b"Content-Length: 100\r\n\r\n{}"), [""; 0]);
    }
}
