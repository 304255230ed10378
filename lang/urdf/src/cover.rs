//! Spheres that cover a robot, and links that a joint keeps in touch.

use matterix_ir::robot::{Ball, JointKind, Piece, Robot, Solid};

/// How far a sphere may stand out of a cylinder or cuboid it covers, relative to its half width.
const SLACK: f64 = 0.12;

/// Spheres that together cover the collision shapes of all links; none where one of them is a mesh that is not known.
pub(crate) fn balls(robot: &Robot) -> Vec<Ball> {
    let mut balls = Vec::new();
    for (link, body) in robot.links.iter().enumerate() {
        for piece in &body.collision {
            let Some(spheres) = spheres(robot, &piece.solid) else { return Vec::new() };
            let ball = |(center, radius)| Ball { link: link as u32, center: placed(piece, center), radius };
            balls.extend(spheres.into_iter().map(ball));
        }
    }
    balls
}

/// Spheres that cover a solid, about its middle; `None` for meshes.
fn spheres(robot: &Robot, solid: &Solid) -> Option<Vec<([f64; 3], f64)>> {
    match *solid {
        Solid::Mesh(ref name, scale) => {
            // The box around it is covered; true shapes decide where that is too much.
            let [low, high] = robot.meshes.get(name)?.bounds();
            let middle: [f64; 3] = std::array::from_fn(|k| scale[k] * (low[k] + high[k]) / 2.0);
            let cells = grid(std::array::from_fn(|k| (scale[k] * (high[k] - low[k])).abs()));
            Some(cells.into_iter().map(|(c, r)| (std::array::from_fn(|k| c[k] + middle[k]), r)).collect())
        }
        Solid::Sphere(radius) => Some(vec![([0.0; 3], radius)]),
        Solid::Cylinder([radius, length]) => {
            // The ends of slice i lie on a sphere about its middle; a flat disc is covered as a cuboid is.
            if length < radius {
                return Some(grid([2.0 * radius, 2.0 * radius, length]));
            }
            let (count, slice) = slices(length, 2.0 * radius);
            let bound = (radius * radius + 0.25 * slice * slice).sqrt();
            Some((0..count).map(|i| ([0.0, 0.0, middle(i, slice, length)], bound)).collect())
        }
        Solid::Cuboid(edges) => Some(grid(edges)),
    }
}

/// One sphere about each of the equal cells of a cuboid.
fn grid(edges: [f64; 3]) -> Vec<([f64; 3], f64)> {
    let least = edges.iter().copied().fold(f64::INFINITY, f64::min);
    // Cells are no finer than a sixth of the longest edge: a plate is not worth a thousand spheres.
    let longest = edges.iter().copied().fold(0.0, f64::max);
    let cell = least.max(longest / 6.0);
    let cut = edges.map(|edge| {
        let count = (edge / cell - 1e-9).ceil().max(1.0) as usize;
        (count, edge / count as f64)
    });
    let [(nx, x), (ny, y), (nz, z)] = cut;
    let radius = 0.5 * (x * x + y * y + z * z).sqrt();
    let mut spheres = Vec::with_capacity(nx * ny * nz);
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let center = [middle(i, x, edges[0]), middle(j, y, edges[1]), middle(k, z, edges[2])];
                spheres.push((center, radius));
            }
        }
    }
    spheres
}

/// Into how many slices a length is cut, and how long each is, so that spheres stand out by the slack at most.
fn slices(length: f64, width: f64) -> (usize, f64) {
    // sqrt(1 + (slice / width)^2) = 1 + slack.
    let longest = width * ((1.0 + SLACK) * (1.0 + SLACK) - 1.0).sqrt();
    let count = (length / longest - 1e-9).ceil().clamp(1.0, 64.0);
    (count as usize, length / count)
}

fn middle(index: usize, slice: f64, length: f64) -> f64 {
    (index as f64 + 0.5) * slice - 0.5 * length
}

/// A point of a piece, seen from its link.
fn placed(piece: &Piece, [a, b, c]: [f64; 3]) -> [f64; 3] {
    let [x, y, z, w] = piece.placement.rotation;
    // v + 2 w (u x v) + 2 u x (u x v) with u the vector part.
    let t = [2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)];
    let [p, q, r] = piece.placement.position;
    [
        p + a + w * t[0] + y * t[2] - z * t[1],
        q + b + w * t[1] + z * t[0] - x * t[2],
        r + c + w * t[2] + x * t[1] - y * t[0],
    ]
}

/// Pairs of links that one joint, or none, moves relative to each other.
pub(crate) fn touching(robot: &Robot) -> Vec<[u32; 2]> {
    // Links without a joint that moves between them are one body.
    let mut body: Vec<u32> = (0..robot.links.len() as u32).collect();
    for joint in robot.joints.iter().filter(|j| j.kind == JointKind::Fixed) {
        body[joint.child as usize] = body[joint.parent as usize];
    }
    // The body each body hangs on.
    let mut above: Vec<Option<u32>> = vec![None; robot.links.len()];
    for joint in robot.joints.iter().filter(|j| j.kind != JointKind::Fixed) {
        above[joint.child as usize] = Some(body[joint.parent as usize]);
    }
    let solid: Vec<u32> =
        (0..robot.links.len() as u32).filter(|&l| !robot.links[l as usize].collision.is_empty()).collect();
    let mut pairs = Vec::new();
    for (i, &a) in solid.iter().enumerate() {
        for &b in &solid[i + 1..] {
            let (one, other) = (body[a as usize], body[b as usize]);
            if one == other || above[one as usize] == Some(other) || above[other as usize] == Some(one) {
                pairs.push([a, b]);
            }
        }
    }
    pairs
}
