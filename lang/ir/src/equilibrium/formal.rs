//! Where a solution is sought from that has a formal member, as the electron of half-cells.
//!
//! Its activity runs over a hundred powers of ten, and what is formed with it turns over within a few of them: Newton's method finds
//! nothing from afar. But what is bound of it grows with its activity, so that this is bracketed, each time by the rest of the system
//! with an activity that is given.

use std::sync::Arc;

use super::problem::Problem;
use super::solve::{Solution, solve_within};
use super::{Layout, Phase, System, Written};

/// Between which logarithms of an activity a solution is sought, and how often that is halved before Newton's method goes on,
/// first and where it finds nothing. Electrons
/// with these activities have potentials of 3.9 V, beyond those of all half-cells in water.
const ACTIVITIES: (f64, f64) = (-150.0, 150.0);
pub(super) const HALVINGS: [usize; 2] = [10, 18];

/// Logarithms of activities one of which is taken where nothing binds the formal member, the ends first.
const OPEN: [f64; 5] = [ACTIVITIES.0, ACTIVITIES.1, 0.0, -50.0, 50.0];

/// A share of what is bound that is rounding.
const ROUNDED: f64 = 1e-13;

/// Where a solution with a formal member is sought from.
pub(super) enum Begin {
    /// From these unknowns, with these solids.
    Near(Vec<f64>, Vec<usize>),
    /// Nothing takes up any more of the formal member, or gives any: its activity is given, by its logarithm.
    AtLimit(Vec<f64>, Vec<usize>, f64),
}

/// The rest of a system without its formal member; none where it has none, or several.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    /// The formal member.
    member: usize,
    system: Arc<System>,
}

impl Rest {
    pub(super) fn of(written: &Written) -> Option<Rest> {
        let mut formal = (0..written.members.len()).filter(|i| written.members[*i].phase == Phase::Formal);
        let (Some(member), None) = (formal.next(), formal.next()) else { return None };
        let mut rest = written.clone();
        rest.members.remove(member);
        rest.equations.iter_mut().for_each(|e| _ = e.coefficients.remove(member));
        let acting = rest.interactions.iter_mut().flat_map(|all| &mut all.each).flat_map(|e| &mut e.members);
        acting.for_each(|i| *i -= usize::from(*i > member));
        let system = Arc::new(System::try_from(rest).ok()?);
        Some(Rest { member, system })
    }

    /// Where a member of the rest stands among all.
    fn whole(&self, member: usize) -> usize {
        member + usize::from(member >= self.member)
    }

    /// Where a member stands in the rest; none for the formal one.
    fn part(&self, member: usize) -> Option<usize> {
        (member != self.member).then(|| member - usize::from(member > self.member))
    }

    /// The unknowns of the whole by a solution of the rest, and the solids that are there; none where there is no solvent.
    fn begin(&self, free: &Problem<'_>, solution: &Solution, activity: f64) -> Option<(Vec<f64>, Vec<usize>)> {
        let point = solution.point.as_ref()?;
        let of = |i: &usize| self.part(*i).map_or(activity, |i| solution.activities[i]);
        let start = point.unknowns(free.basis.masters.iter().map(of));
        Some((start, point.basis.held.iter().map(|i| self.whole(*i)).collect()))
    }

    /// The same where the formal member keeps that activity.
    fn at_limit(&self, free: &Problem<'_>, solution: &Solution, activity: f64) -> Option<Begin> {
        let (start, mut held) = self.begin(free, solution, activity)?;
        held.push(self.member);
        Some(Begin::AtLimit(start, held, activity))
    }

    /// The arguments of the rest, where the formal member has an activity of this logarithm.
    fn args(&self, problem: &Problem<'_>, activity: f64) -> Vec<f64> {
        let (all, layout) = (problem.layout, self.system.layout());
        let mut args = vec![0.0; layout.count()];
        args[..layout.coefficients(0)].copy_from_slice(&problem.args[..all.coefficients(0)]);
        for (r, equation) in problem.system.equations().iter().enumerate() {
            args[layout.constant(r)] -= equation.coefficients[self.member] * activity;
        }
        for i in 0..self.system.members().len() {
            let (from, to) = (all.coefficients(self.whole(i)), layout.coefficients(i));
            args[to..to + Layout::COEFFICIENTS].copy_from_slice(&problem.args[from..from + Layout::COEFFICIENTS]);
            args[layout.capacity_of(i)] = problem.args[all.capacity_of(self.whole(i))];
            args[layout.amount(i)] = problem.given(self.whole(i));
        }
        args[layout.bystanders()..].copy_from_slice(&problem.args[all.bystanders()..]);
        args
    }
}

/// Where to begin, first and then; nowhere where there is no formal member.
pub(super) fn bracketed(free: &Problem<'_>, halvings: usize) -> Vec<Begin> {
    starts(free, halvings).unwrap_or_default()
}

fn starts(free: &Problem<'_>, halvings: usize) -> Option<Vec<Begin>> {
    let rest = free.system.rest.as_ref()?;
    let basis = &free.basis;
    let c = basis.masters.iter().position(|i| *i == rest.member)?;
    let lacking = free.lacking();
    let binds = |i: usize| i != rest.member && basis.of[i][c] != 0.0 && free.may_be(i, &lacking);
    if !(0..basis.of.len()).any(binds) {
        let open = |activity: f64| {
            rest.at_limit(free, &solve_within(&rest.system, &rest.args(free, activity), free.budget)?, activity)
        };
        return OPEN.into_iter().find_map(open).map(|begin| vec![begin]);
    }
    let bound = |of: &dyn Fn(usize) -> f64| (0..basis.of.len()).map(|i| basis.of[i][c] * of(i)).sum::<f64>();
    let wanted = bound(&|i| free.given(i));
    // By how much more than wanted is bound of it at an activity, and how far rounding reaches.
    let excess = |solution: &Solution| {
        let at = |i: usize| rest.part(i).map_or(0.0, |i| solution.amounts[i]);
        let all: f64 = (0..basis.of.len()).map(|i| (basis.of[i][c] * at(i)).abs()).sum();
        (bound(&at) - wanted, ROUNDED * all)
    };
    let (mut low, mut high) = ACTIVITIES;
    let mut flat: Option<(f64, Solution)> = None;
    let mut last: Option<(f64, Solution)> = None;
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        let solution = solve_within(&rest.system, &rest.args(free, middle), free.budget)?;
        let (excess, rounded) = excess(&solution);
        if excess.abs() <= rounded {
            flat.get_or_insert((middle, solution.clone()));
        }
        *(if excess < 0.0 { &mut low } else { &mut high }) = middle;
        last = Some((middle, solution));
    }
    // Where rounding hides what the activity changes, or the bracket ends where it began, nothing may be left that binds more, or gives any.
    let is_at_end = flat.is_some() || low == ACTIVITIES.0 || high == ACTIVITIES.1;
    for (limit, sign) in [(ACTIVITIES.0, 1.0), (ACTIVITIES.1, -1.0)].into_iter().filter(|_| is_at_end) {
        let solution = solve_within(&rest.system, &rest.args(free, limit), free.budget)?;
        let (excess, rounded) = excess(&solution);
        if sign * excess >= -rounded {
            return rest.at_limit(free, &solution, limit).map(|begin| vec![begin]);
        }
    }
    // Where rounding hides it over a stretch, the first place that was met there stands for all: it is the same for mixtures that are nearly
    // the same.
    let settled = flat.and_then(|(activity, solution)| rest.at_limit(free, &solution, activity));
    let (activity, solution) = last?;
    let near = rest.begin(free, &solution, activity).map(|(start, held)| Begin::Near(start, held));
    Some(settled.into_iter().chain(near).collect())
}
