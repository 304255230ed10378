//! Times and shared instances, before the run.

use crate::harness::{folder, matterixc, write};

const BENCH: &str = "mtx 1

use std::heating::IkaRetControl
use std::robots::FrankaPanda

lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    panda = FrankaPanda at (1, 0, 0) m
}

";

/// Code, severity and headline of every finding about a workflow with this body, in the order of the text.
fn findings(name: &str, body: &str) -> Vec<String> {
    let text = format!("{BENCH}workflow test in bench {{\n{body}\n}}\n");
    let path = write(&folder(&format!("time_{name}")), "bench.mtx", text);
    let lines = matterixc(&["check", &path, "--format", "json"]).out_lines();
    let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
    // What these few steps leave on or in hand is not what is tried here.
    let meant = lines.iter().filter(|l| l["code"] != "unfinished");
    meant.map(|l| format!("{} {}: {}", text(&l["severity"]), text(&l["code"]), text(&l["headline"]))).collect()
}

/// The only finding, from its beginning.
#[track_caller]
fn only(name: &str, body: &str, expected: &str) {
    let found = findings(name, body);
    assert!(matches!(found.as_slice(), [one] if one.starts_with(expected)), "{name}: {found:#?}");
}

#[track_caller]
fn none(name: &str, body: &str) {
    assert_eq!(findings(name, body), Vec::<String>::new(), "{name}");
}

#[test]
fn a_window_shorter_than_what_lies_between_is_found_through_parallel_jobs_and_loops() {
    let late = "error window-unmeetable: `within 1 min after a.end";
    only("sequence", "step a { wait 1 s }\nwait 1 h\nwithin 1 min after a.end { wait 1 s }", late);
    none("longer", "step a { wait 1 s }\nwait 1 h\nwithin 61 min after a.end { wait 1 s }");
    only("offset", "step a { wait 1 s }\nwait 1 h\nwithin 1 min after a.end + 5 min { wait 1 s }", late);
    none("offset_enough", "step a { wait 1 s }\nwait 1 h\nwithin 1 min after a.end + 59 min { wait 1 s }");
    let parallel = "step a { wait 1 s }\nparallel { wait 1 s; wait 1 h }\nwithin 1 min after a.end { wait 1 s }";
    only("parallel", parallel, late);
    let job = "step a { wait 1 s }\nstart j = { wait 1 h }\nawait j\nwithin 1 min after a.end { wait 1 s }";
    only("awaited", job, late);
    none("beside", &job.replace("await j\n", ""));
    only("loop", "step a { wait 1 s }\nrepeat 60 times { wait 1 min }\nwithin 1 min after a.end { wait 1 s }", late);
    only("start", "step a { wait 2 min }\nwithin 1 min after a.start { wait 1 s }", "error window-unmeetable");
    let inside = "repeat 3 times {\n step a { wait 10 s }\n within 1 min after a.end { wait 5 min }\n}";
    none("each_turn", inside);
    none("last_turn", &format!("{inside}\nwithin 6 min after a.end {{ wait 1 s }}"));
}

#[test]
fn what_may_be_shorter_or_is_expected_is_no_error() {
    let cold = "plate.temperature > 300 K";
    let body = format!("step a {{ wait 1 s }}\nif {cold} {{ wait 1 h }}\nwithin 1 min after a.end {{ wait 1 s }}");
    none("branch", &body);
    let body = format!(
        "heat plate to 60 degC\nstep a {{ wait 1 s }}\nwait until {cold} timeout 1 h\nwithin 1 min after a.end {{ wait 1 s }}"
    );
    none("unknown", &body);
    let body = format!("if {cold} {{\nstep a {{ wait 1 s }}\nwait 1 h\nwithin 1 min after a.end {{ wait 1 s }}\n}}");
    only("inside", &body, "warning window-unmeetable");
    let body =
        "step a { wait 1 s }\nsequence { wait 1 h; within 1 min after a.end { wait 1 s } } on late { note \"late\" }";
    only("handled", body, "warning window-unmeetable");
    none("alternative", "try { fail cold \"no\" } else { wait 1 h }");
}

#[test]
fn waits_that_always_time_out_are_found() {
    only("until", "wait until elapsed >= 2 h timeout 1 h", "error window-unmeetable: `wait until elapsed >= 2 h");
    none("until_enough", "wait 90 min\nwait until elapsed >= 2 h timeout 1 h");
    only("hold", "hold plate.temperature > 1 K for 10 min timeout 5 min", "error window-unmeetable: `hold");
    none("hold_enough", "hold plate.temperature > 1 K for 5 min timeout 5 min");
}

#[test]
fn one_instance_in_two_branches_is_found_where_they_meet() {
    let twice = "error claimed-twice: `heat plate to 60 degC` and `heat plate to 80 degC` use `plate`";
    let two = "start one = { heat plate to 60 degC; wait 1 min }\nstart two = { heat plate to 80 degC; wait 1 min }";
    only("jobs", two, twice);
    none("claims", &two.replace("{ ", "{ claim plate { ").replace(" min }", " min } }"));
    let held =
        "error claimed-twice: `heat plate to 80 degC` uses `plate` while another branch or job holds a claim on it";
    only("one_claim", "parallel {\nclaim plate { heat plate to 60 degC }\nheat plate to 80 degC\n}", held);
    only("around", "claim plate { parallel { heat plate to 60 degC; heat plate to 80 degC } }", twice);
    none("apart", "parallel {\nsequence { wait 1 min; heat plate to 60 degC }\nheat plate to 80 degC\n}");
    none("awaited", "start j = { heat plate to 60 degC }\nawait j\nheat plate to 80 degC");
    none(
        "other",
        "parallel { heat plate to 60 degC; stir plate at 300 rpm }"
            .replace("stir plate at 300 rpm", "wait 1 s")
            .as_str(),
    );
    let may = "parallel {\nsequence { wait until plate.temperature > 30 degC timeout 1 h; heat plate to 60 degC }\nsequence { wait 1 s; heat plate to 80 degC }\n}";
    only("perhaps", may, "warning claimed-twice");
    let turns = "parallel {\nrepeat 3 times { wait 1 min; heat plate to 60 degC }\nsequence { wait 90 s; heat plate to 80 degC }\n}";
    none("turns", turns);
    only("turns_meet", &turns.replace("1 min", "45 s"), "warning claimed-twice");
}

#[test]
fn claims_in_a_circle_are_found_unless_something_in_common_is_held() {
    let circle = "error deadlock: claims of `panda` and `plate` can wait for each other forever";
    let crossed = "parallel {\nclaim plate { wait 1 s; claim panda { wait 1 s } }\nclaim panda { wait 1 s; claim plate { wait 1 s } }\n}";
    only("crossed", crossed, circle);
    let ordered = crossed.replace("claim panda { wait 1 s; claim plate {", "claim plate { wait 1 s; claim panda {");
    none("ordered", &ordered);
    none("at_once", "parallel {\nclaim plate, panda { wait 1 s }\nclaim panda, plate { wait 1 s }\n}");
    none(
        "after",
        "claim plate { wait 1 s; claim panda { wait 1 s } }\nclaim panda { wait 1 s; claim plate { wait 1 s } }",
    );
    let apart = "parallel {\nclaim plate { wait 1 s; claim panda { wait 1 s } }\nsequence { wait 1 h; claim panda { wait 1 s; claim plate { wait 1 s } } }\n}";
    none("later", apart);
    // Nothing says that the first is over when the second begins.
    let open = apart.replace("wait 1 h", "wait until plate.temperature < 30 degC timeout 1 h");
    only("any_time", &open, circle);
}
