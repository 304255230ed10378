//! Of which things a lab says where they stand.

use std::collections::BTreeMap;

use matterix_ir::scene::InstanceId;

use crate::eval::lab::Elaborator;

impl Elaborator<'_> {
    /// By instance: whether where it stands on what carries it, or in what it is a part of, is known.
    ///
    /// A thing without `at` stands in the frame `place` of what carries it if nothing else without `at` does, for two
    /// cannot. A part without `at` is in the frame of what it is a part of, unless its line makes several.
    pub fn whereabouts(&self) -> Vec<bool> {
        let carrier = |i: &crate::eval::lab::Instance<'_>| i.placed.first().map(|p| p.1);
        let mut open: BTreeMap<Option<InstanceId>, usize> = BTreeMap::new();
        for instance in self.instances.iter().filter(|i| i.owner.is_none() && i.at.is_none()) {
            *open.entry(carrier(instance)).or_default() += 1;
        }
        let known = |i: &crate::eval::lab::Instance<'_>| match i.owner {
            Some(_) => i.at.is_some() || !i.one_of_many,
            None => i.at.is_some() || open.get(&carrier(i)).is_none_or(|count| *count == 1),
        };
        self.instances.iter().map(known).collect()
    }

    /// Whether the text says of two things or more where they stand.
    pub fn has_places(&self) -> bool {
        self.instances.iter().filter(|i| i.owner.is_none() && i.at.is_some()).nth(1).is_some()
    }
}
