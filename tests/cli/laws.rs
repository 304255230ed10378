//! Laws, events and effects of a user's own: what they write reaches the run, and what they make, lose or leave behind is told.

use serde_json::Value;

use crate::harness::{folder, matterixc, root, write};

/// The findings of a text: severity, code and line.
fn found(name: &str, text: &str) -> Vec<(String, String, u64)> {
    let file = write(&folder(&format!("laws_{name}")), "law.mtx", text);
    let lines = matterixc(&["check", "--format", "json", &file]).out_lines();
    let text = |v: &Value| v.as_str().unwrap_or_default().to_string();
    lines
        .iter()
        .map(|d| (text(&d["severity"]), text(&d["code"]), d["span"]["start"]["line"].as_u64().unwrap_or_default()))
        .collect()
}

/// The report of a run of a text, and how it ended.
fn ran(name: &str, text: &str) -> (i32, Value) {
    let file = write(&folder(&format!("laws_{name}_run")), "law.mtx", text);
    let ran = matterixc(&["run", "--format", "json", &file]);
    (ran.code, serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{name}: {e}: {}{}", ran.out, ran.err)))
}

fn passes(name: &str, text: &str) -> Value {
    let (code, report) = ran(name, text);
    assert_eq!(code, 0, "{name}: {report:#}");
    report
}

/// The amount of a species in a mixture at the end, SI.
fn amount(report: &Value, mixture: &str, species: &str) -> f64 {
    let all = report["containers"].as_array().expect("containers");
    let of = all.iter().find(|m| m["name"] == mixture).unwrap_or_else(|| panic!("no {mixture}"));
    let all = of["species"].as_array().expect("species");
    let found = all.iter().find(|c| c["name"] == species).unwrap_or_else(|| panic!("no {species} in {mixture}"));
    found["amount"].as_f64().expect("an amount")
}

fn sample(name: &str) -> String {
    std::fs::read_to_string(root().join("tests/cases/laws").join(name)).expect("the sample is there")
}

const LAB: &str = "mtx 1\nuse std::glassware::Beaker250mL\n";

#[test]
fn samples_run_to_their_ends() {
    for name in [
        "dropped",
        "dropped2",
        "evaporation_lost",
        "pair",
        "partition",
        "partition_typed",
        "swap",
        "wet_salt_false_error",
    ] {
        passes(name, &sample(&format!("{name}.mtx")));
    }
}

#[test]
fn matter_that_a_law_brings_arrives() {
    let report = passes("evaporated", &sample("evaporation_lost.mtx"));
    assert!((amount(&report, "b.contents", "EtOH") - 0.06).abs() < 1e-6);
    for name in ["partition", "partition_typed"] {
        let report = passes(name, &sample(&format!("{name}.mtx")));
        let ratio = amount(&report, "org.contents", "I2") / 0.02 / (amount(&report, "aq.contents", "I2") / 0.1);
        assert!((ratio - 85.0).abs() < 0.1, "{name}: {ratio}");
    }
}

#[test]
fn laws_in_a_chain_and_in_a_circle_reach_all_vessels() {
    let law = "fn passes(a: Container, b: Container) -> Frequency = 0 Hz
process filter(a: Container, b: Container) while passes(a, b) > 0 Hz {
    for s in a.contents.species {
        let q = passes(a, b) * a.contents.amount[s]
        let h = q * s.heat_capacity * (a.contents.temperature - reference_temperature)
        a.contents.amount[s]' -= q
        a.contents.enthalpy' -= h
        b.contents.amount[s]' += q
        b.contents.enthalpy' += h
    }
}
";
    let lab = |pairs: &str| {
        format!(
            "{LAB}{law}lab bench {{\n    ambient: 10 degC\n    a = Beaker250mL at (0, 0, 0) m holding 100 g of water + 10 g of EtOH\n    b = Beaker250mL at (1, 0, 0) m\n    c = Beaker250mL at (2, 0, 0) m holding 1 g of MeOH\n{pairs}}}\n"
        )
    };
    let chain = lab("    between a and b { passes: 0.01 Hz }\n    between b and c { passes: 0.01 Hz }\n");
    let text = format!(
        "{chain}workflow go in bench {{ wait 1 h; expect c.contents.amount[EtOH] > 200 mmol and a.contents.amount[MeOH] == 0 mol and c.contents.temperature > 9.99 degC and c.contents.temperature < 10.01 degC }}\n"
    );
    assert_eq!(found("chain", &text), []);
    passes("chain", &text);
    let circle = lab(
        "    between a and b { passes: 0.01 Hz }\n    between b and c { passes: 0.01 Hz }\n    between c and a { passes: 0.01 Hz }\n",
    );
    let text = format!(
        "{circle}workflow go in bench {{ wait 1 h; expect a.contents.amount[MeOH] in 10 mmol .. 11 mmol and b.contents.amount[MeOH] in 10 mmol .. 11 mmol }}\n"
    );
    assert_eq!(found("circle", &text), []);
    passes("circle", &text);
}

#[test]
fn a_law_over_a_grid_of_wells_brings_only_what_gets_there() {
    let text = "mtx 1
asset Plate6: WellPlate { wells[A1 .. B3] = Well { max_volume: 1 mL } at (-20, 10, 3) mm pitch (20, 20) mm }
relation wicks(a: Vessel, b: Vessel)
process wicking(a: Vessel, b: Vessel) while wicks(a, b) {
    a.contents.amount[dye]' -= 0.01 Hz * a.contents.amount[dye]
    b.contents.amount[dye]' += 0.01 Hz * a.contents.amount[dye]
}
species dye { formula: \"C2H6O\", density: 1 g/mL, heat_capacity: 0.1 J/(mol*K) }
lab bench {
    ambient: 25 degC
    plate = Plate6 at (0, 0, 0) m holding { A1: 500 uL of water + 1 umol of dye, A2: 100 uL of EtOH }
    between plate[A1] and plate[A2] { wicks: true }
    between plate[A2] and plate[A3] { wicks: true }
    between plate[B1] and plate[B2] { wicks: true }
}
workflow go in bench { wait 1 h; expect plate[A3].contents.amount[dye] > 0.99 umol }
";
    passes("wells", text);
    let waits = text
        .replace("expect plate[A3].contents.amount[dye] > 0.99 umol", "expect plate[B2].contents.amount[dye] > 1 nmol");
    assert!(found("wells_never", &waits).iter().any(|f| f.1 == "never-made"), "{:?}", found("wells_never", &waits));
}

#[test]
fn events_and_effects_that_add_a_species_add_it() {
    let text = format!(
        "{LAB}asset Into: Container {{ mass: 28 g, capacity: 27 J/K, air: 0 W/K, wall: 0 W/K, contents: {{ air: 0 W/K }}, max_volume: 70 mL }}
event sets(a: Beaker250mL, b: Into) when elapsed >= 1 min {{
    let n = a.contents.amount[EtOH]
    a.contents.amount[EtOH] = 0 mol
    b.contents.amount[EtOH] = b.contents.amount[EtOH] + n
}}
lab bench {{ ambient: 25 degC; x = Beaker250mL at (0, 0, 0) m holding 10 g of EtOH; y = Into at (1, 0, 0) m }}
workflow go in bench {{ wait 2 min; expect y.contents.amount[EtOH] > 0.2 mol and x.contents.amount[EtOH] == 0 mol }}
"
    );
    let left = found("event", &text);
    assert_eq!(left.iter().map(|f| (f.1.as_str(), f.2)).collect::<Vec<_>>(), [("heat-left-behind", 4)]);
    passes("event", &text);
    let text = format!(
        "{LAB}extern skill spoon(n: Amount) from(a: Container) into(b: Container)
    effect a.contents.amount[EtOH] = a.contents.amount[EtOH] - n, b.contents.amount[EtOH] = b.contents.amount[EtOH] + n
    takes 5 s
lab bench {{ ambient: 25 degC; x = Beaker250mL at (0, 0, 0) m holding 10 g of EtOH; y = Beaker250mL at (1, 0, 0) m; z = Beaker250mL at (2, 0, 0) m }}
workflow go in bench {{ spoon 0.1 mol from x into y; spoon 0.05 mol from y into z; expect z.contents.amount[EtOH] in 0.0499 mol .. 0.0501 mol }}
"
    );
    let left = found("effect", &text);
    assert_eq!(left.iter().map(|f| (f.1.as_str(), f.2)).collect::<Vec<_>>(), [("heat-left-behind", 4)]);
    passes("effect", &text);
}

#[test]
fn own_extensive_quantities_per_species_are_written_too() {
    let text = |options: &str| {
        format!(
            "mtx 1
capability Bed {{ extensive bound: Amount per Species = 0 mol {{ {options} }} }}
asset Column: Bed {{}}
process binding(b: Bed) while elapsed < 1 h {{ b.bound[water]' += 1 mmol/s; b.bound[EtOH]' -= 0 mol/s }}
lab bench {{ ambient: 25 degC, bed = Column }}
workflow go in bench {{ wait 20 s; expect bed.bound[water] > 9 mmol }}
"
        )
    };
    let all = found("bed", &text("scale: 1 umol, matter: true"));
    assert_eq!(all.first().map(|f| (f.1.as_str(), f.2)), Some(("balance-breach", 4)), "{all:?}");
    // What is not declared to be matter is a number of each species.
    assert_eq!(found("bed", &text("scale: 1 umol")), []);
    passes("bed", &text("scale: 1 umol"));
}

#[test]
fn laws_that_make_or_lose_matter_are_found_where_they_stand() {
    let lab = "lab bench { ambient: 25 degC; a = Beaker250mL at (0, 0, 0) m holding 10 g of EtOH }\nworkflow go in bench { wait 5 min }\n";
    let breach = |line| vec![("error".to_string(), "balance-breach".to_string(), line)];
    let turns = |species: &str, by: &str| {
        format!(
            "{LAB}{species}\nprocess turn(m: Mixture) while m.mass > 0 kg {{\n    let q = m.amount[EtOH] * 0.01 1/s\n    m.amount[EtOH]' -= q\n    m.amount[thing]' += {by} * q\n}}\n{lab}"
        )
    };
    let isomer = "species thing { formula: \"C2H6O\", density: 0.7 g/mL, heat_capacity: 120 J/(mol*K) }";
    let other = "species thing { formula: \"CH4O\", density: 0.7 g/mL, heat_capacity: 80 J/(mol*K) }";
    assert_eq!(found("turn_isomer", &turns(isomer, "1")), []);
    assert_eq!(found("turn_other", &turns(other, "1")), breach(4));
    assert_eq!(found("turn_twice", &turns(isomer, "2")), breach(4));
    let gone =
        format!("{LAB}process gone(m: Mixture) while m.amount[EtOH] > 1 mmol {{ m.amount[EtOH]' -= 1 mmol/s }}\n{lab}");
    assert_eq!(found("gone", &gone), breach(3));
    let event =
        format!("{LAB}event spill(m: Mixture) when elapsed > 1 min {{ m.amount[EtOH] = 0.5 * m.amount[EtOH] }}\n{lab}");
    assert_eq!(found("spill", &event), breach(3));
    // Two ways of writing the same rate conserve what they carry.
    let same = format!(
        "{LAB}{isomer}\nprocess turn(m: Mixture) while m.mass > 0 kg {{\n    m.amount[EtOH]' -= (m.amount[EtOH] + m.amount[EtOH]) * 0.005 1/s\n    m.amount[thing]' += m.amount[EtOH] * 0.01 1/s\n}}\n{lab}"
    );
    assert_eq!(found("same", &same), []);
    passes("same", &same);
}

#[test]
fn a_breach_in_a_run_names_the_law_and_the_step() {
    let text = format!(
        "{LAB}process leak(m: Mixture) while elapsed > 2 h and m.mass > 0 kg {{\n    m.amount[EtOH]' -= 1 mmol/h\n}}\nlab bench {{ ambient: 25 degC; a = Beaker250mL at (0, 0, 0) m holding 10 g of EtOH }}\nworkflow go in bench {{ wait 1 h; wait 2 h; wait 1 h }}\n"
    );
    let (code, report) = ran("leak", &text);
    assert_eq!(code, 1);
    let failure = &report["failure"];
    assert_eq!(failure["name"], "balance-breach", "{failure:#}");
    assert_eq!(failure["time"].as_f64(), Some(3.0 * 3600.0), "{failure:#}");
    let text = failure["text"].as_str().unwrap_or_default();
    assert!(text.contains("leak(a.contents)"), "{failure:#}");
}

#[test]
fn heat_that_stays_behind_is_warned_of_and_no_temperature_is_below_zero() {
    let warned = found("left", &sample("evaporation_lost.mtx"));
    assert_eq!(
        warned.iter().map(|f| (f.0.as_str(), f.1.as_str(), f.2)).collect::<Vec<_>>(),
        [("warning", "heat-left-behind", 7)]
    );
    let moved = sample("evaporation_lost.mtx").replace(
        "a.contents.amount[EtOH]' -= 1 mmol/s\n        b.contents.amount[EtOH]' += 1 mmol/s",
        "move(0.01 1/s, from: a, to: b)",
    );
    assert_eq!(found("moved", &moved), []);
    let (code, report) = ran(
        "cold",
        "mtx 1\nuse std::glassware::Beaker50mL\nprocess cooler(v: Container) while elapsed < 1 h { v.contents.enthalpy' -= 200 W }\nlab bench { ambient: 22 degC; cup = Beaker50mL at (0, 0, 0) m holding 20 mL of water }\nworkflow chill in bench { wait 1 h }\n",
    );
    assert_eq!(code, 1);
    assert_eq!(report["failure"]["name"], "nonphysical-temperature", "{:#}", report["failure"]);
}

#[test]
fn a_law_that_takes_more_than_there_is_ends_the_run() {
    let text = sample("evaporation_lost.mtx")
        .replace(" while a.contents.amount[EtOH] > 1 mmol", "")
        .replace("wait 1 min", "wait 10 min")
        .replace("20 mL of EtOH", "20 mL of EtOH + 20 mL of water");
    assert!(found("drained", &text).contains(&("error".into(), "transfer-fraction".into(), 19)));
    // What changes with time is the run's to find.
    let text = text.replace("1 mmol/s", "1 mmol/s * (1 + elapsed / (1 h))");
    let (code, report) = ran("drained", &text);
    assert_eq!(code, 1);
    assert_eq!(report["failure"]["name"], "transfer-fraction", "{:#}", report["failure"]);
    assert_eq!(report["failure"]["line"], 7);
}

#[test]
fn what_a_law_brings_together_is_screened() {
    let text = format!(
        "{LAB}fn passes(a: Container, b: Container) -> Frequency = 0 Hz
process filter(a: Container, b: Container) while passes(a, b) > 0 Hz {{
    let q = passes(a, b) * a.contents.amount[NaOCl]
    a.contents.amount[NaOCl]' -= q
    b.contents.amount[NaOCl]' += q
}}
lab bench {{
    ambient: 25 degC
    a = Beaker250mL at (0, 0, 0) m holding 20 g of NaOCl
    b = Beaker250mL at (1, 0, 0) m holding 50 g of HCl
    between a and b {{ passes: 0.01 Hz }}
}}
workflow go in bench {{ wait 1 h }}
"
    );
    let all = found("screened", &text);
    assert!(all.iter().any(|f| f.1 == "incompatible-mix"), "{all:?}");
    let apart = text.replace("between a and b { passes: 0.01 Hz }", "");
    let all = found("apart", &apart);
    assert!(!all.iter().any(|f| f.1 == "incompatible-mix"), "{all:?}");
}

#[test]
fn events_do_their_statements_in_the_order_of_the_text() {
    let text = "mtx 1
capability M { state a: Ratio = 1; state b: Ratio = 2; state c: Bool = true
  state w: up | down = up; state v: up | down = down
  event swap when elapsed >= 1 s { let t = a; a = b; b = t }
  event words when elapsed >= 1 s { let t = w; w = v; v = t }
  event both when elapsed >= 3 s { if a > 1.5 { a = 0; b = 7; c = false } else { a = 9 } } }
asset A: M {}
lab l { ambient: 25 degC, m = A }
workflow go in l { wait 2 s; expect m.a == 2 and m.b == 1 and m.w == down and m.v == up; wait 2 s; expect m.a == 0 and m.b == 7 and not m.c }
";
    assert_eq!(found("order", text), []);
    passes("order", text);
    let text = format!(
        "{LAB}event share(a: Container, b: Body) when elapsed >= 1 s and a.support == b {{ let v = a.contents.volume / 2; move(v, from: a, to: b.contents); move(v, from: a, to: b.contents) }}\n"
    );
    let text = text.replace("b: Body", "b: Container").replace("from: a, to: b.contents", "from: a, to: b");
    let text = format!(
        "{text}lab bench {{ ambient: 25 degC; low = Beaker250mL at (0, 0, 0) m; high = Beaker250mL on low holding 100 g of water }}\nworkflow go in bench {{ wait 2 s; expect high.contents.volume < 1 uL }}\n"
    );
    passes("share", &text);
}

#[test]
fn pair_parameters_keep_their_order() {
    let kinds = "capability Tank { state level: Ratio }\nasset T: Tank {}\n";
    let lab = "lab bench {\n    ambient: 25 degC\n    bottom = T { level: 0 }\n    top = T { level: 1 }\n    between top and bottom { rate: 1 Hz }\n}\n";
    let law = "process drain(a: Tank, b: Tank) while rate(a, b) > 0 Hz { let q = rate(a, b) * a.level; a.level' -= q; b.level' += q }\n";
    let flow = |f: &str, goes: &str| {
        format!("mtx 1\n{kinds}{f}\n{law}{lab}workflow go in bench {{ wait 100 s; expect {goes} }}\n")
    };
    passes("ordered", &flow("fn rate(a: Tank, b: Tank) -> Frequency = 0 Hz", "bottom.level > 0.99"));
    passes(
        "both",
        &flow("fn rate(a: Tank, b: Tank) -> Frequency = 0 Hz { symmetric: true }", "bottom.level in 0.49 .. 0.51"),
    );
    // A law that exists once for both takes them as the lab gives them.
    let once = flow(
        "fn rate(a: Tank, b: Tank) -> Frequency = 0 Hz\nrelation near(a: Tank, b: Tank) symmetric",
        "bottom.level > 0.99",
    )
    .replace("while rate(a, b) > 0 Hz", "while near(a, b)")
    .replace("{ rate: 1 Hz }", "{ rate: 1 Hz, near: true }");
    passes("once", &once);
    let kinds = "mtx 1\ncapability Tank { state level: Ratio }\nasset T: Tank {}\ncapability Sink {}\nasset S: Sink {}\nfn rate(a: Tank, b: Sink) -> Frequency = 0 Hz\n";
    let lab = |pair: &str| {
        format!(
            "{kinds}lab bench {{ ambient: 25 degC, t = T {{ level: 1 }}, s = S\n{pair}\n}}\nworkflow go in bench {{ wait 1 s; expect rate(t, s) == 1 Hz }}\n"
        )
    };
    passes("turned", &lab("between s and t { rate: 1 Hz }"));
    let code = |name: &str, pair: &str| found(name, &lab(pair)).first().map(|f| f.1.clone());
    assert_eq!(code("unfit", "between t and t { rate: 1 Hz }").as_deref(), Some("type-mismatch"));
    assert_eq!(
        code("twice", "between s and t { rate: 1 Hz }\nbetween t and s { rate: 2 Hz }").as_deref(),
        Some("duplicate-name")
    );
}

#[test]
fn no_heat_capacity_is_negative() {
    for (salt, water) in [("2 g of NaCl", "0.2 g"), ("5 g of NaOH", "1 mg"), ("1 g of MgCl2", "0.5 g")] {
        let text = format!(
            "mtx 1\nuse std::glassware::Beaker50mL\nuse std::heating::IkaRctBasic\nspecies MgCl2 {{ formula: \"MgCl2\", density: 2.32 g/mL, heat_capacity: 71.4 J/(mol*K), dissolves: Mg2+ + 2 Cl- }}\nlab bench {{ ambient: 22 degC, plate = IkaRctBasic at (2, 0, 0) m, cup = Beaker50mL on plate holding {salt} + {water} of water }}\nworkflow go in bench {{ heat plate to 80 degC; wait 1 h; expect cup.contents.temperature > 40 degC and cup.contents.temperature < 80 degC }} finally {{ stop heating plate }}\n"
        );
        passes(salt, &text);
    }
}

const DYES: &str = "mtx 1
use std::glassware::Beaker250mL
use std::devices::Container
capability Species { param fades: Frequency = 0 1/s }
species Leuco { formula: \"C10H10\", molar_volume: 110 mL/mol, heat_capacity: 220 J/(mol*K) }
species Dye { formula: \"C10H10\", molar_volume: 110 mL/mol, heat_capacity: 220 J/(mol*K), fades: 0.01 1/s }
";

const CUPS: &str = "lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 150 g of water + 5 mmol of Dye
    pot = Beaker250mL at (1, 0, 0) m holding 100 g of water + 5 mmol of Dye
    blank = Beaker250mL at (2, 0, 0) m holding 100 g of water
}
";

/// A law over a vessel and a species holds for what the vessel's mixture can hold, whatever the order of its parameters is and whatever
/// else it is about; and a species that states nothing has what the declaration of the property says.
#[test]
fn laws_over_vessels_and_species_act() {
    let halved = "workflow go in bench { wait 69.3147 s; expect cup.contents.amount[Dye] in 2.4999 mmol .. 2.5001 mmol; expect blank.contents.mass in 99.9 g .. 100.1 g }\n";
    let fades = |params: &str| {
        format!(
            "{DYES}process fades({params}) while s.fades > 0 1/s {{\n    let q = s.fades * v.contents.amount[s]\n    v.contents.amount[s]' -= q\n    v.contents.amount[Leuco]' += q\n}}\n{CUPS}{halved}"
        )
    };
    passes("vessel", &fades("v: Container, s: Species"));
    passes("turned", &fades("s: Species, v: Container"));
    let mixture = fades("v: Mixture, s: Species").replace("v.contents", "v");
    passes("mixture", &mixture);
    let room = fades("v: Container, r: Room, s: Species")
        .replace("process", "capability Room { param warm: Bool = true }\nasset R: Room {}\nprocess")
        .replace("lab bench {", "lab bench {\n    room = R");
    passes("room", &room);
}

#[test]
fn cautions_over_vessels_and_species_and_over_transfers_with_more_are_found() {
    let codes = |name: &str, caution: &str, rest: &str| -> Vec<String> {
        let flow = "process drips(a: Beaker250mL, b: Beaker250mL) while a.contents.mass > b.contents.mass and elapsed < 1 s { move(1 mL/s, from: a.contents, to: b.contents) }";
        let text = format!(
            "{DYES}capability Hood {{ param open: Bool = true }}\nasset H: Hood {{}}\n{caution}\n{flow}\n{CUPS}workflow go in bench {{ wait 2 s }}\n"
        )
        .replace("lab bench {", &format!("lab bench {{\n{rest}"));
        found(name, &text).into_iter().map(|f| f.1).filter(|code| code == "hazard").collect()
    };
    let of_vessels =
        "caution much(v: Container, s: Species) when s.fades > 0 1/s and v.contents.amount[s] > 1 mmol \"take less\"";
    assert_eq!(codes("much", of_vessels, "").len(), 2, "one for each vessel that holds the dye");
    let of_species = "caution twice(a: Mixture, b: Mixture, s: Species) of move(share, from: a, to: b) when s.fades > 0 1/s and b.amount[s] > 1 mmol \"no more\"";
    assert!(!codes("twice", of_species, "").is_empty());
    let of_hood = "caution hooded(a: Mixture, b: Mixture, h: Hood) of move(share, from: a, to: b) when h.open and a.amount[Dye] > 1 mmol \"close it\"";
    assert_eq!(codes("without", of_hood, "").len(), 0);
    assert!(!codes("hooded", of_hood, "    hood = H").is_empty());
    let shut = codes("shut", of_hood, "    hood = H { open: false }");
    assert_eq!(shut.len(), 0);
    // A salt of the lab has split by the time a hazard asks for its ions.
    let salt = "caution salty(v: Container) when v.contents.amount[Na+] > 3 mmol \"less\"";
    assert_eq!(
        codes("salty", salt, "    brine = Beaker250mL at (3, 0, 0) m holding 100 g of water + 5 mmol of NaCl").len(),
        1
    );
    assert_eq!(
        codes("mild", salt, "    brine = Beaker250mL at (3, 0, 0) m holding 100 g of water + 2 mmol of NaCl").len(),
        0
    );
    let double =
        "caution salty(v: Container) when v.contents.amount[Na+] > 3 mmol and v.contents.amount[NaCl] > 0 mol \"less\"";
    assert_eq!(
        codes("double", double, "    brine = Beaker250mL at (3, 0, 0) m holding 100 g of water + 5 mmol of NaCl").len(),
        0
    );
    let text = format!(
        "{DYES}caution odd(a: Container, b: Mixture) of move(share, from: a, to: b) when b.amount[Dye] > 1 mmol \"no\"\n{CUPS}"
    );
    assert!(found("ends", &text).iter().any(|f| f.1 == "type-mismatch"));
}

/// A symmetric relation of two things gives one law per pair, beside further parameters as well; unless these belong to one of the two.
#[test]
fn laws_over_pairs_and_more_exist_once_per_pair() {
    let text = |params: &str, condition: &str, given: &str, level: &str| {
        format!(
            "mtx 1\ncapability Tank {{ state level: Ratio }}\ncapability Room {{ param leak: Ratio = 1 }}\nasset T: Tank {{}}\nasset R: Room {{}}\n\
             relation near(a: Tank, b: Tank) symmetric\nrelation serves(r: Room, t: Tank)\n\
             process flows({params}) while {condition} {{\n    a.level' -= 0.001 1/s * r.leak\n    b.level' += 0.001 1/s * r.leak\n}}\n\
             lab bench {{\n    ambient: 25 degC\n    top = T {{ level: 1 }}\n    bottom = T {{ level: 0 }}\n    room = R\n    between top and bottom {{ near: true }}\n{given}}}\n\
             workflow go in bench {{ wait 100 s; expect bottom.level in {level} }}\n"
        )
    };
    let (once, turned) = ("0.0999 .. 0.1001", "-0.1001 .. -0.0999");
    let served = |t: &str| format!("    between room and {t} {{ serves: true }}\n");
    passes("with_room", &text("a: Tank, b: Tank, r: Room", "near(a, b)", "", once));
    passes("room_first", &text("r: Room, b: Tank, a: Tank", "r.leak > 0 and near(a, b)", "", turned));
    passes("tied", &text("a: Tank, b: Tank, r: Room", "near(a, b) and serves(r, a)", &served("top"), once));
    passes("tied_second", &text("a: Tank, b: Tank, r: Room", "near(a, b) and serves(r, a)", &served("bottom"), turned));
    let both = served("top") + &served("bottom");
    passes("both", &text("a: Tank, b: Tank, r: Room", "near(a, b) and serves(r, a) and serves(r, b)", &both, once));
}

#[test]
fn a_command_that_is_declared_again_replaces_the_inherited_one() {
    let text = r#"mtx 1
capability Base: Body {
    state n: Ratio = 0
    command poke
        effect n = 1
    command prod at(x: Ratio)
        effect n = x
    command prod at(x: Ratio) using(y: Ratio)
        effect n = x + y
}
capability Better: Base {
    command poke
        effect n = 2
    command prod at(x: Ratio)
        option far: Bool = false
        effect n = choose(far, 100, 10) * x
}
asset Old: Base { mass: 1 g, shape: box(1 mm, 1 mm, 1 mm) }
asset New: Better { mass: 1 g, shape: box(1 mm, 1 mm, 1 mm) }
lab l {
    ambient: 20 degC
    old = Old at (0, 0, 0) m
    new = New at (1, 0, 0) m
}
workflow w in l {
    poke old
    expect old.n == 1
    poke new
    expect new.n == 2
    prod old at 3
    expect old.n == 3
    prod new at 3
    expect new.n == 30
    prod new at 3 { far: true }
    expect new.n == 300
    prod new at 3 using 4
    expect new.n == 7
}
"#;
    let file = write(&folder("laws_replaced"), "law.mtx", text);
    let ended = matterixc(&["run", &file]);
    assert_eq!(ended.code, 0, "{}", ended.err);
}
