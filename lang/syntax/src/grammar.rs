//! The published grammar, compiled.
#![allow(missing_docs)]

#[derive(pest_derive::Parser)]
#[grammar = "../../../grammar/mtx.pest"]
#[grammar = "../../../grammar/recovery.pest"]
pub(super) struct Grammar;
