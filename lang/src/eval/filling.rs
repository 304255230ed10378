//! How high a volume stands in an upright vessel, as its inside has it.

use std::f64::consts::PI;

use matterix_ir::filling;
use matterix_ir::scene::{InstanceId, Shape};

use super::{Num, Value};
use crate::eval::lab::Elaborator;

impl Elaborator<'_> {
    /// The height of a volume above the lowest point of the inside of a vessel, at most that of its rim; `unlimited` where its inside is
    /// not known.
    pub(super) fn standing_height(&mut self, id: InstanceId, volume: &Num) -> Value {
        let dimension = self.tables.units.named("Length");
        let points = self.inner_wall(id).map(|wall| filling::table(&wall)).filter(|points| points.len() > 1);
        match points {
            Some(points) => {
                let node = self.read_off(volume.node, points.into_iter());
                self.num(node, dimension)
            }
            None => Value::Unlimited,
        }
    }

    /// Radius and height along the inside of a vessel, or along one that is as wide at every height.
    fn inner_wall(&mut self, id: InstanceId) -> Option<Vec<[f64; 2]>> {
        let geometry = self.geometry(id);
        let straight = |area: f64, height: f64| {
            let radius = (area / PI).sqrt();
            vec![[0.0, 0.0], [radius, 0.0], [radius, height]]
        };
        match (geometry.inside, geometry.shape) {
            (Some(Shape::Turned { inside, .. }), _) | (None, Some(Shape::Turned { inside, .. })) => Some(inside),
            (None, shape) if shape == geometry.room => match shape? {
                Shape::Box([x, y, z]) => Some(straight(x * y, z)),
                Shape::Cylinder([d, z]) => Some(straight(PI * d * d / 4.0, z)),
                _ => None,
            },
            _ => None,
        }
    }
}
