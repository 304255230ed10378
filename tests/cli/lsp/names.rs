//! Names, as an editor asks for them: across files, into the library, and in texts that are being typed.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::client::Client;
use super::{BINARY, edited, folder, range, uri};

const PLACE: &str = "mtx 1\n\nuse std::heating\n\n/// Where it is done.\nlab bench {\n    ambient: 25 degC\n    \
    plate = IkaRetControl at (0, 0, 0) m\n}\n\n/// Warms a device.\nskill warm(h: Heater) to(t: Temperature) {\n    heat h to t\n    wait 5 s\n    stop heating h\n}\n";

const WORK: &str = "mtx 1\n\nuse place\n\nworkflow µ_free(goal: Temperature = 40 degC) in bench {\n    \
    note \"°C\"; warm plate to goal\n    expect plate.temperature > 20 degC\n}\n";

/// A package of three files, two of them open, all of them without findings.
fn package(name: &str) -> (Client, String, String, String) {
    let folder = folder(name);
    let work = WORK.replace("µ_free", "free");
    let paths = ["place.mtx", "work.mtx", "other.mtx"].map(|n| folder.join(n));
    let other = work.replace("free", "other");
    for (path, text) in paths.iter().zip([PLACE, &work, &other]) {
        fs::write(path, text).unwrap();
    }
    let [place, work_at, other_at] = paths.map(|p| uri(&p));
    let mut editor = Client::new(BINARY, "utf-8");
    editor.open(&place, PLACE);
    editor.open(&work_at, &work);
    for at in [&place, &work_at] {
        let found: Vec<Value> = editor.findings(at, 1).into_iter().filter(|d| d["severity"] != json!(4)).collect();
        assert!(found.is_empty(), "{found:?}");
    }
    (editor, place, work_at, other_at)
}

/// A question about the first place of a word, `at` bytes into it.
fn about(uri: &str, text: &str, word: &str, at: u64) -> Value {
    let mut position = range(text, word)["start"].clone();
    position["character"] = json!(position["character"].as_u64().unwrap() + at);
    json!({ "textDocument": { "uri": uri }, "position": position })
}

#[test]
fn names_lead_across_files_and_into_the_library() {
    let (mut editor, place, work_at, other_at) = package("names");
    let work = WORK.replace("µ_free", "free");
    // The thing of a lab, the skill, both in the other file.
    let found = editor.ask("textDocument/definition", about(&work_at, &work, "plate to goal", 0)).unwrap();
    assert_eq!(found, json!([{ "uri": place, "range": range(PLACE, "plate") }]));
    let found = editor.ask("textDocument/definition", about(&work_at, &work, "warm plate", 1)).unwrap();
    assert_eq!(found, json!([{ "uri": place, "range": range(PLACE, "warm") }]));
    // A member of the library lies in a file that can be opened, and asked about further.
    let found = editor.ask("textDocument/definition", about(&work_at, &work, "temperature >", 0)).unwrap();
    let library = found[0]["uri"].as_str().unwrap().to_string();
    let file = library.strip_prefix("file://").expect("a file of the cache");
    let text = fs::read_to_string(Path::new(file)).unwrap();
    let line = text.lines().nth(found[0]["range"]["start"]["line"].as_u64().unwrap() as usize).unwrap();
    assert!(line.contains("temperature: Temperature"), "{line}");
    editor.open(&library, &text);
    let asked = json!({ "textDocument": { "uri": library }, "position": found[0]["range"]["start"] });
    let hover = editor.ask("textDocument/hover", asked.clone()).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("temperature: Temperature"), "{hover}");
    assert!(
        editor.ask("textDocument/rename", renaming(&asked, "warmth")).unwrap_err()["message"]
            .as_str()
            .unwrap()
            .contains("standard library")
    );
    // Where the skill is named: here, there, and in a file that is not open.
    let mut asked = about(&place, PLACE, "warm(h", 0);
    asked["context"] = json!({ "includeDeclaration": true });
    let found = editor.ask("textDocument/references", asked).unwrap();
    let mut places: Vec<&str> = found.as_array().unwrap().iter().map(|l| l["uri"].as_str().unwrap()).collect();
    places.sort_unstable();
    assert_eq!(places, [other_at.as_str(), &place, &work_at]);
    let found = editor.ask("textDocument/documentHighlight", about(&work_at, &work, "goal:", 0)).unwrap();
    assert_eq!(found.as_array().unwrap().len(), 2);
    let found = editor.ask("textDocument/typeDefinition", about(&work_at, &work, "plate to", 0)).unwrap();
    assert!(found[0]["uri"].as_str().unwrap().ends_with("heating.mtx"), "{found}");
    // What is said of it.
    let hover = editor.ask("textDocument/hover", about(&work_at, &work, "warm plate", 0)).unwrap();
    let said = hover["contents"]["value"].as_str().unwrap();
    assert!(said.contains("Warms a device.") && said.contains("plate: "), "{said}");
    let hover = editor.ask("textDocument/hover", about(&work_at, &work, "goal:", 0)).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("40 degC = 313.15 K"), "{hover}");
    // By letters of their names, and by calls.
    let found = editor.ask("workspace/symbol", json!({ "query": "wrm" })).unwrap();
    assert_eq!(found[0]["name"], "warm", "{found}");
    assert_eq!(found.as_array().unwrap().len(), 1);
    let found = editor.ask("textDocument/prepareCallHierarchy", about(&work_at, &work, "warm plate", 0)).unwrap();
    let calls = editor.ask("callHierarchy/incomingCalls", json!({ "item": found[0] })).unwrap();
    let mut names: Vec<&str> = calls.as_array().unwrap().iter().map(|c| c["from"]["name"].as_str().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ["free", "other"]);
    let calls = editor.ask("callHierarchy/outgoingCalls", json!({ "item": found[0] })).unwrap();
    let names: Vec<&str> = calls.as_array().unwrap().iter().map(|c| c["to"]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["heat", "stop heating"]);
    assert_eq!(editor.close(), Some(0));
}

fn renaming(at: &Value, name: &str) -> Value {
    let mut asked = at.clone();
    asked["newName"] = json!(name);
    asked
}

#[test]
fn another_name_goes_through_all_files() {
    let (mut editor, place, work_at, other_at) = package("rename");
    let work = WORK.replace("µ_free", "free");
    let here = about(&work_at, &work, "plate to goal", 0);
    let range_ = editor.ask("textDocument/prepareRename", here.clone()).unwrap();
    assert_eq!(range_, json!({ "range": range(&work, "plate"), "placeholder": "plate" }));
    let found = editor.ask("textDocument/rename", renaming(&here, "hob")).unwrap();
    let changes = found["documentChanges"].as_array().unwrap();
    assert_eq!(changes.len(), 3, "{found}");
    for (at, text) in
        [(&place, PLACE.to_string()), (&work_at, work.clone()), (&other_at, work.replace("free", "other"))]
    {
        let change = changes.iter().find(|c| c["textDocument"]["uri"] == json!(at)).expect("a change of each file");
        let new = edited(&text, &change["edits"]);
        assert_eq!(new, text.replace("plate", "hob"));
    }
    let refused = |editor: &mut Client, at: Value, name: &str| {
        editor.ask("textDocument/rename", renaming(&at, name)).unwrap_err()["message"].as_str().unwrap().to_string()
    };
    assert_eq!(refused(&mut editor, here.clone(), "goal"), "`goal` is already the name of a parameter");
    assert_eq!(refused(&mut editor, here, "2x"), "`2x` cannot be the name of a thing in a lab");
    let refusal = editor.ask("textDocument/prepareRename", about(&work_at, &work, "temperature >", 0)).unwrap_err();
    assert_eq!(refusal["message"], "`temperature` belongs to the standard library");
    assert_eq!(editor.close(), Some(0));
}

#[test]
fn what_is_typed_is_completed() {
    let (mut editor, _, work_at, _) = package("complete");
    let work = WORK.replace("µ_free", "free");
    // A line that is not whole, behind signs of more than one byte.
    let text = work.replace("warm plate to goal", "warm pl");
    editor.change(&work_at, 2, None, &text);
    let found = editor.ask("textDocument/completion", about(&work_at, &text, "warm pl", 7)).unwrap();
    let items = found["items"].as_array().unwrap();
    let best = items.iter().min_by_key(|i| i["sortText"].as_str().unwrap().to_string()).unwrap();
    assert_eq!(best["label"], "plate");
    assert_eq!(best["textEdit"]["newText"], "plate");
    let start = about(&work_at, &text, "warm pl", 5)["position"].clone();
    assert_eq!(best["textEdit"]["range"]["start"], start);
    let resolved = editor.ask("completionItem/resolve", best.clone()).unwrap();
    assert!(resolved["documentation"]["value"].as_str().unwrap().contains("plate = IkaRetControl"), "{resolved}");
    let text = work.replace("warm plate to goal", "warm plate to ");
    editor.change(&work_at, 3, None, &text);
    let form = editor.ask("textDocument/signatureHelp", about(&work_at, &text, "plate to ", 9)).unwrap();
    assert_eq!(form["signatures"][0]["label"], "warm H to T");
    assert_eq!(form["activeParameter"], 1);
    assert_eq!(form["signatures"][0]["documentation"]["value"], "Warms a device.");
    assert_eq!(editor.close(), Some(0));
}
