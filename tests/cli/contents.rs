//! `matterixc check --contents`: what is known at every statement, compared with pages that were read and found good, and
//! with what happens in runs.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::harness::{folder, matterixc, write};

/// Files whose pages are in `tests/contents`.
const PAGES: [&str; 3] = ["sn1", "redox", "dilution"];

/// Files that are run beside what is known of them.
const RUNS: [&str; 7] = ["sn1", "redox", "titration", "dilution", "distribution", "centrifuge", "heat_network"];

/// Seconds by which a statement's end and a row of the recording may differ.
const SAME_TIME: f64 = 1e-6;

#[test]
fn contents_are_as_they_were_found_good() {
    for name in PAGES {
        let file = format!("examples/{name}.mtx");
        let ended = matterixc(&["check", &file, "--contents"]);
        assert_eq!(ended.code, 0, "{file}: {}", ended.err);
        let path = format!("tests/contents/{name}.txt");
        if std::env::var_os("MATTERIX_UPDATE").is_some() {
            std::fs::write(&path, &ended.out).expect("the page is written");
        }
        let wanted = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(ended.out, wanted, "{file} against {path}");
    }
}

/// The statements of a file as `--format json` gives them.
fn statements(file: &str, more: &[&str]) -> Vec<Value> {
    let ended = matterixc(&[&["check", file, "--contents", "--format", "json"], more].concat());
    assert_eq!(ended.code, 0, "{file}: {}", ended.err);
    let all = ended.out_lines();
    let contents = all.iter().map(|o| &o["contents"]).find(|c| c.is_object()).expect("a line with contents");
    assert_eq!(contents["version"], 1);
    contents["statements"].as_array().expect("statements").clone()
}

/// Columns of a table by name, each with its place and its unit.
type Columns = BTreeMap<String, (usize, String)>;

/// Columns and rows of a run's `states.csv`.
fn rows(path: &std::path::Path) -> (Columns, Vec<Vec<f64>>) {
    let mut reader = csv::Reader::from_path(path).expect("the table");
    let columns =
        reader.headers().expect("a header").iter().enumerate().map(|(i, name)| match name.rsplit_once(" [") {
            Some((name, unit)) => (name.to_string(), (i, unit.trim_end_matches(']').to_string())),
            None => (name.to_string(), (i, String::new())),
        });
    let columns = columns.collect();
    let number = |row: csv::StringRecord| row.iter().map(|v| v.parse().unwrap_or(f64::NAN)).collect();
    (columns, reader.records().map(|r| number(r.expect("a row"))).collect())
}

/// What a number in the recording is in another unit.
fn factor(from: &str, to: &str) -> Option<f64> {
    let size = |unit: &str| {
        let prefixes = [("m", 1e-3), ("u", 1e-6), ("n", 1e-9)];
        ["g", "L", "mol"].iter().find_map(|base| {
            let prefix = unit.strip_suffix(base)?;
            let known = if prefix.is_empty() { Some(1.0) } else { None };
            known.or_else(|| prefixes.iter().find(|p| p.0 == prefix).map(|p| p.1)).map(|f| (*base, f))
        })
    };
    if from == to {
        return Some(1.0);
    }
    match (size(from)?, size(to)?) {
        ((a, f), (b, g)) if a == b => Some(f / g),
        _ => None,
    }
}

/// Whether a number is among what is known.
fn holds(known: &Value, v: f64) -> bool {
    let close = |a: f64| (a - v).abs() <= 1e-6 * a.abs().max(v.abs()) + 1e-9;
    if let Some(exact) = known["exact"].as_f64() {
        return close(exact);
    }
    if let Some(all) = known["one_of"].as_array() {
        return all.iter().filter_map(Value::as_f64).any(close);
    }
    let low = known["low"].as_f64().is_none_or(|low| low <= v || close(low));
    low && known["high"].as_f64().is_none_or(|high| v <= high || close(high))
}

/// The quantities of a thing by the names of their columns.
fn known_of(thing: &Value) -> Vec<(String, Value)> {
    let name = thing["name"].as_str().expect("a name");
    let list = |key: &str| thing[key].as_array().expect("a list").clone();
    let members = list("members").into_iter().map(|m| (format!("{name}.{}", m["name"].as_str().expect("one")), m));
    let species =
        list("species").into_iter().map(|s| (format!("{name}.amount[{}]", s["name"].as_str().expect("one")), s));
    let quantity =
        |(name, fact): (String, Value)| fact["value"]["unit"].is_string().then(|| (name, fact["value"].clone()));
    members.chain(species).filter_map(quantity).collect()
}

#[test]
fn runs_stay_within_what_is_known() {
    for name in RUNS {
        let compared = stays_within(&format!("examples/{name}.mtx"), &folder(&format!("contents_{name}")));
        assert!(compared > 5, "{name}: only {compared} values were compared");
    }
}

#[test]
fn runs_with_jobs_stay_within_what_is_known() {
    for name in ["271_warmed_while_a_job_waits", "273_sample_before_a_job_pours", "276_two_branches_at_one_plate"] {
        let compared =
            stays_within(&format!("tests/faults/clean/{name}.mtx"), &folder(&format!("contents_{}", &name[..3])));
        assert!(compared > 0, "{name}: nothing was compared");
    }
}

/// Runs a file and compares what is recorded after each statement with what `check` knows there; how many values were.
pub fn stays_within(file: &str, dir: &std::path::Path) -> usize {
    let out = dir.to_str().expect("text");
    let ended = matterixc(&["run", file, "--out", out, "--csv", "--format", "json"]);
    let report: Value = serde_json::from_str(&ended.out).expect("a report");
    let (columns, rows) = rows(&dir.join("states.csv"));
    let mut compared = 0;
    let all = statements(file, &[]);
    for s in all.iter().filter(|s| s["after"].is_object() && s["block"] == false) {
        let line = &s["span"]["start"]["line"];
        let steps = report["steps"].as_array().expect("steps").iter();
        let mut ends: Vec<f64> = steps
            .filter(|t| t["file"].as_str() == Some(file) && t["line"] == *line && t["state"] == "done")
            .filter(|t| t["label"].as_str().is_some_and(|l| !l.starts_with('{') && l != "sequence"))
            .filter_map(|t| t["end"].as_f64())
            .collect();
        // Statements that share a line are not told apart by it.
        if all.iter().filter(|o| o["span"]["start"]["line"] == *line).count() > 1 {
            continue;
        }
        ends.dedup();
        let things = s["after"]["things"].as_array().expect("things");
        let facts: Vec<(String, Value)> = things.iter().flat_map(known_of).collect();
        for end in ends {
            assert!(holds(&s["after"]["elapsed"], end), "{file}:{line}: {end} s, {}", s["after"]["elapsed"]);
            // What happens at the same instant stands in rows of the same time; a row need not fall on it.
            let from = rows.partition_point(|r| r[0] < end - SAME_TIME);
            let to = rows.partition_point(|r| r[0] <= end + SAME_TIME);
            let around = from.saturating_sub(usize::from(from == to))..(to + usize::from(from == to)).min(rows.len());
            let now = &rows[around];
            for (column, value) in &facts {
                let Some((i, unit)) = columns.get(column) else { continue };
                let Some(factor) = factor(unit, value["unit"].as_str().expect("a unit")) else { continue };
                let within = now.iter().any(|r| holds(value, r[*i] * factor));
                let found: Vec<f64> = now.iter().map(|r| r[*i] * factor).collect();
                assert!(within, "{file}:{line} at {end} s: {column} is {found:?}, not {value}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn everything_is_said_of_one_place() {
    let ended = matterixc(&["check", "examples/dilution.mtx", "--contents", "--at", "23"]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    let wells = "plate[A2 .. H12].contents: mass 100.35 mg, volume 100 uL";
    assert!(ended.out.contains(wells) && ended.out.contains("ot2.left.channels[1]: tip nothing"), "{}", ended.out);
    assert!(!ended.out.contains("step halve"), "{}", ended.out);
    let one = statements("examples/dilution.mtx", &["--at", "23:9"]);
    assert_eq!(one.len(), 1);
    assert_eq!(one[0]["span"]["start"]["line"], 23);
}

#[test]
fn every_member_of_the_json_is_described() {
    fn members(value: &Value, out: &mut std::collections::BTreeSet<String>) {
        if let Some(object) = value.as_object() {
            out.extend(object.keys().cloned());
        }
        let inner = value.as_object().into_iter().flat_map(|o| o.values());
        inner.chain(value.as_array().into_iter().flatten()).for_each(|v| members(v, out));
    }
    let page = std::fs::read_to_string("docs/contents.md").expect("the page");
    let mut found = std::collections::BTreeSet::new();
    statements("examples/dilution.mtx", &[]).iter().for_each(|s| members(s, &mut found));
    for member in
        found.iter().filter(|m| !["file", "start", "end", "line", "column", "utf16", "byte"].contains(&m.as_str()))
    {
        let named = [format!("`{member}`"), format!(".{member}`"), format!("\"{member}\"")];
        assert!(named.iter().any(|n| page.contains(n)), "{member}");
    }
}

#[test]
fn what_cannot_be_known_is_not() {
    let dir = folder("contents_unknown");
    let text = "mtx 1\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\nuse std::robots::FrankaPanda\n\
        lab l {\n    ambient: 25 degC\n    t = OpticalTable at (0, 0, 0) m\n    p = FrankaPanda on t at (0, 0) mm\n\
        \x20   h = IkaRetControl on t at (550, 0) mm\n    s = IkaRetControl on t at (550, 400) mm\n\
        \x20   b = Beaker250mL on h holding 100 g of water\n}\n\
        workflow w in l {\n    start warm = {\n        heat h to 60 degC\n        wait 10 min\n        stop heating h\n    }\n\
        \x20   wait 1 min\n    await warm\n    if h.temperature > 30 degC {\n        heat s to 40 degC\n    }\n    stop heating s\n}\n";
    let file = write(&dir, "job.mtx", text);
    let all = matterixc(&["check", &file, "--contents", "--at", "19"]).out;
    assert!(all.contains("wait 1 min") && all.contains("not known"), "{all}");
    assert!(all.contains("active not known, target not known"), "{all}");
    let all = matterixc(&["check", &file, "--contents", "--at", "23"]).out;
    assert!(all.contains("s: active true or false") || all.contains("s: active false or true"), "{all}");
}

#[test]
fn a_place_without_a_statement_is_a_usage_error() {
    let wrong: &[(&[&str], &str)] = &[
        (&["--at", "0", "--contents"], "write LINE or LINE:COLUMN"),
        (&["--at", "20:x", "--contents"], "write LINE or LINE:COLUMN"),
        (&["--at", "20"], "--contents"),
        (&["--at", "999", "--contents"], "has 43 lines"),
        (
            &["--at", "3", "--contents"],
            "`examples/dilution.mtx` has no statement of a workflow at this place; the nearest are at 21",
        ),
        (&["--at", "22:1", "--contents"], "no statement"),
        (&["examples/sn1.mtx", "--at", "20", "--contents"], "`--at` needs exactly one file"),
    ];
    for (args, why) in wrong {
        let ended = matterixc(&[&["check", "examples/dilution.mtx"], *args].concat());
        assert_eq!(ended.code, 2, "{args:?}: {}", ended.out);
        assert!(ended.err.starts_with("error: ") && ended.err.contains(why), "{args:?}: {}", ended.err);
    }
}
