//! Mistakes that would otherwise pass in silence or show later as something else.

use crate::harness::{folder, matterixc_in, write};
use crate::slips::{self, findings};

const BENCH: &str = "
use std::heating::IkaRetControl
use std::glassware::Beaker50mL
relation piped(a: Body, b: Body)
unit stride: Length = 2 pace
unit pace: Length = 0.4 m
reaction ferment: EtOH + HI -> EtI + H2O {
    rate: 0.01 kg/(mol*s)
    order: { EtOH: 1, HI: 1 }
    requires: temperature > 20 degC and self[HI] > 1 mmol/kg
}
skill go(a: Body, b: Body) to(c: Body, n: Int = 2) { repeat n times { wait 1 s } }
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker50mL on plate holding 20 g of water + 10 mmol of EtOH + 10 mmol of HI
    between plate and cup { conductance: 3 W/K, piped: true }
}
workflow w(n: Int = 2) in bench {
    let first = 1 stride
    for t in [1 s, 2 s] { wait t }
    go (cup, plate) to (cup, n)
    sequence { wait until elapsed > 1 s timeout 1 min } on timeout { wait 1 s } on failure { wait 2 s }
    expect piped(plate, cup) and first > 0.7 m
}
";

#[test]
fn each_slip_is_one_finding() {
    assert_eq!(findings("none", BENCH), [] as [&str; 0]);
    let slips = [
        ("ring", "= 0.4 m", "= 0.5 stride", "circular: the unit `stride` is defined by itself"),
        ("bound", "conductance: 3", "conductance: -3", "out-of-range: `conductance` cannot be -3 W/K"),
        ("relation", "piped: true", "piped: 3", "type-mismatch: `piped` expects a truth value, found a plain number"),
        ("order", "HI: 1 }", "NaCl: 1 }", "unknown-field: the equation of `ferment` does not contain `NaCl`"),
        ("requires", "{\n    rate", "{ // a note\n    rate", ""),
        ("member", "requires: temp", "requires: tmep", "unknown-name: unknown name `tmeperature`"),
        ("whole", "n: Int = 2) in", "n: Int = 2.5) in", "type-mismatch: `n` expects a whole number, found 2.5"),
        ("hidden", "let first", "let cup", "duplicate-name: the lab already has the name `cup`"),
        (
            "loop",
            "for t in [1 s, 2 s] { wait t }",
            "for cup in [1 s] { wait cup }",
            "duplicate-name: the lab already has the name `cup`",
        ),
        ("list", "[1 s, 2 s]", "[1 s, 2 kg]", "unit-mismatch: a list of Duration (s) cannot hold Mass (kg)"),
        ("kinds", "[1 s, 2 s]", "[cup, 2 s]", "type-mismatch: a list of an instance cannot hold Duration (s)"),
        ("handlers", "on failure", "on timeout", "duplicate-name: `timeout` has two handlers here"),
        ("one", "go (cup, plate)", "go cup", "wrong-arguments: `go` takes 2 values here, found an instance"),
        ("three", "go (cup, plate)", "go (cup, cup, cup)", "wrong-arguments: `go` takes 2 values here, found 3 values"),
    ];
    slips::each("bench", BENCH, &slips, slips::first);
}

#[test]
fn values_are_shown_as_they_were_typed() {
    let dir = folder("strict_typed");
    write(&dir, "bench.mtx", format!("mtx 1\n{BENCH}"));
    for (typed, wanted) in [("n=2.5", "n=2.5"), ("n=3 +", "n=3 +"), ("m=3", "`w` has no parameter `m`")] {
        let ended = matterixc_in(&dir, &["run", "bench.mtx", "--set", typed]);
        assert!(
            ended.code == 1 && ended.err.contains(wanted) && !ended.err.contains("const"),
            "{typed}: {}",
            ended.err
        );
    }
}

#[test]
fn modules_are_files_below_the_folder_of_the_first() {
    let dir = folder("strict_modules");
    std::fs::create_dir_all(dir.join("parts/deep")).expect("folders can be created");
    write(&dir, "parts/labs.mtx", "mtx 1\nuse parts::deep::units::span\nlab bench { ambient: 22 degC, width: span }\n");
    write(&dir, "parts/deep/units.mtx", "mtx 1\nconst span: Length = 2 m\n");
    let main = "mtx 1\nuse parts::labs::bench\nworkflow w in bench { expect width == 2 m }\n";
    write(&dir, "main.mtx", main);
    let ended = matterixc_in(&dir, &["run", "main.mtx"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    for (from, to, wanted) in [
        ("parts::labs::bench", "parts::lbas::bench", "unknown module `parts::lbas`"),
        ("parts::labs::bench", "parts::labs::bnech", "`parts::labs` declares no `bnech`"),
    ] {
        write(&dir, "main.mtx", main.replace(from, to));
        let ended = matterixc_in(&dir, &["check", "main.mtx"]);
        assert!(ended.out.contains(wanted), "{}", ended.out);
    }
}
