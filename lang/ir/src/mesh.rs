//! Triangles, as files of meshes bring them.

use serde::{Deserialize, Serialize};

/// A surface of triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// The file it is from.
    pub name: String,
    /// Corners; m, unless it was read without a unit.
    pub points: Vec<[f64; 3]>,
    /// Three corners each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Whether all its triangles have their corners, and these are numbers.
    pub fn is_sound(&self) -> bool {
        self.triangles.iter().flatten().all(|i| (*i as usize) < self.points.len())
            && self.points.iter().flatten().all(|v| v.is_finite())
    }

    /// Least and greatest coordinates.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for point in &self.points {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(point[k]);
                bounds[1][k] = bounds[1][k].max(point[k]);
            }
        }
        if self.points.is_empty() { [[0.0; 3]; 2] } else { bounds }
    }

    /// Edges of the box around it.
    pub fn size(&self) -> [f64; 3] {
        let [low, high] = self.bounds();
        std::array::from_fn(|k| high[k] - low[k])
    }

    /// Stretched along x, y, z; mirrored where a factor is below 0.
    pub fn scaled(mut self, by: [f64; 3]) -> Self {
        for point in &mut self.points {
            (0..3).for_each(|k| point[k] *= by[k]);
        }
        if by.iter().product::<f64>() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// Moved so that the middle of the base of the box around it is the origin.
    pub fn grounded(mut self) -> Self {
        let [low, high] = self.bounds();
        let origin = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]];
        for point in &mut self.points {
            (0..3).for_each(|k| point[k] -= origin[k]);
        }
        self
    }
}
