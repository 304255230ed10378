//! What names stand for where contents are given.

use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use crate::ast::Name;
use crate::declare::SpeciesId;
use crate::names::DeclId;

/// What a name in a recipe or after `of` stands for.
pub enum Substance {
    /// One species.
    Species(SpeciesId),
    /// A recipe.
    Solution(DeclId),
}

impl Elaborator<'_> {
    /// What a name stands for where contents are given.
    pub fn substance(&mut self, name: &Name, module: usize) -> Option<Substance> {
        let names = self.tables.names;
        let id = names.lookup(module, &name.text);
        if let Some(s) = id.and_then(|id| self.tables.species.of_decl(id)) {
            if self.tables.species.get(s).is_electron {
                let headline = format!("nothing holds `{}`: electrons are formal", name.text);
                let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, name.span, headline, "stands in half-cells alone");
                self.report(d.help("give what takes up electrons, or gives them: Fe3+, or Fe2+"));
                return None;
            }
            return Some(Substance::Species(s));
        }
        let is_solution = |k: &crate::ast::ItemKind| matches!(k, crate::ast::ItemKind::Solution { .. });
        if let Some(id) = id.filter(|id| is_solution(&names.decl(*id).item.kind)) {
            return Some(Substance::Solution(id));
        }
        let d = names.unknown(module, name, "species or solution", |k| {
            matches!(k, crate::ast::ItemKind::Species { .. } | crate::ast::ItemKind::Solution { .. })
        });
        self.report(d);
        None
    }
}
