//! What is written of a thing: its kind, its fields, its position.

use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use crate::ast::{self, AssetLine, Expr, Field, ItemKind, Path};
use crate::declare::Type;
use crate::eval::Value;
use crate::names::DeclId;

/// Fields every asset may have beside the members of its capabilities: geometry, and what follows from it.
pub(crate) const GEOMETRY: &[&str] =
    &["shape", "room", "inside", "tip", "base", "home", "mounted", "mesh", "collision", "inertia"];

impl<'a> Elaborator<'a> {
    /// The capability or asset a path names.
    pub fn kind_named(&mut self, path: &Path, module: usize) -> Option<DeclId> {
        let name = path.segments.last()?;
        let is_kind = |k: &ItemKind| matches!(k, ItemKind::Capability { .. } | ItemKind::Asset { .. });
        let found = self.tables.names.lookup(module, &name.text).filter(|id| self.tables.kinds.contains_key(id));
        if found.is_none() {
            let d = self.tables.names.unknown(module, name, "asset", is_kind);
            self.report(d);
        }
        found
    }

    /// Reports fields of a thing that are no member of its kind, or that follow from others.
    pub fn check_fields(&mut self, kind: DeclId, fields: &'a [Field]) {
        self.check_fields_of(kind, fields, false);
    }

    /// The same; `own` for the lines of the asset's declaration.
    pub fn check_fields_of(&mut self, kind: DeclId, fields: &'a [Field], own: bool) {
        let Some(info) = self.tables.kinds.get(&kind) else { return };
        let mut known: Vec<String> = info
            .members
            .iter()
            .filter_map(|m| crate::declare::tables::member_name(m.member))
            .map(|n| n.text.clone())
            .collect();
        known.extend(GEOMETRY.iter().map(|s| (*s).to_string()));
        known.extend(info.lines.iter().filter_map(|(_, l)| match l {
            AssetLine::Part { name, .. } | AssetLine::Grid(ast::Grid { name, .. }) => Some(name.text.clone()),
            _ => None,
        }));
        let keys: Vec<&str> = known.iter().map(String::as_str).collect();
        let mut found = Vec::new();
        crate::declare::fields::unknown_fields(fields, &keys, &format!("`{}`", info.name), &mut found);
        for d in found {
            self.report(d);
        }
        self.check_settable(&[kind], fields, own);
    }

    /// Two or three lengths, m.
    pub fn position(&mut self, items: &[Value], at: &Expr) -> Option<[f64; 3]> {
        let length = self.tables.units.named("Length");
        let mut out = [0.0; 3];
        if items.len() < 2 || items.len() > 3 {
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                at.span,
                format!("a position needs two or three coordinates, not {}", items.len()),
                "not a position",
            ));
            return None;
        }
        for (slot, item) in out.iter_mut().zip(items) {
            let ty = Type::Quantity { dimension: length.clone(), point: false, optional: false };
            let Value::Num(n) = self.coerce(item.clone(), &ty, at.span, "at") else { return None };
            *slot = self.known(n.node)?;
        }
        Some(out)
    }
}
