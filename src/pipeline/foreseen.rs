//! What earlier checks of a file found to get where: the next one begins with that and finds out beside whether it still holds.

use std::path::absolute;

use matterix_lang::{Foreseen, Session};
use matterix_runtime::motion::{Store, seal};

use super::Input;

/// What it is kept under, with the first digits of a figure of the file's path.
const NAME: &str = "foreseen-";
/// How many digits.
const DIGITS: usize = 16;

/// What is kept of a file.
pub(super) struct Entry<'s> {
    store: &'s dyn Store,
    name: String,
    kept: Foreseen,
}

impl<'s> Entry<'s> {
    /// That of a file; none where nothing is kept. A session begins with it.
    pub(super) fn of(input: &Input, store: &'s dyn Store, session: &mut Session) -> Option<Self> {
        let path = store.keeps().then(|| absolute(&input.name).ok()).flatten()?;
        let figure = seal::sum(path.as_os_str().as_encoded_bytes());
        let name = format!("{NAME}{}", &figure[..DIGITS]);
        let kept: Foreseen = store.load(&name).and_then(|bytes| seal::opened(&bytes)).unwrap_or_default();
        session.foresee(&input.name, kept.clone());
        Some(Entry { store, name, kept })
    }

    /// Keeps what a session has found since.
    pub(super) fn keep(self, input: &Input, session: &mut Session) {
        let found = session.foreseen(&input.name);
        if *found != self.kept
            && let Some(bytes) = seal::closed(found)
        {
            self.store.save(&self.name, &bytes);
        }
    }
}
