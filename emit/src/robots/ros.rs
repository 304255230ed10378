//! Motions as `trajectory_msgs/msg/JointTrajectory` of ROS 2: CDR in MCAP, or JSON.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;

use byteorder::LittleEndian;
use matterix_ir::Diagnostic;
use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::{Travel, travels};
use crate::course::{self, Means};
use crate::finding::{not_expressible, settle};
use crate::performance::Performance;
use crate::{Subject, Written, place};

/// What the target is called in findings.
const WHAT: &str = "a list of trajectories";

/// Name of the message type.
const TYPE: &str = "trajectory_msgs/msg/JointTrajectory";

/// Its definition (packages trajectory_msgs, std_msgs and builtin_interfaces of ROS 2), with those it is made of.
const DEFINITION: &str = "std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
";

/// CDR, version 1, little endian, no options.
const ENCAPSULATION: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// A time or a duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

impl Time {
    fn of(seconds: f64) -> Time {
        let nanoseconds = nanoseconds(seconds);
        let sec = i32::try_from(nanoseconds / 1_000_000_000).unwrap_or(i32::MAX);
        Time { sec, nanosec: (nanoseconds % 1_000_000_000) as u32 }
    }
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

#[derive(Clone, Debug, Serialize)]
struct Header {
    stamp: Time,
    frame_id: String,
}

#[derive(Clone, Debug, Serialize)]
struct TrajectoryPoint {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: Time,
}

#[derive(Clone, Debug, Serialize)]
struct JointTrajectory {
    header: Header,
    joint_names: Vec<String>,
    points: Vec<TrajectoryPoint>,
}

impl JointTrajectory {
    fn of(travel: &Travel, subject: Subject<'_>) -> Self {
        let articulation = subject.program.scene.get(travel.owner).articulation.as_deref();
        let base = articulation.and_then(|a| a.robot.links.get(a.base as usize)).map(|l| l.name.clone());
        let points = travel.points.iter().map(|p| TrajectoryPoint {
            positions: p.positions.clone(),
            velocities: p.velocities.clone(),
            accelerations: p.accelerations.clone(),
            effort: Vec::new(),
            time_from_start: Time::of(p.time),
        });
        JointTrajectory {
            header: Header { stamp: Time::of(travel.begins), frame_id: base.unwrap_or_default() },
            joint_names: travel.joints.clone(),
            points: points.collect(),
        }
    }

    fn cdr(&self) -> Result<Vec<u8>, cdr_encoding::Error> {
        let body = cdr_encoding::to_vec::<_, LittleEndian>(self)?;
        Ok(ENCAPSULATION.into_iter().chain(body).collect())
    }
}

/// The topic of whoever moves: `/arm/joint_trajectory`, `/arm/gripper/joint_trajectory`.
fn topic(subject: Subject<'_>, travel: &Travel) -> String {
    format!("/{}/joint_trajectory", subject.program.scene.get(travel.owner).name.replace('.', "/"))
}

/// The motions, or why there are none.
fn gather(subject: Subject<'_>, performance: &Performance<'_>) -> Result<Vec<Travel>, Vec<Diagnostic>> {
    let Subject { program, wiring, sources } = subject;
    let means = Means { beside: true, conditions: true, handlers: true };
    settle(course::open(program, wiring, sources, &performance.acts, means, WHAT))?;
    let root = program.plan.get(program.plan.root).span;
    let wrong = |why: String| vec![not_expressible(root, why, "this workflow")];
    let travels = travels(program, &performance.motions).map_err(wrong)?;
    if travels.is_empty() {
        return Err(vec![
            not_expressible(root, "no robot with joints moves in this workflow", "nothing to write")
                .help("use an arm of `std::robots`, or import one with `from urdf`"),
        ]);
    }
    Ok(travels)
}

/// An MCAP file with a topic for each robot and tool, a message for each motion.
pub fn mcap(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let travels = gather(subject, performance)?;
    let root = subject.program.plan.get(subject.program.plan.root).span;
    let written = pack(subject, &travels).map_err(|e| {
        vec![not_expressible(root, format!("the trajectories cannot be written: {e}"), "this workflow")]
    })?;
    Ok((written, Vec::new()))
}

fn pack(subject: Subject<'_>, travels: &[Travel]) -> McapResult<Vec<u8>> {
    let options = WriteOptions::new().compression(None).profile("ros2").library("matterixc");
    let mut writer = options.create(Cursor::new(Vec::new()))?;
    let schema = writer.add_schema(TYPE, "ros2msg", DEFINITION.as_bytes())?;
    let mut channels: BTreeMap<String, (u16, u32)> = BTreeMap::new();
    for travel in travels {
        let topic = topic(subject, travel);
        let (channel, sequence) = match channels.get(&topic) {
            Some(known) => *known,
            None => (writer.add_channel(schema, &topic, "cdr", &metadata(subject, travel))?, 0),
        };
        channels.insert(topic, (channel, sequence.wrapping_add(1)));
        let time = nanoseconds(travel.begins);
        let header = MessageHeader { channel_id: channel, sequence, log_time: time, publish_time: time };
        let data = JointTrajectory::of(travel, subject).cdr().map_err(std::io::Error::other)?;
        writer.write_to_known_channel(&header, &data)?;
    }
    writer.attach(&mcap::Attachment {
        log_time: 0,
        create_time: 0,
        name: "steps.json".to_owned(),
        media_type: "application/json".to_owned(),
        data: Cow::Owned(format!("{:#}\n", steps(subject, travels)).into_bytes()),
    })?;
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

fn metadata(subject: Subject<'_>, travel: &Travel) -> BTreeMap<String, String> {
    let of = |id| subject.program.scene.get(id);
    let robot = ("robot".to_owned(), of(travel.robot).name.clone());
    BTreeMap::from([robot, ("kind".to_owned(), of(travel.owner).kind.clone())])
}

/// Which statement each motion comes from, in the order of the motions.
fn steps(subject: Subject<'_>, travels: &[Travel]) -> Value {
    let origins = place::origins(&subject.program.plan, subject.sources);
    let step = |travel: &Travel| {
        let at = origins.get(travel.step.0 as usize).copied().unwrap_or_default();
        let (file, line, _) = place::line(subject.sources, at);
        json!({
            "topic": topic(subject, travel),
            "time": travel.begins,
            "file": file,
            "line": line,
            "step": subject.program.plan.get(travel.step).label,
        })
    };
    travels.iter().map(step).collect()
}

/// The same as JSON: an object with the list `trajectories`.
pub fn json(subject: Subject<'_>, performance: &Performance<'_>) -> Written {
    let travels = gather(subject, performance)?;
    let root = subject.program.plan.get(subject.program.plan.root).span;
    let mut list = Vec::new();
    let Value::Array(steps) = steps(subject, &travels) else { return Ok((Vec::new(), Vec::new())) };
    for (travel, step) in travels.iter().zip(steps) {
        let message = serde_json::to_value(JointTrajectory::of(travel, subject)).map_err(|e| {
            vec![not_expressible(root, format!("the trajectories cannot be written: {e}"), "this workflow")]
        })?;
        let mut entry = Map::new();
        for part in [step, message] {
            if let Value::Object(part) = part {
                entry.extend(part);
            }
        }
        list.push(Value::Object(entry));
    }
    Ok((format!("{:#}\n", json!({ "type": TYPE, "trajectories": list })).into_bytes(), Vec::new()))
}
