//! The backend that talks to devices. A twin goes along: it keeps what was commanded, checks what steps need, and supposes what
//! no device tells. Time is the clock's; in a dry run it is the twin's, and nothing is sent.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use matterix_ir::model::Action;
use matterix_ir::plan::{Operation, Step, StepId};
use matterix_ir::wire::{Exchange, Pattern, Template};
use matterix_ir::{Code, NodeId, Op, Program, Sources, Span, codes};
use matterix_runtime::backend::{Backend, Follow, Sim, Status, Ticket};
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;
use matterix_runtime::process::{Advance, Watch};

use super::Trace;
use super::device::{Device, Ear};
use super::journal::{Entry, Journal};
use super::observe::Observed;
use super::preflight::carrier;
use crate::link::Trouble;
use crate::template;

/// How often devices are asked whether they are ready, and quantities without a period of their own are asked for, s.
const POLL: f64 = 0.25;

/// Longest time in which nobody looks at the clock.
const NAP: Duration = Duration::from_millis(10);

/// What a deployment does with devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is sent; what would be is shown.
    Dry,
    /// Devices do it.
    Real,
    /// Devices do it, and what they tell is held against the twin.
    Shadow,
}

/// What a deployment is given.
pub struct Settings<'t> {
    /// What is done with devices.
    pub mode: Mode,
    /// Seconds of lab time per second: 1, unless all devices are emulators as fast.
    pub speed: f64,
    /// Set to end it early.
    pub cancel: &'t AtomicBool,
    /// Asks a person; false where they say no.
    pub person: &'t dyn Fn(&str) -> bool,
}

/// An operation that goes on.
struct Running<'m> {
    device: usize,
    twin: Ticket,
    exchange: Option<&'m Exchange>,
    /// When it must be ready at the latest, s.
    deadline: f64,
    ready: bool,
    failed: Option<(String, String)>,
    /// What it sets, for reading it back.
    changed: bool,
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
    /// What an earlier process wrote, as far as it has not been gone through again.
    pub(super) replay: VecDeque<Entry>,
    /// Lab time and the clock at one moment.
    pub(super) origin: (f64, Instant),
    /// An earlier process is followed, and devices have not been asked yet.
    pub(super) resuming: bool,
    /// When it was cut off, s since 1970.
    pub(super) left_at: f64,
    /// What answers to an earlier process said: the device whose line it was, the word, the text.
    pub(super) kept: Vec<(usize, String, String)>,
    /// States that devices were told.
    pub(super) commanded: BTreeSet<u32>,
    running: BTreeMap<Ticket, Running<'m>>,
    tickets: u64,
    /// What was told at this instant.
    fresh: BTreeMap<NodeId, (f64, f64)>,
    cancelled: bool,
    /// The step of each operation, by where it stands in memory.
    steps: BTreeMap<usize, StepId>,
}

impl<'m, 't> Hardware<'m, 't> {
    /// Devices whose lines are not open yet, with a twin that has been started.
    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
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
        let steps = program.plan.steps.iter().enumerate().filter_map(|(i, s)| match &s.step {
            Step::Operation(operation) => Some((address(operation), StepId(i as u32))),
            _ => None,
        });
        Hardware {
            observed: Observed::new(&program.model, told),
            steps: steps.collect(),
            program,
            sources,
            twin,
            devices,
            settings,
            journal,
            trace,
            replay: VecDeque::new(),
            resuming: false,
            left_at: 0.0,
            kept: Vec::new(),
            commanded: BTreeSet::new(),
            origin: (0.0, Instant::now()),
            running: BTreeMap::new(),
            tickets: 0,
            fresh: BTreeMap::new(),
            cancelled: false,
        }
    }

    /// What devices tell, and the devices.
    pub fn view(&self) -> (&Observed, &[Device<'m>]) {
        (&self.observed, &self.devices)
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
    fn is_live(&self) -> bool {
        self.replay.is_empty() && !self.resuming
    }

    pub(super) fn is_dry(&self) -> bool {
        self.settings.mode == Mode::Dry
    }

    pub(super) fn fault(&self, code: Code, span: Span, message: String) -> Fault {
        Fault { code, span: Some(span), time: self.twin.now(), message, help: Vec::new() }
    }

    /// A trouble as the fault of a device.
    pub(super) fn trouble(&mut self, device: usize, trouble: &Trouble, span: Span) -> Fault {
        let code = match trouble {
            Trouble::Lost(_) => codes::DEVICE_LOST,
            Trouble::Garbled(_) => codes::DEVICE_GARBLED,
            Trouble::Refused { .. } => codes::DEVICE_REFUSED,
        };
        if matches!(trouble, Trouble::Lost(_)) {
            let line = self.line_of(device);
            self.devices[line].lost = Some(trouble.text().to_owned());
            if let Some(link) = self.devices[line].link.take() {
                self.kept.extend(link.kept().into_iter().map(|(word, text)| (line, word, text)));
            }
        }
        let message = format!("`{}`: {}", self.devices[device].name, trouble.text());
        self.fault(code, span, message)
    }

    pub(super) fn texts(&mut self, sends: &[Template]) -> Vec<String> {
        let engine = self.twin.engine();
        sends.iter().map(|t| template::filled(t, |n| Some(engine.eval(n))).unwrap_or_default()).collect()
    }

    /// Says commands to a device.
    pub(super) fn say(
        &mut self,
        device: usize,
        texts: &[String],
        expects: Option<&Pattern>,
        span: Span,
    ) -> Result<Vec<f64>, Fault> {
        self.try_say(device, texts, expects).map_err(|trouble| self.trouble(device, &trouble, span))
    }

    fn try_say(&mut self, index: usize, texts: &[String], expects: Option<&Pattern>) -> Result<Vec<f64>, Trouble> {
        let time = self.twin.now();
        let is_dry = self.is_dry();
        let Some(driver) = self.devices[index].driver else { return Ok(Vec::new()) };
        if let Some(why) = &self.devices[self.line_of(index)].lost {
            return Err(Trouble::Lost(format!("nothing more can be said to it: {why}")));
        }
        let device = &mut self.devices[index];
        if is_dry {
            for frame in device.codec.iter_mut().flat_map(|codec| codec.say(texts)) {
                (self.trace)(time, device.name, true, &frame);
            }
            return Ok(Vec::new());
        }
        let (name, line) = (device.name, self.line_of(index));
        let Some(link) = self.devices[line].link.as_mut() else {
            return Err(Trouble::Lost("its line is not open".to_owned()));
        };
        let mut ear = Ear { time, device: name, journal: &mut self.journal, trace: &mut *self.trace };
        link.say(texts, expects, driver, &mut ear)
    }

    /// Asks a device for a quantity, SI.
    pub(super) fn tell(&mut self, index: usize, line: usize) -> Result<f64, Fault> {
        let Some(told) = self.devices[index].driver.and_then(|d| d.told.get(line)) else { return Ok(f64::NAN) };
        if let Some(condition) = told.condition
            && self.twin.engine().eval(condition) == 0.0
        {
            let message = format!("`{}` cannot be told now: its driver says so", told.name);
            return Err(self.fault(codes::DEVICE_REFUSED, told.span, message));
        }
        let text = self.texts(std::slice::from_ref(&told.asks)).concat();
        let (time, is_dry) = (self.twin.now(), self.is_dry());
        let device = &mut self.devices[index];
        let Some(driver) = device.driver else { return Ok(f64::NAN) };
        if is_dry {
            if let Some(codec) = &mut device.codec {
                let frame = codec.ask(&text);
                (self.trace)(time, device.name, true, &frame);
            }
            return Ok(self.twin.value(told.value, &mut ())?.unwrap_or(f64::NAN));
        }
        let (name, host) = (device.name, self.line_of(index));
        let asked = match self.devices[host].link.as_mut() {
            Some(link) => {
                let mut ear = Ear { time, device: name, journal: &mut self.journal, trace: &mut *self.trace };
                link.ask(&text, &told.expects, driver, &mut ear)
            }
            None => Err(Trouble::Lost("its line is not open".to_owned())),
        };
        let numbers = asked.map_err(|trouble| self.trouble(index, &trouble, told.span))?;
        numbers
            .first()
            .copied()
            .ok_or_else(|| self.fault(codes::DEVICE_GARBLED, told.span, "no number was told".into()))
    }

    /// What is told of a node now, asked once an instant.
    fn told(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<f64, Fault> {
        let now = self.twin.now();
        if let Some((_, value)) = self.fresh.get(&node).filter(|(t, _)| *t == now) {
            return Ok(*value);
        }
        let (device, line) = self.observed.told[&node];
        let told = self.devices[device].driver.map(|d| &d.told[line]);
        let name = told.map(|t| t.name.clone()).unwrap_or_default();
        let value = match self.next_entry() {
            Some(Entry::Told { name: before, value, .. }) if before == name => {
                self.replay.pop_front();
                value
            }
            Some(other) => return Err(self.mismatch(&format!("`{name}` is asked for"), &other)),
            None => {
                self.go_live(out)?;
                let (now, value) = (self.twin.now(), self.tell(device, line)?);
                self.journal.note(&Entry::Told { t: now, name: name.clone(), value });
                self.compared(device, line, value)?;
                value
            }
        };
        if let (Op::Reading(r), Some(slot)) = (self.program.model.graph.op(node), told.and_then(|t| t.reading)) {
            out.reading(now, slot as usize, value);
            if let Some(slot) = self.twin.engine().readings_mut().get_mut(r as usize) {
                *slot = value;
            }
        }
        self.fresh.insert(node, (now, value));
        Ok(value)
    }

    /// The value of a node with what devices tell in place of what the twin supposes.
    fn eval(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<f64, Fault> {
        let (asked, _) = self.observed.asks(&self.program.model, node);
        let mut values: BTreeMap<NodeId, f64> = BTreeMap::new();
        for told in asked {
            let value = self.told(told, out)?;
            values.insert(told, value);
        }
        let graph = &self.program.model.graph;
        if values.is_empty() {
            return Ok(self.twin.value(node, out)?.unwrap_or(f64::NAN));
        }
        let engine = self.twin.engine();
        for n in graph.schedule([node]) {
            if values.contains_key(&n) {
                continue;
            }
            let op = graph.op(n);
            let is_leaf = op.operands().next().is_none();
            let value = if is_leaf {
                engine.eval(n)
            } else {
                matterix_ir::graph::apply(op, |_| f64::NAN, |o| values.get(&o).copied().unwrap_or(f64::NAN))
            };
            values.insert(n, value);
        }
        Ok(values.get(&node).copied().unwrap_or(f64::NAN))
    }

    /// The next line of the earlier process that says what came from outside.
    pub(super) fn next_entry(&mut self) -> Option<Entry> {
        while let Some(entry) = self.replay.front() {
            match entry {
                Entry::Resumed { t, .. } => {
                    let t = *t;
                    while self.twin.now() < t && self.twin.advance(t, &[], &mut ()).is_ok() {}
                    self.replay.pop_front();
                }
                Entry::Opened { .. }
                | Entry::Kept { .. }
                | Entry::Out { .. }
                | Entry::Back { .. }
                | Entry::Begin { .. }
                | Entry::End { .. } => {
                    self.replay.pop_front();
                }
                other => return Some(other.clone()),
            }
        }
        None
    }

    pub(super) fn mismatch(&self, now: &str, before: &Entry) -> Fault {
        let before = serde_json::to_string(before).unwrap_or_default();
        let message = format!("the journal does not fit the plan: {now}, but it says `{before}`");
        let mut fault = self.fault(codes::JOURNAL_MISMATCH, Span::default(), message);
        fault.help.push("begin anew, with a journal of its own".to_owned());
        fault
    }

    fn span_text(&self, span: Span) -> String {
        let file = self.sources.get(span.file).map_or("", |f| f.name.as_str());
        let (line, column) = self.sources.line_column(span);
        format!("{file}:{line}:{column}")
    }

    /// Tells an operation to its device.
    fn begin(
        &mut self,
        device: usize,
        exchange: &'m Exchange,
        texts: Vec<String>,
        operation: &Operation,
        step: StepId,
        ticket: u64,
    ) -> Result<Option<(String, String)>, Fault> {
        let t = self.twin.now();
        let node = self.program.plan.get(step);
        let starting = Entry::Starting {
            t,
            ticket,
            step: step.0,
            label: node.label.clone(),
            span: self.span_text(node.span),
            device: self.devices[device].name.to_owned(),
            sends: texts.clone(),
        };
        self.keep(&starting)?;
        match self.try_say(device, &texts, exchange.expects.as_ref()) {
            Ok(_) => {
                self.keep(&Entry::Started { t, ticket })?;
                Ok(None)
            }
            Err(Trouble::Refused { failure, text }) => {
                let text = format!("`{}` refuses `{}`: {text}", self.devices[device].name, operation.verb);
                self.keep(&Entry::Ended { t, ticket, failed: Some((failure.clone(), text.clone())) })?;
                Ok(Some((failure, text)))
            }
            Err(trouble) => Err(self.trouble(device, &trouble, exchange.span)),
        }
    }

    pub(super) fn keep(&mut self, entry: &Entry) -> Result<(), Fault> {
        self.journal.keep(entry).map_err(|why| self.fault(codes::JOURNAL_MISMATCH, Span::default(), why))
    }

    #[allow(clippy::disallowed_methods, reason = "devices act by the wall clock")]
    fn clock(&self) -> f64 {
        self.origin.0 + self.origin.1.elapsed().as_secs_f64() * self.settings.speed
    }

    /// What an operation's device did, as the earlier process has it.
    fn replayed_start(
        &mut self,
        ticket: u64,
        step: StepId,
        label: &str,
    ) -> Result<Option<Option<(String, String)>>, Fault> {
        let Some(entry) = self.next_entry() else { return Ok(None) };
        let Entry::Starting { ticket: before, step: at, sends, device, .. } = &entry else {
            return Err(self.mismatch(&format!("`{label}` begins"), &entry));
        };
        if *before != ticket || *at != step.0 {
            return Err(self.mismatch(&format!("`{label}` begins"), &entry));
        }
        let (sends, device) = (sends.clone(), device.clone());
        self.replay.pop_front();
        match self.next_entry() {
            Some(Entry::Started { ticket: t, .. }) if t == ticket => {
                self.replay.pop_front();
                Ok(Some(None))
            }
            Some(Entry::Ended { ticket: t, failed, .. }) if t == ticket => {
                self.replay.pop_front();
                Ok(Some(failed))
            }
            None => {
                // It was cut off while this was being said: said once more only where that changes nothing.
                let operation = match &self.program.plan.get(step).step {
                    Step::Operation(operation) => operation,
                    _ => return Ok(None),
                };
                if self.is_repeatable(operation, step) {
                    return Ok(None);
                }
                let message = format!(
                    "it is not known whether `{device}` was told `{}` for `{label}` before the journal broke off",
                    sends.join("`, `")
                );
                let mut fault = self.fault(codes::JOURNAL_MISMATCH, self.program.plan.get(step).span, message);
                fault.help.push("it may have moved something: look, and begin anew from there".to_owned());
                Err(fault)
            }
            Some(other) => Err(self.mismatch(&format!("`{label}` has begun"), &other)),
        }
    }

    /// Whether saying it twice does what saying it once does: it only sets what does not depend on itself, at once.
    fn is_repeatable(&self, operation: &Operation, step: StepId) -> bool {
        let lasts = self.devices.iter().filter_map(|d| d.driver?.call(step)).any(|e| e.until.is_some());
        let moves = |a: &Action| matches!(a, Action::Move { .. });
        !lasts && operation.until.is_none() && !operation.at_start.iter().chain(&operation.at_end).any(moves)
    }

    /// Reads back what an operation has set, or what has come of what it moved, where its device tells it.
    fn read_back(&mut self, device: usize, set: &[u32], moved: bool) -> Result<(), Fault> {
        let Some(driver) = self.devices[device].driver.filter(|_| !self.is_dry()) else { return Ok(()) };
        for (line, told) in driver.told.iter().enumerate() {
            let applies = told.condition.is_none_or(|c| self.twin.engine().eval(c) != 0.0);
            let concerned = told.state.map_or(moved, |s| set.contains(&s));
            if told.reading.is_some()
                || !applies
                || !concerned
                || !self.observed.is_settled(&self.program.model, told.value)
            {
                continue;
            }
            let value = self.tell(device, line)?;
            self.settled(device, line, value)?;
        }
        Ok(())
    }
}

fn address(operation: &Operation) -> usize {
    std::ptr::from_ref(operation) as usize
}

/// s since 1970.
#[allow(clippy::disallowed_methods, reason = "a journal says when things were done")]
pub(super) fn wall() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64())
}

impl Backend for Hardware<'_, '_> {
    fn now(&self) -> f64 {
        self.twin.now()
    }

    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        self.eval(node, out).map(Some)
    }

    fn observe(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        match self.observed.asks(&self.program.model, node) {
            (_, true) if !self.is_dry() => Ok(None),
            _ => self.eval(node, out).map(Some),
        }
    }

    fn follow(&mut self, condition: NodeId) -> Follow {
        let (told, _) = self.observed.asks(&self.program.model, condition);
        if told.is_empty() {
            return self.twin.follow(condition);
        }
        let periods = told.iter().filter_map(|n| match self.program.model.graph.op(*n) {
            Op::Reading(r) => self.program.model.readings.get(r as usize)?.period.filter(|p| *p > 0.0),
            _ => None,
        });
        let shortest = periods.fold(f64::INFINITY, f64::min);
        Follow::Every(vec![if shortest.is_finite() { shortest.max(POLL) } else { 1.0 }])
    }

    fn set_local(&mut self, local: u32, value: Option<f64>) {
        self.twin.set_local(local, value);
    }

    fn start(&mut self, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        let step = self.steps.get(&address(operation)).copied();
        let step =
            step.ok_or_else(|| self.fault(codes::UNDRIVEN, Span::default(), "an unknown operation".to_owned()))?;
        let program = self.program;
        let label = &program.plan.get(step).label;
        let found = carrier(step, operation, &self.devices);
        let number = self.tickets;
        self.tickets += 1;
        let ticket = Ticket(number);
        let Some(device) = found.or_else(|| self.is_dry().then_some(usize::MAX)) else {
            let message = format!("nothing carries out `{label}`");
            return Err(self.fault(codes::UNDRIVEN, program.plan.get(step).span, message));
        };
        let driver = self.devices.get(device).and_then(|d| d.driver);
        let exchange = driver.and_then(|d| d.call(step));
        let replayed = match exchange {
            Some(_) => self.replayed_start(number, step, label)?,
            None => None,
        };
        let by_hand = exchange.is_none() && device != usize::MAX && !self.is_dry();
        if by_hand && self.next_entry().is_none() {
            let agreed = (self.settings.person)(&format!("please do this, then confirm: {label}"));
            if !agreed {
                let message = format!("nobody did `{label}`");
                return Err(self.fault(codes::RUN_FAILED, program.plan.get(step).span, message));
            }
        }
        // What is said goes by what was before: which tip is next, how much is in a syringe.
        let texts = exchange.map(|e| self.texts(&e.sends)).unwrap_or_default();
        let twin = self.twin.start(operation, out)?;
        let mut failed = None;
        if let Some(exchange) = exchange {
            match replayed {
                Some(outcome) => failed = outcome,
                None => {
                    self.go_live(out)?;
                    self.beat(false, out)?;
                    failed = self.begin(device, exchange, texts, operation, step, number)?;
                    self.beat(true, out)?;
                }
            }
        }
        let until = exchange.and_then(|e| e.until.as_ref());
        let deadline = self.twin.now() + until.map_or(0.0, |u| self.twin.engine().eval(u.timeout));
        let ready = until.is_none() || self.is_dry();
        let changed = exchange.is_some();
        let set: Vec<u32> = operation
            .at_start
            .iter()
            .filter_map(|a| match a {
                Action::Assign { state, .. } => Some(*state),
                Action::Move { .. } => None,
            })
            .collect();
        if changed && failed.is_none() && ready && self.is_live() {
            self.read_back(device, &set, false)?;
        }
        if changed {
            self.commanded.extend(set);
        }
        let running = Running { device, twin, exchange, deadline, ready, failed, changed };
        self.running.insert(ticket, running);
        Ok(ticket)
    }

    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        let now = self.twin.now();
        let Some(running) = self.running.get_mut(&ticket) else { return Ok(Status::Done) };
        let (device, twin, exchange) = (running.device, running.twin, running.exchange);
        if let Some((name, text)) = running.failed.take() {
            self.running.remove(&ticket);
            self.twin.halt(twin);
            return Ok(Status::Failed { name, text });
        }
        if let (false, Some(exchange), Some(until)) = (running.ready, exchange, exchange.and_then(|e| e.until.as_ref()))
        {
            let deadline = running.deadline;
            match self.next_entry() {
                Some(Entry::Ended { ticket: before, failed, .. }) if before == ticket.0 => {
                    self.replay.pop_front();
                    if let Some((name, text)) = failed {
                        self.running.remove(&ticket);
                        self.twin.halt(twin);
                        return Ok(Status::Failed { name, text });
                    }
                }
                Some(_) => return Ok(Status::Running { until: Some(now + POLL), watch: None }),
                None => {
                    self.go_live(out)?;
                    let text = self.texts(std::slice::from_ref(&until.asks)).concat();
                    let asked = {
                        let (name, driver, line) =
                            (self.devices[device].name, self.devices[device].driver, self.line_of(device));
                        let mut ear =
                            Ear { time: now, device: name, journal: &mut self.journal, trace: &mut *self.trace };
                        match (self.devices[line].link.as_mut(), driver) {
                            (Some(link), Some(driver)) => link.is_ready(&text, until, driver, &mut ear),
                            _ => Err(Trouble::Lost("its line is not open".to_owned())),
                        }
                    };
                    match asked {
                        Ok(true) => self.keep(&Entry::Ended { t: now, ticket: ticket.0, failed: None })?,
                        Ok(false) if now >= deadline => {
                            let message = format!("`{}` was not ready in time", self.devices[device].name);
                            return Err(self.fault(codes::DEVICE_LOST, exchange.span, message));
                        }
                        Ok(false) => return Ok(Status::Running { until: Some(now + POLL), watch: None }),
                        Err(Trouble::Refused { failure, text }) => {
                            let text = format!("`{}` has stopped: {text}", self.devices[device].name);
                            let failed = Some((failure.clone(), text.clone()));
                            self.keep(&Entry::Ended { t: now, ticket: ticket.0, failed })?;
                            self.running.remove(&ticket);
                            self.twin.halt(twin);
                            return Ok(Status::Failed { name: failure, text });
                        }
                        Err(trouble) => return Err(self.trouble(device, &trouble, exchange.span)),
                    }
                }
            }
            if let Some(running) = self.running.get_mut(&ticket) {
                running.ready = true;
            }
        }
        match self.twin.poll(twin, out)? {
            Status::Running { until, watch } => Ok(Status::Running { until, watch }),
            ended => {
                let running = self.running.remove(&ticket);
                if running.is_some_and(|r| r.changed && r.exchange.is_some_and(|e| e.until.is_some())) && self.is_live()
                {
                    self.read_back(device, &[], true)?;
                }
                Ok(ended)
            }
        }
    }

    fn halt(&mut self, ticket: Ticket) {
        let Some(running) = self.running.remove(&ticket) else { return };
        self.twin.halt(running.twin);
        let Some(driver) = self.devices.get(running.device).and_then(|d| d.driver) else { return };
        if running.ready || !self.is_live() {
            return;
        }
        for exchange in &driver.halt {
            let texts = self.texts(&exchange.sends);
            // What goes wrong here ends what is ending already.
            if let Err(trouble) = self.try_say(running.device, &texts, exchange.expects.as_ref()) {
                self.trouble(running.device, &trouble, exchange.span);
            }
        }
    }

    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        match self.next_entry() {
            Some(Entry::Time { t, fired, .. }) => {
                self.replay.pop_front();
                while self.twin.now() < t {
                    self.twin.advance(t, &[], out)?;
                }
                return Ok(if fired.is_empty() && t >= until { Advance::Reached } else { Advance::Watch(fired) });
            }
            Some(other) => return Err(self.mismatch("time passes", &other)),
            None => {}
        }
        self.go_live(out)?;
        let outcome = loop {
            let now = self.twin.now();
            let clock = if self.is_dry() { f64::INFINITY } else { self.clock() };
            let target = until.min(clock).min(self.next_beat()).max(now);
            if let Advance::Watch(fired) = self.twin.advance(target, watches, out)? {
                break Advance::Watch(fired);
            }
            self.beat(true, out)?;
            if self.twin.now() >= until {
                break Advance::Reached;
            }
            if self.settings.cancel.load(Ordering::Relaxed) && !self.cancelled {
                self.cancelled = true;
                break Advance::Watch(Vec::new());
            }
            if !self.is_dry() && self.twin.now() >= self.clock() {
                let left = Duration::try_from_secs_f64((until - self.twin.now()) / self.settings.speed);
                std::thread::sleep(left.unwrap_or(NAP).min(NAP));
            }
        };
        let fired = match &outcome {
            Advance::Watch(fired) => fired.clone(),
            Advance::Reached => Vec::new(),
        };
        self.journal.note(&Entry::Time { t: self.twin.now(), fired, wall: wall() });
        Ok(outcome)
    }
}
