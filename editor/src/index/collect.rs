//! What a module declares.

use matterix_ir::Span;
use matterix_lang::ast::{
    AssetLine, Clause, ClauseKind, Item, ItemKind, LabLineKind, Member, MemberKind, Name, Param, Refusal, Sig, Type,
};
use matterix_lang::names::{Module, item_name, verb_text};
use matterix_lang::semantic_index::Sort;

use super::{Def, DefId, Index, Kind};

/// A declaration about which only its name and place are known.
pub(super) fn bare(name: &str, kind: Kind, span: Span, whole: Span) -> Def {
    Def {
        name: name.to_string(),
        kind,
        span,
        whole,
        head: whole,
        docs: Vec::new(),
        sort: Sort::Any,
        words: Vec::new(),
        owner: None,
        inside: Vec::new(),
        label: None,
    }
}

/// From the first to the last word of a verb.
pub(super) fn verb_span(words: &[Name]) -> Option<Span> {
    Some(words.first()?.span.to(words.last()?.span))
}

/// A parameter with its type and default.
pub(super) fn param_span(p: &Param) -> Span {
    let with_type = p.ty.as_ref().map_or(p.name.span, |t| p.name.span.to(t.span));
    p.default.as_ref().map_or(with_type, |d| with_type.to(d.span))
}

impl Index {
    /// Adds a declaration.
    pub(super) fn add(&mut self, def: Def) -> DefId {
        let id = DefId(self.own.first + self.own.defs.len() as u32);
        self.own.by_span.entry(def.span).or_insert(id);
        if let Some(owner) = def.owner.and_then(|o| self.own_mut(o)) {
            owner.inside.push(id);
        }
        self.own.defs.push(def);
        id
    }

    /// A declaration of this part.
    pub(super) fn own_mut(&mut self, id: DefId) -> Option<&mut Def> {
        self.own.defs.get_mut(id.0.checked_sub(self.own.first)? as usize)
    }

    /// Adds a declaration that belongs to another.
    pub(super) fn add_inside(&mut self, owner: DefId, kind: Kind, name: &Name, whole: Span) -> DefId {
        self.add(Def { owner: Some(owner), ..bare(&name.text, kind, name.span, whole) })
    }

    /// Collects the declarations of a module.
    pub(super) fn collect(&mut self, module: &Module) {
        for item in &module.tree.items {
            self.item(item);
        }
    }

    fn item(&mut self, item: &Item) {
        let kind = kind_of(&item.kind);
        let named = match &item.kind {
            ItemKind::Dimension { name, .. } => Some((name.text.clone(), name.span)),
            ItemKind::Unit { name, .. } => Some((name.text.clone(), name.span)),
            ItemKind::Skill { sig, .. } => verb_span(&sig.verb).map(|span| (verb_text(&sig.verb), span)),
            kind => item_name(&Item { docs: Vec::new(), kind: kind.clone(), span: item.span }),
        };
        let (Some(kind), Some((name, span))) = (kind, named) else { return };
        let head = Span { end: body_of(item).unwrap_or(item.span.end), ..item.span };
        let id = self.add(Def { docs: item.docs.clone(), head, ..bare(&name, kind, span, item.span) });
        match &item.kind {
            ItemKind::Dimension { .. } => {
                self.own.measures.insert(name, id);
            }
            ItemKind::Unit { aliases, .. } => {
                self.own.measures.insert(name, id);
                for alias in aliases {
                    let docs = item.docs.clone();
                    let other = self.add(Def { docs, ..bare(&alias.text, kind, alias.span, item.span) });
                    self.own.measures.insert(alias.text.clone(), other);
                }
            }
            _ => self.own.decls.push(id),
        }
        self.insides(id, item);
    }

    fn insides(&mut self, id: DefId, item: &Item) {
        match &item.kind {
            ItemKind::Capability { members, .. } => members.iter().for_each(|m| self.member(id, m)),
            ItemKind::Asset { lines, source, .. } => {
                // What an asset of the library gets from a file depends on who uses it.
                let file = source.as_ref().map(|s| s.1.span).filter(|s| self.is_library(s.file));
                self.lines(id, lines, file);
            }
            ItemKind::Lab { params, lines, .. } => {
                self.params(id, params, Kind::Parameter);
                for line in lines {
                    let (kind, name) = match &line.kind {
                        LabLineKind::Setting { name, .. } => (Kind::Setting, name),
                        LabLineKind::Instance { name, .. } => (Kind::Thing, name),
                        LabLineKind::Include { name, .. } => (Kind::Included, name),
                        LabLineKind::Between { .. } | LabLineKind::Error => continue,
                    };
                    let def = self.add_inside(id, kind, name, line.span);
                    if kind == Kind::Setting {
                        self.own.settings.entry(name.text.clone()).or_insert(def);
                    }
                }
            }
            ItemKind::Table { columns, .. } => {
                for column in columns {
                    self.add_inside(id, Kind::Column, &column.name, column.span);
                }
            }
            ItemKind::Hazard { params, .. }
            | ItemKind::Relation { params, .. }
            | ItemKind::Fn { params, .. }
            | ItemKind::Workflow { params, .. } => self.params(id, params, Kind::Parameter),
            ItemKind::Process(p) => self.params(id, &p.params, Kind::Parameter),
            ItemKind::Event(e) => self.params(id, &e.params, Kind::Parameter),
            ItemKind::Skill { sig, clauses, .. } => self.signature(id, sig, clauses),
            _ => {}
        }
    }

    fn params(&mut self, owner: DefId, params: &[Param], kind: Kind) {
        for p in params {
            self.add_inside(owner, kind, &p.name, param_span(p));
        }
    }

    fn signature(&mut self, id: DefId, sig: &Sig, clauses: &[Clause]) {
        self.own.by_span.insert(sig.span, id);
        self.own.verbs.entry(verb_text(&sig.verb)).or_default().push(id);
        self.params(id, &sig.params, Kind::Parameter);
        for (label, params) in &sig.labelled {
            for p in params {
                let param = self.add_inside(id, Kind::Parameter, &p.name, param_span(p));
                if let Some(def) = self.own_mut(param) {
                    def.label = Some(label.text.clone());
                }
            }
        }
        for clause in clauses {
            match &clause.kind {
                ClauseKind::Option(p) => self.params(id, std::slice::from_ref(p), Kind::Option),
                ClauseKind::Fails(names) => names.iter().for_each(|n| self.failure_here(n, clause.span)),
                ClauseKind::Needs { refusal, .. }
                | ClauseKind::Presumes { refusal, .. }
                | ClauseKind::Warns { refusal, .. } => {
                    self.refusal(refusal.as_ref(), clause.span);
                }
                _ => {}
            }
        }
    }

    fn refusal(&mut self, refusal: Option<&Refusal>, whole: Span) {
        if let Some(refusal) = refusal {
            self.failure_here(&refusal.failure, whole);
        }
    }

    /// A place that declares a failure.
    pub(super) fn failure_here(&mut self, name: &Name, whole: Span) {
        if let Some((_, places)) = self.own.failures.get_mut(&name.text) {
            places.push(name.span);
            return;
        }
        if let Some((id, _)) = self.library.failures.get(&name.text) {
            self.own.failures.insert(name.text.clone(), (*id, vec![name.span]));
            return;
        }
        let id = self.add(bare(&name.text, Kind::Failure, name.span, whole));
        self.own.failures.insert(name.text.clone(), (id, vec![name.span]));
    }

    fn member(&mut self, owner: DefId, m: &Member) {
        let docs = m.docs.clone();
        let mut add = |kind: Kind, name: &Name| {
            self.add(Def { docs: docs.clone(), owner: Some(owner), ..bare(&name.text, kind, name.span, m.span) })
        };
        match &m.kind {
            MemberKind::Error | MemberKind::View { .. } => {}
            MemberKind::Value { name, .. } => {
                add(Kind::Member, name);
            }
            MemberKind::Frame { name, .. } => {
                add(Kind::Frame, name);
            }
            MemberKind::Process(p) => {
                let id = add(Kind::Process, &p.name);
                self.params(id, &p.params, Kind::Parameter);
            }
            MemberKind::Event(e) => {
                let id = add(Kind::Event, &e.name);
                self.params(id, &e.params, Kind::Parameter);
            }
            MemberKind::Limit { refusal, .. } => self.refusal(refusal.as_ref(), m.span),
            MemberKind::Command { sig, clauses } => {
                let Some(span) = verb_span(&sig.verb) else { return };
                let owner = Some(owner);
                let id = self.add(Def { docs, owner, ..bare(&verb_text(&sig.verb), Kind::Command, span, m.span) });
                self.signature(id, sig, clauses);
            }
        }
    }

    fn lines(&mut self, owner: DefId, lines: &[AssetLine], file: Option<Span>) {
        for line in lines {
            let (kind, name, whole) = match line {
                AssetLine::Frame { name, at } => (Kind::Frame, name, name.span.to(at.position.span)),
                AssetLine::Part { name, literal } => (Kind::Part, name, name.span.to(literal.span)),
                AssetLine::Grid(grid) => (Kind::Grid, &grid.name, grid.name.span.to(grid.literal.span)),
                AssetLine::Joint(joint) => (Kind::Joint, &joint.name, joint.name.span.to(joint.by.span)),
                _ => continue,
            };
            let again = self.def(owner).inside.iter().any(|d| self.def(*d).name == name.text);
            if !again && Some(name.span) != file {
                self.add_inside(owner, kind, name, whole);
            }
        }
    }

    /// The words of an enumerated type, as declarations of their own.
    pub(super) fn words_of(&mut self, owner: DefId, ty: Option<&Type>) {
        let Some(ty) = ty else { return };
        if ty.words.is_empty() || !self.def(owner).words.is_empty() {
            return;
        }
        let words: Vec<DefId> = ty
            .words
            .iter()
            .map(|w| self.add(Def { owner: Some(owner), ..bare(&w.text, Kind::Word, w.span, ty.span) }))
            .collect();
        if let Some(def) = self.own_mut(owner) {
            def.inside.retain(|d| !words.contains(d));
            def.words = words;
        }
    }
}

/// The kind of an item that has a name.
fn kind_of(kind: &ItemKind) -> Option<Kind> {
    Some(match kind {
        ItemKind::Dimension { .. } => Kind::Dimension,
        ItemKind::Unit { .. } => Kind::Unit,
        ItemKind::Species { .. } => Kind::Species,
        ItemKind::Solution { .. } => Kind::Solution,
        ItemKind::Reaction { .. } => Kind::Reaction,
        ItemKind::Equilibrium { .. } => Kind::Equilibrium,
        ItemKind::Interaction { .. } => Kind::Interaction,
        ItemKind::ReactiveGroup { .. } => Kind::Group,
        ItemKind::Material { .. } => Kind::Material,
        ItemKind::Hazard { .. } => Kind::Hazard,
        ItemKind::Capability { .. } => Kind::Capability,
        ItemKind::Asset { .. } => Kind::Asset,
        ItemKind::Process(_) => Kind::Process,
        ItemKind::Event(_) => Kind::Event,
        ItemKind::Relation { .. } => Kind::Relation,
        ItemKind::Fn { .. } => Kind::Function,
        ItemKind::Const { .. } => Kind::Constant,
        ItemKind::Table { .. } => Kind::Table,
        ItemKind::Framing { .. } => Kind::Framing,
        ItemKind::Driver { .. } => Kind::Driver,
        ItemKind::Lab { .. } => Kind::Lab,
        ItemKind::Skill { .. } => Kind::Skill,
        ItemKind::Workflow { .. } => Kind::Workflow,
        ItemKind::Study { .. } => Kind::Study,
        ItemKind::Fit { .. } => Kind::Fit,
        ItemKind::Test { .. } => Kind::Test,
        ItemKind::Error
        | ItemKind::Use { .. }
        | ItemKind::Incompatible { .. }
        | ItemKind::Allow { .. }
        | ItemKind::Accept { .. } => return None,
    })
}

/// Where the body of an item begins, which its head leaves out.
fn body_of(item: &Item) -> Option<u32> {
    match &item.kind {
        ItemKind::Skill { body, clauses, sig, .. } => {
            let clauses = clauses.first().map(|c| c.span.start);
            Some(clauses.or(body.as_ref().map(|b| b.span.start)).unwrap_or(sig.span.end))
        }
        ItemKind::Workflow { body, .. } | ItemKind::Test { body, .. } => Some(body.span.start),
        _ => None,
    }
}
