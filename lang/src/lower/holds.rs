//! `50 uL of dye from stock[A2]`: what a call says of its sources, as something it needs.

use std::collections::BTreeSet;

use matterix_ir::plan::{Condition, Refusal, Term};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, UnaryOp, codes};

use super::Planner;
use crate::ast::{Binary, Call, Expr, ExprKind, Name};
use crate::declare::SpeciesId;
use crate::eval::lab::substances::Substance;
use crate::eval::{Scope, Value};

/// The argument that says where something is taken from.
const SOURCE: &str = "from";

/// So many places that hold the right thing are named.
const PLACES_SHOWN: usize = 3;

impl<'a> Planner<'a, '_> {
    /// What a call needs of its sources because it says of what it takes something. A source that is a target of the
    /// same call changes before it is its turn: of it nothing is asked.
    pub(super) fn said_of_sources(&mut self, call: &'a Call, scope: &mut Scope) -> Vec<Condition> {
        let arguments = || call.object.iter().chain(call.labelled.iter().map(|(_, e)| e));
        let source = call.labelled.iter().find(|(label, _)| label.text == SOURCE);
        let Some((_, from)) = source else { return Vec::new() };
        let mut said: Vec<(&'a Expr, &'a Name)> = Vec::new();
        for e in arguments() {
            match of_what(e) {
                Said::Nothing => {}
                Said::Whole(parts, name) => {
                    self.lab.looked_into.extend(parts);
                    said.push((e, name));
                }
                Said::Part(parts, name) => {
                    self.say_of_part(parts.first().copied().unwrap_or(e.span), name);
                    self.lab.looked_into.extend(parts);
                }
            }
        }
        if said.is_empty() {
            return Vec::new();
        }
        let value = self.lab.expr(from, scope);
        let mut sources = self.mixtures_of(value);
        if sources.is_empty() {
            return Vec::new();
        }
        for (label, e) in &call.labelled {
            if label.text != SOURCE {
                let value = self.lab.expr(e, scope);
                let others = self.mixtures_of(value);
                sources.retain(|s| !others.contains(s));
            }
        }
        if self.lab.prototype || sources.is_empty() {
            return Vec::new();
        }
        let mut out = Vec::new();
        for (e, name) in said {
            let Some(substance) = self.lab.substance(name, scope.module) else { continue };
            out.push(self.all_hold(&sources, &substance, name, e.span));
        }
        out
    }

    /// `of` behind a part of an amount: which of the two is meant cannot be told.
    fn say_of_part(&mut self, part: Span, name: &Name) {
        let (part_text, name) = (self.text(part), &name.text);
        let headline = format!("`{part_text}` is only a part of the amount: `of {name}` is not checked");
        let d = Diagnostic::warning(codes::MISPLACED, part, headline, "a part of the amount");
        self.lab.report(d.help(format!("put the whole amount in brackets: `(...) of {name}`")));
    }

    fn all_hold(&mut self, sources: &BTreeSet<InstanceId>, what: &Substance, name: &Name, span: Span) -> Condition {
        let each: Vec<Condition> = sources.iter().map(|m| self.holds(*m, what, span)).collect();
        let mut node = self.lab.graph.number(1.0);
        for one in &each {
            node = self.lab.graph.binary(BinaryOp::And, node, one.node);
        }
        let places: BTreeSet<InstanceId> = match what {
            Substance::Species(s) => {
                let holds =
                    |m: &InstanceId| self.lab.instances[m.0 as usize].contents.iter().any(|(held, _)| held == s);
                self.lab.mixtures.iter().copied().filter(holds).collect()
            }
            Substance::Solution(id) => {
                self.lab.held.iter().filter(|held| held.solution == Some(*id)).filter_map(|held| held.mixture).collect()
            }
        };
        let places: Vec<String> =
            places.iter().take(PLACES_SHOWN).map(|m| format!("`{}`", self.lab.spoken_name(*m))).collect();
        let help = match places.as_slice() {
            [] => format!("the lab has no `{}`: name the right substance, or remove `of`", name.text),
            some => format!("the lab has `{}` in {}", name.text, some.join(", ")),
        };
        // What it holds instead, where it was filled before the run.
        let instead = sources.first().and_then(|m| Some((m, self.lab.instances[m.0 as usize].origin.clone()?)));
        let help = match instead {
            Some((m, origin)) => format!("{help}; `{}` contains `{origin}` at the start", self.lab.spoken_name(*m)),
            None => help,
        };
        let text = match each.as_slice() {
            [one] => format!("{} holds {}", one.text, name.text),
            _ => format!("every source holds {}", name.text),
        };
        let refusal = Some(Refusal { failure: "wrong_reagent".into(), help: Some(help), said: Vec::new() });
        let terms = match each.as_slice() {
            [one] => one.terms.clone(),
            _ => Vec::new(),
        };
        let each = if each.len() > 1 { each } else { Vec::new() };
        Condition { node, text, span, compared: Vec::new(), terms, refusal, each }
    }

    /// Whether one mixture holds a substance. That it holds anything at all is for the call itself to ask.
    fn holds(&mut self, mixture: InstanceId, what: &Substance, span: Span) -> Condition {
        let amounts: Vec<(SpeciesId, u32)> = self.lab.amounts_in(mixture).collect();
        let named: Vec<_> = match what {
            Substance::Species(s) => amounts.iter().filter(|(known, _)| known == s).collect(),
            Substance::Solution(_) => Vec::new(),
        };
        let terms = named.into_iter().map(|(s, state)| self.amount_of(mixture, *s, *state)).collect();
        let empty = self.all_empty(&amounts, &BTreeSet::new());
        let there = match what {
            Substance::Species(s) => self.is_there(&amounts, *s),
            Substance::Solution(id) => {
                self.lab.follows_lineage = true;
                let mut any = self.consists_of(&amounts, *id);
                for origin in self.reagents_of(*id) {
                    if let Some(touched) = self.lab.touched(mixture, &origin) {
                        any = self.lab.graph.binary(BinaryOp::Or, any, touched);
                    }
                }
                any
            }
        };
        let node = self.lab.graph.binary(BinaryOp::Or, empty, there);
        let text = self.lab.spoken_name(mixture);
        Condition { node, text, span, compared: Vec::new(), terms, refusal: None, each: Vec::new() }
    }

    fn amount_of(&mut self, mixture: InstanceId, species: SpeciesId, state: u32) -> Term {
        let name = format!("{}[{}]", self.lab.spoken_name(mixture), self.lab.tables.species.get(species).name);
        let domain = self.lab.states[state as usize].domain.clone();
        Term { name, node: self.lab.graph.add(Op::State(state)), domain }
    }

    /// Whether there is some of a species, or of all the ions it becomes in water.
    fn is_there(&mut self, amounts: &[(SpeciesId, u32)], species: SpeciesId) -> NodeId {
        let ions: Vec<SpeciesId> = self.lab.tables.species.get(species).dissolves.iter().map(|(ion, _)| *ion).collect();
        let whole = self.some_of(amounts, species);
        if ions.is_empty() {
            return whole;
        }
        let mut split = self.lab.graph.number(1.0);
        for ion in ions {
            let there = self.some_of(amounts, ion);
            split = self.lab.graph.binary(BinaryOp::And, split, there);
        }
        self.lab.graph.binary(BinaryOp::Or, whole, split)
    }

    fn some_of(&mut self, amounts: &[(SpeciesId, u32)], species: SpeciesId) -> NodeId {
        let zero = self.lab.graph.number(0.0);
        match amounts.iter().find(|(s, _)| *s == species) {
            Some((_, state)) => {
                let amount = self.lab.graph.add(Op::State(*state));
                self.lab.graph.binary(BinaryOp::Lt, zero, amount)
            }
            None => zero,
        }
    }

    /// Whether there is nothing, but for some species.
    fn all_empty(&mut self, amounts: &[(SpeciesId, u32)], but: &BTreeSet<SpeciesId>) -> NodeId {
        let mut empty = self.lab.graph.number(1.0);
        for (species, _) in amounts.iter().filter(|(s, _)| !but.contains(s)) {
            let there = self.some_of(amounts, *species);
            let none = self.lab.graph.unary(UnaryOp::Not, there);
            empty = self.lab.graph.binary(BinaryOp::And, empty, none);
        }
        empty
    }

    /// Whether a mixture consists of the species of a solution, all of them and no others.
    fn consists_of(&mut self, amounts: &[(SpeciesId, u32)], solution: crate::names::DeclId) -> NodeId {
        let parts: Vec<SpeciesId> = self.lab.composition(solution).into_iter().map(|(s, _)| s).collect();
        let ions = parts.iter().flat_map(|s| self.lab.tables.species.get(*s).dissolves.iter().map(|(ion, _)| *ion));
        let known: BTreeSet<SpeciesId> = ions.chain(parts.iter().copied()).collect();
        let mut node = self.all_empty(amounts, &known);
        for part in parts {
            let there = self.is_there(amounts, part);
            node = self.lab.graph.binary(BinaryOp::And, node, there);
        }
        node
    }

    /// What contents are called of which a solution is a part.
    fn reagents_of(&self, solution: crate::names::DeclId) -> BTreeSet<String> {
        let mixtures = self.lab.held.iter().filter(|held| held.solution == Some(solution)).filter_map(|h| h.mixture);
        mixtures.filter_map(|m| self.lab.instances[m.0 as usize].origin.clone()).collect()
    }

    /// The mixtures of a vessel or of several.
    fn mixtures_of(&self, value: Value) -> BTreeSet<InstanceId> {
        match self.lab.listed(value) {
            Value::List(items) | Value::Tuple(items) => items.into_iter().flat_map(|i| self.mixtures_of(i)).collect(),
            Value::Instance(i) | Value::Qualified(i, _) => {
                let walls = self.lab.walls_of(i);
                self.lab.is_mixture(walls).then_some(walls).into_iter().collect()
            }
            _ => BTreeSet::new(),
        }
    }
}

/// What an amount says of its substance.
enum Said<'a> {
    Nothing,
    /// All of it is of a substance; where that is said.
    Whole(Vec<Span>, &'a Name),
    /// A part of it, where another part may be of anything.
    Part(Vec<Span>, &'a Name),
}

/// `50 uL of dye`; an `of` behind a sum or product is of all of it: `volume - share of dye`.
fn of_what(e: &Expr) -> Said<'_> {
    match &*e.kind {
        ExprKind::Of(_, name) => Said::Whole(vec![e.span], name),
        ExprKind::Tuple(items, None) => match items.as_slice() {
            [one] => of_what(one),
            _ => Said::Nothing,
        },
        ExprKind::Binary(Binary::Add | Binary::Sub | Binary::Mul | Binary::Div, a, b) => {
            match (of_what(a), of_what(b)) {
                (Said::Nothing, said) | (said @ Said::Part(..), Said::Nothing) => said,
                (Said::Whole(spans, name), Said::Nothing) => Said::Part(spans, name),
                (Said::Whole(mut spans, name), Said::Whole(more, other)) if name.text == other.text => {
                    spans.extend(more);
                    Said::Whole(spans, name)
                }
                (
                    Said::Whole(mut spans, name) | Said::Part(mut spans, name),
                    Said::Whole(more, _) | Said::Part(more, _),
                ) => {
                    spans.extend(more);
                    Said::Part(spans, name)
                }
            }
        }
        _ => Said::Nothing,
    }
}
