//! Texts typed character by character: nothing ends the server, nothing stale is told, and what is told in the end is what `check` says.
//!
//! With `MATTERIX_REPLAY=all` every example is typed from its first character and cut at every byte; `.ci/peers` does so.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use super::client::Client;
use super::{BINARY, folder, uri};

/// A finding as both say it: its code, and its bytes.
type Finding = (String, usize, usize);

/// What `check` says of a file, without advice.
fn checked(path: &Path) -> Vec<Finding> {
    let output = Command::new(BINARY).args(["check", "--format", "json"]).arg(path).output().unwrap();
    let lines = String::from_utf8(output.stdout).unwrap();
    let finding = |line: &str| {
        let d: Value = serde_json::from_str(line).unwrap();
        let byte = |end: &str| d["span"][end]["byte"].as_u64().unwrap_or_default() as usize;
        (d["code"].as_str().unwrap().to_string(), byte("start"), byte("end"))
    };
    let mut all: Vec<Finding> = lines.lines().map(finding).collect();
    all.sort();
    all
}

/// What the editor was told of a text, without advice.
fn told(found: &[Value], text: &str) -> Vec<Finding> {
    let byte = |place: &Value| {
        let before: usize =
            text.split_inclusive('\n').take(place["line"].as_u64().unwrap() as usize).map(str::len).sum();
        before + place["character"].as_u64().unwrap() as usize
    };
    let serious = found.iter().filter(|d| d["severity"] != json!(4));
    let finding =
        |d: &Value| (d["code"].as_str().unwrap().to_string(), byte(&d["range"]["start"]), byte(&d["range"]["end"]));
    let mut all: Vec<Finding> = serious.map(finding).collect();
    all.sort();
    all
}

/// Types the rest of a text from a place on, without waiting, and asks about it meanwhile.
fn typed(editor: &mut Client, at: &str, text: &str, from: usize, mut version: i64) -> i64 {
    let mut end = super::range(text, "mtx")["start"].clone();
    let mut asked = Vec::new();
    for (i, c) in text.char_indices() {
        let next = match c {
            '\n' => json!({ "line": end["line"].as_u64().unwrap() + 1, "character": 0 }),
            c => json!({ "line": end["line"], "character": end["character"].as_u64().unwrap() + c.len_utf8() as u64 }),
        };
        if i >= from {
            version += 1;
            editor.change(at, version, Some(json!({ "start": end, "end": end })), &c.to_string());
            if i % 37 == 0 {
                let document = json!({ "uri": at });
                let place = json!({ "textDocument": document, "position": next });
                asked.push(editor.request("textDocument/hover", place.clone()));
                asked.push(editor.request("textDocument/completion", place));
                asked.push(editor.request("textDocument/semanticTokens/full", json!({ "textDocument": document })));
                asked.push(editor.request("textDocument/foldingRange", json!({ "textDocument": document })));
            }
        }
        end = next;
    }
    // Each is answered, whatever with.
    for id in asked {
        let _ = editor.answer(id);
    }
    version
}

#[test]
fn what_is_typed_is_told_as_it_is_checked() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let folder = folder("replay");
    let mut editor = Client::new(BINARY, "utf-8");
    for name in ["sn1", "faucet", "redox"] {
        let text = fs::read_to_string(examples.join(name).with_extension("mtx")).unwrap();
        let path = folder.join(name).with_extension("mtx");
        let at = uri(&path);
        // The last words one by one, after the others at once.
        let from = text.len() - 300;
        let from = (from..).find(|i| text.is_char_boundary(*i)).unwrap();
        editor.open(&at, &text[..from]);
        let version = typed(&mut editor, &at, &text, from, 1);
        fs::write(&path, &text).unwrap();
        assert_eq!(told(&editor.findings(&at, version), &text), checked(&path), "{name}");
        // Cut where it hurts.
        for (i, share) in [3, 5].into_iter().enumerate() {
            let cut = (text.len() / share..).find(|i| text.is_char_boundary(*i)).unwrap();
            let version = version + 1 + i as i64;
            editor.change(&at, version, None, &text[..cut]);
            fs::write(&path, &text[..cut]).unwrap();
            assert_eq!(told(&editor.findings(&at, version), &text[..cut]), checked(&path), "{name}, {cut} bytes");
        }
        editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": at } }));
    }
    assert_eq!(editor.close(), Some(0));
}

/// Of the cuts of a text, every so many is waited for, and of those every so many is compared with `check`.
const WAITED: usize = 16;
const COMPARED: usize = 31;

/// The files with examples in a folder and those below.
fn examples(folder: &Path, out: &mut Vec<std::path::PathBuf>) {
    for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => examples(&path, out),
            false => out.extend(Some(path).filter(|p| p.extension().is_some_and(|end| end == "mtx"))),
        }
    }
}

#[test]
fn every_example_is_typed_and_cut_where_that_is_asked_for() {
    if std::env::var("MATTERIX_REPLAY").as_deref() != Ok("all") {
        return;
    }
    let mut all = Vec::new();
    examples(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"), &mut all);
    all.sort();
    let folder = folder("replay_all");
    // What an example imports is whole.
    for path in &all {
        fs::copy(path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let mut cuts = 0;
    for path in all {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let copy = folder.join(path.file_name().unwrap());
        let mut editor = Client::new(BINARY, "utf-8");
        let at = uri(&copy);
        editor.open(&at, "");
        let mut version = typed(&mut editor, &at, &text, 0, 1);
        fs::write(&copy, &text).unwrap();
        assert_eq!(told(&editor.findings(&at, version), &text), checked(&copy), "{name}");
        for cut in (0..text.len()).filter(|i| text.is_char_boundary(*i)) {
            version += 1;
            cuts += 1;
            editor.change(&at, version, None, &text[..cut]);
            if cut % WAITED == 0 {
                let found = editor.findings(&at, version);
                if cut % (WAITED * COMPARED) == 0 {
                    fs::write(&copy, &text[..cut]).unwrap();
                    assert_eq!(told(&found, &text[..cut]), checked(&copy), "{name}, {cut} bytes");
                }
            }
        }
        fs::write(&copy, &text).unwrap();
        assert_eq!(editor.close(), Some(0), "{name}");
    }
    assert!(cuts > 10_000, "{cuts}");
}

#[test]
fn any_text_is_survived() {
    let mut editor = Client::new(BINARY, "utf-16");
    let at = uri(&folder("any").join("text.mtx"));
    let mut version = 1;
    editor.open(&at, "");
    let texts = [
        "",
        "{",
        "}}}}",
        "\u{1a}",
        "lab",
        "workflow a in b {",
        "\"",
        "mtx 1\nuse std::\n",
        "🧪µ°\r\r\n",
        "mtx 1\nlab x { a = ",
    ];
    for text in texts.iter().map(ToString::to_string).chain(["(".repeat(5000), "skill a(b: ".repeat(300)]) {
        version += 1;
        editor.change(&at, version, None, &text);
        editor.findings(&at, version);
        for line in [0, 1, 99] {
            let place = json!({ "textDocument": { "uri": at }, "position": { "line": line, "character": 4 } });
            let _ = editor.ask("textDocument/hover", place.clone());
            let _ = editor.ask("textDocument/completion", place);
        }
        for method in ["documentSymbol", "foldingRange", "semanticTokens/full"] {
            editor.ask(&format!("textDocument/{method}"), json!({ "textDocument": { "uri": at } })).unwrap();
        }
    }
    assert_eq!(editor.close(), Some(0));
}
