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
    assert_eq!(files.len(), 12);
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
    for part in [
        "ph 2.88",
        "ionic_strength 0.00",
        "put in water 5550.9 mmol",
        "at equilibrium acetic_acid 9.8",
        "solid AgCl 0.9986",
    ] {
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
    assert!(said.contains("ph 2.88") && said.contains("at equilibrium") && said.contains("solid"), "{said}");
    assert!(!said.contains("inf,"), "{said}");
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
    assert!(bill.contains("ph 2.88") && bill.contains("AgCl, solid") && !bill.contains("dry"), "{bill}");
}

/// Steps in a lab with a cup, a burette over it and a pump between cup and other.
fn findings_of(name: &str, holding: &str, titrant: &str, steps: &str) -> String {
    let dir = folder(name);
    let text = format!(
        "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
use std::pumps::{{CavroXlp6000, draw, piped, push}}
use std::titration::MotorBurette
lab bench {{
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding {holding}
    other = Beaker250mL at (1, 0, 0) m
    burette = MotorBurette {{ over: cup }} at (0, 300, 0) mm holding {titrant}
    pump = CavroXlp6000 at (0.5, 0, 0) m
    between pump and cup {{ piped: true }}
    between pump and other {{ piped: true }}
}}
workflow feed in bench {{
{steps}
    draw 1 mL from cup by pump
    push 1 mL into other by pump
}}
"
    );
    write(&dir, "cup.mtx", text);
    flat(&matterixc_in(&dir, &["check", "cup.mtx", "--no-cache"]).out)
}

#[test]
fn solids_that_come_out_are_told_where_they_do() {
    let [salt, silver] = ["100 g of water + 1 mmol of NaCl", "10 g of water + 2 mmol of AgNO3"];
    let told = findings_of("precipitate", salt, silver, "    deliver 2 mL by burette");
    assert!(told.contains("`cup` holds precipitated AgCl: 0.395"), "{told}");
    assert!(told.contains("solid AgCl may block `pump`"), "{told}");
    // What is put in as a solid has not come out, but blocks a line all the same.
    let slurry = findings_of("slurry", "100 g of water + 1 mmol of AgCl", "10 g of water", "    wait 1 s");
    assert!(!slurry.contains("`cup` holds precipitated") && slurry.contains("solid AgCl may block `pump`"), "{slurry}");
    let steps = "    deliver 2 mL by burette";
    let clear = findings_of("no_precipitate", salt, "10 g of water + 2 mmol of KNO3", steps);
    assert!(clear.contains("no findings"), "{clear}");
}

#[test]
fn a_buffer_that_gives_out_is_told() {
    let buffer = "100 g of water + 2 mmol of H2PO4- + 2 mmol of HPO4^2- + 6 mmol of Na+";
    let lye = "10 g of water + 4 mmol of NaOH";
    let gone = findings_of("buffer_gone", buffer, lye, "    deliver 2 mL by burette\n    deliver 5 mL by burette");
    assert!(
        gone.contains("what is added from `burette` exhausts the buffer of H2PO4- in `cup`: its pH goes from 7"),
        "{gone}"
    );
    let left = findings_of("buffer_left", buffer, lye, "    deliver 2 mL by burette\n    deliver 2 mL by burette");
    assert!(left.contains("no findings"), "{left}");
}

#[test]
fn a_ph_stays_in_its_window_or_the_step_is_told_that_moves_it() {
    let text = |steps: &str| {
        format!(
            "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
use std::titration::MotorBurette
asset Medium: Beaker250mL, PhWindow {{ ph_window: 6.8 .. 7.6 }}
lab bench {{
    ambient: 25 degC
    medium = Medium at (0, 0, 0) m holding 100 g of water + 2 mmol of H2PO4- + 2 mmol of HPO4^2- + 6 mmol of Na+
    burette = MotorBurette {{ over: medium }} at (0, 300, 0) mm holding 10 g of water + 2 mmol of NaOH
}}
workflow feed in bench {{ {steps} }}
"
        )
    };
    let dir = folder("window");
    write(&dir, "window.mtx", text("deliver 5 mL by burette"));
    let kept = matterixc_in(&dir, &["check", "window.mtx", "--no-cache"]);
    assert!(kept.out.contains("no findings"), "{}", kept.out);
    assert_eq!(matterixc_in(&dir, &["run", "window.mtx"]).code, 0);
    write(&dir, "window.mtx", text("deliver 5 mL by burette; deliver 5 mL by burette"));
    let left = matterixc_in(&dir, &["check", "window.mtx", "--no-cache"]);
    let said = flat(&left.out);
    assert!(
        left.code == 1 && said.contains("the pH of `medium` is") && said.contains("it must stay in 6.8 .. 7.6"),
        "{said}"
    );
}

#[test]
fn an_electrode_that_no_buffer_has_seen_is_told() {
    let weak = fs::read_to_string(root().join("examples/equilibria/weak_acid.mtx")).expect("the example");
    let calibration = weak.lines().find(|l| l.contains("calibrate meter")).expect("the calibration");
    let dir = folder("not_calibrated");
    write(&dir, "weak.mtx", weak.replace(calibration, ""));
    let checked = flat(&matterixc_in(&dir, &["check", "weak.mtx", "--no-cache"]).out);
    assert!(checked.contains("`meter` is not calibrated: it may be off by 0.25 at pH 7"), "{checked}");
    let swapped = weak.replace("(acid_buffer, neutral_buffer)", "(neutral_buffer, acid_buffer)");
    write(&dir, "weak.mtx", swapped);
    let ran = matterixc_in(&dir, &["run", "weak.mtx"]);
    assert!(ran.code != 0 && flat(&format!("{}{}", ran.out, ran.err)).contains("% of the ideal slope"), "{}", ran.out);
}

#[test]
fn where_there_is_no_end_point_none_is_found() {
    let weak = fs::read_to_string(root().join("examples/equilibria/weak_acid.mtx")).expect("the example");
    let expectations = |l: &&str| !l.contains("expect meter.shown");
    let weak: String = weak.lines().filter(expectations).map(|l| format!("{l}\n")).collect();
    let dir = folder("no_end_point");
    for held in ["50 g of water", "50 g of water + 5 mmol of acetate + 5 mmol of Na+"] {
        write(&dir, "weak.mtx", weak.replace("50 g of water + 1 mmol of acetic_acid", held));
        let ran = matterixc_in(&dir, &["run", "weak.mtx"]);
        let said = flat(&format!("{}{}", ran.out, ran.err));
        assert!(ran.code != 0 && said.contains("no_end_point"), "{held}: {said}");
    }
}

#[test]
fn conductivities_are_those_of_the_tables() {
    let file = root().join("tests/cases/conductivity.mtx");
    let ran = matterixc(&["run", file.to_str().expect("the path is text")]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let dir = folder("conductivity");
    let text =
        fs::read_to_string(file).expect("the case").replace("1 mmol of HCl", "1 mmol of S4O6^2- + 2 mmol of Na+");
    write(&dir, "unknown.mtx", text.replace("[H+]", "[S4O6^2-]"));
    let checked = flat(&matterixc_in(&dir, &["check", "unknown.mtx", "--no-cache"]).out);
    assert!(checked.contains("leaves out S4O6^2-: its diffusion coefficient is unknown"), "{checked}");
}
