//! Labs of any size: what is in them has nothing to do with each other, touches one thing, or stands in a row.

use std::fmt::Write;

/// A kind of lab, what it is, and the sizes that it is measured at.
pub struct Kind {
    pub name: &'static str,
    pub text: &'static str,
    pub program: fn(usize) -> String,
    pub sizes: &'static [usize],
}

/// All of them.
pub const KINDS: [Kind; 8] = [
    Kind {
        name: "beakers",
        text: "heated beakers, each on its own hotplate",
        program: beakers,
        sizes: &[10, 100, 1000],
    },
    Kind { name: "block", text: "vials on one heated block", program: block, sizes: &[12, 96, 384] },
    Kind {
        name: "chain",
        text: "beakers in a row with a pump between each two",
        program: chain,
        sizes: &[10, 30, 100],
    },
    Kind { name: "plates", text: "plates filled well by well", program: plates, sizes: &[1, 2, 4, 8] },
    Kind {
        name: "modules",
        text: "wells filled one by one on a temperature module",
        program: modules,
        sizes: &[96, 192, 384],
    },
    Kind {
        name: "titrations",
        text: "carbonate solutions, into each of which acid flows, at equilibrium",
        program: titrations,
        sizes: &[6, 24, 96],
    },
    Kind {
        name: "wells",
        text: "wells of a plate titrated in twelve strokes each, at equilibrium",
        program: wells,
        sizes: &[6, 24, 96],
    },
    Kind { name: "species", text: "species with twice as many reactions", program: species, sizes: &[10, 100, 1000] },
];

/// Beakers of water, each on its own hotplate, heated for half an hour.
fn beakers(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n\nlab bench {\n    ambient: 22 degC\n",
    );
    for i in 0..count {
        let (x, y) = (400 * (i % 40), 400 * (i / 40));
        let _ = writeln!(out, "    plate{i} = IkaRetControl at ({x}, {y}, 0) mm");
        let _ = writeln!(out, "    beaker{i} = Beaker250mL on plate{i} holding {} g of water", 100 + i % 50);
    }
    out.push_str("}\n\nworkflow warm in bench {\n");
    for i in 0..count {
        let _ = writeln!(out, "    heat plate{i} to {} degC", 50 + i % 30);
    }
    out.push_str("    wait 30 min\n");
    for i in 0..count {
        let _ = writeln!(out, "    stop heating plate{i}");
    }
    out.push_str("}\n");
    out
}

/// Solutions of sodium carbonate, into each of which acid runs until it is in excess.
fn titrations(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::equilibria\nuse std::glassware::Beaker250mL\n\n\
        capability Burette: Body {\n    param source: Container\n    param sink: Container\n    \
        process flow while elapsed >= 1 s and elapsed < 101 s { move(0.25 mL/s, from: source, to: sink) }\n}\n\n\
        asset Feeder: Burette { mass: 1 kg }\n\nlab bench {\n    ambient: 25 degC\n",
    );
    for i in 0..count {
        let soda = 8.0 + i as f64 * 0.01;
        let _ =
            writeln!(out, "    soda{i} = Beaker250mL at ({i}, 0, 0) m holding 100 g of water + {soda} mmol of Na2CO3");
        let _ = writeln!(out, "    acid{i} = Beaker250mL at ({i}, 1, 0) m holding 100 g of water + 90 mmol of HCl");
        let _ = writeln!(out, "    burette{i} = Feeder {{ source: acid{i}, sink: soda{i} }} at ({i}, 2, 0) m");
    }
    out.push_str("}\n\nworkflow titrate in bench {\n    wait 101 s\n");
    for i in 0..count {
        let _ = writeln!(out, "    expect acidity(soda{i}.contents) in 1 .. 4");
    }
    out.push_str("}\n");
    out
}

/// Vials on a block that is heated and cools again.
fn block(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::heating::IkaRetControl\nuse std::vials::Vial8mL\n\nlab bench {\n    ambient: 22 degC\n",
    );
    let _ = writeln!(out, "    plate = IkaRetControl {{ spots: {count} }} at (0, 0, 0) mm");
    for i in 0..count {
        let _ = writeln!(out, "    vial{i} = Vial8mL on plate holding {} mL of water", 2 + i % 4);
    }
    out.push_str("}\n\nworkflow cycle in bench {\n    repeat 5 times {\n");
    out.push_str("        heat plate to 60 degC\n        wait 10 min\n        stop heating plate\n        wait 10 min\n    }\n}\n");
    out
}

/// Beakers in a row; all pumps run at once.
fn chain(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::glassware::Beaker250mL\nuse std::pumps::PeristalticPump\n\nasset Peri: PeristalticPump { mass: 1 kg, fastest: 2 mL/s }\n\nlab bench {\n    ambient: 22 degC\n",
    );
    for i in 0..count {
        let _ = writeln!(out, "    cup{i} = Beaker250mL at ({}, 0, 0) mm holding 100 mL of water", 300 * i);
    }
    for i in 1..count {
        let _ =
            writeln!(out, "    pump{i} = Peri {{ source: cup{}, sink: cup{i} }} at ({}, 500, 0) mm", i - 1, 300 * i);
    }
    out.push_str("}\n\nworkflow pass_on in bench {\n    parallel {\n");
    for i in 1..count {
        let _ = writeln!(out, "        pump 20 mL at {} mL/min by pump{i}", 10 + i % 7);
    }
    out.push_str("    }\n    wait 1 min\n}\n");
    out
}

/// Plates whose wells are filled one by one.
fn plates(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::opentrons::{Corning96, OT2, P300Single, Reservoir1, TipRack300, TrashBin}\n\nlab deck {\n    ambient: 22 degC\n    ot2 = OT2 { left: P300Single } at (0, 0, 0) m\n",
    );
    out.push_str("    tips = TipRack300 on ot2.slot[10]\n    stock = Reservoir1 on ot2.slot[11] holding { A1: 180 mL of water }\n");
    for i in 0..count {
        let _ = writeln!(out, "    plate{i} = Corning96 on ot2.slot[{}]", i + 1);
    }
    out.push_str("}\n\nworkflow fill in deck {\n");
    for i in 0..count {
        let _ = writeln!(
            out,
            "    transfer {} uL from stock[A1] to plate{i}[A1 .. H12] by ot2.left using tips {{ tips: once }}",
            100 + i
        );
    }
    out.push_str("}\n");
    out
}

/// Wells on a temperature module, filled one by one.
fn modules(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::opentrons::{OT2, P20Single, Reservoir12, TemperatureModule, TipRack20}\n\nasset Plate384 from labware \"corning_384_wellplate_112ul_flat/2\"\n\nlab deck {\n    ambient: 22 degC\n    ot2 = OT2 { left: P20Single } at (0, 0, 0) m\n",
    );
    out.push_str("    cold = TemperatureModule on ot2.slot[3]\n    plate = Plate384 on cold\n    tips = TipRack20 on ot2.slot[1]\n");
    out.push_str(
        "    stock = Reservoir12 on ot2.slot[6] holding { A1: 10 mL of water }\n}\n\nworkflow fill in deck {\n",
    );
    out.push_str("    heat cold to 37 degC\n    settle cold\n    pick up tip from tips by ot2.left\n");
    let _ = writeln!(out, "    for w in plate.wells[0 .. {}] {{", count - 1);
    out.push_str(
        "        aspirate 10 uL from stock[A1] by ot2.left\n        dispense 10 uL into w by ot2.left\n    }\n",
    );
    out.push_str("    drop tip by ot2.left\n    stop heating cold\n}\n");
    out
}

/// Wells of sodium carbonate, each titrated by a pipette until acid is in excess.
fn wells(count: usize) -> String {
    let mut out = String::from(
        "mtx 1\nuse std::equilibria\nuse std::opentrons::{Corning96, OT2, P20Single, Reservoir1, TipRack20, TrashBin}\n\nsolution acid { HCl: 0.1 mol/L, water: rest }\nsolution soda { Na2CO3: 0.08 mol/L, water: rest }\n\nlab deck {\n    ambient: 25 degC\n    ot2 = OT2 { left: P20Single } at (0, 0, 0) m\n",
    );
    out.push_str("    tips = TipRack20 on ot2.slot[1]\n    stock = Reservoir1 on ot2.slot[2] holding { A1: 150 mL of acid }\n    plate = Corning96 on ot2.slot[3] holding { A1 .. H12: 100 uL of soda }\n}\n\n");
    out.push_str("workflow titrate in deck {\n    pick up tip from tips by ot2.left\n");
    for i in 0..count {
        let well = format!("plate[{}{}]", char::from(b'A' + (i % 8) as u8), i / 8 + 1);
        let _ = writeln!(
            out,
            "    repeat 12 times {{ aspirate 20 uL from stock[A1] by ot2.left, dispense 20 uL into {well} by ot2.left }}"
        );
        let _ = writeln!(out, "    expect acidity({well}.contents) in 1 .. 4");
    }
    out.push_str("    drop tip by ot2.left\n}\n");
    out
}

/// Isomers in one beaker, each of which turns into two others.
fn species(count: usize) -> String {
    let mut out = String::from("mtx 1\nuse std::glassware::Beaker250mL\n\n");
    for i in 0..count {
        let _ = writeln!(
            out,
            "species S{i} {{ formula: \"C6H12O6\", molar_volume: 110 mL/mol, heat_capacity: 220 J/(mol*K) }}"
        );
    }
    for i in 0..count {
        for (kind, other) in [("a", (i + 1) % count), ("b", (7 * i + 3) % count)] {
            if other != i {
                let rate = 0.001 * (1 + (13 * i + other) % 97) as f64;
                let _ =
                    writeln!(out, "reaction {kind}{i}: S{i} -> S{other} {{ rate: {rate} 1/s, order: {{ S{i}: 1 }} }}");
            }
        }
    }
    out.push_str("\nlab bench {\n    ambient: 25 degC\n    beaker = Beaker250mL at (0, 0, 0) m holding 100 g of water + 10 mmol of S0\n}\n");
    out.push_str("\nworkflow react in bench {\n    wait 10 min\n}\n");
    out
}
