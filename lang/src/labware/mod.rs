//! Labware definitions of Opentrons, schema 2 and 3, as lines of an asset: `asset X from labware "plate.json"`.
//!
//! What a definition gives is written with these words of the language: the grid `wells` of `Well`, or `tips` of `Tip`
//! for a tip rack, each with its `max_volume`; the `mouth` of each well; the `shape` of the whole and of each place; and, where the asset names
//! no capability itself, the one called like the definition's category: `wellPlate` is `WellPlate`.

mod definition;
mod lines;

use matterix_ir::{Diagnostic, FileId, codes};

use crate::ast::{AssetLine, File, ItemKind, Name, Path};
use crate::library;
use crate::loader::Loader;

use definition::Definition;

/// Formats that an asset can come from.
const FORMATS: &[&str] = &["labware"];

/// Whether an asset can come from files of this format.
pub fn is_known(format: &Name) -> bool {
    FORMATS.contains(&format.text.as_str())
}

/// Replaces each `from labware "file"` of a module by the lines of that file.
pub fn import(tree: &mut File, file: FileId, loader: &dyn Loader) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for item in &mut tree.items {
        let ItemKind::Asset { source: Some((format, path)), extends, lines, .. } = &mut item.kind else { continue };
        if !is_known(format) {
            continue;
        }
        let at = path.span;
        match read(file, &path.text, loader) {
            Ok(definition) => {
                if extends.is_empty() {
                    let name = Name { text: definition.capability(), span: at };
                    extends.push(Path { segments: vec![name], span: at });
                }
                lines.extend(lines::of(&definition, at));
            }
            Err((headline, label)) => {
                found.push(Diagnostic::error(codes::LABWARE_FILE, at, headline, label));
                // What it would have given is not missed again.
                lines.push(AssetLine::Error(at));
            }
        }
    }
    found
}

/// The definition in a file, or headline and label of what is wrong with it.
fn read(from: FileId, path: &str, loader: &dyn Loader) -> Result<Definition, (String, String)> {
    let text = match loader.file(from, path) {
        Ok(text) => text,
        Err(reason) => match library::file(path) {
            Some(text) => text.to_string(),
            None => return Err((format!("cannot read `{path}`: {reason}"), "this file".into())),
        },
    };
    Definition::read(&text)
        .map_err(|reason| (format!("`{path}` is no labware definition: {reason}"), "this file".into()))
}
