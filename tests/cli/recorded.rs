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

/// A PCR has 30 cycles, which take the same each.
const OF_THE_WHOLE: u64 = 15;

#[test]
fn a_pcr_of_96_wells_leaves_under_10_mb() {
    let dir = folder("recorded_pcr");
    write(&dir, "pcr.mtx", PCR.replace("CYCLES", &(30 / OF_THE_WHOLE).to_string()));
    let ended = matterixc_in(&dir, &["run", "pcr.mtx", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let bytes = |name: &str| fs::metadata(dir.join("out").join(name)).expect("it was written").len();
    let growing = bytes("recording.mcap") + bytes("states.parquet");
    let rest = bytes("plot.svg") + bytes("report.json");
    assert!(growing * OF_THE_WHOLE + rest < 10_000_000, "{growing} bytes, and {rest}");
    assert!(!dir.join("out/states.csv").exists());
    let all = folder("recorded_pcr_page").join("page.html").display().to_string();
    let viewed = matterixc_in(&dir, &["view", "out", "--export", &all]);
    assert_eq!(viewed.code, 0, "{}", viewed.err);
}
