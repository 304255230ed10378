//! A server as a line: a request goes out as one line, its answer comes back as one.

use std::io::{self, ErrorKind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use matterix_ir::wire::{Driver, Transport};
use ureq::Agent;
use ureq::http::Request;

use crate::codec::LONGEST_JSON;
use crate::port::{self, Port};

/// A server, asked one thing after the other. Who waits for an answer may look up meanwhile: it comes in on a thread of its own.
pub struct Http {
    asks: Asks,
    /// The answer that is waited for.
    pending: Option<Receiver<io::Result<Vec<u8>>>>,
    /// A file that may go with what is asked, with its name.
    file: Option<(String, Vec<u8>)>,
}

/// What it takes to ask.
#[derive(Clone)]
struct Asks {
    agent: Agent,
    /// `http://host:port`.
    base: String,
    header: Option<(String, String)>,
    /// Longest time until an answer is there.
    timeout: Duration,
}

/// Opens a line to the server at `HOST:PORT`.
pub fn open(address: &str, driver: &Driver) -> io::Result<Http> {
    let Transport::Http { header } = &driver.transport else {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the driver does not use HTTP"));
    };
    let timeout = Duration::try_from_secs_f64(driver.timeout);
    let timeout = timeout.map_err(|_| io::Error::new(ErrorKind::InvalidInput, "the timeout is not a duration"))?;
    // Whether somebody is there is known before anything is asked.
    drop(port::connect(address)?);
    let config = Agent::config_builder().http_status_as_error(false).max_redirects(0).proxy(None);
    let agent = config.timeout_global(Some(timeout)).build().new_agent();
    let asks = Asks { agent, base: format!("http://{address}"), header: header.clone(), timeout };
    Ok(Http { asks, pending: None, file: None })
}

/// What goes with a request: its content type and its bytes.
type Body = Option<(String, Vec<u8>)>;

impl Asks {
    fn exchange(&self, method: &str, target: &str, body: Body) -> io::Result<Vec<u8>> {
        let unclear = |_| unclear(&format!("{method} {target}"));
        let mut request = Request::builder().method(method).uri(format!("{}{target}", self.base));
        if let Some((name, value)) = &self.header {
            request = request.header(name, value);
        }
        let answer = match body {
            None => self.agent.run(request.body(()).map_err(unclear)?),
            Some((kind, bytes)) => self.agent.run(request.header("Content-Type", kind).body(bytes).map_err(unclear)?),
        };
        let answer = answer.map_err(broken)?;
        let status = answer.status().as_u16();
        let body = answer.into_body().with_config().limit(LONGEST_JSON as u64).read_to_string().map_err(broken)?;
        // A line has no ends of lines in it; in JSON they are blanks.
        let body = body.replace(['\r', '\n'], " ");
        let body = if body.trim().is_empty() { "null" } else { body.trim() };
        Ok(format!("{status} {body}\n").into_bytes())
    }
}

fn unclear(line: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, format!("`{}` is not a request", line.trim_end()))
}

fn broken(e: ureq::Error) -> io::Error {
    match e {
        ureq::Error::Io(e) => e,
        ureq::Error::Timeout(_) => io::Error::from(ErrorKind::TimedOut),
        other => io::Error::other(other),
    }
}

impl Http {
    /// Method, path and body of a line.
    fn request(&self, line: &str) -> io::Result<(String, String, Body)> {
        let (method, rest) = line.trim_end().split_once(' ').ok_or_else(|| unclear(line))?;
        let (target, body) = rest.split_once(' ').unwrap_or((rest, ""));
        let body = match (body, body.strip_prefix('@')) {
            ("", _) => None,
            (_, Some(field)) => Some(self.form(field).ok_or_else(|| unclear(line))?),
            (json, None) => Some(("application/json".to_owned(), json.as_bytes().to_vec())),
        };
        Ok((method.to_owned(), target.to_owned(), body))
    }

    /// The file in a form with one field (RFC 7578): content type and body.
    fn form(&self, field: &str) -> Option<(String, Vec<u8>)> {
        let (name, bytes) = self.file.as_ref()?;
        let is_in = |mark: &str| bytes.windows(mark.len()).any(|w| w == mark.as_bytes());
        let mark = (0_u64..).map(|n| format!("matterixc-{n}")).find(|mark| !is_in(mark))?;
        let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '_' }).collect();
        let head = format!(
            "--{mark}\r\nContent-Disposition: form-data; name=\"{field}\"; filename=\"{name}\"\r\n\
             Content-Type: application/octet-stream\r\n\r\n"
        );
        let body = [head.as_bytes(), bytes, format!("\r\n--{mark}--\r\n").as_bytes()].concat();
        Some((format!("multipart/form-data; boundary={mark}"), body))
    }
}

impl Port for Http {
    fn renews(&self) -> bool {
        true
    }

    fn attach(&mut self, name: &str, bytes: Vec<u8>) -> io::Result<()> {
        self.file = Some((name.to_owned(), bytes));
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (method, target, body) = self.request(&String::from_utf8_lossy(bytes))?;
        let (answered, pending) = channel();
        let asks = self.asks.clone();
        std::thread::spawn(move || {
            // Nobody waits any more where this cannot be given.
            let _ = answered.send(asks.exchange(&method, &target, body));
        });
        self.pending = Some(pending);
        Ok(())
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        let Some(pending) = &self.pending else {
            std::thread::sleep(within.min(self.asks.timeout));
            return Ok(Vec::new());
        };
        match pending.recv_timeout(within) {
            Err(RecvTimeoutError::Timeout) => Ok(Vec::new()),
            Err(RecvTimeoutError::Disconnected) => Err(io::Error::other("the request failed")),
            Ok(answer) => {
                self.pending = None;
                match answer {
                    Err(e) if e.kind() == ErrorKind::TimedOut => Ok(Vec::new()),
                    other => other,
                }
            }
        }
    }
}
