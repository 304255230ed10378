//! Arms that go slower than they can: by a share of their speed or acceleration, from some step on, or by the speed of their tips.

use crate::harness::{folder, matterixc_in, write};

/// A workflow of these lines on a bench with an arm that has these settings: how long it takes, s.
fn lasts(name: &str, settings: &str, lines: &str, fidelity: &str) -> f64 {
    let dir = folder(&format!("tempo_{name}"));
    let text = format!(
        "mtx 1\nuse std::glassware::Beaker250mL\nuse std::robots::{{FrankaHand, FrankaPanda}}\n\
         asset Pad: Surface {{ mass: 1 kg, shape: box(120 mm, 120 mm, 20 mm), frame place at (0, 0, 20) mm }}\n\
         lab bench {{\n    ambient: 22 degC\n    panda = FrankaPanda {{ gripper: FrankaHand {{}}{settings} }} at (0, 0, 0) m\n    \
         near = Pad at (0.45, -0.2, 0) m\n    far = Pad at (0.45, 0.2, 0) m\n    cup = Beaker250mL on near\n}}\n\
         workflow run in bench {{\n    {lines}\n}}\n"
    );
    write(&dir, "lab.mtx", text);
    let ended = matterixc_in(&dir, &["run", "lab.mtx", "--fidelity", fidelity, "--out", "out"]);
    assert_eq!(ended.code, 0, "{}{}", ended.out, ended.err);
    if fidelity == "motion" {
        let judged = matterixc_in(&dir, &["verify", "out/recording.mcap"]);
        assert_eq!(judged.code, 0, "{}{}", judged.out, judged.err);
    }
    let after = ended.out.split("passed after ").nth(1).unwrap_or_else(|| panic!("{}", ended.out));
    after.split(' ').next().and_then(|s| s.parse().ok()).expect("a time")
}

const MOVE: &str = "transport cup to far by panda";

/// As at the slider of a teach pendant: all that the joints do takes so much longer, the fingers' part does not.
#[test]
fn a_share_of_the_speed_makes_motions_so_much_longer() {
    let at = |name, settings| lasts(name, settings, MOVE, "motion");
    let [whole, half, quarter] = [at("whole", ""), at("half", ", speed: 0.5"), at("quarter", ", speed: 0.25")];
    let moving = half - whole;
    assert!(moving > 1.0 && moving < whole, "{whole} {half}");
    assert!((quarter - half - 2.0 * moving).abs() < 1e-3 * moving, "{whole} {half} {quarter}");
    // Twice as long takes a quarter of the acceleration.
    assert!((at("gentle", ", acceleration: 0.25") - half).abs() < 1e-3);
    assert!((at("both", ", speed: 0.5, acceleration: 0.9") - half).abs() < 1e-3);
    // Nominal times follow.
    let nominal = |name, settings| lasts(name, settings, MOVE, "process");
    let [whole, half] = [nominal("nominal", ""), nominal("nominal_half", ", speed: 0.5")];
    assert!(half > 1.5 * whole, "{whole} {half}");
}

#[test]
fn a_limit_holds_from_one_step_to_another() {
    for fidelity in ["motion", "process"] {
        let at =
            |name: &str, settings: &str, lines: &str| lasts(&format!("{name}_{fidelity}"), settings, lines, fidelity);
        let fast = at("fast", "", "lift panda by 100 mm\n    lift panda by -100 mm");
        let slow = at("slow", ", speed: 0.5", "lift panda by 100 mm\n    lift panda by -100 mm");
        let first = at(
            "first",
            "",
            "limit panda to 0.5\n    lift panda by 100 mm\n    limit panda to 1\n    lift panda by -100 mm",
        );
        assert!((first - 0.5 * (fast + slow)).abs() < 2e-3, "{fidelity}: {fast} {slow} {first}");
        let both =
            at("twice", ", speed: 0.5", "limit panda to 0.5\n    lift panda by 100 mm\n    lift panda by -100 mm");
        assert!((both - 2.0 * slow).abs() < 2e-3, "{fidelity}: {slow} {both}");
    }
}

/// A tip that may go at 50 mm/s takes 4 s at least for 200 mm, and twice as long at half of that.
#[test]
fn a_tip_goes_no_faster_than_it_may() {
    let at = |name, settings| lasts(name, settings, "lift panda by 200 mm", "motion");
    let free = at("free", "");
    let [slow, slower] = [at("tip", ", tip_speed: 50 mm/s"), at("tip_half", ", tip_speed: 25 mm/s")];
    assert!(free < 2.0 && slow > 4.0 && slow < 8.0, "{free} {slow}");
    assert!((slower - 2.0 * slow).abs() < 1e-3 * slower, "{slow} {slower}");
    assert!((at("tip_fast", ", tip_speed: 5 m/s") - free).abs() < 1e-9);
}

#[test]
fn a_limit_is_a_share() {
    let dir = folder("tempo_share");
    for limit in ["0", "1.5", "-1"] {
        let text = format!(
            "mtx 1\nuse std::robots::FrankaPanda\nlab bench {{ ambient: 22 degC, panda = FrankaPanda at (0, 0, 0) m }}\n\
             workflow run in bench {{ limit panda to {limit} }}\n"
        );
        write(&dir, "lab.mtx", text);
        let ended = matterixc_in(&dir, &["check", "lab.mtx"]);
        assert!(ended.code == 1 && ended.out.contains("`panda` cannot move at "), "{}{}", ended.out, ended.err);
    }
}
