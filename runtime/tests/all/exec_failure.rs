//! Failures: handlers, retry, alternatives, traces.

use matterix_ir::plan::{Operation, Step};
use matterix_runtime::exec::{RunStatus, StepState, diagnostic};

use crate::exec_build::Lab;

#[test]
fn an_unhandled_failure_ends_the_run_with_its_trace() {
    let mut lab = Lab::new();
    let (pause, fail, never) = (lab.wait(2.0), lab.fail("slip"), lab.note("never"));
    let inner = lab.seq(&[pause, fail, never]);
    let skill = lab.skill(&[], &[], inner);
    let root = lab.seq(&[skill]);
    let run = lab.run(root);
    assert_eq!(run.failed(), "slip");
    let failure = run.failure();
    let steps: Vec<_> = failure.steps.iter().map(|s| (s.step, s.started)).collect();
    assert_eq!(steps, [(fail, 2.0), (inner, 0.0), (skill, 0.0), (root, 0.0)]);
    assert_eq!(run.step(never), StepState::Skipped);
    assert_eq!(run.step(skill), StepState::Failed);
    let shown = diagnostic(failure);
    assert_eq!(shown.headline, "the run failed with `slip`: on purpose");
    assert_eq!(shown.span(), lab.program.plan.get(fail).span);
    assert_eq!(shown.labels.len(), 4);
    assert_eq!(shown.labels[2].text, "in `Skill`, started at 0 s");
}

#[test]
fn the_first_matching_handler_takes_a_failure() {
    let mut lab = Lab::new();
    let (fail, a, b, c) = (lab.fail("slip"), lab.note("missed"), lab.note("slip"), lab.note("any"));
    let block = lab.guarded(fail, &[("missed", a), ("slip", b), ("any", c)], None);
    let after = lab.note("after");
    let root = lab.seq(&[block, after]);
    assert_eq!(lab.run(root).passed().notes(), "slip@0 after@0");
}

#[test]
fn a_failure_in_a_handler_goes_to_the_parent_after_finally() {
    let mut lab = Lab::new();
    let (fail, worse, last) = (lab.fail("slip"), lab.fail("worse"), lab.note("finally"));
    let block = lab.guarded(fail, &[("any", worse)], Some(last));
    let caught = lab.note("caught");
    let root = lab.guarded(block, &[("worse", caught)], None);
    assert_eq!(lab.run(root).passed().notes(), "finally@0 caught@0");
}

#[test]
fn retry_starts_the_body_again_at_most_so_often() {
    let mut lab = Lab::new();
    let (pause, turn, fail) = (lab.wait(1.0), lab.note("try"), lab.fail("slip"));
    let body = lab.seq(&[turn, pause, fail]);
    let retry = lab.retry(2.0);
    let last = lab.note("finally");
    let root = lab.guarded(body, &[("slip", retry)], Some(last));
    let run = lab.run(root);
    assert_eq!(run.failed(), "slip");
    assert_eq!(run.notes(), "try@0 try@1 try@2 finally@3");
    assert_eq!(run.failure().time, 3.0);
}

#[test]
fn retry_succeeds_once_the_world_has_changed() {
    let mut lab = Lab::new();
    let x = lab.state("x", 0.0);
    let value = lab.get(x);
    let need = lab.at_least(value, 1.0);
    let work = lab.note("work");
    let body = lab.skill(&[need], &[], work);
    let (fix, retry) = (lab.set(x, 1.0), lab.retry(1.0));
    let handler = lab.seq(&[fix, retry]);
    let root = lab.guarded(body, &[("any", handler)], None);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "work@0");
    assert_eq!(run.outcome.steps[body.0 as usize].runs, 2);
}

#[test]
fn retry_counts_belong_to_one_activation() {
    let mut lab = Lab::new();
    let (turn, fail, retry) = (lab.note("try"), lab.fail("slip"), lab.retry(1.0));
    let body = lab.seq(&[turn, fail]);
    let inner = lab.guarded(body, &[("slip", retry)], None);
    let swallow = lab.wait(1.0);
    let outer = lab.guarded(inner, &[("any", swallow)], None);
    let root = lab.repeat(2.0, outer);
    assert_eq!(lab.run(root).passed().notes(), "try@0 try@0 try@1 try@1");
}

#[test]
fn alternatives_are_tried_in_order() {
    let mut lab = Lab::new();
    let (a, b, c, d) = (lab.fail("one"), lab.fail("two"), lab.note("three"), lab.note("four"));
    let root = lab.step(Step::Try(vec![a, b, c, d]));
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "three@0");
    assert_eq!(run.step(d), StepState::Skipped);
    let (a, b) = (lab.fail("one"), lab.fail("two"));
    let root = lab.step(Step::Try(vec![a, b]));
    assert_eq!(lab.run(root).failed(), "two");
}

#[test]
fn a_timeout_is_a_failure_that_can_be_handled() {
    let mut lab = Lab::new();
    let never = lab.constant(false);
    let wait = lab.wait_until(never, Some(600.0));
    let caught = lab.note("cold");
    let root = lab.guarded(wait, &[("timeout", caught)], None);
    assert_eq!(lab.run(root).passed().notes(), "cold@600");
}

#[test]
fn an_operations_unmet_need_shows_the_condition() {
    let mut lab = Lab::new();
    let need = lab.constant(false);
    let operation = lab.operation("heat");
    let root = lab.op(Operation { needs: vec![need.into()], ..operation });
    let run = lab.run(root);
    assert_eq!(run.failed(), "need");
    assert!(run.log.operations.is_empty());
    assert_eq!(run.failure().text, "`heat` needs `false`, which is false");
}

#[test]
fn keep_is_broken_at_the_exact_time() {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let cool = lab.below(value, 12.5);
    let (long, never, caught) = (lab.wait(100.0), lab.note("never"), lab.note("caught"));
    let body = lab.seq(&[long, never]);
    let keep = lab.keep(cool, body);
    let root = lab.guarded(keep, &[("broken", caught)], None);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "caught@12.5");
    assert!((run.log.failures[0].time - 12.5).abs() < 1e-3);
}

#[test]
fn keep_lets_a_running_operation_end_but_starts_no_other() {
    let mut lab = Lab::new();
    let elapsed = lab.time();
    let early = lab.below(elapsed, 5.0);
    let (first, second) = (lab.busy("first", &[], 8.0), lab.busy("second", &[], 8.0));
    let last = lab.note("finally");
    let body = lab.seq(&[first, second]);
    let body = lab.guarded(body, &[], Some(last));
    let root = lab.keep(early, body);
    let run = lab.run(root);
    assert_eq!(run.failed(), "broken");
    assert_eq!(run.notes(), "finally@8");
    assert!((run.failure().time - 5.0).abs() < 1e-6);
    assert_eq!(run.step(first), StepState::Done);
    assert_eq!(run.step(second), StepState::Skipped);
}

#[test]
fn keep_sees_a_breach_within_an_instant() {
    let mut lab = Lab::new();
    let x = lab.state("x", 0.0);
    let value = lab.get(x);
    let low = lab.below(value, 1.0);
    let (up, down, never) = (lab.set(x, 2.0), lab.set(x, 0.0), lab.note("never"));
    let body = lab.seq(&[up, down, never]);
    let root = lab.keep(low, body);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("broken", ""));
    assert_eq!(run.state(x), 2.0);
}

#[test]
fn keep_that_does_not_hold_at_its_start_never_begins() {
    let mut lab = Lab::new();
    let (no, body) = (lab.constant(false), lab.note("never"));
    let root = lab.keep(no, body);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("broken", ""));
}

#[test]
fn a_jobs_failure_becomes_the_awaits() {
    let mut lab = Lab::new();
    let (pause, fail) = (lab.wait(3.0), lab.fail("leak"));
    let job = lab.seq(&[pause, fail]);
    let (start, wait, never) = (lab.start("pump", job), lab.await_job("pump"), lab.note("never"));
    let body = lab.seq(&[start, wait, never]);
    let caught = lab.note("caught");
    let root = lab.guarded(body, &[("leak", caught)], None);
    assert_eq!(lab.run(root).passed().notes(), "caught@3");
}

#[test]
fn a_jobs_failure_that_nobody_awaits_is_its_blocks() {
    let mut lab = Lab::new();
    let fail = lab.fail("leak");
    let (start, rest) = (lab.start("pump", fail), lab.note("rest"));
    let root = lab.seq(&[start, rest]);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("leak", "rest@0"));
}

#[test]
fn a_failing_block_stops_its_jobs_before_finally() {
    let mut lab = Lab::new();
    let (long, never) = (lab.wait(50.0), lab.note("never"));
    let job = lab.seq(&[long, never]);
    let (start, pause, fail, last) = (lab.start("cooling", job), lab.wait(1.0), lab.fail("slip"), lab.note("finally"));
    let body = lab.seq(&[start, pause, fail]);
    let root = lab.guarded(body, &[], Some(last));
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("slip", "finally@1"));
}

#[test]
fn jobs_can_be_awaited_after_their_block_but_not_before_any() {
    let mut lab = Lab::new();
    let work = lab.wait(5.0);
    let start = lab.start("job", work);
    let block = lab.guarded(start, &[], None);
    let wait = lab.await_job("job");
    let root = lab.seq(&[block, wait]);
    assert_eq!(lab.run(root).passed().outcome.end_time, 5.0);
    let root = lab.await_job("ghost");
    assert_eq!(lab.run(root).failed(), "job");
}

#[test]
fn a_failing_finally_fails_a_good_block_and_is_reported_beside_a_failed_one() {
    let mut lab = Lab::new();
    let (body, bad) = (lab.note("body"), lab.fail("mess"));
    let root = lab.guarded(body, &[], Some(bad));
    assert_eq!(lab.run(root).failed(), "mess");
    let (body, bad, outer) = (lab.fail("slip"), lab.fail("mess"), lab.note("outer"));
    let inner = lab.guarded(body, &[], Some(bad));
    let root = lab.guarded(inner, &[], Some(outer));
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("slip", "outer@0"));
    assert_eq!(run.outcome.suppressed[0].name, "mess");
}

#[test]
fn a_skills_invariant_is_watched_and_checked_at_its_start() {
    let mut lab = Lab::new();
    let elapsed = lab.time();
    let early = lab.below(elapsed, 5.0);
    let invariant = |lab: &mut Lab, condition, body| {
        let (needs, promises) = (Vec::new(), Vec::new());
        lab.step(Step::Skill { verb: "do".into(), needs, invariants: vec![condition], promises, takes: None, body })
    };
    let long = lab.wait(100.0);
    let first = invariant(&mut lab, early.clone(), long);
    let (body, caught) = (lab.note("never"), lab.note("caught"));
    let second = invariant(&mut lab, early, body);
    let first = lab.guarded(first, &[("broken", caught)], None);
    let root = lab.seq(&[first, second]);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("broken", "caught@5"));
}

#[test]
fn retry_reaches_its_handler_from_any_depth() {
    let mut lab = Lab::new();
    let (turn, fail) = (lab.note("try"), lab.fail("slip"));
    let body = lab.seq(&[turn, fail]);
    // Inside the handler: a branch of a `parallel` in a block with a `finally` of its own.
    let (retry, long, last) = (lab.retry(1.0), lab.wait(50.0), lab.note("finally"));
    let both = lab.par(&[long, retry]);
    let ignored = lab.note("ignored");
    let inner = lab.guarded(both, &[("any", ignored)], Some(last));
    let root = lab.guarded(body, &[("slip", inner)], None);
    let run = lab.run(root);
    assert_eq!((run.failed(), run.notes().as_str()), ("slip", "try@0 finally@0 try@0 finally@0"));
    let stray = lab.retry(1.0);
    assert_eq!(lab.run(stray).failure().text, "`retry` is only for handlers");
}

#[test]
fn outcome_status_is_serialised_in_words() {
    assert_eq!(serde_json::to_string(&RunStatus::ExpectationFailed).ok().as_deref(), Some("\"expectation-failed\""));
    let mut lab = Lab::new();
    let root = lab.fail("slip");
    let text = serde_json::to_string(&lab.run(root).outcome).unwrap_or_default();
    assert!(text.contains("\"code\":\"run-failed\""), "{text}");
}
