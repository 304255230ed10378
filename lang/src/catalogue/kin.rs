//! What a formula stands for besides the substances that have it: those that hold water besides, and the ions that it gives.

use std::sync::OnceLock;

use super::{Catalogue, Substance};
use crate::chem::rational::gcd;
use crate::chem::{Element, Formula};

/// Ions with how many of each one formula has: `Na2S2O3` is 2 `Na+` and 1 `S2O3^2-`.
pub type Ions<'a> = [(&'a Substance, i64); 2];

/// Formula units of a salt in one formula, at most: `Hg2Cl2` has none more.
const UNITS: i64 = 2;

impl Catalogue {
    /// The substances of the library, read once.
    pub fn library() -> &'static Catalogue {
        static LIBRARY: OnceLock<Catalogue> = OnceLock::new();
        LIBRARY.get_or_init(|| Catalogue::read(&[]))
    }

    /// Those that have a formula and nothing else: no charge, as a gas or as what is dissolved, where it has none.
    pub fn weighed(&self, formula: &Formula) -> Vec<&Substance> {
        let is = |s: &&Substance| s.composition().as_ref() == Some(formula) && s.is_weighed();
        self.all().iter().filter(is).collect()
    }

    /// Those that have a formula and water besides: of `CaCl2` the one with `CaCl2.2H2O`.
    pub fn hydrates(&self, formula: &Formula) -> Vec<&Substance> {
        self.all().iter().filter(|s| s.without_water().as_ref() == Some(formula)).collect()
    }

    /// The ions of a salt by its formula: those with the smallest cation, and H+ where there is no other.
    pub fn ions(&self, formula: &Formula) -> Option<Ions<'_>> {
        let is_ion = |ion: &Formula| ion.charge != 0 && !ion.is_electron();
        let charged = self.all().iter().filter_map(|s| Some((s, s.composition().filter(is_ion)?)));
        // What has an element that the salt lacks is none of its ions.
        let charged: Vec<(&Substance, Formula)> =
            charged.filter(|(_, ion)| ion.elements.keys().all(|e| formula.elements.contains_key(e))).collect();
        let of = |positive: bool| charged.iter().filter(move |(_, ion)| (ion.charge > 0) == positive);
        let pairs = of(true).flat_map(|cation| of(false).map(move |anion| (cation, anion)));
        let fits = pairs.filter_map(|((cation, plus), (anion, minus))| {
            let (a, b) = counts(formula, plus, minus)?;
            Some(((is_proton(plus), atoms(plus)), [(*cation, a), (*anion, b)]))
        });
        fits.min_by_key(|(rank, _)| *rank).map(|(_, ions)| ions)
    }
}

impl Substance {
    /// Whether it is something that is weighed or measured out: no gas, nothing that exists dissolved alone.
    fn is_weighed(&self) -> bool {
        !["(aq)", "(g)"].iter().any(|phase| self.name.ends_with(phase))
    }

    /// Its composition without the water that its formula has behind a point.
    pub(super) fn without_water(&self) -> Option<Formula> {
        let (salt, water) = self.formula.as_deref()?.rsplit_once('.')?;
        let water = Formula::parse(water.trim_start_matches(|c: char| c.is_ascii_digit())).ok()?;
        (Formula::parse("H2O").ok()? == water).then(|| Formula::parse(salt).ok()).flatten()
    }
}

fn is_proton(ion: &Formula) -> bool {
    ion.elements.keys().all(|e| e.number() == 1) && atoms(ion) == 1
}

fn atoms(formula: &Formula) -> i64 {
    formula.elements.values().map(|count| count.to_f64() as i64).sum()
}

/// How many of two ions give a formula.
fn counts(formula: &Formula, plus: &Formula, minus: &Formula) -> Option<(i64, i64)> {
    let (p, m) = (i64::from(plus.charge), i64::from(-minus.charge));
    let shared = gcd(p.into(), m.into()) as i64;
    let together = |a: i64, b: i64| {
        let is_met = |e: &Element| {
            let of = |ion: &Formula| ion.count(*e).to_f64();
            a as f64 * of(plus) + b as f64 * of(minus) == formula.count(*e).to_f64()
        };
        formula.elements.keys().all(is_met)
    };
    let found = (1..=UNITS).map(|n| (n * m / shared, n * p / shared)).find(|(a, b)| together(*a, *b));
    found.filter(|_| formula.charge == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ions(formula: &str) -> Vec<(&'static str, i64)> {
        let found = Catalogue::library().ions(&Formula::parse(formula).expect("a formula"));
        found.into_iter().flatten().map(|(s, count)| (s.name.as_str(), count)).collect()
    }

    #[test]
    fn a_salt_is_taken_apart_into_simple_ions() {
        assert_eq!(ions("Na2S2O3"), [("Na+", 2), ("S2O3^2-", 1)]);
        assert_eq!(ions("CoCl2"), [("Co2+", 1), ("Cl-", 2)]);
        assert_eq!(ions("KHSO4"), [("K+", 1), ("HSO4-", 1)]);
        assert_eq!(ions("NH4NO3"), [("NH4+", 1), ("NO3-", 1)]);
        assert_eq!(ions("CH2Cl2"), []);
        // Calomel is no HgCl+ with an electron.
        assert_eq!(ions("Hg2Cl2"), []);
        assert_eq!(ions("Na2SO4+"), []);
    }

    #[test]
    fn water_counts_as_such_behind_a_point_alone() {
        let names = |formula: &str| -> Vec<String> {
            let formula = Formula::parse(formula).expect("a formula");
            Catalogue::library().hydrates(&formula).iter().map(|s| s.name.clone()).collect()
        };
        assert!(names("CaCl2").contains(&"calcium_chloride_dihydrate".to_string()), "{:?}", names("CaCl2"));
        // Formic acid is no carbon monoxide with water.
        assert_eq!(names("CO"), [""; 0]);
    }
}
