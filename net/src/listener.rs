//! A listening socket on this machine's own address, and waiting for several sockets at once.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

/// A socket that others connect to.
pub(crate) struct Listener {
    socket: TcpListener,
    address: SocketAddr,
}

/// Who connects.
pub(crate) enum Accepted {
    /// A client; reads and writes on it do not block.
    Client(TcpStream),
    /// Nobody, for now.
    Nobody,
    /// Somebody, but this process may open no more files.
    NoRoom,
}

impl Listener {
    /// Takes a port of this machine's own address; 0 takes any free one.
    pub(crate) fn bind(port: u16) -> io::Result<Self> {
        let socket = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        socket.set_nonblocking(true)?;
        let address = socket.local_addr()?;
        Ok(Listener { socket, address })
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next client that waits.
    pub(crate) fn accept(&self) -> io::Result<Accepted> {
        loop {
            match self.socket.accept().and_then(|(stream, _)| ready(stream)) {
                Ok(stream) => return Ok(Accepted::Client(stream)),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(Accepted::Nobody),
                Err(e) if is_no_room(&e) => return Ok(Accepted::NoRoom),
                Err(e) if has_gone(&e) => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// Waits until a stream is ready for what it is wanted for, or somebody connects where others are let in; says for each
    /// stream whether it is ready.
    pub(crate) fn wait(
        &self,
        lets_in: bool,
        streams: &[(&TcpStream, PollFlags)],
        patience: Duration,
    ) -> io::Result<Vec<bool>> {
        let wanted = if lets_in { PollFlags::IN } else { PollFlags::empty() };
        let mut sockets = vec![PollFd::from_borrowed_fd(self.socket.as_fd(), wanted)];
        sockets.extend(streams.iter().map(|(stream, wanted)| PollFd::from_borrowed_fd(stream.as_fd(), *wanted)));
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        match poll(&mut sockets, Some(&patience)) {
            Ok(_) => Ok(sockets.iter().skip(1).map(|s| !s.revents().is_empty()).collect()),
            // A signal: the caller looks whether to stop.
            Err(Errno::INTR) => Ok(vec![false; streams.len()]),
            Err(e) => Err(e.into()),
        }
    }
}

fn ready(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    Ok(stream)
}

fn is_no_room(e: &io::Error) -> bool {
    matches!(Errno::from_io_error(e), Some(Errno::MFILE | Errno::NFILE | Errno::NOBUFS | Errno::NOMEM))
}

/// Whether a client left before it was accepted.
fn has_gone(e: &io::Error) -> bool {
    use ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, Interrupted, InvalidInput, NotConnected};
    matches!(e.kind(), ConnectionAborted | ConnectionReset | Interrupted | NotConnected | BrokenPipe | InvalidInput)
}

/// How a read or write that must not block ended.
pub(crate) enum Moved {
    /// This many bytes went.
    Bytes(usize),
    /// None for now.
    NotNow,
    /// The other end is gone, or will say no more.
    Ended,
}

/// A read or write that must not block; one that was interrupted is made again.
pub(crate) fn moved(mut attempt: impl FnMut() -> io::Result<usize>) -> Moved {
    loop {
        match attempt() {
            Ok(0) => return Moved::Ended,
            Ok(n) => return Moved::Bytes(n),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) if e.kind() == ErrorKind::WouldBlock => return Moved::NotNow,
            Err(_) => return Moved::Ended,
        }
    }
}
