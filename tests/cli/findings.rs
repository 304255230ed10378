//! One mistake, one message.

use crate::harness::{folder, matterixc, write};

/// Codes and headlines that `check` reports for a file.
fn findings(name: &str, text: &str) -> Vec<(String, String)> {
    let path = write(&folder(&format!("findings_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    lines.iter().map(|l| (text(&l["code"]), text(&l["headline"]))).collect()
}

/// The only finding of a file.
fn only(name: &str, text: &str) -> (String, String) {
    let found = findings(name, text);
    let [one] = found.as_slice() else { panic!("{name}: {found:?}") };
    one.clone()
}

const BENCH: &str = "mtx 1

use std::glassware::Beaker250mL
use std::heating::IkaRetControl

lab bench {
    ambient: 25 degC
    table = OpticalTable at (0, 0, 0) m
    plate = IkaRetControl on table at (300, 0) mm
    beaker = Beaker250mL on plate holding 100 g of water
}

workflow warm in bench {
    heat plate to 60 degC
    wait until beaker.contents.temperature > 40 degC timeout 4 h
    stop heating plate
} finally { stop heating plate }
";

#[test]
fn a_bench_without_mistakes_yields_nothing() {
    assert_eq!(findings("none", BENCH), []);
}

#[test]
fn names_of_an_import_that_failed_are_not_missed_again() {
    let (code, headline) = only("module", &BENCH.replace("glassware", "glasware"));
    assert_eq!((code.as_str(), headline.as_str()), ("unknown-module", "unknown module `std::glasware`"));
    let wrong = BENCH.replace("glassware::Beaker250mL", "glassware::{Beaker250mL, Beaker25mL}");
    let wrong = wrong.replace("beaker = Beaker250mL", "beaker = Beaker25mL");
    assert_eq!(only("item", &wrong).1, "`std::glassware` declares no `Beaker25mL`");
    let wrong = BENCH.replace("use std::heating", "use std::skils::grind\nuse std::heating");
    assert_eq!(only("verb", &wrong.replace("stop heating plate", "grind beaker")).0, "unknown-module");
}

#[test]
fn an_instance_of_an_unknown_asset_is_not_missed_again() {
    assert_eq!(only("asset", &BENCH.replace("= Beaker250mL", "= Beaker205mL")).0, "unknown-name");
    assert_eq!(only("device", &BENCH.replace("= IkaRetControl", "= IkaRetCtrl")).0, "unknown-name");
    assert_eq!(only("capability", &BENCH.replace("= IkaRetControl", "= Heater")).0, "wrong-kind");
}

#[test]
fn a_line_that_cannot_be_read_is_not_judged() {
    assert_eq!(only("line", &BENCH.replace("100 g of water", "100 g water")).0, "syntax");
}

#[test]
fn an_independent_mistake_on_another_line_is_reported_too() {
    let wrong =
        BENCH.replace("100 g of water", "100 g water").replace("    stop heating plate", "    stop heating plaet");
    let codes: Vec<String> = findings("two", &wrong).into_iter().map(|f| f.0).collect();
    assert_eq!(codes, ["syntax", "unknown-name"]);
}

#[test]
fn a_preposition_for_another_is_one_slip() {
    assert_eq!(only("preposition", &BENCH.replace("plate to 60", "plate at 60")).1, "`heat` does not take `at`");
}

#[test]
fn a_ring_is_reported_once() {
    for (name, ring) in [
        ("solutions", "solution a { b: 1 g, water: 9 g }\nsolution b { a: 1 g, water: 9 g }\n"),
        ("constants", "const a = 2 * b\nconst b = a / 2\n"),
        ("functions", "fn f(x: Ratio) = g(x)\nfn g(x: Ratio) = f(x)\n"),
        ("capabilities", "capability A: B {\n}\ncapability B: A {\n}\n"),
        ("members", "capability A {\n    derived p: Ratio = q + 1\n    derived q: Ratio = p - 1\n}\n"),
        ("skills", "skill warm up(p: Heater) {\n    cool off p\n}\nskill cool off(p: Heater) {\n    warm up p\n}\n"),
    ] {
        assert_eq!(only(name, &format!("mtx 1\n\n{ring}")).0, "circular", "{name}");
    }
}

/// Message and label of what is found.
fn headlines(name: &str, text: &str) -> Vec<(String, String)> {
    let path = write(&folder(&format!("headlines_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    lines.iter().map(|l| (text(&l["code"]), text(&l["headline"]))).collect()
}

#[test]
fn a_need_that_does_not_hold_is_told_in_its_own_words() {
    let text = "mtx 1

use std::furniture::OpticalTable

asset Box: Graspable {
    mass: 50 g
    shape: box(50 mm, 50 mm, 90 mm)
}
capability Press: Surface {
    param gap: Length = 60 mm
    state load: Graspable? = nothing

    command crush(item: Graspable, times: Ratio)
        needs all(h in measures(item, \"height\"): h <= gap) else jammed \"take a lower one\"
            because \"`{item}` is {h as mm} tall, and `{self}` has {gap as mm :.1}\"
        needs times < 3 else worn because \"{times} times wear it out\"
        effect load = item
        takes 1 s
}
asset Hand: Press {
    mass: 1 kg
    shape: box(50 mm, 50 mm, 50 mm)
}
lab bench {
    ambient: 25 degC
    table = OpticalTable
    press = Hand on table at (0, 0) mm
    brick = Box on table at (200, 0) mm
}
workflow flatten in bench {
    crush (brick, 1) by press
}
";
    let found = headlines("words", text);
    assert_eq!(found, [("need-unmet".into(), "`brick` is 90 mm tall, and `press` has 60 mm".into())]);
    let worn = headlines("worn", &text.replace("60 mm", "100 mm").replace("(brick, 1)", "(brick, 5)"));
    assert_eq!(worn, [("need-unmet".into(), "5 times wear it out".into())]);
    let wrong = findings("words_wrong", &text.replace("{h as mm}", "{hight as mm}"));
    assert!(wrong.iter().any(|f| f.0 == "unknown-name"), "{wrong:?}");
}

#[test]
fn what_would_follow_from_a_step_that_never_begins_is_not_judged() {
    let text = "mtx 1

use std::furniture::OpticalTable
use std::glassware::Beaker50mL
use std::robots::{FrankaHand, FrankaPanda}

lab bench {
    ambient: 25 degC
    table = OpticalTable
    arm = FrankaPanda { gripper: FrankaHand {} } on table at (0, 0) mm
    a = Beaker50mL on table at (450, 100) mm
    b = Beaker50mL on table at (450, -100) mm
}
workflow carry in bench {
    pick a by arm
    pick b by arm
    put back a by arm
}
";
    assert_eq!(only("hand_full", text).0, "hand-full");
}

#[test]
fn what_a_lab_puts_where_nothing_bears_it() {
    let lab = |lines: &str| {
        let asset = "asset Step: Surface, Graspable {\n    mass: 1 kg\n    shape: box(50 mm, 50 mm, 50 mm)\n}";
        format!(
            "mtx 1\n\nuse std::furniture::OpticalTable\n\n{asset}\nlab bench {{\n    ambient: 25 degC\n    \
             table = OpticalTable at (0, 0, 0) m\n{lines}\n}}\nworkflow rest in bench {{\n    wait 1 s\n}}\n"
        )
    };
    let bad = [
        ("beyond", "    a = Step on table at (0, 700) mm", "`a` stands beyond the edge of `table`"),
        ("half", "    a = Step on table at (0, 460) mm", "`a` stands beyond the edge of `table`"),
        ("on_another", "    b = Step on table\n    a = Step on b at (30, 0) mm", "`a` stands beyond the edge of `b`"),
        ("each_other", "    a = Step on b\n    b = Step on a", "`a` is placed on `b`, and that again on `a`"),
        (
            "three",
            "    a = Step on b\n    b = Step on c\n    c = Step on a",
            "`a` is placed on `b`, that on `c`, and that again on `a`",
        ),
    ];
    for (name, lines, headline) in bad {
        let found = findings(&format!("standing_{name}"), &lab(lines));
        assert!(found.iter().any(|f| f.1 == headline), "{name}: {found:?}");
        assert!(found.iter().all(|f| f.1 == headline || f.0 == "unused"), "{name}: {found:?}");
    }
    let good = [
        ("edge", "    a = Step on table at (0, 440) mm"),
        ("higher", "    a = Step on table at (0, 700, 20) mm"),
        ("side_by_side", "    next = OpticalTable at (0, 0.9, 0) m\n    a = Step on table at (0, 700) mm"),
    ];
    for (name, lines) in good {
        let found = findings(&format!("standing_{name}"), &lab(lines));
        assert!(found.iter().all(|f| f.0 == "unused"), "{name}: {found:?}");
    }
}

#[test]
fn a_capability_means_its_own_members() {
    let own = "mtx 1

capability Chiller {
    state active: Bool = false
    command cool down
        effect active = true
}
asset Bath: Heater, Chiller, Surface {
    mass: 12 kg
    capacity: 20 kJ/K
    air: 1 W/K
    gain: 100 W/K
    power: 2 kW
    limits: 0 degC .. 150 degC
}
lab bench {
    ambient: 25 degC
    bath = Bath at (0, 0, 0) m
}
workflow freeze in bench {
    cool down bath
    expect bath.Chiller.active and not bath.Heater.active
}
";
    assert_eq!(findings("own", own), []);
    let short = own.replace("bath.Heater.active", "bath.active");
    assert_eq!(only("short", &short).0, "ambiguous-name");
}

#[test]
fn a_rate_is_checked_where_no_lab_uses_its_reaction() {
    let text = "mtx 1\n\nreaction r: EtOH + HI -> EtI + H2O {\n    rate: 3 1/s\n    order: { EtOH: 1, HI: 1 }\n}\n";
    assert_eq!(only("rate", text).0, "rate-unit");
}

#[test]
fn a_word_cut_short_is_completed() {
    let path = write(&folder("findings_short"), "bench.mtx", BENCH.replace("contents.temperature", "contents.temp"));
    assert!(matterixc(&["check", &path]).out.contains("did you mean `temperature`?"));
}

#[test]
fn an_argument_that_is_called_like_another_parameter_keeps_its_name() {
    let bench = "mtx 1
use std::glassware::Beaker100mL
extern skill add(v: Volume) from(a: Vessel) into(b: Vessel)
    needs a.contents.volume >= v else volume_underflow
    takes 5 s effect move(v, from: a, to: b)
skill hand(v: Volume) from(b: Vessel) into(a: Vessel) fails volume_underflow { add v from b into a }
extern skill pool(v: Volume) into(b: Vessel) from(many: List<Vessel>)
    needs all(x in many: x.contents.volume + b.contents.volume >= v) else volume_underflow
    takes 5 s
lab bench {
    ambient: 25 degC
    a = Beaker100mL at (0, 0, 0) m holding 10 mL of water
    b = Beaker100mL at (1, 0, 0) m holding 20 mL of water
    x = Beaker100mL at (2, 0, 0) m holding 1 mL of water
}
";
    let says = |name: &str, step: &str, said: &str| {
        let path = write(&folder(name), "bench.mtx", format!("{bench}workflow w in bench {{ {step} }}\n"));
        let found = matterixc(&["check", &path]).out;
        assert!(found.contains(said), "{found}");
    };
    says("findings_swapped", "add 30 mL from b into a", "`b.contents.volume` is 20 mL, at least 30 mL");
    says("findings_handed", "hand 30 mL from a into b", "`a.contents.volume` is 10 mL, at least 30 mL");
    says("findings_folded", "pool 30 mL into x from [b, a]", "`b.contents.volume + x.contents.volume` is 21 mL");
}
