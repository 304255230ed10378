//! Whether what a motion was to bring about has come about, and what has gone wrong beside it.

use matterix_contact::{GRAVITY, Id};
use matterix_ir::math::acos;
use matterix_ir::pose::Pose;
use matterix_ir::scene::InstanceId;
use matterix_motion::pose::{distance, pose};

use super::{Event, Found, Hold, Matter, PATIENCE, Verdict};
use crate::motion::Stage;
use crate::motion::perform::TOLERANCE;

/// What moves slower than this lies still, m/s.
const STILL: f64 = 5e-3;
/// A thing leans that has turned by more than this, rad: what stands is upright to less, what has toppled is far beyond.
const LEANS: f64 = 0.35;
/// The share of their force with which fingers press at least on what they grip.
const PRESSED: f64 = 0.5;
/// How many times its weight something presses on a thing at least that stands in its way, and does not only bear it.
const BLOCKED: f64 = 1.5;

impl Matter<'_> {
    /// Notes what goes wrong now.
    pub(super) fn look(&mut self) {
        if self.event.is_some() {
            return;
        }
        let event = self.lost().or_else(|| self.disturbed());
        if let Some(event) = event {
            for (robot, machine) in &mut self.machines {
                let hit = event.robot.is_none_or(|by| by == *robot);
                if let Some(underway) = machine.underway.as_mut().filter(|_| hit) {
                    underway.brakes = true;
                }
            }
            self.event = Some(event);
        }
    }

    /// A thing that does not stay between fingers.
    fn lost(&self) -> Option<Event> {
        for (robot, machine) in &self.machines {
            let Some(Hold { item, inner }) = machine.held else { continue };
            let loose = self.loose.get(&item)?;
            let now = self.tip(machine).inverse().then(self.world.pose(loose.body));
            let (far, turned) = apart(&inner, &now);
            if far <= TOLERANCE.0 && turned <= LEANS {
                continue;
            }
            let touches = self.world.touches(loose.body);
            let hand = machine.hand.as_ref()?;
            let between = touches.iter().any(|touch| hand.fingers.contains(&touch.by));
            let against = touches.iter().filter(|touch| !hand.fingers.contains(&touch.by));
            let weight = self.laden(item) * GRAVITY;
            let against = against.filter(|touch| touch.pressed() > BLOCKED * weight);
            let against = against.max_by(|a, b| a.pressed().total_cmp(&b.pressed()));
            let (failure, text) = match against {
                Some(touch) => ("jammed", self.jammed(*robot, item, (far, turned), touch)),
                None if between => ("slip", self.slipped(*robot, item, (far, turned))),
                None => ("dropped", self.dropped(*robot, item)),
            };
            return Some(Event { at: self.time(), robot: Some(*robot), failure, text });
        }
        None
    }

    /// A thing that nobody holds and that does not stay where it stood.
    fn disturbed(&self) -> Option<Event> {
        for (id, loose) in &self.loose {
            if self.world.is_still(loose.body) || self.is_handled(*id) {
                continue;
            }
            let now = self.base(loose.base).inverse().then(self.world.pose(loose.body));
            let (far, _) = apart(&loose.rests, &now);
            let lean = leaning(&loose.rests, &now);
            if far <= TOLERANCE.0 && lean <= LEANS {
                continue;
            }
            let touches = self.world.touches(loose.body);
            let robot = touches.iter().find_map(|touch| self.robot_of(touch.by));
            let (robot, text) = (robot.or_else(|| self.only_robot()), self.disturbance(*id, far, lean, &touches));
            let failure = if lean > LEANS { "toppled" } else { "collision" };
            return Some(Event { at: self.time(), robot, failure, text });
        }
        None
    }

    /// Whether a robot has to do with a thing: its own step says what becomes of that.
    fn is_handled(&self, id: InstanceId) -> bool {
        self.machines.values().any(|machine| {
            let held = machine.held.is_some_and(|held| held.item == id);
            let underway = machine.underway.as_ref();
            held || underway.is_some_and(|u| u.grips == Some(id) || u.frees.is_some_and(|(item, _)| item == id))
        })
    }

    fn only_robot(&self) -> Option<InstanceId> {
        let mut moving = self.machines.iter().filter(|(_, machine)| machine.underway.is_some()).map(|(id, _)| *id);
        moving.next().filter(|_| moving.next().is_none())
    }

    /// The robot that a body is a link of.
    pub(super) fn robot_of(&self, body: Id) -> Option<InstanceId> {
        let is_of = |machine: &super::Machine| {
            machine.links.iter().any(|(_, id)| *id == body)
                || machine.hand.as_ref().is_some_and(|hand| hand.fingers.contains(&body))
        };
        self.machines.iter().find(|(_, machine)| is_of(machine)).map(|(id, _)| *id)
    }

    /// Whether a robot has something to answer for: the event of its own motion, or one that nobody has caused.
    pub fn verdict(&mut self, robot: InstanceId) -> Verdict {
        let Some(event) = self.event.as_ref().filter(|event| event.robot.is_none_or(|by| by == robot)) else {
            return Verdict::Well;
        };
        if !self.has_calmed(event.at) {
            return Verdict::Waits;
        }
        let (failure, text) = (event.failure, event.text.clone());
        let text = format!("{text}{}", self.aftermath());
        self.event = None;
        Verdict::Failed(failure, text)
    }

    /// What has gone wrong without a robot that moves.
    pub fn befallen(&mut self, moving: impl Fn(InstanceId) -> bool) -> Option<(&'static str, String)> {
        let event = self.event.as_ref().filter(|event| event.robot.is_none_or(|by| !moving(by)))?;
        if !self.has_calmed(event.at) {
            return None;
        }
        let event = self.event.take()?;
        Some((event.failure, event.text))
    }

    fn has_calmed(&self, since: f64) -> bool {
        self.time() >= since + PATIENCE || self.is_slow()
    }

    fn is_slow(&self) -> bool {
        self.loose.values().all(|loose| self.world.is_still(loose.body) || self.speed(loose.body) < STILL)
            && self.loose.values().all(|loose| !self.is_falling(loose.body))
    }

    fn is_falling(&self, body: Id) -> bool {
        !self.world.is_still(body) && self.world.touches(body).is_empty()
    }

    fn speed(&self, body: Id) -> f64 {
        let (speed, spin) = self.world.motion(body);
        length(speed) + 0.05 * length(spin)
    }

    /// A motion has come to its planned end: whether what it was for has come about.
    pub fn ends(&mut self, robot: InstanceId, stage: &Stage<'_>) -> Verdict {
        let early = self.verdict(robot);
        if early != Verdict::Well {
            return early;
        }
        let Some(underway) = self.machines.get(&robot).and_then(|machine| machine.underway.clone()) else {
            return Verdict::Well;
        };
        let late = self.time() > underway.begin + underway.performed.duration() + PATIENCE;
        if let Some(item) = underway.grips
            && let Some(failed) = self.gripped(robot, item)
        {
            return failed;
        }
        if let Some((item, on)) = underway.frees {
            let moves = self.loose.get(&item).is_some_and(|loose| {
                !self.world.is_still(loose.body) && self.speed(loose.body) > STILL || self.is_falling(loose.body)
            });
            if moves && !late {
                return Verdict::Waits;
            }
            if let Some(failed) = self.freed(robot, item, on, stage) {
                return failed;
            }
        }
        self.show();
        if let Some(machine) = self.machines.get_mut(&robot) {
            machine.underway = None;
        }
        Verdict::Well
    }

    /// Whether fingers have closed on a thing; what they have is in hand from now on.
    fn gripped(&mut self, robot: InstanceId, item: InstanceId) -> Option<Verdict> {
        let machine = self.machines.get(&robot)?;
        let Some(loose) = self.loose.get(&item) else {
            let name = &self.scene.get(item).name;
            let text = format!("`{name}` lacks a mass, a shape or its own place: a grip on it is not modelled");
            return Some(Verdict::Failed("unmovable", text));
        };
        let Some(hand) = machine.hand.as_ref() else {
            let text = format!("`{}` has no moving fingers: its grip is not modelled", self.scene.get(robot).name);
            return Some(Verdict::Failed("unmovable", text));
        };
        let pinch = self.world.pinch(hand.grip, loose.body);
        if pinch.iter().any(|force| *force < PRESSED * hand.force) {
            return Some(Verdict::Failed("missed", self.missed(robot, item, pinch)));
        }
        let inner = self.tip(machine).inverse().then(self.world.pose(loose.body));
        if let Some(machine) = self.machines.get_mut(&robot) {
            machine.held = Some(Hold { item, inner });
        }
        None
    }

    /// Whether a thing that was let go stands where it was to.
    fn freed(
        &mut self,
        robot: InstanceId,
        item: InstanceId,
        on: Option<InstanceId>,
        stage: &Stage<'_>,
    ) -> Option<Verdict> {
        let loose = *self.loose.get(&item)?;
        let taken = self.machines.values().any(|machine| machine.held.is_some_and(|held| held.item == item));
        if taken {
            return None;
        }
        let (now, meant) = (self.world.pose(loose.body), stage.pose(item));
        let (far, lean) = (apart(&meant, &now).0, leaning(&meant, &now));
        let base = on.or_else(|| stage.stand_of(item)).map(|on| stage.whole(on));
        if lean > LEANS {
            return Some(Verdict::Failed("toppled", self.fell(robot, item, (far, lean), true)));
        }
        if far > TOLERANCE.0 {
            let failure = if meant.position[2] - now.position[2] > TOLERANCE.0 { "dropped" } else { "missed" };
            return Some(Verdict::Failed(failure, self.fell(robot, item, (far, lean), false)));
        }
        if let Some(loose) = self.loose.get_mut(&item) {
            loose.base = base;
        }
        self.settle(item);
        None
    }

    /// All that is not where the stage has it, as it is. Things count as standing there from now on.
    pub fn found(&mut self, stage: &Stage<'_>) -> Vec<Found> {
        let mut out = Vec::new();
        let all: Vec<(InstanceId, Id)> = self.loose.iter().map(|(id, loose)| (*id, loose.body)).collect();
        for (thing, body) in all {
            let at = self.world.pose(body);
            let held = self.machines.iter().find(|(_, machine)| machine.held.is_some_and(|held| held.item == thing));
            let held = held.filter(|(_, machine)| {
                machine.hand.as_ref().is_some_and(|hand| self.world.pinch(hand.grip, body).iter().all(|f| *f > 0.0))
            });
            // What stands on something is in no hand, though fingers may touch it.
            let borne =
                self.world.touches(body).iter().filter(|t| self.robot_of(t.by).is_none()).map(|t| t.press[2]).sum();
            let weight = self.laden(thing) * GRAVITY;
            let held = held.map(|(robot, _)| *robot).filter(|_| 2.0 * f64::max(borne, 0.0) < weight);
            let on = if held.is_some() { None } else { self.bearer(body) };
            if held.is_none() {
                let hand = |machine: &super::Machine| {
                    let grips = machine.underway.as_ref().and_then(|underway| underway.grips);
                    machine.held.is_some_and(|held| held.item == thing) || grips == Some(thing)
                };
                let lost: Vec<InstanceId> =
                    self.machines.iter().filter(|(_, machine)| hand(machine)).map(|(robot, _)| *robot).collect();
                lost.into_iter().for_each(|robot| self.let_go(robot));
            }
            let (far, turned) = apart(&stage.pose(thing), &at);
            let moved = far > SEEN.0 || turned > SEEN.1;
            let freed = self.machines.values().filter_map(|machine| machine.underway.as_ref()?.frees);
            let freed = freed.into_iter().any(|(item, _)| item == thing);
            if moved || freed || stage.holder(thing) != held {
                if let Some(loose) = self.loose.get_mut(&thing) {
                    loose.base = on;
                }
                if held.is_none() {
                    let touches = self.pressed(body);
                    self.sightings.push(super::Sighting { time: self.time(), thing, at: Some(at), touches });
                }
                out.push(Found { thing, at, held, on });
            }
            self.settle(thing);
        }
        self.show();
        for machine in self.machines.values_mut() {
            let tip = machine.link(machine.actor.assembly.tip as usize);
            if let Some(held) = machine.held.as_mut()
                && let Some(loose) = self.loose.get(&held.item)
            {
                held.inner = tip.inverse().then(self.world.pose(loose.body));
            }
        }
        out
    }

    /// What presses a body up most.
    pub(super) fn bearer(&self, body: Id) -> Option<InstanceId> {
        let touches = self.world.touches(body);
        let below = touches.iter().filter(|touch| touch.press[2] > 0.0 && self.robot_of(touch.by).is_none());
        let most = below.max_by(|a, b| a.press[2].total_cmp(&b.press[2]))?;
        self.names.get(most.by.0 as usize)?.0
    }
}

/// How far from where it is taken to be a thing is before that is looked at again, m and rad.
const SEEN: (f64, f64) = (2e-4, 2e-3);

/// How far apart two places are, m, and how much turned, rad.
fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    distance(&pose(a), &pose(b))
}

/// The angle between the upright axes of two places, rad.
fn leaning(a: &Pose, b: &Pose) -> f64 {
    let up = |pose: &Pose| {
        let top = pose.point([0.0, 0.0, 1.0]);
        [0, 1, 2].map(|k| top[k] - pose.position[k])
    };
    let dot: f64 = up(a).iter().zip(up(b)).map(|(a, b)| a * b).sum();
    acos(dot.clamp(-1.0, 1.0))
}

fn length(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}
