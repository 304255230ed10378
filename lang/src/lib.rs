//! The `.mtx` compiler front end: text to a checked [`matterix_ir::Program`].

pub mod ast;
