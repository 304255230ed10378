//! Species, recipes, reactions and what must not meet.

use matterix_lang::ast::{Expr, ExprKind, Field, FieldValue, Term};

use super::Walk;

impl Walk<'_> {
    pub(super) fn terms(&mut self, terms: &[Term]) {
        terms.iter().for_each(|t| self.global(&t.species));
    }

    pub(super) fn key(&mut self, field: &Field) {
        self.language(field.key.span, "a field");
    }

    pub(super) fn value(&mut self, value: &FieldValue) {
        match value {
            FieldValue::Expr(e) => drop(self.expr(e)),
            FieldValue::Fields(fields) => {
                for f in fields {
                    self.key(f);
                    self.value(&f.value);
                }
            }
            FieldValue::Literal(l) => self.literal(l),
            FieldValue::Species(terms) => self.terms(terms),
        }
    }

    pub(super) fn species_fields(&mut self, fields: &[Field]) {
        for f in fields {
            match self.index.property(&f.key.text) {
                Some(def) => self.known(f.key.span, def),
                None => self.key(f),
            }
            match &f.value {
                FieldValue::Expr(e) => self.classes(e),
                other => self.value(other),
            }
        }
    }

    /// Names of classes and of other species; words that a property may be.
    pub(super) fn classes(&mut self, e: &Expr) {
        match &*e.kind {
            ExprKind::List(items) => items.iter().for_each(|i| self.classes(i)),
            ExprKind::Name(n) => match self.index.lookup(self.at, &n.text) {
                Some(def) => self.known(n.span, def),
                None => self.language(n.span, "a word"),
            },
            _ => drop(self.expr(e)),
        }
    }

    pub(super) fn class_fields(&mut self, fields: &[Field]) {
        for f in fields {
            self.key(f);
            match &f.value {
                FieldValue::Fields(members) => {
                    for m in members {
                        self.global(&m.key);
                        if let FieldValue::Expr(e) = &m.value {
                            self.classes(e);
                        }
                    }
                }
                FieldValue::Expr(e) => self.classes(e),
                other => self.value(other),
            }
        }
    }

    pub(super) fn reaction_fields(&mut self, fields: &[Field]) {
        for f in fields {
            self.key(f);
            match &f.value {
                FieldValue::Fields(orders) => {
                    for order in orders {
                        self.global(&order.key);
                        self.value(&order.value);
                    }
                }
                FieldValue::Expr(e) if f.key.text == "requires" => self.about_mixture(e),
                FieldValue::Expr(e) => drop(self.expr(e)),
                other => self.value(other),
            }
        }
    }

    /// A condition on a mixture, whose members it names: any kind that counts species may be meant.
    pub(super) fn about_mixture(&mut self, e: &Expr) {
        let counting = self.index.library.per_species.iter().chain(&self.index.own.per_species).next().copied();
        let before = std::mem::replace(&mut self.this, counting.and_then(|d| self.index.def(d).owner));
        self.expr(e);
        self.this = before;
    }
}
