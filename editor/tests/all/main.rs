//! What an editor is told about names.

mod support;
mod tokens;
