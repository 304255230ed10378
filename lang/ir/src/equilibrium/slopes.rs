//! How a solution moves with its arguments: the conditions stay met, so `F_x dx + F_a da = 0`.

use super::basis::Basis;
use super::linear::Factors;
use super::pitzer::{Turn, Virial};
use super::problem::{Budget, Problem};
use super::solve::{Point, STANDARD, Solution, terms};
use super::{Part, Phase, Role, System};

/// The number of the activity of the solvent among [`super::Activities`].
const LOWERING: usize = super::Layout::ACTIVITIES - 1;

/// Slopes of one solution, found as they are asked for.
#[derive(Debug, Default)]
pub(super) struct Slopes {
    /// How conditions move with the unknowns, once it is known; none within where that has no inverse.
    factors: Option<Option<Factors>>,
    /// By argument.
    known: Vec<Option<Direction>>,
}

/// How all moves with one argument.
#[derive(Clone, Debug)]
struct Direction {
    /// The unknowns.
    step: Vec<f64>,
    /// The logarithms of amounts of dissolved members beside that.
    grown: Vec<f64>,
    /// Those of activities, and of constants of solids.
    raised: Vec<f64>,
}

impl Slopes {
    /// The slope of a part by an argument.
    pub(super) fn of(&mut self, system: &System, solution: &Solution, args: &[f64], part: Part, arg: usize) -> f64 {
        let basis = solution.point.as_ref().map_or(&system.basis, |point| &point.basis);
        let budget = Budget::of(0);
        let problem = Problem::new(system, args, basis.clone(), &budget);
        let Some(point) = &solution.point else { return as_given(&problem, part, arg) };
        if matches!(part, Part::Amount(i) if stays_away(&problem, point, i as usize, arg)) {
            return 0.0;
        }
        if self.known.len() != args.len() {
            self.known = vec![None; args.len()];
        }
        let Some(factors) = self.factors.get_or_insert_with(|| point.factors(&problem)) else { return f64::NAN };
        let direction = self.known[arg].get_or_insert_with(|| direction(&problem, point, factors, arg));
        slope(&problem, point, direction, part, arg)
    }
}

/// Whether nothing that a member is made of is there, and an argument brings none of it: its trace, by which the rest is solved, moves, but it
/// is none all the same.
fn stays_away(problem: &Problem<'_>, point: &Point, member: usize, arg: usize) -> bool {
    let of = &problem.system.basis.of;
    let mut lacks = point.missing.iter().filter(|c| of[member][**c] != 0.0).peekable();
    lacks.peek().is_some() && !matches!(problem.layout.role(arg), Role::Amount(i) if lacks.any(|c| of[i][*c] != 0.0))
}

/// Without a solvent all is as it was given.
fn as_given(problem: &Problem<'_>, part: Part, arg: usize) -> f64 {
    let layout = problem.layout;
    let (heat, capacity) = (problem.args[layout.heat()], problem.args[layout.capacity()]);
    let one = |is: bool| f64::from(u8::from(is));
    match part {
        Part::Amount(i) => one(arg == layout.amount(i as usize)),
        Part::Temperature if arg == layout.reference() => 1.0,
        Part::Temperature if arg == layout.heat() && capacity.is_finite() => 1.0 / capacity,
        Part::Temperature if arg == layout.capacity() && capacity.is_finite() => -heat / (capacity * capacity),
        _ => 0.0,
    }
}

fn direction(problem: &Problem<'_>, point: &Point, factors: &Factors, arg: usize) -> Direction {
    let (grown, raised) = beside(problem, point, arg);
    let mut right = problem.moved(&grown, &point.state);
    aside(problem, point, arg, &mut right);
    right.iter_mut().for_each(|v| *v = -*v);
    Direction { step: factors.solve(right), grown, raised }
}

/// How the logarithm of the amount of each dissolved member, and that of the activity of each, or of the constant of a solid, grow with an
/// argument while the unknowns stay.
fn beside(problem: &Problem<'_>, point: &Point, arg: usize) -> (Vec<f64>, Vec<f64>) {
    let (basis, places) = (&problem.basis, problem.places());
    let temperature = point.x[places.temperature()];
    let around = problem.activities.around(point.x[places.strength()], temperature);
    let count = basis.of.len();
    let same = |raised: Vec<f64>| (raised.clone(), raised);
    let less = |coefficient: &dyn Fn(usize) -> f64| ((0..count).map(|i| -coefficient(i)).collect(), vec![0.0; count]);
    let is_solute = |i: usize| problem.system.members()[i].phase == Phase::Solute;
    let by_turn = |virial: &Virial, turn: Turn| {
        let raised: Vec<f64> = (0..count).map(|i| problem.dryness(i) * turn.osmotic).collect();
        let of = |i: usize| virial.place(i).map_or(0.0, |k| turn.ln[k]);
        ((0..count).map(|i| raised[i] - of(i)).collect(), raised)
    };
    let at = |virial: &Virial| virial.at(around.a, &point.x[places.placed()]);
    match (problem.layout.role(arg), problem.system.virial.as_deref()) {
        (Role::Activities(LOWERING), _) => {
            let molality = point.x[places.molality()] + point.state.effects.osmotic;
            same((0..count).map(|i| -basis.solvent[i] * molality).collect())
        }
        (Role::Activities(which @ 0..3), Some(virial)) => {
            let by = (temperature - STANDARD).powi(which as i32);
            by_turn(virial, virial.turn(at(virial), &vec![0.0; virial.count()], by))
        }
        (Role::Interaction(number, term), Some(virial)) => {
            by_turn(virial, virial.turn_by(at(virial), number, terms(temperature)[term]))
        }
        (Role::Activities(which), None) => less(&|i| match is_solute(i) {
            true => {
                let charge = problem.system.members()[i].charge;
                problem.coefficients(i).by_common(&around, charge, temperature - STANDARD, which)
            }
            false => 0.0,
        }),
        (Role::Coefficient(member, which), None) if is_solute(member) => less(&|i| {
            let charge = problem.system.members()[i].charge;
            if i == member { problem.coefficients(i).by_own(&around, charge, which) } else { 0.0 }
        }),
        (Role::Liquid(place), _) if problem.args[arg] >= 0.0 => {
            let mut grown = vec![0.0; count];
            let member = basis.extracted[place];
            grown[member] = problem.liquid(member).map_or(0.0, |mass| 1.0 / mass);
            (grown, vec![0.0; count])
        }
        (Role::Constant(r, term), _) => {
            let by = terms(temperature)[term];
            same((0..count).map(|i| by * by_equation(basis, i, r)).collect())
        }
        _ => same(vec![0.0; count]),
    }
}

/// How much of an equation forms a member.
fn by_equation(basis: &Basis, member: usize, equation: usize) -> f64 {
    basis.by[member].iter().filter(|(r, _)| *r == equation).map(|(_, by)| *by).sum()
}

/// How much of a member has formed, whatever its phase.
fn taken(problem: &Problem<'_>, point: &Point, member: usize) -> f64 {
    let basis = &problem.basis;
    let formed = |i: usize| point.state.amounts[i] - problem.given(i);
    let of = |i: usize| -> f64 {
        if let Some(c) = basis.masters.iter().position(|m| *m == member) {
            return basis.of[i][c];
        }
        if let Some(k) = basis.held.iter().position(|m| *m == member) {
            return basis.of_held[i][k];
        }
        if member == basis.water { basis.solvent[i] } else { 0.0 }
    };
    let is_master = basis.masters.contains(&member) || basis.held.contains(&member) || member == basis.water;
    if !is_master {
        return formed(member);
    }
    // What others have taken of it.
    -(0..basis.of.len()).filter(|i| *i != member).map(|i| of(i) * formed(i)).sum::<f64>()
}

/// How conditions move with an argument that they name themselves.
fn aside(problem: &Problem<'_>, point: &Point, arg: usize, rows: &mut [f64]) {
    let (basis, places, state) = (&problem.basis, problem.places(), &point.state);
    let (scale, isothermal) = (problem.energy_scale(), problem.is_isothermal());
    let warmth = places.temperature();
    let formed = |i: usize| state.amounts[i] - problem.given(i);
    match problem.layout.role(arg) {
        Role::Amount(i) => {
            for (row, of) in basis.parts.row(i) {
                // A total below 0 stands on the other side.
                let total = point.totals.of[*row];
                rows[*row] -= of / state.sides[*row][usize::from(total >= 0.0)];
            }
            if !isothermal {
                rows[warmth] += (state.enthalpies[i] + state.capacities[i] * state.warmer) / scale;
            }
        }
        Role::Bystanders | Role::BystanderAmount if problem.args[arg] < 0.0 => {}
        Role::Bystanders => rows[places.strength()] -= state.by_charges,
        Role::BystanderAmount => rows[places.molality()] -= state.by_dissolved,
        Role::Reference if isothermal => rows[warmth] -= 1.0,
        _ if isothermal => {}
        Role::Heat => rows[warmth] += 1.0 / scale,
        Role::Capacity => rows[warmth] -= state.warmer / scale,
        Role::Reference => rows[warmth] += state.capacity / scale,
        Role::CapacityOf(i) => rows[warmth] -= taken(problem, point, i) * state.warmer / scale,
        Role::Enthalpy(r) => {
            let all = 0..basis.of.len();
            rows[warmth] -= all.map(|i| by_equation(basis, i, r) * formed(i)).sum::<f64>() / scale;
        }
        Role::Activities(_) | Role::Constant(..) | Role::Coefficient(..) | Role::Interaction(..) | Role::Liquid(_) => {}
    }
}

/// The slope of a part where the unknowns and what else there is move so.
fn slope(problem: &Problem<'_>, point: &Point, direction: &Direction, part: Part, arg: usize) -> f64 {
    let (basis, layout, places) = (&problem.basis, problem.layout, problem.places());
    let role = layout.role(arg);
    let dissolved = |i: usize| {
        let beside = match problem.system.members()[i].phase.is_dissolved() {
            true => direction.grown[i] * point.state.amounts[i],
            false => 0.0,
        };
        problem.growth(&direction.step, &point.state, i) + beside
    };
    let amount = |i: usize| match basis.held.iter().position(|s| *s == i) {
        Some(k) => {
            let total = if let Role::Amount(i) = role { basis.of_held[i][k] } else { 0.0 };
            total - (0..basis.of.len()).map(|i| basis.of_held[i][k] * dissolved(i)).sum::<f64>()
        }
        None => dissolved(i),
    };
    let given = |i: usize| f64::from(u8::from(role == Role::Amount(i)));
    let all = 0..basis.of.len();
    match part {
        Part::Amount(i) => amount(i as usize),
        Part::Activity(i) => {
            let i = i as usize;
            problem.raise(&direction.step, &point.state, i) + direction.raised[i]
        }
        Part::Temperature => direction.step[places.temperature()],
        Part::Strength => direction.step[places.strength()],
        Part::Heat => {
            let by_enthalpy = |i: usize| match role {
                Role::Enthalpy(r) => by_equation(basis, i, r) * (point.state.amounts[i] - problem.given(i)),
                _ => 0.0,
            };
            all.map(|i| point.state.enthalpies[i] * (dissolved(i) - given(i)) + by_enthalpy(i)).sum()
        }
        Part::Capacity => {
            let capacity = |i: usize| problem.args[layout.capacity_of(i)];
            let by_capacity = |i: usize| match role {
                Role::CapacityOf(of) if of == i => taken(problem, point, i),
                _ => 0.0,
            };
            all.map(|i| capacity(i) * (amount(i) - given(i)) + by_capacity(i)).sum()
        }
    }
}
