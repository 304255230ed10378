//! Several columns side by side: where any of them has a point.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use super::column::Column;
use super::series::Series;

/// A time at which some columns have points; two of one time where any of them jumps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    /// s.
    pub(super) time: f64,
    /// Columns and components that have a point, ascending, with their values; SI.
    pub(super) points: Vec<(usize, usize, f64)>,
}

impl Frame {
    /// A component of a column now, SI: its point, or what its line has.
    pub(super) fn value(&self, columns: &[&Column<'_>], column: usize, part: usize) -> f64 {
        match self.points.binary_search_by_key(&(column, part), |p| (p.0, p.1)) {
            Ok(found) => self.points[found].2,
            Err(_) => columns.get(column).map_or(f64::NAN, |c| c.at(part, self.time)),
        }
    }

    /// Whether a column has a point.
    pub(super) fn has(&self, column: usize) -> bool {
        let next = self.points.partition_point(|p| p.0 < column);
        self.points.get(next).is_some_and(|p| p.0 == column)
    }
}

/// A time at which a point has its turn: the time, and how many of its component came before it at that time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    time: f64,
    turn: usize,
}

impl Eq for Turn {}

impl Ord for Turn {
    fn cmp(&self, other: &Self) -> Ordering {
        self.time.total_cmp(&other.time).then(self.turn.cmp(&other.turn))
    }
}

impl PartialOrd for Turn {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// One component of a column, from point to point.
struct Source<I> {
    column: usize,
    part: usize,
    rest: I,
    /// The value of the point whose turn is in the queue.
    value: f64,
    last: Option<Turn>,
}

impl<I: Iterator<Item = (f64, f64)>> Source<I> {
    /// Goes on to the next point; its turn.
    fn next(&mut self) -> Option<Turn> {
        let (time, value) = self.rest.next()?;
        let turn = self.last.filter(|last| last.time == time).map_or(0, |last| last.turn + 1);
        self.value = value;
        self.last = Some(Turn { time, turn });
        self.last
    }
}

/// All frames of some columns, in order of time.
pub(super) fn frames<'a>(columns: &'a [&'a Column<'a>]) -> impl Iterator<Item = Frame> + 'a {
    let parts = columns.iter().enumerate().flat_map(|(column, c)| {
        let source = move |(part, series): (usize, &&'a Series)| Source {
            column,
            part,
            rest: series.points(),
            value: f64::NAN,
            last: None,
        };
        c.parts.iter().enumerate().map(source)
    });
    let mut sources: Vec<_> = parts.collect();
    let mut queue = BinaryHeap::new();
    for (index, source) in sources.iter_mut().enumerate() {
        queue.extend(source.next().map(|turn| Reverse((turn, index))));
    }
    std::iter::from_fn(move || {
        let &Reverse((now, _)) = queue.peek()?;
        let mut frame = Frame { time: now.time, points: Vec::new() };
        while let Some(&Reverse((turn, index))) = queue.peek() {
            if turn != now {
                break;
            }
            queue.pop();
            let Some(source) = sources.get_mut(index) else { continue };
            frame.points.push((source.column, source.part, source.value));
            queue.extend(source.next().map(|turn| Reverse((turn, index))));
        }
        Some(frame)
    })
}
