//! A plan on devices: what must be known before, the backend that talks to them, the journal of what it said.

mod alive;
mod backend;
mod device;
mod exposed;
mod hardware;
mod journal;
mod observe;
mod preflight;
mod replay;
mod sense;
mod speak;
mod unbound;
mod values;

pub use device::{Binding, Carrier, Device};
pub use exposed::Exposed;
pub use hardware::{Hardware, Mode, Settings, Unreached};
pub use journal::{Entry, Journal, JournalError, digest};
pub use preflight::preflight;

/// Told of every frame: lab time in s, the device, whether it goes out, the bytes.
pub type Trace<'t> = dyn FnMut(f64, &str, bool, &[u8]) + 't;
