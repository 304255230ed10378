//! Where what is asked comes in, and from where news of it goes out.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::mpsc::{Receiver, TryRecvError};

use matterix_ir::offer::{Arranged, Kind, Offer};
use matterix_ir::plan::{Plan, Step, StepId};
use matterix_ir::scene::{InstanceId, Scene};
use matterix_ir::{NodeId, Sources};
use matterix_runtime::exec::{Asked, FailureTrace, Listener, StepState};
use matterix_runtime::process::{Engine, Observer};
use matterix_sila_wire::{Call, Failure, News, Read, Request};

use super::features::{Catalogue, error_name};
use super::values;

/// A command that goes on.
struct Going<'p> {
    call: Call,
    device: Option<InstanceId>,
    /// The local that receives what it returns, and what values that has.
    result: Option<(u32, &'p Kind)>,
    begun: f64,
    takes: Option<f64>,
    /// When news of it went out last, s.
    told: f64,
    failure: Option<(String, String)>,
    /// The executor was told that it is cancelled.
    given_up: bool,
}

impl Going<'_> {
    fn is_to_be_given_up(&self) -> bool {
        self.call.is_cancelled() && !self.given_up
    }
}

/// What is asked and what goes on; the one who lets time pass and the one who listens both look at it.
pub struct Desk<'p> {
    catalogue: Catalogue<'p>,
    scene: &'p Scene,
    plan: &'p Plan,
    requests: Receiver<Request>,
    calls: RefCell<VecDeque<Call>>,
    reads: RefCell<VecDeque<Read>>,
    going: RefCell<BTreeMap<StepId, Going<'p>>>,
    /// Values of locals that receive results, SI.
    returned: RefCell<BTreeMap<u32, f64>>,
    /// Whether something was told to devices.
    busy: Cell<bool>,
}

impl<'p> Desk<'p> {
    /// Nothing has been asked yet.
    pub fn new(catalogue: Catalogue<'p>, scene: &'p Scene, plan: &'p Plan, requests: Receiver<Request>) -> Self {
        let (calls, reads, going, returned) = Default::default();
        Desk { catalogue, scene, plan, requests, calls, reads, going, returned, busy: Cell::new(false) }
    }

    /// Takes in what has come; whether a command is waiting, or is to be broken off.
    pub(super) fn look(&self) -> bool {
        loop {
            match self.requests.try_recv() {
                Ok(Request::Call(call)) => self.calls.borrow_mut().push_back(call),
                Ok(Request::Read(read)) => self.reads.borrow_mut().push_back(read),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        !self.calls.borrow().is_empty() || self.going.borrow().values().any(Going::is_to_be_given_up)
    }

    /// The next property that is asked for, with its node.
    pub(super) fn next_read(&self) -> Option<(Read, NodeId, &'p Kind)> {
        let read = self.reads.borrow_mut().pop_front()?;
        let shown = *self.catalogue.properties.get(read.feature)?.get(read.property)?;
        Some((read, shown.value, &shown.kind))
    }

    /// Answers what was asked for.
    pub(super) fn answer(&self, read: Read, kind: &Kind, number: Option<f64>) {
        let value = number.and_then(|n| values::value(self.scene, kind, n));
        let value = value.ok_or_else(|| Failure::Garbled("its value is unknown now".to_owned()));
        // Who has gone needs no answer.
        let _ = read.answer.send(value);
    }

    /// Tells who asked why there is no answer.
    pub(super) fn refuse(&self, read: Read, why: String) {
        let _ = read.answer.send(Err(Failure::Garbled(why)));
    }

    /// How long commands that have just begun take; asked once for each.
    pub(super) fn unmeasured(&self) -> Vec<(StepId, NodeId)> {
        let going = self.going.borrow();
        let new = going.iter().filter(|(_, g)| g.takes.is_none());
        new.filter_map(|(step, _)| Some((*step, self.takes(*step)?))).collect()
    }

    fn takes(&self, step: StepId) -> Option<NodeId> {
        match &self.plan.get(step).step {
            Step::Operation(o) => Some(o.takes?.nominal),
            Step::Skill { takes, .. } => Some(takes.as_ref()?.nominal),
            Step::Guarded { body, .. } | Step::During { body, .. } => self.takes(*body),
            _ => None,
        }
    }

    /// Everything that a step uses.
    fn claims(&self, step: StepId) -> BTreeSet<InstanceId> {
        let (mut all, mut open) = (BTreeSet::new(), vec![step]);
        while let Some(step) = open.pop() {
            match &self.plan.get(step).step {
                Step::Operation(o) => all.extend(o.claims.iter().copied()),
                Step::Claim { claims, .. } => all.extend(claims.iter().copied()),
                _ => {}
            }
            open.extend(self.plan.get(step).step.children());
        }
        all
    }

    /// Notes how long a command takes, s.
    pub(super) fn measured(&self, step: StepId, takes: f64) {
        if let Some(going) = self.going.borrow_mut().get_mut(&step) {
            going.takes = Some(takes);
        }
    }

    /// Notes what the plan keeps, SI: it may be what a command returns.
    pub(super) fn kept(&self, local: u32, value: Option<f64>) {
        let is_result = |g: &Going<'_>| g.result.is_some_and(|(result, _)| result == local);
        if !self.going.borrow().values().any(is_result) {
            return;
        }
        let mut returned = self.returned.borrow_mut();
        match value {
            Some(value) => returned.insert(local, value),
            None => returned.remove(&local),
        };
    }

    /// How a command that is done has ended: with its result, or because there is none.
    fn done(&self, going: &Going<'_>) -> News {
        let Some((local, kind)) = going.result else { return News::Done(Vec::new()) };
        let number = self.returned.borrow_mut().remove(&local);
        match number.and_then(|n| values::value(self.scene, kind, n)) {
            Some(value) => News::Done(vec![value]),
            None => News::Failed(Failure::Garbled("it ended without a known result".to_owned())),
        }
    }

    /// Tells how far commands have come, once a second of lab time and at least at their beginning.
    pub(super) fn tell(&self, now: f64) {
        for going in self.going.borrow_mut().values_mut() {
            if now < going.told + 1.0 {
                continue;
            }
            going.told = now;
            let (past, takes) = (now - going.begun, going.takes);
            let done = takes.filter(|t| *t > 0.0).map_or(0.0, |t| (past / t).min(0.99));
            let _ = going.call.news.send(News::Goes(done, takes.map(|t| (t - past).max(0.0))));
        }
    }

    /// Whether any command was begun.
    pub fn was_busy(&self) -> bool {
        self.busy.get()
    }

    /// Everything that goes on comes to nothing.
    pub fn end(&self, why: &str) {
        let failed = || News::Failed(Failure::Lost(why.to_owned()));
        for (_, going) in std::mem::take(&mut *self.going.borrow_mut()) {
            let news = going.failure.as_ref().map_or_else(failed, |f| self.failed(&going.call, f));
            let _ = going.call.news.send(news);
        }
        self.look();
        for call in self.calls.borrow_mut().drain(..) {
            let _ = call.news.send(failed());
        }
        self.reads.borrow_mut().clear();
    }

    /// What a call asks the executor for.
    fn begin(&self, call: Call, now: f64) -> Option<Asked> {
        let not_now = |call: &Call, why: String| {
            let _ = call.news.send(News::NotNow(why));
        };
        let Some(offer) = self.catalogue.commands.get(call.feature).and_then(|c| c.get(call.command)).copied() else {
            not_now(&call, "unknown command".to_owned());
            return None;
        };
        let Some((arranged, locals)) = self.arranged(offer, &call) else {
            let _ = call
                .news
                .send(News::Failed(Failure::Garbled(format!("`{}` is not possible with these things", offer.verb))));
            return None;
        };
        let mut mine = self.claims(arranged.step);
        mine.extend(offer.device);
        let busy = self.going.borrow().iter().find_map(|(step, going)| {
            let taken = self.claims(*step).into_iter().chain(going.device).find(|c| mine.contains(c));
            taken.map(|instance| (instance, *step))
        });
        if self.going.borrow().contains_key(&arranged.step) {
            not_now(&call, format!("`{}` is already running", self.plan.get(arranged.step).label));
            return None;
        }
        if let Some((instance, by)) = busy {
            let (name, label) = (&self.scene.get(instance).name, &self.plan.get(by).label);
            not_now(&call, format!("`{name}` is in use: `{label}` is running"));
            return None;
        }
        let going = Going {
            call,
            device: offer.device,
            result: arranged.result.zip(offer.result.as_ref()),
            begun: now,
            takes: None,
            told: f64::NEG_INFINITY,
            failure: None,
            given_up: false,
        };
        self.busy.set(true);
        let _ = going.call.news.send(News::Begun);
        self.going.borrow_mut().insert(arranged.step, going);
        Some(Asked { step: arranged.step, locals })
    }

    /// The arrangement of things that a call means, and the values of the others.
    fn arranged(&self, offer: &'p Offer, call: &Call) -> Option<(&'p Arranged, Vec<(u32, f64)>)> {
        let numbers: Vec<(bool, f64)> = offer
            .parameters
            .iter()
            .zip(&call.arguments)
            .map(|(p, v)| {
                let number = values::number(self.scene, &p.kind, v)?;
                Some((matches!(p.kind, Kind::Things(_)), values::on_bound(p.bounds, number)))
            })
            .collect::<Option<_>>()?;
        let things: Vec<InstanceId> = numbers.iter().filter(|(t, _)| *t).map(|(_, n)| InstanceId(*n as u32)).collect();
        let arranged = offer.arrangements.iter().find(|a| a.things == things)?;
        let others = numbers.iter().filter(|(t, _)| !*t).map(|(_, n)| *n);
        Some((arranged, arranged.locals.iter().copied().zip(others).collect()))
    }

    fn failed(&self, call: &Call, (name, text): &(String, String)) -> News {
        let identifier = error_name(name);
        let feature = self.catalogue.features.get(call.feature);
        let command = feature.and_then(|f| f.commands.get(call.command));
        let known = command.is_some_and(|c| c.errors.contains(&identifier));
        News::Failed(match known {
            true => Failure::Refused { name: identifier, message: text.clone() },
            false => Failure::Garbled(format!("{name}: {text}")),
        })
    }
}

/// Begins what is asked, and tells how it goes on.
pub struct Attendant<'d, 'p> {
    desk: &'d Desk<'p>,
    sources: &'p Sources,
    say: &'d mut dyn FnMut(&str),
    /// When a command was begun last, s: the next begins later, so that it is clear which came first.
    last: f64,
}

impl<'d, 'p> Attendant<'d, 'p> {
    /// Listens to the executor for a desk; what is done is said.
    pub fn new(desk: &'d Desk<'p>, sources: &'p Sources, say: &'d mut dyn FnMut(&str)) -> Self {
        Attendant { desk, sources, say, last: f64::NEG_INFINITY }
    }
}

impl Observer for Attendant<'_, '_> {
    fn sample(&mut self, _: f64, _: &Engine<'_>, _: &[u32]) {}
    fn event(&mut self, _: f64, _: usize) {}
    fn process(&mut self, _: f64, _: usize, _: bool) {}
}

impl Listener for Attendant<'_, '_> {
    fn asked(&mut self, time: f64) -> Vec<Asked> {
        self.desk.look();
        if time <= self.last {
            return Vec::new();
        }
        let next = self.desk.calls.borrow_mut().pop_front();
        let next = next.filter(|call| !call.is_cancelled());
        let asked = next.and_then(|call| self.desk.begin(call, time));
        if let Some(asked) = &asked {
            self.last = time;
            let going = self.desk.going.borrow();
            let user = going.get(&asked.step).and_then(|g| g.call.user.as_ref());
            let by = user.map_or_else(String::new, |user| format!(", called by {user}"));
            (self.say)(&format!("{time:10.3} s  {} starts{by}\n", self.desk.plan.get(asked.step).label));
        }
        asked.into_iter().collect()
    }

    fn given_up(&mut self) -> Vec<StepId> {
        let mut going = self.desk.going.borrow_mut();
        let cancelled = going.iter_mut().filter(|(_, g)| g.is_to_be_given_up());
        cancelled
            .map(|(step, g)| {
                g.given_up = true;
                *step
            })
            .collect()
    }

    fn step(&mut self, time: f64, step: StepId, state: StepState) {
        if !matches!(state, StepState::Done | StepState::Failed | StepState::Skipped) {
            return;
        }
        let Some(going) = self.desk.going.borrow_mut().remove(&step) else { return };
        let label = &self.desk.plan.get(step).label;
        let news = match (&going.failure, state) {
            (_, StepState::Done) => self.desk.done(&going),
            (Some(failure), _) => self.desk.failed(&going.call, failure),
            (None, _) if going.call.is_cancelled() => News::Failed(Failure::Garbled("it was cancelled".to_owned())),
            (None, _) => News::Failed(Failure::Garbled("it was stopped".to_owned())),
        };
        let how = match &news {
            News::Done(_) => "is done".to_owned(),
            News::Failed(Failure::Garbled(text)) if state == StepState::Done => format!("fails: {text}"),
            _ => format!("fails: {}", going.failure.as_ref().map_or("stopped", |(_, text)| text.as_str())),
        };
        (self.say)(&format!("{time:10.3} s  {label} {how}\n"));
        let _ = going.call.news.send(news);
    }

    fn failure(&mut self, failure: &FailureTrace) {
        let mut going = self.desk.going.borrow_mut();
        for at in &failure.steps {
            if let Some(going) = going.get_mut(&at.step) {
                let measured: String = failure.measured.iter().map(|m| format!("; {}", m.show())).collect();
                let place = self.sources.get(failure.span.file).map(|s| s.name.as_str()).unwrap_or_default();
                let text = format!("{}{measured} ({place})", failure.text);
                // An earlier one was handled.
                going.failure = Some((failure.name.clone(), text));
            }
        }
    }
}
