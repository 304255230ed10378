//! The table of equilibria, and the checks that need no lab: balance, and what constants are of.

use std::collections::BTreeSet;

use matterix_ir::{Diagnostic, Span, codes};

use super::SpeciesId;
use super::fields::unknown_fields;
use super::reactions::{check_balance, equation};
use super::species::{SpeciesTable, field};
use crate::ast::{Field, ItemKind};
use crate::chem::constants::{ANALYTIC, CONSTANTS, HEAT, LOG_PARTITION, PARTITION, POTENTIAL};
use crate::names::{Decl, Names, item_name};

const FIELDS: &[&str] = &["at", "enthalpy", HEAT, "valid", "source"];

/// An equilibrium whose species are all known.
#[derive(Clone, Debug)]
pub struct EquilibriumDef<'a> {
    /// Its name.
    pub name: String,
    /// Its module.
    pub module: usize,
    /// Its species with their coefficients: products count up, reactants down.
    pub terms: Vec<(SpeciesId, f64)>,
    /// Which of them are pure solids.
    pub solids: Vec<SpeciesId>,
    /// The gas whose solubility it says, with what it dissolves as: then it says nothing of amounts, and is solved for the pressure alone.
    pub gas: Option<(SpeciesId, SpeciesId)>,
    /// Its fields.
    pub fields: &'a [Field],
    /// Its equation.
    pub equation: Span,
    /// Its name.
    pub span: Span,
}

impl EquilibriumDef<'_> {
    /// Whether a species is in its equation.
    pub fn involves(&self, s: SpeciesId) -> bool {
        self.terms.iter().any(|(t, _)| *t == s)
    }

    /// Whether two species are on the same side of its equation; none where it lacks one.
    pub fn sides(&self, a: SpeciesId, b: SpeciesId) -> Option<bool> {
        let side = |s| self.terms.iter().find(|(t, _)| *t == s).map(|(_, n)| *n > 0.0);
        Some(side(a)? == side(b)?)
    }

    /// Its solid, and 1 where it dissolves from left to right or -1: where a mole of it becomes a mole of one species, and those are as asked.
    pub fn dissolving_whole(&self, wanted: impl Fn(SpeciesId, SpeciesId) -> bool) -> Option<(SpeciesId, f64)> {
        let ([(a, from), (b, to)], [solid]) = (self.terms.as_slice(), self.solids.as_slice()) else { return None };
        let (other, way) = if a == solid { (b, *to) } else { (a, *from) };
        (from + to == 0.0 && wanted(*solid, *other)).then(|| (*solid, way.signum()))
    }
}

/// Reads every `equilibrium` item; those with unknown species are reported and left out.
pub fn collect<'a>(
    names: &'a Names<'a>,
    species: &SpeciesTable<'a>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<EquilibriumDef<'a>> {
    let mut out: Vec<EquilibriumDef<'a>> = Vec::new();
    // Those of the library hold where a file asks for them.
    let all = || names.in_use(|kind| matches!(kind, ItemKind::Equilibrium { .. }));
    let is_library = |decl: &&Decl<'a>| names.modules[decl.module].is_library();
    let name_of = |decl: &Decl<'a>| item_name(decl.item).map(|(name, _)| name);
    let own: BTreeSet<String> = all().filter(|decl| !is_library(decl)).filter_map(name_of).collect();
    // One of the file's own takes the place of the library's.
    let is_replaced = |decl: &&Decl<'a>| is_library(decl) && name_of(decl).is_some_and(|name| own.contains(&name));
    for decl in all().filter(|decl| !is_replaced(decl)) {
        let ItemKind::Equilibrium { name, reactants, products, fields } = &decl.item.kind else { continue };
        let known: Vec<&str> = CONSTANTS.iter().chain(FIELDS).copied().collect();
        unknown_fields(fields, &known, "an equilibrium", diagnostics);
        let Some((left, right)) = species.sides(names, decl.module, (reactants, products), diagnostics) else {
            continue;
        };
        let equation = equation(name, reactants, products);
        let before = diagnostics.len();
        check_balance(species, &left, &right, equation, &name.text, diagnostics);
        check_constant((&name.text, name.span), fields, diagnostics);
        check_form(species, (&left, &right), fields, equation, diagnostics);
        if diagnostics[before..].iter().any(Diagnostic::is_error) {
            continue;
        }
        let solids = solids(species, (&left, &right), fields);
        let gas = match gas_form(species, (&left, &right), equation, &out) {
            Ok(gas) => gas,
            Err(d) => {
                diagnostics.push(*d);
                continue;
            }
        };
        let mut terms: Vec<(SpeciesId, f64)> = Vec::new();
        for (s, n) in left.into_iter().map(|(s, n)| (s, -n)).chain(right) {
            match terms.iter_mut().find(|(t, _)| *t == s) {
                Some((_, known)) => *known += n,
                None => terms.push((s, n)),
            }
        }
        terms.retain(|(_, n)| *n != 0.0);
        let (name, span) = (name.text.clone(), name.span);
        out.push(EquilibriumDef { name, module: decl.module, terms, solids, gas, fields, equation, span });
    }
    out
}

/// One of the fields gives its constant.
fn check_constant((name, span): (&str, Span), fields: &[Field], diagnostics: &mut Vec<Diagnostic>) {
    let mut given = CONSTANTS.iter().filter_map(|key| field(fields, key));
    match (given.next(), given.next()) {
        (None, _) => diagnostics.push(
            Diagnostic::error(
                codes::MISSING_FIELD,
                span,
                format!("`{name}` has no constant"),
                "the position of this equilibrium is unknown",
            )
            .help(
                "add `constant: 1e-14`, `log_constant: -14`, `pka: 4.76`, `ksp: 1.8e-10`, `pksp: 9.75`, `partition: 85` for a second liquid, or `potential: 0.77 V` for a half-cell",
            ),
        ),
        (Some(first), Some(second)) => diagnostics.push(
            Diagnostic::error(
                codes::UNKNOWN_FIELD,
                second.key.span,
                format!("`{name}` has two constants"),
                "the second one",
            )
            .because(first.key.span, "the first one"),
        ),
        (Some(first), None) if first.key.text != ANALYTIC && field(fields, HEAT).is_some() => {
            let Some(heat) = field(fields, HEAT) else { return };
            let headline = format!("use `enthalpy` for the heat of `{name}`");
            let d = Diagnostic::error(codes::UNKNOWN_FIELD, heat.key.span, headline, "only allowed with `analytic`");
            diagnostics.push(d.because(first.key.span, "its constant").help("write `enthalpy`"));
        }
        (Some(first), None) if first.key.text == ANALYTIC => {
            for second in ["at", "enthalpy"].iter().filter_map(|key| field(fields, key)) {
                let headline = format!("`{name}` has a constant at every temperature");
                let label = format!("`{}` follows from `analytic`", second.key.text);
                let d = Diagnostic::error(codes::UNKNOWN_FIELD, second.key.span, headline, label);
                diagnostics.push(d.because(first.key.span, "given here").help("leave it out"));
            }
        }
        _ => {}
    }
}

/// Species with their coefficients on the two sides.
type Sides<'s> = (&'s [(SpeciesId, f64)], &'s [(SpeciesId, f64)]);

/// A pKa is that of an acid which gives off H+, a solubility product that of one solid which dissolves.
fn check_form(
    species: &SpeciesTable<'_>,
    (left, right): Sides<'_>,
    fields: &[Field],
    equation: Span,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let is_proton = |s: &SpeciesId| species.get(*s).formula.as_ref().is_some_and(|f| f.to_string() == "H+");
    let dry = |side: &[(SpeciesId, f64)]| dry_terms(species, side).len();
    if let Some(f) = field(fields, "pka") {
        let gives = right.iter().any(|(s, n)| is_proton(s) && *n == 1.0) && dry(left) == 1;
        if !gives {
            let headline = "`pka` needs the equation of an acid: `HA <-> H+ + A-`";
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, "does not release one H+");
            let d = d.because(f.key.span, "the pKa is here");
            diagnostics.push(d.help("write the equation of the acid, or give `log_constant` for this one"));
        }
    }
    if let Some(f) = field(fields, POTENTIAL) {
        let electrons = |side: &[(SpeciesId, f64)]| side.iter().any(|(s, _)| species.get(*s).is_electron);
        if !electrons(left) || electrons(right) {
            let headline = "`potential` needs a half-cell written as a reduction: `Fe3+ + e- <-> Fe2+`";
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, "no electrons on its left side");
            let d = d.because(f.key.span, "the potential is here");
            diagnostics.push(d.help("write it as a reduction, with `e-` on the left"));
        }
    }
    if let Some(f) = field(fields, PARTITION).or_else(|| field(fields, LOG_PARTITION)) {
        let is_in = |side: &[(SpeciesId, f64)], apart: bool| match dry_terms(species, side)[..] {
            [(s, n)] => n == 1.0 && species.get(s).liquid.is_some() == apart,
            _ => false,
        };
        let liquid = dry_terms(species, right).first().and_then(|(s, _)| species.get(*s).liquid);
        let is_dense =
            |s: SpeciesId| ["density", "molar_volume"].iter().any(|key| field(species.get(s).fields, key).is_some());
        if let Some(liquid) = liquid.filter(|liquid| !is_dense(*liquid)) {
            let headline = format!("the density of `{}` is not known", species.get(liquid).name);
            let label = "a partition constant compares concentrations";
            let d = Diagnostic::error(codes::MISSING_FIELD, f.span, headline, label);
            diagnostics.push(d.help("give the density of the liquid, or the ratio of molalities as `constant`"));
        }
        if !is_in(left, false) || !is_in(right, true) {
            let headline =
                "`partition` needs the equation of one species between water and another liquid: `I2 <-> I2_org`";
            let label = "the right side is not one species `dissolved_in` another liquid";
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, label);
            let d = d.because(f.key.span, "the partition constant is here");
            diagnostics.push(d.help("declare the other form, `species I2_org { formula: \"I2\", dissolved_in: CHCl3 }`, or give `log_constant` for another equation"));
        }
    }
    let is_one_solid =
        dry(left) == 1 && left.iter().all(|(s, n)| species.get(*s).is_water || (*n == 1.0 && !species.get(*s).is_gas));
    if let Some(f) = field(fields, "ksp").or_else(|| field(fields, "pksp")).filter(|_| !is_one_solid) {
        let headline = "a solubility product needs the equation of one solid: `AgCl <-> Ag+ + Cl-`";
        let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, "its left side is not one solid");
        diagnostics.push(d.because(f.key.span, "the solubility product is here"));
    }
}

/// A side of an equation without water.
fn dry_terms(species: &SpeciesTable<'_>, side: &[(SpeciesId, f64)]) -> Vec<(SpeciesId, f64)> {
    side.iter().copied().filter(|(s, _)| !species.get(*s).is_water).collect()
}

/// The gas of an equation and what it dissolves as, `CO2(g) <-> CO2`; an error where a gas stands in an equation of another form, or where
/// one `before` has it.
fn gas_form(
    species: &SpeciesTable<'_>,
    (left, right): Sides<'_>,
    equation: Span,
    before: &[EquilibriumDef<'_>],
) -> Result<Option<(SpeciesId, SpeciesId)>, Box<Diagnostic>> {
    let is_gas = |(s, _): &&(SpeciesId, f64)| species.get(*s).is_gas;
    let Some(&(gas, _)) = left.iter().chain(right).find(is_gas) else { return Ok(None) };
    let name = &species.get(gas).name;
    let wrong = |headline: String, label: &str| {
        let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, label);
        Box::new(
            d.help("write the gas and its dissolved form only, and later reactions on their own: `CO2(g) <-> CO2`"),
        )
    };
    let dry = |side: &'_ [(SpeciesId, f64)]| dry_terms(species, side);
    let headline = format!("the equilibrium of the gas `{name}` must give its solubility");
    let [(dissolved, one)] = dry(right)[..] else {
        return Err(wrong(headline, "its right side is not one dissolved species"));
    };
    if dry(left).len() != 1 || !species.get(dry(left)[0].0).is_gas {
        return Err(wrong(headline, "its left side is not one gas"));
    }
    if one != 1.0 || dry(left)[0].1 != 1.0 {
        return Err(wrong(headline, "both coefficients must be 1"));
    }
    let def = species.get(dissolved);
    if !def.is_aqueous() || def.charge() != 0 {
        return Err(wrong(headline, &format!("`{}` is not a neutral dissolved species", def.name)));
    }
    match before.iter().find(|e| e.gas.is_some_and(|(other, _)| other == gas)) {
        Some(first) => {
            let d = wrong(format!("`{name}` has two equilibria"), "the second one");
            Err(Box::new(d.because(first.equation, format!("`{}` is the first one", first.name))))
        }
        None => Ok(Some((gas, dissolved))),
    }
}

/// The pure solids of an equation: what a solubility product is of, what is written as one, and solids that split into ions as soon as they
/// dissolve, which are in no solution as they stand.
fn solids(species: &SpeciesTable<'_>, (left, right): Sides<'_>, fields: &[Field]) -> Vec<SpeciesId> {
    let of_product = ["ksp", "pksp"].iter().any(|key| field(fields, key).is_some());
    let all = left.iter().map(|(s, _)| (*s, true)).chain(right.iter().map(|(s, _)| (*s, false)));
    let is_solid = |(s, on_left): &(SpeciesId, bool)| {
        let def = species.get(*s);
        let is_salt = def.phase() == Some("solid") && !def.dissolves.is_empty();
        def.name.ends_with("(s)") || is_salt || (of_product && *on_left && !def.is_water)
    };
    all.filter(is_solid).map(|(s, _)| s).collect()
}
