//! States and observables as named columns in the unit they are shown in.

use matterix_ir::Unit;
use matterix_ir::model::Domain;

use super::run::Run;

/// How the numbers of a column are shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shown<'a> {
    /// In this unit.
    Quantity(&'a Unit),
    /// True or false.
    Bool,
    /// The name of an instance, or `nothing`.
    Instance,
    /// One of these words.
    Enum(&'a [String]),
}

/// One value, ready to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell<'a> {
    /// In the column's unit.
    Number(f64),
    /// A truth value.
    Bool(bool),
    /// The name of an instance, or a word.
    Name(&'a str),
}

/// A state or an observable over all samples.
#[derive(Clone, Debug)]
pub(super) struct Column<'a> {
    /// Full name.
    pub(super) name: &'a str,
    /// How it is shown.
    pub(super) shown: Shown<'a>,
    /// By component, then by sample; SI.
    pub(super) parts: Vec<&'a [f64]>,
}

impl<'a> Column<'a> {
    /// The state with this index.
    pub(super) fn state(run: &Run<'a>, index: usize) -> Option<Column<'a>> {
        let state = run.program.model.states.get(index)?;
        let shown = match &state.domain {
            Domain::Quantity(unit) => Shown::Quantity(unit),
            Domain::Bool => Shown::Bool,
            Domain::Instance => Shown::Instance,
            Domain::Enum(words) => Shown::Enum(words),
        };
        Some(Column { name: &state.name, shown, parts: vec![run.recording.states.get(index)?.as_slice()] })
    }

    /// The observable with this index.
    pub(super) fn observable(run: &Run<'a>, index: usize) -> Option<Column<'a>> {
        let observable = run.program.model.observables.get(index)?;
        let parts = run.recording.observables.get(index)?.iter().map(Vec::as_slice).collect();
        Some(Column { name: &observable.name, shown: Shown::Quantity(&observable.unit), parts })
    }

    /// All states, then the observables that do not repeat a state's name.
    pub(super) fn all(run: &Run<'a>) -> Vec<Column<'a>> {
        let model = &run.program.model;
        let states = (0..model.states.len()).filter_map(|i| Column::state(run, i));
        states
            .chain(
                (0..model.observables.len()).filter(|&i| !repeats(run, i)).filter_map(|i| Column::observable(run, i)),
            )
            .collect()
    }

    /// The unit's symbol; empty for plain numbers, truth values and names.
    pub(super) fn symbol(&self) -> &'a str {
        match self.shown {
            Shown::Quantity(unit) => &unit.symbol,
            Shown::Bool | Shown::Instance | Shown::Enum(_) => "",
        }
    }

    /// One component of one sample; not a number where there is none.
    pub(super) fn cell(&self, run: &Run<'a>, part: usize, sample: usize) -> Cell<'a> {
        let value = self.parts.get(part).and_then(|p| p.get(sample)).copied().unwrap_or(f64::NAN);
        match self.shown {
            Shown::Quantity(unit) => Cell::Number(unit.of_si(value)),
            Shown::Bool => Cell::Bool(value != 0.0),
            Shown::Instance => Cell::Name(run.instance_name(value)),
            Shown::Enum(words) => Cell::Name(words.get(value as usize).map_or("", String::as_str)),
        }
    }

    /// Whether two samples are equal to the last bit.
    pub(super) fn same(&self, a: usize, b: usize) -> bool {
        self.parts.iter().all(|p| p.get(a).map(|v| v.to_bits()) == p.get(b).map(|v| v.to_bits()))
    }

    /// Whether this can be a colour: three components between 0 and 1.
    pub(super) fn is_colour(&self) -> bool {
        let within = |v: &f64| (-1e-6..=1.0 + 1e-6).contains(v);
        self.parts.len() == 3 && self.symbol().is_empty() && self.parts.iter().all(|p| p.iter().all(within))
    }

    /// The red, green and blue of one sample of a colour, 0 to 1.
    pub(super) fn colour(&self, sample: usize) -> Option<[f64; 3]> {
        let at = |i: usize| self.parts.get(i).and_then(|p| p.get(sample)).map(|v| v.clamp(0.0, 1.0));
        Some([at(0)?, at(1)?, at(2)?])
    }
}

/// Whether the observable has the name of a state.
pub(super) fn repeats(run: &Run<'_>, observable: usize) -> bool {
    let model = &run.program.model;
    model.observables.get(observable).is_some_and(|o| model.states.iter().any(|s| s.name == o.name))
}

/// The shortest text that reads back as the same number; empty if it is none.
pub(crate) fn exact(value: f64) -> String {
    if value.is_nan() {
        return String::new();
    }
    let mut text = format!("{value:?}");
    if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}
