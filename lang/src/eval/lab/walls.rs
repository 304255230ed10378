//! What stands around mixtures, and what attacks it.

use matterix_ir::scene::InstanceId;

use super::Elaborator;
use crate::ast::{MemberKind, Role};
use crate::declare::{SpeciesId, Type};
use crate::eval::Value;
use crate::names::DeclId;

impl Elaborator<'_> {
    /// What the wall around a mixture is made of: the first parameter that is a material of what holds it.
    pub fn wall_of(&mut self, mixture: InstanceId) -> Option<DeclId> {
        let mut holder = Some(mixture);
        while let Some(id) = holder {
            if let Some(material) = self.material_of(id) {
                return Some(material);
            }
            holder = self.instances[id.0 as usize].owner;
        }
        None
    }

    /// Whether a species attacks the wall around a mixture at some content, and no line of the file allows it.
    pub fn attacks_wall(&mut self, mixture: InstanceId, s: SpeciesId) -> bool {
        let Some(wall) = self.wall_of(mixture) else { return false };
        let (screen, species) = (&self.tables.screen, &self.tables.species);
        screen.material(species, wall, (s, None)).is_some() && !screen.is_allowed_in(species, wall, s)
    }

    fn material_of(&mut self, id: InstanceId) -> Option<DeclId> {
        for member in self.all_members(id).iter().copied() {
            let MemberKind::Value { role: Role::Param, ty, name, .. } = &member.member.kind else { continue };
            if !matches!(self.resolve_type(ty, member.module), Type::Material { .. }) {
                continue;
            }
            if let Value::Material(material) = self.member_value(id, member, name.span) {
                return Some(material);
            }
        }
        None
    }
}
