//! What an editor asks of a text: pure functions of an [`Analysis`] and a place in it, counted in bytes. No protocol, files or clock.
//!
//! A question about a text that could not be read whole is answered as well as what could be read allows, never with a failure.

mod analysis;
pub mod calls;
pub mod complete;
pub mod hover;
pub mod index;
pub mod references;
pub mod rename;

pub use analysis::{Analysis, touches};
pub use index::Index;
