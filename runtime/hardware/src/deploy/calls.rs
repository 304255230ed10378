//! Calls that a device could not be told, found once its line is open and before anything is said.

use matterix_ir::graph::Env;
use matterix_ir::plan::Step;
use matterix_ir::wire::{Driver, Exchange, Template};
use matterix_ir::{Diagnostic, NodeId, Op, Span, codes};

use super::device::Device;
use super::hardware::Hardware;
use super::preflight::{asked_for, carrier, reachable};
use crate::link::Line;
use crate::template;

impl Hardware<'_, '_> {
    /// Findings about what is known by now of what drivers say and ask in the course of the plan, where their devices do not take it.
    pub(super) fn untellable(&self) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        for (id, step) in reachable(&self.program.plan) {
            let Step::Operation(operation) = step else { continue };
            let carrier = carrier(id, operation, &self.devices);
            let Some((device, driver, link)) = carrier.and_then(|index| self.spoken_to(index)) else { continue };
            let node = self.program.plan.get(id);
            let wrong = driver.call(id).into_iter().flat_map(|exchange| self.refused(exchange, link));
            found.extend(wrong.map(|why| {
                finding(node.span, &format!("`{}` cannot be sent to `{}`: {why}", node.label, device.name))
            }));
        }
        let asked = asked_for(self.program, &self.observed);
        for (device, driver, link) in (0..self.devices.len()).filter_map(|index| self.spoken_to(index)) {
            let cannot =
                |what: &str, why: &str| format!("the driver `{}` cannot {what} `{}`: {why}", driver.name, device.name);
            for exchange in driver.said_apart() {
                let wrong = self.refused(exchange, link);
                found.extend(wrong.into_iter().map(|why| finding(exchange.span, &cannot("talk to", &why))));
            }
            for told in driver.told.iter().filter(|told| asked.contains(&told.value)) {
                let wrong = self.known(&told.asks).and_then(|text| link.judge_question(&text).err());
                found.extend(wrong.map(|why| finding(told.span, &cannot("ask", &why))));
            }
        }
        found
    }

    /// A device with its driver and the line that is open to it.
    fn spoken_to(&self, index: usize) -> Option<(&Device<'_>, &Driver, &dyn Line)> {
        let link = self.devices[self.line_of(index)].link.as_deref()?;
        Some((&self.devices[index], self.devices[index].driver?, link))
    }

    /// Why a device does not take what is said to it.
    fn refused(&self, exchange: &Exchange, link: &dyn Line) -> Vec<String> {
        let known = exchange.sends.iter().filter_map(|template| self.known(template));
        known.filter_map(|text| link.judge(&text).err()).collect()
    }

    /// A text that is known already; others are judged when they are said.
    fn known(&self, template: &Template) -> Option<String> {
        template::filled(template, |node| self.constant(node)).ok()
    }

    /// A value that stays what it is, SI.
    fn constant(&self, node: NodeId) -> Option<f64> {
        let model = &self.program.model;
        let changes = |op: Op| matches!(op, Op::Time | Op::State(_) | Op::Local(_) | Op::Reading(_));
        if model.graph.schedule([node]).into_iter().any(|n| changes(model.graph.op(n))) {
            return None;
        }
        let params: Vec<f64> = model.params.iter().map(|p| p.value).collect();
        let nothing: &[f64] = &[];
        let env = Env { time: 0.0, states: nothing, params: &params, locals: nothing, readings: nothing };
        Some(model.graph.eval(node, env))
    }
}

fn finding(span: Span, headline: &str) -> Diagnostic {
    Diagnostic::error(codes::UNSENDABLE, span, headline, "the device does not accept this")
        .help("nothing was sent to any device")
}
