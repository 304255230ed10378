//! The runs of a study as a table: a row a run, a column for each thing that varied and each report.

use matterix_ir::Unit;
use matterix_ir::study::Study;

use super::Row;
use crate::exec::RunStatus;
use crate::record::column::exact;

/// How a run ended, in one word.
pub(super) fn outcome(status: RunStatus) -> &'static str {
    match status {
        RunStatus::Passed => "passed",
        RunStatus::ExpectationFailed => "missed",
        RunStatus::Failed => "failed",
        RunStatus::Fault => "fault",
        RunStatus::Cancelled => "cancelled",
    }
}

/// A column's name with its unit: `target [degC]`.
pub(super) fn header(name: &str, unit: &Unit) -> String {
    if unit.symbol.is_empty() { name.to_owned() } else { format!("{name} [{}]", unit.symbol) }
}

/// CSV with the columns `run`, `seed`, what varied, the reports, `outcome` and `fault`.
pub fn csv(study: &Study, rows: &[Row]) -> Result<String, String> {
    let broken = |e: &dyn std::fmt::Display| format!("cannot write the table: {e}");
    let mut writer = csv::Writer::from_writer(Vec::new());
    let varied = study.varied.iter().map(|v| header(&v.free.name, &v.free.unit));
    let reports = study.reports.iter().map(|r| header(&r.name, &r.unit));
    let head = ["run".to_string(), "seed".to_string()].into_iter().chain(varied).chain(reports);
    let head = head.chain(["outcome".to_string(), "fault".to_string()]);
    writer.write_record(head).map_err(|e| broken(&e))?;
    for row in rows {
        let varied = study.varied.iter().zip(&row.varied).map(|(v, si)| exact(v.free.unit.of_si(*si)));
        let reports = study.reports.iter().zip(&row.reports);
        let reports = reports.map(|(r, si)| si.map_or_else(String::new, |si| exact(r.unit.of_si(si))));
        let cells = [row.run.to_string(), row.seed.to_string()].into_iter().chain(varied).chain(reports);
        let cells = cells.chain([outcome(row.status).to_string(), row.fault.clone().unwrap_or_default()]);
        writer.write_record(cells).map_err(|e| broken(&e))?;
    }
    let bytes = writer.into_inner().map_err(|e| broken(&e))?;
    String::from_utf8(bytes).map_err(|e| broken(&e))
}
