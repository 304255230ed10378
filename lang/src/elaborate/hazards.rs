//! Hazards on the instances of a lab: conditions that must not come about.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::model::Danger;

use matterix_ir::plan::Term;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Code, Diagnostic, Leaves, NodeId, Op, Said, Severity, Span, codes};

use super::tuples::{Tuples, has};
use crate::ast::{Arg, Expr, ExprKind, ItemKind, Name, Param, Text};
use crate::declare::Tables;
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::Mode;
use crate::eval::lab::observed::{Noting, Observed};
use crate::eval::{Num, Scope, Value};
use crate::names::{DeclId, bare};
use crate::near;
use crate::units::Dimension;

/// The kept value that stands for the share of its source which a transfer takes, in what is said of transfers.
pub const SHARE: u32 = u32::MAX;

/// At what a hazard is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// After each step that changes what it depends on.
    Steps,
    /// Where this value is used.
    Value(NodeId),
    /// Once, at the start, where the text gives a value that nothing changes, if it does.
    Given(Option<Span>),
    /// Before matter goes from one mixture into another, [`SHARE`] of it; told where a value is used after that, if there is one.
    Transfer(InstanceId, InstanceId, Option<NodeId>),
}

/// A hazard over instances of the lab.
#[derive(Clone, Debug)]
pub struct Hazard {
    /// `above_boiling_point`.
    pub name: String,
    /// `above_boiling_point(plate, beaker)`.
    pub shown: String,
    /// An error, not a warning.
    pub grave: bool,
    /// At what it is looked at.
    pub watched: Watched,
    /// The dimension of the value it watches: contents that are given in it are measured out by such a value.
    pub measure: Option<Dimension>,
    /// The first thing it is about.
    pub about: Option<InstanceId>,
    /// When it is there.
    pub when: NodeId,
    /// The states it depends on; one that depends on none is there from the start or never.
    pub states: Vec<u32>,
    /// The members it names.
    pub terms: Vec<Term>,
    /// What is so, for each that it asks about: the first whose node holds counts.
    pub said: Vec<Said>,
    /// How to mend it.
    pub help: Option<String>,
    /// Its declaration.
    pub span: Span,
}

impl Hazard {
    /// The kind of finding.
    pub fn code(&self) -> Code {
        codes::find(&self.name.replace('_', "-")).unwrap_or(codes::HAZARD)
    }

    /// What is dangerous about which things.
    pub fn headline(&self) -> String {
        let things: Vec<String> = self.things().map(|t| format!("`{t}`")).collect();
        format!("{}: {}", self.name.replace('_', " "), things.join(" and "))
    }

    /// The whole things that it is about, in words.
    pub fn about(&self, lab: &Elaborator<'_>) -> String {
        let whole = |name: &str| {
            let id = lab.instances.iter().position(|i| i.name == name).map(|i| lab.outermost(InstanceId(i as u32)));
            format!("`{}`", id.map_or(name, |id| lab.instances[id.0 as usize].name.as_str()))
        };
        let things: Vec<String> = self.things().map(whole).collect();
        things.join(" with ")
    }

    /// The full names of the things that it is about.
    fn things(&self) -> impl Iterator<Item = &str> {
        self.shown.split_once('(').map_or("", |s| s.1.trim_end_matches(')')).split(", ")
    }

    /// An error, or a warning.
    pub fn severity(&self) -> Severity {
        if self.grave { Severity::Error } else { Severity::Warning }
    }
}

/// What a run watches for. What depends on no state is there from the start or never, which is told before the run.
pub fn dangers(hazards: &[Hazard]) -> Vec<Danger> {
    let all = hazards.iter().filter(|h| h.watched == Watched::Steps && !h.states.is_empty());
    let danger = |h: &Hazard| Danger {
        name: h.name.clone(),
        code: h.code(),
        severity: h.severity(),
        when: h.when,
        headline: h.headline(),
        said: h.said.clone(),
        about: h.about,
        help: h.help.iter().cloned().collect(),
        span: h.span,
    };
    all.map(danger).collect()
}

/// A declaration as it is read.
#[derive(Clone, Copy)]
struct Declared<'a> {
    module: usize,
    grave: bool,
    name: &'a Name,
    params: &'a [Param],
    of: Option<&'a Expr>,
    after: Option<&'a Expr>,
    when: &'a Expr,
    help: Option<&'a String>,
    because: Option<&'a Text>,
}

/// `move(share, from: a, to: b)` after `of`: the names it gives to the share and the two mixtures.
pub fn transfer(of: &Expr) -> Option<(&Expr, &Expr, &Expr)> {
    let ExprKind::Call(callee, args) = &*of.kind else { return None };
    let named = |key: &str| args.iter().find(|a| a.name.as_ref().is_some_and(|n| n.text == key)).map(|a| &a.value);
    let is_move = matches!(&*callee.kind, ExprKind::Name(n) if n.text == "move");
    let share = args.iter().find(|a| a.name.is_none()).map(|a| &a.value);
    Some((share?, named("from")?, named("to")?)).filter(|_| is_move && args.len() == 3)
}

/// What a list consists of, or what is none by itself.
fn several(of: &Expr) -> Vec<&Expr> {
    match &*of.kind {
        ExprKind::List(items) => items.iter().collect(),
        _ => vec![of],
    }
}

/// The hazards and cautions that a package accepts, by name.
fn accepted(tables: &Tables<'_>) -> BTreeSet<DeclId> {
    let names = tables.names;
    let items = names.modules.iter().enumerate().flat_map(|(i, m)| m.tree.items.iter().map(move |item| (i, item)));
    let named = items.filter_map(|(module, item)| match &item.kind {
        ItemKind::Accept { name, .. } => names.lookup(module, &name.text),
        _ => None,
    });
    named.collect()
}

impl<'a> Elaborator<'a> {
    /// Every hazard on every fitting combination of instances, but for those that cannot come about or are accepted.
    pub fn hazards(&mut self) -> Vec<Hazard> {
        let mut out = Vec::new();
        let names = self.tables.names;
        let accepted = accepted(self.tables);
        for index in 0..names.decls.len() as u32 {
            let id = DeclId(index);
            let decl = names.decl(id);
            let ItemKind::Hazard { grave, name, params, of, after, when, help, because } = &decl.item.kind else {
                continue;
            };
            if accepted.contains(&id) {
                continue;
            }
            let (of, after, help, because) = (of.as_ref(), after.as_ref(), help.as_ref(), because.as_ref());
            let declared =
                Declared { module: decl.module, grave: *grave, name, params, of, after, when, help, because };
            match after.or(of).and_then(transfer) {
                Some((share, from, to)) => self.of_transfers(declared, share, (from, to), &mut out),
                None => self.of_instances(declared, &mut out),
            }
        }
        if self.budget.is_over() {
            return Vec::new();
        }
        out
    }

    fn of_instances(&mut self, declared: Declared<'a>, out: &mut Vec<Hazard>) {
        let Declared { params, module, name, .. } = declared;
        let mut tuples = self.tuples(params, module, Some(declared.when), name);
        // What can never be is asked first, for that takes less than the value that is watched; not so at the start.
        let mut at_start = false;
        while let Some((mut scope, shown)) = tuples.next(self) {
            if declared.of.is_some_and(|of| !several(of).iter().any(|e| self.is_asked_for(e, &scope))) {
                continue;
            }
            let later = if at_start { None } else { self.hazard(declared, false, &shown, &mut scope) };
            if !at_start && later.is_none() {
                continue;
            }
            let all = match declared.of {
                None => vec![(Watched::Steps, None)],
                Some(of) => self.all_watched(of, &mut scope),
            };
            let Some((first, _)) = all.first() else { continue };
            at_start = matches!(first, Watched::Given(_));
            let hazard = match later {
                Some(hazard) if !at_start => Some(hazard),
                _ => self.hazard(declared, at_start, &shown, &mut scope),
            };
            let Some(hazard) = hazard else { continue };
            out.extend(all.into_iter().map(|(watched, measure)| Hazard { watched, measure, ..hazard.clone() }));
        }
    }

    /// What stands after `of`: a value or several, for a concentration every kind of it that anything asks for, or a thing as it is at the start.
    fn all_watched(&mut self, of: &'a Expr, scope: &mut Scope) -> Vec<(Watched, Option<Dimension>)> {
        let mut out = Vec::new();
        for e in several(of) {
            if !self.is_asked_for(e, scope) {
                continue;
            }
            match self.expr(e, scope) {
                Value::Num(Num { node, dimension, .. }) => out.push((self.watched(e, node), Some(dimension))),
                Value::Bool(node) => out.push((self.watched(e, node), None)),
                Value::Instance(id) => out.push((Watched::Given(self.declared_contents(id)), None)),
                Value::Concentration(m, s) => {
                    let kinds = self.view_values.get(&(m, s)).into_iter().flat_map(BTreeMap::values);
                    out.extend(kinds.filter_map(|kind| match kind {
                        Value::Num(n) => Some((Watched::Value(n.node), None)),
                        _ => None,
                    }));
                }
                _ => {}
            }
        }
        out
    }

    /// Where the lab says what a mixture holds at the start, if it does.
    fn declared_contents(&self, mixture: InstanceId) -> Option<Span> {
        self.held.iter().find(|held| held.mixture == Some(mixture)).map(|held| held.span)
    }

    /// Where a value is looked at: one that nothing changes at the start, where it is given.
    fn watched(&self, of: &Expr, node: NodeId) -> Watched {
        if !matches!(&*of.kind, ExprKind::Member(..)) {
            return Watched::Value(node);
        }
        match self.graph.op(node) {
            Op::Param(i) => Watched::Given(Some(self.params[i as usize].span)),
            _ if self.graph.leaves(node).meets(Leaves::LIVE) => Watched::Value(node),
            _ => Watched::Given(None),
        }
    }

    /// Whether a value may be used: of a function of the parameters alone, whether anything of the lab calls it so.
    fn is_asked_for(&self, of: &Expr, scope: &Scope) -> bool {
        let ExprKind::Call(callee, args) = &*of.kind else { return true };
        let given = |arg: &Arg| scope.var(bare(&arg.value)?).cloned();
        let values: Option<Vec<Value>> = args.iter().map(given).collect();
        let function = bare(callee).and_then(|name| self.tables.names.lookup(scope.module, name));
        let (Some(values), Some(function)) = (values, function) else { return true };
        self.was_called(function, &values)
    }

    fn of_transfers(&mut self, declared: Declared<'a>, share: &Expr, ends: (&Expr, &Expr), out: &mut Vec<Hazard>) {
        let (Some(share), Some(from), Some(to)) = (bare(share), bare(ends.0), bare(ends.1)) else { return };
        let Declared { params, module, name, when, .. } = declared;
        let sets = self.sets(params, module);
        for (a, b) in self.moves.clone() {
            let before = self.steps_taken();
            // The ends are known, and which is which as well.
            let narrowed = params.iter().zip(&sets).map(|(p, set)| {
                let end = [(from, a), (to, b)].into_iter().find(|(name, _)| *name == p.name.text);
                match end {
                    Some((_, id)) if has(set, id) => vec![Value::Instance(id)],
                    Some(_) => Vec::new(),
                    None => set.clone(),
                }
            });
            let mut tuples = Tuples::new(params, (module, name), Some(when), narrowed.collect(), None);
            while let Some((mut scope, shown)) = tuples.next(self) {
                let value = self.share_moved();
                scope.bind(share.to_string(), value);
                let Some(hazard) = self.hazard(declared, false, &shown, &mut scope) else { continue };
                let then = match declared.of.filter(|_| declared.after.is_some()) {
                    None => None,
                    Some(of) => match self.expr(of, &mut scope) {
                        Value::Num(Num { node, .. }) | Value::Bool(node) => Some(node),
                        _ => continue,
                    },
                };
                out.push(Hazard { watched: Watched::Transfer(a, b, then), about: Some(a), ..hazard });
            }
            self.count_transfer(before);
        }
    }

    fn share_moved(&mut self) -> Value {
        let node = self.graph.add(Op::Local(SHARE));
        self.num(node, Dimension::one())
    }

    /// What is dangerous about the things in `scope`; none if it can never come about, or, `at_start`, is not there at the start.
    fn hazard(&mut self, declared: Declared<'a>, at_start: bool, shown: &str, scope: &mut Scope) -> Option<Hazard> {
        let mode = if at_start { Mode::START } else { Mode::default() };
        self.in_mode(mode, |lab| {
            let is_entered = lab.enter(declared.name.span);
            let hazard = if is_entered { lab.endangered(declared, shown, scope) } else { None };
            lab.leave();
            hazard
        })
    }

    fn endangered(&mut self, declared: Declared<'a>, shown: &str, scope: &mut Scope) -> Option<Hazard> {
        let (node, observed) = self.beware(declared.when, scope);
        let (node, bound, terms) = (node?, observed.bound, observed.terms);
        if self.never(node) || self.mode().at_start && self.glance(node) == Some(0.0) {
            return None;
        }
        let said = declared.because.map(|words| self.said_of_danger(node, words, bound, scope));
        let said = said.unwrap_or_default();
        let states = self.graph.schedule([node]).into_iter().filter_map(|n| match self.graph.op(n) {
            Op::State(s) => Some(s),
            _ => None,
        });
        let states: Vec<u32> = states.collect();
        let about = scope.vars.iter().find_map(|(_, v)| match v {
            Value::Instance(id) => Some(*id),
            _ => None,
        });
        let (grave, span, help) = (declared.grave, declared.name.span, declared.help.cloned());
        let (name, shown, watched) = (declared.name.text.clone(), shown.to_owned(), Watched::Steps);
        Some(Hazard { name, shown, grave, watched, measure: None, about, when: node, states, terms, said, help, span })
    }

    /// A condition to beware of, with what it names and what is bound wherever `any` asks it of something in turn.
    fn beware(&mut self, when: &'a Expr, scope: &mut Scope) -> (Option<NodeId>, Observed) {
        self.observe(Noting::Any, |lab| lab.truth(when, scope))
    }

    /// Checks the declaration of a hazard on stand-ins for its instances, which `scope` has bound.
    pub fn check_hazard(&mut self, kind: &'a ItemKind, scope: &mut Scope) {
        let ItemKind::Hazard { params, of, after, when, because, .. } = kind else { return };
        let parameter = |e: &Expr| bare(e).is_some_and(|name| params.iter().any(|p| p.name.text == name));
        let moved = after.as_ref().or(of.as_ref()).and_then(transfer);
        let named = moved.and_then(|(share, a, b)| bare(share).filter(|_| parameter(a) && parameter(b)));
        if let Some((_, from, to)) = moved.filter(|_| named.is_some()) {
            for end in [from, to] {
                let Some(Value::Instance(id)) = bare(end).and_then(|name| scope.var(name)).cloned() else { continue };
                if !self.is_mixture(id) {
                    self.report(
                        Diagnostic::error(
                            codes::TYPE_MISMATCH,
                            end.span,
                            "matter goes from one mixture into another",
                            "not a mixture",
                        )
                        .help("declare both ends as `Mixture`: what a vessel `v` holds is `v.contents`"),
                    );
                }
            }
        }
        match (named, moved, after) {
            (Some(name), ..) => {
                let share = self.placeholder(&Type::ratio(), name);
                scope.bind(name.to_string(), share);
            }
            (None, Some((at, ..)), _) | (None, None, Some(at)) => self.report(
                Diagnostic::error(
                    codes::TYPE_MISMATCH,
                    at.span,
                    "write a transfer as its share and two parameters",
                    "not a transfer between two parameters",
                )
                .help("write `move(share, from: a, to: b)`"),
            ),
            (None, None, None) => {}
        }
        if let Some(of) = of.as_ref().filter(|_| after.is_some() || moved.is_none()) {
            for e in several(of) {
                match self.expr(e, scope) {
                    Value::Num(_) | Value::Bool(_) | Value::Error | Value::Concentration(..) => {}
                    other => {
                        self.expected("a quantity or a truth value", &other, e.span);
                    }
                }
            }
        }
        let (node, observed) = self.beware(when, scope);
        if let (Some(node), Some(words)) = (node, because) {
            self.said_of_danger(node, words, observed.bound, scope);
        }
    }

    /// Checks that what a file accepts is a hazard or a caution.
    pub fn check_accepted(&mut self, name: &Name, module: usize) {
        let names = self.tables.names;
        let is_hazard = |kind: &ItemKind| matches!(kind, ItemKind::Hazard { .. });
        if names.lookup(module, &name.text).is_some_and(|id| is_hazard(&names.decl(id).item.kind)) {
            return;
        }
        let known = names.visible(module).filter(|(_, id)| is_hazard(&names.decl(*id).item.kind)).map(|(n, _)| n);
        let near = near::nearest(&name.text, known);
        let headline = format!("unknown hazard or caution `{}`", name.text);
        let d = near::unknown(name, headline, "cannot be allowed");
        self.report(near::proposed(d, &near, name.span));
    }
}
