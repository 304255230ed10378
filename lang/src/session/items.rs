//! The items of a package's files as a check saw them, and how those of an earlier check belong to those of a later one.

use std::collections::BTreeSet;
use std::mem::{Discriminant, discriminant};

use matterix_ir::{FileId, Sources};

use crate::ast::{Item, ItemKind};
use crate::names::{DeclId, Names, item_name};

/// A file of a package: where its items stand.
#[derive(Debug)]
pub(super) struct File {
    /// Its number.
    pub(super) file: FileId,
    /// Its text.
    pub(super) text: String,
    /// Its items in order.
    pub(super) items: Vec<Placed>,
}

/// An item and where it stands.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    /// Its first byte.
    pub(super) start: usize,
    /// The byte behind it.
    pub(super) end: usize,
    /// What it is to the others.
    pub(super) sort: Sort,
    kind: Discriminant<ItemKind>,
    /// Its name, where it has one, and its number among all declarations.
    pub(super) declared: Option<(String, DeclId)>,
}

/// What an item is to the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// Declares nothing.
    Nothing,
    /// Is judged, and says nothing to others but those that name it.
    Judged,
    /// Says nothing to others but those that name it.
    Named,
    /// The same, but what is wrong with others may be told with a list of all such.
    Listed,
    /// May mean something for all others.
    Common,
}

impl Sort {
    fn of(kind: &ItemKind, in_root: bool) -> Sort {
        match kind {
            ItemKind::Error => Sort::Nothing,
            ItemKind::Workflow { .. } | ItemKind::Test { .. } | ItemKind::Study { .. } | ItemKind::Fit { .. } => {
                if in_root {
                    Sort::Judged
                } else {
                    Sort::Named
                }
            }
            ItemKind::Const { .. }
            | ItemKind::Table { .. }
            | ItemKind::Fn { .. }
            | ItemKind::Relation { .. }
            | ItemKind::Skill { .. }
            | ItemKind::Solution { .. }
            | ItemKind::Lab { .. } => Sort::Named,
            ItemKind::Asset { .. } => Sort::Listed,
            _ => Sort::Common,
        }
    }

    /// Whether only those that name it can mean it.
    pub(super) fn is_named(self) -> bool {
        matches!(self, Sort::Named | Sort::Listed)
    }
}

impl File {
    /// The file that a module is.
    pub(super) fn of(names: &Names<'_>, module: usize, sources: &Sources, in_root: bool) -> File {
        let read = &names.modules[module];
        let mut declared = names.declared_by(module);
        // What a feature has brought stands in no place of this text; it is as it was where the files beside are.
        let within = |item: &Item, at: u32| if item.span.file == read.file { at as usize } else { 0 };
        let place = |item: &Item| Placed {
            start: within(item, item.span.start),
            end: within(item, item.span.end),
            sort: Sort::of(&item.kind, in_root),
            kind: discriminant(&item.kind),
            declared: item_name(item).and_then(|(name, _)| Some((name, declared.next()?))),
        };
        File {
            file: read.file,
            text: sources.get(read.file).map_or_else(String::new, |s| s.text.clone()),
            items: read.tree.items.iter().map(place).collect(),
        }
    }

    /// What an item says.
    pub(super) fn text(&self, item: usize) -> &str {
        self.items.get(item).and_then(|item| self.text.get(item.start..item.end)).unwrap_or_default()
    }

    /// The items of some sorts, by number.
    pub(super) fn all(&self, of: impl Fn(Sort) -> bool) -> Vec<usize> {
        self.items.iter().enumerate().filter(|(_, item)| of(item.sort)).map(|(index, _)| index).collect()
    }

    /// The name of an item.
    pub(super) fn name(&self, item: usize) -> Option<&str> {
        self.items.get(item)?.declared.as_ref().map(|(name, _)| name.as_str())
    }

    /// The number of an item among all declarations.
    pub(super) fn number(&self, item: usize) -> Option<DeclId> {
        self.items.get(item)?.declared.as_ref().map(|(_, number)| *number)
    }
}

/// How the items of a file belong to those of its earlier text.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    /// Items that say what they said: their numbers then and now.
    pub(super) same: Vec<(usize, usize)>,
    /// Names of those that say something else, are gone or new.
    pub(super) changed: BTreeSet<String>,
    /// Whether there are other names than before, or other things to list.
    pub(super) renamed: bool,
}

/// Finds which items stayed; nothing where one has changed that may mean something for all others.
pub(super) fn pairs(old: &File, new: &File) -> Option<Pairs> {
    let mut found = Pairs::default();
    let shared = |sort: Sort| sort.is_named() || sort == Sort::Common;
    let (before, now) = (old.all(shared), new.all(shared));
    let alike = |a: usize, b: usize| {
        let (was, is) = (old.items.get(a), new.items.get(b));
        let key = |item: Option<&Placed>| item.map(|item| (item.sort, item.kind));
        key(was) == key(is) && old.name(a) == new.name(b)
    };
    let same = |a: usize, b: usize| alike(a, b) && old.text(a) == new.text(b);
    if before.len() == now.len() && before.iter().zip(&now).all(|(a, b)| alike(*a, *b)) {
        for (a, b) in before.into_iter().zip(now) {
            if same(a, b) {
                found.same.push((a, b));
            } else {
                found.differs(new, b)?;
            }
        }
    } else {
        let ahead = before.iter().zip(&now).take_while(|(a, b)| same(**a, **b)).count();
        let left = before.len().min(now.len()) - ahead;
        let behind = before.iter().rev().zip(now.iter().rev()).take(left).take_while(|(a, b)| same(**a, **b)).count();
        let (was_end, is_end) = (before.len() - behind, now.len() - behind);
        for a in &before[ahead..was_end] {
            found.differs(old, *a)?;
        }
        for b in &now[ahead..is_end] {
            found.differs(new, *b)?;
        }
        found.renamed = true;
        found.same.extend(before[..ahead].iter().copied().zip(now[..ahead].iter().copied()));
        found.same.extend(before[was_end..].iter().copied().zip(now[is_end..].iter().copied()));
    }
    // Of those that are judged each stands for itself.
    let judged = |file: &File| file.all(|sort| sort == Sort::Judged);
    let mut free: BTreeSet<usize> = judged(new).into_iter().collect();
    for a in judged(old) {
        if let Some(b) = free.iter().copied().find(|b| same(a, *b)) {
            free.remove(&b);
            found.same.push((a, b));
        }
    }
    let names = |file: &File| -> BTreeSet<Option<String>> {
        judged(file).into_iter().map(|item| file.name(item).map(str::to_string)).collect()
    };
    found.renamed |= names(old) != names(new);
    found.same.sort_unstable();
    Some(found)
}

impl Pairs {
    /// Takes in that an item says something else; nothing where that may mean something for all others.
    fn differs(&mut self, file: &File, item: usize) -> Option<()> {
        let sort = file.items.get(item)?.sort;
        self.renamed |= sort == Sort::Listed;
        self.changed.insert(file.name(item).filter(|_| sort.is_named())?.to_string());
        Some(())
    }
}
