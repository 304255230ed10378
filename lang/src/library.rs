//! The standard library's texts, by module path.

macro_rules! modules {
    ($($name:literal)*) => {
        /// Every module with its text, in order of name.
        pub const MODULES: &[(&str, &str)] =
            &[$((concat!("std::", $name), include_str!(concat!("../../stdlib/", $name, ".mtx")))),*];
    };
}

modules! { "bodies" "chemistry" "devices" "furniture" "glassware" "heating" "math" "prelude" "robots" "skills" "species" "thermal" "units" }
