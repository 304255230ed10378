//! Where everything is while robots move: what stands on what, what is in hand, how joints stand.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hasher;
use std::sync::{Arc, OnceLock};

use matterix_ir::Program;
use matterix_ir::model::{Domain, State};
use matterix_ir::pose::Pose;
use matterix_ir::robot::Robot;
use matterix_ir::scene::{InstanceId, Scene, Stand, frame};
use matterix_motion::inverse::Solver;
use matterix_motion::touching::always_touching;
use matterix_motion::{Chain, Tree};
use matterix_solids::Body;
use serde::{Deserialize, Serialize};

use super::assembly::{Assembly, assemble};
use super::carried::{Carried, Carrying, write_number, write_stand};
use super::figures::Figures;
use super::fingers::Fingers;
use super::fixture::{Fixture, following, initial};
use super::flight::Flight;
use super::pace::Burden;
use super::slosh::{Tables, Wave};
use super::tempo::Tempo;

/// A robot and how it stands. What stays the same is shared by all copies of a stage.
#[derive(Clone, Debug)]
pub struct Actor {
    /// All of it.
    pub assembly: Arc<Assembly>,
    /// Every link.
    pub tree: Arc<Tree>,
    /// From the link it reaches from to what is brought to a goal.
    pub chain: Arc<Chain>,
    /// Positions of all that moves, rad or m.
    pub joints: Vec<f64>,
    /// Indices into `joints` of those that move the tip.
    pub arm: Vec<usize>,
    /// What opens and closes its gripper.
    pub fingers: Option<Arc<Fingers>>,
    /// Of those that drive it about.
    pub drive: Vec<usize>,
    /// Shared by all copies of a stage.
    to_plan: Arc<OnceLock<Robot>>,
    bodies: Arc<OnceLock<Vec<Option<Body>>>>,
}

/// The lab at one moment.
#[derive(Clone, Debug)]
pub struct Stage<'p> {
    /// What there is.
    pub scene: &'p Scene,
    /// By instance.
    pub carried: Carrying,
    /// Where things stood before they were picked up.
    pub(super) before: BTreeMap<InstanceId, Stand>,
    /// By instance.
    pub actors: BTreeMap<InstanceId, Actor>,
    /// Things with parts that move as the model says.
    pub fixtures: BTreeMap<InstanceId, Fixture>,
    /// What each robot has let go and not yet drawn back from.
    freed: BTreeMap<InstanceId, InstanceId>,
    /// Configurations along the straight line on which a robot came to where it is.
    pub(super) came: BTreeMap<InstanceId, Vec<Vec<f64>>>,
    /// Things whose parts hands are moving.
    pub(super) led: BTreeSet<InstanceId>,
    /// What a second robot grips as well, with that robot.
    pub(super) shared: BTreeMap<InstanceId, InstanceId>,
    /// s since the run began.
    pub(super) now: f64,
    /// Robots that are under way.
    pub(super) flights: BTreeMap<InstanceId, Flight>,
    /// Whether ways are planned around all that robots under way sweep.
    pub(super) around_sweeps: bool,
    /// Whether ways count as not found after few samples: it is only tried what would be.
    pub(super) hasty: bool,
    /// How often something was moved so far.
    pub(super) changes: u64,
    /// How much may still be looked at for the motion that is being planned.
    pub(super) effort: Cell<u64>,
    /// What cannot be told: empty in a run.
    pub unknown: Unknown,
    /// What is known of things in hand.
    pub(super) burdens: BTreeMap<InstanceId, Burden>,
    /// How fast robots are meant to go, where that is slower than they can.
    pub(super) tempi: BTreeMap<InstanceId, Tempo>,
    /// The waves that motions left in what was carried, each with when that was, s.
    pub(super) waves: BTreeMap<InstanceId, (Wave, f64)>,
    /// The waves with which the last motions of what is carried began.
    pub(super) began: BTreeMap<InstanceId, Wave>,
    /// Shared by all copies of a stage.
    pub(super) figures: Figures,
    /// Shared by all copies of a stage.
    pub(super) tilts: Tables,
    /// Shared by all copies of a stage.
    bodies: Arc<OnceLock<Vec<Option<Body>>>>,
}

/// What is not known of a lab at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unknown {
    /// Things of which it is not known where they are on what carries them.
    pub places: BTreeSet<InstanceId>,
    /// Robots of which it is not known how their joints stand.
    pub postures: BTreeSet<InstanceId>,
}

impl<'p> Stage<'p> {
    /// The lab when the run begins. Robots whose description cannot be moved are named.
    pub fn new(program: &'p Program) -> Result<Self, String> {
        let scene = &program.scene;
        let (mut actors, mut fixtures) = (BTreeMap::new(), BTreeMap::new());
        for (index, instance) in scene.instances.iter().enumerate() {
            let id = InstanceId(index as u32);
            let wrong = |why: String| format!("`{}` cannot be moved: {why}", instance.name);
            if let Some(articulation) = following(scene, id) {
                fixtures.insert(id, Fixture::new(articulation).map_err(wrong)?);
                continue;
            }
            let carries = |o: InstanceId| scene.get(o).articulation.is_some() && following(scene, o).is_none();
            let mounted = instance.owner.is_some_and(carries);
            if instance.articulation.is_none() || mounted {
                continue;
            }
            let Some(assembly) = assemble(scene, id) else { continue };
            actors.insert(id, Actor::new(assembly).map_err(wrong)?);
        }
        let mut stage = Stage { actors, fixtures, ..Stage::still(scene) };
        stage.follow_joints(|node| Some(initial(program, node)));
        Ok(stage)
    }

    /// A lab in which nothing moves by itself.
    pub fn still(scene: &'p Scene) -> Self {
        Stage {
            scene,
            carried: Carrying::at_first(scene),
            before: BTreeMap::new(),
            actors: BTreeMap::new(),
            fixtures: BTreeMap::new(),
            freed: BTreeMap::new(),
            came: BTreeMap::new(),
            led: BTreeSet::new(),
            shared: BTreeMap::new(),
            now: 0.0,
            flights: BTreeMap::new(),
            around_sweeps: false,
            hasty: false,
            changes: 0,
            effort: Cell::default(),
            unknown: Unknown::default(),
            burdens: BTreeMap::new(),
            tempi: BTreeMap::new(),
            waves: BTreeMap::new(),
            began: BTreeMap::new(),
            figures: Figures::default(),
            tilts: Tables::default(),
            bodies: Arc::default(),
        }
    }

    /// The true shapes of all instances, made when they are first asked for.
    pub fn bodies(&self) -> &[Option<Body>] {
        self.bodies.get_or_init(|| super::exact::bodies(self.scene))
    }

    /// The robot an instance is or is part of.
    pub fn actor_of(&self, mut id: InstanceId) -> Option<InstanceId> {
        loop {
            if self.actors.contains_key(&id) {
                return Some(id);
            }
            id = self.scene.get(id).owner?;
        }
    }

    /// The robot that holds what an instance carries: the instance is that robot, or a tool mounted on it.
    pub fn hand_of(&self, id: InstanceId) -> Option<InstanceId> {
        self.actor_of(id).filter(|robot| *robot == id || self.scene.get(id).articulation.is_some())
    }

    /// Things whose links move, with their descriptions.
    pub fn movers(&self) -> impl Iterator<Item = (InstanceId, &Robot, &Tree)> {
        let robots = self.actors.iter().map(|(id, actor)| (*id, &actor.assembly.robot, &*actor.tree));
        let fixtures = self.fixtures.iter().filter_map(|(id, fixture)| {
            following(self.scene, *id).map(|articulation| (*id, &articulation.robot, &*fixture.tree))
        });
        robots.chain(fixtures)
    }

    /// Where an instance is in the lab.
    pub fn pose(&self, id: InstanceId) -> Pose {
        self.scene.in_lab_on(id, |id| self.stand(id), |id| self.top(id))
    }

    /// Where something is put down on an instance, relative to it.
    fn top(&self, id: InstanceId) -> Pose {
        let place = self.scene.get(id).frames.iter().find(|f| f.name == frame::PLACE);
        let link = place.and_then(|f| f.link).map_or(Pose::IDENTITY, |link| self.link(id, link));
        link.then(self.scene.surface(id))
    }

    /// Where the link is in the lab from which a robot's arm reaches.
    pub fn foot(&self, robot: InstanceId) -> Pose {
        let base = self.actors.get(&robot).map_or(0, |actor| actor.assembly.base);
        let own = self.pose(robot);
        if base == 0 { own } else { own.then(self.link(robot, base)) }
    }

    /// Where a thing stands; what is in hand, in the lab.
    fn stand(&self, id: InstanceId) -> Option<Stand> {
        Some(match self.carried.get(id.0 as usize)? {
            Carried::Stands(Stand::PartOf(owner, inner)) => {
                let link = self.scene.get(id).link.map_or(Pose::IDENTITY, |link| self.link(*owner, link));
                Stand::PartOf(*owner, link.then(*inner))
            }
            Carried::Stands(stand) => *stand,
            Carried::Held(by, inner) => Stand::Lab(self.tip(*by).then(*inner)),
        })
    }

    /// Where something is put down on an instance, in the lab.
    pub fn surface(&self, id: InstanceId) -> Pose {
        self.pose(id).then(self.top(id))
    }

    /// Where the tip of a robot is in the lab.
    pub fn tip(&self, robot: InstanceId) -> Pose {
        let Some(actor) = self.actors.get(&robot) else { return self.pose(robot) };
        let tip = matterix_motion::placement(&actor.chain.tip(&actor.configuration()));
        self.foot(robot).then(tip)
    }

    /// A named point of an instance in the lab; the instance itself for an empty name.
    pub fn frame(&self, id: InstanceId, name: &str) -> Option<Pose> {
        if name.is_empty() {
            return Some(self.pose(id));
        }
        let found = self.scene.get(id).frames.iter().find(|f| f.name == name)?;
        let base = if found.stand { self.stood(id) } else { self.pose(id) };
        let base = found.link.map_or(base, |link| base.then(self.link(id, link)));
        Some(base.then(found.pose))
    }

    /// Whether a frame is given in where its thing last stood.
    pub fn is_stand(&self, id: InstanceId, name: &str) -> bool {
        self.scene.get(id).frames.iter().any(|f| f.name == name && f.stand)
    }

    /// Where a thing stood before it was picked up; where it is, if it never was.
    fn stood(&self, id: InstanceId) -> Pose {
        let before = self.before.get(&id);
        let stand = |i: InstanceId| before.filter(|_| i == id).copied().or_else(|| self.stand(i));
        self.scene.in_lab_on(id, stand, |id| self.top(id))
    }

    /// A thing stands somewhere on a surface from now on.
    pub fn put(&mut self, id: InstanceId, on: InstanceId, at: Pose) {
        if self.carried.set(id, Carried::Stands(Stand::On(on, at))).is_some() {
            self.changes += 1;
        }
    }

    /// A thing is somewhere in the lab, and what bears it there takes it along.
    pub fn lies(&mut self, id: InstanceId, at: Pose, on: Option<InstanceId>) {
        self.carried.set(id, Carried::Stands(Stand::Lab(at)));
        self.carry(id, on.filter(|on| self.hand_of(*on).is_none()));
    }

    /// A thing is so in a hand that has it already.
    pub fn lies_in_hand(&mut self, id: InstanceId, at: Pose) {
        if let Some(Carried::Held(by, _)) = self.carried.get(id.0 as usize).copied() {
            let inner = self.tip(by).inverse().then(at);
            self.carried.set(id, Carried::Held(by, inner));
            self.changes += 1;
        }
    }

    /// Whether a state names an instance and is of a robot: what it holds.
    pub fn is_of_a_robot(&self, state: &State) -> bool {
        let owner = state.name.rsplit_once('.').and_then(|(owner, _)| self.scene.find(owner));
        state.domain == Domain::Instance && owner.is_some_and(|owner| self.actor_of(owner).is_some())
    }

    /// A robot has stopped on its way with its joints so.
    pub fn stops(&mut self, robot: InstanceId, joints: &[f64]) {
        self.flights.remove(&robot);
        self.came.remove(&robot);
        self.changes += 1;
        if let Some(actor) = self.actors.get_mut(&robot) {
            actor.joints.clear();
            actor.joints.extend_from_slice(joints);
        }
    }

    /// What a thing stood on before it was picked up, or else stands on.
    pub fn stood_on(&self, id: InstanceId) -> Option<InstanceId> {
        match (self.before.get(&id), self.carried.get(id.0 as usize)) {
            (Some(stand), _) | (None, Some(Carried::Stands(stand))) => stand.below(),
            _ => None,
        }
    }

    /// What carries a thing, and what carries that, down to the floor.
    pub fn carriers(&self, id: InstanceId) -> Vec<InstanceId> {
        let mut out = Vec::new();
        let mut next = id;
        while let Some(below) = self.below(next).filter(|b| !out.contains(b)) {
            out.push(below);
            next = below;
        }
        out
    }

    /// What a thing stands on or is part of, or the robot that holds it.
    pub fn below(&self, id: InstanceId) -> Option<InstanceId> {
        match self.carried.get(id.0 as usize)? {
            Carried::Stands(stand) => stand.below(),
            Carried::Held(by, _) => Some(*by),
        }
    }

    /// What a thing stands on or is part of; nothing where a robot holds it.
    pub fn stand_of(&self, id: InstanceId) -> Option<InstanceId> {
        match self.carried.get(id.0 as usize)? {
            Carried::Stands(stand) => stand.below(),
            Carried::Held(..) => None,
        }
    }

    /// An instance, and what [`Stage::carriers`] gives; over and over where things carry each other, which ends as well.
    fn down(&self, id: InstanceId) -> impl Iterator<Item = InstanceId> {
        std::iter::successors(Some(id), |id| self.below(*id)).take(self.carried.len() + 1)
    }

    /// Whether it cannot be told where an instance is in the lab.
    pub fn is_unknown(&self, id: InstanceId) -> bool {
        let here = |i: InstanceId| {
            let in_hand = matches!(self.carried.get(i.0 as usize), Some(Carried::Held(by, _)) if self.unknown.postures.contains(by));
            in_hand || self.unknown.places.contains(&i)
        };
        self.down(id).any(here)
    }

    /// Whether it cannot be told where a frame of an instance is in the lab.
    pub fn is_frame_unknown(&self, id: InstanceId, frame: &str) -> bool {
        match self.is_stand(id, frame) {
            true => self.unknown.places.contains(&id) || self.stood_on(id).is_some_and(|on| self.is_unknown(on)),
            false => self.is_unknown(id),
        }
    }

    /// Whether a robot stands on a thing, or on what it carries: it cannot take that in its hand.
    pub fn stands_on(&self, robot: InstanceId, id: InstanceId) -> bool {
        self.down(robot).any(|below| below == id)
    }

    /// A robot's gripper still stands about what it has let go.
    pub fn freed(&mut self, robot: InstanceId, item: InstanceId) {
        self.freed.insert(robot, item);
    }

    /// What a robot's gripper still stands about.
    pub fn just_freed(&self, robot: InstanceId) -> Option<InstanceId> {
        self.freed.get(&robot).copied()
    }

    /// A robot goes away from what it let go.
    pub fn leave(&mut self, robot: InstanceId) {
        self.freed.remove(&robot);
    }

    /// The robot that holds an instance, or something it is part of or stands on.
    pub fn held_by(&self, id: InstanceId) -> Option<InstanceId> {
        self.down(id).find_map(|i| match self.carried.get(i.0 as usize)? {
            Carried::Held(by, _) => Some(*by),
            Carried::Stands(_) => None,
        })
    }

    /// What an instance is a part of, parts of parts included; itself where it is of nothing.
    pub fn whole(&self, id: InstanceId) -> InstanceId {
        self.scene.whole(id)
    }

    /// Whether an instance is one of these or part of one.
    pub fn is_in_any(&self, mut id: InstanceId, these: &[InstanceId]) -> bool {
        loop {
            if these.contains(&id) {
                return true;
            }
            match self.scene.get(id).owner {
                Some(owner) => id = owner,
                None => return false,
            }
        }
    }

    /// Whether a thing, and all that carries it, is where it was when the run began.
    pub fn is_where_it_was(&self, id: InstanceId) -> bool {
        self.down(id).all(|id| !self.carried.is_moved(id))
    }

    /// What an instance is part of, and what that is part of.
    pub fn owners(&self, id: InstanceId) -> Vec<InstanceId> {
        std::iter::successors(self.scene.get(id).owner, |id| self.scene.get(*id).owner).collect()
    }

    /// Whether what it is part of has a shape, of which it is taken to be a part.
    pub fn is_inside_a_shape(&self, id: InstanceId) -> bool {
        let owner = self.scene.get(id).owner;
        owner.is_some_and(|o| self.scene.get(o).shape.is_some() || self.is_inside_a_shape(o))
    }

    /// The robot that holds a thing.
    pub fn holder(&self, id: InstanceId) -> Option<InstanceId> {
        match self.carried.get(id.0 as usize)? {
            Carried::Held(by, _) => Some(*by),
            Carried::Stands(_) => None,
        }
    }

    /// What a robot holds.
    pub fn held(&self, robot: InstanceId) -> Option<InstanceId> {
        let holds = |c: &Carried| matches!(c, Carried::Held(by, _) if *by == robot);
        self.carried.iter().position(holds).map(|i| InstanceId(i as u32))
    }

    /// A thing is carried by something else from now on, without moving: a robot takes it, or it is put down. What would
    /// have to carry itself stays where it is.
    pub fn carry(&mut self, id: InstanceId, by: Option<InstanceId>) {
        if by.is_some_and(|by| self.stands_on(by, id)) {
            return;
        }
        let now = self.pose(id);
        let Some(old) = self.carried.get(id.0 as usize).copied() else { return };
        let new = match by {
            None => Carried::Stands(Stand::Lab(now)),
            Some(by) => match self.hand_of(by) {
                Some(robot) => Carried::Held(robot, self.tip(robot).inverse().then(now)),
                None => Carried::Stands(Stand::On(by, self.surface(by).inverse().then(now))),
            },
        };
        if let (Carried::Held(..), Carried::Stands(old)) = (new, old) {
            // From a stopover it goes back to where it stood before that.
            let passing = old.below().is_some_and(|on| self.scene.get(on).stopover);
            let stood = if passing { self.before.get(&id).copied().or(self.carried.stood_at_first(id)) } else { None };
            self.before.insert(id, stood.unwrap_or(old));
        }
        self.carried.set(id, new);
        self.changes += 1;
    }
}

/// What tells one moment of a lab from another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    carried: Vec<(InstanceId, Carried)>,
    joints: Vec<(InstanceId, Vec<f64>)>,
    parts: Vec<(InstanceId, Vec<f64>)>,
    led: Vec<(InstanceId, bool)>,
    tools: Vec<(InstanceId, u32)>,
    freed: Vec<(InstanceId, Option<InstanceId>)>,
    came: Vec<(InstanceId, Option<Vec<Vec<f64>>>)>,
}

impl Stage<'_> {
    /// What became different since an earlier moment, in what a motion can change.
    pub fn since(&self, before: &Stage<'_>) -> Change {
        let moved = self.actors.iter().filter(|(id, a)| before.actors.get(id).is_none_or(|b| a.joints != b.joints));
        let freed = |id: &&InstanceId| self.freed.get(id) != before.freed.get(id);
        let came = |id: &&InstanceId| self.came.get(id) != before.came.get(id);
        let swung = self.fixtures.iter().filter(|(id, a)| before.fixtures.get(id).is_none_or(|b| a.joints != b.joints));
        let tool =
            |(id, a): &(&InstanceId, &Actor)| before.actors.get(id).is_none_or(|b| a.assembly.tip != b.assembly.tip);
        Change {
            parts: swung.map(|(id, f)| (*id, f.joints.clone())).collect(),
            led: self.led.symmetric_difference(&before.led).map(|id| (*id, self.led.contains(id))).collect(),
            tools: self.actors.iter().filter(tool).map(|(id, a)| (*id, a.assembly.tip)).collect(),
            carried: self.carried.since(&before.carried),
            joints: moved.map(|(id, a)| (*id, a.joints.clone())).collect(),
            came: self.actors.keys().filter(came).map(|id| (*id, self.came.get(id).cloned())).collect(),
            freed: self.actors.keys().filter(freed).map(|id| (*id, self.freed.get(id).copied())).collect(),
        }
    }

    /// Makes a change that has been seen before from the same moment. `None` where it is not of this lab.
    pub fn change(&mut self, change: &Change) -> Option<()> {
        for (id, carried) in &change.carried {
            self.carried.set(*id, *carried)?;
        }
        for (robot, link) in &change.tools {
            self.take_link(*robot, *link).ok()?;
        }
        for (id, joints) in &change.parts {
            let fixture = self.fixtures.get_mut(id).filter(|f| f.joints.len() == joints.len())?;
            fixture.joints.clone_from(joints);
        }
        for (id, led) in &change.led {
            match led {
                true => self.led.insert(*id),
                false => self.led.remove(id),
            };
        }
        for (id, joints) in &change.joints {
            let actor = self.actors.get_mut(id).filter(|a| a.joints.len() == joints.len())?;
            actor.joints.clone_from(joints);
        }
        for (robot, came) in &change.came {
            match came {
                Some(came) => self.came.insert(*robot, came.clone()),
                None => self.came.remove(robot),
            };
        }
        for (robot, item) in &change.freed {
            match item {
                Some(item) => self.freed.insert(*robot, *item),
                None => self.freed.remove(robot),
            };
        }
        Some(())
    }

    /// Feeds all that tells this moment from others of the same lab to a hash; with `coarse`, figures that differ by
    /// less than that (m, rad) mostly count as the same.
    pub fn digest(&self, coarse: Option<f64>, hash: &mut impl Hasher) {
        let Stage { carried, before, actors, fixtures, freed, came, led, shared, unknown, .. } = self;
        carried.digest(coarse, hash);
        for (id, s) in before {
            hash.write_u64(u64::from(id.0) | 2 << 32);
            write_stand(hash, s, coarse);
        }
        for (id, actor) in actors {
            hash.write_u64(u64::from(id.0) | 3 << 32);
            hash.write_u32(actor.assembly.tip);
            actor.joints.iter().for_each(|v| write_number(hash, *v, coarse));
        }
        for (id, fixture) in fixtures {
            hash.write_u64(u64::from(id.0) | 4 << 32 | u64::from(led.contains(id)) << 40);
            fixture.joints.iter().for_each(|v| write_number(hash, *v, coarse));
        }
        for (a, b) in freed.iter().chain([(&InstanceId(u32::MAX), &InstanceId(u32::MAX))]).chain(shared) {
            hash.write_u64(u64::from(a.0) << 32 | u64::from(b.0));
        }
        // Courses that end alike count as one whichever way they came.
        for (id, points) in came.iter().filter(|_| coarse.is_none()) {
            hash.write_u64(u64::from(id.0) | 5 << 32);
            points.iter().flatten().for_each(|v| write_number(hash, *v, None));
        }
        hash.write_u64(u64::MAX);
        unknown.places.iter().for_each(|id| hash.write_u32(id.0));
        hash.write_u64(u64::MAX);
        unknown.postures.iter().for_each(|id| hash.write_u32(id.0));
    }
}

impl Actor {
    fn new(assembly: Assembly) -> Result<Self, String> {
        let tree = Tree::new(&assembly.robot).map_err(|why| why.to_string())?;
        let chain = Chain::new(&assembly.robot, assembly.base, assembly.tip).map_err(|why| why.to_string())?;
        let drive = Chain::new(&assembly.robot, 0, assembly.base).map_err(|why| why.to_string())?;
        let joint = |v: &matterix_motion::Variable| v.joint;
        let all: Vec<u32> = tree.variables().iter().map(joint).collect();
        let which = |chain: &Chain| -> Vec<usize> {
            chain.variables().iter().filter_map(|v| all.iter().position(|j| *j == v.joint)).collect()
        };
        let (arm, drive) = (which(&chain), which(&drive));
        let joints = assembly.home.clone();
        let fingers = Fingers::of(&assembly, &tree, &arm).map(Arc::new);
        let (assembly, tree, chain) = (Arc::new(assembly), Arc::new(tree), Arc::new(chain));
        let (to_plan, bodies) = (Arc::default(), Arc::default());
        Ok(Actor { assembly, tree, chain, joints, arm, fingers, drive, to_plan, bodies })
    }

    /// The robot as planning needs it: with the links that are always in touch, found when it is first asked for, as
    /// pictures and recordings do without.
    pub fn to_plan(&self) -> &Robot {
        self.to_plan.get_or_init(|| {
            let mut robot = self.assembly.robot.clone();
            robot.touching.extend(always_touching(&robot).unwrap_or_default());
            robot
        })
    }

    /// The true shapes of its links, made when they are first asked for.
    pub fn bodies(&self) -> &[Option<Body>] {
        self.bodies.get_or_init(|| Body::of_links(&self.assembly.robot))
    }

    /// Whether its tool is described: a link other than the one that carries tools, or joints beside those that move the tip.
    pub fn has_tool(&self) -> bool {
        self.assembly.tip != self.assembly.flange || self.arm.len() < self.joints.len()
    }

    /// What finds postures that bring its tip to a pose.
    pub fn solver(&self) -> Solver {
        Solver::new(Chain::clone(&self.chain))
    }

    /// The positions of the joints that move the tip.
    pub fn configuration(&self) -> Vec<f64> {
        self.positions(&self.arm)
    }

    /// The positions of some joints.
    pub fn positions(&self, variables: &[usize]) -> Vec<f64> {
        variables.iter().filter_map(|i| self.joints.get(*i)).copied().collect()
    }

    /// Moves some of its joints.
    pub fn set_some(&mut self, joints: &[usize], to: &[f64]) {
        for (index, value) in joints.iter().zip(to) {
            if let Some(joint) = self.joints.get_mut(*index) {
                *joint = *value;
            }
        }
    }
}
