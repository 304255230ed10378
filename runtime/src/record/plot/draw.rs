//! A block of the page: a panel of lines or rows of bars.

use plotters::style::RGBColor;

use super::PlotError;
use super::axis::{TimeAxis, exponent, power_of_ten, ticks};
use super::canvas::{Anchor, Canvas, GRID, INK, MUTED, PALETTE, shorten};
use super::series::Series;

/// Title above each block, px.
const HEAD: f64 = 24.0;
/// Lines of a panel, px.
const PLOT: f64 = 150.0;
/// Below each block, px.
const GAP: f64 = 16.0;
/// A row of bars, px.
const ROW: f64 = 17.0;
/// Characters of a legend.
const LEGEND: usize = 46;

/// Lines over a common axis.
pub(super) struct Panel {
    /// Above it, without the unit.
    pub(super) title: String,
    /// Of all lines.
    pub(super) symbol: String,
    /// As many as there are colours, at most.
    pub(super) series: Vec<Series>,
    /// Names of the lines for which there was no room.
    pub(super) left_out: Vec<String>,
}

/// A stretch of time in a row.
pub(super) struct Bar {
    /// s.
    pub(super) start: f64,
    /// s.
    pub(super) end: f64,
    /// Of the bar.
    pub(super) color: RGBColor,
    /// In it, where there is room; else beside it if `beside`.
    pub(super) text: String,
    /// Whether the text stands after the bar, or before it at the right edge.
    pub(super) beside: bool,
}

/// Bars beside a label.
pub(super) struct Row {
    /// At the right.
    pub(super) label: String,
    /// Not overlapping.
    pub(super) bars: Vec<Bar>,
}

/// One block.
pub(super) enum Block {
    /// Lines.
    Panel(Panel),
    /// Bars, under a title.
    Rows {
        /// Above them.
        title: String,
        /// From the top.
        rows: Vec<Row>,
        /// Of how many rows there was no room for.
        left_out: usize,
    },
}

impl Block {
    /// px, title and gap included.
    pub(super) fn height(&self) -> f64 {
        match self {
            Block::Panel(_) => HEAD + PLOT + GAP,
            Block::Rows { rows, left_out, .. } => HEAD + ROW * (rows.len() + usize::from(*left_out > 0)) as f64 + GAP,
        }
    }

    /// Draws it below `top`, px.
    pub(super) fn draw(&self, canvas: &Canvas<'_>, time: &TimeAxis, top: f64) -> Result<(), PlotError> {
        match self {
            Block::Panel(panel) => panel.draw(canvas, time, top),
            Block::Rows { title, rows, left_out } => {
                canvas.heading((time.edges().0, top + 14.0), 12.0, title)?;
                for (i, row) in rows.iter().enumerate() {
                    row.draw(canvas, time, top + HEAD + ROW * i as f64)?;
                }
                if *left_out == 0 {
                    return Ok(());
                }
                let y = top + HEAD + ROW * (rows.len() as f64 + 0.5);
                let text = format!("{left_out} more in report.json");
                canvas.text((time.edges().1 + 14.0, y), 11.0, Anchor::Start, MUTED, &text)
            }
        }
    }
}

impl Row {
    fn draw(&self, canvas: &Canvas<'_>, time: &TimeAxis, top: f64) -> Result<(), PlotError> {
        let (left, right) = time.edges();
        let middle = top + ROW / 2.0;
        // A guide to the label, where no text stands on it.
        if self.bars.iter().all(|b| !b.beside || b.text.is_empty()) {
            canvas.line(&[(left, middle), (right, middle)], GRID, 1.0, false)?;
        }
        for bar in &self.bars {
            let from = time.x(bar.start).min(right - 2.0);
            // What takes no time must still be seen.
            let to = time.x(bar.end).max(from + 2.0);
            // Neighbours overlap by a hair, or the renderer leaves a seam.
            canvas.bar((from, top + 3.0), ((to + 0.5).min(right), top + ROW - 3.0), bar.color)?;
            let length = 6.5 * bar.text.chars().count() as f64;
            if to - from > length + 10.0 {
                canvas.text((from + 5.0, middle), 10.0, Anchor::Start, contrast(bar.color), &bar.text)?;
            } else if bar.beside && to + length + 10.0 < right {
                canvas.text((to + 5.0, middle), 10.0, Anchor::Start, MUTED, &bar.text)?;
            } else if bar.beside {
                canvas.text((from - 5.0, middle), 10.0, Anchor::End, MUTED, &bar.text)?;
            }
        }
        canvas.text((right + 14.0, middle), 11.0, Anchor::Start, INK, &shorten(&self.label, LEGEND))
    }
}

/// Black or white, whichever is read on the colour.
fn contrast(RGBColor(r, g, b): RGBColor) -> RGBColor {
    let light = 299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) > 140_000;
    if light { INK } else { RGBColor(255, 255, 255) }
}

impl Panel {
    fn draw(&self, canvas: &Canvas<'_>, time: &TimeAxis, top: f64) -> Result<(), PlotError> {
        let (left, right) = time.edges();
        let (upper, lower) = (top + HEAD, top + HEAD + PLOT);
        let (low, high) = self.range();
        let (scale, symbol) = scaled(low.abs().max(high.abs()), &self.symbol);
        let y = |value: f64| lower - PLOT * (value - low) / (high - low);

        let title = if symbol.is_empty() { self.title.clone() } else { format!("{} [{symbol}]", self.title) };
        canvas.heading((left, top + 14.0), 12.0, &shorten(&title, 100))?;
        let marks = ticks(low / scale, high / scale, 6);
        for &mark in &marks.at {
            let at = y(mark * scale);
            canvas.line(&[(left, at), (right, at)], GRID, 1.0, false)?;
            canvas.text((left - 8.0, at), 11.0, Anchor::End, INK, &marks.label(mark))?;
        }
        canvas.frame((left, upper), (right, lower))?;
        for (series, &color) in self.series.iter().zip(&PALETTE) {
            let points: Vec<(f64, f64)> = series.corners().into_iter().map(|(t, v)| (time.x(t), y(v))).collect();
            canvas.line(&points, color, if series.stepped { 1.4 } else { 1.8 }, series.stepped)?;
        }
        self.legend(canvas, right + 14.0, upper)
    }

    fn legend(&self, canvas: &Canvas<'_>, left: f64, top: f64) -> Result<(), PlotError> {
        let mut y = top + 9.0;
        for (series, &color) in self.series.iter().zip(&PALETTE) {
            canvas.line(&[(left, y), (left + 24.0, y)], color, 2.2, series.stepped)?;
            canvas.text((left + 32.0, y), 11.0, Anchor::Start, INK, &shorten(&series.name, LEGEND - 5))?;
            y += 16.0;
        }
        if self.left_out.is_empty() {
            return Ok(());
        }
        let text = format!("not shown: {}", self.left_out.join(", "));
        canvas.text((left, y), 10.0, Anchor::Start, MUTED, &shorten(&text, LEGEND + 4))
    }

    /// The values with room above and below.
    fn range(&self) -> (f64, f64) {
        let ranges = self.series.iter().filter_map(Series::range);
        let (low, high) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((0.0, 1.0));
        let room = if high > low { 0.06 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        (low - room, high + room)
    }
}

/// Very large and very small numbers are written as multiples of a power of a thousand.
fn scaled(magnitude: f64, symbol: &str) -> (f64, String) {
    let power = exponent(magnitude);
    if magnitude == 0.0 || (-3..5).contains(&power) {
        return (1.0, symbol.to_owned());
    }
    let power = power.div_euclid(3) * 3;
    (power_of_ten(power), format!("1e{power} {symbol}").trim_end().to_owned())
}
