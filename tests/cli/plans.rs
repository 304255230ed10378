//! Plans from data that are known before the run: counters, lists, tables.

use crate::harness::{folder, matterixc, matterixc_in, write};

const COUNTERS: &str = "tests/cases/counters.mtx";

/// A deck, before steps.
const DECK: &str = "mtx 1
use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[2]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 10 mL of water }
}
";

/// What a check of a deck with these items says, a line each.
fn said(name: &str, items: &str) -> Vec<String> {
    let dir = folder(name);
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let ended = matterixc_in(&dir, &["check", "a.mtx", "--format", "concise"]);
    ended.out.lines().map(str::to_owned).collect()
}

/// That the only finding has these words.
#[track_caller]
fn only(name: &str, items: &str, words: &str) {
    let said = said(name, items);
    let found: Vec<&String> = said.iter().filter(|line| line.contains("a.mtx:")).collect();
    assert!(found.len() == 1 && found[0].contains(words), "{said:#?}");
}

#[test]
fn counters_and_lists_are_followed_step_by_step() {
    for (workflow, formatted) in [("fill", true), ("counted", false)] {
        let ended = matterixc(&["run", COUNTERS, "--workflow", workflow]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        if formatted {
            let ended = matterixc(&["fmt", "--check", COUNTERS]);
            assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        }
    }
    let ended = matterixc(&["run", COUNTERS, "--workflow", "fill", "--set", "double=false"]);
    assert!(ended.code == 1 && ended.err.contains("`n` is 8, must be 11"), "{}", ended.err);
    let doc = matterixc(&["doc", COUNTERS, "--workflow", "fill"]).out;
    let doc = doc.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(doc.contains("Begin with _n_ at 0.") && doc.contains("Add 1 to _n_."), "{doc}");
    assert!(doc.contains("value number _n_ (from 0) of _wells_"), "{doc}");
}

#[test]
fn where_only_the_run_decides_nothing_is_counted() {
    let changed = |block: &str| format!("workflow w in deck {{\n    var n = 0\n    {block}\n    note \"{{n}}\"\n}}\n");
    for (block, why) in [
        ("wait 1 s\n    if elapsed > 5 s { n += 1 }", "only the run decides this `if`"),
        ("repeat while elapsed < 5 s max 9 { wait 1 s; n += 1 }", "how often this is repeated"),
        ("start j = { n += 1; wait 1 s }\n    await j", "this job goes on"),
        ("parallel { wait 1 s; n += 1 }", "at the same time"),
        ("try { n = 2; wait 1 s } else { wait 2 s }", "which alternative"),
        ("sequence { n += 1; fail cold \"so\" } on cold { wait 1 s }", "may end at any of its steps"),
        ("sequence { fail cold \"so\" } on cold { n += 1 }", "whether this fails"),
    ] {
        only("undecided", &changed(block), why);
    }
}

#[test]
fn what_is_not_a_variable_does_not_change() {
    let steps = |steps: &str| format!("workflow w in deck {{ {steps} }}\n");
    only("no_var", &steps("let k = 1; k = 2; note \"{k}\""), "`k` does not change: it is no `var`");
    only("no_var", &steps("k += 2"), "there is no `var k` here");
    only("no_var", &steps("k = 2; wait 1 s"), "there is no `var k` here");
    only("no_var", &steps("plate = 4"), "`plate` belongs to the lab");
    only("no_var", &steps("var x = 1 uL; x = 3"), "cannot become a plain number");
    only("no_var", &steps("var x = [1 uL]; x += 3 uL"), "`x` is a list, and this is");
    only("no_var", &steps("var x = [1 uL]; x += [plate[A1]]"), "is a list of");
    only(
        "no_var",
        &steps("var n = 96; note \"{plate.wells[n].contents.volume}\""),
        "has 96 places, counted from 0: this is number 96",
    );
    only("no_var", &steps("for v in plate.row(1) { var n = 1; n += 1 }; n += 1"), "there is no `var n` here");
}

/// What a check says where a table lies beside the text, in one line of words.
fn of_table(name: &str, csv: impl AsRef<[u8]>, items: &str) -> (i32, String) {
    let dir = folder(name);
    std::fs::write(dir.join("plan.csv"), csv).expect("it can be written");
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let ended = matterixc_in(&dir, &["check", "a.mtx", "--format", "concise"]);
    (ended.code, format!("{}{}", ended.out, ended.err))
}

const PLAN: &str = "table plan from csv \"plan.csv\" { well: Place, volume: Volume as uL }
workflow w in deck {
    for row in plan { transfer row.volume from stock[A1] to plate[row.well] by ot2.left using tips { tips: each } }
    expect plan.count == 3 and sum(v in plan.volume: v) == 105.5 uL and plate[C5].contents.volume in 49 uL .. 51 uL
}
";

#[test]
fn tables_are_read_as_programs_write_them() {
    for (index, csv) in [
        "well,volume\nA1,20\nC5,50\nH12,35.5\n",
        "\u{feff}Well,Volume [uL]\r\nA01,20\r\n\r\nC05,50 uL\r\n,\r\n\"H12\", 35.5 ,\r\n",
        "# of Monday\nvolume (µL),well\n35.5,H12\n2e1,A1\n50,C5",
    ]
    .iter()
    .enumerate()
    {
        let (code, said) = of_table(&format!("table_read_{index}"), csv, PLAN);
        assert!(code == 0 && said.trim().is_empty(), "{csv}: {said}");
    }
}

#[test]
fn what_is_wrong_with_a_table_is_shown_in_it() {
    for (csv, words) in [
        ("well,volume\nA1,20 mL\n", "plan.csv:2:4: error[table-file]: this cell is in `mL`, and its column in `uL`"),
        (
            "well,volume [mL]\nA1,20\n",
            "plan.csv:1:6: error[table-file]: the column `volume` is in `mL`, but it is read as `uL`",
        ),
        ("well,volume\nA1,\"20,5\"\n", "plan.csv:2:4: error[table-file]: `20,5` is not a number: it has a comma"),
        (
            "well;volume\nA1;20,5\n",
            "plan.csv:1:1: error[table-file]: the cells of this table are separated by semicolons",
        ),
        ("well,volume\nA1,\n", "plan.csv:2:4: error[table-file]: this cell of the column `volume` is empty"),
        ("well,volume\nA1,nan\n", "plan.csv:2:4: error[table-file]: `nan` is not a number"),
        ("well,volume\nA1,1e999\n", "plan.csv:2:4: error[table-file]: `1e999` is not a number"),
        ("well,volume\nA1\n", "plan.csv:2:1: error[table-file]: this row has 1 cells, but the first row has 2"),
        ("well,volume\nA1,2,3\n", "plan.csv:2:1: error[table-file]: this row has 3 cells, but the first row has 2"),
        (
            "well,volume,volume\nA1,2,3\n",
            "plan.csv:1:13: error[table-file]: two columns of `plan.csv` are called `volume`",
        ),
        (
            "well,volume,note\nA1,20,x\n",
            "plan.csv:1:13: warning[table-file]: the table `plan` leaves out the column `note`",
        ),
        ("well,vol\nA1,20\n", "a.mtx:10:47: error[table-file]: `plan.csv` has no column `volume`"),
        ("well,volume\nA1,\"20\n", "plan.csv:2:4: error[table-file]: this quote is not closed"),
        ("well,volume\rA1,20\r", "plan.csv:1:12: error[hidden-character]"),
        ("", "error[table-file]: `plan.csv` contains no table"),
        ("well,volume\nI1,20\n", "plan.csv:2:1: error[unknown-member]: `plate` has no `I1`: it has A1 .. H12"),
    ] {
        let (_, said) = of_table("table_wrong", csv, PLAN);
        assert!(said.contains(words), "{csv}: {said}");
    }
    let huge = format!("well,volume\n{}", "A1,20\n".repeat(10_001));
    assert!(
        of_table("table_huge", huge, PLAN).1.contains("plan.csv:10002:1: error[table-file]: this table has 10001 rows")
    );
    assert!(of_table("table_bytes", b"well,volume\nA1,\xff\n", PLAN).1.contains("it is not UTF-8 text"));
}

#[test]
fn findings_of_a_plan_name_the_row() {
    let dir = folder("table_row");
    write(&dir, "plan.csv", "well,volume\nA1,200\nB1,30\nA1,250\n");
    write(&dir, "a.mtx", format!("{DECK}{PLAN}"));
    let said = matterixc_in(&dir, &["check", "a.mtx"]).out;
    assert!(
        said.contains("volume-overflow") && said.contains("plan.csv:4:1") && said.contains("in the turn of this row"),
        "{said}"
    );
}

#[test]
fn a_report_says_of_which_data_a_plan_was_made() {
    let dir = folder("table_sum");
    write(&dir, "plan.csv", "well,volume\nA1,20\n");
    let items = PLAN.replace("    expect plan.count == 3 and sum(v in plan.volume: v) == 105.5 uL and plate[C5].contents.volume in 49 uL .. 51 uL\n", "");
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let told = |dir: &std::path::Path| {
        assert_eq!(matterixc_in(dir, &["check", "a.mtx"]).code, 0);
        let out = matterixc_in(dir, &["run", "a.mtx"]).out;
        out.lines().find(|line| line.contains("table plan = ")).map(str::to_owned).expect("it is told")
    };
    let first = told(&dir);
    // printf 'well,volume\nA1,20\n' | sha256sum
    assert!(
        first.contains("plan.csv, 1 row, sha256 2f5c7db7db6154344b01718030aa341cf4f7a904f1d2dade25b1f9b25cc95b8b"),
        "{first}"
    );
    write(&dir, "plan.csv", "well,volume\nA1,21\n");
    assert_ne!(told(&dir), first);
    write(&dir, "plan.csv", "well,volume\nZ1,21\n");
    assert_eq!(matterixc_in(&dir, &["check", "a.mtx"]).code, 1);
}

#[test]
fn parameters_keep_to_their_bounds() {
    let dir = folder("bounds");
    let items = "workflow w(n: Int in 1 .. 96 = 8, mode: Text in [\"fast\", \"slow\"] = \"slow\", v: Volume in 20 uL .. 300 uL = 50 uL) in deck { note \"{n} {mode} {v}\" }\n";
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let run = |set: &str| matterixc_in(&dir, &["run", "a.mtx", "--set", set]);
    for (set, words) in [
        ("n=97", "`n` is 97, and must be in `1 .. 96`"),
        ("mode=\"quick\"", "`mode` is \"quick\", and must be in `[\"fast\", \"slow\"]`"),
        ("v=10 uL", "`v` is 10 uL, and must be in `20 uL .. 300 uL`"),
    ] {
        let ended = run(set);
        assert!(ended.code == 1 && ended.err.contains("out-of-range") && ended.err.contains(words), "{}", ended.err);
    }
    for set in ["n=96", "mode=\"fast\"", "v=300 uL"] {
        assert_eq!(run(set).code, 0, "{set}: {}", run(set).err);
    }
}

#[test]
fn volumes_are_distributed_and_collected_in_few_strokes() {
    let case = "tests/cases/distribute.mtx";
    let ended = matterixc(&["run", case]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let dir = folder("distribute");
    let out = dir.join("p.json");
    let ended = matterixc(&["emit", case, "--target", "opentrons-json", "--out", &out.display().to_string()]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let text = std::fs::read_to_string(&out).expect("it was written");
    let json: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let strokes: Vec<(String, f64)> = json["commands"]
        .as_array()
        .expect("commands")
        .iter()
        .filter_map(|c| Some((c["commandType"].as_str()?.to_owned(), c["params"]["volume"].as_f64()?)))
        .take(9)
        .collect();
    let expected = [270.0, 50.0, 50.0, 50.0, 50.0, 50.0, 170.0, 50.0, 50.0];
    assert_eq!(strokes.iter().map(|(_, v)| v.round()).collect::<Vec<_>>(), expected, "{strokes:?}");
    assert_eq!(strokes[6].0, "aspirate");
}
