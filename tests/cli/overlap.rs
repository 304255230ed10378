//! Things that a lab puts into one place.

use crate::harness::{folder, matterixc_in, write};

/// A table with these lines, in a lab where something is done.
fn lab(lines: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::OpticalTable\nuse std::glassware::Beaker250mL\n\
         use std::heating::IkaRetControl\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\n\
         asset Crate: Surface {{\n    mass: 1 kg\n    shape: box(100 mm, 100 mm, 100 mm)\n}}\n\n\
         lab bench {{\n    ambient: 22 degC\n    table = OpticalTable at (0, 0, 0) m\n{lines}\n}}\n\n\
         workflow first in bench {{\n    wait 1 min\n}}\n\nworkflow second in bench {{\n    wait 2 min\n}}\n"
    )
}

/// What a check says of these lines, without the summary.
fn check(name: &str, lines: &str) -> String {
    let dir = folder(&format!("overlap_{name}"));
    write(&dir, "bench.mtx", lab(lines));
    let said = matterixc_in(&dir, &["check", "bench.mtx", "--format", "concise", "--no-cache"]).out;
    said.lines().filter(|l| l.contains("[overlap]")).collect::<Vec<_>>().join("\n")
}

#[test]
fn two_vessels_in_one_place_are_found_without_a_robot_and_once() {
    let found =
        check("vessels", "    a = Beaker250mL on table at (0, 0) mm\n    b = Beaker250mL on table at (30, 20) mm");
    assert_eq!(found.lines().count(), 1, "{found}");
    assert!(found.starts_with("bench.mtx:17:33: error[overlap]: `b` and `a` overlap"), "{found}");
}

#[test]
fn what_stands_against_something_is_beside_it() {
    for (name, shift, count) in [("against", 100.0, 0), ("nominal", 98.5, 0), ("into", 95.0, 1)] {
        let found =
            check(name, &format!("    a = Crate on table at (0, 0) mm\n    b = Crate on table at ({shift}, 0) mm"));
        assert_eq!(found.lines().count(), count, "{shift}: {found}");
    }
}

#[test]
fn what_stands_in_a_hollow_is_not_in_anything() {
    let hollow = "    basin = Beaker250mL on table at (0, 0) mm\n    crate = Crate { shape: cylinder(40 mm, 60 mm) } on table at";
    let inside = check("hollow", &format!("{hollow} (0, 0, 5) mm"));
    assert_eq!(inside, "", "the wall is nowhere near");
    let wall = check("wall", &format!("{hollow} (25, 0, 5) mm"));
    assert_eq!(wall.lines().count(), 1, "{wall}");
}

#[test]
fn a_thing_without_a_place_on_a_table_is_somewhere_else() {
    let found = check("somewhere", "    a = Crate on table\n    b = Crate on table at (0, 0) mm");
    assert_eq!(found, "");
    let found = check(
        "carried",
        "    p = IkaRetControl on table at (0, 0) mm\n    a = Crate on p\n    b = Crate on table at (0, 0, 150) mm",
    );
    assert_eq!(found.lines().count(), 1, "what it stands on has a place: {found}");
}

#[test]
fn what_goes_with_another_thing_is_no_mistake_of_its_own() {
    let found = check(
        "load",
        "    p = IkaRetControl on table at (0, 0) mm\n    a = Crate on p\n    wall = Crate { shape: box(100 mm, 100 mm, 400 mm) } on table at (60, 0) mm",
    );
    assert_eq!(found.lines().count(), 1, "{found}");
    assert!(found.contains("`wall` and `p`"), "{found}");
}

#[test]
fn the_nearest_free_place_is_offered_and_good() {
    let dir = folder("overlap_offer");
    let lines = "    a = Crate on table at (0, 0) mm\n    b = Crate on table at (80, 5) mm";
    write(&dir, "bench.mtx", lab(lines));
    let said = matterixc_in(&dir, &["check", "bench.mtx", "--no-cache"]).out;
    assert!(said.contains("help: `b` has room at (110, 0) mm on `table`"), "{said}");
    write(&dir, "bench.mtx", lab(&lines.replace("(80, 5)", "(110, 0)")));
    assert!(matterixc_in(&dir, &["check", "bench.mtx", "--no-cache"]).out.contains("no findings"));
}

#[test]
fn neither_a_check_of_the_process_nor_a_run_passes_over_it() {
    let dir = folder("overlap_run");
    write(&dir, "bench.mtx", lab("    a = Crate on table at (0, 0) mm\n    b = Crate on table at (50, 0) mm"));
    let checked = matterixc_in(&dir, &["check", "bench.mtx", "--fidelity", "process", "--no-cache"]);
    assert!(checked.out.contains("error[overlap]"), "{}", checked.out);
    for more in [&["--fidelity", "process"][..], &["--dry"], &["--fidelity", "motion"]] {
        let args = [&["run", "bench.mtx", "--workflow", "first"], more].concat();
        let ran = matterixc_in(&dir, &args);
        assert!(ran.code == 1 && ran.err.contains("error[overlap]"), "{more:?}: {} {}", ran.code, ran.err);
    }
}
