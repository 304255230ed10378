//! What people call units: `grams`, `milliliter`, `celsius`. None of it is read as a unit; it says which one is meant.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{PREFIXES, Units};
use crate::names::near::same_letters;

/// What the documentation of a unit calls it, in lower case: `The litre, a cubic decimetre.` is `litre`.
pub(crate) fn called(docs: &[String]) -> Option<Arc<str>> {
    let said = docs.first()?.strip_prefix("The ")?;
    let name = said.split([',', '.', ':', ';', '(']).next()?.trim();
    (!name.is_empty()).then(|| name.to_lowercase().into())
}

impl Units {
    /// The units that go by a name, best first: by their whole name, with the name of a prefix, else by a word of it.
    pub(super) fn known_as(&self, name: &str) -> Vec<String> {
        let word = name.to_lowercase();
        let all = || self.units.iter().filter_map(|(symbol, unit)| Some((symbol, unit, unit.called.as_deref()?)));
        let mut whole: BTreeSet<(bool, String)> = BTreeSet::new();
        for (symbol, unit, called) in all() {
            whole.extend(meant(&word, called).map(|exactly| (!exactly, symbol.clone())));
            for (prefix, long, _) in PREFIXES.iter().filter(|p| unit.prefixes && p.0.is_ascii()) {
                let rest = word.strip_prefix(long).and_then(|rest| meant(rest, called));
                whole.extend(rest.map(|exactly| (!exactly, format!("{prefix}{symbol}"))));
            }
        }
        let exact = whole.first().is_some_and(|(rough, _)| !rough);
        if !whole.is_empty() {
            return whole.into_iter().filter(|(rough, _)| !(exact && *rough)).map(|(_, symbol)| symbol).collect();
        }
        let part = |called: &str| called.split(' ').any(|own| meant(&word, own) == Some(true));
        all().filter(|(_, _, called)| part(called)).map(|(symbol, ..)| symbol.clone()).collect()
    }
}

/// Whether a word, or what it is the plural of, is a name: exactly, or cut short or misspelt; none where it is another.
fn meant(word: &str, name: &str) -> Option<bool> {
    let single = word.strip_suffix('s').filter(|single| single.len() >= 3);
    let forms = || [Some(word), single].into_iter().flatten();
    if forms().any(|form| form == name) {
        return Some(true);
    }
    // `sec`, `liter`, `celcius`; short words are near to too many.
    let cut = |form: &str| form.len() >= 3 && !name.contains(' ') && name.starts_with(form);
    let spelt = |form: &str| {
        let near = strsim::damerau_levenshtein(form, name) == 1;
        near && (form.len() >= 6 || form.len() >= 5 && same_letters(form, name))
    };
    forms().any(|form| cut(form) || spelt(form)).then_some(false)
}
