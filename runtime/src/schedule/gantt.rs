//! A schedule as a chart: one row an instance, one colour or letter a line of steps.

use std::collections::BTreeSet;
use std::fmt::Write;

use matterix_ir::quantity::show_number;

use super::Schedule;
use crate::record::plot::PlotError;
use crate::record::plot::axis::{TimeAxis, ticks};
use crate::record::plot::canvas::{self, Anchor, Canvas, INK, Ink, MUTED, PALETTE, PAPER};

/// One bar of a row.
struct Bar<'s> {
    start: f64,
    end: f64,
    line: usize,
    label: &'s str,
    /// Whether it has the instance to itself.
    claimed: bool,
}

/// Instances in the order in which they are first used, with what uses them.
fn rows(schedule: &Schedule) -> Vec<(&str, Vec<Bar<'_>>)> {
    let mut rows: Vec<(&str, Vec<Bar<'_>>)> = Vec::new();
    let blocks = schedule.blocks.iter().map(|b| (&b.instances, b.start, b.end, b.line, b.label.as_str(), true));
    let actions = schedule.actions.iter().map(|a| (&a.instances, a.start, a.end, a.line, a.label.as_str(), false));
    let mut all: Vec<_> = blocks.chain(actions).collect();
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    for (instances, start, end, line, label, claimed) in all {
        for instance in instances {
            let bar = Bar { start, end, line, label, claimed };
            match rows.iter_mut().find(|r| r.0 == instance) {
                Some(row) => row.1.push(bar),
                None => rows.push((instance, vec![bar])),
            }
        }
    }
    // What nobody claims is not what others wait for.
    if rows.iter().any(|r| r.1.iter().any(|b| b.claimed)) {
        rows.retain(|r| r.1.iter().any(|b| b.claimed));
    }
    rows.sort_by(|a, b| natural(a.0).cmp(&natural(b.0)));
    rows
}

/// Names with their numbers as numbers: `m2` before `m10`.
fn natural(name: &str) -> (String, u64, &str) {
    let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
    (letters.to_owned(), name[letters.len()..].parse().unwrap_or(0), name)
}

/// Lines that use something, in order.
fn lines(schedule: &Schedule) -> Vec<usize> {
    let blocks = schedule.blocks.iter().map(|b| b.line);
    blocks.chain(schedule.actions.iter().map(|a| a.line)).collect::<BTreeSet<_>>().into_iter().collect()
}

/// What is known of the schedule, in one sentence each.
fn facts(schedule: &Schedule) -> Vec<String> {
    let s = |t: f64| format!("{} s", show_number((t * 1000.0).round() / 1000.0));
    let mut facts = vec![s(schedule.makespan)];
    facts.push(if schedule.optimal {
        "the shortest possible".to_owned()
    } else {
        format!("not proven to be the shortest; the lower bound is {}", s(schedule.bound))
    });
    let list = schedule.list.filter(|list| *list > schedule.makespan);
    facts.extend(list.map(|list| format!("list schedule {}", s(list))));
    if schedule.trial {
        facts.push("durations that depend on the model come from a trial run".to_owned());
    }
    facts
}

/// The chart for a terminal of so many columns.
pub fn chart(schedule: &Schedule, width: usize) -> String {
    let rows = rows(schedule);
    let lines = lines(schedule);
    let letter = |line: usize| {
        let index = lines.iter().position(|l| *l == line).unwrap_or(0);
        char::from(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"[index % 52])
    };
    let mut out = format!("{}: {}\n", schedule.workflow, facts(schedule).join(", "));
    if rows.is_empty() {
        out.push_str("no instance is used\n");
        return out;
    }
    let names = rows.iter().map(|r| r.0.chars().count()).max().unwrap_or(0).min(24);
    let cells = width.saturating_sub(names + 2).max(20);
    let end = schedule.makespan.max(f64::MIN_POSITIVE);
    let cell = |time: f64| ((time / end * cells as f64).round() as usize).min(cells);
    out.push('\n');
    let (labels, marks) = scale(end, cells, cell);
    let _ = writeln!(out, "{:names$}  {}\n{:names$}  {}", "", labels.trim_end(), "", marks);
    for (name, bars) in &rows {
        let mut row = vec![' '; cells];
        for bar in bars {
            let (from, to) = (cell(bar.start), cell(bar.end).max(cell(bar.start) + 1).min(cells));
            let fill = if bar.claimed { '━' } else { '─' };
            (from..to).for_each(|i| row[i] = fill);
            if let Some(first) = row.get_mut(from.min(cells - 1)) {
                *first = letter(bar.line);
            }
        }
        let row: String = row.into_iter().collect();
        let _ = writeln!(out, "{:names$}  {}", canvas::shorten(name, names), row.trim_end());
    }
    out.push('\n');
    for line in &lines {
        let _ = writeln!(out, "{}  {}", letter(*line), schedule.lines.get(*line).map_or("", String::as_str));
    }
    out
}

/// The numbers and the rule of a time axis.
fn scale(end: f64, cells: usize, cell: impl Fn(f64) -> usize) -> (String, String) {
    let (symbol, factor) = match end {
        e if e <= 3600.0 => ("s", 1.0),
        e if e <= 4.0 * 3600.0 => ("min", 60.0),
        e if e <= 7.0 * 86400.0 => ("h", 3600.0),
        _ => ("d", 86400.0),
    };
    let marks = ticks(0.0, end / factor, (cells / 12).max(2));
    let mut labels = vec![' '; cells + 12];
    let mut rule = vec!['─'; cells];
    for tick in &marks.at {
        let at = cell(tick * factor);
        let text = if *tick == 0.0 { format!("0 {symbol}") } else { marks.label(*tick) };
        if labels[at..].iter().take(text.len()).all(|c| *c == ' ') && at + text.len() <= cells {
            text.chars().enumerate().for_each(|(i, c)| labels[at + i] = c);
        }
        if let Some(slot) = rule.get_mut(at) {
            *slot = '┬';
        }
    }
    (labels.into_iter().collect(), rule.into_iter().collect())
}

/// Width of the picture, px.
const WIDTH: f64 = 1200.0;
/// Right edge of the rows, px.
const RIGHT: f64 = 1170.0;
/// Height of the title, px.
const TOP: f64 = 76.0;
/// Height of a row, px.
const ROW: f64 = 34.0;
/// Height of the time axis, px.
const AXIS: f64 = 50.0;
/// Height of a row of the legend, px.
const LEGEND: f64 = 22.0;

/// The chart as an SVG document.
pub fn picture(schedule: &Schedule) -> Result<String, PlotError> {
    let rows = rows(schedule);
    let lines = lines(schedule);
    let names = rows.iter().map(|r| r.0.chars().count()).max().unwrap_or(0).clamp(6, 26);
    let left = 24.0 + names as f64 * 6.6;
    let bottom = TOP + rows.len() as f64 * ROW;
    let columns = ((RIGHT - left) / 190.0).floor().max(1.0) as usize;
    let height = bottom + AXIS + lines.len().div_ceil(columns) as f64 * LEGEND + 12.0;
    let color = |line: usize| PALETTE[lines.iter().position(|l| *l == line).unwrap_or(0) % PALETTE.len()];
    canvas::page(WIDTH, height, |canvas| {
        canvas.heading((24.0, 26.0), 20.0, &schedule.workflow)?;
        let mut text = facts(schedule);
        text.extend(schedule.arguments.iter().map(|(name, value)| format!("{name} = {value}")));
        canvas.text((24.0, 52.0), 12.0, Anchor::Start, MUTED, &canvas::shorten(&text.join("   ·   "), 170))?;
        let axis = TimeAxis::new(schedule.makespan, left, RIGHT);
        axis.draw(canvas, TOP, bottom, &[])?;
        for (index, (name, bars)) in rows.iter().enumerate() {
            let middle = TOP + (index as f64 + 0.5) * ROW;
            canvas.text((left - 10.0, middle), 12.0, Anchor::End, INK, &canvas::shorten(name, names))?;
            for bar in bars {
                draw(canvas, &axis, bar, middle, color(bar.line))?;
            }
        }
        for (index, line) in lines.iter().enumerate() {
            let x = left + (index % columns) as f64 * 190.0;
            let y = bottom + AXIS + (index / columns) as f64 * LEGEND + 8.0;
            canvas.bar((x, y - 6.0), (x + 12.0, y + 6.0), color(*line))?;
            let name = schedule.lines.get(*line).map_or("", String::as_str);
            canvas.text((x + 18.0, y), 12.0, Anchor::Start, INK, &canvas::shorten(name, 26))?;
        }
        Ok(())
    })
}

fn draw(canvas: &Canvas<'_>, axis: &TimeAxis, bar: &Bar<'_>, middle: f64, color: Ink) -> Result<(), PlotError> {
    let half = if bar.claimed { 11.0 } else { 4.0 };
    // A gap of one pixel tells neighbours apart.
    let (from, to) = (axis.x(bar.start), (axis.x(bar.end) - 1.0).max(axis.x(bar.start) + 1.0));
    canvas.bar((from, middle - half), (to, middle + half), color)?;
    let room = ((to - from - 8.0) / 6.0) as usize;
    if bar.claimed && room >= 4 {
        canvas.text((from + 4.0, middle), 11.0, Anchor::Start, PAPER, &canvas::shorten(bar.label, room))?;
    }
    Ok(())
}
