//! A protocol as a program for PyLabRobot, which talks to the robot over the same server or, without one, prints what it would do.
//!
//! PyLabRobot has channels where Opentrons has pipettes: those of the left mount come first. It has no step in place: what is done there is
//! done at the place where the pipette went before.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use matterix_ir::{Diagnostic, Span};
use serde_json::Value;

use super::deck::BIN;
use super::protocol::{Command, Protocol};
use super::python::{quoted, shown};
use crate::finding::not_expressible;
use crate::place;

/// What the target is called in findings.
const WHAT: &str = "PyLabRobot";

/// How far apart channels are, mm.
const PITCH: f64 = 9.0;

/// What a definition says of labware over whose wells the middle of all channels goes: PyLabRobot spreads channels by itself.
const CENTRED: &str = "centerMultichannelOnWells";

/// The part of the file that is the same for every protocol.
const HELPERS: &str = include_str!("pylabrobot.py");

/// The file, or what PyLabRobot has no call for.
pub(super) fn write(protocol: &Protocol<'_>) -> Result<Vec<u8>, Vec<Diagnostic>> {
    let definitions = protocol.library.iter().chain(&protocol.definitions).map(|(uri, d)| (uri.as_str(), d)).collect();
    let mut script = Script {
        definitions,
        pipettes: BTreeMap::new(),
        labware: BTreeMap::new(),
        names: BTreeMap::new(),
        slots: BTreeMap::new(),
        tips: BTreeSet::new(),
        loads: String::new(),
        steps: String::new(),
    };
    let mut found = Vec::new();
    // Channels are numbered from the left mount.
    let mut loads: Vec<&Command> = protocol.loads.iter().collect();
    loads.sort_by_key(|command| (command.name != "loadPipette", command.text("mount") != "left"));
    for command in loads {
        found.extend(script.load(command).err());
    }
    let mut said: Option<Span> = None;
    for command in &protocol.commands {
        if said != Some(command.at) {
            said = Some(command.at);
            let (file, line, text) = place::line(protocol.subject.sources, command.at);
            script.line(&format!("# {file}:{line}: {text}"));
        }
        found.extend(script.step(command).err());
    }
    if !found.is_empty() {
        return Err(found);
    }
    let count = script.channels();
    let workflow = quoted(&protocol.subject.program.plan.workflow);
    let Script { loads, steps, .. } = script;
    let steps = if steps.is_empty() { "    pass\n" } else { &steps };
    let text = format!(
        "{HELPERS}\n\nWORKFLOW = {workflow}\nCHANNELS = {count}\n\n\nasync def run(lh, deck):\n{loads}{steps}\n\nif __name__ == \"__main__\":\n    asyncio.run(main())\n"
    );
    Ok(text.into_bytes())
}

fn no_call(command: &Command, why: &str) -> Diagnostic {
    not_expressible(command.at, format!("{WHAT} has no call for `{}`", command.name), why.to_owned())
        .help("use `--target opentrons-python`")
}

/// A pipette.
#[derive(Debug, Default)]
struct Pipette {
    /// What Opentrons calls its model.
    model: String,
    /// Its channels, from the back.
    channels: Vec<usize>,
    /// How many of them carry tips.
    tips: usize,
    /// Where it is: labware and wells, and where in them.
    at: Option<(Vec<String>, String, Spot)>,
    /// Volume that was aspirated and not yet dispensed, µL.
    drawn: f64,
    /// Whether it was brought over the bin to drop its tips.
    aimed: bool,
}

/// Where in a well, mm: above the lowest point of its inside, to the right and to the back of its middle.
#[derive(Clone, Copy, Debug, Default)]
struct Spot {
    /// None at the rim of the bin, whose depth PyLabRobot knows.
    z: Option<f64>,
    x: f64,
    y: f64,
}

struct Script<'p> {
    definitions: BTreeMap<&'p str, &'p Value>,
    pipettes: BTreeMap<String, Pipette>,
    /// The definition of what was loaded.
    labware: BTreeMap<String, &'p Value>,
    /// What the lab calls it.
    names: BTreeMap<String, String>,
    /// In which slot it stands.
    slots: BTreeMap<String, String>,
    /// Tips that are not in their places.
    tips: BTreeSet<(String, String)>,
    loads: String,
    steps: String,
}

impl Spot {
    /// The height as an argument.
    fn height(self) -> String {
        self.z.map_or("None".to_owned(), |z| z.to_string())
    }
}

impl<'p> Script<'p> {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.steps, "    {text}");
    }

    /// How many channels all pipettes have.
    fn channels(&self) -> usize {
        self.pipettes.values().map(|pipette| pipette.channels.len()).sum()
    }

    fn load(&mut self, command: &Command) -> Result<(), Diagnostic> {
        let text = |name: &str| command.text(name);
        match command.name {
            "loadPipette" => {
                let first = self.channels();
                let count = if text("pipetteName").contains("multi") { 8 } else { 1 };
                let model = text("pipetteName").to_owned();
                if self.pipettes.values().any(|other| other.model == model) {
                    return Err(no_call(command, "it takes the left one of two pipettes of the same model"));
                }
                let channels = (first..first + count).collect();
                self.pipettes.insert(text("pipetteId").to_owned(), Pipette { model, channels, ..Pipette::default() });
            }
            "loadLabware" => {
                let uri =
                    format!("{}/{}/{}", text("namespace"), text("loadName"), shown(command.params.get("version")));
                let Some(definition) = self.definitions.get(uri.as_str()).copied() else {
                    return Err(no_call(command, "the definition of this labware is not at hand"));
                };
                let Some(slot) = command.params.get("location").and_then(|location| location["slotName"].as_str())
                else {
                    return Err(no_call(command, "this stands on something else than a slot"));
                };
                let id = text("labwareId").to_owned();
                let made = resource(&id, definition);
                let _ = writeln!(self.loads, "    {id} = {made}\n    deck.assign_child_at_slot({id}, {slot})");
                self.labware.insert(id.clone(), definition);
                self.names.insert(id.clone(), text("displayName").to_owned());
                self.slots.insert(id, slot.to_owned());
            }
            // Nothing stands on it, and nothing is said to it, or that is refused.
            "loadModule" => {
                let slot = command.params.get("location").and_then(|location| location["slotName"].as_str());
                let (id, slot) = (text("moduleId"), slot.unwrap_or_default());
                let _ = writeln!(self.loads, "    # {id} stands in slot {slot}, and PyLabRobot does not know of it.");
            }
            // PyLabRobot does not follow what wells hold unless it is asked to.
            "loadLiquid" => {}
            _ => return Err(no_call(command, "this is loaded at the start")),
        }
        Ok(())
    }

    /// The wells that the channels of a pipette reach where the first one goes to a well: those that are there, in a row, or a trough for each.
    /// None in the bin, which is no labware.
    fn row(&self, labware: &str, well: &str, channels: usize) -> Vec<String> {
        let Some(definition) = self.labware.get(labware) else { return Vec::new() };
        let at = |well: &Value, axis: &str| well[axis].as_f64().unwrap_or(f64::NAN);
        let first = &definition["wells"][well];
        let is_centred =
            definition["parameters"]["quirks"].as_array().is_some_and(|all| all.iter().any(|quirk| quirk == CENTRED));
        if channels == 1 || is_centred {
            return vec![well.to_owned(); channels];
        }
        let wells = definition["wells"].as_object();
        let there = |channel: usize| {
            let (x, y) = (at(first, "x"), at(first, "y") - PITCH * channel as f64);
            let near = |well: &Value| (at(well, "x") - x).abs() < 0.5 && (at(well, "y") - y).abs() < 0.5;
            wells?.iter().find(|(_, well)| near(well)).map(|(name, _)| name.clone())
        };
        (0..channels).map_while(there).collect()
    }

    /// Where a command is done.
    fn spot(&self, command: &Command) -> Spot {
        let location = command.params.get("wellLocation").filter(|_| command.text("labwareId") != BIN);
        let Some(location) = location else { return Spot::default() };
        let [x, y, z] = ["x", "y", "z"].map(|axis| location["offset"][axis].as_f64().unwrap_or(0.0));
        let well = self.labware.get(command.text("labwareId")).map(|d| &d["wells"][command.text("wellName")]);
        let depth = well.and_then(|well| well["depth"].as_f64()).unwrap_or(0.0);
        let from = match location["origin"].as_str() {
            Some("bottom") => 0.0,
            Some("center") => depth / 2.0,
            _ => depth,
        };
        // To the micrometre: what is left of a sum of decimals is none of the user's.
        Spot { z: Some(((from + z) * 1e3).round() / 1e3), x, y }
    }

    /// What a step does with liquid at a place.
    fn pass(&mut self, call: &str, command: &Command, volume: f64, more: &str) -> Result<(), Diagnostic> {
        let name = command.text("pipetteId").to_owned();
        if self.pipettes.iter().any(|(other, pipette)| *other != name && pipette.tips > 0) {
            return Err(no_call(command, "both pipettes carry tips, and it chooses between them by the volume"));
        }
        self.go(command);
        self.pass_here(call, &name, volume, command, more)
    }

    /// Takes a pipette to the place of a command: the wells that its channels reach, and where in them.
    fn go(&mut self, command: &Command) -> (Vec<String>, Spot) {
        let (name, labware) = (command.text("pipetteId"), command.text("labwareId"));
        let channels = self.pipettes.get(name).map_or(1, |pipette| pipette.channels.len());
        let (row, spot) = (self.row(labware, command.text("wellName"), channels), self.spot(command));
        if let Some(pipette) = self.pipettes.get_mut(name) {
            pipette.at = Some((row.clone(), labware.to_owned(), spot));
        }
        (row, spot)
    }

    /// The same where the pipette is.
    fn pass_here(
        &mut self,
        call: &str,
        pipette: &str,
        volume: f64,
        command: &Command,
        more: &str,
    ) -> Result<(), Diagnostic> {
        let Some(Pipette { channels, tips, at: Some((row, labware, spot)), .. }) = self.pipettes.get(pipette) else {
            return Err(no_call(command, "the pipette is above no well"));
        };
        let used = &channels[..(*tips).min(channels.len())];
        let places = match labware.as_str() {
            BIN => format!("[deck.get_trash_area()] * {}", used.len()),
            _ if row.len() >= used.len() => format!("at({labware}, {})", listed(&row[..used.len()])),
            _ => return Err(no_call(command, "a channel with a tip is over no well")),
        };
        let rate = command.params.get("flowRate").map_or(String::new(), |rate| format!(", rate={}", shown(Some(rate))));
        let aside = match (spot.x, spot.y) {
            (0.0, 0.0) => String::new(),
            (x, y) => format!(", x={x}, y={y}"),
        };
        let line =
            format!("await {call}(lh, {places}, {used:?}, {volume}, height={}{aside}{rate}{more})", spot.height());
        self.line(&line);
        Ok(())
    }

    fn step(&mut self, command: &Command) -> Result<(), Diagnostic> {
        let text = |name: &str| command.text(name);
        let number = |name: &str| command.params.get(name).and_then(Value::as_f64).unwrap_or(0.0);
        let name = text("pipetteId").to_owned();
        let (count, tips, first) = self
            .pipettes
            .get(&name)
            .map_or((1, 0, 0), |p| (p.channels.len(), p.tips, p.channels.first().copied().unwrap_or(0)));
        match command.name {
            "pickUpTip" => {
                let rack = text("labwareId").to_owned();
                let there = |well: &String| !self.tips.contains(&(rack.clone(), well.clone()));
                let row: Vec<String> = self.row(&rack, text("wellName"), count).into_iter().take_while(there).collect();
                self.tips.extend(row.iter().map(|well| (rack.clone(), well.clone())));
                let Some(pipette) = self.pipettes.get_mut(&name) else { return Ok(()) };
                let used = pipette.channels[..row.len()].to_vec();
                (pipette.tips, pipette.at, pipette.drawn) = (row.len(), None, 0.0);
                self.line(&format!("await lh.pick_up_tips(at({rack}, {}), use_channels={used:?})", listed(&row)));
            }
            "aspirate" | "dispense" => {
                self.pass(command.name, command, number("volume"), "")?;
                let sign = if command.name == "aspirate" { 1.0 } else { -1.0 };
                self.draw(&name, sign * number("volume"));
            }
            "blowout" => {
                let rest = self.pipettes.get(&name).map_or(0.0, |pipette| pipette.drawn);
                self.pass("dispense", command, rest, ", blow_out=BLOW_OUT")?;
                self.draw(&name, -rest);
            }
            "aspirateInPlace" => {
                self.pass_here("aspirate", &name, number("volume"), command, "")?;
                self.draw(&name, number("volume"));
            }
            "moveToWell" | "touchTip" => {
                let (row, spot) = self.go(command);
                let labware = text("labwareId");
                let place = match (labware, row.first()) {
                    (BIN, _) => "deck.get_trash_area()".to_owned(),
                    (_, Some(well)) => format!("at({labware}, {})[0]", quoted(well)),
                    (_, None) => return Err(no_call(command, "this labware is not on the deck")),
                };
                if command.name == "touchTip" {
                    let radius = command.params.get("radius").and_then(Value::as_f64).unwrap_or(1.0);
                    self.line(&format!("await touch(lh, {first}, {place}, height={}, radius={radius})", spot.height()));
                } else {
                    let (x, y) = (spot.x, spot.y);
                    self.line(&format!("await move(lh, {first}, {place}, height={}, x={x}, y={y})", spot.height()));
                }
            }
            "moveToCoordinates" => {
                let at = |axis: &str| shown(command.params.get("coordinates").map(|place| &place[axis]));
                self.line(&format!("await move_to(lh, {first}, Coordinate({}, {}, {}))", at("x"), at("y"), at("z")));
                if let Some(pipette) = self.pipettes.get_mut(&name) {
                    pipette.at = None;
                }
            }
            "moveToAddressableAreaForDropTip" => {
                if let Some(pipette) = self.pipettes.get_mut(&name) {
                    pipette.aimed = true;
                }
            }
            "dropTip" | "dropTipInPlace" => {
                let rack = text("labwareId").to_owned();
                let row: Vec<String> = self.row(&rack, text("wellName"), count).into_iter().take(tips).collect();
                let Some(pipette) = self.pipettes.get_mut(&name) else { return Ok(()) };
                let used = pipette.channels[..tips].to_vec();
                let over = std::mem::take(&mut pipette.aimed) || rack == BIN;
                (pipette.tips, pipette.at, pipette.drawn) = (0, None, 0.0);
                if row.is_empty() && !over {
                    return Err(no_call(command, "the pipette is not over the bin"));
                }
                if row.is_empty() {
                    self.line(&format!("await lh.discard_tips(use_channels={used:?}, allow_nonzero_volume=True)"));
                } else {
                    for well in &row {
                        self.tips.remove(&(rack.clone(), well.clone()));
                    }
                    let places = listed(&row);
                    self.line(&format!(
                        "await lh.drop_tips(at({rack}, {places}), use_channels={used:?}, allow_nonzero_volume=True)"
                    ));
                }
            }
            "setTipState" => {
                let rack = text("labwareId").to_owned();
                self.tips.retain(|(of, _)| *of != rack);
                self.line(&format!("{rack}.fill()"));
            }
            "moveLabware" => {
                let id = text("labwareId").to_owned();
                let to = command.params.get("newLocation").cloned().unwrap_or_default();
                if self.labware.get(&id).is_some_and(|d| d["parameters"]["isTiprack"] == true) {
                    return Err(no_call(command, "it goes on taking tips where a rack stood first"));
                }
                let place = match (to.as_str(), to["slotName"].as_str()) {
                    (Some(_), _) => None,
                    (None, Some(slot)) => Some(slot.to_owned()),
                    (None, None) => return Err(no_call(command, "it goes onto something else than a slot")),
                };
                if text("strategy") == "manualMoveWithPause" {
                    let to = place.as_ref().map_or("off the deck".to_owned(), |slot| format!("to slot {slot}"));
                    self.line(&format!(
                        "ask({})",
                        quoted(&format!("Move {} {to}.", self.names.get(&id).unwrap_or(&id)))
                    ));
                }
                if self.slots.remove(&id).is_some() {
                    self.line(&format!("deck.unassign_child_resource({id})"));
                }
                if let Some(slot) = place {
                    self.line(&format!("deck.assign_child_at_slot({id}, {slot})"));
                    self.slots.insert(id, slot);
                }
            }
            "home" => self.line("await home(lh)"),
            "waitForDuration" => self.line(&format!("await wait(lh, {})", shown(command.params.get("seconds")))),
            "waitForResume" => self.line(&format!("ask({})", quoted(text("message")))),
            "comment" => self.line(&format!("print({})", quoted(text("message")))),
            _ => return Err(no_call(command, "this step sends it")),
        }
        Ok(())
    }

    /// A pipette has drawn so much more, µL.
    fn draw(&mut self, pipette: &str, volume: f64) {
        if let Some(pipette) = self.pipettes.get_mut(pipette) {
            // What rounding leaves of a sum is nothing.
            pipette.drawn = Some(pipette.drawn + volume).filter(|left| *left > 1e-9).unwrap_or(0.0);
        }
    }
}

/// Names as arguments.
fn listed(names: &[String]) -> String {
    names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ")
}

/// Labware as a resource of PyLabRobot.
fn resource(id: &str, definition: &Value) -> String {
    let size = ["xDimension", "yDimension", "zDimension"].map(|axis| shown(Some(&definition["dimensions"][axis])));
    let mut wells = String::new();
    let columns = definition["ordering"].as_array().into_iter().flatten();
    for name in columns.filter_map(Value::as_array).flatten().filter_map(Value::as_str) {
        let well = &definition["wells"][name];
        let of = |key: &str| shown(Some(&well[key]));
        let across = match well["diameter"].as_f64() {
            Some(_) => format!("[{}]", of("diameter")),
            None => format!("[{}, {}]", of("xDimension"), of("yDimension")),
        };
        let [x, y, z, depth, volume] = ["x", "y", "z", "depth", "totalLiquidVolume"].map(of);
        let _ = writeln!(wells, "        ({}, {x}, {y}, {z}, {across}, {depth}, {volume}),", quoted(name));
    }
    let size = size.join(", ");
    let name = quoted(id);
    let parameters = &definition["parameters"];
    match parameters["isTiprack"] == true {
        true => {
            let [length, overlap] = ["tipLength", "tipOverlap"].map(|key| shown(Some(&parameters[key])));
            let is_filter = parameters["loadName"].as_str().is_some_and(|name| name.contains("filter"));
            let filter = if is_filter { "True" } else { "False" };
            format!("make_tip_rack({name}, ({size}), {length}, {overlap}, {filter}, [\n{wells}    ])")
        }
        false => format!("make_plate({name}, ({size}), [\n{wells}    ])"),
    }
}
