//! What is said of a motion that cannot be carried out.

use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Scene, Stand};
use matterix_ir::{Diagnostic, Span, codes};
use matterix_motion::inverse::Request;
use matterix_motion::pose::pose;

use crate::motion::goal::targets;
use crate::motion::refused::{Meeting, Refused};
use crate::motion::stage::{Carried, Stage};

/// The finding for a refused motion of the statement at `span`; none where another check says it.
pub fn finding(
    stage: &Stage<'_>,
    motion: &Motion,
    refused: &Refused,
    nearer: Option<[f64; 2]>,
    span: Span,
) -> Option<Diagnostic> {
    let scene = stage.scene;
    let name = |id: InstanceId| scene.get(id).name.as_str();
    if let Motion::Grip { item, by, .. } | Motion::Free { item, by, .. } = motion {
        return gripping(scene, *item, *by, refused, span);
    }
    let (robot, goal) = (motion.mover(), motion.goal().map(|(goal, _)| goal));
    let to = goal.map_or("there".to_string(), |g| format!("`{}`", name(g)));
    let mut found = match refused {
        Refused::OutOfReach(far, _) => {
            let label = match far * 1e3 {
                mm if mm >= 1.0 => format!("its gripper stays {mm:.0} mm away"),
                _ => "it gets there, but not turned like this".to_string(),
            };
            let headline = format!("`{}` does not reach {to}", name(robot));
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
        }
        Refused::Collides(meeting) => {
            let [x, y, z] = meeting.at.map(|v| v * 1e3);
            let headline = match meeting.before {
                true => format!("`{}` stands in `{}` before it goes to {to}", name(robot), meeting.other),
                false => format!("`{}` runs into `{}` on its way to {to}", name(robot), meeting.other),
            };
            let depth = (meeting.depth * 1e3).max(1.0);
            let met = meeting.part.as_ref().map_or("it".to_string(), |part| format!("its `{part}`"));
            let label = format!("`{}` meets {met} at ({x:.0}, {y:.0}, {z:.0}) mm, {depth:.0} mm deep", meeting.mine);
            Diagnostic::error(codes::COLLISION, span, headline, label)
        }
        Refused::Swings(item, meeting) => return Some(swing(stage, *item, meeting, span)),
        Refused::NoWay => Diagnostic::error(
            codes::COLLISION,
            span,
            format!("no way was found for `{}` to {to}", name(robot)),
            "nothing is in the way at its end, but between",
        ),
        Refused::Bound(item, other) => {
            let headline = format!("`{}` moves while `{}` holds `{}` as well", name(robot), name(*other), name(*item));
            Diagnostic::error(codes::IN_HAND, span, headline, "two arms hold one thing here")
                .help("let one of them let go first")
        }
        Refused::Tilted(by) => {
            let headline = format!("what `{}` holds tilts on its way to {to}", name(robot));
            let label = format!("by {:.0} deg at one end of it, more than it may", by.to_degrees());
            Diagnostic::error(codes::OUT_OF_REACH, span, headline, label)
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
        Refused::StandsOn | Refused::TooWide(..) => return None,
    };
    let met = match refused {
        Refused::Collides(meeting) => meeting.with,
        _ => None,
    };
    let mut shown = Vec::new();
    for id in met.into_iter().chain(goal) {
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
    if let (Some(goal), Some([x, y])) = (goal, nearer) {
        found = found.help(within_reach(stage, goal, [x, y]));
    }
    Some(found)
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

/// Where a goal could be reached, if it is shifted by x and y, m: as its line says it, or from where it is.
fn within_reach(stage: &Stage<'_>, goal: InstanceId, [x, y]: [f64; 2]) -> String {
    let name = &stage.scene.get(goal).name;
    match stage.carried.get(goal.0 as usize) {
        Some(Carried::Stands(Stand::On(on, at))) if stage.is_where_it_was(goal) => {
            let turned = Pose { position: [0.0; 3], ..stage.surface(*on) }.inverse();
            let [dx, dy, _] = turned.point([x, y, 0.0]);
            let [x, y] = [at.position[0] + dx, at.position[1] + dy].map(|v| v * 1e3);
            format!("`{name}` is within reach at ({x:.0}, {y:.0}) mm on `{}`", stage.scene.get(*on).name)
        }
        _ => format!("`{name}` is within reach if it stands ({:.0}, {:.0}) mm from there", x * 1e3, y * 1e3),
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

/// How much of the way to the robot a goal is shifted at a time.
const STEP: f64 = 0.05;

/// How far a goal out of reach would have to be shifted to be reached, x and y in metres: the nearest place on the line to
/// the robot.
pub fn nearer(stage: &Stage<'_>, motion: &Motion) -> Option<[f64; 2]> {
    let (goal, frame) = motion.goal()?;
    let robot = stage.actor_of(motion.mover())?;
    let base = stage.foot(robot);
    let actor = stage.actors.get(&robot)?;
    let mut solver = actor.solver();
    let now = actor.configuration();
    let targets = targets(stage, robot, goal, frame);
    let mut shifted = |share: f64| {
        targets.iter().find_map(|target| {
            let mut at: Pose = *target;
            (0..2).for_each(|k| at.position[k] += share * (base.position[k] - at.position[k]));
            let request = Request { attempts: 20, ..Request::new(pose(&base.inverse().then(at)), &now) };
            solver.solve(&request).ok().map(|_| [0, 1].map(|k| at.position[k] - target.position[k]))
        })
    };
    let first = (1..20).find(|k| shifted(f64::from(*k) * STEP).is_some())?;
    // A step further in leaves room for what comes after.
    shifted(f64::from(first + 1) * STEP).or_else(|| shifted(f64::from(first) * STEP))
}
