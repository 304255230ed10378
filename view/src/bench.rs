//! Things with shapes as bodies: vessels get walls and a cavity, what others stand in becomes see-through.

use std::collections::BTreeMap;

use matterix_ir::robot::Placement;
use matterix_ir::scene::Shape;

use crate::document::{Body, Cavity, Finish, Frame, Mesh, Piece, Solid};
use crate::placement::pose;

/// An instance as programs and recordings tell of it.
pub(crate) struct Thing {
    /// Full name.
    pub(crate) name: String,
    /// Its asset type.
    pub(crate) kind: String,
    /// Primitives, each with its place relative to the thing and its colour.
    pub(crate) shapes: Vec<(Placement, Shape, Option<[f32; 4]>)>,
    /// What is seen instead of them.
    pub(crate) visual: Option<Shape>,
    /// In the lab, at the start.
    pub(crate) at: Placement,
    /// Named points, relative to the thing.
    pub(crate) frames: Vec<(String, Placement)>,
    /// Whether a mixture is in it.
    pub(crate) holds: bool,
    /// Whether it is a link of a robot.
    pub(crate) link: bool,
}

/// The bodies of all things that are seen, and the index of each by name; their triangles are added to `meshes`.
pub(crate) fn bodies(things: &[Thing], meshes: &mut Vec<Mesh>) -> (Vec<Body>, Owners) {
    let seen: Vec<&Thing> = things.iter().filter(|t| !t.shapes.is_empty() || t.visual.is_some()).collect();
    let owners = Owners::new(seen.iter().map(|t| t.name.as_str()));
    let made = seen.iter().enumerate().map(|(i, thing)| {
        let hull = !thing.holds && !thing.link && (encloses(thing, &seen) || roofs(thing));
        let (mut pieces, mut cavity) = (Vec::new(), None);
        for (at, shape, color) in &thing.shapes {
            let (at, color) = (*at, *color);
            let part = owners.above(&thing.name).is_some();
            let wall = if part { 0.0 } else { wall(shape) };
            match (thing.holds, cavity.is_none()) {
                (true, true) => {
                    pieces.push(Piece {
                        pose: pose(at),
                        solid: vessel(shape, wall, meshes),
                        finish: Finish::Glass,
                        color: None,
                    });
                    cavity = Some(room(shape, wall, at));
                }
                _ => {
                    let finish = if hull { Finish::Hull } else { Finish::Matte };
                    let middle = pose(at.then(Placement::up(middle(shape))));
                    pieces.push(Piece { pose: middle, solid: solid(shape, meshes), finish, color });
                }
            }
        }
        if let Some(shape) = &thing.visual {
            let finish = if thing.holds { Finish::Glass } else { Finish::Matte };
            let at = pose(Placement::up(middle(shape)));
            pieces = vec![Piece { pose: at, solid: solid(shape, meshes), finish, color: None }];
        }
        let above = owners.above(&thing.name).or_else(|| first_link(thing, &seen)).filter(|&p| p != i as u32);
        let is_robot = thing.link && above.is_none();
        Body {
            name: if is_robot { robot(thing).to_owned() } else { thing.name.clone() },
            kind: thing.kind.clone(),
            parent: above,
            pose: pose(thing.at),
            pieces,
            cavity,
            frames: thing.frames.iter().map(|(name, at)| Frame { name: name.clone(), pose: pose(*at) }).collect(),
        }
    });
    (made.collect(), owners)
}

/// The first link of the robot that a link belongs to: the whole robot goes by its own name.
fn first_link(thing: &Thing, seen: &[&Thing]) -> Option<u32> {
    let is_of = |robot: &str| thing.name.strip_prefix(robot).is_some_and(|rest| rest.starts_with('.'));
    let first = seen.iter().position(|other| other.link && is_of(robot(other)));
    first.filter(|_| thing.link).map(|i| i as u32)
}

/// The robot that a link of its own, not of a tool, belongs to.
fn robot(link: &Thing) -> &str {
    link.name.rsplit_once('.').map_or(&link.name, |(robot, _)| robot)
}

/// Bodies by name, and by the names of what is theirs.
pub(crate) struct Owners(BTreeMap<String, u32>);

impl Owners {
    fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        Owners(names.zip(0..).map(|(name, i)| (name.to_owned(), i)).collect())
    }

    /// The body of this name.
    pub(crate) fn get(&self, name: &str) -> Option<u32> {
        self.0.get(name).copied()
    }

    /// The body with the longest name that `name` is or begins with: `plate[A1]` of `plate[A1].contents.volume`.
    pub(crate) fn of(&self, name: &str) -> Option<u32> {
        self.get(name).or_else(|| self.above(name))
    }

    /// The body with the longest name that `name` goes on from: `plate` of `plate[A1]`.
    fn above(&self, name: &str) -> Option<u32> {
        let cuts = name.char_indices().rev().filter(|(_, c)| matches!(c, '.' | '['));
        cuts.filter_map(|(i, _)| self.get(&name[..i])).next()
    }
}

/// A shape about the middle of its height, but for what is turned and for meshes, which stand on their base.
fn solid(shape: &Shape, meshes: &mut Vec<Mesh>) -> Solid {
    match shape {
        Shape::Mesh(mesh) => {
            let positions = mesh.points.iter().flatten().map(|v| *v as f32).collect();
            meshes.push(Mesh { positions, indices: mesh.triangles.iter().flatten().copied().collect() });
            Solid::Mesh(meshes.len() as u32 - 1, [1.0; 3])
        }
        Shape::Box(size) => Solid::Cuboid(size.map(|v| v as f32)),
        Shape::Cylinder([d, h]) => Solid::Cylinder([(d / 2.0) as f32, *h as f32]),
        Shape::Sphere(d) => Solid::Sphere((d / 2.0) as f32),
        Shape::Turned { outside, inside } => {
            let all = outside.iter().chain(inside.iter().rev());
            Solid::Lathe(all.map(|p| p.map(|v| v as f32)).collect())
        }
    }
}

/// How far above its base the origin of a shape's solid is, m.
fn middle(shape: &Shape) -> f64 {
    match shape {
        Shape::Turned { .. } | Shape::Mesh(_) => 0.0,
        _ => shape.size()[2] / 2.0,
    }
}

/// Thickness of the wall a vessel is drawn with, m: that of laboratory glass, less for what is small. A place of a plate
/// is room only, and drawn without one.
fn wall(shape: &Shape) -> f64 {
    let [x, y, _] = shape.size();
    (0.03 * x.min(y)).min(0.0015)
}

/// A vessel with an open top; a box is shown by its outline.
fn vessel(shape: &Shape, wall: f64, meshes: &mut Vec<Mesh>) -> Solid {
    let Shape::Cylinder([d, h]) = *shape else {
        return solid(shape, meshes);
    };
    let (outer, inner) = (d / 2.0, d / 2.0 - wall);
    let edge = (0.06 * d).min(0.25 * h);
    let mut line: Vec<[f64; 2]> = vec![[0.0, 0.0]];
    line.extend(corner(outer, edge, 0.0));
    line.extend([[outer, h], [inner, h]]);
    line.extend(corner(inner, edge, wall).into_iter().rev());
    line.push([0.0, wall]);
    Solid::Lathe(line.into_iter().map(|p| p.map(|v| v as f32)).collect())
}

/// A quarter of a circle between a bottom at `z` and a wall at radius `r`, from the bottom up.
fn corner(r: f64, edge: f64, z: f64) -> Vec<[f64; 2]> {
    const STEPS: u32 = 5;
    let turn = |i: u32| f64::from(i) / f64::from(STEPS) * std::f64::consts::FRAC_PI_2;
    let at =
        |i: u32| [r - edge + edge * matterix_ir::math::sin(turn(i)), z + edge - edge * matterix_ir::math::cos(turn(i))];
    (0..=STEPS).map(at).collect()
}

fn room(shape: &Shape, wall: f64, at: Placement) -> Cavity {
    let low = at.position[2] + wall;
    match *shape {
        Shape::Turned { ref outside, ref inside } => {
            let room = if inside.is_empty() { outside } else { inside };
            let raised = |[r, z]: &[f64; 2]| [*r as f32, (z + at.position[2]) as f32];
            Cavity::Round(room.iter().map(raised).collect())
        }
        Shape::Sphere(d) => Cavity::Round(vec![[0.0, low as f32], [(d / 2.0) as f32, (low + d) as f32]]),
        Shape::Mesh(_) => {
            let [x, y, z] = shape.size();
            Cavity::Boxed([x - 2.0 * wall, y - 2.0 * wall, z - wall].map(|v| v as f32), low as f32)
        }
        Shape::Box([x, y, z]) => {
            Cavity::Boxed([x - 2.0 * wall, y - 2.0 * wall, z - wall].map(|v| v as f32), low as f32)
        }
        Shape::Cylinder([d, h]) => {
            let (inner, edge) = (d / 2.0 - wall, (0.06 * d).min(0.25 * h));
            let mut line = corner(inner, edge, low);
            line.push([inner, at.position[2] + h]);
            Cavity::Round(line.into_iter().map(|p| p.map(|v| v as f32)).collect())
        }
    }
}

/// Whether the base of another thing lies inside this one, below its top.
fn encloses(thing: &Thing, seen: &[&Thing]) -> bool {
    const TOUCHING: f64 = 1e-4;
    thing.shapes.iter().any(|(at, shape, _)| {
        let back = thing.at.then(*at).inverse();
        seen.iter().filter(|other| other.name != thing.name).any(|other| {
            let [x, y, z] = back.then(other.at).position;
            let [a, b, c] = shape.size();
            let within = match shape.is_round() {
                false => x.abs() < a / 2.0 && y.abs() < b / 2.0,
                true => x * x + y * y < a * a / 4.0,
            };
            within && (TOUCHING..c - TOUCHING).contains(&z)
        })
    })
}

/// Whether one of its own points lies under a roof of it: a place in a hood or under a gantry.
fn roofs(thing: &Thing) -> bool {
    thing.frames.iter().any(|(_, point)| {
        let point = thing.at.then(*point).position;
        thing.shapes.iter().any(|(at, shape, _)| {
            let [x, y, z] = thing.at.then(*at).inverse().point(point);
            let [a, b, c] = shape.size();
            matches!(shape, Shape::Box(_)) && x.abs() < a / 2.0 && y.abs() < b / 2.0 && z < -c
        })
    })
}
