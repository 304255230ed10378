//! What can be asked of a value with a dot or in brackets.

use matterix_lang::names::DeclId;
use matterix_lang::semantic_index::Sort;

use super::{DefId, Index, Kind, Meaning};

/// A member of a value.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// What it is.
    pub meaning: Meaning,
    /// What kind of value it has.
    pub sort: Sort,
}

/// What the compiler knows of a species beside what is stated of it.
const OF_SPECIES: &[(&str, &str)] = &[
    ("molar_mass", "mass per amount of substance, from the formula"),
    ("charge", "charge number, from the formula"),
    ("splits", "whether it becomes ions in water"),
    ("ions", "the ions it becomes in water"),
    ("count", "the number of an ion that it releases: `s.count(ion)`"),
];

/// What can be asked of a reaction.
const OF_REACTION: &[(&str, &str)] = &[
    ("species", "all species of the equation"),
    ("reactants", "the species that are consumed"),
    ("products", "the species that are formed"),
    ("orders", "the species that the rate depends on"),
    ("unordered", "the reactants of order 0"),
    ("limiting", "the reactants that a law of this order uses up in finite time: those without an order of 1 or more"),
    ("valid", "temperatures between which the rate law holds"),
    ("enthalpy", "energy per mole of reaction"),
    ("rate", "the rate constant at a temperature: `r.rate(T)`"),
    ("order", "the order in a species: `r.order(s)`"),
    ("coefficient", "the coefficient of a species, negative if it is consumed: `r.coefficient(s)`"),
    ("basis", "the quantity of a mixture that the rate refers to: `r.basis(m)`"),
    ("requires", "whether its condition is true in a mixture: `r.requires(m)`"),
];

/// What can be asked of a list.
const OF_LIST: &[(&str, &str)] = &[
    ("count", "how many there are"),
    ("first", "the first one; `first(8)`: the first eight"),
    ("last", "the last one; `last(8)`: the last eight"),
    ("flat", "one list of its elements, without lists in it"),
    ("pairs", "each with the next: `pair.first`, `pair.second`"),
];

/// What can be asked of a grid as well.
const OF_GRID: &[(&str, &str)] = &[
    ("rows", "all rows of the grid, back to front"),
    ("columns", "all columns of the grid, left to right"),
    ("row", "a row by its number, from 1: `plate.row(1)`"),
    ("column", "a column by its number, from 1: `plate.column(2)`"),
    ("well", "the n-th place, column by column, from 1: `plate.well(5)`"),
];

/// What can be asked of a step.
const OF_STEP: &[(&str, &str)] =
    &[("start", "its start time"), ("end", "its end time"), ("elapsed", "its duration so far")];

/// What can be asked of a row of a table, besides its columns.
const OF_ROW: &[(&str, &str)] = &[("line", "its line in the file")];

/// What can be asked of a thing that counts species.
const OF_MIXTURE: &[(&str, &str)] =
    &[("species", "all species that can get into it"), ("basis", "the quantity that a rate refers to: `m.basis`")];

/// Points that every shape has.
const OF_SHAPE: &[(&str, &str)] = &[
    ("top", "the middle of the top of its shape"),
    ("middle", "the middle of its shape"),
    ("rim", "the edge of the top of its shape in the direction of x"),
    ("stand", "its last place before it was picked up"),
];

impl Index {
    /// What can be stated of a species: the parameters of every `capability Species`.
    pub(crate) fn properties(&self) -> impl Iterator<Item = DefId> {
        let kinds = self.defs().filter(|(_, d)| d.kind == Kind::Capability && d.name == "Species");
        kinds.flat_map(|(_, d)| d.inside.iter().copied()).filter(|def| self.def(*def).kind == Kind::Member)
    }

    /// The property of species with this name.
    pub(crate) fn property(&self, name: &str) -> Option<DefId> {
        self.properties().find(|def| self.def(*def).name == name)
    }

    fn stated(&self, def: DefId) -> Member {
        let d = self.def(def);
        Member { name: d.name.clone(), meaning: Meaning::Def(def), sort: d.sort.clone() }
    }

    /// The member of a value with this name.
    pub(crate) fn member_of(&self, base: &Sort, name: &str) -> Option<Member> {
        match base {
            Sort::Thing(kinds, full) => self.of_thing(kinds, full.as_deref(), name, true),
            Sort::Lab(lab) => self.of_lab(lab, name),
            Sort::List(inner) => {
                // A column of all rows goes before what any list has.
                if let Sort::Row(table) = **inner
                    && let Some(column) = self.column(table, name)
                {
                    return Some(Member { sort: Sort::List(Box::new(column.sort)), ..column });
                }
                let found = known(OF_LIST, name).or_else(|| known(OF_GRID, name))?;
                let sort = match name {
                    "first" | "last" | "well" => (**inner).clone(),
                    "flat" => Sort::List(Box::new(innermost(inner).clone())),
                    "pairs" => Sort::List(Box::new(Sort::Tuple(vec![(**inner).clone(), (**inner).clone()]))),
                    "rows" | "columns" => Sort::List(Box::new(base.clone())),
                    "row" | "column" => base.clone(),
                    _ => Sort::number(),
                };
                Some(Member { sort, ..found })
            }
            Sort::Tuple(items) => {
                let at = ["first", "second"].iter().position(|n| *n == name)?;
                let meaning = Meaning::Language("one of a pair");
                Some(Member { name: name.into(), meaning, sort: items.get(at).cloned().unwrap_or(Sort::Any) })
            }
            Sort::Range(inner) => ["min", "max"].contains(&name).then(|| Member {
                name: name.into(),
                meaning: Meaning::Language("an end of the range"),
                sort: (**inner).clone(),
            }),
            Sort::Species => {
                let found = self.property(name).map(|def| self.stated(def)).or_else(|| known(OF_SPECIES, name));
                Some(found.unwrap_or_else(|| Member {
                    name: name.into(),
                    meaning: Meaning::Language("a property that is stated of the species"),
                    sort: Sort::Any,
                }))
            }
            Sort::Reaction => {
                let found = known(OF_REACTION, name)?;
                let species = ["species", "reactants", "products", "orders", "unordered", "limiting"].contains(&name);
                let sort = if species { Sort::List(Box::new(Sort::Species)) } else { Sort::Any };
                Some(Member { sort, ..found })
            }
            Sort::Step => {
                let sort = self.duration();
                known(OF_STEP, name).map(|found| Member { sort, ..found })
            }
            Sort::Row(table) => self.column(*table, name).or_else(|| {
                let sort = Sort::number();
                known(OF_ROW, name).map(|found| Member { sort, ..found })
            }),
            Sort::Kind(_) | Sort::Any => None,
            _ => None,
        }
    }

    /// The columns of a table.
    fn columns(&self, table: DeclId) -> impl Iterator<Item = DefId> + '_ {
        let inside = self.of_decl(table).map_or(&[][..], |d| &self.def(d).inside);
        inside.iter().copied().filter(|d| self.def(*d).kind == Kind::Column)
    }

    /// The column of a table with this name.
    fn column(&self, table: DeclId, name: &str) -> Option<Member> {
        self.columns(table).find(|d| self.def(*d).name == name).map(|d| self.stated(d))
    }

    /// The dimension of time.
    pub(crate) fn duration(&self) -> Sort {
        Sort::Quantity(self.units().named("Duration"), false)
    }

    fn of_thing(&self, kinds: &[DeclId], full: Option<&str>, name: &str, deep: bool) -> Option<Member> {
        if name == "species" && self.counts_species(kinds) {
            let found = known(OF_MIXTURE, name)?;
            return Some(Member { sort: Sort::List(Box::new(Sort::Species)), ..found });
        }
        if let Some(def) = self.declared_member(kinds, name) {
            let sort = self.named(full, name, self.def(def).sort.clone());
            return Some(Member { name: name.into(), meaning: Meaning::Def(def), sort });
        }
        let all = kinds.iter().flat_map(|k| self.ancestors(*k)).copied();
        if let Some(kind) = all.clone().find(|k| self.of_decl(*k).is_some_and(|d| self.def(d).name == name)) {
            let meaning = self.of_decl(kind).map_or(Meaning::Unknown, Meaning::Def);
            return Some(Member { name: name.into(), meaning, sort: Sort::Thing(vec![kind], full.map(String::from)) });
        }
        if name == "basis" && self.counts_species(kinds) {
            return known(OF_MIXTURE, name);
        }
        let grid = self.grid_of(kinds);
        if let Some((_, inner)) = &grid
            && let Some(found) = self.member_of(&Sort::List(Box::new(inner.clone())), name)
            && known(OF_GRID, name).is_some()
        {
            return Some(found);
        }
        // A thing with one part answers for it.
        if deep {
            let parts = self.parts_of(kinds);
            let answering = parts.iter().filter_map(|(part, sort)| match self.named(full, part, sort.clone()) {
                Sort::Thing(kinds, full) => self.of_thing(&kinds, full.as_deref(), name, true),
                _ => None,
            });
            let mut answering = answering;
            if let Some(first) = answering.next() {
                return Some(first);
            }
            if let Some((_, Sort::Thing(kinds, full))) = grid {
                return self.of_thing(&kinds, full.as_deref(), name, true);
            }
        }
        known(OF_SHAPE, name).map(|found| Member { sort: Sort::Frame, ..found })
    }

    /// What a part of a thing of a lab was built as, by its full name.
    fn named(&self, full: Option<&str>, part: &str, sort: Sort) -> Sort {
        let Some(full) = full else { return sort };
        let name = format!("{full}.{part}");
        match (self.built(&name), sort) {
            (Some(kinds), Sort::Thing(..)) => Sort::Thing(kinds.clone(), Some(name)),
            (_, sort) => sort,
        }
    }

    /// What an included lab holds.
    fn of_lab(&self, lab: &str, name: &str) -> Option<Member> {
        let full = format!("{lab}.{name}");
        let sort = self.built(&full).map(|kinds| Sort::Thing(kinds.clone(), Some(full)));
        let labs = self.included(lab);
        let inner = labs.iter().flat_map(|l| &self.def(*l).inside).copied();
        let def = inner.into_iter().find(|d| self.def(*d).name == name && self.def(*d).kind != Kind::Parameter)?;
        let sort = match self.def(def).kind {
            Kind::Included => Sort::Lab(format!("{lab}.{name}")),
            _ => sort.unwrap_or_else(|| self.def(def).sort.clone()),
        };
        Some(Member { name: name.into(), meaning: Meaning::Def(def), sort })
    }

    /// The lab behind the full name of an included one: `left`, `left.inner`.
    pub(crate) fn included(&self, full: &str) -> Vec<DefId> {
        let mut found: Vec<DefId> = Vec::new();
        for (at, segment) in full.split('.').enumerate() {
            let fits = |d: &&DefId| self.def(**d).kind == Kind::Included && self.def(**d).name == segment;
            let next: Vec<DefId> = match at {
                0 => self.defs().filter(|(_, d)| d.kind == Kind::Included && d.name == segment).map(|d| d.0).collect(),
                _ => found.iter().flat_map(|l| &self.def(*l).inside).filter(fits).copied().collect(),
            };
            // `words` of an included lab holds the lab it is.
            found = next.iter().flat_map(|d| self.def(*d).words.clone()).collect();
        }
        found
    }

    /// What the kinds or those they extend declare under a name, the most derived first.
    pub(crate) fn declared_member(&self, kinds: &[DeclId], name: &str) -> Option<DefId> {
        let all = kinds.iter().flat_map(|k| self.ancestors(*k));
        let inside = all.filter_map(|k| self.of_decl(*k)).flat_map(|d| self.insides_of(d));
        let named = inside.filter(|d| self.def(*d).name == name);
        named.into_iter().find(|d| !matches!(self.def(*d).kind, Kind::Command))
    }

    /// The members that a kind itself declares, those that came from a file included.
    fn insides_of(&self, kind: DefId) -> impl Iterator<Item = DefId> + '_ {
        let given = self.own.given.get(&kind).map_or(&[][..], Vec::as_slice);
        self.def(kind).inside.iter().chain(given).copied()
    }

    /// All members of the kinds, each name once, the most derived first.
    pub(crate) fn members_of(&self, kinds: &[DeclId]) -> Vec<DefId> {
        let mut out: Vec<DefId> = Vec::new();
        let all = kinds.iter().flat_map(|k| self.ancestors(*k));
        for def in all.filter_map(|k| self.of_decl(*k)).flat_map(|d| self.insides_of(d)) {
            let d = self.def(def);
            let again = match d.kind {
                Kind::Command => self.is_replaced(def, &out),
                _ => out.iter().any(|o| self.def(*o).name == d.name),
            };
            if !again && !out.contains(&def) {
                out.push(def);
            }
        }
        out
    }

    fn counts_species(&self, kinds: &[DeclId]) -> bool {
        let all = kinds.iter().flat_map(|k| self.ancestors(*k)).filter_map(|k| self.of_decl(*k));
        all.flat_map(|d| &self.def(d).inside)
            .any(|d| self.own.per_species.contains(d) || self.library.per_species.contains(d))
    }

    /// Parts of the kinds by name.
    pub(crate) fn parts_of(&self, kinds: &[DeclId]) -> Vec<(String, Sort)> {
        let members = self.members_of(kinds);
        let defs = members.into_iter().map(|d| self.def(d));
        let parts = defs.filter(|d| match d.kind {
            Kind::Part => true,
            Kind::Member => self.text(d.whole).starts_with("part"),
            _ => false,
        });
        parts.filter(|d| matches!(d.sort, Sort::Thing(..))).map(|d| (d.name.clone(), d.sort.clone())).collect()
    }

    /// The first grid of the kinds, and what stands in it.
    pub(crate) fn grid_of(&self, kinds: &[DeclId]) -> Option<(DefId, Sort)> {
        let members = self.members_of(kinds);
        let grid = members.iter().find(|d| self.def(**d).kind == Kind::Grid).or_else(|| {
            members
                .iter()
                .find(|d| matches!(&self.def(**d).sort, Sort::List(inner) if matches!(**inner, Sort::Thing(..))))
        })?;
        match &self.def(*grid).sort {
            Sort::List(inner) => Some((*grid, (**inner).clone())),
            _ => None,
        }
    }

    /// What stands in brackets after a value, where it is no species.
    pub(crate) fn element_of(&self, base: &Sort) -> Option<Sort> {
        match base {
            Sort::List(inner) => Some((**inner).clone()),
            Sort::Thing(kinds, _) => self.grid_of(kinds).map(|g| g.1),
            Sort::Tuple(items) => items.first().cloned(),
            _ => None,
        }
    }

    /// All that can stand after a dot.
    pub(crate) fn all_members(&self, base: &Sort) -> Vec<Member> {
        let listed = |all: &[(&str, &'static str)]| -> Vec<Member> {
            all.iter().filter_map(|(name, _)| self.member_of(base, name)).collect()
        };
        match base {
            Sort::Thing(kinds, full) => {
                let mut out: Vec<Member> = Vec::new();
                let mut add = |found: Option<Member>| {
                    if let Some(found) = found.filter(|f| !out.iter().any(|o| o.name == f.name)) {
                        out.push(found);
                    }
                };
                for def in self.members_of(kinds) {
                    let d = self.def(def);
                    if !matches!(d.kind, Kind::Command | Kind::Process | Kind::Event | Kind::Word | Kind::Joint) {
                        add(self.of_thing(kinds, full.as_deref(), &d.name, false));
                    }
                }
                if self.grid_of(kinds).is_some() {
                    listed(OF_GRID).into_iter().for_each(|m| add(Some(m)));
                }
                if self.counts_species(kinds) {
                    listed(OF_MIXTURE).into_iter().for_each(|m| add(Some(m)));
                }
                for (part, sort) in self.parts_of(kinds) {
                    if let Sort::Thing(inner, name) = self.named(full.as_deref(), &part, sort) {
                        for def in self.members_of(&inner) {
                            if self.def(def).kind == Kind::Member {
                                add(self.of_thing(&inner, name.as_deref(), &self.def(def).name, false));
                            }
                        }
                    }
                }
                out
            }
            Sort::Lab(lab) => {
                let inside = self.included(lab).into_iter().flat_map(|l| self.def(l).inside.clone());
                inside.filter_map(|d| self.of_lab(lab, &self.def(d).name)).collect()
            }
            Sort::List(inner) => {
                let columns = match **inner {
                    Sort::Row(table) => self.columns(table).filter_map(|d| self.member_of(base, &self.def(d).name)),
                    _ => return [OF_LIST, OF_GRID].into_iter().flat_map(listed).collect(),
                };
                columns.chain(listed(OF_LIST)).collect()
            }
            Sort::Row(table) => self.columns(*table).map(|d| self.stated(d)).chain(listed(OF_ROW)).collect(),
            Sort::Species => {
                let mut out: Vec<Member> = self.properties().map(|def| self.stated(def)).collect();
                let known: Vec<Member> =
                    listed(OF_SPECIES).into_iter().filter(|m| !out.iter().any(|o| o.name == m.name)).collect();
                out.extend(known);
                out
            }
            Sort::Reaction => listed(OF_REACTION),
            Sort::Step => listed(OF_STEP),
            Sort::Range(_) => listed(&[("min", ""), ("max", "")]),
            Sort::Tuple(items) if items.len() == 2 => listed(&[("first", ""), ("second", "")]),
            _ => Vec::new(),
        }
    }
}

fn known(all: &[(&str, &'static str)], name: &str) -> Option<Member> {
    let (name, what) = all.iter().find(|(n, _)| *n == name)?;
    Some(Member { name: (*name).to_string(), meaning: Meaning::Language(what), sort: Sort::Any })
}

/// What stands in a list of lists in the end.
fn innermost(sort: &Sort) -> &Sort {
    match sort {
        Sort::List(inner) => innermost(inner),
        other => other,
    }
}
