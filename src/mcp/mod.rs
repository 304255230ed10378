//! A server of the Model Context Protocol on standard input and output: what an assistant needs to write and repair a protocol.
//!
//! Nothing here reaches a device, and nothing outside of one folder is read or written. Standard output carries the protocol only.

mod answer;
mod desk;
mod found;
mod prompts;
mod resources;
mod server;
mod tools;
mod transport;
mod work;

use std::path::Path;

use rmcp::ServiceExt;
use rmcp::service::ServerInitializeError;

use crate::STACK;
use desk::Desk;
use server::Server;

/// Answers a client until it closes its end, with the files of a folder.
pub fn serve(root: &Path) -> Result<(), String> {
    let server = Server::new(Desk::of(root)?);
    let failed = |what: &str, why: &dyn std::fmt::Display| format!("{what}: {why}");
    // What is looked through goes as deep as its brackets, on the threads for work that blocks.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .thread_stack_size(STACK)
        .build()
        .map_err(|e| failed("cannot start the server", &e))?;
    let ended = runtime.block_on(async {
        let running = match server.serve(transport::bounded()).await {
            Ok(running) => running,
            // Nothing was asked, so nothing is wrong.
            Err(ServerInitializeError::ConnectionClosed(_)) => return Ok(()),
            Err(e) => return Err(failed("the client did not start a session", &e)),
        };
        running.waiting().await.map(drop).map_err(|e| failed("the session was interrupted", &e))
    });
    // Work that nobody waits for any more does not hold up the end.
    runtime.shutdown_background();
    ended
}
