//! Forward kinematics against Pinocchio: 50 recorded configurations of each robot, or those of another folder.

mod robots;

use std::fs;
use std::path::PathBuf;

use matterix_motion::Tree;
use nalgebra::{Matrix3, Vector3};
use robots::{TIPS, chain, robot};

#[test]
fn tips_are_where_pinocchio_sees_them() {
    let folder = std::env::var_os("MATTERIX_FORWARD").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden"));
    for (name, tip) in TIPS {
        let robot = robot(name);
        let (chain, tree) = (chain(name, tip), Tree::new(&robot).expect("a tree"));
        let count = chain.variables().len();
        let text = fs::read_to_string(folder.join(format!("{name}.tsv"))).expect("a file");
        let (mut linear, mut angular, mut lines) = (0.0f64, 0.0f64, 0);
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let numbers: Vec<f64> = line.split('\t').map(|n| n.parse().expect("a number")).collect();
            let (q, pose) = numbers.split_at(count);
            let position = Vector3::from_column_slice(&pose[..3]);
            let rotation = Matrix3::from_row_slice(&pose[3..]);
            let at = chain.tip(q);
            linear = linear.max((at.translation.vector - position).amax());
            angular = angular.max((at.rotation.matrix() - rotation).amax());
            // The arm's variables come first in the tree; what follows them does not move the tip.
            let mut all = q.to_vec();
            all.resize(tree.variables().len(), 0.0);
            let seen = tree.poses(&all)[robot.link(tip).expect("a link") as usize];
            linear = linear.max((seen.translation.vector - position).amax());
            angular = angular.max((seen.rotation.matrix() - rotation).amax());
            lines += 1;
        }
        assert!(lines >= 50, "{name}: {lines} lines");
        println!("{name}: {lines} configurations, {linear:.1e} m, {angular:.1e}");
        assert!(linear < 1e-9 && angular < 1e-9, "{name}: {linear:.1e} m, {angular:.1e}");
    }
}
