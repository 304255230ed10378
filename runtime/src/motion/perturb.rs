//! Labs as they might be set up: what can be gripped and stands freely is a little away from its place.

use matterix_ir::Program;
use matterix_ir::pose::Pose;
use matterix_ir::scene::{InstanceId, Stand, frame};

use super::carried::Carried;
use super::outline::Outline;
use super::stage::Stage;
use crate::backend::noise::{key, mix, uniform};

/// How far apart a place and the top of a shape may be for the thing to stand on that shape, m.
pub(super) const LEVEL: f64 = 1e-3;
/// Places drawn for one thing before it counts as having no room.
const ATTEMPTS: u64 = 2000;
/// Sets these numbers apart from the noise of readings.
const STREAM: u64 = 0x706C_6163_6573;

/// How far things are moved, each way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Perturbation {
    /// Along x and along y of what they stand on, m.
    pub shift: f64,
    /// About the vertical, rad.
    pub turn: f64,
}

/// A thing that was moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// The thing.
    pub thing: InstanceId,
    /// Along x and y of what it stands on, m.
    pub shift: [f64; 2],
    /// About the vertical, rad.
    pub turn: f64,
}

/// Moves everything loose, one thing after the other: none off what it stands on or into something it is clear of now.
/// Loose is what can be gripped and stands on the flat top of something that is in the lab by itself; what stands in the
/// place of a rack or deck is held by it. The same seed gives the same lab. An error names a thing without room.
pub fn perturb(program: &mut Program, by: Perturbation, seed: u64) -> Result<Vec<Moved>, String> {
    let mut out = Vec::new();
    for index in 0..program.scene.instances.len() {
        let thing = InstanceId(index as u32);
        let Some(found) = drawn(program, thing, by, seed)? else { continue };
        let instance = &mut program.scene.instances[index];
        let turned = Pose::turned([0.0; 3], [0.0, 0.0, found.turn]);
        let [x, y, z] = instance.pose.position;
        instance.pose = Pose {
            position: [x + found.shift[0], y + found.shift[1], z],
            rotation: turned.then(Pose { position: [0.0; 3], ..instance.pose }).rotation,
        };
        out.push(found);
    }
    Ok(out)
}

/// Where a thing is moved to; nothing where it is not loose.
fn drawn(program: &Program, thing: InstanceId, by: Perturbation, seed: u64) -> Result<Option<Moved>, String> {
    let (stage, scene) = (Stage::new(program)?, &program.scene);
    let Some(top) = standing(&stage, thing) else { return Ok(None) };
    let at = stage.pose(thing).position;
    let about = [at[0], at[1]];
    let foot = pieces(&stage, thing);
    let own: Vec<Outline> = with_load(&stage, thing).into_iter().flat_map(|id| pieces(&stage, id)).collect();
    let clear: Vec<Outline> =
        others(&stage, thing).into_iter().filter(|other| own.iter().all(|piece| !piece.meets(other))).collect();
    let covered = |pieces: &[Outline]| pieces.iter().all(|piece| top.covers(piece));
    let was_covered = covered(&foot);
    // x and y of what it stands on, in the lab.
    let ahead = scene.get(thing).support.map(|on| stage.surface(on)).unwrap_or_default();
    let (origin, x) = (ahead.position, ahead.point([1.0, 0.0, 0.0]));
    let (c, s) = (x[0] - origin[0], x[1] - origin[1]);
    for attempt in 0..ATTEMPTS {
        let number = |k: u64| 2.0 * uniform(mix(key(seed ^ STREAM, thing.0 as usize, 3 * attempt + k))) - 1.0;
        // Adding 0 makes a negative zero a positive one.
        let shift = [by.shift * number(0) + 0.0, by.shift * number(1) + 0.0];
        let turn = by.turn * number(2);
        let in_lab = [c * shift[0] - s * shift[1], s * shift[0] + c * shift[1]];
        let moved = |pieces: &[Outline]| -> Vec<Outline> {
            pieces.iter().map(|piece| piece.moved(about, in_lab, turn)).collect()
        };
        let free = moved(&own).iter().all(|piece| clear.iter().all(|other| !piece.meets(other)));
        if free && (!was_covered || covered(&moved(&foot))) {
            return Ok(Some(Moved { thing, shift, turn }));
        }
    }
    let name = &scene.get(thing).name;
    Err(format!("`{name}` has no room: no place near its own keeps it on its support and clear of other things"))
}

/// The flat top that a loose thing stands on.
fn standing(stage: &Stage<'_>, thing: InstanceId) -> Option<Outline> {
    let instance = stage.scene.get(thing);
    let can_be_gripped = instance.frames.iter().any(|f| f.name == frame::GRASP);
    if instance.owner.is_some() || !can_be_gripped || instance.articulation.is_some() {
        return None;
    }
    let Carried::Stands(Stand::On(on, _)) = *stage.carried.get(thing.0 as usize)? else { return None };
    if stage.scene.get(on).owner.is_some() {
        return None;
    }
    let foot = stage.surface(on).position;
    let below = pieces(stage, on).into_iter();
    let mut tops = below.filter(|p| (p.height[1] - foot[2]).abs() <= LEVEL && p.holds([foot[0], foot[1]]));
    tops.next()
}

/// What an instance is made of, parts left out.
pub(super) fn pieces(stage: &Stage<'_>, id: InstanceId) -> Vec<Outline> {
    let instance = stage.scene.get(id);
    let at = stage.pose(id);
    if let Some(actor) = stage.actors.get(&id) {
        let links = actor.tree.poses(&actor.joints);
        let balls = actor.assembly.robot.balls.iter().filter_map(|ball| {
            let link = at.then(matterix_motion::placement(links.get(ball.link as usize)?));
            Some(Outline::ball(link.point(ball.center), ball.radius))
        });
        return balls.collect();
    }
    instance.hull().chain(instance.more()).map(|(shape, inner)| Outline::of(shape, &at.then(inner))).collect()
}

/// A thing with what is on it, parts inside a shape left out.
pub(super) fn with_load(stage: &Stage<'_>, thing: InstanceId) -> Vec<InstanceId> {
    let ids = (0..stage.scene.instances.len() as u32).map(InstanceId);
    let moves = |id: &InstanceId| *id == thing || stage.carriers(*id).contains(&thing);
    ids.filter(moves).filter(|id| !stage.is_inside_a_shape(*id)).collect()
}

/// Pieces of everything else.
pub(super) fn others(stage: &Stage<'_>, thing: InstanceId) -> Vec<Outline> {
    let mine = with_load(stage, thing);
    let ids = (0..stage.scene.instances.len() as u32).map(InstanceId);
    let apart = ids.filter(|id| !mine.contains(id) && !stage.is_inside_a_shape(*id));
    apart.flat_map(|id| pieces(stage, id)).collect()
}
