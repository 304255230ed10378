//! Values that a plan depends on: what devices tell in place of what the twin supposes.

use std::collections::BTreeMap;

use matterix_ir::{NodeId, Op};
use matterix_runtime::backend::Backend;
use matterix_runtime::exec::Listener;
use matterix_runtime::fault::Fault;

use super::hardware::Hardware;
use super::journal::Entry;

impl Hardware<'_, '_> {
    /// What is told of a node now, asked once an instant.
    pub(super) fn told(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<f64, Fault> {
        let now = self.twin.now();
        if let Some((_, value)) = self.fresh.get(&node).filter(|(t, _)| *t == now) {
            return Ok(*value);
        }
        let (device, line) = self.observed.told[&node];
        let told = self.devices[device].driver.map(|d| &d.told[line]);
        let name = told.map(|t| t.name.clone()).unwrap_or_default();
        let next = self.next_entry();
        let now = self.twin.now();
        if let Some(fault) = self.replayed_fault() {
            return Err(fault);
        }
        let value = match next {
            Some(Entry::Told { t, name: before, value }) if before == name && t == now => {
                self.replay.pop_front();
                value
            }
            Some(other) => return Err(self.mismatch(&format!("the workflow needs `{name}`"), &other)),
            None => {
                self.go_live(out)?;
                let now = self.twin.now();
                let told = self.tell(device, line);
                let value = told.map_err(|fault| self.outward(fault))?;
                self.journal.note(&Entry::Told { t: now, name: name.clone(), value });
                self.compared(device, line, value).map_err(|fault| self.outward(fault))?;
                value
            }
        };
        if let (Op::Reading(r), Some(slot)) = (self.program.model.graph.op(node), told.and_then(|t| t.reading)) {
            out.reading(now, slot as usize, value);
            self.twin.give(r, value);
        }
        let now = self.twin.now();
        self.fresh.insert(node, (now, value));
        Ok(value)
    }

    /// The value of a node with what devices tell in place of what the twin supposes.
    pub(super) fn eval(&mut self, node: NodeId, out: &mut dyn Listener) -> Result<f64, Fault> {
        let (asked, _) = self.observed.asks(&self.program.model, node);
        self.eval_by(node, asked.into_iter().map(|told| (told, told)), out)
    }

    /// The same with what devices tell of some nodes: each with the node that is told.
    pub(super) fn eval_by(
        &mut self,
        node: NodeId,
        tellers: impl IntoIterator<Item = (NodeId, NodeId)>,
        out: &mut dyn Listener,
    ) -> Result<f64, Fault> {
        let mut values: BTreeMap<NodeId, f64> = BTreeMap::new();
        for (node, teller) in tellers {
            values.insert(node, self.told(teller, out)?);
        }
        if values.is_empty() {
            return Ok(self.twin.value(node, out)?.unwrap_or(f64::NAN));
        }
        Ok(self.with_told(node, values))
    }

    /// The value of a node with these in place of what the twin supposes.
    fn with_told(&mut self, node: NodeId, mut values: BTreeMap<NodeId, f64>) -> f64 {
        let graph = &self.program.model.graph;
        let engine = self.twin.engine();
        for n in graph.schedule([node]) {
            if values.contains_key(&n) {
                continue;
            }
            let op = graph.op(n);
            let at = |o: NodeId| values.get(&o).copied().unwrap_or(f64::NAN);
            let value = match op {
                Op::Solved(call, _) => graph.call(call).value(at),
                op if op.operands().next().is_none() => engine.eval(n),
                op => matterix_ir::graph::apply(op, |_| f64::NAN, at),
            };
            values.insert(n, value);
        }
        values.get(&node).copied().unwrap_or(f64::NAN)
    }
}
