//! Items.

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use matterix_ir::Span;

use crate::ast::{Block, Column, ItemKind, Labelled, Type, UnitText};

impl Lower<'_> {
    pub(super) fn item_form(&mut self, node: Node) -> ItemKind {
        let rule = node.as_rule();
        match rule {
            Rule::process => return ItemKind::Process(self.process(node)),
            Rule::event => return ItemKind::Event(self.event(node)),
            _ => {}
        }
        let kids = &mut Kids::of(node);
        match rule {
            Rule::use_ => self.use_item(kids),
            Rule::dimension => ItemKind::Dimension {
                name: self.name_in(kids),
                point: kids.has(Rule::kw_point),
                definition: kids.eat(Rule::operand).map(|d| self.expr(d)),
            },
            Rule::unit_item => self.unit_item(kids),
            Rule::species_item => ItemKind::Species { name: self.name_in(kids), fields: self.fields_in(kids) },
            Rule::solution => ItemKind::Solution {
                name: self.name_in(kids),
                fields: self.fields_in(kids),
                labelled: kids.eat(Rule::label_claim).map(|node| self.labelled_claim(node)),
            },
            Rule::reaction => ItemKind::Reaction {
                name: self.name_in(kids),
                reactants: self.side_in(kids),
                reversible: kids.has(Rule::biarrow),
                products: self.side_in(kids),
                fields: self.fields_in(kids),
            },
            Rule::interaction => ItemKind::Interaction {
                name: self.name_in(kids),
                between: self.side_in(kids),
                fields: self.fields_in(kids),
            },
            Rule::equilibrium => {
                let (name, reactants) = (self.name_in(kids), self.side_in(kids));
                kids.has(Rule::biarrow);
                ItemKind::Equilibrium { name, reactants, products: self.side_in(kids), fields: self.fields_in(kids) }
            }
            Rule::reactive_group => ItemKind::ReactiveGroup { name: self.name_in(kids), fields: self.fields_in(kids) },
            Rule::material => ItemKind::Material { name: self.name_in(kids), fields: self.fields_in(kids) },
            Rule::framing => {
                let outside = std::mem::replace(&mut self.on_line, true);
                let item = ItemKind::Framing { name: self.name_in(kids), fields: self.fields_in(kids) };
                self.on_line = outside;
                item
            }
            Rule::incompatible => {
                ItemKind::Incompatible { a: self.name_in(kids), b: self.name_in(kids), fields: self.fields_in(kids) }
            }
            Rule::allow => {
                let name = self.name_in(kids);
                match kids.peek() {
                    Some(Rule::species) => {
                        ItemKind::Allow { a: name, b: self.name_in(kids), reason: self.text_in(kids) }
                    }
                    _ => ItemKind::Accept { name, reason: self.text_in(kids) },
                }
            }
            Rule::hazard => ItemKind::Hazard {
                grave: kids.has(Rule::kw_hazard),
                name: self.name_in(kids),
                params: self.params_in(kids),
                of: kids.has(Rule::kw_of).then(|| kids.eat(Rule::operand).map(|o| self.expr(o))).flatten(),
                after: kids.eat(Rule::operand).map(|o| self.expr(o)),
                when: self.expr_in(kids),
                help: kids.eat(Rule::string).map(|t| self.text(&t)),
                because: kids.has(Rule::kw_because).then(|| self.filled_in(kids)).flatten(),
            },
            Rule::capability => self.capability(kids),
            Rule::asset => self.asset(kids),
            Rule::relation => ItemKind::Relation {
                name: self.name_in(kids),
                params: self.params_in(kids),
                symmetric: kids.has(Rule::kw_symmetric),
                definition: kids.eat(Rule::cond).map(|d| self.expr(d)),
            },
            Rule::fn_ => ItemKind::Fn {
                external: kids.has(Rule::kw_extern),
                name: self.name_in(kids),
                params: self.params_in(kids),
                result: kids.eat(Rule::ty).map(|t| self.ty(t)),
                body: kids.eat(Rule::cond).map(|b| self.expr(b)),
                options: self.options_in(kids),
            },
            Rule::const_ => ItemKind::Const {
                name: self.name_in(kids),
                ty: kids.eat(Rule::ty).map(|t| self.ty(t)),
                value: self.expr_in(kids),
            },
            Rule::table => {
                let name = self.name_in(kids);
                let source = self.source_in(kids).unwrap_or_else(|| (name.clone(), name.clone()));
                let columns = self.lines(
                    kids.eat(Rule::columns),
                    Rule::only_column,
                    |this, node, span| Some(this.column(node, span)),
                    |_, _, _| None,
                );
                ItemKind::Table { name, source, columns: columns.into_iter().flatten().collect(), rows: None }
            }
            Rule::driver => self.driver(kids),
            Rule::lab => self.lab(kids),
            Rule::skill => ItemKind::Skill {
                external: kids.has(Rule::kw_extern),
                sig: self.sig_in(kids),
                clauses: self.clauses_in(kids),
                body: kids.eat(Rule::block).map(|b| self.block(b)),
                handlers: self.handlers_in(kids),
            },
            Rule::workflow => {
                let name = self.name_in(kids);
                let params = self.params_in(kids);
                kids.has(Rule::any_lab);
                let lab = kids.eat(Rule::path).map(|p| self.path(&p));
                ItemKind::Workflow { name, params, lab, body: self.block_in(kids), handlers: self.handlers_in(kids) }
            }
            Rule::study => self.study(kids),
            Rule::fit => self.fit(kids),
            Rule::test => {
                let name = self.name_in(kids);
                let lab = kids.eat(Rule::path).map(|p| self.path(&p));
                ItemKind::Test { name, lab, body: self.test_body(kids), handlers: self.handlers_in(kids) }
            }
            _ => ItemKind::Error,
        }
    }

    fn column(&mut self, node: Node, span: Span) -> Column {
        let kids = &mut Kids::of(node);
        let name = self.name_in(kids);
        let header = matches!(kids.peek(), Some(Rule::string)).then(|| self.quoted_in(kids));
        let ty = kids.eat(Rule::ty).map(|t| self.ty(t));
        let ty = ty.unwrap_or_else(|| Type {
            paths: Vec::new(),
            words: Vec::new(),
            argument: None,
            optional: false,
            condition: None,
            span,
        });
        let unit = kids.eat(Rule::as_unit).and_then(|n| Kids::of(n).eat(Rule::unit)).map(|u| self.unit(&u));
        Column { name, header, ty, unit, default: kids.eat(Rule::cond).map(|d| self.expr(d)), span }
    }

    fn test_body(&mut self, kids: &mut Kids) -> Block {
        self.in_test = true;
        let body = self.block_in(kids);
        self.in_test = false;
        body
    }

    fn use_item(&mut self, kids: &mut Kids) -> ItemKind {
        let path = self.path_in(kids);
        let names = self.names(kids.all(Rule::ident));
        ItemKind::Use { path, names: Some(names).filter(|n| !n.is_empty()) }
    }

    fn unit_name(&self, node: &Node) -> UnitText {
        UnitText { text: node.as_str().to_owned(), span: self.span(node) }
    }

    fn unit_item(&mut self, kids: &mut Kids) -> ItemKind {
        let Some(name) = kids.eat(Rule::uname) else { return ItemKind::Error };
        let name = self.unit_name(&name);
        let dimension = kids.eat(Rule::ident).map(|d| self.name(&d));
        let definition = kids.eat(Rule::operand).map(|d| self.expr(d));
        let (mut origin, mut prefixes, mut aliases) = (None, false, Vec::new());
        while let Some(part) = kids.take() {
            let rule = part.as_rule();
            let kids = &mut Kids::of(part);
            match rule {
                Rule::unit_origin => origin = Some(self.expr_in(kids)),
                Rule::unit_prefixes => prefixes = true,
                _ => aliases.extend(kids.all(Rule::uname).iter().map(|n| self.unit_name(n))),
            }
        }
        ItemKind::Unit { name, dimension, definition, origin, prefixes, aliases }
    }

    fn labelled_claim(&mut self, node: Node) -> Labelled {
        let span = self.span(&node);
        let kids = &mut Kids::of(node);
        let value = self.expr_in(kids);
        kids.has(Rule::kw_of);
        Labelled { value, species: self.name_in(kids), tolerance: kids.eat(Rule::operand).map(|t| self.expr(t)), span }
    }

    /// An item that could not be read; what is in its body is read all the same, for its mistakes.
    pub(super) fn bad_item(&mut self, node: Node, before: Option<usize>) -> ItemKind {
        self.mistakes.line(Rule::only_item, before, &node);
        for part in node.into_inner() {
            self.in_test = part.as_str().starts_with("test");
            let mut kids = Kids::of(part);
            while let Some(part) = kids.take() {
                match part.as_rule() {
                    Rule::block => drop(self.block(part)),
                    Rule::bad_handlers => drop(self.handlers_in(&mut Kids::of(part))),
                    _ => {}
                }
            }
            self.in_test = false;
        }
        ItemKind::Error
    }
}
