mod layers;
mod pitzer;

use super::sketch::{LN_10, Sketch};
use super::*;

impl Sketch {
    fn build(self) -> Mixture {
        let (system, mut args) = self.ready().unwrap();
        args[MOST] = 1e9;
        Mixture { system, args }
    }
}

struct Mixture {
    system: System,
    args: Vec<f64>,
}

impl Mixture {
    fn find(&self, name: &str) -> u32 {
        self.system.members().iter().position(|m| m.name == name).unwrap() as u32
    }

    fn with(mut self, all: &[(&str, f64)]) -> Mixture {
        for (name, amount) in all {
            let at = self.system.layout().amount(self.find(name) as usize);
            self.args[at] = *amount;
        }
        self
    }

    /// With activity coefficients.
    fn real(mut self) -> Mixture {
        self.args[..Layout::ACTIVITIES].copy_from_slice(&[0.509, 1e-3, 0.0, 0.3286, 1e-4, 1e9, 0.017]);
        let layout = self.system.layout();
        for (i, member) in self.system.members().iter().enumerate() {
            let numbers = match (member.charge != 0.0, i % 3) {
                (false, _) => [0.0, 0.0, 0.0, 0.1],
                // Some by the law of Truesdell and Jones, the rest by that of Davies.
                (true, 0) => [0.0, 4.5, 0.0, 0.05],
                (true, _) => [1.0, 0.0, 0.3, 0.0],
            };
            let at = layout.coefficients(i);
            self.args[at..at + Layout::COEFFICIENTS].copy_from_slice(&numbers);
        }
        self
    }

    fn amount(&self, name: &str) -> f64 {
        self.system.value(Part::Amount(self.find(name)), &self.args)
    }

    fn ph(&self) -> f64 {
        -self.system.value(Part::Activity(self.find("H+")), &self.args) / LN_10
    }

    /// Compares all slopes with differences; how many there are.
    fn check_slopes(&self, what: &str) -> usize {
        let mut checked = 0;
        let system = &self.system;
        let layout = system.layout();
        let count = system.members().len() as u32;
        let mut parts: Vec<Part> = (0..count).map(Part::Amount).collect();
        parts.extend([Part::Temperature, Part::Strength, Part::Heat, Part::Capacity, Part::Activity(1)]);
        for part in parts {
            let all: Vec<usize> = (0..layout.count()).collect();
            let mut slopes = Vec::new();
            system.slopes(part, &self.args, &all, &mut slopes);
            for arg in all {
                let value = self.args[arg];
                if !value.is_finite() || value == 0.0 || arg == MOST {
                    continue;
                }
                let step = 1e-5 * value.abs();
                let at = |by: f64| {
                    let mut args = self.args.clone();
                    args[arg] += by;
                    system.value(part, &args)
                };
                let wide = (at(step) - at(-step)) / (2.0 * step);
                let narrow = (at(0.5 * step) - at(-0.5 * step)) / step;
                let size = at(0.0).abs() / value.abs();
                let of_differences = matches!(part, Part::Heat | Part::Capacity);
                let rough = if of_differences { 0.05 } else { 1e-4 };
                let noise = 1e-25 + rough * wide.abs().max(narrow.abs()) + 1e-5 * size + 3.0 * (wide - narrow).abs();
                assert!(
                    (slopes[arg] - wide).abs() <= noise,
                    "{what}, {part:?} by {arg}: {:e} is not {wide:e} (or {narrow:e}) of {:e} by {value:e}",
                    slopes[arg],
                    at(0.0)
                );
                checked += 1;
            }
        }
        checked
    }
}

fn acids() -> Sketch {
    Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
        .equation("-1 HAc 1 H+ 1 Ac-", -4.756, -0.4)
        .equation("-1 CO2 -1 water 1 H+ 1 HCO3-", -6.35, 9.1)
        .equation("-1 HCO3- 1 H+ 1 CO3--", -10.33, 14.7)
        .equation("-1 H3PO4 1 H+ 1 H2PO4-", -2.16, -8.0)
        .equation("-1 H2PO4- 1 H+ 1 HPO4--", -7.21, 3.6)
        .equation("-1 HPO4-- 1 H+ 1 PO4---", -12.32, 16.0)
        .equation("1 NH3 1 water -1 NH4+ -1 OH-", 4.75, -3.5)
        .equation("-1 AgCl(s) 1 Ag+ 1 Cl-", -9.75, 65.7)
        .equation("-1 Ag+ -2 NH3 1 Ag(NH3)2+", 7.22, -56.0)
        .equation("-1 CaCO3(s) 1 Ca++ 1 CO3--", -8.48, -10.0)
        .equation("-1 Ca(OH)2(s) 1 Ca++ 2 OH-", -5.19, -18.0)
}

const WATER: f64 = 55.508;

/// The argument that is the largest ionic strength of the law of activity.
const MOST: usize = Layout::ACTIVITIES - 2;

#[test]
fn pure_water_is_neutral() {
    let pure = acids().build().with(&[("water", WATER)]);
    assert!((pure.ph() - 6.9975).abs() < 1e-4, "{}", pure.ph());
    assert_eq!(pure.amount("HAc"), 0.0);
}

#[test]
fn acids_and_bases_of_the_textbook() {
    let ph = |all: &[(&str, f64)]| acids().build().with(&[("water", WATER)]).with(all).ph();
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 0.01, "{found} is not {expected}");
    near(ph(&[("H+", 0.1)]), 1.0);
    near(ph(&[("HAc", 0.1)]), 2.88);
    near(ph(&[("NH3", 0.1)]), 11.12);
    near(ph(&[("CO3--", 0.1)]), 11.65);
    near(ph(&[("HCO3-", 0.1)]), 8.34);
    near(ph(&[("H3PO4", 0.1)]), 1.63);
    near(ph(&[("H2PO4-", 0.1), ("HPO4--", 0.1)]), 7.21);
}

#[test]
fn solids_appear_and_vanish() {
    let silver = |ag: f64, cl: f64| acids().build().with(&[("water", WATER), ("Ag+", ag), ("Cl-", cl)]);
    let little = silver(1e-6, 1e-6);
    assert_eq!(little.amount("AgCl(s)"), 0.0);
    let much = silver(1e-3, 1e-3);
    assert!((much.amount("Ag+") - 1.333e-5).abs() < 1e-7, "{}", much.amount("Ag+"));
    let dissolved = acids().build().with(&[("water", WATER), ("AgCl(s)", 1e-3), ("NH3", 1.0)]);
    assert!(dissolved.amount("AgCl(s)") < 1e-12);
    let lime = acids().build().with(&[("water", WATER), ("CaCO3(s)", 0.1)]);
    assert!((lime.ph() - 9.9).abs() < 0.1, "{}", lime.ph());
}

/// Numbers between 0 and 1 that follow from a seed.
fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A mixture of everything, scaled from nanomoles to kilomoles.
fn random(seed: u64) -> Mixture {
    let mut draw = draws(seed);
    let mut mixture = acids().build();
    let size = 10f64.powf(draw() * 12.0 - 9.0);
    let layout = mixture.system.layout();
    for i in 1..mixture.system.members().len() {
        if draw() < 0.4 {
            mixture.args[layout.amount(i)] = size * 10f64.powf(draw() * 10.0 - 10.5);
        }
    }
    mixture.args[layout.amount(0)] = size * (1.0 + 50.0 * draw());
    if seed.is_multiple_of(2) {
        mixture = mixture.real();
        mixture.args[MOST] = 1.0;
    }
    if seed.is_multiple_of(3) {
        mixture.args[layout.capacity()] = 75.0 * mixture.args[layout.amount(0)];
        mixture.args[layout.heat()] = mixture.args[layout.capacity()] * (draw() * 40.0 - 10.0);
    }
    mixture
}

#[test]
fn random_mixtures_are_all_solved() {
    for seed in 0..1_000 {
        let mixture = random(seed);
        let budget = problem::Budget::of(0);
        let problem = problem::Problem::new(&mixture.system, &mixture.args, mixture.system.basis.clone(), &budget);
        let solution = solve::solve(&mixture.system, &mixture.args)
            .unwrap_or_else(|| panic!("mixture {seed}: {:?}", mixture.args));
        let point = solution.point.as_ref().unwrap();
        let off = point.state.residuals.iter().fold(0.0_f64, |most, r| most.max(r.abs()));
        assert!(off < 1e-10, "mixture {seed}: {off}");
        let basis = &problem.basis;
        for c in 0..basis.masters.len() {
            let sum = |of: &dyn Fn(usize) -> f64| (0..basis.of.len()).map(|i| basis.of[i][c] * of(i)).sum::<f64>();
            let size = (0..basis.of.len())
                .map(|i| (basis.of[i][c] * solution.amounts[i]).abs().max((basis.of[i][c] * problem.given(i)).abs()))
                .fold(0.0, f64::max);
            let gap = sum(&|i| solution.amounts[i]) - sum(&|i| problem.given(i));
            assert!(gap.abs() <= 1e-9 * size + 1e-40, "mixture {seed}: total {c} is off by {gap} of {size}");
        }
        assert!(solution.amounts.iter().all(|n| *n >= 0.0), "mixture {seed}");
    }
}

#[test]
fn slopes_are_those_of_differences() {
    let checked: usize = (0..30).map(|seed| random(seed).check_slopes(&format!("mixture {seed}"))).sum();
    assert!(checked > 10_000);
}

/// Lead in water, with ions that hold several atoms of it.
fn lead() -> Sketch {
    Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -14.0, 55.8)
        .equation("-1 Ca++ -1 water 1 CaOH+ 1 H+", -12.78, 0.0)
        .equation("-1 Pb++ -1 water 1 PbOH+ 1 H+", -7.71, 0.0)
        .equation("-1 Pb++ -2 water 1 Pb(OH)2 2 H+", -17.12, 0.0)
        .equation("-1 Pb++ -3 water 1 Pb(OH)3- 3 H+", -28.06, 0.0)
        .equation("-1 Pb++ -4 water 1 Pb(OH)4-- 4 H+", -39.7, 0.0)
        .equation("-2 Pb++ -1 water 1 Pb2OH+++ 1 H+", -6.36, 0.0)
        .equation("-1 Pb++ -1 Cl- 1 PbCl+", 1.6, 18.3)
        .equation("-1 Pb++ -2 Cl- 1 PbCl2", 1.8, 4.5)
        .equation("-1 Pb++ -3 Cl- 1 PbCl3-", 1.7, 9.1)
        .equation("-1 Pb++ -4 Cl- 1 PbCl4--", 1.38, 14.8)
        .equation("-3 Pb++ -4 water 1 Pb3(OH)4++ 4 H+", -23.88, 0.0)
}

#[test]
fn ions_of_several_atoms_are_solved() {
    let mixture = lead().build().with(&[("water", WATER), ("Pb++", 9.317e-5), ("Cl-", 1.71274e-3), ("Ca++", 7.632e-4)]);
    assert!((mixture.ph() - 6.0).abs() < 0.5, "{}", mixture.ph());
    for seed in 0..300_u32 {
        let of = |k: u32| 10f64.powf(-7.0 + 6.0 * f64::from((seed * 37 + k * 101) % 113) / 113.0);
        let all = [("water", WATER), ("Pb++", of(1)), ("Cl-", of(2)), ("OH-", of(3)), ("H+", of(4))];
        assert!(lead().build().real().with(&all).ph().is_finite(), "{seed}");
    }
}

#[test]
fn what_is_no_number_is_not_met() {
    assert!(newton::largest(&[1.0, f64::NAN, 0.0]).is_nan());
    assert_eq!(newton::largest(&[1.0, -3.0, 0.0]), 3.0);
}

fn potential(all: &[(&str, f64)]) -> f64 {
    let mixture = Sketch::half_cells().build().with(&[("water", WATER), ("H+", 1.0)]).with(all);
    -mixture.system.value(Part::Activity(mixture.find("e-")), &mixture.args) / LN_10 * 0.059_159_6
}

#[test]
fn potentials_follow_the_law_of_nernst() {
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-4, "{found} is not {expected}");
    near(potential(&[("Fe+++", 0.1), ("Fe++", 0.1)]), 0.771);
    near(potential(&[("Fe+++", 0.1), ("Fe++", 1e-3)]), 0.771 + 2.0 * 0.059_16);
    near(potential(&[("Cu++", 1e-2), ("Cu(s)", 1.0)]), 0.3419 - 0.059_16);
    near(potential(&[("MnO4-", 1e-2), ("Mn++", 1e-2)]), 1.507);
}

#[test]
fn a_redox_titration_passes_its_end_point() {
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 2e-4, "{found} is not {expected}");
    near(potential(&[("Fe++", 0.1), ("Ce++++", 0.05)]), 0.771);
    near(potential(&[("Fe++", 0.1), ("Ce++++", 0.1)]), 0.5 * (0.771 + 1.72));
    near(potential(&[("Fe++", 0.1), ("Ce++++", 0.2)]), 1.72);
    // Permanganate takes up five electrons and eight protons.
    let before = Sketch::half_cells().build().with(&[("water", WATER), ("H+", 1.0), ("Fe++", 0.1), ("MnO4-", 0.01)]);
    assert!((before.amount("Fe+++") - 0.05).abs() < 1e-9, "{}", before.amount("Fe+++"));
    assert!((before.amount("H+") - 0.92).abs() < 1e-9, "{}", before.amount("H+"));
    assert_eq!(before.amount("e-"), 0.0);
    // The potential at the end point lies between the two by the electrons that each takes.
    let end = Sketch::half_cells().build().with(&[("water", WATER), ("H+", 1.16), ("Fe++", 0.1), ("MnO4-", 0.02)]);
    let at = -end.system.value(Part::Activity(end.find("e-")), &end.args) / LN_10 * 0.059_159_6;
    near(at, (0.771 + 5.0 * 1.507) / 6.0);
}

/// Nothing takes up electrons or gives any: the potential is open, and the rest is that of the solution without half-cells.
#[test]
fn nothing_to_oxidise_is_no_trouble() {
    let sketch = || {
        Sketch::new()
            .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
            .equation("-1 MnO4- -8 H+ -5 e- 1 Mn++ 4 water", 5.0 * 1.507 / 0.059_159_6, -825.0)
            .equation("-1 Mn++ -1 water 1 MnOH+ 1 H+", -10.59, 60.25)
            .equation("-1 Mn(OH)2(s) 1 Mn++ 2 OH-", -12.8, 0.0)
    };
    for (name, mixture) in [("ideal", sketch().build()), ("real", sketch().build().real())] {
        let water = mixture.with(&[("water", WATER)]);
        assert!((water.ph() - 6.9975).abs() < 1e-3, "{name}: {}", water.ph());
        assert_eq!(water.amount("Mn++"), 0.0, "{name}");
        let mut warm = sketch().build().real().with(&[("water", WATER)]);
        let layout = warm.system.layout();
        warm.args[layout.capacity()] = 4184.0;
        warm.args[layout.heat()] = 0.0;
        assert!((warm.ph() - 6.9975).abs() < 1e-3, "{name}: {}", warm.ph());
        let acid = sketch().build().with(&[("water", WATER), ("H+", 0.1)]);
        assert!((acid.ph() - 1.0).abs() < 0.2, "{name}: {}", acid.ph());
    }
    assert!((Sketch::half_cells().build().with(&[("water", WATER)]).ph() - 6.9975).abs() < 1e-3);
    // What could be oxidised is there, and nothing that would do it.
    let thiosulfate = Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
        .equation("-1 S4O6-- -2 e- 2 S2O3--", 2.0 * 0.024 / 0.059_159_6, -72.8)
        .build()
        .with(&[("water", WATER), ("S2O3--", 0.1)]);
    assert!((thiosulfate.amount("S2O3--") - 0.1).abs() < 1e-9, "{}", thiosulfate.amount("S2O3--"));
}

#[test]
fn metals_plate_out_and_dissolve() {
    let mixture = Sketch::half_cells().build().with(&[("water", WATER), ("Cu++", 0.1), ("Zn(s)", 0.3)]);
    assert!((mixture.amount("Cu(s)") - 0.1).abs() < 1e-9, "{}", mixture.amount("Cu(s)"));
    assert!((mixture.amount("Zn(s)") - 0.2).abs() < 1e-9, "{}", mixture.amount("Zn(s)"));
    assert!((mixture.amount("Zn++") - 0.1).abs() < 1e-9, "{}", mixture.amount("Zn++"));
    for seed in 0..300_u32 {
        let of = |k: u32| 10f64.powf(-9.0 + 8.0 * f64::from((seed * 37 + k * 101) % 113) / 113.0);
        let all =
            [("Fe+++", of(1)), ("Fe++", of(2)), ("Ce++++", of(3)), ("MnO4-", of(4)), ("Cu++", of(5)), ("Zn(s)", of(6))];
        assert!(potential(&all).is_finite(), "{seed}");
    }
}

#[test]
fn bounds_hold_what_is_drawn_within_them() {
    let layout = acids().build().system.layout();
    let mut narrow = 0;
    for seed in (0..240_u64).step_by(3) {
        let mixture = random(seed);
        let heat = layout.heat();
        let capacity = mixture.args[layout.capacity()];
        // The heat is known within 10 K, and in every other mixture the amounts within 1 % too.
        let by_heat = |i: usize| (mixture.args[i] - 5.0 * capacity, mixture.args[i] + 5.0 * capacity);
        let is_amount = |i: usize| i >= layout.amount(0) && i < layout.bystanders() && seed % 2 == 1;
        let args: Vec<(f64, f64)> = (0..layout.count())
            .map(|i| match i {
                i if i == heat => by_heat(i),
                i if is_amount(i) => (mixture.args[i] * 0.99, mixture.args[i] * 1.01),
                i => (mixture.args[i], mixture.args[i]),
            })
            .collect();
        let count = mixture.system.members().len() as u32;
        let mut parts: Vec<Part> = (0..count).map(Part::Amount).collect();
        parts.extend([Part::Temperature, Part::Strength, Part::Heat, Part::Capacity, Part::Activity(1)]);
        for part in parts {
            let (low, high) = mixture.system.bounds(part, &args);
            narrow += u32::from((high - low).is_finite());
            for draw in 0..12_u64 {
                let share = |i: usize| ((draw * 7 + i as u64 * 5) % 11) as f64 / 10.0;
                let at: Vec<f64> = args
                    .iter()
                    .enumerate()
                    .map(|(i, a)| if a.0 == a.1 { a.0 } else { a.0 + share(i) * (a.1 - a.0) })
                    .collect();
                let value = mixture.system.value(part, &at);
                let slack = 1e-9 * value.abs() + 1e-18;
                assert!(
                    value.is_nan() || low - slack <= value && value <= high + slack,
                    "mixture {seed}, {part:?}: {value:e} is not in {low:e} .. {high:e}"
                );
            }
        }
    }
    assert!(narrow > 500, "{narrow}");
}

#[test]
fn what_is_absent_or_dry_is_no_trouble() {
    let silver = || Sketch::new().equation("-1 AgCl(s) 1 Ag+ 1 Cl-", -9.75, 65.7).build();
    for all in [&[("Cl-", 1e-3)][..], &[("Ag+", 1e-3)], &[], &[("AgCl(s)", 1e-3)], &[("Ag+", 1e-3), ("Cl-", 1e-3)]] {
        let mixture = silver().with(&[("water", WATER)]).with(all);
        assert!((mixture.amount("water") - WATER).abs() < 1e-9, "{all:?}: {}", mixture.amount("water"));
        let held = mixture.amount("Ag+") + mixture.amount("AgCl(s)");
        let given: f64 = all.iter().filter(|(name, _)| name.starts_with("Ag")).map(|(_, n)| n).sum();
        assert!((held - given).abs() < 1e-12, "{all:?}: {held}");
    }
    let complex = || Sketch::new().equation("-1 I2 -1 I- 1 I3-", 2.85, 0.0).build();
    for all in [&[("I2", 1e-3)][..], &[("I-", 1e-3)], &[("I2", 1e-3), ("I-", 1e-2)]] {
        let mixture = complex().real().with(&[("water", WATER)]).with(all);
        assert!((mixture.amount("water") - WATER).abs() < 1e-9, "{all:?}: {}", mixture.amount("water"));
    }
    let dry = acids().build().with(&[("OH-", 1e-2)]);
    assert_eq!(dry.amount("OH-"), 1e-2);
}

#[test]
fn what_is_absent_stays_away_whatever_moves() {
    let made = Sketch::new().equation("-1 HF 1 H+ 1 F-", -3.18, -13.3).equation("-1 water 1 H+ 1 OH-", -13.995, 55.8);
    let mixture = made.build().real().with(&[("water", WATER), ("OH-", 1e-3)]);
    let (system, layout) = (mixture.system.clone(), mixture.system.layout());
    let place = |name: &str| mixture.find(name) as usize;
    let part = Part::Amount(place("HF") as u32);
    let mut within: Vec<(f64, f64)> = mixture.args.iter().map(|a| (*a, *a)).collect();
    within[layout.capacity()] = (f64::INFINITY, f64::INFINITY);
    within[layout.heat()] = (0.0, 0.0);
    within[layout.reference()] = (298.0, 298.5);
    // Comparisons with it are decided at once: its trace does not show.
    assert_eq!(system.bounds_nearby(part, &within), (0.0, 0.0));
    assert_eq!(system.bounds(part, &within), (0.0, 0.0));
    // What brings some of it is followed all the same.
    let mut slopes = Vec::new();
    let args: Vec<f64> = within.iter().map(|a| a.0).collect();
    system.slopes(part, &args, &[layout.amount(place("F-")), layout.amount(place("H+"))], &mut slopes);
    assert!(slopes[0] > 0.0 && slopes[1] == 0.0, "{slopes:?}");
}

#[test]
fn little_of_a_solid_is_found_beside_much_of_its_parts() {
    // A hydroxide comes out of a strong solution of its salt, less and less of it: the acid that it sets free says how much.
    let made = Sketch::new()
        .equation("-1 water 1 H+ 1 OH-", -13.995, 55.8)
        .equation("-1 Me(OH)2(s) 1 Me++ 2 OH-", -19.36, 0.0)
        .equation("-1 H+ -1 SO4-- 1 HSO4-", 1.99, 0.0);
    let made = made.build();
    for n in 0..60 {
        let salt = 0.02 * 1.12f64.powi(n);
        let mixture = Mixture { system: made.system.clone(), args: made.args.clone() };
        let mixture = mixture.with(&[("water", WATER), ("Me++", salt), ("SO4--", salt)]);
        let solid = mixture.amount("Me(OH)2(s)");
        let acid = mixture.amount("H+") - mixture.amount("OH-") + mixture.amount("HSO4-");
        assert!((acid - 2.0 * solid).abs() <= 1e-9 * acid.abs(), "{salt}: {acid} {solid}");
    }
}

#[test]
fn a_total_that_rounding_leaves_below_nothing_is_followed() {
    let iodine =
        Sketch::new().equation("-1 water 1 H+ 1 OH-", -13.995, 55.8).equation("-1 I2 -1 I- 1 I3-", 2.86, 0.0).build();
    for excess in [1e-3, 1e-9, 2.9e-14, 1e-20, 0.0, -1e-20, -2.9e-14, -1e-9, -1e-3] {
        let mixture = Mixture { system: iodine.system.clone(), args: iodine.args.clone() };
        let mut mixture = mixture.real().with(&[("water", 6.71), ("I2", 1e-3), ("I-", 0.023), ("I3-", excess - 1e-3)]);
        let layout = mixture.system.layout();
        (mixture.args[layout.heat()], mixture.args[layout.capacity()]) = (0.168, 503.2);
        let [two, three] = ["I2", "I3-"].map(|name| mixture.amount(name));
        assert!((two + three - excess).abs() < 1e-12, "{excess}: {two} {three}");
    }
}
