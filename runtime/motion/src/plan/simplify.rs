//! Makes a way shorter: leaves out detours, then rounds corners and leaves out what that made needless.

use super::judge::Judge;
use super::path::{Way, gap};

/// Least distance a corner must move for it to be worth two checks; rad.
const WORTH: f32 = 0.1;

/// A way with the same ends that is free where the given one was, and never longer.
pub(crate) fn simplify(judge: &mut impl Judge, mut way: Way, rounds: usize) -> Way {
    if way.len() < 3 {
        return way;
    }
    let dims = way.point(0).len();
    let mut vector = vec![0.0; dims];
    let length = gap(way.point(0), way.point(way.len() - 1), &mut vector);
    if judge.allows_way(way.point(0), &vector, length) {
        let last = way.len() - 1;
        way.cut(1, last);
        return way;
    }
    for _ in 0..rounds {
        let shorter = shortcut(judge, &mut way, &mut vector);
        let rounder = round(judge, &mut way, &mut vector);
        if !shorter && !rounder {
            break;
        }
    }
    way
}

/// From every point straight to the farthest one that can be reached so.
fn shortcut(judge: &mut impl Judge, way: &mut Way, vector: &mut [f32]) -> bool {
    let mut changed = false;
    let mut i = 0;
    while i + 2 < way.len() {
        for j in (i + 2..way.len()).rev() {
            let length = gap(way.point(i), way.point(j), vector);
            if judge.allows_way(way.point(i), vector, length) {
                way.cut(i + 1, j);
                changed = true;
                break;
            }
        }
        i += 1;
    }
    changed
}

/// Moves corners to where a spline through the middles of their lines would pass.
fn round(judge: &mut impl Judge, way: &mut Way, vector: &mut [f32]) -> bool {
    if way.len() < 3 {
        return false;
    }
    way.halve();
    let mut changed = false;
    let mut middle = vec![0.0; vector.len()];
    for i in (2..way.len() - 1).step_by(2) {
        let (before, here, after) = (way.point(i - 1), way.point(i), way.point(i + 1));
        for (m, ((b, h), a)) in middle.iter_mut().zip(before.iter().zip(here).zip(after)) {
            *m = 0.25 * (b + a) + 0.5 * h;
        }
        if gap(here, &middle, vector) <= WORTH {
            continue;
        }
        let length = gap(before, &middle, vector);
        if !judge.allows_way(before, vector, length) {
            continue;
        }
        let length = gap(&middle, after, vector);
        if judge.allows_way(&middle, vector, length) {
            way.set(i, &middle);
            changed = true;
        }
    }
    changed
}
