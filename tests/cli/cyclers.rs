//! Thermocyclers and heater-shakers: how their blocks, lids and wells warm, and what the robot's software refuses beside them.

use crate::harness::{Ended, flat, folder, matterixc_in, write};

/// A thermocycler with a full plate: `asset` is its type, `lines` the workflow.
fn cycler(name: &str, uses: &str, asset: &str, volume: &str, lines: &str) -> Ended {
    let dir = folder(&format!("cyclers_{name}"));
    let text = format!(
        r#"mtx 1
use std::opentrons::{{OT2, PcrPlate96{uses}}}
{asset}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 at (0, 0, 0) m
    cycler = Cycled on ot2.slot[7]
    plate = PcrPlate96 on cycler holding {{ A1 .. H12: {volume} of water }}
}}
workflow w in deck {{
{lines}
}} finally {{
    stop heating cycler
    stop heating lid cycler
}}
"#
    );
    write(&dir, "lab.mtx", &text);
    let checked = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert_eq!(checked.code, 0, "{name}: {}", checked.out);
    matterixc_in(&dir, &["run", "lab.mtx"])
}

fn passes(name: &str, uses: &str, asset: &str, volume: &str, lines: &str) {
    let ended = cycler(name, uses, asset, volume, lines);
    assert_eq!(ended.code, 0, "{name}: {}", ended.err);
}

/// What its firmware says of how far it goes past a set point (opentrons-modules: `PlateControl` of thermocycler-gen2; `thermo-cycler.h`), to 0.5 K.
#[test]
fn a_block_goes_past_its_set_point_as_its_firmware_has_it() {
    let turned = |up: &str, peak: &str| {
        format!(
            "    heat cycler to 60 degC\n    settle cycler\n    wait 60 s\n    heat cycler to {up} {{ volume: 50 uL }}\n    wait until cycler.temperature >= {up} - 0.2 K\n    \
             wait until cycler.temperature >= {peak} - 0.5 K timeout 30 s\n    settle cycler\n    expect cycler.temperature in {up} - 0.5 K .. {up} + 0.5 K\n    keep cycler.temperature <= {peak} + 0.5 K {{ wait 1 min }}"
        )
    };
    // 0.04 K/uL * 50 uL.
    passes("gen2", ", ThermocyclerGen2", "asset Cycled: ThermocyclerGen2 {}", "50 uL", &turned("95 degC", "97 degC"));
    // 1.0869 K + 0.0105 K/uL * 50 uL, for 10 s.
    passes("gen1", ", Thermocycler", "asset Cycled: Thermocycler {}", "50 uL", &turned("95 degC", "96.61 degC"));
    // A step of less than 5 K, and a set point below 23 degC, are met directly.
    let small = "    heat cycler to 60 degC { volume: 50 uL }\n    settle cycler\n    wait 60 s\n    heat cycler to 64 degC { volume: 50 uL }\n    keep cycler.temperature <= 64.1 degC { wait 1 min }\n    \
                 heat cycler to 10 degC { volume: 50 uL }\n    keep cycler.temperature >= 9.9 degC { wait 3 min }";
    passes("small", ", ThermocyclerGen2", "asset Cycled: ThermocyclerGen2 {}", "50 uL", small);
}

/// A data sheet says that a block warms by at most 3.9 K/s and a sample by 3.35 K/s (Veriti, 0.2 mL): on the way from 55 to 95 degC the sample lags by 15.1 K
/// as the block arrives.
#[test]
fn wells_follow_a_block_as_a_data_sheet_has_it() {
    let asset = "asset Cycled: ThermocyclerGen2 { capacity: 1 kJ/K, power: 3978.4 W, gain: 1 MW/K, over_base: 0 K, over_slope: 0 K/uL, under_base: 0 K, under_slope: 0 K/uL }";
    let lines = "    heat cycler to 55 degC\n    settle cycler\n    wait 2 min\n    heat cycler to 95 degC\n    let begun = elapsed\n    wait until cycler.temperature >= 94.9 degC\n    \
                 expect elapsed - begun in 10.1 s .. 10.4 s\n    expect plate[A1].contents.temperature in 76.8 degC .. 77.8 degC\n    wait 10 s\n    expect plate[A1].contents.temperature in 92.0 degC .. 93.0 degC";
    passes("wells", ", ThermocyclerGen2", asset, "50 uL", lines);
}

#[test]
fn a_lid_has_a_temperature_of_its_own() {
    let lines = "    heat lid cycler to 105 degC\n    wait until cycler.lid_temperature >= 60 degC\n    settle lid cycler\n    wait 5 min\n    expect cycler.lid_temperature in 104.5 degC .. 105.5 degC\n    \
                 stop heating lid cycler\n    wait 10 min\n    expect cycler.lid_temperature in 52 degC .. 53 degC";
    passes("lid", ", ThermocyclerGen2", "asset Cycled: ThermocyclerGen2 {}", "20 uL", lines);
}

/// A deck with a heater-shaker in place 1.
fn deck(lines: &str) -> String {
    format!(
        r#"mtx 1
use std::opentrons::{{Corning96, HeaterShaker, OT2, P300Multi, P300Single, Reservoir12, TemperatureModule, TipRack300}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 {{ left: P300Single, right: P300Multi }} at (0, 0, 0) m
    shaker = HeaterShaker on ot2.slot[1]
    plate = Corning96 on shaker
    behind = TipRack300 on ot2.slot[4]
    stock = Reservoir12 on ot2.slot[2] holding {{ A1: 5 mL of water }}
    tips = TipRack300 on ot2.slot[5]
}}
workflow w in deck {{
{lines}
}} finally {{ drop tip by ot2.left }}
"#
    )
}

#[test]
fn pipettes_keep_off_a_heater_shaker_as_the_robot_demands() {
    let cases = [
        (
            "open latch",
            "    pick up tip from tips by ot2.left\n    aspirate 50 uL from stock[A1] by ot2.left",
            Some("the latch of the shaker at or beside `stock[A1]` is open"),
        ),
        (
            "closed latch",
            "    close latch shaker\n    pick up tip from tips by ot2.left\n    aspirate 50 uL from stock[A1] by ot2.left\n    dispense 50 uL into plate[A1] by ot2.left",
            None,
        ),
        (
            "open on it",
            "    pick up tip from behind by ot2.left\n    move ot2.left to plate[A1]",
            Some("the latch of the shaker at or beside `plate[A1]` is open"),
        ),
        (
            "shaking",
            "    close latch shaker\n    shake shaker at 500 rpm\n    pick up tip from behind by ot2.left",
            Some("the shaker beside `behind` is running"),
        ),
        (
            "eight channels beside it",
            "    close latch shaker\n    pick up tip from tips by ot2.right\n    aspirate 50 uL from stock[A1] by ot2.right",
            Some("several channels would meet it"),
        ),
        (
            "stopped open",
            "    close latch shaker\n    shake shaker at 500 rpm\n    stop shaking shaker\n    open latch shaker\n    stop shaking shaker { anyway: true }",
            Some("its motor takes no command"),
        ),
    ];
    for (name, lines, said) in cases {
        let dir = folder(&format!("cyclers_deck_{}", name.replace(' ', "_")));
        write(&dir, "lab.mtx", deck(lines));
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        let text = flat(&ended.out);
        match said {
            Some(said) => assert!(ended.code == 1 && text.contains(said), "{name}: {}", ended.out),
            None => assert_eq!(ended.code, 0, "{name}: {}", ended.out),
        }
    }
    // Where the robot's software accepts no module.
    let dir = folder("cyclers_deck_static");
    let crowded = deck("    wait 1 s").replace("behind = TipRack300", "behind = TemperatureModule");
    write(&dir, "lab.mtx", crowded.replace(" finally { drop tip by ot2.left }", ""));
    let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
    assert!(flat(&ended.out).contains("refuses a module beside a heater-shaker"), "{}", ended.out);
}

#[test]
fn a_thermocycler_fills_four_places() {
    let text = |cycler: &str, steps: &str| {
        format!(
            r#"mtx 1
use std::opentrons::{{Corning96, OT2, ThermocyclerGen2}}
lab deck {{
    ambient: 22 degC
    ot2 = OT2 at (0, 0, 0) m
    cycler = ThermocyclerGen2 on ot2.slot[{cycler}]
    plate = Corning96 on ot2.slot[3]
}}
workflow w in deck {{ {steps} }}
"#
        )
    };
    let dir = folder("cyclers_places");
    let cases = [
        ("7", "relocate plate to ot2.slot[9]", None),
        ("7", "relocate plate to ot2.slot[8]", Some("the thermocycler fills the places 7, 8, 10 and 11")),
        ("1", "wait 1 s", Some("takes a thermocycler in place 7 only")),
    ];
    for (place, steps, said) in cases {
        write(&dir, "lab.mtx", text(place, steps));
        let ended = matterixc_in(&dir, &["check", "--strict", "lab.mtx"]);
        let found = flat(&ended.out);
        match said {
            Some(said) => assert!(ended.code == 1 && found.contains(said), "{place}: {}", ended.out),
            None => assert_eq!(ended.code, 0, "{place}: {}", ended.out),
        }
    }
}
