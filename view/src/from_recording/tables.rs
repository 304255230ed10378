//! Topics of numbers and words: states, contents, readings, records.

use serde_json::{Map, Value};

use super::Topic;
use crate::bench::Owners;
use crate::document::{Contents, Document, Origin, Series, Words};
use crate::{thin, units};

/// How far a curve may lie from where it is shown, of its reach.
const TOLERANCE: f64 = 5e-4;

/// Reads all of them.
pub(super) fn read(topics: &[Topic], owners: &Owners, document: &mut Document) {
    for topic in topics {
        if let Some(name) = topic.name.strip_prefix("/contents/") {
            contents(topic, name, owners, document);
        } else if let Some(name) = topic.name.strip_prefix("/state/") {
            states(topic, name, owners, document);
        } else if let Some(name) = topic.name.strip_prefix("/readings/") {
            single(topic, name, Origin::Reading, owners, document);
        } else if let Some(name) = topic.name.strip_prefix("/records/") {
            single(topic, name, Origin::Record, owners, document);
        }
    }
}

/// One column of a topic: its path in the message, the component of a list, and its values over time.
struct Column {
    group: String,
    field: String,
    component: Option<usize>,
    times: Vec<f64>,
    values: Vec<f64>,
}

/// The numbers of a topic by column, in the order of its first message, which has all fields; others have those that they are about.
fn columns(topic: &Topic) -> Vec<Column> {
    let Some((_, Value::Object(first))) = topic.messages.first() else { return Vec::new() };
    let mut columns = Vec::new();
    for (key, value) in first {
        match value {
            Value::Object(inner) => inner.iter().for_each(|(field, value)| shape(key, field, value, &mut columns)),
            _ => shape("", key, value, &mut columns),
        }
    }
    for column in &mut columns {
        let points = topic.messages.iter().filter_map(|(time, message)| Some((*time, pick(message, column)?)));
        (column.times, column.values) = points.unzip();
    }
    columns
}

fn shape(group: &str, field: &str, value: &Value, columns: &mut Vec<Column>) {
    let mut add = |component| {
        let (group, field) = (group.to_owned(), field.to_owned());
        columns.push(Column { group, field, component, times: Vec::new(), values: Vec::new() })
    };
    match value {
        Value::Number(_) | Value::Null => add(None),
        Value::Array(parts) => (0..parts.len()).for_each(|i| add(Some(i))),
        _ => {}
    }
}

/// What a message says of a column, if it does; not a number where it says that there is none.
fn pick(message: &Value, column: &Column) -> Option<f64> {
    let of = if column.group.is_empty() { message } else { message.get(&column.group)? };
    let value = of.get(&column.field)?;
    let value = match column.component {
        Some(i) => value.get(i),
        None => Some(value),
    };
    Some(value.and_then(Value::as_f64).unwrap_or(f64::NAN))
}

/// Adds the columns as thinned series, those of equal times over one axis; gives the index of each.
fn add(
    topic: &Topic,
    columns: &[Column],
    named: impl Fn(&Column) -> (String, String),
    body: Option<u32>,
    origin: Origin,
    document: &mut Document,
) -> Vec<u32> {
    let first = document.series.len() as u32;
    // Columns of one topic share an axis as often as not: the one before is looked at first.
    let mut made: Vec<u32> = Vec::new();
    for column in columns {
        let tolerance = thin::tolerance(&column.values, TOLERANCE);
        let kept = thin::keep(&column.times, &[&column.values], &[tolerance]);
        let times: Vec<f64> = kept.iter().map(|&i| column.times[i]).collect();
        let known = made.iter().rev().copied().find(|axis| document.axes[*axis as usize] == times);
        let axis = known.unwrap_or_else(|| {
            document.axes.push(times);
            made.push(document.axes.len() as u32 - 1);
            document.axes.len() as u32 - 1
        });
        let (name, label) = named(column);
        let path = [column.group.as_str(), column.field.as_str()].into_iter().filter(|s| !s.is_empty());
        let unit = topic.unit(&path.collect::<Vec<_>>().join(".")).to_owned();
        let shown = |&i: &usize| Some(column.values[i] as f32).filter(|v| v.is_finite());
        document.series.push(Series {
            name,
            label,
            body,
            origin,
            unit,
            axis,
            values: kept.iter().map(shown).collect(),
        });
    }
    (first..document.series.len() as u32).collect()
}

/// `name.1` for the first component of a list.
fn with_component(name: String, column: &Column) -> String {
    column.component.map_or(name.clone(), |i| format!("{name}.{}", i + 1))
}

/// Groups of a mixture with their titles.
const GROUPS: [(&str, &str); 4] =
    [("property", "properties"), ("concentration", "concentrations"), ("amount", "amounts"), ("solid", "solids")];

fn contents(topic: &Topic, name: &str, owners: &Owners, document: &mut Document) {
    let columns = columns(topic);
    let body = owners.of(name);
    let named = |column: &Column| {
        let full = match column.group.as_str() {
            "concentration" => format!("{name}[{}]", column.field),
            "property" => format!("{name}.{}", column.field),
            group => format!("{name}.{group}[{}]", column.field),
        };
        (with_component(full, column), with_component(column.field.clone(), column))
    };
    let series = add(topic, &columns, named, body, Origin::Contents, document);
    let inside = owners.get(super::scene::owner(name));
    let mut made = Contents { name: name.to_owned(), body: inside, ..Contents::default() };
    for (i, column) in columns.iter().enumerate() {
        let own = &document.series[series[i] as usize];
        if let (None, "property", Some(size)) = (made.volume, column.group.as_str(), units::volume(&own.unit)) {
            made.volume = Some((series[i], size));
        }
        if made.color.is_none() && is_color(&columns[i..]) {
            made.color = Some([series[i], series[i + 1], series[i + 2]]);
        }
    }
    let never = |column: &Column| column.group != "property" && column.values.iter().all(|v| *v == 0.0);
    for (group, title) in GROUPS {
        let of = columns.iter().zip(&series).filter(|(c, _)| c.group == group && c.component.is_none() && !never(c));
        let listed: Vec<u32> = of.map(|(_, &index)| index).collect();
        if !listed.is_empty() {
            made.groups.push((title.to_owned(), listed));
        }
    }
    document.contents.push(made);
}

/// Whether the first columns are the three components, all between 0 and 1, of one property.
fn is_color(columns: &[Column]) -> bool {
    let [first, rest @ ..] = columns else { return false };
    let same = |c: &&Column| c.group == first.group && c.field == first.field;
    first.component == Some(0)
        && first.group == "property"
        && rest.iter().take_while(same).count() == 2
        && columns[..3].iter().all(|c| c.values.iter().all(|v| (-1e-6..=1.0 + 1e-6).contains(v)))
}

fn states(topic: &Topic, name: &str, owners: &Owners, document: &mut Document) {
    let columns = columns(topic);
    let body = owners.of(name);
    let named = |column: &Column| {
        let field = with_component(column.field.clone(), column);
        (format!("{name}.{field}"), field)
    };
    if !columns.is_empty() {
        add(topic, &columns, named, body, Origin::State, document);
    }
    let Some((_, Value::Object(first))) = topic.messages.first() else { return };
    for field in first.keys() {
        if let Some(words) = words(topic, name, field, body, first) {
            document.words.push(words);
        }
    }
}

/// A field that is a text or a truth value, where it changes.
fn words(topic: &Topic, name: &str, field: &str, body: Option<u32>, first: &Map<String, Value>) -> Option<Words> {
    if !matches!(first.get(field)?, Value::String(_) | Value::Bool(_)) {
        return None;
    }
    let mut made = Words { name: format!("{name}.{field}"), body, ..Words::default() };
    for (time, message) in &topic.messages {
        let word = match message.get(field) {
            Some(Value::String(text)) => text.clone(),
            Some(Value::Bool(true)) => "yes".to_owned(),
            Some(Value::Bool(false)) => "no".to_owned(),
            _ => continue,
        };
        if made.words.last() != Some(&word) {
            made.times.push(*time);
            made.words.push(word);
        }
    }
    Some(made)
}

fn single(topic: &Topic, name: &str, origin: Origin, owners: &Owners, document: &mut Document) {
    let columns = columns(topic);
    let alone = columns.len() == 1;
    let named = |column: &Column| {
        let name = if alone { name.to_owned() } else { with_component(name.to_owned(), column) };
        (name.clone(), name)
    };
    add(topic, &columns, named, owners.of(name), origin, document);
}
