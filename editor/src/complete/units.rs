//! Units after a number.

use matterix_lang::semantic_index::Sort;
use matterix_lang::units::Dimension;

use super::context::{Context, Token};
use super::values::Place;
use super::{Completion, Offer, Offers};

/// Prefixes that people use, with how much farther down the list they put a unit.
const PREFIXES: &[(&str, u8)] = &[("m", 1), ("u", 1), ("k", 2), ("n", 2), ("c", 2)];

impl Place<'_> {
    /// What the number before the cursor measures; of several kinds where all of them can stand there.
    pub(crate) fn measured(&self, context: &Context<'_>) -> Vec<Sort> {
        let tokens = &context.before;
        let named = |name: &str| Sort::Quantity(self.index.units().named(name), false);
        if self.is_tuple(tokens) {
            let wanted = self.wanted(context).sort.filter(|sort| dimension_of(sort).is_some());
            return vec![wanted.unwrap_or_else(|| named("Length"))];
        }
        if context.is_start() {
            return vec![Sort::Quantity(self.index.units().named("Temperature"), true)];
        }
        if context.is_holding() {
            return ["Volume", "Mass", "Amount"].map(named).to_vec();
        }
        if tokens.iter().any(|t| t.text == "labelled") {
            return vec![Sort::Concentration];
        }
        if context.item() == "solution" {
            let kinds = ["Volume", "Mass", "Amount", "MassFraction", "AmountConcentration", "MassConcentration"];
            return kinds.map(named).to_vec();
        }
        self.wanted(context).sort.into_iter().collect()
    }

    /// Whether the tokens end with several values in round brackets.
    pub(crate) fn is_tuple(&self, tokens: &[Token<'_>]) -> bool {
        if tokens.last().is_none_or(|t| t.text != ")") {
            return false;
        }
        let mut depth = 0;
        let start = tokens.iter().rposition(|t| {
            depth += i32::from(t.text == ")") - i32::from(t.text == "(");
            depth == 0
        });
        let Some(start) = start else { return false };
        // With a name right before them they are arguments.
        let called = start > 0 && tokens[start - 1].is_word() && tokens[start - 1].end() == tokens[start].start;
        !called && tokens[start..].iter().any(|t| t.text == ",")
    }

    /// Units of what is expected, those that the package writes first; all units where nothing is.
    pub(crate) fn units(&self, wanted: &[Sort], typed: &str, out: &mut Offers) {
        if wanted.contains(&Sort::Concentration) {
            for (dimension, written) in self.index.concentrations() {
                written.iter().for_each(|unit| self.unit(unit, 2, out));
                self.units_of(Some((dimension, false)), typed, out);
            }
            return;
        }
        let dimensions: Vec<_> = wanted.iter().filter_map(dimension_of).collect();
        if dimensions.is_empty() {
            return self.units_of(None, typed, out);
        }
        dimensions.into_iter().for_each(|dimension| self.units_of(Some(dimension), typed, out));
    }

    fn units_of(&self, wanted: Option<(Dimension, bool)>, typed: &str, out: &mut Offers) {
        let (dimension, point) = wanted.map_or((None, false), |(d, p)| (Some(d), p));
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
        let symbol = dimension.as_ref().filter(|d| !d.is_one() && !d.is_any()).map(|d| units.symbol(d));
        if let Some(symbol) = symbol.as_ref().filter(|symbol| !point && units.find(symbol).is_some()) {
            add(symbol.clone(), 2);
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
                PREFIXES.iter().for_each(|(p, further)| add(format!("{p}{name}"), rank + further));
            }
        }
        if let Some(symbol) = symbol {
            add(symbol, if point { 6 } else { 3 });
        }
        for (name, rank) in all {
            self.unit(&name, rank, out);
        }
    }

    fn unit(&self, name: &str, rank: u8, out: &mut Offers) {
        if out.all.iter().any(|c| c.kind == Offer::Unit && c.label == name) {
            return;
        }
        let resolved = self.index.units().resolve(name).ok();
        let detail = resolved.map(|r| self.index.described(&r.dimension, r.point)).unwrap_or_default();
        let def = self.index.measure(name);
        let (label, text) = (name.to_string(), name.to_string());
        out.all.push(Completion { label, text, kind: Offer::Unit, detail, def, rank });
    }
}

/// The dimension of what is expected, and whether it is a point on a scale; none where it has none.
fn dimension_of(wanted: &Sort) -> Option<(Dimension, bool)> {
    match wanted {
        Sort::Quantity(dimension, point) if !dimension.is_any() => Some((dimension.clone(), *point)),
        Sort::Range(inner) | Sort::List(inner) => dimension_of(inner),
        Sort::Tuple(items) => dimension_of(items.first()?),
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
