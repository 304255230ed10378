//! A long protocol on one plate: 96 wells, three racks of tips, loops in loops, and lines for single wells. It has no
//! findings; its plan has about 1,400 operations.

use std::fmt::Write;

/// Rows of the plate, as they are labelled.
const ROWS: &str = "ABCDEFGH";

/// Columns of the plate.
const COLUMNS: usize = 12;

/// The program, about 500 lines.
pub fn program() -> String {
    let mut out = String::from(HEAD);
    for row in ROWS.chars() {
        let _ = writeln!(out, "    step sample_{} {{", row.to_ascii_lowercase());
        for column in 1..=COLUMNS {
            well(&mut out, row, column);
        }
        out.push_str("    }\n");
        total(&mut out, row);
    }
    out.push_str(TAIL);
    out
}

/// What is done to a single well: a sample goes in and is mixed, and what comes of it is looked at.
fn well(out: &mut String, row: char, column: usize) {
    let sample = 1 + column % 4;
    let volume = 20 + column;
    let rack = if row < 'E' { "second" } else { "third" };
    let _ = write!(
        out,
        "        // Sample {sample} into {row}{column}.
        transfer {volume} uL from tubes[A{sample}] to plate[{row}{column}] by ot2.left using {rack} {{ tips: each, mix_after: 2, mix_volume: 40 uL }}
        wait {} s
        expect plate[{row}{column}].contents.volume in {} uL .. {} uL
",
        1 + column % 3,
        119 + column,
        121 + column,
    );
}

/// What a row holds together.
fn total(out: &mut String, row: char) {
    let name = row.to_ascii_lowercase();
    let number = 1 + ROWS.find(row).unwrap_or(0);
    let _ = write!(
        out,
        "    let total_{name} = sum(w in plate.row({number}): w.contents.volume)
    if total_{name} < 1.5 mL {{
        note \"row {name} holds less than expected\"
    }}
    expect total_{name} in 1.51 mL .. 1.52 mL
"
    );
}

/// A program of 500 lines with as many wells, most of its 600 operations in loops over rows and columns; every well is looked at
/// by itself.
pub fn rows() -> String {
    let mut out = String::from(ROWS_HEAD);
    for row in ROWS.chars() {
        let name = row.to_ascii_lowercase();
        let _ = writeln!(out, "    // Row {row}, from left to right.\n    step read_{name} {{");
        for column in 1..=COLUMNS {
            let _ = write!(
                out,
                "        // Well {row}{column}.
        wait {} s
        expect plate[{row}{column}].contents.volume in 69 uL .. 71 uL
        let v_{name}{column} = plate[{row}{column}].contents.volume
",
                1 + column % 3,
            );
        }
        let _ = writeln!(out, "        note \"row {name} is read\"\n    }}");
    }
    for (index, row) in ROWS.to_lowercase().chars().enumerate() {
        let _ = write!(
            out,
            "    // What the row holds together.
    let total_{row} = sum(w in plate.row({}): w.contents.volume)
    if total_{row} < 0.8 mL {{
        note \"row {row} holds less than expected\"
    }}
    expect total_{row} in 0.83 mL .. 0.85 mL
",
            index + 1,
        );
    }
    out.push_str("}\n");
    out
}

const ROWS_HEAD: &str = "mtx 1
//! Generated: a stain in every well of a plate, row by row and column by column.

use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300}

species dye { by: mass, density: 1 g/mL, specific_heat: 4 J/(g*K) }

solution buffer { NaCl: 0.9 %w/w, water: rest }
solution stain { dye: 0.1 %w/w, buffer: rest }

lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    first = TipRack300 on ot2.slot[1]
    second = TipRack300 on ot2.slot[4]
    plate = Corning96 on ot2.slot[2]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 14 mL of buffer, A2: 8 mL of stain }
}

workflow screen in deck {
    // A fresh tip for each well: what is in it must not get into the buffer.
    for row in plate.rows {
        for well in row {
            transfer 50 uL from stock[A1] to well by ot2.left using first { tips: each }
        }
    }
    // One tip for each column: the wells hold the same.
    for column in plate.columns {
        pick up tip from second by ot2.left
        for well in column {
            aspirate 20 uL from stock[A2] by ot2.left
            dispense 20 uL into well by ot2.left
        }
        drop tip by ot2.left
    }
";

const HEAD: &str = "mtx 1
//! Generated: samples on a plate with a dilution series in each row.

use std::opentrons::{Corning96, OT2, P300Single, Reservoir12, TipRack300, TubeRack24}

/// A dye of unknown structure, counted by mass.
species dye { by: mass, density: 1 g/mL, specific_heat: 4 J/(g*K) }

solution buffer { NaCl: 0.9 %w/w, water: rest }
solution stain { dye: 0.1 %w/w, buffer: rest }

lab deck {
    ambient: 22 degC
    ot2 = OT2 { left: P300Single } at (0, 0, 0) m
    first = TipRack300 on ot2.slot[1]
    second = TipRack300 on ot2.slot[4]
    third = TipRack300 on ot2.slot[7]
    plate = Corning96 on ot2.slot[2]
    stock = Reservoir12 on ot2.slot[3] holding { A1: 14 mL of buffer, A2: 3 mL of stain }
    tubes = TubeRack24 on ot2.slot[5] holding { A1: 1.5 mL of EtOH, A2: 1.5 mL of MeOH, A3: 1.5 mL of iPrOH, A4: 1.5 mL of DMSO }
}

workflow screen in deck {
    step fill {
        transfer 100 uL from stock[A1] to plate[A1 .. H12] by ot2.left using first { tips: once }
        transfer 100 uL from stock[A2] to plate[A1 .. H1] by ot2.left using first { tips: once }
    }
    step dilute {
        for row in plate.rows {
            pick up tip from first by ot2.left
            for pair in row.pairs {
                aspirate 100 uL from pair.first by ot2.left
                dispense 100 uL into pair.second by ot2.left
                mix pair.second by ot2.left { times: 3, volume: 80 uL }
            }
            aspirate 100 uL from row.last by ot2.left
            dispense 100 uL into ot2.trash[A1] by ot2.left
            drop tip by ot2.left
        }
    }
    step stir {
        for column in plate.columns {
            pick up tip from first by ot2.left
            for well in column {
                mix well by ot2.left { times: 2, volume: 50 uL, carryover: true }
            }
            drop tip by ot2.left
        }
    }
";

const TAIL: &str = "    for well in plate.wells { expect well.contents.volume in 119 uL .. 134 uL }
    for pair in plate.row(8).pairs {
        expect (pair.second.contents[dye] as g/L) < (pair.first.contents[dye] as g/L)
    }
    expect elapsed > 1 h
}
";
