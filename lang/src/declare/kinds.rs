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

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(name: &str, id: u32) -> Kind<'static> {
        let mut kind = Kind::default();
        (kind.id, kind.name) = (DeclId(id), name.to_owned());
        kind
    }

    #[test]
    fn a_kind_stands_at_its_declaration_and_nowhere_else() {
        let mut kinds = Kinds::default();
        kinds.insert(DeclId(7), kind("Beaker", 7));
        kinds.insert(DeclId(2), kind("Plate", 2));
        assert_eq!(kinds.get(&DeclId(7)).map(|k| k.name.as_str()), Some("Beaker"));
        for absent in [0, 3, 8, u32::MAX] {
            assert!(!kinds.contains_key(&DeclId(absent)), "{absent}");
            assert!(kinds.get_mut(&DeclId(absent)).is_none(), "{absent}");
        }
    }

    #[test]
    fn kinds_come_in_the_order_of_declarations() {
        let mut kinds = Kinds::default();
        for id in [5, 1, 3] {
            kinds.insert(DeclId(id), kind("Thing", id));
        }
        assert_eq!(kinds.values().map(|k| k.id.0).collect::<Vec<_>>(), [1, 3, 5]);
    }

    #[test]
    fn a_kind_is_replaced_and_changed_where_it_stands() {
        let mut kinds = Kinds::default();
        kinds.insert(DeclId(4), kind("Draft", 4));
        kinds.insert(DeclId(4), kind("Beaker", 4));
        kinds.get_mut(&DeclId(4)).expect("it is there").is_asset = true;
        assert_eq!(kinds.values().map(|k| (k.name.as_str(), k.is_asset)).collect::<Vec<_>>(), [("Beaker", true)]);
    }
}
