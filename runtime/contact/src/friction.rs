//! Friction between two given bodies, where it does not follow from their surfaces.

use std::collections::BTreeMap;

use rapier3d_f64::prelude::{ContactModificationContext, PhysicsHooks};

use crate::Id;

/// Coefficients of friction of pairs, the lower number first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairs(BTreeMap<[Id; 2], f64>);

impl Pairs {
    pub(crate) fn set(&mut self, a: Id, b: Id, friction: f64) {
        self.0.insert([a.min(b), a.max(b)], friction);
    }

    pub(crate) fn get(&self, a: Id, b: Id) -> Option<f64> {
        self.0.get(&[a.min(b), a.max(b)]).copied()
    }

    /// Whether a body is in one of the pairs.
    pub(crate) fn has(&self, id: Id) -> bool {
        self.0.keys().any(|pair| pair.contains(&id))
    }
}

impl PhysicsHooks for Pairs {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let number = |handle| context.colliders.get(handle).map(|collider| Id(collider.user_data as u32));
        let (Some(a), Some(b)) = (number(context.collider1), number(context.collider2)) else { return };
        if let (Some(friction), Some(manifold)) = (self.get(a, b), context.rigid_mut()) {
            *manifold.friction = friction;
        }
    }
}
