//! What was noted of items that may have moved since: it is kept as it was noted, and put where the items are now when it is asked for.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::{FileId, Span};

use super::{Meanings, Seeing};
use crate::names::{DeclId, Names};
use crate::syntax::relocate::Relocate;

/// What was noted, and where the items it is about are now.
#[derive(Clone, Debug, Default)]
pub struct Resolutions {
    of: Arc<Meanings>,
    /// Items as they stood, by file and start, and as they stand.
    items: BTreeMap<(FileId, u32), (u32, Span)>,
    /// The package's own declarations that it names, by their numbers then, and their numbers now.
    numbers: BTreeMap<DeclId, DeclId>,
}

impl Resolutions {
    /// What was noted of texts as they are.
    pub fn of(seeing: Seeing, names: &Names<'_>) -> Option<Resolutions> {
        let mut seeing = *seeing?;
        let kinds = seeing.things.values_mut().flat_map(|things| things.values_mut()).flatten();
        let named: BTreeSet<DeclId> =
            kinds.chain(seeing.values.values_mut().flat_map(|seen| seen.sort.declared())).map(|id| *id).collect();
        let is_own = |id: &DeclId| !names.modules[names.decl(*id).module].is_library();
        let numbers = named.into_iter().filter(is_own).map(|id| (id, id)).collect();
        let mut noted = Resolutions { of: Arc::new(seeing), items: BTreeMap::new(), numbers };
        let own = names.modules.iter().filter(|m| !m.is_library()).flat_map(|m| &m.tree.items);
        let all: BTreeMap<(FileId, u32), Span> = own.map(|i| ((i.span.file, i.span.start), i.span)).collect();
        let named = noted.of.names.iter().flat_map(|(a, b)| [a, b]).chain(noted.of.values.keys());
        for span in named {
            let around = all.range(..=(span.file, span.start)).next_back();
            if let Some((key, item)) = around.filter(|(_, i)| i.file == span.file && span.end <= i.end) {
                noted.items.insert(*key, (item.end, *item));
            }
        }
        Some(noted)
    }

    /// Where a place is now.
    fn place(&self, span: Span) -> Span {
        let around = self.items.range(..=(span.file, span.start)).next_back();
        match around.filter(|((file, _), (end, _))| *file == span.file && span.end <= *end) {
            Some(((_, start), (_, now))) => {
                let at = |place: u32| now.start + (place - start);
                Span { start: at(span.start), end: at(span.end), ..span }
            }
            None => span,
        }
    }

    /// Gives the package's own declarations the numbers they have now.
    pub(crate) fn renumber(&mut self, to: &dyn Fn(DeclId) -> DeclId) {
        self.numbers.values_mut().for_each(|id| *id = to(*id));
    }

    fn number(&self, id: &mut DeclId) {
        if let Some(now) = self.numbers.get(id) {
            *id = *now;
        }
    }

    /// Adds it to what is known. What both know is what was known already.
    pub(super) fn join_into(&self, all: &mut Meanings) {
        for (name, declared) in &self.of.names {
            all.names.entry(self.place(*name)).or_insert_with(|| self.place(*declared));
        }
        for (span, seen) in &self.of.values {
            let mut seen = seen.clone();
            seen.sort.declared().into_iter().for_each(|id| self.number(id));
            all.see(self.place(*span), seen);
        }
        for (lab, things) in &self.of.things {
            let mut things = things.clone();
            things.values_mut().flatten().for_each(|id| self.number(id));
            all.things.insert(lab.clone(), things);
        }
    }
}

impl Relocate for Resolutions {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        for (_, now) in self.items.values_mut() {
            now.moved(to);
        }
    }
}
