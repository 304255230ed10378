//! The command from outside: what is typed, what comes back, what is left on disk.

mod bill;
mod contents;
mod determinism;
mod devices;
mod doc;
mod explain;
mod faults;
mod files;
mod findings;
mod formatting;
mod grids;
mod harness;
mod motion;
mod new;
mod pages;
mod pipeline_tests;
mod plan;
mod reference;
mod science;
mod screening;
mod slips;
mod strict;
mod time;
mod types;
mod usage;
mod verify;
