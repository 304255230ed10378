//! A recording as what moves: bodies with their places over time.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use matterix_ir::bodies::{Bodies, Machine, Standing};
use matterix_ir::mesh::Mesh;
use matterix_ir::pose::Pose;
use matterix_ir::scene::Shape;
use matterix_recording::{Recording, Topic, list, number, text};
use matterix_solids::{Body, Isometry, MESH_CELLS, Made, isometry};
use serde::Deserialize;
use serde_json::Value;

use crate::kinematics;

/// The frame everything stands in.
const LAB: &str = "lab";

/// Why a file cannot be judged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unreadable(pub String);

impl fmt::Display for Unreadable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Unreadable {}

/// What moves and what stands around.
pub(crate) struct Trajectory {
    pub(crate) things: Vec<Thing>,
    pub(crate) robots: Vec<Robot>,
    /// What has a place of its own when the run begins.
    pub(crate) standing: Vec<Standing>,
}

/// A rigid thing.
pub(crate) struct Thing {
    pub(crate) name: String,
    /// The outermost thing it is a part of.
    pub(crate) whole: String,
    /// Nothing for what only carries others.
    pub(crate) body: Option<Body>,
    /// How far its pieces may stand out of it, m: a mesh is taken apart by cells.
    pub(crate) coarse: f64,
    /// Its main shape.
    pub(crate) shape: Option<Shape>,
    /// Its centre of mass, empty, as far as that is known, m.
    centre: Option<[f64; 3]>,
    /// Its named points, relative to it.
    pub(crate) points: Vec<Isometry>,
    /// The volume that is free to run out of it, m3, and the acceleration that a grip on it bears, m/s2, whenever that was said to change.
    burdens: Vec<(f64, [f64; 2])>,
    way: Vec<(f64, Isometry)>,
}

/// A robot with its tools.
pub(crate) struct Robot {
    pub(crate) name: String,
    pub(crate) machine: Machine,
    /// Indices of the joints that move by themselves.
    pub(crate) variables: Vec<usize>,
    /// By link.
    pub(crate) bodies: Vec<Option<Body>>,
    pub(crate) samples: Vec<Sample>,
    pub(crate) grips: Vec<Grip>,
    /// Things by index that it takes along beside that, whenever these change.
    pub(crate) loads: Vec<(f64, Vec<usize>)>,
}

/// A robot at one moment, as recorded.
pub(crate) struct Sample {
    pub(crate) time: f64,
    /// By variable, rad or m, and their changes by s.
    pub(crate) position: Vec<f64>,
    pub(crate) speed: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    /// By link, in the lab.
    pub(crate) links: Vec<Isometry>,
}

/// What a robot holds from a time on.
pub(crate) struct Grip {
    pub(crate) time: f64,
    /// Each with its place relative to the robot's tip; the gripped one first.
    pub(crate) items: Vec<(usize, Isometry)>,
}

impl Trajectory {
    pub(crate) fn read(file: &[u8]) -> Result<Trajectory, Unreadable> {
        let recording = matterix_recording::read(file).map_err(|damaged| Unreadable(damaged.0))?;
        let (ways, points) = frames(&recording);
        let told = topic(&recording, "/bodies").and_then(|t| t.messages.first());
        let Some((_, bodies)) = told else {
            return Err(Unreadable(
                "it has no `/bodies`: nothing in it has a shape, or an older version wrote it".to_owned(),
            ));
        };
        let bodies = Bodies::deserialize(bodies).map_err(|e| Unreadable(format!("`/bodies` is damaged: {e}")))?;
        if !meshes(&bodies).all(Mesh::is_sound) {
            return Err(Unreadable("`/bodies` is damaged: a mesh lacks corners".to_owned()));
        }
        let mut alike = matterix_solids::Bodies::default();
        let things: Vec<Thing> = bodies
            .things
            .iter()
            .map(|thing| Thing {
                name: thing.name.clone(),
                whole: thing.whole.clone(),
                body: alike.body(Made {
                    main: thing.shape.as_ref().filter(|_| !thing.hollow),
                    more: &thing.solids,
                    rooms: thing.rooms.as_slice().into(),
                    collision: &thing.collision,
                }),
                coarse: thing.hull().map(|(shape, _)| coarse(shape)).fold(0.0, f64::max),
                shape: thing.shape.clone(),
                centre: thing.inertial.as_ref().map(|inertial| inertial.placement.position),
                points: points.get(&thing.name).cloned().unwrap_or_default(),
                burdens: burdens(&recording, &thing.name),
                way: ways.get(&thing.name).cloned().unwrap_or_default(),
            })
            .collect();
        let mut robots = Vec::new();
        for machine in bodies.machines {
            is_tree(&machine)?;
            robots.push(robot(machine, &recording, &ways, &things)?);
        }
        Ok(Trajectory { things, robots, standing: bodies.standing })
    }
}

impl Thing {
    /// When and where it was first said to be.
    pub(crate) fn first(&self) -> Option<(f64, Isometry)> {
        self.way.first().copied()
    }

    /// Its centre of mass, empty, or the middle of its shape, m.
    pub(crate) fn middle(&self) -> [f64; 3] {
        let half = || [0.0, 0.0, self.shape.as_ref().map_or(0.0, |shape| 0.5 * shape.size()[2])];
        self.centre.unwrap_or_else(half)
    }

    /// The volume that can run out of it: what pours has run out by the time that something else is said.
    pub(crate) fn loose(&self, time: f64) -> Option<f64> {
        let after = self.burdens.partition_point(|(t, _)| *t <= time);
        let (_, [now, _]) = self.burdens.get(after.saturating_sub(1))?;
        Some(self.burdens.get(after).map_or(*now, |(_, [next, _])| now.min(*next)))
    }

    /// The volumes that were said to be free to run out of it, m3, each with when that was.
    pub(crate) fn volumes(&self) -> impl Iterator<Item = (f64, f64)> {
        self.burdens.iter().map(|(time, [loose, _])| (*time, *loose))
    }

    /// The acceleration, of gravity and of the motion, that the grip on it bears, m/s2.
    pub(crate) fn borne(&self, time: f64) -> f64 {
        let after = self.burdens.partition_point(|(t, _)| *t <= time);
        self.burdens.get(after.saturating_sub(1)).map_or(f64::INFINITY, |(_, [_, borne])| *borne)
    }

    /// Where it was last said to be.
    pub(crate) fn at(&self, time: f64) -> Option<Isometry> {
        last(&self.way, time)
    }
}

/// What is said of how a thing in hand may be moved, over time.
fn burdens(recording: &Recording, name: &str) -> Vec<(f64, [f64; 2])> {
    let messages = topic(recording, "/burdens").into_iter().flat_map(|t| &t.messages);
    let borne = |m: &Value| m["borne"].as_f64().unwrap_or(f64::INFINITY);
    messages.filter(|(_, m)| text(m, "item") == name).map(|(time, m)| (*time, [number(m, "loose"), borne(m)])).collect()
}

fn coarse(shape: &Shape) -> f64 {
    match shape {
        Shape::Mesh(_) => shape.size().into_iter().fold(0.0, f64::max) / MESH_CELLS,
        _ => 0.0,
    }
}

/// The last place up to a time; the first, where it is later.
fn last(way: &[(f64, Isometry)], time: f64) -> Option<Isometry> {
    let after = way.partition_point(|(t, _)| *t <= time);
    way.get(after.saturating_sub(1)).map(|(_, at)| *at)
}

fn topic<'a>(recording: &'a Recording, name: &str) -> Option<&'a Topic> {
    recording.topics.iter().find(|t| t.name == name)
}

type Ways = BTreeMap<String, Vec<(f64, Isometry)>>;
type Points = BTreeMap<String, Vec<Isometry>>;

/// Where everything is in the lab over time, and the named points of things.
fn frames(recording: &Recording) -> (Ways, Points) {
    let (mut ways, mut points) = (Ways::new(), Points::new());
    let mut known = BTreeSet::new();
    for (time, message) in topic(recording, "/tf").iter().flat_map(|t| &t.messages) {
        for transform in list(message, "transforms") {
            let (above, name) = (text(transform, "parent_frame_id"), text(transform, "child_frame_id"));
            let at = isometry(&pose(&transform["translation"], &transform["rotation"]));
            if above == LAB {
                ways.entry(name.to_owned()).or_default().push((*time, at));
            } else if known.insert(name) {
                points.entry(above.to_owned()).or_default().push(at);
            }
        }
    }
    (ways, points)
}

fn pose(position: &Value, rotation: &Value) -> Pose {
    let position = ["x", "y", "z"].map(|k| number(position, k));
    let rotation = ["x", "y", "z", "w"].map(|k| number(rotation, k));
    let none = rotation.iter().all(|v| *v == 0.0);
    Pose { position, rotation: if none { Pose::IDENTITY.rotation } else { rotation } }
}

fn meshes(bodies: &Bodies) -> impl Iterator<Item = &Mesh> {
    let shapes = bodies.things.iter().flat_map(|t| t.hull().map(|(shape, _)| shape));
    let of_things = shapes.filter_map(|shape| match shape {
        Shape::Mesh(mesh) => Some(&**mesh),
        _ => None,
    });
    of_things.chain(bodies.machines.iter().flat_map(|m| m.robot.meshes.values().map(|mesh| &**mesh)))
}

/// Links and joints name each other as a tree does; the file may say anything.
fn is_tree(machine: &Machine) -> Result<(), Unreadable> {
    let robot = &machine.robot;
    let (links, joints) = (robot.links.len() as u32, robot.joints.len() as u32);
    let mut known: BTreeSet<u32> = (0..links).filter(|l| robot.joints.iter().all(|j| j.child != *l)).collect();
    let grown = robot.joints.iter().all(|j| {
        let mimic = j.mimic.is_none_or(|m| m.joint < joints);
        known.contains(&j.parent) && j.child < links && mimic && known.insert(j.child)
    });
    let named = machine.tip < links && robot.touching.iter().flatten().all(|l| *l < links);
    if grown && named {
        return Ok(());
    }
    Err(Unreadable(format!("`/bodies` is damaged: the links of `{}` do not form a tree", machine.name)))
}

fn robot(machine: Machine, recording: &Recording, ways: &Ways, things: &[Thing]) -> Result<Robot, Unreadable> {
    let name = machine.name.clone();
    let variables = kinematics::variables(&machine.robot);
    let of = |joint: &usize| format!("{name}.{}", machine.robot.joints[*joint].name);
    let names: Vec<String> = variables.iter().map(of).collect();
    let link_ways: Vec<&[(f64, Isometry)]> = machine
        .robot
        .links
        .iter()
        .map(|l| ways.get(&format!("{name}.{}", l.name)).map_or(&[][..], Vec::as_slice))
        .collect();
    let mut samples: Vec<Sample> = Vec::new();
    for (time, message) in topic(recording, "/joints").iter().flat_map(|t| &t.messages) {
        let joints = list(message, "joints");
        let states: Vec<&Value> = names.iter().filter_map(|n| joints.iter().find(|j| text(j, "name") == n)).collect();
        if states.is_empty() {
            continue;
        }
        let links: Option<Vec<Isometry>> = link_ways.iter().map(|way| last(way, *time)).collect();
        let (true, Some(links)) = (states.len() == names.len(), links) else {
            return Err(Unreadable(format!("the record of `{name}` is incomplete at {time} s")));
        };
        let all = |key: &str| states.iter().map(|s| number(s, key)).collect();
        samples.push(Sample {
            time: *time,
            position: all("position"),
            speed: all("velocity"),
            acceleration: all("acceleration"),
            links,
        });
    }
    let bodies = Body::of_links(&machine.robot);
    let mut robot = Robot { name, machine, variables, bodies, samples, grips: Vec::new(), loads: Vec::new() };
    for (time, message) in topic(recording, "/grips").iter().flat_map(|t| &t.messages) {
        if text(message, "robot") == robot.name {
            let items = robot.gripped(*time, list(message, "items"), ways, things);
            robot.grips.push(Grip { time: *time, items });
        }
    }
    for (time, message) in topic(recording, "/loads").iter().flat_map(|t| &t.messages) {
        if text(message, "robot") == robot.name {
            let index = |name: &Value| things.iter().position(|t| Some(t.name.as_str()) == name.as_str());
            robot.loads.push((*time, list(message, "items").iter().filter_map(index).collect()));
        }
    }
    Ok(robot)
}

impl Robot {
    /// Whether it took a thing along beside what it grips, shortly before a time, then, or shortly after.
    pub(crate) fn took(&self, thing: usize, time: f64) -> bool {
        let after = self.loads.partition_point(|(t, _)| *t <= time);
        let near = &self.loads[after.saturating_sub(2)..(after + 1).min(self.loads.len())];
        near.iter().any(|(_, items)| items.contains(&thing))
    }

    /// Things by name, each where it is relative to the tip.
    fn gripped(&self, time: f64, names: &[Value], ways: &Ways, things: &[Thing]) -> Vec<(usize, Isometry)> {
        let Some(tip) = self.sample(time).and_then(|s| s.links.get(self.machine.tip as usize)) else {
            return Vec::new();
        };
        let item = |name: &Value| {
            let index = things.iter().position(|t| Some(t.name.as_str()) == name.as_str())?;
            let at = last(ways.get(&things[index].name)?, time)?;
            Some((index, tip.inv_mul(&at)))
        };
        names.iter().filter_map(item).collect()
    }

    /// The last sample up to a time; the first, where it is later.
    fn sample(&self, time: f64) -> Option<&Sample> {
        let after = self.samples.partition_point(|s| s.time <= time);
        self.samples.get(after.saturating_sub(1))
    }

    /// What it holds at a time.
    pub(crate) fn held(&self, time: f64) -> &[(usize, Isometry)] {
        let after = self.grips.partition_point(|g| g.time <= time);
        after.checked_sub(1).map_or(&[], |i| self.grips[i].items.as_slice())
    }

    /// The grips before, at and after a time.
    pub(crate) fn near_grips(&self, time: f64) -> &[Grip] {
        let after = self.grips.partition_point(|g| g.time <= time);
        &self.grips[after.saturating_sub(2)..(after + 1).min(self.grips.len())]
    }

    /// Positions of its joints at a time: between samples, the cubic with the recorded speeds.
    pub(crate) fn position(&self, time: f64) -> Vec<f64> {
        let after = self.samples.partition_point(|s| s.time <= time);
        let Some(a) = self.samples.get(after.saturating_sub(1)) else { return Vec::new() };
        let Some(b) = self.samples.get(after).filter(|b| b.time > a.time && time > a.time) else {
            return a.position.clone();
        };
        let h = b.time - a.time;
        let s = (time - a.time) / h;
        let (s2, s3) = (s * s, s * s * s);
        (0..a.position.len())
            .map(|i| {
                (2.0 * s3 - 3.0 * s2 + 1.0) * a.position[i]
                    + (s3 - 2.0 * s2 + s) * h * a.speed[i]
                    + (3.0 * s2 - 2.0 * s3) * b.position[i]
                    + (s3 - s2) * h * b.speed[i]
            })
            .collect()
    }

    /// Its links in the lab at a time; its foot is where it was last said to be.
    pub(crate) fn links(&self, time: f64) -> Vec<Isometry> {
        let Some(root) = self.sample(time).and_then(|s| s.links.first()) else { return Vec::new() };
        kinematics::links(&self.machine.robot, root, &self.variables, &self.position(time))
    }
}
