//! What the page shows: kept up to date by the executor, read by the thread that serves it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};

use matterix_hardware::deploy::{Entry, Gate};
use matterix_ir::Unit;
use matterix_ir::quantity::show_number;
use matterix_ir::wire::Told;
use serde::Serialize;

use crate::record::Bound;

/// So many lines of the log are kept.
const LINES: usize = 200;

/// So many steps that go on are shown; the rest are counted.
const STEPS: usize = 50;

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Kind {
    Plain,
    /// What a person said or was asked.
    Person,
    /// What went wrong.
    Wrong,
}

/// What is known of a deployment.
pub struct Board {
    /// How values are shown, by name: the unit, or words.
    units: BTreeMap<String, (Unit, Vec<String>)>,
    state: Mutex<State>,
}

#[derive(Serialize)]
struct State {
    file: String,
    workflow: Option<String>,
    /// Lab time, s.
    time: f64,
    speed: f64,
    gate: Gate,
    /// How it ended.
    status: Option<String>,
    devices: Vec<Device>,
    /// In the order in which they began.
    #[serde(skip)]
    steps: Vec<Step>,
    log: VecDeque<Line>,
}

#[derive(Serialize)]
struct Device {
    name: String,
    driver: Option<String>,
    place: Option<String>,
    /// Why nothing is heard of it.
    trouble: Option<String>,
    /// What it told last, by name, as shown.
    told: BTreeMap<String, String>,
}

#[derive(Serialize)]
struct Step {
    #[serde(skip)]
    number: u32,
    label: String,
    /// s.
    since: f64,
}

#[derive(Serialize)]
struct Line {
    t: f64,
    kind: Kind,
    text: String,
}

/// A question as the page has it: numbers of 64 bits are texts in JSON.
#[derive(Serialize)]
struct Question<'a> {
    number: String,
    text: &'a str,
}

/// Everything the page shows.
#[derive(Serialize)]
struct Sent<'a> {
    #[serde(flatten)]
    state: &'a State,
    steps: Vec<&'a Step>,
    /// Steps that go on and are not shown.
    more_steps: usize,
    questions: Vec<Question<'a>>,
    /// Devices that were told something and have not been made safe since.
    exposed: &'a [String],
}

impl Board {
    /// Of a deployment that has not begun.
    pub fn new<'t>(
        told: impl IntoIterator<Item = &'t Told>,
        file: String,
        workflow: Option<String>,
        speed: f64,
        devices: &[Bound],
    ) -> Self {
        let units = told.into_iter().map(|told| (told.name.clone(), (told.unit.clone(), told.words.clone()))).collect();
        let device = |bound: &Bound| Device {
            name: bound.name.clone(),
            driver: bound.driver.clone(),
            place: bound.place.clone(),
            trouble: None,
            told: BTreeMap::new(),
        };
        let state = State {
            file,
            workflow,
            time: 0.0,
            speed,
            gate: Gate::Go,
            status: None,
            devices: devices.iter().map(device).collect(),
            steps: Vec::new(),
            log: VecDeque::new(),
        };
        Board { units, state: Mutex::new(state) }
    }

    /// Lab time is this, s.
    pub(super) fn reached(&self, time: f64) {
        self.state_now().time = time;
    }

    /// A step goes on since a time, s.
    pub(super) fn begun(&self, step: u32, since: f64, label: &str) {
        self.state_now().steps.push(Step { number: step, label: label.to_owned(), since });
    }

    /// A step is over.
    pub(super) fn over(&self, step: u32) {
        let mut state = self.state_now();
        if let Some(at) = state.steps.iter().rposition(|s| s.number == step) {
            state.steps.remove(at);
        }
    }

    /// Something was said or happened at a time, s.
    pub(super) fn log(&self, t: f64, kind: Kind, text: String) {
        self.state_now().log(t, kind, text);
    }

    /// A line of the journal.
    pub fn take(&self, entry: &Entry) {
        let mut state = self.state_now();
        let t = entry.time();
        state.time = state.time.max(t);
        if let Some((kind, text)) = line(entry) {
            state.log(t, kind, text);
        }
        match entry {
            Entry::Told { name, value, .. } | Entry::ReadBack { name, value, .. } => {
                let shown = self.shown(name, *value);
                if let Some(device) = state.of(name) {
                    device.trouble = None;
                    device.told.insert(name.clone(), shown);
                }
            }
            Entry::Kept { device, word, text, .. } => {
                if let Some(device) = state.of(device) {
                    device.told.insert(word.clone(), text.clone());
                }
            }
            Entry::Fault { lost: Some(lost), text, .. } => {
                if let Some(device) = state.of(lost) {
                    device.trouble = Some(text.clone());
                }
            }
            Entry::Gate { to, .. } => state.gate = *to,
            Entry::End { status, .. } => state.status = Some(status.clone()),
            _ => {}
        }
    }

    fn shown(&self, name: &str, value: f64) -> String {
        match self.units.get(name) {
            Some((_, words)) if !words.is_empty() => {
                let word = words.iter().enumerate().find(|(index, _)| *index as f64 == value);
                word.map_or_else(|| show_number(value), |(_, word)| word.clone())
            }
            Some((unit, _)) => unit.show(value),
            None => show_number(value),
        }
    }

    /// Everything that the page shows, as JSON.
    pub(super) fn state(&self, open: &[(u64, String)], exposed: &[String]) -> String {
        let state = self.state_now();
        let questions = open.iter().map(|(number, text)| Question { number: number.to_string(), text }).collect();
        let steps: Vec<&Step> = state.steps.iter().take(STEPS).collect();
        let more_steps = state.steps.len() - steps.len();
        let sent = Sent { state: &state, steps, more_steps, questions, exposed };
        serde_json::to_string(&sent).unwrap_or_default()
    }

    fn state_now(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Lines stand in the order of their times, as what an earlier process did comes in twice: from its journal and as it is gone
    /// through again.
    fn log(&mut self, t: f64, kind: Kind, text: String) {
        let at = self.log.partition_point(|line| line.t <= t);
        self.log.insert(at, Line { t, kind, text });
        if self.log.len() > LINES {
            self.log.pop_front();
        }
    }

    /// The device that a name belongs to: `plate` of `plate.temperature`.
    fn of(&mut self, name: &str) -> Option<&mut Device> {
        let is_its = |device: &Device| {
            name.strip_prefix(&device.name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        self.devices.iter_mut().filter(|device| is_its(device)).max_by_key(|device| device.name.len())
    }
}

/// A line of the journal in words, where it has something to say to people.
fn line(entry: &Entry) -> Option<(Kind, String)> {
    let (kind, text) = match entry {
        Entry::Begin { who, .. } => (Kind::Person, format!("started by {who}")),
        Entry::Resumed { who, .. } => (Kind::Person, format!("resumed by {who}")),
        Entry::Starting { label, device, .. } => (Kind::Plain, format!("{device}: {label}")),
        Entry::Ended { failed: Some((name, text)), .. } => (Kind::Wrong, format!("{name}: {text}")),
        Entry::Again { device, why, .. } => (Kind::Wrong, format!("{device}: asked again because {why}")),
        Entry::Asked { text, .. } => (Kind::Person, format!("asked: {text}")),
        Entry::Answered { yes: true, who, .. } => (Kind::Person, format!("confirmed by {who}")),
        Entry::Answered { yes: false, who, .. } => (Kind::Person, format!("not confirmed by {who}")),
        Entry::Gate { to: Gate::Pause, who, .. } => (Kind::Person, format!("paused by {who}")),
        Entry::Gate { to: Gate::Step, who, .. } => (Kind::Person, format!("one step, by {who}")),
        Entry::Gate { to: Gate::Go, who, .. } => (Kind::Person, format!("continued by {who}")),
        Entry::Stop { who, .. } => (Kind::Person, format!("stopped by {who}")),
        Entry::HeldUp { seconds, .. } => (Kind::Wrong, format!("the deployment was paused for {seconds:.1} s")),
        Entry::Fault { text, .. } => (Kind::Wrong, text.clone()),
        Entry::Safe { device, trouble: None, .. } => (Kind::Plain, format!("{device}: made safe")),
        Entry::Safe { device, trouble: Some(why), .. } => {
            (Kind::Wrong, format!("{device}: could not be made safe: {why}: go and check now"))
        }
        Entry::End { status, .. } => (Kind::Person, format!("the end: {status}")),
        _ => return None,
    };
    Some((kind, text))
}

#[cfg(test)]
mod tests {
    use matterix_ir::quantity::show_number;

    use super::*;

    fn board() -> Board {
        let bound = |name: &str| Bound { name: name.to_owned(), driver: None, place: None };
        let devices = [bound("plate"), bound("plate2")];
        Board::new([], "lab.mtx".to_owned(), None, 1.0, &devices)
    }

    fn state(board: &Board) -> serde_json::Value {
        serde_json::from_str(&board.state(&[(u64::MAX, "is it in?".to_owned())], &["plate".to_owned()])).expect("JSON")
    }

    #[test]
    fn what_a_device_tells_stands_at_that_device() {
        let board = board();
        for (name, value) in [("plate.temperature", 300.0), ("plate2.temperature", 310.0), ("other.x", 1.0)] {
            board.take(&Entry::Told { t: 1.0, name: name.to_owned(), value });
        }
        let state = state(&board);
        assert_eq!(state["devices"][0]["told"]["plate.temperature"], show_number(300.0));
        assert_eq!(state["devices"][1]["told"]["plate2.temperature"], show_number(310.0));
        assert_eq!(state["devices"][0]["told"].as_object().map(serde_json::Map::len), Some(1));
        assert_eq!(state["questions"][0]["number"], u64::MAX.to_string());
    }

    #[test]
    fn a_log_keeps_the_order_of_times_and_its_bound() {
        let board = board();
        for i in 0..3 * LINES {
            board.log((i % 7) as f64, Kind::Plain, i.to_string());
        }
        let state = state(&board);
        let times: Vec<f64> = state["log"].as_array().expect("lines").iter().filter_map(|l| l["t"].as_f64()).collect();
        assert_eq!(times.len(), LINES);
        assert!(times.is_sorted());
    }

    #[test]
    fn a_lost_device_says_so_until_it_tells_something() {
        let board = board();
        let lost = Some("plate".to_owned());
        board.take(&Entry::Fault {
            fed: 0,
            t: 2.0,
            tickets: 0,
            lost,
            code: "device-lost".to_owned(),
            text: "no answer".to_owned(),
        });
        assert_eq!(state(&board)["devices"][0]["trouble"], "no answer");
        board.take(&Entry::Told { t: 3.0, name: "plate.temperature".to_owned(), value: 300.0 });
        assert_eq!(state(&board)["devices"][0]["trouble"], serde_json::Value::Null);
    }
}
