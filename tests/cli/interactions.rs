//! Strong solutions: interactions between what is dissolved, and what the law of Pitzer makes of them.

use crate::harness::{flat, folder, matterixc_in, write};

/// A lab with one cup whose activities follow interactions.
fn cup(items: &str, holding: &str, expectations: &str) -> String {
    format!(
        "mtx 1\n{items}\nuse std::glassware::Beaker250mL
asset Cup: Beaker250mL {{ contents: {{ activities: pitzer }} }}
lab bench {{ ambient: 25 degC, cup = Cup at (0, 0, 0) m holding {holding} }}
workflow look in bench {{
    wait 1 s
{expectations}}}\n"
    )
}

fn runs(dir: &std::path::Path, items: &str, holding: &str, expectations: &str) {
    write(dir, "cup.mtx", cup(items, holding, expectations));
    let ran = matterixc_in(dir, &["run", "cup.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn strong_solutions_are_those_measured() {
    let dir = folder("brines");
    // Osmotic coefficients and solubilities of the CRC Handbook, at 25 degC where none is said; 0.1 mol/kg of HCl has a pH of 1.10.
    let cases = [
        ("100 g of water + 0.6 mol of NaCl", "osmotic_coefficient(cup.contents)", "1.265 .. 1.277"),
        ("100 g of water + 0.1 mol of NaCl", "osmotic_coefficient(cup.contents)", "0.932 .. 0.940"),
        ("100 g of water + 0.1 mol of Mg2+ + 0.2 mol of Cl-", "osmotic_coefficient(cup.contents)", "1.10 .. 1.12"),
        ("100 g of water + 80 g of NaCl", "cup.contents.amount[Na+] / (1 mol)", "0.610 .. 0.620"),
        ("100 g of water + 80 g of KCl", "cup.contents.amount[K+] / (1 mol)", "0.472 .. 0.484"),
        ("100 g of water + 10 mmol of HCl", "acidity(cup.contents)", "1.09 .. 1.11"),
        // 9.32 % and, at 60 degC, 13.7 % of the solution.
        ("100 g of water + 40 g of NaHCO3", "cup.contents.amount[Na+] / (1 mol)", "0.121 .. 0.124"),
        ("100 g of water + 40 g of NaHCO3 at 60 degC", "cup.contents.amount[Na+] / (1 mol)", "0.186 .. 0.191"),
    ];
    for (holding, asked, window) in cases {
        runs(&dir, "use std::brines", holding, &format!("    expect {asked} in {window}\n"));
    }
}

#[test]
fn ones_own_numbers_follow_the_temperature() {
    let dir = folder("own_interactions");
    let items = |b0: &str| {
        format!(
            "use std::equilibria\ninteraction salt: Na+ + Cl- {{ b0: {b0}, b1: 0.2664, c0: 0.00127, reach: [2, 12] }}"
        )
    };
    // At 25 degC a list is its first term; b0 = 0.0765 + 0.001 (T - T0) is that with 0.1015 at 50 degC.
    let brine = |warm: &str| format!("100 g of water + 0.3 mol of Na+ + 0.3 mol of Cl- at {warm}");
    let asked = |low: f64| format!("    expect osmotic_coefficient(cup.contents) in {low} .. {}\n", low + 4e-3);
    runs(&dir, &items("0.0765"), &brine("25 degC"), &asked(1.043));
    runs(&dir, &items("[0.0765, 0, 0, 0.001]"), &brine("25 degC"), &asked(1.043));
    let of = |b0: &str| {
        let text = cup(&items(b0), &brine("50 degC"), "    note \"phi {osmotic_coefficient(cup.contents) :.6}\"\n");
        // In a room as warm it stays so.
        write(&dir, "cup.mtx", text.replace("ambient: 25 degC", "ambient: 50 degC"));
        let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
        let at = ran.out.find("phi ").unwrap_or_else(|| panic!("{}{}", ran.out, ran.err));
        ran.out[at + 4..at + 12].to_owned()
    };
    assert_eq!(of("[0.0765, 0, 0, 0.001]"), of("0.1015"));
    assert_ne!(of("0.0765"), of("0.1015"));
}

#[test]
fn an_interaction_has_the_numbers_of_its_charges() {
    let dir = folder("interaction_form");
    let cases = [
        ("Na+ + Cl- { theta: 0.1 }", "interaction-form", "no `theta`"),
        ("Na+ + Cl- { source: \"a table\" }", "missing-field", "has no parameter"),
        ("Na+ + K+ { theta: 0.1, reach: [2, 12] }", "interaction-form", "no `reach`"),
        ("Na+ { b0: 0.1 }", "interaction-form", "two different species, or three"),
        ("Na+ + K+ + H+ { psi: 0.1 }", "interaction-form", "with both signs of charge"),
        ("2 Na+ + Cl- { b0: 0.1 }", "interaction-form", "must be between dissolved species"),
        ("water + Cl- { lambda: 0.1 }", "interaction-form", "`water` is not dissolved"),
        ("NaCl + Cl- { lambda: 0.1 }", "interaction-form", "`NaCl` is not dissolved"),
        ("Na+ + Unobtainium { lambda: 0.1 }", "unknown-name", "Unobtainium"),
        ("Na+ + Cl- { b0: [1, 2, 3, 4, 5, 6, 7] }", "interaction-form", "1 to 6 terms, not 7"),
        ("Na+ + Cl- { b0: 0.1, reach: [1] }", "interaction-form", "two numbers"),
        ("Na+ + Cl- { b0: 1 m }", "unit-mismatch", ""),
        ("Na+ + Cl- { b0: 0.1 }\ninteraction j: Cl- + Na+ { b0: 0.2 }", "interaction-form", "the same species"),
    ];
    for (written, code, why) in cases {
        write(&dir, "cup.mtx", cup(&format!("use std::equilibria\ninteraction i: {written}"), "100 g of water", ""));
        let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
        let said = flat(&format!("{}{}", checked.out, checked.err));
        assert!(checked.code == 1 && said.contains(code) && said.contains(why), "{written}: {said}");
    }
}

#[test]
fn ions_without_numbers_are_warned_of() {
    let dir = folder("interactions_unknown");
    let cases = [
        ("use std::brines", "100 g of water + 10 mmol of NaCl", ""),
        (
            "use std::equilibria",
            "100 g of water + 10 mmol of NaCl",
            "ignore the interaction of Na+ with an ion of opposite charge",
        ),
        ("use std::brines", "100 g of water + 10 mmol of KI", "ignore the interaction of K+"),
        ("use std::brines", "100 g of water + 0.7 mol of HCl", "an ionic strength of 7.00 mol/kg"),
    ];
    for (items, holding, why) in cases {
        write(&dir, "cup.mtx", cup(items, holding, "    expect acidity(cup.contents) < 13\n"));
        let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
        let said = flat(&checked.out);
        assert!(said.contains(why) && said.contains("no findings") == why.is_empty(), "{holding}: {said}");
    }
}

#[test]
fn salts_have_one_constant_in_a_file() {
    let dir = folder("two_constants");
    write(&dir, "cup.mtx", cup("use std::brines\nuse std::crystals", "100 g of water", ""));
    let checked = matterixc_in(&dir, &["check", "cup.mtx"]);
    let said = flat(&format!("{}{}", checked.out, checked.err));
    assert!(checked.code == 1 && said.contains("equilibria-contradict"), "{said}");
}
