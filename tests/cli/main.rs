//! The command from outside: what is typed, what comes back, what is left on disk.

mod determinism;
mod explain;
mod files;
mod findings;
mod formatting;
mod harness;
mod new;
mod pages;
mod pipeline_tests;
mod reference;
mod science;
mod usage;
