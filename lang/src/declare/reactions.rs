//! The reaction table, and the checks that need no lab: balance and template.

use matterix_ir::{Diagnostic, Span, codes};

use super::fields::{forms, unknown_fields};
use super::species::{SpeciesTable, field};
use super::tables::ReactionDef;
use crate::ast::{ExprKind, Field, FieldValue, ItemKind, Name, Term};
use crate::chem::balance::{self, BalanceError, Imbalance};
use crate::chem::formula::Formula;
use crate::chem::template::{self, Participant, TemplateError};
use crate::names::Names;

const FIELDS: &[&str] = &["rate", "order", "valid", "requires", "enthalpy", "template", "reverse", "reverse_order"];

/// Where an equation stands.
pub fn equation(name: &Name, reactants: &[Term], products: &[Term]) -> Span {
    Span::to(reactants.first().map_or(name.span, |t| t.span), products.last().map_or(name.span, |t| t.span))
}

/// Reads every `reaction` item; those with unknown species are reported and left out.
pub fn collect<'a>(
    names: &'a Names<'a>,
    species: &SpeciesTable<'a>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<ReactionDef<'a>> {
    let mut out = Vec::new();
    for decl in &names.decls {
        let ItemKind::Reaction { name, reactants, reversible, products, fields } = &decl.item.kind else { continue };
        unknown_fields(fields, FIELDS, "a reaction", diagnostics);
        forms(fields, &["order", "reverse_order"], &["template"], diagnostics);
        let Some((left, right)) = species.sides(names, decl.module, (reactants, products), diagnostics) else {
            continue;
        };
        let equation = equation(name, reactants, products);
        if left.iter().chain(&right).any(|(s, _)| species.get(*s).is_electron) {
            let headline = format!("`{}` contains the electron, but a solution holds no free electrons", name.text);
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, "only half-cells have `e-`");
            diagnostics
                .push(d.help("write the whole reaction, or an equilibrium: `equilibrium iron: Fe3+ + e- <-> Fe2+`"));
            continue;
        }
        if let Some((gas, _)) = left.iter().chain(&right).find(|(s, _)| species.get(*s).is_gas) {
            let gas = &species.get(*gas).name;
            let headline = format!("`{}` contains the gas `{gas}`, but a solution holds only dissolved gas", name.text);
            let d =
                Diagnostic::error(codes::EQUILIBRIUM_FORM, equation, headline, "a gas belongs in its own equilibrium");
            diagnostics.push(d.help("write the dissolved species: CO2 for CO2(g)"));
            continue;
        }
        check_balance(species, &left, &right, equation, &name.text, diagnostics);
        check_template(species, &left, &right, fields, diagnostics);
        let terms = |list: &[Term], ids: &[(super::SpeciesId, f64)]| -> Vec<_> {
            ids.iter().zip(list).map(|(id, t)| (id.0, t.span)).collect()
        };
        let forward = ReactionDef {
            name: name.text.clone(),
            module: decl.module,
            terms: terms(reactants, &left),
            reactants: left.clone(),
            products: right.clone(),
            fields,
            reverse: false,
            span: name.span,
        };
        if *reversible {
            let reverse = ReactionDef {
                name: format!("{}.reverse", name.text),
                terms: terms(products, &right),
                reactants: right,
                products: left,
                reverse: true,
                ..forward.clone()
            };
            out.push(forward);
            out.push(reverse);
        } else {
            out.push(forward);
        }
    }
    out
}

pub(super) fn check_balance(
    table: &SpeciesTable<'_>,
    left: &[(super::SpeciesId, f64)],
    right: &[(super::SpeciesId, f64)],
    span: Span,
    name: &str,
    diagnostics: &mut Vec<Diagnostic>,
) {
    if let Some((s, _)) = left.iter().chain(right).find(|(s, _)| table.get(*s).by_mass) {
        let species = table.get(*s);
        diagnostics.push(
            Diagnostic::error(
                codes::UNBALANCED,
                span,
                format!("`{}` is declared `by: mass` and cannot be in an equation", species.name),
                "its atoms are unknown",
            )
            .because(species.span, "declared `by: mass` here"),
        );
        return;
    }
    let side = |terms: &[(super::SpeciesId, f64)]| -> Option<Vec<(f64, &Formula)>> {
        terms.iter().map(|(s, n)| table.get(*s).formula.as_ref().map(|f| (*n, f))).collect()
    };
    let (Some(l), Some(r)) = (side(left), side(right)) else { return };
    let Err(error) = balance::check(&l, &r) else { return };
    let found = match error {
        BalanceError::Unbalanced(found) => found,
        BalanceError::BadCoefficient(_) | BalanceError::TooLarge => {
            diagnostics.push(Diagnostic::error(
                codes::UNBALANCED,
                span,
                format!("the coefficients of `{name}` must be positive and of moderate size"),
                "cannot be balanced",
            ));
            return;
        }
    };
    let mut d = Diagnostic::error(
        codes::UNBALANCED,
        span,
        format!("`{name}` does not balance: {}", in_words(&found)),
        "the sides differ",
    );
    match &found.suggestion {
        Some(coefficients) if coefficients.len() == left.len() + right.len() => {
            let (a, b) = coefficients.split_at(left.len());
            let mended = format!("{} -> {}", show_side(table, left, a), show_side(table, right, b));
            d = d.help(format!("it balances as `{mended}`")).guess("balance the equation", span, mended);
        }
        _ => d = d.help("check the species: one may be missing, or have another formula than you think"),
    }
    diagnostics.push(d);
}

/// "the right side has 2 H and a charge of +1 too much".
fn in_words(found: &Imbalance) -> String {
    let mut more = Vec::new();
    let mut less = Vec::new();
    for (element, difference) in &found.elements {
        let n = matterix_ir::quantity::show_number(difference.to_f64().abs());
        let list = if difference.to_f64() > 0.0 { &mut more } else { &mut less };
        list.push(format!("{n} {element}"));
    }
    let mut parts = Vec::new();
    if !more.is_empty() {
        parts.push(format!("the right side has {} too many", more.join(", ")));
    }
    if !less.is_empty() {
        parts.push(format!("the right side lacks {}", less.join(", ")));
    }
    let charge = found.charge.to_f64();
    if charge != 0.0 {
        parts.push(format!(
            "its charge is {} by {}",
            if charge > 0.0 { "too high" } else { "too low" },
            matterix_ir::quantity::show_number(charge.abs())
        ));
    }
    parts.join("; ")
}

fn show_side(table: &SpeciesTable<'_>, terms: &[(super::SpeciesId, f64)], coefficients: &[u64]) -> String {
    let show = |((s, _), n): (&(super::SpeciesId, f64), &u64)| {
        let name = &table.get(*s).name;
        if *n == 1 { name.clone() } else { format!("{n} {name}") }
    };
    terms.iter().zip(coefficients).map(show).collect::<Vec<_>>().join(" + ")
}

fn check_template(
    table: &SpeciesTable<'_>,
    left: &[(super::SpeciesId, f64)],
    right: &[(super::SpeciesId, f64)],
    fields: &[Field],
    diagnostics: &mut Vec<Diagnostic>,
) {
    let Some(f) = field(fields, "template") else { return };
    let FieldValue::Expr(e) = &f.value else { return };
    let ExprKind::Text(smirks) = &*e.kind else { return };
    let participants = |terms: &[(super::SpeciesId, f64)]| -> Vec<Participant<'_>> {
        terms
            .iter()
            .filter_map(|(s, n)| {
                let def = table.get(*s);
                let formula = def.formula.as_ref()?;
                Some(Participant { name: &def.name, structure: def.structure.as_ref(), formula, coefficient: *n })
            })
            .collect()
    };
    if let Err(error) = template::check(smirks, &participants(left), &participants(right)) {
        diagnostics.push(template_error(error, smirks, e.span));
    }
}

fn template_error(error: TemplateError, smirks: &str, span: Span) -> Diagnostic {
    let at =
        |headline: &str, label: String, span: Span| Diagnostic::error(codes::TEMPLATE_MISMATCH, span, headline, label);
    match error {
        TemplateError::Unreadable { detail, offset } => {
            let exact = offset.filter(|o| *o < smirks.len()).map_or(span, |o| {
                let start = span.start as usize + 1 + o;
                Span::new(span.file, start, start + 1)
            });
            at("this is not a reaction template", detail, exact)
                .help("a template is a SMIRKS text: `[C:1][OX2H:2].[IH:3]>>[C:1][I:3].[OH2:2]`")
        }
        TemplateError::ReactantCount(n) => {
            at("the template does not fit the equation", format!("its left side has {n} molecules"), span)
        }
        TemplateError::NoMatch => {
            at("the template matches no reactant", "the reactants do not have this pattern".into(), span)
                .help("every molecule left of `>>` must be found in a reactant with a `smiles` structure")
        }
        TemplateError::Impossible => {
            at("the template would give atoms with too many bonds", "impossible products".into(), span)
                .help("a mapped atom keeps its charge unless the right side states one: `[O+0:1]`")
        }
        TemplateError::OtherProducts { gives, missing } => {
            let gives: Vec<String> = gives
                .iter()
                .map(|p| match &p.name {
                    Some(n) => format!("{n} ({})", p.smiles),
                    None => format!("{} ({})", p.formula, p.smiles),
                })
                .collect();
            let label = if missing.is_empty() {
                "other proportions than declared".into()
            } else {
                format!("does not give {}", missing.join(", "))
            };
            at("the template gives other products than the equation", label, span)
                .help(format!("it gives {}", gives.join(" + ")))
                .help("a mapped atom keeps its charge unless the right side states one: `[O+0:1]`")
        }
        TemplateError::Unsupported => {
            at("the template cannot be applied", "too many matches, or an unsupported pattern".into(), span)
        }
    }
}
