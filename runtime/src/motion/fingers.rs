//! Fingers of a gripper: how far they are apart, and where their joints stand for a width.
//!
//! Fingers are what a gripper's own joints move. They are apart what lies free between them on the y axis of the tip; that
//! follows from the collision shapes of the links, whatever the linkage.

use matterix_ir::pose::Pose;
use matterix_ir::robot::{JointLimits, Solid};
use matterix_ir::scene::InstanceId;
use matterix_motion::pose::pose;
use matterix_motion::time::{Limits, Trajectory, follow};
use matterix_motion::world::{Body, Shape, World};
use matterix_motion::{Tree, placement};

use super::assembly::Assembly;
use super::performed::Part;
use super::stage::Stage;
use super::way::{acceleration, jerk};

/// How exactly widths are met, m.
const EXACT: f64 = 1e-6;
/// Fingers further from the tip than this are none, m.
const FAR: f64 = 0.5;
/// Free room left on each side of a thing that fingers are opened for or let go, m.
const CLEARANCE: f64 = 0.010;

/// What opens and closes a gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingers {
    /// Indices into the variables of the whole robot.
    pub joints: Vec<usize>,
    /// Where those stand when it is closed and when it is open, rad or m.
    ends: [Vec<f64>; 2],
    /// How far the fingers are then apart, m.
    apart: [f64; 2],
    /// Shapes of the fingers with the link each is on.
    pads: Vec<(u32, Pose, Shape)>,
    tip: u32,
}

impl Fingers {
    /// The fingers of a robot; none where its gripper has no joints, or no shapes that meet.
    pub fn of(assembly: &Assembly, tree: &Tree, arm: &[usize]) -> Option<Self> {
        let robot = &assembly.robot;
        let body = assembly.owners.first()?;
        let is_tool = |joint: u32| {
            let child = robot.joints.get(joint as usize).map(|j| j.child as usize);
            child.and_then(|c| assembly.owners.get(c)).is_some_and(|owner| owner != body)
        };
        let variables = tree.variables();
        let own = |i: &usize| !arm.contains(i) && is_tool(variables[*i].joint) && variables[*i].is_bounded();
        let joints: Vec<usize> = (0..variables.len()).filter(own).collect();
        let limits: Vec<[f64; 2]> =
            joints.iter().map(|i| [variables[*i].limits.lower, variables[*i].limits.upper]).collect();
        let first = assembly.owners.iter().position(|owner| owner != body)? as u32;
        let pads = (first..).zip(robot.links.get(first as usize..)?);
        let pads = pads.flat_map(|(link, what)| what.collision.iter().map(move |piece| (link, piece)));
        let pads = pads.filter_map(|(link, p)| Some((link, p.placement, shape(&p.solid)?))).collect();
        let mut out = Fingers { joints, ends: Default::default(), apart: [0.0; 2], pads, tip: assembly.tip };
        if out.joints.is_empty() {
            return None;
        }
        // Each joint is open at the end where more lies free; the others stand in the middle meanwhile.
        let mut all = assembly.home.clone();
        let middle = |all: &mut Vec<f64>| {
            out.joints.iter().zip(&limits).for_each(|(i, l)| all[*i] = (l[0] + l[1]) / 2.0);
        };
        let mut ends = [Vec::new(), Vec::new()];
        for (i, [lower, upper]) in out.joints.iter().zip(&limits) {
            middle(&mut all);
            let mut free = |q: f64| {
                all[*i] = q;
                out.gap(tree, &all)
            };
            let (low, high) = (free(*lower)?, free(*upper)?);
            ends[0].push(if low < high { *lower } else { *upper });
            ends[1].push(if low < high { *upper } else { *lower });
        }
        out.ends = ends;
        for end in 0..2 {
            out.joints.iter().zip(&out.ends[end]).for_each(|(i, q)| all[*i] = *q);
            out.apart[end] = out.gap(tree, &all)?;
        }
        (out.apart[1] > out.apart[0] + EXACT).then_some(out)
    }

    /// Where the first of its joints stands when it is closed and when it is open, rad or m.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([*self.ends[0].first()?, *self.ends[1].first()?])
    }

    /// How far the fingers open at most, m.
    pub fn opening(&self) -> f64 {
        self.apart[1]
    }

    /// How far the fingers are apart, m; nothing where one of them is not beside the tip.
    pub fn gap(&self, tree: &Tree, all: &[f64]) -> Option<f64> {
        self.ways(tree, all, [0.0; 3]).map(|[one, other]| one + other)
    }

    /// How far it is from a point seen from the tip to the fingers on either side, along the tip's y axis and against it, m.
    pub(super) fn ways(&self, tree: &Tree, all: &[f64], point: [f64; 3]) -> Option<[f64; 2]> {
        let links = tree.poses(all);
        let tip = placement(links.get(self.tip as usize)?);
        let from = Pose { position: tip.point(point), ..tip };
        let bodies = self.pads.iter().filter_map(|(link, at, shape)| {
            let at = placement(links.get(*link as usize)?).then(*at);
            Some(Body { name: String::new(), pose: pose(&at), shape: shape.clone() })
        });
        let world = World { bodies: bodies.collect(), ..World::default() };
        Some([free(&world, from, 1.0)?, free(&world, from, -1.0)?])
    }

    /// Where the joints stand when the fingers are so far apart, m: as near as they get.
    pub fn at(&self, tree: &Tree, all: &[f64], apart: f64) -> Vec<f64> {
        let share = |s: f64| -> Vec<f64> {
            self.ends[0].iter().zip(&self.ends[1]).map(|(closed, open)| closed + s * (open - closed)).collect()
        };
        let mut all = all.to_vec();
        let [mut low, mut high] = match apart {
            a if a <= self.apart[0] => [0.0, 0.0],
            a if a >= self.apart[1] => [1.0, 1.0],
            _ => [0.0, 1.0],
        };
        while high - low > EXACT {
            let middle = (low + high) / 2.0;
            self.joints.iter().zip(share(middle)).for_each(|(i, q)| all[*i] = q);
            match self.gap(tree, &all) {
                Some(gap) if gap < apart => low = middle,
                _ => high = middle,
            }
        }
        share(high)
    }

    /// The motion of the fingers to a position of their joints.
    pub fn travel(&self, tree: &Tree, all: &[f64], to: &[f64]) -> Option<Trajectory> {
        let from: Vec<f64> = self.joints.iter().map(|i| all[*i]).collect();
        let limits = |f: fn(&JointLimits) -> f64| -> Vec<f64> {
            self.joints.iter().map(|i| f(&tree.variables()[*i].limits)).collect()
        };
        let limits =
            Limits { velocity: limits(|l| l.velocity), acceleration: limits(acceleration), jerk: limits(jerk) };
        follow(&[from, to.to_vec()], &limits, None).ok()
    }
}

impl Stage<'_> {
    /// Opens a gripper, or closes it, to a width, m; nothing where it has no fingers that move.
    pub(super) fn spread(&mut self, robot: InstanceId, width: f64) -> Option<Part> {
        let actor = self.actors.get_mut(&robot)?;
        let fingers = actor.fingers.clone()?;
        let to = fingers.at(&actor.tree, &actor.joints, width);
        let trajectory = fingers.travel(&actor.tree, &actor.joints, &to)?;
        actor.set_some(&fingers.joints, &to);
        Some(Part { wait: 0.0, joints: fingers.joints.clone(), trajectory })
    }

    /// Opens a gripper further than a thing is wide.
    pub(super) fn make_room(&mut self, robot: InstanceId, item: InstanceId) -> Option<Part> {
        let width = self.scene.get(item).body().across_grasp()?;
        self.spread(robot, width + 2.0 * CLEARANCE)
    }
}

/// The free way from the tip along its y axis, or against it, m; nothing where it meets no finger.
fn free(world: &World, tip: Pose, side: f64) -> Option<f64> {
    let mut way = 0.0;
    while way < FAR {
        let at = pose(&Pose::at(tip.point([0.0, side * way, 0.0]))).translation.vector.into();
        let nearest = world.bodies.iter().map(|b| b.nearest(&at).distance).min_by(f64::total_cmp)?;
        if nearest < EXACT {
            return Some(way);
        }
        way += nearest;
    }
    None
}

fn shape(solid: &Solid) -> Option<Shape> {
    match solid {
        Solid::Cuboid(size) => Some(Shape::Cuboid(size.map(|x| x / 2.0))),
        Solid::Cylinder([radius, length]) => Some(Shape::Cylinder(*radius, length / 2.0)),
        Solid::Sphere(radius) => Some(Shape::Sphere(*radius)),
        Solid::Mesh(..) => None,
    }
}
