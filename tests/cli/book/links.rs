//! Links between pages: every one leads to a file, and to a heading of it where it names one.

use std::fs;
use std::path::{Component, Path, PathBuf};

use super::pages;
use crate::harness::root;

/// Lines of a page that stand in no fenced block, with their numbers.
fn prose(page: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    page.lines().enumerate().filter_map(move |(index, line)| {
        let fence = line.trim_start().starts_with("```");
        let shown = !fenced && !fence;
        fenced ^= fence;
        shown.then_some((index + 1, line))
    })
}

/// A line without what stands in it as code.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("`")
}

/// Where the links of a page lead, with their lines; those to other places of the world are left out.
fn links(page: &str) -> Vec<(usize, String)> {
    let mut out = Vec::new();
    for (number, line) in prose(page) {
        let line = without_code(line);
        for piece in line.split("](").skip(1) {
            let Some((target, _)) = piece.split_once(')') else { continue };
            if !target.contains("://") && !target.starts_with("mailto:") {
                out.push((number, target.to_string()));
            }
        }
    }
    out
}

/// The anchors of the headings of a page, as they are made of their words.
fn anchors(page: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for (_, line) in prose(page) {
        let title = line.trim_start_matches('#');
        let level = line.len() - title.len();
        let Some(title) = title.strip_prefix(' ').filter(|_| (1..=6).contains(&level)) else { continue };
        let kept = title.trim().to_lowercase();
        let anchor: String = kept
            .chars()
            .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
            .map(|c| if c == ' ' { '-' } else { c })
            .collect();
        let mut name = anchor.clone();
        for n in 1.. {
            if !out.contains(&name) {
                break;
            }
            name = format!("{anchor}-{n}");
        }
        out.push(name);
    }
    out
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(out.pop()),
            Component::CurDir => {}
            other => out.push(other),
        }
    }
    out
}

/// What is wrong with a link of a page; nothing where it leads somewhere.
fn wrong(from: &str, target: &str) -> Option<String> {
    let (path, anchor) = target.split_once('#').map_or((target, None), |(p, a)| (p, Some(a)));
    let folder = Path::new(from).parent().unwrap_or(Path::new(""));
    let file = if path.is_empty() { PathBuf::from(from) } else { plain(&folder.join(path)) };
    let there = root().join(&file);
    if !there.exists() {
        return Some(format!("there is no {}", file.display()));
    }
    let anchor = anchor?;
    let text = fs::read_to_string(&there).unwrap_or_default();
    let known = anchors(&text).iter().any(|a| a == anchor);
    (!known).then(|| format!("{} has no heading #{anchor}", file.display()))
}

#[test]
fn every_link_leads_somewhere() {
    let mut all: Vec<String> = pages().into_iter().map(|p| format!("docs/{p}")).collect();
    all.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "docs/SUMMARY.md"].map(str::to_string));
    let mut broken = Vec::new();
    for page in &all {
        let text = fs::read_to_string(root().join(page)).expect("the page can be read");
        for (line, target) in links(&text) {
            broken.extend(wrong(page, &target).map(|why| format!("{page}:{line}: {target}: {why}")));
        }
    }
    assert!(broken.is_empty(), "{} links:\n{}", broken.len(), broken.join("\n"));
}

#[test]
fn links_and_anchors_are_found() {
    let page =
        "# A `b c` d\n## A\n## A\n```text\n# no\n[x](no)\n```\n[x](y.md#z) `[x](no)` ![p](q.svg) [w](https://a.b)\n";
    assert_eq!(links(page), [(8, "y.md#z".to_string()), (8, "q.svg".to_string())]);
    assert_eq!(anchors(page), ["a-b-c-d", "a", "a-1"]);
    assert_eq!(plain(Path::new("docs/codes/../a.md")), Path::new("docs/a.md"));
}
