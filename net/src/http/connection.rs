//! One client: what it has sent of a request, and what it has not read of an answer.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::event::PollFlags;

use super::{Answer, Body, Head, Limits, Refusal, Request, head};
use crate::listener::{Moved, moved};

/// Most bytes that are read or written before it is another client's turn.
const TURN: usize = 64 << 10;
/// How long and for how many bytes a client that was refused is listened to, so that it gets to read why.
const LINGER: (Duration, usize) = (Duration::from_secs(1), 1 << 20);

const GO_AHEAD: &[u8] = b"HTTP/1.1 100 Continue\r\n\r\n";

/// Where a client is.
enum State {
    /// In a head, or before it.
    Head,
    /// In a body.
    Body(Head, Body),
    /// A request waits for the caller.
    Ready(Request),
    /// The caller is to answer.
    Asked,
    /// An answer is being read.
    Answering,
    /// Events are being read.
    Listening,
    /// It was told to go; so many bytes that it still sent were thrown away.
    Leaving(usize),
    Gone,
}

pub(super) struct Connection {
    pub(super) id: u64,
    stream: TcpStream,
    state: State,
    input: Vec<u8>,
    /// Bytes of the input in which a head does not end.
    scanned: usize,
    output: Output,
    /// Since when it has been where it is: the first byte of a request, the last byte of an answer that was read.
    since: Instant,
    /// Whether a request of it was answered.
    was_served: bool,
    /// Whether another request may follow the one at hand.
    keeps: bool,
    /// Whether only the head of the answer is asked for.
    is_head: bool,
    /// Whether the client has said all that it will.
    ended: bool,
}

/// Bytes on their way out: those of its own, then those that it shares.
#[derive(Default)]
struct Output {
    own: Vec<u8>,
    shared: Option<Arc<[u8]>>,
    /// Bytes of both that are out.
    at: usize,
}

impl Output {
    fn left(&self) -> &[u8] {
        match (self.own.get(self.at..), &self.shared) {
            (Some(own), _) if !own.is_empty() => own,
            (_, Some(shared)) => shared.get(self.at - self.own.len()..).unwrap_or_default(),
            (_, None) => &[],
        }
    }

    fn advance(&mut self, n: usize) {
        self.at += n;
        if self.left().is_empty() {
            *self = Output::default();
        }
    }
}

impl Connection {
    pub(super) fn new(id: u64, stream: TcpStream, now: Instant) -> Self {
        Connection {
            id,
            stream,
            state: State::Head,
            input: Vec::new(),
            scanned: 0,
            output: Output::default(),
            since: now,
            was_served: false,
            keeps: true,
            is_head: false,
            ended: false,
        }
    }

    pub(super) fn stream(&self) -> &TcpStream {
        &self.stream
    }

    /// What the socket is waited for; nothing while the caller has the request.
    pub(super) fn wanted(&self) -> PollFlags {
        let writes = if self.output.left().is_empty() { PollFlags::empty() } else { PollFlags::OUT };
        match self.state {
            State::Head | State::Body(..) | State::Listening | State::Leaving(_) => PollFlags::IN | writes,
            State::Answering => PollFlags::OUT,
            State::Ready(_) | State::Asked | State::Gone => PollFlags::empty(),
        }
    }

    /// Reads and writes what is ready.
    pub(super) fn go_on(&mut self, limits: &Limits, now: Instant) {
        self.write(now);
        match self.state {
            State::Head | State::Body(..) => self.listen(limits, now),
            State::Listening | State::Leaving(_) => self.pass_over(),
            _ => {}
        }
    }

    /// Goes on with a request. More is read only where what is here does not make a whole one, so what a client sends ahead
    /// stays in its socket.
    fn listen(&mut self, limits: &Limits, now: Instant) {
        self.understand(limits, now);
        if matches!(self.state, State::Head | State::Body(..)) {
            self.read(now);
            self.understand(limits, now);
        }
    }

    fn read(&mut self, now: Instant) {
        let before = self.input.len();
        let mut buffer = [0; TURN];
        match moved(|| self.stream.read(&mut buffer)) {
            Moved::Bytes(n) => self.input.extend_from_slice(&buffer[..n]),
            Moved::NotNow => {}
            Moved::Ended => self.ended = true,
        }
        // The time of a head runs from its first byte.
        if before == 0 && !self.input.is_empty() && matches!(self.state, State::Head) {
            self.since = now;
        }
    }

    /// Takes a request out of what has come in, or as much of one as is there.
    fn understand(&mut self, limits: &Limits, now: Instant) {
        if let Err(refusal) = self.parse(limits, now) {
            self.refuse(&refusal, now);
        } else if self.ended && matches!(self.state, State::Head | State::Body(..)) {
            self.state = State::Gone;
        }
    }

    fn parse(&mut self, limits: &Limits, now: Instant) -> Result<(), Refusal> {
        if matches!(self.state, State::Head) {
            let Some(head) = self.take_head(limits.head)? else { return Ok(()) };
            (self.keeps, self.is_head, self.since) = (head.keeps, head.method == "HEAD", now);
            let body = Body::new(head.framing, limits.body)?;
            if head.waits && !body.is_whole() && self.input.is_empty() {
                self.output.own.extend_from_slice(GO_AHEAD);
            }
            self.state = State::Body(head, body);
        }
        let State::Body(_, body) = &mut self.state else { return Ok(()) };
        let used = body.take(&self.input)?;
        self.input.drain(..used);
        if body.is_whole()
            && let State::Body(head, body) = std::mem::replace(&mut self.state, State::Asked)
        {
            self.since = now;
            self.state = State::Ready(Request { head, body: body.into_content() });
        }
        Ok(())
    }

    fn take_head(&mut self, limit: usize) -> Result<Option<Head>, Refusal> {
        if self.scanned == 0 {
            // Empty lines before a request are passed over (RFC 9112, 2.2).
            let empty = self.input.iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
            self.input.drain(..empty);
        }
        let end = end_of_head(&self.input, self.scanned);
        self.scanned = self.input.len();
        if end.unwrap_or(self.input.len()) > limit {
            return Err(Refusal::new(431, "the head of the request is too long"));
        }
        let Some(end) = end else { return Ok(None) };
        let bytes: Vec<u8> = self.input.drain(..end).collect();
        self.scanned = 0;
        head(&bytes).map(Some)
    }

    /// The request that waits for the caller, and since when.
    pub(super) fn waits(&self) -> Option<Instant> {
        matches!(self.state, State::Ready(_)).then_some(self.since)
    }

    pub(super) fn take(&mut self) -> Option<Request> {
        match std::mem::replace(&mut self.state, State::Asked) {
            State::Ready(request) => Some(request),
            other => {
                self.state = other;
                None
            }
        }
    }

    pub(super) fn is_asked(&self) -> bool {
        matches!(self.state, State::Asked)
    }

    /// Begins the answer to the request that was taken.
    pub(super) fn answer(&mut self, answer: Answer, now: Instant) {
        self.output.own.extend(answer.head(self.keeps));
        self.state = if answer.body.is_some() || self.is_head { State::Answering } else { State::Listening };
        self.output.shared = answer.body.filter(|b| !self.is_head && !b.is_empty() && answer.status != 204);
        self.since = now;
        self.send(now);
    }

    /// Answers a request that is not served, after which nothing can be told of what follows it.
    fn refuse(&mut self, refusal: &Refusal, now: Instant) {
        (self.keeps, self.is_head) = (false, false);
        self.input = Vec::new();
        self.answer(Answer::from(refusal), now);
    }

    /// Adds to the events that a listener reads; one that has left too many unread is dropped.
    pub(super) fn tell(&mut self, event: &[u8], unread: usize, now: Instant) {
        if !matches!(self.state, State::Listening) {
            return;
        }
        if self.output.at > TURN {
            self.output.own.drain(..self.output.at);
            self.output.at = 0;
        }
        if self.output.left().len() + event.len() > unread {
            self.state = State::Gone;
            return;
        }
        self.output.own.extend_from_slice(event);
        self.send(now);
    }

    /// Writes what the client takes now.
    fn send(&mut self, now: Instant) {
        let mut sent = 0;
        while sent < TURN && !self.output.left().is_empty() {
            let left = self.output.left();
            match moved(|| self.stream.write(&left[..left.len().min(TURN)])) {
                Moved::Bytes(n) => {
                    self.output.advance(n);
                    (sent, self.since) = (sent + n, now);
                }
                Moved::NotNow => return,
                Moved::Ended => {
                    self.state = State::Gone;
                    return;
                }
            }
        }
    }

    /// Writes on; after a whole answer comes the next request, or the end.
    fn write(&mut self, now: Instant) {
        self.send(now);
        if !matches!(self.state, State::Answering) || !self.output.left().is_empty() {
            return;
        }
        (self.since, self.was_served) = (now, true);
        if self.keeps {
            self.state = State::Head;
            return;
        }
        // Closed at once with bytes unread, the answer could be lost on its way.
        let _ = self.stream.shutdown(Shutdown::Write);
        self.state = State::Leaving(0);
    }

    /// Reads what is not wanted.
    fn pass_over(&mut self) {
        let mut buffer = [0; TURN];
        match (moved(|| self.stream.read(&mut buffer)), &mut self.state) {
            (Moved::Ended, _) => self.state = State::Gone,
            (Moved::Bytes(n), State::Leaving(before)) => {
                *before += n;
                if *before > LINGER.1 {
                    self.state = State::Gone;
                }
            }
            _ => {}
        }
    }

    /// Ends what has taken too long.
    pub(super) fn judge(&mut self, limits: &Limits, now: Instant) {
        let taken = now.saturating_duration_since(self.since);
        match self.state {
            State::Head if self.input.is_empty() => self.end_after(taken, limits.idle),
            State::Head | State::Body(..) if taken > limits.request => {
                self.refuse(&Refusal::new(408, "the request took too long"), now);
            }
            State::Answering => self.end_after(taken, limits.stalled),
            State::Listening if !self.output.left().is_empty() => self.end_after(taken, limits.stalled),
            State::Leaving(_) => self.end_after(taken, LINGER.0),
            _ => {}
        }
    }

    fn end_after(&mut self, taken: Duration, limit: Duration) {
        if taken > limit {
            self.state = State::Gone;
        }
    }

    /// How soon it makes room for another client: the least first. Nothing where it is the caller's turn.
    pub(super) fn rank(&self) -> Option<(u8, Instant)> {
        let rank = match self.state {
            State::Gone | State::Leaving(_) => 0,
            State::Head if self.input.is_empty() && !self.was_served => 1,
            State::Head if self.input.is_empty() => 2,
            State::Head | State::Body(..) => 3,
            State::Answering => 4,
            State::Listening => 5,
            State::Ready(_) | State::Asked => return None,
        };
        Some((rank, self.since))
    }

    /// Bytes of a body that is not whole, and since when it has been coming in.
    pub(super) fn unfinished(&self) -> Option<(usize, Instant)> {
        match &self.state {
            State::Body(_, body) => Some((body.len(), self.since)),
            _ => None,
        }
    }

    pub(super) fn listens(&self) -> bool {
        matches!(self.state, State::Listening)
    }

    pub(super) fn is_gone(&self) -> bool {
        matches!(self.state, State::Gone)
    }

    pub(super) fn drop_it(&mut self) {
        self.state = State::Gone;
    }
}

/// Where the empty line after a head ends; nothing ends before `scanned`.
fn end_of_head(bytes: &[u8], scanned: usize) -> Option<usize> {
    let from = scanned.saturating_sub(2);
    let ends = |at: usize| match &bytes[at..] {
        [b'\n', b'\r', b'\n', ..] => Some(at + 3),
        [b'\n', b'\n', ..] => Some(at + 2),
        _ => None,
    };
    (from..bytes.len()).find_map(ends)
}
