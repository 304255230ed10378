//! Bodies as they come into a world.

use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_solids::Body;
use rapier3d_f64::prelude::{AngVector, MassProperties, Matrix, Vector};

/// A body of a world, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(pub u32);

/// What moves a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Nothing.
    Fixed,
    /// It goes where it is led, whatever is in its way.
    Led,
    /// Forces.
    Loose(Inertial),
}

/// A body that comes into a world.
#[derive(Clone, Debug)]
pub struct Thing<'a> {
    /// Its solid parts, each with its place on it.
    pub parts: Vec<(Pose, &'a Body)>,
    /// How robots feel it from outside, where that is simpler: they touch this instead. Walls made of many pieces have inner sides, which a finger
    /// that presses on them would feel.
    pub outside: Vec<(Pose, &'a Body)>,
    /// Where it is.
    pub at: Pose,
    /// What moves it.
    pub kind: Kind,
    /// Coefficient of friction of its surface; of two the lesser counts.
    pub friction: f64,
    /// How much of its speed it keeps when it hits something, 0 to 1; of two the lesser counts.
    pub bounce: f64,
    /// Parts of robots do not touch each other: their planner keeps them apart, and fingers slide in their hand.
    pub robot: bool,
}

/// Mass, centre and inertia as the engine has them.
pub(crate) fn mass(inertial: &Inertial) -> MassProperties {
    let [xx, xy, xz, yy, yz, zz] = inertial.inertia;
    let own = Matrix::from_cols(Vector::new(xx, xy, xz), Vector::new(xy, yy, yz), Vector::new(xz, yz, zz));
    let turn = matterix_solids::isometry(&inertial.placement);
    let axes = Matrix::from_quat(turn.rotation);
    let inertia = axes * own * axes.transpose();
    if inertial.mass > 0.0 {
        MassProperties::with_inertia_matrix(turn.translation, inertial.mass, inertia)
    } else {
        MassProperties::new(turn.translation, 0.0, AngVector::ZERO)
    }
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
