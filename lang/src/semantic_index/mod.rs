//! What names and expressions were found to mean while a text was checked. It is noted only where that is asked for, by the
//! evaluator and the planner themselves, so that what is shown is what was checked.

mod resolutions;
mod sort;

use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::{FileId, Span, Unit};
use rustc_hash::FxHashMap;

pub use resolutions::Resolutions;
pub use sort::Sort;

use crate::declare::Tables;
use crate::library;
use crate::names::DeclId;
use crate::units::Units;

/// What an expression was found to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// What kind of value it is.
    pub sort: Sort,
    /// Its value, SI, where it is always the same number.
    pub value: Option<f64>,
    /// The unit it was written in.
    pub unit: Option<Unit>,
}

/// What was noted, where that is asked for.
pub type Seeing = Option<Box<Meanings>>;

/// All that a check has noted of a package, as it was noted piece by piece.
#[derive(Clone, Debug, Default)]
pub struct SemanticIndex {
    /// What is declared.
    pub around: Around,
    /// What the checks of declarations and of each workflow have noted; of what several did the first counts.
    pub pieces: Vec<Resolutions>,
}

impl SemanticIndex {
    /// All of it as one.
    pub fn joined(&self) -> Meanings {
        let mut all = Meanings::default();
        self.pieces.iter().for_each(|piece| piece.join_into(&mut all));
        all
    }
}

/// What was noted.
#[derive(Clone, Debug, Default)]
pub struct Meanings {
    /// Names, and where what they stand for is declared: its name, or the call form of a skill or command.
    pub names: FxHashMap<Span, Span>,
    /// Expressions.
    pub values: FxHashMap<Span, Seen>,
    /// Everything in each lab that was built, with its kinds, by the full names of both.
    pub things: BTreeMap<String, BTreeMap<String, Vec<DeclId>>>,
    /// A file of the library that is looked at; the others are not.
    pub opened: Option<FileId>,
}

/// What is declared, apart from the texts that declare it.
#[derive(Clone, Debug, Default)]
pub struct Around {
    /// What the names that each module sees stand for.
    pub scopes: Vec<BTreeMap<Arc<str>, DeclId>>,
    /// Each capability and asset with everything that it extends, most derived first.
    pub ancestors: BTreeMap<DeclId, Vec<DeclId>>,
    /// All dimensions and units.
    pub units: Units,
}

impl Around {
    /// What the tables say; the scopes of the modules are still to come.
    pub fn of(tables: &Tables<'_>) -> Around {
        let ancestors = tables.kinds.values().map(|kind| (kind.id, kind.ancestors.clone())).collect();
        Around { scopes: Vec::new(), ancestors, units: tables.units.clone() }
    }
}

impl Meanings {
    /// Whether what stands in a file is noted: the user's own files and the one of the library that is looked at.
    pub fn notes(&self, file: FileId) -> bool {
        !library::is_module(file) || self.opened == Some(file)
    }

    /// Notes a value; where there is one already, what is not the same in both is forgotten.
    pub fn see(&mut self, span: Span, seen: Seen) {
        match self.values.entry(span) {
            std::collections::hash_map::Entry::Vacant(free) => {
                free.insert(seen);
            }
            std::collections::hash_map::Entry::Occupied(mut known) => {
                let known = known.get_mut();
                if known.value != seen.value {
                    known.value = None;
                }
                known.sort.join(seen.sort);
            }
        }
    }
}
