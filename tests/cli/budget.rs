//! Short texts that ask for more work than there is time or memory: each ends soon, and the finding names the item.

use std::fmt::Write;

use serde_json::json;

use crate::harness::{Ended, folder, matterixc_in, root, write};
use crate::mcp::client::Client;

const BENCH: &str = "use std::glassware::Beaker250mL
use std::heating::IkaRetControl
lab bench {
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker250mL on plate holding 100 g of water
}
";

const TENS: &str = "const tens = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]\n";

fn checked(name: &str, text: &str) -> Ended {
    let dir = folder(&format!("budget_{name}"));
    write(&dir, "text.mtx", format!("mtx 1\n{text}"));
    matterixc_in(&dir, &["check", "--format", "concise", "--no-cache", "--fidelity", "process", "text.mtx"])
}

fn clean(name: &str, text: &str) {
    let ended = checked(name, text);
    assert_eq!((ended.code, ended.out.as_str()), (0, ""), "{name}");
}

/// One finding, at this line.
fn given_up(name: &str, text: &str, line: usize, why: &str) {
    let ended = checked(name, text);
    assert_eq!(ended.code, 1, "{name}: {}", ended.out);
    let found: Vec<&str> = ended.out.lines().filter(|l| l.contains("error[")).collect();
    assert_eq!(found.len(), 1, "{name}: {}", ended.out);
    assert!(found[0].starts_with(&format!("text.mtx:{line}:")), "{name}: {}", found[0]);
    assert!(found[0].contains("error[budget-spent]") && found[0].contains(why), "{name}: {}", found[0]);
}

/// `first`, then 40 items made of the one before: `next(i)`.
fn chain(first: &str, next: impl Fn(usize) -> String) -> String {
    (1..=40).fold(format!("{first}\n"), |mut text, i| {
        writeln!(text, "{}", next(i)).expect("a string takes text");
        text
    })
}

#[test]
fn functions_of_known_numbers_are_worked_out_once() {
    let twice = |i: usize| format!("fn f{i}(x: Ratio) -> Ratio = f{}(x) + f{}(x)", i - 1, i - 1);
    let text = chain("fn f0(x: Ratio) -> Ratio = x + 1", twice);
    clean("functions", &text);
    clean("functions_called", &format!("{text}const c = f40(1)\n"));
}

#[test]
fn constants_know_those_before_them() {
    clean(
        "constants",
        &(1..2000).fold("const c0 = 1\n".to_string(), |t, i| t + &format!("const c{i} = c{} / 2\n", i - 1)),
    );
}

#[test]
fn skills_that_nothing_calls_cost_nothing() {
    let twice = |i: usize| format!("skill s{i}(p: IkaRetControl) {{ s{} p; s{} p }}", i - 1, i - 1);
    let skills = chain("skill s0(p: IkaRetControl) { wait 1 s }", twice);
    clean("skills", &format!("{BENCH}{skills}workflow w in bench {{ wait 1 s }}\n"));
    let called = format!("{BENCH}{skills}workflow w in bench {{ s40 plate }}\n");
    given_up("skills_called", &called, 50, "expands to more than 200000 steps");
}

#[test]
fn a_failure_of_a_skill_called_twice_is_still_missed_where_it_has_no_handler() {
    let text = format!(
        "{BENCH}skill may(p: IkaRetControl) fails slow {{ wait until p.temperature > 300 K timeout 1 s on timeout {{ fail slow \"slow\" }} }}
skill twice(p: IkaRetControl) {{
    sequence {{ may p }} on slow {{ note \"slow\" }}
    may p
}}
workflow w in bench {{ twice plate }} on failure {{ }}
"
    );
    let ended = checked("skills_fail", &text);
    assert!(ended.out.contains("text.mtx:12:5: error[undeclared-failure]"), "{}", ended.out);
}

#[test]
fn nested_loops_and_sums_are_given_up_by_name() {
    let open: String =
        ["a", "b", "c", "d", "e", "f"].iter().fold(String::new(), |t, v| t + &format!("for {v} in tens {{ "));
    let text = format!("{BENCH}{TENS}workflow w in bench {{\n{open}wait 1 s {}\n}}\n", "} ".repeat(6));
    given_up("loops", &text, 11, "expands to more than 200000 steps");
    let open =
        ["a", "b", "c", "d", "e", "f", "g", "h"].iter().fold(String::new(), |t, v| t + &format!("sum({v} in tens: "));
    given_up("sums", &format!("{TENS}const s =\n    {open}a{}\n", ")".repeat(8)), 4, "10 million steps");
}

#[test]
fn lists_of_lists_are_counted_by_their_elements() {
    let text = chain("fn l0() = [1, 2]", |i| format!("fn l{i}() = [l{}(), l{}()]", i - 1, i - 1));
    given_up("lists", &text, 19, "10 million steps");
}

#[test]
fn what_stands_inside_itself_too_often_is_given_up() {
    let one = |t: String, i: usize| t + &format!("fn f{i}(x: Ratio) -> Ratio = f{}(x)\n", i - 1);
    let text = (1..1500).fold("fn f0(x: Ratio) -> Ratio = x\n".to_string(), one);
    given_up("deep", &format!("{text}const c = f1499(1)\n"), 1502, "nested more than 1000 deep");
}

#[test]
fn a_law_for_too_many_combinations_is_given_up_by_name() {
    let many = (0..300).fold(String::new(), |t, i| t + &format!("    b{i} = Beaker250mL at ({}, 0, 0) m\n", i + 1));
    let law = "hazard crowd(a: Body, b: Body, c: Body)\n    when a.mass + b.mass + c.mass > 100 kg \"too much\"\n";
    let bench = BENCH.replace("ambient: 22 degC\n", &format!("ambient: 22 degC\n{many}"));
    let text = format!("{law}{bench}workflow w in bench {{ wait 1 s }}\n");
    given_up("law", &text, 2, "10 million steps");
}

#[test]
fn a_call_ends_when_its_seconds_are_over_and_says_so() {
    let open = ["a", "b", "c", "d", "e", "f"].iter().fold(String::new(), |t, v| t + &format!("sum({v} in tens: "));
    let slow = (0..40)
        .fold(String::new(), |t, i| t + &format!("workflow w{i} in bench {{ let s = {open}a{} }}\n", ")".repeat(6)));
    let mut client = Client::new(&folder("budget_call"));
    for _ in 0..5 {
        let data = client.data("check", json!({ "text": format!("mtx 1\n{BENCH}{TENS}{slow}"), "seconds": 1 }));
        let stopped = |d: &serde_json::Value| {
            d["code"] == "budget-spent" && d["headline"].to_string().contains("ran out of time")
        };
        assert!(data["findings"].as_array().expect("findings").iter().any(stopped), "{data}");
    }
    let data = client.data("check", json!({ "text": "mtx 1\nconst a = 1\n" }));
    assert_eq!(data["errors"], 0);
    assert_eq!(client.close(), Some(0));
}

/// A species without a volume leaves it open what is moved where: each draft of the plan moved something else.
#[test]
fn a_text_whose_mistake_leaves_open_what_is_moved_is_written_out_to_an_end() {
    let text = std::fs::read_to_string(root().join("examples/redox.mtx")).expect("the example");
    let dir = folder("budget_volume");
    write(&dir, "text.mtx", text.replacen("molar_volume: 60 mL/mol", "molar_volume: 60 labelled/mol", 1));
    let ended = matterixc_in(&dir, &["check", "--no-cache", "--fidelity", "process", "text.mtx"]);
    assert!(ended.code == 1 && ended.out.contains("found `labelled`"), "{}", ended.out);
}
