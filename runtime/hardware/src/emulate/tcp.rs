//! An emulator at a port of this machine.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use matterix_net::tcp::{Heard, Limits, Server};

use super::Emulator;
use super::serve::{Clock, Stop, TICK, turn};

/// Serves a port of this machine; `ready` is given its address. Several masters may be connected: each has a line of its own, and
/// its answers are its own.
pub fn serve_tcp(
    emulator: &mut Emulator<'_>,
    port: u16,
    stop: Stop<'_>,
    ready: &mut dyn FnMut(&str),
) -> Result<(), String> {
    let mut server = Server::bind(port, Limits::default()).map_err(|e| format!("cannot listen on port {port}: {e}"))?;
    ready(&server.address().to_string());
    let clock = Clock::new(stop.speed);
    let mut unfinished = BTreeMap::new();
    while !stop.cancel.load(Ordering::Relaxed) {
        match server.next(TICK).map_err(|e| format!("the port was lost: {e}"))? {
            Some(Heard::Said(client, bytes)) => {
                // What devices say by themselves is for all.
                server.publish(&turn(emulator, &clock, &[])?);
                let input = unfinished.entry(client).or_default();
                emulator.change_line(input);
                let out = emulator.receive(&bytes).map_err(|f| f.message)?;
                emulator.change_line(input);
                server.send(client, &out);
            }
            Some(Heard::Left(client)) => drop(unfinished.remove(&client)),
            None => server.publish(&turn(emulator, &clock, &[])?),
        }
    }
    Ok(())
}
