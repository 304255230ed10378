//! Labels of solutions: whether they agree with the recipe.

use matterix_ir::quantity::show_number;
use matterix_ir::{Diagnostic, Severity, Span, Unit, codes};

use super::mended::Amount;
use crate::ast::{Expr, ExprKind, ItemKind, Labelled};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::lab::substances::Substance;
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;
use crate::units::Dimension;

/// A label of another concentration by more than this share is worth a warning where it states no tolerance.
const LOOSE: f64 = 0.05;

/// What a label says and what the recipe gives, in SI.
struct Strengths {
    stated: f64,
    actual: f64,
}

impl Strengths {
    /// How wrong the label is: an error beyond its tolerance, or beyond a factor of 2 without one; none where it is right.
    fn severity(&self, allowed: Option<f64>) -> Option<Severity> {
        let ratio = self.stated / self.actual;
        let off = (ratio - 1.0).abs();
        match allowed {
            Some(allowed) => (off > allowed).then_some(Severity::Error),
            None if !(0.5..=2.0).contains(&ratio) => Some(Severity::Error),
            None => (off > LOOSE).then_some(Severity::Warning),
        }
    }

    /// `12 % off`, `1000 times too high`.
    fn show(&self) -> String {
        let ratio = self.stated / self.actual;
        let factor = if ratio >= 1.0 { ratio } else { 1.0 / ratio };
        if self.stated == 0.0 {
            return "zero".to_string();
        }
        if factor >= 2.0 {
            let way = if ratio > 1.0 { "high" } else { "low" };
            return format!("{} times too {way}", show_number((factor * 100.0).round() / 100.0));
        }
        format!("{} % off", show_number(((ratio - 1.0).abs() * 1000.0).round() / 10.0))
    }
}

impl<'a> Elaborator<'a> {
    /// A label must agree with its recipe: beyond its tolerance, or a factor of 2 without one, it is an error; beyond
    /// 5 % a warning.
    pub fn check_label(&mut self, id: DeclId) {
        let decl = self.tables.names.decl(id);
        let ItemKind::Solution { name, labelled: Some(label), .. } = &decl.item.kind else { return };
        let composition = self.composition(id);
        if composition.is_empty() {
            return;
        }
        let Labelled { value, species, tolerance, .. } = label;
        let Ok(s) = self.tables.species.lookup(self.tables.names, decl.module, species).map_err(|d| self.report(*d))
        else {
            return;
        };
        let v = self.expr(value, &mut Scope::module(decl.module));
        let Value::Num(said) = v else { return };
        let Some(actual) = self.concentration_of(&composition, s, &said.dimension) else {
            let headline = format!("a label must be a concentration, not {}", self.describe(&said));
            let place = "not a concentration of the recipe";
            let d = Diagnostic::error(codes::CONCENTRATION_KIND, value.span, headline, place);
            self.report(d.help("label it in mol/kg, mol/L, mol/kg_solvent, g/L or %w/w"));
            return;
        };
        let Some(stated) = self.graph.constant(said.node) else { return };
        let allowed = tolerance.as_ref().and_then(|t| self.tolerance(t, &said, stated, decl.module));
        let unit = self.unit_of(&said);
        if actual == 0.0 {
            if stated != 0.0 {
                let d = self.label_of_nothing((&name.text, label), &composition, s, (&said.dimension, &unit));
                self.report(d);
            }
            return;
        }
        let strengths = Strengths { stated, actual };
        let Some(severity) = strengths.severity(allowed) else { return };
        let (how, shown, of) = (strengths.show(), unit.show(actual), &species.text);
        let headline = format!("the label of `{}` is {how}: by its recipe it contains {shown} of {of}", name.text);
        let d = Diagnostic::error(codes::LABEL_MISMATCH, value.span, headline, "contradicts the recipe");
        let mut d = Diagnostic { severity, ..d };
        if let Some(at) = self.recipe_line(decl.module, &decl.item.kind, s) {
            d = d.because(at, format!("{of} comes from here"));
        }
        let mended = rounded(actual, &unit);
        let amount = self.amount_for(&decl.item.kind, decl.module, s, (&composition, &said.dimension, stated));
        let d = d.help(format!("if the recipe is right, write `labelled {mended} of {of}`"));
        // Which of the two is wrong only a person can say: a slip in weighing must not become the label.
        let mut d = d.ask("correct the label", value.span, mended);
        if let Some(Amount { at, text, of }) = amount {
            d = d.help(format!("if the label is right, weigh in `{of}: {text}`"));
            d = d.ask(format!("correct the amount of {of}"), at, text);
        }
        self.report(d);
    }

    /// The tolerance of a label as a share of what is stated, given in SI.
    fn tolerance(&mut self, tolerance: &'a Expr, said: &Num, stated: f64, module: usize) -> Option<f64> {
        // Here, and only here, `%` stands alone: it is of the label.
        if let ExprKind::Quantity(percent, unit) = &*tolerance.kind
            && unit.text == "%"
        {
            return Some(percent / 100.0);
        }
        match self.expr(tolerance, &mut Scope::module(module)) {
            // Percent of the label, or a quantity beside it.
            Value::Num(n) if n.dimension == said.dimension => self.graph.constant(n.node).map(|d| d / stated),
            Value::Num(n) => self.graph.constant(n.node),
            _ => None,
        }
    }

    /// A label of a species that no line of the recipe holds; where it is an ion of a dry salt, the salt is meant.
    fn label_of_nothing(
        &mut self,
        (name, label): (&str, &Labelled),
        parts: &[(SpeciesId, f64)],
        s: SpeciesId,
        (kind, unit): (&Dimension, &Unit),
    ) -> Diagnostic {
        let Labelled { species, value, .. } = label;
        let ion = &species.text;
        let headline = format!("the label of `{name}` gives `{ion}`, but the recipe contains none");
        let d = Diagnostic::error(codes::LABEL_MISMATCH, species.span, headline, "in no line of the recipe");
        let gives = |p: &SpeciesId| self.tables.species.get(*p).dissolves.iter().any(|(ion, _)| *ion == s);
        let Some(salt) = parts.iter().map(|p| p.0).find(gives) else {
            return d.help(format!("label a species of the recipe, or add `{ion}` to it"));
        };
        let salt_name = self.tables.species.get(salt).name.clone();
        let d = d.help(format!("`{salt_name}` gives `{ion}` only in water, and the recipe contains no water"));
        let Some(strength) = self.concentration_of(parts, salt, kind) else { return d };
        let mended = format!("{} of {salt_name}", rounded(strength, unit));
        d.guess("label the salt", value.span.to(species.span), mended)
    }

    fn recipe_line(&mut self, module: usize, kind: &'a ItemKind, s: SpeciesId) -> Option<Span> {
        let ItemKind::Solution { fields, .. } = kind else { return None };
        let mut best = None;
        for f in fields {
            match self.substance(&f.key, module)? {
                Substance::Species(o) if o == s || self.ions_in(o, s) > 0.0 => return Some(f.span),
                Substance::Solution(id)
                    if self.composition(id).iter().any(|(o, _)| *o == s || self.ions_in(*o, s) > 0.0) =>
                {
                    best = Some(f.span);
                }
                _ => {}
            }
        }
        best
    }

    /// How many of an ion one unit of a salt, acid or base becomes in water.
    fn ions_in(&self, salt: SpeciesId, ion: SpeciesId) -> f64 {
        self.tables.species.get(salt).dissolves.iter().filter(|(of, _)| *of == ion).map(|(_, n)| n).sum()
    }

    /// mol of a species per kg of a recipe, and kg of what gives it: of a salt as it is weighed in, of an ion where
    /// there is water also what the salts give.
    fn content(&self, parts: &[(SpeciesId, f64)], s: SpeciesId) -> (f64, f64) {
        let species = &self.tables.species;
        let wet = parts.iter().any(|(part, _)| species.get(*part).is_water);
        let mut content = (0.0, 0.0);
        for (part, amount) in parts {
            let own = if *part == s { 1.0 } else { 0.0 };
            let given = own + if wet { self.ions_in(*part, s) } else { 0.0 };
            if given > 0.0 {
                content.0 += amount * given;
                content.1 += amount * species.get(*part).molar_mass;
            }
        }
        content
    }

    /// A concentration of a recipe in the kind of a dimension; of a salt undissociated, as a label means it.
    pub(super) fn concentration_of(
        &mut self,
        parts: &[(SpeciesId, f64)],
        s: SpeciesId,
        kind: &Dimension,
    ) -> Option<f64> {
        let units = &self.tables.units;
        let (amount, mass, volume) = (units.named("Amount"), units.named("Mass"), units.named("Volume"));
        let solvent = units.named("SolventMass");
        let (per_kg, solute) = self.content(parts, s);
        let molar_mass = self.tables.species.get(s).molar_mass;
        let by_mass = self.tables.species.get(s).by_mass;
        if *kind == units.named("MassFraction") || kind.is_one() {
            return Some(per_kg * molar_mass);
        }
        if *kind == amount.over(&mass) && !by_mass {
            return Some(per_kg);
        }
        if *kind == amount.over(&solvent) && !by_mass {
            return Some(per_kg / (1.0 - solute));
        }
        if *kind == amount.over(&volume) || *kind == mass.over(&volume) {
            let c = per_kg / self.volume_of(parts, self.tables.species.get(s).span)?;
            return Some(if *kind == mass.over(&volume) { c * molar_mass } else { c });
        }
        None
    }
}

/// A value with four significant digits and its unit, for a correction of the text.
fn rounded(si: f64, unit: &Unit) -> String {
    let number = show_number(format!("{:.3e}", unit.of_si(si)).parse().unwrap_or_default());
    format!("{number} {}", unit.symbol)
}
