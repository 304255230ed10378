//! Verdicts of workflows that hold on: those whose own text stayed as it was, and that of all that it can mean, wherever it stands now.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use matterix_ir::points::Points;
use matterix_ir::{Diagnostic, FileId, Severity, Sources, Span};

use super::closure::{DependencyClosure, Words};
use super::items::{self, File};
use crate::check::{Starts, Uses};
use crate::names::{DeclId, Module, Names};
use crate::semantic_index::Resolutions;
use crate::study::Many;
use crate::syntax::relocate::Relocate;

/// What was found of a task.
#[derive(Clone, Debug)]
pub(crate) struct CachedAnalysis {
    /// Its findings.
    pub(crate) findings: Vec<Diagnostic>,
    /// What is known at its statements, where that was asked for.
    pub(crate) points: Option<Points>,
    /// What names and expressions mean in it, where that was asked for.
    pub(crate) noted: Option<Resolutions>,
    /// Which reactions start in it.
    pub(crate) starts: Option<Starts>,
    /// Which things it has to do with.
    pub(crate) uses: Option<Uses>,
    /// What it is asked for many runs.
    pub(crate) many: Option<Many>,
    /// What looking at motions has found, where that was asked for.
    pub(crate) moved: Option<Vec<Diagnostic>>,
}

impl Relocate for CachedAnalysis {
    fn moved(&mut self, to: &dyn Fn(Span) -> Span) {
        self.findings.moved(to);
        for point in self.points.iter_mut().flat_map(|points| &mut points.points) {
            point.span.moved(to);
        }
        self.noted.moved(to);
        self.starts.moved(to);
        self.uses.moved(to);
        self.many.moved(to);
        self.moved.moved(to);
    }
}

/// What was judged of a package, and of which texts.
#[derive(Debug)]
pub(crate) struct Snapshot {
    library: Vec<Arc<Module>>,
    files: Vec<File>,
    around: Environment,
    verdicts: Vec<Judged>,
}

/// What verdicts stand on beside the texts.
#[derive(Debug, PartialEq)]
pub(crate) struct Environment {
    /// A figure of the other files that modules name.
    pub(crate) beside: u64,
    /// Failures that something declares.
    pub(crate) failures: Arc<BTreeSet<String>>,
    /// Whether motions were looked at.
    pub(crate) moved: bool,
}

/// The verdict of an item.
#[derive(Debug)]
struct Judged {
    about: TaskKey,
    /// On which words it rests.
    words: Words,
    verdict: CachedAnalysis,
}

/// What a verdict is about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TaskKey {
    /// The item, by its number in the root file.
    pub(crate) item: usize,
    /// The item that it runs, if that is another one of the root file.
    pub(crate) runs: Option<usize>,
    /// Its lab: the module and the name.
    pub(crate) lab: (usize, String),
}

/// How an earlier text of a package and this one belong together.
pub(crate) struct Match<'e> {
    earlier: &'e Snapshot,
    /// Items of the root file: the number of each that stayed, by its number then.
    stayed: BTreeMap<usize, usize>,
    /// By file: from where on places are further on, and by how much.
    shifts: BTreeMap<FileId, Vec<Stretch>>,
    /// Numbers of declarations that stayed, by those then.
    numbers: BTreeMap<DeclId, DeclId>,
    /// Names of items that only those mean that name them, and that say something else, are gone or new.
    changed: BTreeSet<String>,
    /// Whether there are other names than before.
    renamed: bool,
}

/// An item that stayed as it was.
struct Stretch {
    start: usize,
    end: usize,
    by: i64,
}

impl Snapshot {
    /// What there is to judge of a package now, without verdicts yet.
    pub(crate) fn of(names: &Names<'_>, sources: &Sources, root: usize, around: Environment) -> Snapshot {
        let library = names.modules.iter().filter(|m| m.is_library()).cloned().collect();
        let own = names.modules.iter().enumerate().filter(|(_, m)| !m.is_library());
        let files = own.map(|(index, _)| File::of(names, index, sources, index == root)).collect();
        Snapshot { library, files, around, verdicts: Vec::new() }
    }

    /// On which words the verdicts of items of the root file rest, in their order.
    pub(crate) fn words(&self, root: FileId, about: &[TaskKey]) -> Vec<Words> {
        if about.is_empty() {
            return Vec::new();
        }
        let reach = DependencyClosure::of(&self.files);
        let Some(file) = self.files.iter().find(|file| file.file == root) else { return Vec::new() };
        about
            .iter()
            .map(|about| {
                let runs = about.runs.map_or("", |runs| file.text(runs));
                reach.from(&[file.text(about.item), runs, &about.lab.1])
            })
            .collect()
    }

    /// Keeps the verdict of an item of the root file.
    pub(crate) fn keep(&mut self, about: TaskKey, words: Words, verdict: CachedAnalysis) {
        self.verdicts.push(Judged { about, words, verdict });
    }

    /// How this package belongs to a later state of it; nothing where anything has changed that may mean something for all.
    pub(crate) fn matched(&self, now: &Snapshot, root: FileId) -> Option<Match<'_>> {
        let same_library = self.library.len() == now.library.len()
            && self.library.iter().zip(&now.library).all(|(a, b)| Arc::ptr_eq(a, b));
        let same_around = same_library && self.around == now.around;
        if !same_around || self.files.len() != now.files.len() {
            return None;
        }
        let mut found = Match {
            earlier: self,
            stayed: BTreeMap::new(),
            shifts: BTreeMap::new(),
            numbers: BTreeMap::new(),
            changed: BTreeSet::new(),
            renamed: false,
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

impl<'e> Match<'e> {
    /// Finds the items of a file that stayed; nothing where one has changed that may mean something for all.
    fn file(&mut self, old: &'e File, new: &File, is_root: bool) -> Option<()> {
        let pairs = items::pairs(old, new)?;
        self.renamed |= pairs.renamed;
        self.changed.extend(pairs.changed);
        let stretch = |(a, b): &(usize, usize)| {
            let (was, is) = (old.items.get(*a)?, new.items.get(*b)?);
            Some(Stretch { start: was.start, end: was.end, by: is.start as i64 - was.start as i64 })
        };
        self.shifts.insert(old.file, pairs.same.iter().filter_map(stretch).collect());
        self.numbers.extend(pairs.same.iter().filter_map(|(a, b)| old.number(*a).zip(new.number(*b))));
        if is_root {
            self.stayed.extend(pairs.same);
        }
        Some(())
    }

    /// The verdict of an item of the root file, with its places as they are now, and on which words it rests; nothing where
    /// something that it can mean is not as it was.
    pub(crate) fn verdict(&self, about: &TaskKey) -> Option<(CachedAnalysis, Words)> {
        let stayed = |judged: &&Judged| {
            let runs = judged.about.runs.map(|runs| self.stayed.get(&runs).copied());
            judged.about.lab == about.lab
                && self.stayed.get(&judged.about.item) == Some(&about.item)
                && runs == about.runs.map(Some)
        };
        let known = self.earlier.verdicts.iter().find(stayed)?;
        if self.changed.iter().any(|name| known.words.name(name)) {
            return None;
        }
        // What is not found may be taken for another name.
        let is_wrong = |d: &Diagnostic| d.severity == Severity::Error;
        if self.renamed && known.verdict.findings.iter().any(is_wrong) {
            return None;
        }
        let whole = Cell::new(true);
        let to = |span: Span| {
            self.place(span).unwrap_or_else(|| {
                whole.set(false);
                span
            })
        };
        let number = |id: DeclId| {
            self.numbers.get(&id).copied().unwrap_or_else(|| {
                whole.set(false);
                id
            })
        };
        let mut verdict = known.verdict.clone();
        verdict.moved(&to);
        verdict.noted.iter_mut().for_each(|noted| noted.renumber(&number));
        whole.get().then(|| (verdict, known.words.clone()))
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
