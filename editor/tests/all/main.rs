//! What an editor is told about names.

mod agree;
mod complete;
mod names;
mod rename;
mod support;
mod survive;
mod tokens;
