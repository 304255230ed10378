//! What robots carry in open vessels stays in them: a motion that would throw it over the rim goes as much slower.
//!
//! A liquid stands across the pull that it feels, of gravity and of the motion, and follows that as its first wave does: one that goes to and
//! fro at `w`, `w^2 = 1.841 g/r tanh(1.841 h/r)` for a round vessel of radius `r` filled `h` high (Lamb, Hydrodynamics, art. 191; Ibrahim,
//! Liquid Sloshing Dynamics, 2005, eq. 1.36), hardly damped. What is then above the level of the rim's lowest point is lost. A plane that tilts
//! as that wave does reaches a fifth higher at the wall than the wave, which is to the safe side.

use std::f64::consts::PI;

use matterix_ir::math::{acos, exp, sin_cos};
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Shape};
use matterix_ir::tilting::table;

use super::performed::Performed;
use super::refused::Refused;
use super::stage::Stage;

/// Standard gravity, m/s2.
const GRAVITY: f64 = 9.806_65;
/// The first zero of the derivative of Bessel's function J1, by which the first wave in a round vessel goes.
const FIRST_WAVE: f64 = 1.841_183_781_340_659;
/// Damping of the first wave as a share of the critical one: of water in a smooth beaker of some centimetres about 1 % (Ibrahim 2005, section 3.2).
const DAMPING: f64 = 0.01;
/// How far apart in time a motion is looked at, s.
const APART: f64 = 0.005;
/// How often the wave is looked at in one of its periods after a motion has ended.
const AFTER: u32 = 24;
/// By how much more than it is the wave that a motion leaves could be without loss.
const ROOM: f64 = 2.0;
/// The wave counts for so much more than it is: what is known of a vessel and a motion is off by some percent.
const MARGIN: f64 = 1.1;
/// No wave is steeper than this, rad: beyond it waves break, and the law of small ones says nothing.
const STEEP: f64 = PI / 6.0;
/// What may stand above the rim without running out, as a share of what fills the vessel: the error of the table.
const SLACK: f64 = 1e-3;
/// A motion is made so many times as long at most.
const SLOWEST: f64 = 30.0;
/// How finely it is found how many times.
const FINE: f64 = 0.01;
/// A motion waits for a wave to die out in such steps, and so long at most, s.
const WAIT: f64 = 0.25;
const LONGEST: f64 = 60.0;

/// A vessel with what is in it.
struct Filled {
    /// Tilt and what stays at that, rad and m3.
    tilts: Vec<[f64; 2]>,
    /// What is in it, m3.
    volume: f64,
    /// The frequency of its first wave, 1/s.
    frequency: f64,
    /// How high its surface is above its base, m.
    surface: f64,
}

impl Filled {
    /// Nothing where its inside is not known.
    fn of(shape: &Shape, volume: f64) -> Option<Self> {
        let Shape::Turned { inside, .. } = shape else { return None };
        let (surface, radius) = level(inside, volume)?;
        let depth = surface - inside.first()?[1];
        let steep = 2.0 * FIRST_WAVE * depth / radius;
        let tanh = 1.0 - 2.0 / (exp(steep.min(700.0)) + 1.0);
        let frequency = (FIRST_WAVE * GRAVITY / radius * tanh).sqrt();
        Some(Filled { tilts: table(inside), volume, frequency, surface })
    }

    /// How much runs out at a tilt, m3.
    fn lost(&self, tilt: f64) -> f64 {
        let full = self.tilts.first().map_or(0.0, |p| p[1]);
        let above = self.tilts.partition_point(|p| p[0] <= tilt);
        let stays = match (self.tilts.get(above.wrapping_sub(1)), self.tilts.get(above)) {
            (Some([a, v]), Some([b, w])) => v + (w - v) * (tilt - a) / (b - a),
            (Some([_, v]), None) => *v,
            _ => full,
        };
        (self.volume - stays - SLACK * full).max(0.0)
    }
}

impl Filled {
    /// A motion as much slower, or as much later, as it must be, with the wave at its end.
    fn calm(&self, ride: &Ride, wave: Wave, mut performed: Performed) -> (Performed, Wave) {
        let is_wild = |pace: (f64, f64)| {
            let swing = ride.tilt(pace, wave, self.frequency);
            swing.steep > STEEP || self.lost(swing.across) > 0.0
        };
        // What is left of a wave from before dies out by itself only.
        let mut wait = 0.0;
        while wait < LONGEST && is_wild((SLOWEST, wait)) {
            wait += WAIT;
        }
        let mut times = 1.0;
        if is_wild((times, wait)) {
            let mut wild = times;
            times = SLOWEST;
            while times - wild > FINE * wild {
                let middle = 0.5 * (wild + times);
                if is_wild((middle, wait)) { wild = middle } else { times = middle }
            }
        }
        if times > 1.0 {
            performed = performed.slowed(times);
        }
        if let Some(first) = performed.parts.first_mut() {
            first.wait += wait;
        }
        (performed, ride.tilt((times, wait), wave, self.frequency).wave)
    }
}

/// How high a volume stands in a vessel, and how wide it is there: m. Nothing where none is in it.
fn level(inside: &[[f64; 2]], volume: f64) -> Option<(f64, f64)> {
    if volume <= 0.0 {
        return None;
    }
    let mut left = volume;
    for pair in inside.windows(2) {
        let ([r, z], [s, top]) = (pair[0], pair[1]);
        // A frustum up to a share of its height.
        let up_to = |share: f64| {
            let at = r + (s - r) * share;
            PI * (top - z) * share * (r * r + r * at + at * at) / 3.0
        };
        if up_to(1.0) >= left {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if up_to(middle) < left { low = middle } else { high = middle }
            }
            let at = r + (s - r) * high;
            return (at > 0.0).then_some((z + (top - z) * high, at));
        }
        left -= up_to(1.0);
    }
    let [radius, top] = *inside.last()?;
    Some((top, radius))
}

/// How a vessel is moved: the way of the middle of the liquid's surface and the vessel's axis, evenly in time.
struct Ride {
    apart: f64,
    way: Vec<[f64; 3]>,
    axes: Vec<[f64; 3]>,
}

/// The wave in a vessel: the pull, m/s2 along x and y of the lab, across which the level stands, and how that changes, m/s3.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wave {
    pull: [f64; 2],
    rate: [f64; 2],
}

/// What becomes of a liquid's surface while its vessel is moved.
#[derive(Clone, Copy, Debug, Default)]
struct Swing {
    /// How far it is from straight across the vessel at most, and from level, rad.
    across: f64,
    steep: f64,
    /// The wave at the end.
    wave: Wave,
}

impl Wave {
    /// Follows the pull that is felt for a time, s; exact where that stays as it is.
    fn follow(&mut self, felt: [f64; 2], frequency: f64, dt: f64) {
        let swings = frequency * (1.0 - DAMPING * DAMPING).sqrt();
        let (sin, cos) = sin_cos(swings * dt);
        let fades = exp(-DAMPING * frequency * dt);
        for k in 0..2 {
            let off = self.pull[k] - felt[k];
            let slope = (self.rate[k] + DAMPING * frequency * off) / swings;
            let (now, turned) = (off * cos + slope * sin, slope * cos - off * sin);
            self.pull[k] = felt[k] + fades * now;
            self.rate[k] = fades * (swings * turned - DAMPING * frequency * now);
        }
    }
}

impl Ride {
    /// What becomes of the liquid's surface where the motion begins after a wait, s, with a wave, and takes so many times as long.
    fn tilt(&self, (times, wait): (f64, f64), mut wave: Wave, frequency: f64) -> Swing {
        let dt = self.apart * times;
        let mut most = Swing::default();
        let mut look = |axis: [f64; 3], pull: [f64; 2], by: f64, lift: f64| {
            let [x, y] = pull.map(|pull| pull * by);
            let up = [x, y, GRAVITY + lift];
            most.across = most.across.max(between(axis, up));
            most.steep = most.steep.max(between([0.0, 0.0, 1.0], up));
        };
        let last = self.way.len().saturating_sub(1);
        let at = |i: usize| self.way[i.min(last)];
        wave.follow([0.0; 2], frequency, wait);
        for (index, axis) in self.axes.iter().enumerate() {
            let (before, here, after) = (at(index.saturating_sub(1)), at(index), at(index + 1));
            let felt = [0, 1, 2].map(|k| (after[k] - 2.0 * here[k] + before[k]) / (dt * dt));
            wave.follow([felt[0], felt[1]], frequency, dt);
            look(*axis, wave.pull, MARGIN, felt[2]);
        }
        // The wave goes on when the vessel stands, and meets another motion then: that finds half of the room.
        let step = 2.0 * PI / frequency / f64::from(AFTER);
        let mut left = wave;
        for axis in self.axes.last().into_iter().cycle().take(AFTER as usize) {
            left.follow([0.0; 2], frequency, step);
            look(*axis, left.pull, ROOM, 0.0);
        }
        Swing { wave, ..most }
    }

    /// Whether the vessel is tilted less at the end than at the beginning.
    fn is_set_upright(&self) -> bool {
        let height = |axis: Option<&[f64; 3]>| axis.map_or(0.0, |axis| axis[2]);
        height(self.axes.last()) > height(self.axes.first()) + 1e-9
    }

    /// The greatest tilt of the vessel itself, rad.
    fn own_tilt(&self) -> f64 {
        self.axes.iter().map(|axis| between(*axis, [0.0, 0.0, 1.0])).fold(0.0, f64::max)
    }
}

/// The angle between two directions, rad.
fn between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { acos((dot(a, b) / size).clamp(-1.0, 1.0)) } else { 0.0 }
}

impl Stage<'_> {
    /// The volume of what a thing in hand holds that is free to run out is so much now, m3; of others it is not known.
    pub fn holds_loose(&mut self, volumes: impl IntoIterator<Item = (InstanceId, f64)>) {
        self.loose = volumes.into_iter().collect();
    }

    /// A motion that has been planned and not begun yet, as slow as what the robot holds needs so that nothing runs over; refused where
    /// that does not help, as it is tilted too far. What pours, or is set upright again where it has poured, goes as it is.
    pub(super) fn calmed(
        &mut self,
        before: &Stage<'_>,
        motion: &Motion,
        performed: Performed,
    ) -> Result<Performed, Refused> {
        let Some(held) = before.held(performed.robot).filter(|held| self.held(performed.robot) == Some(*held)) else {
            return Ok(performed);
        };
        let (Some(volume), Some(shape)) = (self.loose.get(&held), &self.scene.get(held).shape) else {
            return Ok(performed);
        };
        let Some(filled) = Filled::of(shape, *volume) else { return Ok(performed) };
        let ride = before.ride(&performed, held, filled.surface);
        let (mut wave, since) = before.waves.get(&held).copied().unwrap_or_default();
        wave.follow([0.0; 2], filled.frequency, (before.now - since).max(0.0));
        let pours = matches!(motion, Motion::Tilted { within: Some(_), .. });
        let rights = matches!(motion, Motion::Tilted { .. }) && ride.is_set_upright();
        let (performed, wave) = match pours || rights {
            true => (performed, ride.tilt((1.0, 0.0), wave, filled.frequency).wave),
            false => {
                let lost = filled.lost(ride.own_tilt());
                if lost > 0.0 {
                    return Err(Refused::Spills(held, lost));
                }
                filled.calm(&ride, wave, performed)
            }
        };
        self.waves.insert(held, (wave, before.now + performed.duration()));
        Ok(performed)
    }

    /// How a thing in hand is moved on a way that begins as things stand now.
    fn ride(&self, performed: &Performed, held: InstanceId, surface: f64) -> Ride {
        let mut stage = self.clone();
        let duration = performed.duration();
        let steps = (duration / APART).ceil().max(1.0) as u32;
        let (mut way, mut axes) = (Vec::new(), Vec::new());
        for step in 0..=steps {
            let since = duration * f64::from(step) / f64::from(steps);
            if let Some(actor) = stage.actors.get_mut(&performed.robot) {
                performed.bring(actor, since);
            }
            let at: Pose = stage.pose(held);
            way.push(at.point([0.0, 0.0, surface]));
            axes.push([0, 1, 2].map(|k| at.point([0.0, 0.0, 1.0])[k] - at.position[k]));
        }
        Ride { apart: duration / f64::from(steps), way, axes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beaker() -> Shape {
        let (outside, inside) = (vec![], vec![[0.0, 0.002], [0.0332, 0.002], [0.0332, 0.095]]);
        Shape::Turned { outside, inside }
    }

    #[test]
    fn water_in_a_beaker_goes_to_and_fro_as_is_known() {
        // 200 mL stand 57.8 mm high: sqrt(1.8412 * 9.80665 / 0.0332) = 23.32 1/s, times sqrt(tanh(3.20)) = 0.9983.
        let filled = Filled::of(&beaker(), 200e-6).expect("water");
        assert!((filled.surface - 0.0598).abs() < 1e-4, "{}", filled.surface);
        assert!((filled.frequency - 23.28).abs() < 0.02, "{}", filled.frequency);
        assert_eq!(level(&[[0.0, 0.0], [0.03, 0.0], [0.03, 0.1]], 0.0), None);
    }

    #[test]
    fn a_push_that_lasts_tilts_the_surface_by_its_share_of_gravity_and_overshoots_once() {
        let mut wave = Wave::default();
        let mut most: f64 = 0.0;
        for _ in 0..40_000 {
            wave.follow([2.0, 0.0], 23.0, 1e-3);
            most = most.max(wave.pull[0]);
        }
        let pull = wave.pull;
        // The first swing of an oscillator with 1 % of damping goes 1 + exp(-pi zeta) as far.
        assert!((most / 2.0 - (1.0 + exp(-PI * DAMPING))).abs() < 1e-3, "{most}");
        assert!((pull[0] - 2.0).abs() < 0.05 && pull[1] == 0.0);
    }

    #[test]
    fn what_is_pushed_slowly_tilts_as_in_a_lift_and_what_is_pushed_at_once_twice_as_far() {
        // 0.2 m in a straight line, at 1 m/s2 first one way and then the other.
        let line = |apart: f64| {
            let half = 0.2_f64.sqrt();
            let at = |t: f64| if t < half { 0.5 * t * t } else { 0.2 - 0.5 * (2.0 * half - t).max(0.0).powi(2) };
            let steps = (2.0 * half / apart) as usize;
            let way: Vec<[f64; 3]> = (0..=steps).map(|i| [at(i as f64 * apart), 0.0, 0.0]).collect();
            Ride { apart, axes: vec![[0.0, 0.0, 1.0]; way.len()], way }
        };
        let pull = |times: f64, frequency: f64| {
            let ride = line(APART);
            ride.tilt((times, 0.0), Wave::default(), frequency).across.tan() * GRAVITY
        };
        // A wave much quicker than the motion swings twice as far as each push, and after a push that turns about three times; what is
        // left of it at the end counts twice.
        let quick = pull(1.0, 60.0);
        assert!((1.9..=8.1).contains(&quick), "{quick}");
        let slow = pull(10.0, 23.0);
        assert!(slow < 0.09, "{slow}");
    }

    #[test]
    fn what_stays_below_the_rim_is_not_lost() {
        let filled = Filled::of(&beaker(), 200e-6).expect("water");
        // 200 of 322 mL: the surface reaches the lip at arctan(35.2 / 33.2) = 46.7 deg.
        assert_eq!(filled.lost(46.0_f64.to_radians()), 0.0);
        assert!(filled.lost(49.0_f64.to_radians()) > 5e-6);
    }
}
