//! Units after a number.

use matterix_lang::meanings::Sort;
use matterix_lang::units::Dimension;

use super::values::Place;
use super::{Completion, Offer, Offers};

/// Prefixes that people use.
const PREFIXES: &[&str] = &["k", "m", "u", "n", "c"];

impl Place<'_> {
    /// Units of what is expected, those that the package writes first; all units where nothing is.
    pub(crate) fn units(&self, wanted: Option<&Sort>, typed: &str, out: &mut Offers) {
        let (dimension, point) = dimension_of(wanted).map_or((None, false), |(d, p)| (Some(d), p));
        let units = self.index.units();
        let mut all: Vec<(String, u8)> = Vec::new();
        let mut add = |name: String, rank: u8| {
            if !all.iter().any(|(n, _)| *n == name) {
                all.push((name, rank));
            }
        };
        if let Some(dimension) = &dimension {
            for unit in self.index.written_units(dimension, point) {
                add(unit, 1);
            }
        }
        for name in units.unit_names() {
            let Some((def, _)) = units.find(name) else { continue };
            let fits = dimension.as_ref().is_none_or(|d| *d == def.dimension);
            // A point and a difference have units of their own.
            if !fits {
                continue;
            }
            let rank = if dimension.is_some() && point != def.offset.is_some() { 6 } else { 3 };
            add(name.to_string(), rank);
            let prefixed = def.prefixes && (dimension.is_some() || typed.chars().count() > 1);
            if prefixed {
                PREFIXES.iter().for_each(|p| add(format!("{p}{name}"), rank + 1));
            }
        }
        if let Some(dimension) = dimension.filter(|d| !d.is_one() && !d.is_any()) {
            add(units.symbol(&dimension), if point { 6 } else { 2 });
        }
        for (name, rank) in all {
            let resolved = units.resolve(&name).ok();
            let detail = resolved.map(|r| self.index.described(&r.dimension, r.point)).unwrap_or_default();
            let def = self.index.measure(&name);
            out.all.push(Completion { text: name.clone(), label: name, kind: Offer::Unit, detail, def, rank });
        }
    }
}

/// The dimension of what is expected, and whether it is a point on a scale.
fn dimension_of(wanted: Option<&Sort>) -> Option<(Dimension, bool)> {
    match wanted? {
        Sort::Quantity(dimension, point) if !dimension.is_any() => Some((dimension.clone(), *point)),
        Sort::Range(inner) | Sort::List(inner) => dimension_of(Some(inner)),
        Sort::Tuple(items) => dimension_of(items.first()),
        _ => None,
    }
}

impl crate::Index {
    /// Units of a dimension that the package writes, the most frequent first.
    pub(crate) fn written_units(&self, dimension: &Dimension, point: bool) -> Vec<String> {
        let mut counts: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
        for seen in self.all_seen() {
            if let (Sort::Quantity(of, at), Some(unit)) = (&seen.sort, &seen.unit)
                && of == dimension
                && *at == point
                && !unit.symbol.is_empty()
            {
                *counts.entry(&unit.symbol).or_default() += 1;
            }
        }
        let mut all: Vec<(&str, usize)> = counts.into_iter().collect();
        all.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
        all.into_iter().map(|(unit, _)| unit.to_string()).collect()
    }
}
