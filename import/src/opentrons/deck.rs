//! What stands on the deck: names for it, and what of its definitions a protocol needs.

use std::collections::{BTreeMap, BTreeSet};

use matterix_lang::labware::{self, Insides};
use serde_json::Value;

use super::analysis::{Analysis, Command};
use super::layout::Layout;
use super::library::{Library, Pipette};
use super::liquids::Reach;
use super::node::{At, Place, cell};
use super::robot::{Bins, Robot};
use super::words;

/// The name space of definitions that come with Opentrons' software.
const OWN: &str = "opentrons";

/// What definitions say of labware over whose wells the middle of all channels goes.
const CENTRED: &str = "centerMultichannelOnWells";

/// How analyses call what stands anywhere but on the deck, and what the language calls that place.
pub(super) const OFF: &str = "offDeck";
pub(super) const ASIDE: &str = "aside";

/// How far below its end a tip still takes up liquid, mm, as `suction` of the library has it.
const SUCTION: f64 = 1.0;

/// How far apart channels are, mm.
const PITCH: f64 = 9.0;

/// So many channels stand in a row from back to front at most.
const ROWS: usize = 8;

/// What a piece of labware is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Wells,
    Tips,
}

/// The opening of a well, mm: its diameter, or from left to right and from front to back.
#[derive(Clone, Copy, Debug)]
enum Opening {
    Round(f64),
    Square([f64; 2]),
}

/// A well as its definition has it, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Well {
    pub(super) depth: f64,
    opening: Opening,
    /// What it holds, uL.
    pub(super) capacity: f64,
    x: f64,
    y: f64,
}

impl Well {
    /// Whether its opening is at a place of its labware.
    fn opens_at(&self, x: f64, y: f64) -> bool {
        let [right, back] = [(x - self.x).abs(), (y - self.y).abs()];
        match self.opening {
            Opening::Round(diameter) => right.hypot(back) <= diameter / 2.0,
            Opening::Square([wide, deep]) => right <= wide / 2.0 && back <= deep / 2.0,
        }
    }
}

/// A piece of labware.
#[derive(Debug)]
pub(super) struct Labware {
    pub(super) name: String,
    pub(super) asset: String,
    pub(super) kind: Kind,
    /// What it stands on, as the language writes it.
    pub(super) on: String,
    /// Where it comes as it is loaded, if it does not stand there from the start.
    pub(super) comes: Option<String>,
    pub(super) wells: BTreeMap<String, Well>,
    insides: Insides,
    /// Wells in the order of columns.
    pub(super) order: Vec<String>,
    /// Whether the middle of all channels goes to the middle of a well, and not the first channel.
    is_centred: bool,
}

impl Labware {
    /// The wells in line with one, from back to front.
    fn column(&self, well: &str) -> Vec<&str> {
        let Some(first) = self.wells.get(well) else { return Vec::new() };
        let in_line = |other: &&String| self.wells.get(*other).is_some_and(|o| (o.x - first.x).abs() < 0.1);
        self.order.iter().filter(in_line).map(String::as_str).collect()
    }

    /// The wells of a row, counted from 1, from left to right.
    fn across(&self, row: u32) -> Vec<&str> {
        let mut wells: Vec<(u32, &str)> = Vec::new();
        wells
            .extend(self.order.iter().filter_map(|w| cell(w).filter(|(r, _)| *r == row).map(|(_, c)| (c, w.as_str()))));
        wells.sort_unstable();
        wells.into_iter().map(|(_, well)| well).collect()
    }

    /// How many columns it has.
    fn columns(&self) -> usize {
        self.order.iter().filter_map(|well| cell(well)).map(|(_, column)| column as usize).max().unwrap_or(0)
    }

    /// The well over which each of so many channels in a row is, if any, where the first one is over the middle of this well.
    pub(super) fn row(&self, channels: usize, well: &str) -> Vec<Option<&str>> {
        let Some(first) = self.wells.get(well) else { return vec![None; channels] };
        self.under([channels.min(ROWS), channels.div_ceil(ROWS)], [first.x, first.y])
    }

    /// The well over which each of so many rows and columns of channels is, if any, where the first one is at a place; column by column.
    fn under(&self, [rows, columns]: [usize; 2], [x, y]: [f64; 2]) -> Vec<Option<&str>> {
        let cells = (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row)));
        cells.map(|(column, row)| self.over(x + PITCH * column as f64, y - PITCH * row as f64)).collect()
    }

    /// How wells in the order of the channels over them are named together.
    fn named_together(&self, wells: Vec<&str>) -> At {
        match cell(wells[0]) {
            Some((1, number)) if wells == self.column(wells[0]) => At::Column(number as usize, self.columns()),
            Some((row, 1)) if wells == self.across(row) => At::Row(row as usize),
            _ => At::Wells(wells.into_iter().map(str::to_owned).collect()),
        }
    }

    /// The well whose opening is at a place, mm.
    fn over(&self, x: f64, y: f64) -> Option<&str> {
        self.order.iter().find(|other| self.wells.get(*other).is_some_and(|o| o.opens_at(x, y))).map(String::as_str)
    }
}

/// A pipette on its mount.
#[derive(Debug)]
pub(super) struct Mounted {
    pub(super) mount: String,
    pub(super) pipette: Pipette,
}

/// A module.
#[derive(Debug)]
pub(super) struct Module {
    pub(super) name: String,
    pub(super) asset: String,
    pub(super) slot: String,
}

/// Everything that is loaded.
#[derive(Debug, Default)]
pub(super) struct Deck {
    pub(super) robot: Robot,
    pub(super) bins: Bins,
    pub(super) labware: BTreeMap<String, Labware>,
    pub(super) pipettes: BTreeMap<String, Mounted>,
    pub(super) modules: BTreeMap<String, Module>,
    /// Identifiers of labware and modules in the order in which they are loaded.
    pub(super) loaded: Vec<String>,
    /// Assets that the file declares itself, with what they are made from.
    pub(super) assets: BTreeMap<String, String>,
    /// Assets of the library.
    pub(super) used: BTreeSet<String>,
    /// Definitions that go beside the file, by the file's name.
    pub(super) files: BTreeMap<String, String>,
    names: BTreeSet<String>,
    asset_names: BTreeSet<String>,
}

impl Deck {
    /// An empty deck of a robot; these names are taken.
    pub(super) fn new(robot: Robot, bins: Bins, taken: &[&str]) -> Deck {
        let taken = taken.iter().copied().chain([robot.name()]).chain(bins.all().map(|bin| bin.name.as_str()));
        let names = taken.map(str::to_owned).collect();
        Deck { robot, bins, names, ..Deck::default() }
    }

    /// Loads what a command loads; why it cannot be.
    pub(super) fn load(&mut self, command: &Command, analysis: &Analysis, library: &Library) -> Result<(), String> {
        match command.command_type.as_str() {
            "loadPipette" => {
                let name = command.text("pipetteName");
                let known = library.pipette(name).ok_or_else(|| format!("the library has no pipette `{name}`"))?;
                let mounted = Mounted { mount: command.text("mount").to_owned(), pipette: known.clone() };
                self.used.insert(known.asset.clone());
                let id = command.loaded("pipetteId").unwrap_or(name);
                self.pipettes.insert(id.to_owned(), mounted);
            }
            "loadModule" => {
                let model = command.text("model");
                let model = command.result["model"].as_str().unwrap_or(model);
                let asset =
                    library.module(model, self.robot).ok_or_else(|| format!("the library has no module `{model}`"))?;
                let name = words::name_of(module_word(model), "module", &mut self.names);
                self.used.insert(asset.to_owned());
                let slot = slot(&command.params["location"]).unwrap_or_else(|| self.robot.cycler().to_owned());
                let id = command.loaded("moduleId").unwrap_or(model).to_owned();
                self.loaded.push(id.clone());
                self.modules.insert(id, Module { name, asset: asset.to_owned(), slot });
            }
            _ => self.load_labware(command, analysis, library)?,
        }
        Ok(())
    }

    fn load_labware(&mut self, command: &Command, analysis: &Analysis, library: &Library) -> Result<(), String> {
        let [load_name, space] = ["loadName", "namespace"].map(|key| command.text(key));
        let version = command.params["version"].as_u64().unwrap_or(1);
        let uri = format!("{space}/{load_name}/{version}");
        let definition = match &command.result["definition"] {
            Value::Null => analysis.labware_definitions.get(&uri).unwrap_or(&Value::Null),
            found => found,
        };
        let place = self.place_of(&command.params["location"])?;
        // What comes to a place where something was before stands aside until then.
        let is_taken = self.labware.values().any(|other| other.on == place && place != ASIDE);
        let comes = is_taken.then(|| place.clone());
        let on = if is_taken { ASIDE.to_owned() } else { place };
        let category = definition["metadata"]["displayCategory"].as_str().unwrap_or("wellPlate");
        let kind = if definition["parameters"]["isTiprack"] == true { Kind::Tips } else { Kind::Wells };
        let asset = match library.labware(&format!("{load_name}/{version}")) {
            Some(asset) if space == OWN => {
                self.used.insert(asset.to_owned());
                asset.to_owned()
            }
            _ => self.asset_of(load_name, space, version, definition),
        };
        let label = command.text("displayName");
        let name = words::name_of(label, category_word(category), &mut self.names);
        let (wells, order) = (wells(definition), order(definition));
        // What cannot be read is said where the asset is.
        let insides = labware::insides(definition.clone()).unwrap_or_default();
        let id = command.loaded("labwareId").unwrap_or(load_name).to_owned();
        self.loaded.push(id.clone());
        let quirks = definition["parameters"]["quirks"].as_array();
        let is_centred = quirks.is_some_and(|quirks| quirks.iter().any(|quirk| quirk == CENTRED));
        self.labware.insert(id, Labware { name, asset, kind, on, comes, wells, insides, order, is_centred });
        Ok(())
    }

    /// The asset of a definition that the library has no name for.
    fn asset_of(&mut self, load_name: &str, space: &str, version: u64, definition: &Value) -> String {
        let from = match space == OWN {
            true => format!("{load_name}/{version}"),
            false => {
                let file = format!("{space}_{load_name}_{version}.json");
                self.files.insert(file.clone(), format!("{definition:#}\n"));
                file
            }
        };
        if let Some((known, _)) = self.assets.iter().find(|(_, of)| **of == from) {
            return known.clone();
        }
        let name = words::asset_name(load_name, &mut self.asset_names);
        self.assets.insert(name.clone(), from);
        name
    }

    /// What stands in a place, as the language writes that.
    pub(super) fn place_of(&self, location: &Value) -> Result<String, String> {
        if location == OFF {
            return Ok(ASIDE.to_owned());
        }
        if let Some(slot) = slot(location) {
            return Ok(format!("{}.slot[{slot}]", self.robot.name()));
        }
        if let Some(module) = location["moduleId"].as_str().and_then(|id| self.modules.get(id)) {
            return Ok(module.name.clone());
        }
        if let Some(under) = location["labwareId"].as_str().and_then(|id| self.labware.get(id)) {
            return Ok(under.name.clone());
        }
        Err("it is not on a slot of the deck".to_owned())
    }

    /// What so many channels in a row reach from a well, or why it is nothing that can be said.
    pub(super) fn reached(&self, channels: usize, labware: &Labware, well: &str) -> Result<Place, String> {
        let of = labware.name.clone();
        let at = |at| Ok(Place { of: of.clone(), at });
        if channels > ROWS {
            return self.reached_by_rows(channels, labware, well);
        }
        if !labware.wells.contains_key(well) {
            return Err(format!("`{of}` has no well {well}"));
        }
        if channels == 1 || labware.is_centred {
            return at(At::Well(well.to_owned()));
        }
        at(labware.named_together(each_its_own(labware.row(channels, well))?))
    }

    /// What the channels of a layout reach where that in the corner is over a well, or why it is nothing that can be said.
    pub(super) fn reached_by(&self, layout: &Layout, labware: &Labware, well: &str) -> Result<Place, String> {
        let of = labware.name.clone();
        let Some(named) = labware.wells.get(well) else { return Err(format!("`{of}` has no well {well}")) };
        let count = layout.rows * layout.columns;
        if count == 1 || labware.is_centred && (layout.columns == 1 || labware.columns() == 1) {
            return Ok(Place { of, at: At::Well(well.to_owned()) });
        }
        let behind = |many: usize, is_last: bool| if is_last { PITCH * (many - 1) as f64 } else { 0.0 };
        let x = named.x - behind(layout.columns, layout.corner.ends_with("12"));
        let y = named.y + behind(layout.rows, layout.corner.starts_with('H'));
        let wells = each_its_own(labware.under([layout.rows, layout.columns], [x, y]))?;
        Ok(Place { of, at: labware.named_together(wells) })
    }

    /// The same of several rows of channels: all wells over which any is.
    fn reached_by_rows(&self, channels: usize, labware: &Labware, well: &str) -> Result<Place, String> {
        let of = labware.name.clone();
        let Some(first) = labware.wells.get(well) else { return Err(format!("`{of}` has no well {well}")) };
        // Where the middle of all channels goes to the middle of a well, in both directions or from back to front.
        let half = |channels: usize| PITCH * (channels - 1) as f64 / 2.0;
        let [left, back] = match (labware.is_centred, labware.columns()) {
            (false, _) => [0.0, 0.0],
            (true, 1) => [half(channels / ROWS), half(ROWS)],
            (true, _) => [0.0, half(ROWS)],
        };
        let under = labware.under([ROWS, channels / ROWS], [first.x - left, first.y + back]);
        let mut wells: Vec<&str> = Vec::new();
        for well in all_over(under)? {
            if !wells.contains(&well) {
                wells.push(well);
            }
        }
        let at = match wells.as_slice() {
            [one] => At::Well((*one).to_owned()),
            all if *all == labware.order => At::All(labware.kind == Kind::Tips),
            _ => At::Wells(wells.into_iter().map(str::to_owned).collect()),
        };
        Ok(Place { of, at })
    }

    /// The labware that has a name here.
    fn named(&self, name: &str) -> Option<&Labware> {
        self.labware.values().find(|labware| labware.name == name)
    }

    /// What a well takes, uL.
    pub(super) fn capacity(&self, labware: &str, well: &str) -> f64 {
        self.named(labware).and_then(|labware| labware.wells.get(well)).map_or(0.0, |well| well.capacity)
    }

    /// What a tip at a height of a place finds there and leaves behind: that of the first well.
    pub(super) fn reach(&self, place: &Place, height: f64) -> Reach {
        let well = self.wells_of(place).into_iter().next();
        let of = |height: f64| self.named(&place.of)?.insides.below(well.as_ref()?, height);
        Reach { below: of(height).unwrap_or(0.0), left: of(height - SUCTION).unwrap_or(0.0) }
    }

    /// Wells of a place.
    pub(super) fn wells_of(&self, place: &Place) -> Vec<String> {
        match &place.at {
            At::Well(well) => vec![well.clone()],
            At::Wells(wells) => wells.clone(),
            At::Row(number) => {
                let labware = self.named(&place.of);
                labware.map_or(Vec::new(), |l| l.across(*number as u32).into_iter().map(str::to_owned).collect())
            }
            At::All(_) => self.named(&place.of).map_or(Vec::new(), |labware| labware.order.clone()),
            At::Column(number, _) => {
                let order = self.named(&place.of).map_or(&[][..], |labware| &labware.order);
                order.iter().filter(|w| cell(w).is_some_and(|(_, c)| c as usize == *number)).cloned().collect()
            }
        }
    }
}

/// The wells under channels, each of which is over one.
fn all_over(under: Vec<Option<&str>>) -> Result<Vec<&str>, String> {
    under.into_iter().collect::<Option<_>>().ok_or_else(|| "some of its channels reach no well".to_owned())
}

/// The same where each channel is over a well of its own.
fn each_its_own(under: Vec<Option<&str>>) -> Result<Vec<&str>, String> {
    let wells = all_over(under)?;
    match wells.windows(2).any(|two| two[0] == two[1]) {
        true => Err("several of its channels reach one well, and not in its middle".to_owned()),
        false => Ok(wells),
    }
}

fn slot(location: &Value) -> Option<String> {
    let area = || location["addressableAreaName"].as_str().filter(|area| area.len() == 2);
    location["slotName"].as_str().or_else(area).map(str::to_owned)
}

fn wells(definition: &Value) -> BTreeMap<String, Well> {
    let Some(all) = definition["wells"].as_object() else { return BTreeMap::new() };
    let number = |well: &Value, key: &str| well[key].as_f64().unwrap_or(0.0);
    let opening = |well: &Value| match well["diameter"].as_f64() {
        Some(diameter) => Opening::Round(diameter),
        None => Opening::Square(["xDimension", "yDimension"].map(|side| number(well, side))),
    };
    let read = |well: &Value| Well {
        depth: number(well, "depth"),
        opening: opening(well),
        capacity: number(well, "totalLiquidVolume"),
        x: number(well, "x"),
        y: number(well, "y"),
    };
    all.iter().map(|(name, well)| (name.clone(), read(well))).collect()
}

fn order(definition: &Value) -> Vec<String> {
    let columns = definition["ordering"].as_array().into_iter().flatten();
    columns
        .flat_map(|column| column.as_array().into_iter().flatten())
        .filter_map(|w| w.as_str())
        .map(str::to_owned)
        .collect()
}

fn category_word(category: &str) -> &'static str {
    match category {
        "tipRack" => "tips",
        "reservoir" => "reservoir",
        "tubeRack" => "tubes",
        "aluminumBlock" => "block",
        "adapter" => "adapter",
        "trash" => "bin",
        _ => "plate",
    }
}

fn module_word(model: &str) -> &'static str {
    match model {
        m if m.starts_with("temperature") => "cooler",
        m if m.starts_with("magnetic") => "magnet",
        m if m.starts_with("thermocycler") => "cycler",
        m if m.starts_with("heaterShaker") => "shaker",
        m if m.starts_with("absorbance") => "reader",
        _ => "module",
    }
}
