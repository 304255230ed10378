//! What touches what in a lab while robots move: bodies with mass and friction instead of things that are glued to a hand.
//!
//! The stage holds what the plan believes: where things are said to be, and what a grip takes along. Here is what happens: arms go where their planned
//! motions lead them, fingers press with their force, and what is loose moves as contact and gravity have it. A step of the plan succeeds if what
//! it was to bring about has come about; what has not is a failure with the story of the contact. Robots see the lab again after a failure only; until then they go by what they
//! believe.

mod build;
mod fill;
mod judge;
mod story;

use std::collections::{BTreeMap, BTreeSet};

use matterix_contact::{GripId, Id, STEP, Touch, World};
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_ir::scene::{InstanceId, Scene};
use matterix_motion::placement;
use serde::Serialize;

use crate::motion::{Actor, Moment, Performed, Stage};

/// Longest time between two moments that are told, s; while fingers move.
const FRAME: f64 = 0.04;
const FINE: f64 = 0.005;
/// Fingers whose speed changes by more within a step have struck something, m/s.
const STRUCK: f64 = 0.02;
/// No planned motion of fingers is faster than this, m/s.
const FAST: f64 = 1.0;
/// Fingers that are slower than this stand, m/s.
const SLOW: f64 = 1e-3;
/// How far beyond where they are closed fingers are led, m: its motor presses with all its force then, whatever is between them.
const AHEAD: f64 = 0.03;
/// How fast fingers go on closing beyond where the thing is taken to be, m/s.
const CLOSE: f64 = 0.05;
/// How long fingers press, or what was let go stands, before it is looked at, s.
const SETTLE: f64 = 0.2;
/// How fast an arm brakes on its way at most, and at least, as a share of its pace per s.
const BRAKE: [f64; 2] = [5.0, 0.2];
/// What falls is waited for so long at most, s.
const PATIENCE: f64 = 5.0;

/// How strong and how rough things really are, as shares of what is said of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Really {
    /// Of what fingers press with.
    pub grip: f64,
    /// Of all coefficients of friction.
    pub friction: f64,
}

impl Default for Really {
    fn default() -> Self {
        Really { grip: 1.0, friction: 1.0 }
    }
}

/// A loose thing at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// s since the run began.
    pub time: f64,
    /// The thing.
    pub thing: InstanceId,
    /// Where it is in the lab; nothing where a hand has it, which tells that.
    pub at: Option<Pose>,
    /// What touches it.
    pub touches: Vec<Pressed>,
}

/// What touches a thing, and how hard.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pressed {
    /// What touches it, in words.
    pub by: String,
    /// Where, in the lab, m.
    pub point: [f64; 3],
    /// The force across the surface on the thing, N.
    pub press: [f64; 3],
    /// The force along the surface on the thing, N.
    pub rub: [f64; 3],
    /// The coefficient of friction.
    pub friction: f64,
}

/// The bodies of a lab, and what robots do with them. A clone goes on as it does, to the last bit.
#[derive(Clone)]
pub struct Matter<'p> {
    scene: &'p Scene,
    world: World,
    /// What each body of the world is, and which link of it.
    names: Vec<(Option<InstanceId>, Option<String>)>,
    loose: BTreeMap<InstanceId, Loose>,
    machines: BTreeMap<InstanceId, Machine>,
    /// Links of things that the model moves.
    fixtures: BTreeMap<InstanceId, Vec<(usize, Id)>>,
    /// What has gone wrong and not been told.
    event: Option<Event>,
    /// What has not been recorded yet.
    moments: Vec<Moment>,
    sightings: Vec<Sighting>,
    /// Things of which no friction is known.
    unknown: BTreeSet<InstanceId>,
    /// The number of the last moment that was shown.
    shown: u64,
}

/// A thing that forces move.
#[derive(Clone, Copy, Debug)]
struct Loose {
    body: Id,
    empty: Inertial,
    now: Inertial,
    /// Where it last stood still, in the frame of what bears it.
    rests: Pose,
    /// What bears it, as a whole.
    base: Option<InstanceId>,
}

/// A robot.
#[derive(Clone)]
struct Machine {
    base: Pose,
    actor: Actor,
    links: Vec<(usize, Id)>,
    hand: Option<Hand>,
    underway: Option<Underway>,
    held: Option<Hold>,
}

/// Fingers.
#[derive(Clone, Debug)]
struct Hand {
    grip: GripId,
    fingers: [Id; 2],
    /// Their variables.
    joints: Vec<usize>,
    /// Which way these go when it opens.
    sign: f64,
    /// Where it is closed, and where the fingers are to be, m: more is wider.
    closed: f64,
    to: f64,
    open: f64,
    /// Where they go on by themselves until something stops them.
    goes: Option<f64>,
    /// What each presses with, N.
    force: f64,
}

/// A motion that goes on.
#[derive(Clone)]
struct Underway {
    begin: f64,
    performed: Performed,
    /// What it grips, or lets go.
    grips: Option<InstanceId>,
    frees: Option<(InstanceId, Option<InstanceId>)>,
    /// How far it has got on its way, s, how fast it goes on, as a share, and how that changes, per s.
    way: f64,
    pace: f64,
    change: f64,
    /// Whether it brakes.
    brakes: bool,
}

/// A thing between fingers.
#[derive(Clone, Copy, Debug)]
struct Hold {
    item: InstanceId,
    /// Where it was seen from the tip when the fingers had closed on it.
    inner: Pose,
}

/// What has gone wrong.
#[derive(Clone, Debug)]
struct Event {
    at: f64,
    robot: Option<InstanceId>,
    failure: &'static str,
    text: String,
}

/// How a motion stands.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Nothing is wrong with it.
    Well,
    /// What has gone wrong, or was let go, has not come to rest.
    Waits,
    /// A failure's name and what it says.
    Failed(&'static str, String),
}

/// Where a loose thing turned out to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The thing.
    pub thing: InstanceId,
    /// In the lab.
    pub at: Pose,
    /// The robot between whose fingers it is.
    pub held: Option<InstanceId>,
    /// What bears it.
    pub on: Option<InstanceId>,
}

impl Matter<'_> {
    /// s since the run began.
    pub fn time(&self) -> f64 {
        self.world.steps() as f64 * STEP
    }

    /// Things of which no friction is known: they do not slide.
    pub fn unknown(&self) -> impl Iterator<Item = InstanceId> + '_ {
        self.unknown.iter().copied()
    }

    /// Whether anything moves, or is about to.
    pub fn is_awake(&self) -> bool {
        let goes = |hand: &Hand| hand.goes.is_some_and(|goal| goal != hand.to);
        let moves = |machine: &Machine| machine.underway.is_some() || machine.hand.as_ref().is_some_and(goes);
        self.event.is_some() || self.machines.values().any(moves) || !self.is_at_rest()
    }

    /// Fingers that have lost what they held open, as wide as they can.
    fn let_go(&mut self, robot: InstanceId) {
        let Some(machine) = self.machines.get_mut(&robot) else { return };
        machine.held = None;
        if let Some(hand) = machine.hand.as_mut() {
            // From where they are, not from where they were to close to.
            hand.to = self.world.opened(hand.grip).clamp(hand.closed, hand.open);
            hand.goes = Some(hand.open);
            hand.fingers.iter().for_each(|finger| self.world.wake(*finger));
            hand.joints.iter().for_each(|i| machine.actor.joints[*i] = hand.open * hand.sign);
        }
    }

    fn is_at_rest(&self) -> bool {
        self.loose.values().all(|thing| self.world.is_still(thing.body))
    }

    /// How heavy a thing is with what it contains, kg and m3.
    pub fn weigh(&mut self, thing: InstanceId, gross: f64, volume: f64) {
        let vessel = self.scene.get(thing);
        let Some(loose) = self.loose.get_mut(&thing).filter(|_| gross.is_finite()) else { return };
        let now = fill::filled(vessel, &loose.empty, gross - loose.empty.mass, volume);
        if (now.mass - loose.now.mass).abs() > 1e-4 * loose.now.mass {
            loose.now = now;
            self.world.weigh(loose.body, &now);
        }
    }

    /// A motion that was planned begins at a time, s; how much longer than planned it takes at least, s.
    pub fn begin(&mut self, motion: &Motion, robot: InstanceId, performed: Option<&Performed>, now: f64) -> f64 {
        let performed = performed.cloned().unwrap_or_else(|| Performed::new(robot, Vec::new()));
        let Some(machine) = self.machines.get_mut(&robot) else { return 0.0 };
        let grips = match motion {
            Motion::Grip { item, .. } => Some(*item),
            _ => None,
        };
        let frees = match motion {
            Motion::Free { item, on, .. } => Some((*item, *on)),
            _ => None,
        };
        if frees.is_some() {
            machine.held = None;
        }
        if let Some(hand) = machine.hand.as_mut() {
            if grips.is_some() {
                hand.goes = Some(hand.closed - AHEAD);
            } else if frees.is_some() {
                // Nothing is planned for fingers that let go to another hand.
                hand.goes = performed.parts.is_empty().then(|| (hand.to + ROOM).min(hand.open));
            }
        }
        let fingers = machine.hand.iter().flat_map(|hand| hand.fingers);
        let with = [machine.held.map(|held| held.item), grips, frees.map(|(item, _)| item)];
        let items = with.iter().flatten().filter_map(|item| self.loose.get(item).map(|loose| loose.body));
        fingers.chain(items).for_each(|body| self.world.wake(body));
        machine.underway =
            Some(Underway { begin: now, performed, grips, frees, way: 0.0, pace: 1.0, change: 0.0, brakes: false });
        if grips.is_some() || frees.is_some() { SETTLE } else { 0.0 }
    }

    /// A thing has been put somewhere without a motion.
    pub fn put(&mut self, thing: InstanceId, at: Pose, on: Option<InstanceId>) {
        let Some(loose) = self.loose.get_mut(&thing) else { return };
        self.world.put(loose.body, &at);
        loose.base = on;
        self.settle(thing);
    }

    /// A robot stops where it is: where its joints are then.
    pub fn stop(&mut self, robot: InstanceId) -> Option<Vec<f64>> {
        let machine = self.machines.get_mut(&robot)?;
        if let Some(underway) = machine.underway.take() {
            underway.performed.bring(&mut machine.actor, underway.way);
        }
        Some(machine.actor.joints.clone())
    }

    /// Goes on to a time, s. Parts of things are where the stage has them.
    pub fn go_to(&mut self, until: f64, stage: &Stage<'_>) {
        self.follow_fixtures(stage);
        while self.time() + STEP <= until + 1e-9 {
            if !self.is_awake() {
                // Nothing happens: the steps are counted alone.
                let idle = ((until + 1e-9) / STEP).floor() as u64;
                self.world.rest_until(idle);
                break;
            }
            self.step();
            self.look();
        }
    }

    fn follow_fixtures(&mut self, stage: &Stage<'_>) {
        for (id, links) in &self.fixtures {
            let Some(fixture) = stage.fixtures.get(id) else { continue };
            let (base, poses) = (stage.pose(*id), fixture.links());
            for (link, body) in links {
                if let Some(at) = poses.get(*link) {
                    self.world.lead(*body, &base.then(*at));
                }
            }
        }
    }

    fn step(&mut self) {
        let (next, before) = (self.time() + STEP, self.closing());
        for machine in self.machines.values_mut() {
            machine.lead(&mut self.world, next);
        }
        self.world.step();
        self.show_struck(before);
        let moves = |hand: &Hand| self.world.opening(hand.grip).abs() > SLOW;
        let fingers = self.machines.values().filter_map(|machine| machine.hand.as_ref()).any(moves);
        let apart = if fingers { FINE } else { FRAME };
        // On the finer of both, so that one does not stand in for another.
        let frame = (((self.time() / apart).floor() * apart) / FINE).round() as u64;
        if frame != self.shown {
            self.shown = frame;
            self.show();
        }
    }

    /// Robots whose fingers move, as they are now, with how fast these open, m/s.
    fn closing(&self) -> Vec<(Moment, f64)> {
        let time = self.time();
        let hands = self.machines.iter().filter_map(|(robot, machine)| {
            let speed = self.world.opening(machine.hand.as_ref()?.grip);
            (speed.abs() > SLOW).then(|| (self.moment(*robot, machine, time), speed))
        });
        hands.collect()
    }

    /// Notes fingers that something has stopped within the last step, as they were before it and as they are now: between moments that are
    /// farther apart their speed would tell another way than they went.
    fn show_struck(&mut self, before: Vec<(Moment, f64)>) {
        for (moment, speed) in before {
            let robot = moment.robot;
            let Some(machine) = self.machines.get(&robot) else { continue };
            let now = machine.hand.as_ref().map_or(0.0, |hand| self.world.opening(hand.grip));
            if (now - speed).abs() < STRUCK || machine.underway.is_none() {
                continue;
            }
            let after = self.moment(robot, machine, self.time());
            let told = self.moments.iter().rev().find(|told| told.robot == robot).map(|told| told.time);
            self.moments.extend([moment, after].into_iter().filter(|m| told.is_none_or(|told| m.time > told)));
        }
    }

    /// Notes where robots and loose things are now.
    fn show(&mut self) {
        let time = self.time();
        for (robot, machine) in &self.machines {
            let told = self.moments.iter().any(|told| (told.robot, told.time) == (*robot, time));
            if machine.underway.is_some() && !told {
                self.moments.push(self.moment(*robot, machine, time));
            }
        }
        let held: BTreeSet<InstanceId> = self.machines.values().filter_map(|m| m.held.map(|held| held.item)).collect();
        for (id, thing) in &self.loose {
            if !self.world.is_still(thing.body) {
                let at = (!held.contains(id)).then(|| self.world.pose(thing.body));
                let touches = self.pressed(thing.body);
                self.sightings.push(Sighting { time, thing: *id, at, touches });
            }
        }
    }

    fn pressed(&self, body: Id) -> Vec<Pressed> {
        let touches = self.world.touches(body).into_iter();
        touches
            .map(|touch| {
                let Touch { by, point, press, rub, friction, .. } = touch;
                Pressed { by: self.body(by), point, press, rub, friction }
            })
            .collect()
    }

    fn moment(&self, robot: InstanceId, machine: &Machine, time: f64) -> Moment {
        let mut joints = machine.actor.joints.clone();
        if let Some(hand) = &machine.hand {
            // What stops it at its ends gives by some hundredths of a millimetre.
            let now = self.world.opened(hand.grip).clamp(hand.closed, hand.open) * hand.sign;
            hand.joints.iter().for_each(|i| joints[*i] = now);
        }
        let poses = machine.actor.tree.poses(&joints);
        let links = poses.iter().map(|pose| machine.base.then(placement(pose))).collect();
        let still = vec![0.0; joints.len()];
        let held = machine.held.and_then(|held| Some((held.item, self.world.pose(self.loose.get(&held.item)?.body))));
        let (speeds, accelerations) = (still.clone(), still);
        let mut moment = Moment { time, robot, joints, speeds, accelerations, links, held };
        if let Some(underway) = &machine.underway {
            let Underway { way, pace, change, .. } = *underway;
            underway.performed.rush(&mut moment, way);
            for (speed, acceleration) in moment.speeds.iter_mut().zip(&mut moment.accelerations) {
                *acceleration = *acceleration * pace * pace + *speed * change;
                *speed *= pace;
            }
        }
        if let Some(hand) = &machine.hand {
            for i in &hand.joints {
                (moment.speeds[*i], moment.accelerations[*i]) = (self.world.opening(hand.grip) * hand.sign, 0.0);
            }
        }
        moment
    }

    /// What has moved since this was last asked, in order of time.
    pub fn told(&mut self) -> (Vec<Moment>, Vec<Sighting>) {
        (std::mem::take(&mut self.moments), std::mem::take(&mut self.sightings))
    }

    fn tip(&self, machine: &Machine) -> Pose {
        machine.link(machine.actor.assembly.tip as usize)
    }

    /// A thing stands still where it is now.
    fn settle(&mut self, thing: InstanceId) {
        let Some(loose) = self.loose.get(&thing) else { return };
        let (body, base) = (loose.body, loose.base);
        let rests = self.base(base).inverse().then(self.world.pose(body));
        if let Some(loose) = self.loose.get_mut(&thing) {
            loose.rests = rests;
        }
    }

    fn base(&self, base: Option<InstanceId>) -> Pose {
        let loose = base.and_then(|base| self.loose.get(&base));
        loose.map_or(Pose::IDENTITY, |loose| self.world.pose(loose.body))
    }
}

/// How far fingers open that let go to another hand, m.
const ROOM: f64 = 0.008;

impl Underway {
    /// Goes on to a time, s: at its pace, or braking on its way as fast as the joints leave it.
    fn go_on(&mut self, actor: &Actor, time: f64) {
        if !self.brakes {
            self.way = time - self.begin;
            return;
        }
        if self.pace <= 0.0 {
            (self.pace, self.change) = (0.0, 0.0);
            return;
        }
        let still = vec![0.0; actor.joints.len()];
        let mut rates = Moment {
            time,
            robot: self.performed.robot,
            joints: Vec::new(),
            speeds: still.clone(),
            accelerations: still,
            links: Vec::new(),
            held: None,
        };
        self.performed.rush(&mut rates, self.way);
        let mut change = -BRAKE[0];
        for ((speed, acceleration), variable) in
            rates.speeds.iter().zip(&rates.accelerations).zip(actor.tree.variables())
        {
            let Some(limit) = variable.limits.acceleration.filter(|_| *speed != 0.0) else { continue };
            // What is left against the way it goes.
            let own = acceleration * self.pace * self.pace * speed.signum();
            change = change.max(-(BRAKED * limit + own).max(0.0) / speed.abs());
        }
        self.change = change.min(-BRAKE[1]).max(-self.pace / STEP);
        self.way += self.pace * STEP + self.change * STEP * STEP / 2.0;
        self.pace += self.change * STEP;
    }
}

/// What share of its acceleration a joint brakes with at most.
const BRAKED: f64 = 0.95;

impl Machine {
    fn link(&self, link: usize) -> Pose {
        let poses = self.actor.tree.poses(&self.actor.joints);
        self.base.then(poses.get(link).map_or(Pose::IDENTITY, placement))
    }

    /// Leads links and fingers to where they are at a time, s.
    fn lead(&mut self, world: &mut World, time: f64) {
        if let Some(underway) = &mut self.underway {
            underway.go_on(&self.actor, time);
            underway.performed.bring(&mut self.actor, underway.way);
            let poses = self.actor.tree.poses(&self.actor.joints);
            for (link, body) in &self.links {
                if let Some(pose) = poses.get(*link) {
                    world.lead(*body, &self.base.then(placement(pose)));
                }
            }
        }
        let Some(hand) = self.hand.as_mut() else { return };
        let mut speed = 0.0;
        let planned = self.underway.as_ref().filter(|underway| !underway.brakes).and_then(|underway| {
            let first = hand.joints.first()?;
            let since = time - underway.begin;
            let at = underway.performed.at(&[*first], since)?.first().copied()?;
            (since <= underway.performed.duration()).then_some(at * hand.sign)
        });
        match planned {
            Some(at) => {
                // From where they pressed to where they are planned to begin it is no way to go.
                speed = Some((at - hand.to) / STEP).filter(|speed| speed.abs() < FAST).unwrap_or_default();
                hand.to = at;
            }
            None => {
                let way = hand.goes.map_or(0.0, |goal| goal - hand.to);
                if way != 0.0 {
                    hand.to += way.clamp(-CLOSE * STEP, CLOSE * STEP);
                    speed = CLOSE.copysign(way);
                }
            }
        }
        world.close(hand.grip, hand.to, speed);
    }
}
