//! `matterixc explain`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use matterix_ir::{Code, codes};
use matterix_lang::library;

use crate::Exit;
use crate::args::ExplainArgs;
use crate::files;
use crate::terminal::{Stream, print, print_error};

use super::named::named;

/// Text above the table of the index.
const INDEX_HEAD: &str = include_str!("../template/codes.md");

/// Prints the page of a code, the codes of a family, or the list of all.
pub fn explain(args: &ExplainArgs) -> Exit {
    if args.index {
        print(Stream::Out, &index());
        return Exit::Fine;
    }
    if let (Some(name), false) = (&args.code, args.files.is_empty()) {
        return super::or_complain(own(name, &args.files));
    }
    match explanation(args.code.as_deref()) {
        Ok(page) => {
            print(Stream::Out, &page);
            Exit::Fine
        }
        Err(help) => {
            print_error(&format!("unknown diagnostic code `{}`", args.code.as_deref().unwrap_or_default()));
            print(Stream::Err, &format!("help: {help}\n"));
            Exit::Usage
        }
    }
}

/// What files say of a name of their own; `Err` says in words what is wrong with usage or files.
fn own(name: &str, files: &[PathBuf]) -> Result<Exit, String> {
    let mut found = false;
    for path in files {
        let text = String::from_utf8_lossy(&files::read(path)?).into_owned();
        if let Some(said) = named(name, &path.display().to_string(), &text) {
            print(Stream::Out, &said);
            found = true;
        }
    }
    let nothing = || format!("these files declare no `{name}`: name one of their failures, hazards or `ends`");
    found.then_some(Exit::Fine).ok_or_else(nothing)
}

/// The page of a code, the codes of a family, or all without one; `Err` says what may have been meant.
pub fn explanation(given: Option<&str>) -> Result<String, String> {
    let Some(given) = given else { return Ok(list(codes::ALL)) };
    let name = bare(given);
    if let Some(code) = codes::find(&name) {
        return Ok(format!("{}\n", code.page.trim_end()));
    }
    let family: Vec<Code> = codes::ALL.iter().copied().filter(|c| c.family.eq_ignore_ascii_case(&name)).collect();
    if !family.is_empty() {
        return Ok(list(&family));
    }
    if let Some(page) = of_library(&name) {
        return Ok(page);
    }
    Err(match nearest(&name) {
        Some(code) => format!("did you mean `{code}`?"),
        None => "`matterixc explain` lists all codes; for a name declared in a file use `matterixc explain NAME FILE`"
            .to_string(),
    })
}

/// What the library says of a hazard, a caution or a failure that it declares.
fn of_library(name: &str) -> Option<String> {
    library::MODULES.iter().find_map(|module| named(name, module.name, module.text))
}

/// The code in what was pasted: `error[unit-mismatch]:` is `unit-mismatch`, and so is the failure `unit_mismatch`.
fn bare(given: &str) -> String {
    let inner = given.split_once('[').map_or(given, |(_, rest)| rest);
    inner.split(']').next().unwrap_or_default().trim().to_lowercase().replace('_', "-")
}

fn nearest(name: &str) -> Option<&'static str> {
    let distance = |code: &Code| strsim::damerau_levenshtein(name, code.name);
    let best = codes::ALL.iter().min_by_key(|code| distance(code))?;
    (distance(best) <= 1 + best.name.len() / 3).then_some(best.name)
}

fn by_family(codes: &[Code]) -> BTreeMap<(u8, &'static str), Vec<Code>> {
    let mut families: BTreeMap<(u8, &'static str), Vec<Code>> = BTreeMap::new();
    for code in codes {
        families.entry((rank(code.family), code.family)).or_default().push(*code);
    }
    families
}

/// Parsing, names, checks, runs: the order in which they are met.
fn rank(family: &str) -> u8 {
    match family.as_bytes().first() {
        Some(b'P') => 0,
        Some(b'N') => 1,
        Some(b'X') => 3,
        _ => 2,
    }
}

fn list(codes: &[Code]) -> String {
    let width = codes.iter().map(|c| c.name.len()).max().unwrap_or(0);
    let mut out = String::new();
    for ((_, family), codes) in by_family(codes) {
        out.push_str(&format!("{family}\n"));
        codes.iter().for_each(|c| out.push_str(&format!("  {:width$}  {}\n", c.name, c.summary)));
    }
    out
}

fn index() -> String {
    let mut out = INDEX_HEAD.to_string();
    out.push_str("\n| family | code | meaning |\n| --- | --- | --- |\n");
    for ((_, family), codes) in by_family(codes::ALL) {
        for code in codes {
            let summary = code.summary.replace('|', "\\|");
            out.push_str(&format!("| {family} | [{0}]({0}.md) | {summary} |\n", code.name));
        }
    }
    out
}
