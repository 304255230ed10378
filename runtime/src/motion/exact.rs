//! The narrow phase: a robot and what is around it in their true shapes, asked where balls collide.

use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::collections::BTreeSet;

use matterix_ir::scene::{InstanceId, Scene};
use matterix_motion::placement;
use matterix_motion::spheres::{Contact, Figure, Other, Referee};
use matterix_solids::{Bodies, Body, Isometry, Made, Touch, isometry};
use nalgebra::Point3;

use super::fixture::following;
use super::stage::Stage;
use super::surroundings::Surroundings;

/// How far true shapes may reach into each other before it counts, m: what stands on something touches it.
const TOUCH: f64 = 1e-3;
/// Configurations for every rad of a way: 4 mm of a point at a metre's reach.
const RESOLUTION: f64 = 250.0;

/// Robot and surroundings of one motion; put together when they are first asked about.
#[derive(Debug)]
pub struct Exact<'s> {
    stage: &'s Stage<'s>,
    robot: InstanceId,
    figure: &'s Figure,
    surroundings: &'s Surroundings,
    parts: OnceCell<Parts<'s>>,
    /// What moves and what around it met last, by index.
    last: Cell<Option<[usize; 2]>>,
}

#[derive(Debug, Default)]
struct Parts<'s> {
    /// By link, then what is held: the link it is on, where, and its body.
    mine: Vec<Option<(usize, Isometry, &'s Body)>>,
    /// Each with the index of the first solid of the surroundings that is of the same thing, or of the same link of it.
    around: Vec<(usize, Isometry, Cow<'s, Body>)>,
    /// How far what moves reaches from its origin, m.
    reach: Vec<f64>,
    /// The boxes around what is around: least and greatest corner, m.
    boxes: Vec<[[f64; 3]; 2]>,
}

impl<'s> Exact<'s> {
    /// What the balls of `figure` and the solids of `surroundings` stand for.
    pub fn of(stage: &'s Stage<'_>, robot: InstanceId, figure: &'s Figure, surroundings: &'s Surroundings) -> Self {
        Exact { stage, robot, figure, surroundings, parts: OnceCell::new(), last: Cell::new(None) }
    }

    fn parts(&self) -> &Parts<'s> {
        self.parts.get_or_init(|| self.put_together().unwrap_or_default())
    }

    fn put_together(&self) -> Option<Parts<'s>> {
        let stage = self.stage;
        let actor = stage.actors.get(&self.robot)?;
        let on_itself = |(l, body): (usize, &'s Option<Body>)| Some((l, Isometry::identity(), body.as_ref()?));
        let mut mine: Vec<_> = actor.bodies().iter().enumerate().map(on_itself).collect();
        let tip = stage.tip(self.robot).inverse();
        for held in stage.in_hand(self.robot) {
            let inner = tip.then(stage.pose(held));
            let body = stage.bodies().get(held.0 as usize)?.as_ref();
            mine.push(body.map(|body| (actor.assembly.tip as usize, isometry(&inner), body)));
        }
        let mut around = Vec::new();
        let mut seen = BTreeSet::new();
        for (mut index, id) in self.surroundings.owners.iter().enumerate().filter(|(_, id)| seen.insert(**id)) {
            let at = stage.pose(*id);
            if let Some(actor) = stage.actors.get(id).filter(|_| !stage.unknown.postures.contains(id)) {
                let links = actor.tree.poses(&actor.joints);
                let named = |name: &str| {
                    let mut all = self.surroundings.world.bodies.iter().zip(&self.surroundings.owners).skip(index);
                    all.position(|(body, owner)| owner == id && body.name == name).map_or(index, |k| index + k)
                };
                let robot = &actor.assembly.robot;
                for ((link, pose), body) in robot.links.iter().zip(&links).zip(actor.bodies()) {
                    let at = isometry(&at.then(placement(pose)));
                    around.extend(body.iter().map(|body| (named(&link.name), at, Cow::Borrowed(body))));
                }
                index = named(&stage.scene.get(*id).name);
            }
            if self.surroundings.bodiless.contains(id) {
                let body = Body::of_shapes(stage.scene.get(*id).more());
                around.extend(body.map(|body| (index, isometry(&at), Cow::Owned(body))));
                continue;
            }
            if let (Some(fixture), Some(own)) = (stage.fixtures.get(id), following(stage.scene, *id)) {
                for (link, body) in fixture.links().iter().zip(Body::of_links(&own.robot)) {
                    let at = isometry(&at.then(*link));
                    around.extend(body.map(|body| (index, at, Cow::Owned(body))));
                }
            }
            let body = stage.bodies().get(id.0 as usize).and_then(Option::as_ref);
            around.extend(body.map(|body| (index, isometry(&at), Cow::Borrowed(body))));
        }
        let reach = mine.iter().map(|mine| mine.map_or(0.0, |(.., body)| body.reach())).collect();
        let boxes = around.iter().map(|(_, at, body): &(_, _, Cow<'_, Body>)| body.bounds(at)).collect();
        Some(Parts { mine, around, reach, boxes })
    }

    /// Every touch that counts but for those that are spared, deepest first.
    pub fn touches(&self, q: &[f64], spared: &dyn Fn(u32, &Other) -> bool) -> Vec<Contact> {
        let mut out = Vec::new();
        self.look(q, |link, other, touch| {
            if !spared(link, &other) {
                out.push(Contact { link, other, point: Point3::from(touch.point), depth: -touch.distance });
            }
        });
        out.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        out
    }

    /// What moves, where it is.
    fn placed(&self, q: &[f64]) -> Vec<Option<(Isometry, &'s Body)>> {
        let links: Vec<Isometry> = self.figure.poses(q).iter().map(|p| isometry(&placement(p))).collect();
        let of = |(link, inner, body): (usize, Isometry, &'s Body)| Some((*links.get(link)? * inner, body));
        self.parts().mine.iter().map(|mine| mine.and_then(of)).collect()
    }

    /// Whether what moves reaches into something around, both by index.
    fn reaches(&self, placed: &[Option<(Isometry, &Body)>], link: usize, which: usize) -> bool {
        let (parts, Some(Some((at, body)))) = (self.parts(), placed.get(link)) else { return false };
        let (Some(reach), Some((index, other_at, other))) = (parts.reach.get(link), parts.around.get(which)) else {
            return false;
        };
        let [low, high] = parts.boxes[which];
        let middle = at.translation.to_array();
        if (0..3).any(|k| middle[k] + reach < low[k] || middle[k] - reach > high[k]) {
            return false;
        }
        let stands = self.figure.is_still(link as u32) && self.surroundings.world.beneath.contains(index);
        !stands && body.meets(at, other, other_at, TOUCH)
    }

    /// Every touch that counts.
    fn look(&self, q: &[f64], mut tell: impl FnMut(u32, Other, Touch)) {
        let (parts, placed) = (self.parts(), self.placed(q));
        let counts = |touch: Option<Touch>| touch.filter(|t| t.distance < -TOUCH);
        for (link, mine) in placed.iter().enumerate() {
            let Some((at, body)) = mine else { continue };
            let stands = self.figure.is_still(link as u32);
            for (index, other_at, other) in &parts.around {
                if stands && self.surroundings.world.beneath.contains(index) {
                    continue;
                }
                if let Some(touch) = counts(body.touch(at, other, other_at, 0.0)) {
                    tell(link as u32, Other::Body(*index), touch);
                }
            }
        }
        for [a, b] in self.figure.apart() {
            let (Some(Some((at, body))), Some(Some((other_at, other)))) =
                (placed.get(*a as usize), placed.get(*b as usize))
            else {
                continue;
            };
            if let Some(touch) = counts(body.touch(at, other, other_at, 0.0)) {
                tell(*a, Other::Link(*b), touch);
            }
        }
    }
}

impl Referee for Exact<'_> {
    fn contacts(&self, q: &[f64]) -> Vec<Contact> {
        self.touches(q, &|_, _| false)
    }

    fn is_free(&self, q: &[f64]) -> bool {
        let placed = self.placed(q);
        // What a configuration meets, the next one near it mostly meets as well.
        let last = self.last.get().filter(|[link, which]| self.reaches(&placed, *link, *which));
        if last.is_some() {
            return false;
        }
        for link in 0..placed.len() {
            if let Some(which) = (0..self.parts().around.len()).find(|which| self.reaches(&placed, link, *which)) {
                self.last.set(Some([link, which]));
                return false;
            }
        }
        let side = |link: u32| placed.get(link as usize).and_then(Option::as_ref);
        self.figure.apart().iter().all(|[a, b]| match (side(*a), side(*b)) {
            (Some((at, body)), Some((other_at, other))) => !body.meets(at, other, other_at, TOUCH),
            _ => true,
        })
    }

    fn resolution(&self) -> f64 {
        RESOLUTION
    }
}

/// The true shapes of all instances.
pub fn bodies(scene: &Scene) -> Vec<Option<Body>> {
    let mut bodies = Bodies::default();
    let each = scene.instances.iter().enumerate();
    each.map(|(index, instance)| {
        let main = instance.solid();
        // Only of a main shape is anything taken out.
        let rooms = main.map(|_| scene.rooms(InstanceId(index as u32))).unwrap_or_default();
        bodies.body(Made { main, more: &instance.solids, rooms: rooms.into(), collision: &instance.collision })
    })
    .collect()
}
