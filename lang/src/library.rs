//! The standard library's texts, by module path.

macro_rules! modules {
    ($($name:literal)*) => {
        /// Every module with its text, in order of name.
        pub const MODULES: &[(&str, &str)] =
            &[$((concat!("std::", $name), include_str!(concat!("../../stdlib/", $name, ".mtx")))),*];
    };
}

macro_rules! files {
    ($($path:literal => $name:literal)*) => {
        /// Data files of the library with their texts.
        const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../assets/", $path, $name)))),*];
    };
}

files! {
    "labware/" => "corning_96_wellplate_360ul_flat.json"
    "labware/" => "nest_12_reservoir_15ml.json"
    "labware/" => "opentrons_1_trash_1100ml_fixed.json"
    "labware/" => "opentrons_24_tuberack_eppendorf_1.5ml_safelock_snapcap.json"
    "labware/" => "opentrons_96_tiprack_1000ul.json"
    "labware/" => "opentrons_96_tiprack_20ul.json"
    "labware/" => "opentrons_96_tiprack_300ul.json"
    "robots/fr3/" => "fr3.urdf"
    "robots/franka_hand/" => "franka_hand.urdf"
    "robots/iiwa14/" => "iiwa14.urdf"
    "robots/iiwa7/" => "iiwa7.urdf"
    "robots/kmr_iiwa/" => "kmr_iiwa.urdf"
    "robots/panda/" => "panda.urdf"
    "robots/plate_gripper/" => "plate_gripper.urdf"
    "robots/robotiq_2f85/" => "robotiq_2f85.urdf"
    "robots/ur3e/" => "ur3e.urdf"
    "robots/ur5e/" => "ur5e.urdf"
    "robots/xm540_w150/" => "xm540_w150.urdf"
}

/// A data file of the library.
pub fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

modules! { "balances" "bodies" "centrifuges" "chemistry" "closures" "devices" "furniture" "glassware" "hazards" "heating" "labware" "materials" "math" "opentrons" "pipetting" "prelude" "pumps" "reactivity" "robots" "shakers" "skills" "species" "thermal" "tools" "units" "vials" }
