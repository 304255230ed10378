//! What stays in a vessel that is tilted, and how far a volume lets it tilt, as the inside of its shape has it.

use std::sync::Arc;

use matterix_ir::scene::{InstanceId, Shape};
use matterix_ir::{BinaryOp, NodeId, tilting};

use super::table::{Point, lines};
use super::{Num, Value};
use crate::eval::lab::Elaborator;

/// Points (tilt, volume), rad and m3; the tilts rise, the volumes fall to nothing.
pub type Tilts = Arc<[[f64; 2]]>;

impl Elaborator<'_> {
    /// The volume that stays in a vessel at a tilt; `unlimited` where its inside is not known.
    pub(super) fn kept(&mut self, id: InstanceId, tilt: &Num) -> Value {
        let dimension = self.tables.units.named("Volume");
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

    /// The table of a vessel; none where the inside of its shape is not known.
    fn tilts(&mut self, id: InstanceId) -> Option<Tilts> {
        let Some(Shape::Turned { inside, .. }) = self.geometry(id).shape else { return None };
        let key: Vec<u64> = inside.iter().flatten().map(|v| v.to_bits()).collect();
        let known = self.known_tilts.entry(key).or_insert_with(|| tilting::table(&inside).into());
        Some(known.clone()).filter(|points| points.len() > 1)
    }

    /// The value of a table at a place, or at the nearer of its ends.
    fn read_off(&mut self, x: NodeId, points: impl Iterator<Item = [f64; 2]>) -> NodeId {
        let table: Vec<Point> = points.map(|[x, y]| (x, self.graph.number(y))).collect();
        let [(low, _), .., (high, _)] = table[..] else { return self.graph.number(f64::NAN) };
        let [low, high] = [low, high].map(|end| self.graph.number(end));
        let above = self.graph.binary(BinaryOp::Max, x, low);
        let inside = self.graph.binary(BinaryOp::Min, above, high);
        lines(&mut self.graph, inside, &table)
    }
}
