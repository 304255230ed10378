//! What a text may give for a thing, and what follows from the rest: a value given for that would stop the laws.

use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Leaves, codes};
use rustc_hash::FxHashSet;

use super::Elaborator;
use crate::ast::{AssetLine, Expr, ExprKind, Field, FieldValue, MemberKind, NamedExpr, Role};
use crate::declare::Type;
use crate::declare::fields::word;
use crate::declare::tables::{MemberRef, Tables};
use crate::eval::lab::written::GEOMETRY;
use crate::eval::{Num, Scope, Value};
use crate::names::{DeclId, names_of};

/// The option of a derived member that says what to give in its place.
pub const INSTEAD: &str = "instead";
/// The option of the parameter that takes what stands after `holding ... at`.
pub const GIVEN_BY: &str = "given_by";
/// The option of an extensive quantity that is zero unless the lab gives the parameter it names.
pub const ONLY_WITH: &str = "only_with";
/// The option of a member that keeps it out of what is shown: `true`, or of a derived one a condition that no run changes.
pub const HIDDEN: &str = "hidden";
/// The option of a derived member that says where its model holds.
pub const VALID: &str = "valid";

/// How far names in definitions are followed to what can be given.
const DEEPEST: usize = 4;

/// Whether a member takes what stands after `holding ... at`.
fn takes_start(m: &MemberRef<'_>) -> bool {
    matches!(&m.member.kind, MemberKind::Value { role: Role::Param, options, .. } if word(options, GIVEN_BY) == Some("at"))
}

/// Why a member cannot be given; nothing for one that can.
fn reason(m: &MemberRef<'_>) -> Option<&'static str> {
    match &m.member.kind {
        MemberKind::Value { role: Role::Derived, .. } => Some("follows from other members"),
        MemberKind::Value { role: Role::Reading, .. } => Some("is reported by the device"),
        MemberKind::Value { role: Role::Flow, .. } => Some("is a sum over laws"),
        MemberKind::Frame { .. } => Some("is a frame"),
        MemberKind::Process(_) => Some("is a process"),
        MemberKind::Event(_) => Some("is an event"),
        _ => None,
    }
}

impl<'a> Elaborator<'a> {
    /// Reports fields for members of a kind that cannot be given. In the asset's own declaration a derived member may
    /// be defined anew (`redefinition` looks at that).
    pub fn check_settable(&mut self, kinds: &[DeclId], fields: &'a [Field], own: bool) {
        let tables: &'a Tables<'a> = self.tables;
        let Some(&kind) = kinds.first() else { return };
        for f in fields {
            let key = f.key.text.as_str();
            let found: Vec<&MemberRef<'a>> = kinds.iter().flat_map(|k| tables.members(*k, key)).collect();
            let is_held = |m: &MemberRef<'a>| {
                let matter = kinds.iter().find_map(|k| tables.kinds.get(k)?.matter);
                matter.is_some_and(|of| std::ptr::eq(of.member, m.member))
            };
            let reason = |m: &MemberRef<'a>| if is_held(m) { Some("is given by `holding`") } else { reason(m) };
            // A capability may also mean its own member of that name: one that can be given is enough.
            let Some(m) = found.first().filter(|_| found.iter().all(|m| reason(m).is_some())) else { continue };
            let derived = matches!(&m.member.kind, MemberKind::Value { role: Role::Derived, .. });
            if derived && (own || GEOMETRY.contains(&key)) {
                continue;
            }
            let why = reason(m).unwrap_or_default();
            let owner = tables.kind_name(m.owner);
            let headline = format!("`{key}` of `{}` {why} and cannot be given", tables.kind_name(kind));
            let d = Diagnostic::error(codes::DERIVED_MEMBER, f.span, headline, "cannot be given here");
            let d = d.because(m.member.span, format!("`{owner}` declares it here"));
            let help = self.instead(kind, m);
            self.report(d.help(help));
        }
    }

    /// The same for the fields of parts and of what stands in grids, in the braces of an asset's line.
    pub fn check_nested(&mut self, kind: DeclId, f: &'a Field, module: usize) {
        let (fields, named): (&'a [Field], _) = match &f.value {
            FieldValue::Fields(fields) => (fields, None),
            FieldValue::Literal(literal) => (&literal.fields, self.kind_named(&literal.ty, module)),
            FieldValue::Expr(_) | FieldValue::Species(_) => return,
        };
        let tables: &'a Tables<'a> = self.tables;
        let declared = tables.members(kind, &f.key.text).iter().find_map(|m| match &m.member.kind {
            MemberKind::Value { role: Role::Part, ty, .. } => Some((ty, m.module)),
            _ => None,
        });
        let declared = declared.and_then(|(ty, module)| match self.resolve_type(ty, module) {
            Type::Instance { kinds, .. } => kinds.first().copied(),
            Type::List(inner) => match &*inner {
                Type::Instance { kinds, .. } => kinds.first().copied(),
                _ => None,
            },
            _ => None,
        });
        let Some(part) = named.or(declared) else { return };
        self.check_fields(part, fields);
        fields.iter().for_each(|f| self.check_nested(part, f, module));
    }

    /// What to give in place of a member that cannot be given.
    fn instead(&self, kind: DeclId, m: &MemberRef<'a>) -> String {
        match &m.member.kind {
            MemberKind::Value { role: Role::Derived, options, value, .. } => {
                if let Some(text) = instead_text(options) {
                    return text.to_string();
                }
                let mut found = Vec::new();
                self.sources(kind, value.as_ref(), DEEPEST, &mut found);
                let names: Vec<String> = found.iter().map(|n| format!("`{n}`")).collect();
                match names.as_slice() {
                    [] => "remove it".to_string(),
                    names => format!("it follows from {}: give that instead", names.join(", ")),
                }
            }
            MemberKind::Value { role: Role::Extensive, .. } => "write `holding 10 g of water`".to_string(),
            MemberKind::Frame { name, .. } => {
                format!("its asset places it: `frame {} at (x, y, z) mm`", name.text)
            }
            _ => "remove it".to_string(),
        }
    }

    /// The members that can be given from which a definition follows.
    fn sources(&self, kind: DeclId, value: Option<&'a Expr>, depth: usize, out: &mut Vec<&'a str>) {
        let Some(e) = value.filter(|_| depth > 0) else { return };
        let tables: &'a Tables<'a> = self.tables;
        for name in names_of(e) {
            let [m] = tables.members(kind, name) else { continue };
            match &m.member.kind {
                MemberKind::Value { role: Role::Derived, value, .. } => {
                    self.sources(kind, value.as_ref(), depth - 1, out);
                }
                MemberKind::Value { role: Role::Param | Role::State | Role::Extensive, per: None, .. }
                    if !out.contains(&name) =>
                {
                    out.push(name);
                }
                _ => {}
            }
        }
    }

    /// The text that says what to give in place of the derived member that a path ends with.
    pub fn instead_of(&self, id: InstanceId, member: &str) -> Option<String> {
        let found = self.members_of(id, member);
        let m = found.first()?;
        match &m.member.kind {
            MemberKind::Value { role: Role::Derived, options, .. } => instead_text(options).map(str::to_string),
            _ => None,
        }
    }

    /// An asset's line may define a derived member anew; what changes with the thing must go on doing so.
    pub fn redefinition(&mut self, this: InstanceId, m: MemberRef<'a>, lines: &'a [AssetLine]) {
        let MemberKind::Value { role: Role::Derived, name, ty, value: Some(definition), .. } = &m.member.kind else {
            return;
        };
        let line = lines.iter().find_map(|l| match l {
            AssetLine::Field(f) if f.key.text == name.text => Some(f),
            _ => None,
        });
        let Some(line) = line.filter(|_| !GEOMETRY.contains(&name.text.as_str())) else { return };
        let ty = self.resolve_type(ty, m.module);
        let before = self.typed(definition, &ty, &mut Scope::of_member(this, m), &name.text);
        let now = self.member_value(this, m, name.span);
        if self.moves(&before) != Some(true) || self.moves(&now) != Some(false) {
            return;
        }
        let headline = format!("`{}` changes during a run and cannot be given as a constant", name.text);
        let d = Diagnostic::error(codes::DERIVED_MEMBER, line.span, headline, "cannot be given here");
        let d = d.because(m.member.span, format!("`{}` declares it here", self.tables.kind_name(m.owner)));
        let kind = self.instances[this.0 as usize].kinds[0];
        let help = self.instead(kind, &m);
        self.report(d.help(help));
    }

    /// Whether a value changes in a run; nothing where it has none.
    fn moves(&mut self, value: &Value) -> Option<bool> {
        if let Value::Tuple(items) = value {
            let all: Vec<bool> = items.clone().iter().filter_map(|i| self.moves(i)).collect();
            return (!all.is_empty()).then(|| all.contains(&true));
        }
        let node = self.value_node(value)?;
        Some(self.graph.leaves(node).meets(Leaves::LIVE))
    }

    /// `holding ... at 80 degC`: the value of the member that says how the contents begin.
    pub fn start_at(&mut self, id: InstanceId, at: &'a Expr, module: usize) {
        let members = self.all_members(id);
        let Some(m) = members.iter().find(|m| takes_start(m)) else {
            let kind = self.kind_names(id);
            let headline = format!("`{kind}` takes no `at` after `holding`");
            let d = Diagnostic::error(codes::TYPE_MISMATCH, at.span, headline, "not allowed here");
            self.report(
                d.help("its capability must declare it: `param start: Temperature = ambient { given_by: at }`"),
            );
            return;
        };
        let MemberKind::Value { name, .. } = &m.member.kind else { return };
        // What begins by this member, given as well, would leave `at` without effect.
        let rival = members.iter().find_map(|o| match &o.member.kind {
            MemberKind::Value { name: other, value, .. } => {
                let given = self.instances[id.0 as usize].setting(&other.text)?;
                let follows = value.as_ref().is_some_and(|e| names_of(e).contains(&name.text.as_str()));
                (other.text == name.text || follows).then_some(given.field)
            }
            _ => None,
        });
        if let Some(rival) = rival {
            let headline = format!("`at` and `{}` both give the initial temperature of the contents", rival.key.text);
            let d = Diagnostic::error(codes::DUPLICATE_NAME, at.span, headline, "given again here");
            self.report(d.because(rival.span, "first given here").help("remove one of them"));
            return;
        }
        self.instances[id.0 as usize].start = Some((at, module));
    }

    /// The value of a parameter that stands after `holding ... at`.
    pub fn started(&mut self, id: InstanceId, m: MemberRef<'a>, ty: &Type) -> Option<Value> {
        let (e, module) = self.instances[id.0 as usize].start.filter(|_| takes_start(&m))?;
        let MemberKind::Value { name, options, .. } = &m.member.kind else { return None };
        let within = self.within_of(id, true);
        let mut scope = Scope { lab: true, ..Scope::module(module) };
        let value = self.within_lab(&within, |this| this.typed(e, ty, &mut scope, "at"));
        let value = self.as_param(id, &name.text, ty, value, e.span);
        self.check_limits(&value, e.span, "at", ty, options, (Some(id), m.module));
        Some(value)
    }

    /// Whether a parameter that nobody gives is what another member is: what reads it asks for it.
    pub fn is_idle(&self, id: InstanceId, m: MemberRef<'a>) -> bool {
        let MemberKind::Value { name, value: Some(default), .. } = &m.member.kind else { return false };
        let ExprKind::Name(other) = &*default.kind else { return false };
        let instance = &self.instances[id.0 as usize];
        let given = instance.start.is_some() || instance.setting(&name.text).is_some();
        !given && (other.text == "ambient" || !self.members_of(id, &other.text).is_empty())
    }

    /// What stands after `holding ... at` for a mixture.
    pub fn start_of(&mut self, id: InstanceId) -> Option<Num> {
        self.instances[id.0 as usize].start?;
        let m = self.all_members(id).iter().copied().find(takes_start)?;
        match self.member_value(id, m, m.member.span) {
            Value::Num(n) => Some(n),
            _ => None,
        }
    }

    /// Whether an extensive quantity can be there at all: one that is there only with a parameter is left out of a lab
    /// that gives it nowhere.
    pub fn is_there(&mut self, options: &[NamedExpr]) -> bool {
        let Some(with) = word(options, ONLY_WITH).filter(|_| !self.prototype) else { return true };
        if self.given.is_none() {
            let all = self.instances.iter().flat_map(|i| &i.settings).map(|s| s.field.key.text.as_str());
            self.given = Some(all.collect::<FxHashSet<&'a str>>());
        }
        self.given.as_ref().is_some_and(|given| given.contains(with))
    }

    /// The value at the start of a quantity that is there only with a parameter, where that is not given: zero.
    pub fn without(&mut self, id: InstanceId, m: MemberRef<'a>, ty: &Type) -> Option<Value> {
        let MemberKind::Value { name, options, .. } = &m.member.kind else { return None };
        let with = word(options, ONLY_WITH).filter(|_| !self.prototype)?;
        let instance = &self.instances[id.0 as usize];
        let given = instance.setting(with).or_else(|| instance.setting(&name.text));
        let Type::Quantity { dimension, .. } = ty else { return None };
        given.is_none().then(|| self.number(0.0, dimension.clone(), false))
    }

    /// What is said of contents says nothing where there are none.
    pub fn check_contents_given(&mut self, id: InstanceId, options: &'a [NamedExpr]) {
        let Some(with) = word(options, ONLY_WITH) else { return };
        let instance = &self.instances[id.0 as usize];
        let Some(given) = instance.setting(with).filter(|_| instance.contents.is_empty()) else { return };
        let headline = format!("`{with}` describes contents, but `{}` is empty at the start", instance.name);
        let d = Diagnostic::error(codes::MISPLACED, given.field.span, headline, "there are no contents");
        self.report(d.help("add contents with `holding`, or remove it"));
    }
}

/// The text of `instead`.
fn instead_text(options: &[NamedExpr]) -> Option<&str> {
    match &*options.iter().find(|o| o.name.text == INSTEAD)?.value.kind {
        ExprKind::Text(text) => Some(text),
        _ => None,
    }
}
