//! Runs that cannot go on: each says which law, line and operation is at fault, with the step that was going on.
//!
//! The texts beside the programs are written anew with `MATTERIX_UPDATE=1`, and read before they are kept.

use std::path::PathBuf;

use crate::harness::{matterixc_in, root};

/// Program, the line that is shown first, and what the first line of the fault says.
const CASES: [(&str, u64, &str); 13] = [
    ("start", 8, "a division by zero in `settling(drum)`, where `drum.load` is 0 g"),
    ("middle", 12, "a division by zero in `settling(drum)`, where `drum.load` is 0 g"),
    ("sudden", 12, "a division by zero in `charging(choke)`, where `choke.gap` is 0 mm"),
    ("pair", 20, "in `fin_heat(warm, cold, fin)`, where `fin.gap` is 0 mm"),
    ("shared", 12, "in `lamp(slab)`, where `slab.distance` is 0 cm"),
    ("function", 12, "in `settling(glass)`, where `glass.gap` is 2 mm and `glass.size` is 1 mm"),
    ("root", 11, "the square root of a negative number in `outflow(tank)`, where `tank.level` is 0.5 cm"),
    ("event", 9, "a division by zero in `reckoning(clicker)`, where `clicker.pause` is 0 s"),
    ("effect", 9, "a division by zero, where `dial.last` is 0 mm"),
    ("skill", 9, "a division by zero, where `dial.last` is 0 mm"),
    ("initial", 5, "at the start: a division by zero, where `cork.density` is 0"),
    ("stuck", 6, "mostly because of `growth(vessel)`"),
    ("breach", 17, "`leak("),
];

fn folder() -> PathBuf {
    root().join("tests/blame")
}

fn report(name: &str) -> serde_json::Value {
    let ran = matterixc_in(&folder(), &["run", "--format", "json", &format!("{name}.mtx")]);
    assert_eq!(ran.code, 1, "{name}: {}", ran.err);
    serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{name}: {e}: {}{}", ran.out, ran.err))
}

#[test]
fn every_fault_names_the_law_and_its_line() {
    for (name, line, words) in CASES {
        let failure = &report(name)["failure"];
        assert!(failure["text"].as_str().is_some_and(|text| text.contains(words)), "{name}: {failure:#}");
        assert_eq!(failure["line"].as_u64(), Some(line), "{name}: {failure:#}");
    }
}

#[test]
fn every_fault_is_shown_as_it_was() {
    for (name, ..) in CASES {
        let shown = matterixc_in(&folder(), &["run", &format!("{name}.mtx")]).err;
        let golden = folder().join(format!("{name}.txt"));
        if std::env::var_os("MATTERIX_UPDATE").is_some() {
            std::fs::write(&golden, &shown).expect("it can be written");
        }
        let before = std::fs::read_to_string(golden).expect("it is there");
        assert_eq!(shown, before, "tests/blame/{name}.txt: MATTERIX_UPDATE=1 cargo test --test cli blame, and read it");
    }
}

#[test]
fn every_program_here_is_a_case() {
    let all = std::fs::read_dir(folder()).expect("the folder is there").flatten();
    let programs = all.filter(|entry| entry.path().extension().is_some_and(|ext| ext == "mtx"));
    assert_eq!(programs.count(), CASES.len());
}
