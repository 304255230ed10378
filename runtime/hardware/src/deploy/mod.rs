//! A plan on devices: what must be known before, the backend that talks to them, the journal of what it said.

mod abreast;
mod alike;
mod alive;
mod backend;
mod between;
mod calls;
mod control;
mod course;
mod device;
mod exposed;
mod hardware;
mod identity;
mod journal;
mod moved;
mod observe;
mod pace;
mod people;
mod preflight;
mod proof;
mod replay;
mod resume;
mod safe;
mod sense;
mod speak;
mod unbound;
mod values;

pub use control::{Answer, Control, Notice, Taken};
pub use course::{Course, Ending, Kept, REFUSED, carry_out, not_opened, not_reached, of_fault, unsafe_left};
pub use device::{Binding, Carrier, Device};
pub use exposed::Exposed;
pub use hardware::{Hardware, Mode, Settings, Unreached};
pub use journal::{Chain, Entry, Gate, Journal, JournalError, Paper, Past, VERSION, digest, is_unused, read, sha256};
pub use preflight::preflight;

/// Told of every frame: lab time in s, the device, whether it goes out, the bytes.
pub type Trace<'t> = dyn FnMut(f64, &str, bool, &[u8]) + 't;
