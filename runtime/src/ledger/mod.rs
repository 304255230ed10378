//! Extensive quantities: how they move between mixtures, and that nothing is lost.
//!
//! What the quantities are is no business of this module: a transfer moves the same fraction of each, a balance compares
//! a sum with its start.

mod balance;
mod transfer;

pub use balance::{BalanceReport, Balances, CLOSURE};
pub use transfer::{Held, Refusal, transfer};
