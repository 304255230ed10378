//! Links that are always in touch, as far as their spheres can tell: parts of one housing, or pins a tree cannot describe.

use matterix_ir::robot::{Ball, Robot};
use nalgebra::{Point3, Vector3};

use crate::chain::Tree;
use crate::inverse::unit;
use crate::variables::{Malformed, Variable};

/// Configurations looked at.
const LOOKS: u64 = 200;

/// Pairs of links, by index, the lower first, whose spheres overlap in every one of a number of configurations spread
/// over the limits. To tell them to collide would be to tell nothing.
pub fn always_touching(robot: &Robot) -> Result<Vec<[u32; 2]>, Malformed> {
    let tree = Tree::new(robot)?;
    let count = tree.variables().len() as u64;
    let drawn = |look: u64| -> Vec<f64> {
        let draw = |(i, v): (usize, &Variable)| {
            let (low, high) = if v.is_bounded() { (v.limits.lower, v.limits.upper) } else { (-3.0, 3.0) };
            low + (high - low) * unit(1, look * count + i as u64)
        };
        tree.variables().iter().enumerate().map(draw).collect()
    };
    let mut always = overlapping(robot, &tree, &drawn(0));
    for look in 1..LOOKS {
        let placed = placed(robot, &tree, &drawn(look));
        always.retain(|&[a, b]| overlap(&placed[a as usize], &placed[b as usize]));
    }
    Ok(always)
}

/// The pairs of links whose spheres overlap in a configuration, by index, the lower first.
///
/// # Panics
/// If `q` is shorter than the tree's variables.
pub fn overlapping(robot: &Robot, tree: &Tree, q: &[f64]) -> Vec<[u32; 2]> {
    let placed = placed(robot, tree, q);
    let links = 0..placed.len();
    let pairs = links.flat_map(|a| (a + 1..placed.len()).map(move |b| (a, b)));
    pairs.filter(|&(a, b)| overlap(&placed[a], &placed[b])).map(|(a, b)| [a as u32, b as u32]).collect()
}

/// Middles and radii of the spheres of each link.
type Placed = Vec<Vec<(Point3<f64>, f64)>>;

fn placed(robot: &Robot, tree: &Tree, q: &[f64]) -> Placed {
    let poses = tree.poses(q);
    let mut placed = vec![Vec::new(); robot.links.len()];
    for Ball { link, center, radius } in &robot.balls {
        let link = *link as usize;
        placed[link].push((poses[link] * Point3::from(Vector3::from(*center)), *radius));
    }
    placed
}

fn overlap(some: &[(Point3<f64>, f64)], others: &[(Point3<f64>, f64)]) -> bool {
    let meet = |(a, r): &(Point3<f64>, f64), (b, s): &(Point3<f64>, f64)| (a - b).norm_squared() < (r + s) * (r + s);
    some.iter().any(|one| others.iter().any(|other| meet(one, other)))
}
