//! What hangs together where laws move matter: each amount is what it was, its base, and a coefficient for each extent to which
//! something has gone on. Sums of amounts are then known as closely as what has gone on changes them: a mass not at all.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use matterix_ir::BinaryOp;

use super::polytope::{self, Face, range_of, scaled};
use super::state::AbstractState;
use super::value::{AbstractValue, Imprecision};
use crate::chem::Element;

/// A sum of coefficients below this share of its terms is zero: what goes on does not change it.
const CANCELS: f64 = 1e-12;

/// Coefficients of two directions that differ by less than this share are the same.
const SAME: f64 = 1e-9;

/// More extents than these are not told apart: what they move is known in boxes alone.
const MOST_EXTENTS: usize = 256;

/// The coefficients of an extent by state, the first of them 1.
pub type Direction = Rc<[(u32, f64)]>;

/// Something that goes on, and how far it has gone.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    /// What it changes.
    pub direction: Direction,
    /// How far it has gone, ends included; nothing is always among it.
    pub range: (f64, f64),
}

/// A state that hangs together with others.
#[derive(Clone, Debug, PartialEq)]
pub struct Bond {
    /// What it is without what the extents say.
    pub base: AbstractValue,
    /// What is known of it by itself; where it is known otherwise now, something else has changed it.
    pub known: AbstractValue,
}

/// What hangs together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bonds {
    /// By state index.
    pub states: BTreeMap<u32, Bond>,
    /// What has gone on.
    pub extents: Vec<Extent>,
}

/// A sum of states with coefficients, and a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Form {
    /// The number.
    pub constant: f64,
    /// Coefficients by state, in the order of the states.
    pub terms: Vec<(u32, f64)>,
}

impl Extent {
    /// Whether it may change one of the states from one to another; those that it changes are in order.
    fn lies_within(&self, first: u32, last: u32) -> bool {
        let ends = self.direction.first().zip(self.direction.last());
        ends.is_some_and(|((low, _), (high, _))| *low <= last && *high >= first)
    }
}

/// A direction with its first coefficient 1, and the number it was divided by; none where nothing is left of it.
pub fn direction(terms: impl IntoIterator<Item = (u32, f64)>) -> Option<(Direction, f64)> {
    let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
    terms.into_iter().for_each(|(state, c)| *sums.entry(state).or_default() += c);
    sums.retain(|_, c| *c != 0.0);
    let first = *sums.values().next()?;
    Some((sums.into_iter().map(|(state, c)| (state, c / first)).collect(), first))
}

fn alike(a: &Direction, b: &Direction) -> bool {
    let same = |((s, c), (t, d)): (&(u32, f64), &(u32, f64))| s == t && (c - d).abs() <= SAME * c.abs();
    Rc::ptr_eq(a, b) || (a.len() == b.len() && a.iter().zip(b.iter()).all(same))
}

impl Bonds {
    /// Whether nothing hangs together.
    pub fn is_empty(&self) -> bool {
        self.extents.is_empty()
    }

    /// Whether what is said of a state still holds.
    fn holds(&self, state: u32, facts: &AbstractState) -> bool {
        self.states.get(&state).is_some_and(|bond| bond.known.is(&facts.states[state as usize]))
    }

    /// Whether what is said of all states still holds.
    pub fn all_hold(&self, facts: &AbstractState) -> bool {
        self.loose(facts).next().is_none()
    }

    /// The states of which what is said no longer holds.
    pub fn loose(&self, facts: &AbstractState) -> impl Iterator<Item = u32> {
        self.states.keys().copied().filter(|state| !self.holds(*state, facts))
    }

    /// What is said here of the states that are not among others, and there of these.
    pub fn but_for(mut self, others: &Bonds, is_other: impl Fn(u32) -> bool) -> Bonds {
        let is_theirs = |e: &Extent| e.direction.iter().any(|(state, _)| is_other(*state));
        self.states.retain(|state, _| !is_other(*state));
        self.extents.retain(|e| !is_theirs(e));
        self.states.extend(others.states.iter().filter(|(s, _)| is_other(**s)).map(|(s, bond)| (*s, bond.clone())));
        self.extents.extend(others.extents.iter().filter(|e| is_theirs(e)).cloned());
        self
    }

    /// Forgets what something else has changed.
    pub fn settle(&mut self, facts: &AbstractState) {
        let gone: Vec<u32> = self.loose(facts).collect();
        self.release(&gone);
    }

    /// Forgets how states hang together with others.
    pub fn release(&mut self, states: &[u32]) {
        if !states.iter().any(|s| self.states.contains_key(s)) {
            return;
        }
        states.iter().for_each(|s| drop(self.states.remove(s)));
        let extents = std::mem::take(&mut self.extents);
        for Extent { direction, range } in extents {
            match direction.iter().any(|(s, _)| states.contains(s)) {
                true => self.add(direction.iter().copied().filter(|(s, _)| !states.contains(s)), range),
                false => self.extents.push(Extent { direction, range }),
            }
        }
        self.forget_still();
    }

    /// States that nothing has changed are what they are by themselves.
    fn forget_still(&mut self) {
        let extents = &self.extents;
        self.states.retain(|state, _| extents.iter().any(|e| e.direction.iter().any(|(s, _)| s == state)));
    }

    /// Takes a state as it is for what nothing has changed yet.
    pub fn cover(&mut self, state: u32, facts: &AbstractState) {
        let known = &facts.states[state as usize];
        self.states.entry(state).or_insert_with(|| Bond { base: known.clone(), known: known.clone() });
    }

    /// The place of what goes on in a direction, if it has one.
    pub fn known_extent(&self, direction: &Direction) -> Option<usize> {
        self.extents.iter().position(|e| alike(&e.direction, direction))
    }

    /// The place of what goes on in a direction.
    pub fn extent_of(&mut self, direction: &Direction) -> usize {
        self.known_extent(direction).unwrap_or_else(|| {
            self.extents.push(Extent { direction: direction.clone(), range: (0.0, 0.0) });
            self.extents.len() - 1
        })
    }

    /// Something has gone on as well.
    fn add(&mut self, terms: impl IntoIterator<Item = (u32, f64)>, range: (f64, f64)) {
        let Some((direction, by)) = direction(terms) else { return };
        let (low, high) = scaled(by, range);
        let extent = self.extent_of(&direction);
        let range = &mut self.extents[extent].range;
        *range = (range.0 + low, range.1 + high);
    }

    /// What extents add to a state.
    pub fn added(&self, state: u32) -> (f64, f64) {
        let here = self.extents.iter().filter(|e| e.lies_within(state, state));
        let terms = here.filter_map(|e| {
            let at = e.direction.binary_search_by_key(&state, |(s, _)| *s).ok()?;
            Some(scaled(e.direction[at].1, e.range))
        });
        terms.fold((0.0, 0.0), |(low, high), (a, b)| (low + a, high + b))
    }

    /// Bounds of a state that lie also within its base and what extents add to it.
    pub fn cut(&self, state: u32, (low, high): (f64, f64)) -> (f64, f64) {
        let Some(bond) = self.states.get(&state) else { return (low, high) };
        let ((least, most), (down, up)) = (bond.base.bounds(), self.added(state));
        let cut = (low.max(least + down), high.min(most + up));
        if cut.0 <= cut.1 { cut } else { (low, high) }
    }

    /// How far something goes on in a direction.
    pub fn range_in(&self, direction: &Direction) -> Option<(f64, f64)> {
        self.extents.iter().find(|e| alike(&e.direction, direction)).map(|e| e.range)
    }

    /// Takes the extents that alone change one of these states for what each has come to, and adds what they brought to the bases of all
    /// states that they change. The states that nothing else changes, with what they are; none where no extent is known so.
    pub fn come_to(&mut self, ends: &[(u32, f64)]) -> Option<Vec<(u32, AbstractValue)>> {
        let mut gone: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for (state, end) in ends {
            let Some(base) = self.states.get(state).and_then(|bond| bond.base.exact()) else { continue };
            let coefficient = |e: &Extent| e.direction.iter().find(|(s, _)| s == state).map(|(_, c)| *c);
            let mut of = self.extents.iter().enumerate().filter_map(|(i, e)| coefficient(e).map(|c| (i, c)));
            let (Some((extent, c)), None) = (of.next(), of.next()) else { continue };
            let (far, slack) = ((end - base) / c, SAME * base.abs().max(end.abs()) / c.abs());
            gone.entry(extent).or_insert((far - slack, far + slack));
        }
        if gone.is_empty() {
            return None;
        }
        for (extent, range) in &gone {
            for (state, c) in self.extents[*extent].direction.clone().iter() {
                if let Some(bond) = self.states.get_mut(state) {
                    let (low, high) = scaled(*c, *range);
                    bond.base = AbstractValue::binary(
                        BinaryOp::Add,
                        &bond.base,
                        &AbstractValue::Range(low, high, Imprecision::Unknown),
                    );
                }
            }
        }
        let mut place = 0..;
        self.extents.retain(|_| !place.next().is_some_and(|at: usize| gone.contains_key(&at)));
        let moves = |state: &u32| self.extents.iter().any(|e| e.direction.iter().any(|(s, _)| s == state));
        let still = self.states.iter().filter(|(state, _)| !moves(state));
        let still = still.map(|(state, bond)| (*state, bond.base.clone())).collect();
        self.forget_still();
        Some(still)
    }

    /// Brings extents in as far as no amount falls below nothing; the bounds of each amount. Where too many hang together for the
    /// corners of what extents can be, the atoms that are there bound the amounts.
    pub fn tighten(
        &mut self,
        is_amount: impl Fn(u32) -> bool,
        atoms: impl Fn(u32) -> Vec<(Element, f64)>,
    ) -> Vec<(u32, (f64, f64))> {
        self.tighten_from(None, is_amount, atoms, |_, _| {})
    }

    /// The same of what hangs together with one extent only, after `open` has opened the ranges of the extents of each part that is looked at.
    pub fn tighten_from(
        &mut self,
        extent: Option<usize>,
        is_amount: impl Fn(u32) -> bool,
        atoms: impl Fn(u32) -> Vec<(Element, f64)>,
        open: impl Fn(usize, &mut (f64, f64)),
    ) -> Vec<(u32, (f64, f64))> {
        let mut places: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
        for (i, extent) in self.extents.iter().enumerate() {
            for (state, c) in extent.direction.iter().filter(|(s, _)| is_amount(*s)) {
                places.entry(*state).or_default().push((i, *c));
            }
        }
        let mut out = Vec::new();
        let is_meant = |part: &Vec<usize>| extent.is_none_or(|extent| part.binary_search(&extent).is_ok());
        for part in parts(self.extents.len(), &places).into_iter().filter(is_meant) {
            part.iter().for_each(|extent| open(*extent, &mut self.extents[*extent].range));
            let mut bounds = self.tighten_part(&part, &places);
            if polytope::is_large(part.len(), bounds.len()) {
                self.bound_by_atoms(&part, &mut bounds, &atoms);
            }
            out.extend(bounds);
        }
        out
    }

    /// Bounds amounts by the atoms of each element that all of them have, if what goes on leaves these as they are.
    fn bound_by_atoms(
        &self,
        part: &[usize],
        bounds: &mut [(u32, (f64, f64))],
        atoms: &impl Fn(u32) -> Vec<(Element, f64)>,
    ) {
        let mut counts: BTreeMap<Element, BTreeMap<u32, f64>> = BTreeMap::new();
        for (state, _) in bounds.iter() {
            for (element, count) in atoms(*state) {
                counts.entry(element).or_default().insert(*state, count);
            }
        }
        for count in counts.into_values() {
            let kept = |extent: &usize| {
                let terms = self.extents[*extent].direction.iter();
                let terms = terms.filter_map(|(state, c)| Some(c * count.get(state)?));
                let (sum, size) = terms.fold((0.0, 0.0), |(sum, size): (f64, f64), t| (sum + t, size.max(t.abs())));
                sum.abs() <= SAME * size
            };
            if !part.iter().all(kept) {
                continue;
            }
            let base = |state: &u32| self.states.get(state).map_or(f64::INFINITY, |bond| bond.base.bounds().1);
            let there: f64 = count.iter().map(|(state, n)| n * base(state).max(0.0)).sum();
            for (state, (_, high)) in bounds.iter_mut() {
                if let Some(n) = count.get(state) {
                    *high = high.min(there / n * (1.0 + SAME));
                }
            }
        }
    }

    /// The same of extents that hang together.
    fn tighten_part(&mut self, part: &[usize], places: &BTreeMap<u32, Vec<(usize, f64)>>) -> Vec<(u32, (f64, f64))> {
        let local = |extent: &usize| part.binary_search(extent).ok();
        let mut amounts = Vec::new();
        let mut faces = Vec::new();
        let states = part.iter().flat_map(|extent| self.extents[*extent].direction.iter().map(|(state, _)| *state));
        let states: BTreeSet<u32> = states.collect();
        for (state, terms) in states.iter().filter_map(|state| Some((state, places.get(state)?))) {
            let terms: Vec<(usize, f64)> = terms.iter().filter_map(|(e, c)| Some((local(e)?, *c))).collect();
            let Some(bond) = self.states.get(state).filter(|_| !terms.is_empty()) else { continue };
            amounts.push((*state, bond.base.bounds()));
            faces.push(Face { most: bond.base.bounds().1, terms });
        }
        let mut ranges: Vec<(f64, f64)> = part.iter().map(|e| self.extents[*e].range).collect();
        polytope::tighten(&faces, &mut ranges);
        let together = part.len() > 1;
        if together {
            let before = ranges.clone();
            for (i, (low, high)) in ranges.iter_mut().enumerate() {
                *high = high.min(polytope::most(&[(i, 1.0)], &faces, &before));
                *low = low.max(-polytope::most(&[(i, -1.0)], &faces, &before));
            }
        }
        let bounds = |((state, (least, most)), face): (&(u32, (f64, f64)), &Face)| {
            let (mut low, mut high) = range_of(face.terms.iter().copied(), &ranges);
            if together {
                high = high.min(polytope::most(&face.terms, &faces, &ranges));
                let back: Vec<(usize, f64)> = face.terms.iter().map(|(e, c)| (*e, -c)).collect();
                low = low.max(-polytope::most(&back, &faces, &ranges));
            }
            (*state, ((least + low).max(0.0), (most + high).max(0.0)))
        };
        let out = amounts.iter().zip(&faces).map(bounds).collect();
        part.iter().zip(&ranges).for_each(|(extent, range)| self.extents[*extent].range = *range);
        out
    }

    /// What is known of a sum, where some of its states hang together.
    pub fn sum(&self, form: &Form, facts: &AbstractState) -> Option<AbstractValue> {
        let bound: Vec<bool> = form.terms.iter().map(|(s, _)| self.holds(*s, facts)).collect();
        if bound.iter().filter(|b| **b).count() < 2 {
            return None;
        }
        let mut sum = AbstractValue::Point(form.constant);
        for ((state, c), bound) in form.terms.iter().zip(&bound) {
            let known = match self.states.get(state).filter(|_| *bound) {
                Some(bond) => &bond.base,
                None => &facts.states[*state as usize],
            };
            sum = AbstractValue::binary(
                BinaryOp::Add,
                &sum,
                &AbstractValue::binary(BinaryOp::Mul, &AbstractValue::Point(*c), known),
            );
        }
        let (mut low, mut high) = (0.0, 0.0);
        let (Some((first, _)), Some((last, _))) = (form.terms.first(), form.terms.last()) else { return Some(sum) };
        for extent in self.extents.iter().filter(|e| e.lies_within(*first, *last)) {
            let (mut total, mut size) = (0.0, 0.0_f64);
            // What goes on changes few states, and a sum may be of many.
            for (state, c) in extent.direction.iter() {
                if let Ok(at) = form.terms.binary_search_by_key(state, |(s, _)| *s)
                    && bound[at]
                {
                    let part = form.terms[at].1 * c;
                    total += part;
                    size = size.max(part.abs());
                }
            }
            if total.abs() > CANCELS * size {
                let (a, b) = scaled(total, extent.range);
                (low, high) = (low + a, high + b);
            }
        }
        match (low, high) {
            (0.0, 0.0) => Some(sum),
            _ => {
                Some(AbstractValue::binary(BinaryOp::Add, &sum, &AbstractValue::Range(low, high, Imprecision::Unknown)))
            }
        }
    }

    /// A state becomes a sum of states.
    pub fn assigned(&mut self, state: u32, form: &Form, facts: &AbstractState) {
        self.settle(facts);
        if !form.terms.iter().any(|(s, _)| self.states.contains_key(s)) {
            return self.release(&[state]);
        }
        let mut base = AbstractValue::Point(form.constant);
        for (s, c) in &form.terms {
            let known = self.states.get(s).map_or(&facts.states[*s as usize], |bond| &bond.base);
            base = AbstractValue::binary(
                BinaryOp::Add,
                &base,
                &AbstractValue::binary(BinaryOp::Mul, &AbstractValue::Point(*c), known),
            );
        }
        let extents = std::mem::take(&mut self.extents);
        for Extent { direction, range } in extents {
            let coefficient = |s: &u32| direction.iter().find(|(other, _)| other == s).map_or(0.0, |(_, c)| *c);
            let new: f64 = form.terms.iter().map(|(s, a)| a * coefficient(s)).sum();
            let others = direction.iter().copied().filter(|(s, _)| *s != state);
            self.add(others.chain([(state, new)]), range);
        }
        self.states.insert(state, Bond { base, known: AbstractValue::top() });
        self.forget_still();
    }

    /// A share of some states is taken to others.
    pub fn transferred(&mut self, share: &AbstractValue, ways: &[(u32, Option<u32>)], facts: &AbstractState) {
        self.settle(facts);
        let ends = |s: &u32| ways.iter().any(|(from, to)| from == s || to.as_ref() == Some(s));
        if !self.states.keys().any(ends) {
            return;
        }
        let rest = AbstractValue::binary(BinaryOp::Sub, &AbstractValue::Point(1.0), share);
        for (from, to) in ways {
            self.cover(*from, facts);
            let held = self.states[from].base.clone();
            if let Some(bond) = self.states.get_mut(from) {
                bond.base = AbstractValue::binary(BinaryOp::Mul, &rest, &held);
            }
            if let Some(to) = to {
                self.cover(*to, facts);
                if let Some(bond) = self.states.get_mut(to) {
                    bond.base = AbstractValue::binary(
                        BinaryOp::Add,
                        &bond.base,
                        &AbstractValue::binary(BinaryOp::Mul, share, &held),
                    );
                }
            }
        }
        let target = |s: &u32| ways.iter().find(|(from, _)| from == s).map(|(_, to)| *to);
        let extents = std::mem::take(&mut self.extents);
        for Extent { direction, range } in extents {
            let (taken, left): (Vec<_>, Vec<_>) = direction.iter().copied().partition(|(s, _)| target(s).is_some());
            self.add(left, range);
            self.add(taken.iter().copied(), shared(&rest, range));
            let moved = taken.iter().filter_map(|(s, c)| Some((target(s)??, *c)));
            self.add(moved, shared(share, range));
        }
        self.forget_still();
        if self.extents.len() > MOST_EXTENTS {
            *self = Bonds::default();
        }
    }

    /// Takes what is known of states by themselves as it is now.
    pub fn stamp(&mut self, facts: &AbstractState) {
        self.states.iter_mut().for_each(|(state, bond)| bond.known = facts.states[*state as usize].clone());
    }

    /// What hangs together whichever of two ways was taken; `out` is what is known of the states then.
    pub fn join(a: &AbstractState, b: &AbstractState, out: &AbstractState, why: Imprecision) -> Option<Rc<Bonds>> {
        let [mut one, mut other] = [a, b].map(|facts| {
            let mut bonds = facts.bonds.as_deref().cloned().unwrap_or_default();
            bonds.settle(facts);
            bonds
        });
        let states: Vec<u32> = one.states.keys().chain(other.states.keys()).copied().collect();
        for state in states {
            one.cover(state, a);
            other.cover(state, b);
            if let (Some(bond), Some(with)) = (one.states.get_mut(&state), other.states.get(&state)) {
                bond.base = bond.base.join(&with.base, why);
            }
        }
        for extent in &other.extents {
            let at = one.extent_of(&extent.direction);
            let range = &mut one.extents[at].range;
            *range = (range.0.min(extent.range.0), range.1.max(extent.range.1));
        }
        one.stamp(out);
        Some(Rc::new(one)).filter(|bonds| !bonds.is_empty())
    }
}

/// A range of an extent of which a share is taken.
fn shared(share: &AbstractValue, range: (f64, f64)) -> (f64, f64) {
    let (low, high) = share.bounds();
    let ((a, b), (c, d)) = (scaled(low, range), scaled(high, range));
    (a.min(c), b.max(d))
}

/// Extents that hang together by amounts they share, in rising order.
fn parts(count: usize, places: &BTreeMap<u32, Vec<(usize, f64)>>) -> Vec<Vec<usize>> {
    let mut root: Vec<usize> = (0..count).collect();
    let find = |root: &[usize], mut at: usize| {
        while root[at] != at {
            at = root[at];
        }
        at
    };
    for terms in places.values() {
        for two in terms.windows(2) {
            let (a, b) = (find(&root, two[0].0), find(&root, two[1].0));
            root[a.max(b)] = a.min(b);
        }
    }
    let mut out: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    (0..count).for_each(|i| out.entry(find(&root, i)).or_default().push(i));
    out.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Isomers that turn into each other in a circle, with 3 of the first one.
    fn circle(isomers: u32) -> Bonds {
        let mut bonds = Bonds::default();
        for state in 0..isomers {
            let base = AbstractValue::Point(if state == 0 { 3.0 } else { 0.0 });
            bonds.states.insert(state, Bond { base, known: AbstractValue::top() });
            let to = (state + 1) % isomers;
            let direction: Direction = Rc::new([(state.min(to), -1.0), (state.max(to), 1.0)]);
            let range = if state < to { (0.0, f64::INFINITY) } else { (f64::NEG_INFINITY, 0.0) };
            bonds.extents.push(Extent { direction, range });
        }
        bonds
    }

    #[test]
    fn atoms_bound_what_is_too_large_for_corners() {
        for isomers in [4, 20, 60] {
            let carbon = |_| vec![(Element::C, 2.0)];
            for (state, (low, high)) in circle(isomers).tighten(|_| true, carbon) {
                assert!(low == 0.0 && (high - 3.0).abs() < 1e-6, "{isomers}: {state} in {low} .. {high}");
            }
        }
    }

    #[test]
    fn atoms_that_are_not_kept_bound_nothing() {
        let odd = |state: u32| vec![(Element::C, f64::from(state + 1))];
        let bounds = circle(20).tighten(|_| true, odd);
        assert!(bounds.iter().all(|(_, (_, high))| high.is_infinite()));
    }
}
