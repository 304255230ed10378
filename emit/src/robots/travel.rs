//! Motions of a performance, joint by joint.

use std::collections::BTreeMap;

use matterix_ir::Program;
use matterix_ir::plan::StepId;
use matterix_ir::scene::InstanceId;
use matterix_runtime::motion::{Moment, Stage};

use crate::performance::Motion;

/// Where joints are at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// s since the motion began.
    pub time: f64,
    /// rad or m, by joint.
    pub positions: Vec<f64>,
    /// rad/s or m/s, by joint.
    pub velocities: Vec<f64>,
    /// rad/s2 or m/s2, by joint.
    pub accelerations: Vec<f64>,
}

/// One motion of a robot, or of a tool that is mounted on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    /// The robot.
    pub robot: InstanceId,
    /// Whose joints these are: the robot or one of its tools.
    pub owner: InstanceId,
    /// The node of the plan.
    pub step: StepId,
    /// When it begins, s.
    pub begins: f64,
    /// Names of the joints in the description of their owner.
    pub joints: Vec<String>,
    /// In order of time; the first one where the owner stood before.
    pub points: Vec<Point>,
}

/// The joints of one owner: their names, and where they are among those of the whole robot.
type Group = (InstanceId, Vec<(String, usize)>);

/// Everything that robots did, in the order in which they began; an owner whose joints stand still does nothing.
pub fn travels(program: &Program, motions: &[Motion]) -> Result<Vec<Travel>, String> {
    let stage = Stage::new(program)?;
    let mut groups: BTreeMap<InstanceId, Vec<Group>> = BTreeMap::new();
    for (id, actor) in &stage.actors {
        let assembly = &actor.assembly;
        let own = groups.entry(*id).or_default();
        for (index, variable) in actor.tree.variables().iter().enumerate() {
            let Some(joint) = assembly.robot.joints.get(variable.joint as usize) else { continue };
            let owner = assembly.owners.get(joint.child as usize).copied().unwrap_or(*id);
            // The joints of a tool are called after its part of the robot, with a dot.
            let part = |n: &str| n.rsplit_once('.').map_or(n, |(_, plain)| plain).to_owned();
            let name = if owner == *id { joint.name.clone() } else { part(&joint.name) };
            match own.iter_mut().find(|(of, _)| *of == owner) {
                Some((_, joints)) => joints.push((name, index)),
                None => own.push((owner, vec![(name, index)])),
            }
        }
    }
    let mut out = Vec::new();
    for motion in motions {
        let (Some(first), Some(last)) = (motion.moments.first(), motion.moments.last()) else { continue };
        if last.time <= first.time {
            continue;
        }
        for (owner, joints) in groups.get(&first.robot).into_iter().flatten() {
            let points: Vec<Point> = motion.moments.iter().map(|m| point(m, joints, first.time)).collect();
            let moves = points.iter().any(|p| p.positions != points[0].positions);
            if moves {
                let joints = joints.iter().map(|(name, _)| name.clone()).collect();
                out.push(Travel {
                    robot: first.robot,
                    owner: *owner,
                    step: motion.step,
                    begins: first.time,
                    joints,
                    points,
                });
            }
        }
    }
    Ok(out)
}

fn point(moment: &Moment, joints: &[(String, usize)], begins: f64) -> Point {
    let of = |values: &[f64]| joints.iter().map(|(_, i)| values.get(*i).copied().unwrap_or_default()).collect();
    Point {
        time: moment.time - begins,
        positions: of(&moment.joints),
        velocities: of(&moment.speeds),
        accelerations: of(&moment.accelerations),
    }
}
