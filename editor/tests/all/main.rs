//! What an editor is told about names.

mod agree;
mod complete;
mod names;
mod rename;
mod speed;
mod support;
mod survive;
mod tokens;
