//! Drawing in px on an SVG page. The page is drawn enlarged, because the backend knows whole px only.

use std::fmt::Display;

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::PlotError;

/// Enlargement against rounding.
const FINE: f64 = 10.0;
/// Text sizes the backend takes are line heights.
const LINE: f64 = 1.24;

/// A colour.
pub(crate) type Ink = RGBColor;

/// Text on dark bars.
pub(crate) const PAPER: RGBColor = RGBColor(255, 255, 255);
/// Text and frames.
pub(crate) const INK: RGBColor = RGBColor(38, 42, 48);
/// Second-rank text.
pub(crate) const MUTED: RGBColor = RGBColor(104, 110, 118);
/// Grid lines.
pub(crate) const GRID: RGBColor = RGBColor(228, 231, 235);
/// Lines where something happened.
pub(crate) const BOUNDARY: RGBColor = RGBColor(190, 196, 204);

/// Distinguishable to the colour-blind: Okabe and Ito (2008), their yellow, pale on white, replaced by grey.
pub(crate) const PALETTE: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(136, 136, 136),
];

/// Where a text is held.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// A page on which is drawn; positions in px from the upper left corner.
pub(crate) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// A white page of this size, drawn on, as an SVG document.
pub(crate) fn page(
    width: f64,
    height: f64,
    paint: impl FnOnce(&Canvas<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let (w, h) = (fine(width) as u32, fine(height) as u32);
    let mut text = String::new();
    {
        let canvas = Canvas { area: SVGBackend::with_string(&mut text, (w, h)).into_drawing_area() };
        canvas.area.fill(&WHITE).map_err(failed)?;
        paint(&canvas)?;
        canvas.area.present().map_err(failed)?;
    }
    let enlarged = format!("width=\"{w}\" height=\"{h}\"");
    let shown = format!("width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\"");
    Ok(text.replacen(&enlarged, &shown, 1))
}

impl Canvas<'_> {
    /// A line through the points, `width` px wide, dashed or not.
    pub(crate) fn line(
        &self,
        points: &[(f64, f64)],
        color: RGBColor,
        width: f64,
        dashed: bool,
    ) -> Result<(), PlotError> {
        let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| (fine(x), fine(y))).collect();
        let style = color.stroke_width(fine(width) as u32);
        if dashed {
            let dash = DashedPathElement::new(points, fine(5.0) as u32, fine(3.0) as u32, style);
            self.area.draw(&dash).map_err(failed)
        } else {
            self.area.draw(&PathElement::new(points, style)).map_err(failed)
        }
    }

    /// A filled rectangle from its upper left to its lower right corner.
    pub(crate) fn bar(&self, from: (f64, f64), to: (f64, f64), color: RGBColor) -> Result<(), PlotError> {
        let corners = [(fine(from.0), fine(from.1)), (fine(to.0), fine(to.1))];
        self.area.draw(&Rectangle::new(corners, color.filled())).map_err(failed)
    }

    /// The edge of a rectangle.
    pub(crate) fn frame(&self, from: (f64, f64), to: (f64, f64)) -> Result<(), PlotError> {
        self.line(&[from, (to.0, from.1), to, (from.0, to.1), from], BOUNDARY, 1.0, false)
    }

    /// A text, its vertical middle at `y`, `size` px high.
    pub(crate) fn text(
        &self,
        (x, y): (f64, f64),
        size: f64,
        anchor: Anchor,
        color: RGBColor,
        text: &str,
    ) -> Result<(), PlotError> {
        self.write((x, y), ("sans-serif", size * LINE * FINE).into_font(), anchor, color, text)
    }

    /// A heading, its vertical middle at `y`.
    pub(crate) fn heading(&self, at: (f64, f64), size: f64, text: &str) -> Result<(), PlotError> {
        let font = ("sans-serif", size * LINE * FINE).into_font().style(FontStyle::Bold);
        self.write(at, font, Anchor::Start, INK, text)
    }

    fn write(
        &self,
        (x, y): (f64, f64),
        font: FontDesc<'_>,
        anchor: Anchor,
        color: RGBColor,
        text: &str,
    ) -> Result<(), PlotError> {
        let held = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let style = TextStyle::from(font).color(&color).pos(Pos::new(held, VPos::Center));
        // XML has no way to write most control characters.
        let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        self.area.draw(&Text::new(text, (fine(x), fine(y)), style)).map_err(failed)
    }
}

fn fine(px: f64) -> i32 {
    (px * FINE).round() as i32
}

fn failed(error: impl Display) -> PlotError {
    PlotError::other(error.to_string())
}

/// At most this many characters, with an ellipsis where some are left out.
pub(crate) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let kept: String = text.chars().take(most.saturating_sub(1)).collect();
    format!("{}…", kept.trim_end_matches([' ', '.']))
}
