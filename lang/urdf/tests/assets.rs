//! The robots in `assets/robots` are read as they stand in their files.

use std::fs;
use std::path::PathBuf;

use matterix_ir::robot::{JointKind, Robot, Solid};

fn robots() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/robots")
}

fn robot(name: &str) -> Robot {
    let text = fs::read_to_string(robots().join(name).join(format!("{name}.urdf"))).expect("a file");
    matterix_urdf::read(&text).unwrap_or_else(|problem| panic!("{name}: {problem}"))
}

#[test]
fn every_robot_is_read_and_says_where_it_is_from() {
    let mut names: Vec<String> = (fs::read_dir(robots()).expect("a folder"))
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        let robot = robot(&name);
        assert_eq!(robot.name, name);
        assert!(!robot.balls.is_empty() && !robot.touching.is_empty(), "{name}");
        let source = fs::read_to_string(robots().join(&name).join("SOURCE.md")).expect("a source");
        assert!(source.contains("## Licence") && source.contains("## Figures"), "{name}");
        for (i, joint) in robot.joints.iter().enumerate() {
            let before = robot.joints[..i].iter().any(|j| j.child == joint.parent) || joint.parent == 0;
            assert!(before, "{name}: `{}` comes before its parent", joint.name);
        }
    }
}

#[test]
fn a_panda_has_the_limits_of_its_makers() {
    let panda = robot("panda");
    let limits = |name: &str| panda.joints[panda.joint(name).expect("a joint") as usize].limits.expect("limits");
    let fourth = limits("panda_joint4");
    assert_eq!((fourth.lower, fourth.upper), (-3.0718, -0.0698));
    assert_eq!((fourth.velocity, fourth.effort), (2.175, 87.0));
    assert_eq!((fourth.acceleration, fourth.jerk), (Some(12.5), Some(6250.0)));
    let finger = &panda.joints[panda.joint("panda_finger_joint2").expect("a joint") as usize];
    assert_eq!(finger.mimic.expect("follows").joint, panda.joint("panda_finger_joint1").expect("a joint"));
    let masses = panda.links.iter().filter_map(|l| l.inertial).map(|i| i.mass).sum::<f64>();
    assert!((masses - (16.18253 + 0.7126)).abs() < 1e-9, "{masses}");
}

#[test]
fn joints_without_an_end_have_none() {
    let arm = robot("ur3e");
    let last = &arm.joints[arm.joint("wrist_3_joint").expect("a joint") as usize];
    assert_eq!(last.kind, JointKind::Continuous);
    assert_eq!(last.limits.map(|l| (l.lower, l.upper)), Some((f64::MIN, f64::MAX)));
}

/// Every point of a link's solids is in one of its spheres.
#[test]
fn spheres_cover_the_solids() {
    for name in ["panda", "ur5e", "kmr_iiwa", "robotiq_2f85"] {
        let robot = robot(name);
        for (link, body) in robot.links.iter().enumerate() {
            let balls: Vec<_> = robot.balls.iter().filter(|b| b.link as usize == link).collect();
            for piece in &body.collision {
                for k in 0..1000u32 {
                    // A low-discrepancy sequence fills the unit cube.
                    let unit = |base: f64| (f64::from(k) * base).fract() * 2.0 - 1.0;
                    let [a, b, c] = [unit(0.754877666), unit(0.569840291), unit(0.430159709)];
                    let point = match piece.solid {
                        Solid::Cuboid([x, y, z]) => [0.5 * a * x, 0.5 * b * y, 0.5 * c * z],
                        Solid::Cylinder([r, l]) if a * a + b * b <= 1.0 => [a * r, b * r, 0.5 * c * l],
                        Solid::Sphere(r) if a * a + b * b + c * c <= 1.0 => [a * r, b * r, c * r],
                        _ => continue,
                    };
                    let point = placed(&piece.placement, point);
                    let inside = balls.iter().any(|ball| {
                        let d = [0, 1, 2].map(|i| point[i] - ball.center[i]);
                        d.iter().map(|x| x * x).sum::<f64>().sqrt() <= ball.radius + 1e-9
                    });
                    assert!(inside, "{name}: {point:?} of `{}`", body.name);
                }
            }
        }
    }
}

/// A point relative to a placement, by the rotation matrix of its quaternion.
fn placed(placement: &matterix_ir::robot::Placement, p: [f64; 3]) -> [f64; 3] {
    let [x, y, z, w] = placement.rotation;
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|i| placement.position[i] + (0..3).map(|j| rows[i][j] * p[j]).sum::<f64>())
}
