//! The clients of a server, none of which holds up another.

use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use rustix::event::PollFlags;

use super::answer::event;
use super::connection::Connection;
use super::{Answer, Limits, Request};
use crate::listener::{Accepted, Listener};
use crate::now;

/// Most clients that are let in before those that are in have their turn.
const NEWCOMERS: usize = 32;
/// How long nobody is let in where this process may open no more files and none of its own can be closed.
const PAUSE: Duration = Duration::from_millis(10);

/// Who asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Client(u64);

/// A request, and who is to be answered.
#[derive(Debug)]
pub struct Asked {
    /// For [`Server::answer`].
    pub client: Client,
    /// The whole request.
    pub request: Request,
}

/// A server on this machine's own address.
pub struct Server {
    listener: Listener,
    limits: Limits,
    connections: Vec<Connection>,
    /// The next client's number.
    next: u64,
}

impl Server {
    /// Takes a port of this machine's own address; 0 takes any free one.
    pub fn bind(port: u16, limits: Limits) -> io::Result<Self> {
        Ok(Server { listener: Listener::bind(port)?, limits, connections: Vec::new(), next: 0 })
    }

    /// Where it answers.
    pub fn address(&self) -> SocketAddr {
        self.listener.address()
    }

    /// The next request, waited for so long at most. Answers and events go out here too, so this is to be called again and again.
    pub fn next(&mut self, patience: Duration) -> io::Result<Option<Asked>> {
        if let Some(asked) = self.take() {
            return Ok(Some(asked));
        }
        self.turn(patience)?;
        Ok(self.take())
    }

    /// Answers a request. Who has left, and who was answered, gets nothing.
    pub fn answer(&mut self, client: Client, answer: Answer) {
        let is_full = self.listeners() >= self.limits.listeners;
        let answer = match answer.body {
            None if is_full => Answer::text(503, "too many clients are listening"),
            _ => answer,
        };
        if let Some(connection) = self.find(client).filter(|c| c.is_asked()) {
            connection.answer(answer, now());
        }
    }

    /// Sends an event to one who was answered with [`Answer::events`]; `data` is text of any lines.
    pub fn tell(&mut self, client: Client, name: &str, data: &str) {
        let unread = self.limits.unread;
        if let Some(connection) = self.find(client) {
            connection.tell(&event(name, data), unread, now());
        }
    }

    /// Sends an event to all who listen. One who has left too much unread is dropped; a browser comes back by itself.
    pub fn publish(&mut self, name: &str, data: &str) {
        let (bytes, now) = (event(name, data), now());
        for connection in &mut self.connections {
            connection.tell(&bytes, self.limits.unread, now);
        }
    }

    /// How many listen to events.
    pub fn listeners(&self) -> usize {
        self.connections.iter().filter(|c| c.listens()).count()
    }

    fn find(&mut self, client: Client) -> Option<&mut Connection> {
        self.connections.iter_mut().find(|c| c.id == client.0)
    }

    /// The request that has waited for longest.
    fn take(&mut self) -> Option<Asked> {
        let waiting = self.connections.iter_mut().filter_map(|c| c.waits().map(|since| (since, c.id, c)));
        let (_, id, connection) = waiting.min_by_key(|(since, id, _)| (*since, *id))?;
        Some(Asked { client: Client(id), request: connection.take()? })
    }

    /// Lets every client go on as far as it can.
    fn turn(&mut self, patience: Duration) -> io::Result<()> {
        let wanted: Vec<(usize, PollFlags)> =
            self.connections.iter().map(Connection::wanted).enumerate().filter(|(_, w)| !w.is_empty()).collect();
        let streams: Vec<_> = wanted.iter().map(|(at, wanted)| (self.connections[*at].stream(), *wanted)).collect();
        let ready = self.listener.wait(self.has_room(), &streams, patience)?;
        let now = now();
        for ((at, _), _) in wanted.iter().zip(ready).filter(|(_, is_ready)| *is_ready) {
            self.connections[*at].go_on(&self.limits, now);
        }
        for connection in &mut self.connections {
            connection.judge(&self.limits, now);
        }
        self.connections.retain(|c| !c.is_gone());
        self.bound_bodies();
        self.let_in(now)
    }

    fn bound_bodies(&mut self) {
        let mut sum: usize = self.connections.iter().filter_map(|c| Some(c.unfinished()?.0)).sum();
        while sum > self.limits.bodies {
            let coming = self.connections.iter_mut().filter_map(|c| c.unfinished().map(|(n, since)| (since, n, c)));
            let Some((_, n, oldest)) = coming.min_by_key(|(since, ..)| *since) else { return };
            oldest.drop_it();
            sum -= n;
        }
    }

    fn let_in(&mut self, now: Instant) -> io::Result<()> {
        for _ in 0..NEWCOMERS {
            if !self.has_room() {
                break;
            }
            let stream = match self.listener.accept()? {
                Accepted::Client(stream) => stream,
                Accepted::Nobody => break,
                Accepted::NoRoom => {
                    if !self.make_room() {
                        std::thread::sleep(PAUSE);
                    }
                    break;
                }
            };
            if self.connections.len() >= self.limits.connections {
                self.make_room();
            }
            let mut connection = Connection::new(self.next, stream, now);
            self.next += 1;
            // What it asks is mostly here already: taken now, no newcomer after it can take its place before it was heard.
            connection.go_on(&self.limits, now);
            self.connections.push(connection);
        }
        Ok(())
    }

    /// Whether a newcomer can be let in: not while all who are in have asked and wait for the caller.
    fn has_room(&self) -> bool {
        self.connections.len() < self.limits.connections || self.connections.iter().any(|c| c.rank().is_some())
    }

    /// Drops who keeps others waiting for the least; whether there is one.
    fn make_room(&mut self) -> bool {
        let ranked = self.connections.iter().enumerate().filter_map(|(at, c)| Some((c.rank()?, at)));
        let Some((_, at)) = ranked.min() else { return false };
        self.connections.remove(at);
        true
    }
}
