//! Where a robot and what it holds are at one moment: for recordings.

use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;

use super::performed::Performed;
use super::stage::Stage;

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

impl Moment {
    /// The same with the speeds and accelerations of some joints, by index.
    pub(super) fn rushing(mut self, joints: &[(usize, [f64; 2])]) -> Self {
        for (joint, [speed, acceleration]) in joints {
            self.speeds.get_mut(*joint).into_iter().for_each(|v| *v = *speed);
            self.accelerations.get_mut(*joint).into_iter().for_each(|v| *v = *acceleration);
        }
        self
    }
}

impl Stage<'_> {
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
        let steps = (performed.duration() / apart).ceil().max(1.0) as u32;
        let mut out = Vec::new();
        if let Some(led) = &performed.led {
            // Until then it rests.
            stage.undrag(led);
            out.extend(stage.moment(led.item, begin + led.since));
        }
        for step in 0..=steps {
            let since = performed.duration() * f64::from(step) / f64::from(steps);
            if let Some(actor) = stage.actors.get_mut(&robot) {
                performed.bring(actor, since);
            }
            if let Some(led) = performed.led.as_ref().filter(|led| since >= led.since) {
                let rush = stage.dragged_at(led, performed, since);
                let item = stage.dragged(led, robot);
                let moment = stage.moment(item, begin + since);
                out.extend(moment.map(|moment| moment.rushing(&[(led.variable, rush)])));
            }
            if let Some(mut moment) = stage.moment(robot, begin + since) {
                performed.rush(&mut moment, since);
                out.push(moment);
            }
        }
        out
    }
}
