//! `matterixc bill`: what a run uses up agrees with what the run leaves behind.

use serde_json::Value;

use crate::harness::{folder, matterixc, matterixc_in, write};

const CASES: [&str; 6] = [
    "examples/sn1.mtx",
    "examples/redox.mtx",
    "examples/titration.mtx",
    "tests/cases/dilution.mtx",
    "tests/cases/handled.mtx",
    "tests/cases/pump.mtx",
];

fn bill(file: &str, more: &[&str]) -> Value {
    let ended = matterixc(&[&["bill", file, "--format", "json"], more].concat());
    assert_eq!(ended.code, 0, "{file}: {}", ended.err);
    serde_json::from_str(&ended.out).expect("a JSON document")
}

fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().expect("a list")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {value}"))
}

#[test]
fn what_is_brought_in_is_found_again() {
    for file in CASES {
        let bill = bill(file, &[]);
        let mut brought = 0.0;
        for r in list(&bill, "reagents") {
            let mass = number(r, "mass");
            let found: f64 = ["in_products", "left_over", "in_devices", "in_waste"].map(|k| number(r, k)).iter().sum();
            assert!((found - mass).abs() <= 1e-9 * mass, "{file}: {found} g of {mass} g: {r}");
            brought += mass;
        }
        let weighed: f64 = list(&bill, "weigh_in").iter().map(|w| number(w, "mass")).sum();
        assert!((weighed - brought).abs() <= 1e-9 * brought, "{file}: {weighed} g weighed for {brought} g");
    }
}

#[test]
fn the_bill_agrees_with_the_ledger_of_the_run() {
    for file in CASES {
        let bill = bill(file, &[]);
        let run = matterixc(&["run", file, "--format", "json"]);
        let report: Value = serde_json::from_str(&run.out).expect("a report");
        let total = list(&report, "ledger").iter().find(|b| b["name"] == "mass").expect("a balance of mass");
        let brought: f64 = list(&bill, "reagents").iter().map(|r| number(r, "mass")).sum();
        let end = number(total, "end");
        assert!((brought - end).abs() <= 1e-9 * end, "{file}: {brought} g brought in, {end} g at the end");
        assert_eq!(bill["duration"], report["end"], "{file}");
        // Vessel by vessel: what the stocks have left and what is in the waste.
        let left = |vessel: &str| -> f64 {
            let containers = list(&report, "containers").iter();
            let own = containers.filter(|c| c["name"].as_str().is_some_and(|n| n == format!("{vessel}.contents")));
            own.flat_map(|c| list(c, "species")).map(|s| number(s, "mass")).sum()
        };
        for (key, measure) in [("stocks", "left_over"), ("waste", "mass")] {
            for line in list(&bill, key) {
                let (here, there) = (number(line, measure), left(line["vessel"].as_str().expect("a name")));
                assert!((here - there).abs() <= 1e-9 * there.max(1e-3), "{file}: {line}: {there} g in the run");
            }
        }
    }
}

#[test]
fn tips_are_counted_by_what_became_of_them() {
    let bill = bill("tests/cases/dilution.mtx", &["--runs", "40"]);
    let [tips] = list(&bill, "consumables") else { panic!("{}", bill["consumables"]) };
    assert_eq!((&tips["used"], &tips["used_all"]), (&Value::from(3), &Value::from(120)));
    assert_eq!((&tips["each_holds"], &tips["packs_all"]), (&Value::from(96), &Value::from(2)));
    assert_eq!(tips["from"], serde_json::json!(["tips"]));
    let places: Vec<(u64, u64)> = list(&bill, "labware")
        .iter()
        .map(|l| (l["places_used"].as_u64().unwrap_or(0), l["places"].as_u64().unwrap_or(0)))
        .collect();
    assert_eq!(places, [(2, 12), (12, 96)]);
    assert_eq!(list(&bill, "person").len(), 1);
}

#[test]
fn what_cannot_be_got_out_and_what_is_thrown_away_is_told() {
    let bill = bill("tests/cases/pump.mtx", &[]);
    let [stock] = list(&bill, "stocks") else { panic!("{}", bill["stocks"]) };
    // 2 mL of the 80 mL that are left.
    let dead = number(stock, "dead") / number(stock, "left_over");
    assert!((dead - 2.0 / 80.0).abs() < 1e-3, "{dead}");
    let [waste] = list(&bill, "waste") else { panic!("{}", bill["waste"]) };
    assert_eq!(waste["vessel"], "b");
    let [pump] = list(&bill, "devices") else { panic!("{}", bill["devices"]) };
    assert!((number(pump, "running") - 20.0).abs() < 1e-6 && (number(pump, "busy") - 20.0).abs() < 1e-6, "{pump}");
}

#[test]
fn a_heater_works_as_long_as_it_is_on() {
    let bill = bill("examples/sn1.mtx", &[]);
    let plate = list(&bill, "devices").iter().find(|d| d["name"] == "hotplate").expect("the plate");
    assert!((number(plate, "running") - 1008.6).abs() < 1e-9, "{plate}");
}

#[test]
fn studies_of_the_workflow_are_named_with_their_runs() {
    let dir = folder("bill_study");
    let text = std::fs::read_to_string("tests/cases/pump.mtx").expect("the case");
    write(&dir, "pump.mtx", format!("{text}\nstudy many of fill {{ runs 40 }}\n"));
    let ended = matterixc_in(&dir, &["bill", "pump.mtx", "--format", "csv"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(ended.out.contains("study,many,fill,runs,40,\n"), "{}", ended.out);
    assert!(
        ended.out.starts_with("section,item,of,measure,value,unit\nrun,fill,bench,duration,30,s\n"),
        "{}",
        ended.out
    );
}

#[test]
fn prices_add_up() {
    let dir = folder("bill_prices");
    let text = std::fs::read_to_string("tests/cases/dilution.mtx").expect("the case");
    write(&dir, "dilution.mtx", text);
    write(&dir, "prices.csv", "item,price,currency,quantity,unit\nwater,2.50,EUR,1,L\nTipRack300,60,EUR,1,pack\n");
    let args = ["bill", "dilution.mtx", "--runs", "40", "--prices", "prices.csv", "--format", "json"];
    let ended = matterixc_in(&dir, &args);
    let bill: Value = serde_json::from_str(&ended.out).expect("a JSON document");
    let lines = list(&bill["costs"], "lines");
    assert_eq!(lines.len(), 2, "{lines:?}");
    // 10 mL as it is and what the dye takes, 40 times; two racks.
    let water = number(&lines[0], "quantity");
    assert!((water - 40.0 * (0.010 + 0.004984)).abs() < 1e-4, "{water} L");
    assert!((number(&lines[1], "price") - 120.0).abs() < 1e-9);
    assert_eq!(bill["costs"]["without_price"], serde_json::json!(["KI"]));
}

#[test]
fn bad_arguments_are_said_in_words() {
    let dir = folder("bill_wrong");
    write(&dir, "bad.mtx", "mtx 1\nworkflow w in nowhere { wait 1 s }\n");
    write(&dir, "prices.csv", "item,price\n");
    let pump = std::fs::canonicalize("tests/cases/pump.mtx").expect("the case");
    let pump = pump.to_str().expect("text");
    for (args, code, wanted) in [
        (vec!["bill"], 2, "required"),
        (vec!["bill", "none.mtx"], 2, "cannot read `none.mtx`"),
        (vec!["bill", pump, "--runs", "0"], 2, "0 is not in 1..="),
        (vec!["bill", pump, "--format", "xml"], 2, "invalid value"),
        (vec!["bill", pump, "--prices", "none.csv"], 2, "cannot read `none.csv`"),
        (vec!["bill", pump, "--prices", "prices.csv"], 2, "the first line must be `item,price,currency,quantity,unit`"),
        (vec!["bill", pump, "--workflow", "empty"], 1, "this file has no workflow `empty`"),
        (vec!["bill", "bad.mtx"], 1, "unknown-name"),
    ] {
        let ended = matterixc_in(&dir, &args);
        assert_eq!((ended.code, ended.out.as_str()), (code, ""), "{args:?}");
        assert!(ended.err.contains(wanted), "{args:?}: {}", ended.err);
    }
}

#[test]
fn every_field_of_the_document_is_described() {
    fn keys(value: &Value, out: &mut std::collections::BTreeSet<String>) {
        match value {
            Value::Object(all) => all.iter().for_each(|(k, v)| {
                out.insert(k.clone());
                keys(v, out);
            }),
            Value::Array(all) => all.iter().for_each(|v| keys(v, out)),
            _ => {}
        }
    }
    let docs = std::fs::read_to_string("docs/bill.md").expect("the description");
    let mut all = std::collections::BTreeSet::new();
    for file in CASES {
        keys(&bill(file, &[]), &mut all);
    }
    for key in all {
        assert!(docs.contains(&format!("`{key}`")), "`{key}` is not in docs/bill.md");
    }
}
