//! Lines as bytes: serial ports, pseudo-terminals and connections over a network.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::rc::Rc;
use std::time::Duration;

use matterix_ir::wire::{Driver, Transport};
use serial2::{CharSize, Parity, SerialPort, Settings, StopBits};

use crate::debt::Debt;
use crate::http;
use crate::lock::{self, Hold};
use crate::place::Place;

/// Bytes out and in.
pub trait Port {
    /// Sends all of it.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// What has come in, waiting at most so long for the first of it: none where nothing came in time.
    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>>;
    /// Whether each message has a connection of its own, so that the next one may go where one was cut.
    fn renews(&self) -> bool {
        false
    }
    /// The answers that are owed over this wire.
    fn debt(&self) -> Rc<Debt> {
        Rc::default()
    }
    /// Has a file ready that a message may say is to go with it.
    fn attach(&mut self, _name: &str, _bytes: Vec<u8>) -> io::Result<()> {
        Err(io::Error::new(ErrorKind::Unsupported, "this line cannot carry files"))
    }
}

/// Shortest wait that ports can be asked for.
const LEAST: Duration = Duration::from_millis(1);

/// Longest time until a connection stands.
const CONNECT: Duration = Duration::from_secs(5);

/// Opens a line; a driver for a serial port may also speak over a network, to a converter or an emulator.
pub fn open(place: &Place, driver: &Driver) -> io::Result<Box<dyn Port>> {
    let hold = lock::take(place)?;
    let port: Box<dyn Port> = match place {
        Place::Serial(path) => Box::new(Serial(serial(path, &driver.transport)?)),
        Place::Tcp(address) => Box::new(Tcp(connect(address)?)),
        Place::Sila(_) => return Err(io::Error::new(ErrorKind::InvalidInput, "a server is not a line")),
        Place::Http(address) => Box::new(http::open(address, driver)?),
    };
    Ok(Box::new(Held { port, _hold: hold }))
}

/// A port that this process has to itself.
struct Held {
    port: Box<dyn Port>,
    _hold: Hold,
}

impl Port for Held {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.send(bytes)
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        self.port.receive(within)
    }

    fn attach(&mut self, name: &str, bytes: Vec<u8>) -> io::Result<()> {
        self.port.attach(name, bytes)
    }
}

fn serial(path: &str, transport: &Transport) -> io::Result<SerialPort> {
    let Transport::Serial { baud, data_bits, parity, stop_bits } = *transport else {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the driver does not use a serial port"));
    };
    let size = match data_bits {
        5 => CharSize::Bits5,
        6 => CharSize::Bits6,
        7 => CharSize::Bits7,
        _ => CharSize::Bits8,
    };
    let check = match parity {
        'E' => Parity::Even,
        'O' => Parity::Odd,
        _ => Parity::None,
    };
    // A pseudo-terminal has no characters of 7 bits and no parity; it carries bytes as they are.
    let is_pseudo = std::fs::canonicalize(path).is_ok_and(|p| p.starts_with("/dev/pts"));
    let (size, check) = if is_pseudo { (CharSize::Bits8, Parity::None) } else { (size, check) };
    let port = SerialPort::open(path, |mut settings: Settings| {
        settings.set_raw();
        settings.set_baud_rate(baud)?;
        settings.set_char_size(size);
        settings.set_parity(check);
        settings.set_stop_bits(if stop_bits == 2 { StopBits::Two } else { StopBits::One });
        Ok(settings)
    })?;
    if !is_pseudo {
        // Programs that do not know of locks are kept away too; a pseudo-terminal would remember it after this process.
        rustix::termios::ioctl_tiocexcl(&port)?;
    }
    Ok(port)
}

pub(crate) fn connect(address: &str) -> io::Result<TcpStream> {
    let unknown = || io::Error::other("the host is unknown");
    // Why a name is not found each system says in its own words.
    let all: Vec<SocketAddr> = address.to_socket_addrs().map_err(|_| unknown())?.collect();
    let mut last = unknown();
    for one in all {
        match TcpStream::connect_timeout(&one, CONNECT) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(CONNECT))?;
                return Ok(stream);
            }
            Err(e) => last = e,
        }
    }
    Err(last)
}

struct Serial(SerialPort);

impl Port for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)?;
        self.0.flush()
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        if within.is_zero() && !has_come(&self.0)? {
            return Ok(Vec::new());
        }
        self.0.set_read_timeout(within.max(LEAST))?;
        some(|buffer| self.0.read(buffer))
    }
}

struct Tcp(TcpStream);

impl Port for Tcp {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        if within.is_zero() && !has_come(&self.0)? {
            return Ok(Vec::new());
        }
        self.0.set_read_timeout(Some(within.max(LEAST)))?;
        some(|buffer| self.0.read(buffer))
    }
}

/// Whether something waits there, or the line is gone, which reading tells.
#[cfg(unix)]
fn has_come(line: &impl std::os::fd::AsFd) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};

    let now = Timespec { tv_sec: 0, tv_nsec: 0 };
    match poll(&mut [PollFd::new(line, PollFlags::IN)], Some(&now)) {
        Ok(ready) => Ok(ready > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

/// Only reading tells.
#[cfg(not(unix))]
fn has_come<T>(_: &T) -> io::Result<bool> {
    Ok(true)
}

fn some(mut read: impl FnMut(&mut [u8]) -> io::Result<usize>) -> io::Result<Vec<u8>> {
    let mut buffer = [0; 1024];
    match read(&mut buffer) {
        Ok(0) => Err(io::Error::new(ErrorKind::UnexpectedEof, "the other side closed it")),
        Ok(n) => Ok(buffer[..n].to_vec()),
        Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
            Ok(Vec::new())
        }
        Err(e) => Err(e),
    }
}
