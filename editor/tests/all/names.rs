//! Definition, references and hover at marked places.

use matterix_editor::references::references;
use matterix_editor::{Analysis, Index};

use crate::support::{Files, analysed, marked};

pub const LAB: &str = r#"mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
/// How warm it gets.
const warm: Temperature = 45 degC
/// Opens and closes.
capability Lidded: Body {
    /// Where its lid is.
    state lid: open | closed = closed
    command swing to(position: open | closed)
        effect lid = position
}
asset Crate: Lidded { mass: 1 kg }
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
    crate = Crate at (1, 0, 0) m
}
/// Brings a vessel to a temperature.
skill bring(v: Container) to(t: Temperature) with(p: Heater & Surface)
    option limit: Duration = 1 h
{
    heat p to t + 10 K
    wait until v.contents.temperature >= t timeout limit
    stop heating p
}
workflow cook(target: Temperature = warm) in bench {
    let rise = target - ambient
    bring beaker to target with plate { limit: 2 h }
    swing crate to open
    step look { expect beaker.contents.temperature > 40 degC }
    for x in [1 s, 2 s] { wait x }
    expect crate.lid == open and look.elapsed < 1 h and rise > 1 K
} finally { stop heating plate }
"#;

/// A plan from a table whose columns have headers of their own or not.
pub const PLAN: &str = r#"mtx 1
use std::glassware::Beaker250mL
table plan from csv "plan.csv" {
    amount: Mass
    wait_for "Rest (s)": Duration as s = 5 s
    kind: fine | coarse
}
lab bench {
    ambient: 22 degC
    beaker = Beaker250mL at (0, 0, 0) m holding 100 g of water
}
workflow go(limit: Mass in 1 g .. 3 g = 2 g) in bench {
    for row in plan {
        if row.amount < limit and row.kind == fine { wait row.wait_for }
        expect plan.amount.count == 2 and row.line > 1 and beaker.volume > 90 mL
    }
}
"#;

/// The plan with its file.
pub fn plan() -> (Analysis, Index) {
    let mut files = Files::default();
    files.texts.insert("plan.csv".into(), "amount,Rest (s),kind\n1 g,2,fine\n3 g,,coarse\n".into());
    let (analysis, index) = analysed("plan.mtx", PLAN, &files);
    let found: Vec<_> = analysis.findings.iter().map(|d| &d.headline).collect();
    assert!(found.is_empty(), "{found:?}");
    (analysis, index)
}

#[test]
fn columns_are_found_where_rows_name_them() {
    let (analysis, index) = plan();
    let plain = Index::declared(&analysis);
    for index in [&index, &plain] {
        let line = |what: &str| {
            let spans = index.definition(analysis.root, place(PLAN, what));
            let at = spans.first().unwrap_or_else(|| panic!("`{what}` is declared")).start as usize;
            PLAN[at..].lines().next().unwrap_or_default()
        };
        assert_eq!(line("row.|amount"), "amount: Mass");
        assert_eq!(line("wait row.|wait_for"), r#"wait_for "Rest (s)": Duration as s = 5 s"#);
        assert_eq!(line("row.|kind"), "kind: fine | coarse");
        assert_eq!(line("== |fine"), "fine | coarse");
        assert_eq!(line("plan.|amount"), "amount: Mass");
        assert_eq!(line("go(|limit"), "limit: Mass in 1 g .. 3 g = 2 g) in bench {");
        assert!(index.uses(analysis.root).iter().all(|u| u.meaning != matterix_editor::index::Meaning::Unknown));
    }
    let rename = |what: &str| matterix_editor::rename::rename(&[], &index, analysis.root, place(PLAN, what), "pause");
    assert_eq!(rename("row.|amount").unwrap_err(), "the header of the file names the column `amount`");
    assert_eq!(rename("row.|wait_for").expect("has a header of its own")["plan.mtx"].len(), 2);
}

/// The lab with a mark at the n-th occurrence of a text, `|` within it where the cursor stands.
pub fn place(text: &str, what: &str) -> usize {
    let plain = what.replace('|', "");
    let at = text.find(&plain).unwrap_or_else(|| panic!("`{plain}` is there"));
    at + what.find('|').unwrap_or(0)
}

fn lab() -> (Analysis, Index) {
    let (analysis, index) = analysed("cook.mtx", LAB, &Files::default());
    let found: Vec<_> = analysis.findings.iter().map(|d| &d.headline).collect();
    assert!(found.is_empty(), "{found:?}");
    (analysis, index)
}

/// The line on which what stands at a place is declared.
fn declared(what: &str) -> String {
    let (analysis, index) = lab();
    let spans = index.definition(analysis.root, place(LAB, what));
    let Some(span) = spans.first() else { return "nothing".into() };
    let text = analysis.text(span.file);
    let start = text[..span.start as usize].rfind('\n').map_or(0, |i| i + 1);
    text[start..].lines().next().unwrap_or_default().trim().to_string()
}

#[test]
fn names_lead_to_their_declarations() {
    let cases = [
        ("Temperature = |warm", "const warm: Temperature = 45 degC"),
        ("bring |beaker", "beaker = Beaker250mL on plate holding 100 g of water"),
        ("    |bring beaker", "skill bring(v: Container) to(t: Temperature) with(p: Heater & Surface)"),
        ("with plate { l|imit: 2 h", "option limit: Duration = 1 h"),
        ("beaker |to target", "skill bring(v: Container) to(t: Temperature) with(p: Heater & Surface)"),
        ("to |target with", "workflow cook(target: Temperature = warm) in bench {"),
        ("{ wait |x }", "for x in [1 s, 2 s] { wait x }"),
        ("crate.|lid ==", "state lid: open | closed = closed"),
        ("swing crate to |open", "command swing to(position: open | closed)"),
        ("lid == |open", "state lid: open | closed = closed"),
        ("|look.elapsed", "step look { expect beaker.contents.temperature > 40 degC }"),
        ("v.|contents.temperature", "part contents: OpenMixture"),
        ("target - |ambient", "ambient: 22 degC"),
        ("of |water", "species water {"),
        ("= |Beaker250mL on", "asset Beaker250mL: Container, Graspable"),
        ("45 deg|C", "unit degC: Temperature = 1 K from 273.15 K also °C"),
        ("    |heat p", "command heat to(t: Temperature)"),
        ("p: Heater & |Surface", "capability Surface: Body {"),
        ("|rise > 1 K", "let rise = target - ambient"),
    ];
    for (what, expected) in cases {
        let found = declared(what);
        assert!(found.starts_with(expected.trim_end_matches(" {")), "`{what}` leads to `{found}`");
    }
}

#[test]
fn a_module_leads_to_its_file() {
    let (analysis, index) = lab();
    let spans = index.definition(analysis.root, place(LAB, "std::|heating"));
    assert_eq!(index.module_name(spans[0].file), "std::heating");
}

#[test]
fn references_are_all_places_of_a_name() {
    let (analysis, index) = lab();
    let count = |what: &str| {
        references(&[], &index, analysis.root, place(LAB, what), true).iter().filter(|p| p.file == "cook.mtx").count()
    };
    assert_eq!(count("cook(|target"), 3);
    assert_eq!(count("|crate = Crate"), 3);
    assert_eq!(count("state |lid"), 3);
    assert_eq!(count("skill |bring"), 2);
    assert_eq!(count("step |look"), 2);
    assert_eq!(index.highlights(analysis.root, place(LAB, "cook(|target")).len(), 3);
}

#[test]
fn references_go_through_files() {
    let mut files = Files::default();
    files.texts.insert("parts".into(), "mtx 1\nconst speed: Velocity = 2 m/s\n".into());
    let text = "mtx 1\nuse parts::speed\nconst twice = 2 * speed\n";
    let (analysis, index) = analysed("main.mtx", text, &files);
    let (_, other) = analysed("parts.mtx", &files.texts["parts"], &Files::default());
    let at = place(text, "2 * |speed");
    let found = references(&[&other], &index, analysis.root, at, true);
    let places: Vec<(&str, u32)> = found.iter().map(|p| (p.file.as_str(), p.start)).collect();
    assert_eq!(places, [("main.mtx", 17), ("main.mtx", 41), ("parts.mtx", 12)]);
}

fn said(what: &str) -> String {
    let (analysis, index) = lab();
    index.about(analysis.root, place(LAB, what)).map(|s| s.text).unwrap_or_default()
}

#[test]
fn hover_says_what_a_name_is() {
    let cases: &[(&str, &[&str])] = &[
        ("Temperature = |warm", &["const warm", "Temperature", "45 degC = 318.15 K", "How warm it gets."]),
        ("crate.|lid ==", &["state lid: open | closed = closed", "of capability `Lidded`", "Where its lid is."]),
        ("    |bring beaker", &["skill bring", "Brings a vessel to a temperature."]),
        ("45 deg|C", &["Temperature", "0 degC is 273.15 K"]),
        ("|rise > 1 K", &["let rise", "TemperatureDifference"]),
        ("bring |beaker", &["beaker = Beaker250mL", "Beaker250mL"]),
        ("target - |ambient", &["ambient: 22 degC", "22 degC = 295.15 K"]),
        ("std::|heating", &["use std::heating"]),
        ("look.|elapsed", &["its duration so far"]),
    ];
    for (what, parts) in cases {
        let text = said(what);
        for part in *parts {
            assert!(text.contains(part), "`{what}` lacks `{part}`:\n{text}");
        }
    }
}

#[test]
fn hover_knows_properties_hazards_and_what_is_allowed() {
    let text = "mtx 1
use std::glassware::Beaker50mL
use std::heating::IkaRetControl
capability Species {
    /// Of a rat.
    param toxicity: MassFraction
}
species poison { by: mass, density: 1 g/mL, specific_heat: 2 J/(g*K), toxicity: 1 %w/w, melting_point: 300 K }
/// It smokes.
hazard smokes(h: Heater) when h.target > 150 degC \"less\"
fn harm(s: Species) -> MassFraction = s.toxicity
/// It is much.
caution much(v: Vessel) of v.contents.volume when sum(s in having(v.contents.species, \"toxicity\"): s.toxicity) > 0 %w/w \"less\"
allow much \"in a hood\"
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker50mL on plate holding 10 g of water at 40 degC
}
workflow warm in bench {
    sequence { heat plate to 40 degC } on smokes { note \"smoke\" }
    stop heating plate
}
";
    let (analysis, index) = analysed("a.mtx", text, &Files::default());
    let cases: &[(&str, &[&str])] = &[
        ("1 g/mL, specific_heat: 2 J/(g*K), |toxicity", &["param toxicity", "Of a rat."]),
        ("%w/w, |melting_point", &["param melting_point", "std::chemistry"]),
        ("= s.|toxicity", &["param toxicity", "Of a rat."]),
        ("allow |much", &["caution much", "It is much."]),
        ("on |smokes", &["hazard smokes", "It smokes."]),
        ("water at 40 deg|C", &["Temperature"]),
    ];
    for (what, parts) in cases {
        let said = index.about(analysis.root, place(text, what)).map(|s| s.text).unwrap_or_default();
        for part in *parts {
            assert!(said.contains(part), "`{what}` lacks `{part}`:\n{said}");
        }
    }
}

#[test]
fn skills_are_called_and_call() {
    let (analysis, index) = lab();
    let bring = index.caller_at(analysis.root, place(LAB, "skill |bring")).expect("a skill");
    let names = |calls: Vec<matterix_editor::calls::Calls>| -> Vec<String> {
        calls.iter().map(|c| index.def(c.def).name.clone()).collect()
    };
    assert_eq!(names(index.incoming(bring)), ["cook"]);
    assert_eq!(names(index.outgoing(bring)), ["heat", "stop heating"]);
}

#[test]
fn symbols_are_found_by_their_letters() {
    let (_, index) = lab();
    let names: Vec<String> = index.symbols("cr").into_iter().map(|s| s.name).collect();
    assert!(names.contains(&"Crate".to_string()) && names.contains(&"crate".to_string()), "{names:?}");
    assert!(index.symbols("qqq").is_empty());
}

#[test]
fn marks_are_taken_out() {
    assert_eq!(marked("a$0b$1"), ("ab".to_string(), vec![1, 2]));
}

#[test]
fn a_prefix_belongs_to_its_unit() {
    let text = "mtx 1\nconst a = 3 uL\nconst b = 2 mmol/uL\nconst c = 4 L\n";
    let (analysis, index) = analysed("a.mtx", text, &Files::default());
    for (what, word, size) in [
        ("|uL", "uL", "1 uL is"),
        ("u|L", "uL", "1 uL is"),
        ("|mmol", "mmol", "1 mmol is"),
        ("m|mol", "mmol", "1 mmol is"),
        ("mmo|l", "mmol", "1 mmol is"),
        ("/|uL", "uL", "1 uL is"),
        ("4 |L", "L", "1 L is"),
    ] {
        let said = index.about(analysis.root, place(text, what)).unwrap_or_else(|| panic!("`{what}` is a unit"));
        assert_eq!(index.text(said.span), word);
        assert!(said.text.contains(size), "{}", said.text);
    }
}
