//! Recordings as documents: what is read, and what is said of files that are none.

use std::collections::BTreeMap;
use std::io::Cursor;

use matterix_view::document::{Cavity, Finish, Origin, Pose, State};
use matterix_view::from_recording::{from_recording, is_recording};
use mcap::records::{MessageHeader, Metadata};
use serde_json::{Value, json};

/// A recording with these messages: topic, time in s, content.
fn recording(messages: &[(&str, f64, Value)]) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Lz4))
        .create(Cursor::new(Vec::new()))
        .expect("a writer");
    let entries = [("workflow", "mix"), ("lab", "bench"), ("seed", "7"), ("argument target", "40 degC")];
    let metadata = entries.into_iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
    writer.write_metadata(&Metadata { name: "matterix.run".into(), metadata }).expect("metadata");
    let attachment = mcap::Attachment {
        log_time: 0,
        create_time: 0,
        name: "mix.mtx".into(),
        media_type: "text/x-matterix".into(),
        data: b"mtx 1\n".as_slice().into(),
    };
    writer.attach(&attachment).expect("an attachment");
    let mut channels = BTreeMap::new();
    for (topic, time, content) in messages {
        let units = [("unit property.volume", "mL"), ("unit concentration.I2", "mol/L"), ("unit value", "g")];
        let units = units.into_iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
        let channel =
            *channels.entry(*topic).or_insert_with(|| writer.add_channel(0, topic, "json", &units).expect("a channel"));
        let time = (time * 1e9) as u64;
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, content.to_string().as_bytes()).expect("a message");
    }
    writer.finish().expect("an end");
    writer.into_inner().into_inner()
}

fn entity(id: &str, size: [f64; 3], round: bool, z: f64) -> Value {
    let solid = json!([{
        "pose": { "position": { "x": 0.0, "y": 0.0, "z": z + size[2] / 2.0 }, "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 } },
        "size": { "x": size[0], "y": size[1], "z": size[2] },
        "color": { "r": 0.62, "g": 0.666, "b": 0.7, "a": 0.85 }
    }]);
    let (cubes, cylinders) = if round { (json!([]), solid) } else { (solid, json!([])) };
    json!({ "id": id, "metadata": [{ "key": "kind", "value": "Thing" }], "cubes": cubes, "cylinders": cylinders })
}

fn transform(parent: &str, child: &str, [x, y, z]: [f64; 3]) -> Value {
    json!({
        "parent_frame_id": parent, "child_frame_id": child,
        "translation": { "x": x, "y": y, "z": z }, "rotation": { "x": 0, "y": 0, "z": 0, "w": 1 }
    })
}

fn node(id: u32, label: &str, path: &str, state: &str) -> Value {
    json!({ "id": id, "label": label, "path": path, "state": state, "file": "mix.mtx", "line": 4 })
}

fn contents(volume: f64, iodine: f64) -> Value {
    let color = [1.0 - iodine, 1.0 - iodine, 1.0];
    json!({
        "amount": { "water": 5.0 },
        "concentration": { "I2": iodine },
        "property": { "volume": volume, "color": color }
    })
}

fn mix() -> Vec<u8> {
    let pending = |id, label, path| ("/plan", 0.0, node(id, label, path, "pending"));
    recording(&[
        (
            "/scene",
            0.0,
            json!({ "entities": [entity("table", [1.0, 0.6, 0.05], false, 0.0), entity("b1", [0.06, 0.06, 0.1], true, 0.05)] }),
        ),
        (
            "/tf",
            0.0,
            json!({ "transforms": [
                transform("lab", "table", [0.0, 0.0, 0.0]),
                transform("lab", "b1", [0.0, 0.0, 0.05]),
                transform("b1", "b1.grasp", [0.0, 0.0, 0.06]),
            ] }),
        ),
        ("/contents/b1.contents", 0.0, contents(0.0, 0.0)),
        ("/state/b1", 0.0, json!({ "support": "table", "sealed": false })),
        ("/readings/scale.mass", 2.0, json!({ "value": 31.5 })),
        pending(0, "wait 2 s", "mix > pour a > wait 2 s"),
        pending(1, "sequence", "mix > pour a"),
        pending(2, "pour a", "mix > pour a"),
        pending(3, "wait 2 s", "mix > pour a > wait 2 s"),
        pending(4, "sequence", "mix > pour a"),
        pending(5, "pour a", "mix > pour a"),
        pending(6, "if a > b", "mix > if a > b"),
        pending(7, "sequence", "mix"),
        ("/plan", 0.0, node(7, "sequence", "mix", "running")),
        ("/plan", 0.0, node(2, "pour a", "mix > pour a", "running")),
        ("/plan", 0.0, node(0, "wait 2 s", "mix > pour a > wait 2 s", "running")),
        ("/plan", 2.0, node(0, "wait 2 s", "mix > pour a > wait 2 s", "done")),
        ("/tf", 4.0, json!({ "transforms": [transform("lab", "b1", [0.2, 0.0, 0.05])] })),
        ("/contents/b1.contents", 5.0, contents(100.0, 0.5)),
        ("/contents/b1.contents", 10.0, contents(200.0, 1.0)),
        ("/state/b1", 6.0, json!({ "support": "table", "sealed": true })),
        ("/log", 6.0, json!({ "level": 4, "message": "slip", "file": "mix.mtx", "line": 4 })),
        ("/plan", 10.0, node(2, "pour a", "mix > pour a", "failed")),
        ("/plan", 10.0, node(7, "sequence", "mix", "failed")),
    ])
}

#[test]
fn things_and_how_they_move() {
    let document = from_recording(&mix()).expect("a recording");
    assert_eq!((document.workflow.as_str(), document.lab.as_str(), document.duration), ("mix", "bench", Some(10.0)));
    assert!(document.facts.contains(&("target".into(), "40 degC".into())));
    let [table, vessel] = document.bodies.as_slice() else { panic!("{:?}", document.bodies) };
    assert_eq!((table.name.as_str(), table.pieces[0].finish, table.pieces[0].color), ("table", Finish::Matte, None));
    assert_eq!(table.pieces[0].pose.0[2], 0.025);
    assert_eq!(vessel.pieces[0].finish, Finish::Glass);
    assert_eq!(vessel.frames[0].name, "grasp");
    let Some(Cavity::Round(line)) = &vessel.cavity else { panic!("{:?}", vessel.cavity) };
    assert!(line.windows(2).all(|w| w[0][1] < w[1][1] && w[1][0] < 0.03), "{line:?}");
    let [track] = document.tracks.as_slice() else { panic!("{:?}", document.tracks) };
    assert_eq!((track.body, track.smooth, track.times.as_slice()), (1, false, [0.0, 4.0].as_slice()));
    assert_eq!(track.poses[1], Pose([0.2, 0.0, 0.05, 0.0, 0.0, 0.0, 1.0]));
}

#[test]
fn what_is_in_them() {
    let document = from_recording(&mix()).expect("a recording");
    let contents = &document.contents[0];
    let (volume, size) = contents.volume.expect("a volume");
    let series = &document.series[volume as usize];
    assert_eq!(
        (contents.body, size, series.name.as_str(), series.unit.as_str()),
        (Some(1), 1e-6, "b1.contents.volume", "mL")
    );
    // The middle sample lies on the straight line and is left out.
    assert_eq!(document.axes[series.axis as usize], [0.0, 10.0]);
    assert_eq!(series.values, [Some(0.0), Some(200.0)]);
    let blue = contents.color.map(|c| document.series[c[2] as usize].values.clone());
    assert_eq!(blue, Some(vec![Some(1.0), Some(1.0)]));
    let sealed = document.words.iter().find(|w| w.name == "b1.sealed").expect("words");
    assert_eq!((sealed.times.as_slice(), sealed.words.join(" ")), ([0.0, 6.0].as_slice(), "no yes".to_owned()));
    let reading = document.series.iter().find(|s| s.origin == Origin::Reading).expect("a reading");
    assert_eq!((reading.name.as_str(), reading.unit.as_str()), ("scale.mass", "g"));
}

#[test]
fn what_was_done() {
    let document = from_recording(&mix()).expect("a recording");
    let tree: Vec<(&str, Option<u32>)> = document.plan.iter().map(|n| (n.label.as_str(), n.parent)).collect();
    let expected =
        [("pour a", None), ("wait 2 s", Some(0)), ("pour a", None), ("wait 2 s", Some(2)), ("if a > b", None)];
    assert_eq!(tree, expected);
    assert_eq!(document.ended, Some(State::Failed));
    assert_eq!((document.plan[0].runs[0].end, document.plan[0].runs[0].state), (Some(10.0), State::Failed));
    assert_eq!(document.plan[0].place, Some((0, 4)));
    assert_eq!((document.log[0].text.as_str(), document.sources[0].text.as_str()), ("slip", "mtx 1\n"));
}

#[test]
fn what_is_no_recording_is_refused_in_words() {
    assert!(!is_recording(b"mtx 1\n"));
    assert_eq!(from_recording(b"mtx 1\n").expect_err("no recording").to_string(), "this is not an MCAP file");
    let empty = from_recording(&recording(&[])).expect_err("of no run").to_string();
    assert!(empty.contains("not the recording of a run"), "{empty}");
}

#[test]
fn a_damaged_file_is_read_or_refused_but_never_a_panic() {
    let whole = mix();
    for length in (0..whole.len()).step_by(97) {
        let _ = from_recording(&whole[..length]);
    }
    for place in (8..whole.len()).step_by(31) {
        let mut changed = whole.clone();
        changed[place] ^= 0x55;
        let _ = from_recording(&changed);
    }
}

#[test]
fn odd_content_is_passed_over() {
    let document = from_recording(&recording(&[
        ("/scene", 0.0, json!({ "entities": [{ "id": "a", "cubes": [{}] }, 3, { "cylinders": null }] })),
        ("/tf", 0.0, json!({ "transforms": [{ "child_frame_id": "a" }, "x"] })),
        ("/contents/a.contents", 0.0, json!([1, 2])),
        ("/state/a", 1.0, json!({ "x": [], "y": null, "z": { "w": [1, "2"] } })),
        ("/plan", 0.0, json!({ "id": "first" })),
    ]))
    .expect("a recording");
    assert_eq!(document.bodies[0].name, "a");
}

#[test]
fn each_field_has_the_times_of_its_own_points() {
    let water = |time, value: f64| ("/contents/a.contents", time, json!({ "amount": { "water": value } }));
    let document = from_recording(&recording(&[
        ("/scene", 0.0, json!({ "entities": [entity("a", [0.1, 0.1, 0.1], true, 0.0)] })),
        ("/contents/a.contents", 0.0, json!({ "amount": { "water": 1.0 }, "property": { "warm": 20.0 } })),
        water(3.0, 1.0),
        water(4.0, 9.0),
        ("/contents/a.contents", 8.0, json!({ "amount": { "water": 9.0 }, "property": { "warm": 30.0 } })),
    ]))
    .expect("a recording");
    let times = |label: &str| {
        let series = document.series.iter().find(|s| s.label == label).expect("a series");
        document.axes[series.axis as usize].clone()
    };
    assert_eq!((times("water"), times("warm")), (vec![0.0, 3.0, 4.0, 8.0], vec![0.0, 8.0]));
}
