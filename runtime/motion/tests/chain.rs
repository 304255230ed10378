//! Chains of small robots whose answers are known by hand, and Jacobians against differences.

use matterix_ir::robot::{Joint, JointKind, JointLimits, Link, Mimic, Placement, Robot};
use matterix_motion::{Chain, Malformed, Tree, pose};

fn link(name: &str) -> Link {
    Link { name: name.into(), inertial: None, visual: vec![], collision: vec![] }
}

fn joint(kind: JointKind, parent: u32, child: u32, position: [f64; 3], axis: [f64; 3]) -> Joint {
    let limits = JointLimits { lower: -3.0, upper: 3.0, velocity: 1.0, effort: 1.0, acceleration: None, jerk: None };
    Joint {
        name: format!("j{child}"),
        kind,
        parent,
        child,
        origin: Placement { position, rotation: [0.0, 0.0, 0.6, 0.8] },
        axis,
        limits: (kind != JointKind::Fixed).then_some(limits),
        mimic: None,
    }
}

/// A trunk with two branches; the last joint of the second one follows its first one.
fn forked() -> Robot {
    use JointKind::*;
    let mut joints = vec![
        joint(Revolute, 0, 1, [0.1, 0.2, 0.3], [0.0, 0.0, 1.0]),
        joint(Prismatic, 1, 2, [0.0, 0.5, 0.0], [0.0, 0.6, 0.8]),
        joint(Continuous, 2, 3, [0.3, 0.0, 0.1], [1.0, 0.0, 0.0]),
        joint(Revolute, 1, 4, [0.2, -0.1, 0.0], [0.0, -1.0, 0.0]),
        joint(Fixed, 4, 5, [0.0, 0.0, 0.4], [0.0, 0.0, 1.0]),
        joint(Revolute, 5, 6, [0.0, 0.3, 0.0], [0.0, 0.6, -0.8]),
    ];
    joints[5].mimic = Some(Mimic { joint: 3, multiplier: -0.5, offset: 0.2 });
    let links = (0..7).map(|i| link(&format!("l{i}"))).collect();
    Robot { name: "forked".into(), links, joints, ..Robot::default() }
}

const Q: [f64; 4] = [0.4, -0.7, 1.9, 0.8];

#[test]
fn a_chain_between_any_links_agrees_with_the_tree() {
    let robot = forked();
    let tree = Tree::new(&robot).expect("a tree");
    let poses = tree.poses(&Q);
    for base in 0..7 {
        for tip in 0..7 {
            let chain = Chain::new(&robot, base, tip).expect("a chain");
            let q: Vec<f64> = (tree.variables().iter().zip(Q))
                .filter_map(|(v, q)| chain.variables().iter().any(|c| c.joint == v.joint).then_some(q))
                .collect();
            let (linear, angular) = pose::distance(&chain.tip(&q), &poses[base as usize].inv_mul(&poses[tip as usize]));
            assert!(linear < 1e-14 && angular < 1e-7, "{base} to {tip}: {linear} {angular}");
        }
    }
}

#[test]
fn jacobians_agree_with_differences() {
    let robot = forked();
    for (base, tip) in [(0, 3), (0, 6), (3, 6), (6, 3), (6, 1)] {
        let chain = Chain::new(&robot, base, tip).expect("a chain");
        let q = &Q[..chain.variables().len()];
        let mut columns = Vec::new();
        let at = chain.jacobian(q, &mut columns);
        assert!(pose::distance(&at, &chain.tip(q)).0 == 0.0);
        for (i, column) in columns.iter().enumerate() {
            let step = 1e-6;
            let (mut before, mut after) = (q.to_vec(), q.to_vec());
            before[i] -= step;
            after[i] += step;
            let (before, after) = (chain.tip(&before), chain.tip(&after));
            let linear = (after.translation.vector - before.translation.vector) / (2.0 * step);
            let angular = pose::rotation_vector(&(after.rotation * before.rotation.inverse())) / (2.0 * step);
            assert!((linear - column.fixed_rows::<3>(0)).norm() < 1e-8, "{base} to {tip}, variable {i}");
            assert!((angular - column.fixed_rows::<3>(3)).norm() < 1e-8, "{base} to {tip}, variable {i}");
        }
    }
}

#[test]
fn a_tool_and_a_base_are_where_they_are_said_to_be() {
    let robot = forked();
    let chain = Chain::new(&robot, 0, 3).expect("a chain");
    let tool = pose::pose(&Placement { position: [0.0, 0.1, 0.2], rotation: [0.6, 0.0, 0.0, 0.8] });
    let base = pose::pose(&Placement { position: [1.0, 0.0, 0.0], rotation: [0.0, 0.6, 0.0, 0.8] });
    let expected = base * chain.tip(&Q[..3]) * tool;
    let moved = chain.with_tool(&tool).with_base(&base).tip(&Q[..3]);
    assert!(pose::distance(&expected, &moved).0 < 1e-14);
}

#[test]
fn followers_narrow_the_limits_of_whom_they_follow() {
    let mut robot = forked();
    robot.joints[5].limits.as_mut().expect("limits").upper = 0.7;
    let tree = Tree::new(&robot).expect("a tree");
    assert_eq!(tree.variables().len(), 4);
    // -0.5 q + 0.2 <= 0.7 leaves q >= -1.
    assert!((tree.variables()[3].limits.lower + 1.0).abs() < 1e-12);
}

#[test]
fn what_is_no_tree_is_refused() {
    let change = |f: &dyn Fn(&mut Robot)| {
        let mut robot = forked();
        f(&mut robot);
        Tree::new(&robot).expect_err("refused")
    };
    assert_eq!(change(&|r| r.joints[1].child = 9), Malformed::Dangling("j2".into()));
    assert_eq!(change(&|r| r.joints[1].child = 1), Malformed::Dangling("j2".into()));
    assert_eq!(change(&|r| r.joints.swap(0, 1)), Malformed::Order("j2".into()));
    assert_eq!(change(&|r| r.joints[2].axis = [0.0; 3]), Malformed::Axis("j3".into()));
    assert_eq!(change(&|r| r.joints[2].limits = None), Malformed::NoLimits("j3".into()));
    assert_eq!(change(&|r| r.links.push(link("alone"))), Malformed::Apart(0, 7));
    let mimic = |joint| Some(Mimic { joint, multiplier: 1.0, offset: 0.0 });
    assert_eq!(change(&|r| r.joints[3].mimic = mimic(5)), Malformed::FollowsItself("j4".into()));
    assert_eq!(change(&|r| r.joints[3].mimic = mimic(50)), Malformed::Dangling("j4".into()));
    assert_eq!(Chain::new(&forked(), 0, 70).expect_err("refused"), Malformed::NoLink(70));
}

#[test]
fn rotation_vectors_are_right_up_to_half_a_turn() {
    use std::f64::consts::PI;

    use nalgebra::{Rotation3, Unit, Vector3};
    for axis in [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [-0.48, 0.64, 0.6]] {
        let axis = Unit::new_normalize(Vector3::from(axis));
        for angle in [0.0, 1e-9, 1e-7, 0.3, 1.0, 3.0, PI - 5e-8, PI] {
            let found = pose::rotation_vector(&Rotation3::from_axis_angle(&axis, angle));
            // Half a turn is the same about either end of an axis.
            let wrong = (found - axis.into_inner() * angle).norm();
            let other = if angle > 3.1 { (found + axis.into_inner() * angle).norm() } else { wrong };
            assert!(wrong.min(other) < 1e-6, "{axis:?} {angle} {found:?}");
        }
    }
}

/// Any robot is compiled or refused; what is compiled can be moved, and asked for a pose, without a hitch.
mod any {
    use matterix_motion::inverse::{Request, Solver};
    use matterix_motion::variables::middle;
    use proptest::prelude::*;

    use super::*;

    fn any_joint() -> impl Strategy<Value = Joint> {
        let kind = prop::sample::select(vec![
            JointKind::Fixed,
            JointKind::Revolute,
            JointKind::Continuous,
            JointKind::Prismatic,
        ]);
        let axis = prop::sample::select(vec![[1.0, 0.0, 0.0], [0.0, -0.6, 0.8], [0.0, 0.0, 0.0], [f64::NAN, 0.0, 1.0]]);
        let ends = prop::sample::select(vec![(-1.0, 1.0), (f64::MIN, f64::MAX), (1.0, -1.0), (0.5, 0.5)]);
        let mimic = prop::option::weighted(0.3, (0u32..7, -2.0..2.0f64));
        (kind, 0u32..6, 1u32..6, axis, ends, mimic).prop_map(|(kind, parent, child, axis, (lower, upper), mimic)| {
            let mut joint = joint(kind, parent, child, [0.1, 0.2, 0.3], axis);
            joint.limits = joint.limits.map(|l| JointLimits { lower, upper, ..l });
            joint.mimic = mimic.map(|(joint, multiplier)| Mimic { joint, multiplier, offset: 0.1 });
            joint
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn robot_is_no_trouble(joints in prop::collection::vec(any_joint(), 0..6), straight: bool, base in 0u32..7, tip in 0u32..7) {
            let mut joints = joints;
            if straight {
                // Mostly trees, so that more than refusals is tried.
                for (i, joint) in joints.iter_mut().enumerate() {
                    joint.child = i as u32 + 1;
                    joint.parent = joint.parent.min(i as u32);
                }
            }
            let links = (0..=joints.len()).map(|i| link(&format!("l{i}"))).collect();
            let robot = Robot { links, joints, ..Robot::default() };
            if let Ok(tree) = Tree::new(&robot) {
                let poses = tree.poses(&middle(tree.variables()));
                prop_assert_eq!(poses.len(), robot.links.len());
            }
            if let Ok(chain) = Chain::new(&robot, base, tip) {
                let q = middle(chain.variables());
                let mut request = Request::new(chain.tip(&q), &q);
                request.attempts = 3;
                let mut solver = Solver::new(chain);
                prop_assert!(solver.solve(&request).is_ok());
                request.target.translation.x += 0.3;
                let _ = solver.solve(&request);
            }
        }
    }
}
