//! Carries out a motion of a plan.

use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, frame};
use matterix_motion::pose::{distance, pose};

use super::bring::{Way, shifted};
use super::effort::EFFORT;
use super::goal::{spots, targets};
use super::performed::Performed;
use super::refused::Refused;
use super::stage::{Actor, Stage};

/// How near a gripper must be to what it grips, and what it holds to where it is put down: m and rad.
pub const TOLERANCE: (f64, f64) = (0.010, 0.02);
/// How far shapes of fingers and what a gripper is said to open may differ, m.
const NOMINAL: f64 = 2e-3;

impl Stage<'_> {
    /// Carries out a motion, as slowly as what the robot holds needs so that nothing runs over. `values` are those of
    /// [`Motion::values`], SI.
    pub fn perform(&mut self, motion: &Motion, values: &[f64]) -> Result<Option<Performed>, Refused> {
        let before = (!self.burdens.is_empty()).then(|| self.clone());
        let Some(performed) = self.carry_out(motion, values)? else { return Ok(None) };
        let performed = self.in_time(motion, performed);
        match before {
            Some(before) => self.calmed(&before, motion, performed).map(Some),
            None => Ok(Some(performed)),
        }
    }

    fn carry_out(&mut self, motion: &Motion, values: &[f64]) -> Result<Option<Performed>, Refused> {
        self.refresh(EFFORT);
        match motion {
            Motion::To { mover, goal, frame, shift, straight, within, .. } => {
                // What has a time of its own and nothing to move with, or nowhere to go, takes that time.
                let Some(robot) = self.actor_of(*mover) else {
                    return if within.is_some() { Ok(None) } else { Err(Refused::NoRobot) };
                };
                self.take(robot, *mover)?;
                let (shift, hanging) = values.split_at(if shift.is_some() { values.len().min(3) } else { 0 });
                let shift = [0, 1, 2].map(|k| shift.get(k).copied().unwrap_or_default());
                // What does not say how far something hangs below it is taken to stop short for that.
                let hanging = hanging.first().copied().unwrap_or(shift[2].max(0.0));
                let gantry = self.actors.get(&robot).is_some_and(Actor::is_gantry);
                if gantry || within.is_some() {
                    let to = shifted(targets(self, robot, *goal, frame), shift);
                    match to.is_empty() {
                        true if within.is_some() => return Ok(None),
                        true => return Err(Refused::NoFrame),
                        false if gantry => return self.cross(robot, &to, *goal, hanging).map(Some),
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
            Motion::Tilted { mover, about: (item, point), goal, frame, shift, .. } => {
                let robot = self.actor_of(*mover).ok_or(Refused::NoRobot)?;
                let parts = self.depart(robot, None)?;
                let mut values = values.iter().copied();
                let mut next = || values.next().unwrap_or_default();
                let angle = next();
                let shift = if shift.is_some() { [next(), next(), next()] } else { [0.0; 3] };
                let performed = self.tilt(robot, (*item, point), (*goal, frame), (angle, shift), parts)?;
                let performed = self.slowed(performed);
                Ok(Some(performed.lasting(next())))
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

    /// Distance and angle from the tip to the nearest of some poses.
    fn nearest(&self, robot: InstanceId, to: &[Pose]) -> Option<(f64, f64)> {
        let tip = pose(&self.tip(robot));
        let all = to.iter().map(|t| distance(&tip, &pose(t)));
        all.min_by(|a, b| (a.0 + a.1).total_cmp(&(b.0 + b.1)))
    }
}
