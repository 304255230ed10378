//! The digital twin: operations act on the process engine and take their declared time.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::codes;
use matterix_ir::model::{Action, Model};
use matterix_ir::plan::{Motion, Operation, StepId};
use matterix_ir::quantity::show_number;
use matterix_ir::scene::InstanceId;
use matterix_ir::{Leaves, NodeId, Op};

use super::carried::{Attendant, Overflow, Told, carried, edge_after};
use super::{Backend, Follow, Moments, Prepared, Status, Ticket, next_report, noise, watch};
use crate::contact::{Matter, Verdict};
use crate::exec::{Alarm, Listener};
use crate::fault::Fault;
use crate::motion::{Burden, Moment, Performed, Refused, Stage, Stray, Unseen, supported, tempi};
use crate::process::{Advance, Engine, Watch};

/// What moves through space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moves {
    /// Robots, by planned motions.
    pub robots: bool,
    /// Some steps of the plan run beside others, so that what is in a robot's way may go away.
    pub beside: bool,
}

/// Simulates at `process` fidelity, or with robots that move through space. A clone goes on as it does.
#[derive(Clone)]
pub struct Sim<'m> {
    stage: Option<Stage<'m>>,
    moves: Moves,
    engine: Engine<'m>,
    prepared: &'m Prepared,
    seed: u64,
    moments: Moments,
    running: BTreeMap<Ticket, Running>,
    started: u64,
    /// What came about by itself, a failure's name and what it says, until an operation has failed of it.
    befallen: Option<(&'static str, String)>,
    /// How far things are from where the stage has them; none where nothing is.
    unseen: Option<Unseen>,
    /// What touches what; none where things are where they are planned to be.
    matter: Option<Matter<'m>>,
    /// What has been told of what robots carry.
    carried: Told,
    /// Laws move parts of things.
    turning: bool,
    /// Readings each node depends on, found once.
    sampled: BTreeMap<NodeId, Vec<u32>>,
    /// When each reading was last told, s.
    told: BTreeMap<u32, f64>,
    /// When each reading was last given from outside, s.
    given: BTreeMap<u32, f64>,
}

/// Longest time between two recorded moments of a motion, s.
const FRAME: f64 = 0.04;

/// How often it is looked at what touches what, s.
const LOOK: f64 = 0.04;

/// How often it is looked whether a robot in the way has begun to move, s.
const PATIENCE: f64 = 0.25;

/// An operation that goes on.
#[derive(Clone)]
struct Running {
    ends: Ends,
    /// The states that its beginning set.
    set: Vec<u32>,
    at_end: Vec<Action>,
    motion: Option<Motion>,
}

/// What becomes of the motion of an operation.
enum Moving {
    /// It takes so long, s.
    Lasts(f64),
    /// It takes no time, or there is none.
    AtOnce,
    /// What is really there ends it; when, s since the run began.
    Strays(Stray),
}

/// When an operation ends.
#[derive(Clone)]
enum Ends {
    At(f64),
    When(NodeId),
    /// It cannot be done: a failure's name and what it says.
    Failed(String, String),
    /// It ends at a time, s, by what is really there.
    Strays(f64, &'static str, String),
    /// Another robot is in its way: tried again when something has moved, until its time is up, s.
    Blocked {
        operation: Box<Operation>,
        begun: f64,
        until: f64,
        /// How often something had moved when it was last tried.
        seen: u64,
    },
    /// Looked at when a reading reports.
    Polled {
        condition: NodeId,
        periods: Vec<f64>,
        next: f64,
    },
}

impl<'m> Sim<'m> {
    /// Simulates with `engine`, which has been started on `prepared.model`; noise follows `seed`.
    pub fn new(mut engine: Engine<'m>, prepared: &'m Prepared, seed: u64) -> Self {
        engine.keep(&prepared.keeps);
        let (running, sampled) = (BTreeMap::new(), BTreeMap::new());
        let (told, given) = (BTreeMap::new(), BTreeMap::new());
        let (moves, befallen, carried) = (Moves::default(), None, Told::default());
        let (moments, stage, started) = (Moments::default(), None, 0);
        let turning = false;
        let (unseen, matter) = (None, None);
        Sim {
            stage,
            matter,
            moves,
            engine,
            prepared,
            seed,
            moments,
            running,
            started,
            befallen,
            unseen,
            carried,
            turning,
            sampled,
            told,
            given,
        }
    }

    /// Things have places from now on. Where robots move, their motions take the time they need, and fail where there is
    /// no way.
    pub fn with_stage(self, stage: Stage<'m>, moves: Moves, out: &mut dyn Listener) -> Self {
        let model = self.model();
        let rates: BTreeSet<u32> = model.derivatives.iter().map(|d| d.state).collect();
        let by_law = |op: &Op| matches!(op, Op::State(state) if rates.contains(state));
        let turning = stage.followed().any(|node| model.graph.depends(node, by_law));
        let mut sim = Sim { stage: Some(stage), moves, turning, ..self };
        sim.follow_joints(0.0, out);
        sim
    }

    /// Things are really so far from where they are taken to be.
    pub fn with_unseen(self, unseen: &Unseen) -> Self {
        Sim { unseen: Some(unseen.clone()).filter(|unseen| !unseen.is_nothing()), ..self }
    }

    /// Things have mass and friction, and grips hold as far as these bear.
    pub fn with_matter(self, matter: Matter<'m>) -> Self {
        Sim { matter: Some(matter), ..self }
    }

    /// Joints stand where the model says; how they get there in so many seconds is told.
    /// What one of them runs into on its way is said.
    fn follow_joints(&mut self, lasts: f64, out: &mut dyn Listener) -> Option<String> {
        self.joints_follow(out, |stage, moved, now| stage.swings(moved, now, lasts, FRAME))
    }

    /// The same of what laws have moved since a time, s.
    fn follow_laws(&mut self, since: f64, out: &mut dyn Listener) -> Option<String> {
        self.joints_follow(out, |stage, moved, now| stage.glides(moved, since, now))
    }

    fn joints_follow(
        &mut self,
        out: &mut dyn Listener,
        way: impl Fn(&Stage<'m>, &[(InstanceId, Vec<f64>)], f64) -> Vec<Moment>,
    ) -> Option<String> {
        let stage = self.stage.as_mut().filter(|stage| !stage.fixtures.is_empty())?;
        let engine = &self.engine;
        let moved = stage.follow_joints(|node| Some(engine.eval(node)));
        if moved.is_empty() {
            return None;
        }
        out.travels(&way(stage, &moved, engine.time()));
        let real = self.unseen.as_ref().map(|unseen| unseen.in_stage(stage));
        let there = real.as_ref().unwrap_or(stage);
        let (id, met) = self.moves.robots.then(|| there.swing_meets(&moved)).flatten()?;
        let name = &stage.scene.get(id).name;
        Some(format!("`{}` of `{name}` collides with {} at {}", met.mine, met.whom(), met.place()))
    }

    /// Tells how what robots carry may be moved now; what of it runs over where it is is said.
    fn look_at_carried(&mut self, out: &mut dyn Listener) -> Option<String> {
        let (time, pouring) = (self.engine.time(), self.pouring());
        let stage = self.stage.as_mut().filter(|_| self.moves.robots)?;
        stage.come_to(time);
        let loads = carried(&self.prepared.model.loads, stage);
        let told = &mut self.carried;
        let mut attendant = Attendant { out, stage, loads, pouring, told, found: None };
        attendant.look(time, &self.engine);
        let overflow = attendant.found;
        overflow.map(|overflow| self.overflow(overflow))
    }

    /// The vessels that pour, or are being tilted over another one: what their own steps know of that is judged where these begin.
    fn pouring(&self) -> BTreeSet<InstanceId> {
        let tilted = |running: &Running| match running.motion {
            Some(Motion::Tilted { about: (vessel, _), .. }) => Some(vessel),
            _ => None,
        };
        self.running.values().filter_map(tilted).collect()
    }

    /// A vessel in hand that runs over, in words.
    fn overflow(&self, (vessel, over): Overflow) -> String {
        let Some(stage) = &self.stage else { return String::new() };
        let name = |id: InstanceId| &stage.scene.get(id).name;
        let by = stage.held_by(vessel).map(name).map_or("no robot", String::as_str);
        let tilt = stage.tilt_at(vessel, self.engine.time()).to_degrees();
        let (vessel, over) = (name(vessel), over * 1e6);
        // Of what fills it steadily the first drops are not worth a number.
        let by_how_much =
            if over < 0.1 { String::new() } else { format!(": {over:.1} mL more than it can hold at this angle") };
        format!("`{vessel}` spills: `{by}` holds it tilted by {tilt:.0} deg{by_how_much}")
    }

    /// Whether a robot carries a vessel that something may run out of.
    fn carries_vessels(&self) -> bool {
        let Some(stage) = self.stage.as_ref().filter(|_| self.moves.robots) else { return false };
        let loads = self.prepared.model.loads.iter().filter(|load| load.loose.is_some());
        loads.into_iter().any(|load| stage.held_by(load.instance).is_some())
    }

    /// Lets time pass; while robots carry vessels, with a look at these.
    fn let_pass(
        &mut self,
        until: f64,
        watches: &[Watch],
        out: &mut dyn Listener,
    ) -> Result<(Advance, Option<Overflow>), Fault> {
        if !self.carries_vessels() {
            return Ok((self.engine.advance(until, watches, out)?, None));
        }
        let pouring = self.pouring();
        let Some(stage) = self.stage.as_ref() else { return Ok((Advance::Reached, None)) };
        let loads = carried(&self.prepared.model.loads, stage);
        let mut attendant = Attendant { out, stage, loads, pouring, told: &mut self.carried, found: None };
        loop {
            let look = edge_after(self.engine.time());
            let advance = self.engine.advance(until.min(look), watches, &mut attendant)?;
            if self.engine.time() >= look {
                attendant.look(self.engine.time(), &self.engine);
            }
            if attendant.found.is_some() || advance != Advance::Reached || self.engine.time() >= until {
                return Ok((advance, attendant.found));
            }
        }
    }

    /// The value of a node when an operation has ended.
    fn after(&self, operation: &Operation, node: NodeId) -> f64 {
        let mut states = self.engine.states();
        for action in operation.at_start.iter().chain(&operation.at_end) {
            let Action::Assign { state, value, .. } = action else { continue };
            let value = self.engine.eval_with(*value, &states);
            if let Some(slot) = states.get_mut(*state as usize) {
                *slot = value;
            }
        }
        self.engine.eval_with(node, &states)
    }

    /// Carries out the motion of an operation.
    fn perform(&mut self, operation: &Operation, out: &mut dyn Listener) -> Result<Moving, Refused> {
        let Some(motion) = operation.motion.as_ref().filter(|_| self.moves.robots) else { return Ok(Moving::AtOnce) };
        let motion = motion.chosen(|node| Some(self.engine.eval(node))).unwrap_or_else(|| motion.clone());
        let led = self.stage.as_ref().and_then(|stage| stage.led_by(&motion));
        let values: Vec<f64> = match led {
            Some(led) => vec![self.after(operation, led)],
            None => motion.values().into_iter().map(|node| self.measure(node, out)).collect(),
        };
        if let Some(text) = self.look_at_carried(out) {
            self.befallen.get_or_insert(("spilled", text));
        }
        let Some(stage) = self.stage.as_mut() else { return Ok(Moving::AtOnce) };
        stage.come_to(self.engine.time());
        let value = |node: Option<NodeId>| node.map(|node| self.engine.eval(node));
        let held = carried(&self.prepared.model.loads, stage).into_iter();
        stage.burden(held.map(|load| (load.instance, Burden::of(load, value))).collect::<Vec<_>>());
        stage.keep_time(tempi(&self.prepared.model.paces, |node| Some(self.engine.eval(node))));
        let now = self.engine.time();
        let before = self.unseen.as_ref().filter(|_| self.matter.is_none()).map(|_| stage.clone());
        let performed = stage.set_out(&motion, &values)?;
        if self.matter.is_some() {
            return Ok(self.set_about(&motion, performed.as_ref()));
        }
        let Some(stage) = self.stage.as_mut() else { return Ok(Moving::AtOnce) };
        if let (Some(unseen), Some(before)) = (&mut self.unseen, &before)
            && let Err(stray) = unseen.follow([before, stage], &motion, performed.as_ref())
        {
            stage.clone_from(before);
            if let Some(performed) = performed.as_ref().filter(|_| stray.at > 0.0) {
                let real = unseen.in_stage(stage);
                out.travels(&stage.moments_until(&real, performed, [now, stray.at], FRAME));
            }
            return Ok(Moving::Strays(Stray { at: now + stray.at, ..stray }));
        }
        let real = self.unseen.as_ref().map(|unseen| unseen.in_stage(stage));
        let there = real.as_ref().unwrap_or(stage);
        let Some(performed) = performed else {
            // What changes hands does so while both stand still.
            if let Motion::Free { on: Some(on), by, .. } = &motion {
                let robots = [*by, *on].into_iter().filter_map(|id| there.hand_of(id));
                out.travels(&robots.filter_map(|robot| there.moment(robot, now)).collect::<Vec<_>>());
            }
            return Ok(Moving::AtOnce);
        };
        out.travels(&there.moments(&performed, now, FRAME));
        Ok(Moving::Lasts(performed.duration()))
    }

    /// Begins a planned motion among bodies that touch.
    fn set_about(&mut self, motion: &Motion, performed: Option<&Performed>) -> Moving {
        let (Some(matter), Some(stage)) = (self.matter.as_mut(), self.stage.as_ref()) else { return Moving::AtOnce };
        for load in &self.prepared.model.loads {
            if let Some(gross) = load.gross {
                let volume = load.filling.map_or(0.0, |node| self.engine.eval(node));
                matter.weigh(load.instance, self.engine.eval(gross), volume);
            }
        }
        let Some(robot) = stage.actor_of(motion.mover()) else { return Moving::AtOnce };
        let planned = performed.map_or(0.0, Performed::duration);
        let lasts = planned + matter.begin(motion, robot, performed, self.engine.time());
        if performed.is_some() || lasts > 0.0 { Moving::Lasts(lasts) } else { Moving::AtOnce }
    }

    /// What of a motion that is under way has come about otherwise than planned: a status where that is not settled.
    fn touched(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Option<Status>, Fault> {
        let now = self.engine.time();
        let (Some(matter), Some(stage), Some(running)) =
            (self.matter.as_mut(), self.stage.as_ref(), self.running.get(&ticket))
        else {
            return Ok(None);
        };
        let Some(robot) = running.motion.as_ref().and_then(|motion| stage.actor_of(motion.mover())) else {
            return Ok(None);
        };
        let verdict = match running.ends {
            Ends::At(at) if now >= at => matter.ends(robot, stage),
            Ends::At(_) => matter.verdict(robot),
            _ => Verdict::Well,
        };
        let status = match verdict {
            Verdict::Well => None,
            Verdict::Waits => Some(Status::Running { until: Some(now + LOOK), watch: None }),
            Verdict::Failed(name, text) => {
                if let Some(running) = self.running.get_mut(&ticket) {
                    running.ends = Ends::Failed(name.to_string(), text);
                }
                self.look_again(Some(robot), out)?;
                None
            }
        };
        self.tell_matter(out);
        Ok(status)
    }

    /// Robots see where everything is now, and the states of the model say so.
    fn look_again(&mut self, stopped: Option<InstanceId>, out: &mut dyn Listener) -> Result<(), Fault> {
        let (Some(matter), Some(stage)) = (self.matter.as_mut(), self.stage.as_mut()) else { return Ok(()) };
        let found = matter.found(stage);
        if let Some(robot) = stopped
            && let Some(joints) = matter.stop(robot)
        {
            stage.stops(robot, &joints);
        }
        let mut states = Vec::new();
        for thing in &found {
            if thing.held.is_some() {
                stage.lies_in_hand(thing.thing, thing.at);
                continue;
            }
            stage.lies(thing.thing, thing.at, thing.on);
            let on = thing.on.map_or(-1.0, |on| f64::from(on.0));
            for (index, state) in (0u32..).zip(&self.prepared.model.states) {
                if supported(stage.scene, &state.name, &state.domain) == Some(thing.thing) {
                    states.push((index, on));
                } else if self.engine.state(index) == f64::from(thing.thing.0) && stage.is_of_a_robot(state) {
                    states.push((index, -1.0));
                }
            }
        }
        self.engine.put(&states, out)
    }

    /// Hands on what has moved.
    fn tell_matter(&mut self, out: &mut dyn Listener) {
        let Some(matter) = self.matter.as_mut() else { return };
        let (moments, sightings) = matter.told();
        if !moments.is_empty() {
            out.travels(&moments);
        }
        if !sightings.is_empty() {
            out.sightings(&sightings);
        }
    }

    /// How an operation with a motion goes on. One that another robot is in the way of waits for it to go away, no
    /// longer than the bounds of its duration allow; `begun` is when it first tried, s.
    fn attempt(&mut self, operation: &Operation, begun: f64, out: &mut dyn Listener) -> Result<Ends, Fault> {
        let refused = match self.perform(operation, out) {
            Ok(Moving::Lasts(duration)) => return Ok(Ends::At(self.moment_after(self.rest(operation) + duration))),
            Ok(Moving::Strays(stray)) => return Ok(Ends::Strays(stray.at, stray.failure, stray.text)),
            Ok(Moving::AtOnce) => return self.end_of(operation, out),
            Err(refused) => refused,
        };
        let (now, stage) = (self.engine.time(), self.stage.as_ref());
        let mut text = stage.map(|s| refused.text(s.scene, operation)).unwrap_or_default();
        if self.moves.beside && stage.is_some_and(|s| s.is_by_a_robot(&refused)) {
            let bounds = operation.takes.and_then(|t| t.bounds);
            let until = begun + bounds.map_or(0.0, |(_, most)| self.engine.eval(most));
            if now < until {
                let seen = stage.map_or(0, |s| s.changes());
                return Ok(Ends::Blocked { operation: Box::new(operation.clone()), begun, until, seen });
            }
            text.push_str(&format!(", which did not move away within {} s", show_number(now - begun)));
        }
        Ok(Ends::Failed(refused.failure().to_string(), text))
    }

    /// What an operation takes beside its motion, s.
    fn rest(&self, operation: &Operation) -> f64 {
        let (Some(Motion::To { within: Some(within), .. }), Some(takes)) = (&operation.motion, &operation.takes) else {
            return 0.0;
        };
        (self.engine.eval(takes.nominal) - self.engine.eval(*within)).max(0.0)
    }

    /// Things stand where the states of the model say.
    fn follow_supports(&mut self, actions: &[Action]) {
        let Some(stage) = self.stage.as_mut() else { return };
        for action in actions {
            let Action::Assign { state, .. } = action else { continue };
            let value = self.engine.state(*state);
            stage.follow_load(*state, value);
            let Some(state) = self.prepared.model.states.get(*state as usize) else { continue };
            if let Some(id) = supported(stage.scene, &state.name, &state.domain) {
                let before = stage.below(id);
                stage.follow(id, (value >= 0.0).then_some(InstanceId(value as u32)));
                if stage.below(id) == before {
                    continue;
                }
                if let Some(unseen) = self.unseen.as_mut() {
                    unseen.forget(id);
                }
                if let Some(matter) = self.matter.as_mut() {
                    matter.put(id, stage.pose(id), stage.below(id).map(|below| stage.whole(below)));
                }
            }
        }
    }

    /// The engine, for its states and balances.
    pub fn engine(&mut self) -> &mut Engine<'m> {
        &mut self.engine
    }

    fn model(&self) -> &'m Model {
        &self.prepared.model
    }

    /// Takes a sample of every reading that `node` depends on and evaluates it.
    fn measure(&mut self, node: NodeId, out: &mut dyn Listener) -> f64 {
        let (model, now) = (self.model(), self.engine.time());
        let readings = self.sampled.entry(node).or_insert_with(|| watch::readings(&model.graph, node));
        for &index in readings.iter() {
            let Some(reading) = model.readings.get(index as usize) else { continue };
            if self.given.get(&index) == Some(&now) {
                continue;
            }
            let exact = self.engine.eval(reading.value);
            let shown = noise::measure(reading, index as usize, self.seed, now, exact);
            if self.told.insert(index, now) != Some(now) {
                out.reading(now, index as usize, shown);
            }
            self.engine.set_reading(index, shown);
        }
        self.engine.eval(node)
    }

    /// An operation that takes its time is over, as its device says: its effects come about when it is asked next.
    pub fn hasten(&mut self, ticket: Ticket) {
        let now = self.engine.time();
        if let Some(running) = self.running.get_mut(&ticket)
            && matches!(running.ends, Ends::At(_))
        {
            running.ends = Ends::At(now);
        }
    }

    /// An operation has been broken off on its device: what its beginning had set and its end would set back is set back now.
    pub fn break_off(&mut self, ticket: Ticket) -> Result<(), Fault> {
        let Some(running) = self.running.remove(&ticket) else { return Ok(()) };
        if let Some(stage) = self.stage.as_mut() {
            stage.let_go(running.motion.as_ref());
        }
        let back = |action: &&Action| matches!(action, Action::Assign { state, .. } if running.set.contains(state));
        let back: Vec<Action> = running.at_end.iter().filter(back).cloned().collect();
        self.act(&back, &mut ())
    }

    /// A reading as a device has just reported it: within this instant it stands in place of what the model supposes.
    pub fn give(&mut self, reading: u32, value: f64) {
        let now = self.engine.time();
        self.engine.set_reading(reading, value);
        self.given.insert(reading, now);
    }

    /// Takes a sample of every reading that actions depend on, then performs them.
    fn act(&mut self, actions: &[Action], out: &mut dyn Listener) -> Result<(), Fault> {
        let graph = &self.prepared.model.graph;
        for node in actions.iter().map(Action::source).filter(|n| graph.leaves(*n).meets(Leaves::READING)) {
            self.measure(node, out);
        }
        self.engine.apply(actions, out)?;
        self.follow_supports(actions);
        Ok(())
    }

    fn end_of(&mut self, operation: &Operation, out: &mut dyn Listener) -> Result<Ends, Fault> {
        let now = self.engine.time();
        if let Some(until) = &operation.until {
            return Ok(match self.prepared.follow(until.node) {
                Follow::Watch(node) => Ends::When(node),
                Follow::Every(periods) => Ends::Polled { condition: until.node, periods, next: now },
                Follow::Assumed => Ends::At(now),
            });
        }
        let Some(takes) = operation.takes else { return Ok(Ends::At(now)) };
        let nominal = self.measure(takes.nominal, out);
        if nominal.is_finite() && nominal >= 0.0 {
            return Ok(Ends::At(self.moment_after(nominal)));
        }
        let message = format!("`{}` would take {} s, which is not a duration", operation.verb, show_number(nominal));
        Err(Fault::new(codes::UNUSABLE_NUMBER, now, message))
    }

    /// Operations that last until `node` holds are over, whatever others then do at this instant.
    fn end_when(&mut self, node: NodeId) {
        let now = self.engine.time();
        for running in self.running.values_mut().filter(|r| matches!(r.ends, Ends::When(n) if n == node)) {
            running.ends = Ends::At(now);
        }
    }

    /// An operation that is blocked begins where what has moved meanwhile lets it, and fails when its time is up.
    fn try_again(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<(), Fault> {
        let Some(Running { ends: Ends::Blocked { operation, begun, until, seen }, .. }) = self.running.get(&ticket)
        else {
            return Ok(());
        };
        if self.stage.as_ref().is_some_and(|s| s.changes() == *seen) && self.engine.time() < *until {
            return Ok(());
        }
        let (operation, begun) = (operation.clone(), *begun);
        let ends = self.attempt(&operation, begun, out)?;
        if let Some(running) = self.running.get_mut(&ticket) {
            running.ends = ends;
        }
        Ok(())
    }

    /// Starts an operation that need not be of the plan.
    pub fn begin(&mut self, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        let ends = self.attempt(operation, self.engine.time(), out)?;
        self.act(&operation.at_start, out)?;
        let over = if operation.at_start.is_empty() { None } else { self.look_at_carried(out) };
        let lasts = match &ends {
            Ends::At(end) | Ends::Strays(end, ..) => end - self.engine.time(),
            _ => 0.0,
        };
        let ends = match self.follow_joints(lasts, out) {
            Some(text) => Ends::Failed("collision".to_string(), text),
            None => over.map_or(ends, |text| Ends::Failed("spilled".to_string(), text)),
        };
        let ticket = Ticket(self.started);
        self.started += 1;
        let assigned = operation.at_start.iter().filter_map(Action::assigned);
        let (set, at_end, motion) = (assigned.collect(), operation.at_end.clone(), operation.motion.clone());
        self.running.insert(ticket, Running { ends, set, at_end, motion });
        Ok(ticket)
    }

    /// What is worth waiting for, or `None` if the operation is over. Fails where what it waits for has no value.
    fn pending(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Option<Status>, Fault> {
        let now = self.engine.time();
        let until = |time| Ok(Some(Status::Running { until: Some(time), watch: None }));
        let (condition, periods) = match self.running.get(&ticket).map(|running| &running.ends) {
            None | Some(Ends::Failed(..)) => return Ok(None),
            Some(Ends::At(at) | Ends::Strays(at, ..)) if now >= *at => return Ok(None),
            Some(Ends::At(at) | Ends::Strays(at, ..)) => return until(*at),
            Some(Ends::Blocked { until: at, .. }) => return until((now + PATIENCE).min(*at)),
            Some(Ends::When(node)) => {
                self.engine.defined(*node)?;
                let waits = !self.engine.truth(*node);
                return Ok(waits.then_some(Status::Running { until: None, watch: Some(*node) }));
            }
            Some(Ends::Polled { next, .. }) if now < *next => return until(*next),
            Some(Ends::Polled { condition, periods, .. }) => (*condition, periods.clone()),
        };
        let value = self.measure(condition, out);
        self.engine.defined(condition)?;
        if value != 0.0 {
            return Ok(None);
        }
        let next = next_report(&periods, now);
        if let Some(running) = self.running.get_mut(&ticket) {
            running.ends = Ends::Polled { condition, periods, next };
        }
        until(next)
    }
}

impl Backend for Sim<'_> {
    fn now(&self) -> f64 {
        self.engine.time()
    }

    fn value(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<Option<f64>, Fault> {
        Ok(Some(self.measure(node, out)))
    }

    fn defined(&mut self, node: NodeId) -> Result<(), Fault> {
        self.engine.defined(node)
    }

    fn limit(&mut self, limit: u32, condition: NodeId, out: &mut dyn Listener) -> Result<Option<bool>, Fault> {
        let holds = self.measure(self.prepared.keeps.node(limit).unwrap_or(condition), out) != 0.0;
        self.engine.note_limit(limit, holds);
        Ok(Some(holds))
    }

    fn broken(&self) -> Vec<u32> {
        self.engine.broken_limits()
    }

    fn decide(&self, limit: u32) -> Vec<Vec<u32>> {
        self.prepared.keeps.decide(&self.prepared.model, limit)
    }

    fn may_change(&self, operation: &Operation, condition: NodeId) -> bool {
        self.prepared.may_change(operation, condition)
    }

    fn moment_after(&mut self, duration: f64) -> f64 {
        self.moments.after(self.engine.time(), duration)
    }

    fn follow(&mut self, condition: NodeId) -> Follow {
        self.prepared.follow(condition)
    }

    fn set_local(&mut self, local: u32, value: Option<f64>) {
        self.engine.set_local(local, value.unwrap_or(f64::NAN));
    }

    fn foresee(&mut self, step: StepId, operation: &Operation, out: &mut dyn Listener) -> Option<Alarm> {
        out.foreseen(&self.engine, step, operation)
    }

    fn start(&mut self, _: StepId, operation: &Operation, out: &mut dyn Listener) -> Result<Ticket, Fault> {
        self.begin(operation, out)
    }

    fn poll(&mut self, ticket: Ticket, out: &mut dyn Listener) -> Result<Status, Fault> {
        self.try_again(ticket, out)?;
        if let Some(status) = self.touched(ticket, out)? {
            return Ok(status);
        }
        // What comes about by itself fails the first operation that is asked for.
        if let Some(running) = self.running.get_mut(&ticket)
            && let Some((name, text)) = self.befallen.take()
        {
            running.ends = Ends::Failed(name.to_string(), text);
        }
        if let Some(status) = self.pending(ticket, out)? {
            return Ok(status);
        }
        if let Some(running) = self.running.remove(&ticket) {
            if let Some(stage) = self.stage.as_mut() {
                stage.let_go(running.motion.as_ref());
            }
            if let Ends::Failed(name, text) = running.ends {
                return Ok(Status::Failed { name, text });
            }
            if let Ends::Strays(_, name, text) = running.ends {
                return Ok(Status::Failed { name: name.to_string(), text });
            }
            self.act(&running.at_end, out)?;
            if let Some(text) = self.follow_joints(0.0, out) {
                return Ok(Status::Failed { name: "collision".to_string(), text });
            }
            if let Some(text) = self.look_at_carried(out) {
                return Ok(Status::Failed { name: "spilled".to_string(), text });
            }
        }
        Ok(Status::Done)
    }

    fn has_befallen(&self) -> bool {
        self.befallen.is_some()
    }

    fn halt(&mut self, ticket: Ticket) {
        let halted = self.running.remove(&ticket);
        // How far it had been tilted by then is not known, nor what had run out.
        if let Some(Motion::Tilted { about: (vessel, _), .. }) =
            halted.as_ref().and_then(|running| running.motion.as_ref())
        {
            self.carried.hush(*vessel);
        }
        if let (Some(stage), Some(halted)) = (self.stage.as_mut(), halted) {
            stage.let_go(halted.motion.as_ref());
            let robot = halted.motion.as_ref().and_then(|motion| stage.actor_of(motion.mover()));
            if let (Some(matter), Some(robot)) = (self.matter.as_mut(), robot)
                && let Some(joints) = matter.stop(robot)
            {
                stage.stops(robot, &joints);
            }
        }
    }

    fn advance(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        loop {
            let before = self.engine.time();
            let mut next = if self.turning { until.min(edge_after(before)) } else { until };
            if self.matter.as_ref().is_some_and(Matter::is_awake) {
                next = next.min(before + LOOK);
            }
            let advance = self.go_on(next, watches, out)?;
            let there = self.engine.time() >= until;
            match advance {
                // Whoever waits looks at what has come about, however long that is before the time it waits for.
                Advance::Reached if !there && self.befallen.is_some() => return Ok(Advance::Watch(Vec::new())),
                Advance::Reached if !there => {}
                advance => return Ok(advance),
            }
        }
    }
}

impl Sim<'_> {
    /// Bodies have come to where they are now.
    fn touch(&mut self, out: &mut dyn Listener) -> Result<(), Fault> {
        let now = self.engine.time();
        let (Some(matter), Some(stage)) = (self.matter.as_mut(), self.stage.as_ref()) else { return Ok(()) };
        matter.go_to(now, stage);
        let moving = |robot: InstanceId| {
            let motions = self.running.values().filter_map(|running| running.motion.as_ref());
            motions.into_iter().any(|motion| stage.actor_of(motion.mover()) == Some(robot))
        };
        let befallen = matter.befallen(moving);
        if let Some((failure, text)) = befallen {
            self.look_again(None, out)?;
            if self.running.is_empty() {
                let fault = Fault::new(codes::COLLISION, now, text);
                return Err(fault.help("check which robot held it and which thing touched it"));
            }
            self.befallen.get_or_insert((failure, text));
        }
        self.tell_matter(out);
        Ok(())
    }

    /// Lets time pass, and things with it.
    fn go_on(&mut self, until: f64, watches: &[Watch], out: &mut dyn Listener) -> Result<Advance, Fault> {
        let before = self.engine.time();
        let (advance, overflow) = self.let_pass(until, watches, out)?;
        let met = if self.turning { self.follow_laws(before, out) } else { self.follow_joints(0.0, out) };
        if let Some(text) = met {
            if self.running.is_empty() {
                let fault = Fault::new(codes::COLLISION, self.engine.time(), text);
                return Err(fault.help("move it out of the way, or end the motion earlier"));
            }
            self.befallen.get_or_insert(("collision", text));
        }
        self.touch(out)?;
        if let Some(text) = overflow.map(|overflow| self.overflow(overflow)) {
            if self.running.is_empty() {
                let fault = Fault::new(codes::SPILLED, self.engine.time(), text);
                return Err(fault.help("set it upright, or stop filling it earlier"));
            }
            self.befallen.get_or_insert(("spilled", text));
        }
        if let Advance::Watch(indices) = &advance {
            let fired = indices.iter().filter_map(|&i| watches.get(i)).filter(|w| w.value);
            fired.for_each(|w| self.end_when(w.node));
        }
        Ok(advance)
    }
}
