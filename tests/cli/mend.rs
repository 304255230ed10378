//! Corrections that `check --fix` makes, findings as SARIF, and looking again when files change.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

use crate::harness::{command, folder, matterixc_in, write};

const WRONG: &str = "mtx 1\nuse std::glassware::Beaker250mL\n\nlab bench {\n    ambient: 22 degC\n    \
    table = OpticalTable at (0, 0, 0) m\n    b = Beaker250mL on table holding 100 g of watr # µL 😀 of = it\n}\n\
    workflow w in bench {\n    expect b.contents.mass = 100 g +- 1 g\n    wait 5. s\n}\n";

#[test]
fn what_leaves_no_doubt_is_mended_and_the_rest_is_left() {
    let dir = folder("mend_sure");
    write(&dir, "w.mtx", WRONG);
    let ended = matterixc_in(&dir, &["check", "w.mtx", "--fix", "--format", "concise"]);
    assert_eq!(ended.code, 1);
    let done = "w.mtx:7:52: fixed: write `//`\nw.mtx:10:28: fixed: write `==`\nw.mtx:11:11: fixed: remove the point\n";
    assert_eq!(ended.err, done);
    assert_eq!(ended.out, "w.mtx:7:47: error[unknown-name]: unknown species or solution `watr`\n1 error\n");
    let mended = WRONG.replace("# µL", "// µL").replace("mass = 100", "mass == 100").replace("5. s", "5 s");
    assert_eq!(fs::read_to_string(dir.join("w.mtx")).expect("the file"), mended);

    let ended = matterixc_in(&dir, &["check", "w.mtx", "--fix=all"]);
    assert_eq!((ended.code, ended.out.as_str()), (0, "no findings\n"), "{}", ended.err);
    assert_eq!(fs::read_to_string(dir.join("w.mtx")).expect("the file"), mended.replace("watr", "water"));
}

#[test]
fn what_is_imported_from_a_misspelt_module_stays() {
    let dir = folder("mend_module");
    let text = "mtx 1\nuse std::heatng::IkaRetControl\nuse std::glasware::{Beaker100mL}\nlab bench {\n    ambient: 22 degC\n    \
        plate = IkaRetControl at (0, 0, 0) m\n    cup = Beaker100mL on plate\n}\n";
    write(&dir, "w.mtx", text);
    let ended = matterixc_in(&dir, &["check", "w.mtx", "--fix=all"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let mended = text.replace("heatng", "heating").replace("glasware", "glassware");
    assert_eq!(fs::read_to_string(dir.join("w.mtx")).expect("the file"), mended);
}

#[test]
fn new_lines_end_as_those_of_the_file() {
    let dir = folder("mend_returns");
    write(
        &dir,
        "w.mtx",
        "mtx 1\r\nlab bench {\r\n    ambient: 22 degC\r\n    cup = Beaker100mL at (0, 0, 0) m\r\n}\r\n",
    );
    assert_eq!(matterixc_in(&dir, &["check", "w.mtx", "--fix=all"]).code, 0);
    let mended = fs::read_to_string(dir.join("w.mtx")).expect("the file");
    assert!(mended.contains("use std::glassware") && !mended.replace("\r\n", "").contains('\n'), "{mended:?}");
}

#[test]
fn a_file_that_needs_nothing_is_not_written() {
    let dir = folder("mend_nothing");
    let path = write(&dir, "w.mtx", "mtx 1\nlab bench { ambient: 22 degC }\n");
    let before = fs::metadata(&path).and_then(|m| m.modified()).expect("the file");
    assert_eq!(matterixc_in(&dir, &["check", "w.mtx", "--fix"]).code, 0);
    assert_eq!(fs::metadata(&path).and_then(|m| m.modified()).expect("the file"), before);
}

#[test]
fn a_document_in_sarif_says_where_why_and_how_to_mend() {
    let dir = folder("mend_sarif");
    write(&dir, "über w.mtx", WRONG.replace("# µL 😀 of = it", "").replace("100 g of watr", "\"😀\" of water"));
    write(&dir, "clean.mtx", "mtx 1\nlab bench { ambient: 22 degC }\n");
    let ended = matterixc_in(&dir, &["check", "über w.mtx", "clean.mtx", "--format", "sarif"]);
    assert_eq!(ended.code, 1);
    let log: serde_json::Value = serde_json::from_str(&ended.out).expect("one document");
    assert_eq!(log["version"], "2.1.0");
    let run = &log["runs"][0];
    assert_eq!(run["columnKind"], "utf16CodeUnits");
    let results = run["results"].as_array().expect("results");
    assert!(results.len() >= 2, "{results:?}");
    for result in results {
        let rule = result["ruleIndex"].as_u64().expect("an index") as usize;
        assert_eq!(run["tool"]["driver"]["rules"][rule]["id"], result["ruleId"]);
        let place = &result["locations"][0]["physicalLocation"];
        assert_eq!(place["artifactLocation"]["uri"], "%C3%BCber%20w.mtx");
    }
    let equals = results.iter().find(|r| r["fixes"][0]["description"]["text"] == "write `==`").expect("the slip");
    let change = &equals["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(change["insertedContent"]["text"], "==");
    assert_eq!(change["deletedRegion"]["startColumn"], 28);

    let none = matterixc_in(&dir, &["check", "clean.mtx", "--format", "sarif"]);
    let log: serde_json::Value = serde_json::from_str(&none.out).expect("one document");
    assert_eq!((none.code, log["runs"][0]["results"].as_array().map(Vec::len)), (0, Some(0)));
}

#[cfg(unix)]
#[test]
fn a_file_is_looked_at_again_when_it_changes() {
    let dir = folder("mend_watch");
    let text = "mtx 1\nlab bench { ambient: 22 degC }\nworkflow w in bench { wait 1 min }\n";
    write(&dir, "w.mtx", text);
    let mut command = command();
    command.args(["check", "w.mtx", "--watch"]).current_dir(&dir).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().expect("the command starts");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines().map_while(Result::ok);
    let mut until = |what: &str| lines.any(|line| line.contains(what));
    assert!(until("no findings"));
    write(&dir, "w.mtx", text.replace("1 min", "1 mL"));
    assert!(until("unit-mismatch"));
    write(&dir, "w.mtx", text);
    assert!(until("no findings"));
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it runs");
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}

#[cfg(unix)]
#[test]
fn a_file_is_looked_at_again_once_for_each_change_of_what_was_read() {
    let dir = folder("mend_watch_once");
    // Whole at once: written in place on a busy machine a file may be read half written, which is a change more.
    let put = |name: &str, text: &str| {
        write(&dir, "sedX", text);
        std::fs::rename(dir.join("sedX"), dir.join(name)).expect("a name");
    };
    let lab = "mtx 1\nlab bench { ambient: 22 degC }\n";
    let text = "mtx 1\nuse labs::bench\nworkflow w in bench { wait 1 min }\n";
    put("labs.mtx", lab);
    put("w.mtx", text);
    let mut command = command();
    command.args(["check", "w.mtx", "--watch"]).current_dir(&dir).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the command starts");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines().map_while(Result::ok);
    let mut complaints = BufReader::new(child.stderr.take().expect("piped")).lines().map_while(Result::ok);
    // How often it looked until it says something.
    let mut looks = |what: &str| {
        let said = lines.by_ref().take_while(|line| !line.contains(what)).filter(|line| line == "---").count();
        std::thread::sleep(std::time::Duration::from_millis(300));
        said
    };
    assert_eq!(looks("no findings"), 0);
    // Beside it, as it was, and by another text.
    write(&dir, "w.mtx~", "x");
    write(&dir, "notes.txt", "x");
    put("w.mtx", text);
    std::thread::sleep(std::time::Duration::from_millis(300));
    put("w.mtx", &text.replace("1 min", "1 mL"));
    assert_eq!(looks("unit-mismatch"), 1);
    // A file that it imports.
    put("w.mtx", text);
    assert_eq!(looks("no findings"), 1);
    put("labs.mtx", &lab.replace("degC", "mL"));
    assert_eq!(looks("unit-mismatch"), 1);
    // Away: one complaint, however much happens beside it.
    let is_complaint = |line: &String| line.contains("the file does not exist");
    std::fs::remove_file(dir.join("w.mtx")).expect("it was there");
    assert!(complaints.any(|line| is_complaint(&line)));
    for i in 0..3 {
        std::thread::sleep(std::time::Duration::from_millis(200));
        write(&dir, "notes.txt", format!("{i}"));
    }
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it runs");
    assert_eq!(complaints.filter(is_complaint).count(), 0);
    child.wait().expect("it ends");
}

#[test]
fn a_label_that_its_recipe_misses_is_left_to_a_person() {
    let dir = folder("mend_label");
    // A tenth is weighed in, in grams, as a share, and of a stock: whoever rewrites the label hides the slip.
    let text = "mtx 1\n\nsolution iodide { KI: 0.066 g, water: 100 g } labelled 0.04 mol/kg of KI\n\
        solution brine { NaCl: 9 %w/w, water: rest } labelled 9 g/L of NaCl\n\
        solution thin { brine: 10 g, water: 90 g } labelled 0.5 mol/L of NaCl\n";
    let path = write(&dir, "w.mtx", text);
    let lines = matterixc_in(&dir, &["check", "w.mtx", "--format", "json"]).out_lines();
    let offered: Vec<Vec<(String, String)>> = lines
        .iter()
        .map(|line| {
            let fixes = line["fixes"].as_array().expect("fixes");
            let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_string();
            fixes.iter().map(|f| (text(&f["title"]), text(&f["edits"][0]["text"]))).collect()
        })
        .collect();
    let both = |label: &str, of: &str, amount: &str| {
        vec![
            ("correct the label".to_string(), label.to_string()),
            (format!("correct the amount of {of}"), amount.to_string()),
        ]
    };
    assert_eq!(
        offered,
        [
            both("0.003973 mol/kg", "KI", "0.6684 g"),
            both("95.52 g/L", "NaCl", "0.8969 %w/w"),
            both("0.1545 mol/L", "brine", "42.18 g"),
        ]
    );
    assert!(lines.iter().flat_map(|line| line["fixes"].as_array()).flatten().all(|fix| fix["asks"] == true));
    for fix in ["--fix", "--fix=all"] {
        assert_eq!(matterixc_in(&dir, &["check", "w.mtx", fix]).code, 1);
        assert_eq!(fs::read_to_string(&path).expect("the file"), text, "{fix}");
    }
    // Either of them mends it.
    let mended =
        text.replace("0.066 g", "0.6684 g").replace("9 %w/w", "0.8969 %w/w").replace("0.5 mol/L", "0.01545 mol/L");
    write(&dir, "w.mtx", &mended);
    assert_eq!(matterixc_in(&dir, &["check", "w.mtx"]).out, "no findings\n");
}

#[test]
fn imports_that_are_missing_are_one_finding_with_one_correction() {
    let dir = folder("mend_imports");
    let lab = "lab bench {\n    ambient: 22 degC\n    pump = CavroXlp6000 at (0, 0, 0) m\n    \
        cup = Beaker50mL at (300, 0, 0) mm holding 10 mL of water\n    between pump and cup { piped: true }\n}\n\
        workflow go in bench {\n    repeat 2 times { draw 1 mL from cup by pump; push 1 mL into cup by pump }\n    \
        expect cup.contents.volume > 9 mL\n}\n";
    for (slip, imports, headline, mended) in [
        ("all", "", "unknown asset type `CavroXlp6000`", None),
        (
            "some",
            "use std::glassware::Beaker50mL\nuse std::pumps::CavroXlp6000\n",
            "`piped`, `draw` and `push` are not imported",
            Some("use std::pumps::{draw, piped, push}"),
        ),
        (
            "listed",
            "use std::glassware::Beaker50mL\nuse std::pumps::{CavroXlp6000, draw}\n",
            "`piped` and `push` are not imported",
            Some("use std::pumps::{CavroXlp6000, draw, piped, push}"),
        ),
        (
            "hidden",
            "use std::glassware::Beaker50mL\nuse std::pumps::{CavroXlp6000, draw, piped}\n",
            "this call needs another `push`, which is not imported",
            Some("use std::pumps::{CavroXlp6000, draw, piped, push}"),
        ),
    ] {
        let path = write(&dir, "w.mtx", format!("mtx 1\n{imports}{lab}"));
        let lines = matterixc_in(&dir, &["check", "w.mtx", "--format", "json"]).out_lines();
        assert_eq!(lines.len(), 1, "{slip}: {lines:#?}");
        if mended.is_some() {
            assert_eq!(lines[0]["headline"], headline, "{slip}");
        }
        assert_eq!(lines[0]["fixes"].as_array().map(Vec::len), Some(1), "{slip}");
        let ended = matterixc_in(&dir, &["check", "w.mtx", "--fix"]);
        assert_eq!(ended.out, "no findings\n", "{slip}: {}", ended.err);
        let now = fs::read_to_string(&path).expect("the file");
        assert!(mended.is_none_or(|line| now.contains(line)), "{slip}: {now}");
    }
}
