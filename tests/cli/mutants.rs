//! Texts with one mistake each: what a correction that leaves no doubt makes of them is never worse than they were.

use std::collections::BTreeMap;
use std::fs;

use crate::harness::{folder, matterixc_in, write};

/// A lab with a workflow, in which each mutant has one mistake.
const TEXT: &str = "mtx 1

use std::glassware::{Beaker100mL, Beaker250mL}
use std::heating::IkaRetControl

lab bench {
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    plate = IkaRetControl on table at (300, 0) mm
    cup = Beaker100mL on plate holding 60 g of water
    pot = Beaker250mL on table at (0, 0.2) m holding 100 g of water
}

workflow warm in bench {
    heat plate to 60 degC
    wait until cup.contents.temperature > 40 degC timeout 90 min
    let hot = cup.contents.temperature
    note \"now {hot as degC :.1}\"
    expect hot in 25 degC .. 80 degC
    if hot > 45 degC { wait 2.5 min } else { wait 30 s }
} finally {
    stop heating plate
}
";

/// How many mutants are made.
const COUNT: usize = 48;

/// Numbers that look like chance and are the same in each run.
struct Draws(u64);

impl Draws {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

/// The words and signs of the text behind its version, with the blanks before them.
fn tokens(text: &str) -> Vec<std::ops::Range<usize>> {
    let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    let bytes = text.as_bytes();
    let mut out = Vec::new();
    let mut at = 5;
    while at < bytes.len() {
        let start = at;
        at += 1;
        while is_word(bytes[start]) && at < bytes.len() && is_word(bytes[at]) {
            at += 1;
        }
        if !bytes[start].is_ascii_whitespace() {
            out.push(start..at);
        }
    }
    out
}

/// A token left out, doubled, put in the place of the next one, or replaced by a sign.
fn mutant(draws: &mut Draws) -> String {
    const SIGNS: [&str; 8] = ["=", ":", ".", ",", ")", "}", "==", "of"];
    let all = tokens(TEXT);
    let index = draws.below(all.len() - 1);
    let (token, next) = (&all[index], &all[index + 1]);
    let mut text = TEXT.to_string();
    match draws.below(4) {
        0 => text.replace_range(token.clone(), ""),
        1 => text.insert_str(token.end, &format!(" {}", &TEXT[token.clone()])),
        2 => {
            let turned = format!("{}{}{}", &TEXT[next.clone()], &TEXT[token.end..next.start], &TEXT[token.clone()]);
            text.replace_range(token.start..next.end, &turned);
        }
        _ => text.replace_range(token.clone(), SIGNS[draws.below(SIGNS.len())]),
    }
    text
}

/// The number of errors of each file.
fn errors(dir: &std::path::Path, files: &[String]) -> BTreeMap<String, usize> {
    let mut count = BTreeMap::new();
    for file in files {
        let found = matterixc_in(dir, &["check", file, "--no-cache", "--format", "json"]).out_lines();
        count.insert(file.clone(), found.iter().filter(|d| d["severity"] == "error").count());
    }
    count
}

#[test]
fn sure_corrections_never_make_it_worse() {
    let dir = folder("mutants");
    let mut draws = Draws(7);
    let files: Vec<String> = (0..COUNT).map(|i| format!("m{i}.mtx")).collect();
    for file in &files {
        write(&dir, file, mutant(&mut draws));
    }
    let texts: Vec<String> = files.iter().map(|f| fs::read_to_string(dir.join(f)).expect("a mutant")).collect();
    let all: Vec<&str> = files.iter().map(String::as_str).collect();
    matterixc_in(&dir, &[&["check", "--fix", "--no-cache"], all.as_slice()].concat());
    // Only those that were changed can have become worse.
    let now = |file: &String| fs::read_to_string(dir.join(file)).expect("a mutant");
    let changed = files.iter().zip(&texts).filter(|(file, text)| now(file) != **text);
    let (changed, texts): (Vec<String>, Vec<&String>) = changed.map(|(file, text)| (file.clone(), text)).unzip();
    assert!(changed.len() >= 3, "hardly any is mended: {changed:?}");
    let after = errors(&dir, &changed);
    let mended: Vec<String> = changed.iter().map(now).collect();
    for (file, text) in changed.iter().zip(&texts) {
        write(&dir, file, text.as_str());
    }
    let before = errors(&dir, &changed);
    for (index, file) in changed.iter().enumerate() {
        assert!(after[file] <= before[file], "{}\nbecame\n{}", texts[index], mended[index]);
    }
}
