//! What is proposed for words with a slip in them.

use crate::harness::{folder, matterixc_in, write};

const BENCH: &str = "mtx 1\n\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n\nlab bench {\n    ambient: 25 degC\n    \
    table = OpticalTable at (0, 0, 0) m\n    plate = IkaRetControl on table at (300, 0) mm\n    \
    beaker = Beaker250mL on plate holding 100 g of water\n}\n\nworkflow warm in bench {\n    wait 5 s\n}\n";

/// The only finding of a text, with its help and the texts of its corrections.
#[track_caller]
fn finding(name: &str, text: &str) -> (String, Vec<String>, Vec<String>) {
    let dir = folder(&format!("meant_{name}"));
    write(&dir, "bench.mtx", text);
    let lines = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]).out_lines();
    assert_eq!(lines.len(), 1, "{name}: {lines:#?}");
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    let all = |v: &serde_json::Value| v.as_array().cloned().unwrap_or_default();
    let edits = |fix: &serde_json::Value| all(&fix["edits"]);
    (
        text(&lines[0]["headline"]),
        all(&lines[0]["help"]).iter().map(text).collect(),
        all(&lines[0]["fixes"]).iter().flat_map(edits).map(|edit| text(&edit["text"])).collect(),
    )
}

#[test]
fn words_that_start_steps_are_meant_too() {
    for (slip, headline, meant) in [
        ("wiat 5 s", "no skill or command is called `wiat`", "wait"),
        ("repaet 3 times { wait 5 s }", "`repaet` does not start a step", "repeat"),
        (
            "paralel {\n        heat plate to 60 degC\n        wait 5 s\n    }",
            "`paralel` does not start a step",
            "parallel",
        ),
        ("expcet beaker.contents.mass > 1 g", "`expcet` does not start a step", "expect"),
        ("fial \"empty\"", "no skill or command is called `fial`", "fail"),
        ("haet plate to 60 degC", "no skill or command is called `haet`", "heat"),
    ] {
        let (found, _, fixes) = finding("steps", &BENCH.replace("wait 5 s", slip));
        assert_eq!((found.as_str(), fixes.as_slice()), (headline, [meant.to_string()].as_slice()), "{slip}");
    }
}

/// The text with one slip in it, and with the first correction of its only finding; whether that leaves no doubt.
#[track_caller]
fn mended(name: &str, text: &str) -> (String, bool) {
    let dir = folder(&format!("meant_{name}"));
    write(&dir, "bench.mtx", text);
    let lines = matterixc_in(&dir, &["check", "bench.mtx", "--format", "json"]).out_lines();
    assert_eq!(lines.len(), 1, "{name}: {lines:#?}");
    let fix = &lines[0]["fixes"][0];
    let byte =
        |end: &str| fix["edits"][0]["span"][end]["byte"].as_u64().unwrap_or_else(|| panic!("{name}: {lines:#?}"));
    let mut text = text.to_string();
    let edit = fix["edits"][0]["text"].as_str().unwrap_or_default();
    text.replace_range(byte("start") as usize..byte("end") as usize, edit);
    matterixc_in(&dir, &["check", "bench.mtx", "--fix"]);
    let sure = std::fs::read_to_string(dir.join("bench.mtx")).expect("the file") == text;
    (text, sure)
}

#[test]
fn lines_are_mended_to_what_was_meant() {
    let bench = BENCH.replace("IkaRetControl\n\n", "IkaRctBasic\nuse std::heating::IkaRetControl\n\n");
    let bench = bench.replace("wait 5 s", "heat plate to 60 degC\n    wait 5 s\n    stop heating plate");
    for (slip, right, wrong, sure) in [
        ("equals", "beaker = Beaker250mL", "beaker Beaker250mL", true),
        ("colon", "beaker = Beaker250mL", "beaker: Beaker250mL", true),
        ("of", "100 g of water", "100 g water", true),
        ("bracket", "(300, 0) mm", "(300, 0 mm", false),
        ("phrase", "(0, 0, 0) m\n", "(0, 0, 0 m\n", false),
        ("degrees", "heat plate to 60 degC", "heat plate to 60 deg C", true),
        ("case", "heat plate to 60 degC", "heat plate to 60 degc", false),
        ("charge", "heat plate to 60 degC", "heat plate to 60 C", false),
        ("label", "heat plate to 60 degC", "heat plate 60 degC", false),
        ("verb", "heat plate to 60 degC", "set plate to 60 degC", false),
        ("capital", "wait 5 s", "Wait 5 s", false),
        ("slip", "wait 5 s", "wate 5 s", false),
        ("use", "\nuse std::heating::IkaRetControl", "", true),
    ] {
        let (found, was_sure) = mended(slip, &bench.replacen(right, wrong, 1));
        assert_eq!((found.as_str(), was_sure), (bench.as_str(), sure), "{slip}");
    }
    let (found, sure) = mended("elsewhere", &bench.replace("heating::IkaRct", "glassware::IkaRct"));
    assert_eq!((found.as_str(), sure), (bench.as_str(), true));
    let listed = bench.replace("IkaRctBasic\nuse std::heating::IkaRetControl", "{IkaRctBasic, IkaRetControl}");
    let (found, sure) = mended("listed", &listed.replacen(", IkaRetControl}", "}", 1));
    assert_eq!((found.as_str(), sure), (listed.as_str(), true));
}

#[test]
fn what_follows_from_one_mistake_is_not_said() {
    let heated = BENCH
        .replace("wait 5 s", "heat plate to 60 degC\n    wait 5 min\n    expect beaker.contents.temperature > 30 degC");
    for (slip, from, to, headline) in [
        ("call", "wait 5 min", "time.sleep(10)", "a step must start with a verb"),
        ("bracket", "(0, 0, 0) m", "(0, 0, 0 m holding 60 g of water", "`(` is not closed"),
        ("range", "> 30 degC", "in 20 . 30 degC", "write a range with `..`"),
        ("nameless", "    table", "    Beaker250mL at (1, 1, 0) m\n    table", "this `Beaker250mL` has no name"),
        (
            "step",
            "    table",
            "    transfer 100 uL from a to b\n    table",
            "a step belongs in a workflow, not in a lab",
        ),
        ("brace", "wait 5 min", "note \"now x :.1}\"", "`}` in a text starts or ends a value"),
        (
            "result",
            "wait 5 min",
            "let got <- wriggle beaker\n    expect got > 1 g",
            "no skill or command is called `wriggle`",
        ),
    ] {
        let (found, _, _) = finding(&format!("one_{slip}"), &heated.replacen(from, to, 1));
        assert_eq!(found, headline, "{slip}");
    }
}

#[test]
fn units_are_known_by_their_names() {
    for (said, meant) in [
        ("gram", "`g`"),
        ("grams", "`g`"),
        ("kilograms", "`kg`"),
        ("milligrams", "`mg`"),
        ("liter", "`L`"),
        ("litres", "`L`"),
        ("milliliters", "`mL`"),
        ("microlitre", "`uL`"),
        ("tons", "`t`"),
        ("sec", "`s`"),
        ("minutes", "`min`"),
        ("hours", "`h`"),
        ("celsius", "`degC`"),
        ("celcius", "`degC`"),
        ("degrees", "`deg`, `degC` or `degF`"),
        ("molar", "`M`"),
        ("moles", "`mol`"),
        ("gg", "`g`"),
    ] {
        let (_, help, _) = finding("units", &BENCH.replace("100 g of", &format!("100 {said} of")));
        assert_eq!(help.first(), Some(&format!("did you mean {meant}?")), "{said}");
    }
}

#[test]
fn a_label_names_what_is_weighed_in_or_an_ion_of_it() {
    let text = "mtx 1\n\nsolution iodide { KI: 0.66 g, water: 100 g } labelled 0.04 mol/kg of K+\n";
    let dir = folder("meant_salt");
    write(&dir, "bench.mtx", text);
    assert_eq!(matterixc_in(&dir, &["check", "bench.mtx"]).out, "no findings\n");

    let (headline, help, _) = finding("none", &text.replace("K+", "ethanol"));
    assert_eq!(headline, "the label of `iodide` gives `ethanol`, but the recipe contains none");
    assert_eq!(help, ["label a species of the recipe, or add `ethanol` to it"]);
    let (headline, ..) = finding("zero", &text.replace("0.04 mol/kg of K+", "0 mol/kg of KI"));
    assert_eq!(headline, "the label of `iodide` is zero: by its recipe it contains 0.0394977 mol/kg of KI");
}

#[test]
fn words_of_the_language_are_no_names_of_things() {
    for word in ["through", "using", "within"] {
        let (found, ..) =
            finding("reserved", &BENCH.replace("    plate =", &format!("    {word} =")).replace("on plate ", ""));
        assert_eq!(found, format!("`{word}` is a word of the language and cannot be a name"));
    }
}

#[test]
fn a_catalyst_of_the_order_alone_is_one_mistake() {
    let reaction = "reaction decay: 2 H2O2 -> 2 H2O + O2 { rate: 1.2e-3 L/(mol*s), order: { H2O2: 1, I-: 1 } }\n\nlab";
    let text = BENCH.replace("100 g of water", "100 mL of water + 0.1 mmol of H2O2 + 1 mmol of KI");
    let (found, help, _) = finding("catalyst", &text.replace("lab", reaction));
    assert_eq!(found, "the equation of `decay` does not contain `I-`");
    assert_eq!(help, ["write a catalyst on both sides: `A + C -> B + C`"]);
}

#[test]
fn an_ion_has_another_name() {
    let dir = folder("meant_ion");
    let text = "mtx 1\n\nspecies triiodide { same_as: I3- }\n\nspecies sulfate { same_as: SO4^2- }\n\n\
                solution dip { triiodide: 0 mmol/L, sulfate: 1 mmol/L, Na+: 2 mmol/L, water: rest }\n";
    write(&dir, "ion.mtx", text);
    let out = matterixc_in(&dir, &["check", "ion.mtx", "--format", "json"]);
    let errors = out.out_lines().into_iter().filter(|line| line["severity"] == "error");
    assert_eq!(errors.count(), 0);
}

#[test]
fn a_job_of_a_branch_that_lacks_a_value_has_its_name() {
    let dir = folder("meant_job");
    let text = "mtx 1\n\nlab bench {\n    ambient: 22 degC\n}\n\nworkflow warm(long: Bool) in bench {\n    \
                if long { start soak = { wait 30 min } } else { start soak = { wait 5 min } }\n    await soak\n}\n";
    write(&dir, "job.mtx", text);
    let out = matterixc_in(&dir, &["run", "job.mtx"]);
    assert!(out.err.contains("`long` has no value") || out.out.contains("`long` has no value"));
    assert!(!out.err.contains("no job `soak`") && !out.out.contains("no job `soak`"));
}
