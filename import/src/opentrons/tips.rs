//! Racks that a person refills: where a pause asks for tips, those whose tips are taken again after it.

use std::collections::{BTreeMap, BTreeSet};

use super::analysis::Command;
use super::deck::{Deck, Kind};
use super::layout::{self, Layouts};

/// By the number of a pause, counting from 0: the racks that are refilled there.
pub(super) type Refills = BTreeMap<usize, BTreeSet<String>>;

/// Where racks are refilled by a person. `parked` are those that begin without tips.
pub(super) fn refills(commands: &[Command], deck: &Deck, parked: &BTreeSet<String>) -> Refills {
    let mut out = Refills::new();
    // By place: the command that took its tip.
    let mut absent: BTreeMap<(String, String), usize> = BTreeMap::new();
    for (id, rack) in deck.labware.iter().filter(|(id, _)| parked.contains(*id)) {
        absent.extend(rack.order.iter().map(|well| ((id.clone(), well.clone()), 0)));
    }
    let mut layouts = Layouts::new();
    let mut asked: Vec<usize> = Vec::new();
    for (index, command) in commands.iter().enumerate() {
        let id = command.text("labwareId");
        match command.command_type.as_str() {
            "waitForResume" | "pause" if asks_for_tips(command.text("message")) => asked.push(index),
            "setTipState" => absent.retain(|(rack, _), _| rack != id),
            "configureNozzleLayout" => {
                let channels = deck.pipettes.get(command.text("pipetteId")).map_or(1, |m| m.pipette.channels);
                layout::take(&mut layouts, command, channels);
            }
            "pickUpTip" | "dropTip" => {
                let Some(rack) = deck.labware.get(id).filter(|rack| rack.kind == Kind::Tips) else { continue };
                let Some(mounted) = deck.pipettes.get(command.text("pipetteId")) else { continue };
                let well = command.text("wellName");
                let reached = match layouts.get(command.text("pipetteId")) {
                    Some(Some(layout)) => {
                        let place = deck.reached_by(layout, rack, well);
                        place.map(|place| deck.wells_of(&place)).unwrap_or_default()
                    }
                    _ => rack.row(mounted.pipette.channels, well).into_iter().flatten().map(str::to_owned).collect(),
                };
                let places: Vec<_> = reached.into_iter().map(|well| (id.to_owned(), well)).collect();
                if command.command_type == "dropTip" {
                    absent.retain(|place, _| !places.contains(place));
                    continue;
                }
                // The last pause that asks for tips since then.
                let gone = places.iter().filter_map(|place| absent.get(place)).max();
                if let Some(pause) = gone.and_then(|gone| asked.iter().rev().find(|pause| *pause > gone)) {
                    out.entry(*pause).or_default().insert(id.to_owned());
                    absent.retain(|(rack, _), taken| rack != id || *taken > *pause);
                }
                absent.extend(places.into_iter().map(|place| (place, index)));
            }
            _ => {}
        }
    }
    out
}

/// Whether a message speaks of tips.
fn asks_for_tips(message: &str) -> bool {
    let words = message.split(|c: char| !c.is_ascii_alphanumeric());
    words.map(str::to_ascii_lowercase).any(|word| ["tip", "tips", "tiprack", "tipracks"].contains(&word.as_str()))
}
