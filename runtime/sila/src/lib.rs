//! SiLA 2 over gRPC (Standardization in Lab Automation; part B): a client for devices, a server for labs.
//!
//! Connections are not encrypted, servers are not looked for (no mDNS), and neither binary transfer nor metadata is spoken.

mod call;
mod client;
mod framework;
mod raw;
mod server;
mod service;
pub mod text;
mod value;

pub use call::Failure;
pub use client::{Client, is_of};
pub use raw::Raw;
pub use server::{Call, News, Read, Request, Server, new_uuid, serve, uuid};
pub use service::spaced;
/// The channels by which news of a call goes out.
pub use tokio::sync::mpsc as news;
pub use value::{Value, decode, encode, fits};
