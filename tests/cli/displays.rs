//! What `read` and `weigh` give: the display of the device, as it was tared, zeroed or calibrated.

use crate::harness::{folder, matterixc, write};

/// A workflow of which every `expect` holds in the run, and that `check` finds nothing in.
#[track_caller]
fn holds(name: &str, text: &str) {
    let file = write(&folder(&format!("displays_{name}")), "w.mtx", text);
    let checked = matterixc(&["check", &file]);
    assert!(checked.code == 0 && !checked.out.contains("warning["), "{name}: {}", checked.out);
    let ran = matterixc(&["run", &file]);
    assert_eq!(ran.code, 0, "{name}: {}{}", ran.out, ran.err);
}

const BALANCE: &str = "mtx 1
use std::balances::PrecisionBalance
use std::glassware::{Beaker250mL, Bottle500mL}
use std::pumps
use std::robots::{FrankaPanda, Robotiq2F85}
lab bench {
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    panda = FrankaPanda { gripper: Robotiq2F85 } on table at (-400, 0) mm
    scale = PrecisionBalance on table at (100, -200) mm
    cup = Beaker250mL on scale holding 20 g of water
    other = Beaker250mL on table at (-100, -300) mm holding 30 g of water
    bottle = Bottle500mL on table at (-700, 300) mm holding 400 mL of water
    pump = CavroXlp6000 on table at (-700, 0) mm
    between pump and bottle { piped: true }
    between pump and cup { piped: true }
}
";

#[test]
fn a_tared_balance_reads_the_net_weight() {
    for tare in ["tare", "tare now", "zero", "zero now"] {
        let steps = format!(
            "workflow w in bench {{
    let gross <- read scale
    {tare} scale
    let nothing <- read scale
    draw 5 mL from bottle by pump
    push 5 mL into cup by pump
    let net <- read scale
    expect gross > 100 g and nothing in -0.1 g .. 0.1 g and net in 4.8 g .. 5.2 g
    expect scale.weight > 100 g
}}
"
        );
        holds(&tare.replace(' ', "_"), &format!("{BALANCE}{steps}"));
    }
}

#[test]
fn what_is_weighed_after_a_tare_is_net() {
    let steps = "workflow w in bench {
    pick cup by panda
    tare scale
    put back cup by panda
    let cup_alone <- read scale
    place cup on table by panda
    let empty <- read scale
    let all <- weigh other on scale by panda
    expect empty in -0.1 g .. 0.1 g and cup_alone > 100 g and all > 100 g
    place other on table by panda
    place cup on scale by panda
    tare scale
    place cup on table by panda
    let less <- weigh other on scale by panda
    expect less in 9.8 g .. 10.2 g
}
";
    holds("weighed", &format!("{BALANCE}{steps}"));
}

#[test]
fn an_electrode_reads_by_its_last_calibration() {
    let text = "mtx 1
use std::electrodes
use std::equilibria
use std::glassware::Beaker250mL
allow not_calibrated \"the test compares\"
solution four { acetic_acid: 0.1 mol/L, sodium_acetate: 0.1 mol/L, water: rest }
solution seven { H2PO4-: 0.025 mol/L, HPO4^2-: 0.025 mol/L, Na+: 0.075 mol/L, water: rest }
lab bench {
    ambient: 25 degC
    cup = Beaker250mL at (0, 0, 0) m holding 100 mL of seven
    first = Beaker250mL at (1, 0, 0) m holding 100 mL of four
    second = Beaker250mL at (2, 0, 0) m holding 100 mL of seven
    meter = GlassElectrode { probes: cup }
}
workflow w in bench {
    let raw <- read meter
    calibrate meter with (first, second) at (acidity(first.contents), acidity(second.contents))
    let shown <- read meter
    expect abs(raw - acidity(cup.contents)) > 0.2 and abs(shown - acidity(cup.contents)) < 0.02
}
";
    holds("electrode", text);
}
