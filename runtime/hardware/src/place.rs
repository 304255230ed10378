//! Where a device is to be found: how bindings write it, and what is said of a place where nobody answers.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, Ipv6Addr};

/// Where a device is to be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A serial port or a pseudo-terminal, by its path.
    Serial(String),
    /// `HOST:PORT`.
    Tcp(String),
    /// A server of SiLA 2.
    Sila(Box<SilaServer>),
    /// A server at `HOST:PORT`.
    Http(String),
}

/// A server of SiLA 2, and how it is spoken to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SilaServer {
    /// `HOST:PORT`, or its UUID, by which it is looked for on the network.
    pub at: String,
    /// How it is known to be the right one.
    pub trust: SilaTrust,
    /// Who calls: the name of a user, and the variable of the environment that holds the password.
    pub user: Option<(String, String)>,
    /// It is taken for oneself; it lets go by itself when nothing is heard for so long, s.
    pub lock: Option<u64>,
}

/// How a server of SiLA 2 is known to be the right one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum SilaTrust {
    /// It is not: connections are not encrypted.
    #[default]
    None,
    /// By certificates in a file in PEM, its own or those that signed it.
    Certificate(String),
    /// By the SHA-256 of its certificate.
    Fingerprint([u8; 32]),
}

/// A fingerprint as it is written: 32 bytes in hexadecimal, with or without colons.
pub fn fingerprint(text: &str) -> Option<[u8; 32]> {
    let digits: Vec<u32> = text.chars().filter(|c| *c != ':').map(|c| c.to_digit(16)).collect::<Option<_>>()?;
    let mut out = [0; 32];
    if digits.len() != 2 * out.len() {
        return None;
    }
    for (byte, pair) in out.iter_mut().zip(digits.chunks(2)) {
        *byte = u8::try_from(16 * pair[0] + pair[1]).ok()?;
    }
    Some(out)
}

/// Whether a text is a UUID as it is written: `7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11`.
pub(crate) fn is_uuid(text: &str) -> bool {
    let groups: Vec<&str> = text.split('-').collect();
    let hexadecimal = text.bytes().all(|b| b == b'-' || b.is_ascii_hexdigit());
    hexadecimal && groups.iter().map(|g| g.len()).eq([8, 4, 4, 4, 12])
}

impl Place {
    /// Whether each answer there belongs to its question, however late it comes.
    pub fn keeps_answers_apart(&self) -> bool {
        matches!(self, Place::Sila(_))
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Place::Serial(text) | Place::Tcp(text) | Place::Http(text) => text,
            Place::Sila(server) => &server.at,
        })
    }
}

/// A place that cannot be one: what is wrong with it, and how it is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoPlace {
    /// In words.
    pub why: String,
    /// What to write.
    pub help: String,
}

/// What a server may be written with in front of it.
const HTTP: &str = "http://";

impl Place {
    /// The key of a binding that it is written with.
    pub fn key(&self) -> &'static str {
        match self {
            Place::Serial(_) => "port",
            Place::Tcp(_) => "address",
            Place::Sila(_) => "sila",
            Place::Http(_) => "http",
        }
    }

    /// The place as it is connected to, or why there can be none.
    pub fn checked(self) -> Result<Place, NoPlace> {
        match self {
            Place::Serial(path) => serial(&path).map(|()| Place::Serial(path)),
            Place::Tcp(text) => endpoint(&text, "address").map(|()| Place::Tcp(text)),
            Place::Sila(server) if is_uuid(&server.at) => Ok(Place::Sila(server)),
            Place::Sila(server) => endpoint(&server.at, "sila").map(|()| Place::Sila(server)),
            Place::Http(text) => {
                let bare = text.strip_prefix(HTTP).map_or(text.as_str(), |t| t.strip_suffix('/').unwrap_or(t));
                endpoint(bare, "http").map(|()| Place::Http(bare.to_owned()))
            }
        }
    }
}

fn serial(path: &str) -> Result<(), NoPlace> {
    let as_path = || "write the path of the port, as in `port = \"/dev/ttyUSB0\"`".to_owned();
    if path.trim().is_empty() {
        return Err(NoPlace { why: "a serial port needs a path".to_owned(), help: as_path() });
    }
    match path.split_once("://") {
        Some((scheme, _)) => Err(NoPlace {
            why: format!("a serial port needs a path, but `{scheme}://` is not one"),
            help: "for a device on the network write `address = \"HOST:PORT\"`".to_owned(),
        }),
        None => Ok(()),
    }
}

/// `HOST:PORT`, the host by name, by number, or by a number of IPv6 in brackets.
fn endpoint(text: &str, key: &str) -> Result<(), NoPlace> {
    let wrong = |why: String, help: String| Err(NoPlace { why, help });
    let form = || format!("write `{key} = \"HOST:PORT\"`");
    if let Some((scheme, rest)) = text.split_once("://") {
        let rest = rest.split('/').next().unwrap_or_default();
        return wrong(format!("`{scheme}://` is not supported here"), format!("write `{key} = \"{rest}\"`"));
    }
    let (host, port) = match text.strip_prefix('[').and_then(|t| t.split_once(']')) {
        Some((host, rest)) => (host, rest.strip_prefix(':')),
        None => text.rsplit_once(':').map_or((text, None), |(host, port)| (host, Some(port))),
    };
    if text.parse::<Ipv6Addr>().is_ok() || (host.contains(':') && !text.starts_with('[')) {
        return wrong("an IPv6 address needs brackets".to_owned(), format!("write `{key} = \"[ADDRESS]:PORT\"`"));
    }
    if host.is_empty() {
        return wrong("the host is missing".to_owned(), form());
    }
    let is_number = host.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let named = |b: u8| b.is_ascii_alphanumeric() || b"-._".contains(&b);
    let known = match text.starts_with('[') {
        true => host.parse::<Ipv6Addr>().is_ok(),
        false if is_number => host.parse::<Ipv4Addr>().is_ok(),
        false => host.bytes().all(named) || !host.is_ascii() && !host.contains(char::is_whitespace),
    };
    if !known {
        return wrong(format!("`{host}` is not a host name or address"), form());
    }
    let Some(port) = port.filter(|port| !port.is_empty()) else {
        let bare = text.trim_end_matches(':');
        return wrong(format!("the port of `{host}` is missing"), format!("write `{key} = \"{bare}:PORT\"`"));
    };
    let is_port = port.bytes().all(|b| b.is_ascii_digit());
    match port.parse::<u16>().ok().filter(|n| is_port && *n > 0) {
        Some(_) => Ok(()),
        None => wrong(format!("`{port}` is not a port: a number from 1 to 65535"), form()),
    }
}

/// What is at a place that could not be opened, in words.
pub fn trouble(place: &Place, error: &io::Error) -> String {
    match (error.kind(), place) {
        (ErrorKind::ConnectionRefused, _) => format!("`{place}` refused the connection: no program listens there"),
        (ErrorKind::TimedOut, _) => format!("`{place}` does not answer: the connection timed out"),
        (ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable, _) => {
            format!("the network has no route to `{place}`")
        }
        (ErrorKind::NotFound, Place::Serial(text)) if text.contains(':') && !text.starts_with('/') => {
            format!("the port `{place}` does not exist: for a host with its port write `address`")
        }
        (ErrorKind::NotFound, Place::Serial(_)) => format!("the port `{place}` does not exist"),
        (ErrorKind::PermissionDenied, Place::Serial(_)) => {
            format!("this user may not open the port `{place}`")
        }
        (ErrorKind::ResourceBusy, Place::Serial(_)) if error.raw_os_error().is_some() => {
            format!("another program uses the port `{place}`")
        }
        (ErrorKind::ResourceBusy, _) => format!("`{place}` is in use: {}", plain(error)),
        // An error that says what it is needs no second saying.
        _ => format!("`{place}` cannot be opened: {}", plain(error)),
    }
}

/// An error of the system without its number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    let end = text.rfind(" (os error").unwrap_or(text.len());
    let text = &text[..end];
    let mut rest = text.chars();
    match (rest.next(), rest.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(rest).collect(),
        _ => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Place, fingerprint, is_uuid};

    #[test]
    fn places_are_hosts_with_ports_and_paths() {
        let good = ["127.0.0.1:1", "localhost:65535", "robot.lab:31950", "[::1]:80", "my_host-2:7"];
        for text in good {
            assert!(Place::Tcp(text.to_owned()).checked().is_ok(), "{text}");
        }
        let http = |text: &str| Place::Http(text.to_owned()).checked();
        assert_eq!(http("http://robot:31950/"), Ok(Place::Http("robot:31950".to_owned())));
        assert!(Place::Serial("COM3".to_owned()).checked().is_ok());
    }

    #[test]
    fn fingerprints_are_32_bytes_in_hexadecimal() {
        let plain = "ab".repeat(31) + "01";
        let read = fingerprint(&plain).expect("it is one");
        assert_eq!((read[0], read[31]), (0xab, 1));
        assert_eq!(fingerprint(&("AB:".repeat(31) + "01")), Some(read));
        for text in ["", "AB:CD", &"G0".repeat(32), &"é".repeat(32), &"AB".repeat(33), &"+1".repeat(32)] {
            assert_eq!(fingerprint(text), None, "{text}");
        }
        assert!(is_uuid("7f3f5b0e-8c57-4d56-9a3e-2c1f0d9b6a11") && !is_uuid("plate.lab:50052"));
    }

    #[test]
    fn what_is_no_place_is_said_to_be_none() {
        let cases = [
            ("nonsense", "the port of `nonsense` is missing"),
            ("robot:", "the port of `robot` is missing"),
            ("robot:0", "`0` is not a port"),
            ("robot:65536", "`65536` is not a port"),
            ("robot:+7", "`+7` is not a port"),
            ("robot:http", "`http` is not a port"),
            (":31950", "the host is missing"),
            ("", "the host is missing"),
            ("300.1.1.1:80", "is not a host name or address"),
            ("a robot:80", "is not a host name or address"),
            ("::1", "needs brackets"),
            ("[robot]:80", "is not a host name or address"),
            ("https://robot:80", "`https://` is not supported here"),
            ("robot:80/runs", "`80/runs` is not a port"),
        ];
        for (text, wanted) in cases {
            let why = Place::Http(text.to_owned()).checked().expect_err(text).why;
            assert!(why.contains(wanted), "{text}: {why}");
        }
        for text in ["", "tcp://robot:80"] {
            assert!(Place::Serial(text.to_owned()).checked().is_err(), "{text}");
        }
    }
}
