//! Verdicts of workflows that hold on: those whose own text and everything around it stayed as they were, wherever it stands now.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::points::Points;
use matterix_ir::{Diagnostic, FileId, Sources, Span};

use crate::ast::{Item, ItemKind};
use crate::check::{Starts, Uses};
use crate::meanings::Noted;
use crate::names::{DeclId, Module, Names, item_name};
use crate::study::Many;
use crate::syntax::moved::Moved;

/// What was found of a task.
#[derive(Clone, Debug)]
pub(crate) struct Verdict {
    /// Its findings.
    pub(crate) findings: Vec<Diagnostic>,
    /// What is known at its statements, where that was asked for.
    pub(crate) points: Option<Points>,
    /// What names and expressions mean in it, where that was asked for.
    pub(crate) noted: Option<Noted>,
    /// Which reactions start in it.
    pub(crate) starts: Option<Starts>,
    /// Which things it has to do with.
    pub(crate) uses: Option<Uses>,
    /// What it is asked for many runs.
    pub(crate) many: Option<Many>,
}

impl Moved for Verdict {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        self.findings.moved(to);
        for point in self.points.iter_mut().flat_map(|points| &mut points.points) {
            point.span.moved(to);
        }
        self.noted.moved(to);
        self.starts.moved(to);
        self.uses.moved(to);
        self.many.moved(to);
    }
}

/// A file of a package: where its items stand.
#[derive(Debug)]
struct File {
    file: FileId,
    text: String,
    items: Vec<Placed>,
}

/// An item and where it stands.
#[derive(Clone, Debug)]
struct Placed {
    start: usize,
    end: usize,
    sort: Sort,
    name: Option<String>,
}

/// What an item is to the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sort {
    /// Declares nothing.
    Nothing,
    /// Is judged, and says nothing to others but those that name it.
    Judged,
    /// May mean something for all others.
    Common,
}

/// What was judged of a package, and of which texts.
#[derive(Debug)]
pub(crate) struct Earlier {
    library: Vec<Arc<Module>>,
    files: Vec<File>,
    /// By item of the root file.
    verdicts: Vec<Judged>,
}

/// The verdict of an item.
#[derive(Debug)]
struct Judged {
    /// The item, by its number in the root file.
    item: usize,
    /// The item that it runs, if that is another one of the root file.
    runs: Option<usize>,
    /// Its lab: the module and the name.
    lab: (usize, String),
    verdict: Verdict,
}

/// How an earlier text of a package and this one belong together.
pub(crate) struct Match<'e> {
    earlier: &'e Earlier,
    /// Items of the root file: the number of each that stayed, by its number then.
    stayed: BTreeMap<usize, usize>,
    /// By file: from where on places are further on, and by how much.
    shifts: BTreeMap<FileId, Vec<Stretch>>,
    /// Whether the same names are declared.
    same_names: bool,
    /// Whether as many are, so that declarations have the numbers they had.
    same_numbers: bool,
}

/// An item that stayed as it was.
struct Stretch {
    start: usize,
    end: usize,
    by: i64,
}

impl Earlier {
    /// What there is to judge of a package now, without verdicts yet.
    pub(crate) fn of(modules: &[Arc<Module>], sources: &Sources, root: usize) -> Earlier {
        let library = modules.iter().filter(|m| m.is_library()).cloned().collect();
        let own = modules.iter().enumerate().filter(|(_, m)| !m.is_library());
        let files = own.map(|(index, module)| File {
            file: module.file,
            text: sources.get(module.file).map_or_else(String::new, |s| s.text.clone()),
            items: module.tree.items.iter().map(|item| placed(item, index == root)).collect(),
        });
        Earlier { library, files: files.collect(), verdicts: Vec::new() }
    }

    /// Keeps the verdict of an item of the root file.
    pub(crate) fn keep(&mut self, (item, runs): (usize, Option<usize>), lab: (usize, String), verdict: Verdict) {
        self.verdicts.push(Judged { item, runs, lab, verdict });
    }

    /// How this package belongs to a later state of it; nothing where anything has changed that may mean something for all.
    pub(crate) fn matched(&self, now: &Earlier, root: FileId) -> Option<Match<'_>> {
        let same_library = self.library.len() == now.library.len()
            && self.library.iter().zip(&now.library).all(|(a, b)| Arc::ptr_eq(a, b));
        if !same_library || self.files.len() != now.files.len() {
            return None;
        }
        let mut found = Match {
            earlier: self,
            stayed: BTreeMap::new(),
            shifts: BTreeMap::new(),
            same_names: true,
            same_numbers: true,
        };
        for (old, new) in self.files.iter().zip(&now.files) {
            if old.file != new.file {
                return None;
            }
            found.file(old, new, old.file == root)?;
        }
        Some(found)
    }
}

fn placed(item: &Item, in_root: bool) -> Placed {
    let judged = matches!(
        item.kind,
        ItemKind::Workflow { .. } | ItemKind::Test { .. } | ItemKind::Study { .. } | ItemKind::Fit { .. }
    );
    let sort = match &item.kind {
        ItemKind::Error => Sort::Nothing,
        _ if judged && in_root => Sort::Judged,
        _ => Sort::Common,
    };
    let name = item_name(item).map(|(name, _)| name);
    Placed { start: item.span.start as usize, end: item.span.end as usize, sort, name }
}

impl<'e> Match<'e> {
    /// Finds the items of a file that stayed; nothing where one of the common ones has changed.
    fn file(&mut self, old: &'e File, new: &File, is_root: bool) -> Option<()> {
        let of = |file: &File, sort: Sort| -> Vec<usize> {
            let all = file.items.iter().enumerate();
            all.filter(|(_, item)| item.sort == sort).map(|(index, _)| index).collect()
        };
        fn text<'f>(file: &'f File, item: &Placed) -> Option<&'f str> {
            file.text.get(item.start..item.end)
        }
        let mut pairs = Vec::new();
        let (before, now) = (of(old, Sort::Common), of(new, Sort::Common));
        if before.len() != now.len() {
            return None;
        }
        for (a, b) in before.into_iter().zip(now) {
            let (a, b) = (old.items.get(a).zip(Some(a))?, new.items.get(b).zip(Some(b))?);
            if text(old, a.0) != text(new, b.0) {
                return None;
            }
            pairs.push((a.1, b.1));
        }
        let mut free: BTreeSet<usize> = of(new, Sort::Judged).into_iter().collect();
        for a in of(old, Sort::Judged) {
            let Some(was) = old.items.get(a) else { continue };
            let same = |b: &&usize| {
                new.items.get(**b).is_some_and(|is| is.name == was.name && text(new, is) == text(old, was))
            };
            if let Some(b) = free.iter().find(same).copied() {
                free.remove(&b);
                pairs.push((a, b));
                if is_root {
                    self.stayed.insert(a, b);
                }
            }
        }
        let names = |file: &'_ File| -> BTreeSet<Option<String>> {
            file.items.iter().filter(|i| i.sort == Sort::Judged).map(|i| i.name.clone()).collect()
        };
        self.same_names &= names(old) == names(new);
        self.same_numbers &= of(old, Sort::Judged).len() == of(new, Sort::Judged).len();
        pairs.sort_unstable();
        let stretch = |(a, b): (usize, usize)| {
            let (was, is) = (old.items.get(a)?, new.items.get(b)?);
            Some(Stretch { start: was.start, end: was.end, by: is.start as i64 - was.start as i64 })
        };
        self.shifts.insert(old.file, pairs.into_iter().filter_map(stretch).collect());
        Some(())
    }

    /// The verdict of an item of the root file in a lab, with its places as they are now; nothing where the item is not as it was.
    pub(crate) fn verdict(&self, item: usize, lab: &(usize, String)) -> Option<Verdict> {
        let stayed = |judged: &&Judged| {
            let runs = judged.runs.is_none_or(|runs| self.stayed.contains_key(&runs));
            runs && judged.lab == *lab && self.stayed.get(&judged.item) == Some(&item)
        };
        // What was noted of names counts declarations.
        let known = self.earlier.verdicts.iter().find(stayed).filter(|_| self.same_numbers)?;
        // What is not found may be taken for another name.
        if !self.same_names && !known.verdict.findings.is_empty() {
            return None;
        }
        let whole = Cell::new(true);
        let to = |span: Span| match self.place(span) {
            Some(span) => span,
            None => {
                whole.set(false);
                span
            }
        };
        let mut verdict = known.verdict.clone();
        verdict.moved(&to);
        whole.get().then_some(verdict)
    }

    /// Where a place is now; nothing where what stood there has changed.
    fn place(&self, span: Span) -> Option<Span> {
        let Some(shifts) = self.shifts.get(&span.file) else { return Some(span) };
        let (start, end) = (span.start as usize, span.end as usize);
        if end == 0 {
            return Some(span);
        }
        let around = shifts.iter().find(|s| s.start <= start && end <= s.end)?;
        let at = |place: usize| u32::try_from(place as i64 + around.by).ok();
        Some(Span { file: span.file, start: at(start)?, end: at(end)? })
    }
}

/// The number of an item of a module, by its declaration.
pub(crate) fn number(names: &Names<'_>, id: DeclId) -> Option<usize> {
    let decl = names.decl(id);
    names.modules[decl.module].tree.items.iter().position(|item| std::ptr::eq(item, decl.item))
}
