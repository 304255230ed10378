//! On which words a verdict rests: those of what is judged, of what may mean something for all, and of every item that they name.

use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use rustc_hash::{FxHashSet, FxHasher};

use super::items::{File, Sort};

/// Words, as figures of them: two that are alike by chance only make more be judged again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Words(Arc<FxHashSet<u64>>);

impl Words {
    /// Whether what has this name may be meant: each of its words is among these.
    pub(super) fn name(&self, name: &str) -> bool {
        words(name).all(|word| self.0.contains(&figure(word)))
    }
}

/// What the items of a package say, by their names.
pub(super) struct DependencyClosure<'p> {
    named: Vec<(&'p str, &'p str)>,
    common: FxHashSet<u64>,
}

impl<'p> DependencyClosure<'p> {
    /// Of the files of a package.
    pub(super) fn of(files: &'p [File]) -> Self {
        let (mut named, mut common) = (Vec::new(), FxHashSet::default());
        for file in files {
            for (index, item) in file.items.iter().enumerate() {
                match (item.sort, file.name(index)) {
                    (sort, Some(name)) if sort.is_named() => named.push((name, file.text(index))),
                    (Sort::Common, _) => common.extend(words(file.text(index)).map(figure)),
                    _ => {}
                }
            }
        }
        DependencyClosure { named, common }
    }

    /// All words that these texts lead to.
    pub(super) fn from(&self, texts: &[&str]) -> Words {
        let mut all = self.common.clone();
        all.extend(texts.iter().flat_map(|text| words(text)).map(figure));
        let mut open: BTreeSet<usize> = (0..self.named.len()).collect();
        loop {
            let is_named = |index: &usize| words(self.named[*index].0).all(|word| all.contains(&figure(word)));
            let found: Vec<usize> = open.iter().copied().filter(is_named).collect();
            if found.is_empty() {
                return Words(Arc::new(all));
            }
            for index in found {
                open.remove(&index);
                all.extend(words(self.named[index].1).map(figure));
            }
        }
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).filter(|word| !word.is_empty())
}

fn figure(word: &str) -> u64 {
    let mut hasher = FxHasher::default();
    word.hash(&mut hasher);
    hasher.finish()
}
