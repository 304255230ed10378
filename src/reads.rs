//! Keeps account of what is read from files, for who looks again when it changes.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::files;

/// The account that is kept now, if one is.
static ACCOUNT: Mutex<Option<Account>> = Mutex::new(None);

/// Files that were read, or looked for in vain.
#[derive(Debug, Default)]
pub struct Account {
    files: BTreeMap<PathBuf, Entry>,
}

/// What was found in a file, by a number that differs where the bytes do; none where it could not be read.
#[derive(Debug, PartialEq, Eq)]
struct Entry {
    found: Option<u64>,
    /// So many bytes might be read.
    largest: u64,
}

impl Account {
    /// Keeps account of what some work reads, in whichever thread.
    pub fn of<T>(work: impl FnOnce() -> T) -> (T, Account) {
        *account() = Some(Account::default());
        let result = work();
        (result, account().take().unwrap_or_default())
    }

    /// The files that were found, as they are now; an error where one holds something else by now.
    pub fn again(&self) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
        let found = self.files.iter().filter(|(_, entry)| entry.found.is_some());
        let read = |(path, entry): (&PathBuf, &Entry)| {
            let bytes = files::contents(path, entry.largest).map_err(|why| format!("`{}`: {why}", path.display()))?;
            match entry.found == Some(mark(&bytes)) {
                true => Ok((path.clone(), bytes)),
                false => Err(format!("`{}` has changed in the meantime", path.display())),
            }
        };
        found.map(read).collect()
    }

    /// Whether any of the files holds something else by now.
    pub fn is_outdated(&self) -> bool {
        let entry = |path: &Path, largest| Entry { found: files::contents(path, largest).ok().map(mark), largest };
        self.files.iter().any(|(path, before)| entry(path, before.largest) != *before)
    }

    /// Whether a path may be that of one of the files, or of a folder on the way to one, however it is written.
    pub fn may_name(&self, path: &Path) -> bool {
        let last = path.file_name();
        self.files.keys().any(|file| file.iter().any(|part| Some(part) == last))
    }
}

/// Notes what a file was found to hold, where an account is kept.
pub fn note(path: &Path, largest: u64, found: Option<&[u8]>) {
    if let Some(account) = &mut *account() {
        account.files.insert(path.to_path_buf(), Entry { found: found.map(mark), largest });
    }
}

fn account() -> MutexGuard<'static, Option<Account>> {
    ACCOUNT.lock().unwrap_or_else(PoisonError::into_inner)
}

fn mark(bytes: impl AsRef<[u8]>) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.as_ref().hash(&mut hasher);
    hasher.finish()
}
