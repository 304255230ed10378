//! The exact search: pumpkin, a solver for finite domains that learns from its conflicts.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_timing::network::BEGIN;
use matterix_timing::{Point, ROUNDING, Why};
use pumpkin_conflict_resolvers::resolvers::ResolutionResolver;
use pumpkin_constraints::{binary_less_than_or_equals, disjunctive_strict, maximum};
use pumpkin_core::optimisation::OptimisationDirection;
use pumpkin_core::optimisation::linear_sat_unsat::LinearSatUnsat;
use pumpkin_core::options::SolverOptions;
use pumpkin_core::rand::SeedableRng;
use pumpkin_core::rand::rngs::SmallRng;
use pumpkin_core::results::{OptimisationResult, ProblemSolution, SolutionReference};
use pumpkin_core::termination::TerminationCondition;
use pumpkin_core::variables::{AffineView, DomainId, TransformableVariable};
use pumpkin_core::{DefaultBrancher, Solver};
use pumpkin_propagators::disjunctive::ArgDisjunctiveTask;

use super::list;
use super::problem::{Moment, Problem};

/// Longest schedule, in ticks: sums of a few times stay within 32 bits.
const MOST_TICKS: f64 = 2e8;

/// Bounds of the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort<'c> {
    /// Any of these, once set, ends it.
    pub stop: &'c [&'c AtomicBool],
    /// How often the solver may ask whether to go on.
    pub decisions: Option<u64>,
    pub seed: u64,
}

/// What the search found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Times of the points, where a schedule shorter than the limit was found.
    pub times: Option<Vec<f64>>,
    /// No schedule is shorter than what was found, or than the limit where nothing was.
    pub proven: bool,
}

struct Stop<'c> {
    stop: &'c [&'c AtomicBool],
    left: Option<u64>,
}

impl TerminationCondition for Stop<'_> {
    fn should_stop(&mut self) -> bool {
        if let Some(left) = &mut self.left {
            *left = left.saturating_sub(1);
        }
        self.left == Some(0) || self.stop.iter().any(|s| s.load(Ordering::Relaxed))
    }
}

/// Looks for schedules of at least `bound` and less than `limit` s, shorter and shorter.
pub(super) fn search(
    problem: &Problem,
    rivals: &[(usize, usize)],
    bound: f64,
    limit: f64,
    effort: Effort<'_>,
) -> Option<Found> {
    let tick = tick(problem, limit);
    let ticks = |time: f64| (time / tick - ROUNDING).ceil() as i32;
    let horizon = ticks(limit);
    let earliest = problem.earliest(&[], false)?;
    let options = SolverOptions { random_generator: SmallRng::seed_from_u64(effort.seed), ..SolverOptions::default() };
    let mut solver = Solver::with_options(options);
    let tag = solver.new_constraint_tag();
    let end = problem.end?;
    // A schedule of the limit is there already, or none is wanted.
    let makespan = solver.new_bounded_integer(ticks(bound).min(horizon - 1), horizon - 1);
    // The beginning is no variable: what counts from it bounds the others.
    let mut latest = vec![horizon; earliest.len()];
    latest[BEGIN.0 as usize] = 0;
    for edge in problem.network.edges.iter().filter(|e| e.to == BEGIN) {
        let most = &mut latest[edge.from.0 as usize];
        *most = (*most).min(-ticks(edge.weight));
    }
    let mut points: Vec<DomainId> = Vec::with_capacity(earliest.len());
    for (least, most) in earliest.iter().zip(latest) {
        let least = if least.is_finite() { ticks(*least) } else { 0 };
        if least > most {
            return Some(Found { times: None, proven: true });
        }
        points.push(solver.new_bounded_integer(least, most));
    }
    let var = |p: Point| points[p.0 as usize];
    let view = |m: Moment| -> AffineView<DomainId> { var(m.point).offset(ticks(m.offset)) };
    for edge in problem.network.edges.iter().filter(|e| e.from != BEGIN && e.to != BEGIN) {
        // Windows are rounded towards the strict side as well.
        let weight = ticks(edge.weight);
        solver
            .add_constraint(binary_less_than_or_equals(var(edge.from).offset(weight), var(edge.to).offset(0), tag))
            .post();
    }
    for (point, moments) in &problem.joins {
        if moments.iter().any(|m| m.point == BEGIN) {
            continue;
        }
        let moments: Vec<_> = moments.iter().map(|m| view(*m)).collect();
        solver.add_constraint(maximum(moments, var(*point).offset(0), tag)).post();
    }
    solver.add_constraint(binary_less_than_or_equals(view(end), makespan.offset(0), tag)).post();
    for &(a, b) in rivals {
        let (a, b) = (&problem.tasks[a], &problem.tasks[b]);
        let first = solver.new_literal();
        let (a_end, b_end) = (view(a.end), view(b.end));
        solver.add_constraint(binary_less_than_or_equals(a_end, var(b.start).offset(0), tag)).implied_by(first);
        solver.add_constraint(binary_less_than_or_equals(b_end, var(a.start).offset(0), tag)).implied_by(!first);
    }
    for tasks in exclusive(problem) {
        let tasks: Vec<_> = tasks
            .into_iter()
            .map(|(task, least)| ArgDisjunctiveTask {
                start_time: var(problem.tasks[task].start),
                processing_time: ticks(least),
            })
            .filter(|t| t.processing_time > 0)
            .collect();
        if tasks.len() > 1 {
            solver.add_constraint(disjunctive_strict(tasks, tag)).post();
        }
    }
    if solver.is_inconsistent() {
        return Some(Found { times: None, proven: true });
    }
    let mut stop = Stop { stop: effort.stop, left: effort.decisions };
    let mut brancher = solver.default_brancher();
    let mut resolver = ResolutionResolver::default();
    let go_on = |_: &Solver, _: SolutionReference<'_>, _: &DefaultBrancher, _: &ResolutionResolver| {
        ControlFlow::<()>::Continue(())
    };
    let shorter = LinearSatUnsat::new(OptimisationDirection::Minimise, makespan, go_on);
    let result = solver.optimise(&mut brancher, &mut stop, &mut resolver, shorter);
    let (solution, proven) = match result {
        OptimisationResult::Optimal(solution) => (Some(solution), true),
        OptimisationResult::Satisfiable(solution) | OptimisationResult::Stopped(solution, ()) => {
            (Some(solution), false)
        }
        OptimisationResult::Unsatisfiable => (None, true),
        OptimisationResult::Unknown => (None, false),
    };
    let times = solution.map(|s| points.iter().map(|p| f64::from(s.get_integer_value(*p)) * tick).collect());
    Some(Found { times, proven })
}

/// Tasks that exclude each other, by instance, with their least durations, s; of nested ones the outermost.
fn exclusive(problem: &Problem) -> Vec<Vec<(usize, f64)>> {
    let mut instances: Vec<_> = problem.tasks.iter().flat_map(|t| t.instances.iter().copied()).collect();
    instances.sort_unstable();
    instances.dedup();
    let least = least_durations(problem);
    let of = |instance| {
        let needs = |t: usize| problem.tasks[t].instances.contains(&instance);
        let outermost = |t: &usize| needs(*t) && !problem.tasks[*t].around.iter().any(|o| needs(*o));
        (0..problem.tasks.len()).filter(outermost).map(|t| (t, least[t])).collect()
    };
    instances.into_iter().map(of).collect()
}

/// The least time each task takes, s.
pub(super) fn least_durations(problem: &Problem) -> Vec<f64> {
    let mut order = problem.network.clone();
    order.edges.retain(|e| e.reason.why == Why::Order);
    let least = |t: &super::problem::Task| {
        if t.end.point == t.start {
            return t.end.offset;
        }
        let reached = order.least_from(t.start, &[matterix_timing::network::WHOLE]).unwrap_or_default();
        (reached.get(t.end.point.0 as usize).copied().unwrap_or(0.0) + t.end.offset).max(0.0)
    };
    problem.tasks.iter().map(least).collect()
}

/// A time that no schedule is shorter than, s: the longest way, and for each instance what must come before, in and
/// after all that needs it.
pub(super) fn lower_bound(problem: &Problem) -> Option<f64> {
    let earliest = problem.earliest(&[], false)?;
    let mut bound = problem.end?.time(&earliest);
    let tails = list::tails(problem);
    for tasks in exclusive(problem) {
        let heads = tasks.iter().map(|(t, _)| earliest[problem.tasks[*t].start.0 as usize]);
        let rest = tasks.iter().map(|(t, _)| tails[*t].after);
        let (head, rest) = (heads.fold(f64::INFINITY, f64::min), rest.fold(f64::INFINITY, f64::min));
        bound = bound.max(head + tasks.iter().map(|(_, least)| least).sum::<f64>() + rest);
    }
    Some(bound)
}

/// The largest time of which all times are multiples, s, in whole microseconds; coarser where the horizon asks for it.
fn tick(problem: &Problem, horizon: f64) -> f64 {
    let edges = problem.network.edges.iter().map(|e| e.weight);
    let joins = problem.joins.iter().flat_map(|(_, m)| m).map(|m| m.offset);
    let tasks = problem.tasks.iter().map(|t| t.end.offset).chain(problem.end.map(|e| e.offset));
    let micros = edges.chain(joins).chain(tasks).map(|t| (t.abs() * 1e6).round() as u64);
    let common = micros.fold(0, gcd).max(1);
    let fine = common as f64 * 1e-6;
    if horizon / fine <= MOST_TICKS { fine } else { horizon / MOST_TICKS }
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
