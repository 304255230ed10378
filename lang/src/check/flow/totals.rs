//! Bounds by what is there in all: what bodies exchange among themselves leaves its sum as it is, so that none can gain more
//! than comes in from outside, such as the power of a heater times the time, and what the others give off.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use super::Interpreter;
use super::fluxes::Flux;
use super::polytope::scaled;
use super::state::{AbstractState, same_history};
use super::value::{AbstractValue, Imprecision};

/// A sum of coefficients below this share of its terms is zero.
const CANCELS: f64 = 1e-12;

/// By this share of what is there bounds are moved outwards, for what rounding may have taken.
const OUTWARDS: f64 = 1e-9;

/// A rate as a sum; none where it has too many terms.
pub(super) type Terms = Option<Rc<BTreeMap<Flux, f64>>>;

/// States that exchange something, each with its derivative's terms.
type Group = Vec<(u32, Rc<BTreeMap<Flux, f64>>)>;

impl Interpreter<'_, '_> {
    /// Brings in what is known after at most `longest` s by the sums of what moves. Not where an event has changed something
    /// meanwhile.
    pub(super) fn by_totals(&mut self, longest: f64, before: &AbstractState, facts: &mut AbstractState) {
        let untouched = same_history(&before.history, &facts.history);
        if !longest.is_finite() || !untouched {
            return;
        }
        for group in self.groups(facts) {
            let mut sums: BTreeMap<&Flux, (f64, f64)> = BTreeMap::new();
            for (flux, c) in group.iter().flat_map(|(_, terms)| terms.iter()) {
                let (sum, size) = sums.entry(flux).or_default();
                (*sum, *size) = (*sum + c, size.max(c.abs()));
            }
            let (mut slowest, mut fastest) = (0.0, 0.0);
            for (flux, (sum, _)) in sums.into_iter().filter(|(_, (sum, size))| sum.abs() > CANCELS * size) {
                let bounds = self.flux(flux, facts);
                let (low, high) = scaled(sum, bounds);
                (slowest, fastest) = (slowest + low, fastest + high);
            }
            let states: Vec<u32> = group.iter().map(|(state, _)| *state).collect();
            bound_by(&states, scaled(longest, (slowest.min(0.0), fastest.max(0.0))), before, facts);
        }
    }

    /// Extensive states other than amounts that exchange something now.
    fn groups(&mut self, facts: &AbstractState) -> Vec<Group> {
        let scalars: BTreeSet<u32> = self.lab.extensive.iter().filter(|(k, _)| !k.matter).map(|(_, s)| *s).collect();
        let stoichiometry = self.stoichiometry();
        let mut rows: Group = Vec::new();
        for i in &facts.moving {
            let derivative = &self.derivatives[*i as usize];
            if !scalars.contains(&derivative.state) {
                continue;
            }
            let Some(terms) = self.terms_of(*i) else { continue };
            // What changes matter is counted by its extents.
            let matter = stoichiometry.rows.get(*i as usize).cloned().flatten();
            let counted = |flux: &Flux| {
                matter.iter().flat_map(|row| &row.fluxes).any(|(at, _)| stoichiometry.fluxes[*at] == *flux)
            };
            let mut live = BTreeMap::new();
            for (flux, c) in terms.iter().filter(|(flux, _)| !counted(flux)) {
                if self.may_go(flux, facts) {
                    live.insert(flux.clone(), *c);
                }
            }
            rows.push((derivative.state, Rc::new(live)));
        }
        let mut out: Vec<Group> = Vec::new();
        for row in rows {
            let exchanges = |group: &Group| {
                let against = |(flux, c): (&Flux, &f64)| {
                    group.iter().any(|(_, terms)| terms.get(flux).is_some_and(|other| other * c < 0.0))
                };
                row.1.iter().any(against)
            };
            let (mut joined, apart): (Vec<Group>, Vec<Group>) = out.into_iter().partition(exchanges);
            joined.push(vec![row]);
            out = apart;
            out.push(joined.into_iter().flatten().collect());
        }
        out
    }

    fn terms_of(&mut self, derivative: u32) -> Terms {
        if let Some(known) = self.nodes.terms.get(&derivative) {
            return known.clone();
        }
        let found = self.terms(self.derivatives[derivative as usize].rate).map(Rc::new);
        self.nodes.terms.insert(derivative, found.clone());
        found
    }
}

/// Bounds states by what their sum can be after it has changed by `more`.
fn bound_by(states: &[u32], more: (f64, f64), before: &AbstractState, facts: &mut AbstractState) {
    let apart = |state: u32, facts: &AbstractState| {
        let bond = facts.bonds.as_ref().and_then(|bonds| bonds.states.get(&state));
        bond.map_or_else(|| facts.states[state as usize].bounds(), |bond| bond.base.bounds())
    };
    let sum = |facts: &AbstractState| {
        states.iter().map(|s| apart(*s, facts)).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d))
    };
    // What extents bring is known only of states that hang together before and after.
    if states.iter().any(|s| before.hangs(*s) != facts.hangs(*s) && added(*s, before) != (0.0, 0.0)) {
        return;
    }
    let (least, most) = sum(before);
    let slack = OUTWARDS * least.abs().max(most.abs());
    let (least, most) = (least + more.0 - slack, most + more.1 + slack);
    for state in states {
        let others = states.iter().filter(|s| *s != state).map(|s| apart(*s, facts));
        let (low, high) = others.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        let (down, up) = added(*state, facts);
        let (low, high) = (least - high + down, most - low + up);
        let (from, to) = facts.states[*state as usize].bounds();
        let (low, high) = (low.max(from), high.min(to));
        if low <= high && (low > from || high < to) {
            facts.narrow(*state, AbstractValue::Range(low, high, Imprecision::Unknown));
        }
    }
}

/// What extents have added to a state.
fn added(state: u32, facts: &AbstractState) -> (f64, f64) {
    facts.bonds.as_ref().filter(|_| facts.hangs(state)).map_or((0.0, 0.0), |bonds| bonds.added(state))
}
