//! What a transfer leaves behind: `move(q, from: a, to: b, but: each(s in set: share))`.
//!
//! Of each species of the set its share stays, whatever is taken of the rest. What belongs to no species, such as heat, stays with it by a
//! law of the library: the option `of_each` of an extensive quantity names the function of a mixture and a species that says how much of
//! the quantity is that species'. The quantity that is asked for, a volume say, is that of what may leave.

use std::collections::{BTreeMap, HashMap};

use matterix_ir::model::{Kept, Stays};
use matterix_ir::scene::InstanceId;
use matterix_ir::{BinaryOp, Diagnostic, NodeId, Op, Span, codes};

use crate::ast::{Expr, ExprKind, MemberKind};
use crate::declare::{SpeciesId, Type};
use crate::eval::lab::{Elaborator, ExtensiveKey};
use crate::eval::{Scope, Value};

/// The option that names the function of a mixture and a species whose value is how much of an extensive quantity is that species'.
pub const OF_EACH: &str = "of_each";

/// The argument of `move` that says what stays.
pub const BUT: &str = "but";

/// What stays behind of a mixture.
#[derive(Clone, Debug, Default)]
pub struct HeldBack {
    /// The share that stays of a species, where it may be other than 0.
    pub shares: BTreeMap<SpeciesId, NodeId>,
    /// The same, by the states of the mixture.
    pub kept: Box<[Kept]>,
}

impl<'a> Elaborator<'a> {
    /// What `but: each(s in set: share)` leaves behind of a mixture.
    pub fn held_back(&mut self, but: &'a Expr, from: InstanceId, scope: &mut Scope) -> Option<HeldBack> {
        let shares = self.shares_held(but, scope)?;
        if shares.is_empty() || self.is_at_equilibrium(&shares, from, but.span) {
            return Some(HeldBack::default());
        }
        let mut kept = Vec::new();
        for (key, state) in self.quantities_of(from) {
            match key.species {
                Some(s) => kept.extend(shares.get(&s).map(|share| Kept { state, stays: Stays::Share(*share) })),
                None => {
                    let amount = self.amount_held(&key, &shares, but.span)?;
                    if self.graph.constant(amount) != Some(0.0) {
                        kept.push(Kept { state, stays: Stays::Amount(amount) });
                    }
                }
            }
        }
        Some(HeldBack { shares, kept: kept.into() })
    }

    /// A size of a mixture without what stays behind of it.
    pub fn free_size(&mut self, size: NodeId, held: &HeldBack) -> NodeId {
        let one = self.graph.number(1.0);
        let mut free = HashMap::new();
        for kept in &held.kept {
            if let Stays::Share(share) = kept.stays {
                let leaves = self.graph.binary(BinaryOp::Sub, one, share);
                let all = self.graph.add(Op::State(kept.state));
                free.insert(kept.state, self.graph.binary(BinaryOp::Mul, leaves, all));
            }
        }
        if free.is_empty() { size } else { self.graph.with_states(size, &free) }
    }

    /// The shares that stay, by species.
    fn shares_held(&mut self, but: &'a Expr, scope: &mut Scope) -> Option<BTreeMap<SpeciesId, NodeId>> {
        let (var, set, body) = match &*but.kind {
            ExprKind::Fold { fold, var, set, body } if fold.text == "each" => (var, set, body),
            ExprKind::Error => return None,
            _ => {
                let headline = "`but` needs the share of each species that stays behind";
                let d = Diagnostic::error(codes::WRONG_ARGUMENTS, but.span, headline, "not such shares");
                self.report(d.help("write `but: each(s in a.contents.species: share)`"));
                return None;
            }
        };
        let mut shares = BTreeMap::new();
        for item in self.set(set, scope)? {
            let s = match item {
                Value::Species(s) => s,
                Value::Error => return None,
                other => {
                    self.expected("a species", &other, set.span);
                    return None;
                }
            };
            scope.bind(var.text.clone(), Value::Species(s));
            let value = self.expr(body, scope);
            let value = self.coerce(value, &Type::ratio(), body.span, BUT);
            scope.vars.pop();
            let Value::Num(share) = value else { return None };
            self.note_place(share.node, body.span);
            if shares.insert(s, share.node).is_some() {
                let name = self.tables.species.get(s).name.clone();
                let headline = format!("`{name}` is named twice: which share of it stays behind?");
                self.report(Diagnostic::error(codes::WRONG_ARGUMENTS, set.span, headline, "named twice here"));
                return None;
            }
        }
        shares.retain(|_, share| self.graph.constant(*share) != Some(0.0));
        Some(shares)
    }

    /// Reports species that equilibria have: what is put in of them is not what is there, so that a share of it means nothing.
    fn is_at_equilibrium(&mut self, shares: &BTreeMap<SpeciesId, NodeId>, from: InstanceId, at: Span) -> bool {
        let Some(speciation) = self.speciation(from) else { return false };
        let moved = &speciation.members[..speciation.moved];
        let Some(s) = shares.keys().find(|s| moved.contains(s)) else { return false };
        let name = self.tables.species.get(*s).name.clone();
        let headline = format!("`{name}` takes part in an equilibrium: holding it back is not supported yet");
        let d = Diagnostic::error(codes::UNSUPPORTED, at, headline, "not supported yet");
        self.report(d.help("hold back only what no equilibrium of the file has, or leave the equilibrium out"));
        true
    }

    /// The extensive quantities of a mixture, with their states.
    fn quantities_of(&self, mixture: InstanceId) -> Vec<(ExtensiveKey, u32)> {
        let first = ExtensiveKey { instance: mixture, member: String::new(), species: None, matter: false };
        let of = self.extensive.range(first..).take_while(|(key, _)| key.instance == mixture);
        of.map(|(key, state)| (key.clone(), *state)).collect()
    }

    /// How much of a quantity of the whole mixture stays with the species that do.
    fn amount_held(&mut self, key: &ExtensiveKey, shares: &BTreeMap<SpeciesId, NodeId>, at: Span) -> Option<NodeId> {
        let law = self.members_of(key.instance, &key.member).first().copied().and_then(|m| {
            let MemberKind::Value { options, .. } = &m.member.kind else { return None };
            let option = options.iter().find(|o| o.name.text == OF_EACH)?;
            let ExprKind::Text(name) = &*option.value.kind else { return None };
            self.lookup(m.module, name)
        });
        let Some(law) = law else {
            let headline =
                format!("what part of `{}` stays with the species that are held back is not known", key.member);
            let d = Diagnostic::error(codes::UNSUPPORTED, at, headline, "cannot be divided");
            let help = format!(
                "name the function of a mixture and a species that says so at its declaration: `{{ {OF_EACH}: \"...\" }}`"
            );
            self.report(d.help(help));
            return None;
        };
        let here: Vec<SpeciesId> = self.amounts_in(key.instance).map(|(s, _)| s).collect();
        let mut sum = self.graph.number(0.0);
        for (s, share) in shares.iter().filter(|(s, _)| here.contains(s)) {
            let value = self.call_with(law, vec![Value::Instance(key.instance), Value::Species(*s)])?;
            let Value::Num(part) = value else { return None };
            let stays = self.graph.binary(BinaryOp::Mul, *share, part.node);
            sum = self.graph.binary(BinaryOp::Add, sum, stays);
        }
        Some(sum)
    }
}
