//! `docs/report.md` names every field of the report and no other.

use std::collections::BTreeSet;

use matterix_runtime::record::Report;
use serde_json::Value;

use super::fixture;

/// Paths of all fields: `steps[].label`. The integrator's counters are open.
fn fields(value: &Value, path: &str, out: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) if path != "integrator" => {
            for (key, inner) in map {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                out.insert(path.clone());
                fields(inner, &path, out);
            }
        }
        Value::Array(list) => list.iter().for_each(|v| fields(v, &format!("{path}[]"), out)),
        _ => {}
    }
}

#[test]
fn every_field_is_described_and_every_description_has_a_field() {
    let mut report = Report::new(&fixture::lab().run());
    // Where an equilibrium has a species these are there too.
    let species = report.containers.iter_mut().flat_map(|c| &mut c.species).next().expect("a species");
    (species.put, species.solid) = (Some(1.0), Some(false));
    // Where its model does not hold, a property says so.
    report.containers.iter_mut().flat_map(|c| &mut c.properties).next().expect("a property").outside = true;
    let json: Value = serde_json::from_str(&report.json().expect("written")).expect("JSON");
    let mut present = BTreeSet::new();
    fields(&json, "", &mut present);
    let page = include_str!("../../../../docs/report.md");
    let described: BTreeSet<String> = page
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split_once("` |"))
        .map(|(name, _)| name.to_owned())
        .collect();
    assert_eq!(present, described);
}
