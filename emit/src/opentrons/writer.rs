//! Steps as commands: each message of a driver with the identifiers of what it is about.

use std::collections::{BTreeMap, BTreeSet};

use matterix_ir::plan::Step;
use matterix_ir::scene::InstanceId;
use matterix_ir::script::Wired;
use matterix_ir::{Diagnostic, Span};
use serde_json::{Map, Value, json};

use super::WHAT;
use super::deck::{Deck, GRIPPER_CHUTE, Location, Waste, label};
use super::form::{About, BIN_ID, BY_GRIPPER, Holds, LAY_OUT, TRASH_BIN};
use super::layout::Layout;
use super::message::{Message, names};
use super::protocol::{Command, Protocol, belongs};
use crate::finding::not_expressible;
use crate::performance::Said;

/// The name space of the definitions that come with Opentrons' software.
const OWN: &str = "opentrons";

/// How the command begins that moves labware.
pub(super) const MOVES: &str = "moveLabware ";

/// A pipette, and how it takes tips.
#[derive(Debug)]
pub(super) struct Head {
    channels: usize,
    /// The corner of it at which the channels begin that take tips next, or `all`.
    corner: String,
    /// Which nozzles take tips.
    layout: Layout,
}

/// A protocol that is being put together.
pub(super) struct Writer<'p, 'f> {
    pub(super) protocol: Protocol<'p>,
    pub(super) deck: Deck<'p>,
    pub(super) origins: Vec<Span>,
    /// Labware that a person puts in another place, and whether somebody is asked for its first move.
    pub(super) moved: BTreeMap<InstanceId, bool>,
    /// Labware that stands off the deck now.
    pub(super) off: BTreeSet<InstanceId>,
    /// Pipettes that are loaded.
    pub(super) heads: BTreeMap<InstanceId, Head>,
    /// What loads labware that comes to the deck on the way, without a question.
    pub(super) later: BTreeMap<InstanceId, Said>,
    pub(super) found: &'f mut Vec<Diagnostic>,
}

impl Writer<'_, '_> {
    /// Adds a command.
    pub(super) fn push(&mut self, name: &'static str, params: Value, at: Span) {
        let Value::Object(params) = params else { return };
        self.protocol.commands.push(Command { name, params, at });
    }

    /// Loads labware where it is put first.
    fn bring(&mut self, device: InstanceId, load: &Said, moved: &[Said], at: Span) {
        self.deck.load(device, About::Labware);
        for said in moved {
            let loaded = Message::read(said).and_then(|moved| {
                let place = moved.get("newLocation").unwrap_or_default().to_owned();
                let mut message = Message::read(load)?;
                for (field, value) in &mut message.fields {
                    if *field == "location" {
                        value.clone_from(&place);
                    }
                }
                self.command(device, &message, at)
            });
            match loaded {
                Ok(command) => self.protocol.commands.push(command),
                Err(d) => self.found.push(d),
            }
        }
    }

    /// A person who is asked to move labware, as the robot itself asks: it waits for that by itself.
    pub(super) fn join_pause(&mut self) {
        let commands = &mut self.protocol.commands;
        if let [.., pause, moved] = commands.as_mut_slice()
            && (pause.name, moved.name) == ("waitForResume", "moveLabware")
            && pause.at == moved.at
        {
            moved.params.insert("strategy".to_owned(), "manualMoveWithPause".into());
            commands.remove(commands.len() - 2);
        }
    }

    fn name(&self, id: InstanceId) -> &str {
        &self.protocol.subject.program.scene.get(id).name
    }

    /// What a device is told before anything else: it is loaded if it is part of the robot or stands on it.
    pub(super) fn open(&mut self, wired: &Wired, said: &Said) {
        let message = match Message::read(said) {
            Ok(message) => message,
            Err(d) => return self.found.push(d),
        };
        let (robot, at) = (self.protocol.robot.device, self.protocol.subject.program.scene.get(wired.device).span);
        let comes = message.get("location").is_some_and(|location| self.deck.location(location).is_none());
        if message.form.about == About::Labware && comes && self.moved.get(&wired.device) == Some(&false) {
            self.later.insert(wired.device, said.clone());
            return;
        }
        let here = match message.form.about {
            About::Robot => true,
            About::Pipette => belongs(self.protocol.subject, wired.device, robot),
            About::Labware | About::Module | About::Bin => match message.get("location") {
                Some(location) => self.deck.location(location).is_some() || self.moved.contains_key(&wired.device),
                None => self.deck.get(wired.device).is_some(),
            },
            About::Well => self.deck.well(wired.device).is_some() && message.get("volume") != Some("0"),
        };
        if !here {
            return;
        }
        if message.form.about != About::Well && self.deck.get(wired.device).is_none() {
            self.deck.load(wired.device, message.form.about);
        }
        if message.form.name == "loadPipette"
            && let Err(d) = self.known_head(wired.device, &message, at)
        {
            return self.found.push(d);
        }
        if message.form.about == About::Bin {
            let slot = label(message.get("location").unwrap_or_default()).to_owned();
            let waste = if message.form.name == TRASH_BIN { Waste::Bin(slot) } else { Waste::Chute };
            self.deck.keep_waste(wired.device, waste);
        }
        match self.command(wired.device, &message, at) {
            Ok(command) => self.protocol.loads.push(command),
            Err(d) => self.found.push(d),
        }
    }

    /// Says what a step says.
    pub(super) fn operation(&mut self, step: u32, said: Option<&[Said]>, at: Span) {
        let program = self.protocol.subject.program;
        let step = &program.plan.steps[step as usize];
        let Step::Operation(operation) = &step.step else { return };
        let wired = operation.device.and_then(|d| self.protocol.subject.wiring.of(d));
        let (Some(said), Some(device)) = (said, operation.device) else {
            let d = match (operation.device, wired) {
                (Some(device), Some(wired)) => {
                    let headline =
                        format!("{WHAT} has no command for `{}` with `{}`", operation.verb, self.name(device));
                    let help = format!("its driver `{}` has no line for this verb", wired.driver);
                    not_expressible(at, headline, format!("this step does `{}`", step.label)).help(help)
                }
                (Some(device), None) => {
                    // What is out of reach is so at every step.
                    let reached = format!("{WHAT} cannot control `{}`", self.name(device));
                    if let Some(known) = self.found.iter_mut().find(|d| d.headline == reached) {
                        let d = known.clone().because(at, "also here");
                        *known = d;
                        return;
                    }
                    let headline = format!("{WHAT} cannot control `{}`", self.name(device));
                    let help = format!("`{}` has no driver over `{}`", program.scene.get(device).kind, super::WIRE);
                    not_expressible(at, headline, format!("this step does `{}`", step.label)).help(help)
                }
                (None, _) => not_expressible(
                    at,
                    format!("{WHAT} has no command for `{}`", operation.verb),
                    "no device of the robot does this",
                ),
            };
            return self.found.push(d);
        };
        if let Some(load) = self.later.remove(&device) {
            return self.bring(device, &load, said, at);
        }
        if self.deck.get(device).is_none() && !belongs(self.protocol.subject, device, self.protocol.robot.device) {
            let headline =
                format!("`{}` is not a part of `{}`", self.name(device), self.name(self.protocol.robot.device));
            return self.found.push(not_expressible(at, headline, format!("this step does `{}`", step.label)));
        }
        for said in said {
            let message = match Message::read(said) {
                Ok(message) => message,
                Err(d) => {
                    self.found.push(d);
                    continue;
                }
            };
            if message.form.name == LAY_OUT {
                if let Some(head) = self.heads.get_mut(&device) {
                    head.corner = message.get("corner").unwrap_or("all").to_owned();
                }
                continue;
            }
            match self.lay_out(device, &message, at).and_then(|()| self.command(device, &message, at)) {
                Ok(command) => self.protocol.commands.push(command),
                Err(d) => self.found.push(d),
            }
        }
    }

    /// Keeps how many channels a pipette has, if it has those of the one at Opentrons that it is called after.
    fn known_head(&mut self, device: InstanceId, message: &Message<'_>, at: Span) -> Result<(), Diagnostic> {
        let [model, channels, rows] =
            ["pipetteName", "channels", "rows"].map(|field| message.get(field).unwrap_or_default());
        let parsed = |text: &str| text.parse::<usize>().unwrap_or(0);
        let (channels, rows) = (parsed(channels), parsed(rows));
        self.heads.insert(device, Head { channels, corner: "all".to_owned(), layout: Layout::All });
        let expected = match model {
            m if m.ends_with("_96") => 96,
            m if m.contains("_multi") => 8,
            m if m.contains("_single") => 1,
            _ => {
                let headline = format!("`{}` is not called after a pipette of Opentrons", self.name(device));
                let label = format!("its `model` is \"{model}\"");
                return Err(not_expressible(at, headline, label).help("such a name is `p300_multi_gen2`"));
            }
        };
        if channels == expected && rows == expected.min(8) {
            return Ok(());
        }
        let headline = format!("`{}` has other channels than a `{model}`", self.name(device));
        let label =
            format!("{channels} in rows of {rows}, and that pipette has {expected} in rows of {}", expected.min(8));
        Err(not_expressible(at, headline, label))
    }

    /// Says which nozzles take tips, where that is not as it was.
    fn lay_out(&mut self, device: InstanceId, message: &Message<'_>, at: Span) -> Result<(), Diagnostic> {
        let Some(head) = self.heads.get_mut(&device).filter(|_| message.form.name == "pickUpTip") else {
            return Ok(());
        };
        let places = names(message.get("well").unwrap_or_default());
        let labels: Vec<&str> = places.iter().map(|place| label(place)).collect();
        let Some(layout) = Layout::of(&head.corner, &labels, head.channels) else {
            let headline = format!("{WHAT} has no layout of nozzles for these {} tips", labels.len());
            let help = "take one tip, a column from `A1` or `A12`, a row from `A1` or `H1`, or fewer than eight of a column from `H1`";
            return Err(not_expressible(at, headline, "this step takes them").help(help));
        };
        if head.layout != layout {
            let own = self.deck.get(device).map(|l| l.id.clone()).unwrap_or_default();
            let params = json!({ "pipetteId": own, "configurationParams": layout.params() });
            head.layout = layout;
            self.push("configureNozzleLayout", params, at);
        }
        Ok(())
    }

    /// A message as a command.
    fn command(&mut self, device: InstanceId, message: &Message<'_>, at: Span) -> Result<Command, Diagnostic> {
        let mut params = Map::new();
        let own = self.deck.get(device).map(|l| l.id.clone()).unwrap_or_default();
        match message.form.about {
            About::Robot => {}
            About::Bin => drop(params.insert(BIN_ID.to_owned(), own.into())),
            About::Pipette => drop(params.insert("pipetteId".to_owned(), own.into())),
            About::Module => drop(params.insert("moduleId".to_owned(), own.into())),
            About::Labware => drop(params.insert("labwareId".to_owned(), own.into())),
            About::Well => {
                let (labware, well) = self.deck.well(device).unwrap_or_default();
                params.insert("labwareId".to_owned(), labware.into());
                params.insert("wellName".to_owned(), well.into());
            }
        }
        let mut name = message.form.name;
        if name == BY_GRIPPER {
            name = "moveLabware";
            params.insert("strategy".to_owned(), "usingGripper".into());
        }
        let mut spot = Map::new();
        for (field, value) in &message.fields {
            let Some(holds) = message.form.field(field) else { continue };
            let key = (*field).to_owned();
            match holds {
                Holds::Text => drop(params.insert(key, value.as_str().into())),
                Holds::Number => drop(params.insert(key, parsed(message, field, value)?.into())),
                Holds::Mount => {
                    drop(params.insert("axes".to_owned(), json!([format!("{value}Z"), format!("{value}Plunger")])))
                }
                Holds::Plunger => drop(params.insert("axes".to_owned(), json!([format!("{value}Plunger")]))),
                Holds::Given => {
                    let value = parsed(message, field, value)?;
                    if value != 0.0 {
                        params.insert(key, value.into());
                    }
                }
                Holds::FromZero => {
                    let value = parsed(message, field, value)?;
                    if value >= 0.0 {
                        params.insert(key, value.into());
                    }
                }
                Holds::Wavelength => {
                    params.insert("measureMode".to_owned(), "single".into());
                    params.insert(key, json!([parsed(message, field, value)?.round() as i64]));
                }
                Holds::Reference => {
                    let nanometres = parsed(message, field, value)?.round() as i64;
                    if nanometres > 0 {
                        params.insert(key, nanometres.into());
                    }
                }
                Holds::Flag => drop(params.insert(key, flag(message, field, value)?.into())),
                Holds::Well => {
                    let (labware, well) = self.well(device, message, value, at)?;
                    params.insert("labwareId".to_owned(), labware.into());
                    params.insert("wellName".to_owned(), well.into());
                }
                Holds::Origin if ["top", "bottom", "center"].contains(&value.as_str()) => {
                    drop(spot.insert("origin".to_owned(), value.as_str().into()))
                }
                Holds::Origin => return Err(message.wrong(format!("`{value}` is not a position in a well"))),
                Holds::Offset => {
                    let offset = spot.entry("offset").or_insert_with(|| json!({ "x": 0, "y": 0, "z": 0 }));
                    // None is not less than none.
                    offset[*field] = (parsed(message, field, value)? + 0.0).into();
                }
                Holds::Coordinate => {
                    let place = params.entry("coordinates").or_insert_with(|| json!({}));
                    place[*field] = (parsed(message, field, value)? + 0.0).into();
                }
                Holds::Location => {
                    let location = self.deck.location_or_off(value);
                    let _ = if location == Location::Off { self.off.insert(device) } else { self.off.remove(&device) };
                    let location = match location {
                        Location::Slot(slot) if is_staging(&slot) => json!({ "addressableAreaName": slot }),
                        Location::Slot(slot) => json!({ "slotName": slot }),
                        Location::Chute => json!({ "addressableAreaName": GRIPPER_CHUTE }),
                        Location::Module(id) => json!({ "moduleId": id }),
                        Location::Labware(id) => json!({ "labwareId": id }),
                        Location::Off => json!("offDeck"),
                    };
                    params.insert(key, location);
                }
                Holds::Labware => {
                    let scene = &self.protocol.subject.program.scene;
                    let labware = scene.find(value).and_then(|id| self.deck.get(id));
                    let Some(labware) = labware.filter(|l| l.about == About::Labware) else {
                        return Err(self.not_on_deck(value, at, "this step moves it"));
                    };
                    params.insert("labwareId".to_owned(), labware.id.clone().into());
                }
                Holds::Shift => {
                    let shift = parsed(message, field, value)?;
                    if let Some((of, axis)) = field.split_once('/')
                        && shift != 0.0
                    {
                        let offset = params.entry(of).or_insert_with(|| json!({ "x": 0, "y": 0, "z": 0 }));
                        offset[axis] = shift.into();
                    }
                }
                Holds::Bin => {
                    let Some(waste) = self.deck.waste(value) else {
                        let headline =
                            format!("`{value}` is no bin on the deck of `{}`", self.name(self.protocol.robot.device));
                        let help = "place a bin on the deck: `bin = FlexTrash on flex.slot[A3]`";
                        return Err(not_expressible(at, headline, "this step goes there").help(help));
                    };
                    let area = waste.area(message.get("channels").unwrap_or_default());
                    if waste == Waste::Chute {
                        name = "moveToAddressableArea";
                    }
                    params.insert("addressableAreaName".to_owned(), area.into());
                }
                Holds::Channels | Holds::Corner => {}
                Holds::Definition => self.definition(value, device, &mut params)?,
            }
        }
        if !spot.is_empty() {
            params.insert("wellLocation".to_owned(), spot.into());
        }
        if name == "moveToAddressableArea" {
            params.remove("alternateDropLocation");
        }
        Ok(Command { name, params, at })
    }

    /// The place a command is about: where its first channel goes, or the last one that takes tips.
    fn well(
        &self,
        device: InstanceId,
        message: &Message<'_>,
        value: &str,
        at: Span,
    ) -> Result<(String, String), Diagnostic> {
        let scene = &self.protocol.subject.program.scene;
        let all = names(value);
        let mut places = Vec::new();
        for name in &all {
            let is_off = |id: &InstanceId| scene.get(*id).owner.is_some_and(|owner| self.off.contains(&owner));
            let place = scene.find(name).filter(|id| !is_off(id)).and_then(|id| self.deck.well(id));
            let Some(place) = place else {
                return Err(self.not_on_deck(name, at, "this step goes there"));
            };
            places.push(place);
        }
        let names_front = self.heads.get(&device).is_some_and(|head| head.layout.names_front());
        let first = if names_front { places.last() } else { places.first() };
        let Some(first) = first.cloned() else { return Err(message.wrong("it names no place".to_owned())) };
        if places.iter().any(|(labware, _)| *labware != first.0) {
            return Err(not_expressible(at, format!("{WHAT} goes to one labware at a time"), "several labware"));
        }
        Ok(first)
    }

    /// A finding about what is not on the deck where a step needs it there.
    fn not_on_deck(&self, name: &str, at: Span, label: &str) -> Diagnostic {
        let headline = format!("`{name}` is not on the deck of `{}`", self.name(self.protocol.robot.device));
        not_expressible(at, headline, label).help("place it on the deck, or on a module there, before this step")
    }

    /// Puts in the definition of a labware, and keeps it where Opentrons does not know it.
    fn definition(&mut self, uri: &str, device: InstanceId, params: &mut Map<String, Value>) -> Result<(), Diagnostic> {
        let instance = self.protocol.subject.program.scene.get(device);
        let parts: Vec<&str> = uri.split('/').collect();
        let version = parts.get(2).and_then(|v| v.parse::<u64>().ok());
        let ([space, name, _], Some(version)) = (parts.as_slice(), version) else {
            let headline = format!("`{}` has no Opentrons labware definition", instance.name);
            let help =
                format!("add it to `{}`: `definition: \"opentrons/corning_96_wellplate_360ul_flat/2\"`", instance.kind);
            return Err(not_expressible(instance.span, headline, "no definition").help(help));
        };
        params.insert("loadName".to_owned(), (*name).into());
        params.insert("namespace".to_owned(), (*space).into());
        params.insert("version".to_owned(), version.into());
        params.insert("displayName".to_owned(), instance.name.as_str().into());
        let texts = self.protocol.subject.wiring.files.values().filter(|text| text.contains(name));
        let found = texts.filter_map(|t| serde_json::from_str::<Value>(t).ok()).find(|d| {
            let text = |v: &Value| v.as_str().map(str::to_owned);
            text(&d["namespace"]).as_deref() == Some(space)
                && text(&d["parameters"]["loadName"]).as_deref() == Some(name)
                && d["version"].as_u64() == Some(version)
        });
        let roles = found.as_ref().and_then(|d| d["allowedRoles"].as_array());
        if roles.is_some_and(|roles| roles.iter().any(|role| role == "adapter")) {
            self.protocol.adapters.insert(uri.to_owned());
        }
        let known = |all: &[(String, Value)]| all.iter().any(|(known, _)| known == uri);
        match found {
            Some(found) if *space == OWN && !known(&self.protocol.library) => {
                self.protocol.library.push((uri.to_owned(), found))
            }
            Some(found) if *space != OWN && !known(&self.protocol.definitions) => {
                self.protocol.definitions.push((uri.to_owned(), found))
            }
            None if *space != OWN => {
                let headline = format!("the definition `{uri}` of `{}` was not found", instance.name);
                let help = "import the asset `from labware \"FILE.json\"`";
                return Err(not_expressible(instance.span, headline, "its own definition").help(help));
            }
            _ => {}
        }
        Ok(())
    }
}

/// Whether a place of the deck is one of those beside it, where labware waits.
fn is_staging(slot: &str) -> bool {
    matches!(slot, "A4" | "B4" | "C4" | "D4")
}

fn parsed(message: &Message<'_>, name: &str, value: &str) -> Result<f64, Diagnostic> {
    let known = value.parse::<f64>().ok().filter(|v| v.is_finite());
    known.ok_or_else(|| message.wrong(format!("`{name}` is `{value}`, which is not a number")))
}

fn flag(message: &Message<'_>, name: &str, value: &str) -> Result<bool, Diagnostic> {
    value.parse().map_err(|_| message.wrong(format!("`{name}` is `{value}`, neither `true` nor `false`")))
}
