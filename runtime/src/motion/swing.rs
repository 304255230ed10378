//! Parts that move by themselves: a lid must not swing into an arm, nor into what stands in its way.

use std::borrow::Cow;

use matterix_ir::scene::InstanceId;
use matterix_motion::placement;
use matterix_solids::{Body, Isometry, isometry};

use super::fixture::following;
use super::perform::Meeting;
use super::stage::Stage;

/// Greatest change of a joint between two moments that are looked at, rad or m.
const STEP: f64 = 0.02;
/// How far true shapes may reach into each other, m: dimensions are nominal.
const NOMINAL: f64 = 2e-3;

/// A body that a part may swing into.
struct Near<'s> {
    of: InstanceId,
    /// The link, of a robot or of another thing with joints.
    part: Option<&'s str>,
    at: Isometry,
    body: Cow<'s, Body>,
}

impl Stage<'_> {
    /// What parts of things run into on the way from where their joints stood to where they stand now, with the thing: the
    /// first that is met.
    pub fn swing_meets(&self, moved: &[(InstanceId, Vec<f64>)]) -> Option<(InstanceId, Meeting)> {
        moved.iter().filter(|(id, _)| !self.is_unknown(*id)).find_map(|(id, before)| {
            let near = self.near_to(*id);
            Some((*id, self.swung(*id, before, &near)?))
        })
    }

    fn swung(&self, id: InstanceId, before: &[f64], near: &[Near<'_>]) -> Option<Meeting> {
        let (fixture, articulation) = (self.fixtures.get(&id)?, following(self.scene, id)?);
        let bodies = Body::of_links(&articulation.robot);
        let far = before.iter().zip(&fixture.joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let steps = (far / STEP).ceil().clamp(1.0, 1e4) as u32;
        let base = self.pose(id);
        let depths = |step: u32| -> Vec<(usize, usize, f64, [f64; 3])> {
            let share = f64::from(step) / f64::from(steps);
            let joints: Vec<f64> = before.iter().zip(&fixture.joints).map(|(a, b)| a + share * (b - a)).collect();
            let mut out = Vec::new();
            for (link, pose) in fixture.tree.poses(&joints).iter().enumerate() {
                let Some(body) = bodies.get(link).and_then(Option::as_ref) else { continue };
                let at = isometry(&base.then(placement(pose)));
                for (index, other) in near.iter().enumerate() {
                    if let Some(touch) = body.touch(&at, &other.body, &other.at, 0.0) {
                        out.push((link, index, -touch.distance, touch.point));
                    }
                }
            }
            out
        };
        // What a part is in before it moves, it may leave.
        let first = depths(0);
        let known = |l: usize, i: usize| first.iter().find(|f| (f.0, f.1) == (l, i)).map_or(0.0, |f| f.2.max(0.0));
        (1..=steps).find_map(|step| {
            let met = depths(step).into_iter().filter(|(l, i, depth, _)| depth - known(*l, *i) > NOMINAL);
            let (link, index, depth, at) = met.max_by(|a, b| a.2.total_cmp(&b.2))?;
            let other = near.get(index)?;
            Some(Meeting {
                mine: articulation.robot.links.get(link).map(|l| l.name.clone()).unwrap_or_default(),
                other: self.scene.get(other.of).name.clone(),
                part: other.part.map(str::to_string),
                with: Some(other.of),
                at,
                depth,
                before: false,
                end: false,
            })
        })
    }

    /// All bodies around a thing that are known to be somewhere, but for those of which it is a part.
    fn near_to(&self, id: InstanceId) -> Vec<Near<'_>> {
        let whole = self.whole(id);
        let mut out = Vec::new();
        for index in 0..self.scene.instances.len() {
            let of = InstanceId(index as u32);
            if self.whole(of) == whole || self.is_unknown(of) {
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
