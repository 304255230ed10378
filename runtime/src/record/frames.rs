//! Several columns side by side: where any of them has a point.

use super::column::Column;

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

/// A point with the place where it is sorted: its time, and how many of its component came before it at that time.
struct Placed {
    time: f64,
    turn: usize,
    column: usize,
    part: usize,
    value: f64,
}

/// All frames of some columns, in order of time.
pub(super) fn frames(columns: &[&Column<'_>]) -> Vec<Frame> {
    let mut placed: Vec<Placed> = Vec::new();
    for (index, column) in columns.iter().enumerate() {
        for (part, series) in column.parts.iter().enumerate() {
            let (mut last, mut turn) = (f64::NAN, 0);
            for (time, value) in series.points() {
                turn = if time == last { turn + 1 } else { 0 };
                last = time;
                placed.push(Placed { time, turn, column: index, part, value });
            }
        }
    }
    placed.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.turn.cmp(&b.turn)));
    let alike = |a: &Placed, b: &Placed| a.time.to_bits() == b.time.to_bits() && a.turn == b.turn;
    let frame = |of: &[Placed]| Frame {
        time: of.first().map_or(0.0, |p| p.time),
        points: of.iter().map(|p| (p.column, p.part, p.value)).collect(),
    };
    placed.chunk_by(alike).map(frame).collect()
}
