//! What stands on the deck of the robot, and what it is called in the protocol.

use std::collections::BTreeMap;

use matterix_ir::scene::{InstanceId, Scene};

use super::form::About;

/// How commands call the fixed bin.
pub(super) const BIN: &str = "fixedTrash";

/// Something that has been loaded.
#[derive(Clone, Debug)]
pub(super) struct Loaded {
    /// Its identifier.
    pub(super) id: String,
    /// What it is.
    pub(super) about: About,
}

/// Where tips and liquids are thrown away.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Waste {
    /// The bin that is part of the robot.
    Fixed,
    /// A bin in a place of the deck.
    Bin(String),
    /// The chute.
    Chute,
}

impl Waste {
    /// The area of the deck that so many channels of a pipette go to.
    pub(super) fn area(&self, channels: &str) -> String {
        match self {
            Waste::Fixed => BIN.to_owned(),
            Waste::Bin(slot) => format!("movableTrash{slot}"),
            Waste::Chute => format!("{channels}{CHUTE}"),
        }
    }
}

/// How areas of the chute end, and the one for the gripper.
pub(super) const CHUTE: &str = "ChannelWasteChute";
pub(super) const GRIPPER_CHUTE: &str = "gripperWasteChute";

/// Where something stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Location {
    /// A place of the deck.
    Slot(String),
    /// A module, by its identifier.
    Module(String),
    /// Other labware, such as an adapter, by its identifier.
    Labware(String),
    /// Anywhere but on the deck.
    Off,
    /// Down the chute.
    Chute,
}

/// Words of Python, and names that a protocol or a program for PyLabRobot has for itself.
const RESERVED: &[&str] = &[
    "and",
    "as",
    "ask",
    "aspirate",
    "assert",
    "async",
    "asyncio",
    "at",
    "await",
    "break",
    "class",
    "continue",
    "deck",
    "def",
    "del",
    "dispense",
    "elif",
    "else",
    "except",
    "finally",
    "for",
    "from",
    "global",
    "home",
    "if",
    "import",
    "in",
    "is",
    "json",
    "lambda",
    "lh",
    "main",
    "make_plate",
    "make_tip_rack",
    "metadata",
    "move",
    "move_to",
    "nonlocal",
    "not",
    "or",
    "pass",
    "print",
    "protocol",
    "raise",
    "requirements",
    "return",
    "run",
    "sys",
    "touch",
    "try",
    "wait",
    "while",
    "with",
    "yield",
];

/// What has been loaded so far.
#[derive(Debug)]
pub(super) struct Deck<'p> {
    scene: &'p Scene,
    robot: InstanceId,
    loaded: BTreeMap<InstanceId, Loaded>,
    wastes: BTreeMap<InstanceId, Waste>,
}

impl<'p> Deck<'p> {
    pub(super) fn new(scene: &'p Scene, robot: InstanceId) -> Self {
        Deck { scene, robot, loaded: BTreeMap::new(), wastes: BTreeMap::new() }
    }

    /// What an instance was loaded as.
    pub(super) fn get(&self, id: InstanceId) -> Option<&Loaded> {
        self.loaded.get(&id)
    }

    /// Gives an instance an identifier of its own: its name with letters, digits and `_` only.
    pub(super) fn load(&mut self, instance: InstanceId, about: About) -> String {
        let plain: String =
            self.scene.get(instance).name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let base = plain.trim_matches('_').to_ascii_lowercase();
        // Liquids are `liquid_1` and so on; whatever is called so gets another number.
        let is_liquid = |id: &str| {
            id.strip_prefix("liquid_").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
        };
        let taken = |id: &str| RESERVED.contains(&id) || is_liquid(id) || self.loaded.values().any(|l| l.id == id);
        // `liquid_2` would be a liquid for every number.
        let stem = if base == "liquid" { "liquid_" } else { &base };
        let id = (1..)
            .map(|n| if n == 1 { base.clone() } else { format!("{stem}_{n}") })
            .find(|id| !taken(id))
            .unwrap_or(base.clone());
        self.loaded.insert(instance, Loaded { id: id.clone(), about });
        id
    }

    /// Where what stands on this thing stands; none where that is neither a place of this deck nor a module or labware on it.
    pub(super) fn location(&self, name: &str) -> Option<Location> {
        let support = self.scene.find(name)?;
        if self.wastes.get(&support) == Some(&Waste::Chute) {
            return Some(Location::Chute);
        }
        match self.loaded.get(&support) {
            Some(Loaded { id, about: About::Module }) => return Some(Location::Module(id.clone())),
            Some(Loaded { id, about: About::Labware }) => return Some(Location::Labware(id.clone())),
            Some(_) => return None,
            None => {}
        }
        (self.scene.get(support).owner == Some(self.robot)).then(|| Location::Slot(label(name).to_owned()))
    }

    /// Keeps where a bin stands.
    pub(super) fn keep_waste(&mut self, id: InstanceId, waste: Waste) {
        self.wastes.insert(id, waste);
    }

    /// What bin a name means, or one of the places of it.
    pub(super) fn waste(&self, name: &str) -> Option<Waste> {
        let id = self.scene.find(name)?;
        match self.wastes.get(&id) {
            Some(waste) => Some(waste.clone()),
            None => (self.scene.get(id).owner == Some(self.robot)).then_some(Waste::Fixed),
        }
    }

    /// Where labware stands that is put on the deck, or taken off it.
    pub(super) fn location_or_off(&self, name: &str) -> Location {
        self.location(name).unwrap_or(Location::Off)
    }

    /// The identifier of the labware that a well or tip belongs to, and its name in it.
    pub(super) fn well(&self, id: InstanceId) -> Option<(String, String)> {
        let instance = self.scene.get(id);
        let whole = instance.owner?;
        // The bin is a part of the robot, which nothing loads.
        if !self.loaded.contains_key(&whole) && self.scene.get(whole).owner == Some(self.robot) {
            return Some((BIN.to_owned(), label(&instance.name).to_owned()));
        }
        let holds = |l: &&Loaded| matches!(l.about, About::Labware | About::Bin);
        let labware = self.loaded.get(&instance.owner?).filter(holds)?;
        Some((labware.id.clone(), label(&instance.name).to_owned()))
    }
}

/// How a place is called in its grid: `A1` of `plate[A1]`, `3` of `ot2.slot[3]`.
pub(super) fn label(name: &str) -> &str {
    name.rsplit_once('[').map_or(name, |(_, label)| label.trim_end_matches(']'))
}
