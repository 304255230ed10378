//! What the tutorial, the cookbook and the chapter on devices say that a command prints is what it prints.
//!
//! A `sh` block of one command with a `text` block right below it is run, with the nearest `mtx` block above as the file it
//! names, a `toml` block as `lab.toml` and a `csv` block as `data.csv`. A line `...` stands for any number of lines.
//! `MATTERIX_UPDATE` writes those without one.

use std::fs;
use std::path::Path;

use crate::harness::{folder, matterixc_in, root, write};
use crate::reference::{Block, blocks, cookbook, tutorial};

/// The words of a command line; those in quotes are one.
fn words(command: &str) -> Vec<String> {
    let mut out = Vec::new();
    for (index, piece) in command.split('"').enumerate() {
        if index % 2 == 1 {
            out.push(piece.to_string());
        } else {
            out.extend(piece.split_whitespace().map(str::to_string));
        }
    }
    out
}

/// What is wrong with what is said to be printed.
fn compare(said: &str, printed: &str) -> Option<String> {
    let mut rest = printed;
    if !said.lines().any(|l| l == "...") {
        return (said.trim_end() != printed.trim_end()).then(|| format!("it prints:\n{printed}"));
    }
    for part in format!("\n{said}\n").split("\n...\n").map(|p| p.trim_matches('\n')).filter(|p| !p.is_empty()) {
        let Some(at) = rest.find(part) else {
            return Some(format!("this is not in it:\n{part}\nit prints:\n{printed}"));
        };
        rest = &rest[at + part.len()..];
    }
    None
}

/// Runs the command of a block in a folder and gives what it prints.
fn printed(dir: &Path, command: &str, file: Option<&str>) -> String {
    let args = words(command);
    if let Some(text) = file {
        args.iter().filter(|a| a.ends_with(".mtx")).for_each(|name| drop(write(dir, name, text)));
    }
    let args: Vec<&str> = args.iter().skip(1).map(String::as_str).collect();
    let ended = matterixc_in(dir, &args);
    if ended.out.is_empty() { ended.err } else { ended.out }
}

/// Whether a block begins on the line after another one.
fn follows(above: &Block, below: &Block) -> bool {
    below.line == above.line + above.text.lines().count() + 2
}

#[test]
fn what_commands_are_said_to_print_is_what_they_print() {
    let update = std::env::var_os("MATTERIX_UPDATE").is_some();
    let mut wrong = Vec::new();
    for page in tutorial().into_iter().chain(cookbook()).chain(["docs/devices.md".to_string()]) {
        let text = fs::read_to_string(root().join(&page)).expect("the page can be read");
        let all = blocks(&text);
        let dir = folder(&format!("outputs_{}", page.replace(['/', '.'], "_")));
        let (mut file, mut mended) = (None, text.clone());
        for (index, block) in all.iter().enumerate() {
            match block.fence.as_str() {
                "toml" => drop(write(&dir, "lab.toml", &block.text)),
                "csv" => drop(write(&dir, "data.csv", &block.text)),
                fence if fence.starts_with("mtx") => file = Some(block.text.as_str()),
                "sh" => {
                    let Some(below) = all.get(index + 1).filter(|b| b.fence == "text" && follows(block, b)) else {
                        continue;
                    };
                    let printed = printed(&dir, &block.text, file);
                    let Some(why) = compare(&below.text, &printed) else { continue };
                    if update && !below.text.lines().any(|l| l == "...") {
                        let shown = |text: &str| format!("```\n```text\n{text}```\n");
                        mended = mended.replace(&shown(&below.text), &shown(&format!("{}\n", printed.trim_end())));
                    } else {
                        wrong.push(format!("{page}:{}: {}{why}", below.line, block.text));
                    }
                }
                _ => {}
            }
        }
        if mended != text {
            fs::write(root().join(&page), mended).expect("the page can be written");
        }
    }
    assert!(wrong.is_empty(), "{} outputs:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn outputs_are_compared_with_what_is_left_out() {
    assert_eq!(words("matterixc run a.mtx --set \"t=1 s\""), ["matterixc", "run", "a.mtx", "--set", "t=1 s"]);
    assert_eq!(compare("a\nb\n", "a\nb"), None);
    assert!(compare("a\n", "a\nb").is_some());
    assert_eq!(compare("a\n...\nc\n", "a\nb\nc\nd"), None);
    assert_eq!(compare("...\nc\n...\n", "a\nb\nc\nd"), None);
    assert!(compare("c\n...\na\n", "a\nb\nc").is_some());
}
