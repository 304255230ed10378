//! What a line of a journal says.

use serde::{Deserialize, Serialize};

/// Version of the form.
pub const VERSION: u32 = 5;

/// One line. Times are seconds of lab time, walls seconds since 1970.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Entry {
    /// The first line.
    Begin {
        /// The version of its form.
        version: u32,
        /// The version of the program that wrote it.
        tool: String,
        /// Of the plan with what it rests on: another one does not go on from here.
        digest: String,
        /// The workflow.
        workflow: String,
        /// s since 1970.
        wall: f64,
        /// Seconds of lab time per second.
        speed: f64,
        /// Where the noise of the twin starts.
        seed: u64,
        /// The process that writes.
        pid: u32,
        /// Who started it.
        who: String,
    },
    /// Where a device is bound from here on.
    Bound {
        /// s.
        t: f64,
        /// Its name.
        device: String,
        /// As the bindings have it.
        place: String,
    },
    /// All lines are open, and what drivers say then has been said.
    Opened {
        /// s.
        t: f64,
        /// s since 1970.
        wall: f64,
    },
    /// The clock, from time to time.
    Clock {
        /// s.
        t: f64,
        /// s since 1970.
        wall: f64,
    },
    /// The lab was behind the clock, and went on to this time at once.
    Leap {
        /// s.
        t: f64,
        /// s.
        to: f64,
    },
    /// Devices were asked in between whether they still are as they were told to be, and that came to a fault.
    Looked {
        /// s.
        t: f64,
    },
    /// This process was held up: what was due meanwhile is late.
    HeldUp {
        /// s.
        t: f64,
        /// By the clock, s.
        seconds: f64,
    },
    /// Something began or ended while the lab was behind the clock: it did so at this time.
    Late {
        /// s.
        t: f64,
        /// s.
        to: f64,
        /// What began or ended.
        what: Turn,
    },
    /// An operation is about to be told to its device.
    Starting {
        /// s.
        t: f64,
        /// Its number.
        ticket: u64,
        /// The step of the plan.
        step: u32,
        /// As shown.
        label: String,
        /// `FILE:LINE:COLUMN` of its statement.
        span: String,
        /// The device.
        device: String,
        /// What is sent.
        sends: Vec<String>,
    },
    /// It has been told.
    Started {
        /// s.
        t: f64,
        /// Its number.
        ticket: u64,
    },
    /// It is over.
    Ended {
        /// s.
        t: f64,
        /// Its number.
        ticket: u64,
        /// The failure and what it says, if it failed.
        failed: Option<(String, String)>,
    },
    /// A device told a quantity.
    Told {
        /// s.
        t: f64,
        /// Which.
        name: String,
        /// SI.
        value: f64,
    },
    /// A device told what it was told to be, when that was read back.
    ReadBack {
        /// s.
        t: f64,
        /// Which.
        name: String,
        /// SI.
        value: f64,
    },
    /// Bytes went out with a command, or with a question whose answer made no sense.
    Out {
        /// s.
        t: f64,
        /// To whom.
        device: String,
        /// As shown.
        bytes: String,
    },
    /// Bytes came in, in answer to these.
    Back {
        /// s.
        t: f64,
        /// From whom.
        device: String,
        /// As shown.
        bytes: String,
    },
    /// A question is put once more, as nothing that makes sense answered it.
    Again {
        /// s.
        t: f64,
        /// To whom.
        device: String,
        /// Why.
        why: String,
    },
    /// What an answer said that is put into later messages.
    Kept {
        /// s.
        t: f64,
        /// Whose answer it was.
        device: String,
        /// The word that its driver keeps it under.
        word: String,
        /// What it said.
        text: String,
    },
    /// A question was put to a person.
    Asked {
        /// s.
        t: f64,
        /// Its number.
        ticket: u64,
        /// The step of the plan.
        step: u32,
        /// The question.
        text: String,
        /// s since 1970.
        wall: f64,
    },
    /// A person answered.
    Answered {
        /// s.
        t: f64,
        /// The number of the question.
        ticket: u64,
        /// Whether they confirmed.
        yes: bool,
        /// Who.
        who: String,
        /// s since 1970.
        wall: f64,
    },
    /// A person lets nothing new begin, lets one step begin, or lets all go on.
    Gate {
        /// s.
        t: f64,
        /// `pause`, `step` or `go`.
        to: Gate,
        /// Who.
        who: String,
        /// s since 1970.
        wall: f64,
    },
    /// A person stops it.
    Stop {
        /// s.
        t: f64,
        /// Who.
        who: String,
        /// s since 1970.
        wall: f64,
    },
    /// A device did not do what it should, or told something else than it should.
    Fault {
        /// s.
        t: f64,
        /// How many operations and questions had begun: two steps at one moment may each have met it.
        tickets: u64,
        /// How often a watchdog had been fed: that may have met it, and sets states besides.
        fed: u64,
        /// The device whose line is lost by it.
        lost: Option<String>,
        /// The code.
        code: String,
        /// In words.
        text: String,
    },
    /// What became of a device that was to be made safe.
    Safe {
        /// s.
        t: f64,
        /// Its name.
        device: String,
        /// Why it could not be.
        trouble: Option<String>,
    },
    /// From here on another process has gone on.
    Resumed {
        /// s.
        t: f64,
        /// s since 1970.
        wall: f64,
        /// The process.
        pid: u32,
        /// Who started it.
        who: String,
    },
    /// How it ended.
    End {
        /// s.
        t: f64,
        /// In a word.
        status: String,
        /// s since 1970.
        wall: f64,
        /// Digest of the states of the twin: who replays the journal comes to the same.
        states: String,
    },
}

/// Something that begins or ends where the clock is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turn {
    /// An operation begins, by its number.
    Begins(u64),
    /// Its device has been told it.
    Told(u64),
    /// Its device is ready.
    Ready(u64),
    /// A time that is waited for begins: so many had begun before.
    Waits(u64),
}

/// What may begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gate {
    /// All steps.
    #[default]
    Go,
    /// Nothing that acts.
    Pause,
    /// One step that acts; then nothing more.
    Step,
}

impl Entry {
    /// When it was, s of lab time; the first line is at 0.
    pub fn time(&self) -> f64 {
        match self {
            Entry::Begin { .. } => 0.0,
            Entry::Bound { t, .. }
            | Entry::Opened { t, .. }
            | Entry::Clock { t, .. }
            | Entry::Leap { t, .. }
            | Entry::Looked { t }
            | Entry::HeldUp { t, .. }
            | Entry::Late { t, .. }
            | Entry::Starting { t, .. }
            | Entry::Started { t, .. }
            | Entry::Ended { t, .. }
            | Entry::Told { t, .. }
            | Entry::ReadBack { t, .. }
            | Entry::Out { t, .. }
            | Entry::Back { t, .. }
            | Entry::Again { t, .. }
            | Entry::Kept { t, .. }
            | Entry::Asked { t, .. }
            | Entry::Answered { t, .. }
            | Entry::Gate { t, .. }
            | Entry::Stop { t, .. }
            | Entry::Fault { t, .. }
            | Entry::Safe { t, .. }
            | Entry::Resumed { t, .. }
            | Entry::End { t, .. } => *t,
        }
    }

    /// When it was by the clock, s since 1970, where it says so.
    pub fn wall(&self) -> Option<f64> {
        match self {
            Entry::Begin { wall, .. }
            | Entry::Opened { wall, .. }
            | Entry::Clock { wall, .. }
            | Entry::Asked { wall, .. }
            | Entry::Answered { wall, .. }
            | Entry::Gate { wall, .. }
            | Entry::Stop { wall, .. }
            | Entry::Resumed { wall, .. }
            | Entry::End { wall, .. } => Some(*wall),
            _ => None,
        }
    }
}
