//! What a run watches its mixtures for: pairs of species that may be in one of them and should not.

use std::collections::BTreeSet;

use matterix_ir::Severity;
use matterix_ir::model::{Incompatible, Mixture};

use super::{Intended, Least, Party, Seat, intended};
use crate::declare::species::SpeciesTable;
use crate::declare::{SpeciesId, Tables};

/// The pairs among what these mixtures may hold, with the contents from which on they count. What was `brought` into the lab counts
/// as there where its ions are.
pub fn watched(tables: &Tables<'_>, mixtures: &[Mixture], brought: &BTreeSet<SpeciesId>) -> Vec<Incompatible> {
    let mut pairs: BTreeSet<(u32, u32)> = BTreeSet::new();
    for mixture in mixtures {
        let held: BTreeSet<u32> = mixture.contents.iter().map(|c| c.species).collect();
        let dissolved = brought.iter().filter(|s| {
            let ions = &tables.species.get(**s).dissolves;
            !ions.is_empty() && ions.iter().all(|(ion, _)| held.contains(&ion.0))
        });
        let all: BTreeSet<u32> = dissolved.map(|s| s.0).chain(held.iter().copied()).collect();
        for a in &all {
            pairs.extend(all.range(a + 1..).map(|b| (*a, *b)));
        }
    }
    pairs.into_iter().flat_map(|(a, b)| between(tables, SpeciesId(a), SpeciesId(b))).collect()
}

fn between(tables: &Tables<'_>, a: SpeciesId, b: SpeciesId) -> Vec<Incompatible> {
    let (screen, species) = (&tables.screen, &tables.species);
    let found = screen.matches(screen.seats(species, a), screen.seats(species, b), species, None, None);
    if found.is_empty() {
        return Vec::new();
    }
    // In a run ions are what their salts are in the text: what is said of a salt holds for them.
    let (of_a, of_b) = (sources(species, a), sources(species, b));
    let both = || of_a.iter().flat_map(|x| of_b.iter().map(move |y| (*x, *y)));
    if both().any(|(x, y)| screen.is_allowed(species, x, y)) {
        return Vec::new();
    }
    let library = |module: usize| tables.names.modules[module].is_library();
    let meant = both().map(|(x, y)| intended(&tables.reactions, library, species, x, y)).max().unwrap_or(Intended::No);
    let name = |s: SpeciesId| species.get(s).name.clone();
    let mut out: Vec<Incompatible> = Vec::new();
    for one in found {
        let severity = one.pair.severity();
        if meant == Intended::Directly || (meant == Intended::ByIons && severity == Severity::Warning) {
            continue;
        }
        let least = (
            needed(screen.seats(species, a), one.a, one.pair.least, species),
            needed(screen.seats(species, b), one.b, one.pair.least, species),
        );
        let belongs = |s, party| screen.title(party).map(|title| format!("`{}` is one of the {title}", name(s)));
        let why: Vec<String> = [belongs(a, one.a), belongs(b, one.b)].into_iter().flatten().collect();
        let why = if why.is_empty() { "this pair is published as incompatible".to_owned() } else { why.join(", ") };
        let help = vec![format!("{why} ({})", one.pair.source)];
        let words = one.pair.words();
        let ions = (ions(species, a), ions(species, b));
        let new = Incompatible { species: (a.0, b.0), ions, least, severity, words, help };
        if !out.contains(&new) {
            out.push(new);
        }
    }
    out.sort_by_key(|i| i.severity);
    out
}

/// A species, and what dissolves into it.
fn sources(species: &SpeciesTable<'_>, s: SpeciesId) -> Vec<SpeciesId> {
    let salts = species.iter().filter(|(_, def)| def.dissolves.iter().any(|(ion, _)| *ion == s)).map(|(id, _)| id);
    std::iter::once(s).chain(salts).collect()
}

fn ions(species: &SpeciesTable<'_>, s: SpeciesId) -> Vec<(u32, f64)> {
    species.get(s).dissolves.iter().map(|(ion, times)| (ion.0, *times)).collect()
}

/// The content of a species from which on it counts as a party of a pair.
fn needed(seats: &[Seat], party: Party, least: Option<Least>, species: &SpeciesTable<'_>) -> f64 {
    let Some(seat) = seats.iter().find(|seat| seat.party == party) else { return 0.0 };
    let def = species.get(seat.counted);
    let content = |least: Least| match least {
        // What is counted by mass has no amount.
        Least::Amount(_) if def.by_mass => 0.0,
        Least::Amount(limit) => limit / seat.times,
        Least::Share(limit) => limit / (seat.times * def.molar_mass),
    };
    [seat.least, least].into_iter().flatten().map(content).fold(0.0, f64::max)
}
