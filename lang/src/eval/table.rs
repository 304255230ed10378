//! Tabulated functions: straight lines between points.

use matterix_ir::{BinaryOp, Diagnostic, Graph, NodeId, Span, codes};

use super::{Num, Value};
use crate::eval::lab::Elaborator;

/// A point of a table: where, and the value there.
pub(super) type Point = (f64, NodeId);

impl Elaborator<'_> {
    /// What a table of points `(x, y)` gives at `x`; not a number beyond its ends. Its comparisons are a tree, of which a run follows
    /// those only that decide where `x` is now.
    pub(super) fn interpolate(&mut self, x: &Num, points: &[Value], at: Span) -> Value {
        let mut table: Vec<Point> = Vec::new();
        let mut first: Option<Num> = None;
        for point in points {
            let Value::Tuple(pair) = point else { return self.expected("a point (x, y)", point, at) };
            let [Value::Num(px), Value::Num(py)] = pair.as_slice() else {
                return self.expected("a point (x, y) of two numbers", point, at);
            };
            let like = first.get_or_insert_with(|| py.clone()).clone();
            for (a, b) in [(x, px), (&like, py)] {
                if !a.dimension.agrees(&b.dimension) || a.point != b.point {
                    let (one, other) = (self.describe(a), self.describe(b));
                    let headline =
                        format!("all points of a table need the dimensions of the value looked up: {one} and {other}");
                    self.report(Diagnostic::error(codes::UNIT_MISMATCH, at, headline, "different dimensions"));
                    return Value::Error;
                }
            }
            let known =
                if self.prototype { self.known(px.node).or(Some(table.len() as f64)) } else { self.known(px.node) };
            match known.filter(|v| table.last().is_none_or(|(before, _)| before < v)) {
                Some(place) => table.push((place, py.node)),
                None => return self.not_a_table("the x values of a table must be constants in ascending order", at),
            }
        }
        let (Some(y), [(low, _), .., (high, _)]) = (first, table.as_slice()) else {
            return self.not_a_table("a table needs at least two points", at);
        };
        let inside = is_between(&mut self.graph, x.node, (*low, *high));
        let line = lines(&mut self.graph, x.node, &table);
        let beyond = self.graph.number(f64::NAN);
        let node = self.graph.select(inside, line, beyond);
        self.note_place(node, at);
        Value::Num(Num { node, literal: false, ..y })
    }

    fn not_a_table(&mut self, headline: &str, at: Span) -> Value {
        let d = Diagnostic::error(codes::WRONG_ARGUMENTS, at, headline, "not such a table");
        self.report(d.help("write `interpolate(x, [(0 degC, 1.79), (20 degC, 1.00), (40 degC, 0.65)])`"));
        Value::Error
    }
}

fn is_between(graph: &mut Graph, x: NodeId, (low, high): (f64, f64)) -> NodeId {
    let (low, high) = (graph.number(low), graph.number(high));
    let above = graph.binary(BinaryOp::Le, low, x);
    let below = graph.binary(BinaryOp::Le, x, high);
    graph.binary(BinaryOp::And, above, below)
}

/// The lines through points, halved until one is left.
pub(super) fn lines(graph: &mut Graph, x: NodeId, table: &[Point]) -> NodeId {
    if let [(x0, y0), (x1, y1)] = *table {
        let (start, span) = (graph.number(x0), graph.number(x1 - x0));
        let rise = graph.binary(BinaryOp::Sub, y1, y0);
        let slope = graph.binary(BinaryOp::Div, rise, span);
        let along = graph.binary(BinaryOp::Sub, x, start);
        let risen = graph.binary(BinaryOp::Mul, slope, along);
        return graph.binary(BinaryOp::Add, y0, risen);
    }
    let middle = table.len() / 2;
    let turn = graph.number(table[middle].0);
    let before = graph.binary(BinaryOp::Lt, x, turn);
    let (left, right) = (lines(graph, x, &table[..=middle]), lines(graph, x, &table[middle..]));
    graph.select(before, left, right)
}
