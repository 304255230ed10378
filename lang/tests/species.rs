//! What the library says of its species, by its own declared types.

use matterix_ir::Sources;
use matterix_lang::elaborate::declared;
use matterix_lang::eval::Elaborator;
use matterix_lang::eval::lab::reach::Reach;
use matterix_lang::load;
use matterix_lang::names::{DeclId, Names};
use matterix_lang::{LibraryOnly, Session};

/// The codes of what is found in the species of a file and of the library.
fn found_in(text: &str) -> Vec<String> {
    let mut sources = Sources::default();
    let file = sources.add("species.mtx", text);
    let (modules, _) = load::load(&mut sources, file, &LibraryOnly, &mut Session::default());
    let (names, _) = Names::new(&modules);
    let (tables, mut found) = declared(&names);
    let mut lab = Elaborator::new(&tables, Reach::default());
    for index in 0..names.decls.len() as u32 {
        lab.check_species(DeclId(index));
    }
    found.append(&mut lab.diagnostics);
    found.into_iter().map(|d| format!("{}: {}", d.code.name, d.headline)).collect()
}

#[test]
fn every_property_of_the_library_is_of_its_declared_type() {
    assert_eq!(found_in("mtx 1\n"), [""; 0]);
}

#[test]
fn a_property_is_typed_where_it_is_written() {
    let one = |fields: &str| found_in(&format!("mtx 1\nspecies x {{ formula: \"C2H6O2\", {fields} }}\n"));
    for (fields, expected) in [
        ("density: 2 * 0.5 g/mL, heat_capacity: 150 J/(mol*K)", &[][..]),
        ("phase: liquid, hazards: [irritant, \"toxic\"], pka: 4.7, absorbs: (1, 2, 3) L/(mol*cm)", &[]),
        ("boiling_point: 97 kPa", &["unit-mismatch: `x.boiling_point` expects Temperature (K), found Pressure (Pa)"]),
        ("molar_mass: 2 * 29 g/mol", &["formula-invalid: the molar mass of `x` is 0.062068 kg/mol"]),
        ("density: 0 g/mL", &["out-of-range: `x.density` cannot be 0 g/mL"]),
        (
            "density: 1 g/mL, heat_capacity: -1 J/(mol*K)",
            &["out-of-range: the heat capacity of `x` must be above zero"],
        ),
        ("phase: \"liquit\"", &["type-mismatch: `x.phase` expects one of `solid`, `liquid`, `gas`, found a text"]),
        ("by: volume", &["type-mismatch: `by` must be `mass`"]),
        ("fade: 3 s", &["unknown-field: a species has no field `fade`"]),
        (
            "density: 1 g/mL, molar_volume: 60 mL/mol",
            &["out-of-range: `molar_volume` and `density` of `x` contradict each other"],
        ),
    ] {
        assert_eq!(one(fields), expected, "{fields}");
    }
}

#[test]
fn a_property_is_declared_once() {
    let found = found_in("mtx 1\ncapability Species { param density: Pressure }\n");
    assert_eq!(found, ["duplicate-name: the property `density` is declared twice"]);
}
