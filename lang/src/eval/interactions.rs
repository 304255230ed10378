//! Interactions between what is dissolved in a mixture: which of them its law of activity counts, and their numbers.

use matterix_ir::equilibrium::{Interaction, Interactions, Layout, STANDARD};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, codes};

use super::{Scope, Value};
use crate::ast::{Expr, ExprKind};
use crate::declare::interactions::REACH;
use crate::declare::{SpeciesId, Type};
use crate::eval::equilibrium::expr_of;
use crate::eval::lab::Elaborator;

/// The option of an amount of matter that says when its activities follow interactions, and the number of Debye and Hueckel's term there.
const INTERACTIONS: &str = "interactions";

/// The option that names the function of two species which says how fast numbers of interactions fade, where they do not say it.
const REACH_BY: &str = "reach_by";

/// What acts on each other among the members of a mixture.
pub struct Acting {
    /// Which of all interactions they are.
    pub which: Vec<usize>,
    /// For the system; its members by number.
    pub written: Interactions,
}

impl<'a> Elaborator<'a> {
    /// The number of Debye and Hueckel's term in a mixture whose activities follow interactions; none where they do not.
    pub fn spread_of_interactions(&mut self, id: InstanceId) -> Option<f64> {
        let (option, member) = self.matter_option(id, INTERACTIONS)?;
        let ExprKind::Tuple(items, _) = &*option.value.kind else { return None };
        let mut scope = Scope::of_member(id, member);
        let mut numbers = items.iter().map(|item| {
            let value = self.expr(item, &mut scope);
            self.decided(&value)
        });
        let (holds, spread) = (numbers.next()??, numbers.next()??);
        (holds != 0.0).then_some(spread)
    }

    /// What acts on each other among these members.
    pub fn acting(&mut self, id: InstanceId, members: &[SpeciesId], spread: f64) -> Option<Acting> {
        let place = |s: &SpeciesId| members.iter().position(|m| m == s);
        let tables = self.tables;
        let (mut which, mut each) = (Vec::new(), Vec::new());
        for (k, def) in tables.interactions.iter().enumerate() {
            let Some(places) = def.members.iter().map(place).collect::<Option<Vec<usize>>>() else { continue };
            let reach = match *def.members.as_slice() {
                [a, b] => self.reach_of(id, k, [a, b])?,
                _ => [0.0; 2],
            };
            which.push(k);
            each.push(Interaction { members: places, reach });
        }
        Some(Acting { which, written: Interactions { spread, each } })
    }

    fn reach_of(&mut self, id: InstanceId, interaction: usize, [a, b]: [SpeciesId; 2]) -> Option<[f64; 2]> {
        let def = &self.tables.interactions[interaction];
        let module = def.module;
        let list = match expr_of(def.fields, REACH) {
            Some(given) => {
                let v = self.expr(given, &mut Scope::module(module));
                self.coerce(v, &Type::List(Type::ratio().into()), given.span, REACH)
            }
            None => {
                let (option, member) = self.matter_option(id, REACH_BY)?;
                let ExprKind::Text(name) = &*option.value.kind else { return None };
                let law = self.lookup(member.module, name)?;
                self.call_with(law, vec![Value::Species(a), Value::Species(b)])?
            }
        };
        let Value::List(numbers) = list else { return None };
        let numbers: Vec<f64> = numbers.iter().map(|n| self.decided(n)).collect::<Option<_>>()?;
        numbers.try_into().ok()
    }

    /// A number of which the form of the law depends.
    fn decided(&mut self, value: &Value) -> Option<f64> {
        let node = self.value_node(value)?;
        self.known(node)
    }

    /// The terms of all numbers of an interaction, as [`Layout`] has them.
    pub fn numbers_of_interaction(&mut self, interaction: usize) -> Option<Vec<[NodeId; Layout::TERMS]>> {
        let def = &self.tables.interactions[interaction];
        let (name, kind, fields, module) = (def.name.clone(), def.kind, def.fields, def.module);
        let none = self.graph.number(0.0);
        let mut all = Vec::new();
        for key in kind.numbers() {
            all.push(match expr_of(fields, key) {
                Some(given) => self.number_at_temperatures(&format!("{name}.{key}"), given, module)?,
                None => [none; Layout::TERMS],
            });
        }
        Some(all)
    }

    /// A number, or `[a0, a1, a2, a3, a4, a5]` of
    /// `a0 + a1 (1/T - 1/T0) + a2 ln(T / T0) + a3 (T - T0) + a4 (T^2 - T0^2) + a5 (1/T^2 - 1/T0^2)` with T0 = 298.15 K.
    fn number_at_temperatures(
        &mut self,
        name: &str,
        given: &'a Expr,
        module: usize,
    ) -> Option<[NodeId; Layout::TERMS]> {
        let v = self.expr(given, &mut Scope::module(module));
        let mut terms = [self.graph.number(0.0); Layout::TERMS];
        let Value::List(_) = v else {
            let Value::Num(n) = self.coerce(v, &Type::ratio(), given.span, name) else { return None };
            terms[0] = self.name_param(name, n, given.span).node;
            return Some(terms);
        };
        let Value::List(numbers) = self.coerce(v, &Type::List(Type::ratio().into()), given.span, name) else {
            return None;
        };
        if numbers.is_empty() || numbers.len() > Layout::TERMS {
            let headline = format!("this parameter takes 1 to {} terms, not {}", Layout::TERMS, numbers.len());
            let d = Diagnostic::error(codes::INTERACTION_FORM, given.span, headline, "terms of one parameter");
            self.report(d.help(
                "a0 + a1 (1/T - 1/T0) + a2 ln(T/T0) + a3 (T - T0) + a4 (T^2 - T0^2) + a5 (1/T^2 - 1/T0^2), in K, with T0 = 298.15",
            ));
            return None;
        }
        // Where each stands among the terms, and what it is multiplied by at the standard temperature.
        let t = STANDARD;
        let places = [(0, 0.0), (1, 1.0 / t), (2, t.ln()), (3, t), (5, t * t), (4, 1.0 / (t * t))];
        for (number, (place, there)) in numbers.iter().zip(places) {
            let node = self.value_node(number)?;
            terms[place] = match place {
                0 => node,
                _ => {
                    let there = self.graph.number(there);
                    let shift = self.graph.binary(BinaryOp::Mul, there, node);
                    terms[0] = self.graph.binary(BinaryOp::Sub, terms[0], shift);
                    node
                }
            };
        }
        Some(terms)
    }

    /// Checks the numbers of an interaction by themselves.
    pub fn check_interaction(&mut self, interaction: usize) {
        self.numbers_of_interaction(interaction);
        let def = &self.tables.interactions[interaction];
        let (fields, module) = (def.fields, def.module);
        if let Some(given) = expr_of(fields, REACH) {
            let v = self.expr(given, &mut Scope::module(module));
            let list = self.coerce(v, &Type::List(Type::ratio().into()), given.span, REACH);
            let Value::List(numbers) = &list else { return };
            let above = numbers.iter().all(|n| {
                let node = self.value_node(n);
                node.and_then(|node| self.glance(node)).is_some_and(|v| v.is_finite() && v > 0.0)
            });
            if numbers.len() != 2 || !above {
                let headline = "`reach` needs two numbers above 0";
                let d = Diagnostic::error(codes::INTERACTION_FORM, given.span, headline, "not such numbers");
                self.report(d.help("`reach: [2, 12]` for the numbers `b1` and `b2`"));
            }
        }
    }
}
