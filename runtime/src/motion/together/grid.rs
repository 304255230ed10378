//! Whether any order of the motions of two lines leads both to their ends.

use matterix_ir::scene::InstanceId;
use matterix_motion::meet::Gap;
use matterix_motion::spheres::Placed;

use super::leg::{Leg, overlap};

/// Overlaps less deep than this are no proof: shapes are nominal, m.
const DEEP: f64 = 5e-3;

/// Motions of one line of steps, in order.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// What it carries out.
    pub legs: Vec<Leg>,
    /// Whether all of it is done one after the other and in every run.
    pub strict: bool,
}

impl Line {
    /// Its robots, each once.
    fn robots(&self) -> Vec<InstanceId> {
        let mut all: Vec<InstanceId> = self.legs.iter().map(|l| l.robot).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Where a robot stands when so many motions are done, with the motion that says so.
    fn rest(&self, robot: InstanceId, done: usize) -> Option<(&Leg, &[Placed])> {
        let own = |leg: &&Leg| leg.robot == robot;
        let next = self.legs.iter().skip(done).find(own).map(|leg| (leg, leg.begin()));
        next.or_else(|| self.legs.iter().rfind(own).map(|leg| (leg, leg.end())))
    }
}

/// The motions of two lines that get in each other's way, and where, if no order leads both lines to their ends.
pub fn deadlock<'l>(a: &'l Line, b: &'l Line) -> Option<(&'l Leg, &'l Leg, Gap)> {
    if !a.strict || !b.strict {
        return None;
    }
    let (rows, columns) = (a.legs.len(), b.legs.len());
    if standing(a, 0, b, 0).is_some() {
        return None;
    }
    let mut open = vec![false; (rows + 1) * (columns + 1)];
    open[0] = true;
    let mut met = None;
    for i in 0..=rows {
        for j in 0..=columns {
            if (i, j) == (0, 0) {
                continue;
            }
            let at = |i: usize, j: usize| i * (columns + 1) + j;
            let here = standing(a, i, b, j);
            let down = i > 0 && open[at(i - 1, j)];
            let right = j > 0 && open[at(i, j - 1)];
            if let Some(clash) = here {
                if down || right {
                    met = Some(clash);
                }
                continue;
            }
            let passes = |leg: &Leg, others: &Line, done: usize| {
                let way = |robot| others.rest(robot, done).and_then(|(_, at)| leg.meets(at, DEEP));
                !leg.straight || others.robots().into_iter().all(|robot| way(robot).is_none())
            };
            open[at(i, j)] = (down && passes(&a.legs[i - 1], b, j)) || (right && passes(&b.legs[j - 1], a, i));
        }
    }
    if open.last() == Some(&true) {
        return None;
    }
    standing(a, rows, b, columns).or(met)
}

/// How robots of two lines that have done so many motions stand in each other.
fn standing<'l>(a: &'l Line, i: usize, b: &'l Line, j: usize) -> Option<(&'l Leg, &'l Leg, Gap)> {
    for (one, at) in a.robots().into_iter().filter_map(|r| a.rest(r, i)) {
        for (other, there) in b.robots().into_iter().filter_map(|r| b.rest(r, j)) {
            if let Some(gap) = overlap(at, there, DEEP) {
                return Some((one, other, gap));
            }
        }
    }
    None
}
