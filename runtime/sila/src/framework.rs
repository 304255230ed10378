//! Messages that the standard itself defines (part B, mapping to gRPC).

use prost::Message;

/// A text.
#[derive(Clone, PartialEq, Message)]
pub struct Text {
    /// The text.
    #[prost(string, tag = "1")]
    pub value: String,
}

/// A whole number.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Integer {
    /// The number.
    #[prost(int64, tag = "1")]
    pub value: i64,
}

/// A number.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Real {
    /// The number.
    #[prost(double, tag = "1")]
    pub value: f64,
}

/// A truth value.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Boolean {
    /// The value.
    #[prost(bool, tag = "1")]
    pub value: bool,
}

/// A span of time.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Duration {
    /// s.
    #[prost(int64, tag = "1")]
    pub seconds: i64,
    /// ns.
    #[prost(int32, tag = "2")]
    pub nanos: i32,
}

impl Duration {
    /// Of so many seconds.
    pub fn of(seconds: f64) -> Self {
        let seconds = if seconds.is_finite() { seconds.clamp(0.0, 1e12) } else { 0.0 };
        Duration { seconds: seconds as i64, nanos: (seconds.fract() * 1e9) as i32 }
    }
}

/// Which execution of a command.
#[derive(Clone, PartialEq, Message)]
pub struct Execution {
    /// Its name.
    #[prost(string, tag = "1")]
    pub value: String,
}

/// A command that lasts has begun.
#[derive(Clone, PartialEq, Message)]
pub struct Confirmation {
    /// Which execution it is.
    #[prost(message, optional, tag = "1")]
    pub execution: Option<Execution>,
    /// How long its end can be asked for.
    #[prost(message, optional, tag = "2")]
    pub lifetime: Option<Duration>,
}

/// How an execution stands.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Info {
    /// One of [`Stage`].
    #[prost(enumeration = "Stage", tag = "1")]
    pub stage: i32,
    /// From 0 to 1.
    #[prost(message, optional, tag = "2")]
    pub progress: Option<Real>,
    /// How long it will still take.
    #[prost(message, optional, tag = "3")]
    pub remaining: Option<Duration>,
    /// How long its end can be asked for.
    #[prost(message, optional, tag = "4")]
    pub lifetime: Option<Duration>,
}

/// Where an execution stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
pub enum Stage {
    /// Not begun.
    Waiting = 0,
    /// Going on.
    Running = 1,
    /// Ended well.
    Done = 2,
    /// Ended otherwise.
    Failed = 3,
}

/// Why a call came to nothing.
#[derive(Clone, PartialEq, Message)]
pub struct Error {
    /// Which kind.
    #[prost(oneof = "Kind", tags = "1, 2, 3, 4")]
    pub kind: Option<Kind>,
}

/// Kinds of errors.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum Kind {
    /// An argument is none.
    #[prost(message, tag = "1")]
    Validation(Fully),
    /// One that the feature defines.
    #[prost(message, tag = "2")]
    Defined(Fully),
    /// Another.
    #[prost(message, tag = "3")]
    Undefined(Words),
    /// The standard's own.
    #[prost(message, tag = "4")]
    Framework(Framework),
}

/// An error about something that has a full identifier.
#[derive(Clone, PartialEq, Message)]
pub struct Fully {
    /// Of the parameter or the error.
    #[prost(string, tag = "1")]
    pub identifier: String,
    /// In words.
    #[prost(string, tag = "2")]
    pub message: String,
}

/// An error in words.
#[derive(Clone, PartialEq, Message)]
pub struct Words {
    /// In words.
    #[prost(string, tag = "1")]
    pub message: String,
}

/// An error of the standard's own.
#[derive(Clone, PartialEq, Message)]
pub struct Framework {
    /// One of [`Refusal`].
    #[prost(enumeration = "Refusal", tag = "1")]
    pub refusal: i32,
    /// In words.
    #[prost(string, tag = "2")]
    pub message: String,
}

/// Errors of the standard's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
pub enum Refusal {
    /// Not now.
    NotAccepted = 0,
    /// There is no such execution.
    NoExecution = 1,
    /// It has not ended.
    NotFinished = 2,
    /// What goes beside the call is none.
    Metadata = 3,
    /// Nothing goes beside this call.
    NoMetadata = 4,
}

impl Refusal {
    /// As the standard calls it.
    pub fn name(self) -> &'static str {
        match self {
            Refusal::NotAccepted => "CommandExecutionNotAccepted",
            Refusal::NoExecution => "InvalidCommandExecutionUUID",
            Refusal::NotFinished => "CommandExecutionNotFinished",
            Refusal::Metadata => "InvalidMetadata",
            Refusal::NoMetadata => "NoMetadataAllowed",
        }
    }
}
