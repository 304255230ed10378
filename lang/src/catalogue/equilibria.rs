//! The equilibria in which substances take part, with their constants as the texts state them.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::Span;

use super::source::{Source, explained, tags};
use super::{Substance, Text, field, part};
use crate::ast::{Expr, ExprKind, Field, FieldValue, ItemKind, Term, Unary};
use crate::chem::Phase;
use crate::chem::constants::{ANALYTIC, CONSTANTS, HEAT, LOG_PARTITION, PARTITION, POTENTIAL};

/// An equilibrium in which a substance takes part.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// As written: `acetic_acid <-> H+ + acetate`.
    pub equation: String,
    /// Its module, or file.
    pub module: String,
    /// What it is about.
    pub kind: Kind,
    /// Its constant; none where it states none.
    pub constant: Option<Constant>,
    /// As written: `-0.41 kJ/mol`.
    pub enthalpy: Option<String>,
    /// The temperatures for which the constant serves, as written.
    pub valid: Option<String>,
    /// Where its numbers come from.
    pub sources: Vec<Source>,
    /// The ion of the substance that stands in the equation; none where it does so itself.
    pub ion: Option<String>,
}

/// The constant of an equilibrium.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// `pKa`, `pKsp`, `log K`.
    pub symbol: &'static str,
    /// Its number, with a unit where it has one: `4.756`, `0.770 V`.
    pub value: String,
    /// The temperature of the constant: `25 degC`.
    pub at: String,
}

/// What an equilibrium is about, in the order in which a page has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// An acid that gives off H+, and water.
    Acid,
    /// A solid that dissolves.
    Solid,
    /// A gas that dissolves.
    Gas,
    /// A half-cell.
    HalfCell,
    /// A species between water and another liquid.
    Partition,
    /// Complexes, and all others.
    Complex,
}

impl Kind {
    /// Its heading.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Acid => "acids and bases",
            Kind::Solid => "solubility",
            Kind::Gas => "gases",
            Kind::HalfCell => "half-cells",
            Kind::Partition => "partition",
            Kind::Complex => "complexes",
        }
    }
}

/// The temperature of a constant that states none.
const AT: (&str, f64) = ("25 degC", 298.15);

/// Species that take part in most equilibria: that a salt gives them off says nothing of the salt.
const COMMON: &[&str] = &["water", "H+", "OH-", "e-"];

/// Adds to each substance the equilibria in which it, or an ion that it gives, takes part: its own ones first, then those of the ions with the
/// fewest.
pub(super) fn take_part(texts: &[Text], all: &mut [Substance]) {
    let solids: BTreeSet<String> =
        all.iter().filter(|s| s.is_solid_salt()).flat_map(Substance::names).map(str::to_string).collect();
    let parts: Vec<(Part, BTreeSet<String>)> = texts.iter().flat_map(|text| of_text(text, &solids)).collect();
    let mut by_name: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, (_, species)) in parts.iter().enumerate() {
        species.iter().for_each(|name| by_name.entry(name).or_default().push(index));
    }
    let of = |name: &str| by_name.get(name).map_or(&[][..], Vec::as_slice);
    for s in all {
        let mut seen: BTreeSet<usize> = BTreeSet::new();
        let own: Vec<usize> = s.names().flat_map(of).copied().filter(|index| seen.insert(*index)).collect();
        let mut found: Vec<Part> = own.into_iter().map(|index| parts[index].0.clone()).collect();
        let mut ions: Vec<&String> = s.ions.iter().filter(|ion| !COMMON.contains(&ion.as_str())).collect();
        ions.sort_by_key(|ion| of(ion).len());
        for ion in ions {
            let fresh = of(ion).iter().filter(|index| seen.insert(**index));
            found.extend(fresh.map(|index| Part { ion: Some(ion.clone()), ..parts[*index].0.clone() }));
        }
        found.sort_by_key(|part| part.kind);
        s.equilibria = found;
    }
}

/// The equilibria of a text, each with the names of its species.
fn of_text(text: &Text, solids: &BTreeSet<String>) -> Vec<(Part, BTreeSet<String>)> {
    let explained = explained(&text.tree.docs);
    let mut out = Vec::new();
    for item in &text.tree.items {
        let ItemKind::Equilibrium { name, reactants, products, fields } = &item.kind else { continue };
        let (Some(first), Some(last)) = (reactants.first(), products.last()) else { continue };
        let written = |key| field_text(text, fields, key);
        let given = CONSTANTS.iter().find_map(|key| fields.iter().find(|f| f.key.text == *key));
        let kind = kind(given, (reactants, products), solids);
        let mut sources: Vec<Source> = Vec::new();
        for field in [given, fields.iter().find(|f| f.key.text == HEAT)].into_iter().flatten() {
            for source in tags(&text.text, field.span, &explained) {
                if !sources.iter().any(|known| known.tag == source.tag) {
                    sources.push(source);
                }
            }
        }
        if let Some(FieldValue::Expr(Expr { kind, .. })) = field(fields, "source")
            && let ExprKind::Text(said) = &**kind
        {
            sources.push(Source { tag: None, text: said.clone(), remark: String::new() });
        }
        let part = Part {
            name: name.text.clone(),
            equation: part(&text.text, Span { end: last.span.end, ..first.span }).to_string(),
            module: text.module.clone(),
            kind,
            constant: given.map(|given| constant(text, given, fields, (kind, reactants))),
            enthalpy: written("enthalpy").or_else(|| written(HEAT)),
            valid: written("valid"),
            sources,
            ion: None,
        };
        let species = reactants.iter().chain(products).map(|term| bare(&term.species.text).to_string()).collect();
        out.push((part, species));
    }
    out
}

/// A field as written behind its colon.
fn field_text(text: &Text, fields: &[Field], key: &str) -> Option<String> {
    fields.iter().find(|f| f.key.text == key).map(|f| value_text(text, f))
}

fn value_text(text: &Text, field: &Field) -> String {
    let whole = part(&text.text, field.span);
    whole.split_once(':').map_or(whole, |(_, value)| value).trim().to_string()
}

/// What an equilibrium is about, by its constant and its equation.
fn kind(given: Option<&Field>, (reactants, products): (&[Term], &[Term]), solids: &BTreeSet<String>) -> Kind {
    let key = given.map_or("", |given| given.key.text.as_str());
    let all = || reactants.iter().chain(products).map(|term| term.species.text.as_str());
    let is_phase = |phase| all().any(|name| Phase::split(name).1 == Some(phase));
    match key {
        POTENTIAL => Kind::HalfCell,
        PARTITION | LOG_PARTITION => Kind::Partition,
        "pka" => Kind::Acid,
        "ksp" | "pksp" => Kind::Solid,
        _ if all().any(|name| name == "e-") => Kind::HalfCell,
        _ if is_phase(Phase::Gas) => Kind::Gas,
        _ if is_phase(Phase::Solid) || all().any(|name| solids.contains(name)) => Kind::Solid,
        _ if gives_one_proton(reactants, products) => Kind::Acid,
        _ => Kind::Complex,
    }
}

/// Whether an equation is that of an acid, or of water, and of nothing that an ion of a metal forms with water.
fn gives_one_proton(reactants: &[Term], products: &[Term]) -> bool {
    let dry = |side: &'_ [Term]| side.iter().filter(|term| term.species.text != "water").count();
    let is_ion = reactants.iter().any(|term| term.species.text.ends_with('+'));
    let is_wet = dry(reactants) < reactants.len();
    let proton = products.iter().filter(|term| term.species.text == "H+").collect::<Vec<_>>();
    matches!(proton.as_slice(), [one] if one.coefficient == 1.0) && dry(reactants) <= 1 && !(is_ion && is_wet)
}

/// A constant as a chemist writes it: an acid that is given by `analytic` has a pKa too.
fn constant(text: &Text, given: &Field, fields: &[Field], (kind, reactants): (Kind, &[Term])) -> Constant {
    let at = field_text(text, fields, "at").unwrap_or_else(|| AT.0.to_string());
    let is_acid = kind == Kind::Acid && reactants.iter().any(|term| term.species.text != "water");
    if given.key.text == ANALYTIC {
        let (symbol, sign) = if is_acid { ("pKa", -1.0) } else { ("log K", 1.0) };
        return match log_constant(&given.value) {
            Some(log) => Constant { symbol, value: rounded(sign * log), at },
            None => Constant { symbol: "log K", value: value_text(text, given), at: "T in K".to_string() },
        };
    }
    let symbol = match given.key.text.as_str() {
        "log_constant" => "log K",
        "pka" => "pKa",
        "ksp" => "Ksp",
        "pksp" => "pKsp",
        POTENTIAL => "E",
        PARTITION => "P",
        LOG_PARTITION => "log P",
        _ => "K",
    };
    Constant { symbol, value: value_text(text, given), at }
}

/// log10 K of `analytic` at 25 degC, where its numbers are written as numbers.
fn log_constant(value: &FieldValue) -> Option<f64> {
    let FieldValue::Expr(expr) = value else { return None };
    let ExprKind::List(numbers) = &*expr.kind else { return None };
    let t = AT.1;
    let powers = [1.0, t, 1.0 / t, t.log10(), 1.0 / (t * t), t * t];
    let numbers: Vec<f64> = numbers.iter().map(number).collect::<Option<_>>()?;
    (numbers.len() <= powers.len()).then(|| numbers.iter().zip(powers).map(|(a, power)| a * power).sum())
}

/// A number as it stands, with its sign.
fn number(e: &Expr) -> Option<f64> {
    match &*e.kind {
        ExprKind::Number(n) => Some(*n),
        ExprKind::Unary(Unary::Neg, inner) => number(inner).map(|n| -n),
        _ => None,
    }
}

/// To three decimals, without zeros at the end.
fn rounded(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// A species without the phase that an equation states.
fn bare(name: &str) -> &str {
    Phase::split(name).0
}
