//! The amount of a recipe's line with which its label would be true: one of the two ways to mend a label that is not.

use matterix_ir::Span;
use matterix_ir::quantity::show_number;

use crate::ast::{Expr, ExprKind, Field, FieldValue, ItemKind};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::lab::substances::Substance;
use crate::eval::{Scope, Value};
use crate::units::Dimension;

/// How many times more or less of a line is looked for.
const RANGE: f64 = 1e6;
/// Halvings of that range: far below what is written.
const HALVINGS: usize = 80;

/// What a line of a recipe holds, per kilogram of the whole recipe.
type Parts = Vec<(SpeciesId, f64)>;

/// An amount that is weighed in, and what would make the label true.
pub(super) struct Amount {
    /// The quantity in the text.
    pub at: Span,
    /// What would stand there.
    pub text: String,
    /// What the line is of.
    pub of: String,
}

impl<'a> Elaborator<'a> {
    /// What would have to be weighed in for a recipe to hold so much of a species as its label states, in SI; none where several
    /// lines bring it, where no literal says how much, or no amount comes near.
    pub(super) fn amount_for(
        &mut self,
        kind: &'a ItemKind,
        module: usize,
        s: SpeciesId,
        (whole, measure, stated): (&[(SpeciesId, f64)], &Dimension, f64),
    ) -> Option<Amount> {
        let ItemKind::Solution { fields, .. } = kind else { return None };
        let mut bringing = Vec::new();
        for field in fields {
            let parts = self.line_of(field, module)?;
            if parts.iter().any(|p| p.0 == s && p.1 > 0.0) {
                bringing.push((field, parts));
            }
        }
        let (field, own) = match bringing.as_slice() {
            [(field, own)] => (*field, own.clone()),
            _ => return None,
        };
        let FieldValue::Expr(e) = &field.value else { return None };
        let ExprKind::Quantity(number, unit) = &*e.kind else { return None };
        let of = |parts: &[(SpeciesId, f64)]| parts.iter().find(|p| p.0 == s).map_or(0.0, |p| p.1);
        // The share of the whole, by mass, that this line is.
        let share = of(whole) / of(&own);
        let fill = match self.rest_of(fields, module) {
            Some(rest) => Some(rest),
            None if unit.text.starts_with('%') => return None,
            None => None,
        };
        let times = |factor: f64| -> Option<Parts> {
            let more = (factor - 1.0) * share;
            match &fill {
                Some(fill) => {
                    let left = plus(&plus(whole, &own, more), fill, -more);
                    left.iter().all(|p| p.1 >= -1e-12).then_some(left)
                }
                None => Some(plus(whole, &own, more).into_iter().map(|(s, n)| (s, n / (1.0 + more))).collect()),
            }
        };
        let share_factor = self.factor(&times, s, measure, stated)?;
        let factor = self.of_volume(e, module, |lab, per| {
            let mended = lab.concentration_of(&times(share_factor)?, s, per)?;
            Some(mended / lab.concentration_of(whole, s, per)?)
        });
        let text = show_number(format!("{:.3e}", number * factor.unwrap_or(share_factor)).parse().ok()?);
        let text = if unit.text.is_empty() { text } else { format!("{text} {}", unit.text) };
        Some(Amount { at: e.span, text, of: field.key.text.clone() })
    }

    /// Something of the amount of a line that is written per volume, as `58.44 g/L` is: a line of a stronger solution makes up another share
    /// of its mass. None for other amounts.
    fn of_volume(
        &mut self,
        amount: &'a Expr,
        module: usize,
        mut of: impl FnMut(&mut Self, &Dimension) -> Option<f64>,
    ) -> Option<f64> {
        let Value::Num(n) = self.expr(amount, &mut Scope::module(module)) else { return None };
        let per_volume = ["MassConcentration", "AmountConcentration"].map(|name| self.tables.units.named(name));
        per_volume.contains(&n.dimension).then(|| of(self, &n.dimension)).flatten()
    }

    /// With how many times the amount of a line a recipe has a concentration; none where no amount comes near it.
    fn factor(
        &mut self,
        times: &impl Fn(f64) -> Option<Parts>,
        s: SpeciesId,
        measure: &Dimension,
        stated: f64,
    ) -> Option<f64> {
        let (mut low, mut high) = (1.0 / RANGE, RANGE);
        for _ in 0..HALVINGS {
            let middle = (low * high).sqrt();
            let there = times(middle).and_then(|parts| self.concentration_of(&parts, s, measure));
            match there.is_some_and(|there| there < stated) {
                true => low = middle,
                false => high = middle,
            }
        }
        let there = times(low).and_then(|parts| self.concentration_of(&parts, s, measure))?;
        ((there / stated - 1.0).abs() < 1e-6).then_some(low)
    }

    /// What a line is of, mol (kg where counted by mass) per kilogram of that.
    fn line_of(&mut self, field: &'a Field, module: usize) -> Option<Parts> {
        Some(match self.substance(&field.key, module)? {
            Substance::Species(s) => vec![(s, 1.0 / self.tables.species.get(s).molar_mass)],
            Substance::Solution(id) => self.composition(id),
        })
    }

    /// What makes up the rest of a recipe.
    fn rest_of(&mut self, fields: &'a [Field], module: usize) -> Option<Parts> {
        let is_rest = |f: &&Field| match &f.value {
            FieldValue::Expr(e) => matches!(&*e.kind, ExprKind::Name(n) if n.text == "rest"),
            _ => false,
        };
        let rest = fields.iter().find(is_rest)?;
        self.line_of(rest, module)
    }
}

/// A recipe with more of a line.
fn plus(whole: &[(SpeciesId, f64)], line: &[(SpeciesId, f64)], more: f64) -> Parts {
    let mut out = whole.to_vec();
    for (s, n) in line {
        match out.iter_mut().find(|(o, _)| o == s) {
            Some(entry) => entry.1 += more * n,
            None => out.push((*s, more * n)),
        }
    }
    out
}
