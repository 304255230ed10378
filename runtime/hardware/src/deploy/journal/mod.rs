//! The journal of a deployment: one JSON object a line, added at the end, on disk before what it says is done. Each line carries the
//! digest of the one before, and the head says how many there are, so that a journal that was cut or edited is known for one.

mod chain;
mod counterfoil;
mod entry;
mod paper;

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

use matterix_ir::Program;
use serde::{Deserialize, Serialize};

pub use chain::{Chain, sha256};
pub use entry::{Entry, Gate, Turn, VERSION};
pub use paper::{Paper, Sheet};

use counterfoil::Counterfoil;
use paper::Taken;

/// Longest journal that is read, bytes.
const LONGEST: u64 = 1 << 30;

/// Longest line of one, bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// Why a journal cannot be used, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JournalError {
    /// The file: the system, or its name.
    File(String),
    /// Another process has it.
    Busy(String),
    /// It is not as it was written.
    Damaged(String),
}

impl JournalError {
    /// In words.
    pub fn text(&self) -> &str {
        match self {
            JournalError::File(text) | JournalError::Busy(text) | JournalError::Damaged(text) => text,
        }
    }
}

/// A line as it is written.
#[derive(Serialize, Deserialize)]
struct Line<E> {
    /// Digest of the line before.
    after: String,
    #[serde(flatten)]
    entry: E,
}

/// Is shown lines of a journal.
pub type Reader = dyn FnMut(&Entry);

/// A journal being written.
#[derive(Default)]
pub struct Journal {
    paper: Option<Box<dyn Paper>>,
    chain: Chain,
    /// Whether what it got to is kept beside it too, and where.
    foil: Foil,
    /// Why nothing more was written.
    pub broken: Option<String>,
    /// Is shown each line as it is written.
    reader: Option<Box<Reader>>,
}

/// What is kept beside a journal.
#[derive(Debug, Default)]
enum Foil {
    /// Nothing.
    #[default]
    Not,
    /// Something, from the first line on that is kept.
    Due,
    /// This.
    Kept(Counterfoil),
}

/// A journal that was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Past {
    /// What it says.
    pub entries: Vec<Entry>,
    /// How far its chain goes.
    pub chain: Chain,
    /// Bytes of its whole lines: what comes after them broke off.
    pub whole: u64,
}

impl Journal {
    /// None: nothing is kept.
    pub fn none() -> Self {
        Journal::default()
    }

    /// A new one; an error where there is one already.
    pub fn create(path: &Path) -> Result<Self, JournalError> {
        let sheet = Sheet::create(path).map_err(|taken| match taken {
            Taken::Io(e) if e.kind() == ErrorKind::AlreadyExists => {
                let there = format!("the file `{}` already exists", path.display());
                JournalError::File(format!(
                    "{there}: choose another name for the journal, or resume it with `--resume`"
                ))
            }
            Taken::Io(e) => JournalError::File(format!("cannot create the journal `{}`: {e}", path.display())),
            Taken::Locked => busy(path),
        })?;
        let begun = Chain::fresh().and_then(|chain| Journal::begun(Box::new(sheet), chain));
        let begun = begun.map(|journal| Journal { foil: Foil::Due, ..journal });
        begun.map_err(|e| JournalError::File(format!("cannot write the journal `{}`: {e}", path.display())))
    }

    /// A new one on paper that is empty.
    pub fn on(paper: Box<dyn Paper>) -> std::io::Result<Self> {
        Journal::begun(paper, Chain::default())
    }

    fn begun(mut paper: Box<dyn Paper>, chain: Chain) -> std::io::Result<Self> {
        paper.append(chain.head().as_bytes())?;
        Ok(Journal { paper: Some(paper), chain, ..Journal::default() })
    }

    /// One that is gone on with, as it was read from the same paper.
    pub fn after(paper: Box<dyn Paper>, past: &Past) -> Self {
        Journal { paper: Some(paper), chain: past.chain.clone(), ..Journal::default() }
    }

    /// One that is gone on with, and what it says so far. A last line that broke off is cut away. Where nothing beside it says how far
    /// it got, as on another machine, somebody has to vouch for it.
    pub fn reopen(path: &Path, is_vouched: bool) -> Result<(Self, Vec<Entry>), JournalError> {
        let wrong = |e: &dyn std::fmt::Display| format!("cannot read the journal `{}`: {e}", path.display());
        let mut sheet = Sheet::open(path).map_err(|taken| match taken {
            Taken::Io(e) => JournalError::File(wrong(&e)),
            Taken::Locked => busy(path),
        })?;
        let told = sheet.told();
        let found =
            told.as_ref().map_or(Ok(None), |chain| Counterfoil::find(&chain.id)).map_err(|taken| match taken {
                Taken::Io(e) => JournalError::File(wrong(&format!("its counterfoil: {e}"))),
                Taken::Locked => busy(path),
            })?;
        let is_begun = told.is_some_and(|chain| chain.lines > 0);
        if found.is_none() && is_begun && !is_vouched {
            let why = "this computer has no record of its last line, so it may be an older copy";
            let help = "make sure that it is the newest, then use `--resume --vouch`";
            return Err(JournalError::File(format!(
                "the journal `{}` has no counterfoil: {why}; {help}",
                path.display()
            )));
        }
        let (mut foil, known) = match found {
            Some((foil, known)) => (Foil::Kept(foil), Some(known)),
            None => (Foil::Due, None),
        };
        let file = File::open(path).map_err(|e| JournalError::File(wrong(&e)))?;
        let mut past = read_known(BufReader::new(file), known.as_ref()).map_err(|why| {
            // What it was about is made safe now: it stays as it is when somebody mends the file.
            sheet.shut();
            if let (Foil::Kept(foil), Some(known)) = (&mut foil, &known) {
                // Nothing is gone on with either where this cannot be said.
                let _ = foil.mark(&Chain { is_shut: true, ..known.clone() });
            }
            JournalError::Damaged(format!("the journal `{}` {why}", path.display()))
        })?;
        past.chain.is_shut |= known.is_some_and(|known| known.is_shut);
        sheet.cut(past.whole).map_err(|e| JournalError::File(wrong(&e)))?;
        Ok((Journal { foil, ..Journal::after(Box::new(sheet), &past) }, past.entries))
    }

    /// Whether one is kept.
    pub fn is_kept(&self) -> bool {
        self.paper.is_some()
    }

    /// Nobody goes on from here, as devices were made safe without a line that says so. The head has room for that also where the disk
    /// is full.
    pub fn shut(&mut self) {
        self.chain.is_shut = true;
        if let Some(paper) = &mut self.paper {
            // What cannot be written over is not there any more, or cannot be read either.
            let _ = paper.head(self.chain.head().as_bytes()).and_then(|()| paper.sync());
        }
        if let Foil::Kept(foil) = &mut self.foil {
            // Where it cannot be said here, the head says it.
            let _ = foil.mark(&self.chain);
        }
    }

    /// Whether nobody goes on from here.
    pub fn is_shut(&self) -> bool {
        self.chain.is_shut
    }

    /// Nothing more is written: it is left as it is.
    pub fn seal(&mut self) {
        (self.paper, self.foil) = (None, Foil::Not);
    }

    /// From here on `reader` is shown each line as it is written, also where writing fails.
    pub fn show_to(&mut self, reader: Box<Reader>) {
        self.reader = Some(reader);
    }

    /// Writes a line that may get lost with the machine.
    pub fn note(&mut self, entry: &Entry) {
        if let Some(reader) = &mut self.reader {
            reader(entry);
        }
        let Some(paper) = self.paper.as_mut().filter(|_| self.broken.is_none()) else { return };
        let line = Line { after: self.chain.last.clone(), entry };
        let written = serde_json::to_string(&line).map_err(|e| e.to_string()).and_then(|text| {
            let before = self.chain.clone();
            self.chain.grow(text.as_bytes());
            let written =
                paper.append((text + "\n").as_bytes()).and_then(|()| paper.head(self.chain.head().as_bytes()));
            written.map_err(|e| {
                self.chain = before;
                e.to_string()
            })
        });
        self.broken = written.err();
    }

    /// Writes a line and waits until it is on disk.
    pub fn keep(&mut self, entry: &Entry) -> Result<(), String> {
        // Before the first line: without it nothing is written, and another attempt finds no journal.
        if let (Foil::Due, None) = (&self.foil, &self.broken) {
            match Counterfoil::create(&self.chain.id) {
                Ok(foil) => self.foil = Foil::Kept(foil),
                Err(e) => self.broken = Some(format!("its counterfoil: {e}")),
            }
        }
        self.note(entry);
        if let (Some(paper), None) = (&mut self.paper, &self.broken) {
            self.broken = paper.sync().err().map(|e| e.to_string());
        }
        // A copy without what came of the last command, or of a question, says that again which may be said twice, or is refused.
        let follows =
            matches!(entry, Entry::Started { .. } | Entry::Ended { .. } | Entry::Asked { .. } | Entry::Answered { .. });
        if self.broken.is_none() && !follows {
            self.broken = self.mark().err().map(|e| format!("its counterfoil: {e}"));
        }
        match &self.broken {
            Some(why) => Err(format!("the journal cannot be written: {why}")),
            None => Ok(()),
        }
    }

    /// Says beside it how far it got, before anything is done that an older copy would not know of.
    fn mark(&mut self) -> std::io::Result<()> {
        match &mut self.foil {
            Foil::Kept(foil) => foil.mark(&self.chain),
            Foil::Not | Foil::Due => Ok(()),
        }
    }
}

/// That another process has a journal, by what it says of that.
fn busy(path: &Path) -> JournalError {
    let past = File::open(path).ok().and_then(|file| read(BufReader::new(file)).ok()).unwrap_or_default();
    let who = past.entries.iter().rev().find_map(|e| match e {
        Entry::Begin { pid, who, .. } | Entry::Resumed { pid, who, .. } => {
            Some(format!("process {pid} (started by {who})"))
        }
        _ => None,
    });
    let who = who.unwrap_or_else(|| "another process".to_owned());
    JournalError::Busy(format!("{who} is writing the journal `{}`: wait for its end, or stop it first", path.display()))
}

/// Whether nothing was ever written into a journal but its head.
pub fn is_unused(path: &Path) -> bool {
    let length = Chain::default().head().len() as u64;
    if !std::fs::metadata(path).is_ok_and(|there| there.is_file() && there.len() == length) {
        return false;
    }
    // One that was emptied while it was written says in its head how much there was.
    let chain = std::fs::read(path).ok().and_then(|text| Chain::of_head(&text));
    chain.is_some_and(|chain| chain == chain.begun())
}

/// Reads a journal; why it is not one as it was written, as what is said of it.
pub fn read(from: impl Read) -> Result<Past, String> {
    read_known(from, None)
}

/// Reads a journal of which is known how far it got.
fn read_known(from: impl Read, known: Option<&Chain>) -> Result<Past, String> {
    let mut reader = BufReader::new(from).take(LONGEST);
    let mut head = Vec::new();
    let is_there = next_line(&mut reader, &mut head)?;
    if head.is_empty() {
        return Err("is empty".to_owned());
    }
    let told = Chain::of_head(&head).filter(|_| is_there).ok_or("does not start like a journal")?;
    let mut past = Past { whole: head.len() as u64, chain: told.begun(), entries: Vec::new() };
    past.chain.is_shut = told.is_shut;
    if told.lines == 0 && told != past.chain {
        return Err("was edited: its head has changed".to_owned());
    }
    let mut line = Vec::new();
    while next_line(&mut reader, &mut line)? {
        let number = past.chain.lines + 2;
        let text = &line[..line.len() - 1];
        let parsed: Result<Line<Entry>, _> = serde_json::from_slice(text);
        let Line { after, entry } =
            parsed.map_err(|e| format!("was edited: line {number} is not a line of a journal: {e}"))?;
        if after != past.chain.last {
            return Err(format!("was edited: line {number} does not follow the line before it"));
        }
        past.chain.grow(text);
        past.whole += line.len() as u64;
        past.entries.push(entry);
        let is_other = |then: &Chain| past.chain.lines == then.lines && past.chain.last != then.last;
        if is_other(&told) || known.is_some_and(is_other) {
            return Err(format!("was edited: line {number} has changed"));
        }
    }
    if reader.limit() == 0 {
        return Err(format!("is longer than {LONGEST} bytes"));
    }
    if past.chain.lines < told.lines {
        return Err(format!("was cut short: it has {} lines of {}", past.chain.lines + 1, told.lines + 1));
    }
    if let Some(then) = known.filter(|then| past.chain.lines < then.lines) {
        let (is, was) = (past.chain.lines + 1, then.lines + 1);
        return Err(format!(
            "is an older copy: it has {is} lines, but {was} were written before the last command to a device"
        ));
    }
    Ok(past)
}

/// The next line with its end, or none where there is none, or only the beginning of one.
fn next_line(reader: &mut impl BufRead, line: &mut Vec<u8>) -> Result<bool, String> {
    line.clear();
    let length = reader.take(LONGEST_LINE).read_until(b'\n', line).map_err(|e| format!("cannot be read: {e}"))?;
    if length as u64 == LONGEST_LINE {
        return Err(format!("was edited: it has a line of more than {LONGEST_LINE} bytes"));
    }
    Ok(line.last() == Some(&b'\n'))
}

/// What tells one program from another, as hexadecimal digits: what its text means, not in which folder it is.
pub fn digest(program: &Program, bindings: &str) -> Result<String, String> {
    let program = Program { files: Vec::new(), ..program.clone() };
    let mut text = serde_json::to_vec(&program).map_err(|e| e.to_string())?;
    text.extend(bindings.bytes());
    Ok(sha256(&text))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;

    /// Paper in memory.
    #[derive(Clone, Default)]
    struct Slate(Rc<RefCell<Vec<u8>>>);

    impl Paper for Slate {
        fn append(&mut self, bytes: &[u8]) -> std::io::Result<()> {
            self.0.borrow_mut().extend(bytes);
            Ok(())
        }

        fn head(&mut self, bytes: &[u8]) -> std::io::Result<()> {
            self.0.borrow_mut()[..bytes.len()].copy_from_slice(bytes);
            Ok(())
        }

        fn sync(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn written() -> (Vec<u8>, Vec<Entry>) {
        let slate = Slate::default();
        let mut journal = Journal::on(Box::new(slate.clone())).expect("it is written");
        let entries = vec![
            Entry::Opened { t: 0.0, wall: 1.5 },
            Entry::Told { t: 1.25, name: "plate.temperature".into(), value: 303.15 },
            Entry::Gate { t: 2.0, to: Gate::Pause, who: "\"x\"\n".into(), wall: 3.0 },
            Entry::Ended { t: 1e-9, ticket: u64::MAX, failed: Some(("refused".into(), "no".into())) },
        ];
        for entry in &entries {
            journal.keep(entry).expect("it is written");
        }
        let bytes = slate.0.borrow().clone();
        (bytes, entries)
    }

    #[test]
    fn a_journal_says_what_was_written_and_a_line_that_broke_off_is_left_out() {
        let (bytes, entries) = written();
        let past = read(&bytes[..]).expect("it is whole");
        assert_eq!(past.entries, entries);
        assert_eq!(past.whole, bytes.len() as u64);
        let torn = [&bytes[..], b"{\"after\":\"12"].concat();
        let read = read(&torn[..]).expect("the rest is whole");
        assert_eq!((read.entries, read.whole), (entries, bytes.len() as u64));
    }

    #[test]
    fn a_journal_that_was_changed_at_any_byte_or_cut_anywhere_is_known_for_one() {
        let (bytes, _) = written();
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut changed = bytes.clone();
                changed[at] ^= 1 << bit;
                assert!(read(&changed[..]).is_err(), "byte {at}, bit {bit}: {}", changed.escape_ascii());
            }
            assert!(read(&bytes[..at]).is_err(), "cut at {at}");
        }
    }

    #[test]
    fn a_process_that_was_killed_between_line_and_head_is_gone_on_with() {
        let (bytes, entries) = written();
        let shorter = read(&bytes[..]).map(|_| ()).and_then(|()| {
            let mut chain = Chain::default();
            for line in bytes.split(|b| *b == b'\n').skip(1).take(3) {
                chain.grow(line);
            }
            let mut late = bytes.clone();
            let head = chain.head();
            late[..head.len()].copy_from_slice(head.as_bytes());
            read(&late[..])
        });
        assert_eq!(shorter.expect("it is whole").entries, entries);
    }
}
