//! `matterixc mcp`: a server of the Model Context Protocol, spoken to line by line.

pub mod client;
mod repair;
mod session;
