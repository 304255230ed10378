//! List schedules: active schedules built task by task, by priority.
//!
//! Giffler, Thompson: Algorithms for solving production-scheduling problems (1960).

use matterix_timing::network::{BEGIN, WHOLE};
use matterix_timing::{Edge, ROUNDING, Why};

use super::problem::{Moment, Problem};

/// What decides between tasks that want the same instance.
#[derive(Clone, Copy, Debug)]
enum Rule {
    /// The longest way from its beginning to the end of the whole.
    LongestTail,
    /// The shortest task.
    Shortest,
    /// The order of the text.
    First,
}

/// An order of the tasks as further differences, with the times of the points.
#[derive(Clone, Debug)]
pub(super) struct Ordered {
    pub times: Vec<f64>,
    pub makespan: f64,
}

/// The best schedule that keeps the windows, of those that a few rules give.
pub(super) fn best(problem: &Problem, rivals: &[(usize, usize)]) -> Option<Ordered> {
    let mut best: Option<Ordered> = None;
    for rule in [Rule::LongestTail, Rule::Shortest, Rule::First] {
        let Some(found) = build(problem, rivals, rule) else { continue };
        if problem.keeps_windows(&found.times) && best.as_ref().is_none_or(|b| found.makespan < b.makespan - ROUNDING) {
            best = Some(found);
        }
    }
    best
}

/// Tasks at most whose order is tidied.
const MOST_TIDIED: usize = 200;

/// The same schedule with needless waiting taken out: where a block can go before
/// those that it waits for and blocks end earlier in sum, while the whole takes no longer and keeps its windows.
pub(super) fn tidied(problem: &Problem, rivals: &[(usize, usize)], best: &Ordered) -> Option<Ordered> {
    if problem.tasks.len() > MOST_TIDIED {
        return None;
    }
    let end = problem.end?;
    let mut order = in_order(problem, rivals, &best.times);
    let judge = |order: &[(usize, usize)]| {
        let times = problem.settled(order)?;
        let sum: f64 = problem.tasks.iter().map(|t| t.end.time(&times)).sum();
        Some((times, sum))
    };
    let (mut times, mut sum) = judge(&order)?;
    let mut moved = true;
    while moved {
        moved = false;
        for (index, task) in problem.tasks.iter().enumerate() {
            let asks = task.asks.time(&times);
            if times[task.start.0 as usize] <= asks + ROUNDING {
                continue;
            }
            let begins = |t: usize| times[problem.tasks[t].start.0 as usize];
            let ahead = order.iter().filter(|(a, b)| *b == index && begins(*a) >= asks - ROUNDING);
            let mut places: Vec<f64> = ahead.map(|(a, _)| begins(*a)).collect();
            places.sort_by(f64::total_cmp);
            places.dedup();
            // As far ahead as helps of those that began only after it asked.
            let better = places.iter().find_map(|place| {
                let flip = |&(a, b): &(usize, usize)| if b == index && begins(a) >= *place { (b, a) } else { (a, b) };
                let ahead: Vec<(usize, usize)> = order.iter().map(flip).collect();
                let (times, less) = judge(&ahead)?;
                let helps = less < sum - ROUNDING && end.time(&times) <= best.makespan + ROUNDING;
                helps.then_some((times, less, ahead))
            });
            if let Some(better) = better {
                (times, sum, order) = better;
                moved = true;
            }
        }
    }
    Some(Ordered { makespan: end.time(&times), times })
}

/// Each pair of rivals in the order of a schedule.
pub(super) fn in_order(problem: &Problem, rivals: &[(usize, usize)], times: &[f64]) -> Vec<(usize, usize)> {
    let key = |t: usize| (times[problem.tasks[t].start.0 as usize], problem.tasks[t].end.time(times), t);
    rivals.iter().map(|&(a, b)| if key(a) < key(b) { (a, b) } else { (b, a) }).collect()
}

/// What must follow a task, whatever the order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tail {
    /// From its beginning to the end of the whole, s.
    pub with: f64,
    /// From its end to the end of the whole, s.
    pub after: f64,
}

/// What must follow each task.
pub(super) fn tails(problem: &Problem) -> Vec<Tail> {
    let Some(end) = problem.end else { return Vec::new() };
    // Backwards, every difference is one to the end.
    let mut back = problem.network.clone();
    back.edges.retain(|e| e.reason.why == Why::Order);
    back.edges.iter_mut().for_each(|e| std::mem::swap(&mut e.from, &mut e.to));
    let far = back.least_from(end.point, &[WHOLE]).unwrap_or_default();
    let tail = |m: Moment| {
        let far = far.get(m.point.0 as usize).copied().unwrap_or(f64::NEG_INFINITY);
        (far + end.offset - m.offset).max(0.0)
    };
    problem.tasks.iter().map(|t| Tail { with: tail(Moment::of(t.start)), after: tail(t.end) }).collect()
}

fn build(problem: &Problem, rivals: &[(usize, usize)], rule: Rule) -> Option<Ordered> {
    let count = problem.tasks.len();
    let tails = tails(problem);
    let mut against: Vec<Vec<usize>> = vec![Vec::new(); count];
    for &(a, b) in rivals {
        against[a].push(b);
        against[b].push(a);
    }
    let before = predecessors(problem)?;
    let mut network = problem.network.clone();
    network.edges.retain(|e| e.reason.why == Why::Order);
    let mut placed = vec![false; count];
    for _ in 0..count {
        let times = network.least_from(BEGIN, &[WHOLE]).ok()?;
        let start = |t: usize| times[problem.tasks[t].start.0 as usize];
        let end = |t: usize| problem.tasks[t].end.time(&times);
        let ready: Vec<usize> = (0..count).filter(|t| !placed[*t] && before[*t].iter().all(|b| placed[*b])).collect();
        // Among those that could begin before the first could end, the rule decides.
        let first = ready.iter().copied().min_by(|a, b| end(*a).total_cmp(&end(*b)).then(a.cmp(b)))?;
        let limit = end(first);
        let may = |t: &&usize| **t == first || (against[first].contains(t) && start(**t) < limit - ROUNDING);
        let key = |t: usize| match rule {
            Rule::LongestTail => -tails[t].with,
            Rule::Shortest => end(t) - start(t),
            Rule::First => t as f64,
        };
        let chosen = ready.iter().filter(may).copied().min_by(|a, b| key(*a).total_cmp(&key(*b)).then(a.cmp(b)))?;
        placed[chosen] = true;
        let edges: Vec<Edge> =
            against[chosen].iter().filter(|t| !placed[**t]).map(|t| problem.before(chosen, *t)).collect();
        network.edges.extend(edges);
    }
    let times = network.least_from(BEGIN, &[WHOLE]).ok()?;
    let makespan = problem.end?.time(&times);
    Some(Ordered { times, makespan })
}

/// For each task, those that begin before it or around it in any case.
fn predecessors(problem: &Problem) -> Option<Vec<Vec<usize>>> {
    let mut order = problem.network.clone();
    order.edges.retain(|e| e.reason.why == Why::Order);
    let mut before: Vec<Vec<usize>> = vec![Vec::new(); problem.tasks.len()];
    for (i, task) in problem.tasks.iter().enumerate() {
        let reached = order.least_from(task.start, &[WHOLE]).ok()?;
        for (k, other) in problem.tasks.iter().enumerate() {
            if i != k && reached[other.start.0 as usize].is_finite() {
                before[k].push(i);
            }
        }
    }
    Some(before)
}
