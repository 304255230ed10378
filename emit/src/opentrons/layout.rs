//! Which nozzles of a head take tips.

use serde_json::{Value, json};

/// A layout of nozzles, as the run engine has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// All of them.
    All,
    /// One, in a corner.
    Single(String),
    /// A column, or a row, that begins in a corner.
    Column(String),
    Row(String),
    /// So many of a column, from its back one to its front one.
    Part {
        front: String,
        back: String,
    },
}

impl Layout {
    /// The layout that takes the tips in places with these labels, from a corner of the head; none where no layout does.
    pub(super) fn of(corner: &str, labels: &[&str], channels: usize) -> Option<Layout> {
        if corner == "all" || labels.len() == channels {
            return Some(Layout::All);
        }
        let row = |label: &str| label.chars().next();
        let corner = corner.to_owned();
        match labels {
            [_] => Some(Layout::Single(corner)),
            [first, second, ..] if row(first) == row(second) => {
                ["A1", "H1"].contains(&corner.as_str()).then_some(Layout::Row(corner))
            }
            many if many.len() == 8 => ["A1", "A12"].contains(&corner.as_str()).then_some(Layout::Column(corner)),
            many if many.len() < 8 && corner == "H1" => {
                let back = char::from(b'H' + 1 - many.len() as u8);
                Some(Layout::Part { front: corner, back: format!("{back}1") })
            }
            _ => None,
        }
    }

    /// The parameters of `configureNozzleLayout`.
    pub(super) fn params(&self) -> Value {
        match self {
            Layout::All => json!({ "style": "ALL" }),
            Layout::Single(corner) => json!({ "style": "SINGLE", "primaryNozzle": corner }),
            Layout::Column(corner) => json!({ "style": "COLUMN", "primaryNozzle": corner }),
            Layout::Row(corner) => json!({ "style": "ROW", "primaryNozzle": corner }),
            Layout::Part { front, back } => {
                json!({ "style": "QUADRANT", "primaryNozzle": front, "frontRightNozzle": front, "backLeftNozzle": back })
            }
        }
    }

    /// Whether commands name the place of the front channel instead of the back one.
    pub(super) fn names_front(&self) -> bool {
        matches!(self, Layout::Part { .. })
    }
}
