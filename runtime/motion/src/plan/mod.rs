//! Collision-free ways from one configuration to another.

mod connect;
mod judge;
mod nearest;
mod path;
mod simplify;
mod straight;
mod upright;

pub use judge::Judge;
pub use straight::{Blocked, Stride, between, straight};
pub use upright::{Level, Upright, plan_upright};

use crate::spheres::{Checker, Contact};

/// How a way is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Longest line of a tree; rad.
    pub range: f64,
    /// How many samples are drawn before the search gives up.
    pub iterations: usize,
    /// How much is looked at before it gives up: blocks of eight configurations, as [`Checker::effort`] counts them.
    pub effort: u64,
    /// How far around a node that failed once samples are still taken up; rad.
    pub domain: f64,
    /// By what share that distance shrinks with every further failure.
    pub shrink: f64,
    /// What it never shrinks below; rad.
    pub least_domain: f64,
    /// How often a way found is shortened and rounded.
    pub rounds: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            range: 1.0,
            iterations: 1_000_000,
            effort: u64::MAX,
            domain: 4.0,
            shrink: 1e-4,
            least_domain: 1.0,
            rounds: 5,
        }
    }
}

/// Samples drawn among true shapes, where each takes some hundred times as long.
const ASKING: usize = 500;

impl Settings {
    /// The same for the first of two searches.
    fn first(&self) -> Self {
        Self { effort: self.effort.div_ceil(2), ..*self }
    }

    /// The same for a search in which a referee is asked, when so much has been looked at.
    fn asking(&self, spent: u64) -> Self {
        Self { iterations: self.iterations.min(ASKING), effort: self.effort.saturating_sub(spent), ..*self }
    }
}

/// One of the two ends of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where it begins.
    Start,
    /// Where it shall lead.
    Goal,
}

/// Why there is no way.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// An end has this many coordinates instead of the robot's.
    Size(End, usize),
    /// An end is outside of the limits of this variable (index among the planned ones), with its value; rad or m.
    Limits(End, usize, f64),
    /// An end is in collision; deepest contact first.
    Collision(End, Vec<Contact>),
    /// At an end the tip tilts by this much, more than it may; rad.
    Tilt(End, f64),
    /// No way was found with this many samples.
    Unreached(usize),
}

/// A way that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Configurations joined by straight lines, from start to goal.
    pub points: Vec<Vec<f64>>,
    /// Its length over all variables together; rad.
    pub cost: f64,
    /// How many samples the search drew.
    pub iterations: usize,
}

/// A planner's way before it is made shorter; see [`search`].
#[derive(Clone, Debug)]
pub struct Draft {
    way: path::Way,
    start: Vec<f64>,
    goal: Vec<f64>,
    /// How many samples the search drew.
    pub iterations: usize,
}

/// How far beyond a limit still counts as within it: what rounding to 32 bits can do; rad.
const SLACK: f64 = 1e-6;

fn within(checker: &Checker, q: &[f64], which: End) -> Result<Vec<f32>, Failure> {
    let limits = checker.figure().limits();
    if q.len() != limits.len() {
        return Err(Failure::Size(which, q.len()));
    }
    let outside = |(&x, l): (&f64, &[f64; 2])| !(l[0] - SLACK..=l[1] + SLACK).contains(&x);
    if let Some(i) = q.iter().zip(limits).position(outside) {
        return Err(Failure::Limits(which, i, q[i]));
    }
    Ok(q.iter().map(|&x| x as f32).collect())
}

/// Searches a way, long and angular as it may be.
pub fn search(checker: &mut Checker, start: &[f64], goal: &[f64], settings: &Settings) -> Result<Draft, Failure> {
    let from = within(checker, start, End::Start)?;
    let to = within(checker, goal, End::Goal)?;
    if !checker.are_free(&[from.as_slice(), to.as_slice()].concat()) {
        let (q, which) = if checker.is_free(&from) { (goal, End::Goal) } else { (start, End::Start) };
        return Err(Failure::Collision(which, checker.contacts(q)));
    }
    let found = connect::connect(checker, &from, &to, settings);
    match found.way {
        Some(way) => Ok(Draft { way, start: start.to_vec(), goal: goal.to_vec(), iterations: found.iterations }),
        None => Err(Failure::Unreached(found.iterations)),
    }
}

impl Draft {
    /// Its length over all variables together; rad.
    pub fn cost(&self) -> f64 {
        f64::from(self.way.cost())
    }

    /// The same way made shorter.
    pub fn simplified(self, checker: &mut Checker, settings: &Settings) -> Route {
        let way = simplify::simplify(checker, self.way, settings.rounds);
        rounded(&way, &self.start, &self.goal, self.iterations)
    }
}

/// A way with its ends as they were asked for, before they were rounded to 32 bits.
fn rounded(way: &path::Way, start: &[f64], goal: &[f64], iterations: usize) -> Route {
    let mut points = way.points();
    if let [first, .., last] = points.as_mut_slice() {
        first.copy_from_slice(start);
        last.copy_from_slice(goal);
    }
    Route { points, cost: f64::from(way.cost()), iterations }
}

/// A short collision-free way, the same for the same question on every machine.
///
/// Where there is none among balls and the checker has a referee, one is searched among true shapes.
pub fn plan(checker: &mut Checker, start: &[f64], goal: &[f64], settings: &Settings) -> Result<Route, Failure> {
    checker.ask(false);
    let before = checker.effort();
    let found = match search(checker, start, goal, &settings.first()) {
        Err(Failure::Collision(..) | Failure::Unreached(_)) if checker.ask(true) => {
            let spent = checker.effort() - before;
            search(checker, start, goal, &settings.asking(spent))
        }
        found => found,
    };
    Ok(found?.simplified(checker, settings))
}
