//! Which rooms of the front end (files and folders of `lang/src`) use which: the circles among them are known, and no other comes about.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Rooms that use each other, by way of others or not: laws are evaluated on the lab that they make.
const CIRCLE: [&str; 4] = ["elaborate", "eval", "meanings", "screen"];

/// By room, those it uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

fn room(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let room = name.strip_suffix(".rs").unwrap_or(name);
    (room != "lib").then(|| room.to_owned())
}

/// Adds what the files under `path` use.
fn read(path: &Path, own: &str, uses: &mut Uses) {
    if path.is_dir() {
        fs::read_dir(path).expect("a folder").for_each(|entry| read(&entry.expect("an entry").path(), own, uses));
        return;
    }
    let text = fs::read_to_string(path).expect("a file of Rust");
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let code = code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n");
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

#[test]
fn rooms_use_each_other_in_one_known_circle_only() {
    let mut uses = Uses::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(root).expect("the sources") {
        let path = entry.expect("an entry").path();
        if let Some(own) = room(&path) {
            read(&path, &own, &mut uses);
        }
    }
    let found: Vec<&String> = uses.keys().filter(|room| reached(&uses, room).contains(*room)).collect();
    assert_eq!(found, CIRCLE, "these rooms use each other; see ARCHITECTURE.md, \"One direction\"");
}
