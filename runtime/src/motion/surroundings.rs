//! What a robot must not run into, as solids, and what it holds, as balls.

use std::f64::consts::TAU;

use matterix_ir::math;
use matterix_ir::pose::Pose;
use matterix_ir::robot;
use matterix_ir::scene::{InstanceId, Shape};
use matterix_motion::pose::pose;
use matterix_motion::spheres::Held;
use matterix_motion::world::{Body, Shape as Solid, World};

use super::fixture::following;
use super::stage::{Actor, Stage};

/// How far balls may reach into what things stand on or in before it counts, m: shapes are nominal.
pub const SLACK: f64 = 2e-3;

/// Solids around a robot with the instance each belongs to.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// What is around.
    pub world: World,
    /// By body of the world.
    pub owners: Vec<InstanceId>,
    /// Those without their main body.
    pub bodiless: Vec<InstanceId>,
}

impl Surroundings {
    /// Everything but the robot and what it holds. What carries it may touch what of it does not move.
    pub fn of(stage: &Stage<'_>, robot: InstanceId) -> Self {
        Self::of_but(stage, robot, &[], &[])
    }

    /// As [`Surroundings::of`] for a robot that drives: on what carries it.
    pub fn of_driving(stage: &Stage<'_>, robot: InstanceId) -> Self {
        Self::of_but(stage, robot, &stage.carriers(robot), &[])
    }

    /// As [`Surroundings::of`], without some things, and without the main body of others: what stands in one of their places
    /// stands in it.
    pub fn of_but(stage: &Stage<'_>, robot: InstanceId, without: &[InstanceId], bodiless: &[InstanceId]) -> Self {
        let mut out = Self::of_which(stage, robot, bodiless, |id| !stage.is_in_any(id, without));
        if stage.around_sweeps {
            for (id, link, at, radius) in stage.sweeps(robot) {
                out.push(id, &link, at, Solid::Sphere(radius));
            }
        }
        out
    }

    /// Only some things, and what is part of them or of which they are part.
    pub fn of_only(stage: &Stage<'_>, robot: InstanceId, these: &[InstanceId]) -> Self {
        let wholes: Vec<InstanceId> = these.iter().map(|id| stage.whole(*id)).collect();
        Self::of_which(stage, robot, &[], |id| stage.is_in_any(id, &wholes))
    }

    fn of_which(
        stage: &Stage<'_>,
        robot: InstanceId,
        bodiless: &[InstanceId],
        wanted: impl Fn(InstanceId) -> bool,
    ) -> Self {
        let mut out = Surroundings { bodiless: bodiless.to_vec(), ..Surroundings::default() };
        let carriers = stage.carriers(robot);
        for index in 0..stage.scene.instances.len() {
            let id = InstanceId(index as u32);
            // What a gantry runs in stands there whatever moves.
            let has_shapes = stage.actors.contains_key(&id) || !stage.is_inside_a_shape(id);
            if !has_shapes {
                continue;
            }
            let mine = stage.actor_of(id) == Some(robot) || stage.held_by(id) == Some(robot);
            if mine || !wanted(id) || stage.is_unknown(id) {
                continue;
            }
            let first = out.world.bodies.len();
            if stage.actors.contains_key(&id) && !stage.unknown.postures.contains(&id) {
                out.add_robot(stage, id);
            }
            out.add_shapes(stage, id, !bodiless.contains(&id));
            if stage.is_in_any(id, &carriers) {
                out.world.beneath.extend(first..out.world.bodies.len());
            }
        }
        out
    }

    fn push(&mut self, owner: InstanceId, name: &str, at: Pose, shape: Solid) {
        self.world.bodies.push(Body { name: name.to_string(), pose: pose(&at), shape });
        self.owners.push(owner);
    }

    fn add_shapes(&mut self, stage: &Stage<'_>, id: InstanceId, body: bool) {
        let instance = stage.scene.get(id);
        let at = stage.pose(id);
        for (shape, inner) in instance.hull().filter(|_| body).chain(instance.more()) {
            let (solid, middle) = solid(shape);
            self.push(id, &instance.name, at.then(inner).then(Pose::up(middle)), solid);
        }
        let Some(fixture) = stage.fixtures.get(&id) else { return };
        let links = following(stage.scene, id).into_iter().flat_map(|a| &a.robot.links).zip(fixture.links());
        for (link, inner) in links {
            for piece in &link.collision {
                if let Some(solid) = piece_of(&piece.solid) {
                    self.push(id, &instance.name, at.then(inner).then(piece.placement), solid);
                }
            }
        }
    }

    /// Another robot as it stands now, ball by ball, each named after its link.
    fn add_robot(&mut self, stage: &Stage<'_>, id: InstanceId) {
        let Some(actor) = stage.actors.get(&id) else { return };
        let base = stage.pose(id);
        let links = actor.tree.poses(&actor.joints);
        for ball in &actor.assembly.robot.balls {
            let Some(link) = links.get(ball.link as usize) else { continue };
            let at = base.then(matterix_motion::placement(link)).then(Pose::at(ball.center));
            let name = actor.assembly.robot.links.get(ball.link as usize).map_or("", |l| l.name.as_str());
            self.push(id, name, at, Solid::Sphere(ball.radius));
        }
    }
}

/// A piece of a link as a solid; meshes are not looked at.
fn piece_of(solid: &robot::Solid) -> Option<Solid> {
    match solid {
        robot::Solid::Cuboid(size) => Some(Solid::Cuboid(size.map(|s| s / 2.0))),
        robot::Solid::Cylinder([r, length]) => Some(Solid::Cylinder(*r, length / 2.0)),
        robot::Solid::Sphere(r) => Some(Solid::Sphere(*r)),
        robot::Solid::Mesh(..) => None,
    }
}

/// A shape as a solid about its middle, and the height of that middle above its base, m.
fn solid(shape: &Shape) -> (Solid, f64) {
    let [x, y, z] = shape.size();
    let solid = match shape {
        // The box around a mesh; true shapes decide where that is too much.
        Shape::Box(_) | Shape::Mesh(_) => Solid::Cuboid([x / 2.0, y / 2.0, z / 2.0]),
        Shape::Cylinder(_) | Shape::Turned { .. } => Solid::Cylinder(x / 2.0, z / 2.0),
        Shape::Sphere(_) => Solid::Sphere(x / 2.0),
    };
    (solid, z / 2.0)
}

/// What a robot holds and all that goes along with it, as balls in the frame of its tip.
pub fn held(stage: &Stage<'_>, robot: InstanceId, actor: &Actor) -> Vec<Held> {
    // The whole tool may touch what it holds.
    let touching: Vec<u32> =
        (0..actor.assembly.robot.links.len() as u32).filter(|l| *l >= actor.assembly.flange).collect();
    let tip = stage.tip(robot).inverse();
    let one = |id: InstanceId| {
        let instance = stage.scene.get(id);
        let inner = tip.then(stage.pose(id));
        let shapes = instance.hull().chain(instance.more());
        let balls = shapes.flat_map(|(shape, at)| balls(shape, inner.then(at))).collect();
        Held { name: instance.name.clone(), link: actor.assembly.tip, balls, touching: touching.clone() }
    };
    stage.in_hand(robot).into_iter().map(one).collect()
}

/// Balls along the edges and the wall of what is round, so that it does not count as rounded off: their radius, and how far
/// rings of them are apart, m.
const EDGE: (f64, f64) = (0.003, 0.02);

/// As [`SLACK`], of these, m: what they cut off a rim stays below 2 mm.
const EDGE_SLACK: f64 = 5e-4;

/// Radius of balls along the edges of what is not round, and how far they are apart, m: corners stand out of them by less
/// than 2 mm.
const RIM: f64 = 2e-3;
const ALONG: f64 = 8e-3;

/// What fills a body is at most so many balls: of a large thin one they are larger, and true shapes decide.
const MOST_INSIDE: f64 = 4096.0;
/// Balls along an edge or around a rim, and rings of them, at most: of what is larger they are farther apart.
const MOST_ALONG: f64 = 256.0;

/// Points along the edges of a block, in from them by [`RIM`].
fn edges(size: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let half = size.map(|s| (s / 2.0 - RIM).max(0.0));
    (0..3usize).flat_map(move |axis| {
        let steps = (2.0 * half[axis] / ALONG).ceil().clamp(1.0, MOST_ALONG) as u32;
        (0..4u8).flat_map(move |side| {
            (0..=steps).map(move |step| {
                let mut place = [0.0; 3];
                place[axis] = half[axis] * (2.0 * f64::from(step) / f64::from(steps) - 1.0);
                for (bit, other) in [(1, (axis + 1) % 3), (2, (axis + 2) % 3)] {
                    place[other] = if side & bit == 0 { -half[other] } else { half[other] };
                }
                place[2] += size[2] / 2.0;
                place
            })
        })
    })
}

/// Balls that fill a shape, no larger than it: a row of them along each of its edges and through its middle; of what is
/// round, small ones along its wall.
fn balls(shape: &Shape, at: Pose) -> Vec<([f64; 3], f64)> {
    let size @ [x, y, z] = shape.size();
    let steps = |length: f64, radius: f64| ((length - 2.0 * radius) / (1.5 * radius)).ceil().max(0.0);
    let mut radius = (x.min(y).min(z) / 2.0).max(1e-3);
    while size.iter().map(|length| steps(*length, radius) + 1.0).product::<f64>() > MOST_INSIDE {
        radius *= 1.1;
    }
    let along = |length: f64| -> Vec<f64> {
        let free = (length - 2.0 * radius).max(0.0);
        let steps = steps(length, radius) as u32;
        (0..=steps).map(|i| if steps == 0 { 0.0 } else { free * (f64::from(i) / f64::from(steps) - 0.5) }).collect()
    };
    let inside = |px: f64, py: f64| match shape.is_round() {
        true => (px * px + py * py).sqrt() + radius.min(x / 2.0) <= x / 2.0 + 1e-9,
        false => true,
    };
    let mut out = Vec::new();
    for px in along(x) {
        for py in along(y) {
            if !inside(px, py) {
                continue;
            }
            for pz in along(z) {
                out.push((at.point([px, py, z / 2.0 + pz]), radius - SLACK.min(radius / 2.0)));
            }
        }
    }
    if !shape.is_round() {
        out.extend(edges(size).map(|place| (at.point(place), RIM - EDGE_SLACK)));
    }
    let (small, apart) = EDGE;
    if shape.is_round() && !matches!(shape, Shape::Sphere(_)) && radius > small {
        let (ring, high) = (x / 2.0 - small, z - 2.0 * small);
        let turns = (TAU * ring / (1.5 * small)).ceil().min(MOST_ALONG) as u32;
        let rings = (high / apart).ceil().clamp(1.0, MOST_ALONG) as u32;
        for (turn, level) in (0..turns).flat_map(|turn| (0..=rings).map(move |level| (turn, level))) {
            let angle = TAU * f64::from(turn) / f64::from(turns);
            let up = small + high * f64::from(level) / f64::from(rings);
            let place = [ring * math::cos(angle), ring * math::sin(angle), up];
            out.push((at.point(place), small - EDGE_SLACK));
        }
    }
    out
}
