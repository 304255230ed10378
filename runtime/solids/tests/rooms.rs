//! Blocks with holes: what stands in a hole touches nothing, what does not fit does.

use matterix_ir::pose::Pose;
use matterix_ir::scene::{Shape, Solid};
use matterix_solids::{Body, isometry};

const RACK: Shape = Shape::Box([0.128, 0.086, 0.030]);

/// Holes of 13 mm in four rows of six, 25 mm deep.
fn holes() -> Vec<Solid> {
    let at = |column: u32, row: u32| [-0.05 + 0.02 * f64::from(column), 0.0285 - 0.019 * f64::from(row), 0.005];
    let all = (0..6).flat_map(|column| (0..4).map(move |row| at(column, row)));
    all.map(|at| Solid { shape: Shape::Cylinder([0.013, 0.050]), pose: Pose::at(at) }).collect()
}

/// How deep a vial of this diameter is in the rack, m, its base here; nothing where they are apart.
fn depth(rooms: &[Solid], diameter: f64, at: [f64; 3]) -> Option<f64> {
    let rack = Body::with_rooms(Some(&RACK), &[], rooms).expect("a body");
    let vial = Body::with_rooms(Some(&Shape::Cylinder([diameter, 0.032])), &[], &[]).expect("a body");
    let here = isometry(&Pose::IDENTITY);
    vial.touch(&isometry(&Pose::at(at)), &rack, &here, 0.0).map(|touch| -touch.distance)
}

#[test]
fn what_fits_stands_in_its_hole() {
    let fits = depth(&holes(), 0.012, [-0.03, 0.0095, 0.0051]);
    assert!(fits.is_none_or(|d| d < 1e-4), "{fits:?}");
    let wide = depth(&holes(), 0.016, [-0.03, 0.0095, 0.0051]).expect("it touches");
    assert!(wide > 1e-3, "{wide}");
    let sunk = depth(&holes(), 0.012, [-0.03, 0.0095, 0.002]).expect("it touches");
    assert!((sunk - 0.003).abs() < 1e-4, "its floor is solid: {sunk}");
    let beside = depth(&holes(), 0.012, [-0.04, 0.019, 0.0051]).expect("it touches");
    assert!(beside > 1e-3, "{beside}");
}

#[test]
fn a_trough_is_a_hole_with_four_sides() {
    let trough = [Solid {
        shape: Shape::Box([0.06, 0.02, 0.04]),
        pose: Pose::turned([0.0, 0.0, 0.01], [0.0, 0.0, std::f64::consts::FRAC_PI_2]),
    }];
    assert!(depth(&trough, 0.012, [0.0, 0.022, 0.011]).is_none_or(|d| d < 1e-6));
    assert!(depth(&trough, 0.012, [0.022, 0.0, 0.011]).is_some_and(|d| d > 1e-3), "it is turned");
}

#[test]
fn holes_that_cannot_be_told_apart_are_none() {
    // Four holes in a pinwheel: no straight cut leaves any of them whole.
    let pin = |x: f64, y: f64, wide: f64, deep: f64| Solid {
        shape: Shape::Box([wide, deep, 0.05]),
        pose: Pose::at([x, y, 0.01]),
    };
    let pinwheel = [
        pin(-0.01, 0.02, 0.04, 0.01),
        pin(0.02, 0.01, 0.01, 0.04),
        pin(0.01, -0.02, 0.04, 0.01),
        pin(-0.02, -0.01, 0.01, 0.04),
    ];
    assert!(depth(&pinwheel, 0.008, [-0.01, 0.02, 0.011]).is_some_and(|d| d > 1e-3));
    // One that leans is none either.
    let leaning =
        [Solid { shape: Shape::Cylinder([0.02, 0.05]), pose: Pose::turned([0.0, 0.0, 0.01], [0.2, 0.0, 0.0]) }];
    assert!(depth(&leaning, 0.008, [0.0, 0.0, 0.011]).is_some_and(|d| d > 1e-3));
}

#[test]
fn figures_that_are_no_numbers_are_passed_over() {
    let mut rooms = holes();
    rooms[3].pose.position[0] = f64::NAN;
    rooms[5].shape = Shape::Cylinder([f64::INFINITY, 0.05]);
    rooms[7].pose.position[1] = f64::INFINITY;
    assert!(Body::with_rooms(Some(&RACK), &[], &rooms).is_some());
}
