//! `matterixc mcp`: a server of the Model Context Protocol, spoken to line by line.

mod client;
mod repair;
mod session;
