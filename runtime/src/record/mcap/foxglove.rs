//! The messages of Foxglove's well-known schemas that a run uses, with their schemas.
//!
//! Names and fields are those of the `schemas/jsonschema` folder of the public repository `foxglove/foxglove-sdk`; kinds of
//! primitives that a run never draws are declared as lists of objects.

use serde::Serialize;
use serde_json::{Value, json};

use super::schema::{count, list, number, object, text, truth};
use matterix_ir::scene::Pose as Stand;

/// A time since the start of the run.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Time {
    sec: u64,
    nsec: u64,
}

impl Time {
    /// From seconds.
    pub(super) fn new(time: f64) -> Self {
        let ns = super::nanoseconds(time);
        Time { sec: ns / 1_000_000_000, nsec: ns % 1_000_000_000 }
    }
}

/// `foxglove.Log`.
#[derive(Serialize)]
pub(super) struct Log<'a> {
    pub(super) timestamp: Time,
    /// 1 debug, 2 info, 3 warning, 4 error.
    pub(super) level: u8,
    pub(super) message: &'a str,
    pub(super) name: &'a str,
    pub(super) file: &'a str,
    pub(super) line: usize,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Vector3 {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Pose {
    position: Vector3,
    orientation: Quaternion,
}

/// Red, green, blue, opacity, each 0 to 1.
#[derive(Clone, Copy, Default, PartialEq, Serialize)]
pub(super) struct Color {
    pub(super) r: f64,
    pub(super) g: f64,
    pub(super) b: f64,
    pub(super) a: f64,
}

#[derive(Serialize)]
pub(super) struct Cube {
    pub(super) pose: Pose,
    pub(super) size: Vector3,
    pub(super) color: Color,
}

#[derive(Serialize)]
pub(super) struct Cylinder {
    pub(super) pose: Pose,
    pub(super) size: Vector3,
    pub(super) bottom_scale: f64,
    pub(super) top_scale: f64,
    pub(super) color: Color,
}

/// Triangles without normals, each corner for itself or by index.
#[derive(Serialize)]
pub(super) struct Triangles {
    pub(super) pose: Pose,
    pub(super) points: Vec<Vector3>,
    pub(super) color: Color,
    pub(super) colors: [(); 0],
    pub(super) indices: Vec<u32>,
}

#[derive(Serialize)]
pub(super) struct Text<'a> {
    pub(super) pose: Pose,
    pub(super) billboard: bool,
    pub(super) font_size: f64,
    pub(super) scale_invariant: bool,
    pub(super) color: Color,
    pub(super) text: &'a str,
}

#[derive(Serialize)]
pub(super) struct KeyValue<'a> {
    pub(super) key: &'a str,
    pub(super) value: &'a str,
}

/// An entity of `foxglove.SceneUpdate`.
#[derive(Serialize)]
pub(super) struct Entity<'a> {
    pub(super) timestamp: Time,
    pub(super) frame_id: &'a str,
    pub(super) id: &'a str,
    pub(super) lifetime: Time,
    pub(super) frame_locked: bool,
    pub(super) metadata: Vec<KeyValue<'a>>,
    pub(super) arrows: [(); 0],
    pub(super) cubes: Vec<Cube>,
    pub(super) spheres: Vec<Cube>,
    pub(super) cylinders: Vec<Cylinder>,
    pub(super) lines: [(); 0],
    pub(super) triangles: Vec<Triangles>,
    pub(super) texts: Vec<Text<'a>>,
    pub(super) models: [(); 0],
}

/// `foxglove.SceneUpdate`.
#[derive(Serialize)]
pub(super) struct SceneUpdate<'a> {
    pub(super) deletions: [(); 0],
    pub(super) entities: Vec<Entity<'a>>,
}

/// An entry of `foxglove.FrameTransforms`.
#[derive(Serialize)]
pub(super) struct FrameTransform {
    pub(super) timestamp: Time,
    pub(super) parent_frame_id: String,
    pub(super) child_frame_id: String,
    pub(super) translation: Vector3,
    pub(super) rotation: Quaternion,
}

/// An entry of `foxglove.JointStates`.
#[derive(Serialize)]
pub(super) struct JointState<'a> {
    pub(super) name: &'a str,
    /// rad or m.
    pub(super) position: f64,
    /// rad/s or m/s.
    pub(super) velocity: f64,
    /// rad/s2 or m/s2.
    pub(super) acceleration: f64,
}

/// `foxglove.JointStates`.
#[derive(Serialize)]
pub(super) struct JointStates<'a> {
    pub(super) timestamp: Time,
    pub(super) joints: Vec<JointState<'a>>,
}

/// `foxglove.FrameTransforms`.
#[derive(Serialize)]
pub(super) struct FrameTransforms {
    pub(super) transforms: Vec<FrameTransform>,
}

/// A vector, metres.
pub(super) fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

/// A rotation.
pub(super) fn quaternion([x, y, z, w]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

/// Where something stands.
pub(super) fn pose(at: Stand) -> Pose {
    Pose { position: vector(at.position), orientation: quaternion(at.rotation) }
}

/// Schema of [`Log`].
pub(super) fn log_schema() -> Value {
    let level = |value: u8, title: &str| json!({ "title": title, "const": value });
    let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let levels: Vec<Value> = levels.iter().zip(0..).map(|(title, value)| level(value, title)).collect();
    object(
        "foxglove.Log",
        [
            ("timestamp", time_schema("time", "Timestamp of log message")),
            ("level", json!({ "title": "foxglove.LogLevel", "description": "Log level", "oneOf": levels })),
            ("message", text("Log message")),
            ("name", text("Process or node name")),
            ("file", text("Filename")),
            ("line", count("Line number in the file")),
        ],
    )
}

/// Schema of [`SceneUpdate`].
pub(super) fn scene_schema() -> Value {
    let deletion = object(
        "foxglove.SceneEntityDeletion",
        [
            ("timestamp", time_schema("time", "Timestamp of the deletion")),
            (
                "type",
                json!({ "title": "foxglove.SceneEntityDeletionType", "oneOf": [
                { "title": "MATCHING_ID", "const": 0 }, { "title": "ALL", "const": 1 }
            ] }),
            ),
            ("id", text("Identifier which must match if type is MATCHING_ID")),
        ],
    );
    object("foxglove.SceneUpdate", [("deletions", list(deletion)), ("entities", list(entity_schema()))])
}

fn entity_schema() -> Value {
    let unused = |title: &str| list(json!({ "title": title, "type": "object" }));
    let key_value = object("foxglove.KeyValuePair", [("key", text("Key")), ("value", text("Value"))]);
    let cube = [("pose", pose_schema()), ("size", vector_schema("Size of the cube")), ("color", color_schema())];
    let cylinder = [
        ("pose", pose_schema()),
        ("size", vector_schema("Size of the cylinder's bounding box")),
        ("bottom_scale", number("0-1, ratio of the diameter of the bottom face to the bounding box")),
        ("top_scale", number("0-1, ratio of the diameter of the top face to the bounding box")),
        ("color", color_schema()),
    ];
    let triangles = [
        ("pose", pose_schema()),
        ("points", list(vector_schema("Vertex"))),
        ("color", color_schema()),
        ("colors", list(color_schema())),
        ("indices", list(count("Index into the points"))),
    ];
    let label = [
        ("pose", pose_schema()),
        ("billboard", truth("Whether the text should always face the camera")),
        ("font_size", number("Font size")),
        ("scale_invariant", truth("Whether the text should keep its size on screen")),
        ("color", color_schema()),
        ("text", text("Text")),
    ];
    object(
        "foxglove.SceneEntity",
        [
            ("timestamp", time_schema("time", "Timestamp of the entity")),
            ("frame_id", text("Frame of reference")),
            ("id", text("Identifier for the entity")),
            ("lifetime", time_schema("duration", "Time until the entity is removed; zero for never")),
            ("frame_locked", truth("Whether the entity should keep its location in the fixed frame or the given one")),
            ("metadata", list(key_value)),
            ("arrows", unused("foxglove.ArrowPrimitive")),
            ("cubes", list(object("foxglove.CubePrimitive", cube.clone()))),
            ("spheres", list(object("foxglove.SpherePrimitive", cube.clone()))),
            ("cylinders", list(object("foxglove.CylinderPrimitive", cylinder))),
            ("lines", unused("foxglove.LinePrimitive")),
            ("triangles", list(object("foxglove.TriangleListPrimitive", triangles))),
            ("texts", list(object("foxglove.TextPrimitive", label))),
            ("models", unused("foxglove.ModelPrimitive")),
        ],
    )
}

/// Schema of [`JointStates`].
pub(super) fn joints_schema() -> Value {
    let joint = object(
        "foxglove.JointState",
        [
            ("name", text("Name of the joint")),
            ("position", number("Position of the joint, in radians or metres")),
            ("velocity", number("Velocity of the joint, in radians or metres a second")),
            ("acceleration", number("Acceleration of the joint, in radians or metres a second squared")),
        ],
    );
    object(
        "foxglove.JointStates",
        [("timestamp", time_schema("time", "Time of the positions")), ("joints", list(joint))],
    )
}

/// Schema of [`FrameTransforms`].
pub(super) fn transforms_schema() -> Value {
    let transform = object(
        "foxglove.FrameTransform",
        [
            ("timestamp", time_schema("time", "Timestamp of transform")),
            ("parent_frame_id", text("Name of the parent frame")),
            ("child_frame_id", text("Name of the child frame")),
            ("translation", vector_schema("Translation component of the transform")),
            ("rotation", quaternion_schema()),
        ],
    );
    object("foxglove.FrameTransforms", [("transforms", list(transform))])
}

fn time_schema(title: &str, description: &str) -> Value {
    json!({
        "title": title,
        "type": "object",
        "description": description,
        "properties": {
            "sec": { "type": "integer", "minimum": 0 },
            "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 }
        }
    })
}

fn vector_schema(description: &str) -> Value {
    let mut schema = object("foxglove.Vector3", ["x", "y", "z"].map(|k| (k, number(&format!("{k} component")))));
    schema["description"] = json!(description);
    schema
}

fn quaternion_schema() -> Value {
    object("foxglove.Quaternion", ["x", "y", "z", "w"].map(|k| (k, number(&format!("{k} value")))))
}

fn pose_schema() -> Value {
    let fields = [("position", vector_schema("Position of the origin")), ("orientation", quaternion_schema())];
    object("foxglove.Pose", fields)
}

fn color_schema() -> Value {
    object("foxglove.Color", ["r", "g", "b", "a"].map(|k| (k, number("between 0 and 1"))))
}
