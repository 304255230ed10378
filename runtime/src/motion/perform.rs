//! Carries out a motion: where to, along which way, how fast; or why not.

use matterix_ir::plan::{Motion, Operation};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Scene, frame};
use matterix_motion::inverse::{Request, Solver, Unreached};
use matterix_motion::plan::{self, Blocked, Settings, Stride};
use matterix_motion::pose::{distance, pose};
use matterix_motion::spheres::{Checker, Figure, Other};
use matterix_motion::time::{Limits, State, Trajectory, follow};

use super::exact::Exact;
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

/// What a robot did.
#[derive(Clone, Debug, PartialEq)]
pub struct Performed {
    /// The robot.
    pub robot: InstanceId,
    /// Of the joints that move its tip, one after the other.
    pub parts: Vec<Trajectory>,
}

impl Performed {
    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.parts.iter().map(Trajectory::duration).sum()
    }

    /// What the joints that move the tip do at a time since the beginning, s.
    pub fn at(&self, mut time: f64) -> State {
        for part in &self.parts {
            if time <= part.duration() {
                return part.at(time);
            }
            time -= part.duration();
        }
        self.parts.last().map(|p| p.at(p.duration())).unwrap_or_default()
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
            Some(Motion::Grip { by, .. } | Motion::Free { by, .. }) => *by,
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
    /// Carries out a motion. `shift` gives the values of a relative one, m.
    pub fn perform(&mut self, motion: &Motion, shift: [f64; 3]) -> Result<Option<Performed>, Refused> {
        match motion {
            Motion::To { mover, goal, frame, straight } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let to = targets(self, robot, *goal, frame);
                if to.is_empty() {
                    return Err(Refused::NoFrame);
                }
                self.go(robot, &to, *straight, Some(*goal)).map(Some)
            }
            Motion::By { mover, straight, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let mut to = self.tip(robot);
                (0..3).for_each(|k| to.position[k] += shift[k]);
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
        let actor = self.actors.get(&robot)?;
        let base = self.pose(robot);
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
        let steps = (performed.duration() / apart).ceil().max(1.0) as u32;
        (0..=steps)
            .filter_map(|step| {
                let since = performed.duration() * f64::from(step) / f64::from(steps);
                let state = performed.at(since);
                stage.settle(performed.robot, &state.position);
                let mut moment = stage.moment(performed.robot, begin + since)?;
                let arm = &stage.actors.get(&performed.robot)?.arm;
                for (&joint, (speed, acceleration)) in arm.iter().zip(state.velocity.iter().zip(&state.acceleration)) {
                    moment.speeds[joint] = *speed;
                    moment.accelerations[joint] = *acceleration;
                }
                Some(moment)
            })
            .collect()
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
        let mut parts = Vec::new();
        if let Some(item) = self.just_freed(robot).filter(|item| !straight || Some(*item) != goal) {
            let mut back = self.tip(robot);
            back.position = back.point([0.0, 0.0, -RETREAT]);
            parts.push(self.line(robot, &back, &[item])?);
        }
        self.leave(robot);
        let base = self.pose(robot).inverse();
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let now = actor.configuration();
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
                true => self.line(robot, target, goal.as_slice()),
                false => self.way(robot, &q),
            };
            match tried {
                Ok(part) => {
                    parts.push(part);
                    return Ok(Performed { robot, parts });
                }
                // What meets says more than that no way was found.
                Err(why @ Refused::Collides(_)) => refused = why,
                Err(why) if !matches!(refused, Refused::Collides(_)) => refused = why,
                Err(_) => {}
            }
        }
        Err(refused)
    }

    /// A free way to a configuration.
    fn way(&mut self, robot: InstanceId, q: &[f64]) -> Result<Trajectory, Refused> {
        let around = Surroundings::of(self, robot, &self.carriers(robot));
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let figure = self.figure(robot, actor)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = Checker::new(&figure, &around.world, 1.0 / FINENESS).overruled_by(&exact);
        let settings = Settings { iterations: SAMPLES, ..Settings::default() };
        let route =
            plan::plan(&mut checker, &actor.configuration(), q, &settings).map_err(|failure| match failure {
                plan::Failure::Collision(_, contacts) => self.meeting(&figure, &around, &contacts),
                _ => Refused::NoWay,
            })?;
        let part = timed(actor, &route.points, &mut checker)?;
        self.settle(robot, q);
        Ok(part)
    }

    /// A straight line of the tip to a pose; things it comes up to or leaves may be touched.
    fn line(&mut self, robot: InstanceId, to: &Pose, near: &[InstanceId]) -> Result<Trajectory, Refused> {
        let mut without = self.carriers(robot);
        for id in near {
            without.push(*id);
            without.extend(self.below(*id));
        }
        without.extend(self.held(robot).and_then(|held| self.stood_on(held)));
        let around = Surroundings::of(self, robot, &without);
        let actor = self.actors.get(&robot).ok_or(Refused::NoRobot)?;
        let to = pose(&self.pose(robot).inverse().then(*to));
        let figure = self.figure(robot, actor)?;
        let exact = Exact::of(self, robot, &figure, &around);
        let mut checker = Checker::new(&figure, &around.world, 1.0 / FINENESS).overruled_by(&exact);
        let mut solver = Solver::new(actor.chain.clone());
        let followed = plan::straight(&mut solver, &mut checker, &actor.configuration(), &to, &STRIDE);
        let mut points = followed.map_err(|blocked| match blocked {
            Blocked::Reach(_, far, turned) => Refused::OutOfReach(far, turned),
            Blocked::Collision(_, contacts) => self.meeting(&figure, &around, &contacts),
            Blocked::Endless | Blocked::Jump(..) => Refused::NoWay,
        })?;
        let part = timed(actor, &points, &mut checker)?;
        let end = points.pop().unwrap_or_default();
        self.settle(robot, &end);
        Ok(part)
    }

    fn figure(&self, robot: InstanceId, actor: &Actor) -> Result<Figure, Refused> {
        let base = pose(&self.pose(robot));
        let held = held(self, robot, actor);
        Figure::new(actor.to_plan(), &base, &actor.arm, &actor.joints, &held).map_err(|_| Refused::NoRobot)
    }

    fn settle(&mut self, robot: InstanceId, q: &[f64]) {
        if let Some(actor) = self.actors.get_mut(&robot) {
            actor.set(q);
        }
    }

    /// The deepest contact in words.
    fn meeting(
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

fn timed(actor: &Actor, points: &[Vec<f64>], checker: &mut Checker<'_>) -> Result<Trajectory, Refused> {
    let limits = |f: &dyn Fn(&matterix_ir::robot::JointLimits) -> f64| -> Vec<f64> {
        actor.chain.variables().iter().map(|v| f(&v.limits)).collect()
    };
    let acceleration = |l: &matterix_ir::robot::JointLimits| l.acceleration.unwrap_or(l.velocity / RAMP.0);
    let limits = Limits {
        velocity: limits(&|l| l.velocity),
        acceleration: limits(&acceleration),
        jerk: limits(&|l| l.jerk.unwrap_or(acceleration(l) / RAMP.1)),
    };
    follow(points, &limits, Some(checker)).map_err(|_| Refused::NoWay)
}
