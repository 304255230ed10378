//! Findings on what solutions in water cannot hold: gas beyond its solubility, charges without a counterion, heat beyond boiling, a pH without water.

use std::path::Path;

use crate::harness::{flat, folder, matterixc_in, write};

/// What `check` says where one beaker is poured into another.
fn poured(name: &str, uses: &str, from: &str, into: &str, then: &str) -> String {
    let dir = folder(name);
    let text = format!(
        "mtx 1
{uses}use std::glassware::Beaker250mL
extern skill pour(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 s
    effect move(m, from: source, to: target)
lab bench {{
    ambient: 25 degC
    flask = Beaker250mL at (0, 0, 0) m holding {from}
    cup = Beaker250mL at (1, 0, 0) m holding {into}
}}
workflow go in bench {{
    pour 25 g from flask into cup
    wait 1 s
{then}
}}
"
    );
    checked(&dir, text)
}

/// What `check` says of a text.
fn checked(dir: &Path, text: impl AsRef<[u8]>) -> String {
    write(dir, "cup.mtx", text);
    flat(&matterixc_in(dir, &["check", "cup.mtx", "--no-cache"]).out)
}

/// What `run` says of a text whose workflow `go` passes.
fn passed(name: &str, text: impl AsRef<[u8]>) -> String {
    let dir = folder(name);
    write(&dir, "cup.mtx", text);
    let out = matterixc_in(&dir, &["run", "cup.mtx"]).out;
    assert!(out.contains("go in bench: passed"), "{out}");
    out
}

const EQUILIBRIA: &str = "use std::equilibria\n";

#[test]
fn weak_acids_and_solids_set_gas_free_as_well() {
    let soda = "50 g of water + 30 mmol of NaHCO3";
    // With equilibria by what is there at equilibrium, else by the acid that is there.
    for (uses, code) in [(EQUILIBRIA, "gas-leaves"), ("", "gas-stays")] {
        let vinegar = poured("vinegar", uses, "50 g of water + 40 mmol of acetic_acid", soda, "");
        assert!(vinegar.contains(code), "{vinegar}");
        let trace = poured("little_vinegar", uses, "50 g of water + 1 mmol of acetic_acid", soda, "");
        assert!(!trace.contains("gas"), "{trace}");
    }
    let acid = "50 g of water + 40 mmol of HCl";
    let solids = "use std::equilibria\nuse std::solids\nuse std::solids::FeS(s)\n";
    let chalk = poured("chalk", solids, acid, "50 g of water + 20 mmol of CaCO3", "");
    assert!(chalk.contains("`cup` gets more CO2 than stays dissolved"), "{chalk}");
    let sulfide = poured("iron_sulfide", solids, acid, "50 g of water + 20 mmol of FeS(s)", "");
    assert!(sulfide.contains("more H2S than stays") && sulfide.contains("toxic gas"), "{sulfide}");
    let hydrosulfide = poured("hydrosulfide", EQUILIBRIA, acid, "50 g of water + 20 mmol of HS- + 20 mmol of Na+", "");
    assert!(hydrosulfide.contains("incompatible-mix"), "{hydrosulfide}");
    let cyanide = poured(
        "cyanide",
        EQUILIBRIA,
        "50 g of water",
        "50 g of water + 1 mmol of NaCN",
        "    note \"{cup.contents.ph}\"",
    );
    assert!(!cyanide.contains("ignores NaCN"), "{cyanide}");
    // With a gas the pressure is known, and another caution has it.
    let gases = poured("vinegar_with_gases", "use std::gases\n", "50 g of water + 40 mmol of acetic_acid", soda, "");
    assert!(gases.contains("gas-bubbles-off") && !gases.contains("gas-leaves"), "{gases}");
}

#[test]
fn declared_charges_balance() {
    let of = |name: &str, into: &str| poured(name, EQUILIBRIA, "50 g of water", into, "");
    let lone = of("lone_acetate", "50 g of water + 10 mmol of acetate");
    assert!(
        lone.contains("charges declared in `cup` do not balance: positive less negative ones are -10.000 mmol"),
        "{lone}"
    );
    let phosphate = of("short_of_sodium", "50 g of water + 10 mmol of PO4^3- + 20 mmol of Na+");
    assert!(phosphate.contains("-10.000 mmol"), "{phosphate}");
    for whole in ["10 mmol of acetate + 10 mmol of Na+", "10 mmol of CH3COONa", "10 mmol of PO4^3- + 30 mmol of Na+"] {
        let said = of("balanced", &format!("50 g of water + {whole}"));
        assert!(!said.contains("do not balance"), "{said}");
    }
}

#[test]
fn mixing_that_boils_is_told() {
    let acid = "30 g of H2SO4";
    let strong = poured("boiling_acid", "", acid, "25 g of water", "");
    assert!(
        strong.contains("`cup` would warm to about 144 degC") && strong.contains("and boil if no heat escapes"),
        "{strong}"
    );
    let hot = poured("hot_acid", "", acid, "150 g of water at 25 degC", "");
    assert!(hot.contains("hot-mixing") && !hot.contains("boil if"), "{hot}");
    // Little heat is enough where little is missing.
    let nearly = poured("nearly_boiling", "", acid, "200 g of water at 90 degC", "");
    assert!(nearly.contains("and boil if no heat escapes"), "{nearly}");
}

#[test]
fn a_ph_without_water_is_told_of_the_vessel_that_has_none() {
    let then = "    note \"{flask.contents.ph :.2} {cup.contents.ph :.2}\"";
    let dry = poured("dry", EQUILIBRIA, "30 g of acetone", "30 g of ethanol", then);
    assert!(dry.contains("the pH of `flask` is used") && dry.contains("the pH of `cup` is used"), "{dry}");
    let one = poured("one_dry", EQUILIBRIA, "30 g of acetone", "30 g of ethanol", "    note \"{cup.contents.ph :.2}\"");
    assert!(!one.contains("the pH of `flask`"), "{one}");
}

#[test]
fn heat_of_what_dissolves_whole_is_told_by_its_name() {
    let then = "    expect cup.contents.temperature < 30 degC";
    // 25 g of urea take up 6.2 kJ, which leaves 100 g of water some 14 K colder.
    let colder = "    expect cup.contents.temperature in 9 degC .. 13 degC";
    let urea = poured("urea", EQUILIBRIA, "30 g of urea", "100 g of water", colder);
    assert!(urea.contains("no findings"), "{urea}");
    let made = format!(
        "{EQUILIBRIA}reaction hydrolysis: urea + 2 water -> CO2 + 2 NH3 {{ rate: 1e-9 1/s, order: {{ urea: 1 }} }}\n"
    );
    let made = poured("urea_made", &made, "30 g of urea", "100 g of water", then);
    assert!(made.contains("ignores the heat of dissolving urea: about -1"), "{made}");
    assert!(made.contains("allow heat_of_dissolving_left_out"), "{made}");
    let pack = poured("cold_pack", EQUILIBRIA, "30 g of NH4Cl", "100 g of water", then);
    assert!(pack.contains("takes the heat of diluting NH4+ from another ion"), "{pack}");
    let thin = poured("thin", EQUILIBRIA, "100 g of water + 10 mmol of NH4Cl", "100 g of water", then);
    assert!(!thin.contains("another ion"), "{thin}");
}

#[test]
fn a_dry_acid_is_as_warm_as_its_solid() {
    // Little of benzoic acid dissolves: what stays solid neither warms nor cools, whichever of the two species was weighed.
    let cools = |name: &str, weighed_in: &str| {
        let uses = "use std::equilibria\nuse std::acids";
        25.0 - weighed(name, uses, &format!("20 g of {weighed_in}"), "100 g of water").1
    };
    let (acid, solid) = (cools("dry_acid", "benzoic_acid"), cools("dry_solid", "benzoic_acid(s)"));
    assert!((acid - solid).abs() < 0.002, "{acid} against {solid}");
    // 3.6 mmol dissolve, with some 20 kJ/mol.
    assert!(acid > 0.1 && acid < 0.25, "{acid}");
}

/// A caution of one's own names what `any` has found, as those of the library do.
#[test]
fn a_caution_names_what_any_finds() {
    let dir = folder("own_caution");
    let checked = |when: &str, because: &str| {
        let text = format!(
            "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
caution own(m: Mixture)
    when {when}
    \"dilute it\"
    because \"{because}\"
lab bench {{
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 50 g of water + 5 mmol of acetic_acid + 5 mmol of NH3
}}
workflow go in bench {{
    wait 1 s
}}
"
        );
        checked(&dir, text)
    };
    let one = checked("any(s in m.species: s.charge > 0 and m.amount[s] > 1 mmol)", "much {s} in {whole(m)}");
    assert!(one.contains("much NH4+ in cup") && !one.contains("error"), "{one}");
    let two = checked(
        "any(s in having(m.species, \"pka\"): any(t in having(m.species, \"pkah\"): min(m.amount[s], m.amount[t]) > 1 mmol))",
        "{s} beside {t}",
    );
    assert!(two.contains("NH4+ beside acetate") && !two.contains("error"), "{two}");
    let unknown = checked("any(s in m.species: m.amount[s] > 1 mmol)", "much {q}");
    assert!(unknown.contains("unknown name `q`"), "{unknown}");
}

/// What `check` says of `from` weighed into `into`, in vessels without loss of heat, and the temperature after that, degC.
fn weighed(name: &str, items: &str, from: &str, into: &str) -> (String, f64) {
    let dir = folder(name);
    let text = format!(
        "mtx 1
use std::glassware::Beaker250mL
{items}
extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 s
    effect move(m, from: source, to: target)
asset Cup: Beaker250mL {{ contents: {{ air: 0 W/K }}, wall: 0 W/K }}
lab bench {{
    ambient: 25 degC
    jar = Cup at (0, 0, 0) m holding {from}
    cup = Cup at (1, 0, 0) m holding {into}
}}
workflow go in bench {{
    weigh_out 20 g from jar into cup
    wait 10 ms
    note \"after that {{cup.contents.temperature as degC :.3}} degC\"
}}
"
    );
    let said = checked(&dir, &text);
    let out = matterixc_in(&dir, &["run", "cup.mtx"]).out;
    let after = out.rsplit_once("after that ").and_then(|(_, rest)| rest.split_whitespace().next()?.parse().ok());
    (said, after.unwrap_or(f64::NAN))
}

#[test]
fn equilibria_that_say_nothing_of_their_heat_are_named() {
    let lye = "100 g of water + 50 mmol of NaOH";
    let acid = "20 g of water + 50 mmol of HCl";
    let water = |more: &str| format!("equilibrium water_splits: water <-> H+ + OH- {{ constant: 1e-14{more} }}");
    let (said, _) = weighed("own_water", &water(""), acid, lye);
    assert!(said.contains("leaves out the heat of an equilibrium without an `enthalpy`"), "{said}");
    let (said, after) = weighed("own_warm_water", &water(", enthalpy: 55.8 kJ/mol"), acid, lye);
    assert!(!said.contains("without an `enthalpy`") && after > 29.0, "{after}: {said}");
    // A solid that says how it dissolves has that heat, whatever its equilibrium lacks.
    let solid = |heat: &str| {
        format!(
            "use std::equilibria
species sweet(s) {{ formula: \"C6H12O6\", molar_volume: 110 mL/mol, heat_capacity: 200 J/(mol*K){heat} }}
species sweet {{ formula: \"C6H12O6\", molar_volume: 110 mL/mol, heat_capacity: 200 J/(mol*K) }}
equilibrium sweet_dissolves: sweet(s) <-> sweet {{ log_constant: 0.7 }}"
        )
    };
    let (said, after) =
        weighed("own_solid", &solid(", heat_of_solution: 20 kJ/mol"), "20 g of sweet(s)", "100 g of water");
    assert!(!said.contains("without an `enthalpy`") && (after - 19.9).abs() < 0.5, "{after}: {said}");
    let (said, after) = weighed("own_plain_solid", &solid(""), "20 g of sweet(s)", "100 g of water");
    assert!(said.contains("may warm or cool it") && (after - 25.0).abs() < 1e-6, "{after}: {said}");
}

#[test]
fn what_gets_cold_may_freeze_or_stay_solid() {
    let (said, _) = weighed("cold_urea", EQUILIBRIA, "20 g of urea", "30 g of water");
    assert!(said.contains("and may freeze if no heat gets in"), "{said}");
    let (said, _) = weighed("cold_salt", EQUILIBRIA, "20 g of KNO3", "60 g of water");
    assert!(said.contains("where not all of KNO3 may dissolve"), "{said}");
    let (said, _) = weighed("cool_salt", EQUILIBRIA, "20 g of NaCl", "100 g of water");
    assert!(!said.contains("may freeze") && !said.contains("may dissolve"), "{said}");
}

#[test]
fn equilibria_and_layers_need_water_that_stays_apart() {
    let tautomers = "species keto { formula: \"C5H8O2\", molar_volume: 100 mL/mol, heat_capacity: 200 J/(mol*K) }
species enol { formula: \"C5H8O2\", molar_volume: 100 mL/mol, heat_capacity: 200 J/(mol*K) }
equilibrium turns: keto <-> enol { constant: 4, enthalpy: -10 kJ/mol }";
    let (said, _) = weighed("keto", tautomers, "20 g of EtOH", "30 g of EtOH + 5 mmol of keto");
    assert!(said.contains("holds no water: there keto keeps the amount that was put in"), "{said}");
    let (said, _) = weighed("keto_in_water", tautomers, "20 g of water", "30 g of water + 5 mmol of keto");
    assert!(!said.contains("holds no water"), "{said}");
    let layer = |liquid: &str| {
        format!(
            "species I2_out {{ formula: \"I2\", molar_volume: 60 mL/mol, heat_capacity: 60 J/(mol*K), dissolved_in: {liquid} }}
equilibrium extraction: I2 <-> I2_out {{ partition: 20, enthalpy: 0 kJ/mol }}"
        )
    };
    let (said, _) = weighed("mixes", &layer("EtOH"), "20 g of EtOH", "30 g of water + 1 mmol of I2");
    assert!(said.contains("such a liquid mixes with water"), "{said}");
    let (said, _) = weighed("apart", &layer("CHCl3"), "20 g of CHCl3", "30 g of water + 1 mmol of I2");
    assert!(!said.contains("mixes with water"), "{said}");
}

/// Thirteen ions of aluminium at once take up most of what half-neutralised aluminium chloride holds.
#[test]
fn large_clusters_are_found() {
    let text = "mtx 1
use std::equilibria
use std::metals
use std::glassware::Beaker250mL
species Al13^7+ { formula: \"Al13H24O28^7+\", molar_volume: 100 mL/mol, heat_capacity: 0 J/(mol*K) }
equilibrium al13: 13 Al3+ + 28 water <-> Al13^7+ + 32 H+ { log_constant: -98.73 }
lab bench {
    ambient: 25 degC
    cup = Beaker250mL { contents: { activities: ideal } } at (0, 0, 0) m holding 100 g of water + 1 mmol of Al3+ + 3 mmol of Cl- + 2 mmol of NaOH
}
workflow go in bench {
    wait 1 s
    expect cup.contents.ph in 4.10 .. 4.12
    expect cup.contents.amount[Al13^7+] in 0.061 mmol .. 0.063 mmol
}
";
    passed("cluster", text);
}

#[test]
fn a_little_hydroxide_comes_out_of_much_metal() {
    let amounts = [82, 86, 90, 98, 99, 100, 101, 108, 110, 115, 120, 130, 140];
    let cup = |n: &i32| {
        format!(
            "    c{n} = Beaker250mL at ({n}, 0, 0) m holding 200 g of water + {n} mmol of copper_sulfate_pentahydrate\n"
        )
    };
    let note = |n: &i32| format!("    expect c{n}.contents.ph in 4.5 .. 5.5\n");
    let (cups, notes): (String, String) = (amounts.iter().map(cup).collect(), amounts.iter().map(note).collect());
    let text = format!(
        "mtx 1
use std::equilibria
use std::salts
use std::complexes
use std::glassware::Beaker250mL
lab bench {{
    ambient: 25 degC
{cups}}}
workflow go in bench {{
    wait 1 s
{notes}}}
"
    );
    passed("blue_vitriol", text);
}

#[test]
fn cyanide_keeps_metals_in_solution_and_struvite_comes_out() {
    let text = "mtx 1
use std::equilibria
use std::metals
use std::complexes
use std::solids
use std::glassware::Beaker1000mL
lab bench {
    ambient: 25 degC
    zinc = Beaker1000mL at (0, 0, 0) m holding 1 kg of water + 10 mmol of Zn2+ + 20 mmol of Cl- + 40 mmol of CN- + 40 mmol of Na+
    nickel = Beaker1000mL at (1, 0, 0) m holding 1 kg of water + 10 mmol of Ni2+ + 20 mmol of Cl- + 40 mmol of CN- + 40 mmol of Na+
    struvite = Beaker1000mL at (2, 0, 0) m
        holding 1 kg of water + 10 mmol of Mg2+ + 20 mmol of Cl- + 10 mmol of NH4+ + 10 mmol of H2PO4- + 15 mmol of NaOH
}
workflow go in bench {
    wait 1 s
    // More than 99 % of it, with little hydrogen cyanide.
    expect nickel.contents.amount[Ni_CN_4^2-] > 9.9 mmol and nickel.contents.amount[HCN] < 0.1 mmol
    expect zinc.contents.amount[Zn_CN_4^2-] + zinc.contents.amount[Zn_CN_3-] > 9.5 mmol
    expect struvite.contents.amount[struvite] in 5 mmol .. 7 mmol
}
";
    let out = passed("cyanides", text);
    assert!(!out.contains("zinc_hydroxide") && !out.contains("fatal"), "{out}");
}

#[test]
fn dissolved_solids_take_the_volume_that_they_have_in_water() {
    // Densities at 20 to 25 degC: glycine 20 %, 1.082; tartaric acid 10 %, 1.0455 (CRC Handbook); proline 40 %, 1.12.
    let text = "mtx 1
use std::equilibria
use std::acids
use std::glassware::Beaker250mL
lab bench {
    ambient: 25 degC
    glycine = Beaker250mL at (0, 0, 0) m holding 80 g of water + 20 g of glycine
    tartaric = Beaker250mL at (1, 0, 0) m holding 90 g of water + 10 g of tartaric_acid
    proline = Beaker250mL at (2, 0, 0) m holding 60 g of water + 40 g of proline
}
workflow go in bench {
    wait 1 s
    expect glycine.contents.mass / glycine.contents.volume in 1.071 g/mL .. 1.093 g/mL
    expect tartaric.contents.mass / tartaric.contents.volume in 1.035 g/mL .. 1.056 g/mL
    expect proline.contents.mass / proline.contents.volume in 1.109 g/mL .. 1.131 g/mL
}
";
    passed("densities", text);
}

#[test]
fn other_ions_raise_what_dissolves_of_a_salt() {
    let sea = "100 g of water + 1.07 mmol of Ca2+ + 48.5 mmol of Na+ + 54.8 mmol of Cl- + 5.5 mmol of Mg2+ + 2.92 mmol of SO4^2- + 1.01 mmol of K+ + 0.79 mmol of Cl-";
    let out = poured("sea_water", "", sea, "50 g of water", "    expect cup.contents.mass > 70 g");
    assert!(!out.contains("holds more CaSO4"), "{out}");
    let plaster = "100 g of water + 5 mmol of Ca2+ + 5 mmol of SO4^2-";
    let out = poured("plaster", "", plaster, "50 g of water", "    expect cup.contents.mass > 70 g");
    assert!(out.contains("holds more CaSO4"), "{out}");
}

#[test]
fn pairs_that_are_counted_twice_are_named() {
    let uses = "use std::equilibria\nuse std::salts\nuse std::complexes\n";
    let warm = "    expect cup.contents.temperature in 0 degC .. 60 degC";
    let cold = |name: &str, uses: &str, amount: &str| {
        poured(
            name,
            uses,
            "50 g of water",
            &format!("50 g of water + {amount} of magnesium_sulfate_heptahydrate"),
            warm,
        )
    };
    let strong = cold("epsom", uses, "50 mmol");
    assert!(strong.contains("their heat and volume are counted twice"), "{strong}");
    let dilute = cold("dilute_epsom", uses, "5 mmol");
    assert!(!dilute.contains("counted twice"), "{dilute}");
    let plain = cold("plain_epsom", "use std::equilibria\nuse std::salts\n", "50 mmol");
    assert!(!plain.contains("counted twice"), "{plain}");
}

#[test]
fn a_constant_with_a_wrong_digit_is_refused() {
    let dir = folder("wrong_digit");
    let checked = |constant: &str| {
        let text = format!(
            "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
equilibrium own: Fe3+ + e- <-> Fe2+ {{ {constant} }}
lab bench {{
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 50 g of water + 5 mmol of HCl
}}
workflow go in bench {{
    wait 1 s
}}
"
        );
        checked(&dir, text)
    };
    let volts = checked("potential: 77.1 V");
    assert!(volts.contains("the potential of `own` is 77.1 V"), "{volts}");
    let power = checked("log_constant: -1303");
    assert!(power.contains("the constant of `own` is 10^-1303 at 25 degC"), "{power}");
    let right = checked("potential: 0.771 V");
    assert!(!right.contains("out-of-range"), "{right}");
}

/// The controller of the plate integrates within 5 K of its set point: a difference of two temperatures, which is rounded as they are.
#[test]
fn a_plate_beside_equilibria_comes_near_its_set_point() {
    let dir = folder("plate");
    let text = |target: u32| {
        format!(
            "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {{
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker250mL on plate holding 50 g of water + 5 mmol of HCl
}}
workflow go in bench {{
    heat plate to {target} degC
    wait 2 h
}} finally {{
    stop heating plate
}}
"
        )
    };
    for target in [180, 250] {
        write(&dir, "plate.mtx", text(target));
        let out = matterixc_in(&dir, &["run", "plate.mtx"]).out;
        assert!(out.contains("go in bench: passed after 7200 s"), "{target}: {out}");
    }
}

/// What `check` and `run` say of a lab with these lines, and a note of these values.
fn looked_at(name: &str, uses: &str, lines: &str, values: &str) -> (String, String) {
    let dir = folder(name);
    let text = format!(
        "mtx 1
use std::equilibria
{uses}
use std::glassware::Beaker250mL
lab bench {{
    ambient: 25 degC
{lines}
}}
workflow look in bench {{
    wait 1 s
    note \"found {values}\"
}}
"
    );
    let checked = checked(&dir, text);
    (checked, flat(&matterixc_in(&dir, &["run", "cup.mtx"]).out))
}

/// By the law of Davies at 0.1 and 0.3 mol/kg: -log10 of 0.1 x 10^-0.107 and of 0.1 x 10^-0.538.
#[test]
fn electrodes_read_ions_that_take_part_in_no_equilibrium() {
    let uses = "use std::electrodes::{CalciumMembrane, SilverBillet}";
    let lines = "    nitrate = Beaker250mL at (0, 0, 0) m holding 100 g of water + 10 mmol of AgNO3
    chloride = Beaker250mL at (1, 0, 0) m holding 100 g of water + 10 mmol of Ca2+ + 20 mmol of Cl-
    salt = Beaker250mL at (2, 0, 0) m holding 100 g of water + 10 mmol of NaCl
    silver = SilverBillet { probes: nitrate } at (0, 1, 0) m
    calcium = CalciumMembrane { probes: chloride } at (1, 1, 0) m
    blind = CalciumMembrane { probes: salt } at (2, 1, 0) m";
    let (said, ran) =
        looked_at("ions_alone", uses, lines, "{silver.sensed :.3} {calcium.sensed :.3} {blind.shown :.1}");
    assert!(ran.contains("found 1.107 1.538"), "{ran}");
    assert!(said.contains("`blind` senses nothing in `salt`") && !said.contains("`silver` senses"), "{said}");
}

#[test]
fn constants_that_do_not_follow_the_temperature_hold_near_25_degc() {
    let uses = "use std::acids\nuse std::complexes\nuse std::metals";
    for (celsius, told) in [(25, false), (34, false), (37, true)] {
        let lines = format!(
            "    amine = Beaker250mL at (0, 0, 0) m holding 100 g of water + 5 mmol of piperidine + 2 mmol of HCl at {celsius} degC
    silver = Beaker250mL at (1, 0, 0) m holding 100 g of water + 1 mmol of AgNO3 + 5 mmol of NH3 at {celsius} degC"
        );
        let values = "{amine.contents.ph} {silver.contents.ph}";
        let (said, _) = looked_at("windows", uses, &lines, values);
        for of in ["piperidinium", "AgNH3+"] {
            assert_eq!(said.contains(&format!("an equilibrium of {of} has no constant")), told, "{celsius}: {said}");
        }
    }
}

#[test]
fn pairs_of_ions_and_other_laws_are_told_where_solids_are() {
    let gypsum = "    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + 5 mmol of CaSO4";
    let (alone, _) = looked_at("pairs_left_out", "use std::solids", gypsum, "{cup.contents.ph}");
    assert!(alone.contains("pairs of the ions of gypsum are left out in `cup`"), "{alone}");
    let (paired, _) = looked_at("pairs", "use std::solids\nuse std::complexes", gypsum, "{cup.contents.ph}");
    assert!(!paired.contains("pairs of the ions"), "{paired}");
    let sulfate = "    cup = Cup at (0, 0, 0) m holding 100 g of water + 50 mmol of potassium_sulfate";
    for (law, told) in [("davies", true), ("pitzer", false)] {
        let uses =
            format!("use std::brines\nuse std::salts\nasset Cup: Beaker250mL {{ contents: {{ activities: {law} }} }}");
        let (said, _) = looked_at("brines_by_law", &uses, sulfate, "{cup.contents.ph}");
        assert_eq!(said.contains("hold with `activities: pitzer` only"), told, "{law}: {said}");
    }
}

#[test]
fn a_buffer_is_spent_only_where_no_other_pair_buffers() {
    let lye = "use std::equilibria\nuse std::acids\n";
    let said = |name: &str, into: &str| poured(name, lye, "50 g of water + 24 mmol of NaOH", into, "");
    // 12 mmol of NaOH: the three steps of citric acid buffer one after the other; phosphoric acid alone is no buffer yet.
    for (name, into) in [
        ("citrate_made", "100 g of water + 10 mmol of citric_acid"),
        ("citrate_moved", "100 g of water + 10 mmol of citric_acid + 10 mmol of dihydrogen_citrate + 10 mmol of Na+"),
        ("phosphate_made", "100 g of water + 8 mmol of H3PO4"),
    ] {
        let said = said(name, into);
        assert!(!said.contains("exhausts"), "{said}");
    }
    for (name, into, acid) in [
        ("acetate_spent", "100 g of water + 8 mmol of acetic_acid + 8 mmol of acetate + 8 mmol of Na+", "acetic_acid"),
        ("phosphate_spent", "100 g of water + 8 mmol of H2PO4- + 8 mmol of HPO4^2- + 24 mmol of Na+", "H2PO4-"),
    ] {
        let said = said(name, into);
        assert!(said.contains(&format!("exhausts the buffer of {acid}")), "{said}");
    }
}

#[test]
fn what_equilibria_make_attacks_a_wall_as_well() {
    let fluoride = "50 g of water + 10 mmol of F- + 10 mmol of Na+";
    let of = |name: &str, from: &str| poured(name, EQUILIBRIA, from, fluoride, "");
    let acid = of("etched", "50 g of water + 10 mmol of HCl");
    assert!(
        acid.contains("`cup` comes to hold 3.990") && acid.contains("mmol of HF, which attacks its wall"),
        "{acid}"
    );
    let salt = of("not_etched", "50 g of water + 10 mmol of NaCl");
    assert!(!salt.contains("attack"), "{salt}");
    // What is put in as such is one finding, not two.
    let put = of("put_in", "50 g of water + 10 mmol of HF");
    assert!(put.contains("material-attacked") && !put.contains("comes to hold"), "{put}");
    let allowed = "use std::equilibria\nallow incompatible borosilicate with HF \"a cup to throw away\"\n";
    let allowed = poured("allowed", allowed, "50 g of water + 10 mmol of HCl", fluoride, "");
    assert!(!allowed.contains("attack"), "{allowed}");
}

#[test]
fn a_named_result_of_a_library_step_is_a_use() {
    let lines = "    c = Beaker250mL at (2, 0, 0) m holding 100 g of water + 300 mmol of Na+ + 300 mmol of Cl-
    meter = GlassElectrode { probes: c } at (2, 1, 0) m
    brine = Beaker250mL at (3, 0, 0) m holding 100 g of water + 100 mmol of Ca2+ + 200 mmol of Cl-
    probe = CalciumMembrane { probes: brine } at (3, 1, 0) m
";
    let dir = folder("named_result");
    let text = |steps: &str| {
        format!(
            "mtx 1\nuse std::equilibria\nuse std::electrodes\nuse std::glassware::Beaker250mL\nlab bench {{\n    ambient: 25 degC\n{lines}}}\nworkflow go in bench {{\n{steps}}}\n"
        )
    };
    write(
        &dir,
        "read.mtx",
        text("    let shown <- read meter\n    let ion <- read probe\n    note \"{shown} {ion}\"\n"),
    );
    let said = flat(&matterixc_in(&dir, &["check", "read.mtx", "--no-cache"]).out);
    assert!(said.contains("`meter` is not calibrated"), "{said}");
    assert!(said.contains("of `c` is used at an ionic strength of 3.00"), "{said}");
    assert!(said.contains("the activity of an ion in `brine` is used at an ionic strength of 3.00"), "{said}");
    // Nobody uses a reading that has no name.
    let said = checked(&dir, text("    expect c.volume > 1 mL and brine.volume > 1 mL\n"));
    assert!(!said.contains("ionic strength"), "{said}");
}

#[test]
fn a_ph_outside_its_model_is_shown_as_such() {
    let dir = folder("outside_model");
    let text = "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
use std::titration::MotorBurette
lab bench {
    ambient: 25 degC
    strong = Beaker250mL at (0, 0, 0) m holding 10 g of water + 10 mmol of HCl
    brine = Beaker250mL at (1, 0, 0) m holding 100 g of water + 10 g of NaCl
    weak = Beaker250mL at (2, 0, 0) m holding 100 g of water + 1 mmol of HCl
    burette = MotorBurette { over: strong } at (0, 300, 0) mm holding 19 g of water
}
workflow go in bench {
    deliver 13 mL by burette
    expect brine.volume > 1 mL and weak.volume > 1 mL
}
";
    write(&dir, "cup.mtx", text);
    let checked = flat(&matterixc_in(&dir, &["check", "--contents", "cup.mtx", "--no-cache"]).out);
    assert!(checked.contains("ph 0.102 (outside its model)") && checked.contains("ph 0.49"), "{checked}");
    assert!(!checked.contains("ph 2.0446 (outside"), "{checked}");
    let run = matterixc_in(&dir, &["run", "cup.mtx", "--out", "out"]).out;
    let of = |vessel: &str| {
        let mut lines = run.lines().filter(|line| line.trim_start().starts_with(&format!("{vessel}.contents: mass")));
        lines.next().unwrap_or_else(|| panic!("{vessel} in {run}")).to_owned()
    };
    assert!(of("brine").contains("(outside its model)"), "{run}");
    assert!(!of("strong").contains("outside") && !of("weak").contains("outside"), "{run}");
    let plot = std::fs::read_to_string(dir.join("out/plot.svg")).expect("a plot");
    assert!(plot.contains("ph; at times outside the model: strong.contents"), "the curve of `strong` begins outside");
    let bill = matterixc_in(&dir, &["bill", "cup.mtx"]).out;
    assert_eq!(bill.matches("(outside its model)").count(), 1, "{bill}");
    let doc = matterixc_in(&dir, &["doc", "cup.mtx"]).out;
    assert!(doc.contains("Its pH is near 0.10, outside the range of its model."), "{doc}");
}

#[test]
fn validity_is_a_condition_of_ones_own_quantities_too() {
    let dir = folder("own_validity");
    let text = |condition: &str| {
        format!(
            "mtx 1
use std::glassware::Beaker250mL
asset Watched: Beaker250mL {{}}
capability Vapour: Vessel {{
    derived pressure: Pressure = 1 kPa * (contents.temperature - 273.15 K) / (10 K) {{ valid: {condition} }}
}}
asset Steaming: Beaker250mL, Vapour {{}}
lab bench {{
    ambient: 25 degC
    cold = Steaming at (0, 0, 0) m holding 100 g of water at 20 degC
    warm = Steaming at (1, 0, 0) m holding 100 g of water at 60 degC
}}
workflow go in bench {{
    wait 1 s
    expect cold.pressure > 1 Pa and warm.pressure > 1 Pa
}}
"
        )
    };
    write(&dir, "own.mtx", text("contents.temperature in 0 degC .. 40 degC"));
    let said = flat(&matterixc_in(&dir, &["check", "--contents", "own.mtx", "--no-cache"]).out);
    assert_eq!(said.matches("(outside its model)").count() > 0, said.contains("warm"), "{said}");
    assert!(said.lines().all(|line| !line.contains("cold:") || !line.contains("outside")), "{said}");
    let said = checked(&dir, text("3 kPa"));
    assert!(said.contains("error"), "{said}");
}

#[test]
fn a_metal_ion_left_out_is_told_of_beside_base_too() {
    for (name, into) in [
        ("iron_alone", "50 g of water + 1 mmol of Fe3+ + 3 mmol of Cl-"),
        ("iron_and_lye", "50 g of water + 1 mmol of Fe3+ + 3 mmol of Cl- + 3 mmol of NaOH"),
        ("copper_and_lye", "50 g of water + 1 mmol of Cu2+ + 2 mmol of Cl- + 2 mmol of NaOH"),
    ] {
        let said = poured(name, EQUILIBRIA, "50 g of water", into, "    note \"{cup.contents.ph}\"");
        assert!(said.contains("`cup` ignores"), "{name}: {said}");
    }
    let sodium = poured(
        "lye_alone",
        EQUILIBRIA,
        "50 g of water",
        "50 g of water + 3 mmol of NaOH",
        "    note \"{cup.contents.ph}\"",
    );
    assert!(!sodium.contains("ignores"), "{sodium}");
}

/// Silver is in the chloride, and the iodide, for which the file has no equilibrium, would take it.
#[test]
fn a_salt_left_out_is_told_of_beside_another_of_its_ions() {
    let into = "50 g of water + 1 mmol of AgNO3 + 1 mmol of KI + 2 mmol of NaCl";
    let said = poured("iodide_left_out", EQUILIBRIA, "50 g of water", into, "");
    assert!(said.contains("`cup` holds more AgI than dissolves"), "{said}");
    let with = "use std::equilibria\nuse std::solids\n";
    let said = poured("iodide_there", with, "50 g of water", into, "");
    assert!(!said.contains("more AgI"), "{said}");
}

#[test]
fn a_conductivity_needs_the_ions_that_equilibria_make() {
    let lines = |held: &str| {
        format!(
            "    c = Beaker250mL at (2, 0, 0) m holding 100 g of water + {held}\n    probe = ConductivityProbe {{ probes: c }} at (2, 1, 0) m"
        )
    };
    let dir = folder("conductivity_of_what");
    let said = |uses: &str, held: &str| {
        let text = format!(
            "mtx 1\n{uses}use std::electrodes\nuse std::glassware::Beaker250mL\nlab bench {{\n    ambient: 25 degC\n{}\n}}\nworkflow go in bench {{\n    expect probe.conductivity < 1 S/m\n}}\n",
            lines(held)
        );
        checked(&dir, text)
    };
    for held in ["1 mmol of HCl + 1 mmol of NaOH", "10 mmol of acetic_acid", "10 mmol of NH3"] {
        assert!(said("", held).contains("counts ions as they were put in"), "{held}");
        assert!(!said(EQUILIBRIA, held).contains("as they were put in"), "{held}");
    }
    assert!(!said("", "1 mmol of KCl").contains("as they were put in"));
}

#[test]
fn a_window_of_ph_holds_where_there_is_a_ph() {
    let dir = folder("window_of_what");
    let said = |uses: &str, held: &str| {
        let text = format!(
            "mtx 1\n{uses}use std::glassware::Beaker250mL\nasset Medium: Beaker250mL, PhWindow {{ ph_window: 6 .. 8 }}\nlab bench {{\n    ambient: 25 degC\n    cup = Medium at (0, 0, 0) m holding {held}\n}}\nworkflow go in bench {{\n    wait 1 s\n    expect cup.contents.mass > 1 g\n}}\n"
        );
        checked(&dir, text)
    };
    assert!(!said(EQUILIBRIA, "10 g of ethanol").contains("window"), "no water, no pH");
    assert!(said("", "50 g of water + 1 mmol of acetic_acid").contains("counts strong acids and bases only"));
    assert!(said(EQUILIBRIA, "50 g of water + 200 mmol of NaCl").contains("outside the range of its model"));
    let fine = said(EQUILIBRIA, "50 g of water + 1 mmol of H2PO4- + 1 mmol of HPO4^2- + 3 mmol of Na+");
    assert!(fine.contains("no findings"), "{fine}");
}

#[test]
fn buffers_are_what_the_electrode_is_told() {
    let dir = folder("wrong_buffers");
    let said = |stated: &str| {
        let text = format!(
            "mtx 1\nuse std::equilibria\nuse std::electrodes\nuse std::glassware::Beaker250mL\nlab bench {{\n    ambient: 25 degC\n    acid = Beaker250mL at (0, 0, 0) m holding 100 g of water + 5 mmol of acetic_acid + 5 mmol of acetate + 5 mmol of Na+\n    neutral = Beaker250mL at (1, 0, 0) m holding 100 g of water + 5 mmol of H2PO4- + 5 mmol of HPO4^2- + 15 mmol of Na+\n    meter = GlassElectrode {{ probes: acid }} at (2, 0, 0) m\n}}\nworkflow go in bench {{\n    calibrate meter with (acid, neutral) at ({stated})\n    expect meter.shown > 1\n}}\n"
        );
        checked(&dir, text)
    };
    assert!(said("4.66, 6.84").contains("no findings"), "{}", said("4.66, 6.84"));
    let wrong = said("5.66, 7.84");
    assert!(wrong.contains("out-of-range") && wrong.contains("`meter` is told 5.66 and 7.84"), "{wrong}");
}

#[test]
fn things_beyond_the_third_are_named() {
    let dir = folder("many_of_one");
    let cups: String = (0..6)
        .map(|i| format!("    c{i} = Beaker250mL at ({i}, 0, 0) m holding 100 g of water + 20{i} mmol of HCl\n"))
        .collect();
    let shown: String = (0..6).map(|i| format!("{{c{i}.contents.ph}} ")).collect();
    let text = format!(
        "mtx 1\nuse std::equilibria\nuse std::glassware::Beaker250mL\nlab bench {{\n    ambient: 25 degC\n{cups}}}\nworkflow go in bench {{\n    note \"{shown}\"\n}}\n"
    );
    let said = checked(&dir, text);
    assert_eq!(said.matches("is used at an ionic strength").count(), 3, "{said}");
    assert_eq!(said.matches("the same holds for `c3`, `c4` and `c5`").count(), 1, "{said}");
}

#[test]
fn contents_without_an_equilibrium_are_found_before_the_run() {
    let said = poured("no_solution", EQUILIBRIA, "50 g of water", "1 mg of water + 20 g of NaOH", "");
    assert!(said.contains("not-a-number") && said.contains("`cup` has no equilibrium at the start"), "{said}");
}

#[test]
fn a_wrong_equilibrium_brings_no_findings_on_amounts() {
    let dir = folder("wrong_equilibrium");
    let text = "mtx 1
use std::glassware::Beaker250mL
species HX { formula: \"C2HF3O2\" }
species X- { formula: \"C2F3O2\", charge: -1 }
equilibrium w: water <-> H+ + OH- { constant: 1e-14, enthalpy: 55.8 kJ/mol }
equilibrium hx: HX <-> 2 H+ + X- { log_constant: -2 }
lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + 1 mmol of HX
}
workflow look in bench {
    wait 1 s
    expect cup.contents.ph in 2 .. 2.7
}
";
    let said = checked(&dir, text);
    assert!(said.contains("unbalanced") && !said.contains("expectation-failed"), "{said}");
}

#[test]
fn a_run_says_what_it_finds_in_words_and_once() {
    let dir = folder("said_once");
    let text = "mtx 1
use std::equilibria
use std::glassware::Beaker250mL
lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + 1 mmol of AgNO3 + 1 mmol of NaCl
}
workflow look in bench {
    wait 1 s
    expect cup.contents.mass > 1 g
}
";
    write(&dir, "cup.mtx", text);
    let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
    let said = flat(&(ran.err + &ran.out));
    assert_eq!(
        said.matches("`cup` holds precipitated AgCl").count(),
        2,
        "once as a warning, once in the report: {said}"
    );
    let page = matterixc_in(&dir, &["explain", "buffer_exhausted"]).out;
    assert!(page.contains("`std::solutions` declares this name"), "{page}");
}

#[test]
fn a_potential_needs_both_forms_of_a_half_cell() {
    let dir = folder("open_potential");
    let said = |held: &str| {
        let text = format!(
            "mtx 1\nuse std::half_cells\nuse std::glassware::Beaker250mL\nlab bench {{\n    ambient: 25 degC\n    cup = Beaker250mL at (0, 0, 0) m holding 100 g of water + {held}\n}}\nworkflow go in bench {{\n    note \"{{redox_potential(cup.contents)}}\"\n}}\n"
        );
        checked(&dir, text)
    };
    for held in ["1 mmol of KMnO4 + 10 mmol of HCl", "1 mmol of Fe2+ + 2 mmol of Cl- + 10 mmol of HCl"] {
        assert!(said(held).contains("holds only one form of each of its half-cells"), "{held}: {}", said(held));
    }
    for held in [
        "1 mmol of Fe2+ + 1 mmol of Fe3+ + 5 mmol of Cl- + 20 mmol of HCl",
        "1 mmol of Cu2+ + 2 mmol of Cl- + 1 mmol of Cu(s)",
    ] {
        assert!(!said(held).contains("only one form"), "{held}: {}", said(held));
    }
    let neutral = said("1 mmol of KMnO4 + 10 mmol of KI");
    assert!(neutral.contains("and becomes manganese dioxide"), "{neutral}");
    let acid = said("1 mmol of KMnO4 + 10 mmol of KI + 20 mmol of HCl");
    assert!(!acid.contains("dioxide"), "{acid}");
}

#[test]
fn a_ph_says_what_water_would_make_of_an_oxide() {
    let ph = "    note \"{cup.contents.ph}\"";
    let of = |name: &str, uses: &str, what: &str, then: &str| {
        poured(name, uses, "50 g of water", &format!("50 g of water + {what}"), then)
    };
    let tables = "use std::substances\n";
    let both = "use std::substances\nuse std::equilibria\n";
    for (what, makes) in [
        ("SO2", "ignores that SO2 makes sulfurous_acid of std::equilibria with water"),
        ("CaO", "ignores that CaO makes calcium_hydroxide with water"),
        ("BaO", "makes Ba2+ and OH- with water"),
        ("Li2O", "makes Li+ and OH- with water"),
        ("P4O10", "makes H3PO4 with water"),
        ("CrO3", "makes H+ and hydrogen_chromate of std::equilibria with water"),
        ("B2O3", "makes boric_acid of std::equilibria with water"),
        ("Ac2O", "makes acetic_acid with water"),
        ("PCl5", "makes HCl and H3PO4 with water"),
        ("TiCl4", "makes HCl and TiO2 with water"),
        ("Cl2", "makes HCl and hypochlorous_acid of std::acids with water"),
        ("acetyl_chloride", "makes HCl and acetic_acid with water"),
    ] {
        for uses in [tables, both] {
            let said = of("oxide", uses, &format!("1 mmol of {what}"), ph);
            assert!(said.contains(makes) && !said.contains("missing-property"), "{what}: {said}");
        }
    }
    let caution = "with water";
    for (name, uses, what, then) in [
        // No pH is used; water leaves it alone; too little of it; what it makes is written.
        ("oxide_no_ph", both, "1 mmol of CaO", ""),
        ("oxide_inert", both, "1 mmol of SiO2", ph),
        ("oxide_little", both, "1 mmol of HCl + 1 umol of CaO", ph),
        ("oxide_products", both, "1 mmol of sulfurous_acid", ph),
    ] {
        let said = of(name, uses, what, then);
        assert!(!said.contains(caution), "{name}: {said}");
    }
    let reaction =
        format!("{both}reaction slaking: CaO + water -> calcium_hydroxide {{ rate: 1e-3 1/s, order: {{ CaO: 1 }} }}\n");
    let said = of("oxide_reacts", &reaction, "1 mmol of CaO", ph);
    assert!(!said.contains(caution) && !said.contains("error"), "{said}");
}

/// A hydrate keeps its water until other water comes: dry, it is as warm as it was put in, and cools water by its whole heat of solution. 5 g of
/// Epsom salt take 20.3 mmol x 11.6 kJ/mol, and ions that pair take more: some 1.1 K of 105 g.
#[test]
fn a_dry_hydrate_stays_as_it_is() {
    let dir = folder("dry_hydrate");
    let text = "mtx 1
use std::complexes
use std::metals
use std::salts
use std::glassware::Beaker250mL
asset Cup: Beaker250mL { contents: { air: 0 W/K }, wall: 0 W/K }
extern skill weigh_out(m: Mass) from(source: Vessel) into(target: Vessel)
    takes 1 s
    effect move(m, from: source, to: target)
lab bench {
    ambient: 25 degC
    water = Cup at (0, 0, 0) m holding 100 g of water
    epsom = Cup at (1, 0, 0) m holding 10 g of magnesium_sulfate_heptahydrate
    vitriol = Cup at (2, 0, 0) m holding 10 g of copper_sulfate_pentahydrate
    barium = Cup at (3, 0, 0) m holding 10 g of barium_hydroxide_octahydrate
}
workflow look in bench {
    expect epsom.contents.temperature in 24.99 degC .. 25.01 degC and vitriol.contents.temperature in 24.99 degC .. 25.01 degC
    expect barium.contents.temperature in 24.99 degC .. 25.01 degC
    weigh_out 5 g from epsom into water
    wait 10 ms
    expect water.contents.temperature in 23.8 degC .. 24.0 degC
    expect epsom.contents.temperature in 24.99 degC .. 25.01 degC
}
";
    let checked = checked(&dir, text);
    assert!(!checked.contains("precipitated"), "{checked}");
    let ran = matterixc_in(&dir, &["run", "cup.mtx"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}
