//! Mass, inertia, friction, collision shapes and meshes of things.

use matterix_ir::Sources;
use matterix_lang::{LibraryOnly, Options, compile};

use crate::harness::{folder, matterixc_in, write};

#[test]
fn a_scene_has_mass_inertia_friction_and_what_is_run_into() {
    let text = "mtx 1\nuse std::glassware::Beaker250mL\nasset Brick: Graspable {\n    mass: 2 kg\n    friction: 0.6\n    \
                shape: box(40 mm, 20 mm, 10 mm)\n    collision: [box(40 mm, 20 mm, 5 mm), cylinder(8 mm, 5 mm, at: (0, 0, 5) mm, with: rpy(0 deg, 90 deg, 0 deg))]\n}\n\
                lab bench {\n    ambient: 25 degC\n    a = Brick at (0, 0, 0) m\n    b = Brick { inertia: (0.1, 0.2, 0.25, 0.01, 0, 0) g*m^2 } at (1, 0, 0) m\n    \
                cup = Beaker250mL at (2, 0, 0) m\n}\nworkflow look in bench { wait 1 s }\n";
    let mut sources = Sources::default();
    let file = sources.add("bench.mtx", text.to_string());
    let (program, found) = compile(&mut sources, file, &LibraryOnly, &Options::default());
    let scene = program.unwrap_or_else(|| panic!("{found:?}")).scene;
    let thing = |name| scene.get(scene.find(name).expect("it is there"));
    let near = |a: [f64; 6], b: [f64; 6]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    let a = thing("a");
    let own = a.inertial.expect("mass and shape are known");
    let twelfth = 2.0 / 12.0;
    let wanted = [5e-4 * twelfth, 0.0, 0.0, 1.7e-3 * twelfth, 0.0, 2e-3 * twelfth];
    assert!(own.mass == 2.0 && near(own.inertia, wanted) && own.placement.position[2] == 0.005, "{own:?}");
    assert_eq!((a.friction, a.collision.len(), a.hull().count(), a.seen().count()), (Some(0.6), 2, 2, 1));
    let given = thing("b").inertial.expect("it is given").inertia;
    assert!(near(given, [1e-4, 1e-5, 0.0, 2e-4, 0.0, 2.5e-4]), "{given:?}");
    let cup = thing("cup");
    // Between a full cylinder and a thin shell about the axis: m r2 / 2 and m r2.
    let [.., zz] = cup.inertial.expect("mass and shape are known").inertia;
    let shell = 0.105 * 0.035 * 0.035;
    assert!(zz > 0.6 * shell && zz < shell && cup.friction == Some(0.5), "{zz}");
}

#[test]
fn what_no_body_has_is_refused_where_it_is_said() {
    let dir = folder("physique_mistakes");
    let asset = |name: &str, rest: &str| {
        format!("asset {name}: Body {{ mass: 1 kg, shape: box(100 mm, 100 mm, 100 mm), {rest} }}\n")
    };
    let given = [
        "inertia: (1, 1, 3) g*m^2",
        "inertia: (1, 1, 1) kg*m^2",
        "inertia: (1, 1) kg*m^2",
        "inertia: (1, 1, 1) kg",
        "inertia: (1, 1, 1, 2, 0, 0) g*m^2",
        "friction: -0.2",
        "friction: 0.2 kg",
        "mesh: mesh(\"nothing.stl\", 1 mm)",
        "collision: []",
        "inertia: (1.6, 1.6, 1.6, 0, 0, 0.1) g*m^2",
    ];
    let mut text = "mtx 1\n".to_string();
    given.iter().zip('A'..).for_each(|(rest, name)| text += &asset(&name.to_string(), rest));
    text += "asset X { inertia: (1, 1, 1) kg*m^2 }\nasset Y: Body { mass: 1 kg, inertia: (1, 1, 1) kg*m^2 }\n\
             asset Z: Body { mass: 1 kg, shape: box(1 mm, 1 mm, 1 mm, at: (0, 0, 1) mm) }\n\
             lab bench { ambient: 20 degC, j = J { inertia: (1, 1, -1) g*m^2 } at (0, 0, 0) m }\nworkflow w in bench { wait 1 s }\n";
    write(&dir, "all.mtx", text);
    let ended = matterixc_in(&dir, &["check", "all.mtx", "--format", "concise"]);
    let found: Vec<&str> = ended.out.lines().filter_map(|l| l.split_once("all.mtx:")).map(|(_, l)| l).collect();
    let expected = [
        ("2:", "error[out-of-range]: this inertia is impossible"),
        ("3:", "error[out-of-range]: this inertia is impossible for its mass and shape"),
        ("4:", "error[type-mismatch]: expected moments of inertia"),
        ("5:", "error[unit-mismatch]: `inertia` expects"),
        ("6:", "error[out-of-range]: this inertia is impossible"),
        ("7:", "error[out-of-range]: `friction` cannot be -0.2"),
        ("8:", "error[unit-mismatch]: `friction` expects a plain number"),
        ("9:", "error[mesh-file]: cannot read `nothing.stl`"),
        ("10:", "error[type-mismatch]: `collision` must be a shape"),
        ("12:", "error[missing-field]: this asset has an inertia but no mass"),
        ("13:", "error[missing-field]: the centre of mass of this asset is unknown"),
        ("14:", "error[wrong-arguments]: only pieces of `collision` take a place"),
        ("15:", "error[out-of-range]: this inertia is impossible"),
    ];
    assert_eq!(found.len(), expected.len(), "{}", ended.out);
    for (found, (line, said)) in found.iter().zip(expected) {
        assert!(found.starts_with(line) && found.contains(said), "{found} is not {line} {said}");
    }
}

#[test]
fn a_lab_gives_the_friction_of_a_pair() {
    let dir = folder("physique_pair");
    let lab = |pair: &str| {
        format!(
            "mtx 1\nuse std::robots::{{FrankaHand, FrankaPanda}}\nasset Block: Graspable {{ mass: 2 kg, friction: 0.1, shape: box(60 mm, 60 mm, 140 mm) }}\n\
             lab bench {{\n    ambient: 22 degC\n    table = OpticalTable\n    arm = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
             block = Block on table at (450, 0) mm\n    {pair}\n}}\nworkflow run in bench {{\n    pick block by arm\n    put back block by arm\n}}\n"
        )
    };
    write(&dir, "a.mtx", lab(""));
    write(&dir, "b.mtx", lab("between arm.gripper and block { sliding: 0.5 }"));
    let found = |file| matterixc_in(&dir, &["check", file, "--format", "concise", "--fidelity", "process"]).out;
    assert!(found("a.mtx").contains("a.mtx:12:5: error[grip-too-weak]"), "{}", found("a.mtx"));
    assert_eq!(found("b.mtx"), "", "{}", found("b.mtx"));
}

#[test]
fn others_run_into_what_is_said_to_be_run_into() {
    let dir = folder("physique_hull");
    let wedge = "v 0 0 0\nv 60 0 0\nv 0 0 60\nv 0 20 0\nv 60 20 0\nv 0 20 60\nf 1 2 3\nf 4 6 5\nf 1 4 5 2\nf 2 5 6 3\nf 3 6 4 1\n";
    write(&dir, "wedge.obj", wedge);
    let lab = |collision: &str| {
        format!(
            "mtx 1\nuse std::glassware::Beaker250mL\nuse std::heating::IkaRetControl\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\
             asset Thing: Body {{\n    mass: 200 g\n    mesh: mesh(\"wedge.obj\", 1 mm)\n    shape: box(300 mm, 300 mm, 400 mm)\n    {collision}\n}}\n\
             lab bench {{\n    ambient: 25 degC\n    table = OpticalTable\n    panda = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
             plate = IkaRetControl on table at (450, 200) mm\n    beaker = Beaker250mL on table at (450, -250) mm\n    \
             thing = Thing on table at (450, -440) mm\n}}\nworkflow carry in bench {{\n    place beaker on plate by panda\n}}\n"
        )
    };
    write(&dir, "in.mtx", lab(""));
    write(&dir, "out.mtx", lab("collision: box(20 mm, 20 mm, 20 mm, at: (0, 400, 0) mm)"));
    let found = matterixc_in(&dir, &["check", "in.mtx", "--format", "concise"]).out;
    assert!(found.contains("error[collision]") && found.contains("`thing`"), "{found}");
    let found = matterixc_in(&dir, &["check", "out.mtx", "--format", "concise"]).out;
    assert!(!found.contains("error"), "{found}");
    assert_eq!(matterixc_in(&dir, &["view", "out.mtx", "--export", "page.html"]).code, 0);
    assert!(std::fs::read_to_string(dir.join("page.html")).expect("a page").contains("\"indices\":[0,1,2"));
}
