//! What can be moved: the joints that follow no other one, with the limits their followers leave them.

use std::fmt;

use matterix_ir::robot::{JointKind, JointLimits, Robot};

/// Why a robot cannot be moved as described.
#[derive(Clone, Debug, PartialEq)]
pub enum Malformed {
    /// No link has this index.
    NoLink(u32),
    /// The joint with this name names a link or joint that does not exist, or a child with two parents.
    Dangling(String),
    /// The joint with this name comes before the one that carries its parent.
    Order(String),
    /// The joint with this name follows itself, maybe by way of others.
    FollowsItself(String),
    /// The joint with this name moves but has no limits.
    NoLimits(String),
    /// The joint with this name cannot be anywhere: its limits, or its followers', exclude each other.
    Nowhere(String),
    /// The joint with this name has an axis that is not of unit length.
    Axis(String),
    /// Two links of the same robot are not connected.
    Apart(u32, u32),
}

impl fmt::Display for Malformed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLink(index) => write!(f, "link {index} does not exist"),
            Self::Dangling(joint) => write!(f, "joint `{joint}` does not fit into a tree of links"),
            Self::Order(joint) => write!(f, "joint `{joint}` comes before the joint of its parent"),
            Self::FollowsItself(joint) => write!(f, "joint `{joint}` follows itself"),
            Self::NoLimits(joint) => write!(f, "joint `{joint}` moves but has no limits"),
            Self::Nowhere(joint) => {
                write!(f, "the limits of joint `{joint}` and of its followers allow no position")
            }
            Self::Axis(joint) => write!(f, "the axis of joint `{joint}` must have length 1"),
            Self::Apart(a, b) => write!(f, "links {a} and {b} are not connected"),
        }
    }
}

impl std::error::Error for Malformed {}

/// A joint that can be commanded.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Index of the joint in the robot.
    pub joint: u32,
    /// How it moves.
    pub kind: JointKind,
    /// What it can do, with the joints that follow it; rad or m.
    pub limits: JointLimits,
}

impl Variable {
    /// Whether it has two ends.
    pub fn is_bounded(&self) -> bool {
        self.limits.lower > f64::MIN && self.limits.upper < f64::MAX
    }
}

/// The configuration in the middle of all limits; 0 where there are none.
pub fn middle(variables: &[Variable]) -> Vec<f64> {
    let between = |v: &Variable| if v.is_bounded() { 0.5 * (v.limits.lower + v.limits.upper) } else { 0.0 };
    variables.iter().map(between).collect()
}

/// How a moving joint takes its position from a variable: `multiplier * variable + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drive {
    /// Index of the joint that is commanded.
    pub joint: u32,
    /// Factor.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

/// What drives each joint (`None` for fixed ones), and the commanded joints in their order.
pub(crate) fn drives(robot: &Robot) -> Result<(Vec<Option<Drive>>, Vec<Variable>), Malformed> {
    let mut drives = Vec::with_capacity(robot.joints.len());
    for (index, joint) in robot.joints.iter().enumerate() {
        if joint.kind == JointKind::Fixed {
            drives.push(None);
            continue;
        }
        let mut drive = Drive { joint: index as u32, multiplier: 1.0, offset: 0.0 };
        let mut hops = 0;
        while let Some(mimic) = robot.joints[drive.joint as usize].mimic {
            let known = robot.joints.get(mimic.joint as usize).is_some_and(|j| j.kind != JointKind::Fixed);
            if !known {
                return Err(Malformed::Dangling(joint.name.clone()));
            }
            hops += 1;
            if hops > robot.joints.len() {
                return Err(Malformed::FollowsItself(joint.name.clone()));
            }
            drive.offset += drive.multiplier * mimic.offset;
            drive.multiplier *= mimic.multiplier;
            drive.joint = mimic.joint;
        }
        drives.push(Some(drive));
    }
    let mut variables = Vec::new();
    for (index, joint) in robot.joints.iter().enumerate() {
        if joint.kind == JointKind::Fixed || joint.mimic.is_some() {
            continue;
        }
        let mut limits = joint.limits.ok_or_else(|| Malformed::NoLimits(joint.name.clone()))?;
        for (other, drive) in robot.joints.iter().zip(&drives) {
            let (Some(drive), Some(theirs)) = (drive, &other.limits) else { continue };
            if drive.joint as usize == index && other.mimic.is_some() && drive.multiplier != 0.0 {
                tighten(&mut limits, theirs, drive);
            }
        }
        if limits.lower > limits.upper || limits.lower.is_nan() || limits.upper.is_nan() {
            return Err(Malformed::Nowhere(joint.name.clone()));
        }
        variables.push(Variable { joint: index as u32, kind: joint.kind, limits });
    }
    Ok((drives, variables))
}

/// What a follower leaves of the limits of the one it follows.
fn tighten(limits: &mut JointLimits, theirs: &JointLimits, drive: &Drive) {
    let (a, b) = ((theirs.lower - drive.offset) / drive.multiplier, (theirs.upper - drive.offset) / drive.multiplier);
    limits.lower = limits.lower.max(a.min(b));
    limits.upper = limits.upper.min(a.max(b));
    let scale = drive.multiplier.abs();
    limits.velocity = limits.velocity.min(theirs.velocity / scale);
    let least = |mine: Option<f64>, other: Option<f64>| match (mine, other.map(|o| o / scale)) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
    limits.acceleration = least(limits.acceleration, theirs.acceleration);
    limits.jerk = least(limits.jerk, theirs.jerk);
}
