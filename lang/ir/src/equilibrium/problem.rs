//! A system with its arguments, seen by a basis: what is given, what no equation changes, and where a solution is sought from.

use std::cell::{Cell, LazyCell};
use std::sync::Arc;

use super::activity::{Activities, Coefficients};
use super::basis::Basis;
use super::linear::{Factors, Matrix};
use super::state::NO_IONS;
use super::{Layout, System};
use crate::math;

/// A total below this, in mol per kg of solvent, counts as none: its members are followed linearly from there to nothing and below. So
/// does a mass of another liquid, in kg.
pub(super) const TRACE: f64 = 1e-30;

/// The logarithm of an activity of which nothing is known.
const NEUTRAL: f64 = -16.0;

/// Between which temperatures a solution is sought, K.
pub(super) const TEMPERATURES: (f64, f64) = (200.0, 700.0);

/// What no equation changes.
#[derive(Clone, Debug)]
pub(super) struct Totals {
    /// By master, not below a trace; that of the solvent behind them.
    pub(super) of: Vec<f64>,
    /// Of the solids that are there.
    pub(super) held: Vec<f64>,
}

impl Totals {
    pub(super) fn solvent(&self) -> f64 {
        self.of.last().copied().unwrap_or(0.0)
    }
}

/// Where unknowns stand.
///
/// What is held while the rest is sought stands last, so that those that are free are the first ones.
#[derive(Clone, Copy)]
pub(super) struct Places {
    pub(super) masters: usize,
    /// Molalities that are unknowns of their own.
    pub(super) placed: usize,
}

impl Places {
    pub(super) fn solvent(self) -> usize {
        self.masters
    }

    pub(super) fn strength(self) -> usize {
        self.masters + 1
    }

    pub(super) fn molality(self) -> usize {
        self.masters + 2
    }

    pub(super) fn placed(self) -> std::ops::Range<usize> {
        self.masters + 3..self.temperature()
    }

    /// All that are made by summing up amounts: ionic strength and molalities.
    pub(super) fn sums(self) -> std::ops::Range<usize> {
        self.strength()..self.temperature()
    }

    pub(super) fn temperature(self) -> usize {
        self.masters + 3 + self.placed
    }

    pub(super) fn count(self) -> usize {
        self.temperature() + 1
    }
}

/// A system with its arguments, seen by a basis.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    pub(super) system: &'a System,
    pub(super) args: &'a [f64],
    pub(super) layout: Layout,
    pub(super) activities: Activities,
    pub(super) basis: Arc<Basis>,
    /// The logarithm of the activity of a formal member that is held.
    pub(super) limit: f64,
    /// Whether the linear system is eliminated in the order of members, and not in that of masters.
    pub(super) as_numbered: bool,
    /// What may still be spent on a solution.
    pub(super) budget: &'a Budget,
}

/// How many steps of Newton's method may still be taken. What is hard to find is sought from many starts, each of them by solutions of its
/// own, and what has no solution would be sought without end.
#[derive(Debug)]
pub(super) struct Budget(Cell<u32>);

impl Budget {
    /// So many steps.
    pub(super) fn of(steps: u32) -> Budget {
        Budget(Cell::new(steps))
    }

    /// Takes one step; false where none is left.
    pub(super) fn spend(&self) -> bool {
        let left = self.0.get();
        self.0.set(left.saturating_sub(1));
        left > 0
    }
}

impl<'a> Problem<'a> {
    pub(super) fn new(system: &'a System, args: &'a [f64], basis: Arc<Basis>, budget: &'a Budget) -> Self {
        let (layout, activities) = (system.layout(), Activities::of(args));
        Problem { system, args, layout, activities, basis, limit: 0.0, as_numbered: false, budget }
    }

    /// A linear system that is still to be filled in.
    pub(super) fn linear(&self) -> Factors {
        Factors::in_order(if self.as_numbered { &self.basis.numbered } else { &[] })
    }

    pub(super) fn places(&self) -> Places {
        Places { masters: self.basis.masters.len(), placed: self.placed().len() }
    }

    /// Members whose molalities are unknowns.
    pub(super) fn placed(&self) -> &'a [usize] {
        self.system.virial.as_ref().map_or(&[], |virial| &virial.placed)
    }

    /// What is beside the members; an integrator may try less than none of it.
    pub(super) fn beside(&self, arg: usize) -> f64 {
        self.args[arg].max(0.0)
    }

    /// The mass of the liquid that a member is in beside the solvent, kg; none of one in the solvent.
    pub(super) fn liquid(&self, member: usize) -> Option<f64> {
        let place = self.basis.extracted.iter().position(|i| *i == member)?;
        Some(self.args[self.layout.liquid(place)].max(TRACE))
    }

    pub(super) fn given(&self, member: usize) -> f64 {
        self.args[self.layout.amount(member)]
    }

    /// Whether the temperature is given.
    pub(super) fn is_isothermal(&self) -> bool {
        self.args[self.layout.capacity()].is_infinite()
    }

    pub(super) fn reference(&self) -> f64 {
        self.args[self.layout.reference()]
    }

    /// What energies are compared with, J.
    pub(super) fn energy_scale(&self) -> f64 {
        self.args[self.layout.capacity()].abs() * 10.0
    }

    /// The parts of a member that are masters.
    pub(super) fn masters_of(&self, member: usize) -> &[(usize, f64)] {
        self.basis.masters_of.row(member)
    }

    /// What no equation changes, with the traces that are lacking.
    pub(super) fn totals(&self, lacking: &[f64]) -> Totals {
        let basis = &self.basis;
        let mut of = vec![0.0; basis.masters.len() + 1];
        let mut held = vec![0.0; basis.held.len()];
        for (i, lacking) in lacking.iter().enumerate() {
            let given = self.given(i) - lacking;
            basis.parts.row(i).iter().for_each(|(row, part)| of[*row] += part * given);
            held.iter_mut().zip(&basis.of_held[i]).for_each(|(held, part)| *held += part * given);
        }
        // A trace is lost in what cancels to less than nothing.
        let solvent = of[basis.masters.len()].max(0.0) * self.system.written.solvent_mass;
        for (c, _) in basis.masters.iter().enumerate().filter(|(_, i)| lacking[**i] != 0.0) {
            of[c] = TRACE * solvent;
        }
        Totals { of, held }
    }

    /// By master, as a member: what its total is short of a trace; 0 or less.
    pub(super) fn lacking(&self) -> Vec<f64> {
        let mut lacking = vec![0.0; self.basis.of.len()];
        let all = self.totals(&lacking);
        let least = TRACE * all.solvent().max(0.0) * self.system.written.solvent_mass;
        for (c, i) in self.basis.masters.iter().enumerate().filter(|(c, _)| self.basis.is_matter[*c]) {
            lacking[*i] = (all.of[c] - least).min(0.0);
        }
        lacking
    }

    /// The masters of the system of which there is none at all.
    pub(super) fn missing(&self, lacking: &[f64]) -> Vec<usize> {
        let basis = &self.system.basis;
        let total = |c: usize| (0..basis.of.len()).map(|i| basis.of[i][c] * self.given(i)).sum::<f64>();
        (0..basis.masters.len()).filter(|c| lacking[basis.masters[*c]] != 0.0 && total(*c) == 0.0).collect()
    }

    /// Whether there is enough of everything that a solid is made of.
    pub(super) fn may_be(&self, solid: usize, lacking: &[f64]) -> bool {
        self.masters_of(solid).iter().all(|(c, _)| lacking[self.basis.masters[*c]] == 0.0)
    }

    /// For each solid, one of its parts, so that there is little of all of them: its amount is known by that to the last digit. Of the
    /// ways to give each one a part of its own it is that whose largest total is least.
    pub(super) fn scarcest(&self, held: &[usize]) -> Vec<usize> {
        let totals = LazyCell::new(|| self.totals(&vec![0.0; self.basis.of.len()]).of);
        self.ranked(held, |c, of| if self.basis.is_matter[c] { totals[c] / of } else { f64::INFINITY })
    }

    /// The same by how much is dissolved of each part: a hydroxide that hardly comes out of much metal is known by the acid it sets free.
    pub(super) fn scarcest_dissolved(&self, held: &[usize], amounts: &[f64]) -> Vec<usize> {
        let part = |i: usize, c: usize| (self.basis.of[i][c] * amounts[i]).abs();
        let of_all = |c: usize| self.basis.solutes.iter().map(|i| part(*i, c)).fold(0.0, f64::max);
        self.ranked(held, |c, of| of_all(c) / of.abs())
    }

    /// For each solid, one of its parts, each another one, so that the largest rank is least.
    fn ranked(&self, held: &[usize], rank: impl Fn(usize, f64) -> f64) -> Vec<usize> {
        let rank = |(c, of): &(usize, f64)| rank(*c, *of);
        let choices: Vec<Vec<(usize, f64)>> = held
            .iter()
            .map(|solid| {
                let mut parts: Vec<(usize, f64)> = self.masters_of(*solid).iter().map(|p| (p.0, rank(p))).collect();
                parts.sort_by(|a, b| a.1.total_cmp(&b.1));
                parts
            })
            .collect();
        let mut bounds: Vec<f64> = choices.iter().flatten().map(|(_, rank)| *rank).collect();
        bounds.sort_by(f64::total_cmp);
        let paired = bounds.iter().find_map(|most| pairs(&choices, *most)).unwrap_or_default();
        paired.into_iter().map(|c| self.basis.masters[c]).collect()
    }

    /// How much of each of some solids another one is made of, if of them alone.
    pub(super) fn made_of(&self, solid: usize, others: &[usize]) -> Option<Vec<f64>> {
        let of = |i: usize| &self.basis.of[i];
        // The normal equations of a few short columns.
        let mut matrix = Matrix::of_size(others.len());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (row, a) in others.iter().enumerate() {
            for (column, b) in others.iter().enumerate() {
                *matrix.at(row, column) = dot(of(*a), of(*b));
            }
        }
        let right: Vec<f64> = others.iter().map(|a| dot(of(*a), of(solid))).collect();
        let shares = Factors::of(matrix)?.solve(right);
        let left = (0..self.basis.masters.len()).map(|c| {
            let made: f64 = others.iter().zip(&shares).map(|(a, share)| share * of(*a)[c]).sum();
            (of(solid)[c] - made).abs()
        });
        (left.fold(0.0, f64::max) < 1e-9).then_some(shares)
    }

    /// Where Newton's method begins, by master: all of it free, or as in a dilute solution where no total says.
    pub(super) fn start(&self, totals: &Totals) -> Vec<f64> {
        let solvent = totals.solvent() * self.system.written.solvent_mass;
        let free = |c: usize| if self.basis.is_matter[c] { math::ln(totals.of[c] / solvent) } else { NEUTRAL };
        let (heat, capacity) = (self.args[self.layout.heat()], self.args[self.layout.capacity()]);
        let warm = if self.is_isothermal() { 0.0 } else { heat / capacity };
        let temperature = (self.reference() + warm).clamp(TEMPERATURES.0, TEMPERATURES.1);
        let charge = |i: usize| self.system.members()[i].charge;
        let solutes = self.basis.solutes.iter();
        let ions: f64 = solutes.map(|i| 0.5 * charge(*i) * charge(*i) * self.given(*i).max(0.0)).sum();
        let strength = (ions + self.beside(self.layout.bystanders())) / solvent + 1e-7;
        let solutes: f64 = self.basis.solutes.iter().map(|i| self.given(*i).max(0.0)).sum();
        let molality = (solutes + self.beside(self.layout.bystander_amount())) / solvent + 1e-7;
        let mut x: Vec<f64> = (0..self.basis.masters.len()).map(free).collect();
        x.extend([math::ln(solvent), strength, molality]);
        x.extend(self.placed().iter().map(|i| self.given(*i).max(0.0) / solvent + NO_IONS));
        x.push(temperature);
        x
    }

    pub(super) fn coefficients(&self, member: usize) -> Coefficients {
        Coefficients::of(self.args, self.layout, member)
    }
}

/// A choice for each that no other one has, of those up to a rank; none where there is no such.
fn pairs(choices: &[Vec<(usize, f64)>], most: f64) -> Option<Vec<usize>> {
    fn find(
        of: usize,
        choices: &[Vec<(usize, f64)>],
        most: f64,
        has: &mut [Option<usize>],
        tried: &mut Vec<usize>,
    ) -> bool {
        for (choice, _) in choices[of].iter().take_while(|(_, rank)| *rank <= most) {
            if tried.contains(choice) {
                continue;
            }
            tried.push(*choice);
            let holder = has.iter().position(|held| *held == Some(*choice));
            // Who has it takes another one, if there is one.
            if holder.is_none_or(|other| find(other, choices, most, has, tried)) {
                has[of] = Some(*choice);
                return true;
            }
        }
        false
    }
    let mut has = vec![None; choices.len()];
    let all = (0..choices.len()).all(|of| find(of, choices, most, &mut has, &mut Vec::new()));
    all.then(|| has.into_iter().flatten().collect())
}
