//! Where devices were when a journal was left, and where they are bound now. One that has moved is followed by its name; where nobody
//! can tell which of several is which, nothing is gone on with.

use std::collections::{BTreeMap, BTreeSet};

use matterix_runtime::backend::Backend;

use super::device::{Carrier, Device};
use super::hardware::Hardware;
use super::identity::Words;
use super::journal::Entry;

/// Where each device was last, by its name.
pub(super) fn places(entries: &[Entry]) -> BTreeMap<String, String> {
    let bound = entries.iter().filter_map(|entry| match entry {
        Entry::Bound { device, place, .. } => Some((device.clone(), place.clone())),
        _ => None,
    });
    bound.collect()
}

/// Where a device is bound, as it is written; none where it has no line of its own.
fn place(device: &Device<'_>) -> Option<String> {
    match &device.binding.carrier {
        Carrier::Line { place, .. } => Some(place.to_string()),
        Carrier::Shared { .. } | Carrier::Hand => None,
    }
}

/// Why nobody can tell which device is which, where some have moved since the journal was left. One that says who it is, as no other
/// one did, is asked once its line is open.
pub(super) fn mixed_up(before: &BTreeMap<String, String>, said: &Words, devices: &[Device<'_>]) -> Option<String> {
    // By the driver: the places that its devices have left.
    let mut left: BTreeMap<&str, BTreeMap<&str, &str>> = BTreeMap::new();
    for device in devices {
        let (Some(now), Some(then)) = (place(device), before.get(device.name)) else { continue };
        if now == *then || is_known(device, said) {
            continue;
        }
        let here: BTreeSet<&str> = before.iter().filter(|(_, at)| **at == now).map(|(name, _)| name.as_str()).collect();
        if let Some(other) = here.into_iter().find(|name| *name != device.name) {
            let name = device.name;
            return Some(format!("`{name}` is now bound to `{now}`, where `{other}` was when the journal stopped"));
        }
        let driver = device.driver.map_or("", |driver| driver.name.as_str());
        left.entry(driver).or_default().entry(then).or_insert(device.name);
    }
    let several = left.into_values().find(|places| places.len() > 1)?;
    let names = several.values().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" and ");
    Some(format!("{names} look alike and were all moved since the journal stopped"))
}

/// Whether a device said who it is, and no other one said the same.
fn is_known(device: &Device<'_>, said: &Words) -> bool {
    let words = device.driver.iter().flat_map(|driver| &driver.identity).flat_map(|identity| &identity.words);
    let own: Vec<(&str, Option<&String>)> =
        words.map(|word| (word.as_str(), said.get(&(device.name.to_owned(), word.clone())))).collect();
    own.iter().any(|(word, text)| {
        let others = said.iter().filter(|((name, of), _)| name != device.name && of == word);
        text.is_some() && others.into_iter().all(|(_, other)| Some(other) != *text)
    })
}

impl Hardware<'_, '_> {
    /// Notes where devices are bound, where that is not what was noted last.
    pub(super) fn note_places(&mut self) {
        let t = self.now();
        for device in &self.devices {
            let Some(place) = place(device) else { continue };
            if self.places.get(device.name) != Some(&place) {
                self.places.insert(device.name.to_owned(), place.clone());
                self.journal.note(&Entry::Bound { t, device: device.name.to_owned(), place });
            }
        }
    }
}
