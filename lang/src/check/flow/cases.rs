//! Which values states have together. Where ways meet on which states are known exactly, it is kept which values go with which, as long
//! as the ways are few: so a counter and what it counts stay in step, whatever the effects and laws are that relate them.

use std::collections::BTreeMap;
use std::rc::Rc;

use matterix_ir::NodeId;

use super::Interpreter;
use super::eval::{Exact, Supposed};
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision, ROUNDING};

/// So many ways are told apart; where more meet, each state is known by itself only.
const MOST_WAYS: usize = 8;

/// Of so many states at most it is kept which values they have together.
const MOST_STATES: usize = 1000;

/// A state that is one of several numbers, depending on the way.
#[derive(Clone, Debug, PartialEq)]
struct Told {
    /// What is known of it; where that is something else now, the values are out of date.
    known: AbstractValue,
    /// Its value on each way.
    values: Vec<f64>,
}

/// The ways that have met: on each of them all of these states had these values.
#[derive(Clone, Debug, PartialEq)]
pub struct Cases {
    states: BTreeMap<u32, Told>,
    /// How many ways there are.
    ways: usize,
}

impl Cases {
    /// The ways that lead to where two lines of ways meet; `open` are the states of which no single value is known then. What is known
    /// of these in `out` comes to what the ways say.
    pub fn join(
        a: &AbstractState,
        b: &AbstractState,
        open: &[u32],
        out: &mut AbstractState,
        why: Imprecision,
    ) -> Option<Rc<Cases>> {
        let (of_a, of_b) = (a.ways(), b.ways());
        // Where branches were stopped partway, values of several ways may have come together.
        if a.blurred.is_some() || b.blurred.is_some() {
            return None;
        }
        if open.len() < 2 || of_a > MOST_WAYS || of_b > MOST_WAYS {
            return None;
        }
        let mut states: Vec<(u32, Vec<f64>)> = Vec::new();
        for state in open {
            let Some(mut values) = a.values_of(*state, of_a) else { continue };
            let Some(others) = b.values_of(*state, of_b) else { continue };
            values.extend(others);
            states.push((*state, values));
            if states.len() > MOST_STATES {
                return None;
            }
        }
        let same = |i: usize, j: usize| {
            states.iter().all(|(_, v)| (v[i] - v[j]).abs() <= ROUNDING * v[i].abs().max(v[j].abs()))
        };
        let mut kept: Vec<usize> = Vec::new();
        for way in 0..of_a + of_b {
            if !kept.iter().any(|other| same(way, *other)) {
                kept.push(way);
            }
        }
        if states.len() < 2 || kept.len() > MOST_WAYS {
            return None;
        }
        let mut cases = Cases { states: BTreeMap::new(), ways: kept.len() };
        for (state, values) in states {
            let values: Vec<f64> = kept.iter().map(|way| values[*way]).collect();
            let why = out.states[state as usize].why().unwrap_or(why);
            let known = AbstractValue::of(values.clone(), why);
            if !known.is(&out.states[state as usize]) {
                out.states[state as usize] = known.clone();
            }
            if known.exact().is_none() {
                cases.states.insert(state, Told { known, values });
            }
        }
        (cases.ways > 1).then(|| Rc::new(cases))
    }
}

impl AbstractState {
    /// How many ways are told apart.
    fn ways(&self) -> usize {
        self.cases.as_ref().map_or(1, |cases| cases.ways)
    }

    /// The value of a state on each way, where it is not the same on all.
    fn told(&self, state: u32) -> Option<&[f64]> {
        let told = self.cases.as_ref()?.states.get(&state)?;
        told.known.is(&self.states[state as usize]).then_some(told.values.as_slice())
    }

    /// The value of a state on each of so many ways, where it is known.
    fn values_of(&self, state: u32, ways: usize) -> Option<Vec<f64>> {
        match self.states[state as usize].exact() {
            Some(value) => Some(vec![value; ways]),
            None => self.told(state).map(<[f64]>::to_vec),
        }
    }

    /// These states become something else on each way.
    pub fn untell(&mut self, states: impl Iterator<Item = u32>) {
        let Some(cases) = self.cases.as_mut() else { return };
        for state in states {
            if cases.states.contains_key(&state) {
                Rc::make_mut(cases).states.remove(&state);
            }
        }
    }

    /// A state has just become this on each way.
    pub fn tell(&mut self, state: u32, values: Vec<f64>) {
        let known = self.states[state as usize].clone();
        if let (Some(cases), None) = (self.cases.as_mut(), known.exact()) {
            Rc::make_mut(cases).states.insert(state, Told { known, values });
        }
    }

    /// Only some of the ways lead here.
    fn keep_ways(&mut self, stays: &[bool]) {
        let Some(mut cases) = self.cases.take() else { return };
        let of = Rc::make_mut(&mut cases);
        of.ways = stays.iter().filter(|stays| **stays).count();
        let states = std::mem::take(&mut of.states);
        for (state, told) in states {
            let now = &self.states[state as usize];
            if !told.known.is(now) {
                continue;
            }
            let why = now.why().unwrap_or(Imprecision::Paths);
            let values: Vec<f64> =
                told.values.iter().zip(stays).filter(|(_, stays)| **stays).map(|(v, _)| *v).collect();
            let known = AbstractValue::of(values.clone(), why);
            self.narrow(state, known.clone());
            if known.exact().is_none() {
                of.states.insert(state, Told { known, values });
            }
        }
        self.cases = Some(cases).filter(|cases| cases.ways > 1 && !cases.states.is_empty());
    }
}

impl Interpreter<'_, '_> {
    /// The value of a node on each way, as far as it is known exactly, where all that is not known is told apart; and why the way is
    /// not known.
    fn on_each_way(&mut self, node: NodeId, facts: &AbstractState) -> Option<(Vec<Option<f64>>, Imprecision)> {
        let ways = facts.cases.as_ref()?.ways;
        let parts = self.parts(node);
        let mut open: Vec<(u32, &[f64])> = Vec::new();
        let mut why = Imprecision::Paths;
        for state in &parts.states {
            if let Some(because) = facts.states[*state as usize].why() {
                open.push((*state, facts.told(*state)?));
                why = why.max(because);
            }
        }
        if open.is_empty() {
            return None;
        }
        let formula = self.nodes.formulas.of(&self.lab.graph, node);
        let mut out = Vec::with_capacity(ways);
        for way in 0..ways {
            let states: Vec<(u32, f64)> = open.iter().map(|(state, values)| (*state, values[way])).collect();
            let exact = Exact { params: &self.params, facts };
            out.push(formula.value(&Supposed { exact, states: &states }, &mut self.numbers));
        }
        Some((out, why))
    }

    /// The value of a node on each way, where it is known exactly on all and rests on what is told apart; and what is known of it.
    pub(super) fn by_case(&mut self, node: NodeId, facts: &AbstractState) -> Option<(Vec<f64>, AbstractValue)> {
        let (values, why) = self.on_each_way(node, facts)?;
        let values: Vec<f64> = values.into_iter().collect::<Option<_>>()?;
        Some((values.clone(), AbstractValue::of(values, why)))
    }

    /// Takes a condition for true or false: ways on which it comes out otherwise do not lead here. Whether there are any.
    pub(super) fn choose_ways(&mut self, node: NodeId, holds: bool, facts: &mut AbstractState) -> bool {
        if facts.cases.is_none() || self.is_shared(node) {
            return false;
        }
        let Some((values, _)) = self.on_each_way(node, facts) else { return false };
        let stays: Vec<bool> = values.iter().map(|v| v.is_none_or(|v| (v != 0.0) == holds)).collect();
        let some = stays.contains(&true) && stays.contains(&false);
        if some {
            facts.keep_ways(&stays);
        }
        some
    }

    /// The share that a transfer takes on each way, where ways are told apart.
    pub(super) fn share_by_case(
        &mut self,
        fraction: NodeId,
        share: &AbstractValue,
        facts: &AbstractState,
    ) -> Option<Vec<f64>> {
        let ways = facts.cases.as_ref()?.ways;
        match share.exact() {
            Some(share) => Some(vec![share; ways]),
            None => self.by_case(fraction, facts).map(|(values, _)| values),
        }
    }
}

/// What a share of a state leaves and brings to another one, on each way; none where one of them is not known.
pub(super) fn moved(shares: &[f64], source: u32, target: u32, facts: &AbstractState) -> Option<[Vec<f64>; 2]> {
    let (held, there) = (facts.values_of(source, shares.len())?, facts.values_of(target, shares.len())?);
    let rest = shares.iter().zip(&held).map(|(share, held)| (1.0 - share) * held).collect();
    let more = shares.iter().zip(&held).zip(&there).map(|((share, held), there)| there + share * held).collect();
    Some([rest, more])
}

#[cfg(test)]
mod tests {

    use matterix_ir::Span;

    use super::*;

    fn facts(states: &[f64]) -> AbstractState {
        AbstractState::new(
            states.iter().map(|v| AbstractValue::Point(*v)).collect(),
            Vec::new(),
            AbstractValue::Point(0.0),
        )
    }

    fn met(ways: &[&[f64]]) -> AbstractState {
        let base = facts(ways[0]);
        let all = ways.iter().map(|way| facts(way));
        all.reduce(|a, b| base.join(a, &b, Span::default(), Imprecision::Paths)).expect("there are ways")
    }

    #[test]
    fn values_that_go_together_stay_together() {
        let mut facts = met(&[&[1.0, 10.0, 5.0], &[2.0, 20.0, 5.0], &[3.0, 30.0, 5.0]]);
        assert_eq!(facts.told(1), Some([10.0, 20.0, 30.0].as_slice()));
        assert_eq!(facts.told(2), None);
        facts.keep_ways(&[false, true, true]);
        assert_eq!(facts.states[0].bounds(), (2.0, 3.0));
        assert_eq!(facts.states[1].bounds(), (20.0, 30.0));
        facts.keep_ways(&[false, true]);
        assert_eq!([0, 1, 2].map(|s| facts.states[s].exact()), [Some(3.0), Some(30.0), Some(5.0)]);
        assert!(facts.cases.is_none());
    }

    #[test]
    fn ways_that_rounding_parts_are_one() {
        let facts = met(&[&[0.1 + 0.2, 4.0], &[0.3, 4.0 + 1e-15], &[1.0, 2.0]]);
        assert_eq!(facts.told(0), Some([0.1 + 0.2, 1.0].as_slice()));
        assert_eq!(facts.ways(), 2);
    }

    #[test]
    fn what_is_written_is_told_apart_no_more() {
        let mut facts = met(&[&[1.0, 10.0], &[2.0, 20.0]]);
        facts.write(Span::default(), vec![(1, AbstractValue::top())]);
        assert_eq!(facts.told(1), None);
        assert_eq!(facts.told(0), Some([1.0, 2.0].as_slice()));
        // The same numbers again say nothing of which goes with which.
        facts.write(Span::default(), vec![(1, AbstractValue::of(vec![10.0, 20.0], Imprecision::Paths))]);
        assert_eq!(facts.told(1), None);
    }

    #[test]
    fn many_ways_are_not_told_apart() {
        let ways: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i), f64::from(10 * i)]).collect();
        let ways: Vec<&[f64]> = ways.iter().map(<[f64; 2]>::as_slice).collect();
        assert!(met(&ways).cases.is_none());
        assert_eq!(met(&ways[..8]).ways(), 8);
    }

    #[test]
    fn a_share_is_taken_way_by_way() {
        let facts = met(&[&[4.0, 0.0], &[2.0, 1.0]]);
        let [rest, more] = moved(&[0.25, 0.5], 0, 1, &facts).expect("all is told apart");
        assert_eq!(rest, [3.0, 1.0]);
        assert_eq!(more, [1.0, 2.0]);
    }
}
