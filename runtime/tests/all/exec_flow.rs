//! Control flow that goes well: order, time, loops, jobs.

use matterix_ir::plan::{Operation, Step, Takes};
use matterix_runtime::exec::{OperationState, RunStatus, StepState, Verdict};

use crate::exec_build::{Lab, unit};

#[test]
fn sequence_waits_add_up_and_parallel_waits_for_the_longest() {
    let mut lab = Lab::new();
    let (w1, w2, w3) = (lab.wait(1.0), lab.wait(5.0), lab.wait(2.5));
    let (a, b, c) = (lab.note("a"), lab.note("b"), lab.note("c"));
    let (left, right) = (lab.seq(&[w2, a]), lab.seq(&[w3, b]));
    let both = lab.par(&[left, right]);
    let root = lab.seq(&[w1, both, c]);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "b@3.5 a@6 c@6");
    assert_eq!(run.outcome.end_time, 6.0);
    assert!(run.outcome.steps.iter().all(|s| s.state == StepState::Done && s.runs == 1));
    assert_eq!(run.outcome.steps[left.0 as usize].started, Some(1.0));
}

#[test]
fn effects_apply_at_the_start_of_commands_and_at_the_end_of_skills() {
    let mut lab = Lab::new();
    let (x, y) = (lab.state("x", 0.0), lab.state("y", 0.0));
    let (one, two) = (lab.assign(x, 1.0), lab.assign(y, 2.0));
    let nominal = lab.number(6.0);
    let takes = Some(Takes { nominal, bounds: None });
    let operation = lab.operation("grasp");
    let grasp = lab.op(Operation { at_start: vec![one], at_end: vec![two], takes, ..operation });
    let value = vec![lab.get(x), lab.get(y)];
    let every = lab.number(3.0);
    let record = lab.step(Step::Record { name: "r".into(), value, unit: unit(), every });
    let pause = lab.wait(3.0);
    let root = lab.seq(&[record, grasp, pause]);
    let run = lab.run(root).passed();
    let seen: Vec<_> = run.log.records.iter().map(|(t, _, v)| (*t, v[0], v[1])).collect();
    assert_eq!(seen, [(0.0, 0.0, 0.0), (3.0, 1.0, 0.0), (6.0, 1.0, 0.0), (9.0, 1.0, 2.0)]);
    let states: Vec<_> = run.log.operations.iter().map(|(t, _, s)| (*t, *s)).collect();
    assert_eq!(states, [(0.0, OperationState::Started), (6.0, OperationState::Ended)]);
}

#[test]
fn an_operation_with_until_lasts_until_the_crossing() {
    let mut lab = Lab::new();
    let on = lab.state("on", 0.0);
    let x = lab.ramp("x", on);
    let (switch, value) = (lab.assign(on, 1.0), lab.get(x));
    let until = Some(lab.at_least(value, 7.25));
    let operation = lab.operation("pump");
    let pump = lab.op(Operation { at_start: vec![switch], until, ..operation });
    let after = lab.note("after");
    let root = lab.seq(&[pump, after]);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "after@7.25");
    assert!((run.state(x) - 7.25).abs() < 1e-6);
}

#[test]
fn wait_until_ends_at_the_crossing_or_at_once() {
    let mut lab = Lab::new();
    let on = lab.state("on", 1.0);
    let x = lab.ramp("x", on);
    let value = lab.get(x);
    let first = lab.at_least(value, 3.5);
    let again = lab.at_least(value, 2.0);
    let elapsed = lab.time();
    let later = lab.at_least(elapsed, 1010.6);
    let steps = [
        lab.wait_until(first, None),
        lab.note("a"),
        lab.wait_until(again, Some(1.0)),
        lab.note("b"),
        lab.wait_until(later, None),
        lab.note("c"),
    ];
    let root = lab.seq(&steps);
    assert_eq!(lab.run(root).passed().notes(), "a@3.5 b@3.5 c@1010.6");
}

#[test]
fn if_takes_one_branch_and_skips_the_other() {
    let mut lab = Lab::new();
    let (yes, no) = (lab.constant(true), lab.constant(false));
    let (a, b, c) = (lab.note("a"), lab.note("b"), lab.note("c"));
    let first = lab.step(Step::If { condition: yes, then: a, otherwise: Some(b) });
    let second = lab.step(Step::If { condition: no, then: c, otherwise: None });
    let root = lab.seq(&[first, second]);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "a@0");
    assert_eq!([a, b, c].map(|s| run.step(s)), [StepState::Done, StepState::Skipped, StepState::Skipped]);
}

#[test]
fn repeat_counts_and_refuses_fractions() {
    let mut lab = Lab::new();
    let (pause, tick) = (lab.wait(2.0), lab.note("t"));
    let body = lab.seq(&[pause, tick]);
    let root = lab.repeat(3.0, body);
    let run = lab.run(root).passed();
    assert_eq!(run.notes(), "t@2 t@4 t@6");
    assert_eq!(run.outcome.steps[tick.0 as usize].runs, 3);
    let nothing = lab.note("n");
    let root = lab.repeat(2.5, nothing);
    assert_eq!(lab.run(root).fault().code.name, "unusable-number");
}

#[test]
fn repeat_while_looks_before_each_turn_and_fails_beyond_its_maximum() {
    let mut lab = Lab::new();
    let elapsed = lab.time();
    let condition = lab.below(elapsed, 5.0);
    let max = lab.number(3.0);
    let body = lab.wait(2.0);
    let root = lab.step(Step::RepeatWhile { condition: condition.clone(), max, body });
    assert_eq!(lab.run(root).passed().outcome.end_time, 6.0);
    let max = lab.number(2.0);
    let body = lab.wait(2.0);
    let root = lab.step(Step::RepeatWhile { condition, max, body });
    let run = lab.run(root);
    assert_eq!(run.failed(), "max");
    assert_eq!(run.outcome.end_time, 4.0);
}

#[test]
fn named_steps_keep_their_times_and_within_bounds_the_start() {
    for (pause, status) in [(300.0, RunStatus::Passed), (300.5, RunStatus::Failed)] {
        let mut lab = Lab::new();
        let (start, end) = (lab.local("grow.start"), lab.local("grow.end"));
        let grow = lab.wait(10.0);
        let named = lab.step(Step::Named { name: "grow".into(), start, end, body: grow });
        let (limit, since) = (lab.number(300.0), lab.program.model.graph.add(matterix_ir::Op::Local(end)));
        let filter = lab.wait(1000.0);
        let within = lab.step(Step::Within { limit, since, body: filter });
        let pause = lab.wait(pause);
        let root = lab.seq(&[named, pause, within]);
        let run = lab.run(root);
        assert_eq!(run.outcome.status, status);
        if status == RunStatus::Failed {
            assert_eq!(run.failed(), "late");
            assert_eq!(run.outcome.end_time, 310.5);
        }
    }
}

#[test]
fn within_before_its_step_has_run_is_a_fault() {
    let mut lab = Lab::new();
    let end = lab.local("grow.end");
    let (limit, since) = (lab.number(300.0), lab.program.model.graph.add(matterix_ir::Op::Local(end)));
    let body = lab.note("n");
    let root = lab.step(Step::Within { limit, since, body });
    assert_eq!(lab.run(root).fault().code.name, "unusable-number");
}

#[test]
fn let_keeps_the_value_of_its_instant() {
    let mut lab = Lab::new();
    let (kept, elapsed) = (lab.local("kept"), lab.time());
    let wait = lab.wait(4.0);
    let bind = lab.step(Step::Let { local: kept, value: elapsed });
    let again = {
        let duration = lab.program.model.graph.add(matterix_ir::Op::Local(kept));
        lab.step(Step::Wait { duration })
    };
    let root = lab.seq(&[wait, bind, again]);
    assert_eq!(lab.run(root).passed().outcome.end_time, 8.0);
}

#[test]
fn expectations_are_judged_and_do_not_stop() {
    let mut lab = Lab::new();
    let elapsed = lab.time();
    let (good, bad) = (lab.at_least(elapsed, 0.0), lab.at_least(elapsed, 1.0));
    let expect = lab.step(Step::Expect(vec![good, bad]));
    let after = lab.note("after");
    let root = lab.seq(&[expect, after]);
    let run = lab.run(root);
    assert_eq!(run.outcome.status, RunStatus::ExpectationFailed);
    assert_eq!(run.notes(), "after@0");
    let verdicts: Vec<_> = run.outcome.expectations.iter().map(|e| e.verdict).collect();
    assert_eq!(verdicts, [Verdict::Passed, Verdict::Failed]);
    let compared = &run.outcome.expectations[1].compared[0];
    assert_eq!((compared.value, compared.low), (Some(0.0), Some(1.0)));
    let diagnostic = matterix_runtime::exec::expectation_diagnostic(&run.outcome.expectations[1]);
    assert_eq!(diagnostic.labels[0].text, "`a`: 0, lower limit 1");
}

#[test]
fn jobs_run_beside_and_are_joined_by_their_block() {
    let mut lab = Lab::new();
    let (work, rest, late) = (lab.wait(10.0), lab.wait(1.0), lab.wait(30.0));
    let (done, joined, after) = (lab.note("job"), lab.note("joined"), lab.note("after"));
    let body = lab.seq(&[work, done]);
    let (start, wait) = (lab.start("cooling", body), lab.await_job("cooling"));
    let unawaited = lab.start("other", late);
    let inner = lab.seq(&[start, unawaited, rest, wait, joined]);
    let block = lab.guarded(inner, &[], None);
    let root = lab.seq(&[block, after]);
    assert_eq!(lab.run(root).passed().notes(), "job@10 joined@10 after@30");
}

#[test]
fn hold_starts_its_clock_again_after_a_break() {
    let mut lab = Lab::new();
    // Holds in 2 .. 4 and from 6 on.
    let elapsed = lab.time();
    let (from, to, again) = (lab.at_least(elapsed, 2.0), lab.at_least(elapsed, 4.0), lab.at_least(elapsed, 6.0));
    let graph = &mut lab.program.model.graph;
    let before = graph.unary(matterix_ir::UnaryOp::Not, to.node);
    let first = graph.binary(matterix_ir::BinaryOp::And, from.node, before);
    let node = graph.binary(matterix_ir::BinaryOp::Or, first, again.node);
    let condition = lab.condition(node, "in range", None);
    let hold = lab.hold(condition.clone(), 3.0, None);
    let run = lab.run(hold).passed();
    assert!((run.outcome.end_time - 9.0).abs() < 1e-6, "{}", run.outcome.end_time);
    let hold = lab.hold(condition, 3.0, Some(8.0));
    let run = lab.run(hold);
    assert_eq!(run.failed(), "timeout");
    assert_eq!(run.outcome.end_time, 8.0);
}

#[test]
fn skills_check_needs_promises_and_duration() {
    let mut lab = Lab::new();
    let x = lab.state("x", 0.0);
    let value = lab.get(x);
    let (need, promise) = (lab.below(value, 1.0), lab.at_least(value, 2.0));
    let set = lab.set(x, 2.0);
    let good = lab.skill(std::slice::from_ref(&need), std::slice::from_ref(&promise), set);
    let nothing = lab.wait(1.0);
    let unmet = lab.skill(&[need], &[], nothing);
    let root = lab.seq(&[good, unmet]);
    let run = lab.run(root);
    assert_eq!(run.failed(), "need");
    let failure = run.failure();
    assert_eq!(failure.code.name, "need-unmet");
    assert_eq!(failure.text, "`Skill` needs `a < limit`, which is false");
    assert_eq!(failure.measured[0].value, Some(2.0));
    let nothing = lab.wait(1.0);
    let root = lab.skill(&[], &[promise], nothing);
    assert_eq!(lab.run(root).failed(), "promise");
    let (low, nominal, high) = (lab.number(4.0), lab.number(5.0), lab.number(6.0));
    let body = lab.wait(7.0);
    let takes = Some(Takes { nominal, bounds: Some((low, high)) });
    let (needs, invariants, promises) = (Vec::new(), Vec::new(), Vec::new());
    let root = lab.step(Step::Skill { verb: "do".into(), needs, invariants, promises, takes, body });
    assert_eq!(lab.run(root).failure().text, "`Skill` took 7 s, outside its bounds 4 s .. 6 s");
}

#[test]
fn nesting_is_bounded_by_memory_only() {
    let mut lab = Lab::new();
    let mut step = lab.wait(1.0);
    for _ in 0..3_000 {
        step = lab.seq(&[step]);
    }
    assert_eq!(lab.run(step).passed().outcome.end_time, 1.0);
}

#[test]
fn a_plan_that_is_no_tree_is_refused() {
    let mut lab = Lab::new();
    let twice = lab.note("n");
    let root = lab.seq(&[twice, twice]);
    assert_eq!(lab.run(root).fault().text, "step 0 of the plan is in two places");
    let missing = lab.seq(&[matterix_ir::plan::StepId(99)]);
    assert_eq!(lab.run(missing).fault().text, "the plan has no step 99");
}
