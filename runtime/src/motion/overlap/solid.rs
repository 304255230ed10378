//! True shapes of all things that have a place, and the boxes around them.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::BTreeMap;

use matterix_ir::pose::Pose;
use matterix_ir::robot::{JointKind, Robot};
use matterix_ir::scene::{InstanceId, Shape};
use matterix_motion::placement;
use matterix_solids::{Body, Isometry, MESH_CELLS, Vector, isometry};

use crate::motion::fixture::following;
use crate::motion::stage::Stage;

/// By how far things may be in one another, m: two that a shift by so much along any of the axes of the lab parts only stand
/// against each other, as their shapes are nominal.
pub const NOMINAL: f64 = 2e-3;

/// What counts as a touch, m: walls of round things are prisms.
const TOUCH: f64 = 3e-4;

/// Where two things are in each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// In the lab, m.
    pub at: [f64; 3],
    /// How deep one piece is in the other, m.
    pub depth: f64,
}

/// The least and the greatest corner of the box around something in the lab, m.
pub type Bounds = [[f64; 3]; 2];

/// The bodies of a thing and of its parts, each with its place in the lab.
type Pieces<'s> = Vec<(Isometry, Cow<'s, Body>)>;

/// All that stands somewhere.
pub struct Solids<'s, 'p> {
    stage: &'s Stage<'p>,
    /// By thing that is no part of another one.
    bounds: BTreeMap<InstanceId, Bounds>,
    /// The same; put together when they are first asked for.
    pieces: OnceCell<BTreeMap<InstanceId, Pieces<'s>>>,
}

impl<'s, 'p> Solids<'s, 'p> {
    /// What of a lab has a shape and a known place.
    pub fn of(stage: &'s Stage<'p>) -> Self {
        let mut bounds = BTreeMap::new();
        for id in placed(stage) {
            let Some(around) = around(stage, id) else { continue };
            bounds.entry(stage.whole(id)).and_modify(|known| *known = merged(*known, around)).or_insert(around);
        }
        Solids { stage, bounds, pieces: OnceCell::new() }
    }

    /// Pairs of things whose boxes meet, in the order of the things.
    pub fn pairs(&self) -> Vec<[InstanceId; 2]> {
        let mut along: Vec<(InstanceId, Bounds)> = self.bounds.iter().map(|(id, bounds)| (*id, *bounds)).collect();
        along.sort_by(|a, b| a.1[0][0].total_cmp(&b.1[0][0]).then(a.0.cmp(&b.0)));
        let mut out = Vec::new();
        for (index, (id, bounds)) in along.iter().enumerate() {
            let near = along[index + 1..].iter().take_while(|(_, other)| other[0][0] < bounds[1][0]);
            let meets = near.filter(|(_, other)| meet(bounds, other));
            out.extend(meets.map(|(other, _)| [*id.min(other), *id.max(other)]));
        }
        out.sort_unstable();
        out
    }

    /// Where two things are in each other, if they are by more than is nominal.
    pub fn meet(&self, a: InstanceId, b: InstanceId) -> Option<Touch> {
        let deepest = self.touch(a, b, [0.0; 3])?;
        let by = NOMINAL + self.coarse(a) + self.coarse(b);
        let steps = [-by, 0.0, by];
        let mut shifts = steps.iter().flat_map(|x| steps.iter().flat_map(move |y| steps.map(|z| [*x, *y, z])));
        shifts.all(|shift| self.touch(a, b, shift).is_some()).then_some(deepest)
    }

    /// The deepest touch of a thing with another one, moved by this, m in the lab.
    fn touch(&self, a: InstanceId, b: InstanceId, shift: [f64; 3]) -> Option<Touch> {
        let mut deepest: Option<Touch> = None;
        for found in self.each(a, b, shift, 0.0) {
            let depth = -found.distance;
            if depth > TOUCH && deepest.is_none_or(|d| depth > d.depth) {
                deepest = Some(Touch { at: found.point, depth });
            }
        }
        deepest
    }

    /// Whether a thing, moved by this, is nearer to another one than that, m.
    pub fn is_near(&self, a: InstanceId, b: InstanceId, shift: [f64; 3], within: f64) -> bool {
        let (Some(mine), Some(theirs)) = (self.bounds.get(&a), self.bounds.get(&b)) else { return false };
        let by = |k: usize, more: f64| [0, 1, 2].map(|i| mine[k][i] + shift[i] + more);
        meet(&[by(0, -within), by(1, within)], theirs) && self.each(a, b, shift, within).next().is_some()
    }

    fn each(
        &self,
        a: InstanceId,
        b: InstanceId,
        shift: [f64; 3],
        within: f64,
    ) -> impl Iterator<Item = matterix_solids::Touch> {
        let pieces = self.pieces.get_or_init(|| pieces(self.stage));
        let [mine, theirs] = [a, b].map(|id| pieces.get(&id).map_or(&[][..], Vec::as_slice));
        let shift = Isometry::from_translation(Vector::from(shift));
        mine.iter().flat_map(move |(at, body)| {
            let at = shift * *at;
            theirs.iter().filter_map(move |(other_at, other)| body.touch(&at, other, other_at, within))
        })
    }

    /// How far the pieces of a thing may stand out of it, m: a mesh is taken apart by cells.
    fn coarse(&self, thing: InstanceId) -> f64 {
        let stage = self.stage;
        let own = placed(stage).filter(|id| stage.whole(*id) == thing).map(|id| stage.scene.get(id));
        let cells = own.flat_map(|i| i.hull().chain(i.more())).filter_map(|(shape, _)| match shape {
            Shape::Mesh(_) => Some(shape.size().into_iter().fold(0.0, f64::max) / MESH_CELLS),
            _ => None,
        });
        cells.fold(0.0, f64::max)
    }

    /// All things, in their order.
    pub fn things(&self) -> impl Iterator<Item = InstanceId> {
        self.bounds.keys().copied()
    }
}

/// What has a known place.
fn placed(stage: &Stage<'_>) -> impl Iterator<Item = InstanceId> {
    let ids = (0..stage.scene.instances.len() as u32).map(InstanceId);
    ids.filter(|id| stage.scene.get(*id).placed && !stage.is_unknown(*id))
}

/// The box around an instance without its parts.
fn around(stage: &Stage<'_>, id: InstanceId) -> Option<Bounds> {
    let at = stage.pose(id);
    let of_links = links(stage, id).into_iter().map(|(at, body)| body.bounds(&at));
    let instance = stage.scene.get(id);
    let own = (!stage.is_inside_a_shape(id)).then(|| instance.hull().chain(instance.more()));
    let of_shapes = own.into_iter().flatten().map(|(shape, inner)| box_of(shape.size(), &at.then(inner)));
    of_links.chain(of_shapes).reduce(merged)
}

/// The box around a box that stands on its base.
fn box_of([x, y, z]: [f64; 3], at: &Pose) -> Bounds {
    let corners = (0..8u8).map(|k| {
        let side = |bit: u8, low: f64, high: f64| if k & bit == 0 { low } else { high };
        at.point([side(1, -x / 2.0, x / 2.0), side(2, -y / 2.0, y / 2.0), side(4, 0.0, z)])
    });
    corners.map(|c| [c, c]).reduce(merged).unwrap_or_default()
}

/// The true shapes of all that has a known place.
fn pieces<'s>(stage: &'s Stage<'_>) -> BTreeMap<InstanceId, Pieces<'s>> {
    let mut out: BTreeMap<InstanceId, Pieces<'s>> = BTreeMap::new();
    for id in placed(stage) {
        let all = out.entry(stage.whole(id)).or_default();
        all.extend(links(stage, id));
        if !stage.is_inside_a_shape(id) {
            let body = stage.bodies().get(id.0 as usize).and_then(Option::as_ref);
            all.extend(body.map(|body| (isometry(&stage.pose(id)), Cow::Borrowed(body))));
        }
    }
    out
}

/// The links of a robot, or of a thing with parts that move.
fn links<'s>(stage: &'s Stage<'_>, id: InstanceId) -> Pieces<'s> {
    let at = stage.pose(id);
    let mut out: Pieces<'s> = Vec::new();
    if let Some(actor) = stage.actors.get(&id) {
        let links = actor.tree.poses(&actor.joints);
        let placed = |link| isometry(&at.then(placement(link)));
        // How an arm stands is asked only where its tool is described: what it does is not looked at otherwise.
        let moves = moves(&actor.assembly.robot);
        let shown = |link: usize| actor.has_tool() || moves.get(link).is_none_or(|moves| !moves);
        let each = links.iter().zip(actor.bodies()).enumerate().filter(|(link, _)| shown(*link));
        out.extend(each.filter_map(|(_, (link, body))| Some((placed(link), Cow::Borrowed(body.as_ref()?)))));
    }
    if let (Some(fixture), Some(own)) = (stage.fixtures.get(&id), following(stage.scene, id)) {
        let each = fixture.links().into_iter().zip(Body::of_links(&own.robot));
        out.extend(each.filter_map(|(link, body)| Some((isometry(&at.then(link)), Cow::Owned(body?)))));
    }
    out
}

/// By link: whether a joint moves it.
fn moves(robot: &Robot) -> Vec<bool> {
    let mut moves = vec![false; robot.links.len()];
    // A joint comes after that which carries its parent.
    for joint in &robot.joints {
        moves[joint.child as usize] = moves[joint.parent as usize] || joint.kind != JointKind::Fixed;
    }
    moves
}

/// Whether two boxes share a place.
fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|k| a[0][k] < b[1][k] && b[0][k] < a[1][k])
}

fn merged(a: Bounds, b: Bounds) -> Bounds {
    let each = |f: fn(f64, f64) -> f64, k: usize| [0, 1, 2].map(|i| f(a[k][i], b[k][i]));
    [each(f64::min, 0), each(f64::max, 1)]
}
