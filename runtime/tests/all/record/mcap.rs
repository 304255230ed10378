//! The MCAP file, read back.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

use serde_json::Value;

use super::fixture::{self, Lab};

fn bytes(lab: &Lab) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    matterix_runtime::record::mcap::write(&lab.run(), &mut out, &std::env::temp_dir())
        .expect("memory takes every byte");
    out.into_inner()
}

/// All messages by topic: time in ns and content.
fn messages(bytes: &[u8]) -> BTreeMap<String, Vec<(u64, Value)>> {
    let mut topics: BTreeMap<String, Vec<(u64, Value)>> = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).expect("magic") {
        let message = message.expect("message");
        assert_eq!(message.channel.message_encoding, "json");
        let value = serde_json::from_slice(&message.data).expect("JSON");
        topics.entry(message.channel.topic.clone()).or_default().push((message.log_time, value));
    }
    topics
}

/// Whether a value has the shape its schema says; the path of the first difference.
fn differs(schema: &Value, value: &Value, path: &str) -> Option<String> {
    let kind = if value.is_i64() || value.is_u64() { "integer" } else { kind(value) };
    let wanted: BTreeSet<&str> = match &schema["type"] {
        Value::String(one) => BTreeSet::from([one.as_str()]),
        Value::Array(list) => list.iter().filter_map(Value::as_str).collect(),
        _ => return None,
    };
    if !(wanted.contains(kind) || kind == "integer" && wanted.contains("number")) {
        return Some(format!("{path}: {kind} for {wanted:?}"));
    }
    if let Value::Object(fields) = value {
        let declared = schema["properties"].as_object().expect("properties");
        let required = schema["required"].as_array().map_or(&[][..], Vec::as_slice);
        let missing = required.iter().filter_map(Value::as_str).find(|name| !fields.contains_key(*name));
        if let Some(name) = missing.or(fields.keys().map(String::as_str).find(|name| !declared.contains_key(*name))) {
            return Some(format!("{path}: {name} is missing or not declared"));
        }
        return fields.iter().find_map(|(k, v)| differs(&declared[k], v, &format!("{path}.{k}")));
    }
    value.as_array()?.iter().find_map(|v| differs(&schema["items"], v, &format!("{path}[]")))
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

#[test]
fn two_writes_are_equal_to_the_last_byte() {
    assert_eq!(bytes(&fixture::lab()), bytes(&fixture::lab()));
}

#[test]
fn every_message_has_the_fields_of_its_schema() {
    let data = bytes(&fixture::lab());
    let mut seen = BTreeSet::new();
    for message in mcap::MessageStream::new(&data).expect("magic") {
        let message = message.expect("message");
        let schema = message.channel.schema.as_ref().expect("schema");
        assert_eq!(schema.encoding, "jsonschema");
        let form: Value = serde_json::from_slice(&schema.data).expect("JSON");
        assert_eq!(form["title"], Value::String(schema.name.clone()));
        let value: Value = serde_json::from_slice(&message.data).expect("JSON");
        assert_eq!(differs(&form, &value, &message.channel.topic), None);
        seen.insert((message.channel.topic.clone(), schema.name.clone()));
    }
    let topics: Vec<&str> = seen.iter().map(|s| s.0.as_str()).collect();
    let wanted = [
        "/bodies",
        "/contents/beaker.contents",
        "/events",
        "/expectations",
        "/log",
        "/plan",
        "/processes",
        "/readings/hotplate.probe",
        "/records/probe",
        "/scene",
        "/state/beaker",
        "/state/beaker.contents",
        "/state/bench",
        "/state/hotplate",
        "/tf",
    ];
    assert_eq!(topics, wanted);
    assert!(seen.contains(&("/scene".into(), "foxglove.SceneUpdate".into())));
    assert!(seen.contains(&("/log".into(), "foxglove.Log".into())));
}

#[test]
fn times_are_nanoseconds_of_the_virtual_clock_in_order() {
    let data = bytes(&fixture::lab());
    let times: Vec<u64> =
        mcap::MessageStream::new(&data).expect("magic").map(|m| m.expect("message").log_time).collect();
    assert!(times.is_sorted());
    assert_eq!((times.first(), times.last()), (Some(&0), Some(&2_000_000_000_000)));
    assert_eq!(messages(&data)["/events"][0].0, 8_000_000_000);
}

#[test]
fn states_are_in_the_unit_shown_and_written_only_around_changes() {
    let topics = messages(&bytes(&fixture::lab()));
    let beaker: Vec<(u64, &str)> =
        topics["/state/beaker"].iter().map(|(t, v)| (*t, v["support"].as_str().expect("name"))).collect();
    assert_eq!(
        beaker,
        [(0, "table"), (7_500_000_000, "table"), (8_000_000_000, "hotplate"), (2_000_000_000_000, "hotplate")]
    );
    let (_, plate) = &topics["/state/hotplate"][0];
    assert_eq!((plate["temperature"].as_f64(), plate["active"].as_bool()), (Some(25.0), Some(false)));
}

#[test]
fn contents_are_by_species() {
    let topics = messages(&bytes(&fixture::lab()));
    let (time, first) = &topics["/contents/beaker.contents"][0];
    assert_eq!(
        (*time, first["amount"]["EtOH"].as_f64(), first["property"]["temperature"].as_f64()),
        (0, Some(0.012), Some(25.0))
    );
    let (_, last) = topics["/contents/beaker.contents"].last().expect("samples");
    assert!((last["concentration"]["EtI"].as_f64().expect("number") - 0.898).abs() < 0.01);
    assert_eq!(last["property"]["color"].as_array().map(Vec::len), Some(3));
}

#[test]
fn the_plan_starts_pending_and_names_paths_and_lines() {
    let topics = messages(&bytes(&fixture::lab()));
    let plan = &topics["/plan"];
    assert!(plan[..8].iter().all(|(t, v)| *t == 0 && v["state"] == "pending"));
    let wait = plan.iter().find(|(_, v)| v["label"] == "wait 2 s").expect("node");
    assert_eq!(
        (wait.1["path"].as_str(), wait.1["line"].as_u64()),
        (Some("synthesize > step grow > wait 2 s"), Some(5))
    );
    assert!(plan.iter().any(|(_, v)| v["state"] == "failed"));
}

#[test]
fn a_thing_that_is_put_on_another_moves_to_its_place() {
    let topics = messages(&bytes(&fixture::lab()));
    let height = |at: usize| -> f64 {
        let entities = topics["/scene"][at].1["entities"].as_array().expect("entities");
        let beaker = entities.iter().find(|e| e["id"] == "beaker").expect("beaker");
        beaker["cylinders"][0]["pose"]["position"]["z"].as_f64().expect("number")
    };
    assert!((height(0) - (0.75 + 0.095 / 2.0)).abs() < 1e-12, "on the table: {}", height(0));
    let moved = topics["/scene"].iter().position(|(t, _)| *t == 8_000_000_000).expect("an update at 8 s");
    assert!((height(moved) - (0.75 + 0.13 + 0.095 / 2.0)).abs() < 1e-12, "on the plate: {}", height(moved));
    let frames: Vec<&str> = topics["/tf"][0].1["transforms"]
        .as_array()
        .expect("list")
        .iter()
        .filter_map(|t| t["child_frame_id"].as_str())
        .collect();
    assert!(frames.contains(&"hotplate.place"), "{frames:?}");
    assert_eq!(topics["/tf"].len(), 2, "frames are sent when they move");
}

#[test]
fn a_ring_of_supports_does_not_hang() {
    let mut lab = fixture::lab();
    lab.program.scene.instances[0].support = Some(matterix_ir::scene::InstanceId(1));
    assert!(!bytes(&lab).is_empty());
}

#[test]
fn the_file_carries_its_text_and_its_settings() {
    let data = bytes(&fixture::lab());
    let summary = mcap::Summary::read(&data).expect("summary").expect("present");
    let attachment = mcap::read::attachment(&data, &summary.attachment_indexes[0]).expect("attachment");
    assert_eq!((attachment.name.as_str(), attachment.data.as_ref()), ("sn1.mtx", fixture::TEXT.as_bytes()));
    let run = mcap::read::metadata(&data, &summary.metadata_indexes[0]).expect("metadata");
    assert_eq!((run.metadata["seed"].as_str(), run.metadata["language"].as_str()), ("7", "1"));
}

#[test]
fn a_run_of_which_nothing_was_recorded_is_a_valid_file() {
    let mut lab = fixture::lab();
    lab.recording = matterix_runtime::record::Recording::new(&lab.program);
    lab.recording.sample(f64::NAN, &[], &[]);
    assert!(messages(&bytes(&lab)).contains_key("/scene"));
}
