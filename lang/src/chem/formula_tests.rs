use super::*;
use proptest::prelude::*;

fn hill(text: &str) -> String {
    Formula::parse(text).expect(text).to_string()
}

fn grams(text: &str) -> f64 {
    Formula::parse(text).expect(text).molar_mass().expect(text) * 1e3
}

fn mistake(text: &str) -> (FormulaErrorKind, usize, usize) {
    let error = Formula::parse(text).expect_err(text);
    (error.kind, error.offset, error.len)
}

#[test]
fn formulas_print_in_hill_order() {
    for (text, expected) in [
        ("C2H5OH", "C2H6O"),
        ("CuSO4.5H2O", "CuH10O9S"),
        ("CuSO4·5H2O", "CuH10O9S"),
        ("Ca(OH)2", "CaH2O2"),
        ("SO4^2-", "O4S^2-"),
        ("Fe(CN)6^3-", "C6FeN6^3-"),
        ("[Fe(CN)6]^3-", "C6FeN6^3-"),
        ("K3[Fe(CN)6]", "C6FeK3N6"),
        ("H+", "H+"),
        ("NH4+", "H4N+"),
        ("Ca2+", "Ca^2+"),
        ("I3-", "I3^-"),
        ("Hg2^2+", "Hg2^2+"),
        ("[2H]2O", "[2H]2O"),
        ("D2O", "[2H]2O"),
        ("CH3[13C]OOH", "C[13C]H4O2"),
        ("[13CH4]", "[13C]H4"),
        ("Al2(SO4)3.18H2O", "Al2H36O30S3"),
        ("CaSO4.0.5H2O", "CaHO4.5S"),
        ("Fe0.95O", "Fe0.95O"),
        ("{[Co(NH3)6]2}(SO4)3", "Co2H36N12O12S3"),
        ("CO", "CO"),
        ("Co", "Co"),
    ] {
        assert_eq!(hill(text), expected, "{text}");
    }
}

#[test]
fn phases_are_handed_back() {
    let (formula, phase) = Formula::parse_with_phase("KNO3(s)").expect("reads");
    assert_eq!((formula.to_string().as_str(), phase), ("KNO3", Some(Phase::Solid)));
    let (formula, phase) = Formula::parse_with_phase("Cl-(aq)").expect("reads");
    assert_eq!((formula.charge, phase), (-1, Some(Phase::Aqueous)));
}

#[test]
fn mistakes_are_located() {
    use FormulaErrorKind::*;
    assert_eq!(mistake(""), (Empty, 0, 0));
    assert_eq!(mistake("EtOH"), (UnknownElement("Et".into()), 0, 2));
    assert_eq!(mistake("NaCl2x"), (UnknownElement("x".into()), 5, 1));
    assert_eq!(mistake("Ca(OH2"), (Unclosed('('), 2, 1));
    assert_eq!(mistake("CaOH)2"), (Unopened(')'), 4, 1));
    assert_eq!(mistake("Ca(OH]2"), (Unopened(']'), 5, 1));
    assert_eq!(mistake("H0"), (BadCount, 1, 1));
    assert_eq!(mistake("H99999999"), (BadCount, 1, 8));
    assert_eq!(mistake("CuSO4."), (Empty, 6, 0));
    assert_eq!(mistake("H2 O"), (UnexpectedCharacter(' '), 2, 1));
    assert_eq!(mistake("()"), (Empty, 1, 1));
    assert_eq!(mistake("µ"), (UnexpectedCharacter('µ'), 0, 2));
    assert_eq!(mistake(&"(".repeat(65)), (TooDeep, 64, 1));
}

/// Published molar masses [g/mol]: NIST Chemistry WebBook, SRD 69, and CRC Handbook of Chemistry and Physics, 97th ed.
#[test]
fn molar_masses_agree_with_published_ones() {
    for (text, published) in [
        ("H2O", 18.0153),
        ("C2H5OH", 46.0684),
        ("CH3OH", 32.0419),
        ("C3H8O", 60.0950),
        ("C3H6O", 58.0791),
        ("CH3CN", 41.0519),
        ("C2H6OS", 78.133),
        ("C3H7NO", 73.0938),
        ("C4H8O", 72.1057),
        ("C7H8", 92.1384),
        ("C6H14", 86.1754),
        ("C4H8O2", 88.1051),
        ("CH2Cl2", 84.933),
        ("CHCl3", 119.378),
        ("HI", 127.912),
        ("C2H5I", 155.965),
        ("H2SO4", 98.079),
        ("NaOH", 39.9971),
        ("KI", 166.0028),
        ("C6H8O6", 176.124),
        ("C9H8O4", 180.157),
        ("C12H22O11", 342.297),
        ("CuSO4.5H2O", 249.685),
        ("AgNO3", 169.873),
        ("NaCl", 58.443),
        ("D2O", 20.0276),
    ] {
        let ours = grams(text);
        assert!((ours / published - 1.0).abs() < 1e-4, "{text}: {ours} against {published}");
    }
}

#[test]
fn ions_weigh_less_their_electrons() {
    let dissociated = grams("H+") + grams("Cl-");
    assert!((dissociated - grams("HCl")).abs() < 1e-12);
    assert!((grams("Na+") - 22.98922).abs() < 1e-5);
}

#[test]
fn radioactive_elements_have_no_molar_mass() {
    let technetium = Element::from_symbol("Tc").expect("element 43");
    assert_eq!(Formula::parse("NaTcO4").expect("reads").molar_mass(), Err(NoMolarMass(technetium)));
}

proptest! {
    #[test]
    fn garbage_is_an_error_inside_the_text(text in "\\PC{0,40}") {
        if let Err(e) = Formula::parse(&text) {
            prop_assert!(text.is_char_boundary(e.offset) && text.is_char_boundary(e.offset + e.len));
        }
    }

    #[test]
    fn formula_like_garbage_is_an_error_inside_the_text(text in "[A-Za-z0-9()\\[\\]{}.·^+-]{0,40}") {
        match Formula::parse_with_phase(&text) {
            Ok((formula, _)) => prop_assert!(!formula.elements.is_empty()),
            Err(e) => prop_assert!(text.is_char_boundary(e.offset) && e.offset + e.len <= text.len()),
        }
    }

    #[test]
    fn printing_and_reading_agree(
        atoms in prop::collection::btree_map((1u8..=118, 0u16..20), 1i64..50, 1..6),
        charge in -4i32..=4,
    ) {
        let mut formula = Formula { charge, ..Formula::default() };
        for ((number, mass_number), count) in atoms {
            let element = Element::from_number(number).expect("tabulated").with_mass_number(mass_number);
            formula.add(element, Rational::whole(count)).expect("small");
        }
        let text = formula.to_string();
        prop_assert_eq!(Formula::parse(&text).expect(&text), formula);
    }
}
