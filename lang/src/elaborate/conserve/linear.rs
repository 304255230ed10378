//! Rates as sums of what cannot be taken apart, each with a factor: two rates that cancel show it by their form.

use std::collections::BTreeMap;

use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use crate::eval::lab::Elaborator;

/// The conditions under which a term counts, and the term.
type Key = (Vec<(NodeId, bool)>, NodeId);

/// A rate of more terms is not taken apart.
const MOST_TERMS: usize = 4096;

/// Factors are the same where they differ by less than this share of what was added up.
const SAME: f64 = 1e-9;

/// A sum of terms, with the magnitude of what was added up for each.
#[derive(Default)]
pub struct Linear(BTreeMap<Key, (f64, f64)>);

impl Linear {
    /// Adds `factor * node`; false where that has too many terms.
    pub fn add(&mut self, lab: &Elaborator<'_>, node: NodeId, factor: f64) -> bool {
        let mut open = vec![(Vec::new(), node, factor)];
        let mut looked = 0;
        while let Some((guards, node, factor)) = open.pop() {
            looked += 1;
            if looked > MOST_TERMS {
                return false;
            }
            match lab.graph.op(node) {
                Op::Const(0.0) => {}
                Op::Unary(UnaryOp::Neg, a) => open.push((guards, a, -factor)),
                Op::Binary(BinaryOp::Add, a, b) => open.extend([(guards.clone(), a, factor), (guards, b, factor)]),
                Op::Binary(BinaryOp::Sub, a, b) => open.extend([(guards.clone(), a, factor), (guards, b, -factor)]),
                Op::Select(c, a, b) => {
                    let under = |truth| guards.iter().copied().chain([(c, truth)]).collect();
                    open.extend([(under(true), a, factor), (under(false), b, factor)]);
                }
                op => match factored(lab, op) {
                    Some((rest, by)) => open.push((guards, rest, factor * by)),
                    None => {
                        let term = self.0.entry((guards, node)).or_default();
                        *term = (term.0 + factor, term.1 + factor.abs());
                    }
                },
            }
        }
        true
    }

    /// Whether nothing is left of it.
    pub fn vanishes(&self) -> bool {
        self.0.values().all(|(sum, of)| sum.abs() <= SAME * of)
    }
}

/// A product or quotient with something that is known before the run, as the rest and a factor.
fn factored(lab: &Elaborator<'_>, op: Op) -> Option<(NodeId, f64)> {
    match op {
        Op::Binary(BinaryOp::Mul, a, b) => lab.glance(a).map(|by| (b, by)).or_else(|| lab.glance(b).map(|by| (a, by))),
        Op::Binary(BinaryOp::Div, a, b) => lab.glance(b).filter(|by| *by != 0.0).map(|by| (a, 1.0 / by)),
        _ => None,
    }
    .filter(|(_, by)| by.is_finite())
}
