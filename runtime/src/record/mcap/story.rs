//! Topics of what happened: plan, events, processes, expectations, log.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::McapResult;
use serde::Serialize;
use serde_json::Value;

use super::Sink;
use super::foxglove::{self, Log, Time};
use super::schema::{count, list, number, object, optional, text, truth};
use crate::exec::StepState;
use crate::record::history;
use crate::record::recording::Level;
use crate::record::report::MeasuredReport;
use crate::record::run::{Place, Run};

/// Writes all topics of what happened.
pub(super) fn write<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    plan(run, sink)?;
    events(run, sink)?;
    processes(run, sink)?;
    expectations(run, sink)?;
    log(run, sink)
}

/// One node of the plan and its state from now on.
#[derive(Serialize)]
struct PlanNode<'a> {
    id: u32,
    label: &'a str,
    path: &'a str,
    state: StepState,
    #[serde(flatten)]
    place: &'a Place,
}

/// `/plan`: every node as pending at the start, then each change.
fn plan<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let schema = object(
        "matterix.PlanNode",
        [
            ("id", count("index of the node in the plan")),
            ("label", text("the node as shown")),
            ("path", text("labels from the workflow down, joined by ` > `")),
            ("state", text("pending, running, done, failed or skipped")),
        ]
        .into_iter()
        .chain(place_schema()),
    );
    let channel = sink.channel("/plan", "matterix.PlanNode", &schema, &BTreeMap::new())?;
    let plan = &run.program.plan;
    let paths = history::paths(plan);
    let places: Vec<Place> = plan.steps.iter().map(|s| run.place(s.span)).collect();
    let first = (0..plan.steps.len()).map(|i| (0.0, i, StepState::Pending));
    let changes = run.recording.steps.iter().map(|m| (m.time, m.step.0 as usize, m.state));
    for (time, i, state) in first.chain(changes) {
        let Some(step) = plan.steps.get(i) else { continue };
        let node = PlanNode { id: i as u32, label: &step.label, path: &paths[i].0, state, place: &places[i] };
        sink.push(channel, time, &node)?;
    }
    Ok(())
}

#[derive(Serialize)]
struct Event<'a> {
    name: &'a str,
    #[serde(flatten)]
    place: &'a Place,
}

fn events<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let fields = [("name", text("the event and its instances"))].into_iter().chain(place_schema());
    let schema = object("matterix.Event", fields);
    let channel = sink.channel("/events", "matterix.Event", &schema, &BTreeMap::new())?;
    let events = &run.program.model.events;
    let places: Vec<Place> = events.iter().map(|e| run.place(e.span)).collect();
    for mark in &run.recording.events {
        let Some((event, place)) = events.get(mark.event).zip(places.get(mark.event)) else { continue };
        sink.push(channel, mark.time, &Event { name: &event.name, place })?;
    }
    Ok(())
}

#[derive(Serialize)]
struct Process<'a> {
    name: &'a str,
    running: bool,
}

fn processes<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let fields = [("name", text("the process and its instances")), ("running", truth("whether it runs from now on"))];
    let schema = object("matterix.Process", fields);
    let channel = sink.channel("/processes", "matterix.Process", &schema, &BTreeMap::new())?;
    for mark in &run.recording.processes {
        let Some(process) = run.program.model.processes.get(mark.process) else { continue };
        sink.push(channel, mark.time, &Process { name: &process.name, running: mark.running })?;
    }
    Ok(())
}

#[derive(Serialize)]
struct Expectation<'a> {
    text: &'a str,
    passed: bool,
    measured: Vec<MeasuredReport>,
    #[serde(flatten)]
    place: Place,
}

fn expectations<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let measured = object(
        "matterix.Measured",
        [
            ("text", text("the comparison as written")),
            ("value", optional(number("what was found"))),
            ("low", optional(number("lower limit"))),
            ("high", optional(number("upper limit"))),
            ("unit", text("of value and limits")),
        ],
    );
    let fields = [("text", text("as written")), ("passed", truth("whether it held")), ("measured", list(measured))];
    let schema = object("matterix.Expectation", fields.into_iter().chain(place_schema()));
    let channel = sink.channel("/expectations", "matterix.Expectation", &schema, &BTreeMap::new())?;
    for entry in &run.recording.expectations {
        let measured = entry.measured.iter().filter_map(MeasuredReport::of);
        let place = run.place(entry.span);
        let message = Expectation { text: &entry.text, passed: entry.passed, measured: measured.collect(), place };
        sink.push(channel, entry.time, &message)?;
    }
    Ok(())
}

fn log<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let channel = sink.channel("/log", "foxglove.Log", &foxglove::log_schema(), &BTreeMap::new())?;
    for line in &run.recording.log {
        let level = match line.level {
            Level::Debug => 1,
            Level::Info => 2,
            Level::Warning => 3,
            Level::Error => 4,
        };
        let place = line.span.map(|s| run.place(s)).unwrap_or_default();
        let message = Log {
            timestamp: Time::new(line.time),
            level,
            message: &line.text,
            name: &run.program.plan.workflow,
            file: &place.file,
            line: place.line.unwrap_or(0),
        };
        sink.push(channel, line.time, &message)?;
    }
    Ok(())
}

fn place_schema() -> [(&'static str, Value); 2] {
    [("file", text("source file")), ("line", optional(count("line of the source file, from 1")))]
}
