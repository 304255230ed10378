//! The standard library's texts, by module path.

macro_rules! modules {
    ($($name:literal)*) => {
        /// Every module with its text, in order of name.
        pub const MODULES: &[(&str, &str)] =
            &[$((concat!("std::", $name), include_str!(concat!("../../stdlib/", $name, ".mtx")))),*];
    };
}

macro_rules! files {
    ($($name:literal)*) => {
        /// Data files of the library with their texts.
        const FILES: &[(&str, &str)] =
            &[$((concat!($name, ".json"), include_str!(concat!("../../assets/labware/", $name, ".json")))),*];
    };
}

files! {
    "corning_96_wellplate_360ul_flat"
    "nest_12_reservoir_15ml"
    "opentrons_1_trash_1100ml_fixed"
    "opentrons_24_tuberack_eppendorf_1.5ml_safelock_snapcap"
    "opentrons_96_tiprack_1000ul"
    "opentrons_96_tiprack_20ul"
    "opentrons_96_tiprack_300ul"
}

/// A data file of the library.
pub fn file(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

modules! { "bodies" "centrifuges" "chemistry" "closures" "devices" "furniture" "glassware" "hazards" "heating" "labware" "materials" "math" "opentrons" "pipetting" "prelude" "reactivity" "robots" "shakers" "skills" "species" "thermal" "units" "vials" }
