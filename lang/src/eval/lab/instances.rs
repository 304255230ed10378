//! Instances: an asset type with its overrides, its parts, its place.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use matterix_ir::scene::{InstanceId, Pose};
use matterix_ir::{NodeId, Span};

use rustc_hash::FxHashMap;

use super::grids::Grid;
use super::{Elaborator, MemberKey, Mode};
use crate::ast::{AssetLine, AssetLiteral, Expr, ExprKind, Field, FieldValue, MemberKind, Role};
use crate::declare::SpeciesId;
use crate::declare::Type;
use crate::declare::tables::{Kind, MemberRef, Tables, member_name};
use crate::eval::{Scope, Value};
use crate::names::DeclId;
use crate::units::Dimension;

/// A field given for an instance: where its names are looked up, and whether it stands in the lab.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// Module of the text.
    pub module: usize,
    /// The field.
    pub field: &'a Field,
    /// It stands in a lab, so the lab's names are seen, not the instance's.
    pub lab: bool,
    /// The instance of the asset whose text it is; its names are seen.
    pub of: Option<InstanceId>,
}

impl<'a> Setting<'a> {
    /// The names its value sees.
    pub fn scope(&self) -> Scope {
        match self.of {
            Some(of) if !self.lab => Scope::of(of, self.module),
            _ => Scope { lab: self.lab, ..Scope::module(self.module) },
        }
    }

    /// Its value.
    pub fn value(&self) -> &'a FieldValue {
        &self.field.value
    }
}

/// An asset in the lab, or a part of one.
#[derive(Clone, Debug, Default)]
pub struct Instance<'a> {
    /// Full name.
    pub name: String,
    /// Its asset type; for a part its capability; for a prototype all capabilities asked for.
    pub kinds: Vec<DeclId>,
    /// The included lab it stands in: empty, or `left.`.
    pub within: String,
    /// What it is a part of.
    pub owner: Option<InstanceId>,
    /// Fields given for it, the strongest first.
    pub settings: Vec<Setting<'a>>,
    /// Its parts by name.
    pub parts: BTreeMap<String, InstanceId>,
    /// Its grids of child assets.
    pub grids: Vec<Grid>,
    /// Values of its members, as far as they were asked for.
    pub values: FxHashMap<MemberKey, Value>,
    /// States of quantities of each species, by member.
    pub amounts: BTreeMap<String, BTreeMap<SpeciesId, u32>>,
    /// What it holds at the start: mol (or kg where counted by mass).
    pub contents: Vec<(SpeciesId, NodeId)>,
    /// The amounts it stands for, where it is no thing of the lab but what a recipe makes.
    pub composition: Option<Vec<(SpeciesId, NodeId)>>,
    /// What its contents are called as a reagent.
    pub origin: Option<String>,
    /// What stands after `at` behind what it holds, with the module of the text.
    pub start: Option<(&'a Expr, usize)>,
    /// `on table`, `in rack`: preposition and instance.
    pub placed: Vec<(String, InstanceId)>,
    /// Where.
    pub pose: Pose,
    /// Where the text says that.
    pub at: Option<Span>,
    /// Whether a line makes it together with others.
    pub one_of_many: bool,
    /// Its declaration.
    pub span: Span,
}

impl<'a> Instance<'a> {
    /// The strongest field of a name.
    pub fn setting(&self, name: &str) -> Option<Setting<'a>> {
        self.settings.iter().find(|s| s.field.key.text == name).copied()
    }

    /// The line of its asset's declaration that defines a derived member anew; `own` is the instance's number.
    pub fn redefined(&self, own: InstanceId, name: &str) -> Option<Setting<'a>> {
        let is_own = |s: &&Setting<'a>| !s.lab && s.of == Some(own) && s.field.key.text == name;
        self.settings.iter().find(is_own).copied()
    }

    /// Its parts, those that stand in its grids last.
    pub fn children(&self) -> impl Iterator<Item = InstanceId> {
        self.parts.values().chain(self.grids.iter().flat_map(|grid| grid.children.values())).copied()
    }

    /// What stands in its grid, where it has no parts and one place.
    pub fn only_part(&self) -> Option<InstanceId> {
        match (self.parts.is_empty(), self.grids.as_slice()) {
            (true, [grid]) if grid.children.len() == 1 => grid.children.values().next().copied(),
            _ => None,
        }
    }
}

impl<'a> Elaborator<'a> {
    /// Makes an instance of a kind with its parts; `settings` are the fields of its literal.
    pub fn instantiate(
        &mut self,
        name: String,
        kinds: Vec<DeclId>,
        mut settings: Vec<Setting<'a>>,
        owner: Option<InstanceId>,
        span: Span,
    ) -> InstanceId {
        let id = InstanceId(self.instances.len() as u32);
        for kind in &kinds {
            let Some(info) = self.tables.kinds.get(kind) else { continue };
            settings.extend(info.lines.iter().filter_map(|(module, line)| match line {
                AssetLine::Field(field) => Some(Setting { module: *module, field, lab: false, of: Some(id) }),
                _ => None,
            }));
        }
        let within = self.within.clone();
        if owner.is_none() {
            self.top_level.entry(name.clone()).or_insert(id);
        }
        self.instances.push(Instance { name, kinds, within, owner, settings, span, ..Instance::default() });
        self.count_mixture(id);
        self.make_parts(id);
        id
    }

    fn count_mixture(&mut self, id: InstanceId) {
        if self.is_mixture(id) {
            self.mixtures.push(id);
        }
    }

    fn make_parts(&mut self, id: InstanceId) {
        let mut wanted = Vec::new();
        for m in self.all_members(id).iter().copied() {
            let MemberKind::Value { role: Role::Part, name, ty, .. } = &m.member.kind else { continue };
            if self.instances[id.0 as usize].parts.contains_key(&name.text) {
                continue;
            }
            let (kinds, optional) = match self.resolve_type(ty, m.module) {
                Type::Instance { kinds, optional } => (kinds, optional),
                Type::List(inner) => {
                    if let Type::Instance { kinds, .. } = &*inner {
                        wanted.push((name, kinds.clone()));
                    }
                    continue;
                }
                _ => continue,
            };
            let given = self.instances[id.0 as usize].setting(&name.text);
            let kinds = match given.and_then(|s| self.part_kind(s.value(), s.module)) {
                Some(kind) => {
                    self.check_part(kind, &kinds, &name.text, id);
                    vec![kind]
                }
                None if optional => continue,
                None => kinds.to_vec(),
            };
            let mut nested = Vec::new();
            for s in self.instances[id.0 as usize].settings.clone() {
                if s.field.key.text != name.text {
                    continue;
                }
                let fields: &'a [Field] = match &s.field.value {
                    FieldValue::Fields(fields) => fields,
                    FieldValue::Literal(AssetLiteral { fields, .. }) => fields,
                    _ => &[],
                };
                match kinds.as_slice() {
                    [kind] => self.check_fields(*kind, fields),
                    several => self.check_settable(several, fields, false),
                }
                nested.extend(fields.iter().map(|field| Setting { field, ..s }));
            }
            let full = format!("{}.{}", self.instances[id.0 as usize].name, name.text);
            let span = self.instances[id.0 as usize].span;
            let part = self.instantiate(full, kinds, nested, Some(id), span);
            self.instances[id.0 as usize].parts.insert(name.text.clone(), part);
        }
        self.make_children(id);
        for (name, kinds) in wanted {
            self.check_grid(id, name, &kinds);
        }
    }

    fn make_children(&mut self, id: InstanceId) {
        let kinds = self.instances[id.0 as usize].kinds.clone();
        for kind in kinds {
            let Some(info) = self.tables.kinds.get(&kind) else { continue };
            let lines = info.lines.clone();
            for (module, line) in lines {
                let (name, literal) = match line {
                    AssetLine::Part { name, literal } => (name, literal),
                    AssetLine::Grid(grid) => {
                        self.make_grid(id, module, grid);
                        continue;
                    }
                    _ => continue,
                };
                let Some(kind) = self.kind_named(&literal.ty, module) else { continue };
                if self.leads_back(id, kind, literal.ty.span) {
                    continue;
                }
                let of = Some(id);
                let settings = literal.fields.iter().map(|field| Setting { module, field, lab: false, of }).collect();
                let full = format!("{}.{}", self.instances[id.0 as usize].name, name.text);
                let part = self.instantiate(full, vec![kind], settings, Some(id), literal.span);
                self.instances[id.0 as usize].parts.insert(name.text.clone(), part);
            }
        }
    }

    /// A part given by type must be what its declaration asks for.
    fn check_part(&mut self, kind: DeclId, wanted: &[DeclId], name: &str, of: InstanceId) {
        let Some(missing) = wanted.iter().find(|w| !self.tables.kinds.get(&kind).is_some_and(|k| k.has(**w))) else {
            return;
        };
        let span = self.instances[of.0 as usize]
            .settings
            .iter()
            .find(|s| s.field.key.text == name)
            .map_or(self.instances[of.0 as usize].span, |s| s.field.span);
        let (found, wanted) = (self.tables.kind_name(kind).to_string(), self.tables.kind_name(*missing).to_string());
        self.report(matterix_ir::Diagnostic::error(
            matterix_ir::codes::TYPE_MISMATCH,
            span,
            format!("`{name}` expects {wanted}, but `{found}` is not one"),
            format!("not {wanted}"),
        ));
    }

    fn part_kind(&mut self, value: &'a FieldValue, module: usize) -> Option<DeclId> {
        match value {
            FieldValue::Literal(l) => self.kind_named(&l.ty, module),
            FieldValue::Expr(Expr { kind, .. }) => match &**kind {
                ExprKind::Name(n) => {
                    let path = crate::ast::Path { segments: vec![n.clone()], span: n.span };
                    self.kind_named(&path, module)
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// Every member of an instance, base first.
    pub fn all_members(&self, id: InstanceId) -> Cow<'a, [MemberRef<'a>]> {
        let tables: &'a Tables<'a> = self.tables;
        let kinds = &self.instances[id.0 as usize].kinds;
        if let [kind] = kinds.as_slice() {
            return Cow::Borrowed(tables.kinds.get(kind).map_or(&[], |info| &info.visible));
        }
        let mut out: Vec<MemberRef<'a>> = Vec::new();
        for kind in kinds {
            let Some(info) = self.tables.kinds.get(kind) else { continue };
            for m in &info.members {
                if !out.iter().any(|o| std::ptr::eq(o.member, m.member)) {
                    out.push(*m);
                }
            }
        }
        Cow::Owned(tables.visible(out))
    }

    /// A stand-in that has the capabilities.
    pub fn prototype_of(&mut self, kinds: Vec<DeclId>, name: &str) -> InstanceId {
        let depth = name.matches('.').count();
        let id = InstanceId(self.instances.len() as u32);
        self.top_level.entry(name.to_string()).or_insert(id);
        self.instances.push(Instance { name: name.to_string(), kinds: kinds.clone(), ..Instance::default() });
        self.count_mixture(id);
        if depth < 3 {
            self.make_parts(id);
            self.declare_states(id);
        }
        id
    }

    /// Asks something of a mixture of given amounts that stands nowhere in the lab; none where the lab knows no mixtures.
    pub fn with_composition<R>(
        &mut self,
        amounts: Vec<(SpeciesId, NodeId)>,
        ask: impl FnOnce(&mut Self, InstanceId) -> Option<R>,
    ) -> Option<R> {
        let kind = self.tables.kinds.values().find(|k| k.matter.is_some()).map(|k| k.id)?;
        let id = InstanceId(self.instances.len() as u32);
        let composition = Some(amounts);
        self.instances.push(Instance { kinds: vec![kind], composition, ..Instance::default() });
        let answer = self.in_mode(Mode::START, |lab| ask(lab, id));
        self.instances.truncate(id.0 as usize);
        answer
    }

    /// The top-level instance with this name.
    pub fn find_instance(&self, name: &str) -> Option<InstanceId> {
        self.top_level.get(name).copied()
    }

    /// Whether there is an instance with this full name.
    pub fn find_part(&self, name: &str) -> bool {
        self.instances.iter().any(|i| i.name == name)
    }

    /// All instances that have a kind.
    pub fn instances_of(&self, kind: DeclId) -> Arc<[InstanceId]> {
        let count = self.instances.len();
        let known = self.by_kind.read().ok().and_then(|known| known.get(&kind).cloned());
        if let Some((_, found)) = known.filter(|(then, _)| *then == count) {
            return found;
        }
        let found: Arc<[_]> = (0..count as u32).map(InstanceId).filter(|i| self.instance_is(*i, kind)).collect();
        if let Ok(mut known) = self.by_kind.write() {
            known.insert(kind, (count, Arc::clone(&found)));
        }
        found
    }

    /// Whether an instance has a kind.
    pub fn instance_is(&self, id: InstanceId, kind: DeclId) -> bool {
        let kinds = &self.instances[id.0 as usize].kinds;
        kinds.iter().any(|k| self.tables.kinds.get(k).is_some_and(|info| info.has(kind)))
    }

    /// The commands with this verb that an instance has, without those that a more derived capability of it declares again.
    pub fn commands_of(&self, id: InstanceId, verb: &str) -> Vec<MemberRef<'a>> {
        let own = self.tables.commands(verb).iter().filter(|m| self.instance_is(id, m.owner));
        self.tables.visible(own.copied().collect())
    }

    /// The type of an instance, for messages.
    pub fn kind_names(&self, id: InstanceId) -> String {
        let kinds = &self.instances[id.0 as usize].kinds;
        kinds.iter().map(|k| self.tables.kind_name(*k)).collect::<Vec<_>>().join(" & ")
    }

    /// A frame that the asset's lines declare.
    pub fn frame(&self, id: InstanceId, name: &str) -> Option<Value> {
        let kinds = &self.instances[id.0 as usize].kinds;
        let found = kinds
            .iter()
            .filter_map(|k| self.tables.kinds.get(k))
            .flat_map(|k| &k.lines)
            .any(|(_, line)| matches!(line, AssetLine::Frame { name: n, .. } if n.text == name));
        found.then(|| Value::Frame(id, name.to_string()))
    }

    fn kinds_of(&self, id: InstanceId) -> impl Iterator<Item = &'a Kind<'a>> {
        let tables: &'a Tables<'a> = self.tables;
        self.instances[id.0 as usize].kinds.iter().filter_map(|k| tables.kinds.get(k))
    }

    /// Whether an instance has a quantity of each species, matter or not.
    pub fn per_species(&self, id: InstanceId) -> bool {
        self.kinds_of(id).any(|k| k.per_species)
    }

    /// Whether an instance is of matter: it has amounts of species, which `holding` fills and transfers move.
    pub fn is_mixture(&self, id: InstanceId) -> bool {
        self.kinds_of(id).any(|k| k.matter.is_some())
    }

    /// The mixture that an instance is, or its first part that is one.
    pub fn mixture_of(&self, id: InstanceId) -> Option<InstanceId> {
        if self.is_mixture(id) {
            return Some(id);
        }
        self.instances[id.0 as usize].parts.values().copied().find(|p| self.is_mixture(*p))
    }

    /// Whether a member of an instance is its amount of matter.
    pub fn is_matter(&self, id: InstanceId, m: MemberRef<'a>) -> bool {
        self.kinds_of(id).find_map(|k| k.matter).is_some_and(|of| std::ptr::eq(of.member, m.member))
    }

    /// The amounts of matter in a mixture: of which species, and its state.
    pub fn amounts_in(&self, id: InstanceId) -> impl Iterator<Item = (SpeciesId, u32)> {
        let member = self.kinds_of(id).find_map(|k| k.matter).and_then(|m| member_name(m.member));
        let amounts = member.and_then(|name| self.instances[id.0 as usize].amounts.get(&name.text));
        amounts.into_iter().flatten().map(|(s, state)| (*s, *state))
    }

    /// The concentration kinds of an instance, in the order of the library.
    #[allow(clippy::type_complexity)]
    pub fn views(&self, id: InstanceId) -> Vec<(usize, &'a crate::ast::Param, &'a crate::ast::Type, &'a Expr, DeclId)> {
        self.all_members(id)
            .iter()
            .filter_map(|m| match &m.member.kind {
                MemberKind::View { param, ty, value } => Some((m.module, param, ty, value, m.owner)),
                _ => None,
            })
            .collect()
    }

    /// Derived members, base first.
    pub fn derived_members(&self, id: InstanceId) -> Vec<MemberRef<'a>> {
        let derived = |m: &MemberRef<'a>| matches!(&m.member.kind, MemberKind::Value { role: Role::Derived, .. });
        self.all_members(id).iter().copied().filter(derived).collect()
    }

    /// The member by which a mixture is measured out in a dimension: its mass, its volume.
    pub fn size_in(&mut self, id: InstanceId, wanted: &Dimension) -> Option<MemberRef<'a>> {
        self.derived_members(id).into_iter().find(|m| {
            let MemberKind::Value { ty, .. } = &m.member.kind else { return false };
            matches!(self.resolve_type(ty, m.module), Type::Quantity { dimension, point: false, .. } if dimension == *wanted)
        })
    }

    /// The type of an extensive quantity.
    pub fn extensive_type(&mut self, id: InstanceId, member: &str) -> Option<(Type, MemberRef<'a>)> {
        let m = self.members_of(id, member).first().copied()?;
        let MemberKind::Value { ty, .. } = &m.member.kind else { return None };
        Some((self.resolve_type(ty, m.module), m))
    }
}

impl<'a> Elaborator<'a> {
    /// Gives a stand-in the fields of its asset's lines.
    pub fn use_lines(&mut self, id: InstanceId) {
        for kind in self.instances[id.0 as usize].kinds.clone() {
            let Some(info) = self.tables.kinds.get(&kind) else { continue };
            let settings = info.lines.iter().filter_map(|(module, line)| match line {
                AssetLine::Field(field) => Some(Setting { module: *module, field, lab: false, of: Some(id) }),
                _ => None,
            });
            self.instances[id.0 as usize].settings.extend(settings);
        }
    }
}
