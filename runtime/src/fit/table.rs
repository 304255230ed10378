//! Data and model side by side.

use matterix_ir::study::Fit;

use super::outcome::Outcome;
use crate::record::column::exact;

/// Twelve significant digits: what is lost to the way through SI is not shown.
fn rounded(value: f64) -> String {
    exact(format!("{value:.11e}").parse().unwrap_or(value))
}

/// CSV with the columns `time [s]`, `column`, `unit`, `data`, `model`, `residual` (model less data) and `weighted` (in
/// standard deviations).
pub fn csv(fit: &Fit, outcome: &Outcome) -> Result<String, String> {
    let broken = |e: &dyn std::fmt::Display| format!("cannot write the residuals: {e}");
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = ["time [s]", "column", "unit", "data", "model", "residual", "weighted"];
    writer.write_record(head).map_err(|e| broken(&e))?;
    for m in &outcome.matching {
        let Some(about) = fit.matches.get(m.column) else { continue };
        let numbers = [m.data, m.model, m.model - m.data, m.weighted].map(rounded);
        let cells = [exact(m.time), about.column.clone(), about.unit.symbol.clone()].into_iter().chain(numbers);
        writer.write_record(cells).map_err(|e| broken(&e))?;
    }
    let bytes = writer.into_inner().map_err(|e| broken(&e))?;
    String::from_utf8(bytes).map_err(|e| broken(&e))
}
