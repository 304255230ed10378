//! Carries out a motion: where to, along which way, how fast; or why not.

use matterix_ir::plan::{Motion, Operation};
use matterix_ir::pose::Pose;
use matterix_ir::robot::JointLimits;
use matterix_ir::scene::{InstanceId, Scene, frame};
use matterix_motion::inverse::{Request, Unreached};
use matterix_motion::plan::{self, Blocked, Judge, Level, Stride};
use matterix_motion::pose::{distance, pose};
use matterix_motion::spheres::{Checker, Figure, Other};
use matterix_motion::time::{Limits, State, Trajectory, follow};
use serde::{Deserialize, Serialize};

use super::effort::EFFORT;
use super::exact::Exact;
use super::fixture::Led;
use super::goal::{carried_to, spots, targets, targets_at};
use super::postures::postures;
use super::stage::{Actor, Stage};
use super::surroundings::{Surroundings, held};

/// How near a gripper must be to what it grips, and what it holds to where it is put down: m and rad.
pub const TOLERANCE: (f64, f64) = (0.010, 0.02);
/// How far shapes of fingers and what a gripper is said to open may differ, m.
const NOMINAL: f64 = 2e-3;
/// Distance of checked configurations along a way, rad or m.
const FINENESS: f64 = 0.02;
/// Steps along a straight line.
pub(super) const STRIDE: Stride = Stride { linear: 0.01, angular: 0.05, jump: 0.35 };
/// How far a gripper draws back from what it has let go before it goes elsewhere, m.
const RETREAT: f64 = 0.10;
/// Where a description gives no acceleration or jerk: times to full speed and to full acceleration, s (assumed).
const RAMP: (f64, f64) = (0.3, 0.1);

/// What a robot did.
#[derive(Clone, Debug, PartialEq)]
pub struct Performed {
    /// The robot.
    pub robot: InstanceId,
    /// One after the other.
    pub parts: Vec<Part>,
    /// What its hand took along.
    pub led: Option<Led>,
}

/// A motion of some of a robot's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// How long it waits first when those before it have ended, s.
    pub wait: f64,
    /// Which of all that move, by index.
    pub joints: Vec<usize>,
    /// Their way.
    pub trajectory: Trajectory,
}

impl Performed {
    /// Some parts after each other, with nothing taken along.
    pub fn new(robot: InstanceId, parts: Vec<Part>) -> Self {
        Performed { robot, parts, led: None }
    }

    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.parts.iter().map(|part| part.wait + part.trajectory.duration()).sum()
    }

    /// Its parts, each with the time at which it begins, s since the motion did.
    pub fn begins(&self) -> impl Iterator<Item = (f64, &Part)> {
        self.parts.iter().scan(0.0, |time, part| {
            let begin = *time + part.wait;
            *time = begin + part.trajectory.duration();
            Some((begin, part))
        })
    }

    /// Some joints at a time since the beginning, s; while they wait, where they are. Nothing where one of them does not
    /// move.
    pub fn at(&self, joints: &[usize], time: f64) -> Option<Vec<f64>> {
        Some(self.state(joints, time)?.position)
    }

    /// What some joints do at a time since the beginning, s; at rest while they wait. Nothing where one of them does not
    /// move.
    fn state(&self, joints: &[usize], time: f64) -> Option<State> {
        let mut out = State::default();
        for joint in joints {
            let mut own = self.begins().filter_map(|(t, p)| Some((t, p, p.joints.iter().position(|j| j == joint)?)));
            let mut now = own.next()?;
            own.take_while(|(begin, ..)| *begin <= time).for_each(|next| now = next);
            let (begin, part, index) = now;
            let all = part.trajectory.at(time - begin);
            if part.joints == joints {
                return Some(all);
            }
            out.position.push(*all.position.get(index)?);
            out.velocity.push(*all.velocity.get(index)?);
            out.acceleration.push(*all.acceleration.get(index)?);
            out.jerk.push(*all.jerk.get(index)?);
        }
        Some(out)
    }

    /// Which joints it moves of those that move the tip and that drive the robot about.
    pub fn moved(&self, actor: &Actor) -> Vec<usize> {
        let moves = |joints: &&Vec<usize>| self.parts.iter().any(|part| part.joints == **joints);
        [&actor.arm, &actor.drive].into_iter().filter(moves).flatten().copied().collect()
    }

    /// Brings the robot to where it is at a time since the beginning, s. What has not moved yet is where it begins.
    pub fn bring(&self, actor: &mut Actor, time: f64) {
        for part in &self.parts {
            if let Some(at) = self.at(&part.joints, time) {
                actor.set_some(&part.joints, &at);
            }
        }
    }

    /// Gives a moment the speeds and accelerations that joints have at a time since the beginning, s.
    fn rush(&self, moment: &mut Moment, time: f64) {
        for part in &self.parts {
            let Some(state) = self.state(&part.joints, time) else { continue };
            let put = |values: &[f64], all: &mut [f64]| {
                for (joint, value) in part.joints.iter().zip(values) {
                    all.get_mut(*joint).into_iter().for_each(|v| *v = *value);
                }
            };
            put(&state.velocity, &mut moment.speeds);
            put(&state.acceleration, &mut moment.accelerations);
        }
    }
}

/// How a tip is brought to a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Free,
    Straight,
    /// What is held tilts by no more than this, rad.
    Upright(f64),
}

/// Where a robot and what it holds are at one moment of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// s since the run began.
    pub time: f64,
    /// The robot.
    pub robot: InstanceId,
    /// Positions of all its joints that move by themselves, rad or m.
    pub joints: Vec<f64>,
    /// Their speeds, rad/s or m/s.
    pub speeds: Vec<f64>,
    /// Their accelerations, rad/s2 or m/s2.
    pub accelerations: Vec<f64>,
    /// Its links in the lab, in the order of its assembly.
    pub links: Vec<Pose>,
    /// What it holds, in the lab.
    pub held: Option<(InstanceId, Pose)>,
}

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
            Refused::Joints(..) | Refused::Beyond(_) => "unreachable",
        }
    }

    /// In words, for the run of an operation.
    pub fn text(&self, scene: &Scene, operation: &Operation) -> String {
        let Some(mover) = operation.motion.as_ref().map(Motion::mover) else { return String::new() };
        let name = &scene.get(mover).name;
        match self {
            Refused::NoRobot => format!("`{name}` has no joints to move with"),
            Refused::NoFrame => format!("`{name}` is sent to a frame that nothing gives a place"),
            Refused::OutOfReach(far, _) => format!("`{name}` stays {:.0} mm short of it", far * 1e3),
            Refused::Collides(m) => format!("`{}` of `{name}` runs into {} at {}", m.mine, m.whom(), m.place()),
            Refused::Swings(item, m) => {
                format!("`{}` of `{}` runs into {} at {}", m.mine, scene.get(*item).name, m.whom(), m.place())
            }
            Refused::NoWay => format!("no way was found for `{name}`"),
            Refused::Misplaced(far, _) => format!("`{name}` is {:.0} mm away from where it should be", far * 1e3),
            Refused::Bound(item, other) => {
                let (item, other) = (&scene.get(*item).name, &scene.get(*other).name);
                format!("`{name}` and `{other}` both hold `{item}`")
            }
            Refused::StandsOn => format!("`{name}` stands on what it is to grip"),
            Refused::Fixed => format!("`{name}` has no base that drives"),
            Refused::NotHeld => format!("`{name}` holds nothing like that"),
            Refused::TooWide(width, opening) => {
                format!("`{name}` opens {:.0} mm and no wider, not {:.0} mm", opening * 1e3, width * 1e3)
            }
            Refused::Tilted(by) => format!("what `{name}` holds would tilt by {:.0} deg", by.to_degrees()),
            Refused::Joints(given, there) => format!("{given} positions are given for {there} joints of `{name}`"),
            Refused::Beyond(joint) => format!("`{joint}` of `{name}` does not get there"),
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
    /// Carries out a motion. `values` are those of [`Motion::values`], SI.
    pub fn perform(&mut self, motion: &Motion, values: &[f64]) -> Result<Option<Performed>, Refused> {
        self.refresh(EFFORT);
        match motion {
            Motion::To { mover, goal, frame, straight, within, .. } => {
                // What has a time of its own and nothing to move with, or nowhere to go, takes that time.
                let Some(robot) = self.actor_of(*mover) else {
                    return if within.is_some() { Ok(None) } else { Err(Refused::NoRobot) };
                };
                self.take(robot, *mover)?;
                let shift = [0, 1, 2].map(|k| values.get(k).copied().unwrap_or_default());
                let gantry = self.actors.get(&robot).is_some_and(Actor::is_gantry);
                if gantry || within.is_some() {
                    let to = shifted(targets(self, robot, *goal, frame), shift);
                    match to.is_empty() {
                        true if within.is_some() => return Ok(None),
                        true => return Err(Refused::NoFrame),
                        false if gantry => return self.cross(robot, &to, *goal, shift[2].max(0.0)).map(Some),
                        false => {}
                    }
                }
                let way = if *straight { Way::Straight } else { Way::Free };
                self.bring(robot, (*goal, frame), shift, way).map(Some)
            }
            Motion::Upright { mover, goal, frame, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let within = values.first().copied().unwrap_or_default();
                self.bring(robot, (*goal, frame), [0.0; 3], Way::Upright(within)).map(Some)
            }
            Motion::Tilted { mover, about: (item, point), goal, frame, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let parts = self.depart(robot, None)?;
                let angle = values.first().copied().unwrap_or_default();
                self.tilt(robot, (*item, point), (*goal, frame), angle, parts).map(Some)
            }
            Motion::Drive { mover, goal, frame } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                self.drive(robot, *goal, frame).map(Some)
            }
            Motion::Joints { mover, .. } => self.turn(*mover, values.to_vec()).map(Some),
            Motion::Home { mover } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
                let home = actor.arm.iter().filter_map(|i| actor.assembly.home.get(*i)).copied().collect();
                self.turn(robot, home).map(Some)
            }
            Motion::Fingers { by, open } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                let width = if *open { f64::INFINITY } else { 0.0 };
                Ok(self.spread(robot, width).map(|part| Performed::new(robot, vec![part])))
            }
            Motion::By { mover, straight, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let mut to = self.tip(robot);
                to.position.iter_mut().zip(values).for_each(|(x, by)| *x += by);
                let way = if *straight { Way::Straight } else { Way::Free };
                self.go(robot, &[to], way, None).map(Some)
            }
            Motion::Grip { item, frame, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                let to = targets(self, robot, *item, frame);
                if self.stands_on(robot, *item) {
                    return Err(Refused::StandsOn);
                }
                let (far, turned) = self.nearest(robot, &to).ok_or(Refused::NoFrame)?;
                if far > TOLERANCE.0 || turned > TOLERANCE.1 {
                    return Err(Refused::Misplaced(far, turned));
                }
                let width = self.scene.get(*item).body().across(frame);
                let fingers = self.actors.get(&robot).and_then(|a| a.fingers.as_ref());
                if let (Some(width), Some(fingers)) = (width, fingers)
                    && width > fingers.opening() + NOMINAL
                {
                    return Err(Refused::TooWide(width, fingers.opening()));
                }
                self.grip(*item, robot);
                Ok(width.and_then(|width| self.spread(robot, width)).map(|part| Performed::new(robot, vec![part])))
            }
            Motion::Lead { item, frame, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                let to = targets(self, robot, *item, frame);
                let (far, turned) = self.nearest(robot, &to).ok_or(Refused::NoFrame)?;
                if far > TOLERANCE.0 || turned > TOLERANCE.1 {
                    return Err(Refused::Misplaced(far, turned));
                }
                self.lead(robot, *item, frame, values.first().copied().unwrap_or(f64::NAN)).map(Some)
            }
            Motion::Free { item, on, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                if self.held(robot) != Some(*item) {
                    return Err(Refused::NotHeld);
                }
                if let Some(taker) = on.and_then(|on| self.hand_of(on)) {
                    return if self.pass(*item, robot, taker) { Ok(None) } else { Err(Refused::NotHeld) };
                }
                let to: Vec<Pose> = match on {
                    Some(on) => spots(self, *item, *on).into_iter().map(|s| self.surface(*on).then(s)).collect(),
                    None => vec![self.frame(*item, frame::STAND).unwrap_or_else(|| self.pose(*item))],
                };
                let now = pose(&self.pose(*item));
                let far = to.iter().map(|to| distance(&now, &pose(to)).0).fold(f64::INFINITY, f64::min);
                if far > TOLERANCE.0 {
                    return Err(Refused::Misplaced(far, 0.0));
                }
                let below = on.or_else(|| self.stood_on(*item));
                self.carry(*item, below);
                self.freed(robot, *item);
                Ok(self.make_room(robot, *item).map(|part| Performed::new(robot, vec![part])))
            }
        }
    }

    /// A robot and what it holds as they are now, for a recording.
    pub fn moment(&self, robot: InstanceId, time: f64) -> Option<Moment> {
        let base = self.pose(robot);
        if let Some(fixture) = self.fixtures.get(&robot) {
            let links = fixture.links().into_iter().map(|l| base.then(l)).collect();
            let (joints, still) = (fixture.joints.clone(), vec![0.0; fixture.joints.len()]);
            let (speeds, accelerations) = (still.clone(), still);
            return Some(Moment { time, robot, joints, speeds, accelerations, links, held: None });
        }
        let actor = self.actors.get(&robot)?;
        let links = actor.tree.poses(&actor.joints).iter().map(|l| base.then(matterix_motion::placement(l))).collect();
        let held = self.held(robot).map(|id| (id, self.pose(id)));
        let still = vec![0.0; actor.joints.len()];
        Some(Moment {
            time,
            robot,
            joints: actor.joints.clone(),
            speeds: still.clone(),
            accelerations: still,
            links,
            held,
        })
    }

    /// Moments of a motion that has been carried out and began at a time, s, at most so far apart.
    pub fn moments(&self, performed: &Performed, begin: f64, apart: f64) -> Vec<Moment> {
        let mut stage = self.clone();
        let robot = performed.robot;
        performed.led.iter().for_each(|led| stage.undrag(led));
        let steps = (performed.duration() / apart).ceil().max(1.0) as u32;
        let mut out = Vec::new();
        for step in 0..=steps {
            let since = performed.duration() * f64::from(step) / f64::from(steps);
            if let Some(actor) = stage.actors.get_mut(&robot) {
                performed.bring(actor, since);
            }
            if let Some(led) = performed.led.as_ref().filter(|led| since >= led.since) {
                let item = stage.dragged(led, robot);
                out.extend(stage.moment(item, begin + since));
            }
            if let Some(mut moment) = stage.moment(robot, begin + since) {
                performed.rush(&mut moment, since);
                out.push(moment);
            }
        }
        out
    }

    /// Distance and angle from the tip to the nearest of some poses.
    fn nearest(&self, robot: InstanceId, to: &[Pose]) -> Option<(f64, f64)> {
        let tip = pose(&self.tip(robot));
        let all = to.iter().map(|t| distance(&tip, &pose(t)));
        all.min_by(|a, b| (a.0 + a.1).total_cmp(&(b.0 + b.1)))
    }

    /// What comes before a motion: a gripper draws back from what it has let go, and opens for what it goes to. Nothing is
    /// drawn back where `near` is what it let go.
    pub(super) fn depart(&mut self, robot: InstanceId, near: Option<InstanceId>) -> Result<Vec<Part>, Refused> {
        if let Some((item, other)) = self.bound(robot) {
            return Err(Refused::Bound(item, other));
        }
        let mut parts = Vec::new();
        if let Some(item) = self.just_freed(robot).filter(|item| Some(*item) != near) {
            parts.push(self.retreat(robot, item)?);
        }
        self.leave(robot);
        Ok(parts)
    }

    /// Draws a gripper back from what it has let go; where that leads beyond reach, the way it came, or less far.
    fn retreat(&mut self, robot: InstanceId, item: InstanceId) -> Result<Part, Refused> {
        let tip = self.tip(robot);
        let came = self.came.get(&robot).cloned().unwrap_or_default();
        let mut back = |far: f64| {
            let to = Pose { position: tip.point([0.0, 0.0, -far]), ..tip };
            self.line(robot, &[to], &[item])
        };
        let why = match back(RETREAT) {
            Err(why) if matches!(why, Refused::OutOfReach(..) | Refused::NoWay) => why,
            whole => return whole,
        };
        if let Some(part) = self.reversed(robot, &came, RETREAT, item) {
            return Ok(part);
        }
        let mut back = |far: f64| {
            let to = Pose { position: tip.point([0.0, 0.0, -far]), ..tip };
            self.line(robot, &[to], &[item]).ok()
        };
        [0.5, 0.25].iter().find_map(|share| back(share * RETREAT)).ok_or(why)
    }

    /// Brings a robot to a frame, or so far from it, m; what it holds to the nearest spot about it that is free and within
    /// reach.
    fn bring(
        &mut self,
        robot: InstanceId,
        (goal, frame): (InstanceId, &str),
        shift: [f64; 3],
        way: Way,
    ) -> Result<Performed, Refused> {
        let mut spots = match carried_to(self, robot, goal, frame) {
            Some(held) => spots(self, held, goal),
            None => vec![Pose::IDENTITY],
        };
        if way == Way::Straight && spots.len() > 1 {
            // Straight down, not over to another spot.
            let tip = self.tip(robot).position;
            let far = |spot: &Pose| {
                let to = targets_at(self, robot, goal, frame, *spot).first().map_or(tip, |p| p.position);
                (0..3).map(|k| (to[k] - tip[k]) * (to[k] - tip[k])).sum::<f64>()
            };
            let mut near: Vec<(f64, Pose)> = spots.into_iter().map(|spot| (far(&spot), spot)).collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            spots = near.into_iter().map(|n| n.1).take(1).collect();
        }
        if spots.len() > 1 {
            let near: Vec<Pose> = spots.iter().copied().filter(|s| self.may_reach(robot, goal, frame, *s)).collect();
            spots = if near.is_empty() { spots.into_iter().take(1).collect() } else { near };
        }
        let before = (spots.len() > 1).then(|| self.clone());
        let mut refused = Refused::NoFrame;
        for (k, spot) in spots.into_iter().enumerate() {
            let to = shifted(targets_at(self, robot, goal, frame, spot), shift);
            if to.is_empty() {
                return Err(Refused::NoFrame);
            }
            match self.go(robot, &to, way, Some(goal)) {
                Ok(done) => return Ok(done),
                // The first spot says best what is wrong.
                Err(why) if k == 0 => refused = why,
                Err(_) => {}
            }
            if let Some(before) = &before {
                self.back_to(before);
            }
            if self.is_weary() {
                break;
            }
        }
        Err(refused)
    }

    /// Whether a short search finds a posture for one spot beside a frame, and for letting go there.
    fn may_reach(&self, robot: InstanceId, goal: InstanceId, frame: &str, spot: Pose) -> bool {
        let Some(actor) = self.actors.get(&robot) else { return false };
        if !actor.drive.is_empty() {
            return true;
        }
        let (base, now) = (self.foot(robot).inverse(), actor.configuration());
        let mut solver = actor.solver();
        let mut reaches = |frame: &str| {
            let to = targets_at(self, robot, goal, frame, spot).into_iter().next()?;
            let request = Request { attempts: 6, ..Request::new(pose(&base.then(to)), &now) };
            Some(solver.solve(&request).is_ok())
        };
        reaches(frame) == Some(true) && reaches(frame::PLACE) != Some(false)
    }

    fn go(&mut self, robot: InstanceId, to: &[Pose], way: Way, goal: Option<InstanceId>) -> Result<Performed, Refused> {
        let mut parts = self.depart(robot, goal.filter(|_| way == Way::Straight))?;
        if let Some(item) = goal.filter(|_| self.held(robot).is_none()) {
            parts.extend(self.make_room(robot, item).filter(|part| part.trajectory.duration() > 0.0));
        }
        parts.extend(self.reach(robot, to, way, goal)?);
        Ok(Performed::new(robot, parts))
    }

    /// Brings the tip to one of some poses from where the robot stands.
    pub(super) fn stretch(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        way: Way,
        goal: Option<InstanceId>,
    ) -> Result<Vec<Part>, Refused> {
        let base = self.foot(robot).inverse();
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (now, arm) = (actor.configuration(), actor.arm.clone());
        let mut solver = actor.solver();
        let mut found: Vec<(f64, &Pose, Vec<f64>)> = Vec::new();
        let mut missed: Option<Unreached> = None;
        for target in to {
            let request = Request { choices: 4, attempts: 60, ..Request::new(pose(&base.then(*target)), &now) };
            match solver.solve(&request) {
                Ok(solution) => {
                    let far = solution.q.iter().zip(&now).map(|(a, b)| (a - b) * (a - b)).sum();
                    found.push((far, target, solution.q));
                }
                Err(near) if missed.as_ref().is_none_or(|m| near.linear + near.angular < m.linear + m.angular) => {
                    missed = Some(near);
                }
                Err(_) => {}
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut refused = missed.map(|m| Refused::OutOfReach(m.linear, m.angular)).unwrap_or(Refused::NoWay);
        if !found.is_empty() {
            refused = Refused::NoWay;
        }
        let mut keep = |why: Refused| {
            // What meets says more than that no way was found, and the nearest says most.
            if !matches!(refused, Refused::Collides(_)) {
                refused = why;
            }
        };
        for (_, target, q) in &found {
            let tried = match way {
                Way::Straight => self.line(robot, std::slice::from_ref(*target), goal.as_slice()),
                Way::Free => self.way(robot, &arm, q, None),
                Way::Upright(within) => self.way(robot, &arm, q, Some(within)),
            };
            match tried {
                Ok(part) => return Ok(vec![part]),
                Err(why) => keep(why),
            }
        }
        // What is in the way of a line may not be if the gripper turns before it sets out, or the arm takes another posture;
        // a line that ends beyond what one posture reaches may be within what another one does.
        if way == Way::Straight {
            let nearest: Vec<(Pose, Vec<f64>)> = found.iter().map(|(_, target, q)| (**target, q.clone())).collect();
            if let Some(parts) = self.line_from_elsewhere(robot, to, &nearest, goal.as_slice()) {
                return Ok(parts.into());
            }
        }
        // Another posture may be free where the nearest is not; a search that finds no way to one takes long.
        let within = match way {
            Way::Upright(within) => Some(within),
            Way::Free | Way::Straight => None,
        };
        let others = match refused {
            Refused::Collides(_) if way != Way::Straight => postures(self, robot, to),
            _ => Vec::new(),
        };
        for q in others {
            match self.way(robot, &arm, &q, within) {
                Ok(part) => return Ok(vec![part]),
                Err(Refused::NoWay) => break,
                Err(_) => {}
            }
        }
        Err(refused)
    }

    /// What a robot must not touch on a straight line: all but what it comes up to or leaves, and what that stands on.
    pub(super) fn beside_line(&self, robot: InstanceId, near: &[InstanceId]) -> Surroundings {
        let without = self.left_out(robot, near);
        let bodiless: Vec<InstanceId> = without.iter().flat_map(|id| self.owners(*id)).collect();
        Surroundings::of_but(self, robot, &without, &bodiless)
    }

    /// A free way of some joints to where they are to stand; the others do not move. What is held tilts by no more than so
    /// much on it, rad.
    pub(super) fn way(
        &mut self,
        robot: InstanceId,
        variables: &[usize],
        q: &[f64],
        within: Option<f64>,
    ) -> Result<Part, Refused> {
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let around = match variables == actor.drive {
            true => Surroundings::of_driving(self, robot),
            false => Surroundings::of(self, robot),
        };
        let figure = self.figure(robot, actor, variables)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        if self.is_weary() {
            return Err(Refused::NoWay);
        }
        let settings = self.search();
        let start = actor.positions(variables);
        let refused = |failure| match failure {
            plan::Failure::Collision(end, contacts) => {
                self.meeting(&figure, &around, &contacts, end == plan::End::Start)
            }
            plan::Failure::Tilt(_, by) => Refused::Tilted(by),
            _ => Refused::NoWay,
        };
        let part = match within.and_then(|tilt| self.upright(robot, tilt)) {
            Some(upright) => {
                let mut solver = actor.solver();
                let mut level = Level { checker: &mut checker, solver: &mut solver, upright };
                let route = plan::plan_upright(&mut level, &start, q, &settings);
                self.spent_on(level.checker, 0);
                let route = route.map_err(refused)?;
                timed(actor, variables, &route.points, Some(&mut level))?
            }
            None => {
                let route = plan::plan(&mut checker, &start, q, &settings);
                self.spent_on(&checker, 0);
                let route = route.map_err(refused)?;
                timed(actor, variables, &route.points, Some(&mut checker))?
            }
        };
        self.settle(robot, variables, q);
        Ok(part)
    }

    /// Straight lines of the tip from pose to pose; fingers may touch what it comes up to or leaves.
    pub(super) fn line(&mut self, robot: InstanceId, to: &[Pose], near: &[InstanceId]) -> Result<Part, Refused> {
        self.lines(robot, to, near, true)
    }

    /// As [`Stage::line`]; where it does not look at what it comes up to, that goes along with it.
    pub(super) fn lines(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        near: &[InstanceId],
        looks: bool,
    ) -> Result<Part, Refused> {
        let around = self.beside_line(robot, near);
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (base, arm) = (self.foot(robot).inverse(), actor.arm.clone());
        let figure = self.figure(robot, actor, &arm)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = self.checker(&figure, &around, &exact);
        let mut solver = actor.solver();
        let mut points = vec![actor.configuration()];
        for to in to {
            let from = points.last().cloned().unwrap_or_default();
            let to = pose(&base.then(*to));
            let before = checker.effort();
            let followed = plan::straight(&mut solver, &mut checker, &from, &to, &STRIDE);
            self.spent_on(&checker, before);
            let followed = followed.map_err(|blocked| match blocked {
                Blocked::Reach(_, far, turned) => Refused::OutOfReach(far, turned),
                Blocked::Collision(_, contacts) => self.meeting(&figure, &around, &contacts, false),
                Blocked::Endless | Blocked::Jump(..) => Refused::NoWay,
            })?;
            points.extend(followed.into_iter().skip(1));
        }
        if let Some(refused) = looks.then(|| self.bump(robot, &figure, near, &points)).flatten() {
            return Err(refused);
        }
        let part = timed(actor, &arm, &points, Some(&mut checker))?;
        let end = points.last().cloned().unwrap_or_default();
        self.settle(robot, &arm, &end);
        self.came.insert(robot, points);
        Ok(part)
    }

    /// Says what collides. What others sweep are balls, and a way around them is not worth asking true shapes.
    pub(super) fn checker<'a>(
        &self,
        figure: &'a Figure,
        around: &'a Surroundings,
        exact: &'a Exact<'_>,
    ) -> Checker<'a> {
        let checker = Checker::new(figure, &around.world, 1.0 / FINENESS);
        if self.around_sweeps { checker } else { checker.overruled_by(exact) }
    }

    pub(super) fn figure(&self, robot: InstanceId, actor: &Actor, moved: &[usize]) -> Result<Figure, Refused> {
        let base = pose(&self.pose(robot));
        let held = held(self, robot, actor);
        Figure::new(actor.to_plan(), &base, moved, &actor.joints, &held).map_err(|_| Refused::NoRobot)
    }

    /// Joints of a robot stand like this from now on.
    pub(super) fn settle(&mut self, robot: InstanceId, variables: &[usize], q: &[f64]) {
        self.came.remove(&robot);
        if let Some(actor) = self.actors.get_mut(&robot) {
            actor.set_some(variables, q);
        }
    }

    /// Which joints of a robot move its tip.
    pub(super) fn arm(&self, robot: InstanceId) -> Vec<usize> {
        self.actors.get(&robot).map(|actor| actor.arm.clone()).unwrap_or_default()
    }

    /// The deepest contact in words.
    pub(super) fn meeting(
        &self,
        figure: &Figure,
        around: &Surroundings,
        contacts: &[matterix_motion::spheres::Contact],
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
        })
    }
}

/// Poses so far from where they were, m.
fn shifted(mut all: Vec<Pose>, by: [f64; 3]) -> Vec<Pose> {
    all.iter_mut().for_each(|at| (0..3).for_each(|k| at.position[k] += by[k]));
    all
}

/// The motion of some joints of a robot from point to point, as fast as they may.
pub(super) fn timed(
    actor: &Actor,
    variables: &[usize],
    points: &[Vec<f64>],
    judge: Option<&mut dyn Judge>,
) -> Result<Part, Refused> {
    let limits = |f: fn(&JointLimits) -> f64| -> Vec<f64> {
        variables.iter().filter_map(|i| actor.tree.variables().get(*i)).map(|v| f(&v.limits)).collect()
    };
    let limits = Limits { velocity: limits(|l| l.velocity), acceleration: limits(acceleration), jerk: limits(jerk) };
    let trajectory = follow(points, &limits, judge).map_err(|_| Refused::NoWay)?;
    Ok(Part { wait: 0.0, joints: variables.to_vec(), trajectory })
}

/// The greatest acceleration of a joint, rad/s2 or m/s2.
pub(super) fn acceleration(limits: &JointLimits) -> f64 {
    limits.acceleration.unwrap_or(limits.velocity / RAMP.0)
}

/// The greatest jerk of a joint, rad/s3 or m/s3.
pub(super) fn jerk(limits: &JointLimits) -> f64 {
    limits.jerk.unwrap_or(acceleration(limits) / RAMP.1)
}
