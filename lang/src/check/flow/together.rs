//! Faces of a box that push each other out: two bodies in good contact, of which each is warmed by the other as far as its face lies.
//! Moved one at a time they would run away, as each has to come to rest a little beyond the other. Together they are moved to where
//! the rates at all of them point inwards, by the slopes of the rates.

use std::collections::BTreeSet;

use super::Interpreter;
use super::bracket::last_outwards;
use super::evolve::{CLOSE_IN, Making, Wall};
use super::state::AbstractState;

/// So many faces are moved together.
const MOST: usize = 16;

/// By this share of its distance from the start, at most, a face is moved to find how rates change with it.
const TRIAL: f64 = 1e-3;

/// By this share a crossed face is moved further than to where nothing crosses it.
const BEYOND: f64 = 0.05;

/// A rate that is this small a share of what moves a face by its distance points neither way.
const LEVEL: f64 = 1e-6;

impl Interpreter<'_, '_> {
    /// Moves faces that cross each other's way out together; the derivatives that have to be looked at again are added to `due`.
    pub(super) fn settle_together(&mut self, facts: &AbstractState, making: &mut Making, due: &mut BTreeSet<u32>) {
        for upper in [true, false] {
            let walls = self.moved_out(upper, facts, making);
            if !(2..=MOST).contains(&walls.len()) {
                continue;
            }
            let Some(further) = self.common_step(&walls, upper, facts, making) else { continue };
            // What stays where it is, as a state that has come to its end, is not brought in with the others.
            let moved = walls.iter().zip(&further).filter(|(_, by)| **by > 0.0);
            making.together[usize::from(upper)] = moved.map(|(wall, _)| *wall).collect();
            for (wall, by) in walls.iter().zip(further) {
                self.move_out(*wall, upper, by, facts, making);
                let (Wall::Whole(i) | Wall::Apart(i)) = *wall;
                due.insert(i);
                due.extend(self.rates_of.get(&self.derivatives[i as usize].state).into_iter().flatten());
            }
        }
    }

    /// Brings all faces in that were moved out together, by the same share of their ways, as far as nothing crosses them.
    pub(super) fn narrow_together(&mut self, facts: &AbstractState, making: &mut Making) {
        for upper in [true, false] {
            let walls = std::mem::take(&mut making.together[usize::from(upper)]);
            let ways: Vec<f64> = walls.iter().map(|wall| self.way(*wall, upper, facts, making)).collect();
            if walls.is_empty() || ways.iter().any(|way| !way.is_finite()) {
                continue;
            }
            // How fast the face that is crossed most is crossed.
            let share = last_outwards(0.0, 1.0, CLOSE_IN, |share| {
                self.place(&walls, &ways, share, upper, facts, making);
                walls.iter().map(|wall| self.outflow(*wall, upper, making)).fold(0.0, f64::max)
            });
            self.place(&walls, &ways, share, upper, facts, making);
        }
    }

    /// The walls of which the face on one side has moved out, and not without bound.
    fn moved_out(&mut self, upper: bool, facts: &AbstractState, making: &Making) -> Vec<Wall> {
        let mut walls = self.walls(making);
        walls.retain(|wall| {
            let way = self.way(*wall, upper, facts, making);
            way.is_finite() && way > 0.0
        });
        walls
    }

    /// How far a face has moved out.
    fn way(&self, wall: Wall, upper: bool, facts: &AbstractState, making: &Making) -> f64 {
        let ((low, high), (from, to)) = (self.faces(wall, making), self.begins(wall, facts));
        if upper { high - to } else { from - low }
    }

    fn move_out(&mut self, wall: Wall, upper: bool, by: f64, facts: &AbstractState, making: &mut Making) {
        let (low, high) = self.faces(wall, making);
        let faces = if upper { (low, high + by) } else { (low - by, high) };
        self.set_faces(wall, faces, facts, making);
    }

    /// Puts faces at a share of their ways.
    fn place(
        &mut self,
        walls: &[Wall],
        ways: &[f64],
        share: f64,
        upper: bool,
        facts: &AbstractState,
        making: &mut Making,
    ) {
        for (wall, way) in walls.iter().zip(ways) {
            let by = share * way - self.way(*wall, upper, facts, making);
            self.move_out(*wall, upper, by, facts, making);
        }
    }

    /// How fast what a wall is of moves outwards at its face; 0 or less where nothing crosses it.
    fn outflow(&mut self, wall: Wall, upper: bool, making: &mut Making) -> f64 {
        let (Wall::Whole(i) | Wall::Apart(i)) = wall;
        self.rate(i, &making.within);
        let (low, high) = self.faces(wall, making);
        if upper { self.rate_at(wall, high, making).1 } else { -self.rate_at(wall, low, making).0 }
    }

    /// How far each of these faces has to move out so that nothing crosses any of them, by the slopes of the rates; none where that does
    /// not tell.
    fn common_step(
        &mut self,
        walls: &[Wall],
        upper: bool,
        facts: &AbstractState,
        making: &mut Making,
    ) -> Option<Vec<f64>> {
        let outflows = |flow: &mut Self, making: &mut Making| -> Vec<f64> {
            walls.iter().map(|wall| flow.outflow(*wall, upper, making)).collect()
        };
        let now = outflows(self, making);
        let ways: Vec<f64> = walls.iter().map(|wall| self.way(*wall, upper, facts, making)).collect();
        // A row for each face: how its outflow falls as each of them moves out.
        let mut rows = vec![Vec::with_capacity(walls.len()); walls.len()];
        for (wall, way) in walls.iter().zip(&ways) {
            let before = self.faces(*wall, making);
            self.move_out(*wall, upper, TRIAL * way, facts, making);
            let then = outflows(self, making);
            self.set_faces(*wall, before, facts, making);
            for ((row, then), now) in rows.iter_mut().zip(then).zip(&now) {
                row.push((now - then) / (TRIAL * way));
            }
        }
        // A face that nothing crosses, however far it lies, stays where it is.
        let stays = |i: &usize| rows[*i][*i] <= 0.0 && now[*i] <= 0.0;
        let moved: Vec<usize> = (0..walls.len()).filter(|i| !stays(i)).collect();
        let side = |i: usize| now[i].max(0.0) * (1.0 + BEYOND) + LEVEL * (rows[i][i] * ways[i]).abs();
        let row = |i: &usize| moved.iter().map(|j| rows[*i][*j]).chain([side(*i)]).collect();
        let found = solved(moved.iter().map(row).collect())?;
        let mut further = vec![0.0; walls.len()];
        moved.iter().zip(found).for_each(|(i, by)| further[*i] = by);
        further.iter().all(|by| by.is_finite() && *by >= 0.0).then_some(further)
    }
}

/// The solution of linear equations, each row with its right side last; none where there is no single one.
fn solved(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let n = rows.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let head = rows[column].clone();
        if head[column] == 0.0 || !head[column].is_finite() {
            return None;
        }
        for row in rows.iter_mut().skip(column + 1) {
            let share = row[column] / head[column];
            row.iter_mut().zip(&head).skip(column).for_each(|(a, b)| *a -= share * b);
        }
    }
    let mut out = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * out[j]).sum();
        out[i] = (rows[i][n] - known) / rows[i][i];
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let rows = vec![vec![0.0, 2.0, 4.0], vec![3.0, 1.0, 8.0]];
        assert_eq!(solved(rows), Some(vec![2.0, 2.0]));
        assert_eq!(solved(vec![vec![1.0, 1.0, 1.0], vec![1.0, 1.0, 2.0]]), None);
    }
}
