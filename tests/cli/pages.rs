//! The pages of the diagnostic codes: their form, the index, and that every example yields what it promises.

use std::fs;

use matterix_ir::{Code, codes};

use crate::harness::{Ended, folder, matterixc, matterixc_in, names, root, write};

const SECTIONS: [&str; 3] = ["What it means", "Example", "Mended"];

/// A page, taken apart.
#[derive(Debug, PartialEq, Eq)]
struct Page<'a> {
    title: &'a str,
    sections: Vec<(&'a str, Section)>,
}

/// Prose and blocks of one section.
#[derive(Debug, Default, PartialEq, Eq)]
struct Section {
    prose: String,
    blocks: Vec<String>,
    /// Whether it shows what is no file.
    has_text: bool,
}

impl<'a> Page<'a> {
    fn parse(text: &'a str) -> Result<Page<'a>, String> {
        let mut lines = text.lines();
        let title = lines.next().and_then(|l| l.strip_prefix("# ")).ok_or("the first line is not `# CODE`")?;
        let mut sections: Vec<(&str, Section)> = Vec::new();
        let mut block: Option<String> = None;
        for line in lines {
            let section = sections.last_mut().map(|(_, section)| section);
            match (line.strip_prefix("## "), section, block.take()) {
                (_, Some(section), Some(text)) if line == "```" => section.blocks.push(text),
                (_, Some(_), Some(text)) => block = Some(text + line + "\n"),
                (None, Some(section), None) if line == "```text" => {
                    section.has_text = true;
                    section.prose += line;
                }
                (Some(name), ..) => sections.push((name, Section::default())),
                (None, Some(_), None) if line == "```mtx" => block = Some(String::new()),
                (None, Some(section), None) => section.prose += line,
                (None, None, _) if line.is_empty() => {}
                (None, None, _) => return Err(format!("`{line}` stands before the first section")),
            }
        }
        if block.is_some() { Err("a block is not closed".to_string()) } else { Ok(Page { title, sections }) }
    }

    /// The faulty and the mended file, if files alone can show the finding; `Err` where the page is not of the promised form.
    fn examples(&self, code: &str) -> Result<Option<(&str, &str)>, String> {
        if self.title != code {
            return Err(format!("the title is `{}`", self.title));
        }
        let found: Vec<&str> = self.sections.iter().map(|(name, _)| *name).collect();
        if found != SECTIONS {
            return Err(format!("the sections are {found:?}, not {SECTIONS:?}"));
        }
        if self.sections[0].1.prose.trim().is_empty() {
            return Err("`What it means` says nothing".to_string());
        }
        let (example, mended) = (&self.sections[1].1, &self.sections[2].1);
        match (example.blocks.as_slice(), mended.blocks.as_slice()) {
            ([faulty], [mended]) => Ok(Some((faulty, mended))),
            ([], []) if example.has_text => Ok(None),
            _ => Err("`Example` and `Mended` have one `mtx` block each".to_string()),
        }
    }
}

/// Codes of the findings of a file, from the command that can find this kind.
fn found(code: &Code, text: &str, name: &str, strict: bool) -> (Vec<String>, Ended) {
    let dir = folder(&format!("pages_{}_{name}", code.name));
    write(&dir, "example.mtx", text);
    let while_running = code.family.starts_with('X');
    let (ended, lines) = if while_running {
        let mut args = vec!["run", "example.mtx", "--format", "json"];
        if code.name == "no-contact-model" {
            args.extend(["--fidelity", "contact"]);
        }
        let ended = matterixc_in(&dir, &args);
        let lines = ended.err_lines();
        (ended, lines)
    } else {
        let mut args = vec!["check", "example.mtx", "--format", "json"];
        args.extend(strict.then_some("--strict"));
        let ended = matterixc_in(&dir, &args);
        let lines = ended.out_lines();
        (ended, lines)
    };
    let mut codes: Vec<String> = lines.iter().map(|l| l["code"].as_str().unwrap_or_default().to_string()).collect();
    codes.sort();
    codes.dedup();
    (codes, ended)
}

fn verify(code: &Code) -> Result<(), String> {
    let page = Page::parse(code.page)?;
    let Some((faulty, mended)) = page.examples(code.name)? else { return Ok(()) };
    // An advice says on its page when it is shown.
    let strict = page.sections[0].1.prose.contains("advice, shown as a warning with `--strict`");
    let (codes, ended) = found(code, faulty, "example", strict);
    if codes != [code.name] {
        return Err(format!("the example yields {codes:?}\n{}{}", ended.out, ended.err));
    }
    let (codes, ended) = found(code, mended, "mended", strict);
    if !codes.is_empty() || ended.code != 0 {
        return Err(format!("the mended example yields {codes:?}\n{}{}", ended.out, ended.err));
    }
    let dir = folder(&format!("pages_{}_formatted", code.name));
    let path = write(&dir, "example.mtx", mended);
    if matterixc(&["fmt", "--check", &path]).code != 0 {
        return Err("the mended example is not in the style of `matterixc fmt`".to_string());
    }
    Ok(())
}

#[test]
fn every_page_has_its_form_and_its_examples_yield_what_they_promise() {
    let wrong: Vec<String> =
        codes::ALL.iter().filter_map(|c| verify(c).err().map(|e| format!("docs/codes/{}.md: {e}", c.name))).collect();
    assert!(wrong.is_empty(), "{} of {} pages:\n{}", wrong.len(), codes::ALL.len(), wrong.join("\n"));
}

#[test]
fn codes_are_unique_and_every_page_belongs_to_one() {
    let mut expected: Vec<String> = codes::ALL.iter().map(|c| format!("{}.md", c.name)).collect();
    expected.push("README.md".to_string());
    expected.sort();
    assert_eq!(names(&root().join("docs/codes")), expected);
}

#[test]
fn the_index_is_up_to_date() {
    let path = root().join("docs/codes/README.md");
    let index = matterixc(&["explain", "--index"]).out;
    if std::env::var_os("MATTERIX_UPDATE").is_some() {
        fs::write(&path, &index).expect("the index can be written");
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    assert!(written == index, "docs/codes/README.md is out of date: MATTERIX_UPDATE=1 cargo test --test cli index");
}

#[test]
fn a_page_is_taken_apart() {
    let text = "# c\n\n## What it means\n\nWords.\n\n## Example\n\n```mtx\nmtx 1\n## no section\n```\n\n## Mended\n```mtx\nmtx 1\n```\n";
    let page = Page::parse(text).expect("well formed");
    assert_eq!(page.examples("c"), Ok(Some(("mtx 1\n## no section\n", "mtx 1\n"))));
    let shown = "# c\n## What it means\nWords.\n## Example\n```text\nmatterixc\n```\n## Mended\nOtherwise.\n";
    assert_eq!(Page::parse(shown).expect("well formed").examples("c"), Ok(None));
    assert!(page.examples("d").is_err());
    for wrong in ["", "c", "# c\nwords", "# c\n## Example\n```mtx\nmtx 1\n"] {
        assert!(Page::parse(wrong).is_err(), "{wrong:?}");
    }
    for wrong in ["# c\n## Example\n", &text.replace("Words.", ""), &text.replacen("```mtx", "```text", 1)] {
        assert!(Page::parse(wrong).is_ok_and(|p| p.examples("c").is_err()), "{wrong:?}");
    }
}
