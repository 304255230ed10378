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
                let headline = format!("a vessel cannot hold `{}`: electrons are only formal", name.text);
                let d =
                    Diagnostic::error(codes::EQUILIBRIUM_FORM, name.span, headline, "only half-cells have electrons");
                self.report(d.help("name the oxidised or the reduced species: Fe3+ or Fe2+"));
                return None;
            }
            if self.is_refused_as_gas(s, name) {
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

    /// Whether a species is a gas, of which no mixture holds any, and says so where it is asked for as if one did.
    pub fn is_refused_as_gas(&mut self, s: SpeciesId, name: &Name) -> bool {
        let is_gas = self.tables.species.get(s).is_gas && !self.prototype;
        if is_gas {
            let headline = format!("a vessel cannot hold `{}`: the model has no gas phase", name.text);
            let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, name.span, headline, "only equilibria have gases");
            let plain = name.text.trim_end_matches("(g)");
            let help = format!("name the dissolved gas: `{plain}`");
            self.report(d.help(help).help("for the gas above a vessel use a `GasExchange` of std::gases"));
        }
        is_gas
    }
}
