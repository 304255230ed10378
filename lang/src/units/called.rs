//! What people call units: `grams`, `milliliter`, `celsius`. None of it is read as a unit; it says which one is meant.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{Dimension, PREFIXES, UnitDef, Units};
use crate::near::same_letters;

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
        let part = |called: &str| called.split(' ').any(|own| is(&word, own) || is_nearly(&word, own));
        all().filter(|(_, _, called)| part(called)).map(|(symbol, ..)| symbol.clone()).collect()
    }
}

impl Units {
    /// The units of a dimension that a symbol is short for: `degC` where `C` is written and a temperature is meant.
    pub(crate) fn short_for(&self, symbol: &str, dimension: &Dimension, point: bool) -> Vec<&str> {
        let longer = |own: &str| own.len() > symbol.len() && own.ends_with(symbol) && own.is_ascii();
        let fits = |unit: &UnitDef| unit.dimension == *dimension && unit.offset.is_some() == point;
        self.units.iter().filter(|(own, unit)| longer(own) && fits(unit)).map(|(own, _)| own.as_str()).collect()
    }
}

/// Whether a word is a whole name: exactly, or cut short as `sec`, or misspelt; none where it is another.
fn meant(word: &str, name: &str) -> Option<bool> {
    let cut = word.len() >= 3 && !name.contains(' ') && name.starts_with(word);
    if is(word, name) { Some(true) } else { (cut || is_nearly(word, name)).then_some(false) }
}

/// Whether a word is a name or its plural.
fn is(word: &str, name: &str) -> bool {
    forms(word).any(|form| form == name)
}

/// Whether a word is one slip away from a name: `liter`, `celcius`; short words are near to too many.
fn is_nearly(word: &str, name: &str) -> bool {
    let enough = |form: &str| form.len() >= 6 || form.len() >= 5 && same_letters(form, name);
    forms(word).any(|form| enough(form) && strsim::damerau_levenshtein(form, name) == 1)
}

/// A word, and what it is the plural of.
fn forms(word: &str) -> impl Iterator<Item = &str> {
    let single = word.strip_suffix('s').filter(|single| single.len() >= 3);
    std::iter::once(word).chain(single)
}
