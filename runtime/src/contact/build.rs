//! A world of bodies from a lab: what stands fixed, what robots are made of, what is loose.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use matterix_contact::{Finger, Grip, Id, Kind, Thing, World};
use matterix_ir::pose::Pose;
use matterix_ir::robot::{Inertial, Joint, JointKind};
use matterix_ir::scene::{InstanceId, frame};
use matterix_motion::placement;
use matterix_solids::Body;

use super::{Hand, Loose, Machine, Matter, Really};
use crate::motion::{Actor, Carried, Stage};

/// What is not known to slide does not.
const STICKS: f64 = 10.0;
/// The mass, kg, and its moments, kg m2, of a finger whose description names none: small beside what moves it.
const FINGER: Inertial = Inertial { mass: 0.03, placement: Pose::IDENTITY, inertia: [1e-5, 0.0, 0.0, 1e-5, 0.0, 1e-5] };

struct Builder<'s, 'p> {
    stage: &'s Stage<'p>,
    really: Really,
    world: World,
    /// What each body of the world is, and which link of it.
    names: Vec<(Option<InstanceId>, Option<String>)>,
    /// The bodies of each instance.
    ids: BTreeMap<InstanceId, Vec<Id>>,
    unknown: BTreeSet<InstanceId>,
}

impl<'p> Matter<'p> {
    /// A lab with things where they are, really so strong and so rough. What cannot be modelled is said.
    pub fn new(stage: &Stage<'p>, really: Really) -> Result<Self, String> {
        if let Some(carrier) = stage.scene.carriers.first() {
            let name = &stage.scene.get(carrier.by).name;
            return Err(format!(
                "`{name}` carries things without a grip, such as tips: this is not modelled with `--fidelity contact`"
            ));
        }
        let (world, names, ids, unknown) = (World::new(), Vec::new(), BTreeMap::new(), BTreeSet::new());
        let mut builder = Builder { stage, really, world, names, ids, unknown };
        let floor = builder.world.floor(STICKS);
        builder.name(floor, None, None);
        let loose = builder.things();
        let mut machines = BTreeMap::new();
        for (robot, actor) in &stage.actors {
            machines.insert(*robot, builder.robot(*robot, actor)?);
        }
        builder.pairs();
        let fixtures = builder.fixtures();
        let Builder { world, names, unknown, .. } = builder;
        let all: Vec<InstanceId> = loose.keys().copied().collect();
        let mut matter = Matter {
            scene: stage.scene,
            world,
            names,
            loose,
            machines,
            fixtures,
            event: None,
            moments: Vec::new(),
            sightings: Vec::new(),
            unknown,
            shown: 0,
        };
        all.into_iter().for_each(|id| matter.settle(id));
        Ok(matter)
    }
}

impl Builder<'_, '_> {
    fn name(&mut self, id: Id, instance: Option<InstanceId>, link: Option<String>) {
        debug_assert_eq!(id.0 as usize, self.names.len());
        self.names.push((instance, link));
        if let Some(instance) = instance {
            self.ids.entry(instance).or_default().push(id);
        }
    }

    fn friction(&mut self, id: InstanceId) -> f64 {
        let own = std::iter::successors(Some(id), |id| self.stage.scene.get(*id).owner);
        let known = own.into_iter().find_map(|id| self.stage.scene.get(id).friction);
        if known.is_none() {
            self.unknown.insert(id);
        }
        known.map_or(STICKS, |friction| friction * self.really.friction)
    }

    /// Things that stand, loose or not.
    fn things(&mut self) -> BTreeMap<InstanceId, Loose> {
        let stage = self.stage;
        let mut parts: BTreeMap<InstanceId, Vec<(InstanceId, Cow<'_, Body>)>> = BTreeMap::new();
        for index in 0..stage.scene.instances.len() as u32 {
            let id = InstanceId(index);
            let Some(body) = stage.bodies().get(index as usize).and_then(Option::as_ref) else { continue };
            // What a robot is made of beside its links stands where it stands.
            let stands = stage.actors.get(&id).is_some_and(|actor| actor.drive.is_empty());
            let is_apart = stage.actor_of(id).is_none() && !stage.is_inside_a_shape(id);
            if !stands && !is_apart {
                continue;
            }
            parts
                .entry(stage.whole(id))
                .or_default()
                .push((id, roomy(stage, id).map_or(Cow::Borrowed(body), Cow::Owned)));
        }
        let mut loose = BTreeMap::new();
        for (whole, parts) in parts {
            let (at, friction) = (stage.pose(whole), self.friction(whole));
            let inertial = stage.scene.get(whole).inertial.filter(|_| is_loose(stage, whole));
            let back = at.inverse();
            let felt: Vec<InstanceId> = parts.iter().map(|(id, _)| *id).collect();
            let parts = parts.iter().map(|(id, body)| (back.then(stage.pose(*id)), &**body)).collect();
            let kind = inertial.map_or(Kind::Fixed, Kind::Loose);
            let felt: Vec<(Pose, Option<Body>)> = match inertial {
                Some(_) => felt.iter().map(|id| (back.then(stage.pose(*id)), outside(stage, *id))).collect(),
                None => Vec::new(),
            };
            let outside = felt.iter().filter_map(|(at, body)| Some((*at, body.as_ref()?))).collect();
            let id = self.world.add(&Thing { parts, outside, at, kind, friction, bounce: 0.0, robot: false });
            self.name(id, Some(whole), None);
            if let Some(inertial) = inertial {
                loose.insert(whole, Loose { body: id, empty: inertial, now: inertial, rests: at, base: None });
            }
        }
        for (id, thing) in &mut loose {
            thing.base = stage.below(*id).map(|below| stage.whole(below));
        }
        loose
    }

    /// Links of things that the model moves.
    fn fixtures(&mut self) -> BTreeMap<InstanceId, Vec<(usize, Id)>> {
        let stage = self.stage;
        let mut out = BTreeMap::new();
        for (id, robot, _) in stage.movers().filter(|(id, ..)| stage.fixtures.contains_key(id)) {
            let Some(fixture) = stage.fixtures.get(&id) else { continue };
            let (base, friction) = (stage.pose(id), self.friction(id));
            let mut links = Vec::new();
            for (link, (at, body)) in fixture.links().into_iter().zip(Body::of_links(robot)).enumerate() {
                let Some(body) = body else { continue };
                let parts = vec![(Pose::IDENTITY, &body)];
                let thing = Thing {
                    parts,
                    outside: Vec::new(),
                    at: base.then(at),
                    kind: Kind::Led,
                    friction,
                    bounce: 0.0,
                    robot: false,
                };
                let body = self.world.add(&thing);
                self.name(body, Some(id), robot.links.get(link).map(|l| l.name.clone()));
                links.push((link, body));
            }
            out.insert(id, links);
        }
        out
    }

    fn robot(&mut self, robot: InstanceId, actor: &Actor) -> Result<Machine, String> {
        let (stage, whole) = (self.stage, &actor.assembly.robot);
        let base = stage.pose(robot);
        let poses = actor.tree.poses(&actor.joints);
        let slides = slides(stage, robot, actor)?;
        let mut links = Vec::new();
        let mut fingers = Vec::new();
        for (link, (pose, body)) in poses.iter().zip(actor.bodies()).enumerate() {
            let owner = actor.assembly.owners.get(link).copied().unwrap_or(robot);
            let slide = slides.iter().flatten().find(|slide| slide.joint.child as usize == link);
            let hand = slides.iter().flatten().any(|slide| slide.joint.parent as usize == link);
            if body.is_none() && slide.is_none() && !hand {
                continue;
            }
            let parts = body.iter().map(|body| (Pose::IDENTITY, body)).collect();
            let at = base.then(placement(pose));
            let kind = match slide {
                Some(_) => Kind::Loose(whole.links[link].inertial.unwrap_or(FINGER)),
                None => Kind::Led,
            };
            let friction = self.friction(owner);
            let id =
                self.world.add(&Thing { parts, outside: Vec::new(), at, kind, friction, bounce: 0.0, robot: true });
            self.name(id, Some(owner), whole.links.get(link).map(|l| l.name.clone()));
            match slide {
                Some(slide) => fingers.push((id, slide)),
                None => links.push((link, id)),
            }
        }
        let hand = match (slides.as_ref(), fingers.as_slice()) {
            (Some(all), [one, other]) => self.hand(actor, all, [one.0, other.0], &links),
            _ => None,
        };
        Ok(Machine { base, actor: actor.clone(), links, hand, underway: None, held: None })
    }

    fn hand(&mut self, actor: &Actor, slides: &[Slide; 2], bodies: [Id; 2], links: &[(usize, Id)]) -> Option<Hand> {
        let tool = actor.assembly.owners.get(slides[0].joint.child as usize).copied()?;
        let carrier = links.iter().find(|(link, _)| *link == slides[0].joint.parent as usize)?.1;
        let force = self.stage.scene.get(tool).force.map(|force| force * self.really.grip);
        let fingers = actor.fingers.as_ref()?;
        let [closed, open] = fingers.span()?;
        let sign = if open >= closed { 1.0 } else { -1.0 };
        let range = [closed * sign, open * sign];
        let finger = |k: usize| {
            let Slide { joint, sign, at } = &slides[k];
            let axis = joint.axis.map(|a| a * sign);
            Finger { body: bodies[k], origin: joint.origin, axis, at: *at, range }
        };
        // A gripper of which it is not said how hard it presses holds whatever it lifts.
        let force = force.unwrap_or(STRONG);
        let first = fingers.joints.first().and_then(|i| actor.tree.variables().get(*i))?;
        let speed = first.limits.velocity;
        let grip = self.world.gripper(Grip { hand: carrier, fingers: [finger(0), finger(1)], force, speed })?;
        let joints = fingers.joints.clone();
        let [closed, open] = range;
        Some(Hand { grip, fingers: bodies, joints, sign, closed, open, to: slides[0].at, goes: None, force })
    }

    /// Friction between pairs that the lab gives.
    fn pairs(&mut self) {
        for friction in &self.stage.scene.frictions {
            let [a, b] = friction.between.map(|id| self.ids.get(&id).cloned().unwrap_or_default());
            for one in &a {
                b.iter()
                    .for_each(|other| self.world.between(*one, *other, friction.coefficient * self.really.friction));
            }
        }
    }
}

/// What a finger presses with where that is not known, N.
const STRONG: f64 = 500.0;

/// A finger that slides: its joint, which way along its axis it opens, and where it is, m.
struct Slide {
    joint: Joint,
    sign: f64,
    at: f64,
}

/// The two sliding fingers of a gripper; none where it has no fingers that move.
fn slides(stage: &Stage<'_>, robot: InstanceId, actor: &Actor) -> Result<Option<[Slide; 2]>, String> {
    let Some(fingers) = actor.fingers.as_ref() else { return Ok(None) };
    let whole = &actor.assembly.robot;
    let variables: Vec<u32> = actor.tree.variables().iter().map(|v| v.joint).collect();
    let own: Vec<u32> = fingers.joints.iter().filter_map(|i| variables.get(*i).copied()).collect();
    let position = |index: u32| variables.iter().position(|j| *j == index).and_then(|i| actor.joints.get(i).copied());
    let sign = fingers.span().map_or(1.0, |[closed, open]| if open >= closed { 1.0 } else { -1.0 });
    let mut out = Vec::new();
    for (index, joint) in whole.joints.iter().enumerate().skip(actor.assembly.tools as usize - 1) {
        let index = index as u32;
        let (leader, times, offset) = match joint.mimic {
            Some(mimic) => (mimic.joint, mimic.multiplier, mimic.offset),
            None => (index, 1.0, 0.0),
        };
        if joint.kind == JointKind::Fixed || !own.contains(&leader) {
            continue;
        }
        let even = times.abs() == 1.0 && offset == 0.0;
        let (JointKind::Prismatic, true, Some(at)) = (joint.kind, even, position(leader)) else {
            let name = &stage.scene.get(robot).name;
            return Err(format!(
                "the finger joint `{}` of `{name}` does not slide when its gripper closes: `--fidelity contact` models only grippers with two sliding fingers",
                joint.name
            ));
        };
        out.push(Slide { joint: joint.clone(), sign: sign * times, at: at * sign });
    }
    match <[Slide; 2]>::try_from(out) {
        Ok(two) if two[0].joint.parent == two[1].joint.parent => Ok(Some(two)),
        _ => Err(format!(
            "`{}` does not have two fingers on one hand: `--fidelity contact` models no other grippers",
            stage.scene.get(robot).name
        )),
    }
}

/// A thing as fingers feel it.
fn outside(stage: &Stage<'_>, id: InstanceId) -> Option<Body> {
    let instance = stage.scene.get(id);
    Body::outside(instance.hull().chain(instance.more()))
}

/// The body of a thing with holes, none of them narrower than it is.
fn roomy(stage: &Stage<'_>, id: InstanceId) -> Option<Body> {
    let instance = stage.scene.get(id);
    let rooms = stage.scene.rooms(id);
    if rooms.is_empty() || !instance.collision.is_empty() {
        return None;
    }
    Body::with_wide_rooms(instance.solid(), &instance.solids, &rooms)
}

/// Whether a thing is moved by forces: it can be gripped, is a part of nothing and stands or is held somewhere.
fn is_loose(stage: &Stage<'_>, id: InstanceId) -> bool {
    let instance = stage.scene.get(id);
    let can_be_gripped = instance.frames.iter().any(|f| f.name == frame::GRASP);
    let carried = stage.carried.get(id.0 as usize);
    can_be_gripped
        && instance.owner.is_none()
        && instance.articulation.is_none()
        && !matches!(carried, Some(Carried::Held(..)) | None)
}
