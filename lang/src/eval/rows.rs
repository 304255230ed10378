//! Rows of tables: what a cell is worth, and what a column holds.

use matterix_ir::{Diagnostic, Span, codes};

use super::{Scope, Value};
use crate::ast::{Column, Expr, ItemKind, Name, TableRows};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::names::DeclId;
use crate::near;

impl<'a> Elaborator<'a> {
    fn table(&self, id: DeclId) -> Option<(&'a Name, &'a Name, &'a [Column], &'a TableRows)> {
        match &self.tables.names.decl(id).item.kind {
            ItemKind::Table { name, source, columns, rows: Some(rows) } => Some((name, &source.1, columns, rows)),
            _ => None,
        }
    }

    /// `row.volume`.
    pub fn cell(&mut self, id: DeclId, row: u32, name: &Name) -> Value {
        let Some((table, _, columns, rows)) = self.table(id) else { return Value::Error };
        let index = columns.iter().position(|column| column.name.text == name.text);
        if let Some(row) = rows.rows.get(row as usize).filter(|_| index.is_none() && name.text == "line") {
            return self.number(f64::from(row.line), crate::units::Dimension::one(), false);
        }
        let Some(index) = index else {
            let near = near::nearest(&name.text, columns.iter().map(|column| column.name.text.as_str()));
            let mut d = Diagnostic::error(
                codes::UNKNOWN_MEMBER,
                name.span,
                format!("the table `{}` has no column `{}`", table.text, name.text),
                "not a column",
            )
            .because(table.span, "declared here");
            d = match near.as_slice() {
                [] => {
                    let all: Vec<String> = columns.iter().map(|c| format!("`{}`", c.name.text)).collect();
                    d.help(format!("it has {}", all.join(", ")))
                }
                near => near::proposed(d, near, name.span),
            };
            self.report(d);
            return Value::Error;
        };
        self.note_name(name.span, |_| Some(columns[index].name.span));
        self.cell_at(id, row, index)
    }

    fn cell_at(&mut self, id: DeclId, row: u32, index: usize) -> Value {
        let Some((.., columns, rows)) = self.table(id) else { return Value::Error };
        let module = self.tables.names.decl(id).module;
        let Some((column, row)) = columns.get(index).zip(rows.rows.get(row as usize)) else { return Value::Error };
        let ty = self.resolve_type(&column.ty, module);
        let given: &'a Option<Expr> = &row.cells[index];
        let Some(e) = given.as_ref().or(column.default.as_ref()) else { return Value::Error };
        if self.prototype && matches!(ty, Type::Instance { .. }) {
            return self.placeholder(&ty, &column.name.text);
        }
        let mut scope = Scope {
            lab: !self.prototype && matches!(ty, Type::Instance { .. } | Type::List(_)),
            ..Scope::module(module)
        };
        self.typed(e, &ty, &mut scope, &column.name.text)
    }

    /// `plan.volume`: a column of a list of rows of one table, if there is one of this name.
    pub fn column_of(&mut self, items: &[Value], name: &Name) -> Option<Value> {
        let Some(Value::Row(id, _)) = items.first() else { return None };
        let (.., columns, _) = self.table(*id)?;
        let index = columns.iter().position(|column| column.name.text == name.text)?;
        let rows: Option<Vec<u32>> = items
            .iter()
            .map(|item| if let Value::Row(other, row) = item { (other == id).then_some(*row) } else { None })
            .collect();
        let rows = rows?;
        self.spend_on_items(rows.len());
        self.note_name(name.span, |_| Some(columns[index].name.span));
        Some(Value::List(rows.into_iter().map(|row| self.cell_at(*id, row, index)).collect()))
    }

    /// A row in words.
    pub fn row_name(&self, id: DeclId, row: u32) -> Option<String> {
        let (_, path, _, rows) = self.table(id)?;
        Some(format!("line {} of {}", rows.rows.get(row as usize)?.line, path.text))
    }

    /// The tables that the plan was made of, and which text each was.
    pub fn data_used(&self) -> Vec<(String, String)> {
        let used = self.tables_used.iter().filter_map(|id| self.table(*id));
        used.map(|(name, path, _, rows)| {
            let count = rows.rows.len();
            let rows_word = if count == 1 { "row" } else { "rows" };
            (format!("table {}", name.text), format!("{}, {count} {rows_word}, sha256 {}", path.text, rows.sum))
        })
        .collect()
    }

    /// Judges the columns of a table and, where they are right, its cells.
    pub fn check_table(&mut self, id: DeclId) {
        let decl = self.tables.names.decl(id);
        let ItemKind::Table { columns, rows, .. } = &decl.item.kind else { return };
        let before = self.diagnostics.len();
        let mut of_lab = vec![false; columns.len()];
        for (index, column) in columns.iter().enumerate() {
            let ty = self.resolve_type(&column.ty, decl.module);
            of_lab[index] = matches!(ty, Type::Instance { .. } | Type::List(_));
            if matches!(
                ty,
                Type::Range(_) | Type::Color | Type::Frame | Type::Any | Type::Material { .. } | Type::Reaction
            ) {
                let headline = format!("a cell of a table cannot hold {}", self.tables.type_name(&ty));
                let d = Diagnostic::error(codes::TYPE_MISMATCH, column.ty.span, headline, "not for tables");
                self.report(d.help("use a quantity such as `Volume`, `Int`, `Ratio`, `Text`, `Place`, `Bool`, words, `Species`, or a type of things"));
            }
            if let Some(unit) = &column.unit {
                match (&ty, self.tables.unit(&unit.text)) {
                    (_, Err(error)) => self.report(crate::declare::units::unit_error(unit, error)),
                    (Type::Quantity { dimension, .. }, Ok(resolved)) if resolved.dimension.agrees(dimension) => {}
                    (Type::Any, _) => {}
                    (ty, Ok(_)) => {
                        let headline = format!(
                            "`{}` is no unit of `{}`, {}",
                            unit.text,
                            column.name.text,
                            self.tables.type_name(ty)
                        );
                        self.report(Diagnostic::error(codes::UNIT_MISMATCH, unit.span, headline, "another dimension"));
                    }
                }
            }
            if let Some(default) = column.default.as_ref().filter(|_| !of_lab[index]) {
                self.typed(default, &ty, &mut Scope::module(decl.module), &column.name.text);
            }
        }
        let Some(rows) = rows.as_ref().filter(|_| self.diagnostics.len() == before) else { return };
        for row in 0..rows.rows.len() {
            for (index, _) in of_lab.iter().enumerate().filter(|(_, of_lab)| !**of_lab) {
                self.cell_at(id, row as u32, index);
            }
            if self.diagnostics.len() > before + MOST_TOLD {
                return;
            }
        }
    }

    /// The cells of a row that a turn goes through, for findings about it.
    pub fn row_span(&self, value: &Value) -> Option<Span> {
        let Value::Row(id, row) = value else { return None };
        let (.., rows) = self.table(*id)?;
        Some(rows.rows.get(*row as usize)?.span)
    }
}

/// Wrong cells of a table that are told.
const MOST_TOLD: usize = 10;
