//! Bodies as they are, and exact distances between them.
//!
//! Planning covers robots with balls and takes vessels for full, which is quick and errs on the safe side. Here a vessel
//! has walls and a floor, a link its cylinders and boxes, a mesh its convex pieces. Distances are those of parry (GJK and
//! EPA on convex pieces). Round walls are prisms of [`turned::SIDES`] sides around the true circle.

mod body;
mod bored;
mod made;
mod mesh;
mod place;
pub mod turned;

pub use body::{Body, Touch};
pub use made::{Bodies, Made};
pub use mesh::MESH_CELLS;
pub use parry3d_f64::math::{Pose as Isometry, Vector};
pub use place::{isometry, pose};
