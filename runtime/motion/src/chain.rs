//! A robot compiled for motion: the whole tree, or the chain between two of its links.
//!
//! Every moving joint turns about, or slides along, the third axis of a frame of its own; what is fixed before and
//! after it is multiplied out beforehand.

use matterix_ir::robot::{Joint, JointKind, Robot};
use nalgebra::{Unit, Vector3};

use crate::pose::{Pose, from_third_axis, pose};
use crate::variables::{Drive, Malformed, Variable, drives};

/// A motion along or about a third axis, by `multiplier * variable + offset`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    /// Index among the variables.
    pub variable: usize,
    /// Factor.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
    /// Along the axis rather than about it.
    pub slides: bool,
}

/// A joint of a tree.
#[derive(Clone, Debug)]
pub(crate) struct Knot {
    /// Index of the link it starts from.
    pub parent: usize,
    /// Index of the link it carries.
    pub child: usize,
    /// From the parent to the frame of the motion.
    pub before: Pose,
    /// The motion, and from its frame to the child; `None` where the joint is fixed.
    pub motion: Option<(Move, Pose)>,
}

/// A whole robot: where all its links are, given the positions of all its variables.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) links: usize,
    pub(crate) knots: Vec<Knot>,
    variables: Vec<Variable>,
}

impl Tree {
    /// Compiles a robot. Fails where it is no tree, or a joint cannot move as it says.
    pub fn new(robot: &Robot) -> Result<Self, Malformed> {
        let (drives, variables) = drives(robot)?;
        let carriers = carriers(robot)?;
        let mut reached = vec![false; robot.links.len()];
        let root = carriers.iter().position(Option::is_none).ok_or(Malformed::NoLink(0))?;
        reached[root] = true;
        let mut knots = Vec::with_capacity(robot.joints.len());
        for (joint, drive) in robot.joints.iter().zip(&drives) {
            if !reached[joint.parent as usize] {
                return Err(Malformed::Order(joint.name.clone()));
            }
            reached[joint.child as usize] = true;
            let (before, motion) = match drive {
                None => (pose(&joint.origin), None),
                Some(drive) => {
                    let turn = Pose::from_parts(Default::default(), from_third_axis(&axis(joint)?));
                    (pose(&joint.origin) * turn, Some((motion(joint, drive, &variables), turn.inverse())))
                }
            };
            knots.push(Knot { parent: joint.parent as usize, child: joint.child as usize, before, motion });
        }
        match reached.iter().position(|r| !r) {
            Some(link) => Err(Malformed::Apart(root as u32, link as u32)),
            None => Ok(Self { links: robot.links.len(), knots, variables }),
        }
    }

    /// What can be commanded, in the order of a configuration.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }
}

/// A motion of a chain and what is fixed after it.
#[derive(Clone, Debug)]
pub(crate) struct Stage {
    /// The motion.
    pub motion: Move,
    /// To the frame of the next motion, or to the tip.
    pub after: Pose,
}

/// What is between two links of a robot: where the second one is, seen from the first one.
#[derive(Clone, Debug)]
pub struct Chain {
    pub(crate) lead: Pose,
    pub(crate) stages: Vec<Stage>,
    variables: Vec<Variable>,
}

impl Chain {
    /// The chain from one link to another one, wherever both are in the tree. Its variables are those that move the
    /// second one relative to the first one, in the order of the robot's joints.
    pub fn new(robot: &Robot, base: u32, tip: u32) -> Result<Self, Malformed> {
        let (drives, mut variables) = drives(robot)?;
        let carriers = carriers(robot)?;
        let (up, down) = path(robot, &carriers, base, tip)?;
        let moves = |joint: usize| drives[joint].map(|d| d.joint);
        let used: Vec<u32> = up.iter().chain(&down).filter_map(|&j| moves(j)).collect();
        variables.retain(|v| used.contains(&v.joint));

        let mut chain = Self { lead: Pose::identity(), stages: Vec::new(), variables };
        for &index in &up {
            // Backwards through a joint: its motion undone, then what is fixed before it.
            chain.push(&robot.joints[index], drives[index].as_ref(), true)?;
        }
        for &index in down.iter().rev() {
            chain.push(&robot.joints[index], drives[index].as_ref(), false)?;
        }
        Ok(chain)
    }

    /// The same chain with its end elsewhere, relative to its tip.
    #[must_use]
    pub fn with_tool(mut self, tool: &Pose) -> Self {
        self.append(tool);
        self
    }

    /// The same chain seen from elsewhere: `base` is where its first link is.
    #[must_use]
    pub fn with_base(mut self, base: &Pose) -> Self {
        self.lead = base * self.lead;
        self
    }

    /// What moves the tip, in the order of a configuration.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn push(&mut self, joint: &Joint, drive: Option<&Drive>, backwards: bool) -> Result<(), Malformed> {
        let origin = pose(&joint.origin);
        if !backwards {
            self.append(&origin);
        }
        if let Some(drive) = drive {
            let turn = Pose::from_parts(Default::default(), from_third_axis(&axis(joint)?));
            self.append(&turn);
            let mut motion = motion(joint, drive, &self.variables);
            if backwards {
                motion.multiplier = -motion.multiplier;
                motion.offset = -motion.offset;
            }
            self.stages.push(Stage { motion, after: turn.inverse() });
        }
        if backwards {
            self.append(&origin.inverse());
        }
        Ok(())
    }

    fn append(&mut self, fixed: &Pose) {
        match self.stages.last_mut() {
            Some(stage) => stage.after *= fixed,
            None => self.lead *= fixed,
        }
    }
}

/// The joint that carries each link; fails where a joint names what does not exist or a link is carried twice.
fn carriers(robot: &Robot) -> Result<Vec<Option<usize>>, Malformed> {
    let mut carriers = vec![None; robot.links.len()];
    for (index, joint) in robot.joints.iter().enumerate() {
        let fits = (joint.parent as usize) < robot.links.len();
        match carriers.get_mut(joint.child as usize) {
            Some(carrier) if carrier.is_none() && fits => *carrier = Some(index),
            _ => return Err(Malformed::Dangling(joint.name.clone())),
        }
    }
    Ok(carriers)
}

/// The joints from a link up to the first common ancestor with another one, and those from that one up to it.
fn path(robot: &Robot, carriers: &[Option<usize>], base: u32, tip: u32) -> Result<(Vec<usize>, Vec<usize>), Malformed> {
    let ascent = |link: u32| -> Result<Vec<usize>, Malformed> {
        let mut at = link as usize;
        let mut joints = Vec::new();
        while let Some(joint) = *carriers.get(at).ok_or(Malformed::NoLink(link))? {
            if joints.len() > robot.joints.len() {
                return Err(Malformed::Dangling(robot.joints[joint].name.clone()));
            }
            joints.push(joint);
            at = robot.joints[joint].parent as usize;
        }
        Ok(joints)
    };
    let (mut up, mut down) = (ascent(base)?, ascent(tip)?);
    let root = |joints: &[usize], link: u32| joints.last().map_or(link, |&j| robot.joints[j].parent);
    if root(&up, base) != root(&down, tip) {
        return Err(Malformed::Apart(base, tip));
    }
    while up.last().is_some() && up.last() == down.last() {
        up.pop();
        down.pop();
    }
    Ok((up, down))
}

/// The unit vector a joint moves about or along.
fn axis(joint: &Joint) -> Result<Vector3<f64>, Malformed> {
    let axis = Vector3::from(joint.axis);
    if (axis.norm() - 1.0).abs() < 1e-6 {
        Ok(Unit::new_normalize(axis).into_inner())
    } else {
        Err(Malformed::Axis(joint.name.clone()))
    }
}

fn motion(joint: &Joint, drive: &Drive, variables: &[Variable]) -> Move {
    let variable = variables.iter().position(|v| v.joint == drive.joint).unwrap_or_default();
    let slides = joint.kind == JointKind::Prismatic;
    Move { variable, multiplier: drive.multiplier, offset: drive.offset, slides }
}
