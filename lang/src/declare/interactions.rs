//! The table of interactions between what is dissolved, and the checks that need no lab: who acts on whom, and by which numbers.

use matterix_ir::listing::joined;
use matterix_ir::{Diagnostic, Span, codes};

use super::SpeciesId;
use super::fields::unknown_fields;
use super::reactions::equation;
use super::species::{SpeciesTable, field};
use crate::ast::{Field, ItemKind};
use crate::names::Names;

/// The field that says how fast the numbers of two opposite charges fade.
pub const REACH: &str = "reach";

const FIELDS: &[&str] = &["b0", "b1", "b2", "c0", REACH, "theta", "lambda", "psi", "zeta", "source"];

/// What two or three species are to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Ions of opposite charge.
    Opposite,
    /// Two ions of like charge.
    Like,
    /// Something without a charge and another species.
    Neutral,
    /// Two ions of like charge and one of the other.
    Ions,
    /// Something without a charge between two ions.
    Between,
}

impl Kind {
    /// Its numbers, in the order of [`matterix_ir::equilibrium::Interactions`].
    pub fn numbers(self) -> &'static [&'static str] {
        match self {
            Kind::Opposite => &["b0", "b1", "b2", "c0"],
            Kind::Like => &["theta"],
            Kind::Neutral => &["lambda"],
            Kind::Ions => &["psi"],
            Kind::Between => &["zeta"],
        }
    }

    fn of(charges: &[i32]) -> Option<Kind> {
        let [positive, negative] = [1, -1].map(|sign| charges.iter().filter(|z| **z * sign > 0).count());
        match (charges.len(), positive, negative) {
            (2, 1, 1) => Some(Kind::Opposite),
            (2, 2, 0) | (2, 0, 2) => Some(Kind::Like),
            (2, ..) => Some(Kind::Neutral),
            (3, 2, 1) | (3, 1, 2) => Some(Kind::Ions),
            (3, 1, 1) => Some(Kind::Between),
            _ => None,
        }
    }
}

/// An interaction whose species are all known.
#[derive(Clone, Debug)]
pub struct InteractionDef<'a> {
    /// Its name.
    pub name: String,
    /// Its module.
    pub module: usize,
    /// Its two or three species.
    pub members: Vec<SpeciesId>,
    /// What they are to each other.
    pub kind: Kind,
    /// Its fields.
    pub fields: &'a [Field],
    /// Its name.
    pub span: Span,
}

/// Reads every `interaction` item of the modules in use; those that are not well formed are reported and left out.
pub fn collect<'a>(
    names: &'a Names<'a>,
    species: &SpeciesTable<'a>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<InteractionDef<'a>> {
    let mut out: Vec<InteractionDef<'a>> = Vec::new();
    for decl in names.in_use(|kind| matches!(kind, ItemKind::Interaction { .. })) {
        let ItemKind::Interaction { name, between, fields } = &decl.item.kind else { continue };
        unknown_fields(fields, FIELDS, "an interaction", diagnostics);
        let members = species.terms(names, decl.module, between, diagnostics);
        if members.len() != between.len() {
            continue;
        }
        let span = equation(name, between, between);
        let refused = |headline: String, label: &str, help: &str| {
            Diagnostic::error(codes::INTERACTION_FORM, span, headline, label).help(help)
        };
        if let Some((s, n)) = members.iter().find(|(s, n)| *n != 1.0 || !species.get(*s).is_aqueous()) {
            let headline = format!("`{}` must be between dissolved species", name.text);
            let name = &species.get(*s).name;
            let label = match *n == 1.0 {
                true => format!("`{name}` is not dissolved"),
                false => format!("`{name}` stands here with a coefficient"),
            };
            diagnostics.push(refused(
                headline,
                &label,
                "name two or three ions or dissolved molecules, without coefficients",
            ));
            continue;
        }
        let charge = |s: &SpeciesId| species.get(*s).charge();
        let members: Vec<SpeciesId> = members.into_iter().map(|(s, _)| s).collect();
        let charges: Vec<i32> = members.iter().map(charge).collect();
        let has_twice = (1..members.len()).any(|k| members[..k].contains(&members[k]));
        let is_self = has_twice && charges.iter().any(|z| *z != 0);
        let Some(kind) = Kind::of(&charges).filter(|_| !is_self && (!has_twice || members.len() == 2)) else {
            let headline =
                format!("`{}` must be between two different species, or three with both signs of charge", name.text);
            let help = "write `Na+ + Cl-`, `Na+ + K+`, `CO2 + Na+`, `Na+ + K+ + Cl-` or `CO2 + Na+ + Cl-`";
            diagnostics.push(refused(headline, "another form", help));
            continue;
        };
        let before = diagnostics.len();
        check_numbers(&name.text, kind, fields, span, diagnostics);
        let mut sorted = members.clone();
        sorted.sort();
        let is_same = |other: &&InteractionDef<'_>| {
            let mut of = other.members.clone();
            of.sort();
            of == sorted
        };
        if let Some(first) = out.iter().find(is_same) {
            let headline = format!("`{}` and `{}` are between the same species", first.name, name.text);
            let d = Diagnostic::error(codes::INTERACTION_FORM, span, headline, "the second one");
            diagnostics.push(d.because(first.span, "the first one").help("leave out one of them"));
        }
        if diagnostics[before..].iter().any(Diagnostic::is_error) {
            continue;
        }
        out.push(InteractionDef {
            name: name.text.clone(),
            module: decl.module,
            members,
            kind,
            fields,
            span: name.span,
        });
    }
    out
}

/// It has numbers, and none that belong to species of other charges.
fn check_numbers(name: &str, kind: Kind, fields: &[Field], span: Span, diagnostics: &mut Vec<Diagnostic>) {
    let own = kind.numbers();
    let wanted: Vec<String> = own.iter().map(|n| format!("`{n}`")).collect();
    let is_own = |key: &str| own.contains(&key) || key == "source" || (key == REACH && kind == Kind::Opposite);
    let misplaced = fields.iter().filter(|f| FIELDS.contains(&f.key.text.as_str()) && !is_own(&f.key.text));
    let before = diagnostics.len();
    for f in misplaced {
        let headline = format!("species of these charges have no `{}`", f.key.text);
        let d = Diagnostic::error(codes::INTERACTION_FORM, f.key.span, headline, "for other charges");
        diagnostics.push(d.because(span, format!("`{name}` has {}", joined(&wanted, "and"))));
    }
    if diagnostics.len() == before && own.iter().all(|key| field(fields, key).is_none()) {
        let headline = format!("`{name}` has no parameter");
        let d = Diagnostic::error(codes::MISSING_FIELD, span, headline, "its strength is unknown");
        diagnostics.push(d.help(format!("give {}", joined(&wanted, "or"))));
    }
}
