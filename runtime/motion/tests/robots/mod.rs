//! The robots of `assets/robots`, as chains to their tips.

use std::fs;
use std::path::PathBuf;

use matterix_ir::robot::Robot;
use matterix_motion::Chain;

/// Robots and the link at the end of each.
pub const TIPS: &[(&str, &str)] = &[
    ("panda", "panda_hand_tcp"),
    ("fr3", "fr3_hand_tcp"),
    ("ur3e", "tool0"),
    ("ur5e", "tool0"),
    ("iiwa7", "link_ee"),
    ("iiwa14", "link_ee"),
    ("kmr_iiwa", "link_ee"),
];

pub fn robot(name: &str) -> Robot {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/robots").join(name);
    let text = fs::read_to_string(folder.join(format!("{name}.urdf"))).expect("a file");
    matterix_urdf::read(&text).expect("a robot")
}

/// From the root to a link.
pub fn chain(name: &str, tip: &str) -> Chain {
    let robot = robot(name);
    Chain::new(&robot, 0, robot.link(tip).expect("a link")).expect("a chain")
}
