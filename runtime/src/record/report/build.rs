//! From the recording to the report.

use matterix_ir::Unit;
use matterix_ir::model::{Content, Mixture};

use super::*;
use crate::record::history::{self, is_structure};
use crate::record::run::TOOL;
use crate::record::series::Series;
use crate::record::table::record_units;

/// The report of a finished run.
pub(super) fn report(run: &Run<'_>) -> Report {
    let (program, info) = (run.program, run.info);
    let argument = |(name, value): &(String, String)| ArgumentReport { name: name.clone(), value: value.clone() };
    Report {
        schema: REPORT_SCHEMA,
        tool: TOOL.to_owned(),
        language: info.language,
        files: program.files.clone(),
        workflow: program.plan.workflow.clone(),
        lab: program.scene.lab.clone(),
        arguments: program.plan.arguments.iter().map(argument).collect(),
        seed: info.seed,
        fidelity: info.fidelity,
        status: info.status,
        end: run.recording.end,
        failure: failure(run),
        findings: findings(run),
        expectations: expectations(run),
        containers: program.model.mixtures.iter().map(|m| container(run, m)).collect(),
        steps: steps(run),
        processes: processes(run),
        events: events(run),
        readings: readings(run),
        records: records(run),
        ledger: ledger::balances(run),
        log: log(run),
        integrator: info.integrator.clone(),
    }
}

fn failure(run: &Run<'_>) -> Option<FailureReport> {
    let failure = run.info.failure.as_ref()?;
    let steps = &run.program.plan.steps;
    let nodes = failure.trace.iter().filter_map(|id| steps.get(id.0 as usize)).filter(|n| !is_structure(&n.step));
    Some(FailureReport {
        name: failure.name.clone(),
        text: failure.text.clone(),
        time: failure.time,
        place: failure.span.map(|s| run.place(s)).unwrap_or_default(),
        trace: nodes.map(|n| TraceReport { label: n.label.clone(), place: run.place(n.span) }).collect(),
    })
}

fn findings(run: &Run<'_>) -> Vec<FindingReport> {
    let row = |f: &crate::run::Finding| FindingReport {
        time: f.time,
        code: f.diagnostic.code.name.to_owned(),
        severity: f.diagnostic.severity,
        text: f.diagnostic.headline.clone(),
        place: run.place(f.diagnostic.span()),
    };
    run.info.findings.iter().map(row).collect()
}

fn expectations(run: &Run<'_>) -> Vec<ExpectationReport> {
    let entry = |e: &crate::record::recording::Expectation| ExpectationReport {
        text: e.text.clone(),
        passed: e.passed,
        time: e.time,
        place: run.place(e.span),
        measured: e.measured.iter().filter_map(MeasuredReport::of).collect(),
    };
    run.recording.expectations.iter().map(entry).collect()
}

fn container(run: &Run<'_>, mixture: &Mixture) -> ContainerReport {
    let instance = run.program.scene.instances.get(mixture.instance.0 as usize);
    let name = instance.map(|i| i.name.clone()).unwrap_or_default();
    let species = mixture.contents.iter().enumerate();
    let property = |&index: &u32| -> Option<PropertyReport> {
        let observable = run.program.model.observables.get(index as usize)?;
        let short = observable.name.strip_prefix(&name).map_or(observable.name.as_str(), |n| n.trim_start_matches('.'));
        let components = run.recording.observables.get(index as usize)?.iter();
        let values = components.map(|c| observable.unit.of_si(end(c))).collect();
        let outside = run.validity(observable).is_some_and(|holds| end(holds) != 1.0);
        Some(PropertyReport { name: short.to_owned(), values, unit: observable.unit.symbol.clone(), outside })
    };
    ContainerReport {
        species: species.filter_map(|(i, c)| content(run, c, mixture.concentrations.get(i).copied())).collect(),
        properties: mixture.properties.iter().filter_map(property).collect(),
        name,
    }
}

fn content(run: &Run<'_>, content: &Content, concentration: Option<u32>) -> Option<SpeciesReport> {
    let species = run.program.model.species.get(content.species as usize)?;
    let settled = content.settled.and_then(|i| run.recording.observables.get(i as usize)?.first());
    let put = end(run.recording.states.get(content.state as usize)?);
    let amount = settled.map_or(put, end);
    let of = |index: u32| {
        let observable = run.program.model.observables.get(index as usize)?;
        let (_, value) = run.recording.observables.get(index as usize)?.first()?.last()?;
        Some((observable.unit.of_si(value), observable.unit.symbol.clone()))
    };
    let (concentration, concentration_unit) = concentration.and_then(of).map(|(v, u)| (Some(v), u)).unwrap_or_default();
    Some(SpeciesReport {
        name: species.name.clone(),
        formula: species.formula.clone(),
        amount: (!species.by_mass).then_some(amount),
        mass: amount * species.molar_mass * 1000.0,
        put: settled.map(|_| put),
        solid: settled.map(|_| run.program.model.is_solid(content)),
        concentration,
        concentration_unit,
    })
}

/// What it is at the end.
fn end(series: &Series) -> f64 {
    series.last().map_or(f64::NAN, |p| p.1)
}

fn steps(run: &Run<'_>) -> Vec<StepReport> {
    let plan = &run.program.plan;
    let paths = history::paths(plan);
    let places: Vec<Place> = plan.steps.iter().map(|s| run.place(s.span)).collect();
    let row = |r: history::StepRun| {
        let i = r.step.0 as usize;
        let step = plan.steps.get(i)?;
        Some(StepReport {
            id: r.step.0,
            label: step.label.clone(),
            path: paths.get(i)?.0.clone(),
            depth: paths.get(i)?.1,
            structure: is_structure(&step.step),
            start: r.start,
            end: r.end,
            state: r.state,
            place: places.get(i)?.clone(),
        })
    };
    history::step_runs(run).into_iter().filter_map(row).collect()
}

fn processes(run: &Run<'_>) -> Vec<ProcessReport> {
    let intervals = history::process_intervals(run);
    let row = |(process, list): (&matterix_ir::model::Process, Vec<(f64, f64)>)| ProcessReport {
        name: process.name.clone(),
        intervals: list.into_iter().map(|(a, b)| [a, b]).collect(),
        place: run.place(process.span),
    };
    run.program.model.processes.iter().zip(intervals).map(row).collect()
}

fn events(run: &Run<'_>) -> Vec<EventReport> {
    let events = &run.program.model.events;
    let places: Vec<Place> = events.iter().map(|e| run.place(e.span)).collect();
    let row = |mark: &crate::record::recording::EventMark| {
        let (event, place) = events.get(mark.event).zip(places.get(mark.event))?;
        Some(EventReport { time: mark.time, name: event.name.clone(), place: place.clone() })
    };
    run.recording.events.iter().filter_map(row).collect()
}

fn readings(run: &Run<'_>) -> Vec<ReadingReport> {
    let row = |(reading, marks): (&matterix_ir::model::Reading, Vec<crate::record::ReadingMark>)| {
        let last = marks.last()?;
        Some(ReadingReport {
            name: reading.name.clone(),
            time: last.time,
            value: reading.unit.of_si(last.value),
            unit: reading.unit.symbol.clone(),
            count: marks.len(),
        })
    };
    run.program.model.readings.iter().zip(run.recording.by_reading(run.program)).filter_map(row).collect()
}

fn records(run: &Run<'_>) -> Vec<RecordSummary> {
    let records = run.recording.values.by_name();
    let row = |(name, unit): (&str, &Unit)| {
        let taken = records.get(name)?;
        let show = |values: &[f64]| values.iter().map(|&v| unit.of_si(v)).collect::<Vec<_>>();
        let (first, last) = (taken.iter().next()?, taken.iter().next_back()?);
        let (first, last) = (show(first.values), show(last.values));
        Some(RecordSummary { name: name.to_owned(), unit: unit.symbol.clone(), count: taken.len(), first, last })
    };
    record_units(run).into_iter().filter_map(row).collect()
}

fn log(run: &Run<'_>) -> Vec<LogReport> {
    let row = |line: &crate::record::recording::LogLine| LogReport {
        time: line.time,
        level: line.level,
        text: line.text.clone(),
        place: line.span.map(|s| run.place(s)).unwrap_or_default(),
    };
    run.recording.log.iter().map(row).collect()
}
