//! Meshes in convex pieces.

use matterix_ir::mesh::Mesh;
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{ConvexPolyhedron, SharedShape};
use parry3d_f64::transformation::try_convex_hull;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};

/// Cells along the longest edge of a mesh by which it is taken apart; pieces stand out of it by one cell at most.
const CELLS: u32 = 96;
/// The same, as a number to divide by.
pub const MESH_CELLS: f64 = CELLS as f64;

/// A mesh that fills its hull up to this share is taken for convex.
const CONVEX: f64 = 0.99;

/// The convex pieces of a mesh: its hull where it is convex, else cells gathered into hulls (approximate convex
/// decomposition by volume, Mamou 2016, as parry does it).
pub(crate) fn pieces(mesh: &Mesh) -> Vec<SharedShape> {
    let points: Vec<Vector> = mesh.points.iter().map(|p| Vector::from(*p)).collect();
    if let Ok((corners, sides)) = try_convex_hull(&points)
        && volume(&points, &mesh.triangles) >= CONVEX * volume(&corners, &sides)
    {
        return hull(&points).into_iter().collect();
    }
    let parameters = VHACDParameters { resolution: CELLS, ..VHACDParameters::default() };
    let parts = VHACD::decompose(&parameters, &points, &mesh.triangles, false);
    parts.compute_convex_hulls(1).into_iter().filter_map(|(corners, _)| hull(&corners)).collect()
}

/// The convex hull of points; none where they lie in a plane.
pub(crate) fn hull(points: &[Vector]) -> Option<SharedShape> {
    let (corners, sides) = try_convex_hull(points).ok()?;
    ConvexPolyhedron::from_convex_mesh(corners, &sides).map(SharedShape::new)
}

/// The room within a closed surface (divergence theorem), m3.
fn volume(points: &[Vector], triangles: &[[u32; 3]]) -> f64 {
    let part = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(part).sum::<f64>().abs()
}
