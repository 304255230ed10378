//! Which one of its kind a device is: asked before anything else is said, held against the bindings and the journal.

use std::collections::BTreeMap;

use matterix_ir::Span;
use matterix_ir::wire::Identity;
use matterix_runtime::fault::Fault;

use super::hardware::Hardware;
use super::journal::Entry;
use crate::link::DeviceError;

/// What each device said first under each of its words, by the name of the device and the word.
pub(super) type Words = BTreeMap<(String, String), String>;

/// What devices said first that is kept, after a journal.
pub(super) fn first_said(entries: &[Entry]) -> Words {
    let mut first = Words::new();
    for entry in entries {
        if let Entry::Kept { device, word, text, .. } = entry {
            first.entry((device.clone(), word.clone())).or_insert_with(|| text.clone());
        }
    }
    first
}

impl Hardware<'_, '_> {
    /// Asks all devices who they are; the first that is another one or does not say, with where it is bound.
    pub(super) fn identify(&mut self) -> Result<(), (usize, DeviceError, Span)> {
        for device in 0..self.devices.len() {
            self.same(device)?;
        }
        Ok(())
    }

    /// Asks a device who it is, unless it has said so over the line that is open: whoever opens a line anew may find another device
    /// behind it.
    pub(super) fn same(&mut self, device: usize) -> Result<(), (usize, DeviceError, Span)> {
        let Some(driver) = self.devices[device].driver.filter(|_| !self.devices[device].known) else { return Ok(()) };
        let mut said = Vec::new();
        for identity in &driver.identity {
            let at = identity.exchange.span;
            said.extend(self.who_is(device, identity).map_err(|trouble| (device, trouble, at))?);
        }
        self.judge(device, &said).map_err(|trouble| (device, trouble, driver.span))?;
        let name = self.devices[device].name;
        for (word, text) in said {
            self.said_first.entry((name.to_owned(), word)).or_insert(text);
        }
        self.devices[device].known = true;
        Ok(())
    }

    /// The same of all devices behind a line.
    pub(super) fn same_behind(&mut self, line: usize) -> Result<(), (usize, DeviceError, Span)> {
        self.behind(line).into_iter().try_for_each(|device| self.same(device))
    }

    /// What a device answers to one question who it is: words and texts.
    fn who_is(&mut self, device: usize, identity: &Identity) -> Result<Vec<(String, String)>, DeviceError> {
        let Identity { exchange, words } = identity;
        let texts = self.texts(&exchange.sends).map_err(|fault| DeviceError::Unsaid(fault.message))?;
        if !self.speaks() {
            return self.try_say(device, &texts, None).map(|_| Vec::new());
        }
        self.inquire(device, |link, driver, ear| link.say(&texts, exchange.expects.as_ref(), driver, ear))?;
        let (line, instance) = (self.line_of(device), self.devices[device].binding.instance);
        let link = self.devices[line].link.as_deref();
        let text = |word: &String| Some((word.clone(), link?.word(instance, word)?));
        Ok(words.iter().filter_map(text).collect())
    }

    /// Whether a device that says this is the one that is meant.
    fn judge(&mut self, device: usize, said: &[(String, String)]) -> Result<(), DeviceError> {
        if said.is_empty() {
            return Ok(());
        }
        let of = &self.devices[device];
        let is = joined(said.iter().map(|(_, text)| text.as_str()));
        if let Some(bound) = of.binding.identity.as_ref().filter(|bound| **bound != is) {
            return Err(DeviceError::Mistaken(format!("it identifies as `{is}`, but `{bound}` is bound here")));
        }
        let before = |word: &String| self.said_first.get(&(of.name.to_owned(), word.clone())).map(String::as_str);
        let earlier: Option<Vec<&str>> = said.iter().map(|(word, _)| before(word)).collect();
        match earlier.map(|texts| joined(texts.into_iter())) {
            Some(was) if was != is => {
                Err(DeviceError::Mistaken(format!("it identifies as `{is}`, but `{was}` was there before")))
            }
            _ => Ok(()),
        }
    }

    /// Devices that a journal is gone on with are those that it was kept of.
    pub(super) fn are_the_same(&mut self) -> Result<(), Fault> {
        let Err((device, trouble, at)) = self.identify() else { return Ok(()) };
        if matches!(trouble, DeviceError::Lost(_) | DeviceError::Silent(_) | DeviceError::Mistaken(_)) {
            let index = self.line_of(device);
            let place = if matches!(trouble, DeviceError::Mistaken(_)) { device } else { index };
            self.unreached = Some(self.not_reached(place, trouble.clone()));
        }
        Err(self.trouble(device, &trouble, at))
    }
}

fn joined<'t>(texts: impl Iterator<Item = &'t str>) -> String {
    texts.collect::<Vec<_>>().join(" ")
}
