//! Where totals, constants and the heat content are met, and which solids are there.
//!
//! Solids are there or not: those that came out below nothing leave, the one furthest above its constant comes, until neither is so. One
//! that is there is a master whose activity is 1, like the solvent; two other ways were compared. Its amount as an unknown among
//! logarithms makes Newton's method swing; a smooth form of "there or saturated" has slopes that are not those of the solution.

use std::sync::Arc;

use super::basis::Basis;
use super::formal::Begin;
use super::linear::Factors;
use super::problem::{Budget, Problem, TEMPERATURES, TRACE, Totals};
use super::state::State;
use super::{Layout, System, formal, memo};
use crate::math;

/// ln 10.
pub(super) const LN_10: f64 = std::f64::consts::LN_10;

/// The temperature at which constants and the coefficients of activity are given, where nothing else is said, K.
pub const STANDARD: f64 = 298.15;

/// What no equation changes is kept to this share of its largest part, or there is no solution.
const KEPT: f64 = 1e-9;

/// Steps of Newton's method that are taken for one solution at most. Most take 20, with half-cells 300; of 2,000 random mixtures with half-cells
/// 6 took more than 20,000.
const MOST_STEPS: u32 = 200_000;

/// How often a temperature is halved that is hard to find.
const HALVINGS: usize = 40;

/// So far apart are temperatures that are tried one after the other, K.
const WALK: f64 = 10.0;

/// What members that hold many of a master are first hindered by in the logarithm of their constants, and how fast that goes.
const HINDERED: f64 = 400.0;
const HINDERED_STEP: f64 = 50.0;
const LEAST_STEP: f64 = 0.01;

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
    /// The masters of the system of which there is none at all.
    pub(super) missing: Vec<usize>,
}

impl Point {
    /// Unknowns near these by another basis, of which the masters have these logarithms of activities.
    pub(super) fn unknowns(&self, masters: impl Iterator<Item = f64>) -> Vec<f64> {
        masters.chain(self.x[self.basis.masters.len()..].iter().copied()).collect()
    }

    /// How conditions move with the unknowns; none where that has no inverse.
    pub(super) fn factors(&self, problem: &Problem<'_>) -> Option<Factors> {
        let mut factors = problem.linear();
        problem.jacobian(&self.state, problem.places().count(), &mut factors.matrix);
        factors.factor().then_some(factors)
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

/// The solution of a system for its arguments. Where half-cells leave the potential open it is rounding that leads there or astray: what is
/// not found is sought once more with the linear system eliminated in another order.
pub(super) fn solve(system: &System, args: &[f64]) -> Option<Solution> {
    solve_within(system, args, &Budget::of(MOST_STEPS))
}

/// The same by what is left of a budget.
pub(super) fn solve_within(system: &System, args: &[f64], budget: &Budget) -> Option<Solution> {
    [false, true].into_iter().find_map(|as_numbered| solve_in_order(system, args, as_numbered, budget))
}

fn solve_in_order(system: &System, args: &[f64], as_numbered: bool, budget: &Budget) -> Option<Solution> {
    if args.len() != system.layout().count() || args.iter().any(|v| v.is_nan()) {
        return None;
    }
    let free = Problem { as_numbered, ..Problem::new(system, args, system.basis.clone(), budget) };
    let lacking = free.lacking();
    let totals = free.totals(&lacking);
    // What could become solvent is none: dry hydroxide holds no water to be dissolved in.
    if totals.solvent() <= 0.0 || free.given(system.basis.water) <= 0.0 {
        return Some(as_given(&free));
    }
    let mut given: Vec<usize> = Vec::new();
    for &solid in &system.basis.solids {
        if free.given(solid) > 0.0 && free.may_be(solid, &lacking) && free.made_of(solid, &given).is_none() {
            given.push(solid);
        }
    }
    if !may_hold(&free) {
        return None;
    }
    let start = free.start(&totals);
    let from = |begin| match begin {
        Begin::Near(start, held) => follow(&free, &start, &lacking, held),
        Begin::AtLimit(start, held, limit) => follow(&Problem { limit, ..free.clone() }, &start, &lacking, held),
    };
    let bracketed = |halvings| formal::bracketed(&free, halvings).into_iter().find_map(from);
    if let Some(found) = formal::HALVINGS.into_iter().find_map(bracketed) {
        return Some(found);
    }
    let found = follow(&free, &start, &lacking, given);
    let found = found.or_else(|| follow(&free, &start, &lacking, Vec::new()));
    let found = found.or_else(|| by_temperature(&free, &lacking));
    found.or_else(|| by_constants(&free, &start, &lacking))
}

/// Whether some temperature has the heat content that is given. One that may be far outside is asked for at both ends, which is two
/// solutions in place of a long search for one that is not there.
fn may_hold(free: &Problem<'_>) -> bool {
    if free.is_isothermal() {
        return true;
    }
    let (heat, capacity) = (free.args[free.layout.heat()], free.args[free.layout.capacity()]);
    let (low, high) = TEMPERATURES;
    let guess = free.reference() + heat / capacity;
    if low <= guess && guess <= high {
        return true;
    }
    let below = |t: f64| held_at(free, t).is_none_or(|(holds, _)| holds <= heat);
    let above = |t: f64| held_at(free, t).is_none_or(|(holds, _)| holds >= heat);
    below(low) && above(high)
}

/// Two temperatures between which the heat content lies, a step apart, found from that of reference on: constants make sense near it, and
/// may make none at the ends. None where a solution is lacking on the way.
fn around_heat(free: &Problem<'_>) -> Option<(f64, f64)> {
    let wanted = free.args[free.layout.heat()];
    let (lowest, highest) = TEMPERATURES;
    let mut here = free.reference().clamp(lowest, highest);
    let is_below = |t: f64| Some(held_at(free, t)?.0 < wanted);
    let up = is_below(here)?;
    loop {
        let next = (here + if up { WALK } else { -WALK }).clamp(lowest, highest);
        if next == here {
            return None;
        }
        if is_below(next)? != up {
            return Some((here.min(next), here.max(next)));
        }
        here = next;
    }
}

/// The heat content that a temperature makes, J, with the solution there.
fn held_at(free: &Problem<'_>, temperature: f64) -> Option<(f64, Solution)> {
    let layout = free.layout;
    let mut args = free.args.to_vec();
    (args[layout.capacity()], args[layout.heat()]) = (f64::INFINITY, 0.0);
    args[layout.reference()] = temperature;
    let solution = solve_in_order(free.system, &args, free.as_numbered, free.budget)?;
    let capacity = free.args[layout.capacity()] + solution.capacity;
    Some((solution.heat + capacity * (temperature - free.reference()), solution))
}

/// The solution where the heat content and the rest are hard to meet at once: the temperature is bracketed, as a heat content grows with
/// it, and then all goes on from there.
fn by_temperature(free: &Problem<'_>, lacking: &[f64]) -> Option<Solution> {
    if free.is_isothermal() {
        return None;
    }
    let (mut low, mut high) = around_heat(free).unwrap_or(TEMPERATURES);
    let mut last = None;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let (holds, solution) = held_at(free, middle)?;
        if holds < free.args[free.layout.heat()] {
            low = middle
        } else {
            high = middle
        }
        last = Some(solution);
    }
    let Solution { activities, point: Some(point), .. } = last? else { return None };
    let start = point.unknowns(free.basis.masters.iter().map(|i| activities[*i]));
    follow(free, &start, lacking, point.basis.held.clone())
}

/// The solution where members hold many of a master, and form all at once as it grows: first without them, and then with constants that
/// come nearer and nearer to their own.
fn by_constants(free: &Problem<'_>, start: &[f64], lacking: &[f64]) -> Option<Solution> {
    let alone = alone(free);
    if alone.is_empty() {
        return None;
    }
    let mut args = free.args.to_vec();
    let mut at = |shift: f64, start: &[f64], held: Vec<usize>| {
        for &(r, count) in &alone {
            args[free.layout.constant(r)] = free.args[free.layout.constant(r)] - shift / count;
        }
        follow(&Problem { args: &args, ..free.clone() }, start, lacking, held)
    };
    let mut last = at(HINDERED, start, Vec::new())?;
    let (mut shift, mut step) = (HINDERED, HINDERED_STEP);
    while shift > 0.0 {
        let Solution { activities, point: Some(point), .. } = &last else { return None };
        let next = (shift - step).max(0.0);
        let near = point.unknowns(free.basis.masters.iter().map(|i| activities[*i]));
        match at(next, &near, point.basis.held.clone()) {
            Some(found) => (last, shift, step) = (found, next, 1.5 * step),
            None if step > LEAST_STEP => step *= 0.5,
            None => return None,
        }
    }
    Some(last)
}

/// The equations that form members which hold many of a master, and no others, with how often each is taken.
fn alone(free: &Problem<'_>) -> Vec<(usize, f64)> {
    let basis = &free.system.basis;
    let forms_others =
        |r: usize, i: usize| (0..basis.by.len()).any(|j| j != i && basis.by[j].iter().any(|(k, _)| *k == r));
    let steep = basis.solutes.iter().copied().filter(|i| basis.is_steep_member(*i));
    steep.filter_map(|i| basis.by[i].iter().copied().find(|(r, _)| !forms_others(*r, i))).collect()
}

/// Lets solids come and go until none has to.
fn follow(free: &Problem<'_>, start: &[f64], lacking: &[f64], mut held: Vec<usize>) -> Option<Solution> {
    let system = free.system;
    let solids = &system.basis.solids;
    let mut known: Vec<f64> = vec![0.0; system.members().len()];
    for (c, i) in system.basis.masters.iter().enumerate() {
        known[*i] = start[c];
    }
    let mut others = start[system.basis.masters.len()..].to_vec();
    for _ in 0..4 * solids.len() + 4 {
        let seek = |replaced: &[usize], known: &[f64], others: &[f64]| {
            let basis = memo::basis(system, &held, replaced)?;
            let problem = Problem { basis, ..free.clone() };
            let totals = problem.totals(lacking);
            let begin = problem.basis.masters.iter().map(|i| known[*i]).chain(others.iter().copied()).collect();
            problem.newton(begin, &totals).map(|(x, state)| (problem, totals, x, state))
        };
        let replaced = free.scarcest(&held);
        let (problem, totals, x, state) = seek(&replaced, &known, &others)?;
        for &i in problem.basis.solutes.iter().chain(&problem.basis.formal) {
            known[i] = problem.activity(i, &state, &x);
        }
        others = x[problem.basis.masters.len()..].to_vec();
        let amounts = problem.solids(&state, &totals);
        let change = change(free, &problem, (&x, &state), (&amounts, lacking));
        match change {
            None => {
                let dissolved = free.scarcest_dissolved(&held, &state.amounts);
                let found = finish(&problem, x, (state, totals), (&amounts, lacking));
                if found.is_some() || dissolved == replaced {
                    return found;
                }
                // Rounding hides a little of a solid where much else is made of the same: by another of its parts it does not.
                let (problem, totals, x, state) = seek(&dissolved, &known, &others)?;
                let amounts = problem.solids(&state, &totals);
                return finish(&problem, x, (state, totals), (&amounts, lacking));
            }
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
    let mut activities = vec![0.0; basis.of.len()];
    for i in basis.solutes.iter().chain(&basis.solids).chain(&basis.formal).chain([&basis.water]) {
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
    let point = Point { basis, x, totals, state, missing: problem.missing(lacking) };
    reach_down(problem, &mut solution, &point, lacking)?;
    keeps_all(problem, &solution).then_some(())?;
    solution.point = Some(point);
    Some(solution)
}

/// Follows what there is none of, or less, linearly from its trace; none where that cannot be followed.
fn reach_down(problem: &Problem<'_>, solution: &mut Solution, point: &Point, lacking: &[f64]) -> Option<()> {
    if lacking.iter().all(|l| *l == 0.0) {
        return Some(());
    }
    let mut right = vec![0.0; point.x.len()];
    for (i, lacking) in lacking.iter().enumerate().filter(|(_, l)| **l != 0.0) {
        for (row, part) in problem.basis.parts.row(i) {
            right[*row] += part * lacking / point.state.sides[*row][usize::from(point.totals.of[*row] >= 0.0)];
        }
    }
    let step = point.factors(problem)?.solve(right);
    let free = &problem.system.basis;
    for (i, amount) in solution.amounts.iter_mut().enumerate() {
        let is_absent = point.missing.iter().any(|c| free.of[i][*c] != 0.0);
        *amount = if is_absent { 0.0 } else { *amount + problem.growth(&step, &point.state, i) };
    }
    Some(())
}

/// Whether what no equation changes is there as it was given, and nothing below zero that was not: a last look at what leaves here.
fn keeps_all(problem: &Problem<'_>, solution: &Solution) -> bool {
    let free = &problem.system.basis;
    let mut rows = vec![(0.0_f64, 0.0_f64); free.masters.len() + 1];
    for (i, amount) in solution.amounts.iter().enumerate() {
        let given = problem.given(i);
        for (row, part) in free.parts.row(i) {
            let (gap, size) = &mut rows[*row];
            *gap += part * (amount - given);
            *size = size.max((part * amount).abs()).max((part * given).abs());
        }
    }
    // Where a formal member is held, nothing balances the last traces of what would take it up.
    let trace = TRACE * solution.amounts[free.water] * problem.system.written.solvent_mass;
    rows.iter().all(|(gap, size)| gap.abs() <= KEPT * size + trace)
}

enum Change {
    Leaves(usize),
    Comes(usize),
}

/// All as it was given: where there is no solvent, nothing is dissolved in it.
fn as_given(free: &Problem<'_>) -> Solution {
    let count = free.system.members().len();
    let (heat, capacity) = (free.args[free.layout.heat()], free.args[free.layout.capacity()]);
    let warm = if free.is_isothermal() || capacity == 0.0 { 0.0 } else { heat / capacity };
    Solution {
        amounts: (0..count).map(|i| free.given(i)).collect(),
        activities: vec![f64::NEG_INFINITY; count],
        temperature: free.reference() + warm,
        strength: 0.0,
        heat: 0.0,
        capacity: 0.0,
        point: None,
    }
}
