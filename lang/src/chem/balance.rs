//! Whether an equation keeps every element and the charge, and the coefficients that would.

use std::collections::{BTreeMap, BTreeSet};

use super::elements::Element;
use super::formula::Formula;
use super::rational::{Rational, gcd};

/// What an equation gains or loses.
#[derive(Clone, Debug, PartialEq)]
pub struct Imbalance {
    /// Right side less left side, for each element that differs.
    pub elements: BTreeMap<Element, Rational>,
    /// Right side less left side, in elementary charges.
    pub charge: Rational,
    /// The only set of smallest whole coefficients that balances, left side then right side; absent where there is none
    /// or more than one.
    pub suggestion: Option<Vec<u64>>,
}

/// Why an equation is not accepted.
#[derive(Clone, Debug, PartialEq)]
pub enum BalanceError {
    /// It does not balance.
    Unbalanced(Imbalance),
    /// A coefficient is not a positive decimal number of moderate size; by its index, left side then right side.
    BadCoefficient(usize),
    /// The numbers are beyond exact arithmetic.
    TooLarge,
}

/// Checks an equation of coefficients and formulas, exactly: 0.5 is one half.
pub fn check(left: &[(f64, &Formula)], right: &[(f64, &Formula)]) -> Result<(), BalanceError> {
    let mut elements: BTreeMap<Element, Rational> = BTreeMap::new();
    let mut charge = Rational::ZERO;
    for (index, (coefficient, formula)) in left.iter().chain(right).enumerate() {
        let size = Rational::from_decimal(*coefficient)
            .filter(|c| c.signum() > 0)
            .ok_or(BalanceError::BadCoefficient(index))?;
        let signed = if index < left.len() { Rational::ZERO.checked_sub(size) } else { Some(size) };
        let signed = signed.ok_or(BalanceError::TooLarge)?;
        for (element, count) in &formula.elements {
            let entry = elements.entry(*element).or_insert(Rational::ZERO);
            *entry = add_product(*entry, *count, signed).ok_or(BalanceError::TooLarge)?;
        }
        let charges = Rational::whole(formula.charge.into());
        charge = add_product(charge, charges, signed).ok_or(BalanceError::TooLarge)?;
    }
    elements.retain(|_, difference| !difference.is_zero());
    if elements.is_empty() && charge.is_zero() {
        return Ok(());
    }
    let formulas = |side: &[(f64, &Formula)]| side.iter().map(|(_, f)| (*f).clone()).collect::<Vec<_>>();
    let suggestion = balanced(&formulas(left), &formulas(right));
    Err(BalanceError::Unbalanced(Imbalance { elements, charge, suggestion }))
}

/// The smallest whole coefficients that balance, left side then right side, where exactly one set does.
pub fn balanced(left: &[Formula], right: &[Formula]) -> Option<Vec<u64>> {
    let species = left.len() + right.len();
    let all = || left.iter().chain(right);
    let elements: BTreeSet<Element> = all().flat_map(|f| f.elements.keys().copied()).collect();
    let signed = |row: Vec<Rational>| -> Option<Vec<Rational>> {
        row.into_iter()
            .enumerate()
            .map(|(i, value)| if i < left.len() { Some(value) } else { Rational::ZERO.checked_sub(value) })
            .collect()
    };
    let mut rows: Vec<Vec<Rational>> = Vec::new();
    for element in elements {
        rows.push(signed(all().map(|f| f.count(element)).collect())?);
    }
    rows.push(signed(all().map(|f| Rational::whole(f.charge.into())).collect())?);
    whole_and_positive(&null_vector(rows, species)?)
}

/// The only direction that all rows send to zero; absent where there is none or more than one.
fn null_vector(mut rows: Vec<Vec<Rational>>, columns: usize) -> Option<Vec<Rational>> {
    let mut pivots: Vec<usize> = Vec::new();
    for column in 0..columns {
        let rank = pivots.len();
        let Some(found) = (rank..rows.len()).find(|r| !rows[*r][column].is_zero()) else { continue };
        rows.swap(rank, found);
        let lead = rows[rank][column];
        for value in &mut rows[rank] {
            *value = value.checked_div(lead)?;
        }
        let pivot = rows[rank].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(index, _)| *index != rank) {
            let factor = row[column];
            for (value, lead) in row.iter_mut().zip(&pivot) {
                *value = value.checked_sub(lead.checked_mul(factor)?)?;
            }
        }
        pivots.push(column);
    }
    let mut free = (0..columns).filter(|c| !pivots.contains(c));
    let (Some(free), None) = (free.next(), free.next()) else { return None };
    let mut vector = vec![Rational::ZERO; columns];
    vector[free] = Rational::ONE;
    for (row, column) in rows.iter().zip(&pivots) {
        vector[*column] = Rational::ZERO.checked_sub(row[free])?;
    }
    Some(vector)
}

/// The vector scaled to whole numbers without a common factor; absent unless all are positive.
fn whole_and_positive(vector: &[Rational]) -> Option<Vec<u64>> {
    if vector.iter().any(|v| v.signum() <= 0) {
        return None;
    }
    let multiple = vector.iter().try_fold(1i128, |m, v| {
        let d = v.denominator();
        (m / gcd(m, d)).checked_mul(d)
    })?;
    let scaled: Vec<i128> =
        vector.iter().map(|v| v.numerator().checked_mul(multiple / v.denominator())).collect::<Option<_>>()?;
    let divisor = scaled.iter().fold(0, |d, v| gcd(d, *v)).max(1);
    scaled.iter().map(|v| u64::try_from(v / divisor).ok()).collect()
}

fn add_product(sum: Rational, a: Rational, b: Rational) -> Option<Rational> {
    sum.checked_add(a.checked_mul(b)?)
}

#[cfg(test)]
#[path = "balance_tests.rs"]
mod tests;
