//! Calls over a channel of gRPC, and what their errors mean.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use prost::Message;
use tonic::{Code, Status};

use crate::framework::{Error, Kind, Refusal};

/// Why a server did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The server is gone, or nothing came in time.
    Lost(String),
    /// What came is no answer to what was said, or there is no such thing to say.
    Garbled(String),
    /// The server says no.
    Refused {
        /// The identifier of an error that the feature defines, or what the standard calls it.
        name: String,
        /// In words.
        message: String,
    },
}

impl Failure {
    /// The end of a call as a failure.
    pub fn of(status: &Status) -> Failure {
        let message = status.message();
        match status.code() {
            Code::Aborted => match STANDARD.decode(message).ok().and_then(|b| Error::decode(b.as_slice()).ok()?.kind) {
                Some(kind) => named(kind),
                None => Failure::Garbled(format!("it ended a call with `{}`, which is not a SiLA error", cut(message))),
            },
            Code::Unimplemented => Failure::Garbled("it does not know this call".to_owned()),
            Code::Unavailable | Code::Cancelled | Code::DeadlineExceeded | Code::Unknown | Code::Internal => {
                Failure::Lost(format!("the connection was lost: {}", cut(message)))
            }
            other => Failure::Garbled(format!("it ended a call with {other:?}: {}", cut(message))),
        }
    }

    /// The failure as the end of a call. `feature` is the full identifier of the feature that defines it.
    pub fn status(&self, feature: &str) -> Status {
        let kind = match self {
            Failure::Lost(message) | Failure::Garbled(message) => Kind::Undefined(words(message)),
            Failure::Refused { name, message } => Kind::Defined(crate::framework::Fully {
                identifier: format!("{feature}/DefinedExecutionError/{name}"),
                message: message.clone(),
            }),
        };
        status(kind)
    }
}

fn words(message: &str) -> crate::framework::Words {
    crate::framework::Words { message: message.to_owned() }
}

/// An error as the end of a call.
pub fn status(kind: Kind) -> Status {
    Status::new(Code::Aborted, STANDARD.encode(Error { kind: Some(kind) }.encode_to_vec()))
}

/// An error of the standard's own as the end of a call.
pub fn refused(refusal: Refusal, message: impl Into<String>) -> Status {
    status(Kind::Framework(crate::framework::Framework { refusal: refusal as i32, message: message.into() }))
}

fn named(kind: Kind) -> Failure {
    let last = |identifier: &str| identifier.rsplit('/').next().unwrap_or_default().to_owned();
    let (name, message) = match kind {
        Kind::Validation(e) => ("ValidationError".to_owned(), format!("`{}`: {}", last(&e.identifier), e.message)),
        Kind::Defined(e) => (last(&e.identifier), e.message),
        Kind::Undefined(e) => ("UndefinedExecutionError".to_owned(), e.message),
        Kind::Framework(e) => {
            let name = Refusal::try_from(e.refusal).map_or("FrameworkError", Refusal::name);
            (name.to_owned(), e.message)
        }
    };
    Failure::Refused { name, message: cut(&message).to_owned() }
}

/// As much of a text as fits into a message.
fn cut(text: &str) -> &str {
    let end = text.char_indices().nth(300).map_or(text.len(), |(at, _)| at);
    text[..end].trim()
}
