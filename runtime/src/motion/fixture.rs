//! Things with parts that move as the model says: lids, sashes, knobs; and hands that take such parts along.

use std::sync::Arc;

use matterix_ir::plan::Motion;
use matterix_ir::pose::Pose;
use matterix_ir::robot::{JointKind, Robot};
use matterix_ir::scene::{Articulation, Follow, InstanceId, Scene};
use matterix_ir::{NodeId, Op, Program};
use matterix_motion::Tree;

use super::moment::Moment;
use super::performed::Performed;
use super::refused::Refused;
use super::regrip::may_help;
use super::stage::Stage;

/// Least change of a joint that is worth telling, rad or m.
const LEAST: f64 = 1e-6;
/// How far apart in time a part in hand is looked at for its speed, s.
const BESIDE: f64 = 1e-3;
/// Greatest turn or way of a part between two straight pieces of the hand's way, rad or m.
const PIECE: f64 = 0.05;

/// A thing with joints that follow the model, and how they stand.
#[derive(Clone, Debug)]
pub struct Fixture {
    /// Every link; shared by all copies of a stage.
    pub tree: Arc<Tree>,
    /// Positions of all that moves, rad or m.
    pub joints: Vec<f64>,
}

/// A part that a hand takes along.
#[derive(Clone, Debug, PartialEq)]
pub struct Led {
    /// What it is a part of.
    pub(super) item: InstanceId,
    /// Which of its joints moves.
    pub(super) variable: usize,
    /// Where that was at first, rad or m.
    pub(super) from: f64,
    /// Along its axis instead of about it.
    slides: bool,
    /// The axis in the lab.
    axis: [f64; 3],
    /// Where the hand was at first.
    hand: Pose,
    /// When it is taken along, s since the motion began.
    pub(super) since: f64,
}

/// A link of a thing by which a hand leads it, and the joint that carries the link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handle {
    link: u32,
    variable: usize,
    slides: bool,
    axis: [f64; 3],
}

impl Led {
    /// The same, so much later, s.
    pub(super) fn later(self, by: f64) -> Self {
        Led { since: self.since + by, ..self }
    }
}

/// The description of a thing whose joints follow the model.
pub fn following(scene: &Scene, id: InstanceId) -> Option<&Articulation> {
    scene.instances.get(id.0 as usize)?.articulation.as_deref().filter(|a| !a.follows.is_empty())
}

/// The value of a node when a run begins; not a number where it depends on what is only known later.
pub fn initial(program: &Program, node: NodeId) -> f64 {
    let model = &program.model;
    let given = |leaf: Op| match leaf {
        Op::Const(v) => v,
        Op::Param(i) => model.params.get(i as usize).map_or(f64::NAN, |p| p.value),
        Op::Time => 0.0,
        _ => f64::NAN,
    };
    model.graph.eval_on(node, |leaf| match leaf {
        Op::State(i) => model.states.get(i as usize).map_or(f64::NAN, |s| model.graph.eval_on(s.initial, given)),
        other => given(other),
    })
}

impl Fixture {
    /// Joints as a description has them at first.
    pub fn new(articulation: &Articulation) -> Result<Self, String> {
        let tree = Tree::new(&articulation.robot).map_err(|why| why.to_string())?;
        Ok(Fixture { tree: Arc::new(tree), joints: articulation.home.clone() })
    }

    /// The links, relative to the thing.
    pub fn links(&self) -> Vec<Pose> {
        self.tree.poses(&self.joints).iter().map(matterix_motion::placement).collect()
    }
}

impl Stage<'_> {
    /// Where a link of a thing is, relative to the thing.
    pub fn link(&self, id: InstanceId, link: u32) -> Pose {
        let links = match (self.fixtures.get(&id), self.actors.get(&id)) {
            (Some(fixture), _) => fixture.links(),
            (_, Some(actor)) => actor.tree.poses(&actor.joints).iter().map(matterix_motion::placement).collect(),
            _ => return Pose::IDENTITY,
        };
        links.get(link as usize).copied().unwrap_or_default()
    }

    /// Joints stand where the model says from now on, as far as `value` knows it. Gives what moved, and how it stood.
    pub fn follow_joints(&mut self, value: impl Fn(NodeId) -> Option<f64>) -> Vec<(InstanceId, Vec<f64>)> {
        let mut moved = Vec::new();
        let scene = self.scene;
        for (id, fixture) in self.fixtures.iter_mut().filter(|(id, _)| !self.led.contains(id)) {
            let before = fixture.joints.clone();
            for Follow { variable, position } in following(scene, *id).iter().flat_map(|a| &a.follows) {
                let (Some(slot), Some(value)) = (fixture.joints.get_mut(*variable as usize), value(*position)) else {
                    continue;
                };
                // Many steps that are not worth telling come to one that is.
                if value.is_finite() && (value - *slot).abs() > LEAST {
                    *slot = value;
                }
            }
            if before != fixture.joints {
                moved.push((*id, before));
            }
        }
        moved
    }

    /// How things that moved by themselves get from where they were to where they are, from moment to moment: speeding
    /// up and slowing down evenly.
    pub fn swings(&self, moved: &[(InstanceId, Vec<f64>)], begin: f64, lasts: f64, apart: f64) -> Vec<Moment> {
        let mut stage = self.clone();
        let steps = (lasts / apart).ceil().max(1.0) as u32;
        let mut out = Vec::new();
        for (id, before) in moved {
            let Some(after) = self.fixtures.get(id).map(|f| f.joints.clone()) else { continue };
            for step in 0..=steps {
                let share = f64::from(step) / f64::from(steps);
                // The fifth-order polynomial without speed and acceleration at both ends.
                let eased = share * share * share * (10.0 + share * (6.0 * share - 15.0));
                let speed = 30.0 * (share * (1.0 - share)).powi(2);
                let acceleration = 60.0 * share * (1.0 + share * (2.0 * share - 3.0));
                // What is there at once has no speed that could be told.
                let rush = |by: f64| {
                    if lasts > 0.0 { [by * speed / lasts, by * acceleration / (lasts * lasts)] } else { [0.0; 2] }
                };
                if let Some(fixture) = stage.fixtures.get_mut(id) {
                    fixture.joints = before.iter().zip(&after).map(|(a, b)| a + (b - a) * eased).collect();
                }
                let rushing: Vec<(usize, [f64; 2])> =
                    before.iter().zip(&after).map(|(a, b)| rush(b - a)).enumerate().collect();
                out.extend(stage.moment(*id, begin + lasts * share).map(|moment| moment.rushing(&rushing)));
            }
        }
        out
    }

    /// How things that laws moved got from where they were at one time to where they are at another one: evenly, as these times are near.
    pub fn glides(&self, moved: &[(InstanceId, Vec<f64>)], from: f64, to: f64) -> Vec<Moment> {
        let mut stage = self.clone();
        let mut out = Vec::new();
        for (id, before) in moved {
            let Some(after) = self.fixtures.get(id).map(|f| f.joints.clone()) else { continue };
            let speed = |(a, b): (&f64, &f64)| if to > from { [(b - a) / (to - from), 0.0] } else { [0.0; 2] };
            let rushing: Vec<(usize, [f64; 2])> = before.iter().zip(&after).map(speed).enumerate().collect();
            for (time, joints) in [(from, before), (to, &after)] {
                if let Some(fixture) = stage.fixtures.get_mut(id) {
                    fixture.joints.clone_from(joints);
                }
                out.extend(stage.moment(*id, time).map(|moment| moment.rushing(&rushing)));
            }
        }
        out
    }

    /// The nodes of the model that say how joints of things stand.
    pub fn followed(&self) -> impl Iterator<Item = NodeId> + '_ {
        let all = self.fixtures.keys().filter_map(|id| following(self.scene, *id));
        all.flat_map(|articulation| articulation.follows.iter().map(|follow| follow.position))
    }

    /// The joint that carries a link: which of those that move by themselves.
    fn carrying(robot: &Robot, link: u32) -> Option<(usize, &matterix_ir::robot::Joint)> {
        let mut moving = robot.joints.iter().filter(|j| j.kind != JointKind::Fixed && j.mimic.is_none()).enumerate();
        moving.find(|(_, j)| j.child == link)
    }

    /// Where the model has the joint that a motion takes along.
    pub fn led_by(&self, motion: &Motion) -> Option<NodeId> {
        let Motion::Lead { item, frame, .. } = motion else { return None };
        let articulation = following(self.scene, *item)?;
        let link = self.scene.get(*item).frames.iter().find(|f| f.name == *frame)?.link?;
        let (variable, _) = Self::carrying(&articulation.robot, link)?;
        articulation.follows.iter().find(|f| f.variable as usize == variable).map(|f| f.position)
    }

    /// A hand takes a part of a thing by a frame on it to where its joint stands at `to`, rad or m.
    pub(super) fn lead(
        &mut self,
        robot: InstanceId,
        item: InstanceId,
        frame: &str,
        to: f64,
    ) -> Result<Performed, Refused> {
        let place = self.scene.get(item).frames.iter().find(|f| f.name == frame).ok_or(Refused::NoFrame)?;
        let articulation = following(self.scene, item).ok_or(Refused::NoFrame)?;
        let link = place.link.ok_or(Refused::NoFrame)?;
        let (variable, joint) = Self::carrying(&articulation.robot, link).ok_or(Refused::NoFrame)?;
        let handle = Handle { link, variable, slides: joint.kind == JointKind::Prismatic, axis: joint.axis };
        let before = self.clone();
        match self.lead_from(robot, item, &handle, to) {
            Err(why) if may_help(&why) => {
                self.back_to(&before);
                self.lead_anew(robot, (item, frame), &handle, to).ok_or(why)
            }
            done => done,
        }
    }

    /// As [`Stage::lead`], from where the hand is.
    pub(super) fn lead_from(
        &mut self,
        robot: InstanceId,
        item: InstanceId,
        handle: &Handle,
        to: f64,
    ) -> Result<Performed, Refused> {
        let Handle { link, variable, slides, axis } = *handle;
        let from = self.fixtures.get(&item).and_then(|f| f.joints.get(variable).copied()).ok_or(Refused::NoFrame)?;
        let hand = self.tip(robot);
        let start = self.pose(item).then(self.link(item, link));
        let inner = start.inverse().then(hand);
        let turned = Pose { position: [0.0; 3], ..start };
        let led = Led { item, variable, from, slides, axis: turned.point(axis), hand, since: 0.0 };
        let pieces = if slides { 1 } else { ((to - from).abs() / PIECE).ceil().max(1.0) as u32 };
        let mut stage = self.clone();
        let way: Vec<Pose> = (1..=pieces)
            .map(|k| {
                stage.set_joint(item, variable, from + (to - from) * f64::from(k) / f64::from(pieces));
                stage.pose(item).then(stage.link(item, link)).then(inner)
            })
            .collect();
        let before = self.clone();
        let part = self.lines(robot, &way, &[item], false)?;
        if let Some(refused) = before.lead_meets(robot, &led, to, &part) {
            return Err(refused);
        }
        self.set_joint(item, variable, to);
        self.led.insert(item);
        Ok(Performed { robot, parts: vec![part], led: Some(led) })
    }

    /// A motion has ended: what it took along follows the model again.
    pub fn let_go(&mut self, motion: Option<&Motion>) {
        if let Some(Motion::Lead { item, .. }) = motion {
            self.led.remove(item);
        }
    }

    pub(super) fn set_joint(&mut self, item: InstanceId, variable: usize, to: f64) {
        if let Some(slot) = self.fixtures.get_mut(&item).and_then(|f| f.joints.get_mut(variable)) {
            *slot = to;
        }
    }

    /// A part that is taken along is where the hand has it.
    pub(super) fn dragged(&mut self, led: &Led, robot: InstanceId) -> InstanceId {
        let hand = self.tip(robot);
        let along = |v: [f64; 3]| v.iter().zip(led.axis).map(|(a, b)| a * b).sum::<f64>();
        let moved = if led.slides {
            along([0, 1, 2].map(|k| hand.position[k] - led.hand.position[k]))
        } else {
            let [x, y, z, w] = hand.then(led.hand.inverse()).rotation;
            2.0 * matterix_ir::math::atan2(along([x, y, z]), w)
        };
        let turn = std::f64::consts::TAU;
        let before =
            self.fixtures.get(&led.item).and_then(|f| f.joints.get(led.variable)).map_or(0.0, |q| q - led.from);
        // Of more than half a turn the hand tells all but whole turns.
        let moved = if led.slides { moved } else { moved + turn * ((before - moved) / turn).round() };
        self.set_joint(led.item, led.variable, led.from + moved);
        led.item
    }

    /// How fast a part goes that a hand takes along, and how that changes, at a time since the motion began, s: per s and s2. It rests at both
    /// ends.
    pub(super) fn dragged_at(&self, led: &Led, performed: &Performed, since: f64) -> [f64; 2] {
        let (robot, end) = (performed.robot, performed.duration());
        if since - BESIDE < led.since || since + BESIDE > end {
            return [0.0; 2];
        }
        let mut stage = self.clone();
        let mut at = |time: f64| {
            if let Some(actor) = stage.actors.get_mut(&robot) {
                performed.bring(actor, time);
            }
            stage.dragged(led, robot);
            stage.fixtures.get(&led.item).and_then(|f| f.joints.get(led.variable)).copied().unwrap_or_default()
        };
        let [before, now, after] = [since - BESIDE, since, since + BESIDE].map(&mut at);
        [(after - before) / (2.0 * BESIDE), (after - 2.0 * now + before) / (BESIDE * BESIDE)]
    }

    /// As it was when a hand began to take it along.
    pub(super) fn undrag(&mut self, led: &Led) {
        self.set_joint(led.item, led.variable, led.from);
    }
}
