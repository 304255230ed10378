//! Protocols with one fault each, their twins without it, and further clean ones: what a check finds of them.
//!
//! They were written from the reference, not from the checker; those of `tests/motions` have their faults in space. `found.tsv` holds the first finding of each; it is written
//! anew with `MATTERIX_UPDATE=1`, and read before it is kept.

use std::collections::BTreeMap;
use std::path::Path;

use crate::harness::{matterixc, root};

/// The protocols of a folder, in order.
fn files(folder: &str) -> Vec<String> {
    let mut out: Vec<String> = std::fs::read_dir(root().join(folder))
        .expect("the folder is there")
        .map(|entry| entry.expect("it can be read").path().display().to_string())
        .filter(|name| name.ends_with(".mtx"))
        .collect();
    out.sort();
    out
}

/// Severity, code and line of the findings of each file that has any.
fn findings(folder: &str) -> BTreeMap<String, Vec<(String, String, u64)>> {
    let files = files(folder);
    let mut args = vec!["check", "--format", "json"];
    args.extend(files.iter().map(String::as_str));
    let mut out: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for line in matterixc(&args).out_lines() {
        let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
        let at = &line["span"]["start"]["line"];
        let file = text(&line["span"]["file"]);
        let name = Path::new(&file).file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        out.entry(name).or_default().push((
            text(&line["severity"]),
            text(&line["code"]),
            at.as_u64().unwrap_or_default(),
        ));
    }
    out
}

#[test]
fn every_fault_is_found() {
    every_one_is_found("tests/faults");
}

#[test]
fn every_fault_in_space_is_found() {
    every_one_is_found("tests/motions");
}

fn every_one_is_found(folder: &str) {
    let found = findings(folder);
    let mut table = String::new();
    for file in files(folder) {
        let name = Path::new(&file).file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let Some((severity, code, line)) = found.get(&name).and_then(|all| all.first()) else {
            panic!("`{name}`: nothing is found");
        };
        table.push_str(&format!("{name}\t{severity}\t{code}\t{line}\n"));
    }
    let golden = root().join(folder).join("found.tsv");
    if std::env::var_os("MATTERIX_UPDATE").is_some() {
        std::fs::write(&golden, &table).expect("the table can be written");
    }
    assert_eq!(table, std::fs::read_to_string(golden).expect("the table is there"));
}

#[test]
fn what_has_no_fault_has_no_error() {
    for folder in ["tests/faults/twins", "tests/faults/clean", "tests/motions/twins"] {
        for (name, all) in findings(folder) {
            assert!(all.iter().all(|(severity, ..)| severity != "error"), "{folder}/{name}: {all:?}");
        }
    }
}
