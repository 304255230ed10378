//! True shapes decide where balls leave no way: hands go into hollow things, and not into full or narrow ones.

use crate::harness::{folder, matterixc_in, write};

/// A hand that goes 140 mm deep into a thing of this shape, 200 mm high, and out again.
fn reach(shape: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::OpticalTable\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\nasset Tub: Body {{\n    mass: 1 kg\n    \
         shape: {shape}\n    frame inside at (0, 0, 60) mm\n    frame above at (0, 0, 350) mm\n}}\n\nlab bench {{\n    ambient: 25 degC\n    \
         table = OpticalTable\n    panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
         tub = Tub on table at (500, 0) mm\n}}\n\nworkflow go in bench {{\n    move panda to tub.inside\n    move panda to tub.above\n}}\n"
    )
}

#[test]
fn a_hand_goes_into_a_tub() {
    let dir = folder("hollow_tub");
    write(&dir, "tub.mtx", reach("vessel(400 mm, 200 mm, 3 mm, 3 mm)"));
    let found = matterixc_in(&dir, &["check", "tub.mtx", "--fidelity", "motion", "--format", "concise"]);
    assert_eq!(found.code, 0, "{}", found.out);
    let ended = matterixc_in(&dir, &["run", "tub.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let judged = matterixc_in(&dir, &["verify", "out"]);
    assert!(judged.out.contains("nothing wrong"), "{}", judged.out);
}

#[test]
fn a_hand_does_not_go_into_what_is_full_or_narrow() {
    let dir = folder("hollow_full");
    for (name, shape) in [("full", "cylinder(400 mm, 200 mm)"), ("narrow", "vessel(150 mm, 200 mm, 3 mm, 3 mm)")] {
        let file = write(&dir, &format!("{name}.mtx"), reach(shape));
        let found = matterixc_in(&dir, &["check", &file, "--fidelity", "motion", "--format", "concise"]);
        assert!(found.out.contains(":21:5: error[collision]"), "{name}: {}", found.out);
        assert_eq!(found.out.matches("error[").count(), 1, "{name}: {}", found.out);
    }
}
