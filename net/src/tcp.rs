//! Bytes over TCP, as a device server hands on a serial line: several clients, each with a line of its own.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;

use crate::listener::{Accepted, Listener, Moved, moved};
use crate::now;

/// Most bytes that are read at a time.
const TURN: usize = 4 << 10;
/// How long nobody is let in where this process may open no more files.
const PAUSE: Duration = Duration::from_millis(10);

/// What clients may take of a server.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at the same time. One more takes the place of one that never said anything, or else of
    /// the one that has said nothing for longest.
    pub connections: usize,
    /// Bytes that a client has not read; over it, it is dropped. While any are unread nothing more is read from it.
    pub unread: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { connections: 16, unread: 1 << 20 }
    }
}

/// One of the clients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Client(u64);

/// What came of a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// It sent these bytes.
    Said(Client, Vec<u8>),
    /// It has left, or was dropped.
    Left(Client),
}

struct Connection {
    client: Client,
    stream: TcpStream,
    output: Vec<u8>,
    since: Instant,
    has_spoken: bool,
    is_gone: bool,
}

impl Connection {
    fn send(&mut self) {
        while !self.output.is_empty() {
            match moved(|| self.stream.write(&self.output)) {
                Moved::Bytes(n) => drop(self.output.drain(..n)),
                Moved::NotNow => return,
                Moved::Ended => {
                    self.is_gone = true;
                    return;
                }
            }
        }
    }

    fn read(&mut self, now: Instant) -> Option<Vec<u8>> {
        let mut buffer = [0; TURN];
        match moved(|| self.stream.read(&mut buffer)) {
            Moved::Bytes(n) => {
                (self.since, self.has_spoken) = (now, true);
                Some(buffer[..n].to_vec())
            }
            Moved::NotNow => None,
            Moved::Ended => {
                self.is_gone = true;
                None
            }
        }
    }
}

/// A server of bytes on this machine's own address.
pub struct Server {
    listener: Listener,
    limits: Limits,
    connections: Vec<Connection>,
    heard: VecDeque<Heard>,
    next: u64,
}

impl Server {
    /// Takes a port of this machine's own address; 0 takes any free one.
    pub fn bind(port: u16, limits: Limits) -> io::Result<Self> {
        let listener = Listener::bind(port)?;
        Ok(Server { listener, limits, connections: Vec::new(), heard: VecDeque::new(), next: 0 })
    }

    /// Where it answers.
    pub fn address(&self) -> SocketAddr {
        self.listener.address()
    }

    /// What came next, waited for so long at most. Bytes go out here too, so this is to be called again and again.
    pub fn next(&mut self, patience: Duration) -> io::Result<Option<Heard>> {
        if self.heard.is_empty() {
            self.turn(patience)?;
        }
        Ok(self.heard.pop_front())
    }

    /// Sends bytes to a client that is still there.
    pub fn send(&mut self, client: Client, bytes: &[u8]) {
        let unread = self.limits.unread;
        if let Some(connection) = self.connections.iter_mut().find(|c| c.client == client) {
            connection.output.extend_from_slice(bytes);
            connection.send();
            connection.is_gone |= connection.output.len() > unread;
        }
    }

    /// Sends bytes to all.
    pub fn publish(&mut self, bytes: &[u8]) {
        let clients: Vec<Client> = self.connections.iter().map(|c| c.client).collect();
        clients.into_iter().for_each(|c| self.send(c, bytes));
    }

    fn turn(&mut self, patience: Duration) -> io::Result<()> {
        let wanted = |c: &Connection| if c.output.is_empty() { PollFlags::IN } else { PollFlags::OUT };
        let streams: Vec<_> = self.connections.iter().map(|c| (&c.stream, wanted(c))).collect();
        let ready = self.listener.wait(true, &streams, patience)?;
        let now = now();
        for (connection, _) in self.connections.iter_mut().zip(ready).filter(|(_, is_ready)| *is_ready) {
            if !connection.output.is_empty() {
                connection.send();
            } else if let Some(bytes) = connection.read(now) {
                self.heard.push_back(Heard::Said(connection.client, bytes));
            }
        }
        let heard = &mut self.heard;
        self.connections.retain(|c| {
            if c.is_gone {
                heard.push_back(Heard::Left(c.client));
            }
            !c.is_gone
        });
        self.let_in(now)
    }

    fn let_in(&mut self, now: Instant) -> io::Result<()> {
        for _ in 0..self.limits.connections.div_ceil(4) {
            let stream = match self.listener.accept()? {
                Accepted::Client(stream) => stream,
                Accepted::Nobody => return Ok(()),
                Accepted::NoRoom => {
                    self.make_room();
                    std::thread::sleep(PAUSE);
                    return Ok(());
                }
            };
            if self.connections.len() >= self.limits.connections {
                self.make_room();
            }
            let client = Client(self.next);
            self.next += 1;
            let (output, has_spoken, is_gone) = (Vec::new(), false, false);
            self.connections.push(Connection { client, stream, output, since: now, has_spoken, is_gone });
        }
        Ok(())
    }

    /// Drops the client that has said nothing for longest; one that never said anything goes before all others.
    fn make_room(&mut self) {
        let oldest = self.connections.iter().enumerate().min_by_key(|(_, c)| (c.has_spoken, c.since, c.client));
        if let Some(at) = oldest.map(|(at, _)| at) {
            self.heard.push_back(Heard::Left(self.connections.remove(at).client));
        }
    }
}
