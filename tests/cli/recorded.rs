//! How much a run leaves on disk.

use std::fs;

use crate::harness::{folder, matterixc_in, write};

/// A plate of 96 wells on a block that goes through three temperatures, so many times.
const PCR: &str = "mtx 1
use std::opentrons::PcrPlate96
solution mix { DMSO: 1 %w/w, NaCl: 0.3 %w/w, water: rest }
asset Cycler: IntegratingHeater, Surface {
    mass: 9 kg
    capacity: 120 J/K
    air: 4 W/K
    gain: 60 W/K
    power: 500 W
    limits: 4 degC .. 99 degC
    shape: box(245 mm, 172 mm, 170 mm)
    frame place at (0, 0, 170) mm
}
lab bench {
    ambient: 22 degC
    cycler = Cycler at (0, 0, 0) m
    plate = PcrPlate96 on cycler holding { A1 .. H12: 25 uL of mix }
}
workflow amplify in bench {
    repeat CYCLES times {
        heat cycler to 95 degC
        wait 30 s
        heat cycler to 55 degC
        wait 30 s
        heat cycler to 72 degC
        wait 30 s
    }
} finally { stop heating cycler }
";

/// Bytes of the files that so many cycles leave.
fn left_by(cycles: u64) -> u64 {
    let dir = folder(&format!("recorded_pcr_{cycles}"));
    write(&dir, "pcr.mtx", PCR.replace("CYCLES", &cycles.to_string()));
    let ended = matterixc_in(&dir, &["run", "pcr.mtx", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let viewed = matterixc_in(&dir, &["view", "out", "--export", "page.html"]);
    assert_eq!(viewed.code, 0, "{}", viewed.err);
    let sizes = fs::read_dir(dir.join("out")).expect("a folder").map(|file| file.and_then(|f| f.metadata()));
    sizes.map(|file| file.expect("a file").len()).sum()
}

#[test]
fn a_pcr_of_96_wells_leaves_under_10_mb() {
    // The first cycle comes with the scene; the others leave the same each.
    let (first, more) = (left_by(1), left_by(3));
    let all = first + (more - first) / 2 * 29;
    assert!(all < 10_000_000, "{first} bytes of one cycle, {more} of three: {all} of thirty");
}
