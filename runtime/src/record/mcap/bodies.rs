//! `/bodies`: true shapes and joints, once; `/grips`: what is in the hands of robots, `/burdens`: how that may be moved, whenever they change.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use matterix_ir::bodies::{Bodies, Machine, Standing, Thing};
use matterix_ir::scene::{InstanceId, frame};
use mcap::McapResult;
use serde::Serialize;
use serde_json::{Value, json};

use super::Sink;
use super::schema::{list, object, text};
use crate::contact::Pressed;
use crate::motion::Stage;

/// What a robot holds from now on.
#[derive(Serialize)]
pub(super) struct Grip<'a> {
    pub(super) robot: &'a str,
    /// What it grips, then its parts and what stands on it; none when it lets go.
    pub(super) items: Vec<&'a str>,
}

/// How a thing in hand may be moved from now on.
#[derive(Serialize)]
pub(super) struct Burdened<'a> {
    pub(super) item: &'a str,
    /// What is free to run out of it, m3.
    pub(super) loose: f64,
    /// What acceleration, of gravity and of the motion, the grip on it bears, m/s2; none where that has no limit.
    pub(super) borne: Option<f64>,
}

/// What touches a loose thing, while anything of it moves.
#[derive(Serialize)]
pub(super) struct Touched<'a> {
    pub(super) thing: &'a str,
    pub(super) touches: &'a [Pressed],
}

/// Schema of [`Touched`].
pub(super) fn touched_schema() -> Value {
    let three = |what: &str| json!({ "type": "array", "items": { "type": "number" }, "description": what });
    let touch = object(
        "matterix.Pressed",
        [
            ("by", text("What touches it")),
            ("point", three("Where, in the lab, m")),
            ("press", three("Force across the surface on the thing, N")),
            ("rub", three("Force along the surface on the thing, N")),
            ("friction", json!({ "type": "number", "description": "Coefficient of friction" })),
        ],
    );
    object("matterix.Touched", [("thing", text("Name of the thing")), ("touches", list(touch))])
}

/// Schema of [`Burdened`].
pub(super) fn burden_schema() -> Value {
    let loose = json!({ "type": "number", "description": "What can run over its rim, m3" });
    let borne = json!({ "type": ["number", "null"], "description": "Acceleration, of gravity and motion, that the grip bears, m/s2; null if unlimited" });
    object("matterix.Burden", [("item", text("Name of the thing")), ("loose", loose), ("borne", borne)])
}

/// Schema of [`Grip`].
pub(super) fn grip_schema() -> Value {
    let items = list(text("What it grips, then what goes along"));
    object("matterix.Grip", [("robot", text("Name of the robot")), ("items", items)])
}

/// Schema of a [`Grip`] that says what a robot takes along beside what it grips.
pub(super) fn load_schema() -> Value {
    let items = list(text("What goes along: tips of pipettes"));
    object("matterix.Load", [("robot", text("Name of the robot")), ("items", items)])
}

/// Writes the bodies of a lab, if there are any.
pub(super) fn write<W: Write + Seek>(stage: &Stage<'_>, sink: &mut Sink<W>) -> McapResult<()> {
    let bodies = bodies(stage);
    if bodies == Bodies::default() {
        return Ok(());
    }
    let index = json!({ "type": "integer", "minimum": 0 });
    let thing = object(
        "matterix.Thing",
        [
            ("name", text("Its name")),
            ("whole", text("What it is a part of, or its own name")),
            ("shape", json!({ "description": "Its main shape, m" })),
            ("solids", json!({ "description": "More of its body, each with a pose" })),
            (
                "collision",
                json!({ "description": "What others run into instead, each with a pose; empty for the body" }),
            ),
            ("visual", json!({ "description": "What is seen instead; null for the body" })),
            (
                "inertial",
                json!({ "description": "Mass in kg, centre of mass, xx xy xz yy yz zz in kg m2; null if unknown" }),
            ),
            ("friction", json!({ "description": "Coefficient of friction; null if unknown" })),
            ("rooms", json!({ "description": "What its parts take out of it, each with a pose" })),
            (
                "hollow",
                json!({ "description": "Whether its shape is only what it takes out of another thing", "type": "boolean" }),
            ),
        ],
    );
    let machine = object(
        "matterix.Machine",
        [
            ("name", text("Its name")),
            ("robot", json!({ "description": "Links, joints and shapes, as in a description of a robot" })),
            ("tip", index.clone()),
            ("tools", index),
        ],
    );
    let truth = |about: &str| json!({ "description": about, "type": "boolean" });
    let standing = object(
        "matterix.Standing",
        [
            ("name", text("Its name")),
            ("carriers", list(text("What it stands on, then what carries that"))),
            ("told", truth("Whether the text gives its place on that")),
            ("loose", truth("Whether it can be gripped or has joints")),
        ],
    );
    let parts = [("things", list(thing)), ("machines", list(machine)), ("standing", list(standing))];
    let schema = object("matterix.Bodies", parts);
    let channel = sink.channel("/bodies", "matterix.Bodies", &schema, &BTreeMap::new())?;
    sink.push(channel, 0.0, &bodies)
}

fn bodies(stage: &Stage<'_>) -> Bodies {
    let scene = stage.scene;
    let mut out = Bodies::default();
    let told = scene.instances.iter().enumerate().filter(|(_, i)| i.seen().chain(i.hull()).next().is_some());
    for (index, instance) in told {
        let whole = scene.get(scene.whole(InstanceId(index as u32)));
        out.things.push(Thing {
            name: instance.name.clone(),
            whole: whole.name.clone(),
            shape: instance.shape.clone(),
            solids: instance.solids.clone(),
            collision: instance.collision.clone(),
            visual: instance.visual.clone(),
            inertial: instance.inertial,
            friction: instance.friction,
            rooms: scene.rooms(InstanceId(index as u32)),
            hollow: instance.shape.is_some() && instance.solid().is_none(),
        });
    }
    for (id, robot, _) in stage.movers() {
        let assembly = stage.actors.get(&id).map(|actor| &actor.assembly);
        out.machines.push(Machine {
            name: scene.get(id).name.clone(),
            robot: robot.clone(),
            tip: assembly.map_or(0, |a| a.tip),
            tools: assembly.map_or(robot.links.len() as u32, |a| a.tools),
        });
    }
    out.standing = standing(stage);
    out
}

/// What has a place of its own in the lab.
fn standing(stage: &Stage<'_>) -> Vec<Standing> {
    let ids = (0..stage.scene.instances.len() as u32).map(InstanceId);
    let known = |id: InstanceId| stage.scene.get(id).placed;
    let placed = ids.filter(|id| stage.scene.get(*id).owner.is_none());
    placed
        .filter(|id| known(*id) && stage.carriers(*id).into_iter().all(known))
        .map(|id| {
            let own = stage.scene.get(id);
            let graspable = own.frames.iter().any(|f| f.name == frame::GRASP);
            Standing {
                name: own.name.clone(),
                carriers: stage.carriers(id).into_iter().map(|c| stage.scene.get(c).name.clone()).collect(),
                told: own.at.is_some(),
                loose: graspable || own.articulation.is_some(),
            }
        })
        .collect()
}

/// A thing, its parts and what stands on any of these, by name.
pub(super) fn along<'a>(stage: &Stage<'a>, id: InstanceId) -> Vec<&'a str> {
    let mut going = vec![id];
    let mut next = 0;
    while let Some(&carrier) = going.get(next) {
        next += 1;
        for other in (0..stage.scene.instances.len() as u32).map(InstanceId) {
            if stage.stand_of(other) == Some(carrier) && !going.contains(&other) {
                going.push(other);
            }
        }
    }
    going.into_iter().map(|id| stage.scene.get(id).name.as_str()).collect()
}
