//! The equilibria of the library: textbook figures, and what is warned of with and without them.

use crate::harness::{flat, folder, matterixc_in, pass_cases, write};

#[test]
fn buffers_have_the_ph_of_their_standards() {
    pass_cases("ph_standards.mtx", &["look"]);
}

#[test]
fn metals_dissolve_precipitate_and_are_bound_as_in_handbooks() {
    pass_cases("metals.mtx", &["look"]);
}

#[test]
fn acids_of_which_little_dissolves_come_out_as_solids() {
    pass_cases("solid_acids.mtx", &["look"]);
}

#[test]
fn saltpetre_crystallises_on_cooling_with_its_yield() {
    pass_cases("crystals.mtx", &["recrystallise"]);
}

/// What a check says of a cup whose pH is asked for.
fn said_of(dir: &std::path::Path, uses: &str, cup: &str, holding: &str) -> String {
    let text = format!(
        "mtx 1\n{uses}\nuse std::glassware::Beaker250mL\nasset Cup: Beaker250mL {{ {cup} }}
lab bench {{ ambient: 25 degC, cup = Cup at (0, 0, 0) m holding {holding} }}
workflow look in bench {{
    wait 1 s
    expect acidity(cup.contents) < 14
}}\n"
    );
    write(dir, "cup.mtx", text);
    flat(&matterixc_in(dir, &["check", "cup.mtx"]).out)
}

#[test]
fn cautions_of_acids_fall_silent_with_the_modules_that_have_them() {
    let dir = folder("equilibria_data_cautions");
    let cases = [
        ("use std::equilibria", "100 g of water + 10 mmol of CuSO4", "ignores Cu2+:"),
        ("use std::metals", "100 g of water + 10 mmol of CuSO4", ""),
        ("use std::equilibria", "100 g of water + 10 mmol of pyridine", "ignores pyridine:"),
        ("use std::acids", "100 g of water + 10 mmol of pyridine", ""),
        ("use std::acids", "100 g of water + 10 mmol of Et3N", ""),
        (
            "use std::equilibria\nuse std::buffers",
            "100 g of water + 10 mmol of citric_acid_monohydrate + 5 mmol of MES",
            "",
        ),
        ("use std::complexes", "100 g of water + 1 mmol of EDTA_disodium_dihydrate + 1 mmol of CaCO3", ""),
    ];
    for (uses, holding, why) in cases {
        let said = said_of(&dir, uses, "", holding);
        assert!(said.contains(why) && said.contains("no findings") == why.is_empty(), "{uses}, {holding}: {said}");
    }
}

#[test]
fn a_salt_that_an_equilibrium_keeps_is_not_said_to_be_left_in_solution() {
    let dir = folder("equilibria_data_salts");
    let cases = [
        ("", "100 g of water + 60 g of NaCl", "holds more NaCl than dissolves"),
        ("use std::crystals", "100 g of water + 60 g of NaCl", ""),
        // What crystallises is gypsum, and soda with its water.
        ("use std::solids", "100 g of water + 5 mmol of CaSO4", ""),
        ("use std::crystals\nuse std::salts", "100 g of water + 60 g of Na2CO3", ""),
    ];
    for (uses, holding, why) in cases {
        let said = said_of(&dir, uses, "", holding);
        let found = said.contains("than dissolves");
        assert!(said.contains(why) && found != why.is_empty(), "{uses}, {holding}: {said}");
    }
}

#[test]
fn crystals_hold_by_the_law_of_davies_only() {
    let dir = folder("equilibria_data_davies");
    let salt = "100 g of water + 60 g of NaCl";
    let other = said_of(&dir, "use std::crystals", "contents: { activities: debye_hueckel }", salt);
    assert!(other.contains("hold with `activities: davies` only"), "{other}");
    let davies = said_of(&dir, "use std::crystals", "", salt);
    assert!(!davies.contains("hold with `activities: davies` only"), "{davies}");
}

#[test]
fn potassium_sulfate_dissolves_by_pitzer_as_the_handbook_has_it() {
    let dir = folder("equilibria_data_sulfate");
    // 7.11, 10.7 and 15.5 % by mass at 0, 25 and 60 degC (CRC Handbook, 98th ed.).
    let cases = [(0, 43.9), (25, 68.8), (60, 105.3)];
    for (celsius, dissolved) in cases {
        let text = format!(
            "mtx 1
use std::brines
use std::salts
use std::glassware::Beaker250mL
asset Brine: Beaker250mL {{ contents: {{ activities: pitzer }} }}
lab bench {{
    ambient: 25 degC
    cup = Brine at (0, 0, 0) m holding 100 g of water + 30 g of potassium_sulfate at {celsius} degC
}}
workflow look in bench {{
    wait 1 ms
    expect cup.contents.amount[SO4^2-] in {} mmol .. {} mmol
}}
",
            0.98 * dissolved,
            1.02 * dissolved
        );
        write(&dir, "brine.mtx", text);
        let ended = matterixc_in(&dir, &["run", "brine.mtx"]);
        assert!(ended.code == 0, "{celsius}: {}{}", ended.out, ended.err);
    }
}

#[test]
fn an_equilibrium_without_a_constant_is_told_by_its_species() {
    let dir = folder("equilibria_data_range");
    let said = said_of(&dir, "use std::acids", "", "100 g of water + 1 mmol of aspirin at 90 degC");
    assert!(said.contains("where an equilibrium of acetylsalicylate has no constant"), "{said}");
    let water = said_of(&dir, "use std::equilibria", "", "100 g of water + 1 mmol of H3PO4 at 25 degC");
    assert!(!water.contains("has no constant"), "{water}");
}
