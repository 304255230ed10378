//! Carries plans out on devices: the lines to them, the framings on these, the journal of a deployment, and emulators.

// A fault ends the run: how many bytes it is returned in is of no account.
#![allow(clippy::result_large_err)]

pub mod binding;
pub mod calibration;
pub mod codec;
pub mod debt;
pub mod deploy;
pub mod emulate;
pub mod http;
pub mod link;
mod lock;
pub mod pattern;
pub mod place;
pub mod play;
pub mod port;
#[cfg(feature = "sila")]
pub mod serve;
pub mod shared;
#[cfg(feature = "sila")]
mod sila;
pub mod template;
pub mod world;
