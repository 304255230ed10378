//! Calls of functions, relations and methods.

use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, Leaves, NodeId, Op, Span, codes};

use super::{Decided, Num, Scope, Value};
use crate::ast::{self, Arg, Expr, ExprKind, ItemKind, Name, Param};
use crate::declare::{ReactionId, SpeciesId, Type};
use crate::eval::external::AS_PUT;
use crate::eval::lab::Mode;
use crate::eval::lab::{Elaborator, Pair};
use crate::hints;
use crate::names::DeclId;
use crate::near;
use crate::units::Dimension;

/// A function, what it was called with, how many instances there were, and how members are read.
pub type KnownCall = (DeclId, Vec<KnownArgument>, usize, Mode);

/// An argument that always gives the same value of a function.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum KnownArgument {
    /// An instance.
    Instance(InstanceId),
    /// A species.
    Species(SpeciesId),
    /// A reaction.
    Reaction(ReactionId),
    /// A list of so many, which follow.
    List(usize),
    /// A number that the run does not change, with its dimension, whether it is a point or one literal, and the unit it is shown in.
    Number(NodeId, Dimension, bool, bool, Option<String>),
}

/// Whether a member of a list is one of its ends, of which several may be asked for.
fn is_end(name: &Name) -> bool {
    matches!(name.text.as_str(), "first" | "last")
}

impl<'a> Elaborator<'a> {
    /// `f(a, b: c)`.
    pub fn call(&mut self, callee: &'a Expr, args: &'a [Arg], span: Span, scope: &mut Scope) -> Value {
        let f = match &*callee.kind {
            // A function is looked up where a name that is not a function would be refused.
            ExprKind::Name(n) if scope.var(&n.text).is_none() => match self.lookup(scope.module, &n.text) {
                Some(id) if self.is_function(id) => {
                    self.note_declared(n.span, id);
                    Value::Function(id)
                }
                _ => {
                    if let Some(species) = self.species_in_phase(n, args, scope) {
                        return species;
                    }
                    let mut d = self.tables.names.unknown(scope.module, n, "function", |k| {
                        matches!(k, ItemKind::Fn { .. } | ItemKind::Relation { .. })
                    });
                    d.help.extend(hints::of_function(&n.text).map(str::to_owned));
                    self.report(d);
                    return Value::Error;
                }
            },
            ExprKind::Member(base, name) if is_end(name) => {
                let base = self.expr(base, scope);
                match (self.listed(base.clone()), args) {
                    (Value::List(items), [Arg { name: None, value }]) => {
                        let n = self.expr(value, scope);
                        return self.end_of(items, name.text == "first", n, value.span);
                    }
                    _ => self.member(base, name),
                }
            }
            _ => self.expr(callee, scope),
        };
        match f {
            Value::Error => Value::Error,
            Value::Function(id) => self.call_declared(id, args, span, scope),
            Value::Method(of, name) => self.call_method(*of, &name, args, span, scope),
            other => self.expected("a function", &other, callee.span),
        }
    }

    /// `CO2(g)`: a species whose name ends with its phase, which reads as a call.
    fn species_in_phase(&mut self, n: &Name, args: &[Arg], scope: &Scope) -> Option<Value> {
        let [Arg { name: None, value }] = args else { return None };
        let ExprKind::Name(phase) = &*value.kind else { return None };
        let id = self.lookup(scope.module, &format!("{}({})", n.text, phase.text))?;
        let species = self.tables.species.of_decl(id)?;
        self.note_declared(n.span, id);
        Some(Value::Species(species))
    }

    fn is_function(&self, id: DeclId) -> bool {
        matches!(self.tables.names.decl(id).item.kind, ItemKind::Fn { .. } | ItemKind::Relation { .. })
    }

    fn call_declared(&mut self, id: DeclId, args: &'a [Arg], span: Span, scope: &mut Scope) -> Value {
        let decl = self.tables.names.decl(id);
        let (params, name): (&'a [Param], &str) = match &decl.item.kind {
            ItemKind::Fn { params, name, .. } | ItemKind::Relation { params, name, .. } => (params, &name.text),
            _ => return Value::Error,
        };
        let external = matches!(decl.item.kind, ItemKind::Fn { external: true, .. });
        let mode = Mode { pooled: self.mode().pooled || (external && name == AS_PUT), ..self.mode() };
        let values = self.in_mode(mode, |lab| lab.arguments(params, decl.module, args, span, name, scope));
        let Some(values) = values else { return Value::Error };
        if let Some(v) = self.pair_setting(name, &values) {
            return v;
        }
        match &decl.item.kind {
            ItemKind::Fn { external: true, result, .. } => {
                let spans: Vec<Span> = params.iter().map(|p| p.name.span).collect();
                let at = args.first().map_or(span, |a| a.value.span);
                let result = result.as_ref().map(|t| self.resolve_type(t, decl.module));
                self.external(name, values, result, at, &spans)
            }
            ItemKind::Fn { body, result, .. } => match body {
                Some(body) => {
                    if let Some(v) = self.stood_in(params, result.as_ref(), &values, decl.module) {
                        return v;
                    }
                    let ty = result.as_ref().map_or(Type::Any, |ty| self.resolve_type(ty, decl.module));
                    let v = self.call_body(id, params, values, body, &ty, decl.module);
                    self.coerce(v, &ty, body.span, name)
                }
                None => Value::Error,
            },
            ItemKind::Relation { definition: Some(body), .. } => {
                match self.call_body(id, params, values, body, &Type::Bool, decl.module) {
                    v @ (Value::Bool(_) | Value::Error) => v,
                    other => self.expected("a condition", &other, body.span),
                }
            }
            ItemKind::Relation { .. } if self.prototype => Value::Bool(self.graph.number(1.0)),
            // Without a definition it holds where a lab says so with `between`.
            _ => Value::Bool(self.graph.number(0.0)),
        }
    }

    /// The value of a function of the text for arguments that are given as values; none where it has no body.
    pub fn call_with(&mut self, id: DeclId, values: Vec<Value>) -> Option<Value> {
        let decl = self.tables.names.decl(id);
        let ItemKind::Fn { params, result, body: Some(body), name, .. } = &decl.item.kind else { return None };
        let ty = result.as_ref().map_or(Type::Any, |ty| self.resolve_type(ty, decl.module));
        let value = self.call_body(id, params, values, body, &ty, decl.module);
        Some(self.coerce(value, &ty, body.span, &name.text))
    }

    fn call_body(
        &mut self,
        id: DeclId,
        params: &'a [Param],
        values: Vec<Value>,
        body: &'a Expr,
        ty: &Type,
        module: usize,
    ) -> Value {
        if let Some((name, at)) = self.ring(&self.open_calls, id) {
            self.report(
                Diagnostic::error(
                    codes::CIRCULAR,
                    at,
                    format!("`{name}` calls itself"),
                    "this calls the same function again",
                )
                .help("the compiler writes functions out, so recursion would never end"),
            );
            return Value::Error;
        }
        let key = self.remembered_call(id, &values);
        if let Some(v) = key.as_ref().and_then(|k| self.known_calls.get(k)) {
            let v = v.clone();
            self.spend_on_list(&v);
            return v;
        }
        let flow_before = std::mem::take(&mut self.touched_flow);
        self.open_calls.push(id);
        let mut inner = Scope::module(module);
        for (p, v) in params.iter().zip(values) {
            inner.bind(p.name.text.clone(), v);
        }
        let v = self.define(|lab| lab.hinted(body, ty, &mut inner));
        self.open_calls.pop();
        if let Some(key) = key.filter(|_| !self.touched_flow && v != Value::Error) {
            self.known_calls.insert(key, v.clone());
        }
        self.touched_flow |= flow_before;
        v
    }

    /// Whether a function of instances was called with these in the lab.
    pub fn was_called(&self, id: DeclId, values: &[Value]) -> bool {
        let Some((id, arguments, count, mode)) = self.remembered_call(id, values) else { return true };
        let known =
            |reported| self.known_calls.contains_key(&(id, arguments.clone(), count, Mode { reported, ..mode }));
        known(false) || known(true)
    }

    /// What a call is remembered by: a function of instances, species, reactions and lists of them always gives the same node, and so
    /// does one of numbers that the run does not change.
    fn remembered_call(&self, id: DeclId, values: &[Value]) -> Option<KnownCall> {
        // A mixture that stands nowhere is gone after it was asked, and another one takes its number.
        if self.rate_prefix.is_some() || self.instances.last().is_some_and(|i| i.composition.is_some()) {
            return None;
        }
        let mut known = Vec::with_capacity(values.len() + 2);
        let all = match values.first() {
            None => !self.prototype,
            Some(Value::Num(_)) => values.iter().all(|value| self.steady_number(value, &mut known)),
            _ => !self.prototype && values.iter().all(|value| self.is_steady(value, &mut known)),
        };
        all.then_some((id, known, self.instances.len(), self.mode()))
    }

    /// Notes something that the run does not change; false for anything else.
    fn is_steady(&self, value: &Value, out: &mut Vec<KnownArgument>) -> bool {
        match value {
            Value::Instance(id) => out.push(KnownArgument::Instance(*id)),
            Value::Species(id) => out.push(KnownArgument::Species(*id)),
            Value::Reaction(id) => out.push(KnownArgument::Reaction(*id)),
            Value::List(items) => {
                out.push(KnownArgument::List(items.len()));
                return items.iter().all(|item| self.is_steady(item, out));
            }
            other => return self.steady_number(other, out),
        }
        true
    }

    /// Notes a number that the run does not change; false for anything else.
    fn steady_number(&self, value: &Value, out: &mut Vec<KnownArgument>) -> bool {
        let Value::Num(n) = value else { return false };
        let shown = n.unit.as_ref().map(|unit| unit.symbol.clone());
        out.push(KnownArgument::Number(n.node, n.dimension.clone(), n.point, n.literal, shown));
        !self.graph.leaves(n.node).meets(Leaves::LIVE)
    }

    /// What a call stands for while a declaration is checked by itself: a function that says what it takes and gives was checked where it is
    /// declared, and is not written out again for values that are not known.
    fn stood_in(
        &mut self,
        params: &[Param],
        result: Option<&'a ast::Type>,
        values: &[Value],
        module: usize,
    ) -> Option<Value> {
        let typed = self.prototype && params.iter().all(|p| p.ty.is_some());
        let open = |v: &Value| matches!(v, Value::Num(n) if self.graph.constant(n.node).is_none());
        let numbers = values.iter().all(|v| matches!(v, Value::Num(_))) && values.iter().any(open);
        let ty = result.filter(|_| typed && numbers)?;
        let ty = self.resolve_type(ty, module);
        matches!(ty, Type::Quantity { optional: false, .. } | Type::Bool).then(|| self.placeholder(&ty, "result"))
    }

    /// Arguments by position and name, in the order of the parameters. A parameter that is not given takes its default
    /// or the local of the same name (`T` in a rate).
    fn arguments(
        &mut self,
        params: &'a [Param],
        module: usize,
        args: &'a [Arg],
        span: Span,
        callee: &str,
        scope: &mut Scope,
    ) -> Option<Vec<Value>> {
        let mut given: Vec<Option<Value>> = vec![None; params.len()];
        let mut good = true;
        for (position, arg) in args.iter().enumerate() {
            let index = match &arg.name {
                Some(n) => params.iter().position(|p| p.name.text == n.text),
                None => Some(position).filter(|i| *i < params.len()),
            };
            let Some(index) = index else {
                self.expr(&arg.value, scope);
                good = false;
                let at = arg.name.as_ref().map_or(arg.value.span, |n| n.span);
                let near = arg
                    .name
                    .as_ref()
                    .map_or_else(Vec::new, |n| near::nearest(&n.text, params.iter().map(|p| &p.name.text)));
                let mut d = Diagnostic::about(
                    callee,
                    codes::WRONG_ARGUMENTS,
                    at,
                    match &arg.name {
                        Some(n) => format!("`{callee}` has no parameter `{}`", n.text),
                        None => format!("`{callee}` takes {} arguments, but {} are given", params.len(), args.len()),
                    },
                    "not a parameter",
                );
                d.help.extend(near::question(&near));
                self.report(d);
                continue;
            };
            let param = &params[index];
            let value = match &param.ty {
                Some(ty) => {
                    let ty = self.resolve_type(ty, module);
                    self.typed(&arg.value, &ty, scope, &param.name.text)
                }
                None => self.expr(&arg.value, scope),
            };
            let value = match (value, &self.rate_prefix) {
                (Value::Num(n), Some(prefix)) => {
                    let full = format!("{prefix}.{}", param.name.text);
                    Value::Num(self.name_param(&full, n, arg.value.span))
                }
                (v, _) => v,
            };
            given[index] = Some(value);
        }
        let mut out = Vec::new();
        for (param, value) in params.iter().zip(given) {
            let value = match (value, &param.default) {
                (Some(v), _) => v,
                (None, Some(default)) => {
                    let ty = param.ty.as_ref().map_or(Type::Any, |ty| self.resolve_type(ty, module));
                    self.hinted(default, &ty, &mut Scope::module(module))
                }
                (None, None) => match scope.var(&param.name.text) {
                    Some(v) => v.clone(),
                    // A parameter that is not known may be meant for the one that is missing.
                    None if !good => Value::Error,
                    None => {
                        self.report(Diagnostic::about(
                            callee,
                            codes::WRONG_ARGUMENTS,
                            span,
                            format!("`{callee}` needs `{}`", param.name.text),
                            "missing",
                        ));
                        good = false;
                        Value::Error
                    }
                },
            };
            good &= value != Value::Error;
            out.push(value);
        }
        good.then_some(out)
    }

    /// A pair parameter: a function of two instances whose value a lab gives with `between`.
    pub(in crate::eval) fn pair_setting(&mut self, name: &str, values: &[Value]) -> Option<Value> {
        let instance = |v: &Value| match v {
            Value::Instance(i) | Value::Qualified(i, _) => Some(*i),
            _ => None,
        };
        let [a, b] = values else { return None };
        let (a, b) = (instance(a)?, instance(b)?);
        let given = |p: &Pair<'_>| p.name == name && ((p.a, p.b) == (a, b) || p.symmetric && (p.b, p.a) == (a, b));
        let found = self.pairs.iter().position(given)?;
        if let Some(v) = &self.pairs[found].resolved {
            return Some(v.clone());
        }
        let (value, module) = (self.pairs[found].value, self.pairs[found].module);
        let within = self.pairs[found].within.clone();
        let v = self.within_lab(&within, |this| this.expr(value, &mut Scope { lab: true, ..Scope::module(module) }));
        let result =
            self.tables.names.lookup(module, name).and_then(|id| match &self.tables.names.decl(id).item.kind {
                ItemKind::Fn { result: Some(ty), options, .. } => {
                    Some((ty, options, self.tables.names.decl(id).module))
                }
                _ => None,
            });
        let v = match result {
            Some((ty, options, m)) => {
                let ty = self.resolve_type(ty, m);
                let v = self.coerce(v, &ty, value.span, name);
                self.check_limits(&v, value.span, name, &ty, options, (None, m));
                v
            }
            // A relation that a lab declares.
            None => self.coerce(v, &Type::Bool, value.span, name),
        };
        let (x, y) = (self.instances[a.0 as usize].name.clone(), self.instances[b.0 as usize].name.clone());
        let v = match v {
            Value::Num(n) => Value::Num(self.name_param(&format!("{name}({x}, {y})"), n, value.span)),
            other => other,
        };
        self.pairs[found].resolved = Some(v.clone());
        Some(v)
    }

    fn call_method(&mut self, of: Value, name: &str, args: &'a [Arg], span: Span, scope: &mut Scope) -> Value {
        let values: Vec<Value> = args.iter().map(|a| self.expr(&a.value, scope)).collect();
        match (of, name, values.as_slice()) {
            (_, _, v) if v.contains(&Value::Error) => Value::Error,
            (Value::Reaction(r), _, _) => self.reaction_method(r, name, values, span, scope),
            (Value::Species(s), "count", [Value::Species(ion)]) => {
                let count =
                    self.tables.species.get(s).dissolves.iter().find(|(i, _)| i == ion).map_or(0.0, |(_, n)| *n);
                self.number(count, Dimension::one(), false)
            }
            (Value::Instance(_), "basis", _) => Value::Error,
            (Value::Grid(id, grid), _, [Value::Num(n)]) => {
                let at = args.first().map_or(span, |a| a.value.span);
                match self.number_before_run(n.node, "a place", at) {
                    Decided::Now(number) => self.grid_call(id, grid, name, number, at),
                    Decided::Later if self.prototype => self.grid_call(id, grid, name, 1.0, at),
                    Decided::Later | Decided::ByRun => Value::Error,
                }
            }
            _ => self.wrong_arguments(name, span),
        }
    }

    /// Reports arguments that fit no form of a function.
    pub fn wrong_arguments(&mut self, name: &str, span: Span) -> Value {
        self.report(Diagnostic::about(
            name,
            codes::WRONG_ARGUMENTS,
            span,
            format!("`{name}` cannot be called with these arguments"),
            "wrong arguments",
        ));
        Value::Error
    }

    /// A stand-in for a value of a type, for checking a declaration by itself.
    pub fn placeholder(&mut self, ty: &Type, name: &str) -> Value {
        match ty {
            Type::Any | Type::Reaction | Type::Material { .. } => Value::Error,
            Type::Int => self.placeholder(&Type::ratio(), name),
            Type::Quantity { dimension, point, .. } => {
                let index = self.params.len() as u32;
                self.params.push(matterix_ir::model::Param {
                    name: name.to_string(),
                    value: 1.0,
                    unit: matterix_ir::Unit::one(),
                    span: Span::default(),
                });
                let node = self.graph.add(Op::Param(index));
                Value::Num(Num { node, dimension: dimension.clone(), point: *point, unit: None, literal: false })
            }
            Type::Bool => {
                let zero = self.graph.number(0.0);
                let Value::Num(n) = self.placeholder(&Type::ratio(), name) else { return Value::Error };
                Value::Bool(self.graph.binary(BinaryOp::Lt, zero, n.node))
            }
            Type::Text => Value::Text(String::new()),
            // Which place it is decides what is there.
            Type::Place => Value::Error,
            Type::Enum(words) => match self.placeholder(&Type::ratio(), name) {
                Value::Num(n) => Value::Enum(n.node, words.clone()),
                _ => Value::Error,
            },
            Type::Species => {
                if self.tables.species.iter().next().is_some() {
                    Value::Species(crate::declare::SpeciesId(0))
                } else {
                    Value::Error
                }
            }
            Type::Range(inner) => match (self.placeholder(inner, name), self.placeholder(inner, name)) {
                (Value::Num(a), Value::Num(b)) => Value::Range(Box::new(a), Box::new(b)),
                _ => Value::Error,
            },
            Type::List(inner) => Value::List(vec![self.placeholder(inner, name)]),
            Type::Color => Value::Tuple((0..3).map(|_| self.placeholder(&Type::ratio(), name)).collect()),
            Type::Frame => match self.instances.first() {
                Some(_) => Value::Frame(matterix_ir::scene::InstanceId(0), name.to_string()),
                None => Value::Error,
            },
            Type::Instance { kinds, .. } => Value::Instance(self.prototype_of(kinds.to_vec(), name)),
        }
    }
}
