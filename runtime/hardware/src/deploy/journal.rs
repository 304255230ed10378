//! The journal of a deployment: one JSON object a line, only ever appended to, on disk before what it says is done.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::path::Path;

use matterix_ir::Program;
use serde::{Deserialize, Serialize};

/// Version of the form.
pub const VERSION: u32 = 1;

/// One line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Entry {
    /// The first line.
    Begin {
        /// The version of its form.
        version: u32,
        /// Of the program and its bindings: another program does not go on from here.
        digest: String,
        /// The workflow.
        workflow: String,
        /// s since 1970.
        wall: f64,
        /// Seconds of lab time per second.
        speed: f64,
    },
    /// All lines are open, and what drivers say then has been said.
    Opened {
        /// s.
        t: f64,
    },
    /// The lab has come to this time.
    Time {
        /// s.
        t: f64,
        /// Which watched conditions hold.
        fired: Vec<usize>,
        /// s since 1970.
        wall: f64,
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
        /// `plate.temperature`.
        name: String,
        /// SI.
        value: f64,
    },
    /// Bytes that went out.
    Out {
        /// s.
        t: f64,
        /// To whom.
        device: String,
        /// As shown.
        bytes: String,
    },
    /// Bytes that came in.
    Back {
        /// s.
        t: f64,
        /// From whom.
        device: String,
        /// As shown.
        bytes: String,
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
    /// From here on another process has gone on.
    Resumed {
        /// s.
        t: f64,
        /// s since 1970.
        wall: f64,
    },
    /// How it ended.
    End {
        /// s.
        t: f64,
        /// In a word.
        status: String,
    },
}

/// Why a journal cannot be used, in words.
pub type JournalError = String;

/// A journal being written.
#[derive(Debug, Default)]
pub struct Journal {
    file: Option<File>,
    /// Why nothing more was written.
    pub broken: Option<String>,
}

impl Journal {
    /// None: nothing is kept.
    pub fn none() -> Self {
        Journal::default()
    }

    /// A new one; an error where there is one already.
    pub fn create(path: &Path) -> Result<Self, JournalError> {
        let file = OpenOptions::new().append(true).create_new(true).open(path);
        let file = file.map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists => {
                let there = format!("there is a file `{}` already", path.display());
                format!("{there}: give the journal another name, or go on after it with `--resume`")
            }
            _ => format!("cannot create the journal `{}`: {e}", path.display()),
        })?;
        Ok(Journal { file: Some(file), broken: None })
    }

    /// One that is gone on with, and what it says so far. A last line that broke off is left out and cut away.
    pub fn reopen(path: &Path) -> Result<(Self, Vec<Entry>), JournalError> {
        let wrong = |e: &dyn std::fmt::Display| format!("cannot read the journal `{}`: {e}", path.display());
        let mut reader = BufReader::new(File::open(path).map_err(|e| wrong(&e))?);
        let (mut entries, mut whole, mut number) = (Vec::new(), 0_u64, 0_u64);
        loop {
            let mut line = Vec::new();
            let length = reader.read_until(b'\n', &mut line).map_err(|e| wrong(&e))?;
            number += 1;
            if length == 0 || line.last() != Some(&b'\n') {
                break;
            }
            let entry = serde_json::from_slice(&line);
            entries.push(entry.map_err(|e| format!("line {number} of the journal `{}`: {e}", path.display()))?);
            whole += length as u64;
        }
        let file = OpenOptions::new().append(true).open(path).map_err(|e| wrong(&e))?;
        file.set_len(whole).map_err(|e| wrong(&e))?;
        Ok((Journal { file: Some(file), broken: None }, entries))
    }

    /// Nothing more is written: it is left as it is.
    pub fn seal(&mut self) {
        self.file = None;
    }

    /// Writes a line that may get lost with the machine.
    pub fn note(&mut self, entry: &Entry) {
        let Some(file) = self.file.as_mut().filter(|_| self.broken.is_none()) else { return };
        let line = serde_json::to_string(entry).map(|line| line + "\n");
        let written =
            line.map_err(|e| e.to_string()).and_then(|l| file.write_all(l.as_bytes()).map_err(|e| e.to_string()));
        self.broken = written.err();
    }

    /// Writes a line and waits until it is on disk.
    pub fn keep(&mut self, entry: &Entry) -> Result<(), JournalError> {
        self.note(entry);
        if let (Some(file), None) = (&self.file, &self.broken) {
            self.broken = file.sync_data().err().map(|e| e.to_string());
        }
        match &self.broken {
            Some(why) => Err(format!("the journal cannot be written: {why}")),
            None => Ok(()),
        }
    }
}

/// What tells one program with its bindings from another, as hexadecimal digits: FNV-1a over its serialised form.
pub fn digest(program: &Program, bindings: &str) -> Result<String, String> {
    let text = serde_json::to_string(program).map_err(|e| e.to_string())?;
    let bytes = text.bytes().chain(bindings.bytes());
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    Ok(format!("{hash:016x}"))
}
