//! Parallel branches and what they share.

use matterix_ir::plan::{Operation, StepId};
use matterix_runtime::exec::StepState;

use crate::exec_build::Lab;

#[test]
fn a_failing_branch_stops_its_siblings_at_their_next_boundary() {
    let mut lab = Lab::new();
    let (pause, fail) = (lab.wait(2.0), lab.fail("slip"));
    let failing = lab.seq(&[pause, fail]);
    let (work, never) = (lab.busy("work", &[], 5.0), lab.note("never"));
    let working = lab.seq(&[work, never]);
    let long = lab.wait(100.0);
    let last = lab.note("finally");
    let waiting = lab.guarded(long, &[], Some(last));
    let both = lab.par(&[failing, working, waiting]);
    let caught = lab.note("caught");
    let root = lab.guarded(both, &[("slip", caught)], None);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "finally@2 caught@5");
    assert_eq!([work, never, long].map(|s| run.step(s)), [StepState::Done, StepState::Skipped, StepState::Skipped]);
}

#[test]
fn a_second_failure_while_stopping_is_reported_and_not_handled() {
    let mut lab = Lab::new();
    let (pause, fail) = (lab.wait(2.0), lab.fail("first"));
    let failing = lab.seq(&[pause, fail]);
    let never = lab.constant(false);
    let work = lab.busy("work", &[], 5.0);
    // Its promise fails once the operation has ended.
    let skill = lab.skill(&[], &[never], work);
    let handled = lab.note("handled");
    let other = lab.guarded(skill, &[("any", handled)], None);
    let root = lab.par(&[failing, other]);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("first", ""));
    assert_eq!(run.outcome.suppressed[0].name, "promise");
}

#[test]
fn overlapping_operations_outside_claim_fail() {
    let mut lab = Lab::new();
    let panda = lab.instance("panda");
    let (a, b) = (lab.busy("move", &[panda], 5.0), lab.busy("grasp", &[panda], 1.0));
    let pause = lab.wait(2.0);
    let second = lab.seq(&[pause, b]);
    let root = lab.par(&[a, second]);
    let run = lab.run(root);
    assert_eq!(run.failed(), "claimed");
    let failure = run.failure();
    assert_eq!(failure.code.name, "claimed-twice");
    assert_eq!(failure.text, "`grasp` and `move` use `panda` at the same time");
    assert_eq!(failure.time, 2.0);
}

#[test]
fn commands_of_one_instant_in_two_branches_fail_but_not_in_one() {
    let mut lab = Lab::new();
    let plate = lab.instance("hotplate");
    let at_once = |lab: &mut Lab, verb: &str| {
        let operation = lab.operation(verb);
        lab.op(Operation { claims: vec![plate], ..operation })
    };
    let (a, b) = (at_once(&mut lab, "heat"), at_once(&mut lab, "stop heating"));
    let root = lab.par(&[a, b]);
    assert_eq!(lab.run(root).failed(), "claimed");
    let (a, b) = (at_once(&mut lab, "heat"), at_once(&mut lab, "stop heating"));
    let root = lab.seq(&[a, b]);
    lab.run(root).passed();
    let (a, b) = (at_once(&mut lab, "heat"), at_once(&mut lab, "stop heating"));
    let (a, b) = (lab.claim(&[plate], a), lab.claim(&[plate], b));
    let root = lab.par(&[a, b]);
    lab.run(root).passed();
}

#[test]
fn claims_are_granted_in_the_order_of_asking() {
    let mut lab = Lab::new();
    let panda = lab.instance("panda");
    let branch = |lab: &mut Lab, name: &str, delay: f64| {
        let (pause, work, note) = (lab.wait(delay), lab.busy("work", &[panda], 10.0), lab.note(name));
        let body = lab.seq(&[note, work]);
        let claim = lab.claim(&[panda], body);
        lab.seq(&[pause, claim])
    };
    let branches = [branch(&mut lab, "c", 3.0), branch(&mut lab, "a", 0.0), branch(&mut lab, "b", 1.0)];
    let root = lab.par(&branches);
    assert_eq!(lab.run(root).passed().notes(), "a@0 b@10 c@20");
}

#[test]
fn a_claim_waits_for_an_operation_outside_and_holds_against_one() {
    let mut lab = Lab::new();
    let panda = lab.instance("panda");
    let (outside, inside, note) =
        (lab.busy("outside", &[panda], 4.0), lab.busy("inside", &[panda], 1.0), lab.note("in"));
    let body = lab.seq(&[note, inside]);
    let claim = lab.claim(&[panda], body);
    let root = lab.par(&[outside, claim]);
    assert_eq!(lab.run(root).passed().notes(), "in@4");
    let (pause, long) = (lab.wait(1.0), lab.wait(9.0));
    let claim = lab.claim(&[panda], long);
    let outside = lab.busy("outside", &[panda], 4.0);
    let second = lab.seq(&[pause, outside]);
    let root = lab.par(&[claim, second]);
    let run = lab.run(root);
    assert_eq!(run.failed(), "claimed");
    assert!(run.failure().text.starts_with("`outside` uses `panda` while `claim "));
}

#[test]
fn nested_claims_of_the_same_instance_do_not_wait() {
    let mut lab = Lab::new();
    let panda = lab.instance("panda");
    let work = lab.busy("work", &[panda], 1.0);
    let inner = lab.claim(&[panda], work);
    let root = lab.claim(&[panda], inner);
    assert_eq!(lab.run(root).passed().outcome.end_time, 1.0);
}

fn crossed(lab: &mut Lab) -> StepId {
    let (a, b) = (lab.instance("panda"), lab.instance("scale"));
    let branch = |lab: &mut Lab, first, second| {
        let (pause, work) = (lab.wait(1.0), lab.wait(1.0));
        let inner = lab.claim(&[second], work);
        let body = lab.seq(&[pause, inner]);
        let claim = lab.claim(&[first], body);
        let last = lab.note("finally");
        lab.guarded(claim, &[], Some(last))
    };
    let branches = [branch(lab, a, b), branch(lab, b, a)];
    lab.par(&branches)
}

#[test]
fn crossed_claims_are_a_deadlock_that_names_both() {
    let mut lab = Lab::new();
    let root = crossed(&mut lab);
    let run = lab.run(root);
    let fault = run.fault();
    assert_eq!(fault.code.name, "deadlock");
    assert_eq!(fault.time, 1.0);
    assert!(fault.text.contains("waits for `scale`, which `claim") && fault.text.contains("waits for `panda`"));
    assert_eq!(run.notes(), "finally@1 finally@1");
}

#[test]
fn fairness_yields_where_it_alone_would_block() {
    let mut lab = Lab::new();
    let (x, y) = (lab.instance("x"), lab.instance("y"));
    // The first holds y and later wants x; the second asks for both in between.
    let (pause, work) = (lab.wait(2.0), lab.wait(1.0));
    let inner = lab.claim(&[x], work);
    let body = lab.seq(&[pause, inner]);
    let first = lab.claim(&[y], body);
    let (delay, note) = (lab.wait(1.0), lab.note("both"));
    let both = lab.claim(&[x, y], note);
    let second = lab.seq(&[delay, both]);
    let root = lab.par(&[first, second]);
    assert_eq!(lab.run(root).passed().notes(), "both@3");
}

#[test]
fn a_job_that_awaits_itself_is_a_deadlock() {
    let mut lab = Lab::new();
    let wait = lab.await_job("me");
    let root = lab.start("me", wait);
    assert_eq!(lab.run(root).fault().code.name, "deadlock");
}

#[test]
fn an_operation_in_finally_waits_for_its_instance() {
    let mut lab = Lab::new();
    let plate = lab.instance("hotplate");
    let (fail, off) = (lab.fail("slip"), lab.busy("stop heating", &[plate], 0.0));
    let caught = lab.note("off");
    let block = lab.guarded(fail, &[], Some(off));
    let block = lab.guarded(block, &[("any", caught)], None);
    let busy = lab.busy("stir", &[plate], 6.0);
    let root = lab.par(&[busy, block]);
    assert_eq!(lab.run(root).passed().notes(), "off@6");
}

/// A command that is over at once and sets a state of a device; `reads` is what its needs look at.
fn sets(lab: &mut Lab, verb: &str, device: matterix_ir::scene::InstanceId, state: u32, reads: &[u32]) -> StepId {
    let value = lab.number(1.0);
    let action = matterix_ir::model::Action::Assign { state, value, span: matterix_ir::Span::default() };
    let operation = lab.operation(verb);
    lab.op(Operation { claims: vec![device], at_start: vec![action], reads: reads.to_vec(), ..operation })
}

#[test]
fn commands_of_one_instant_meet_where_neither_touches_what_the_other_does() {
    let mut lab = Lab::new();
    let plate = lab.instance("hotplate");
    let (heating, stirring) = (lab.state("heating", 0.0), lab.state("stirring", 0.0));
    let (a, b) = (sets(&mut lab, "heat", plate, heating, &[]), sets(&mut lab, "stir", plate, stirring, &[]));
    let root = lab.par(&[a, b]);
    lab.run(root).passed();
    // Both set the same.
    let (a, b) = (sets(&mut lab, "heat", plate, heating, &[]), sets(&mut lab, "cool", plate, heating, &[]));
    let root = lab.par(&[a, b]);
    assert_eq!(lab.run(root).failed(), "claimed");
    // One needs what the other one sets.
    let (a, b) = (sets(&mut lab, "heat", plate, heating, &[]), sets(&mut lab, "stir", plate, stirring, &[heating]));
    let root = lab.par(&[a, b]);
    assert_eq!(lab.run(root).failed(), "claimed");
    // One of them lasts.
    let (a, b) = (lab.busy("spin", &[plate], 5.0), sets(&mut lab, "stir", plate, stirring, &[]));
    let root = lab.par(&[a, b]);
    assert_eq!(lab.run(root).failed(), "claimed");
}
