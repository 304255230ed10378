//! Shapes no laboratory has, and files that never end: refused at once, in words.

use std::path::Path;

use crate::harness::{folder, matterixc_in, write};

/// An arm that places a thing of this shape.
fn bench(shape: &str) -> String {
    format!(
        "mtx 1
use std::robots
asset Mat: Surface {{ mass: 50 g, shape: box(140 mm, 140 mm, 2 mm) }}
asset Thing: Graspable {{ mass: 50 g, shape: {shape} }}
lab bench {{
    ambient: 22 degC
    table = OpticalTable at (0, 0, 0) m
    arm = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (-300, 0) mm
    mat = Mat on table at (100, 300) mm
    thing = Thing on table at (100, -250) mm
}}
workflow go in bench {{
    place thing on mat by arm
}}
"
    )
}

/// The findings of a text, one a line.
fn findings(dir: &Path, text: &str) -> String {
    write(dir, "sizes.mtx", text);
    matterixc_in(dir, &["check", "--format", "concise", "--no-cache", "sizes.mtx"]).out
}

#[test]
fn a_length_no_shape_has_is_said_as_it_was_typed() {
    let told = [
        ("box(2 km, 50 mm, 50 mm)", "a side of `box` is 2 km"),
        ("box(50 mm, -50 mm, 50 mm)", "a side of `box` is -50 mm"),
        ("box(1e308 m, 50 mm, 50 mm)", "a side of `box` is 1e308 m"),
        ("cylinder(40 mm, 0 mm)", "the height of `cylinder` is 0 mm"),
        ("sphere(-3 cm)", "the diameter of `sphere` is -3 cm"),
        ("vessel(70 mm, 95 mm, -1 mm, 2 mm)", "the wall of `vessel` is -1 mm"),
        ("turned([(0, 0) mm, (35, 0) mm, (35, 1e9) mm], [])", "this point of an outline is more than 100 m away"),
    ];
    let dir = folder("lengths");
    for (shape, text) in told {
        let found = findings(&dir, &bench(shape));
        assert!(found.contains("4:") && found.contains(text) && found.contains("[out-of-range]"), "{shape}: {found}");
        assert_eq!(found.matches("error[").count(), 1, "{shape}: {found}");
    }
}

#[test]
fn what_is_large_and_thin_is_looked_at_like_anything_else() {
    let found = findings(&folder("large"), &bench("box(100 m, 100 m, 1 mm)"));
    assert!(found.contains("error["), "{found}");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_read() {
    let dir = folder("pipes");
    let pipe = dir.join("pipe.stl");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().is_ok_and(|s| s.success());
    assert!(made || pipe.exists());
    for file in ["pipe.stl", "/dev/zero", "../../../../../../../../../../../../dev/zero"] {
        let shape = format!("mesh(\"{file}\", 1 mm)");
        let found = findings(&dir, &bench(&shape));
        assert!(found.contains("error["), "{file}: {found}");
    }
    for file in ["pipe.stl", "/dev/zero"] {
        let ended = matterixc_in(&dir, &["check", file]);
        let told = format!("error: cannot read `{file}`: it is a pipe or a device, not a file\n");
        assert_eq!((ended.code, ended.err), (2, told));
    }
}
