//! The environments of `examples/environments`: each runs to its end with robots that move, from where things stand and
//! from places near by.

use crate::harness::{folder, matterixc, matterixc_in, names, root, write};

/// Every environment, by path.
fn environments() -> Vec<String> {
    let names = names(&root().join("examples/environments"));
    names.into_iter().filter(|n| n.ends_with(".mtx")).map(|n| format!("examples/environments/{n}")).collect()
}

#[test]
fn environments_have_no_findings_and_end_as_expected() {
    for file in environments() {
        let checked = matterixc(&["check", &file]);
        assert_eq!((checked.code, checked.out.trim()), (0, "no findings"), "{file}");
        let ended = matterixc(&["run", &file]);
        assert_eq!(ended.code, 0, "{file}: {}{}", ended.out, ended.err);
    }
}

#[test]
fn environments_end_as_expected_from_places_near_by() {
    for file in environments() {
        for seed in ["1", "2", "3"] {
            let args = ["run", &file, "--fidelity", "motion", "--perturb", "20mm,10deg", "--seed", seed];
            let ended = matterixc(&args);
            assert_eq!(ended.code, 0, "{file} from {seed}: {}{}", ended.out, ended.err);
        }
    }
}

#[test]
fn environments_can_be_looked_at_before_and_after_a_run() {
    let dir = folder("environments_view");
    for file in environments() {
        let page = dir.join("page.html");
        let page = page.to_str().expect("text");
        let ended = matterixc(&["view", &file, "--export", page]);
        assert_eq!(ended.code, 0, "{file}: {}", ended.err);
        let text = std::fs::read_to_string(page).expect("a page");
        let arms = ["panda", "fr3"].iter().filter(|arm| text.contains(&format!("\"name\":\"{arm}\""))).count();
        assert_eq!(arms, 1, "{file}: the arm is shown under its name");
    }
    let out = dir.to_str().expect("text");
    let ended = matterixc(&["run", "examples/environments/funnel.mtx", "--fidelity", "motion", "--out", out]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let page = dir.join("run.html");
    let ended = matterixc(&["view", out, "--export", page.to_str().expect("text")]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let text = std::fs::read_to_string(page).expect("a page");
    for name in ["panda", "funnel", "panda.wrist.wrist_horn", "panda.gripper.robotiq_85_base_link"] {
        assert!(text.contains(&format!("\"name\":\"{name}\"")), "{name}");
    }
}

/// A vial in a rack on a table, and a beaker on a tile of this length and width.
fn bench(tile: &str) -> String {
    format!(
        "mtx 1\n\nuse std::glassware::Beaker250mL\nuse std::vials::{{Vial8mL, VialRack15}}\n\n\
         asset Tile: Surface {{ mass: 1 kg, shape: box({tile}, {tile}, 10 mm) }}\n\nlab bench {{\n    ambient: 22 degC\n    \
         table = OpticalTable\n    rack = VialRack15 on table\n    vial = Vial8mL in rack[A1]\n    \
         tile = Tile on table at (300, 0) mm\n    beaker = Beaker250mL on tile\n}}\n\n\
         workflow rest in bench {{ wait 1 s }}\n"
    )
}

#[test]
fn what_stands_freely_is_moved_as_the_seed_has_it() {
    let dir = folder("perturb");
    write(&dir, "bench.mtx", bench("80 mm"));
    let moved = |args: &[&str]| -> Vec<String> {
        let mut all = vec!["run", "bench.mtx", "--perturb"];
        all.extend(args);
        let ended = matterixc_in(&dir, &all);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        ended.out.lines().filter(|l| l.contains("from its place")).map(str::to_string).collect()
    };
    let first = moved(&["20mm,10deg"]);
    assert_eq!(first, moved(&["2 cm, 10 deg"]), "the same seed, the same lab");
    assert_ne!(first, moved(&["20mm,10deg", "--seed", "1"]));
    // The vial goes with its rack.
    assert_eq!(first.len(), 2, "{first:?}");
    assert!(first[0].contains("`rack`") && first[1].contains("`beaker`"), "{first:?}");
    assert!(moved(&["10deg"])[0].contains("(0.0, 0.0) mm"));
}

#[test]
fn a_thing_without_room_is_named() {
    let dir = folder("perturb_crowded");
    write(&dir, "bench.mtx", bench("70 mm"));
    let ended = matterixc_in(&dir, &["run", "bench.mtx", "--perturb", "20mm,10deg"]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("`beaker` has no room"), "{}", ended.err);
}

#[test]
fn perturbations_that_cannot_be_read_are_refused() {
    for wrong in ["20", "20mm,30mm", "5 s", "", "mm", "20mm,10deg,1"] {
        let ended = matterixc(&["run", "examples/redox.mtx", "--perturb", wrong]);
        assert_eq!(ended.code, 2, "{wrong}");
    }
}
