//! How close `check` comes to what a wait reaches: the page of `not-reached` states it.

use crate::harness::{folder, matterixc, write};

/// How `check` and a run end for some steps of a plate with a cup.
fn ended(name: &str, steps: &str) -> (i32, i32) {
    let text = format!(
        "mtx 1
use std::glassware::Beaker100mL
use std::heating::IkaRetControl
lab bench {{
    ambient: 22 degC
    plate = IkaRetControl at (0, 0, 0) m
    cup = Beaker100mL on plate holding 60 g of water
}}
workflow w in bench {{
    {steps}
}} finally {{ stop heating plate }}
"
    );
    let file = write(&folder(&format!("reached_{name}")), "w.mtx", text);
    (matterixc(&["check", &file]).code, matterixc(&["run", &file]).code)
}

#[test]
fn what_lies_between_the_set_point_and_what_a_heater_may_aim_at_is_left_to_the_run() {
    let wait = |goal: &str| format!("heat plate to 60 degC; wait until plate.temperature >= {goal} degC timeout 1 h");
    // It may aim 4 * 0.5 W/K * 38 K / (40 W/K) above its set point; less what it loses that is 61.3 degC.
    assert_eq!(ended("set_point", &wait("60")), (0, 0));
    assert_eq!(ended("aim", &wait("61.2")), (0, 1));
    assert_eq!(ended("beyond", &wait("61.4")).0, 1);
}

#[test]
fn a_time_that_full_power_would_need_is_found() {
    let wait = |time: u32| format!("heat plate to 60 degC; wait until plate.temperature >= 60 degC timeout {time} s");
    // 38 K of 900 J/K take 57 s of 600 W; the run takes 108 s.
    assert_eq!(ended("short", &wait(50)).0, 1);
    assert_eq!(ended("shortish", &wait(60)), (0, 1));
    assert_eq!(ended("long", &wait(120)), (0, 0));
}

#[test]
fn a_wait_for_a_time_asks_for_no_temperature() {
    assert_eq!(ended("timed", "heat plate to 60 degC; wait 1 min"), (0, 0));
    let asked = "heat plate to 60 degC; wait 10 s; expect plate.temperature >= 59 degC";
    assert_eq!(ended("expected", asked).0, 1);
}
