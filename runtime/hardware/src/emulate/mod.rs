//! A device that answers as a real one would: the model of the library behind the wire of its driver, read the other way round.

mod bus;
mod device;
mod form;
mod http;
mod serve;
mod solve;

pub use bus::Emulator;
pub use http::serve_http;
pub use serve::{Stop, serve_pty, serve_tcp};
