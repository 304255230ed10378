//! Equilibria, from text to what a run makes of them, and databases that are imported.

use crate::harness::{flat, folder, matterixc, matterixc_in, root, write};

#[test]
fn acids_bases_buffers_and_salts_are_those_of_the_textbook() {
    for case in ["equilibria", "poured_together"] {
        let file = root().join(format!("tests/cases/{case}.mtx"));
        let ran = matterixc(&["run", file.to_str().expect("the path is text")]);
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    }
}

/// A lab with one cup, some equilibria before it.
fn cup(equilibria: &str, holding: &str, expectations: &str) -> String {
    format!(
        "mtx 1\n{equilibria}\nuse std::glassware::Beaker250mL
asset Cup: Beaker250mL {{ contents: {{ activities: debye_hueckel }} }}
lab bench {{ ambient: 25 degC, cup = Cup at (0, 0, 0) m holding {holding} }}
workflow look in bench {{
    wait 1 s
{expectations}}}\n"
    )
}

const WATER: &str = "equilibrium water_splits: water <-> H+ + OH- { log_constant: -14 }";

#[test]
fn constants_are_written_in_one_way_at_a_time() {
    let dir = folder("analytic");
    let wrong = [
        ("analytic: [1, 2, 3, 4, 5, 6, 7]", "equilibrium-form", "1 to 6 numbers, not 7"),
        ("analytic: [-14], enthalpy: 55 kJ/mol", "unknown-field", "`enthalpy` follows from `analytic`"),
        ("analytic: [-14], at: 20 degC", "unknown-field", "`at` follows from `analytic`"),
        ("analytic: [-14], log_constant: -14", "unknown-field", "has two constants"),
        ("analytic: 20 degC", "", "analytic"),
    ];
    for (constant, code, why) in wrong {
        let text = cup(&format!("equilibrium w: water <-> H+ + OH- {{ {constant} }}"), "100 g of water", "");
        write(&dir, "cup.mtx", text);
        let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
        let said = flat(&format!("{}{}", checked.out, checked.err));
        assert!(checked.code == 1 && said.contains(code) && said.contains(why), "{constant}: {said}");
    }
}

#[test]
fn an_analytic_constant_moves_with_temperature() {
    // log10 K of water by its analytic expression at 60 degC: -13.02, so that the pH is 6.51.
    let water = "equilibrium w: water <-> H+ + OH- {
    analytic: [293.29227, 0.1360833, -10576.913, -123.73158, 0, -6.996455e-5]\n}";
    let dir = folder("warm");
    write(
        &dir,
        "cup.mtx",
        cup(water, "100 g of water at 60 degC", "    expect acidity(cup.contents) in 6.50 .. 6.52\n"),
    );
    let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn ions_have_the_coefficients_of_their_size() {
    // 0.1 mol/kg of NaCl and 1 mmol/kg of HCl: -log10(0.001 gamma) with gamma by Truesdell and Jones, 9 angstrom: A = 0.51, B = 0.3285.
    let root_of_strength = 0.101_f64.sqrt();
    let ph = 3.0 + 0.51 * root_of_strength / (1.0 + 0.3285 * 9.0 * root_of_strength);
    let expected = format!("    expect acidity(cup.contents) in {:.4} .. {:.4}\n", ph - 5e-4, ph + 5e-4);
    let dir = folder("sizes_of_ions");
    write(&dir, "cup.mtx", cup(WATER, "1 g of water + 0.1 mmol of NaCl + 1 umol of HCl", &expected));
    let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn a_ph_that_the_equilibria_do_not_give_is_warned_of() {
    let dir = folder("cautions");
    let all = "use std::equilibria";
    let acid = "equilibrium acid: acetic_acid <-> H+ + acetate { pka: 4.756 }";
    let salty = "100 g of water + 10 mmol of acetic_acid + 120 mmol of NaCl";
    let cases = [
        (all, "100 g of water + 10 mmol of acetic_acid + 10 mmol of NaCl", ""),
        (all, salty, "an ionic strength of 1.20 mol/kg"),
        (all, "100 g of water + 10 mmol of ascorbic_acid", "ignores ascorbic_acid:"),
        (WATER, "100 g of water + 10 mmol of Na2CO3", "ignores CO3^2-:"),
        (acid, "100 g of water + 10 mmol of acetic_acid", "ignores the dissociation of water"),
        (WATER, "100 g of water at 60 degC", "is used at 60 degC"),
    ];
    for (equilibria, holding, why) in cases {
        write(&dir, "cup.mtx", cup(equilibria, holding, "    expect acidity(cup.contents) < 13\n"));
        let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
        let said = flat(&checked.out);
        assert!(said.contains(why) && said.contains("no findings") == why.is_empty(), "{holding}: {said}");
    }
}

#[test]
fn constants_that_close_at_one_temperature_only_contradict_each_other() {
    let dir = folder("enthalpies");
    let other = "equilibrium base: acetate + water <-> acetic_acid + OH- { log_constant: -9.244, enthalpy: 90 kJ/mol }";
    let text = format!("use std::equilibria\n{other}");
    write(&dir, "cup.mtx", cup(&text, "100 g of water", ""));
    let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
    let said = flat(&checked.out);
    assert!(checked.code == 1 && said.contains("agrees with the others at 25 degC, but differs by"), "{said}");
}

#[test]
fn what_is_known_of_a_mixture_stays_known_where_it_cools() {
    let dir = folder("cooling");
    write(&dir, "cup.mtx", cup("use std::equilibria", "100 g of water + 10 mmol of acetic_acid at 60 degC", ""));
    let checked = matterixc_in(&dir, &["check", "cup.mtx", "--contents", "--format", "json"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let plain = matterixc_in(&dir, &["check", "cup.mtx", "--contents"]);
    let after = plain.out.split("wait 1 s").nth(1).expect("the step").to_owned();
    assert!(after.contains("volume 100.8 .. 100.9 mL") && !after.contains("not known"), "{}", plain.out);
}

const DATABASE: &str = "SOLUTION_SPECIES
H+ = H+
	-gamma 9 0
H2O = H2O
Al+3 = Al+3
	-gamma 9 0
SO4-2 = SO4-2
H2O = OH- + H+
	-log_k -14; -delta_h 13.362 kcal
Al+3 + 4 H2O = Al(OH)4- + 4 H+
	-log_k -22.7; -delta_h 42.3 kcal
Al+3 + SO4-2 = AlSO4+
	-log_k 3.5
Fe+2 = Fe+3 + e-
	-log_k -13.02
PHASES
Gibbsite
	Al(OH)3 + 3 H+ = Al+3 + 3 H2O
	-log_k 8.11; -delta_h -22.8 kcal
	-Vm 32.22
";

#[test]
fn a_database_becomes_a_module_that_runs() {
    let dir = folder("database");
    write(&dir, "small.dat", DATABASE);
    let imported = matterixc_in(&dir, &["import", "phreeqc", "small.dat", "--phases", "Gibbsite", "-o", "small.mtx"]);
    assert_eq!(imported.code, 0, "{}", imported.err);
    assert!(imported.err.contains("its reaction contains electrons: Fe+3 (line 14)"), "{}", imported.err);
    assert_eq!(matterixc_in(&dir, &["fmt", "--check", "small.mtx"]).code, 0);
    let expect = "    expect cup.contents.amount[Gibbsite(s)] in 0.9 mmol .. 1 mmol
    expect acidity(cup.contents) in 6 .. 8\n";
    let holding = "100 g of water + 1 mmol of Al3+ + 3 mmol of Cl- + 3 mmol of NaOH";
    write(&dir, "cup.mtx", cup("use small", holding, expect));
    let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    // Without the phase nothing precipitates.
    let plain = matterixc_in(&dir, &["import", "phreeqc", "small.dat"]);
    assert!(plain.code == 0 && !plain.out.contains("(s)") && plain.err.contains("Gibbsite (line 18)"), "{}", plain.err);
}

#[test]
fn a_database_that_cannot_be_read_leaves_nothing_behind() {
    let dir = folder("no_database");
    let wrong = [
        ("SOLUTION_SPECIES\nH+ = H+\n\t-log_k\n", vec![], "wrong.dat:3: `-log_k` lacks a number"),
        ("hello\n", vec![], "not a database of PHREEQC"),
        (DATABASE, vec!["--phases", "Quartz"], "it has no phase `Quartz`"),
        (DATABASE, vec!["--elements", "Xe"], "it has no element `Xe`"),
    ];
    for (text, more, why) in wrong {
        write(&dir, "wrong.dat", text);
        let mut args = vec!["import", "phreeqc", "wrong.dat", "-o", "out.mtx"];
        args.extend(more);
        let ended = matterixc_in(&dir, &args);
        assert!(ended.code == 1 && flat(&ended.err).contains(why), "{}", ended.err);
        assert!(!dir.join("out.mtx").exists());
    }
    assert_eq!(matterixc_in(&dir, &["import", "phreeqc", "absent.dat"]).code, 2);
    assert_eq!(matterixc_in(&dir, &["import", "gems", "wrong.dat"]).code, 2);
}

#[test]
fn half_cells_take_up_what_others_give() {
    let dir = folder("half-cells");
    let iron =
        format!("{WATER}\nuse std::half_cells::Ag(s)\nequilibrium iron: Fe3+ + e- <-> Fe2+ {{ potential: 0.771 V }}");
    let ran = |name: &str, text: String| {
        write(&dir, name, text);
        matterixc_in(&dir, &["run", name])
    };
    let expected = "    expect redox_potential(cup.contents) in 0.770 V .. 0.772 V\n";
    let half = cup(&iron, "100 g of water + 1 umol of Fe2+ + 1 umol of Fe3+ + 5 umol of Cl-", expected);
    let half = ran("half.mtx", half.replace("debye_hueckel", "ideal").replace("use std::half_cells::Ag(s)\n", ""));
    assert_eq!(half.code, 0, "{}{}", half.out, half.err);
    // Cerium with its potential in sulfuric acid oxidises all the iron that it can.
    let cerium = "species Ce3+ { formula: \"Ce^3+\", molar_volume: 0 mL/mol, heat_capacity: 0 J/(mol*K) }
species Ce4+ { formula: \"Ce^4+\", molar_volume: 0 mL/mol, heat_capacity: 0 J/(mol*K) }
equilibrium iron: Fe3+ + e- <-> Fe2+ { potential: 0.771 V }
equilibrium cerium: Ce4+ + e- <-> Ce3+ { potential: 1.44 V }";
    let titrated = "    expect cup.contents.amount[Fe3+] in 0.9999 umol .. 1.0001 umol
    expect redox_potential(cup.contents) in 1.43 V .. 1.45 V\n";
    let done = cup(cerium, "100 g of water + 1 umol of Fe2+ + 2 umol of Ce4+ + 10 umol of Cl-", titrated);
    let done = ran("done.mtx", done.replace("debye_hueckel", "ideal"));
    assert_eq!(done.code, 0, "{}{}", done.out, done.err);
    // A potential is that of a reduction; a reaction has no electrons; nothing holds any.
    let wrong = [
        (cup("equilibrium iron: Fe2+ <-> Fe3+ + e- { potential: 0.771 V }", "100 g of water", ""), "equilibrium-form"),
        (cup("reaction iron: Fe3+ + e- -> Fe2+ { rate: 1 1/s }", "100 g of water", ""), "equilibrium-form"),
        (cup("", "100 g of water + 1 mmol of e-", ""), "equilibrium-form"),
    ];
    for (text, code) in wrong {
        write(&dir, "wrong.mtx", text);
        let checked = matterixc_in(&dir, &["check", "--no-cache", "wrong.mtx"]);
        assert_eq!(checked.code, 1, "{code}: {}{}", checked.out, checked.err);
        assert!(
            flat(&checked.err).contains(code) || flat(&checked.out).contains(code),
            "{code}: {}{}",
            checked.out,
            checked.err
        );
    }
}
