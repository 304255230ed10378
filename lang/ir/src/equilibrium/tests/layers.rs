//! Two liquids: what is in the other one follows its mass, and leaves the ionic strength and the molality of the solvent alone.

use super::*;

/// Iodine and an acid between water and a liquid beside it; how much of that there is, kg.
fn extraction(liquid: f64) -> Mixture {
    let mixture = acids()
        .equation("-1 I2 -1 I- 1 I3-", 2.85, -17.0)
        .equation("-1 I2 1 I2(org)", 1.92, -5.0)
        .equation("-1 HAc 1 HAc(org)", -1.3, 4.0)
        .build();
    let mut mixture = mixture.with(&[("water", WATER), ("I2", 1e-2), ("I-", 0.1), ("HAc", 0.05)]);
    let layout = mixture.system.layout();
    mixture.args[layout.liquid(0)] = liquid;
    mixture.args[layout.liquid(1)] = liquid;
    mixture
}

#[test]
fn a_species_is_shared_out_by_its_constant() {
    let mixture = extraction(0.3);
    let kilograms = mixture.amount("water") * 0.018_015;
    let [two, out, three, ions] = ["I2", "I2(org)", "I3-", "I-"].map(|name| mixture.amount(name));
    assert!(((out / 0.3) / (two / kilograms) / 10f64.powf(1.92) - 1.0).abs() < 1e-9);
    assert!((three * kilograms / (two * ions) / 10f64.powf(2.85) - 1.0).abs() < 1e-9);
    assert!((two + out + three - 1e-2).abs() < 1e-14);
}

#[test]
fn without_the_liquid_all_stays_in_water() {
    for liquid in [0.0, -1e-6] {
        let mixture = extraction(liquid);
        assert!(mixture.amount("I2(org)").abs() < 1e-25);
        assert!((mixture.amount("I2") + mixture.amount("I3-") - 1e-2).abs() < 1e-14);
    }
}

#[test]
fn what_is_extracted_does_not_dilute_the_solvent() {
    let (dry, wet) = (extraction(0.0).real(), extraction(1e3).real());
    assert!(wet.amount("I2(org)") > 0.999e-2);
    let solvent = |mixture: &Mixture| mixture.system.value(Part::Activity(mixture.find("water")), &mixture.args);
    assert!(solvent(&wet) > solvent(&dry));
}

#[test]
fn slopes_are_those_of_differences() {
    for liquid in [1e-6, 3.0] {
        let plain = extraction(liquid).check_slopes("isothermal");
        let mut warm = extraction(liquid).real();
        let layout = warm.system.layout();
        warm.args[MOST] = 1.0;
        warm.args[layout.capacity()] = 4180.0;
        warm.args[layout.heat()] = 5e4;
        assert!(plain + warm.check_slopes("adiabatic") > 1_000);
    }
}
