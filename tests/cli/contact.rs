//! `run --fidelity contact`: what grips hold, and what slips, is missed, falls or topples.

use std::path::{Path, PathBuf};

use crate::harness::{Ended, flat, folder, matterixc, matterixc_in, root, write};

/// A beaker with so much water and a vial on a table, an arm whose fingers press with so much, and what it does.
fn bench(force: &str, water: &str, lines: &str) -> String {
    format!(
        "mtx 1\n\nuse std::glassware::Beaker250mL\nuse std::robots::{{FrankaHand, FrankaPanda}}\nuse std::vials::Vial8mL\n\n\
         lab bench {{\n    ambient: 22 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: FrankaHand {{ force: {force} }} }} on table at (0, 0) mm\n    \
         beaker = Beaker250mL on table at (450, 100) mm holding {water} of water\n    \
         vial = Vial8mL on table at (450, -150) mm\n}}\n\n\
         workflow run in bench {{\n    {lines}\n}}\n"
    )
}

/// Writes such a lab; the folder of it.
fn lab(name: &str, force: &str, water: &str, lines: &str) -> PathBuf {
    let dir = folder(name);
    write(&dir, "bench.mtx", bench(force, water, lines));
    dir
}

fn run(dir: &Path, more: &[&str]) -> Ended {
    let mut all = vec!["run", "bench.mtx", "--fidelity", "contact"];
    all.extend(more);
    matterixc_in(dir, &all)
}

const CARRY: &str = "pick beaker by panda\n    wait 3 s\n    put back beaker by panda";

#[test]
fn a_beaker_is_carried_by_force_and_friction_alone_and_repeats_to_the_last_bit() {
    let dir = lab("contact_carry", "70 N", "100 mL", CARRY);
    let bytes = |out: &str| {
        let ended = run(&dir, &["--out", out]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        let files = ["recording.mcap", "report.json", "states.parquet"];
        files.map(|file| std::fs::read(dir.join(out).join(file)).expect("it is written"))
    };
    assert!(bytes("one") == bytes("two"), "the same run, the same files");
    let judged = matterixc_in(&dir, &["verify", "one"]);
    assert!(judged.code == 0 && judged.out.contains("nothing wrong"), "{}", judged.out);
    assert!(judged.out.contains("1 grips, off by 0.0"), "{}", judged.out);
}

#[test]
fn a_grip_that_bears_enough_by_what_is_said_slips_where_it_really_does_not() {
    // Glass on rubber: 0.5 of 6 N on either side bear 6 N; the beaker with its water weighs about 3 N.
    let dir = lab("contact_slip", "6 N", "200 mL", CARRY);
    let check = matterixc_in(&dir, &["check", "bench.mtx"]);
    assert_eq!(check.code, 0, "{}{}", check.out, check.err);
    assert_eq!(run(&dir, &[]).code, 0, "it holds as it is said to");
    for less in ["friction=0.4", "grip=0.4"] {
        let ended = run(&dir, &["--really", less]);
        let said = flat(&ended.err);
        assert_eq!(ended.code, 1, "{less}: {}", ended.out);
        assert!(said.contains("failed with `slip`: `beaker` slips 10."), "{less}: {said}");
        assert!(said.contains("in the fingers of `panda`: each finger presses with"), "{less}: {said}");
        assert!(said.contains("slide arm to item.post_grasp"), "on the line that caused it: {said}");
    }
}

#[test]
fn a_handler_takes_what_slips_and_finds_it_where_it_stands() {
    let lines = "sequence { pick beaker by panda } on slip { note \"it slips\" }\n    \
                 if panda.holding == nothing { note \"in no hand\" }";
    let dir = lab("contact_handler", "6 N", "200 mL", lines);
    let ended = run(&dir, &["--really", "friction=0.2"]);
    let said = flat(&format!("{}{}", ended.out, ended.err));
    assert!(said.contains("it slips") && said.contains("in no hand"), "{said}");
}

#[test]
fn fingers_that_close_beside_a_thing_miss_it() {
    let dir = lab("contact_missed", "70 N", "100 mL", "pick vial by panda\n    put back vial by panda");
    assert_eq!(run(&dir, &[]).code, 0);
    let ended = run(&dir, &["--unseen", "1mm,1deg", "--seed", "3"]);
    assert_eq!(ended.code, 0, "a small error is taken: {}", ended.err);
    let met = (1..=8).map(|seed: u32| run(&dir, &["--unseen", "22mm", "--seed", &seed.to_string()]));
    let said: Vec<String> = met.map(|ended| flat(&ended.err)).collect();
    assert!(
        said.iter().any(|said| said.contains("failed with `missed`: the fingers of `panda` press on `vial`")),
        "{said:#?}"
    );
}

#[test]
fn what_does_not_meet_its_hole_jams_and_a_handler_goes_on() {
    // 0.5 mm on either side.
    let file = root().join("examples/environments/vial_insertion.mtx");
    let text = std::fs::read_to_string(file).expect("the example");
    let dir = folder("contact_jammed");
    write(&dir, "bench.mtx", &text);
    let off = ["--unseen", "1mm", "--seed", "3"];
    let ended = run(&dir, &off);
    let said = flat(&ended.err);
    assert_eq!(ended.code, 1, "{said}");
    assert!(said.contains("failed with `jammed`: `vial` is stopped by `rack` at ("), "{said}");
    assert!(said.contains("presses on it with") && said.contains("slide arm to hole.place"), "{said}");
    let handled = text.replace(
        "insert vial into rack[B3] by panda\n",
        "sequence { insert vial into rack[B3] by panda } on jammed { note \"it does not go in\" }\n",
    );
    write(
        &dir,
        "bench.mtx",
        handled.replace("    expect vial.support == rack[B3]\n", "    expect panda.holding == nothing\n"),
    );
    let ended = run(&dir, &off);
    assert!(ended.code == 0 && ended.out.contains("it does not go in"), "{}{}", ended.out, ended.err);
}

/// A peg that is gripped at its end, a vial, and a post of 12 mm to stand on.
fn post(name: &str, lines: &str) -> PathBuf {
    let dir = folder(name);
    let text = format!(
        "mtx 1\n\nuse std::robots::{{FrankaHand, FrankaPanda}}\nuse std::vials::Vial8mL\n\n\
         asset Post: Labware, Surface {{\n    mass: 2 kg\n    friction: 0.5\n    shape: box(12 mm, 12 mm, 60 mm)\n    \
         frame grasp at (0, 0, 50) mm\n}}\n\nasset Peg: Graspable {{\n    mass: 50 g\n    friction: 0.5\n    \
         shape: cylinder(17 mm, 60 mm)\n    frame grasp at (0, 0, 60) mm\n}}\n\nlab bench {{\n    ambient: 22 degC\n    \
         table = OpticalTable\n    panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
         post = Post on table at (450, -150) mm\n    vial = Vial8mL on table at (450, 150) mm\n    \
         peg = Peg on table at (450, 0) mm\n}}\n\nworkflow run in bench {{\n    {lines}\n}}\n"
    );
    write(&dir, "bench.mtx", text);
    dir
}

#[test]
fn what_leaves_the_fingers_is_dropped_and_handlers_take_it() {
    // 9 mm of it are between the fingers.
    let (lines, slippery) = ("pick peg by panda\n    put back peg by panda", ["--really", "friction=0.001"]);
    let dir = post("contact_dropped", lines);
    let held = run(&dir, &[]);
    assert_eq!(held.code, 0, "{}", held.err);
    let said = flat(&run(&dir, &slippery).err);
    let parts =
        ["failed with `dropped`: `panda` drops `peg`", "no finger touches it now", "slide arm to item.post_grasp"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    let lines = format!("sequence {{ {lines} }} on dropped {{ note \"gone\" }}\n    expect panda.holding == nothing");
    let dir = post("contact_dropped_handled", &lines);
    let ended = run(&dir, &slippery);
    assert!(ended.code == 0 && ended.out.contains("gone"), "{}{}", ended.out, ended.err);
}

#[test]
fn what_is_put_down_beside_its_place_topples_and_handlers_take_it() {
    let lines = "place vial on post by panda";
    let dir = post("contact_toppled", lines);
    let stands = run(&dir, &[]);
    assert_eq!(stands.code, 0, "{}", stands.err);
    // Its middle is beyond the post from 6 mm on.
    let from = |dir: &Path, seed: usize| run(dir, &["--unseen", "9mm", "--seed", &seed.to_string()]);
    let topples =
        |said: &str| said.contains("failed with `toppled`: `vial` leans by") && said.contains("release item on");
    let seed = (1..=12).find(|seed| topples(&flat(&from(&dir, *seed).err))).expect("one of them is too far off");
    let lines = format!(
        "sequence {{ {lines} }} on toppled {{ note \"it lies\" }}\n    \
         expect panda.holding == nothing"
    );
    let ended = from(&post("contact_toppled_handled", &lines), seed);
    assert!(ended.code == 0 && ended.out.contains("leans by"), "{}{}", ended.out, ended.err);
}

#[test]
fn check_takes_nothing_for_held_that_a_failed_motion_may_have_lost() {
    let held = "pick vial by panda\n    sequence { lift panda by 50 mm } on ";
    let check = |name: &str, handler: &str| {
        let dir = lab(name, "70 N", "100 mL", &format!("{held}{handler}\n    expect elapsed > 0 s"));
        matterixc_in(&dir, &["check", "bench.mtx"])
    };
    // It may be gone after a slip, and is after a drop.
    for (name, handler) in [
        (
            "contact_lost_slip",
            "slip { if panda.holding == vial { put back vial by panda } else { pick vial by panda } }",
        ),
        ("contact_lost_drop", "dropped { pick vial by panda }"),
    ] {
        let ended = check(name, handler);
        assert!(!ended.out.contains("hand-full") && !ended.out.contains("not-in-hand"), "{name}: {}", ended.out);
    }
    let ended = check("contact_lost_back", "dropped { put back vial by panda }");
    assert!(ended.out.contains("[not-in-hand]: `panda` is not holding `vial`"), "{}", ended.out);
}

/// An environment with its things near by, and not quite where they are taken to be.
fn environment(name: &str, seed: u32) -> Ended {
    let (file, seed) = (format!("examples/environments/{name}.mtx"), seed.to_string());
    let off = ["--perturb", "20mm,10deg", "--unseen", "2mm,1deg", "--seed", &seed];
    let mut args = vec!["run", &file, "--fidelity", "contact"];
    args.extend(off);
    matterixc(&args)
}

#[test]
fn a_plate_is_carried_onto_a_deck_by_force_and_friction_from_places_near_by() {
    for seed in 1..=3 {
        let ended = environment("plate_into_ot2", seed);
        assert_eq!(ended.code, 0, "{seed}: {}{}", ended.out, ended.err);
    }
}

#[test]
fn a_vial_that_does_not_come_into_its_hole_is_said_to_be_stopped_or_to_fall() {
    // The hole leaves it 0.5 mm on either side, and both are up to 2 mm off.
    let ended: Vec<Ended> = (1..=3).map(|seed| environment("vial_insertion", seed)).collect();
    let failed: Vec<String> = ended.iter().filter(|e| e.code != 0).map(|e| flat(&e.err)).collect();
    assert!(!failed.is_empty());
    for said in failed {
        let jammed = said.contains("failed with `jammed`: `vial` is stopped by `rack` at (");
        let toppled = said.contains("failed with `toppled`: `vial` leans by");
        assert!((jammed || toppled) && said.contains("line 17") || said.contains("vial_insertion.mtx:17"), "{said}");
    }
}

#[test]
fn what_is_not_modelled_is_said_and_check_takes_no_contact() {
    let ended = matterixc(&["run", "examples/two_plates.mtx", "--fidelity", "contact"]);
    assert!(ended.code == 1 || ended.code == 0, "{}", ended.err);
    let ended = matterixc(&["check", "examples/handover.mtx", "--fidelity", "contact"]);
    assert_eq!(ended.code, 2, "{}", ended.err);
    let ended = matterixc(&["run", "examples/handover.mtx", "--fidelity", "motion", "--really", "grip=0.5"]);
    assert!(ended.code == 2 && ended.err.contains("needs `--fidelity contact`"), "{}", ended.err);
    for wrong in ["grip", "grip=-1", "force=1", ""] {
        let ended = matterixc(&["run", "examples/handover.mtx", "--fidelity", "contact", &format!("--really={wrong}")]);
        assert!(ended.code == 2 && ended.err.contains("write shares from 0 to 10"), "{wrong}: {}", ended.err);
    }
}
