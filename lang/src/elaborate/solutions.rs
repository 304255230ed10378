//! Recipes: amounts per kilogram of solution.

use matterix_ir::{Diagnostic, Span, codes};

use super::contents::Substance;
use super::{Elaborator, SpeciesId};
use crate::ast::{ExprKind, FieldValue, ItemKind};
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;

impl<'a> Elaborator<'a> {
    /// Species of a solution with mol per kg of solution (kg per kg where counted by mass); empty where the recipe is
    /// wrong, which is reported.
    pub fn composition(&mut self, id: DeclId) -> Vec<(SpeciesId, f64)> {
        let decl = self.tables.names.decl(id);
        let ItemKind::Solution { name, fields, .. } = &decl.item.kind else { return Vec::new() };
        if let Some((name, at)) = self.ring(&self.open_calls, id) {
            self.report(Diagnostic::error(
                codes::CIRCULAR,
                at,
                format!("the recipe of `{name}` contains itself"),
                "leads back to the same recipe",
            ));
            return Vec::new();
        }
        self.open_calls.push(id);
        let out = self.recipe(fields, decl.module, name.span);
        self.open_calls.pop();
        out.unwrap_or_default()
    }

    fn recipe(&mut self, fields: &'a [crate::ast::Field], module: usize, span: Span) -> Option<Vec<(SpeciesId, f64)>> {
        let units = &self.tables.units;
        let fraction = units.named("MassFraction");
        let mut absolute: Vec<(SpeciesId, f64)> = Vec::new();
        let mut fractions: Vec<(Vec<(SpeciesId, f64)>, f64)> = Vec::new();
        let mut rest: Option<(Vec<(SpeciesId, f64)>, Span)> = None;
        let mut good = true;
        let mut twice = Vec::new();
        super::fields::repeated(fields, &mut twice);
        good &= twice.is_empty();
        for d in twice {
            self.report(d);
        }
        for f in fields {
            let Some(what) = self.substance(&f.key, module) else {
                good = false;
                continue;
            };
            let FieldValue::Expr(e) = &f.value else { continue };
            let per_kg = match &what {
                Substance::Species(s) => vec![(*s, 1.0 / self.tables.species.get(*s).molar_mass)],
                Substance::Solution(id) => self.composition(*id),
            };
            if matches!(&*e.kind, ExprKind::Name(n) if n.text == "rest") {
                if let Some((_, first)) = &rest {
                    self.report(
                        Diagnostic::error(
                            codes::INVALID_RECIPE,
                            e.span,
                            "`rest` is given twice",
                            "only one line can be the rest",
                        )
                        .because(*first, "first given here"),
                    );
                    good = false;
                }
                rest = Some((per_kg, e.span));
                continue;
            }
            let value = self.expr(e, &mut Scope::module(module));
            let Value::Num(n) = value else {
                self.expected("a mass, a volume, an amount or a fraction", &value, e.span);
                good = false;
                continue;
            };
            if n.dimension == fraction {
                let v = self.constant(&n, e.span)?;
                fractions.push((per_kg, v));
                continue;
            }
            self.constant(&n, e.span)?;
            let amounts = self.amounts_of(&what, n, e.span, &f.key);
            good &= !amounts.is_empty();
            for (s, node) in amounts {
                absolute.push((s, self.graph.constant(node)?));
            }
        }
        if !good {
            return None;
        }
        let total: f64 = absolute.iter().map(|(s, n)| n * self.tables.species.get(*s).molar_mass).sum();
        let shares: f64 = fractions.iter().map(|f| f.1).sum();
        let problem = match (&rest, total > 0.0, fractions.is_empty()) {
            (_, true, false) => Some("a recipe is given either in amounts or in fractions, not both"),
            (Some(_), true, true) => Some("`rest` completes a recipe of fractions, not of amounts"),
            (Some(_), false, _) if shares >= 1.0 => {
                Some("nothing is left for `rest`: the fractions already make up the whole")
            }
            (None, false, false) if (shares - 1.0).abs() > 1e-6 => {
                Some("the fractions do not add up to the whole; complete them with `rest`")
            }
            (_, false, true) => Some("the recipe is empty"),
            _ => None,
        };
        if let Some(problem) = problem {
            let at = rest.as_ref().map_or(span, |r| r.1);
            self.report(Diagnostic::error(codes::INVALID_RECIPE, at, problem, "this recipe"));
            return None;
        }
        let mut out: Vec<(SpeciesId, f64)> = Vec::new();
        let mut add = |s: SpeciesId, n: f64| match out.iter_mut().find(|(o, _)| *o == s) {
            Some(entry) => entry.1 += n,
            None => out.push((s, n)),
        };
        for (s, n) in absolute {
            add(s, n / total);
        }
        if let Some((per_kg, _)) = rest {
            fractions.push((per_kg, 1.0 - shares));
        }
        for (per_kg, share) in fractions {
            for (s, n) in per_kg {
                add(s, n * share);
            }
        }
        Some(out)
    }

    fn constant(&mut self, n: &Num, span: Span) -> Option<f64> {
        let v = self.graph.constant(n.node).filter(|v| v.is_finite() && *v >= 0.0);
        if v.is_none() {
            self.report(Diagnostic::error(
                codes::INVALID_RECIPE,
                span,
                "a recipe needs constant quantities that are not negative",
                "not one",
            ));
        }
        v
    }
}
