//! Which quantities of a run are drawn, and in which panel.

use std::collections::BTreeSet;

use matterix_ir::model::{Mixture, Model};
use matterix_ir::{Op, Unit};

use super::canvas::PALETTE;
use super::draw::{Block, Panel};
use super::series::Series;
use super::strips;
use crate::record::column::{Column, Shown, repeats};
use crate::record::history::{self, is_structure};
use crate::record::run::Run;
use crate::record::table::record_units;
use crate::record::taken::RecordedValue;

/// Mixtures with a panel at most.
const MIXTURES: usize = 12;

/// Boundaries drawn at most; more would hide the curves.
const BOUNDARIES: usize = 40;

/// All blocks of the page: temperatures, contents, other quantities, records, strips, steps.
pub(super) fn blocks(run: &Run<'_>) -> Vec<Block> {
    let columns = Column::all(run);
    let (temperatures, others): (Vec<Panel>, Vec<Panel>) = by_unit(run)
        .into_iter()
        .map(|(unit, panel)| (is_temperature(&unit), panel))
        .fold((Vec::new(), Vec::new()), |(mut warm, mut rest), (is_warm, panel)| {
            if is_warm {
                warm.push(panel)
            } else {
                rest.push(panel)
            }
            (warm, rest)
        });
    let contents = all_contents(run);
    let panels = temperatures.into_iter().chain(contents).chain(others).chain(records(run)).map(Block::Panel);
    let strips =
        [strips::colours(run, &columns), strips::discrete(run, &columns), strips::processes(run), strips::steps(run)];
    panels.chain(strips.into_iter().flatten()).collect()
}

/// Panels of the first mixtures whose contents change; of a plate with many wells the rest is only named.
fn all_contents(run: &Run<'_>) -> Vec<Panel> {
    let mut panels: Vec<Panel> = Vec::new();
    let (mut drawn, mut rest) = (0, Vec::new());
    for mixture in &run.program.model.mixtures {
        if drawn == MIXTURES {
            rest.push(name_of(run, mixture).to_owned());
            continue;
        }
        let found = contents(run, mixture);
        drawn += usize::from(!found.is_empty());
        panels.extend(found);
    }
    if let Some(last) = panels.last_mut() {
        last.left_out.extend(rest);
    }
    panels
}

fn name_of<'r>(run: &Run<'r>, mixture: &Mixture) -> &'r str {
    run.program.scene.instances.get(mixture.instance.0 as usize).map_or("", |i| &i.name)
}

/// Times at which steps began or ended and events fired, s; only steps, or none, where there are too many.
pub(super) fn boundaries(run: &Run<'_>) -> Vec<f64> {
    let steps = &run.program.plan.steps;
    let shown = |r: &history::StepRun| {
        r.start.is_some() && steps.get(r.step.0 as usize).is_some_and(|s| !is_structure(&s.step))
    };
    let runs = history::step_runs(run).into_iter().filter(shown);
    let of_steps = distinct(run, runs.flat_map(|r| [r.start, r.end]).flatten().collect());
    let events = run.recording.events.iter().map(|e| e.time);
    let all = distinct(run, of_steps.iter().copied().chain(events).collect());
    [all, of_steps].into_iter().find(|list| list.len() <= BOUNDARIES).unwrap_or_default()
}

/// In order, without those too near to their neighbour to be told apart.
fn distinct(run: &Run<'_>, mut times: Vec<f64>) -> Vec<f64> {
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| *a - *b < run.recording.end / 800.0);
    times
}

/// Units of temperature are those with a zero of their own, and the kelvin.
fn is_temperature(unit: &Unit) -> bool {
    unit.offset != 0.0 || unit.symbol == "K"
}

/// A series of one component of a column in its unit.
fn series(name: String, column: &Column<'_>, part: usize, stepped: bool) -> Option<Series> {
    let Shown::Quantity(unit) = column.shown else { return None };
    let points = column.parts.get(part)?.points().map(|(t, v)| (t, unit.of_si(v))).collect();
    Some(Series { name, points, stepped }.thinned())
}

/// The lines that vary most, in the order given; the names of the rest.
fn panel(title: String, symbol: &str, mut series: Vec<Series>) -> Option<Panel> {
    series.retain(Series::changes);
    let widest = series.iter().filter_map(Series::range).map(|(a, b)| b - a).fold(0.0, f64::max);
    let visible = |s: &Series| s.range().is_some_and(|(a, b)| b - a > 1e-6 * widest);
    series.retain(visible);
    let mut spans: Vec<f64> = series.iter().filter_map(Series::range).map(|(a, b)| b - a).collect();
    spans.sort_by(|a, b| b.total_cmp(a));
    let least = spans.get(PALETTE.len() - 1).copied().unwrap_or(0.0);
    let (mut kept, mut left_out) = (Vec::new(), Vec::new());
    for line in series {
        let wide = line.range().is_some_and(|(a, b)| b - a >= least);
        if wide && kept.len() < PALETTE.len() { kept.push(line) } else { left_out.push(line.name) }
    }
    (!kept.is_empty()).then(|| Panel { title, symbol: symbol.to_owned(), series: kept, left_out })
}

/// One panel a unit for all quantities that are not contents, ledgers or colours.
fn by_unit(run: &Run<'_>) -> Vec<(Unit, Panel)> {
    let model = &run.program.model;
    let hidden = hidden_states(model);
    let flowing: BTreeSet<u32> = model.derivatives.iter().map(|d| d.state).collect();
    let concentrations: BTreeSet<u32> = model.mixtures.iter().flat_map(|m| m.concentrations.iter().copied()).collect();
    let states = (0..model.states.len()).filter(|&i| !hidden.contains(&(i as u32)));
    let states = states.filter_map(|i| Some((Column::state(run, i)?, !flowing.contains(&(i as u32)))));
    let conditions: BTreeSet<u32> = model.observables.iter().filter_map(|o| o.valid).collect();
    let is_left = |i: &usize| !concentrations.contains(&(*i as u32)) && !conditions.contains(&(*i as u32));
    let others = (0..model.observables.len()).filter(|i| is_left(i) && !repeats(run, *i));
    let others = others.filter_map(|i| Some((Column::observable(run, i)?, false)));

    let mut groups: Vec<(Unit, Vec<(Column<'_>, bool)>)> = Vec::new();
    for (column, stepped) in states.chain(others) {
        let Shown::Quantity(unit) = column.shown else { continue };
        // A stepped plain number is a counter.
        if column.is_colour() || (stepped && column.symbol().is_empty()) {
            continue;
        }
        // Plain numbers have nothing in common but the lack of a unit, so each kind has a panel of its own.
        let alike = |c: &Column<'_>| {
            c.symbol() == column.symbol() && (!c.symbol().is_empty() || kind(c.name) == kind(column.name))
        };
        match groups.iter_mut().find(|(_, list)| list.iter().any(|(c, _)| alike(c))) {
            Some((_, list)) => list.push((column, stepped)),
            None => groups.push((unit.clone(), vec![(column, stepped)])),
        }
    }
    groups.into_iter().filter_map(|(unit, list)| unit_panel(&unit, list).map(|p| (unit, p))).collect()
}

fn unit_panel(unit: &Unit, columns: Vec<(Column<'_>, bool)>) -> Option<Panel> {
    let mut lines = Vec::new();
    for (column, stepped) in &columns {
        for part in 0..column.parts.len() {
            lines.extend(series(column.part_name(part), column, part, *stepped));
        }
    }
    let mut panel = panel(String::new(), &unit.symbol, lines)?;
    let is_outside = |name: &str| columns.iter().any(|(c, _)| c.outside && c.part_name(0) == name);
    let outside: Vec<bool> = panel.series.iter().map(|line| is_outside(&line.name)).collect();
    let mut kinds: Vec<String> = Vec::new();
    for line in &panel.series {
        let kind = kind(&line.name).to_owned();
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    // Where all are of one kind the title says it and the legend need not.
    if let [only] = kinds.as_slice() {
        for line in &mut panel.series {
            if let Some(owner) = line.name.strip_suffix(&format!(".{only}")) {
                line.name = owner.to_owned();
            }
        }
    }
    kinds.truncate(4);
    panel.title = kinds.join(", ");
    let outside: Vec<&str> =
        panel.series.iter().zip(outside).filter(|(_, outside)| *outside).map(|(line, _)| line.name.as_str()).collect();
    if !outside.is_empty() {
        panel.title += &format!("; at times outside the model: {}", outside.join(", "));
    }
    Some(panel)
}

/// The last word of a name: `temperature` of `beaker.contents.temperature`.
fn kind(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// States shown otherwise or of no interest: contents, the rest of what a transfer moves, counters of the ledger.
fn hidden_states(model: &Model) -> BTreeSet<u32> {
    let mixtures = model.mixtures.iter();
    let moved = mixtures.flat_map(|m| m.extensive.iter().map(|e| e.1).chain(m.contents.iter().map(|c| c.state)));
    let counted = model.balances.iter().flat_map(|b| b.exchanges.iter().copied());
    // The terms of a ledger's sum (heat contents): what follows from them (temperatures) is shown instead.
    let terms =
        model.balances.iter().flat_map(|b| model.graph.schedule([b.total])).filter_map(|n| match model.graph.op(n) {
            Op::State(state) => Some(state),
            _ => None,
        });
    moved.chain(counted).chain(terms).collect()
}

/// Concentrations of a mixture, or amounts where the library gives no concentration; one panel a unit.
fn contents(run: &Run<'_>, mixture: &Mixture) -> Vec<Panel> {
    let model = &run.program.model;
    let name = name_of(run, mixture);
    let given = mixture.concentrations.iter().map(|&i| Column::observable(run, i as usize));
    let columns: Vec<Option<Column<'_>>> = if mixture.concentrations.is_empty() {
        mixture.contents.iter().map(|content| Column::content(run, content)).collect()
    } else {
        given.collect()
    };
    let species = mixture.contents.iter().map(|c| Some((model.species.get(c.species as usize)?, model.is_solid(c))));
    let mut groups: Vec<(&str, Vec<Series>)> = Vec::new();
    for (species, column) in species.zip(columns) {
        let Some(((species, solid), column)) = species.zip(column) else { continue };
        let name = if solid { format!("{} (solid)", species.name) } else { species.name.clone() };
        let Some(line) = series(name, &column, 0, false) else { continue };
        match groups.iter_mut().find(|(symbol, _)| *symbol == column.symbol()) {
            Some((_, list)) => list.push(line),
            None => groups.push((column.symbol(), vec![line])),
        }
    }
    let mut panels = Vec::new();
    for (symbol, list) in groups {
        let (solutes, solvents) = apart(list);
        panels.extend([solutes, solvents].into_iter().filter_map(|list| panel(name.to_owned(), symbol, list)));
    }
    panels
}

/// Lines that tower over the rest (the solvent) stand apart, so that the rest is seen.
fn apart(list: Vec<Series>) -> (Vec<Series>, Vec<Series>) {
    let flat = |s: &Series| s.range().is_some_and(|(a, b)| a.abs().max(b.abs()) > TOWERING * (b - a));
    list.into_iter().partition(|s| !flat(s))
}

/// How many times its own change a line may be high before it would flatten the others.
const TOWERING: f64 = 20.0;

/// What `record` statements took, one panel a unit.
fn records(run: &Run<'_>) -> Vec<Panel> {
    let mut groups: Vec<(&str, Vec<Series>)> = Vec::new();
    let records = run.recording.values.by_name();
    for (name, unit) in record_units(run) {
        let Some(taken) = records.get(name) else { continue };
        for part in 0..taken.iter().map(|v| v.values.len()).max().unwrap_or(0) {
            let point = |v: RecordedValue<'_>| Some((v.time, unit.of_si(*v.values.get(part)?)));
            let label = if part > 0 { format!("{name}.{}", part + 1) } else { name.to_owned() };
            let line =
                Series { name: label, points: taken.iter().filter_map(point).collect(), stepped: false }.thinned();
            match groups.iter_mut().find(|(symbol, _)| *symbol == unit.symbol) {
                Some((_, list)) => list.push(line),
                None => groups.push((&unit.symbol, vec![line])),
            }
        }
    }
    groups.into_iter().filter_map(|(symbol, list)| panel("recorded".to_owned(), symbol, list)).collect()
}
