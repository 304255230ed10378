//! Which statement is meant by a line and a column.

use std::str::FromStr;

use matterix_ir::points::{Point, Points};

use crate::report::text::{Text, Texts};

/// A place in a file, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    line: usize,
    column: Option<usize>,
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse::<usize>().ok().filter(|n| *n > 0);
        let place = match text.split_once(':') {
            None => number(text).map(|line| Place { line, column: None }),
            Some((line, column)) => {
                number(line).zip(number(column)).map(|(line, column)| Place { line, column: Some(column) })
            }
        };
        place.ok_or_else(|| "write LINE or LINE:COLUMN, counted from 1, as in 12 or 12:5".to_string())
    }
}

/// What was found at a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// This statement, by its index.
    Statement(usize),
    /// The file ends before.
    NoLine(usize),
    /// No statement stands there; these are the lines of the nearest ones, before and after.
    Nothing(Option<usize>, Option<usize>),
}

/// The last statement that stands on a line, or the innermost one at a column. Of a statement with a block the first and
/// the last line count: inside stand others.
pub(super) fn find(points: &Points, place: Place, texts: &mut Texts<'_>) -> Found {
    let root = matterix_ir::FileId(0);
    let Some(text) = texts.get(root) else { return Found::NoLine(0) };
    if place.line > text.lines() {
        return Found::NoLine(text.lines());
    }
    let own = points.points.iter().enumerate().filter(|(_, p)| p.span.file == root);
    let mut meant = own.clone().filter(|(_, p)| stands_at(p, place, text));
    // Later ones begin further on the line, or stand inside.
    if let Some((index, _)) = meant.next_back() {
        return Found::Statement(index);
    }
    let lines = own.map(|(_, p)| text.position(p.span.start as usize).0);
    let before = lines.clone().filter(|l| *l < place.line).max();
    Found::Nothing(before, lines.filter(|l| *l > place.line).min())
}

fn stands_at(point: &Point, place: Place, text: &Text) -> bool {
    let (first, from) = text.position(point.span.start as usize);
    let (last, to) = text.position(point.span.end.saturating_sub(1) as usize);
    let on_line = match point.block {
        true => place.line == first || place.line == last,
        false => (first..=last).contains(&place.line),
    };
    let in_columns = place.column.is_none_or(|c| (place.line > first || c >= from) && (place.line < last || c <= to));
    on_line && in_columns
}
