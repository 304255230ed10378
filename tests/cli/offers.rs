//! Places that a check offers for what is out of reach: they can be reached, or none is offered.

use crate::harness::{folder, matterixc_in, write};

/// What is used, and how a lab begins.
const HEAD: &str = "mtx 1
use std::fixtures
use std::glassware
use std::robots
asset Mat: Surface { mass: 50 g, shape: box(140 mm, 140 mm, 2 mm) }
asset Tube: Graspable { mass: 20 g, shape: cylinder(30 mm, 115 mm), frame grasp at (0, 0, 95) mm }
asset Block: Body { mass: 5 kg, shape: box(100 mm, 100 mm, 100 mm) }
lab bench {
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
";

/// Labs with one goal out of reach: a name, the place of that, and the rest with `HERE` for the place.
const CASES: &[(&str, &str, &str)] = &[
    (
        "far",
        "(680, -250) mm",
        "    arm = FrankaPanda { gripper: FrankaHand {} } on table at (-400, 0) mm
    mat = Mat on table at (-100, 300) mm
    cup = Beaker250mL on table at HERE
}
workflow go in bench {
    place cup on mat by arm
}
",
    ),
    (
        "near",
        "(12, 351) mm",
        "    arm = KukaIiwa14 { gripper: Robotiq2F85 {} } on table at (0, 0) mm
    mat = Mat on table at (450, 200) mm
    cup = Beaker100mL on table at HERE
}
workflow go in bench {
    place cup on mat by arm
}
",
    ),
    (
        "surface",
        "(800, 300) mm",
        "    arm = UR5e { gripper: Robotiq2F85 {} } on table at (-400, 0) mm
    cup = Beaker50mL on table at (0, -250) mm
    mat = Mat on table at HERE
}
workflow go in bench {
    place cup on mat by arm
}
",
    ),
    (
        "meeting",
        "(0.05, 0.5, 0.3) m",
        "    east = OpticalTable at (1.2, 0, 0) m
    panda = FrankaPanda { gripper: FrankaHand {} } on table at (0, 0) mm
    ur5e = UR5e { gripper: Robotiq2F85 {} } on east at (0, 0) mm with rpy(0 deg, 0 deg, 180 deg)
    tube = Tube on table at (350, 250) mm
    mat = Mat on east at (-100, 450) mm
    meeting = Waypoint at HERE
}
workflow go in bench {
    hand over tube from panda to ur5e at meeting
    place tube on mat by ur5e
}
",
    ),
];

/// What a check says of a text.
fn check(name: &str, text: &str) -> String {
    let dir = folder(&format!("offers_{name}"));
    write(&dir, "lab.mtx", text);
    let ended = matterixc_in(&dir, &["check", "--no-cache", "--format", "json", "lab.mtx"]);
    ended.out
}

/// The place in an offer, as it stands after `at`.
fn offered(found: &str) -> Option<&str> {
    let (_, rest) = found.split_once(" would be within reach at ")?;
    let end = rest.find(" mm")? + 3;
    Some(&rest[..end])
}

#[test]
fn what_is_offered_can_be_done() {
    for (name, place, lines) in CASES {
        let text = |place: &str| format!("{HEAD}{}", lines.replace("HERE", place));
        let found = check(name, &text(place));
        assert!(found.contains("\"out-of-reach\""), "{name}: {found}");
        assert_eq!(found.lines().count(), 1, "{name}: {found}");
        let place = offered(&found).unwrap_or_else(|| panic!("{name}: {found}"));
        let mended = check(name, &text(place));
        assert_eq!(mended, "", "{name} at {place}");
    }
}

#[test]
fn where_no_place_will_do_none_is_offered() {
    let lines = "    arm = UR3e { gripper: Robotiq2F85 {} } on table at (0, 0) mm
    spot = Waypoint at (0.3, 0.1, 0.95) m
}
workflow go in bench {
    move arm to spot
}
";
    let found = check("none", &format!("{HEAD}{lines}"));
    assert!(found.contains("\"out-of-reach\"") && !found.contains("within reach"), "{found}");
}

#[test]
fn one_cause_is_said_once() {
    let lines = "    arm = FrankaPanda { gripper: FrankaHand {} } on table at (-600, -200) mm
    near = Mat on table at (-200, -300) mm
    far = Mat on table at (700, 200) mm
    cup = Beaker50mL on table at (-250, 100) mm
}
workflow go in bench {
    place cup on far by arm
    place cup on near by arm
    place cup on far by arm
}
";
    let found = check("once", &format!("{HEAD}{lines}"));
    assert_eq!(found.matches("\"severity\":\"error\"").count(), 1, "{found}");
}

#[test]
fn a_base_is_told_which_gap_it_does_not_pass() {
    let lines = "    kuka = KukaKmrIiwa { gripper: Robotiq2F85 {} } at (0, 3, 0) m
    left = Block { shape: box(4 m, 0.1 m, 2 m) } at (-2.2, 4.5, 0) m
    right = Block { shape: box(4 m, 0.1 m, 2 m) } at (2.2, 4.5, 0) m
    west = Block { shape: box(0.1 m, 4 m, 2 m) } at (-4, 6, 0) m
    east = Block { shape: box(0.1 m, 4 m, 2 m) } at (4, 6, 0) m
    back = Block { shape: box(8 m, 0.1 m, 2 m) } at (0, 7.9, 0) m
    bench = OpticalTable at (1.5, 7, 0.7) m
    cup = Beaker50mL on bench at (0, -300) mm
}
workflow go in bench {
    pick cup by kuka
    put back cup by kuka
}
";
    let text =
        format!("{HEAD}{lines}").replace("bench = Optical", "store = Optical").replace("on bench at", "on store at");
    let found = check("gap", &text);
    assert!(found.contains("`kuka` cannot drive to `cup`"), "{found}");
    assert!(found.contains("the gap between `left` and `right` is 400 mm wide, but `kuka` needs 6"), "{found}");
}
