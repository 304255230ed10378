//! Bounded servers on this machine's own address (127.0.0.1): HTTP with server-sent events, and bytes over TCP.
//!
//! A server is one thread that polls all its sockets, so no client can hold up another one or the caller's Ctrl-C: a read or
//! write that is not ready is left for the next turn. Everything a client can make grow has a limit: heads, bodies, answers that
//! nobody reads, connections, and the time that each of them may take.
//!
//! Three ways were compared. `tiny_http` reads heads of any length on as many threads as there are connections and offers no
//! limits. `hyper` has limits, but on an async runtime, while pages and emulators belong to one thread that also moves a model
//! on. Sockets polled here, with heads and chunk sizes parsed by `httparse`, are the smallest of the three: `httparse` is in the
//! build anyway, below `ureq`.

pub mod http;
pub mod tcp;

mod listener;

use std::time::Instant;

/// The time by which limits on clients are judged.
#[allow(clippy::disallowed_methods, reason = "limits on clients are in seconds that pass in the room")]
fn now() -> Instant {
    Instant::now()
}
