//! Why a motion cannot be carried out, and what meets what.

use matterix_ir::plan::{Motion, Operation};
use matterix_ir::scene::{InstanceId, Scene};
use matterix_motion::spheres::{Contact, Figure, Other};
use serde::{Deserialize, Serialize};

use super::slosh::GRAVITY;
use super::stage::Stage;
use super::surroundings::Surroundings;

/// Why a motion cannot be carried out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refused {
    /// The mover has no joints to move with.
    NoRobot,
    /// The goal has no such frame.
    NoFrame,
    /// The nearest the robot gets to the goal: m and rad away.
    OutOfReach(f64, f64),
    /// At the end of the way, or on a straight one, something meets something.
    Collides(Meeting),
    /// A part of this thing, which the hand leads, meets something on its way.
    Swings(InstanceId, Meeting),
    /// Nothing meets anything where it begins and ends, but no way was found between.
    NoWay,
    /// The thing to be gripped, or to be put down, is this far from where it should be: m and rad.
    Misplaced(f64, f64),
    /// It, or who is to take it over, does not hold what is to be let go.
    NotHeld,
    /// It holds a thing that another robot holds as well.
    Bound(InstanceId, InstanceId),
    /// It stands on what it is to grip.
    StandsOn,
    /// A thing is this wide, and the fingers open so far: m.
    TooWide(f64, f64),
    /// What is to stay upright tilts by so much where the way begins or ends, rad.
    Tilted(f64),
    /// What it holds slips out of its fingers at rest: they bear so much acceleration, m/s2.
    Slips(InstanceId, f64),
    /// So much runs out of what it holds however slowly it goes, m3.
    Spills(InstanceId, f64),
    /// So many positions were given for so many joints.
    Joints(usize, usize),
    /// This joint does not get to its position.
    Beyond(String),
    /// It is to drive, and has no base that does.
    Fixed,
}

impl Refused {
    /// The failure it raises in a run.
    pub fn failure(&self) -> &'static str {
        match self {
            Refused::NoRobot | Refused::NoFrame | Refused::Bound(..) | Refused::StandsOn | Refused::Fixed => {
                "unmovable"
            }
            Refused::OutOfReach(..) => "unreachable",
            Refused::Collides(_) | Refused::Swings(..) => "collision",
            Refused::NoWay => "no_way",
            Refused::Misplaced(..) | Refused::NotHeld => "missed",
            Refused::TooWide(..) => "too_wide",
            Refused::Tilted(_) => "no_way",
            Refused::Spills(..) => "spilled",
            Refused::Slips(..) => "slip",
            Refused::Joints(..) | Refused::Beyond(_) => "unreachable",
        }
    }

    /// The same where what meets does so where the way ends.
    pub(super) fn ending(self, end: bool) -> Self {
        match self {
            Refused::Collides(meeting) => Refused::Collides(Meeting { end, ..meeting }),
            other => other,
        }
    }

    /// In words, for the run of an operation.
    pub fn text(&self, scene: &Scene, operation: &Operation) -> String {
        let Some(mover) = operation.motion.as_ref().map(Motion::mover) else { return String::new() };
        let name = &scene.get(mover).name;
        match self {
            Refused::NoRobot => format!("`{name}` has no joints to move with"),
            Refused::NoFrame => format!("the target frame of `{name}` has no position"),
            Refused::OutOfReach(far, _) => format!("`{name}` stays {:.0} mm short of it", far * 1e3),
            Refused::Collides(m) => format!("`{}` of `{name}` collides with {} at {}", m.mine, m.whom(), m.place()),
            Refused::Swings(item, m) => {
                format!("`{}` of `{}` collides with {} at {}", m.mine, scene.get(*item).name, m.whom(), m.place())
            }
            Refused::NoWay => format!("`{name}` has no collision-free path"),
            Refused::Misplaced(far, _) => format!("`{name}` is {:.0} mm away from its target", far * 1e3),
            Refused::Bound(item, other) => {
                let (item, other) = (&scene.get(*item).name, &scene.get(*other).name);
                format!("`{name}` and `{other}` both hold `{item}`")
            }
            Refused::StandsOn => format!("`{name}` stands on the thing that it should grip"),
            Refused::Fixed => format!("`{name}` has no mobile base"),
            Refused::NotHeld => format!("`{name}` does not hold that thing"),
            Refused::TooWide(width, opening) => {
                format!("the fingers of `{name}` open {:.0} mm, but {:.0} mm are needed", opening * 1e3, width * 1e3)
            }
            Refused::Tilted(by) => format!("the load of `{name}` would tilt by {:.0} deg", by.to_degrees()),
            Refused::Slips(item, borne) => {
                let item = &scene.get(*item).name;
                format!("the fingers of `{name}` can hold only {:.2} of the weight of `{item}`", borne / GRAVITY)
            }
            Refused::Spills(item, lost) => {
                let item = &scene.get(*item).name;
                format!("`{name}` tilts `{item}` so far that {:.1} mL spill", lost * 1e6)
            }
            Refused::Joints(given, there) => format!("{given} positions are given for {there} joints of `{name}`"),
            Refused::Beyond(joint) => format!("joint `{joint}` of `{name}` cannot reach that position"),
        }
    }
}

/// Two things in one place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Meeting {
    /// A link of the robot, or what it holds.
    pub mine: String,
    /// What it meets: an instance, or another link.
    pub other: String,
    /// The link that it meets, if that is another robot's.
    pub part: Option<String>,
    /// The instance it meets, if it is not the robot itself.
    pub with: Option<InstanceId>,
    /// Where, in the lab, m.
    pub at: [f64; 3],
    /// How deep, m.
    pub depth: f64,
    /// Whether they are there before anything moves.
    pub before: bool,
    /// Whether they meet only where the way ends.
    pub end: bool,
}

impl Meeting {
    /// What it meets, in words.
    pub fn whom(&self) -> String {
        match &self.part {
            Some(part) => format!("`{part}` of `{}`", self.other),
            None => format!("`{}`", self.other),
        }
    }

    /// Where, in words.
    pub fn place(&self) -> String {
        let [x, y, z] = self.at.map(|v| v * 1e3);
        format!("({x:.0}, {y:.0}, {z:.0}) mm")
    }
}

impl Stage<'_> {
    /// The deepest contact in words.
    pub(super) fn meeting(
        &self,
        figure: &Figure,
        around: &Surroundings,
        contacts: &[Contact],
        before: bool,
    ) -> Refused {
        let Some(contact) = contacts.first() else { return Refused::NoWay };
        let (other, part, with) = match contact.other {
            Other::Body(index) => {
                let with = around.owners.get(index).copied();
                let name = with.map(|w| self.scene.get(w).name.clone()).unwrap_or_default();
                // Of a robot, which link it is; of what that is built into, nothing more.
                let robot = with.is_some_and(|w| self.actors.contains_key(&w));
                let part = around.world.bodies.get(index).filter(|b| robot && b.name != name).map(|b| b.name.clone());
                (name, part, with)
            }
            Other::Link(link) => (figure.name(link).to_string(), None, None),
        };
        let at = [contact.point.x, contact.point.y, contact.point.z];
        Refused::Collides(Meeting {
            mine: figure.name(contact.link).to_string(),
            other,
            part,
            with,
            at,
            depth: contact.depth,
            before,
            end: false,
        })
    }
}
