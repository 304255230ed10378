//! Which rooms of the front end (files and folders of `lang/src`) use which: there are no circles among them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// By room, those it uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

fn room(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let room = name.strip_suffix(".rs").unwrap_or(name);
    (room != "lib").then(|| room.to_owned())
}

/// What stands in a file besides comments and tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a file of Rust");
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Adds what the files under `path` use, but for those that tests are made of.
fn read(path: &Path, own: &str, uses: &mut Uses) {
    if path.file_name().is_some_and(|name| name == "tests.rs") {
        return;
    }
    if path.is_dir() {
        fs::read_dir(path).expect("a folder").for_each(|entry| read(&entry.expect("an entry").path(), own, uses));
        return;
    }
    let code = code(path);
    for part in code.split("crate::").skip(1) {
        let list = part.strip_prefix('{').and_then(|list| list.split(';').next());
        let words =
            |text: &str| text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default().to_owned();
        let named: Vec<String> = match list {
            Some(list) => list.split(',').map(|part| words(part.trim())).collect(),
            None => vec![words(part)],
        };
        uses.entry(own.to_owned()).or_default().extend(named.into_iter().filter(|name| name != own));
    }
}

/// Everything that a room uses, directly or through others.
fn reached(uses: &Uses, from: &str) -> BTreeSet<String> {
    let (mut seen, mut todo) = (BTreeSet::new(), vec![from.to_owned()]);
    while let Some(room) = todo.pop() {
        for next in uses.get(&room).into_iter().flatten() {
            if seen.insert(next.clone()) {
                todo.push(next.clone());
            }
        }
    }
    seen
}

/// The code of every file under a folder.
fn all(folder: &Path) -> String {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries.map(|path| if path.is_dir() { all(&path) } else { code(&path) }).collect()
}

/// The methods that code adds to the lab.
fn methods(code: &str) -> BTreeSet<&str> {
    let blocks = code.split("\nimpl").skip(1).filter(|block| {
        block.lines().next().is_some_and(|line| line.contains(" Elaborator<") && !line.contains(" for "))
    });
    let bodies = blocks.map(|block| block.split("\n}").next().unwrap_or_default());
    let name = |part: &'_ str| part.split(|c: char| !c.is_alphanumeric() && c != '_').next().map(str::len);
    bodies.flat_map(|body| body.split("fn ").skip(1)).filter_map(|part| Some(&part[..name(part)?])).collect()
}

fn source() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn rooms_use_each_other_in_one_direction() {
    let mut uses = Uses::new();
    for entry in fs::read_dir(source()).expect("the sources") {
        let path = entry.expect("an entry").path();
        if let Some(own) = room(&path) {
            read(&path, &own, &mut uses);
        }
    }
    assert!(uses.len() > 20 && uses["elaborate"].contains("eval"), "{uses:?}");
    let circle: Vec<&String> = uses.keys().filter(|room| reached(&uses, room).contains(*room)).collect();
    assert!(circle.is_empty(), "{circle:?} use each other; see ARCHITECTURE.md");
}

/// Methods need no import, so that a room could use what a room above adds to its types.
#[test]
fn the_evaluator_uses_nothing_that_elaboration_adds_to_the_lab() {
    let (eval, elaborate) = (all(&source().join("eval")), all(&source().join("elaborate")));
    let (own, added) = (methods(&eval), methods(&elaborate));
    assert!(own.contains("expr") && own.contains("instantiate") && added.contains("processes"));
    let used = |name: &&&str| ["self", "lab", "this"].iter().any(|lab| eval.contains(&format!("{lab}.{name}(")));
    let found: Vec<_> = added.difference(&own).filter(used).collect();
    assert!(found.is_empty(), "{found:?} stand in `elaborate` and are used in `eval`");
}
