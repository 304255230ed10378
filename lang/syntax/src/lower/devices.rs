//! Capabilities with their members and clauses, assets and fields.

use super::{
    super::{
        cursor::{Kids, Node},
        grammar::Rule,
    },
    Lower,
};
use crate::ast::{
    AssetLine, AssetLiteral, At, Clause, ClauseKind, Effect, Expr, Field, FieldValue, Goal, Grid, ItemKind, Jointed,
    Manner, Member, MemberKind, Name, Path, Refusal, Role, Term, Way,
};

impl Lower<'_> {
    pub(super) fn capability(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        let extends = self.extends_in(kids);
        let source = self.source_in(kids);
        let members = self.lines(
            kids.eat(Rule::members),
            Rule::only_member,
            |this, node, span| {
                let docs = this.docs_before(node.as_span().start());
                Member { docs, kind: this.member(node), span }
            },
            |_, _, span| Some(Member { docs: Vec::new(), kind: MemberKind::Error, span }),
        );
        ItemKind::Capability { name, extends, source, members }
    }

    /// `from FORMAT "file"`.
    pub(super) fn source_in(&mut self, kids: &mut Kids) -> Option<(Name, Name)> {
        kids.eat(Rule::source).map(|node| {
            let kids = &mut Kids::of(node);
            let format = self.name_in(kids);
            let span = kids.peek_span().map_or(format.span, |(start, end)| self.place(start, end));
            (format, Name { text: self.text_in(kids), span })
        })
    }

    fn extends_in(&mut self, kids: &mut Kids) -> Vec<Path> {
        kids.eat(Rule::extends).map_or_else(Vec::new, |node| self.paths(Kids::of(node).all(Rule::path)))
    }

    fn member(&mut self, node: Node) -> MemberKind {
        let rule = node.as_rule();
        match rule {
            Rule::process => return MemberKind::Process(self.process(node)),
            Rule::event => return MemberKind::Event(self.event(node)),
            _ => {}
        }
        let kids = &mut Kids::of(node);
        match rule {
            Rule::value_member => self.value_member(kids),
            Rule::view => {
                let Some(param) = kids.eat(Rule::param) else { return MemberKind::Error };
                let param = self.param(param);
                let Some(ty) = kids.eat(Rule::ty) else { return MemberKind::Error };
                MemberKind::View { param, ty: self.ty(ty), value: self.expr_in(kids) }
            }
            Rule::command => MemberKind::Command { sig: self.sig_in(kids), clauses: self.clauses_in(kids) },
            Rule::limit => {
                kids.has(Rule::kw_keeps);
                let at_end = kids.has(Rule::kw_ends);
                let (cond, refusal) = self.demand(kids);
                MemberKind::Limit { at_end, cond, refusal }
            }
            Rule::frame_member => {
                MemberKind::Frame { name: self.name_in(kids), at: kids.eat(Rule::place_at).map(|n| self.at(n)) }
            }
            _ => MemberKind::Error,
        }
    }

    fn value_member(&mut self, kids: &mut Kids) -> MemberKind {
        let role = match kids.eat(Rule::role).map(|n| n.as_str()) {
            Some("param") => Role::Param,
            Some("state") => Role::State,
            Some("derived") => Role::Derived,
            Some("reading") => Role::Reading,
            Some("flow") => Role::Flow,
            Some("extensive") => Role::Extensive,
            Some("part") => Role::Part,
            _ => return MemberKind::Error,
        };
        let name = self.name_in(kids);
        let Some(ty) = kids.eat(Rule::ty) else { return MemberKind::Error };
        MemberKind::Value {
            role,
            name,
            ty: self.ty(ty),
            per: kids.eat(Rule::ident).map(|n| self.name(&n)),
            value: kids.eat(Rule::cond).map(|c| self.expr(c)),
            options: self.options_in(kids),
        }
    }

    pub(super) fn clauses_in(&mut self, kids: &mut Kids) -> Vec<Clause> {
        let mut clauses = Vec::new();
        let Some(node) = kids.eat(Rule::clauses) else { return clauses };
        let mut kids = Kids::of(node);
        let mut before = None;
        while let Some(part) = kids.take() {
            let (start, span) = (part.as_span().start(), self.span(&part));
            match part.as_rule() {
                Rule::bad_clause_rest => self.mistakes.rest(Rule::only_clause, before.unwrap_or(start), &part),
                Rule::bad_clause => self.mistakes.line(Rule::only_clause, before, &part),
                _ => clauses.extend(self.clause(part).map(|kind| Clause { kind, span })),
            }
            before = Some(start);
        }
        clauses
    }

    /// `COND else NAME "help" because "words"`.
    fn demand(&mut self, kids: &mut Kids) -> (Expr, Option<Refusal>) {
        let cond = self.expr_in(kids);
        let refusal = kids.eat(Rule::refusal).map(|node| {
            let kids = &mut Kids::of(node);
            let failure = self.name_in(kids);
            let help = kids.eat(Rule::string).map(|n| self.text(&n));
            let because = kids.has(Rule::kw_because).then(|| self.filled_in(kids)).flatten();
            Refusal { failure, help, because }
        });
        (cond, refusal)
    }

    fn clause(&mut self, node: Node) -> Option<ClauseKind> {
        let rule = node.as_rule();
        let mut inner = Kids::of(node);
        let kids = &mut inner;
        Some(match rule {
            Rule::needs => {
                let (cond, refusal) = self.demand(kids);
                ClauseKind::Needs { cond, refusal }
            }
            Rule::presumes => {
                let ever = kids.has(Rule::kw_ever);
                let (cond, refusal) = self.demand(kids);
                ClauseKind::Presumes { ever, cond, refusal }
            }
            Rule::warns => {
                kids.has(Rule::kw_warns);
                let (cond, refusal) = self.demand(kids);
                ClauseKind::Warns { cond, refusal }
            }
            Rule::while_ => {
                kids.has(Rule::kw_while);
                ClauseKind::While(self.expr_in(kids))
            }
            Rule::until => {
                kids.has(Rule::kw_until);
                ClauseKind::Until(self.expr_in(kids))
            }
            Rule::fails => ClauseKind::Fails(self.names(kids.all(Rule::word))),
            Rule::effect => {
                let changes = kids.all(Rule::change);
                ClauseKind::Effect(changes.into_iter().map(|change| self.effect(change)).collect())
            }
            Rule::takes => {
                ClauseKind::Takes { nominal: self.expr_in(kids), bounds: kids.eat(Rule::operand).map(|b| self.expr(b)) }
            }
            Rule::says => {
                ClauseKind::Says { text: self.filled_in(kids)?, when: kids.eat(Rule::cond).map(|c| self.expr(c)) }
            }
            Rule::moves => {
                let mover = self.expr_in(kids);
                let manner = kids.eat(Rule::manner).map_or(Manner::Free, |node| self.manner(node));
                let to = match (kids.has(Rule::kw_home), kids.has(Rule::kw_to)) {
                    (true, _) => Goal::Home,
                    (_, true) => match kids.eat(Rule::joints) {
                        Some(joints) => {
                            let kids = &mut Kids::of(joints);
                            kids.has(Rule::kw_joints);
                            Goal::Joints(self.expr_in(kids))
                        }
                        None => {
                            let at = self.expr_in(kids);
                            Goal::Frame { at, by: kids.eat(Rule::moves_by).map(|n| self.expr_in(&mut Kids::of(n))) }
                        }
                    },
                    _ => Goal::Shift(match kids.eat(Rule::moves_by) {
                        Some(by) => self.expr_in(&mut Kids::of(by)),
                        None => self.expr_in(kids),
                    }),
                };
                let within = kids.eat(Rule::moves_in).map(|n| self.expr_in(&mut Kids::of(n)));
                ClauseKind::Moves { mover, manner, to, within }
            }
            Rule::grips => {
                let item = self.expr_in(kids);
                let (at, by) = self.maybe_before(kids);
                ClauseKind::Grips { item, at, by }
            }
            Rule::leads => {
                let handle = self.expr_in(kids);
                ClauseKind::Leads { handle, by: self.expr_in(kids) }
            }
            Rule::frees => {
                let item = self.expr_in(kids);
                let (on, by) = self.maybe_before(kids);
                ClauseKind::Frees { item, on, by }
            }
            Rule::option => ClauseKind::Option(self.param(kids.eat(Rule::option_param)?)),
            _ => return None,
        })
    }

    fn manner(&mut self, node: Node) -> Manner {
        let kids = &mut Kids::of(node);
        if kids.has(Rule::kw_driving) {
            return Manner::Driving;
        }
        if kids.has(Rule::kw_upright) {
            return Manner::Upright(self.expr_in(kids));
        }
        if kids.has(Rule::kw_tilted) {
            let angle = self.expr_in(kids);
            kids.has(Rule::kw_about);
            return Manner::Tilted(angle, self.expr_in(kids));
        }
        Manner::Straight
    }

    /// An operand that may be left out before one that may not.
    fn maybe_before(&mut self, kids: &mut Kids) -> (Option<Expr>, Expr) {
        kids.has(Rule::kw_to);
        let first = self.expr_in(kids);
        match kids.eat(Rule::operand) {
            Some(second) => (Some(first), self.expr(second)),
            None => (None, first),
        }
    }

    fn effect(&mut self, node: Node) -> Effect {
        let kids = &mut Kids::of(node);
        if let Some(each) = kids.eat(Rule::each) {
            let kids = &mut Kids::of(each);
            kids.has(Rule::kw_each);
            let (var, set) = (self.name_in(kids), self.expr_in(kids));
            let changes = kids.all(Rule::change);
            return Effect::Each { var, set, effects: changes.into_iter().map(|c| self.effect(c)).collect() };
        }
        let target = self.expr_in(kids);
        match kids.eat(Rule::cond) {
            Some(value) => Effect::Assign(target, self.expr(value)),
            None => Effect::Call(target),
        }
    }

    pub(super) fn asset(&mut self, kids: &mut Kids) -> ItemKind {
        let name = self.name_in(kids);
        let extends = self.extends_in(kids);
        let source = self.source_in(kids);
        let lines = self.asset_lines(kids.eat(Rule::asset_body));
        ItemKind::Asset { name, extends, source, lines }
    }

    fn asset_lines(&mut self, body: Option<Node>) -> Vec<AssetLine> {
        let mut lines = Vec::new();
        let Some(body) = body else { return lines };
        let mut kids = Kids::of(body);
        let mut before = None;
        while let Some(part) = kids.take() {
            let (start, span, rule) = (part.as_span().start(), self.span(&part), part.as_rule());
            match rule {
                Rule::field_end => continue,
                Rule::bad_field_rest => self.mistakes.rest(Rule::only_asset_line, before.unwrap_or(start), &part),
                Rule::bad_field => {
                    let field = self.bad_field(Rule::only_asset_line, before, &part);
                    lines.push(field.map_or(AssetLine::Error(span), AssetLine::Field));
                }
                Rule::field => lines.push(AssetLine::Field(self.field(part))),
                Rule::grid => lines.push(AssetLine::Grid(self.grid(part))),
                Rule::solid => {
                    let kids = &mut Kids::of(part);
                    let shape = self.expr_in(kids);
                    lines.push(AssetLine::Solid { shape, at: kids.eat(Rule::place_at).map(|n| self.at(n)) });
                }
                Rule::joint => lines.push(AssetLine::Joint(Box::new(self.joint(part)))),
                Rule::frame => {
                    let kids = &mut Kids::of(part);
                    let name = self.name_in(kids);
                    let at = kids.eat(Rule::place_at).map(|n| self.at(n));
                    lines.push(at.map_or(AssetLine::Error(span), |at| AssetLine::Frame { name, at }));
                }
                _ => {
                    let kids = &mut Kids::of(part);
                    let name = self.name_in(kids);
                    lines.push(AssetLine::Part { name, literal: self.literal_in(kids) });
                }
            }
            before = Some(start);
        }
        lines
    }

    fn joint(&mut self, node: Node) -> Jointed {
        let kids = &mut Kids::of(node);
        let name = self.name_in(kids);
        let way = kids.eat(Rule::joint_way).map(|way| {
            let (slides, axis) = (way.as_str() == "slides", self.expr_in(kids));
            Way { slides, axis, at: kids.eat(Rule::place_at).map(|n| self.at(n)) }
        });
        Jointed { name, way, by: self.expr_in(kids) }
    }

    fn at(&mut self, node: Node) -> At {
        let kids = &mut Kids::of(node);
        let position = self.expr_in(kids);
        let from = kids.eat(Rule::ident).map(|n| self.name(&n));
        At { position, from, turned: kids.eat(Rule::operand).map(|n| self.expr(n)) }
    }

    fn grid(&mut self, node: Node) -> Grid {
        let kids = &mut Kids::of(node);
        let name = self.name_in(kids);
        let places = kids.eat(Rule::places).map_or_else(Vec::new, |n| Kids::of(n).all(Rule::place));
        let mut places = self.names(places).into_iter();
        let nowhere = Name { text: String::new(), span: name.span };
        let (from, to) = (places.next().unwrap_or(nowhere), places.next());
        let literal = self.literal_in(kids);
        let at = kids.eat(Rule::grid_at).map(|n| self.expr_in(&mut Kids::of(n)));
        let mut pitch = kids.eat(Rule::pitch).map(Kids::of);
        let (step, row) = match &mut pitch {
            Some(kids) => (Some(self.expr_in(kids)), kids.eat(Rule::operand).map(|row| self.expr(row))),
            None => (None, None),
        };
        Grid { name, from, to, literal, at, pitch: step, row }
    }

    pub(super) fn literal_in(&mut self, kids: &mut Kids) -> AssetLiteral {
        match kids.take() {
            Some(node) => self.literal(node),
            None => {
                let span = self.place(0, 0);
                AssetLiteral { ty: Path { segments: Vec::new(), span }, fields: Vec::new(), span }
            }
        }
    }

    fn literal(&mut self, node: Node) -> AssetLiteral {
        let span = self.span(&node);
        let kids = &mut Kids::of(node);
        AssetLiteral { ty: self.path_in(kids), fields: self.fields_in(kids), span }
    }

    /// The fields that stand next; none where there are none.
    pub(super) fn fields_in(&mut self, kids: &mut Kids) -> Vec<Field> {
        let Some(node) = kids.eat(Rule::fields) else { return Vec::new() };
        let mut fields = Vec::new();
        let mut kids = Kids::of(node);
        let mut before = None;
        while let Some(part) = kids.take() {
            let start = part.as_span().start();
            match part.as_rule() {
                Rule::field_end => continue,
                Rule::bad_field_rest => self.mistakes.rest(Rule::only_field, before.unwrap_or(start), &part),
                Rule::bad_field => fields.extend(self.bad_field(Rule::only_field, before, &part)),
                _ => fields.push(self.field(part)),
            }
            before = Some(start);
        }
        fields
    }

    fn field(&mut self, node: Node) -> Field {
        let span = self.span(&node);
        let start = node.as_span().start();
        let mut inner = Kids::of(node);
        let kids = &mut inner;
        let key = match kids.eat(Rule::key) {
            Some(key) => self.name_in(&mut Kids::of(key)),
            None => crate::ast::Name { text: DISSOLVES.to_owned(), span: self.place(start, start + DISSOLVES.len()) },
        };
        let value = match kids.peek() {
            Some(Rule::fields) => FieldValue::Fields(self.fields_in(kids)),
            Some(Rule::value_literal) => FieldValue::Literal(self.literal_in(kids)),
            Some(Rule::side) => FieldValue::Species(self.side_in(kids)),
            _ => FieldValue::Expr(self.expr_in(kids)),
        };
        Field { key, value, span }
    }

    /// Species with coefficients, joined by `+`.
    pub(super) fn side_in(&mut self, kids: &mut Kids) -> Vec<Term> {
        let Some(node) = kids.eat(Rule::side) else { return Vec::new() };
        let mut terms = Vec::new();
        for term in Kids::of(node).all(Rule::side_term) {
            let span = self.span(&term);
            let mut kids = Kids::of(term);
            let coefficient = kids.eat(Rule::number).map_or(1.0, |n| self.number(&n));
            terms.push(Term { coefficient, species: self.name_in(&mut kids), span });
        }
        terms
    }
}

/// The field whose value is a list of species.
const DISSOLVES: &str = "dissolves";
