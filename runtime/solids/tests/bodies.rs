//! Bodies against each other, by hand and against closed forms.

use std::sync::Arc;

use matterix_ir::mesh::Mesh;
use matterix_ir::pose::Pose;
use matterix_ir::scene::Shape;
use matterix_solids::{Body, Isometry, Vector, isometry};
use proptest::prelude::*;

fn body(shape: &Shape) -> Body {
    Body::of_shapes([(shape, Pose::IDENTITY)]).expect("a body")
}

fn at(x: f64, y: f64, z: f64) -> Isometry {
    Isometry::from_translation(Vector::new(x, y, z))
}

/// How far two bodies are apart, looked at within half a metre; below 0 how deep.
fn apart(a: &Body, b: &Body, between: Isometry) -> f64 {
    a.touch(&Isometry::identity(), b, &between, 0.5).expect("near").distance
}

/// 60 mm wide and 80 mm high, walls of 2 mm, a floor of 3 mm.
fn beaker() -> Shape {
    let (r, h) = (0.03, 0.08);
    Shape::Turned {
        outside: vec![[0.0, 0.0], [r, 0.0], [r, h]],
        inside: vec![[0.0, 0.003], [r - 0.002, 0.003], [r - 0.002, h]],
    }
}

#[test]
fn a_vessel_has_room_inside_its_walls_and_above_its_floor() {
    let (beaker, rod) = (body(&beaker()), body(&Shape::Cylinder([0.02, 0.2])));
    // Polygons stand for circles: less than a fifth of a millimetre.
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 2e-4, "{found} is not {expected}");
    near(apart(&beaker, &rod, at(0.0, 0.0, 0.01)), 0.007);
    near(apart(&beaker, &rod, at(0.01, 0.0, 0.01)), 0.007);
    near(apart(&beaker, &rod, at(0.015, 0.0, 0.01)), 0.003);
    near(apart(&beaker, &rod, at(0.0, 0.0, 0.003)), 0.0);
    assert!(apart(&beaker, &rod, at(0.02, 0.0, 0.01)) < -1e-3, "in the wall");
    assert!(apart(&beaker, &rod, at(0.0, 0.0, 0.001)) < -1e-3, "in the floor");
    near(apart(&beaker, &rod, at(0.05, 0.0, 0.0)), 0.01);
}

#[test]
fn a_flask_lets_through_its_neck_only_what_is_thinner() {
    let outside = vec![[0.0, 0.0], [0.041, 0.0], [0.041, 0.015], [0.0175, 0.103], [0.0175, 0.132]];
    let inside = vec![[0.0, 0.002], [0.0395, 0.002], [0.0395, 0.015], [0.016, 0.103], [0.016, 0.132]];
    let flask = body(&Shape::Turned { outside, inside });
    for (wide, fits) in [(0.030, true), (0.034, false)] {
        let rod = body(&Shape::Cylinder([wide, 0.2]));
        assert_eq!(apart(&flask, &rod, at(0.0, 0.0, 0.05)) > 0.0, fits, "{wide} m");
    }
    // Beside the neck there is nothing.
    let ball = body(&Shape::Sphere(0.02));
    assert!(apart(&flask, &ball, at(0.032, 0.0, 0.11)) > 0.0);
}

/// An L of two blocks of 20 x 20 x 60 and 60 x 20 x 20 mm, as one closed surface.
fn angle() -> Mesh {
    let outline = [[0.0, 0.0], [0.06, 0.0], [0.06, 0.02], [0.02, 0.02], [0.02, 0.06], [0.0, 0.06]];
    let points = [0.0, 0.02].iter().flat_map(|y| outline.iter().map(move |[x, z]| [*x, *y, *z])).collect();
    let front = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let mut triangles: Vec<[u32; 3]> = front.to_vec();
    triangles.extend(front.map(|[a, b, c]| [a + 6, c + 6, b + 6]));
    for i in 0..6 {
        let next = (i + 1) % 6;
        triangles.extend([[i, i + 6, next + 6], [i, next + 6, next]]);
    }
    Mesh { name: "angle".into(), points, triangles }
}

#[test]
fn a_mesh_that_is_not_convex_has_room_in_its_corner() {
    let angle = body(&Shape::Mesh(Arc::new(angle())));
    let ball = body(&Shape::Sphere(0.02));
    // Spheres stand on their base: the middle is 10 mm above.
    let clearance = |x: f64, z: f64| apart(&angle, &ball, at(x, 0.01, z - 0.01));
    assert!(clearance(0.045, 0.045) > 0.012, "{}", clearance(0.045, 0.045));
    assert!(clearance(0.01, 0.05) < -0.005);
    assert!(clearance(0.05, 0.01) < -0.005);
}

#[test]
fn a_convex_mesh_is_as_exact_as_its_box() {
    let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)].map(|v| v * 0.04);
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|s| [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]).collect();
    let cube = Mesh { name: "cube".into(), points: (0..8).map(corner).collect(), triangles }.grounded();
    let (mesh, cuboid) = (body(&Shape::Mesh(Arc::new(cube))), body(&Shape::Box([0.04; 3])));
    let ball = body(&Shape::Sphere(0.01));
    for (x, y, z) in [(0.06, 0.0, 0.01), (0.03, 0.03, 0.05), (0.024, 0.0, 0.01)] {
        let found = [&mesh, &cuboid].map(|b| apart(b, &ball, at(x, y, z)));
        assert!((found[0] - found[1]).abs() < 1e-9, "{found:?}");
    }
}

proptest! {
    #[test]
    fn distances_of_balls_are_those_of_their_middles(x in -0.2..0.2f64, y in -0.2..0.2f64, z in -0.2..0.2f64, a in 0.01..0.1f64, b in 0.01..0.1f64) {
        let (one, two) = (body(&Shape::Sphere(2.0 * a)), body(&Shape::Sphere(2.0 * b)));
        let middle = (x * x + y * y + (z + b - a) * (z + b - a)).sqrt();
        let found = apart(&one, &two, at(x, y, z));
        prop_assert!((found - (middle - a - b)).abs() < 1e-9);
    }

    #[test]
    fn touches_are_the_same_from_both_sides_and_everywhere(x in -0.1..0.1f64, z in -0.1..0.1f64, roll in -3.0..3.0f64, yaw in -3.0..3.0f64) {
        let (one, two) = (body(&beaker()), body(&Shape::Box([0.03, 0.04, 0.05])));
        let at = isometry(&Pose::turned([x, 0.02, z], [roll, 0.3, yaw]));
        let lab = isometry(&Pose::turned([1.0, -2.0, 0.5], [0.4, 0.2, 1.0]));
        let there = one.touch(&Isometry::identity(), &two, &at, 0.5).map(|t| t.distance);
        let back = two.touch(&(lab * at), &one, &lab, 0.5).map(|t| t.distance);
        match (there, back) {
            (Some(a), Some(b)) if a < 0.0 || b < 0.0 => prop_assert!(a < 1e-6 && b < 1e-6, "{a} {b}"),
            (Some(a), Some(b)) => prop_assert!((a - b).abs() < 1e-6, "{a} {b}"),
            (a, b) => prop_assert_eq!(a.is_some(), b.is_some()),
        }
    }
}

#[test]
fn vessels_placed_alike_are_in_each_other() {
    let beaker = body(&beaker());
    let still = Isometry::identity();
    // Walls and floors of both lie in the same planes, and their corners in one line.
    for far in (2..60).step_by(2) {
        for there in [at(f64::from(far) * 1e-3, 0.0, 0.0), at(0.0, f64::from(far) * 1e-3, 0.0)] {
            let depth = -apart(&beaker, &beaker, there);
            assert!(depth > 3e-4 && beaker.meets(&still, &beaker, &there, 3e-4), "{depth} m at {far} mm");
        }
    }
    let beside = at(0.06, 0.0, 0.0);
    assert!(apart(&beaker, &beaker, beside) > -1e-6 && !beaker.meets(&still, &beaker, &beside, 1e-6));
    // What stands on something only touches it.
    let block = body(&Shape::Box([0.06, 0.06, 0.02]));
    assert!(apart(&block, &block, at(0.0, 0.0, 0.02)).abs() < 1e-6);
}
