//! Blocks and the steps in them.

use matterix_ir::{Diagnostic, Span, codes};

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
        scan::first_word,
        spot::meant_step,
    },
    Lower,
    laws::assign_op,
};
use crate::ast::{Block, Call, Expr, ExprKind, Handlers, Name, Path, Stmt, StmtKind};

/// Whether what stands before a node ends with a brace.
fn closed_before(node: &Node) -> bool {
    let span = node.as_span();
    span.get_input().get(..span.start()).is_some_and(|text| text.trim_end().ends_with('}'))
}

impl Lower<'_> {
    pub(super) fn block_in(&mut self, kids: &mut Kids) -> Block {
        kids.eat(Rule::block).map_or_else(Block::default, |node| self.block(node))
    }

    pub(super) fn block(&mut self, node: Node) -> Block {
        let span = self.span(&node);
        let mut stmts = Vec::new();
        let mut kids = Kids::of(node);
        let mut before = None;
        // Whether the rest of a line was found to be wrong already: one mistake is one finding.
        let mut told = false;
        while let Some(part) = kids.take() {
            let start = part.as_span().start();
            let was_told = std::mem::take(&mut told);
            match part.as_rule() {
                Rule::end => continue,
                Rule::beside if closed_before(&part) => continue,
                Rule::beside => {
                    self.mistakes.rest(Rule::only_stmt, before.unwrap_or(start), &part);
                    told = true;
                }
                Rule::bad_rest => self.mistakes.rest(Rule::only_stmt, before.unwrap_or(start), &part),
                Rule::bad_stmt => stmts.push(self.bad_stmt(part, before, was_told)),
                _ => {
                    let span = self.span(&part);
                    let kind = self.stmt(part);
                    stmts.push(Stmt { kind, span });
                }
            }
            before = Some(start);
        }
        Block { stmts, span }
    }

    /// A step that could not be read: its readable blocks stay, its `let` keeps the name.
    fn bad_stmt(&mut self, node: Node, before: Option<usize>, told: bool) -> Stmt {
        let span = self.span(&node);
        if !told {
            self.mistakes.line(Rule::only_stmt, before, &node);
        }
        let name = let_name(node.as_str()).map(|(at, text)| {
            let start = node.as_span().start() + at;
            Name { text: text.to_owned(), span: self.place(start, start + text.len()) }
        });
        let blocks: Vec<Block> = Kids::of(node).all(Rule::block).into_iter().map(|b| self.block(b)).collect();
        let kind = match name {
            Some(name) => StmtKind::Let { name, ty: None, value: self.error_expr(span) },
            None if blocks.is_empty() => StmtKind::Error,
            None => {
                let mut stmts = vec![Stmt { kind: StmtKind::Error, span }];
                stmts.extend(blocks.into_iter().flat_map(|b| b.stmts));
                StmtKind::Sequence { body: Block { stmts, span }, handlers: Handlers::default() }
            }
        };
        Stmt { kind, span }
    }

    pub(super) fn handlers_in(&mut self, kids: &mut Kids) -> Handlers {
        kids.eat(Rule::handlers).map_or_else(Handlers::default, |node| self.handlers(node))
    }

    pub(super) fn handlers(&mut self, node: Node) -> Handlers {
        let mut handlers = Handlers::default();
        let mut kids = Kids::of(node);
        while let Some(part) = kids.take() {
            let rule = part.as_rule();
            let mut kids = Kids::of(part);
            if rule == Rule::finally {
                handlers.finally = Some(self.block_in(&mut kids));
            } else {
                let name = self.name_in(&mut kids);
                handlers.on.push((name, self.block_in(&mut kids)));
            }
        }
        handlers
    }

    /// `paralel { heat plate to 60 degC }`: what reads as options and is none. The slip is reported, not what it leads to.
    fn is_slip_before_block(&mut self, call: &Node) -> bool {
        let is_option = |part: &Node| matches!(part.as_rule(), Rule::named | Rule::field_end);
        let options = Kids::of(call.clone()).find(Rule::options);
        if options.is_none_or(|options| Kids::of(options).rest().iter().all(is_option)) {
            return false;
        }
        let text = call.as_str();
        let word = first_word(text);
        let rest = text.find('{').and_then(|brace| text.get(word.len()..=brace));
        let Some(meant) = rest.and_then(|rest| meant_step(word, rest)) else { return false };
        let start = call.as_span().start();
        let place = self.place(start, start + word.len());
        let headline = format!("`{word}` does not start a step");
        let slip = Diagnostic::error(codes::SYNTAX, place, headline, format!("did you mean `{meant}`?"));
        self.mistakes.push(slip.guess(format!("write `{meant}`"), place, meant));
        true
    }

    fn stmt(&mut self, node: Node) -> StmtKind {
        let rule = node.as_rule();
        if rule == Rule::call {
            if self.is_slip_before_block(&node) {
                return StmtKind::Error;
            }
            let call = self.call(node);
            return if self.in_test { run_of(call) } else { StmtKind::Call(call) };
        }
        let kids = &mut Kids::of(node);
        match rule {
            Rule::let_ => self.let_stmt(kids),
            Rule::var_ => {
                let name = self.name_in(kids);
                let ty = kids.eat(Rule::ty).map(|t| self.ty(t));
                StmtKind::Var { name, ty, value: self.expr_in(kids) }
            }
            Rule::set_ => {
                let name = self.name_in(kids);
                let Some(op) = assign_op(kids) else { return StmtKind::Error };
                StmtKind::Set { name, op, value: self.expr_in(kids) }
            }
            Rule::wait => self.wait(kids),
            Rule::step => {
                StmtKind::Step { name: self.name_in(kids), body: self.block_in(kids), handlers: self.handlers_in(kids) }
            }
            Rule::if_ => self.if_stmt(kids),
            Rule::repeat if kids.has(Rule::kw_while) => {
                let cond = self.expr_in(kids);
                let max = kids.eat(Rule::operand).map(|m| self.expr(m));
                StmtKind::RepeatWhile { cond, max, body: self.block_in(kids) }
            }
            Rule::repeat => StmtKind::Repeat { times: self.expr_in(kids), body: self.block_in(kids) },
            Rule::for_ => StmtKind::For { var: self.name_in(kids), set: self.expr_in(kids), body: self.block_in(kids) },
            Rule::within => StmtKind::Within {
                limit: self.expr_in(kids),
                since: self.expr_in(kids),
                body: self.block_in(kids),
                handlers: self.handlers_in(kids),
            },
            Rule::hold => StmtKind::Hold {
                cond: self.expr_in(kids),
                duration: self.expr_in(kids),
                timeout: self.timeout_in(kids),
                handlers: self.handlers_in(kids),
            },
            Rule::keep => {
                StmtKind::Keep { cond: self.expr_in(kids), body: self.block_in(kids), handlers: self.handlers_in(kids) }
            }
            Rule::try_ => {
                let alternatives = kids.all(Rule::block).into_iter().map(|b| self.block(b)).collect();
                StmtKind::Try { alternatives, handlers: self.handlers_in(kids) }
            }
            Rule::retry => StmtKind::Retry { times: self.expr_in(kids) },
            Rule::claim => {
                let assets = kids.all(Rule::operand).into_iter().map(|a| self.expr(a)).collect();
                StmtKind::Claim { assets, body: self.block_in(kids) }
            }
            Rule::sequence => StmtKind::Sequence { body: self.block_in(kids), handlers: self.handlers_in(kids) },
            Rule::parallel => StmtKind::Parallel { body: self.block_in(kids), handlers: self.handlers_in(kids) },
            Rule::start => {
                let name = self.name_in(kids);
                StmtKind::Start { name, body: self.started(kids) }
            }
            Rule::await_ => StmtKind::Await { name: self.name_in(kids) },
            Rule::fail => {
                let name = kids.eat(Rule::word).map(|w| self.name(&w));
                StmtKind::Fail { name, text: self.filled_in(kids) }
            }
            Rule::expect => StmtKind::Expect { cond: self.expr_in(kids) },
            Rule::record => StmtKind::Record { value: self.expr_in(kids), every: self.expr_in(kids) },
            Rule::note => self.filled_in(kids).map_or(StmtKind::Error, StmtKind::Note),
            Rule::ask => self.filled_in(kids).map_or(StmtKind::Error, StmtKind::Ask),
            Rule::return_ => StmtKind::Return { value: self.expr_in(kids) },
            _ => StmtKind::Error,
        }
    }

    fn let_stmt(&mut self, kids: &mut Kids) -> StmtKind {
        let name = self.name_in(kids);
        if let Some(call) = kids.eat(Rule::call) {
            return StmtKind::LetDo { name, call: self.call(call) };
        }
        let ty = kids.eat(Rule::ty).map(|t| self.ty(t));
        StmtKind::Let { name, ty, value: self.expr_in(kids) }
    }

    fn wait(&mut self, kids: &mut Kids) -> StmtKind {
        if !kids.has(Rule::kw_until) {
            return StmtKind::Wait { duration: self.expr_in(kids) };
        }
        let cond = self.expr_in(kids);
        StmtKind::WaitUntil { cond, timeout: self.timeout_in(kids), handlers: self.handlers_in(kids) }
    }

    fn timeout_in(&mut self, kids: &mut Kids) -> Option<Expr> {
        let node = kids.eat(Rule::timeout)?;
        Some(self.expr_in(&mut Kids::of(node)))
    }

    /// `else if` is an `else` of one `if`.
    fn if_stmt(&mut self, kids: &mut Kids) -> StmtKind {
        let mut branches: Vec<(Expr, Block)> = Vec::new();
        while let Some(cond) = kids.eat(Rule::cond) {
            let cond = self.expr(cond);
            branches.push((cond, self.block_in(kids)));
        }
        let mut otherwise = kids.eat(Rule::block).map(|b| self.block(b));
        if let Some((cond, _)) = branches.get(super::MAX_BRANCHES) {
            self.too_many_branches(cond.span);
            branches.truncate(super::MAX_BRANCHES);
        }
        while let Some((cond, then)) = branches.pop() {
            let span = otherwise.iter().fold(cond.span.to(then.span), |span, block| span.to(block.span));
            let kind = StmtKind::If { cond, then, otherwise };
            if branches.is_empty() {
                return kind;
            }
            otherwise = Some(Block { stmts: vec![Stmt { kind, span }], span });
        }
        StmtKind::Error
    }

    fn started(&mut self, kids: &mut Kids) -> Block {
        let Some(node) = kids.eat(Rule::call) else { return self.block_in(kids) };
        let call = self.call(node);
        let span = call.span;
        Block { stmts: vec![Stmt { kind: StmtKind::Call(call), span }], span }
    }

    fn call(&mut self, node: Node) -> Call {
        let span = self.span(&node);
        let mut kids = Kids::of(node);
        let mut words = Vec::new();
        for word in kids.all(Rule::bare_word) {
            words.push(self.name_in(&mut Kids::of(word)));
        }
        let object = kids.eat(Rule::operand).map(|o| self.expr(o));
        let labelled = self.labelled_in(&mut kids);
        Call { words, object, labelled, options: self.options_in(&mut kids), span }
    }

    /// `to 80 degC by panda`.
    pub(super) fn labelled_in(&mut self, kids: &mut Kids) -> Vec<(Name, Expr)> {
        let mut labelled = Vec::new();
        for node in kids.all(Rule::labelled) {
            let mut kids = Kids::of(node);
            let label = self.name_in(&mut kids);
            labelled.push((label, self.expr_in(&mut kids)));
        }
        labelled
    }

    /// The text that stands next.
    pub(super) fn text_in(&mut self, kids: &mut Kids) -> String {
        kids.eat(Rule::string).map_or_else(String::new, |node| self.text(&node))
    }

    /// The same with its place.
    pub(super) fn quoted_in(&mut self, kids: &mut Kids) -> Name {
        let Some(node) = kids.eat(Rule::string) else { return Name { text: String::new(), span: Span::default() } };
        Name { text: self.text(&node), span: self.span(&node) }
    }
}

/// The name after `let`, and where it starts.
fn let_name(text: &str) -> Option<(usize, &str)> {
    let rest = text.strip_prefix("let")?;
    let word = rest.strip_prefix([' ', '\t'])?.trim_start();
    let at = text.len() - word.len();
    let end = word.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(word.len());
    let name = word.get(..end).filter(|n| n.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'))?;
    Some((at, name))
}

/// In a test, `run WORKFLOW { name: value }` runs a workflow.
fn run_of(mut call: Call) -> StmtKind {
    if call.words.first().is_none_or(|w| w.text != "run") || !call.labelled.is_empty() {
        return StmtKind::Call(call);
    }
    let path = match (&call.object, call.words.get(1), call.words.len()) {
        (None, Some(name), 2) => Some(Path { segments: vec![name.clone()], span: name.span }),
        (Some(object), None, _) => path_of(object),
        _ => None,
    };
    match path {
        Some(workflow) => StmtKind::Run { workflow, options: std::mem::take(&mut call.options) },
        None => StmtKind::Call(call),
    }
}

/// `module::name` and `a.b` as a path.
fn path_of(expr: &Expr) -> Option<Path> {
    match &*expr.kind {
        ExprKind::Scoped(path) => Some(path.clone()),
        ExprKind::Name(name) => Some(Path { segments: vec![name.clone()], span: name.span }),
        ExprKind::Member(of, name) => {
            let mut path = path_of(of)?;
            path.segments.push(name.clone());
            path.span = expr.span;
            Some(path)
        }
        _ => None,
    }
}
