//! A device that answers as a real one would: the model of the library behind the wire of its driver, read the other way round.

mod bus;
mod device;
mod form;
mod http;
mod pty;
mod serve;
mod solve;
mod symlink;
mod tcp;

pub use bus::Emulator;
pub use http::serve_http;
pub use pty::serve_pty;
pub use serve::Stop;
pub use tcp::serve_tcp;
