//! The book: its pages are all there, its links lead somewhere, and what is written from other texts is up to date.

mod ebnf;
mod links;
mod outputs;
mod programs;

use std::fs;
use std::path::Path;

use matterix_lang::reference;

use crate::harness::{names, root};

/// Compares a file with what it should be, or writes it with `MATTERIX_UPDATE`.
fn up_to_date(path: &str, wanted: &str) {
    let file = root().join(path);
    if std::env::var_os("MATTERIX_UPDATE").is_some() {
        fs::create_dir_all(file.parent().expect("it is in a folder")).expect("the folder can be made");
        fs::write(&file, wanted).expect("the page can be written");
    }
    let written = fs::read_to_string(&file).unwrap_or_default();
    assert!(written == wanted, "{path} is out of date: MATTERIX_UPDATE=1 cargo test --test cli book");
}

/// The pages of a folder below `docs`, and of those in it, by their paths from `docs`.
fn pages_in(folder: &Path, before: &str) -> Vec<String> {
    let mut out = Vec::new();
    for name in names(folder) {
        let path = folder.join(&name);
        if path.is_dir() {
            out.extend(pages_in(&path, &format!("{before}{name}/")));
        } else if name.ends_with(".md") {
            out.push(format!("{before}{name}"));
        }
    }
    out
}

/// All pages below `docs`, but for the list of them.
fn pages() -> Vec<String> {
    pages_in(&root().join("docs"), "").into_iter().filter(|p| p != "SUMMARY.md").collect()
}

#[test]
fn the_reference_of_the_library_is_up_to_date() {
    let pages = reference::pages();
    for page in &pages {
        up_to_date(&format!("docs/library/{}.md", page.name), &page.text);
    }
    let mut expected: Vec<String> = pages.iter().map(|p| format!("{}.md", p.name)).collect();
    expected.sort();
    assert_eq!(names(&root().join("docs/library")), expected);
}

/// The list of pages with those of the folders of codes and of the library below their indices.
fn summary(written: &str) -> String {
    let mut out = String::new();
    for line in
        written.lines().filter(|l| !l.contains("](codes/") && !l.contains("](library/") || l.contains("/README.md)"))
    {
        out += &format!("{line}\n");
        for folder in ["codes", "library"] {
            if line.contains(&format!("]({folder}/README.md)")) {
                for name in names(&root().join("docs").join(folder)).iter().filter(|n| *n != "README.md") {
                    let title = name.trim_end_matches(".md");
                    let title = if folder == "library" { format!("`std::{title}`") } else { title.to_string() };
                    out += &format!("  - [{title}]({folder}/{name})\n");
                }
            }
        }
    }
    out
}

#[test]
fn the_list_of_pages_is_up_to_date() {
    let written = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("there is a list of pages");
    up_to_date("docs/SUMMARY.md", &summary(&written));
}

#[test]
fn every_page_stands_once_in_the_list_of_pages() {
    let list = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("there is a list of pages");
    let times = |page: &String| list.matches(&format!("]({page})")).count();
    let wrong: Vec<String> = pages()
        .iter()
        .map(|p| (p, times(p)))
        .filter(|(_, n)| *n != 1)
        .map(|(p, n)| format!("{p}: {n} times"))
        .collect();
    assert!(wrong.is_empty(), "docs/SUMMARY.md: {}", wrong.join(", "));
}
