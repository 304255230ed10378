//! The law of Pitzer: measured coefficients, and what mathematics says of them.

use super::*;

/// Numbers at 25 degC of Harvie, Moller and Weare, Geochim. Cosmochim. Acta 48 (1984) 723: b0, b1, b2, C0, or theta or psi.
const NUMBERS: &[(&[&str], &[f64])] = &[
    (&["Na+", "Cl-"], &[0.0765, 0.2664, 0.0, 0.00127]),
    (&["K+", "Cl-"], &[0.04835, 0.2122, 0.0, -0.00084]),
    (&["Mg++", "Cl-"], &[0.35235, 1.6815, 0.0, 0.00519]),
    (&["Na+", "SO4--"], &[0.01958, 1.113, 0.0, 0.00497]),
    (&["Mg++", "SO4--"], &[0.221, 3.343, -37.23, 0.025]),
    (&["H+", "Cl-"], &[0.1775, 0.2945, 0.0, 0.0008]),
    (&["Na+", "OH-"], &[0.0864, 0.253, 0.0, 0.0044]),
    (&["Na+", "K+"], &[-0.012]),
    (&["Na+", "Mg++"], &[0.07]),
    (&["Cl-", "SO4--"], &[0.02]),
    (&["Na+", "K+", "Cl-"], &[-0.0018]),
    (&["Na+", "Cl-", "SO4--"], &[0.0014]),
    (&["CO2", "Na+"], &[0.1]),
    (&["CO2", "Na+", "Cl-"], &[-0.005]),
];

/// The species of [`NUMBERS`] in water, which splits, with carbon dioxide as a weak acid and two salts.
fn brine() -> Mixture {
    let mut sketch = Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
        .equation("-1 CO2 -1 water 1 H+ 1 HCO3-", -6.35, 9.1)
        .equation("-1 NaCl(s) 1 Na+ 1 Cl-", 1.570, 3.8)
        .equation("-1 KCl(s) 1 K+ 1 Cl-", 0.900, 17.2)
        .equation("-1 Na2SO4.10water(s) 2 Na+ 1 SO4-- 10 water", -1.228, 79.0)
        .equation("-1 Mg(OH)2(s) 1 Mg++ 2 OH-", -10.88, 0.0);
    let place = |name: &&str| sketch.written.members.iter().position(|m| m.name == *name).unwrap();
    let each = NUMBERS.iter().map(|(members, _)| {
        let members: Vec<usize> = members.iter().map(place).collect();
        let charge = |i: &usize| sketch.written.members[*i].charge;
        let is_double = members.iter().all(|i| charge(i).abs() == 2.0);
        Interaction { members, reach: if is_double { [1.4, 12.0] } else { [2.0, 12.0] } }
    });
    let interactions = Interactions { spread: 1.2, each: each.collect() };
    sketch.written.interactions = Some(interactions);
    let mut mixture = sketch.build();
    mixture.args[..Layout::ACTIVITIES].copy_from_slice(&[0.51, 8.74e-4, 4.34e-6, 0.0, 0.0, 1e9, 0.018_015]);
    let layout = mixture.system.layout();
    for (number, value) in NUMBERS.iter().flat_map(|(_, numbers)| *numbers).enumerate() {
        let at = layout.interaction(number);
        // Each follows the temperature a little, so that slopes have something to follow.
        mixture.args[at] = value - 298.15 * 1e-3 * value;
        mixture.args[at + 3] = 1e-3 * value;
    }
    mixture
}

/// So many mol of salts in a kilogram of water.
fn with(all: &[(&str, f64)]) -> Mixture {
    brine().with(&[("water", 1.0 / 0.018_015)]).with(all)
}

impl Mixture {
    fn ln_activity(&self, name: &str) -> f64 {
        self.system.value(Part::Activity(self.find(name)), &self.args)
    }

    /// The mean activity coefficient of a salt of such ions.
    fn mean(&self, ions: &[(&str, f64)]) -> f64 {
        let of = |(name, n): &(&str, f64)| n * (self.ln_activity(name) - self.amount(name).ln());
        let water = self.amount("water") * 0.018_015;
        let all: f64 = ions.iter().map(|(_, n)| n).sum();
        (ions.iter().map(of).sum::<f64>() / all + water.ln()).exp()
    }

    fn osmotic(&self, molality: f64) -> f64 {
        -self.ln_activity("water") / (0.018_015 * molality)
    }
}

fn near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} is not {expected}");
}

#[test]
fn coefficients_are_those_measured() {
    // Robinson and Stokes, Electrolyte Solutions, 2nd ed., appendices 8.9 and 8.10.
    let nacl = |m: f64| with(&[("Na+", m), ("Cl-", m)]);
    for (m, gamma, phi) in [(0.1, 0.778, 0.9324), (1.0, 0.657, 0.9355), (6.0, 0.986, 1.2706)] {
        near(nacl(m).mean(&[("Na+", 1.0), ("Cl-", 1.0)]), gamma, 0.006);
        near(nacl(m).osmotic(2.0 * m), phi, 0.004);
    }
    let kcl = with(&[("K+", 4.0), ("Cl-", 4.0)]);
    near(kcl.mean(&[("K+", 1.0), ("Cl-", 1.0)]), 0.577, 0.006);
    let mgcl2 = with(&[("Mg++", 1.0), ("Cl-", 2.0)]);
    near(mgcl2.mean(&[("Mg++", 1.0), ("Cl-", 2.0)]), 0.569, 0.01);
    near(mgcl2.osmotic(3.0), 1.108, 0.006);
    let na2so4 = with(&[("Na+", 2.0), ("SO4--", 1.0)]);
    near(na2so4.mean(&[("Na+", 2.0), ("SO4--", 1.0)]), 0.204, 0.015);
    let mgso4 = with(&[("Mg++", 1.0), ("SO4--", 1.0)]);
    near(mgso4.osmotic(2.0), 0.525, 0.02);
}

#[test]
fn salts_dissolve_as_measured_alone_and_together() {
    let dissolved = |all: &[(&str, f64)], name: &str| {
        let mixture = with(all);
        mixture.amount(name) / (mixture.amount("water") * 0.018_015)
    };
    near(dissolved(&[("NaCl(s)", 9.0)], "Na+"), 6.15, 0.01);
    near(dissolved(&[("KCl(s)", 9.0)], "K+"), 4.80, 0.015);
    // Both at once: 5.1 and 2.2 mol/kg at 25 degC.
    let both: &[(&str, f64)] = &[("NaCl(s)", 9.0), ("KCl(s)", 9.0)];
    near(dissolved(both, "Na+"), 5.1, 0.02);
    near(dissolved(both, "K+"), 2.2, 0.04);
}

/// A mixture of everything, drawn by a seed; each third with its heat.
fn drawn(seed: u64) -> Mixture {
    let mut draw = draws(seed);
    let mut most = || 10f64.powf(draw() * 4.0 - 3.0);
    let [na, k, mg, cl, so4, co2] = std::array::from_fn(|_| most());
    let charge = na + k + 2.0 * mg - cl - 2.0 * so4;
    let mut mixture = with(&[("Na+", na), ("K+", k), ("Mg++", mg), ("Cl-", cl), ("SO4--", so4), ("CO2", co2 * 0.05)]);
    mixture = mixture.with(&[if charge > 0.0 { ("Cl-", cl + charge) } else { ("K+", k - charge) }]);
    if seed.is_multiple_of(3) {
        let layout = mixture.system.layout();
        mixture.args[layout.capacity()] = 4200.0;
        mixture.args[layout.heat()] = 4200.0 * (seed % 40) as f64;
    }
    mixture
}

#[test]
fn mixtures_are_solved() {
    for seed in 1..400 {
        let mixture = drawn(seed);
        let all = mixture.system.value(Part::Strength, &mixture.args);
        assert!(all.is_finite(), "{seed}");
    }
}

#[test]
fn the_solvent_agrees_with_the_solutes() {
    // Gibbs and Duhem: what a share of all brings to the solutes it takes from the solvent.
    for seed in 1..60 {
        let at = |share: f64| {
            let mut mixture = drawn(seed);
            let layout = mixture.system.layout();
            (mixture.args[layout.capacity()], mixture.args[layout.heat()]) = (f64::INFINITY, 0.0);
            for i in 1..mixture.system.members().len() {
                mixture.args[layout.amount(i)] *= share * 0.1;
            }
            mixture
        };
        let (low, middle, high) = (at(1.0 - 1e-4), at(1.0), at(1.0 + 1e-4));
        let change = |name: &str| high.ln_activity(name) - low.ln_activity(name);
        let of = |m: &Member| (m.phase != Phase::Solid).then(|| middle.amount(&m.name) * change(&m.name));
        let terms: Vec<f64> = middle.system.members().iter().filter_map(of).collect();
        let size: f64 = terms.iter().map(|t| t.abs()).sum();
        assert!(terms.iter().sum::<f64>().abs() < 1e-6 * size, "{seed}: {terms:?}");
    }
}

#[test]
fn slopes_are_those_of_differences() {
    for seed in [3, 4, 9, 17] {
        let mixture = drawn(seed);
        let (system, args) = (&mixture.system, &mixture.args);
        let layout = system.layout();
        let count = system.members().len();
        let of_member = |i: usize| [Part::Amount(i as u32), Part::Activity(i as u32)];
        let parts: Vec<Part> = (0..count).flat_map(of_member).chain([Part::Temperature, Part::Strength]).collect();
        let by: Vec<usize> = (0..layout.count()).filter(|arg| args[*arg] != 0.0 && args[*arg].is_finite()).collect();
        for arg in by.into_iter().filter(|arg| *arg != Layout::ACTIVITIES - 2) {
            let step = 1e-6 * args[arg].abs();
            let moved = |by: f64| {
                let mut args = args.clone();
                args[arg] += by;
                args
            };
            for part in &parts {
                let mut found = Vec::new();
                system.slopes(*part, args, &[arg], &mut found);
                let (low, high) = (system.value(*part, &moved(-step)), system.value(*part, &moved(step)));
                let expected = (high - low) / (2.0 * step);
                let scale = 1e-9 * system.value(*part, args).abs() / step;
                let off = (found[0] - expected).abs();
                assert!(
                    off <= 2e-4 * expected.abs() + scale + 1e-12,
                    "{seed} {part:?} {arg}: {} is not {expected}",
                    found[0]
                );
            }
        }
    }
}
