//! Transfers and balances.

use matterix_ir::model::{Action, Kept, Stays};
use matterix_ir::{Span, codes};
use matterix_runtime::process::{Engine, Options};
use proptest::prelude::*;

use crate::engine_model::{Build, assign, engine, run};

fn pour(b: &mut Build, fraction: f64, from: u32, to: u32) -> Action {
    Action::Move { fraction: b.num(fraction), but: Box::default(), from, to, span: Span::default() }
}

/// Two mixtures of enthalpy and two species, and a balance of each.
fn two_mixtures(amounts: [f64; 6]) -> Build {
    let mut b = Build::default();
    let names = ["a.EtI", "a.water", "a.enthalpy", "b.EtI", "b.water", "b.enthalpy"];
    let nodes: Vec<_> = names.iter().zip(amounts).map(|(n, v)| b.state(n, v)).collect();
    b.mixture(&[("amount[EtI]", 0), ("amount[H2O]", 1), ("enthalpy", 2)]);
    b.mixture(&[("amount[EtI]", 3), ("amount[H2O]", 4), ("enthalpy", 5)]);
    for (i, name) in ["EtI", "water", "energy"].into_iter().enumerate() {
        let total = b.add(nodes[i], nodes[i + 3]);
        b.balance(name, total, vec![]);
    }
    b
}

proptest! {
    #[test]
    fn a_transfer_conserves_every_quantity(
        amounts in prop::array::uniform6(0.0..1e6f64),
        fraction in 0.0..=1.0f64,
    ) {
        let mut b = two_mixtures(amounts);
        let action = pour(&mut b, fraction, 0, 1);
        let mut engine = engine(&b.model);
        engine.apply(&[action], &mut ()).expect("a fraction of what there is");
        let after = engine.states();
        for i in 0..3 {
            let (before, now) = (amounts[i] + amounts[i + 3], after[i] + after[i + 3]);
            prop_assert!((before - now).abs() <= 2.0 * f64::EPSILON * before);
            prop_assert!(after[i] >= 0.0);
        }
    }
}

/// The same transfer, of whose source a share of the first quantity and so much of the third stay.
fn strain(b: &mut Build, fraction: f64, share: f64, amount: f64) -> Action {
    let stays = [(0, Stays::Share(b.num(share))), (2, Stays::Amount(b.num(amount)))];
    let but = stays.into_iter().map(|(state, stays)| Kept { state, stays }).collect();
    Action::Move { fraction: b.num(fraction), but, from: 0, to: 1, span: Span::default() }
}

proptest! {
    #[test]
    fn what_is_held_back_stays_and_nothing_is_lost(
        amounts in prop::array::uniform6(0.0..1e6f64),
        fraction in 0.0..=1.0f64,
        share in 0.0..=1.0f64,
        part in 0.0..=1.0f64,
    ) {
        let mut b = two_mixtures(amounts);
        let action = strain(&mut b, fraction, share, part * amounts[2]);
        let mut engine = engine(&b.model);
        engine.apply(&[action], &mut ()).expect("a fraction of what there is");
        let after = engine.states();
        let held = [share * amounts[0], 0.0, part * amounts[2]];
        for i in 0..3 {
            let (before, now) = (amounts[i] + amounts[i + 3], after[i] + after[i + 3]);
            prop_assert!((before - now).abs() <= 4.0 * f64::EPSILON * before);
            let left = held[i] + (1.0 - fraction) * (amounts[i] - held[i]);
            prop_assert!((after[i] - left).abs() <= 1e-9 * (1.0 + amounts[i]), "{} is not {left}", after[i]);
            prop_assert!(after[i] >= held[i] * (1.0 - 1e-12));
        }
    }
}

#[test]
fn all_but_what_is_held_back_leaves_just_that() {
    let mut b = two_mixtures([0.5, 5.5, 2e4, 0.0, 1.0, 3e3]);
    let action = strain(&mut b, 1.0, 1.0, 5e3);
    let mut engine = engine(&b.model);
    engine.apply(&[action], &mut ()).expect("everything else");
    assert_eq!(engine.states(), [0.5, 0.0, 5e3, 0.0, 6.5, 1.8e4]);
}

#[test]
fn a_share_that_is_none_is_a_fault() {
    for share in [-1e-6, 1.0 + 1e-6, f64::NAN] {
        let mut b = two_mixtures([0.5, 5.5, 2e4, 0.0, 1.0, 3e3]);
        let action = strain(&mut b, 0.5, share, 0.0);
        let mut engine = engine(&b.model);
        let before = engine.states();
        let fault = engine.apply(&[action], &mut ()).expect_err("no share");
        assert_eq!(fault.code, codes::TRANSFER_FRACTION, "{fault}");
        assert!(fault.message.contains("stay"), "{fault}");
        assert_eq!(engine.states(), before);
    }
}

#[test]
fn all_of_it_leaves_nothing() {
    let mut b = two_mixtures([0.1, 5.5, 2e4, 0.0, 1.0, 3e3]);
    let action = pour(&mut b, 1.0, 0, 1);
    let mut engine = engine(&b.model);
    engine.apply(&[action], &mut ()).expect("everything");
    assert_eq!(engine.states(), [0.0, 0.0, 0.0, 0.1, 6.5, 2.3e4]);
}

#[test]
fn a_fraction_outside_is_a_fault() {
    for fraction in [-1e-12, 1.0 + 1e-6, f64::NAN, f64::INFINITY] {
        let mut b = two_mixtures([0.1, 5.5, 2e4, 0.0, 1.0, 3e3]);
        let action = pour(&mut b, fraction, 0, 1);
        let mut engine = engine(&b.model);
        let fault = engine.apply(&[action], &mut ()).expect_err("outside 0 to 1");
        assert_eq!(fault.code, codes::TRANSFER_FRACTION, "{fault}");
        assert_eq!(engine.states(), [0.1, 5.5, 2e4, 0.0, 1.0, 3e3], "nothing has moved");
    }
}

#[test]
fn a_rest_that_is_known_to_rounding_is_taken_whole() {
    let mut b = two_mixtures([0.1, 5.5, 2e4, 0.0, 1.0, 3e3]);
    let action = pour(&mut b, 1.0 + 1e-12, 0, 1);
    let mut engine = engine(&b.model);
    engine.apply(&[action], &mut ()).expect("everything");
    assert_eq!(engine.states(), [0.0, 0.0, 0.0, 0.1, 6.5, 2.3e4]);
}

#[test]
fn a_quantity_without_a_place_is_a_fault() {
    let mut b = Build::default();
    b.state("a.EtI", 1.0);
    b.state("a.KI", 0.0);
    b.state("b.KI", 2.0);
    b.mixture(&[("amount[EtI]", 0), ("amount[KI]", 1)]);
    b.mixture(&[("amount[KI]", 2)]);
    let (there, back) = (pour(&mut b, 0.5, 0, 1), pour(&mut b, 0.5, 1, 0));
    let mut engine = engine(&b.model);
    let fault = engine.apply(&[there], &mut ()).expect_err("EtI has no place");
    assert_eq!(fault.code, codes::BALANCE_BREACH);
    assert!(fault.message.contains("`a.EtI`"), "{fault}");
    engine.apply(&[back], &mut ()).expect("KI has a place");
    assert_eq!(engine.states(), [1.0, 1.0, 1.0]);
}

#[test]
fn a_leak_is_a_fault() {
    let mut b = Build::default();
    let x = b.state("beaker.heat", 100.0);
    b.balance("energy", x, vec![]);
    let less = b.num(99.9999);
    let mut engine = engine(&b.model);
    let fault = engine.apply(&[assign(0, less)], &mut ()).expect_err("heat is lost");
    assert_eq!(fault.code, codes::BALANCE_BREACH);
    assert!(fault.message.contains("energy") && fault.message.contains("99.9999"), "{fault}");
}

#[test]
fn what_crosses_the_boundary_is_accounted_for() {
    let mut b = Build::default();
    let heat = b.state("beaker.heat", 1e4);
    b.state("to air", 0.0);
    let loss = b.scale(-1e-2, heat);
    b.rate(0, loss);
    b.rate(1, loss);
    b.balance("energy", heat, vec![1]);
    let (engine, _) = run(&b.model, 300.0);
    let report = &engine.balances()[0];
    assert!(report.relative < 1e-12, "{report:?}");
    assert!((report.exchanged + 1e4 * (1.0 - (-3f64).exp())).abs() < 1e-2);
}

#[test]
fn a_leak_in_a_law_is_found_at_the_end() {
    let mut b = Build::default();
    let heat = b.state("beaker.heat", 1e4);
    let loss = b.scale(-1e-6, heat);
    b.rate(0, loss);
    b.balance("energy", heat, vec![]);
    let mut engine = Engine::new(&b.model, vec![], 0, Options::default()).expect("engine");
    engine.start(&mut ()).expect("start");
    engine.advance(10.0, &[], &mut ()).expect("advance");
    assert_eq!(engine.finish(&mut ()).expect_err("leak").code, codes::BALANCE_BREACH);
}
