//! Robots as trees of links and joints: what kinematics, planning and pictures need of one, in SI units.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;

pub use crate::pose::Pose as Placement;

/// A solid, its own origin at its middle; metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Solid {
    /// Edge lengths along x, y, z.
    Cuboid([f64; 3]),
    /// Radius and length, along z.
    Cylinder([f64; 2]),
    /// Radius.
    Sphere(f64),
    /// A mesh file by its name in the package that brought it, and its scale along x, y, z.
    Mesh(String, [f64; 3]),
}

/// A solid somewhere on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Relative to the link.
    pub placement: Placement,
    /// What it is.
    pub solid: Solid,
    /// Red, green, blue, opacity, each 0 to 1; `None` where the source names no colour.
    pub color: Option<[f64; 4]>,
}

/// Mass and its distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inertial {
    /// kg.
    pub mass: f64,
    /// Centre of mass and principal frame, relative to the link.
    pub placement: Placement,
    /// xx, xy, xz, yy, yz, zz in kg m^2, about the centre of mass in that frame.
    pub inertia: [f64; 6],
}

/// A rigid body of a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Its name in the description.
    pub name: String,
    /// Unknown for links that are only frames.
    pub inertial: Option<Inertial>,
    /// What is seen.
    pub visual: Vec<Piece>,
    /// What collides.
    pub collision: Vec<Piece>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointKind {
    /// Not at all.
    Fixed,
    /// Turns about its axis between limits; rad.
    Revolute,
    /// Turns about its axis without end; rad.
    Continuous,
    /// Slides along its axis; m.
    Prismatic,
}

/// What a joint can do; rad or m, per second, N m or N.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Least position; minus infinity is written as the most negative number.
    pub lower: f64,
    /// Greatest position.
    pub upper: f64,
    /// Greatest speed.
    pub velocity: f64,
    /// Greatest torque or force.
    pub effort: f64,
    /// Greatest acceleration; `None` where the source names none.
    pub acceleration: Option<f64>,
    /// Greatest jerk; `None` where the source names none.
    pub jerk: Option<f64>,
}

/// A joint that follows another one: `position = multiplier * other + offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mimic {
    /// Index of the other joint.
    pub joint: u32,
    /// Factor.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

/// What connects two links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Its name in the description.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Index of the link it starts from.
    pub parent: u32,
    /// Index of the link it carries.
    pub child: u32,
    /// The child's frame at position zero, relative to the parent.
    pub origin: Placement,
    /// Unit vector in the child's frame.
    pub axis: [f64; 3],
    /// What it can do; `None` for fixed ones.
    pub limits: Option<JointLimits>,
    /// Whom it follows.
    pub mimic: Option<Mimic>,
}

/// A sphere of a robot's collision model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Index of its link.
    pub link: u32,
    /// Its middle, relative to the link; metres.
    pub center: [f64; 3],
    /// Metres.
    pub radius: f64,
}

/// A tree of links; parents before children, joint `i` carries the link it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// Its name in the description.
    pub name: String,
    /// The root first.
    pub links: Vec<Link>,
    /// In the order of the description, but for parents before children.
    pub joints: Vec<Joint>,
    /// Spheres that together cover the robot, for planning; empty where none were given.
    pub balls: Vec<Ball>,
    /// Pairs of links that may touch, by index, the lower first.
    pub touching: Vec<[u32; 2]>,
    /// Meshes that were found, by the names that solids have for them; before they are scaled.
    #[serde(default)]
    pub meshes: BTreeMap<String, Arc<Mesh>>,
}

impl Robot {
    /// The link with this name.
    pub fn link(&self, name: &str) -> Option<u32> {
        self.links.iter().position(|l| l.name == name).map(|i| i as u32)
    }

    /// The robot without what a link carries.
    pub fn cut_after(&self, tip: u32) -> Robot {
        let mut gone = vec![false; self.links.len()];
        for joint in &self.joints {
            if joint.parent == tip || gone.get(joint.parent as usize) == Some(&true) {
                gone[joint.child as usize] = true;
            }
        }
        let kept = |link: u32| gone.get(link as usize) == Some(&false);
        let links: Vec<u32> = (0..self.links.len() as u32).filter(|i| kept(*i)).collect();
        let joints: Vec<u32> = (0..).zip(&self.joints).filter(|(_, j)| kept(j.child)).map(|(i, _)| i).collect();
        let number = |of: &[u32], old: u32| of.iter().position(|i| *i == old).map(|i| i as u32);
        let joint = |i: &u32| {
            let joint = self.joints[*i as usize].clone();
            let (parent, child) = (number(&links, joint.parent)?, number(&links, joint.child)?);
            let mimic = match joint.mimic {
                Some(m) => Some(Mimic { joint: number(&joints, m.joint)?, ..m }),
                None => None,
            };
            Some(Joint { parent, child, mimic, ..joint })
        };
        Robot {
            name: self.name.clone(),
            links: links.iter().map(|i| self.links[*i as usize].clone()).collect(),
            joints: joints.iter().filter_map(joint).collect(),
            balls: self.balls.iter().filter_map(|b| Some(Ball { link: number(&links, b.link)?, ..*b })).collect(),
            touching: self
                .touching
                .iter()
                .filter_map(|[a, b]| Some([number(&links, *a)?, number(&links, *b)?]))
                .collect(),
            meshes: self.meshes.clone(),
        }
    }

    /// The joint with this name.
    pub fn joint(&self, name: &str) -> Option<u32> {
        self.joints.iter().position(|j| j.name == name).map(|i| i as u32)
    }

    /// Puts a tool on a link: all its links and joints, their names after a prefix, its root fixed to the link. Returns
    /// the index its root has now. What is rigidly connected by that may touch.
    pub fn attach(&mut self, link: u32, tool: &Robot, at: Placement, prefix: &str) -> u32 {
        let (links, joints) = (self.links.len() as u32, self.joints.len() as u32);
        let mine = self.fixed_to(link);
        let root = (0..tool.links.len() as u32).find(|&l| tool.joints.iter().all(|j| j.child != l)).unwrap_or(0);
        let named = |name: &str| format!("{prefix}{name}");
        self.joints.push(Joint {
            name: named("mount"),
            kind: JointKind::Fixed,
            parent: link,
            child: links + root,
            origin: at,
            axis: [1.0, 0.0, 0.0],
            limits: None,
            mimic: None,
        });
        self.links.extend(tool.links.iter().map(|l| Link { name: named(&l.name), ..l.clone() }));
        self.joints.extend(tool.joints.iter().map(|joint| Joint {
            name: named(&joint.name),
            parent: links + joint.parent,
            child: links + joint.child,
            // The mount stands before the tool's joints.
            mimic: joint.mimic.map(|m| Mimic { joint: joints + 1 + m.joint, ..m }),
            ..joint.clone()
        }));
        self.meshes.extend(tool.meshes.iter().map(|(name, mesh)| (name.clone(), mesh.clone())));
        self.balls.extend(tool.balls.iter().map(|ball| Ball { link: links + ball.link, ..*ball }));
        self.touching.extend(tool.touching.iter().map(|[a, b]| [links + a, links + b]));
        let solid = |l: &u32| !self.links[*l as usize].collision.is_empty();
        let theirs: Vec<u32> = tool.fixed_to(root).into_iter().map(|l| links + l).filter(solid).collect();
        let pairs = mine.into_iter().filter(solid).flat_map(|a| theirs.iter().map(move |&b| [a, b]));
        let pairs: Vec<[u32; 2]> = pairs.collect();
        self.touching.extend(pairs);
        links + root
    }

    /// A link and those that no joint moves relative to it, in their order.
    pub fn fixed_to(&self, link: u32) -> Vec<u32> {
        let mut body: Vec<u32> = (0..self.links.len() as u32).collect();
        for joint in self.joints.iter().filter(|j| j.kind == JointKind::Fixed) {
            body[joint.child as usize] = body[joint.parent as usize];
        }
        let Some(&own) = body.get(link as usize) else { return Vec::new() };
        (0..self.links.len() as u32).filter(|&l| body[l as usize] == own).collect()
    }
}
