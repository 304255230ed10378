//! A language server: what the protocol asks, in terms of [`matterix_editor`]. The only place that knows the protocol.

mod answers;
mod capabilities;
mod documents;
mod findings;
mod frames;
mod held;
mod judge;
mod lines;
mod publish;
mod server;
mod shelf;
mod uris;

pub use server::serve;
