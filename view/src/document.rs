//! What the page shows, as data: SI but for series, which are in the unit they are shown in. The page reads its JSON.

use serde::{Deserialize, Serialize};

/// Version of the serialised form; the page refuses any other.
pub const DOCUMENT_VERSION: u32 = 1;

/// A lab, and what happened in it where there is a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// [`DOCUMENT_VERSION`].
    pub version: u32,
    /// Name of the workflow; empty for a lab by itself.
    pub workflow: String,
    /// Name of the lab.
    pub lab: String,
    /// When the last thing happened, s; absent for a lab in which nothing has happened yet.
    pub duration: Option<f64>,
    /// How the workflow as a whole stands at the end; absent where it is not known.
    pub ended: Option<State>,
    /// What else is known of the run, by name: `seed`, `fidelity`, arguments.
    pub facts: Vec<(String, String)>,
    /// What is seen.
    pub bodies: Vec<Body>,
    /// Triangles that pieces refer to.
    pub meshes: Vec<Mesh>,
    /// How bodies move; one without a track stays where it is.
    pub tracks: Vec<Track>,
    /// What is in vessels.
    pub contents: Vec<Contents>,
    /// Times that series share, s, ascending; two equal times are the values before and after a jump.
    pub axes: Vec<Vec<f64>>,
    /// Numbers over time.
    pub series: Vec<Series>,
    /// Words over time.
    pub words: Vec<Words>,
    /// The tree of the workflow, parents before children.
    pub plan: Vec<Node>,
    /// In order of time.
    pub log: Vec<LogLine>,
    /// In order of time.
    pub expectations: Vec<Expectation>,
    /// Files that the plan comes from.
    pub sources: Vec<Source>,
}

/// Position in metres and unit quaternion: x, y, z, qx, qy, qz, qw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose(pub [f32; 7]);

impl Default for Pose {
    fn default() -> Self {
        Pose([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    }
}

/// A rigid thing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Full name: `beaker`, `plate[A1]`, `panda.link3`.
    pub name: String,
    /// Its asset type; empty where there is none.
    pub kind: String,
    /// The body it is a part of. Poses are in the lab all the same.
    pub parent: Option<u32>,
    /// In the lab, at the start.
    pub pose: Pose,
    /// What is seen of it.
    pub pieces: Vec<Piece>,
    /// Where a liquid stands in it.
    pub cavity: Option<Cavity>,
    /// Its named points.
    pub frames: Vec<Frame>,
}

/// A solid somewhere on a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Relative to the body.
    pub pose: Pose,
    /// What it is.
    pub solid: Solid,
    /// What it is made of, as far as it is seen.
    pub finish: Finish,
    /// Red, green, blue, opacity, each 0 to 1; the page chooses where there is none.
    pub color: Option<[f32; 4]>,
}

/// A solid, its own origin at its middle; metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solid {
    /// Edge lengths along x, y, z.
    Cuboid([f32; 3]),
    /// Radius and length, along z.
    Cylinder([f32; 2]),
    /// Radius.
    Sphere(f32),
    /// Radius and length of the straight part, along z.
    Capsule([f32; 2]),
    /// A closed line of radius and height that is turned about z; its origin is where its heights count from.
    Lathe(Vec<[f32; 2]>),
    /// Index of the mesh, and its scale along x, y, z.
    Mesh(u32, [f32; 3]),
}

/// How a surface looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Finish {
    /// Painted or cast.
    #[default]
    Matte,
    /// Bare metal.
    Metal,
    /// A wall one sees through.
    Glass,
    /// The outline of something that other bodies are in.
    Hull,
}

/// Room for a liquid, in the frame of its body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cavity {
    /// Inner radius over height, from the bottom up; metres.
    Round(Vec<[f32; 2]>),
    /// Edge lengths x, y, z and the height of its bottom; metres.
    Boxed([f32; 3], f32),
}

/// A named point of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// `grasp`.
    pub name: String,
    /// Relative to the body.
    pub pose: Pose,
}

/// Triangles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// x, y, z of each vertex; metres before scaling.
    pub positions: Vec<f32>,
    /// Three a triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

/// Where a body is, over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Index of the body.
    pub body: u32,
    /// s, ascending.
    pub times: Vec<f64>,
    /// In the lab, one a time.
    pub poses: Vec<Pose>,
    /// Whether it goes straight from pose to pose and turns evenly; otherwise it stays until the next time.
    pub smooth: bool,
}

/// What is in a vessel, as series.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Contents {
    /// Name of the mixture.
    pub name: String,
    /// The body it is in, if that is seen.
    pub body: Option<u32>,
    /// Series of its volume and the cubic metres of one of its unit.
    pub volume: Option<(u32, f64)>,
    /// Series of red, green and blue of light that went through it, 0 to 1; clear where absent.
    pub color: Option<[u32; 3]>,
    /// What is listed of it: a title and series.
    pub groups: Vec<(String, Vec<u32>)>,
}

/// A number over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Full name, as in a program: `beaker.contents[EtI]`.
    pub name: String,
    /// What it is called beside others of its kind: `EtI`.
    pub label: String,
    /// The body that it belongs to, if one does.
    pub body: Option<u32>,
    /// Where it comes from.
    pub origin: Origin,
    /// As shown.
    pub unit: String,
    /// Index of its times.
    pub axis: u32,
    /// One a time; absent where there is no number.
    pub values: Vec<Option<f32>>,
}

/// Where a series comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// A state of a thing.
    #[default]
    State,
    /// A mixture.
    Contents,
    /// What a device reported.
    Reading,
    /// What the workflow recorded.
    Record,
}

/// A word over time: a truth value, a place, a mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Words {
    /// Full name: `panda.holding`.
    pub name: String,
    /// The body that it belongs to, if one does.
    pub body: Option<u32>,
    /// When it changes, s.
    pub times: Vec<f64>,
    /// From then on.
    pub words: Vec<String>,
}

/// A node of the plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// The node above, of a lower index.
    pub parent: Option<u32>,
    /// As shown.
    pub label: String,
    /// Index of its source and line from 1.
    pub place: Option<(u32, u32)>,
    /// Each time it was carried out.
    pub runs: Vec<Interval>,
}

/// One time that a node was carried out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// s.
    pub start: f64,
    /// s; absent if it never ended.
    pub end: Option<f64>,
    /// Its last state.
    pub state: State,
}

/// Where a node of the plan stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Begun, not ended.
    Running,
    /// Ended as intended.
    Done,
    /// Ended by a failure.
    Failed,
    /// Passed over, or stopped because a sibling failed.
    Skipped,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogLine {
    /// s.
    pub time: f64,
    /// How much it matters.
    pub level: Level,
    /// In words.
    pub text: String,
    /// Index of its source and line from 1.
    pub place: Option<(u32, u32)>,
}

/// How much a line of the log matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Notes and what is done.
    Info,
    /// Something may be wrong.
    Warning,
    /// A failure.
    Error,
}

/// An expectation, judged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Expectation {
    /// s.
    pub time: f64,
    /// As written.
    pub text: String,
    /// Whether it held.
    pub passed: bool,
    /// What was found: `first: 48 g`.
    pub found: Vec<String>,
    /// Index of its source and line from 1.
    pub place: Option<(u32, u32)>,
}

/// A source file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// As named in findings.
    pub name: String,
    /// Whole text; empty where it is not known.
    pub text: String,
}
