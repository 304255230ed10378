//! Where something has room that is in another thing where it stands.

use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand};

use super::may_meet;
use super::solid::Solids;
use crate::motion::carried::Carried;
use crate::motion::outline::Outline;
use crate::motion::perturb::{LEVEL, pieces};
use crate::motion::stage::Stage;

/// Places are given to this, m.
const ROUND: f64 = 0.01;
/// How far from where it stands a thing is offered a place, m.
const FARTHEST: f64 = 0.6;
/// How far it is from everything there, m.
const CLEAR: f64 = 0.005;

/// Where a thing would be free, in words: in another place of the same kind, or on the same surface; the nearest.
pub fn offer(stage: &Stage<'_>, solids: &Solids<'_, '_>, thing: InstanceId) -> Option<String> {
    let Carried::Stands(stand) = *stage.carried.get(thing.0 as usize)? else { return None };
    match stand {
        Stand::On(on, at) if is_one_of_many(stage, on) => place(stage, solids, thing, on, at),
        Stand::On(on, at) => beside(stage, solids, thing, Some(on), at),
        Stand::Lab(at) => beside(stage, solids, thing, None, at),
        Stand::PartOf(..) => None,
    }
}

/// Places like this one: parts of the same thing, of the same kind.
fn alike<'s>(stage: &'s Stage<'_>, on: InstanceId) -> impl Iterator<Item = InstanceId> + 's {
    let own = stage.scene.get(on);
    let each = stage.scene.instances.iter().enumerate();
    each.filter(move |(_, i)| i.owner.is_some() && i.owner == own.owner && i.kind == own.kind)
        .map(|(index, _)| InstanceId(index as u32))
}

fn is_one_of_many(stage: &Stage<'_>, on: InstanceId) -> bool {
    alike(stage, on).nth(1).is_some()
}

/// In its own place of several, if it is not in the middle of that, or in another one where nothing stands.
fn place(stage: &Stage<'_>, solids: &Solids<'_, '_>, thing: InstanceId, on: InstanceId, at: Pose) -> Option<String> {
    let now = stage.pose(thing);
    let shift = |place: InstanceId| {
        let there = stage.surface(place).position;
        [0, 1, 2].map(|k| there[k] - now.position[k])
    };
    if at != Pose::IDENTITY && is_free(stage, solids, thing, shift(on), 0.0) {
        let (name, slot) = (&stage.scene.get(thing).name, &stage.scene.get(on).name);
        return Some(format!("without `at`, `{name}` is in the middle of `{slot}` and overlaps nothing"));
    }
    let taken = |place: InstanceId| {
        let mut things = (0..stage.carried.len() as u32).map(InstanceId).filter(|id| *id != thing);
        things.any(|id| stage.stand_of(id) == Some(place) && stage.scene.get(id).owner.is_none())
    };
    let mut free: Vec<(f64, InstanceId)> = alike(stage, on)
        .filter(|place| *place != on && !taken(*place) && !stage.is_unknown(*place))
        .map(|place| (shift(place).iter().map(|d| d * d).sum(), place))
        .collect();
    free.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let found = free.into_iter().find(|(_, place)| is_free(stage, solids, thing, shift(*place), 0.0));
    found.map(|(_, place)| format!("`{}` is free", stage.scene.get(place).name))
}

/// On the same surface, or in the lab, at round figures.
fn beside(
    stage: &Stage<'_>,
    solids: &Solids<'_, '_>,
    thing: InstanceId,
    on: Option<InstanceId>,
    at: Pose,
) -> Option<String> {
    let base = on.map_or(Pose::IDENTITY, |on| stage.surface(on));
    let feet = pieces(stage, thing);
    let tops: Vec<Outline> = on.map(|on| pieces(stage, on)).unwrap_or_default();
    let level = base.position[2];
    let tops: Vec<Outline> = tops.into_iter().filter(|top| (top.height[1] - level).abs() <= LEVEL).collect();
    let borne = |shift: [f64; 2]| {
        let moved = |foot: &Outline| foot.moved([0.0; 2], shift, 0.0);
        tops.is_empty() || feet.iter().map(moved).all(|foot| tops.iter().any(|top| top.covers(&foot)))
    };
    let [x, y, z] = at.position;
    let steps = (FARTHEST / ROUND) as i32;
    let round = |v: f64, step: i32| ((v / ROUND).round() + f64::from(step)) * ROUND;
    let mut places: Vec<(f64, [f64; 2])> = (-steps..=steps)
        .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
        .map(|(i, j)| [round(x, i), round(y, j)])
        .map(|[px, py]| ((px - x).hypot(py - y), [px, py]))
        .filter(|(far, _)| *far <= FARTHEST)
        .collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let origin = base.point(at.position);
    let free = places.into_iter().find(|(_, [px, py])| {
        let there = base.point([*px, *py, z]);
        let shift = [0, 1, 2].map(|k| there[k] - origin[k]);
        borne([shift[0], shift[1]]) && is_free(stage, solids, thing, shift, CLEAR)
    });
    let (_, [px, py]) = free?;
    let name = &stage.scene.get(thing).name;
    let [px, py, z] = [px, py, z].map(|m| (m * 1e3).round() + 0.0);
    Some(match on {
        Some(on) => format!("`{name}` has room at ({px}, {py}) mm on `{}`", stage.scene.get(on).name),
        None => format!("`{name}` has room at ({px}, {py}, {z}) mm"),
    })
}

/// Whether a thing, moved by this with all that it carries, is clear of everything else.
fn is_free(stage: &Stage<'_>, solids: &Solids<'_, '_>, thing: InstanceId, shift: [f64; 3], clear: f64) -> bool {
    let goes = |id: &InstanceId| *id == thing || stage.carriers(*id).contains(&thing);
    let others: Vec<InstanceId> = solids.things().filter(|id| !goes(id)).collect();
    let meets =
        |id: InstanceId, other: &InstanceId| may_meet(stage, id, *other) && solids.is_near(id, *other, shift, clear);
    solids.things().filter(goes).all(|id| !others.iter().any(|other| meets(id, other)))
}
