//! Least squares against certified results.

use std::sync::atomic::AtomicBool;

use matterix_runtime::fit::{Model, Options, Scale, Spread, Unsolved, solve};

/// Monomolecular adsorption of the dental research data of NIST's Statistical Reference Datasets (Misra1a, public domain):
/// y = b1 (1 - exp(-b2 x)).
struct Misra1a;

const X: [f64; 14] = [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0];
const Y: [f64; 14] = [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78];

impl Model for Misra1a {
    fn residuals(&self, b: &[f64]) -> Result<Vec<f64>, String> {
        Ok(X.iter().zip(Y).map(|(x, y)| b[0] * (1.0 - (-b[1] * x).exp()) - y).collect())
    }
}

const SCALES: [Scale; 2] = [Scale { low: 50.0, high: 1000.0, log: false }, Scale { low: 1e-5, high: 1e-2, log: true }];

#[test]
fn a_certified_problem_has_its_certified_solution() {
    let never = AtomicBool::new(false);
    let options = Options { nominal: vec![500.0, 1e-4], seed: 1, jobs: 2, cancel: &never };
    let found = solve(&Misra1a, &SCALES, &options, &mut |_| {}).expect("there is a solution");
    let near = |value: f64, certified: f64, within: f64| {
        assert!((value / certified - 1.0).abs() < within, "{value}, not {certified}");
    };
    near(found.values[0], 2.389_421_291_8e2, 1e-5);
    near(found.values[1], 5.501_564_318_1e-4, 1e-5);
    let squares: f64 = found.residuals.iter().map(|r| r * r).sum();
    near(squares, 1.245_513_889_4e-1, 1e-7);
    // Certified standard deviations, with the residual one of 12 degrees of freedom.
    let spread = Spread::new(&found.jacobian, (squares / 12.0).sqrt(), Some(12));
    let error = |i: usize| spread.errors[i].expect("it is determined") * SCALES[i].slope(found.places[i]);
    near(error(0), 2.707_007_524_1, 1e-3);
    near(error(1), 7.266_868_843_6e-6, 1e-3);
    assert!(spread.undetermined.is_empty());
    near(spread.reach, 2.178_812_83, 1e-6);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let never = AtomicBool::new(false);
    let values = |jobs| {
        let options = Options { nominal: Vec::new(), seed: 1, jobs, cancel: &never };
        solve(&Misra1a, &SCALES, &options, &mut |_| {}).expect("there is a solution").values
    };
    assert_eq!(values(1), values(3));
}

#[test]
fn a_best_place_outside_the_box_is_looked_for_at_its_edge() {
    let never = AtomicBool::new(false);
    let options = Options { nominal: Vec::new(), seed: 1, jobs: 1, cancel: &never };
    let narrow = [Scale { low: 50.0, high: 200.0, log: false }, SCALES[1]];
    let found = solve(&Misra1a, &narrow, &options, &mut |_| {}).expect("there is a solution");
    assert!(found.places[0] > 0.999, "{:?}", found.places);
}

/// Cannot be judged anywhere, or only in a part of its box.
struct Broken {
    below: f64,
}

impl Model for Broken {
    fn residuals(&self, b: &[f64]) -> Result<Vec<f64>, String> {
        if b[0] < self.below { Ok(vec![b[0] - 0.2, 2.0 * (b[0] - 0.2)]) } else { Err("timeout: too long".into()) }
    }
}

#[test]
fn places_without_residuals_are_gone_round() {
    let never = AtomicBool::new(false);
    let options = Options { nominal: Vec::new(), seed: 1, jobs: 1, cancel: &never };
    let scale = [Scale { low: 0.0, high: 1.0, log: false }];
    let found = solve(&Broken { below: 0.4 }, &scale, &options, &mut |_| {}).expect("there is a solution");
    assert!((found.values[0] - 0.2).abs() < 1e-6);
    let none = solve(&Broken { below: 0.0 }, &scale, &options, &mut |_| {});
    assert_eq!(none.map(|s| s.values), Err(Unsolved::Failed("timeout: too long".into())));
}
