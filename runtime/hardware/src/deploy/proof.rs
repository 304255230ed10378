//! Whether a device that was told what makes it safe is: that it hears, and what it tells of itself.

use std::collections::BTreeMap;
use std::time::Duration;

use matterix_ir::graph::BinaryOp;
use matterix_ir::wire::{Driver, Framing, Told};
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
        let Some(line) = driver.told.iter().position(|told| self.applies(told)) else {
            let why = "none of its replies confirms the `safe` command".to_owned();
            return Err(DeviceError::Silent(why));
        };
        match self.tell_once(index, line, &driver.told[line]) {
            Ok(_) | Err(DeviceError::Refused { .. }) => Ok(()),
            Err(other) => Err(other),
        }
    }

    /// What a line of its driver tells, SI, asked for once.
    fn tell_once(&mut self, index: usize, line: usize, told: &Told) -> Result<f64, DeviceError> {
        let text = self.sayable(std::slice::from_ref(&told.asks))?.concat();
        self.over(index, |link, driver, ear| link.tell(line, &text, told, driver, ear))
    }

    /// What should hold at the end of a plan holds of a device by what it tells of itself, as far as that decides it: one that took what
    /// makes it safe may go on all the same, as under local control.
    pub(super) fn has_ended(&mut self, index: usize) -> Result<(), DeviceError> {
        let program = self.program;
        let instance = self.devices[index].binding.instance;
        let begun = self.settings.world.elapsed();
        for end in program.plan.ends.iter().filter(|end| end.instance == instance) {
            let told = self.tells(index, end.condition.node);
            loop {
                let trouble = match self.decided_by(index, end.condition.node, &told) {
                    Ok(None | Some(true)) => break,
                    Ok(Some(false)) => {
                        let how = end.condition.failure().replace('_', " ");
                        let text = format!("it accepted the `safe` command, but still reports that it is {how}");
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

    /// The lines of its driver by which a device tells what a condition depends on, where it does so now.
    fn tells(&mut self, index: usize, condition: NodeId) -> Vec<(NodeId, usize)> {
        let Some(driver) = self.devices[index].driver else { return Vec::new() };
        let shown = self.observed.shows(&self.program.model, condition);
        let told: Vec<_> = shown.into_iter().map(|(node, teller)| (node, self.observed.told[&teller])).collect();
        let of_this =
            told.into_iter().filter(|(_, (device, _))| *device == index).map(|(node, (_, line))| (node, line));
        of_this.filter(|(_, line)| self.applies(&driver.told[*line])).collect()
    }

    /// Whether a condition holds by what a device tells now; nothing where that does not decide it.
    fn decided_by(
        &mut self,
        index: usize,
        condition: NodeId,
        told: &[(NodeId, usize)],
    ) -> Result<Option<bool>, DeviceError> {
        let Some(driver) = self.devices[index].driver else { return Ok(None) };
        let mut values = BTreeMap::new();
        for (node, line) in told {
            values.insert(*node, Some(self.tell_once(index, *line, &driver.told[*line])?));
        }
        Ok(self.decided(condition, &mut values).map(|value| value != 0.0))
    }

    /// A value as far as these and what never changes decide it: a part that is false decides an `and`, whatever the others are.
    fn decided(&mut self, node: NodeId, values: &mut BTreeMap<NodeId, Option<f64>>) -> Option<f64> {
        let graph = &self.program.model.graph;
        for n in graph.schedule([node]) {
            if values.contains_key(&n) {
                continue;
            }
            let op = graph.op(n);
            let known = |o: NodeId| values.get(&o).copied().flatten();
            let value = match op {
                Op::State(_) | Op::Local(_) | Op::Reading(_) | Op::Time => None,
                Op::Binary(BinaryOp::And, a, b) if known(a) == Some(0.0) || known(b) == Some(0.0) => Some(0.0),
                Op::Binary(BinaryOp::Or, a, b) if [a, b].into_iter().any(|o| known(o).is_some_and(|v| v != 0.0)) => {
                    Some(1.0)
                }
                op if op.operands().next().is_none() => Some(self.twin.engine().eval(n)),
                op if op.operands().all(|o| known(o).is_some()) => {
                    Some(matterix_ir::graph::apply(op, |_| f64::NAN, |o| known(o).unwrap_or(f64::NAN)))
                }
                _ => None,
            };
            values.insert(n, value);
        }
        values.get(&node).copied().flatten()
    }
}
