//! Volumes, heat capacities and heats of solutions against tables of what is measured, and what must hold of any mixture.

use std::fmt::Write as _;

use serde_json::Value;

use crate::harness::{Ended, flat, folder, matterixc, matterixc_in, write};

/// Mass fraction of a solute in water with g/mL and J/(g*K) at 25 degC: the equations of Laliberte, J. Chem. Eng. Data 54 (2009) 1725;
/// H2SO4 of 98 %, ethanol and methanol Perry's Chemical Engineers' Handbook, and so the heat capacities of HCl and HNO3 (20 degC); those of
/// ethanol are within 0.0002 of OIML R 22. 0 where none is compared.
#[allow(clippy::approx_constant, reason = "a heat capacity of 3.14 J/(g*K) was measured")]
const MEASURED: [(&str, f64, f64, f64); 40] = [
    ("NaOH", 10.0, 1.1071, 3.79),
    ("NaOH", 30.0, 1.3242, 3.54),
    ("NaOH", 50.0, 1.5163, 3.26),
    ("H2SO4", 10.0, 1.065, 3.86),
    ("H2SO4", 50.0, 1.3925, 2.52),
    ("H2SO4", 78.0, 1.7013, 1.87),
    ("H2SO4", 98.0, 1.831, 0.0),
    ("HCl", 10.0, 1.0457, 0.0),
    ("HCl", 20.0, 1.0953, 0.0),
    ("HCl", 37.0, 1.1806, 2.45),
    ("NaCl", 5.0, 1.0324, 3.94),
    ("NaCl", 15.0, 1.1067, 3.56),
    ("NaCl", 25.0, 1.1856, 3.29),
    ("KOH", 20.0, 1.1851, 3.27),
    ("KOH", 45.0, 1.451, 2.63),
    ("HNO3", 30.0, 1.1767, 3.05),
    ("HNO3", 68.0, 1.3956, 2.59),
    ("KCl", 10.0, 1.0616, 3.67),
    ("KCl", 24.0, 1.1598, 3.08),
    ("CaCl2", 20.0, 1.1758, 3.14),
    ("CaCl2", 40.0, 1.3898, 2.54),
    ("NH4Cl", 10.0, 1.0263, 3.74),
    ("NH4Cl", 25.0, 1.0688, 0.0),
    ("Na2CO3", 10.0, 1.1017, 3.79),
    ("Na2CO3", 20.0, 1.2135, 3.60),
    ("NH3", 10.0, 0.9571, 4.08),
    ("NH3", 28.0, 0.8934, 4.18),
    ("H3PO4", 30.0, 1.1796, 3.26),
    ("H3PO4", 85.0, 1.6849, 1.84),
    ("acetic_acid", 30.0, 1.034, 0.0),
    ("acetic_acid", 70.0, 1.0647, 0.0),
    ("KNO3", 20.0, 1.1302, 3.44),
    ("EtOH", 10.0, 0.98043, 0.0),
    ("EtOH", 30.0, 0.95067, 0.0),
    ("EtOH", 50.0, 0.90985, 0.0),
    ("EtOH", 70.0, 0.8634, 0.0),
    ("EtOH", 90.0, 0.81362, 0.0),
    ("MeOH", 40.0, 0.93161, 0.0),
    ("MeOH", 80.0, 0.8432, 0.0),
    ("HCl", 5.0, 1.0212, 0.0),
];

/// How far off density and heat capacity may be, as shares; the density of ethanol.
const DENSITY: f64 = 0.01;
const CAPACITY: f64 = 0.04;
const ETHANOL: f64 = 0.005;

/// Salts that the library lacks and the tables have.
const MORE: &str = "species CaCl2 { formula: \"CaCl2\", density: 2.15 g/mL, heat_capacity: 72.9 J/(mol*K), dissolves: Ca2+ + 2 Cl-, heat_of_solution: -81.3 kJ/mol }
species NH4NO3 { formula: \"NH4NO3\", density: 1.72 g/mL, heat_capacity: 139.3 J/(mol*K), dissolves: NH4+ + NO3-, heat_of_solution: 25.7 kJ/mol }
";

/// Weighing and drawing without a device.
const BY_HAND: &str = "extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 ms
    effect move(m, from: source, to: target)
extern skill draw(v: Volume) from(source: Vessel) into(target: Vessel)
    takes 1 ms
    effect move(v, from: source, to: target)
";

fn run(name: &str, text: &str) -> Ended {
    let dir = folder(name);
    write(&dir, "lab.mtx", text);
    matterixc(&["run", dir.join("lab.mtx").to_str().expect("the path is text"), "--format", "json"])
}

/// The value that each expectation measured, in the order of the text.
fn measured(ran: &Ended) -> Vec<f64> {
    let report: Value = serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {}{}", ran.out, ran.err));
    let all = report["expectations"].as_array().expect("expectations");
    all.iter().map(|e| e["measured"][0]["value"].as_f64().expect("a value")).collect()
}

#[test]
fn stocks_have_the_density_and_heat_capacity_that_are_measured() {
    let (mut vessels, mut looks) = (String::new(), String::new());
    for (i, (what, percent, ..)) in MEASURED.iter().enumerate() {
        let _ = writeln!(
            vessels,
            "    c{i} = Beaker250mL at ({i}, 0, 0) m holding {percent} g of {what} + {} g of water",
            100.0 - percent
        );
        let _ = writeln!(looks, "    expect c{i}.contents.volume > 0 mL\n    expect c{i}.contents.capacity > 0 J/K");
    }
    let text = format!(
        "mtx 1\nuse std::glassware::Beaker250mL\n{MORE}lab bench {{\n    ambient: 25 degC\n{vessels}}}\nworkflow look in bench {{\n    wait 1 s\n{looks}}}\n"
    );
    let found = measured(&run("measured_solutions", &text));
    for ((what, percent, density, capacity), of) in MEASURED.iter().zip(found.chunks(2)) {
        let [volume, heat] = of else { panic!("two of each") };
        let off = 100.0 / (volume * density) - 1.0;
        let bar = if *what == "EtOH" { ETHANOL } else { DENSITY };
        assert!(off.abs() <= bar, "{what} of {percent} %: density off by {off:.4}");
        let off = heat / 100.0 / capacity - 1.0;
        assert!(*capacity == 0.0 || off.abs() <= CAPACITY, "{what} of {percent} %: heat capacity off by {off:.4}");
    }
}

/// A lab with these vessels, and a workflow.
fn lab(head: &str, vessels: &[String], steps: &str) -> String {
    let vessels = vessels.iter().enumerate().fold(String::new(), |mut all, (i, vessel)| {
        let _ = writeln!(all, "    c{i} = Beaker1000mL at ({i}, 0, 0) m holding {vessel}");
        all
    });
    format!(
        "mtx 1\n{head}use std::glassware::Beaker1000mL\n{MORE}{BY_HAND}lab bench {{\n    ambient: 25 degC\n{vessels}}}\nworkflow look in bench {{\n{steps}}}\n"
    )
}

/// Numbers that look random, from 0 to 1, always the same.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[(self.next() * all.len() as f64) as usize]
    }
}

const SOLUTES: [&str; 12] =
    ["NaOH", "HCl", "H2SO4", "HNO3", "NaCl", "KCl", "CaCl2", "NH4NO3", "KOH", "Na2CO3", "NH4Cl", "H3PO4"];

#[test]
fn half_of_a_solution_has_half_of_all_and_a_transfer_by_volume_moves_its_share() {
    let mut draw = Draw(24);
    let (mut vessels, mut steps) = (Vec::new(), String::new());
    for what in SOLUTES {
        let mass = 5.0 + 40.0 * draw.next();
        vessels.push(format!("{mass} g of {what} + 100 g of water at 60 degC"));
        vessels.push(format!("{} g of {what} + 50 g of water at 60 degC", mass / 2.0));
        vessels.push("0 g of water".to_owned());
    }
    let at = |case: usize, which: usize| format!("c{}.contents", 3 * case + which);
    for case in 0..12 {
        for member in ["volume", "capacity", "mass"] {
            let _ = writeln!(
                steps,
                "    expect {0}.{member} / {1}.{member} in 1.999999 .. 2.000001",
                at(case, 0),
                at(case, 1)
            );
        }
    }
    for case in 0..12 {
        let _ = writeln!(steps, "    draw 20 mL from c{} into c{}", 3 * case, 3 * case + 2);
        let _ = writeln!(steps, "    expect {}.volume in 19.9999999 mL .. 20.0000001 mL", at(case, 2));
        let (drawn, whole) = (at(case, 2), at(case, 1));
        let _ = writeln!(
            steps,
            "    expect {drawn}.mass / {drawn}.volume / ({whole}.mass / {whole}.volume) in 0.999999999 .. 1.000000001"
        );
    }
    let ran = run("halves", &lab("", &vessels, &steps));
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert_eq!(measured(&ran).len(), 60);
}

#[test]
fn heat_does_not_depend_on_the_order_in_which_solutions_come_together() {
    let mut draw = Draw(7);
    for head in ["", "use std::equilibria\n"] {
        let (mut vessels, mut steps, mut looks) = (Vec::new(), String::new(), String::new());
        for case in 0..8 {
            let (a, b) = (draw.of(&SOLUTES), draw.of(&SOLUTES));
            let (m, n, warm) = (1.0 + 20.0 * draw.next(), 1.0 + 20.0 * draw.next(), 25.0 + 30.0 * draw.next());
            for _ in 0..2 {
                vessels.push(format!("{m} g of {a} + 30 g of water at {warm} degC"));
                vessels.push(format!("{n} g of {b}"));
                vessels.push("80 g of water".to_owned());
            }
            let i = 6 * case;
            // The solid into the water, and the first solution to both; or the solution diluted, and then the solid.
            let _ = writeln!(steps, "    weigh_out {n} g from c{} into c{}", i + 1, i + 2);
            let _ = writeln!(steps, "    weigh_out c{}.contents.mass from c{} into c{}", i, i, i + 2);
            let _ = writeln!(steps, "    weigh_out 80 g from c{} into c{}", i + 5, i + 3);
            let _ = writeln!(steps, "    weigh_out {n} g from c{} into c{}", i + 4, i + 3);
            let _ = writeln!(
                looks,
                "    expect abs(c{}.contents.temperature - c{}.contents.temperature) < 20 mK",
                i + 2,
                i + 3
            );
        }
        let ran = run("hess", &lab(head, &vessels, &format!("{steps}{looks}")));
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    }
}

/// Stocks of the laboratory.
const STOCKS: &str = "solution oil_of_vitriol { H2SO4: 98 %w/w, water: rest }
solution conc_hcl { HCl: 37 %w/w, water: rest }
solution conc_hno3 { HNO3: 68 %w/w, water: rest }
";

/// Grams of what come into so many grams of water at 25 degC, with the temperature, degC, that follows from published integral heats of
/// solution and measured heat capacities: 25 + heat / (mass * heat capacity).
///
/// - NaOH: -44.5 kJ/mol (CRC Handbook) with the course of Felder and Rousseau, Elementary Principles of Chemical Processes, table B.11, 0.4 and
///   4.3 kJ/mol less; 3.82 and 3.53 J/(g*K).
/// - H2SO4 of 98 %: the same table, from -3.9 kJ/mol to -71.5, -66.7 and -59.4 kJ/mol; 3.87, 3.46 and 2.54 J/(g*K).
/// - HCl of 37 %: CRC Handbook, enthalpy of dilution of acids, from 16.4 to 6.5 kJ/mol that are left; 2.95 J/(g*K).
/// - HNO3 of 68 %: the same table, from 14.8 to 2.9 kJ/mol; 3.02 J/(g*K).
/// - NH4Cl, KNO3: 14.8 and 33 kJ/mol (CRC Handbook; KNO3 less its heat of dilution); 3.77 and 3.56 J/(g*K).
const PEAKS: [(f64, &str, f64, f64); 8] = [
    (10.0, "NaOH", 100.0, 51.2),
    (40.0, "NaOH", 100.0, 106.4),
    (10.0, "oil_of_vitriol", 100.0, 40.9),
    (50.0, "oil_of_vitriol", 50.0, 134.2),
    (100.0, "conc_hcl", 100.0, 42.1),
    (100.0, "conc_hno3", 100.0, 46.3),
    (10.0, "NH4Cl", 100.0, 18.3),
    (20.0, "KNO3", 100.0, 9.7),
];

/// How far off a peak may be, K.
const PEAK: f64 = 3.0;

#[test]
fn dissolving_and_diluting_warm_as_the_literature_says() {
    let (mut vessels, mut steps) = (Vec::new(), String::new());
    for (i, (mass, what, water, _)) in PEAKS.iter().enumerate() {
        vessels.push(format!("{mass} g of {what}"));
        vessels.push(format!("{water} g of water"));
        let (from, to) = (2 * i, 2 * i + 1);
        let _ = writeln!(
            steps,
            "    weigh_out {mass} g from c{from} into c{to}\n    wait 1 ms\n    expect c{to}.contents.temperature > 0 degC"
        );
    }
    for head in ["", "use std::equilibria\n"] {
        let ran = run("peaks", &lab(&format!("{head}{STOCKS}"), &vessels, &steps));
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
        for ((mass, what, water, wanted), found) in PEAKS.iter().zip(measured(&ran)) {
            assert!(
                (found - wanted).abs() <= PEAK,
                "{head}{mass} g of {what} in {water} g of water: {found:.1} degC, not {wanted}"
            );
        }
    }
}

#[test]
fn neutralisation_gives_off_its_heat_once() {
    let acid = "solution acid { HCl: 0.1 mol/kg, water: rest }\nsolution base { NaOH: 0.1 mol/kg, water: rest }\n";
    let own = "reaction neutralisation: H+ + OH- -> H2O {
    rate: 1e8 L/(mol*s)
    order: { H+: 1, OH-: 1 }
    enthalpy: -55.8 kJ/mol
}
";
    let vessels = ["100 g of acid", "100 g of base"].map(str::to_owned);
    let steps = "    weigh_out 100 g from c0 into c1
    wait 100 ms
    expect (c1.contents.temperature - 25 degC) * c1.contents.capacity / 10 mmol in 55 kJ/mol .. 57 kJ/mol
";
    for (uses, reaction) in [("", own), ("use std::equilibria\n", "")] {
        let ran = run("neutralised", &lab(&format!("{uses}{acid}{reaction}"), &vessels, steps));
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    }
}

#[test]
fn pouring_water_into_strong_acid_is_told_from_pouring_acid_into_water() {
    let vessels = ["50 g of oil_of_vitriol", "100 g of water"].map(str::to_owned);
    let told = |from: &str, into: &str| {
        let dir = folder("acid_and_water");
        write(&dir, "lab.mtx", lab(STOCKS, &vessels, &format!("    weigh_out 4 g from {from} into {into}\n")));
        let ended = matterixc(&["check", dir.join("lab.mtx").to_str().expect("the path is text")]);
        format!("{}{}", ended.out, ended.err)
    };
    let found = told("c1", "c0");
    assert!(found.contains("water-into-acid"), "{found}");
    let found = told("c0", "c1");
    assert!(!found.contains("water-into-acid") && !found.contains("hot-mixing"), "{found}");
}

#[test]
fn the_heat_of_neutralising_is_foretold_as_the_run_has_it() {
    let stocks = "solution lye { NaOH: 10 mol/kg, water: rest }
solution acid { HCl: 5 mol/kg, water: rest }
solution ammonia_water { NH3: 10 mol/kg, water: rest }
";
    let cases = [
        ("50 g", "lye", "100 g of water + 0.5 mol of acetic_acid"),
        ("60 g", "lye", "100 g of water + 0.2 mol of H3PO4"),
        ("60 g", "lye", "100 g of water + 0.2 mol of citric_acid"),
        ("50 g", "lye", "100 g of acid"),
        ("50 g", "ammonia_water", "100 g of acid"),
        ("20 g", "NaOH", "100 g of water"),
        ("20 g", "NaOH", "100 g of acid"),
    ];
    let (mut vessels, mut steps) = (Vec::new(), String::new());
    for (i, (mass, what, into)) in cases.iter().enumerate() {
        vessels.extend([format!("{mass} of {what}"), (*into).to_owned()]);
        let (from, to) = (2 * i, 2 * i + 1);
        let _ = writeln!(
            steps,
            "    weigh_out {mass} from c{from} into c{to}\n    wait 1 ms\n    expect c{to}.contents.temperature > 0 degC"
        );
    }
    let ran = run("foretold", &lab(&format!("use std::equilibria\n{stocks}"), &vessels, &steps));
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let said = flat(&ran.err);
    for (i, found) in measured(&ran).into_iter().enumerate() {
        let cup = 2 * i + 1;
        let told = |words: &str, unit: &str| {
            let (_, after) = said.split_once(&format!("`c{cup}` would warm {words} about "))?;
            after.split_once(unit)?.0.parse::<f64>().ok()
        };
        // Where it boils the finding says how hot it would be.
        let boiling = || told("to", " degC and boil").map(|celsius| celsius - 25.0);
        let foretold = told("by", " K").or_else(boiling).expect("it is foretold");
        assert!((found - 25.0 - foretold).abs() <= 1.5, "{:?}: {foretold} K foretold, {found} degC", cases[i]);
    }
}

#[test]
fn findings_go_by_what_equilibria_make_of_it() {
    let found = |name: &str, head: &str, into: &str, steps: &str| {
        let dir = folder(name);
        let vessels = ["20 g of NaOH".to_owned(), into.to_owned()];
        write(&dir, "lab.mtx", lab(&format!("use std::equilibria\n{head}"), &vessels, steps));
        let ended = matterixc(&["check", dir.join("lab.mtx").to_str().expect("the path is text")]);
        flat(&format!("{}{}", ended.out, ended.err))
    };
    let reads = "    weigh_out 20 g from c0 into c1\n    expect acidity(c1.contents) > 4\n";
    let neutral = found("acetate", "", "100 g of water + 0.5 mol of acetic_acid", reads);
    assert!(!neutral.contains("another liquid"), "acetate is no liquid: {neutral}");
    let acid = found("vinegar", "", "60 g of water + 0.5 mol of acetic_acid", "    expect acidity(c1.contents) > 1\n");
    assert!(acid.contains("33 % of its mass is another liquid"), "{acid}");
    let own = "species my_chloride { formula: \"AgCl\", density: 5.56 g/mL, heat_capacity: 50.8 J/(mol*K) }
equilibrium comes_out: my_chloride <-> Ag+ + Cl- { ksp: 1.77e-10, enthalpy: 65.5 kJ/mol }
";
    let silver = found("own_silver", own, "100 g of water + 1 mmol of AgNO3 + 1 mmol of NaCl", "    wait 1 s\n");
    assert!(!silver.contains("holds more AgCl than dissolves"), "an equilibrium has it: {silver}");
}

#[test]
fn without_water_there_is_no_ph() {
    for uses in ["", "use std::equilibria\n"] {
        let dir = folder("no_ph");
        let vessels = ["10 g of ethanol".to_owned(), "10 g of water".to_owned()];
        let look = "    expect acidity(c1.contents) in 6.9 .. 7.1\n    expect acidity(c0.contents) in 6.9 .. 7.1\n";
        write(&dir, "lab.mtx", lab(uses, &vessels, look));
        let ended = matterixc(&["run", dir.join("lab.mtx").to_str().expect("the path is text"), "--no-cache"]);
        let said = flat(&format!("{}{}", ended.out, ended.err));
        assert!(ended.code == 1 && said.contains("logarithm of 0"), "{uses}: {said}");
    }
}

/// A cup of water into which portions of a salt go, with what is expected after each.
fn portions(salt: &str, water: &str, steps: &[(&str, &str)]) -> String {
    let steps: String = steps
        .iter()
        .map(|(mass, expected)| {
            format!("    weigh_out {mass} from pellets into cup\n    expect cup.contents.temperature in {expected}\n")
        })
        .collect();
    format!(
        "mtx 1
use std::glassware::Beaker250mL
extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 ms
    effect move(m, from: source, to: target)
lab bench {{
    ambient: 25 degC
    pellets = Beaker250mL at (1, 0, 0) m holding 150 g of {salt}
    cup = Beaker250mL at (2, 0, 0) m holding {water}
}}
workflow dissolve in bench {{
{steps}}}
"
    )
}

#[test]
fn beyond_saturation_a_salt_gives_the_heat_of_what_dissolves() {
    let dir = folder("saturated");
    let ran = |text: String| {
        write(&dir, "cup.mtx", text);
        let ran = matterixc_in(&dir, &["run", "cup.mtx", "--no-cache"]);
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
        flat(&format!("{}{}", ran.out, ran.err))
    };
    // 20 g of water take up 20 g of NaOH; the 80 g beside them only take heat up.
    let lye = [("20 g", "105 degC .. 115 degC"), ("80 g", "45 degC .. 60 degC")];
    let said = ran(portions("NaOH", "20 g of water", &lye));
    assert!(said.contains("heat-beyond-saturation"), "{said}");
    // With equilibria the same.
    ran(portions("NaOH", "20 g of water", &lye).replace("use std::glass", "use std::equilibria\nuse std::glass"));
    // 20 g of water dissolve 7 g of KCl: beyond that nothing gets colder.
    ran(portions("KCl", "20 g of water", &[("7 g", "5 degC .. 9 degC"), ("43 g", "7 degC .. 25 degC")]));
    // What stays solid dissolves once there is enough water, and then all is as warm as if it had been there from the start.
    let lab = "mtx 1
use std::glassware::Beaker250mL
extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 ms
    effect move(m, from: source, to: target)
lab bench {
    ambient: 25 degC
    pellets = Beaker250mL at (1, 0, 0) m holding 50 g of NaOH
    water = Beaker250mL at (2, 0, 0) m holding 200 g of water
    first = Beaker250mL at (3, 0, 0) m holding 10 g of water
    second = Beaker250mL at (4, 0, 0) m holding 110 g of water
}
workflow dissolve in bench {
    weigh_out 20 g from pellets into first
    weigh_out 20 g from pellets into second
    expect first.contents.temperature > 60 degC
    weigh_out 100 g from water into first
    expect first.contents.temperature - second.contents.temperature in -0.1 K .. 0.1 K
}\n";
    ran(lab.into());
}

#[test]
fn what_is_not_known_of_volumes_and_heats_is_told() {
    let dir = folder("not_known");
    let said = |text: String| {
        write(&dir, "cup.mtx", text);
        flat(&matterixc_in(&dir, &["check", "cup.mtx", "--no-cache"]).out)
    };
    let soda = portions("Na2CO3", "100 g of water", &[("20 g", "20 degC .. 40 degC")]);
    assert!(said(soda).contains("leaves out the heat of diluting CO3^2-"));
    let little = said(portions("Na2CO3", "100 g of water", &[("2 g", "20 degC .. 40 degC")]));
    assert!(little.contains("no findings"), "{little}");
    let acetone = "mtx 1
use std::glassware::Beaker250mL
lab bench { ambient: 25 degC, cup = Beaker250mL at (0, 0, 0) m holding 50 g of water + 40 g of acetone }
workflow look in bench { expect cup.contents.volume < 110 mL }\n";
    assert!(said(acetone.into()).contains("sum of those of water and acetone"));
    assert!(said(acetone.replace("acetone", "EtOH")).contains("no findings"));
}

/// What a check says of a cup that stands, with a note of what it is asked.
fn standing(dir: &std::path::Path, uses: &str, holding: &str, asked: &str) -> String {
    let text = format!(
        "mtx 1
{uses}
use std::glassware::Beaker250mL
extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 ms
    effect move(m, from: source, to: target)
lab bench {{
    ambient: 25 degC
    cup = Beaker250mL at (1, 0, 0) m holding {holding}
    water = Beaker250mL at (2, 0, 0) m holding 100 g of water
}}
workflow look in bench {{
    weigh_out 1 g from water into water
    {asked}
}}
"
    );
    write(dir, "cup.mtx", text);
    flat(&matterixc_in(dir, &["check", "cup.mtx", "--no-cache"]).out)
}

#[test]
fn what_is_not_known_to_dissolve_is_told() {
    let dir = folder("not_known_to_dissolve");
    let unknown = "in water is not in the library";
    let beyond = "than dissolves";
    let cases = [
        ("use std::substances::maltose", "100 g of water + 10 g of maltose", unknown),
        ("use std::substances::maltose", "100 g of water + 2 g of maltose", ""),
        // In another solvent the library never says what dissolves.
        ("use std::substances::maltose", "100 g of EtOH + 10 g of maltose", ""),
        ("use std::acids", "100 g of water + 10 g of sodium_benzoate", unknown),
        ("use std::salts", "100 g of water + 10 g of magnesium_nitrate_hexahydrate", ""),
        ("use std::salts", "50 g of water + 200 g of magnesium_nitrate_hexahydrate", beyond),
        ("use std::salts", "100 g of water + 10 g of calcium_chloride_dihydrate", ""),
        ("use std::substances::anthraquinone", "100 g of water + 1 g of anthraquinone", beyond),
        ("", "100 g of water + 1 g of I2", beyond),
        ("", "100 g of water + 1 g of I2 + 5 g of KI", ""),
        ("", "100 g of water + 20 g of H3PO4", ""),
    ];
    for (uses, holding, why) in cases {
        let said = standing(&dir, uses, holding, "expect cup.contents.mass > 0 g");
        let told = said.contains(unknown) || said.contains(beyond);
        assert!(told != why.is_empty() && said.contains(why), "{holding}: {said}");
    }
}

#[test]
fn solids_in_other_liquids_are_told() {
    let dir = folder("solids_in_other_liquids");
    let asked = "expect cup.contents.mass > 0 g";
    let mixed = standing(&dir, "use std::acids", "60 g of water + 40 g of EtOH + 5 g of benzoic_acid", asked);
    assert!(mixed.contains("follows constants in water, and"), "{mixed}");
    let water = standing(&dir, "use std::acids", "60 g of water + 5 g of benzoic_acid", asked);
    assert!(!water.contains("follows constants in water, and"), "{water}");
}

#[test]
fn heats_of_mixing_that_are_not_known_are_told() {
    let dir = folder("heats_of_mixing");
    let asked = "weigh_out 50 g from cup into water\n    expect water.contents.temperature > 20 degC";
    let mixing = "leaves out the heat of mixing";
    for (holding, why) in [
        ("60 g of EtOH", "leaves out the heat of mixing EtOH with water"),
        ("60 g of DMSO", "leaves out the heat of mixing DMSO with water"),
        ("60 g of toluene", ""),
        ("60 g of water", ""),
    ] {
        let said = standing(&dir, "", holding, asked);
        assert!(said.contains(why) && said.contains(mixing) != why.is_empty(), "{holding}: {said}");
    }
    // The enthalpies of formation have 16.6 kJ/mol for the liquid, and a mole of water takes half of that.
    let acid = standing(&dir, "", "51 g of H3PO4 + 9 g of water", asked);
    assert!(acid.contains("ignores the heat of dissolving H3PO4: about 6 K"), "{acid}");
}

#[test]
fn what_does_not_last_or_split_in_water_is_told() {
    let dir = folder("does_not_last");
    let asked = "expect acidity(cup.contents) < 15";
    let acid = standing(&dir, "", "100 g of water + 1 mmol of HI", asked);
    assert!(acid.contains("ignores the strong acid HI"), "{acid}");
    let split = standing(&dir, "use std::equilibria", "100 g of water + 1 mmol of HI", asked);
    assert!(!split.contains("ignores the strong acid HI"), "{split}");
    let reducer = standing(&dir, "", "100 g of water + 1 g of NaBH4", "expect cup.contents.mass > 0 g");
    assert!(reducer.contains("borohydride in water that is not strongly basic"), "{reducer}");
    let lye = standing(&dir, "", "100 g of water + 1 g of NaBH4 + 4 g of NaOH", "expect cup.contents.mass > 0 g");
    assert!(!lye.contains("borohydride in water"), "{lye}");
}

#[test]
fn conductivities_of_ions_that_pair_are_told() {
    let dir = folder("ions_pair");
    let uses = "use std::electrodes::conductivity";
    let asked = "expect conductivity(cup.contents) > 0 S/m";
    for (uses, holding, told) in [
        (uses.to_owned(), "100 g of water + 1 mmol of CuSO4", true),
        (format!("{uses}\nuse std::complexes"), "100 g of water + 1 mmol of CuSO4", false),
        (uses.to_owned(), "100 g of water + 10 umol of CuSO4", false),
        (uses.to_owned(), "100 g of water + 1 mmol of KCl", false),
    ] {
        let said = standing(&dir, &uses, holding, asked);
        assert!(said.contains("of two negative charges pair") == told, "{uses}, {holding}: {said}");
    }
}

/// What a lab declares is ready at its temperature, also where acid and base are declared together, however little water there is.
#[test]
fn acid_and_base_declared_together_have_the_temperature_declared() {
    let held = [
        "100 g of water + 10 mmol of NaOH + 9 mmol of HCl",
        "100 g of water + 500 mmol of NaOH + 450 mmol of HCl",
        "100 g of water + 450 mmol of HCl + 500 mmol of NaOH",
        "100 g of water + 100 mmol of H2SO4 + 190 mmol of NaOH",
        "100 g of water + 500 mmol of NaOH + 450 mmol of acetic_acid",
        "100 g of water + 1 mol of NaOH + 900 mmol of HCl",
        "70 g of water + 1 mol of NaOH + 900 mmol of acetic_acid",
        "100 g of water + 500 mmol of Na+ + 500 mmol of OH- + 450 mmol of H+ + 450 mmol of Cl-",
    ];
    let mut text = "mtx 1\nuse std::equilibria\nuse std::glassware::Beaker250mL\nasset Iso: Beaker250mL { contents: { air: 0 W/K }, wall: 0 W/K }\nlab bench {\n    ambient: 25 degC\n".to_string();
    for (i, holding) in held.iter().enumerate() {
        for (name, at) in [("warm", 25), ("cold", 10)] {
            text += &format!("    {name}{i} = Iso at ({i}, {at}, 0) m holding {holding} at {at} degC\n");
        }
    }
    text += "}\nworkflow look in bench {\n    wait 1 s\n";
    for i in 0..held.len() {
        text += &format!("    expect warm{i}.contents.temperature in 24.999 degC .. 25.001 degC\n");
        text += &format!("    expect cold{i}.contents.temperature in 9.999 degC .. 10.001 degC\n");
    }
    text += "}\n";
    let file = write(&folder("solutions_declared_together"), "a.mtx", &text);
    let ran = matterixc(&["run", &file]);
    let met = ran.out.matches("  ok  ").count();
    assert_eq!(met, 2 * held.len(), "{}{}", ran.out, ran.err);
}
