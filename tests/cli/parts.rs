//! Parts of lists, lists of lists and loops over whole numbers.

use crate::harness::{folder, matterixc_in, write};

const DECK: &str = "mtx 1
use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300}
table plan from csv \"plan.csv\" { k: Int, volume: Volume }
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    plate = Corning96 on ot2.slot[2]
    other = Corning96 on ot2.slot[4]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 15 mL of water }
}
";

/// What a command says of a deck with these items, and its exit status.
fn of(name: &str, command: &[&str], items: &str) -> (i32, String) {
    let dir = folder(name);
    write(&dir, "plan.csv", "k,volume\n3,10 uL\n5,20 uL\n");
    write(&dir, "a.mtx", format!("{DECK}{items}"));
    let ended = matterixc_in(&dir, &[command, &["a.mtx"]].concat());
    (ended.code, format!("{}{}", ended.out, ended.err))
}

/// That a run of these blocks of steps meets what they expect.
#[track_caller]
fn met(name: &str, blocks: &[&str]) {
    let blocks: String = blocks.iter().map(|steps| format!("    sequence {{ {steps} }}\n")).collect();
    let (code, said) = of(name, &["run"], &format!("workflow w(n: Int = 3) in deck {{\n{blocks}}}\n"));
    assert_eq!(code, 0, "{said}");
}

/// That each of these steps has one finding, at the place with this text, in these words.
#[track_caller]
fn wrong(name: &str, all: &[(&str, &str, &str)]) {
    let workflow =
        |(i, (steps, ..)): (usize, &(&str, &str, &str))| format!("workflow w{i}(n: Int = 3) in deck {{ {steps} }}\n");
    let items: Vec<String> = all.iter().enumerate().map(workflow).collect();
    let (_, said) = of(name, &["check", "--format", "concise"], &items.concat());
    let found: Vec<&str> = said.lines().filter(|line| line.contains("a.mtx:")).collect();
    assert_eq!(found.len(), all.len(), "{said}");
    for (i, ((steps, at, words), line)) in all.iter().zip(&found).enumerate() {
        let column = items[i].find(at).expect("the place is there") + 1;
        let place = format!("a.mtx:{}:{column}: ", DECK.lines().count() + 1 + i);
        assert!(line.starts_with(&place) && line.contains(words), "{steps}: {line}");
    }
}

#[test]
fn a_loop_counts_in_whole_numbers() {
    let sums = [
        ("1 .. 12", 78),
        ("1 .. n", 6),
        ("k .. n + 1", 9),
        ("-2 .. 1", -2),
        ("1 .. 0", 0),
        ("1 .. n - 3", 0),
        ("1 .. plan.count", 3),
        ("plan[0].k .. plan[1].k", 12),
    ];
    let counted = sums
        .map(|(set, sum)| format!("var s = 0; var k = 2; for i in {set} {{ s += i }}; expect s == {sum} and k == 2"));
    met("parts_loop", &counted.each_ref().map(String::as_str));
    met(
        "parts_loop",
        &[
            "let r = 1 .. 4; var s = 0; for i in r { s += i }; expect s == 10 and sum(i in 1 .. 4: i) == 10",
            "for i in 1 .. n { transfer 30 uL from stock[A1] to plate.well(i) by ot2.left using tips { tips: each } }
             expect plate[C1].contents.volume > 29 uL and plate[D1].contents.volume < 1 uL",
        ],
    );
    wrong(
        "parts_loop",
        &[
            ("for i in 1 .. 2.5 { wait 1 s }", "2.5", "2.5 is not a whole number"),
            ("for i in 1 .. n / 2 { wait 1 s }", "n / 2", "1.5 is not a whole number"),
            ("for i in 1 .. unlimited { wait 1 s }", "unlimited", "a loop counts in whole numbers"),
            ("for t in 1 s .. 3 s { wait t }", "1 s", "a loop counts in whole numbers, and this is Duration"),
            ("for i in 5 .. 2 { wait 1 s }", "5 .. 2", "empty-range"),
            ("for i in n .. 1 { wait 1 s }", "n .. 1", "empty-range"),
            ("for i in 1 .. floor(stock[A1].contents.volume / 5 mL) { wait 1 s }", "floor", "known before the run"),
        ],
    );
}

#[test]
fn a_loop_without_end_is_given_up() {
    let items = "workflow w in deck { for i in 1 .. 1000000000000 { note \"{i}\" } }\n";
    let (code, said) = of("parts_endless", &["check", "--format", "concise"], items);
    assert!(code == 1 && said.contains("budget-spent"), "{said}");
}

#[test]
fn parts_of_a_list_have_what_they_say() {
    met(
        "parts_of",
        &[
            "expect plate.wells.first(n).last == plate[C1] and plate.wells.last(2).first == plate[G12]",
            "expect plate.wells[2 .. 5].count == 4 and plate.wells[2 .. n].first == plate[C1]",
            "expect plate.row(1)[n .. n].first == plate[A4] and plate.row(1)[n .. n].count == 1",
            "let l = plate.row(2); let k = 10; expect l[k .. 11].first == plate[B11] and l[k .. k + 1].count == 2 and plate.wells[n .. k].count == 8",
            "expect plate.rows.flat.first(13).last == plate[B1] and plate.rows.flat[11 .. 12].first == plate[A12]",
            "expect plate.wells.first(0).count == 0 and plate.wells[0 .. n - 4].count == 0 and plate.wells.flat.count == 96",
            "expect plate.columns.first(2).count == 2 and plate.columns.first(2).flat.count == 16",
            "expect plan.volume.first(1).first == 10 uL and plate[A1 .. B2].count == 4 and ot2.slot[n .. 4].count == 2",
            "transfer 30 uL from stock[A1] to plate.wells.first(n) by ot2.left using tips { tips: once }
             expect sum(w in plate.wells: w.contents.volume) in 89 uL .. 91 uL",
        ],
    );
    wrong(
        "parts_of",
        &[
            ("for w in plate.wells.first(97) { note \"{w}\" }", "97", "the list has 96 elements, not 97"),
            ("for w in plate.wells.first(n - 4) { note \"{w}\" }", "n - 4", "the list has 96 elements, not -1"),
            ("for w in plate.wells.first(1.5) { note \"{w}\" }", "1.5", "1.5 is not a whole number"),
            ("for w in plate.wells[90 .. 96] { note \"{w}\" }", "96]", "there is no number 96"),
            ("for w in plate.row(1)[n - 4 .. 3] { note \"{w}\" }", "n - 4", "there is no number -1"),
            ("for w in plate.row(1)[5 .. 3] { note \"{w}\" }", "5 ..", "empty-range"),
            ("for w in [plate.wells, other.wells].first(20) { note \"{w}\" }", "20", "the list has 2 elements, not 20"),
        ],
    );
    let (_, said) =
        of("parts_of", &["check"], "workflow w in deck { for w in plate.rows.first(20) { note \"{w}\" } }\n");
    assert!(said.contains("`.flat` makes one list of them"), "{said}");
}

#[test]
fn a_skill_takes_parts_of_lists_that_are_not_known_yet() {
    let items = "skill fill(wells: List<Vessel>, n: Int) from(s: Vessel) by(p: Pipette) using(r: TipRack) {
    for i in 1 .. n { transfer 30 uL from s to wells[i] by p using r { tips: each } }
    transfer 30 uL from s to wells.first(n) by p using r { tips: once }
    transfer 30 uL from s to wells[1 .. 2] by p using r { tips: once }
}
workflow w in deck {
    fill (plate.wells, 3) from stock[A1] by ot2.left using tips
    expect plate[B1].contents.volume in 89 uL .. 91 uL and plate[D1].contents.volume in 29 uL .. 31 uL
}
workflow wrong in deck { fill (plate.row(1).first(2), 3) from stock[A1] by ot2.left using tips }
";
    let (code, said) = of("parts_skill", &["check"], items);
    assert!(code == 1 && said.contains("the list has 2 elements"), "{said}");
    let right = items.lines().filter(|line| !line.contains("workflow wrong")).collect::<Vec<_>>().join("\n") + "\n";
    let (code, said) = of("parts_skill", &["run", "--workflow", "w"], &right);
    assert_eq!(code, 0, "{said}");
}

#[test]
fn lists_of_lists_are_vessels() {
    let lists = [
        "[plate.columns.first(2), other.columns.first(1)]",
        "[plate[A1 .. B2], other[A1 .. B2]]",
        "[plate.row(1), other[A1]]",
        "[plate[A1], other.row(1)]",
    ];
    let sent = lists
        .map(|targets| format!("transfer 30 uL from stock[A1] to {targets} by ot2.left using tips {{ tips: once }}"));
    let all = "transfer 30 uL from stock[A1] to [plate.wells, other.wells] by ot2.left using tips { tips: once }";
    let sent: Vec<&str> = sent.iter().map(String::as_str).collect();
    let end =
        ["expect plate[A1].contents.volume in 149 uL .. 151 uL and other[A1].contents.volume in 149 uL .. 151 uL"];
    met("parts_lists", &[&[all], sent.as_slice(), end.as_slice()].concat());
    met(
        "parts_lists",
        &[
            "let both = [plate.wells, other.wells]; expect both.count == 2 and both.flat.count == 192 and both.flat.pairs.count == 191",
            "expect [plate.row(1), other[A1]].count == 13 and [other[A1], plate.wells].first == other[A1]",
            "var k = 0; for c in [plate.column(1), plate.column(3)] { k += c.count }; expect k == 16",
        ],
    );
    wrong("parts_lists", &[("let l = [plate.row(1), 3 uL]; note \"{l}\"", "3 uL", "cannot hold")]);
}
