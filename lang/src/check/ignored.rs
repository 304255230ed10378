//! What would be read and then have no effect: said, so that nothing written is passed over in silence.

use matterix_ir::{Diagnostic, codes};

use crate::ast::{Field, NamedExpr, Role, Sig};
use crate::elaborate::species::field;
use crate::eval::types::unsupported;
use crate::names::near;

/// Options of a member that mean nothing for a member of its kind.
pub fn options(role: Role, given: &[NamedExpr]) -> Vec<Diagnostic> {
    let (what, known): (&str, &[&str]) = match role {
        Role::State => ("a state", &["unit", "scale"]),
        Role::Extensive => ("an extensive quantity", &["unit", "scale"]),
        Role::Derived => ("a derived quantity", &["unit", "hidden"]),
        Role::Reading => ("a reading", &["unit", "resolution", "noise", "period"]),
        Role::Param => ("a parameter", &["above", "at_least"]),
        Role::Flow => ("a flow", &[]),
        Role::Part => ("a part", &[]),
    };
    let unknown = given.iter().filter(|o| !known.contains(&o.name.text.as_str()));
    unknown
        .map(|o| {
            let headline = format!("{what} has no option `{}`", o.name.text);
            let mut d = Diagnostic::error(codes::UNKNOWN_FIELD, o.name.span, headline, "not an option");
            let near = near::nearest(&o.name.text, known);
            d.help.extend(near::question(&near));
            match near.first() {
                Some(best) => d.fix(format!("replace with `{best}`"), o.name.span, best.clone()),
                None => d,
            }
        })
        .collect()
}

/// Parameters that no call can give: each group takes one.
pub fn parameters(sig: &Sig) -> Vec<Diagnostic> {
    let groups = std::iter::once(&sig.params).chain(sig.labelled.iter().map(|(_, params)| params));
    groups
        .filter_map(|params| params.get(1))
        .map(|p| unsupported(p.name.span, "several parameters in one pair of brackets"))
        .collect()
}

/// Fields of a reaction that no law looks at yet.
pub fn reaction(fields: &[Field]) -> Vec<Diagnostic> {
    field(fields, "requires")
        .map(|f| unsupported(f.key.span, "conditions that a reaction `requires`"))
        .into_iter()
        .collect()
}
