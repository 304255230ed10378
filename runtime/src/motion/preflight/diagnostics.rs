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
                mm if mm >= 1.0 => format!("{} stays {mm:.0} mm short of it", tip(stage, robot)),
                _ => "it reaches the place, but not in this orientation".to_string(),
            };
            let headline = match goal {
                Some(goal) => format!("`{arm}` cannot reach `{}`", name(goal)),
                None => format!("`{arm}` cannot move {to}"),
            };
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::Collides(meeting) => {
            let (headline, label) = met(stage, meeting, arm, goal, &to);
            Diagnostic::error(codes::COLLISION, span, headline, label)
        }
        Refused::NoWay => {
            let headline = format!("`{arm}` has no collision-free path {}", to.exactly());
            let label = match &more.between {
                None => "its target is free, but an obstacle is in the way".to_string(),
                Some(m) => format!("on the straight path `{}` meets {} at {}", m.mine, m.whom(), m.place()),
            };
            Diagnostic::error(codes::COLLISION, span, headline, label)
        }
        Refused::Swings(item, meeting) => return Some(swing(stage, *item, meeting, span)),
        Refused::Bound(item, other) => {
            let headline = format!("`{}` moves while `{}` also holds `{}`", name(robot), name(*other), name(*item));
            Diagnostic::error(codes::IN_HAND, span, headline, "two arms hold the same thing")
                .help("release it with one arm first")
        }
        Refused::Tilted(by) => {
            let headline = format!("`{arm}` would tilt its load on the way {to}");
            let label = format!("by {:.0} deg at one end, more than allowed", by.to_degrees());
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::Spills(item, lost) => {
            let headline = format!("`{}` would spill in the gripper of `{arm}`", name(*item));
            let label = format!("it tilts so far that {:.1} mL would run out", lost * 1e6);
            Diagnostic::error(codes::SPILLED, span, headline, label)
        }
        Refused::Joints(given, there) => {
            let headline = format!("{given} positions are given for the {there} joints of `{}`", name(robot));
            Diagnostic::error(codes::WRONG_ARGUMENTS, span, headline, "the numbers differ")
        }
        Refused::Beyond(joint) => {
            let headline = format!("joint `{joint}` of `{}` cannot reach this position", name(robot));
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, "outside its limits")
        }
        Refused::Fixed => {
            let headline = format!("`{}` cannot drive", name(robot));
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, "it has no mobile base")
                .help("use a robot whose description has joints before its field `base`")
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
            found = found.because(at, format!("`{}` is placed here", name(id)));
        }
    }
    Some(found)
}

/// What meets what, and where on the way: headline and label.
fn met(stage: &Stage<'_>, meeting: &Meeting, arm: &str, goal: Option<InstanceId>, to: &Aim<'_>) -> (String, String) {
    let (mine, other) = (&meeting.mine, &meeting.other);
    let is_goal = meeting.with.zip(goal).is_some_and(|(with, goal)| stage.whole(with) == stage.whole(goal));
    let headline = match (meeting.before, meeting.end, is_goal) {
        (true, ..) => format!("`{arm}` already overlaps `{other}` before it moves {to}"),
        (_, true, true) => format!("`{mine}` of `{arm}` does not fit at `{other}`"),
        (_, true, false) => format!("`{arm}` would collide with `{other}` at the end of its way {to}"),
        (_, false, true) => format!("`{arm}` would collide with `{other}` while approaching it"),
        (_, false, false) => format!("`{arm}` would collide with `{other}` on its way {to}"),
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
            format!(
                "the gap between `{}` and `{}` is {wide:.0} mm wide, but `{arm}` needs {needs:.0} mm",
                name(a),
                name(b)
            )
        }
        (None, Some(by)) => format!("`{}` is in the way; `{arm}` needs {needs:.0} mm to pass", name(by)),
        (None, None) => format!("`{arm}` needs a gap of {needs:.0} mm, and there is none on the way"),
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
    let headline = format!("`{}` would spill in the gripper of `{arm}`", name(vessel));
    let tilt = stage.tilt_at(vessel, f64::INFINITY).to_degrees();
    let label = format!("tilted by {tilt:.0} deg, it contains {:.1} mL more than it can hold", over * 1e6);
    Diagnostic::error(codes::SPILLED, span, headline, label)
}

/// The finding for a part of a thing that runs into something as it moves by itself.
pub fn swing(stage: &Stage<'_>, id: InstanceId, meeting: &Meeting, span: Span) -> Diagnostic {
    let thing = stage.scene.get(id);
    let headline = format!("a part of `{}` would collide with `{}`", thing.name, meeting.other);
    let met = meeting.part.as_ref().map_or("it".to_string(), |part| format!("its `{part}`"));
    let depth = (meeting.depth * 1e3).max(1.0);
    let label = format!("`{}` meets {met} at {}, {depth:.0} mm deep", meeting.mine, meeting.place());
    let found = Diagnostic::error(codes::COLLISION, span, headline, label);
    match meeting.with.filter(|with| stage.is_where_it_was(*with)) {
        Some(with) if stage.scene.get(with).span != span => {
            let name = &stage.scene.get(with).name;
            found.because(stage.scene.get(with).span, format!("`{name}` is placed here"))
        }
        _ => found,
    }
}

fn gripping(scene: &Scene, item: InstanceId, by: InstanceId, refused: &Refused, span: Span) -> Option<Diagnostic> {
    let (item, by) = (scene.get(item), &scene.get(by).name);
    match refused {
        Refused::Misplaced(far, _) => {
            let headline = format!("`{by}` is {:.0} mm away from `{}`", item.name, far * 1e3);
            let found = Diagnostic::error(codes::MISPLACED_GRIP, span, headline, "too far to grip or release");
            Some(found.help(format!("move `{by}` there first; `pick` and `place` do that")))
        }
        Refused::TooWide(width, opening) => {
            let headline = format!("`{by}` does not open wide enough for `{}`", item.name);
            let label = format!("it is {:.0} mm wide, but the fingers open only {:.0} mm", width * 1e3, opening * 1e3);
            Some(Diagnostic::error(codes::TOO_WIDE, span, headline, label))
        }
        Refused::StandsOn => {
            let headline = format!("`{by}` cannot grip `{}`, because it stands on it", item.name);
            let found = Diagnostic::error(codes::MISPLACED_GRIP, span, headline, "it would carry itself");
            Some(found.because(item.span, format!("`{by}` stands on this")))
        }
        _ => None,
    }
}
