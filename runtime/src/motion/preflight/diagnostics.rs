//! What is said of a motion that cannot be carried out.

use std::fmt;

use matterix_ir::plan::Motion;
use matterix_ir::scene::{InstanceId, Scene};
use matterix_ir::{Diagnostic, Span, codes};

use super::more::More;
use crate::motion::passage::Passage;
use crate::motion::refused::{Meeting, Refused};
use crate::motion::stage::Stage;

/// The finding for a refused motion of the statement at `span`; none where another check says it.
pub fn finding(
    stage: &Stage<'_>,
    motion: &Motion,
    values: &[f64],
    refused: &Refused,
    more: &More,
    span: Span,
) -> Option<Diagnostic> {
    let scene = stage.scene;
    let name = |id: InstanceId| scene.get(id).name.as_str();
    if let Motion::Grip { item, by, .. } | Motion::Free { item, by, .. } = motion {
        return gripping(scene, *item, *by, refused, span);
    }
    let (robot, goal) = (motion.mover(), motion.goal().map(|(goal, _)| goal));
    let (arm, to) = (name(robot), Aim { scene, motion, values });
    let mut found = match refused {
        Refused::OutOfReach(..) if more.passage.is_some() => {
            let headline = format!("`{arm}` cannot drive to {}", to.what());
            let label = more.passage.as_ref().map(|passage| closed(scene, arm, passage)).unwrap_or_default();
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::OutOfReach(far, _) => {
            let label = match far * 1e3 {
                mm if mm >= 1.0 => format!("{} stays {mm:.0} mm away", tip(stage, robot)),
                _ => "it gets there, but not turned like this".to_string(),
            };
            let headline = match goal {
                Some(goal) => format!("`{arm}` does not reach `{}`", name(goal)),
                None => format!("`{arm}` does not get {to}"),
            };
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::Collides(meeting) => {
            let (headline, label) = met(stage, meeting, arm, goal, &to);
            Diagnostic::error(codes::COLLISION, span, headline, label)
        }
        Refused::NoWay => {
            let headline = format!("no way was found for `{arm}` {}", to.exactly());
            let label = match &more.between {
                None => "nothing is in the way where it ends, but before".to_string(),
                Some(m) => format!("straight there, `{}` meets {} at {}", m.mine, m.whom(), m.place()),
            };
            Diagnostic::error(codes::COLLISION, span, headline, label)
        }
        Refused::Swings(item, meeting) => return Some(swing(stage, *item, meeting, span)),
        Refused::Bound(item, other) => {
            let headline = format!("`{}` moves while `{}` holds `{}` as well", name(robot), name(*other), name(*item));
            Diagnostic::error(codes::IN_HAND, span, headline, "two arms hold one thing here")
                .help("let one of them let go first")
        }
        Refused::Tilted(by) => {
            let headline = format!("what `{arm}` holds tilts on its way {to}");
            let label = format!("by {:.0} deg at one end of it, more than it may", by.to_degrees());
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::Spills(item, lost) => {
            let headline = format!("`{}` runs over in the hand of `{arm}`", name(*item));
            let label = format!("it tilts so far that {:.1} mL run out", lost * 1e6);
            Diagnostic::error(codes::SPILLED, span, headline, label)
        }
        Refused::Joints(given, there) => {
            let headline = format!("{given} positions for the {there} joints of `{}`", name(robot));
            Diagnostic::error(codes::WRONG_ARGUMENTS, span, headline, "not one for each")
        }
        Refused::Beyond(joint) => {
            let headline = format!("`{joint}` of `{}` does not get to this position", name(robot));
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, "outside of its limits")
        }
        Refused::Fixed => {
            let headline = format!("`{}` does not drive", name(robot));
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, "it stands for good")
                .help("take a robot whose description has joints before its field `base`")
        }
        Refused::NoRobot | Refused::NoFrame | Refused::Misplaced(..) | Refused::NotHeld => return None,
        Refused::StandsOn | Refused::TooWide(..) | Refused::Slips(..) => return None,
    };
    let with = match refused {
        Refused::Collides(meeting) => meeting.with,
        Refused::NoWay => more.between.as_ref().and_then(|m| m.with),
        _ => None,
    };
    let mut shown = Vec::new();
    let gap = more.passage.iter().flat_map(|p| p.gap.iter().flat_map(|(pair, _)| *pair).chain(p.by));
    // Parts stand where the whole of it does: a well, a tip, a slot.
    for id in with.into_iter().chain(gap).chain(goal).map(|id| stage.whole(id)) {
        let at = scene.get(id).span;
        if at == span || shown.contains(&at) {
            continue;
        }
        shown.push(at);
        // What has been moved is no longer where its line says.
        if stage.is_where_it_was(id) {
            found = found.because(at, format!("`{}` stands here", name(id)));
        }
    }
    Some(found)
}

/// What meets what, and where on the way: headline and label.
fn met(stage: &Stage<'_>, meeting: &Meeting, arm: &str, goal: Option<InstanceId>, to: &Aim<'_>) -> (String, String) {
    let (mine, other) = (&meeting.mine, &meeting.other);
    let is_goal = meeting.with.zip(goal).is_some_and(|(with, goal)| stage.whole(with) == stage.whole(goal));
    let headline = match (meeting.before, meeting.end, is_goal) {
        (true, ..) => format!("`{arm}` stands in `{other}` before it goes {to}"),
        (_, true, true) => format!("`{mine}` of `{arm}` does not fit at `{other}`"),
        (_, true, false) => format!("`{arm}` runs into `{other}` at the end of its way {to}"),
        (_, false, true) => format!("`{arm}` runs into `{other}` as it comes up to it"),
        (_, false, false) => format!("`{arm}` runs into `{other}` on its way {to}"),
    };
    let part = meeting.part.as_ref().map_or("it".to_string(), |part| format!("its `{part}`"));
    let depth = (meeting.depth * 1e3).max(1.0);
    (headline, format!("`{mine}` meets {part} at {}, {depth:.0} mm deep", meeting.place()))
}

/// What of a robot is brought to a goal, in words.
fn tip(stage: &Stage<'_>, robot: InstanceId) -> &'static str {
    let grips = stage.actor_of(robot).and_then(|id| stage.actors.get(&id)).is_some_and(|actor| actor.fingers.is_some());
    if grips { "its gripper" } else { "it" }
}

/// What closes the way of a robot that drives.
fn closed(scene: &Scene, arm: &str, passage: &Passage) -> String {
    let name = |id: &InstanceId| scene.get(*id).name.as_str();
    let needs = passage.needs * 1e3;
    match (&passage.gap, &passage.by) {
        (Some(([a, b], wide)), _) => {
            let wide = wide.max(0.0) * 1e3;
            format!("between `{}` and `{}` are {wide:.0} mm, and `{arm}` needs {needs:.0} mm", name(a), name(b))
        }
        (None, Some(by)) => format!("`{}` is in the way; `{arm}` needs {needs:.0} mm to pass", name(by)),
        (None, None) => format!("no gap on the way is as wide as the {needs:.0} mm that `{arm}` needs"),
    }
}

/// Where a motion goes, in words.
struct Aim<'m> {
    scene: &'m Scene,
    motion: &'m Motion,
    values: &'m [f64],
}

impl Aim<'_> {
    /// What it goes to.
    fn what(&self) -> String {
        self.motion.goal().map_or("there".to_string(), |(goal, _)| format!("`{}`", self.scene.get(goal).name))
    }

    /// With the frame it goes to.
    fn exactly(&self) -> String {
        match self.motion.goal() {
            Some((goal, frame)) if !frame.is_empty() => format!("to `{frame}` of `{}`", self.scene.get(goal).name),
            _ => self.to_string(),
        }
    }
}

impl fmt::Display for Aim<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mm = |v: &f64| format!("{:.0}", v * 1e3);
        match (self.motion, self.motion.goal()) {
            (_, Some((goal, _))) => write!(f, "to `{}`", self.scene.get(goal).name),
            (Motion::Home { .. }, _) => f.write_str("home"),
            (Motion::Joints { .. }, _) => f.write_str("to these positions of its joints"),
            (Motion::By { .. }, _) => match self.values {
                [x, y, z] if *x == 0.0 && *y == 0.0 && *z >= 0.0 => write!(f, "{} mm up", mm(z)),
                [x, y, z] if *x == 0.0 && *y == 0.0 => write!(f, "{} mm down", mm(&-z)),
                [x, y, z] => write!(f, "by ({}, {}, {}) mm", mm(x), mm(y), mm(z)),
                _ => f.write_str("there"),
            },
            _ => f.write_str("there"),
        }
    }
}

/// The finding for a vessel in hand in which there is more than it keeps as it is held.
pub fn over(stage: &Stage<'_>, vessel: InstanceId, over: f64, span: Span) -> Diagnostic {
    let name = |id: InstanceId| stage.scene.get(id).name.as_str();
    let arm = stage.held_by(vessel).map_or("a robot", name);
    let headline = format!("`{}` runs over in the hand of `{arm}`", name(vessel));
    let tilt = stage.tilt_at(vessel, f64::INFINITY).to_degrees();
    let label = format!("tilted by {tilt:.0} deg, it holds {:.1} mL more than it keeps", over * 1e6);
    Diagnostic::error(codes::SPILLED, span, headline, label)
}

/// The finding for a part of a thing that runs into something as it moves by itself.
pub fn swing(stage: &Stage<'_>, id: InstanceId, meeting: &Meeting, span: Span) -> Diagnostic {
    let thing = stage.scene.get(id);
    let headline = format!("a part of `{}` runs into `{}`", thing.name, meeting.other);
    let met = meeting.part.as_ref().map_or("it".to_string(), |part| format!("its `{part}`"));
    let depth = (meeting.depth * 1e3).max(1.0);
    let label = format!("`{}` meets {met} at {}, {depth:.0} mm deep", meeting.mine, meeting.place());
    let found = Diagnostic::error(codes::COLLISION, span, headline, label);
    match meeting.with.filter(|with| stage.is_where_it_was(*with)) {
        Some(with) if stage.scene.get(with).span != span => {
            let name = &stage.scene.get(with).name;
            found.because(stage.scene.get(with).span, format!("`{name}` stands here"))
        }
        _ => found,
    }
}

fn gripping(scene: &Scene, item: InstanceId, by: InstanceId, refused: &Refused, span: Span) -> Option<Diagnostic> {
    let (item, by) = (scene.get(item), &scene.get(by).name);
    match refused {
        Refused::Misplaced(far, _) => {
            let headline = format!("`{by}` is not at `{}`: {:.0} mm are between them", item.name, far * 1e3);
            let found = Diagnostic::error(codes::MISPLACED_GRIP, span, headline, "too far to grip or let go");
            Some(found.help(format!("move `{by}` there first; `pick` and `place` do that")))
        }
        Refused::TooWide(width, opening) => {
            let headline = format!("`{by}` does not open wide enough for `{}`", item.name);
            let label = format!("it is {:.0} mm wide, and the fingers open {:.0} mm", width * 1e3, opening * 1e3);
            Some(Diagnostic::error(codes::TOO_WIDE, span, headline, label))
        }
        Refused::StandsOn => {
            let headline = format!("`{by}` cannot grip `{}`, on which it stands", item.name);
            let found = Diagnostic::error(codes::MISPLACED_GRIP, span, headline, "it would have to carry itself");
            Some(found.because(item.span, format!("`{by}` stands on this")))
        }
        _ => None,
    }
}
