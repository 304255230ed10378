//! States and observables as named columns in the unit they are shown in.

use matterix_ir::Unit;
use matterix_ir::model::{Content, Domain};

use super::run::Run;
use super::series::Series;

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

/// A state or an observable over time.
#[derive(Clone, Debug)]
pub(super) struct Column<'a> {
    /// Full name.
    pub(super) name: &'a str,
    /// How it is shown.
    pub(super) shown: Shown<'a>,
    /// By component; SI.
    pub(super) parts: Vec<&'a Series>,
    /// Whether it leaves the range of its model at some time.
    pub(super) outside: bool,
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
        Some(Column { name: &state.name, shown, parts: vec![run.recording.states.get(index)?], outside: false })
    }

    /// The observable with this index.
    pub(super) fn observable(run: &Run<'a>, index: usize) -> Option<Column<'a>> {
        let observable = run.program.model.observables.get(index)?;
        let parts = run.recording.observables.get(index)?.iter().collect();
        let outside = run.validity(observable).is_some_and(|valid| valid.values().any(|holds| holds != 1.0));
        Some(Column { name: &observable.name, shown: Shown::Quantity(&observable.unit), parts, outside })
    }

    /// How much of a species there is: at equilibrium where that settles it.
    pub(super) fn content(run: &Run<'a>, content: &Content) -> Option<Column<'a>> {
        match content.settled {
            Some(index) => Column::observable(run, index as usize),
            None => Column::state(run, content.state as usize),
        }
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

    /// Whether it goes from value to value, without any in between.
    pub(super) fn is_stepped(&self) -> bool {
        !matches!(self.shown, Shown::Quantity(_))
    }

    /// One component at a time, after what jumps then; SI.
    pub(super) fn at(&self, part: usize, time: f64) -> f64 {
        let Some(series) = self.parts.get(part) else { return f64::NAN };
        if self.is_stepped() { series.held(time) } else { series.at(time) }
    }

    /// A value, SI, as it is written.
    pub(super) fn cell(&self, run: &Run<'a>, value: f64) -> Cell<'a> {
        match self.shown {
            Shown::Quantity(unit) => Cell::Number(unit.of_si(value)),
            Shown::Bool => Cell::Bool(value != 0.0),
            Shown::Instance => Cell::Name(run.instance_name(value)),
            Shown::Enum(words) => Cell::Name(words.get(value as usize).map_or("", String::as_str)),
        }
    }

    /// Its name, that of a component with its number from 1.
    pub(super) fn part_name(&self, part: usize) -> String {
        if self.parts.len() > 1 { format!("{}.{}", self.name, part + 1) } else { self.name.to_owned() }
    }

    /// Whether this can be a colour: three components between 0 and 1.
    pub(super) fn is_colour(&self) -> bool {
        let within = |v: f64| (-1e-6..=1.0 + 1e-6).contains(&v);
        self.parts.len() == 3 && self.symbol().is_empty() && self.parts.iter().all(|p| p.values().all(within))
    }

    /// The red, green and blue of a colour at a time, 0 to 1; none where nothing was recorded.
    pub(super) fn colour(&self, time: f64) -> Option<[f64; 3]> {
        let rgb = [0, 1, 2].map(|part| self.at(part, time).clamp(0.0, 1.0));
        rgb.iter().all(|v| !v.is_nan()).then_some(rgb)
    }

    /// Times at which a colour is looked at so that no shade of so many is passed over, in order.
    pub(super) fn shades(&self, count: f64) -> Vec<f64> {
        let mut times: Vec<f64> = self.parts.iter().flat_map(|p| p.points().map(|p| p.0)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let between = |pair: &[f64]| {
            let (from, to) = (self.colour(pair[0]).unwrap_or_default(), self.colour(pair[1]).unwrap_or_default());
            let most = from.iter().zip(to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
            let (start, pieces) = (pair[0], (most * count).ceil().max(1.0));
            let step = (pair[1] - pair[0]) / pieces;
            (0..pieces as usize).map(move |i| start + step * i as f64)
        };
        let last = times.last().copied();
        times.windows(2).flat_map(between).chain(last).collect()
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
