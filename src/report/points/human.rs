//! Statements with what they change, for people.

use matterix_ir::Span;
use matterix_ir::points::{After, Fact, Point, Points, Settled, Thing, Value};

use super::things::together;
use super::values::{fact, time, value};
use crate::report::text::{Texts, harmless_line};

/// Columns of a statement before the time.
const STATEMENT: usize = 72;

/// So many species of a mixture are listed in the table, those of which there is most.
const MOST_SPECIES: usize = 4;

/// So many groups of things that a statement changes are listed in the table.
const MOST_GROUPS: usize = 8;

/// A statement, or the end of one with a block, in the order in which a reader comes by.
struct Row<'p> {
    point: &'p Point,
    ends: bool,
}

/// Every statement with what it changes.
pub(super) fn table(points: &Points, texts: &mut Texts<'_>) -> String {
    let mut out = format!("{} in {}\n", points.workflow, points.lab);
    let holding = points.start.iter().filter(|t| !t.species.is_empty()).filter_map(|t| held(t, |_, _| true));
    out.push_str("  at the start\n");
    write(holding.collect(), usize::MAX, &mut out);
    let mut before: Option<&After> = None;
    for row in rows(points) {
        let place = line(if row.ends { end_of(row.point.span) } else { row.point.span }, texts);
        let label = harmless_line(&row.point.label);
        let label = if row.ends { format!("end of {label}") } else { label };
        let Some(after) = &row.point.after else {
            let why = if row.point.reached { "no step after it runs" } else { "never reached" };
            head(&place, &label, why, &mut out);
            continue;
        };
        let said = changes(after, before.filter(|_| row.ends));
        if row.ends && said.is_empty() {
            continue;
        }
        let often = if row.point.repeated { "each time, " } else { "" };
        head(&place, &label, &format!("{often}{}", time(&after.elapsed)), &mut out);
        write(said, MOST_GROUPS, &mut out);
        before = Some(after);
    }
    out
}

/// Everything that is known after one statement.
pub(super) fn all(points: &Points, index: usize, texts: &mut Texts<'_>) -> String {
    after(points, index, |_| true, texts)
}

/// The same of the things that the statement changes, or whose names stand in it.
pub(super) fn brief(points: &Points, index: usize, texts: &mut Texts<'_>) -> String {
    let label = points.points.get(index).map_or("", |point| point.label.as_str());
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<&str> = label.split(|c| !word(c)).collect();
    let named = |thing: &Thing| words.contains(&thing.name.split(|c| !word(c)).next().unwrap_or_default());
    after(points, index, |thing| thing.changed() || named(thing), texts)
}

fn after(points: &Points, index: usize, show: impl Fn(&Thing) -> bool, texts: &mut Texts<'_>) -> String {
    let mut out = format!("{} in {}\n", points.workflow, points.lab);
    let Some(point) = points.points.get(index) else { return out };
    let label = harmless_line(&point.label);
    let place = line(point.span, texts);
    let Some(after) = &point.after else {
        let why = if point.reached { "no step after it runs" } else { "never reached" };
        head(&place, &label, why, &mut out);
        return out;
    };
    let often = if point.repeated { "each time, " } else { "" };
    head(&place, &label, &format!("{often}{}", time(&after.elapsed)), &mut out);
    write(after.kept.iter().map(|f| (f.name.clone(), value(&f.value))).collect(), usize::MAX, &mut out);
    let shown = after.things.iter().filter(|thing| show(thing));
    let (holding, others): (Vec<&Thing>, Vec<&Thing>) = shown.partition(|t| !t.species.is_empty());
    write(holding.into_iter().filter_map(|t| held(t, |_, _| true)).collect(), usize::MAX, &mut out);
    write(others.into_iter().filter_map(|t| said_of(t, |_, _| true, usize::MAX)).collect(), usize::MAX, &mut out);
    out
}

/// Statements, and the ends of those with blocks, in the order of the text.
fn rows(points: &Points) -> Vec<Row<'_>> {
    let mut out: Vec<Row<'_>> = points
        .points
        .iter()
        .filter(|p| !p.block || p.after.is_none())
        .map(|point| Row { point, ends: false })
        .chain(points.points.iter().filter(|p| p.block && p.after.is_some()).map(|point| Row { point, ends: true }))
        .collect();
    out.sort_by_key(|r| {
        let span = r.point.span;
        // An inner block ends before the outer one.
        (span.file, if r.ends { span.end } else { span.start }, std::cmp::Reverse(span.start))
    });
    out
}

/// What a statement changes, by thing; at the end of a block only what has not been said by the statement before it.
fn changes(after: &After, before: Option<&After>) -> Vec<(String, String)> {
    let new = |name: &str, state: State, f: &Fact| {
        let told = before.and_then(|b| b.things.iter().find(|t| t.name == name));
        let told = told.and_then(|t| match state {
            State::Put => t.facts.iter().chain(&t.species).find(|o| o.name == f.name),
            State::Settled => t.settled.iter().map(|s| &s.amount).find(|o| o.name == f.name),
        });
        // What only rounding tells apart reads the same.
        f.changed && told.is_none_or(|o| value(&o.value) != value(&f.value))
    };
    let kept = after.kept.iter().filter(|_| before.is_none()).map(|f| (f.name.clone(), value(&f.value)));
    let things = after.things.iter().filter_map(|t| said_of(t, |state, f| new(&t.name, state, f), MOST_SPECIES));
    kept.chain(things).collect()
}

/// What a mixture holds; nothing of an empty one.
fn held(thing: &Thing, show: impl Fn(State, &Fact) -> bool) -> Option<(String, String)> {
    let there = thing.species.iter().any(|s| !is_nothing(&s.value));
    if there { said_of(thing, show, usize::MAX) } else { None }
}

/// What an amount is of: what was put there, like all other facts, or what is there at equilibrium.
#[derive(Clone, Copy)]
enum State {
    Put,
    Settled,
}

/// The facts to be shown of a thing: its members, then its species, at equilibrium too, then its reagents.
fn said_of(thing: &Thing, show: impl Fn(State, &Fact) -> bool, most: usize) -> Option<(String, String)> {
    let facts: Vec<String> = thing.facts.iter().filter(|f| show(State::Put, f)).map(fact).collect();
    // What is not there is worth saying only where it just went.
    let species = thing.species.iter().filter(|f| show(State::Put, f) && (f.changed || !is_nothing(&f.value)));
    let species = listed(species.collect(), most);
    let settled: Vec<&Settled> =
        thing.settled.iter().filter(|s| show(State::Settled, &s.amount) && differs(thing, s)).collect();
    let of = |solid: bool| listed(settled.iter().filter(|s| s.solid == solid).map(|s| &s.amount).collect(), most);
    let (dissolved, solids) = (of(false), of(true));
    if facts.is_empty() && species.is_empty() && settled.is_empty() {
        return None;
    }
    let touched: Vec<String> =
        thing.reagents.iter().map(|r| if r.certain { r.name.clone() } else { format!("perhaps {}", r.name) }).collect();
    let headed = |head: &str, names: &[String]| match names {
        [] => String::new(),
        _ if head.is_empty() => names.join(", "),
        _ => format!("{head} {}", names.join(", ")),
    };
    let put = if thing.settled.is_empty() { "" } else { "put in" };
    let parts = [
        facts.join(", "),
        headed(put, &species),
        headed("at equilibrium", &dissolved),
        headed("solid", &solids),
        headed("touched", &touched),
    ];
    Some((thing.name.clone(), parts.into_iter().filter(|p| !p.is_empty()).collect::<Vec<_>>().join("; ")))
}

/// Amounts with those first of which there is most; the rest is only counted.
fn listed(mut amounts: Vec<&Fact>, most: usize) -> Vec<String> {
    amounts.sort_by(|a, b| size(&b.value).total_cmp(&size(&a.value)));
    let rest = amounts.len().saturating_sub(most);
    let names = amounts.iter().take(most).map(|f| fact(f));
    names.chain((rest > 0).then(|| format!("{rest} more"))).collect()
}

/// Whether what is there at equilibrium is to be told: a solid that is there, or what is not as much as was put in.
fn differs(thing: &Thing, settled: &Settled) -> bool {
    let Fact { name, value: known, changed, .. } = &settled.amount;
    let put = thing.species.iter().find(|s| s.name == *name);
    let is_same = !settled.solid && put.is_some_and(|put| value(&put.value) == value(known));
    !is_same && (*changed || !is_nothing(known))
}

fn is_nothing(value: &Value) -> bool {
    matches!(value, Value::Exact(v, _) if *v == 0.0)
}

/// The largest magnitude that a value may have; what is not known comes last.
fn size(value: &Value) -> f64 {
    match value {
        Value::Exact(v, _) => v.abs(),
        Value::OneOf(all, _) => all.iter().map(|v| v.abs()).fold(0.0, f64::max),
        Value::Between(low, high, _) => high.or(*low).map_or(0.0, f64::abs),
        Value::Words(_) | Value::Unknown => -1.0,
    }
}

fn end_of(span: Span) -> Span {
    Span { start: span.end.saturating_sub(1), ..span }
}

fn line(span: Span, texts: &mut Texts<'_>) -> String {
    let Some(text) = texts.get(span.file) else { return String::new() };
    let (line, _) = text.position(span.start as usize);
    if span.file.0 == 0 { line.to_string() } else { format!("{}:{line}", text.name()) }
}

fn head(place: &str, label: &str, time: &str, out: &mut String) {
    let label = match label.char_indices().nth(STATEMENT) {
        Some((cut, _)) => format!("{}…", &label[..cut]),
        None => label.to_string(),
    };
    out.push_str(format!("{place:>5}  {label:<width$}  {time}", width = STATEMENT + 1).trim_end());
    out.push('\n');
}

/// Names and what is said of them, those of which the same is said together.
fn write(rows: Vec<(String, String)>, most: usize, out: &mut String) {
    let groups = together(rows);
    let shown = if groups.len() > most { most - 1 } else { groups.len() };
    for (names, said) in &groups[..shown] {
        out.push_str(&format!("         {names}: {said}\n"));
    }
    if shown < groups.len() {
        out.push_str(&format!("         ... and {} more; `--at` shows all\n", groups.len() - shown));
    }
}
