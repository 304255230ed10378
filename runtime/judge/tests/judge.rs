//! What is wrong with recordings of a slide that carries a block, made by hand.

use std::collections::BTreeMap;
use std::io::Cursor;

use matterix_ir::bodies::{Bodies, Machine, Standing, Thing};
use matterix_ir::pose::Pose;
use matterix_ir::robot::{Joint, JointKind, JointLimits, Link, Piece, Robot, Solid};
use matterix_ir::scene::Shape;
use matterix_judge::{Wrong, judge};
use serde_json::{Value, json};

/// A sledge of 100 mm on a rail along x, 1 m long, at most at 0.5 m/s.
fn slide() -> Robot {
    let piece = |size| Piece { placement: Pose::IDENTITY, solid: Solid::Cuboid(size), color: None };
    let link =
        |name: &str, collision: Vec<Piece>| Link { name: name.into(), inertial: None, visual: Vec::new(), collision };
    let limits =
        JointLimits { lower: 0.0, upper: 1.0, velocity: 0.5, effort: 1.0, acceleration: Some(2.0), jerk: None };
    let joint = Joint {
        name: "x".into(),
        kind: JointKind::Prismatic,
        parent: 0,
        child: 1,
        origin: Pose::up(0.3),
        axis: [1.0, 0.0, 0.0],
        limits: Some(limits),
        mimic: None,
    };
    let links = vec![link("rail", Vec::new()), link("sledge", vec![piece([0.1; 3])])];
    Robot { name: "slide".into(), links, joints: vec![joint], ..Robot::default() }
}

fn thing(name: &str, shape: Shape) -> Thing {
    Thing { name: name.into(), whole: name.into(), shape: Some(shape), ..Thing::default() }
}

/// A run of the slide from 0 along x in steps of 40 ms.
struct Run {
    /// What the slide does at a time, m and m/s; and the acceleration recorded.
    law: fn(f64) -> [f64; 3],
    /// Added to where the sledge is said to be, m.
    astray: f64,
    things: Vec<(Thing, [f64; 3])>,
    standing: Vec<Standing>,
    /// More messages: topic, time, s, and what it says.
    more: Vec<(&'static str, f64, Value)>,
    robot: Robot,
}

impl Run {
    fn file(&self) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let mut writer = mcap::WriteOptions::new().compression(None).create(&mut out).expect("a writer");
        let mut channels = BTreeMap::new();
        let mut push = |topic: &str, time: f64, message: Value| {
            let channel = *channels.entry(topic.to_string()).or_insert_with(|| {
                let schema = writer.add_schema(topic, "jsonschema", b"{}").expect("a schema");
                writer.add_channel(schema, topic, "json", &BTreeMap::new()).expect("a channel")
            });
            let time = (time * 1e9).round() as u64;
            let header =
                mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, message.to_string().as_bytes()).expect("a message");
        };
        let machine = Machine { name: "slide".into(), robot: self.robot.clone(), tip: 1, tools: 2 };
        let things = self.things.iter().map(|(thing, _)| thing.clone()).collect();
        let standing = self.standing.clone();
        push("/bodies", 0.0, serde_json::to_value(Bodies { things, machines: vec![machine], standing }).expect("JSON"));
        let frame = |name: &str, [x, y, z]: [f64; 3]| {
            json!({ "parent_frame_id": "lab", "child_frame_id": name, "translation": { "x": x, "y": y, "z": z },
                "rotation": { "x": 0, "y": 0, "z": 0, "w": 1 } })
        };
        for (thing, at) in &self.things {
            push("/tf", 0.0, json!({ "transforms": [frame(&thing.name, *at)] }));
        }
        for step in 0..=50 {
            let time = 0.04 * f64::from(step);
            let [x, v, a] = (self.law)(time);
            let links = [frame("slide.rail", [0.0; 3]), frame("slide.sledge", [x + self.astray, 0.0, 0.3])];
            push("/tf", time, json!({ "transforms": links }));
            push(
                "/joints",
                time,
                json!({ "joints": [{ "name": "slide.x", "position": x, "velocity": v, "acceleration": a }] }),
            );
        }
        for (topic, time, message) in &self.more {
            push(topic, *time, message.clone());
        }
        writer.finish().expect("an end");
        drop(writer);
        out.into_inner()
    }
}

/// Half a metre in two seconds, gently.
fn gently(time: f64) -> [f64; 3] {
    let turn = std::f64::consts::PI / 2.0;
    [0.25 * (1.0 - (turn * time).cos()), 0.25 * turn * (turn * time).sin(), 0.25 * turn * turn * (turn * time).cos()]
}

fn wrong(law: fn(f64) -> [f64; 3], astray: f64, things: Vec<(Thing, [f64; 3])>) -> Vec<Wrong> {
    judge(&Run { law, astray, things, standing: Vec::new(), more: Vec::new(), robot: slide() }.file())
        .expect("a verdict")
        .wrong
}

#[test]
fn a_gentle_motion_beside_things_is_right() {
    let post = thing("post", Shape::Box([0.02, 0.02, 0.5]));
    let run = Run {
        law: gently,
        astray: 0.0,
        things: vec![(post, [0.25, 0.0615, 0.0])],
        standing: Vec::new(),
        more: Vec::new(),
        robot: slide(),
    };
    let verdict = judge(&run.file()).expect("a verdict");
    assert_eq!(verdict.wrong, []);
    let looked = &verdict.looked[0];
    assert!((looked.way - 0.5).abs() < 1e-9 && looked.configurations > 250, "{looked:?}");
    assert!((0.78..0.79).contains(&looked.speed) && looked.astray < 1e-12, "{looked:?}");
}

#[test]
fn a_post_between_two_samples_is_found_where_it_stands() {
    let post = thing("post", Shape::Box([0.004, 0.02, 0.5]));
    let found = wrong(gently, 0.0, vec![(post, [0.3, 0.0, 0.0])]);
    let [Wrong::Meets { mine, other, depth, at, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((mine.as_str(), other.as_str()), ("slide.sledge", "post"));
    assert!(*depth > 0.05 && (at[0] - 0.3).abs() < 0.01, "{found:?}");
}

#[test]
fn hollow_things_are_met_at_their_walls_only() {
    let outside = vec![[0.0, 0.0], [0.2, 0.0], [0.2, 0.5]];
    let tub = |inside: Vec<[f64; 2]>| thing("tub", Shape::Turned { outside: outside.clone(), inside });
    let wide = vec![[0.0, 0.01], [0.19, 0.01], [0.19, 0.5]];
    fn little(time: f64) -> [f64; 3] {
        gently(time).map(|v| 0.2 * v)
    }
    assert_eq!(wrong(little, 0.0, vec![(tub(wide.clone()), [0.05, 0.0, 0.0])]), []);
    assert_eq!(wrong(little, 0.0, vec![(tub(Vec::new()), [0.05, 0.0, 0.0])]).len(), 1);
    assert_eq!(wrong(gently, 0.0, vec![(tub(wide), [0.05, 0.0, 0.0])]).len(), 1);
}

#[test]
fn what_stands_in_something_from_the_start_is_found() {
    let standing = |name: &str, carriers: &[&str], told| Standing {
        name: name.into(),
        carriers: carriers.iter().map(|c| (*c).to_string()).collect(),
        told,
        loose: true,
    };
    let met = |apart: f64, one: Standing, other: Standing| {
        let cube = |name| thing(name, Shape::Box([0.1; 3]));
        let things = vec![(cube("one"), [2.0, 0.0, 0.0]), (cube("other"), [2.0 + apart, 0.0, 0.05])];
        let run =
            Run { law: gently, astray: 0.0, things, standing: vec![one, other], more: Vec::new(), robot: slide() };
        judge(&run.file()).expect("a verdict").wrong
    };
    let (one, other) = (|| standing("one", &["table"], true), || standing("other", &["table"], true));
    let found = met(0.09, one(), other());
    let [Wrong::Meets { mine, other: met_by, depth, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((mine.as_str(), met_by.as_str()), ("other", "one"));
    assert!((depth - 0.01).abs() < 1e-6, "{depth}");
    assert_eq!(met(0.0985, one(), other()), [], "shapes are nominal");
    assert_eq!(met(0.09, one(), standing("other", &["one.place", "one"], true)), [], "it stands there");
    assert_eq!(met(0.09, one(), standing("other", &["table"], false)), [], "it is somewhere on the table");
    assert_eq!(met(0.09, one(), standing("other", &["stand"], false)).len(), 1, "it has that for itself");
}

#[test]
fn joints_beyond_their_limits_are_named() {
    fn far(time: f64) -> [f64; 3] {
        gently(time).map(|v| 2.2 * v)
    }
    let found = wrong(far, 0.0, Vec::new());
    let what = |w: &Wrong| match w {
        Wrong::Beyond { joint, what, .. } => format!("{joint} {what}"),
        other => format!("{other:?}"),
    };
    let mut found: Vec<String> = found.iter().map(what).collect();
    found.sort();
    assert_eq!(found, ["slide.x position", "slide.x speed"]);
}

#[test]
fn speeds_that_do_not_lead_to_positions_are_found() {
    fn asleep(time: f64) -> [f64; 3] {
        [gently(time)[0], 0.0, 0.0]
    }
    let found = wrong(asleep, 0.0, Vec::new());
    assert!(matches!(found.as_slice(), [Wrong::Jumps { .. }]), "{found:?}");
}

#[test]
fn parts_without_limits_of_acceleration_must_go_as_fast_as_they_are_said_to() {
    fn asleep(time: f64) -> [f64; 3] {
        [gently(time)[0], 0.0, 0.0]
    }
    let free = |law| {
        let mut robot = slide();
        let joint = &mut robot.joints[0];
        joint.limits = joint.limits.map(|limits| JointLimits { acceleration: None, ..limits });
        let (things, standing, more) = (Vec::new(), Vec::new(), Vec::new());
        judge(&Run { law, astray: 0.0, things, standing, more, robot }.file()).expect("a verdict").wrong
    };
    assert_eq!(free(gently), []);
    let found = free(asleep);
    let [Wrong::Jumps { joint, by, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert!(joint == "slide.x" && (by - 0.0157).abs() < 1e-3, "{found:?}");
}

#[test]
fn links_that_are_not_where_joints_put_them_are_found() {
    let found = wrong(gently, 1e-3, Vec::new());
    assert!(matches!(found.as_slice(), [Wrong::Astray { by, .. }] if (by - 1e-3).abs() < 1e-9), "{found:?}");
}

/// A tray on the sledge with a beaker of 322 mL on it, of which so much is said to be in it, mL, at these times.
fn carried(law: fn(f64) -> [f64; 3], volumes: &[(f64, f64)]) -> Vec<Wrong> {
    let (outside, inside) =
        (vec![[0.0, 0.0], [0.035, 0.0], [0.035, 0.095]], vec![[0.0, 0.002], [0.0332, 0.002], [0.0332, 0.095]]);
    let things = vec![
        (thing("tray", Shape::Box([0.1, 0.1, 0.01])), [0.0, 0.0, 0.36]),
        (thing("cup", Shape::Turned { outside, inside }), [0.0, 0.0, 0.37]),
    ];
    let mut more = vec![("/grips", 0.0, json!({ "robot": "slide", "items": ["tray", "cup"] }))];
    let told = |(time, volume): &(f64, f64)| {
        ("/burdens", *time, json!({ "item": "cup", "loose": volume * 1e-6, "borne": null }))
    };
    more.extend(volumes.iter().map(told));
    let found = judge(&Run { law, astray: 0.0, things, standing: Vec::new(), more, robot: slide() }.file())
        .expect("a verdict")
        .wrong;
    found.into_iter().filter(|wrong| matches!(wrong, Wrong::Spills { .. })).collect()
}

#[test]
fn what_stands_on_a_thing_in_hand_runs_over_as_that_does() {
    // Half a metre in two seconds: up to 0.6 m/s2 tilt the level by 3.5 deg, and the wave twice as far; 310 mL keep to 3 deg, 250 to 30.
    assert_eq!(carried(gently, &[(0.0, 250.0)]), []);
    let found = carried(gently, &[(0.0, 310.0)]);
    let [Wrong::Spills { item, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!(item, "cup");
}

#[test]
fn a_vessel_that_is_filled_over_its_rim_while_it_stands_in_a_hand_is_found() {
    fn still(_: f64) -> [f64; 3] {
        [0.0; 3]
    }
    assert_eq!(carried(still, &[(0.0, 100.0), (1.0, 320.0)]), []);
    let found = carried(still, &[(0.0, 100.0), (1.0, 330.0), (1.5, 320.0)]);
    let [Wrong::Spills { item, volume, time, .. }] = found.as_slice() else { panic!("{found:?}") };
    assert!(item == "cup" && (volume - 8e-6).abs() < 0.2e-6 && *time == 1.0, "{found:?}");
}

#[test]
fn damaged_files_are_refused() {
    for bytes in [b"".as_slice(), b"hello", b"\x89MCAP0\r\n"] {
        assert!(judge(bytes).is_err());
    }
    let whole =
        Run { law: gently, astray: 0.0, things: Vec::new(), standing: Vec::new(), more: Vec::new(), robot: slide() }
            .file();
    for length in (0..whole.len()).step_by(97) {
        let _ = judge(&whole[..length]);
    }
}
