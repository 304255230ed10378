//! Expressions, one construct at a time.

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, UnaryOp, codes};
use rustc_hash::FxHashMap;

use super::{Num, Scope, Value};
use crate::ast::{Binary, Expr, ExprKind, ItemKind, LabLineKind, Name, Unary, UnitText};
use crate::declare::ReactionId;
use crate::declare::units::unit_error;
use crate::eval::lab::Elaborator;
use crate::eval::lab::observed::Noting;
use crate::names::DeclId;
use crate::near;
use crate::units::Dimension;

/// What a set can be folded into.
const FOLDS: [&str; 6] = ["sum", "product", "min", "max", "all", "any"];

impl<'a> Elaborator<'a> {
    /// Evaluates an expression; what is wrong is reported and gives [`Value::Error`].
    pub fn expr(&mut self, e: &'a Expr, scope: &mut Scope) -> Value {
        let value = if self.enter(e.span) { self.evaluate(e, scope) } else { Value::Error };
        self.leave();
        if self.meanings.is_some() {
            self.note_value(e.span, &value);
        }
        value
    }

    fn evaluate(&mut self, e: &'a Expr, scope: &mut Scope) -> Value {
        match &*e.kind {
            ExprKind::Error => Value::Error,
            ExprKind::Number(v) => self.number(*v, Dimension::one(), true),
            ExprKind::Quantity(v, unit) => self.quantity(*v, unit),
            ExprKind::Text(t) => Value::Text(t.clone()),
            ExprKind::Name(n) => self.name_of(n, scope),
            ExprKind::Scoped(path) => match path.segments.last() {
                Some(n) => match self.tables.names.scoped(scope.module, path) {
                    Some(wrong) if scope.var(&n.text).is_none() => {
                        self.report(wrong);
                        Value::Error
                    }
                    _ => self.name_of(n, scope),
                },
                None => Value::Error,
            },
            ExprKind::Member(base, name) => {
                let base = self.expr(base, scope);
                self.member(base, name)
            }
            ExprKind::IndexWord(base, word) => {
                let base = self.expr(base, scope);
                self.index(base, word, scope)
            }
            ExprKind::IndexRange(base, a, b) => {
                let base = self.expr(base, scope);
                self.slice_named(base, a, b, scope)
            }
            ExprKind::Index(base, index) => {
                let base = self.expr(base, scope);
                match &*index.kind {
                    ExprKind::Name(word) => self.index(base, word, scope),
                    _ => self.index_number(base, index, scope),
                }
            }
            ExprKind::Call(callee, args) => self.call(callee, args, e.span, scope),
            ExprKind::Fold { fold, var, set, body } => self.fold(fold, var, set, body, scope),
            ExprKind::Prime(_) => {
                self.report(
                    Diagnostic::error(
                        codes::TYPE_MISMATCH,
                        e.span,
                        "a derivative cannot be read",
                        "only `+=` and `-=` on it",
                    )
                    .help("in a process, write `x' += rate`"),
                );
                Value::Error
            }
            ExprKind::Unary(Unary::Neg, inner) => self.negate(inner, scope),
            ExprKind::Unary(Unary::Not, inner) => {
                let value = self.truth(inner, scope);
                value.map_or(Value::Error, |n| Value::Bool(self.graph.unary(UnaryOp::Not, n)))
            }
            ExprKind::Binary(op, a, b) => self.binary(*op, a, b, e.span, scope),
            ExprKind::Of(inner, substance) => self.of(inner, substance, e.span, scope),
            ExprKind::Range(a, b) => {
                let (low, high) = (self.expr(a, scope), self.expr(b, scope));
                self.range(low, high, a.span, b.span)
            }
            ExprKind::As(inner, unit) => {
                let value = self.sum_as(inner, unit, scope);
                self.as_unit(value, unit, inner.span)
            }
            ExprKind::Tuple(items, unit) => self.tuple(items, unit.as_ref(), scope),
            ExprKind::List(items) => {
                let values = items.iter().map(|i| (self.expr(i, scope), i.span)).collect();
                self.list_of(values)
            }
        }
    }

    /// `[a, b]`. A grid is the list of its children; lists beside things are one list with these: `[plate.row(1), plate[A2]]`.
    pub fn list_of(&mut self, values: Vec<(Value, Span)>) -> Value {
        let values: Vec<_> = values.into_iter().map(|(value, span)| (self.listed(value), span)).collect();
        let lists = values.iter().filter(|(value, _)| matches!(value, Value::List(_))).count();
        let values = match lists {
            0 => values,
            all if all == values.len() => values,
            _ => {
                values.into_iter().flat_map(|(value, span)| value.flat().into_iter().map(move |v| (v, span))).collect()
            }
        };
        self.alike(&values);
        self.spend_on_items(values.len());
        Value::List(values.into_iter().map(|(value, _)| value).collect())
    }

    /// Reports the first element of a list that is of another kind than those before it.
    fn alike(&mut self, values: &[(Value, Span)]) {
        let mut first: Option<(&Value, Span)> = None;
        for (value, span) in values {
            let Some((one, at)) = first else {
                first = (*value != Value::Error).then_some((value, *span));
                continue;
            };
            let alike = match (one, value) {
                (_, Value::Error) => true,
                (Value::Num(a), Value::Num(b)) => {
                    let kelvin = |a: &Num, b: &Num| a.point && b.literal;
                    a.dimension.agrees(&b.dimension) && (a.point == b.point || kelvin(a, b) || kelvin(b, a))
                }
                (Value::Enum(_, a), Value::Enum(_, b)) => a == b,
                (Value::Nothing, _) | (_, Value::Nothing) => true,
                (a, b) => a.what() == b.what(),
            };
            if alike {
                continue;
            }
            let show = |this: &Self, v: &Value| match v {
                Value::Num(n) => this.describe(n),
                other => other.what().to_string(),
            };
            let (a, b) = (show(self, one), show(self, value));
            let code = if matches!((one, value), (Value::Num(_), Value::Num(_))) {
                codes::UNIT_MISMATCH
            } else {
                codes::TYPE_MISMATCH
            };
            let d = Diagnostic::error(code, *span, format!("a list of {a} cannot hold {b}"), format!("this is {b}"));
            self.report(d.because(at, format!("this is {a}")));
            return;
        }
    }

    /// A constant number.
    pub fn number(&mut self, value: f64, dimension: Dimension, literal: bool) -> Value {
        let node = self.graph.number(value);
        Value::Num(Num { node, dimension, point: false, unit: None, literal })
    }

    /// A number without a display unit.
    pub fn num(&self, node: matterix_ir::NodeId, dimension: Dimension) -> Value {
        Value::Num(Num { node, dimension, point: false, unit: None, literal: false })
    }

    fn quantity(&mut self, value: f64, unit: &UnitText) -> Value {
        match self.tables.unit(&unit.text) {
            Ok(r) => {
                let si = r.unit.to_si(value);
                if r.point && si < 0.0 {
                    return self.too_cold(unit.span);
                }
                let node = self.graph.number(si);
                let unit = Some(r.unit);
                Value::Num(Num { node, dimension: r.dimension, point: r.point, unit, literal: true })
            }
            Err(error) => {
                self.report(unit_error(unit, error));
                Value::Error
            }
        }
    }

    fn too_cold(&mut self, span: Span) -> Value {
        self.report(Diagnostic::error(
            codes::TEMPERATURE_POINT,
            span,
            "this temperature is below absolute zero",
            "impossible temperature",
        ));
        Value::Error
    }

    /// What a bare word stands for.
    pub fn name_of(&mut self, n: &Name, scope: &mut Scope) -> Value {
        if let Some(v) = scope.var(&n.text) {
            return v.clone();
        }
        match n.text.as_str() {
            "true" => return Value::Bool(self.graph.number(1.0)),
            "false" => return Value::Bool(self.graph.number(0.0)),
            "nothing" => return Value::Nothing,
            "unlimited" => return Value::Unlimited,
            "elapsed" => {
                let node = self.graph.add(Op::Time);
                let dimension =
                    self.tables.units.dimension("Duration").map_or_else(Dimension::any, |d| d.dimension.clone());
                return self.num(node, dimension);
            }
            "self" => {
                if let Some(this) = scope.this {
                    return Value::Instance(this);
                }
            }
            _ => {}
        }
        if let Some(this) = scope.this
            && self.has_member(this, &n.text)
        {
            return match self.own_member(this, scope.owner, &n.text) {
                Some(m) => self.member_value(this, m, n.span),
                None => self.member(Value::Instance(this), n),
            };
        }
        if let Some(value) = self.of_lab(&n.text, scope) {
            if let Value::Instance(id) = value {
                self.note_name(n.span, |lab| Some(lab.instances[id.0 as usize].span));
            }
            return value;
        }
        if let Some(value) = self.setting(&n.text) {
            return value;
        }
        if let Some(id) = self.lookup(scope.module, &n.text) {
            self.note_declared(n.span, id);
            return self.declared(id, n);
        }
        self.unknown_name(n, scope)
    }

    /// What a name that a module sees stands for. Those of laws are asked for again and again.
    pub fn lookup(&mut self, module: usize, name: &str) -> Option<DeclId> {
        if let Some(known) = self.looked_up.get(module).and_then(|of| of.get(name)) {
            return Some(*known);
        }
        let found = self.tables.names.lookup(module, name)?;
        if self.looked_up.len() <= module {
            self.looked_up.resize_with(module + 1, FxHashMap::default);
        }
        self.looked_up[module].insert(name.into(), found);
        Some(found)
    }

    /// What a name of the lab's text stands for: a parameter of the lab, an instance or an included lab.
    pub fn of_lab(&self, name: &str, scope: &Scope) -> Option<Value> {
        if !scope.lab {
            return None;
        }
        if !self.lab_values.is_empty()
            && let Some(value) = self.lab_values.get(&(self.within.clone(), name.to_string()))
        {
            return Some(value.clone());
        }
        if self.within.is_empty() {
            return self.lab_name_of(name);
        }
        self.lab_name_of(&format!("{}{name}", self.within))
    }

    /// The value of a declaration by its name.
    pub fn declared(&mut self, id: crate::names::DeclId, n: &Name) -> Value {
        let decl = self.tables.names.decl(id);
        match &decl.item.kind {
            ItemKind::Const { value, ty, .. } => {
                if let Some((name, at)) = self.ring(&self.open_consts, id) {
                    self.report(Diagnostic::error(
                        codes::CIRCULAR,
                        at,
                        format!("`{name}` is defined by itself"),
                        "needs its own value",
                    ));
                    return Value::Error;
                }
                if let Some(known) = self.known_consts.get(&id) {
                    return known.clone();
                }
                let reported = self.reported;
                self.open_consts.push(id);
                let mut scope = Scope::module(decl.module);
                let v = match ty {
                    Some(ty) => {
                        let ty = self.resolve_type(ty, decl.module);
                        self.typed(value, &ty, &mut scope, &n.text)
                    }
                    None => self.expr(value, &mut scope),
                };
                self.open_consts.pop();
                if self.reported == reported {
                    self.known_consts.insert(id, v.clone());
                }
                v
            }
            ItemKind::Table { rows, .. } => {
                self.tables_used.insert(id);
                match rows {
                    Some(table) => {
                        self.spend_on_items(table.rows.len());
                        Value::List((0..table.rows.len() as u32).map(|row| Value::Row(id, row)).collect())
                    }
                    None => Value::Error,
                }
            }
            ItemKind::Species { .. } => self.tables.species.of_decl(id).map_or(Value::Error, Value::Species),
            ItemKind::Reaction { name, .. } => {
                let position =
                    self.tables.reactions.iter().position(|r| r.name == name.text && r.module == decl.module);
                position.map_or(Value::Error, |i| Value::Reaction(crate::declare::ReactionId(i as u32)))
            }
            ItemKind::Solution { .. } => Value::Solution(id),
            ItemKind::Material { .. } => Value::Material(id),
            ItemKind::Capability { .. } | ItemKind::Asset { .. } => Value::Kind(id),
            ItemKind::Fn { .. } | ItemKind::Relation { .. } => Value::Function(id),
            _ => {
                self.report(Diagnostic::error(
                    codes::WRONG_KIND,
                    n.span,
                    format!("`{}` is not a value", n.text),
                    "not allowed in an expression",
                ));
                Value::Error
            }
        }
    }

    /// A lab of the module that has a thing of this name, and where that is declared.
    fn elsewhere(&self, n: &Name, scope: &Scope) -> Option<(String, Span)> {
        let names = self.tables.names;
        names.declared_by(scope.module).find_map(|id| {
            let ItemKind::Lab { name, lines, .. } = &names.decl(id).item.kind else { return None };
            let lines = lines.iter().filter(|_| name.span != self.lab_name);
            lines.into_iter().find_map(|line| match &line.kind {
                LabLineKind::Instance { name: thing, .. } if thing.text == n.text => {
                    Some((name.text.clone(), thing.span))
                }
                _ => None,
            })
        })
    }

    fn unknown_name(&mut self, n: &Name, scope: &Scope) -> Value {
        let mut candidates: Vec<String> = scope.vars.iter().map(|v| v.0.clone()).collect();
        candidates.extend(self.settings.keys().cloned());
        if let Some(this) = scope.this {
            candidates.extend(self.member_names(this));
        }
        if scope.lab {
            let inner = |n: &String| n.strip_prefix(self.within.as_str()).map(str::to_string);
            candidates.extend(self.instances.iter().filter(|i| i.owner.is_none()).filter_map(|i| inner(&i.name)));
            candidates.extend(self.included.iter().filter_map(inner));
        }
        let is_value = |k: &ItemKind| {
            matches!(
                k,
                ItemKind::Const { .. }
                    | ItemKind::Table { .. }
                    | ItemKind::Species { .. }
                    | ItemKind::Fn { .. }
                    | ItemKind::Solution { .. }
                    | ItemKind::Material { .. }
            )
        };
        let names = self.tables.names;
        let visible = names.visible(scope.module).filter(|(_, id)| is_value(&names.decl(*id).item.kind));
        candidates.extend(visible.map(|(n, _)| n.to_string()));
        if n.text == "ambient" {
            self.report(
                Diagnostic::error(
                    codes::MISSING_FIELD,
                    self.lab_name,
                    "the lab has no `ambient` temperature",
                    "needs `ambient`",
                )
                .because(n.span, "used here")
                .help("add `ambient: 22 degC` to the lab"),
            );
            self.settings.insert(n.text.clone(), Value::Error);
            return Value::Error;
        }
        let is_unit = self.tables.units.find(&n.text).is_some();
        let near = if is_unit { Vec::new() } else { near::nearest(&n.text, candidates) };
        let mut d = near::unknown(n, format!("unknown name `{}`", n.text), "not declared");
        if is_unit {
            d = d.help(format!("`{}` is a unit: write a unit as one word without blanks, such as `W/K`", n.text));
        }
        if let Some(import) = names.import_of(scope.module, &n.text, is_value).filter(|_| !is_unit) {
            self.report(import.offered(d));
            return Value::Error;
        }
        d = match self.elsewhere(n, scope) {
            Some((lab, span)) if scope.lab => d
                .because(span, format!("it is declared in the lab `{lab}`"))
                .help(format!("this is another lab than `{lab}`")),
            Some((lab, span)) => d
                .because(span, format!("it is declared in the lab `{lab}`"))
                .help("only workflows and tests see a lab: make it a parameter, and pass it in the call"),
            None => near::proposed(d, &near, n.span),
        };
        self.report(d);
        Value::Error
    }

    fn negate(&mut self, inner: &'a Expr, scope: &mut Scope) -> Value {
        match self.expr(inner, scope) {
            Value::Error => Value::Error,
            Value::Num(n) if !n.point => {
                let node = self.graph.unary(UnaryOp::Neg, n.node);
                Value::Num(Num { node, ..n })
            }
            // `-5 degC` is a point below zero, not the negative of a point.
            Value::Num(n) if n.literal => {
                let (Some(unit), Some(si)) = (&n.unit, self.graph.constant(n.node)) else { return Value::Error };
                let si = unit.to_si(-unit.of_si(si));
                if si < 0.0 {
                    return self.too_cold(inner.span);
                }
                let node = self.graph.number(si);
                Value::Num(Num { node, ..n })
            }
            other => {
                self.report(Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    inner.span,
                    format!("{} cannot be negated", other.what()),
                    "has no negative",
                ));
                Value::Error
            }
        }
    }

    /// What stands before `as`: concentrations that it sums take their kind from the unit.
    fn sum_as(&mut self, e: &'a Expr, unit: &UnitText, scope: &mut Scope) -> Value {
        let ExprKind::Binary(op @ (Binary::Add | Binary::Sub), a, b) = &*e.kind else { return self.expr(e, scope) };
        let (x, y) = (self.sum_as(a, unit, scope), self.sum_as(b, unit, scope));
        let kinds = [&x, &y].iter().filter(|v| matches!(v, Value::Concentration(..))).count();
        // With another operand that is a quantity, that says which kind is meant.
        if kinds < 2 {
            return self.arith(*op, x, y, a.span, b.span, e.span);
        }
        let (x, y) = (self.as_unit(x, unit, a.span), self.as_unit(y, unit, b.span));
        self.arith(*op, x, y, a.span, b.span, e.span)
    }

    /// Whether a part of a hazard's condition does not hold: of one that is judged at the start only, as things are given.
    fn is_out(&self, part: NodeId) -> bool {
        let value = if self.mode().at_start { self.glance(part) } else { self.graph.constant(part) };
        value == Some(0.0)
    }

    /// Whether the first part of a condition of a law decides it, and nobody wants to know what the second one names.
    fn is_settled(&self, op: Binary, first: NodeId) -> bool {
        let alone = if op == Binary::And { 0.0 } else { 1.0 };
        let is_asked = self.prototype || self.observed.is_some() || self.meanings.is_some();
        !is_asked && self.graph.constant(first) == Some(alone)
    }

    fn binary(&mut self, op: Binary, a: &'a Expr, b: &'a Expr, span: Span, scope: &mut Scope) -> Value {
        match op {
            Binary::And if self.noting() == Noting::Any => {
                let x = self.truth(a, scope);
                // There are many mixtures, and what is never so of one need not be written out.
                if x.is_some_and(|x| self.is_out(x)) && !self.prototype {
                    return x.map_or(Value::Error, Value::Bool);
                }
                let (Some(x), Some(y)) = (x, self.truth(b, scope)) else { return Value::Error };
                Value::Bool(self.graph.binary(BinaryOp::And, x, y))
            }
            Binary::And | Binary::Or => {
                let x = self.truth(a, scope);
                // Laws are written out for many combinations, most of which their first condition excludes.
                if let Some(x) = x.filter(|x| self.is_settled(op, *x)) {
                    return Value::Bool(x);
                }
                let y = self.truth(b, scope);
                let (Some(x), Some(y)) = (x, y) else { return Value::Error };
                let op = if op == Binary::And { BinaryOp::And } else { BinaryOp::Or };
                Value::Bool(self.graph.binary(op, x, y))
            }
            Binary::Is => self.is(a, b, scope),
            Binary::In => {
                let x = self.expr(a, scope);
                let range = self.like(b, &x, scope);
                self.inside(x, range, a.span, b.span)
            }
            Binary::Eq | Binary::Ne | Binary::Lt | Binary::Le | Binary::Gt | Binary::Ge => {
                let (x, y) = self.sides(a, b, scope);
                self.compare(op, x, y, a.span, b.span)
            }
            Binary::PlusMinus => {
                let (x, y) = (self.expr(a, scope), self.expr(b, scope));
                let low = self.arith(Binary::Sub, x.clone(), y.clone(), a.span, b.span, span);
                let high = self.arith(Binary::Add, x, y, a.span, b.span, span);
                self.range(low, high, a.span, b.span)
            }
            Binary::Pow => self.power(a, b, scope),
            Binary::Add | Binary::Sub | Binary::Mul | Binary::Div => {
                let (x, y) = (self.expr(a, scope), self.expr(b, scope));
                self.arith(op, x, y, a.span, b.span, span)
            }
        }
    }

    /// `X of S` outside a recipe only says what is meant: the quantity is X.
    /// `50 uL of dye` outside the contents of a vessel: a quantity, of which a call says what it is taken of.
    fn of(&mut self, inner: &'a Expr, substance: &'a Name, at: Span, scope: &mut Scope) -> Value {
        let value = self.expr(inner, scope);
        if self.substance(substance, scope.module).is_some() && !self.looked_into.contains(&at) {
            let headline =
                format!("this `of {}` has no effect: no source is given to check it against", substance.text);
            self.report(
                Diagnostic::warning(codes::MISPLACED, at, headline, "no source vessel").help(
                    "`of` is checked only in a call with `from` and a vessel: `transfer 50 uL of dye from a to b`",
                ),
            );
        }
        value
    }

    fn tuple(&mut self, items: &'a [Expr], unit: Option<&UnitText>, scope: &mut Scope) -> Value {
        if let ([single], None) = (items, unit) {
            return self.expr(single, scope);
        }
        let resolved = match unit.map(|u| (u, self.tables.unit(&u.text))) {
            Some((u, Err(error))) => {
                self.report(unit_error(u, error));
                return Value::Error;
            }
            Some((_, Ok(r))) => Some(r),
            None => None,
        };
        let values = items
            .iter()
            .map(|item| {
                let value = self.expr(item, scope);
                match (&resolved, value) {
                    (Some(r), Value::Num(n)) if n.dimension.is_one() => {
                        let factor = self.graph.number(r.unit.factor);
                        let node = self.graph.binary(BinaryOp::Mul, n.node, factor);
                        Value::Num(Num {
                            node,
                            dimension: r.dimension.clone(),
                            point: false,
                            unit: Some(r.unit.clone()),
                            literal: true,
                        })
                    }
                    (_, value) => value,
                }
            })
            .collect();
        Value::Tuple(values)
    }

    fn fold(&mut self, fold: &Name, var: &Name, set: &'a Expr, body: &'a Expr, scope: &mut Scope) -> Value {
        let items = match self.narrowed(fold, var, (set, body), scope) {
            Some(items) => Some(items),
            None => self.set(set, scope),
        };
        let Some(items) = items else { return Value::Error };
        if !FOLDS.contains(&fold.text.as_str()) {
            let known: Vec<String> = FOLDS.iter().map(|f| format!("`{f}`")).collect();
            let d = near::unknown(fold, format!("unknown function over a set: `{}`", fold.text), "not such a function");
            self.report(d.help(format!("use {}", known.join(", "))));
            return Value::Error;
        }
        if items.is_empty() && self.prototype && self.noting() == Noting::Any {
            // A stand-in has none of these: what is said of one is checked with nothing known of it.
            scope.bind(var.text.clone(), Value::Error);
            let none = Value::Bool(self.graph.number(0.0));
            let found = self.diagnostics.len();
            self.observe_one(fold, None, None, |lab| {
                lab.expr(body, scope);
                (none, scope.vars.clone())
            });
            self.diagnostics.truncate(found);
            scope.vars.pop();
        }
        let mut result: Option<Value> = None;
        let is_of_each =
            fold.text == "all" && items.len() > 1 && self.open_members.is_empty() && self.open_calls.is_empty();
        for item in items {
            let value = if self.observed.is_some() {
                let of = if is_of_each { self.spoken(&item) } else { None };
                let instance = match &item {
                    Value::Instance(id) | Value::Qualified(id, _) => Some((var.span, *id)),
                    _ => None,
                };
                scope.bind(var.text.clone(), item);
                self.observe_one(fold, of, instance, |lab| (lab.expr(body, scope), scope.vars.clone()))
            } else {
                scope.bind(var.text.clone(), item);
                self.expr(body, scope)
            };
            scope.vars.pop();
            result = Some(match result {
                None => self.fold_one(&fold.text, value, body.span),
                Some(so_far) => self.fold_two(&fold.text, so_far, value, body.span),
            });
        }
        result.unwrap_or_else(|| match fold.text.as_str() {
            "product" => self.number(1.0, Dimension::any(), false),
            "all" => Value::Bool(self.graph.number(1.0)),
            "any" => Value::Bool(self.graph.number(0.0)),
            _ => self.number(0.0, Dimension::any(), false),
        })
    }

    /// Those of all instances of a kind that matter to what is folded over them, and one that stands for the rest, where the form of
    /// that tells who matters.
    fn narrowed(
        &mut self,
        fold: &Name,
        var: &Name,
        (set, body): (&'a Expr, &'a Expr),
        scope: &mut Scope,
    ) -> Option<Vec<Value>> {
        let ExprKind::Name(kind) = &*set.kind else { return None };
        if kind.text == var.text {
            return None;
        }
        let candidates = self.folded(&fold.text, body, &var.text, scope)?;
        let Value::Kind(kind) = self.expr(set, scope) else { return None };
        if scope.lab {
            self.gone_through.insert(kind);
        }
        let all = self.instances_of(kind);
        let other = all.iter().position(|i| !candidates.contains(i)).map(|at| all[at]);
        let mut those: Vec<InstanceId> =
            candidates.into_iter().filter(|i| self.instance_is(*i, kind)).chain(other).collect();
        those.sort_unstable();
        Some(those.into_iter().map(Value::Instance).collect())
    }

    /// What a fold makes of the only value.
    fn fold_one(&mut self, fold: &str, value: Value, span: Span) -> Value {
        match (fold, value) {
            ("all" | "any", value @ (Value::Bool(_) | Value::Error)) => value,
            ("all" | "any", other) => self.expected("a truth value", &other, span),
            (_, other) => other,
        }
    }

    fn fold_two(&mut self, fold: &str, a: Value, b: Value, span: Span) -> Value {
        match fold {
            "sum" => self.arith(Binary::Add, a, b, span, span, span),
            "product" => self.arith(Binary::Mul, a, b, span, span, span),
            "all" | "any" => match (a, b) {
                (Value::Bool(a), Value::Bool(b)) => {
                    let op = if fold == "all" { BinaryOp::And } else { BinaryOp::Or };
                    Value::Bool(self.graph.binary(op, a, b))
                }
                (Value::Error, _) | (_, Value::Error) => Value::Error,
                (Value::Bool(_), other) | (other, _) => self.expected("a truth value", &other, span),
            },
            "min" => self.extreme(BinaryOp::Min, a, b, span),
            _ => self.extreme(BinaryOp::Max, a, b, span),
        }
    }

    /// The members of a finite set: a list, or all instances of a type.
    pub fn set(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<Vec<Value>> {
        if let ExprKind::Name(n) = &*e.kind
            && n.text == "Reaction"
            && !self.resolves(n, scope)
        {
            return Some((0..self.tables.reactions.len() as u32).map(|r| Value::Reaction(ReactionId(r))).collect());
        }
        if let ExprKind::Range(from, to) = &*e.kind {
            let (low, high) = (self.expr(from, scope), self.expr(to, scope));
            return self.whole_numbers(low, high, from.span, to.span);
        }
        let value = self.expr(e, scope);
        match self.listed(value) {
            Value::List(items) => Some(items),
            Value::Range(low, high) => self.elements_of(*low, *high, e.span),
            Value::Kind(kind) => {
                if scope.lab {
                    self.gone_through.insert(kind);
                }
                Some(self.instances_of(kind).iter().copied().map(Value::Instance).collect())
            }
            Value::Error => None,
            other => {
                let help = "write a list `[a, b]`, numbers `1 .. 12`, a capability, or a set such as `plate.columns` or `m.species`";
                let headline = format!("cannot loop over {}", other.what());
                let place = "not a list or a finite set";
                self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, place).help(help));
                None
            }
        }
    }

    /// "expected X, found Y".
    pub fn expected(&mut self, what: &str, found: &Value, span: Span) -> Value {
        if *found != Value::Error {
            self.report(Diagnostic::error(
                codes::TYPE_MISMATCH,
                span,
                format!("expected {what}, found {}", found.what()),
                format!("this is {}", found.what()),
            ));
        }
        Value::Error
    }
}
