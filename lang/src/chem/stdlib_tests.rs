//! The standard library's species against this module; a reader of lines is enough for the shape that file keeps.

use std::collections::BTreeMap;

use super::balance;
use super::formula::Formula;
use super::species_name::SpeciesName;
use super::structure::Structure;

const SPECIES: &str = include_str!("../../../stdlib/species.mtx");
const UNITS: &str = include_str!("../../../stdlib/units.mtx");

type Fields = BTreeMap<&'static str, &'static str>;

fn species() -> BTreeMap<&'static str, Fields> {
    let mut found: BTreeMap<&str, Fields> = BTreeMap::new();
    let mut current = None;
    for line in SPECIES.lines().map(|l| l.split("//").next().unwrap_or(l).trim()) {
        if let Some(rest) = line.strip_prefix("species ") {
            let (name, rest) = rest.split_once(" {").expect(line);
            assert!(found.insert(name, Fields::new()).is_none(), "{name} stands twice");
            if let Some(same) = rest.trim().strip_prefix("same_as: ") {
                found.entry(name).or_default().insert("same_as", same.trim_end_matches(" }"));
            }
            current = Some(name);
        } else if let Some((key, value)) = line.split_once(": ") {
            let fields = found.get_mut(current.expect(line)).expect(line);
            assert!(fields.insert(key, value.trim()).is_none(), "{key} stands twice in {current:?}");
        }
    }
    found
}

fn text(value: &str) -> &str {
    value.trim_matches('"')
}

/// The formula, from the structure where there is one; absent for mixtures.
fn formula(fields: &Fields) -> Option<Formula> {
    let structure = fields.get("smiles").map(|s| Structure::parse(text(s)).expect(s).formula);
    structure.or_else(|| fields.get("formula").map(|f| Formula::parse(text(f)).expect(f)))
}

#[test]
fn structures_and_formulas_agree() {
    for (name, fields) in species() {
        if let (Some(smiles), Some(stated)) = (fields.get("smiles"), fields.get("formula")) {
            let structure = Structure::parse(text(smiles)).expect(name);
            assert_eq!(structure.formula, Formula::parse(text(stated)).expect(name), "{name}");
        }
    }
}

#[test]
fn every_species_has_an_identity_volume_and_heat_capacity() {
    for (name, fields) in species() {
        if fields.contains_key("same_as") {
            continue;
        }
        let has = |key| fields.contains_key(key);
        assert!(has("smiles") || has("formula") || fields.get("by") == Some(&"mass"), "{name}");
        assert!(has("density") != has("molar_volume"), "{name}");
        assert!(has("heat_capacity") || has("specific_heat"), "{name}");
        assert!(formula(&fields).is_none_or(|f| f.molar_mass().is_ok()), "{name}");
    }
}

#[test]
fn names_that_are_formulas_say_the_truth() {
    for (name, fields) in species() {
        let charge = SpeciesName::split(name).charge;
        let Some(formula) = formula(&fields) else { continue };
        assert!(charge == 0 || formula.charge == charge, "{name}");
        // Abbreviations such as EtOH do not read as formulas.
        if let Ok(read) = Formula::parse(name) {
            assert_eq!(read, formula, "{name}");
        }
    }
}

#[test]
fn salts_dissolve_into_known_species_and_balance() {
    let all = species();
    let mut checked = 0;
    for (name, fields) in &all {
        let Some(dissolves) = fields.get("dissolves") else { continue };
        let whole = formula(fields).expect(name);
        let parts: Vec<(f64, Formula)> = dissolves
            .split(" + ")
            .map(|term| {
                let (coefficient, part) = term.split_once(' ').unwrap_or(("1", term));
                (coefficient.parse().expect(term), formula(&all[part]).expect(part))
            })
            .collect();
        let right: Vec<(f64, &Formula)> = parts.iter().map(|(c, f)| (*c, f)).collect();
        assert_eq!(balance::check(&[(1.0, &whole)], &right), Ok(()), "{name}");
        checked += 1;
    }
    assert!(checked >= 10);
}

#[test]
fn aliases_name_a_species() {
    let all = species();
    for (name, fields) in &all {
        if let Some(same) = fields.get("same_as") {
            assert!(all.get(same).is_some_and(|f| !f.contains_key("same_as")), "{name}");
        }
    }
}

#[test]
fn what_the_examples_need_is_there() {
    let all = species();
    for name in [
        "water",
        "H2O",
        "EtOH",
        "HI",
        "EtI",
        "H2O2",
        "I2",
        "I-",
        "K+",
        "H+",
        "Cl-",
        "Na+",
        "OH-",
        "ascorbic_acid",
        "dehydroascorbic_acid",
        "starch",
        "HCl",
        "KI",
        "NaOH",
        "NaCl",
        "acetic_acid",
        "acetate",
        "air",
        "SO4^2-",
        "CO3^2-",
    ] {
        assert!(all.contains_key(name), "{name}");
    }
    // The acid that the substitution of alcohols is written with stays whole.
    assert!(!all["HI"].contains_key("dissolves"));
}

#[test]
fn temperatures_are_in_order() {
    let degrees = |value: &&str| value.trim_end_matches(" degC").parse::<f64>().expect("degrees");
    for (name, fields) in species() {
        let (melting, boiling, flash) =
            (fields.get("melting_point"), fields.get("boiling_point"), fields.get("flash_point"));
        if let (Some(m), Some(b)) = (melting, boiling) {
            assert!(degrees(m) < degrees(b), "{name}");
        }
        if let (Some(f), Some(b)) = (flash, boiling) {
            assert!(degrees(f) < degrees(b), "{name}");
        }
    }
}

/// Molar volumes of liquids and solids in a plausible range; a slip of a digit in a density shows here.
#[test]
fn densities_fit_the_molar_mass() {
    for (name, fields) in species() {
        let (Some(density), Some(formula)) = (fields.get("density"), formula(&fields)) else { continue };
        let density: f64 = density.trim_end_matches(" g/mL").parse().expect(name);
        let atoms: f64 = formula.elements.values().map(|c| c.to_f64()).sum();
        let per_atom = formula.molar_mass().expect(name) * 1e3 / density / atoms;
        assert!((4.0..30.0).contains(&per_atom), "{name}: {per_atom} mL/mol per atom");
    }
}

#[test]
fn units_are_declared_once() {
    let mut names: Vec<&str> = Vec::new();
    for line in UNITS.lines() {
        let Some(rest) = line.strip_prefix("unit ") else { continue };
        names.extend(rest.split_once(':').map(|(name, _)| name));
        names.extend(rest.split_once(" also ").map(|(_, alias)| alias));
    }
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
    for needed in ["degC", "mol", "L", "rpm", "%w/w", "%v/v", "kg_solvent", "M", "kg", "g", "inch", "°C"] {
        assert!(names.contains(&needed), "{needed}");
    }
}

/// Every dimension that a line names is declared above it.
#[test]
fn dimensions_are_declared_before_use() {
    let mut known = Vec::new();
    for line in UNITS.lines() {
        let words = |text: &'static str| {
            text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| w.starts_with(|c: char| c.is_ascii_uppercase()))
        };
        if let Some(rest) = line.strip_prefix("dimension ") {
            let (name, definition) = rest.split_once(" = ").unwrap_or((rest, ""));
            assert!(words(definition).all(|w| known.contains(&w)), "{line}");
            assert!(!known.contains(&name), "{line}");
            known.push(name);
        } else if let Some((_, rest)) = line.strip_prefix("unit ").and_then(|r| r.split_once(": ")) {
            let dimension = rest.split(' ').next().expect(line);
            assert!(known.contains(&dimension), "{line}");
        }
    }
}
