//! Hazards that steps side by side bring about together: a job has set a plate hot, and a closed vial is put on it meanwhile.

use std::collections::{BTreeMap, BTreeSet};

use std::convert::Infallible;

use matterix_ir::model::Action;
use matterix_ir::plan::{Step, StepId};
use matterix_ir::{Diagnostic, Severity};

use super::super::Interpreter;
use super::super::state::AbstractState;
use super::super::value::{AbstractValue, Imprecision};
use super::Lines;
use crate::elaborate::hazards::{Hazard, Watched};

/// Hazards that are looked for in the order of time, and those that are there now, by index.
#[derive(Default)]
pub(in crate::check::flow) struct Dangers<'l> {
    pub(super) looked_for: Vec<&'l Hazard>,
    pub(super) present: BTreeSet<usize>,
}

impl<'l> Interpreter<'l, '_> {
    /// The hazards on which steps side by side work from both sides, and which some of what they set may bring about.
    pub(super) fn dangers_between(
        &mut self,
        pairs: &[(StepId, Vec<StepId>)],
        hazards: &'l [Hazard],
    ) -> Vec<&'l Hazard> {
        let mut watched: Vec<&Hazard> =
            hazards.iter().filter(|h| h.watched == Watched::Steps && !h.states.is_empty()).collect();
        let asked: BTreeSet<u32> = watched.iter().flat_map(|h| &h.states).copied().collect();
        let mut between: Vec<[BTreeSet<u32>; 2]> = Vec::new();
        for (own, others) in pairs.iter().filter(|_| !asked.is_empty()) {
            let own: BTreeSet<u32> = self.writes(*own).intersection(&asked).copied().collect();
            if !own.is_empty() {
                let others = others.iter().flat_map(|other| self.writes(*other));
                between.push([own, others.filter(|s| asked.contains(s)).collect()]);
            }
        }
        let from_both = |h: &&Hazard| {
            between.iter().any(|sides| sides.iter().all(|side| h.states.iter().any(|state| side.contains(state))))
        };
        watched.retain(from_both);
        if watched.is_empty() {
            return watched;
        }
        let facts = self.with_all_set();
        watched.retain(|h| self.eval(h.when, &facts).truth() != Some(false));
        watched
    }

    /// What is known at any time: states are as at the start, or as some step sets them.
    fn with_all_set(&mut self) -> AbstractState {
        let plan = self.plan;
        let begun = self.start();
        let mut values: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for step in &plan.steps {
            let Step::Operation(operation) = &step.step else { continue };
            for action in operation.at_start.iter().chain(&operation.at_end) {
                let Action::Assign { state, value, .. } = action else { continue };
                let constant = self.parts(*value).states.is_empty();
                let value = self.eval(*value, &begun).exact().filter(|_| constant);
                values.entry(*state).or_default().push(value.unwrap_or(f64::NAN));
            }
        }
        let written = self.writes(plan.root);
        let mut changed = self.behind(&written);
        changed.extend(self.derivatives.iter().map(|d| d.state));
        changed.extend(self.events.iter().flat_map(|event| self.changed_by(&event.actions)));
        let mut facts = begun.clone();
        facts.time = AbstractValue::top();
        for state in changed {
            facts.states[state as usize] = match (values.remove(&state), begun.states[state as usize].exact()) {
                (Some(mut all), Some(first)) if written.contains(&state) => {
                    all.push(first);
                    AbstractValue::of(all, Imprecision::Unknown)
                }
                _ => AbstractValue::top(),
            };
        }
        facts
    }

    /// Reports the hazards that the step which is followed now has brought about.
    pub(super) fn judge_dangers(&mut self, lines: &mut Lines<'l>) {
        for (index, hazard) in self.dangers.looked_for.clone().into_iter().enumerate() {
            if self.eval(hazard.when, &lines.facts).truth() != Some(true) {
                self.dangers.present.remove(&index);
            } else if self.dangers.present.insert(index) && !self.sites.is_empty() {
                let d = self.danger(hazard, &lines.facts);
                self.tell_in_time(d, hazard.span, lines.loose);
            }
        }
    }

    fn danger(&mut self, hazard: &Hazard, facts: &AbstractState) -> Diagnostic {
        let is_so = |said: &&matterix_ir::Said| self.eval(said.node, facts).truth() == Some(true);
        let said = hazard.said.iter().find(is_so);
        let lab = self.lab;
        let instance = |at: f64| lab.instances.get(at as usize).map_or("nothing", |i| i.name.as_str()).to_string();
        let words = said.and_then(|said| {
            let value = |node| Ok::<_, Infallible>(self.eval(node, facts).exact());
            said.text.show(value, instance).ok()
        });
        let headline = words.unwrap_or_else(|| hazard.headline());
        let mut d = Diagnostic::error(hazard.code(), self.site(), headline, "this step causes it");
        d.severity = if hazard.grave { Severity::Error } else { Severity::Warning };
        for term in &hazard.terms {
            for (span, text) in self.history(term, facts) {
                if d.labels.iter().all(|l| l.span != span) {
                    d = d.because(span, text);
                }
            }
        }
        d.help.extend(hazard.help.clone());
        d
    }
}
