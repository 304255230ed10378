//! How high a volume stands in an upright vessel, as its inside has it.

use matterix_ir::filling;
use matterix_ir::scene::{InstanceId, Shape};

use super::{Num, Value};
use crate::eval::lab::Elaborator;

impl Elaborator<'_> {
    /// From the lowest point of the inside of a vessel up to its rim; `unlimited` where that is not known.
    pub(super) fn depth(&mut self, id: InstanceId) -> Value {
        match self.inner_wall(id) {
            Some(inside) => self.number(filling::depth(&inside), self.tables.units.named("Length"), false),
            None => Value::Unlimited,
        }
    }

    /// The volume that a vessel holds up to a height above its lowest point; `unlimited` where its inside is not known.
    pub(super) fn held_below(&mut self, id: InstanceId, height: &Num) -> Value {
        let dimension = self.tables.units.named("Volume");
        let Some(inside) = self.inner_wall(id) else { return Value::Unlimited };
        match self.graph.constant(height.node) {
            Some(height) => self.number(filling::below(&inside, height), dimension, false),
            None => {
                let points = filling::levels(&inside);
                let node = self.read_off(height.node, points.into_iter().map(|[volume, level]| [level, volume]));
                self.num(node, dimension)
            }
        }
    }

    /// The height of a volume above the lowest point of the inside of a vessel, at most that of its rim; `unlimited` where its inside is
    /// not known.
    pub(super) fn standing_height(&mut self, id: InstanceId, volume: &Num) -> Value {
        let Some(inside) = self.inner_wall(id) else { return Value::Unlimited };
        let node = self.read_off(volume.node, filling::levels(&inside).into_iter());
        self.num(node, self.tables.units.named("Length"))
    }

    /// Radius and height along the inside of a vessel, or along one that is as wide at every height.
    fn inner_wall(&mut self, id: InstanceId) -> Option<Vec<[f64; 2]>> {
        let geometry = self.geometry(id);
        let is_hollow = |shape: &Shape| matches!(shape, Shape::Turned { .. });
        let known = geometry.inside.or_else(|| geometry.shape.clone().filter(is_hollow)).or(geometry.room);
        filling::inside(&known?)
    }
}
