//! Capabilities and asset types by their declarations: looked up for each member that is read, so they stand by index.

use super::tables::Kind;
use crate::names::DeclId;

/// Kinds by declaration, in the order of these.
#[derive(Debug, Default)]
pub struct Kinds<'a>(Vec<Option<Kind<'a>>>);

impl<'a> Kinds<'a> {
    /// The kind that a declaration makes.
    pub fn get(&self, id: &DeclId) -> Option<&Kind<'a>> {
        self.0.get(id.0 as usize)?.as_ref()
    }

    /// The same, to be changed.
    pub fn get_mut(&mut self, id: &DeclId) -> Option<&mut Kind<'a>> {
        self.0.get_mut(id.0 as usize)?.as_mut()
    }

    /// Whether a declaration makes a kind.
    pub fn contains_key(&self, id: &DeclId) -> bool {
        self.get(id).is_some()
    }

    /// Takes in the kind of a declaration.
    pub fn insert(&mut self, id: DeclId, kind: Kind<'a>) {
        let at = id.0 as usize;
        if self.0.len() <= at {
            self.0.resize_with(at + 1, || None);
        }
        self.0[at] = Some(kind);
    }

    /// All kinds.
    pub fn values(&self) -> impl Iterator<Item = &Kind<'a>> {
        self.0.iter().flatten()
    }
}
