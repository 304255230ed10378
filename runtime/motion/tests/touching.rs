//! What touches by its making is told from what collides, and tools become part of the robots that carry them.

mod robots;

use matterix_ir::robot::{Placement, Robot};
use matterix_motion::{Chain, Tree, pose, touching};

fn names<'r>(robot: &'r Robot, pair: &[u32; 2]) -> (&'r str, &'r str) {
    (&robot.links[pair[0] as usize].name, &robot.links[pair[1] as usize].name)
}

#[test]
fn arms_touch_only_where_joints_connect_them() {
    for (name, _) in robots::TIPS {
        let robot = robots::robot(name);
        let always = touching::always_touching(&robot).expect("a tree");
        let others: Vec<_> = always.iter().filter(|p| !robot.touching.contains(p)).map(|p| names(&robot, p)).collect();
        assert!(others.is_empty(), "{name}: {others:?}");
    }
}

#[test]
fn pins_of_a_linkage_are_found() {
    let gripper = robots::robot("robotiq_2f85");
    let always = touching::always_touching(&gripper).expect("a tree");
    let pin = ("robotiq_85_left_inner_knuckle_link", "robotiq_85_left_finger_tip_link");
    assert!(always.iter().any(|pair| names(&gripper, pair) == pin));
}

#[test]
fn arms_at_rest_do_not_collide() {
    let rest: [(&str, &[f64]); 5] = [
        ("panda", &[0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.02]),
        ("fr3", &[0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.02]),
        ("ur3e", &[0.0, -1.571, 1.2, -1.2, -1.571, 0.0]),
        ("ur5e", &[0.0, -1.571, 1.571, -1.571, -1.571, 0.0]),
        ("iiwa14", &[0.0, 0.4, 0.0, -1.2, 0.0, 0.8, 0.0]),
    ];
    for (name, q) in rest {
        let robot = robots::robot(name);
        let tree = Tree::new(&robot).expect("a tree");
        let meeting = touching::overlapping(&robot, &tree, q);
        let others: Vec<_> = meeting.iter().filter(|p| !robot.touching.contains(p)).map(|p| names(&robot, p)).collect();
        assert!(others.is_empty(), "{name}: {others:?}");
    }
}

#[test]
fn a_gripper_on_a_wrist_on_an_arm_is_one_robot() {
    let mut robot = robots::robot("ur5e");
    let at = |z: f64| Placement { position: [0.0, 0.0, z], ..Placement::default() };
    let flange = robot.link("tool0").expect("a link");
    robot.attach(flange, &robots::robot("xm540_w150"), at(0.01), "wrist/");
    let horn = robot.link("wrist/wrist_tool").expect("a link");
    let base = robot.attach(horn, &robots::robot("robotiq_2f85"), at(0.02), "gripper/");
    assert_eq!(robot.links[base as usize].name, "gripper/robotiq_85_base_link");

    let tree = Tree::new(&robot).expect("a tree");
    assert_eq!(tree.variables().len(), 6 + 1 + 1);
    let chain = Chain::new(&robot, 0, robot.link("gripper/robotiq_85_tcp").expect("a link")).expect("a chain");
    assert_eq!(chain.variables().len(), 7);
    let q = [0.1, -1.2, 1.3, -0.4, 0.5, 0.6, 0.7, 0.3];
    let tool = pose::pose(&at(0.01 + 0.044 + 0.008 + 0.02 + 0.13));
    // The fingers close along the y axis of the gripper's tip, which is a quarter turn from its base.
    let quarter = std::f64::consts::FRAC_PI_2;
    let turned = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), 0.7 + quarter);
    let expected = robots::chain("ur5e", "tool0").tip(&q[..6]) * tool * turned;
    let (linear, angular) = pose::distance(&chain.tip(&q[..7]), &expected);
    assert!(linear < 1e-12 && angular < 1e-9, "{linear} {angular}");

    let meeting = touching::overlapping(&robot, &tree, &q);
    let known = touching::always_touching(&robot).expect("a tree");
    let others: Vec<_> = (meeting.iter())
        .filter(|p| !robot.touching.contains(p) && !known.contains(p))
        .map(|p| names(&robot, p))
        .collect();
    assert!(others.is_empty(), "{others:?}");
}
