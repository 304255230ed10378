//! `matterixc substance`.

use std::fmt::Write as _;

use serde_json::Value;

use crate::harness::{flat, folder, matterixc, write};

fn asked(args: &[&str]) -> String {
    let ended = matterixc(&[&["substance"], args].concat());
    assert_eq!((ended.code, ended.err.as_str()), (0, ""), "{args:?}");
    ended.out
}

#[test]
fn a_substance_is_found_by_name_alias_formula_number_and_structure() {
    for word in ["EtOAc", "ethyl_acetate", "Ethyl acetate", "141-78-6", "CCOC(C)=O", "O(CC)C(=O)C"] {
        let page = asked(&[word]);
        assert!(page.starts_with("EtOAc\n"), "{word}: {page}");
    }
    assert!(asked(&["Na2CO3"]).starts_with("Na2CO3\n"));
    // The order of atoms in a formula does not matter.
    assert!(asked(&["COH4N2"]).starts_with("urea\n"));
}

#[test]
fn a_substance_is_found_by_what_its_label_says() {
    let labels = [
        ("Sulphuric acid", "H2SO4"),
        ("hydrochloric acid", "HCl"),
        ("calcium carbonate", "CaCO3"),
        ("sodium bicarbonate", "NaHCO3"),
        ("baking soda", "NaHCO3"),
        ("table salt", "NaCl"),
        ("bleach", "NaOCl"),
        ("vinegar", "acetic_acid"),
        ("Epsom salt", "magnesium_sulfate_heptahydrate"),
        ("7447-41-8", "lithium_chloride"),
        ("77-86-1", "tris"),
    ];
    for (label, name) in labels {
        let page = asked(&[label]);
        assert!(page.starts_with(&format!("{name}\n")), "{label}: {page}");
    }
    let several = asked(&["copper sulfate"]);
    assert!(several.starts_with("2 substances have the name `copper sulfate`:\n"), "{several}");
    assert!(asked(&["ferric chloride"]).contains("iron_III_chloride_hexahydrate"));
}

#[test]
fn every_number_is_printed_with_its_source_in_full() {
    let page = asked(&["acetone"]);
    for line in [
        "  formula               C3H6O\n",
        "  molar mass            58.080 g/mol\n",
        "  CAS                   67-64-1\n",
        "  boiling point         56.1 degC  [crc]\n",
        "  flash point           -20 degC  [iec]\n",
        "  to use it             no import needed: every file sees std::species\n",
    ] {
        assert!(page.contains(line), "{line}{page}");
    }
    assert!(flat(&page).contains("[crc] CRC Handbook of Chemistry and Physics, 95th ed. (2014)"), "{page}");
    let untagged = asked(&["sucrose"]);
    assert!(
        untagged.contains("424.3 J/(mol*K)  (Putnam and Boerio-Goates, J. Chem. Thermodyn. 25 (1993) 607.)"),
        "{untagged}"
    );
    let dioxane = asked(&["1,4-dioxane"]);
    assert!(dioxane.contains("`use std::substances`, or `use std::substances::dioxane`"), "{dioxane}");
}

/// The lines below a heading of a page.
fn below<'a>(page: &'a str, heading: &str) -> &'a str {
    let after = page.split_once(heading).unwrap_or_else(|| panic!("no `{heading}`: {page}")).1;
    after.split("\n\n").next().unwrap_or_default()
}

#[test]
fn its_equilibria_are_listed_with_their_constants() {
    let page = asked(&["acetic_acid"]);
    let acids = below(&page, "Equilibria, acids and bases:\n");
    assert_eq!(
        acids,
        "  acetic_acid <-> H+ + acetate (std::equilibria)\n      pKa 4.756 at 25 degC, enthalpy -0.41 kJ/mol, valid 0 degC .. 60 degC [gkl]"
    );
    assert!(flat(&page).contains("[gkl] Goldberg, Kishore and Lennen"), "{page}");
    // One that is given at every temperature, of a gas, and of an acid.
    let page = asked(&["CO2"]);
    assert!(below(&page, "Equilibria, gases:\n").contains("      log K -1.474 at 25 degC"), "{page}");
    assert!(below(&page, "Equilibria, acids and bases:\n").contains("      pKa 6.352 at 25 degC"), "{page}");
    let page = asked(&["zinc_sulfate_heptahydrate"]);
    assert!(below(&page, "Equilibria, half-cells:\n").contains("E -0.763 V at 25 degC"), "{page}");
    assert!(!asked(&["naphthalene"]).contains("Equilibria"));
}

#[test]
fn equilibria_of_the_ions_of_a_salt_follow_its_own() {
    let page = asked(&["AgCl"]);
    let solids = below(&page, "Equilibria, solubility:\n");
    assert!(solids.starts_with("  AgCl <-> Ag+ + Cl- (std::equilibria)\n      pKsp 9.75 at 25 degC"), "{page}");
    assert!(solids.contains("  AgBr <-> Ag+ + Br- (std::solids, of Ag+)\n"), "{page}");
    // Numbers of several sources name each, in full below.
    let complexes = below(&page, "Equilibria, complexes:\n");
    assert!(complexes.contains("[wat] [sit]"), "{page}");
    assert!(flat(&page).contains("[sit] sit.dat of PHREEQC 3"), "{page}");
    // Six of a kind, and how to see the others.
    assert_eq!(complexes.matches("log K").count(), 6, "{page}");
    let said = complexes.lines().last().expect("lines");
    let more: usize = said.trim().split(' ').nth(1).and_then(|n| n.parse().ok()).expect("a number");
    assert_eq!(said, format!("  and {more} more: `--all` shows them"));
    let all = asked(&["AgCl", "--all"]);
    assert_eq!(below(&all, "Equilibria, complexes:\n").matches("log K").count(), 6 + more, "{all}");
    // What water and its ions do says nothing of a base.
    assert!(!asked(&["NaOH"]).contains("of OH-"));
}

#[test]
fn constants_are_there_for_programs() {
    let object: Value = serde_json::from_str(&asked(&["NaCl", "--format", "json"])).expect("it is JSON");
    let all = object["substances"][0]["equilibria"].as_array().expect("a list");
    let of = |name: &str| all.iter().find(|e| e["name"] == name).unwrap_or_else(|| panic!("{name}: {all:?}"));
    let own = of("NaCl_dissolves");
    assert_eq!(
        (&own["kind"], &own["ion"], &own["module"]),
        (&"solubility".into(), &Value::Null, &"std::brines".into())
    );
    assert_eq!((&own["constant"]["symbol"], &own["constant"]["value"]), (&"log K".into(), &"1.582".into()));
    let pair = of("NaSO4_forms");
    assert_eq!(
        (&pair["kind"], &pair["ion"], &pair["constant"]["at"]),
        (&"complexes".into(), &"Na+".into(), &"25 degC".into())
    );
    assert_eq!((&pair["enthalpy"], &pair["valid"]), (&"4.69 kJ/mol".into(), &"0 degC .. 60 degC".into()));
    assert_eq!(pair["sources"][0]["tag"], "wat");
    assert!(all.len() > 20, "{}", all.len());
}

#[test]
fn an_equilibrium_of_a_file_is_shown_as_it_states_it() {
    let text = "mtx 1\nspecies HIn { formula: \"C8H9NO2\" }\nspecies In- { formula: \"C8H8NO2-\" }\nequilibrium turns: HIn <-> H+ + In- { pka: 7.1, at: 20 degC, source: \"our notebook\" }\n\
                equilibrium worked_out: 2 HIn <-> H+ + HIn + In- { analytic: [1 / 3, 2] }\n";
    let file = write(&folder("substance_equilibria"), "own.mtx", text);
    let page = asked(&["HIn", "--file", &file]);
    let acids = below(&page, "Equilibria, acids and bases:\n");
    assert!(acids.contains("      pKa 7.1 at 20 degC (our notebook)"), "{page}");
    // What is no list of plain numbers is shown as written.
    assert!(page.contains("[1 / 3, 2] at T in K"), "{page}");
}

#[test]
fn a_salt_is_no_ion_of_the_same_letters() {
    let page = asked(&["FeSO4"]);
    assert!(!page.contains("FeSO4+\n"), "{page}");
    assert!(page.contains("As a formula without its water `FeSO4` is:\n  iron_II_sulfate_heptahydrate"), "{page}");
}

#[test]
fn a_formula_of_several_lists_them_all() {
    let list = asked(&["C2H6O"]);
    assert!(list.starts_with("2 substances have the formula `C2H6O`:\n"), "{list}");
    assert!(
        list.contains("  EtOH ") && list.contains("  dimethyl_ether  Methoxymethane (std::substances)\n"),
        "{list}"
    );
    // A name goes before a structure that is written alike.
    let both = asked(&["CO"]);
    assert!(both.starts_with("CO\n") && both.contains("As a structure `CO` is:\n  MeOH "), "{both}");
}

#[test]
fn the_answer_is_an_object_for_programs() {
    let object: Value = serde_json::from_str(&asked(&["67-64-1", "--format", "json"])).expect("it is JSON");
    assert_eq!((&object["by"], &object["substances"][0]["name"]), (&"CAS number".into(), &"acetone".into()));
    let properties = object["substances"][0]["properties"].as_array().expect("a list");
    let density = properties.iter().find(|p| p["property"] == "density").expect("it has one");
    assert_eq!((&density["value"], &density["source"]["tag"]), (&"0.7845 g/mL".into(), &"crc".into()));
    assert!(density["source"]["text"].as_str().is_some_and(|t| t.contains("CRC Handbook")), "{density}");
}

#[test]
fn an_unknown_name_suggests_near_ones() {
    let ended = matterixc(&["substance", "dioxan"]);
    assert_eq!((ended.code, ended.out.as_str()), (1, ""));
    assert_eq!(ended.err, "error: unknown substance `dioxan`\nhelp: did you mean `dioxane`?\n");
    let ended = matterixc(&["substance", "qqqqqqqqqqqqqqqqqq"]);
    assert_eq!(ended.code, 1);
    assert!(ended.err.contains("help: give a name, a formula, a CAS number or a SMILES"), "{}", ended.err);
}

#[test]
fn a_file_brings_its_own_species() {
    let text = "mtx 1\n//! Ours.\n//!\n//! - `[we]` weighed by us.\n\n/// A dye.\nspecies ours {\n    formula: \"C9H8O4\"\n    density: 1.2 g/mL  // [we]\n}\n";
    let file = write(&folder("substance"), "own.mtx", text);
    let page = asked(&["ours", "--file", &file]);
    assert!(page.contains("1.2 g/mL  [we]\n") && page.contains("  [we] weighed by us.\n"), "{page}");
    assert!(page.contains(&format!("declared in {file}")), "{page}");
    assert_eq!(matterixc(&["substance", "ours", "--file", "nothing_here.mtx"]).code, 2);
}

/// A lab whose beaker holds 10 mL of something.
fn lab(head: &str, holding: &str) -> String {
    let mut text = format!("mtx 1\n{head}use std::glassware::Beaker250mL\nlab bench {{\n    ambient: 22 degC\n");
    writeln!(text, "    table = OpticalTable at (0, 0, 0) m\n    cup = Beaker250mL on table holding {holding}\n}}")
        .expect("text");
    text + "workflow stay in bench {\n    wait 60 s\n}\n"
}

#[test]
fn a_substance_that_is_not_imported_is_offered_with_its_import() {
    let dir = folder("substance_import");
    let without = write(&dir, "without.mtx", lab("", "10 mL of dioxane"));
    let ended = matterixc(&["check", &without]);
    assert_eq!(ended.code, 1);
    assert!(
        flat(&ended.out).contains("it is declared in `std::substances`: add `use std::substances::dioxane`"),
        "{}",
        ended.out
    );
    assert_eq!(matterixc(&["check", "--fix", &without]).code, 0);
    let mended = std::fs::read_to_string(&without).expect("it is there");
    assert!(mended.contains("use std::substances::dioxane\n"), "{mended}");
    let with = write(&dir, "with.mtx", lab("use std::substances\n", "10 mL of dioxane + 3 g of naphthalene"));
    assert_eq!(matterixc(&["check", &with]).code, 0);
    let wrong = write(&dir, "wrong.mtx", lab("use std::substances::dioxan\n", "10 mL of water"));
    let ended = matterixc(&["check", &wrong]);
    assert!(flat(&ended.out).contains("`dioxane`"), "{}", ended.out);
}

/// What a check says of a species that is not declared.
fn told(name: &str) -> String {
    let file =
        write(&folder("substance_kin"), &format!("{name}.mtx"), lab("", &format!("10 mL of water + 1 mmol of {name}")));
    let ended = matterixc(&["check", &file]);
    assert_eq!(ended.code, 1, "{name}: {}", ended.out);
    flat(&ended.out)
}

#[test]
fn a_formula_is_answered_by_the_substance_that_has_it() {
    for (formula, name) in [
        ("NaH2PO4", "std::salts::sodium_dihydrogen_phosphate"),
        ("Na2HPO4", "std::salts::disodium_hydrogen_phosphate"),
        ("CaCl2", "std::salts::calcium_chloride"),
        ("MgSO4", "std::salts::magnesium_sulfate"),
        ("FeCl3", "std::salts::iron_III_chloride"),
        ("K2Cr2O7", "std::equilibria::potassium_dichromate"),
    ] {
        let (said, last) = (told(formula), name.rsplit("::").next().expect("a name"));
        assert!(said.contains(&format!("`{last}` (`use {name}`) has this formula")), "{formula}: {said}");
        assert!(!said.contains("did you mean"), "{formula}: {said}");
    }
    // By the letters dichloromethane is near.
    assert!(!told("CaCl2").contains("CH2Cl2"));
    // Hydrates are offered as such, and names by which chemists call a substance.
    assert!(told("Na3PO4").contains(
        "`trisodium_phosphate_dodecahydrate` (`use std::salts::trisodium_phosphate_dodecahydrate`) is a hydrate of it"
    ));
    assert!(told("Tris").contains("`tris` (`use std::equilibria::tris`) is also called that"));
    assert!(told("CH3COOH").contains("help: `acetic_acid` is also called that"));
    // Isomers are all named.
    let isomers = told("C3H8O");
    assert!(isomers.contains("`iPrOH`") && isomers.contains("`use std::substances::"), "{isomers}");
    // What there is not is declared; a salt of known ions is written as these.
    let salt = told("RbBr");
    assert!(salt.contains("declare it, with numbers of its own: `species RbBr { formula: \"RbBr\""), "{salt}");
    let ions = told("NH4OH");
    assert!(ions.contains("write its ions, per mole 1 mol of `NH4+` and 1 mol of `OH-`"), "{ions}");
    // Letters decide where a formula was misread, or the elements are the same.
    assert!(told("NaCI").contains("did you mean `NaCl`?"));
    assert!(told("H2S04").contains("did you mean `H2SO4`?"));
    assert!(told("Cu2SO4").contains("did you mean `CuSO4`?"));
}

#[test]
fn the_species_of_a_file_goes_before_those_of_the_library() {
    let own = "species our_chloride { formula: \"CaCl2\", molar_volume: 50 mL/mol, heat_capacity: 70 J/(mol*K) }\n";
    let file = write(&folder("substance_own"), "own.mtx", lab(own, "10 mL of water + 1 mmol of CaCl2"));
    let said = flat(&matterixc(&["check", &file]).out);
    assert!(said.contains("did you mean `our_chloride`?") && !said.contains("std::salts"), "{said}");
}

#[test]
fn a_fix_writes_the_name_and_its_import() {
    let dir = folder("substance_fix");
    let file = write(&dir, "salts.mtx", lab("", "10 mL of water + 1 mmol of KH2PO4 + 1 mmol of K2HPO4"));
    assert_eq!(matterixc(&["check", "--fix=all", &file]).code, 0);
    let mended = std::fs::read_to_string(&file).expect("it is there");
    for line in ["potassium_dihydrogen_phosphate", "dipotassium_hydrogen_phosphate"] {
        assert_eq!(mended.matches(line).count(), 2, "{mended}");
    }
    // Only a person knows which hydrate is in the bottle.
    let file = write(&dir, "hydrate.mtx", lab("", "10 mL of water + 1 g of FeSO4"));
    assert_eq!(matterixc(&["check", "--fix=all", &file]).code, 1);
    let imported = write(&dir, "imported.mtx", lab("use std::salts::NaH2PO4\n", "10 mL of water"));
    let said = flat(&matterixc(&["check", &imported]).out);
    assert!(said.contains("did you mean `sodium_dihydrogen_phosphate`?"), "{said}");
}
