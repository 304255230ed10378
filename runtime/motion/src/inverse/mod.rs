//! Inverse kinematics: configurations that bring the tip of a chain to a pose.
//!
//! Where the geometry has a closed form it is used; otherwise damped least squares within the limits, begun anew from
//! spread-out starts until one succeeds. A posture then uses what freedom is left. The same request gives the same answer.

mod closed;
mod descent;
mod goal;
mod posture;
mod starts;
mod subproblems;

use crate::chain::Chain;
use crate::pose::Pose;
use crate::variables::Variable;

pub use closed::ParallelWrist;
use descent::Descent;
pub use goal::Facing;
use starts::Starts;
pub(crate) use starts::unit;

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// Where the tip is to be, relative to the base.
    pub target: Pose,
    /// What of the target's rotation matters.
    pub facing: Facing,
    /// Where the chain is now: the first start, and of solutions that differ by whole turns the nearest is taken.
    pub start: &'a [f64],
    /// Where the variables would rather be, as far as the target leaves it open.
    pub posture: Option<&'a [f64]>,
    /// How gladly each variable moves: 1 freely, 0 not at all; all 1 if not given. With any below 1 the solution is moved
    /// within what the target leaves open to where the squares of (q - wish), divided by the weights, sum up to the
    /// least; the wish is the posture, or else the start.
    pub weights: Option<&'a [f64]>,
    /// Greatest distance from the target, in metres.
    pub linear: f64,
    /// Greatest angle to the target, in radians.
    pub angular: f64,
    /// Solutions looked at to take the nearest of, where a search finds them one by one.
    pub choices: u32,
    /// Starts tried before giving up.
    pub attempts: u32,
    /// Steps from each start before giving it up.
    pub steps: u32,
    /// Other seeds try other starts.
    pub seed: u64,
}

impl<'a> Request<'a> {
    /// A request for a pose to a micrometre and a microradian, from this configuration.
    pub fn new(target: Pose, start: &'a [f64]) -> Self {
        Self {
            target,
            facing: Facing::Exactly,
            start,
            posture: None,
            weights: None,
            linear: 1e-6,
            angular: 1e-6,
            choices: 1,
            attempts: 200,
            steps: 60,
            seed: 0,
        }
    }

    fn is_met(&self, at: &Pose) -> bool {
        let (linear, angular) = self.off(at);
        linear <= self.linear && angular <= self.angular
    }

    /// Whether all variables move freely.
    fn is_free(&self) -> bool {
        self.weights.is_none_or(|weights| weights.iter().all(|&w| w >= 1.0))
    }

    /// The squared distance of two configurations; what moves less gladly counts for more.
    pub(crate) fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let part = |(i, (a, b)): (usize, (&f64, &f64))| match self.weight(i) {
            weight if weight > 0.0 => (a - b) * (a - b) / weight,
            _ => 0.0,
        };
        a.iter().zip(b).enumerate().map(part).sum()
    }

    pub(crate) fn weight(&self, variable: usize) -> f64 {
        self.weights.map_or(1.0, |weights| weights[variable])
    }
}

/// A configuration within all limits that meets a request.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The variables of the chain.
    pub q: Vec<f64>,
    /// Distance from the target, in metres.
    pub linear: f64,
    /// Angle to the target, in radians.
    pub angular: f64,
    /// Starts that were tried; 0 for a closed form.
    pub attempts: u32,
}

/// No configuration was found; the nearest one within the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreached {
    /// The variables of the chain.
    pub q: Vec<f64>,
    /// Distance from the target, in metres.
    pub linear: f64,
    /// Angle to the target, in radians.
    pub angular: f64,
}

/// Inverse kinematics of one chain; keeps what is known of it, and room to work, between requests.
#[derive(Clone, Debug)]
pub struct Solver {
    chain: Chain,
    closed: Option<ParallelWrist>,
    descent: Descent,
}

impl Solver {
    /// Recognises the geometry of a chain.
    pub fn new(chain: Chain) -> Self {
        let closed = ParallelWrist::of(&chain);
        let descent = Descent::new(&chain);
        Self { chain, closed, descent }
    }

    /// The chain.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// The closed form of the chain, if it has one.
    pub fn closed_form(&self) -> Option<&ParallelWrist> {
        self.closed.as_ref()
    }

    /// A configuration that meets the request. Where there are several, [`Request::choices`] of them are looked at and
    /// the one nearest to the posture, or else to the start, is taken.
    ///
    /// # Panics
    /// If the start, the posture or the weights are shorter than the chain's variables.
    pub fn solve(&mut self, request: &Request) -> Result<Solution, Unreached> {
        if let Some(solution) = self.by_closed_form(request).into_iter().next() {
            return Ok(solution);
        }
        self.search(request)
    }

    /// As [`Solver::solve`], but never by a closed form.
    pub fn search(&mut self, request: &Request) -> Result<Solution, Unreached> {
        let mut found = Vec::new();
        let nearest = self.collect(request, request.choices.max(1), &mut found);
        sort(request, &mut found);
        match (found.into_iter().next(), nearest) {
            (Some(solution), _) => Ok(solution),
            (None, nearest) => {
                let mut q = nearest;
                unwind(self.chain.variables(), request.start, &mut q);
                let (linear, angular) = request.off(&self.chain.tip(&q));
                Err(Unreached { q, linear, angular })
            }
        }
    }

    /// Up to so many configurations that meet the request and differ from each other, the nearest to the posture, or
    /// else to the start, first: all there are of a closed form, and what is found of others.
    ///
    /// # Panics
    /// As [`Solver::solve`].
    pub fn solutions(&mut self, request: &Request, most: usize) -> Vec<Solution> {
        let mut found = self.by_closed_form(request);
        if found.is_empty() {
            self.collect(request, most as u32, &mut found);
            sort(request, &mut found);
        }
        found.truncate(most);
        found
    }

    /// All solutions of the closed form, the nearest first; none where there is no such form, or where not all variables
    /// may move freely.
    fn by_closed_form(&self, request: &Request) -> Vec<Solution> {
        let Some(closed) = self.closed.as_ref().filter(|_| request.is_free() && request.facing == Facing::Exactly)
        else {
            return Vec::new();
        };
        let wish = request.posture.unwrap_or(request.start);
        let solution = |q: Vec<f64>| {
            let (linear, angular) = request.off(&self.chain.tip(&q));
            Solution { q, linear, angular, attempts: 0 }
        };
        let mut found: Vec<_> = closed.solve(&self.chain, &request.target, wish).into_iter().map(solution).collect();
        found.retain(|s| s.linear <= request.linear && s.angular <= request.angular);
        sort(request, &mut found);
        found
    }

    /// Searches from one start after the other until so many different solutions are found or all starts are used up.
    /// Returns the configuration nearest to the target of those that do not reach it.
    fn collect(&mut self, request: &Request, most: u32, found: &mut Vec<Solution>) -> Vec<f64> {
        let mut starts = Starts::new(self.chain.variables(), request);
        let mut nearest: Option<(f64, Vec<f64>)> = None;
        let mut last = request.attempts.max(1);
        let mut attempt = 0;
        while attempt < last && found.len() < most as usize {
            attempt += 1;
            let mut q = starts.next(&self.chain);
            let cost = self.descent.run(&self.chain, request, &mut q);
            if request.is_met(&self.chain.tip(&q)) {
                let wish = request.posture.unwrap_or(request.start);
                unwind(self.chain.variables(), wish, &mut q);
                if request.posture.is_some() || !request.is_free() {
                    posture::settle(&mut self.descent, &self.chain, request, wish, &mut q);
                }
                let (linear, angular) = request.off(&self.chain.tip(&q));
                if found.is_empty() {
                    // A target may have fewer solutions than are asked for: others are looked for a little longer.
                    last = last.min(attempt + 3 * most);
                }
                if found.iter().all(|other| squared(&other.q, &q) > ALIKE * ALIKE) {
                    found.push(Solution { q, linear, angular, attempts: attempt });
                }
            } else if found.is_empty() && nearest.as_ref().is_none_or(|(least, _)| cost < *least) {
                nearest = Some((cost, q));
            }
        }
        nearest.map_or_else(|| request.start.to_vec(), |(_, q)| q)
    }
}

/// Configurations nearer to each other than this count as one; rad or m.
const ALIKE: f64 = 1e-2;

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The nearest to the posture, or else to the start, first.
fn sort(request: &Request, found: &mut [Solution]) {
    let wish = request.posture.unwrap_or(request.start);
    found.sort_by(|a, b| request.distance(&a.q, wish).total_cmp(&request.distance(&b.q, wish)));
}

/// Takes each turning variable by whole turns as near to a wish as its limits allow.
fn unwind(variables: &[Variable], wish: &[f64], q: &mut [f64]) {
    use std::f64::consts::TAU;
    for ((variable, &wish), q) in variables.iter().zip(wish).zip(q) {
        if variable.kind == matterix_ir::robot::JointKind::Prismatic {
            continue;
        }
        let limits = &variable.limits;
        let turns = ((wish - *q) / TAU).round();
        // The nearest turn may be beyond a limit; then the last one before it.
        let least = ((limits.lower - *q) / TAU).ceil();
        let most = ((limits.upper - *q) / TAU).floor();
        if least <= most {
            let moved = *q + TAU * turns.clamp(least, most);
            if moved >= limits.lower && moved <= limits.upper {
                *q = moved;
            }
        }
    }
}
