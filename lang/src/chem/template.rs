//! Whether a reaction template (SMIRKS), run on the declared reactants, gives the declared products.
//!
//! Templates are read as RDKit reads them: a mapped atom keeps its charge unless the right side states one, so that an ion
//! which becomes neutral is written `[O+0:1]`.

use std::collections::BTreeMap;

use super::formula::Formula;
use super::rational::{Rational, gcd};
use super::structure::Structure;
use super::template_run::{Outcomes, outcomes, slots};

/// A species on one side of an equation.
#[derive(Clone, Copy, Debug)]
pub struct Participant<'a> {
    /// As written in the equation.
    pub name: &'a str,
    /// Absent where only a formula is known: such a reactant matches nothing, such a product is told by its formula.
    pub structure: Option<&'a Structure>,
    /// Atoms and charge.
    pub formula: &'a Formula,
    /// Its coefficient.
    pub coefficient: f64,
}

/// Why a template does not stand for an equation.
#[derive(Clone, Debug, PartialEq)]
pub enum TemplateError {
    /// The text is not a template.
    Unreadable {
        /// What the reader says, in its words.
        detail: String,
        /// First byte of the faulty place, where the reader tells.
        offset: Option<usize>,
    },
    /// The left side of the template has this many molecules: none, or more than can be tried.
    ReactantCount(usize),
    /// No arrangement of the reactants matches the left side.
    NoMatch,
    /// It matches, but every outcome has an atom with too many bonds.
    Impossible,
    /// It matches and gives other products, or the declared ones in other proportions.
    OtherProducts {
        /// The outcome nearest to what is declared.
        gives: Vec<Product>,
        /// Declared products that it does not give, by name.
        missing: Vec<String>,
    },
    /// There are too many ways to match, or the outcome could not be worked out.
    Unsupported,
}

/// A molecule that a template gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Product {
    /// Canonical SMILES.
    pub smiles: String,
    /// Its formula in Hill order, with charge.
    pub formula: String,
    /// The declared product that it is; absent where none is.
    pub name: Option<String>,
}

/// Runs `template` on every arrangement of the reactants. Gives the names of declared products that it leaves out:
/// by-products without a place in the template, lighter than those it gives, such as water.
///
/// Each molecule on the template's left side may be any reactant, as often as the equation has it; so the order is free
/// and spectators may stand in the equation. Where the template gives every declared product, it must give them in the
/// equation's proportions. Stereochemistry counts where both the outcome and the declared product state it.
pub fn check(
    template: &str,
    reactants: &[Participant<'_>],
    products: &[Participant<'_>],
) -> Result<Vec<String>, TemplateError> {
    let slots = slots(template)?;
    let times = multiplicities(reactants);
    let stock: Vec<(&Structure, usize)> =
        reactants.iter().zip(times).filter_map(|(r, times)| Some((r.structure?, times))).collect();
    judge(&outcomes(template, slots, &stock)?, products)
}

/// Whole numbers in proportion to the coefficients: `A + 0.5 B` uses two A and one B.
fn multiplicities(reactants: &[Participant<'_>]) -> Vec<usize> {
    let exact: Option<Vec<Rational>> = reactants.iter().map(|r| Rational::from_decimal(r.coefficient)).collect();
    let rounded_up = |r: &Participant<'_>| r.coefficient.clamp(1.0, 100.0).ceil() as usize;
    let scaled = exact.and_then(|exact| {
        let multiple =
            exact.iter().try_fold(1i128, |m, c| (m / gcd(m, c.denominator())).checked_mul(c.denominator()))?;
        exact
            .iter()
            .map(|c| usize::try_from(c.numerator().checked_mul(multiple / c.denominator())?).ok())
            .collect::<Option<Vec<usize>>>()
    });
    scaled.unwrap_or_else(|| reactants.iter().map(rounded_up).collect())
}

/// How one outcome compares with the declared products.
struct Verdict {
    gives: Vec<Product>,
    missing: Vec<String>,
    foreign: usize,
    agrees: bool,
}

fn judge(outcomes: &Outcomes, products: &[Participant<'_>]) -> Result<Vec<String>, TemplateError> {
    let verdicts = outcomes.values().map(|outcome| compare(outcome, products));
    let Some(best) = verdicts.min_by_key(|v| (!v.agrees, v.missing.len() + v.foreign)) else {
        return Err(TemplateError::NoMatch);
    };
    if best.agrees {
        Ok(best.missing)
    } else {
        Err(TemplateError::OtherProducts { gives: best.gives, missing: best.missing })
    }
}

fn compare(outcome: &[Structure], products: &[Participant<'_>]) -> Verdict {
    let mut given: BTreeMap<usize, i64> = BTreeMap::new();
    let mut gives = Vec::new();
    for structure in outcome {
        let declared = products.iter().position(|p| is_same(structure, p));
        if let Some(index) = declared {
            *given.entry(index).or_default() += 1;
        }
        gives.push(Product {
            smiles: structure.canonical.clone(),
            formula: structure.formula.to_string(),
            name: declared.map(|i| products[i].name.to_string()),
        });
    }
    let missing: Vec<usize> = (0..products.len()).filter(|i| !given.contains_key(i)).collect();
    let foreign = gives.iter().filter(|p| p.name.is_none()).count();
    let agrees = !given.is_empty()
        && foreign == 0
        && if missing.is_empty() { in_proportion(&given, products) } else { only_small(&missing, &given, products) };
    Verdict { gives, missing: missing.iter().map(|i| products[*i].name.to_string()).collect(), foreign, agrees }
}

fn is_same(given: &Structure, declared: &Participant<'_>) -> bool {
    match declared.structure {
        None => given.formula == *declared.formula,
        Some(structure) => given.same_where_stated(structure),
    }
}

/// Whether the counts are the equation's coefficients times one factor.
fn in_proportion(given: &BTreeMap<usize, i64>, products: &[Participant<'_>]) -> bool {
    let mut ratios = given.iter().map(|(index, count)| {
        Rational::whole(*count).checked_div(Rational::from_decimal(products[*index].coefficient)?)
    });
    let first = ratios.next().flatten();
    first.is_some() && ratios.all(|ratio| ratio == first)
}

/// Whether all left out are lighter than the heaviest product given.
fn only_small(missing: &[usize], given: &BTreeMap<usize, i64>, products: &[Participant<'_>]) -> bool {
    let mass = |index: &usize| products[*index].formula.molar_mass().unwrap_or(f64::INFINITY);
    let heaviest = |indices: &mut dyn Iterator<Item = f64>| indices.fold(0.0, f64::max);
    heaviest(&mut missing.iter().map(mass)) < heaviest(&mut given.keys().map(mass))
}

#[cfg(test)]
#[path = "template_tests.rs"]
mod tests;
