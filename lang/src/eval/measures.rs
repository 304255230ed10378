//! How large things are, for what grips them and what they stand on or under.

use matterix_ir::extent::Body;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, frame};
use matterix_ir::{Diagnostic, Span, codes};

use super::{Type, Value};
use crate::elaborate::Elaborator;

/// What can be measured.
const MEASURES: &[&str] = &["grasp", "offer", "height", "foot", "top", "rise"];

impl Elaborator<'_> {
    /// A measure of an instance as a list of one length; an empty list where nothing is known of its shape.
    pub(super) fn measures(&mut self, id: InstanceId, what: &str, at: Span) -> Value {
        if !MEASURES.contains(&what) {
            let known: Vec<String> = MEASURES.iter().map(|m| format!("`{m}`")).collect();
            let d = Diagnostic::error(codes::UNKNOWN_NAME, at, format!("there is no measure `{what}`"), "not one");
            self.report(d.help(format!("one of {}", known.join(", "))));
            return Value::Error;
        }
        let length = self.tables.units.named("Length");
        if self.prototype {
            let ty = Type::Quantity { dimension: length, point: false, optional: false };
            return Value::List(vec![self.placeholder(&ty, what)]);
        }
        let found = match what {
            "rise" => self.rise(id),
            _ => {
                let geometry = self.geometry(id);
                let body = Body { frames: &geometry.frames, shape: geometry.shape.as_ref(), solids: &geometry.solids };
                match what {
                    "grasp" | "offer" => body.across(what),
                    "height" => body.height(),
                    "foot" => body.foot(),
                    _ => body.top(),
                }
            }
        };
        Value::List(found.map(|metres| self.number(metres, length, false)).into_iter().collect())
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
