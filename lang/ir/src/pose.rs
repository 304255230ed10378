//! Rigid placements.

use serde::{Deserialize, Serialize};

use crate::math::{cos, sin};

/// A turn followed by a shift: where something is and how it stands, relative to something else.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// x, y, z in metres.
    pub position: [f64; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

impl Default for Pose {
    fn default() -> Self {
        Pose::IDENTITY
    }
}

impl Pose {
    /// At the origin, not turned.
    pub const IDENTITY: Pose = Pose { position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// Not turned; m.
    pub const fn at(position: [f64; 3]) -> Self {
        Pose { position, ..Pose::IDENTITY }
    }

    /// Up by a height, m.
    pub const fn up(height: f64) -> Self {
        Pose::at([0.0, 0.0, height])
    }

    /// Turned by roll, pitch and yaw in rad, in this order about fixed axes.
    pub fn turned(position: [f64; 3], rpy: [f64; 3]) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = rpy.map(|angle| (sin(angle / 2.0), cos(angle / 2.0)));
        let rotation = [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ];
        Pose { position, rotation }
    }

    /// `inner`, given in this frame, in the frame this one is given in.
    pub fn then(self, inner: Pose) -> Self {
        Pose { position: self.point(inner.position), rotation: product(self.rotation, inner.rotation) }
    }

    /// A point of this frame in the frame this one is given in.
    pub fn point(self, inner: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = rotate(self.rotation, inner);
        let [px, py, pz] = self.position;
        [px + x, py + y, pz + z]
    }

    /// What undoes it.
    pub fn inverse(self) -> Self {
        let [x, y, z, w] = self.rotation;
        let rotation = [-x, -y, -z, w];
        Pose { position: rotate(rotation, self.position.map(|v| -v)), rotation }
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
