//! Words that chemists write, and what `check` says instead of them.

use crate::harness::{folder, matterixc_in, write};

const BENCH: &str = "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
use std::robots::{FrankaPanda, Robotiq2F85}
lab bench {
    ambient: 25 degC
    table = OpticalTable at (0, 0, 0) m
    panda = FrankaPanda { gripper: Robotiq2F85 } on table at (-400, 0) mm
    hot = IkaRetControl on table at (300, 0) mm
    cup = Beaker250mL on hot holding 100 g of water
}
workflow w in bench {
    STEP
} finally { stop stirring hot; stop heating hot }
";

/// The help of the first finding of a step, and the texts of its corrections.
fn help(step: &str) -> (String, Vec<String>) {
    let name: String = step.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).take(40).collect();
    let dir = folder(&format!("hinted_{name}"));
    write(&dir, "bench.mtx", BENCH.replace("STEP", step));
    let lines = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]).out_lines();
    let first = lines.into_iter().next().unwrap_or_else(|| panic!("{step}: no finding"));
    let all = |v: &serde_json::Value| v.as_array().cloned().unwrap_or_default();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_owned();
    let help: Vec<String> = all(&first["help"]).iter().map(text).collect();
    let edits =
        all(&first["fixes"]).iter().flat_map(|fix| all(&fix["edits"])).map(|edit| text(&edit["text"])).collect();
    (help.join("; "), edits)
}

#[test]
fn verbs_of_chemists_lead_to_what_exists() {
    for (step, wanted) in [
        ("dissolve cup", "dissolves by itself"),
        ("decant cup", "leaves a solid behind"),
        ("seal cup", "`cap VIAL`"),
        ("cool cup to 10 degC", "`stop heating hot`"),
        ("cool hot", "`stop heating hot`"),
        ("put cup on table by panda", "`place THING on PLACE by ARM`"),
        ("turn off hot", "`stop heating hot`"),
        ("switch on hot", "`stir hot at 300 rpm`"),
        ("switch off hot", "`stop stirring hot`"),
        ("filter cup", "the library has no verb and no model for this"),
        ("evaporate cup", "the library has no verb and no model for this"),
        ("add 10 mL of water to cup", "`transfer` moves liquids"),
        ("stir hot at 300 rpm for 5 min", "`wait 5 min`"),
        ("heat hot to 60 degC for 1 h", "`wait 1 h`"),
        ("if hot is not active { wait 1 s }", "`not (x is active)`"),
        ("if cup.contents.temperature not in 20 degC .. 30 degC { wait 1 s }", "`not (cup.contents.temperature in"),
    ] {
        let (said, fixes) = help(step);
        assert!(said.contains(wanted), "{step}: {said}");
        assert!(!said.contains("did you mean"), "{step}: {said} {fixes:?}");
    }
}

#[test]
fn a_hint_says_that_the_lab_lacks_the_device() {
    let dir = folder("hinted_without");
    let text = "mtx 1\nuse std::glassware::Beaker250mL\nlab bench { ambient: 25 degC, cup = Beaker250mL at (0, 0, 0) m holding 1 g of water }\n\
        workflow w in bench { cool cup to 4 degC }\n";
    write(&dir, "bench.mtx", text);
    let said = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]).out;
    assert!(said.contains("this lab has no device with the command `heat`"), "{said}");
}

#[test]
fn slips_are_still_recognised() {
    for (step, meant) in
        [("haet hot to 60 degC", "heat"), ("plaec cup on table by panda", "place"), ("stri hot at 300 rpm", "stir")]
    {
        assert_eq!(help(step).1, [meant], "{step}");
    }
}
