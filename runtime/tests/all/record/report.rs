//! The report and its text.

use matterix_runtime::exec::StepState;
use matterix_runtime::record::{Report, human};

use super::fixture;

#[test]
fn expectations_carry_what_was_measured() {
    let report = Report::new(&fixture::lab().run());
    let [expectation] = report.expectations.as_slice() else { panic!("{:?}", report.expectations) };
    assert_eq!((expectation.passed, expectation.place.line), (false, Some(8)));
    let measured = &expectation.measured[0];
    assert_eq!(
        (measured.value, measured.low, measured.high, measured.unit.as_str()),
        (0.8985, Some(0.9), Some(0.92), "mol/kg")
    );
}

#[test]
fn contents_are_those_of_the_end() {
    let report = Report::new(&fixture::lab().run());
    let beaker = &report.containers[0];
    let eti = beaker.species.iter().find(|s| s.name == "EtI").expect("product");
    let amount = eti.amount.expect("counted in mol");
    assert!((amount - 0.0108).abs() < 2e-4, "{amount}");
    assert!((eti.mass - amount * 155.966).abs() < 1e-12);
    assert!((eti.concentration.expect("given") - 83.0 * amount).abs() < 1e-12);
    assert_eq!(beaker.properties[0].name, "temperature");
}

#[test]
fn a_species_counted_by_mass_has_no_amount() {
    let mut lab = fixture::lab();
    lab.program.model.species[1].by_mass = true;
    lab.program.model.species[1].molar_mass = 1.0;
    let report = Report::new(&lab.run());
    let starch = &report.containers[0].species[1];
    assert_eq!(starch.amount, None);
    assert!((starch.mass - 10.8).abs() < 0.2, "{} g", starch.mass);
}

#[test]
fn the_ledger_closes_to_rounding() {
    let report = Report::new(&fixture::lab().run());
    let [energy, carbon] = report.ledger.as_slice() else { panic!("{:?}", report.ledger) };
    assert_eq!((energy.unit.as_str(), energy.relative_error), ("kJ", 0.0));
    assert!(energy.exchanges[0].amount > 0.0);
    assert!((carbon.initial - 12.0).abs() < 1e-12 && carbon.relative_error < 1e-15, "{carbon:?}");
}

#[test]
fn a_balance_that_does_not_close_says_by_how_much() {
    let mut lab = fixture::lab();
    let (time, last) = lab.recording.states[5].last().expect("samples");
    lab.recording.states[5].push(time, last + 1e-3);
    let report = Report::new(&lab.run());
    assert!((report.ledger[1].error - 1.0).abs() < 1e-9, "{:?} mmol", report.ledger[1].error);
}

#[test]
fn every_execution_of_a_repeated_step_is_a_row() {
    let mut lab = fixture::lab();
    let wait = matterix_ir::plan::StepId(2);
    lab.recording.step(1500.0, wait, StepState::Running);
    lab.recording.step(1502.0, wait, StepState::Failed);
    let rows: Vec<_> = Report::new(&lab.run()).steps.into_iter().filter(|s| s.id == 2).collect();
    assert_eq!(rows.iter().map(|r| r.state).collect::<Vec<_>>(), [StepState::Done, StepState::Failed]);
    assert_eq!((rows[1].start, rows[1].end), (Some(1500.0), Some(1502.0)));
}

#[test]
fn a_process_without_guard_ran_all_the_time() {
    let report = Report::new(&fixture::lab().run());
    let intervals: Vec<_> = report.processes.iter().map(|p| p.intervals.clone()).collect();
    assert_eq!(intervals, [vec![[2.0, 1010.5]], vec![[0.0, 2000.0]], vec![[11.4, 1639.9]]]);
}

#[test]
fn the_text_is_what_a_chemist_reads() {
    let text = human(&Report::new(&fixture::lab().run()));
    if std::env::var("SHOW_REPORT").is_ok() {
        println!("{text}");
    }
    for wanted in [
        "synthesize in bench: an expectation was not met after 2000 s",
        "  target = 76.33 degC",
        "Failure at 6.50 s",
        "MISSED  beaker.contents[EtI] in 0.90 mol/kg .. 0.92 mol/kg  is 0.8985 mol/kg, 0.0015 below  line 8",
        "place beaker on hotplate by panda",
        "heating(hotplate)                           2.00 .. 1010.50 s",
        "energy",
    ] {
        assert!(text.contains(wanted), "{wanted}\n{text}");
    }
    assert!(text.lines().all(|l| l.trim_end() == l), "no blanks at ends of lines");
}

#[test]
fn marks_of_things_the_program_lacks_are_ignored() {
    let mut lab = fixture::lab();
    lab.recording.event(1.0, 99);
    lab.recording.process(1.0, 99, true);
    lab.recording.step(1.0, matterix_ir::plan::StepId(99), StepState::Running);
    lab.recording.reading(1.0, 99, 0.0);
    let report = Report::new(&lab.run());
    assert_eq!(report.events.len(), 1);
    assert!(report.json().is_ok());
}
