//! Tables in CSV: every state and observable wherever one of them changed its way, and what `record` statements took.

use std::collections::BTreeMap;
use std::io::{self, Write};

use matterix_ir::Unit;
use matterix_ir::plan::Step;

use super::column::{Cell, Column, exact};
use super::frames::frames;
use super::run::Run;

/// One row a time at which any column has a point, one column a state or a component of an observable, with the unit in the header.
pub fn states<W: Write>(run: &Run<'_>, out: W) -> io::Result<()> {
    let columns = Column::all(run);
    let columns: Vec<&Column<'_>> = columns.iter().collect();
    let mut writer = csv::Writer::from_writer(out);
    let mut header = vec!["time [s]".to_owned()];
    for column in &columns {
        header.extend((0..column.parts.len()).map(|part| with_unit(&column.part_name(part), column.symbol())));
    }
    writer.write_record(&header)?;
    for frame in frames(&columns) {
        writer.write_field(exact(frame.time))?;
        for (index, column) in columns.iter().enumerate() {
            for part in 0..column.parts.len() {
                match column.cell(run, frame.value(&columns, index, part)) {
                    Cell::Number(value) => writer.write_field(exact(value))?,
                    Cell::Bool(value) => writer.write_field(if value { "true" } else { "false" })?,
                    Cell::Name(name) => writer.write_field(name)?,
                }
            }
        }
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()
}

/// One row a recorded number: time, name, component from 1, value, unit.
pub fn records<W: Write>(run: &Run<'_>, out: W) -> io::Result<()> {
    let units = record_units(run);
    let plain = Unit::one();
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["time [s]", "record", "component", "value", "unit"])?;
    for entry in run.recording.values.iter() {
        let unit = units.get(entry.name).copied().unwrap_or(&plain);
        for (i, &value) in entry.values.iter().enumerate() {
            let (time, value) = (exact(entry.time), exact(unit.of_si(value)));
            writer.write_record([time.as_str(), entry.name, &(i + 1).to_string(), &value, &unit.symbol])?;
        }
    }
    writer.flush()
}

/// The unit of each `record` statement by its name.
pub(super) fn record_units<'a>(run: &Run<'a>) -> BTreeMap<&'a str, &'a Unit> {
    let steps = run.program.plan.steps.iter();
    let units = steps.filter_map(|s| match &s.step {
        Step::Record { name, unit, .. } => Some((name.as_str(), unit)),
        _ => None,
    });
    units.collect()
}

fn with_unit(name: &str, symbol: &str) -> String {
    if symbol.is_empty() { name.to_owned() } else { format!("{name} [{symbol}]") }
}
