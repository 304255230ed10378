//! A server as a line: a request goes out as one line, its answer comes back as one.

use std::io::{self, ErrorKind};
use std::time::Duration;

use matterix_ir::wire::Transport;
use ureq::Agent;
use ureq::http::Request;

use crate::codec::LONGEST_JSON;
use crate::port::{self, Port};

/// A server, asked one thing after the other.
pub struct Http {
    agent: Agent,
    /// `http://host:port`.
    base: String,
    header: Option<(String, String)>,
    /// What is to be asked.
    next: Option<Vec<u8>>,
    /// A file that may go with it, with its name.
    file: Option<(String, Vec<u8>)>,
}

/// Opens a line to the server at `HOST:PORT`.
pub fn open(address: &str, transport: &Transport) -> io::Result<Http> {
    let Transport::Http { header } = transport else {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the driver does not speak over HTTP"));
    };
    // Whether somebody is there is known before anything is asked.
    drop(port::connect(address)?);
    let config = Agent::config_builder().http_status_as_error(false).max_redirects(0).proxy(None);
    let agent = config.build().new_agent();
    Ok(Http { agent, base: format!("http://{address}"), header: header.clone(), next: None, file: None })
}

impl Http {
    fn exchange(&self, line: &str, within: Duration) -> io::Result<Vec<u8>> {
        let (method, rest) = line.trim_end().split_once(' ').ok_or_else(|| unclear(line))?;
        let (target, body) = rest.split_once(' ').unwrap_or((rest, ""));
        let mut request = Request::builder().method(method).uri(format!("{}{target}", self.base));
        if let Some((name, value)) = &self.header {
            request = request.header(name, value);
        }
        let answer = if body.is_empty() {
            let request = request.body(()).map_err(|_| unclear(line))?;
            self.agent.run(self.agent.configure_request(request).timeout_global(Some(within)).build())
        } else {
            let (kind, body) = match body.strip_prefix('@') {
                Some(field) => self.form(field).ok_or_else(|| unclear(line))?,
                None => ("application/json".to_owned(), body.as_bytes().to_vec()),
            };
            let request = request.header("Content-Type", kind).body(body);
            let request = request.map_err(|_| unclear(line))?;
            self.agent.run(self.agent.configure_request(request).timeout_global(Some(within)).build())
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
    io::Error::new(ErrorKind::InvalidInput, format!("`{}` is no request", line.trim_end()))
}

fn broken(e: ureq::Error) -> io::Error {
    match e {
        ureq::Error::Io(e) => e,
        ureq::Error::Timeout(_) => io::Error::from(ErrorKind::TimedOut),
        other => io::Error::other(other),
    }
}

impl Http {
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
    fn attach(&mut self, name: &str, bytes: Vec<u8>) -> io::Result<()> {
        self.file = Some((name.to_owned(), bytes));
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.next = Some(bytes.to_vec());
        Ok(())
    }

    fn receive(&mut self, within: Duration) -> io::Result<Vec<u8>> {
        let Some(request) = self.next.take() else { return Ok(Vec::new()) };
        match self.exchange(&String::from_utf8_lossy(&request), within) {
            Err(e) if e.kind() == ErrorKind::TimedOut => Ok(Vec::new()),
            other => other,
        }
    }
}
