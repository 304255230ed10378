//! A made-up arm of seven joints: its links and where they are.

use matterix_ir::robot::{Link, Piece, Placement, Robot, Solid};

/// Distance of each joint from the one before it, m, and whether it turns about y instead of z.
const JOINTS: [([f64; 3], bool); 7] = [
    ([0.0, 0.0, 0.33], false),
    ([0.0, 0.0, 0.0], true),
    ([0.0, 0.0, 0.32], false),
    ([0.08, 0.0, 0.0], true),
    ([-0.08, 0.0, 0.38], false),
    ([0.0, 0.0, 0.0], true),
    ([0.09, 0.0, 0.0], false),
];

/// The arm as a robot description.
pub fn robot() -> Robot {
    const WHITE: [f64; 4] = [0.93, 0.94, 0.95, 1.0];
    const DARK: [f64; 4] = [0.22, 0.24, 0.27, 1.0];
    let piece = |at: [f64; 3], solid: Solid, color: [f64; 4]| Piece {
        placement: Placement { position: at, ..Placement::default() },
        solid,
        color: Some(color),
    };
    let barrel = |r: f64, l: f64, z: f64| piece([0.0, 0.0, z], Solid::Cylinder([r, l]), WHITE);
    let links = [
        vec![barrel(0.09, 0.05, 0.025), barrel(0.062, 0.22, 0.15)],
        vec![barrel(0.062, 0.09, -0.03), piece([0.0; 3], Solid::Sphere(0.066), DARK)],
        vec![barrel(0.055, 0.2, 0.12)],
        vec![barrel(0.055, 0.08, -0.03), piece([0.08, 0.0, 0.0], Solid::Sphere(0.06), DARK)],
        vec![piece([-0.08, 0.0, 0.16], Solid::Cylinder([0.05, 0.24]), WHITE)],
        vec![piece([0.0; 3], Solid::Sphere(0.054), DARK), barrel(0.048, 0.1, -0.05)],
        vec![piece([0.045, 0.0, 0.0], Solid::Cuboid([0.11, 0.09, 0.08]), WHITE)],
        vec![
            piece([0.0, 0.0, 0.07], Solid::Cylinder([0.035, 0.06]), DARK),
            piece([0.0, 0.0, 0.11], Solid::Cuboid([0.05, 0.14, 0.03]), WHITE),
            piece([0.0, 0.045, 0.155], Solid::Cuboid([0.02, 0.012, 0.07]), DARK),
            piece([0.0, -0.045, 0.155], Solid::Cuboid([0.02, 0.012, 0.07]), DARK),
        ],
    ];
    let link = |(i, visual): (usize, Vec<Piece>)| Link {
        name: format!("link{i}"),
        inertial: None,
        visual,
        collision: Vec::new(),
    };
    Robot { name: "arm".into(), links: links.into_iter().enumerate().map(link).collect(), ..Robot::default() }
}

/// Where the links are for a configuration, from a base at `base`; the last entry is the grip.
pub fn links(base: [f64; 3], turns: [f64; 7]) -> Vec<Placement> {
    let mut at = Placement { position: base, ..Placement::default() };
    let mut found = vec![at];
    for ((offset, about_y), turn) in JOINTS.iter().zip(turns) {
        let half = turn / 2.0;
        let (s, c) = (half.sin(), half.cos());
        let rotation = if *about_y { [0.0, s, 0.0, c] } else { [0.0, 0.0, s, c] };
        at = then(at, Placement { position: *offset, rotation });
        found.push(at);
    }
    found.push(then(at, Placement { position: [0.0, 0.0, 0.17], ..Placement::default() }));
    found
}

/// `inner`, given in the frame of `outer`, in the frame that `outer` is given in.
pub fn then(outer: Placement, inner: Placement) -> Placement {
    let ([x, y, z, w], [px, py, pz]) = (outer.rotation, inner.position);
    let [tx, ty, tz] = [2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)];
    let moved = [px + w * tx + y * tz - z * ty, py + w * ty + z * tx - x * tz, pz + w * tz + x * ty - y * tx];
    let [bx, by, bz, bw] = inner.rotation;
    let rotation = [
        w * bx + x * bw + y * bz - z * by,
        w * by - x * bz + y * bw + z * bx,
        w * bz + x * by - y * bx + z * bw,
        w * bw - x * bx - y * by - z * bz,
    ];
    let at = outer.position;
    Placement { position: [at[0] + moved[0], at[1] + moved[1], at[2] + moved[2]], rotation }
}
