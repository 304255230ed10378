//! What is so where a condition does not hold, in the words that its text gives.

use std::convert::Infallible;

use matterix_ir::model::Domain;
use matterix_ir::plan::Condition;
use matterix_ir::{Said, TextPart, Unit};

use super::Interpreter;
use super::report::shown;
use super::state::AbstractState;

impl Interpreter<'_, '_> {
    /// What is so where a condition does not hold, in its own words; nothing where it has none.
    pub(super) fn worded(&mut self, condition: &Condition, facts: &AbstractState) -> Vec<String> {
        let all = condition.refusal.as_ref().map(|r| r.said.as_slice()).unwrap_or_default();
        let fails = all.iter().find(|said| self.eval(said.node, facts).truth() == Some(false));
        let open = fails.or_else(|| all.iter().find(|said| self.eval(said.node, facts).truth().is_none()));
        let Some(Said { text, .. }) = open else { return Vec::new() };
        let said = text.filled(|part, node| {
            let known = self.eval(node, facts);
            let text = match part {
                TextPart::Quantity { unit, digits, .. } => {
                    shown(&known, |v| unit.show(digits.map_or(v, |digits| rounded(unit, v, digits))))
                }
                TextPart::Bool(_) => self.show(&known, &Domain::Bool),
                TextPart::Word(_, words) => self.show(&known, &Domain::Enum(words.clone())),
                _ => self.show(&known, &Domain::Instance),
            };
            Ok::<_, Infallible>(text.replace('`', ""))
        });
        said.into_iter().collect()
    }
}

/// A value in SI that has so many digits after the point in a unit.
fn rounded(unit: &Unit, si: f64, digits: u8) -> f64 {
    let step = 10f64.powi(i32::from(digits));
    unit.to_si((unit.of_si(si) * step).round() / step)
}
