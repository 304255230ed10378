//! How far racks of tips are used up, kept in a file from one run to the next.
//!
//! The file is a table with the columns `rack` and `taken`: the place of the last tip that was taken, in the order of the rack's columns. Tips before it
//! count as taken, too: a tip is never used twice, though one that was left out may be lost.

use std::collections::BTreeMap;
use std::path::Path;

use matterix_ir::Program;
use matterix_ir::scene::Instance;

use crate::files;
use crate::pipeline::{Calibration, Gauged};

/// The capability of racks, and the states of a rack and of its tips that say what was taken (`std::labware`).
const RACK: &str = "TipRack";
const EMPTIED: &str = "emptied";
const PICKED: &str = "picked";

/// The head of the table.
const HEAD: [&str; 2] = ["rack", "taken"];

/// What a file says, in place of what the lab says of its racks; nothing where there is no file yet. `Err` says in words what is wrong.
pub fn read(path: &Path) -> Result<Calibration, String> {
    if !path.exists() {
        return Ok(Calibration::default());
    }
    let wrong = |why: String| format!("`{}`: {why}", path.display());
    let text = String::from_utf8(files::read(path)?).map_err(|_| wrong("it is not text".to_owned()))?;
    let mut given: Vec<Gauged> = Vec::new();
    // Spreadsheets put a mark before the first line.
    let first = text.trim_start_matches('\u{feff}').lines().next().unwrap_or_default();
    if first.split(',').map(str::trim).ne(HEAD) {
        return Err(wrong(format!("its first line must be `{}`", HEAD.join(","))));
    }
    let mut at = 0;
    for (index, line) in text.split_inclusive('\n').enumerate() {
        let start = at;
        at += line.len();
        let line = line.trim_end();
        if index == 0 || line.is_empty() {
            continue;
        }
        let (rack, taken) = line.split_once(',').unwrap_or((line, ""));
        if taken.trim().parse::<u32>().is_err() {
            return Err(wrong(format!("line {}: `{}` is not how many tips were taken", index + 1, taken.trim())));
        }
        if given.iter().any(|known| known.thing.0 == rack.trim()) {
            return Err(wrong(format!("line {}: `{}` stands there twice", index + 1, rack.trim())));
        }
        let value = start + rack.len() + 1..start + line.len();
        let thing = (rack.trim().to_owned(), start..start + rack.len());
        given.push(Gauged { thing, field: (EMPTIED.to_owned(), value.clone()), value });
    }
    Ok(Calibration { name: path.display().to_string(), text, given })
}

/// Whether a lab names each of its racks by itself, as the file does, and they have so many tips; `Err` says which does not.
pub fn agrees(kept: &Calibration, program: &Program) -> Result<(), String> {
    if let Some((_, rack)) = racks(program).find(|(_, rack)| rack.name.contains(['[', '.'])) {
        return Err(format!(
            "`--tips` needs racks that the lab declares one by one; `{}` is one of several",
            rack.name
        ));
    }
    for gauged in &kept.given {
        let taken = kept.text[gauged.value.clone()].trim().parse::<usize>().unwrap_or(0);
        let rack = racks(program).find(|(_, rack)| rack.name == gauged.thing.0);
        let tips = rack.map_or(0, |(id, _)| tips_of(program, id).count());
        if taken > tips {
            return Err(format!("`{}`: {taken} of the {tips} tips of `{}` were taken", kept.name, gauged.thing.0));
        }
    }
    Ok(())
}

/// The tips of a rack, in the order of its columns.
fn tips_of(program: &Program, rack: usize) -> impl Iterator<Item = &Instance> {
    program.scene.instances.iter().filter(move |tip| tip.owner.is_some_and(|owner| owner.0 as usize == rack))
}

/// Writes how far the racks of a lab are used up, by the states at the end of a run.
pub fn write(path: &Path, program: &Program, states: &[Option<f64>]) -> Result<(), String> {
    let lines = taken(program, states).into_iter().map(|(rack, taken)| format!("{rack},{taken}\n"));
    let text = std::iter::once(format!("{}\n", HEAD.join(","))).chain(lines).collect::<String>();
    files::write(path, text.into_bytes())
}

/// The racks of a lab, by the number of their instance.
fn racks(program: &Program) -> impl Iterator<Item = (usize, &Instance)> {
    program.scene.instances.iter().enumerate().filter(|(_, i)| i.capabilities.iter().any(|c| c == RACK))
}

/// The last tip that was taken of each rack, from 1; 0 where none was.
fn taken(program: &Program, states: &[Option<f64>]) -> Vec<(String, usize)> {
    let names = program.model.states.iter().enumerate().map(|(index, state)| (state.name.as_str(), index));
    let index: BTreeMap<&str, usize> = names.collect();
    let value = |name: &str| index.get(name).and_then(|at| states.get(*at).copied().flatten()).unwrap_or(0.0);
    racks(program)
        .map(|(id, rack)| {
            let tips = tips_of(program, id).enumerate();
            let picked = tips.filter(|(_, tip)| value(&format!("{}.{PICKED}", tip.name)) != 0.0).map(|(at, _)| at + 1);
            let emptied = value(&format!("{}.{EMPTIED}", rack.name)) as usize;
            (rack.name.clone(), picked.max().unwrap_or(0).max(emptied))
        })
        .collect()
}
