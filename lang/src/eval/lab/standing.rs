//! Whether what a lab puts somewhere stands there: on something, and not beyond its edge.

use matterix_ir::extent::Body;
use matterix_ir::footing::{LEVEL, footing, reach};
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Shape, frame};
use matterix_ir::{Diagnostic, codes};

use super::Elaborator;
use super::geometry::Geometry;

/// How far something may be from the middle of its place among several, m: clips have play, and deck and labware are
/// measured anew.
const PLAY: f64 = 5e-3;

/// How far a thing's centre of mass may be beyond what bears it, m: shapes are nominal.
const NOMINAL: f64 = 1e-3;

impl Elaborator<'_> {
    /// Reports things that stand on each other, and those that a lab puts `at` a place where nothing supports them.
    pub fn judge_standing(&mut self) {
        let ids: Vec<InstanceId> = (0..self.instances.len() as u32).map(InstanceId).collect();
        let rings: Vec<Vec<InstanceId>> = ids.iter().filter_map(|id| self.ring_of(*id)).collect();
        for ring in &rings {
            // Of all who stand in it the first one says so.
            if ring.iter().min() == ring.first() {
                self.report_ring(ring);
            }
        }
        for id in ids {
            if self.instances[id.0 as usize].at.is_none() {
                continue;
            }
            let carriers = self.borne_by(id);
            if !rings.iter().any(|ring| carriers.iter().any(|c| ring.contains(c))) && !self.judge_slot(id) {
                self.judge_place(id);
            }
        }
    }

    /// What an instance stands on, and what that stands on, the instance first.
    fn borne_by(&self, id: InstanceId) -> Vec<InstanceId> {
        let below = |id: &InstanceId| {
            let instance = &self.instances[id.0 as usize];
            instance.owner.or(instance.placed.first().map(|p| p.1))
        };
        std::iter::successors(Some(id), below).take(self.instances.len() + 1).collect()
    }

    /// What an instance stands on up to itself again, the instance first.
    fn ring_of(&self, id: InstanceId) -> Option<Vec<InstanceId>> {
        let mut carriers = self.borne_by(id);
        let again = carriers.iter().skip(1).position(|c| *c == id)?;
        carriers.truncate(again + 1);
        Some(carriers)
    }

    fn report_ring(&mut self, ring: &[InstanceId]) {
        let about = |id: &InstanceId| (self.instances[id.0 as usize].name.clone(), self.instances[id.0 as usize].span);
        let all: Vec<_> = ring.iter().map(about).collect();
        let Some(((name, span), others)) = all.split_first() else { return };
        let below: Vec<String> = others.iter().map(|(other, _)| format!("`{other}`")).collect();
        let d = Diagnostic::error(
            codes::CIRCULAR,
            *span,
            format!("`{name}` is placed on {}, and that again on `{name}`", below.join(", that on ")),
            "nothing supports them",
        );
        let last = others
            .iter()
            .fold(d, |d, (other, at)| d.because(*at, format!("`{other}` would stand on a thing that it carries")));
        self.report(last);
    }

    /// Reports a thing `at` another spot than the one that the place of several defines which it is in, such as a slot of a
    /// deck; whether it does.
    fn judge_slot(&mut self, id: InstanceId) -> bool {
        let instance = &self.instances[id.0 as usize];
        let (Some(at), Some((_, on))) = (instance.at, instance.placed.first().cloned()) else { return false };
        let [x, y, _] = instance.pose.position;
        let (name, place) = (instance.name.clone(), &self.instances[on.0 as usize]);
        if !place.one_of_many || x.hypot(y) <= PLAY {
            return false;
        }
        let (slot, whole) = (place.name.clone(), place.owner.map(|o| self.instances[o.0 as usize].name.clone()));
        // What has a body of its own, such as a shelf, may bear things anywhere.
        let Geometry { shape, room, solids, .. } = self.geometry(on);
        if shape != room || !solids.is_empty() {
            return false;
        }
        let headline = format!("`{name}` is {:.0} mm away from `{slot}`, on which it is placed", x.hypot(y) * 1e3);
        let label = "this moves it off its place";
        let d = Diagnostic::error(codes::OFF_PLACE, at, headline, label);
        self.report(match whole {
            Some(whole) => d.help(format!("remove `at`: `{slot}` already gives the position on `{whole}`")),
            None => d.help("remove `at`"),
        });
        true
    }

    /// Reports a thing whose centre of mass is beyond what bears it.
    fn judge_place(&mut self, id: InstanceId) {
        let instance = &self.instances[id.0 as usize];
        let (Some(at), Some((_, on))) = (instance.at, instance.placed.first().cloned()) else { return };
        if instance.owner.is_some() || instance.pose.position[2].abs() > LEVEL {
            return;
        }
        let (name, below) = (instance.name.clone(), self.instances[on.0 as usize].name.clone());
        let own = self.geometry(id);
        // What cannot be gripped may be fixed to something that the lab leaves out.
        if !own.frames.iter().any(|f| f.name == frame::GRASP) {
            return;
        }
        let body = Body { frames: &own.frames, shape: own.shape.as_ref(), solids: &own.solids };
        let Some(place) = self.in_lab(id, Pose::IDENTITY) else { return };
        let bearing = self.pieces(&self.borne_by(on));
        let borne = |pieces: &[(Shape, Pose)]| footing(&body, &place, pieces.iter().map(|(s, p)| (s, *p)));
        let Some(margin) = borne(&bearing).filter(|margin| *margin < -NOMINAL) else { return };
        // Something beside it may bear it as well: tables stand side by side.
        let others: Vec<InstanceId> = (0..self.instances.len() as u32)
            .map(InstanceId)
            .filter(|other| !self.borne_by(*other).contains(&id))
            .collect();
        if borne(&self.pieces(&others)).is_none_or(|margin| margin >= -NOMINAL) {
            return;
        }
        let headline = format!("`{name}` stands beyond the edge of `{below}`");
        let label = format!("its centre of mass is {:.0} mm past the edge of its support", -margin * 1e3);
        let d = Diagnostic::error(codes::UNSTABLE, at, headline, label);
        let ahead = self.place_on(on).and_then(|top| self.in_lab(on, top));
        let seen = ahead
            .map(Pose::inverse)
            .map(|back| bearing.iter().map(move |(shape, at)| (shape, back.then(*at))).collect::<Vec<_>>());
        let all = seen.and_then(|pieces| reach(0.0, pieces.into_iter()));
        self.report(match all.map(|all| all.map(|[x, y]| format!("({:.0}, {:.0}) mm", x * 1e3, y * 1e3))) {
            Some([low, high]) => d.help(format!("`{below}` extends from {low} to {high}")),
            None => d,
        });
    }

    /// How far the centre of mass of a thing that is put down on another is inside what bears it there, m; nothing where
    /// their shapes do not tell.
    pub(crate) fn footing(&mut self, thing: InstanceId, on: InstanceId) -> Option<f64> {
        let own = self.geometry(thing);
        let body = Body { frames: &own.frames, shape: own.shape.as_ref(), solids: &own.solids };
        let top = self.place_on(on)?;
        let place = self.in_lab(on, top)?;
        let bearing = self.pieces(&self.whole(on));
        footing(&body, &place, bearing.iter().map(|(shape, at)| (shape, *at)))
    }

    /// What an instance is a part of, parts of parts included; itself where it is of nothing.
    pub fn outermost(&self, mut id: InstanceId) -> InstanceId {
        while let Some(owner) = self.instances[id.0 as usize].owner {
            id = owner;
        }
        id
    }

    /// An instance and what it is a part of.
    fn whole(&self, id: InstanceId) -> Vec<InstanceId> {
        std::iter::successors(Some(id), |id| self.instances[id.0 as usize].owner).collect()
    }

    /// What of some instances others run into, in the lab; what goes with a joint is left out.
    fn pieces(&mut self, ids: &[InstanceId]) -> Vec<(Shape, Pose)> {
        let mut out = Vec::new();
        for id in ids {
            let Some(place) = self.in_lab(*id, Pose::IDENTITY) else { continue };
            let Geometry { shape, room, solids, .. } = self.geometry(*id);
            out.extend(shape.filter(|shape| Some(shape) != room.as_ref()).map(|shape| (shape, place)));
            out.extend(solids.into_iter().map(|solid| (solid.shape, place.then(solid.pose))));
        }
        out
    }
}
