//! An emulator as a server at a port of this machine.

use std::io::Read;
use std::sync::atomic::Ordering;

use tiny_http::{Header, Request, Response, Server};

use super::Emulator;
use super::serve::{Clock, Stop, TICK, turn};
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
            Err(status) => (status, "{}".to_owned()),
        };
        // Who asked may be gone.
        let _ = request.respond(answer(status, body));
    }
    Ok(())
}

/// A request as a line, or the status it is refused with.
fn asked(request: &mut Request, header: Option<&(String, String)>) -> Result<String, u16> {
    let has = |name: &str, value: &str| {
        let is_it = |h: &Header| h.field.as_str().as_str().eq_ignore_ascii_case(name) && h.value.as_str() == value;
        request.headers().iter().any(is_it)
    };
    if header.is_some_and(|(name, value)| !has(name, value)) {
        return Err(422);
    }
    let mut bytes = Vec::new();
    request.as_reader().take(LONGEST_JSON as u64).read_to_end(&mut bytes).map_err(|_| 400_u16)?;
    let body = match bytes.as_slice() {
        [] => String::new(),
        bytes => {
            let value: serde_json::Value = serde_json::from_slice(bytes).map_err(|_| 400_u16)?;
            format!(" {value}")
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
