//! Findings with corrections that have names, so that a client can ask for one.

use std::collections::BTreeMap;

use matterix_ir::{Diagnostic, Fix, Severity, Sources};
use rmcp::schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::report::{self, Format, Look, Reporter, stricter};

/// Findings sent as data; of more there is only the number.
const MOST: usize = 50;
/// Columns of running text.
const WIDTH: usize = 100;
const LOOK: Look = Look { color: false, width: WIDTH };

/// The findings of a text, as data.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Findings {
    /// How many errors there are: a protocol with errors cannot run.
    pub errors: usize,
    /// How many warnings.
    pub warnings: usize,
    /// The first 50, as `check --format json` writes them (resource `mtx://findings`); each of their `fixes` has an `id` for the tool `fix`.
    #[schemars(with = "Vec<Map<String, Value>>")]
    pub findings: Vec<Value>,
}

/// A finding with the names of its corrections.
pub struct Named {
    /// What was found.
    pub diagnostic: Diagnostic,
    /// As many as there are corrections.
    pub ids: Vec<String>,
}

/// Findings by place. A correction is named by code and byte of its finding and a number: `unit-mismatch@109.1`.
pub fn named(sources: &Sources, found: Vec<Diagnostic>) -> Vec<Named> {
    let mut counts: BTreeMap<(&'static str, u32), usize> = BTreeMap::new();
    let arranged = Reporter::new(Format::Json, LOOK).arrange(sources, found);
    let named = arranged.into_iter().map(|diagnostic| {
        let (code, byte) = (diagnostic.code.name, diagnostic.span().start);
        let ids = diagnostic.fixes.iter().map(|_| {
            let count = counts.entry((code, byte)).or_default();
            *count += 1;
            format!("{code}@{byte}.{count}")
        });
        Named { ids: ids.collect(), diagnostic }
    });
    named.collect()
}

/// Makes warnings of advice and errors of warnings, or leaves advice out.
pub fn judged(found: Vec<Named>, strict: bool) -> Vec<Named> {
    let judged = found.into_iter().filter(|n| strict || n.diagnostic.severity != Severity::Advice).map(|mut n| {
        if strict {
            n.diagnostic.severity = stricter(n.diagnostic.severity);
        }
        n
    });
    judged.collect()
}

/// As data, and to read with the names of corrections below.
pub fn told(sources: &Sources, found: &[Named]) -> (Findings, String) {
    let mut reporter = Reporter::new(Format::Human, LOOK);
    let mut text = reporter.render(sources, found.iter().map(|n| n.diagnostic.clone()).collect());
    text += &reporter.summary();
    let offers: String =
        found.iter().take(MOST).flat_map(|n| n.diagnostic.fixes.iter().zip(&n.ids)).map(offer).collect();
    if !offers.is_empty() {
        text += &format!("fixes that `fix` can apply:\n{offers}");
    }
    let tally = reporter.tally();
    let findings = found.iter().take(MOST).map(|n| object(n, sources)).collect();
    (Findings { errors: tally.errors, warnings: tally.warnings, findings }, text)
}

/// One line of the list of corrections.
fn offer((fix, id): (&Fix, &String)) -> String {
    let sure = match fix {
        Fix { sure: true, .. } => "sure",
        Fix { asks: true, .. } => "for a person to choose",
        _ => "a guess",
    };
    format!("  {id} ({sure}): {}\n", fix.title)
}

fn object(named: &Named, sources: &Sources) -> Value {
    let mut object = report::object(&named.diagnostic, sources);
    if let Some(fixes) = object.get_mut("fixes").and_then(Value::as_array_mut) {
        for (fix, id) in fixes.iter_mut().zip(&named.ids) {
            fix["id"] = Value::from(id.as_str());
        }
    }
    object
}
