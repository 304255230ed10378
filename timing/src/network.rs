//! A simple temporal network: points in time and least differences between them.
//!
//! Dechter, Meiri, Pearl: Temporal constraint networks (1991). A set of differences can be met exactly if its graph has
//! no cycle along which more time must pass than nothing.

use matterix_ir::plan::StepId;

use crate::ROUNDING;

/// A point in time. The first is the beginning of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Point(pub u32);

/// The beginning of the run.
pub const BEGIN: Point = Point(0);

/// A part of the plan that is done or not done as a whole, by its index in [`Network::scopes`]. The first is the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Scope(pub u32);

/// The whole plan.
pub const WHOLE: Scope = Scope(0);

/// What a difference comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Why {
    /// The order of the steps.
    Order,
    /// It takes at least this long, s.
    AtLeast(f64),
    /// It takes at most this long, s.
    AtMost(f64),
    /// It must begin at most so long, s, after something.
    Window(f64),
    /// It is waited for at most so long, s.
    Timeout(f64),
    /// It waits for a point in time, so long, s, after something.
    NotBefore(f64),
    /// A skill promises to take at least or at most this long, s.
    Promised(f64),
}

/// Where a difference comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reason {
    /// The step that asks for it.
    pub step: StepId,
    /// What it asks.
    pub why: Why,
}

/// `to` comes at least `weight` after `from`; a negative weight is an upper bound the other way round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The earlier point.
    pub from: Point,
    /// The later point.
    pub to: Point,
    /// s.
    pub weight: f64,
    /// Where it holds.
    pub scope: Scope,
    /// Why it holds.
    pub reason: Reason,
}

/// Points and differences.
#[derive(Clone, Debug)]
pub struct Network {
    /// How many points there are.
    pub points: u32,
    /// The scope around each scope; the whole has none.
    pub scopes: Vec<Option<Scope>>,
    /// All differences.
    pub edges: Vec<Edge>,
}

impl Default for Network {
    fn default() -> Self {
        Network { points: 1, scopes: vec![None], edges: Vec::new() }
    }
}

impl Network {
    /// A new point.
    pub fn point(&mut self) -> Point {
        self.points += 1;
        Point(self.points - 1)
    }

    /// A new scope inside another.
    pub fn scope(&mut self, outer: Scope) -> Scope {
        self.scopes.push(Some(outer));
        Scope(self.scopes.len() as u32 - 1)
    }

    /// `to` comes at least `weight` s after `from`.
    pub fn least(&mut self, from: Point, to: Point, weight: f64, scope: Scope, reason: Reason) {
        if weight.is_finite() && (from != to || weight > ROUNDING) {
            self.edges.push(Edge { from, to, weight, scope, reason });
        }
    }

    /// `to` comes at most `weight` s after `from`.
    pub fn most(&mut self, from: Point, to: Point, weight: f64, scope: Scope, reason: Reason) {
        self.least(to, from, -weight, scope, reason);
    }

    /// The scopes around one, itself first.
    pub fn around(&self, scope: Scope) -> Vec<Scope> {
        std::iter::successors(Some(scope), |s| self.scopes.get(s.0 as usize).copied().flatten()).collect()
    }

    /// Whether `outer` is `inner` or around it.
    pub fn holds_in(&self, outer: Scope, inner: Scope) -> bool {
        self.around(inner).contains(&outer)
    }

    /// The least time from `source` to every point, where there is one, with what holds in all of `scopes`; else the
    /// differences of a cycle that cannot be met, in order.
    pub fn least_from(&self, source: Point, scopes: &[Scope]) -> Result<Vec<f64>, Vec<Edge>> {
        let mut holds = vec![false; self.scopes.len()];
        scopes.iter().flat_map(|s| self.around(*s)).for_each(|s| holds[s.0 as usize] = true);
        let mut edges: Vec<&Edge> = self.edges.iter().filter(|e| holds[e.scope.0 as usize]).collect();
        // Points are made in the order of the plan: along it, then against it, one pass carries a time far.
        edges.sort_by_key(|e| e.from);
        let mut least = vec![f64::NEG_INFINITY; self.points as usize];
        let mut reached_by: Vec<Option<usize>> = vec![None; self.points as usize];
        least[source.0 as usize] = 0.0;
        let mut look = 1;
        for pass in 1.. {
            let mut moved = false;
            for turn in 0..edges.len() {
                let index = if pass % 2 == 1 { turn } else { edges.len() - 1 - turn };
                let edge = edges[index];
                let time = least[edge.from.0 as usize] + edge.weight;
                if time > least[edge.to.0 as usize] + ROUNDING {
                    least[edge.to.0 as usize] = time;
                    reached_by[edge.to.0 as usize] = Some(index);
                    moved = true;
                }
            }
            if !moved {
                break;
            }
            // A cycle that gains time shows among the last steps to each point soon after it has been gone round.
            if pass == look {
                look *= 2;
                if let Some(cycle) = cycle(&edges, &reached_by) {
                    return Err(cycle);
                }
            }
        }
        Ok(least)
    }
}

/// A cycle among the edges by which points were last reached.
fn cycle(edges: &[&Edge], reached_by: &[Option<usize>]) -> Option<Vec<Edge>> {
    let mut seen = vec![usize::MAX; reached_by.len()];
    for start in 0..reached_by.len() {
        let mut at = start;
        while seen[at] == usize::MAX {
            seen[at] = start;
            match reached_by[at] {
                Some(index) => at = edges[index].from.0 as usize,
                None => break,
            }
        }
        if seen[at] != start || reached_by[at].is_none() {
            continue;
        }
        let mut found = Vec::new();
        let last = at;
        while let Some(index) = reached_by[at] {
            found.push(*edges[index]);
            at = edges[index].from.0 as usize;
            if at == last {
                found.reverse();
                return Some(found);
            }
        }
    }
    None
}
