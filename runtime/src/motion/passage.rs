//! Why a robot that drives does not get somewhere: the gap that it does not pass.

use std::f64::consts::PI;

use matterix_ir::math::{cos, sin};
use matterix_ir::pose::Pose;
use matterix_ir::robot::{Robot, Solid};
use matterix_ir::scene::InstanceId;
use matterix_motion::placement;
use matterix_motion::plan::{self, Settings};
use serde::{Deserialize, Serialize};

use super::exact::Exact;
use super::perturb::pieces;
use super::stage::Stage;
use super::surroundings::Surroundings;

/// Samples drawn for a way past something; what opens a way to a base opens it at once.
const SAMPLES: usize = 4000;
/// Directions in which the width of a base is measured.
const DIRECTIONS: u32 = 36;
/// What is nearer to another thing than this touches it, m.
const GAP: f64 = 1e-3;

/// A way that is closed to a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Passage {
    /// Either of what it does not get past would leave a way if it were not there, with what is between them, m.
    pub gap: Option<([InstanceId; 2], f64)>,
    /// The one thing without which there would be a way, where it is one.
    pub by: Option<InstanceId>,
    /// How much room the robot needs to pass, m.
    pub needs: f64,
}

impl Stage<'_> {
    /// What closes the way of a robot to where its arm would reach one of some poses; nothing where there is no such
    /// place, where it stands for good, or where it gets there.
    pub(super) fn passage(&self, robot: InstanceId, to: &[Pose]) -> Option<Passage> {
        let actor = self.actors.get(&robot).filter(|actor| !actor.drive.is_empty())?;
        let mut stage = self.clone();
        let home: Vec<f64> = actor.arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
        stage.settle(robot, &actor.arm, &home);
        let place = stage.places(robot, to, &actor.drive).into_iter().next()?.drive;
        if stage.passes(robot, &place, &[]) {
            return None;
        }
        let mut around: Vec<InstanceId> = Surroundings::of_driving(&stage, robot).owners;
        around.sort_unstable();
        around.dedup();
        let opens: Vec<InstanceId> = around.into_iter().filter(|id| stage.passes(robot, &place, &[*id])).collect();
        let needs = stage.width(robot)?;
        let pairs = opens.iter().enumerate().flat_map(|(k, a)| opens[k + 1..].iter().map(move |b| [*a, *b]));
        let gaps = pairs.filter_map(|[a, b]| Some(([a, b], stage.gap(a, b)?)));
        // Of several the widest: it is the nearest to being a way.
        let gap = gaps.filter(|(_, wide)| (GAP..needs).contains(wide)).max_by(|a, b| a.1.total_cmp(&b.1));
        let by = opens.first().copied().filter(|_| opens.len() == 1);
        Some(Passage { gap, by, needs })
    }

    /// Whether a robot drives to a place with these things not there.
    fn passes(&self, robot: InstanceId, to: &[f64], without: &[InstanceId]) -> bool {
        let Some(actor) = self.actors.get(&robot) else { return false };
        let left_out = [self.carriers(robot).as_slice(), without].concat();
        let around = Surroundings::of_but(self, robot, &left_out, &[]);
        let Ok(figure) = self.figure(robot, actor, &actor.drive) else { return false };
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let settings = Settings { iterations: SAMPLES, ..Settings::default() };
        plan::plan(&mut checker, &actor.positions(&actor.drive), to, &settings).is_ok()
    }

    /// What is between two things seen from above, m.
    fn gap(&self, a: InstanceId, b: InstanceId) -> Option<f64> {
        let (one, other) = (pieces(self, a), pieces(self, b));
        one.iter().flat_map(|p| other.iter().map(|q| p.apart(q))).min_by(f64::total_cmp)
    }

    /// The least width of a robot seen from above, as it stands, m.
    fn width(&self, robot: InstanceId) -> Option<f64> {
        let actor = self.actors.get(&robot)?;
        let links = actor.tree.poses(&actor.joints);
        let robot = &actor.assembly.robot;
        let mut seen: Vec<([f64; 3], f64)> = Vec::new();
        for (link, at) in robot.links.iter().zip(&links) {
            let pieces = link.collision.iter().map(|piece| (placement(at).then(piece.placement), piece));
            seen.extend(pieces.flat_map(|(at, piece)| outer(robot, &piece.solid, at)));
        }
        let across = |k: u32| {
            let angle = PI * f64::from(k) / f64::from(DIRECTIONS);
            let (c, s) = (cos(angle), sin(angle));
            let along = |([x, y, _], r): &([f64; 3], f64)| (c * x + s * y - r, c * x + s * y + r);
            let low = seen.iter().map(|ball| along(ball).0).fold(f64::INFINITY, f64::min);
            seen.iter().map(|ball| along(ball).1).fold(f64::NEG_INFINITY, f64::max) - low
        };
        (0..DIRECTIONS).map(across).min_by(f64::total_cmp).filter(|_| !seen.is_empty())
    }
}

/// Balls between which a solid lies, in the lab: what of it is farthest out is on one of them.
fn outer(robot: &Robot, solid: &Solid, at: Pose) -> Vec<([f64; 3], f64)> {
    let corners = |low: [f64; 3], high: [f64; 3]| -> Vec<([f64; 3], f64)> {
        let corner = |k: u8| [0, 1, 2].map(|axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
        (0..8).map(|k| (at.point(corner(k)), 0.0)).collect()
    };
    match solid {
        Solid::Cuboid(size) => corners(size.map(|s| -s / 2.0), size.map(|s| s / 2.0)),
        Solid::Sphere(r) => vec![(at.position, *r)],
        Solid::Cylinder([r, length]) => corners([-r, -r, -length / 2.0], [*r, *r, length / 2.0]),
        Solid::Mesh(name, scale) => {
            let bounds = robot.meshes.get(name).map(|mesh| mesh.bounds());
            bounds
                .map(|b| b.map(|p| [0, 1, 2].map(|k: usize| p[k] * scale[k])))
                .map_or(Vec::new(), |[a, b]| corners(a, b))
        }
    }
}
