//! Grippers: two fingers that slide in a hand and press with a force.
//!
//! A gripper's fingers are coupled: they move by the same way towards each other, and its motor presses each of them with at most so much. So the
//! motor moves the mean of their positions, with a force that has a bound, and a stiff spring holds each of them to that mean. Two motors that know nothing
//! of each other, each at its bound, would let what they hold swim between them.

use matterix_ir::pose::Pose;
use matterix_solids::isometry;
use rapier3d_f64::prelude::{
    AngVector, GenericJoint, GenericJointBuilder, ImpulseJointHandle, JointAxesMask, JointAxis, MassProperties,
    MotorModel, Rotation, Vector,
};

use crate::world::{STEP, World};
use crate::{Id, thing};

/// How stiffly the fingers are coupled, N/m, and what brings them to rest without swinging, N s/m.
const COUPLED: (f64, f64) = (1e4, 30.0);
/// How stiffly the motor goes where the fingers are to be, N/m and N s/m.
const DRIVEN: (f64, f64) = (1e4, 60.0);
/// What a motor and its gears add to the mass of each finger along its way, kg: as armatures of small grippers are described for simulators.
const ARMATURE: f64 = 0.1;

/// The share of its greatest speed from which on a motor gives no more than it takes to keep that.
const NEARLY: f64 = 0.5;
/// How far a finger may have turned from where its hand has it before it is set right, rad.
const ASTRAY: f64 = 1e-7;

/// A gripper of a world, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GripId(pub usize);

/// A finger: a body that slides along an axis of its hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finger {
    /// The body; its frame and the frame of its joint are one.
    pub body: Id,
    /// That frame in the hand where the position of the finger is 0.
    pub origin: Pose,
    /// The axis along which it slides, in that frame.
    pub axis: [f64; 3],
    /// Its position now, m.
    pub at: f64,
    /// Its ends, m.
    pub range: [f64; 2],
}

/// A gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// The body that carries the fingers.
    pub hand: Id,
    /// Each with a position that is greater the farther they are open.
    pub fingers: [Finger; 2],
    /// What each presses with at most, N.
    pub force: f64,
    /// How fast they go at most, m/s.
    pub speed: f64,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Joined {
    grip: Grip,
    joints: [ImpulseJointHandle; 2],
    /// Where the fingers are to be, m, and how fast they go there, m/s.
    goal: [f64; 2],
}

impl World {
    /// A gripper whose fingers hold where they are.
    pub fn gripper(&mut self, grip: Grip) -> Option<GripId> {
        let hand = self.handle(grip.hand)?;
        let mut joints = [ImpulseJointHandle::invalid(); 2];
        for (slot, finger) in joints.iter_mut().zip(&grip.fingers) {
            let body = self.handle(finger.body)?;
            *slot = self.joints.insert(hand, body, sliding(finger), true);
            if let Some(body) = self.bodies.get_mut(body) {
                // Both are carried by the rack that couples them.
                body.set_gravity_scale(0.0, false);
                body.recompute_mass_properties_from_colliders(&self.colliders);
                let own = body.mass_properties().local_mprops;
                // It turns with its hand, whatever presses on it: no moments of its own.
                let moved = MassProperties::new(own.local_com, own.mass() + ARMATURE, AngVector::ZERO);
                body.set_additional_mass_properties(moved, false);
                body.recompute_mass_properties_from_colliders(&self.colliders);
            }
        }
        let at = (grip.fingers[0].at + grip.fingers[1].at) / 2.0;
        self.grips.push(Joined { grip, joints, goal: [at, 0.0] });
        Some(GripId(self.grips.len() - 1))
    }

    /// The fingers are to be at a position, m, and pass it at a speed, m/s, as far as their force takes them there.
    pub fn close(&mut self, grip: GripId, to: f64, speed: f64) {
        if let Some(joined) = self.grips.get_mut(grip.0) {
            joined.goal = [to, speed];
        }
    }

    /// Where the fingers are, m: the mean of both.
    pub fn opened(&self, grip: GripId) -> f64 {
        self.grips.get(grip.0).map_or(0.0, |joined| self.both_slid(&joined.grip)[0])
    }

    /// How fast they open, m/s.
    pub fn opening(&self, grip: GripId) -> f64 {
        self.grips.get(grip.0).map_or(0.0, |joined| self.both_slid(&joined.grip)[1])
    }

    /// How hard each finger presses on a body, N.
    pub fn pinch(&self, grip: GripId, on: Id) -> [f64; 2] {
        let Some(joined) = self.grips.get(grip.0) else { return [0.0; 2] };
        let touches = self.touches(on);
        joined
            .grip
            .fingers
            .map(|finger| touches.iter().filter(|t| t.by == finger.body).map(|t| t.pressed()).fold(0.0, |a, b| a + b))
    }

    /// Where the fingers are and how fast they open, m and m/s: the mean of both.
    fn both_slid(&self, grip: &Grip) -> [f64; 2] {
        let [one, other] = grip.fingers.map(|finger| self.slid(grip, &finger));
        [0, 1].map(|k| (one[k] + other[k]) / 2.0)
    }

    /// Where a finger is on its axis and how fast it goes, seen from the hand, m and m/s.
    fn slid(&self, grip: &Grip, finger: &Finger) -> [f64; 2] {
        let origin = self.pose(grip.hand).then(finger.origin);
        let at = thing::dot(origin.inverse().then(self.pose(finger.body)).position, finger.axis);
        let bodies = [grip.hand, finger.body].map(|id| self.handle(id).and_then(|handle| self.bodies.get(handle)));
        let [Some(hand), Some(body)] = bodies else { return [at, 0.0] };
        let axis = *body.rotation() * Vector::from(finger.axis);
        let middle = body.center_of_mass();
        let beside = body.velocity_at_point(middle) - hand.velocity_at_point(middle);
        [at, axis.dot(beside)]
    }

    /// Sets motors and forces for the next step.
    pub(crate) fn press(&mut self) {
        for index in 0..self.grips.len() {
            let Joined { grip, joints, goal: [goal, speed] } = self.grips[index];
            let [at, going] = self.both_slid(&grip);
            let Some(hand) = self.handle(grip.hand).and_then(|handle| self.bodies.get(handle)) else { continue };
            let (turned, then) = (hand.position().rotation, hand.next_position().rotation);
            let spin = (then * turned.inverse()).to_scaled_axis() / STEP;
            for (finger, joint) in grip.fingers.iter().zip(joints) {
                let Some(body) = self.handle(finger.body).and_then(|handle| self.bodies.get_mut(handle)) else {
                    continue;
                };
                if body.is_sleeping() {
                    continue;
                }
                let own = turned * isometry(&finger.origin).rotation;
                if body.rotation().angle_between(own) > ASTRAY {
                    body.set_rotation(own, false);
                }
                body.set_angvel(spin, false);
                let force = DRIVEN.0 * (goal - at) + DRIVEN.1 * (speed - going);
                let force = force.clamp(-grip.force, grip.force);
                // It goes no faster, whatever gives way: near its greatest speed it only presses with what takes it there.
                let brings_to = |speed: f64| (speed - going) * body.mass() / STEP;
                let force = if going > NEARLY * grip.speed {
                    force.min(brings_to(grip.speed))
                } else if going < -NEARLY * grip.speed {
                    force.max(brings_to(-grip.speed))
                } else {
                    force
                };
                let axis = *body.rotation() * Vector::from(finger.axis);
                body.reset_forces(false);
                body.add_force(axis * force, false);
                if let Some(joint) = self.joints.get_mut(joint, false) {
                    joint.data.set_motor(JointAxis::LinX, at + going * STEP, going, COUPLED.0, COUPLED.1);
                }
            }
        }
    }
}

/// A joint along the axis of a finger: x of its own frames.
fn sliding(finger: &Finger) -> GenericJoint {
    let along = Rotation::from_rotation_arc(Vector::X, Vector::from(finger.axis).normalize());
    let mut own = isometry(&Pose::IDENTITY);
    own.rotation = along;
    let mut joint = GenericJointBuilder::new(JointAxesMask::LOCKED_PRISMATIC_AXES)
        .local_frame1(isometry(&finger.origin) * own)
        .local_frame2(own)
        .contacts_enabled(false)
        .build();
    joint.set_motor_model(JointAxis::LinX, MotorModel::ForceBased);
    joint.set_limits(JointAxis::LinX, finger.range);
    joint.set_motor(JointAxis::LinX, finger.at, 0.0, COUPLED.0, COUPLED.1);
    joint
}
