//! What is looked at of motions before a run, what is not, and what is remembered of it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::harness::{command, folder, write};

/// A Panda, two hotplates and a beaker at this place, with these steps.
fn bench(beaker: &str, steps: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::OpticalTable\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n\
         use std::robots::{{FrankaHand, FrankaPanda}}\n\nlab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
         plate = IkaRetControl on table at (450, 200) mm\n    far = IkaRetControl on table at (800, -300) mm\n    \
         beaker = Beaker250mL on table{beaker}\n}}\n\nworkflow carry in bench {{\n{steps}\n}}\n"
    )
}

const NEAR: &str = " at (450, -250) mm";

/// What a check prints, with its cache in this folder.
fn check(dir: &Path, text: &str, more: &[&str]) -> String {
    write(dir, "bench.mtx", text);
    let mut command = command();
    command.args(["check", "bench.mtx", "--format", "concise"]).args(more);
    let ended = command.current_dir(dir).env("XDG_CACHE_HOME", dir.join("cache")).output().expect("the command starts");
    String::from_utf8(ended.stdout).expect("text")
}

/// The files of the cache that say what was found in whole programs, in which files nothing, and what was found to get where; each
/// of the others is about a lab.
const PROGRAMS: &str = "programs-";
const CLEAN: &str = "clean-";
const FORESEEN: &str = "foreseen-";

/// The files of the cache.
fn kept(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir.join("cache/matterixc")).into_iter().flatten().flatten();
    let mut kept: Vec<PathBuf> = entries.map(|e| e.path()).collect();
    kept.sort();
    kept
}

/// How many checks without findings are kept. A file of the cache holds those whose keys begin alike.
fn clean(dir: &Path) -> usize {
    let files = kept(dir).into_iter().filter(|f| f.to_string_lossy().contains(CLEAN));
    let entries = |file: PathBuf| {
        let text = fs::read_to_string(file).expect("the cache");
        let (_seal, list) = text.split_once('\n').expect("a seal and a list");
        serde_json::from_str::<Vec<serde_json::Value>>(list).expect("a list").len()
    };
    files.map(entries).sum()
}

#[test]
fn a_failure_that_is_handled_is_a_warning() {
    let dir = folder("beforehand_handled");
    let other = "    try { place beaker on far by panda } else { place beaker on plate by panda }";
    let found = check(&dir, &bench(NEAR, other), &[]);
    assert!(found.contains("bench.mtx:18:11: warning[out-of-reach]"), "{found}");
    assert!(!found.contains("error["), "{found}");
    let handler = "    sequence { place beaker on far by panda } on failure { note \"too far\" }";
    let found = check(&dir, &bench(NEAR, handler), &[]);
    assert!(found.contains("warning[out-of-reach]") && !found.contains("error["), "{found}");
}

#[test]
fn what_fails_on_one_way_only_is_a_warning() {
    let dir = folder("beforehand_may");
    let steps = "    if plate.weight > 3 g { move panda to beaker.pre_grasp; slide panda to beaker.grasp }\n    \
                 grasp beaker by panda\n    set down beaker by panda";
    let found = check(&dir, &bench(NEAR, steps), &[]);
    assert!(found.contains("bench.mtx:19:5: warning[misplaced-grip]"), "{found}");
    assert!(!found.contains("error["), "{found}");
}

#[test]
fn what_has_no_known_place_is_passed_over() {
    let dir = folder("beforehand_unknown");
    let text = bench(NEAR, "    place beaker on plate by panda").replace(" at (450, 200) mm", "").replace(NEAR, "");
    let found = check(&dir, &text, &[]);
    assert!(!found.contains("reach") && !found.contains("collision"), "{found}");
}

#[test]
fn process_fidelity_leaves_motions_out() {
    let dir = folder("beforehand_process");
    let text = bench(NEAR, "    place beaker on far by panda");
    assert!(check(&dir, &text, &[]).contains("error[out-of-reach]"));
    assert!(!check(&dir, &text, &["--fidelity", "process"]).contains("out-of-reach"));
}

/// What is kept of motions in labs, and what of findings in programs.
fn labs_and_programs(dir: &Path) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let is = |file: &PathBuf, of: &str| file.file_name().is_some_and(|n| n.to_string_lossy().starts_with(of));
    kept(dir).into_iter().filter(|file| !is(file, CLEAN) && !is(file, FORESEEN)).partition(|file| !is(file, PROGRAMS))
}

#[test]
fn what_was_planned_is_remembered_and_said_in_the_same_bytes() {
    let dir = folder("beforehand_cache");
    let text = bench(NEAR, "    place beaker on plate by panda\n    place beaker on far by panda");
    let without = check(&dir, &text, &["--no-cache"]);
    assert!(without.contains("error[out-of-reach]"), "{without}");
    assert!(kept(&dir).is_empty(), "nothing is kept with `--no-cache`");
    let cold = check(&dir, &text, &[]);
    let (labs, programs) = labs_and_programs(&dir);
    assert_eq!((labs.len(), programs.len()), (1, 1), "one lab, and what was found in programs");
    let (lab, found) = (fs::read(&labs[0]).expect("the cache"), fs::read(&programs[0]).expect("the cache"));
    let warm = check(&dir, &text, &[]);
    assert_eq!((&without, &cold), (&cold, &warm));
    assert_eq!(fs::read(&labs[0]).expect("the cache"), lab, "nothing new, nothing written");
    assert_eq!(fs::read(&programs[0]).expect("the cache"), found, "nothing new, nothing written");

    // The same motions on other lines are not planned again.
    let moved = bench(NEAR, "    note \"first\"\n    place beaker on plate by panda\n    place beaker on far by panda");
    assert!(check(&dir, &moved, &[]).contains("bench.mtx:20:5: error[out-of-reach]"));
    assert_eq!(fs::read(&labs[0]).expect("the cache"), lab);
    let now: Vec<_> = labs_and_programs(&dir).1.iter().map(|file| fs::read(file).expect("the cache")).collect();
    assert_ne!(now, [found], "another text is another program");
    // Another lab is another matter.
    check(&dir, &bench(" at (440, -250) mm", "    place beaker on plate by panda"), &[]);
    assert_eq!(labs_and_programs(&dir).0.len(), 2);
}

#[test]
fn a_file_without_findings_is_looked_through_again_when_what_it_read_has_changed() {
    let dir = folder("beforehand_clean");
    let text = "mtx 1\nuse rooms\n\nworkflow pause in room {\n    wait stay\n}\n";
    let room = |stay: &str| format!("mtx 1\nlab room {{ ambient: 22 degC }}\nconst stay: Duration = {stay}\n");
    write(&dir, "rooms.mtx", room("1 min"));
    assert_eq!(check(&dir, text, &[]), "");
    assert_eq!(clean(&dir), 1);
    assert_eq!(check(&dir, text, &[]), "");
    write(&dir, "rooms.mtx", room("1 mL"));
    assert!(check(&dir, text, &[]).contains("rooms.mtx:3:24: error[unit-mismatch]"), "{}", check(&dir, text, &[]));
    fs::remove_file(dir.join("rooms.mtx")).expect("it was written");
    assert!(check(&dir, text, &[]).contains("error[unknown-module]"), "{}", check(&dir, text, &[]));
    write(&dir, "rooms.mtx", room("1 min"));
    assert_eq!(check(&dir, text, &[]), "");
    assert_eq!(check(&dir, text, &["--fidelity", "process"]), "");
    assert_eq!(clean(&dir), 2, "each fidelity is a matter of its own");
}

#[test]
fn advice_that_is_not_shown_is_not_looked_for_again() {
    let dir = folder("beforehand_advice");
    let text = "mtx 1\nuse std::glassware::Beaker50mL\n\nlab room {\n    ambient: 22 degC\n    cup = Beaker50mL\n    \
                jug = Beaker50mL holding 9 mL of water\n}\n\nworkflow look in room {\n    expect jug.volume > 1 mL\n}\n";
    assert_eq!(check(&dir, text, &[]), "");
    assert_eq!(clean(&dir), 1);
    assert_eq!(check(&dir, text, &[]), "");
    let strict = check(&dir, text, &["--strict"]);
    assert!(strict.contains("bench.mtx:6:5: warning[unused]"), "{strict}");
    assert_eq!(check(&dir, text, &["--strict"]), strict);
}

#[test]
fn a_damaged_cache_is_ignored_and_written_anew() {
    let dir = folder("beforehand_damaged");
    let text = bench(NEAR, "    place beaker on far by panda");
    let first = check(&dir, &text, &[]);
    let files = kept(&dir);
    let good: Vec<_> = files.iter().map(|file| fs::read(file).expect("the cache")).collect();
    for damage in [
        |_: &[u8]| b"0123456789abcdef0123456789abcdef\n{}".to_vec(),
        |_: &[u8]| Vec::new(),
        |_: &[u8]| b"\xff\xfe".to_vec(),
        |good: &[u8]| good[..good.len() / 2].to_vec(),
        |good: &[u8]| good.iter().enumerate().map(|(i, byte)| byte ^ u8::from(i == good.len() / 2)).collect(),
    ] {
        for (file, good) in files.iter().zip(&good) {
            fs::write(file, damage(good)).expect("the cache can be written");
        }
        assert_eq!(check(&dir, &text, &[]), first);
        for (file, good) in files.iter().zip(&good) {
            assert_eq!(&fs::read(file).expect("the cache"), good);
        }
    }
}
