//! Topics of numbers: states by instance, contents by mixture, readings, records.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::McapResult;
use serde_json::{Value, json};

use super::Sink;
use super::schema::{list, number, object, open, text, truth};
use crate::record::column::{Cell, Column, Shown, repeats};
use crate::record::frames::{Frame, frames};
use crate::record::run::Run;
use crate::record::table::record_units;
use crate::record::taken::Record;

/// A field of a message: a column under a key.
type Field<'a> = (String, Column<'a>);

/// Fields in one object of a message; the unnamed group is the message itself.
struct Group<'a> {
    name: &'static str,
    fields: Vec<Field<'a>>,
}

/// A topic whose messages are points of columns.
struct Topic<'a> {
    topic: String,
    schema: String,
    groups: Vec<Group<'a>>,
}

/// Writes all topics of numbers.
pub(super) fn write<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    for topic in states(run).into_iter().chain(contents(run)) {
        topic.write(run, sink)?;
    }
    readings(run, sink)?;
    records(run, sink)
}

/// `/state/<instance>`: its states and observables that are not contents; what belongs to none goes to the lab.
fn states<'a>(run: &Run<'a>) -> Vec<Topic<'a>> {
    let model = &run.program.model;
    let shown_elsewhere = |list: fn(&matterix_ir::model::Mixture) -> Vec<u32>| -> Vec<u32> {
        model.mixtures.iter().flat_map(list).collect()
    };
    let amounts = shown_elsewhere(|m| m.contents.iter().map(|c| c.state).collect());
    let derived = shown_elsewhere(|m| {
        let settled = m.contents.iter().filter_map(|c| c.settled);
        m.properties.iter().chain(&m.concentrations).copied().chain(settled).collect()
    });
    let states = (0..model.states.len()).filter(|&i| !amounts.contains(&(i as u32)));
    let others = (0..model.observables.len()).filter(|&i| !derived.contains(&(i as u32)) && !repeats(run, i));
    let columns = states.filter_map(|i| Column::state(run, i)).chain(others.filter_map(|i| Column::observable(run, i)));

    let mut by_owner: BTreeMap<&str, Vec<Field<'a>>> = BTreeMap::new();
    for column in columns {
        let (owner, key) = split(run, column.name);
        by_owner.entry(owner).or_default().push((key.to_owned(), column));
    }
    let topic = |(owner, fields)| Topic {
        topic: format!("/state/{owner}"),
        schema: format!("matterix.State.{owner}"),
        groups: vec![Group { name: "", fields }],
    };
    by_owner.into_iter().map(topic).collect()
}

/// `/contents/<mixture>`: amounts and concentrations by species, properties, and amounts of what is a solid at equilibrium.
fn contents<'a>(run: &Run<'a>) -> Vec<Topic<'a>> {
    let model = &run.program.model;
    let mut topics = Vec::new();
    for mixture in &model.mixtures {
        let Some(instance) = run.program.scene.instances.get(mixture.instance.0 as usize) else { continue };
        let species: Vec<String> = mixture
            .contents
            .iter()
            .map(|c| model.species.get(c.species as usize).map_or_else(|| c.species.to_string(), |s| s.name.clone()))
            .collect();
        let amounts = mixture.contents.iter().map(|content| Column::content(run, content));
        let concentrations = mixture.concentrations.iter().map(|&i| Column::observable(run, i as usize));
        let properties = mixture.properties.iter().filter_map(|&i| Column::observable(run, i as usize));
        let named = |columns: Vec<Option<Column<'a>>>| -> Vec<Field<'a>> {
            species.iter().cloned().zip(columns).filter_map(|(s, c)| Some((s, c?))).collect()
        };
        let is_solid = mixture.contents.iter().map(|content| model.is_solid(content));
        let solids = species.iter().zip(&mixture.contents).zip(is_solid).filter(|(_, solid)| *solid);
        let solids = solids.filter_map(|((name, content), _)| Some((name.clone(), Column::content(run, content)?)));
        let mut groups = vec![
            Group { name: "amount", fields: named(amounts.collect()) },
            Group { name: "concentration", fields: named(concentrations.collect()) },
            Group { name: "property", fields: properties.map(|c| (split(run, c.name).1.to_owned(), c)).collect() },
            Group { name: "solid", fields: solids.collect() },
        ];
        groups.retain(|group| group.name != "solid" || !group.fields.is_empty());
        topics.push(Topic {
            topic: format!("/contents/{}", instance.name),
            schema: format!("matterix.Contents.{}", instance.name),
            groups,
        });
    }
    topics
}

impl Topic<'_> {
    /// Writes every point of its columns, those of one time together, so that a line drawn between messages of a field is the line
    /// of its column; the first and the last message have all fields.
    fn write<W: Write + Seek>(&self, run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
        let channel = sink.channel(&self.topic, &self.schema, &self.schema(), &self.units())?;
        let columns: Vec<&Column<'_>> = self.groups.iter().flat_map(|g| &g.fields).map(|(_, c)| c).collect();
        let mut frames = frames(&columns).peekable();
        let end = run.recording.sampled.map(|(_, end)| end);
        let mut is_first = true;
        while let Some(frame) = frames.next() {
            let is_last = frames.peek().is_none();
            // What rests when the run ends has no point there.
            let closing = end.filter(|end| is_last && frame.time < *end);
            let is_whole = is_first || (is_last && closing.is_none());
            let shown = |column: usize| is_whole || frame.has(column);
            sink.push_bytes(channel, frame.time, self.message(run, &columns, &frame, shown))?;
            if let Some(time) = closing {
                let frame = Frame { time, points: Vec::new() };
                sink.push_bytes(channel, time, self.message(run, &columns, &frame, |_| true))?;
            }
            is_first = false;
        }
        Ok(())
    }

    fn schema(&self) -> Value {
        let fields = |group: &Group<'_>| -> Vec<(String, Value)> {
            group.fields.iter().map(|(key, column)| (key.clone(), column_schema(column))).collect()
        };
        match self.groups.as_slice() {
            [only] if only.name.is_empty() => open(&self.schema, fields(only)),
            groups => open(&self.schema, groups.iter().map(|g| (g.name, open(g.name, fields(g))))),
        }
    }

    /// Units by field, for the channel's metadata.
    fn units(&self) -> BTreeMap<String, String> {
        let mut units = BTreeMap::new();
        for group in &self.groups {
            for (key, column) in &group.fields {
                let path = if group.name.is_empty() { key.clone() } else { format!("{}.{key}", group.name) };
                if !column.symbol().is_empty() {
                    units.insert(format!("unit {path}"), column.symbol().to_owned());
                }
            }
        }
        units
    }

    /// The message as JSON, written by hand because there are very many; `shown` are the columns that it has.
    fn message(&self, run: &Run<'_>, columns: &[&Column<'_>], frame: &Frame, shown: impl Fn(usize) -> bool) -> Vec<u8> {
        let mut out = vec![b'{'];
        let mut index = 0;
        for group in &self.groups {
            let fields: Vec<usize> = (index..index + group.fields.len()).filter(|i| shown(*i)).collect();
            let first = index;
            index += group.fields.len();
            let is_nested = !group.name.is_empty() && !fields.is_empty();
            if is_nested {
                comma(&mut out);
                append(&mut out, group.name);
                out.extend_from_slice(b":{");
            }
            for field in fields {
                comma(&mut out);
                append(&mut out, &group.fields[field - first].0);
                out.push(b':');
                append_column(&mut out, run, columns, frame, field);
            }
            if is_nested {
                out.push(b'}');
            }
        }
        out.push(b'}');
        out
    }
}

/// A number as exact as a curve whose error is not 0: more digits would make most of a file.
fn ten_digits(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// A comma where something stands before.
fn comma(out: &mut Vec<u8>) {
    if out.last() != Some(&b'{') {
        out.push(b',');
    }
}

fn append_column(out: &mut Vec<u8>, run: &Run<'_>, columns: &[&Column<'_>], frame: &Frame, index: usize) {
    let column = columns[index];
    let tuple = column.parts.len() > 1;
    if tuple {
        out.push(b'[');
    }
    for part in 0..column.parts.len() {
        if part > 0 {
            out.push(b',');
        }
        match column.cell(run, frame.value(columns, index, part)) {
            Cell::Number(value) if run.recording.error > 0.0 => append(out, &ten_digits(value)),
            Cell::Number(value) => append(out, &value),
            Cell::Bool(value) => append(out, &value),
            Cell::Name(name) => append(out, name),
        }
    }
    if tuple {
        out.push(b']');
    }
}

/// Appends a number, a truth value or a text as JSON, to which memory is the only obstacle.
fn append(out: &mut Vec<u8>, value: &(impl serde::Serialize + ?Sized)) {
    let _ = serde_json::to_writer(out, value);
}

fn column_schema(column: &Column<'_>) -> Value {
    let one = match column.shown {
        Shown::Quantity(unit) => {
            let mut schema = number(&unit.symbol);
            // A value that is not finite has no JSON number.
            schema["type"] = json!(["number", "null"]);
            schema
        }
        Shown::Bool => truth(""),
        Shown::Instance => text("name of an instance, or `nothing`"),
        Shown::Enum(words) => text(&format!("one of {}", words.join(", "))),
    };
    if column.parts.len() > 1 { list(one) } else { one }
}

/// The instance a name belongs to (the longest that fits) and the rest; the lab if none does.
fn split<'a>(run: &Run<'a>, name: &'a str) -> (&'a str, &'a str) {
    let scene = &run.program.scene;
    let rest = |owner: &str| name.strip_prefix(owner).and_then(|r| r.strip_prefix('.'));
    let fits = scene.instances.iter().filter_map(|i| rest(&i.name).map(|r| (i.name.as_str(), r)));
    fits.max_by_key(|(owner, _)| owner.len()).unwrap_or((if scene.lab.is_empty() { "lab" } else { &scene.lab }, name))
}

fn readings<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    for (reading, marks) in run.program.model.readings.iter().zip(run.recording.by_reading(run.program)) {
        let name = format!("matterix.Reading.{}", reading.name);
        let schema = object(&name, [("value", number(&reading.unit.symbol))]);
        let units = BTreeMap::from([("unit value".to_owned(), reading.unit.symbol.clone())]);
        let channel = sink.channel(&format!("/readings/{}", reading.name), &name, &schema, &units)?;
        for mark in marks.into_iter().filter(|m| m.value.is_finite()) {
            sink.push(channel, mark.time, &json!({ "value": reading.unit.of_si(mark.value) }))?;
        }
    }
    Ok(())
}

fn records<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let taken = run.recording.values.by_name();
    for (record, unit) in record_units(run) {
        let name = format!("matterix.Record.{record}");
        let schema = object(&name, [("value", list(number(&unit.symbol)))]);
        let units = BTreeMap::from([("unit value".to_owned(), unit.symbol.clone())]);
        let channel = sink.channel(&format!("/records/{record}"), &name, &schema, &units)?;
        for entry in taken.get(record).into_iter().flat_map(Record::iter) {
            let values: Vec<f64> = entry.values.iter().map(|&v| unit.of_si(v)).collect();
            sink.push(channel, entry.time, &json!({ "value": values }))?;
        }
    }
    Ok(())
}
