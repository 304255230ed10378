//! Paths, types, parameters and signatures.

use matterix_ir::{Diagnostic, codes};

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use crate::ast::{Binary, Expr, ExprKind, Param, Path, Sig, Type};

/// The deepest `A<B<C>>`.
const MAX_ARGUMENTS: usize = 16;

impl Lower<'_> {
    pub(super) fn path(&self, node: &Node) -> Path {
        let segments = self.names(Kids::of(node.clone()).all(Rule::ident));
        Path { segments, span: self.span(node) }
    }

    pub(super) fn path_in(&self, kids: &mut Kids) -> Path {
        kids.eat(Rule::path)
            .map_or_else(|| Path { segments: Vec::new(), span: self.place(0, 0) }, |node| self.path(&node))
    }

    pub(super) fn paths(&self, nodes: Vec<Node>) -> Vec<Path> {
        nodes.iter().map(|node| self.path(node)).collect()
    }

    pub(super) fn ty(&mut self, node: Node) -> Type {
        let span = self.span(&node);
        let closing = node.clone().into_inner().filter(|p| p.as_rule() == Rule::rangle).count();
        let mut kids = Kids::of(node);
        if let Some(words) = kids.eat(Rule::words) {
            let words = self.names(Kids::of(words).all(Rule::state_name));
            return Type { paths: Vec::new(), words, argument: None, optional: false, condition: None, span };
        }
        let mut paths = self.both(&mut kids);
        let mut arguments = Vec::new();
        while kids.has(Rule::langle) {
            arguments.push(self.both(&mut kids));
        }
        if arguments.len() != closing || arguments.len() > MAX_ARGUMENTS {
            self.report(
                Diagnostic::error(codes::SYNTAX, span, "`<` and `>` of this type do not match", "here")
                    .help("write for example `Range<Temperature>`"),
            );
            arguments.truncate(MAX_ARGUMENTS);
        }
        paths.extend(self.paths(kids.all(Rule::path)));
        let optional = kids.has(Rule::question);
        let condition = kids.eat(Rule::cond).map(|c| self.expr(c));
        let argument = arguments.into_iter().rev().fold(None, |inner, paths| {
            let span = paths.first().zip(paths.last()).map_or(span, |(first, last)| first.span.to(last.span));
            Some(Box::new(Type { paths, words: Vec::new(), argument: inner, optional: false, condition: None, span }))
        });
        Type { paths, words: Vec::new(), argument, optional, condition, span }
    }

    /// `A & B`, as far as it goes: what follows it is read by others.
    fn both(&mut self, kids: &mut Kids) -> Vec<Path> {
        let mut paths = Vec::new();
        while let Some(path) = kids.eat(Rule::path) {
            paths.push(self.path(&path));
            kids.has(Rule::amp);
        }
        paths
    }

    /// The parameters of the group that stands next; none where there is no group.
    pub(super) fn params_in(&mut self, kids: &mut Kids) -> Vec<Param> {
        let Some(group) = kids.eat(Rule::params).or_else(|| kids.eat(Rule::group_params)) else { return Vec::new() };
        let mut kids = Kids::of(group);
        let mut params = kids.all(Rule::param);
        params.extend(kids.all(Rule::group_param));
        params.into_iter().map(|p| self.param(p)).collect()
    }

    pub(super) fn param(&mut self, node: Node) -> Param {
        let mut kids = Kids::of(node);
        let name = self.name_in(&mut kids);
        let mut ty = kids.eat(Rule::ty).map(|t| self.ty(t));
        if let (Some(Rule::operand), Some(ty)) = (kids.peek(), &mut ty) {
            // `n: Int in 1 .. 96` is `n: Int where n in 1 .. 96`.
            let allowed = self.expr_in(&mut kids);
            let span = name.span.to(allowed.span);
            let value = Expr { kind: Box::new(ExprKind::Name(name.clone())), span: name.span };
            ty.condition.get_or_insert(Expr { kind: Box::new(ExprKind::Binary(Binary::In, value, allowed)), span });
        }
        let of = kids.has(Rule::kw_of).then(|| self.name_in(&mut kids));
        let default = kids.eat(Rule::cond).map(|c| self.expr(c));
        Param { name, ty, of, default }
    }

    pub(super) fn sig_in(&mut self, kids: &mut Kids) -> Sig {
        let Some(node) = kids.eat(Rule::sig) else {
            return Sig {
                verb: Vec::new(),
                params: Vec::new(),
                labelled: Vec::new(),
                result: None,
                span: self.place(0, 0),
            };
        };
        let span = self.span(&node);
        let mut kids = Kids::of(node);
        let verb = kids.eat(Rule::verb).map_or_else(Vec::new, |verb| {
            let mut words = Kids::of(verb);
            let mut nodes = words.all(Rule::returning);
            nodes.extend(words.all(Rule::ident));
            self.names(nodes)
        });
        let params = self.params_in(&mut kids);
        let labelled = kids
            .all(Rule::sig_group)
            .into_iter()
            .map(|group| {
                let mut kids = Kids::of(group);
                (self.name_in(&mut kids), self.params_in(&mut kids))
            })
            .collect();
        let result = kids.eat(Rule::ty).map(|t| self.ty(t));
        Sig { verb, params, labelled, result, span }
    }
}
