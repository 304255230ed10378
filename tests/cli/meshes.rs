//! Meshes as shapes of assets and of robots.

use crate::harness::{folder, matterixc_in, write};

/// A triangular prism of 60 x 20 x 60 mm, in millimetres.
const WEDGE: &str = "v 0 0 0\nv 60 0 0\nv 0 0 60\nv 0 20 0\nv 60 20 0\nv 0 20 60\n\
                     f 1 2 3\nf 4 6 5\nf 1 4 5 2\nf 2 5 6 3\nf 3 6 4 1\n";

fn bench(asset: &str, at: &str) -> String {
    format!(
        "mtx 1\n\nuse std::furniture::OpticalTable\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\n\
         use std::robots::{{FrankaHand, FrankaPanda}}\n\n{asset}\n\nlab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    \
         panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    plate = IkaRetControl on table at (450, 200) mm\n    \
         beaker = Beaker250mL on table at (450, -250) mm\n    thing = Thing on table at {at} mm\n}}\n\n\
         workflow carry in bench {{\n    place beaker on plate by panda\n    expect beaker.support == plate\n}}\n"
    )
}

#[test]
fn a_mesh_stands_in_the_way_is_recorded_and_shown() {
    let dir = folder("mesh_run");
    write(&dir, "wedge.obj", WEDGE);
    let asset = "asset Thing: Body {\n    mass: 200 g\n    shape: mesh(\"wedge.obj\", 10 mm)\n}";
    write(&dir, "beside.mtx", bench(asset, "(450, 700)"));
    write(&dir, "close.mtx", bench(asset, "(450, -110)"));
    let ended = matterixc_in(&dir, &["run", "beside.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let judged = matterixc_in(&dir, &["verify", "out"]);
    assert!(judged.out.contains("nothing wrong"), "{}", judged.out);
    for shown in ["out", "beside.mtx"] {
        assert_eq!(matterixc_in(&dir, &["view", shown, "--export", "page.html"]).code, 0);
        let page = std::fs::read_to_string(dir.join("page.html")).expect("a page");
        assert!(page.contains("\"indices\":[0,1,2"), "{shown}");
    }
    let found = matterixc_in(&dir, &["check", "close.mtx", "--fidelity", "motion", "--format", "concise"]);
    assert!(found.out.contains("error[collision]") && found.out.contains("`thing`"), "{}", found.out);
}

#[test]
fn mistakes_with_meshes_are_reported_where_they_are() {
    let dir = folder("mesh_mistakes");
    write(&dir, "wedge.obj", WEDGE);
    write(&dir, "broken.stl", "hello");
    write(&dir, "link.stl", "hello");
    let robot = "<robot name=\"r\"><link name=\"a\"><visual><geometry><mesh filename=\"package://r/link.stl\"/></geometry></visual></link></robot>";
    write(&dir, "robot.urdf", robot);
    let text = "mtx 1\nasset A: Body { mass: 1 g, shape: mesh(\"nothing.stl\", 1 mm) }\n\
                asset B: Body { mass: 1 g, shape: mesh(\"broken.stl\", 1 mm) }\n\
                asset C: Body { mass: 1 g, shape: mesh(\"wedge.obj\") }\n\
                asset D: Body { mass: 1 g, shape: mesh(\"wedge.obj\", 0 mm) }\n\
                asset E: Body { mass: 1 g, shape: mesh(wedge, 1 mm) }\n\
                asset F: Body { mass: 1 g, shape: mesh() }\n\
                asset G: Body from urdf \"robot.urdf\" { mass: 1 g }\n";
    write(&dir, "shapes.mtx", text);
    let ended = matterixc_in(&dir, &["check", "shapes.mtx", "--format", "concise"]);
    let found: Vec<&str> = ended.out.lines().filter_map(|l| l.split_once("shapes.mtx:")).map(|(_, l)| l).collect();
    let expected = [
        "2:40: error[mesh-file]: cannot read `nothing.stl`",
        "3:40: error[mesh-file]: `broken.stl` is not a mesh: it is not an STL file",
        "4:35: error[wrong-arguments]: the file `wedge.obj` does not give its unit of length",
        "5:53: error[out-of-range]",
        "6:40: error[type-mismatch]: `mesh` needs the name of a file",
        "7:35: error[wrong-arguments]",
        "8:25: error[mesh-file]: `link.stl` is not a mesh",
    ];
    assert_eq!(found.len(), expected.len(), "{}", ended.out);
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} is not {expected}");
    }
    let text = "mtx 1\nasset A: Body { mass: 1 g, shape: mesh(\"wedge.obj\", 1 mm) }\n\
                lab bench { ambient: 20 degC, a = A { shape: mesh(\"wedge.obj\", 2 mm) } at (0, 0, 0) m }\n\
                workflow look in bench { wait 1 s }\n";
    write(&dir, "lab.mtx", text);
    let ended = matterixc_in(&dir, &["run", "lab.mtx"]);
    assert!(
        ended.err.contains("error[unsupported]: a mesh must be given in the declaration of its asset"),
        "{}",
        ended.err
    );
}

#[test]
fn a_robot_with_meshes_moves_and_is_judged_by_them() {
    let dir = folder("mesh_robot");
    std::fs::create_dir_all(dir.join("arm")).expect("a folder");
    write(&dir, "arm/wedge.obj", WEDGE);
    let link = |name: &str| {
        let mesh = "<geometry><mesh filename=\"package://arm/wedge.obj\" scale=\"0.001 0.001 0.001\"/></geometry>";
        format!("<link name=\"{name}\"><visual>{mesh}</visual><collision>{mesh}</collision></link>")
    };
    let joint = |name: &str, parent: &str, child: &str, axis: &str| {
        format!(
            "<joint name=\"{name}\" type=\"prismatic\"><origin xyz=\"0 0 0.1\"/><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <axis xyz=\"{axis}\"/><limit lower=\"0\" upper=\"0.5\" velocity=\"0.5\" effort=\"1\" acceleration=\"2\" jerk=\"50\"/></joint>"
        )
    };
    let urdf = format!(
        "<robot name=\"arm\">{}{}{}{}{}</robot>",
        link("base"),
        link("one"),
        link("two"),
        joint("x", "base", "one", "1 0 0"),
        joint("z", "one", "two", "0 0 1")
    );
    write(&dir, "arm/arm.urdf", urdf);
    let text = "mtx 1\n\nasset Gantry: Arm from urdf \"arm/arm.urdf\" {\n    mass: 3 kg\n    payload: 1 kg\n    tip: \"two\"\n}\n\n\
                extern skill shift(arm: Arm)\n    moves arm straight by (200, 0, 100) mm\n    takes 1 s\n\n\
                lab bench {\n    ambient: 20 degC\n    gantry = Gantry at (0, 0, 0) m\n}\n\n\
                workflow go in bench {\n    shift gantry\n    expect elapsed < 5 s\n}\n";
    write(&dir, "go.mtx", text);
    let ended = matterixc_in(&dir, &["run", "go.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let judged = matterixc_in(&dir, &["verify", "out"]);
    assert!(judged.out.contains("gantry: moved 0.22 m") && judged.out.contains("nothing wrong"), "{}", judged.out);
}
