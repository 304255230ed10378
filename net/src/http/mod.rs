//! A server that answers one request at a time and sends events to those who listen.
//!
//! The caller's loop takes requests with [`Server::next`] and answers them with [`Server::answer`], at once or later; in between
//! it may [`Server::publish`] events. Nothing blocks for longer than `next` was given.

mod answer;
mod body;
mod connection;
mod head;
mod server;
mod token;

pub use answer::Answer;
pub use body::Body;
pub use head::{Framing, Head, head};
pub use server::{Asked, Client, Server};
pub use token::Token;

use std::time::Duration;

/// Most headers of a request.
pub const MOST_HEADERS: usize = 64;

/// What clients may take of a server. A request over a limit is refused with a status that says so.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at the same time. One more takes the place of the one that has kept its request unfinished for longest.
    pub connections: usize,
    /// Of these, those that listen to events.
    pub listeners: usize,
    /// Bytes of a head: request line and headers.
    pub head: usize,
    /// Bytes of a body.
    pub body: usize,
    /// Bytes of all bodies that are coming in. Over it the request that has been unfinished for longest is dropped.
    pub bodies: usize,
    /// Bytes of events that a listener has not read.
    pub unread: usize,
    /// How long a head or a body may take from its first byte.
    pub request: Duration,
    /// How long a connection may stand idle between requests.
    pub idle: Duration,
    /// How long an answer may go without a byte being read.
    pub stalled: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            connections: 64,
            listeners: 16,
            head: 16 << 10,
            body: 1 << 20,
            bodies: 64 << 20,
            unread: 4 << 20,
            request: Duration::from_secs(20),
            idle: Duration::from_secs(60),
            stalled: Duration::from_secs(30),
        }
    }
}

/// A request that is not served: the status of its answer, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The status code.
    pub status: u16,
    /// The reason, a line.
    pub why: &'static str,
}

impl Refusal {
    const fn new(status: u16, why: &'static str) -> Self {
        Refusal { status, why }
    }
}

/// A whole request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// Request line and headers.
    pub head: Head,
    /// The body; empty where there is none.
    pub body: Vec<u8>,
}

impl Request {
    /// The method, as it was written: `GET`.
    pub fn method(&self) -> &str {
        &self.head.method
    }

    /// The target, with its query: `/a?b=c`.
    pub fn target(&self) -> &str {
        &self.head.target
    }

    /// The target without its query.
    pub fn path(&self) -> &str {
        self.head.target.split(['?', '#']).next().unwrap_or_default()
    }

    /// The first header of this name, in any case.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.head.header(name)
    }

    /// Whether the request was made to this machine by an address of its own. A page from elsewhere whose name was made to point
    /// here (DNS rebinding) names its own host.
    pub fn is_for_this_machine(&self) -> bool {
        self.header("Host").is_some_and(|host| is_own(without_port(host)))
    }

    /// Whether no page of another origin made the request: a browser names the origin of the page that did.
    pub fn is_of_own_origin(&self) -> bool {
        match (self.header("Origin"), self.header("Host")) {
            (None, _) => true,
            (Some(origin), Some(host)) => origin.strip_prefix("http://").is_some_and(|o| o.eq_ignore_ascii_case(host)),
            (Some(_), None) => false,
        }
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    }
}

fn is_own(name: &str) -> bool {
    ["127.0.0.1", "localhost", "[::1]"].iter().any(|own| name.eq_ignore_ascii_case(own))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(lines: &str) -> Request {
        let head = head(format!("GET / HTTP/1.1\r\n{lines}\r\n\r\n").as_bytes()).expect("a head");
        Request { head, body: Vec::new() }
    }

    #[test]
    fn only_names_of_this_machine_are_its_own() {
        for own in ["127.0.0.1", "127.0.0.1:8080", "LocalHost:1", "localhost", "[::1]:80"] {
            assert!(request(&format!("Host: {own}")).is_for_this_machine(), "{own}");
        }
        for foreign in ["lab.example", "127.0.0.1.lab.example:80", "localhost.lab.example", "127.0.0.1:80:x", "", ":80"]
        {
            assert!(!request(&format!("Host: {foreign}")).is_for_this_machine(), "{foreign}");
        }
    }

    #[test]
    fn a_page_of_another_origin_is_told_from_the_servers_own() {
        assert!(request("Host: localhost:80").is_of_own_origin());
        assert!(request("Host: localhost:80\r\nOrigin: http://localhost:80").is_of_own_origin());
        for foreign in ["http://localhost:81", "https://localhost:80", "null", "http://lab.example"] {
            assert!(!request(&format!("Host: localhost:80\r\nOrigin: {foreign}")).is_of_own_origin(), "{foreign}");
        }
    }
}
