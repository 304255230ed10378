//! Where instances stand: rigid transforms and the tree of supports.

use matterix_ir::math::{cos, sin};
use matterix_ir::scene::{Instance, InstanceId, Pose, Scene, Shape};

/// A rotation followed by a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    /// x, y, z in metres.
    pub(super) position: [f64; 3],
    /// Unit quaternion x, y, z, w.
    pub(super) rotation: [f64; 4],
}

impl Transform {
    /// Nothing moves.
    pub(super) const IDENTITY: Transform = Transform { position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// From roll, pitch and yaw, applied in this order about fixed axes.
    pub(super) fn of(pose: Pose) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = pose.rpy.map(|angle| (sin(angle / 2.0), cos(angle / 2.0)));
        let rotation = [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ];
        Transform { position: pose.position, rotation }
    }

    /// Up by a height, m.
    pub(super) fn up(height: f64) -> Self {
        Transform { position: [0.0, 0.0, height], ..Transform::IDENTITY }
    }

    /// `inner`, given in this frame, in the frame this one is given in.
    pub(super) fn then(self, inner: Transform) -> Self {
        let [x, y, z] = rotate(self.rotation, inner.position);
        let [px, py, pz] = self.position;
        Transform { position: [px + x, py + y, pz + z], rotation: product(self.rotation, inner.rotation) }
    }
}

fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

fn rotate([x, y, z, w]: [f64; 4], [px, py, pz]: [f64; 3]) -> [f64; 3] {
    let [tx, ty, tz] = [2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)];
    [px + w * tx + y * tz - z * ty, py + w * ty + z * tx - x * tz, pz + w * tz + x * ty - y * tx]
}

/// Height of a shape, m.
pub(super) fn height(shape: Shape) -> f64 {
    match shape {
        Shape::Box([_, _, z]) => z,
        Shape::Cylinder([_, z]) => z,
    }
}

/// What a thing stands on and where on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stand {
    /// In the lab.
    Lab(Transform),
    /// On the surface of an instance: its frame `place`, else the middle of its top.
    On(InstanceId, Transform),
    /// In the frame of the instance it is a part of.
    PartOf(InstanceId, Transform),
}

/// Where every instance stands when the run begins.
pub(super) fn initial(scene: &Scene) -> Vec<Stand> {
    let stand = |i: &Instance| match (i.owner, i.support) {
        (Some(owner), _) => Stand::PartOf(owner, Transform::of(i.pose)),
        (None, Some(support)) => Stand::On(support, Transform::of(i.pose)),
        (None, None) => Stand::Lab(Transform::of(i.pose)),
    };
    scene.instances.iter().map(stand).collect()
}

/// Every instance in the frame of the lab. Where supports form a ring, the ring is cut.
pub(super) fn in_lab(scene: &Scene, stands: &[Stand]) -> Vec<Transform> {
    (0..scene.instances.len()).map(|i| resolve(scene, stands, i)).collect()
}

fn resolve(scene: &Scene, stands: &[Stand], index: usize) -> Transform {
    let mut at = Transform::IDENTITY;
    let mut next = index;
    for _ in 0..=stands.len() {
        let (below, inner) = match stands.get(next) {
            Some(Stand::Lab(inner)) => return inner.then(at),
            Some(Stand::On(below, inner)) => (below, surface(scene, *below).then(*inner)),
            Some(Stand::PartOf(owner, inner)) => (owner, *inner),
            None => return at,
        };
        at = inner.then(at);
        next = below.0 as usize;
    }
    at
}

fn surface(scene: &Scene, id: InstanceId) -> Transform {
    let Some(instance) = scene.instances.get(id.0 as usize) else { return Transform::IDENTITY };
    let place = instance.frames.iter().find(|f| f.name == "place").map(|f| Transform::of(f.pose));
    place.or_else(|| instance.shape.map(|s| Transform::up(height(s)))).unwrap_or(Transform::IDENTITY)
}
