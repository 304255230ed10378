//! What is there and what the planner believes: things that really stand a little away from where they are taken to be.
//!
//! The stage that plans has the poses that are believed. The truth is kept beside it, as how far each thing is off in its own
//! frame: whatever carries a thing takes that along.

mod grip;

use std::collections::BTreeMap;

use matterix_ir::Program;
use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Shape, Stand};
use matterix_motion::spheres::{Contact, Other, Referee};

use super::carried::Carried;
use super::exact::Exact;
use super::moment::Moment;
use super::performed::Performed;
use super::perturb::{Moved, Perturbation, perturb};
use super::refused::Refused;
use super::stage::{Actor, Stage};
use super::surroundings::Surroundings;

/// Sets these numbers apart from those of [`perturb`].
const STREAM: u64 = 0x0075_6E73_6565_6E00;
/// What differs by less is the same, m.
const SAME: f64 = 1e-9;
/// How much deeper than in what is believed two things must be in each other to count, m.
const DEEPER: f64 = 1e-3;
/// Greatest change of any joint between two moments that are looked at, rad or m: 5 mm of a point at a metre's reach.
const FINE: f64 = 0.005;
/// The same in time, s.
const OFTEN: f64 = 0.004;

/// How far things are from where they are taken to be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unseen {
    /// By thing, in its own frame.
    off: BTreeMap<InstanceId, Pose>,
    /// As it was drawn.
    moved: Vec<Moved>,
}

/// A motion that what is really there ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Stray {
    /// When, s since the motion began.
    pub at: f64,
    /// The failure it raises.
    pub failure: &'static str,
    /// What happens, in words.
    pub text: String,
}

/// A hole that something is put into.
struct Entry {
    hole: InstanceId,
    /// Of the hole, m.
    depth: f64,
    /// How far what is put there is off the middle of the hole, m.
    off: f64,
    /// How far it may be, m; nothing where their shapes do not say.
    room: Option<f64>,
}

impl Unseen {
    /// Things as far off as [`perturb`] moves them, in numbers of its own.
    pub fn drawn(program: &Program, by: Perturbation, seed: u64) -> Result<Self, String> {
        if by == Perturbation::default() {
            return Ok(Unseen::default());
        }
        let mut real = program.clone();
        let moved = perturb(&mut real, by, seed ^ STREAM)?;
        let pose = |program: &Program, id: InstanceId| program.scene.get(id).pose;
        let off = moved.iter().map(|m| (m.thing, pose(program, m.thing).inverse().then(pose(&real, m.thing))));
        Ok(Unseen { off: off.collect(), moved })
    }

    /// Whether everything is where it is taken to be.
    pub fn is_nothing(&self) -> bool {
        self.moved.is_empty()
    }

    /// What stands elsewhere when the run begins.
    pub fn moved(&self) -> &[Moved] {
        &self.moved
    }

    /// A program with things where they really are when the run begins.
    pub fn in_program(&self, program: &Program) -> Program {
        let mut real = program.clone();
        for (id, off) in &self.off {
            if let Some(instance) = real.scene.instances.get_mut(id.0 as usize) {
                instance.pose = instance.pose.then(*off);
            }
        }
        real
    }

    /// A lab with things where they really are.
    pub fn in_stage<'p>(&self, stage: &Stage<'p>) -> Stage<'p> {
        let mut real = stage.clone();
        for (id, off) in &self.off {
            let now = real.carried.get(id.0 as usize).copied();
            let now = now.map(|now| match now {
                Carried::Stands(Stand::Lab(at)) => Carried::Stands(Stand::Lab(at.then(*off))),
                Carried::Stands(Stand::On(on, at)) => Carried::Stands(Stand::On(on, at.then(*off))),
                Carried::Stands(Stand::PartOf(of, at)) => Carried::Stands(Stand::PartOf(of, at.then(*off))),
                Carried::Held(by, at) => Carried::Held(by, at.then(*off)),
            });
            now.and_then(|now| real.carried.set(*id, now));
        }
        real
    }

    /// A thing has been put somewhere without a motion: it is where it is taken to be.
    pub fn forget(&mut self, id: InstanceId) {
        self.off.remove(&id);
    }

    /// Carries out what has been planned among what is really there. Where that ends the motion, nothing is carried otherwise
    /// than before it.
    pub fn follow(
        &mut self,
        [before, after]: [&Stage<'_>; 2],
        motion: &Motion,
        performed: Option<&Performed>,
    ) -> Result<(), Stray> {
        let (real, then) = (self.in_stage(before), self.in_stage(after));
        match motion {
            Motion::Grip { item, frame, by } => {
                let pose = grip::gripped([before, &real], *item, frame, *by)?;
                self.set(after, *item, pose);
            }
            Motion::Free { item, .. } => self.set(after, *item, left([after, &then], &real, *item)),
            _ => {
                let Some(performed) = performed else { return Ok(()) };
                let entry = entry([after, &then], performed.robot, motion);
                look([before, &real], motion, performed, entry.as_ref())?;
                aimed([after, &then], motion, performed)?;
            }
        }
        Ok(())
    }

    /// A thing is really here, in the lab.
    fn set(&mut self, stage: &Stage<'_>, id: InstanceId, pose: Pose) {
        self.off.remove(&id);
        let believed = self.in_stage(stage).pose(id);
        if is_elsewhere(&believed, &pose) {
            self.off.insert(id, believed.inverse().then(pose));
        }
    }
}

impl Stage<'_> {
    /// The moments of a motion up to a time since it began, s, at which something ends it: the stage comes to rest there.
    pub fn moments_until(
        &mut self,
        real: &Stage<'_>,
        performed: &Performed,
        span: [f64; 2],
        apart: f64,
    ) -> Vec<Moment> {
        let [begin, until] = span;
        let mut out = real.moments(performed, begin, apart);
        out.retain(|moment| moment.time < begin + until);
        let mut real = real.clone();
        let actors = [&mut real.actors, &mut self.actors].into_iter();
        for actor in actors.filter_map(|actors| actors.get_mut(&performed.robot)) {
            performed.bring(actor, until);
        }
        // It has its speed still where it is stopped.
        out.extend(real.moment(performed.robot, begin + until).map(|mut moment| {
            performed.rush(&mut moment, until);
            moment
        }));
        out
    }
}

/// Whether two poses are not the same.
fn is_elsewhere(a: &Pose, b: &Pose) -> bool {
    let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    points.into_iter().any(|point| apart(a.point(point), b.point(point)) > SAME)
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}

fn mm(m: f64) -> String {
    format!("{:.1} mm", m * 1e3)
}

fn not_modelled(what: String) -> Stray {
    let text = format!("{what}: `--unseen` does not model what happens then");
    Stray { at: 0.0, failure: "unmovable", text }
}

/// Where a thing is once it is let go: where the hand left it, or in the middle of its hole.
fn left([believed, real]: [&Stage<'_>; 2], before: &Stage<'_>, item: InstanceId) -> Pose {
    let pose = before.pose(item);
    let Some(hole) = believed.stand_of(item).filter(|on| clearance(believed, item, *on).is_some()) else { return pose };
    let thought = believed.pose(hole).inverse().then(believed.pose(item));
    let turned = real.pose(hole).inverse().then(pose);
    real.pose(hole).then(Pose { position: thought.position, ..turned })
}

/// How far a thing may be off the middle of a hole, m; nothing where it is none, or where their shapes do not say.
fn clearance(stage: &Stage<'_>, item: InstanceId, hole: InstanceId) -> Option<f64> {
    let Some(Shape::Cylinder([bore, depth])) = stage.scene.get(hole).room else { return None };
    let width = match stage.scene.get(item).shape.as_ref()? {
        Shape::Cylinder([d, _]) => *d,
        Shape::Turned { outside, .. } => {
            2.0 * outside.iter().filter(|p| p[1] <= depth).map(|p| p[0]).fold(0.0, f64::max)
        }
        _ => return None,
    };
    Some((bore - width) / 2.0)
}

/// The hole that a motion ends in with what it carries.
fn entry([believed, real]: [&Stage<'_>; 2], robot: InstanceId, motion: &Motion) -> Option<Entry> {
    let (item, (goal, frame)) = (believed.held(robot)?, motion.goal()?);
    let hole = if believed.is_stand(goal, frame) { believed.stood_on(item)? } else { goal };
    let depth = believed.scene.get(hole).room.as_ref()?.size()[2];
    let within = |stage: &Stage<'_>| stage.pose(hole).inverse().then(stage.pose(item)).position;
    let [x, y, z] = within(real);
    (z < depth).then(|| Entry { hole, depth, off: x.hypot(y), room: clearance(real, item, hole) })
}

/// What a motion meets of what is really there and does not in what is believed.
fn look(
    [believed, real]: [&Stage<'_>; 2],
    motion: &Motion,
    performed: &Performed,
    entry: Option<&Entry>,
) -> Result<(), Stray> {
    let robot = performed.robot;
    let Some(actor) = believed.actors.get(&robot) else { return Ok(()) };
    let all: Vec<usize> = (0..actor.joints.len()).collect();
    let (Ok(thought), Ok(figure)) = (believed.figure(robot, actor, &all), real.figure(robot, actor, &all)) else {
        return Ok(());
    };
    let around = [believed, real].map(|stage| Surroundings::of(stage, robot));
    let as_thought = Exact::of(believed, robot, &thought, &around[0]);
    let exact = Exact::of(real, robot, &figure, &around[1]);
    let rim = Rim::of(real, robot, entry)?;
    for (at, moved) in looked_at(actor, performed) {
        if let Some(text) = rim.as_ref().and_then(|rim| rim.met(&moved)) {
            return Err(Stray { at, failure: "collision", text });
        }
        let q = &moved.joints;
        if exact.is_free(q) {
            continue;
        }
        let known = as_thought.touches(q, &|_, _| false);
        let links = figure.links() as u32;
        let is_new = |c: &Contact| {
            let outside =
                matches!(c.other, Other::Body(_)) || matches!(c.other, Other::Link(l) if l.max(c.link) >= links);
            let same = known.iter().find(|k| (k.link, &k.other) == (c.link, &c.other));
            outside && same.is_none_or(|k| c.depth > k.depth + DEEPER)
        };
        let met: Vec<Contact> = exact.touches(q, &|_, _| false).into_iter().filter(is_new).collect();
        if met.is_empty() {
            continue;
        }
        let Refused::Collides(meeting) = real.meeting(&figure, &around[1], &met, at == 0.0) else { continue };
        let held = real.held(robot);
        let goal = motion.goal().map(|(goal, _)| real.whole(goal));
        let hits_goal = held.is_none() && goal.is_some() && goal == meeting.with.map(|with| real.whole(with));
        let mut text = format!(
            "`{}` of `{}` goes {} into {} at {}",
            meeting.mine,
            real.scene.get(robot).name,
            mm(meeting.depth),
            meeting.whom(),
            meeting.place()
        );
        for id in meeting.with.into_iter().chain(held) {
            let far = apart(believed.pose(id).position, real.pose(id).position);
            if is_elsewhere(&believed.pose(id), &real.pose(id)) {
                text.push_str(&format!("; `{}` is {} from its assumed place", real.scene.get(id).name, mm(far)));
            }
        }
        return Err(Stray { at, failure: if hits_goal { "missed" } else { "collision" }, text });
    }
    Ok(())
}

/// The moments of a motion that are looked at, s since it began, with the robot as it is then.
fn looked_at(actor: &Actor, performed: &Performed) -> impl Iterator<Item = (f64, Actor)> {
    let lasts = performed.duration();
    let steps = (lasts / OFTEN).ceil().max(1.0) as u32;
    let mut last: Option<Vec<f64>> = None;
    (0..=steps).filter_map(move |step| {
        let at = lasts * f64::from(step) / f64::from(steps);
        let mut moved = actor.clone();
        performed.bring(&mut moved, at);
        let far = |last: &Vec<f64>| last.iter().zip(&moved.joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let skip = step < steps && last.as_ref().is_some_and(|last| far(last) < FINE / 2.0);
        if skip {
            return None;
        }
        last = Some(moved.joints.clone());
        Some((at, moved))
    })
}

/// The rim of a hole that is too narrow for what comes to it as it does.
struct Rim<'s> {
    /// The hole in the lab.
    hole: Pose,
    depth: f64,
    foot: Pose,
    /// In the hand.
    inner: Pose,
    text: String,
    real: &'s Stage<'s>,
    robot: InstanceId,
}

impl<'s> Rim<'s> {
    fn of(real: &'s Stage<'_>, robot: InstanceId, entry: Option<&Entry>) -> Result<Option<Self>, Stray> {
        let (Some(entry), Some(item)) = (entry, real.held(robot)) else { return Ok(None) };
        if entry.off <= SAME || entry.room.is_some_and(|room| entry.off <= room) {
            return Ok(None);
        }
        let (name, hole) = (&real.scene.get(item).name, &real.scene.get(entry.hole).name);
        let Some(room) = entry.room else {
            return Err(not_modelled(format!(
                "`{name}` reaches `{hole}` {} off its middle, and their shapes do not tell if it fits",
                mm(entry.off)
            )));
        };
        let text = format!(
            "`{name}` hits the rim of `{hole}`: it is {} off the middle of the hole, which leaves {} on either side",
            mm(entry.off),
            mm(room.max(0.0))
        );
        let inner = real.tip(robot).inverse().then(real.pose(item));
        let (hole, foot) = (real.pose(entry.hole), real.foot(robot));
        Ok(Some(Rim { hole, depth: entry.depth, foot, inner, text, real, robot }))
    }

    /// What happens, where the hand has come below the rim.
    fn met(&self, moved: &Actor) -> Option<String> {
        // A base that drives goes up to a hole and does not lower anything into it.
        let still =
            self.real.actors.get(&self.robot).is_some_and(|a| a.positions(&a.drive) == moved.positions(&moved.drive));
        let tip = self.foot.then(matterix_motion::placement(&moved.chain.tip(&moved.configuration())));
        let base = self.hole.inverse().point(tip.then(self.inner).position);
        (still && base[2] < self.depth).then(|| self.text.clone())
    }
}

/// What is poured, or drawn and given by a gantry, must still meet the mouth that it is meant for.
fn aimed([believed, real]: [&Stage<'_>; 2], motion: &Motion, performed: &Performed) -> Result<(), Stray> {
    let gantry = real.actors.get(&performed.robot).is_some_and(Actor::is_gantry);
    let (from, failure) = match motion {
        Motion::Tilted { about: (item, _), .. } => (Some(*item), "spilled"),
        Motion::To { .. } if gantry => (None, "missed"),
        _ => return Ok(()),
    };
    let Some((goal, _)) = motion.goal() else { return Ok(()) };
    let drift = |id: InstanceId| {
        let (a, b) = (believed.pose(id).position, real.pose(id).position);
        [0, 1, 2].map(|k| b[k] - a[k])
    };
    let (theirs, mine) = (drift(goal), from.map_or([0.0; 3], drift));
    let far = (theirs[0] - mine[0]).hypot(theirs[1] - mine[1]);
    if far <= SAME {
        return Ok(());
    }
    let name = &real.scene.get(goal).name;
    let Some(mouth) = real.scene.get(goal).body().mouth() else {
        return Err(not_modelled(format!("`{name}` is {} from its assumed place, and its mouth is unknown", mm(far))));
    };
    if far <= mouth / 2.0 {
        return Ok(());
    }
    let text = format!("it arrives {} off the middle of `{name}`, whose mouth is {} wide", mm(far), mm(mouth));
    Err(Stray { at: performed.duration(), failure, text })
}
