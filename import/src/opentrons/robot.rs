//! The robots of Opentrons, and where they throw things away.

use std::collections::BTreeMap;

use super::analysis::Command;

/// How commands call the bin that is part of a robot, or the one that stands in place A3 of a Flex where a protocol loads none.
pub(super) const TRASH: &str = "fixedTrash";

/// How the areas of bins begin, and what those of the chute have in them.
const MOVABLE: &str = "movableTrash";
const CHUTE: &str = "WasteChute";

/// A robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Robot {
    #[default]
    Ot2,
    Flex,
}

impl Robot {
    /// The robot that analyses call so.
    pub(super) fn named(model: &str) -> Option<Robot> {
        match model {
            m if m.starts_with("OT-2") => Some(Robot::Ot2),
            m if m.starts_with("OT-3") => Some(Robot::Flex),
            _ => None,
        }
    }

    /// What it is called in the file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Robot::Ot2 => "ot2",
            Robot::Flex => "flex",
        }
    }

    /// Its asset.
    pub(super) fn asset(self) -> &'static str {
        match self {
            Robot::Ot2 => "OT2",
            Robot::Flex => "Flex",
        }
    }

    /// Where a thermocycler stands whose place is not given.
    pub(super) fn cycler(self) -> &'static str {
        match self {
            Robot::Ot2 => "7",
            Robot::Flex => "B1",
        }
    }
}

/// A bin or the chute of a Flex.
#[derive(Clone, Debug)]
pub(super) struct Bin {
    pub(super) name: String,
    pub(super) asset: &'static str,
    /// Its place; none where the protocol needs no bin, but the robot has one.
    pub(super) slot: Option<String>,
}

/// Where things are thrown away, by how commands call that.
#[derive(Debug, Default)]
pub(super) struct Bins {
    robot: Robot,
    bins: BTreeMap<String, Bin>,
    /// The one that a step needs not name.
    usual: String,
}

impl Bins {
    /// Those that commands use, in the order in which they do.
    pub(super) fn of(robot: Robot, commands: &[Command]) -> Bins {
        let mut out = Bins { robot, ..Bins::default() };
        if robot == Robot::Ot2 {
            out.usual = TRASH.to_owned();
            return out;
        }
        let names = commands.iter().flat_map(|c| {
            let area = c.params["newLocation"]["addressableAreaName"].as_str().unwrap_or_default();
            [c.text("addressableAreaName"), c.text("labwareId"), area]
        });
        for name in names {
            let Some(key) = key(name) else { continue };
            let slot = match key {
                TRASH => "A3",
                CHUTE => "D3",
                area => &area[MOVABLE.len()..],
            };
            // The bin that is loaded by itself stands where one may be loaded.
            let is_there = |bin: &Bin| bin.slot.as_deref() == Some(slot) && key != CHUTE;
            if out.bins.contains_key(key) || out.bins.values().any(is_there) {
                continue;
            }
            let (word, asset) = if key == CHUTE { ("chute", "WasteChute") } else { ("bin", "FlexTrash") };
            let number = out.bins.values().filter(|bin| bin.asset == asset).count();
            let name = if number == 0 { word.to_owned() } else { format!("{word}{}", number + 1) };
            if out.bins.is_empty() {
                out.usual = key.to_owned();
            }
            out.bins.insert(key.to_owned(), Bin { name, asset, slot: Some(slot.to_owned()) });
        }
        if out.bins.is_empty() {
            out.usual = TRASH.to_owned();
            let bin = Bin { name: "bin".to_owned(), asset: "FlexTrash", slot: None };
            out.bins.insert(TRASH.to_owned(), bin);
        }
        out
    }

    /// All that stand on the deck by themselves.
    pub(super) fn all(&self) -> impl Iterator<Item = &Bin> {
        self.bins.values()
    }

    /// What the one is called that a step needs not name.
    pub(super) fn usual(&self) -> Option<&str> {
        self.bins.get(&self.usual).map(|bin| bin.name.as_str())
    }

    /// Whether an identifier of labware or of an area is one of them.
    pub(super) fn is_one(&self, name: &str) -> bool {
        key(name).is_some()
    }

    /// What is called so, and whether a step needs not name it.
    pub(super) fn get(&self, name: &str) -> Option<(String, bool)> {
        let key = key(name)?;
        if self.robot == Robot::Ot2 {
            return (key == TRASH).then(|| ("ot2.trash".to_owned(), true));
        }
        self.bins.get(key).map(|bin| (bin.name.clone(), key == self.usual))
    }
}

fn key(name: &str) -> Option<&str> {
    match name {
        TRASH => Some(TRASH),
        chute if chute.ends_with(CHUTE) => Some(CHUTE),
        area if area.len() == MOVABLE.len() + 2 && area.starts_with(MOVABLE) => Some(area),
        _ => None,
    }
}
