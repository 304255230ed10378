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

/// The first value of a column of the states.
fn first_of(states: &str, column: &str) -> f64 {
    let mut lines = states.lines();
    let head = lines.next().expect("a head");
    let at = head.split(',').position(|name| name.trim_matches('"') == column).expect("the column is there");
    let first = lines.filter_map(|line| line.split(',').nth(at)).find(|cell| !cell.is_empty());
    first.expect("a value").parse().expect("a number")
}

#[test]
fn a_recording_begins_with_what_is_there_once_salts_are_ions() {
    let dir = folder("recorded_first");
    let text = "mtx 1
use std::glassware::Beaker50mL
solution saline { NaCl: 0.9 %w/w, water: rest }
lab bench { ambient: 22 degC, cup = Beaker50mL at (0, 0, 0) m holding 10 mL of saline }
workflow rest in bench { wait 10 s }
study seen of rest {
    vary cup.initial[saline] in 9 mL .. 10 mL
    runs 2
    report most = max_over_time(cup.contents.volume) as mL
    report now = cup.contents.volume as mL
}
";
    write(&dir, "a.mtx", text);
    let ended = matterixc_in(&dir, &["run", "a.mtx", "--out", "out", "--csv"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let states = fs::read_to_string(dir.join("out/states.csv")).expect("a table");
    let volume = first_of(&states, "cup.contents.volume [mL]");
    assert!((volume - 10.0).abs() < 1e-6, "{volume}");
    let salt = first_of(&states, "cup.contents.amount[Na+] [mmol]");
    assert!(salt > 1.0, "{salt}");
    // What is kept over the time of a run begins there too.
    let ended = matterixc_in(&dir, &["study", "a.mtx", "--out", "many"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let table = fs::read_to_string(dir.join("many/study.csv")).expect("a table");
    let (most, now) = (first_of(&table, "most [mL]"), first_of(&table, "now [mL]"));
    assert!(now > 8.9 && (most - now).abs() < 1e-6, "{most} {now}");
}
