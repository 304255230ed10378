//! The matterix command.
fn main() {}
