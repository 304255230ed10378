//! What nodes of the graph are worth before a run: numbers with bounds, and sums of points in time.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::graph::{binary, unary};
use matterix_ir::model::{Action, Derivative, Domain, Event, State};
use matterix_ir::plan::{Plan, Step, StepId, Takes};
use matterix_ir::{BinaryOp, Graph, NodeId, Op, UnaryOp};

use crate::interval::Interval;
use crate::network::Point;

/// A sum of points in time with factors, of the time now with a factor, and of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// How often the time now is in it.
    pub now: f64,
    /// Points and how often each is in it; none is there 0 times.
    pub points: BTreeMap<Point, f64>,
    /// The number.
    pub number: Interval,
}

impl Linear {
    /// A number alone.
    pub fn number(number: Interval) -> Self {
        Linear { now: 0.0, points: BTreeMap::new(), number }
    }

    /// A point in time.
    pub fn at(point: Point) -> Self {
        Linear { now: 0.0, points: BTreeMap::from([(point, 1.0)]), number: Interval::ZERO }
    }

    /// Its bounds, where it is a number alone.
    pub fn bounds(&self) -> Option<Interval> {
        (self.now == 0.0 && self.points.is_empty()).then_some(self.number)
    }

    /// With the time now at a point.
    pub fn taken_at(mut self, point: Point) -> Self {
        let factor = std::mem::take(&mut self.now);
        self.add_point(point, factor);
        self
    }

    fn add_point(&mut self, point: Point, factor: f64) {
        let sum = self.points.remove(&point).unwrap_or(0.0) + factor;
        if sum != 0.0 {
            self.points.insert(point, sum);
        }
    }

    fn plus(mut self, other: Linear) -> Linear {
        self.now += other.now;
        self.number = self.number + other.number;
        other.points.into_iter().for_each(|(p, f)| self.add_point(p, f));
        self
    }

    fn scaled(mut self, by: f64) -> Linear {
        if by == 0.0 {
            return Linear::number(Interval::ZERO);
        }
        self.now *= by;
        self.number = self.number.scaled(by);
        self.points.values_mut().for_each(|f| *f *= by);
        self
    }
}

/// What is known before a run.
#[derive(Clone, Debug)]
pub struct Known<'g> {
    pub(crate) graph: &'g Graph,
    params: Vec<f64>,
    pub(crate) states: Vec<Option<f64>>,
    pub(crate) derivatives: &'g [Derivative],
    pub(crate) events: &'g [Event],
    /// How long operations last of which that follows from states, s, by step.
    pub lasting: BTreeMap<StepId, Interval>,
}

impl<'g> Known<'g> {
    /// Parameters (not a number: unknown) and the states that nothing ever changes.
    pub fn new(
        graph: &'g Graph,
        params: Vec<f64>,
        states: &[State],
        derivatives: &'g [Derivative],
        events: &'g [Event],
        plan: &Plan,
    ) -> Self {
        let mut moving: BTreeSet<u32> = derivatives.iter().map(|d| d.state).collect();
        let mut mixed = false;
        let operations = plan.steps.iter().filter_map(|s| match &s.step {
            Step::Operation(o) => Some(o.at_start.iter().chain(&o.at_end)),
            _ => None,
        });
        for action in operations.flatten().chain(events.iter().flat_map(|e| &e.actions)) {
            match action {
                Action::Assign { state, .. } => {
                    moving.insert(*state);
                }
                _ => mixed = true,
            }
        }
        let mut known =
            Known { graph, params, states: vec![None; states.len()], derivatives, events, lasting: BTreeMap::new() };
        let initial: Vec<Option<f64>> = states
            .iter()
            .enumerate()
            .map(|(i, s)| {
                // A transfer changes quantities, never truth or places.
                let shared = mixed && matches!(s.domain, Domain::Quantity(_));
                let still = !moving.contains(&(i as u32)) && !shared;
                if still { known.number(s.initial).exact() } else { None }
            })
            .collect();
        known.states = initial;
        known
    }

    /// Bounds of a node that names no point in time.
    pub fn number(&self, node: NodeId) -> Interval {
        self.linear(node, &[]).bounds().unwrap_or(Interval::ANY)
    }

    /// A node as a sum, with the locals that are known.
    pub fn linear(&self, node: NodeId, locals: &[Option<Linear>]) -> Linear {
        if let Some(value) = self.graph.constant(node) {
            return Linear::number(Interval::exactly(value));
        }
        let mut values: BTreeMap<NodeId, Linear> = BTreeMap::new();
        for n in self.graph.schedule([node]) {
            let value = self.operation(self.graph.op(n), &values, locals);
            values.insert(n, value);
        }
        values.remove(&node).unwrap_or(Linear::number(Interval::ANY))
    }

    /// The points in time that a condition waits for: it cannot hold before any of these sums is 0 or more.
    pub fn not_before(&self, condition: NodeId, locals: &[Option<Linear>]) -> Vec<Linear> {
        match self.graph.op(condition) {
            Op::Binary(BinaryOp::And, a, b) => {
                let mut all = self.not_before(a, locals);
                all.extend(self.not_before(b, locals));
                all
            }
            Op::Binary(BinaryOp::Le | BinaryOp::Lt, a, b) => {
                let difference = self.linear(b, locals).plus(self.linear(a, locals).scaled(-1.0));
                if difference.now == 1.0 { vec![difference] } else { Vec::new() }
            }
            _ => Vec::new(),
        }
    }

    /// Whether a node names values that the plan keeps.
    pub fn names_locals(&self, node: NodeId) -> bool {
        self.graph.depends(node, |op| matches!(op, Op::Local(_)))
    }

    /// Whether a condition comes out alike all through a run: it depends on nothing but parameters.
    pub fn is_fixed(&self, condition: NodeId) -> bool {
        let changes = |op: &Op| matches!(op, Op::State(_) | Op::Reading(_) | Op::Local(_) | Op::Time);
        !self.graph.depends(condition, changes)
    }

    /// A condition without the `not` before it, and how it comes out where the whole comes out like this.
    pub fn without_not(&self, condition: NodeId, holds: bool) -> (NodeId, bool) {
        match self.graph.op(condition) {
            Op::Unary(UnaryOp::Not, inner) => self.without_not(inner, !holds),
            _ => (condition, holds),
        }
    }

    /// Declared bounds of a duration, s; none where there are none or where they contradict themselves.
    pub fn bounds(&self, takes: Takes) -> Option<Interval> {
        let (low, high) = takes.bounds?;
        let bounds = Interval { min: self.number(low).min.max(0.0), max: self.number(high).max };
        (bounds.min <= bounds.max).then_some(bounds)
    }

    /// Whether a condition asks for nothing but time.
    pub fn only_time(&self, condition: NodeId) -> bool {
        !self.graph.depends(condition, |op| matches!(op, Op::State(_) | Op::Reading(_)))
    }

    fn operation(&self, op: Op, values: &BTreeMap<NodeId, Linear>, locals: &[Option<Linear>]) -> Linear {
        let unknown = || Linear::number(Interval::ANY);
        let at = |n: NodeId| values.get(&n).cloned().unwrap_or_else(unknown);
        let exact = |n: NodeId| at(n).bounds().and_then(Interval::exact);
        match op {
            Op::Const(v) => Linear::number(Interval::exactly(v)),
            Op::Time => Linear { now: 1.0, ..Linear::number(Interval::ZERO) },
            Op::Param(i) => {
                Linear::number(self.params.get(i as usize).map_or(Interval::ANY, |v| Interval::exactly(*v)))
            }
            Op::State(i) => {
                let value = self.states.get(i as usize).copied().flatten();
                Linear::number(value.map_or(Interval::ANY, Interval::exactly))
            }
            Op::Local(i) => locals.get(i as usize).cloned().flatten().unwrap_or_else(unknown),
            Op::Reading(_) | Op::List(..) | Op::Solved(..) => unknown(),
            Op::Unary(UnaryOp::Neg, a) => at(a).scaled(-1.0),
            Op::Unary(o, a) => Linear::number(exact(a).map_or(Interval::ANY, |a| Interval::exactly(unary(o, a)))),
            Op::Binary(BinaryOp::Add, a, b) => at(a).plus(at(b)),
            Op::Binary(BinaryOp::Sub, a, b) => at(a).plus(at(b).scaled(-1.0)),
            // A number equals itself; only a time that has not come yet does not.
            Op::Binary(BinaryOp::Eq, a, b) if a == b && at(a).number.exact().is_some() => {
                Linear::number(Interval::exactly(1.0))
            }
            Op::Binary(o, a, b) => match (o, exact(a), exact(b)) {
                (_, Some(a), Some(b)) => Linear::number(Interval::exactly(binary(o, a, b))),
                (BinaryOp::Mul, Some(by), None) => at(b).scaled(by),
                (BinaryOp::Mul, None, Some(by)) => at(a).scaled(by),
                (BinaryOp::Div, None, Some(by)) if by != 0.0 => at(a).scaled(1.0 / by),
                (BinaryOp::Max | BinaryOp::Min, ..) => match (at(a).bounds(), at(b).bounds()) {
                    (Some(x), Some(y)) => {
                        Linear::number(Interval { min: binary(o, x.min, y.min), max: binary(o, x.max, y.max) })
                    }
                    _ => unknown(),
                },
                _ => unknown(),
            },
            Op::Select(c, a, b) => match exact(c) {
                Some(0.0) => at(b),
                Some(_) => at(a),
                None => match (at(a).bounds(), at(b).bounds()) {
                    (Some(x), Some(y)) => Linear::number(x.either(y)),
                    _ => unknown(),
                },
            },
        }
    }
}
