//! Inverse kinematics: what is found is within the limits and at the target; what cannot be reached is said to be so.

mod robots;

use matterix_ir::robot::{Joint, JointKind, JointLimits, Link, Placement, Robot};
use matterix_motion::inverse::{Facing, ParallelWrist, Request, Solver};
use matterix_motion::{Chain, Pose, pose};
use nalgebra::{Translation3, Unit, Vector3};
use robots::{TIPS, chain};

/// Configurations drawn evenly within the limits, a turn where there are none.
fn drawn(chain: &Chain, count: usize) -> Vec<Vec<f64>> {
    let mut state = 9u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let draw = |v: &matterix_motion::Variable, unit: f64| {
        if v.is_bounded() {
            v.limits.lower + unit * (v.limits.upper - v.limits.lower)
        } else {
            std::f64::consts::TAU * (unit - 0.5)
        }
    };
    (0..count).map(|_| chain.variables().iter().map(|v| draw(v, unit())).collect()).collect()
}

fn middle(chain: &Chain) -> Vec<f64> {
    matterix_motion::variables::middle(chain.variables())
}

#[track_caller]
fn holds(chain: &Chain, request: &Request, q: &[f64]) {
    let (linear, angular) = pose::distance(&chain.tip(q), &request.target);
    assert!(linear <= request.linear && angular <= request.angular, "{linear} {angular}");
    for (q, v) in q.iter().zip(chain.variables()) {
        assert!(v.limits.lower <= *q && *q <= v.limits.upper, "{q} {:?}", v.limits);
    }
}

#[test]
fn poses_that_can_be_reached_are() {
    for (name, tip) in TIPS {
        let chain = chain(name, tip);
        let start = middle(&chain);
        let mut solver = Solver::new(chain.clone());
        for q in drawn(&chain, 60) {
            let request = Request::new(chain.tip(&q), &start);
            let solution = solver.solve(&request).unwrap_or_else(|u| panic!("{name}: {q:?} {u:?}"));
            holds(&chain, &request, &solution.q);
            assert_eq!(solver.solve(&request), Ok(solution), "{name}: the same request, the same answer");
        }
    }
}

#[test]
fn the_closed_form_finds_all_eight_and_the_one_that_was() {
    let chain = chain("ur5e", "tool0");
    let form = ParallelWrist::of(&chain).expect("a closed form");
    let mut most = 0;
    for q in drawn(&chain, 200) {
        let request = Request::new(chain.tip(&q), &q);
        let solutions = form.solve(&chain, &request.target, &q);
        for solution in &solutions {
            holds(&chain, &request, solution);
        }
        let found = |s: &Vec<f64>| s.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(solutions.iter().any(found), "{q:?}");
        for (i, a) in solutions.iter().enumerate() {
            for b in &solutions[i + 1..] {
                assert!(a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6), "{a:?} twice");
            }
        }
        most = most.max(solutions.len());
    }
    assert_eq!(most, 8);
}

#[test]
fn closed_forms_are_recognised_by_geometry() {
    let has = |name: &str, tip: &str| ParallelWrist::of(&chain(name, tip)).is_some();
    assert!(has("ur3e", "tool0") && has("ur3e", "flange") && has("ur5e", "wrist_3_link"));
    assert!(!has("ur5e", "wrist_2_link"));
    assert!(!has("panda", "panda_hand_tcp") && !has("iiwa14", "link_ee"));
    // The same arm with its elbow's axis a little askew is none of them.
    let mut robot = robots::robot("ur5e");
    let elbow = robot.joint("elbow_joint").expect("a joint") as usize;
    robot.joints[elbow].axis = [0.001, 0.0, (1.0f64 - 1e-6).sqrt()];
    let chain = Chain::new(&robot, 0, robot.link("tool0").expect("a link")).expect("a chain");
    assert!(ParallelWrist::of(&chain).is_none());
}

#[test]
fn a_straight_wrist_has_a_closed_form_too() {
    let chain = chain("ur3e", "tool0");
    let mut solver = Solver::new(chain.clone());
    for q in [[0.3, -1.2, 1.1, -0.4, 0.0, 0.7], [0.3, -1.2, 0.0, -0.4, 0.5, 0.7], [0.0; 6]] {
        let request = Request::new(chain.tip(&q), &q);
        let solution = solver.solve(&request).expect("reached");
        holds(&chain, &request, &solution.q);
    }
}

#[test]
fn a_target_out_of_reach_is_refused_with_the_nearest_configuration() {
    for (name, tip) in TIPS.iter().filter(|(name, _)| *name != "kmr_iiwa") {
        let chain = chain(name, tip);
        let start = middle(&chain);
        let mut request = Request::new(chain.tip(&start), &start);
        request.target.translation = Translation3::new(3.0, 0.0, 0.5);
        request.attempts = 5;
        let unreached = Solver::new(chain.clone()).solve(&request).expect_err(name);
        assert!(unreached.linear > 1.5 && unreached.linear < 2.5, "{name}: {unreached:?}");
        for (q, v) in unreached.q.iter().zip(chain.variables()) {
            assert!(v.limits.lower <= *q && *q <= v.limits.upper);
        }
    }
}

#[test]
fn a_posture_uses_the_freedom_that_is_left() {
    let chain = chain("panda", "panda_hand_tcp");
    let wish = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785];
    let far = |q: &[f64]| q.iter().zip(&wish).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut solver = Solver::new(chain.clone());
    let (mut with, mut without) = (0.0, 0.0);
    for q in drawn(&chain, 30) {
        let mut request = Request::new(chain.tip(&q), &wish);
        without += far(&solver.solve(&request).expect("reached").q);
        request.posture = Some(&wish);
        request.choices = 6;
        let solution = solver.solve(&request).expect("reached");
        holds(&chain, &request, &solution.q);
        with += far(&solution.q);
    }
    assert!(with < 0.85 * without, "{with} {without}");
}

#[test]
fn what_does_not_matter_of_a_rotation_is_left_open() {
    let axis = Unit::new_normalize(Vector3::new(0.0, 0.6, 0.8));
    for (name, tip) in [("ur5e", "tool0"), ("panda", "panda_hand_tcp")] {
        let chain = chain(name, tip);
        let start = middle(&chain);
        let mut solver = Solver::new(chain.clone());
        let mut apart = 0.0f64;
        for q in drawn(&chain, 30) {
            let mut request = Request::new(chain.tip(&q), &start);
            request.facing = Facing::Along(axis);
            let solution = solver.solve(&request).expect("reached");
            let at = chain.tip(&solution.q);
            let (linear, angular) = pose::distance(&at, &request.target);
            assert!(linear < 1e-6);
            assert!((at.rotation * axis).angle(&(request.target.rotation * axis)) < 1e-5);
            apart = apart.max(angular);
            request.facing = Facing::Anyhow;
            let solution = solver.solve(&request).expect("reached");
            assert!(pose::distance(&chain.tip(&solution.q), &request.target).0 < 1e-6);
        }
        assert!(apart > 1.0, "{name}: {apart}");
    }
}

#[test]
fn several_solutions_differ() {
    let chain = chain("iiwa14", "link_ee");
    let start = [0.1, 0.4, 0.2, -1.1, 0.3, 0.8, 0.0];
    let request = Request::new(chain.tip(&start), &start);
    let solutions = Solver::new(chain.clone()).solutions(&request, 8);
    assert_eq!(solutions.len(), 8);
    assert!(solutions[0].q.iter().zip(&start).all(|(a, b)| (a - b).abs() < 1e-6));
    for (i, a) in solutions.iter().enumerate() {
        holds(&chain, &request, &a.q);
        assert!(solutions[i + 1..].iter().all(|b| a.q.iter().zip(&b.q).any(|(a, b)| (a - b).abs() > 1e-3)));
    }
}

#[test]
fn a_mobile_robot_moves_its_arm_before_its_base() {
    let chain = chain("kmr_iiwa", "link_ee");
    let start = [0.0, 0.0, 0.0, 0.0, 0.5, 0.0, -1.4, 0.0, 1.0, 0.0];
    let near = [0.0, 0.0, 0.0, 0.5, 0.8, 0.2, -1.0, 0.2, 0.9, 0.4];
    let mut solver = Solver::new(chain.clone());
    let weights: Vec<f64> = (0..10).map(|i| if i < 3 { 0.002 } else { 1.0 }).collect();
    let mut request = Request::new(chain.tip(&near), &start);
    let base = |q: &[f64]| q[0].hypot(q[1]);
    let free = solver.solve(&request).expect("reached");
    request.weights = Some(&weights);
    let held = solver.solve(&request).expect("reached");
    holds(&chain, &request, &held.q);
    assert!(base(&held.q) < 0.2 * base(&free.q), "{} {}", base(&held.q), base(&free.q));
    // What the arm cannot reach from here, the base drives to.
    request.target.translation.x += 3.0;
    let driven = solver.solve(&request).expect("reached");
    holds(&chain, &request, &driven.q);
    assert!(base(&driven.q) > 1.5);
    // A base that stands still leaves it to the arm.
    let still: Vec<f64> = (0..10).map(|i| if i < 3 { 0.0 } else { 1.0 }).collect();
    request.weights = Some(&still);
    assert!(solver.solve(&request).is_err());
    request.target.translation.x -= 3.0;
    let standing = solver.solve(&request).expect("reached");
    assert_eq!(standing.q[..3], start[..3]);
}

/// A chain of one joint has no freedom to spare: nearly all targets are refused, without a hitch.
#[test]
fn degenerate_chains_are_no_trouble() {
    let link = |name: &str| Link { name: name.into(), inertial: None, visual: vec![], collision: vec![] };
    let limits = JointLimits { lower: 0.0, upper: 0.0, velocity: 1.0, effort: 1.0, acceleration: None, jerk: None };
    let joint = |kind, limits| Joint {
        name: "j".into(),
        kind,
        parent: 0,
        child: 1,
        origin: Placement::default(),
        axis: [0.0, 0.0, 1.0],
        limits,
        mimic: None,
    };
    for (kind, limits) in [(JointKind::Revolute, Some(limits)), (JointKind::Fixed, None)] {
        let robot = Robot { links: vec![link("a"), link("b")], joints: vec![joint(kind, limits)], ..Robot::default() };
        let chain = Chain::new(&robot, 0, 1).expect("a chain");
        let start = vec![0.0; chain.variables().len()];
        let mut solver = Solver::new(chain);
        assert!(solver.solve(&Request::new(Pose::identity(), &start)).is_ok());
        assert!(solver.solve(&Request::new(Pose::translation(0.0, 0.0, 1.0), &start)).is_err());
        let nowhere = Pose::translation(f64::NAN, 0.0, 1.0);
        assert!(solver.solve(&Request::new(nowhere, &start)).is_err());
    }
}
