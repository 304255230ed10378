//! Recipes: amounts per kilogram of solution, and whether the label agrees.

use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, Span, codes};

use super::contents::Substance;
use super::{Elaborator, SpeciesId};
use crate::ast::{ExprKind, FieldValue, ItemKind, Labelled};
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;
use crate::units::Dimension;

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

    /// A label must agree with its recipe: beyond its tolerance, or a factor of 2 without one, it is an error; beyond
    /// 5 % a warning.
    pub fn check_label(&mut self, id: DeclId) {
        let decl = self.tables.names.decl(id);
        let ItemKind::Solution { name, labelled: Some(label), .. } = &decl.item.kind else { return };
        let composition = self.composition(id);
        if composition.is_empty() {
            return;
        }
        let Labelled { value, species, tolerance, span } = label;
        let Ok(s) = self.tables.species.lookup(self.tables.names, decl.module, species).map_err(|d| self.report(*d))
        else {
            return;
        };
        let v = self.expr(value, &mut Scope::module(decl.module));
        let Value::Num(stated) = v else { return };
        let Some(actual) = self.concentration_of(&composition, s, &stated.dimension) else {
            let found = self.describe(&stated);
            self.report(
                Diagnostic::error(
                    codes::CONCENTRATION_KIND,
                    value.span,
                    format!("a label cannot be {found}"),
                    "not a concentration of the recipe",
                )
                .help("label it in mol/kg, mol/L, mol/kg_solvent, g/L or %w/w"),
            );
            return;
        };
        let Some(stated_si) = self.graph.constant(stated.node) else { return };
        let allowed = tolerance.as_ref().and_then(|t| {
            // Here, and only here, `%` stands alone: it is of the label.
            if let ExprKind::Quantity(percent, unit) = &*t.kind
                && unit.text == "%"
            {
                return Some(percent / 100.0);
            }
            let v = self.expr(t, &mut Scope::module(decl.module));
            match v {
                // Percent of the label, or a quantity beside it.
                Value::Num(n) if n.dimension == stated.dimension => self.graph.constant(n.node).map(|d| d / stated_si),
                Value::Num(n) => self.graph.constant(n.node),
                _ => None,
            }
        });
        let unit = self.unit_of(&stated);
        let ratio = stated_si / actual;
        let off = (ratio - 1.0).abs();
        let is_error = match allowed {
            Some(t) => off > t,
            None => !(0.5..=2.0).contains(&ratio),
        };
        if !is_error && (allowed.is_some() || off <= 0.05) {
            return;
        }
        let factor = if ratio >= 1.0 { ratio } else { 1.0 / ratio };
        let how = if factor >= 2.0 {
            format!(
                "{} times too {}",
                show_number((factor * 100.0).round() / 100.0),
                if ratio > 1.0 { "high" } else { "low" }
            )
        } else {
            format!("{} % off", show_number((off * 1000.0).round() / 10.0))
        };
        let shown = unit.show(actual);
        let short = Diagnostic::error(
            codes::LABEL_MISMATCH,
            value.span,
            format!("the label of `{}` is {how}: its recipe gives {shown} of {}", name.text, species.text),
            "does not agree with the recipe",
        )
        .because(name.span.to(*span), "the recipe");
        let mut d = if is_error { short } else { Diagnostic { severity: matterix_ir::Severity::Warning, ..short } };
        d.labels.truncate(1);
        let line = self.recipe_line(decl.module, &decl.item.kind, s);
        if let Some(at) = line {
            d = d.because(at, format!("{} comes from here", species.text));
        }
        let rounded = show_number(format!("{:.3e}", unit.of_si(actual)).parse().unwrap_or_default());
        let mended = format!("{rounded} {}", unit.symbol);
        self.report(d.help(format!("write `labelled {mended} of {}`", species.text)).guess(
            "correct the label",
            value.span,
            mended,
        ));
    }

    fn recipe_line(&mut self, module: usize, kind: &'a ItemKind, s: SpeciesId) -> Option<Span> {
        let ItemKind::Solution { fields, .. } = kind else { return None };
        let mut best = None;
        for f in fields {
            match self.substance(&f.key, module)? {
                Substance::Species(o) if o == s => return Some(f.span),
                Substance::Solution(id) if self.composition(id).iter().any(|(o, _)| *o == s) => best = Some(f.span),
                _ => {}
            }
        }
        best
    }

    /// A concentration of a recipe in the kind of a dimension; undissociated, as a label means it.
    fn concentration_of(&mut self, parts: &[(SpeciesId, f64)], s: SpeciesId, kind: &Dimension) -> Option<f64> {
        let units = &self.tables.units;
        let (amount, mass, volume) = (units.named("Amount"), units.named("Mass"), units.named("Volume"));
        let solvent = units.named("SolventMass");
        let per_kg = parts.iter().find(|p| p.0 == s).map_or(0.0, |p| p.1);
        let molar_mass = self.tables.species.get(s).molar_mass;
        let by_mass = self.tables.species.get(s).by_mass;
        if *kind == units.named("MassFraction") || kind.is_one() {
            return Some(per_kg * molar_mass);
        }
        if *kind == amount.over(&mass) && !by_mass {
            return Some(per_kg);
        }
        if *kind == amount.over(&solvent) && !by_mass {
            return Some(per_kg / (1.0 - per_kg * molar_mass));
        }
        let name = crate::ast::Name { text: String::new(), span: self.tables.species.get(s).span };
        if *kind == amount.over(&volume) || *kind == mass.over(&volume) {
            let mut litres = 0.0;
            for (p, n) in parts {
                let probe = crate::ast::Name { text: "molar_volume".into(), ..name.clone() };
                let Value::Num(v) = self.member(Value::Species(*p), &probe) else { return None };
                litres += n * self.graph.constant(v.node)?;
            }
            let c = per_kg / litres;
            return Some(if *kind == mass.over(&volume) { c * molar_mass } else { c });
        }
        None
    }
}
