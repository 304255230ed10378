//! One page of plots a run, as SVG: panels over one time axis, strips of what was on, the steps at the bottom.

pub(crate) mod axis;
pub(crate) mod canvas;
mod choose;
mod draw;
mod series;
mod strips;

use matterix_ir::quantity::show_number;

use super::run::{Run, Status};
use canvas::{Anchor, Canvas, INK, MUTED};

/// The page could not be drawn.
pub type PlotError = std::io::Error;

/// Width of the page, px.
const WIDTH: f64 = 1200.0;
/// Left edge of the panels: room for the numbers of the axes, px.
const LEFT: f64 = 72.0;
/// Right edge of the panels: beyond it stand the legends, px.
const RIGHT: f64 = 860.0;
/// Height of the title, px.
const TOP: f64 = 76.0;
/// Height of the time axis, px.
const BOTTOM: f64 = 50.0;

/// The page as an SVG document.
pub fn page(run: &Run<'_>) -> Result<String, PlotError> {
    let blocks = choose::blocks(run);
    let height = TOP + blocks.iter().map(draw::Block::height).sum::<f64>() + BOTTOM;
    let time = axis::TimeAxis::new(run.recording.end, LEFT, RIGHT);
    canvas::page(WIDTH, height, |canvas| {
        title(run, canvas)?;
        time.draw(canvas, TOP, height - BOTTOM, &choose::boundaries(run))?;
        let mut top = TOP;
        for block in &blocks {
            block.draw(canvas, &time, top)?;
            top += block.height();
        }
        Ok(())
    })
}

fn title(run: &Run<'_>, canvas: &Canvas<'_>) -> Result<(), PlotError> {
    let plan = &run.program.plan;
    canvas.heading((LEFT, 26.0), 20.0, &format!("{} in {}", plan.workflow, run.program.scene.lab))?;
    let (status, color) = match run.info.status {
        Status::Passed => ("passed", MUTED),
        Status::Missed if run.recording.expectations.iter().all(|e| e.passed) => {
            ("something was left on, open or held", INK)
        }
        Status::Missed => ("an expectation was not met", INK),
        Status::Failed => ("failed", INK),
        Status::Cancelled => ("cancelled", INK),
    };
    let end = show_number(run.recording.end);
    let mut facts = vec![status.to_owned(), format!("{end} s"), format!("seed {}", run.info.seed)];
    facts.extend(plan.arguments.iter().map(|(name, value)| format!("{name} = {value}")));
    canvas.text((LEFT, 52.0), 12.0, Anchor::Start, color, &canvas::shorten(&facts.join("   ·   "), 150))
}
