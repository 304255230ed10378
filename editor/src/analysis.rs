//! What is known of a file after a check.

use std::sync::{Arc, OnceLock};

use matterix_ir::points::{Point, Points};
use matterix_ir::{Diagnostic, FileId, Sources, Span};
use matterix_lang::names::Module;
use matterix_lang::program::{self, Examined};
use matterix_lang::{Loader, SemanticIndex, Session};
use matterix_syntax::ast;

use crate::Index;

/// A file with everything that it imports, as the last check saw it.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The file that was checked.
    pub root: FileId,
    /// All texts, those of the library too.
    pub sources: Sources,
    /// All modules with their trees: the library's first, then those of the package.
    pub modules: Vec<Arc<Module>>,
    /// What was found, each finding once.
    pub findings: Vec<Diagnostic>,
    /// What is known at the statements of the workflows that could be followed.
    pub points: Vec<Points>,
    /// What names and expressions mean.
    pub meanings: Arc<SemanticIndex>,
    /// The index of names, once it was asked for.
    pub index: OnceLock<Arc<Index>>,
}

impl Analysis {
    /// Checks a text under its name; imports come from the loader. What the session knows from earlier checks is not worked out again.
    pub fn of(name: &str, text: &str, loader: &dyn Loader, session: &mut Session) -> Analysis {
        let mut sources = Sources::default();
        let root = sources.add(name, text);
        let seen = program::examined(&mut sources, root, loader, session, &|| false).unwrap_or_default();
        Analysis::seen(root, sources, seen)
    }

    /// The same; nothing where `stop` says, on the way, that it is of no use any more.
    pub fn unless(
        name: &str,
        text: &str,
        loader: &dyn Loader,
        session: &mut Session,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Analysis> {
        let mut sources = Sources::default();
        let root = sources.add(name, text);
        let seen = program::examined(&mut sources, root, loader, session, stop)?;
        Some(Analysis::seen(root, sources, seen))
    }

    fn seen(root: FileId, sources: Sources, seen: Examined) -> Analysis {
        let Examined { modules, findings, points, meanings } = seen;
        Analysis { root, sources, modules, findings, points, meanings: Arc::new(meanings), index: OnceLock::new() }
    }

    /// The index of names.
    pub fn index(&self) -> Arc<Index> {
        self.index.get_or_init(|| Arc::new(Index::of(self))).clone()
    }

    /// Whether another one knows the same of the same statements, as far as that can be seen at a glance.
    pub fn knows_the_same(&self, other: &Analysis) -> bool {
        fn points(of: &Analysis) -> impl Iterator<Item = &Point> {
            of.points.iter().flat_map(|points| &points.points)
        }
        points(self).count() == points(other).count()
            && points(self).zip(points(other)).all(|(a, b)| {
                let same = match (&a.after, &b.after) {
                    (Some(a), Some(b)) => Arc::ptr_eq(a, b),
                    (a, b) => a.is_none() && b.is_none(),
                };
                same && a.span == b.span
            })
    }

    /// The text of a file; empty where it is not known.
    pub fn text(&self, file: FileId) -> &str {
        self.sources.get(file).map_or("", |source| &source.text)
    }

    /// The module that a file is.
    pub fn module(&self, file: FileId) -> Option<&Module> {
        self.modules.iter().find(|module| module.file == file).map(|module| &**module)
    }

    /// The tree of a file.
    pub fn tree(&self, file: FileId) -> Option<&ast::File> {
        self.module(file).map(|module| &module.tree)
    }

    /// The file under a name: a path as its loader gives it, or `std::heating`.
    pub fn file(&self, name: &str) -> Option<FileId> {
        (0..).map(FileId).map_while(|id| Some((id, self.sources.get(id)?))).find(|(_, s)| s.name == name).map(|f| f.0)
    }

    /// Whether a file is part of the standard library, whose text is not the user's to change.
    pub fn is_library(&self, file: FileId) -> bool {
        self.module(file).is_some_and(Module::is_library)
    }
}

/// Whether a place lies in a span or at its end, where a cursor behind a word stands.
pub fn touches(span: Span, file: FileId, offset: usize) -> bool {
    span.file == file && (span.start as usize..=span.end as usize).contains(&offset)
}
