//! Devices, their twin and the clock, as they are while a plan is carried out.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::rc::Rc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_ir::wire::Exchange;
use matterix_ir::{Code, NodeId, Program, Sources, Span, codes};
use matterix_runtime::backend::{Backend, Sim, Ticket};
use matterix_runtime::fault::Fault;

use super::Trace;
use super::control::Control;
use super::device::Device;
use super::exposed::Exposed;
use super::identity::Words;
use super::journal::{Entry, Gate, Journal, sha256};
use super::observe::Observed;
use crate::link::DeviceError;
use crate::shared::Shared;
use crate::world::World;

/// What a deployment does with devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is sent; what would be is shown.
    Dry,
    /// Devices do it.
    Real,
    /// Devices do it, and what they tell is held against the twin.
    Shadow,
    /// Nothing is sent: what a journal says is gone through again.
    Replay,
}

/// What a deployment is given.
pub struct Settings<'t> {
    /// What is done with devices.
    pub mode: Mode,
    /// Seconds of lab time per second: 1, unless all devices are emulators as fast.
    pub speed: f64,
    /// What people say meanwhile.
    pub control: &'t Control,
    /// Set when the plan is to end early.
    pub ended: &'t AtomicBool,
    /// Clocks and ports.
    pub world: Rc<dyn World>,
    /// Kept up to date with what is told to devices.
    pub exposed: &'t Exposed,
}

/// A device that could not be reached before anything was said to any.
#[derive(Clone, Debug)]
pub struct Unreached {
    /// Its name.
    pub device: String,
    /// Where it is bound.
    pub at: Span,
    /// What is there instead.
    pub trouble: DeviceError,
}

/// An operation that goes on.
pub(super) struct Running<'m> {
    pub(super) step: StepId,
    pub(super) device: usize,
    pub(super) twin: Ticket,
    pub(super) exchange: Option<&'m Exchange>,
    /// When it must be ready at the latest, s.
    pub(super) deadline: f64,
    pub(super) ready: bool,
    pub(super) failed: Option<(String, String)>,
    /// Whether it sets anything, and which states, for reading them back.
    pub(super) changed: bool,
    pub(super) set: Vec<u32>,
    /// What answers said when it began: others may speak for the same device before its end.
    pub(super) words: Vec<(String, String)>,
    /// A person does it, and has not confirmed yet.
    pub(super) by_hand: bool,
}

/// Devices, their twin and the clock.
pub struct Hardware<'m, 't> {
    pub(super) program: &'m Program,
    pub(super) sources: &'m Sources,
    pub(super) twin: Sim<'m>,
    pub(super) devices: Vec<Device<'m>>,
    pub(super) observed: Observed,
    pub(super) settings: Settings<'t>,
    pub(super) journal: Journal,
    pub(super) trace: Box<Trace<'t>>,
    /// When the journal that is gone through again ends, s.
    pub(super) ends_at: f64,
    /// What an earlier process wrote, as far as it has not been gone through again.
    pub(super) replay: VecDeque<Entry>,
    /// Lab time and the clock at one moment.
    pub(super) origin: (f64, Duration),
    /// When the journal last said what the clock shows, s since 1970.
    pub(super) dated: f64,
    /// What may begin.
    pub(super) gate: Gate,
    /// Answers that had been given when it was last looked; while a journal is gone through, lines that were left then.
    pub(super) answers: usize,
    /// Questions that are open, as they were put.
    pub(super) questions: BTreeMap<Ticket, String>,
    /// An earlier process is followed, and devices have not been asked yet.
    pub(super) resuming: bool,
    /// It was refused to go on: what is there is not known well enough for anything but making it safe.
    pub(super) refused: std::cell::Cell<bool>,
    /// Going on after a journal, this device did not answer when it was first asked.
    pub(super) unreached: Option<Unreached>,
    /// Devices are being made safe.
    pub(super) securing: bool,
    /// Devices that have been.
    pub(super) made_safe: Vec<usize>,
    /// Where devices are bound that did not break off what they did, and why.
    pub(super) unhalted: Vec<(Span, String)>,
    /// Lab time and s since 1970 when it is last known that somebody looked after devices.
    pub(super) left_at: (f64, f64),
    /// What answers over an earlier line said: the device whose line it was, the one that had asked, the word, the text.
    pub(super) kept: Vec<(usize, InstanceId, String, String)>,
    /// What answers said when operations of an earlier process began, by ticket.
    pub(super) begun_with: BTreeMap<u64, Vec<(String, String)>>,
    /// States that a command sets of which it is not known whether its device was told it.
    pub(super) half_said: Vec<u32>,
    /// States that devices were told.
    pub(super) commanded: BTreeSet<u32>,
    pub(super) running: BTreeMap<Ticket, Running<'m>>,
    pub(super) tickets: u64,
    /// How often watchdogs have been fed, or told that they need not listen.
    pub(super) fed: u64,
    /// What was told at this instant, since a command was last taken or finished.
    pub(super) fresh: BTreeMap<NodeId, (f64, f64)>,
    pub(super) cancelled: bool,
    /// Who goes on after a journal.
    pub(super) who: String,
    /// It is known by now that the journal cannot be written.
    pub(super) is_unwritten: bool,
    /// The device whose line was lost last, until that is noted.
    pub(super) losing: Option<String>,
    /// The last fault that was noted.
    pub(super) noted: Option<String>,
    /// How many times that are waited for have begun.
    pub(super) waits: u64,
    /// Limits that broke while the lab caught up with the clock, and that nobody has been told of.
    pub(super) broken_meanwhile: Vec<u32>,
    /// Where each device was bound when that was last noted, by its name.
    pub(super) places: BTreeMap<String, String>,
    /// What devices said first that is kept, after the journal that is gone on with.
    pub(super) said_first: Words,
    /// When devices were last asked in between whether they are as they were told to be, by the clock that never goes back.
    pub(super) looked: Duration,
    /// A device or a line has failed: what else differs follows from that.
    pub(super) is_troubled: bool,
    /// When this process was held up, s of lab time, and for how long, s by the clock.
    pub(super) held_up: Vec<(f64, f64)>,
    /// The lab time that the clock had come to when a journal was gone on with, s.
    pub(super) caught_up: Option<f64>,
}

impl<'m, 't> Hardware<'m, 't> {
    /// Devices whose lines are not open yet, with a twin that has been started.
    pub fn new(
        program: &'m Program,
        sources: &'m Sources,
        twin: Sim<'m>,
        devices: Vec<Device<'m>>,
        settings: Settings<'t>,
        journal: Journal,
        trace: Box<Trace<'t>>,
    ) -> Self {
        let mut told = BTreeMap::new();
        for (d, device) in devices.iter().enumerate() {
            for (t, line) in device.driver.iter().flat_map(|driver| driver.told.iter().enumerate()) {
                told.entry(line.value).or_insert((d, t));
            }
        }
        let settings = Settings { world: Rc::new(Shared::new(settings.world)), ..settings };
        let origin = (0.0, settings.world.elapsed());
        Hardware {
            observed: Observed::new(&program.model, told),
            program,
            sources,
            twin,
            devices,
            settings,
            journal,
            trace,
            ends_at: f64::INFINITY,
            replay: VecDeque::new(),
            resuming: false,
            refused: std::cell::Cell::new(false),
            unreached: None,
            securing: false,
            made_safe: Vec::new(),
            unhalted: Vec::new(),
            left_at: (0.0, 0.0),
            kept: Vec::new(),
            begun_with: BTreeMap::new(),
            half_said: Vec::new(),
            commanded: BTreeSet::new(),
            origin,
            dated: f64::NEG_INFINITY,
            gate: Gate::Go,
            answers: 0,
            questions: BTreeMap::new(),
            running: BTreeMap::new(),
            tickets: 0,
            fed: 0,
            fresh: BTreeMap::new(),
            cancelled: false,
            who: String::new(),
            is_unwritten: false,
            losing: None,
            noted: None,
            waits: 0,
            broken_meanwhile: Vec::new(),
            places: BTreeMap::new(),
            said_first: Words::new(),
            looked: origin.1,
            is_troubled: false,
            held_up: Vec::new(),
            caught_up: None,
        }
    }

    /// What devices tell, and the devices.
    pub fn view(&self) -> (&Observed, &[Device<'m>]) {
        (&self.observed, &self.devices)
    }

    /// The device that did not answer when a journal was to be gone on with: nothing was said to any, and nothing may be.
    pub fn unreached(&self) -> Option<&Unreached> {
        self.unreached.as_ref()
    }

    /// Whether it was refused to go on.
    pub(super) fn is_refused(&self) -> bool {
        self.refused.get()
    }

    /// Whether a person has ended it.
    pub fn is_stopped(&self) -> bool {
        self.settings.control.is_stopped()
    }

    /// The twin.
    pub fn twin(&mut self) -> &mut Sim<'m> {
        &mut self.twin
    }

    /// The journal.
    pub fn journal(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Whether an operation of a device goes on, on it or in the twin.
    pub(super) fn is_busy(&self, device: usize) -> bool {
        self.running.values().any(|r| r.device == device)
    }

    /// The device whose line a device speaks over: itself, as a rule.
    pub(super) fn line_of(&self, device: usize) -> usize {
        self.devices[device].host.unwrap_or(device)
    }

    /// Whether what an earlier process wrote has been gone through, and devices have been asked since.
    pub(super) fn is_live(&self) -> bool {
        self.replay.is_empty() && !self.resuming && self.settings.mode != Mode::Replay
    }

    pub(super) fn is_dry(&self) -> bool {
        self.settings.mode == Mode::Dry
    }

    /// Whether anything goes over lines.
    pub(super) fn speaks(&self) -> bool {
        !matches!(self.settings.mode, Mode::Dry | Mode::Replay)
    }

    /// A fault now, at a place in the text if it has one: else at the step under way.
    pub(super) fn fault(&self, code: Code, span: impl Into<Option<Span>>, message: String) -> Fault {
        Fault { span: span.into(), ..Fault::new(code, self.twin.now(), message) }
    }

    /// A trouble as the fault of a device.
    pub(super) fn trouble(&mut self, device: usize, trouble: &DeviceError, span: Span) -> Fault {
        if matches!(trouble, DeviceError::Lost(_) | DeviceError::Silent(_) | DeviceError::Mistaken(_)) {
            let line = self.line_of(device);
            self.devices[line].lost.get_or_insert_with(|| trouble.text().to_owned());
            self.losing = Some(self.devices[line].name.to_owned());
            if let Some(link) = self.devices[line].link.take() {
                self.devices[line].owed += link.owed();
                let kept = link.kept().into_iter();
                self.kept.extend(kept.map(|((device, word), text)| (line, device, word, text)));
            }
        }
        let message = format!("`{}`: {}", self.devices[device].name, trouble.text());
        self.fault(trouble.code(), span, message)
    }

    pub(super) fn keep(&mut self, entry: &Entry) -> Result<(), Fault> {
        self.journal.keep(entry).map_err(|why| self.unkept(why))
    }

    /// That the journal cannot be written.
    pub(super) fn unkept(&self, why: String) -> Fault {
        let fault = self.fault(codes::JOURNAL_MISMATCH, None::<Span>, why);
        fault.help(
            "steps missing in the journal cannot be resumed: free disk space, then start again with a new journal",
        )
    }

    /// Lab time by the clock, s.
    pub(super) fn clock(&self) -> f64 {
        let passed = self.settings.world.elapsed().saturating_sub(self.origin.1);
        self.origin.0 + passed.as_secs_f64() * self.settings.speed
    }

    /// s since 1970.
    pub(super) fn wall(&self) -> f64 {
        self.settings.world.wall()
    }

    /// A fault that came from outside: whoever replays the journal meets it again.
    pub(super) fn outward(&mut self, fault: Fault) -> Fault {
        self.is_troubled = true;
        let is_theirs = matches!(
            fault.code,
            codes::DEVICE_LOST | codes::DEVICE_GARBLED | codes::DEVICE_REFUSED | codes::DIVERGED | codes::RUN_FAILED
        );
        if is_theirs && self.is_live() && !self.is_dry() && self.noted.as_ref() != Some(&fault.message) {
            let (t, code, text) = (self.twin.now(), fault.code.name.to_owned(), fault.message.clone());
            self.noted = Some(fault.message.clone());
            let lost = self.losing.take();
            self.journal.note(&Entry::Fault { t, tickets: self.tickets, fed: self.fed, lost, code, text });
        }
        fault
    }

    /// Digest of the states of the twin, to the last bit.
    pub(super) fn states(&mut self) -> String {
        let states = self.twin.engine().states();
        sha256(&states.iter().flat_map(|state| state.to_bits().to_le_bytes()).collect::<Vec<u8>>())
    }
}
