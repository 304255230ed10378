//! The chemical screen: each fault alone, and its twin without.

use crate::harness::{folder, matterixc, write};

/// Code, severity, line and headline of every finding.
fn findings(name: &str, text: &str) -> Vec<(String, String, u64, String)> {
    let path = write(&folder(&format!("screening_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    let line = |v: &serde_json::Value| v["span"]["start"]["line"].as_u64().unwrap_or_default();
    lines.iter().map(|l| (text(&l["code"]), text(&l["severity"]), line(l), text(&l["headline"]))).collect()
}

/// A bench with three vessels, a pump from `a` to `b`, and steps.
fn bench(a: &str, b: &str, c: &str, steps: &str) -> String {
    format!(
        "mtx 1

use std::glassware::{{Beaker250mL, Beaker50mL}}
use std::heating::IkaRetControl
use std::robots::FrankaPanda

lab bench {{
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    arm = FrankaPanda on table at (0, 0) mm
    scale = IkaRetControl on table at (550, 0) mm
    waste = Beaker250mL on scale{a}
    b = Beaker50mL on table at (450, 250) mm{b}
    c = Beaker50mL on table at (450, 350) mm{c}
}}

workflow run in bench {{
    {steps}
}}
"
    )
}

fn holding(what: &str) -> String {
    if what.is_empty() { String::new() } else { format!(" holding {what}") }
}

/// What pouring one liquid into another yields: code and severity.
fn poured(name: &str, target: &str, source: &str) -> Vec<(String, String)> {
    let pour = "pour 5 g from b into waste by arm using scale { tolerance: 1 g }";
    let text = bench(&holding(target), &holding(source), "", pour);
    let found = findings(name, &text);
    for (_, _, line, _) in &found {
        assert_eq!(*line, 18, "{name}: the step that brings them together");
    }
    found.into_iter().map(|f| (f.0, f.1)).collect()
}

fn error() -> Vec<(String, String)> {
    vec![("incompatible-mix".into(), "error".into())]
}

fn warning() -> Vec<(String, String)> {
    vec![("incompatible-mix".into(), "warning".into())]
}

#[test]
fn grave_pairs_are_errors_where_they_meet() {
    for (name, target, source) in [
        ("nitric", "50 g of acetone", "10 g of water + 10 g of HNO3"),
        ("hydrochloric", "50 g of acetone", "20 g of water + 2 g of HCl"),
        ("sulfuric", "50 g of acetone", "10 g of H2SO4"),
        ("ketone", "50 g of butanone", "10 g of HNO3"),
        ("ethanol", "50 g of EtOH", "10 g of HNO3"),
        ("bleach", "50 g of water + 2 g of NaOCl", "20 g of water + 0.1 g of HCl"),
        ("ammonia", "50 g of water + 2 g of NaOCl", "20 g of water + 1 g of NH3"),
        ("cyanide", "50 g of water + 0.5 g of NaCN", "20 g of water + 1 g of acetic_acid"),
        ("sulfide", "50 g of water + 0.5 g of Na2S", "20 g of water + 0.1 g of HCl"),
        ("peroxide", "50 g of acetone", "14 g of water + 6 g of H2O2"),
        ("permanganate", "50 g of EtOH", "6 g of KMnO4"),
        ("sodium", "50 g of water", "10 g of Na"),
        ("borohydride", "50 g of water + 2 g of HCl", "10 g of water + 1 g of NaBH4 + 0.5 g of NaOH"),
        ("chloride", "50 g of water", "10 g of acetyl_chloride"),
        ("amine", "50 g of aniline", "10 g of water + 10 g of HNO3"),
    ] {
        assert_eq!(poured(name, target, source), error(), "{name}");
    }
}

#[test]
fn heat_alone_is_a_warning_and_only_where_it_is_much() {
    assert_eq!(poured("strong_neutral", "50 g of water + 8 g of HCl", "20 g of water + 4 g of NaOH"), warning());
    assert_eq!(poured("thin_neutral", "50 g of water + 1 g of HCl", "20 g of water + 1 g of NaOH"), []);
}

#[test]
fn ordinary_liquids_may_meet() {
    for (name, target, source) in [
        ("thin_acid", "50 g of acetone", "20 g of water + 10 mg of HCl"),
        ("wash", "50 g of DCM", "20 g of water + 2 g of HCl"),
        ("base_wash", "50 g of DCM + 5 g of Et3N", "20 g of water + 1 g of NaHCO3"),
        ("thin_peroxide", "50 g of EtOH", "20 g of water + 0.6 g of H2O2"),
        ("catalyst", "50 g of salicylic_acid + 10 g of water", "10 g of water + 2 g of H2SO4"),
        ("acid_water", "50 g of water", "10 g of H2SO4"),
        ("acetic", "50 g of acetone", "20 g of acetic_acid"),
        ("buffer", "50 g of water + 1 g of acetic_acid", "20 g of water + 0.4 g of NaOH"),
        ("nitrate", "50 g of water + 1 g of KNO3", "20 g of water + 1 g of HCl"),
        ("solvents", "50 g of toluene", "20 g of EtOAc"),
        ("thin_permanganate", "50 g of water + 1 g of H2SO4", "20 g of water + 0.05 g of KMnO4"),
    ] {
        assert_eq!(poured(name, target, source), [], "{name}");
    }
    let silver = poured("silver", "50 g of water + 1 g of NaCl", "20 g of water + 0.5 g of AgNO3");
    assert_eq!(silver, [("undissolved".to_string(), "warning".to_string())]);
}

#[test]
fn a_species_of_ones_own_is_known_by_its_structure_or_formula() {
    let pour = "pour 5 g from b into waste by arm using scale { tolerance: 1 g }";
    let text = bench(&holding("50 g of pentanone"), &holding("20 g of aqua_fortis"), "", pour);
    let own = "species pentanone { smiles: \"CCC(=O)CC\", density: 0.81 g/mL, heat_capacity: 190 J/(mol*K) }
species nitric { formula: \"HNO3\", density: 1.5 g/mL, heat_capacity: 110 J/(mol*K) }
solution aqua_fortis { nitric: 50 %w/w, water: rest }
";
    let found = findings("own", &text.replace("lab bench", &format!("{own}\nlab bench")));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].3, "`nitric` and `pentanone` come together in `waste`: fire and heat");
}

#[test]
fn the_way_through_other_vessels_is_followed() {
    let steps = "pour 5 g from b into waste by arm using scale { tolerance: 1 g }
    pour 5 g from c into waste by arm using scale { tolerance: 1 g }";
    let text = bench("", &holding("20 g of acetone"), &holding("20 g of HNO3"), steps);
    let found = findings("waste", &text);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].1.as_str(), found[0].2), ("incompatible-mix", "error", 19));
}

#[test]
fn what_meets_on_one_way_only_is_a_warning() {
    let steps = "let m <- read scale
    if m > 90 g { pour 5 g from b into waste by arm using scale { tolerance: 1 g } }
    pour 5 g from c into waste by arm using scale { tolerance: 1 g }";
    let text = bench("", &holding("20 g of acetone"), &holding("20 g of HNO3"), steps);
    let found = findings("way", &text);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].1.as_str(), found[0].2), ("incompatible-mix", "warning", 20));
}

#[test]
fn a_branch_that_fails_brings_nothing_further() {
    let steps = "let m <- read scale
    if m > 90 g {
        pour 5 g from b into waste by arm using scale { tolerance: 1 g }
        fail heavy
    }
    pour 5 g from c into waste by arm using scale { tolerance: 1 g }";
    let text = bench("", &holding("20 g of acetone"), &holding("20 g of HNO3"), steps);
    assert_eq!(findings("failing", &text), []);
}

#[test]
fn a_loop_brings_together_what_its_turns_leave() {
    let steps = "repeat 2 times {
        pour 5 g from b into waste by arm using scale { tolerance: 1 g }
        pour 5 g from waste into c by arm using scale { tolerance: 1 g }
    }";
    let text = bench("", &holding("20 g of acetone"), &holding("20 g of HNO3"), steps);
    let found = findings("loop", &text);
    assert!(found.iter().any(|f| f.0 == "incompatible-mix"), "{found:?}");
}

#[test]
fn a_reaction_of_the_file_or_an_allowance_says_that_it_is_meant() {
    let pour = "pour 5 g from b into waste by arm using scale { tolerance: 1 g }";
    let text = bench(&holding("50 g of acetone"), &holding("20 g of HNO3"), "", pour);
    let allow = |line: &str| findings("allow", &text.replace("lab bench", &format!("{line}\n\nlab bench")));
    assert_eq!(allow("allow incompatible acetone with HNO3 \"a known quench\""), []);
    assert_eq!(allow("allow incompatible oxidising_acid with ketone \"a known quench\""), []);
    assert_eq!(allow("allow incompatible acetone with HCl \"another\"").len(), 1);
    let reaction = "species product { formula: \"C3H7NO4\", density: 1 g/mL, heat_capacity: 200 J/(mol*K) }
reaction addition: acetone + HNO3 -> product { rate: 1e-6 kg/(mol*s), order: { acetone: 1, HNO3: 1 } }";
    assert_eq!(allow(reaction), []);
}

#[test]
fn a_line_carries_what_it_carried() {
    let pump = "mtx 1
use std::glassware::Beaker250mL
capability Pump: Body {
    param source: Container
    param sink: Container
    state running: Bool = false
    state rate: VolumeFlow = 0 mL/s
    command pump at(q: VolumeFlow) effect running = true, rate = q
    process pumping while running { move(rate, from: source, to: sink) }
}
asset Peristaltic: Pump { mass: 2 kg }
lab bench {
    ambient: 25 degC
    a = Beaker250mL at (0, 0, 0) m holding 100 mL of acetone
    line = Beaker250mL at (200, 0, 0) mm
    d = Beaker250mL at (300, 0, 0) mm holding 50 g of HNO3
    pump1 = Peristaltic { source: a, sink: line } at (100, 0, 0) mm
    pump2 = Peristaltic { source: d, sink: line } at (150, 0, 0) mm
}
workflow fill in bench {
    pump pump1 at 1 mL/s
    wait 1 s
    pump pump2 at 1 mL/s
    wait 1 s
}
";
    let found = findings("pump", pump);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].2), ("incompatible-mix", 23));
    assert_eq!(findings("pump_clean", &pump.replace("50 g of HNO3", "50 g of toluene")), []);
}

#[test]
fn walls_are_looked_at() {
    let cup = "mtx 1

use std::glassware::Beaker50mL

lab bench {
    ambient: 22 degC
    cup = Beaker50mL { material: polystyrene } at (0, 0, 0) m holding 20 g of toluene
}

workflow rest in bench { wait 1 min }
";
    let found = findings("wall", cup);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].1.as_str(), found[0].2), ("material-attacked", "error", 7));
    assert_eq!(findings("wall_solid", &cup.replace("20 g of toluene", "5 g of aspirin")), []);
    assert_eq!(findings("wall_glass", &cup.replace("polystyrene", "borosilicate")), []);
    assert_eq!(findings("wall_water", &cup.replace("20 g of toluene", "20 g of water + 1 g of EtOAc")), []);
    assert_eq!(findings("wall_unknown", &cup.replace("polystyrene", "wood"))[0].0, "unknown-name");
    assert_eq!(findings("wall_kind", &cup.replace("polystyrene", "water"))[0].0, "type-mismatch");
    let allowed =
        cup.replace("lab bench", "allow incompatible polystyrene with toluene \"a minute only\"\n\nlab bench");
    assert_eq!(findings("wall_allowed", &allowed), []);
}

#[test]
fn what_a_vessel_holds_is_looked_at_without_a_workflow() {
    let lab = "mtx 1
use std::glassware::Beaker50mL
lab bench {
    ambient: 22 degC
    cup = Beaker50mL at (0, 0, 0) m holding 20 g of acetone + 5 g of HNO3
}
";
    let found = findings("lab", lab);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].2), ("incompatible-mix", 5));
    assert_eq!(findings("lab_clean", &lab.replace("HNO3", "EtOAc")), []);
}

#[test]
fn wells_and_tips_are_looked_at() {
    let deck = "mtx 1
use std::opentrons::{OT2, P300Single, TipRack300, Corning96, Reservoir12}
lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 5 mL of water + 3 g of HNO3, A2: 5 mL of water, A3: 5 mL of EtOH }
    plate = Corning96 on ot2.slot[2]
}
workflow fill in deck {
    transfer 100 uL from stock[A1] to plate[A1 .. C1] by ot2.left using tips { tips: each }
    transfer 100 uL from stock[A2] to plate[A1 .. C1] by ot2.left using tips { tips: each }
    transfer 50 uL from stock[A3] to plate[B1] by ot2.left using tips { tips: each }
}
";
    let mut found = findings("wells", &deck.replace("3 g of HNO3", "9 g of HNO3"));
    // That acid of 64 % is measured out by volume is another matter.
    found.retain(|f| f.0 != "volume-of-strong-solution");
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].2), ("incompatible-mix", 13));
    assert_eq!(findings("wells_clean", &deck.replace("plate[B1]", "plate[B2]")), []);
    let acetone = findings("wells_plastic", &deck.replace("EtOH", "acetone").replace("plate[B1]", "plate[B2]"));
    assert_eq!(acetone.len(), 1, "{acetone:?}");
    assert_eq!((acetone[0].0.as_str(), acetone[0].2), ("material-attacked", 13));
}

#[test]
fn set_points_above_boiling_and_flash_points_are_cautioned() {
    let plate = |what: &str, steps: &str| bench(&holding(what), "", "", &format!("{steps}\n    stop heating scale"));
    let of = |name: &str, what: &str, steps: &str| -> Vec<(String, u64)> {
        findings(name, &plate(what, steps)).into_iter().map(|f| (f.0, f.2)).collect()
    };
    let boils = |line| vec![("above-boiling-point".to_string(), line)];
    assert_eq!(of("boil", "50 g of acetone", "heat scale to 80 degC"), boils(18));
    assert_eq!(of("warm", "50 g of acetone", "heat scale to 50 degC"), []);
    assert_eq!(of("thin", "50 g of water + 0.5 g of EtOH", "heat scale to 95 degC"), []);
    assert_eq!(of("flash", "50 g of DMF", "heat scale to 90 degC"), [("above-flash-point".to_string(), 18)]);
    assert_eq!(of("off", "50 g of acetone", "heat scale to 50 degC\n    stop heating scale"), []);
    assert_eq!(of("half", "50 g of hexane + 50 g of EtOAc", "heat scale to 110 degC"), boils(18));
    // The vessel may come after the set point.
    let later = plate("50 g of acetone", "heat scale to 80 degC\n    place waste on scale by arm");
    let later = later.replace("waste = Beaker250mL on scale", "waste = Beaker250mL on table at (450, 450) mm");
    let found: Vec<_> = findings("later", &later).into_iter().map(|f| (f.0, f.2)).collect();
    assert_eq!(found, boils(19));
}

#[test]
fn a_hazard_of_ones_own_is_an_error_with_its_name() {
    let own = "hazard too_hot(h: IkaRetControl) when h.active and h.target > 60 degC \"stay below\"\n\nlab bench";
    let text =
        |t: &str| bench("", "", "", &format!("heat scale to {t}\n    stop heating scale")).replace("lab bench", own);
    let found = findings("hazard", &text("70 degC"));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].0.as_str(), found[0].3.as_str()), ("hazard", "too hot: `scale`"));
    assert_eq!(findings("hazard_clean", &text("50 degC")), []);
}

#[test]
fn what_is_declared_wrongly_is_said_where_it_stands() {
    let wrong = |name: &str, line: &str| -> Vec<String> {
        findings(name, &format!("mtx 1\n{line}\n")).into_iter().map(|f| f.0).collect()
    };
    let of = |code: &str| vec![code.to_string()];
    assert_eq!(wrong("smarts", "reactive_group g { smarts: [\"[C\"], source: \"s\" }"), of("formula-invalid"));
    assert_eq!(wrong("nobody", "reactive_group g { source: \"s\" }"), of("missing-field"));
    assert_eq!(wrong("members", "reactive_group g { members: { Xy: any }, source: \"s\" }"), of("unknown-name"));
    assert_eq!(wrong("list", "reactive_group g { members: [water], source: \"s\" }"), of("type-mismatch"));
    assert_eq!(wrong("least", "reactive_group g { members: { water: 3 K }, source: \"s\" }"), of("type-mismatch"));
    assert_eq!(
        wrong("field", "reactive_group g { members: { water: any }, smart: 1, source: \"s\" }"),
        of("unknown-field")
    );
    assert_eq!(
        wrong("party", "incompatible keton with water { consequence: heat, source: \"s\" }"),
        of("unknown-name")
    );
    assert_eq!(
        wrong("what", "incompatible ketone with water { consequence: [boom], source: \"s\" }"),
        of("unknown-name")
    );
    assert_eq!(wrong("source", "incompatible ketone with water { consequence: heat }"), of("missing-field"));
    assert_eq!(wrong("consequence", "incompatible ketone with water { source: \"s\" }"), of("missing-field"));
    assert_eq!(
        wrong("text", "incompatible ketone with water { consequence: \"heat\", source: \"s\" }"),
        of("type-mismatch")
    );
    assert_eq!(wrong("allowed", "allow incompatible ketone with wter \"x\""), of("unknown-name"));
    assert_eq!(wrong("stated", "species g { by: mass, reactive_groups: [keton] }"), of("unknown-name"));
    assert_eq!(wrong("when", "hazard h(p: Heater) when p.targt > 3 degC"), of("unknown-member"));
    assert_eq!(wrong("twice", "material glass {}\nmaterial glass {}"), of("duplicate-name"));
}

/// A bench whose vessels hold what `use` lines bring.
fn poured_with(name: &str, uses: &str, target: &str, source: &str) -> Vec<(String, String, String)> {
    let pour = "pour 5 g from b into waste by arm using scale { tolerance: 1 g }";
    let text = bench(&holding(target), &holding(source), "", pour).replace("mtx 1\n", &format!("mtx 1\n{uses}\n"));
    findings(name, &text).into_iter().map(|f| (f.0, f.1, f.3)).collect()
}

/// Whether the screen says this of what is poured together, and nothing graver.
fn comes_of(name: &str, uses: &str, target: &str, source: &str) -> Option<String> {
    let found = poured_with(name, uses, target, source);
    let mut mixes = found.into_iter().filter(|f| f.0 == "incompatible-mix" || f.1 == "error");
    let first = mixes.next();
    assert_eq!(mixes.next(), None, "{name}: one mistake, one message");
    first.map(|f| f.2.rsplit(": ").next().unwrap_or_default().to_string())
}

const TABLES: &str = "use std::substances\nuse std::equilibria";

#[test]
fn metals_hydrides_and_halides_are_screened() {
    let (acid, base, water) = ("50 g of water + 5 g of HCl", "50 g of water + 5 g of NaOH", "50 g of water");
    let hydrogen = "flammable gas and heat";
    let oxides = "toxic gas and heat";
    let violent = "toxic gas, a violent reaction and heat";
    let burns = "fire, flammable gas and heat";
    for (target, source, expected) in [
        (acid, "10 g of Zn", Some(hydrogen)),
        (acid, "10 g of Mg", Some(hydrogen)),
        (acid, "10 g of Fe", Some(hydrogen)),
        (acid, "10 g of Al", Some(hydrogen)),
        (base, "10 g of Al", Some(hydrogen)),
        (base, "10 g of Zn", Some(hydrogen)),
        ("50 g of water + 5 g of acetic_acid", "10 g of Mg", Some("flammable gas")),
        ("50 g of water + 5 g of HNO3", "10 g of Cu", Some(oxides)),
        ("50 g of water + 20 g of HNO3", "10 g of Ag", Some(oxides)),
        (water, "10 g of PCl5", Some(violent)),
        (water, "10 g of TiCl4", Some(violent)),
        (water, "10 g of TMSCl", Some(violent)),
        (water, "10 g of P4O10", Some("a violent reaction and heat")),
        (water, "10 g of LiAlH4", Some(burns)),
        (water, "10 g of CaH2", Some(burns)),
        (water, "10 g of CaC2", Some(burns)),
        (water, "10 g of AlMe3", Some(burns)),
        // Their twins.
        (acid, "10 g of Cu", None),
        (acid, "10 g of Ag", None),
        (acid, "20 g of water + 10 mmol of Zn2+ + 20 mmol of Cl-", None),
        (acid, "20 g of water + 10 mmol of Mg2+ + 20 mmol of Cl-", None),
        (base, "10 g of Fe", None),
        (base, "10 g of Cu", None),
        (water, "10 g of Fe", None),
        (water, "10 g of Zn", None),
        (water, "10 g of Al", None),
        ("50 g of water + 1 mg of HCl", "10 g of Fe", None),
        ("50 g of water + 5 g of HNO3", "20 g of water + 1 g of CuSO4", None),
        ("50 g of water + 20 g of HNO3", "10 g of Au", None),
        ("50 g of toluene", "10 g of TMSCl", None),
    ] {
        let found = comes_of("metals", TABLES, target, source);
        assert_eq!(found.as_deref(), expected, "{source} into {target}");
    }
}

#[test]
fn oxidisers_nitrites_and_ammonium_are_screened() {
    let bleach = "50 g of water + 3 g of NaOCl";
    let permanganate = "20 g of water + 0.5 g of KMnO4";
    let chlorine = Some("`waste` holds permanganate, chloride and a strong acid");
    for (target, source, expected) in [
        (bleach, "20 g of water + 2 g of NH4Cl", Some("toxic gas")),
        (bleach, "20 g of water + 20 mmol of NH4+ + 20 mmol of Cl-", Some("toxic gas")),
        (bleach, "20 g of water + 20 mmol of HSO4- + 20 mmol of Na+", Some("toxic gas")),
        ("50 g of water + 20 g of HCl", permanganate, Some("toxic gas")),
        ("50 g of H2SO4", "10 g of KMnO4", Some("an explosion, fire and heat")),
        ("50 g of water + 20 g of H2O2", permanganate, Some("a violent reaction, heat and gas")),
        ("50 g of water + 20 g of H2O2", "10 g of MnO2", Some("a violent reaction, heat and gas")),
        ("50 g of water + 20 g of sodium_nitrite", "10 g of water + 3 g of NH4Cl", Some("heat and gas")),
        ("50 g of water + 10 g of sodium_nitrite", "10 g of water + 1 g of HCl", Some("toxic gas")),
        // Their twins.
        (bleach, "20 g of water + 1 g of NaCl", None),
        ("50 g of water + 2 g of NaCl", "20 g of water + 2 g of NH4Cl", None),
        ("50 g of water + 2 g of NaCl", permanganate, None),
        ("50 g of water", permanganate, None),
        ("50 g of water", "10 g of water + 3 g of H2O2", None),
        ("50 g of water + 1 g of H2O2", "20 g of water + 0.05 g of KMnO4", None),
        ("50 g of water + 1 g of sodium_nitrite", "10 g of water + 0.1 g of NH4Cl", None),
        // Nitrates are no nitrites.
        ("50 g of water + 15 g of KNO3", "20 g of water + 4 g of NH4Cl", None),
    ] {
        let found = comes_of("oxidisers", TABLES, target, source);
        assert_eq!(found.as_deref(), expected, "{source} into {target}");
    }
    // The screen knows pairs; chlorine takes three.
    let three = |target: &str| poured_with("chlorine", TABLES, target, "20 g of water + 0.9 g of KMnO4");
    let says = |found: &[(String, String, String)]| {
        found.iter().any(|f| f.1 == "error" && chlorine.is_some_and(|words| f.2.starts_with(words)))
    };
    let chloride = three("20 g of water + 10 g of H2SO4 + 5 g of NaCl");
    assert!(says(&chloride), "{chloride:?}");
    let sulfate = three("20 g of water + 10 g of H2SO4");
    assert!(!sulfate.iter().any(|f| f.1 == "error"), "{sulfate:?}");
}

#[test]
fn chloroform_and_acetone_are_told_with_a_base() {
    let found = poured_with("chloroform", "", "30 g of acetone + 2 g of water + 2 g of KOH", "30 g of CHCl3");
    assert!(found.iter().any(|f| f.1 == "error" && f.2.contains("chloroform, acetone and a strong base")), "{found:?}");
    assert_eq!(poured_with("no_base", "", "30 g of acetone", "30 g of CHCl3"), []);
}

#[test]
fn weak_acids_free_hydrogen_cyanide() {
    let cyanide = "50 g of water + 5 mmol of NaCN";
    let acids = [
        "20 mmol of H2PO4- + 20 mmol of Na+",
        "20 mmol of NH4Cl",
        "20 mmol of NaHCO3",
        "20 mmol of Fe3+ + 60 mmol of Cl-",
    ];
    for (uses, acid) in ["", "use std::equilibria"].iter().flat_map(|uses| acids.iter().map(move |acid| (uses, acid))) {
        let found = poured_with("cyanide_acids", uses, cyanide, &format!("20 g of water + {acid}"));
        let errors: Vec<_> = found.iter().filter(|f| f.1 == "error").collect();
        assert_eq!(errors.len(), 1, "{uses} {acid}: {found:?}");
        assert_eq!(
            (errors[0].0.as_str(), errors[0].2.ends_with("toxic gas and flammable gas")),
            ("incompatible-mix", true)
        );
    }
    let told = |name: &str, into: &str| {
        let found = poured_with(name, "use std::equilibria", cyanide, &format!("20 g of water + {into}"));
        found.into_iter().filter(|f| f.1 == "error").map(|f| (f.0, f.2)).collect::<Vec<_>>()
    };
    // An acid that the screen has no group for, by what the equilibria make of it.
    let tris = told("cyanide_tris", "30 mmol of tris_HCl");
    assert_eq!(tris.len(), 1, "{tris:?}");
    assert!(tris[0].0 == "hazard" && tris[0].1.contains("of HCN, a gas that is fatal if inhaled"), "{tris:?}");
    assert_eq!(told("cyanide_lye", "1 g of NaOH"), []);
    assert_eq!(told("cyanide_salt", "20 mmol of NaCl"), []);
}
