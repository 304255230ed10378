//! Parts that move by themselves: a lid must not swing into an arm, nor into what stands in its way.

use std::borrow::Cow;

use matterix_ir::scene::InstanceId;
use matterix_motion::placement;
use matterix_solids::{Body, Isometry, isometry};

use super::fixture::{Fixture, following};
use super::refused::Meeting;
use super::stage::Stage;

/// Greatest change of a joint between two moments that are looked at, rad or m.
const STEP: f64 = 0.02;
/// How far true shapes may reach into each other, m: dimensions are nominal.
const NOMINAL: f64 = 2e-3;

/// A body that a part may swing into.
pub(super) struct Near<'s> {
    of: InstanceId,
    /// The link, of a robot or of another thing with joints.
    part: Option<&'s str>,
    at: Isometry,
    body: Cow<'s, Body>,
}

/// A body that moves as joints of a thing do: a link, or what such a link carries.
pub(super) struct Mover<'s> {
    /// The link; of what one carries, its name.
    name: &'s str,
    what: Moves,
    body: Cow<'s, Body>,
}

enum Moves {
    Link(usize),
    Rider(InstanceId),
}

/// Where bodies touch: which mover, which body around, how deep, m, and where.
pub(super) type Touches = Vec<(usize, usize, f64, [f64; 3])>;

impl Stage<'_> {
    /// What parts of things run into on the way from where their joints stood to where they stand now, with the thing: the
    /// first that is met.
    pub fn swing_meets(&self, moved: &[(InstanceId, Vec<f64>)]) -> Option<(InstanceId, Meeting)> {
        moved.iter().filter(|(id, _)| !self.is_unknown(*id)).find_map(|(id, before)| {
            let near = self.near_to(*id, None);
            Some((*id, self.swung(*id, before, &near)?))
        })
    }

    fn swung(&self, id: InstanceId, before: &[f64], near: &[Near<'_>]) -> Option<Meeting> {
        let after = &self.fixtures.get(&id)?.joints;
        let mut stage = self.clone();
        let movers = self.movers_of(id, before);
        // What rides along is no obstacle.
        let near: Vec<&Near<'_>> = near.iter().filter(|n| !n.rides(&movers)).collect();
        let far = before.iter().zip(after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let steps = (far / STEP).ceil().clamp(1.0, 1e4) as u32;
        let mut touches = |step: u32| {
            let share = f64::from(step) / f64::from(steps);
            if let Some(fixture) = stage.fixtures.get_mut(&id) {
                fixture.joints = before.iter().zip(after).map(|(a, b)| a + share * (b - a)).collect();
            }
            stage.touches(id, &movers, &near)
        };
        let first = touches(0);
        (1..=steps).find_map(|step| self.met(&first, touches(step), &movers, &near))
    }

    /// The links of a thing that move with its joints, from where those stood, and what stands on such links.
    pub(super) fn movers_of(&self, id: InstanceId, before: &[f64]) -> Vec<Mover<'_>> {
        let Some(articulation) = following(self.scene, id) else { return Vec::new() };
        let bodies = Body::of_links(&articulation.robot).into_iter().enumerate();
        let names = articulation.robot.links.iter().map(|l| l.name.as_str());
        let link = |((link, body), name): ((usize, Option<Body>), _)| {
            Some(Mover { name, what: Moves::Link(link), body: Cow::Owned(body?) })
        };
        let mut out: Vec<Mover<'_>> = bodies.zip(names).filter_map(link).collect();
        let mut stood = self.clone();
        if let Some(fixture) = stood.fixtures.get_mut(&id) {
            fixture.joints = before.to_vec();
        }
        for (index, instance) in self.scene.instances.iter().enumerate() {
            let rider = InstanceId(index as u32);
            let Some(body) = self.bodies().get(index).and_then(Option::as_ref) else { continue };
            let rides = self.carriers(rider).contains(&id) && !self.is_unknown(rider);
            if rides && stood.pose(rider) != self.pose(rider) {
                out.push(Mover { name: &instance.name, what: Moves::Rider(rider), body: Cow::Borrowed(body) });
            }
        }
        out
    }

    /// Where movers of a thing touch what is around, as its joints stand now.
    pub(super) fn touches(&self, id: InstanceId, movers: &[Mover<'_>], near: &[&Near<'_>]) -> Touches {
        let (base, mut out) = (self.pose(id), Vec::new());
        let links = self.fixtures.get(&id).map(Fixture::links).unwrap_or_default();
        for (which, mover) in movers.iter().enumerate() {
            let at = match mover.what {
                Moves::Link(link) => base.then(links.get(link).copied().unwrap_or_default()),
                Moves::Rider(rider) => self.pose(rider),
            };
            let at = isometry(&at);
            for (index, other) in near.iter().enumerate() {
                if let Some(touch) = mover.body.touch(&at, &other.body, &other.at, 0.0) {
                    out.push((which, index, -touch.distance, touch.point));
                }
            }
        }
        out
    }

    /// The deepest touch that counts; what a mover is in before it moves, it may leave.
    pub(super) fn met(
        &self,
        first: &Touches,
        now: Touches,
        movers: &[Mover<'_>],
        near: &[&Near<'_>],
    ) -> Option<Meeting> {
        let known = |m: usize, i: usize| first.iter().find(|f| (f.0, f.1) == (m, i)).map_or(0.0, |f| f.2);
        let counts = |m: usize, i: usize, depth: f64| {
            let known = known(m, i);
            // What is no touch yet is none to begin with, however slowly it comes.
            depth > NOMINAL + if known > NOMINAL { known } else { 0.0 }
        };
        let met = now.into_iter().filter(|(m, i, depth, _)| counts(*m, *i, *depth));
        let (mover, index, depth, at) = met.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let other = near.get(index)?;
        Some(Meeting {
            mine: movers.get(mover).map(|m| m.name.to_string()).unwrap_or_default(),
            other: self.scene.get(other.of).name.clone(),
            part: other.part.map(str::to_string),
            with: Some(other.of),
            at,
            depth,
            before: false,
            end: false,
        })
    }

    /// All bodies around a thing that are known to be somewhere, but for those of which it is a part, and for a robot with
    /// what it holds.
    pub(super) fn near_to(&self, id: InstanceId, but: Option<InstanceId>) -> Vec<Near<'_>> {
        let whole = self.whole(id);
        let mut out = Vec::new();
        for index in 0..self.scene.instances.len() {
            let of = InstanceId(index as u32);
            let left_out = but.is_some_and(|robot| self.actor_of(of) == Some(robot) || self.held_by(of) == Some(robot));
            if self.whole(of) == whole || left_out || self.is_unknown(of) {
                continue;
            }
            let base = self.pose(of);
            if let Some(actor) = self.actors.get(&of).filter(|_| !self.unknown.postures.contains(&of)) {
                let links = actor.tree.poses(&actor.joints);
                for ((link, pose), body) in actor.assembly.robot.links.iter().zip(&links).zip(actor.bodies()) {
                    let at = isometry(&base.then(placement(pose)));
                    let part = Some(link.name.as_str());
                    out.extend(body.iter().map(|body| Near { of, part, at, body: Cow::Borrowed(body) }));
                }
            }
            if let (Some(fixture), Some(own)) = (self.fixtures.get(&of), following(self.scene, of)) {
                for ((link, pose), body) in own.robot.links.iter().zip(fixture.links()).zip(Body::of_links(&own.robot))
                {
                    let at = isometry(&base.then(pose));
                    let part = Some(link.name.as_str());
                    out.extend(body.map(|body| Near { of, part, at, body: Cow::Owned(body) }));
                }
            }
            let body = self.bodies().get(index).and_then(Option::as_ref);
            let at = isometry(&base);
            out.extend(body.map(|body| Near { of, part: None, at, body: Cow::Borrowed(body) }));
        }
        out
    }
}

impl Near<'_> {
    /// Whether it is carried along.
    pub(super) fn rides(&self, movers: &[Mover<'_>]) -> bool {
        movers.iter().any(|mover| matches!(mover.what, Moves::Rider(rider) if rider == self.of))
    }
}
