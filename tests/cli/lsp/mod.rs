//! The language server, as an editor sees it.

#![allow(clippy::unwrap_used)]

mod client;
mod names;
mod replay;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use client::Client;

const BINARY: &str = env!("CARGO_BIN_EXE_matterixc");

const TEXT: &str = "mtx 1\n\nuse std::heating\n\nlab bench {\n    ambient: 25 degC\n    plate = IkaRetControl\n}\n\n\
    workflow warm in bench {\n    step heating {\n        heat plate to 40 degC\n    }\n    stop heating plate\n}\n";

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lsp").join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// The range of a word, columns in bytes.
fn range(text: &str, word: &str) -> Value {
    let at = text.find(word).unwrap();
    let place = |at: usize| {
        let line = text[..at].matches('\n').count();
        json!({ "line": line, "character": at - text[..at].rfind('\n').map_or(0, |end| end + 1) })
    };
    json!({ "start": place(at), "end": place(at + word.len()) })
}

fn codes(found: &[Value]) -> Vec<&str> {
    found.iter().filter(|d| d["severity"] != json!(4)).filter_map(|d| d["code"].as_str()).collect()
}

/// A text with edits of the protocol applied, columns in bytes.
fn edited(text: &str, edits: &Value) -> String {
    let offset = |place: &Value| {
        let before: usize =
            text.split_inclusive('\n').take(place["line"].as_u64().unwrap() as usize).map(str::len).sum();
        before + place["character"].as_u64().unwrap() as usize
    };
    let mut out = text.to_string();
    let mut edits = edits.as_array().unwrap().clone();
    edits.sort_by_key(|edit| std::cmp::Reverse(offset(&edit["range"]["start"])));
    for edit in &edits {
        let range = &edit["range"];
        out.replace_range(offset(&range["start"])..offset(&range["end"]), edit["newText"].as_str().unwrap());
    }
    out
}

#[test]
fn a_session_from_the_first_word_to_the_last() {
    let mut editor = Client::new(BINARY, "utf-8");
    let at = uri(&folder("session").join("warm.mtx"));
    let here = json!({ "uri": at });
    editor.open(&at, TEXT);
    assert_eq!(codes(&editor.findings(&at, 1)), [""; 0]);

    // A fault, typed character by character.
    let mut text = TEXT.to_string();
    let place = TEXT.find("heat plate").unwrap();
    let start = range(TEXT, "heat plate")["start"].clone();
    let mut version = 1;
    for (i, c) in "heet plate to 9 kg\n        ".char_indices() {
        let mut at_c = start.clone();
        if i > 0 {
            at_c["character"] = json!(start["character"].as_u64().unwrap() + i as u64);
        }
        version += 1;
        editor.change(&at, version, Some(json!({ "start": at_c, "end": at_c })), &c.to_string());
        text.insert(place + i, c);
        if c == '\n' {
            break;
        }
    }
    let found = editor.findings(&at, version);
    let fault = found.iter().find(|d| d["code"] == "unknown-verb").expect("the fault is found");
    assert_eq!(fault["range"], range(&text, "heet"));
    assert!(fault["codeDescription"]["href"].as_str().unwrap().ends_with("codes/unknown-verb.md"));

    // Its correction, applied.
    let asked = json!({ "textDocument": here, "range": range(&text, "heet"), "context": { "diagnostics": [] } });
    let actions = editor.ask("textDocument/codeAction", asked).unwrap();
    let action = actions.as_array().unwrap().iter().find(|a| a["kind"] == "quickfix").expect("a correction");
    text = edited(&text, &action["edit"]["changes"][&at]);
    assert!(text.contains("heat plate to 9 kg"), "{text}");
    version += 1;
    editor.change(&at, version, None, &text);
    assert!(!codes(&editor.findings(&at, version)).is_empty(), "a mass is no temperature");

    // Back to the beginning, with blanks too many.
    text = TEXT.replace("heat plate to", "heat   plate to");
    version += 1;
    editor.change(&at, version, None, &text);
    assert_eq!(codes(&editor.findings(&at, version)), [""; 0]);
    let style = json!({ "tabSize": 4, "insertSpaces": true });
    let edits = editor.ask("textDocument/formatting", json!({ "textDocument": here, "options": style })).unwrap();
    assert_eq!(edited(&text, &edits), TEXT);
    let first = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 3, "character": 0 } });
    let asked = json!({ "textDocument": here, "options": style, "range": first });
    assert_eq!(editor.ask("textDocument/rangeFormatting", asked), Ok(json!([])));

    // What is known of the text.
    let place = range(&text, "heat   plate")["start"].clone();
    let hover = editor.ask("textDocument/hover", json!({ "textDocument": here, "position": place })).unwrap();
    let said = hover["contents"]["value"].as_str().unwrap();
    assert!(said.contains("plate: ") && said.contains("target 40 degC"), "{said}");
    let symbols = editor.ask("textDocument/documentSymbol", json!({ "textDocument": here })).unwrap();
    let names: Vec<&str> = symbols.as_array().unwrap().iter().filter_map(|s| s["name"].as_str()).collect();
    assert_eq!(names, ["bench", "warm"]);
    assert_eq!(symbols[1]["children"][0]["name"], "heating");
    let folds = editor.ask("textDocument/foldingRange", json!({ "textDocument": here })).unwrap();
    assert_eq!(folds.as_array().unwrap().len(), 3);
    let all = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let hints = editor.ask("textDocument/inlayHint", json!({ "textDocument": here, "range": all })).unwrap();
    assert_eq!(hints[0]["label"], "at 0 s");

    // Colours, and what becomes different of them.
    let tokens = editor.ask("textDocument/semanticTokens/full", json!({ "textDocument": here })).unwrap();
    let data = tokens["data"].as_array().unwrap().clone();
    assert_eq!(data.len() % 5, 0);
    version += 1;
    editor.change(&at, version, None, TEXT);
    let asked = json!({ "textDocument": here, "previousResultId": tokens["resultId"] });
    let delta = editor.ask("textDocument/semanticTokens/full/delta", asked).unwrap();
    let mut patched = data;
    for edit in delta["edits"].as_array().unwrap() {
        let start = edit["start"].as_u64().unwrap() as usize;
        let gone = edit["deleteCount"].as_u64().unwrap() as usize;
        patched.splice(start..start + gone, edit["data"].as_array().unwrap().iter().cloned());
    }
    let anew = editor.ask("textDocument/semanticTokens/full", json!({ "textDocument": here })).unwrap();
    assert_eq!(json!(patched), anew["data"]);
    assert_eq!(editor.close(), Some(0));
}

#[test]
fn columns_are_counted_as_agreed() {
    let text = TEXT.replace("    stop heating plate", "    note \"µL °C 🧪\"; stop heating plote\r");
    for (encoding, column) in [("utf-8", 38), ("utf-16", 34), ("utf-32", 33)] {
        let mut editor = Client::new(BINARY, encoding);
        assert_eq!(editor.server["capabilities"]["positionEncoding"], encoding);
        let at = uri(&folder("columns").join("signs.mtx"));
        editor.open(&at, &text);
        let found = editor.findings(&at, 1);
        let fault = found.iter().find(|d| d["severity"] == json!(1)).expect("`plote` is not known");
        assert_eq!(fault["range"]["start"]["character"], column, "{encoding}: {found:?}");
        // An edit behind the signs mends it.
        let start = json!({ "line": fault["range"]["start"]["line"], "character": column + 2 });
        let end = json!({ "line": start["line"], "character": column + 3 });
        editor.change(&at, 2, Some(json!({ "start": start, "end": end })), "a");
        assert_eq!(codes(&editor.findings(&at, 2)), [""; 0], "{encoding}");
        assert_eq!(editor.close(), Some(0));
    }
}

#[test]
fn what_is_open_counts_for_what_imports_it() {
    let folder = folder("package");
    let (lab, use_) = (folder.join("place.mtx"), folder.join("work.mtx"));
    let lab_text = "mtx 1\n\nuse std::heating\n\nlab bench {\n    ambient: 25 degC\n    plate = IkaRetControl\n}\n";
    let work = "mtx 1\n\nuse std::heating\nuse place\n\nworkflow warm in bench {\n    heat plate to 40 degC\n    stop heating plate\n}\n";
    fs::write(&lab, lab_text).unwrap();
    fs::write(&use_, work).unwrap();
    let mut editor = Client::new(BINARY, "utf-8");
    editor.open(&uri(&use_), work);
    assert_eq!(codes(&editor.findings(&uri(&use_), 1)), [""; 0]);
    editor.open(&uri(&lab), lab_text);
    editor.findings(&uri(&lab), 1);
    // The thing gets another name in the text that is open, not on the disk.
    editor.change(&uri(&lab), 2, None, &lab_text.replace("plate =", "other ="));
    editor.findings(&uri(&lab), 2);
    while codes(&editor.told[&uri(&use_)].1).is_empty() {
        editor.next();
    }
    // A mistake of a text is told of that text alone.
    editor.change(&uri(&lab), 3, None, &lab_text.replace("IkaRetControl", "IkaRot"));
    assert!(!codes(&editor.findings(&uri(&lab), 3)).is_empty());
    // Closed, the text on the disk counts.
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": uri(&lab) } }));
    while !codes(&editor.told[&uri(&use_)].1).is_empty() || !editor.told[&uri(&lab)].1.is_empty() {
        editor.next();
    }
    assert_eq!(editor.close(), Some(0));
}

#[test]
fn what_is_no_message_is_passed_over() {
    let mut editor = Client::stranger(BINARY);
    let refused = editor.ask("textDocument/hover", json!({})).unwrap_err();
    assert_eq!(refused["code"], -32002);
    editor.write(b"nonsense\r\nContent-Length: 3\r\n\r\n{{{");
    editor.ask("initialize", json!({ "capabilities": {} })).unwrap();
    editor.tell("initialized", json!({}));
    editor.tell("textDocument/didChange", json!({ "textDocument": 5 }));
    editor.change("file:///nobody.mtx", 7, None, "x");
    editor.tell("no/such", json!(null));
    assert_eq!(editor.ask("no/such", json!(null)).unwrap_err()["code"], -32601);
    assert_eq!(editor.ask("textDocument/hover", json!(3)).unwrap_err()["code"], -32602);
    let nowhere = json!({ "textDocument": { "uri": "untitled:1" }, "position": { "line": 5, "character": 5 } });
    assert_eq!(editor.ask("textDocument/hover", nowhere.clone()), Ok(Value::Null));
    editor.open("untitled:1", "mtx 1\nuse beside\n");
    assert_eq!(codes(&editor.findings("untitled:1", 1)), ["unknown-module"]);
    assert_eq!(editor.ask("textDocument/hover", nowhere), Ok(Value::Null));
    // Nothing but an end is answered after the request to end.
    assert_eq!(editor.ask("shutdown", Value::Null), Ok(Value::Null));
    assert_eq!(editor.ask("shutdown", Value::Null).unwrap_err()["code"], -32600);
    editor.tell("exit", Value::Null);
    assert_eq!(editor.end(), Some(0));
    // An end that was not asked for is a failure.
    let editor = Client::new(BINARY, "utf-16");
    assert_eq!(editor.end(), Some(1));
}

#[test]
fn requests_can_be_taken_back() {
    let mut editor = Client::new(BINARY, "utf-16");
    let at = uri(&folder("taken").join("back.mtx"));
    editor.open(&at, TEXT);
    let asked = json!({ "textDocument": { "uri": at } });
    let ids: Vec<i64> = (0..20).map(|_| editor.request("textDocument/documentSymbol", asked.clone())).collect();
    for id in &ids {
        editor.tell("$/cancelRequest", json!({ "id": id }));
    }
    for id in ids {
        // Whichever was answered before it was taken back.
        if let Err(error) = editor.answer(id) {
            assert_eq!(error["code"], -32800);
        }
    }
    assert_eq!(editor.close(), Some(0));
}

#[test]
fn what_is_asked_before_the_first_check_waits_for_it() {
    let mut editor = Client::new(BINARY, "utf-8");
    let at = uri(&folder("first").join("warm.mtx"));
    let here = json!({ "uri": at });
    editor.open(&at, TEXT);
    let place = range(TEXT, "plate to 40")["start"].clone();
    let about = json!({ "textDocument": here, "position": place });
    let all = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let in_all = json!({ "textDocument": here, "range": all });
    let ask = |editor: &mut Client, what: &str, params: &Value| {
        editor.request(&format!("textDocument/{what}"), params.clone())
    };
    let hover = ask(&mut editor, "hover", &about);
    let hints = ask(&mut editor, "inlayHint", &in_all);
    let taken_back = ask(&mut editor, "completion", &about);
    editor.tell("$/cancelRequest", json!({ "id": taken_back }));
    let prepared = ask(&mut editor, "prepareRename", &about);
    let folds = ask(&mut editor, "foldingRange", &json!({ "textDocument": here }));
    // What comes from the text alone does not wait.
    assert_eq!(editor.answer(folds).unwrap().as_array().unwrap().len(), 3);
    assert_eq!(editor.answer(taken_back).unwrap_err()["code"], json!(-32800));
    let said = editor.answer(hover).unwrap();
    assert!(said["contents"]["value"].as_str().unwrap().contains("target 40 degC"), "{said}");
    assert_eq!(editor.answer(hints).unwrap()[0]["label"], "at 0 s");
    assert_eq!(editor.answer(prepared).unwrap()["range"]["start"], place);

    // Where the text changes meanwhile the place is another.
    let other = uri(&folder("first").join("other.mtx"));
    editor.open(&other, TEXT);
    let about = json!({ "textDocument": { "uri": other }, "position": place });
    let early = ask(&mut editor, "definition", &about);
    editor.change(&other, 2, None, TEXT);
    let late = ask(&mut editor, "definition", &about);
    if let Err(error) = editor.answer(early) {
        assert_eq!(error["code"], json!(-32801));
    }
    assert_eq!(editor.answer(late).unwrap()[0]["uri"], json!(other));
    assert_eq!(editor.close(), Some(0));
}
