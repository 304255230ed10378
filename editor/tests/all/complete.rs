//! What can be written at `$0`, in texts that are not whole there.

use matterix_editor::complete::{Completion, complete, signature};

use crate::names::{LAB, PLAN};
use crate::support::{Files, analysed, marked};

/// The best labels at `$0` in a line of the workflow of the lab; the analysis is that of the text with the line.
fn offers(line: &str) -> Vec<String> {
    in_text(&LAB.replace("    for x in", &format!("    {line}\n    for x in")))
}

/// The same where the analysis is that of the lab without the line.
fn while_typing(line: &str) -> Vec<String> {
    let whole = LAB.replace("use std::heating", "use std::opentrons::{Corning96, OT2, P300Single}\nuse std::heating").replace(
        "    crate = Crate",
        "    ot2 = OT2 { left: P300Single } at (3, 0, 0) m\n    wells = Corning96 on ot2.slot[2]\n    crate = Crate",
    );
    let (analysis, index) = analysed("cook.mtx", &whole, &Files::default());
    let (text, places) = marked(&whole.replace("    for x in", &format!("    {line}\n    for x in")));
    sorted(complete(&index, analysis.root, &text, places[0]).all)
}

fn in_text(text: &str) -> Vec<String> {
    let (text, places) = marked(text);
    let (analysis, index) = analysed("cook.mtx", &text, &Files::default());
    sorted(complete(&index, analysis.root, &text, places[0]).all)
}

fn sorted(mut found: Vec<Completion>) -> Vec<String> {
    found.sort_by(|a, b| a.rank.cmp(&b.rank).then_with(|| a.label.cmp(&b.label)));
    found.into_iter().map(|c| c.label).collect()
}

#[track_caller]
fn has(found: &[String], wanted: &[&str], not: &[&str]) {
    for w in wanted {
        assert!(found.iter().any(|f| f == w), "`{w}` is not among {found:?}");
    }
    for w in not {
        assert!(!found.iter().any(|f| f == w), "`{w}` is among {found:?}");
    }
}

#[test]
fn steps_begin_with_verbs_and_words() {
    let found = offers("$0");
    has(&found, &["heat", "swing", "bring", "wait", "let", "expect"], &["centrifuge", "ambient"]);
    has(&offers("br$0"), &["bring"], &["heat"]);
    has(&offers("stop $0"), &["heating"], &["bring"]);
}

#[test]
fn arguments_are_what_the_call_asks_for() {
    let found = offers("bring $0");
    assert_eq!(found[0], "beaker", "{found:?}");
    has(&offers("bring beaker $0"), &["to", "with", "{ }"], &["from"]);
    has(&offers("bring beaker to 40 degC $0"), &["with"], &["to"]);
    let found = offers("bring beaker to 40 degC with $0");
    assert_eq!(found[0], "plate", "{found:?}");
    has(&offers("bring beaker to 40 degC with plate { $0 }"), &["limit"], &["beaker"]);
    has(&offers("swing crate to $0")[..2], &["open", "closed"], &[]);
}

#[test]
fn options_of_a_call_that_is_named_are_known() {
    let found = offers("let warm <- bring beaker to 40 degC with plate { $0 }");
    assert_eq!(found[0], "limit", "{found:?}");
    has(&offers("let warm <- bring beaker to 40 degC with plate { limit: 5 $0 }"), &["min", "s"], &["mL"]);
}

#[test]
fn what_is_held_is_measured_and_named() {
    let lab = |line: &str| in_text(&LAB.replace("    crate = Crate", &format!("    {line}\n    crate = Crate")));
    for line in ["cup = Beaker250mL on plate holding 3 $0", "cup = Beaker250mL on plate holding 3 g of water + 1 $0"] {
        let found = lab(line);
        has(&found[..16], &["mL", "g", "mg"], &["cL"]);
        has(&found, &["mol", "uL", "mg"], &["degC", "s"]);
    }
    let deck = |held: &str| {
        let deck = "mtx 1\nuse std::opentrons::{Corning96, OT2}\nlab deck {\n    ambient: 22 degC\n    ot2 = OT2 at (0, 0, 0) m\n";
        let line = |held: &str| format!("    plate = Corning96 on ot2.slot[2]{held}\n}}\n");
        let whole = format!("{deck}{}", line(""));
        let (analysis, index) = analysed("a.mtx", &whole, &Files::default());
        let (text, places) = marked(&format!("{deck}{}", line(&format!(" holding {{ {held} }}"))));
        sorted(complete(&index, analysis.root, &text, places[0]).all)
    };
    has(&deck("$0"), &["A1", "H12"], &["mass"]);
    has(&deck("A1: 5 mL of water, $0"), &["A1", "H12"], &["mass"]);
    has(&deck("A1: 5 $0"), &["mL", "mg"], &["degC"]);
    has(&deck("A1: 5 mL of wa$0"), &["water"], &[]);
    has(&in_text("mtx 1\nsolution s { NaCl: 5 $0, water: rest }"), &["g", "mL", "mmol"], &["degC", "s"]);
    has(&in_text("mtx 1\nasset Mug: Container, Graspable {\n    $0\n}"), &["mass"], &["lab"]);
}

#[test]
fn parts_that_fit_are_offered_with_their_things() {
    let found = while_typing("pick up tip from rack by $0");
    has(&found, &["ot2.left"], &["ot2.bin"]);
}

#[test]
fn units_are_those_of_what_is_expected() {
    let found = offers("bring beaker to 40 $0");
    assert_eq!(found[0], "degC", "{found:?}");
    has(&found, &["K"], &["mL", "s"]);
    has(&offers("wait 10 $0"), &["s", "min", "h", "ms"], &["degC"]);
    has(&offers("expect beaker.contents.volume > 3 $0"), &["mL", "L", "uL"], &["degC", "s"]);
    has(&offers("expect elapsed > 3 m$0"), &["min", "ms"], &["mL"]);
    has(&offers("let x = beaker.contents.temperature as $0"), &["degC"], &["mL"]);
}

#[test]
fn members_stand_behind_a_dot() {
    has(&offers("expect beaker.$0"), &["contents", "volume", "temperature", "mass"], &["heat"]);
    has(&offers("expect beaker.contents.t$0"), &["temperature"], &["mass"]);
    has(&offers("expect crate.$0"), &["lid"], &["contents"]);
    has(&offers("expect crate.lid == $0")[..2], &["open", "closed"], &[]);
    has(&offers("expect crate is $0"), &["open", "closed"], &[]);
    has(&offers("expect look.$0"), &["start", "end", "elapsed"], &[]);
    has(&offers("note \"{crate.$0}\""), &["lid"], &[]);
}

#[test]
fn rows_have_the_columns_of_their_table() {
    let typed = |line: &str| {
        let (text, places) = marked(&PLAN.replace("        expect", &format!("        {line}\n        expect")));
        let (analysis, index) = crate::names::plan();
        sorted(complete(&index, analysis.root, &text, places[0]).all)
    };
    has(&typed("expect row.$0"), &["amount", "wait_for", "kind", "line"], &["count"]);
    has(&typed("expect plan.$0"), &["amount", "wait_for", "kind", "count", "first"], &["line"]);
}

#[test]
fn species_and_places_stand_in_brackets() {
    has(&offers("expect beaker[$0"), &["water", "EtOH"], &["heat"]);
    let text = "mtx 1\nuse std::opentrons::{Corning96, OT2}\nlab deck {\n    ambient: 22 degC\n    ot2 = OT2 at (0, 0, 0) m\n    plate = Corning96 on ot2.slot[$0\n}\n";
    let whole = text.replace("$0", "2]");
    let (analysis, index) = analysed("a.mtx", &whole, &Files::default());
    let (broken, places) = marked(text);
    let found = complete(&index, analysis.root, &broken, places[0]);
    let labels: Vec<&str> = found.all.iter().map(|c| c.label.as_str()).collect();
    assert!(labels.contains(&"1") && labels.contains(&"11"), "{labels:?}");
    let text = whole + "workflow w in deck {\n    expect plate[$0\n}\n";
    has(&in_text(&text), &["A1", "H12"], &[]);
}

#[test]
fn labs_are_made_of_assets() {
    let lab = |line: &str| in_text(&LAB.replace("    crate = Crate", &format!("    {line}\n    crate = Crate")));
    has(&lab("other = $0"), &["Crate", "Beaker250mL", "OpticalTable"], &["Body"]);
    has(&lab("other = Crate $0"), &["at", "on"], &["heat"]);
    has(&lab("other = Crate on $0"), &["plate"], &["Crate"]);
    has(&lab("other = Crate { $0 }"), &["lid", "mass"], &["temperature"]);
    has(&lab("other = Crate { lid: $0 }")[..2], &["open", "closed"], &[]);
    has(&lab("other = Beaker250mL on plate holding 3 g of $0"), &["water"], &["plate"]);
    has(&lab("$0"), &["ambient", "include", "between"], &["heat"]);
}

#[test]
fn files_begin_with_items() {
    has(&in_text(&format!("{LAB}\n$0")), &["lab", "workflow", "skill", "use"], &["heat"]);
    has(&in_text("mtx 1\nuse std::$0\n"), &["heating", "robots"], &[]);
    has(&in_text("mtx 1\nuse std::heating::$0\n"), &["IkaRetControl"], &["FrankaPanda"]);
    has(&in_text("mtx 1\nuse std::heating::{$0}\n"), &["IkaRetControl"], &["FrankaPanda"]);
    has(&in_text(&format!("{LAB}\nworkflow w in $0")), &["bench"], &["Crate"]);
    has(&in_text(&format!("{LAB}\nstudy s of $0")), &["cook"], &["water"]);
    has(&in_text("mtx 1\nasset A: $0"), &["Vessel", "Body"], &["heat"]);
    has(&in_text("mtx 1\ncapability A {\n    $0\n}"), &["state", "param", "command"], &["heat"]);
    has(&in_text("mtx 1\ncapability A {\n    param x: $0\n}"), &["Temperature", "Bool"], &[]);
    has(&in_text("mtx 1\nspecies A { $0 }"), &["formula", "density", "pka"], &[]);
}

#[test]
fn properties_of_ones_own_are_offered_as_those_of_the_library() {
    let own = "mtx 1\ncapability Species {\n    /// Of a rat.\n    param toxicity: MassFraction\n}\n";
    has(&in_text(&format!("{own}species A {{ $0 }}")), &["toxicity", "density", "same_as"], &["heat"]);
    has(&offers("expect water.$0"), &["density", "pka", "charge"], &["heat"]);
}

#[test]
fn nothing_is_offered_in_comments_and_texts() {
    assert!(offers("// hea$0").is_empty());
    assert!(offers("note \"hea$0\"").is_empty());
}

#[test]
fn what_was_known_before_a_change_still_counts() {
    let (analysis, index) = analysed("cook.mtx", LAB, &Files::default());
    let (text, places) = marked(
        &LAB.replace("    swing crate to open\n", "    swing crate to open\n    let y = rise + beaker.contents.$0"),
    );
    let found = complete(&index, analysis.root, &text, places[0]);
    assert!(found.all.iter().any(|c| c.label == "temperature"));
}

#[test]
fn signatures_say_which_part_is_written() {
    let at = |line: &str| {
        let (text, places) =
            marked(&LAB.replace("    swing crate to open\n", &format!("    swing crate to open\n    {line}\n")));
        let (analysis, index) = analysed("cook.mtx", &text, &Files::default());
        let found = signature(&index, analysis.root, &text, places[0])?;
        let part = found.active.map(|a| found.label[found.parts[a].0.clone()].to_string());
        Some((found.label, part))
    };
    let form = "bring V to T with P { limit }".to_string();
    assert_eq!(at("bring beak$0"), Some((form.clone(), Some("V".into()))));
    assert_eq!(at("bring beaker to 3$0"), Some((form.clone(), Some("T".into()))));
    assert_eq!(at("bring beaker to 3 degC with $0"), Some((form.clone(), Some("P".into()))));
    assert_eq!(at("bring beaker to 3 degC with plate { limit: $0 }"), Some((form, Some("limit".into()))));
    let (label, part) = at("let y = clamp(1, $0)").expect("a function");
    assert!(label.starts_with("clamp(x, low, high)"), "{label}");
    assert_eq!(part.as_deref(), Some("low"));
    assert_eq!(at("note \"bring $0\""), None);
}

#[test]
fn values_stand_in_the_braces_of_a_text() {
    for found in [offers("note \"{$0}\""), while_typing("note \"{$0}\"")] {
        has(&found, &["beaker", "elapsed", "target"], &["heat", "wait", "bring"]);
    }
    has(&while_typing("note \"it took {el$0}\""), &["elapsed"], &["heat"]);
    has(&while_typing("note \"{max(beaker.volume, $0\""), &["beaker"], &["heat"]);
    has(&while_typing("note \"{target $0}\""), &["as"], &["heat", "beaker"]);
    has(&while_typing("note \"{target as $0}\""), &["degC"], &["mL"]);
}

#[test]
fn whole_conditions_are_followed_by_words() {
    let operands = ["beaker", "elapsed", "clamp"];
    let follows = |line: &str, wanted: &[&str]| {
        for found in [offers(line), while_typing(line)] {
            has(&found, wanted, &operands);
        }
    };
    follows("wait until beaker.contents.temperature >= 40 degC $0", &["timeout", "and", "or"]);
    follows("wait until crate.lid == open $0", &["timeout", "and", "or"]);
    follows("hold beaker.temperature in 40 degC .. 50 degC $0", &["for", "and"]);
    follows("hold beaker.temperature in 40 degC .. 50 degC for 1 min $0", &["timeout"]);
    follows("within 5 min $0", &["after"]);
    follows("expect beaker.contents.volume > 3 mL $0", &["and", "or"]);
    follows("expect beaker.contents.volume $0", &["in", "is", "as"]);
    follows("repeat 3 $0", &["times"]);
    follows("repeat while crate.lid == open $0", &["max"]);
    has(&while_typing("expect beaker.contents.volume > 3 mL and $0"), &["beaker"], &["timeout"]);
    has(&while_typing("wait until beaker.contents.volume > 3 mL timeout 5 $0"), &["min", "s"], &["mL"]);
    has(&while_typing("try { wait 1 s } $0"), &["else", "on", "finally"], &["heat", "let"]);
    has(&while_typing("sequence { wait 1 s } $0"), &["on", "finally"], &["heat", "else"]);
    has(&while_typing("if crate.lid == open { wait 1 s } $0"), &["else"], &["heat", "on"]);
    has(&while_typing("sequence { wait 1 s }\n    $0"), &["heat", "let"], &["else"]);
    let found = while_typing("stop $0");
    assert_eq!(found[0], "heating", "{found:?}");
}

#[test]
fn names_that_are_being_written_have_members() {
    has(&while_typing("for w in wells[A1 .. A3] { expect w.$0 }"), &["contents", "volume"], &[]);
    has(&while_typing("wait 10 min\n    for w in wells[A1 .. A3] { expect w.$0 }"), &["contents"], &[]);
    has(&while_typing("for w in wells.row(1) { expect $0 }"), &["w"], &[]);
    has(&while_typing("expect all(w in wells[A1 .. A3]: w.$0)"), &["contents", "volume"], &[]);
    has(&while_typing("expect all(p in wells.row(1).pairs: p.first.$0)"), &["contents", "volume"], &[]);
    has(&while_typing("step rest { wait 1 s }\n    expect rest.$0"), &["start", "end", "elapsed"], &[]);
}

#[test]
fn units_of_concentrations_and_of_lines_of_labs_are_known() {
    let found = while_typing("let x = beaker[water] as $0");
    has(&found, &["mol/kg", "mol/L", "g/L", "mol/kg_solvent", "%w/w"], &["s", "mL", "degC"]);
    has(&while_typing("expect beaker[water] > 1 $0"), &["mol/kg", "mol/L"], &["s", "degC"]);
    let lab = |line: &str| in_text(&LAB.replace("    crate = Crate", &format!("    {line}\n    crate = Crate")));
    let found = in_text(&LAB.replace("ambient: 22 degC", "ambient: 22 $0"));
    assert_eq!(found[0], "degC", "{found:?}");
    has(&found, &["K"], &["mL"]);
    has(&lab("other = Crate holding 10 $0"), &["mL", "g", "mmol"], &["degC", "s"]);
    let found = lab("other = Crate on plate at (0, 0) $0");
    assert_eq!(found[0], "m", "{found:?}");
    has(&found, &["mm"], &["degC", "mL"]);
    has(&lab("other = Crate { lid: open } $0"), &["on", "at", "holding"], &["ambient"]);
    has(&lab("between plate and beaker { $0 }"), &["conductance"], &["ambient", "clamp", "heat"]);
}
