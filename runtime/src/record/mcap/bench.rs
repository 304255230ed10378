//! The bench in three dimensions: `/scene` with a primitive per instance, `/tf` with its frames.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use matterix_ir::mesh::Mesh;
use matterix_ir::scene::{Instance, InstanceId, Pose, Shape};
use mcap::McapResult;

use super::Sink;
use super::bodies;
use super::foxglove::{
    self, Color, Cube, Cylinder, Entity, FrameTransform, FrameTransforms, KeyValue, SceneUpdate, Text, Time, Triangles,
    pose, quaternion, vector,
};
use super::replay::Replay;
use super::robots::Robots;
use crate::record::column::Column;
use crate::record::run::Run;

/// The frame everything stands in.
pub(super) const LAB: &str = "lab";
/// Of things that have no colour of their own.
const GREY: [f64; 3] = [0.62, 0.66, 0.70];

/// Writes the scene at the start, then what changed its place or its colour.
pub(super) fn write<W: Write + Seek>(run: &Run<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let scene = &run.program.scene;
    let units = BTreeMap::new();
    let entities = sink.channel("/scene", "foxglove.SceneUpdate", &foxglove::scene_schema(), &units)?;
    let frames = sink.channel("/tf", "foxglove.FrameTransforms", &foxglove::transforms_schema(), &units)?;
    let tints = tints(run);
    let mut shown: Vec<Option<(Pose, Tint)>> = vec![None; scene.instances.len()];
    let mut replay = Replay::new(run);
    bodies::write(&replay.stage, sink)?;
    let mut robots = Robots::begin(&replay.stage, !run.recording.sightings.is_empty(), sink, entities, frames)?;
    for (index, time) in instants(run, &replay, tints.values()).into_iter().enumerate() {
        let travelled = robots.until(run, time, sink, frames, &mut replay)?;
        let moved = replay.sample(run, time) || index == 0;
        // What is let go as the last motion ends is told by no motion after it.
        if moved {
            robots.loaded(run, time, sink, &mut replay)?;
        }
        if !moved && !travelled && tints.is_empty() {
            continue;
        }
        let poses: Vec<Pose> = (0..scene.instances.len() as u32).map(|i| replay.stage.pose(InstanceId(i))).collect();
        let mut changed = Vec::new();
        for (i, &at) in poses.iter().enumerate() {
            let now = Some((at, tint(tints.get(&i).and_then(|c| c.colour(time)).unwrap_or(GREY))));
            if now != shown[i] {
                let displaced = shown[i].map(|(before, _)| before) != Some(at);
                let repainted = shown[i].map(|(_, before)| Some(before) != now.map(|(_, tint)| tint)) != Some(false);
                shown[i] = now;
                changed.push((i, displaced, repainted || !scene.instances.get(i).is_some_and(has_mesh)));
            }
        }
        let drawn: Vec<Entity<'_>> = changed
            .iter()
            .filter(|(.., drawn)| *drawn)
            .filter_map(|&(i, ..)| entity(run, i, time, shown[i]?))
            .collect();
        if !drawn.is_empty() {
            sink.push(entities, time, &SceneUpdate { deletions: [], entities: drawn })?;
        }
        let displaced = changed.iter().filter(|(_, displaced, _)| *displaced);
        let transforms: Vec<FrameTransform> =
            displaced.flat_map(|&(i, ..)| transforms(run, i, time, poses[i])).collect();
        if !transforms.is_empty() {
            sink.push(frames, time, &FrameTransforms { transforms })?;
        }
    }
    Ok(())
}

/// Times at which something may have another place or colour than before, in order: where what says so has points, where steps
/// begin and end, and at both ends of the run.
fn instants<'c, 'p: 'c>(run: &Run<'p>, replay: &Replay<'_>, tints: impl Iterator<Item = &'c Column<'p>>) -> Vec<f64> {
    let recording = run.recording;
    let (first, last) = recording.sampled.unwrap_or_default();
    let places = replay.states().filter_map(|state| recording.states.get(state));
    let mut times: Vec<f64> = places.flat_map(|s| s.points().map(|p| p.0)).collect();
    times.extend(tints.flat_map(|column| column.shades(SHADES)));
    times.extend(recording.steps.iter().map(|mark| mark.time).filter(|time| (first..=last).contains(time)));
    times.extend([first, last]);
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// A vessel has the colour of what is in it: the first property of a mixture that can be a colour.
fn tints<'a>(run: &Run<'a>) -> BTreeMap<usize, Column<'a>> {
    let mut tints = BTreeMap::new();
    for mixture in &run.program.model.mixtures {
        let columns = mixture.properties.iter().filter_map(|&i| Column::observable(run, i as usize));
        let Some(column) = columns.into_iter().find(|c| c.is_colour()) else { continue };
        let part = mixture.instance.0 as usize;
        let owner = run.program.scene.instances.get(part).and_then(|i| i.owner);
        tints.insert(owner.map_or(part, |id| id.0 as usize), column);
    }
    tints
}

/// A colour in so few shades that a slow change gives few messages.
type Tint = [u8; 3];

/// Number of the last shade.
const SHADES: f64 = 63.0;

fn tint(colour: [f64; 3]) -> Tint {
    colour.map(|v| (v * SHADES).round() as u8)
}

/// The primitives of one thing.
#[derive(Default)]
pub(super) struct Pieces {
    pub(super) color: Color,
    pub(super) cubes: Vec<Cube>,
    pub(super) spheres: Vec<Cube>,
    pub(super) cylinders: Vec<Cylinder>,
    pub(super) triangles: Vec<Triangles>,
    /// Height of its main shape, m.
    top: f64,
}

impl Pieces {
    fn add(&mut self, shape: &Shape, at: Pose) {
        let size = shape.size();
        if self.top == 0.0 {
            self.top = size[2];
        }
        let color = self.color;
        let middle = pose(at.then(Pose::up(size[2] / 2.0)));
        match shape {
            Shape::Box(_) => self.cubes.push(Cube { pose: middle, size: vector(size), color }),
            Shape::Sphere(_) => self.spheres.push(Cube { pose: middle, size: vector(size), color }),
            Shape::Mesh(mesh) => self.mesh(pose(at), mesh),
            Shape::Cylinder(_) => self.cone(middle, size, [1.0, 1.0]),
            Shape::Turned { outside, .. } => {
                for step in outside.windows(2) {
                    let ([r0, z0], [r1, z1]) = (step[0], step[1]);
                    let (wide, high) = (r0.max(r1), z1 - z0);
                    if wide > 0.0 && high > 0.0 {
                        let middle = pose(at.then(Pose::up((z0 + z1) / 2.0)));
                        self.cone(middle, [2.0 * wide, 2.0 * wide, high], [r0 / wide, r1 / wide]);
                    }
                }
            }
        }
    }

    pub(super) fn mesh(&mut self, pose: foxglove::Pose, mesh: &Mesh) {
        let points = mesh.points.iter().map(|p| vector(*p)).collect();
        let indices = mesh.triangles.iter().flatten().copied().collect();
        self.triangles.push(Triangles { pose, points, color: self.color, colors: [], indices });
    }

    pub(super) fn cone(&mut self, pose: foxglove::Pose, size: [f64; 3], [bottom_scale, top_scale]: [f64; 2]) {
        self.cylinders.push(Cylinder { pose, size: vector(size), bottom_scale, top_scale, color: self.color });
    }
}

fn entity<'a>(run: &Run<'a>, index: usize, time: f64, (at, tint): (Pose, Tint)) -> Option<Entity<'a>> {
    let instance = run.program.scene.instances.get(index)?;
    let (frame_id, at) = if has_mesh(instance) { (instance.name.as_str(), Pose::IDENTITY) } else { (LAB, at) };
    let [r, g, b] = tint.map(|v| f64::from(v) / SHADES);
    let mut pieces = Pieces { color: Color { r, g, b, a: 0.85 }, ..Pieces::default() };
    instance.seen().for_each(|(shape, inner)| pieces.add(shape, at.then(inner)));
    let Pieces { cubes, spheres, cylinders, triangles, top, .. } = pieces;
    if cubes.is_empty() && spheres.is_empty() && cylinders.is_empty() && triangles.is_empty() {
        return None;
    }
    let label = Text {
        pose: pose(at.then(Pose::up(top + 0.03))),
        billboard: true,
        font_size: 0.025,
        scale_invariant: false,
        color: Color { r: 0.1, g: 0.1, b: 0.1, a: 1.0 },
        text: &instance.name,
    };
    Some(Entity {
        timestamp: Time::new(time),
        frame_id,
        id: &instance.name,
        lifetime: Time::new(0.0),
        frame_locked: true,
        metadata: vec![KeyValue { key: "kind", value: &instance.kind }],
        arrows: [],
        cubes,
        spheres,
        cylinders,
        lines: [],
        triangles,
        texts: vec![label],
        models: [],
    })
}

/// Whether there are triangles in it: it is written in its own frame, so that it need not be written again where it moves.
fn has_mesh(instance: &Instance) -> bool {
    instance.seen().any(|(shape, _)| matches!(shape, Shape::Mesh(_)))
}

/// The instance in the lab, and its named points in the instance.
fn transforms(run: &Run<'_>, index: usize, time: f64, at: Pose) -> Vec<FrameTransform> {
    let Some(instance) = run.program.scene.instances.get(index) else { return Vec::new() };
    let transform = |parent: &str, child: String, at: Pose| FrameTransform {
        timestamp: Time::new(time),
        parent_frame_id: parent.to_owned(),
        child_frame_id: child,
        translation: vector(at.position),
        rotation: quaternion(at.rotation),
    };
    let own = transform(LAB, instance.name.clone(), at);
    let points =
        instance.frames.iter().map(|f| transform(&instance.name, format!("{}.{}", instance.name, f.name), f.pose));
    std::iter::once(own).chain(points).collect()
}
