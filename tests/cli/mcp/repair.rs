//! A session that takes broken protocols, makes what corrections are offered, and looks again: without a model in between, so with
//! the first correction of each finding.

use std::fs;

use serde_json::{Value, json};

use super::client::{Client, read};
use crate::harness::{folder, root};

/// A protocol without findings; the mistakes below are made in it.
const SOUND: &str = "mtx 1\nuse std::glassware::Beaker250mL\nuse std::furniture::OpticalTable\n\nlab bench {\n    ambient: 22 degC\n    \
    table = OpticalTable at (0, 0, 0) m\n    b = Beaker250mL on table holding 100 g of water\n}\n\n\
    workflow w in bench {\n    parallel {\n        wait 5 s\n    }\n    expect b.contents.mass == 100 g +- 1 g\n}\n";

/// A broken protocol: the mistake, and the text.
fn broken() -> Vec<(&'static str, String)> {
    let fault = |name: &str| fs::read_to_string(root().join("tests/faults").join(name)).expect("a fault");
    let example = |code: &str| {
        let page = fs::read_to_string(root().join(format!("docs/codes/{code}.md"))).expect("a page");
        let (_, rest) = page.split_once("```mtx\n").expect("an example");
        rest.split_once("```").expect("its end").0.to_string()
    };
    let slip = |from: &str, to: &str| SOUND.replace(from, to);
    vec![
        // Of the hand: what is typed.
        ("a brace is missing", slip("5 s\n    }", "5 s")),
        ("a decimal comma", slip("5 s", "2,5 s")),
        ("the wrong operator", slip("==", "=")),
        ("a comment of another language", slip("5 s", "5 s # a pause")),
        // Of memory: what things are called.
        ("a name misspelt", example("unknown-name")),
        ("a verb misspelt", example("unknown-verb")),
        ("a field misspelt", example("unknown-field")),
        ("a unit misspelt", example("unknown-unit")),
        // Of the chemist: what numbers mean.
        ("a rate per degree in degC", fault("017_degC_in_derived_unit.mtx")),
        ("a label off by 1000", fault("023_label_factor_1000.mtx")),
        // Of whoever reads on: what is declared.
        ("a failure not declared", example("undeclared-failure")),
    ]
}

/// Mistakes that only the author can mend: a fault, its code, and a word of the help.
const WITHOUT: &[(&str, &str)] = &[
    // What was meant, a time or another verb, is not in the text.
    ("012_volume_for_time.mtx", "unit-mismatch"),
    // Which side of the equation lacks what is chemistry.
    ("056_unbalanced_esterification.mtx", "unbalanced"),
    // Less liquid or a larger well.
    ("068_well_overflow_750.mtx", "volume-overflow"),
    // Whether the stirrer is to be started or not stopped.
    ("025_stop_stirrer_never_started.mtx", "never-started"),
];

/// The first correction of each finding, as many as do not overlap: one, to be certain.
fn first(data: &Value) -> Option<String> {
    let findings = data["findings"].as_array().expect("findings");
    findings.iter().find_map(|f| f["fixes"][0]["id"].as_str()).map(str::to_string)
}

#[test]
fn broken_protocols_end_clean_where_corrections_are_offered() {
    let dir = folder("mcp_repair");
    let mut client = Client::new(&dir);
    for (mistake, text) in broken() {
        let path = format!("{}.mtx", mistake.replace(' ', "_"));
        fs::write(dir.join(&path), text).expect("a file");
        let mut data = client.data("check", json!({ "path": path, "fidelity": "process" }));
        assert_ne!(data["errors"], 0, "{mistake}");
        for _ in 0..5 {
            let Some(id) = first(&data) else { break };
            data = client.data("fix", json!({ "path": path, "ids": [id], "write": true, "fidelity": "process" }));
            assert_eq!(data["applied"].as_array().map(Vec::len), Some(1), "{mistake}: {data}");
        }
        let data = client.data("check", json!({ "path": path }));
        assert_eq!((&data["errors"], &data["warnings"]), (&json!(0), &json!(0)), "{mistake}: {data}");
    }
    assert_eq!(client.close(), Some(0));
}

#[test]
fn all_corrections_at_once_come_to_the_same() {
    let mut client = Client::new(&folder("mcp_repair_all"));
    for (mistake, text) in broken() {
        let data = client.data("fix", json!({ "text": text, "which": "all", "fidelity": "process" }));
        // Whether the label is wrong or what is weighed in, a person says.
        let left = u32::from(mistake.starts_with("a label"));
        assert_eq!((&data["errors"], &data["written"]), (&json!(left), &json!(false)), "{mistake}: {data}");
    }
}

#[test]
fn what_only_the_author_knows_is_left_with_its_finding_and_its_page() {
    let mut client = Client::new(&root().join("tests/faults"));
    for (path, code) in WITHOUT {
        let result = client.call("fix", json!({ "path": path, "which": "all", "fidelity": "process" }));
        let data = &result["structuredContent"];
        assert_eq!(data["applied"], json!([]), "{path}");
        let finding = &data["findings"][0];
        assert_eq!(finding["code"], *code, "{path}");
        assert!(finding["labels"][0]["text"].is_string(), "{finding}");
        let said = read(&result);
        assert!(said.contains(&format!("error[{code}]")), "{said}");
        let page = client.data("explain", json!({ "code": code }))["page"].take();
        assert!(page.as_str().is_some_and(|p| p.contains("## Mended")), "{page}");
    }
}
