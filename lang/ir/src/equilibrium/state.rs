//! What follows from the unknowns: constants, amounts, and how far each condition is from being met.

use super::activity::{Around, Coefficient, Coefficients};
use super::linear::Matrix;
use super::pitzer::{Effects, Turn, Virial};
use super::problem::{Problem, Totals};
use super::{Layout, Phase, rises, terms};
use crate::math;

/// Ions per mass of solvent that do not matter, mol/kg.
pub(super) const NO_IONS: f64 = 1e-12;

/// What follows from the unknowns.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// For which temperature the constants are, K.
    warmth: f64,
    /// By member: ln K of its formation, and how much that grows with temperature.
    pub(super) constants: Vec<f64>,
    pub(super) rises: Vec<f64>,
    /// By member: enthalpy of its formation, J/mol, and the heat capacity that it takes, J/(mol*K).
    pub(super) enthalpies: Vec<f64>,
    pub(super) capacities: Vec<f64>,
    /// The laws that coefficients follow, each with a charge, and by solute which of them: most members share a few.
    laws: Vec<(Coefficients, f64)>,
    law_of: Vec<usize>,
    /// By law, and by member.
    by_law: Vec<Coefficient>,
    pub(super) coefficients: Vec<Coefficient>,
    /// Numbers of interactions, and how much they grow with temperature.
    pub(super) numbers: Vec<f64>,
    number_rises: Vec<f64>,
    /// What interactions make of coefficients and of the activity of the solvent, and how that grows with temperature.
    pub(super) effects: Effects,
    pub(super) warming: Turn,
    /// By member: mol.
    pub(super) amounts: Vec<f64>,
    /// By row: what adds to a total, and what it should be; and 1 over each.
    pub(super) sides: Vec<[f64; 2]>,
    inverse: Vec<[f64; 2]>,
    /// Heat capacity, J/K, and the heat that forming took, J.
    pub(super) capacity: f64,
    pub(super) heat: f64,
    /// How far it is above the reference temperature, K.
    pub(super) warmer: f64,
    /// Half the sum of amount times charge squared, mol.
    pub(super) charges: f64,
    /// All that is dissolved, mol.
    pub(super) dissolved: f64,
    /// How much the conditions of both grow with each mol of them.
    pub(super) by_charges: f64,
    pub(super) by_dissolved: f64,
    /// The same of each placed member.
    by_placed: Vec<f64>,
    /// How far each condition is from being met.
    pub(super) residuals: Vec<f64>,
}

impl Problem<'_> {
    /// What follows from the unknowns, in place of what there was.
    pub(super) fn evaluate(&self, x: &[f64], totals: &Totals, state: &mut State) {
        let (basis, places) = (&self.basis, self.places());
        let temperature = x[places.temperature()];
        let count = basis.of.len();
        if state.constants.len() != count || state.warmth != temperature {
            self.constants(temperature, state);
        }
        let around = self.activities.around(x[places.strength()], temperature);
        state.coefficients.clear();
        state.coefficients.resize(count, Coefficient::default());
        state.amounts.clear();
        state.amounts.resize(count, 0.0);
        let virial = self.system.virial.as_deref();
        match virial {
            Some(virial) => self.interact(virial, &around, x, state),
            None => self.by_laws(&around, state),
        }
        let (mut charges, mut dissolved) = (0.0, 0.0);
        for (place, &i) in basis.solutes.iter().enumerate() {
            let charge = basis.charges[i];
            let coefficient = match virial {
                Some(virial) => virial.place(i).map_or_else(Coefficient::default, |k| state.interacting(k)),
                None => state.by_law[state.law_of[place]],
            };
            let activity = self.activity(i, state, x);
            if let Some(mass) = self.liquid(i) {
                state.amounts[i] = mass * math::exp(activity);
                continue;
            }
            let amount = math::exp(activity - coefficient.ln + x[places.solvent()]);
            state.coefficients[i] = coefficient;
            state.amounts[i] = amount;
            charges += 0.5 * charge * charge * amount;
            dissolved += amount;
        }
        state.charges = charges + self.beside(self.layout.bystanders());
        state.dissolved = dissolved + self.beside(self.layout.bystander_amount());
        state.amounts[basis.water] = math::exp(x[places.solvent()]) / self.system.written.solvent_mass;
        [state.by_charges, state.by_dissolved] = [state.charges, state.dissolved].map(|sum| self.by_amount(sum, state));
        state.by_placed.clear();
        for i in self.placed() {
            state.by_placed.push(self.by_amount(state.amounts[*i], state));
        }
        self.balances(state, totals);
        self.energy(state, temperature);
        for place in places.sums() {
            let per_mass = self.per_mass(self.sum(place, state), state);
            state.residuals.push((x[place] - per_mass) / (per_mass + NO_IONS));
        }
        state.residuals.push(self.energy_residual(state));
    }

    /// What the laws make of coefficients at an ionic strength.
    fn by_laws(&self, around: &Around, state: &mut State) {
        let State { laws, law_of, by_law, .. } = state;
        if laws.is_empty() {
            for &i in &self.basis.solutes {
                let law = (self.coefficients(i), self.basis.charges[i]);
                law_of.push(laws.iter().position(|known| *known == law).unwrap_or(laws.len()));
                if law_of.last() == Some(&laws.len()) {
                    laws.push(law);
                }
            }
        }
        by_law.clear();
        by_law.extend(laws.iter().map(|(law, charge)| law.coefficient(around, *charge)));
    }

    /// What interactions make of coefficients.
    fn interact(&self, virial: &Virial, around: &Around, x: &[f64], state: &mut State) {
        let at = virial.at(around.a, &x[self.places().placed()]);
        virial.effects(at, &state.numbers, &mut state.effects);
        state.warming = virial.turn(at, &state.number_rises, around.rises[0]);
    }

    /// The logarithm of the activity of a dissolved member; how far a solid is above its constant.
    pub(super) fn activity(&self, member: usize, state: &State, x: &[f64]) -> f64 {
        let solvent = self.dryness(member) * (x[self.places().molality()] + state.effects.osmotic);
        state.constants[member] + self.masters_of(member).iter().map(|(c, of)| of * x[*c]).sum::<f64>() + solvent
    }

    /// How much the logarithm of the activity of a member grows with the molality of all that is dissolved, as the solvent in it has less.
    pub(super) fn dryness(&self, member: usize) -> f64 {
        -self.activities.lowering * self.basis.solvent[member]
    }

    /// Constants, enthalpies and heat capacities of formation.
    fn constants(&self, temperature: f64, state: &mut State) {
        let (basis, layout) = (&self.basis, self.layout);
        let equations = self.system.written.equations.len();
        let (terms, rises) = (terms(temperature), rises(temperature));
        let sum_of = |r: usize, by: &[f64]| {
            let of = &self.args[layout.constant(r)..layout.constant(r + 1)];
            of.iter().zip(by).map(|(of, by)| of * by).sum::<f64>()
        };
        let each: Vec<[f64; 3]> =
            (0..equations).map(|r| [sum_of(r, &terms), sum_of(r, &rises), self.args[layout.enthalpy(r)]]).collect();
        let sum = |by: &[(usize, f64)], which: usize| by.iter().map(|(r, by)| by * each[*r][which]).sum::<f64>();
        let all = |which: usize, to: &mut Vec<f64>| {
            to.clear();
            to.extend(basis.by.iter().map(|by| sum(by, which)));
        };
        let numbers = |by: &[f64], to: &mut Vec<f64>| {
            let of = &self.args[layout.interaction(0)..layout.coefficients(0)];
            to.clear();
            to.extend(of.chunks(Layout::TERMS).map(|of| of.iter().zip(by).map(|(of, by)| of * by).sum::<f64>()));
        };
        numbers(&terms, &mut state.numbers);
        numbers(&rises, &mut state.number_rises);
        all(0, &mut state.constants);
        if let Some(k) = basis.held.iter().position(|i| basis.formal.contains(i)) {
            state.constants.iter_mut().zip(&basis.of_held).for_each(|(constant, of)| *constant += of[k] * self.limit);
        }
        all(1, &mut state.rises);
        all(2, &mut state.enthalpies);
        let capacity = |i: usize| self.args[layout.capacity_of(i)];
        let takes = |i: usize| {
            let masters: f64 = self.masters_of(i).iter().map(|(c, of)| of * capacity(basis.masters[*c])).sum();
            let held: f64 = basis.of_held[i].iter().zip(&basis.held).map(|(of, s)| of * capacity(*s)).sum();
            capacity(i) - masters - held - basis.solvent[i] * capacity(basis.water)
        };
        state.capacities.clear();
        state.capacities.extend((0..basis.of.len()).map(takes));
        state.warmth = temperature;
    }

    /// What makes up each total, and that of the solvent.
    fn balances(&self, state: &mut State, totals: &Totals) {
        let side = |total: &f64| [(-total).max(0.0), total.max(0.0)];
        state.sides.clear();
        state.sides.extend(totals.of.iter().map(side));
        for (parts, amount) in self.basis.parts.rows().zip(&state.amounts) {
            for (row, of) in parts {
                state.sides[*row][usize::from(*of < 0.0)] += (of * amount).abs();
            }
        }
        state.inverse.clear();
        state.inverse.extend(state.sides.iter().map(|[a, b]| [1.0 / a, 1.0 / b]));
        state.residuals.clear();
        state.residuals.extend(state.sides.iter().map(|sides| ratio(*sides)));
    }

    fn energy(&self, state: &mut State, temperature: f64) {
        state.warmer = temperature - self.reference();
        state.heat = 0.0;
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

    /// How conditions move with the unknowns, as many of them as are free.
    pub(super) fn jacobian(&self, state: &State, free: usize, matrix: &mut Matrix) {
        let (basis, places) = (&*self.basis, self.places());
        matrix.clear(free);
        // How an amount moves with what follows the masters; those that are not free are cut off.
        let mut tail = vec![0.0; free - basis.masters.len()];
        for &i in &basis.solutes {
            let (amount, parts) = (state.amounts[i], basis.masters_of.row(i));
            let by = self.amount_by(i, state);
            tail.iter_mut().zip(&by[..3]).for_each(|(to, by)| *to = *by);
            if places.strength() < free {
                if !places.placed().is_empty() {
                    let by_placed = self.by_placed(i, state);
                    places.placed().enumerate().for_each(|(j, at)| tail[at - basis.masters.len()] = by_placed.of(j));
                }
                if places.temperature() < free {
                    tail[places.temperature() - basis.masters.len()] = by[3];
                }
            }
            self.each_row(i, state, free, |row, share| {
                let (row, share) = (matrix.row_mut(row), share * amount);
                parts.iter().for_each(|(column, of)| row[*column] += share * of);
                row[basis.masters.len()..].iter_mut().zip(&tail).for_each(|(to, by)| *to += share * by);
            });
        }
        let amount = state.amounts[basis.water];
        self.each_row(basis.water, state, free, |row, share| *matrix.at(row, places.solvent()) += share * amount);
        for row in places.sums().filter(|row| *row < free) {
            let per_mass = self.per_mass(self.sum(row, state), state);
            *matrix.at(row, row) += 1.0 / (per_mass + NO_IONS);
            *matrix.at(row, places.solvent()) += per_mass / (per_mass + NO_IONS);
        }
        if places.temperature() < free {
            let by_warmth = if self.is_isothermal() { 1.0 } else { -state.capacity / self.energy_scale() };
            *matrix.at(places.temperature(), places.temperature()) += by_warmth;
        }
    }

    /// How the logarithm of the activity of a member moves with the solvent, the ionic strength, the molality of all, and the temperature.
    fn activity_by(&self, member: usize, state: &State) -> [f64; 4] {
        let dryness = self.dryness(member);
        [0.0, 0.0, dryness, state.rises[member] + dryness * state.warming.osmotic]
    }

    /// The same of the amount of a dissolved member.
    fn amount_by(&self, member: usize, state: &State) -> [f64; 4] {
        let (by, of) = (self.activity_by(member, state), &state.coefficients[member]);
        if self.system.members()[member].phase == Phase::Extracted {
            return by;
        }
        let [solvent, strength, molality, warmth] = by;
        [solvent + 1.0, strength - of.by_strength, molality, warmth - of.by_warmth]
    }

    /// How it moves with the molality of each placed member.
    fn by_placed<'s>(&self, member: usize, state: &'s State) -> ByPlaced<'s> {
        let place = self.system.virial.as_ref().and_then(|virial| virial.place(member));
        let own = place.map_or(&[][..], |k| state.effects.by.row(k));
        ByPlaced { own, solvent: &state.effects.osmotic_by, dryness: self.dryness(member) }
    }

    /// How much the logarithm of the activity of a member grows where the unknowns do.
    pub(super) fn raise(&self, step: &[f64], state: &State, member: usize) -> f64 {
        let solvent = ByPlaced { own: &[], ..self.by_placed(member, state) };
        self.along(step, member, self.activity_by(member, state), &solvent)
    }

    fn along(&self, step: &[f64], member: usize, by: [f64; 4], by_placed: &ByPlaced<'_>) -> f64 {
        let places = self.places();
        let formed: f64 = self.masters_of(member).iter().map(|(c, of)| of * step[*c]).sum();
        let placed: f64 = step[places.placed()].iter().enumerate().map(|(j, step)| by_placed.of(j) * step).sum();
        let others = [places.solvent(), places.strength(), places.molality(), places.temperature()];
        formed + placed + others.iter().zip(by).map(|(place, by)| by * step[*place]).sum::<f64>()
    }

    /// What an unknown is made of that sums amounts up: mol.
    pub(super) fn sum(&self, place: usize, state: &State) -> f64 {
        match place - self.places().strength() {
            0 => state.charges,
            1 => state.dissolved,
            k => state.amounts[self.placed()[k - 2]],
        }
    }

    /// So much per mass of solvent, mol/kg.
    pub(super) fn per_mass(&self, amount: f64, state: &State) -> f64 {
        amount / (state.amounts[self.basis.water] * self.system.written.solvent_mass)
    }

    /// How much the molality of such an amount should grow with it, as a share of itself.
    fn by_amount(&self, amount: f64, state: &State) -> f64 {
        self.per_mass(1.0, state) / (self.per_mass(amount, state) + NO_IONS)
    }

    /// The conditions that move with the amount of a member that is dissolved, or of the solvent, of the first ones that are free, and by how much.
    fn each_row(&self, member: usize, state: &State, free: usize, mut visit: impl FnMut(usize, f64)) {
        let places = self.places();
        for (row, of) in self.basis.parts.row(member) {
            visit(*row, of * state.inverse[*row][usize::from(*of < 0.0)]);
        }
        let is_solute = self.system.members()[member].phase == Phase::Solute;
        if is_solute && places.strength() < free {
            let charge = self.basis.charges[member];
            if charge != 0.0 {
                visit(places.strength(), -0.5 * charge * charge * state.by_charges);
            }
            visit(places.molality(), -state.by_dissolved);
            if let Some(k) = self.system.virial.as_ref().and_then(|virial| virial.place(member)) {
                visit(places.placed().start + k, -state.by_placed[k]);
            }
        }
        if !self.is_isothermal() && places.temperature() < free {
            let heat = state.enthalpies[member] + state.capacities[member] * state.warmer;
            visit(places.temperature(), -heat / self.energy_scale());
        }
    }

    /// How much the amount of a member that is no solid grows where the unknowns do.
    pub(super) fn growth(&self, step: &[f64], state: &State, member: usize) -> f64 {
        let places = self.places();
        let amount = state.amounts[member];
        match self.system.members()[member].phase {
            Phase::Solvent => amount * step[places.solvent()],
            Phase::Solid | Phase::Formal => 0.0,
            Phase::Solute | Phase::Extracted => {
                amount * self.along(step, member, self.amount_by(member, state), &self.by_placed(member, state))
            }
        }
    }

    /// How conditions move where the logarithms of amounts of dissolved members grow so, all else the same.
    pub(super) fn moved(&self, grown: &[f64], state: &State) -> Vec<f64> {
        let count = self.places().count();
        let mut rows = vec![0.0; count];
        for &i in &self.basis.solutes {
            let growth = grown[i] * state.amounts[i];
            if growth != 0.0 {
                self.each_row(i, state, count, |row, share| rows[row] += share * growth);
            }
        }
        rows
    }

    /// The ionic strength, the molalities and the temperature that amounts make.
    pub(super) fn surroundings(&self, state: &State) -> (Vec<f64>, f64) {
        let warmer = if self.is_isothermal() { 0.0 } else { state.heated(self) };
        let sums = self.places().sums().map(|place| self.per_mass(self.sum(place, state), state)).collect();
        (sums, self.reference() + warmer)
    }

    /// How much there is of each solid: what its total holds beyond what is dissolved.
    pub(super) fn solids(&self, state: &State, totals: &Totals) -> Vec<f64> {
        let dissolved = |k: usize| -> f64 {
            let all = state.amounts.iter().zip(&self.basis.of_held);
            all.map(|(amount, of)| amount * of[k]).sum()
        };
        let is_formal = |k: usize| self.basis.formal.contains(&self.basis.held[k]);
        let amount = |(k, total): (usize, &f64)| if is_formal(k) { 0.0 } else { total - dissolved(k) };
        totals.held.iter().enumerate().map(amount).collect()
    }
}

/// How something moves with the molality of each placed member.
#[derive(Clone, Copy)]
struct ByPlaced<'s> {
    /// What a coefficient does, by placed member.
    own: &'s [f64],
    /// What the activity of the solvent does, of which there is so much in it.
    solvent: &'s [f64],
    dryness: f64,
}

impl ByPlaced<'_> {
    fn of(&self, place: usize) -> f64 {
        self.dryness * self.solvent[place] - self.own.get(place).copied().unwrap_or(0.0)
    }
}

impl State {
    /// The coefficient of a placed member.
    fn interacting(&self, k: usize) -> Coefficient {
        Coefficient { ln: self.effects.ln[k], by_strength: 0.0, by_warmth: self.warming.ln[k] }
    }

    /// How far above the reference temperature the heat that is there brings it.
    fn heated(&self, problem: &Problem<'_>) -> f64 {
        (problem.args[problem.layout.heat()] - self.heat) / self.capacity
    }
}

/// The logarithm of the ratio of two sides.
fn ratio([sum, wanted]: [f64; 2]) -> f64 {
    let off = (sum - wanted) / wanted;
    if off.abs() < 1e-3 {
        return off * (1.0 - off * (0.5 - off * (1.0 / 3.0 - off * (0.25 - off * (0.2 - off / 6.0)))));
    }
    math::ln(sum / wanted)
}
