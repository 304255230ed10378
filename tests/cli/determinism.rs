//! A run is a function of the program, its parameters and the seed.

use std::fs;
use std::path::Path;

use crate::harness::{Ended, folder, matterixc_in, names, root};

/// Runs an example from the folder of examples, so that paths in the report are the same.
fn run(example: &str, seed: &str, out: &Path) -> Ended {
    let out = out.to_str().expect("the path is text");
    matterixc_in(&root().join("examples"), &["run", example, "--seed", seed, "--out", out])
}

/// Every file of two runs, by name.
fn same_files(one: &Path, two: &Path) {
    let files = names(one);
    assert_eq!(files, names(two));
    assert!(files.len() > 3, "{files:?}");
    for file in files {
        let read = |dir: &Path| fs::read(dir.join(&file)).expect("it was written");
        assert!(read(one) == read(two), "{file} differs");
    }
}

#[test]
fn every_example_gives_the_same_bytes_twice() {
    let dir = folder("determinism");
    let examples = names(&root().join("examples"));
    for example in examples.iter().filter(|n| n.ends_with(".mtx")) {
        let (one, two) = (dir.join(example).join("one"), dir.join(example).join("two"));
        let (first, second) = (run(example, "3", &one), run(example, "3", &two));
        assert_eq!((first.code, &first.out, &first.err), (second.code, &second.out, &second.err), "{example}");
        same_files(&one, &two);
    }
}

#[test]
fn the_seed_decides_the_noise() {
    let dir = folder("seeds");
    let recording = |seed: &str| {
        let out = dir.join(seed);
        run("titration.mtx", seed, &out);
        fs::read(out.join("recording.mcap")).expect("it was written")
    };
    assert!(recording("1") != recording("2"));
}

#[test]
fn findings_come_in_the_same_order_every_time() {
    let dir = folder("findings");
    let text: String =
        (0..40).map(|n| format!("lab l{n} {{ ambient: {n} g }}\nworkflow w{n} in l{n} {{ stir l }}\n")).collect();
    fs::write(dir.join("wrong.mtx"), format!("mtx 1\n{text}")).expect("a file can be written");
    let check = || matterixc_in(&dir, &["check", "wrong.mtx", "--format", "json"]).out;
    let first = check();
    assert!(first.lines().count() > 40, "{first}");
    for _ in 0..5 {
        assert_eq!(first, check());
    }
}
