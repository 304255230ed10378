//! What a species belongs to.

use super::{Group, Least, Party, Screen};
use crate::chem::{Element, Formula, Pattern, Rational};
use crate::declare::SpeciesId;
use crate::declare::species::SpeciesTable;

/// As what a species takes part in pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seat {
    /// The group, or the species or ion itself.
    pub party: Party,
    /// Content from which on it belongs there.
    pub least: Option<Least>,
    /// What is counted: the species, or the ion it gives.
    pub counted: SpeciesId,
    /// How many of it one unit of the species gives.
    pub times: f64,
}

impl Seat {
    /// A seat at any content.
    pub fn of(party: Party, s: SpeciesId) -> Seat {
        Seat { party, least: None, counted: s, times: 1.0 }
    }

    /// Whether a content of the species, mol per kg of mixture, reaches a limit; a content that is not known does.
    pub fn reaches(&self, least: Option<Least>, species: &SpeciesTable<'_>, content: Option<f64>) -> bool {
        let (Some(least), Some(content)) = (least, content) else { return content.is_none_or(|c| c > 0.0) };
        let def = species.get(self.counted);
        let counted = content * self.times;
        // Recipes are rounded: what is at the limit within their digits counts.
        let reached = |value: f64, limit: f64| value >= limit * (1.0 - 1e-6);
        match least {
            // What is counted by mass has no amount: an amount limit says nothing of it.
            Least::Amount(limit) => def.by_mass || reached(counted, limit),
            Least::Share(limit) => reached(counted * def.molar_mass, limit),
        }
    }
}

impl Group {
    fn has(&self, species: &SpeciesTable<'_>, s: SpeciesId) -> Option<Option<Least>> {
        let def = species.get(s);
        for (member, least) in &self.members {
            if *member == s || same(species, *member, s) {
                return Some(least.or(self.least));
            }
        }
        let structure = def.structure.as_ref()?;
        let (patterns, exceptions) = self.read.get_or_init(|| {
            let read = |texts: &[String]| texts.iter().filter_map(|t| Pattern::parse(t).ok()).collect();
            (read(&self.patterns), read(&self.exceptions))
        });
        let found = |list: &[Pattern]| list.iter().any(|p| p.is_in(structure) == Some(true));
        (found(patterns) && !found(exceptions)).then_some(self.least)
    }
}

/// Whether two entries of the table are one substance: the same structure, or, where one has none, the same formula, if that has no
/// isomers.
fn same(species: &SpeciesTable<'_>, a: SpeciesId, b: SpeciesId) -> bool {
    let (a, b) = (species.get(a), species.get(b));
    match (&a.structure, &b.structure) {
        (Some(x), Some(y)) => x == y,
        _ => a.formula.as_ref().is_some_and(|formula| Some(formula) == b.formula.as_ref() && !has_isomers(formula)),
    }
}

/// Whether a formula is that of many substances: those of compounds with hydrogen and several carbon atoms are.
fn has_isomers(formula: &Formula) -> bool {
    formula.count(Element::C) > Rational::ONE && formula.count(Element::H) > Rational::ZERO
}

impl Screen {
    /// Everything a species takes part in pairs as.
    pub fn seats(&self, species: &SpeciesTable<'_>, s: SpeciesId) -> &[Seat] {
        let Some(known) = self.seats.get(s.0 as usize) else { return &[] };
        known.get_or_init(|| {
            let mut out = Vec::new();
            self.add_seats(species, s, s, 1.0, &mut out);
            for (ion, times) in &species.get(s).dissolves {
                self.add_seats(species, s, *ion, *times, &mut out);
            }
            out
        })
    }

    fn add_seats(&self, species: &SpeciesTable<'_>, s: SpeciesId, counted: SpeciesId, times: f64, out: &mut Vec<Seat>) {
        out.push(Seat { party: Party::Species(counted), least: None, counted, times });
        for (index, group) in self.groups.iter().enumerate() {
            let stated = self.stated.get(&s).filter(|_| s == counted).is_some_and(|list| list.contains(&index));
            let least = if stated { Some(group.least) } else { group.has(species, counted) };
            let Some(least) = least else { continue };
            let party = Party::Group(index);
            // The species itself decides before its ions do.
            if !out.iter().any(|seat| seat.party == party) {
                out.push(Seat { party, least, counted, times });
            }
        }
    }
}
