//! Liquids in what robots hold: carried so that they stay in, poured as far as the vessel is tilted, and what runs over said.

use std::f64::consts::PI;

use crate::harness::{flat, folder, matterixc, matterixc_in, write};

/// A lab with two beakers of 250 mL, an arm and a balance.
fn bench(arm: &str, target: &str, volume: &str, more: &str, steps: &str) -> String {
    format!(
        "mtx 1\nuse std::glassware::{{Beaker250mL, Erlenmeyer50mL}}\nuse std::heating::IkaRetControl\n\
         use std::robots::{{FrankaPanda, Robotiq2F85, WristXM540}}\n{more}\nlab bench {{\n    ambient: 22 degC\n    \
         table = OpticalTable at (0, 0, 0) m\n    \
         panda = FrankaPanda {{ wrist: WristXM540 {{}}, gripper: Robotiq2F85 {{}} {arm} }} on table at (-400, 0) mm\n    \
         scale = IkaRetControl on table at (100, 200) mm\n    target = {target} on scale\n    \
         source = Beaker250mL on table at (50, -200) mm holding {volume} of water\n}}\nworkflow run in bench {{\n    {steps}\n}}\n"
    )
}

/// The seconds that a step of a run lasted, by the words of its line.
fn lasted(said: &str, step: &str) -> f64 {
    let line = said.lines().find(|line| line.contains("std::skills") && line.contains(step));
    let line = line.unwrap_or_else(|| panic!("no `{step}` in {said}"));
    let [begin, end] =
        [0, 1].map(|k| line.split_whitespace().nth(k).expect("a time").parse::<f64>().expect("a number"));
    end - begin
}

/// Runs a text with its motions, has the recording judged, and gives what the run said.
fn judged(name: &str, text: &str) -> String {
    let dir = folder(name);
    write(&dir, "bench.mtx", text);
    let run = matterixc_in(&dir, &["run", "bench.mtx", "--fidelity", "motion", "--out", "out"]);
    assert_eq!(run.code, 0, "{name}: {}{}", run.out, run.err);
    let verdict = matterixc_in(&dir, &["verify", "out"]);
    assert!(verdict.code == 0 && verdict.out.contains("nothing wrong"), "{name}: {}", verdict.out);
    run.out
}

#[test]
fn a_full_beaker_is_carried_more_slowly_than_an_empty_one_and_one_that_may_spill() {
    let carry = "pick source by panda\n    move panda to target.pre_grasp\n    put back source by panda";
    let way = |name: &str, arm: &str, volume: &str| {
        lasted(&judged(name, &bench(arm, "Beaker250mL", volume, "", carry)), "move panda to source.pre_stand")
    };
    let (full, half) = (way("spills_full", "", "300 mL"), way("spills_half", "", "120 mL"));
    let spilling = way("spills_allowed", ", may_spill: true", "300 mL");
    assert!(full > 1.3 * half && half > spilling, "{full} s full, {half} s half full, {spilling} s if it may spill");
}

#[test]
fn a_vessel_is_tilted_as_far_as_closed_forms_say_and_as_fast_as_it_pours() {
    // Inside, the beaker is 33.2 mm wide from the middle and 93 mm deep. 60 of 100 g leave 40.1 mL: below the hoof of 2/3 r2 h, 68 mL.
    let text = bench(
        "",
        "Beaker250mL",
        "100 mL",
        "",
        "let m <- pour 60 g from source into target by panda using scale { tolerance: 2 g }",
    );
    let said = judged("spills_pour", &text);
    assert!((lasted(&said, "tilt source into target") - 12.0).abs() < 0.02, "{said}");
    let dir = folder("spills_pour");
    // The law itself, asked as a user would.
    let (r, h) = (0.0332_f64, 0.093_f64);
    let asks = |tilt: f64, volume: f64| {
        format!(
            "expect kept(source, {} deg) in {} mL .. {} mL",
            tilt.to_degrees(),
            volume * 1e6 - 0.4,
            volume * 1e6 + 0.4
        )
    };
    let wedge = |tilt: f64| PI * r * r * (h - r * tilt.tan());
    let through = (h / r).atan();
    let mut steps: Vec<String> = [10.0_f64, 30.0, 50.0].map(|d| asks(d.to_radians(), wedge(d.to_radians()))).to_vec();
    steps.push(asks(through, 2.0 / 3.0 * r * r * h));
    steps.push(asks(PI / 2.0, 0.4e-6));
    steps.push("expect brink(source, 184.6 mL) in 49.8 deg .. 50.2 deg".to_string());
    let text = bench("", "Beaker250mL", "100 mL", "", &steps.join("\n    "));
    write(&dir, "law.mtx", text);
    let law = matterixc_in(&dir, &["run", "law.mtx"]);
    assert_eq!(law.code, 0, "{}{}", law.out, law.err);
}

/// A step of the user's own that tilts as far as it likes and says that two grams run out.
const OWN: &str = "extern skill dash(source: Container) into(target: Container) by(arm: Arm)\n    \
     moves arm tilted 75 deg about source.lip to target.spout in 3 s\n    needs arm.holding == source\n    \
     effect move(2 g, from: source, to: target)\n    takes 3 s\n\
     extern skill lean(source: Container) at(target: Container) by(arm: Arm)\n    \
     moves arm tilted 60 deg about source.lip to target.spout\n    needs arm.holding == source\n    takes 3 s\n";

#[test]
fn a_tilt_that_does_not_go_with_what_is_said_to_run_out_is_found() {
    let dir = folder("spills_own");
    let steps = "pick source by panda\n    dash source into target by panda\n    level source at target by panda\n    put back source by panda";
    write(&dir, "bench.mtx", bench("", "Beaker250mL", "200 mL", OWN, steps));
    let run = matterixc_in(&dir, &["run", "bench.mtx", "--fidelity", "motion", "--out", "out"]);
    assert!(run.code != 0 && (run.out + &run.err).contains("`source` would spill in the gripper of `panda`"));
    let process = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert_eq!(process.code, 0, "{}{}", process.out, process.err);

    let steps = "pick source by panda\n    lean source at target by panda\n    level source at target by panda\n    put back source by panda";
    write(&dir, "lean.mtx", bench("", "Beaker250mL", "200 mL", OWN, steps));
    let check = matterixc_in(&dir, &["check", "--no-cache", "lean.mtx"]);
    assert!(check.code == 1 && check.out.contains("error[spilled]"), "{}{}", check.out, check.err);
    let run = matterixc_in(&dir, &["run", "lean.mtx", "--fidelity", "motion", "--dry"]);
    assert!(run.code != 101, "{}", run.err);
    write(&dir, "little.mtx", bench("", "Beaker250mL", "50 mL", OWN, steps));
    let check = matterixc_in(&dir, &["check", "--no-cache", "little.mtx"]);
    assert_eq!(check.code, 0, "{}{}", check.out, check.err);
}

#[test]
fn a_stream_that_misses_a_narrow_mouth_is_found_and_a_slow_one_goes_in() {
    let pour = "let m <- pour 20 g from source into target by panda using scale { tolerance: 1 g }";
    let dir = folder("spills_narrow");
    write(&dir, "quick.mtx", bench(", pour_rate: 40 g/s", "Erlenmeyer50mL", "100 mL", "", pour));
    let quick = matterixc_in(&dir, &["check", "--no-cache", "quick.mtx"]);
    let said = flat(&quick.out);
    assert!(quick.code == 1 && said.contains("the mouth of `target` is 19 mm wide"), "{}{}", quick.out, quick.err);
    write(&dir, "slow.mtx", bench(", pour_rate: 1 g/s", "Erlenmeyer50mL", "100 mL", "", pour));
    let slow = matterixc_in(&dir, &["check", "--no-cache", "slow.mtx"]);
    assert_eq!(slow.code, 0, "{}{}", slow.out, slow.err);
}

#[test]
fn a_vessel_whose_inside_is_not_known_is_poured_from_as_the_arm_says() {
    let jug = "asset Jug: Container, Graspable {\n    mass: 60 g\n    capacity: 60 J/K\n    air: 0.1 W/K\n    inner: 5 W/K\n    \
               max_volume: 300 mL\n    wall: 1 W/K\n    contents: { air: 0.02 W/K }\n    shape: cylinder(70 mm, 95 mm)\n    \
               frame grasp at (0, 0, 65) mm\n}\n";
    let text = bench(
        "",
        "Beaker250mL",
        "100 mL",
        jug,
        "expect kept(source, 30 deg) == unlimited\n    expect brink(source, 1 mL) == unlimited",
    );
    let dir = folder("spills_unknown");
    write(&dir, "bench.mtx", text.replace("source = Beaker250mL", "source = Jug"));
    let run = matterixc(&["run", dir.join("bench.mtx").to_str().expect("a path")]);
    assert_eq!(run.code, 0, "{}{}", run.out, run.err);
}

#[test]
fn a_thing_that_a_grip_barely_bears_is_carried_more_slowly() {
    let text = |friction: f64| {
        format!(
            "mtx 1\nuse std::robots::{{FrankaHand, FrankaPanda}}\nasset Block: Graspable {{\n    mass: 1.4 kg\n    \
             friction: {friction}\n    shape: box(60 mm, 60 mm, 140 mm)\n    frame grasp at (0, 0, 120) mm\n}}\n\
             asset Mat: Surface {{\n    mass: 1 kg\n    shape: box(200 mm, 200 mm, 20 mm)\n}}\nlab bench {{\n    \
             ambient: 22 degC\n    table = OpticalTable at (0, 0, 0) m\n    \
             arm = FrankaPanda {{ gripper: FrankaHand {{}} }} on table at (0, 0) mm\n    \
             block = Block on table at (450, -200) mm\n    mat = Mat on table at (450, 250) mm\n}}\n\
             workflow run in bench {{\n    place block on mat by arm\n}}\n"
        )
    };
    // The hand presses with 70 N: 0.105 bear 14.7 N, and the block weighs 13.7 N.
    let way = |name: &str, friction: f64| lasted(&judged(name, &text(friction)), "move arm to mat.pre_place");
    let (barely, well) = (way("spills_barely", 0.105), way("spills_well", 0.6));
    assert!(barely > 1.5 * well, "{barely} s, {well} s");
    let dir = folder("spills_slips");
    write(&dir, "bench.mtx", text(0.09));
    let weak = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
    assert!(weak.code == 1 && weak.out.contains("grip-too-weak"), "{}", weak.out);
}

#[test]
fn a_beaker_filled_to_the_brim_is_poured_from_as_long_as_it_holds_its_contents() {
    // The inside holds 322.0 mL: a tilt of 0.3 deg brings 321.5 mL to the lip.
    let brim = "asset Brim: Beaker250mL { max_volume: 322 mL }";
    let pour = "let m <- pour 20 g from source into target by panda using scale { tolerance: 1 g }";
    for volume in ["321.5 mL", "322 mL"] {
        let text = bench("", "Beaker250mL", volume, brim, pour).replace("source = Beaker250mL", "source = Brim");
        judged("spills_brim", &text);
    }
}

#[test]
fn pouring_nothing_or_less_and_pouring_from_an_empty_vessel_are_refused_in_words() {
    let dir = folder("spills_nothing");
    let pour = |amount: &str| {
        format!("let m <- pour {amount} from source into target by panda using scale {{ tolerance: 1 g }}")
    };
    let tilt = |amount: &str| {
        format!(
            "pick source by panda\n    tip source into target by panda\n    \
             tilt source into target by panda {{ amount: {amount} }}\n    put back source by panda"
        )
    };
    let cases = [
        ("100 mL", pour("0 g"), "the amount to pour is 0 g"),
        ("100 mL", pour("-5 g"), "the amount to pour is -5 g"),
        ("100 mL", tilt("0 g"), "the amount to pour is 0 g"),
        ("0 mL", pour("5 g"), "`source` holds 0 g, and this pours 5 g"),
        ("0 mL", tilt("5 g"), "`source` holds 0 g, and this pours 5 g"),
    ];
    for (volume, steps, said) in cases {
        write(&dir, "bench.mtx", bench("", "Beaker250mL", volume, "", &steps).replace(" holding 0 mL of water", ""));
        let check = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
        assert!(check.code == 1 && check.out.contains(said), "{steps}: {}{}", check.out, check.err);
    }
    // What is poured may be known in the run only.
    let steps = "pick source by panda\n    tip source into target by panda\n    let left = scale.net\n    \
                 tilt source into target by panda { amount: left - left }\n    put back source by panda";
    write(&dir, "bench.mtx", bench("", "Beaker250mL", "100 mL", "", steps));
    let run = matterixc_in(&dir, &["run", "bench.mtx"]);
    assert!(run.code != 0 && (run.out + &run.err).contains("the amount to pour is 0 g"));
}

#[test]
fn a_vessel_wider_than_its_lip_is_held_clear_of_the_rim_that_it_leans_over() {
    // Its outside: 17.5 mm at the lip, 132 mm high, and 41 mm from 15 mm down. Of what is within 35 mm behind the lip the lowest is on the wall
    // between (17.5, 103) and (41, 15), or on that below; at 80 deg it is the neck's.
    let low = |tilt: f64| {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let outline = [[41.0, 0.0], [41.0, 15.0], [17.5, 103.0], [17.5, 132.0]];
        let turned = |share: f64, pair: &[[f64; 2]]| {
            let [r, z] = [0, 1].map(|k| pair[0][k] + (pair[1][k] - pair[0][k]) * share);
            let (out, down) = (r - 17.5, 132.0 - z);
            [out * cos - down * sin, down * cos + out * sin]
        };
        let points = outline.windows(2).flat_map(|pair| (0..=2000).map(|i| turned(f64::from(i) / 2000.0, pair)));
        points.filter(|p| p[0] >= -35.0).map(|p| p[1]).fold(0.0, f64::max)
    };
    let asks = |tilt: f64| {
        format!("expect droop(source, {tilt} deg, 35 mm) in {:.3} mm .. {:.3} mm", low(tilt) - 0.1, low(tilt) + 0.1)
    };
    let steps: Vec<String> = [5.0, 20.0, 30.0, 50.0, 80.0].map(asks).to_vec();
    let flask = |volume: &str, steps: &str| {
        let text = bench("", "Beaker250mL", volume, "use std::glassware::Erlenmeyer250mL", steps);
        text.replace("source = Beaker250mL", "source = Erlenmeyer250mL")
    };
    let dir = folder("spills_droop");
    write(&dir, "law.mtx", flask("100 mL", &steps.join("\n    ")));
    let law = matterixc_in(&dir, &["run", "law.mtx"]);
    assert_eq!(law.code, 0, "{}{}", law.out, law.err);
    // A third of a flask of 310 mL comes to its lip at low tilts.
    let pour = "let m <- pour 20 g from source into target by panda using scale { tolerance: 1 g }";
    judged("spills_flask", &flask("250 mL", pour));
}

#[test]
fn a_capacity_beyond_the_inside_and_an_inside_beyond_the_outside_are_found_where_they_are_declared() {
    let dir = folder("spills_declared");
    let declared = |fields: &str| {
        write(
            &dir,
            "ware.mtx",
            format!("mtx 1\nuse std::glassware::Beaker250mL\nasset Ware: Beaker250mL {{ {fields} }}\n"),
        );
        let check = matterixc_in(&dir, &["check", "--no-cache", "ware.mtx"]);
        (check.code, check.out)
    };
    let (code, said) = declared("max_volume: 400 mL");
    assert!(
        code == 1 && said.contains("`max_volume` cannot be 400 mL") && said.contains("at most 325.26 mL"),
        "{said}"
    );
    assert_eq!(declared("max_volume: 322 mL").0, 0);
    let outside = "[(0, 0) mm, (35, 0) mm, (35, 95) mm]";
    for (inside, words) in [
        ("[(0, 2) mm, (36, 2) mm, (36, 95) mm]", "its radius is 36 mm, but that of the outside is 35 mm"),
        ("[(0, 2) mm, (33, 2) mm, (33, 96) mm]", "it has a point at a height of 96 mm, above or below the outside"),
    ] {
        let (code, said) = declared(&format!("shape: turned({outside}, {inside})"));
        assert!(code == 1 && said.contains("wider or taller than its outside") && said.contains(words), "{said}");
    }
    // A vessel whose inside is not known may say what it likes.
    assert_eq!(declared("max_volume: 400 mL, shape: cylinder(70 mm, 95 mm)").0, 0);
}

#[test]
fn a_handler_for_what_a_motion_fails_with_is_no_dead_one() {
    let dir = folder("spills_handled");
    let handled = |steps: &str, name: &str| {
        let steps = format!("sequence {{\n        {steps}\n    }} on {name} {{ note \"so it is\" }}");
        write(&dir, "bench.mtx", bench("", "Beaker250mL", "200 mL", OWN, &steps));
        let check = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
        (check.code, check.out + &check.err)
    };
    for name in ["spilled", "collision", "no_way", "unreachable", "too_wide", "unmovable"] {
        let (code, said) = handled("pick source by panda\n        put back source by panda", name);
        assert!(code == 0 && !said.contains("dead-branch"), "{name}: {said}");
    }
    let (_, said) = handled("wait 1 s", "spilled");
    assert!(said.contains("no step before this handler can fail with `spilled`"), "{said}");
    // The handler takes it in a run, and what it does is looked at.
    let steps = "pick source by panda\n    sequence { lean source at target by panda } on spilled { note \"ran over\" }\n    \
                 level source at target by panda\n    put back source by panda";
    write(&dir, "run.mtx", bench("", "Beaker250mL", "200 mL", OWN, steps));
    let run = matterixc_in(&dir, &["run", "run.mtx", "--fidelity", "motion", "--out", "out"]);
    assert!(run.out.contains("ran over") || run.err.contains("ran over"), "{}{}", run.out, run.err);
}

/// A lab with a tray of 150 g, a beaker of 50 mL on it, and a mat; the fingers bear the tray by this friction.
fn tray(arm: &str, volume: &str, friction: f64, steps: &str) -> String {
    format!(
        "mtx 1\nuse std::glassware::Beaker50mL\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\
         asset Tray: Surface, Graspable {{\n    mass: 150 g\n    friction: {friction}\n    spots: 4\n    shape: box(60 mm, 200 mm, 10 mm)\n    \
         solid box(20 mm, 20 mm, 100 mm) at (0, 0, 10) mm\n    frame grasp at (0, 0, 90) mm\n    frame place at (0, 60, 10) mm\n}}\n\
         asset Mat: Surface {{\n    mass: 1 kg\n    shape: box(250 mm, 250 mm, 10 mm)\n}}\nlab bench {{\n    ambient: 22 degC\n    \
         table = OpticalTable at (0, 0, 0) m\n    arm = FrankaPanda {{ gripper: FrankaHand {{}} {arm} }} on table at (0, 0) mm\n    \
         tray = Tray on table at (450, -200) mm\n    mat = Mat on table at (450, 250) mm\n    \
         cup = Beaker50mL on tray{volume}\n}}\nworkflow run in bench {{\n    {steps}\n}}\n"
    )
}

#[test]
fn what_stands_on_a_tray_is_carried_as_carefully_as_what_is_in_hand() {
    let way = |name: &str, arm: &str, volume: &str| {
        let text = tray(arm, volume, 0.5, "place tray on mat by arm");
        lasted(&judged(name, &text), "move arm to mat.pre_place")
    };
    let (full, empty) = (way("spills_tray_full", "", " holding 68 mL of water"), way("spills_tray_empty", "", ""));
    let spilling = way("spills_tray_allowed", ", may_spill: true", " holding 68 mL of water");
    assert!(full > 2.0 * empty && spilling == empty, "{full} s full, {empty} s empty, {spilling} s if it may spill");
    // The hand presses with 70 N: 0.014 bear 1.96 N. The tray weighs 1.47 N, with the full beaker 2.4 N.
    let dir = folder("spills_tray_weak");
    let check = |volume: &str| {
        write(&dir, "bench.mtx", tray("", volume, 0.014, "place tray on mat by arm"));
        let check = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
        (check.code, check.out)
    };
    assert_eq!(check("").0, 0);
    let (code, said) = check(" holding 68 mL of water");
    assert!(code == 1 && said.contains("error[grip-too-weak]") && said.contains("weighs 2.4 N"), "{said}");
}

#[test]
fn joints_that_turn_so_that_what_is_carried_runs_over_are_found() {
    let turn = "turn joints arm to [0 deg, -45 deg, 0 deg, -135 deg, 0 deg, 120 deg, 45 deg]";
    let steps = format!("pick tray by arm\n    {turn}\n    home arm\n    put back tray by arm");
    let dir = folder("spills_turned");
    let check = |volume: &str| {
        write(&dir, "bench.mtx", tray("", volume, 0.5, &steps));
        let check = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
        (check.code, check.out + &check.err)
    };
    let (code, said) = check(" holding 68 mL of water");
    assert!(code == 1 && said.contains("error[spilled]: `cup` would spill in the gripper of `arm`"), "{said}");
    let (code, said) = check(" holding 30 mL of water");
    assert_eq!(code, 0, "{said}");
    // What only a run can tell, as how much a pump has brought by then, the run says.
    let text = pumped("pump 180 mL at 60 mL/min by pump").replace(TIPPED, "wait 1 s");
    write(&dir, "run.mtx", text.replace("by pump\n", &format!("by pump\n    {TIPPED}\n")));
    let run = matterixc_in(&dir, &["run", "run.mtx", "--fidelity", "motion"]);
    assert!(run.code == 1 && run.out.contains("spilled: `panda` tilts `source` so far that"), "{}{}", run.out, run.err);
}

/// A lab with a pump from a bottle to a beaker of 250 mL that an arm picks up.
fn pumped(steps: &str) -> String {
    format!(
        "mtx 1\nuse std::glassware::{{Beaker250mL, Bottle500mL}}\nuse std::pumps::TubePump\n\
         use std::robots::{{FrankaPanda, Robotiq2F85, WristXM540}}\nlab bench {{\n    ambient: 22 degC\n    \
         table = OpticalTable at (0, 0, 0) m\n    \
         panda = FrankaPanda {{ wrist: WristXM540 {{}}, gripper: Robotiq2F85 {{}} }} on table at (-400, 0) mm\n    \
         stock = Bottle500mL on table at (-200, -300) mm holding 500 mL of water\n    \
         source = Beaker250mL on table at (50, -200) mm holding 100 mL of water\n    \
         pump = TubePump {{ source: stock, sink: source }} at (2, 0, 0) m\n}}\nworkflow run in bench {{\n    \
         pick source by panda\n    {TIPPED}\n    {steps}\n}}\n"
    )
}

/// The beaker in hand is tilted by 35 deg: it keeps 241.5 mL.
const TIPPED: &str = "turn joints panda to [0 deg, -45 deg, 0 deg, -135 deg, 0 deg, 125 deg, 45 deg, 0 deg]";
const UPRIGHT: &str = "turn joints panda to [0 deg, -45 deg, 0 deg, -135 deg, 0 deg, 90 deg, 45 deg, 0 deg]";

#[test]
fn a_vessel_that_is_filled_over_its_rim_in_a_hand_is_found_when_it_runs_over() {
    let dir = folder("spills_filled");
    write(
        &dir,
        "bench.mtx",
        pumped(&format!("pump 180 mL at 60 mL/min by pump\n    {UPRIGHT}\n    put back source by panda")),
    );
    let run = matterixc_in(&dir, &["run", "bench.mtx", "--fidelity", "motion", "--out", "out"]);
    assert!(run.code == 1 && run.out.contains("holds it tilted by 35 deg"), "{}{}", run.out, run.err);
    // 141.5 mL take as many seconds, from 3.3 s on.
    let line = run.out.lines().find(|line| line.starts_with("Failure at ")).expect("a failure");
    let time: f64 = line.trim_start_matches("Failure at ").trim_end_matches(" s").parse().expect("a time");
    assert!((time - 144.8).abs() < 0.6, "{line}");
    // Less of it stays in; and a handler may have the beaker set upright.
    let little = format!("pump 130 mL at 60 mL/min by pump\n    {UPRIGHT}\n    put back source by panda");
    judged("spills_filled_little", &pumped(&little));
    let handled = format!(
        "sequence {{ pump 180 mL at 60 mL/min by pump }} on spilled {{ {UPRIGHT}; wait 60 s }}\n    put back source by panda"
    );
    judged("spills_filled_handled", &pumped(&handled));
    // Where nobody sets it upright the recording tells as well.
    let left = "sequence { pump 180 mL at 60 mL/min by pump } on spilled { wait 60 s }";
    write(&dir, "left.mtx", pumped(left));
    matterixc_in(&dir, &["run", "left.mtx", "--fidelity", "motion", "--out", "left"]);
    let verdict = matterixc_in(&dir, &["verify", "left"]);
    // 280 mL are in it then, and told to a thousandth.
    let told = ["38.2", "38.3", "38.4", "38.5"].map(|ml| format!("{ml} mL spill over the rim of `source`"));
    assert!(verdict.code == 1 && told.iter().any(|told| verdict.out.contains(told)), "{}", verdict.out);
}

#[test]
fn a_recording_that_ends_with_a_pour_is_judged_by_what_has_run_out() {
    let steps = "pick source by panda\n    tip source into target by panda\n    \
                 tilt source into target by panda { amount: 100 g }\n    wait 5 s";
    let dir = folder("spills_last");
    write(&dir, "bench.mtx", bench("", "Beaker250mL", "200 mL", "", steps));
    matterixc_in(&dir, &["run", "bench.mtx", "--fidelity", "motion", "--out", "out"]);
    let verdict = matterixc_in(&dir, &["verify", "out"]);
    assert!(verdict.code == 0 && verdict.out.contains("nothing wrong"), "{}", verdict.out);
}

#[test]
fn what_is_filled_into_a_vessel_in_hand_may_be_too_much_for_the_grip() {
    // The fingers press with 3.2 N and bear as much; the beaker of 105 g weighs 2 N with 100 mL in it, and 3.8 N with 280 mL.
    let weak = |volume: &str| {
        let text = pumped(&format!("pump {volume} at 60 mL/min by pump\n    put back source by panda"));
        text.replace(TIPPED, "").replace("Robotiq2F85 {}", "Robotiq2F85 { force: 3.2 N }")
    };
    let dir = folder("spills_filled_weak");
    for (volume, code) in [("100 mL", 0), ("180 mL", 1)] {
        write(&dir, "bench.mtx", weak(volume));
        let check = matterixc_in(&dir, &["check", "--no-cache", "bench.mtx"]);
        assert_eq!(check.code, code, "{volume}: {}{}", check.out, check.err);
        assert_eq!(check.out.contains("error[grip-too-weak]: `pump 180 mL"), code == 1, "{}", check.out);
    }
}
