//! What is known at the statements of a file, shown to people and tools.

mod at;
mod human;
mod json;
mod things;
mod values;

use matterix_ir::Sources;
use matterix_ir::points::{Fact, Points, Value};

pub use at::{Found, Place};

use super::text::Texts;

/// A table of all statements with what each changes.
pub fn table(points: &Points, sources: &Sources) -> String {
    human::table(points, &mut Texts::new(sources))
}

/// Everything that is known after one statement, by its index.
pub fn all(points: &Points, index: usize, sources: &Sources) -> String {
    human::all(points, index, &mut Texts::new(sources))
}

/// What is known after one statement of the things that it changes or names.
pub fn brief(points: &Points, index: usize, sources: &Sources) -> String {
    human::brief(points, index, &mut Texts::new(sources))
}

/// Things with what is known of each in a few words: `plate[A1 .. H1].contents 100 uL`.
pub fn amounts(held: &[(&str, &Fact)]) -> String {
    let rows = held.iter().map(|(name, fact)| (name.to_string(), values::value(&fact.value))).collect();
    let said = things::together(rows);
    said.iter().map(|(names, value)| format!("{names} {value}")).collect::<Vec<_>>().join(", ")
}

/// A time since the beginning.
pub fn time(elapsed: &Value) -> String {
    values::time(elapsed)
}

/// One JSON object on a line: what each statement changes, or everything that is known after one.
pub fn json(points: &Points, only: Option<usize>, sources: &Sources) -> String {
    json::render(points, only, &mut Texts::new(sources))
}

/// The statement at a place.
pub fn find(points: &Points, place: Place, sources: &Sources) -> Found {
    at::find(points, place, &mut Texts::new(sources))
}
