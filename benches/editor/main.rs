//! How soon an editor is answered: `cargo bench --bench editor`. A file of 1,000 lines in a package of 30; docs/notes/performance.md says what is
//! meant by each line.

#![allow(clippy::unwrap_used)]

#[path = "../../tests/cli/lsp/client.rs"]
mod client;
#[path = "../speed/generate.rs"]
mod generate;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use client::Client;

/// Files beside the one that is typed in.
const BESIDE: usize = 29;

/// Lines of the one that is typed in.
const LINES: usize = 1000;

/// Edits after which memory is looked at.
const EDITS: i64 = 10_000;

fn main() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("editor");
    fs::create_dir_all(&folder).unwrap();
    let text = package(&folder);
    println!("{} lines, {} files beside them\n", text.lines().count(), BESIDE);
    let mut bench = Bench::new(&folder, text);
    // A digit in a workflow, a word in it, a statement that is not whole yet, a number of a lab, constants.
    let places: [(&str, &str, &[&str]); 7] = [
        ("a number in a workflow", "wait ", &["1", "2", "3", ""]),
        ("a word in a workflow", "pour ", &["x", "xy", "x", ""]),
        (
            "a new line in a workflow",
            "    note \"warm enough\"\n",
            &["        w", "        wait", "        wait 5 s\n", ""],
        ),
        ("a number in a lab", "ambient: ", &["1", ""]),
        ("a constant that no workflow names", "const warm1 = ", &["1", ""]),
        ("a constant that one workflow names", "const settle = ", &["1", ""]),
        ("a constant that all workflows name", "const pause = ", &["1", ""]),
    ];
    for (what, before, typed) in places {
        bench.keystrokes(what, before, typed, 200);
    }
    bench.asked("hover", "textDocument/hover", false);
    bench.asked("completion", "textDocument/completion", false);
    bench.asked("hover, right after a keystroke", "textDocument/hover", true);
    bench.asked("completion, right after a keystroke", "textDocument/completion", true);
    bench.memory();
    assert_eq!(bench.editor.close(), Some(0));
}

/// Writes a package without findings; the text that imports all the others.
fn package(folder: &Path) -> String {
    let mut uses = String::new();
    for n in 0..BESIDE {
        let name = format!("part{n}");
        let text = format!(
            "mtx 1\n//! Part {n}.\n\nuse std::heating\n\nconst rest{n} = {} s\n\nskill pause{n}(h: Heater) {{\n    heat h to 30 degC\n    wait rest{n}\n    stop h\n}}\n",
            5 + n
        );
        fs::write(folder.join(&name).with_extension("mtx"), text).unwrap();
        uses.push_str(&format!("use {name}\n"));
    }
    let text = generate::program(LINES - BESIDE).replacen("\nuse ", &format!("\n{uses}use "), 1);
    let text = text.replacen("/// Family", "const settle = 1 s\nconst pause = 10 s\n\n/// Family", 1);
    let text = text.replacen("wait 1 s\n", "wait settle\n", 1).replace("wait 10 s\n", "wait pause\n");
    fs::write(folder.join("main.mtx"), &text).unwrap();
    text
}

struct Bench {
    editor: Client,
    uri: String,
    text: String,
    version: i64,
}

impl Bench {
    fn new(folder: &Path, text: String) -> Bench {
        let mut editor = Client::new(env!("CARGO_BIN_EXE_matterixc"), "utf-8");
        let uri = format!("file://{}", folder.join("main.mtx").display());
        let began = now();
        editor.open(&uri, &text);
        let found = editor.findings(&uri, 1);
        println!("{:<48} {:>8.1} ms", "the first findings", ms(began.elapsed()));
        let serious: Vec<&Value> = found.iter().filter(|d| d["severity"] != json!(4)).collect();
        assert!(serious.is_empty(), "{serious:?}");
        Bench { editor, uri, text, version: 1 }
    }

    /// Puts `typed` in the place of `len` bytes of the text.
    fn edit(&mut self, at: usize, len: usize, typed: &str) {
        let range = json!({ "start": place(&self.text, at), "end": place(&self.text, at + len) });
        self.text.replace_range(at..at + len, typed);
        self.version += 1;
        self.editor.change(&self.uri, self.version, Some(range), typed);
    }

    /// Times from a keystroke to the findings of the text with it.
    fn keystrokes(&mut self, what: &str, before: &str, typed: &[&str], count: usize) {
        let places: Vec<usize> = self.text.match_indices(before).map(|(at, _)| at + before.len()).collect();
        let mut times = Vec::new();
        for round in 0..count.div_ceil(typed.len()) {
            let at = places[round * 7 % places.len()];
            let mut there = 0;
            for new in typed {
                let began = now();
                self.edit(at, there, new);
                self.editor.findings(&self.uri, self.version);
                times.push(began.elapsed());
                there = new.len();
            }
        }
        show(what, times);
    }

    /// Times of answers, at places all over the text.
    fn asked(&mut self, what: &str, method: &str, typing: bool) {
        let places: Vec<usize> = self.text.match_indices("heat hotplate").map(|(at, _)| at).collect();
        let mut times = Vec::new();
        for round in 0..100 {
            let at = places[round * 5 % places.len()];
            if typing {
                self.edit(at + "heat".len(), 0, " ");
            }
            let asked = json!({ "textDocument": { "uri": self.uri }, "position": place(&self.text, at + 2) });
            let began = now();
            let _ = self.editor.ask(method, asked);
            times.push(began.elapsed());
            if typing {
                self.editor.findings(&self.uri, self.version);
                self.edit(at + "heat".len(), 1, "");
                self.editor.findings(&self.uri, self.version);
            }
        }
        show(what, times);
    }

    /// What the server takes of memory, before and after many edits.
    fn memory(&mut self) {
        let at = self.text.find("wait ").unwrap() + "wait ".len();
        for n in 1..=EDITS {
            self.edit(at, usize::from(n % 2 == 0), if n % 2 == 1 { "1" } else { "" });
            self.editor.findings(&self.uri, self.version);
            if n == EDITS / 10 || n % (EDITS / 4) == 0 {
                println!("{:<48} {:>8.1} MB", format!("memory after {n} edits more"), resident(self.editor.process()));
            }
        }
    }
}

/// Line and column in bytes.
fn place(text: &str, at: usize) -> Value {
    let before = &text[..at];
    json!({ "line": before.matches('\n').count(), "character": at - before.rfind('\n').map_or(0, |end| end + 1) })
}

/// MB that a process has in memory; none where the system does not tell.
fn resident(process: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}

#[expect(clippy::disallowed_methods, reason = "to measure is what a benchmark is for")]
fn now() -> Instant {
    Instant::now()
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

fn show(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let at = |share: f64| ms(times[((times.len() - 1) as f64 * share).round() as usize]);
    println!("{what:<48} {:>8.1} ms, 99 of 100 within {:.1} ms", at(0.5), at(0.99));
}
