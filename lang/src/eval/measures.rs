//! How large things are, for what grips them and what they stand on or under.

use matterix_ir::extent::Body;
use matterix_ir::footing::centre;
use matterix_ir::math::acos;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, frame};
use matterix_ir::{Diagnostic, Span, codes};

use super::Value;
use crate::declare::Type;
use crate::eval::lab::Elaborator;

/// What can be measured.
const MEASURES: &[&str] = &["grasp", "offer", "height", "foot", "top", "mouth", "rise", "centre", "tilt"];

impl Elaborator<'_> {
    /// A measure of an instance as a list of one length, or angle; an empty list where nothing is known of its shape.
    pub(super) fn measures(&mut self, id: InstanceId, what: &str, at: Span) -> Value {
        if !MEASURES.contains(&what) {
            let known: Vec<String> = MEASURES.iter().map(|m| format!("`{m}`")).collect();
            let d = Diagnostic::about(
                what,
                codes::UNKNOWN_NAME,
                at,
                format!("unknown measure `{what}`"),
                "no such measure",
            );
            self.report(d.help(format!("use one of {}", known.join(", "))));
            return Value::Error;
        }
        let dimension = self.tables.units.named(if what == "tilt" { "Angle" } else { "Length" });
        if self.prototype {
            let ty = Type::Quantity { dimension, point: false, optional: false };
            return Value::List(vec![self.placeholder(&ty, what)]);
        }
        let found = match what {
            "rise" => self.rise(id),
            "tilt" => self.tilt(id),
            _ => {
                let geometry = self.geometry(id);
                let body = Body { frames: &geometry.frames, shape: geometry.shape.as_ref(), solids: &geometry.solids };
                match what {
                    "grasp" | "offer" => body.across(what),
                    "height" => body.height(),
                    "foot" => body.foot(),
                    "mouth" => body.mouth(),
                    "centre" => centre(&body).map(|at| at[2]),
                    _ => body.top(),
                }
            }
        };
        Value::List(found.map(|value| self.number(value, dimension, false)).into_iter().collect())
    }

    /// How far a thing put down on another is from tipping over, as a list of one length; an empty one where shapes do not tell.
    pub(super) fn footings(&mut self, thing: InstanceId, on: InstanceId) -> Value {
        let dimension = self.tables.units.named("Length");
        if self.prototype {
            let ty = Type::Quantity { dimension, point: false, optional: false };
            return Value::List(vec![self.placeholder(&ty, "footing")]);
        }
        let found = self.footing(thing, on);
        Value::List(found.map(|value| self.number(value, dimension, false)).into_iter().collect())
    }

    /// How far where things stand on an instance is from level in the lab as it is set up, rad; of what goes with a joint
    /// nothing is known.
    fn tilt(&mut self, id: InstanceId) -> Option<f64> {
        let place = self.place_on(id)?;
        let at = self.in_lab(id, place)?;
        let up = at.point([0.0, 0.0, 1.0])[2] - at.position[2];
        // Rounding does not make a level place slope.
        Some(if up >= 1.0 - 1e-12 { 0.0 } else { acos(up.clamp(-1.0, 1.0)) })
    }

    /// A place of an instance in the lab as it is set up; nothing where it goes with a joint.
    pub(crate) fn in_lab(&mut self, id: InstanceId, place: Pose) -> Option<Pose> {
        let mut at = place;
        let mut next = id;
        for _ in 0..=self.instances.len() {
            let instance = &self.instances[next.0 as usize];
            let (own, owner, below) = (instance.pose, instance.owner, instance.placed.first().map(|p| p.1));
            at = own.then(at);
            next = match (owner, below) {
                (Some(owner), _) => owner,
                (None, Some(below)) => {
                    at = self.place_on(below)?.then(at);
                    below
                }
                (None, None) => break,
            };
        }
        Some(at)
    }

    /// Where things stand on an instance; nothing where that goes with a joint.
    pub(crate) fn place_on(&mut self, id: InstanceId) -> Option<Pose> {
        let frames = self.geometry(id).frames;
        match frames.iter().find(|f| f.name == frame::PLACE) {
            Some(place) => place.link.is_none().then_some(place.pose),
            None => Some(Pose::IDENTITY),
        }
    }

    /// How high things stand on an instance above the base of all that it is a part of, m.
    fn rise(&mut self, id: InstanceId) -> Option<f64> {
        let own = self.geometry(id);
        let place = own.frames.iter().find(|f| f.name == frame::PLACE).map(|f| f.pose);
        let top = own.shape.as_ref().map(|s| Pose::up(s.size()[2]));
        let owned = self.instances[id.0 as usize].owner.is_some();
        let mut at = place.or(top).or_else(|| owned.then_some(Pose::IDENTITY))?;
        let mut next = id;
        while let Some(owner) = self.instances[next.0 as usize].owner {
            at = self.instances[next.0 as usize].pose.then(at);
            next = owner;
        }
        Some(at.position[2])
    }
}
