//! Where bodies touch, and how hard.

use rapier3d_f64::prelude::{ContactManifold, Vector};

use crate::world::{STEP, World};
use crate::{Id, thing};

/// Two bodies that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// What is asked about.
    pub of: Id,
    /// What touches it.
    pub by: Id,
    /// In the middle of where they touch, m.
    pub point: [f64; 3],
    /// The force that presses it, away from what touches it, N.
    pub press: [f64; 3],
    /// The force along the surface on it, N.
    pub rub: [f64; 3],
    /// The coefficient of friction between them.
    pub friction: f64,
    /// How far they reach into each other, m.
    pub depth: f64,
}

impl Touch {
    /// How hard it is pressed, N.
    pub fn pressed(&self) -> f64 {
        thing::length(self.press)
    }

    /// How hard it is pulled along the surface, N.
    pub fn rubbed(&self) -> f64 {
        thing::length(self.rub)
    }
}

impl World {
    /// All that touches a body with some force, in the order of numbers.
    pub fn touches(&self, of: Id) -> Vec<Touch> {
        let mut out = Vec::new();
        let own = self.colliders_of(of);
        for pair in own.iter().flat_map(|collider| self.narrow.contact_pairs_with(*collider)) {
            let first = own.contains(&pair.collider1);
            let other = if first { pair.collider2 } else { pair.collider1 };
            let Some(by) = self.colliders.get(other).map(|c| Id(c.user_data as u32)) else { continue };
            let sign = if first { -1.0 } else { 1.0 };
            let (mut press, mut rub, mut point, mut weight) = (Vector::ZERO, Vector::ZERO, Vector::ZERO, 0.0);
            let (mut friction, mut depth) = (0.0, 0.0f64);
            for manifold in pair.rigid().map_or(&[][..], |rigid| rigid.solver_manifolds()) {
                friction = manifold.data.friction;
                let (push, pull) = forces(manifold);
                press += push * sign;
                rub += pull * sign;
                for (contact, at) in manifold.data.solver_contacts.iter().zip(manifold.points.iter()) {
                    let (a, b) = manifold.data.solver_contact_world_points(contact, &self.bodies);
                    let force = at.data.impulse.max(0.0) + f64::MIN_POSITIVE;
                    point += (a + b) * (0.5 * force);
                    weight += force;
                    depth = depth.max(-at.dist);
                }
            }
            if press.length() > 0.0 && weight > 0.0 {
                let (press, rub) = ((press / STEP).to_array(), (rub / STEP).to_array());
                out.push(Touch { of, by, point: (point / weight).to_array(), press, rub, friction, depth });
            }
        }
        out.sort_by_key(|touch| touch.by);
        out
    }
}

/// What a manifold does to its second body, along the normal and across it, N s.
fn forces(manifold: &ContactManifold) -> (Vector, Vector) {
    let normal = manifold.data.normal;
    let mut out = (Vector::ZERO, Vector::ZERO);
    for point in &manifold.points {
        out.0 += normal * point.data.impulse;
        out.1 += point.data.warmstart_tangent_world;
    }
    out
}
