//! Executes a `Program` on a backend.

// A fault ends the run: how many bytes it is returned in is of no account.
#![allow(clippy::result_large_err)]

pub mod backend;
pub mod bill;
pub mod contact;
pub mod exec;
pub mod fault;
pub mod fit;
pub mod ledger;
pub mod motion;
pub mod process;
pub mod record;
pub mod run;
pub mod schedule;
mod screen;
pub mod study;
mod touched;
