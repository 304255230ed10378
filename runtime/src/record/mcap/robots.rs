//! Robots with joints: an entity for every link in its own frame, the frames as they move, and the joints' positions.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use matterix_ir::mesh::Mesh;
use matterix_ir::pose::Pose;
use matterix_ir::robot::{Piece, Robot, Solid};
use matterix_ir::scene::InstanceId;
use mcap::McapResult;

use super::Sink;
use super::bench::{LAB, Pieces};
use super::bodies;
use super::foxglove::{
    self, Color, Entity, FrameTransform, FrameTransforms, JointState, JointStates, KeyValue, SceneUpdate, Time, pose,
    quaternion, vector,
};
use super::replay::Replay;
use crate::motion::{Burden, Moment, Stage};
use crate::record::run::Run;

/// Of links that have no colour of their own.
const GREY: [f64; 4] = [0.75, 0.77, 0.8, 1.0];

/// What a robot holds.
struct Hand {
    item: InstanceId,
    /// That, then all that goes along, by name.
    along: Vec<String>,
    changes: u64,
}

/// The robots of a recording as it is written, from moment to moment.
pub(super) struct Robots {
    /// Names of the links of each robot, and of its joints.
    names: BTreeMap<InstanceId, (Vec<String>, Vec<String>)>,
    joints: u16,
    grips: u16,
    loads: u16,
    burdens: u16,
    contacts: u16,
    /// By robot, what it last held, with what goes along, and how often things had changed hands by then.
    hands: BTreeMap<InstanceId, Hand>,
    /// The first moment that has not been written.
    next: usize,
    /// The first burden that has not been written.
    told: usize,
    /// The first sighting that has not been written.
    sighted: usize,
}

impl Robots {
    /// Writes all robots as they stand at the beginning.
    pub(super) fn begin<W: Write + Seek>(
        stage: &Stage<'_>,
        touched: bool,
        sink: &mut Sink<W>,
        entities: u16,
        frames: u16,
    ) -> McapResult<Self> {
        let units = BTreeMap::new();
        let (names, hands) = (BTreeMap::new(), BTreeMap::new());
        let mut out = Robots {
            names,
            joints: 0,
            grips: 0,
            loads: 0,
            burdens: 0,
            contacts: 0,
            hands,
            next: 0,
            told: 0,
            sighted: 0,
        };
        if stage.movers().next().is_none() {
            return Ok(out);
        }
        out.joints = sink.channel("/joints", "foxglove.JointStates", &foxglove::joints_schema(), &units)?;
        out.grips = sink.channel("/grips", "matterix.Grip", &bodies::grip_schema(), &units)?;
        out.burdens = sink.channel("/burdens", "matterix.Burden", &bodies::burden_schema(), &units)?;
        if touched {
            out.contacts = sink.channel("/contacts", "matterix.Touched", &bodies::touched_schema(), &units)?;
        }
        if !stage.scene.carriers.is_empty() {
            out.loads = sink.channel("/loads", "matterix.Load", &bodies::load_schema(), &units)?;
        }
        for (id, robot, tree) in stage.movers() {
            let name = &stage.scene.get(id).name;
            let links: Vec<String> = robot.links.iter().map(|l| format!("{name}.{}", l.name)).collect();
            let moving = tree.variables().iter().filter_map(|v| robot.joints.get(v.joint as usize));
            let joints = moving.map(|j| format!("{name}.{}", j.name)).collect();
            let kind = &stage.scene.get(id).kind;
            let drawn: Vec<Entity<'_>> =
                robot.links.iter().zip(&links).filter_map(|(link, id)| entity(robot, &link.visual, id, kind)).collect();
            sink.push(entities, 0.0, &SceneUpdate { deletions: [], entities: drawn })?;
            out.names.insert(id, (links, joints));
            if let Some(moment) = stage.moment(id, 0.0) {
                out.write(&moment, sink, frames)?;
            }
        }
        Ok(out)
    }

    /// Writes what moved up to a time, s, with all that goes along; whether anything did.
    pub(super) fn until<W: Write + Seek>(
        &mut self,
        run: &Run<'_>,
        time: f64,
        sink: &mut Sink<W>,
        frames: u16,
        replay: &mut Replay<'_>,
    ) -> McapResult<bool> {
        let mut travelled = false;
        while let Some(moment) = run.recording.moments.get(self.next).filter(|m| m.time <= time) {
            self.next += 1;
            self.sightings(run, moment.time, sink, frames, replay)?;
            replay.moment(moment);
            self.grip(replay, moment, sink)?;
            self.burdens(run, moment.time, sink)?;
            self.write(moment, sink, frames)?;
            travelled = true;
            self.loaded(run, moment.time, sink, replay)?;
            places(run, moment.time, replay.along(moment.robot), sink, frames)?;
        }
        travelled |= self.sightings(run, time, sink, frames, replay)?;
        self.burdens(run, time, sink)?;
        Ok(travelled)
    }

    /// Writes what robots take along from a time on, s, where that has changed.
    pub(super) fn loaded<W: Write + Seek>(
        &self,
        run: &Run<'_>,
        time: f64,
        sink: &mut Sink<W>,
        replay: &mut Replay<'_>,
    ) -> McapResult<()> {
        for (robot, items) in replay.loads() {
            let name = |id: &InstanceId| run.program.scene.get(*id).name.as_str();
            let load = bodies::Grip { robot: name(&robot), items: items.iter().map(name).collect() };
            sink.push(self.loads, time, &load)?;
        }
        Ok(())
    }

    /// Writes where loose things have moved up to a time, s; whether any have.
    fn sightings<W: Write + Seek>(
        &mut self,
        run: &Run<'_>,
        time: f64,
        sink: &mut Sink<W>,
        frames: u16,
        replay: &mut Replay<'_>,
    ) -> McapResult<bool> {
        let first = self.sighted;
        while let Some(sighting) = run.recording.sightings.get(self.sighted).filter(|sighting| sighting.time <= time) {
            self.sighted += 1;
            places(run, sighting.time, replay.sighted(sighting), sink, frames)?;
            let thing = &run.program.scene.get(sighting.thing).name;
            let touched = bodies::Touched { thing, touches: &sighting.touches };
            sink.push(self.contacts, sighting.time, &touched)?;
        }
        Ok(self.sighted > first)
    }

    /// Writes what is in a hand, with all that goes along, where that is something else than before.
    fn grip<W: Write + Seek>(&mut self, replay: &Replay<'_>, moment: &Moment, sink: &mut Sink<W>) -> McapResult<()> {
        let (stage, now) = (&replay.stage, moment.held.map(|(id, _)| id));
        let before = self.hands.get(&moment.robot);
        if before.map(|hand| hand.item) == now && before.is_none_or(|hand| hand.changes == replay.changes) {
            return Ok(());
        }
        let items = now.map(|id| bodies::along(stage, id)).unwrap_or_default();
        let same = before.is_some_and(|hand| hand.along == items);
        match now {
            Some(item) => {
                let along = items.iter().map(|name| (*name).to_owned()).collect();
                self.hands.insert(moment.robot, Hand { item, along, changes: replay.changes });
            }
            None => drop(self.hands.remove(&moment.robot)),
        }
        if same {
            return Ok(());
        }
        let robot = &stage.scene.get(moment.robot).name;
        sink.push(self.grips, moment.time, &bodies::Grip { robot, items })
    }

    /// Writes how what robots carry may be moved, as it changed up to a time, s.
    fn burdens<W: Write + Seek>(&mut self, run: &Run<'_>, time: f64, sink: &mut Sink<W>) -> McapResult<()> {
        while let Some(mark) = run.recording.burdens.get(self.told).filter(|mark| mark.time <= time) {
            self.told += 1;
            let item = run.program.scene.get(mark.item).name.as_str();
            let Burden { loose, borne } = mark.burden;
            let borne = borne.filter(|borne| borne.is_finite());
            let burden = bodies::Burdened { item, loose: loose.unwrap_or_default(), borne };
            sink.push(self.burdens, mark.time, &burden)?;
        }
        Ok(())
    }

    fn write<W: Write + Seek>(&self, moment: &Moment, sink: &mut Sink<W>, frames: u16) -> McapResult<()> {
        let Some((links, joints)) = self.names.get(&moment.robot) else { return Ok(()) };
        let transforms = links.iter().zip(&moment.links).map(|(name, at)| transform(moment.time, name, *at)).collect();
        sink.push(frames, moment.time, &FrameTransforms { transforms })?;
        let moving = moment.speeds.iter().zip(&moment.accelerations).map(|(v, a)| (*v, *a));
        let states = joints.iter().zip(&moment.joints).zip(moving);
        let joints = states.map(|((name, position), (velocity, acceleration))| JointState {
            name,
            position: *position,
            velocity,
            acceleration,
        });
        sink.push(
            self.joints,
            moment.time,
            &JointStates { timestamp: Time::new(moment.time), joints: joints.collect() },
        )
    }
}

/// Writes where these are from now on.
fn places<W: Write + Seek>(
    run: &Run<'_>,
    time: f64,
    going: Vec<(InstanceId, Pose)>,
    sink: &mut Sink<W>,
    frames: u16,
) -> McapResult<()> {
    let name = |id: InstanceId| &run.program.scene.get(id).name;
    let transforms: Vec<FrameTransform> = going.into_iter().map(|(id, at)| transform(time, name(id), at)).collect();
    if transforms.is_empty() { Ok(()) } else { sink.push(frames, time, &FrameTransforms { transforms }) }
}

fn transform(time: f64, name: &str, at: Pose) -> FrameTransform {
    FrameTransform {
        timestamp: Time::new(time),
        parent_frame_id: LAB.to_owned(),
        child_frame_id: name.to_owned(),
        translation: vector(at.position),
        rotation: quaternion(at.rotation),
    }
}

/// What is seen of a link, in the link's own frame.
fn entity<'a>(robot: &Robot, visual: &[Piece], name: &'a str, kind: &'a str) -> Option<Entity<'a>> {
    let mut pieces = Pieces::default();
    for piece in visual {
        let [r, g, b, a] = piece.color.unwrap_or(GREY);
        pieces.color = Color { r, g, b, a };
        let at = pose(piece.placement);
        match piece.solid {
            Solid::Cuboid(size) => {
                pieces.cubes.push(foxglove::Cube { pose: at, size: vector(size), color: pieces.color })
            }
            Solid::Sphere(r) => {
                pieces.spheres.push(foxglove::Cube { pose: at, size: vector([2.0 * r; 3]), color: pieces.color });
            }
            Solid::Cylinder([r, length]) => pieces.cone(at, [2.0 * r, 2.0 * r, length], [1.0, 1.0]),
            Solid::Mesh(ref file, scale) => {
                if let Some(mesh) = robot.meshes.get(file) {
                    pieces.mesh(at, &Mesh::clone(mesh).scaled(scale));
                }
            }
        }
    }
    let Pieces { cubes, spheres, cylinders, triangles, .. } = pieces;
    if cubes.is_empty() && spheres.is_empty() && cylinders.is_empty() && triangles.is_empty() {
        return None;
    }
    Some(Entity {
        timestamp: Time::new(0.0),
        frame_id: name,
        id: name,
        lifetime: Time::new(0.0),
        frame_locked: true,
        metadata: vec![KeyValue { key: "kind", value: kind }],
        arrows: [],
        cubes,
        spheres,
        cylinders,
        lines: [],
        triangles,
        texts: Vec::new(),
        models: [],
    })
}
