//! Mass of a body and how it is distributed: given with `inertia`, or that of one density in its shape.

use matterix_ir::inertia::{impossible, of_shapes};
use matterix_ir::model::{Load, Pace};
use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_ir::scene::{Friction, InstanceId, frame};
use matterix_ir::{Diagnostic, NodeId, Span, codes};

use super::Elaborator;
use super::geometry::Geometry;
use crate::ast::{Expr, FieldValue};
use crate::declare::Type;
use crate::eval::{Scope, Value};

/// Members of the library's bodies that a scene carries, with their dimensions.
const MASS: (&str, &str) = ("mass", "Mass");
const FRICTION: (&str, &str) = ("friction", "Ratio");
/// The member that says whether what is put on a surface stays for a moment only.
const STOPOVER: &str = "stopover";
/// The members that say how what is held may be moved: the volume of its contents that is free to run out over its rim, and the share of what
/// the grip bears that an acceleration takes up.
const LOOSE: (&str, &str) = ("loose", "Volume");
const TAXED: (&str, &str) = ("taxed", "Ratio");
/// The members that say how heavy it is with what it contains, and how much room that takes.
const GROSS: (&str, &str) = ("gross", "Mass");
const FILLING: (&str, &str) = ("filling", "Volume");
/// The member that says what the fingers of a gripper press with.
const FORCE: (&str, &str) = ("force", "Force");
/// The function that gives the friction between two things, which a lab may set for a pair.
const SLIDING: &str = "sliding";

/// The members that say how fast a robot goes: how many times as long its motions take, and the greatest speed of its tip.
const SLOWNESS: (&str, &str) = ("slowness", "Ratio");
const TIP_SPEED: (&str, &str) = ("tip_speed", "Speed");

/// How many times the moments may be above what the mass has where it is farthest from its centre: shapes are nominal.
const NOMINAL: f64 = 2.0;

impl<'a> Elaborator<'a> {
    /// Mass and inertia of what of an asset does not move; none where mass, or shape and `inertia`, are not known.
    pub fn inertial(&mut self, id: InstanceId, geometry: &Geometry) -> Option<Inertial> {
        let given = self.given_moments(id);
        if let (Some((_, span)), true) = (given, self.members_of(id, MASS.0).is_empty()) {
            let d = Diagnostic::error(
                codes::MISSING_FIELD,
                span,
                "this asset has an inertia but no mass",
                "no mass is given",
            );
            self.report(d.help("make it a `Body`, and give its `mass`"));
        }
        let mass = self.plain(id, MASS)?;
        let shapes = geometry.shape.iter().map(|shape| (shape, Pose::IDENTITY));
        let solids = geometry.solids.iter().map(|solid| (&solid.shape, solid.pose));
        let derived = of_shapes(mass, shapes.chain(solids));
        let centre = geometry.frames.iter().find(|f| f.name == frame::CENTRE && !f.stand && f.link.is_none());
        let middle = centre.map(|f| f.pose.position).or(derived.map(|d| d.placement.position));
        if let (Some((_, span)), None) = (given, middle) {
            let headline = "the centre of mass of this asset is unknown";
            let d = Diagnostic::error(codes::MISSING_FIELD, span, headline, "about an unknown point");
            self.report(d.help("give its `shape`, or write `frame centre at (0, 0, 20) mm`"));
        }
        let inertia = match (given, derived) {
            (Some((moments, span)), _) => {
                self.too_great(mass, moments, middle?, geometry, span);
                moments
            }
            (None, derived) => derived?.inertia,
        };
        Some(Inertial { mass, placement: Pose::at(middle?), inertia })
    }

    /// Coefficient of friction of an instance, if it is known.
    pub fn friction(&mut self, id: InstanceId) -> Option<f64> {
        self.plain(id, FRICTION).filter(|f| f.is_finite())
    }

    /// What each finger of a gripper presses with, N, if it is known.
    pub fn force(&mut self, id: InstanceId) -> Option<f64> {
        self.plain(id, FORCE).filter(|f| f.is_finite())
    }

    /// The friction of pairs that the lab gives.
    pub fn frictions(&mut self) -> Vec<Friction> {
        let pairs = self.pairs.iter().filter(|pair| pair.name == SLIDING).map(|pair| [pair.a, pair.b]);
        let pairs: Vec<[InstanceId; 2]> = pairs.collect();
        let given = pairs.into_iter().filter_map(|between| {
            let value = self.pair_setting(SLIDING, &between.map(Value::Instance))?;
            let Value::Num(number) = value else { return None };
            Some(Friction { between, coefficient: self.known(number.node)? })
        });
        given.collect()
    }

    /// How an instance may be moved by who holds it; nothing where any motion will do.
    pub fn load(&mut self, id: InstanceId) -> Option<Load> {
        let loose = self.changing(id, LOOSE);
        let taxed = self.changing(id, TAXED);
        if loose.is_none() && taxed.is_none() {
            return None;
        }
        let gross = self.changing(id, GROSS).filter(|node| self.graph.constant(*node).is_none());
        let filling = self.changing(id, FILLING);
        Some(Load { instance: id, loose, taxed, gross, filling })
    }

    /// How fast a robot goes, where it does not go as fast as it can.
    pub fn pace(&mut self, robot: InstanceId) -> Option<Pace> {
        let slowness = self.unless(robot, SLOWNESS, 1.0);
        let tip_speed = self.unless(robot, TIP_SPEED, f64::INFINITY);
        (slowness.is_some() || tip_speed.is_some()).then_some(Pace { robot, slowness, tip_speed })
    }

    /// The value of a member of this name and dimension, if the instance has one that is not always 0.
    fn changing(&mut self, id: InstanceId, member: (&str, &str)) -> Option<NodeId> {
        self.unless(id, member, 0.0)
    }

    /// The value of a member of this name and dimension, if the instance has one that is not always this one, SI.
    fn unless(&mut self, id: InstanceId, (name, dimension): (&str, &str), usual: f64) -> Option<NodeId> {
        let member = self.members_of(id, name).first().copied()?;
        let at = self.instances[id.0 as usize].span;
        let Value::Num(n) = self.member_value(id, member, at) else { return None };
        let counts =
            n.dimension.agrees(&self.tables.units.named(dimension)) && self.graph.constant(n.node) != Some(usual);
        counts.then_some(n.node)
    }

    /// Whether what is put on an instance stays there for a moment only.
    pub fn is_stopover(&mut self, id: InstanceId) -> bool {
        let Some(member) = self.members_of(id, STOPOVER).first().copied() else { return false };
        let at = self.instances[id.0 as usize].span;
        matches!(self.member_value(id, member, at), Value::Bool(node) if self.graph.constant(node) == Some(1.0))
    }

    /// The moments that an asset gives, xx, xy, xz, yy, yz, zz, and where.
    fn given_moments(&mut self, id: InstanceId) -> Option<([f64; 6], Span)> {
        let setting = self.instances[id.0 as usize].setting("inertia")?;
        let FieldValue::Expr(e) = setting.value() else { return None };
        let moments = self.moments(e, &mut setting.scope())?;
        if let Some(why) = impossible(moments) {
            let d = Diagnostic::error(codes::OUT_OF_RANGE, e.span, "this inertia is impossible", why);
            self.report(d.help(
                "give it about the centre of mass, along the axes of the asset, or remove it: then it follows from mass and shape",
            ));
            return None;
        }
        Some((moments, e.span))
    }

    /// `(xx, yy, zz) kg*m^2`, or the same with the products `xy, xz, yz` after them.
    fn moments(&mut self, e: &'a Expr, scope: &mut Scope) -> Option<[f64; 6]> {
        let given = "moments of inertia `(xx, yy, zz) kg*m^2`, or `(xx, yy, zz, xy, xz, yz) kg*m^2`";
        let items = match self.expr(e, scope) {
            Value::Tuple(items) => items,
            other => {
                self.expected(given, &other, e.span);
                return None;
            }
        };
        if ![3, 6].contains(&items.len()) {
            let headline = format!("expected {given}, found {} values", items.len());
            self.report(Diagnostic::error(codes::TYPE_MISMATCH, e.span, headline, "not an inertia"));
            return None;
        }
        let (mass, length) = (self.tables.units.named("Mass"), self.tables.units.named("Length"));
        let dimension = mass.times(&length).times(&length);
        let ty = Type::Quantity { dimension, point: false, optional: false };
        let mut values = [0.0; 6];
        for (slot, item) in values.iter_mut().zip(items) {
            let Value::Num(n) = self.coerce(item, &ty, e.span, "inertia") else { return None };
            *slot = self.known(n.node)?;
        }
        let [xx, yy, zz, xy, xz, yz] = values;
        Some([xx, xy, xz, yy, yz, zz])
    }

    /// Reports moments that the mass does not have even where all of it is as far from its centre as the shape goes.
    fn too_great(&mut self, mass: f64, moments: [f64; 6], middle: [f64; 3], geometry: &Geometry, span: Span) {
        let Some(shape) = geometry.shape.as_ref().filter(|_| geometry.solids.is_empty()) else { return };
        let [x, y, z] = shape.size();
        let far = |k: usize, low: f64, high: f64| (middle[k] - low).abs().max((high - middle[k]).abs());
        let reach = [far(0, -x / 2.0, x / 2.0), far(1, -y / 2.0, y / 2.0), far(2, 0.0, z)];
        let most = mass * reach.iter().map(|r| r * r).sum::<f64>();
        // Half the sum of the moments is the mass times the mean of the squared distance.
        let sum = (moments[0] + moments[3] + moments[5]) / 2.0;
        if sum > NOMINAL * most {
            let headline = "this inertia is impossible for its mass and shape";
            let label = format!("{:.2} times the possible maximum", sum / most);
            let d = Diagnostic::error(codes::OUT_OF_RANGE, span, headline, label);
            self.report(d.help("check the units: 1 g*mm^2 is 1e-9 kg*m^2"));
        }
    }

    /// The value of a parameter of a body, if it has that and it is known before the run.
    fn plain(&mut self, id: InstanceId, (name, dimension): (&str, &str)) -> Option<f64> {
        let member = self.members_of(id, name).first().copied()?;
        let at = self.instances[id.0 as usize].span;
        let value = self.member_value(id, member, at);
        let wanted = self.tables.units.named(dimension);
        match value {
            Value::Num(n) if n.dimension.agrees(&wanted) => self.known(n.node),
            _ => None,
        }
    }
}
