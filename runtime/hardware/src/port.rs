//! Lines as bytes: serial ports, pseudo-terminals and connections over a network.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::time::Duration;

use matterix_ir::wire::Transport;
use serial2::{CharSize, Parity, SerialPort, Settings, StopBits};

use crate::http;

/// Bytes out and in.
pub trait Port {
    /// Sends all of it.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// What has come in, waiting at most so long for the first of it: none where nothing came in time.
    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>>;
    /// Has a file ready that a message may say is to go with it.
    fn attach(&mut self, _name: &str, _bytes: Vec<u8>) -> io::Result<()> {
        Err(io::Error::new(ErrorKind::Unsupported, "files do not go over this line"))
    }
}

/// Where a device is to be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A serial port or a pseudo-terminal, by its path.
    Serial(String),
    /// `HOST:PORT`.
    Tcp(String),
    /// A server of SiLA 2, `HOST:PORT`.
    Sila(String),
    /// A server at `HOST:PORT`.
    Http(String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Place::Serial(text) | Place::Tcp(text) | Place::Sila(text) | Place::Http(text)) = self;
        f.write_str(text)
    }
}

/// Shortest wait that ports can be asked for.
const LEAST: Duration = Duration::from_millis(1);

/// Longest time until a connection stands.
const CONNECT: Duration = Duration::from_secs(5);

/// Opens a line; a driver for a serial port may also speak over a network, to a converter or an emulator.
pub fn open(place: &Place, transport: &Transport) -> io::Result<Box<dyn Port>> {
    match place {
        Place::Serial(path) => Ok(Box::new(Serial(serial(path, transport)?))),
        Place::Tcp(address) => Ok(Box::new(Tcp(connect(address)?))),
        Place::Sila(_) => Err(io::Error::new(ErrorKind::InvalidInput, "a server is no line")),
        Place::Http(address) => Ok(Box::new(http::open(address, transport)?)),
    }
}

fn serial(path: &str, transport: &Transport) -> io::Result<SerialPort> {
    let Transport::Serial { baud, data_bits, parity, stop_bits } = *transport else {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the driver does not speak over a serial port"));
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
    SerialPort::open(path, |mut settings: Settings| {
        settings.set_raw();
        settings.set_baud_rate(baud)?;
        settings.set_char_size(size);
        settings.set_parity(check);
        settings.set_stop_bits(if stop_bits == 2 { StopBits::Two } else { StopBits::One });
        Ok(settings)
    })
}

pub(crate) fn connect(address: &str) -> io::Result<TcpStream> {
    let all: Vec<SocketAddr> = address.to_socket_addrs()?.collect();
    let mut last = io::Error::new(ErrorKind::NotFound, "there is no such host");
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
        self.0.set_read_timeout(Some(within.max(LEAST)))?;
        some(|buffer| self.0.read(buffer))
    }
}

fn some(mut read: impl FnMut(&mut [u8]) -> io::Result<usize>) -> io::Result<Vec<u8>> {
    let mut buffer = [0; 1024];
    match read(&mut buffer) {
        Ok(0) => Err(io::Error::new(ErrorKind::UnexpectedEof, "the line was closed")),
        Ok(n) => Ok(buffer[..n].to_vec()),
        Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
            Ok(Vec::new())
        }
        Err(e) => Err(e),
    }
}
