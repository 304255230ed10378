//! What is done, step by step: a list to read, or one JSON object per line for programs.

use std::fmt::Write;

use matterix_ir::Diagnostic;
use matterix_ir::plan::{Argument, Operation, Step};
use matterix_ir::scene::InstanceId;
use serde_json::{Map, Value, json};

use crate::course::{self, Means};
use crate::finding::settle;
use crate::performance::{Act, Deed, Performance, number};
use crate::{Subject, Written, place};

/// What the target is called in findings.
const WHAT: &str = "a list of steps";

/// What it can say beside one thing after another: when each begins, and what is waited for.
const MEANS: Means = Means { beside: true, conditions: true, handlers: false };

/// One step in words: its number, when it begins, its line in the text, what it is.
pub fn text(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let (steps, warnings) = gather(subject, performance)?;
    let width = steps.len().to_string().len();
    let places: Vec<String> = steps.iter().map(|s| format!("{}:{}", s.file, s.line)).collect();
    let widest = places.iter().map(|p| p.chars().count()).max().unwrap_or(0);
    let mut out = String::new();
    for (index, (step, place)) in steps.iter().zip(&places).enumerate() {
        let _ = writeln!(out, "{:width$}  {:9.1} s  {place:widest$}  {}", index + 1, step.act.time, step.words);
    }
    Ok((out.into_bytes(), warnings))
}

/// The same for programs; docs/emit.md describes the fields.
pub fn json(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let mut out = String::new();
    let (steps, warnings) = gather(subject, performance)?;
    for (index, step) in steps.iter().enumerate() {
        let mut line = json!({
            "step": index + 1,
            "time": number(step.act.time),
            "file": step.file,
            "line": step.line,
            "text": step.words,
        });
        if let Value::Object(line) = &mut line {
            line.extend(fields(subject, step.act));
        }
        let _ = writeln!(out, "{line}");
    }
    Ok((out.into_bytes(), warnings))
}

/// An act with its place.
struct Listed<'a> {
    act: &'a Act,
    file: String,
    line: usize,
    words: String,
}

fn gather<'a>(
    subject: Subject<'_>,
    performance: &'a Performance<'_>,
) -> Result<(Vec<Listed<'a>>, Vec<Diagnostic>), Vec<Diagnostic>> {
    let Subject { program, wiring, sources } = subject;
    let warnings = settle(course::open(program, wiring, sources, &performance.acts, MEANS, WHAT))?;
    let origins = place::origins(&program.plan, sources);
    let listed = performance.acts.iter().map(|act| {
        let at = origins.get(act.step.0 as usize).copied().unwrap_or_default();
        let (file, line, _) = place::line(sources, at);
        Listed { act, file, line, words: act.words.clone() }
    });
    Ok((listed.collect(), warnings))
}

/// What kind of step it is, with its numbers.
fn fields(subject: Subject<'_>, act: &Act) -> Map<String, Value> {
    let name = |id: InstanceId| subject.program.scene.get(id).name.as_str();
    let fields = match (&act.deed, &subject.program.plan.get(act.step).step) {
        (Deed::Operation(_), Step::Operation(operation)) => json!({
            "kind": "operation",
            "verb": operation.verb,
            "device": operation.device.map(name),
            "arguments": arguments(subject, operation, &act.values),
        }),
        (Deed::Wait(seconds), _) => json!({ "kind": "wait", "seconds": number(*seconds) }),
        (Deed::WaitUntil, Step::WaitUntil { condition, .. } | Step::Hold { condition, .. }) => {
            json!({ "kind": "wait until", "condition": condition.text })
        }
        (Deed::Note(text), _) => json!({ "kind": "note", "message": text }),
        (Deed::Ask(text), _) => json!({ "kind": "ask", "message": text }),
        _ => Value::Null,
    };
    match fields {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// Arguments by name; a quantity as its number and its unit.
fn arguments(subject: Subject<'_>, operation: &Operation, values: &[Option<f64>]) -> Map<String, Value> {
    let name = |id: &InstanceId| Value::from(subject.program.scene.get(*id).name.as_str());
    let mut values = values.iter().copied();
    let mut out = Map::new();
    for (key, argument) in &operation.arguments {
        let value = match argument {
            Argument::Quantity(_, unit) => {
                let value = values.next().flatten().map(|si| number(unit.of_si(si)));
                json!({ "value": value, "unit": unit.symbol })
            }
            Argument::Word(_, words) => {
                values.next().flatten().and_then(|v| words.get(v as usize)).map_or(Value::Null, |w| w.as_str().into())
            }
            Argument::Instance(id) => name(id),
            Argument::Instances(ids) => ids.iter().map(name).collect(),
            Argument::Text(text) => text.as_str().into(),
        };
        out.insert(key.clone(), value);
    }
    out
}
