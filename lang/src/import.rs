//! Assets from files of other formats: `asset X from labware "plate.json"`, `asset X from urdf "arm.urdf"`.

use matterix_ir::{Diagnostic, FileId, codes};

use crate::ast::{AssetLine, File, ItemKind, Name, Path};
use crate::loader::Loader;
use crate::{labware, library};

/// What a file gives: lines of the asset, and what it is where its text does not say.
type Given = (Vec<AssetLine>, Option<Path>);

/// A format that an asset can come from.
struct Format {
    word: &'static str,
    code: codes::Code,
    /// What its files hold, for messages.
    holds: &'static str,
    read: fn(&str, &Name) -> Result<Given, String>,
}

const FORMATS: &[Format] = &[
    Format { word: "labware", code: codes::LABWARE_FILE, holds: "labware definition", read: labware::lines },
    Format { word: "urdf", code: codes::URDF_FILE, holds: "description of a robot", read: urdf },
];

/// Whether an asset can come from files of this format.
pub fn is_known(format: &Name) -> bool {
    FORMATS.iter().any(|f| f.word == format.text)
}

/// Replaces each `from FORMAT "file"` of a module by the lines of that file.
pub fn import(tree: &mut File, file: FileId, loader: &dyn Loader) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for item in &mut tree.items {
        let ItemKind::Asset { source: Some((word, path)), extends, lines, .. } = &mut item.kind else { continue };
        let Some(format) = FORMATS.iter().find(|f| f.word == word.text) else { continue };
        let read = text(file, &path.text, loader).and_then(|text| {
            (format.read)(&text, path).map_err(|reason| format!("`{}` is no {}: {reason}", path.text, format.holds))
        });
        match read {
            Ok((given, kind)) => {
                if extends.is_empty() {
                    extends.extend(kind);
                }
                lines.extend(given);
            }
            Err(headline) => {
                found.push(Diagnostic::error(format.code, path.span, headline, "this file"));
                // What it would have given is not missed again.
                lines.push(AssetLine::Error(path.span));
            }
        }
    }
    found
}

/// The text of a file beside the module, or else of one of the library's.
fn text(from: FileId, path: &str, loader: &dyn Loader) -> Result<String, String> {
    match loader.file(from, path) {
        Ok(text) => Ok(text),
        Err(reason) => match library::file(path) {
            Some(text) => Ok(text.to_string()),
            None => Err(format!("cannot read `{path}`: {reason}")),
        },
    }
}

/// A robot's links and joints.
fn urdf(text: &str, path: &Name) -> Result<Given, String> {
    let robot = matterix_urdf::read(text).map_err(|problem| problem.to_string())?;
    Ok((vec![AssetLine::Robot(Box::new(robot), path.span)], None))
}
