//! Where everything is in the course of a run: its robots and things, brought from moment to moment as they were recorded.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand, frame};

use crate::contact::Sighting;
use crate::motion::{Carried, Moment, Stage, supported};
use crate::record::run::Run;

/// Moments of one motion are no further apart, s.
const APART: f64 = 0.1;
/// How near a thing must be let go to where it was taken from to stand there again, m.
const THERE: f64 = 2e-3;

/// A lab as it was at the time that has been reached.
pub(super) struct Replay<'p> {
    /// Where everything is.
    pub(super) stage: Stage<'p>,
    /// What the states of things say that they stand on; by thing, the state and its value.
    supports: Vec<(InstanceId, usize, f64)>,
    /// What the states of carriers name, and by what it is carried.
    loads: Vec<(InstanceId, usize, Option<InstanceId>)>,
    /// Changes of those that wait until their robot is there: when, which, and what is carried then.
    coming: Vec<(f64, usize, Option<InstanceId>)>,
    /// Robots whose loads have changed and not been told.
    untold: BTreeSet<InstanceId>,
    /// Where things stood that carriers took.
    taken: BTreeMap<InstanceId, Carried>,
    /// What carriers dropped.
    dropped: BTreeSet<InstanceId>,
    /// What robots have let go and no state yet says where it stands.
    freed: BTreeSet<InstanceId>,
    /// Whether robots move in this run.
    moves: bool,
    /// How often something has changed hands.
    pub(super) changes: u64,
    /// What goes along with whom, by the mover; made anew when something changes hands.
    riders: BTreeMap<InstanceId, Vec<InstanceId>>,
}

impl<'p> Replay<'p> {
    /// A lab when the run begins. Robots whose description cannot be moved are none here; who moves them says why.
    pub(super) fn new(run: &Run<'p>) -> Self {
        let program = run.program;
        let stage = Stage::new(program).unwrap_or_else(|_| Stage::still(&program.scene));
        let on = |id: InstanceId| program.scene.instances.get(id.0 as usize).and_then(|i| i.support);
        let supports = program.model.states.iter().enumerate().filter_map(|(index, state)| {
            let id = supported(&program.scene, &state.name, &state.domain)?;
            Some((id, index, on(id).map_or(-1.0, |below| f64::from(below.0))))
        });
        Replay {
            supports: supports.collect(),
            loads: program.scene.carriers.iter().map(|c| (c.by, c.state as usize, None)).collect(),
            coming: Vec::new(),
            untold: BTreeSet::new(),
            taken: BTreeMap::new(),
            dropped: BTreeSet::new(),
            freed: BTreeSet::new(),
            moves: !run.recording.moments.is_empty(),
            changes: 0,
            riders: BTreeMap::new(),
            stage,
        }
    }

    /// Joints and what is in hand are as a moment has them from now on.
    pub(super) fn moment(&mut self, moment: &Moment) {
        self.joined(moment);
        self.arrive(moment.time);
    }

    fn joined(&mut self, moment: &Moment) {
        if let Some(actor) = self.stage.actors.get_mut(&moment.robot) {
            actor.joints.clone_from(&moment.joints);
        } else if let Some(fixture) = self.stage.fixtures.get_mut(&moment.robot) {
            fixture.joints.clone_from(&moment.joints);
            return;
        }
        let before = self.stage.held(moment.robot);
        if let Some((id, at)) = moment.held {
            let inner = self.stage.tip(moment.robot).inverse().then(at);
            self.freed.remove(&id);
            self.set(id, Carried::Held(moment.robot, inner));
        }
        if let Some(id) = before.filter(|id| Some(*id) != moment.held.map(|(now, _)| now)) {
            // Another robot may have it by now.
            if self.stage.holder(id) == Some(moment.robot) {
                let at = self.stage.pose(id);
                self.set(id, Carried::Stands(Stand::Lab(at)));
                self.freed.insert(id);
            }
        }
    }

    /// A loose thing is somewhere else from now on; what it is, with all that goes along.
    pub(super) fn sighted(&mut self, sighting: &Sighting) -> Vec<(InstanceId, Pose)> {
        let (id, Some(at)) = (sighting.thing, sighting.at) else { return Vec::new() };
        let on = self.stage.stand_of(id);
        self.stage.lies(id, at, on);
        self.freed.insert(id);
        let mut going = vec![id];
        let all = (0..self.stage.scene.instances.len() as u32).map(InstanceId);
        going.extend(all.filter(|other| *other != id && self.stage.carriers(*other).contains(&id)));
        going.into_iter().map(|id| (id, self.stage.pose(id))).collect()
    }

    /// The states that say where things are.
    pub(super) fn states(&self) -> impl Iterator<Item = usize> {
        self.supports.iter().map(|s| s.1).chain(self.loads.iter().map(|l| l.1))
    }

    /// Things stand where the states say at a time; whether anything changed its place.
    pub(super) fn sample(&mut self, run: &Run<'_>, time: f64) -> bool {
        let value = |state: usize| run.recording.states.get(state).map(|s| s.held(time)).filter(|v| !v.is_nan());
        let mut moved = false;
        for index in 0..self.supports.len() {
            let (id, state, current) = self.supports[index];
            let Some(now) = value(state).filter(|now| *now != current) else { continue };
            self.supports[index].2 = now;
            moved = true;
            let by = (now >= 0.0).then_some(InstanceId(now as u32));
            match self.freed.remove(&id) {
                // It stays where it was let go, and goes along with what it stands on.
                true => self.stage.carry(id, by),
                false => self.stage.follow(id, by),
            }
        }
        moved |= self.arrive(time);
        for index in 0..self.loads.len() {
            let (by, state, _) = self.loads[index];
            let now = value(state).filter(|now| *now >= 0.0).map(|now| InstanceId(now as u32));
            let last = self.coming.iter().rev().find(|c| c.1 == index).map_or(self.loads[index].2, |c| c.2);
            if now != last {
                // Who takes a thing, or leaves it, goes there first.
                let there = self.robot_of(by).map_or(time, |robot| arrival(run, robot, time));
                self.coming.push((there, index, now));
            }
        }
        moved |= self.arrive(time);
        if moved {
            self.changed_hands();
        }
        moved
    }

    /// Carriers that have got there take things, and leave them; whether any did.
    fn arrive(&mut self, time: f64) -> bool {
        let (due, rest): (Vec<_>, Vec<_>) = self.coming.drain(..).partition(|(there, ..)| *there <= time);
        self.coming = rest;
        for &(_, index, now) in &due {
            let (by, _, before) = self.loads[index];
            self.loads[index].2 = now;
            if let Some(id) = before {
                self.let_go(id);
            }
            if let Some(id) = now {
                self.take(id, by);
            }
            self.untold.extend(self.robot_of(by));
        }
        !due.is_empty()
    }

    /// Robots whose loads have changed, each with all that it takes along.
    pub(super) fn loads(&mut self) -> Vec<(InstanceId, Vec<InstanceId>)> {
        let loads = |robot: InstanceId| {
            let own = self.loads.iter().filter(|(by, ..)| self.robot_of(*by) == Some(robot));
            (robot, own.filter_map(|(.., load)| *load).collect())
        };
        let told = self.untold.iter().map(|robot| loads(*robot)).collect();
        self.untold.clear();
        told
    }

    /// The robot that a carrier is part of, or that holds what it is part of.
    fn robot_of(&self, carrier: InstanceId) -> Option<InstanceId> {
        self.stage.actor_of(carrier).or_else(|| self.stage.held_by(carrier))
    }

    /// A carrier takes a thing along.
    fn take(&mut self, id: InstanceId, by: InstanceId) {
        let Some(instance) = self.stage.scene.instances.get(id.0 as usize) else { return };
        let mount = instance.frames.iter().find(|f| f.name == frame::MOUNT).map(|f| f.pose).unwrap_or_default();
        if let Some(stood) = self.stage.carried.get(id.0 as usize).copied() {
            self.taken.insert(id, stood);
        }
        self.dropped.remove(&id);
        self.set(id, Carried::Stands(Stand::PartOf(by, mount.inverse())));
    }

    /// A carrier lets a thing go: it falls from there, or is back in its place where that is there, or where nothing moved.
    fn let_go(&mut self, id: InstanceId) {
        let at = self.stage.pose(id);
        if let Some(stood) = self.taken.remove(&id) {
            self.set(id, stood);
        }
        let home = self.stage.pose(id).position;
        let far = (0..3).map(|k| (home[k] - at.position[k]).powi(2)).sum::<f64>().sqrt();
        if self.moves && far > THERE {
            self.set(id, Carried::Stands(Stand::Lab(at)));
            // What lies there already makes way: nobody knows how a heap of tips lies.
            let lies = self.stage.fallen(id, &self.dropped);
            self.set(id, Carried::Stands(Stand::Lab(lies)));
            self.dropped.insert(id);
        }
    }

    fn set(&mut self, id: InstanceId, carried: Carried) {
        let Some(before) = self.stage.carried.get(id.0 as usize).copied() else { return };
        let same = match (before, carried) {
            (Carried::Held(a, _), Carried::Held(b, _)) => a == b,
            (a, b) => a == b,
        };
        self.stage.carried.set(id, carried);
        if !same {
            self.changed_hands();
        }
    }

    fn changed_hands(&mut self) {
        self.changes += 1;
        self.riders.clear();
    }

    /// What goes along with a robot or a thing with joints and is seen, with where it is now; its own links left out.
    pub(super) fn along(&mut self, mover: InstanceId) -> Vec<(InstanceId, Pose)> {
        let stage = &self.stage;
        let riders = self.riders.entry(mover).or_insert_with(|| {
            let all = (0..stage.scene.instances.len() as u32).map(InstanceId);
            all.filter(|id| *id != mover && rides(stage, *id, mover)).collect()
        });
        riders.iter().map(|id| (*id, stage.pose(*id))).collect()
    }
}

/// When the motion of a robot ends that begins at a time, s; that time where none does.
fn arrival(run: &Run<'_>, robot: InstanceId, time: f64) -> f64 {
    let moments = &run.recording.moments;
    let first = moments.partition_point(|m| m.time < time - 1e-9);
    let mut end = time;
    for moment in moments.iter().skip(first).filter(|m| m.robot == robot) {
        if moment.time - end > APART {
            break;
        }
        end = moment.time;
    }
    end
}

/// Whether an instance that is seen goes where a link or the hand of a mover goes.
fn rides(stage: &Stage<'_>, id: InstanceId, mover: InstanceId) -> bool {
    let scene = stage.scene;
    if scene.get(id).seen().next().is_none() {
        return false;
    }
    let mut next = id;
    for _ in 0..=scene.instances.len() {
        let place = |below: InstanceId| scene.get(below).frames.iter().find(|f| f.name == frame::PLACE);
        match stage.carried.get(next.0 as usize) {
            Some(Carried::Held(by, _)) => return *by == mover,
            Some(Carried::Stands(stand)) => {
                let Some(below) = stand.below() else { return false };
                let on_link = match stand {
                    Stand::PartOf(..) if scene.get(next).owner == Some(below) => scene.get(next).link.is_some(),
                    Stand::On(..) => place(below).is_some_and(|f| f.link.is_some()),
                    _ => false,
                };
                if below == mover {
                    return on_link;
                }
                next = below;
            }
            None => return false,
        }
    }
    false
}
