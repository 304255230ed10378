//! The reference pages: every example yields what its fence promises, and nothing in the library goes unnamed.

use std::fs;

use matterix_ir::FileId;
use matterix_lang::ast::{ItemKind, MemberKind, Name};
use matterix_lang::{library, syntax};

use crate::harness::{Ended, folder, matterixc_in, names, root, write};

/// Pages whose `mtx` blocks run as tests.
const PAGES: [&str; 5] = ["docs/language.md", "docs/library.md", "docs/devices.md", "docs/sila.md", "README.md"];

/// Folders of pages whose `mtx` blocks also are in the style.
const TUTORIAL: &str = "docs/tutorial";
const COOKBOOK: &str = "docs/cookbook";

/// A fenced block of a page.
#[derive(Debug, PartialEq, Eq)]
pub struct Block {
    /// Line of its opening fence.
    pub line: usize,
    /// What stands behind its opening fence.
    pub fence: String,
    /// What is in it.
    pub text: String,
}

/// The fenced blocks of a page.
pub fn blocks(page: &str) -> Vec<Block> {
    let mut out: Vec<Block> = Vec::new();
    let mut open = false;
    for (index, line) in page.lines().enumerate() {
        match line.strip_prefix("```") {
            Some("") if open => open = false,
            Some(fence) => {
                out.push(Block { line: index + 1, fence: fence.to_string(), text: String::new() });
                open = true;
            }
            None if open => {
                let text = out.last_mut().map(|b| &mut b.text);
                text.into_iter().for_each(|t| *t += &format!("{line}\n"));
            }
            None => {}
        }
    }
    assert!(!open, "a block is not closed");
    out
}

/// Codes of the findings, each once.
fn codes(lines: &[serde_json::Value]) -> Vec<&str> {
    let mut codes: Vec<&str> = lines.iter().filter_map(|l| l["code"].as_str()).collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

/// Whether a block yields what its fence promises; in words if not. A table of its page lies beside it as `data.csv`.
fn verify(name: &str, block: &Block, table: Option<&str>, styled: bool) -> Result<(), String> {
    let fence = block.fence.as_str();
    if matches!(fence, "text" | "sh" | "toml" | "json" | "csv" | "ebnf") {
        return Ok(());
    }
    let dir = folder(name);
    write(&dir, "example.mtx", &block.text);
    if let Some(table) = table {
        write(&dir, "data.csv", table);
    }
    if styled && matterixc_in(&dir, &["fmt", "--check", "example.mtx"]).code != 0 {
        return Err("is not in the style of `matterixc fmt`".to_string());
    }
    let check = || matterixc_in(&dir, &["check", "example.mtx", "--format", "json"]);
    let run = || matterixc_in(&dir, &["run", "example.mtx", "--format", "json"]);
    let clean = |ended: &Ended, lines: &[serde_json::Value]| match codes(lines).as_slice() {
        [] if ended.code == 0 => Ok(()),
        found => Err(format!("exit status {}, findings {found:?}\n{}", ended.code, ended.err)),
    };
    if let Some(code) = fence.strip_prefix("mtx error[").and_then(|rest| rest.strip_suffix(']')) {
        let code = matterix_ir::codes::find(code).ok_or("there is no such code")?;
        let lines = if code.family.starts_with('X') { run().err_lines() } else { check().out_lines() };
        let found = codes(&lines);
        return if found == [code.name] { Ok(()) } else { Err(format!("yields {found:?}")) };
    }
    if !matches!(fence, "mtx" | "mtx run") {
        return Err("no such kind of block".to_string());
    }
    let checked = check();
    clean(&checked, &checked.out_lines())?;
    if fence == "mtx run" {
        let ran = run();
        clean(&ran, &ran.err_lines())?;
    }
    Ok(())
}

/// Goes through the blocks of pages; where `styled`, they are in the style of `fmt`, too.
fn verify_pages(pages: &[String], styled: bool) {
    let mut wrong = Vec::new();
    for page in pages {
        let text = fs::read_to_string(root().join(page)).expect("the page can be read");
        let all = blocks(&text);
        let table = all.iter().find(|b| b.fence == "csv").map(|b| b.text.as_str());
        for block in &all {
            let name = format!("reference_{}_{}", page.replace(['/', '.'], "_"), block.line);
            let found = verify(&name, block, table, styled).err();
            wrong.extend(found.map(|e| format!("{page}:{}: `{}`: {e}", block.line, block.fence)));
        }
    }
    assert!(wrong.is_empty(), "{} blocks:\n{}", wrong.len(), wrong.join("\n"));
}

/// The pages of a folder, by their paths from the top.
fn pages_in(folder: &str) -> Vec<String> {
    let pages = names(&root().join(folder)).into_iter().filter(|n| n.ends_with(".md"));
    pages.map(|n| format!("{folder}/{n}")).collect()
}

/// The pages of the tutorial.
pub fn tutorial() -> Vec<String> {
    pages_in(TUTORIAL)
}

/// The pages of the cookbook.
pub fn cookbook() -> Vec<String> {
    pages_in(COOKBOOK)
}

#[test]
fn every_example_yields_what_its_fence_promises() {
    verify_pages(&PAGES.map(str::to_string), false);
}

#[test]
fn every_example_of_the_tutorial_yields_what_its_fence_promises() {
    verify_pages(&tutorial(), true);
}

#[test]
fn every_recipe_yields_what_its_fence_promises() {
    verify_pages(&cookbook(), true);
}

#[test]
fn every_example_for_programs_yields_what_its_fence_promises() {
    verify_pages(&["docs/for-programs.md".to_string()], true);
}

fn verb(words: &[Name]) -> String {
    words.iter().map(|w| w.text.as_str()).collect::<Vec<_>>().join(" ")
}

/// What a module of the library offers: a name, and how the page may begin to write it.
fn offered(text: &str) -> Vec<String> {
    let (tree, found) = syntax::parse(FileId(0), text);
    assert!(found.is_empty(), "the library parses");
    let mut out = Vec::new();
    for item in &tree.items {
        match &item.kind {
            ItemKind::Capability { name, members, .. } => {
                out.push(format!("`{}`", name.text));
                out.extend(members.iter().filter_map(|m| match &m.kind {
                    MemberKind::Command { sig, .. } => Some(format!("`{}", verb(&sig.verb))),
                    MemberKind::Value { name, .. } => Some(format!("`{}`", name.text)),
                    MemberKind::Process(p) => Some(format!("`{}`", p.name.text)),
                    _ => None,
                }));
            }
            ItemKind::Skill { sig, .. } => out.push(format!("`{}", verb(&sig.verb))),
            ItemKind::Asset { name, .. } | ItemKind::Species { name, .. } | ItemKind::Const { name, .. } => {
                out.push(format!("`{}`", name.text));
            }
            ItemKind::Fn { name, .. } | ItemKind::Relation { name, .. } => out.push(format!("`{}(", name.text)),
            ItemKind::Process(p) => out.push(format!("`{}`", p.name.text)),
            ItemKind::Event(e) => out.push(format!("`{}`", e.name.text)),
            ItemKind::ReactiveGroup { name, .. } | ItemKind::Material { name, .. } | ItemKind::Hazard { name, .. } => {
                out.push(format!("`{}`", name.text))
            }
            ItemKind::Dimension { name, .. } => out.push(format!("`{}`", name.text)),
            ItemKind::Unit { name, .. } => out.push(format!("`{}`", name.text)),
            _ => {}
        }
    }
    out
}

#[test]
fn the_library_page_names_everything_the_library_offers() {
    let page = fs::read_to_string(root().join("docs/library.md")).expect("the page can be read");
    let mut missing = Vec::new();
    for library::Module { name: module, text, apart, .. } in library::MODULES {
        let (_, section) =
            page.split_once(&format!("## `{module}`")).unwrap_or_else(|| panic!("no section on {module}"));
        let section = section.split("\n## ").next().unwrap_or_default();
        let absent = |name: &String| {
            let ends = |c: char| !c.is_alphanumeric() && c != '_';
            !section
                .match_indices(name.as_str())
                .any(|(at, found)| found.ends_with(['`', '(']) || section[at + found.len()..].starts_with(ends))
        };
        // A table of substances has a page of its own, and `matterixc substance`.
        if !apart.is_empty() {
            continue;
        }
        missing.extend(offered(text).into_iter().filter(absent).map(|name| format!("{module}: {name}")));
    }
    assert!(missing.is_empty(), "docs/library.md does not name:\n{}", missing.join("\n"));
}

#[test]
fn what_would_have_no_effect_is_reported() {
    let cases = [
        ("capability A { state x: Bool = false { unti: true } }", "unknown-field"),
        ("capability A { param x: Ratio = 3 { at_leats: 0 } }", "unknown-field"),
        ("capability A { reading x: Ratio = 3 { settle: 2 s } }", "unknown-field"),
        ("capability A { derived x: Ratio = 3 { hiden: true } }", "unknown-field"),
        ("reaction r: EtOH -> EtOH { rate: 1 1/s, order: { EtOH: 1 }, requires: true and 3 }", "type-mismatch"),
        ("fn f(x: Ratio) -> Ratio = x { at_laest: 0 }", "unknown-field"),
        ("dimension Mass = Length", "duplicate-name"),
    ];
    for (index, (text, code)) in cases.iter().enumerate() {
        let dir = folder(&format!("reference_ignored_{index}"));
        write(&dir, "example.mtx", format!("mtx 1\n{text}\n"));
        let ended = matterixc_in(&dir, &["check", "example.mtx", "--format", "json"]);
        assert_eq!(codes(&ended.out_lines()), [*code], "{text}");
    }
}

#[test]
fn what_the_run_itself_raises_can_be_handled_by_name() {
    let text = "mtx 1\nuse std::heating::IkaRetControl\n\
        lab bench { ambient: 22 degC, plate = IkaRetControl at (0, 0, 0) m }\n\
        skill careful(p: Heater) needs p is active { wait 1 s }\n\
        skill boastful(p: Heater) effect p.active = true { wait 1 s }\n\
        workflow w in bench {\n\
        sequence { careful plate } on need { note \"need\" }\n\
        sequence { boastful plate } on promise { note \"promise\" }\n\
        sequence { parallel { heat plate to 30 degC; heat plate to 40 degC } } on claimed { note \"claimed\" }\n\
        start a = { wait 9 s }\n\
        sequence { start a = { wait 9 s } } on job { note \"job\" }\n} finally { stop heating plate }\n";
    let dir = folder("reference_failures");
    write(&dir, "example.mtx", text);
    let ended = matterixc_in(&dir, &["run", "example.mtx"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    for name in ["need", "promise", "claimed", "job"] {
        let noted = ended.out.lines().any(|l| l.split_once(" s ").is_some_and(|(_, text)| text.trim() == name));
        assert!(noted, "{name}:\n{}", ended.out);
    }
}

#[test]
fn blocks_are_taken_apart() {
    let found = blocks("a\n```mtx run\nmtx 1\n```\n```text\n```\n");
    let shown: Vec<_> = found.iter().map(|b| (b.line, b.fence.as_str(), b.text.as_str())).collect();
    assert_eq!(shown, [(2, "mtx run", "mtx 1\n"), (5, "text", "")]);
}
