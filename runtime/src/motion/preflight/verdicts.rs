//! What was found in whole programs, so that a check of what has not changed is instant.

use matterix_ir::{Diagnostic, Program};
use serde::{Deserialize, Serialize};

use super::seal::{self, MADE_BY, Store};

/// What they are kept under, with the first digits of a key: a file may have thousands of workflows, and no check should
/// have to read what is known of all.
const NAME: &str = "programs-";
/// How many digits.
const DIGITS: usize = 2;
/// How many programs are kept under a name, the last ones looked at.
const MOST: usize = 64;

#[derive(Serialize, Deserialize)]
struct Kept {
    made_by: String,
    verdicts: Vec<(String, Vec<Diagnostic>)>,
}

/// What a program is known by; its plan, which is half of it, is looked at by another thread.
fn key(program: &Program) -> Option<String> {
    let Program { version, files, scene, model, plan, inventory, drivers, offers } = program;
    let sum = |bytes: postcard::Result<Vec<u8>>| bytes.ok().map(|bytes| seal::sum(&bytes));
    let of_plan = || sum(postcard::to_allocvec(plan));
    let (plan, rest) = std::thread::scope(|scope| {
        let aside = std::thread::Builder::new().spawn_scoped(scope, of_plan);
        let rest = sum(postcard::to_allocvec(&(version, files, scene, model, inventory, drivers, offers)));
        // Where there is no thread to be had, this one does the work.
        (aside.ok().and_then(|aside| aside.join().ok()).unwrap_or_else(of_plan), rest)
    });
    Some(plan? + &rest?)
}

/// The findings of a program: those that are kept, or else what `look` finds, which is kept.
///
/// A program is known by all of it, texts and their places included, as findings quote them.
pub fn of(program: &Program, store: &dyn Store, look: impl FnOnce() -> Vec<Diagnostic>) -> Vec<Diagnostic> {
    let Some(key) = store.keeps().then(|| key(program)).flatten() else { return look() };
    let name = format!("{NAME}{}", &key[..DIGITS]);
    let verdicts = |bytes: Vec<u8>| seal::opened::<Kept>(&bytes).filter(|k| k.made_by == MADE_BY).map(|k| k.verdicts);
    let known = store.load(&name).and_then(verdicts).unwrap_or_default();
    if let Some((_, found)) = known.into_iter().find(|(k, _)| *k == key) {
        return found;
    }
    let found = look();
    seal::add(store, &name, |now| {
        let mut verdicts = now.and_then(verdicts).unwrap_or_default();
        verdicts.insert(0, (key, found.clone()));
        verdicts.truncate(MOST);
        seal::closed(&Kept { made_by: MADE_BY.to_string(), verdicts })
    });
    found
}
