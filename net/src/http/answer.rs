//! What a request is answered with.

use std::fmt::Write;
use std::sync::Arc;

use super::Refusal;

/// Text in no language.
const PLAIN: &str = "text/plain; charset=utf-8";

/// An answer, or the beginning of a stream of events.
#[derive(Clone, Debug)]
pub struct Answer {
    pub(super) status: u16,
    headers: Vec<(&'static str, &'static str)>,
    /// The body; none of a stream of events.
    pub(super) body: Option<Arc<[u8]>>,
}

impl Answer {
    /// A status with a body of some content type. A body that many ask for is shared, not copied.
    pub fn new(status: u16, kind: &'static str, body: impl Into<Arc<[u8]>>) -> Self {
        Answer { status, headers: vec![("Content-Type", kind)], body: Some(body.into()) }
    }

    /// A status with a line of text.
    pub fn text(status: u16, line: &str) -> Self {
        Answer::new(status, PLAIN, format!("{line}\n").into_bytes())
    }

    /// A stream of events (server-sent events, `text/event-stream`); [`super::Server::publish`] goes on with it.
    pub fn events() -> Self {
        Answer { status: 200, headers: vec![("Content-Type", "text/event-stream")], body: None }
    }

    /// Its status code.
    pub fn status(&self) -> u16 {
        self.status
    }

    /// The answer with one more header.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: &'static str) -> Self {
        self.headers.push((name, value));
        self
    }

    /// What a page of this machine says of itself: it is not kept, not guessed at, and in no frame of another page.
    #[must_use]
    pub fn guarded(self) -> Self {
        self.with("Cache-Control", "no-store").with("X-Content-Type-Options", "nosniff").with("X-Frame-Options", "DENY")
    }

    /// Status line and headers, where the connection stays open or not.
    pub(super) fn head(&self, keeps: bool) -> Vec<u8> {
        let mut text = format!("HTTP/1.1 {} {}\r\n", self.status, reason(self.status));
        for (name, value) in &self.headers {
            // Writing to a text cannot fail.
            let _ = write!(text, "{name}: {value}\r\n");
        }
        match &self.body {
            // No body, no length (RFC 9110, 8.6).
            Some(_) if self.status == 204 => {}
            Some(body) => drop(write!(text, "Content-Length: {}\r\n", body.len())),
            None => text.push_str("Cache-Control: no-store\r\n"),
        }
        let connection = if keeps && self.body.is_some() { "keep-alive" } else { "close" };
        let _ = write!(text, "Connection: {connection}\r\n\r\n");
        text.into_bytes()
    }
}

impl From<&Refusal> for Answer {
    fn from(refusal: &Refusal) -> Answer {
        Answer::text(refusal.status, refusal.why)
    }
}

/// An event of a stream: its lines each with its field.
pub(super) fn event(name: &str, data: &str) -> Vec<u8> {
    let mut text = format!("event: {}\n", name.replace(['\r', '\n'], " "));
    for line in data.split('\n') {
        let _ = writeln!(text, "data: {}", line.replace('\r', ""));
    }
    text.push('\n');
    text.into_bytes()
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        201 => "Created",
        202 => "Accepted",
        204 => "No Content",
        400 => "Bad Request",
        401 => "Unauthorized",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        413 => "Content Too Large",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        500 => "Internal Server Error",
        501 => "Not Implemented",
        503 => "Service Unavailable",
        505 => "HTTP Version Not Supported",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_cannot_be_ended_by_its_own_data() {
        assert_eq!(event("a\nb", "one\r\n\ntwo"), b"event: a b\ndata: one\ndata: \ndata: two\n\n");
    }
}
