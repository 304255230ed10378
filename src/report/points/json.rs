//! What is known as JSON; the shape is promised in `docs/contents.md`.

use matterix_ir::points::{Fact, Point, Points, Settled, Thing, Value};
use serde_json::{Value as Json, json};

use crate::report::json::span;
use crate::report::text::Texts;

/// One object on a line.
pub(super) fn render(points: &Points, only: Option<usize>, texts: &mut Texts<'_>) -> String {
    let chosen = points.points.iter().enumerate().filter(|(i, _)| only.is_none_or(|o| o == *i));
    let statements: Vec<Json> = chosen.map(|(_, p)| point(p, only.is_some(), texts)).collect();
    let object = json!({
        "contents": {
            "version": points.version,
            "workflow": points.workflow,
            "lab": points.lab,
            "start": points.start.iter().map(|t| thing(t, true)).collect::<Vec<_>>(),
            "statements": statements,
        }
    });
    format!("{object}\n")
}

fn point(point: &Point, everything: bool, texts: &mut Texts<'_>) -> Json {
    let after = point.after.as_ref().map(|after| {
        let things = after.things.iter().filter(|t| everything || t.changed());
        json!({
            "elapsed": value(&after.elapsed),
            "kept": after.kept.iter().map(fact).collect::<Vec<_>>(),
            "things": things.map(|t| thing(t, everything)).collect::<Vec<_>>(),
        })
    });
    json!({
        "span": span(point.span, texts),
        "text": point.label,
        "reached": point.reached,
        "repeated": point.repeated,
        "block": point.block,
        "after": after,
    })
}

fn thing(thing: &Thing, everything: bool) -> Json {
    let facts = |all: &[Fact]| -> Vec<Json> { all.iter().filter(|f| everything || f.changed).map(fact).collect() };
    let reagents: Vec<Json> =
        thing.reagents.iter().map(|r| json!({ "name": r.name, "certain": r.certain, "changed": r.changed })).collect();
    let mut out = json!({
        "name": thing.name,
        "members": facts(&thing.facts),
        "species": facts(&thing.species),
        "reagents": reagents,
    });
    if !thing.settled.is_empty() {
        let shown = thing.settled.iter().filter(|s| everything || s.amount.changed);
        out["settled"] = shown.map(settled).collect();
    }
    out
}

fn settled(settled: &Settled) -> Json {
    let mut out = fact(&settled.amount);
    out["solid"] = settled.solid.into();
    out
}

fn fact(fact: &Fact) -> Json {
    let mut out = json!({ "name": fact.name, "value": value(&fact.value), "changed": fact.changed });
    if fact.outside {
        out["outside"] = true.into();
    }
    out
}

/// Numbers in the unit named beside them.
fn value(value: &Value) -> Json {
    match value {
        Value::Exact(v, unit) => json!({ "exact": unit.of_si(*v), "unit": unit.symbol }),
        Value::OneOf(all, unit) => {
            let all: Vec<f64> = all.iter().map(|v| unit.of_si(*v)).collect();
            json!({ "one_of": all, "unit": unit.symbol })
        }
        Value::Between(low, high, unit) => {
            let [low, high] = [low, high].map(|v| v.map(|v| unit.of_si(v)));
            json!({ "low": low, "high": high, "unit": unit.symbol })
        }
        Value::Words(words) => json!({ "words": words }),
        Value::Unknown => Json::Null,
    }
}
