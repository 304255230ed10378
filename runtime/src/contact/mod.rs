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

use matterix_contact::{Id, STEP, World};
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::robot::Inertial;
use matterix_ir::scene::{InstanceId, Scene};
use matterix_motion::placement;

use crate::motion::{Actor, Moment, Performed, Stage};

/// Longest time between two moments that are told, s.
const FRAME: f64 = 0.04;
/// How fast fingers go on closing beyond where the thing is taken to be, m/s.
const CLOSE: f64 = 0.05;
/// How long fingers press, or what was let go stands, before it is looked at, s.
const SETTLE: f64 = 0.2;
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

/// Where a loose thing was at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// s since the run began.
    pub time: f64,
    /// The thing.
    pub thing: InstanceId,
    /// In the lab.
    pub at: Pose,
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
    strays: Vec<Stray>,
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
    grip: build::Gripper,
    fingers: [Id; 2],
    /// Their variables.
    joints: Vec<usize>,
    /// Which way these go when it opens.
    sign: f64,
    /// Where it is closed, and where the fingers are to be, m: more is wider.
    closed: f64,
    to: f64,
    /// Whether they go on closing until something stops them.
    closing: bool,
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
    /// When it was stopped, s since it began.
    stopped: Option<f64>,
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
        self.event.is_some() || self.machines.values().any(|machine| machine.underway.is_some()) || !self.is_at_rest()
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
            hand.closing = grips.is_some() || hand.closing && frees.is_none();
            if frees.is_some() && performed.parts.is_empty() {
                // Nothing was planned for fingers that let go to another hand.
                hand.to += ROOM;
            }
        }
        machine.underway = Some(Underway { begin: now, performed, grips, frees, stopped: None });
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
        let now = self.time();
        let machine = self.machines.get_mut(&robot)?;
        if let Some(underway) = machine.underway.take() {
            let since = underway.stopped.unwrap_or(now - underway.begin);
            underway.performed.bring(&mut machine.actor, since);
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
        let next = self.time() + STEP;
        for machine in self.machines.values_mut() {
            machine.lead(&mut self.world, next);
        }
        self.world.step();
        let frame = (self.time() / FRAME).floor() as u64;
        if frame != self.shown {
            self.shown = frame;
            self.show();
        }
    }

    /// Notes where robots and loose things are now.
    fn show(&mut self) {
        let time = self.time();
        for (robot, machine) in &self.machines {
            if machine.underway.is_some() {
                self.moments.push(self.moment(*robot, machine, time));
            }
        }
        let held: BTreeSet<InstanceId> = self.machines.values().filter_map(|m| m.held.map(|held| held.item)).collect();
        for (id, thing) in &self.loose {
            if !held.contains(id) && !self.world.is_still(thing.body) {
                self.strays.push(Stray { time, thing: *id, at: self.world.pose(thing.body) });
            }
        }
    }

    fn moment(&self, robot: InstanceId, machine: &Machine, time: f64) -> Moment {
        let mut joints = machine.actor.joints.clone();
        if let Some(hand) = &machine.hand {
            let now = self.world.opened(hand.grip) * hand.sign;
            hand.joints.iter().for_each(|i| joints[*i] = now);
        }
        let poses = machine.actor.tree.poses(&joints);
        let links = poses.iter().map(|pose| machine.base.then(placement(pose))).collect();
        let still = vec![0.0; joints.len()];
        let held = machine.held.and_then(|held| Some((held.item, self.world.pose(self.loose.get(&held.item)?.body))));
        let (speeds, accelerations) = (still.clone(), still);
        let mut moment = Moment { time, robot, joints, speeds, accelerations, links, held };
        if let Some(underway) = machine.underway.as_ref().filter(|underway| underway.stopped.is_none()) {
            underway.performed.rush(&mut moment, time - underway.begin);
        }
        if let Some(hand) = &machine.hand {
            for i in &hand.joints {
                (moment.speeds[*i], moment.accelerations[*i]) = (0.0, 0.0);
            }
        }
        moment
    }

    /// What has moved since this was last asked, in order of time.
    pub fn told(&mut self) -> (Vec<Moment>, Vec<Stray>) {
        (std::mem::take(&mut self.moments), std::mem::take(&mut self.strays))
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

impl Machine {
    fn link(&self, link: usize) -> Pose {
        let poses = self.actor.tree.poses(&self.actor.joints);
        self.base.then(poses.get(link).map_or(Pose::IDENTITY, placement))
    }

    /// Leads links and fingers to where they are at a time, s.
    fn lead(&mut self, world: &mut World, time: f64) {
        if let Some(underway) = &self.underway {
            let since = underway.stopped.unwrap_or(time - underway.begin);
            underway.performed.bring(&mut self.actor, since);
            let poses = self.actor.tree.poses(&self.actor.joints);
            for (link, body) in &self.links {
                if let Some(pose) = poses.get(*link) {
                    world.lead(*body, &self.base.then(placement(pose)));
                }
            }
        }
        let Some(hand) = self.hand.as_mut() else { return };
        let mut speed = 0.0;
        let planned = self.underway.as_ref().filter(|underway| underway.stopped.is_none()).and_then(|underway| {
            let first = hand.joints.first()?;
            let since = time - underway.begin;
            let at = underway.performed.at(&[*first], since)?.first().copied()?;
            (since <= underway.performed.duration()).then_some(at * hand.sign)
        });
        match planned {
            Some(at) => {
                speed = (at - hand.to) / STEP;
                hand.to = at;
            }
            None if hand.closing => {
                hand.to = (hand.to - CLOSE * STEP).max(hand.closed);
                speed = -CLOSE;
            }
            None => {}
        }
        world.close(hand.grip, hand.to, speed);
    }
}
