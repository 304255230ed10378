//! Delayed events and tables, against what they are by hand.

use serde_json::Value;

use crate::harness::{folder, matterixc, write};

const LAMP: &str = "mtx 1
capability Lamp: Body {
    state wanted: Bool = false
    state lit: Bool = false
    state times: Ratio = 0
    state delay: Duration = 2 s
    command want
        effect wanted = true
    command spare
        effect wanted = false
    command delay by(t: Duration)
        effect delay = t
    event lights when wanted HOW {
        lit = true
        times = times + 1
    }
}
asset Bulb: Lamp { mass: 20 g }
lab bench { ambient: 22 degC, bulb = Bulb at (0, 0, 0) m }
workflow use in bench {
";

fn lamp(how: &str, steps: &str) -> String {
    format!("{}{steps}\n}}\n", LAMP.replace("HOW", how))
}

fn findings(name: &str, text: &str) -> Vec<String> {
    let file = write(&folder(&format!("delayed_{name}")), "lamp.mtx", text);
    let lines = matterixc(&["check", "--format", "json", &file]).out_lines();
    lines.iter().map(|d| d["code"].as_str().unwrap_or_default().to_owned()).collect()
}

/// When an event of this name happened, s.
fn times(name: &str, text: &str, event: &str) -> (i32, Vec<f64>) {
    let file = write(&folder(&format!("delayed_{name}_run")), "lamp.mtx", text);
    let ran = matterixc(&["run", "--format", "json", &file]);
    let report: Value =
        serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{name}: {e}: {}{}", ran.out, ran.err));
    let all = report["events"].as_array().into_iter().flatten();
    let mine = all.filter(|e| e["name"] == event);
    (ran.code, mine.map(|e| e["time"].as_f64().expect("a time")).collect())
}

#[test]
fn what_has_to_hold_begins_anew() {
    let steps = "want by bulb\nwait 1 s\nspare by bulb\nwait 1 s\nwant by bulb\nwait 5 s";
    assert_eq!(times("anew", &lamp("for 2 s", steps), "lights(bulb)"), (0, vec![4.0]));
    assert_eq!(times("anew", &lamp("for 2 s", steps), "lights(bulb).called_off"), (0, vec![1.0]));
}

#[test]
fn what_is_only_late_happens_all_the_same() {
    let steps = "want by bulb\nwait 1 s\nspare by bulb\nwait 5 s\nwant by bulb\nwait 5 s";
    assert_eq!(times("late", &lamp("after 2 s", steps), "lights(bulb)"), (0, vec![2.0, 8.0]));
}

#[test]
fn the_delay_is_that_of_when_it_was_set_off() {
    let steps = "want by bulb\nwait 1 s\ndelay bulb by 30 s\nwait 9 s";
    assert_eq!(times("taken", &lamp("after delay", steps), "lights(bulb)"), (0, vec![2.0]));
}

#[test]
fn one_that_is_still_to_happen_is_not_set_off_again() {
    let steps = "want by bulb\nwait 1 s\nspare by bulb\nwant by bulb\nwait 5 s";
    let text = lamp("after 2 s", steps);
    assert_eq!(findings("again", &text), ["event-pending"]);
    let taken = lamp("after 2 s", &steps.replace("wait 5 s", "try { wait 5 s } on event_pending { }"));
    assert_eq!(findings("again_taken", &taken), Vec::<String>::new());
    assert_eq!(times("again_taken", &taken, "lights(bulb)").0, 0);
}

#[test]
fn a_delay_is_a_time_from_0_on() {
    assert_eq!(findings("below", &lamp("after -2 s", "wait 1 s")), ["out-of-range"]);
    assert_eq!(findings("volume", &lamp("for 2 mL", "wait 1 s")), ["unit-mismatch"]);
    let turned =
        lamp("after delay", "want by bulb\nwait 1 s").replace("delay: Duration = 2 s", "delay: Duration = 2 s - 3 s");
    assert_eq!(findings("turned", &turned), ["out-of-range"]);
}

/// Numbers that look drawn at random.
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

#[test]
fn trains_of_pulses_are_followed() {
    let mut draw = Draw(7);
    for number in 0..12 {
        let delay = 0.5 + draw.below(6) as f64;
        let (mut steps, mut now, mut on, mut since, mut expected) = (String::new(), 0.0, false, 0.0, Vec::new());
        for _ in 0..12 {
            let pause = 1.0 + draw.below(8) as f64;
            on = !on;
            steps += if on { "want by bulb\n" } else { "spare by bulb\n" };
            steps += &format!("wait {pause} s\n");
            if on {
                since = now;
            }
            now += pause;
            if on && now - since > delay {
                expected.push(since + delay);
            }
        }
        let (code, found) = times(&format!("train{number}"), &lamp(&format!("for {delay} s"), &steps), "lights(bulb)");
        assert_eq!((code, found), (0, expected), "{steps}");
    }
}

const FLUID: &str = "mtx 1
capability Warmed: Body {
    state level: Length = 0 mm
    state seen: Ratio = 0
    derived read: Ratio = interpolate(level, [TABLE])
    process rising { level' += 1 mm / 1 s }
    process reading { seen' += read / 1 s }
}
asset Tank: Warmed { mass: 20 g }
lab bench { ambient: 22 degC, tank = Tank at (0, 0, 0) m }
workflow fill in bench {
    wait 10 s
    expect tank.seen in RANGE
}
";

fn fluid(table: &str, range: &str) -> String {
    FLUID.replace("TABLE", table).replace("RANGE", range)
}

#[test]
fn a_table_is_straight_between_its_points() {
    // Areas of trapezia: (1 + 3) / 2 * 4 + (3 + 2) / 2 * 1 + (2 + 0) / 2 * 5.
    let text = fluid("(0 mm, 1), (4 mm, 3), (5 mm, 2), (10 mm, 0), (11 mm, 0)", "15.4999999 .. 15.5000001");
    assert_eq!(findings("table", &text), Vec::<String>::new());
    assert_eq!(times("table", &text, "").0, 0);
    // Of many points the same.
    let square: Vec<String> =
        (0..=44).map(|i| format!("({} mm, {})", f64::from(i) / 4.0, f64::from(i * i) / 16.0)).collect();
    // The sum of trapezia of x^2 exceeds the integral by h^2 / 12 for each unit: 1000 / 3 + 10 / (12 * 16) * 2.
    let text = fluid(&square.join(", "), "333.43749 .. 333.43751");
    assert_eq!(times("square", &text, "").0, 0, "{text}");
}

#[test]
fn a_table_has_an_end() {
    let text = fluid("(0 mm, 1), (4 mm, 3), (5 mm, 2)", "0 .. 100");
    let file = write(&folder("delayed_end"), "tank.mtx", &text);
    let ran = matterixc(&["run", &file]);
    assert_eq!(ran.code, 1);
    let said = ran.out + &ran.err;
    assert!(said.contains("not-a-number") && said.contains("read outside its"), "{said}");
}

#[test]
fn what_is_no_table_is_said() {
    for (name, table) in [
        ("one", "(0 mm, 1)"),
        ("falls", "(0 mm, 1), (2 mm, 1), (1 mm, 3)"),
        ("twice", "(0 mm, 1), (1 mm, 1), (1 mm, 3)"),
        ("moves", "(0 mm, 1), (level, 3)"),
    ] {
        assert_eq!(findings(name, &fluid(table, "0 .. 100")), ["wrong-arguments"], "{name}");
    }
    for (name, table) in [("volume", "(0 mL, 1), (10 mL, 3)"), ("mixed", "(0 mm, 1), (10 mm, 3 s)")] {
        assert_eq!(findings(name, &fluid(table, "0 .. 100")), ["unit-mismatch"], "{name}");
    }
    assert_eq!(findings("triple", &fluid("(0 mm, 1, 2), (10 mm, 3, 4)", "0 .. 100")), ["type-mismatch"]);
}

#[test]
fn a_wait_beside_what_sets_it_off_is_of_no_known_length() {
    let clock = "capability Clock: Body {
    state phase: Duration = 0 s
    process goes { phase' += 1 }
}
asset Wall: Clock { mass: 1 kg }
lab bench { ambient: 22 degC, wall = Wall at (1, 0, 0) m, ";
    for how in ["", "for 2 s", "after 2 s"] {
        let steps = "parallel {
    sequence { want by bulb; wait 2.5 s }
    sequence { wait until bulb.times >= 1 timeout 20 s; expect elapsed in 0 s .. 2.01 s }
}";
        let text = lamp(how, steps).replace("lab bench { ambient: 22 degC, ", clock);
        assert_eq!(findings("beside", &text), Vec::<String>::new(), "{how}");
        assert_eq!(times("beside", &text, "").0, 0, "{how}");
    }
}

/// What a run says of conditions on a state that moves evenly, so that the steps are long.
#[test]
fn conditions_that_come_and_go_within_a_step_are_met() {
    const PHASE: &str = "mtx 1
capability Phase: Body {
    state x: Ratio = 0
    state n: Ratio = 0
    derived q: Ratio = (x - 400) * (x - 410) * (x - 600) * (x - 610)
    process goes { x' += 1 / 1 s }
    event counts when CONDITION { n = n + 1 }
}
asset Wheel: Phase { mass: 1 kg }
lab bench { ambient: 22 degC, w = Wheel at (0, 0, 0) m }
workflow turn in bench {
STEPS
}
";
    let text = |condition: &str, steps: &str| PHASE.replace("CONDITION", condition).replace("STEPS", steps);
    for (name, condition, count) in [
        ("saw", "x - 10 * floor(x / 10) >= 5", 100),
        ("wave", "sin(5 * x * 1 rad) > 0.5", 796),
        ("cosine", "cos(x * 360 deg) > 0.9", 1001),
        ("quartic", "q < 0", 2),
        ("parabola", "x ^ 2 - 1624.44 * x + 659701.3184 < 0", 1),
        ("cubic", "(x - 700.5) ^ 3 * (x - 700.6) < 0 and x > 1", 1),
        ("ratio", "1 / (0.01 + (x - 812) ^ 2) > 50", 1),
        ("kink", "abs(x - 333) < 0.25", 1),
    ] {
        let (code, found) = times(name, &text(condition, "wait 1000 s"), "counts(w)");
        assert_eq!((code, found.len()), (0, count), "{condition}");
    }
    let ends = [
        ("until", "wait until w.q < 0 timeout 1000 s\nexpect elapsed in 399.999 s .. 400.001 s", 0),
        ("hold", "hold w.q >= 0 for 500 s timeout 2000 s\nexpect elapsed in 1109.999 s .. 1110.001 s", 0),
        ("keep", "keep w.q >= 0 { wait 1000 s }", 1),
    ];
    for (name, steps, wanted) in ends {
        assert_eq!(times(name, &text("x < 0", steps), "").0, wanted, "{steps}");
    }
    let counted = text("x - 10 * floor(x / 10) >= 5", "wait 60 s\nexpect w.n == 6");
    assert_eq!(findings("counted", &counted), Vec::<String>::new());
}

#[test]
fn a_condition_has_no_value_beyond_a_table() {
    let text = fluid("(0 mm, 1), (4 mm, 3), (5 mm, 2)", "0 .. 100")
        .replace("process reading { seen' += read / 1 s }", "event high when read > 2.5 for 20 s { seen = 1 }");
    let file = write(&folder("delayed_beyond"), "tank.mtx", &text);
    let ran = matterixc(&["run", &file]);
    let said = ran.out + &ran.err;
    assert!(ran.code == 1 && said.contains("the condition has no value"), "{said}");
}
