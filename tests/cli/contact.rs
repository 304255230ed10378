//! `run --fidelity contact`: what grips hold, and what slips, is missed, falls or topples.

use std::path::{Path, PathBuf};

use crate::harness::{Ended, flat, folder, matterixc, matterixc_in, write};

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
fn what_is_not_modelled_is_said_and_check_takes_no_contact() {
    let ended = matterixc(&["run", "examples/two_plates.mtx", "--fidelity", "contact"]);
    assert!(ended.code == 1 || ended.code == 0, "{}", ended.err);
    let ended = matterixc(&["check", "examples/handover.mtx", "--fidelity", "contact"]);
    assert_eq!(ended.code, 2, "{}", ended.err);
    let ended = matterixc(&["run", "examples/handover.mtx", "--fidelity", "motion", "--really", "grip=0.5"]);
    assert!(ended.code == 2 && ended.err.contains("it needs `--fidelity contact`"), "{}", ended.err);
    for wrong in ["grip", "grip=-1", "force=1", ""] {
        let ended = matterixc(&["run", "examples/handover.mtx", "--fidelity", "contact", &format!("--really={wrong}")]);
        assert!(ended.code == 2 && ended.err.contains("write shares from 0 to 10"), "{wrong}: {}", ended.err);
    }
}
