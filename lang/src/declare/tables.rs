//! What all elaboration looks up: units, kinds with their inherited members, species, reactions.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::{Arc, OnceLock, RwLock};

use matterix_ir::{Diagnostic, Span, Unit, codes};
use rustc_hash::FxHashMap;

use super::compatibility::Screen;
use super::failures::{dangers, declared_failures};
use super::kinds::Kinds;
use super::properties::{self, Properties};
use super::species::SpeciesTable;
use super::units;
use crate::ast::{AssetLine, Expr, ExprKind, Field, ItemKind, Member, MemberKind, Name, Path, Process, Role, Sig};
use crate::names::{DeclId, Names, verb_text};
use crate::stop::Stop;
use crate::units::text::UnitError;
use crate::units::{Dimension, Resolved, Units};

/// A member of a capability as seen from a kind that has it.
#[derive(Clone, Copy, Debug)]
pub struct MemberRef<'a> {
    /// The capability that declares it.
    pub owner: DeclId,
    /// Its declaration.
    pub member: &'a Member,
    /// Where names in it are looked up.
    pub module: usize,
}

/// A capability or an asset type with everything it inherits.
#[derive(Clone, Debug)]
#[cfg_attr(test, derive(Default))]
pub struct Kind<'a> {
    /// Its declaration.
    pub id: DeclId,
    /// Its name.
    pub name: String,
    /// Whether it is an asset type.
    pub is_asset: bool,
    /// Itself and everything it extends, most derived first.
    pub ancestors: Vec<DeclId>,
    /// Members of all its capabilities, base first.
    pub members: Vec<MemberRef<'a>>,
    /// Those of them that no more derived capability declares again.
    pub visible: Vec<MemberRef<'a>>,
    /// The member that is the amount of matter: `holding` fills it, and its atoms, charge and mass are counted.
    pub matter: Option<MemberRef<'a>>,
    /// Whether it has a quantity of each species, matter or not.
    pub per_species: bool,
    /// The visible ones by name; more than one is ambiguous.
    by_name: FxHashMap<&'a str, Vec<MemberRef<'a>>>,
    /// Lines of all its assets, most derived first, with their module.
    pub lines: Vec<(usize, &'a AssetLine)>,
    /// Where its name stands.
    pub span: Span,
}

impl Kind<'_> {
    /// Whether it has (or is) the kind.
    pub fn has(&self, kind: DeclId) -> bool {
        self.ancestors.contains(&kind)
    }
}

/// A reaction in one direction.
#[derive(Clone, Debug)]
pub struct ReactionDef<'a> {
    /// Its name; the reverse direction has `.reverse` appended.
    pub name: String,
    /// Its module.
    pub module: usize,
    /// Species consumed, with coefficients.
    pub reactants: Vec<(super::SpeciesId, f64)>,
    /// Species made, with coefficients.
    pub products: Vec<(super::SpeciesId, f64)>,
    /// Its fields.
    pub fields: &'a [Field],
    /// This is the reverse of a `<->`.
    pub reverse: bool,
    /// The item.
    pub span: Span,
    /// The equation's terms, for diagnostics.
    pub terms: Vec<(super::SpeciesId, Span)>,
}

/// Everything declared, ready for lookups.
#[derive(Debug)]
pub struct Tables<'a> {
    /// Declarations and scopes.
    pub names: &'a Names<'a>,
    /// Dimensions and units.
    pub units: Units,
    /// Units of the text that were read before: the same few stand in every law and step.
    read: RwLock<FxHashMap<String, Resolved>>,
    /// SI units of dimensions that were asked for before.
    si: RwLock<BTreeMap<Dimension, Unit>>,
    /// Words of modules outside their labs, for the modules that were asked for.
    pub spoken: RwLock<BTreeMap<usize, Arc<HashSet<String>>>>,
    /// Failures that something declares, once they were asked for.
    failures: OnceLock<Arc<BTreeSet<String>>>,
    dangers: OnceLock<BTreeSet<String>>,
    /// Capabilities and assets.
    pub kinds: Kinds<'a>,
    /// Commands by the words of their verbs, in order of capability.
    commands: BTreeMap<String, Vec<MemberRef<'a>>>,
    /// What may be said of species, with its types.
    pub properties: Properties<'a>,
    /// Species.
    pub species: SpeciesTable<'a>,
    /// Reactions whose species are all known.
    pub reactions: Vec<ReactionDef<'a>>,
    /// Equilibria whose species are all known.
    pub equilibria: Vec<super::equilibria::EquilibriumDef<'a>>,
    /// Whether one of these, or of the interactions, is wrong and so left out: what mixtures hold is then another thing than what is meant.
    pub lacks_equilibria: bool,
    /// Interactions whose species are all known.
    pub interactions: Vec<super::interactions::InteractionDef<'a>>,
    /// Reactive groups, materials and what must not meet.
    pub screen: Screen,
    /// Whether the check is of no use any more.
    pub stop: Stop,
    /// Processes over instances, from all modules.
    pub processes: Vec<(DeclId, &'a Process)>,
}

impl<'a> Tables<'a> {
    /// Builds the tables; findings in declarations are returned beside them. What must not meet is read by `compatibility`, since least
    /// contents have to be evaluated.
    pub fn new(
        names: &'a Names<'a>,
        compatibility: impl FnOnce(&Self, &mut Vec<Diagnostic>) -> Screen,
    ) -> (Self, Vec<Diagnostic>) {
        let mut diagnostics = Vec::new();
        let units = units::declare(names, &mut diagnostics);
        let mut tables = Tables {
            names,
            units,
            read: RwLock::default(),
            si: RwLock::default(),
            spoken: RwLock::default(),
            failures: OnceLock::new(),
            dangers: OnceLock::new(),
            kinds: Kinds::default(),
            commands: BTreeMap::new(),
            properties: Properties::new(),
            species: SpeciesTable::default(),
            reactions: Vec::new(),
            equilibria: Vec::new(),
            lacks_equilibria: false,
            interactions: Vec::new(),
            screen: Screen::default(),
            stop: Stop::default(),
            processes: Vec::new(),
        };
        for index in 0..names.decls.len() as u32 {
            tables.kind(DeclId(index), &mut Vec::new(), &mut diagnostics);
            if let ItemKind::Process(p) = &names.decl(DeclId(index)).item.kind {
                tables.processes.push((DeclId(index), p));
            }
        }
        for kind in tables.kinds.values() {
            for m in kind.members.iter().filter(|m| m.owner == kind.id) {
                if let MemberKind::Command { sig, .. } = &m.member.kind {
                    tables.commands.entry(verb_text(&sig.verb)).or_default().push(*m);
                }
            }
        }
        tables.properties = properties::declared(&tables.kinds, &mut diagnostics);
        tables.species = SpeciesTable::new(names, &tables.properties, &mut diagnostics);
        tables.screen = compatibility(&tables, &mut diagnostics);
        tables.reactions = super::reactions::collect(names, &tables.species, &mut diagnostics);
        let before = diagnostics.len();
        tables.equilibria = super::equilibria::collect(names, &tables.species, &mut diagnostics);
        tables.interactions = super::interactions::collect(names, &tables.species, &mut diagnostics);
        tables.lacks_equilibria = diagnostics[before..].iter().any(Diagnostic::is_error);
        (tables, diagnostics)
    }

    fn kind(&mut self, id: DeclId, open: &mut Vec<DeclId>, diagnostics: &mut Vec<Diagnostic>) {
        if self.kinds.contains_key(&id) {
            return;
        }
        let decl = self.names.decl(id);
        let (name, extends, is_asset) = match &decl.item.kind {
            ItemKind::Capability { name, extends, .. } => (name, extends, false),
            ItemKind::Asset { name, extends, .. } => (name, extends, true),
            _ => return,
        };
        open.push(id);
        let mut kind = Kind {
            id,
            name: name.text.clone(),
            is_asset,
            ancestors: vec![id],
            members: Vec::new(),
            visible: Vec::new(),
            matter: None,
            per_species: false,
            by_name: FxHashMap::default(),
            lines: Vec::new(),
            span: name.span,
        };
        if let ItemKind::Asset { lines, .. } = &decl.item.kind {
            kind.lines.extend(lines.iter().map(|l| (decl.module, l)));
        }
        for path in extends {
            self.inherit(&mut kind, path, decl.module, open, diagnostics);
        }
        if let ItemKind::Capability { members, .. } = &decl.item.kind {
            kind.members.extend(members.iter().map(|member| MemberRef { owner: id, member, module: decl.module }));
        }
        open.pop();
        let members = kind.members.clone();
        let matter: Vec<&Name> =
            members.iter().filter(|m| is_matter(m.member)).filter_map(|m| member_name(m.member)).collect();
        self.kinds.insert(id, kind);
        let visible = self.visible(members.clone());
        if let Some(kind) = self.kinds.get_mut(&id) {
            for m in &visible {
                if let Some(name) = member_name(m.member) {
                    kind.by_name.entry(&name.text).or_default().push(*m);
                }
            }
            // A member that is declared again stays what it was.
            let counts = |m: &&MemberRef<'a>| {
                per_species(m.member)
                    && member_name(m.member).is_some_and(|n| matter.iter().any(|of| of.text == n.text))
            };
            let mut found = visible.iter().filter(counts);
            kind.matter = found.next().copied();
            if let (Some(first), Some(second)) = (&kind.matter, found.next()) {
                diagnostics.push(second_matter(kind, first, second));
            }
            kind.per_species = visible.iter().any(|m| per_species(m.member));
            kind.visible = visible;
        }
    }

    /// The members that no more derived capability declares again: those with a name by that, commands by their words and labels.
    pub fn visible(&self, members: Vec<MemberRef<'a>>) -> Vec<MemberRef<'a>> {
        let mut alike: FxHashMap<&str, Vec<DeclId>> = FxHashMap::default();
        let mut commands: FxHashMap<&str, Vec<(&Sig, DeclId)>> = FxHashMap::default();
        let first = |sig: &'a Sig| sig.verb.first().map_or("", |word| word.text.as_str());
        for member in &members {
            if let Some(name) = member_name(member.member) {
                alike.entry(&name.text).or_default().push(member.owner);
            } else if let MemberKind::Command { sig, .. } = &member.member.kind {
                commands.entry(first(sig)).or_default().push((sig, member.owner));
            }
        }
        let hides = |o: &DeclId, m: &MemberRef<'a>| *o != m.owner && self.kinds.get(o).is_some_and(|k| k.has(m.owner));
        let hidden = |m: &MemberRef<'a>| match &m.member.kind {
            MemberKind::Command { sig, .. } => {
                let words = |sig: &'a Sig| sig.verb.iter().map(|word| &word.text);
                let again = |other: &'a Sig| words(other).eq(words(sig)) && other.has_form_of(sig);
                let all = commands.get(first(sig)).into_iter().flatten();
                all.into_iter().any(|(other, o)| hides(o, m) && again(other))
            }
            _ => {
                let others = member_name(m.member).and_then(|name| alike.get(name.text.as_str()));
                others.is_some_and(|owners| owners.iter().any(|o| hides(o, m)))
            }
        };
        members.iter().filter(|m| !hidden(m)).copied().collect()
    }

    fn inherit(
        &mut self,
        kind: &mut Kind<'a>,
        path: &Path,
        module: usize,
        open: &mut Vec<DeclId>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let Some(name) = path.segments.last() else { return };
        let is_kind = |k: &ItemKind| matches!(k, ItemKind::Capability { .. } | ItemKind::Asset { .. });
        let base = self.names.lookup(module, &name.text).filter(|id| is_kind(&self.names.decl(*id).item.kind));
        let Some(base) = base else {
            diagnostics.push(self.names.unknown(module, name, "capability or asset", is_kind));
            return;
        };
        if open.contains(&base) {
            diagnostics.push(Diagnostic::error(
                codes::CIRCULAR,
                path.span,
                format!("`{}` extends itself", kind.name),
                "this leads back to it",
            ));
            return;
        }
        self.kind(base, open, diagnostics);
        let Some(base) = self.kinds.get(&base) else { return };
        for &ancestor in &base.ancestors {
            if !kind.ancestors.contains(&ancestor) {
                kind.ancestors.push(ancestor);
            }
        }
        for member in &base.members {
            let known = kind.members.iter().any(|m| std::ptr::eq(m.member, member.member));
            if !known {
                kind.members.push(*member);
            }
        }
        kind.lines.extend(base.lines.iter().copied());
    }

    /// What a run may fail with at any step: what must not meet, and hazards.
    pub fn dangers(&self) -> &BTreeSet<String> {
        self.dangers.get_or_init(|| dangers(self.names))
    }

    /// Failures that something declares.
    pub fn failures(&self) -> Arc<BTreeSet<String>> {
        self.failures.get_or_init(|| Arc::new(declared_failures(self.names))).clone()
    }

    /// Resolves a unit as written.
    pub fn unit(&self, text: &str) -> Result<Resolved, UnitError> {
        if let Some(known) = self.read.read().ok().and_then(|read| read.get(text).cloned()) {
            return Ok(known);
        }
        let resolved = self.units.resolve(text)?;
        if let Ok(mut read) = self.read.write() {
            read.insert(text.to_string(), resolved.clone());
        }
        Ok(resolved)
    }

    /// The SI unit of a dimension, for display.
    pub fn si(&self, dimension: &Dimension) -> Unit {
        if let Some(known) = self.si.read().ok().and_then(|si| si.get(dimension).cloned()) {
            return known;
        }
        let unit = self.units.si(dimension);
        if let Ok(mut si) = self.si.write() {
            si.insert(dimension.clone(), unit.clone());
        }
        unit
    }

    /// The members of a kind that a name means; more than one is ambiguous.
    pub fn members(&self, kind: DeclId, name: &str) -> &[MemberRef<'a>] {
        self.kinds.get(&kind).and_then(|info| info.by_name.get(name)).map_or(&[], Vec::as_slice)
    }

    /// The commands of all capabilities that a verb may mean.
    pub fn commands(&self, verb: &str) -> &[MemberRef<'a>] {
        self.commands.get(verb).map_or(&[], Vec::as_slice)
    }

    /// The name under which a capability or asset is known, for messages.
    pub fn kind_name(&self, id: DeclId) -> &str {
        self.kinds.get(&id).map_or("", |k| k.name.as_str())
    }
}

/// Two amounts of matter in one thing: `holding` could not tell which it fills.
fn second_matter(kind: &Kind<'_>, first: &MemberRef<'_>, second: &MemberRef<'_>) -> Diagnostic {
    let headline = format!("`{}` has two amounts of matter", kind.name);
    let d = Diagnostic::error(codes::DUPLICATE_NAME, second.member.span, headline, "the second one");
    d.because(first.member.span, "the first one")
        .help("put the separate amount into a part of its own: `part bed: Bed`")
}

/// The option of an extensive quantity per species that says that it is matter.
pub const MATTER: &str = "matter";

/// The option of an amount of each species that says that it counts what lies outside of all mixtures: balances of matter have it.
pub const OUTSIDE: &str = "outside";

/// Whether a member is an extensive quantity of each species.
pub fn per_species(member: &Member) -> bool {
    matches!(&member.kind, MemberKind::Value { role: Role::Extensive, per: Some(_), .. })
}

/// Whether a member is declared to be matter, of which atoms, charge and mass are counted.
fn is_matter(member: &Member) -> bool {
    let MemberKind::Value { options, .. } = &member.kind else { return false };
    per_species(member) && options.iter().any(|o| o.name.text == MATTER && is_true(&o.value))
}

/// Whether an expression is the word `true`.
pub fn is_true(e: &Expr) -> bool {
    matches!(&*e.kind, ExprKind::Name(n) if n.text == "true")
}

/// The name of a member that has one.
pub fn member_name(member: &Member) -> Option<&Name> {
    match &member.kind {
        MemberKind::Value { name, .. } | MemberKind::Frame { name, .. } => Some(name),
        MemberKind::Process(p) => Some(&p.name),
        MemberKind::Event(e) => Some(&e.name),
        MemberKind::View { .. } | MemberKind::Command { .. } | MemberKind::Limit { .. } | MemberKind::Error => None,
    }
}
