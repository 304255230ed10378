//! An emulator as a server at a port of this machine.

use std::io::Read;
use std::sync::atomic::Ordering;

use tiny_http::{Header, Request, Response, Server};

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
    let server = Server::http(("127.0.0.1", port)).map_err(|e| format!("cannot listen at port {port}: {e}"))?;
    ready(&server.server_addr().to_string());
    let clock = Clock::new(stop.speed);
    while !stop.cancel.load(Ordering::Relaxed) {
        let request = server.recv_timeout(TICK).map_err(|e| format!("the port is gone: {e}"))?;
        let Some(mut request) = request else {
            turn(emulator, &clock, &[])?;
            continue;
        };
        let (status, body) = match asked(&mut request, header) {
            Ok(line) => parts(&turn(emulator, &clock, line.as_bytes())?),
            Err((status, why)) => {
                let line = emulator.complaint(&why).unwrap_or_default();
                (status, parts(&line).1)
            }
        };
        // Who asked may be gone.
        let _ = request.respond(answer(status, body));
    }
    Ok(())
}

/// A request as a line, or the status it is refused with, and why.
fn asked(request: &mut Request, header: Option<&(String, String)>) -> Result<String, (u16, String)> {
    let has = |name: &str, value: &str| {
        let is_it = |h: &Header| h.field.as_str().as_str().eq_ignore_ascii_case(name) && h.value.as_str() == value;
        request.headers().iter().any(is_it)
    };
    if let Some((name, value)) = header.filter(|(name, value)| !has(name, value)) {
        return Err((422, format!("the header `{name}: {value}` is missing")));
    }
    let mut kinds = request.headers().iter().filter(|h| h.field.equiv("Content-Type"));
    let kind = kinds.next().map(|h| h.value.as_str().to_owned()).unwrap_or_default();
    let mut bytes = Vec::new();
    request.as_reader().take(LONGEST_JSON as u64).read_to_end(&mut bytes).map_err(|e| (400, e.to_string()))?;
    let body = match bytes.as_slice() {
        [] => String::new(),
        bytes if kind.starts_with(form::KIND) => {
            let field = form::field(&kind, bytes).map_err(|why| (422, why))?;
            format!(" @{field}")
        }
        bytes => {
            let value: Result<serde_json::Value, _> = serde_json::from_slice(bytes);
            format!(" {}", value.map_err(|e| (400, format!("the body is not JSON: {e}")))?)
        }
    };
    Ok(format!("{} {}{body}\n", request.method(), request.url()))
}

/// Status and body of an answer; what is not understood is answered with nothing.
fn parts(line: &[u8]) -> (u16, String) {
    let text = String::from_utf8_lossy(line);
    let parts = text.trim_end().split_once(' ').and_then(|(s, body)| Some((s.parse().ok()?, body.to_owned())));
    parts.unwrap_or((404, "{}".to_owned()))
}

fn answer(status: u16, body: String) -> Response<std::io::Cursor<Vec<u8>>> {
    let answer = Response::from_string(body).with_status_code(status);
    match Header::from_bytes("Content-Type", "application/json") {
        Ok(header) => answer.with_header(header),
        Err(()) => answer,
    }
}
