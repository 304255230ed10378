//! Steps that run beside each other: what meets in one order of them and not in another, in `check` and in the run; what is left on
//! along one way; circles of claims and uses of one thing, however many there are.

use crate::harness::{folder, matterixc, matterixc_in, pass_cases, run_case, write};

/// Code, severity and line of every finding of a check.
fn findings(name: &str, text: &str) -> Vec<(String, String, u64)> {
    let path = write(&folder(&format!("orders_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    let line = |v: &serde_json::Value| v["span"]["start"]["line"].as_u64().unwrap_or_default();
    lines.iter().map(|l| (text(&l["code"]), text(&l["severity"]), line(l))).collect()
}

/// Acid in `a`, cyanide in `c`, water in `b` and `r`; the steps begin on line 17.
fn vessels(steps: &str) -> String {
    format!(
        "mtx 1
use std::glassware::Beaker250mL
capability Shifter: Body {{ command shift(v: Volume) from(x: Container) to(y: Container)
 effect move(v, from: x, to: y) }}
asset Pump1: Shifter {{ mass: 1 kg }}
lab bench {{
    ambient: 22 degC
    p = Pump1 at (0, 1, 0) m
    q = Pump1 at (0, 2, 0) m
    a = Beaker250mL at (0, 0, 0) m holding 90 g of water + 20 g of HCl
    b = Beaker250mL at (1, 0, 0) m holding 25 g of water
    c = Beaker250mL at (2, 0, 0) m holding 50 g of water + 5 g of NaCN
    d = Beaker250mL at (3, 0, 0) m
    r = Beaker250mL at (4, 0, 0) m holding 200 g of water
}}
workflow w in bench {{
{steps}
}}
"
    )
}

const MIX: &str = "incompatible-mix";

fn mixes(name: &str, steps: &str) -> Vec<(String, u64)> {
    let all = findings(name, &vessels(steps));
    all.into_iter().filter(|f| f.0 == MIX).map(|(_, severity, line)| (severity, line)).collect()
}

#[test]
fn what_meets_in_one_order_of_steps_is_a_warning() {
    // Neither branch first brings acid to the cyanide: the steps of both in turn do.
    let steps = "parallel {
 step one { wait until r.contents.volume < 195 mL timeout 1 h
   shift 20 mL from a to b by p
   wait until r.contents.volume < 185 mL timeout 1 h
   shift 5 mL from d to c by p }
 step two { shift 10 mL from r to d by q
   wait until b.contents.volume > 30 mL timeout 1 h
   shift 20 mL from b to d by q
   shift 10 mL from r to d by q }
}";
    assert_eq!(mixes("in_turn", steps), [("warning".to_owned(), 21)]);
}

#[test]
fn what_meets_in_every_order_is_an_error() {
    let job = "start j = { wait 10 min; shift 20 mL from b to c by p }\nshift 50 mL from a to b by q\nawait j";
    assert_eq!(mixes("job", job), [("error".to_owned(), 17)]);
}

#[test]
fn what_times_awaits_and_claims_exclude_is_no_finding() {
    let later = "parallel {
 step one { wait 10 min; shift 20 mL from a to b by p }
 step two { shift 20 mL from b to c by q }
}";
    assert_eq!(mixes("later", later), []);
    let after = "start j = { shift 20 mL from b to c by q }\nawait j\nshift 20 mL from a to b by p";
    assert_eq!(mixes("after", after), []);
    let claimed = "parallel {
 step one { claim b { shift 5 mL from a to b by p; shift 5 mL from b to d by p; shift 25 mL from b to d by p } }
 step two { claim b { shift 5 mL from r to b by q } }
}";
    assert_eq!(mixes("claimed", claimed), []);
}

#[test]
fn what_a_handler_finds_halfway_counts() {
    let steps = "sequence {
  shift 20 mL from a to b by p
  wait until r.contents.volume < 1 mL timeout 1 h
  shift 45 mL from b to d by p
} on timeout { shift 5 mL from b to c by p }";
    let all = mixes("handler", steps);
    assert_eq!(all, [("error".to_owned(), 21)]);
}

#[test]
fn turns_of_a_loop_are_followed_until_they_bring_nothing_new() {
    let steps = "repeat while elapsed < 9 s max 20 {
shift 1 mL from r to c by p
shift 1 mL from d to r by p
shift 1 mL from b to d by p
shift 1 mL from a to b by p
wait 1 s
}";
    let all = mixes("loop", steps);
    assert_eq!(all.len(), 1, "{all:?}");
}

#[test]
fn the_run_screens_what_is_there() {
    let steps = "parallel {
 step one { wait until r.contents.volume > 1 mL timeout 1 h; claim b { shift 20 mL from a to b by p } }
 step two { wait until r.contents.volume > 1 mL timeout 1 h; claim b { shift 20 mL from b to c by q } }
}";
    let dir = folder("orders_run");
    let path = write(&dir, "bench.mtx", vessels(steps));
    let out = dir.join("out");
    let ended = matterixc(&["run", &path, "--out", &out.display().to_string()]);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    let report = std::fs::read_to_string(out.join("report.json")).expect("the report is written");
    let report: serde_json::Value = serde_json::from_str(&report).expect("the report is JSON");
    assert_eq!(report["status"], "failed");
    assert_eq!(report["failure"]["name"], "incompatible_mix");
    assert!(report["failure"]["trace"].as_array().is_some_and(|t| t.iter().any(|s| s["line"] == 19)), "{report:#}");
    assert!(ended.err.contains("error[incompatible-mix]"), "{}", ended.err);
    // What is allowed is meant in the run, too.
    let allowed = vessels(steps).replacen("lab bench", "allow incompatible NaCN with HCl \"in a hood\"\nlab bench", 1);
    let path = write(&dir, "allowed.mtx", allowed);
    let ended = matterixc(&["run", &path]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
}

/// How a run of some text ended: exit status, report.
fn ran(name: &str, text: &str) -> (i32, serde_json::Value) {
    let path = write(&folder(&format!("orders_{name}_run")), "bench.mtx", text);
    let ended = matterixc(&["run", &path, "--format", "json"]);
    let report = serde_json::from_str(&ended.out).unwrap_or_else(|e| panic!("{name}: {e}: {}{}", ended.out, ended.err));
    (ended.code, report)
}

#[test]
fn what_must_not_meet_is_a_failure_that_a_handler_takes() {
    let steps = "parallel {
 step one { wait until r.contents.volume > 1 mL timeout 1 h; claim b { shift 20 mL from a to b by p } }
 step two { wait until r.contents.volume > 1 mL timeout 1 h; claim b { shift 20 mL from b to c by q } }
} on incompatible_mix { note \"kept apart\" }";
    let (code, report) = ran("handled", &vessels(steps));
    assert_eq!((code, &report["status"]), (0, &"passed".into()), "{report:#}");
    // The step that would mix them is not carried out.
    let other = steps.replace("on incompatible_mix", "on broken");
    let (code, report) = ran("not_handled", &vessels(&other));
    assert_eq!((code, &report["failure"]["name"]), (1, &"incompatible_mix".into()), "{report:#}");
    // It is known to be a failure.
    assert_eq!(findings("handled", &vessels(steps)), []);
}

/// A plate that warms water; the hazard looks at the water's temperature, which only a run knows.
fn reheated(line: &str, end: &str) -> String {
    format!(
        "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
{line}
lab bench {{
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 100 g of water
}}
workflow warm in bench {{
    heat plate to 50 degC
    wait until plate.temperature >= 40 degC timeout 1 h
    wait 20 min
    heat plate to 60 degC
    wait 1 min
}} {end} finally {{ stop heating plate }}
"
    )
}

#[test]
fn hazards_of_a_run_are_failures_and_cautions_are_notes() {
    let line = "reheats(p: Heater, v: Container) when p.target > 55 degC and v.contents.temperature > 25 degC \"cool it first\"";
    let hazard = format!("hazard {line}");
    let (code, report) = ran("hazard", &reheated(&hazard, ""));
    assert_eq!((code, &report["failure"]["name"]), (1, &"reheats".into()), "{report:#}");
    assert_eq!(report["failure"]["trace"][0]["line"], 14);
    let (code, report) = ran("hazard_handled", &reheated(&hazard, "on reheats { note \"it stays at 50\" }"));
    assert_eq!((code, &report["status"]), (0, &"passed".into()), "{report:#}");
    let (code, report) = ran("caution", &reheated(&format!("caution {line}"), ""));
    assert_eq!((code, &report["findings"][0]["severity"]), (0, &"warning".into()), "{report:#}");
    let (code, report) = ran("hazard_allowed", &reheated(&format!("{hazard}\nallow reheats \"in a hood\""), ""));
    assert_eq!((code, &report["status"]), (0, &"passed".into()), "{report:#}");
    // What comes about while time passes fails the step that goes on.
    let slow = "hazard too_warm(v: Container) when v.contents.temperature > 30 degC \"stop\"";
    let (code, report) = ran("hazard_slow", &reheated(slow, ""));
    assert_eq!((code, &report["failure"]["name"]), (1, &"too_warm".into()), "{report:#}");
    assert_eq!(report["failure"]["trace"][0]["label"], "wait 20 min");
    assert!(report["end"].as_f64().is_some_and(|end| end < 900.0), "it stops before the wait is over: {report:#}");
}

#[test]
fn what_a_step_would_bring_about_is_never_sent_to_a_device() {
    let line = "hazard reheats(p: Heater, v: Container) when p.target > 55 degC and v.contents.temperature > 25 degC \"cool it first\"";
    let dir = folder("orders_deployed");
    write(&dir, "lab.mtx", reheated(line, ""));
    write(&dir, "lab.toml", "[plate]\naddress = \"127.0.0.1:1\"\n");
    let dry = |dir: &std::path::Path| matterixc_in(dir, &["deploy", "lab.mtx", "--bind", "lab.toml", "--mode", "dry"]);
    let ended = dry(&dir);
    assert_eq!(ended.code, 1, "{}{}", ended.out, ended.err);
    assert!(ended.out.contains("OUT_SP_1 50") && !ended.out.contains("OUT_SP_1 60"), "{}", ended.out);
    assert!(ended.out.contains("STOP_1") && ended.err.contains("error[hazard]"), "{}{}", ended.out, ended.err);
    write(&dir, "lab.mtx", reheated("", ""));
    let ended = dry(&dir);
    assert!(ended.code == 0 && ended.out.contains("OUT_SP_1 60"), "{}{}", ended.out, ended.err);
}

/// A plate with a beaker, and steps from line 10 on.
fn plate(steps: &str) -> String {
    format!(
        "mtx 1
use std::glassware::Beaker250mL
use std::heating::IkaRctBasic
lab bench {{
    ambient: 22 degC
    plate = IkaRctBasic at (0, 0, 0) m
    beaker = Beaker250mL on plate holding 50 g of water
}}
workflow go in bench {{
{steps}
"
    )
}

fn unfinished(name: &str, steps: &str) -> usize {
    findings(name, &plate(steps)).iter().filter(|f| f.0 == "unfinished" && f.1 == "warning").count()
}

#[test]
fn what_is_left_on_along_one_way_is_told() {
    let hot = "beaker.contents.temperature > 40 degC";
    for (name, steps) in [
        ("branch", format!("heat plate to 60 degC\nwait 9 min\nif {hot} {{ stop heating plate }}\n}}")),
        ("stirrer", format!("stir plate at 100 rpm\nwait 9 min\nif {hot} {{ stop stirring plate }}\n}}")),
        ("fail", format!("heat plate to 60 degC\nwait 9 min\nif {hot} {{ fail hot \"!\" }}\nstop heating plate\n}}")),
        ("timeout", format!("heat plate to 60 degC\nwait until {hot} timeout 1 h\nstop heating plate\n}}")),
        (
            "loop",
            format!("heat plate to 60 degC\nrepeat while not ({hot}) max 90 {{ wait 1 min }}\nstop heating plate\n}}"),
        ),
        (
            "in_a_loop",
            format!("heat plate to 60 degC\nrepeat 3 times {{ wait 9 min; if {hot} {{ stop heating plate }} }}\n}}"),
        ),
        (
            "two_of_three",
            format!(
                "heat plate to 60 degC\nwait 9 min\nif {hot} {{ stop heating plate }} else if beaker.contents.temperature \
                 > 30 degC {{ note \"warm\" }} else {{ stop heating plate }}\n}}"
            ),
        ),
    ] {
        assert_eq!(unfinished(&format!("left_{name}"), &steps), 1, "{name}");
    }
}

#[test]
fn what_every_way_turns_off_is_not_told() {
    let hot = "beaker.contents.temperature > 40 degC";
    for (name, steps) in [
        ("finally", format!("heat plate to 60 degC\nwait until {hot} timeout 1 h\n}} finally {{ stop heating plate }}")),
        ("same_value", format!("let hot = {hot}\nif hot {{ heat plate to 60 degC }}\nwait 9 min\nif hot {{ stop heating plate }}\n}}")),
        (
            "same_condition",
            "if beaker.contents.volume > 20 mL { stir plate at 100 rpm }\nwait 1 s\nif beaker.contents.volume > 20 mL { \
             stop stirring plate }\n}"
                .to_owned(),
        ),
        ("no_timeout", format!("heat plate to 60 degC\nwait until {hot}\nstop heating plate\n}}")),
        (
            "retry",
            format!(
                "heat plate to 60 degC\nsequence {{ wait until {hot} timeout 1 min }} on timeout {{ retry 90 }} on failure \
                 {{ note \"cold\" }}\nstop heating plate\n}}"
            ),
        ),
        ("job", "start j = { heat plate to 60 degC; wait 1 min; stop heating plate }\nawait j\n}".to_owned()),
    ] {
        assert_eq!(unfinished(&format!("off_{name}"), &steps), 0, "{name}");
    }
}

/// Eight plates, and steps.
fn plates(steps: &str) -> String {
    let plates: String =
        "abcdefgh".chars().enumerate().map(|(i, c)| format!("{c} = IkaRetControl at ({i}, 0, 0) m\n")).collect();
    format!(
        "mtx 1\nuse std::heating::IkaRetControl\nlab bench {{ ambient: 22 degC\n{plates}}}\nworkflow w in bench {{\n{steps}\n}}\n"
    )
}

#[test]
fn many_claims_hide_no_circle() {
    let many = "claim e { claim f { wait 1 s } }\n".repeat(210);
    let two = "parallel {
step s1 { claim a { wait 1 s; claim b { wait 1 s } } }
step s2 { claim b { wait 1 s; claim a { wait 1 s } } }
}";
    let found = findings("deadlock_far", &plates(&format!("{many}{two}")));
    assert_eq!(found.iter().filter(|f| f.0 == "deadlock").count(), 1, "{found:?}");
    for n in 2..=8 {
        let names: Vec<char> = "abcdefgh".chars().collect();
        let steps: String = (0..n)
            .map(|i| {
                format!(
                    "step s{i} {{ claim {} {{ wait 1 s; claim {} {{ wait 1 s }} }} }}\n",
                    names[i],
                    names[(i + 1) % n]
                )
            })
            .collect();
        let found = findings(&format!("deadlock_{n}"), &plates(&format!("parallel {{\n{steps}}}")));
        assert_eq!(found.iter().filter(|f| f.0 == "deadlock").count(), 1, "{n}: {found:?}");
    }
}

#[test]
fn many_uses_hide_no_clash() {
    for n in [10, 460] {
        let claims = "claim a { heat a to 30 degC\nwait 1 s }\n".repeat(n);
        let branch = |i: usize| format!("step s{i} {{\n{claims}wait 1 s\nheat b to 40 degC\nwait 5 s\n}}\n");
        let found = findings(&format!("twice_{n}"), &plates(&format!("parallel {{\n{}{}}}", branch(1), branch(2))));
        assert_eq!(found.iter().filter(|f| f.0 == "claimed-twice").count(), 1, "{n}");
        assert!(found.iter().all(|f| f.0 != "not-analysed"), "{n}");
    }
}

#[test]
fn what_waited_for_an_effect_comes_behind_it() {
    pass_cases("handshake.mtx", &["handshake"]);
    let (status, report) = run_case("handshake_of_three.mtx", "handshake", &[]);
    assert_eq!(status, 1);
    assert!(report.contains("claimed: `signal b` and `clear b` use `b` at the same time"), "{report}");
}

#[test]
fn a_deadlock_names_the_job_that_is_waited_for() {
    let (_, report) = run_case("../faults/530_await_in_a_claim_of_its_job.mtx", "w", &[]);
    assert!(report.contains("wait for each other") || report.contains("waits for job `b`"), "{report}");
}
