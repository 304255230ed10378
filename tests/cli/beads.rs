//! What a transfer leaves behind: beads over magnets, solids on a filter.

use crate::harness::{flat, folder, matterixc_in, write};

/// A deck with beads in the first column of a plate over magnets; `{steps}` work on it.
fn deck(pipette: &str, steps: &str) -> String {
    let trough = if steps.contains("trough") { " holding { A1: 10 mL of water, A2: 10 mL of EtOH }" } else { "" };
    format!(
        "mtx 1
use std::opentrons::{{MagneticModule, OT2, P300Multi, P300Single, PcrPlate96, Reservoir12, TipRack300}}
solution suspension {{ water: 100 g, magnetic_beads: 1 g }}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: {pipette} }} at (0, 0, 0) m
    tips = TipRack300 on ot2.slot[1]
    magnet = MagneticModule on ot2.slot[4]
    plate = PcrPlate96 on magnet holding {{ A1 .. H1: 50 uL of suspension }}
    trough = Reservoir12 on ot2.slot[5]{trough}
    waste = Reservoir12 on ot2.slot[6]
}}
workflow go in deck {{
    let before = plate[A1].contents.amount[magnetic_beads]
{steps}
}} finally {{
    disengage magnet
}}
"
    )
}

/// What `check` and `run` say of a text, and whether both pass.
#[track_caller]
fn passes(name: &str, text: String) {
    let dir = folder(name);
    write(&dir, "a.mtx", text);
    let checked = matterixc_in(&dir, &["check", "--strict", "a.mtx"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let ran = matterixc_in(&dir, &["run", "a.mtx", "--no-cache"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(!ran.out.contains("warning"), "{}", ran.out);
}

/// What `check` says of a text.
fn said(name: &str, text: String) -> String {
    let dir = folder(name);
    write(&dir, "a.mtx", text);
    flat(&matterixc_in(&dir, &["check", "a.mtx"]).out)
}

const UP: &str = "    engage magnet at 6 mm\n    wait 2 min\n";

#[test]
fn a_clean_up_of_a_column_keeps_its_beads() {
    let steps = format!(
        "{UP}    transfer 60 uL from plate.column(1) to waste[A1] by ot2.left using tips {{ tips: each, partial: true }}
    expect plate[A1].contents.amount[magnetic_beads] >= 0.997 * before
    expect plate[A1].contents.amount[water] < 1 umol
    repeat 2 times {{
        transfer 80 uL from trough[A2] to plate.column(1) by ot2.left using tips {{ tips: each }}
        expect plate[A1].contents.volume in 80.3 uL .. 80.4 uL
        transfer 90 uL from plate.column(1) to waste[A2] by ot2.left using tips {{ tips: each, partial: true }}
    }}
    expect waste[A2].contents.amount[EtOH] in 21.8 mmol .. 21.82 mmol
    disengage magnet
    transfer 40 uL from trough[A1] to plate.column(1) by ot2.left using tips {{ tips: each, mix_after: 3, mix_volume: 20 uL }}
    engage magnet at 6 mm
    wait 2 min
    for w in plate.column(1) {{ expect w.contents.amount[magnetic_beads] >= 0.99 * before }}
    transfer 38 uL from plate.column(1) to plate.column(2) by ot2.left using tips {{ tips: each }}
    for w in plate.column(2) {{
        expect w.contents.volume in 37.999 uL .. 38.001 uL
        expect w.contents.amount[magnetic_beads] < 0.003 * before
    }}
    expect plate[A1].contents.amount[magnetic_beads] >= 0.99 * before
    expect plate[A1].contents.temperature in 21.99 degC .. 22.01 degC"
    );
    passes("beads_clean_up", deck("P300Multi", &steps));
}

#[test]
fn beads_leave_in_proportion_where_the_magnets_are_down() {
    let steps = "    transfer 25 uL from plate[A1] to waste[A1] by ot2.left using tips { tips: each, with_beads: true }
    expect plate[A1].contents.amount[magnetic_beads] in 0.4999 * before .. 0.5001 * before
    engage magnet at 6 mm
    wait 2 min
    disengage magnet
    transfer 25 uL from plate[B1] to waste[A1] by ot2.left using tips { tips: each, with_beads: true }
    expect plate[B1].contents.amount[magnetic_beads] in 0.4999 * before .. 0.5001 * before
    transfer 50 uL from plate[C1] to waste[A2] by ot2.left using tips { tips: each, with_beads: true }
    expect waste[A2].contents.amount[magnetic_beads] in 0.9999 * before .. 1.0001 * before";
    passes("beads_down", deck("P300Single", steps));
}

#[test]
fn beads_gather_with_time() {
    // 99 % gather in a minute: in 9 s, of which the way of the pipette takes 5.5 s, half of them do.
    let steps = "    engage magnet at 6 mm
    pick up tip from tips by ot2.left
    wait 1.030 s
    aspirate 25 uL from plate[A1] by ot2.left { with_beads: true }
    expect plate[A1].contents.amount[magnetic_beads] / before in 0.745 .. 0.755
    blow out into waste[A1] by ot2.left
    drop tip by ot2.left";
    passes("beads_gather", deck("P300Single", steps));
}

#[test]
fn a_pipette_that_takes_beads_along_is_warned_of() {
    let take = "    transfer 60 uL from plate[A1] to waste[A1] by ot2.left using tips { tips: each, partial: true }";
    let found = said("beads_not_held", deck("P300Single", take));
    assert!(found.contains("warning[beads-not-held]: the magnets under `plate[A1]` are down"), "{found}");
    let found = said("beads_early", deck("P300Single", &format!("    engage magnet at 6 mm\n{take}")));
    assert!(found.contains("warning[beads-not-gathered]: so far 46 % of the beads in `plate[A1]`"), "{found}");
    let elsewhere = take.replace("plate[A1]", "trough[A1]").replace("60 uL", "100 uL");
    let found = said("beads_elsewhere", deck("P300Single", &elsewhere));
    assert!(!found.contains("beads"), "{found}");
}

#[test]
fn held_beads_are_no_liquid_to_aspirate() {
    let of = |volume: &str| {
        let take = format!("transfer {volume} from plate[A1] to waste[A1] by ot2.left using tips {{ tips: each }}");
        deck("P300Single", &format!("{UP}    {take}"))
    };
    // 0.34 of 50 uL are beads.
    passes("beads_all", of("49.6 uL"));
    let found = said("beads_underflow", of("49.8 uL"));
    assert!(found.contains("error[volume-underflow]: `plate[A1]` can give 49.66"), "{found}");
    // Only beads are left: what was emptied gives nothing more.
    let twice = deck(
        "P300Single",
        &format!(
            "{UP}    transfer 60 uL from plate[A1] to waste[A1] by ot2.left using tips {{ tips: each, partial: true }}
    transfer 20 uL from plate[A1] to waste[A1] by ot2.left using tips {{ tips: each }}"
        ),
    );
    let found = said("beads_twice", twice);
    assert!(found.contains("error[volume-underflow]: `plate[A1]` can give"), "{found}");
}

#[test]
fn check_knows_what_the_run_finds() {
    let of = |low: &str, high: &str| {
        deck(
            "P300Single",
            &format!(
                "{UP}    transfer 30 uL from plate[A1] to waste[A1] by ot2.left using tips {{ tips: each }}
    expect plate[A1].contents.amount[magnetic_beads] / before in {low} .. {high}"
            ),
        )
    };
    // 0.2 % of the beads are free, and 30 of 49.66 uL leave.
    passes("beads_known", of("0.998758", "0.998760"));
    let found = said("beads_wrong", of("0.9988", "1"));
    assert!(found.contains("error[expectation-failed]"), "{found}");
}

/// Two beakers, a funnel whose paper keeps a share of the sand, and steps.
fn bench(but: &str, steps: &str) -> String {
    format!(
        "mtx 1
use std::glassware::Beaker250mL
species sand {{ formula: \"SiO2\", density: 2.65 g/mL, specific_heat: 0.74 J/(g*K), phase: \"solid\", solubility: 0 }}
allow second_phase \"the paper holds it\"
capability Funnel: Body {{
    param keeps: Ratio = 1 {{ at_least: 0, at_most: 2 }}
    command filter(v: Volume) from(source: Container) into(target: Container)
        effect move(v, from: source, to: target, but: {but})
}}
asset Buchner: Funnel {{ mass: 200 g }}
lab bench {{
    ambient: 22 degC
    a = Beaker250mL at (0, 0, 0) m holding 50 mL of water + 10 g of sand at 60 degC
    b = Beaker250mL at (200, 0, 0) mm
    paper = Buchner at (400, 0, 0) mm
    leaky = Buchner {{ keeps: 0.9 }} at (600, 0, 0) mm
    wrong = Buchner {{ keeps: 1.5 }} at (800, 0, 0) mm
}}
workflow separate in bench {{
{steps}
}}
"
    )
}

const SAND: &str = "each(s in [sand]: keeps)";

#[test]
fn a_law_of_ones_own_holds_a_solid_back_with_its_heat() {
    let steps = "    filter 20 mL from a into b by paper
    expect b.contents.volume in 19.999 mL .. 20.001 mL and b.contents.amount[sand] == 0 mol
    expect a.contents.temperature in 59.9 degC .. 60.1 degC and b.contents.temperature in 59.9 degC .. 60.1 degC
    filter 30 mL from a into b by paper
    expect a.contents.amount[water] == 0 mol and a.contents.mass in 9.99999 g .. 10.00001 g
    expect a.contents.temperature in 59.9 degC .. 60.1 degC and b.contents.temperature in 59.9 degC .. 60.1 degC";
    passes("filter_paper", bench(SAND, steps));
    // A tenth of the sand may pass, and a part of it does with a part of the water: volumes count both.
    let steps = "    filter 5 mL from a into b by leaky
    expect b.contents.volume in 4.999 mL .. 5.001 mL
    expect b.contents.amount[sand] * sand.molar_mass in 99 mg .. 99.5 mg";
    passes("filter_leaky", bench(SAND, steps));
}

#[test]
fn more_than_is_free_cannot_be_moved() {
    let found = said("filter_too_much", bench(SAND, "    filter 52 mL from a into b by paper"));
    assert!(found.contains("error[transfer-fraction]: `filter 52 mL from a into b by paper` removes more"), "{found}");
    let dir = folder("filter_wrong");
    write(&dir, "a.mtx", bench(SAND, "    filter 5 mL from a into b by wrong"));
    let checked = matterixc_in(&dir, &["check", "a.mtx"]);
    let said = flat(&checked.out);
    assert!(checked.code == 1 && said.contains("that is to stay behind is 1.5: it must be 0 to 1"), "{said}");
}

#[test]
fn what_cannot_be_held_back_is_said() {
    let cases = [
        ("0.5", "`but` needs the share of each species"),
        ("each(s in [1]: keeps)", "expected a species"),
        ("each(s in [sand, sand]: keeps)", "`sand` is named twice"),
        ("each(s in [sand]: 1 mL)", "but"),
    ];
    for (but, why) in cases {
        let found = said("filter_forms", bench(but, "    filter 5 mL from a into b by paper"));
        assert!(found.contains("error[") && found.contains(why), "{but}: {found}");
    }
    let streams = bench(SAND, "    wait 1 s").replace(
        "asset Buchner",
        "process drips(p: Funnel, a: Container, b: Container) { move(1 mL/s, from: a, to: b, but: each(s in [sand]: p.keeps)) }
asset Buchner",
    );
    let found = said("filter_streams", streams);
    assert!(found.contains("error[unsupported]: holding something back from a transfer with a rate"), "{found}");
    let settled = bench("each(s in [acetic_acid]: keeps)", "    filter 5 mL from a into b by paper")
        .replace("use std::glassware", "use std::buffers\nuse std::equilibria\nuse std::glassware")
        .replace("50 mL of water +", "50 mL of water + 1 g of acetic_acid +");
    let found = said("filter_settled", settled);
    assert!(found.contains("error[unsupported]: `acetic_acid` takes part in an equilibrium"), "{found}");
}

#[test]
fn quantities_of_ones_own_are_divided_by_their_law() {
    // A mixture with a quantity of each species, and one of the whole.
    let text = include_str!("../cases/tags.mtx")
        .replace("reaction turn: red -> blue { rate: 0.1 1/s, order: { red: 1 } }\n", "")
        .replace("species blue { formula: \"C2H6O\", density: 1 g/mL, heat_capacity: 100 J/(mol*K) }\n", "")
        .replace("from: source, to: target)", "from: source, to: target, but: each(s in [red]: 0.5))")
        .split("workflow travel")
        .next()
        .map(|head| {
            format!(
                "{head}workflow strained in bench {{
    drip 10 g from a into b
    drip 10 g from salty into b
    drip 75 g from d into c
    expect d.contents.amount[red] * red.molar_mass in 24.999 g .. 25.001 g and d.contents.amount[water] < 1 nmol
    expect d.contents.tag[red] in 0.4999 mmol .. 0.5001 mmol
    expect c.contents.tag[red] in 1.4999 mmol .. 1.5001 mmol and d.contents.dose in 1.9999 C .. 2.0001 C
}}\n"
            )
        })
        .expect("it has workflows");
    let found = said("tags_unknown", text.clone());
    assert!(found.contains("what part of `dose` stays with the species that are held back is not known"), "{found}");
    let text = text.replace("dose: Charge = 8 C", "dose: Charge = 8 C { of_each: \"dose_of\" }").replace(
        "capability Tagged",
        "fn dose_of(m: Tagged, s: Species) -> Charge = m.dose * (m.amount[s] * s.molar_mass / m.mass)
capability Tagged",
    );
    passes("tags_known", text);
}

#[test]
fn an_event_holds_back_as_a_step_does() {
    let text = bench(
        SAND,
        "    wait 2 s\n    expect b.contents.amount[sand] == 0 mol and b.contents.volume in 9.999 mL .. 10.001 mL",
    )
    .replace(
        "asset Buchner",
        "event tips_over(p: Pouring) when elapsed >= 1 s { move(10 mL, from: p.a, to: p.b, but: each(s in [sand]: 1)) }
capability Pouring: Body {
    param a: Container
    param b: Container
}
asset Stand: Pouring { mass: 1 kg }
asset Buchner",
    )
    .replace("    paper = ", "    stand = Stand { a: a, b: b } at (0, 500, 0) mm\n    paper = ");
    passes("filter_event", text);
}
