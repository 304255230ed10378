//! An emulator as a server at a port of this machine.

use std::sync::atomic::Ordering;

use matterix_net::http::{Answer, Limits, Request, Server};

use super::serve::{Clock, Stop, TICK, turn};
use super::{Emulator, form};
use crate::codec::LONGEST_JSON;

/// Serves a port of this machine; `ready` is given its address. Requests without the header are refused.
pub fn serve_http(
    emulator: &mut Emulator<'_>,
    port: u16,
    header: Option<&(String, String)>,
    stop: Stop<'_>,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let limits = Limits { body: LONGEST_JSON, ..Limits::default() };
    let mut server = Server::bind(port, limits).map_err(|e| format!("cannot listen on port {port}: {e}"))?;
    ready(&server.address().to_string());
    let clock = Clock::new(stop.speed);
    while !stop.cancel.load(Ordering::Relaxed) {
        let Some(asked) = server.next(TICK).map_err(|e| format!("the port was lost: {e}"))? else {
            turn(emulator, &clock, &[])?;
            continue;
        };
        let (status, body) = match as_line(&asked.request, header) {
            Ok(line) => parts(&turn(emulator, &clock, line.as_bytes())?),
            Err((status, why)) => {
                let line = emulator.complaint(&why).unwrap_or_default();
                (status, parts(&line).1)
            }
        };
        server.answer(asked.client, Answer::new(status, "application/json", body.into_bytes()));
    }
    Ok(())
}

/// A request as a line, or the status it is refused with, and why.
fn as_line(request: &Request, header: Option<&(String, String)>) -> Result<String, (u16, String)> {
    let has = |name: &str, value: &str| {
        request.head.headers.iter().any(|(n, v)| n.eq_ignore_ascii_case(name) && v.as_str() == value)
    };
    if let Some((name, value)) = header.filter(|(name, value)| !has(name, value)) {
        return Err((422, format!("the header `{name}: {value}` is missing")));
    }
    let kind = request.header("Content-Type").unwrap_or_default();
    let body = match request.body.as_slice() {
        [] => String::new(),
        bytes if kind.starts_with(form::KIND) => {
            let field = form::field(kind, bytes).map_err(|why| (422, why))?;
            format!(" @{field}")
        }
        bytes => {
            let value: Result<serde_json::Value, _> = serde_json::from_slice(bytes);
            format!(" {}", value.map_err(|e| (400, format!("the body is not JSON: {e}")))?)
        }
    };
    Ok(format!("{} {}{body}\n", request.method(), request.target()))
}

/// Status and body of an answer; what is not understood is answered with nothing.
fn parts(line: &[u8]) -> (u16, String) {
    let text = String::from_utf8_lossy(line);
    let parts = text.trim_end().split_once(' ').and_then(|(s, body)| Some((s.parse().ok()?, body.to_owned())));
    parts.unwrap_or((404, "{}".to_owned()))
}
