//! The units in which the user wrote quantities: what is known is shown in them.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use matterix_ir::plan::{Argument, Condition, Plan, Step};
use matterix_ir::{Sources, Span, Unit};

use crate::eval::lab::Elaborator;

/// Units by symbol, as written by the user.
pub struct Written {
    units: BTreeMap<String, Unit>,
    /// What a quantity declared in a unit may be shown in, by its symbol: the same few are asked for at every statement.
    choices: RefCell<BTreeMap<String, Rc<Choice>>>,
}

/// What a quantity may be shown in.
#[derive(Default)]
struct Choice {
    /// Units that were written for such quantities, by symbol.
    written: Vec<Unit>,
    /// Those that differ from the declared one by a prefix.
    prefixed: Vec<Unit>,
}

impl Written {
    /// The units of the workflow's arguments and conditions and of the lab's contents and parameters.
    pub fn of(lab: &Elaborator<'_>, sources: &Sources, plan: &Plan) -> Self {
        let own = |span: Span| sources.get(span.file).is_some_and(|f| !f.name.contains("::"));
        let mut units: Vec<Unit> = lab.held.iter().filter_map(|h| h.quantity.unit.as_deref().cloned()).collect();
        units.extend(lab.params.iter().filter(|p| own(p.span)).map(|p| p.unit.clone()));
        for step in plan.steps.iter().filter(|s| own(s.span)) {
            let compared = |c: &Condition| c.compared.iter().map(|c| c.unit.clone()).collect::<Vec<_>>();
            match &step.step {
                Step::Operation(o) => units.extend(o.arguments.iter().filter_map(|(_, a)| match a {
                    Argument::Quantity(_, unit) => Some(unit.clone()),
                    _ => None,
                })),
                Step::WaitUntil { condition, .. }
                | Step::If { condition, .. }
                | Step::RepeatWhile { condition, .. } => {
                    units.extend(compared(condition));
                }
                Step::Expect(conditions) => units.extend(conditions.iter().flat_map(compared)),
                _ => {}
            }
        }
        let units = units.into_iter().map(|u| (u.symbol.clone(), u)).collect();
        Written { units, choices: RefCell::default() }
    }

    /// The largest of the written units of the same dimension in which a magnitude, SI, is not less than one. Where none
    /// was written or none fits well, a prefix is chosen.
    pub fn best(&self, lab: &Elaborator<'_>, unit: &Unit, magnitude: f64) -> Unit {
        let choice = self.choice(lab, unit);
        if unit.offset != 0.0 {
            return choice.written.first().unwrap_or(unit).clone();
        }
        if magnitude == 0.0 {
            let used = choice.written.iter().any(|w| w.symbol == unit.symbol);
            return choice.written.first().filter(|_| !used).unwrap_or(unit).clone();
        }
        let reads_well = |u: &Unit| WELL.contains(&(magnitude / u.factor));
        largest(&choice.written, magnitude)
            .filter(|u| reads_well(u))
            .or_else(|| largest(&choice.prefixed, magnitude))
            .unwrap_or(unit)
            .clone()
    }

    fn choice(&self, lab: &Elaborator<'_>, unit: &Unit) -> Rc<Choice> {
        if let Some(known) = self.choices.borrow().get(&unit.symbol) {
            return known.clone();
        }
        let choice = Rc::new(match lab.tables.unit(&unit.symbol) {
            Ok(wanted) => {
                let same = |u: &&Unit| {
                    (u.offset == 0.0) == (unit.offset == 0.0)
                        && lab.tables.unit(&u.symbol).is_ok_and(|r| r.dimension == wanted.dimension)
                };
                let written = self.units.values().filter(same).cloned().collect();
                Choice { written, prefixed: lab.tables.units.prefixed(&wanted) }
            }
            Err(_) => Choice::default(),
        });
        self.choices.borrow_mut().insert(unit.symbol.clone(), choice.clone());
        choice
    }
}

/// Numbers that read well in a unit somebody chose.
const WELL: std::ops::Range<f64> = 0.01..1e5;

/// The largest unit in which a magnitude is not less than one, or the smallest; of equal ones the last, or the first.
fn largest(units: &[Unit], magnitude: f64) -> Option<&Unit> {
    // What is a whole number but for rounding is one.
    let fits = units.iter().filter(|u| magnitude >= u.factor * (1.0 - 1e-9));
    let smallest = || units.iter().min_by(|a, b| a.factor.total_cmp(&b.factor));
    fits.max_by(|a, b| a.factor.total_cmp(&b.factor)).or_else(smallest)
}
