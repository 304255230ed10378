//! What an editor asks of a text: pure functions of an [`Analysis`] and a place in it, counted in bytes. No protocol, files or clock.
//!
//! A question about a text that could not be read whole is answered as well as what could be read allows, never with a failure.

mod analysis;
pub mod calls;
pub mod complete;
mod drift;
mod edits;
mod fixes;
mod folds;
mod hints;
pub mod hover;
pub mod index;
mod outline;
pub mod references;
pub mod rename;
mod statement;
mod words;

pub use analysis::{Analysis, touches};
pub use drift::Drift;
pub use edits::{Replacement, replacements};
pub use fixes::{all_fixes, fixes_at};
pub use folds::{Fold, FoldKind, folds};
pub use hints::{Hint, Told, hints};
pub use index::Index;
pub use outline::{Symbol, SymbolKind, outline};
pub use statement::statement;
pub use words::{Kind, Word, words};
