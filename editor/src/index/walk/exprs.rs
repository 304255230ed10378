//! Expressions: what each name in them stands for, and what kind of value they have.

use matterix_ir::Span;
use matterix_lang::ast::{Arg, Binary, Expr, ExprKind, Name, Text, TextPart, Unary};
use matterix_lang::eval::lab::grids::Place;
use matterix_lang::semantic_index::Sort;

use super::{Found, Walk};
use crate::index::{DefId, Kind, Meaning};

/// Words that mean the same everywhere.
const FIXED: &[(&str, &str)] = &[
    ("true", "holds"),
    ("false", "does not hold"),
    ("nothing", "no thing"),
    ("unlimited", "no limit"),
    ("elapsed", "time since the workflow began"),
    ("self", "the thing whose text this is"),
];

/// Folds over a set.
const FOLDS: &[&str] = &["sum", "product", "min", "max", "all", "any"];

/// The set of all reactions.
const REACTION: &str = "Reaction";

/// Shapes of things, and turning.
const SHAPES: &[&str] = &["box", "cylinder", "sphere", "mesh", "vessel", "turned", "rpy"];

impl Walk<'_> {
    pub(super) fn expr(&mut self, e: &Expr) -> Found {
        self.expr_among(e, &[])
    }

    /// An expression where one of these words may stand.
    pub(super) fn expr_among(&mut self, e: &Expr, words: &[DefId]) -> Found {
        let mut found = self.written(e, words);
        if let Some(seen) = self.index.seen(e.span).filter(|s| s.sort != Sort::Any) {
            let empty = matches!(&seen.sort, Sort::Thing(kinds, _) if kinds.is_empty());
            // What was checked counts; of a thing that only a run knows the declaration says more.
            if !empty || found.sort == Sort::Any {
                found.sort = seen.sort.clone();
            }
        }
        found
    }

    fn written(&mut self, e: &Expr, words: &[DefId]) -> Found {
        match &*e.kind {
            ExprKind::Error => Found::nothing(),
            ExprKind::Number(_) => Found::of(Sort::number()),
            ExprKind::Text(_) => Found::of(Sort::Text),
            ExprKind::Quantity(_, unit) => {
                self.unit(unit);
                let unit = self.index.units().resolve(&unit.text);
                Found::of(unit.map_or(Sort::Any, |r| Sort::Quantity(r.dimension, r.point)))
            }
            ExprKind::Name(n) => self.name(n, words),
            ExprKind::Scoped(path) => {
                self.path(path);
                self.named(path).map_or_else(Found::nothing, |d| self.value_of(d))
            }
            ExprKind::Member(base, name) => {
                let base = self.expr(base);
                self.member(&base.sort, name)
            }
            ExprKind::IndexWord(base, word) => self.index_word(base, word),
            ExprKind::IndexRange(base, a, b) => {
                let base = self.expr(base);
                for end in [a, b] {
                    match self.find(end) {
                        Some(_) => {
                            self.name(end, words);
                        }
                        None => self.language(end.span, "a place of the grid"),
                    }
                }
                Found::of(Sort::List(Box::new(self.index.element_of(&base.sort).unwrap_or(Sort::Any))))
            }
            ExprKind::Index(base, index) => match &*index.kind {
                ExprKind::Name(word) => self.index_word(base, word),
                _ => {
                    let base = self.expr(base);
                    self.expr(index);
                    let ranged = matches!(&*index.kind, ExprKind::Range(..));
                    let element = self.index.element_of(&base.sort).unwrap_or(Sort::Any);
                    Found::of(if ranged { Sort::List(Box::new(element)) } else { element })
                }
            },
            ExprKind::Call(callee, args) => self.function(callee, args),
            ExprKind::Fold { fold, var, set, body } => {
                self.language(fold.span, "over all of a set");
                let each = match &*set.kind {
                    ExprKind::Name(n) if n.text == REACTION && self.find(n).is_none() => {
                        self.language(n.span, "every reaction of the file and its imports");
                        Sort::Reaction
                    }
                    _ => {
                        let set = self.expr(set);
                        self.each(&set.sort)
                    }
                };
                let mut result = Found::nothing();
                self.inside(e.span, |this| {
                    this.bind(Kind::Variable, var, e.span, &Found::of(each));
                    result = this.expr(body);
                });
                result
            }
            ExprKind::Prime(inner) => self.expr(inner),
            ExprKind::Unary(Unary::Neg, inner) => self.expr(inner),
            ExprKind::Unary(Unary::Not, inner) => {
                self.expr(inner);
                Found::of(Sort::Truth)
            }
            ExprKind::Binary(op, a, b) => self.binary(*op, a, b),
            ExprKind::Of(inner, substance) => {
                let found = self.expr(inner);
                self.global(substance);
                found
            }
            ExprKind::Range(a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                let end = if matches!(a.sort, Sort::Any | Sort::Unlimited) { b.sort } else { a.sort };
                Found::of(Sort::Range(Box::new(end)))
            }
            ExprKind::As(inner, unit) => {
                self.expr(inner);
                self.unit(unit);
                let unit = self.index.units().resolve(&unit.text);
                Found::of(unit.map_or(Sort::Any, |r| Sort::Quantity(r.dimension, r.point)))
            }
            ExprKind::Tuple(items, unit) => {
                let found: Vec<Found> = items.iter().map(|i| self.expr(i)).collect();
                if let Some(unit) = unit {
                    self.unit(unit);
                }
                match (found.as_slice(), unit) {
                    ([one], None) => one.clone(),
                    _ => Found::of(Sort::Tuple(found.into_iter().map(|f| f.sort).collect())),
                }
            }
            ExprKind::List(items) => {
                let mut found: Vec<Found> = items.iter().map(|i| self.expr_among(i, words)).collect();
                // Lists beside things are one list with these.
                if found.iter().any(|f| matches!(f.sort, Sort::Thing(..))) {
                    found.retain(|f| !matches!(f.sort, Sort::List(_)));
                }
                let first = found.into_iter().find(|f| f.sort != Sort::Any).map_or(Sort::Any, |f| f.sort);
                let first = match first {
                    Sort::Thing(kinds, _) => Sort::Thing(kinds, None),
                    other => other,
                };
                Found::of(Sort::List(Box::new(first)))
            }
        }
    }

    /// What stands for each member of a set.
    pub(super) fn each(&self, set: &Sort) -> Sort {
        match set {
            Sort::List(inner) | Sort::Range(inner) => (**inner).clone(),
            Sort::Kind(kind) => Sort::Thing(vec![*kind], None),
            _ => Sort::Any,
        }
    }

    fn binary(&mut self, op: Binary, a: &Expr, b: &Expr) -> Found {
        match op {
            Binary::And | Binary::Or => {
                self.expr(a);
                self.expr(b);
                Found::of(Sort::Truth)
            }
            Binary::Is => {
                let left = self.expr(a);
                let words = self.words_of(&left);
                self.expr_among(b, &words);
                Found::of(Sort::Truth)
            }
            Binary::In | Binary::Eq | Binary::Ne | Binary::Lt | Binary::Le | Binary::Gt | Binary::Ge => {
                // A word takes its meaning from the other side.
                let swapped = matches!(&*a.kind, ExprKind::Name(n) if self.find(n).is_none());
                let (first, second) = if swapped { (b, a) } else { (a, b) };
                let found = self.expr(first);
                let words = self.words_of(&found);
                self.expr_among(second, &words);
                Found::of(Sort::Truth)
            }
            Binary::PlusMinus => {
                let found = self.expr(a);
                self.expr(b);
                Found::of(Sort::Range(Box::new(found.sort)))
            }
            Binary::Pow => {
                let found = self.expr(a);
                self.expr(b);
                match found.sort {
                    Sort::Quantity(d, point) if d.is_one() => Found::of(Sort::Quantity(d, point)),
                    _ => Found::nothing(),
                }
            }
            Binary::Add | Binary::Sub | Binary::Mul | Binary::Div => {
                let (x, y) = (self.expr(a), self.expr(b));
                let (Sort::Quantity(p, at), Sort::Quantity(q, other)) = (x.sort, y.sort) else {
                    return Found::nothing();
                };
                Found::of(match op {
                    Binary::Mul => Sort::Quantity(p.times(&q), false),
                    Binary::Div => Sort::Quantity(p.over(&q), false),
                    Binary::Sub => Sort::Quantity(p, at && !other),
                    _ => Sort::Quantity(p, at || other),
                })
            }
        }
    }

    /// The words that a value may be: its own, or those of the states of a thing.
    pub(super) fn words_of(&self, found: &Found) -> Vec<DefId> {
        if let Some(def) = found.def.filter(|d| !self.index.def(*d).words.is_empty())
            && !matches!(self.index.def(def).kind, Kind::Included)
        {
            return self.index.def(def).words.clone();
        }
        match &found.sort {
            Sort::Thing(kinds, _) => {
                let members = self.index.members_of(kinds);
                let words = members.iter().flat_map(|d| self.index.def(*d).words.clone()).collect::<Vec<_>>();
                // Truth values are words of a thing, too.
                let truths = members.into_iter().filter(|d| self.index.def(*d).sort == Sort::Truth);
                words.into_iter().chain(truths).collect()
            }
            _ => Vec::new(),
        }
    }

    /// What a name stands for where no word is expected.
    pub(super) fn find(&self, n: &Name) -> Option<Meaning> {
        if let Some((_, id)) = self.scope.iter().rev().find(|(name, _)| *name == n.text) {
            return Some(Meaning::Def(*id));
        }
        let noted = self.index.meanings.names.get(&n.span).and_then(|s| self.index.declared_at(*s));
        if let Some(def) = noted {
            return Some(Meaning::Def(def));
        }
        if let Some((_, what)) = FIXED.iter().find(|(name, _)| *name == n.text) {
            return Some(Meaning::Language(what));
        }
        if let Some(def) = self.of_this(&n.text) {
            return Some(def);
        }
        let named = |d: &DefId| self.index.def(*d).name == n.text;
        if let Some(def) = self.labs.iter().flat_map(|l| &self.index.def(*l).inside).copied().find(|d| named(d)) {
            return Some(Meaning::Def(def));
        }
        if let Some(def) = self.setting(&n.text) {
            return Some(Meaning::Def(def));
        }
        if let Some(def) = self.index.lookup(self.at, &n.text) {
            return Some(Meaning::Def(def));
        }
        (n.text == "ambient").then_some(Meaning::Language("the temperature around, a setting of the lab"))
    }

    /// A member of the thing whose text this is.
    fn of_this(&self, name: &str) -> Option<Meaning> {
        let kind = self.this.and_then(|k| self.index.decl_of(k))?;
        let own = self.index.declared_member(&[kind], name).map(Meaning::Def);
        own.or_else(|| self.index.member_of(&Sort::Thing(vec![kind], None), name).map(|m| m.meaning))
    }

    /// A setting of a lab: laws and workflows see them by name.
    fn setting(&self, name: &str) -> Option<DefId> {
        let included = |labs: &[DefId]| -> Vec<DefId> {
            let inside = labs.iter().flat_map(|l| &self.index.def(*l).inside);
            inside
                .map(|d| self.index.def(*d))
                .filter(|d| d.kind == Kind::Included)
                .flat_map(|d| d.words.clone())
                .collect()
        };
        let mut labs = self.labs.clone();
        for _ in 0..4 {
            let found = labs.iter().flat_map(|l| &self.index.def(*l).inside);
            let mut found = found.filter(|d| self.index.def(**d).kind == Kind::Setting);
            if let Some(def) = found.find(|d| self.index.def(**d).name == name) {
                return Some(*def);
            }
            labs = included(&labs);
        }
        self.index.setting(name)
    }

    /// A bare word.
    pub(super) fn name(&mut self, n: &Name, words: &[DefId]) -> Found {
        if let Some(word) = words.iter().copied().find(|w| self.index.def(*w).name == n.text) {
            self.known(n.span, word);
            return Found { sort: self.index.seen(n.span).map_or(Sort::Any, |s| s.sort.clone()), def: None };
        }
        match self.find(n) {
            Some(Meaning::Def(def)) => {
                self.known(n.span, def);
                self.value_of(def)
            }
            Some(meaning) => {
                self.note(n.span, meaning);
                Found::of(match (n.text.as_str(), self.this.and_then(|k| self.index.decl_of(k))) {
                    ("self", Some(kind)) => Sort::Thing(vec![kind], None),
                    ("true" | "false", _) => Sort::Truth,
                    ("nothing", _) => Sort::Nothing,
                    ("unlimited", _) => Sort::Unlimited,
                    ("elapsed", _) => self.index.duration(),
                    ("ambient", _) => Sort::Quantity(self.index.units().named("Temperature"), true),
                    (name, Some(kind)) => {
                        self.index.member_of(&Sort::Thing(vec![kind], None), name).map_or(Sort::Any, |m| m.sort)
                    }
                    _ => Sort::Any,
                })
            }
            None => {
                let word = self.index.seen(n.span).is_some_and(|s| matches!(s.sort, Sort::Word(_)));
                let meaning = if word { Meaning::Language("a word of a state") } else { Meaning::Unknown };
                self.note(n.span, meaning);
                Found::nothing()
            }
        }
    }

    /// What kind of value a declaration stands for.
    pub(super) fn value_of(&self, def: DefId) -> Found {
        let d = self.index.def(def);
        let sort = match (d.kind, self.index.decl_of(def)) {
            (Kind::Function | Kind::Relation, Some(decl)) => Sort::Function(decl),
            (Kind::Member | Kind::Part | Kind::Grid, _) => {
                let kind = self.this.and_then(|k| self.index.decl_of(k));
                let member = kind.and_then(|k| self.index.member_of(&Sort::Thing(vec![k], None), &d.name));
                member.filter(|m| m.meaning == Meaning::Def(def)).map_or_else(|| d.sort.clone(), |m| m.sort)
            }
            _ => d.sort.clone(),
        };
        Found { sort, def: Some(def) }
    }

    /// `base.name`.
    fn member(&mut self, base: &Sort, name: &Name) -> Found {
        let noted = self.index.meanings.names.get(&name.span).and_then(|s| self.index.declared_at(*s));
        let found = self.index.member_of(base, &name.text);
        let unknown = if *base == Sort::Any { Meaning::Open } else { Meaning::Unknown };
        let meaning = noted.map(Meaning::Def).or(found.as_ref().map(|f| f.meaning)).unwrap_or(unknown);
        self.note(name.span, meaning);
        let def = match meaning {
            Meaning::Def(def) => Some(def),
            _ => None,
        };
        let sort = found.map(|f| f.sort).or_else(|| def.map(|d| self.index.def(d).sort.clone()));
        Found { sort: sort.unwrap_or(Sort::Any), def }
    }

    /// `x[word]`: a place, a species or a variable.
    fn index_word(&mut self, base: &Expr, word: &Name) -> Found {
        let base = self.expr(base);
        let local = self.scope.iter().rev().find(|(name, _)| *name == word.text).map(|s| s.1);
        if let Some(def) = local {
            self.known(word.span, def);
            let element = self.index.element_of(&base.sort);
            return Found::of(element.filter(|_| self.index.def(def).sort != Sort::Species).unwrap_or(Sort::Any));
        }
        let species = self.index.lookup(self.at, &word.text).filter(|d| self.index.def(*d).kind == Kind::Species);
        match (self.index.element_of(&base.sort), species) {
            (Some(element), _) if Place::parse(&word.text).is_some() => {
                self.language(word.span, "a place of the grid");
                Found::of(element)
            }
            (_, Some(def)) => {
                self.known(word.span, def);
                Found::of(Sort::Concentration)
            }
            _ if Place::parse(&word.text).is_some() => {
                self.language(word.span, "a place of the grid");
                Found::nothing()
            }
            (element, None) => {
                self.name(word, &[]);
                Found::of(element.unwrap_or(Sort::Any))
            }
        }
    }

    /// `CO2(g)`: a species whose name ends with its phase, with the places of both.
    fn species_in_phase(&self, callee: &Expr, args: &[Arg]) -> Option<(Span, Span, DefId)> {
        let (ExprKind::Name(name), [Arg { name: None, value }]) = (&*callee.kind, args) else { return None };
        let ExprKind::Name(phase) = &*value.kind else { return None };
        let def = self.index.lookup(self.at, &format!("{}({})", name.text, phase.text))?;
        (self.index.def(def).kind == Kind::Species).then_some((name.span, phase.span, def))
    }

    /// `f(x, name: y)`.
    fn function(&mut self, callee: &Expr, args: &[Arg]) -> Found {
        if let Some((name, phase, def)) = self.species_in_phase(callee, args) {
            self.known(name, def);
            self.language(phase, "the phase of a species");
            return Found::of(self.index.def(def).sort.clone());
        }
        let mut params: Vec<DefId> = Vec::new();
        let mut result = Found::nothing();
        match &*callee.kind {
            ExprKind::Name(n) if !self.scope.iter().any(|(name, _)| *name == n.text) => {
                let def = self.index.lookup(self.at, &n.text);
                let def = def.filter(|d| matches!(self.index.def(*d).kind, Kind::Function | Kind::Relation));
                match def {
                    Some(def) => {
                        self.known(n.span, def);
                        params = self.index.def(def).inside.clone();
                        result.sort = self.index.def(def).sort.clone();
                    }
                    None if FOLDS.contains(&n.text.as_str()) => self.language(n.span, "over all of a set"),
                    None if SHAPES.contains(&n.text.as_str()) => self.language(n.span, "a shape, or how it is turned"),
                    None => match self.find(n) {
                        Some(meaning) => self.note(n.span, meaning),
                        None => self.note(n.span, Meaning::Unknown),
                    },
                }
            }
            ExprKind::Member(base, name) if matches!(name.text.as_str(), "first" | "last") => {
                let base = self.expr(base);
                self.member(&base.sort, name);
                result = base;
            }
            _ => {
                let callee = self.expr(callee);
                if let Sort::List(_) | Sort::Thing(..) = callee.sort {
                    result = callee;
                }
            }
        }
        let given = |p: &DefId| args.iter().any(|a| a.name.as_ref().is_some_and(|n| n.text == self.index.def(*p).name));
        let left: Vec<DefId> = params.iter().skip(args.len()).filter(|p| !given(p)).copied().collect();
        self.index.own.implicit.extend(left);
        for (at, arg) in args.iter().enumerate() {
            let param = match &arg.name {
                Some(name) => {
                    let param = params.iter().copied().find(|p| self.index.def(*p).name == name.text);
                    match param {
                        Some(param) => self.known(name.span, param),
                        None => self.language(name.span, "an argument"),
                    }
                    param
                }
                None => params.get(at).copied(),
            };
            let words = param.map(|p| self.index.def(p).words.clone()).unwrap_or_default();
            let given = self.expr_among(&arg.value, &words);
            // What a function gives that is told a kind is of that kind.
            if let (Sort::Kind(kind), Sort::Any) = (&given.sort, &result.sort) {
                result.sort = Sort::List(Box::new(Sort::Thing(vec![*kind], None)));
            }
        }
        result
    }

    /// A name that is looked up in the module only: a species, a solution, a class.
    pub(super) fn global(&mut self, name: &Name) {
        let local = self.scope.iter().rev().find(|(n, _)| *n == name.text).map(|s| s.1);
        let def = local.or_else(|| self.index.lookup(self.at, &name.text));
        self.maybe(name.span, def);
    }

    /// The values in a text.
    pub(super) fn text(&mut self, text: &Text) {
        for part in &text.parts {
            if let TextPart::Value { value, .. } = part {
                self.expr(value);
            }
        }
    }

    /// Several expressions.
    pub(super) fn exprs<'e>(&mut self, all: impl IntoIterator<Item = &'e Expr>) {
        for e in all {
            self.expr(e);
        }
    }
}
