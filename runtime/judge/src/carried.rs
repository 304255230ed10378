//! What robots carry: whether the grip on it bears the motion, and what runs over the rim of an open vessel as it tilts or is moved too quickly.
//!
//! The level stands across the pull that is felt, of gravity and of the vessel's own motion, as the first wave in a round vessel follows that
//! (a pendulum of its frequency), and what is above the rim's lowest point then is lost. What a wave throws over a rim that is above the
//! mouth of another vessel falls into that; how far a vessel is tilted must go with what is left in it there too.

use matterix_ir::math::{atan2, exp};
use matterix_ir::scene::Shape;
use matterix_ir::tilting::kept;
use matterix_solids::{Isometry, pose};

use crate::trajectory::{Robot, Thing, Trajectory};
use crate::verdict::Wrong;

/// m/s2
const GRAVITY: f64 = 9.806_65;
/// First zero of the derivative of the Bessel function of order 1.
const BESSEL: f64 = 1.841_183_781_340_659;
/// Share of critical damping.
const DAMPING: f64 = 0.01;
/// Steps in time, s, and how long a wave is followed when the robot stands, s.
const STEP: f64 = 2e-3;
const AFTER: f64 = 0.6;
/// Accelerations are those over so long, s, and count from so many times what a grip bears.
const GIVES: f64 = 1e-2;
const NOMINAL: f64 = 1.02;
/// What runs over counts from this share of what fills the vessel on: dimensions are nominal.
const SLACK: f64 = 5e-3;

/// What is in a vessel in hand.
struct Filled<'f> {
    inside: &'f [[f64; 2]],
    full: f64,
    /// Frequency of its first wave, 1/s, and how high its surface is above its base, m.
    wave: f64,
    surface: f64,
}

/// Follows what a robot holds.
pub(crate) fn judge(film: &Trajectory, index: usize, wrong: &mut Vec<Wrong>) {
    let robot = &film.robots[index];
    for (place, grip) in robot.grips.iter().enumerate() {
        let until = robot.grips.get(place + 1).map_or(f64::INFINITY, |next| next.time);
        let moves = spans(robot, grip.time, until);
        let worst = |found: &mut dyn Iterator<Item = (Wrong, f64)>| found.max_by(|a, b| a.1.total_cmp(&b.1));
        // What goes along may run over as what is gripped does.
        for carried in &grip.items {
            let moving = moves.iter().filter_map(|span| film.spilled(robot, *carried, *span));
            let filled = film.overfilled(robot, *carried, [grip.time, until]);
            wrong.extend(worst(&mut moving.chain(filled)).map(|(wrong, _)| wrong));
        }
        let Some(gripped) = grip.items.first() else { continue };
        let slipped = worst(&mut moves.iter().filter_map(|span| film.slipped(robot, *gripped, *span)));
        wrong.extend(slipped.map(|(wrong, _)| wrong));
    }
}

/// When a robot moves between two times, motions that follow each other as one.
fn spans(robot: &Robot, from: f64, to: f64) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    for pair in robot.samples.windows(2).filter(|p| p[0].time >= from && p[1].time <= to) {
        if pair[0].position == pair[1].position && pair[0].links.first() == pair[1].links.first() {
            continue;
        }
        match out.last_mut().filter(|last| pair[0].time - last[1] < AFTER) {
            Some(last) => last[1] = pair[1].time,
            None => out.push([pair[0].time, pair[1].time]),
        }
    }
    out
}

impl Trajectory {
    /// Where a thing in hand is pulled the most beyond what the grip on it bears, with by how much that is.
    fn slipped(&self, robot: &Robot, (item, inner): (usize, Isometry), [from, to]: [f64; 2]) -> Option<(Wrong, f64)> {
        let thing = &self.things[item];
        let middle = thing.middle();
        let place = |time: f64| {
            let tip = *robot.links(time).get(robot.machine.tip as usize)?;
            Some(pose(&(tip * inner)).point(middle))
        };
        // Before, the hand was empty.
        let from = from + GIVES;
        let steps = ((to - from) / STEP).ceil().max(0.0) as u32;
        let mut worst: Option<(Wrong, f64)> = None;
        for step in 0..=steps {
            let time = from + f64::from(step) * STEP;
            let borne = thing.borne(time);
            if borne.is_infinite() {
                continue;
            }
            // Over as long as fingers give way: what is recorded is a cubic from sample to sample.
            let [a, b, c] = [place(time - GIVES)?, place(time)?, place(time + GIVES)?];
            let [x, y, z] = [0, 1, 2].map(|k| (c[k] - 2.0 * b[k] + a[k]) / (GIVES * GIVES));
            let pull = (x * x + y * y + (z + GRAVITY) * (z + GRAVITY)).sqrt();
            if pull > borne * NOMINAL && worst.as_ref().is_none_or(|(_, most)| pull / borne > *most) {
                worst = Some((Wrong::Slips { item: thing.name.clone(), pull, borne, time }, pull / borne));
            }
        }
        worst
    }

    /// The most that runs over while a thing in hand is moved from one time to another, with what share of the vessel that is.
    fn spilled(&self, robot: &Robot, (item, inner): (usize, Isometry), [from, to]: [f64; 2]) -> Option<(Wrong, f64)> {
        let thing = &self.things[item];
        let place = |time: f64| robot.links(time).get(robot.machine.tip as usize).map(|tip| *tip * inner);
        let (mut pull, mut rate) = ([0.0; 2], [0.0; 2]);
        let mut worst: Option<(Wrong, f64)> = None;
        let mut known: Option<(f64, Filled<'_>)> = None;
        let steps = ((to + AFTER - from) / STEP).ceil() as u32;
        for step in 0..=steps {
            let time = from + f64::from(step) * STEP;
            let volume = thing.loose(time)?;
            if known.as_ref().is_none_or(|(v, _)| *v != volume) {
                known = Filled::of(thing.shape.as_ref()?, volume).map(|filled| (volume, filled));
            }
            let (_, filled) = known.as_ref()?;
            let [before, here, after] = [place(time - STEP)?, place(time)?, place(time + STEP)?];
            let point = |at: &Isometry| pose(at).point([0.0, 0.0, filled.surface]);
            let [a, b, c] = [point(&before), point(&here), point(&after)];
            let felt = [0, 1, 2].map(|k| (c[k] - 2.0 * b[k] + a[k]) / (STEP * STEP));
            for k in 0..2 {
                let back = filled.wave * filled.wave * (felt[k] - pull[k]) - 2.0 * DAMPING * filled.wave * rate[k];
                rate[k] += STEP * back;
                pull[k] += STEP * rate[k];
            }
            let (foot, head) = (pose(&here).position, pose(&here).point([0.0, 0.0, 1.0]));
            let tilt = angle([0, 1, 2].map(|k| head[k] - foot[k]), [pull[0], pull[1], GRAVITY + felt[2]]);
            let axis = [0, 1, 2].map(|k| head[k] - foot[k]);
            let own = angle(axis, [0.0, 0.0, 1.0]);
            let runs = [(own, false), (tilt, true)].into_iter().find_map(|(tilt, waves)| {
                let lost = volume - kept(filled.inside, tilt);
                let counts = lost > SLACK * filled.full && !(waves && self.is_over_a_mouth(item, &here, axis, time));
                counts.then_some((lost, tilt))
            });
            let Some((lost, tilt)) = runs else { continue };
            if worst.as_ref().is_none_or(|(_, most)| lost / filled.full > *most) {
                let item = thing.name.clone();
                worst = Some((Wrong::Spills { item, volume: lost, tilt, time }, lost / filled.full));
            }
        }
        worst
    }
}

impl Trajectory {
    /// The most that runs over of a thing in hand where what is in it is said to change, with what share of the vessel that is: however it got
    /// there, a vessel keeps no more than its tilt lets it.
    fn overfilled(
        &self,
        robot: &Robot,
        (item, inner): (usize, Isometry),
        [from, to]: [f64; 2],
    ) -> Option<(Wrong, f64)> {
        let thing = &self.things[item];
        let Some(Shape::Turned { inside, .. }) = &thing.shape else { return None };
        let full = kept(inside, 0.0);
        let at = |(time, volume): (f64, f64)| {
            let tip = *robot.links(time).get(robot.machine.tip as usize)?;
            let placed = pose(&(tip * inner));
            let head = placed.point([0.0, 0.0, 1.0]);
            let tilt = angle([0, 1, 2].map(|k| head[k] - placed.position[k]), [0.0, 0.0, 1.0]);
            let lost = volume - kept(inside, tilt);
            let wrong = Wrong::Spills { item: thing.name.clone(), volume: lost, tilt, time };
            (lost > SLACK * full).then_some((wrong, lost / full))
        };
        let said = thing.volumes().filter(|(time, _)| (from..to).contains(time));
        said.filter_map(at).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether the lowest point of a vessel's rim is above the mouth of another vessel.
    fn is_over_a_mouth(&self, item: usize, at: &Isometry, axis: [f64; 3], time: f64) -> bool {
        let rim = |thing: &Thing| match &thing.shape {
            Some(Shape::Turned { inside, .. }) => inside.last().copied(),
            _ => None,
        };
        let Some([r, top]) = rim(&self.things[item]) else { return false };
        let middle = pose(at).point([0.0, 0.0, top]);
        // Down along the rim: the part of down that is square to the axis.
        let down = [axis[0] * axis[2], axis[1] * axis[2], axis[2] * axis[2] - 1.0];
        let size = down.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-12);
        let lip = [0, 1, 2].map(|k| middle[k] + r * down[k] / size);
        self.things.iter().enumerate().filter(|(other, _)| *other != item).any(|(_, other)| {
            let (Some([mouth, top]), Some(at)) = (rim(other), other.at(time)) else { return false };
            let [x, y, z] = pose(&at).point([0.0, 0.0, top]);
            (lip[0] - x).hypot(lip[1] - y) < mouth && lip[2] > z
        })
    }
}

impl<'f> Filled<'f> {
    /// Nothing where the inside is not known, or nothing is in it.
    fn of(shape: &'f Shape, volume: f64) -> Option<Self> {
        let Shape::Turned { inside, .. } = shape else { return None };
        let (&[_, floor], &[rim, top]) = (inside.first()?, inside.last()?);
        let full = kept(inside, 0.0);
        if volume <= 0.0 || full <= 0.0 {
            return None;
        }
        // What a vessel cut off at a height holds grows with the height.
        let cut = |z: f64| {
            let below = inside.iter().copied().filter(|p| p[1] < z);
            let mut shape: Vec<[f64; 2]> = below.collect();
            shape.push([radius(inside, z).unwrap_or(rim), z]);
            kept(&shape, 0.0)
        };
        let (mut low, mut high) = (floor, top);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if cut(middle) < volume { low = middle } else { high = middle }
        }
        let r = radius(inside, high).unwrap_or(rim).max(1e-4);
        let fast = exp(-2.0 * BESSEL * (high - floor) / r);
        let wave = (BESSEL * GRAVITY / r * (1.0 - fast) / (1.0 + fast)).sqrt();
        Some(Filled { inside, full, wave, surface: high })
    }
}

/// How wide an outline is at a height, m.
fn radius(outline: &[[f64; 2]], z: f64) -> Option<f64> {
    let pair = outline.windows(2).find(|p| p[0][1] <= z && z <= p[1][1] && p[0][1] < p[1][1])?;
    let ([r, low], [s, high]) = (pair[0], pair[1]);
    Some(r + (s - r) * (z - low) / (high - low))
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    atan2(cross.iter().map(|v| v * v).sum::<f64>().sqrt(), dot)
}
