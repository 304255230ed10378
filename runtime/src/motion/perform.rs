//! Carries out a motion: where to, along which way, how fast; or why not.

use matterix_ir::plan::{Motion, Operation};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Scene, frame};
use matterix_motion::inverse::{Request, Solver, Unreached};
use matterix_motion::plan::{self, Blocked, Judge, Settings, Stride};
use matterix_motion::pose::{distance, pose};
use matterix_motion::spheres::{Checker, Figure, Other};
use matterix_motion::time::{Limits, Trajectory, follow};

use super::fixture::Led;
use super::goal::{spot, targets};
use super::stage::{Actor, Stage};
use super::surroundings::{Surroundings, held};

/// How near a gripper must be to what it grips, and what it holds to where it is put down: m and rad.
pub const TOLERANCE: (f64, f64) = (0.010, 0.02);
/// Distance of checked configurations along a way, rad or m.
const FINENESS: f64 = 0.02;
/// Steps along a straight line.
const STRIDE: Stride = Stride { linear: 0.01, angular: 0.05, jump: 0.35 };
/// How far a gripper draws back from what it has let go before it goes elsewhere, m.
const RETREAT: f64 = 0.10;
/// Samples drawn before a way counts as not found.
const SAMPLES: usize = 60_000;
/// Where a description gives no acceleration or jerk: times to full speed and to full acceleration, s (assumed).
const RAMP: (f64, f64) = (0.3, 0.1);

/// Some joints of a robot moving together.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Which of those that move by themselves.
    pub variables: Vec<usize>,
    /// How.
    pub way: Trajectory,
}

/// What a robot did.
#[derive(Clone, Debug, PartialEq)]
pub struct Performed {
    /// The robot.
    pub robot: InstanceId,
    /// All its joints when it began, rad or m.
    pub begun: Vec<f64>,
    /// One after the other.
    pub parts: Vec<Part>,
    /// What its hand took along.
    pub led: Option<Led>,
}

impl Performed {
    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.parts.iter().map(|part| part.way.duration()).sum()
    }

    /// All joints at a time since the beginning, s.
    pub fn at(&self, mut time: f64) -> Vec<f64> {
        let mut joints = self.begun.clone();
        for part in &self.parts {
            let lasts = part.way.duration();
            let positions = part.way.at(time.min(lasts)).position;
            part.variables.iter().zip(positions).for_each(|(variable, q)| joints[*variable] = q);
            time -= lasts;
            if time <= 0.0 {
                break;
            }
        }
        joints
    }
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
    /// Its links in the lab, in the order of its assembly.
    pub links: Vec<Pose>,
    /// What it holds, in the lab.
    pub held: Option<(InstanceId, Pose)>,
}

/// Why a motion cannot be carried out.
#[derive(Clone, Debug, PartialEq)]
pub enum Refused {
    /// The mover has no joints to move with.
    NoRobot,
    /// The goal has no such frame.
    NoFrame,
    /// The nearest the robot gets to the goal: m and rad away.
    OutOfReach(f64, f64),
    /// At the end of the way, or on a straight one, something meets something.
    Collides(Meeting),
    /// Nothing meets anything where it begins and ends, but no way was found between.
    NoWay,
    /// The thing to be gripped, or to be put down, is this far from where it should be: m and rad.
    Misplaced(f64, f64),
    /// It holds nothing that could be let go.
    NotHeld,
}

impl Refused {
    /// The failure it raises in a run.
    pub fn failure(&self) -> &'static str {
        match self {
            Refused::NoRobot | Refused::NoFrame => "unmovable",
            Refused::OutOfReach(..) => "unreachable",
            Refused::Collides(_) => "collision",
            Refused::NoWay => "no_way",
            Refused::Misplaced(..) | Refused::NotHeld => "missed",
        }
    }

    /// In words, for the run of an operation.
    pub fn text(&self, scene: &Scene, operation: &Operation) -> String {
        let mover = match &operation.motion {
            Some(Motion::To { mover: by, .. } | Motion::By { mover: by, .. }) => *by,
            Some(Motion::Grip { by, .. } | Motion::Free { by, .. } | Motion::Lead { by, .. }) => *by,
            None => return String::new(),
        };
        let name = &scene.get(mover).name;
        match self {
            Refused::NoRobot => format!("`{name}` has no joints to move with"),
            Refused::NoFrame => format!("`{name}` is sent to a frame that nothing gives a place"),
            Refused::OutOfReach(far, _) => format!("`{name}` stays {:.0} mm short of it", far * 1e3),
            Refused::Collides(m) => format!("`{}` of `{name}` runs into `{}`", m.mine, m.other),
            Refused::NoWay => format!("no way was found for `{name}`"),
            Refused::Misplaced(far, _) => format!("`{name}` is {:.0} mm away from where it should be", far * 1e3),
            Refused::NotHeld => format!("`{name}` holds nothing like that"),
        }
    }
}

/// Two things in one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Meeting {
    /// A link of the robot, or what it holds.
    pub mine: String,
    /// What it meets: an instance, or another link.
    pub other: String,
    /// The instance it meets, if it is not the robot itself.
    pub with: Option<InstanceId>,
    /// Where, in the lab, m.
    pub at: [f64; 3],
    /// How deep, m.
    pub depth: f64,
}

impl Stage<'_> {
    /// Carries out a motion. `given` is how far one goes, or from its goal, m; of one that takes a part along, its first number
    /// is where the joint of that part then stands, rad or m.
    pub fn perform(&mut self, motion: &Motion, given: [f64; 3]) -> Result<Option<Performed>, Refused> {
        match motion {
            Motion::To { mover, goal, frame, straight, within, .. } => {
                // What has a time of its own and nothing to move with, or nowhere to go, takes that time.
                let Some(robot) = self.actor_of(*mover) else {
                    return if within.is_some() { Ok(None) } else { Err(Refused::NoRobot) };
                };
                self.take(robot, *mover)?;
                let mut to = targets(self, robot, *goal, frame);
                to.iter_mut().for_each(|to| (0..3).for_each(|k| to.position[k] += given[k]));
                if to.is_empty() {
                    return if within.is_some() { Ok(None) } else { Err(Refused::NoFrame) };
                }
                if self.actors.get(&robot).is_some_and(Actor::is_gantry) {
                    return self.cross(robot, &to, given[2].max(0.0)).map(Some);
                }
                self.go(robot, &to, *straight, Some(*goal)).map(Some)
            }
            Motion::By { mover, straight, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let mut to = self.tip(robot);
                (0..3).for_each(|k| to.position[k] += given[k]);
                self.go(robot, &[to], *straight, None).map(Some)
            }
            Motion::Grip { item, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                let to = targets(self, robot, *item, frame::GRASP);
                let (far, turned) = self.nearest(robot, &to).ok_or(Refused::NoFrame)?;
                if far > TOLERANCE.0 || turned > TOLERANCE.1 {
                    return Err(Refused::Misplaced(far, turned));
                }
                self.carry(*item, Some(robot));
                Ok(None)
            }
            Motion::Lead { item, frame, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                let to = targets(self, robot, *item, frame);
                let (far, turned) = self.nearest(robot, &to).ok_or(Refused::NoFrame)?;
                if far > TOLERANCE.0 || turned > TOLERANCE.1 {
                    return Err(Refused::Misplaced(far, turned));
                }
                self.lead(robot, *item, frame, given[0]).map(Some)
            }
            Motion::Free { item, on, by } => {
                let robot = self.actor_of(*by).ok_or(Refused::NoRobot)?;
                if self.held(robot) != Some(*item) {
                    return Err(Refused::NotHeld);
                }
                let to = match on {
                    Some(on) => self.surface(*on).then(spot(self, *item, *on)),
                    None => self.frame(*item, frame::STAND).unwrap_or_else(|| self.pose(*item)),
                };
                let (far, _) = distance(&pose(&self.pose(*item)), &pose(&to));
                if far > TOLERANCE.0 {
                    return Err(Refused::Misplaced(far, 0.0));
                }
                let below = on.or_else(|| self.stood_on(*item));
                self.carry(*item, below);
                self.freed(robot, *item);
                Ok(None)
            }
        }
    }

    /// A robot and what it holds as they are now, for a recording.
    pub fn moment(&self, robot: InstanceId, time: f64) -> Option<Moment> {
        let base = self.pose(robot);
        if let Some(fixture) = self.fixtures.get(&robot) {
            let links = fixture.links().into_iter().map(|l| base.then(l)).collect();
            return Some(Moment { time, robot, joints: fixture.joints.clone(), links, held: None });
        }
        let actor = self.actors.get(&robot)?;
        let links = actor.tree.poses(&actor.joints).iter().map(|l| base.then(matterix_motion::placement(l))).collect();
        let held = self.held(robot).map(|id| (id, self.pose(id)));
        Some(Moment { time, robot, joints: actor.joints.clone(), links, held })
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
                actor.joints = performed.at(since);
            }
            if let Some(led) = &performed.led {
                let item = stage.dragged(led, robot);
                out.extend(stage.moment(item, begin + since));
            }
            out.extend(stage.moment(robot, begin + since));
        }
        out
    }

    /// Distance and angle from the tip to the nearest of some poses.
    fn nearest(&self, robot: InstanceId, to: &[Pose]) -> Option<(f64, f64)> {
        let tip = pose(&self.tip(robot));
        let all = to.iter().map(|t| distance(&tip, &pose(t)));
        all.min_by(|a, b| (a.0 + a.1).total_cmp(&(b.0 + b.1)))
    }

    fn go(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        straight: bool,
        goal: Option<InstanceId>,
    ) -> Result<Performed, Refused> {
        let (mut parts, begun) = (Vec::new(), self.joints(robot));
        if let Some(item) = self.just_freed(robot).filter(|item| !straight || Some(*item) != goal) {
            let mut back = self.tip(robot);
            back.position = back.point([0.0, 0.0, -RETREAT]);
            parts.push(self.along(robot, &[back], &[item])?);
        }
        self.leave(robot);
        parts.extend(self.reach(robot, to, straight, goal)?);
        Ok(Performed { robot, begun, parts, led: None })
    }

    /// Brings the tip to one of some poses from where the robot stands.
    pub(super) fn stretch(
        &mut self,
        robot: InstanceId,
        to: &[Pose],
        straight: bool,
        goal: Option<InstanceId>,
    ) -> Result<Part, Refused> {
        let base = self.foot(robot).inverse();
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let (now, actor_arm) = (actor.configuration(), actor.arm.clone());
        let mut solver = Solver::new(actor.chain.clone());
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
        for (_, target, q) in found {
            let tried = match straight {
                true => self.along(robot, std::slice::from_ref(target), goal.as_slice()),
                false => self.way(robot, &actor_arm, &q),
            };
            match tried {
                Ok(part) => return Ok(part),
                // What meets says more than that no way was found.
                Err(why @ Refused::Collides(_)) => refused = why,
                Err(why) if !matches!(refused, Refused::Collides(_)) => refused = why,
                Err(_) => {}
            }
        }
        Err(refused)
    }

    /// A free way of some joints to where they are to stand; the others do not move.
    pub(super) fn way(&mut self, robot: InstanceId, variables: &[usize], q: &[f64]) -> Result<Part, Refused> {
        let around = Surroundings::of(self, robot, &self.carriers(robot));
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let figure = self.figure(robot, actor, variables)?;
        let mut checker = Checker::new(&figure, &around.world, 1.0 / FINENESS);
        let settings = Settings { iterations: SAMPLES, ..Settings::default() };
        let route =
            plan::plan(&mut checker, &actor.positions(variables), q, &settings).map_err(|failure| match failure {
                plan::Failure::Collision(_, contacts) => self.meeting(&figure, &around, &contacts),
                _ => Refused::NoWay,
            })?;
        let part = timed(actor, variables, &route.points, Some(&mut checker))?;
        self.settle(robot, variables, q);
        Ok(part)
    }

    /// Straight lines of the tip from pose to pose; things it comes up to or leaves may be touched.
    pub(super) fn along(&mut self, robot: InstanceId, to: &[Pose], near: &[InstanceId]) -> Result<Part, Refused> {
        let mut without = self.carriers(robot);
        for id in near {
            without.push(*id);
            without.extend(self.below(*id));
        }
        without.extend(self.held(robot).and_then(|held| self.stood_on(held)));
        let around = Surroundings::of(self, robot, &without);
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let foot = self.foot(robot).inverse();
        let figure = self.figure(robot, actor, &actor.arm)?;
        let mut checker = Checker::new(&figure, &around.world, 1.0 / FINENESS);
        let mut solver = Solver::new(actor.chain.clone());
        let mut points = vec![actor.configuration()];
        for to in to {
            let now = points.pop().unwrap_or_default();
            let followed = plan::straight(&mut solver, &mut checker, &now, &pose(&foot.then(*to)), &STRIDE);
            points.extend(followed.map_err(|blocked| match blocked {
                Blocked::Reach(_, far, turned) => Refused::OutOfReach(far, turned),
                Blocked::Collision(_, contacts) => self.meeting(&figure, &around, &contacts),
                Blocked::Endless | Blocked::Jump(..) => Refused::NoWay,
            })?);
        }
        let variables = actor.arm.clone();
        let part = timed(actor, &variables, &points, Some(&mut checker))?;
        let end = points.pop().unwrap_or_default();
        self.settle(robot, &variables, &end);
        Ok(part)
    }

    pub(super) fn figure(&self, robot: InstanceId, actor: &Actor, moved: &[usize]) -> Result<Figure, Refused> {
        let base = pose(&self.pose(robot));
        let held = held(self, robot, actor);
        Figure::new(actor.to_plan(), &base, moved, &actor.joints, &held).map_err(|_| Refused::NoRobot)
    }

    /// Joints of a robot stand like this from now on.
    pub(super) fn settle(&mut self, robot: InstanceId, variables: &[usize], q: &[f64]) {
        if let Some(actor) = self.actors.get_mut(&robot) {
            variables.iter().zip(q).for_each(|(variable, q)| actor.joints[*variable] = *q);
        }
    }

    /// All joints of a robot as they stand, rad or m.
    pub(super) fn joints(&self, robot: InstanceId) -> Vec<f64> {
        self.actors.get(&robot).map(|actor| actor.joints.clone()).unwrap_or_default()
    }

    /// The deepest contact in words.
    pub(super) fn meeting(
        &self,
        figure: &Figure,
        around: &Surroundings,
        contacts: &[matterix_motion::spheres::Contact],
    ) -> Refused {
        let Some(contact) = contacts.first() else { return Refused::NoWay };
        let (other, with) = match contact.other {
            Other::Body(index) => {
                let with = around.owners.get(index).copied();
                (with.map(|w| self.scene.get(w).name.clone()).unwrap_or_default(), with)
            }
            Other::Link(link) => (figure.name(link).to_string(), None),
        };
        let at = [contact.point.x, contact.point.y, contact.point.z];
        Refused::Collides(Meeting {
            mine: figure.name(contact.link).to_string(),
            other,
            with,
            at,
            depth: contact.depth,
        })
    }
}

pub(super) fn timed(
    actor: &Actor,
    variables: &[usize],
    points: &[Vec<f64>],
    checker: Option<&mut Checker<'_>>,
) -> Result<Part, Refused> {
    let limits = |f: &dyn Fn(&matterix_ir::robot::JointLimits) -> f64| -> Vec<f64> {
        variables.iter().filter_map(|i| actor.tree.variables().get(*i)).map(|v| f(&v.limits)).collect()
    };
    let acceleration = |l: &matterix_ir::robot::JointLimits| l.acceleration.unwrap_or(l.velocity / RAMP.0);
    let limits = Limits {
        velocity: limits(&|l| l.velocity),
        acceleration: limits(&acceleration),
        jerk: limits(&|l| l.jerk.unwrap_or(acceleration(l) / RAMP.1)),
    };
    let way = follow(points, &limits, checker.map(|c| c as &mut dyn Judge)).map_err(|_| Refused::NoWay)?;
    Ok(Part { variables: variables.to_vec(), way })
}
