//! The lab book of `examples/equilibria`: titrations, a buffer and a recrystallisation, and what is shown of mixtures at equilibrium.

use std::fs;

use crate::harness::{flat, folder, matterixc, matterixc_in, root, write};

#[test]
fn the_lab_book_is_clean_and_comes_out_right() {
    let mut files: Vec<_> = fs::read_dir(root().join("examples/equilibria"))
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    assert_eq!(files.len(), 7);
    for file in files {
        let file = file.to_str().expect("the path is text");
        let checked = matterixc(&["check", file, "--strict", "--no-cache"]);
        assert!(checked.code == 0 && checked.out.contains("no findings"), "{file}: {}{}", checked.out, checked.err);
        for seed in ["1", "2"] {
            let ran = matterixc(&["run", file, "--seed", seed]);
            assert_eq!(ran.code, 0, "{file}, seed {seed}: {}{}", ran.out, ran.err);
        }
    }
}

/// A beaker of acetic acid and salt beside one of water, and a workflow that looks at them.
const CUPS: &str = "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + 10 mmol of acetic_acid
    silver = Beaker250mL at (1, 0, 0) m holding 100 g of water + 1 mmol of AgCl
    dry = Beaker250mL at (2, 0, 0) m
}
workflow look in bench { wait 1 s }
";

#[test]
fn contents_say_what_is_there_at_equilibrium() {
    let dir = folder("shown_contents");
    write(&dir, "cups.mtx", CUPS);
    let shown = matterixc_in(&dir, &["check", "cups.mtx", "--contents"]);
    let said = flat(&shown.out);
    for part in
        ["ph 2.87", "ionic_strength 0.00", "put in water 5.55", "at equilibrium acetic_acid 9.8", "solid AgCl 998"]
    {
        assert!(said.contains(part), "{part}: {said}");
    }
    let json = matterixc_in(&dir, &["check", "cups.mtx", "--contents", "--format", "json"]);
    let line = json.out.lines().find(|l| l.contains("\"contents\"")).expect("the contents");
    let contents: serde_json::Value = serde_json::from_str(line).expect("it is JSON");
    let start = contents["contents"]["start"].as_array().expect("things");
    let silver = start.iter().find(|t| t["name"] == "silver.contents").expect("the beaker");
    let solid = silver["settled"].as_array().expect("amounts").iter().find(|s| s["name"] == "AgCl").expect("the solid");
    assert_eq!(solid["solid"], true);
}

#[test]
fn without_equilibria_nothing_of_them_is_shown() {
    let dir = folder("shown_without");
    write(&dir, "cups.mtx", CUPS.replace("use std::equilibria\n", ""));
    for args in [&["check", "cups.mtx", "--contents"][..], &["run", "cups.mtx"], &["bill", "cups.mtx"]] {
        let shown = matterixc_in(&dir, args);
        let said = flat(&format!("{}{}", shown.out, shown.err));
        let told = ["ph ", "ionic_strength", "equilibrium", "put in"].iter().find(|word| said.contains(**word));
        assert!(told.is_none() || args[0] == "bill" && told == Some(&"put in"), "{told:?}: {said}");
    }
}

#[test]
fn reports_and_bills_tell_solids_and_the_ph() {
    let dir = folder("shown_reports");
    write(&dir, "cups.mtx", CUPS);
    let ran = matterixc_in(&dir, &["run", "cups.mtx", "--out", "out"]);
    let said = flat(&ran.out);
    assert!(said.contains("ph 2.87") && said.contains("at equilibrium") && said.contains("solid"), "{said}");
    assert!(!said.contains("inf"), "{said}");
    let report = fs::read_to_string(dir.join("out/report.json")).expect("the report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("it is JSON");
    let container = |name: &str| {
        let all = report["containers"].as_array().expect("containers");
        all.iter().find(|c| c["name"] == name).expect("the container").clone()
    };
    let acid = container("cup.contents")["species"].as_array().expect("species").clone();
    let acid = acid.iter().find(|s| s["name"] == "acetic_acid").expect("the acid");
    assert_eq!(acid["put"], 0.01);
    assert!(acid["amount"].as_f64().expect("an amount") < 0.0099);
    let bill = flat(&matterixc_in(&dir, &["bill", "cups.mtx"]).out);
    assert!(bill.contains("ph 2.87") && bill.contains("AgCl, solid") && !bill.contains("dry"), "{bill}");
}
