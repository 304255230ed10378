//! What there is: instances of assets, where they stand, and what their states mean.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::extent::Body;
use crate::mesh::Mesh;
pub use crate::pose::Pose;
use crate::robot::{Inertial, Robot};
use crate::{NodeId, Span};

/// An instance, by its index in the [`Scene`]. The graph stores instances as this number, "nothing" as -1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct InstanceId(pub u32);

/// A named point of an asset, for grasping, placing, pouring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Name, as in `beaker.grasp`.
    pub name: String,
    /// Relative to the asset, or to `from`.
    pub pose: Pose,
    /// Relative to where the asset last stood before it was picked up, stopovers aside, instead of to the asset.
    pub stand: bool,
    /// Relative to this link of the asset instead, by index.
    #[serde(default)]
    pub link: Option<u32>,
}

/// Names of frames that have a meaning of their own.
pub mod frame {
    /// Where things are put down on a surface.
    pub const PLACE: &str = "place";
    /// Where a thing is gripped, its z axis towards the gripper.
    pub const GRASP: &str = "grasp";
    /// The point of a tool that meets the tip of the robot it is part of, and of a thing that meets what takes it along.
    pub const MOUNT: &str = "mount";
    /// Where a thing last stood before it was picked up, stopovers aside.
    pub const STAND: &str = "stand";
    /// The centre of mass of a thing, where its shape does not tell it.
    pub const CENTRE: &str = "centre";
}

/// A shape, its origin at the middle of its base; metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// Edge lengths x, y, z.
    Box([f64; 3]),
    /// Diameter and height.
    Cylinder([f64; 2]),
    /// Diameter.
    Sphere(f64),
    /// Turned on a lathe: radius and height along the outside and along the inside, each from the axis at the bottom
    /// to the rim. Without an inside it is full.
    Turned {
        /// From the bottom up.
        outside: Vec<[f64; 2]>,
        /// From the bottom up.
        inside: Vec<[f64; 2]>,
    },
    /// Triangles, the middle of the base of the box around them at the origin.
    Mesh(Arc<Mesh>),
}

impl Shape {
    /// Least box around it: x, y, z in metres.
    pub fn size(&self) -> [f64; 3] {
        match self {
            Shape::Box(size) => *size,
            Shape::Cylinder([d, h]) => [*d, *d, *h],
            Shape::Sphere(d) => [*d; 3],
            Shape::Turned { outside, .. } => {
                let greatest = |k: usize| outside.iter().map(|p| p[k]).fold(0.0, f64::max);
                [2.0 * greatest(0), 2.0 * greatest(0), greatest(1)]
            }
            Shape::Mesh(mesh) => mesh.size(),
        }
    }

    /// How far the edge of its top is from its axis in the direction of x, m.
    pub fn rim(&self) -> f64 {
        match self {
            Shape::Box([x, ..]) => x / 2.0,
            Shape::Cylinder([d, _]) => d / 2.0,
            Shape::Sphere(_) => 0.0,
            Shape::Turned { outside, .. } => outside.last().map_or(0.0, |p| p[0]),
            Shape::Mesh(mesh) => mesh.size()[0] / 2.0,
        }
    }

    /// Whether turning it about its own axis changes nothing.
    pub fn is_round(&self) -> bool {
        !matches!(self, Shape::Box(_) | Shape::Mesh(_))
    }
}

/// A shape somewhere on an asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solid {
    /// What it is.
    pub shape: Shape,
    /// Relative to the asset.
    pub pose: Pose,
}

/// What moves an asset's links: its description, and how it was set up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Articulation {
    /// Links, joints, limits.
    pub robot: Robot,
    /// The link that carries a tool, by index; the last one where none is named.
    pub tip: u32,
    /// Positions of the moving joints in the order of the description when the run begins, rad or m.
    pub home: Vec<f64>,
    /// The link from which its arm reaches; what is before it, from the root, drives that about.
    #[serde(default)]
    pub base: u32,
    /// Positions that the model gives: of a lid, a sash, a knob. None of a robot that moves by itself.
    #[serde(default)]
    pub follows: Vec<Follow>,
}

/// A moving joint that is where the model says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Follow {
    /// Which of those that move by themselves, as in `home`.
    pub variable: u32,
    /// rad or m.
    pub position: NodeId,
}

/// One asset in the lab, or a part of one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// Full name: `hotplate`, `beaker.contents`, `left.panda`.
    pub name: String,
    /// Name of the asset type or, for a part, of its capability.
    pub kind: String,
    /// Names of all capabilities it has, inherited ones included.
    pub capabilities: Vec<String>,
    /// The instance it is a part of.
    pub owner: Option<InstanceId>,
    /// The link of its owner that it is on, by index.
    #[serde(default)]
    pub link: Option<u32>,
    /// What it stood on when the run began.
    pub support: Option<InstanceId>,
    /// Where it stood when the run began, relative to its support or the lab.
    pub pose: Pose,
    /// Whether that is known, seen from there: the text says it, or leaves no other choice.
    #[serde(default)]
    pub placed: bool,
    /// Where the text says that, if it does.
    #[serde(default)]
    pub at: Option<Span>,
    /// Its named points.
    pub frames: Vec<Frame>,
    /// Its body.
    pub shape: Option<Shape>,
    /// More of its body.
    pub solids: Vec<Solid>,
    /// What others run into instead of its body, if that is something else.
    #[serde(default)]
    pub collision: Vec<Solid>,
    /// What is seen of it instead of its body, if that is something else.
    #[serde(default)]
    pub visual: Option<Shape>,
    /// Its mass, empty, and how that is distributed; of what has joints, that of what does not move. None where either is
    /// not known.
    #[serde(default)]
    pub inertial: Option<Inertial>,
    /// Coefficient of friction of its surface, if that is known.
    #[serde(default)]
    pub friction: Option<f64>,
    /// What each of its fingers presses with, N, if it grips and that is known.
    #[serde(default)]
    pub force: Option<f64>,
    /// Whether what is put on it stays for a moment only: it is put back to where it stood before.
    #[serde(default)]
    pub stopover: bool,
    /// What it takes out of what it is a part of: a hole in a rack, a well in a plate.
    #[serde(default)]
    pub room: Option<Shape>,
    /// Its links and joints.
    pub articulation: Option<Box<Articulation>>,
    /// Its declaration.
    pub span: Span,
}

impl Instance {
    /// What it is made of, for its measures.
    pub fn body(&self) -> Body<'_> {
        Body { frames: &self.frames, shape: self.shape.as_ref(), solids: &self.solids }
    }

    /// Its main shape as something to run into; none where that is only the room it takes out of another thing.
    pub fn solid(&self) -> Option<&Shape> {
        self.shape.as_ref().filter(|_| self.shape != self.room)
    }

    /// What others run into of its main body: its shape, or what is given in its place.
    pub fn hull(&self) -> impl Iterator<Item = (&Shape, Pose)> {
        let shape = self.solid().into_iter().filter(|_| self.collision.is_empty()).map(|shape| (shape, Pose::IDENTITY));
        shape.chain(self.collision.iter().map(|solid| (&solid.shape, solid.pose)))
    }

    /// What others run into beside that.
    pub fn more(&self) -> impl Iterator<Item = (&Shape, Pose)> {
        let solids = self.solids.iter().filter(|_| self.collision.is_empty());
        solids.map(|solid| (&solid.shape, solid.pose))
    }

    /// What is seen of it.
    pub fn seen(&self) -> impl Iterator<Item = (&Shape, Pose)> {
        let own = self.visual.is_none();
        let shape = self.visual.as_ref().or(self.shape.as_ref()).map(|shape| (shape, Pose::IDENTITY));
        shape.into_iter().chain(self.solids.iter().filter(move |_| own).map(|solid| (&solid.shape, solid.pose)))
    }
}

/// What a thing stands on and where on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stand {
    /// In the lab.
    Lab(Pose),
    /// On the surface of an instance: in its frame `place`, else on the middle of its top.
    On(InstanceId, Pose),
    /// In the frame of the instance it is a part of.
    PartOf(InstanceId, Pose),
}

impl Stand {
    /// What it stands on or is part of.
    pub fn below(&self) -> Option<InstanceId> {
        match self {
            Stand::Lab(_) => None,
            Stand::On(below, _) | Stand::PartOf(below, _) => Some(*below),
        }
    }
}

/// All instances of a lab, parts after their owners.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name of the lab.
    pub lab: String,
    /// By [`InstanceId`].
    pub instances: Vec<Instance>,
    /// What takes things along beside surfaces and grippers.
    #[serde(default)]
    pub carriers: Vec<Carrier>,
    /// Friction between two instances where that is not the lesser of theirs.
    #[serde(default)]
    pub frictions: Vec<Friction>,
}

/// The coefficient of friction between two instances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// One and the other.
    pub between: [InstanceId; 2],
    /// Of static friction.
    pub coefficient: f64,
}

/// An instance that takes along what one of its states names: the frame `mount` of that comes to its origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Carrier {
    /// Who takes it along.
    pub by: InstanceId,
    /// The state, by index into those of the model.
    pub state: u32,
}

impl Scene {
    /// One instance.
    pub fn get(&self, id: InstanceId) -> &Instance {
        &self.instances[id.0 as usize]
    }

    /// The instance with this full name.
    pub fn find(&self, name: &str) -> Option<InstanceId> {
        self.instances.iter().position(|i| i.name == name).map(|i| InstanceId(i as u32))
    }

    /// What an instance is a part of, parts of parts included; itself where it is of nothing.
    pub fn whole(&self, mut id: InstanceId) -> InstanceId {
        while let Some(owner) = self.get(id).owner {
            id = owner;
        }
        id
    }

    /// Where every instance stands when the run begins.
    pub fn stands(&self) -> Vec<Stand> {
        let stand = |i: &Instance| match (i.owner, i.support) {
            (Some(owner), _) => Stand::PartOf(owner, i.pose),
            (None, Some(support)) => Stand::On(support, i.pose),
            (None, None) => Stand::Lab(i.pose),
        };
        self.instances.iter().map(stand).collect()
    }

    /// What the parts of an instance take out of it, each with its place in the frame of that instance.
    pub fn rooms(&self, id: InstanceId) -> Vec<Solid> {
        let mut out = Vec::new();
        let mut inside = vec![(id, Pose::IDENTITY)];
        // Parts come after what they are a part of.
        for (index, part) in self.instances.iter().enumerate().skip(id.0 as usize + 1) {
            let Some((_, above)) = inside.iter().find(|(i, _)| Some(*i) == part.owner) else { continue };
            let pose = above.then(part.pose);
            out.extend(part.room.iter().map(|room| Solid { shape: room.clone(), pose }));
            inside.push((InstanceId(index as u32), pose));
        }
        out
    }

    /// The surface things stand on, in the frame of its instance.
    pub fn surface(&self, id: InstanceId) -> Pose {
        let Some(instance) = self.instances.get(id.0 as usize) else { return Pose::IDENTITY };
        let place = instance.frames.iter().find(|f| f.name == frame::PLACE).map(|f| f.pose);
        place.or_else(|| instance.shape.as_ref().map(|s| Pose::up(s.size()[2]))).unwrap_or_default()
    }

    /// An instance in the frame of the lab, where things stand as `stand` says. Where supports form a ring, the ring is cut.
    pub fn in_lab(&self, id: InstanceId, stand: impl Fn(InstanceId) -> Option<Stand>) -> Pose {
        self.in_lab_on(id, stand, |below| self.surface(below))
    }

    /// The same where `surface` says where on an instance things stand, in its frame.
    pub fn in_lab_on(
        &self,
        id: InstanceId,
        stand: impl Fn(InstanceId) -> Option<Stand>,
        surface: impl Fn(InstanceId) -> Pose,
    ) -> Pose {
        let mut at = Pose::IDENTITY;
        let mut next = id;
        for _ in 0..=self.instances.len() {
            let (below, inner) = match stand(next) {
                Some(Stand::Lab(inner)) => return inner.then(at),
                Some(Stand::On(below, inner)) => (below, surface(below).then(inner)),
                Some(Stand::PartOf(owner, inner)) => (owner, inner),
                None => return at,
            };
            at = inner.then(at);
            next = below;
        }
        at
    }
}
