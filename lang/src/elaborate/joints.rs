//! Parts of an asset that move as its states say: lids, doors, sashes, knobs.

use matterix_ir::robot::{Joint, JointKind, JointLimits, Link, Piece, Robot, Solid as Body};
use matterix_ir::scene::{Follow, Frame, InstanceId, Pose, Shape, Solid};
use matterix_ir::{Diagnostic, NodeId, codes};

use crate::ast::{AssetLine, At, Expr, ExprKind, FieldValue, Name};
use crate::declare::Type;
use crate::eval::lab::Elaborator;
use crate::eval::lab::geometry::Geometry;
use crate::eval::{Scope, Value};
use crate::near::{nearest, question, unknown};

/// The joints of an asset's lines do not move by themselves: the states that they follow have the limits.
const FREE: JointLimits =
    JointLimits { lower: f64::MIN, upper: f64::MAX, velocity: f64::MAX, effort: 0.0, acceleration: None, jerk: None };

impl<'a> Elaborator<'a> {
    /// The moving link that a frame of an asset is on, by index.
    pub fn rides_on(&self, id: InstanceId, frame: &str) -> Option<u32> {
        let mut name = frame;
        // A frame may be given in another one: as many steps as there are lines lead to the first.
        for _ in 0..=self.lines(id).len() {
            let at = self.place_of(id, name)?;
            let from = at.from.as_ref()?;
            if let Some(link) = self.link_of(id, from) {
                return Some(link);
            }
            name = &from.text;
        }
        None
    }

    /// The frame of its owner that an instance is mounted on, if it says so.
    pub fn mounted(&mut self, id: InstanceId, frames: &[Frame]) -> Option<Frame> {
        let setting = self.instances[id.0 as usize].setting("mounted")?;
        let FieldValue::Expr(e) = setting.value() else { return None };
        let ExprKind::Text(text) = &*e.kind else {
            let headline = "`mounted` must name a frame of the parent: `mounted: \"left\"`";
            self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "not a text"));
            return None;
        };
        let found = frames.iter().find(|f| f.name == *text).cloned();
        if found.is_none() {
            let close = nearest(text, frames.iter().map(|f| f.name.as_str()));
            let headline = format!("the parent of `{}` has no frame `{text}`", self.instances[id.0 as usize].name);
            let d = Diagnostic::about(text, codes::UNKNOWN_NAME, e.span, headline, "no such frame");
            self.report(match question(&close) {
                Some(asked) => d.help(asked),
                None => d,
            });
        }
        found
    }

    fn place_of(&self, id: InstanceId, frame: &str) -> Option<&'a At> {
        self.lines(id).into_iter().find_map(|(_, line)| match line {
            AssetLine::Frame { name, at } if name.text == frame => Some(at),
            _ => None,
        })
    }

    /// The links that the joints of an asset's lines carry; none where it has no joints of its own.
    pub(super) fn declared_tree(&mut self, id: InstanceId) -> Option<Robot> {
        let joints: Vec<_> = self.jointed(id).into_iter().filter(|(_, j)| j.way.is_some()).collect();
        let (_, first) = joints.first()?;
        let mut robot = Robot { name: first.name.text.clone(), links: vec![link("")], ..Robot::default() };
        for (module, joint) in joints {
            let way = joint.way.as_ref()?;
            if robot.joint(&joint.name.text).is_some() {
                let headline = format!("there are two joints `{}`", joint.name.text);
                self.report(Diagnostic::error(codes::DUPLICATE_NAME, joint.name.span, headline, "declared again here"));
                continue;
            }
            let mut scope = Scope::of(id, module);
            let axis = self.axis(&way.axis, &mut scope)?;
            let (origin, parent) = match &way.at {
                Some(at) => self.origin(at, &robot, &mut scope)?,
                None => (Pose::IDENTITY, 0),
            };
            robot.joints.push(Joint {
                name: joint.name.text.clone(),
                kind: if way.slides { JointKind::Prismatic } else { JointKind::Continuous },
                parent,
                child: robot.links.len() as u32,
                origin,
                axis,
                limits: Some(FREE),
                mimic: None,
            });
            robot.links.push(link(&joint.name.text));
        }
        Some(robot)
    }

    /// Where a joint is, and the link it is on.
    fn origin(&mut self, at: &'a At, robot: &Robot, scope: &mut Scope) -> Option<(Pose, u32)> {
        let parent = match &at.from {
            None => 0,
            Some(from) => match robot.link(&from.text) {
                Some(link) => link,
                None => {
                    self.no_joint(from, robot);
                    return None;
                }
            },
        };
        let pose = self.local(at, &Geometry::default(), scope)?;
        Some((pose, parent))
    }

    fn no_joint(&mut self, name: &Name, robot: &Robot) {
        let close = nearest(&name.text, robot.joints.iter().map(|j| j.name.as_str()));
        let headline = format!("no joint `{}`", name.text);
        let d = unknown(name, headline, "no earlier joint has this name");
        self.report(match question(&close) {
            Some(asked) => d.help(asked),
            None => d,
        });
    }

    /// A unit vector.
    fn axis(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<[f64; 3]> {
        let value = self.expr(e, scope);
        let Value::Tuple(items) = value else {
            self.expected("an axis `(0, 0, 1)`", &value, e.span);
            return None;
        };
        let mut axis = Vec::new();
        for item in items {
            let Value::Num(n) = self.coerce(item, &Type::ratio(), e.span, "axis") else { return None };
            axis.push(self.known(n.node)?);
        }
        let length = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
        match <[f64; 3]>::try_from(axis) {
            Ok(axis) if length > 0.0 => Some(axis.map(|v| v / length)),
            _ => {
                let headline = "an axis needs three numbers, not all of them 0";
                self.report(Diagnostic::error(codes::OUT_OF_RANGE, e.span, headline, "has no direction"));
                None
            }
        }
    }

    /// What the joints of an asset follow, as far as its lines say.
    pub(super) fn follows(&mut self, id: InstanceId, robot: &Robot) -> Vec<Follow> {
        let mut out = Vec::new();
        for (module, joint) in self.jointed(id) {
            let moving = robot.joints.iter().filter(|j| j.kind != JointKind::Fixed && j.mimic.is_none());
            let found = moving.zip(0..).find(|(j, _)| j.name == joint.name.text).map(|(j, k)| (j.kind, k));
            let Some((kind, variable)) = found else {
                self.no_joint(&joint.name, robot);
                continue;
            };
            let position = self.position_of(kind, &joint.by, &mut Scope::of(id, module));
            out.extend(position.map(|position| Follow { variable, position }));
        }
        out
    }

    /// How far a joint has moved, rad or m.
    fn position_of(&mut self, kind: JointKind, by: &'a Expr, scope: &mut Scope) -> Option<NodeId> {
        let dimension = if kind == JointKind::Prismatic { "Length" } else { "Angle" };
        let ty = Type::Quantity { dimension: self.tables.units.named(dimension), point: false, optional: false };
        let value = self.expr(by, scope);
        match self.coerce(value, &ty, by.span, "by") {
            Value::Num(n) => Some(n.node),
            _ => None,
        }
    }
}

fn link(name: &str) -> Link {
    Link { name: name.to_string(), inertial: None, visual: Vec::new(), collision: Vec::new() }
}

/// Gives links more of a body.
pub(super) fn clothe(robot: &mut Robot, solids: Vec<(u32, Solid)>) {
    for (index, Solid { shape, pose }) in solids {
        let [x, y, z] = shape.size();
        let solid = match shape {
            // What meets a mesh is told by the box around it.
            Shape::Box(_) | Shape::Mesh(_) => Body::Cuboid([x, y, z]),
            Shape::Sphere(d) => Body::Sphere(d / 2.0),
            Shape::Cylinder(_) | Shape::Turned { .. } => Body::Cylinder([x.max(y) / 2.0, z]),
        };
        let piece = Piece { placement: pose.then(Pose::up(z / 2.0)), solid, color: None };
        let seen = match shape {
            Shape::Mesh(mesh) => {
                let name = mesh.name.clone();
                robot.meshes.insert(name.clone(), mesh);
                Piece { placement: pose, solid: Body::Mesh(name, [1.0; 3]), color: None }
            }
            _ => piece.clone(),
        };
        if let Some(link) = robot.links.get_mut(index as usize) {
            link.visual.push(seen);
            link.collision.push(piece);
        }
    }
}
