//! How fast what robots hold can be moved: a motion that would throw contents over a rim, or pull a thing out of the fingers, goes as
//! much slower.

use std::f64::consts::PI;

use matterix_ir::NodeId;
use matterix_ir::math::acos;
use matterix_ir::model::Load;
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;

use super::flight::Flight;
use super::performed::Performed;
use super::refused::Refused;
use super::slosh::{Filled, GRAVITY, Wave};
use super::stage::Stage;
use super::tilt::tilt_of;

/// How far apart in time a motion is looked at, s.
const APART: f64 = 0.005;
/// How often a wave is looked at in one of its periods after a motion has ended.
const AFTER: u32 = 24;
/// By how much more than it is the wave that a motion leaves could be without loss.
const ROOM: f64 = 2.0;
/// Waves and pulls count for so much more than they are: what is known of a thing and a motion is off by some percent.
const MARGIN: f64 = 1.1;
/// No wave is steeper than this, rad: beyond it waves break, and the law of small ones says nothing.
const STEEP: f64 = PI / 6.0;
/// A vessel that has poured and is set upright by so much, or by half, pours no more, rad.
const RIGHTED: f64 = 0.15;
/// What is carried upright tilts by no more than this share of what its contents allow.
const STEADY: f64 = 0.9;
/// A motion is made so many times as long at most.
const SLOWEST: f64 = 30.0;
/// How finely it is found how many times.
const FINE: f64 = 0.01;
/// A motion waits for a wave to die out in such steps, and so long at most, s.
const WAIT: f64 = 0.25;
const LONGEST: f64 = 60.0;

/// What is known of a thing in hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Burden {
    /// The volume of its contents that is free to run out, m3.
    pub loose: Option<f64>,
    /// The acceleration, of gravity and of the motion, that the grip on it bears, m/s2.
    pub borne: Option<f64>,
}

impl Burden {
    /// That of a thing, with the values of expressions as far as they are known.
    pub fn of(load: &Load, value: impl Fn(Option<NodeId>) -> Option<f64>) -> Self {
        let borne = value(load.taxed).filter(|taxed| *taxed > 0.0).map(f64::recip);
        Burden { loose: value(load.loose), borne }
    }

    /// Whether it differs from another one by no more than a share.
    pub fn is_near(&self, other: &Burden, share: f64) -> bool {
        let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => a == b || (a - b).abs() <= share * a.abs().max(b.abs()),
            (a, b) => a == b,
        };
        near(self.loose, other.loose) && near(self.borne, other.borne)
    }
}

/// How a thing is moved, evenly in time: the way of a point of it, its axis, and the way of its centre of mass.
struct Ride {
    apart: f64,
    way: Vec<[f64; 3]>,
    axes: Vec<[f64; 3]>,
    middles: Vec<[f64; 3]>,
    /// So many places at the beginning are left out of account: what runs out there runs into what was poured into.
    over: usize,
}

/// What becomes of a thing while it is moved.
#[derive(Clone, Copy, Debug, Default)]
struct Swing {
    /// How far the level of its contents is from straight across it at most, and from level, rad.
    across: f64,
    steep: f64,
    /// The wave in it at the end.
    wave: Wave,
}

/// So many times as long in time, and so much later, s.
type Pace = (f64, f64);

impl Ride {
    /// What becomes of a liquid's surface where the motion begins with a wave.
    fn swing(&self, (times, wait): Pace, mut wave: Wave, frequency: f64) -> Swing {
        let dt = self.apart * times;
        let mut most = Swing::default();
        let mut look = |axis: [f64; 3], pull: [f64; 2], by: f64, lift: f64| {
            let [x, y] = pull.map(|pull| pull * by);
            let up = [x, y, GRAVITY + lift];
            most.across = most.across.max(between(axis, up));
            most.steep = most.steep.max(between([0.0, 0.0, 1.0], up));
        };
        wave.follow([0.0; 2], frequency, wait);
        for (index, axis) in self.axes.iter().enumerate() {
            let felt = felt(&self.way, index, dt);
            wave.follow([felt[0], felt[1]], frequency, dt);
            if index >= self.over {
                look(*axis, wave.pull, MARGIN, felt[2]);
            }
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

    /// How far the level is from straight across at most, up to a time since the beginning, s, and no earlier than a swing before that; rad.
    fn across(&self, time: f64, mut wave: Wave, frequency: f64) -> f64 {
        let swing = 2.0 * PI / frequency;
        let mut most: f64 = 0.0;
        for (index, axis) in self.axes.iter().enumerate() {
            let now = self.apart * index as f64;
            if now > time {
                break;
            }
            let felt = felt(&self.way, index, self.apart);
            wave.follow([felt[0], felt[1]], frequency, self.apart);
            if now + swing >= time {
                let [x, y] = wave.pull;
                most = most.max(between(*axis, [x, y, GRAVITY + felt[2]]));
            }
        }
        most
    }

    /// The greatest acceleration of the centre of mass with that of gravity, m/s2.
    fn pull(&self, times: f64) -> f64 {
        let dt = self.apart * times;
        let felt = (0..self.middles.len()).map(|index| felt(&self.middles, index, dt));
        felt.map(|[x, y, z]| (x * x + y * y + (z + GRAVITY) * (z + GRAVITY)).sqrt()).fold(GRAVITY, f64::max)
    }

    /// Whether the thing is tilted less at the end than at the beginning.
    fn is_set_upright(&self) -> bool {
        let height = |axis: Option<&[f64; 3]>| axis.map_or(0.0, |axis| axis[2]);
        height(self.axes.last()) > height(self.axes.first()) + 1e-9
    }

    /// Leaves out of account what runs out before the thing is upright enough to pour no more.
    fn leave_out_pouring(&mut self) {
        let first = self.tilts().next().unwrap_or_default();
        self.over = self.tilts().take_while(|tilt| *tilt > (first - RIGHTED).max(0.5 * first)).count();
    }

    /// Whether a vessel that runs over where it is, as has been said then, is tilted no further.
    fn rights(&self, filled: &Filled) -> bool {
        let first = self.tilts().next().unwrap_or_default();
        filled.lost(first) > 0.0 && self.own_tilt() < first + 1e-6
    }

    /// Leaves out of account what runs out before the vessel keeps what is in it, with room for a wave.
    fn leave_out_running_over(&mut self, filled: &Filled) {
        self.over = self.tilts().take_while(|tilt| filled.lost(tilt + RIGHTED) > 0.0).count();
    }

    /// The greatest tilt of the thing itself, rad.
    fn own_tilt(&self) -> f64 {
        self.tilts().fold(0.0, f64::max)
    }

    /// How far the thing itself is tilted, place by place, rad.
    fn tilts(&self) -> impl Iterator<Item = f64> {
        self.axes.iter().map(|axis| between(*axis, [0.0, 0.0, 1.0]))
    }
}

/// The acceleration at a place of a way; it rests before and after, and on a way that takes no time.
fn felt(way: &[[f64; 3]], index: usize, dt: f64) -> [f64; 3] {
    if dt <= 0.0 {
        return [0.0; 3];
    }
    let at = |i: usize| way[i.min(way.len() - 1)];
    let (before, here, after) = (at(index.saturating_sub(1)), at(index), at(index + 1));
    [0, 1, 2].map(|k| (after[k] - 2.0 * here[k] + before[k]) / (dt * dt))
}

/// The angle between two directions, rad.
fn between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { acos((dot(a, b) / size).clamp(-1.0, 1.0)) } else { 0.0 }
}

/// The least number of times as long, from `least` on, at which nothing is wild any more.
fn times(least: f64, is_wild: impl Fn(f64) -> bool) -> f64 {
    if !is_wild(least) {
        return least;
    }
    let (mut wild, mut calm) = (least, SLOWEST.max(least));
    while calm - wild > FINE * wild {
        let middle = 0.5 * (wild + calm);
        if is_wild(middle) { wild = middle } else { calm = middle }
    }
    calm
}

impl Stage<'_> {
    /// What is known now of the things in hand.
    pub fn burden(&mut self, burdens: impl IntoIterator<Item = (InstanceId, Burden)>) {
        self.burdens = burdens.into_iter().collect();
    }

    /// How far a thing that a robot carries is tilted at a time that is not before now, s: rad.
    pub fn tilt_at(&self, id: InstanceId, time: f64) -> f64 {
        match self.flight_with(id, time) {
            Some((flight, robot)) => {
                let mut stage = self.clone();
                if let Some(actor) = stage.actors.get_mut(&robot) {
                    flight.performed.bring(actor, time - flight.begin);
                }
                tilt_of(stage.pose(id))
            }
            None => tilt_of(self.pose(id)),
        }
    }

    /// How much of a volume runs over the rim of a vessel that a robot carries, at a time that is not before now, s: as it is tilted then, and
    /// where the robot is under way by the wave that this makes. m3
    pub fn runs_over(&self, vessel: InstanceId, volume: f64, time: f64) -> f64 {
        let Some(filled) = self.filled(vessel, volume) else { return 0.0 };
        let Some((flight, _)) = self.flight_with(vessel, time) else { return filled.lost(tilt_of(self.pose(vessel))) };
        // The motion is as slow as what was in it needs.
        let known = self.burdens.get(&vessel).and_then(|burden| burden.loose).unwrap_or(0.0);
        if volume <= known {
            return 0.0;
        }
        let ride = self.ride(&flight.performed, vessel, filled.surface);
        let wave = self.began.get(&vessel).copied().unwrap_or_default();
        filled.lost(ride.across(time - flight.begin, wave, filled.frequency))
    }

    /// How the robot is under way that carries a thing.
    fn flight_with(&self, id: InstanceId, time: f64) -> Option<(&Flight, InstanceId)> {
        let robot = self.held_by(id)?;
        let flight = self.flights.get(&robot).filter(|flight| flight.end() > time)?;
        Some((flight, robot))
    }

    /// A motion that has been planned and not begun yet, as slow as what the robot holds, and what stands on that, needs; refused where that
    /// does not help. Of what pours, or is set upright again where it has poured, contents may run out.
    pub(super) fn calmed(
        &mut self,
        before: &Stage<'_>,
        motion: &Motion,
        performed: Performed,
    ) -> Result<Performed, Refused> {
        let Some(held) = before.held(performed.robot).filter(|held| self.held(performed.robot) == Some(*held)) else {
            return Ok(performed);
        };
        let slow = match self.burdens.get(&held).and_then(|burden| burden.borne) {
            Some(borne) if borne < GRAVITY => return Err(Refused::Slips(held, borne)),
            Some(borne) => {
                let ride = before.ride(&performed, held, 0.0);
                times(1.0, |times| (ride.pull(times) - GRAVITY) * MARGIN + GRAVITY > borne)
            }
            None => 1.0,
        };
        let vessels = self.vessels(before, &performed);
        if let Motion::Tilted { within: Some(_), about: (source, _), .. } = motion {
            // It is brought there first; what runs out then does not run into the target.
            return self.poured(before, performed, *source, vessels, slow);
        }
        let mut cargo = Vec::new();
        for (vessel, filled, wave) in vessels {
            let mut ride = before.ride(&performed, vessel, filled.surface);
            match motion {
                Motion::Tilted { about: (source, _), .. } if *source == vessel && ride.is_set_upright() => {
                    ride.leave_out_pouring();
                }
                _ if ride.rights(&filled) => ride.leave_out_running_over(&filled),
                _ => filled.keeps_in(vessel, &ride)?,
            }
            cargo.push(Cargo { vessel, filled, wave, ride });
        }
        let pace = calm(&cargo, slow);
        let since = before.now + performed.duration() * pace.0 + pace.1;
        self.rocked(&cargo, pace, since);
        Ok(performed.paced(pace))
    }

    /// The vessels that a robot carries, the one in its hand first, with what is free to run out of each and the wave in it as a motion begins.
    fn vessels(&self, before: &Stage<'_>, performed: &Performed) -> Vec<(InstanceId, Filled, Wave)> {
        let robot = performed.robot;
        let filled = |(vessel, burden): (&InstanceId, &Burden)| {
            let filled = self.filled(*vessel, burden.loose?).filter(|_| before.held_by(*vessel) == Some(robot))?;
            let (mut wave, since) = before.waves.get(vessel).copied().unwrap_or_default();
            wave.follow([0.0; 2], filled.frequency, (before.now - since).max(0.0));
            Some((*vessel, filled, wave))
        };
        let mut out: Vec<_> = self.burdens.iter().filter_map(filled).collect();
        out.sort_by_key(|(vessel, ..)| before.held(robot) != Some(*vessel));
        out
    }

    /// How far what a robot carries may tilt before it runs over, with a tenth to spare, rad.
    pub(super) fn steady(&self, robot: InstanceId) -> f64 {
        let carried = self.burdens.iter().filter(|(id, _)| self.held_by(**id) == Some(robot));
        let filled = carried.filter_map(|(id, burden)| self.filled(*id, burden.loose?));
        filled.map(|filled| STEADY * filled.brink()).fold(f64::INFINITY, f64::min)
    }

    /// A vessel with so much in it, m3, as far as its inside is known.
    pub(super) fn filled(&self, vessel: InstanceId, volume: f64) -> Option<Filled> {
        let shape = self.scene.get(vessel).shape.as_ref()?;
        Filled::of(shape, volume, |inside| self.tilts.of(vessel, inside))
    }

    /// A motion whose last part pours from a vessel, with the parts before it as slow as their contents need.
    fn poured(
        &mut self,
        before: &Stage<'_>,
        mut performed: Performed,
        source: InstanceId,
        vessels: Vec<(InstanceId, Filled, Wave)>,
        slow: f64,
    ) -> Result<Performed, Refused> {
        for (vessel, filled, _) in vessels.iter().filter(|(vessel, ..)| *vessel != source) {
            filled.keeps_in(*vessel, &before.ride(&performed, *vessel, filled.surface))?;
        }
        let last = performed.parts.pop();
        if performed.parts.is_empty() {
            self.waves.extend(vessels.into_iter().map(|(vessel, _, wave)| (vessel, (wave, before.now))));
            performed.parts.extend(last);
            return Ok(performed);
        }
        let cargo = |(vessel, filled, wave): (InstanceId, Filled, Wave)| {
            let ride = before.ride(&performed, vessel, filled.surface);
            Cargo { vessel, filled, wave, ride }
        };
        let cargo: Vec<Cargo> = vessels.into_iter().map(cargo).collect();
        let pace = calm(&cargo, slow);
        performed = performed.paced(pace);
        self.rocked(&cargo, pace, before.now + performed.duration());
        performed.parts.extend(last);
        Ok(performed)
    }

    /// Notes the waves that a motion leaves behind.
    fn rocked(&mut self, cargo: &[Cargo], pace: Pace, since: f64) {
        let left = cargo.iter().map(|c| (c.vessel, (c.ride.swing(pace, c.wave, c.filled.frequency).wave, since)));
        self.waves.extend(left);
        self.began.extend(cargo.iter().map(|c| (c.vessel, c.wave)));
    }

    /// How a thing in hand is moved on a way that begins as things stand now.
    fn ride(&self, performed: &Performed, held: InstanceId, surface: f64) -> Ride {
        let thing = self.scene.get(held);
        let middle = match &thing.inertial {
            Some(inertial) => inertial.placement.position,
            None => [0.0, 0.0, thing.shape.as_ref().map_or(0.0, |shape| 0.5 * shape.size()[2])],
        };
        let (apart, places) = self.along(performed, |stage| stage.pose(held));
        let axis = |at: &Pose| [0, 1, 2].map(|k| at.point([0.0, 0.0, 1.0])[k] - at.position[k]);
        Ride {
            apart,
            way: places.iter().map(|at| at.point([0.0, 0.0, surface])).collect(),
            axes: places.iter().map(axis).collect(),
            middles: places.iter().map(|at| at.point(middle)).collect(),
            over: 0,
        }
    }

    /// What is so at moments of a motion that are evenly apart, from its beginning to its end, and how far apart they are, s.
    pub(super) fn along<T>(&self, performed: &Performed, look: impl Fn(&Stage<'_>) -> T) -> (f64, Vec<T>) {
        let (mut stage, duration) = (self.clone(), performed.duration());
        let steps = (duration / APART).ceil().max(1.0) as u32;
        let at = |step: u32| {
            if let Some(actor) = stage.actors.get_mut(&performed.robot) {
                performed.bring(actor, duration * f64::from(step) / f64::from(steps));
            }
            look(&stage)
        };
        (duration / f64::from(steps), (0..=steps).map(at).collect())
    }
}

/// A vessel that is carried: what is in it, the wave there as the motion begins, and the motion.
struct Cargo {
    vessel: InstanceId,
    filled: Filled,
    wave: Wave,
    ride: Ride,
}

impl Cargo {
    /// Whether something runs over on a motion of such a pace.
    fn is_wild(&self, pace: Pace) -> bool {
        let swing = self.ride.swing(pace, self.wave, self.filled.frequency);
        swing.steep > STEEP || self.filled.lost(swing.across) > 0.0
    }
}

impl Filled {
    /// Refuses a ride that is tilted so far that some of it runs over however slow that is.
    fn keeps_in(&self, vessel: InstanceId, ride: &Ride) -> Result<(), Refused> {
        match self.lost(ride.own_tilt()) {
            lost if lost > 0.0 => Err(Refused::Spills(vessel, lost)),
            _ => Ok(()),
        }
    }
}

/// How much slower, and later, a motion goes that is at least so many times as long.
fn calm(cargo: &[Cargo], least: f64) -> Pace {
    let is_wild = |pace: Pace| cargo.iter().any(|cargo| cargo.is_wild(pace));
    // What is left of a wave from before dies out by itself only.
    let mut wait = 0.0;
    while wait < LONGEST && is_wild((SLOWEST.max(least), wait)) {
        wait += WAIT;
    }
    (times(least, |times| is_wild((times, wait))), wait)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_pushed_slowly_tilts_as_in_a_lift_and_what_is_pushed_at_once_twice_as_far() {
        // 0.2 m in a straight line, at 1 m/s2 first one way and then the other.
        let line = |apart: f64| {
            let half = 0.2_f64.sqrt();
            let at = |t: f64| if t < half { 0.5 * t * t } else { 0.2 - 0.5 * (2.0 * half - t).max(0.0).powi(2) };
            let steps = (2.0 * half / apart) as usize;
            let way: Vec<[f64; 3]> = (0..=steps).map(|i| [at(i as f64 * apart), 0.0, 0.0]).collect();
            Ride { apart, axes: vec![[0.0, 0.0, 1.0]; way.len()], middles: Vec::new(), way, over: 0 }
        };
        let pull = |times: f64, frequency: f64| {
            let ride = line(APART);
            ride.swing((times, 0.0), Wave::default(), frequency).across.tan() * GRAVITY
        };
        // A wave much quicker than the motion swings twice as far as each push, and after a push that turns about three times; what is
        // left of it at the end counts twice.
        let quick = pull(1.0, 60.0);
        assert!((1.9..=8.1).contains(&quick), "{quick}");
        let slow = pull(10.0, 23.0);
        assert!(slow < 0.09, "{slow}");
    }

    #[test]
    fn a_ride_pulls_as_much_as_it_is_sped_up() {
        // Up at 2 m/s2: 11.8 m/s2 with gravity; four times as slowly an eighth of a metre per second squared of its own.
        let way: Vec<[f64; 3]> = (0..200).map(|i| [0.0, 0.0, (f64::from(i) * APART).powi(2)]).collect();
        let ride =
            Ride { apart: APART, axes: vec![[0.0, 0.0, 1.0]; way.len()], middles: way[..150].to_vec(), way, over: 0 };
        assert!((ride.pull(1.0) - GRAVITY - 2.0).abs() < 1e-6 || ride.pull(1.0) > GRAVITY + 2.0);
        assert_eq!(times(1.0, |times| times < 3.0).round(), 3.0);
        assert_eq!(times(1.0, |_| false), 1.0);
    }
}
