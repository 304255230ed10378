//! Joints within what they can do, speeds that lead to positions, links where the joints put them.

use crate::kinematics;
use crate::trajectory::{Robot, Sample};
use crate::verdict::{Looked, Wrong};
use matterix_ir::robot::{JointKind, JointLimits};

/// Share by which a limit may be passed: rounding of what is recorded.
const ROUNDING: f64 = 1e-6;

/// Recorded links may be this far from where the joints put them, m: of a turn by nearly 180 deg the quaternion that is written keeps
/// half the digits.
const ASTRAY: f64 = 1e-6;

/// Where no acceleration is known, the way between two samples may be off by such a share of it, and so much, rad or m: accelerations change
/// within it.
const UNEVEN: f64 = 0.1;
const LEAST: f64 = 2e-4;

/// Samples nearer in time than this are of one moment, s.
const MOMENT: f64 = 1e-6;

pub(crate) fn judge(robot: &Robot, looked: &mut Looked, wrong: &mut Vec<Wrong>) {
    let mut worst = Worst { robot, wrong: Vec::new() };
    for sample in &robot.samples {
        worst.sample(sample, looked);
        astray(robot, sample, looked, &mut worst);
    }
    for pair in robot.samples.windows(2) {
        if pair[1].time - pair[0].time > MOMENT {
            worst.between(&pair[0], &pair[1], looked);
            advance(robot, &pair[0], &pair[1], looked);
        }
    }
    wrong.append(&mut worst.wrong);
}

fn advance(robot: &Robot, a: &Sample, b: &Sample, looked: &mut Looked) {
    if a.position == b.position {
        return;
    }
    looked.moving += b.time - a.time;
    let tip = robot.machine.tip as usize;
    looked.way += a.links[tip].translation.distance(b.links[tip].translation);
}

fn astray(robot: &Robot, sample: &Sample, looked: &mut Looked, worst: &mut Worst<'_>) {
    let Some(root) = sample.links.first() else { return };
    let own = kinematics::links(&robot.machine.robot, root, &robot.variables, &sample.position);
    for (index, (recorded, own)) in sample.links.iter().zip(&own).enumerate() {
        let (mut by, turned) =
            (recorded.translation.distance(own.translation), recorded.rotation.inverse() * own.rotation);
        // A link that is turned wrongly is wrong by that at a metre from it.
        by = by.max(2.0 * turned.xyz().length());
        looked.astray = looked.astray.max(by);
        if by > ASTRAY {
            let link = format!("{}.{}", robot.name, robot.machine.robot.links[index].name);
            worst.note(Wrong::Astray { link, by, time: sample.time });
        }
    }
}

/// The worst of each kind of thing wrong.
struct Worst<'r> {
    robot: &'r Robot,
    wrong: Vec<Wrong>,
}

impl Worst<'_> {
    fn note(&mut self, new: Wrong) {
        match self.wrong.iter_mut().find(|old| of_one_kind(old, &new)) {
            Some(old) if size(old) >= size(&new) => {}
            Some(old) => *old = new,
            None => self.wrong.push(new),
        }
    }

    fn joints(&self) -> impl Iterator<Item = (usize, String, JointKind, JointLimits)> + use<> {
        let robot = self.robot;
        let each = robot.variables.iter().enumerate().filter_map(|(i, joint)| {
            let joint = &robot.machine.robot.joints[*joint];
            Some((i, format!("{}.{}", robot.name, joint.name), joint.kind, joint.limits?))
        });
        each.collect::<Vec<_>>().into_iter()
    }

    fn beyond(&mut self, joint: &str, what: &'static str, value: f64, limit: f64, time: f64) -> f64 {
        if value.abs() > limit * (1.0 + ROUNDING) + f64::MIN_POSITIVE || value.is_nan() {
            self.note(Wrong::Beyond { joint: joint.to_owned(), what, value, limit, time });
        }
        if limit > 0.0 { value.abs() / limit } else { 0.0 }
    }

    fn sample(&mut self, sample: &Sample, looked: &mut Looked) {
        let time = sample.time;
        for (i, joint, kind, limits) in self.joints() {
            let q = sample.position[i];
            let nearest = q.clamp(limits.lower.min(limits.upper), limits.upper);
            if kind != JointKind::Continuous && (q - nearest).abs() > ROUNDING {
                self.note(Wrong::Beyond { joint: joint.clone(), what: "position", value: q, limit: nearest, time });
            }
            looked.speed = looked.speed.max(self.beyond(&joint, "speed", sample.speed[i], limits.velocity, time));
            if let Some(limit) = limits.acceleration {
                let share = self.beyond(&joint, "acceleration", sample.acceleration[i], limit, time);
                looked.acceleration = Some(looked.acceleration.unwrap_or(0.0).max(share));
            }
        }
    }

    /// Means between two samples cannot be greater than what may be at any time between them.
    fn between(&mut self, a: &Sample, b: &Sample, looked: &mut Looked) {
        let (h, time) = (b.time - a.time, a.time);
        for (i, joint, _, limits) in self.joints() {
            let moved = b.position[i] - a.position[i];
            // Times are recorded in whole nanoseconds.
            let loose = 1.0 + 2e-9 / h;
            looked.speed = looked.speed.max(self.beyond(&joint, "speed", moved / h / loose, limits.velocity, time));
            if limits.acceleration.is_none() {
                self.without_limit(&joint, i, (a, b));
            }
            if let Some(limit) = limits.acceleration {
                self.beyond(&joint, "acceleration", (b.speed[i] - a.speed[i]) / h / loose, limit, time);
                let by = (moved - 0.5 * (a.speed[i] + b.speed[i]) * h).abs();
                if by > limit * h * h / 4.0 * loose * loose + ROUNDING {
                    self.note(Wrong::Jumps { joint: joint.clone(), by, time });
                }
            }
            if let Some(limit) = limits.jerk {
                let jerk = (b.acceleration[i] - a.acceleration[i]) / h / loose;
                let share = self.beyond(&joint, "jerk", jerk, limit, time);
                looked.jerk = Some(looked.jerk.unwrap_or(0.0).max(share));
            }
        }
    }
}

impl Worst<'_> {
    /// Of a joint of which no limit of acceleration is known, as of a lid or a lever, the recorded speeds and accelerations must lead from one
    /// place to the next: evenly changing ones do so exactly.
    fn without_limit(&mut self, joint: &str, i: usize, (a, b): (&Sample, &Sample)) {
        let (h, moved) = (b.time - a.time, b.position[i] - a.position[i]);
        let led = 0.5 * (a.speed[i] + b.speed[i]) * h + (a.acceleration[i] - b.acceleration[i]) * h * h / 12.0;
        let far = moved.abs().max(h * a.speed[i].abs().max(b.speed[i].abs()));
        let by = (moved - led).abs();
        if by > UNEVEN * far + LEAST {
            self.note(Wrong::Jumps { joint: joint.to_owned(), by, time: a.time });
        }
    }
}

fn of_one_kind(a: &Wrong, b: &Wrong) -> bool {
    match (a, b) {
        (Wrong::Beyond { joint: a, what: x, .. }, Wrong::Beyond { joint: b, what: y, .. }) => a == b && x == y,
        (Wrong::Jumps { joint: a, .. }, Wrong::Jumps { joint: b, .. }) => a == b,
        (Wrong::Astray { .. }, Wrong::Astray { .. }) => true,
        _ => false,
    }
}

fn size(wrong: &Wrong) -> f64 {
    match wrong {
        Wrong::Beyond { value, limit, .. } => (value.abs() - limit.abs()).abs(),
        Wrong::Jumps { by, .. } | Wrong::Astray { by, .. } => *by,
        _ => 0.0,
    }
}
