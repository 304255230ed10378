//! Which values states have together. Where ways meet on which states are known exactly, it is kept which values go with which, as long
//! as the ways are few: so a counter and what it counts stay in step, whatever the effects and laws are that relate them.

use std::collections::BTreeMap;
use std::rc::Rc;

use matterix_ir::NodeId;

use super::Flow;
use super::eval::{Exact, Supposed};
use super::facts::Facts;
use super::value::{Known, Why};

/// So many ways are told apart; where more meet, each state is known by itself only.
const MOST_WAYS: usize = 8;

/// Of so many states at most it is kept which values they have together.
const MOST_STATES: usize = 1000;

/// Two ways are one where no state differs by more than this, relative to the larger: rounding parts them.
const SAME: f64 = 1e-12;

/// A state that is one of several numbers, depending on the way.
#[derive(Clone, Debug, PartialEq)]
struct Told {
    /// What is known of it; where that is something else now, the values are out of date.
    known: Known,
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
    pub fn join(a: &Facts, b: &Facts, open: &[u32], out: &mut Facts, why: Why) -> Option<Rc<Cases>> {
        let (of_a, of_b) = (a.ways(), b.ways());
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
        let same =
            |i: usize, j: usize| states.iter().all(|(_, v)| (v[i] - v[j]).abs() <= SAME * v[i].abs().max(v[j].abs()));
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
            let known = Known::of(values.clone(), why);
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

impl Facts {
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
            let why = now.why().unwrap_or(Why::Paths);
            let values: Vec<f64> =
                told.values.iter().zip(stays).filter(|(_, stays)| **stays).map(|(v, _)| *v).collect();
            let known = Known::of(values.clone(), why);
            self.narrow(state, known.clone());
            if known.exact().is_none() {
                of.states.insert(state, Told { known, values });
            }
        }
        self.cases = Some(cases).filter(|cases| cases.ways > 1 && !cases.states.is_empty());
    }
}

impl Flow<'_, '_> {
    /// The value of a node on each way, as far as it is known exactly, where all that is not known is told apart; and why the way is
    /// not known.
    fn on_each_way(&mut self, node: NodeId, facts: &Facts) -> Option<(Vec<Option<f64>>, Why)> {
        let ways = facts.cases.as_ref()?.ways;
        let parts = self.parts(node);
        let mut open: Vec<(u32, &[f64])> = Vec::new();
        let mut why = Why::Paths;
        for state in &parts.states {
            if let Some(because) = facts.states[*state as usize].why() {
                open.push((*state, facts.told(*state)?));
                why = why.max(because);
            }
        }
        if open.is_empty() {
            return None;
        }
        let formula = self.formulas.of(&self.lab.graph, node);
        let mut out = Vec::with_capacity(ways);
        for way in 0..ways {
            let states: Vec<(u32, f64)> = open.iter().map(|(state, values)| (*state, values[way])).collect();
            let exact = Exact { params: &self.params, facts };
            out.push(formula.value(&Supposed { exact, states: &states }, &mut self.numbers));
        }
        Some((out, why))
    }

    /// The value of a node on each way, where it is known exactly on all and rests on what is told apart; and what is known of it.
    pub(super) fn by_case(&mut self, node: NodeId, facts: &Facts) -> Option<(Vec<f64>, Known)> {
        let (values, why) = self.on_each_way(node, facts)?;
        let values: Vec<f64> = values.into_iter().collect::<Option<_>>()?;
        Some((values.clone(), Known::of(values, why)))
    }

    /// Takes a condition for true or false: ways on which it comes out otherwise do not lead here.
    pub(super) fn choose_ways(&mut self, node: NodeId, holds: bool, facts: &mut Facts) {
        if facts.cases.is_none() || self.is_shared(node) {
            return;
        }
        let Some((values, _)) = self.on_each_way(node, facts) else { return };
        let stays: Vec<bool> = values.iter().map(|v| v.is_none_or(|v| (v != 0.0) == holds)).collect();
        if stays.contains(&true) && stays.contains(&false) {
            facts.keep_ways(&stays);
        }
    }

    /// The share that a transfer takes on each way, where ways are told apart.
    pub(super) fn share_by_case(&mut self, fraction: NodeId, share: &Known, facts: &Facts) -> Option<Vec<f64>> {
        let ways = facts.cases.as_ref()?.ways;
        match share.exact() {
            Some(share) => Some(vec![share; ways]),
            None => self.by_case(fraction, facts).map(|(values, _)| values),
        }
    }
}

/// What a share of a state leaves and brings to another one, on each way; none where one of them is not known.
pub(super) fn moved(shares: &[f64], source: u32, target: u32, facts: &Facts) -> Option<[Vec<f64>; 2]> {
    let (held, there) = (facts.values_of(source, shares.len())?, facts.values_of(target, shares.len())?);
    let rest = shares.iter().zip(&held).map(|(share, held)| (1.0 - share) * held).collect();
    let more = shares.iter().zip(&held).zip(&there).map(|((share, held), there)| there + share * held).collect();
    Some([rest, more])
}
