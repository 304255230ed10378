//! What kind of value each declaration stands for, as far as its text says.

use matterix_ir::Span;
use matterix_lang::ast::{
    AssetLine, AssetLiteral, Clause, ClauseKind, Expr, ExprKind, Item, ItemKind, LabLineKind, MemberKind, Param, Path,
    Sig, Type,
};
use matterix_lang::names::{DeclId, Module};
use matterix_lang::semantic_index::Sort;

use super::collect::bare;
use super::{DefId, Index, Kind};

impl Index {
    /// Gives the declarations of a module their kinds of value.
    pub(super) fn settle(&mut self, at: usize, module: &Module) {
        for item in &module.tree.items {
            self.settle_item(at, item);
        }
        // What assets of the library get from files depends on who uses them.
        if !module.is_library() {
            self.given_by_files();
        }
    }

    fn set(&mut self, name: Span, sort: Sort) {
        let Some(id) = self.declared_at(name) else { return };
        if let Some(def) = self.own_mut(id) {
            def.sort = sort;
        }
    }

    fn settle_item(&mut self, at: usize, item: &Item) {
        match &item.kind {
            ItemKind::Unit { name, aliases, .. } => {
                for name in std::iter::once(name).chain(aliases) {
                    if let Some((def, _)) = self.units().find(&name.text) {
                        let sort = Sort::Quantity(def.dimension.clone(), def.offset.is_some());
                        self.set(name.span, sort);
                    }
                }
            }
            ItemKind::Dimension { name, .. } => {
                if let Some(def) = self.units().dimension(&name.text) {
                    let sort = Sort::Quantity(def.dimension.clone(), def.point);
                    self.set(name.span, sort);
                }
            }
            ItemKind::Species { name, .. } => self.set(name.span, Sort::Species),
            ItemKind::Solution { name, .. } => self.set(name.span, Sort::Solution),
            ItemKind::Reaction { name, .. } => self.set(name.span, Sort::Reaction),
            ItemKind::Material { name, .. } => self.set(name.span, Sort::Material),
            ItemKind::Relation { name, params, .. } => {
                self.set(name.span, Sort::Truth);
                self.settle_params(at, params);
            }
            ItemKind::Hazard { params, .. } | ItemKind::Workflow { params, .. } => self.settle_params(at, params),
            ItemKind::Process(p) => self.settle_params(at, &p.params),
            ItemKind::Event(e) => self.settle_params(at, &e.params),
            ItemKind::Fn { name, params, result, body, .. } => {
                let sort = self.typed(at, result.as_ref(), body.as_ref());
                self.set(name.span, sort);
                self.settle_params(at, params);
            }
            ItemKind::Const { name, ty, value } => {
                let sort = self.typed(at, ty.as_ref(), Some(value));
                self.set(name.span, sort);
            }
            ItemKind::Table { name, columns, .. } => {
                if let Some(table) = self.declared_at(name.span).and_then(|id| self.decl_of(id)) {
                    self.set(name.span, Sort::List(Box::new(Sort::Row(table))));
                }
                for column in columns {
                    let sort = self.sort_of_type(at, &column.ty);
                    self.set(column.name.span, sort);
                    if let Some(id) = self.declared_at(column.name.span) {
                        self.words_of(id, Some(&column.ty));
                    }
                }
            }
            ItemKind::Skill { sig, clauses, .. } => self.settle_signature(at, sig, clauses),
            ItemKind::Capability { members, name, .. } => {
                self.set_kind(name.span);
                for member in members {
                    self.settle_member(at, &member.kind);
                }
            }
            ItemKind::Asset { name, lines, .. } => {
                self.set_kind(name.span);
                for line in lines {
                    self.settle_asset_line(at, line);
                }
            }
            ItemKind::Lab { params, lines, .. } => {
                self.settle_params(at, params);
                for line in lines {
                    self.settle_lab_line(at, &line.kind);
                }
            }
            _ => {}
        }
    }

    fn settle_member(&mut self, at: usize, member: &MemberKind) {
        match member {
            MemberKind::Value { name, ty, per, .. } => {
                let sort = self.sort_of_type(at, ty);
                self.set(name.span, sort);
                if let Some(id) = self.declared_at(name.span) {
                    self.words_of(id, Some(ty));
                    if per.is_some() {
                        self.own.per_species.push(id);
                    }
                }
            }
            MemberKind::Frame { name, .. } => self.set(name.span, Sort::Frame),
            MemberKind::Process(p) => self.settle_params(at, &p.params),
            MemberKind::Event(e) => self.settle_params(at, &e.params),
            MemberKind::Command { sig, clauses } => self.settle_signature(at, sig, clauses),
            MemberKind::View { .. } | MemberKind::Limit { .. } | MemberKind::Error => {}
        }
    }

    fn settle_asset_line(&mut self, at: usize, line: &AssetLine) {
        match line {
            AssetLine::Frame { name, .. } => self.set(name.span, Sort::Frame),
            AssetLine::Part { name, literal } => {
                let sort = self.thing(at, literal, None);
                self.set(name.span, sort);
            }
            AssetLine::Grid(grid) => {
                let sort = Sort::List(Box::new(self.thing(at, &grid.literal, None)));
                self.set(grid.name.span, sort);
            }
            _ => {}
        }
    }

    fn settle_lab_line(&mut self, at: usize, line: &LabLineKind) {
        match line {
            LabLineKind::Setting { name, value } => {
                let sort = self.typed(at, None, Some(value));
                self.set(name.span, sort);
            }
            LabLineKind::Instance { name, literal, .. } => {
                let sort = self.thing(at, literal, Some(&name.text));
                self.set(name.span, sort);
            }
            LabLineKind::Include { name, lab, .. } => {
                self.set(name.span, Sort::Lab(name.text.clone()));
                let target = lab.segments.last().and_then(|n| self.lookup(at, &n.text));
                let id = self.declared_at(name.span);
                if let Some(def) = id.and_then(|id| self.own_mut(id)) {
                    def.words = target.into_iter().collect();
                }
            }
            LabLineKind::Between { .. } | LabLineKind::Error => {}
        }
    }

    fn set_kind(&mut self, name: Span) {
        if let Some(decl) = self.declared_at(name).and_then(|id| self.decl_of(id)) {
            self.set(name, Sort::Kind(decl));
        }
    }

    fn settle_signature(&mut self, at: usize, sig: &Sig, clauses: &[Clause]) {
        if let Some(result) = &sig.result {
            let sort = self.sort_of_type(at, result);
            self.set(sig.span, sort);
        }
        let options = clauses.iter().filter_map(|c| match &c.kind {
            ClauseKind::Option(p) => Some(p),
            _ => None,
        });
        for p in sig.all_params().chain(options) {
            self.settle_params(at, std::slice::from_ref(p));
        }
    }

    fn settle_params(&mut self, at: usize, params: &[Param]) {
        for p in params {
            let sort = self.typed(at, p.ty.as_ref(), p.default.as_ref());
            self.set(p.name.span, sort);
            if let Some(id) = self.declared_at(p.name.span) {
                self.words_of(id, p.ty.as_ref());
            }
        }
    }

    /// What a type says or, where there is none, what the value was found to be.
    pub(super) fn typed(&self, at: usize, ty: Option<&Type>, value: Option<&Expr>) -> Sort {
        if let Some(ty) = ty {
            return self.sort_of_type(at, ty);
        }
        let Some(value) = value else { return Sort::Any };
        if let Some(seen) = self.seen(value.span) {
            return seen.sort.clone();
        }
        match &*value.kind {
            ExprKind::Number(_) => Sort::number(),
            ExprKind::Text(_) => Sort::Text,
            ExprKind::Quantity(_, unit) | ExprKind::As(_, unit) | ExprKind::Tuple(_, Some(unit)) => {
                let unit = self.units().resolve(&unit.text);
                unit.map_or(Sort::Any, |r| Sort::Quantity(r.dimension, r.point))
            }
            _ => Sort::Any,
        }
    }

    /// The capability or asset that a path names.
    pub(super) fn kind_named(&self, at: usize, path: &Path) -> Option<DeclId> {
        let def = self.lookup(at, &path.segments.last()?.text)?;
        let is_kind = matches!(self.def(def).kind, Kind::Capability | Kind::Asset);
        self.decl_of(def).filter(|_| is_kind)
    }

    fn thing(&self, at: usize, literal: &AssetLiteral, name: Option<&str>) -> Sort {
        Sort::Thing(self.kind_named(at, &literal.ty).into_iter().collect(), name.map(String::from))
    }

    /// What a type says.
    pub(super) fn sort_of_type(&self, at: usize, ty: &Type) -> Sort {
        if !ty.words.is_empty() {
            return Sort::Word(ty.words.iter().map(|w| w.text.clone()).collect());
        }
        if let ([path], inner) = (ty.paths.as_slice(), &ty.argument)
            && let [name] = path.segments.as_slice()
        {
            let inner = || Box::new(inner.as_ref().map_or(Sort::Any, |i| self.sort_of_type(at, i)));
            match name.text.as_str() {
                "Bool" => return Sort::Truth,
                "Text" => return Sort::Text,
                "Int" => return Sort::number(),
                "Species" => return Sort::Species,
                "Reaction" => return Sort::Reaction,
                "Material" => return Sort::Material,
                "Frame" => return Sort::Frame,
                "Color" => return Sort::Color,
                "Any" => return Sort::Any,
                "Range" => return Sort::Range(inner()),
                "List" => return Sort::List(inner()),
                _ => {}
            }
            if let Some(def) = self.units().dimension(&name.text) {
                return Sort::Quantity(def.dimension.clone(), def.point);
            }
        }
        let kinds: Vec<DeclId> = ty.paths.iter().filter_map(|p| self.kind_named(at, p)).collect();
        if kinds.is_empty() { Sort::Any } else { Sort::Thing(kinds, None) }
    }

    /// Members that assets of the library get from files: places, parts and frames.
    fn given_by_files(&mut self) {
        if !self.own.given.is_empty() {
            return;
        }
        let modules = self.modules.clone();
        for (at, module) in modules.iter().enumerate().filter(|(_, m)| m.is_library()) {
            for item in &module.tree.items {
                let ItemKind::Asset { name, source: Some((_, path)), lines, .. } = &item.kind else { continue };
                let Some(owner) = self.declared_at(name.span) else { continue };
                let mut given: Vec<DefId> = Vec::new();
                for line in lines {
                    let (kind, name, sort) = match line {
                        AssetLine::Frame { name, .. } => (Kind::Frame, name, Sort::Frame),
                        AssetLine::Part { name, literal } => (Kind::Part, name, self.thing(at, literal, None)),
                        AssetLine::Grid(grid) => {
                            let sort = Sort::List(Box::new(self.thing(at, &grid.literal, None)));
                            (Kind::Grid, &grid.name, sort)
                        }
                        _ => continue,
                    };
                    let again = given.iter().any(|d| self.def(*d).name == name.text);
                    if name.span != path.span || again {
                        continue;
                    }
                    let def = super::Def { sort, ..bare(&name.text, kind, name.span, item.span) };
                    let id = self.add(def);
                    if let Some(def) = self.own_mut(id) {
                        def.owner = Some(owner);
                    }
                    given.push(id);
                }
                if !given.is_empty() {
                    self.own.given.insert(owner, given);
                }
            }
        }
    }
}
