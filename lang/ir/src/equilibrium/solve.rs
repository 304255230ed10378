//! Where totals, constants and the heat content are met.
//!
//! Newton's method on the logarithms of what makes each total up over what it should be: it is nearly linear in the logarithms of
//! activities, so that a handful of steps suffices between femtomoles and kilomoles. A start that is very far off is brought near by
//! positive continuous fractions first (Carrayrou, Mose and Behra, AIChE J. 48 (2002) 894), each total by itself. Solids are there
//! or not: those that came out below nothing leave, the one furthest above its constant comes, until neither is so. One that is there
//! is a master whose activity is 1, like the solvent; two other ways were compared. Its amount as an unknown among logarithms makes
//! Newton's method swing; a smooth form of "there or saturated" has slopes that are not those of the solution.

use std::sync::Arc;

use super::activity::{Activities, Coefficient, Coefficients};
use super::basis::Basis;
use super::linear::{Factors, Matrix};
use super::{Layout, Member, Phase, System, memo};
use crate::math;

/// ln 10.
pub(super) const LN_10: f64 = std::f64::consts::LN_10;

/// The temperature at which constants and the coefficients of activity are given, where nothing else is said, K.
pub const STANDARD: f64 = 298.15;

/// A total below this, in mol per kg of solvent, counts as none: its members are followed linearly from there to nothing and below.
const TRACE: f64 = 1e-30;

/// A solution meets its conditions to this share.
const MET: f64 = 1e-11;

/// It is not sought any closer than to this share.
const CLOSE: f64 = 4e-15;

/// How often Newton's method steps at most.
const MOST_STEPS: usize = 200;

/// Beyond this logarithm of a total over what it should be it is far off; so often it is brought nearer at most.
const FAR: f64 = 8.0;
const MOST_FRACTIONS: usize = 100;

/// From here on activity coefficients move with the rest, unless that has led nowhere for so many steps.
const NEAR: f64 = 0.3;
const PATIENCE: usize = 6;

/// From here on they do in any case.
const VERY_NEAR: f64 = 0.02;

/// How often a temperature is halved that is hard to find.
const HALVINGS: usize = 40;

/// How far a logarithm goes in one step at most; less and less, so that nothing swings for ever.
const LONGEST: f64 = 8.0;

/// How far the temperature goes in one step at most, K, and between which it stays.
const WARMEST_STEP: f64 = 25.0;
const TEMPERATURES: (f64, f64) = (200.0, 700.0);

/// Ions per mass of solvent that do not matter, mol/kg.
const NO_IONS: f64 = 1e-12;

/// The logarithm of an activity of which nothing is known.
const NEUTRAL: f64 = -16.0;

/// A solid is above its constant by this much of a logarithm before it counts.
const SATURATED: f64 = 1e-10;

/// Numbers at equilibrium, and where they were found.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub(super) amounts: Vec<f64>,
    pub(super) activities: Vec<f64>,
    pub(super) temperature: f64,
    pub(super) strength: f64,
    pub(super) heat: f64,
    /// By how much the heat capacity has grown, J/K.
    pub(super) capacity: f64,
    /// None where there is no solvent: all is as it was given.
    pub(super) point: Option<Point>,
}

/// A solution by its unknowns.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// The basis with the solids that are there.
    pub(super) basis: Arc<Basis>,
    /// Logarithms of the activities of masters, that of the mass of solvent, ionic strength, molality of all that is dissolved, temperature.
    pub(super) x: Vec<f64>,
    pub(super) totals: Totals,
    pub(super) state: State,
    pub(super) factors: Factors,
}

/// What no equation changes.
#[derive(Clone, Debug)]
pub(super) struct Totals {
    /// By master, not below a trace; that of the solvent behind them.
    pub(super) of: Vec<f64>,
    /// Of the solids that are there.
    pub(super) held: Vec<f64>,
}

impl Totals {
    fn solvent(&self) -> f64 {
        self.of.last().copied().unwrap_or(0.0)
    }
}

/// What follows from the unknowns.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// By member: ln K of its formation, and how much that grows with temperature.
    pub(super) constants: Vec<f64>,
    pub(super) rises: Vec<f64>,
    /// By member: enthalpy of its formation, J/mol, and the heat capacity that it takes, J/(mol*K).
    pub(super) enthalpies: Vec<f64>,
    pub(super) capacities: Vec<f64>,
    /// By member.
    pub(super) coefficients: Vec<Coefficient>,
    /// By member: mol.
    pub(super) amounts: Vec<f64>,
    /// By row: what adds to a total, and what it should be.
    pub(super) sides: Vec<[f64; 2]>,
    /// Heat capacity, J/K, and the heat that forming took, J.
    pub(super) capacity: f64,
    pub(super) heat: f64,
    /// How far it is above the reference temperature, K.
    pub(super) warmer: f64,
    /// Half the sum of amount times charge squared, mol.
    pub(super) charges: f64,
    /// All that is dissolved, mol.
    pub(super) dissolved: f64,
    /// How far each condition is from being met.
    pub(super) residuals: Vec<f64>,
}

/// Where unknowns stand.
#[derive(Clone, Copy)]
pub(super) struct Places {
    pub(super) masters: usize,
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

    pub(super) fn temperature(self) -> usize {
        self.masters + 3
    }

    pub(super) fn count(self) -> usize {
        self.masters + 4
    }
}

/// A system with its arguments, seen by a basis.
pub(super) struct Problem<'a> {
    pub(super) system: &'a System,
    pub(super) args: &'a [f64],
    pub(super) layout: Layout,
    pub(super) activities: Activities,
    pub(super) basis: Arc<Basis>,
}

impl<'a> Problem<'a> {
    pub(super) fn new(system: &'a System, args: &'a [f64], basis: Arc<Basis>) -> Self {
        Problem { system, args, layout: system.layout(), activities: Activities::of(args), basis }
    }

    pub(super) fn places(&self) -> Places {
        Places { masters: self.basis.masters.len() }
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
    pub(super) fn masters_of(&self, member: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let masters = self.basis.masters.len();
        self.basis.parts[member].iter().copied().filter(move |(c, _)| *c < masters)
    }

    /// All as it was given: where there is no solvent, nothing is dissolved in it.
    fn as_given(&self) -> Solution {
        let count = self.system.members().len();
        let (heat, capacity) = (self.args[self.layout.heat()], self.args[self.layout.capacity()]);
        let warm = if self.is_isothermal() || capacity == 0.0 { 0.0 } else { heat / capacity };
        Solution {
            amounts: (0..count).map(|i| self.given(i)).collect(),
            activities: vec![f64::NEG_INFINITY; count],
            temperature: self.reference() + warm,
            strength: 0.0,
            heat: 0.0,
            capacity: 0.0,
            point: None,
        }
    }

    /// What no equation changes, with the traces that are lacking.
    fn totals(&self, lacking: &[f64]) -> Totals {
        let basis = &self.basis;
        let mut of = vec![0.0; basis.masters.len() + 1];
        let mut held = vec![0.0; basis.held.len()];
        for (i, lacking) in lacking.iter().enumerate() {
            let given = self.given(i) - lacking;
            basis.parts[i].iter().for_each(|(row, part)| of[*row] += part * given);
            held.iter_mut().zip(&basis.of_held[i]).for_each(|(held, part)| *held += part * given);
        }
        Totals { of, held }
    }

    /// By master, as a member: what its total is short of a trace; 0 or less.
    fn lacking(&self) -> Vec<f64> {
        let mut lacking = vec![0.0; self.basis.of.len()];
        let all = self.totals(&lacking);
        let least = TRACE * all.solvent().max(0.0) * self.system.written.solvent_mass;
        for (c, i) in self.basis.masters.iter().enumerate().filter(|(c, _)| self.basis.is_matter[*c]) {
            lacking[*i] = (all.of[c] - least).min(0.0);
        }
        lacking
    }

    /// Whether there is enough of everything that a solid is made of.
    fn may_be(&self, solid: usize, lacking: &[f64]) -> bool {
        self.masters_of(solid).all(|(c, _)| lacking[self.basis.masters[c]] == 0.0)
    }

    /// For each solid, which of its parts there is least of: its amount is known by that to the last digit.
    fn scarcest(&self, held: &[usize]) -> Vec<usize> {
        let none = vec![0.0; self.basis.of.len()];
        let totals = if held.is_empty() { none.clone() } else { self.totals(&none).of };
        let mut replaced: Vec<usize> = Vec::new();
        for solid in held {
            let rank = |&(c, of): &(usize, f64)| if self.basis.is_matter[c] { totals[c] / of } else { f64::INFINITY };
            let is_free = |&(c, _): &(usize, f64)| !replaced.contains(&self.basis.masters[c]);
            let scarcest = self.masters_of(*solid).filter(is_free).min_by(|a, b| rank(a).total_cmp(&rank(b)));
            replaced.extend(scarcest.map(|(c, _)| self.basis.masters[c]));
        }
        replaced
    }

    /// How much of each of some solids another one is made of, if of them alone.
    fn made_of(&self, solid: usize, others: &[usize]) -> Option<Vec<f64>> {
        let of = |i: usize| &self.basis.of[i];
        // The normal equations of a few short columns.
        let mut matrix = Matrix::new(others.len());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (row, a) in others.iter().enumerate() {
            for (column, b) in others.iter().enumerate() {
                *matrix.at(row, column) = dot(of(*a), of(*b));
            }
        }
        let right: Vec<f64> = others.iter().map(|a| dot(of(*a), of(solid))).collect();
        let shares = matrix.factor()?.solve(&right);
        let left = (0..self.basis.masters.len()).map(|c| {
            let made: f64 = others.iter().zip(&shares).map(|(a, share)| share * of(*a)[c]).sum();
            (of(solid)[c] - made).abs()
        });
        (left.fold(0.0, f64::max) < 1e-9).then_some(shares)
    }

    /// Where Newton's method begins, by master: all of it free, or as in a dilute solution where no total says.
    fn start(&self, totals: &Totals) -> Vec<f64> {
        let solvent = totals.solvent() * self.system.written.solvent_mass;
        let free = |c: usize| if self.basis.is_matter[c] { math::ln(totals.of[c] / solvent) } else { NEUTRAL };
        let (heat, capacity) = (self.args[self.layout.heat()], self.args[self.layout.capacity()]);
        let warm = if self.is_isothermal() { 0.0 } else { heat / capacity };
        let temperature = (self.reference() + warm).clamp(TEMPERATURES.0, TEMPERATURES.1);
        let charge = |i: usize| self.system.members()[i].charge;
        let solutes = self.basis.solutes.iter();
        let ions: f64 = solutes.map(|i| 0.5 * charge(*i) * charge(*i) * self.given(*i).max(0.0)).sum();
        let strength = (ions + self.args[self.layout.bystanders()]) / solvent + 1e-7;
        let solutes: f64 = self.basis.solutes.iter().map(|i| self.given(*i).max(0.0)).sum();
        let molality = (solutes + self.args[self.layout.bystander_amount()]) / solvent + 1e-7;
        let mut x: Vec<f64> = (0..self.basis.masters.len()).map(free).collect();
        x.extend([math::ln(solvent), strength, molality, temperature]);
        x
    }

    /// What follows from the unknowns.
    fn state(&self, x: &[f64], totals: &Totals) -> State {
        let (basis, places) = (&self.basis, self.places());
        let temperature = x[places.temperature()];
        let mut state = State::default();
        self.constants(temperature, &mut state);
        let count = basis.of.len();
        state.coefficients = (0..count).map(|i| self.coefficient(i, (x[places.strength()], temperature))).collect();
        state.amounts = vec![0.0; count];
        for &i in &basis.solutes {
            let molality = self.activity(i, &state, x) - state.coefficients[i].ln;
            state.amounts[i] = math::exp(molality + x[places.solvent()]);
        }
        state.amounts[basis.water] = math::exp(x[places.solvent()]) / self.system.written.solvent_mass;
        self.balances(&mut state, totals);
        self.energy(&mut state, temperature);
        let charge = |i: &usize| self.system.members()[*i].charge;
        let charges: f64 = basis.solutes.iter().map(|i| 0.5 * charge(i) * charge(i) * state.amounts[*i]).sum();
        state.charges = charges + self.args[self.layout.bystanders()];
        let dissolved: f64 = basis.solutes.iter().map(|i| state.amounts[*i]).sum();
        state.dissolved = dissolved + self.args[self.layout.bystander_amount()];
        for (place, sum) in self.sums(&state) {
            let per_mass = self.per_mass(sum, &state);
            state.residuals.push((x[place] - per_mass) / (per_mass + NO_IONS));
        }
        state.residuals.push(self.energy_residual(&state));
        state
    }

    /// The logarithm of the activity of a dissolved member; how far a solid is above its constant.
    pub(super) fn activity(&self, member: usize, state: &State, x: &[f64]) -> f64 {
        let solvent = self.dryness(member) * x[self.places().molality()];
        state.constants[member] + self.masters_of(member).map(|(c, of)| of * x[c]).sum::<f64>() + solvent
    }

    /// How much the logarithm of the activity of a member grows with the molality of all that is dissolved, as the solvent in it has less.
    pub(super) fn dryness(&self, member: usize) -> f64 {
        -self.activities.lowering * self.basis.solvent[member]
    }

    /// Constants, enthalpies and heat capacities of formation.
    fn constants(&self, temperature: f64, state: &mut State) {
        let (basis, layout) = (&self.basis, self.layout);
        let equations = 0..self.system.written.equations.len();
        let (terms, rises) = (terms(temperature), rises(temperature));
        let sum_of = |r: usize, by: &[f64]| {
            let of = &self.args[layout.constant(r)..layout.constant(r + 1)];
            of.iter().zip(by).map(|(of, by)| of * by).sum::<f64>()
        };
        let constants: Vec<f64> = equations.clone().map(|r| sum_of(r, &terms)).collect();
        let steepness: Vec<f64> = equations.clone().map(|r| sum_of(r, &rises)).collect();
        let enthalpies: Vec<f64> = equations.map(|r| self.args[layout.enthalpy(r)]).collect();
        let sum = |by: &[(usize, f64)], of: &[f64]| by.iter().map(|(r, by)| by * of[*r]).sum::<f64>();
        state.constants = basis.by.iter().map(|by| sum(by, &constants)).collect();
        state.rises = basis.by.iter().map(|by| sum(by, &steepness)).collect();
        state.enthalpies = basis.by.iter().map(|by| sum(by, &enthalpies)).collect();
        let capacity = |i: usize| self.args[layout.capacity_of(i)];
        let takes = |i: usize| {
            let masters: f64 = self.masters_of(i).map(|(c, of)| of * capacity(basis.masters[c])).sum();
            let held: f64 = basis.of_held[i].iter().zip(&basis.held).map(|(of, s)| of * capacity(*s)).sum();
            capacity(i) - masters - held - basis.solvent[i] * capacity(basis.water)
        };
        state.capacities = (0..basis.of.len()).map(takes).collect();
    }

    fn coefficient(&self, member: usize, around: (f64, f64)) -> Coefficient {
        let charge = self.system.members()[member].charge;
        self.coefficients(member).coefficient(&self.activities, charge, around)
    }

    pub(super) fn coefficients(&self, member: usize) -> Coefficients {
        Coefficients::of(self.args, self.layout, member)
    }

    /// What makes up each total, and that of the solvent.
    fn balances(&self, state: &mut State, totals: &Totals) {
        let side = |total: &f64| [(-total).max(0.0), total.max(0.0)];
        state.sides = totals.of.iter().map(side).collect();
        for (parts, amount) in self.basis.parts.iter().zip(&state.amounts) {
            for (row, of) in parts {
                state.sides[*row][usize::from(*of < 0.0)] += (of * amount).abs();
            }
        }
        state.residuals = state.sides.iter().map(|sides| ratio(*sides)).collect();
    }

    fn energy(&self, state: &mut State, temperature: f64) {
        state.warmer = temperature - self.reference();
        state.capacity = if self.is_isothermal() { 0.0 } else { self.args[self.layout.capacity()] };
        for (i, amount) in state.amounts.iter().enumerate() {
            let formed = amount - self.given(i);
            state.heat += state.enthalpies[i] * formed;
            state.capacity += state.capacities[i] * formed;
        }
    }

    fn energy_residual(&self, state: &State) -> f64 {
        if self.is_isothermal() {
            return state.warmer;
        }
        (self.args[self.layout.heat()] - state.heat - state.capacity * state.warmer) / self.energy_scale()
    }

    /// How conditions move with the unknowns.
    fn jacobian(&self, state: &State) -> Matrix {
        let places = self.places();
        let mut matrix = Matrix::new(places.count());
        for &i in &self.basis.solutes {
            let amount = state.amounts[i];
            let warmth = state.rises[i] - state.coefficients[i].by_warmth;
            let others = [
                (places.solvent(), 1.0),
                (places.strength(), -state.coefficients[i].by_strength),
                (places.molality(), self.dryness(i)),
                (places.temperature(), warmth),
            ];
            self.each_row(i, state, |row, share| {
                for (column, by) in self.masters_of(i).chain(others) {
                    *matrix.at(row, column) += share * amount * by;
                }
            });
        }
        let water = self.basis.water;
        self.each_row(water, state, |row, share| *matrix.at(row, places.solvent()) += share * state.amounts[water]);
        for (row, sum) in self.sums(state) {
            let per_mass = self.per_mass(sum, state);
            *matrix.at(row, row) += 1.0 / (per_mass + NO_IONS);
            *matrix.at(row, places.solvent()) += per_mass / (per_mass + NO_IONS);
        }
        let by_warmth = if self.is_isothermal() { 1.0 } else { -state.capacity / self.energy_scale() };
        *matrix.at(places.temperature(), places.temperature()) += by_warmth;
        matrix
    }

    /// What the ionic strength and the molality of all are made of, by their unknowns: mol.
    fn sums(&self, state: &State) -> [(usize, f64); 2] {
        [(self.places().strength(), state.charges), (self.places().molality(), state.dissolved)]
    }

    /// So much per mass of solvent, mol/kg.
    fn per_mass(&self, amount: f64, state: &State) -> f64 {
        amount / (state.amounts[self.basis.water] * self.system.written.solvent_mass)
    }

    /// How much the molality of such an amount should grow with it, as a share of itself.
    pub(super) fn by_amount(&self, amount: f64, state: &State) -> f64 {
        self.per_mass(1.0, state) / (self.per_mass(amount, state) + NO_IONS)
    }

    /// The conditions that move with the amount of a member, and by how much.
    fn each_row(&self, member: usize, state: &State, mut visit: impl FnMut(usize, f64)) {
        let places = self.places();
        for (row, of) in &self.basis.parts[member] {
            visit(*row, of / state.sides[*row][usize::from(*of < 0.0)]);
        }
        let Member { charge, phase, .. } = self.system.members()[member];
        if phase == Phase::Solute {
            visit(places.strength(), -0.5 * charge * charge * self.by_amount(state.charges, state));
            visit(places.molality(), -self.by_amount(state.dissolved, state));
        }
        if !self.is_isothermal() {
            let heat = state.enthalpies[member] + state.capacities[member] * state.warmer;
            visit(places.temperature(), -heat / self.energy_scale());
        }
    }

    /// How much the amount of a member that is no solid grows where the unknowns do.
    pub(super) fn growth(&self, step: &[f64], point: &Point, member: usize) -> f64 {
        let (places, state) = (self.places(), &point.state);
        let amount = state.amounts[member];
        match self.system.members()[member].phase {
            Phase::Solvent => amount * step[places.solvent()],
            Phase::Solid => 0.0,
            Phase::Solute => {
                let formed: f64 = self.masters_of(member).map(|(c, of)| of * step[c]).sum();
                let Coefficient { by_strength, by_warmth, .. } = state.coefficients[member];
                let rise = state.rises[member] - by_warmth;
                let by_solvent = self.dryness(member) * step[places.molality()];
                let by_others = rise * step[places.temperature()] - by_strength * step[places.strength()] + by_solvent;
                amount * (formed + step[places.solvent()] + by_others)
            }
        }
    }

    /// How conditions move where the logarithms of amounts of dissolved members grow so, all else the same.
    pub(super) fn moved(&self, grown: &[f64], point: &Point) -> Vec<f64> {
        let mut rows = vec![0.0; point.x.len()];
        for &i in &self.basis.solutes {
            let growth = grown[i] * point.state.amounts[i];
            if growth != 0.0 {
                self.each_row(i, &point.state, |row, share| rows[row] += share * growth);
            }
        }
        rows
    }

    /// Brings each total near what it should be, one at a time: its master grows by the ratio, to the power that makes the least of its
    /// members follow.
    fn approach(&self, x: &mut [f64], totals: &Totals) {
        let least: Vec<f64> = (0..self.basis.masters.len()).map(|c| self.least_part(c)).collect();
        for _ in 0..MOST_FRACTIONS {
            let state = self.state(x, totals);
            let mut furthest = 0.0_f64;
            for (c, least) in least.iter().enumerate() {
                let [sum, wanted] = state.sides[c];
                let off = math::ln(wanted / sum);
                if !off.is_finite() {
                    return;
                }
                furthest = furthest.max(off.abs());
                // The further off it is, the bolder.
                let bold = 0.9 - 0.8 * math::exp(-off.abs());
                x[c] += math::ln(bold * math::exp((off / least).min(500.0)) + 1.0 - bold);
            }
            if furthest < FAR {
                return;
            }
        }
    }

    /// The least of a master that a member has.
    fn least_part(&self, c: usize) -> f64 {
        let parts = self.basis.of.iter().map(|of| of[c]).filter(|part| *part > 0.0);
        parts.fold(f64::INFINITY, f64::min)
    }

    /// Newton's method; the unknowns and what follows from them. Far from the solution activity coefficients stay as they are while the
    /// rest moves, and then follow: what they would be along the way is of no use.
    fn newton(&self, mut x: Vec<f64>, totals: &Totals) -> Option<(Vec<f64>, State)> {
        let mut best: Option<(f64, Vec<f64>, State)> = None;
        let mut idle = 0;
        let mut state = self.state(&x, totals);
        if largest(&state.residuals[..self.basis.masters.len()]) > FAR {
            self.approach(&mut x, totals);
            state = self.state(&x, totals);
        }
        for count in 0..MOST_STEPS {
            let off = largest(&state.residuals);
            if !off.is_finite() {
                break;
            }
            let is_near = off < NEAR && idle < PATIENCE || off < VERY_NEAR;
            let mut right: Vec<f64> = state.residuals.iter().map(|r| -r).collect();
            let mut matrix = self.jacobian(&state);
            if !is_near {
                let places = self.places();
                for row in [places.strength(), places.molality(), places.temperature()] {
                    (0..matrix.size).for_each(|column| *matrix.at(row, column) = f64::from(u8::from(column == row)));
                    right[row] = 0.0;
                }
            }
            let step = matrix.factor()?.solve(&right);
            let follows = (!is_near && largest(&right) < 1.0).then(|| self.surroundings(&state));
            idle += 1;
            if best.as_ref().is_none_or(|(least, ..)| off < *least) {
                idle = 0;
                best = Some((off, x.clone(), state));
            }
            if off <= CLOSE || (idle > 1 && best.as_ref().is_some_and(|(least, ..)| *least <= MET)) {
                break;
            }
            self.step(&mut x, &step, LONGEST / (1.0 + count as f64 / 12.0));
            if let Some((sums, temperature)) = follows {
                // What swings is held the more firmly the longer it does.
                let share = 0.5 / (1.0 + count as f64 / 20.0);
                for (place, sum) in sums {
                    let shifted = x[place] + NO_IONS;
                    x[place] = shifted * math::pow((sum + NO_IONS) / shifted, share) - NO_IONS;
                }
                let known = &mut x[self.places().temperature()];
                let limits = (TEMPERATURES.0.max(*known - WARMEST_STEP), TEMPERATURES.1.min(*known + WARMEST_STEP));
                *known = (*known + share * (temperature - *known)).clamp(limits.0, limits.1);
            }
            state = self.state(&x, totals);
        }
        best.filter(|(off, ..)| *off <= MET).map(|(_, x, state)| (x, state))
    }

    /// The ionic strength, the molality of all and the temperature that amounts make.
    fn surroundings(&self, state: &State) -> ([(usize, f64); 2], f64) {
        let warmer = if self.is_isothermal() { 0.0 } else { state.heated(self) };
        let sums = self.sums(state).map(|(place, sum)| (place, self.per_mass(sum, state)));
        (sums, self.reference() + warmer)
    }

    fn step(&self, x: &mut [f64], step: &[f64], most: f64) {
        let places = self.places();
        let longest = step[..=places.solvent()].iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        let warmest = step[places.temperature()].abs();
        let share = 1.0_f64.min(most / longest).min(WARMEST_STEP / warmest);
        let sums = [places.strength(), places.molality()];
        let before = sums.map(|place| x[place]);
        x.iter_mut().zip(step).for_each(|(x, step)| *x += share * step);
        sums.iter().zip(before).for_each(|(place, before)| x[*place] = x[*place].max(0.1 * before));
        let temperature = &mut x[places.temperature()];
        *temperature = temperature.clamp(TEMPERATURES.0, TEMPERATURES.1);
    }

    /// How much there is of each solid: what its total holds beyond what is dissolved.
    fn solids(&self, state: &State, totals: &Totals) -> Vec<f64> {
        let dissolved = |k: usize| -> f64 {
            let all = state.amounts.iter().zip(&self.basis.of_held);
            all.map(|(amount, of)| amount * of[k]).sum()
        };
        totals.held.iter().enumerate().map(|(k, total)| total - dissolved(k)).collect()
    }
}

impl State {
    /// How far above the reference temperature the heat that is there brings it.
    fn heated(&self, problem: &Problem<'_>) -> f64 {
        (problem.args[problem.layout.heat()] - self.heat) / self.capacity
    }
}

/// What the terms of ln K are multiples of, at a temperature in K.
pub fn terms(t: f64) -> [f64; Layout::TERMS] {
    [1.0, 1.0 / t, math::ln(t), t, 1.0 / (t * t), t * t]
}

/// How these grow with temperature, 1/K each.
pub fn rises(t: f64) -> [f64; Layout::TERMS] {
    [0.0, -1.0 / (t * t), 1.0 / t, 1.0, -2.0 / (t * t * t), 2.0 * t]
}

/// The solution of a system for its arguments.
pub(super) fn solve(system: &System, args: &[f64]) -> Option<Solution> {
    if args.len() != system.layout().count() || args.iter().any(|v| v.is_nan()) {
        return None;
    }
    let free = Problem::new(system, args, system.basis.clone());
    let lacking = free.lacking();
    let totals = free.totals(&lacking);
    // What could become solvent is none: dry hydroxide holds no water to be dissolved in.
    if totals.solvent() <= 0.0 || free.given(system.basis.water) <= 0.0 {
        return Some(free.as_given());
    }
    let mut given: Vec<usize> = Vec::new();
    for &solid in &system.basis.solids {
        if free.given(solid) > 0.0 && free.may_be(solid, &lacking) && free.made_of(solid, &given).is_none() {
            given.push(solid);
        }
    }
    let start = free.start(&totals);
    let found = follow(&free, &start, &lacking, given);
    let found = found.or_else(|| follow(&free, &start, &lacking, Vec::new()));
    found.or_else(|| by_temperature(&free, start, &lacking))
}

/// The solution where the heat content and the rest are hard to meet at once: the temperature is bracketed, as a heat content grows with
/// it, and then all goes on from there.
fn by_temperature(free: &Problem<'_>, mut start: Vec<f64>, lacking: &[f64]) -> Option<Solution> {
    if free.is_isothermal() {
        return None;
    }
    let layout = free.layout;
    let mut args = free.args.to_vec();
    (args[layout.capacity()], args[layout.heat()]) = (f64::INFINITY, 0.0);
    let (mut low, mut high) = TEMPERATURES;
    let mut last = None;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        args[layout.reference()] = middle;
        let solution = solve(free.system, &args)?;
        let capacity = free.args[layout.capacity()] + solution.capacity;
        let holds = solution.heat + capacity * (middle - free.reference());
        if holds < free.args[layout.heat()] {
            low = middle
        } else {
            high = middle
        }
        last = Some(solution);
    }
    let Solution { activities, point: Some(point), .. } = last? else { return None };
    let masters = free.basis.masters.len();
    free.basis.masters.iter().enumerate().for_each(|(c, i)| start[c] = activities[*i]);
    start[masters..].copy_from_slice(&point.x[point.basis.masters.len()..]);
    follow(free, &start, lacking, point.basis.held.clone())
}

/// Lets solids come and go until none has to.
fn follow(free: &Problem<'_>, start: &[f64], lacking: &[f64], mut held: Vec<usize>) -> Option<Solution> {
    let (system, args) = (free.system, free.args);
    let solids = &system.basis.solids;
    let mut known: Vec<f64> = vec![0.0; system.members().len()];
    for (c, i) in system.basis.masters.iter().enumerate() {
        known[*i] = start[c];
    }
    let mut others = start[system.basis.masters.len()..].to_vec();
    for _ in 0..4 * solids.len() + 4 {
        let seek = |replaced: &[usize]| {
            let problem = Problem::new(system, args, memo::basis(system, &held, replaced)?);
            let totals = problem.totals(lacking);
            let begin = problem.basis.masters.iter().map(|i| known[*i]).chain(others.iter().copied()).collect();
            problem.newton(begin, &totals).map(|(x, state)| (problem, totals, x, state))
        };
        let (problem, totals, x, state) = seek(&free.scarcest(&held))?;
        for &i in &problem.basis.solutes {
            known[i] = problem.activity(i, &state, &x);
        }
        others = x[problem.basis.masters.len()..].to_vec();
        let amounts = problem.solids(&state, &totals);
        let change = change(free, &problem, (&x, &state), (&amounts, lacking));
        match change {
            None => return finish(&problem, x, (state, totals), (&amounts, lacking)),
            Some(Change::Leaves(k)) => _ = held.remove(k),
            Some(Change::Comes(solid)) => {
                if let Some(shares) = Some(&held).filter(|h| !h.is_empty()).and_then(|h| free.made_of(solid, h)) {
                    // It takes the place of the one that is used up first as it forms.
                    let lasts = |k: &usize| amounts[*k] / shares[*k];
                    let first = (0..held.len()).filter(|k| shares[*k] > 1e-9);
                    held.remove(first.min_by(|a, b| lasts(a).total_cmp(&lasts(b)))?);
                }
                held.push(solid);
            }
        }
    }
    None
}

/// The solid that leaves, or the one that comes.
fn change(
    free: &Problem<'_>,
    problem: &Problem<'_>,
    (x, state): (&[f64], &State),
    (amounts, lacking): (&[f64], &[f64]),
) -> Option<Change> {
    let below = (0..amounts.len()).filter(|k| amounts[*k] < 0.0);
    if let Some(k) = below.min_by(|a, b| amounts[*a].total_cmp(&amounts[*b])) {
        return Some(Change::Leaves(k));
    }
    let above = |s: &usize| problem.activity(*s, state, x);
    let absent = problem.basis.solids.iter().copied();
    let absent = absent.filter(|s| !problem.basis.held.contains(s) && free.may_be(*s, lacking));
    let most = absent.filter(|s| above(s) > SATURATED).max_by(|a, b| above(a).total_cmp(&above(b)));
    most.map(Change::Comes)
}

fn finish(
    problem: &Problem<'_>,
    x: Vec<f64>,
    (state, totals): (State, Totals),
    (solids, lacking): (&[f64], &[f64]),
) -> Option<Solution> {
    let (basis, places) = (problem.basis.clone(), problem.places());
    let factors = problem.jacobian(&state).factor()?;
    let mut activities = vec![0.0; basis.of.len()];
    for i in basis.solutes.iter().chain(&basis.solids).chain([&basis.water]) {
        activities[*i] = problem.activity(*i, &state, &x);
    }
    let mut amounts = state.amounts.clone();
    basis.held.iter().zip(solids).for_each(|(i, amount)| amounts[*i] = *amount);
    let formed = |i: usize| state.capacities[i] * (state.amounts[i] - problem.given(i));
    let mut solution = Solution {
        activities,
        temperature: x[places.temperature()],
        strength: x[places.strength()],
        heat: state.heat,
        capacity: (0..basis.of.len()).map(formed).sum(),
        amounts,
        point: None,
    };
    let point = Point { basis, x, totals, state, factors };
    reach_down(problem, &mut solution, &point, lacking);
    solution.point = Some(point);
    Some(solution)
}

/// Follows what there is none of, or less, linearly from its trace.
fn reach_down(problem: &Problem<'_>, solution: &mut Solution, point: &Point, lacking: &[f64]) {
    if lacking.iter().all(|l| *l == 0.0) {
        return;
    }
    let mut right = vec![0.0; point.x.len()];
    for (i, lacking) in lacking.iter().enumerate().filter(|(_, l)| **l != 0.0) {
        for (row, part) in &problem.basis.parts[i] {
            right[*row] += part * lacking / point.state.sides[*row][usize::from(point.totals.of[*row] >= 0.0)];
        }
    }
    let step = point.factors.solve(&right);
    let free = &problem.system.basis;
    let is_none = |c: &usize| {
        let total: f64 = (0..free.of.len()).map(|i| free.of[i][*c] * problem.given(i)).sum();
        lacking[free.masters[*c]] != 0.0 && total == 0.0
    };
    let none: Vec<usize> = (0..free.masters.len()).filter(is_none).collect();
    for (i, amount) in solution.amounts.iter_mut().enumerate() {
        let is_absent = none.iter().any(|c| free.of[i][*c] != 0.0);
        *amount = if is_absent { 0.0 } else { *amount + problem.growth(&step, point, i) };
    }
}

enum Change {
    Leaves(usize),
    Comes(usize),
}

/// The largest magnitude; not a number where one is none.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |most, v| if v.is_nan() { f64::NAN } else { most.max(v.abs()) })
}

/// The logarithm of the ratio of two sides.
fn ratio([sum, wanted]: [f64; 2]) -> f64 {
    let off = (sum - wanted) / wanted;
    if off.abs() < 1e-3 {
        return off * (1.0 - off * (0.5 - off * (1.0 / 3.0 - off * (0.25 - off * (0.2 - off / 6.0)))));
    }
    math::ln(sum / wanted)
}
