//! Labs, studies, fits and drivers: items made of lines of their own.

use matterix_ir::Span;

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use crate::ast::{
    AssetLiteral, Contents, Exchange, Expr, ExprKind, Fill, FitLine, Holding, ItemKind, LabLine, LabLineKind, Name,
    Path, Pattern, StudyLine, Text, Until, Wire, WireKind,
};

impl Lower<'_> {
    /// The lines of a body: `read` makes one of a form, `bad` one of what could not be read.
    pub(super) fn lines<T>(
        &mut self,
        body: Option<Node>,
        only: Rule,
        mut read: impl FnMut(&mut Self, Node, Span) -> T,
        mut bad: impl FnMut(&mut Self, Node, Span) -> Option<T>,
    ) -> Vec<T> {
        let mut lines = Vec::new();
        let mut kids = match body {
            Some(body) => Kids::of(body),
            None => return lines,
        };
        let mut before = None;
        while let Some(part) = kids.take() {
            let (start, span) = (part.as_span().start(), self.span(&part));
            match part.as_rule() {
                Rule::end | Rule::field_end => continue,
                Rule::bad_rest | Rule::bad_field_rest => self.mistakes.rest(only, before.unwrap_or(start), &part),
                rule if super::is_bad(rule) => {
                    self.mistakes.line(only, before, &part);
                    lines.extend(bad(self, part, span));
                }
                _ => lines.push(read(self, part, span)),
            }
            before = Some(start);
        }
        lines
    }

    pub(super) fn lab(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        let params = self.params_in(kids);
        let lines = self.lines(
            kids.eat(Rule::lab_body),
            Rule::only_lab_line,
            |this, node, span| LabLine { kind: this.lab_line(node), span },
            |this, node, span| Some(LabLine { kind: this.bad_lab_line(&node, span), span }),
        );
        ItemKind::Lab { name, params, lines }
    }

    fn lab_line(&mut self, node: Node) -> LabLineKind {
        let rule = node.as_rule();
        let kids = &mut Kids::of(node);
        match rule {
            Rule::setting => LabLineKind::Setting { name: self.name_in(kids), value: self.expr_in(kids) },
            Rule::instance => self.instance(kids),
            Rule::include => LabLineKind::Include {
                lab: self.path_in(kids),
                name: self.name_in(kids),
                relations: self.labelled_in(kids),
                options: self.options_in(kids),
            },
            Rule::between => {
                LabLineKind::Between { a: self.expr_in(kids), b: self.expr_in(kids), fields: self.fields_in(kids) }
            }
            _ => LabLineKind::Error,
        }
    }

    /// An instance whose line could not be read keeps its name and its type, so that its uses stay silent.
    fn bad_lab_line(&mut self, node: &Node, span: Span) -> LabLineKind {
        let start = node.as_span().start();
        let Some((name, rest)) = node.as_str().split_once('=') else { return LabLineKind::Error };
        let name = name.trim_end();
        let ty = rest.trim_start();
        let at = node.as_str().len() - ty.len();
        let ty_end = ty.find(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != ':').unwrap_or(ty.len());
        let ty = ty.get(..ty_end).unwrap_or_default();
        if !is_word(name) || !ty.split("::").all(is_word) {
            return LabLineKind::Error;
        }
        let mut segments = Vec::new();
        let mut offset = start + at;
        for segment in ty.split("::") {
            segments.push(Name { text: segment.to_owned(), span: self.place(offset, offset + segment.len()) });
            offset += segment.len() + 2;
        }
        let ty_span = self.place(start + at, start + at + ty.len());
        LabLineKind::Instance {
            name: Name { text: name.to_owned(), span: self.place(start, start + name.len()) },
            literal: AssetLiteral { ty: Path { segments, span: ty_span }, fields: Vec::new(), span: ty_span },
            relations: vec![(Name { text: "at".to_owned(), span }, self.error_expr(span))],
            holding: None,
        }
    }

    fn instance(&mut self, kids: &mut Kids) -> LabLineKind {
        let (name, literal) = (self.name_in(kids), self.literal_in(kids));
        let mut relations = self.labelled_in(kids);
        let contents = self.contents_in(kids);
        // After what is held the first `at` that is not a place says how warm that is.
        let mut behind = self.labelled_in(kids);
        let warm = behind.iter().position(|(label, e)| label.text == "at" && !is_place(e)).map(|i| behind.remove(i).1);
        relations.append(&mut behind);
        let holding = contents.map(|contents| Holding { contents, at: warm });
        LabLineKind::Instance { name, literal, relations, holding }
    }

    fn contents_in(&mut self, kids: &mut Kids) -> Option<Contents> {
        let mut kids = Kids::of(kids.eat(Rule::holding)?);
        Some(match kids.peek() {
            Some(Rule::fills) => Contents::Places(self.fills(kids.take())),
            _ => Contents::Expr(self.expr_in(&mut kids)),
        })
    }

    fn fills(&mut self, body: Option<Node>) -> Vec<Fill> {
        self.lines(
            body,
            Rule::only_fill,
            |this, node, _| {
                let kids = &mut Kids::of(node);
                let from = this.name_in(kids);
                let to = kids.eat(Rule::place).map(|n| this.name(&n));
                let value = this.expr_in(kids);
                let at = kids.eat(Rule::fill_at).map(|node| {
                    let kids = &mut Kids::of(node);
                    kids.has(Rule::kw_at);
                    this.expr_in(kids)
                });
                Fill { from, to, value, at }
            },
            |_, _, _| None,
        )
    }

    pub(super) fn study(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        kids.has(Rule::kw_of);
        let of = self.path_in(kids);
        let lines = self.lines(
            kids.eat(Rule::study_body),
            Rule::only_study_line,
            |this, node, _| this.study_line(node),
            |_, _, span| Some(StudyLine::Error(span)),
        );
        ItemKind::Study { name, of, lines }
    }

    fn study_line(&mut self, node: Node) -> StudyLine {
        let (rule, span) = (node.as_rule(), self.span(&node));
        let kids = &mut Kids::of(node);
        match rule {
            Rule::vary => {
                let (path, range) = self.path_and_range(kids);
                let by = kids.eat(Rule::ident).map(|n| (self.name(&n), self.args_in(kids)));
                StudyLine::Vary { path, range, by }
            }
            Rule::runs => StudyLine::Runs(self.expr_in(kids)),
            Rule::report => StudyLine::Report { name: self.name_in(kids), value: self.expr_in(kids) },
            _ => StudyLine::Error(span),
        }
    }

    fn path_and_range(&mut self, kids: &mut Kids) -> (Expr, Expr) {
        (self.expr_in(kids), self.expr_in(kids))
    }

    pub(super) fn fit(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        kids.has(Rule::kw_of);
        let of = self.path_in(kids);
        let lines = self.lines(
            kids.eat(Rule::fit_body),
            Rule::only_fit_line,
            |this, node, _| this.fit_line(node),
            |_, _, span| Some(FitLine::Error(span)),
        );
        ItemKind::Fit { name, of, lines }
    }

    fn fit_line(&mut self, node: Node) -> FitLine {
        let (rule, span) = (node.as_rule(), self.span(&node));
        let kids = &mut Kids::of(node);
        match rule {
            Rule::fit_data => FitLine::Data(self.quoted_in(kids)),
            Rule::estimate => {
                let (path, range) = self.path_and_range(kids);
                FitLine::Estimate { path, range, log: kids.has(Rule::kw_log) }
            }
            Rule::match_ => {
                let value = self.expr_in(kids);
                let column = self.quoted_in(kids);
                let unit = kids.eat(Rule::as_unit).and_then(|n| Kids::of(n).eat(Rule::unit)).map(|u| self.unit(&u));
                let noise = kids.eat(Rule::operand).map(|n| self.expr(n));
                FitLine::Match { value, column, unit, noise }
            }
            _ => FitLine::Error(span),
        }
    }

    pub(super) fn driver(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        let device = self.path_in(kids);
        let transport = self.name_in(kids);
        let args = self.args_in(kids);
        let outside = std::mem::replace(&mut self.on_line, true);
        let wires = self.lines(
            kids.eat(Rule::wires),
            Rule::only_wire,
            |this, node, span| Wire { kind: this.wire(node), span },
            |_, _, span| Some(Wire { kind: WireKind::Error, span }),
        );
        self.on_line = outside;
        ItemKind::Driver { name, device, transport, args, wires }
    }

    fn wire(&mut self, node: Node) -> WireKind {
        let (rule, span) = (node.as_rule(), self.span(&node));
        let kids = &mut Kids::of(node);
        match rule {
            Rule::wire_fixed => {
                let when = kids.eat(Rule::wire_when).map(|n| self.name(&n));
                let (when, condition) = (when.unwrap_or_else(|| nameless(span)), self.while_in(kids));
                WireKind::Fixed { when, condition, exchange: self.exchange(kids) }
            }
            Rule::wire_alive | Rule::wire_repeat => {
                kids.has(Rule::kw_while);
                let (condition, every) = self.path_and_range(kids);
                let within = (rule == Rule::wire_alive).then(|| self.expr_in(kids));
                let by = self.verb_in(kids);
                WireKind::Alive { condition, every, within, by, otherwise: self.verb_in(kids) }
            }
            Rule::wire_reply => WireKind::Reply { text: self.text_in(kids), fails: self.name_in(kids) },
            Rule::wire_answers => WireKind::Answers {
                asked: kids.eat(Rule::string).map(|s| self.pattern(&s)).unwrap_or_else(|| silence(span)),
                with: self.said(kids, span),
            },
            Rule::wire_hears => WireKind::Hears {
                path: self.path_in(kids),
                condition: self.while_in(kids),
                text: kids.eat(Rule::string).map(|s| self.pattern(&s)).unwrap_or_else(|| silence(span)),
                every: self.expr_in(kids),
            },
            Rule::wire_ignores => WireKind::Ignores {
                text: kids.eat(Rule::string).map(|s| self.pattern(&s)).unwrap_or_else(|| silence(span)),
            },
            Rule::wire_reading => WireKind::Reading {
                path: self.path_in(kids),
                condition: self.while_in(kids),
                asks: self.said(kids, span),
                expects: kids.eat(Rule::string).map(|s| self.pattern(&s)).unwrap_or_else(|| silence(span)),
            },
            Rule::wire_command => WireKind::Command { sig: self.sig_in(kids), exchange: self.exchange(kids) },
            _ => WireKind::Error,
        }
    }

    fn while_in(&mut self, kids: &mut Kids) -> Option<Expr> {
        let kids = &mut Kids::of(kids.eat(Rule::wire_while)?);
        kids.has(Rule::kw_while);
        Some(self.expr_in(kids))
    }

    fn verb_in(&mut self, kids: &mut Kids) -> Vec<Name> {
        let Some(node) = kids.eat(Rule::verb) else { return Vec::new() };
        Kids::of(node).all(Rule::ident).iter().map(|n| self.name(n)).collect()
    }

    fn exchange(&mut self, kids: &mut Kids) -> Exchange {
        let sends = kids.eat(Rule::sends).map(|node| Kids::of(node).all(Rule::string));
        let sends = sends.unwrap_or_default().iter().map(|s| self.filled(s)).collect();
        let replies = kids.eat(Rule::replies).map(|node| Kids::of(node).all(Rule::string)).unwrap_or_default();
        let mut replies = replies.iter().map(|s| self.pattern(s));
        let expects = replies.next();
        let then = replies.collect();
        let until = kids.eat(Rule::wire_until).map(|node| {
            let span = self.span(&node);
            let kids = &mut Kids::of(node);
            kids.has(Rule::kw_until);
            let (asks, expects) = (self.said(kids, span), self.answer(kids));
            Box::new(Until { asks, expects, timeout: self.expr_in(kids) })
        });
        Exchange { sends, expects, then, until }
    }

    fn answer(&mut self, kids: &mut Kids) -> Option<Pattern> {
        let node = kids.eat(Rule::answer)?;
        Kids::of(node).eat(Rule::string).map(|s| self.pattern(&s))
    }

    fn pattern(&mut self, node: &Node) -> Pattern {
        Pattern { text: self.text(node), span: self.span(node) }
    }

    fn said(&mut self, kids: &mut Kids, span: Span) -> Text {
        self.filled_in(kids).unwrap_or(Text { parts: Vec::new(), span })
    }
}

/// Whether an expression is written as a place: several coordinates in brackets.
fn is_place(e: &Expr) -> bool {
    matches!(&*e.kind, ExprKind::Tuple(items, _) if items.len() > 1)
}

fn nameless(span: Span) -> Name {
    Name { text: String::new(), span }
}

fn silence(span: Span) -> Pattern {
    Pattern { text: String::new(), span }
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}
