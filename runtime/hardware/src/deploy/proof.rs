//! Whether a device that was told what makes it safe is: that it hears, and what it tells of itself.

use std::collections::BTreeMap;
use std::time::Duration;

use matterix_ir::wire::{Driver, Framing};
use matterix_ir::{NodeId, Op};

use super::hardware::Hardware;
use super::safe::POLL;
use crate::link::DeviceError;

/// Longest time until a device tells that it has come to rest.
const AT_REST: Duration = Duration::from_secs(10);

impl Hardware<'_, '_> {
    /// Nothing answered what makes the device safe: it is asked for anything that it tells, to know that it hears.
    pub(super) fn prove(&mut self, index: usize, driver: &Driver) -> Result<(), DeviceError> {
        if driver.framing == Framing::Calls
            || self.devices[index].codec.as_ref().is_some_and(|codec| codec.acknowledges())
        {
            return Ok(());
        }
        let applies = driver.told.iter().find(|told| match told.condition {
            Some(condition) => self.twin.engine().eval(condition) != 0.0,
            None => true,
        });
        let Some(told) = applies else {
            let why = "nothing that it answers says that it heard what makes it safe".to_owned();
            return Err(DeviceError::Silent(why));
        };
        let text = self.sayable(std::slice::from_ref(&told.asks))?.concat();
        let line = driver.told.iter().position(|t| std::ptr::eq(t, told)).unwrap_or_default();
        let asked = self.over(index, |link, driver, ear| match told.heard {
            Some(_) => link.hear(line, driver, ear),
            None => link.ask(&text, told, driver, ear),
        });
        match asked {
            Ok(_) | Err(DeviceError::Refused { .. }) => Ok(()),
            Err(other) => Err(other),
        }
    }

    /// What should hold at the end of a plan holds of a device by what it tells of itself: one that took what makes it safe may go on
    /// all the same, as under local control.
    pub(super) fn has_ended(&mut self, index: usize) -> Result<(), DeviceError> {
        let program = self.program;
        let instance = self.devices[index].binding.instance;
        let begun = self.settings.world.elapsed();
        for end in program.plan.ends.iter().filter(|end| end.instance == instance) {
            let Some(told) = self.tells(index, end.condition.node) else { continue };
            loop {
                let trouble = match self.holds_by(index, end.condition.node, &told) {
                    Ok(true) => break,
                    Ok(false) => {
                        let how = end.condition.failure().replace('_', " ");
                        let text = format!("it took what makes it safe, and still is {how} by what it tells");
                        DeviceError::Refused { failure: end.condition.failure().to_owned(), text }
                    }
                    Err(trouble @ (DeviceError::Refused { .. } | DeviceError::Garbled(_))) => trouble,
                    Err(trouble) => return Err(trouble),
                };
                if self.settings.world.elapsed().saturating_sub(begun) >= AT_REST {
                    return Err(trouble);
                }
                self.settings.world.sleep(POLL);
            }
        }
        Ok(())
    }

    /// The lines of its driver by which a device tells all that a condition depends on; none where it does not, or not now.
    fn tells(&self, index: usize, condition: NodeId) -> Option<Vec<(NodeId, usize)>> {
        let model = &self.program.model;
        if !self.observed.is_settled(model, condition) {
            return None;
        }
        let (nodes, _) = self.observed.asks(model, condition);
        let covers = |op: Op| matches!(op, Op::State(_) | Op::Local(_));
        let mut rest = vec![condition];
        while let Some(node) = rest.pop() {
            match model.graph.op(node) {
                _ if nodes.contains(&node) => {}
                op if covers(op) => return None,
                op => rest.extend(op.operands()),
            }
        }
        let line = |node: NodeId| match self.observed.told.get(&node) {
            Some((device, line)) if *device == index => Some((node, *line)),
            _ => None,
        };
        nodes.into_iter().map(line).collect::<Option<Vec<_>>>().filter(|lines| !lines.is_empty())
    }

    /// Whether a condition holds by what a device tells now.
    fn holds_by(&mut self, index: usize, condition: NodeId, told: &[(NodeId, usize)]) -> Result<bool, DeviceError> {
        let Some(driver) = self.devices[index].driver else { return Ok(true) };
        let mut values = BTreeMap::new();
        for (node, line) in told {
            let told = &driver.told[*line];
            if told.condition.is_some_and(|c| self.twin.engine().eval(c) == 0.0) {
                return Ok(true);
            }
            let text = self.sayable(std::slice::from_ref(&told.asks))?.concat();
            let asked = self.over(index, |link, driver, ear| match told.heard {
                Some(_) => link.hear(*line, driver, ear),
                None => link.ask(&text, told, driver, ear),
            });
            values.insert(*node, asked?);
        }
        Ok(self.with_told(condition, values) != 0.0)
    }
}
