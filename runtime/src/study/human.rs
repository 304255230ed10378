//! The summary of a study to read.

use std::fmt::Write;

use matterix_ir::quantity::show_number;

use super::Summary;

/// A short table of figures, then how the runs ended.
pub fn human(summary: &Summary) -> String {
    let mut out = String::new();
    let Summary { study, workflow, lab, runs, done, seed, .. } = summary;
    let _ = writeln!(out, "study {study} of {workflow} in {lab}: {done} of {runs} runs, seed {seed}");
    for v in &summary.varied {
        let unit = if v.unit.is_empty() { String::new() } else { format!(" {}", v.unit) };
        let (low, high) = (show_number(v.low), show_number(v.high));
        let _ = writeln!(out, "  vary {} in {low}{unit} .. {high}{unit} by {}", v.name, v.by);
    }
    let mut rows: Vec<[String; 8]> =
        vec![["", "mean", "std", "min", "5 %", "median", "95 %", "max"].map(str::to_string)];
    for c in &summary.reports {
        let show = |v: Option<f64>| v.map_or_else(|| "-".to_string(), short);
        let name = if c.unit.is_empty() { c.name.clone() } else { format!("{} [{}]", c.name, c.unit) };
        let [mean, std, min, q05, median, q95, max] = [c.mean, c.std, c.min, c.q05, c.median, c.q95, c.max].map(show);
        rows.push([name, mean, std, min, q05, median, q95, max]);
    }
    let widths: Vec<usize> = (0..8).map(|i| rows.iter().map(|r| r[i].chars().count()).max().unwrap_or(0)).collect();
    out.push('\n');
    for row in &rows {
        let _ = write!(out, "  {:<width$}", row[0], width = widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            let _ = write!(out, "  {cell:>width$}");
        }
        out.push('\n');
    }
    out.push('\n');
    let ended: Vec<String> = summary.outcomes.iter().map(|(how, n)| format!("{n} {how}")).collect();
    let _ = writeln!(out, "  {}", ended.join(", "));
    for (fault, n) in &summary.failures {
        let _ = writeln!(out, "  {n} ended by {fault}");
    }
    out
}

/// Four significant digits.
pub(crate) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    show_number(rounded)
}
