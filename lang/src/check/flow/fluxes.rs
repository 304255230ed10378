//! Rates as sums of what goes on: the same flux stands in the rate of each amount it changes, with a coefficient of its own. This
//! is the stoichiometry of the laws, read off their derivatives: reactions, streams and laws of the user's alike.

use std::collections::BTreeMap;
use std::rc::Rc;

use matterix_ir::{BinaryOp, NodeId, Op, UnaryOp};

use super::Interpreter;
use super::bonds::{Direction, Form, direction};
use super::state::AbstractState;
use super::value::AbstractValue;

/// Terms of a rate before it is taken as a whole.
const MOST_TERMS: usize = 256;

/// Something that goes on: what its rate is, while conditions come out so.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Flux {
    pub(super) rate: NodeId,
    pub(super) conditions: Vec<(NodeId, bool)>,
}

/// How a rate is made up.
#[derive(Debug)]
pub struct Row {
    /// The fluxes that change matter, with their coefficients.
    pub fluxes: Vec<(usize, f64)>,
    /// What else changes the state.
    pub rest: Vec<(Flux, f64)>,
}

/// What goes on by the laws of a lab.
#[derive(Debug, Default)]
pub struct Stoichiometry {
    /// What changes matter.
    pub fluxes: Vec<Flux>,
    /// What each of them changes, and the coefficient by which that direction is longer than it is written.
    pub directions: Vec<(Direction, f64)>,
    /// By derivative; none where no flux that changes matter stands in it.
    pub rows: Vec<Option<Rc<Row>>>,
    /// Nodes that are sums of states, and stand in something that is none.
    outer: Vec<bool>,
}

impl Interpreter<'_, '_> {
    /// What goes on by the laws; read off them once.
    pub fn stoichiometry(&mut self) -> Rc<Stoichiometry> {
        if let Some(known) = &self.nodes.stoichiometry {
            return known.clone();
        }
        let found = Rc::new(self.read_off());
        self.nodes.stoichiometry = Some(found.clone());
        // Only now is it known which sums hang on how states hang together.
        self.nodes.inputs.clear();
        found
    }

    fn read_off(&self) -> Stoichiometry {
        if !self.derivatives.iter().any(|d| self.amounts.contains(&d.state)) {
            return Stoichiometry::default();
        }
        let terms: Vec<Option<BTreeMap<Flux, f64>>> = self.derivatives.iter().map(|d| self.terms(d.rate)).collect();
        let mut places: BTreeMap<&Flux, usize> = BTreeMap::new();
        for (derivative, terms) in self.derivatives.iter().zip(&terms) {
            if self.amounts.contains(&derivative.state) {
                for flux in terms.iter().flat_map(BTreeMap::keys) {
                    let next = places.len();
                    places.entry(flux).or_insert(next);
                }
            }
        }
        let mut fluxes: Vec<(&Flux, usize)> = places.iter().map(|(flux, at)| (*flux, *at)).collect();
        fluxes.sort_by_key(|(_, at)| *at);
        let mut changes: Vec<Vec<(u32, f64)>> = vec![Vec::new(); fluxes.len()];
        let mut rows = Vec::with_capacity(terms.len());
        for (derivative, terms) in self.derivatives.iter().zip(&terms) {
            let mut row = Row { fluxes: Vec::new(), rest: Vec::new() };
            for (flux, c) in terms.iter().flatten() {
                match places.get(flux) {
                    Some(at) => {
                        row.fluxes.push((*at, *c));
                        changes[*at].push((derivative.state, *c));
                    }
                    None => row.rest.push((flux.clone(), *c)),
                }
            }
            rows.push(Some(Rc::new(row)).filter(|row| !row.fluxes.is_empty()));
        }
        Stoichiometry {
            directions: changes.into_iter().map(|c| direction(c).unwrap_or_default()).collect(),
            fluxes: fluxes.into_iter().map(|(flux, _)| flux.clone()).collect(),
            rows,
            outer: self.outer_sums(),
        }
    }

    /// The value of a node that is the same all the time, if it is known.
    fn fixed(&self, node: NodeId) -> Option<f64> {
        match self.lab.graph.op(node) {
            Op::Const(v) => Some(v),
            Op::Param(i) => self.params[i as usize].exact(),
            _ => None,
        }
    }

    /// A rate as a sum of fluxes; none where it has too many.
    pub(super) fn terms(&self, rate: NodeId) -> Option<BTreeMap<Flux, f64>> {
        let mut out: BTreeMap<Flux, f64> = BTreeMap::new();
        let mut todo = vec![(rate, 1.0, Vec::new())];
        while let Some((node, c, conditions)) = todo.pop() {
            match self.lab.graph.op(node) {
                Op::Const(0.0) => {}
                Op::Unary(UnaryOp::Neg, a) => todo.push((a, -c, conditions)),
                Op::Binary(BinaryOp::Add, a, b) => todo.extend([(a, c, conditions.clone()), (b, c, conditions)]),
                Op::Binary(BinaryOp::Sub, a, b) => todo.extend([(a, c, conditions.clone()), (b, -c, conditions)]),
                Op::Binary(BinaryOp::Mul, a, b) if self.fixed(a).is_some() => {
                    todo.push((b, c * self.fixed(a)?, conditions));
                }
                Op::Binary(BinaryOp::Mul, a, b) if self.fixed(b).is_some() => {
                    todo.push((a, c * self.fixed(b)?, conditions));
                }
                Op::Binary(BinaryOp::Div, a, b) if self.fixed(b).is_some_and(|by| by != 0.0) => {
                    todo.push((a, c / self.fixed(b)?, conditions));
                }
                Op::Select(when, a, b) => {
                    for (of, holds) in [(a, true), (b, false)] {
                        let mut conditions = conditions.clone();
                        if !conditions.contains(&(when, holds)) {
                            conditions.push((when, holds));
                        }
                        todo.push((of, c, conditions));
                    }
                }
                _ => *out.entry(Flux { rate: node, conditions }).or_default() += c,
            }
            if out.len() + todo.len() > MOST_TERMS {
                return None;
            }
        }
        out.retain(|_, c| *c != 0.0);
        Some(out)
    }

    /// Whether a flux may go on.
    pub(super) fn may_go(&mut self, flux: &Flux, facts: &AbstractState) -> bool {
        flux.conditions.iter().all(|(condition, holds)| self.eval(*condition, facts).truth() != Some(!holds))
    }

    /// Bounds of a flux.
    pub fn flux(&mut self, flux: &Flux, within: &AbstractState) -> (f64, f64) {
        self.bounded(flux, |flow, node| flow.enclose(node, within))
    }

    /// Bounds of a flux from those of its rate and its conditions.
    fn bounded(&mut self, flux: &Flux, mut value: impl FnMut(&mut Self, NodeId) -> AbstractValue) -> (f64, f64) {
        let mut certain = true;
        for (condition, holds) in &flux.conditions {
            match value(self, *condition).truth() {
                Some(truth) if truth != *holds => return (0.0, 0.0),
                Some(_) => {}
                None => certain = false,
            }
        }
        let (low, high) = value(self, flux.rate).bounds();
        if certain { (low, high) } else { (low.min(0.0), high.max(0.0)) }
    }

    /// Bounds of what changes a state besides the fluxes that change matter.
    pub fn rest(&mut self, row: &Row, within: &AbstractState) -> (f64, f64) {
        self.added_up(row, |flow, node| flow.enclose(node, within))
    }

    /// The same where the rate was evaluated just before, now that of what is known one state alone has changed.
    pub fn rest_again(&mut self, row: &Row, state: u32, within: &AbstractState) -> (f64, f64) {
        self.added_up(row, |flow, node| flow.enclose_again(node, state, within))
    }

    fn added_up(&mut self, row: &Row, mut value: impl FnMut(&mut Self, NodeId) -> AbstractValue) -> (f64, f64) {
        row.rest.iter().fold((0.0, 0.0), |(low, high), (flux, c)| {
            let bounds = self.bounded(flux, &mut value);
            let (a, b) = super::polytope::scaled(*c, bounds);
            (low + a, high + b)
        })
    }

    /// The nodes that are sums of states and stand in something that is none.
    fn outer_sums(&self) -> Vec<bool> {
        let ops = self.lab.graph.ops();
        let mut linear = vec![false; ops.len()];
        let mut outer = vec![false; ops.len()];
        for (i, op) in ops.iter().enumerate() {
            let is = |n: &NodeId| linear[n.0 as usize];
            linear[i] = match op {
                Op::State(_) | Op::Const(_) => true,
                Op::Param(_) => self.fixed(NodeId(i as u32)).is_some(),
                Op::Unary(UnaryOp::Neg, a) => is(a),
                Op::Binary(BinaryOp::Add | BinaryOp::Sub, a, b) => is(a) && is(b),
                Op::Binary(BinaryOp::Mul, a, b) => {
                    is(a) && is(b) && (self.fixed(*a).is_some() || self.fixed(*b).is_some())
                }
                Op::Binary(BinaryOp::Div, a, b) => is(a) && self.fixed(*b).is_some(),
                _ => false,
            };
            if !linear[i] {
                for n in op.operands() {
                    let sum = matches!(ops[n.0 as usize], Op::Binary(BinaryOp::Add | BinaryOp::Sub, ..));
                    outer[n.0 as usize] |= sum && linear[n.0 as usize];
                }
            }
        }
        for reading in &self.lab.readings {
            outer[reading.value.0 as usize] |= linear[reading.value.0 as usize];
        }
        outer
    }

    /// Whether a node is a sum of states that stands in something that is none.
    pub fn is_outer_sum(&self, node: NodeId) -> bool {
        self.nodes.stoichiometry.as_ref().is_some_and(|s| s.outer.get(node.0 as usize) == Some(&true))
    }

    /// A node as a sum of states; none where it is something else.
    pub fn form(&mut self, node: NodeId) -> Option<Rc<Form>> {
        if let Some(known) = self.nodes.forms.get(&node) {
            return known.clone();
        }
        let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
        let mut constant = 0.0;
        let mut todo = vec![(node, 1.0)];
        let mut is = true;
        while let Some((node, c)) = todo.pop() {
            match self.lab.graph.op(node) {
                Op::State(s) => *sums.entry(s).or_default() += c,
                Op::Unary(UnaryOp::Neg, a) => todo.push((a, -c)),
                Op::Binary(BinaryOp::Add, a, b) => todo.extend([(a, c), (b, c)]),
                Op::Binary(BinaryOp::Sub, a, b) => todo.extend([(a, c), (b, -c)]),
                op => match (self.fixed(node), op) {
                    (Some(v), _) => constant += c * v,
                    (None, Op::Binary(BinaryOp::Mul, a, b)) => match (self.fixed(a), self.fixed(b)) {
                        (Some(by), _) => todo.push((b, c * by)),
                        (_, Some(by)) => todo.push((a, c * by)),
                        _ => is = false,
                    },
                    (None, Op::Binary(BinaryOp::Div, a, b)) => match self.fixed(b).filter(|by| *by != 0.0) {
                        Some(by) => todo.push((a, c / by)),
                        None => is = false,
                    },
                    _ => is = false,
                },
            }
            if !is {
                break;
            }
        }
        let form = is.then(|| Rc::new(Form { constant, terms: sums.into_iter().collect() }));
        self.nodes.forms.insert(node, form.clone());
        form
    }

    /// What is known of a sum of states that hang together, as far as that is more than its parts say.
    pub fn together(&mut self, node: NodeId, apart: AbstractValue, facts: &AbstractState) -> AbstractValue {
        let Some(bonds) = facts.bonds.clone() else { return apart };
        let Some(form) = self.form(node) else { return apart };
        match bonds.sum(&form, facts) {
            Some(sum) => sum.within(&apart),
            None => apart,
        }
    }
}
