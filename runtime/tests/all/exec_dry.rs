//! The dry run: nominal durations, logical states, assumptions.

use matterix_ir::plan::{Operation, Step, Takes};
use matterix_runtime::exec::{RunStatus, Verdict};

use crate::exec_build::Lab;

#[test]
fn logical_states_are_followed_and_continuous_ones_assumed() {
    let mut lab = Lab::new();
    let on = lab.state("on", 0.0);
    let x = lab.ramp("x", on);
    let (value, switch) = (lab.get(x), lab.get(on));
    let (running, hot) = (lab.at_least(switch, 1.0), lab.at_least(value, 50.0));
    let set = lab.set(on, 1.0);
    let wait = lab.wait_until(hot.clone(), Some(60.0));
    let after = lab.note("after");
    let needing = lab.skill(&[running], &[], after);
    let expect = lab.step(Step::Expect(vec![hot.clone()]));
    let hold = lab.hold(hot, 15.0, None);
    let last = lab.note("last");
    let root = lab.seq(&[set, wait, needing, expect, hold, last]);
    let run = lab.dry(root).passed();
    assert_eq!(run.notes(), "after@0 last@15");
    assert_eq!(run.outcome.assumptions.len(), 2);
    assert_eq!(run.outcome.expectations[0].verdict, Verdict::NotObserved);
    assert_eq!(run.outcome.states, [Some(1.0), None]);
}

#[test]
fn a_need_that_is_known_not_to_hold_fails() {
    let mut lab = Lab::new();
    let on = lab.state("on", 0.0);
    let switch = lab.get(on);
    let need = lab.at_least(switch, 1.0);
    let body = lab.note("never");
    let root = lab.skill(&[need], &[], body);
    assert_eq!(lab.dry(root).failed(), "need");
}

#[test]
fn time_is_known() {
    let mut lab = Lab::new();
    let elapsed = lab.time();
    let late = lab.at_least(elapsed, 1010.6);
    let nominal = lab.number(8.0);
    let operation = lab.operation("place");
    let takes = Some(Takes { nominal, bounds: None });
    let place = lab.op(Operation { takes, ..operation });
    let wait = lab.wait_until(late, None);
    let root = lab.seq(&[place, wait]);
    let run = lab.dry(root).passed();
    assert!((run.outcome.end_time - 1010.6).abs() < 2e-3);
}

#[test]
fn loops_on_what_is_not_known_take_one_turn() {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let condition = lab.below(value, 1.0);
    let (max, body) = (lab.number(10.0), lab.note("turn"));
    let root = lab.step(Step::RepeatWhile { condition, max, body });
    let run = lab.dry(root);
    assert_eq!((run.outcome.status, run.notes().as_str()), (RunStatus::Passed, "turn@0"));
}
