//! Who says whether the robot may be somewhere.

use crate::spheres::Checker;

/// Says which configurations are allowed.
pub trait Judge {
    /// Configurations looked at for every unit of length (rad, or m, over all variables together).
    fn resolution(&self) -> f64;
    /// Whether all of these configurations, which follow one another, are allowed.
    fn allows(&mut self, points: &[f32]) -> bool;
    /// Whether all along `from + t * vector`, `t` above 0 and up to 1, is allowed; `length` is the vector's.
    fn allows_way(&mut self, from: &[f32], vector: &[f32], length: f32) -> bool;
}

impl Judge for Checker<'_> {
    fn resolution(&self) -> f64 {
        Checker::resolution(self)
    }

    fn allows(&mut self, points: &[f32]) -> bool {
        self.are_free(points)
    }

    fn allows_way(&mut self, from: &[f32], vector: &[f32], length: f32) -> bool {
        self.is_clear(from, vector, length)
    }
}
