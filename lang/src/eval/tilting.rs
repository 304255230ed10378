//! What stays in a vessel that is tilted, and how far a volume lets it tilt, as the inside of its shape has it.

use std::sync::Arc;

use matterix_ir::scene::{InstanceId, Shape};
use matterix_ir::{BinaryOp, NodeId, UnaryOp, tilting};

use super::table::{Point, lines};
use super::{Num, Value};
use crate::eval::lab::Elaborator;

/// Points (tilt, volume), rad and m3; the tilts rise, the volumes fall to nothing.
pub type Tilts = Arc<[[f64; 2]]>;

impl Elaborator<'_> {
    /// The volume that stays in a vessel at a tilt; `unlimited` where its inside is not known.
    pub(super) fn kept(&mut self, id: InstanceId, tilt: &Num) -> Value {
        let dimension = self.tables.units.named("Volume");
        // What is no table's needs none.
        if let (Some(tilt), Some(inside)) = (self.graph.constant(tilt.node), self.hollow(id)) {
            return self.number(tilting::kept(&inside, tilt.max(0.0)), dimension, false);
        }
        match self.tilts(id) {
            Some(points) => {
                let node = self.read_off(tilt.node, points.iter().copied());
                self.num(node, dimension)
            }
            None => Value::Unlimited,
        }
    }

    /// The tilt at which a volume comes to the lip of a vessel; `unlimited` where its inside is not known.
    pub(super) fn brink(&mut self, id: InstanceId, volume: &Num) -> Value {
        let dimension = self.tables.units.named("Angle");
        match self.tilts(id) {
            Some(points) => {
                let node = self.read_off(volume.node, points.iter().rev().map(|[tilt, volume]| [*volume, *tilt]));
                self.num(node, dimension)
            }
            None => Value::Unlimited,
        }
    }

    /// How far below its lip a vessel reaches that is tilted about that, of what of it is no farther behind the lip than so much; 0 m where no
    /// shape is known. What has no outline is taken to go straight down from its lip.
    pub(super) fn droop(&mut self, id: InstanceId, tilt: &Num, behind: &Num) -> Value {
        let dimension = self.tables.units.named("Length");
        let geometry = self.geometry(id);
        let outline = match geometry.shape {
            Some(Shape::Turned { outside, .. }) => outside,
            Some(shape) => vec![[shape.rim(), 0.0], [shape.rim(), shape.size()[2]]],
            None => Vec::new(),
        };
        let Some(&[rim, top]) = outline.last() else { return self.number(0.0, dimension, false) };
        let (sin, cos) = (self.graph.unary(UnaryOp::Sin, tilt.node), self.graph.unary(UnaryOp::Cos, tilt.node));
        let mut turned = |out: f64, down: f64| {
            let mut sum = |a: NodeId, x: f64, b: NodeId, y: f64| {
                let [x, y] = [x, y].map(|v| self.graph.number(v));
                let (a, b) = (self.graph.binary(BinaryOp::Mul, a, x), self.graph.binary(BinaryOp::Mul, b, y));
                self.graph.binary(BinaryOp::Add, a, b)
            };
            // Before the lip, and below it.
            (sum(cos, out, sin, -down), sum(cos, down, sin, out))
        };
        let corners: Vec<(NodeId, NodeId)> = outline.iter().map(|[r, z]| turned(r - rim, top - z)).collect();
        let nothing = self.graph.number(0.0);
        let mut most = nothing;
        // How far each corner is before the line down to which it counts.
        let ahead: Vec<NodeId> =
            corners.iter().map(|(x, _)| self.graph.binary(BinaryOp::Add, *x, behind.node)).collect();
        let counts: Vec<NodeId> = ahead.iter().map(|ahead| self.graph.binary(BinaryOp::Le, nothing, *ahead)).collect();
        for ((_, low), counts) in corners.iter().zip(&counts) {
            let low = self.graph.select(*counts, *low, nothing);
            most = self.graph.binary(BinaryOp::Max, most, low);
        }
        for at in 1..corners.len() {
            let low = self.crossing([corners[at - 1].1, corners[at].1], [ahead[at - 1], ahead[at]]);
            let apart = self.graph.binary(BinaryOp::Mul, ahead[at - 1], ahead[at]);
            let crosses = self.graph.binary(BinaryOp::Lt, apart, nothing);
            let low = self.graph.select(crosses, low, nothing);
            most = self.graph.binary(BinaryOp::Max, most, low);
        }
        self.num(most, dimension)
    }

    /// What goes evenly from one value to another, where something else that does is 0.
    fn crossing(&mut self, [from, to]: [NodeId; 2], [begin, end]: [NodeId; 2]) -> NodeId {
        let [begin, end] = [begin, end].map(|v| self.graph.unary(UnaryOp::Abs, v));
        let least = self.graph.number(f64::MIN_POSITIVE);
        let whole = self.graph.binary(BinaryOp::Add, begin, end);
        let whole = self.graph.binary(BinaryOp::Max, whole, least);
        // The whole is no less than its beginning, whatever is known of either before the run.
        let (share, one) = (self.graph.binary(BinaryOp::Div, begin, whole), self.graph.number(1.0));
        let share = self.graph.binary(BinaryOp::Min, share, one);
        let step = self.graph.binary(BinaryOp::Sub, to, from);
        let step = self.graph.binary(BinaryOp::Mul, step, share);
        self.graph.binary(BinaryOp::Add, from, step)
    }

    /// The inside of a vessel that holds something, if that is known.
    fn hollow(&mut self, id: InstanceId) -> Option<Vec<[f64; 2]>> {
        let Some(Shape::Turned { inside, .. }) = self.geometry(id).shape else { return None };
        Some(inside).filter(|inside| tilting::kept(inside, 0.0) > 0.0)
    }

    /// The table of a vessel; none where the inside of its shape is not known.
    fn tilts(&mut self, id: InstanceId) -> Option<Tilts> {
        let inside = self.hollow(id)?;
        let key: Vec<u64> = inside.iter().flatten().map(|v| v.to_bits()).collect();
        let known = self.known_tilts.entry(key).or_insert_with(|| tilting::table(&inside).into());
        Some(known.clone()).filter(|points| points.len() > 1)
    }

    /// The value of a table at a place, or at the nearer of its ends.
    pub(super) fn read_off(&mut self, x: NodeId, points: impl Iterator<Item = [f64; 2]>) -> NodeId {
        let table: Vec<Point> = points.map(|[x, y]| (x, self.graph.number(y))).collect();
        let [(low, _), .., (high, _)] = table[..] else { return self.graph.number(f64::NAN) };
        let [low, high] = [low, high].map(|end| self.graph.number(end));
        let above = self.graph.binary(BinaryOp::Max, x, low);
        let inside = self.graph.binary(BinaryOp::Min, above, high);
        lines(&mut self.graph, inside, &table)
    }
}
