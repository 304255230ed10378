//! The chemical screen: which species belong to which reactive groups, which of them must not meet, and what attacks a
//! vessel. Groups, pairs and materials are declared in the language; nothing of chemistry stands here.
//!
//! A species belongs to a group by its structure, by being one of the group's members, by what it says of itself, or
//! by the ions it splits into.

mod consequence;
mod member;
mod read;
mod watch;

use std::collections::BTreeMap;
use std::sync::OnceLock;

use matterix_ir::{Severity, Span};

use crate::chem::Pattern;
use crate::declare::species::SpeciesTable;
use crate::declare::{SpeciesId, tables::ReactionDef};
use crate::names::DeclId;
use matterix_ir::listing::joined;

pub use consequence::Consequence;
pub use member::Seat;
pub use watch::watched;

/// One side of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Party {
    /// A reactive group, by its index.
    Group(usize),
    /// What a vessel is made of.
    Material(DeclId),
    /// One species.
    Species(SpeciesId),
}

/// The content from which on something counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Least {
    /// mol per kg of mixture.
    Amount(f64),
    /// kg per kg of mixture.
    Share(f64),
}

/// A reactive group.
#[derive(Debug)]
pub struct Group {
    /// Its declaration.
    pub decl: DeclId,
    /// In words, plural: `ketones`.
    pub title: String,
    /// Where it is published.
    pub source: String,
    patterns: Vec<String>,
    exceptions: Vec<String>,
    read: OnceLock<(Vec<Pattern>, Vec<Pattern>)>,
    members: Vec<(SpeciesId, Option<Least>)>,
    least: Option<Least>,
}

/// Two that must not meet.
#[derive(Debug)]
pub struct Incompatibility {
    /// The parties, in order.
    pub parties: (Party, Party),
    /// The gravest first.
    pub consequences: Vec<Consequence>,
    /// Content of either from which on this is so; at any content where absent.
    pub least: Option<Least>,
    /// The phase that a species must state for it to count, such as `liquid`.
    pub phase: Option<String>,
    /// Where it is published.
    pub source: String,
    /// Its declaration.
    pub span: Span,
}

impl Incompatibility {
    /// How bad it is.
    pub fn severity(&self) -> Severity {
        self.consequences.iter().map(|c| c.severity()).min().unwrap_or(Severity::Warning)
    }

    /// What happens, in words: `heat and fire`.
    pub fn words(&self) -> String {
        let words: Vec<&str> = self.consequences.iter().map(|c| c.words()).collect();
        if words.is_empty() { "a hazard".to_owned() } else { joined(&words, "and") }
    }
}

/// A species in a mixture: mol per kg of mixture (kg per kg where counted by mass), absent where it is not known.
pub type Presence = (SpeciesId, Option<f64>);

/// A pair found between two contents.
#[derive(Clone, Copy, Debug)]
pub struct Match<'s> {
    /// What is declared.
    pub pair: &'s Incompatibility,
    /// As what the first one belongs to it.
    pub a: Party,
    /// As what the second one belongs to it.
    pub b: Party,
}

/// Everything declared.
#[derive(Debug, Default)]
pub struct Screen {
    groups: Vec<Group>,
    by_decl: BTreeMap<DeclId, usize>,
    /// Materials in words.
    materials: BTreeMap<DeclId, String>,
    pairs: Vec<Incompatibility>,
    index: BTreeMap<(Party, Party), Vec<usize>>,
    /// Groups that a species states for itself.
    stated: BTreeMap<SpeciesId, Vec<usize>>,
    allowed: Vec<(Party, Party)>,
    seats: Vec<OnceLock<Vec<Seat>>>,
}

impl Screen {
    /// The gravest incompatibility of two species in one mixture, each as concentrated as it gets there.
    pub fn pair(&self, species: &SpeciesTable<'_>, a: Presence, b: Presence) -> Option<Match<'_>> {
        self.gravest(self.matches(self.seats(species, a.0), self.seats(species, b.0), species, a.1, b.1))
    }

    /// The gravest way in which a species attacks a material.
    pub fn material(&self, species: &SpeciesTable<'_>, material: DeclId, s: Presence) -> Option<Match<'_>> {
        let wall = [Seat::of(Party::Material(material), s.0)];
        self.gravest(self.matches(&wall, self.seats(species, s.0), species, None, s.1))
    }

    /// Whether nothing is known of what a species belongs to: it has no structure and states no group.
    pub fn is_unknown(&self, species: &SpeciesTable<'_>, s: SpeciesId) -> bool {
        let def = species.get(s);
        let decided = |id: SpeciesId| species.get(id).structure.is_some();
        let by_ions = !def.dissolves.is_empty() && def.dissolves.iter().all(|(ion, _)| decided(*ion));
        if decided(s) || by_ions || self.stated.contains_key(&s) {
            return false;
        }
        !self.seats(species, s).iter().any(|seat| matches!(seat.party, Party::Group(_)))
    }

    /// Whether the source says that these two may meet.
    pub fn is_allowed(&self, species: &SpeciesTable<'_>, a: SpeciesId, b: SpeciesId) -> bool {
        let is = |party: Party, s: SpeciesId| self.seats(species, s).iter().any(|seat| seat.party == party);
        self.allowed.iter().any(|(x, y)| (is(*x, a) && is(*y, b)) || (is(*x, b) && is(*y, a)))
    }

    /// Whether the source says that this species may be in a vessel of this material.
    pub fn is_allowed_in(&self, species: &SpeciesTable<'_>, material: DeclId, s: SpeciesId) -> bool {
        let is = |party: Party| self.seats(species, s).iter().any(|seat| seat.party == party);
        let wall = Party::Material(material);
        self.allowed.iter().any(|(x, y)| (*x == wall && is(*y)) || (*y == wall && is(*x)))
    }

    /// A group or material in words.
    pub fn title(&self, party: Party) -> Option<&str> {
        match party {
            Party::Group(g) => self.groups.get(g).map(|g| g.title.as_str()),
            Party::Material(id) => self.materials.get(&id).map(String::as_str),
            Party::Species(_) => None,
        }
    }

    fn matches<'s>(
        &'s self,
        a: &[Seat],
        b: &[Seat],
        species: &SpeciesTable<'_>,
        content_a: Option<f64>,
        content_b: Option<f64>,
    ) -> Vec<Match<'s>> {
        let mut out = Vec::new();
        for x in a {
            for y in b {
                let Some(found) = self.index.get(&in_order(x.party, y.party)) else { continue };
                for pair in found.iter().map(|i| &self.pairs[*i]) {
                    let enough = |seat: &Seat, content| {
                        let wall = matches!(seat.party, Party::Material(_));
                        let is = |phase: &String| species.get(seat.counted).phase() == Some(phase.as_str());
                        if !wall && !pair.phase.as_ref().is_none_or(is) {
                            return false;
                        }
                        wall || (seat.reaches(seat.least, species, content)
                            && seat.reaches(pair.least, species, content))
                    };
                    if enough(x, content_a) && enough(y, content_b) {
                        out.push(Match { pair, a: x.party, b: y.party });
                    }
                }
            }
        }
        out
    }

    fn gravest<'s>(&self, found: Vec<Match<'s>>) -> Option<Match<'s>> {
        found.into_iter().min_by(|a, b| a.pair.consequences.cmp(&b.pair.consequences))
    }
}

fn in_order(a: Party, b: Party) -> (Party, Party) {
    if a <= b { (a, b) } else { (b, a) }
}

/// How a reaction of the file brings two species together: not at all, through ions of one, or as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Intended {
    /// No reaction of the file needs both.
    No,
    /// A reaction needs ions that they split into.
    ByIons,
    /// Both are reactants as they are.
    Directly,
}

/// Whether a reaction that the user declared needs both species: then they are meant to meet.
pub fn intended(
    reactions: &[ReactionDef<'_>],
    is_library: impl Fn(usize) -> bool,
    species: &SpeciesTable<'_>,
    a: SpeciesId,
    b: SpeciesId,
) -> Intended {
    let needs = |r: &ReactionDef<'_>, x: &[SpeciesId], y: &[SpeciesId]| {
        let among = |set: &[SpeciesId]| -> Vec<SpeciesId> {
            r.reactants.iter().map(|t| t.0).filter(|s| set.contains(s)).collect()
        };
        let (x, y) = (among(x), among(y));
        x.iter().any(|s| y.iter().any(|t| s != t))
    };
    let with_ions = |s: SpeciesId| -> Vec<SpeciesId> {
        std::iter::once(s).chain(species.get(s).dissolves.iter().map(|d| d.0)).collect()
    };
    let (ions_a, ions_b) = (with_ions(a), with_ions(b));
    let mut found = Intended::No;
    for r in reactions.iter().filter(|r| !is_library(r.module)) {
        if needs(r, &[a], &[b]) {
            return Intended::Directly;
        }
        if needs(r, &ions_a, &ions_b) {
            found = Intended::ByIons;
        }
    }
    found
}
