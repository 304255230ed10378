//! What may be said of species: the parameters of capabilities `Species`, each with its type.

use std::collections::BTreeMap;

use matterix_ir::{Diagnostic, codes};

use super::kinds::Kinds;
use super::tables::{Kind, MemberRef, member_name};
use crate::ast::{MemberKind, Role};

/// The built-in type whose properties are declared by capabilities of this name.
const OF: &str = "Species";

/// Declared properties by name.
pub type Properties<'a> = BTreeMap<&'a str, MemberRef<'a>>;

/// The properties that capabilities `Species` declare; one declared twice is reported.
pub fn declared<'a>(kinds: &Kinds<'a>, diagnostics: &mut Vec<Diagnostic>) -> Properties<'a> {
    let mut out: Properties<'a> = BTreeMap::new();
    let own = |kind: &Kind<'a>| -> Vec<MemberRef<'a>> {
        kind.members.iter().filter(|m| m.owner == kind.id).copied().collect()
    };
    for m in kinds.values().filter(|k| !k.is_asset && k.name == OF).flat_map(own) {
        let Some(name) = member_name(m.member) else { continue };
        if !matches!(m.member.kind, MemberKind::Value { role: Role::Param, .. }) {
            let headline = format!("`{}` must be a `param`: a property of species is a parameter", name.text);
            diagnostics.push(Diagnostic::error(codes::MISPLACED, m.member.span, headline, "not a property"));
            continue;
        }
        match out.get(name.text.as_str()) {
            Some(first) => {
                let headline = format!("the property `{}` is declared twice", name.text);
                let d = Diagnostic::error(codes::DUPLICATE_NAME, name.span, headline, "declared again here");
                diagnostics.push(d.because(first.member.span, "first declared here"));
            }
            None => drop(out.insert(&name.text, m)),
        }
    }
    out
}
