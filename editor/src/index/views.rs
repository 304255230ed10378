//! What a mixture counts its species in.

use matterix_lang::ast::{ItemKind, MemberKind};
use matterix_lang::semantic_index::Sort;
use matterix_lang::units::Dimension;
use matterix_syntax::classes::{self, Class};

use super::Index;

impl Index {
    /// The dimensions of concentrations, in the order of their declarations, each with the units in which its declaration writes it.
    pub(crate) fn concentrations(&self) -> Vec<(Dimension, Vec<String>)> {
        let mut out: Vec<(Dimension, Vec<String>)> = Vec::new();
        for (at, module) in self.modules.iter().enumerate() {
            let members = module.tree.items.iter().filter_map(|item| match &item.kind {
                ItemKind::Capability { members, .. } => Some(members),
                _ => None,
            });
            for member in members.flatten() {
                let MemberKind::View { ty, value, .. } = &member.kind else { continue };
                let Sort::Quantity(dimension, _) = self.sort_of_type(at, ty) else { continue };
                if !out.iter().any(|known| known.0 == dimension) {
                    let units = self.units_in(self.text(value.span), &dimension);
                    out.push((dimension, units));
                }
            }
        }
        out
    }

    /// The units of a dimension that an expression writes.
    fn units_in(&self, expression: &str, dimension: &Dimension) -> Vec<String> {
        let text = format!("mtx 1\nconst x = {expression}\n");
        let words = classes::words(&text).into_iter().filter(|word| word.class == Class::Unit);
        let mut out: Vec<String> = Vec::new();
        for unit in words.filter_map(|word| text.get(word.start..word.end)) {
            let fits = self.units().resolve(unit).is_ok_and(|found| found.dimension == *dimension);
            if fits && !out.iter().any(|known| known == unit) {
                out.push(unit.to_string());
            }
        }
        out
    }
}
