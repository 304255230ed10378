use super::*;
use proptest::prelude::*;

type Side = Vec<(f64, Formula)>;

/// `2 H2 + O2 -> 2 H2O`.
fn equation(text: &str) -> (Side, Side) {
    let side = |text: &str| -> Side {
        text.split(" + ")
            .map(|term| {
                let (coefficient, formula) = term.trim().split_once(' ').unwrap_or(("1", term.trim()));
                (coefficient.parse().expect(text), Formula::parse(formula).expect(formula))
            })
            .collect()
    };
    let (left, right) = text.split_once("->").expect(text);
    (side(left), side(right))
}

fn run(text: &str) -> Result<(), BalanceError> {
    let (left, right) = equation(text);
    check(&borrowed(&left), &borrowed(&right))
}

fn borrowed(side: &[(f64, Formula)]) -> Vec<(f64, &Formula)> {
    side.iter().map(|(c, f)| (*c, f)).collect()
}

fn imbalance(text: &str) -> Imbalance {
    match run(text) {
        Err(BalanceError::Unbalanced(imbalance)) => imbalance,
        other => panic!("{text}: {other:?}"),
    }
}

const BALANCED: [&str; 32] = [
    "C2H5OH + HI -> C2H5I + H2O",
    "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O",
    "I2 + C6H8O6 -> C6H6O6 + 2 I- + 2 H+",
    "2 H2 + O2 -> 2 H2O",
    "H2 + 0.5 O2 -> H2O",
    "N2 + 3 H2 -> 2 NH3",
    "CH4 + 2 O2 -> CO2 + 2 H2O",
    "C3H8 + 5 O2 -> 3 CO2 + 4 H2O",
    "2 C8H18 + 25 O2 -> 16 CO2 + 18 H2O",
    "C6H12O6 -> 2 C2H5OH + 2 CO2",
    "6 CO2 + 6 H2O -> C6H12O6 + 6 O2",
    "NaOH + HCl -> NaCl + H2O",
    "H+ + OH- -> H2O",
    "2 Na + 2 H2O -> 2 NaOH + H2",
    "Zn + Cu2+ -> Zn2+ + Cu",
    "Cu + 2 Ag+ -> Cu2+ + 2 Ag",
    "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O",
    "Cr2O7^2- + 6 Fe2+ + 14 H+ -> 2 Cr3+ + 6 Fe3+ + 7 H2O",
    "2 MnO4- + 5 C2O4^2- + 16 H+ -> 2 Mn2+ + 10 CO2 + 8 H2O",
    "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-",
    "IO3- + 5 I- + 6 H+ -> 3 I2 + 3 H2O",
    "I2 + I- -> I3-",
    "Ag+ + Cl- -> AgCl",
    "Ca2+ + CO3^2- -> CaCO3",
    "NaHCO3 + CH3COOH -> CH3COONa + H2O + CO2",
    "2 NaHCO3 -> Na2CO3 + H2O + CO2",
    "CuSO4.5H2O -> CuSO4 + 5 H2O",
    "2 Al + 3 Cl2 -> 2 AlCl3",
    "4 Fe + 3 O2 -> 2 Fe2O3",
    "Fe2O3 + 3 CO -> 2 Fe + 3 CO2",
    "C7H6O3 + C4H6O3 -> C9H8O4 + CH3COOH",
    "NH4+ + OH- -> NH3 + H2O",
];

#[test]
fn balanced_equations_pass() {
    for text in BALANCED {
        assert_eq!(run(text), Ok(()), "{text}");
    }
}

#[test]
fn coefficients_are_found_again() {
    // In the acetylation hydrogen is twice oxygen on every term, so that several sets balance.
    for text in BALANCED.iter().filter(|t| !t.contains("0.5") && !t.contains("C9H8O4")) {
        let (left, right) = equation(text);
        let written: Vec<u64> = left.iter().chain(&right).map(|(c, _)| *c as u64).collect();
        let formulas = |side: Side| side.into_iter().map(|(_, f)| f).collect::<Vec<_>>();
        assert_eq!(balanced(&formulas(left), &formulas(right)), Some(written), "{text}");
    }
}

#[test]
fn differences_are_named() {
    let found = imbalance("H2O2 + 2 I- -> I2 + 2 H2O");
    let expected = BTreeMap::from([(Element::H, Rational::whole(2))]);
    assert_eq!((found.elements, found.charge, found.suggestion), (expected, Rational::whole(2), None));

    let found = imbalance("H2 + O2 -> H2O");
    assert_eq!(found.elements, BTreeMap::from([(Element::O, Rational::whole(-1))]));
    assert_eq!(found.suggestion, Some(vec![2, 1, 2]));

    let found = imbalance("Zn + Ag+ -> Zn2+ + Ag");
    assert_eq!((found.elements.len(), found.charge), (0, Rational::ONE));
    assert_eq!(found.suggestion, Some(vec![1, 2, 1, 2]));

    let found = imbalance("MnO4- + Fe2+ + H+ -> Mn2+ + Fe3+ + H2O");
    assert_eq!(found.suggestion, Some(vec![1, 5, 8, 1, 5, 4]));
}

#[test]
fn isotopes_are_kept_apart() {
    let found = imbalance("D2O -> H2O");
    assert_eq!(found.elements.len(), 2);
}

#[test]
fn nothing_is_suggested_where_many_sets_balance() {
    assert_eq!(imbalance("H2O2 + KMnO4 + H2SO4 -> O2 + MnSO4 + K2SO4 + H2O + H2").suggestion, None);
}

#[test]
fn coefficients_must_be_positive_decimals() {
    let water = Formula::parse("H2O").expect("reads");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e30] {
        assert_eq!(check(&[(1.0, &water)], &[(bad, &water)]), Err(BalanceError::BadCoefficient(1)));
    }
}

proptest! {
    #[test]
    fn any_species_balances_itself(number in 1u8..=118, count in 1i64..1000, charge in -9i32..9, c in 1u32..1_000_000) {
        let mut formula = Formula { charge, ..Formula::default() };
        formula.add(Element::from_number(number).expect("tabulated"), Rational::whole(count)).expect("small");
        let coefficient = f64::from(c) / 1000.0;
        prop_assert_eq!(check(&[(coefficient, &formula)], &[(coefficient, &formula)]), Ok(()));
    }

    #[test]
    fn a_suggestion_balances(counts in prop::collection::vec((0i64..5, 0i64..5, 0i64..5, -2i32..3), 2..5)) {
        let formulas: Vec<Formula> = counts.iter().map(|(c, h, o, charge)| {
            let mut f = Formula { charge: *charge, ..Formula::default() };
            for (element, n) in [(Element::C, *c), (Element::H, *h), (Element::O, *o)] {
                f.add(element, Rational::whole(n)).expect("small");
            }
            f
        }).collect();
        let (left, right) = formulas.split_at(1);
        if let Some(found) = balanced(left, right) {
            let with = |side: &'_ [Formula], skip: usize| -> Vec<(f64, Formula)> {
                side.iter().zip(&found[skip..]).map(|(f, c)| (*c as f64, f.clone())).collect()
            };
            let (l, r) = (with(left, 0), with(right, 1));
            prop_assert_eq!(check(&borrowed(&l), &borrowed(&r)), Ok(()));
        }
    }
}
