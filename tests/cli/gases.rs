//! Gases above water and in it: Henry's law, vessels that exchange gases, and what is said where none do.

use crate::harness::{flat, folder, matterixc_in, write};

/// A lab with one cup, `open` to gases where its kind says so.
fn lab(before: &str, kind: &str, holding: &str, steps: &str) -> String {
    format!(
        "mtx 1\nuse std::glassware::Beaker250mL\n{before}
asset Cup: Beaker250mL{kind}
lab bench {{ ambient: 25 degC, cup = Cup at (0, 0, 0) m holding {holding} }}
workflow look in bench {{
    wait 1 s
{steps}}}\n"
    )
}

const OPEN: &str = ", GasExchange { contents: { activities: ideal }, exchange_rate: 10 1/h }";

#[track_caller]
fn runs(name: &str, text: String) {
    let dir = folder(name);
    write(&dir, "cup.mtx", text);
    let ran = matterixc_in(&dir, &["run", "cup.mtx", "--no-cache"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn henrys_law_says_the_pressure_of_what_is_dissolved() {
    // 2 mmol in 100 g of water at K = 0.04 mol/(kg bar): 0.5 bar; 12 kJ/mol at 35 degC: half as much again as by van 't Hoff.
    let gas = "species X(g) { formula: \"N2\" }
equilibrium x: X(g) <-> N2 { constant: 0.04, enthalpy: -12 kJ/mol }";
    let warmer = (12e3_f64 / 8.314_462_6 * (1.0 / 298.15 - 1.0 / 308.15)).exp() * 0.5;
    let cool = "    expect gas_pressure(cup.contents, X(g)) in 0.4999 bar .. 0.5001 bar\n";
    runs("henry", lab(gas, " { contents: { activities: ideal } }", "100 g of water + 2 mmol of N2", cool));
    let warm = format!(
        "    expect gas_pressure(cup.contents, X(g)) in {:.4} bar .. {:.4} bar\n",
        warmer - 1e-3,
        warmer + 1e-3
    );
    runs(
        "henry_warm",
        lab(gas, " { contents: { activities: ideal } }", "100 g of water + 2 mmol of N2 at 35 degC", &warm),
    );
    // Salt drives it out: log10 of the coefficient is 0.1 per mol/kg.
    let salty = "    expect gas_pressure(cup.contents, X(g)) in 0.560 bar .. 0.562 bar\n";
    runs("henry_salt", lab(gas, "", "100 g of water + 2 mmol of N2 + 50 mmol of Na+ + 50 mmol of Cl-", salty));
}

#[test]
fn constants_agree_with_the_solubilities_of_the_species() {
    let one = |gas: &str, of: &str| {
        format!("    expect abs(henry({gas}(g), 298.15 K) * 1.01325 * (1 mol/kg) / {of}.gas_solubility - 1) < 0.03\n")
    };
    let steps: String = [("CO2", "CO2"), ("O2", "O2"), ("N2", "N2"), ("H2", "H2")].map(|(g, of)| one(g, of)).concat();
    runs("solubilities", lab("use std::gases", "", "100 g of water", &steps));
}

#[test]
fn water_in_air_goes_to_ph_5_6() {
    // [H+]^2 = K1 K p, with K1 = 10^-6.352, K = 10^-1.474 per bar and p = 41.7 Pa.
    let ph = 0.5 * (6.352 + 1.474 - (41.746e-5_f64).log10());
    let steps = format!(
        "    wait 10 h\n    expect acidity(cup.contents) in {:.3} .. {:.3}\n    expect gas_pressure(cup.contents, O2(g)) in 21.1 kPa .. 21.3 kPa\n",
        ph - 4e-3,
        ph + 4e-3
    );
    runs("air", lab("use std::gases", OPEN, "100 g of water", &steps));
}

#[test]
fn soda_with_acid_gives_off_its_carbon_dioxide_and_its_heat() {
    // 8 of 10 mmol are freed: 3.4 mmol stay under 1 atm. Half an hour in air takes nearly all of them. Each mole takes up 20 kJ.
    let steps = "    wait 30 s
    expect gas_pressure(cup.contents, CO2(g)) in 85 kPa .. 103 kPa
    wait 2 h
    expect cup.gone[CO2] in 8 mmol .. 8.2 mmol
    expect acidity(cup.contents) > 8
    expect cup.contents.mass in 100.77 g .. 100.78 g\n";
    // 100 g, 840 mg and 292 mg, less 8.1 mmol of 44 g/mol.
    runs("soda", lab("use std::gases", OPEN, "100 g of water + 10 mmol of NaHCO3 + 8 mmol of HCl", steps));
    let cold = "    wait 10 s
    expect cup.contents.temperature in 24.6 degC .. 25.1 degC
    wait 10 min
    expect cup.contents.temperature < 25 degC\n";
    runs("soda_cold", lab("use std::gases", OPEN, "100 g of water + 10 mmol of CO2", cold));
}

#[test]
fn sulfur_dioxide_takes_up_water_and_ammonia_leaves() {
    let steps = "    wait 5 h
    expect cup.contents.amount[sulfurous_acid] + cup.contents.amount[HSO3-] < 1 umol
    expect cup.contents.amount[NH3] < 1 umol\n";
    runs(
        "leaving_acid",
        lab(
            "use std::equilibria\nuse std::gases",
            &OPEN.replace("10 1/h", "20 1/s"),
            "100 g of water + 1 mmol of sulfurous_acid",
            steps,
        ),
    );
    runs(
        "leaving_base",
        lab(
            "use std::equilibria\nuse std::gases",
            &OPEN.replace("10 1/h", "20 1/s"),
            "100 g of water + 1 mmol of NH3",
            steps,
        ),
    );
}

#[test]
fn a_sparger_drives_out_what_is_dissolved() {
    let text = lab(
        "use std::gases",
        OPEN,
        "100 g of water + 1 mmol of CO2",
        "    sparge by frit
    wait 30 min
    stop sparging by frit
    expect gas_pressure(cup.contents, CO2(g)) < 100 Pa
    expect gas_pressure(cup.contents, N2(g)) in 90 kPa .. 103 kPa\n",
    );
    runs(
        "sparger",
        text.replace("}\nworkflow", ", frit = GlassFrit { vessel: cup, gas: N2(g) } }\nworkflow")
            .replace(" }, frit", ", frit"),
    );
}

#[test]
fn a_vessel_that_is_closed_to_gases_is_warned_of() {
    let dir = folder("gas_cautions");
    let acid = "100 g of water + 10 mmol of NaHCO3 + 8 mmol of HCl";
    let cases = [
        ("use std::gases", "", acid, "gases would bubble out of `cup`"),
        ("use std::gases", "", "100 g of water + 2 mmol of CO2", ""),
        ("use std::gases", OPEN, acid, ""),
        ("use std::equilibria", "", acid, "gets more CO2 than stays dissolved"),
        ("use std::equilibria", "", "100 g of water + 10 mmol of CO2", "gets more CO2 than stays dissolved"),
        ("use std::gases", OPEN, "100 g of water + 500 mmol of NH3", "too much NH3(g) for Henry's law"),
        ("use std::gases", OPEN, "100 g of water at 70 degC", "the solubility of H2S(g) is unknown"),
    ];
    for (uses, kind, holding, why) in cases {
        write(&dir, "cup.mtx", lab(uses, kind, holding, ""));
        let checked = matterixc_in(&dir, &["check", "cup.mtx", "--no-cache"]);
        let said = flat(&checked.out);
        assert!(
            said.contains(why) && said.contains("no findings") == why.is_empty(),
            "{uses}{kind}, {holding}: {said}"
        );
    }
}

#[test]
fn a_gas_stands_in_its_own_equilibrium_alone() {
    let dir = folder("gas_forms");
    let gases = "use std::equilibria\nspecies CO2(g) { formula: \"CO2\" }\nspecies O2(g) { formula: \"O2\" }\nspecies CO2(s) { formula: \"CO2\" }";
    let wrong = [
        ("CO2(g) <-> CO2(s)", "`CO2(s)` is not a neutral dissolved species"),
        ("CO2(g) + O2(g) <-> CO2 + O2", "its right side is not one dissolved species"),
        ("CO2(g) + water <-> H+ + HCO3-", "its right side is not one dissolved species"),
        ("CO2 <-> CO2(g)", "its left side is not one gas"),
        ("2 CO2(g) <-> 2 CO2", "both coefficients must be 1"),
        ("CO2(g) <-> O2", "does not balance"),
    ];
    let said = |text: String| {
        write(&dir, "cup.mtx", text);
        let checked = matterixc_in(&dir, &["check", "cup.mtx", "--no-cache"]);
        assert_eq!(checked.code, 1, "{}{}", checked.out, checked.err);
        flat(&format!("{}{}", checked.out, checked.err))
    };
    for (equation, why) in wrong {
        let found = said(lab(
            &format!("{gases}\nequilibrium x: {equation} {{ log_constant: -1.5 }}"),
            "",
            "100 g of water",
            "",
        ));
        assert!(found.contains(why), "{equation}: {found}");
    }
    let twice =
        "equilibrium x: CO2(g) <-> CO2 { log_constant: -1.5 }\nequilibrium y: CO2(g) <-> CO2 { log_constant: -1.4 }";
    assert!(said(lab(&format!("{gases}\n{twice}"), "", "100 g of water", "")).contains("has two equilibria"));
    let ksp = "equilibrium x: CO2(g) <-> CO2 { ksp: 0.03 }";
    assert!(said(lab(&format!("{gases}\n{ksp}"), "", "100 g of water", "")).contains("its left side is not one solid"));
    let reaction = "use std::gases\nreaction r: CO2(g) -> CO2 { rate: 1 1/s }";
    assert!(said(lab(reaction, "", "100 g of water", "")).contains("contains the gas `CO2(g)`"));
    let held = lab("use std::gases", "", "100 g of water + 1 mmol of CO2(g)", "");
    assert!(said(held).contains("a vessel cannot hold `CO2(g)`"));
    let read = lab("use std::gases", "", "100 g of water", "    expect cup.contents.amount[CO2(g)] < 1 mol\n");
    assert!(said(read).contains("a vessel cannot hold `CO2(g)`"));
    let plain = lab("use std::gases", "", "100 g of water", "    expect gas_pressure(cup.contents, CO2) < 1 bar\n");
    assert!(said(plain).contains("no equilibrium of this file contains `CO2` as a gas"));
    let pressures = OPEN.replace(" exchange_rate", " gases: [CO2(g)], pressures: [1 bar, 2 bar], exchange_rate");
    assert!(said(lab("use std::gases", &pressures, "100 g of water", "")).contains("1 gases above it and 2 pressures"));
}
