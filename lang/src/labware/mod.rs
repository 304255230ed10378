//! Labware definitions of Opentrons, schema 2 and 3, as lines of an asset: `asset X from labware "plate.json"`.
//!
//! What a definition gives is written with these words of the language: the grid `wells` of `Well`, or `tips` of `Tip`
//! for a tip rack, each with its `max_volume`; the `mouth` of each well; the `shape` of the whole, the `room` of each
//! place, for tips a hollow `shape` as well; and, where the asset names
//! no capability itself, the one called like the definition's category: `wellPlate` is `WellPlate`.

mod definition;
mod lines;

use crate::ast::{AssetLine, Name, Path};

use definition::Definition;

/// The lines a definition stands for and the capability it has, or what is wrong with it.
pub(crate) fn lines(text: &str, path: &Name) -> Result<(Vec<AssetLine>, Option<Path>), String> {
    let definition = Definition::read(text)?;
    let name = Name { text: definition.capability(), span: path.span };
    let kind = Path { segments: vec![name], span: path.span };
    Ok((lines::of(&definition, text, path.span), Some(kind)))
}
