//! Rows of bars: colours, truth values, places, processes, steps.

use matterix_ir::quantity::show_number;
use plotters::style::RGBColor;

use super::canvas::PALETTE;
use super::draw::{Bar, Block, Row};
use crate::exec::StepState;
use crate::record::column::{Column, Shown};
use crate::record::history::{self, is_structure};
use crate::record::run::Run;
use crate::record::series::Series;

/// Rows of a block at most.
const MOST: usize = 24;

/// A block of rows; none where there are no rows.
fn block(title: &str, mut rows: Vec<Row>) -> Option<Block> {
    let left_out = rows.len().saturating_sub(MOST);
    rows.truncate(MOST);
    (!rows.is_empty()).then(|| Block::Rows { title: title.to_owned(), rows, left_out })
}

/// Columns that are colours and change.
pub(super) fn colours(run: &Run<'_>, columns: &[Column<'_>]) -> Option<Block> {
    let row = |column: &Column<'_>| {
        let bars = stretches(run, column.shades(255.0).into_iter(), |time| {
            let [r, g, b] = column.colour(time).unwrap_or_default().map(|v| (v * 255.0).round() as u8);
            Some((RGBColor(r, g, b), String::new()))
        });
        Row { label: column.name.to_owned(), bars }
    };
    let rows = columns.iter().filter(|c| c.is_colour()).map(row).filter(|row| row.bars.len() > 1);
    block("colour", rows.collect())
}

/// Truth values and places that change.
pub(super) fn discrete(run: &Run<'_>, columns: &[Column<'_>]) -> Option<Block> {
    let changes = |c: &&Column<'_>| {
        let first = |s: &Series| s.first().map(|p| p.1);
        c.parts.first().is_some_and(|s| s.values().any(|v| Some(v) != first(s)))
    };
    let row = |column: &Column<'_>, series: &Series| {
        let times = series.points().map(|p| p.0);
        let bars = match column.shown {
            Shown::Bool => {
                let bar = |(start, end)| plain(start, end, PALETTE[0]);
                history::true_intervals(run.recording, series).into_iter().map(bar).collect()
            }
            Shown::Instance => stretches(run, times, |time| {
                let value = Some(series.held(time)).filter(|v| *v >= 0.0)?;
                Some((PALETTE[(value as usize + 3) % PALETTE.len()], run.instance_name(value).to_owned()))
            }),
            Shown::Enum(words) => stretches(run, times, |time| {
                let value = series.held(time) as usize;
                Some((PALETTE[(value + 1) % PALETTE.len()], words.get(value)?.clone()))
            }),
            Shown::Quantity(_) => Vec::new(),
        };
        Row { label: column.name.to_owned(), bars }
    };
    let shown = columns.iter().filter(|c| !matches!(c.shown, Shown::Quantity(_))).filter(changes);
    block("state", shown.filter_map(|c| Some(row(c, c.parts.first()?))).collect())
}

/// Processes that began or ended within the run.
pub(super) fn processes(run: &Run<'_>) -> Option<Block> {
    let end = run.recording.end;
    let all = history::process_intervals(run);
    let partly = |list: &Vec<(f64, f64)>| !list.is_empty() && *list != [(0.0, end)];
    let rows =
        run.program.model.processes.iter().zip(all).filter(|(_, list)| partly(list)).map(|(process, list)| Row {
            label: process.name.clone(),
            bars: list.into_iter().map(|(start, end)| plain(start, end, PALETTE[4])).collect(),
        });
    block("processes", rows.collect())
}

/// Steps that began, one row a node.
pub(super) fn steps(run: &Run<'_>) -> Option<Block> {
    let plan = &run.program.plan;
    let paths = history::paths(plan);
    let mut order: Vec<usize> = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    for execution in history::step_runs(run) {
        let i = execution.step.0 as usize;
        let Some((step, start)) = plan.steps.get(i).zip(execution.start) else { continue };
        if is_structure(&step.step) {
            continue;
        }
        let color = match execution.state {
            StepState::Failed => PALETTE[1],
            StepState::Done => PALETTE[2],
            _ => PALETTE[5],
        };
        let end = execution.end.unwrap_or(run.recording.end);
        let bar = Bar { start, end, color, text: span(start, end), beside: true };
        match order.iter().position(|&known| known == i) {
            Some(row) => {
                // The times of each turn of a loop would cover one another.
                rows[row].bars.iter_mut().for_each(|b| b.text.clear());
                rows[row].bars.push(Bar { text: String::new(), ..bar });
            }
            None => {
                let depth = paths.get(i).map_or(0, |p| p.1);
                order.push(i);
                rows.push(Row { label: format!("{}{}", "· ".repeat(depth.min(6)), step.label), bars: vec![bar] });
            }
        }
    }
    block("steps", rows)
}

/// A bar without text.
fn plain(start: f64, end: f64, color: RGBColor) -> Bar {
    Bar { start, end, color, text: String::new(), beside: false }
}

/// The time a step took place, or began and ended, s.
fn span(start: f64, end: f64) -> String {
    let [a, b] = [start, end].map(|t| show_number((t * 100.0).round() / 100.0));
    if a == b { format!("{a} s") } else { format!("{a} – {b} s") }
}

/// Neighbouring times at which something looks alike as one bar; what looks like nothing leaves a gap.
fn stretches(
    run: &Run<'_>,
    times: impl Iterator<Item = f64>,
    look: impl Fn(f64) -> Option<(RGBColor, String)>,
) -> Vec<Bar> {
    let mut bars: Vec<Bar> = Vec::new();
    let mut current: Option<(RGBColor, String)> = None;
    for (index, time) in times.enumerate() {
        let next = look(time);
        if next == current && index > 0 {
            continue;
        }
        if let (Some(bar), Some(_)) = (bars.last_mut(), &current) {
            bar.end = time;
        }
        if let Some((color, text)) = next.clone() {
            bars.push(Bar { start: time, end: run.recording.end, color, text, beside: false });
        }
        current = next;
    }
    bars
}
