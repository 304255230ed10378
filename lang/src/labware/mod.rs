//! Labware as lines of an asset: `asset X from labware "plate.json"`, or by the name of a definition of the library.
//!
//! Files are labware definitions of Opentrons, schema 2 and 3, or resources of PyLabRobot. What they give is written with these
//! words of the language: the grid `wells` of `Well`, or `tips` of `Tip` for a tip rack, each with its `max_volume`; the `mouth` of
//! each well; the `shape` of the whole, the `room` of each place, for tips a hollow `shape` as well; and, where the asset names no
//! capability itself, the one that its category stands for: `wellPlate` is `WellPlate`.

mod definition;
pub mod library;
mod lines;
mod opentrons;
mod profile;
mod pylabrobot;

use std::collections::BTreeMap;

use matterix_ir::filling;

use crate::ast::{AssetLine, Name, Path};

use definition::Definition;
pub use definition::Shape;

/// The lines that a file stands for and the capability it has, or what is wrong with it.
pub(crate) fn lines(text: &str, path: &Name) -> Result<(Vec<AssetLine>, Option<Path>), String> {
    let (definition, described) = read(text)?;
    let name = Name { text: definition.capability.to_owned(), span: path.span };
    let kind = Path { segments: vec![name], span: path.span };
    Ok((lines::of(&definition, described.then_some(text), path.span), Some(kind)))
}

/// What a file describes, and whether a robot of Opentrons can read it too.
fn read(text: &str) -> Result<(Definition, bool), String> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| format!("it is not JSON ({e})"))?;
    if pylabrobot::is_one(&value) { Ok((pylabrobot::read(value)?, false)) } else { Ok((opentrons::read(value)?, true)) }
}

/// The insides of wells, as an asset that comes from their definition has them: by name, radius and height along the wall, mm.
#[derive(Clone, Debug, Default)]
pub struct Insides(BTreeMap<String, Vec<[f64; 2]>>);

impl Insides {
    /// What a well holds up to a height above the lowest point of its inside, mm: µL; none where the inside is not known.
    pub fn below(&self, well: &str, height: f64) -> Option<f64> {
        self.0.get(well).map(|inside| filling::below(inside, height.max(0.0)))
    }
}

/// The insides of the wells of a definition, or what is wrong with it.
pub fn insides(definition: serde_json::Value) -> Result<Insides, String> {
    let wells = opentrons::read(definition)?.wells;
    Ok(Insides(wells.into_iter().filter_map(|(name, well)| Some((name, well.inner_wall()?))).collect()))
}

/// Labware in short.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Its name for people; empty where it gives none.
    pub title: String,
    /// The capability of an asset that comes from it.
    pub capability: &'static str,
    /// Its places: their number and the volume of each, µL, one entry for each volume, the smallest first.
    pub places: Vec<(usize, f64)>,
    /// How the inside of its wells is known, of the one that is known best.
    pub shape: Shape,
}

impl Summary {
    /// Whether its places are for liquids, and not for tips.
    pub fn holds_liquid(&self) -> bool {
        !self.places.is_empty() && self.capability != "TipRack"
    }
}

/// Labware of the library.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Its name.
    pub name: &'static str,
    /// The version that is described here.
    pub version: u32,
    /// All versions of it.
    pub versions: Vec<u32>,
    /// How an asset names it: `NAME`, or `NAME/VERSION` where it is not the newest.
    pub asked: String,
    /// The definition in short.
    pub short: Summary,
}

/// The one of this name, else all whose name, title or kind have these words in them, whatever their case; all without words.
pub fn listed(words: &[String]) -> Result<Vec<Listed>, String> {
    if let [name] = words
        && let Ok(entry) = library::find(name)
    {
        return Ok(vec![one(entry)?]);
    }
    let words: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
    let mut out = Vec::new();
    for entry in library::newest() {
        let found = one(entry)?;
        let text = format!("{} {} {}", found.name, found.short.title, found.short.capability).to_lowercase();
        if words.iter().all(|word| text.contains(word.as_str())) {
            out.push(found);
        }
    }
    Ok(out)
}

fn one(entry: library::Entry) -> Result<Listed, String> {
    let versions: Vec<u32> = library::entries().filter(|e| e.name == entry.name).map(|e| e.version).collect();
    let is_newest = versions.last() == Some(&entry.version);
    let asked = if is_newest { entry.name.to_owned() } else { format!("{}/{}", entry.name, entry.version) };
    let short = summary(&entry.text()?)?;
    Ok(Listed { name: entry.name, version: entry.version, versions, asked, short })
}

/// A file in short, or what is wrong with it.
pub fn summary(text: &str) -> Result<Summary, String> {
    let (definition, _) = read(text)?;
    let mut places: Vec<(usize, f64)> = Vec::new();
    for well in definition.wells.values() {
        match places.iter_mut().find(|(_, volume)| *volume == well.volume) {
            Some((count, _)) => *count += 1,
            None => places.push((1, well.volume)),
        }
    }
    places.sort_by(|a, b| a.1.total_cmp(&b.1));
    let shape = definition.wells.values().map(|well| well.shape).max().unwrap_or_default();
    Ok(Summary { title: definition.title, capability: definition.capability, places, shape })
}
