//! The report as it is read in a terminal.

use matterix_ir::Severity;
use matterix_ir::model::OUTSIDE;
use matterix_ir::quantity::show_number;

use super::text::{Align, Table, amount, digits, mass, quantity, seconds};
use super::{BalanceReport, ContainerReport, MeasuredReport, Place, Report};
use crate::exec::StepState;
use crate::record::recording::Level;
use crate::record::run::Status;

use Align::{Left, Right};

/// Rows of a list before the rest is counted.
const MOST: usize = 60;

/// Result, expectations, contents, time line and ledger as aligned plain text.
pub fn human(report: &Report) -> String {
    let sections = [
        head(report),
        failure(report),
        findings(report),
        expectations(report),
        containers(report),
        readings(report),
        timeline(report),
        processes(report),
        events(report),
        ledger(report),
        log(report),
    ];
    sections.into_iter().flatten().collect::<Vec<_>>().join("\n")
}

fn section(title: &str, table: &Table) -> Option<String> {
    let body = table.print();
    (!body.is_empty()).then(|| format!("{title}\n{body}"))
}

fn head(report: &Report) -> Option<String> {
    let status = match report.status {
        Status::Passed => "passed",
        Status::Missed if report.findings.iter().any(|f| f.severity == Severity::Error) => {
            "a hazard or an incompatible mixture occurred"
        }
        Status::Missed if report.expectations.iter().all(|e| e.passed) => "something was left on, open or held",
        Status::Missed => "an expectation was not met",
        Status::Failed => "failed",
        Status::Cancelled => "cancelled",
    };
    let mut text = format!("{} in {}: {status} after {} s\n", report.workflow, report.lab, show_number(report.end));
    for argument in &report.arguments {
        text += &format!("  {} = {}\n", argument.name, argument.value);
    }
    Some(text)
}

fn failure(report: &Report) -> Option<String> {
    let failure = report.failure.as_ref()?;
    let mut table = Table::new(&[Left, Left]);
    table.row([format!("{}: {}", failure.name, failure.text), place(&failure.place)]);
    for node in &failure.trace {
        table.row([format!("in {}", node.label), place(&node.place)]);
    }
    section(&format!("Failure at {} s", seconds(failure.time)), &table)
}

fn findings(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Right, Left, Left, Left]);
    for finding in &report.findings {
        let severity = if finding.severity == Severity::Error { "ERROR" } else { "warning" };
        table.row([&format!("{} s", seconds(finding.time)), severity, &finding.text, &place(&finding.place)]);
    }
    section("Findings", &table)
}

fn expectations(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Left, Left, Left, Left]);
    for expectation in &report.expectations {
        let verdict = if expectation.passed { "ok" } else { "MISSED" };
        let lone = expectation.measured.len() == 1;
        let value = expectation.measured.first().filter(|_| lone).map(found).unwrap_or_default();
        table.row([verdict.to_owned(), expectation.text.clone(), value, place(&expectation.place)]);
        for part in expectation.measured.iter().filter(|_| !lone) {
            table.row(["", &format!("  {}", part.text), &found(part), ""]);
        }
    }
    section("Expectations", &table)
}

fn found(measured: &MeasuredReport) -> String {
    let value = quantity(measured.value, &measured.unit);
    // How far outside, where that is not obvious from the text.
    let off = match (measured.low, measured.high) {
        (Some(low), _) if measured.value < low => Some((low - measured.value, "below")),
        (_, Some(high)) if measured.value > high => Some((measured.value - high, "above")),
        _ => None,
    };
    off.map_or(format!("is {value}"), |(by, side)| format!("is {value}, {} {side}", digits(by)))
}

fn containers(report: &Report) -> Option<String> {
    let parts: Vec<String> = report.containers.iter().filter_map(container).collect();
    (!parts.is_empty()).then(|| format!("Contents at the end\n{}", parts.concat()))
}

fn container(container: &ContainerReport) -> Option<String> {
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Left]);
    // A run that ends before its first moment knows no amounts.
    let there = |s: &&super::SpeciesReport| !s.mass.is_nan() && (s.mass != 0.0 || s.put.is_some_and(|put| put != 0.0));
    if container.species.iter().filter(there).any(|s| s.put.is_some()) {
        table.row(["", "at equilibrium", "", "", "put in"]);
    }
    for species in container.species.iter().filter(there) {
        let amount = species.amount.map(amount).unwrap_or_default();
        let weight = mass(species.mass);
        // What rounding left of a used-up species is shown as none.
        let gone = weight == "0" && (amount == "0" || amount.is_empty());
        let concentration = species
            .concentration
            .map(|c| if gone { "0".into() } else { quantity_short(c, &species.concentration_unit) });
        let put = species.put.map(self::amount).unwrap_or_default();
        let solid = if species.solid == Some(true) && !gone { "solid" } else { "" };
        let row = [format!("  {}", species.name), amount, weight, concentration.unwrap_or_default(), put];
        table.row(row.into_iter().chain([solid.to_owned()]));
    }
    let body = table.print();
    if body.is_empty() {
        return None;
    }
    let show = |p: &super::PropertyReport| {
        let values: Vec<String> = p.values.iter().map(|&v| digits(v)).collect();
        let values = if values.len() == 1 { values.concat() } else { format!("({})", values.join(", ")) };
        let outside = if p.outside { OUTSIDE } else { "" };
        format!("{} {values}{}{}{outside}", p.name, if p.unit.is_empty() { "" } else { " " }, p.unit)
    };
    let known = |p: &&super::PropertyReport| p.values.iter().all(|v| v.is_finite());
    let properties: Vec<String> = container.properties.iter().filter(known).map(show).collect();
    let line = if properties.is_empty() { String::new() } else { format!(": {}", properties.join(", ")) };
    Some(format!("  {}{line}\n{body}", container.name))
}

fn quantity_short(value: f64, unit: &str) -> String {
    if unit.is_empty() { digits(value) } else { format!("{} {unit}", digits(value)) }
}

fn readings(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Left, Right, Left]);
    for reading in &report.readings {
        table.row([
            reading.name.clone(),
            quantity(reading.value, &reading.unit),
            format!("at {} s", seconds(reading.time)),
        ]);
    }
    section("Readings, the last of each device", &table)
}

fn timeline(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Right, Right, Left, Left, Left]);
    let shown = |s: &&super::StepReport| !s.structure && s.start.is_some();
    let rows: Vec<_> = report.steps.iter().filter(shown).collect();
    if !rows.is_empty() {
        table.row(["start s", "end s", "", "", ""]);
    }
    for step in rows.iter().take(MOST) {
        let time = |t: Option<f64>| t.map(seconds).unwrap_or_default();
        let state = match step.state {
            StepState::Done => "",
            StepState::Failed => "failed",
            StepState::Skipped => "stopped",
            StepState::Running | StepState::Pending => "not ended",
        };
        let label = format!("{}{}", "  ".repeat(step.depth.min(8)), step.label);
        table.row([time(step.start), time(step.end), label, state.to_owned(), place(&step.place)]);
    }
    rest(&mut table, 2, rows.len());
    let never = report.steps.iter().filter(|s| !s.structure && s.start.is_none()).count();
    if never > 0 {
        table.row(["", "", &format!("({never} never started)"), "", ""]);
    }
    section("Time line", &table)
}

fn rest(table: &mut Table, column: usize, total: usize) {
    if total > MOST {
        let mut cells = vec![String::new(); column];
        cells.push(format!("({} more in report.json)", total - MOST));
        table.row(cells);
    }
}

fn processes(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Left, Left]);
    let end = report.end;
    let always = |p: &super::ProcessReport| matches!(p.intervals.as_slice(), [[a, b]] if *a <= 0.0 && *b >= end);
    let rows: Vec<_> = report.processes.iter().filter(|p| !p.intervals.is_empty() && !always(p)).collect();
    for process in rows.iter().take(MOST) {
        let shown = process.intervals.iter().take(3).map(|[a, b]| format!("{} .. {} s", seconds(*a), seconds(*b)));
        let mut text = shown.collect::<Vec<_>>().join(", ");
        if process.intervals.len() > 3 {
            text += &format!(" and {} more", process.intervals.len() - 3);
        }
        table.row([process.name.clone(), text]);
    }
    rest(&mut table, 0, rows.len());
    section("Processes that started or ended", &table)
}

fn events(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Right, Left, Left]);
    for event in report.events.iter().take(MOST) {
        table.row([format!("{} s", seconds(event.time)), event.name.clone(), place(&event.place)]);
    }
    rest(&mut table, 1, report.events.len());
    section("Events", &table)
}

fn ledger(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Left, Right, Right, Right, Left, Right]);
    if !report.ledger.is_empty() {
        table.row(["", "start", "end", "exchanged", "", "relative error"]);
    }
    for balance in &report.ledger {
        let exchanged: f64 = balance.exchanges.iter().map(|e| e.amount).sum();
        let numbers = [balance.initial, balance.end, exchanged].map(show_number);
        let [initial, end, exchanged] = numbers;
        table.row([balance.name.clone(), initial, end, exchanged, balance.unit.clone(), error(balance)]);
        if balance.exchanges.len() > 1 {
            for exchange in balance.exchanges.iter().filter(|e| e.amount != 0.0) {
                table.row(["", "", &exchange.name, &show_number(exchange.amount), "", ""]);
            }
        }
    }
    section("Ledger", &table)
}

fn error(balance: &BalanceReport) -> String {
    if balance.relative_error == 0.0 { "0".into() } else { format!("{:.1e}", balance.relative_error) }
}

fn log(report: &Report) -> Option<String> {
    let mut table = Table::new(&[Right, Left, Left, Left]);
    for line in report.log.iter().filter(|l| l.level > Level::Debug) {
        let level = match line.level {
            Level::Warning => "warning",
            Level::Error => "error",
            Level::Debug | Level::Info => "",
        };
        table.row([format!("{} s", seconds(line.time)), level.to_owned(), line.text.clone(), place(&line.place)]);
    }
    section("Notes", &table)
}

fn place(place: &Place) -> String {
    // A line of the library is not one of the user's file.
    match place.line {
        Some(line) if place.file.contains("::") => format!("{}:{line}", place.file),
        Some(line) => format!("line {line}"),
        None => String::new(),
    }
}
