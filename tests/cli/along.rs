//! What goes along with what moves, as recordings have it; and robots that drive to a place.

use std::collections::BTreeMap;

use crate::harness::{folder, matterixc_in, root, write};

/// Places of things in the lab over time, m, and what was taken along beside grips.
struct Ways {
    ways: BTreeMap<String, Vec<(f64, [f64; 3])>>,
    loads: Vec<(f64, Vec<String>)>,
}

fn ways(file: &std::path::Path) -> Ways {
    let recording = matterix_recording::read(&std::fs::read(file).expect("a recording")).expect("it can be read");
    let mut out = Ways { ways: BTreeMap::new(), loads: Vec::new() };
    for topic in &recording.topics {
        for (time, message) in &topic.messages {
            if topic.name == "/loads" {
                let items = matterix_recording::list(message, "items");
                out.loads.push((*time, items.iter().filter_map(|i| Some(i.as_str()?.to_string())).collect()));
            }
            let transforms = matterix_recording::list(message, "transforms").iter();
            for t in transforms.filter(|t| topic.name == "/tf" && t["parent_frame_id"] == "lab") {
                let at = ["x", "y", "z"].map(|k| matterix_recording::number(&t["translation"], k));
                let name = matterix_recording::text(t, "child_frame_id");
                out.ways.entry(name.to_string()).or_default().push((*time, at));
            }
        }
    }
    out
}

impl Ways {
    fn at(&self, name: &str, time: f64) -> [f64; 3] {
        let way = &self.ways[name];
        way[way.partition_point(|(t, _)| *t <= time).max(1) - 1].1
    }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_tip_leaves_its_rack_sits_on_the_nozzle_and_ends_in_the_bin() {
    let dir = folder("along_tip");
    let file = root().join("examples/environments/liquid_dispensing.mtx");
    let run = ["run", &file.display().to_string(), "--fidelity", "motion", "--out", "out"];
    assert_eq!(matterixc_in(&dir, &run).code, 0);
    let ways = ways(&dir.join("out/recording.mcap"));
    let [(taken, items), (dropped, none)] = &ways.loads[..] else { panic!("{:?}", ways.loads) };
    assert!(items[..] == ["tips[A1]"] && none.is_empty());
    let nozzle = |time| ways.at("ot2.left_mount", time);
    let tip = |time| ways.at("tips[A1]", time);
    // It does not jump when it is taken, and hangs below the same point of its mount from then on.
    assert!(apart(tip(taken - 0.1), tip(taken + 0.1)) < 1e-3);
    let hangs = |time| [0, 1, 2].map(|k| nozzle(time)[k] - tip(time)[k]);
    let share = |s: f64| taken + s * (dropped - taken);
    for s in [0.1, 0.4, 0.7, 0.99] {
        assert!(apart(hangs(share(s)), hangs(share(0.2))) < 1e-6, "{:?}", hangs(share(s)));
    }
    // Others stay in the rack.
    assert_eq!(ways.at("tips[B1]", *taken), ways.at("tips[B1]", *dropped));
    assert!(apart(tip(f64::INFINITY), ways.at("ot2.trash", 0.0)) < 0.25);
    assert!(apart(tip(f64::INFINITY), ways.at("tips[B1]", *taken)) > 0.2);
    // It has fallen onto the bin, which is a block of 82 mm in its definition.
    assert!((tip(f64::INFINITY)[2] - ways.at("ot2.trash", 0.0)[2] - 0.082).abs() < 1e-3, "{:?}", tip(f64::INFINITY));
}

#[test]
fn what_is_put_into_a_rack_goes_along_with_it() {
    let dir = folder("along_rack");
    let text = "mtx 1\nuse std::robots::{FrankaPanda, PlateGripper}\nuse std::vials::{Vial20mL, VialRack8}\n\
                lab bench {\n    ambient: 25 degC\n    table = OpticalTable\n    \
                panda = FrankaPanda { gripper: PlateGripper { closed: 20 mm } } on table at (0, 0) mm\n    \
                rack = VialRack8 on table at (450, -250) mm\n    vial = Vial20mL in rack[A2] holding 10 g of water\n    \
                mat = Mat on table at (450, 250) mm\n}\nasset Mat: Surface { mass: 50 g, shape: box(150 mm, 150 mm, 2 mm) }\n\
                workflow go in bench {\n    place rack on mat by panda\n    expect rack.support == mat\n}\n";
    write(&dir, "go.mtx", text);
    let ended = matterixc_in(&dir, &["run", "go.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let ways = ways(&dir.join("out/recording.mcap"));
    let end = ways.ways["rack"].last().expect("a way").0;
    assert!(apart(ways.at("rack", 0.0), ways.at("rack", end)) > 0.4);
    let first = apart(ways.at("rack", 0.0), ways.at("vial", 0.0));
    for (time, at) in &ways.ways["rack"] {
        // As far from it as at first all the time, while it is carried too.
        assert!((apart(*at, ways.at("vial", *time)) - first).abs() < 1e-6, "{time} s");
    }
    assert!(ways.ways["vial"].len() > 20);
}

#[test]
fn a_robot_drives_to_a_place_or_it_is_said_why_not() {
    let dir = folder("along_drive");
    let lab = |dock: &str, robot: &str| {
        format!(
            "mtx 1\nuse std::robots::{{FrankaHand, FrankaPanda, KukaKmrIiwa, Robotiq2F85}}\nlab floor {{\n    ambient: 22 degC\n    \
             robot = {robot}\n    table = OpticalTable at (0, 2.5, 0.7) m\n    \
             dock = Waypoint at {dock} m with rpy(0 deg, 0 deg, 90 deg)\n}}\n\
             workflow go in floor {{\n    drive robot to dock\n}}\n"
        )
    };
    let kuka = "KukaKmrIiwa { gripper: Robotiq2F85 {} } at (0, 0, 0) m";
    write(&dir, "free.mtx", lab("(2, 4, 0)", kuka));
    let ended = matterixc_in(&dir, &["run", "free.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let base = ways(&dir.join("out/recording.mcap")).at("robot.base", f64::INFINITY);
    assert!((base[0] - 2.0).hypot(base[1] - 4.0) < 0.3, "{base:?}");
    write(&dir, "blocked.mtx", lab("(0.3, 2.5, 0)", kuka));
    write(&dir, "fixed.mtx", lab("(2, 4, 0)", "FrankaPanda { gripper: FrankaHand {} } at (0, 0, 0) m"));
    for (file, said) in [
        ("blocked.mtx", "error[collision]: `robot` would collide with `table`"),
        ("fixed.mtx", "error[out-of-reach]: `robot` cannot drive"),
    ] {
        let ended = matterixc_in(&dir, &["check", file, "--format", "concise"]);
        assert!(ended.out.contains(&format!("{file}:10:5: {said}")), "{}", ended.out);
    }
}

#[test]
fn a_vessel_stays_upright_while_its_robot_drives() {
    let dir = folder("along_upright");
    let text = "mtx 1\nuse std::glassware::Beaker250mL\nuse std::robots::{KukaKmrIiwa, Robotiq2F85}\n\
                extern skill carry(arm: Arm) to(goal: Frame)\n    moves arm to goal\n    takes arm.move_time in 0.2 s .. 60 s\n\
                lab floor {\n    ambient: 22 degC\n    kuka = KukaKmrIiwa { gripper: Robotiq2F85 } at (0, 0, 0) m\n    \
                store = OpticalTable at (0, 2.5, 0.7) m\n    \
                bench = OpticalTable at (3.5, -1.5, 0.7) m with rpy(0 deg, 0 deg, 90 deg)\n    \
                beaker = Beaker250mL on store at (200, -250) mm\n}\n\
                workflow go in floor {\n    pick beaker by kuka\n    carry kuka to bench.pre_place\n    \
                place beaker on bench by kuka\n}\n";
    write(&dir, "go.mtx", text);
    let ended = matterixc_in(&dir, &["run", "go.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    let file = std::fs::read(dir.join("out/recording.mcap")).expect("a recording");
    let recording = matterix_recording::read(&file).expect("it can be read");
    let (mut base, mut drives, mut driven) = ([0.0; 3], false, 0);
    let messages = recording.topics.iter().filter(|t| t.name == "/tf").flat_map(|t| &t.messages);
    for (time, message) in messages {
        let found = |name: &str| {
            let all = matterix_recording::list(message, "transforms").iter();
            all.clone().find(|t| matterix_recording::text(t, "child_frame_id") == name)
        };
        if let Some(foot) = found("kuka.base") {
            let now = ["x", "y", "z"].map(|k| matterix_recording::number(&foot["translation"], k));
            drives = apart(now, base) > 1e-6;
            base = now;
        }
        if let Some(beaker) = found("beaker").filter(|_| drives) {
            let [x, y] = ["x", "y"].map(|k| matterix_recording::number(&beaker["rotation"], k));
            let tilt = 2.0 * x.hypot(y).min(1.0).asin();
            assert!(tilt < 0.12, "{time} s: {tilt}");
            driven += 1;
        }
    }
    assert!(driven > 20, "{driven}");
}
