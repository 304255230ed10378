//! `/plan`, `/log` and `/expectations`: what was done and what was said.

use std::collections::BTreeMap;

use serde_json::Value;

use super::{Topic, list, text};
use crate::document::{Document, Expectation, Interval, Level, LogLine, Node, Source, State};

/// Reads all of them; `texts` are the attached files.
pub(super) fn read(topics: &[Topic], texts: &[Source], document: &mut Document) {
    plan(topics, texts, document);
    for (time, line) in messages(topics, "/log") {
        let level = match line.get("level").and_then(Value::as_u64) {
            Some(4..) => Level::Error,
            Some(3) => Level::Warning,
            _ => Level::Info,
        };
        let place = place(line, texts, document);
        document.log.push(LogLine { time, level, text: text(line, "message").to_owned(), place });
    }
    for (time, judged) in messages(topics, "/expectations") {
        let passed = judged.get("passed").and_then(Value::as_bool).unwrap_or(false);
        let place = place(judged, texts, document);
        let text = text(judged, "text").to_owned();
        document.expectations.push(Expectation { time, text, passed, found: found(judged), place });
    }
}

fn messages<'a>(topics: &'a [Topic], name: &str) -> impl Iterator<Item = (f64, &'a Value)> {
    let of = topics.iter().find(|t| t.name == name);
    of.into_iter().flat_map(|t| t.messages.iter().map(|(time, message)| (*time, message)))
}

/// What an expectation compared: `first: 48 g`.
fn found(judged: &Value) -> Vec<String> {
    let one = |measured: &Value| {
        let value = measured.get("value").and_then(Value::as_f64)?;
        let unit = text(measured, "unit");
        let number = matterix_ir::quantity::show_number(value);
        let shown = if unit.is_empty() { number } else { format!("{number} {unit}") };
        let what = text(measured, "text");
        // The comparison names the limits as well; what stands before them says what was measured.
        let what = what.split([' ']).next().filter(|w| !w.is_empty()).unwrap_or(what);
        Some(format!("{what}: {shown}"))
    };
    list(judged, "measured").iter().filter_map(one).collect()
}

/// File and line; the file is added if it is new.
fn place(of: &Value, texts: &[Source], document: &mut Document) -> Option<(u32, u32)> {
    let name = Some(text(of, "file")).filter(|f| !f.is_empty())?;
    let line = of.get("line").and_then(Value::as_u64).filter(|&l| l > 0)?;
    let index = document.sources.iter().position(|s| s.name == name).unwrap_or_else(|| {
        let text = texts.iter().find(|s| s.name == name).map(|s| s.text.clone()).unwrap_or_default();
        document.sources.push(Source { name: name.to_owned(), text });
        document.sources.len() - 1
    });
    Some((index as u32, u32::try_from(line).ok()?))
}

/// A node as the file has it.
struct Row<'a> {
    label: &'a str,
    path: &'a str,
    message: &'a Value,
    runs: Vec<Interval>,
}

fn plan(topics: &[Topic], texts: &[Source], document: &mut Document) {
    let mut rows: BTreeMap<u64, Row<'_>> = BTreeMap::new();
    // What is above everything begins first.
    let mut top = None;
    for (time, message) in messages(topics, "/plan") {
        let Some(id) = message.get("id").and_then(Value::as_u64) else { continue };
        let (label, path) = (text(message, "label"), text(message, "path"));
        let row = rows.entry(id).or_insert_with(|| Row { label, path, message, runs: Vec::new() });
        let open = row.runs.last_mut().filter(|run| run.end.is_none());
        let state = match text(message, "state") {
            "running" => State::Running,
            "done" => State::Done,
            "failed" => State::Failed,
            "skipped" => State::Skipped,
            _ => continue,
        };
        match (state, open) {
            (State::Running, None) => {
                row.runs.push(Interval { start: time, end: None, state });
                top = top.or(Some(id));
            }
            (State::Running, Some(_)) => {}
            (_, Some(open)) => (open.end, open.state) = (Some(time), state),
            (_, None) => row.runs.push(Interval { start: time, end: Some(time), state }),
        }
    }
    document.ended = top.and_then(|id| rows.get(&id)).and_then(|row| row.runs.last()).map(|run| run.state);
    let rows: Vec<Row<'_>> = rows.into_values().collect();
    let above: Vec<Above> = (0..rows.len()).map(|i| above(&rows, i)).collect();
    let mut below: Vec<Vec<usize>> = vec![Vec::new(); rows.len()];
    let mut stack: Vec<(usize, Option<u32>)> = Vec::new();
    for (i, above) in above.iter().enumerate() {
        match above {
            Above::Node(parent) => below[*parent].push(i),
            Above::Top => stack.push((i, None)),
            Above::Hidden => {}
        }
    }
    stack.reverse();
    while let Some((i, parent)) = stack.pop() {
        let row = &rows[i];
        let place = place(row.message, texts, document);
        document.plan.push(Node { parent, label: row.label.to_owned(), place, runs: row.runs.clone() });
        let index = document.plan.len() as u32 - 1;
        stack.extend(below[i].iter().rev().map(|&child| (child, Some(index))));
    }
}

/// What a node stands under.
enum Above {
    /// Nothing.
    Top,
    /// Another node, of a higher number.
    Node(usize),
    /// It only orders others and is not shown.
    Hidden,
}

/// A path is the labels from the workflow down, without those of nodes that only order others; nodes are numbered after
/// those below them. So the node above is the next one that has the path before this one's label.
fn above(rows: &[Row<'_>], index: usize) -> Above {
    let Some(path) = before_label(&rows[index]) else { return Above::Hidden };
    let later = rows.iter().enumerate().skip(index + 1);
    later
        .filter(|(_, row)| row.path == path && before_label(row).is_some())
        .map(|(i, _)| Above::Node(i))
        .next()
        .unwrap_or(Above::Top)
}

/// The path above a node; `None` for one whose label is not in its path.
fn before_label<'a>(row: &Row<'a>) -> Option<&'a str> {
    row.path.strip_suffix(row.label).and_then(|rest| rest.strip_suffix(" > "))
}
