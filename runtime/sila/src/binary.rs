//! Messages by which bytes are passed in parts (part B, "Binary transfer"): those that are too long for one message.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use prost::Message;
use tonic::{Code, Status};

use crate::call::Failure;

/// The most bytes that go inside a message, and in one part.
pub(crate) const WHOLE: usize = 2 << 20;

/// The most bytes that are fetched or sent at all.
pub(crate) const LONGEST: u64 = 256 << 20;

/// Bytes, or where they are kept.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Binary {
    #[prost(oneof = "Held", tags = "1, 2")]
    pub held: Option<Held>,
}

#[derive(Clone, PartialEq, prost::Oneof)]
pub(crate) enum Held {
    #[prost(bytes = "vec", tag = "1")]
    Here(Vec<u8>),
    /// By the identifier that the server gave them.
    #[prost(string, tag = "2")]
    Kept(String),
}

/// Bytes are to be sent.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Create {
    #[prost(uint64, tag = "1")]
    pub size: u64,
    #[prost(uint32, tag = "2")]
    pub parts: u32,
    /// The full identifier of the parameter.
    #[prost(string, tag = "3")]
    pub parameter: String,
}

/// The identifier of bytes, in most messages the only thing that counts.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Name {
    #[prost(string, tag = "1")]
    pub uuid: String,
}

/// One part is sent.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Part {
    #[prost(string, tag = "1")]
    pub uuid: String,
    #[prost(uint32, tag = "2")]
    pub index: u32,
    #[prost(bytes = "vec", tag = "3")]
    pub bytes: Vec<u8>,
}

/// How many bytes there are.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Size {
    #[prost(uint64, tag = "1")]
    pub size: u64,
}

/// One part is asked for.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Wanted {
    #[prost(string, tag = "1")]
    pub uuid: String,
    #[prost(uint64, tag = "2")]
    pub offset: u64,
    #[prost(uint32, tag = "3")]
    pub length: u32,
}

/// One part has come.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct Come {
    #[prost(string, tag = "1")]
    pub uuid: String,
    #[prost(uint64, tag = "2")]
    pub offset: u64,
    #[prost(bytes = "vec", tag = "3")]
    pub bytes: Vec<u8>,
}

/// What the standard calls the errors of these messages.
const ERRORS: [&str; 3] = ["InvalidBinaryTransferUUID", "BinaryUploadFailed", "BinaryDownloadFailed"];

#[derive(Clone, PartialEq, Message)]
struct Error {
    #[prost(int32, tag = "1")]
    kind: i32,
    #[prost(string, tag = "2")]
    message: String,
}

/// The end of such a call as a failure.
pub(crate) fn failure(status: &Status) -> Failure {
    let error = || Error::decode(STANDARD.decode(status.message()).ok()?.as_slice()).ok();
    match (status.code(), error()) {
        (Code::Aborted, Some(Error { kind, message })) if !message.is_empty() => {
            let name = usize::try_from(kind).ok().and_then(|k| ERRORS.get(k)).copied().unwrap_or("BinaryTransferError");
            Failure::Refused { name: name.to_owned(), message }
        }
        _ => Failure::of(status),
    }
}
