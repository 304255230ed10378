//! Recipes: amounts per kilogram of solution.

use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Expr, ExprKind, Field, FieldValue, ItemKind};
use crate::declare::SpeciesId;
use crate::eval::lab::Elaborator;
use crate::eval::lab::substances::Substance;
use crate::eval::{Num, Scope, Value};
use crate::names::DeclId;

/// Species with mol per kg (kg per kg where counted by mass).
type Parts = Vec<(SpeciesId, f64)>;

/// How far off the mark, as a share of its volume, making up a recipe goes on, and where it has failed.
const MADE_UP: f64 = 1e-14;
const NEARLY_MADE_UP: f64 = 1e-10;

/// Far more steps of a secant than that takes.
const STEPS: usize = 60;

/// How much of a line's substance a recipe takes.
#[derive(Clone, Debug)]
enum Share {
    /// mol of each species (kg where counted by mass), to be mixed with the other amounts.
    Amounts(Parts),
    /// kg per kg of solution.
    Fraction(f64),
    /// kg per m^3 of finished solution.
    PerVolume(f64),
    /// All that the others leave.
    Rest,
}

/// A line of a recipe as it is written.
struct Line<'a> {
    field: &'a Field,
    /// Where its amount stands.
    span: Span,
    /// One kilogram of its substance.
    of: Parts,
    share: Share,
}

/// A line of a recipe that was worked out.
pub struct Portion<'a> {
    /// As written.
    pub field: &'a Field,
    /// kg per kg of solution.
    pub share: f64,
    /// mol per kg of solution (kg per kg where counted by mass).
    parts: Parts,
}

impl<'a> Elaborator<'a> {
    /// Species of a solution with mol per kg of solution (kg per kg where counted by mass); empty where the recipe is
    /// wrong, which is reported.
    pub fn composition(&mut self, id: DeclId) -> Vec<(SpeciesId, f64)> {
        let mut out: Parts = Vec::new();
        let portions = self.portions(id).unwrap_or_default();
        let is_rest = |p: &&Portion<'_>| is_rest(p.field);
        // What is left comes after what it is left by.
        for portion in portions.iter().filter(|p| !is_rest(p)).chain(portions.iter().filter(is_rest)) {
            for (s, n) in &portion.parts {
                match out.iter_mut().find(|(o, _)| o == s) {
                    Some(entry) => entry.1 += n,
                    None => out.push((*s, *n)),
                }
            }
        }
        out
    }

    /// The lines of a recipe in the order of the text; nothing where the recipe is wrong, which is reported.
    pub fn portions(&mut self, id: DeclId) -> Option<Vec<Portion<'a>>> {
        let decl = self.tables.names.decl(id);
        let ItemKind::Solution { name, fields, .. } = &decl.item.kind else { return None };
        if let Some((name, at)) = self.ring(&self.open_calls, id) {
            self.report(Diagnostic::error(
                codes::CIRCULAR,
                at,
                format!("the recipe of `{name}` contains itself"),
                "leads back to the same recipe",
            ));
            return None;
        }
        self.open_calls.push(id);
        let lines = self.recipe_lines(fields, decl.module);
        self.open_calls.pop();
        self.solve(lines?, name.span)
    }

    fn recipe_lines(&mut self, fields: &'a [Field], module: usize) -> Option<Vec<Line<'a>>> {
        let mut twice = Vec::new();
        crate::declare::fields::repeated(fields, &mut twice);
        let mut good = twice.is_empty();
        twice.into_iter().for_each(|d| self.report(d));
        let mut lines: Vec<Line<'a>> = Vec::new();
        for field in fields {
            let FieldValue::Expr(e) = &field.value else {
                let headline = format!("the amount of `{}` must be a quantity", field.key.text);
                self.report(Diagnostic::error(codes::TYPE_MISMATCH, field.span, headline, "not a quantity"));
                good = false;
                continue;
            };
            match self.recipe_line_of(field, e, module) {
                Some(line) => lines.push(line),
                None => good = false,
            }
        }
        let mut rests = lines.iter().filter(|l| matches!(l.share, Share::Rest));
        if let (Some(first), Some(again)) = (rests.next(), rests.next()) {
            let (first, again) = (first.span, again.span);
            let place = "only one line can be `rest`";
            let d = Diagnostic::error(codes::INVALID_RECIPE, again, "`rest` is given twice", place);
            self.report(d.because(first, "first given here"));
            good = false;
        }
        good.then_some(lines)
    }

    fn recipe_line_of(&mut self, field: &'a Field, e: &'a Expr, module: usize) -> Option<Line<'a>> {
        let what = self.substance(&field.key, module)?;
        let of = match &what {
            Substance::Species(s) => vec![(*s, 1.0 / self.tables.species.get(*s).molar_mass)],
            Substance::Solution(id) => self.composition(*id),
        };
        let share = if is_rest(field) {
            Share::Rest
        } else {
            match self.expr(e, &mut Scope::module(module)) {
                Value::Num(n) => self.recipe_share(field, &what, &of, n, e.span)?,
                other => {
                    self.expected("a mass, a volume, an amount, a fraction or a concentration", &other, e.span);
                    return None;
                }
            }
        };
        Some(Line { field, span: e.span, of, share })
    }

    fn recipe_share(&mut self, field: &'a Field, what: &Substance, of: &Parts, n: Num, at: Span) -> Option<Share> {
        let v = self.constant(&n, at)?;
        let units = &self.tables.units;
        let (mass, amount, volume) = (units.named("Mass"), units.named("Amount"), units.named("Volume"));
        if n.dimension == units.named("MassFraction") {
            return Some(Share::Fraction(v));
        }
        if n.dimension == mass.over(&volume) {
            return Some(Share::PerVolume(v));
        }
        if n.dimension == units.named("VolumeFraction") {
            let per_kg = self.volume_of(of, field.key.span)?;
            return Some(Share::PerVolume(v / per_kg));
        }
        let (per_volume, per_mass) = (n.dimension == amount.over(&volume), n.dimension == amount.over(&mass));
        if !per_volume && !per_mass {
            let amounts = self.amounts_of(what, n, at, &field.key).into_iter();
            let amounts: Option<Parts> = amounts.map(|(s, node)| Some((s, self.graph.constant(node)?))).collect();
            return amounts.filter(|a| !a.is_empty()).map(Share::Amounts);
        }
        let counted = match what {
            Substance::Species(s) => Some(self.tables.species.get(*s)).filter(|def| !def.by_mass),
            Substance::Solution(_) => None,
        };
        let Some(molar_mass) = counted.map(|def| def.molar_mass) else {
            let found = self.describe(&n);
            let headline = format!("`{}` has no molar mass and cannot be given as {found}", field.key.text);
            let d = Diagnostic::error(codes::CONCENTRATION_KIND, at, headline, format!("this is {found}"));
            self.report(d.help("give it in g/L, %w/w or %v/v"));
            return None;
        };
        Some(if per_volume { Share::PerVolume(v * molar_mass) } else { Share::Fraction(v * molar_mass) })
    }

    /// Masses per mass of solution: amounts are mixed, fractions completed, concentrations made up to the mark.
    fn solve(&mut self, lines: Vec<Line<'a>>, name: Span) -> Option<Vec<Portion<'a>>> {
        let rest = lines.iter().find(|l| matches!(l.share, Share::Rest)).map(|l| l.span);
        let per_volume = lines.iter().find(|l| matches!(l.share, Share::PerVolume(_))).map(|l| l.span);
        let fractions = lines.iter().filter_map(|l| match l.share {
            Share::Fraction(v) => Some(v),
            _ => None,
        });
        let (some, shares) = (fractions.clone().next().is_some(), fractions.sum::<f64>());
        let total: f64 = lines.iter().map(|l| self.mass_of(&l.share)).sum();
        let problem = match (rest, total > 0.0) {
            (_, true) if some || per_volume.is_some() => {
                Some("give a recipe either in amounts or in fractions and concentrations, not both")
            }
            (Some(_), true) => Some("`rest` is for a recipe of fractions or concentrations, not of amounts"),
            (None, false) if per_volume.is_some() => {
                Some("a recipe of concentrations needs a `rest`: the solvent that fills it up to the mark")
            }
            (Some(_), false) if shares >= 1.0 => Some("no room for `rest`: the fractions already add up to the whole"),
            (None, false) if some && (shares - 1.0).abs() > 1e-6 => {
                Some("the fractions do not add up to 1; complete them with `rest`")
            }
            (_, false) if !some && per_volume.is_none() => Some("the recipe is empty"),
            _ => None,
        };
        if let Some(problem) = problem {
            let at = rest.or(per_volume).unwrap_or(name);
            let mut d = Diagnostic::error(codes::INVALID_RECIPE, at, problem, "this recipe");
            if rest.is_none() && per_volume.is_some() && total == 0.0 {
                d = d.help("add a line such as `water: rest`");
            }
            self.report(d);
            return None;
        }
        // kg of one m^3, and kg of the rest in it; a recipe without concentrations is worked out for one kg.
        let (whole, left) = match per_volume {
            Some(_) => self.made_up(&lines, shares)?,
            None => (1.0, 1.0 - shares),
        };
        let portion = |line: Line<'a>| {
            let share = match &line.share {
                Share::Amounts(amounts) => {
                    let share = self.mass_of(&line.share) / total;
                    let parts = amounts.iter().map(|(s, n)| (*s, n / total)).collect();
                    return Portion { field: line.field, share, parts };
                }
                Share::Fraction(share) => *share,
                Share::PerVolume(mass) => mass / whole,
                Share::Rest => left / whole,
            };
            let parts = line.of.into_iter().map(|(s, n)| (s, n * share)).collect();
            Portion { field: line.field, share, parts }
        };
        Some(lines.into_iter().map(portion).collect())
    }

    /// The mass of one cubic metre of a recipe that is made up to the mark, and that of its rest, kg.
    fn made_up(&mut self, lines: &[Line<'a>], shares: f64) -> Option<(f64, f64)> {
        let species = &self.tables.species;
        let wet = lines.iter().flat_map(|l| &l.of).any(|(s, _)| species.get(*s).is_water);
        // Masses and volumes that are known, volumes per kg of the whole, volume of a kg of the rest: each line by itself.
        let (mut mass, mut volume, mut shared, mut rest) = (0.0, 0.0, 0.0, (0.0, Span::default()));
        for line in lines {
            let per_kg = self.volume_with(&line.of, wet, line.field.key.span)?;
            match line.share {
                Share::PerVolume(v) => {
                    mass += v;
                    volume += v * per_kg;
                }
                Share::Fraction(v) => shared += v * per_kg,
                Share::Rest => rest = (per_kg, line.span),
                Share::Amounts(_) => {}
            }
        }
        let (per_kg, at) = rest;
        let rise = shared + per_kg * (1.0 - shares);
        let whole = (1.0 - volume + per_kg * mass) / rise;
        let left_of = |whole: f64| whole * (1.0 - shares) - mass;
        let filled = self.filled_up(lines, wet, mass, shares, (whole, rise)).map(|whole| (whole, left_of(whole)));
        if let Some((whole, left)) = filled.filter(|(whole, left)| *whole > 0.0 && *left > 0.0) {
            return Some((whole, left));
        }
        let litres = matterix_ir::quantity::show_number((1e4 * (volume + shared * whole.max(0.0))).round() / 1e4);
        let headline = "no room for `rest`: the other components already fill the volume";
        let d = Diagnostic::error(codes::INVALID_RECIPE, at, headline, "this recipe");
        self.report(d.help(format!("they take up {litres} L of each litre of solution; use less of them")));
        None
    }

    /// The mass, kg, with which lines make one cubic metre together, from that which they would have if their volumes added up, and how
    /// their volume then rises with it: by a secant. None where no mass does.
    fn filled_up(
        &mut self,
        lines: &[Line<'a>],
        wet: bool,
        mass: f64,
        shares: f64,
        (whole, rise): (f64, f64),
    ) -> Option<f64> {
        let at = lines.first()?.field.key.span;
        let excess = |lab: &mut Self, whole: f64| {
            let of = |line: &Line<'a>| {
                let kg = match line.share {
                    Share::PerVolume(v) => v,
                    Share::Fraction(v) => v * whole,
                    Share::Rest => whole * (1.0 - shares) - mass,
                    Share::Amounts(_) => 0.0,
                };
                line.of.iter().map(|(s, n)| (*s, n * kg)).collect::<Parts>()
            };
            Some(lab.volume_with(&lines.iter().flat_map(of).collect::<Parts>(), wet, at)? - 1.0)
        };
        let (mut whole, mut rise) = (whole, rise);
        let mut over = excess(self, whole)?;
        for _ in 0..STEPS {
            let next = whole - over / rise;
            if over.abs() <= MADE_UP || next == whole {
                break;
            }
            let over_next = excess(self, next)?;
            if over_next != over {
                rise = (over_next - over) / (next - whole);
            }
            (whole, over) = (next, over_next);
        }
        (over.abs() <= NEARLY_MADE_UP).then_some(whole)
    }

    /// kg of what is given as amounts.
    fn mass_of(&self, share: &Share) -> f64 {
        match share {
            Share::Amounts(all) => all.iter().map(|(s, n)| n * self.tables.species.get(*s).molar_mass).sum(),
            _ => 0.0,
        }
    }

    fn constant(&mut self, n: &Num, span: Span) -> Option<f64> {
        let v = self.graph.constant(n.node).filter(|v| v.is_finite() && *v >= 0.0);
        if v.is_none() {
            self.report(Diagnostic::error(
                codes::INVALID_RECIPE,
                span,
                "a recipe needs constant quantities of 0 or more",
                "not such a quantity",
            ));
        }
        v
    }
}

/// Whether a line is what the others leave.
fn is_rest(field: &Field) -> bool {
    matches!(&field.value, FieldValue::Expr(e) if matches!(&*e.kind, ExprKind::Name(n) if n.text == "rest"))
}
