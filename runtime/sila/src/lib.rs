//! SiLA 2 over gRPC (Standardization in Lab Automation; part B): a client for devices, a server for labs.
//!
//! Not spoken: connections that a server opens to a client, values of type `Any`, and metadata other than locks and logins.

mod binary;
mod call;
mod client;
pub mod discovery;
mod framework;
mod metadata;
mod moment;
mod raw;
mod server;
mod service;
pub mod text;
pub mod tls;
mod value;

pub use call::Failure;
pub use client::{Access, Client, Lock, Login, Said, is_of};
pub use moment::Moment;
pub use raw::Raw;
pub use server::{About, Call, Door, News, Read, Request, Server, Users, new_uuid, serve, uuid};
pub use service::spaced;
/// The channels by which news of a call goes out.
pub use tokio::sync::mpsc as news;
pub use value::{ROUNDING, Value, decode, encode, fits};
