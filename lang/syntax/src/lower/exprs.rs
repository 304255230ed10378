//! Operands and what stands inside them.

use matterix_ir::{Diagnostic, codes};

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower, MAX_DEPTH,
};
use crate::ast::{Arg, Binary, Expr, ExprKind, Field, Name, NamedExpr, Path, UnitText};

impl Lower<'_> {
    /// The expression that stands next; an error node where there is none.
    pub(super) fn expr_in(&mut self, kids: &mut Kids) -> Expr {
        match kids.take() {
            Some(node) => self.expr(node),
            None => self.error_expr(self.place(0, 0)),
        }
    }

    /// A `cond`, `operand`, `quantity` or another expression rule.
    pub(super) fn expr(&mut self, node: Node) -> Expr {
        let span = self.span(&node);
        let kind = match node.as_rule() {
            Rule::cond | Rule::operand => return self.chain(node),
            Rule::atom => return self.atom(node),
            Rule::quantity => self.quantity(node),
            Rule::string => ExprKind::Text(self.text(&node)),
            Rule::tuple => return self.tuple(node),
            Rule::list => {
                let parts = Kids::of(node).all(Rule::cond);
                ExprKind::List(parts.into_iter().map(|part| self.expr(part)).collect())
            }
            Rule::ident | Rule::charged | Rule::species | Rule::state_word => ExprKind::Name(self.name(&node)),
            _ => ExprKind::Error,
        };
        Expr { kind: Box::new(kind), span }
    }

    /// Runs `inside` with `levels` more above it; an error node where the tree would get too deep.
    pub(super) fn deeper(&mut self, levels: usize, node: &Node, inside: impl FnOnce(&mut Self) -> Expr) -> Expr {
        if self.depth + levels > MAX_DEPTH {
            let span = self.span(node);
            self.report(
                Diagnostic::error(
                    codes::SYNTAX,
                    span,
                    "this expression is too long",
                    "too many operators in one expression",
                )
                .help("split it into named parts with `let`"),
            );
            return self.error_expr(span);
        }
        self.depth += levels;
        let expr = inside(self);
        self.depth -= levels;
        expr
    }

    fn quantity(&mut self, node: Node) -> ExprKind {
        let mut kids = Kids::of(node);
        let value = kids.eat(Rule::number).map_or(0.0, |n| self.number(&n));
        match kids.eat(Rule::unit) {
            Some(unit) => ExprKind::Quantity(value, self.unit(&unit)),
            None => ExprKind::Number(value),
        }
    }

    pub(super) fn number(&mut self, node: &Node) -> f64 {
        match node.as_str().parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => {
                let span = self.span(node);
                self.report(Diagnostic::error(codes::SYNTAX, span, "this number is too large", "beyond 1.8e308"));
                0.0
            }
        }
    }

    pub(super) fn unit(&self, node: &Node) -> UnitText {
        UnitText { text: node.as_str().to_owned(), span: self.span(node) }
    }

    /// The text between the quotes.
    pub(super) fn text(&mut self, node: &Node) -> String {
        let inner = node.as_str().trim_start_matches('"');
        let inner = inner.strip_suffix('"').unwrap_or(inner);
        let mut text = String::with_capacity(inner.len());
        self.unescape(inner, node.as_span().start() + 1, &mut text);
        text
    }

    /// Adds a piece of a text that starts at `start`, with what its escapes stand for.
    pub(super) fn unescape(&mut self, inner: &str, start: usize, text: &mut String) {
        let mut chars = inner.char_indices();
        while let Some((_, c)) = chars.next() {
            if c != '\\' {
                text.push(c);
                continue;
            }
            match chars.next() {
                Some((_, 'n')) => text.push('\n'),
                Some((_, 'r')) => text.push('\r'),
                Some((_, 't')) => text.push('\t'),
                Some((_, c @ ('"' | '\\'))) => text.push(c),
                Some((at, 'x')) if self.on_line => {
                    let code = inner.get(at + 1..at + 3).filter(|c| c.bytes().all(|b| b.is_ascii_hexdigit()));
                    match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
                        Some(code) if !matches!(code, b'{' | b'}') => {
                            text.push(char::from(code));
                            chars.nth(1);
                        }
                        code => {
                            let span = self.place(start + at - 1, start + at + 1);
                            let (headline, help) = match code {
                                Some(_) => ("a brace starts a value here", "write `{{` or `}}`"),
                                None => ("a byte needs two hexadecimal digits", "write it as in `\\x02`"),
                            };
                            self.report(Diagnostic::error(codes::SYNTAX, span, headline, "here").help(help));
                        }
                    }
                }
                Some((at, c)) => {
                    let span = self.place(start + at - 1, start + at + c.len_utf8());
                    self.report(
                        Diagnostic::error(codes::SYNTAX, span, format!("`\\{c}` has no meaning in a text"), "here")
                            .help(
                                "a text may contain `\\n`, `\\r`, `\\t`, `\\\"` and `\\\\`; a message to a device also a byte, `\\x02`",
                            )
                            .fix("write a backslash", span, format!("\\\\{c}")),
                    );
                    text.push('\\');
                    text.push(c);
                }
                None => text.push('\\'),
            }
        }
    }

    fn tuple(&mut self, node: Node) -> Expr {
        let span = self.span(&node);
        self.deeper(1, &node.clone(), |this| {
            let mut kids = Kids::of(node);
            let parts = kids.eat(Rule::tuple_body).map_or_else(Vec::new, |body| Kids::of(body).all(Rule::cond));
            let mut parts: Vec<Expr> = parts.into_iter().map(|part| this.expr(part)).collect();
            match kids.eat(Rule::unit) {
                None if parts.len() == 1 => Expr { span, ..parts.remove(0) },
                unit => {
                    let unit = unit.map(|u| this.unit(&u));
                    Expr { kind: Box::new(ExprKind::Tuple(parts, unit)), span }
                }
            }
        })
    }

    fn atom(&mut self, node: Node) -> Expr {
        let levels = node.clone().into_inner().count().saturating_sub(1);
        self.deeper(levels, &node.clone(), |this| this.postfixed(node))
    }

    fn postfixed(&mut self, node: Node) -> Expr {
        let start = node.as_span().start();
        let mut kids = Kids::of(node);
        let first = kids.take();
        let mut expr = match first {
            Some(first) if first.as_rule() == Rule::ident => self.word_or_path(first, &mut kids),
            Some(first) => self.expr(first),
            None => self.error_expr(self.place(start, start)),
        };
        while let Some(part) = kids.take() {
            let span = expr.span.to(self.span(&part));
            let kind = match part.as_rule() {
                Rule::member => ExprKind::Member(expr, self.name_in(&mut Kids::of(part))),
                Rule::args => self.call_or_fold(expr, part),
                Rule::index => self.index(expr, part),
                _ => ExprKind::Prime(expr),
            };
            expr = Expr { kind: Box::new(kind), span };
        }
        expr
    }

    fn word_or_path(&self, first: Node, kids: &mut Kids) -> Expr {
        let mut segments = vec![self.name(&first)];
        segments.extend(self.names(kids.all(Rule::ident)));
        let span = segments.iter().fold(self.span(&first), |span, s| span.to(s.span));
        let kind = match segments.len() {
            1 => ExprKind::Name(segments.remove(0)),
            _ => ExprKind::Scoped(Path { segments, span }),
        };
        Expr { kind: Box::new(kind), span }
    }

    fn index(&mut self, of: Expr, node: Node) -> ExprKind {
        let mut kids = Kids::of(node);
        match kids.take() {
            Some(word) if word.as_rule() == Rule::species => ExprKind::IndexWord(of, self.name(&word)),
            Some(range) if range.as_rule() == Rule::well_range => {
                let mut wells = Kids::of(range);
                let from = self.name_in(&mut wells);
                ExprKind::IndexRange(of, from, self.name_in(&mut wells))
            }
            Some(cond) => ExprKind::Index(of, self.expr(cond)),
            None => ExprKind::Error,
        }
    }

    /// `f(x, from: y)`, or `sum(s in set: body)`.
    fn call_or_fold(&mut self, of: Expr, node: Node) -> ExprKind {
        let args = Kids::of(node).all(Rule::arg);
        let mut lowered = Vec::with_capacity(args.len());
        for arg in args {
            let span = self.span(&arg);
            let mut kids = Kids::of(arg);
            let name = kids.eat(Rule::arg_name).map(|n| self.name_in(&mut Kids::of(n)));
            let value = self.expr_in(&mut kids);
            if let Some(body) = kids.eat(Rule::fold_body) {
                let body = self.expr_in(&mut Kids::of(body));
                match (*of.kind, *value.kind) {
                    (ExprKind::Name(fold), ExprKind::Binary(Binary::In, var, set)) if lowered.is_empty() => {
                        if let ExprKind::Name(var) = *var.kind {
                            return ExprKind::Fold { fold, var, set, body };
                        }
                    }
                    _ => {}
                }
                self.report(
                    Diagnostic::error(codes::SYNTAX, span, "`:` is not expected in this argument", "after a value")
                        .help("write a named argument as `name: value`, and a sum over a set as `sum(s in set: value of s)`"),
                );
                return ExprKind::Error;
            }
            lowered.push(Arg { name, value });
        }
        ExprKind::Call(of, lowered)
    }

    pub(super) fn args_in(&mut self, kids: &mut Kids) -> Vec<Arg> {
        let Some(node) = kids.eat(Rule::args) else { return Vec::new() };
        let nobody = Name { text: String::new(), span: self.span(&node) };
        let of = Expr { span: nobody.span, kind: Box::new(ExprKind::Name(nobody)) };
        match self.call_or_fold(of, node) {
            ExprKind::Call(_, args) => args,
            _ => Vec::new(),
        }
    }

    /// The options that stand next; none where there are none.
    pub(super) fn options_in(&mut self, kids: &mut Kids) -> Vec<NamedExpr> {
        let Some(node) = kids.eat(Rule::options) else { return Vec::new() };
        let mut options = Vec::new();
        let mut kids = Kids::of(node);
        let mut before = None;
        while let Some(part) = kids.take() {
            let start = part.as_span().start();
            match part.as_rule() {
                Rule::named => {
                    let mut kids = Kids::of(part);
                    let name = self.name_in(&mut kids);
                    options.push(NamedExpr { name, value: self.expr_in(&mut kids) });
                }
                Rule::field_end => continue,
                Rule::bad_field_rest => self.mistakes.rest(Rule::only_named, before.unwrap_or(start), &part),
                _ => self.mistakes.line(Rule::only_named, before, &part),
            }
            before = Some(start);
        }
        options
    }

    /// The value of a field that could not be read, under its key if that was readable.
    pub(super) fn bad_field(&mut self, rule: Rule, before: Option<usize>, node: &Node) -> Option<Field> {
        self.mistakes.line(rule, before, node);
        let text = node.as_str();
        let end = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(text.len());
        let start = node.as_span().start();
        let key = text.get(..end).filter(|key| !key.is_empty())?;
        if !text[end..].trim_start().starts_with(':') {
            return None;
        }
        let span = self.span(node);
        let key = Name { text: key.to_owned(), span: self.place(start, start + end) };
        Some(Field { key, value: crate::ast::FieldValue::Expr(self.error_expr(span)), span })
    }
}
