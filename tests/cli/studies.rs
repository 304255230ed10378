//! Studies and fits: figures against closed forms, estimates against the truth, the same bytes on any number of threads.

use std::fs;
use std::path::Path;

use crate::harness::{folder, matterixc_in, root, write};

/// A decay of first order, whose solution is closed: amounts fall as `exp(-k t)`.
const DECAY: &str = r#"mtx 1

use std::glassware::Beaker250mL

species P { formula: "C2H4O2", density: 1 g/mL, specific_heat: 4 J/(g*K) }
species Q { formula: "C2H4O2", density: 1 g/mL, specific_heat: 4 J/(g*K) }

reaction decay: P -> Q {
    rate: 1e-3 1/s
    order: { P: 1 }
}

lab bench {
    ambient: 25 degC
    beaker = Beaker250mL at (0, 0, 0) m holding 10 g of water + 10 mmol of P
}

workflow watch(turns: Int, limit: Duration = 3000 s) in bench {
    repeat turns times { wait 500 s }
    wait until beaker.contents.amount[P] < 5 mmol timeout limit
}
"#;

fn table(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(path).expect("the table is there");
    let rows = reader.records().map(|r| r.expect("a row").iter().map(str::to_string).collect());
    rows.collect()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).expect("the figures are there")).expect("they are JSON")
}

#[test]
fn a_study_has_the_figures_of_its_closed_form() {
    let dir = folder("study_figures");
    let study = "
study linear of watch {
    vary beaker.initial[P] in 12 mmol .. 16 mmol by sobol
    vary turns in 0 .. 1 by grid(2)
    runs 128
    report all = (beaker.contents.amount[P] + beaker.contents.amount[Q]) as mmol
    report high = max_over_time(beaker.contents.amount[P]) as mmol
    report low = min_over_time(beaker.contents.amount[P]) as mmol
    report took = elapsed
}
";
    write(&dir, "decay.mtx", format!("{DECAY}{study}"));
    let ended = matterixc_in(&dir, &["study", "decay.mtx", "--out", "two", "--jobs", "2"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    assert!(ended.out.starts_with("study linear of watch in bench: 128 of 128 runs, seed 0\n"), "{}", ended.out);
    let one = matterixc_in(&dir, &["study", "decay.mtx", "--out", "one", "--jobs", "1"]);
    assert_eq!(one.out, ended.out);
    for file in ["study.csv", "study.json"] {
        let read = |out: &str| fs::read(dir.join(out).join(file)).expect("it was written");
        assert!(read("one") == read("two"), "{file} depends on the threads");
    }
    let figures = json(&dir.join("two/study.json"));
    let of = |name: &str, what: &str| {
        let reports = figures["reports"].as_array().expect("reports");
        reports.iter().find(|r| r["name"] == name).and_then(|r| r[what].as_f64()).expect("a figure")
    };
    // Evenly from 12 to 16: mean 14, deviation 4 / sqrt(12), quantiles in proportion.
    for name in ["all", "high"] {
        assert!((of(name, "mean") - 14.0).abs() < 0.02, "{}", of(name, "mean"));
        assert!((of(name, "std") - 4.0 / 12f64.sqrt()).abs() < 0.02, "{}", of(name, "std"));
        assert!((of(name, "q05") - 12.2).abs() < 0.05 && (of(name, "q95") - 15.8).abs() < 0.05);
    }
    let rows = table(&dir.join("two/study.csv"));
    let head = "run,seed,beaker.initial[P] [mmol],turns,all [mmol],high [mmol],low [mmol],took [s],outcome,fault";
    assert_eq!(rows[0].join(","), head);
    for (i, row) in rows[1..].iter().enumerate() {
        let number = |column: usize| row[column].parse::<f64>().expect("a number");
        assert_eq!((row[0].as_str(), row[1].as_str()), (i.to_string().as_str(), i.to_string().as_str()));
        // It ends when half of 10 mmol are left, or at once where a turn has brought it below.
        let (start, turns) = (number(2), number(3));
        let took = (1e3 * (start / 5.0).ln()).max(500.0 * turns);
        assert!((number(7) - took).abs() < 1e-3, "{row:?}: {took}");
        assert!((number(6) - start * (-took / 1e3).exp()).abs() < 1e-5, "{row:?}");
        assert_eq!((row[8].as_str(), row[9].as_str()), ("passed", ""));
    }
}

#[test]
fn a_run_that_fails_is_a_row() {
    let dir = folder("study_failures");
    let study = "
study timeouts of watch {
    vary limit in 500 s .. 1500 s by grid(5)
    vary turns in 0 .. 0.5 by grid(2)
    report took = elapsed
}
";
    write(&dir, "decay.mtx", format!("{DECAY}{}", study.replace("in 0 .. 0.5", "in 0 .. 1")));
    let ended = matterixc_in(&dir, &["study", "decay.mtx", "--out", "out", "--format", "json"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let rows = table(&dir.join("out/study.csv"));
    assert_eq!(rows.len(), 11);
    // ln 2 / k is 693 s: 500 s are too short unless a turn of 500 s came before.
    let row = |i: usize| rows[i].iter().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(row(1)[2..], ["500", "0", "", "failed", "timeout"]);
    assert_eq!((row(2)[2], row(2)[3], row(2)[5]), ("500", "1", "passed"));
    assert_eq!((row(10)[2], row(10)[3], row(10)[5]), ("1500", "1", "passed"));
    let figures: serde_json::Value = serde_json::from_str(&ended.out).expect("it is JSON");
    assert_eq!((&figures["failures"]["timeout"], &figures["outcomes"]["passed"]), (&1.into(), &9.into()));
    assert_eq!(figures["reports"][0]["count"], 9);

    let ended = matterixc_in(&dir, &["study", "decay.mtx", "--runs", "7"]);
    assert_eq!((ended.code, ended.out.as_str()), (2, ""));
    assert!(ended.err.contains("the grids of `timeouts` have 10 points"), "{}", ended.err);
    write(&dir, "half.mtx", format!("{DECAY}{study}"));
    let ended = matterixc_in(&dir, &["check", "half.mtx"]);
    assert!(ended.out.contains("`turns` must be a whole number, but these values are not"), "{}", ended.out);
}

/// Normal numbers by Box and Muller from SplitMix64.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((x ^ (x >> 31)) >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

#[test]
fn a_fit_finds_the_constant_behind_a_decay() {
    let dir = folder("fit_decay");
    let mut noise = Noise(5);
    // Every minute, out of order, one cell empty; 8 mmol at the start, k = 2e-3 1/s, noise 0.05 mmol.
    let mut rows: Vec<String> = (1..=30)
        .map(|i| {
            let value = 8.0 * (-2e-3 * 60.0 * f64::from(i)).exp() + 0.05 * noise.normal();
            if i == 7 { format!("{i},") } else { format!("{i},{value:.4}") }
        })
        .collect();
    rows.reverse();
    write(&dir, "data.csv", format!("# made up\ntime [min],left [mmol]\n{}\n", rows.join("\n")));
    let fit = |noise: &str| {
        format!(
            "{}
fit constant of rest {{
    data \"data.csv\"
    estimate decay.rate in 1e-4 1/s .. 1e-1 1/s log
    estimate beaker.initial[P] in 1 mmol .. 20 mmol
    match beaker.contents.amount[P] with \"left\" as mmol{noise}
}}
",
            DECAY.split("workflow").next().unwrap_or_default().to_string() + "workflow rest in bench { wait 1 h }\n"
        )
    };
    for (name, noise) in [("given", " noise 0.05 mmol"), ("learnt", "")] {
        write(&dir, "fit.mtx", fit(noise));
        let ended = matterixc_in(&dir, &["fit", "fit.mtx", "--out", name, "--jobs", "2"]);
        assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
        let found = json(&dir.join(name).join("fit.json"));
        assert_eq!((&found["values"], &found["degrees_of_freedom"]), (&29.into(), &27.into()));
        for (i, truth) in [2e-3, 8.0].into_iter().enumerate() {
            let e = &found["estimates"][i];
            let (value, error) = (e["value"].as_f64().expect("a value"), e["std_error"].as_f64().expect("an error"));
            assert!((value - truth).abs() < 3.0 * error && error < 0.02 * truth, "{name}: {value} +- {error}");
        }
        if name == "learnt" {
            let learnt = found["learnt_noise"].as_f64().expect("it is learnt");
            assert!((0.035..0.065).contains(&learnt), "{learnt}");
        }
        assert_eq!(table(&dir.join(name).join("residuals.csv")).len(), 30);
    }
}

#[test]
fn a_fit_says_what_one_temperature_cannot_tell() {
    let dir = folder("fit_examples");
    for file in ["sn1.mtx", "study_fit.mtx", "study_fit.csv"] {
        fs::copy(root().join("examples").join(file), dir.join(file)).expect("it can be copied");
    }
    let ended = matterixc_in(&dir, &["fit", "study_fit.mtx", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let found = json(&dir.join("out/fit.json"));
    for (i, truth) in [2.0021e9, 72.0].into_iter().enumerate() {
        let e = &found["estimates"][i];
        let (value, error) = (e["value"].as_f64().expect("a value"), e["std_error"].as_f64().expect("an error"));
        assert!((value - truth).abs() < 3.0 * error, "{value} +- {error}, not {truth}");
    }
    // The same with a first set point that is the second one: one temperature.
    let text = fs::read_to_string(dir.join("study_fit.mtx")).expect("it can be read");
    write(&dir, "one.mtx", text.replace("first: Temperature = 45 degC", "first: Temperature = 76 degC"));
    let ended = matterixc_in(&dir, &["fit", "one.mtx"]);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    let said = "the data do not determine `ethyl_iodide.rate.A` and `ethyl_iodide.rate.Ea` separately";
    assert!(ended.out.contains(said), "{}", ended.out);
}

#[test]
fn findings_point_at_paths_and_cells() {
    let dir = folder("study_findings");
    let check = |lines: &str| {
        write(
            &dir,
            "wrong.mtx",
            format!(
                "{DECAY}\nstudy s of watch {{\n    vary turns in 0 .. 1 by grid(2)\n    report took = elapsed\n    {lines}\n}}\n"
            ),
        );
        let found = matterixc_in(&dir, &["check", "wrong.mtx", "--format", "json"]).out_lines();
        let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
        found.iter().map(|l| format!("{}: {}", text(&l["code"]), text(&l["headline"]))).collect::<Vec<_>>()
    };
    for (lines, wanted) in [
        ("vary beaker.initial[Q] in 1 g .. 2 g", "unknown-parameter: unknown parameter `beaker.initial[Q]`"),
        ("vary decay.rat in 1 1/s .. 2 1/s", "unknown-parameter: unknown parameter `decay.rat`"),
        (
            "vary beaker.contents.temperature in 20 degC .. 30 degC",
            "cannot-vary: `beaker.contents.temperature` cannot vary: it changes during the run",
        ),
        ("vary beaker.initial[P] in -1 mmol .. 2 mmol", "out-of-range: `beaker.initial[P]` cannot be -1 mmol"),
        ("vary limit in 1 s .. 2 g", "unit-mismatch: Duration (s) cannot be compared with Mass (kg)"),
        ("vary limit in 2 s .. 1 s", "empty-range: this range is empty: its lower end is above its upper end"),
        ("runs 3", "unusable-number: the grids have 2 points: the number of runs must be a multiple of this"),
        ("report took = 1 s", "duplicate-name: `took` is reported twice"),
    ] {
        assert_eq!(check(lines), [wanted], "{lines}");
    }
    assert_eq!(check("vary limit in 1 s .. 2 s by normal(1.5 s, 0.1 s)\n    runs 4"), [] as [&str; 0]);
}

/// What a study reports of a whole run: of quantities that come and go between two steps of the solver, that jump, that follow the clock.
const OVER_TIME: &str = r#"mtx 1

capability Moves: Body {
    state x: Ratio = 0
    state y: Ratio = 1
    state kicked: Ratio = 0
    process even { x' += 1 / 1 s }
    process decays { y' -= 0.01 * y / 1 s }
    process pushed while kicked > 0 { y' += 1 / 1 s }
    event kick when x >= 500 { kicked = 1 }
    event stop when x >= 510 { kicked = 0 }
}
asset Thing: Moves { mass: 1 kg }

lab bench {
    ambient: 25 degC
    a = Thing at (0, 0, 0) m
    b = Thing at (1, 0, 0) m
}

workflow watch(t: Duration) in bench { wait t }

study s of watch {
    vary t in 900 s .. 1000 s by grid(2)
    report bell = max_over_time(exp(-((a.x - 300) / 10) ^ 2))
    report mean_bell = mean_over_time(exp(-((a.x - 300) / 10) ^ 2))
    report square = mean_over_time(a.x ^ 2)
    report product = max_over_time(a.x * (1000 - b.x))
    report wave = mean_over_time(sin(elapsed / 1 s * 1 rad) ^ 2)
    report peak = max_over_time(a.y)
    report least = min_over_time(a.y)
    report mean_y = mean_over_time(a.y)
    report share = mean_over_time(choose(a.x > 100, 1, 0))
    report none = mean_over_time(sqrt(500 - a.x))
}
"#;

#[test]
fn what_is_reported_over_time_is_that_of_the_whole_run() {
    let dir = folder("over_time");
    let file = write(&dir, "over_time.mtx", OVER_TIME);
    let out = dir.join("out");
    let done = matterixc_in(root(), &["study", &file, "--out", out.to_str().expect("a name")]);
    assert_eq!(done.code, 0, "{}", done.err);
    let rows = table(&out.join("study.csv"));
    let (t, e) = (900.0_f64, f64::exp);
    // Decays up to 500 s, is pushed for 10 s, and decays again.
    let (y500, y510) = (e(-5.0), 100.0 + (e(-5.0) - 100.0) * e(-0.1));
    let total =
        100.0 * (1.0 - y500) + 1000.0 + 100.0 * (y500 - 100.0) * (1.0 - e(-0.1)) + 100.0 * y510 * (1.0 - e(-3.9));
    let expected = [
        ("bell", 1.0),
        ("mean_bell", 10.0 * std::f64::consts::PI.sqrt() / t),
        ("square", t * t / 3.0),
        ("product", 250_000.0),
        ("wave", 0.5 - (2.0 * t).sin() / (4.0 * t)),
        ("peak", y510),
        ("least", y500),
        ("mean_y", total / t),
        ("share", 800.0 / 900.0),
    ];
    for (name, value) in expected {
        let column = rows[0].iter().position(|head| head == name).expect("a column");
        let found: f64 = rows[1][column].parse().expect("a number");
        assert!((found / value - 1.0).abs() < 1e-7, "{name}: {found} instead of {value}");
    }
    let none = rows[0].iter().position(|head| head == "none").expect("a column");
    assert_eq!(rows[1][none], "", "the root of what falls below zero has no mean");
}
