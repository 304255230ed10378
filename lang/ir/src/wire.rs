//! How the devices of a lab are spoken to: what drivers say of lines, words and replies, as data.

use serde::{Deserialize, Serialize};

use crate::form::Form;
use crate::framing::Frames;
use crate::plan::{Operation, StepId};
use crate::scene::InstanceId;
use crate::{NodeId, Span, Unit};

/// The line a driver speaks over, as it declares it; which port or address that is, a binding says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transport {
    /// A serial port.
    Serial {
        /// Bits per second.
        baud: u32,
        /// 5 to 8.
        data_bits: u8,
        /// `N`, `E` or `O`.
        parity: char,
        /// 1 or 2.
        stop_bits: u8,
    },
    /// A connection over a network.
    Tcp,
    /// A server of SiLA 2.
    Sila {
        /// Full identifier of the feature that is meant where a text names none.
        feature: String,
        /// The definition that the driver was made from, as `matterix_sila::form` packs it: what the server offers must be that.
        definition: Option<String>,
    },
    /// Requests to a server, bodies in JSON; see [`crate::message`].
    Http {
        /// Name and value of a header that every request has.
        header: Option<(String, String)>,
    },
}

/// What stands around messages on a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Framing {
    /// As a text declares it.
    Frames(Frames),
    /// Tecan Cavro pumps, the protocol for terminals.
    CavroDt,
    /// Tecan Cavro pumps, with checksums and numbered frames.
    CavroOem,
    /// Bodies in JSON.
    Json,
    /// Commands are calls of a server: each is one text.
    Calls,
}

/// Names of the framings that no text declares: a status with the answer, several commands in a frame, a frame sent once more.
pub const BUILT_IN: &[(&str, Framing)] = &[("cavro_dt", Framing::CavroDt), ("cavro_oem", Framing::CavroOem)];

/// The driver over whose line another one speaks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// Its device.
    pub instance: InstanceId,
    /// Its name.
    pub driver: String,
}

/// A piece of what is sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Piece {
    /// As written.
    Plain(String),
    /// A number in a unit.
    Number {
        /// SI.
        value: NodeId,
        /// As sent.
        unit: Unit,
        /// How it is written.
        form: Form,
    },
    /// One of these words, by its index.
    Word(NodeId, Vec<String>),
}

/// A text to send, with values that are known when it is sent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Template {
    /// In order.
    pub pieces: Vec<Piece>,
    /// Where it is declared.
    pub span: Span,
}

impl Template {
    /// Whether it says nothing at all.
    pub fn is_blank(&self) -> bool {
        self.pieces.iter().all(|piece| matches!(piece, Piece::Plain(text) if text.is_empty()))
    }

    /// The text with the same in place of every value.
    pub fn with(&self, value: &str) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Plain(text) => text.clone(),
            Piece::Number { .. } | Piece::Word(..) => value.to_owned(),
        };
        self.pieces.iter().map(piece).collect()
    }
}

/// A piece of what a reply looks like. A blank stands for any number of blanks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Slot {
    /// As written.
    Plain(String),
    /// A number in this unit.
    Number(Unit, Form),
    /// One of these words.
    Word(Vec<Choice>),
    /// So many characters, whatever they are.
    Skip(u8),
    /// Anything, which is kept in the journal under this name.
    Kept(String),
    /// Anything.
    Any,
}

/// A word of an enumeration, and what stands for it on the line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Choice {
    /// On the line; anything else where absent.
    pub sent: Option<String>,
    /// What it means.
    pub word: String,
    /// Its index among the words of what is told.
    pub index: u32,
}

/// What a reply looks like.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pattern {
    /// In order.
    pub slots: Vec<Slot>,
    /// What the replies to the second frame and those after it look like, where each has its own.
    pub then: Vec<Pattern>,
    /// Where it is declared.
    pub span: Span,
}

impl Pattern {
    /// What the reply to a frame looks like, by its place among those that are sent.
    pub fn of(&self, place: usize) -> &Pattern {
        place.checked_sub(1).and_then(|later| self.then.get(later)).unwrap_or(self)
    }

    /// The text with the same in place of all that may differ.
    pub fn with(&self, value: &str) -> String {
        let slot = |slot: &Slot| match slot {
            Slot::Plain(text) => text.clone(),
            Slot::Number(..) | Slot::Word(_) | Slot::Skip(_) | Slot::Kept(_) | Slot::Any => value.to_owned(),
        };
        self.slots.iter().map(slot).collect()
    }
}

/// What is said to a device at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exchange {
    /// What goes out, in order.
    pub sends: Vec<Template>,
    /// What comes back to each; see [`Pattern::of`].
    pub expects: Option<Pattern>,
    /// How its end is known.
    pub until: Option<Until>,
    /// Where it is declared.
    pub span: Span,
}

/// A question whose answer tells a device from others of its kind, as by its serial number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// What goes out and what comes back.
    pub exchange: Exchange,
    /// The words under which the answer keeps what tells it.
    pub words: Vec<String>,
}

/// How the end of what a device does is known: it is asked again and again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Until {
    /// What goes out.
    pub asks: Template,
    /// What comes back in the end; without it the device is ready when its framing says so.
    pub expects: Option<Pattern>,
    /// At most so long, s.
    pub timeout: NodeId,
}

/// A quantity that a device tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// `plate.temperature`.
    pub name: String,
    /// What is told, as the model has it.
    pub value: NodeId,
    /// The reading it is, by index; absent for a state or what follows from states.
    pub reading: Option<u32>,
    /// The state it is, by index; absent for a reading and what follows from states.
    pub state: Option<u32>,
    /// As shown.
    pub unit: Unit,
    /// The unit that a difference of two values is given in.
    pub difference: Unit,
    /// It is what the device tells only while this is not 0.
    pub condition: Option<NodeId>,
    /// Its words, where it is one of some.
    pub words: Vec<String>,
    /// The device says it by itself, so often, s; it is not asked.
    pub heard: Option<f64>,
    /// What goes out.
    pub asks: Template,
    /// What comes back.
    pub expects: Pattern,
    /// The least and the most that its instrument can show, SI, where its line says so.
    pub shows: Option<[f64; 2]>,
    /// What may come back instead, where more lines ask the same.
    pub also: Vec<Alternative>,
    /// Its line.
    pub span: Span,
}

impl Told {
    /// What may come back, in the order of the lines, each with what its instrument can show.
    pub fn forms(&self) -> impl Iterator<Item = (&Pattern, Option<[f64; 2]>)> {
        std::iter::once((&self.expects, self.shows)).chain(self.also.iter().map(|f| (&f.expects, f.shows)))
    }

    /// A value for people.
    pub fn show(&self, value: f64) -> String {
        match self.words.get(value as usize) {
            Some(word) => word.clone(),
            None => self.unit.show(value),
        }
    }
}

/// One more form of an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// What comes back.
    pub expects: Pattern,
    /// The least and the most that its instrument can show, SI, where its line says so.
    pub shows: Option<[f64; 2]>,
    /// An emulator answers so while this is not 0.
    pub condition: Option<NodeId>,
}

/// A reply that means a failure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// What the reply looks like.
    pub reply: Pattern,
    /// The failure.
    pub failure: String,
}

/// A command of a device for which an emulator or a repetition needs no plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Served {
    /// Its arguments: the name of each and the local of the plan that stands for it.
    pub arguments: Vec<(String, u32)>,
    /// What it does in the model.
    pub operation: Operation,
    /// What is said.
    pub exchange: Exchange,
}

/// What is repeated while something holds, and what is said when it no longer does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Alive {
    /// While this is not 0.
    pub condition: NodeId,
    /// So often, s.
    pub every: NodeId,
    /// So long the device waits before it stops by itself, s; none where it has no watchdog.
    pub within: Option<NodeId>,
    /// Repeated.
    pub repeated: Served,
    /// At its end.
    pub at_end: Option<Served>,
}

/// A driver on an instance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Driver {
    /// `IkaNamur`.
    pub name: String,
    /// The device.
    pub instance: InstanceId,
    /// What it speaks over.
    pub transport: Transport,
    /// Whose line that is, where it is not its own.
    pub host: Option<Host>,
    /// What stands around its messages.
    pub framing: Framing,
    /// The device's own on a line that several share.
    pub address: Option<String>,
    /// Longest time until a reply has come, s.
    pub timeout: f64,
    /// What asks the device which one of its kind it is, before all else that is said.
    pub identity: Vec<Identity>,
    /// When the line is opened.
    pub open: Vec<Exchange>,
    /// When it is closed.
    pub close: Vec<Exchange>,
    /// To break off what the device does.
    pub halt: Vec<Exchange>,
    /// To leave it safe after a run that did not end well.
    pub safe: Vec<Exchange>,
    /// One of its commands brings its device into a state that it stays in, heating, moving or pumping.
    pub stays_on: bool,
    /// To let it run a file by itself, from giving it the file to its end.
    pub play: Vec<Exchange>,
    /// What keeps its watchdog quiet.
    pub alive: Vec<Alive>,
    /// What it tells.
    pub told: Vec<Told>,
    /// What the device says by itself and nobody needs.
    pub ignores: Vec<Pattern>,
    /// What else an emulator answers.
    pub answers: Vec<(Pattern, Template)>,
    /// Replies that mean failures.
    pub refusals: Vec<Refusal>,
    /// The operations of the plan that it knows.
    pub calls: Vec<(StepId, Exchange)>,
    /// All commands that it knows, where an emulator was asked for.
    pub served: Vec<Served>,
    /// Its declaration.
    pub span: Span,
}

impl Driver {
    /// What a deployment says apart from commands and questions of the plan.
    pub fn said_apart(&self) -> impl Iterator<Item = &Exchange> {
        let identities = self.identity.iter().map(|identity| &identity.exchange);
        identities.chain([&self.open, &self.close, &self.halt, &self.safe].into_iter().flatten())
    }

    /// What the device tells by itself, each with its place among all that it tells.
    pub fn heard(&self) -> impl Iterator<Item = (usize, &Told)> {
        self.told.iter().enumerate().filter(|(_, told)| told.heard.is_some())
    }

    /// What is said for an operation of the plan.
    pub fn call(&self, step: StepId) -> Option<&Exchange> {
        self.calls.iter().find(|(s, _)| *s == step).map(|(_, exchange)| exchange)
    }
}
