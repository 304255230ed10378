//! Robots in a document: a body for every link, and a track for every link that moves.
//!
//! Where the links are is the caller's to say, in the frame of the lab: kinematics live in `matterix-motion`.

use matterix_ir::robot::{Piece as RobotPiece, Placement, Robot, Solid as RobotSolid};

use crate::document::{Body, Document, Finish, Mesh, Piece, Solid, Track};
use crate::placement::pose;
use crate::thin;

/// How far a body may be from where it is shown, m; a component of its quaternion by as much.
const TOLERANCE: f64 = 2e-4;

/// Adds the links of a robot that are seen, each where `at` has it (by link index), and gives the body of each.
///
/// `name` is the instance's; `mesh` reads a mesh by the name that the robot has for it. Of a link whose mesh is not
/// known the collision shapes are shown.
pub fn add(
    document: &mut Document,
    robot: &Robot,
    name: &str,
    at: &[Placement],
    mut mesh: impl FnMut(&str) -> Option<Mesh>,
) -> Vec<Option<u32>> {
    let parent = document.bodies.iter().position(|b| b.name == name).map(|i| i as u32);
    let mut loaded: Vec<(String, Option<u32>)> = Vec::new();
    let mut added = Vec::new();
    for (i, link) in robot.links.iter().enumerate() {
        let mut piece = |from: &RobotPiece| {
            let solid = match &from.solid {
                RobotSolid::Cuboid(size) => Solid::Cuboid(size.map(|v| v as f32)),
                RobotSolid::Cylinder(size) => Solid::Cylinder(size.map(|v| v as f32)),
                RobotSolid::Sphere(radius) => Solid::Sphere(*radius as f32),
                RobotSolid::Mesh(file, scale) => {
                    let known = loaded.iter().find(|(name, _)| name == file).map(|(_, index)| *index);
                    let index = known.unwrap_or_else(|| {
                        let index = mesh(file).map(|m| {
                            document.meshes.push(m);
                            document.meshes.len() as u32 - 1
                        });
                        loaded.push((file.clone(), index));
                        index
                    })?;
                    Solid::Mesh(index, scale.map(|v| v as f32))
                }
            };
            let color = from.color.map(|c| c.map(|v| v as f32));
            Some(Piece { pose: pose(from.placement), solid, finish: Finish::Matte, color })
        };
        let mut pieces: Vec<Piece> = link.visual.iter().filter_map(&mut piece).collect();
        if pieces.is_empty() {
            pieces = link.collision.iter().filter_map(&mut piece).collect();
        }
        if pieces.is_empty() {
            added.push(None);
            continue;
        }
        // The whole robot goes by its own name, at the first of its links that is seen.
        let first = added.iter().copied().flatten().next();
        let above = parent.or(first);
        document.bodies.push(Body {
            name: if above.is_none() { name.to_owned() } else { format!("{name}.{}", link.name) },
            parent: above,
            pose: pose(at.get(i).copied().unwrap_or_default()),
            pieces,
            ..Body::default()
        });
        added.push(Some(document.bodies.len() as u32 - 1));
    }
    added
}

/// How a body goes from placement to placement, straight and turning evenly between them, in as few poses as show it.
///
/// Two equal times are a jump. A trajectory of joints becomes a track for each link, by forward kinematics at its samples.
pub fn track(body: u32, times: &[f64], path: &[Placement]) -> Track {
    let count = times.len().min(path.len());
    let mut columns: [Vec<f64>; 7] = std::array::from_fn(|_| Vec::with_capacity(count));
    let mut last = [0.0, 0.0, 0.0, 1.0];
    for placement in &path[..count] {
        // The same rotation has two quaternions: the one nearer to the last is taken, so that all components are smooth.
        let dot: f64 = placement.rotation.iter().zip(last).map(|(a, b)| a * b).sum();
        let rotation = if dot < 0.0 { placement.rotation.map(|v| -v) } else { placement.rotation };
        last = rotation;
        for (column, value) in columns.iter_mut().zip(placement.position.into_iter().chain(rotation)) {
            column.push(value);
        }
    }
    let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let kept = thin::keep(&times[..count], &views, &[TOLERANCE; 7]);
    let at = |i: usize| Placement {
        position: [views[0][i], views[1][i], views[2][i]],
        rotation: [views[3][i], views[4][i], views[5][i], views[6][i]],
    };
    Track {
        body,
        times: kept.iter().map(|&i| times[i]).collect(),
        poses: kept.iter().map(|&i| pose(at(i))).collect(),
        smooth: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_way_needs_its_ends_only() {
        let times: Vec<f64> = (0..=100).map(f64::from).collect();
        let path: Vec<Placement> =
            times.iter().map(|t| Placement { position: [t * 0.01, 0.0, 1.0], ..Placement::default() }).collect();
        let track = track(3, &times, &path);
        assert_eq!(track.times, [0.0, 100.0]);
        assert_eq!(track.body, 3);
    }
}
