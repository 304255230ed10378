//! Liquids that are there at first.

use std::collections::BTreeMap;

use matterix_ir::scene::InstanceId;
use serde_json::{Map, Value, json};

use super::protocol::Command;
use super::writer::Writer;

impl Writer<'_, '_> {
    /// Liquids that were there at first: one entry for all wells of a labware that hold the same.
    pub(super) fn gather_liquids(&mut self) {
        let program = self.protocol.subject.program;
        let mut held: BTreeMap<InstanceId, String> = BTreeMap::new();
        for holding in &program.inventory.holdings {
            let mixture = program.model.mixtures.get(holding.mixture as usize).map(|m| m.instance);
            let Some(well) = mixture.and_then(|m| program.scene.get(m).owner) else { continue };
            let name = held.entry(well).or_default();
            if !name.is_empty() {
                name.push_str(" + ");
            }
            name.push_str(&holding.substance);
        }
        let loads = std::mem::take(&mut self.protocol.loads);
        let (wells, mut rest): (Vec<Command>, Vec<Command>) = loads.into_iter().partition(|c| c.name == "loadLiquid");
        let mut places: BTreeMap<(String, String), String> = BTreeMap::new();
        for (well, name) in held {
            places.extend(self.deck.well(well).map(|place| (place, name)));
        }
        let mut gathered: Vec<Command> = Vec::new();
        for well in wells {
            let place = (well.text("labwareId").to_owned(), well.text("wellName").to_owned());
            let Some(liquid) = places.get(&place) else { continue };
            let id = self.liquid(liquid);
            let volume = well.params.get("volume").cloned().unwrap_or_default();
            let known = gathered.iter_mut().find(|c| c.text("labwareId") == place.0 && c.text("liquidId") == id);
            match known.and_then(|c| c.params.get_mut("volumeByWell")) {
                Some(Value::Object(volumes)) => drop(volumes.insert(place.1, volume)),
                _ => {
                    let volumes = Map::from_iter([(place.1, volume)]);
                    let params = json!({ "liquidId": id, "labwareId": place.0, "volumeByWell": volumes });
                    let Value::Object(params) = params else { continue };
                    gathered.push(Command { name: "loadLiquid", params, at: well.at });
                }
            }
        }
        rest.extend(gathered);
        self.protocol.loads = rest;
    }

    /// The identifier of a liquid.
    fn liquid(&mut self, name: &str) -> String {
        if let Some((id, _)) = self.protocol.liquids.iter().find(|(_, n)| n == name) {
            return id.clone();
        }
        let id = format!("liquid_{}", self.protocol.liquids.len() + 1);
        self.protocol.liquids.push((id.clone(), name.to_owned()));
        id
    }
}
