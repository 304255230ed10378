//! Findings for systems that collect them from many tools: SARIF 2.1.0 (OASIS Standard, 2020).

use std::collections::BTreeMap;

use matterix_ir::{Code, Diagnostic, Fix, Severity, Span};
use serde_json::{Value, json};

use super::text::{Text, Texts};
use crate::uri::{SCHEME, escape};

/// Where the schema of the form is published.
const SCHEMA: &str = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json";
/// The modules of the standard library are in no file.
const LIBRARY: &str = "std::";

/// What was found, and the codes it has.
#[derive(Default)]
pub(super) struct Log {
    results: Vec<Value>,
    codes: Vec<Code>,
}

impl Log {
    /// Adds a finding.
    pub(super) fn push(&mut self, diagnostic: &Diagnostic, texts: &mut Texts<'_>) {
        let code = diagnostic.code;
        let rule = self.codes.iter().position(|c| *c == code).unwrap_or_else(|| {
            self.codes.push(code);
            self.codes.len() - 1
        });
        let mut text = diagnostic.headline.clone();
        for help in &diagnostic.help {
            text += &format!("\nhelp: {help}");
        }
        let place = |primary: bool, texts: &mut Texts<'_>| -> Vec<Value> {
            let labels = diagnostic.labels.iter().filter(|l| l.primary == primary);
            labels.filter_map(|l| Some(location(physical(l.span, texts)?, &l.text))).collect()
        };
        let mut result = json!({
            "ruleId": code.name,
            "ruleIndex": rule,
            "level": level(diagnostic.severity),
            "message": { "text": text },
            "locations": place(true, texts),
        });
        let history = place(false, texts);
        if !history.is_empty() {
            result["relatedLocations"] = history.into();
        }
        let fixes: Vec<Value> = diagnostic.fixes.iter().filter_map(|f| fix(f, texts)).collect();
        if !fixes.is_empty() {
            result["fixes"] = fixes.into();
        }
        self.results.push(result);
    }

    /// The whole document.
    pub(super) fn document(&self) -> String {
        let rules: Vec<Value> = self.codes.iter().map(rule).collect();
        let driver = json!({
            "name": env!("CARGO_PKG_NAME"),
            "version": env!("CARGO_PKG_VERSION"),
            "semanticVersion": env!("CARGO_PKG_VERSION"),
            "rules": rules,
        });
        let run = json!({
            "tool": { "driver": driver },
            "columnKind": "utf16CodeUnits",
            "results": self.results,
        });
        let document = json!({ "$schema": SCHEMA, "version": "2.1.0", "runs": [run] });
        format!("{document:#}\n")
    }
}

fn level(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Advice => "note",
    }
}

fn rule(code: &Code) -> Value {
    json!({
        "id": code.name,
        "shortDescription": { "text": code.summary },
        "help": { "text": code.page, "markdown": code.page },
        "properties": { "family": code.family },
    })
}

fn location(physical: Value, text: &str) -> Value {
    match text {
        "" => json!({ "physicalLocation": physical }),
        text => json!({ "physicalLocation": physical, "message": { "text": text } }),
    }
}

fn physical(span: Span, texts: &mut Texts<'_>) -> Option<Value> {
    let text = texts.get(span.file)?;
    Some(json!({ "artifactLocation": artifact(text), "region": region(span, text) }))
}

fn artifact(text: &Text) -> Value {
    json!({ "uri": uri(text.name()) })
}

/// A file as named on the command line, or a module of the library: `mtx-std:/heating.mtx`.
fn uri(name: &str) -> String {
    match name.strip_prefix(LIBRARY) {
        Some(module) => format!("{SCHEME}:/{}.mtx", escape(&module.replace("::", "/"))),
        None if name.starts_with('/') => format!("file://{}", escape(name)),
        None => escape(&name.replace('\\', "/")),
    }
}

fn region(span: Span, text: &Text) -> Value {
    let (start_line, start_column) = text.position_utf16(span.start as usize);
    let (end_line, end_column) = text.position_utf16(span.end as usize);
    json!({
        "startLine": start_line,
        "startColumn": start_column,
        "endLine": end_line,
        "endColumn": end_column,
        "byteOffset": span.start,
        "byteLength": span.end.saturating_sub(span.start),
    })
}

fn fix(fix: &Fix, texts: &mut Texts<'_>) -> Option<Value> {
    let mut changes: BTreeMap<_, (Value, Vec<Value>)> = BTreeMap::new();
    for edit in &fix.edits {
        let text = texts.get(edit.span.file)?;
        let replacement = json!({ "deletedRegion": region(edit.span, text), "insertedContent": { "text": edit.text } });
        changes.entry(edit.span.file).or_insert_with(|| (artifact(text), Vec::new())).1.push(replacement);
    }
    let changes: Vec<Value> = changes
        .into_values()
        .map(|(artifact, replacements)| json!({ "artifactLocation": artifact, "replacements": replacements }))
        .collect();
    Some(json!({ "description": { "text": fix.title }, "artifactChanges": changes }))
}
